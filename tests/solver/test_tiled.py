"""Fields of which saves share what is the same."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest

from app.model.recipe import Recipe
from app.work.checkpoints import Checkpoint, Checkpoints, Moment
from solver.gl.device import Device
from solver.gl.tiled import SavedTiles, TiledField
from solver.state import State
from support.gl_objects import Made

SIZE = 100, 70
SIDE = 32
WHOLE = 100 * 70 * 8


@pytest.fixture
def tiled(device: Device) -> Iterator[TiledField]:
    field = TiledField(device, SIZE, 2, "tiled", tile=SIDE)
    yield field
    field.release()


def noise(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(SIZE[1], SIZE[0], 2)).astype(np.float32)


def nbytes(*saves: object) -> int:
    textures = {texture for saved in saves for texture in saved.textures}  # type: ignore[attr-defined]
    return sum(texture.nbytes for texture in textures)


def draw(device: Device, tiled: TiledField, seed: int, region: tuple[int, int, int, int]) -> None:
    source = device.upload(noise(seed))
    tiled.copy_from(source, region)
    source.release()


def test_a_field_that_nothing_was_drawn_into_costs_nothing_to_keep(tiled: TiledField) -> None:
    saved = tiled.save()
    assert nbytes(saved) == 0
    assert saved.arrays()["places"].size == 0
    tiled.set(noise(1))
    tiled.restore(saved)
    assert not tiled.get().any()
    saved.release()


def test_saves_share_what_was_not_drawn_into(device: Device, tiled: TiledField) -> None:
    tiled.set(noise(1))
    first = tiled.save()
    assert nbytes(first) == WHOLE
    draw(device, tiled, 2, (30, 10, 4, 5))  # across two tiles
    between = tiled.get()
    second = tiled.save()
    assert nbytes(first, second) == WHOLE + 2 * SIDE * SIDE * 8
    third = tiled.save()
    assert nbytes(first, second, third) == nbytes(first, second)
    assert (between[10:15, 30:34] == noise(2)[10:15, 30:34]).all()
    assert (tiled.get() == between).all()
    for saved, values in ((first, noise(1)), (third, between), (second, between), (first, noise(1))):
        tiled.restore(saved)
        assert tiled.get().tobytes() == values.tobytes()
    for saved in (first, second, third):
        saved.release()


def test_a_restore_touches_only_what_differs(device: Device, tiled: TiledField) -> None:
    tiled.set(noise(1))
    first = tiled.save()
    draw(device, tiled, 2, (99, 69, 1, 1))
    assert tiled.restore(first) == [(96, 64, 4, 6)]
    assert tiled.restore(first) == []
    tiled.clear()
    assert len(tiled.restore(first)) == 12
    assert (tiled.get() == noise(1)).all()
    first.release()


def test_what_no_save_holds_any_more_is_copied_anew(device: Device, tiled: TiledField) -> None:
    tiled.set(noise(1))
    tiled.save().release()
    again = tiled.save()
    tiled.clear()
    tiled.restore(again)
    assert (tiled.get() == noise(1)).all()
    again.release()


def test_a_tile_is_copied_before_it_is_drawn_into_and_only_if_a_save_holds_it(
    device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = Made(monkeypatch)
    tiled, other = (TiledField(device, SIZE, 2, "tiled", tile=SIDE) for _ in range(2))

    def copies(act: Callable[[], object]) -> int:
        before = len(made.left)
        act()
        return (len(made.left) - before) // 2  # textures, with their framebuffers

    tiled.set(noise(1))
    saves = list[SavedTiles]()
    assert copies(lambda: saves.append(tiled.save())) == 0
    source = device.upload(noise(2))
    assert copies(lambda: tiled.copy_from(source, (30, 10, 4, 5))) == 2, "it lies across two tiles"
    assert copies(lambda: tiled.copy_from(source, (31, 10, 2, 2))) == 0, "no save holds what is there now"
    now = tiled.get()
    saves.append(tiled.save())
    assert copies(lambda: other.take(tiled, tiled.kind.regions)) == 0
    assert copies(tiled.clear) == 0, "another field has it still"
    assert copies(lambda: other.set(noise(3))) == 12
    for saved, values in ((saves[0], noise(1)), (saves[1], now), (saves[0], noise(1))):
        tiled.restore(saved)
        assert tiled.get().tobytes() == values.tobytes()
    saves.pop().release()
    tiled.restore(saves[0])
    tiled.release()
    other.restore(saves[0])
    assert other.get().tobytes() == noise(1).tobytes()
    saves.pop().release()
    for field in (other, source):
        field.release()
    assert not made.left


@pytest.mark.parametrize("dtype", ["f1", "f2", "f4"])
def test_arrays_bring_it_back_to_the_bit(dtype: str, device: Device) -> None:
    field, other = (TiledField(device, SIZE, 1, "tiled", dtype, SIDE) for _ in range(2))
    values = np.zeros((SIZE[1], SIZE[0]), field.get().dtype)
    values[:, 40:] = 60 * noise(3)[:, 40:, 0].clip(0, 4) if dtype == "f1" else noise(3)[:, 40:, 0]
    values[5, 50] = -0.0
    field.set(values)
    saved = State.of(device, {"mask": field}, steps=3)
    arrays = saved.arrays()
    assert arrays["mask/places"].tolist() == [1, 2, 3, 5, 6, 7, 9, 10, 11]
    blank = State.of(device, {"mask": other})
    given = blank.with_arrays(device, arrays)
    given.write_to({"mask": other})
    assert other.get().tobytes() == values.tobytes()
    assert given.values["steps"] == 3
    for thing in (saved, blank, given, field, other):
        thing.release()


@pytest.mark.parametrize("dtype", ["f1", "f4"])
def test_what_was_drawn_into_and_is_blank_again_comes_back_as_that(dtype: str, device: Device) -> None:
    field, other = (TiledField(device, SIZE, 1, "tiled", dtype, SIDE, blank=1.0) for _ in range(2))
    white = device.upload(np.full((SIZE[1], SIZE[0], 1), 1 if dtype == "f4" else 255, field.get().dtype))
    field.copy_from(white, (40, 10, 5, 5))
    field.copy_from(white, (90, 65, 10, 5))
    saved, blank = State.of(device, {"mask": field}), State.of(device, {"mask": other})
    arrays = saved.arrays()
    assert arrays["mask/places"].size == arrays["mask/texels"].size == 0  # nothing that would make a file larger
    bare = saved.tiles["mask"].bare(arrays["mask/places"])
    given = blank.with_arrays(device, arrays | {"mask/bare": bare})
    given.write_to({"mask": other})
    assert other.tiles == field.tiles == [(32, 0, 32, 32), (64, 64, 32, 6), (96, 64, 4, 6)]
    assert other.get().tobytes() == field.get().tobytes()
    for thing in (saved, blank, given, white, field, other):
        thing.release()


@pytest.mark.parametrize("damage", ["places", "texels", "missing", "twice", "bare"])
def test_arrays_of_something_else_are_refused(damage: str, device: Device, tiled: TiledField) -> None:
    tiled.set(noise(1))
    saved = State.of(device, {"map": tiled})
    arrays = saved.arrays()
    if damage == "missing":
        del arrays["map/texels"]
    elif damage == "places":
        arrays["map/places"] = arrays["map/places"] + 1
    elif damage == "twice":
        arrays["map/bare"] = arrays["map/places"][2:3]
    elif damage == "bare":
        arrays["map/bare"] = np.array([-1], np.int32)
    else:
        arrays["map/texels"] = arrays["map/texels"][:-1]
    with pytest.raises(ValueError, match="tiles"):
        saved.with_arrays(device, arrays)
    saved.release()


def test_a_save_of_another_field_is_refused(device: Device, tiled: TiledField) -> None:
    other = TiledField(device, (SIZE[1], SIZE[0]), 2, "other", tile=SIDE)
    saved = other.save()
    with pytest.raises(ValueError, match="another size"):
        tiled.restore(saved)
    with pytest.raises(ValueError, match="another grid"):
        State({}, {}, {"map": saved}).write_to({"map": tiled})
    for thing in (saved, other):
        thing.release()


def test_checkpoints_count_once_what_they_share(device: Device, tiled: TiledField) -> None:
    kept, recipe = Checkpoints(WHOLE + 3 * SIDE * SIDE * 8), Recipe.model_validate({"version": 1, "picture": "a.png"})
    tiled.set(noise(1))
    for tick in range(4):
        draw(device, tiled, tick, (0, 0, 1, 1))
        kept.add(Checkpoint(recipe, tick, Moment({"map": State.of(device, {"map": tiled})})))
    assert len(kept) == 4
    assert kept.nbytes == WHOLE + 3 * SIDE * SIDE * 8
    draw(device, tiled, 9, (0, 0, 1, 1))
    kept.add(Checkpoint(recipe, 4, Moment({"map": State.of(device, {"map": tiled})})))
    assert len(kept) == 4
    kept.clear()
    assert kept.nbytes == 0

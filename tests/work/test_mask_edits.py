"""Masks that are painted and edited while nothing moves: in no time, seen as recorded, replayed to the byte."""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import cv2
import numpy as np
import pytest

from app.errors import UserError
from app.media import project as projects
from app.media.auxiliary import Pictures
from app.media.pictures import write_picture
from app.media.project import Project
from app.model.areas import Part
from app.model.mask_edits import ClearMask, FeatherMask, FillMask, InvertMask, MaskStroke, PictureMask, SpreadMask
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.model.sampling import Segment, Window, to_grid
from app.model.tools import TOOL, TOOLS, BrushSettings, Press
from app.model.undo import History
from app.work import journal
from app.work.brushwork import THICKENING
from app.work.replay import Replay
from app.work.session import Session
from solver.gl.device import Device
from solver.grid import Grid
from support.editing import small_project

MASKS = [tool.name for tool in TOOLS if tool.masks]
EDITS = (
    InvertMask(kind="invert", tick=0, of="frozen"),
    InvertMask(kind="invert", tick=0, of="thickness"),
    ClearMask(kind="clear", tick=0, of="frozen"),
    ClearMask(kind="clear", tick=0, of="thickness"),
    FeatherMask(kind="feather", tick=0, of="thickness", radius=0.05),
    SpreadMask(kind="grow", tick=0, of="frozen", radius=0.03),
    SpreadMask(kind="shrink", tick=0, of="thickness", radius=0.03),
    FillMask(kind="fill", tick=0, of="frozen", amount=1.0, window=Window(box=(0.1, 0.1, 0.3, 0.4))),
    FillMask(
        kind="fill", tick=0, of="frozen", amount=1.0, segment=Segment(above=0.4, at=(0.95, 0.95)),
        then=(
            Part(outline=((0.5, 0.1), (0.9, 0.3), (0.6, 0.6))),
            Part(combine="subtract", window=Window(box=(0.6, 0.1, 0.8, 0.4), shape="ellipse")),
        ),
    ),
    FillMask(kind="fill", tick=0, of="thickness", amount=-1.0, segment=Segment(color="#808080", tolerance=0.6)),
    PictureMask(kind="picture", tick=0, of="thickness", white=2.0, invert=True),
)  # fmt: skip


@pytest.fixture
def session(device: Device, tmp_path: Path) -> Iterator[Session]:
    session = Session(device, quick_project(tmp_path, "paper"))
    yield session
    session.release_gpu()


def quick_project(folder: Path, solver: str) -> Project:
    """A fluid that comes to rest within a few ticks."""
    project = small_project(folder, grid=24)
    fluid = project.recipe.fluid.model_copy(update={"drag": 30.0, "solver": solver, "sweeps": 2})
    return replace(project, recipe=project.recipe.edited(fluid=fluid))


def paint(session: Session, tool: str, *places: tuple[float, float], back: bool = False, hold: int = 1) -> None:
    """A stroke from place to place, `hold` ticks at each."""
    press = Press(BrushSettings(0.12, 0.2), back, session.extent, session.dt)
    session.press(TOOL[tool], press, *places[0])
    for place in places:
        session.move(*place)
        for _ in range(hold):
            session.advance(1)
    session.release()


def masks(replay: Replay) -> tuple[np.ndarray, ...]:
    """Both masks, what the fluid has of them, and the warp."""
    painted, fluid = replay.masks, replay.fluid
    size = painted.canvas.size[::-1]
    thickness, frozen = (np.broadcast_to(mask.get(), size) for mask in (painted.thickness, painted.frozen))
    return thickness, frozen, fluid.viscosity.get(), fluid.solid.get(), replay.warp.read()


def is_same(one: tuple[np.ndarray, ...], other: tuple[np.ndarray, ...]) -> bool:
    return all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


def replayed(session: Session, tick: int | None = None) -> tuple[np.ndarray, ...]:
    """What the recording, written and read again, comes to."""
    recipe = Recipe.parse(session.recipe.text())
    assert recipe == session.recipe
    again = Replay(session.device, recipe, session.pictures)
    try:
        again.seek(session.tick if tick is None else tick)
        return masks(again)
    finally:
        again.release()


def test_painting_a_mask_at_rest_takes_no_time(session: Session) -> None:
    paint(session, "thicken", (0.3, 0.3), (0.6, 0.4), hold=30)
    paint(session, "freeze", (0.3, 0.7), (0.6, 0.8), hold=30)
    assert (session.end, session.tick, session.is_moving, session.recipe.stroke) == (0, 0, False, ())
    assert [edit.kind for edit in session.recipe.mask] == ["stroke", "stroke"]
    assert is_same(masks(session.replay), replayed(session))
    paint(session, "push", (0.4, 0.5), (0.5, 0.5))
    session.settle()
    end = session.end
    paint(session, "freeze", (0.8, 0.5), hold=30)
    assert session.end == session.tick == end == session.recipe.ticks
    assert session.recipe.mask[-1].tick == end
    assert is_same(masks(session.replay), replayed(session))


def test_a_fluid_that_is_chosen_over_a_mask_at_rest_takes_no_time_either(session: Session) -> None:
    session.edit_masks("Freeze", FillMask(kind="fill", of="frozen", tick=0, amount=1.0))
    session.change("Water", viscosity=0.0006)
    assert (session.end, session.recipe.change, session.recipe.fluid.viscosity) == (0, (), 0.0006)
    session.undo()
    assert session.recipe.fluid.viscosity != 0.0006


def test_what_is_painted_while_the_pointer_rests_is_seen_at_once_and_is_so_many_decades(session: Session) -> None:
    """4 decades a second under the brush, of the hand's seconds."""
    press = Press(BrushSettings(0.2, 1.0), False, session.extent, session.dt)
    session.press(TOOL["thicken"], press, 0.5, 0.5)
    seen = []
    for _ in range(20):
        session.advance(1)
        seen.append(int(session.replay.masks.thickness.get().max()) - 24576)
    assert np.allclose(seen, 8192 * THICKENING * session.dt * np.arange(1, 21), atol=20)
    before = masks(session.replay)
    session.release()
    assert is_same(masks(session.replay), before)


def test_with_a_moving_fluid_a_mask_is_painted_in_time(session: Session) -> None:
    paint(session, "push", (0.4, 0.5), (0.6, 0.5))
    end = session.end
    paint(session, "thicken", (0.5, 0.5), hold=10)
    assert session.recipe.mask == ()
    assert session.end >= end + 10
    session.settle()
    assert is_same(masks(session.replay), replayed(session))


def test_undo_and_redo_of_masks_are_exact(session: Session) -> None:
    dice, seen = random.Random(1), [masks(session.replay)]
    for number in range(14):
        place = dice.uniform(0.2, 0.8), dice.uniform(0.2, 0.8)
        if number == 7:
            paint(session, "push", place, (0.5, 0.5))
            session.settle()
        elif number % 3:
            paint(session, dice.choice(MASKS), place, (0.5, 0.5), hold=dice.randrange(1, 4))
            assert session.recipe.mask[-1].kind == "stroke"
        else:
            session.edit_masks("Edit", dice.choice(EDITS))
        seen.append(masks(session.replay))
    assert len(session.document.history.entries) == len(seen)
    for _ in range(25):
        index = dice.randrange(len(seen))
        session.go_to(index)
        session.settle()
        assert is_same(masks(session.replay), seen[index])
    session.replay.checkpoints.clear()
    for index in (3, len(seen) - 1, 1):
        session.go_to(index)
        session.settle()
        assert is_same(masks(session.replay), seen[index])


@pytest.mark.parametrize(("solver", "seed"), [("paper", 1), ("paper", 3), ("paper", 5), ("mac", 2)])
def test_random_work_replays_to_the_byte(device: Device, tmp_path: Path, solver: str, seed: int) -> None:
    """Masks at rest, in motion and edited between pushes, undone, gone back from, given up."""
    dice, session = random.Random(seed), Session(device, quick_project(tmp_path, solver))
    for _ in range(14 if solver == "paper" else 7):
        x, y = dice.uniform(0.1, 0.9), dice.uniform(0.1, 0.9)
        places = [(x + dice.uniform(-0.04, 0.04), y + dice.uniform(-0.04, 0.04)) for _ in range(dice.randrange(1, 4))]
        match dice.randrange(10):
            case 0 | 1 | 2:
                paint(session, dice.choice(MASKS), *places, back=dice.random() < 0.4, hold=dice.randrange(3))
            case 3 | 4:
                paint(session, "push", *places)
            case 5:
                session.edit_masks("Edit", dice.choice(EDITS))
            case 6:
                dice.choice((session.undo, session.redo))()
            case 7:
                session.seek(dice.randrange(session.end + 1))
            case 8:
                session.change("Clear", **{dice.choice(("clear_masks", "reset_warp", "clear_velocity")): True})
            case 9:
                session.press(TOOL["freeze"], Press(BrushSettings(), False, session.extent, session.dt), *places[0])
                session.advance(2)
                session.cancel()
        if dice.random() < 0.5:
            session.settle()
        else:
            session.advance(dice.randrange(4))
    session.stop_recording()
    session.settle()
    seen = masks(session.replay)
    assert is_same(seen, replayed(session))
    middle = session.end // 2
    session.seek(middle)
    session.settle()
    assert is_same(masks(session.replay), replayed(session, middle))
    work = journal.Work(session.document.history.entries, session.document.history.index, Recipe())
    lines = b"".join(journal.beginning(journal.Origin.of(session.project), work))
    assert journal.read(lines)[1].recipe == session.document.recipe
    project = projects.save(replace(session.project, recipe=session.document.recipe), tmp_path / "w.fluidwarp")
    again = Session(device, projects.load(project.path or tmp_path))
    again.settle()
    assert is_same(masks(again.replay), seen)
    for opened in (session, again):
        opened.release_gpu()


def test_a_journal_tells_a_mask_once(session: Session) -> None:
    """What is written after each stroke is that stroke, and what is read is the work."""
    origin = journal.Origin.of(session.project)
    history = session.document.history
    work = journal.Work(history.entries, history.index, Recipe())
    written = b"".join(journal.beginning(origin, work))
    for number in range(3):
        paint(session, "freeze", (0.2 + 0.2 * number, 0.5), (0.3, 0.3), hold=5)
        before, work = work, journal.Work(history.entries, history.index, Recipe())
        line = journal.continuation(work, before)
        assert line.count(b'"samples"') == 1
        written += line
    assert journal.read(written)[1] == replace(work, saved=journal.read(written)[1].saved)
    assert History.restored(work.entries, 2).recipe.mask == session.recipe.mask[:2]


def test_a_mask_picture_is_loaded_and_one_that_is_not_there_is_a_sentence(session: Session, tmp_path: Path) -> None:
    width, height = session.replay.masks.canvas.size
    grey = np.zeros((height, width), np.uint16)
    grey[: height // 2] = 65535
    write_picture(tmp_path / "mask.png", Picture(grey[..., None]))
    session.edit_masks("Load", PictureMask(kind="picture", tick=0, of="frozen", picture=str(tmp_path / "mask.png")))
    assert np.array_equal(session.replay.masks.frozen.get() > 127, grey > 0)
    seen = masks(session.replay)
    with pytest.raises(UserError, match="nowhere"):
        session.edit_masks("Load", PictureMask(kind="picture", tick=0, of="frozen", picture="nowhere.png"))
    assert is_same(masks(session.replay), seen)
    assert len(session.document.history.entries) == 2
    assert is_same(seen, replayed(session))


def test_going_back_keeps_the_masks_that_are_seen_there(session: Session) -> None:
    """What was painted at that moment is, what came after it is not, and both are one undo away."""
    paint(session, "push", (0.4, 0.5), (0.5, 0.5))
    session.settle()
    middle, end = session.end // 2, session.end
    session.seek(middle)
    session.settle()
    paint(session, "freeze", (0.2, 0.5))
    paint(session, "push", (0.6, 0.5), (0.7, 0.5))
    session.settle()
    paint(session, "freeze", (0.8, 0.5))
    after = masks(session.replay)
    session.seek(middle)
    session.settle()
    here = masks(session.replay)
    paint(session, "thicken", (0.5, 0.2))
    assert [edit.tick for edit in session.recipe.mask] == [middle, middle]
    assert session.end == middle < end
    assert np.array_equal(session.replay.masks.frozen.get(), here[1])
    assert here[1].any()
    assert is_same(masks(session.replay), replayed(session))
    session.undo()
    session.settle()
    assert is_same(masks(session.replay), after)


def test_a_seek_between_two_ticks_leaves_the_masks_of_the_first(session: Session) -> None:
    paint(session, "push", (0.4, 0.5), (0.5, 0.5))
    session.settle()
    session.seek(2)
    session.settle()
    paint(session, "freeze", (0.5, 0.5))
    recipe = session.recipe.edited(duration=4 * session.dt)
    replay = Replay(session.device, recipe, Pictures(session.project.picture))
    replay.seek(Fraction(3, 2))
    assert not replay.masks.frozen.get().any()
    replay.seek(2)
    assert replay.masks.frozen.get().any()
    assert isinstance(recipe.mask[0], MaskStroke)
    replay.release()


def test_what_is_selected_by_colour_is_where_it_is_seen(device: Device, tmp_path: Path) -> None:
    """After a warp, it is what has the colour in the picture as OpenCV looks it up."""
    y, x = np.mgrid[0:180, 0:240]
    red = ((x - 90) / 50) ** 2 + ((y - 90) / 40) ** 2 < 1
    pixels = np.where(red[..., None], (200, 30, 30), (20, 60, 90)).astype(np.uint8)
    project = replace(small_project(tmp_path), picture=Picture(pixels))
    session = Session(device, project)
    paint(session, "push", (0.4, 0.5), (0.6, 0.55), (0.75, 0.5), hold=4)
    session.settle()
    fill = FillMask(kind="fill", tick=0, of="frozen", amount=1.0, segment=Segment(color="#c81e1e", tolerance=0.3))
    session.edit_masks("Fill", fill)
    frozen = to_grid((session.replay.masks.frozen.get() > 127).astype(np.float32), Grid(240, 180)) > 0.5
    moved = session.replay.warp.read((240, 180)) * 240
    across, down = ((moved[..., k] + at).astype(np.float32) for k, at in enumerate((x, y)))
    seen = cv2.remap(pixels[..., 0], across, down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE) > 120
    assert (frozen & seen).sum() / (frozen | seen).sum() > 0.97
    assert (red & seen).sum() / (red | seen).sum() < 0.9
    assert is_same(masks(session.replay), replayed(session))
    session.release_gpu()


def test_brightness_while_a_slider_is_dragged_is_one_edit_below_what_was_painted(session: Session) -> None:
    def brightness(white: float, commit: bool = False) -> None:
        edit = PictureMask(kind="picture", tick=0, of="thickness", white=white)
        session.edit_masks("Thickness by brightness", edit, commit=commit)

    for white in (1.0, 2.5, 2.0):
        brightness(white)
        assert is_same(masks(session.replay), replayed(session))
    assert len(session.document.history.entries) == 1
    session.commit("Thickness by brightness")
    first = masks(session.replay)
    paint(session, "thicken", (0.5, 0.5), hold=10)
    stroke = session.recipe.mask[-1]
    brightness(1.0)
    brightness(3.0, commit=True)
    assert [entry.name for entry in session.document.history.entries][1:] == [
        "Thickness by brightness", "Thicken", "Thickness by brightness",
    ]  # fmt: skip
    assert session.recipe.mask == (PictureMask(kind="picture", tick=0, of="thickness", white=3.0), stroke)
    assert is_same(masks(session.replay), replayed(session))
    session.undo()
    session.undo()
    assert is_same(masks(session.replay), first)


def test_brightness_set_while_the_fluid_moves_is_one_undo_away(session: Session) -> None:
    paint(session, "push", (0.4, 0.5), (0.6, 0.5))
    assert session.coasting
    for white in (1.0, 2.0, 3.0):
        edit = PictureMask(kind="picture", tick=0, of="thickness", white=white)
        session.edit_masks("Thickness by brightness", edit, commit=False)
        session.advance(2)
    session.commit("Thickness by brightness")
    assert [edit.kind for edit in session.recipe.mask] == ["picture"]
    session.settle()
    assert is_same(masks(session.replay), replayed(session))
    session.undo()
    assert session.recipe.mask == ()


def test_to_clear_what_only_an_undone_work_had_painted_changes_no_bit(device: Device) -> None:
    """The mask is still there on the GPU, with nothing on it."""
    data = {"tool": "push", "radius": 0.2, "samples": ((0, 0.3, 0.5, 1.0), (6, 0.5, 0.5, 1.0))}
    moving = Recipe.model_validate({"duration": 0.2, "fluid": {"grid": 32}, "stroke": (data,)})
    frozen = FillMask(kind="fill", tick=3, of="frozen", amount=1.0, window=Window(box=(0.6, 0.1, 0.9, 0.4)))
    cleared = moving.edited(mask=(ClearMask(kind="clear", tick=5, of="frozen"),))
    found = []
    for first in (moving, moving.edited(mask=(frozen,))):
        replay = Replay(device, first, Pictures(Picture(np.zeros((48, 64, 3), np.uint8))))
        replay.seek(4)
        replay.use(cleared)
        replay.seek(9)
        found.append(replay.snapshot())
        replay.release()
    assert found[0].keys() == found[1].keys()
    assert all(np.array_equal(found[0][name], found[1][name], equal_nan=True) for name in found[0])

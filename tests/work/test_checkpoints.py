"""Checkpoints: within their budget to the byte, and of what is left out that is missed least."""

from __future__ import annotations

import random
from collections.abc import Iterator
from itertools import pairwise

import pytest

from app.model.recipe import Recipe
from app.model.strokes import Stroke
from app.work.checkpoints import Checkpoint, Checkpoints, Moment
from solver.gl.device import Device
from solver.gl.field import Field
from solver.state import State
from support.gl_objects import Made

BEFORE = Recipe(picture="a.png", stroke=(Stroke(tool="push", samples=((0, 0.3, 0.5, 1.0), (4, 0.5, 0.5, 1.0))),))
"""Its checkpoints from tick 6 on are of an undone future, once it goes on as `AFTER`."""
AFTER = BEFORE.edited(
    stroke=(*BEFORE.stroke, Stroke(tool="push", samples=((5, 0.5, 0.5, 1.0), (9, 0.3, 0.5, 1.0)))), duration=9.0
)


@pytest.fixture
def field(device: Device) -> Iterator[Field]:
    field = device.field((8, 8))
    yield field
    field.release()


def at(device: Device, field: Field, tick: int, recipe: Recipe = BEFORE) -> Checkpoint:
    return Checkpoint(recipe, tick, Moment({"map": State.of(device, {"map": field})}))


def ticks(kept: Checkpoints, recipe: Recipe = BEFORE, last: int = 100) -> list[int]:
    """Those of the checkpoints that are valid for a recipe."""
    return [tick for tick in range(last) if kept.has(recipe, tick)]


@pytest.mark.parametrize("room", [0, 1, 4])
def test_as_many_are_kept_as_fit_and_not_one_less(device: Device, field: Field, room: int) -> None:
    """With a budget of so many and no more; a byte less is one less. The newest stays, if any does."""
    for budget, count in ((room * field.nbytes, room), (room * field.nbytes - 1, room - 1)):
        kept = Checkpoints(max(budget, 0))
        for tick in range(9):
            kept.add(at(device, field, tick))
            assert len(kept) == min(max(count, 0), tick + 1)
            assert kept.nbytes == len(kept) * field.nbytes
            assert kept.has(BEFORE, tick) == (count > 0)
        kept.clear()
        assert (len(kept), kept.nbytes) == (0, 0)


def test_nothing_of_what_goes_stays_on_the_gpu(device: Device, field: Field, monkeypatch: pytest.MonkeyPatch) -> None:
    made, kept = Made(monkeypatch), Checkpoints(3 * field.nbytes)
    for tick in range(9):
        kept.add(at(device, field, tick))
    assert len(made.left) == 3 * 2  # a texture and what draws into it
    kept.clear()
    assert made.left == []


@pytest.mark.parametrize("seed", range(3))
def test_an_undone_future_goes_first_and_of_it_what_was_there_first(device: Device, field: Field, seed: int) -> None:
    """Whatever its ticks are; and only then what is on the way."""
    dice = random.Random(seed)
    undone = dice.sample(range(6, 60), 5)
    kept = Checkpoints(9 * field.nbytes)
    shared = dice.sample(range(5), 4)
    for tick in [*shared, *undone]:
        kept.add(at(device, field, tick))
    for count, tick in enumerate(dice.sample(range(6, 60), 5), 1):
        kept.add(at(device, field, tick, AFTER))
        assert ticks(kept) == sorted([*shared, *undone[count:]])
        assert len(ticks(kept, AFTER)) == 4 + count
    kept.add(at(device, field, 60, AFTER))
    assert len(ticks(kept, AFTER)) == 9


@pytest.mark.parametrize("goes", ["on", "back"])
def test_they_are_dense_where_the_work_is_and_sparse_far_from_it(device: Device, field: Field, goes: str) -> None:
    kept, way = Checkpoints(9 * field.nbytes), list(range(90)) if goes == "on" else list(range(89, -1, -1))
    for tick in way:
        kept.add(at(device, field, tick))
    found = ticks(kept) if goes == "on" else ticks(kept)[::-1]
    assert {way[0], way[-1]} <= set(found)
    gaps = [abs(later - earlier) for earlier, later in pairwise(found)]
    assert gaps[-1] <= 2
    assert gaps[0] > 20
    assert all(later <= 1.5 * earlier + 1 for earlier, later in pairwise(gaps)), gaps


def test_of_two_that_are_missed_as_little_one_goes(device: Device, field: Field) -> None:
    """Those on both sides of the newest are as far from it, with gaps as long."""
    kept = Checkpoints(4 * field.nbytes)
    for tick in (0, 1, 3, 4, 2):
        kept.add(at(device, field, tick))
    assert len(kept) == 4
    assert {0, 2, 4} < set(ticks(kept)) < set(range(5))
    kept.clear()


def test_the_nearest_is_the_last_one_before_that_is_on_the_way(device: Device, field: Field) -> None:
    kept = Checkpoints()
    own, others = (2, 4, 8, 12), (7, 10)
    for tick in own:
        kept.add(at(device, field, tick, AFTER))
    for tick in others:
        kept.add(at(device, field, tick))
    for recipe, there in ((AFTER, own), (BEFORE, (2, 4, *others))):
        for tick in range(16):
            wanted = max((one for one in there if one <= tick), default=None)
            found = kept.nearest(recipe, tick)
            assert (found and found.tick) == wanted
    kept.clear()
    assert kept.nearest(AFTER, 99) is None

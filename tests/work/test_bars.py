"""Strokes, forces and handles moved, stretched, muted and repeated afterwards: what is seen is what a file says."""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.errors import UserError
from app.media import project as projects
from app.media.auxiliary import Pictures
from app.model.bars import Which, bars, moved, stretched
from app.model.forces import FieldForce, VortexForce
from app.model.handles import RecipeHandle, RecipePin
from app.model.mask_edits import FillMask
from app.model.recipe import FluidSettings, Recipe
from app.model.strokes import Stroke
from app.model.tools import TOOL, BrushSettings, Press
from app.progress import Progress
from app.work.export import run
from app.work.jobs import Job, MapOutput, Outputs
from app.work.replay import Replay
from app.work.session import Session
from solver.gl.device import Device
from support.editing import pattern, small_project

DT = 1 / 60


@pytest.fixture
def session(device: Device, tmp_path: Path) -> Iterator[Session]:
    session = Session(device, small_project(tmp_path, grid=32))
    yield session
    session.release_gpu()


def paint(session: Session, tool: str, start: tuple[float, float], end: tuple[float, float], radius: float = 0.12):
    press = Press(BrushSettings(radius, 0.2), False, session.extent, session.dt)
    session.press(TOOL[tool], press, *start)
    for k in range(1, 6):
        session.move(start[0] + (end[0] - start[0]) * k / 5, start[1] + (end[1] - start[1]) * k / 5)
        session.advance(1)
    session.release()
    session.settle()


def rendered(device: Device, recipe: Recipe) -> dict[str, np.ndarray]:
    """All that a simulation from the start comes to."""
    replay = Replay(device, recipe, Pictures(pattern(), Path()), budget=0)
    replay.seek(recipe.ticks)
    snapshot = replay.snapshot()
    replay.release()
    return snapshot


def same(one: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> bool:
    return one.keys() == other.keys() and all(np.array_equal(one[name], other[name], equal_nan=True) for name in one)


def vortex(**more: object) -> VortexForce:
    return VortexForce.model_validate({"kind": "vortex", "point": (0.5, 0.5), "strength": 3.0, **more})


STROKE = Stroke(tool="push", radius=0.15, samples=((2, 0.3, 0.5, 1.0), (9, 0.5, 0.5, 1.0)))
TWIRL = Stroke(tool="twirl", radius=0.2, samples=((6, 0.6, 0.4, 1.0), (14, 0.6, 0.4, 1.0)))
HALF = {"box": (0.5, 0.0, 1.0, 1.0)}
RECIPE = Recipe(fluid=FluidSettings(grid=32, viscosity=0.01), duration=24 * DT)


@pytest.mark.parametrize("detail", [0, 256])
def test_a_repeated_stroke_moves_the_picture_as_its_copies_do(device: Device, detail: int) -> None:
    small = STROKE.model_copy(update={"detail": detail, "radius": 0.05 if detail else 0.15})
    copies = tuple(small.moved(4 * time) for time in range(3))
    repeated = RECIPE.edited(stroke=(small.repeated(3, 4), TWIRL))
    assert same(rendered(device, repeated), rendered(device, RECIPE.edited(stroke=(*copies, TWIRL))))
    assert not same(rendered(device, repeated), rendered(device, RECIPE.edited(stroke=(small, TWIRL))))


def test_going_back_to_where_a_moving_fluid_was_frozen_changes_no_bit(device: Device) -> None:
    """The way that the fluid has come goes through nothing that has been frozen since."""
    frozen = FillMask.model_validate({"kind": "fill", "tick": 5, "of": "frozen", "amount": 1.0, "window": HALF})
    replay = Replay(device, RECIPE.edited(force=(vortex(),), mask=(frozen,)), Pictures(pattern(), Path()))
    replay.seek(5)
    replay.checkpoint()
    replay.seek(8)
    straight = replay.snapshot()
    replay.seek(5)
    replay.seek(8)
    assert same(replay.snapshot(), straight)
    replay.release()


def test_what_is_muted_is_as_if_it_were_not_there(device: Device) -> None:
    muted = STROKE.model_copy(update={"muted": True})
    held = {"at": (0.3, 0.5), "muted": True}
    handle, pin = RecipeHandle.model_validate({"to": (0.5, 0.5), **held}), RecipePin.model_validate(held)
    recipe = RECIPE.edited(stroke=(muted, TWIRL), force=(vortex(muted=True),), handle=(handle,), pin=(pin,))
    assert same(rendered(device, recipe), rendered(device, RECIPE.edited(stroke=(TWIRL,))))


def any_edit(session: Session, dice: random.Random) -> None:
    """Some edit of a bar, as the window makes them."""
    all_ = [bar.which for bar in bars(session.recipe)]
    which: set[Which] = set(dice.sample(all_, min(len(all_), dice.choice([1, 1, 2]))))
    by, start = dice.randrange(-12, 12), dice.randrange(30)
    match dice.choice(["move", "move", "stretch", "mute", "repeat", "delete", "strength", "undo", "redo"]):
        case "move":
            session.edit_bars("Move", which, lambda one: moved(one, by, DT))
        case "stretch":
            session.edit_bars("Stretch", which, lambda one: stretched(one, start, start + 9, DT))
        case "mute":
            session.edit_bars("Mute", which, lambda one: one.model_copy(update={"muted": not one.muted}))
        case "repeat":
            session.edit_bars("Repeat", which, lambda one: one.repeated(3, 7) if isinstance(one, Stroke) else one)
        case "delete" if len(all_) > 4:
            session.edit_bars("Delete", which, lambda one: None)
        case "strength":
            session.edit_bars("Strength", which, lambda one: one.model_copy(update={"strength": 0.5}))
        case "undo":
            session.undo()
        case _:
            session.redo()


@pytest.mark.parametrize("seed", range(3))
def test_after_any_edits_the_window_shows_what_is_rendered(
    device: Device, session: Session, tmp_path: Path, seed: int
) -> None:
    """With masks painted in no time, strokes in fine windows, and, in one of them, forces."""
    dice = random.Random(seed)
    if seed == 2:
        session.edit("Forces", force=(vortex(during=(0.1, 0.5)), vortex(at=(0.3,), strength=0.5)), duration=0.6)
        session.seek(session.end)
        session.settle()
    for tool, start, end, radius in (
        ("freeze", (0.7, 0.3), (0.7, 0.6), 0.1),
        ("push", (0.3, 0.5), (0.5, 0.5), 0.15),
        ("push", (0.5, 0.4), (0.55, 0.4), 0.02),
        ("thicken", (0.2, 0.3), (0.3, 0.3), 0.1),
        ("twirl", (0.5, 0.6), (0.5, 0.6), 0.2),
        ("push", (0.6, 0.5), (0.4, 0.6), 0.15),
    ):
        paint(session, tool, start, end, radius)
    assert len(session.recipe.mask) == 2
    assert any(stroke.detail for stroke in session.recipe.stroke) == (seed != 2)
    masks = session.recipe.mask
    for _ in range(8):
        any_edit(session, dice)
        session.advance(1)  # not always as far as it has to go
    session.seek(session.end)
    session.settle()
    assert session.recipe.mask == masks or len(session.recipe.mask) < 2
    assert same(session.replay.snapshot(), rendered(device, session.recipe))
    projects.save(replace(session.project, recipe=session.document.recipe), tmp_path / "w.fluidwarp")
    loaded = projects.load(tmp_path / "w.fluidwarp")
    assert loaded.recipe == session.recipe
    maps = MapOutput(tmp_path / "w.npy")
    run(device, Job(loaded.recipe, loaded.picture, loaded.folder, Outputs(None, maps=maps)), Progress())
    size = loaded.picture.width, loaded.picture.height
    assert np.array_equal(np.load(maps.path), session.replay.warp.read(size))


def test_an_edit_is_one_entry_and_is_undone_to_the_bit(session: Session) -> None:
    paint(session, "push", (0.3, 0.5), (0.5, 0.5))
    paint(session, "push", (0.5, 0.3), (0.5, 0.6))
    before, recipe = session.replay.snapshot(), session.recipe
    session.edit_bars("Move stroke", {("stroke", 1)}, lambda one: moved(one, 20, DT))
    session.settle()
    assert [entry.name for entry in session.document.history.entries] == ["Open", "Push", "Push", "Move stroke"]
    assert session.tick == session.end == recipe.ticks + 20
    assert not same(session.replay.snapshot(), before)
    session.undo()
    session.settle()
    assert session.recipe == recipe
    assert same(session.replay.snapshot(), before)


def test_only_what_comes_after_an_edit_is_made_again(session: Session) -> None:
    for number in range(4):
        paint(session, "push", (0.3, 0.3 + 0.1 * number), (0.5, 0.3 + 0.1 * number))
    first = session.recipe.stroke[3].first_tick
    steps = session.replay.steps
    session.edit_bars("Mute stroke", {("stroke", 3)}, lambda one: one.model_copy(update={"muted": True}))
    session.settle()
    assert session.replay.steps - steps <= session.end - first + 16


def test_only_what_comes_after_a_force_is_made_again(session: Session) -> None:
    session.edit("Forces", force=(vortex(at=(0.0,)), vortex(during=(54 * session.dt, 2.0))), duration=72 * session.dt)
    session.seek(session.end)
    session.settle()
    steps = session.replay.steps
    session.edit_bars("Strength of a force", {("force", 1)}, lambda one: one.model_copy(update={"strength": 1.0}))
    session.settle()
    assert session.tick == session.end == 72
    assert session.replay.steps - steps <= 72 - 54 + 17


def test_keys_that_are_pressed_again_make_one_entry(session: Session) -> None:
    paint(session, "push", (0.3, 0.5), (0.5, 0.5))
    recipe = session.recipe
    for _ in range(3):
        session.edit_bars("Move stroke", {("stroke", 0)}, lambda one: moved(one, 1, DT), joined=True)
    assert [entry.name for entry in session.document.history.entries] == ["Open", "Push", "Move stroke"]
    assert session.recipe.stroke[0].first_tick == recipe.stroke[0].first_tick + 3
    session.undo()
    assert session.recipe == recipe
    session.edit_bars("Move stroke", {("stroke", 0)}, lambda one: moved(one, 1, DT), joined=True)
    session.edit_bars("Mute stroke", {("stroke", 0)}, lambda one: one.model_copy(update={"muted": True}))
    session.edit_bars("Move stroke", {("stroke", 0)}, lambda one: moved(one, 1, DT), joined=True)
    paint(session, "twirl", (0.5, 0.5), (0.5, 0.5))
    for which in (0, 1):
        session.edit_bars("Move stroke", {("stroke", which)}, lambda one: moved(one, 1, DT), joined=True)
    names = [entry.name for entry in session.document.history.entries]
    assert names[2:] == ["Move stroke", "Mute stroke", "Move stroke", "Twirl", "Move stroke", "Move stroke"]


def test_what_a_double_click_takes_back_is_what_its_first_click_has_done_and_nothing_before_that(
    session: Session,
) -> None:
    paint(session, "push", (0.3, 0.5), (0.5, 0.5))
    before = session.recipe
    for by in (0, 3):  # a slider that was moved by less than a tick, and by more
        session.edit_bars("Move stroke", {("stroke", 0)}, lambda one, by=by: moved(one, by, DT))
        session.retract()
        assert session.recipe == before


def test_a_slider_that_is_dragged_starts_from_what_was(session: Session) -> None:
    paint(session, "push", (0.3, 0.5), (0.5, 0.5))
    one = session.recipe.stroke[0]
    for end in (20, 3, 40):
        session.edit_bars("Stretch stroke", {("stroke", 0)}, lambda one, e=end: stretched(one, 0, e, DT), commit=False)
    session.commit("Stretch stroke")
    assert session.recipe.stroke[0] == one.lasting(0, 39)
    assert len(session.document.history.entries) == 3


def test_painting_goes_on_after_an_edit_and_from_within_a_repetition(device: Device, session: Session) -> None:
    paint(session, "push", (0.3, 0.5), (0.5, 0.5))
    session.edit_bars("Repeat stroke", {("stroke", 0)}, lambda one: one.repeated(4, 5))  # pyright: ignore[reportAttributeAccessIssue]
    session.settle()
    session.seek(12)
    session.settle()
    before = session.replay.snapshot()
    paint(session, "twirl", (0.5, 0.5), (0.5, 0.5))
    assert session.recipe.stroke[-1].first_tick == 12
    session.seek(12)
    session.settle()
    assert same(session.replay.snapshot(), before)
    session.seek(session.end)
    session.settle()
    assert same(session.replay.snapshot(), rendered(device, session.recipe))


def test_a_force_that_cannot_be_made_stays_muted(session: Session) -> None:
    lost = FieldForce(kind="field", picture="lost.png", muted=True)
    session.edit("Forces", force=(vortex(during=(0.0, 0.3)), lost), duration=0.5)
    session.seek(session.end)
    session.settle()
    before, recipe = session.replay.snapshot(), session.recipe
    for force in (recipe.force, recipe.force[1:]):
        session.edit("Forces", force=force)
        with pytest.raises(UserError, match="lost"):
            session.edit_bars(
                "Unmute", {("force", len(force) - 1)}, lambda one: one.model_copy(update={"muted": False})
            )
        assert session.recipe.force == force
    session.edit("Forces", force=recipe.force)
    session.settle()
    assert same(session.replay.snapshot(), before)


def test_what_moves_goes_on_to_rest_after_an_edit(session: Session) -> None:
    press = Press(BrushSettings(0.12, 0.2), False, session.extent, session.dt)
    session.press(TOOL["push"], press, 0.3, 0.5)
    for k in range(1, 6):
        session.move(0.3 + 0.04 * k, 0.5)
        session.advance(1)
    session.release()
    session.advance(1)
    assert session.coasting
    session.edit_bars("Strength of a stroke", {("stroke", 0)}, lambda one: one.model_copy(update={"strength": 0.8}))
    assert session.coasting
    session.settle()
    assert session.replay.fluid.motion().largest_speed <= 0.004
    assert session.document.history.recipe == session.recipe

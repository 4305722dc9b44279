"""Working live: what is recorded is what was seen."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.errors import UserError
from app.media import project as projects
from app.media.pictures import write_picture
from app.model import edits, toml
from app.model.bars import Actor, Which, moved
from app.model.forces import VortexForce
from app.model.handles import RecipeHandle
from app.model.mask_edits import LONGEST_HAND, InvertMask, MaskStroke, mask_edit
from app.model.presets import FEELS, HONEY, PUTTY, WATER, Feel
from app.model.recipe import Recipe
from app.model.sampling import Point
from app.model.strokes import FINEST_DETAIL, BrushPath, Stroke
from app.model.tools import TOOL, BrushSettings, Press
from app.progress import Progress
from app.work.export import run
from app.work.gesture import kept_near
from app.work.handle_status import FIT, as_seen, held_in, near_enough, unmet
from app.work.jobs import Job, Outputs
from app.work.replay import Replay
from app.work.session import Session
from app.work.tasks import Task
from properties.saved import PAINTING, check_saved, paint
from solver.gl.device import Device
from solver.warp.distortion import MOST_PLACES, MapStatistics
from support.editing import pattern, small_project
from support.gl_objects import Made

TRIANGLE = {
    "kind": "fill", "of": "frozen", "tick": 0, "amount": 1.0,
    "outline": ((0.2, 0.2), (0.8, 0.2), (0.5, 0.8)),
}  # fmt: skip


@pytest.fixture
def session(device: Device, tmp_path: Path) -> Iterator[Session]:
    session = Session(device, small_project(tmp_path, grid=32))
    yield session
    session.release_gpu()


def test_what_a_small_brush_folds_is_looked_for_at_no_more_places_than_a_frame_has_time_for(session: Session) -> None:
    """Two a cell of its window all over the picture were 17 million for a brush of a 200th, and no texture for less."""
    session.begin_with(viscosity=1.0, drag=12.0)
    stroke = Stroke(tool="push", radius=0.0002, detail=FINEST_DETAIL, samples=((0, 0.5, 0.5, 1), (3, 0.5003, 0.5, 1)))
    session.edit("Push", stroke=(stroke,), duration=0.2)
    session.seek(session.end)
    session.settle()
    assert session.replay.window is not None
    folds, places = session.folds
    assert folds == 0
    assert MOST_PLACES / 4 < places <= MOST_PLACES


@pytest.mark.parametrize(("limit", "most"), [("MOST_WORDS", 260), ("MOST_NUMBERS", 200)])
def test_whatever_can_be_painted_can_be_opened_again(
    limit: str, most: int, session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (edits, toml):
        monkeypatch.setattr(module, limit, most)
    monkeypatch.setattr(edits, "ROOM", (40, 60))
    full = pytest.raises(UserError, match="as large as one may be")

    def paint_on() -> None:
        for number in range(40):
            tool = ("thicken", "push", "handle")[number % 3]
            paint(session, tool, (0.2 + number / 40, 0.3), (0.5, 0.6), ticks=2)
            session.pause()

    with full:
        paint_on()
    kept = session.recipe
    assert kept.stroke
    assert kept.mask
    assert Recipe.parse(kept.text()) == kept
    with full:
        session.edit_masks("Fill", *40 * [mask_edit(TRIANGLE)])
    with full:
        session.edit("Add", stroke=40 * kept.stroke)
    strokes: list[Which] = [("stroke", number) for number in range(len(kept.stroke))]
    longer = {"samples": 99 * kept.stroke[0].samples, "muted": True, "repeat": 2, "every": 9}
    with full:
        session.edit_bars("Stretch", strokes, lambda one: one.model_copy(update=longer))
    assert session.recipe == kept
    session.edit_bars("Delete", [("stroke", 0)], lambda one: None)
    assert len(session.recipe.stroke) == len(kept.stroke) - 1


def test_where_less_of_the_work_is_left_the_playhead_is_at_its_end(session: Session) -> None:
    for x in (0.3, 0.6):
        paint(session, "push", (x, 0.3), (x, 0.6), ticks=12)
        session.pause()
    whole, short = session.recipe, session.recipe.stroke[0].last_tick + 3
    for tick in (0, short - 1, short, short + 1, session.end - 1, session.end):
        session.seek(tick)
        session.settle()
        session.edit("Shorter", stroke=whole.stroke[:1], duration=short * session.dt)
        assert session.end == short
        assert session.target == (short if tick == whole.ticks else min(tick, short))
        session.settle()
        assert session.tick == session.target
        session.edit("Longer", stroke=whole.stroke, duration=whole.duration)
        session.settle()


def test_an_edit_that_would_be_refused_when_it_is_opened_again_is_not_made(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    paint(session, "push", (0.3, 0.3), (0.6, 0.6), ticks=6)
    before = session.recipe
    again = lambda stroke: stroke.repeated(9, 1)  # noqa: E731
    monkeypatch.setattr("app.model.strokes.MOST_AT_ONCE", 4)
    with pytest.raises(UserError, match=r"^That was not done\. With it, \d strokes act at once in tick \d+"):
        session.edit_bars("Repeat", [("stroke", 0)], again)
    with pytest.raises(UserError, match=r"^That was not done\. With it, there are 513 forces"):
        session.edit("Add", force=513 * (VortexForce(kind="vortex", point=(0.5, 0.5)),))
    assert session.recipe == before
    monkeypatch.setattr("app.model.strokes.MOST_AT_ONCE", 9)
    session.edit_bars("Repeat", [("stroke", 0)], again)
    # One that was made before there was a bound can still be worked on.
    monkeypatch.setattr("app.model.strokes.MOST_AT_ONCE", 4)
    session.edit_bars("Mute", [("stroke", 0)], lambda stroke: stroke.model_copy(update={"local": 1.0}))
    assert session.recipe.stroke[0].local == 1.0


def test_a_stroke_that_is_as_long_as_one_may_be_ends_and_says_so(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.work.painting.LONGEST_GESTURE", 4)
    paint(session, "push", (0.3, 0.3), (0.6, 0.6), ticks=20)
    assert session.notice == "This stroke has reached its greatest length. Press again to continue."
    (stroke,) = session.recipe.stroke
    assert 4 <= len(stroke.samples) < 10


@pytest.mark.parametrize("tool", ["thicken", "twirl"])
def test_a_pen_that_is_held_still_for_too_long_ends_its_stroke_and_says_so(
    tool: str, session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert edits.LONGEST_GESTURE < LONGEST_HAND / 2  # also where the brush comes after the pointer for as long again
    monkeypatch.setattr("app.work.painting.LONGEST_GESTURE", 8)
    monkeypatch.setattr("app.model.mask_edits.LONGEST_HAND", 16)
    press = Press(BrushSettings(0.12, 0.2), False, session.extent, session.dt)
    session.press(TOOL[tool], press, 0.4, 0.5)
    for _ in range(40):
        session.advance(1)
    assert session.notice == "This stroke has reached its greatest length. Press again to continue."
    assert not session.is_painting
    session.settle()
    (made,) = session.document.recipe.mask or session.document.recipe.stroke
    assert isinstance(made, BrushPath)
    assert made.last_tick - made.first_tick == 7
    assert Recipe.parse(session.document.recipe.text()) == session.document.recipe == session.recipe


def test_a_stroke_on_a_mask_that_is_refused_when_it_ends_is_as_if_it_had_not_been(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    paint(session, "thicken", (0.3, 0.3), (0.6, 0.6))
    before, painted = session.document.recipe, session.replay.masks.thickness.get()
    press = Press(BrushSettings(0.2, 0.2), False, session.extent, session.dt)
    session.press(TOOL["thicken"], press, 0.4, 0.5)
    for place in (0.5, 0.6, 0.7):
        session.move(place, 0.5)
        session.advance(1)
    assert not np.array_equal(session.replay.masks.thickness.get(), painted)
    monkeypatch.setattr(edits, "MOST_NUMBERS", 1)
    with pytest.raises(UserError, match="as large as one may be"):
        session.release()
    session.settle()
    assert session.recipe == session.document.recipe == session.replay.recipe == before
    assert np.array_equal(session.replay.masks.thickness.get(), painted)


def test_a_stroke_with_which_too_many_would_act_at_once_is_refused_when_it_ends(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.model.strokes.MOST_AT_ONCE", 40)
    samples = (0, 0.2, 0.2, 1.0), (100, 0.2, 0.2, 1.0)
    goes_on = Stroke.model_validate({"tool": "push", "strength": 0.01, "samples": samples})
    session.edit("Strokes", stroke=40 * (goes_on,), duration=6 * session.dt)
    before = session.recipe
    with pytest.raises(UserError, match=r"^That was not done\. With it, 41 strokes act at once in tick \d+"):
        paint(session, "push", (0.5, 0.5), (0.6, 0.5))
    session.settle()
    assert session.recipe == session.document.recipe == session.replay.recipe == before
    assert Recipe.parse(before.text()) == before


def test_forty_strokes_saved_and_rendered_are_the_same_map(device: Device) -> None:
    """With all tools; two hundred are painted by tests/nightly.py."""
    found = check_saved(device, 8, count=40)
    assert found["handles and pins"] == 4
    assert found["strokes"] > 25


def test_the_history_is_exact_wherever_one_goes(session: Session) -> None:
    dice = random.Random(3)
    seen = [session.replay.warp.read()]
    for tool in ("push", "freeze", "push", "twirl", "thicken", "push", "restore"):
        paint(session, tool, (dice.uniform(0.3, 0.7), 0.5), (dice.uniform(0.3, 0.7), 0.6))
        session.settle()
        seen.append(session.replay.warp.read())
    for _ in range(20):
        index = dice.randrange(len(seen))
        session.go_to(index)
        session.settle()
        assert np.array_equal(session.replay.warp.read(), seen[index])


def test_the_fluid_comes_to_rest_and_stays_so(session: Session) -> None:
    paint(session, "push", (0.3, 0.5), (0.5, 0.5))
    assert session.coasting
    session.settle()
    assert not session.coasting
    # A look every five ticks, in which a fluid of honey loses a third of its speed, or less.
    assert 0.002 < session.replay.fluid.motion().largest_speed <= 0.004
    tick = session.tick
    session.advance(10)
    assert session.tick == tick == session.end == session.document.recipe.ticks


def test_a_handle_that_comes_no_nearer_keeps_nothing_going(session: Session) -> None:
    """It is too soft, and would be waited for as long as anything is: a minute."""
    press = Press(BrushSettings(0.2, stiffness=0.01), False, session.extent, session.dt)
    session.press(TOOL["handle"], press, 0.4, 0.5)
    session.move(0.6, 0.5)
    session.advance(1)
    session.release()
    for _ in range(100):
        session.advance(1)
    assert not session.coasting
    (missed,) = session.unmet.values()
    assert "it gives way to the fluid" in missed.said


def test_a_stroke_goes_on_beyond_the_edges_by_half_a_picture(session: Session) -> None:
    paint(session, "freeze", (0.9, 0.1), (3.0, -2.0), ticks=1)
    painted = session.recipe.mask[-1]
    assert isinstance(painted, MaskStroke)
    assert painted.samples[-1][1:3] == (1.5, -0.5)


def test_what_is_looked_for_only_once_is_what_is_there_whatever_has_been_done(session: Session) -> None:
    """What is told of handles and of the warp is as if nothing had been looked for before."""
    dt = session.dt
    one = RecipeHandle(at=(0.4, 0.5), to=(0.5, 0.5), duration=4 * dt)
    other = RecipeHandle(at=(0.7, 0.3), to=(0.5, 0.3), start=2 * dt, duration=2 * dt, stiffness=0.01)

    def elsewhere(handle: RecipeHandle) -> None:
        session.edit("Move", handle=(handle, *session.recipe.handle[1:]))

    ways: list[Callable[[], object]] = [
        lambda: session.edit("Handles", handle=(one, other), duration=8 * dt),
        lambda: session.seek(5),
        lambda: session.seek(3),
        lambda: elsewhere(one.model_copy(update={"to": (0.4, 0.6)})),
        lambda: elsewhere(one.model_copy(update={"to": (0.4, 0.6), "name": "left"})),
        lambda: session.edit("Amount", amount=0.5),
        lambda: session.seek(0),
        lambda: elsewhere(one.model_copy(update={"to": (0.3, 0.5)})),
        lambda: session.edit("Mute", handle=(one, other.model_copy(update={"muted": True}))),
        session.undo,
        lambda: session.seek(8),
        lambda: session.edit("Amount", amount=1.2),
        session.undo,
        session.undo,
        lambda: session.seek(8),
        lambda: session.edit("Farther", handle=(one, other.model_copy(update={"to": (0.4, 0.3)}))),
        lambda: session.edit("None", handle=()),
    ]
    seen = list[list[object]]()
    for way, settles in product(ways, (False, True)):
        (session.settle if settles else way)()
        found = [session.held, session.marks, session.unmet, session.folds]
        assert found == [session.held, session.marks, session.unmet, session.folds]
        replay = session.replay
        held = held_in(replay, session.target)
        amount = replay.recipe.amount
        is_over = not session.is_moving and session.tick == session.end and replay.recipe.leads
        missed = unmet(replay, near_enough(replay)) if is_over else ()
        assert found[:3] == [
            held, held if amount == 1 else as_seen(held, replay), {each.label: each for each in missed},
        ]  # fmt: skip
        seen.append(found)
    changed = [sum(before != after for before, after in pairwise(column)) for column in zip(*seen, strict=True)]
    assert np.greater_equal(changed[:3], (9, 9, 3)).all()
    # However far the simulation is behind the hand.
    keys = tuple((tick * dt, 0.4 + tick / 100, 0.5) for tick in (2, 4, 6, 8))
    session.edit("Keys", handle=(RecipeHandle(at=(0.4, 0.5), keys=keys),), amount=0.5)
    session.seek(1)
    session.settle()
    aims = []
    for tick in (3, 5, 8):
        session.seek(tick)
        aims.append([session.held, session.marks])
        held = held_in(session.replay, session.target)
        assert (session.target, aims[-1]) == (tick, [held, as_seen(held, session.replay)])
    assert aims[0] != aims[1] != aims[2]


def test_a_fit_is_offered_but_straight_after_one(session: Session) -> None:
    """Of a handle that is too soft for its goal."""
    soft = RecipeHandle(at=(0.4, 0.5), to=(0.6, 0.5), stiffness=0.01, duration=0.05)
    session.edit("Quality", fluid=session.recipe.fluid.model_copy(update={"dt": 0.1, "grid": 16}))
    for name, is_offered in ("Handle", True), (FIT, False):
        session.edit(name, handle=(soft,), duration=0.8 if is_offered else 0.9)
        session.seek(session.end)
        session.settle()
        (missed,) = session.unmet.values()
        assert missed.helped == is_offered


def test_a_slider_that_is_dragged_is_one_edit(session: Session) -> None:
    paint(session, "push", (0.3, 0.5), (0.5, 0.5))
    session.settle()
    for value in (0.01, 0.02, 0.05):
        session.preview_change(viscosity=value)
    session.commit("Viscosity")
    assert [entry.name for entry in session.document.history.entries] == ["Open", "Push", "Viscosity"]
    assert session.recipe.fluid_at(session.tick).viscosity == 0.05
    assert len(session.recipe.change) == 1


@pytest.mark.parametrize("tick", [0, 3])
@pytest.mark.parametrize("forces", [(), (VortexForce(kind="vortex", point=(0.5, 0.5)),)], ids=["", "with a force"])
def test_a_setting_that_is_dragged_changes_where_one_that_is_clicked_does(
    session: Session, tick: int, forces: tuple[VortexForce, ...]
) -> None:
    """At tick 0, before strokes, it came to the tick after."""
    paint(session, "push", (0.3, 0.5), (0.5, 0.5))
    session.settle()
    session.edit("Force", force=forces)
    made = list[Recipe]()
    for values in ((3.0,), (1.0, 2.0, 3.0)):
        session.seek(tick)
        session.settle()
        for drag in values:
            session.preview_change(drag=drag)
            session.advance(1)
        session.commit("Drag")
        made.append(session.recipe)
        assert session.recipe.fluid_at(tick).drag == 3.0
        session.undo()
    clicked, dragged = made
    assert dragged == clicked


def test_what_is_set_to_what_it_is_already_is_no_edit(session: Session) -> None:
    """It was one where the last change is at an earlier tick, and took away what came after a playhead sent back."""
    paint(session, "push", (0.3, 0.5), (0.5, 0.5))
    session.settle()
    session.change("Drag", drag=1.0)
    changed = session.end
    for start in (0.3, 0.5):
        paint(session, "push", (start, 0.4), (start + 0.1, 0.4))
        session.settle()
    recipe, entries = session.recipe, session.document.history.entries
    for tick in (changed, changed + 2, session.end):
        session.seek(tick)
        session.settle()
        for settings in ({"drag": 1.0}, {"viscosity": recipe.fluid.viscosity, "walls": recipe.fluid.walls}):
            session.change("Change", **settings)
            assert (session.recipe, session.document.history.entries) == (recipe, entries)
            assert (session.target, session.is_moving) == (tick, False)
    for drag in (3.0, 1.0):
        session.preview_change(drag=drag)
    session.commit("Drag")
    assert (session.recipe, session.document.history.entries) == (recipe, entries)
    for tick in (2, changed, changed + 2):
        session.seek(tick)
        session.settle()
        for drag in (3.0, 4.0, session.recipe.fluid_at(tick).drag):
            session.preview_change(drag=drag)
        session.commit("Drag")
        session.settle()
        assert (session.recipe, session.document.history.entries) == (recipe, entries), "it is dragged there and back"
        assert (session.tick, session.notice) == (tick, None)
        session.change("Drag", drag=3.0)
        assert session.end == tick, "and the playhead is where work goes on"
        session.retract()
    session.seek(changed)
    session.settle()
    session.play()
    session.change("Drag", drag=1.0)
    assert (session.playing, session.coasting, session.recipe) == (True, False, recipe)


def test_a_grid_that_is_refused_leaves_the_work_as_it_is(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    """It was half on that grid, at the beginning, with nothing left to be simulated."""
    paint(session, "push", (0.3, 0.5), (0.5, 0.5))
    session.settle()
    recipe, tick, seen = session.recipe, session.tick, session.replay.warp.read()
    device = session.device
    monkeypatch.setattr(device, "limits", replace(device.limits, max_texture_size=256))
    with pytest.raises(UserError, match="cells is more than this graphics device can hold") as refused:
        session.set_grid(400)
    assert refused.value.in_window.startswith("A grid of 400 x ")
    assert (session.recipe, session.document.recipe, session.tick, session.is_behind) == (recipe, recipe, tick, False)
    assert np.array_equal(session.replay.warp.read(), seen)
    session.undo()
    session.redo()
    session.settle()
    assert np.array_equal(session.replay.warp.read(), seen)


def test_settings_before_the_first_stroke_are_the_recipe_s_own(session: Session) -> None:
    session.change("Water", viscosity=0.0006, drag=0.5)
    assert session.recipe.change == ()
    assert session.recipe.fluid.viscosity == 0.0006
    session.undo()
    own = session.recipe.fluid
    assert own.viscosity == pytest.approx(0.03)
    # What is set at the playhead, or beside what is painted, holds from there on; so does what happens but once.
    recorded = session.recipe.edited(force=(VortexForce(kind="vortex", point=(0.5, 0.5)),), duration=9 * session.dt)
    painted = recorded.edited(mask=(InvertMask(kind="invert", of="frozen", tick=0),))
    for recipe, tick, settings in (
        (recorded, 4, {"drag": 0.5}), (painted, 0, {"viscosity": 0.3}), (recorded, 0, {"clear_velocity": True}),
    ):  # fmt: skip
        session.edit("Force", **{key: getattr(recipe, key) for key in ("force", "duration", "mask", "change")})
        session.seek(tick)
        session.change("Change", **settings)
        assert [change.tick for change in session.recipe.change] == [tick]
        assert session.recipe.fluid == own


def test_the_command_line_goes_to_another_grid_as_the_editor_does(
    session: Session, device: Device, tmp_path: Path
) -> None:
    """It had all on the coarse cells, where the editor gives a brush that is small on them a window."""
    session.begin_with(viscosity=1.0, drag=12.0, grid=128)
    stroke = Stroke(tool="push", radius=0.1, samples=((0, 0.4, 0.5, 1), (3, 0.5, 0.5, 1)))
    session.edit("Push", stroke=(stroke,), duration=0.15)
    project = tmp_path / "a.fluidwarp"
    projects.save(replace(session.project, recipe=session.recipe), project)
    asked = Task(
        picture=None,
        outputs=Outputs(tmp_path / "asked.png"),
        recipe=str(project),
        edits={"fluid.grid": 48},
    )
    session.set_grid(48)
    assert session.recipe.stroke[0].detail
    chosen = Outputs(tmp_path / "chosen.png")
    run(device, Job(session.recipe, session.project.picture, session.project.folder, chosen), Progress())
    asked.perform(lambda: device, Progress())
    found = [(tmp_path / name).read_bytes() for name in ("asked.png", "chosen.png")]
    assert found[0] == found[1]


def test_another_grid_replays_everything(session: Session) -> None:
    paint(session, "push", (0.3, 0.5), (0.5, 0.5))
    session.settle()
    coarse = session.replay.warp.read((32, 24))
    session.set_grid(64)
    session.settle()
    assert session.replay.grid.nx == 64
    assert np.abs(session.replay.warp.read((32, 24)) - coarse).max() < 0.05
    session.undo()
    session.settle()
    assert np.array_equal(session.replay.warp.read((32, 24)), coarse)


def test_pixels_follow_the_pointer_at_its_speed_in_putty(session: Session) -> None:
    session.change("Putty", viscosity=0.3, drag=0.0)
    session.set_grid(96)
    x, y = 0.35, 0.5
    session.press(TOOL["push"], Press(BrushSettings(0.15), False, session.extent, session.dt), x, y)
    session.advance(1)
    for k in range(1, 13):
        session.move(x + 0.012 * k, y)
        session.advance(1)
    warp = session.replay.warp.read()
    session.release()
    height, width = warp.shape[:2]
    carried = -warp[round(y * height), round((x + 0.144) * width) - 1][0]
    assert carried == pytest.approx(0.144, rel=0.08)


def pushed(session: Session, brush: BrushSettings, start: float, step: float) -> MapStatistics:
    """The map after a push to the right of fifteen moves, once the fluid has come to rest."""
    session.set_grid(96)
    session.press(TOOL["push"], Press(brush, False, session.extent, session.dt), start, 0.5)
    for k in range(1, 16):
        session.move(start + step * k, 0.5)
        session.advance(1)
    session.release()
    session.settle()
    return session.replay.warp.statistics()


def test_the_first_stroke_does_not_fold(session: Session) -> None:
    statistics = pushed(session, BrushSettings(), 0.4, 0.012)
    assert statistics.displacement_max > 0.15
    assert statistics.folds == 0


# A soft one is the first of those that are made again and again, below.
@pytest.mark.parametrize("hardness", [0.5, 1.0], ids=["half hard", "hard"])
@pytest.mark.parametrize("radius", [0.1, 0.15])
@pytest.mark.parametrize("feel", FEELS, ids=lambda feel: feel.name)
def test_a_moderate_push_does_not_fold(session: Session, feel: Feel, radius: float, hardness: float) -> None:
    session.change(feel.name, viscosity=feel.viscosity, drag=feel.drag)
    statistics = pushed(session, BrushSettings(radius, hardness), 0.35, 0.02)
    assert statistics.folds == 0
    assert statistics.displacement_max > 0.15


@pytest.mark.parametrize(
    ("feel", "radius"), [*((feel, 0.15) for feel in FEELS), (WATER, 0.1)], ids=lambda part: getattr(part, "name", part)
)
def test_the_same_push_made_again_and_again_slips_and_does_not_fold(
    session: Session, feel: Feel, radius: float
) -> None:
    session.change(feel.name, viscosity=feel.viscosity, drag=feel.drag)
    brush, moved = BrushSettings(radius), []
    for _ in range(6):
        statistics = pushed(session, brush, 0.35, 0.02)
        assert statistics.folds == 0
        moved.append(statistics.displacement_max)
    assert moved[0] > 0.15
    assert moved[-1] - moved[-2] < 0.1 * moved[0]
    # Back to where it came from it pushes as at first.
    before = session.replay.warp.read()
    pushed(session, brush, 0.65, -0.02)
    assert np.abs(session.replay.warp.read() - before).max() > moved[0]


def test_a_long_fast_push_of_water_does_not_fold(session: Session) -> None:
    session.change(WATER.name, viscosity=WATER.viscosity, drag=WATER.drag)
    for hardness in (0.0, 1.0):
        statistics = pushed(session, BrushSettings(0.15, hardness), 0.3, 0.03)
        assert statistics.folds == 0
        assert statistics.displacement_max > 0.15  # more than its radius
        session.undo()


def test_water_swirls_on_by_itself(session: Session) -> None:
    session.set_grid(96)
    session.change(WATER.name, viscosity=WATER.viscosity, drag=WATER.drag)
    session.press(TOOL["push"], Press(BrushSettings(), False, session.extent, session.dt), 0.35, 0.5)
    for k in range(1, 16):
        session.move(0.35 + 0.02 * k, 0.5)
        session.advance(1)
    session.release()
    tick, released = session.tick, session.replay.warp.read()
    session.settle()
    assert (session.tick - tick) * session.dt > 3
    assert np.abs(session.replay.warp.read() - released).max() > 0.15


def test_a_push_into_something_frozen_does_not_fold_at_its_border(session: Session) -> None:
    session.set_grid(96)
    session.change(PUTTY.name, viscosity=PUTTY.viscosity, drag=PUTTY.drag)
    frozen = Press(BrushSettings(0.07, 0.6), False, session.extent, session.dt)
    session.press(TOOL["freeze"], frozen, 0.67, 0.37)
    for k in range(1, 9):
        session.move(0.67, 0.37 + 0.016 * k)
        session.advance(1)
    session.release()
    session.settle()
    session.press(TOOL["push"], Press(BrushSettings(), False, session.extent, session.dt), 0.45, 0.5)
    for k in range(1, 15):
        session.move(0.45 + 0.015 * k, 0.5 - 0.004 * k)
        session.advance(1)
    session.release()
    session.settle()
    statistics = session.replay.warp.statistics()
    assert statistics.displacement_max > 0.05
    assert statistics.folds == 0


@pytest.mark.parametrize("feel", [HONEY, PUTTY], ids=lambda feel: feel.name)
def test_a_push_into_something_a_thousand_times_thicker_does_not_fold_at_its_border(
    session: Session, feel: Feel
) -> None:
    session.set_grid(96)
    session.change(feel.name, viscosity=feel.viscosity, drag=feel.drag)
    thick = Press(BrushSettings(0.07, 1.0), False, session.extent, session.dt)
    session.press(TOOL["thicken"], thick, 0.67, 0.37)
    for k in range(1, 25):
        session.move(0.67, 0.37 + 0.128 * k / 24)
        session.advance(1)
    session.release()
    session.settle()
    viscosity = session.replay.fluid.viscosity.get()
    assert viscosity.max() > 1000 * viscosity.min()
    session.press(TOOL["push"], Press(BrushSettings(), False, session.extent, session.dt), 0.35, 0.5)
    for k in range(1, 15):
        session.move(0.35 + 0.45 * k / 14, 0.5)
        session.advance(1)
    session.release()
    session.settle()
    statistics = session.replay.warp.statistics()
    assert statistics.folds == 0
    assert statistics.displacement_max > 0.15


@pytest.mark.parametrize(
    ("feel", "ways"),
    [
        (HONEY, [((0.1, 0.5), (0.9, 0.5))]),
        (PUTTY, [((0.1, 0.1), (0.9, 0.9))]),
        *((feel, [((0.1 + 0.2 * k, 0.5), (0.3 + 0.2 * k, 0.5)) for k in range(4)]) for feel in (HONEY, PUTTY)),
    ],
    ids=["Honey, across", "Putty, corner to corner", "Honey, four after one another", "Putty, four after one another"],
)
def test_a_long_push_smears_and_does_not_fold(session: Session, feel: Feel, ways: list) -> None:
    session.set_grid(96)
    session.change(feel.name, viscosity=feel.viscosity, drag=feel.drag)
    press = Press(BrushSettings(), False, session.extent, session.dt)
    steps, least = 48 // len(ways), 1.0
    for (x0, y0), (x1, y1) in ways:
        session.press(TOOL["push"], press, x0, y0)
        for k in range(1, steps + 1):
            session.move(x0 + (x1 - x0) * k / steps, y0 + (y1 - y0) * k / steps)
            session.advance(1)
            least = min(least, session.replay.warp.statistics().det_min)
        session.release()
        session.settle()
    statistics = session.replay.warp.statistics()
    assert least > 0
    assert statistics.folds == 0
    # It still takes what lay under it along for well over its own radius.
    assert statistics.displacement_max > 1.4 * press.brush.radius


# Strokes that wait for the simulation --------------------------------------------------------------------------------


def strike(session: Session, number: int, tool: str = "push") -> None:
    """A quick stroke to the right on a machine that makes one tick in its time."""
    press = Press(BrushSettings(0.12, 0.2), False, session.extent, session.dt)
    session.press(TOOL[tool], press, 0.3, 0.2 + 0.2 * number)
    session.move(0.5, 0.2 + 0.2 * number)
    session.advance(1)
    session.move(0.7, 0.2 + 0.2 * number)
    session.release()


def test_however_often_the_pointer_is_heard_a_step_takes_it_up_once(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    taken_up, use = [], Replay.use
    monkeypatch.setattr(Replay, "use", lambda *given: (taken_up.append(given[1]), use(*given)))
    session.press(TOOL["push"], Press(BrushSettings(0.12, 0.2), False, session.extent, session.dt), 0.4, 0.5)
    for sample in range(1, 30):
        session.move(0.4 + 0.002 * sample, 0.5)
    session.advance(1)
    assert len(taken_up) == 1
    assert session.replay.recipe is session.recipe
    session.cancel()
    assert session.replay.recipe == session.document.recipe


def path_of(stroke: Stroke) -> list[tuple[int, float, float]]:
    return [(tick - stroke.first_tick, x, round(y - stroke.samples[0][2], 5)) for tick, x, y, _ in stroke.samples]


def test_quick_strokes_wait_for_one_another_and_all_act_in_full(
    device: Device, session: Session, tmp_path: Path
) -> None:
    patient = Session(device, session.project)
    for number in range(4):
        strike(session, number)
        assert session.is_behind
        strike(patient, number)
        while patient.is_behind:
            patient.advance(0)
    assert session.notice is None
    strokes = session.recipe.stroke
    assert strokes == patient.recipe.stroke
    assert [path_of(stroke) for stroke in strokes] == [path_of(strokes[0])] * 4
    assert all(later.first_tick > stroke.last_tick for stroke, later in pairwise(strokes))
    session.settle()
    assert session.recipe.stroke == strokes
    patient.settle()
    seen = session.replay.warp.read()
    assert np.array_equal(seen, patient.replay.warp.read())
    patient.release_gpu()
    # What is saved is what was seen.
    projects.save(replace(session.project, recipe=session.document.recipe), tmp_path / "w.fluidwarp")
    again = Session(device, projects.load(tmp_path / "w.fluidwarp"))
    again.settle()
    assert np.array_equal(again.replay.warp.read(), seen)
    again.release_gpu()


def test_what_waits_is_what_the_simulation_has_not_come_to_the_end_of(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And where the playhead has been sent somewhere, nothing waits."""
    monkeypatch.setattr("app.work.playing.QUICK", 0.0)  # a machine on which every tick takes a frame
    for number in range(3):
        strike(session, number)
    strokes, seen = session.recipe.stroke, list[int]()
    while session.coasting:
        assert session.waiting == [one for one in strokes if one.end_tick >= session.tick]
        seen.append(len(session.waiting))
        session.advance(1)
    assert sorted({*seen}) == [0, 1, 2, 3]
    strike(session, 0)
    assert len(session.waiting) == 1
    session.seek(0)
    assert session.waiting == []


def test_undo_takes_exactly_the_last_of_the_waiting_strokes(session: Session) -> None:
    strike(session, 0)
    strike(session, 1)
    before = session.recipe
    session.press(TOOL["push"], Press(BrushSettings(), False, session.extent, session.dt), 0.5, 0.8)
    session.release()
    session.undo()
    assert session.recipe == before
    session.settle()
    assert session.tick == session.end
    seen = session.replay.warp.read()
    session.redo()
    assert len(session.recipe.stroke) == 3
    session.undo()
    session.settle()
    assert np.array_equal(session.replay.warp.read(), seen)


def test_only_sending_the_playhead_back_cuts_what_comes_after_it(session: Session) -> None:
    strike(session, 0)
    session.pause()
    assert session.tick < session.end
    # Time that stands still in the middle of a stroke is no wish to lose the rest of it.
    strike(session, 1)
    assert [stroke.samples[-1][1] for stroke in session.recipe.stroke] == [0.7, 0.7]
    session.pause()
    session.play()
    session.settle()
    assert session.tick == session.end
    session.seek(2)
    strike(session, 2)
    first, second = session.recipe.stroke
    assert first.last_tick == 1
    assert second.first_tick == 2
    assert session.notice is not None
    # Nor is it one to do so once more.
    session.pause()
    strike(session, 3)
    assert [stroke.samples[-1][1] for stroke in session.recipe.stroke[1:]] == [0.7, 0.7]


def test_going_on_from_within_a_stroke_with_few_samples_changes_nothing_that_was_there(session: Session) -> None:
    stroke = Stroke.model_validate({"tool": "push", "samples": ((0, 0.3, 0.5, 1.0), (20, 0.7, 0.5, 1.0))})
    session.edit("Stroke", stroke=(stroke,), duration=24 * session.dt)
    session.seek(12)
    session.settle()
    seen = session.replay.warp.read()
    session.change("Putty", viscosity=0.3)
    session.seek(12)
    session.settle()
    np.testing.assert_allclose(session.replay.warp.read(), seen, atol=1e-5)
    assert [stroke.last_tick for stroke in session.recipe.stroke] == [11]


@pytest.mark.parametrize(
    "settings", [{"viscosity": 0.3, "drag": 0.0}, {"clear_velocity": True}], ids=["another feel", "all motion stopped"]
)
def test_a_change_waits_behind_the_strokes_too(session: Session, settings: dict) -> None:
    strike(session, 0)
    strokes = session.recipe.stroke
    session.change("Change", **settings)
    strike(session, 1)
    assert session.recipe.stroke[:1] == strokes
    assert strokes[0].last_tick < session.recipe.change[0].tick <= session.recipe.stroke[1].first_tick
    session.settle()
    seen, tick = session.replay.warp.read(), session.tick
    session.replay.checkpoints.clear()
    session.replay.seek(0)
    session.replay.seek(tick)
    assert np.array_equal(session.replay.warp.read(), seen)


def test_what_wakes_on_its_way_to_a_moment_still_goes_there(session: Session) -> None:
    strike(session, 0)
    session.settle()
    for tick in (0, 3, session.end):
        session.seek(tick)
        session.release_gpu()  # before it has got there
        session.wake()
        session.settle()
        assert session.tick == session.replay.tick == tick


def test_a_stroke_held_while_others_wait_lasts_as_long_as_it_was_held(session: Session) -> None:
    for number in range(3):
        strike(session, number)
    waiting = session.end - session.tick
    session.press(TOOL["twirl"], Press(BrushSettings(), False, session.extent, session.dt), 0.5, 0.5)
    for _ in range(waiting + 10):
        session.advance(1)
    session.release()
    twirl = session.recipe.stroke[-1]
    assert waiting + 9 <= twirl.last_tick - twirl.first_tick <= waiting + 10
    session.settle()
    assert session.tick == session.end


def test_what_is_given_up_leaves_the_waiting_strokes(session: Session) -> None:
    strike(session, 0)
    strike(session, 1)
    strokes = session.recipe.stroke
    session.press(TOOL["push"], Press(BrushSettings(), False, session.extent, session.dt), 0.5, 0.8)
    session.move(0.6, 0.8)
    session.cancel()
    session.settle()
    assert session.recipe.stroke == strokes
    assert session.tick == session.end == session.document.recipe.ticks


def test_what_waits_is_finished_though_nothing_more_is_recorded(session: Session) -> None:
    strike(session, 0)
    strike(session, 1)
    recipe = session.recipe
    session.stop_recording()
    assert session.target == session.end
    session.settle()
    assert session.tick == session.end
    assert session.document.recipe == recipe


@pytest.mark.parametrize("seed", range(2))
def test_whatever_is_done_while_strokes_wait_the_recipe_is_what_is_seen(
    session: Session, monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    monkeypatch.setattr("app.work.playing.QUICK", 0.0)  # a machine on which every tick takes a frame
    monkeypatch.setattr("app.work.playing.PATIENCE", 0.0)
    dice = random.Random(seed)

    def gesture() -> None:
        strokes, session.notice = session.recipe.stroke, None
        press = Press(BrushSettings(0.12, 0.2), dice.random() < 0.2, session.extent, session.dt)
        session.press(TOOL[dice.choice(PAINTING).name], press, dice.random(), dice.random(), 1.0, dice.random() < 0.1)
        for _ in range(dice.randrange(5)):
            session.move(dice.random(), dice.random())
            session.advance(dice.randrange(3))
        if dice.random() < 0.2:
            session.cancel()
        else:
            session.release()
        if session.notice is None:  # else the person is told what goes
            assert session.recipe.stroke[: len(strokes)] == strokes

    doings = [
        *[gesture] * 6, session.undo, session.redo, session.pause, session.play, session.step, session.cancel,
        session.stop_recording, lambda: session.change("Putty", viscosity=dice.choice((0.3, 0.03))),
        lambda: session.change("Stop all motion", clear_velocity=True), lambda: session.prepare_grid(24, 0.0),
        lambda: session.go_to(dice.randrange(len(session.document.history.entries))),
        lambda: session.seek(dice.randrange(session.end + 1)),
    ]  # fmt: skip
    for _ in range(30):
        dice.choice(doings)()
        for _ in range(dice.randrange(6)):
            session.advance(dice.randrange(3))
        assert session.document.recipe == session.recipe
        assert 0 <= session.tick <= max(session.end, 1)
    session.seek(session.end)
    session.settle()
    seen, tick = session.replay.warp.read(), session.tick
    assert tick == session.end
    session.replay.checkpoints.clear()
    session.replay.seek(0)
    session.replay.seek(tick)
    assert np.array_equal(session.replay.warp.read(), seen)


def test_a_coarser_grid_makes_no_stroke_coarser(session: Session) -> None:
    """Of 20 cells a brush's radius 7 were left, and a lip that went 97 pixels went 90."""
    session.begin_with(grid=80, viscosity=PUTTY.viscosity, drag=PUTTY.drag)
    for y in (0.4, 0.6):
        paint(session, "push", (0.4, y), (0.6, y))
        session.settle()
    before = session.replay.warp.read((120, 90))
    assert [stroke.detail for stroke in session.recipe.stroke] == [0, 0], "fine enough on the whole picture"
    while not session.prepare_grid(24, 1.0):
        pass
    assert session.recipe.stroke[0].detail > 80
    assert np.abs(session.replay.warp.read((120, 90)) - before).max() < 0.02 * np.abs(before).max()
    first, second, third = (entry.recipe.stroke for entry in session.document.history.entries)
    assert (len(first), len(second), len(third)) == (0, 1, 2)
    assert second[0] is third[0], "what entries share is held once"
    after = session.replay.warp.read()
    session.undo()
    session.settle()
    session.redo()
    session.settle()
    assert np.array_equal(session.replay.warp.read(), after)
    assert session.recipe == session.document.recipe


def test_nor_does_one_that_the_person_chooses(session: Session) -> None:
    """And it is one edit: undone, the strokes are as they were made."""
    session.begin_with(grid=80, viscosity=PUTTY.viscosity, drag=PUTTY.drag)
    paint(session, "push", (0.4, 0.5), (0.6, 0.5))
    session.settle()
    made, before = session.recipe, session.replay.warp.read((120, 90))
    session.set_grid(24)
    session.settle()
    assert (session.recipe.fluid.grid, session.recipe.stroke[0].detail > 80) == (24, True)
    assert np.abs(session.replay.warp.read((120, 90)) - before).max() < 0.02 * np.abs(before).max()
    session.undo()
    assert session.recipe == made


def test_what_was_previewed_and_dropped_sends_the_playhead_nowhere_later(session: Session) -> None:
    """A setting is dragged and Undo pressed meanwhile; what is then done and taken back leaves the playhead alone."""
    paint(session, "push", (0.4, 0.5), (0.6, 0.5))
    session.settle()
    session.seek(2)
    session.settle()
    session.preview_change(drag=1.0)
    session.undo()
    session.redo()
    session.seek(session.end)
    session.settle()
    end = session.target
    session.edit("Amount", amount=0.5)
    session.retract()
    session.settle()
    assert (session.target, session.recipe.amount) == (end, 1.0)


@pytest.mark.parametrize("goes_on", ["play", "step"])
def test_time_that_goes_on_while_a_setting_is_dragged_takes_nothing_from_the_work(
    session: Session, goes_on: str
) -> None:
    """What is cut off while the slider is held was cut out of the entry before it, where no Undo brought it back."""
    paint(session, "push", (0.3, 0.5), (0.6, 0.5), ticks=8)
    session.settle()
    entries = session.document.history.entries
    session.seek(5)
    session.settle()
    session.preview_change(drag=1.0)
    session.settle()
    getattr(session, goes_on)()
    session.advance(1)
    assert session.end > 5, "time goes on"
    assert session.document.history.entries == entries
    session.commit("Drag")
    assert session.document.history.entries[:-1] == entries
    assert session.recipe.fluid_at(5).drag == 1.0
    session.undo()
    assert session.recipe == entries[-1].recipe


@pytest.mark.parametrize("goes_on", ["play", "step"])
def test_time_that_goes_on_while_a_recording_is_made_shorter_is_no_part_of_the_work_before(
    session: Session, goes_on: str
) -> None:
    for y in (0.4, 0.6):
        paint(session, "push", (0.3, y), (0.6, y), ticks=8)
        session.settle()
    entries, to_the_left = session.document.history.entries, -(session.end - 9)
    session.edit_bars("Move", {("stroke", 1)}, lambda one: moved(one, to_the_left, session.dt), commit=False)
    session.settle()
    assert 0 < session.end < entries[-1].recipe.ticks
    getattr(session, goes_on)()
    session.advance(1)
    assert session.document.history.entries == entries
    session.commit("Move")
    assert session.document.history.entries[:-1] == entries
    session.undo()
    assert session.recipe == entries[-1].recipe


@pytest.mark.parametrize("act", ["masks", "change", "stroke"])
def test_what_is_done_while_a_bar_is_dragged_begins_where_the_work_ends(session: Session, act: str) -> None:
    """A mask was seen at a tick that the recording did not have, and gone once it was saved."""
    paint(session, "push", (0.3, 0.5), (0.6, 0.5), ticks=8)
    session.settle()
    before = session.recipe
    session.edit_bars("Move", {("stroke", 0)}, lambda one: moved(one, 30, session.dt), commit=False)
    session.settle()
    assert session.end > before.ticks
    if act == "masks":
        session.edit_masks("Invert", InvertMask(kind="invert", of="frozen", tick=0))
    elif act == "change":
        session.change("Drag", drag=1.0)
    else:
        paint(session, "push", (0.3, 0.3), (0.6, 0.3), ticks=8)
    session.settle()
    recipe = session.document.recipe
    assert recipe.stroke[0] == before.stroke[0]
    assert [edit.tick for edit in recipe.mask] == [before.ticks] * (act == "masks")
    assert [change.tick for change in recipe.change] == [before.ticks] * (act == "change")
    assert [stroke.first_tick for stroke in recipe.stroke[1:]] == [before.ticks] * (act == "stroke")
    seen = session.replay.warp.read()
    session.seek(0)
    session.settle()
    session.seek(session.end)
    session.settle()
    assert np.array_equal(session.replay.warp.read(), seen)


def test_nothing_moves_while_what_changes_the_fluid_from_here_on_is_dragged(session: Session) -> None:
    paint(session, "push", (0.4, 0.5), (0.6, 0.5))
    session.advance(1)
    assert session.coasting
    for viscosity in (0.5, 0.4, 0.3):
        session.preview_change(viscosity=viscosity)
        assert not session.coasting
        assert not session.playing
        end = session.end
        session.settle()
        assert not session.is_moving
        assert (session.tick, session.end) == (end, end)


@pytest.mark.parametrize("ticks", [0, 3])
def test_the_amount_is_an_edit_of_its_own_while_the_fluid_coasts(session: Session, ticks: int) -> None:
    """It is dragged while the recording goes on, which is no part of it, as it is none of the recording."""
    paint(session, "push", (0.4, 0.5), (0.6, 0.5))
    before = session.document.history.index
    session.preview(amount=0.5)
    session.advance(1)
    for _ in range(ticks):
        session.advance(1)
    session.commit("Amount")
    session.settle()
    assert [entry.name for entry in session.document.history.entries][before:] == ["Push", "Amount"]
    assert session.recipe.amount == 0.5
    session.undo()
    assert (session.recipe.amount, len(session.recipe.stroke)) == (1.0, 1)
    session.redo()
    assert (session.recipe.amount, len(session.recipe.stroke)) == (0.5, 1)


@pytest.mark.parametrize("name", ["Amount", "Repeat stroke"])
def test_what_is_retracted_lets_the_fluid_coast_on_if_it_did_so_before(session: Session, name: str) -> None:
    """As one click on the slider does."""
    paint(session, "push", (0.4, 0.5), (0.6, 0.5))
    session.advance(1)
    before = session.recipe
    if name == "Amount":
        session.edit(name, amount=0.5)
    else:
        session.edit_bars(name, {("stroke", 0)}, lambda one: one.model_copy(update={"muted": True}))
    session.advance(1)
    assert session.coasting
    session.retract()
    assert session.coasting
    assert (session.recipe.amount, session.recipe.stroke) == (before.amount, before.stroke)
    session.settle()
    assert session.end > before.recorded
    assert not session.is_behind


def test_a_handle_that_is_set_to_what_it_was_makes_the_work_no_longer(session: Session) -> None:
    """As by a slider that is dragged there and back: what is made again up to the end was let coast on, for nothing."""
    handle = RecipeHandle(at=(0.4, 0.5), to=(0.45, 0.5), duration=0.1)
    session.edit("Handle", handle=(handle,), duration=0.5)
    session.settle()
    session.seek(session.end)
    session.settle()
    before = session.document.recipe
    session.edit_held("Turn", "handle[1]", False, rotate=30.0)
    session.edit_held("Turn", "handle[1]", rotate=None)
    assert session.is_behind
    session.settle()
    assert session.document.recipe == before
    session.edit_held("Turn", "handle[1]", rotate=5.0)
    session.settle()
    assert session.end * session.dt > before.duration


def test_what_is_retracted_behind_the_end_in_a_clip_leaves_the_playhead_there(device: Device, tmp_path: Path) -> None:
    """A clip that is longer than the recording goes on with the last warp."""
    for number in range(60):
        write_picture(tmp_path / f"c.{number:04d}.png", pattern(40, 30))
    recipe = Recipe.model_validate({"fluid": {"grid": 32}})
    session = Session(device, projects.from_picture(tmp_path / "c.%04d.png", recipe))
    paint(session, "push", (0.4, 0.5), (0.6, 0.5))
    session.stop_recording()
    session.settle()
    assert session.length > session.end + 10
    session.seek(session.end + 7)
    session.settle()
    moment = session.moment
    session.edit("Amount", amount=0.5)
    session.retract()
    session.settle()
    assert session.moment == moment
    session.release_gpu()


def test_a_grid_that_is_not_wanted_any_more_has_nothing_on_the_gpu(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    paint(session, "push", (0.4, 0.5), (0.5, 0.5))
    session.settle()
    made = Made(monkeypatch)
    cells = 2 * session.recipe.fluid.grid
    assert not session.prepare_grid(cells, 0.0)
    assert made.left
    session.forget_grid()
    assert made.left == []
    session.forget_grid()
    assert not session.prepare_grid(cells, 0.0)  # from the beginning


@pytest.mark.parametrize(("loops", "returns"), [(False, False), (True, False), (False, True)])
def test_the_recording_is_played_once_or_over_and_over_or_there_and_back(
    session: Session, loops: bool, returns: bool
) -> None:
    paint(session, "push", (0.4, 0.5), (0.5, 0.5))
    session.settle()
    if loops or returns:  # unless it is asked for, once
        session.repeat(loops, returns)
    end, maps, ticks = session.end, dict[int, bytes](), list[int]()
    session.seek(0)
    while session.is_behind:
        session.advance(1)
    session.play()
    for _ in range(3 * end):
        session.advance(1)
        ticks.append(session.tick)
        seen = session.replay.warp.read().tobytes()
        assert maps.setdefault(session.tick, seen) == seen
    there, back = list(range(1, end + 1)), list(range(end - 1, -1, -1))
    expected = [*there, *back, *there] if returns else [*there, 0, *there, 0, *there] if loops else there
    assert ticks[: len(expected)] == expected[: 3 * end]
    assert session.playing == (loops or returns)
    assert session.document.recipe.time.ping_pong == returns


def test_a_stroke_begun_while_the_recording_is_played_takes_the_place_of_what_comes_after(session: Session) -> None:
    paint(session, "push", (0.4, 0.5), (0.5, 0.5))
    session.settle()
    end = session.end
    session.seek(0)
    session.settle()
    session.play()
    for _ in range(3):
        session.advance(1)
    tick = session.tick
    assert 0 < tick < end
    paint(session, "push", (0.7, 0.5), (0.6, 0.5))
    assert session.recipe.stroke[-1].first_tick == tick
    assert session.notice is not None


def test_a_stabilised_stroke_is_recorded_as_it_acts_and_ends_at_the_pen(session: Session) -> None:
    press = Press(BrushSettings(0.12), False, session.extent, session.dt, string=0.15)
    session.press(TOOL["push"], press, 0.3, 0.5)
    for step in range(1, 11):
        session.move(0.3 + 0.04 * step, 0.5 + 0.05 * (-1) ** step)
        session.advance(1)
    session.release()
    (stroke,) = session.recipe.stroke
    y = [sample[2] for sample in stroke.samples]
    # The string is three times as long as the pen shakes, and turns it back by as much.
    assert max(abs(here - 0.5) for here in y[:-6]) < 0.03
    assert stroke.samples[-1][1:3] == (0.7, 0.55)
    before = [sample for sample in stroke.samples if sample[1] < 0.6]
    assert len(stroke.samples) - len(before) > 3, "the end comes at the speed of a straight stroke"
    session.settle()
    seen = session.replay.warp.read()
    session.replay.checkpoints.clear()
    session.seek(0)
    session.settle()
    session.seek(session.end)
    session.settle()
    assert np.array_equal(session.replay.warp.read(), seen)


def test_a_push_that_stays_in_a_fluid_at_rest_is_no_edit(session: Session) -> None:
    paint(session, "push", (0.4, 0.5), (0.5, 0.5))
    session.settle()
    session.seek(2)
    session.settle()
    for place in ((0.3, 0.3), (0.6, 0.6)):
        before, entries = session.recipe, session.document.history.entries
        session.seek(0)
        session.settle()
        paint(session, "push", place, place)
        session.settle()
        assert (session.recipe, session.document.history.entries, session.tick) == (before, entries, 0)
        assert session.last_place == place, "a straight stroke can begin there"


def test_a_push_that_stays_holds_a_fluid_that_moves(session: Session) -> None:
    session.change("thin", viscosity=0.001, drag=0.0)
    paint(session, "push", (0.4, 0.5), (0.55, 0.5))
    session.advance(2)
    assert session.coasting
    speed = session.replay.fluid.motion().largest_speed
    paint(session, "push", (0.55, 0.5), (0.55, 0.5), ticks=6)
    assert len(session.recipe.stroke) == 2
    assert session.replay.fluid.motion().largest_speed < 0.9 * speed


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        ((0.123456, 0.654321), (0.12346, 0.65432)), ((-0.4, 1.4), (-0.4, 1.4)), ((-0.6, 0.5), (-0.5, 0.5)),
        ((1.6, 0.5), (1.5, 0.5)), ((0.5, -0.6), (0.5, -0.5)), ((0.5, 1.6), (0.5, 1.5)),
    ],
)  # fmt: skip
def test_places_are_kept_half_a_picture_around_it_to_five_digits(given: Point, kept: Point) -> None:
    assert kept_near(*given) == kept


def muted(one: Actor) -> Actor:
    return one.model_copy(update={"muted": True})


ACTS: dict[str, Callable[[Session], object]] = {
    "edit": lambda session: session.edit("Amount", amount=0.5),
    "preview": lambda session: session.preview(amount=0.5),
    "edit_bars": lambda session: session.edit_bars("Mute", {("stroke", 0)}, muted),
    "edit_held": lambda session: session.edit_held("Set", "handle[1]", stiffness=0.5),
    "edit_masks": lambda session: session.edit_masks("Fill", mask_edit(TRIANGLE)),
    "change": lambda session: session.change("Drag", drag=20.0),
    "preview_change": lambda session: session.preview_change(drag=20.0),
    "let_go": lambda session: session.let_go("handle[1]"),
    "start_from_map": lambda session: session.start_from_map("m.npy"),
    "set_grid": lambda session: session.set_grid(20),
    "repeat": lambda session: session.repeat(False, True),
    "undo": lambda session: session.undo(),
    "redo": lambda session: session.redo(),
    "go_to": lambda session: session.go_to(1),
    "seek": lambda session: session.seek(2),
    "play": lambda session: session.play(),
    "pause": lambda session: session.pause(),
    "step": lambda session: session.step(),
    "stop_recording": lambda session: session.stop_recording(),
}
BEGUN = ["push", "thicken", "handle", "lead on"]


@pytest.mark.parametrize("begun", BEGUN)
def test_whatever_is_done_while_a_gesture_is_open_is_done_as_if_it_had_been_ended_just_before(
    device: Device, tmp_path: Path, begun: str
) -> None:
    """The brush is still on its way to the pen, so that a stroke that ends is not what it was so far."""
    project = small_project(tmp_path, grid=16)
    np.save(tmp_path / "m.npy", np.zeros((12, 16, 2), np.float32))
    push = Stroke(tool="push", samples=((0, 0.3, 0.6, 1.0), (3, 0.4, 0.6, 1.0)))

    def after(act: Callable[[Session], object], ends: bool) -> list[object]:
        session = Session(device, project)
        dt, extent = session.dt, session.extent
        led = RecipeHandle(at=(0.3, 0.3), to=(0.4, 0.3), duration=3 * dt)
        session.edit("Begin", stroke=(push,), handle=(led,), duration=6 * dt)
        session.seek(session.end)
        session.settle()
        press = Press(BrushSettings(0.2, 0.2), False, extent, dt, string=0.1)
        held = session.held[0] if begun == "lead on" else None
        x, y = held.now if held is not None else (0.6, 0.5)
        session.press(TOOL["handle" if held is not None else begun], press, x, y, held=held)
        for part in range(1, 4):
            session.move(x + part / 12, y + part / 20)
            session.advance(1)
        assert session.is_painting
        if ends:
            session.release()
        act(session)
        assert not session.is_painting
        history = session.document.history
        told = [session.recipe, history.entries, history.index, session.playing, session.coasting, session.target]
        session.pause()
        session.settle()
        told += [session.recipe, history.entries, session.tick, session.replay.warp.read().tobytes()]
        session.release_gpu()
        return told

    for name, act in ACTS.items():
        open_, ended = (after(act, ends) for ends in (False, True))
        for number, (one, other) in enumerate(zip(open_, ended, strict=True)):
            assert one == other, (name, number)


@pytest.mark.parametrize("setting", [{"drag": 1.0}, {"viscosity": 0.5}, {"walls": "no-slip"}])
def test_what_is_set_at_the_tick_where_one_goes_back_and_paints_stays(
    session: Session, setting: dict[str, Any]
) -> None:
    """The fluid was shown as it is set there, and then painted on as it had been before."""
    paint(session, "push", (0.3, 0.5), (0.4, 0.5), ticks=2)
    session.stop_recording()
    tick = session.next_tick
    session.change("Fluid", **setting)
    session.stop_recording()
    paint(session, "push", (0.3, 0.6), (0.4, 0.6), ticks=2)
    session.stop_recording()
    session.seek(tick)
    shown = session.recipe.fluid_at(session.next_tick)
    assert {name: getattr(shown, name) for name in setting} == setting
    paint(session, "push", (0.6, 0.5), (0.5, 0.5), ticks=2)
    assert session.recipe.stroke[-1].first_tick == tick
    assert len(session.recipe.stroke) == 2
    assert session.recipe.fluid_at(tick) == shown


def test_who_goes_on_at_the_very_start_with_what_is_set_there_has_cut_nothing_off(session: Session) -> None:
    paint(session, "push", (0.3, 0.5), (0.4, 0.5), ticks=2)
    session.stop_recording()
    session.seek(0)
    session.change("Fluid", drag=1.0)
    assert session.notice is not None
    session.stop_recording()
    assert (session.recipe.stroke, session.recipe.fluid_at(0).drag) == ((), 1.0)
    session.seek(0)
    session.notice = None
    paint(session, "push", (0.6, 0.5), (0.5, 0.5), ticks=2)
    assert session.notice is None
    assert (session.recipe.stroke[0].first_tick, session.recipe.fluid_at(0).drag) == (0, 1.0)

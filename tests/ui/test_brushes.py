"""Brushes: each tool's own, those that are kept by a name, and the stabiliser."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from math import hypot
from pathlib import Path

import numpy as np
import pytest

from app.gallery import retouching
from app.media.pictures import write_picture
from app.media.project import from_picture
from app.model.presets import BRUSHES, PUTTY
from app.model.strokes import Change, Stroke
from app.model.tools import BrushSettings
from app.ui.editor_state import LIMITS, SMALLEST, EditorState, presets
from app.ui.events import RIGHT
from app.ui.files import fresh_recipe
from app.ui.preferences import Preferences
from solver.gl.device import Device
from support.editing import Robot, pattern, small_project
from support.widgets import Widgets


@pytest.fixture
def robot(device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Robot]:
    monkeypatch.setattr("platformdirs.user_config_path", lambda name: tmp_path / "kept")
    preferences = Preferences(auto_quality=False, path=tmp_path / "kept" / "preferences.json")
    with Robot(device, small_project(tmp_path), preferences=preferences) as robot:
        yield robot


def open_more(robot: Robot, widgets: Widgets) -> None:
    """Press the button behind the last slider of the bar."""
    widgets.look()
    last = max((widgets.at[label] for label in ("Size", "Hardness", "Strength", "Local")), key=lambda rect: rect.right)
    robot.click(last.right + 8 + 16, 24)
    robot.frame(count=3)
    assert robot.editor.ui.has_popup


def test_each_tool_has_its_own_brush_and_is_left_with_it(robot: Robot) -> None:
    state = robot.editor.state
    for tool, radius, hardness in (("p", 0.2, 0.1), ("f", 0.05, 0.9), ("t", 0.3, 0.0)):
        robot.key(tool)
        state.brush = replace(state.brush, radius=radius, hardness=hardness, strength=0.5)
    state.stabiliser = 35.0
    robot.key("p")
    assert (state.brush.radius, state.brush.hardness) == (0.2, 0.1)
    robot.key("b")
    assert state.brush.radius == 0.15
    robot.editor.remember()
    left = EditorState.recalled(Preferences.load())
    assert (left.brush, left.brushes, left.stabiliser) == (state.brushes["push"], state.brushes, 35)


def test_kept_brushes_that_cannot_be_are_made_so_that_they_can(robot: Robot, tmp_path: Path) -> None:
    path = tmp_path / "kept" / "preferences.json"
    path.parent.mkdir(exist_ok=True)
    path.write_text(
        """{"brushes": {"push": {"radius": 99, "hardness": -1, "strength": NaN, "no": 1}, "no tool": {}, "twirl": 3,
        "freeze": {"radius": "1", "hardness": 1e10}},
        "presets": {"mine": {"radius": 1e300}, "\\ud800": {}, "": {}}, "stabiliser": 1e9, "sections": {"view": 1},
        "keys": {"open": "k", "x": [1], "undo": ["\\ud800"]}, "window": [0, 0, 1%s, 600, 0]}"""
        % (400 * "0")
    )
    kept = Preferences.load()
    state = EditorState.recalled(kept)
    assert (state.brush.radius, state.brush.hardness, state.brush.strength) == (0.5, 0, 1)
    assert kept.brushes["freeze"] == {}
    assert (kept.stabiliser, kept.window, kept.keys, kept.sections) == (200, [], {}, {})
    assert [(preset.name, preset.radius) for preset in presets(kept)[len(BRUSHES) :]] == [("mine", 0.15)]


def test_brushes_are_kept_by_name_chosen_and_deleted(robot: Robot, widgets: Widgets) -> None:
    state, likes = robot.editor.state, robot.editor.preferences
    state.brush = replace(state.brush, radius=0.07, hardness=0.4, strength=0.6, local=0.3)
    open_more(robot, widgets)
    keep = widgets.at["Keep"]
    robot.click(keep.x - 100, keep.middle[1])
    robot.type("Mine")
    robot.frame(count=2)
    robot.click(*keep.middle)
    robot.frame(count=2)
    assert likes.presets == {"Mine": {"radius": 0.07, "hardness": 0.4, "strength": 0.6}}
    assert Preferences.load().presets == likes.presets
    # The rows stand above the field, 28 points and a gap of 8 each; the new one pushes the field down.
    row = robot.editor.ui.px(28 + 8)
    field = keep.middle[1] + row
    first = field - row * (len(BRUSHES) + 1)
    for number, preset in enumerate(BRUSHES):
        robot.click(keep.x - 100, first + number * row)
        now = (preset.radius, preset.hardness, preset.strength)
        assert (state.brush.radius, state.brush.hardness, state.brush.strength) == now
        assert state.brush.local == 0.3
    robot.click(keep.x - 100, field - row)
    assert state.brush.radius == 0.07
    robot.click(keep.right - 14, field - row)
    assert likes.presets == Preferences.load().presets == {}


@pytest.mark.parametrize("name", retouching.JOBS)
def test_a_brush_can_be_as_small_as_those_of_the_guide(name: str) -> None:
    least, most = LIMITS["radius"]
    for stroke in retouching.load(name).stroke:
        assert least <= stroke.radius <= most


def test_a_brush_is_not_smaller_than_a_pixel(device: Device, tmp_path: Path) -> None:
    """On a picture of 32 it could be of .064, and the brush of a larger picture was; a flick went on for 17 s."""
    write_picture(tmp_path / "small.png", pattern(32, 20))
    with Robot(device, from_picture(tmp_path / "small.png", fresh_recipe())) as robot:
        state, view = robot.editor.state, robot.editor.view
        state.brush = replace(state.brush, radius=SMALLEST)
        assert state.brush.radius == 0.5 / 32
        for _ in range(2):
            robot.key("[")
        assert state.brush.radius == 0.5 / 32
        robot.move(*robot.at(0.5, 0.5))
        robot.press(RIGHT)
        robot.move(view.rect.x, robot.at(0.5, 0.5)[1])
        robot.release(RIGHT)
        assert state.brush.radius == 0.5 / 32
        robot.drag((0.1, 0.5), (0.9, 0.5), 1)
        assert robot.editor.session.recipe.stroke[-1].last_tick < 60


def test_the_ring_of_a_stroke_under_way_is_as_large_as_its_brush(robot: Robot) -> None:
    robot.see()
    x, y = robot.at(0.5, 0.5)
    robot.move(x, y)
    robot.press()
    robot.frame(count=4)
    before, radius = robot.canvas(), robot.editor.state.brush.radius
    robot.key("]")
    robot.frame(count=4)
    assert robot.editor.state.brush.radius > radius
    assert np.array_equal(robot.canvas(), before), "the larger one is the next stroke's"
    robot.move(x + 30, y)
    robot.release()
    robot.rest()
    assert robot.editor.session.recipe.stroke[-1].radius == radius


def test_the_stabiliser_is_as_long_on_the_screen_at_any_zoom(robot: Robot) -> None:
    robot.editor.state.stabiliser = 40.0
    for _ in range(2):
        x, y = robot.at(0.5, 0.5)
        robot.move(x - 100, y)
        robot.press()
        robot.move(x - 62, y + 8)
        session = robot.editor.session
        assert len(set(session.path)) == 1, "within the string nothing moves"
        robot.move(x, y)
        assert robot.editor.pointer.ring_at == pytest.approx((x - 40, y), abs=1.5)
        robot.release()
        stroke = session.recipe.stroke[-1]
        assert robot.at(*stroke.samples[-1][1:3]) == pytest.approx((x, y), abs=0.1), "it catches up with the pen"
        robot.rest()
        robot.key("=")


def test_a_hand_that_shakes_draws_a_calm_stroke(robot: Robot) -> None:
    """The length of the path, of a straight line with noise of 6 points, with and without."""
    dice, lengths = np.random.default_rng(5), []
    noise = dice.uniform(-6, 6, (40, 2))
    for stabiliser in (0.0, 60.0):
        robot.editor.state.stabiliser = stabiliser
        x, y = robot.at(0.2, 0.4)
        robot.move(x, y)
        robot.press()
        for step, (dx, dy) in enumerate(noise, 1):
            robot.move(x + 6 * step + dx, y + dy)
        robot.release()
        samples = robot.editor.session.recipe.stroke[-1].samples
        places = [robot.at(*sample[1:3]) for sample in samples]
        lengths.append(sum(hypot(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(places)))
        robot.rest()
    assert lengths[0] > 1.35 * 240
    assert lengths[1] < 1.03 * 240


@pytest.mark.parametrize("is_changed", [False, True])
def test_pushes_are_as_local_as_suits_the_fluid_where_the_playhead_is(robot: Robot, is_changed: bool) -> None:
    """Not as it is where the work begins, from which it is played when it is opened."""
    editor = robot.editor
    stroke = Stroke(tool="push", samples=((0, 0.3, 0.5, 1.0), (9, 0.6, 0.5, 1.0)))
    putty = Change(tick=6, viscosity=PUTTY.viscosity, drag=PUTTY.drag)
    editor.session.edit("Strokes", stroke=(stroke,), change=(putty,) * is_changed, duration=0.5)
    project = replace(editor.session.project, recipe=editor.session.document.recipe)
    editor.open(project)
    assert editor.session.tick < putty.tick < editor.session.target
    assert editor.state.brush.local == (PUTTY.local if is_changed else BrushSettings.local)

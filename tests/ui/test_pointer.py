"""What the hand on the canvas does, by how much and in which direction: pan, zoom, wheel, split, brush."""

from __future__ import annotations

from dataclasses import replace
from math import exp

import pytest

from app.model.handles import RecipePin
from app.ui.events import LEFT, MIDDLE, RIGHT, Mods, Move
from support.editing import Robot

PLACE = (0.4, 0.45)


@pytest.fixture
def robot(robot: Robot) -> Robot:
    robot.key("ctrl+1")
    return robot


def pull(robot: Robot, dx: float, dy: float, button: int = LEFT) -> None:
    """Drag by points of the screen from where the pointer is."""
    x, y = robot.editor.pointer.x, robot.editor.pointer.y
    robot.press(button)
    for part in (0.3, 1.0):
        robot.move(x + part * dx, y + part * dy)
    robot.release(button)


@pytest.mark.parametrize("by", ["middle button", "space", "pan tool"])
def test_the_picture_is_panned_with_the_pointer(robot: Robot, by: str) -> None:
    x, y = robot.at(*PLACE)
    robot.move(x, y)
    if by == "pan tool":
        robot.key("h")
    robot.hold("space", by == "space")
    pull(robot, 30, -20, MIDDLE if by == "middle button" else LEFT)
    if by == "space":
        robot.hold("space", False)
    assert robot.at(*PLACE) == pytest.approx((x + 30, y - 20), abs=1e-6)
    session = robot.editor.session
    assert (session.recipe.stroke, session.playing) == ((), False)


def test_a_handle_is_marked_where_a_press_would_take_hold_of_it_and_nowhere_else(robot: Robot) -> None:
    """Not where the press would pan, nor while another drag is under way, nor beneath what lies over the canvas."""
    editor, pointer = robot.editor, robot.editor.pointer
    editor.session.edit("Pin", pin=(RecipePin(at=PLACE),))
    robot.rest()
    editor.state.choose_tool("handle", False)
    recipe, place = editor.session.recipe, robot.at(*PLACE)

    def is_marked() -> bool:
        robot.move(*place)
        robot.frame()
        return pointer.hovered is not None

    assert is_marked()
    robot.hold("space", True)
    assert not is_marked()
    pull(robot, 30, -20)
    assert robot.at(*PLACE) == pytest.approx((place[0] + 30, place[1] - 20), abs=1e-6)
    place = robot.at(*PLACE)
    assert not is_marked()
    robot.hold("space", False)
    assert is_marked()
    robot.press(MIDDLE)
    assert not is_marked()
    robot.release(MIDDLE)
    assert is_marked()
    robot.key("f1")
    assert not is_marked()
    robot.key("escape")
    robot.frame(count=2)
    assert is_marked()
    editor.state.choose_tool("push", False)
    assert not is_marked()
    assert editor.session.recipe == recipe


def test_the_wheel_zooms_by_fifteen_percent_a_notch_away_from_the_person(robot: Robot) -> None:
    point = robot.at(*PLACE)
    robot.move(*point)
    for notches in (1, -3, 2.5):
        zoom = robot.editor.view.zoom
        assert zoom is not None
        robot.wheel(notches)
        assert robot.editor.view.zoom == pytest.approx(zoom * 1.15**notches)
        assert robot.at(*PLACE) == pytest.approx(point, abs=1e-6)


def test_the_wheel_with_shift_pans_and_with_alt_sets_the_brush(robot: Robot) -> None:
    x, y = robot.at(*PLACE)
    robot.move(x, y)
    robot.mods = Mods(shift=True)
    robot.wheel(1)
    assert robot.at(*PLACE) == pytest.approx((x + 48, y), abs=1e-6)
    robot.mods = Mods(alt=True)
    radius = robot.editor.state.brush.radius
    robot.wheel(2)
    assert robot.editor.state.brush.radius == pytest.approx(radius * 1.21)
    robot.wheel(-1)
    assert robot.editor.state.brush.radius == pytest.approx(radius * 1.1)
    assert robot.editor.view.zoom == pytest.approx(1.0)


def test_the_zoom_tool_zooms_in_to_the_right_about_where_it_was_pressed(robot: Robot) -> None:
    robot.key("z")
    point = robot.at(*PLACE)
    robot.move(*point)
    pull(robot, 40, 3)
    assert robot.editor.view.zoom == pytest.approx(exp(0.008 * 40))
    assert robot.at(*PLACE) == pytest.approx(point, abs=1e-6)
    robot.move(*point)
    pull(robot, -70, 0)
    assert robot.editor.view.zoom == pytest.approx(exp(-0.008 * 30))


def test_a_click_of_the_zoom_tool_goes_a_step_and_with_alt_back(robot: Robot) -> None:
    robot.key("z")
    point = robot.at(*PLACE)
    for alt, zoom in ((False, 1.5), (False, 2.0), (True, 1.5), (True, 1.0), (True, 2 / 3)):
        robot.mods = Mods(alt=alt)
        robot.click(*point)
        assert robot.editor.view.zoom == pytest.approx(zoom)
        assert robot.at(*PLACE) == pytest.approx(point, abs=1e-6)


def test_the_split_is_taken_hold_of_at_its_line_and_follows_the_pointer(robot: Robot) -> None:
    robot.key("y")
    state, (x, y) = robot.editor.state, robot.at(0.5, 0.3)
    assert state.split == 0.5
    robot.move(x + 7, y)
    assert robot.editor.pointer.cursor == "resize_ew"
    pull(robot, 33, 60)
    assert state.split == pytest.approx(robot.editor.view.to_picture(x + 40, 0)[0])
    assert state.split is not None
    robot.move(*robot.at(state.split, 0.6))
    pull(robot, -2000, 0)
    assert state.split == 0
    assert robot.editor.session.recipe.stroke == ()
    state.split = 0.5
    robot.move(x + 9, y)
    assert robot.editor.pointer.cursor != "resize_ew"
    pull(robot, 30, 0)
    assert (state.split, len(robot.editor.session.recipe.stroke)) == (0.5, 1)


def test_the_right_button_sets_the_brush_where_it_stays(robot: Robot) -> None:
    state, point = robot.editor.state, robot.at(*PLACE)
    before = state.brush = replace(state.brush, radius=0.1, hardness=0.3, strength=0.6)
    robot.move(*point)
    robot.press(RIGHT)
    robot.move(point[0] + 12, point[1] - 50)
    # Points of the screen to the picture's longer side: 240 pixels at 100 %.
    assert state.brush == replace(before, radius=pytest.approx(0.1 + 12 / 240), hardness=pytest.approx(0.5))
    assert robot.editor.pointer.ring_at == point
    robot.move(point[0] - 6, point[1] + 25)
    assert state.brush == replace(before, radius=pytest.approx(0.1 - 6 / 240), hardness=pytest.approx(0.2))
    robot.move(point[0] - 2000, point[1] + 2000)
    assert (state.brush.radius, state.brush.hardness) == (0.5 / 240, 0)
    robot.move(point[0] + 2000, point[1] - 2000)
    assert (state.brush.radius, state.brush.hardness) == (0.5, 1)
    robot.release(RIGHT)
    assert robot.editor.session.recipe.stroke == ()


def test_keys_set_the_brush_by_their_steps(robot: Robot) -> None:
    state = robot.editor.state
    before = state.brush
    for chord, name, value in (
        ("]", "radius", before.radius * 1.15),
        ("[", "radius", before.radius),
        ("[", "radius", before.radius / 1.15),
        ("}", "hardness", 0.1),
        ("shift+]", "hardness", 0.2),
        ("{", "hardness", 0.1),
        ("shift+[", "hardness", 0.0),
        ("shift+[", "hardness", 0.0),
        (";", "strength", 0.9),
        (";", "strength", 0.8),
        ("'", "strength", 0.9),
    ):
        robot.key(chord)
        assert getattr(state.brush, name) == pytest.approx(value), chord


def test_keys_zoom_where_the_pointer_is(robot: Robot) -> None:
    point = robot.at(*PLACE)
    robot.move(*point)
    for chord, zoom in (("=", 1.5), ("+", 2.0), ("ctrl+=", 3.0), ("-", 2.0), ("ctrl+-", 1.5), ("ctrl+1", 1.0)):
        robot.key(chord)
        assert robot.editor.view.zoom == pytest.approx(zoom), chord
        if chord != "ctrl+1":
            assert robot.at(*PLACE) == pytest.approx(point, abs=1e-6)
    robot.key("0")
    assert robot.editor.view.zoom is None


def test_keys_zoom_in_the_middle_where_the_pointer_is_elsewhere(robot: Robot) -> None:
    layout = robot.editor.layout
    middle = robot.editor.view.to_picture(*layout.canvas.middle)
    robot.move(300, layout.timebar.y + 20)
    robot.key("=")
    assert robot.editor.view.to_picture(*layout.canvas.middle) == pytest.approx(middle, abs=1e-6)


@pytest.mark.parametrize("switched", [False, True])
@pytest.mark.parametrize("alt", [False, True])
def test_alt_is_the_other_direction_than_the_switch_says(robot: Robot, switched: bool, alt: bool) -> None:
    robot.key("shift+t" if switched else "t")
    robot.mods = Mods(alt=alt)
    robot.drag((0.4, 0.5), (0.42, 0.5), steps=2)
    assert robot.editor.session.recipe.stroke[0].reverse is (switched != alt)


def test_a_tap_of_space_plays_and_one_that_panned_does_not(robot: Robot) -> None:
    robot.drag((0.4, 0.5), (0.45, 0.5), steps=2)
    robot.rest()
    session = robot.editor.session
    robot.frame(Move(*robot.at(0.5, 0.5)))
    robot.hold("space", True)
    pull(robot, 5, 5)
    robot.hold("space", False)
    assert not session.playing
    robot.key("space")
    assert session.playing


@pytest.mark.parametrize(
    ("key", "button", "drag"),
    [("p", LEFT, "paint"), ("m", LEFT, "select"), ("z", LEFT, "zoom"), ("h", LEFT, "pan"), ("p", MIDDLE, "pan"),
     ("p", RIGHT, "brush"), ("y", LEFT, "split")],
)  # fmt: skip
def test_a_drag_ends_with_the_button_that_it_began_with_and_with_no_other(
    robot: Robot, key: str, button: int, drag: str
) -> None:
    robot.key(key)
    x, y = robot.at(robot.editor.state.split or PLACE[0], PLACE[1])
    robot.move(x, y)
    for other in {LEFT, MIDDLE, RIGHT}:
        robot.release(other)  # of a press elsewhere
        assert robot.editor.pointer.drag is None
    robot.press(button)
    robot.move(x + 20, y + 20)
    for other in {LEFT, MIDDLE, RIGHT} - {button}:
        robot.press(other)
        robot.release(other)
        assert robot.editor.pointer.drag == drag
    robot.release(button)
    assert robot.editor.pointer.drag is None

"""The lanes: strokes, forces and handles as bars, used with pointer and keys."""

from __future__ import annotations

import random
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.model.bars import Which, moved
from app.model.forces import VortexForce
from app.model.handles import RecipeHandle, RecipePin
from app.model.recipe import Recipe
from app.model.strokes import Stroke
from app.ui.events import Key, Mods
from app.ui.lanes import MOST_BLOCKS, Lanes
from app.ui.layout import LEAST_LANES
from app.ui.panels.lanes import name_of
from app.ui.viewport import Rect
from app.work.session import Session
from solver.gl.device import Device
from support.drawn import Drawn
from support.editing import Robot, small_project
from support.widgets import Widgets


@pytest.fixture
def painted(robot: Robot) -> Robot:
    """Two strokes, and the lanes open."""
    robot.drag((0.3, 0.5), (0.4, 0.5), steps=6)
    robot.rest()
    robot.drag((0.6, 0.5), (0.6, 0.4), steps=6)
    robot.rest()
    robot.key("l")
    robot.frame(count=2)
    return robot


def lanes(robot: Robot) -> Lanes:
    return robot.editor.state.lanes


def recipe(robot: Robot) -> Recipe:
    return robot.editor.session.recipe


def names(robot: Robot) -> list[str]:
    return [entry.name for entry in robot.editor.session.document.history.entries]


def place(robot: Robot, number: int, kind: str = "stroke") -> Rect:
    return next(rect for bar, rect in lanes(robot).drawn if bar.which == (kind, number))


def drag(robot: Robot, number: int, by: float, part: float = 0.5, kind: str = "stroke", drop: bool = True) -> None:
    """Drag a bar by so many points, taken hold of at a part of its width."""
    rect = place(robot, number, kind)
    x, y = rect.x + part * rect.width, rect.y + rect.height / 2
    robot.move(x, y)
    robot.press()
    for step in range(1, 5):
        robot.move(x + by * step / 4, y)
    if drop:
        robot.release()
        robot.frame()


def points_a_tick(robot: Robot) -> float:
    start, stop = lanes(robot).span(robot.editor.session.end)
    rect = robot.editor.layout.lanes
    assert rect is not None
    return (rect.width - 40) / (stop - start)


def test_a_bar_is_moved_by_dragging_it_and_escape_gives_that_up(painted: Robot) -> None:
    before, end = recipe(painted), painted.editor.session.end
    ticks = [stroke.first_tick for stroke in before.stroke]
    by = 90.0
    drag(painted, 1, by)
    painted.rest()
    moved = recipe(painted).stroke[1].first_tick - ticks[1]
    assert moved == pytest.approx(by / points_a_tick(painted), rel=0.2)
    assert recipe(painted).stroke[0] == before.stroke[0]
    assert names(painted)[-1] == "Move stroke"
    assert painted.editor.session.end == end + moved
    painted.key("ctrl+z")
    assert recipe(painted) == before
    painted.frame(count=2)
    drag(painted, 1, by, drop=False)
    painted.key("escape")
    painted.release()
    painted.frame()
    assert recipe(painted) == before
    assert lanes(painted).drag is None
    drag(painted, 0, -1000.0)
    assert recipe(painted).stroke[0].first_tick == 0  # and not before the beginning


def test_the_playhead_follows_the_pointer_on_the_ruler_and_no_further_than_the_recording(painted: Robot) -> None:
    session, scale = painted.editor.session, points_a_tick(painted)
    first = place(painted, 1)
    begins = recipe(painted).stroke[1].first_tick
    rect = painted.editor.layout.lanes
    assert rect is not None
    y = place(painted, 0).y - 12  # above the bars
    painted.move(first.x, y)
    painted.press()
    painted.frame()
    assert session.target == begins
    for ticks in (3, -5, 0):
        painted.move(first.x + ticks * scale, y)
        painted.frame()
        assert session.target == begins + ticks
    painted.move(rect.x - 50, y)
    painted.frame()
    assert session.target == 0
    painted.move(rect.right + 50, y)
    painted.frame()
    assert session.target == session.length == session.end
    painted.release()
    painted.move(first.x, y)
    painted.frame()
    assert session.target == session.end


def test_the_ruler_says_what_it_is_for_until_it_is_pressed(painted: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    painted.move(place(painted, 1).x, place(painted, 0).y - 12)
    for pressed in (False, True):
        if pressed:
            painted.press()
        with monkeypatch.context() as noting:
            drawn = Drawn(noting)
            painted.frame()
        told = [line for line in drawn.take() if line.startswith("tooltip | The recording")]
        assert bool(told) != pressed


def test_there_is_room_for_more_lanes_where_their_edge_is_dragged(painted: Robot) -> None:
    before = painted.editor.layout.lanes
    assert before is not None
    for by, wanted in ((60.0, before.height + 60), (-1000.0, LEAST_LANES)):
        now = painted.editor.layout.lanes
        assert now is not None
        painted.move(700, now.y + 2)
        painted.press()
        painted.move(700, now.y - by)
        painted.release()
        painted.frame()
        assert painted.editor.layout.lanes == replace(now, y=now.bottom - wanted, height=wanted)
    painted.editor.remember()
    assert painted.editor.preferences.lanes_height == LEAST_LANES
    assert names(painted)[-1] == "Push", "no bar was taken hold of"


def test_a_bar_is_stretched_at_its_ends(painted: Robot) -> None:
    before = recipe(painted).stroke[1]
    drag(painted, 1, 60.0, part=0.99)
    longer = recipe(painted).stroke[1]
    assert longer.first_tick == before.first_tick
    assert longer.last_tick > before.last_tick
    assert len(longer.samples) == len(before.samples)
    assert names(painted)[-1] == "Stretch stroke"
    painted.rest()
    drag(painted, 1, -40.0, part=0.01)
    earlier = recipe(painted).stroke[1]
    assert earlier.last_tick == longer.last_tick
    assert earlier.first_tick < longer.first_tick
    painted.rest()
    lanes(painted).selected = {("stroke", 0), ("stroke", 1)}
    painted.frame()
    before = place(painted, 0), place(painted, 1)
    drag(painted, 1, 20.0, part=0.99, drop=False)
    assert place(painted, 0) == before[0], "what else is selected stays as it is"
    assert place(painted, 1).width > before[1].width + 10
    painted.key("escape")
    painted.release()
    painted.frame()
    drag(painted, 1, -4000.0, part=0.99)
    assert recipe(painted).stroke[1].last_tick == recipe(painted).stroke[1].first_tick


def test_where_some_of_the_selected_bars_are_muted_all_are_muted_first(painted: Robot) -> None:
    session, both = painted.editor.session, list[Which]([("stroke", 0), ("stroke", 1)])
    for number, which in enumerate(both):
        lanes(painted).selected = {which}
        lanes(painted).mute(session)
        assert [stroke.muted for stroke in recipe(painted).stroke] == [number == 0, number == 1]
        lanes(painted).selected = set(both)
        assert not lanes(painted).is_muted(session)
        lanes(painted).mute(session)
        assert all(stroke.muted for stroke in recipe(painted).stroke)
        lanes(painted).mute(session)
        assert not any(stroke.muted for stroke in recipe(painted).stroke)


def test_bars_that_are_selected_start_together_and_are_muted_and_deleted(painted: Robot) -> None:
    before = recipe(painted)
    first, second = (place(painted, number).middle for number in (0, 1))
    painted.click(*first)
    assert lanes(painted).selected == {("stroke", 0)}
    painted.mods = Mods(shift=True)
    painted.click(*second)
    painted.mods = Mods()
    assert lanes(painted).selected == {("stroke", 0), ("stroke", 1)}
    painted.editor.do("bars_together")
    assert {stroke.first_tick for stroke in recipe(painted).stroke} == {before.stroke[0].first_tick}
    painted.key("u")
    assert all(stroke.muted for stroke in recipe(painted).stroke)
    painted.rest()
    assert np.abs(painted.warp()).max() == 0
    painted.key("u")
    assert not any(stroke.muted for stroke in recipe(painted).stroke)
    painted.key("delete")
    assert recipe(painted).stroke == ()
    assert names(painted)[3:] == ["Start together", "Mute strokes", "Unmute strokes", "Delete strokes"]
    for _ in range(4):
        painted.key("ctrl+z")
    assert recipe(painted) == before


def test_arrows_move_what_is_selected_by_a_tick(painted: Robot) -> None:
    before = recipe(painted)
    painted.key("right")
    assert recipe(painted) == before  # nothing is selected
    painted.click(*place(painted, 1).middle)
    for key in ("right", "right", "right", "left"):
        painted.key(key)
    assert recipe(painted).stroke[1] == before.stroke[1].moved(2)
    assert names(painted)[3:] == ["Move stroke"]


def test_a_bar_that_is_added_with_shift_may_be_dragged_at_once(painted: Robot) -> None:
    before = [stroke.first_tick for stroke in recipe(painted).stroke]
    painted.mods = Mods(shift=True)
    drag(painted, 1, 60.0)
    assert recipe(painted).stroke[1].first_tick > before[1]
    assert lanes(painted).selected == {("stroke", 1)}
    painted.rest()
    after = recipe(painted).stroke
    drag(painted, 0, 40.0)
    ticks = recipe(painted).stroke[0].first_tick - after[0].first_tick
    assert ticks > 0
    assert recipe(painted).stroke == tuple(stroke.moved(ticks) for stroke in after)
    assert names(painted)[3:] == ["Move stroke", "Move strokes"]


def test_an_arrow_at_the_beginning_does_not_make_the_next_one_a_part_of_what_was_done_before(painted: Robot) -> None:
    before = recipe(painted)
    painted.click(*place(painted, 0).middle)
    for key in ("left", "right", "right"):
        painted.key(key)
    assert names(painted)[2:] == ["Push", "Move stroke"]
    painted.key("ctrl+z")
    assert recipe(painted) == before


def test_a_key_that_comes_with_the_undo_of_what_is_selected_does_nothing(painted: Robot) -> None:
    painted.click(*place(painted, 1).middle)
    painted.frame(Key("z", True, Mods(ctrl=True)), Key("right", True), Key("u", True), Key("delete", True))
    assert len(recipe(painted).stroke) == 1
    assert painted.editor.session.document.history.can_redo


@pytest.mark.parametrize("returns", [False, True])
def test_playing_ends_where_nothing_is_left(painted: Robot, returns: bool) -> None:
    session = painted.editor.session
    session.repeat(not returns, returns)
    session.play()
    painted.frame(count=3)
    lanes(painted).selected = {("stroke", 0), ("stroke", 1)}
    painted.key("delete")
    painted.frame(count=3)
    assert (session.end, session.is_moving) == (0, False)


def test_a_press_beside_the_bars_lets_go_of_them_and_delete_then_does_nothing_to_them(painted: Robot) -> None:
    before = recipe(painted)
    painted.click(*place(painted, 0).middle)
    rect = painted.editor.layout.lanes
    assert rect is not None
    painted.click(rect.x + rect.width / 2, rect.bottom - 8)
    assert lanes(painted).selected == set()
    painted.click(*place(painted, 0).middle)
    painted.drag((0.2, 0.2), (0.25, 0.2), steps=3)
    assert lanes(painted).selected == set()
    painted.key("delete")
    assert recipe(painted).stroke[:2] == before.stroke
    painted.click(*place(painted, 0).middle)
    painted.key("escape")
    assert lanes(painted).selected == set()


def test_a_box_selects_the_bars_that_it_touches(painted: Robot) -> None:
    first, second = place(painted, 0), place(painted, 1)
    right, below = second.right + 20, max(first.bottom, second.bottom) + 4

    def draw(x: float, *, shift: bool = False) -> None:
        """From beside the bars, back to a place among them."""
        painted.mods = Mods(shift=shift)
        painted.move(right, below)
        painted.press()
        painted.move(x, min(first.y, second.y) + 1)
        painted.mods = Mods()

    draw(second.x - 2)
    assert lanes(painted).selected == {("stroke", 1)}
    painted.move(first.right - 2, first.y + 1)
    assert lanes(painted).selected == {("stroke", 0), ("stroke", 1)}
    painted.move(second.x - 2, second.y + 1)  # smaller again
    assert lanes(painted).selected == {("stroke", 1)}
    painted.move(second.right + 10, second.y + 1)
    assert lanes(painted).selected == set()
    painted.move(second.x - 2, second.y + 1)
    painted.key("escape")
    assert lanes(painted).selected == set()
    painted.release()
    painted.click(*first.middle)
    draw(second.right - 2, shift=True)
    assert lanes(painted).selected == {("stroke", 0), ("stroke", 1)}
    painted.move(second.right + 10, second.y + 1)
    assert lanes(painted).selected == {("stroke", 0)}
    painted.move(second.right - 2, second.y + 1)
    painted.release()
    assert lanes(painted).selected == {("stroke", 0), ("stroke", 1)}
    assert len(names(painted)) == 3  # nothing of which was an edit


def test_a_box_is_drawn_between_where_it_was_begun_and_the_pointer(painted: Robot) -> None:
    first = place(painted, 0)
    (left, top), (right, bottom) = (first.x + 40, first.bottom + 45), (first.x + 90, first.bottom + 65)
    painted.move(left, top)
    painted.press()
    painted.see()
    before = painted.pixels().astype(int)
    painted.move(right, bottom)
    painted.frame(count=2)
    down, across = np.nonzero((painted.pixels() != before).any(axis=2))
    drawn = across.min(), down.min(), across.max(), down.max()
    assert drawn == pytest.approx((left, top, right, bottom), abs=2)


def test_the_fields_of_a_bar_set_when_how_long_how_strong_and_how_often(painted: Robot, widgets: Widgets) -> None:
    painted.key("h")  # which has no strength of its own
    before, dt = recipe(painted).stroke[1], painted.editor.session.dt
    painted.click(*place(painted, 1).middle)
    for label, text in (("Start", "1"), ("Duration", "0.5"), ("Strength", "50"), ("Times", "3"), ("Every", "1.5")):
        widgets.type(label, text)
        painted.rest()
        if label == "Times":  # the first spacing is one right after the other
            assert recipe(painted).stroke[1].every == round(0.5 / dt)
    stroke = recipe(painted).stroke[1]
    assert (stroke.first_tick, stroke.last_tick + 1) == (round(1 / dt), round(1.5 / dt))
    assert (stroke.strength, stroke.repeat, stroke.every) == (0.5, 3, round(1.5 / dt))
    assert [sample[1:] for sample in stroke.samples] == [sample[1:] for sample in before.samples]
    told = ["Move stroke", "Stretch stroke", "Strength of a stroke", "Repeat stroke", "Repeat stroke"]
    assert names(painted)[3:] == told
    assert painted.editor.session.end > stroke.end_tick


@pytest.mark.parametrize("field", ["Start", "Duration"])
def test_a_time_that_is_held_on_its_slider_stays_there(painted: Robot, widgets: Widgets, field: str) -> None:
    """The slider went to one and a half times what it had made of the recording, and so on in every frame."""
    painted.key("h")
    painted.click(*place(painted, 1).middle)
    painted.rest()
    widgets.look()
    rect = next(each.rect for each in widgets.drawn if each.words == field)
    painted.move(*rect.middle)
    painted.press()
    painted.move(rect.x + 0.9 * rect.width, rect.middle[1])
    painted.frame()
    held = recipe(painted)
    painted.frame(count=5)
    assert recipe(painted) == held != painted.editor.session.document.recipe
    painted.release()
    painted.frame()
    assert painted.editor.session.document.recipe == held


def test_forces_are_bars_too(robot: Robot, widgets: Widgets) -> None:
    vortex = VortexForce(kind="vortex", point=(0.5, 0.5), strength=2.0, during=(0.5, 1.0))
    robot.editor.session.edit("Forces", force=(vortex, vortex.edited(during=None, formula="sin(t)")), duration=2.0)
    robot.rest()
    robot.key("l")
    robot.frame(count=2)
    drag(robot, 0, 120.0, kind="force")
    moved = recipe(robot).force[0].during
    assert moved is not None
    assert moved[0] > 0.6
    assert moved[1] - moved[0] == pytest.approx(0.5)
    drag(robot, 1, 120.0, kind="force")  # a formula of the time stays where it is
    assert names(robot)[1:] == ["Forces", "Move force"]
    robot.click(*place(robot, 0, "force").middle)
    robot.key("h")
    widgets.type("Strength", "-1.5")
    widgets.type("Start", "0.25")
    widgets.type("Duration", "1")
    force = recipe(robot).force[0]
    assert force.strength == -1.5
    assert force.during == pytest.approx((0.25, 1.25))
    robot.key("u")
    assert recipe(robot).force[0].muted
    robot.key("delete")
    assert len(recipe(robot).force) == 1
    for _ in range(6):
        robot.key("ctrl+z")
    assert recipe(robot).force[0] == vortex


def test_a_force_that_no_map_can_follow_is_told_of_and_undone(robot: Robot) -> None:
    """In the middle of the recording, so that something has been made of it by then."""
    vortex = VortexForce(kind="vortex", point=(0.5, 0.5), strength=1.0, at=(0.2,))
    session = robot.editor.session
    session.edit("Forces", force=(vortex,), duration=0.5)
    robot.drag((0.3, 0.5), (0.4, 0.5))
    robot.rest()
    before = robot.warp()
    session.edit_bars("Strength of a force", {("force", 0)}, lambda one: one.model_copy(update={"strength": 1e6}))
    robot.frame(count=3)
    assert "throws the fluid" in robot.editor.messages.shown[-1].text
    assert not session.is_moving
    robot.key("ctrl+z")
    robot.rest()
    assert np.array_equal(robot.warp(), before)


def test_handles_and_pins_are_bars_too(robot: Robot) -> None:
    handle = RecipeHandle(at=(0.4, 0.5), to=(0.42, 0.5), start=0.1, duration=0.3)
    robot.editor.session.edit("Handles", handle=(handle,), pin=(RecipePin(at=(0.7, 0.5)),), duration=1.0)
    robot.rest()
    robot.key("l")
    robot.frame(count=2)
    begun = recipe(robot)
    drag(robot, 0, 90.0, kind="handle")
    later = recipe(robot).handle[0]
    assert later == moved(handle, round((later.start - 0.1) / robot.editor.session.dt), robot.editor.session.dt)
    assert later.start > 0.15
    assert robot.editor.state.selected == "handle[1]"
    assert name_of(later.edited(name="Nose"), ("handle", 0)) == 'Handle 1 "Nose"'
    drag(robot, 0, 60.0, part=0.99, kind="handle")
    assert recipe(robot).handle[0].start == later.start
    assert recipe(robot).handle[0].duration > 0.35
    drag(robot, 0, -600.0, part=0.998, kind="pin")
    (pin,) = recipe(robot).pin
    assert pin.start == 0
    assert pin.end is not None
    assert 0.2 < pin.end < 1
    robot.key("u")
    assert recipe(robot).pin[0].muted
    robot.key("delete")
    assert recipe(robot).pin == ()
    assert names(robot)[2:] == ["Move handle", "Stretch handle", "Stretch pin", "Mute pin", "Delete pin"]
    for _ in range(5):
        robot.key("ctrl+z")
    assert recipe(robot) == begun


@pytest.mark.parametrize(
    ("points", "words", "is_inside"),
    [(200, "Handle 1", True), (60, "1", True), (24, "1", True), (10, "1", False)],
    ids=["wide", "narrow", "small", "least"],
)
def test_a_handle_is_known_by_its_number_where_its_bar_has_no_room_for_its_name(
    robot: Robot, monkeypatch: pytest.MonkeyPatch, points: float, words: str, is_inside: bool
) -> None:
    handle, session = RecipeHandle(at=(0.4, 0.5), to=(0.42, 0.5), duration=1.0), robot.editor.session
    session.edit("Handle", handle=(handle,), duration=10.0)
    robot.rest()
    robot.key("l")
    robot.frame(count=2)
    length = points / place(robot, 0, "handle").width
    session.edit("Handle", handle=(handle.edited(duration=length),))
    robot.rest()
    with monkeypatch.context() as noting:
        drawn = Drawn(noting)
        robot.frame()
    rect, lines = place(robot, 0, "handle"), drawn.take()
    assert rect.width == pytest.approx(points, abs=3)
    texts = [(line.split()[1:3], line.partition(" | ")[2]) for line in lines if line.startswith("add_text ")]
    lane = [(float(x), said) for (x, y), said in texts if rect.y < float(y) < rect.bottom]
    ((x, said),) = [each for each in lane if rect.x < each[0] < rect.right + 10]
    assert (said, x < rect.right) == (words, is_inside)  # or on what it holds after it


def test_keyframes_are_marks_on_the_bar_of_a_handle(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    handle = RecipeHandle(at=(0.4, 0.5), keys=(), turned=((1.0, 20.0, 1.0), (1.5, 0.0, 1.2), (4.0, 0.0, 1.0)))
    session = robot.editor.session
    session.edit("Handle", handle=(handle,), duration=8.0)
    robot.rest()
    robot.key("l")
    robot.frame(count=2)
    with monkeypatch.context() as noting:
        drawn = Drawn(noting)
        robot.frame()
    rect, lines = place(robot, 0, "handle"), [line.split() for line in drawn.take()]
    circles = [line for line in lines if line[0] == "add_circle_filled" and rect.y < float(line[2]) < rect.bottom]
    marks = [float(line[1]) for line in circles if rect.x + 20 < float(line[1]) < rect.right]  # beside its icon
    a_second = rect.width / 4  # from its start to its last keyframe
    assert marks == pytest.approx([rect.x + a_second, rect.x + 1.5 * a_second, rect.right - 5], abs=1.5)
    track = robot.editor.layout.timebar
    thin = [line for line in lines if line[0] == "add_rect_filled" and float(line[2]) > track.y]
    gaps = [float(line[1]) for line in thin if abs(float(line[3]) - float(line[1]) - 2) < 0.5][-3:]
    begins = min(float(line[1]) for line in thin if float(line[3]) - float(line[1]) > 40)
    assert [gaps[1] - gaps[0], gaps[2] - gaps[0]] == pytest.approx(
        [(gaps[0] - begins) * 0.5, (gaps[0] - begins) * 3], abs=5
    )


def test_the_bar_of_a_handle_that_is_selected_on_the_picture_is_outlined(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    handles = tuple(RecipeHandle(at=(x, 0.5), to=(x + 0.1, 0.5)) for x in (0.3, 0.6))
    robot.editor.session.edit("Handles", handle=handles, duration=8.0)
    robot.rest()
    robot.key("l")
    outlined = dict[str, list[int]]()
    for label in ("", "handle[2]", "handle[1]"):
        robot.editor.state.selected = label
        robot.frame(count=2)
        with monkeypatch.context() as noting:
            drawn = Drawn(noting)
            robot.frame()
        frames = [line.split()[1:5] for line in drawn.take() if line.startswith("add_rect ")]
        places = [place(robot, number, "handle") for number in (0, 1)]
        at = [[rect.x, rect.y, rect.right, rect.bottom] for rect in places]
        outlined[label] = [
            number for number in (0, 1) for frame in frames if [*map(float, frame)] == pytest.approx(at[number], abs=1)
        ]
    assert outlined == {"": [], "handle[2]": [1], "handle[1]": [0]}


def many(count: int) -> tuple[Stroke, ...]:
    dice = random.Random(1)
    made = []
    for number in range(count):
        x, y = dice.random(), dice.random()
        samples = ((5 * number, x, y, 1.0), (5 * number + dice.randrange(40), x, y, 1.0))
        made.append(Stroke(tool="freeze" if number % 2 else "restore", radius=0.01, samples=samples))
    return tuple(made)


def test_of_two_thousand_strokes_only_what_is_seen_is_drawn(robot: Robot) -> None:
    robot.editor.session.edit("Strokes", stroke=many(2000), duration=170.0)
    robot.editor.session.seek(0)
    robot.key("l")
    robot.frame(count=2)
    rect = robot.editor.layout.lanes
    assert rect is not None
    assert 0 < len(lanes(robot).drawn) < rect.width / 9 * (rect.height / 23)
    assert all(rect.y - 23 < place.y < rect.bottom for _, place in lanes(robot).drawn)
    packed = lanes(robot).packed(recipe(robot), robot.editor.session.end, 1.0)
    assert packed is lanes(robot).packed(recipe(robot), robot.editor.session.end, 1.0)
    blocks = lanes(robot).blocks(recipe(robot), robot.editor.session.end / 800)
    assert len(blocks) <= 2 * 3 * 800
    robot.editor.session.edit("None", stroke=())
    robot.frame()
    assert lanes(robot).drawn == []


def test_in_another_work_nothing_is_selected_though_it_has_the_same_bars(painted: Robot) -> None:
    session, window = painted.editor.session, Lanes()
    window.look(session)
    window.selected, window.view = {("stroke", 0)}, (0.0, 10.0)
    window.look(session)
    assert window.selected == {("stroke", 0)}
    other = Session(session.device, replace(session.project, recipe=session.recipe))
    window.look(other)
    other.release_gpu()
    assert (window.selected, window.view) == (set(), None)


def test_while_a_stroke_is_painted_the_others_stay_in_their_lanes() -> None:
    done, window = many(50), Lanes()
    frames: list[Recipe] = []
    for last in range(260, 263):
        stroke = Stroke(tool="push", samples=((255, 0.5, 0.5, 1.0), (last, 0.6, 0.5, 1.0)))
        frames.append(Recipe(stroke=(*done, stroke), duration=last / 60))
    packed = [window.packed(recipe, recipe.ticks, 4.1 + recipe.ticks / 1000) for recipe in frames]
    assert packed[-1] == Lanes().packed(frames[-1], 0, 8.0)
    assert sum(one is other for one, other in zip(*packed[1:], strict=True)) == len(packed[-1]) - 1
    blocks = [window.blocks(recipe, recipe.ticks / 100) for recipe in frames]
    assert set(blocks[-1]) == set(Lanes().blocks(frames[-1], 2.0))
    assert all(one is other for one, other in zip(blocks[1][:-1], blocks[2][:-1], strict=True))


def test_each_time_of_a_repeated_stroke_is_as_long_on_the_track_as_the_first() -> None:
    stroke = Stroke(tool="push", samples=((30, 0.5, 0.5, 1.0), (49, 0.6, 0.5, 1.0)), repeat=3, every=40)
    found = [(block.start, block.end) for block in Lanes().blocks(Recipe(stroke=(stroke,), duration=4.0), 0.5)]
    assert found == [(30, 50), (70, 90), (110, 130)]


@pytest.mark.parametrize(("repeat", "blocks"), [(MOST_BLOCKS, MOST_BLOCKS), (MOST_BLOCKS + 1, 1)])
def test_what_repeats_too_often_to_be_told_apart_is_one_block_from_its_first_time_to_its_last(
    repeat: int, blocks: int
) -> None:
    stroke = Stroke(tool="push", samples=((30, 0.5, 0.5, 1.0), (49, 0.6, 0.5, 1.0)), repeat=repeat, every=40)
    found = Lanes().blocks(Recipe(stroke=(stroke,), duration=200.0), 0.5)
    assert len(found) == blocks
    assert (found[0].start, found[-1].end) == (30, 50 + 40 * (repeat - 1))


@pytest.mark.parametrize("seed", range(2))
def test_what_is_kept_of_lanes_and_blocks_is_what_would_be_made_anew(seed: int) -> None:
    """Whatever changes from one frame to the next: strokes, other bars, the length, the zoom, or several of these."""
    dice, strokes, window = random.Random(seed), many(30), Lanes()
    recipe, ticks, least = Recipe(), 300, 8.0
    for _ in range(40):
        if dice.random() < 0.5:
            recipe = recipe.edited(stroke=strokes[: dice.randint(0, 30)])
        if dice.random() < 0.3:
            whirl = VortexForce(kind="vortex", point=(0.5, 0.5), during=(0.0, dice.uniform(0.1, 4)))
            recipe = recipe.edited(force=(whirl,) * dice.randint(0, 2))
        if dice.random() < 0.3:
            ticks = dice.choice((100, 300, 1000))
        if dice.random() < 0.5:
            least = dice.uniform(0.3, 40)
        assert window.packed(recipe, ticks, least) == Lanes().packed(recipe, ticks, least)
        assert window.blocks(recipe, least) == Lanes().blocks(recipe, least)


def test_the_wheel_with_ctrl_shows_less_of_time_and_all_of_it_again(painted: Robot) -> None:
    x, y = place(painted, 1).middle
    wide = place(painted, 1).width
    painted.move(x, y)
    painted.mods = Mods(ctrl=True)
    painted.hold("ctrl", True)
    for _ in range(3):
        painted.wheel(1)
    painted.frame(count=2)
    assert place(painted, 1).width > 1.5 * wide
    assert place(painted, 1).x < x < place(painted, 1).right
    for _ in range(12):
        painted.wheel(-1)
    painted.frame(count=2)
    assert lanes(painted).view is None


def test_the_wheel_with_shift_goes_back_in_time_and_forth_again_as_far_as_there_is_some(painted: Robot) -> None:
    painted.move(*place(painted, 1).middle)
    state, length = lanes(painted), painted.editor.session.length
    state.view = (0.4 * length, 0.6 * length)
    painted.mods = Mods(shift=True)
    painted.hold("shift", True)

    def turned(notches: int) -> float:
        """Where what is shown begins, as a part of all."""
        for _ in range(abs(notches)):
            painted.wheel(notches // abs(notches))
        painted.frame(count=2)
        start, stop = state.span(length)
        assert stop - start == pytest.approx(0.2 * length)
        return start / length

    assert turned(1) == pytest.approx(0.38)
    assert turned(-2) == pytest.approx(0.42)
    last = turned(-40)
    assert last >= 0.8
    assert turned(-1) == last
    assert turned(50) == 0


@pytest.mark.parametrize("size", [(1280, 800), (800, 520), (400, 260)])
@pytest.mark.parametrize("inspector", [True, False])
def test_the_lanes_lie_between_the_picture_and_the_timeline(
    device: Device, tmp_path: Path, size: tuple[int, int], inspector: bool
) -> None:
    robot = Robot(device, small_project(tmp_path), size)
    robot.editor.state.inspector = inspector
    robot.key("l")
    robot.frame(count=2)
    layout = robot.editor.layout
    assert layout.lanes is not None
    assert layout.canvas.bottom == layout.lanes.y
    assert layout.canvas.width >= 120
    assert layout.lanes.bottom == pytest.approx(layout.timebar.y)
    assert layout.canvas.height >= 0.499 * (layout.timebar.y - layout.canvas.y)
    robot.key("l")
    robot.frame()
    assert robot.editor.layout.lanes is None
    robot.close()


def test_whatever_is_done_to_bars_with_pointer_and_keys_is_undone(painted: Robot) -> None:
    dice, session = random.Random(4), painted.editor.session
    begun = recipe(painted)
    for _ in range(40):
        drawn = lanes(painted).drawn
        what = dice.choice(["drag", "drag", "stretch", "click", "shift", "key", "key", "undo", "escape"])
        if what in ("drag", "stretch", "click", "shift") and drawn:
            bar, rect = dice.choice(drawn)
            which: Which = bar.which
            painted.mods = Mods(shift=what == "shift")
            if what in ("drag", "stretch"):
                by = dice.uniform(-150, 150)
                drag(painted, which[1], by, 0.5 if what == "drag" else dice.choice([0.02, 0.98]), which[0])
            else:
                painted.click(*rect.middle)
            painted.mods = Mods()
        elif what == "key":
            painted.key(dice.choice(["left", "right", "u", "delete"]))
        elif what == "undo":
            painted.key("ctrl+z")
        elif what == "escape":
            painted.key("escape")
        painted.frame()
        if not recipe(painted).stroke:
            painted.key("ctrl+z")
            painted.frame()
        state = recipe(painted)
        assert session.document.recipe == state
        assert Recipe.parse(state.text()) == state
    while session.document.history.index > 2:
        painted.key("ctrl+z")
    assert recipe(painted) == begun

"""From the samples of a pointer to strokes."""

from __future__ import annotations

from itertools import pairwise
from math import cosh, hypot, tanh
from typing import Any

import pytest

from app.model.handles import RecipeHandle
from app.model.mask_edits import MaskStroke
from app.model.strokes import Stroke
from app.model.tools import TOOL, BrushSettings, Made, Press, PulledString, Touch

EXTENT = (1.0, 0.75)
DT = 1 / 30


def play(
    name: str,
    *touches: Touch,
    opposite: bool = False,
    last: tuple[float, float] | None = None,
    radius: float = 0.1,
) -> Stroke | None:
    """What a tool makes of touches and a release."""
    tool = TOOL[name]
    assert tool.gesture is not None
    gesture = tool.gesture(
        Press(BrushSettings(radius, 0.2, 0.8, hold=0.6, local=0.3), opposite, EXTENT, DT, last), touches[0]
    )
    next(gesture)
    for touch in touches[1:]:
        gesture.send(touch)
    try:
        gesture.send(None)
    except StopIteration as finished:
        return finished.value
    raise AssertionError("a gesture ends when the pointer is let go")


def test_every_sample_is_kept() -> None:
    touches = [Touch(3, 0.5, 0.5), Touch(3, 0.501, 0.5), Touch(4, 0.503, 0.51, 0.5)]
    stroke = play("push", *touches)
    assert stroke is not None
    assert stroke.samples == tuple(touch[:4] for touch in touches)
    assert (stroke.tool, stroke.radius, stroke.hardness, stroke.strength) == ("push", 0.1, 0.2, 0.8)
    assert (stroke.hold, stroke.local) == (0.6, 0.3)


@pytest.mark.parametrize(
    ("tool", "forward", "backward"),
    [("bloat", "bloat", "pinch"), ("thicken", "thicken", "thin"), ("freeze", "freeze", "thaw")],
)
def test_the_opposite_of_a_tool(tool: str, forward: str, backward: str) -> None:
    for opposite, wanted in ((False, forward), (True, backward)):
        stroke = play(tool, Touch(0, 0.5, 0.5), opposite=opposite)
        assert stroke is not None
        assert (stroke.tool, stroke.reverse, stroke.hold, stroke.local) == (wanted, False, 0, 0)
    assert TOOL[tool].directions == (forward.capitalize(), backward.capitalize())


@pytest.mark.parametrize(
    ("tool", "directions"),
    [("push", ("Along", "Against")), ("twirl", ("Clockwise", "Anticlockwise")), ("curve", ("Forwards", "Backwards"))],
)
def test_what_the_directions_are_called(tool: str, directions: tuple[str, str]) -> None:
    """What is reversed is the second; a stroke that is not turns clockwise: see `test_rates`."""
    assert TOOL[tool].directions == directions


def test_push_and_twirl_are_reversed() -> None:
    for tool in ("push", "twirl"):
        stroke = play(tool, Touch(0, 0.5, 0.5), opposite=True)
        assert stroke is not None
        assert stroke.reverse


def test_a_pointer_that_is_too_fast_is_followed_at_the_fastest_speed() -> None:
    stroke = play("push", Touch(0, 0.1, 0.5), Touch(1, 0.9, 0.5))
    assert stroke is not None
    assert stroke.samples[-1][1:3] == (0.9, 0.5)
    for before, after in zip(stroke.samples, stroke.samples[1:], strict=False):
        assert after[1] - before[1] <= 2.0 * DT + 1e-4
    assert stroke.last_tick == pytest.approx(0.8 / (2.0 * DT), abs=1.5)


@pytest.mark.parametrize("last", [None, (0.1, 0.5)])
def test_a_push_follows_no_faster_than_its_radius_a_tick(last: tuple[float, float] | None) -> None:
    """No more is carried in one step, and what a quicker brush passes would stay behind: also along a straight line."""
    way = (Touch(0, 0.1, 0.5), Touch(1, 0.311, 0.5)) if last is None else (Touch(0, 0.311, 0.5, 1.0, True),)
    for name, farthest in (("push", 0.02), ("twirl", 2.0 * DT)):
        stroke = play(name, *way, last=last, radius=0.02)
        assert stroke is not None
        steps = [after[1] - before[1] for before, after in pairwise(stroke.samples)]
        assert stroke.samples[-1][1:3] == (0.311, 0.5)
        assert max(steps) <= farthest + 1e-4
        if last is None or name == "push":
            assert stroke.last_tick - stroke.first_tick == pytest.approx(0.211 / farthest, abs=1)


def test_a_stroke_in_ticks_of_a_microsecond_goes_on() -> None:
    """It goes less than the last digit of a place in each, and was never done with its way once it was let go."""
    gesture = TOOL["push"].gesture
    assert gesture is not None
    drawing = gesture(Press(BrushSettings(), False, EXTENT, 1e-6), Touch(0, 0.5, 0.5))
    next(drawing)
    for tick in range(1, 9):
        stroke = drawing.send(Touch(tick, 0.6, 0.55))
    assert isinstance(stroke, Stroke)
    places = [sample[1:3] for sample in stroke.samples]
    assert len(set(places)) == len(places) == 9


def test_a_fast_pointer_is_followed_along_its_path() -> None:
    corner = [Touch(0, 0.2, 0.2), Touch(1, 0.8, 0.2), Touch(1, 0.8, 0.8)]
    stroke = play("push", *corner)
    assert stroke is not None
    assert (0.8, 0.2) in {sample[1:3] for sample in stroke.samples}
    assert stroke.travelled(stroke.last_tick + 1, EXTENT) == pytest.approx(0.6 + 0.6 * 0.75, abs=1e-3)


def test_shift_keeps_to_the_axis_it_set_out_on() -> None:
    touches = [Touch(0, 0.5, 0.5), *(Touch(k, 0.5 + 0.01 * k, 0.5 + 0.03 * k, 1.0, True) for k in range(1, 5))]
    stroke = play("push", *touches)
    assert stroke is not None
    assert {sample[1] for sample in stroke.samples} == {0.5}


def test_a_straight_line_from_where_the_last_stroke_ended() -> None:
    stroke = play("push", Touch(5, 0.6, 0.5, 1.0, True), last=(0.2, 0.5))
    assert stroke is not None
    assert stroke.samples[0] == (5, 0.2, 0.5, 1.0)
    assert stroke.samples[-1][1:3] == pytest.approx((0.6, 0.5))
    seconds = (stroke.last_tick - stroke.first_tick) * DT
    assert 0.4 / seconds == pytest.approx(0.8, rel=0.1)


def test_a_curve_is_one_stroke_in_one_tick() -> None:
    touches = [Touch(k, 0.2 + 0.05 * k, 0.5) for k in range(8)]
    stroke = play("curve", *touches)
    assert stroke is not None
    assert {sample[0] for sample in stroke.samples} == {7}
    backward = play("curve", *touches, opposite=True)
    assert backward is not None
    assert backward.samples == stroke.samples[::-1]
    assert play("curve", Touch(0, 0.5, 0.5)) is None


def test_a_curve_takes_up_points_by_their_distance_on_the_picture() -> None:
    """More than 0.004 of the longer side: 0.005 of the width is, of the height of this picture it is 0.00375."""
    across = play("curve", *(Touch(k, 0.2 + 0.005 * k, 0.5) for k in range(8)))
    down = play("curve", *(Touch(k, 0.5, 0.2 + 0.005 * k) for k in range(8)))
    assert across is not None
    assert down is not None
    assert [round((x - 0.2) / 0.005) for _, x, _, _ in across.samples] == [*range(8)]
    assert [round((y - 0.2) / 0.005) for _, _, y, _ in down.samples] == [0, 2, 4, 6]


def test_a_straight_line_is_as_long_as_on_the_picture() -> None:
    """Of a height of 0.75: 0.4 of it is 0.3 longer sides, which take 0.375 s."""
    stroke = play("push", Touch(5, 0.5, 0.6, 0.5, True), last=(0.5, 0.2))
    assert stroke is not None
    assert stroke.last_tick - 5 == round(0.3 / 0.8 / DT)
    assert stroke.samples[0] == (5, 0.5, 0.2, 0.5)
    steps = [after[2] - before[2] for before, after in pairwise(stroke.samples)]
    assert steps == pytest.approx([0.4 / len(steps)] * len(steps))
    near = play("push", Touch(5, 0.5, 0.2, 1.0, True), last=(0.5, 0.2))
    assert near is not None
    assert near.last_tick == 7


def test_shift_waits_for_a_hundredth_and_takes_the_longer_way_on_the_picture() -> None:
    """0.012 of the height is 0.009 longer sides; 0.03 of the width is more than 0.035 of the height."""
    for way, wanted in (((0.0, 0.012), (0.5, 0.5)), ((0.0, 0.014), (0.5, 0.514)), ((0.03, 0.035), (0.53, 0.5))):
        stroke = play("push", Touch(0, 0.5, 0.5), Touch(1, 0.5 + way[0], 0.5 + way[1], 1.0, True))
        assert stroke is not None
        assert stroke.samples[-1][1:3] == pytest.approx(wanted)


def gestured(name: str, press: Press, *touches: Touch) -> Made | None:
    gesture = TOOL[name].gesture
    assert gesture is not None
    made = gesture(press, touches[0])
    next(made)
    for touch in touches[1:]:
        made.send(touch)
    with pytest.raises(StopIteration) as finished:
        made.send(None)
    return finished.value.value


def test_a_point_that_is_only_clicked_is_pinned_and_one_that_is_dragged_is_led() -> None:
    press = Press(BrushSettings(0.2, local=0.3, stiffness=0.4), False, EXTENT, DT, slack=0.01, at=(0.1, 0.2))
    pinned = gestured("handle", press, Touch(6, 0.5, 0.5), Touch(7, 0.5, 0.513))
    assert isinstance(pinned, RecipeHandle)
    assert (pinned.at, pinned.radius, pinned.local, pinned.stiffness) == ((0.1, 0.2), 0.2, 0.3, 0.4)
    assert (pinned.start, pinned.keys) == (pytest.approx(0.2), ())
    led = gestured("handle", press, Touch(6, 0.5, 0.5), Touch(7, 0.5, 0.514))
    assert isinstance(led, RecipeHandle)
    assert led.keys == ((pytest.approx(7 * DT), 0.5, 0.5), (pytest.approx(8 * DT), 0.5, 0.514))


def test_a_line_there_and_back_is_open_and_one_of_a_single_place_of_the_original_is_none() -> None:
    there_and_back = Touch(0, 0.3, 0.5, shift=True), Touch(1, 0.6, 0.5, shift=True), Touch(2, 0.3, 0.5, shift=True)
    line = gestured("handle", Press(BrushSettings(), False, EXTENT, DT), *there_and_back)
    assert isinstance(line, RecipeHandle)
    assert (line.points, line.closed) == (((0.3, 0.5), (0.6, 0.5), (0.3, 0.5)), False)
    press = Press(BrushSettings(), False, EXTENT, DT, under=lambda seen: [(0.5, 0.5)] * len(seen))
    assert gestured("handle", press, *there_and_back) is None


@pytest.mark.parametrize("count", [200, 201, 202, 1000])
def test_a_line_of_many_touches_has_fewer_corners_and_both_its_ends(count: int) -> None:
    touches = [Touch(n, 0.2 + 0.6 * (n % 2), 0.1 + 0.8 * n / (count - 1), shift=True) for n in range(count)]
    line = gestured("handle", Press(BrushSettings(), False, EXTENT, DT), *touches)
    assert isinstance(line, RecipeHandle)
    assert (line.points[0], line.points[-1]) == (touches[0][1:3], touches[-1][1:3])
    assert 100 <= len(line.points) <= 200


def test_a_handle_that_is_taken_again_goes_as_far_as_the_pointer_but_not_out_of_the_picture() -> None:
    held = RecipeHandle(at=(0.1, 0.1), keys=())
    press = Press(BrushSettings(), False, EXTENT, DT, held=held, rests=(0.3, 0.9))
    led = gestured("handle", press, Touch(0, 0.5, 0.5), Touch(1, 0.6, 0.45), Touch(2, 0.9, 0.9), Touch(3, -1.0, 0.5))
    assert isinstance(led, RecipeHandle)
    places = [place for key in led.keys or () for place in key[1:]]
    assert places == pytest.approx([0.3, 0.9, 0.4, 0.85, 0.7, 1.0, 0.0, 0.9])


def test_what_is_painted_on_masks_at_rest_takes_no_time_and_keeps_its_symmetry() -> None:
    press = Press(BrushSettings(0.2), False, EXTENT, DT, timeless=True, symmetry="radial", sectors=5, detail=900)
    painted = gestured("freeze", press, Touch(4, 0.5, 0.5), Touch(5, 0.52, 0.5))
    assert isinstance(painted, MaskStroke)
    assert (painted.tool, painted.symmetry, painted.sectors, painted.detail) == ("freeze", "radial", 5, 0)


@pytest.mark.parametrize(
    ("tool", "symmetry", "detail", "sectors"),
    [("push", "none", 900, 6), ("push", "both", 0, 6), ("thicken", "none", 0, 6)],
)
def test_only_what_flows_in_one_place_is_solved_finely(tool: str, symmetry: Any, detail: int, sectors: int) -> None:
    press = Press(BrushSettings(0.2), False, EXTENT, DT, detail=900, symmetry=symmetry, sectors=5)
    stroke = gestured(tool, press, Touch(4, 0.5, 0.5))
    assert isinstance(stroke, Stroke)
    assert (stroke.detail, stroke.symmetry, stroke.sectors) == (detail, symmetry, sectors)


def test_a_pulled_string_draws_a_tractrix() -> None:
    """The exact curve: a pen that leaves along x pulls the brush, one length above, at x(t) = t - a tanh(t / a)."""
    length, steps = 0.2, 20_000
    string = PulledString(length, (1.0, 1.0), (0.0, length))
    string.pull(0.0, 0.0)
    for step in range(1, steps + 1):
        x, y = string.pull(0.5 * step / steps, 0.0)
    assert y == pytest.approx(length / cosh(0.5 / length), abs=5e-4)
    assert x == pytest.approx(0.5 - length * tanh(0.5 / length), abs=5e-4)


def test_what_the_pen_shakes_within_the_string_moves_nothing() -> None:
    string = PulledString(0.1, EXTENT, (0.5, 0.5))
    for x, y in ((0.55, 0.5), (0.5, 0.62), (0.43, 0.45)):
        assert hypot((x - 0.5) * EXTENT[0], (y - 0.5) * EXTENT[1]) < 0.1
        assert string.pull(x, y) == (0.5, 0.5)
    assert string.pull(0.7, 0.5) == (0.6, 0.5)


def test_a_string_of_no_length_is_none() -> None:
    string = PulledString(0.0, EXTENT, (0.1, 0.1))
    assert string.pull(0.12346, 0.3) == (0.12346, 0.3)
    assert list(string.catch_up(0.01)) == []


def test_the_brush_catches_up_with_the_pen_in_even_steps() -> None:
    string = PulledString(0.1, EXTENT, (0.2, 0.4))
    string.pull(0.25, 0.4)
    assert list(string.catch_up(0.02)) == [pytest.approx((x, 0.4), abs=1e-5) for x in (0.21667, 0.23333, 0.25)]

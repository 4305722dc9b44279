"""From the samples of a pointer to strokes."""

from __future__ import annotations

from math import cosh, hypot, tanh

import pytest

from app.model.strokes import Stroke
from app.model.tools import TOOL, BrushSettings, Press, PulledString, Touch

EXTENT = (1.0, 0.75)
DT = 1 / 30


def play(name: str, *touches: Touch, opposite: bool = False, last: tuple[float, float] | None = None) -> Stroke | None:
    """What a tool makes of touches and a release."""
    tool = TOOL[name]
    assert tool.gesture is not None
    gesture = tool.gesture(Press(BrushSettings(0.1, 0.2, 0.8, local=0.3), opposite, EXTENT, DT, last), touches[0])
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
    assert stroke.local == 0.3


@pytest.mark.parametrize(
    ("tool", "forward", "backward"),
    [("bloat", "bloat", "pinch"), ("thicken", "thicken", "thin"), ("freeze", "freeze", "thaw")],
)
def test_the_opposite_of_a_tool(tool: str, forward: str, backward: str) -> None:
    for opposite, wanted in ((False, forward), (True, backward)):
        stroke = play(tool, Touch(0, 0.5, 0.5), opposite=opposite)
        assert stroke is not None
        assert (stroke.tool, stroke.reverse, stroke.local) == (wanted, False, 0)
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

"""Handles as a recipe has them: when they are in force, where their keys lead, what cannot be met."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest

from app.errors import UserError
from app.model.handles import LONGEST_LINE, RecipeHandle, RecipePin, heading, labelled, objections
from app.model.recipe import Recipe
from app.model.schema import frozen
from solver.brush.handle import Handle


def handle(**keys: Any) -> RecipeHandle:
    return RecipeHandle.model_validate(frozen({"at": [0.5, 0.5], "to": [0.6, 0.5], "radius": 0.1} | keys))


def test_a_handle_is_in_force_from_the_tick_whose_middle_comes_after_its_start() -> None:
    for start, end, wanted in ((0.0, None, range(8)), (0.25, 0.55, range(2, 5)), (0.24, 0.56, range(2, 6))):
        led = handle(start=start, end=end)
        assert [tick for tick in range(8) if led.is_in_force(tick, 0.1)] == [*wanted]
        assert led.first_tick(0.1) == wanted[0]


@pytest.mark.parametrize(
    ("keys", "holds"),
    [
        ({}, True),
        ({"muted": True}, False),
        ({"at": [1.2, 0.5]}, False),
        ({"at": [0.5, -0.1]}, False),
        ({"at": [0.0, 1.0]}, True),
        ({"points": [[-0.5, 0.5], [0.5, 0.5], [1.5, 0.5]]}, True),
        ({"points": [[-0.5, 0.5], [1.5, 0.5]]}, False),
        ({"points": [[1.0, 0.5], [1.5, 0.5]]}, True),
        ({"points": [[0.2, 0.5], [0.4, 0.5]], "muted": True}, False),
    ],
)
def test_a_handle_takes_hold_if_any_of_its_places_is_in_the_picture(keys: dict[str, Any], holds: bool) -> None:
    assert handle(**keys).takes_hold is holds
    pin = {name: value for name, value in keys.items() if name != "to"}
    assert RecipePin.model_validate(frozen({"at": [0.5, 0.5]} | pin)).takes_hold is holds


def test_what_a_handle_is_edited_to_is_checked() -> None:
    assert handle().edited(radius=0.2).radius == 0.2
    with pytest.raises(ValueError, match="radius"):
        handle().edited(radius=-1.0)


def test_where_a_handle_goes_and_when_it_is_there() -> None:
    led = handle(start=1.0, duration=0.5)
    assert (led.ready, led.last, led.goal) == (1.5, 1.5, (0.6, 0.5))
    led = handle(start=1.0, duration=0.5, keys=[[2.0, 0.1, 0.2], [3.0, 0.3, 0.4]])
    assert (led.ready, led.last, led.goal) == (1.5, 3.0, (0.3, 0.4))
    led = handle(to=None, start=1.0, keys=[])
    assert (led.ready, led.last, led.goal) == (1.0, 1.0, None)


def test_a_line_is_led_from_the_mean_of_its_corners_to_that_of_its_goals() -> None:
    line = {"points": [[0.1, 0.2], [0.2, 0.2], [0.6, 0.8]], "goals": [[0.1, 0.3], [0.3, 0.3], [0.8, 0.9]]}
    led = RecipeHandle.model_validate(frozen(line))
    assert (led.at, led.to) == (pytest.approx((0.3, 0.4)), pytest.approx((0.4, 0.5)))


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("points = [[nan, 0.5], [0.1, 0.1]]", "'points[1][1]' must be a finite number, not nan"),
        ("points = [[1e308, 0.5], [1e308, 0.1]]", "'points[1][1]' must be at most 10, not 1e+308"),
        ('points = [["a", 0.5], [0.1, 0.1]]', "'points[1][1]' must be a number, not \"a\""),
        ("points = []", "'at' is missing"),
        ("points = [[0.1, 0.1], [0.2, 0.2]]\ngoals = [[1e308, 0.5], [1e308, 0.1]]", "'goals[1][1]' must"),
    ],
)
def test_of_a_line_that_is_none_its_own_number_is_told(line: str, said: str) -> None:
    with pytest.raises(UserError, match=rf"handle\[1\]: {re.escape(said)}"):
        Recipe.parse(f"[[handle]]\n{line}\nscale = 2.0\n")


def test_the_hand_adds_a_key_and_first_one_of_where_it_rested() -> None:
    led = handle(to=None, keys=[]).led_to(5, 0.1, (0.7, 0.5), (0.5, 0.5))
    assert led.keys == ((0.5, 0.5, 0.5), (pytest.approx(0.6), 0.7, 0.5))
    # Another place in the same tick takes the place of the first; what follows at once goes on from there.
    assert led.led_to(5, 0.1, (0.8, 0.5), (0.5, 0.5)).keys == ((0.5, 0.5, 0.5), (pytest.approx(0.6), 0.8, 0.5))
    more = led.led_to(6, 0.1, (0.9, 0.5), (0.7, 0.5))
    assert [key[1] for key in more.keys or ()] == [0.5, 0.7, 0.9]
    # After a rest it sets out from where it has rested.
    later = led.led_to(9, 0.1, (0.9, 0.5), (0.7, 0.5))
    assert [key[0] for key in later.keys or ()] == pytest.approx([0.5, 0.6, 0.9, 1.0])


def test_what_is_led_before_a_tick() -> None:
    led = handle(to=None, start=0.2, keys=[[0.3, 0.5, 0.5], [0.4, 0.6, 0.5]])
    assert led.before(2, 0.1) is None
    assert [len(cut.keys or ()) for tick in (3, 4, 5) if (cut := led.before(tick, 0.1))] == [1, 2, 2]
    assert led.before(5, 0.1) is led
    turned = handle(start=0.2, turned=[[0.4, 30.0, 1.0], [0.8, 0.0, 1.0]])
    cuts = [cut.turned for tick in (4, 8) if (cut := turned.before(tick, 0.1))]
    assert cuts == [turned.turned[:1], turned.turned]
    at_first = handle(start=0.2, turned=[[0.4, 0.0, 1.0], [0.8, 30.0, 1.0]])
    at_once = handle(rotate=90.0, duration=0.0, turned=[[0.4, 90.0, 1.0]])
    cuts = [cut.turned for led in (at_first, at_once) if (cut := led.before(3, 0.1))]
    assert cuts == [((0.2, 0.0, 1.0),), ()]  # one that is turned is measured otherwise, unless its first turn says so
    far = handle(to=None, keys=[[0.0, 0.5, 0.5], [1.0, 1.5, -1.0]])  # to a corner: none is led farther
    assert [cut.keys for cut in (far.before(5, 0.1),) if cut] == [((0.0, 0.5, 0.5), (0.5, 0.75, 0.25))]


@pytest.mark.parametrize("tick", [3, 7, 12, 17, 24])
@pytest.mark.parametrize(
    "more",
    [
        {"to": [0.5, 0.55], "duration": 0.4, "rotate": 20.0},
        {"to": None, "scale": 0.5, "duration": 0.4},
        {"to": None, "rotate": 20.0, "duration": 0.4, "turned": [[0.4, -30.0, 0.5], [2.1, 0.0, 1.0]]},
        {"to": None, "keys": [[0.1, 0.45, 0.5], [2.2, 0.52, 0.48]]},
    ],
)
def test_what_is_cut_off_between_two_keys_stays_where_it_has_come_to(more: dict[str, Any], tick: int) -> None:
    """It was led back to the key before: a stroke that was begun in the middle of a movement undid half of it."""
    keys = {"keys": [[0.6, 0.55, 0.5], [2.0, 0.6, 0.45]], "turned": [[0.5, 30.0, 1.5], [2.1, -40.0, 0.5]]}
    led, dt = handle(at=[0.45, 0.5], **keys | more), 0.1
    cut = led.before(tick, dt)
    assert cut is not None
    assert RecipeHandle.model_validate(cut.model_dump()) == cut
    assert cut.last == pytest.approx(min(max(tick * dt, cut.ready, cut.upright), led.last))
    names, start = ("at", "to", "radius", "duration", "rotate", "scale", "keys", "turned"), np.array(led.at)
    whole, part = (Handle(**{name: getattr(each, name) for name in names}) for each in (led, cut))
    for time in np.arange(0, tick + 0.5, 0.5) * dt:
        assert part.wanted(start, time, dt) == pytest.approx(whole.wanted(start, time, dt), abs=1e-12)
        assert part.turn(time, dt) == pytest.approx(whole.turn(time, dt), abs=1e-12)


def test_a_pin_that_is_given_goals_is_told_of_them() -> None:
    """It was told of a key `to` that nobody had written."""
    with pytest.raises(UserError, match="unknown key 'goals'"):
        Recipe.parse("[[pin]]\npoints = [[0.1, 0.1], [0.2, 0.2]]\ngoals = [[0.1, 0.1], [0.3, 0.3]]\n")


def test_handles_agree_until_one_is_led_elsewhere() -> None:
    led = handle(start=0.2, duration=0.3, keys=[[0.6, 0.5, 0.5], [0.8, 0.6, 0.5]])
    assert led.agrees_until(led, 0.1) == math.inf
    for other, tick in (
        (led.model_copy(update={"radius": 0.2}), 2),
        (led.model_copy(update={"end": 1.0}), 9),
        (led.model_copy(update={"keys": (*(led.keys or ()), (1.0, 0.1, 0.1))}), 8),
        (led.model_copy(update={"keys": (led.keys or ())[:1]}), 6),
        (led.model_copy(update={"keys": None}), 5),
        (led.model_copy(update={"turned": ((0.9, 20.0, 1.0),)}), 2),
    ):
        assert led.agrees_until(other, 0.1) == other.agrees_until(led, 0.1) == tick


def test_a_key_of_a_turn_takes_the_place_of_one_at_the_same_tick() -> None:
    led = handle(rotate=20.0, duration=0.4).turned_to(8, 0.1, 30.0, 1.0).turned_to(6, 0.1, 10.0, 2.0)
    assert [key[1:] for key in led.turned] == [(10.0, 2.0), (30.0, 1.0)]
    assert [led.turn_key(tick, 0.1)[1] for tick in (3, 6, 7, 8)] == [20.0, 10.0, 10.0, 30.0]
    assert led.turned_to(8, 0.1, 50.0, 1.0).turned == (led.turned[0], (pytest.approx(0.8), 50.0, 1.0))
    one, other = led.turned_to(8, 0.1, 50.0, 1.0), led
    assert one.agrees_until(other, 0.1) == 6


def test_another_turn_before_the_first_one_is_made_is_that_one_and_no_jump_at_its_end() -> None:
    led = handle(rotate=20.0, duration=0.4).turned_to(4, 0.1, 20.0, 1.0).turned_to(8, 0.1, 30.0, 1.0)
    led = led.turned_to(2, 0.1, 50.0, 2.0)
    assert (led.rotate, led.scale) == (50.0, 2.0)
    assert led.turned == ((pytest.approx(0.4), 50.0, 2.0), (pytest.approx(0.8), 30.0, 1.0))
    assert [led.turn_key(tick, 0.1)[1:] for tick in (1, 4, 7, 8)] == [(50.0, 2.0)] * 3 + [(30.0, 1.0)]
    late = handle(start=0.2, keys=[]).turned_to(2, 0.1, 30.0, 1.0)  # it has no first turn
    assert (late.rotate, late.turned) == (None, ((0.2, 30.0, 1.0),))


def test_items_are_counted_from_one_handles_first() -> None:
    pin = RecipePin(at=(0.1, 0.1), name="nose")
    led = handle()
    assert labelled([led, led], [pin]) == [("handle[1]", led), ("handle[2]", led), ('pin[1] "nose"', pin)]


def pair(at: float, to: tuple[float, float], other: float, other_to: tuple[float, float]) -> list[str]:
    """What is said of two handles of radius 0.1 on one line."""
    two = [handle(at=[at, 0.5], to=to), handle(at=[other, 0.5], to=other_to)]
    return [said.removeprefix("handle[1] and handle[2] ") for said in objections(two, [], (1.0, 1.0))]


def test_how_near_two_handles_may_lie_and_be_led() -> None:
    """The same place is nearer than a twentieth of a radius; neighbours may come four times as far apart, or near."""
    assert pair(0.5, (0.5, 0.5), 0.5049, (0.51, 0.5)) == ["hold the same place but have different goals"]
    assert pair(0.5, (0.5, 0.5), 0.5049, (0.5048, 0.5)) == []
    assert pair(0.5, (0.5, 0.5), 0.52, (0.579, 0.5)) == []
    assert pair(0.5, (0.5, 0.5), 0.52, (0.582, 0.5)) == ["have goals 4.1 times as far apart as they are"]
    assert pair(0.5, (0.5, 0.5), 0.61, (0.67, 0.5)) == []
    assert pair(0.5, (0.5, 0.5), 0.58, (0.519, 0.5)) == ["have nearly the same goal"]
    assert pair(0.5, (0.5, 0.5), 0.58, (0.521, 0.5)) == []
    assert pair(0.5, (0.58, 0.5), 0.58, (0.5, 0.51)) == ["cross each other's way"]
    assert pair(0.5, (0.5, 0.58), 0.58, (0.5, 0.5)) == []


@pytest.mark.parametrize("closed", [False, True])
def test_a_long_line_reaches_as_far_as_a_part_of_its_length_and_an_outline_has_one_side_more(closed: bool) -> None:
    corners, to = [[0.1, 0.1], [0.5, 0.1], [0.5, 0.2]], [0.6, 0.8]
    length = 0.4 + 0.1 + math.hypot(0.4, 0.1) * closed
    led = RecipeHandle.model_validate(frozen({"points": corners, "to": to, "closed": closed, "radius": 0.01}))
    far = re.search(
        r"has its goal ([\d.]+) times as far away as it reaches", " ".join(objections([led], [], (1.0, 1.0)))
    )
    assert far is not None
    goal = np.add(corners, np.subtract(to, led.at))
    assert float(far[1]) == pytest.approx(np.hypot(*(goal - corners).T).max() / (length / LONGEST_LINE), rel=5e-3)


def test_who_crosses_whose_way_is_told_as_they_come_near_at_some_moment() -> None:
    """Of two at random, each going straight to its goal, at 1,001 moments: nearer than a quarter of what they were."""
    dice, said = np.random.default_rng(5), 0
    moments = np.linspace(0, 1, 1001)[:, None]
    for _ in range(400):
        (at, to, other, other_to) = 0.5 + dice.uniform(-0.06, 0.06, (4, 2))
        one, two = handle(at=at.tolist(), to=to.tolist()), handle(at=other.tolist(), to=other_to.tolist())
        told = " ".join(objections([one, two], [], (1.0, 1.0)))
        far, after = math.dist(at, other), math.dist(to, other_to)
        nearest = np.hypot(*((1 - moments) * (at - other) + moments * (to - other_to)).T).min()
        close = min(far, 0.1)
        if far < 0.005 or abs(4 * nearest - close) < 1e-3 or "apart" in told or "nearly" in told:
            continue
        assert after * 4 >= close
        assert ("cross each other's way" in told) == (4 * nearest < close)
        said += 4 * nearest < close
    assert said > 20


def test_a_handle_goes_two_radii_at_most() -> None:
    assert [*objections([handle(to=[0.699, 0.5])], [], (1.0, 1.0))] == []
    (said,) = objections([handle(to=[0.75, 0.5])], [], (1.0, 1.0))
    assert said == (
        "handle[1] has its goal 2.5 times as far away as it reaches, and it goes 2 times at most; "
        "give it a larger reach (radius)"
    )
    assert [*objections([handle(to=[0.5, 0.75])], [], (1.0, 0.75))] == []


def test_of_a_line_outside_a_corner_is_told_that_is_there() -> None:
    line = handle(points=[[-1.0, -0.5], [2.0, 1.5]])
    assert [*objections([line], [], (1.0, 1.0))] == [
        "handle[1] takes hold of nothing: (-1, -0.5) is outside the picture"
    ]


def test_of_a_line_it_is_told_where_it_is_turned_and_what_only_an_outline_cannot_do() -> None:
    (said,) = objections([handle(points=[[0.5, 0.1], [0.9, 0.1]], at=[0.5, 0.1], to=None, rotate=-90)], [], (1.0, 1.0))
    assert said == "handle[1] goes only to the picture's edge: (0.5, -0.3) is outside the picture"
    over = {"points": [[0.3, 0.4], [0.5, 0.6], [0.7, 0.4]], "goals": [[0.3, 0.6], [0.5, 0.4], [0.7, 0.6]]}
    assert [*objections([handle(**over)], [], (1.0, 1.0))] == []
    (said,) = objections([handle(**over, closed=True)], [], (1.0, 1.0))
    assert said == "handle[1] is turned inside out by its goals"


def test_a_line_that_stays_short_beside_an_edge_is_told_of() -> None:
    """By where the edge lets its nearest place go: four times as far from it."""
    line = {"points": [[0.02, 0.3], [0.3, 0.5]], "at": [0.02, 0.3]}
    assert [*objections([handle(**line, to=[0.07, 0.3])], [], (1.0, 1.0))] == []
    (said,) = objections([handle(**line, to=[0.12, 0.3])], [], (1.0, 1.0))
    assert said == "handle[1] stays 4% of the longer side short: what is at the picture's edge stays there"


def test_what_is_only_turned_is_on_its_way_too() -> None:
    assert handle(to=None, rotate=30, start=0.5, duration=1.0).span == (0.5, 1.5)
    assert handle(to=None, rotate=30, start=0.5, duration=1.0).spanning(1.0, 3.0)["duration"] == 2.0


def test_handles_that_are_never_in_force_together_do_not_contradict_each_other() -> None:
    first, second = handle(to=[0.51, 0.5], end=1.0), handle(to=[0.49, 0.5], start=1.0)
    assert [*objections([first, second], [], (1.0, 1.0))] == []
    assert len([*objections([first, second.model_copy(update={"start": 0.9})], [], (1.0, 1.0))]) == 1


def test_sixty_four_handles_and_pins_work() -> None:
    pins = tuple(RecipePin(at=(k / 64, 0.5)) for k in range(60))
    assert len(Recipe(handle=(handle(),) * 4, pin=pins).pin) == 60
    with pytest.raises(ValueError, match="65 handles and pins; at most 64 work"):
        Recipe(handle=(handle(),) * 5, pin=pins)


def test_the_window_calls_the_radius_as_its_slider_is_called() -> None:
    (said,) = objections([handle(to=[0.75, 0.5])], [], (1.0, 1.0))
    assert heading(said) == (
        "Handle 1 has its goal 2.5 times as far away as it reaches, and it goes 2 times at most; give it a larger Size"
    )


def test_the_window_tells_how_far_in_pixels_alone() -> None:
    said = 'handle[2] "chin" is 2.95 pixels (5.9e-03 longer sides) from where it should be: it has not begun'
    assert heading(said) == 'Handle 2 "chin" is 2.95 pixels from where it should be: it has not begun'


def test_handles_are_counted_before_they_are_looked_at() -> None:
    with pytest.raises(UserError, match="there are 65 handles and pins; at most 64 work"):
        Recipe.parse("[[pin]]\nat = 1\n" * 65)

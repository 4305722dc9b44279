"""Where a handle shall be at each moment, without a fluid."""

from __future__ import annotations

import math

import numpy as np
import pytest

from solver.brush.handle import Handle, Shape

DT = 0.02
TIMES = np.linspace(0, 4, 401)
KEYS = ((1.5, 0.4, 0.7), (1.9, 0.6, 0.2), (3.0, 0.3, 0.5))


def way(handle: Handle) -> np.ndarray:
    """Where it shall be at `TIMES`, (n, 2)."""
    return np.array([handle.wanted(np.array(handle.at), time, DT, math.inf) for time in TIMES.tolist()])


def test_after_its_first_way_a_handle_goes_from_key_to_key_at_an_even_speed() -> None:
    handle = Handle((0.5, 0.5), (0.7, 0.6), start=0.2, duration=0.8, keys=KEYS)
    times, places = [1.0, *(key[0] for key in KEYS)], np.array([(0.7, 0.6), *(key[1:] for key in KEYS)])
    after = TIMES >= 1.0
    for axis in (0, 1):
        wanted = np.interp(TIMES[after], times, places[:, axis])
        assert way(handle)[after, axis] == pytest.approx(wanted, abs=1e-12)


@pytest.mark.parametrize("keys", [(), KEYS])
def test_the_first_way_begins_and_ends_softly_and_is_the_same_whatever_comes_after(keys: tuple) -> None:
    handle = Handle((0.5, 0.5), (0.7, 0.6), start=0.2, duration=0.8, keys=keys)
    at = way(handle)[TIMES <= 1.0]
    assert (at[TIMES[: len(at)] <= 0.2] == 0.5).all()
    parts = (at[20:] - 0.5) / [0.2, 0.1]
    assert parts[:, 0] == pytest.approx(parts[:, 1], abs=1e-12)
    assert parts[:, 0] + parts[::-1, 0] == pytest.approx(np.ones(len(parts)), abs=1e-9), "as it begins it ends"
    speed = np.diff(parts[:, 0])
    assert (speed > 0).all()
    assert max(speed[0], speed[-1]) < 0.1 * speed.max()


def test_after_its_first_turn_a_handle_turns_evenly_and_grows_by_even_factors() -> None:
    turned = ((1.5, 90.0, 2.0), (2.0, -30.0, 0.5), (3.0, 0.0, 1.0))
    handle = Handle((0.5, 0.5), start=0.2, duration=0.8, rotate=45.0, scale=1.5, turned=turned)
    after = TIMES >= 1.0
    angles, scales = np.array([handle.turn(time, DT) for time in TIMES[after].tolist()]).T
    times, rows = [1.0, *(key[0] for key in turned)], np.array([(45.0, 1.5), *(key[1:] for key in turned)])
    assert angles == pytest.approx(np.interp(TIMES[after], times, rows[:, 0]), abs=1e-9)
    assert np.log(scales) == pytest.approx(np.interp(TIMES[after], times, np.log(rows[:, 1])), abs=1e-9)


def test_a_handle_that_goes_nowhere_stays_where_it_was_when_it_began() -> None:
    handle = Handle((0.5, 0.5), start=0.2)
    began = np.array((0.52, 0.47))
    assert all((handle.wanted(began, time, DT) == began).all() for time in TIMES.tolist())


def test_a_handle_goes_no_farther_than_so_many_radii() -> None:
    handle = Handle((0.5, 0.5), (0.9, 0.8), radius=0.1, duration=1.0, keys=((2.0, 0.1, 0.2), (3.0, 0.5, 0.6)))
    for time, place in ((1.0, (0.9, 0.8)), (2.0, (0.1, 0.2)), (3.0, (0.5, 0.6))):
        way = np.array(place) - 0.5
        far = np.hypot(*way)
        wanted = 0.5 + way * min(1.0, 0.2 / far)
        assert handle.wanted(np.array((0.5, 0.5)), time, DT, 2.0) == pytest.approx(wanted, abs=1e-12)


@pytest.mark.parametrize(
    ("at", "extent"), [((0.01, 0.01), (1.0, 1.0)), ((1.0, 0.99), (1.0, 1.0)), ((0.5, 0.02), (1.0, 0.04))]
)
def test_what_is_turned_in_a_corner_is_no_farther_away_than_it_is(at: tuple[float, float], extent: tuple[float, float]):
    """Two points of its ring lie in the picture, which have no area: it was a radius / 4 away for ever."""
    shape = Shape.of(Handle(at, radius=0.25, rotate=0.0), extent)
    assert len(shape.led) == 3
    assert shape.away(shape.led, shape.due(shape.led, 0.0, DT)) == pytest.approx(0, abs=1e-12)
    wider = shape.led[0] + 1.1 * (shape.led - shape.led[0])
    assert shape.away(wider, shape.led) == pytest.approx(0.1 * 1.1 * 0.25 / 4, rel=1e-6)
    assert shape.grown(shape.led, wider) == pytest.approx(1.1)


@pytest.mark.parametrize("goals", [(), ((-0.5, 0.6), (0.02, 0.6))])
def test_a_line_of_which_one_point_is_in_the_picture_leads_that_to_its_own_place(goals: tuple):
    """It was led where the middle of the line was to be, outside: a pin drew the picture out to its edge."""
    handle = Handle((-0.24, 0.5), points=((-0.5, 0.5), (0.02, 0.5)), goals=goals)
    shape = Shape.of(handle, (1.0, 1.0))
    assert shape.led == pytest.approx(np.array([(0.02, 0.5)]))
    there = np.array([goals[1] if goals else (0.02, 0.5)])
    assert shape.wanted(shape.led, handle.last, DT) == pytest.approx(there)
    assert shape.due(shape.led, handle.last, DT) == pytest.approx(there)
    assert shape.short_of_edges(shape.led) == pytest.approx(0)


@pytest.mark.parametrize("points", [(), ((0.45, 0.5), (0.55, 0.5))])
@pytest.mark.parametrize(
    ("to", "keys", "is_short"),
    [
        ((1.0, 0.5), (), True),
        ((0.7, 0.5), ((2.0, 1.0, 0.5),), True),
        ((1.0, 0.5), ((2.0, 0.7, 0.5),), False),
        ((1.0, 0.5), ((2.0, 0.7, 0.5), (3.0, 0.5, 0.0)), True),
    ],
)
def test_whether_it_stays_short_of_an_edge_is_asked_of_where_it_goes_last(
    points: tuple, to: tuple[float, float], keys: tuple, is_short: bool
) -> None:
    shape = Shape.of(Handle((0.5, 0.5), to, duration=1.0, keys=keys, points=points), (1.0, 1.0), 0.02)
    short = shape.short_of_edges(shape.led)
    assert short > 0.01 if is_short else short == 0


LINE = ((0.3, 0.4), (0.5, 0.45), (0.7, 0.3))


@pytest.mark.parametrize(
    "handle",
    [
        Handle((0.5, 0.5)),
        Handle((0.5, 0.5), radius=0.2, rotate=30.0),
        Handle((0.5, 0.4), points=LINE),
        Handle((0.5, 0.4), points=LINE, closed=True, rotate=30.0),
    ],
    ids=["point", "ring", "line", "loop"],
)
def test_how_far_away_a_handle_is_by_what_it_leads(handle: Handle) -> None:
    """A point and a line by the farthest of their points; a ring by its middle, and how far it is turned and scaled."""
    shape = Shape.of(handle, (1.0, 0.8))
    ends = shape.led
    assert (len(ends) > 1) == bool(handle.points or handle.rotate)
    assert shape.is_ring == (not handle.points and handle.rotate is not None)
    assert shape.away(ends, ends) == 0
    assert shape.away(np.add(ends, (0.03, -0.04)), ends) == pytest.approx(0.05)
    for angle, scale in ((0.02, 1.0), (0.0, 1.03), (0.02, 1.03)):
        turn = scale * np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
        places = ends[0] + (ends - ends[0]) @ turn
        moved = np.hypot(*(places - ends).T)
        if shape.is_ring:
            arm = scale * handle.radius / 4
            turned = arm * math.hypot(math.sin(angle) / scale, scale - 1)
            assert shape.away(places, ends) == pytest.approx(turned, rel=1e-3)
            assert shape.away(np.add(places, (0.03, -0.04)), ends) == pytest.approx(0.05 + turned, rel=1e-3)
            assert shape.grown(ends, places) == pytest.approx(scale)
        else:
            assert shape.away(places, ends) == pytest.approx(moved.max())


def test_the_middle_of_what_is_led_and_where_its_place_has_come_to() -> None:
    """Of a line the place keeps to its points, turned and scaled as these are; of all else it is the first of them."""
    line = Shape.of(Handle((0.6, 0.5), points=LINE), (1.0, 0.8))
    assert line.middle(line.led) == pytest.approx((0.6, 0.5))
    assert line.middle(np.add(line.led, (0.1, 0.05))) == pytest.approx((0.7, 0.55))
    assert line.place(line.led, line.led) == pytest.approx((0.6, 0.5))
    turn = 1.3 * np.array([[math.cos(0.4), math.sin(0.4)], [-math.sin(0.4), math.cos(0.4)]])
    places = (0.4, 0.3) + (line.led - (0.2, 0.1)) @ turn
    assert line.place(places, line.led) == pytest.approx((0.4, 0.3) + (np.array((0.6, 0.5)) - (0.2, 0.1)) @ turn)
    ring = Shape.of(Handle((0.5, 0.5), radius=0.2, rotate=30.0), (1.0, 0.8))
    for shape in (ring, Shape.of(Handle((0.5, 0.5)), (1.0, 0.8))):
        assert shape.middle(shape.led + 0.1) == pytest.approx((0.6, 0.6))
        assert shape.place(shape.led + 0.1, shape.led) == pytest.approx((0.6, 0.6))

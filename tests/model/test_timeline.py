"""Which ticks an animation's frames show, and what ends a simulation."""

from __future__ import annotations

from bisect import bisect_right
from fractions import Fraction
from itertools import pairwise
from math import ceil, floor
from typing import Any

import pytest

from app.errors import UserError
from app.model.recipe import Playback, Recipe, Stop, Watch
from app.model.timeline import (
    Dissolve,
    Observation,
    Sentinel,
    Timeline,
    dissolved,
    frame_positions,
    frame_rate,
    moment_at,
)

TEN = Timeline(10, 0.1)


def test_duration_is_a_whole_number_of_ticks():
    recipe = Recipe.parse("duration = 1.0\n[fluid]\ndt = 0.3")
    assert Timeline.of(recipe).ticks == 3
    assert Recipe.parse("duration = 1.1\n[fluid]\ndt = 0.3").ticks == 4
    assert Recipe.parse("duration = 1e-6").ticks == 1


def test_frames_run_from_the_first_warp_to_the_last():
    assert frame_positions(TEN, Playback(), fps=10) == list(range(11))


def test_frame_rate_is_independent_of_the_tick():
    positions = frame_positions(TEN, Playback(), fps=24)
    assert len(positions) == 25
    assert positions[0] == 0
    assert positions[-1] == 10
    assert {b - a for a, b in pairwise(positions)} == {Fraction(10, 24)}


@pytest.mark.parametrize(
    ("fps", "count"),
    [(29.97, 31), (23.976, 25), (59.94, 61), (12.5, 13), (10.4, 11), (10.6, 12), (0.4, 2), (1000, 1001)],
)
def test_a_second_at_a_fractional_rate_has_the_nearest_number_of_frames(fps: float, count: int):
    """One more than spaces between them; halves go to the even number."""
    positions = frame_positions(TEN, Playback(), fps)
    assert len(positions) == count
    assert (positions[0], positions[-1]) == (0, 10)
    assert {b - a for a, b in pairwise(positions)} == {Fraction(10, count - 1)}


@pytest.mark.parametrize(
    ("fps", "rate"),
    [
        (23.976, Fraction(24000, 1001)), (29.97, Fraction(30000, 1001)), (47.952, Fraction(48000, 1001)),
        (59.94, Fraction(60000, 1001)), (119.88, Fraction(120000, 1001)), (12.5, Fraction(25, 2)),
        (1 / 3, Fraction(1, 3)), (30, Fraction(30)),
    ],
)  # fmt: skip
def test_a_rate_is_the_fraction_that_is_meant(fps: float, rate: Fraction):
    assert frame_rate(fps) == rate


def test_slow_motion_has_more_frames():
    assert len(frame_positions(TEN, Playback(speed=0.5), fps=10)) == 21


def test_part_of_the_simulation():
    assert frame_positions(TEN, Playback(start=0.2, end=0.4), fps=10) == [2, 3, 4]
    assert frame_positions(TEN, Playback(start=0.2, end=0.2), fps=10) == [2]
    assert frame_positions(TEN, Playback(start=50), fps=10) == [10]


def test_too_many_frames_are_refused():
    with pytest.raises(UserError, match=r"time.speed"):
        frame_positions(Timeline(10, 10.0), Playback(speed=1e-4), fps=1000)


def test_rest_counts_only_after_motion():
    sentinel = Sentinel(Stop(speed_below=0.1, energy_below=0.5), dt=0.1)
    assert sentinel.needs_motion
    assert sentinel.verdict(1, Observation(energy=0.0, speed=0.0)) is None
    assert sentinel.verdict(2, Observation(energy=0.0, speed=1.0)) is None
    message = sentinel.verdict(3, Observation(energy=0.0, speed=0.05))
    assert message == "stopped at t = 0.3 s (tick 3): largest speed 0.05 is below 0.1"


@pytest.mark.parametrize(
    ("stop", "seen", "words"),
    [
        (Stop(displacement_above=0.1), Observation(displacement=0.2), "largest displacement 0.2 is above 0.1"),
        (Stop(det_below=0.2), Observation(det=0.1), "smallest det J 0.1 is below 0.2"),
        (
            Stop(watch=(Watch(point=(0.5, 0.5), distance=0.1),)),
            Observation(points=((0.5, 0.4),), extent=(1.0, 0.5)),
            "watched point 1 has moved 0.15",
        ),
        (
            Stop(watch=(Watch(point=(0.5, 0.5), place=(0.5, 1.0)),)),
            Observation(points=((0.5, 0.495),), extent=(1.0, 0.5)),
            "watched point 1 has reached its place",
        ),
    ],
)
def test_conditions(stop: Stop, seen: Observation, words: str):
    assert words in (Sentinel(stop, 0.1).verdict(5, seen) or "")


def test_nothing_to_watch():
    assert Sentinel(Stop(), 0.1).is_idle


FAR = Watch(point=(0.5, 0.5), distance=0.25)
NEAR = Watch(point=(0.5, 0.5), place=(0.25, 0.5), within=0.25)


@pytest.mark.parametrize(
    ("stop", "at_it", "beyond", "words"),
    [
        (
            Stop(displacement_above=0.25),
            {"displacement": 0.25},
            {"displacement": 0.3},
            "largest displacement 0.3 is above 0.25",
        ),
        (Stop(det_below=0.25), {"det": 0.25}, {"det": 0.2}, "smallest det J 0.2 is below 0.25"),
        (
            Stop(handles_within=0.25),
            {"away": 0.26},
            {"away": 0.25},
            "all handles have arrived (0.25 away at most, within 0.25)",
        ),
        (
            Stop(watch=(FAR,)),
            {"points": ((0.5, 0.74),)},
            {"points": ((0.5, 0.75),)},
            "watched point 1 has moved 0.25, at least 0.25",
        ),
        (
            Stop(watch=(FAR, NEAR)),
            {"points": ((0.5, 0.5), (0.51, 0.5))},
            {"points": ((0.5, 0.5), (0.5, 0.5))},
            "watched point 2 has reached its place (0.25 away, within 0.25)",
        ),
    ],
)
def test_a_condition_ends_the_simulation_beyond_its_number(
    stop: Stop, at_it: dict[str, Any], beyond: dict[str, Any], words: str
):
    sentinel = Sentinel(stop, 0.5)
    assert sentinel.verdict(3, Observation(**at_it)) is None
    assert sentinel.verdict(4, Observation(**beyond)) == f"stopped at t = 2 s (tick 4): {words}"


def test_energy_counts_only_once_it_has_been_above():
    sentinel = Sentinel(Stop(energy_below=0.5), dt=0.1)
    assert [sentinel.verdict(0, Observation(energy=energy)) for energy in (0.4, 0.5, 0.5)] == [None] * 3
    assert (
        sentinel.verdict(0, Observation(energy=0.4)) == "stopped at t = 0 s (tick 0): kinetic energy 0.4 is below 0.5"
    )


@pytest.mark.parametrize(
    ("stop", "needed"),
    [
        (Stop(energy_below=1), "motion"),
        (Stop(speed_below=1), "motion"),
        (Stop(displacement_above=1), "map"),
        (Stop(det_below=0), "map"),
        (Stop(handles_within=1), "handles"),
        (Stop(watch=(FAR,)), "points"),
    ],
)
def test_only_what_a_condition_looks_at_is_worked_out(stop: Stop, needed: str):
    sentinel = Sentinel(stop, 0.1)
    assert not sentinel.is_idle
    assert [name for name in ("motion", "map", "handles", "points") if getattr(sentinel, f"needs_{name}")] == [needed]


def test_a_million_frames_with_those_that_stand_still_are_the_most():
    still = Playback(hold_first=300, hold_last=200)
    assert len(frame_positions(Timeline(1000, 0.5), still, fps=1000)) == 500_001
    with pytest.raises(UserError, match=r"more than 1000000 frames"):
        frame_positions(Timeline(1000, 0.5), still.model_copy(update={"hold_last": 200.1}), fps=1000)


def test_a_time_is_the_nearest_tick_within_the_timeline():
    assert [TEN.tick_at(seconds) for seconds in (-1, 0.04, 0.06, 0.94, 0.96, 7)] == [0, 0, 1, 9, 10, 10]
    assert TEN.time_of(2.5) == 0.25


@pytest.mark.parametrize("playback", [{}, {"speed": 2.0}, {"speed": 0.3, "start": 0.2}, {"start": 0.1, "end": 0.9}])
@pytest.mark.parametrize("fps", [10, 25, 29.97, 60])
def test_the_frame_at_a_tick_is_the_last_that_has_begun(playback: dict[str, float], fps: float) -> None:
    """By the positions of all frames; past the end they go on at their rate, as those of a longer clip."""
    timeline, how = Timeline(37, 1 / 30), Playback(**playback)  # pyright: ignore[reportArgumentType]
    positions = frame_positions(timeline, how, fps)
    first = ceil(positions[0])
    for tick in range(first, floor(positions[-1]) + 1):
        assert moment_at(timeline, how, fps, tick) == bisect_right(positions, tick) - 1
    for later in (1, 2, 30):
        last = len(positions) - 1 + floor(later / 30 * fps + 1e-9)
        assert moment_at(timeline, how, fps, timeline.ticks + later) == last
    backwards = how.model_copy(update={"reverse": True})
    assert moment_at(timeline, backwards, fps, first) == len(positions) - 1


@pytest.mark.parametrize(("count", "frames"), [(11, 2), (11, 3), (11, 5), (21, 10), (300, 77)])
def test_a_loop_goes_on_from_its_last_frame_to_its_first(count: int, frames: int):
    """The end falls and the beginning rises by one step a frame, also around the seam."""
    positions = [Fraction(step) for step in range(count)]
    shown, into = dissolved(positions, frames)
    assert len(shown) == count - 1 - frames
    end = {number: 1 - into[number].share if number in into else 1 for number in range(len(shown))}
    assert [end[number] for number in sorted(into)] == pytest.approx([1 - n / frames for n in range(1, frames)])
    assert shown == positions[frames:-1]
    for number, fade in into.items():  # one more step and it is the loop's first frame, and nothing but that
        assert fade.into == pytest.approx(fade.share * frames)
        assert len(shown) - number == frames - fade.into
    assert into.get(len(shown) - 1, Dissolve(positions[0], 0)).into + 1 == shown[0]


def test_a_loop_dissolves_half_of_itself_at_most():
    positions = [Fraction(step) for step in range(11)]
    assert len(dissolved(positions, 5)[0]) == 5
    with pytest.raises(UserError, match=r"'time.dissolve'\) takes less than two frames; make it longer"):
        dissolved(positions, 1)
    with pytest.raises(UserError, match=r"'time.dissolve'\) is more than half of the animation"):
        dissolved(positions, 6)

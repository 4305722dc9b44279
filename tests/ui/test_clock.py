"""Seconds turned into ticks."""

from __future__ import annotations

import pytest

from app.ui.clock import Clock
from support.editing import Robot


def test_a_movement_begins_at_once_and_keeps_its_pace() -> None:
    clock = Clock()
    assert clock.ticks(10.0, 1 / 30, False) == 0
    assert sum(clock.ticks(1 / 60, 1 / 30, True) for _ in range(60)) == pytest.approx(30, abs=1)


@pytest.mark.parametrize(("dt", "most"), [(1 / 30, 1), (1 / 15, 2), (0.1, 2), (5.0, 2)])
def test_a_slow_frame_is_worth_two_ticks_at_most(dt: float, most: int) -> None:
    """Also of one that is long overdue, for what is owed is not kept beyond that."""
    clock = Clock()
    clock.ticks(dt, 1 / 30, False)
    made = [clock.ticks(dt, 1 / 30, True) for _ in range(20)]
    assert max(made) <= 2
    assert made[5:] == [most] * 15
    assert clock.ticks(1 / 3000, 1 / 30, True) <= 1


def test_a_tick_comes_a_tenth_early_rather_than_a_frame_late() -> None:
    for part, made in ((0.91, 1), (0.89, 0)):
        clock = Clock()
        clock.ticks(1.0, 0.1, True)  # what came before the movement is worth one tick
        assert clock.ticks(part * 0.1, 0.1, True) == made


def test_what_may_still_come_does_so_in_four_frames_and_seven_tenths_of_a_second() -> None:
    clock = Clock()
    seen = []
    for _ in range(8):
        seen.append((clock.settling, clock.hovering))
        clock.elapse(0.125)
    assert seen == [(True, True)] * 4 + [(False, True)] * 2 + [(False, False)] * 2
    clock.stir()
    assert (clock.settling, clock.hovering) == (True, True)


def test_parts_of_a_frame_are_told_in_smoothed_milliseconds(monkeypatch: pytest.MonkeyPatch) -> None:
    moments = iter((0.0, 0.010, 1.0, 1.030))
    monkeypatch.setattr("time.perf_counter", lambda: next(moments))
    clock = Clock()
    for wanted in (10.0, 10.0 + 0.15 * 20.0):
        with clock.measure("draw"):
            pass
        assert clock.milliseconds["draw"] == pytest.approx(wanted)


def test_what_each_part_of_a_frame_takes_is_told_by_its_name(robot: Robot) -> None:
    """The statistics and the lines over the canvas show these names."""
    robot.drag((0.4, 0.5), (0.5, 0.5), steps=3)
    assert set(robot.editor.clock.milliseconds) == {"frame", "simulate", "canvas", "panels", "interface"}

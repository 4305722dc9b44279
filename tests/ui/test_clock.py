"""Seconds turned into ticks."""

from __future__ import annotations

import pytest

from app.ui.clock import Clock


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

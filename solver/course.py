"""When a handle is where: its first way, its first turn, and the keys after them, as its numbers say it."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from operator import itemgetter
from typing import TYPE_CHECKING

SAME_TIME = 1e-6  # ticks between two times that are the same but for their rounding


class Course:
    """What follows from the numbers of a handle, which the recipe's and the solver's both have."""

    if TYPE_CHECKING:
        start: float
        duration: float
        to: tuple[float, float] | None
        rotate: float | None
        scale: float | None
        keys: tuple[tuple[float, float, float], ...]
        turned: tuple[tuple[float, float, float], ...]

    @property
    def ready(self) -> float:
        """The seconds at which it has gone its first way, and its keys may begin."""
        return self.start if self.to is None else self.start + self.duration

    @property
    def turns(self) -> bool:
        """True if it is told how it is turned or scaled."""
        return self.rotate is not None or self.scale is not None or bool(self.turned)

    @property
    def upright(self) -> float:
        """The seconds at which it has made its first turn, and `turned` may begin."""
        return self.start if self.rotate is None and self.scale is None else self.start + self.duration

    @property
    def last(self) -> float:
        """The seconds from which on it only stays."""
        return max(self.keys[-1][0] if self.keys else self.ready, self.turned[-1][0] if self.turned else self.upright)

    def passed(self, time: float) -> float:
        """The part of its first way, 0-1, that it shall have gone at a time."""
        if time >= self.start + self.duration:
            return 1.0
        if time <= self.start:  # also where it goes its way at once
            return 0.0
        part = (time - self.start) / self.duration
        return part * part * (3 - 2 * part)

    def turn(self, time: float, dt: float) -> tuple[float, float]:
        """The angle, degrees, and the scale that it shall have at a time; `dt` says how exact the time is."""
        rotate, scale = self.rotate or 0.0, self.scale or 1.0
        if time < self.upright:
            return rotate * self.passed(time), scale ** self.passed(time)
        here, there, part = between((rotate, scale), self.upright, self.turned, time, dt)
        return (1 - part) * here[0] + part * there[0], here[1] ** (1 - part) * there[1] ** part


def between(
    first: tuple[float, float], since: float, keys: Sequence[tuple[float, float, float]], time: float, dt: float
) -> tuple[tuple[float, float], tuple[float, float], float]:
    """The last of some keys (t, a, b) that has come, the next, and the part of the way between them, 0 where there is
    none to go, without the times; `first` has come at `since`.
    """
    here, number = first, bisect_right(keys, time + SAME_TIME * dt, key=itemgetter(0))
    if number:
        since, *_ = keys[number - 1]
        here = keys[number - 1][1:]
    until, *there = keys[number] if number < len(keys) else (since, *here)
    # At a key nothing of what comes later is seen.
    if until == since or (*there,) == here or abs(time - since) <= SAME_TIME * dt:
        return here, here, 0.0
    return here, (there[0], there[1]), (time - since) / (until - since)

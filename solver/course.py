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


def between(
    first: tuple[float, float], since: float, keys: Sequence[tuple[float, float, float]], time: float, dt: float
) -> tuple[tuple[float, float], tuple[float, float], float]:
    """The last of some keys (t, a, b) that has come, the next, and the part of the way between them, without the times;
    `first` has come at `since`.
    """
    here, number = first, bisect_right(keys, time + SAME_TIME * dt, key=itemgetter(0))
    if number:
        since, *_ = keys[number - 1]
        here = keys[number - 1][1:]
    # At a key nothing of what comes later is seen.
    if number == len(keys) or keys[number][0] == since or abs(time - since) <= SAME_TIME * dt:
        return here, here, 0.0
    until, *there = keys[number]
    return here, (there[0], there[1]), (time - since) / (until - since)

"""Time in the window: how many ticks a frame is worth, and how long its parts take."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

SLOWEST = 0.1  # seconds of one frame that count: after a pause, time does not leap
FRAMES = 4  # until sizes have come to rest that follow from one another: of a window that fits what is in it
HOVERING = 0.7  # seconds; longer than the pointer has to rest on anything before something happens
TWICE = 0.5  # seconds between the clicks of a double click at most, as most systems have it
PACE = 0.05  # seconds between frames that only wait for that


class Clock:
    """Turns seconds into ticks, and measures.

    Attributes:
        milliseconds: of the parts of a frame, smoothed.
    """

    def __init__(self) -> None:
        self.milliseconds: dict[str, float] = {}
        self._frames, self._hovering = FRAMES, HOVERING
        self._owed = 0.0
        self._moved = False

    def ticks(self, dt: float, tick: float, moving: bool) -> int:
        """Ticks of `tick` seconds that `dt` seconds are worth, at most two; what is left over is kept."""
        if not moving:
            # The first frame of a movement makes a tick at once: what is done is seen in the very next frame.
            self._owed, self._moved = tick, False
            return 0
        # Nor does the rest before a movement count.
        self._owed = min(self._owed + min(dt, SLOWEST if self._moved else tick), 2.5 * tick)
        self._moved = True
        # A little early rather than a frame late: screens and ticks are never quite in step.
        count = int(self._owed / tick + 0.1)
        self._owed -= count * tick
        return min(count, 2)

    @contextmanager
    def measure(self, name: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        spent = (time.perf_counter() - start) * 1e3
        before = self.milliseconds.get(name, spent)
        self.milliseconds[name] = before + 0.15 * (spent - before)

    def stir(self) -> None:
        """Something has happened, of which imgui shows a part some frames or a hover delay later."""
        self._frames, self._hovering = FRAMES, HOVERING

    @property
    def settling(self) -> bool:
        """Sizes may still change."""
        return self._frames > 0

    @property
    def hovering(self) -> bool:
        """What comes to a pointer that rests may still come."""
        return self._hovering > 0

    def elapse(self, dt: float) -> None:
        """A frame begins, `dt` seconds after the last one."""
        self._frames = max(self._frames - 1, 0)
        self._hovering = max(self._hovering - dt, 0.0)

"""Time in the window: how many ticks a frame is worth, and how long its parts take."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

SLOWEST = 0.1  # seconds of one frame that count: after a pause, time does not leap


class Clock:
    """Turns seconds into ticks, and measures.

    Attributes:
        milliseconds: of the parts of a frame, smoothed.
        settling: frames to draw yet after the last event, for what imgui shows a frame late.
    """

    def __init__(self) -> None:
        self.milliseconds: dict[str, float] = {}
        self.settling = 3
        self._owed = 0.0

    def ticks(self, dt: float, tick: float, moving: bool) -> int:
        """Ticks of `tick` seconds that `dt` seconds are worth, at most two; what is left over is kept."""
        if not moving:
            # The first frame of a movement makes a tick at once: what is done is seen in the very next frame.
            self._owed = tick
            return 0
        self._owed = min(self._owed + min(dt, SLOWEST), 2.5 * tick)
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

    def frame_done(self) -> None:
        self.settling = max(self.settling - 1, 0)

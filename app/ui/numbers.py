"""Numbers about the simulation, looked at a few times a second, since each look waits for the GPU."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

from app.work.session import Session
from solver.warp.distortion import MapStatistics

EVERY = 0.5  # seconds


@dataclass(frozen=True)
class Stats:
    """Milliseconds by stage of one step, what the map does, and the largest divergence (1 / s)."""

    stages: dict[str, float] = field(default_factory=dict)
    map: MapStatistics | None = None
    divergence: float = 0.0


class Numbers:
    """The latest numbers.

    Args:
        every: seconds between two looks.
    """

    def __init__(self, every: float = EVERY) -> None:
        self._every = every
        self._stats = Stats()
        self._last = 0.0
        self._seen = -1
        self._steps = 0

    def take(self, session: Session) -> Stats:
        """The numbers, at most `every` seconds old while something changes."""
        now = time.perf_counter()
        if session.changes != self._seen and now - self._last > self._every:
            taken, steps = session.device.timings.take(), session.replay.steps - self._steps
            self._steps += steps
            stages = self._stats.stages
            if steps > 0 and taken:
                stages = {name: spent / steps for name, spent in taken.items()}
            self._last, self._seen = now, session.changes
            self._stats = Stats(stages, session.replay.warp.statistics(session.replay.grid.size), session.divergence())
        return self._stats

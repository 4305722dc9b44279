"""Numbers about the simulation, looked at a few times a second, since each look waits for the GPU."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

from app.session import Session
from solver.warp import MapStatistics

EVERY = 0.5  # seconds


@dataclass(frozen=True)
class Stats:
    """Milliseconds by stage, what the map does, and the largest divergence (1 / s)."""

    stages: dict[str, float] = field(default_factory=dict)
    map: MapStatistics | None = None
    divergence: float = 0.0


class Numbers:
    """The latest numbers."""

    def __init__(self) -> None:
        self._stats = Stats()
        self._last = 0.0
        self._seen = -1

    def take(self, session: Session) -> Stats:
        """The numbers, at most `EVERY` old while something changes."""
        now = time.perf_counter()
        if session.changes != self._seen and now - self._last > EVERY:
            ticks = max(session.changes - self._seen, 1)
            stages = {name: value / ticks for name, value in session.device.timings.take().items()}
            self._last, self._seen = now, session.changes
            self._stats = Stats(stages, session.replay.warp.statistics(), session.divergence())
        return self._stats

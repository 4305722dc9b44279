"""How often and how long each stage of a step ran."""

from __future__ import annotations

import time
from collections import defaultdict
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass

import moderngl


class Timings:
    """Passes, texel reads and, when `enabled`, milliseconds by stage, since the last `take()`.

    Timing waits for the GPU at both ends of every stage, which slows a step down: it is off unless asked for.
    It measures, and never steers: nothing that is simulated depends on it.
    """

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._stage = "other"
        self._since = 0.0
        self.enabled = False
        self.milliseconds: dict[str, float] = defaultdict(float)
        self.passes: dict[str, int] = defaultdict(int)
        self.texel_reads: dict[str, int] = defaultdict(int)
        self.texel_writes: dict[str, int] = defaultdict(int)

    def stage(self, name: str) -> AbstractContextManager[object]:
        """Book everything drawn inside under `name`; stages do not nest, the inner name is ignored."""
        return nullcontext() if self._stage != "other" else _Stage(self, name)

    def begin(self, name: str) -> None:
        """Book what is drawn from now on under `name`."""
        self._stage = name
        if self.enabled:
            self._ctx.finish()
        self._since = time.perf_counter()

    def end(self) -> None:
        """The stage is over."""
        if self.enabled:
            self._ctx.finish()
            self.milliseconds[self._stage] += (time.perf_counter() - self._since) * 1e3
        self._stage = "other"

    def count(self, pixels: int, reads: int, passes: int = 1) -> None:
        """Book passes over `pixels` texels together, with `reads` texel reads each."""
        self.passes[self._stage] += passes
        self.texel_reads[self._stage] += pixels * reads
        self.texel_writes[self._stage] += pixels

    def take(self) -> dict[str, float]:
        """Milliseconds by stage since the last call; starts anew."""
        totals = dict(self.milliseconds)
        for book in (self.milliseconds, self.passes, self.texel_reads, self.texel_writes):
            book.clear()
        return totals


@dataclass(slots=True)
class _Stage:
    """A stage that is the outermost; there are twenty in a step, and a generator for each would take longer."""

    timings: Timings
    name: str

    def __enter__(self) -> None:
        self.timings.begin(self.name)

    def __exit__(self, *_: object) -> None:
        self.timings.end()

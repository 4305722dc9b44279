"""The trace: where the fluid at each cell's centre was a step ago."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from solver.gl.device import Device
from solver.gl.field import Field
from solver.grid import Grid
from solver.params import Walls


@dataclass(frozen=True)
class Tracing:
    """What drawing the trace takes: where to, and the defines and inputs of `trace.frag`."""

    target: Field
    defines: dict[str, Any]
    inputs: dict[str, Any]


class Trace:
    """x_d - x at cell centres, in cells (S3): drawn once for a velocity and a step, by whoever needs it first.

    Attributes:
        field: the texture.
    """

    def __init__(self, device: Device, size: tuple[int, int]) -> None:
        self.field = device.field(size, 2, "trace")
        self._dt: float | None = None  # the step that it is of

    def is_of(self, dt: float) -> bool:
        """True if it is there for this step, and the velocity has not changed since."""
        return self._dt == dt

    def begin(self, velocity: Field, dt: float, grid: Grid, walls: Walls) -> Tracing:
        """What drawing it for a velocity on MAC faces takes; from here on it is that of `dt`, until `forget`."""
        self._dt = dt
        hx, hy = grid.spacing
        return Tracing(
            self.field, walls.defines, {"velocity": velocity, "cells_a_speed": (dt / hx, dt / hy), **walls.inputs}
        )

    def forget(self) -> None:
        """Hear that the velocity has changed."""
        self._dt = None

    def release(self) -> None:
        self.field.release()

"""The trace: where the fluid at each cell's centre was a step ago."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from solver.gl.device import Device
from solver.gl.field import Field
from solver.grid import Grid
from solver.params import Walls
from solver.steepness import Steepness

# In each part of the trace the largest gradient of the velocity, times the time of the part, is this at most. Below 1
# trajectories do not cross (Smolarkiewicz and Pudykiewicz), and below .73 neither do those of the midpoint rule.
STRAIN = 0.5
MOST_PARTS = 16  # a bound on the cost only


@dataclass(frozen=True)
class Tracing:
    """What it takes to draw the trace: the target, and the defines and inputs of `trace.frag`."""

    target: Field
    defines: dict[str, Any]
    inputs: dict[str, Any]


class Trace:
    """x_d - x at cell centres, in cells (S3): drawn once for a velocity, a step and walls, by the first that needs it.

    Attributes:
        field: the texture.
    """

    def __init__(self, device: Device, size: tuple[int, int]) -> None:
        self.device = device
        self.field = device.field(size, 2, "trace")
        self._steepness = Steepness(device, size, "trace", FACES=1)
        self._drawn: tuple[float, Walls] | None = None  # the step and the walls that it is of

    def is_of(self, dt: float, walls: Walls) -> bool:
        """True if it is drawn for this step between these walls, and the velocity has not changed since."""
        return self._drawn == (dt, walls)

    def begin(self, velocity: Field, dt: float, grid: Grid, walls: Walls, in_parts: bool = False) -> Tracing:
        """What it takes to draw the trace of a velocity on MAC faces for `dt`; it counts as drawn until `forget`.

        `in_parts`: in as many parts as the gradient needs, which waits for the GPU; ValueError if that is too large.
        """
        hx, hy = grid.spacing
        defines, inputs = walls.defines, {"velocity": velocity, "cells_a_speed": (dt / hx, dt / hy), **walls.inputs}
        if in_parts:
            strain = self.strain(velocity, dt, grid)
            if not math.isfinite(strain):
                raise ValueError("the motion that carries the picture is too fast")
            defines = defines | {"PARTS": 1}
            inputs["parts"] = float(min(max(math.ceil(strain / STRAIN), 1), MOST_PARTS))
        self._drawn = dt, walls
        return Tracing(self.field, defines, inputs)

    def strain(self, velocity: Field, dt: float, grid: Grid) -> float:
        """The largest gradient of a velocity on MAC faces, times `dt`; waits for the GPU."""
        return dt * math.sqrt(self._steepness.of(velocity, grid.spacing))

    def forget(self) -> None:
        """Say that the velocity has changed."""
        self._drawn = None

    def release(self) -> None:
        for thing in (self.field, self._steepness):
            thing.release()

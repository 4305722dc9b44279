"""Frozen parameter objects of the solver."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Walls:
    """What the fluid does at the edges of the picture and at frozen cells.

    Attributes:
        slip: "free" glides along walls, "none" sticks to them.
        speed: tangential velocity of the left, right, top and bottom wall, for `slip="none"` (a moving lid).
    """

    slip: Literal["free", "none"] = "free"
    speed: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class FluidParams:
    """How a step is made.

    Attributes:
        walls: see `Walls`.
        drag: rate at which all motion dies away, per second; 0 is the paper's fluid.
        pressure_cycles: multigrid cycles of the projection; None: as many as leave a thousandth of the divergence.
        sweeps: Jacobi sweeps of the paper's own scheme (solver "paper"), for viscosity and for pressure each.
    """

    walls: Walls = Walls()
    drag: float = 0.0
    pressure_cycles: int | None = None
    sweeps: int = 40

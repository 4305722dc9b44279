"""Frozen parameter objects of the solver."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple


class NoSlip(NamedTuple):
    """Where fluid sticks: at the left, right, top and bottom sides of the grid, and at solid cells."""

    left: bool
    right: bool
    top: bool
    bottom: bool
    solids: bool


@dataclass(frozen=True)
class Walls:
    """What the fluid does at the sides of the grid and at frozen cells.

    Attributes:
        slip: "free" glides along walls, "none" sticks to them.
        speed: tangential velocity of the left, right, top and bottom wall, where it sticks (a moving lid).
        sticky: sides (left, right, top, bottom) that it sticks to whatever `slip` is, as those of a window do which are
            not the picture's edge.
    """

    slip: Literal["free", "none"] = "free"
    speed: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    sticky: tuple[bool, bool, bool, bool] = (False, False, False, False)

    @classmethod
    def of(cls, slip: Literal["free", "none"], at_edge: tuple[bool, bool, bool, bool]) -> Walls:
        """Those of a grid: this `slip` at the picture's edges (see `Grid.at_edge`), and all other sides stick."""
        left, right, top, bottom = at_edge
        return cls(slip, sticky=(not left, not right, not top, not bottom))

    @property
    def no_slip(self) -> NoSlip:
        """Where it sticks."""
        everywhere = self.slip == "none"
        left, right, top, bottom = (everywhere or side for side in self.sticky)
        return NoSlip(left, right, top, bottom, everywhere)

    @property
    def drag(self) -> tuple[float, ...]:
        """The speeds of the walls that it sticks to, 0 for the others."""
        return tuple(speed if sticks else 0.0 for speed, sticks in zip(self.speed, self.no_slip, strict=False))


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

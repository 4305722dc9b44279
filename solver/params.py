"""Frozen parameter objects of the solver."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Integral
from typing import Any, Literal, NamedTuple

from solver.limits import check_finite, check_type, numbers


class NoSlip(NamedTuple):
    """Where fluid sticks: at the left, right, top and bottom sides of the grid, and at solid cells."""

    left: bool
    right: bool
    top: bool
    bottom: bool
    solids: bool


@dataclass(frozen=True)
class Walls:
    """What the fluid does at the sides of the grid and at solid cells.

    Attributes:
        slip: "free" glides along walls, "none" sticks to them.
        speed: tangential velocity of the left, right, top and bottom wall, where it sticks (a moving lid).
        sticky: sides (left, right, top, bottom) that it sticks to whatever `slip` is, as those of a window do which are
            not the picture's edge.

    Raises:
        ValueError: for another slip, or speeds that are not four finite ones, none too large.
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
    def driving_speed(self) -> tuple[float, ...]:
        """The speeds of the walls that it sticks to, 0 for the others."""
        return tuple(speed if sticks else 0.0 for speed, sticks in zip(self.speed, self.no_slip, strict=False))

    @property
    def images(self) -> tuple[float, ...]:
        """The signs of the tangential velocity's images beyond the left, right, top and bottom wall."""
        return tuple(-1.0 if side else 1.0 for side in self.no_slip[:4])

    @property
    def defines(self) -> dict[str, Any]:
        """The defines of `lib/walls.glsl`."""
        return {"NO_SLIP": 1} if any(self.no_slip) else {}

    @property
    def inputs(self) -> dict[str, Any]:
        """The uniforms of `lib/walls.glsl`."""
        if not any(self.no_slip):
            return {}
        return {"wall_speed": self.speed, "wall_image": self.images}

    def __post_init__(self) -> None:
        if self.slip not in ("free", "none"):
            raise ValueError(f'walls of slip {self.slip!r} were asked for; it must be "free" or "none"')
        object.__setattr__(self, "speed", numbers("the speeds of walls", self.speed, 4))
        object.__setattr__(self, "sticky", tuple(map(bool, numbers("which walls are sticky", self.sticky, 4))))


@dataclass(frozen=True)
class FluidParams:
    """How a step is made.

    Attributes:
        walls: see `Walls`.
        drag: rate at which all motion dies away, per second; 0 is the paper's fluid.
        pressure_cycles: multigrid cycles of the projection; None: as many as leave a thousandth of the divergence.
        sweeps: Jacobi sweeps of the paper's own scheme (solver "paper"), for viscosity and for pressure each.

    Raises:
        ValueError: for a drag that is negative or beyond `LARGEST_SPEED`, or numbers of cycles or sweeps that are none.
    """

    walls: Walls = Walls()
    drag: float = 0.0
    pressure_cycles: int | None = None
    sweeps: int = 40

    def __post_init__(self) -> None:
        check_type("what the walls are", self.walls, Walls)
        check_finite("a drag", self.drag)
        if self.drag < 0:
            raise ValueError(f"a drag of {self.drag} was asked for; it must be finite and not negative")
        for what, count in (("pressure cycles", self.pressure_cycles), ("sweeps", self.sweeps)):
            if count is not None and not (isinstance(count, Integral) and count >= 1):
                raise ValueError(f"{count} {what} were asked for; it must be a whole number from 1")

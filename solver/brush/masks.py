"""Painted masks: how thick the fluid is and where it is frozen, over what the recipe sets."""

from __future__ import annotations

from typing import Any

import numpy as np

from solver.brush.tip import Tip
from solver.gl.device import Device
from solver.gl.field import DoubleField, Field
from solver.grid import Grid
from solver.scheme import LARGEST_VISCOSITY, Scheme, State, check_finite

# Decades that painting may thin or thicken the fluid by, and the viscosity it starts from where there is none.
THINNEST, THICKEST = -3.0, 5.0
LEAST_VISCOSITY = 1e-6


class Masks:
    """Thickness (decades of viscosity) and frozenness painted by hand, and the base they are painted over.

    Args:
        device: where they live.
        grid: of the fluid they are for.
    """

    def __init__(self, device: Device, grid: Grid) -> None:
        self.device = device
        self.grid = grid
        self.base_viscosity = device.field(grid.size, 1, "base viscosity")
        self.base_frozen = device.field(grid.size, 1, "base frozen")
        self.thickness = device.double_field(grid.size, 1, "painted thickness")
        self.frozen = device.double_field(grid.size, 1, "painted frozen")

    def set_base(self, viscosity: np.ndarray | float, frozen: np.ndarray | None = None) -> None:
        """Set what is painted over: viscosity in lengths^2 / s, and frozen cells, each (ny, nx)."""
        shape = (self.grid.ny, self.grid.nx)
        self.base_viscosity.set(np.broadcast_to(np.asarray(viscosity, np.float32), shape))
        self.base_frozen.set(np.zeros(shape, np.float32) if frozen is None else np.asarray(frozen, np.float32))

    def thicken(self, tip: Tip, decades: float) -> None:
        """Thicken by `decades` at the tip's centre; negative thins."""
        check_finite("a thickening", decades)
        self._paint(self.thickness, tip, more=decades, limits=(THINNEST, THICKEST))

    def freeze(self, tip: Tip, amount: float) -> None:
        """Freeze by `amount` (0-1); negative thaws."""
        check_finite("a freezing", amount)
        self._paint(self.frozen, tip, mix=min(abs(amount), 1.0), towards=1.0 if amount > 0 else -1.0)

    def smooth(self, tip: Tip, strength: float) -> None:
        """Smooth both masks under the tip."""
        check_finite("a smoothing", strength)
        for mask in (self.thickness, self.frozen):
            inputs = tip.inputs(self.grid)
            self.device.pass_("brush/smooth.frag")(mask.write, mask=mask.read, strength=strength, **inputs)
            mask.swap()

    def clear(self) -> None:
        """Take all paint off."""
        self.thickness.read.clear()
        self.frozen.read.clear()

    def apply(self, fluid: Scheme) -> None:
        """Give the fluid its viscosity and solid cells; the next step takes them up.

        Solid are the frozen cells and those within two of them, so that with `WarpMap.hold` no bit of a picture changes
        in a frozen cell.
        """
        self.device.pass_("step/compose_masks.frag")(
            (fluid.viscosity, fluid.solid),
            base_viscosity=self.base_viscosity,
            base_frozen=self.base_frozen,
            thickness=self.thickness.read,
            frozen=self.frozen.read,
            least=LEAST_VISCOSITY,
            most=LARGEST_VISCOSITY,
        )
        fluid.masks_changed()

    def save(self) -> State:
        """A copy of the painted fields, on the GPU, which the caller releases."""
        return State.of(self.device, self._live())

    def restore(self, state: State) -> None:
        """Go back to a saved state; call `apply` after it."""
        state.write_to(self._live())

    def _live(self) -> dict[str, Field]:
        return {"thickness": self.thickness.read, "frozen": self.frozen.read}

    def release(self) -> None:
        for item in (self.base_viscosity, self.base_frozen, self.thickness, self.frozen):
            item.release()

    def _paint(self, mask: DoubleField, tip: Tip, **inputs: Any) -> None:
        inputs = {"more": 0.0, "mix": 0.0, "towards": 0.0, "limits": (-1.0, 1.0), **inputs, **tip.inputs(self.grid)}
        self.device.pass_("brush/paint.frag")(mask.write, mask=mask.read, **inputs)
        mask.swap()

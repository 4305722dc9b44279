"""The bound on the energy of a step (S5), which makes it stable at any length."""

from __future__ import annotations

import math
from typing import Any

from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.reduction import SIDE, Reduction, blocks_of
from solver.limits import LARGEST_SPEED
from solver.packing import PackedFaces


class EnergyBound:
    """Scales w3 down where it has more energy than w1.

    Exact advection keeps energy and viscosity takes it, but a semi-Lagrangian step reads some places more often than
    others, and so may create some; see (S6).

    Args:
        device: the device.
        cells: of the grid.
        packed: (width, height) of packed faces.
    """

    def __init__(self, device: Device, cells: int, packed: tuple[int, int]) -> None:
        self.device = device
        self._cells = cells
        blocks = blocks_of(packed)
        self._squares = device.field(blocks, 2, "energies")
        self._sum = Reduction(device, blocks, 2, "sum")
        self._bounded = PackedFaces(device, packed, "bounded velocity")

    def apply(
        self, w3: PackedFaces, before: Field, wall_speed: float = 0.0, weights: dict[str, Any] | None = None
    ) -> PackedFaces:
        """w3, scaled to no more than the energy `before` (|w1|^2 of each texel) and that of all fluid at `wall_speed`.

        `weights`: the open parts of faces, which weight the squares; see `Projection.weights`.

        Raises:
            ValueError: if either is not finite, or too large.
        """
        energy = self.device.pass_("step/energy.frag", **({"PARTIAL": 1} if weights else {}))
        energy(self._squares, **w3.inputs(), departed=before, side=SIDE, **(weights or {}))
        after, departed = self._sum(self._squares).tolist()
        if not (departed <= 2 * self._cells * LARGEST_SPEED**2 and math.isfinite(after)):
            raise ValueError("the forces and brushes of this step are too large")
        most = math.sqrt(departed) + wall_speed * math.sqrt(self._cells)
        if math.sqrt(after) <= most:
            return w3
        scale = self.device.pass_("step/scale.frag")
        scale(self._bounded.fields, **w3.inputs(), factor=most / math.sqrt(after))
        return self._bounded

    def release(self) -> None:
        for item in (self._squares, self._sum, self._bounded):
            item.release()

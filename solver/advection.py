"""Advection: the fluid carries itself, semi-Lagrangian and cubic."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from solver.gl.device import Device
from solver.gl.field import Field
from solver.packing import PackedFaces, Packing
from solver.params import Walls


@dataclass(frozen=True)
class Blocks:
    """w1, 2 x 2 faces a texel, as the cubic reads it; see `depart.frag`."""

    u: Field
    v: Field


@dataclass(frozen=True)
class Advected:
    """w2 on packed faces, and |w1|^2 of the faces in each texel, which bounds what w3 may have."""

    faces: PackedFaces
    energy: Field


class Advection:
    """w2(x) = decay w1(x_d) on packed faces, from w1 = w0 - g + dt f.

    Args:
        device: the device.
        size: (nx, ny) cells.
        packed: (width, height) of packed faces.
    """

    def __init__(self, device: Device, size: tuple[int, int], packed: tuple[int, int]) -> None:
        self.device = device
        self.size = nx, ny = size
        laid = nx + 4, (ny + 1) // 2 + 3
        self._blocks = Blocks(device.field(laid, 4, "blocks of u"), device.field(laid, 4, "blocks of v"))
        self._energy = device.field(packed, 1, "energy before advection")

    def depart(self, velocity: Field, walls: Walls, **terms: Any) -> Blocks:
        """w1, from w0 on MAC faces and, if they are given, `carried`, and `force` and its `impulse`."""
        targets, (nx, ny) = (self._blocks.u, self._blocks.v), self.size
        width, height = self._blocks.u.size
        # Texels with all faces inside: none beyond a wall or on one.
        left, right, above, below = 3, nx + 1, 2, ny // 2 + 1
        inside = (left, above, right - left, below - above)
        around = [(0, 0, width, above), (0, below, width, height - below)]
        around += [(0, above, left, below - above), (right, above, width - right, below - above)]
        defines = {name.upper(): 1 for name in terms if name != "impulse"}
        self.device.pass_("step/depart.frag", **defines)(targets, region=inside, velocity=velocity, **terms)
        edges = self.device.pass_("step/depart.frag", EDGES=1, **defines, **walls.defines)
        edges(targets, region=around, velocity=velocity, **terms, **walls.inputs)
        return self._blocks

    def advect(
        self,
        w1: Blocks,
        trace: Field,
        decay: float,
        target: PackedFaces,
        packing: Packing,
        weights: dict[str, Any] | None = None,
    ) -> Advected:
        """Draw w2 into `target`: each component `decay` times what it is where its own face departs.

        `weights`: the open parts of faces, see `Projection.weights`; without, all are open or closed.
        """
        partial = {"PARTIAL": 1} if weights else {}
        advect = self.device.pass_("step/advect.frag", **packing.defines, **partial)
        targets, inputs = (*target.fields, self._energy), packing.open | (weights or {})
        advect(targets, region=packing.region, blocks_u=w1.u, blocks_v=w1.v, trace=trace, decay=decay, **inputs)
        return Advected(target, self._energy)

    def release(self) -> None:
        for field in (self._blocks.u, self._blocks.v, self._energy):
            field.release()

"""Largest values and sums of a field, found on the GPU and read back as a few numbers."""

from __future__ import annotations

from typing import Literal

import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field

SIDE = 8  # texels along the blocks that become one
_READABLE = 40  # texels across that are cheaper to read back than to shrink again


def blocks_of(size: tuple[int, int]) -> tuple[int, int]:
    """How many blocks there are across and down."""
    return -(-size[0] // SIDE), -(-size[1] // SIDE)


class Reduction:
    """The largest value or the sum of every component of fields of one size.

    Args:
        device: the device.
        size: (width, height) of the fields.
        components: of the fields, 1-4.
        kind: "max" or "sum". The smallest value is the negative of the largest negative.
    """

    def __init__(self, device: Device, size: tuple[int, int], components: int, kind: Literal["max", "sum"]) -> None:
        self._kind = kind
        self._shrink = device.pass_("gl/shrink.frag", **({"SUM": 1} if kind == "sum" else {}))
        self._levels: list[Field] = []
        while max(size) > _READABLE:
            size = blocks_of(size)
            self._levels.append(device.field(size, components, f"{kind} {size[0]} x {size[1]}"))

    def __call__(self, field: Field) -> np.ndarray:
        """One number a component, float64; waits for the GPU."""
        for level in self._levels:
            self._shrink(level, field=field, side=SIDE)
            field = level
        values = field.get().reshape(-1, field.components)
        if self._kind == "max":
            return values.max(axis=0).astype(np.float64)
        with np.errstate(invalid="ignore"):  # the caller checks whether the sum is finite
            return values.sum(axis=0, dtype=np.float64)

    def release(self) -> None:
        """Free the textures."""
        for level in self._levels:
            level.release()

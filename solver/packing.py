"""Packed faces: u and v of the MAC grid, 2 x 2 of them a texel, inside a ring of zeros."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.passes import Region


class PackedFaces:
    """Packed faces: u and v, 2 x 2 a texel, inside a ring of zeros (see shaders/viscosity/operator.glsl)."""

    def __init__(self, device: Device, size: tuple[int, int], label: str) -> None:
        self.u = device.field(size, 4, f"{label} u")
        self.v = device.field(size, 4, f"{label} v")

    @property
    def fields(self) -> tuple[Field, Field]:
        return self.u, self.v

    def inputs(self, name: str = "") -> dict[str, Any]:
        """The pair as a pass's inputs `<name>u` and `<name>v`."""
        return {f"{name}u": self.u, f"{name}v": self.v}

    def release(self) -> None:
        self.u.release()
        self.v.release()


@dataclass(frozen=True)
class Packing:
    """What a pass needs to draw packed faces: where, its defines, and the inputs that tell the open ones."""

    region: Region
    defines: dict[str, Any]
    open: dict[str, Any]


class DoublePackedFaces:
    """A ping-pong of pairs: `read`, `write` and `swap()`."""

    def __init__(self, device: Device, size: tuple[int, int], label: str) -> None:
        self.read = PackedFaces(device, size, f"{label} a")
        self.write = PackedFaces(device, size, f"{label} b")

    def swap(self) -> None:
        self.read, self.write = self.write, self.read

    def release(self) -> None:
        self.read.release()
        self.write.release()


def unpacked(texels: np.ndarray) -> np.ndarray:
    """Cells in their places, (2 h, 2 w), from texels of 2 x 2 of them, (h, w, 4)."""
    height, width = texels.shape[:2]
    return texels.reshape(height, width, 2, 2).transpose(0, 2, 1, 3).reshape(2 * height, 2 * width)


def packed(cells: np.ndarray) -> np.ndarray:
    """Texels of 2 x 2 cells, (height / 2, width / 2, 4), from cells in their places."""
    height, width = cells.shape
    texels = np.empty((height // 2, width // 2, 4), cells.dtype)
    for place in range(4):
        texels[..., place] = cells[place // 2 :: 2, place % 2 :: 2]
    return texels


def framed(values: np.ndarray, rows: tuple[int, int], columns: tuple[int, int]) -> np.ndarray:
    """Values (h, w) with so many rows and columns of zeros before and after; five times as fast as `np.pad`."""
    height, width = values.shape
    framed = np.zeros((height + sum(rows), width + sum(columns)), values.dtype)
    framed[rows[0] : rows[0] + height, columns[0] : columns[0] + width] = values
    return framed


# A transform is used up to so many products of 2 x 2 blocks, the cost of about one multigrid cycle; on the finest
# level, where it replaces two or three cycles and their sums, up to eight times as many (128 x 128 cells). While
# someone paints, the viscous step and the projection so take .44 and .49 of the processor time at 96 x 76 cells, .67
# and .75 at 128 x 101; at 192 x 151 they would take 1.35 and .99.
LARGEST_TRANSFORM = 65536
LARGEST_TRANSFORM_OF_FINEST = 8 * LARGEST_TRANSFORM


def is_worth_a_transform(blocks: tuple[int, int], is_finest: bool) -> bool:
    """True if a level of (width, height) blocks of 2 x 2 cells is small enough for products with dense matrices."""
    largest = LARGEST_TRANSFORM_OF_FINEST if is_finest else LARGEST_TRANSFORM
    return blocks[0] * blocks[1] * (blocks[0] + blocks[1]) <= largest

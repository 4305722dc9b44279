"""Grids without solids, solved exactly by fast diagonalization."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from solver.packing import packed

if TYPE_CHECKING:
    from solver.gl.device import Device
    from solver.gl.field import Field


class FastDiagonalization:
    """Solves A p = r on a level without solids.

    The matrix is -(K_x (x) M_y + aspect^2 M_x (x) K_y), with M the cells' sides, in cells, and K the links between them
    along one axis. With S' M S = 1 and S' K S = diag(k), p = S_x (S_x' r S_y / -(k_x + aspect^2 k_y)) S_y' (Lynch, Rice
    and Thomas, Numer. Math. 6, 1964); where all cells are whole, S is the cosine transform. Four products with small
    matrices.

    Args:
        device: the device.
        span: size of the grid in cells; the last ones may be less than whole.
        size: in blocks of 2 x 2 cells.
        aspect: side of a cell along x over that along y.
    """

    def __init__(self, device: Device, span: tuple[float, float], size: tuple[int, int], aspect: float) -> None:
        self.device = device
        across, down = (_modes(length, 2 * blocks) for length, blocks in zip(span, size, strict=True))
        self._across, self._across_back = (device.upload(packed(m), "modes across") for m in (across[0].T, across[0]))
        self._down, self._down_back = (device.upload(packed(m), "modes down") for m in (down[0].T, down[0]))
        rates = across[1] + aspect**2 * down[1][:, None]
        scale = np.where(rates > 1e-9, -1.0 / np.maximum(rates, 1e-9), 0.0)
        self._scale = device.upload(packed(scale), "inverse rates")
        self._half, self._modes = (device.field(size, 4, f"pressure {name}") for name in ("halfway", "modes"))

    def solve(self, residual: Field, pressure: Field) -> None:
        """Solve A `pressure` = `residual`, both at blocks."""
        across = self.device.pass_("pressure/transform.frag")
        down = self.device.pass_("pressure/transform.frag", DOWN=1)
        scaled = self.device.pass_("pressure/transform.frag", DOWN=1, SCALED=1)
        across(self._half, field=residual, matrix=self._across)
        scaled(self._modes, field=self._half, matrix=self._down, scale=self._scale)
        down(self._half, field=self._modes, matrix=self._down_back)
        across(pressure, field=self._half, matrix=self._across_back)

    def release(self) -> None:
        """Free the textures."""
        for field in (self._across, self._across_back, self._down, self._down_back, self._scale):
            field.release()
        self._half.release()
        self._modes.release()


@lru_cache(16)
def _modes(span: float, padded: int) -> tuple[np.ndarray, np.ndarray]:
    """Of one axis: S and k, with zeros up to `padded` cells."""
    count = int(np.ceil(span))
    sides = np.minimum(span - np.arange(count), 1.0)
    ones = np.ones(count - 1)
    matrix = np.diag(np.r_[ones, 0.0] + np.r_[0.0, ones]) - np.diag(ones, 1) - np.diag(ones, -1)
    root = np.sqrt(sides)
    rates, vectors = np.linalg.eigh(matrix / (root * root[:, None]))
    padding = 0, padded - count
    return np.pad(vectors / root[:, None], padding), np.pad(np.maximum(rates, 0.0), padding)

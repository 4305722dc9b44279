"""Grids without solids, solved exactly: along x and y the equations fall apart into waves."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from solver.gl.device import Device
    from solver.gl.field import Field

# Products of blocks that one solve is worth; a finer grid is left to multigrid.
LARGEST = 65536


class Separable:
    """Solves sum over the faces of openness times (p' - p) = r on a grid of blocks of 2 x 2 cells without solids.

    The matrix is K_x (x) M_y + M_x (x) K_y, with M the sides of the cells and K the links between them along one axis.
    With S' M S = 1 and S' K S diagonal, p = S_x (S_x' r S_y / -(k_x + k_y)) S_y': fast diagonalisation, Lynch, Rice and
    Thomas, Numer. Math. 6 (1964). Four products with small matrices.

    Args:
        device: the device.
        span: size of the grid in cells; the last ones are narrower where it is not whole.
        size: in blocks.
    """

    def __init__(self, device: Device, span: tuple[float, float], size: tuple[int, int]) -> None:
        self.device = device
        across, down = (_waves(length, blocks) for length, blocks in zip(span, size, strict=True))
        self._across, self._across_back = (device.upload(_blocks(m), "waves across") for m in across[:2])
        self._down, self._down_back = (device.upload(_blocks(m), "waves down") for m in down[:2])
        rates = across[2] + down[2][:, None]
        scale = np.where(rates > 1e-9, -1.0 / np.maximum(rates, 1e-9), 0.0)
        self._scale = device.upload(_blocks(scale), "inverse rates")
        self._half, self._waves = (device.field(size, 4, f"pressure {name}") for name in ("halfway", "waves"))

    @staticmethod
    def is_worth(size: tuple[int, int]) -> bool:
        """True if a grid of so many blocks is small enough."""
        return _products(size) <= LARGEST

    def solve(self, residual: Field, pressure: Field) -> None:
        """The `pressure` that accounts for all of `residual`, both at blocks."""
        across = self.device.pass_("pressure/transform.frag")
        down = self.device.pass_("pressure/transform.frag", DOWN=1)
        scaled = self.device.pass_("pressure/transform.frag", DOWN=1, SCALED=1)
        across(self._half, field=residual, matrix=self._across)
        scaled(self._waves, field=self._half, matrix=self._down, scale=self._scale)
        down(self._half, field=self._waves, matrix=self._down_back)
        across(pressure, field=self._half, matrix=self._across_back)

    def release(self) -> None:
        """Free the textures."""
        for field in (self._across, self._across_back, self._down, self._down_back, self._scale):
            field.release()
        self._half.release()
        self._waves.release()


def _products(size: tuple[int, int]) -> int:
    return size[0] * size[1] * (size[0] + size[1])


def _waves(span: float, blocks: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of one axis: S', S and the diagonal of S' K S, padded with zeros to whole blocks."""
    count = int(np.ceil(span))
    sides = np.minimum(span - np.arange(count), 1.0)
    links = 2.0 / (1.0 + sides[1:])
    matrix = np.diag(np.r_[links, 0.0] + np.r_[0.0, links]) - np.diag(links, 1) - np.diag(links, -1)
    root = np.sqrt(sides)
    rates, vectors = np.linalg.eigh(matrix / (root * root[:, None]))
    padding = 2 * blocks - count
    shapes = np.pad(vectors / root[:, None], (0, padding))
    return shapes.T, shapes, np.pad(np.maximum(rates, 0.0), (0, padding))


def _blocks(cells: np.ndarray) -> np.ndarray:
    """(2 h, 2 w) -> (h, w, 4), a texel for each block of 2 x 2."""
    height, width = cells.shape
    return cells.reshape(height // 2, 2, width // 2, 2).transpose(0, 2, 1, 3).reshape(height // 2, width // 2, 4)

"""How far the cells of a fluid are from what is closed."""

from __future__ import annotations

import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field, FieldPool
from solver.grid import Grid
from solver.scheme import Scheme


class Distance:
    """Of the middle of each cell from what is closed wholly, in lengths; found anew once that has changed."""

    def __init__(self, device: Device) -> None:
        self._fields = FieldPool(device, "distance")
        self._of: tuple[Grid, np.ndarray] | None = None
        self._found = np.zeros((1, 1), np.float32)

    def of(self, fluid: Scheme) -> Field:
        """Of the cells of a fluid that has some closed."""
        closed, grid = fluid.closed, fluid.grid
        field = self._fields.get("closed", grid.size, 1)
        if self._of is None or self._of[0] != grid or not np.array_equal(self._of[1], closed):
            self._found = distances(closed, grid)
            field.set(self._found)
            self._of = grid, closed
        return field

    def at(self, fluid: Scheme, places: np.ndarray) -> np.ndarray:
        """Of places, (n, 2) in longer sides, between the middles of cells; (n,)."""
        from scipy import ndimage

        self.of(fluid)
        cells = (places - fluid.grid.origin) / fluid.grid.spacing - 0.5
        return ndimage.map_coordinates(self._found, cells.T[::-1], order=1, mode="nearest")

    def release(self) -> None:
        """Free the textures."""
        self._fields.release()


def distances(closed: np.ndarray, grid: Grid) -> np.ndarray:
    """Lengths of the cells' middles from what is closed wholly, (ny, nx) float32.

    closed: how far each cell is, 255 wholly and less and less over a cell more, (ny, nx) uint8, not all zero.
    """
    from scipy import ndimage  # a third of what a process needs until it can begin

    (hx, hy), (ny, nx) = grid.spacing, closed.shape
    nearest = np.empty((2, ny, nx), np.int32)
    ndimage.distance_transform_edt(closed == 0, (hy, hx), return_distances=False, return_indices=True, indices=nearest)
    row, column = nearest
    y, x = np.ogrid[:ny, :nx]
    open_part = 1 - closed[row, column] / 255
    return (np.hypot((x - column) * hx, (y - row) * hy) + open_part * grid.h).astype(np.float32)

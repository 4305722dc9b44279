"""The simulation's grid: square cells over a picture whose longer side is 1."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SMALLEST_GRID = 8


@dataclass(frozen=True)
class Grid:
    """`nx x ny` square cells of side `h = 1 / max(nx, ny)`; x to the right, y down, row 0 on top."""

    nx: int
    ny: int

    def __post_init__(self) -> None:
        if min(self.nx, self.ny) < SMALLEST_GRID:
            raise ValueError(f"a grid of {self.nx} x {self.ny} is below {SMALLEST_GRID} x {SMALLEST_GRID}")

    @classmethod
    def for_picture(cls, width: int, height: int, cells: int) -> Grid:
        """The grid with `cells` along the longer side of a picture of `width x height` pixels.

        The shorter side is rounded to whole cells, and to at least 8 of them, and the picture is fitted to the grid:
        its aspect is off by at most half a cell.
        """
        longer = max(width, height)
        return cls(
            max(SMALLEST_GRID, round(cells * width / longer)),
            max(SMALLEST_GRID, round(cells * height / longer)),
        )

    @property
    def size(self) -> tuple[int, int]:
        """(nx, ny), as a field's size."""
        return self.nx, self.ny

    @property
    def h(self) -> float:
        """Side of a cell, in longer sides of the picture."""
        return 1.0 / max(self.nx, self.ny)

    @property
    def spacing(self) -> tuple[float, float]:
        """(hx, hy): the sides of a cell, in longer sides of the picture."""
        return self.h, self.h

    @property
    def extent(self) -> tuple[float, float]:
        """(width, height) of the domain, the longer of them 1."""
        return self.nx * self.h, self.ny * self.h

    def centres(self) -> tuple[np.ndarray, np.ndarray]:
        """x and y of the cell centres, float64, each (ny, nx)."""
        return self._points(0.5, 0.5)

    def u_faces(self) -> tuple[np.ndarray, np.ndarray]:
        """x and y of the left faces, where u lives, each (ny, nx)."""
        return self._points(0.0, 0.5)

    def v_faces(self) -> tuple[np.ndarray, np.ndarray]:
        """x and y of the upper faces, where v lives, each (ny, nx)."""
        return self._points(0.5, 0.0)

    def nodes(self) -> tuple[np.ndarray, np.ndarray]:
        """x and y of the upper left corners, each (ny, nx)."""
        return self._points(0.0, 0.0)

    def _points(self, dx: float, dy: float) -> tuple[np.ndarray, np.ndarray]:
        x, y = np.meshgrid((np.arange(self.nx) + dx) * self.h, (np.arange(self.ny) + dy) * self.h)
        return x, y

"""The simulation's grid: cells over a picture whose longer side is 1, or over a window of it."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np

from solver.limits import check_type, numbers

SMALLEST_GRID = 8
ROUNDING = 1e-9  # longer sides
# A cell's longer side over its shorter one: its links count 1 and the square of that, and float32 has 24 bits for both.
LARGEST_ASPECT = 1024
MOST_ALONG = 4096  # cells that a narrow picture gets along it: twice as many texels of the map a GL must have


@dataclass(frozen=True)
class Grid:
    """`nx x ny` cells over a picture whose longer side is 1, or a window of it; x to the right, y down, row 0 on top.

    Attributes:
        nx, ny: whole cells along the width and the height, each from 8.
        extent: (width, height) of what they cover, in longer sides of the picture; by default that of square cells. The
            cells divide it evenly, so that they are a little wider or narrower than high where it is no whole number of
            squares.
        origin: the top left corner of what they cover.
        picture: (width, height) of the picture, the longer of them 1; by default the cells cover all of it.

    Raises:
        ValueError: on fewer cells, ones far longer than wide, a picture whose longer side is not 1, or a window that
            reaches beyond it.
    """

    nx: int
    ny: int
    extent: tuple[float, float] = (0.0, 0.0)
    origin: tuple[float, float] = (0.0, 0.0)
    picture: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("nx", "ny"):
            check_type("a count of cells", count := getattr(self, name))
            if not (count >= SMALLEST_GRID and count % 1 == 0):
                raise ValueError(
                    f"a grid of {self.nx} x {self.ny} is none of whole cells, or below {SMALLEST_GRID} x "
                    f"{SMALLEST_GRID}"
                )
            object.__setattr__(self, name, int(count))
        for name in ("extent", "origin", "picture"):
            object.__setattr__(self, name, numbers(f"a grid's {name} in the picture", getattr(self, name), 2))
        if self.extent == (0.0, 0.0):
            longer = max(self.nx, self.ny)
            object.__setattr__(self, "extent", (self.nx / longer, self.ny / longer))
        if self.picture == (0.0, 0.0):
            object.__setattr__(self, "picture", self.extent)
        if not (all(0.0 < side <= 1.0 for side in self.picture) and max(self.picture) == 1.0):
            raise ValueError(f"a picture of {self.picture} longer sides: the longer must be 1, the other above 0")
        within = (
            start >= 0.0 < side and start + side <= whole + ROUNDING
            for start, side, whole in zip(self.origin, self.extent, self.picture, strict=True)
        )
        if not all(within):
            raise ValueError(f"a window of {self.extent} at {self.origin} is not within a picture of {self.picture}")

        longer, shorter = max(self.spacing), min(self.spacing)
        if longer > LARGEST_ASPECT * shorter:
            raise ValueError(f"cells of {longer:.4g} x {shorter:.4g}: their sides are more than {LARGEST_ASPECT} to 1")

    @classmethod
    def for_picture(cls, width: int, height: int, cells: int) -> Grid:
        """The grid with `cells` along the longer side of a picture of `width x height` pixels, laid over exactly that.

        The shorter side is rounded to whole cells, which are then a little wider or narrower than high. A picture so
        narrow that it would have fewer than 8 of them there gets more along it instead, up to `MOST_ALONG`.
        """
        for count in (width, height, cells):
            check_type("a count of pixels or cells", count)
        longer, shorter = max(width, height), min(width, height)
        if not min(shorter, cells) >= 1:
            raise ValueError(f"{cells} cells along a picture of {width} x {height} pixels were asked for")
        along = max(cells, min(ceil(SMALLEST_GRID * longer / shorter), MOST_ALONG))
        nx, ny = (max(SMALLEST_GRID, round(along * side / longer)) for side in (width, height))
        return cls(nx, ny, (width / longer, height / longer))

    def refined(self, times: int) -> Grid:
        """The grid with so many cells for each of these along each axis."""
        return Grid(self.nx * times, self.ny * times, self.extent, self.origin, self.picture)

    @property
    def is_whole(self) -> bool:
        """True if the cells cover the whole picture."""
        return self.origin == (0.0, 0.0) and self.extent == self.picture

    @property
    def at_edge(self) -> tuple[bool, bool, bool, bool]:
        """Whether the left, right, top and bottom sides lie on the picture's own edges."""
        (left, top), (width, height), (right, bottom) = self.origin, self.extent, self.picture
        return left == 0.0, left + width >= right - ROUNDING, top == 0.0, top + height >= bottom - ROUNDING

    @property
    def size(self) -> tuple[int, int]:
        """(nx, ny), as a field's size."""
        return self.nx, self.ny

    @property
    def spacing(self) -> tuple[float, float]:
        """(width, height) of a cell, in longer sides of the picture."""
        return self.extent[0] / self.nx, self.extent[1] / self.ny

    @property
    def h(self) -> float:
        """The longer side of a cell, for what needs no more than its scale."""
        return max(self.spacing)

    def centres(self) -> tuple[np.ndarray, np.ndarray]:
        """x and y of the cell centres in the picture, float64, each (ny, nx)."""
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
        (left, top), (width, height), (nx, ny) = self.origin, self.extent, self.size
        x, y = np.meshgrid(left + (np.arange(nx) + dx) / nx * width, top + (np.arange(ny) + dy) / ny * height)
        return x, y

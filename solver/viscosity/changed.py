"""Where a mask has changed since it was last taken up, and how far that reaches on the coarser levels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

# Coarse cells on each side of a changed one whose couplings change too: they are made of those of the four fine rows
# around each, every coupling kept where it begins.
REACH = 1


class Box(NamedTuple):
    """Cells of a level: rows from `top` to before `bottom`, columns from `left` to before `right`."""

    top: int
    bottom: int
    left: int
    right: int

    @property
    def cells(self) -> tuple[slice, slice]:
        return slice(self.top, self.bottom), slice(self.left, self.right)

    @property
    def nodes(self) -> tuple[slice, slice]:
        """The corners of the cells."""
        return slice(self.top, self.bottom + 1), slice(self.left, self.right + 1)

    @property
    def finer(self) -> Box:
        """The same place on the next finer level."""
        return Box(*(2 * edge for edge in self))

    @property
    def texels(self) -> Box:
        """The same place in texels of 2 x 2 cells."""
        return Box(*(edge // 2 for edge in self))

    def grown(self, by: int, shape: tuple[int, ...]) -> Box:
        """So many cells more on all sides, and out to whole texels of 2 x 2, within an even (rows, columns)."""
        bottom, right = (min(-(-(end + by) // 2) * 2, length) for end, length in zip(self[1::2], shape, strict=True))
        top, left = (max((start - by) // 2 * 2, 0) for start in self[::2])
        return Box(top, bottom, left, right)

    def coarser(self, shape: tuple[int, ...]) -> Box:
        """The cells of the next coarser level, (rows, columns), that change with these."""
        bottom, right = (min(-(-end // 2) + REACH, length) for end, length in zip(self[1::2], shape, strict=True))
        top, left = (max(start // 2 - REACH, 0) for start in self[::2])
        return Box(top, bottom, left, right)

    def within(self, outer: Box) -> Box:
        """The same place counted from the first cell of `outer`."""
        return Box(self.top - outer.top, self.bottom - outer.top, self.left - outer.left, self.right - outer.left)


def whole(shape: tuple[int, ...]) -> Box:
    return Box(0, shape[0], 0, shape[1])


def changed(before: np.ndarray, after: np.ndarray) -> Box | None:
    """The smallest box with all cells that differ, None if none does."""
    differs = before != after
    rows, columns = (np.flatnonzero(differs.any(axis=axis)) for axis in (1, 0))
    return Box(int(rows[0]), int(rows[-1]) + 1, int(columns[0]), int(columns[-1]) + 1) if len(rows) else None

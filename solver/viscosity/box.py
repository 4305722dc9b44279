"""Where a mask has changed since it was last taken up, and which cells of coarser levels that changes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from solver.gl.passes import differing


class Box(NamedTuple):
    """Cells of a level: rows from `top` to before `bottom`, columns from `left` to before `right`."""

    top: int
    bottom: int
    left: int
    right: int

    @property
    def coarser(self) -> Box:
        """The cells of the next coarser level that change with these: one is made of the four fine rows around it."""
        (top, left), (bottom, right) = self[::2], self[1::2]
        return Box(top // 2 - 1, -(-bottom // 2) + 1, left // 2 - 1, -(-right // 2) + 1)


def changed(before: np.ndarray, after: np.ndarray) -> Box | None:
    """The smallest box with all cells (ny, nx) that differ, None if none does."""
    region = differing(before, after)
    if region is None:
        return None
    x, y, width, height = region
    return Box(y, y + height, x, x + width)

"""A brush tip on its path."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from solver.gl.passes import Region
from solver.grid import Grid
from solver.limits import check_type

Point = tuple[float, float]

# Longer sides: how far off the picture a tip may be, and how large, and how small.
FARTHEST, SMALLEST = 100.0, 1e-6

# Radii within which a tip that is `near` takes back what it does to the rest.
NEAR = 4.0


@dataclass(frozen=True)
class Tip:
    """A brush tip on its path from `start` to `end` within one tick.

    Attributes:
        start, end: places, in lengths (the longer side of the picture is 1), y down.
        radius: in lengths.
        hardness: 0 is a soft falloff, 1 a core of nine tenths of the radius.
        near: it takes back within `NEAR` radii the area and the momentum that it gives, so that the rest feels nothing.

    Raises:
        ValueError: if a number is not finite, or beyond all measure, or the radius is not positive.
    """

    start: Point
    end: Point
    radius: float
    hardness: float = 0.0
    near: bool = False

    def __post_init__(self) -> None:
        for what, place in (("start", self.start), ("end", self.end)):
            if not (isinstance(place, (tuple, Sequence, np.ndarray)) and len(place) == 2):
                raise ValueError(f"a brush's {what} is {place!r}, a place (x, y) is wanted")
        places = (*self.start, *self.end)
        for number in (*places, self.radius, self.hardness):
            check_type("a number of a brush", number)
        if not all(abs(place) <= FARTHEST for place in places):
            raise ValueError(
                f"a brush from {self.start} to {self.end} is off the picture by more than {FARTHEST:g} sides"
            )
        if not SMALLEST <= self.radius <= FARTHEST:
            raise ValueError(f"a brush of radius {self.radius} was given; it must be from 1e-06 to {FARTHEST:g}")
        if math.isnan(self.hardness):
            raise ValueError("a brush's hardness must be a number from 0 to 1")

    @property
    def wide(self) -> Tip:
        """The soft one on the same path under which it takes back."""
        return replace(self, radius=NEAR * self.radius, hardness=0.0)

    def inputs(self, grid: Grid) -> dict[str, Any]:
        """The uniforms of `lib/brush.glsl`, from the corner of the grid."""
        left, top = grid.origin
        return {
            "segment": (self.start[0] - left, self.start[1] - top, self.end[0] - left, self.end[1] - top),
            "radius": self.radius,
            "hardness": min(max(self.hardness, 0.0), 1.0),
            "spacing": grid.spacing,
        }

    def region(self, grid: Grid) -> Region:
        """The cells it touches, with one to spare."""
        sides = zip(self.start, self.end, grid.origin, grid.spacing, strict=True)
        ends = [(min(a, b) - first, max(a, b) - first, h) for a, b, first, h in sides]
        low = [math.floor((least - self.radius) / h) - 1 for least, _, h in ends]
        high = [math.ceil((most + self.radius) / h) + 2 for _, most, h in ends]
        return low[0], low[1], high[0] - low[0], high[1] - low[1]

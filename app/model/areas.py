"""Areas of the picture: by shape, by colour or by brightness, added to one another and taken away."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from app.model.sampling import SOURCE, NamedPictures, Point, Segment, Window, places
from app.model.schema import Model, Several
from solver.grid import Grid

Seen = Callable[[np.ndarray, Grid], np.ndarray]
"""Values of the picture as it was, on a grid's cells, taken to where they are seen at a moment."""

MOST_CORNERS = 50_000  # of an outline: each takes 20 microseconds


def as_it_was(values: np.ndarray, grid: Grid) -> np.ndarray:
    """The values themselves: of a picture that nothing has moved yet."""
    return values


class Area(Model):
    """What is in all of those that are given; without any, the whole picture.

    Attributes:
        window: a rectangle or an ellipse.
        outline: the corners of an area, as fractions of the picture; what it winds around an odd number of times.
        segment: what is chosen by colour or brightness, in the picture as it is seen at this moment.
        invert: what lies outside of that instead.
    """

    window: Window | None = None
    outline: Annotated[Several[Point], Field(min_length=3)] | None = None
    segment: Segment | None = None
    invert: bool = False

    @model_validator(mode="after")
    def _affordable(self) -> Self:
        if self.outline is not None and len(self.outline) > MOST_CORNERS:
            raise ValueError(f"its outline has {len(self.outline)} corners; at most {MOST_CORNERS} work")
        return self

    def coverage(self, grid: Grid, pictures: NamedPictures, seen: Seen = as_it_was) -> np.ndarray:
        """How much of each cell lies in the area, (ny, nx) in [0, 1].

        Raises:
            ValueError: if a segment chooses nothing.
        """
        covered = np.ones((grid.ny, grid.nx))
        if self.window is not None:
            covered *= self.window.weight(grid)
        if self.outline is not None:
            covered *= _inside(places(self.outline, grid), grid)
        if self.segment is not None:
            covered *= seen(self.segment.chosen(SOURCE, grid, pictures), grid)
        return 1 - covered if self.invert else covered


class Part(Area):
    """An area that is added to those before it, or taken from them; or what of them lies in it is kept.

    Attributes:
        combine: the last is "intersect".
    """

    combine: Literal["add", "subtract", "intersect"] = "add"

    def onto(self, covered: np.ndarray, share: np.ndarray) -> np.ndarray:
        """What is covered by those before it and by it, `share`, together."""
        if self.combine == "add":
            return np.maximum(covered, share)
        return np.minimum(covered, 1 - share if self.combine == "subtract" else share)

    def outside(self) -> Part:
        """What leaves, of all but what is covered before it, all but what is covered with it (De Morgan's laws)."""
        if self.combine == "intersect":
            return self.model_copy(update={"combine": "add", "invert": not self.invert})
        return self.model_copy(update={"combine": "add" if self.combine == "subtract" else "subtract"})


def inverted(parts: Sequence[Part]) -> tuple[Part, ...]:
    """The parts that cover what these leave out; the first begins with nothing."""
    first = parts[0].model_copy(update={"invert": not parts[0].invert})
    return first, *(part.outside() for part in parts[1:])


def _inside(corners: np.ndarray, grid: Grid) -> np.ndarray:
    """1 where a cell's middle lies in a polygon (n, 2), by the rule of odd and even, (ny, nx)."""
    x, y = grid.centres()
    crossed = np.zeros((grid.ny, grid.nx), np.int32)
    for ends in zip(corners.tolist(), np.roll(corners, -1, axis=0).tolist(), strict=True):
        (ax, ay), (bx, by) = sorted(ends)  # so that an edge there and back cancels out
        rows = np.flatnonzero((y[:, 0] >= min(ay, by)) & (y[:, 0] < max(ay, by)))
        if len(rows):
            at = ax + (y[rows, 0] - ay) * (bx - ax) / (by - ay)
            crossed[rows] += x[rows] > at[:, None]
    return crossed % 2

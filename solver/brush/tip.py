"""A brush tip on its path."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from solver.gl.field import Field
from solver.gl.images import MOST_IMAGES, for_images
from solver.gl.passes import Pass, Region
from solver.grid import Grid
from solver.limits import check_type

Point = tuple[float, float]

# Longer sides: how far off the picture a tip may be, and how large, and how small.
FARTHEST, SMALLEST = 100.0, 1e-6

# Radii within which a tip that is `near` takes back what it does to the rest.
NEAR = 4.0


class Path(NamedTuple):
    """Where a tip goes within one tick: places, in lengths, y down; and whether it is a mirror image of the first."""

    start: Point
    end: Point
    mirrored: bool = False


@dataclass(frozen=True)
class Tip:
    """A brush tip on its path from `start` to `end` within one tick, and on all `others` at once.

    Attributes:
        start, end: places, in lengths (the longer side of the picture is 1), y down.
        radius: in lengths.
        hardness: 0 is a soft falloff, 1 a core of nine tenths of the radius.
        near: it takes back within `NEAR` radii the area and the momentum that it gives, so that the rest feels nothing.
            Its radius is at most a quarter of the largest then.
        others: its images, by symmetry. Where they overlap, what moves the fluid is shared out among them.

    Raises:
        ValueError: if a number is not finite, or too large, or the radius is not positive, or with more than
            16 paths.
        TypeError: if one of the others is no `Path`, or what must be a number is none.
    """

    start: Point
    end: Point
    radius: float
    hardness: float = 0.0
    near: bool = False
    others: tuple[Path, ...] = ()

    def __post_init__(self) -> None:
        for path in self.others:
            check_type("an image of a brush", path, Path)
        for start, end, _ in self.paths:
            for what, place in (("start", start), ("end", end)):
                if not (isinstance(place, (tuple, Sequence, np.ndarray)) and len(place) == 2):
                    raise ValueError(f"a brush's {what} is {place!r}, a place (x, y) is wanted")
            places = (*start, *end)
            for number in places:
                check_type("a number of a brush", number)
            if not all(abs(place) <= FARTHEST for place in places):
                ends = "a brush from ({:g}, {:g}) to ({:g}, {:g})".format(*map(float, places))
                raise ValueError(f"{ends} is off the picture by more than {FARTHEST:g} sides")
        if len(self.paths) > MOST_IMAGES:
            raise ValueError(f"a brush with {len(self.paths)} images was given; it must be at most {MOST_IMAGES}")
        for number in (self.radius, self.hardness):
            check_type("a number of a brush", number)
        most = FARTHEST / NEAR if self.near else FARTHEST  # also of `wide`
        if not SMALLEST <= self.radius <= most:
            raise ValueError(f"a brush of radius {self.radius} was given; it must be from {SMALLEST:g} to {most:g}")
        if math.isnan(self.hardness):
            raise ValueError("a brush's hardness must be a number from 0 to 1")

    @property
    def wide(self) -> Tip:
        """The soft one on the same path under which it takes back."""
        return replace(self, radius=NEAR * self.radius, hardness=0.0, near=False)

    @property
    def paths(self) -> tuple[Path, ...]:
        """All that it goes along, its own first."""
        return Path(self.start, self.end), *self.others

    def to(self, last: Tip) -> Tip:
        """The same on straight paths that end where those of another tip do."""
        others = zip(self.others, last.others, strict=True)
        return replace(self, end=last.end, others=tuple(a._replace(end=b.end) for a, b in others))

    def shape(self, grid: Grid) -> dict[str, Any]:
        """The uniforms of `lib/brush.glsl` and `lib/images.glsl`, from the corner of the grid."""
        left, top = grid.origin
        return {
            "segments": for_images([(a[0] - left, a[1] - top, b[0] - left, b[1] - top) for a, b, _ in self.paths]),
            "radius": self.radius,
            "hardness": min(max(self.hardness, 0.0), 1.0),
            "spacing": grid.spacing,
        }

    def draw(
        self,
        shader: Pass,
        target: Field,
        grid: Grid,
        vectors: Sequence[Point] = (),
        only: int | None = None,
        **more: Any,
    ) -> None:
        """Draw what a shader with the vertices of `lib/images.vert` does under it into a target, in the paths' order.

        Args:
            shader: what is drawn.
            target: cells or faces of the grid.
            grid: whose corner places are counted from.
            vectors: what each image does.
            only: the number of the one image that is drawn.
            more: what the shader is given besides, and how it blends.
        """
        regions = self.regions(grid)
        first, count = (0, len(regions)) if only is None else (only, 1)
        shader(
            target,
            triangles=(6 * first, 6 * count),
            region=regions[first : first + count],
            images=float(len(regions)),
            vectors=for_images(vectors or [(0.0, 0.0)]),
            texels=target.size,
            **self.shape(grid) | more,
        )

    def regions(self, grid: Grid) -> list[Region]:
        """The cells that each image touches, with one to spare."""
        found = list[Region]()
        for start, stop, _ in self.paths:
            sides = zip(start, stop, grid.origin, grid.spacing, strict=True)
            ends = [(min(a, b) - first, max(a, b) - first, h) for a, b, first, h in sides]
            low = [math.floor((least - self.radius) / h) - 1 for least, _, h in ends]
            high = [math.ceil((most + self.radius) / h) + 2 for _, most, h in ends]
            found.append((low[0], low[1], high[0] - low[0], high[1] - low[1]))
        return found

"""Large pictures in tiles: how they are cut, and what piece of the original each needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, sqrt

import numpy as np

from solver.gl.passes import Region
from solver.resample.plan import REACH, Plan

Piece = tuple[int, int, int, int]
"""A part of a picture or of a result: left, top, right and bottom, in pixels."""

SMALLEST_TILE = 16  # pixels of the picture, were there no map


@dataclass(frozen=True)
class Tiling:
    """Which pictures are cut into tiles, and how.

    Attributes:
        whole: pixels up to which a picture is worked on in one piece.
        tile: (width, height) of a tile, at most.
        limit: the GL's largest texture.
    """

    whole: int
    tile: tuple[int, int]
    limit: int

    def fits(self, size: tuple[int, int]) -> bool:
        """Whether a picture is worked on in one piece."""
        # The lattice of corners is one larger than the picture.
        return size[0] * size[1] <= self.whole and max(size) < self.limit

    def tile_of(self, size: tuple[int, int]) -> tuple[int, int]:
        """(width, height) of the tiles of a result: all alike."""
        width, height = (ceil(side / ceil(side / most)) for side, most in zip(size, self.tile, strict=True))
        return width + width % 2, height  # so that no pair is torn apart

    def room(self, plan: Plan, tile: tuple[int, int]) -> tuple[int, int]:
        """(width, height) of the textures for pieces of the picture: what a tile turned by any angle needs.

        Were they as large as each piece, those of a film would change with every frame, and memory fall to bits.
        """
        needed = min(tile[0] * plan.zoom[0] + tile[1] * plan.zoom[1], sum(self.tile))
        side = ceil(needed / sqrt(2)) + 2 * REACH + 2
        return (side, side) if plan.is_repeated else (min(side, plan.source_size[0]), min(side, plan.source_size[1]))


def halves_of(region: Region) -> tuple[Region, Region]:
    """A region cut in two across its longer side; no pair of neighbours in x is torn apart."""
    x, y, width, height = region
    if width >= height and width > 2:
        left = width // 4 * 2 or 2
        return (x, y, left, height), (x + left, y, width - left, height)
    return (x, y, width, height // 2), (x, y + height // 2, width, height - height // 2)


def rectangles(mask: np.ndarray) -> np.ndarray:
    """What is true in a mask as rectangles, (n, 4) of x, y, width and height: runs in its rows, joined downwards."""
    padded = np.zeros((mask.shape[0], mask.shape[1] + 2), bool)  # by `np.pad` five times as slow
    padded[:, 1:-1] = mask
    rows, edges = np.nonzero(padded[:, 1:] != padded[:, :-1])
    found: list[list[int]] = []
    above: dict[tuple[int, int], list[int]] = {}
    for y, x, end in zip(rows[::2].tolist(), edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        rectangle = above.get((x, end))
        if rectangle and rectangle[1] + rectangle[3] == y:
            rectangle[3] += 1
        else:
            above[x, end] = rectangle = [x, y, end - x, 1]
            found.append(rectangle)
    return np.array(found, int).reshape(-1, 4)


def overlap(a: Sequence[int], b: Sequence[int]) -> Region:
    """What two rectangles (x, y, width, height) have in common."""
    x, y = max(a[0], b[0]), max(a[1], b[1])
    return x, y, min(a[0] + a[2], b[0] + b[2]) - x, min(a[1] + a[3], b[1] + b[3]) - y


def piece_of(plan: Plan, positions: np.ndarray, region: Region) -> Piece:
    """What a region (x, y, width, height) of a tile needs of the picture: left, top, right and bottom."""
    x, y, width, height = region
    more = 0 if plan.is_single else 1
    within = positions[y : y + height + more, x : x + width + more]
    # One axis after the other: over both at once NumPy is fifty times slower.
    low = np.floor(within.min(axis=0).min(axis=0)).astype(int) - REACH
    high = np.ceil(within.max(axis=0).max(axis=0) + np.array(plan.zoom)).astype(int) + REACH
    if not plan.is_repeated:
        limits = np.array(plan.source_size)
        low, high = np.clip(low, 0, limits - 1), np.clip(high, 1, limits)
    return int(low[0]), int(low[1]), int(high[0]), int(high[1])


def size_of(piece: tuple[int, int, int, int]) -> tuple[int, int]:
    return piece[2] - piece[0], piece[3] - piece[1]


def edge_index(index: np.ndarray, count: int, edges: str) -> np.ndarray:
    """The pixel, 0 to `count` - 1, that stands for each `index` along a side, also beyond it: wrapped, or mirrored."""
    if edges == "wrap":
        return index % count
    index = index % (2 * count)
    return np.minimum(index, 2 * count - 1 - index)

"""A warp map as values: where each pixel is looked up, and the same as places of an ST map or as offsets in pixels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from app.media.depth import few_rows

PixelPlaces = Literal["centres", "corners", "pixels"]
"""The places an ST map that does nothing holds in a row of W pixels, times W: .5 to W-.5, 0 to W, 0 to W-1."""

LEAST = 6  # pixels along a side of a map that the solver takes


class MapError(ValueError):
    """A map cannot be used; the reason and the mend, in words that follow the name of its file."""


@dataclass(frozen=True)
class Displacement:
    """Where each pixel is looked up: at its own centre plus `values`.

    Attributes:
        values: (height + 2 overscan, width + 2 overscan, 2), x right and y down, in longer sides of width x height;
            float32, or float64 when read from a file, so that conversions lose nothing; NaN where the result shows
            nothing.
        overscan: pixels beyond each side of the picture.
        forward: the other way, from places of the original to places of the result.
    """

    values: np.ndarray
    overscan: int = 0
    forward: bool = False

    @property
    def width(self) -> int:
        return self.values.shape[1] - 2 * self.overscan

    @property
    def height(self) -> int:
        return self.values.shape[0] - 2 * self.overscan

    @property
    def longest(self) -> int:
        return max(self.width, self.height)

    def fitted(self, width: int, height: int) -> Displacement:
        """The map for a picture of width x height, its values in the longer sides of that.

        Raises:
            MapError: see `check_proportions`.
        """
        check_proportions((self.width, self.height), (width, height))
        longest = max(width, height)
        scale = self.longest / self.width * width / longest, self.longest / self.height * height / longest
        if scale == (1, 1):
            return self
        values = (self.values * np.array(scale)).astype(self.values.dtype)
        return Displacement(values, self.overscan, self.forward)


def check_proportions(size: tuple[int, int], picture: tuple[int, int]) -> None:
    """Raise `MapError` if proportions, of a map and of the picture it is for, differ by more than their rounding."""
    (columns, rows), (width, height) = size, picture
    if min(abs(height * columns / width - rows), abs(width * rows / height - columns)) >= 1:
        raise MapError(
            f"it is {columns} x {rows} and the picture {width} x {height}, and they must have the same proportions; "
            "crop the picture or make the map anew"
        )


def check_size(displacement: Displacement) -> None:
    """Raise `MapError` if a map is too small to be looked up between its pixels."""
    if min(displacement.width, displacement.height) < LEAST:
        raise MapError(
            f"it is {displacement.width} x {displacement.height} pixels, and a side must have at least {LEAST}; "
            "make a larger one"
        )


def cropped(displacement: Displacement) -> Displacement:
    """The map without its overscan."""
    edge = displacement.overscan
    values = displacement.values[edge:-edge, edge:-edge] if edge else displacement.values
    return Displacement(values, 0, displacement.forward)


def _centres(count: int, overscan: int) -> np.ndarray:
    return np.arange(-overscan, count + overscan) + 0.5


def to_st(displacement: Displacement) -> np.ndarray:
    """Absolute places (h, w, 2) float32, 0-1 over the picture, y up, pixel centres at (x + .5) / width."""
    map_, out = displacement, np.empty(displacement.values.shape, np.float32)
    x, y = _centres(map_.width, map_.overscan), _centres(map_.height, map_.overscan)
    for rows in few_rows(out):
        # float64 and rounded far below float32, so that a place of exactly 0 comes out of a round trip as 0
        u = (x + map_.longest * map_.values[rows, :, 0].astype(np.float64)) / map_.width
        v = 1 - (y[rows, None] + map_.longest * map_.values[rows, :, 1].astype(np.float64)) / map_.height
        out[rows, :, 0], out[rows, :, 1] = np.round(u, 13), np.round(v, 13)
    return out


def from_st(st: np.ndarray, grid: PixelPlaces = "centres", overscan: int = 0) -> Displacement:
    """The displacement (float64) of absolute places (h, w, 2), y up, on any of the three grids."""
    width, height = st.shape[1] - 2 * overscan, st.shape[0] - 2 * overscan
    values = np.empty(st.shape, np.float64)
    # one step of the stored value in pixels, and the place of its zero
    step_x, step_y = (max(1, width - 1), max(1, height - 1)) if grid == "corners" else (width, height)
    zero = 0.0 if grid == "centres" else 0.5
    x, y = _centres(width, overscan), _centres(height, overscan)
    longest = max(width, height)
    for rows in few_rows(values):
        values[rows, :, 0] = (st[rows, :, 0] * np.float64(step_x) + zero - x) / longest
        values[rows, :, 1] = (height - zero - st[rows, :, 1] * np.float64(step_y) - y[rows, None]) / longest
    return Displacement(values, overscan)


def to_offsets(displacement: Displacement, *, up: bool) -> np.ndarray:
    """Offsets in pixels of the map's own size, (h, w, 2) float32; y up or down."""
    pixels = np.array([displacement.longest, -displacement.longest if up else displacement.longest], np.float64)
    return (displacement.values * pixels).astype(np.float32)


def from_offsets(offsets: np.ndarray, *, up: bool, overscan: int = 0) -> Displacement:
    """The displacement (float64) of offsets in pixels, (h, w, 2); y up or down."""
    longest = max(offsets.shape[0], offsets.shape[1]) - 2 * overscan
    return Displacement(offsets / np.array([longest, -longest if up else longest], np.float64), overscan)


def folds(values: np.ndarray) -> int:
    """In how many pixels a map, its values (h, w, 2) in longer sides, turns the picture over: det J <= 0."""
    height, width = values.shape[:2]
    longest, count = max(width, height), 0
    if min(width, height) < 2:
        return 0
    for rows in few_rows(values):
        # central differences, which want a row more on each side
        low, high = max(0, rows.start - 1), min(height, rows.stop + 1)
        down, along = np.gradient(longest * values[low:high].astype(np.float64), axis=(0, 1))
        inner = slice(rows.start - low, min(height, rows.stop) - low)
        down, along = down[inner], along[inner]
        count += int(((1 + along[..., 0]) * (1 + down[..., 1]) <= along[..., 1] * down[..., 0]).sum())
    return count


def is_beside(values: np.ndarray) -> bool:
    """Whether a map, its values (h, w, 2) in longer sides and NaN where there is nothing, looks up no point inside."""
    height, width = values.shape[:2]
    longest = max(width, height)
    x, y = ((np.arange(count) + 0.5) / longest for count in (width, height))
    for rows in few_rows(values):
        across, down = x + values[rows, :, 0], y[rows, None] + values[rows, :, 1]
        if ((across >= 0) & (across <= width / longest) & (down >= 0) & (down <= height / longest)).any():
            return False
    return True

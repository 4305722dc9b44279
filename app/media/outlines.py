"""Curves that correspond: polylines, and the outlines of masks, made into as many points that follow each other."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from app.errors import UserError
from app.media.pictures import read_picture
from app.model.sampling import intensity

SPACING = 0.08  # longer sides of the picture between two points of a curve
FEWEST, MOST = 3, 24  # points of a curve
FINE, CORNER = 512, 8  # places of an outline that are looked at for a common start, and that a corner is seen from
SOFT = 1.0  # pixels, the standard deviation of the blur that makes an outline of pixels smooth
AROUND = 4  # pixels, that a mask is made wider on each side, so that its outlines are closed
SMALL = 0.01  # of the largest part of a mask: what is smaller is a speck

Size = tuple[int, int]


def paired(one: np.ndarray, other: np.ndarray, spacing: float) -> np.ndarray:
    """Points (n, 2, 2) that divide two polylines (m, 2) alike, by their arc lengths; closed ones end where they begin.

    Raises:
        ValueError: if one of them has no length, or only one is closed.
    """
    if min(len(one), len(other)) < 2 or not np.ptp(one, axis=0).any() or not np.ptp(other, axis=0).any():
        raise ValueError("needs two different places on both sides")
    lengths = [float(np.hypot(*np.diff(line, axis=0).T).sum()) for line in (one, other)]
    closed = [is_closed(line) for line in (one, other)]
    if closed[0] != closed[1]:
        raise ValueError("is closed on one side only")
    count = int(np.clip(np.ceil(max(lengths) / spacing) + (not closed[0]), FEWEST, MOST))
    return np.stack([resampled(line, count) for line in (one, other)], axis=1)


def is_closed(line: np.ndarray) -> bool:
    """True if a polyline (n, 2) ends where it begins."""
    return len(line) > 2 and bool((line[0] == line[-1]).all())


def resampled(line: np.ndarray, count: int) -> np.ndarray:
    """Points (count, 2) evenly along a polyline (n, 2); of one that ends where it begins that place comes once."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    closed = is_closed(line)
    wanted = np.linspace(0.0, along[-1], count + closed)[:count]
    return np.stack([np.interp(wanted, along, line[:, axis]) for axis in (0, 1)], axis=-1)


def read_outlines(one: Path, other: Path, size: Size) -> tuple[np.ndarray, list[str]]:
    """Points (n, 2, 2) of the outlines of two masks, in pixels of a picture of this size; and what should be heard.

    What is brighter than middle grey is inside. Masks of other sizes are stretched to the picture's. Of several parts
    the largest counts, and its holes do not. Both are gone round the same way, so that the points are nearest to their
    places, and from the sharpest corner of the other one.

    Raises:
        UserError: naming the file, if it cannot be read or nothing, or all, is inside.
    """
    notices: list[str] = []
    lines = [resampled(outline(path, size, notices), FINE) for path in (one, other)]
    # The sum of squares is least where the correlation is largest; by how much both lie apart makes no difference.
    first, second = (line @ np.array([1, 1j]) for line in lines)
    likeness = np.fft.ifft(np.conj(np.fft.fft(first)) * np.fft.fft(second)).real
    second = np.roll(second, -(shift := int(likeness.argmax())))
    before, after = (way * (np.roll(second, -way * CORNER) - second) for way in (-1, 1))
    corner = int(np.abs(np.angle(after * before.conj())).argmax())
    lines = [np.roll(line, -corner - more, axis=0) for line, more in zip(lines, (0, shift), strict=True)]
    closed = [np.concatenate([line, line[:1]]) for line in lines]
    return paired(closed[0], closed[1], SPACING * max(size)), notices


def outline(path: Path, size: Size, notices: list[str]) -> np.ndarray:
    """The closed outline (n, 2) of what is inside a mask, clockwise, in pixels of a picture of this size.

    Raises:
        UserError: as `read_outlines`.
    """
    from scipy import ndimage

    inside = intensity(read_picture(path)) > 0.5
    if inside.all() or not inside.any():
        found = f"{path} has no outline: {'all' if inside.any() else 'nothing'} of it is brighter than grey"
        raise UserError(f"{found}; paint the area white and the rest black")
    parts = np.zeros(inside.shape, np.int32)
    ndimage.label(inside, output=parts)
    areas = np.bincount(parts.ravel())[1:]
    if (large := int((areas > SMALL * areas.max()).sum())) > 1:
        notices.append(f"{path} has {large} parts; the largest is fitted")
    filled = np.asarray(ndimage.binary_fill_holes(parts == areas.argmax() + 1), np.float64)
    if (soft := ndimage.gaussian_filter(np.pad(filled, AROUND), SOFT)).max() <= 0.5:
        raise UserError(f"{path} has no outline: what is brighter than grey is only specks; paint a larger area white")
    line = _traced(soft) - AROUND
    return np.clip(line * np.divide(size, inside.shape[::-1]), 0, size)


def _traced(values: np.ndarray) -> np.ndarray:
    """The longest closed line at 1/2 of values (h, w) at the middles of pixels, clockwise, by marching squares."""
    level = values - 0.5
    steps: dict[tuple[int, int, int], tuple[int, int, int]] = {}
    count = sum((level[a : a - 1 or None, b : b - 1 or None] > 0).astype(int) for a in (0, 1) for b in (0, 1))
    for row, column in np.argwhere((count > 0) & (count < 4)).tolist():
        corners = [(row, column), (row, column + 1), (row + 1, column + 1), (row + 1, column)]
        edges = [(0, row, column), (1, row, column + 1), (0, row + 1, column), (1, row, column)]
        high = [bool(level[corner] > 0) for corner in corners]
        # Going round the square, the line comes in where it leaves what is inside, which stays to its right.
        enters = [edges[k] for k in range(4) if high[k] and not high[(k + 1) % 4]]
        leaves = [edges[k] for k in range(4) if not high[k] and high[(k + 1) % 4]]
        steps.update(zip(enters, leaves, strict=True))
    longest: list[tuple[int, int, int]] = []
    while steps:
        first = next(iter(steps))
        line = [first]
        while (following := steps.pop(line[-1], None)) not in (None, first):
            line.append(following)  # pyright: ignore[reportArgumentType]
        longest = max(longest, line, key=len)
    places = []
    for axis, row, column in [*longest, longest[0]]:
        one, other = level[row, column], level[(row, column + 1) if axis == 0 else (row + 1, column)]
        part = one / (one - other)
        places.append((column + 0.5 + (part if axis == 0 else 0), row + 0.5 + (part if axis == 1 else 0)))
    return np.array(places)

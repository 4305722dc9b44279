"""The forward map: where every point of the original goes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from solver.gl.field import Field
from solver.gl.points import draw_at
from solver.limits import places
from solver.warp.map import WarpMap
from solver.warp.scaled import ScaledMap

MOST_ALONG = 1024  # texels along a side of the first guess
ROUNDS = 16  # of Newton's method, in warp/invert.frag
Box = tuple[int, int, int, int]  # left, top, right, bottom, in texels
AROUND = 4  # texels that the cubic reads around a place, and more for what is rounded


class ForwardMap:
    """The inverse of a warp map: y -> y + F(y) gives, for a point of the original, its place in the result.

    Found when asked for: the map's cells are drawn as triangles where they are looked up, which gives every point a
    start on the right branch however far it has been moved, and Newton's method does the rest. Where the map is folded
    one of the branches is taken; a point that is looked up nowhere, or where the map is wound up too far for these
    cells (solver/MEASURED.md), keeps the nearest place that was tried.
    """

    def __init__(self, warp: WarpMap | ScaledMap) -> None:
        self._warp = warp
        self._guess = warp.device.field(_bounded(warp.size), 2, "forward map, guess")
        self._guessed: object = None

    def read(self, size: tuple[int, int] | None = None) -> np.ndarray:
        """The displacement F at the pixel centres of a picture of `size`, by default the map's `coarse_size`.

        Returns:
            float32 (height, width, 2), longer sides.
        """
        size = self._warp.coarse_size if size is None else size
        field = self._warp.device.field(size, 2, "forward map, to read")
        invert = self._warp.device.pass_("warp/invert.frag")
        self._find_guess()
        invert(field, **self._inputs(self._warp.composed(exact=True)), origin=(0.0, 0.0), step=field.texel)
        displacement = field.get()
        field.release()
        return displacement

    def at(self, points: np.ndarray) -> np.ndarray:
        """The displacement F at points (n, 2) of the original, in longer sides: float32 (n, 2)."""
        points = places(points)
        near = self._near(points)
        self._find_guess(near if 2 * near[..., 0].size < self._guess.width * self._guess.height else None)
        boxes = None if self._warp.at_rest is not None else self._boxes(points, near)
        if boxes is None:
            return self._inverted(points, self._warp.composed(exact=True))
        found = np.empty((len(points), 2), np.float32)
        texel = 1 / self._warp.size[0], 1 / self._warp.size[1]
        for (left, top, right, bottom), members in _apart(boxes):
            # All of a large picture's map is large: to make room for it takes longer than everything else.
            part = Field(self._warp.device, (right - left, bottom - top), 2, "a part of the warp map", cleared=False)
            self._warp.draw(part, (left, top), texel, exact=True)
            found[members] = self._inverted(points[members], part, (left, top))
            part.release()
        return found

    def release(self) -> None:
        """Free the texture."""
        self._guess.release()

    def __enter__(self) -> ForwardMap:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    def _inverted(self, points: np.ndarray, displacement: Field, corner: tuple[int, int] = (0, 0)) -> np.ndarray:
        inputs = self._inputs(displacement, corner)
        return draw_at(self._warp.device, points, self._warp.extent, "warp/invert.frag", **inputs)

    def _inputs(self, displacement: Field, corner: tuple[int, int] = (0, 0)) -> dict[str, Any]:
        inputs: dict[str, Any] = {"displacement": displacement, "guess": self._guess, "extent": self._warp.extent}
        return inputs | {"corner": corner, "size": self._warp.size}

    def _near(self, points: np.ndarray) -> np.ndarray:
        """Texels of the guess that points lie between, and one more each way as it may be rounded: (n, 16, 2)."""
        guesses = np.array(self._guess.size)
        corner = np.floor(points / self._warp.extent * guesses - 0.5)
        steps = np.mgrid[-1:3, -1:3].reshape(2, -1).T
        return np.clip(corner[:, None] + steps, 0, guesses - 1).astype(int)

    def _find_guess(self, near: np.ndarray | None = None) -> None:
        """Draw the guess; or only what these texels (n, k, 2) show of it, of which a software rasteriser has less."""
        warp = self._warp
        wanted = warp.version, None if near is None else near.tobytes()
        if self._guessed in ((warp.version, None), wanted):
            return
        moved = warp.composed(self._guess.size)
        cells = (self._guess.width + 1) * (self._guess.height + 1)
        self._guess.clear()
        scatter = warp.device.pass_("warp/scatter.frag")
        for first, count in [(0, cells)] if near is None else self._cells_at(near, moved.get()):
            scatter(self._guess, triangles=(6 * first, 6 * count), displacement=moved, extent=warp.extent)
        self._guessed = wanted

    def _cells_at(self, near: np.ndarray, displacement: np.ndarray) -> Iterator[tuple[int, int]]:
        """The cells of the map that may be looked up in these texels of the guess: the first of each run, how many."""
        first, end = near.min(axis=(0, 1)), near.max(axis=(0, 1)) + 1
        wanted = np.zeros((end - first)[::-1], np.int32)
        wanted[near[..., 1] - first[1], near[..., 0] - first[0]] = 1
        up_to = np.pad(wanted.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))  # so many of them above and to the left
        size, ends, is_near = self._guess.size, list[np.ndarray](), True
        for axis, (count, side) in enumerate(zip(size, self._warp.extent, strict=True)):
            nodes = np.clip(np.arange(count + 2, dtype=np.float32) - 0.5, 0.0, count)
            moved = np.pad(displacement[..., axis] * np.float32(count / side), 1, mode="edge")
            moved += nodes if axis == 0 else nodes[:, None]
            for extreme in (np.minimum, np.maximum):
                pairs = extreme(moved[1:], moved[:-1])
                ends.append(extreme(pairs[:, 1:], pairs[:, :-1]))
            is_near &= (ends[-2] <= near[..., axis].max() + 2) & (ends[-1] >= near[..., axis].min() - 1)
        numbers = np.flatnonzero(is_near)
        left, top = (
            np.clip(low.ravel()[numbers] - 1 - start, 0, most).astype(int)
            for low, start, most in zip(ends[::2], first, end - first, strict=True)
        )
        right, bottom = (
            np.clip(high.ravel()[numbers] + 2 - start, 0, most).astype(int)
            for high, start, most in zip(ends[1::2], first, end - first, strict=True)
        )
        among = up_to[bottom, right] - up_to[top, right] - up_to[bottom, left] + up_to[top, left]
        numbers = numbers[among > 0]
        for run in np.split(numbers, np.flatnonzero(np.diff(numbers) > 1) + 1) if len(numbers) else ():
            yield int(run[0]), len(run)

    def _boxes(self, points: np.ndarray, near: np.ndarray) -> list[Box] | None:
        """The texels of the map among which Newton's method finds each of these points; None if they are half of it."""
        extent, size, guesses = np.array(self._warp.extent), np.array(self._warp.size), np.array(self._guess.size)
        reach = ROUNDS * np.sqrt(0.5) * np.hypot(*(extent / guesses))  # no round goes farther
        least = 2 * np.ceil(reach / extent * size) + 2 * AROUND
        if 2 * len(points) * np.prod(least) >= np.prod(size):
            return None
        guess = self._guess.get()
        starts = points[:, None] + guess[near[..., 1], near[..., 0]]
        starts = np.concatenate([starts, np.clip(starts, 0.0, extent)], axis=1)  # from outside it goes on at the edge
        low = np.floor((starts.min(axis=1) - reach) / extent * size).astype(int) - AROUND
        high = np.ceil((starts.max(axis=1) + reach) / extent * size).astype(int) + AROUND
        low, high = np.clip(low, 0, size), np.clip(high, 0, size)
        if 2 * np.prod(high - low, axis=1).sum() >= np.prod(size):
            return None
        return [(left, top, right, bottom) for left, top, right, bottom in np.hstack([low, high]).tolist()]


def _apart(boxes: list[Box]) -> list[tuple[Box, list[int]]]:
    """These boxes, those that meet as one around them, each with their numbers."""
    groups = list[tuple[Box, list[int]]]()
    for number, box in enumerate(boxes):
        members = [number]
        while met := [group for group in groups if _meet(group[0], box)]:
            groups = [group for group in groups if not _meet(group[0], box)]
            left, top, right, bottom = zip(box, *(other for other, _ in met), strict=True)
            box = min(left), min(top), max(right), max(bottom)
            members += [each for _, numbers in met for each in numbers]
        groups.append((box, members))
    return groups


def _meet(one: Box, other: Box) -> bool:
    return all(one[k] < other[k + 2] and other[k] < one[k + 2] for k in (0, 1))


def _bounded(size: tuple[int, int]) -> tuple[int, int]:
    """A size divided by four, or by what brings it down to `MOST_ALONG`."""
    over = max(4.0, max(size) / MOST_ALONG)
    return max(8, round(size[0] / over)), max(8, round(size[1] / over))

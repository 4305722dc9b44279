"""The accumulated map: all motion up to the last remap, as fine as the picture."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.passes import Region
from solver.gl.tiled import TILE, SavedTiles, TiledField
from solver.grid import Grid
from solver.steepness import Steepness
from solver.warp.state import ACCUMULATED, CLOSED, most_closed

LEAST_TEXELS = 4  # along a cell, with which the map's own interpolation costs nothing
MOST_TEXELS = 2**25  # in all: 256 MiB each of two textures
REACH = 3  # texels that the cubic reaches to one side, at most
NOWHERE = 1e-4  # texels: a smaller displacement counts as none
STEEPEST = 6.0  # largest |grad A| of a map that is not closed: one that stretches more folds between its texels

Limits = tuple[float, float, float, float]


def map_size(grid: Grid, picture: tuple[int, int], largest: int) -> tuple[int, int]:
    """Texels of the accumulated map of a picture, (width, height).

    One a pixel; or one for a whole number of pixels, if there would be more than `MOST_TEXELS` or than `largest` along
    a side; or a whole number of texels a pixel, if a cell of the grid would have fewer than `LEAST_TEXELS`, within
    these limits.
    """
    width, height = picture
    shrunk = max(math.ceil(math.sqrt(width * height / MOST_TEXELS)), math.ceil(max(width, height) / largest))
    if shrunk > 1:
        return math.ceil(width / shrunk), math.ceil(height / shrunk)
    wanted = [LEAST_TEXELS * side / step for side, step in zip(grid.picture, grid.spacing, strict=True)]
    across, down = (math.ceil(texels / pixels) for texels, pixels in zip(wanted, picture, strict=True))
    while across * width * down * height > MOST_TEXELS or max(across * width, down * height) > largest:
        if across == down == 1:
            break
        across, down = max(1, across - 1), max(1, down - 1)
    return across * width, down * height


class AccumulatedMap:
    """A displacement of the whole picture, RG32F, longer sides, redrawn tile by tile where something has moved.

    Where it has become too steep for its texels it is closed, and a new one of nothing begins; a place is looked up in
    the new one first, then in the closed ones, the last one closed first. Once there are `most_closed` of them, it goes
    on however steep it is.

    Args:
        device: the device.
        size: (width, height) in texels.
        extent: (width, height) of the picture, longer sides.

    Attributes:
        now: the displacement. Tiles are redrawn into another field, which replaces it once all are done.
        closed: the closed maps, the first one closed first.
        limits: of the places looked up: left, top, right, bottom.
    """

    def __init__(self, device: Device, size: tuple[int, int], extent: tuple[float, float]) -> None:
        self.device = device
        self.size = size
        self.extent = extent
        self.closed: list[TiledField] = []
        self._most_closed = most_closed(size)
        self._steepness = Steepness(device, size, "accumulated map", TILE=TILE)
        self.now = TiledField(device, size, 2, "accumulated map")
        self._next = TiledField(device, size, 2, "accumulated map, anew")
        self._tiles = self.now.kind.regions
        self._stale = set[Region]()  # tiles in which `_next` holds something older than `now`
        self._moved: list[Region] = []  # tiles to be drawn anew
        self._copied: list[Region] = []  # tiles to be copied
        self._done = 0  # of both
        self._is_saved = False  # if so, tiles are copied for the next save as they are drawn, not all of them at once
        self.limits = self._picture = (0.0, 0.0, *extent)
        self.is_walled = True

    def is_fine(self, grid: Grid) -> bool:
        """True if it has `LEAST_TEXELS` texels along a cell of a grid."""
        texels = (n * step / side for n, step, side in zip(self.size, grid.spacing, self.extent, strict=True))
        return min(texels) > LEAST_TEXELS - 1e-6

    def begin(self, *moved: tuple[np.ndarray, Grid]) -> int:
        """Plan to redraw all tiles in which one of several submaps moves anything; returns how many there are.

        Each submap has one texel, or n x n, for every cell of its grid: (ny, nx, 2).
        """
        self.forget()
        least, wanted = NOWHERE * self.extent[0] / self.size[0], set[Region]()
        for submap, cells in moved:
            grid, moves = cells.refined(submap.shape[1] // cells.nx), np.abs(submap) > least
            wanted |= {tile for tile in self._tiles if moves[self._cells(tile, grid)].any()}
        self._moved = [tile for tile in self._tiles if tile in wanted]
        self._steepness.forget()
        self._copied = sorted(self._stale.difference(wanted))
        return len(self._moved)

    def _cells(self, tile: Region, grid: Grid) -> tuple[slice, slice]:
        """The rows and columns of cells that a tile is interpolated from."""
        spans = []
        for axis in (1, 0):
            texel = self.extent[axis] / self.size[axis]
            start, end = tile[axis] * texel, (tile[axis] + tile[axis + 2]) * texel
            origin, step, count = grid.origin[axis], grid.spacing[axis], grid.size[axis]
            first, last = math.floor((start - origin) / step) - REACH, math.ceil((end - origin) / step) + REACH
            spans.append(slice(min(max(first, 0), count), min(max(last, 0), count)))
        return spans[0], spans[1]

    @property
    def defines(self) -> dict[str, object]:
        """The defines of `lib/warp.glsl` for it and the closed maps."""
        return {"CLOSED": len(self.closed)} if self.closed else {}

    def inputs(self) -> dict[str, Any]:
        """The inputs of `lib/warp.glsl` for it and the closed maps."""
        return (
            self.own()
            | {f"closed_{number}": field for number, field in enumerate(self.closed)}
            | {"limits": self.limits}
        )

    def own(self) -> dict[str, Any]:
        """The same without the closed maps, as a remap needs it: while there are any, it must stay in the picture."""
        limits = self._picture if self.closed else self.limits
        return {"accumulated": self.now, "picture": self.extent, "limits": limits, "walled": float(self.is_walled)}

    def draw(self, part: float, draw: Callable[[Field, list[Region]], None]) -> None:
        """Do a `part`, 0-1, of what is planned: `draw` redraws regions, from `now`, into another field."""
        before, until = self._done, math.ceil(part * (len(self._moved) + len(self._copied)))
        if anew := self._moved[before:until]:
            draw(self._next, anew)
            if len(self.closed) < self._most_closed:
                spacing = self.extent[0] / self.size[0], self.extent[1] / self.size[1]
                self._steepness.look(self._next, spacing, anew)
            if self._is_saved:
                self._next.make_ready(anew)
        count = len(self._moved)
        self._next.take(self.now, self._copied[max(before - count, 0) : max(until - count, 0)])
        self._done = max(before, until)
        if part >= 1:
            self.now, self._next = self._next, self.now
            self._stale = set(self._moved)
            self._moved, self._copied, self._done = [], [], 0
            if len(self.closed) < self._most_closed and self._steepness.found() > STEEPEST**2:
                self.closed.append(self.now)
                self._begin_anew()

    def _begin_anew(self) -> None:
        """Go on with a map of nothing, in the field that would be drawn next."""
        self.now, self._next = self._next, TiledField(self.device, self.size, 2, "accumulated map, anew")
        self.now.clear()
        self._stale.clear()

    def forget(self) -> None:
        """Drop what is planned."""
        self._stale.update(self._moved[: self._done])
        self._moved, self._copied, self._done = [], [], 0

    def change(self, region: Region, draw: Callable[[Field, list[Region]], None]) -> None:
        """Redraw a region at once; nothing may be planned."""
        draw(self._next, [region])
        self.now.copy_from(self._next, region)
        self._stale.update(tile for tile in self._tiles if _meet(tile, region))

    def set(self, draw: Callable[[Field], None], limits: Limits) -> None:
        """Draw all of it anew, with places within these limits, and no closed maps; what was planned is forgotten."""
        self.forget()
        self._open()
        draw(self.now)
        self._stale = set(self._tiles)
        self.limits, self.is_walled = limits, False

    def merge(self, draw: Callable[[Field], None]) -> None:
        """Make one map of it and the closed ones: `draw` draws their composition; nothing may be planned."""
        draw(self._next)
        self.now, self._next = self._next, self.now
        self._stale = set(self._tiles)
        self._open()

    def saved(self) -> dict[str, TiledField]:
        """The fields by name, to be saved; from the first call on, tiles are made ready for that as they are drawn."""
        self._is_saved = True
        return {ACCUMULATED: self.now} | {f"{CLOSED}{number}": field for number, field in enumerate(self.closed)}

    def restore(self, saved: dict[str, SavedTiles], limits: Limits, is_walled: bool) -> None:
        """Go back to what `saved` gave, as it was then, with the limits of then; what was planned is forgotten."""
        self.forget()
        self._stale.update(self.now.restore(saved[ACCUMULATED]))
        count = sum(name.startswith(CLOSED) for name in saved)
        self._open(count)
        while len(self.closed) < count:
            self.closed.append(TiledField(self.device, self.size, 2, "closed map"))
        for number, field in enumerate(self.closed):
            field.restore(saved[f"{CLOSED}{number}"])
        self.limits, self.is_walled = limits, is_walled

    def clear(self) -> None:
        """The identity; what was planned is forgotten."""
        self.forget()
        self._open()
        for field in (self.now, self._next):
            field.clear()
        self._stale.clear()
        self.limits, self.is_walled = self._picture, True

    def release(self) -> None:
        """Free the textures."""
        self._open()
        for thing in (self.now, self._next, self._steepness):
            thing.release()

    def _open(self, left: int = 0) -> None:
        """Drop the closed maps but the first so many."""
        while len(self.closed) > left:
            self.closed.pop().release()


def _meet(a: Region, b: Region) -> bool:
    """True if two regions have something in common."""
    return all(a[k] < b[k] + b[k + 2] and b[k] < a[k] + a[k + 2] for k in (0, 1))

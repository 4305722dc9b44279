"""The accumulated map: all motion up to the last remap, as fine as the picture.

The class is long because a remap, closing a map and undoing under a brush redraw the same tiles of the same levels.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from itertools import takewhile
from typing import Any, Protocol

import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.passes import Region
from solver.gl.tiled import TILE, SavedTiles, TiledField
from solver.grid import Grid
from solver.steepness import Steepness
from solver.warp.closed import ClosedMap
from solver.warp.evenness import FLAT, Evenness
from solver.warp.state import (
    ACCUMULATED,
    CLOSED,
    MOST_CLOSED,
    MOST_CLOSED_BYTES,
    OPEN,
    UNDONE,
    UNDONE_COMPONENTS,
    Images,
    closed_in,
)

LEAST_TEXELS = 4  # along a cell, with which the map's own interpolation costs nothing
MOST_TEXELS = 2**25  # in all: 256 MiB each of two textures
REACH = 3  # texels that the cubic reaches to one side, at most
NOWHERE = 1e-4  # texels: a smaller displacement counts as none
# Largest |grad A| of a map that is not closed, with `LEAST_TEXELS` along the finest cell that has moved it. With texels
# of h it is in proportion to h^(-3/4): det J is wrong by |grad A|^4 h^3 between them.
STEEPEST = 6.0
# The least part that det J on one side of a texel may be of that on another: where they differ by more than the smaller
# one, the interpolation may as well be folded.
LEAST_EVEN = 0.5
RIM = 6  # texels of nothing around a closed map of a part of the picture: as many as the quintic reads along a side
CLOSED_TEXELS = 8  # along a cell, at least, of a closed map that has fewer texels than A: with so many none folds

Limits = tuple[float, float, float, float]


class Draw(Protocol):
    """Redraws regions, from the accumulated map or from what is `undone`, into a field that will replace it."""

    def __call__(self, target: Field, regions: list[Region], /, **undone: Field) -> None: ...


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

    Before it becomes too steep for its texels it is closed, and a new one of nothing begins; a place is looked up in
    the new one first, then in the closed ones, the last one closed first. These have fewer texels where as many would
    leave no room for `MOST_CLOSED`, but no fewer than `CLOSED_TEXELS` for a cell that moved them; where there is no
    room for the whole picture then, they cover the tiles that have moved. Once there are as many as there may be, it
    goes on however steep it is. What the restore brush takes away of the closed ones is kept beside it, is moved and
    closed with it, and comes before it in the list.

    Args:
        device: the device.
        size: (width, height) in texels.
        extent: (width, height) of the picture, longer sides.

    Attributes:
        now: the displacement. Tiles are redrawn into another field, which replaces it once all are done.
        undone: what is undone of the closed maps, the way and the part (`undo` in `lib/warp.glsl`); None for nothing.
        closed: the closed maps, the first one closed first, and what was undone before each.
        limits: of the places looked up: left, top, right, bottom.
        finest: the smallest cell that has moved the map, longer sides; 0 if it may have any detail.
        is_walled: nothing has crossed the picture's edges.
        images: what lies beyond these then, as of what it has taken in there; 0 where it has taken in nothing.
    """

    def __init__(self, device: Device, size: tuple[int, int], extent: tuple[float, float]) -> None:
        self.device = device
        self.size = size
        self.extent = extent
        self.closed: list[ClosedMap] = []
        self._steepness = Steepness(device, size, "accumulated map", TILE=TILE)
        self._evenness = Evenness(device, size, self._steepness.blocks)
        self.now = TiledField(device, size, 2, "accumulated map")
        self._next = TiledField(device, size, 2, "accumulated map, anew")
        self.undone: TiledField | None = None
        self._next_undone: TiledField | None = None
        self._tiles = self.now.kind.regions
        self._stale = set[Region]()  # tiles in which `_next` holds something older than `now`
        self._moved: list[Region] = []  # tiles to be drawn anew
        self._copied: list[Region] = []  # tiles to be copied
        self._done = 0  # of both
        self.limits = self._picture = (0.0, 0.0, *extent)
        self.is_walled = True
        self.images = OPEN
        self.finest = 1.0

    def is_fine(self, grid: Grid) -> bool:
        """True if it has `LEAST_TEXELS` texels along a cell of a grid."""
        texels = (n * step / side for n, step, side in zip(self.size, grid.spacing, self.extent, strict=True))
        return min(texels) > LEAST_TEXELS - 1e-6

    def begin(self, *moved: tuple[np.ndarray, Grid], is_held: bool = False) -> int:
        """Plan to redraw all tiles in which one of several submaps moves anything; returns how many there are.

        Each submap has one texel, or n x n, for every cell of its grid: (ny, nx, 2). `is_held`: something is held, and
        what they move ends within a few texels of it.
        """
        self.forget()
        self.finest = 0.0 if is_held else min(self.finest, *(min(grid.spacing) for _, grid in moved))
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
        chain = self.chain
        undone = sum(1 << number for number, closed in enumerate(chain) if closed.is_undone)
        return {name: number for name, number in (("CLOSED", len(chain)), ("UNDONE", undone)) if number}

    def inputs(self) -> dict[str, Any]:
        """The inputs of `lib/warp.glsl` for it and the closed maps."""
        inputs: dict[str, Any] = self.own() | {"limits": self.limits}
        for number, closed in enumerate(self.chain):
            edges = self._edges_of(closed.images)
            inputs |= {f"closed_{number}": closed.field, f"box_{number}": closed.box, f"edges_{number}": edges}
        return inputs

    def own(self) -> dict[str, Any]:
        """The same without the closed maps, as a remap needs it: while there are any, it must stay in the picture."""
        limits = self._picture if self.closed else self.limits
        return {"accumulated": self.now, "picture": self.extent, "limits": limits, "edges": self.edges}

    @property
    def edges(self) -> Images:
        """What lies beyond the picture's edges."""
        return self._edges_of(self.images)

    def _edges_of(self, images: Images) -> Images:
        """Where nothing has been taken in, nothing moves."""
        left, right, top, bottom = (image or -1.0 for image in images)
        return (left, right, top, bottom) if self.is_walled else OPEN

    def take_sides(self, images: Images) -> None:
        """Go on as a submap that will be taken in: it glides along the picture's edges or sticks; 0 where it has none.

        A map does one or the other along an edge, so it is closed before it has to do both; if it cannot be, it glides.
        """
        if any(mine * its < 0 for mine, its in zip(self.images, images, strict=True)):
            if self.now.tiles and self.may_close:
                self.close()
            elif not self.now.tiles:
                self.images = OPEN
        both = zip(self.images, images, strict=True)
        left, right, top, bottom = (max(mine, its) if mine and its else mine + its for mine, its in both)
        self.images = left, right, top, bottom

    @property
    def chain(self) -> list[ClosedMap]:
        """The closed maps and what is undone: what a place is looked up in after the map, the last one first."""
        undone = [] if self.undone is None else [ClosedMap(self.undone, (0, 0, *self.size), self.images)]
        return self.closed + undone

    @property
    def _pairs(self) -> list[tuple[TiledField, TiledField, dict[str, Field]]]:
        """The map and what is undone, the field each is redrawn into, and what `Draw` is told."""
        pairs: list[tuple[TiledField, TiledField, dict[str, Field]]] = [(self.now, self._next, {})]
        if self.undone is not None and self._next_undone is not None:
            pairs.append((self.undone, self._next_undone, {"undone": self.undone}))
        return pairs

    def draw(self, part: float, draw: Draw, held: Field | None = None) -> bool:
        """Do a `part`, 0-1, of what is planned; `held`: where the map is held.

        Returns:
            False if that became too steep for its texels: then nothing is taken over, and the map as it was is closed.
        """
        before, until = self._done, math.ceil(part * (len(self._moved) + len(self._copied)))
        count, anew = len(self._moved), self._moved[before:until]
        for now, after, undone in self._pairs:
            if anew:
                draw(after, anew, **undone)
            after.take(now, self._copied[max(before - count, 0) : max(until - count, 0)])
        if anew:
            self._look(anew)
        self._done = max(before, until)
        if part < 1:
            return True
        # A submap by itself is as steep as it is: closing a map of nothing would not mend that.
        if self.may_close and self.now.tiles and self._is_too_steep(held):
            self.close()
            return False
        self.now, self._next = self._next, self.now
        self.undone, self._next_undone = self._next_undone, self.undone
        self._stale = set(self._moved)
        self._moved, self._copied, self._done = [], [], 0
        return True

    @property
    def _times(self) -> int:
        """How many of its texels along a side become one if the whole of it is closed."""
        least = (self.finest * n / side / CLOSED_TEXELS for n, side in zip(self.size, self.extent, strict=True))
        fitting = math.sqrt(self.now.nbytes * MOST_CLOSED / MOST_CLOSED_BYTES)
        return max(min(math.ceil(fitting), *map(math.floor, least)), 1)

    @property
    def _kept(self) -> tuple[Region, int] | None:
        """The texels of it that are kept once it is closed, and how many along a side become one; None: no room."""
        if self._has_room((0, 0, *self.size), self._times):
            return (0, 0, *self.size), self._times
        box = self._box
        return (box, 1) if self._has_room(box, 1) else None

    def _has_room(self, region: Region, times: int) -> bool:
        """True if a region of it can be closed, `times` of its texels along a side becoming one."""
        taken = sum(closed.field.nbytes for closed in self.closed)
        texels = -(-region[2] // times) * -(-region[3] // times)
        return taken + 4 * texels * sum(field.components for field, _, _ in self._pairs) <= MOST_CLOSED_BYTES

    @property
    def _box(self) -> Region:
        """The tiles of it that are not nothing, and `RIM` texels around them."""
        tiles = np.array([tile for field, _, _ in self._pairs for tile in field.tiles] or [(0, 0, 1, 1)])
        left, top = np.maximum(tiles[:, :2].min(axis=0) - RIM, 0).tolist()
        right, bottom = np.minimum((tiles[:, :2] + tiles[:, 2:]).max(axis=0) + RIM, self.size).tolist()
        return left, top, right - left, bottom - top

    @property
    def may_close(self) -> bool:
        """True if there is room for another closed map."""
        return len(self.chain) < MOST_CLOSED and self._kept is not None

    def _look(self, tiles: list[Region]) -> None:
        """Look at how steep tiles of `_next` are, if another map may be closed."""
        if self.may_close:
            self._steepness.look(self._next, self._spacing, tiles)

    def _is_too_steep(self, held: Field | None) -> bool:
        """True if the map that was drawn is more than its texels carry, and was not so before; waits for the GPU."""
        steepest = self._steepness.found()
        if not FLAT**2 < steepest <= self._steepest**2:
            return steepest > FLAT**2
        even = partial(self._evenness.of, spacing=self._spacing, images=self.edges, regions=self._moved, held=held)
        return even(self._next) < LEAST_EVEN <= even(self.now)

    @property
    def _steepest(self) -> float:
        """The largest |grad A| that it carries, with as many texels as it will have once it is closed."""
        times = self._times if self._kept is None else self._kept[1]
        texels = self.finest / max(self._spacing) / times
        return STEEPEST * max(texels / LEAST_TEXELS, 1.0) ** 0.75

    @property
    def _spacing(self) -> tuple[float, float]:
        return self.extent[0] / self.size[0], self.extent[1] / self.size[1]

    def close(self) -> None:
        """Keep it as it is, and go on with a map of nothing; what was planned is forgotten."""
        self.forget()
        region, times = self._kept or ((0, 0, *self.size), self._times)
        steep = [self.now] if self.undone is None else [self.undone, self.now]
        if region[2:] == self.size and times == 1:
            self.closed += [ClosedMap(now, region, self.images) for now in steep]
            self.now, self.undone = self._blank(2, "accumulated map"), None
        else:
            self.closed += [ClosedMap(self._copy(now, region, times), region, self.images) for now in steep]
            # Clearing the map itself would copy at once what saves hold of it.
            self.now, self._next = self._next, self.now
            self.now.clear()
        self._drop_undone()
        self.finest, self.images = 1.0, OPEN
        self._stale = set(self._next.tiles)  # cleared with the next remap, a few in each step

    def _copy(self, now: TiledField, region: Region, times: int) -> TiledField:
        """Its texels in a region; or of all of it, one for so many along a side."""
        x, y, *sides = region
        width, height = (-(-side // times) for side in sides)
        closed = self._blank(now.components, "closed map", (width, height))
        if times == 1:
            self.device.pass_("gl/copy.frag")(closed, field=now, offset=(x, y))
        else:
            resample = self.device.pass_("warp/resample.frag", CUBIC=1)
            regions = [_resampled(tile, self.size, closed.size) for tile in now.tiles]
            resample(closed, region=regions, displacement=now, images=self.edges, origin=(0.0, 0.0), step=closed.texel)
        return closed

    def forget(self) -> None:
        """Drop what is planned."""
        self._stale.update(self._moved[: self._done])
        self._moved, self._copied, self._done = [], [], 0

    def undo(self, region: Region, draw: Draw, edge: float) -> None:
        """Redraw a region at once, with what is undone of the closed maps, if there are any; nothing may be planned.

        `edge`: how wide the brush's edge is, longer sides: what it leaves is as detailed as on cells half as large.
        """
        self.finest = min(self.finest, edge / 2)
        if self.closed and self.undone is None:
            self._begin_undoing()
        for _, after, undone in self._pairs:
            draw(after, [region], **undone)
        for now, after, _ in self._pairs:
            now.copy_from(after, region)
        self._stale.update(tile for tile in self._tiles if _meet(tile, region))

    def _begin_undoing(self) -> None:
        fields = (self._blank(UNDONE_COMPONENTS, f"what is undone{more}") for more in ("", ", anew"))
        self.undone, self._next_undone = fields

    def _blank(self, components: int, label: str, size: tuple[int, int] | None = None) -> TiledField:
        return TiledField(self.device, size or self.size, components, label)

    def set(self, draw: Callable[[Field], None], limits: Limits) -> None:
        """Draw all of it anew, with places within these limits, and no closed maps; what was planned is forgotten."""
        self.forget()
        self._open()
        draw(self.now)
        self._stale = set(self._tiles)
        self.limits, self.is_walled = limits, False
        self.finest = 0.0

    def saved(self) -> dict[str, TiledField]:
        """The fields by name, to be saved."""
        names = (f"{UNDONE if closed.is_undone else CLOSED}{number}" for number, closed in enumerate(self.chain))
        return {ACCUMULATED: self.now} | dict(zip(names, (closed.field for closed in self.chain), strict=True))

    def restore(
        self,
        saved: dict[str, SavedTiles],
        closed: list[tuple[Region, Images]],
        limits: Limits,
        is_walled: bool,
        images: Images,
        finest: float,
    ) -> None:
        """Go back to what `saved` gave, as it was then, with all else of then; what was planned is forgotten.

        `closed`: the regions and images of `chain`.
        """
        self.forget()
        self._stale.update(self.now.restore(saved[ACCUMULATED]))
        names = closed_in(saved)
        undone = saved[names.pop()] if names and names[-1].startswith(UNDONE) else None
        kinds = [(saved[name].kind, *places) for name, places in zip(names, closed, strict=False)]
        mine = ((field.kind, region, images) for field, region, images in self.closed)
        same = sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(mine, kinds, strict=False)))
        self._open(same)
        for kind, region, beyond in kinds[same:]:
            self.closed.append(ClosedMap(self._blank(kind.components, "closed map", kind.size), region, beyond))
        for name, one in zip(names, self.closed, strict=True):
            one.field.restore(saved[name])
        if undone is None:
            self._drop_undone()
        elif self.undone is None:
            self._begin_undoing()
        if undone is not None and self.undone is not None:
            self._stale.update(self.undone.restore(undone))
        self.limits, self.is_walled, self.images, self.finest = limits, is_walled, images, finest

    def clear(self) -> None:
        """The identity; what was planned is forgotten."""
        self.forget()
        self._open()
        for field in (self.now, self._next):
            field.clear()
        self._stale.clear()
        self.finest = 1.0
        self.limits, self.is_walled, self.images = self._picture, True, OPEN

    def release(self) -> None:
        """Free the textures."""
        self._open()
        for thing in (self.now, self._next, self._steepness, self._evenness):
            thing.release()

    def _open(self, left: int = 0) -> None:
        """Drop the closed maps but the first so many, and what is undone of them."""
        while len(self.closed) > left:
            self.closed.pop().field.release()
        if not left:
            self._drop_undone()

    def _drop_undone(self) -> None:
        for field in (self.undone, self._next_undone):
            if field is not None:
                field.release()
        self.undone = self._next_undone = None


def _resampled(tile: Region, size: tuple[int, int], fewer: tuple[int, int]) -> Region:
    """The texels of a field of fewer texels that are interpolated from a tile."""
    x, y, width, height = tile
    spans = []
    for start, length, texels, left in zip((x, y), (width, height), size, fewer, strict=True):
        first, last = start * left // texels - 1, -(-(start + length) * left // texels) + 1
        spans.append((max(first, 0), min(last, left)))
    (left, right), (top, bottom) = spans
    return left, top, right - left, bottom - top


def _meet(a: Region, b: Region) -> bool:
    """True if two regions have something in common."""
    return all(a[k] < b[k] + b[k + 2] and b[k] < a[k] + a[k + 2] for k in (0, 1))

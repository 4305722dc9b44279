"""What of a picture is frozen, as the map knows it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import ceil, floor
from typing import Any

import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.passes import Region
from solver.gl.tiled import TILE, SavedTiles, TiledField
from solver.warp.accumulated import intersection, overlap, tiles_of


class Frozen:
    """A copy of a mask over the whole picture, of any size, 1 where it is frozen; none at first.

    Args:
        device: the device.
        size: (width, height) of the accumulated map in texels.

    Attributes:
        near: how near each of those texels is to what is frozen, as `warp/near.frag` has it; None if nothing is.
        saved: the mask as it was saved; None before any was given.
    """

    def __init__(self, device: Device, size: tuple[int, int]) -> None:
        self.device = device
        self.size = size
        self.near: Field | None = None
        self.saved: SavedTiles | None = None
        self._mask: TiledField | None = None
        self._cell = (0.0, 0.0)

    def differs(self, saved: SavedTiles | None) -> bool:
        """True if another place is frozen in what was saved."""
        if self.saved and saved and self.saved.kind != saved.kind:
            return True
        return any(_changed(self.saved, saved))

    def restore(self, saved: SavedTiles | None, cell: tuple[float, float]) -> None:
        """Be what was saved, for submaps with `cell` texels along their cells; the caller may release that."""
        before, self.saved = self.saved, None if saved is None else saved.held()
        if before is not None and (saved is None or saved.kind != before.kind):
            before.release()
            before = None
            self._let_go()
        if saved is None or not any(_changed(None, saved)):
            self._let_go()
        else:
            if self._mask is None:
                size, components, dtype, tile = saved.kind
                self._mask = TiledField(self.device, size, components, "frozen", dtype, tile)
            self._mask.restore(saved)
            if self.near is None:
                self.near = self.device.field(self.size, 1, "near to what is frozen", "nu2")
                self._find(_changed(None, saved), cell)
            else:
                self._find(_changed(before, saved), self._cell)
                self.fade_over(cell)
        if before is not None:
            before.release()

    def fade_over(self, cell: tuple[float, float]) -> None:
        """From now on submaps have `cell` texels along their cells."""
        if self.near is not None and cell != self._cell:
            self.near.clear()
            self._find(_changed(None, self.saved), cell)

    def _find(self, regions: Iterable[Region], cell: tuple[float, float]) -> None:
        """Find `near` anew about regions of the mask."""
        assert self._mask is not None
        assert self.near is not None
        self._cell = cell
        # The cubic at the corners of a frozen pixel reaches two texels beyond it, and another where the mask's edges
        # are not the texels' own.
        held = 2 if self._mask.size == self.size else 3
        reach = ceil(max(cell)) + held + 1
        across, down = (n / of for n, of in zip(self.size, self._mask.size, strict=True))
        about = [
            (
                floor(x * across) - reach,
                floor(y * down) - reach,
                ceil(width * across) + 2 * reach + 1,
                ceil(height * down) + 2 * reach + 1,
            )
            for x, y, width, height in regions
        ]
        rows = self.device.field((TILE, TILE + 2 * reach), 1, "frozen, along x")
        draw, along = (self.device.pass_("warp/near.frag", **defines) for defines in ({}, {"ALONG_X": 1}))
        for tile in tiles_of(self.size):
            if parts := [intersection(tile, region) for region in about if overlap(tile, region)]:
                x, y = min(part[0] for part in parts), min(part[1] for part in parts)
                width, height = (max(part[k] + part[k + 2] for part in parts) - (x, y)[k] for k in (0, 1))
                inputs: dict[str, Any] = {"size": self.size, "reach": float(held)}
                above = (0, 0, width, height + 2 * reach)
                along(rows, region=above, frozen=self._mask, offset=(x, y - reach), cell=cell[0], **inputs)
                part = x, y, width, height
                draw(self.near, region=part, frozen=rows, offset=(-x, reach - y), cell=cell[1], **inputs)
        rows.release()

    @property
    def nbytes(self) -> int:
        """Bytes of texture memory."""
        return sum(field.nbytes for field in (self._mask, self.near) if field is not None)

    def release(self) -> None:
        """Free the textures."""
        self.restore(None, self._cell)

    def _let_go(self) -> None:
        for field in (self._mask, self.near):
            if field is not None:
                field.release()
        self._mask = self.near = None


def saved_of(device: Device, mask: Field) -> SavedTiles:
    """A field's values as a tiled one would save them; whoever has it releases it."""
    if isinstance(mask, TiledField):
        return mask.save()
    tiled = TiledField(device, mask.size, mask.components, "mask", mask.dtype)
    tiled.set(mask.get())
    saved = tiled.save()
    tiled.release()
    return saved


def _changed(before: SavedTiles | None, now: SavedTiles | None) -> Iterator[Region]:
    """Regions about all that is frozen in one of two saves of a kind and not in the other, each within a tile."""
    some = now or before
    if some is None:
        return

    def frozen(saved: SavedTiles | None, place: int) -> np.ndarray | bool:
        field = None if saved is None else saved.tiles.flat[place].field
        return field is not None and field.get() > (127 if saved and saved.kind.dtype == "f1" else 0.5)

    for place, (x, y, width, height) in enumerate(some.kind.regions):
        if before and now and before.tiles.flat[place] is now.tiles.flat[place]:
            continue
        changed = np.full((height, width), frozen(before, place)) ^ frozen(now, place)
        rows, columns = (np.flatnonzero(changed.any(axis=axis)) for axis in (1, 0))
        if rows.size:
            left, top = int(columns[0]), int(rows[0])
            yield x + left, y + top, int(columns[-1]) + 1 - left, int(rows[-1]) + 1 - top

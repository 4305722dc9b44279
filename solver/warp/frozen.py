"""What of a picture is frozen, as the map knows it."""

from __future__ import annotations

from math import ceil, floor
from typing import Any

import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.passes import Region
from solver.gl.tiled import TILE, SavedTiles, TiledField
from solver.warp.accumulated import box, common, overlap, tiles_of


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
        """True if it is not what was saved."""
        if self.saved is None or saved is None:
            return any(some is not None and not _is_blank(some) for some in (self.saved, saved))
        return self.saved.kind != saved.kind or not _same(self.saved, saved)

    def restore(self, saved: SavedTiles | None, cell: tuple[float, float]) -> None:
        """Be what was saved, for submaps with `cell` texels along their cells; the caller may release that."""
        held = None if saved is None else saved.held()
        if self.saved is not None:
            self.saved.release()
        self.saved = held
        if held is None or _is_blank(held):
            self._let_go()
            return
        is_new = self._mask is None or self._mask.kind != held.kind
        if is_new:
            self._let_go()
            size, components, dtype, tile = held.kind
            self._mask = TiledField(self.device, size, components, "frozen", dtype, tile)
            self.near = self.device.field(self.size, 1, "near to what is frozen", "nu2")
        assert self._mask is not None
        changed = self._mask.restore(held)
        if is_new or cell != self._cell:
            self._find_all(cell)
        else:
            self._find(changed)

    def fade_over(self, cell: tuple[float, float]) -> None:
        """From now on submaps have `cell` texels along their cells."""
        if self._mask is not None and cell != self._cell:
            self._find_all(cell)

    def _find_all(self, cell: tuple[float, float]) -> None:
        """Find `near` anew for submaps with `cell` texels along their cells."""
        assert self.saved is not None
        assert self.near is not None
        self._cell = cell
        self.near.clear()
        tiles = zip(self.saved.tiles.flat, self.saved.kind.regions, strict=True)
        self._find([region for tile, region in tiles if tile.field is not None])

    def _find(self, regions: list[Region]) -> None:
        """Find `near` anew about regions of the mask."""
        assert self._mask is not None
        assert self.near is not None
        cell = self._cell
        # Where the map's texels are the mask's they are the pixels too, and hardly anybody looks between them.
        held = 1 if self._mask.size == self.size else 3
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
            parts = [common(tile, region) for region in about if overlap(tile, region)]
            if parts:
                x, y, width, height = box(parts)
                inputs: dict[str, Any] = {"size": self.size, "reach": float(held)}
                beside = (0, 0, width, height + 2 * reach)
                along(rows, region=beside, frozen=self._mask, offset=(x, y - reach), cell=cell[0], **inputs)
                draw(
                    self.near, region=(x, y, width, height), frozen=rows, offset=(-x, reach - y), cell=cell[1], **inputs
                )
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


def saved_of(mask: Field) -> SavedTiles:
    """A field's values as a tiled one would save them; whoever has it releases it."""
    if isinstance(mask, TiledField):
        return mask.save()
    tiled = TiledField(mask.device, mask.size, mask.components, "mask", mask.dtype)
    tiled.set(mask.get())
    saved = tiled.save()
    tiled.release()
    return saved


def _is_blank(saved: SavedTiles) -> bool:
    return not any(texture.get().any() for texture in saved.textures)


def _same(a: SavedTiles, b: SavedTiles) -> bool:
    """True if two saves hold the same; what they share need not be looked at."""

    def values(saved: SavedTiles, place: int) -> np.ndarray | float:
        field = saved.tiles.flat[place].field
        return 0.0 if field is None else field.get()

    places = [place for place in range(a.tiles.size) if a.tiles.flat[place] is not b.tiles.flat[place]]
    return all(np.all(values(a, place) == values(b, place)) for place in places)

"""Where the map is frozen, and its displacement there."""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, floor
from typing import Any

import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.passes import Region, differing, hull, split
from solver.gl.tiled import SavedTiles, TiledField

# Texels: a place in a frozen pixel may be nearest to the next texel, and interpolation there reads two more to each
# side.
INNER, REACH = 1, 3
FADED = 31  # texels along an axis up to which distances are kept
BLOCK = 64  # texels along the blocks that are drawn

Draw = Callable[[Field, list[Region], Field, tuple[int, int], Field], None]
"""Draws the map into regions of a field, where it is held now (a field from a corner on) and was not held before."""


class Frozen:
    """Where the map is held, and its displacement there, texel by texel.

    Args:
        device: the device.
        size: (width, height) of the accumulated map in texels.

    Attributes:
        held: 1 where a place is held, 2/3 where only a texel's middle is; else (127 - so many texels away) / 255 along
            the axes, or 0; None as long as nothing was frozen.
        kept: the displacement where it is held, longer sides.
        box: about all texels of `held` that are not 0; None if all are.
    """

    def __init__(self, device: Device, size: tuple[int, int]) -> None:
        self.device = device
        self.size = size
        self.held: TiledField | None = None
        self.kept: TiledField | None = None
        self.box: Region | None = None

    def hold(self, mask: Field, changed: Region, draw: Draw) -> None:
        """Hold what a mask over the whole picture, of any size, freezes in a region; release the rest of the region."""
        held, kept = self._fields()
        (x, right), (y, bottom) = (
            (floor(changed[k] * n / of), ceil((changed[k] + changed[k + 2]) * n / of))
            for k, n, of in zip((0, 1), self.size, mask.size, strict=True)
        )
        region = x, y, width, height = _grown((x, y, right - x, bottom - y), REACH, self.size)
        top, bottom = max(y - REACH, 0), min(y + height + REACH, self.size[1])  # beyond the map it is as on its edge
        rows = self.device.field((width, bottom - top), 1, "frozen, along x", "f1")
        now = self.device.field((width, height), 1, "held now", "f1")
        along_x, along_y = (self.device.pass_("warp/hold.frag", **defines) for defines in ({"ALONG_X": 1}, {}))
        reach: dict[str, Any] = {"inner": float(INNER), "reach": float(REACH)}
        along_x(rows, frozen=mask, offset=(x, top), size=self.size, **reach)
        along_y(now, frozen=rows, offset=(0.0, y - top), size=rows.size, **reach)
        values = now.get()
        blocks = [(x + i, y + j, w, h) for i, j, w, h in _blocks_of((values > 0) & (held.get(region) < 128))]
        draw(kept, blocks, now, (x, y), held)
        left, top, *_ = around = _grown(region, 2 * FADED, self.size)
        near = held.get(around)
        near[near < 128] = 0
        near[y - top :, x - left :][:height, :width] = values
        x, y, width, height = region = _grown(region, FADED, self.size)
        faded = _faded(near)[y - top :, x - left :][:height, :width]
        held.set(faded, region)
        self._reach(faded, x, y)
        rows.release()
        now.release()

    def draw_anew(self, draw: Draw) -> None:
        """Draw the displacement again wherever it is held."""
        if self.held and self.kept:
            nothing = self.device.field((1, 1), 1, "nothing held", "f1")
            draw(self.kept, _blocks_of(self.held.get() > 127), self.held, (0, 0), nothing)
            nothing.release()

    def widen(self, target: Field, window: tuple[float, float, float, float], extent: tuple[float, float]) -> None:
        """Draw 1 into cells with something held in them and those within two of them, else 0.

        Args:
            target: the cells.
            window: left, top, width and height of what they cover, within the picture, longer sides.
            extent: (width, height) of the picture.
        """
        cells = self.device.field(target.size, 1, "cells with something held", "f1")
        origin = window[0] / extent[0], window[1] / extent[1]
        cell = window[2] / extent[0] / target.width, window[3] / extent[1] / target.height
        average = self.device.pass_("step/average_frozen.frag")
        average(cells, frozen=self.held, origin=origin, cell=cell)
        self.device.pass_("step/widen_solid.frag")(target, frozen=cells)
        cells.release()

    def parts(
        self, regions: list[Region], origin: tuple[float, float], step: tuple[float, float]
    ) -> list[tuple[bool, list[Region]]]:
        """Split regions of a target into parts near held places, within `FADED` texels, and others.

        Args:
            regions: of the target's texels.
            origin, step: a texel stands for the place (texel + origin) step, 0-1 of the picture.
        """
        if self.held is None or self.box is None:
            return [(False, regions)]
        # For each place the texels around it are read, up to one away.
        (x, right), (y, bottom) = (
            (floor((self.box[k] - 1) / (step[k] * n) - origin[k]) - 1,
             ceil((self.box[k] + self.box[k + 2] + 1) / (step[k] * n) - origin[k]) + 1)
            for k, n in enumerate(self.size)
        )  # fmt: skip
        pairs = [split(region, (x, y, right - x, bottom - y)) for region in regions]
        found = [(is_near, [part for pair in pairs for part in pair[0 if is_near else 1]]) for is_near in (True, False)]
        return [(is_near, parts) for is_near, parts in found if parts]

    def inputs(self) -> dict[str, Any]:
        """It as `lib/warp.glsl` has it; nothing if nothing was frozen."""
        return {"held": self.held, "kept": self.kept} if self.held and self.kept else {}

    def save(self) -> dict[str, SavedTiles]:
        """What is held, by name, which the caller releases; nothing if nothing was frozen."""
        return {"held": self.held.save(), "kept": self.kept.save()} if self.held and self.kept else {}

    def restore(self, tiles: dict[str, SavedTiles]) -> None:
        """Be what `save` gave."""
        if "held" not in tiles:
            self.release()
        else:
            for name, field in zip(("held", "kept"), self._fields(), strict=True):
                field.restore(tiles[name])
            self.box = None
            held = tiles["held"]
            for region, tile in zip(held.kind.regions, held.tiles.flat, strict=True):
                if not tile.is_blank:
                    self._reach(tile.get(region), *region[:2])

    def release(self) -> None:
        """Hold nothing any more."""
        for field in (self.held, self.kept):
            if field is not None:
                field.release()
        self.held = self.kept = self.box = None

    def _reach(self, held: np.ndarray, x: int, y: int) -> None:
        """Extend the box to all texels of `held` that are not 0; its first texel is (x, y)."""
        if box := differing(np.zeros_like(held), held):
            self.box = hull((x + box[0], y + box[1], *box[2:]), self.box)

    def _fields(self) -> tuple[TiledField, TiledField]:
        """Both, made at the first use."""
        if self.held is None or self.kept is None:
            self.held = TiledField(self.device, self.size, 1, "held", "f1")
            self.kept = TiledField(self.device, self.size, 2, "kept")
        return self.held, self.kept


def _grown(region: Region, by: int, size: tuple[int, int]) -> Region:
    """A region with so many texels more on each side, within a size."""
    (x, right), (y, bottom) = (
        (max(region[k] - by, 0), min(region[k] + region[k + 2] + by, n)) for k, n in enumerate(size)
    )
    return x, y, right - x, bottom - y


def _faded(held: np.ndarray) -> np.ndarray:
    """What is held, with 127 less the texels to it, counted along both axes, where it is not; 0 beyond `FADED`."""
    rows, columns = (np.flatnonzero(held.any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        return held
    faded = held.copy()
    box = tuple(slice(max(at[0] - FADED, 0), at[-1] + FADED + 1) for at in (rows, columns))
    near = np.minimum(held[box], 127)
    for along in (near, near.T):
        for step in (1, 2, 4, 8, 16):  # which add up to each distance up to `FADED`
            less = np.maximum(along, step) - step
            np.maximum(along[step:], less[:-step], out=along[step:])
            np.maximum(along[:-step], less[step:], out=along[:-step])
    faded[box] = np.maximum(held[box], near)
    return faded


def _blocks_of(wanted: np.ndarray) -> list[Region]:
    """The blocks with something in them that is true."""
    (height, width), sides = wanted.shape, (range(0, n, BLOCK) for n in wanted.shape)
    rows, columns = sides
    found = np.logical_or.reduceat(np.logical_or.reduceat(wanted, rows, axis=0), columns, axis=1)
    return [
        (columns[i], rows[j], min(BLOCK, width - columns[i]), min(BLOCK, height - rows[j]))
        for j, i in np.argwhere(found).tolist()
    ]

"""What the accumulated map still has to take in, a few tiles at a time."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.passes import Region
from solver.gl.tiled import TILE
from solver.grid import Grid
from solver.warp.accumulated import LEAST_TEXELS, AccumulatedMap
from solver.warp.frozen import Frozen
from solver.warp.submap import Level, Submap, away_from_held, defines_of, inputs_of, window_of

REMAP_STEPS = 8  # steps over which a remap is spread, at least
# Tiles redrawn in a step, half as much work as a step of the fluid, unless a level of another grid has to be finished.
MOST_TILES = 4
# Texels of the gathered level, along a cell and in all, but at least `LEAST_TEXELS` along a cell.
MOST_GATHERED = 16, 2**19
FEW_TILES = MOST_GATHERED[1] // TILE**2  # that are no more work than to gather


class Remapping:
    """Submaps that are being taken into the accumulated map.

    The *pending* one is taken in tile by tile, and stands above the accumulated map until all tiles are done. What is
    given meanwhile is *gathered* in a level above it, which is pending next: one submap as it is, more of them, or one
    with weights, resampled with several texels a cell.

    Args:
        device: the device.
        accumulated: the map that takes in.
        frozen: where it is held.
    """

    def __init__(self, device: Device, accumulated: AccumulatedMap, frozen: Frozen) -> None:
        self.device = device
        self._accumulated = accumulated
        self._frozen = frozen
        self._gathered: Level | None = None  # only while another is pending
        self._pending: Level | None = None
        self._tiles = 0  # to be redrawn for it
        self._begun = self._done = 0  # progress, of `_whole`, at the start and now

    @property
    def levels(self) -> list[Level]:
        """The levels between the submap and the accumulated map, the uppermost first."""
        return [level for level in (self._gathered, self._pending) if level is not None]

    @property
    def is_idle(self) -> bool:
        """True if nothing is being taken in."""
        return self._pending is None

    def advance(self, grid: Grid) -> None:
        """Go on by one step; `grid` is the submap's."""
        if self._pending is not None:
            # What is gathered on another grid is to be pending before the submap on this one needs a remap.
            gathered, pending = self._gathered, self._pending
            waits = gathered is not None and gathered.grid != grid and not _are_alike(gathered, pending)
            self._done += self._whole // REMAP_STEPS if waits else REMAP_STEPS
            self._take_in(min(self._done / self._whole, 1.0))

    def give(self, submap: Submap, is_weighed: bool) -> None:
        """Take over what a submap holds, weighted or not, and empty it."""
        if self._tiles * (1 - self._done / self._whole) <= FEW_TILES:
            self._take_in(1.0)
        while self._gathered is not None and not _are_alike(self._gathered, submap):
            if self._pending is not None and _are_alike(self._gathered, self._pending):
                self._join()
            else:
                self._take_in(1.0)  # then what is gathered is pending
        if self._pending is not None:
            self._gather(submap, is_weighed)
        elif self._stand_by(submap.level(is_weighed)):
            submap.replace()

    def settle(self) -> None:
        """Fix the weights of the pending level as they are now, before the mask changes."""
        if self._pending is not None and self.is_weighed:
            coarse, fine = self._pending, self._resampled([self._pending])
            coarse.release()
            if not self._stand_by(fine, self._done):
                fine.release()
                self._go_on()

    def finish(self) -> None:
        """Take everything into the accumulated map at once."""
        if self._gathered is None:
            while self._pending is not None:
                self._take_in(1.0)
        else:
            while self._begin(self.levels) and not self._draw_anew(self.levels, 1.0):
                pass
            self.drop()

    def drop(self) -> None:
        """Drop all levels."""
        for level in self.levels:
            level.release()
        self._gathered = self._pending = None

    # -- its state --------------------------------------------------------------------------------------------------

    def saved(self) -> Iterator[tuple[str, Level]]:
        """The levels by name."""
        for name, level in (("gathered", self._gathered), ("pending", self._pending)):
            if level is not None:
                yield name, level

    @property
    def progress(self) -> int:
        """How far the pending level is, for `restore`."""
        return self._done

    @property
    def is_weighed(self) -> bool:
        """True if the pending level is weighted."""
        return self._pending is not None and self._pending.is_weighed

    def restore(self, saved: dict[str, Level], progress: int) -> None:
        """Go on with copies of what `saved` gave; the accumulated map is that of then."""
        self.drop()
        copies = {}
        for name, level in saved.items():
            copied = self.device.field(level.field.size, 2, f"{name} submap")
            copied.copy_from(level.field)
            copies[name] = Level(copied, level.grid, level.is_weighed, level.images)
        self._gathered, pending = copies.get("gathered"), copies.get("pending")
        if pending is not None:
            self._stand_by(pending, progress)

    # -- its parts --------------------------------------------------------------------------------------------------

    def _stand_by(self, moved: Level, progress: int = 0) -> bool:
        """Make a level pending, from a `progress` on; False if there is nothing to take in."""
        self._tiles = self._begin([moved])
        self._begun = self._done = max(0, min(progress, self._whole - 1))
        self._pending = moved if self._tiles else None
        return self._tiles > 0

    def _begin(self, levels: list[Level]) -> int:
        """Plan the accumulated map's tiles anew that these levels move; how many there are."""
        is_held = self._frozen.held is not None
        for level in levels:
            self._accumulated.take_sides(level.images_at_edges)
        return self._accumulated.begin(*((level.field.get(), level.grid) for level in levels), is_held=is_held)

    def _gather(self, submap: Submap, is_weighed: bool) -> None:
        """Add a submap to the gathered level; the first one is that level, unless its weights have to be fixed."""
        before, level = self._gathered, submap.level(is_weighed)
        if before is None and not is_weighed:
            self._gathered = level
            submap.replace()
            return
        self._gathered = self._resampled([level] if before is None else [level, before])
        submap.read.clear()
        submap.changed()
        if before is not None:
            before.release()

    def _join(self) -> None:
        """Make what is gathered and what is pending, on one grid, a single pending level, taken in from its start."""
        levels, self._gathered, self._pending = self.levels, None, None
        joined = self._resampled(levels)
        for level in levels:
            level.release()
        if not self._stand_by(joined):
            joined.release()

    def _resampled(self, levels: list[Level]) -> Level:
        """The composition of levels of one grid, with several texels a cell."""
        grid, (most, in_all) = levels[0].grid, MOST_GATHERED
        times = max(LEAST_TEXELS, min(math.isqrt(in_all // (grid.nx * grid.ny)), most))
        largest = self.device.limits.max_texture_size  # `Differences` are twice as high, with a border
        times = max(1, min(times, (largest - 2) // grid.nx, (largest // 2 - 2) // grid.ny))
        field = self.device.field((times * grid.nx, times * grid.ny), 2, "gathered submap")
        compose = self.device.pass_("warp/compose.frag", GATHER=1, **defines_of(levels))
        left, top, width, height = window_of(grid)
        step = width / field.width, height / field.height
        origin = left / step[0], top / step[1]
        fractions = np.divide(step, grid.picture).tolist()
        compose(
            field,
            **self._accumulated.own(),
            **inputs_of(self.device, levels, self._accumulated.edges, self._frozen.inputs()),
            origin=origin,
            step=fractions,
        )
        return Level(field, grid, images=levels[0].images)

    def _take_in(self, part: float) -> None:
        """Do a `part`, 0-1, of taking in the pending level."""
        if self._pending is None:
            return
        begun = self._begun / self._whole
        if not self._draw_anew([self._pending], (part - begun) / (1 - begun)):
            self._stand_by(self._pending)
        elif part >= 1:
            self._pending.release()
            self._go_on()

    def _go_on(self) -> None:
        """Make the gathered level, if there is one, the pending one."""
        gathered, self._gathered, self._pending = self._gathered, None, None
        if gathered is not None and not self._stand_by(gathered):
            gathered.release()

    def _draw_anew(self, levels: list[Level], part: float) -> bool:
        """Redraw a `part` of the accumulated map's tiles that are planned for these levels; False: see there."""
        fine = {"CUBIC": 1} if all(self._accumulated.is_fine(level.grid) for level in levels) else {}
        accumulated, held = self._accumulated, self._frozen.inputs()
        inputs = accumulated.own() | inputs_of(self.device, levels, accumulated.edges, held)

        def draw(target: Field, regions: list[Region], /, **undone: Any) -> None:
            # Also where it is held: places next to that may look into it, and it goes on from there once released.
            for is_near, parts in self._frozen.parts(regions, (0.0, 0.0), target.texel):
                defines = defines_of(levels if is_near else away_from_held(levels))
                carry = {"CARRY": 1} if undone else {}
                compose = self.device.pass_("warp/compose.frag", REMAP=1, **fine, **carry, **defines)
                compose(target, region=parts, **inputs, **undone)

        return self._accumulated.draw(part, draw, self._frozen.held)

    @property
    def _whole(self) -> int:
        """`REMAP_STEPS` times the steps that the pending level is taken in over, if nothing waits."""
        return REMAP_STEPS * max(REMAP_STEPS, math.ceil(self._tiles / MOST_TILES))


def _are_alike(one: Level | Submap, other: Level | Submap) -> bool:
    """True if they can be composed into one level."""
    return (one.grid, one.images) == (other.grid, other.images)

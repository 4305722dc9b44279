"""A warp map at an amount."""

from __future__ import annotations

from typing import Any

import numpy as np

from solver.gl.field import Field, FieldPool
from solver.gl.passes import Region
from solver.gl.points import draw_at
from solver.limits import check_type, places
from solver.warp.distortion import MapStatistics
from solver.warp.map import WarpMap


class ScaledMap:
    """A part of what a warp map W does, or more than all of it: (S8) of solver/README.md; 0 and 1 are exact to the bit.

    Args:
        warp: the map; what it looks like follows it.
        amount: a, 0 to 2; may be set, a `ValueError` otherwise.

    Attributes:
        extent, size, coarse_size, device: the map's.
    """

    def __init__(self, warp: WarpMap, amount: float = 1.0) -> None:
        self.warp = warp
        self.amount = amount
        self.device, self.extent, self.size = warp.device, warp.extent, warp.size
        self._fields = FieldPool(warp.device, "scaled map")
        self._drawn: object = None

    @property
    def amount(self) -> float:
        return self._amount

    @amount.setter
    def amount(self, amount: float) -> None:
        check_type("the amount of a map", amount)
        if not 0 <= amount <= 2:
            raise ValueError(f"an amount of {amount:g} of a map was asked for; it must be from 0 to 2")
        self._amount = amount

    @property
    def version(self) -> tuple[int, float]:
        """What it looks like depends on no more."""
        return self.warp.version, self.amount

    @property
    def is_untouched(self) -> bool:
        """As `WarpMap.is_untouched`."""
        return self.warp.is_untouched

    @property
    def held(self) -> Field | None:
        return self.warp.held

    @property
    def coarse_size(self) -> tuple[int, int]:
        return self.warp.coarse_size

    def size_for(self, picture: tuple[int, int], result: tuple[int, int]) -> tuple[int, int]:
        """As `WarpMap.size_for`."""
        return self.warp.size_for(picture, result)

    @property
    def at_rest(self) -> Field | None:
        """As `WarpMap.at_rest`."""
        return self.warp.at_rest if self.amount == 1 else None

    def composed(self, size: tuple[int, int] | None = None, exact: bool = False) -> Field:
        """As `WarpMap.composed`."""
        size = self.size if size is None else size
        if self.amount == 1:
            return self.warp.composed(size, exact)
        field = self._fields.get("composed", size, 2)
        if self._drawn != (made := (self.version, size, exact)):
            self._draw(field, (0.0, 0.0), field.texel, exact)
            self._drawn = made
        return field

    def draw(
        self,
        target: Field,
        origin: tuple[float, float],
        step: tuple[float, float],
        exact: bool = False,
        coarsely: bool = False,
        regions: list[Region] | None = None,
    ) -> None:
        """As `WarpMap.draw`."""
        self._draw(target, origin, step, exact, coarsely, regions)

    def read(self, size: tuple[int, int] | None = None) -> np.ndarray:
        """As `WarpMap.read`."""
        if self.amount == 1:
            return self.warp.read(size)
        field = self._fields.get("read", self.coarse_size if size is None else size, 2)
        self._draw(field, (0.0, 0.0), field.texel, exact=True)
        return field.get()

    def at(self, points: np.ndarray) -> np.ndarray:
        """As `WarpMap.at`, between the texels of the accumulated map."""
        if self.amount == 1:
            return self.warp.at(points)
        field = self.composed(exact=True)
        return draw_at(self.device, places(points), self.extent, "warp/resample.frag", displacement=field)

    def statistics(self, size: tuple[int, int] | None = None) -> MapStatistics:
        """As `WarpMap.statistics`: of this part where something is held or it is 0, else of all: no less folds."""
        return self.warp.statistics(size, 1.0 if self.amount and self.warp.held is None else self.amount)

    def release(self) -> None:
        """Free the textures; the map stays."""
        self._fields.release()

    def _draw(
        self,
        target: Field,
        origin: tuple[float, float],
        step: tuple[float, float],
        exact: bool,
        coarsely: bool = False,
        regions: list[Region] | None = None,
    ) -> None:
        warp, amount, fields = self.warp, self.amount, self._fields
        if amount == 0:
            target.clear()
            return
        if amount == 1:
            warp.draw(target, origin, step, exact, coarsely=coarsely, regions=regions)
            return
        before, whole = None, fields.get("whole", target.size, 2)
        bent: dict[str, Any] = {}
        if amount > 1:  # first all of it, and a part of it after that
            amount, before = amount - 1, fields.get("before", target.size, 2)
            warp.draw(before, origin, step, exact, coarsely=coarsely, regions=regions)
            bent = {"scaled": before, "unscaled": before}
        warp.draw(whole, origin, step, exact, before, coarsely, regions)
        # Beside what is held the factors, of two texels a cell, are far from the map's own slopes.
        if not warp.factors.is_one and warp.held is None:
            for name, part in (("scaled", amount), ("unscaled", 1.0)):
                targets = fields.get(name, target.size, 2), fields.get(f"{name}, too", target.size, 2)
                bent[name] = warp.factors.draw(targets, part, warp.submap, origin, step, before, regions, warp.edges)
        if bent:
            bent |= {"picture": warp.factors.picture, "origin": origin, "step": step}
        scale = self.device.pass_("warp/scale.frag", **({"BENT": 1} if bent else {}))
        scale(target, region=regions, displacement=whole, amount=amount, **bent)

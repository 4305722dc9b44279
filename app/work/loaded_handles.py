"""The handles and pins of a recipe made into those that the solver leads."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from app.model.handles import RecipeHandle, RecipePin
from app.model.sampling import Point
from solver.brush.handle import Handle


class LoadedHandles:
    """Handles and pins of a recipe as the solver has them; of those that stay the same, the same are given again.

    Args:
        extent: of the picture; none is led out of it.
    """

    def __init__(self, extent: Point) -> None:
        self._extent = extent
        self._made: dict[int, tuple[RecipeHandle | RecipePin, Handle]] = {}  # by the identity of the former

    def of(self, led: Iterable[RecipeHandle | RecipePin]) -> list[Handle]:
        """Those of a recipe, in this order."""
        made = [self._made.get(id(one)) or (one, self._handle(one)) for one in led]
        self._made = {id(one): (one, handle) for one, handle in made}
        return [handle for _, handle in made]

    def _handle(self, one: RecipeHandle | RecipePin) -> Handle:
        extent = self._extent
        at = one.at[0] * extent[0], one.at[1] * extent[1]
        way: dict[str, Any] = {
            "points": np.multiply(one.points, extent) if one.points else (),
            "closed": one.closed,
        }
        if isinstance(one, RecipeHandle):
            way |= {"duration": one.duration, "local": one.local, "rotate": one.rotate, "scale": one.scale}
            way |= {"turned": one.turned}
            way |= {"to": one.to and self._within(one.to)}
            if one.keys:
                times, *place = np.array(one.keys).T
                way |= {"keys": np.stack([times, *(np.clip(place, 0.0, 1.0) * np.array(extent)[:, None])], axis=-1)}
            way |= {"goals": np.multiply(one.goals, extent) if one.goals else ()}
        return Handle(at, radius=one.radius, start=one.start, end=one.let_go, stiffness=one.stiffness, **way)

    def _within(self, place: Point) -> Point:
        x, y = (min(max(part, 0.0), 1.0) * side for part, side in zip(place, self._extent, strict=True))
        return x, y

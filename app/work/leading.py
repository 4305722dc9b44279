"""The handles and pins of a recipe made into those that the solver leads."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from app.model.handles import RecipeHandle, RecipePin
from app.model.sampling import Point
from solver.brush.handle import Handle


def handles_of(led: Iterable[RecipeHandle | RecipePin], extent: Point) -> list[Handle]:
    """Those of a recipe as the solver has them, in this order; none is led out of the picture, of sides `extent`."""

    def within(place: Point) -> Point:
        x, y = (min(max(part, 0.0), 1.0) * side for part, side in zip(place, extent, strict=True))
        return x, y

    made = []
    for one in led:
        at = one.at[0] * extent[0], one.at[1] * extent[1]
        way: dict[str, Any] = {
            "points": np.multiply(one.points, extent) if one.points else (),
            "closed": one.closed,
        }
        if isinstance(one, RecipeHandle):
            way |= {"duration": one.duration, "local": one.local, "rotate": one.rotate, "scale": one.scale}
            way |= {"turned": one.turned}
            way |= {"to": one.to and within(one.to)}
            way |= {"keys": tuple((time, *within((x, y))) for time, x, y in one.keys or ())}
            way |= {"goals": np.multiply(one.goals, extent) if one.goals else ()}
        made.append(Handle(at, radius=one.radius, start=one.start, end=one.let_go, stiffness=one.stiffness, **way))
    return made

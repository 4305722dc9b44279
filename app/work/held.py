"""The handles and pins of a simulation at its moment: where they are, and which are not where they are led."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import hypot

import numpy as np

from app.model.handles import ARRIVED, RecipeHandle, RecipePin
from app.model.sampling import Point
from app.work.replay import Replay


@dataclass(frozen=True)
class Held:
    """A handle or a pin that is in force at the playhead; places as fractions of the picture.

    Attributes:
        led: as the recipe has it.
        label: what messages call it.
        start, now, target: where it was when it began, is, and shall be.
        line: where the points of its line are, the first again at the end of a closed one; none of a point.
    """

    led: RecipeHandle | RecipePin
    label: str
    start: Point
    now: Point
    target: Point
    line: tuple[Point, ...] = ()

    def is_away(self, extent: Point) -> bool:
        """True if it is not where it is led."""
        (x, y), (to_x, to_y), (across, down) = self.now, self.target, extent
        return hypot((x - to_x) * across, (y - to_y) * down) > ARRIVED


def held_in(replay: Replay) -> list[Held]:
    """Those that are in force; reads back from the GPU."""
    tick, dt, extent = replay.tick, replay.recipe.fluid.dt, replay.grid.extent
    found, led, handles = [], replay.led, replay.handles
    if not any(one.is_in_force(tick, dt) for _, one in led):
        return found
    shapes = handles.shapes
    for (label, one), handle, shape, now, start in zip(
        led, handles.handles, shapes, handles.middles(shapes), handles.starts, strict=True
    ):
        if one.is_in_force(tick, dt):
            start = now if np.isnan(start[0]) else start
            target = handle.wanted(start, max(replay.time, handle.ready), dt) if handle.goal else start
            places = (np.array([start, now, target]) / extent).tolist()
            line = (shape / extent).tolist() if one.points else []
            places, line = ([(x, y) for x, y in each] for each in (places, line))
            found.append(Held(one, label, *places, line=(*line, *line[: one.closed])))
    return found


def unmet(replay: Replay, within: float) -> Iterator[str]:
    """Which handles are farther than `within` longer sides from where they are led at this moment, and how far."""
    if not replay.handles.handles:
        return
    solid = replay.fluid.solid.get()
    for (label, led), far, points in zip(replay.led, replay.handles.away, replay.handles.shapes, strict=True):
        if not far <= within:
            held = points if led.points else points[:1]
            columns, rows = np.clip(held / replay.grid.spacing, 0, np.array(replay.grid.size) - 1).astype(int).T
            why = ": what it holds is frozen" if (solid[rows, columns] == 255).any() else ""
            pixels = far * max(replay.pictures.source.width, replay.pictures.source.height)
            yield f"{label} is {far:.3g} longer sides ({pixels:.3g} pixels) away from where it is led{why}"

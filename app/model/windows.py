"""The flow's window: a stroke of a small brush is solved on fine cells around it, and not over the whole picture.

A stroke says how fine (`Stroke.detail`): so many cells along the picture's longer side, were they all over it. Of that
lattice a window holds `CELLS` x `CELLS`, or as many as there are, around the brush. It stays where it is as long as the
brush has room in it, is dragged along otherwise, and outlives the stroke: what the fluid does then it does there.
Everything follows from the strokes up to a tick, so that a recipe gives the same bytes whichever way it is replayed.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, log
from typing import NamedTuple, Self

from app.model.recipe import FluidSettings, Recipe
from app.model.strokes import FINEST_DETAIL, Act
from solver.grid import SMALLEST_GRID, Grid

CELLS = 192  # along a side of a window; its levels divide it by two down to three
# Cells a brush's radius. Each detail serves brushes up to a third larger, so that not every one has another lattice; a
# window is 12 to 16 radii wide, where it is off the whole picture's by half a percent (solver/MEASURED.md).
LEAST_PER_RADIUS, STEP = 12.0, 4 / 3
# How much finer than the whole picture's cells those of a window must be to be worth it.
FINER = 1.5
# Radii around the brush that a window's own sides keep away from it; and how far ahead it is laid when dragged along.
ROOM, AHEAD = 4.0, 1.0
# Seconds in which what flows in a window fades to a third, at most: where it went on longer, its sides would be felt.
# The slowest flow between sticking sides of length a fades at 52.3 mu / a^2 (the buckling mode of a clamped plate).
LONGEST_FLOW = 0.2
SLOWEST = 52.3 / 14.0**2  # of a window of 14 radii, times mu / radius^2

FLOWING = ("push", "curve", "twirl", "bloat", "pinch")
"""The tools that move the fluid."""


def detail_for(radius: float, recipe: Recipe, settings: FluidSettings) -> int:
    """The detail that a stroke deserves which is made now: 0, unless its brush is small and its flow soon at rest.

    Args:
        radius: of the brush, in longer sides.
        recipe: which the stroke is made in.
        settings: the fluid's at that tick.
    """
    if not may_have_windows(recipe) or recipe.handle or recipe.pin:
        return 0
    fading = settings.drag + SLOWEST * settings.viscosity / radius**2
    if fading * LONGEST_FLOW < 1.0:
        return 0
    steps = ceil(log(LEAST_PER_RADIUS / radius / CELLS) / log(STEP) - 1e-9)
    detail = min(round(CELLS * STEP**steps), FINEST_DETAIL)
    return detail if detail >= FINER * settings.grid else 0


def may_have_windows(recipe: Recipe) -> bool:
    """True if nothing in it acts on the whole picture from the start, as its forces and a density do."""
    return not recipe.pushes and recipe.mode == "coordinates" and recipe.fluid.solver == "mac"


class FlowWindow(NamedTuple):
    """A part of the lattice of `detail` cells along the longer side, from cell (column, row) on; see `grid_in`."""

    detail: int
    column: int
    row: int

    def grid_in(self, whole: Grid) -> Grid:
        """Its cells, in the picture of the grid `whole`."""
        lattice = _lattice(self.detail, whole.picture)
        (hx, hy), size = _spacing(lattice, whole.picture), _size(lattice)
        # Of a side that reaches all over the picture not a bit is lost.
        extent = tuple(
            side if count == cells else count * h
            for count, cells, h, side in zip(size, lattice, (hx, hy), whole.picture, strict=True)
        )
        return Grid(*size, extent, (self.column * hx, self.row * hy), whole.picture)  # pyright: ignore[reportArgumentType]

    @classmethod
    def of(cls, acts: Sequence[Act], now: Self | None, whole: Grid) -> Self | None:
        """The window for what strokes do in a tick.

        Args:
            acts: at least one, of `FLOWING` tools.
            now: the window until now, None if it is the whole picture.
            whole: the grid of the whole picture.

        Returns:
            `now` if they have room there; strokes that go on also stay in one that is coarser than they asked for, as a
            wide movement has needed it. None if one of them wants the whole picture, as one with images all over it
            does, or if no window with cells finer than those of `whole` has room for them.
        """
        detail = min(act.stroke.detail if act.stroke.symmetry == "none" else 0 for act in acts)
        finest = max(whole.size)
        ends, room = [], [1.0, 1.0, 0.0, 0.0]
        for stroke, _, dabs in acts:
            for dab in dabs:
                points = [_inside(place, whole.picture) for place in ((dab.x0, dab.y0), (dab.x1, dab.y1))]
                ends = points
                for point in points:
                    for axis in (0, 1):
                        reach = ROOM * stroke.radius
                        room[axis] = min(room[axis], max(point[axis] - reach, 0.0))
                        room[2 + axis] = max(room[2 + axis], min(point[axis] + reach, whole.picture[axis]))
        if now is not None and detail > now.detail and all(act.stroke.first_tick < act.tick for act in acts):
            detail = now.detail
        while detail > finest:
            lattice = _lattice(detail, whole.picture)
            if min(lattice) < SMALLEST_GRID:
                return None
            if now is not None and now.detail == detail and _holds(now, lattice, room, whole.picture):
                return now
            if found := _laid(lattice, room, ends, whole.picture):
                return cls(detail, *found)
            detail = round(detail / STEP)
        return None


def _lattice(detail: int, picture: tuple[float, float]) -> tuple[int, int]:
    return round(detail * picture[0]), round(detail * picture[1])


def _spacing(lattice: tuple[int, int], picture: tuple[float, float]) -> tuple[float, float]:
    return picture[0] / lattice[0], picture[1] / lattice[1]


def _size(lattice: tuple[int, int]) -> tuple[int, int]:
    return min(CELLS, lattice[0]), min(CELLS, lattice[1])


def _inside(place: tuple[float, float], picture: tuple[float, float]) -> tuple[float, float]:
    """A place in fractions of the picture, in longer sides and within it."""
    x, y = (min(max(fraction, 0.0), 1.0) * side for fraction, side in zip(place, picture, strict=True))
    return x, y


def _holds(window: FlowWindow, lattice: tuple[int, int], room: list[float], picture: tuple[float, float]) -> bool:
    """True if the box `room` (left, top, right, bottom) lies in the window."""
    h = _spacing(lattice, picture)
    for axis, (first, count) in enumerate(zip(window[1:], _size(lattice), strict=True)):
        after = first + count == lattice[axis] or room[2 + axis] <= (first + count) * h[axis]
        if not (room[axis] >= first * h[axis] and after):
            return False
    return True


def _laid(
    lattice: tuple[int, int],
    room: list[float],
    ends: list[tuple[float, float]],
    picture: tuple[float, float],
) -> tuple[int, int] | None:
    """Where a window begins that holds the box `room`, and what it can around the last of the `ends`, a bit ahead."""
    h, firsts = _spacing(lattice, picture), []
    way = [after - before for before, after in zip(*ends, strict=True)]
    far = max(map(abs, way)) or 1.0
    for axis, count in enumerate(_size(lattice)):
        radius = LEAST_PER_RADIUS * h[axis]
        middle = ends[1][axis] + AHEAD * radius * way[axis] / far
        # The first cell may not lie behind the beginning of the box, nor the last before its end.
        latest, earliest = int(room[axis] / h[axis] + 1e-6), ceil(room[2 + axis] / h[axis] - 1e-6) - count
        if earliest > latest:
            return None
        first = min(max(round(middle / h[axis] - count / 2), earliest), latest)
        firsts.append(min(max(first, 0), lattice[axis] - count))
    return firsts[0], firsts[1]

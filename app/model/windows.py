"""The flow's window: what strokes of a small brush and handles do is solved on fine cells around them.

They say how fine (`Stroke.detail`): so many cells along the picture's longer side, were they all over it. Of that
lattice a window holds `CELLS` x `CELLS`, or as many as there are, around what moves. It stays where it is while that
has room in it, is dragged along otherwise, and outlives it: what the fluid does then it does there. Everything follows
from the recipe up to a tick, so that it gives the same bytes whichever way it is replayed.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, log
from typing import NamedTuple, Self, TypeVar

import numpy as np

from app.model.handles import RecipeHandle, RecipePin, reach_of
from app.model.recipe import FluidSettings, Recipe
from app.model.sampling import Point
from app.model.strokes import FINEST_DETAIL, Act, Stroke
from solver.grid import SMALLEST_GRID, Grid

CELLS = 192  # along a side of a window; its levels divide it by two down to three
# Cells a brush's radius. Each detail serves brushes up to a third larger, so that not every one has another lattice; a
# window is 12 to 16 radii wide, where it is off the whole picture's by half a percent (solver/MEASURED.md).
LEAST_PER_RADIUS, STEP = 12.0, 4 / 3
# The same of a handle, which draws out what it leads all its way: with 18 cells it comes a radius far before the map
# around it is bent too far to be resolved, with 24 1.3 radii (solver/MEASURED.md). Its window is 8 to 11 radii wide.
LEAST_PER_LED = 18.0
# How much finer than the whole picture's cells those of a window must be to be worth it.
FINER = 1.5
# Radii around the brush that a window's own sides keep away from it; and how far ahead it is laid when dragged along.
ROOM, AHEAD = 4.0, 1.0
ROOM_OF_LED = 3.0  # of a handle: as far as it reaches beside others (WIDE in solver/brush/handles.py)
# Seconds in which what flows in a window fades to a third, at most: where it went on longer, its sides would be felt.
# The slowest flow between sticking sides of length a fades at 52.3 mu / a^2 (the buckling mode of a clamped plate).
LONGEST_FLOW = 0.2
SLOWEST = 52.3 / 14.0**2  # of a window of 14 radii, times mu / radius^2
# Of a handle nothing goes on once it has arrived, but its own push: a mode of k^2 = 12 / radius^2, as that of a brush.
OWN = 12.0

FLOWING = ("push", "curve", "twirl", "bloat", "pinch")
"""The tools that move the fluid."""

SomeLed = TypeVar("SomeLed", bound=RecipeHandle | RecipePin)


def detail_for(radius: float, recipe: Recipe, settings: FluidSettings) -> int:
    """The detail that a stroke deserves which is made now: 0, unless its brush is small and its flow soon at rest.

    Args:
        radius: of the brush, in longer sides.
        recipe: which the stroke is made in.
        settings: the fluid's at that tick.
    """
    if not may_have_windows(recipe) or not _fades_soon(settings, SLOWEST / radius**2):
        return 0
    detail = _detail_of(radius, LEAST_PER_RADIUS)
    return detail if detail >= FINER * settings.grid else 0


def detail_for_led(reach: float, recipe: Recipe, settings: FluidSettings) -> int:
    """The detail that a handle or a pin deserves which reaches so far, in longer sides.

    In what flows on and on it has no window that is smaller than the picture, and cells as small as that leaves. One of
    a large radius moves on the whole picture's cells; but not all that others do while it is at rest.
    """
    if not may_have_windows(recipe):
        return 0
    detail = _detail_of(reach, LEAST_PER_LED)
    if not _fades_soon(settings, OWN / reach**2):
        detail = min(detail, CELLS)
    return detail if detail >= FINER * settings.grid else min(detail, settings.grid)


def with_detail(led: SomeLed, recipe: Recipe, extent: Point) -> SomeLed:
    """A handle or a pin of a recipe with the detail that it deserves where it begins."""
    settings = recipe.fluid_at(led.first_tick(recipe.fluid.dt))
    return led.model_copy(update={"detail": detail_for_led(reach_of(led, extent), recipe, settings)})


# Strokes before and after, by the identity of the first, which is kept so that no other one gets it, and by the detail.
Made = dict[tuple[int, int], tuple[Stroke, Stroke]]


def on_grid(recipe: Recipe, cells: int, made: Made | None = None) -> Recipe:
    """The recipe on another grid: on coarser cells more brushes are small, and get windows.

    Args:
        recipe: whose strokes were made on its own grid.
        cells: along the longer side, from now on.
        made: the strokes that have changed, as they were and are; several recipes go on sharing them so.
    """
    moved, made = recipe.on_grid(cells), {} if made is None else made
    if cells >= recipe.fluid.grid:
        return moved

    def finer(stroke: Stroke) -> Stroke:
        if stroke.detail or stroke.tool not in FLOWING or stroke.symmetry != "none":
            return stroke
        detail = detail_for(stroke.radius, moved, moved.fluid_at(stroke.first_tick))
        if not detail:
            return stroke
        changed = stroke, stroke.model_copy(update={"detail": detail})
        return made.setdefault((id(stroke), detail), changed)[1]

    return moved.edited(stroke=tuple(map(finer, recipe.stroke)))


def _fades_soon(settings: FluidSettings, squared_wavenumber: float) -> bool:
    """True if a flow of this kind is gone before the sides of a window are felt."""
    return (settings.drag + squared_wavenumber * settings.viscosity) * LONGEST_FLOW >= 1.0


def _detail_of(radius: float, least: float) -> int:
    """The detail that gives a brush of this radius at least so many cells."""
    steps = ceil(log(least / radius / CELLS) / log(STEP) - 1e-9)
    return min(round(CELLS * STEP**steps), FINEST_DETAIL)


def may_have_windows(recipe: Recipe) -> bool:
    """True if nothing in it acts on the whole picture from the start, as its forces and a density do."""
    return not recipe.pushes and recipe.mode == "coordinates" and recipe.fluid.solver == "mac"


class Led(NamedTuple):
    """A handle or a pin in force in a tick, as a window has to hold it; places in longer sides.

    Attributes:
        detail: its own; see `detail_for_led`.
        reach: how far it reaches as a whole, and `push`, each of its points.
        here, then: where its points are and shall be a tick later, (k, 2).
        is_moving: it is not at rest there, and `begins` if it sets out in this tick.
        is_late: it is led no farther, and only has not arrived yet.
    """

    detail: int
    reach: float
    push: float
    here: np.ndarray
    then: np.ndarray
    is_moving: bool
    begins: bool
    is_late: bool = False


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
    def of(cls, acts: Sequence[Act], now: Self | None, whole: Grid, led: Sequence[Led] = ()) -> Self | None:
        """The window for what strokes and handles do in a tick.

        Args:
            acts: of `FLOWING` tools.
            now: the window until now, None if it is the whole picture.
            whole: the grid of the whole picture.
            led: the handles and pins in force.

        Returns:
            `now` if they have room there, or if all are at rest. Strokes that go on also stay in one coarser than
            they asked for, as a wide movement has needed it, and handles unless a finer one has room to spare. None if
            one of them wants the whole picture, as a stroke with images all over it does, or if no window with cells
            finer than those of `whole` has room for them. What is at rest has room where it feels what moves, so that
            it can hold against that; elsewhere it needs none. Nor does what is late, if it would take fine cells from
            what is led on: it waits until that has arrived, and what lies in the window arrives before what does not.
        """
        found = cls._around(acts, now, whole, led)
        late = [each.is_moving and each.is_late for each in led]
        if not any(late) or not all(each.detail for each in led):
            return found
        first = [each.is_moving and not each.is_late for each in led]
        if not acts and not any(first):
            box = whole if now is None else now.grid_in(whole)
            sides = [*box.origin, *np.add(box.origin, box.extent).tolist()]
            first = [waits and _are_within(each.here, sides) for waits, each in zip(late, led, strict=True)]
            if not any(first):
                first[late.index(True)] = True
        details = [act.stroke.detail for act in acts] + [
            each.detail for each, is_first in zip(led, first, strict=True) if is_first
        ]
        if (max(whole.size) if found is None else found.detail) >= min(details):
            return found
        waiting = [
            each._replace(is_moving=each.is_moving and is_first) for each, is_first in zip(led, first, strict=True)
        ]
        return cls._around(acts, now, whole, waiting)

    @classmethod
    def _around(cls, acts: Sequence[Act], now: Self | None, whole: Grid, led: Sequence[Led]) -> Self | None:
        """The window for all that."""
        moving = [each for each in led if each.is_moving]
        if not all(each.detail for each in led):
            return None
        if not acts and not moving:
            return now
        details = [act.stroke.detail if act.stroke.symmetry == "none" else 0 for act in acts]
        detail = min(details + [each.detail for each in moving])
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
        for each in moving:
            _widen(room, np.concatenate([each.here, each.then]), ROOM_OF_LED * each.reach, whole.picture)
        if moving and not acts:
            here, way = np.concatenate([each.here for each in moving]), [each.then - each.here for each in moving]
            middle = (np.clip(here, 0.0, whole.picture).min(axis=0) + np.clip(here, 0.0, whole.picture).max(axis=0)) / 2
            ends = [tuple(place.tolist()) for place in (middle, middle + np.concatenate(way).mean(axis=0))]
        moved = list(room)
        for each in led:
            if not each.is_moving and _are_within(each.here, moved):
                _widen(room, each.here, each.push, whole.picture)
        goes_on = all(act.stroke.first_tick < act.tick for act in acts) and not any(each.begins for each in moving)
        held, spare = finest if now is None else now.detail, 0.0
        if detail > held and goes_on and acts and now is not None:
            detail = held
        elif goes_on and moving:  # to finer cells only where no next step takes it back to coarser ones
            spare = AHEAD * max(each.reach for each in moving)
        while detail > finest:
            lattice = _lattice(detail, whole.picture)
            if min(lattice) < SMALLEST_GRID:
                return None
            if now is not None and now.detail == detail and _holds(now, lattice, room, whole.picture):
                return now
            wanted = _wider(room, spare, whole.picture) if detail > held else room
            if found := _laid(lattice, wanted, ends, whole.picture):
                return cls(detail, *found)
            detail = round(detail / STEP)
        return None


def _widen(room: list[float], places: np.ndarray, reach: float, picture: tuple[float, float]) -> None:
    """Let a box hold so much around places (n, 2) in the picture."""
    places = np.clip(places, 0.0, picture)
    low, high = np.maximum(places.min(axis=0) - reach, 0.0), np.minimum(places.max(axis=0) + reach, picture)
    room[:] = *np.minimum(room[:2], low).tolist(), *np.maximum(room[2:], high).tolist()


def _wider(room: list[float], reach: float, picture: tuple[float, float]) -> list[float]:
    """A box with so much more around it in the picture."""
    low, high = np.maximum(np.array(room[:2]) - reach, 0.0), np.minimum(np.array(room[2:]) + reach, picture)
    return [*low.tolist(), *high.tolist()]


def _are_within(places: np.ndarray, room: list[float]) -> bool:
    """True if some of the places (n, 2) lie in a box."""
    return bool(((places > room[:2]) & (places < room[2:])).all(axis=1).any())


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

"""What acts in time, as bars: strokes and forces are moved, stretched, muted, repeated and taken away afterwards.

A bar is known by its kind and its place in the recipe. Times are in ticks; a force has its own in seconds.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from heapq import heappop, heappush
from math import ceil, floor
from typing import Any, Literal, NamedTuple, TypeVar

from app.errors import UserError
from app.model.forces import Force
from app.model.recipe import MOST_TICKS, Recipe
from app.model.strokes import Stroke

Which = tuple[Literal["stroke", "force"], int]
"""("stroke", 2) is the recipe's third stroke."""
One = TypeVar("One", bound=Stroke | Force)
Changed = Callable[[Stroke | Force], Stroke | Force | None]
"""What takes the place of a stroke or a force; None where it is taken away."""


class Bar(NamedTuple):
    """Where one of them lies in time.

    Attributes:
        start, end: ticks from its beginning to its end, without its repetitions.
        stops: the end of its last repetition.
        every: ticks from one beginning to the next, 0 where it does not repeat.
        is_free: it can be moved; a formula of the time cannot.
    """

    which: Which
    start: float
    end: float
    stops: float
    every: int = 0
    muted: bool = False
    is_free: bool = True


def bar_of(one: Stroke | Force, which: Which, ticks: int, dt: float) -> Bar:
    """The bar of a stroke or a force in a recording of so many ticks."""
    if isinstance(one, Stroke):
        return Bar(which, one.first_tick, one.last_tick + 1, one.end_tick + 1, one.every, one.muted)
    if one.span is None:
        return Bar(which, 0, ticks, ticks, 0, one.muted, False)
    start, end = (time / dt for time in one.span)
    end = max(end, start + 1)  # an impulse is of one tick
    return Bar(which, start, end, end, 0, one.muted)


def bars(recipe: Recipe) -> list[Bar]:
    """All of a recipe, forces first."""
    return bars_of("force", recipe.force, recipe) + bars_of("stroke", recipe.stroke, recipe)


def bars_of(
    kind: Literal["stroke", "force"], several: Sequence[Stroke | Force], recipe: Recipe, first: int = 0
) -> list[Bar]:
    """Those of a recipe's strokes or forces from a number on."""
    ticks, dt = recipe.ticks, recipe.fluid.dt
    return [bar_of(one, (kind, number), ticks, dt) for number, one in enumerate(several[first:], first)]


def lanes(several: Sequence[Bar], least: float = 0.0) -> list[list[Bar]]:
    """Bars below each other in as few lanes as they need, each lane in the order of time.

    `least`: ticks that a bar takes at least, for one that is shown wider than it is.
    """
    packed: list[list[Bar]] = []
    free: list[int] = []
    busy: list[tuple[float, int]] = []
    for bar in sorted(several, key=lambda bar: bar.start):
        while busy and busy[0][0] <= bar.start:
            heappush(free, heappop(busy)[1])
        if not free:
            packed.append([])
        lane = heappop(free) if free else len(packed) - 1
        packed[lane].append(bar)
        heappush(busy, (max(bar.stops, bar.start + least), lane))
    return packed


def with_last(packed: list[list[Bar]], bar: Bar, least: float = 0.0) -> list[list[Bar]]:
    """The lanes with a bar more, where `lanes` would have it: for one that begins no sooner than all others."""
    for number, lane in enumerate(packed):
        if max(lane[-1].stops, lane[-1].start + least) <= bar.start:
            return [*packed[:number], [*lane, bar], *packed[number + 1 :]]
    return [*packed, [bar]]


def one_of(recipe: Recipe, which: Which) -> Stroke | Force | None:
    """The stroke or force that is called so, if there is one."""
    kind, number = which
    several = recipe.stroke if kind == "stroke" else recipe.force
    return several[number] if number < len(several) else None


def moved(one: One, ticks: int, dt: float) -> One:
    """The same so many ticks later, or earlier, but not before the beginning."""
    if isinstance(one, Stroke):
        return one.moved(max(ticks, -one.first_tick)) if ticks else one
    if one.span is None:
        return one
    start, end = one.span
    by = max(ticks * dt, -start)
    return one.edited(**one.spanning(start + by, end + by))


def stretched(one: One, start: float, end: float, dt: float) -> One:
    """The same from one tick to the end of another, at least one tick long; an instant only goes to `start`."""
    if isinstance(one, Stroke):
        first = max(floor(start + 0.5), 0)
        last = max(floor(end + 0.5) - 1, first)
        return one if (first, last) == (one.first_tick, one.last_tick) else one.lasting(first, last)
    if one.span is None:
        return one
    start = max(start, 0.0)
    return one.edited(**one.spanning(start * dt, max(end, start + 1) * dt))


def named(verb: str, which: Collection[Which]) -> str:
    """What the history calls an edit of them: "Move stroke", "Mute forces", "Delete bars"."""
    kinds = {kind for kind, _ in which}
    noun = kinds.pop() if len(kinds) == 1 else "bar"
    return f"{verb} {noun}{'s' if len(which) > 1 else ''}"


def with_changed(recipe: Recipe, which: Collection[Which], changed: Changed) -> dict[str, Any]:
    """The parts of a recipe with others in the place of some strokes and forces, and its duration.

    The recording ends as long after its last stroke as it did; where forces or handles act, it does not end sooner.

    Raises:
        UserError: if it would be longer than a recipe may be.
    """

    def those(kind: Literal["stroke", "force"], several: tuple[Any, ...]) -> tuple[Any, ...]:
        made = (changed(one) if (kind, number) in which else one for number, one in enumerate(several))
        return tuple(one for one in made if one is not None)

    strokes, forces = those("stroke", recipe.stroke), those("force", recipe.force)
    before, after = (max((stroke.end_tick for stroke in each), default=-1) for each in (recipe.stroke, strokes))
    ticks, dt = recipe.ticks + after - before, recipe.fluid.dt
    if recipe.force or recipe.leads:
        ticks = max(ticks, recipe.ticks)
    ends = [force.span[1] / dt for force in forces if force.span is not None and force not in recipe.force]
    here = [after, *(change.tick for change in recipe.change), *(edit.tick - 1 for edit in recipe.mask)]
    ticks = max(ticks, 1 + max(here), *(ceil(end - 1e-6) for end in ends), 1)
    if ticks > MOST_TICKS:
        raise UserError(f"a recording has at most {MOST_TICKS} ticks, and this would be of {ticks}")
    duration = recipe.duration if ticks == recipe.ticks else ticks * dt
    return {"stroke": strokes, "force": forces, "duration": duration}

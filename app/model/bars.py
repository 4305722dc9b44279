"""What acts in time, as bars: strokes, forces, handles and pins are moved, stretched, muted and taken away afterwards.

A bar is known by its kind and its place in the recipe. Times are in ticks; all but strokes have their own in seconds.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from heapq import heappop, heappush
from math import ceil, floor, inf
from typing import Any, Literal, NamedTuple, TypeVar, cast, get_args

from app.errors import UserError
from app.model.forces import Force
from app.model.handles import RecipeHandle, RecipePin
from app.model.recipe import MOST_TICKS, Recipe
from app.model.strokes import Stroke

Kind = Literal["force", "handle", "pin", "stroke"]
KINDS: tuple[Kind, ...] = get_args(Kind)  # from the highest lane down
Which = tuple[Kind, int]
"""("stroke", 2) is the recipe's third stroke."""
Actor = Stroke | Force | RecipeHandle | RecipePin
One = TypeVar("One", bound=Actor)
Changed = Callable[[Actor], Actor | None]
"""What takes the place of one; None where it is taken away."""


class Bar(NamedTuple):
    """Where one of them lies in time.

    Attributes:
        start, end: ticks from its beginning to its end, without its repetitions; of a handle, of its way. What has no
            end ends at infinity.
        stops: the end of its last repetition; of a handle, when it lets go.
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


def bar_of(one: Actor, which: Which, ticks: int, dt: float) -> Bar:
    """The bar of one in a recording of so many ticks."""
    if isinstance(one, Stroke):
        return Bar(which, one.first_tick, one.last_tick + 1, one.end_tick + 1, one.every, one.muted)
    if one.span is None:
        return Bar(which, 0, ticks, ticks, 0, one.muted, False)
    start, end = (time / dt for time in one.span)
    end = max(end, start + 1)  # an impulse is of one tick
    stops = max(end, one.let_go / dt) if isinstance(one, RecipeHandle | RecipePin) else end
    return Bar(which, start, end, stops, 0, one.muted)


def bars(recipe: Recipe) -> list[Bar]:
    """All of a recipe, forces first."""
    return [bar for kind in KINDS for bar in bars_of(kind, several_of(recipe, kind), recipe)]


def bars_of(kind: Kind, several: Sequence[Actor], recipe: Recipe, first: int = 0) -> list[Bar]:
    """Those of several of a kind from a number on."""
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


def several_of(recipe: Recipe, kind: Kind) -> tuple[Actor, ...]:
    """All of a kind."""
    return cast(tuple[Actor, ...], getattr(recipe, kind))


def one_of(recipe: Recipe, which: Which) -> Actor | None:
    """The one that is called so, if there is one."""
    kind, number = which
    several = several_of(recipe, kind)
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
    """The parts of a recipe with others in the place of some, and its duration.

    The recording ends as long after its last stroke as it did; where forces or handles act, it does not end sooner.
    What is led has as long to arrive as what was led last.

    Raises:
        UserError: if it would be longer than a recipe may be.
    """
    parts: dict[str, Any] = {}
    kinds: set[Kind] = {kind for kind, _ in which}
    for kind in kinds:
        several = enumerate(several_of(recipe, kind))
        made = [changed(one) if (kind, number) in which else one for number, one in several]
        parts[kind] = tuple(one for one in made if one is not None)
    edited = recipe.edited(**parts)
    before, after = (max((stroke.end_tick for stroke in each.stroke), default=-1) for each in (recipe, edited))
    ticks, dt = recipe.ticks + after - before, recipe.fluid.dt
    if recipe.force or recipe.leads:
        ticks = max(ticks, recipe.ticks)
    others = [
        one
        for kind in KINDS
        for one in parts.get(kind, ())
        if not isinstance(one, Stroke) and one not in several_of(recipe, kind)
    ]
    ends = [one.span[1] / dt for one in others if one.span is not None and one.span[1] < inf]
    last = max([before + 1, *(handle.last / dt for handle in recipe.handle)])
    ends += [one.last / dt + max(recipe.ticks - last, 0) for one in others if isinstance(one, RecipeHandle)]
    here = [after, *(change.tick for change in recipe.change), *(edit.tick - 1 for edit in recipe.mask)]
    ticks = max(ticks, 1 + max(here), *(ceil(end - 1e-6) for end in ends), 1)
    check_length(ticks)
    return parts | {"duration": recipe.duration if ticks == recipe.ticks else ticks * dt}


def check_length(ticks: int) -> None:
    """Raise `UserError` if a recording of so many ticks would be longer than a recipe may be."""
    if ticks > MOST_TICKS:
        raise UserError(f"a recording has at most {MOST_TICKS} ticks, and this would have {ticks}; make it end earlier")

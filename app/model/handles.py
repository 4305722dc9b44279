"""The handles and pins of a recipe: points and lines of the picture that are led somewhere, or stay where they are.

Long, as what cannot be met is found by comparing all of them, in their own coordinates.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import combinations, pairwise, takewhile
from math import ceil, cos, floor, inf, radians, sin
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from app.model.sampling import Point
from app.model.schema import Fraction01, Model, Place, Several, label_of
from app.model.strokes import FINEST_DETAIL
from solver.course import SAME_TIME, Course, between
from solver.limits import (
    LARGEST_LEAD,
    LEAST_SCALE,
    LEAST_STIFFNESS,
    LONGEST_LINE,
    MOST_SCALE,
    MOST_STRETCH,
    MOST_TURNED,
    short_of_edges,
)

MOST_HANDLES = 64  # with the pins
MOST_LINES = 16  # of them; of each up to 41 points are led
MOST_OBJECTIONS = 12  # to them that are told
ARRIVED = 0.001  # longer sides: half a pixel of 512
SAME = 0.05  # radii that two places are apart at which they are the same

Time = Annotated[float, Field(ge=0, le=1_000_000)]
Line = Annotated[Several[Point], Field(max_length=500)]
Key = tuple[Time, Place, Place]
"""(seconds, x, y): when a handle shall be where, as fractions of the picture's width and height."""
Degrees = Annotated[float, Field(ge=-MOST_TURNED, le=MOST_TURNED)]
Scale = Annotated[float, Field(ge=LEAST_SCALE, le=MOST_SCALE)]
Turn = tuple[Time, Degrees, Scale]
"""(seconds, degrees, scale): when a handle shall be turned how far, clockwise, and how many times as large."""


def _middle(line: Any) -> Point | None:
    """The mean of the corners of a line, if it has any; of what is no line any place: that is told of the line."""
    if not line:
        return None
    try:
        across, down = np.clip(np.nan_to_num(np.asarray(line, np.float64)), -10, 10).T
    except (TypeError, ValueError, OverflowError):
        return 0.5, 0.5
    return float(across.mean()), float(down.mean())


class _Led(Model):
    """What a handle and a pin have in common.

    Attributes:
        name: what messages call it.
        muted: it does nothing.
        at: the place in the picture of what is led or held, as fractions of width and height; of a line by default the
            mean of its corners.
        points: the corners of a line that is led or held as a whole, likewise.
        closed: the line ends where it begins.
        radius: how far it reaches, in longer sides.
        start, end: seconds from and until which it is in force; without an end, for ever.
        stiffness: 1 holds exactly; less gives way to the fluid and to others.
        detail: cells along the picture's longer side that the flow is solved with, in a window around it, while it is
            on its way (see `app.model.windows`); at rest it needs none. 0: on the grid of the whole picture, as long as
            it is in force.
    """

    name: str = ""
    muted: bool = False
    at: Point
    points: Line = ()
    closed: bool = False
    radius: Annotated[float, Field(ge=0.001, le=1)] = 0.25
    start: Time = 0.0
    end: Time | None = None
    stiffness: Annotated[float, Field(ge=LEAST_STIFFNESS, le=1)] = 1.0
    detail: Annotated[int, Field(ge=0, le=FINEST_DETAIL)] = 0

    @model_validator(mode="before")
    @classmethod
    def _in_the_middle(cls, data: Any) -> Any:
        if not isinstance(data, dict):
            return data
        lines = {"at": "points", "to": "goals"}
        found = {key: _middle(data[line]) for key, line in lines.items() if line in data and key in cls.model_fields}
        return {key: place for key, place in found.items() if place is not None} | data

    @model_validator(mode="after")
    def _forwards(self) -> Self:
        if self.end is not None and self.end < self.start:
            raise ValueError(f"'end' ({self.end:g}) is before 'start' ({self.start:g})")
        if self.points and len(set(self.points)) < 2 + self.closed:
            raise ValueError(f"'points' must be {'three' if self.closed else 'two'} different places or more")
        return self

    @property
    def corners(self) -> tuple[Point, ...]:
        """The places in the picture that it holds: of its line, or its own."""
        return self.points or (self.at,)

    @property
    def takes_hold(self) -> bool:
        """True if it is not muted and some of it is in the picture."""
        return not self.muted and any(is_inside(place) for place in self.corners)

    @property
    def let_go(self) -> float:
        """The seconds at which it lets go; infinite where it never does."""
        return inf if self.end is None else self.end

    @property
    def span(self) -> tuple[float, float]:
        """The seconds from its start to the end of its way; of what has none, until it lets go."""
        return self.start, self.let_go

    def spanning(self, start: float, end: float) -> dict[str, Any]:
        """Its times, with its way between others."""
        return {"start": _short(start), "end": None if end == inf else _short(end)}

    def is_in_force(self, tick: int, dt: float) -> bool:
        """True if it leads or holds in a tick, as `Handles.lead` has it."""
        return self.start <= tick * dt + dt / 2 < self.let_go

    def first_tick(self, dt: float) -> int:
        """The tick in which it begins: as `Handles.lead` has it, however that is rounded."""
        near = ceil(min(self.start / dt, 2.0**40) - 0.5)
        return next((tick for tick in (near - 1, near) if tick >= 0 and self.start <= tick * dt + dt / 2), near + 1)


class RecipeHandle(_Led, Course):
    """A point of the picture that is led to other places, and stays at the last.

    Attributes:
        to: where to, as fractions of width and height.
        duration: of that way, in seconds, from its start on.
        keys: when it shall be where after that, at an even speed from one to the next; the way of the editor's hand.
            Without `to` they must be given, and may be none: a handle that nobody has led yet.
        local: from 0, which pushes as a fluid does, to 1, which moves what is under it alone.
        goals: where the corners of its line shall be then, as many; without, they keep their places about `at`.
        rotate, scale: degrees that it is turned about `at` in that time, clockwise, and times that it is made as large.
            A point with neither turns as the fluid does; with one of them, and a line, the other is 0 or 1. With goals
            it is how the line turns on its way to them.
        turned: how it shall be turned and scaled after that, or from its start, at an even speed from one to the next.
    """

    kind: ClassVar = "handle"
    to: Point | None = None
    duration: Time = 1.0
    keys: Several[Key] | None = None
    local: Fraction01 = 0.0
    goals: Line = ()
    rotate: Degrees | None = None
    scale: Scale | None = None
    turned: Several[Turn] = ()

    @model_validator(mode="after")
    def _led_somewhere(self) -> Self:
        if self.to is None and self.keys is None and not self.turns:
            raise ValueError("'to' is missing")
        if self.goals and len(self.goals) != len(self.points):
            raise ValueError(f"'points' has {len(self.points)} places and 'goals' {len(self.goals)}; give as many")
        for name, ready in (("keys", self.ready), ("turned", self.upright)):
            times = [ready, *(key[0] for key in getattr(self, name) or ())]
            if any(later < earlier for earlier, later in pairwise(times)):
                raise ValueError(
                    f"the times of '{name}' must not go backwards, nor begin before its other way has ended"
                )
        return self

    def turn_key(self, tick: int, dt: float) -> Turn:
        """The last key of its turn and size up to a tick, or that of its first turn, until that is made."""
        keys, time = ((self.upright, self.rotate or 0.0, self.scale or 1.0), *self.turned), max(tick * dt, self.upright)
        return [key for key in keys if key[0] <= time + SAME_TIME * dt][-1]

    def is_turning_first(self, tick: int, dt: float) -> bool:
        """Its first turn is still being made at a tick."""
        return (tick + SAME_TIME) * dt < self.upright

    def turned_to(self, tick: int, dt: float, rotate: float, scale: float) -> RecipeHandle:
        """The handle, with another key of its turn and size at a tick; until its first turn is made, with that one."""
        time = max(tick * dt, self.upright)
        others = (key for key in self.turned if abs(key[0] - time) > SAME_TIME * dt)
        is_first = self.start < self.upright and time - self.upright <= SAME_TIME * dt
        first = {"rotate": rotate, "scale": scale} if is_first else {}
        return self.model_copy(update={"turned": tuple(sorted([*others, (time, rotate, scale)])), **first})

    def without_turn_key(self, tick: int, dt: float) -> RecipeHandle:
        """The handle without `turn_key`; one that is then led nowhere waits to be, as one that has just been set."""
        key = self.turn_key(tick, dt)
        kept = self.model_copy(update={"turned": tuple(each for each in self.turned if each != key)})
        return kept if kept.is_led else kept.model_copy(update={"keys": ()})

    @property
    def goal(self) -> Point | None:
        """Where it is led in the end; None if nowhere but where it is at its start."""
        return self.keys[-1][1:] if self.keys else self.to

    @property
    def is_led(self) -> bool:
        """True if it goes or turns somewhere."""
        return self.goal is not None or self.turns

    @property
    def span(self) -> tuple[float, float]:
        """The seconds from its start to the end of its way; of what has none, until it lets go."""
        return (self.start, self.last) if self.is_led else super().span

    def spanning(self, start: float, end: float) -> dict[str, Any]:
        """Its times, with its way between others; what it holds after that it holds as long."""
        if not self.is_led:
            return super().spanning(start, end)
        first, last = self.span
        factor, end = ((end - start) / (last - first), end) if last > first else (1.0, start)
        begun = self.model_copy(update={"start": _short(start), "duration": _short(factor * self.duration)})
        keys, turned = (
            each and tuple((max(_short(start + factor * (time - first)), ready), *rest) for time, *rest in each)
            for each, ready in ((self.keys, begun.ready), (self.turned, begun.upright))
        )
        held = None if self.end is None else max(_short(self.end + end - last), begun.start)
        return {"start": begun.start, "duration": begun.duration, "keys": keys, "turned": turned, "end": held}

    def led_to(self, tick: int, dt: float, place: Point, rests: Point) -> RecipeHandle:
        """The handle, led to a place in this tick, from `rests`, where it has been led so far."""
        time, then = (max(each * dt, self.ready) for each in (tick, tick + 1))
        keys = tuple(key for key in self.keys or () if key[0] < then)  # of several places in a tick the last one counts
        if not keys or keys[-1][0] < time:
            keys = *keys, (time, *rests)
        return self.model_copy(update={"keys": (*keys, (then, *place))})

    def before(self, tick: int, dt: float) -> RecipeHandle | None:
        """What of it is led before a tick, and stays from then on; None if nothing is.

        Between two keys it stays where it has come to. Before the first one it is taken to have set out from `at`.
        """
        if self.first_tick(dt) >= tick:
            return None
        mine, time = (self.keys or (), self.turned), tick * dt
        keys, turned = (tuple(key for key in each if key[0] <= time + SAME_TIME * dt) for each in mine)
        if (keys, turned) == mine:
            return self
        (x, y), place, part = between(self.to or self.at, self.ready, mine[0], max(time, self.ready), dt)
        if part:
            ways = (np.clip((one, other), 0.0, 1.0).tolist() for one, other in zip((x, y), place, strict=True))
            across, down = (one + part * (other - one) for one, other in ways)
            keys = *keys, (time, across, down)
        turn = self.turn(time, dt)
        if time > self.upright and turn != (turned[-1][1:] if turned else (self.rotate or 0.0, self.scale or 1.0)):
            turned = *turned, (time, *turn)
        if self.turned and not turned and self.rotate is None and self.scale is None:
            turned = ((self.start, 0.0, 1.0),)  # it is measured as one that is turned
        return self.model_copy(update={"keys": keys, "turned": turned})

    def agrees_until(self, other: RecipeHandle, dt: float) -> float:
        """The tick before which both are led the same; infinite where they are for ever."""
        heads = (led.model_copy(update={"keys": None, "turned": (), "end": None}) for led in (self, other))
        if next(heads) != next(heads) or self.turns != other.turns:
            return min(self.first_tick(dt), other.first_tick(dt))
        agreed = inf
        if self.end != other.end:
            agreed = max(floor(min(self.let_go, other.let_go) / dt) - 1, 0)
        for mine, theirs, ready in ((self.keys, other.keys, self.ready), (self.turned, other.turned, self.upright)):
            if mine != theirs:
                both = zip(mine or (), theirs or (), strict=False)
                common = [one[0] for one, another in takewhile(lambda pair: pair[0] == pair[1], both)]
                agreed = min(agreed, floor((common[-1] if common else ready) / dt + SAME_TIME))
        return agreed


class RecipePin(_Led):
    """A point of the picture that stays where it is at its start."""

    kind: ClassVar = "pin"


def labelled(handles: Sequence[RecipeHandle], pins: Sequence[RecipePin]) -> list[tuple[str, RecipeHandle | RecipePin]]:
    """All of them, handles first, with what messages call them: handle[1] "smile", counted from 1."""
    return [
        (label_of(led.kind, number, led.name), led)
        for several in (handles, pins)
        for number, led in enumerate(several, 1)
    ]


def in_pixels(far: float) -> str:
    """So many pixels as messages say it: with three digits, and in a large picture with more, but no power of ten."""
    return f"{far:.3g}" if far < 999.5 else f"{far:.0f}"


def in_words(said: str) -> str:
    """What messages say, in the window: handle 1 "smile" for handle[1] "smile", pixels alone, Size for radius."""
    said = re.sub(r"\b(handle|pin)\[(\d+)\]", r"\1 \2", re.sub(r" \([\d.e-]+ longer sides\)", "", said))
    return said.replace("reach (radius)", "Size").replace("fluidwarp fit moves", "Fit moves")


def heading(said: str) -> str:
    """The same with a capital, unless it begins with the name of a file."""
    words = in_words(said)
    return words if re.match(r"\S*\.|[^.:;,]*\.[a-z][a-z0-9]{1,4}\b", words) else f"{words[:1].upper()}{words[1:]}"


def _short(seconds: float) -> float:
    """To a billionth of a second, so that moving it there and back leaves no digits behind."""
    return round(seconds, 9)


def is_inside(point: Point) -> bool:
    """True if a place lies in the picture."""
    return all(0 <= fraction <= 1 for fraction in point)


def objections(
    handles: Sequence[RecipeHandle], pins: Sequence[RecipePin], extent: tuple[float, float]
) -> Iterator[str]:
    """What of them cannot be met, each by number; what can be is done all the same."""
    led = [_Move(label, one, extent) for label, one in labelled(handles, pins) if not one.muted]
    for move in led:
        outside, beyond = (((places < 0) | (places > extent)).any(axis=1) for places in (move.before, move.after))
        if outside.all():
            yield f"{move.label} takes hold of nothing: {_shown(move.led.corners[0])} is outside the picture"
            continue
        if outside.any():
            yield f"{move.label} reaches out of the picture: what is outside is not moved"
        if not (ends := move.after[beyond & ~outside]).size and (short := move.short_of_edges(extent)) > ARRIVED:
            more = "what is at the picture's edge stays there"
            yield f"{move.label} stays {100 * short:.3g}% of the longer side short: {more}"
        if ends.size:
            yield f"{move.label} goes only to the picture's edge: {_shown(ends[0] / extent)} is outside the picture"
        elif move.far > LARGEST_LEAD:
            more = f"and it goes {LARGEST_LEAD:g} times at most; give it a larger reach (radius)"
            yield f"{move.label} has its goal {move.far:.3g} times as far away as it reaches, {more}"
        if move.led.closed and _area(move.before) * _area(move.after) < 0:
            yield f"{move.label} is turned inside out by its goals"
    for one, other in combinations([move for move in led if move.led.takes_hold], 2):
        if max(one.led.start, other.led.start) < min(one.until, other.until):
            near = min(one.reach, other.reach)
            before, after = (
                mine[:, None] - theirs for mine, theirs in ((one.before, other.before), (one.after, other.after))
            )
            far, far_after = _lengths(before), _lengths(after)
            apart = far >= SAME * near
            stretched = np.where(apart & (far < near), far_after / np.maximum(far, 1e-30), 0.0).max()
            both, close = f"{one.label} and {other.label}", np.minimum(far, near)
            if (~apart & (_lengths(after - before) > SAME * near)).any():
                yield f"{both} hold the same place but have different goals"
            elif stretched > MOST_STRETCH:
                yield f"{both} have goals {stretched:.3g} times as far apart as they are"
            elif (apart & (far_after * MOST_STRETCH < close)).any():
                yield f"{both} have nearly the same goal"
            elif (apart & (_nearest(before, after) * MOST_STRETCH < close)).any():
                yield f"{both} cross each other's way"


def leads_too_far(led: RecipeHandle | RecipePin, extent: Point) -> bool:
    """True if its goal is farther than it goes."""
    return _Move("", led, extent).far > LARGEST_LEAD


def reach_of(led: RecipeHandle | RecipePin, extent: Point) -> float:
    """How far it reaches as a whole, in longer sides: its radius, or what its line needs."""
    return _Move("", led, extent).reach


class _Move:
    """Where a handle or a pin leads its corners: before and after, (n, 2) in longer sides."""

    def __init__(self, label: str, led: RecipeHandle | RecipePin, extent: Point) -> None:
        self.label, self.led, self.until = label, led, led.let_go
        self.before = self.after = np.multiply(led.corners, extent)
        lines = [self.before]
        if isinstance(led, RecipeHandle):
            laid, goal = (
                np.multiply(led.corners, extent) - np.multiply(led.at, extent),
                np.multiply(led.goal or led.at, extent),
            )
            first = led.rotate or 0.0, led.scale or 1.0
            angle, scale = led.turned[-1][1:] if led.turned else first
            if led.goals and led.to:  # turned as far as it is then
                lines.append(np.multiply(led.goals, extent))
                laid, angle, scale = lines[1] - np.multiply(led.to, extent), angle - first[0], scale / first[1]
            angle = radians(angle)
            turn = np.array([[cos(angle), sin(angle)], [-sin(angle), cos(angle)]])
            self.after = goal + scale * laid @ turn
        rounds = ([*line, line[0]] if led.closed else line for line in lines)
        self.reach = max(led.radius, max(_lengths(np.diff(line, axis=0)).sum() for line in rounds) / LONGEST_LINE)

    @property
    def far(self) -> float:
        """How many times as far as it reaches its farthest corner is led."""
        return float(_lengths(self.after - self.before).max() / self.reach)

    def short_of_edges(self, extent: Point) -> float:
        """How far what is farthest of its line stays from where it is led within the picture."""
        if not self.led.points:
            return 0.0
        before, after = (_between_corners(line, self.led.closed) for line in (self.before, self.after))
        inside = ((before >= 0) & (before <= extent)).all(axis=1)
        return short_of_edges(before[inside], np.clip(after[inside], 0.0, extent), extent)


def _between_corners(line: np.ndarray, closed: bool) -> np.ndarray:
    """Places all along a line of corners (n, 2)."""
    line = np.concatenate([line, line[:1]]) if closed else line
    parts = np.linspace(0.0, 1.0, 8, endpoint=False)[:, None]
    return np.concatenate([*((1 - parts) * here + parts * there for here, there in pairwise(line)), line[-1:]])


def _lengths(vectors: np.ndarray) -> np.ndarray:
    return np.hypot(vectors[..., 0], vectors[..., 1])


def _area(line: np.ndarray) -> float:
    """The area within a closed line, positive clockwise."""
    x, y = line.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def _nearest(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """How near two come that go straight, at the same time."""
    change = after - before
    part = -(before * change).sum(axis=-1) / np.maximum((change**2).sum(axis=-1), 1e-30)
    return _lengths(before + np.clip(part, 0.0, 1.0)[..., None] * change)


def _shown(point: Sequence[float] | np.ndarray) -> str:
    return f"({point[0]:g}, {point[1]:g})"

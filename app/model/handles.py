"""The handles and pins of a recipe: points of the picture that are led somewhere, or stay where they are."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, pairwise, takewhile
from math import ceil, floor, hypot, inf
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from app.model.sampling import Point
from app.model.schema import Fraction01, Model, Place, Several, label_of
from solver.limits import LARGEST_LEAD

MOST_HANDLES = 64  # with the pins
ARRIVED = 0.001  # longer sides: half a pixel of 512
# Radii that two places are apart at which they are the same; how many times farther apart, or nearer, neighbours may be
# led.
SAME, MOST_STRETCH = 0.05, 4.0

SAME_TIME = 1e-6  # ticks between two times that are the same but for their rounding

Time = Annotated[float, Field(ge=0, le=1_000_000)]
Key = tuple[Time, Place, Place]
"""(seconds, x, y): when a handle shall be where, as fractions of the picture's width and height."""


class _Led(Model):
    """What a handle and a pin have in common.

    Attributes:
        name: what messages call it.
        at: the place in the picture of what is led or held, as fractions of width and height.
        radius: how far it reaches, in longer sides.
        start, end: seconds from and until which it is in force; without an end, for ever.
        stiffness: 1 holds exactly; less gives way to the fluid and to others.
    """

    name: str = ""
    at: Point
    radius: Annotated[float, Field(ge=0.001, le=1)] = 0.25
    start: Time = 0.0
    end: Time | None = None
    stiffness: Annotated[float, Field(ge=0.001, le=1)] = 1.0

    @model_validator(mode="after")
    def _forwards(self) -> Self:
        if self.end is not None and self.end < self.start:
            raise ValueError(f"'end' ({self.end:g}) is before 'start' ({self.start:g})")
        return self

    def is_in_force(self, tick: int, dt: float) -> bool:
        """True if it leads or holds in a tick, as `Handles.lead` has it."""
        return self.start <= tick * dt + dt / 2 < (inf if self.end is None else self.end)

    def first_tick(self, dt: float) -> int:
        """The tick in which it begins: as `Handles.lead` has it, however that is rounded."""
        near = ceil(min(self.start / dt, 2.0**40) - 0.5)
        return next((tick for tick in (near - 1, near) if tick >= 0 and self.start <= tick * dt + dt / 2), near + 1)


class RecipeHandle(_Led):
    """A point of the picture that is led to other places, and stays at the last.

    Attributes:
        to: where to, as fractions of width and height.
        duration: of that way, in seconds, from its start on.
        keys: when it shall be where after that, at an even speed from one to the next; the way of the editor's hand.
            Without `to` they must be given, and may be none: a handle that nobody has led yet.
        local: from 0, which pushes as a fluid does, to 1, which moves what is under it alone.
    """

    kind: ClassVar = "handle"
    to: Point | None = None
    duration: Time = 1.0
    keys: Several[Key] | None = None
    local: Fraction01 = 0.0

    @model_validator(mode="after")
    def _led_somewhere(self) -> Self:
        if self.to is None and self.keys is None:
            raise ValueError("'to' is missing")
        times = [self.ready, *(key[0] for key in self.keys or ())]
        if any(later < earlier for earlier, later in pairwise(times)):
            raise ValueError("the times of 'keys' must not go backwards, nor begin before its other way has ended")
        return self

    @property
    def ready(self) -> float:
        """The seconds at which it has gone its first way, and its keys may begin."""
        return self.start if self.to is None else self.start + self.duration

    @property
    def last(self) -> float:
        """The seconds from which on it only stays."""
        return self.keys[-1][0] if self.keys else self.ready

    @property
    def goal(self) -> Point | None:
        """Where it is led in the end; None if nowhere but where it is at its start."""
        return self.keys[-1][1:] if self.keys else self.to

    def led_to(self, tick: int, dt: float, place: Point, rests: Point) -> RecipeHandle:
        """The handle, led to a place in this tick, from `rests`, where it has been led so far."""
        time, then = (max(each * dt, self.ready) for each in (tick, tick + 1))
        keys = tuple(key for key in self.keys or () if key[0] < then)  # of several places in a tick the last one counts
        if not keys or keys[-1][0] < time:
            keys = *keys, (time, *rests)
        return self.model_copy(update={"keys": (*keys, (then, *place))})

    def before(self, tick: int, dt: float) -> RecipeHandle | None:
        """What of it is led before a tick, and stays from then on; None if nothing is."""
        if self.first_tick(dt) >= tick:
            return None
        kept = tuple(key for key in self.keys or () if key[0] <= (tick + SAME_TIME) * dt)
        return self if kept == (self.keys or ()) else self.model_copy(update={"keys": kept})

    def agrees_until(self, other: RecipeHandle, dt: float) -> float:
        """The tick before which both are led the same; infinite where they are for ever."""
        heads = (led.model_copy(update={"keys": None, "end": None}) for led in (self, other))
        if next(heads) != next(heads):
            return min(self.first_tick(dt), other.first_tick(dt))
        agreed = inf
        if self.end != other.end:
            agreed = max(floor(min(inf if led.end is None else led.end for led in (self, other)) / dt) - 1, 0)
        if self.keys != other.keys:
            both = zip(self.keys or (), other.keys or (), strict=False)
            common = [mine[0] for mine, theirs in takewhile(lambda pair: pair[0] == pair[1], both)]
            agreed = min(agreed, floor((common[-1] if common else self.ready) / dt + SAME_TIME))
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


def is_inside(point: Point) -> bool:
    """True if a place lies in the picture."""
    return all(0 <= fraction <= 1 for fraction in point)


def objections(
    handles: Sequence[RecipeHandle], pins: Sequence[RecipePin], extent: tuple[float, float]
) -> Iterator[str]:
    """What of them cannot be met, each by number; what can be is done all the same."""
    led = labelled(handles, pins)
    for label, one in led:
        if not is_inside(one.at):
            yield f"{label} takes hold of nothing: {_shown(one.at)} is outside the picture"
        elif not is_inside(end := _end(one)):
            yield f"{label} goes only to the picture's edge: {_shown(end)} is outside the picture"
        elif (far := hypot(*_between(end, one.at, extent)) / one.radius) > LARGEST_LEAD:
            yield f"{label} goes only {LARGEST_LEAD:g} of the {far:.3g} radii to its goal; give it a larger radius"
    inside = [(label, one) for label, one in led if is_inside(one.at)]
    for (label, one), (other_label, other) in combinations(inside, 2):
        if max(one.start, other.start) < min(one.end or inf, other.end or inf):
            near = min(one.radius, other.radius)
            before, after = _between(one.at, other.at, extent), _between(_end(one), _end(other), extent)
            far, far_after = hypot(*before), hypot(*after)
            if far < SAME * near and hypot(*(after - before)) > SAME * near:
                yield f"{label} and {other_label} hold the same place and are led apart"
            elif far < near and far_after > MOST_STRETCH * far:
                yield f"{label} and {other_label} are led {far_after / far:.3g} times as far apart as they lie"
            elif far >= SAME * near and far_after * MOST_STRETCH < min(far, near):
                yield f"{label} and {other_label} are led to nearly the same place"
            elif far >= SAME * near and _nearest(before, after) * MOST_STRETCH < min(far, near):
                yield f"{label} and {other_label} cross each other's way"


def _end(led: RecipeHandle | RecipePin) -> Point:
    return (led.goal if isinstance(led, RecipeHandle) else None) or led.at


def _between(one: Point, other: Point, extent: tuple[float, float]) -> np.ndarray:
    return np.subtract(one, other) * extent


def _nearest(before: np.ndarray, after: np.ndarray) -> float:
    """How near two come that go straight, at the same time."""
    change = after - before
    part = -float(before @ change) / max(float(change @ change), 1e-30)
    return float(np.hypot(*(before + min(max(part, 0.0), 1.0) * change)))


def _shown(point: Point) -> str:
    return f"({point[0]:g}, {point[1]:g})"

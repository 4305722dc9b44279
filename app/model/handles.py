"""The handles and pins of a recipe: points of the picture that are led somewhere, or stay where they are."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations
from math import ceil, hypot, inf
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from app.model.sampling import Point
from app.model.schema import Fraction01, Model
from solver.limits import LARGEST_LEAD

MOST_HANDLES = 64  # with the pins
ARRIVED = 0.001  # longer sides: half a pixel of 512
# Radii that two places are apart at which they are the same; how many times farther apart, or nearer, neighbours may be
# led.
SAME, MOST_STRETCH = 0.05, 4.0

Time = Annotated[float, Field(ge=0, le=1_000_000)]


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

    def first_tick(self, dt: float) -> int:
        """The tick in which it begins: as `Handles.lead` has it, however that is rounded."""
        near = ceil(min(self.start / dt, 2.0**40) - 0.5)
        return next((tick for tick in (near - 1, near) if tick >= 0 and self.start <= tick * dt + dt / 2), near + 1)


class RecipeHandle(_Led):
    """A point of the picture that is led to another place, and stays there.

    Attributes:
        to: where to, as fractions of width and height.
        duration: of the way, in seconds, from its start on.
        local: from 0, which pushes as a fluid does, to 1, which moves what is under it alone.
    """

    to: Point
    duration: Time = 1.0
    local: Fraction01 = 0.0


class RecipePin(_Led):
    """A point of the picture that stays where it is at its start."""


def labelled(handles: Sequence[RecipeHandle], pins: Sequence[RecipePin]) -> list[tuple[str, RecipeHandle | RecipePin]]:
    """All of them, handles first, with what messages call them: handle[1] "smile", counted from 1."""
    kinds = (("handle", handles), ("pin", pins))
    return [
        (f"{kind}[{number}]" + (f' "{led.name}"' if led.name else ""), led)
        for kind, several in kinds
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
        elif isinstance(one, RecipeHandle) and not is_inside(one.to):
            yield f"{label} is led to the picture's edge only: {_shown(one.to)} is outside the picture"
        elif (
            isinstance(one, RecipeHandle)
            and (far := hypot(*_between(one.to, one.at, extent)) / one.radius) > LARGEST_LEAD
        ):
            yield f"{label} is led {LARGEST_LEAD:g} of the {far:.3g} radii of its way only; give it a larger radius"
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
    return led.to if isinstance(led, RecipeHandle) else led.at


def _between(one: Point, other: Point, extent: tuple[float, float]) -> np.ndarray:
    return np.subtract(one, other) * extent


def _nearest(before: np.ndarray, after: np.ndarray) -> float:
    """How near two come that go straight, at the same time."""
    change = after - before
    part = -float(before @ change) / max(float(change @ change), 1e-30)
    return float(np.hypot(*(before + min(max(part, 0.0), 1.0) * change)))


def _shown(point: Point) -> str:
    return f"({point[0]:g}, {point[1]:g})"

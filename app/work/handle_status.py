"""The handles and pins of a simulation at its moment: where they are, and which are not where they are led."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from app.model.handles import ARRIVED, RecipeHandle, RecipePin, in_pixels, leads_too_far
from app.model.sampling import Point
from app.model.windows import LEAST_PER_RADIUS
from app.work.replay import Replay
from solver.warp.inverse import ForwardMap

Line = tuple[Point, ...]
FROZEN = "what it holds is frozen"
HALTED = {  # why a handle or a pin is not where it is led, by `Handles.halts`
    "strain": "the picture around it cannot bend further",
    "frozen": "the picture between it and what is frozen cannot bend further",
    "at odds": "another handle or pin is in its way",
    "soft": "it gives way to the fluid, and needs more stiffness",
    "alone": "the fluid brings it no nearer",
    "edge": "what is at the picture's edge stays there",
    "outside": "it is outside the picture",
    "waiting": "it has not begun",
    "over": "it has let go by now",
    "under way": "its movement is not over yet",
    "late": "the simulation ends before it arrives",
    None: "that is less than a pixel",
}
FAR = "its reach (radius) is too small to go that far"
SMALL = "it reaches over only {:.2g} cells of the simulation; give it a larger reach (radius)"
FIT = "Fit"  # what the history calls an edit by a fit
ANEW = "fluidwarp fit moves all handles together, which may bring them nearer"
HELPED = ("strain", "frozen", "at odds", "soft", "alone")  # where it may


@dataclass(frozen=True)
class Held:
    """A handle or a pin that is in force at the playhead; places as fractions of the picture.

    Attributes:
        led: as the recipe has it.
        label: what messages call it.
        start, now, target: where it was when it began, is, and shall be.
        left: how far what is farthest of it is from where it shall be, longer sides, as `unmet` tells it.
        is_away: it is not where it is led: see `near_enough`.
        line, due: where the points of its line are, and shall be, the first again at the end of a closed one; none of a
            point.
    """

    led: RecipeHandle | RecipePin
    label: str
    start: Point
    now: Point
    target: Point
    left: float
    is_away: bool
    line: Line = ()
    due: Line = ()


def near_enough(replay: Replay) -> float:
    """How near what has arrived is to where it is led, longer sides: no picture shows less than one of its pixels."""
    source = replay.pictures.source
    return max(ARRIVED, 1 / max(source.width, source.height))


def held_in(replay: Replay, aimed: int = 0) -> list[Held]:
    """Those that are in force, and where they shall be by the tick `aimed`, or now; reads back from the GPU."""
    tick, dt, extent = replay.tick, replay.recipe.fluid.dt, replay.grid.extent
    led, handles = replay.led, replay.handles
    if not any(one.is_in_force(tick, dt) for _, one in led):
        return []
    shapes = handles.shapes
    now, starts = handles.middles(shapes), handles.starts
    starts = np.where(np.isnan(starts), now, starts)
    targets = [
        handle.wanted(start, max(replay.time, aimed * dt, handle.ready), dt, np.inf) if handle.goal else start
        for handle, start in zip(handles.handles, starts, strict=True)
    ]
    found, near = [], near_enough(replay)
    for (label, one), shape, (due, left), *places in zip(
        led,
        shapes,
        handles.left(replay.time, dt),
        _fractions(starts, extent),
        _fractions(now, extent),
        _fractions(np.array(targets), extent),
        strict=True,
    ):
        if one.is_in_force(tick, dt):
            start, here, target = places
            lines = [_fractions(each, extent, one.closed) if one.points else () for each in (shape, due)]
            found.append(Held(one, label, start, here, target, left, left > near, *lines))
    return found


def as_seen(held: list[Held], replay: Replay) -> list[Held]:
    """The same where the picture is seen at the recipe's amount: what has arrived lies on what it holds there too."""
    amount, extent = replay.recipe.amount, replay.grid.extent
    if amount == 1 or not held:
        return held
    places = [np.multiply([one.now, *one.line], extent) for one in held]
    listed = np.concatenate(places)
    listed = listed + replay.warp.at(listed)  # in the original
    with ForwardMap(replay.seen) as forward:
        listed = listed + forward.at(listed)
    seen, several = [], np.split(listed, np.cumsum([len(each) for each in places])[:-1])
    for one, shown in zip(held, several, strict=True):
        now, *line = _fractions(shown, extent)
        if line:  # its middle is no point of the picture, and goes as its points do
            count = len(line) - one.led.closed
            across, down = (np.mean(line[:count], axis=0) - np.mean(one.line[:count], axis=0)).tolist()
            now = one.now[0] + across, one.now[1] + down
        start = _between(one.led.at, one.start, amount)
        target = _between(now, (now[0] + one.target[0] - one.now[0], now[1] + one.target[1] - one.now[1]), amount)
        seen.append(replace(one, start=start, now=now, target=target, line=tuple(line), due=()))
    return seen


class Unmet(NamedTuple):
    """A handle or a pin that is not where it is led.

    Attributes:
        label: what messages call it.
        said: a sentence of how far it is, and why.
        helped: a fit may bring it nearer.
    """

    label: str
    said: str
    helped: bool


def unmet(replay: Replay, within: float, is_fitted: bool = False) -> Iterator[Unmet]:
    """Which are farther than `within` longer sides from where they are led.

    Of what has let go, only what did so before its way was over. `is_fitted`: they have just been fitted, which is not
    said to help again.
    """
    if not replay.handles.handles:
        return
    solid = replay.solid
    for (label, led), far, points, halt in zip(
        replay.led, replay.handles.away, replay.handles.shapes, replay.handles.halts, strict=True
    ):
        if not (far <= within or (halt == "over" and led.span[1] <= led.let_go)):
            held = points if led.points else points[:1]
            columns, rows = np.clip(held / replay.grid.spacing, 0, np.array(replay.grid.size) - 1).astype(int).T
            if halt == "strain" and _nearest_of(solid, replay, held) < led.radius:
                halt = "frozen"
            why, cells = HALTED[halt], led.radius * max(led.detail, *replay.grid.size)
            # A fit leads what goes somewhere, and leaves pins as they are.
            helped = halt in HELPED and isinstance(led, RecipeHandle) and led.is_led and not is_fitted
            is_wide = cells >= LEAST_PER_RADIUS or (isinstance(led, RecipeHandle) and led.local == 1)
            if solid[rows, columns].any():
                why, helped = FROZEN, False
            elif halt in HELPED and leads_too_far(led, replay.grid.extent):  # `objections` say what helps
                why, helped = why if halt == "frozen" else FAR, False
            elif helped and halt in ("strain", "alone") and not is_wide:
                why, helped = SMALL.format(cells), False
            pixels = far * max(replay.pictures.source.width, replay.pictures.source.height)
            said = f"{label} is {in_pixels(pixels)} pixels ({far:.3g} longer sides) from where it should be: {why}"
            yield Unmet(label, said, helped)


def is_awaited(replay: Replay) -> bool:
    """One comes nearer to where it is led, however slowly, and has not let go of it; reads back from the GPU."""
    handles = replay.handles
    return any(far > ARRIVED and halt == "late" for far, halt in zip(handles.away, handles.halts, strict=True))


def _nearest_of(solid: np.ndarray, replay: Replay, places: np.ndarray) -> float:
    """How far the nearest solid cell is from any of these places, longer sides; infinite where none is solid."""
    rows, columns = np.nonzero(solid)
    cells = (np.stack([columns, rows], axis=-1) + 0.5) * replay.grid.spacing
    return min((float(np.hypot(*(cells - place).T).min(initial=np.inf)) for place in places), default=np.inf)


def _fractions(places: np.ndarray, extent: Point, closed: bool = False) -> Line:
    line = [(x, y) for x, y in (places / extent).tolist()]
    return (*line, *line[: 1 if closed else 0])


def _between(one: Point, other: Point, part: float) -> Point:
    return one[0] + part * (other[0] - one[0]), one[1] + part * (other[1] - one[1])

"""What a hand does to the picture over time: strokes of a brush, and changes of the fluid at a tick."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import accumulate, groupby, pairwise
from math import cos, hypot, inf, pi, sin
from typing import Annotated, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from app.model.schema import Fraction01, Model, Place, Several

ToolName = Literal["push", "curve", "twirl", "bloat", "pinch", "thicken", "thin", "freeze", "thaw", "smooth", "restore"]
Symmetry = Literal["none", "left-right", "up-down", "both", "radial"]
FINEST_DETAIL = 65536  # cells along the longer side; places are exact to some 1 / 200 of such a cell
SMALLEST_RADIUS = 1e-6  # longer sides, as of `Tip`; no pixel sees a smaller brush
LATEST = 10_000_000  # tick
MOST_TIMES = 1000  # that a stroke repeats
# In one tick, of all strokes and their times, and of the pieces of their paths that are gone through one by one: each
# takes about a millisecond. A mouse of 8,000 samples a second leaves 133 in a tick.
MOST_AT_ONCE = 1000
ONE_BY_ONE = {"curve", "thicken", "thin", "freeze", "thaw", "smooth", "restore"}
Tick = Annotated[int, Field(ge=0, le=LATEST)]
Sample = tuple[Tick, Place, Place, Fraction01]
"""(tick, x, y, pressure); x and y are fractions of the picture's width and height from its top-left corner."""


class Dab(NamedTuple):
    """A straight piece of a stroke's path, passed within one tick; from and to coincide where the brush stood still."""

    x0: float
    y0: float
    x1: float
    y1: float
    pressure: float


class BrushPath(Model):
    """The way of a tool: the samples of the pointer, in order.

    Between two samples the pointer moved at a constant speed, so that a stroke does not depend on how often the pointer
    was sampled: during tick n (the step from n to n + 1) the brush passes the path from time n - 1 to time n. A tool
    that acts while it stands still (twirl, bloat, thicken ...) acts in every tick from the first sample to the last.
    A curve acts all at once, in the tick of its last sample, along the whole path. Where the path would have more than
    `MOST_AT_ONCE` pieces in one tick, or in a curve, samples are left out evenly.

    Attributes:
        radius: of the brush, in longer sides.
        hardness: 0 is a soft falloff, 1 a hard edge.
        strength: 1 carries along at the pointer's speed (push), or works at the tool's own rate.
        reverse: the tool's opposite: push against the drag, twirl anticlockwise.
        detail: cells along the picture's longer side that the flow is solved with, in a window around the brush (see
            `app.model.windows`), and then the brush takes back nearby the area and momentum that it gives (see `Tip`);
            0: on the grid of the whole picture.
        symmetry: it acts again on the other sides of the picture's middle: "left-right" and "up-down" mirror it, "both"
            does both, "radial" turns it about the middle.
        sectors: how many times a radial one acts in all.
        hold: of a push: 0 slips by what it has carried and stretched already, 1 carries on; see `Push`.
        local: of a push: 0 pushes as a fluid does, which flows back beside the brush; 1 moves what is under it alone.
    """

    tool: ToolName
    radius: Annotated[float, Field(ge=SMALLEST_RADIUS, le=10)] = 0.08
    hardness: Fraction01 = 0.5
    strength: Annotated[float, Field(ge=0, le=100)] = 1.0
    reverse: bool = False
    detail: Annotated[int, Field(ge=0, le=FINEST_DETAIL)] = 0
    symmetry: Symmetry = "none"
    sectors: Annotated[int, Field(ge=2, le=16)] = 6
    hold: Fraction01 = 0.0
    local: Fraction01 = 0.0
    samples: Annotated[Several[Sample], Field(min_length=1)]

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        ticks = [sample[0] for sample in self.samples]
        if any(later < earlier for earlier, later in pairwise(ticks)):
            raise ValueError("the ticks of the samples must not go backwards")
        if self.tool == "curve" and len(self.samples) < 2:
            raise ValueError("a curve needs at least two samples")
        return self

    @property
    def first_tick(self) -> int:
        return self.samples[0][0]

    @property
    def last_tick(self) -> int:
        return self.samples[-1][0]

    @property
    def most_pieces(self) -> int:
        """The most pieces that are gone through one by one in a tick, counted for each of its images; at least 1.

        What leads the fluid goes the whole way at once. A push looks at what lies under each of its images, which takes
        about as long again; with detail each image takes back what it gives, and one counts as two.
        """
        if self.tool in ("push", "twirl"):
            images = 1 + len(turns(self.symmetry, self.sectors))
            if self.detail:
                return max(images, 2)
            return min(images, 2) if self.tool == "push" else 1
        counts = [1]
        if self.tool == "curve":
            counts.append(len(self.samples) - 1)
        elif self.tool in ONE_BY_ONE:
            counts += (len(list(same)) for _, same in groupby(self.samples, lambda sample: sample[0]))
        return min(max(counts), self._most) * self._images

    @property
    def _images(self) -> int:
        """How often each piece is gone through: once an image where what is under the brush is looked at, else once."""
        one_by_one = self.tool in ("restore", "smooth") or (self.detail and self.tool in ("bloat", "pinch"))
        return 1 + len(turns(self.symmetry, self.sectors)) if one_by_one else 1

    @property
    def _most(self) -> int:
        """The most pieces that its path may have in a tick."""
        return max(MOST_AT_ONCE // self._images, 1)

    @property
    def stays(self) -> bool:
        """All of its samples are at one place."""
        return all(sample[1:3] == self.samples[0][1:3] for sample in self.samples)

    def with_sample(self, tick: int, x: float, y: float, pressure: float) -> Self:
        """The stroke with one `Sample` more, which is trusted to be in order."""
        return self.model_copy(update={"samples": (*self.samples, (tick, x, y, pressure))})

    def at(self, tick: int) -> tuple[Dab, ...]:
        """The pieces of the path that are passed in this tick: none before the first sample and after the last."""
        if not self.first_tick <= tick <= self.last_tick:
            return ()
        if self.tool == "curve":
            return self._joined(self.samples) if tick == self.last_tick else ()
        inside = list(self.samples[bisect_left(self.samples, (tick,)) : bisect_left(self.samples, (tick + 1,))])
        before = None if tick == self.first_tick else self._interpolated(tick - 1)
        after = [] if inside else [self._interpolated(tick)]
        return self._joined(([before] if before else []) + inside + after)

    def images(self, dabs: tuple[Dab, ...], extent: tuple[float, float]) -> Iterator[tuple[tuple[Dab, ...], bool]]:
        """Pieces of its path, and what its symmetry makes of them, each with whether it is a mirror image.

        `extent`: (width, height) of the picture, the longer of them 1.
        """
        yield dabs, False
        width, height = extent
        for a, b, c, d in turns(self.symmetry, self.sectors):

            def place(x: float, y: float) -> tuple[float, float]:
                x, y = (x - 0.5) * width, (y - 0.5) * height
                return 0.5 + (a * x + b * y) / width, 0.5 + (c * x + d * y) / height  # noqa: B023

            yield tuple(Dab(*place(p.x0, p.y0), *place(p.x1, p.y1), p.pressure) for p in dabs), a * d < b * c

    def before(self, tick: int) -> Self | None:
        """What of it acts before a tick; None if nothing does. A curve is whole or not at all."""
        if self.last_tick < tick:
            return self
        if self.first_tick >= tick or self.tool == "curve":
            return None
        samples = tuple(sample for sample in self.samples if sample[0] < tick)
        if samples[-1][0] < tick - 1:
            samples = *samples, self._interpolated(tick - 1)
        return self.model_copy(update={"samples": samples})

    def travelled(self, tick: int, extent: tuple[float, float]) -> float:
        """The length of the path up to where the pieces of `at(tick)` begin, in units of `extent`'s sides."""
        if tick <= self.first_tick:
            return 0.0
        number = bisect_left(self.samples, (tick,)) - 1
        last = self._interpolated(min(tick - 1, self.last_tick))
        return _lengths(_Path(self.samples), extent)[number] + _distance(self.samples[number], last, extent)

    def _interpolated(self, tick: int) -> tuple[int, float, float, float]:
        """Where the pointer was at the end of `tick`, which lies between the first and the last."""
        number = bisect_left(self.samples, (tick + 1,))
        earlier = self.samples[number - 1]
        if earlier[0] == tick:
            return earlier
        later = self.samples[number]
        part = (tick - earlier[0]) / (later[0] - earlier[0])
        x, y, pressure = (a + (b - a) * part for a, b in zip(earlier[1:], later[1:], strict=True))
        return tick, x, y, pressure

    def _joined(self, points: list[tuple[int, float, float, float]] | tuple[Sample, ...]) -> tuple[Dab, ...]:
        if len(points) == 1:
            _, x, y, pressure = points[0]
            return (Dab(x, y, x, y, pressure),)
        if (pieces := len(points) - 1) > (most := self._most):
            points = [points[k * pieces // most] for k in range(most + 1)]
        return tuple(Dab(a[1], a[2], b[1], b[2], (a[3] + b[3]) / 2) for a, b in pairwise(points))

    def moved(self, ticks: int) -> Self:
        """The same so many ticks later, or earlier."""
        return self.model_copy(update={"samples": tuple((tick + ticks, *rest) for tick, *rest in self.samples)})

    def lasting(self, first: int, last: int) -> Self:
        """The same from one tick to another: faster, or slower; of what was done in one tick, evenly."""
        samples, span, count = self.samples, self.last_tick - self.first_tick, len(self.samples)
        if not span and count == 1 and last > first:
            samples, count = (*samples, samples[0]), 2
        parts = [tick - self.first_tick for tick, *_ in samples] if span else list(range(count))
        whole = span or max(count - 1, 1)
        # To the nearest tick, in whole numbers.
        ticks = (first + (2 * part * (last - first) + whole) // (2 * whole) for part in parts)
        return self.model_copy(
            update={"samples": tuple((tick, *rest) for tick, (_, *rest) in zip(ticks, samples, strict=True))}
        )

    def parts_from(self, other: BrushPath) -> int:
        """The tick before which both pass the same; at least the earlier one's first."""
        start = min(self.first_tick, other.first_tick)
        if self._head() != other._head():
            return start
        if self.tool == "curve":
            return min(self.last_tick, other.last_tick)
        together = 0
        for mine, theirs in zip(self.samples, other.samples, strict=False):
            if mine != theirs:
                break
            together += 1
        # After its last common sample a stroke may end or go on: in the tick after it, they already differ.
        return start if together == 0 else self._turning_point(other, together)

    def _turning_point(self, other: BrushPath, together: int) -> int:
        last = self.samples[together - 1][0]
        following = [stroke.samples[together][0] for stroke in (self, other) if len(stroke.samples) > together]
        return last if last in following else last + 1

    def _head(self) -> tuple[object, ...]:
        brush = self.tool, self.radius, self.hardness, self.strength, self.reverse, self.detail, self.hold, self.local
        return *brush, self.symmetry, self.sectors


class Act(NamedTuple):
    """What a stroke does in a tick: the pieces of its path, and the tick that it is at by its own samples."""

    stroke: Stroke
    tick: int
    dabs: tuple[Dab, ...]


class Stroke(BrushPath):
    """One stroke, in time.

    Attributes:
        muted: it does nothing.
        repeat: how many times it acts in all.
        every: ticks from the beginning of one time to that of the next, where it repeats.
    """

    muted: bool = False
    repeat: Annotated[int, Field(ge=1, le=MOST_TIMES)] = 1
    every: Tick = 0

    @model_validator(mode="after")
    def _repeats(self) -> Self:
        if self.repeat > 1 and not self.every:
            raise ValueError("a stroke that repeats needs 'every', the ticks from one beginning to the next")
        if self.repeat == 1 and self.every:
            raise ValueError("'every' is for a stroke that repeats; give 'repeat' too")
        if self.end_tick > LATEST:
            raise ValueError(f"it repeats beyond tick {LATEST}")
        return self

    @property
    def starts(self) -> float:
        """The first tick that it acts in; infinite where it is muted."""
        return inf if self.muted else self.first_tick

    @property
    def end_tick(self) -> int:
        """The last tick that it acts in, with all its repetitions."""
        return self.last_tick + (self.repeat - 1) * self.every

    def acts(self, tick: int) -> Iterator[Act]:
        """What it does in a tick, once for each of its times that are under way; nothing where it is muted."""
        if self.muted or not self.first_tick <= tick <= self.end_tick:
            return
        times = range(1)
        if self.repeat > 1:
            first = max(-((self.last_tick - tick) // self.every), 0)
            times = range(first, min((tick - self.first_tick) // self.every + 1, self.repeat))
        for number in times:
            own = tick - number * self.every
            if dabs := self.at(own):
                yield Act(self, own, dabs)

    def begins_at(self, tick: int) -> bool:
        """True if one of its times begins with this tick."""
        since = tick - self.first_tick
        if self.muted or since < 0:
            return False
        return not since or (self.repeat > 1 and not since % self.every and since < self.repeat * self.every)

    def repeated(self, times: int, every: int) -> Stroke:
        """The same, so many times in all."""
        return self.model_copy(update={"repeat": times, "every": every if times > 1 else 0})

    def cut(self, tick: int) -> tuple[Stroke, ...]:
        """What of it acts before a tick: the times that are whole by then, and of others as much as is."""
        if self.repeat == 1:
            before = self.before(tick)
            return () if before is None else (before,)
        whole = min(max((tick - 1 - self.last_tick) // self.every + 1, 0), self.repeat)
        begun = min(max((tick - 1 - self.first_tick) // self.every + 1, 0), self.repeat)
        once = self.repeated(1, 0)
        parts = (once.moved(number * self.every).before(tick) for number in range(whole, begun))
        kept = [self.repeated(whole, self.every)] if whole else []
        return *kept, *(part for part in parts if part is not None)

    def agrees_until(self, other: Stroke) -> float:
        """The tick before which both strokes do the same; infinite where they do so for ever."""
        if self.muted or other.muted:
            return min(self.starts, other.starts)
        same = self.samples == other.samples and self._head() == other._head()
        agreed = inf if same else self.parts_from(other)
        if (self.repeat, self.every) != (other.repeat, other.every):
            times = min(self.repeat, other.repeat) if self.every == other.every else 1
            nexts = (each.first_tick + times * each.every for each in (self, other) if each.repeat > times)
            agreed = min([agreed, *nexts])
        return agreed


def excess(strokes: Sequence[Stroke]) -> str | None:
    """A message if in some tick more strokes and pieces of them act than can in a second or two; else None."""
    acting = [stroke for stroke in strokes if not stroke.muted]
    pieces = [stroke.most_pieces for stroke in acting]
    if sum(stroke.repeat * count for stroke, count in zip(acting, pieces, strict=True)) <= MOST_AT_ONCE:
        return None
    # By how many more act in a tick than in the one before.
    changes = np.zeros(max(stroke.end_tick for stroke in acting) + 2, np.int32)
    for stroke, count in zip(acting, pieces, strict=True):
        first = stroke.last_tick if stroke.tool == "curve" else stroke.first_tick
        for tick, change in ((first, count), (stroke.last_tick + 1, -count)):
            changes[tick : tick + (stroke.repeat - 1) * stroke.every + 1 : max(stroke.every, 1)] += change
    acts = np.cumsum(changes, out=changes)
    if (most := int(acts.max())) <= MOST_AT_ONCE:
        return None
    what = "pieces of strokes" if max(pieces) > 1 else "strokes"
    at = int(acts.argmax())
    return f"{most} {what} act at once in tick {at}, with their repetitions; at most {MOST_AT_ONCE} work"


class _Path:
    """The samples of a stroke, found again without looking at each."""

    def __init__(self, samples: tuple[Sample, ...]) -> None:
        self.samples = samples

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Path) and self.samples is other.samples

    def __hash__(self) -> int:
        return id(self.samples)


@lru_cache(64)
def _lengths(path: _Path, extent: tuple[float, float]) -> list[float]:
    """Of a path up to each of its samples: once for all ticks, or a long stroke would take the square of its length."""
    return list(accumulate((_distance(a, b, extent) for a, b in pairwise(path.samples)), initial=0.0))


def _distance(a: Sample, b: Sample, extent: tuple[float, float]) -> float:
    return hypot((b[1] - a[1]) * extent[0], (b[2] - a[2]) * extent[1])


def turns(symmetry: Symmetry, sectors: int) -> list[tuple[float, float, float, float]]:
    """The matrices, row by row, that take a place from the picture's middle to its images, all but itself."""
    if symmetry == "radial":
        angles = (2 * pi * k / sectors for k in range(1, sectors))
        return [(cos(angle), -sin(angle), sin(angle), cos(angle)) for angle in angles]
    sides = {"left-right": [(-1, 1)], "up-down": [(1, -1)], "both": [(-1, 1), (1, -1), (-1, -1)]}
    return [(x, 0.0, 0.0, y) for x, y in sides.get(symmetry, [])]


class Change(Model):
    """What the user sets at a tick, before anything else happens in it; a key that is left out stays as it is."""

    tick: Tick
    viscosity: Annotated[float, Field(ge=0, le=1000)] | None = None
    drag: Annotated[float, Field(ge=0, le=1000)] | None = None
    walls: Literal["free-slip", "no-slip"] | None = None
    clear_velocity: bool = False
    reset_warp: bool = False
    clear_masks: bool = False

    def before(self, tick: int) -> Self | None:
        """What of it is in force when a tick begins: its settings at that tick too, but not what it does at once."""
        if self.tick < tick:
            return self
        kept = type(self)(tick=self.tick, viscosity=self.viscosity, drag=self.drag, walls=self.walls)
        return None if self.tick > tick or kept == type(self)(tick=tick) else kept

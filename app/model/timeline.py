"""Time: integer ticks of a constant dt, where an animation's frames lie, and what ends a simulation early."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from math import floor

from app.errors import UserError
from app.model.recipe import Playback, Recipe, Stop

MOST_FRAMES = 1_000_000
NEARLY = 1e-6  # of a frame: what rounding of times may lack


@dataclass(frozen=True)
class Timeline:
    """The ticks 0 .. `ticks` of a simulation; tick n is the time n * dt, and the warp at tick 0 is the identity."""

    ticks: int
    dt: float

    @classmethod
    def of(cls, recipe: Recipe) -> Timeline:
        return cls(recipe.ticks, recipe.fluid.dt)

    def tick_at(self, seconds: float) -> int:
        """The tick nearest to a time, within the timeline."""
        return min(max(round(seconds / self.dt), 0), self.ticks)

    def time_of(self, tick: float) -> float:
        """Seconds at a tick, which may lie between two."""
        return tick * self.dt


def frame_rate(fps: float) -> Fraction:
    """A rate that was given as a decimal; of 23.976, 29.97, 47.952, 59.94 and 119.88 the NTSC rate, as 24000/1001."""
    for whole in (24, 30, 48, 60, 120):
        exact = Fraction(whole * 1000, 1001)
        if round(float(exact), 3) == round(fps, 3):
            return exact
    return Fraction(fps).limit_denominator(1001)


def frame_positions(timeline: Timeline, playback: Playback, fps: float) -> list[Fraction]:
    """The position in ticks of every distinct frame of an animation, forwards in time.

    A position may lie between two ticks; it is then reached by a shorter last step of the warp map (`Replay.seek`).
    Frames are evenly spaced from the part's start to its end, both included, and as many as make the spacing nearest
    to speed / fps: the animation begins and ends exactly where it should, whatever fps and dt. In which order they are
    shown is `app.media.animation.frame_order`'s.

    Raises:
        UserError: if the animation would have more than a million frames.
    """
    start, end, wanted = _part(timeline, playback, fps)
    if wanted + (playback.hold_first + playback.hold_last) * fps > MOST_FRAMES:
        raise UserError(
            f"the animation would have more than {MOST_FRAMES} frames; raise 'time.speed' or lower 'output.fps'"
        )
    if end == start:
        return [Fraction(start)]
    count = steps_of(timeline, playback, fps)
    return [start + Fraction((end - start) * frame, count) for frame in range(count + 1)]


def steps_of(timeline: Timeline, playback: Playback, fps: float) -> int:
    """How many steps there are from frame to frame, from the first to the last."""
    start, end, wanted = _part(timeline, playback, fps)
    return max(1, round(wanted)) if end > start else 0


@dataclass(frozen=True)
class Dissolve:
    """A frame that is dissolved: so much of it, from 0 to 1, is what is seen at another position, in ticks."""

    into: Fraction
    share: float


def dissolved(positions: list[Fraction], frames: int) -> tuple[list[Fraction], dict[int, Dissolve]]:
    """The positions of a loop, and what its last frames dissolve into, by their places among these.

    Args:
        positions: of an animation's frames, in the order they are shown.
        frames: until nothing is left of the end. With as many less than the positions, of which the last
            one shows what the first one of the loop does, the loop begins after what is dissolved into.

    Raises:
        UserError: if it is more than half of the animation, or no frame shows it.
    """
    if frames < 2:
        raise UserError("the dissolve ('time.dissolve') takes less than two frames; make it longer")
    length = len(positions) - 1 - frames
    if length < frames:
        raise UserError("the dissolve ('time.dissolve') is more than half of the animation; make it shorter")
    into = {length - frames + number: Dissolve(positions[number], number / frames) for number in range(1, frames)}
    return positions[frames:-1], into


def moment_at(timeline: Timeline, playback: Playback, fps: float, tick: int) -> int:
    """Which frame of an animation is seen at a tick, on its way there: 0 is the first, and after a reversal the last.

    It is the last one that begins at the tick or before it, by `frame_positions`. Past the end of the timeline, time
    goes on as it does for a clip that is longer: frame after frame, at its rate.
    """
    (start, end, _), count = _part(timeline, playback, fps), steps_of(timeline, playback, fps)
    within = min(max(tick, start), end)
    shown = (within - start) * count // (end - start) if count else 0
    later = max(tick - max(end, timeline.ticks), 0)
    held = round(playback.hold_first * fps)
    return held + (count - shown if playback.reverse else shown) + floor(timeline.time_of(later) * fps + NEARLY)


def _part(timeline: Timeline, playback: Playback, fps: float) -> tuple[int, int, float]:
    """The first and the last tick of what is played, and how many frames lie between them."""
    start = timeline.tick_at(playback.start)
    end = timeline.ticks if playback.end is None else max(timeline.tick_at(playback.end), start)
    return start, end, timeline.time_of(end - start) / playback.speed * fps


@dataclass(frozen=True)
class Observation:
    """What stop conditions look at after a tick; None where nobody asked for it.

    Attributes:
        energy: kinetic energy.
        speed: largest speed, longer sides per second.
        displacement: largest displacement, longer sides.
        det: smallest det J of the warp map.
        away: how far the handle is that is farthest from where it is led, longer sides.
        points: where the watched points are now, as (x, y) in longer sides.
        extent: (width, height) of the picture, the longer of them 1.
    """

    energy: float | None = None
    speed: float | None = None
    displacement: float | None = None
    det: float | None = None
    away: float | None = None
    points: tuple[tuple[float, float], ...] = ()
    extent: tuple[float, float] = (1.0, 1.0)


class Sentinel:
    """Watches a simulation and says when a condition of the recipe's [stop] ends it.

    It remembers whether the fluid has moved at all, so that a fluid that has not been pushed yet is not "at rest".
    """

    def __init__(self, stop: Stop, dt: float) -> None:
        self.stop = stop
        self._dt = dt
        self._energetic = self._fast = False

    @property
    def needs_motion(self) -> bool:
        return self.stop.energy_below is not None or self.stop.speed_below is not None

    @property
    def needs_map(self) -> bool:
        return self.stop.displacement_above is not None or self.stop.det_below is not None

    @property
    def needs_handles(self) -> bool:
        return self.stop.handles_within is not None

    @property
    def needs_points(self) -> bool:
        return bool(self.stop.watch)

    @property
    def is_idle(self) -> bool:
        """True if there is nothing to watch."""
        return not (self.needs_motion or self.needs_map or self.needs_handles or self.needs_points)

    def verdict(self, tick: int, seen: Observation) -> str | None:
        """Which condition fired at this tick and when, or None."""
        reason = next(self._reasons(seen), None)
        return reason and f"stopped at t = {tick * self._dt:g} s (tick {tick}): {reason}"

    def _reasons(self, seen: Observation) -> Iterator[str]:
        stop = self.stop
        if stop.energy_below is not None and seen.energy is not None:
            if self._energetic and seen.energy < stop.energy_below:
                yield f"kinetic energy {seen.energy:.3g} is below {stop.energy_below:g}"
            self._energetic |= seen.energy >= stop.energy_below
        if stop.speed_below is not None and seen.speed is not None:
            if self._fast and seen.speed < stop.speed_below:
                yield f"largest speed {seen.speed:.3g} is below {stop.speed_below:g}"
            self._fast |= seen.speed >= stop.speed_below
        most = stop.displacement_above
        if most is not None and seen.displacement is not None and seen.displacement > most:
            yield f"largest displacement {seen.displacement:.3g} is above {most:g}"
        if stop.det_below is not None and seen.det is not None and seen.det < stop.det_below:
            yield f"smallest det J {seen.det:.3g} is below {stop.det_below:g}"
        if stop.handles_within is not None and seen.away is not None and seen.away <= stop.handles_within:
            yield f"all handles have arrived ({seen.away:.3g} away at most, within {stop.handles_within:g})"
        width, height = seen.extent
        for number, (watch, (x, y)) in enumerate(zip(stop.watch, seen.points, strict=False), 1):
            if watch.distance is not None:
                moved = _distance((x, y), (watch.point[0] * width, watch.point[1] * height))
                if moved >= watch.distance:
                    yield f"watched point {number} has moved {moved:.3g}, at least {watch.distance:g}"
            elif watch.place is not None:
                away = _distance((x, y), (watch.place[0] * width, watch.place[1] * height))
                if away <= watch.within:
                    yield f"watched point {number} has reached its place ({away:.3g} away, within {watch.within:g})"


def _distance(a: tuple[float, float], b: tuple[float, float]) -> float:
    return ((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2) ** 0.5

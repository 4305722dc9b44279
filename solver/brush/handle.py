"""A handle or a pin: what of the picture shall be where at which time.

Long, as a handle and its shape share what is found out here about lines and outlines.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from solver.brush.tip import FARTHEST, SMALLEST, Point
from solver.course import Course, between
from solver.limits import (
    LARGEST_LEAD,
    LEAST_SCALE,
    LEAST_STIFFNESS,
    LONGEST_LINE,
    MOST_SCALE,
    MOST_STRETCH,
    MOST_TURNED,
    beside_edges,
    beyond,
    check_type,
    numbers,
    places,
    rows_of,
)

SAME = 1e-9  # of the way from one led point of a line to the next: what a length is off by its rounding
# What is led as a whole has so many times as wide a push (H2), which turns round as far beside its middle as a stroke's
# of the handle's radius, 1 / sqrt(7) of it: what lies between its points goes along.
WIDER = 1.6
APART = 1 / 8  # radii between the points of a line that are led
RING = 1 / 4  # radii between a point that is turned or scaled and what tells how it is


@dataclass(frozen=True)
class Handle(Course):
    """A point of the picture on its way, or a line of points; longer sides and seconds, y down.

    Attributes:
        at: the place in the original of what is led; of a line, what is told of it as a whole is about this place.
        to: where to; None if it stays where it is at its start, as a pin does.
        radius: how far its brush reaches; of a line at least that of which it is `LONGEST_LINE` long.
        start: when it begins.
        duration: of the path, which begins and ends softly.
        end: when it lets go; until then it stays where it has arrived.
        stiffness: 1 is led exactly; with less it gives way to the fluid and to the others.
        local: the part of its motion, 0-1, that carries what is under it alone; see `Push`.
        keys: times and places (t, x, y), in order and none before its first way has ended: where it is led after that,
            at an even speed from one to the next.
        points: the corners of a line that is led as a whole, in the original; what of it is outside is not led.
        closed: the line ends where it begins.
        goals: where the corners shall be after that way, as many; without, they keep their places about `at`.
        rotate, scale: degrees that it is turned about `at` on its way, clockwise, and times that it is made as large. A
            point with neither turns as the fluid does; with one of them, and a line, the other is 0 or 1. A line that
            has goals has come to these then, and takes their shape while it turns.
        turned: times, degrees and scales (t, angle, scale), in order and none before its first way has ended: how it
            is turned and how large it is after that, likewise at an even speed.

    Raises:
        ValueError: if a number is not finite (but for `end`) or out of its range.
    """

    at: Point
    to: Point | None = None
    radius: float = 0.25
    start: float = 0.0
    duration: float = 1.0
    end: float = math.inf
    stiffness: float = 1.0
    local: float = 0.0
    keys: tuple[tuple[float, float, float], ...] = ()
    points: tuple[Point, ...] = ()
    closed: bool = False
    goals: tuple[Point, ...] = ()
    rotate: float | None = None
    scale: float | None = None
    turned: tuple[tuple[float, float, float], ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "at", numbers("a handle's place", self.at, 2))
        if self.to is not None:
            object.__setattr__(self, "to", numbers("where a handle goes", self.to, 2))
        for name in ("keys", "turned"):
            keys = getattr(self, name)
            check_type("a handle's keys", keys, Iterable)
            keys = rows_of("the keys of a handle", keys if isinstance(keys, np.ndarray) else (*keys,), 3)
            if name == "keys" and (np.abs(keys[:, 1:]) > FARTHEST).any():
                raise ValueError(f"a handle's keys are off the picture by more than {FARTHEST:g} sides")
            object.__setattr__(self, name, tuple(map(tuple, keys.tolist())))
        for number in (self.radius, self.start, self.duration, self.end, self.stiffness, self.local):
            check_type("a number of a handle", number)
        self._check_line()
        stations = (self.at, *((self.to,) if self.to else ()))
        if not all(abs(side) <= FARTHEST for place in (*stations, *self.points, *self.goals) for side in place):
            raise ValueError(f"a handle from {self.at} to {self.to} is off the picture by more than {FARTHEST:g} sides")
        if not 1e-6 <= self.radius <= 1:
            raise ValueError(f"a handle of radius {self.radius} was given; it must be from 1e-06 to 1")
        if not (0 <= self.start < math.inf and 0 <= self.duration < math.inf and self.start <= self.end):
            raise ValueError("a handle's start and duration must be finite and not negative, and its end not before")
        if not LEAST_STIFFNESS <= self.stiffness <= 1:
            given = f"a handle of stiffness {self.stiffness} was given"
            raise ValueError(f"{given}; it must be from {LEAST_STIFFNESS} to 1")
        if not 0 <= self.local <= 1:
            raise ValueError("the local part of a handle must be from 0 to 1")
        if not all(
            earlier <= later
            for ready, keys in ((self.ready, self.keys), (self.upright, self.turned))
            for earlier, later in pairwise([ready, *(key[0] for key in keys), math.inf])
        ):
            raise ValueError("the times of a handle's keys must not go backwards, nor begin before its way has ended")

    def _check_line(self) -> None:
        for name in ("points", "goals"):
            line = getattr(self, name)
            check_type("a line of a handle", line, Sequence | np.ndarray)
            object.__setattr__(self, name, tuple(map(tuple, places(line).tolist())) if np.size(line) else ())
        if self.points and len(set(self.points)) < 2 + self.closed:
            raise ValueError(f"a line of a handle has {2 + self.closed} different points or more")
        if self.goals and len(self.goals) != len(self.points):
            raise ValueError(f"a line of {len(self.points)} points has {len(self.goals)} goals; as many are wanted")
        if self.goals and self.to is None:
            object.__setattr__(self, "to", tuple(np.mean(self.goals, axis=0).tolist()))
        scale = 1.0 if self.scale is None else self.scale
        for angle, size in ((self.rotate or 0.0, scale), *(key[1:] for key in self.turned)):
            check_type("a number of a handle", angle)
            check_type("a number of a handle", size)
            if not abs(angle) <= MOST_TURNED:
                raise ValueError(f"a handle that is turned by {angle} was given; at most {MOST_TURNED:g} are wanted")
            if not LEAST_SCALE <= size <= MOST_SCALE:
                raise ValueError(
                    f"a handle's scale of {size} was given; it must be from {LEAST_SCALE} to {MOST_SCALE:g}"
                )

    @property
    def goal(self) -> Point | None:
        """Where it is led in the end; None if it stays where it is at its start."""
        return self.keys[-1][1:] if self.keys else self.to

    def wanted(self, start: np.ndarray, time: float, dt: float, farthest: float = LARGEST_LEAD) -> np.ndarray:
        """Where it shall be at a time, (2,), if it was at `start` when it began; `dt` says how exact the time is.

        `farthest`: radii from there that it goes.
        """

        x0, y0 = start.tolist()

        def within(place: Sequence[float]) -> Point:
            x, y = place[0] - x0, place[1] - y0
            part = min(1.0, farthest * self.reach / max(math.hypot(x, y), 1e-30))
            return part * x, part * y

        if not self.keys or time < self.ready:
            if self.to is None:
                return start
            part, (x, y) = self.passed(time), within(self.to)
            return np.array((x0 + part * x, y0 + part * y))
        here, there, part = between((x0, y0) if self.to is None else self.to, self.ready, self.keys, time, dt)
        x, y = within(here)
        if part == 0:
            return np.array((x0 + x, y0 + y))
        far_x, far_y = within(there)
        return np.array((x0 + (1 - part) * x + part * far_x, y0 + (1 - part) * y + part * far_y))

    @cached_property
    def reach(self) -> float:
        """Its radius, or what its line needs."""
        return max(self.radius, self._longest / LONGEST_LINE)

    @property
    def is_whole(self) -> bool:
        """True if it leads more than a point."""
        return bool(self.points) or self.turns

    @property
    def push_radius(self) -> float:
        """How far the push of each of its points reaches."""
        return self.reach * (WIDER if self.is_whole else 1.0)

    @cached_property
    def stations(self) -> np.ndarray:
        """Where along its line the points lie that are led: evenly, as numbers of corners."""
        line = _line(self.points, self.closed)
        count = max(math.ceil(self._longest / (APART * self.reach) - SAME), 2 + self.closed) + (not self.closed)
        lengths = _lengths(line)
        at = np.linspace(0.0, lengths[-1], count, endpoint=not self.closed)
        return np.interp(at, lengths, np.arange(len(line)))

    @property
    def _longest(self) -> float:
        """The length of its line, at its start or in the end."""
        lines = (_line(each, self.closed) for each in (self.points, self.goals) if each)
        return max((float(_lengths(line)[-1]) for line in lines), default=0.0)


@dataclass(frozen=True)
class Shape:
    """What of a picture a handle leads: points that go its way together.

    A point by itself; points all along a line; or a point that is turned or scaled with a ring of six around it, which
    tell how it is and are not pushed.

    Attributes:
        handle: whose it is.
        led: their places in the original, (n, 2).
        goals: where they shall be, likewise; None if the handle has no goals.
        around: the first of those that lie around an area; None if they are no closed line and no ring, if the line or
            its goals cross themselves or have no width, or if a part of it is outside and it is neither scaled nor has
            goals: the edge closes it, and what flows along that.
        extent: the sides of the picture, which lines do not leave.
        cell: a side of the fluid's cells, longer sides; see `edges`.
    """

    handle: Handle
    led: np.ndarray
    goals: np.ndarray | None
    around: int | None
    extent: Point
    cell: float = 0.0

    @classmethod
    def of(cls, handle: Handle, extent: Point, cell: float = 0.0) -> Shape:
        """What a handle leads of a picture with these sides."""
        goals, around = None, None
        if handle.points:
            line = _line(handle.points, handle.closed)
            at, around = handle.stations, 0 if handle.closed else None
            led, goals = _at(line, at), _at(_line(handle.goals, handle.closed), at) if handle.goals else None
        else:
            led = np.array([handle.at])
            if handle.is_whole:
                angles, around = np.arange(6) * np.pi / 3, 1
                ring = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
                led = np.concatenate([led, led + RING * handle.radius * ring])
        inside = ((led >= 0) & (led <= extent)).all(axis=1)
        if len(led) > 1 and inside.any():
            if handle.points and not (inside.all() or handle.goals or handle.turns):
                around = None
            led, goals = led[inside], goals if goals is None else goals[inside]
        if handle.closed and any(_crosses_itself(line) or _is_flat(line) for line in (led, goals) if line is not None):
            around = None  # the areas of its loops cancel, or there is none: what is left tells of no growth
        return cls(handle, led, goals, around if len(led) >= 3 + (around or 0) else None, extent, cell)

    @property
    def is_ring(self) -> bool:
        """True if all but the first of its points are a ring."""
        return len(self.led) > 1 and not self.handle.points

    @property
    def _is_point(self) -> bool:
        """True if it leads its place alone. Of a line that is one place in the picture, too, but not that of `at`."""
        return len(self.led) == 1 and not self.handle.points

    @cached_property
    def is_in_picture(self) -> bool:
        """True if some of it lies in the picture; of what is all outside nothing is led."""
        held = self.led if self.handle.points else np.array([self.handle.at])
        return bool(((held >= 0) & (held <= self.extent)).all(axis=1).any())

    def middle(self, places: np.ndarray) -> np.ndarray:
        """Where `at` of the handle is while its points are at these places, (2,)."""
        if not self.handle.points:
            return places[0]
        return places.mean(axis=0) + (self.handle.at - self.led.mean(axis=0))

    def place(self, places: np.ndarray, starts: np.ndarray) -> np.ndarray:
        """Where `at` of the handle is, (2,), with its points at these places, which were at `starts` when it began.

        Beside the middle of a line it is turned and scaled as that is.
        """
        if not self.handle.points:
            return places[0]
        (x, y), (now_x, now_y) = ((each - each.mean(axis=0)).T for each in (starts, places))
        along, across = (x * now_x + y * now_y).sum(), (x * now_y - y * now_x).sum()
        turn = np.array([[along, across], [-across, along]]) / max(float((x**2 + y**2).sum()), 1e-30)
        return places.mean(axis=0) + (self.handle.at - self.led.mean(axis=0)) @ turn

    def wanted(self, starts: np.ndarray, time: float, dt: float) -> np.ndarray:
        """Where its points shall be at a time, (n, 2), if they were at `starts` when it began; see `Handle.wanted`."""
        handle, middle = self.handle, self.middle(starts)
        there = handle.wanted(middle, time, dt)
        if not handle.points:
            there = np.clip(there, *self.edges(middle))
        if self._is_point:
            return there[None]
        there = self._about(there, starts, time, dt)
        way = (np.clip(there, *self.edges(starts)) if handle.points else there) - starts
        far = np.hypot(*way.T)[:, None]
        return starts + way * np.minimum(1.0, LARGEST_LEAD * handle.reach / np.maximum(far, 1e-30))

    def due(self, starts: np.ndarray, time: float, dt: float) -> np.ndarray:
        """Where its points shall be once it has gone its first way, and at a time after that, (n, 2), however far."""
        handle = self.handle
        time = max(time, handle.ready, handle.upright)
        return self._about(handle.wanted(self.middle(starts), time, dt, math.inf), starts, time, dt)

    def edges(self, starts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Between which places what was at `starts` may be led.

        Points of a line: as `beside_edges`. A point by itself, as what lies before it flows off to its sides: up to a
        cell from the picture's edge, since the fluid resolves no less; and nearer if it began nearer.
        """
        if self.handle.points:
            return beside_edges(starts, self.extent)
        inside, extent = np.clip(starts, 0.0, self.extent), np.array(self.extent)
        return np.minimum(inside / MOST_STRETCH, self.cell), extent - np.minimum(
            (extent - inside) / MOST_STRETCH, self.cell
        )

    def short_of_edges(self, starts: np.ndarray) -> float:
        """How far what is farthest of it stays from its last goal, which is nearer to an edge than it is led."""
        ends = self.due(starts, math.inf, 1.0)
        if not self.handle.points:
            starts, ends = starts[:1], ends[:1]
        return beyond(ends, self.edges(starts))

    def away(self, places: np.ndarray, ends: np.ndarray) -> float:
        """How far what is farthest of it is from these places; of a ring, by how far it is turned and scaled."""
        left = places - ends
        if self.is_ring:
            arms = places[1:] - places[0]
            turned = float(spun(left[1:] - left[0], arms))
            scaled = abs(self.grown(ends, places) - 1) * float(np.hypot(*arms.T).mean())
            return float(np.hypot(*left[0]) + math.hypot(turned, scaled))
        return float(np.hypot(*left.T).max())

    def grown(self, before: np.ndarray, after: np.ndarray) -> float:
        """How many times as large a ring is at some places as at others, (n, 2) each, by the area within it; or by its
        arms, where in a corner of the picture only two of its points are, which have none.
        """
        if self.around is None:
            then, now = (float(np.hypot(*(places[1:] - places[0]).T).mean()) for places in (before, after))
            return now / (then or 1.0)
        return math.sqrt(abs(area(after[1:]) / (area(before[1:]) or 1.0)))

    def _about(self, there: np.ndarray, starts: np.ndarray, time: float, dt: float = 1.0) -> np.ndarray:
        """Its points with the handle at a place, turned as at a time."""
        if self._is_point:
            return there[None]
        return np.clip(self.laid(there, starts, time, dt), 0.0, self.extent)

    def laid(self, there: np.ndarray, starts: np.ndarray, time: float, dt: float = 1.0) -> np.ndarray:
        """Its points, (n, 2), with the handle at a place, turned as at a time, also outside; see `wanted`."""
        handle, from_middle = self.handle, starts - self.middle(starts)
        angle, scale = handle.turn(time, dt)
        if self.goals is not None:  # before they are turned
            assert handle.to is not None
            part, goals = handle.passed(time), _spun(self.goals - handle.to, -(handle.rotate or 0.0))
            from_middle = (1 - part) * from_middle + part / (handle.scale or 1.0) * goals
        return there + scale * _spun(from_middle, angle)


def spun(motion: np.ndarray, arms: np.ndarray) -> np.ndarray:
    """How far the ends of arms (n, 2) move with the turn that their motion (..., n, 2) is in the mean; (...)."""
    turn = np.stack([-arms[:, 1], arms[:, 0]], axis=-1)
    along = np.ascontiguousarray(motion * turn).reshape(*motion.shape[:-2], arms.size).sum(axis=-1)
    return along / max(float((arms**2).sum()), 1e-30) * np.hypot(*arms.T).mean()


def _spun(arms: np.ndarray, angle: float) -> np.ndarray:
    """Arms (n, 2) turned by an angle, degrees clockwise."""
    angle = math.radians(angle)
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    return arms @ turn


def area(loop: np.ndarray) -> float:
    """The area within a closed line of places (n, 2), positive clockwise."""
    x, y = (loop - loop.mean(axis=0)).T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def swelling(loop: np.ndarray, motion: np.ndarray) -> float:
    """How fast the area within a closed line of places (n, 2) grows by their motion, in parts of it: 1 / s."""
    x, y = (np.roll(loop, -1, axis=0) - np.roll(loop, 1, axis=0)).T
    grown, now = 0.5 * float((motion[:, 0] * y - motion[:, 1] * x).sum()), area(loop)
    return grown / now if now else 0.0


def _is_flat(loop: np.ndarray) -> bool:
    """True if the area within a closed line of places (n, 2) is no more than their rounding makes it."""
    around = float(np.hypot(*(np.roll(loop, -1, axis=0) - loop).T).sum())
    return abs(area(loop)) <= SMALLEST * around


def _crosses_itself(loop: np.ndarray) -> bool:
    """True if two sides of a closed line of places (n, 2) cross."""
    ends = np.roll(loop, -1, axis=0)

    def side_of(places: np.ndarray) -> np.ndarray:
        """On which side of each side (rows) each place lies."""
        (x, y), (far_x, far_y) = (ends - loop).T[..., None], (places - loop[:, None]).transpose(2, 0, 1)
        return x * far_y - y * far_x

    parted = side_of(loop) * side_of(ends) < 0
    return bool((parted & parted.T).any())


def _line(corners: Sequence[Point], closed: bool) -> np.ndarray:
    return np.array([*corners, corners[0]] if closed else corners)


def _lengths(line: np.ndarray) -> np.ndarray:
    """How far along a line its corners lie."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])


def _at(line: np.ndarray, stations: np.ndarray) -> np.ndarray:
    """The places on a line at numbers of corners, which may lie between two."""
    return np.stack([np.interp(stations, np.arange(len(line)), side) for side in line.T], axis=-1)

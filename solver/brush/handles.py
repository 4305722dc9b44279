"""Handles and pins: points of the picture that feedback leads to where they shall be, and holds there."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from typing import Any, NamedTuple

import numpy as np

from solver.brush.tip import FARTHEST, Point, Tip
from solver.faces import Forces
from solver.gl.field import Field
from solver.grid import Grid
from solver.limits import LARGEST_LEAD, check_step, check_type, numbers
from solver.scheme import Scheme
from solver.state import State
from solver.warp.inverse import ForwardMap
from solver.warp.map import WarpMap

RATE = 8.0  # 1 / s: at which what is left of a way is gone
# Radii that a handle goes in a tick at most: its push strains what is beside it by up to 7 times as much (H2), and a
# step of the map follows a strain of 1/2.
FARTHEST_STEP = 0.07
SAME_TIME = 1e-6  # steps between two times that are the same but for their rounding
# Added to the squares of the influences, which are 1 for a handle by itself: of two that lie on one another nothing
# finite would do both wills. A handle alone gets 1 / (1 + RIDGE) of what it wants in a tick, and the rest in the next.
RIDGE = 1e-3
# Of the map around a handle: det J, which a flow keeps at 1 as long as the map resolves it, and what is local does not;
# what becomes of the area of triangles of texels, as the local one, since a remap keeps what is at its texels only;
# and how many times farther apart in the original two neighbours on a lattice lie. From the first of
# each on it goes slower, at the second it stops: before anything folds.
SLOWING, STOPPED = 0.92, 0.8
SLOWING_LOCAL, STOPPED_LOCAL = 0.4, 0.22
STRETCHING, TORN = 8.0, 12.0
PLACES = 256  # along the longer side of the picture where that is looked at, or as many as there are cells
RINGS = (1 / 64, 1 / 32, 1 / 16)  # radii of rings of `AROUND` places around its middle, likewise: what two handles that
AROUND = 16  # nearly meet lead apart is less than that far across
# Newton's method for a handle's place: longer sides that are left, where it ends, and where it has failed.
FOUND, LOST = 1e-7, 1e-4
MOST_ROUNDS = 8


@dataclass(frozen=True)
class Handle:
    """A point of the picture on its way; longer sides and seconds, y down.

    Attributes:
        at: the place in the original of what is led.
        to: where to; None if it stays where it is at its start, as a pin does.
        radius: how far its brush reaches.
        start: when it begins.
        duration: of the path, which begins and ends softly.
        end: when it lets go; until then it stays where it has arrived.
        stiffness: 1 is led exactly; with less it gives way to the fluid and to the others.
        local: the part of its motion, 0-1, that carries what is under it alone; see `Push`.
        keys: times and places (t, x, y), in order and none before its first way has ended: where it is led after that,
            at an even speed from one to the next.

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

    def __post_init__(self) -> None:
        object.__setattr__(self, "at", numbers("a handle's place", self.at, 2))
        if self.to is not None:
            object.__setattr__(self, "to", numbers("where a handle goes", self.to, 2))
        check_type("a handle's keys", self.keys, Iterable)
        object.__setattr__(self, "keys", tuple(numbers("a handle's key", key, 3) for key in self.keys))
        for number in (self.radius, self.start, self.duration, self.end, self.stiffness, self.local):
            check_type("a number of a handle", number)
        places = (*self.at, *(self.to or ()), *(side for key in self.keys for side in key[1:]))
        if not all(abs(place) <= FARTHEST for place in places):
            raise ValueError(f"a handle from {self.at} to {self.to} is off the picture by more than {FARTHEST:g} sides")
        if not 1e-6 <= self.radius <= 1:
            raise ValueError(f"a handle of radius {self.radius} was given; it must be from 1e-06 to 1")
        if not (0 <= self.start < math.inf and 0 <= self.duration < math.inf and self.start <= self.end):
            raise ValueError("a handle's start and duration must be finite and not negative, and its end not before")
        if not 0.001 <= self.stiffness <= 1:
            raise ValueError(f"a handle of stiffness {self.stiffness} was given; it must be from 0.001 to 1")
        if not 0 <= self.local <= 1:
            raise ValueError("the local part of a handle must be from 0 to 1")
        times = [self.ready, *(key[0] for key in self.keys), math.inf]
        if not all(earlier <= later for earlier, later in pairwise(times)):
            raise ValueError("the times of a handle's keys must not go backwards, nor begin before its way has ended")

    @property
    def ready(self) -> float:
        """When it has gone its first way, and its keys may begin."""
        return self.start if self.to is None else self.start + self.duration

    @property
    def goal(self) -> Point | None:
        """Where it is led in the end; None if it stays where it is at its start."""
        return self.keys[-1][1:] if self.keys else self.to

    def wanted(self, start: np.ndarray, time: float, dt: float) -> np.ndarray:
        """Where it shall be at a time, (2,), if it was at `start` when it began; `dt` says how exact the time is."""

        def within(place: Sequence[float]) -> np.ndarray:
            way = np.subtract(place, start)
            return way * min(1.0, LARGEST_LEAD * self.radius / max(float(np.hypot(*way)), 1e-30))

        if not self.keys or time < self.ready:
            return start if self.to is None else start + self.passed(time) * within(self.to)
        stations = [(self.ready, *(start if self.to is None else self.to)), *self.keys]
        number = max(number for number, (since, *_) in enumerate(stations) if since <= time + SAME_TIME * dt)
        (since, *here), (until, *there) = stations[number], stations[min(number + 1, len(stations) - 1)]
        if until == since or abs(time - since) <= SAME_TIME * dt:  # nothing of what comes later is seen in it
            return start + within(here)
        part = (time - since) / (until - since)
        return start + (1 - part) * within(here) + part * within(there)

    def passed(self, time: float) -> float:
        """The part of its way, 0-1, that it shall have gone at a time."""
        if time >= self.start + self.duration:
            return 1.0
        if time <= self.start:  # also where it goes its way at once
            return 0.0
        part = (time - self.start) / self.duration
        return part * part * (3 - 2 * part)


class Lead(NamedTuple):
    """What the active handles do in a step, found before it.

    Attributes:
        active: their numbers.
        places, radii: of their brushes, (n, 2) and (n,).
        influence: how the push of each moves each, (n, n, 2, 2): see `_influences`.
        wanted: how the fluid shall move at them, (n, 2), longer sides / s.
        local: what of their motion carries the picture and not the fluid, (n, 2).
    """

    active: np.ndarray
    places: np.ndarray
    radii: np.ndarray
    influence: np.ndarray
    wanted: np.ndarray
    local: np.ndarray


class Handles:
    """Leads handles together through a fluid: see *Handles* in README.md.

    Where they are is found in every step by inverting the map, so that no error adds up.

    Args:
        fluid: what they move.
        warp: the map of the picture that the fluid carries.
        handles: their number is that in the list, from 0.
    """

    def __init__(self, fluid: Scheme, warp: WarpMap, handles: Sequence[Handle]) -> None:
        check_type("what handles move", fluid, Scheme)
        check_type("what handles look at", warp, WarpMap)
        self._fluid, self._warp, self._forward = fluid, warp, ForwardMap(warp)
        self._stream = fluid.device.field((fluid.grid.nx + 1, fluid.grid.ny + 1), 1, "stream function of handles")
        self._one = fluid.device.field((1, 1), 1, "slip of handles")
        self._one.clear(1.0)
        self._motion = fluid.device.field((1, 1), 4, "motion at a handle")
        # Where those that have begun are, and were then; NaN for the others.
        self._places = self._starts = np.zeros((0, 2))
        self._lead: Lead | None = None  # of the present step
        self.replace(handles)

    def replace(self, handles: Sequence[Handle]) -> None:
        """Go on with other handles; those that have begun keep their number."""
        check_type("what is led", handles, Iterable)
        for handle in handles:
            check_type("a handle", handle, Handle)
        self.handles = tuple(handles)
        self._at = np.array([handle.at for handle in handles], np.float64).reshape(-1, 2)
        self._radii = np.array([handle.radius for handle in handles])
        self._local = np.array([handle.local for handle in handles])
        self._places, self._starts = (self._fitted(kept) for kept in (self._places, self._starts))

    # -- a step -----------------------------------------------------------------------------------------------------

    def advance(self, dt: float, forces: Forces = ()) -> None:
        """Make a step of the fluid, with forces if there are any, and of its map, led by the handles.

        Raises:
            ValueError: as `Scheme.step`.
        """
        self.lead(dt, self._fluid.time)
        self._fluid.step(dt, forces, self.make_up)
        self.carry()
        self._warp.follow(self._fluid, dt)  # pyright: ignore[reportArgumentType]

    def lead(self, dt: float, time: float) -> None:
        """Before a step at a time: find where the handles are and shall go, and add what the fluid lacks of that."""
        if not check_step(dt) > 0:
            raise ValueError("to lead a handle takes some time")
        active = [handle.start <= time + dt / 2 < handle.end for handle in self.handles]
        self._places = self._located()
        begun = np.array([handle.start <= time + dt / 2 for handle in self.handles], bool)
        if (new := begun & np.isnan(self._starts[:, 0])).any():
            self._places[new] = self._at[new] + self._forward.at(self._at[new])
            self._starts[new] = self._places[new]
        numbers = np.flatnonzero(active)
        places, radii, share = self._places[numbers], self._radii[numbers], self._local[numbers]
        slower = self._slower(numbers)
        self._calm(places, radii, 1 - slower)
        wanted = self._wanted_velocities(numbers, slower, time, dt)
        push, local = self._influences(places, radii)
        # What is local is shared out first: the fluid would else do all of it, going on by itself.
        both = (1 - share[:, None, None]) * push + share[:, None, None] * local
        carried = share[:, None] * self._solved(numbers, both, wanted)
        wanted = wanted - np.einsum("ijab,jb->ia", local, carried)
        lead = self._lead = Lead(numbers, places, radii, push, wanted, carried)
        self._fluid.impulse.add(lambda faces: self._give(lead, faces))

    def make_up(self, velocity: Field) -> None:
        """After viscosity, before the projection: add to a velocity on MAC faces what is still lacking.

        For `steer` of `Scheme.step`. Spares what is thicker than at each handle, as `Brush.make_up`.
        """
        if self._lead is not None:
            self._give(self._lead, velocity, ATTENUATED=1)

    def carry(self) -> None:
        """After a step: let what is local carry the picture until the fluid's next one."""
        fluid, grid, lead = self._fluid, self._fluid.grid, self._lead
        if lead is None or not lead.local.any():
            return
        viscosity, shader = self._probed(lead, fluid.faces())[:, 3], fluid.device.pass_("brush/carry.frag")
        for place, radius, motion, here in zip(*_brushes(lead), lead.local, viscosity, strict=True):
            tip = Tip(place, place, radius)
            self._motion.clear(0.0, 0.0, 0.0, here)
            inputs = tip.inputs(grid) | {"brush_velocity": tuple(motion.tolist()), "viscosity": fluid.viscosity}
            inputs |= {"motion": self._motion, "slip": self._one}
            fluid.local.add(lambda field, i=inputs, t=tip: shader(field, add=True, region=t.region(grid), **i))

    # -- what it looks at -------------------------------------------------------------------------------------------

    @property
    def places(self) -> np.ndarray:
        """Where they are now, (n, 2) in longer sides, or will begin; looking changes nothing."""
        found, waiting = self._located(), np.isnan(self._starts[:, 0])
        if waiting.any():
            found[waiting] = self._at[waiting] + self._forward.at(self._at[waiting])
        return found

    @property
    def starts(self) -> np.ndarray:
        """Where they were when they began, (n, 2) in longer sides; NaN where they have not."""
        return self._starts.copy()

    @property
    def away(self) -> np.ndarray:
        """How far each is from where it shall be in the end, (n,) in longer sides; 0 of pins that have not begun."""
        places = self.places
        starts = np.where(np.isnan(self._starts), places, self._starts)
        ends = [handle.goal or start for handle, start in zip(self.handles, starts, strict=True)]
        return np.hypot(*(places - np.reshape(ends, (-1, 2))).T)

    # -- its state --------------------------------------------------------------------------------------------------

    def save(self) -> State:
        """A copy of this moment."""
        return State({}, {"places": self._places.copy(), "starts": self._starts.copy()})

    def restore(self, state: State) -> None:
        """Go back to a moment, perhaps with other handles than then among those that had not begun.

        Raises:
            ValueError: if it is of none.
        """
        for name in ("places", "starts"):
            kept = state.values.get(name)
            if kept is None or kept.dtype != np.float64 or kept.ndim != 2 or kept.shape[1] != 2:
                raise ValueError("the state of handles is missing")
        self._places, self._starts = (self._fitted(state.values[name]) for name in ("places", "starts"))
        self._lead = None

    def release(self) -> None:
        """Free the textures."""
        for field in (self._stream, self._one, self._motion, self._forward):
            field.release()

    # -- where they are ---------------------------------------------------------------------------------------------

    def _fitted(self, kept: np.ndarray) -> np.ndarray:
        rows = np.full((len(self.handles), 2), np.nan)
        count = min(len(rows), len(kept))
        rows[:count] = kept[:count]
        return rows

    def _located(self) -> np.ndarray:
        """Where the handles that have begun are: x with x + D(x) = at, by Newton's method from where they were."""
        places, begun = self._places.copy(), np.flatnonzero(~np.isnan(self._starts[:, 0]))
        if not len(begun):
            return places
        wanted, extent, step = self._at[begun], np.array(self._warp.extent), np.array(self._fluid.grid.spacing) / 4
        around = np.array([(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)]) * step
        found = best = places[begun]
        least = np.full(len(begun), np.inf)
        for _ in range(MOST_ROUNDS):
            points = found[:, None] + around
            moved = self._warp.at(points.reshape(-1, 2)).astype(np.float64).reshape(-1, 5, 2)
            rest = found + moved[:, 0] - wanted
            far = np.hypot(*rest.T)
            best, least = np.where((far < least)[:, None], found, best), np.minimum(far, least)
            if (least < FOUND).all():
                break
            slopes = np.stack([moved[:, 1] - moved[:, 2], moved[:, 3] - moved[:, 4]], axis=-1) / (2 * step)
            back = (np.linalg.pinv(np.eye(2) + slopes) @ rest[..., None])[..., 0]
            back *= np.minimum(1.0, FARTHEST_STEP * self._radii[begun] / np.maximum(np.hypot(*back.T), 1e-30))[:, None]
            found = np.clip(found - back, 0.0, extent)
        if (lost := least > LOST).any():  # the map has been changed by something else than the flow
            best[lost] = wanted[lost] + self._forward.at(wanted[lost])
        places[begun] = best
        return places

    def _wanted_velocities(self, numbers: np.ndarray, slower: np.ndarray, time: float, dt: float) -> np.ndarray:
        """How the handles of these numbers shall move in this step, longer sides / s."""
        wanted = np.zeros((len(numbers), 2))
        for row, number in enumerate(numbers):
            handle, start, place = self.handles[number], self._starts[number], self._places[number]
            now, then = handle.wanted(start, time, dt), handle.wanted(start, time + dt, dt)
            back = now - place
            most = FARTHEST_STEP * handle.radius
            step = slower[row] * (then - now - math.expm1(-RATE * dt) * back)
            wanted[row] = step * min(1.0, most / max(float(np.hypot(*step)), 1e-30)) / dt
        return wanted

    def _slower(self, numbers: np.ndarray) -> np.ndarray:
        """The part of its speed, 0-1, that the map around each of these handles still allows."""
        if not len(numbers):
            return np.zeros(0)
        extent, radii = np.array(self._warp.extent), self._radii[numbers]
        count = np.maximum(self._fluid.grid.size, PLACES * extent / extent.max()).astype(int)
        columns, rows = ((np.arange(n) + 0.5) * side / n for n, side in zip(count, extent, strict=True))
        over = _distorted(self._warp, np.stack(np.meshgrid(columns, rows), axis=-1)[None])[0]
        angles = 2 * np.pi * np.arange(AROUND + 1) / AROUND
        rings = np.array(RINGS)[:, None, None] * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        close = self._places[numbers, None, None] + rings * radii[:, None, None, None]
        near = _distorted(self._warp, np.clip(close, 0.0, extent)).reshape(len(numbers), -1, 3)
        least, most = near[..., 0].min(axis=1), near[..., 1].max(axis=1)
        area = near[..., 2].min(axis=1)
        low = np.clip(np.floor((self._places[numbers] - radii[:, None]) / extent * count), 0, count - 1).astype(int)
        high = np.ceil((self._places[numbers] + radii[:, None]) / extent * count).astype(int)
        for row, ((left, top), (right, bottom)) in enumerate(zip(low, high, strict=True)):
            box = over[top : max(bottom, top + 1), left : max(right, left + 1)]
            least[row] = min(least[row], box[..., 0].min())
            most[row] = max(most[row], box[..., 1].max())
            area[row] = min(area[row], box[..., 2].min())
        local = self._local[numbers]
        slowing = SLOWING + local * (SLOWING_LOCAL - SLOWING)
        stopped = STOPPED + local * (STOPPED_LOCAL - STOPPED)
        bears = _smoothstep((least - stopped) / (slowing - stopped)) * _smoothstep((TORN - most) / (TORN - STRETCHING))
        return bears * _smoothstep((area - STOPPED_LOCAL) / (SLOWING_LOCAL - STOPPED_LOCAL))

    # -- what they do to the fluid ----------------------------------------------------------------------------------

    def _calm(self, places: np.ndarray, radii: np.ndarray, share: np.ndarray) -> None:
        """Take that share of what flows under handles: those that halt, as the map bears no more, halt the fluid."""
        if not share.any():
            return
        fluid = self._fluid
        listed = np.column_stack([places - fluid.grid.origin, radii, share])
        handles = fluid.device.upload(listed[None].astype(np.float32), "handles that halt")
        calm = fluid.device.pass_("brush/calm.frag")
        fluid.impulse.add(
            lambda faces: calm(faces, add=True, handles=handles, velocity=fluid.faces(), spacing=fluid.grid.spacing)
        )
        handles.release()

    def _influences(self, places: np.ndarray, radii: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How the push and the local brush of each handle move each: velocities (i, a) for forces (j, b)."""
        push = np.zeros((len(places), len(places), 2, 2))
        local = np.zeros_like(push)
        for mirror, shift in _images(self._fluid.grid):
            r = (places[:, None] - (mirror * places + shift)) / radii[:, None]
            q = np.hypot(r[..., 0], r[..., 1])
            far = np.maximum(1 - q, 0.0)[..., None, None]
            across = np.stack([-r[..., 1], r[..., 0]], axis=-1)
            # The curl of (1 - q)^5 (1 + 5 q) (F x r).
            outer = across[..., :, None] * across[..., None, :]
            push += (far**5 * (1 + 5 * q[..., None, None]) * np.eye(2) - 30 * far**4 * outer) * mirror
            if mirror.sum() >= 0:  # carry.frag takes images beyond one wall, and off the component across it
                sign = np.ones(2) if mirror.sum() > 0 else np.minimum(mirror, 0.0)
                local += (np.maximum(1 - q**2, 0.0) ** 3)[..., None, None] * np.diag(sign)
        return push, local

    def _solved(self, numbers: np.ndarray, influence: np.ndarray, wanted: np.ndarray) -> np.ndarray:
        """The forces that together make the wanted velocities, as far as the ridge and stiffness let them: (H3)."""
        count = 2 * len(wanted)
        matrix = influence.transpose(0, 2, 1, 3).reshape(count, count)
        soft = [1 / self.handles[number].stiffness - 1 + RIDGE for number in numbers for _ in (0, 1)]
        dual = np.linalg.solve(matrix @ matrix.T + np.diag(soft), wanted.reshape(count))
        return (matrix.T @ dual).reshape(-1, 2)

    def _probed(self, lead: Lead, velocity: Field) -> np.ndarray:
        """At the active handles: velocity, the part that a brush may do, viscosity; (n, 4) float64."""
        fluid, device = self._fluid, self._fluid.device
        listed = np.column_stack([lead.places - fluid.grid.origin, lead.radii])
        handles = device.upload(listed[None].astype(np.float32), "handles")
        found = device.field(handles.size, 4, "fluid at the handles")
        inputs: dict[str, Any] = {
            "viscosity": fluid.viscosity,
            "solid": fluid.solid,
            "velocity": velocity,
            "handles": handles,
        }
        probe = device.pass_("brush/probe_handles.frag")
        probe(found, impulse=fluid.impulse.field, spacing=fluid.grid.spacing, **inputs)
        values = found.get()[0].astype(np.float64)
        handles.release()
        found.release()
        return values

    def _give(self, lead: Lead, faces: Field, **attenuated: Any) -> None:
        """Add to a velocity on MAC faces what the active handles lack of the wanted one."""
        if not len(lead.active):
            return
        fluid, grid = self._fluid, self._fluid.grid
        found = self._probed(lead, faces)
        lacking = self._solved(lead.active, lead.influence, lead.wanted - found[:, :2])
        masks: dict[str, Any] = {}
        if attenuated:
            lacking *= found[:, 2:3]
            masks["viscosity"] = fluid.viscosity
        draw, size = fluid.device.pass_("brush/handle_stream.frag", **attenuated), self._stream.size
        self._stream.clear()
        for mirror, shift in _images(grid):
            for (x, y), radius, force, here in zip(*_brushes(lead), lacking, found[:, 3], strict=True):
                place = float(mirror[0] * x + shift[0]), float(mirror[1] * y + shift[1])
                x0, y0, width, height = region = Tip(place, place, radius).region(grid)
                if x0 >= size[0] or y0 >= size[1] or x0 + width <= 0 or y0 + height <= 0:
                    continue
                from_corner = place[0] - grid.origin[0], place[1] - grid.origin[1]
                inputs: dict[str, Any] = {"force": tuple((mirror * force).tolist()), **masks}
                if attenuated:
                    inputs["tip_viscosity"] = here
                inputs |= {"place": from_corner, "radius": radius, "spacing": grid.spacing}
                draw(self._stream, add=True, region=region, **inputs)
        fluid.device.pass_("brush/curl.frag")(faces, add=True, stream=self._stream, spacing=grid.spacing)


def _brushes(lead: Lead) -> tuple[list[Point], list[float]]:
    """Places and radii of the active handles."""
    return [(x, y) for x, y in lead.places.tolist()], lead.radii.tolist()


def _distorted(warp: WarpMap, points: np.ndarray) -> np.ndarray:
    """At lattices of places (k, n, m, 2): det J, how many times nearer than in the original a neighbour lies, and area.

    That is how many times larger in the original the triangle with the next texel to the right and below is, negative
    where it is folded.
    """
    listed, found = points.reshape(-1, 2), np.zeros((*points.shape[:-1], 3))
    found[..., 0] = warp.determinants(listed).reshape(points.shape[:-1])
    moved, texel = warp.at(listed).astype(np.float64), np.divide(warp.extent, warp.size)
    original = points + moved.reshape(points.shape)
    right, below = (
        np.eye(2)[axis] + (warp.at(listed + texel * np.eye(2)[axis]) - moved) / texel[axis] for axis in (0, 1)
    )
    found[..., 2] = (right[:, 0] * below[:, 1] - right[:, 1] * below[:, 0]).reshape(points.shape[:-1])
    for axis in (1, 2):
        apart, far = (np.hypot(*np.moveaxis(np.diff(each, axis=axis), -1, 0)) for each in (original, points))
        ratio = np.where(far > 1e-6, apart / np.maximum(far, 1e-6), 0.0)
        after = [slice(None), slice(1, None)] if axis == 1 else [slice(None), slice(None), slice(1, None)]
        found[(*after, ..., 1)] = np.maximum(found[(*after, ..., 1)], ratio)
    return found


def _smoothstep(part: np.ndarray) -> np.ndarray:
    part = np.clip(part, 0.0, 1.0)
    return part * part * (3 - 2 * part)


def _images(grid: Grid) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """The images (mirror, shift) of a brush in the picture's edges, itself first: x -> mirror x + shift.

    With them no push crosses an edge, so that the projection takes nothing of it.
    """
    left, right, top, bottom = grid.at_edge
    across = [(1.0, 0.0)] + [(-1.0, 0.0)] * left + [(-1.0, 2 * grid.picture[0])] * right
    down = [(1.0, 0.0)] + [(-1.0, 0.0)] * top + [(-1.0, 2 * grid.picture[1])] * bottom
    for (mirror_x, shift_x), (mirror_y, shift_y) in product(across, down):
        yield np.array([mirror_x, mirror_y]), np.array([shift_x, shift_y])

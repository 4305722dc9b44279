"""Handles and pins: points of the picture that feedback leads to where they shall be, and holds there.

One long class: all handles are solved for together. What one leads is in `handle.py`, their pushes are in `pushes.py`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from solver.brush.balance import Balance, solved
from solver.brush.brush import Brush
from solver.brush.distance import Distance
from solver.brush.expected import EXPECTED, Expected, HandleState
from solver.brush.handle import Handle, Shape, area, spun, swelling
from solver.brush.listed import draw_listed
from solver.brush.pushes import Pushes
from solver.brush.tip import SMALLEST, Tip
from solver.faces import Forces
from solver.gl.field import Field, FieldPool
from solver.limits import LEAST_STIFFNESS, check_step, check_type
from solver.scheme import Scheme
from solver.state import State
from solver.warp.inverse import ForwardMap
from solver.warp.map import WarpMap
from solver.warp.strain import Strain

RATE = 8.0  # 1 / s: at which what is left of a way is gone
# Radii that a handle goes in a tick at most: its push strains what is beside it by up to 5.4 times as much (H2), and a
# step of the map follows a strain of 1/2.
FARTHEST_STEP = 0.07
# Added to the squares of the influences, which are 1 for a handle by itself: of two that lie on one another nothing
# finite would do both wills. A handle alone gets 1 / (1 + RIDGE) of what it wants in a tick, and the rest in the next.
# The points of a line want what hardly differs, and near an edge, whose image wants the contrary, much of it is lost.
RIDGE, RIDGE_OF_LINES = 1e-3, 1e-4
# Where handles lie beside one another each has a push so many times as wide, too, which counts so much in the squares:
# what they have in common is cheaper by it, and would else flow back between them.
WIDE, WIDE_SHARE = 3.0, 0.2
# Of the map around a handle (`Strain`): det J and areas between texels as a part of what is expected (`Expected`): it
# stays 1 as long as the map resolves the flow; the same as they are, which what is local makes less; and the stretch.
# From the first of each on it goes slower, at the second it stops: before anything folds.
SLOWING, STOPPED = 0.92, 0.8
SLOWING_LOCAL, STOPPED_LOCAL = 0.4, 0.22
STRETCHING, TORN = 8.0, 12.0
# Seconds in which a handle halves the way it has left, or it lets go: with nothing in its way a fiftieth is left then.
HALVED_IN = 4 / RATE
CORE = 0.5  # of the radius of what turns or swells, where it does so evenly
NO_TIME = 1e-38  # seconds: less is none in 32 bits
FOUND = 1e-7  # longer sides, as places are rounded
LOST = 1e-4  # longer sides that are left where a handle's place is not found


class Ring(NamedTuple):
    """Points around one that is turned or scaled, of what is listed.

    Attributes:
        centre: the number of the point.
        rows: those of the ring.
        arms: from the point to them, (n, 2).
        tip: the brush that turns and swells what is under it.
    """

    centre: int
    rows: slice
    arms: np.ndarray
    tip: Tip

    @property
    def length(self) -> float:
        """Of its arms in the mean."""
        return float(np.hypot(*self.arms.T).mean())


class Move(NamedTuple):
    """Where the points of a handle in force are led in a step.

    Attributes:
        number: the handle's.
        here, then: where they are, and shall be a step later, (k, 2) in longer sides.
        is_moving: it is not at rest where it shall be: it is led on, or more than a texel of the map away, unless it
            has let go.
        begins: it sets out, from rest, in this step.
        is_late: where it shall be rests already.
    """

    number: int
    here: np.ndarray
    then: np.ndarray
    is_moving: bool
    begins: bool
    is_late: bool


class Begun(NamedTuple):
    """Where points begin that have not begun yet, found before the step in which they do.

    Attributes:
        leads: of the map that they were found by.
        rows: which of all points they are, (n,).
        places: where they are, (k, 2).
    """

    leads: int
    rows: np.ndarray
    places: np.ndarray


class Targets(NamedTuple):
    """Where the points of active handles are and where they shall be in a step.

    Attributes:
        rows: of each handle, where its points are listed.
        here: where they are, (n, 2).
        now, then: where they shall be now and a step later, (n, 2).
        remaining: how far the farthest point of each handle has to go, (h,).
        is_led: which handles shall not be where they began.
    """

    rows: list[slice]
    here: np.ndarray
    now: np.ndarray
    then: np.ndarray
    remaining: np.ndarray
    is_led: np.ndarray


class Lead(NamedTuple):
    """What the points of active handles do in a step, found before it.

    Attributes:
        places, radii: of all of them, (n, 2) and (n,).
        pushed: the numbers of those that are pushed, p of them.
        pushes: m of them, one at each that is pushed, and some wide ones.
        looked_at: where the fluid is looked at, and how far around: at all points, then at wide pushes, (n + w, 3).
        drawn: of each push its number among these, (m,).
        rings: r of them.
        loops: which of them are closed lines.
        balance: what gives the strengths of pushes and of turns of rings, 2 m + r, for what the pushed and rings lack,
            2 p + r.
        wanted: how the fluid shall move at them all, (n, 2), longer sides / s.
        local: what of their motion carries the picture and not the fluid, (p, 2).
    """

    places: np.ndarray
    radii: np.ndarray
    pushed: np.ndarray
    pushes: Pushes
    looked_at: np.ndarray
    drawn: np.ndarray
    rings: list[Ring]
    loops: list[slice]
    balance: Balance
    wanted: np.ndarray
    local: np.ndarray


class Handles:
    """Leads handles together through a fluid: see *Handles* in README.md.

    Where they are is found in every step by inverting the map, so that no error adds up.

    Args:
        fluid: what they move, on the whole picture; it may go on in a window of it, by `go_on_with`.
        warp: the map of the picture that the fluid carries.
        handles: their number is that in the list, from 0.
    """

    def __init__(self, fluid: Scheme, warp: WarpMap, handles: Iterable[Handle]) -> None:
        check_type("what handles move", fluid, Scheme)
        check_type("what handles look at", warp, WarpMap)
        self._fluid, self._warp, self._forward = fluid, warp, ForwardMap(warp)
        self._cell = max(fluid.grid.spacing)
        self._fields = FieldPool(fluid.device, "handles")
        self._at_rest = fluid.device.field((1, 1), 4, "no motion")
        self._brush, self._strain, self._distance = Brush(fluid.device), Strain(warp), Distance(fluid.device)
        self._expected = Expected(warp)
        # Where the points of those that have begun are, and were then; NaN for the others.
        self._places = self._starts = np.zeros((0, 2))
        self._progress = np.zeros((0, 2))  # of each the least way it has had left, and for how long that is not halved
        self._shapes: list[Shape] = []
        self._counts = np.zeros(0, int)
        self._lead: Lead | None = None  # of the present step
        self._sought: tuple[object, np.ndarray] | None = None  # where they are, and what that was found from
        self.replace(handles)

    def replace(self, handles: Iterable[Handle]) -> None:
        """Go on with other handles; those that have begun keep their number."""
        check_type("what is led", handles, Iterable)
        handles = tuple(handles)
        for handle in handles:
            check_type("a handle", handle, Handle)
        known = {id(shape.handle): shape for shape in self._shapes}
        self.handles, cell = handles, self._cell
        self._shapes = [known.get(id(handle)) or Shape.of(handle, self._warp.extent, cell) for handle in handles]
        before, self._counts = self._counts, np.array([len(shape.led) for shape in self._shapes], int)
        self._rows = _runs(self._counts)
        self._at = np.concatenate([np.zeros((0, 2)), *(shape.led for shape in self._shapes)])
        self._radii, self._local, self._stiffness = (
            np.repeat([getattr(handle, name) for handle in handles], self._counts)
            for name in ("push_radius", "local", "stiffness")
        )
        ridges = np.repeat([RIDGE_OF_LINES if handle.points else RIDGE for handle in handles], self._counts)
        self._soft = 1 / self._stiffness - 1 + ridges
        self._places, self._starts = (self._fitted(kept, before) for kept in (self._places, self._starts))
        self._progress = self._fitted_progress(self._progress)

    def go_on_with(self, fluid: Scheme) -> None:
        """From now on, move another fluid of the same picture: what lies outside its window stays by itself."""
        self._fluid = fluid

    # -- a step -----------------------------------------------------------------------------------------------------

    def advance(self, dt: float, forces: Forces = ()) -> None:
        """Make a step of the fluid, with forces if there are any, and of its map, led by the handles.

        Raises:
            ValueError: as `Scheme.step`.
        """
        self.lead(dt, self._fluid.time)
        self._fluid.step(dt, forces, self.make_up)
        self.carry()
        self.follow(self._fluid, dt)
        self._warp.follow(self._fluid, dt)  # pyright: ignore[reportArgumentType]

    def lead(self, dt: float, time: float, known: Begun | None = None) -> None:
        """Before a step at a time: find where the handles are and shall go, and add what the fluid lacks of that.

        `known`: what `moves` of the same step found.
        """
        if (dt := check_step(dt)) < NO_TIME:
            raise ValueError("to lead a handle takes some time")
        self._lead = None
        begun, in_force = self._in_force(time, dt)
        self._places = self._located()
        if (new := np.repeat(begun, self._counts) & np.isnan(self._starts[:, 0])).any():
            if known is None or known.leads != self._warp.leads or not np.array_equal(known.rows, new):
                known = self._begun(new)
            self._starts[new] = self._places[new] = known.places
        in_force &= self._have_room()
        active, listed = np.flatnonzero(in_force).tolist(), np.flatnonzero(np.repeat(in_force, self._counts))
        if not active:
            return
        radii, counts = self._radii[listed], self._counts[in_force]
        # A software rasteriser draws the strain while the processor finds the pushes: it is read after them.
        strain_read = self._strain.look(self._places[listed], radii, self._expected.field)
        targets = self._targets(active, listed, time, dt)
        rows, places = targets.rows, targets.here
        rings, loops, swelling_tips, pushed = self._areas(active, targets)
        local_parts = self._local[listed][pushed]
        side = min(self._fluid.grid.picture)
        wide = np.maximum(np.minimum(np.minimum(WIDE * radii, side), self._room(places)), radii)
        numbers = np.repeat(np.arange(len(rows)), counts)
        is_led, is_away = targets.is_led[numbers], self._are_away(targets)[numbers]
        beside = _beside(places, radii, numbers, is_led)[pushed]
        near_others = np.flatnonzero(beside)  # of those that are pushed: they have a wide push, too
        drawn = np.concatenate([pushed, pushed[near_others]])
        reaches = np.concatenate([radii[pushed], wide[pushed[near_others]]])
        weights = np.repeat(np.concatenate([np.ones(len(pushed)), WIDE_SHARE * beside[near_others]]), 2)
        pushes = Pushes(self._fluid.grid, places[drawn], reaches)
        push, carried = pushes.influence(places), np.zeros((len(pushed), 2))
        slower = _of_each(
            np.minimum, self._slower(strain_read(), listed), rows
        )  # a whole goes as slowly as its slowest
        slower = np.repeat(slower * self._progressing(active, targets, time, dt), counts)
        wanted, growths = self._wanted(active, slower, targets, dt)
        for which, tip, local in swelling_tips:
            if rate := (1 - local) * growths[which]:
                self._expected.begin()
                self._brush.expand(self._fluid, tip, rate)
        self._calm(places[pushed], np.where(is_led & is_away, wide, radii)[pushed], 1 - slower[pushed])
        # What halts lets go: at rest among others that flow by it would strain the map around it as if it were led.
        firm = np.where(is_led, np.maximum(slower, LEAST_STIFFNESS), 1.0)
        softs = self._soft[listed] + (1 / firm - 1) / self._stiffness[listed]
        soft = np.repeat(softs[pushed], 2)
        others = np.column_stack([places, wide])[pushed[near_others]]
        looked_at = np.concatenate([np.column_stack([places, radii]), others])
        if local_parts.any():  # this is shared out first: the fluid would else do all of it, going on by itself
            # Beside what is thicker, or solid, the fluid does more of it.
            local_parts = local_parts * self._probed(looked_at, self._fluid.faces())[pushed, 2]
            local, part = pushes.local_influence(places)[:, :, : len(pushed)], local_parts[:, None]
            if self._fluid.has_solids:
                distance = self._distance.at(self._fluid, places)
                local *= _smoothstep(distance[:, None] / radii[pushed])[:, None, :, None]
            both = _matrix(((1 - part) * push[:, :, : len(pushed)] + part * local)[pushed])
            carried = part * solved(both, soft, wanted[pushed].ravel()).reshape(-1, 2)
            moved = np.einsum("iajb,jb->ia", local, carried)
            # At odds they drive one another on. No push carries farther than one handle goes, nor do all together: of
            # points that lie on one another they cancel there, and not beside them.
            farthest = np.maximum(np.hypot(*moved[pushed].T), np.hypot(*carried.T))
            over = max(float((farthest / (FARTHEST_STEP * radii[pushed] / dt)).max()), 1.0)
            carried, wanted = carried / over, wanted - moved / over
        centres = [ring.centre for ring in rings]
        soft, weights = np.concatenate([soft, softs[centres]]), np.concatenate([weights, np.ones(len(rings))])
        owners = [np.concatenate([np.repeat(numbers[each], 2), numbers[centres]]) for each in (pushed, drawn)]
        influence, bounds = _with_rings(places, pushed, push, rings), FARTHEST_STEP * np.minimum(reaches, side) / dt
        del push  # of many points it is as large as all that balancing needs
        balance = Balance(influence, soft, weights, (owners[0], owners[1]), bounds, len(pushed))
        self._places[listed] += wanted * dt  # where to look for them
        drawn = np.concatenate([pushed, len(places) + np.arange(len(others))])
        lead = self._lead = Lead(
            places, radii, pushed, pushes, looked_at, drawn, rings, loops, balance, wanted, carried
        )
        self._fluid.impulse.add(lambda faces: self._push(lead, faces, lead.wanted))

    def moves(self, time: float, dt: float) -> tuple[list[Move], Begun | None]:
        """Before a step at a time, of all that are in force in it; and for `lead` what begins, if something does.

        That holds for the map as it leads, also on another window: it would have to be drawn and inverted again there.
        """
        begun, in_force = self._in_force(time, dt)
        if not in_force.any():
            return [], None
        known, places, starts, near = None, self._located(), self._starts.copy(), 1 / max(self._warp.size)
        if (new := np.repeat(begun, self._counts) & np.isnan(starts[:, 0])).any():
            known = self._begun(new)
            starts[new] = places[new] = known.places
        has_ended = any(abs(handle.last - time) <= dt / 2 for handle in self.handles)
        found = list[Move]()
        for number in np.flatnonzero(in_force).tolist():
            shape, rows = self._shapes[number], self._rows[number]
            here, start = places[rows], starts[rows]
            before, now, then = (shape.wanted(start, at, dt) for at in (time - dt, time, time + dt))
            is_led, was_led = (np.abs(one - other).max() > FOUND * dt for one, other in ((then, now), (now, before)))
            waits = self._progress[number, 1] <= HALVED_IN or has_ended
            is_away = waits and float(np.hypot(*(then - here).T).max()) > near
            is_begun = not (was_led and np.isfinite(self._starts[rows]).all())
            found.append(Move(number, here, then, bool(is_led or is_away), bool(is_led and is_begun), not is_led))
        return found, known

    def make_up(self, velocity: Field) -> None:
        """After viscosity, before the projection: add to a velocity on MAC faces what is still lacking.

        For `steer` of `Scheme.step`. Of each push less, in all its places alike, the more of it lies on what is thicker
        than at its middle, or solid.
        """
        if (lead := self._lead) is not None and len(lead.places):
            found = self._probed(lead.looked_at, velocity)
            self._push(lead, velocity, lead.wanted - found[: len(lead.places), :2], found[:, 2])

    def carry(self) -> None:
        """After a step: let what is local carry the picture until the fluid's next one."""
        fluid, lead, self._lead = self._fluid, self._lead, None  # of many points it is large
        if lead is None or not lead.local.any():
            return
        solids: dict[str, Any] = {"distance": self._distance.of(fluid)} if fluid.has_solids else {}
        carry = fluid.device.pass_("brush/handle_carry.frag", **({"SOLIDS": 1} if solids else {}))
        self._expected.begin()
        listed = lead.places[lead.pushed], lead.radii[lead.pushed], lead.local
        fluid.local.add(lambda field: draw_listed(fluid.device, carry, field, fluid.grid, *listed, **solids))

    def follow(self, fluid: Scheme, dt: float) -> None:
        """Before the map follows a fluid for `dt`, whether handles lead or not: expect what that does to areas."""
        self._expected.follow(fluid, dt)

    def forget_map(self) -> None:
        """Expect nothing of a map that has been reset."""
        self._expected.clear()

    # -- what it looks at -------------------------------------------------------------------------------------------

    @property
    def shapes(self) -> list[np.ndarray]:
        """Where the points of each are now, (k, 2) in longer sides, or will begin; looking changes nothing."""
        found = self._located_or_waiting()
        return [found[rows] for rows in self._rows]

    @property
    def places(self) -> np.ndarray:
        """Where they are now, (n, 2) in longer sides, or will begin; looking changes nothing."""
        return self.middles(self.shapes)

    @property
    def starts(self) -> np.ndarray:
        """Where they were when they began, (n, 2) in longer sides; NaN where they have not."""
        found = [shape.middle(self._starts[rows]) for shape, rows in zip(self._shapes, self._rows, strict=True)]
        return np.array(found).reshape(-1, 2)

    def middles(self, shapes: list[np.ndarray]) -> np.ndarray:
        """Where they are, (n, 2), with their points at these places; as `shapes`."""
        starts = [self._starts[rows] for rows in self._rows]
        found = [
            shape.place(here, here if np.isnan(start).any() else start)
            for shape, here, start in zip(self._shapes, shapes, starts, strict=True)
        ]
        return np.array(found).reshape(-1, 2)

    @property
    def away(self) -> np.ndarray:
        """How far what is led by each is from where it shall be in the end, (n,) in longer sides, by the point that is
        farthest; 0 of pins that have not begun.
        """
        return np.array([left for _, left in self.left(math.inf, 1.0)])

    @property
    def halts(self) -> list[str | None]:
        """Why each is not where it is led; None if that is less than a texel of the map away.

        "outside": nothing of it lies in the picture. "waiting": it has not begun. "over": its end has come. "edge": its
        goal is farther than it goes beside the picture's edge. "strain": the map around it slows it down so far
        that it would let go by that alone, or has let go by that. It has let go: "at odds" where another in force
        lies within both reaches, "soft" where it leads with less than all its stiffness, else "alone". "under way":
        its goal is. "late": that rests, and it comes nearer.
        """
        found = list[str | None]()
        if not self._shapes:
            return found
        slower, places = np.ones(len(self._at)), self._located_or_waiting()
        in_window = np.repeat(self._have_room(), self._counts)
        for rows, coarsely in ((in_window, False), (~in_window, True)):
            if rows.any():
                strain = self._strain.around(places[rows], self._radii[rows], self._expected.field, coarsely)
                slower[rows] = self._slower(strain, np.flatnonzero(rows))
        near, time, lefts = 1 / max(self._warp.size), self._fluid.time, self.left(math.inf, 1.0)
        held = np.repeat([handle.end >= time for handle in self.handles], self._counts)
        held &= np.isfinite(self._starts[:, 0])
        for shape, rows, (_, waited), (due, left) in zip(self._shapes, self._rows, self._progress, lefts, strict=True):
            starts = self._starts[rows]
            if not shape.is_in_picture:
                found.append("outside")
            elif np.isnan(starts).any():
                found.append("waiting")
            elif shape.handle.end < time:
                found.append("over")
            elif shape.short_of_edges(starts) > FOUND:
                found.append("edge")
            else:
                pace, least = float(slower[rows].min()), math.log(2) / RATE / HALVED_IN  # (H1): half in that time
                firm = pace if np.abs(due - starts).max() > FOUND else 1.0  # what is led lets go as it goes slower
                if pace < least:
                    found.append("strain")
                elif waited <= HALVED_IN:
                    found.append("under way" if time < shape.handle.last else "late" if left > near else None)
                elif pace * (1 - (1 - firm) ** 2) < least:  # it has its push before the step and once more after it
                    found.append("strain")
                elif _are_near(places, self._radii, rows, held):
                    found.append("at odds")
                else:
                    found.append("soft" if shape.handle.stiffness < 1 else "alone")
        return found

    def left(self, time: float, dt: float) -> list[tuple[np.ndarray, float]]:
        """Where the points of each shall be, (k, 2) in longer sides, and how far it is from there, as `away`; once it
        has gone its first way, and at a time after that.
        """
        if not self._shapes:
            return []
        here, rows = self._located_or_waiting(), self._rows
        starts = np.where(np.isnan(self._starts), here, self._starts)
        dues = [shape.due(starts[each], time, dt) for shape, each in zip(self._shapes, rows, strict=True)]
        left = _farthest(here - np.concatenate(dues), rows).tolist()
        return [
            (due, shape.away(here[each], due) if shape.is_ring else far)
            for shape, each, due, far in zip(self._shapes, rows, dues, left, strict=True)
        ]

    # -- its state --------------------------------------------------------------------------------------------------

    def save(self) -> State:
        """A copy of this moment, which the caller releases."""
        kept = {"places": self._places, "starts": self._starts, "counts": self._counts, "progress": self._progress}
        expected = self._expected.field
        return HandleState.of(self._warp.device, {} if expected is None else {EXPECTED: expected}, **kept)

    def restore(self, state: State) -> None:
        """Go back to a moment, perhaps with other handles than then among those that had not begun.

        Raises:
            ValueError: if it is of none.
        """
        check_type("what to go back to", state, State)
        counts = state.values.get("counts")
        if counts is None or counts.dtype != self._counts.dtype or counts.ndim != 1 or (counts < 1).any():
            raise ValueError("the state of handles is missing")
        for name in ("places", "starts"):
            kept = state.values.get(name)
            if kept is None or kept.dtype != np.float64 or kept.shape != (counts.sum(), 2):
                raise ValueError("the state of handles is missing")
        self._places, self._starts = (self._fitted(state.values[name], counts) for name in ("places", "starts"))
        progress = state.values.get("progress")
        if progress is None or progress.dtype != np.float64 or progress.shape != (len(counts), 2):
            raise ValueError("the state of handles is missing")
        self._progress = self._fitted_progress(progress)
        self._expected.restore(state.fields.get(EXPECTED))
        self._lead = None

    def release(self) -> None:
        """Free the textures."""
        for thing in (
            self._fields,
            self._at_rest,
            self._forward,
            self._brush,
            self._strain,
            self._distance,
            self._expected,
        ):
            thing.release()

    # -- where they are ---------------------------------------------------------------------------------------------

    def _fitted(self, kept: np.ndarray, counts: np.ndarray) -> np.ndarray:
        """What was kept of handles with so many points, for those of now; one that has others has not begun yet."""
        if np.array_equal(counts, self._counts):
            return kept.copy()
        rows = np.full((self._counts.sum(), 2), np.nan)
        parts = np.split(kept, np.cumsum(counts))
        for here, part in zip(self._rows, parts, strict=False):
            if here.stop - here.start == len(part):
                rows[here] = part
        return rows

    def _fitted_progress(self, kept: np.ndarray) -> np.ndarray:
        """What was kept of some handles, for those of now: what is new has not begun yet."""
        found = np.tile([np.inf, 0.0], (len(self.handles), 1))
        found[: len(kept)] = kept[: len(found)]
        return found

    def _in_force(self, time: float, dt: float) -> tuple[np.ndarray, np.ndarray]:
        """Which handles have begun in a step at a time, and which of them lead or hold in it, (h,) each."""
        begun = [each.is_in_picture and each.handle.start <= time + dt / 2 for each in self._shapes]
        held = [time + dt / 2 < handle.end for handle in self.handles]
        return np.array(begun, bool), np.array(begun, bool) & np.array(held, bool)

    def _room(self, places: np.ndarray) -> np.ndarray:
        """How far places (n, 2) are from the sides of the fluid's window within the picture; negative outside."""
        grid = self._fluid.grid
        low, high = places - grid.origin, np.add(grid.origin, grid.extent) - places
        distances = np.stack([low[:, 0], high[:, 0], low[:, 1], high[:, 1]], axis=-1)
        return np.where(grid.at_edge, np.inf, distances).min(axis=1)

    def _have_room(self) -> np.ndarray:
        """The handles, (h,), whose pushes all lie in the fluid's window: nothing else in it is led."""
        if self._fluid.grid.is_whole or not self._shapes:
            return np.ones(len(self._shapes), bool)
        return _of_each(np.minimum, self._room(self._places) - self._radii, self._rows) >= 0

    def _located(self) -> np.ndarray:
        """Where the handles that have begun are: x with x + D(x) = at, by Newton's method from where they should be."""
        given = self._warp.version, *(each.tobytes() for each in (self._places, self._starts, self._at, self._radii))
        if self._sought is None or self._sought[0] != given:
            self._sought = given, self._seek()
        return self._sought[1].copy()

    def _seek(self) -> np.ndarray:
        places, begun = self._places.copy(), np.flatnonzero(~np.isnan(self._starts[:, 0]))
        if not len(begun):
            return places
        wanted = self._at[begun]
        best, least = self._warp.seek(wanted, places[begun], FARTHEST_STEP * self._radii[begun])
        if (lost := least > LOST).any():  # the map has been changed by something else than the flow
            best[lost] = wanted[lost] + self._forward.at(wanted[lost])
        places[begun] = best
        return places

    def _begun(self, rows: np.ndarray) -> Begun:
        """These points (n,), which begin now."""
        return Begun(self._warp.leads, rows, self._where(rows))

    def _where(self, listed: np.ndarray) -> np.ndarray:
        """Where these points (n,) of the original are, (k, 2)."""
        return self._at[listed] + self._forward.at(self._at[listed])

    def _located_or_waiting(self) -> np.ndarray:
        """Where the points of all handles are, or will begin, (n, 2)."""
        found, waiting = self._located(), np.isnan(self._starts[:, 0])
        if waiting.any():
            found[waiting] = self._where(waiting)
        return found

    def _targets(self, active: list[int], listed: np.ndarray, time: float, dt: float) -> Targets:
        """Those of these handles, with the numbers of all their points."""
        rows, starts, here = _runs(self._counts[active]), self._starts[listed], self._places[listed]
        shapes = [self._shapes[number] for number in active]
        now, then = (
            np.concatenate([shape.wanted(starts[each], at, dt) for shape, each in zip(shapes, rows, strict=True)])
            for at in (time, time + dt)
        )
        is_led = _of_each(np.maximum, np.abs(then - starts).max(axis=1), rows) > FOUND
        return Targets(rows, here, now, then, _farthest(then - here, rows), is_led)

    def _areas(
        self, active: list[int], targets: Targets
    ) -> tuple[list[Ring], list[slice], list[tuple[int, Tip, float]], np.ndarray]:
        """Rings and closed lines among these handles, the brushes that swell them, and the points that are pushed.

        Of each brush: whose it is, by its place among these; its tip; the local part of the motion, unswelled.
        """
        places, is_pushed = targets.here, np.ones(len(targets.here), bool)
        rings, loops, swelling_tips = list[Ring](), list[slice](), list[tuple[int, Tip, float]]()
        for which, (number, each) in enumerate(zip(active, targets.rows, strict=True)):
            shape = self._shapes[number]
            if shape.is_ring:
                around = slice(each.start + 1, each.stop)
                tip = _tip(places[each.start], shape.handle.radius)
                rings.append(Ring(each.start, around, places[around] - places[each.start], tip))
                is_pushed[around] = False
                swelling_tips.append((which, tip, 0.0))
            elif shape.around is not None:
                loops.append(each)
                middle = places[each].mean(axis=0)
                tip = _tip(middle, max(float(np.hypot(*(places[each] - middle).T).max()) / CORE, SMALLEST))
                swelling_tips.append((which, tip, shape.handle.local))
        return rings, loops, swelling_tips, np.flatnonzero(is_pushed)

    def _progressing(self, active: list[int], targets: Targets, time: float, dt: float) -> np.ndarray:
        """1 for each of these handles; 0 for what comes no nearer to its goal, as long as that rests."""
        anew = ~self._are_away(targets)
        anew |= _of_each(np.maximum, np.abs(targets.then - targets.now).max(axis=1), targets.rows) > FOUND * dt
        anew |= any(abs(handle.last - time) <= dt / 2 for handle in self.handles)  # it has driven others about till now
        self._progress[np.array(active)[anew]] = np.inf, 0.0
        least, waited = self._progress[active].T
        nearer = targets.remaining < least / 2
        least, waited = np.where(nearer, targets.remaining, least), np.where(nearer, 0.0, waited + dt)
        self._progress[active] = np.stack([least, waited], axis=-1)
        return np.where((waited > HALVED_IN) & self._are_away(targets), 0.0, 1.0)

    def _are_away(self, targets: Targets) -> np.ndarray:
        """True for handles of which the farthest point has more than a texel to go."""
        return targets.remaining > 1 / max(self._warp.size)

    def _wanted(
        self, active: list[int], slower: np.ndarray, targets: Targets, dt: float
    ) -> tuple[np.ndarray, list[float]]:
        """How the points of these handles shall move in this step, longer sides / s, and areas within grow, 1 / s."""
        back, (rows, here, now, then, *_) = -math.expm1(-RATE * dt), targets
        step = slower[:, None] * (then - now + back * (now - here))
        most = FARTHEST_STEP * np.array([self._shapes[number].handle.reach for number in active])
        parts = np.minimum(1.0, most / np.maximum(_farthest(step, rows), 1e-30))
        # The times of a script and of a recipe differ in their last digits, which solving would make more of.
        wanted = (step * np.repeat(parts, self._counts[active])[:, None] / dt).astype(np.float32).astype(np.float64)
        growths = list[float]()
        for number, each, part in zip(active, rows, parts.tolist(), strict=True):
            around, growth = self._shapes[number].around, 0.0
            if around is not None:
                areas = [area(places[each][around:]) for places in (here, now, then)]
                if min(areas) > 0 or max(areas) < 0:
                    growth = math.log(areas[2] / areas[1]) + back * math.log(areas[1] / areas[0])
            growths.append(float(slower[each.start]) * part * growth / dt)
        return wanted, growths

    def slower(self, numbers: np.ndarray) -> np.ndarray:
        """The part of its speed, 0-1, that the map around each of these points still allows."""
        places, radii = self._places[numbers], self._radii[numbers]
        return self._slower(self._strain.around(places, radii, self._expected.field), numbers)

    def _slower(self, strain: np.ndarray, numbers: np.ndarray) -> np.ndarray:
        least, most, area_left, kept = strain.T
        local, left = self._locality(numbers), np.minimum(least, area_left) * self._grown(numbers)
        slowing = SLOWING + local * (SLOWING_LOCAL - SLOWING)
        stopped = STOPPED + local * (STOPPED_LOCAL - STOPPED)
        resolved = _smoothstep((kept - stopped) / (slowing - stopped))
        pressed = _smoothstep((left - STOPPED_LOCAL) / (SLOWING_LOCAL - STOPPED_LOCAL))
        return resolved * pressed * _smoothstep((TORN - most) / (TORN - STRETCHING))

    def _locality(self, numbers: np.ndarray) -> np.ndarray:
        """The least local part of each of these points and of what has begun beside it: all of them drive the fluid."""
        begun = np.flatnonzero(~np.isnan(self._starts[:, 0]))
        beside = np.where(self._meet(numbers, begun), self._local[begun], 1.0)
        return np.minimum(self._local[numbers], beside.min(axis=1, initial=1.0))

    def _grown(self, numbers: np.ndarray) -> np.ndarray:
        """How many times its size in the original what swells beside each of these points shall have; at least 1."""
        grown = np.ones(len(numbers))
        for shape, rows in zip(self._shapes, self._rows, strict=True):
            if shape.around is not None and not np.isnan(starts := self._starts[rows]).any():
                wanted = shape.wanted(starts, self._fluid.time, 1.0)
                due, before = (area(places[shape.around :]) for places in (wanted, shape.led))
                near = self._meet(numbers, np.arange(rows.start, rows.stop)).any(axis=1)
                grown[near] = np.maximum(grown[near], due / before if before else 1.0)
        return grown

    def _meet(self, numbers: np.ndarray, others: np.ndarray) -> np.ndarray:
        """Whether what is within reach of these points (n) and of those (m) overlaps, (n, m)."""
        here, there = self._places[numbers].T, self._places[others].T
        far = np.hypot(here[0][:, None] - there[0], here[1][:, None] - there[1])
        return far < self._radii[numbers, None] + self._radii[others]

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

    def _probed(self, looked_at: np.ndarray, velocity: Field) -> np.ndarray:
        """At places with radii, (n, 3): velocity, the part that a brush may do, viscosity; (n, 4) float64."""
        fluid, device = self._fluid, self._fluid.device
        listed = looked_at - [*fluid.grid.origin, 0.0]
        handles = device.upload(listed[None].astype(np.float32), "handles")
        found = Field(device, handles.size, 4, "fluid at the handles", cleared=False)
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

    def _spin(self, ring: Ring, speed: float, faces: Field) -> None:
        """Add a turn of a ring to a velocity on MAC faces."""
        twirl, vectors = self._fluid.device.pass_("brush/twirl.frag"), [(speed / ring.length, 0.0)]
        ring.tip.draw(twirl, faces, self._fluid.grid, vectors, add=True, motion=self._at_rest, gain=1.0)

    def _push(self, lead: Lead, faces: Field, missing: np.ndarray, parts: np.ndarray | None = None) -> None:
        """Add to a velocity on MAC faces what handles miss there, (n, 2); `parts`: of each push, for all looked at."""
        if not len(lead.places):
            return
        grid, missing = self._fluid.grid, missing.copy()
        for loop in lead.loops:  # the fluid swells by itself: (H4)
            arms = lead.places[loop] - lead.places[loop].mean(axis=0)
            missing[loop] -= swelling(lead.places[loop], missing[loop]) / 2 * arms
        asked = np.concatenate([missing[lead.pushed].ravel(), _spins(missing, lead.rings)])
        of_each = np.concatenate([np.repeat(lead.drawn, 2), [ring.centre for ring in lead.rings]]).astype(int)
        strengths, count = lead.balance.strengths(asked, 1.0 if parts is None else parts[of_each]), 2 * len(lead.drawn)
        forces, spins = strengths[:count].reshape(-1, 2), strengths[count:]
        for ring, spin in zip(lead.rings, spins.tolist(), strict=True):
            self._spin(ring, spin, faces)
        psi = self._fields.get("stream function", (grid.nx + 1, grid.ny + 1), 1)
        psi.clear()
        stream = self._fluid.device.pass_("brush/handle_stream.frag")
        lead.pushes.draw(self._fluid.device, stream, psi, forces)
        self._fluid.device.pass_("brush/curl.frag")(faces, add=True, stream=psi, spacing=grid.spacing)


def _beside(places: np.ndarray, radii: np.ndarray, handles: np.ndarray, led: np.ndarray) -> np.ndarray:
    """How much of others led too lies within reach, 0-1: 1 - product of 1 - (1 - q^2)^3, q in sums of radii."""
    x, y = places.T
    far = np.hypot(x[:, None] - x, y[:, None] - y) / (radii[:, None] + radii)
    near = np.maximum(1 - far**2, 0.0) ** 3 * (handles[:, None] != handles) * (led[:, None] & led)
    return 1 - (1 - near).prod(axis=1)


def _are_near(places: np.ndarray, radii: np.ndarray, rows: slice, held: np.ndarray) -> bool:
    """True if of what is held others lie within reach of what is in these rows, as `_beside`."""
    others = held.copy()
    others[rows] = False
    x, y = np.moveaxis(places[rows][:, None] - places[others], -1, 0)
    return bool((np.hypot(x, y) < radii[rows][:, None] + radii[others]).any())


def _matrix(influence: np.ndarray) -> np.ndarray:
    """Velocities (i, a) for forces (j, b) as a matrix."""
    return influence.reshape(2 * len(influence), -1)


def _spins(motion: np.ndarray, rings: list[Ring]) -> np.ndarray:
    """How fast rings turn where their points, and those within, move so: longer sides / s at their arms' ends."""
    return np.array([float(spun(motion[ring.rows] - motion[ring.centre], ring.arms)) for ring in rings])


def _with_rings(places: np.ndarray, pushed: np.ndarray, push: np.ndarray, rings: list[Ring]) -> np.ndarray:
    """The matrix of what pushes do to what is pushed, with what they do to rings, and turns of rings to all."""
    if not rings:
        return _matrix(push[pushed])
    rows, columns = 2 * len(pushed), 2 * push.shape[2]
    found = np.empty((rows + len(rings), columns + len(rings)))
    for row, number in enumerate(pushed):  # of many points it is large, and is copied but once
        found[2 * row : 2 * row + 2, :columns] = push[number].reshape(2, columns)
    for row, ring in enumerate(rings, rows):
        across = np.moveaxis(push[ring.rows] - push[ring.centre], (0, 1), (2, 3))
        found[row, :columns] = spun(across, ring.arms).ravel()
    for column, ring in enumerate(rings, columns):
        turned = _turned(places, ring)
        found[:rows, column], found[rows:, column] = turned[pushed].ravel(), _spins(turned, rings)
    return found


def _turned(places: np.ndarray, ring: Ring) -> np.ndarray:
    """The motion at places, (n, 2), where a ring turns by 1 longer side / s at its arms' ends."""
    r = places - ring.tip.end
    q = np.clip((np.hypot(*r.T) / ring.tip.radius - CORE) / (1 - CORE), 0.0, 1.0)
    return ((1 - q**2) ** 3 / ring.length)[:, None] * np.stack([-r[:, 1], r[:, 0]], axis=-1)


def _tip(place: np.ndarray, radius: float) -> Tip:
    """A brush that is hard as far as its core."""
    at = float(place[0]), float(place[1])
    return Tip(at, at, radius, CORE / 0.9)


def _runs(counts: np.ndarray) -> list[slice]:
    """Where each lies in a list of so many of each."""
    return [slice(first, last) for first, last in pairwise([0, *np.cumsum(counts).tolist()])]


def _of_each(extreme: np.ufunc, values: np.ndarray, rows: list[slice]) -> np.ndarray:
    """The largest or least of the values (n,) in each of these rows, of which there is one at least."""
    return extreme.reduceat(values, [each.start for each in rows])


def _farthest(ways: np.ndarray, rows: list[slice]) -> np.ndarray:
    """How long the longest of ways (n, 2) in each of these rows is."""
    return _of_each(np.maximum, np.hypot(*ways.T), rows)


def _smoothstep(part: np.ndarray) -> np.ndarray:
    part = np.clip(part, 0.0, 1.0)
    return part * part * (3 - 2 * part)

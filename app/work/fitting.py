"""Fitting: handles that bring points to where they should be with the least work, found by replays of a recipe.

Long, as what is searched, what is tried and what is told of it share the numbering of the pairs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from app.errors import Cancelled, UserError
from app.media.auxiliary import Pictures
from app.media.clip import Clip
from app.media.landmarks import Pairs
from app.media.losses import few
from app.media.opening import check_picture
from app.model.handles import (
    ARRIVED,
    LARGEST_LEAD,
    LEAST_SCALE,
    MOST_HANDLES,
    MOST_SCALE,
    MOST_TURNED,
    RecipeHandle,
    in_pixels,
    labelled,
    objections,
)
from app.model.picture import Picture
from app.model.recipe import UNNAMED, Recipe
from app.model.sampling import Point
from app.model.schema import label_of
from app.model.timeline import Sentinel
from app.model.windows import with_detail
from app.progress import Progress
from app.work.loaded_handles import LoadedHandles
from app.work.observation import observe
from app.work.replay import Replay
from solver.brush.handle import Shape
from solver.components import connected_components
from solver.gl.device import Device
from solver.warp.inverse import ForwardMap

EVALUATIONS = 32  # replays on the coarse grid
A_FINE_ONE = 8  # of them for each on the recipe's own
COARSE_GRID, COARSE_PICTURE, COARSE_DT = 64, 512, 1 / 30
ALONE = 12  # pairs up to which each handle has values of its own: with more, all change alike
LEAST_DET = 0.2  # of the map, anywhere
# What is searched, from and to: radii in longer sides, stiffnesses, durations in parts of the recipe's, viscosities.
RANGES = (0.06, 0.5), (0.05, 1.0), (0.3, 0.9), (3e-4, 0.3)
DURATION = 1.0, 2.0  # seconds, from and to, for a recipe's own handles: a hand leads one after the other
DECIMALS = 8  # of places: those in a file of pairs are no more exact, and the same are to give the same
NAME = "pair"  # and a number: what the handle that is made for a pair is called
SAME = 1e-6  # longer sides that two places are apart at which they are the same: the editor's have as many digits
HALVINGS = 4  # of the way, where nothing else keeps it from folding


@dataclass(frozen=True)
class Trial:
    """What came of a replay.

    Attributes:
        recipe: that was played.
        arrived: where the pairs' points are in the end, (n, 2) in fractions; NaN of those without a handle.
        errors: how far what is led by each is from where it should be, by the point of it that is farthest, (n,) in
            longer sides; NaN likewise.
        residuals: the same of those that can be met, of places outside the picture from its edge.
        work: the length of the way, the integral over time of the root mean square of grad u; how fast it is gone makes
            no difference. Landmarks are matched by flows along the shortest one (Joshi and Miller, 2000).
        det: the least det J of the map.
        folds: places where it is not positive.
        verdict: which condition of the recipe's own [stop] ended it and when, or None.
    """

    recipe: Recipe
    arrived: np.ndarray
    errors: np.ndarray
    residuals: np.ndarray
    work: float
    det: float
    folds: int
    verdict: str | None = None

    @property
    def excess(self) -> float:
        """How far all pairs together are beyond `ARRIVED`, longer sides."""
        return float(np.maximum(self.residuals - ARRIVED, 0).sum())

    @property
    def rank(self) -> tuple[float, ...]:
        """What is smaller of the better trial: folds first, then the residuals, then the work."""
        short = max(LEAST_DET - self.det, 0.0)
        return short if self.folds else 0.0, self.excess, short, self.work


@dataclass(frozen=True)
class Fitted:
    """A recipe that has been fitted, and how well.

    Attributes:
        trial: the best, on the recipe's own grid.
        pairs: where each point is and where it arrives; those without a handle are left out.
        errors: the trial's, in pixels.
        stopped: the search was ended before its budget.
        is_met: all arrive, within `ARRIVED`, and nothing folds.
        notices: what the user should hear of.
        noun: what has been fitted: "pair" or "handle".
    """

    trial: Trial
    pairs: Pairs
    errors: np.ndarray
    stopped: bool
    is_met: bool
    notices: tuple[str, ...]
    noun: str = NAME

    @property
    def told(self) -> str:
        """The result in a line."""
        errors, trial = self.errors[np.isfinite(self.errors)], self.trial
        several = "s" * (len(errors) != 1)
        if trial.folds:
            shape = f"{trial.folds} place{' folds' if trial.folds == 1 else 's fold'}"
        else:
            shape = f"nothing folds, and the picture grows to {1 / trial.det:.3g} times its area at most"
        met = f"mean error {in_pixels(errors.mean())} pixels, most {in_pixels(errors.max())}"
        return f"{len(errors)} {self.noun}{several}, {met}; {shape}"


@dataclass(frozen=True)
class Fit:
    """A recipe with a handle for each pair, its values searched for the least work that reaches them without a fold.

    By COBYQA (Ragonneau and Zhang), a trust-region method without derivatives for bounds and constraints: on a coarse
    grid first with all handles alike, then the radius of each, then the duration of each; and with all alike again on
    the recipe's own. Many handles stay alike: for so many replays that is found better.
    What is told of the best so far, and returned, has been played on the recipe's own grid: where handles are in each
    other's way they halt elsewhere on a coarse one. The start is, and what each part of the search has found.
    Handles of an earlier fit are replaced. A budget ends it and no clock, so that the same is found again. If
    the progress says to stop, what was found since is played there too, and the best is returned.

    Attributes:
        folder: where the names of the recipe's other pictures start from.
        pairs: None are those of the recipe's own handles, which are replaced, and keep their numbers.
        evaluations: replays on the coarse grid.
        local: of all handles; None is 1 where there are curves, 0 of points, and the recipe's own keep theirs.
        clip: the one that the picture is the first frame of.
        source: what the recipe is called.
    """

    recipe: Recipe
    picture: Picture
    folder: Path
    pairs: Pairs | None = None
    evaluations: int = EVALUATIONS
    local: float | None = None
    clip: Clip | None = None
    source: str = UNNAMED

    @property
    def label(self) -> str:
        """What the user calls it."""
        return "the fit"

    def perform(self, device: Device, progress: Progress) -> Fitted:
        """Do it.

        Raises:
            UserError: if no pair lies in the picture, or there are too many.
            Cancelled: if it is stopped before anything has been found.
        """
        check_picture(self.picture)
        pictures = Pictures(self.picture, self.folder, self.clip, self.source)
        aim = _aimed(device, self.recipe, pictures, self.pairs, progress)
        if self.local is not None:
            leads = (replace(lead, handle=lead.handle.model_copy(update={"local": self.local})) for lead in aim.leads)
            aim = replace(aim, leads=tuple(leads))
        search = _Search(device, aim, pictures, progress)
        fine, count = max(self.evaluations // A_FINE_ONE, 1), len(search.numbers)
        alike, each = _directions(count), np.eye(3 * count + 1)
        parts = [(alike, 0.25), (each[:, :count], 0.15), (each[:, 2 * count : -1], 0.15)][: 3 if count <= ALONE else 1]
        progress.total = self.evaluations + search.fine.cost * (fine + len(parts))
        stopped = False
        try:
            for start in search.starts:  # soon there is something to stop with
                search.trial(search.coarse, start)
            search.trial(search.fine, search.coarse.best)
            for number, (directions, reach) in enumerate(parts):
                left = self.evaluations - search.coarse.replays
                search.run(search.coarse, search.coarse.best, directions, reach, left // (len(parts) - number))
                search.trial(search.fine, search.coarse.best)
            search.run(search.fine, search.fine.best, alike, 0.05, fine)
        except Cancelled:
            if search.coarse.found is None:
                raise
            stopped = True
        return search.ended(stopped)


@dataclass(frozen=True)
class _Lead:
    """What a handle is to bring about, whatever its values; places are in longer sides.

    What is seen when a handle is set is what it shall move and keep: a line its outline as it lies on the picture then,
    not as it lies in the original; a point how it is turned and how large it is then. Where a fit lets it begin at
    another time, or after other things, it leads what it holds from where that lies then to the same ends.

    `shape`: of the handle as it is asked; `begins`, `ends`: where the points of that are when it begins, and shall be
    in the end, also outside the picture, (k, 2); `there`: where it is itself then, (2,); `until`: seconds when its way
    has to be over, since something is done there that comes after it.
    """

    handle: RecipeHandle
    shape: Shape
    begins: np.ndarray
    ends: np.ndarray
    there: np.ndarray
    until: float = inf

    @classmethod
    def of(cls, handle: RecipeHandle, shape: Shape, begins: np.ndarray, starts: np.ndarray, until: float) -> _Lead:
        """One that was set where its points were at `starts`."""
        there = np.multiply(handle.goal, shape.extent) if handle.goal else shape.middle(starts)
        return cls(handle, shape, begins, shape.laid(there, starts, inf), there, until)

    def off(self, places: np.ndarray) -> tuple[float, float]:
        """How far its points are, by the farthest, from where they should be; and from where they can be."""
        inside = np.clip(self.ends, 0.0, self.shape.extent)
        return self.shape.away(places, self.ends), self.shape.away(places, inside)

    @property
    def goes(self) -> bool:
        """False if all of it stays where it is in the original."""
        return self.handle.turns or float(np.hypot(*(self.ends - self.shape.led).T).max()) > ARRIVED

    @property
    def bends(self) -> bool:
        """True if it is a line that does not keep its shape."""
        return bool(self.course(1.0)["goals"])

    @property
    def way(self) -> float:
        """How far the farthest of its points goes."""
        return float(np.hypot(*(self.ends - self.begins).T).max())

    def course(self, part: float) -> dict[str, Any]:
        """The keys of a handle that goes a part of this way."""
        handle, (angle, scale), extent = self.handle, self._turn, self.shape.extent
        turn = {"rotate": angle * part, "scale": scale**part}
        given = {"keys": None, "turned": (), "goals": (), "end": None} | (turn if handle.turns else {})
        if not handle.points:
            return given
        if handle.goals and handle.to and not handle.turned and self._is_unmoved and part == 1:
            shift = self.there / extent - handle.to
            goals = np.round(handle.goals + shift, DECIMALS).tolist()
            return given | {"goals": tuple((x, y) for x, y in goals)}
        swung, led = scale * np.exp(1j * np.radians(angle)), self.shape.led
        rigid = self.there + _vectors(swung * _complex(led - self.shape.middle(led)))
        if np.abs(rigid - self.ends).max() <= SAME:
            return given
        begin = self.shape.middle(self.begins)
        arms = (1 - part) * _complex(self.begins - begin) + part / swung * _complex(self.ends - self.there)
        swung_so_far = scale**part * np.exp(1j * part * np.radians(angle))
        points, goals = self._line(begin + part * (self.there - begin) + _vectors(swung_so_far * arms))
        return given | {"points": points, "goals": goals} | turn

    @property
    def _is_unmoved(self) -> bool:
        """True if its points lie where they do in the original when it begins."""
        return bool(np.abs(self.begins - self.shape.led).max() <= SAME)

    @property
    def _turn(self) -> tuple[float, float]:
        """Degrees that it is turned on its way, and times that it is made as large."""
        handle = self.handle
        angle, scale = handle.turned[-1][1:] if handle.turned else (handle.rotate or 0.0, handle.scale or 1.0)
        if len(self.begins) == 1 or self._is_unmoved:
            return angle, scale
        arms, ends = (
            _complex(each - (each[0] if self.shape.is_ring else each.mean(axis=0))) for each in (self.begins, self.ends)
        )
        swung = np.vdot(arms, ends) / np.vdot(arms, arms).real
        found = float(np.degrees(np.angle(swung)))
        found += 360 * round((angle - found) / 360)
        grown = self.shape.grown(self.begins, self.ends) if self.shape.is_ring else abs(swung)
        return (
            _rounded(float(np.clip(found, -MOST_TURNED, MOST_TURNED))),
            _rounded(float(np.clip(grown, LEAST_SCALE, MOST_SCALE))),
        )

    def _line(self, ends: np.ndarray) -> tuple[tuple[Point, ...], tuple[Point, ...]]:
        """Corners of its line and the points of it that are led, and where all shall be if these end so; fractions."""
        handle, extent, corners = self.handle, self.shape.extent, self.handle.points
        line, stations = np.multiply([*corners, corners[0]], extent), self.shape.handle.stations
        numbers = np.union1d(np.arange(len(corners)), stations)

        def along(numbers: np.ndarray) -> np.ndarray:
            return np.stack([np.interp(numbers, np.arange(len(line)), side) for side in line.T], axis=-1)

        led = along(stations)
        inside = stations[((led >= 0) & (led <= extent)).all(axis=1)]
        period = len(corners) if handle.closed else None
        moved = [np.interp(numbers, inside, side, period=period) for side in (ends - self.shape.led).T]
        points = along(numbers)
        places = (np.round(each / extent, DECIMALS).tolist() for each in (points, points + np.stack(moved, axis=-1)))
        points, goals = (tuple((x, y) for x, y in each) for each in places)
        return points, goals


def _complex(vectors: np.ndarray) -> np.ndarray:
    """Vectors (n, 2) as complex numbers, whose angles are clockwise."""
    return vectors @ np.array([1, 1j])


def _vectors(numbers: np.ndarray) -> np.ndarray:
    return np.stack([np.real(numbers), np.imag(numbers)], axis=-1)


@dataclass(frozen=True)
class _Aim:
    """What is fitted: a recipe, and what becomes of each pair, but for what is searched.

    `names`: what messages call each pair. `begins`: where each handle's point is when it begins, (n, 2) in fractions.
    `own`: of the recipe's handles the numbers of those that are fitted, from 0; others come after all.
    """

    recipe: Recipe
    pairs: Pairs
    names: tuple[str, ...]
    leads: tuple[_Lead, ...]
    begins: np.ndarray
    own: tuple[int, ...] = ()


def _aimed(device: Device, recipe: Recipe, pictures: Pictures, pairs: Pairs | None, progress: Progress) -> _Aim:
    """What is fitted to given pairs, or, None, to those of the recipe's own handles."""
    picture = pictures.source
    extent = picture.width / max(picture.width, picture.height), picture.height / max(picture.width, picture.height)
    if pairs is not None:
        kept, start = tuple(each for each in recipe.handle if not _is_fitted(each)), _anew(recipe)
        base = recipe.edited(handle=kept, stop=recipe.stop)  # which goes on to wait for those that come
        if start:
            base = base.edited(duration=max(base.duration, start + DURATION[0]))
        # What is local carries a curve's points between its handles along: a fluid flows back there. And all do, since
        # those that push as a fluid does halt where what is local has pressed the picture together.
        one = RecipeHandle(at=(0.5, 0.5), keys=(), start=start, local=1.0 if any(pairs.curves) else 0.0)
        names = tuple(f"{NAME} {number}" for number in range(1, len(pairs.places) + 1))
        pairs, leads = pairs._replace(places=np.round(pairs.places, DECIMALS)), list[_Lead]()
        for name, (at, to) in zip(names, pairs.places.tolist(), strict=True):
            x, y = np.clip(at, -10.0, 10.0).tolist()  # as far as a recipe goes: what is outside is left out
            handle = one.model_copy(update={"name": name, "at": (x, y), "to": tuple(to)})
            (shape,) = _shapes([handle], extent)
            leads.append(_Lead.of(handle, shape, shape.led, shape.led, inf))
        return _Aim(base, pairs, names, tuple(leads), pairs.places[:, 0])
    timed = _has_times(recipe)
    if not timed:  # all go at once: what is pinned later than that goes to where it was pinned
        pins = tuple(pin for pin in recipe.pin if pin.start <= 0 or pin.muted)
        late = [RecipeHandle.model_validate(pin.model_dump() | {"keys": ()}) for pin in recipe.pin if pin not in pins]
        recipe = recipe.edited(handle=(*recipe.handle, *late), pin=pins)
    leads, names, places, begins, own, kept = [], [], [], [], [], list(recipe.handle)
    shapes = _shapes(recipe.handle, extent)
    at_once, starts = _starts(device, recipe, pictures, shapes, progress)
    for number, (handle, shape) in enumerate(zip(recipe.handle, shapes, strict=True)):
        if handle.muted or recipe.lets_go(handle):
            continue
        start = starts[number]
        begin, until = (start, _until(handle, recipe)) if timed else (at_once[number], inf)
        lead = _Lead.of(handle if timed else handle.model_copy(update={"start": 0.0}), shape, begin, start, until)
        if lead.goes:
            leads.append(lead)
            own.append(number)
            names.append(label_of(handle.kind, number + 1, handle.name))
            begins.append(shape.middle(begin) / extent)
            places.append((np.round(handle.at, DECIMALS), np.round(lead.there / extent, DECIMALS)))
        else:
            times = {} if timed else {"start": 0.0, "end": None}
            kept[number] = handle.model_copy(update={"to": None, "keys": (), "goals": (), **times})
    if not leads:
        raise UserError(
            "no handle of the recipe leads anywhere; give --pairs, or [[handle]]s with a place to go to, which they "
            "hold to its end",
            in_window="There is nothing to fit: no handle leads anywhere, and holds it to the end.",
        )
    base = recipe.edited(handle=tuple(kept))
    if not timed:
        # [time] may show a part of it alone, which would lie behind its end.
        shows_part = base.time.start or base.time.end or base.time.dissolve
        most = inf if shows_part else DURATION[1]
        base = base.edited(duration=min(max(base.duration, DURATION[0]), most))
    return _Aim(base, Pairs.points(np.array(places)), tuple(names), tuple(leads), np.array(begins), tuple(own))


def _shapes(handles: Sequence[RecipeHandle], extent: Point) -> list[Shape]:
    """What handles lead, as the solver has it."""
    return [Shape.of(handle, extent) for handle in LoadedHandles(extent).of(handles)]


def _has_times(recipe: Recipe) -> bool:
    """True if something in it has its time: what is led after it, or beside it, is fitted there."""
    lets_go = any(recipe.lets_go(led) for led in (*recipe.handle, *recipe.pin))
    return bool(recipe.stroke or recipe.change or recipe.mask or recipe.force or lets_go)


def _flows(recipe: Recipe) -> bool:
    """True if something but handles moves the fluid, or sets it: another viscosity would make that another one."""
    return bool(recipe.stroke or recipe.change or recipe.force)


def _anew(recipe: Recipe) -> float:
    """The seconds from which on what is led stays: when the warp is reset for the last time, or else 0."""
    return max((change.tick for change in recipe.change if change.reset_warp), default=0) * recipe.fluid.dt


def _until(handle: RecipeHandle, recipe: Recipe) -> float:
    """The seconds when what comes after a handle's way begins; that was done where the handle had left the picture."""
    dt = recipe.fluid.dt
    ticks = [one.first_tick for one in recipe.stroke if not one.muted]
    ticks += [one.tick for one in (*recipe.change, *recipe.mask)]
    ticks += [led.first_tick(dt) for led in (*recipe.handle, *recipe.pin) if not led.muted]
    return min((tick * dt for tick in ticks if tick * dt >= max(handle.last, handle.start + dt) - dt / 2), default=inf)


def _starts(
    device: Device, recipe: Recipe, pictures: Pictures, shapes: list[Shape], progress: Progress
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Where the points of a recipe's handles are at first, and when they begin: (k, 2) each, in longer sides."""
    places = [shape.led for shape in shapes]
    first, starts = list(places), list(places)
    ticks = [handle.first_tick(recipe.fluid.dt) for handle in recipe.handle if handle.takes_hold]
    if not ticks or (max(ticks) <= recipe.begins and recipe.map is None):
        return first, starts
    replay = Replay(device, recipe, pictures, budget=0)
    try:
        now, end = replay.handles.shapes, min(max(ticks) + 1, recipe.ticks)
        while replay.tick < end:
            progress.enter(f"looking where the handles were set, {100 * replay.tick // end} %")
            replay.advance()
        moment = replay.handles.save()
        saved = moment.values
        moment.release()
    finally:
        replay.release()
    labels = [label for label, _ in labelled(recipe.handle, ())]
    then = np.split(saved["starts"], np.cumsum(saved["counts"])[:-1])
    for (label, _), here, begun in zip(replay.led, now, then, strict=True):
        if label in labels:
            number = labels.index(label)
            first[number] = here
            starts[number] = here if np.isnan(begun).any() else begun
    return first, starts


def _directions(count: int) -> np.ndarray:
    """The directions in which all handles change alike, (3 count + 1, 4): radii, stiffnesses, durations, viscosity."""
    kinds = np.repeat(np.arange(4), [count, count, count, 1])
    return (kinds[:, None] == np.arange(4)).astype(float)


@dataclass
class _Stage:
    """A grid that a recipe is played on, with these pictures; the recipe is without what is fitted.

    `cost`: of a replay, in those on a coarse grid. `found`: the best trial so far, and its point; `replays`: made.
    """

    recipe: Recipe
    pictures: Pictures
    cost: int = 1
    found: tuple[np.ndarray, Trial] | None = None
    replays: int = 0

    @property
    def best(self) -> np.ndarray:
        """The point of the best trial."""
        assert self.found is not None
        return self.found[0]


class _Search:
    """Points of the unit cube made into recipes, played and ranked."""

    def __init__(self, device: Device, aim: _Aim, pictures: Pictures, progress: Progress) -> None:
        self.device, self.aim, self.progress = device, aim, progress
        pairs, base = aim.pairs.places, aim.recipe
        self.pairs, self.noun = pairs, RecipeHandle.kind if aim.own else NAME
        picture = pictures.source
        self.longer = max(picture.width, picture.height)
        self.extent = np.array([picture.width, picture.height]) / self.longer
        self.notices: list[str] = []
        self.numbers = self._usable(base)
        self.fine = _Stage(base, pictures, A_FINE_ONE)
        self._caught: list[tuple[list[int], str, str]] = []  # what cannot be met, and why, of one and of more
        self.hopeful = self._reachable()
        stride = -(-self.longer // COARSE_PICTURE)
        small = replace(picture, pixels=np.ascontiguousarray(picture.pixels[::stride, ::stride]))
        coarse = _Stage(_coarse(base), Pictures(small, pictures.folder, pictures.clip, pictures.label))
        if stride == 1 and coarse.recipe == base:
            self.fine = coarse
        self.coarse = coarse
        self._tried: dict[tuple[bool, bytes], Trial] = {}
        leads, own = [aim.leads[number] for number in self.numbers], max(base.fluid.viscosity, 1e-6)
        ways = np.array([lead.way for lead in leads])
        # Of what is turned about a point, the reach says how much is: that is asked too.
        rings = np.array([lead.handle.radius if lead.shape.is_ring else 0.0 for lead in leads])
        least = np.maximum(np.clip(1.01 * ways / LARGEST_LEAD, RANGES[0][0], 1.0), rings)

        def listed(radii: np.ndarray, stiffness: float, duration: float, mu: float) -> np.ndarray:
            return np.log([*radii, *[stiffness] * len(ways), *[duration] * len(ways), mu])

        (_, widest), *ranges = RANGES
        low, high = zip(*ranges, strict=True)
        self.low = listed(least, low[0], low[1], min(low[2], own))
        # And a line that is bent has as many points that are told where they shall be.
        bent = np.array([min(lead.shape.handle.reach, 1.0) if lead.bends else widest for lead in leads])
        self.high = listed(np.where(rings, least, np.maximum(least, bent)), high[0], high[1], max(high[2], own))
        if _flows(base):
            self.low[-1] = self.high[-1] = np.log(own)
        self.is_free = self.high > self.low
        self.fixed = [*least.tolist(), *np.exp(self.low[len(ways) : -1]).tolist(), base.fluid.viscosity]
        # Wide ones reach farther than they go; those of the recipe's own handles may have been better for the picture.
        radii = [np.maximum(1.5 * ways, 0.25), *([np.array([lead.handle.radius for lead in leads])] if aim.own else ())]
        span = np.where(self.is_free, self.high - self.low, 1.0)
        starts = [np.where(self.is_free, (listed(each, 1.0, 0.8, own) - self.low) / span, 0) for each in radii]
        self.starts = [np.clip(start, 0, 1) for start in starts]

    def run(self, stage: _Stage, origin: np.ndarray, groups: np.ndarray, reach: float, budget: int) -> None:
        """Search from `origin` along `groups`: with `budget` replays, at first `reach` of the cube apart."""
        from scipy.optimize import NonlinearConstraint, minimize

        if budget <= 1:
            return

        def trial(step: np.ndarray) -> Trial:
            return self.trial(stage, np.clip(origin + groups @ step, 0, 1))

        def constraints(step: np.ndarray) -> np.ndarray:
            found = trial(step)
            return np.array([-found.excess / ARRIVED, (found.det - LEAST_DET) / LEAST_DET])

        groups = groups * self.is_free[:, None]
        # What has no room on either side does not move: one at 0 and one at 1 that change alike.
        moves = [group.any() and origin[group > 0].min() > origin[group > 0].max() - 1 for group in groups.T]
        groups = groups[:, moves]
        if not groups.size:
            return
        inside = [origin[group > 0] for group in groups.T]
        minimize(
            lambda step: trial(step).work,
            np.zeros(groups.shape[1]),
            method="COBYQA",
            bounds=[(-part.min(), 1 - part.max()) for part in inside],
            constraints=NonlinearConstraint(constraints, 0, np.inf),
            options={"maxfev": budget, "initial_tr_radius": reach, "final_tr_radius": 1e-3},
        )

    def ended(self, stopped: bool) -> Fitted:
        """The result: the best on the recipe's own grid, and less of the way where that folds."""
        if stopped:
            self.progress = Progress()
            self.trial(self.fine, self.coarse.best)
        assert self.fine.found is not None
        point, trial = self.fine.found
        part = 1.0
        while trial.folds and part > 0:
            part = part / 2 if part > 0.5**HALVINGS else 0.0
            trial = self._played(self.fine, self._recipe(self.fine.recipe, point, part), Progress())
        if part < 1:
            self.notices.append(f"the {self.noun}s go only {part:g} of their ways: farther, the picture folds")
        if trial.folds:
            self.notices.append("the picture folds even so: the recipe itself folds it")
        errors = trial.errors * self.longer
        missed = [number for number in self.numbers if not trial.errors[number] <= ARRIVED]
        self._note_missed(missed, errors)
        self._explain(trial.recipe, bool(missed))
        if missed and trial.verdict is not None:
            self.notices.append(trial.verdict)
        arrived = np.stack([self.pairs[:, 0], trial.arrived], axis=1)[self.numbers]
        curves = tuple(self.aim.pairs.curves[number] for number in self.numbers)
        pairs = self.aim.pairs._replace(places=arrived, curves=curves)
        is_met = not (missed or trial.folds) and len(self.numbers) == len(self.pairs)
        return Fitted(trial, pairs, errors, stopped, is_met, tuple(self.notices), self.noun)

    def trial(self, stage: _Stage, point: np.ndarray) -> Trial:
        """What comes of a point of the cube on a grid."""
        if (key := (stage is self.fine, point.tobytes())) in self._tried:
            return self._tried[key]
        trial = self._tried[key] = self._played(stage, self._recipe(stage.recipe, point), self.progress)
        stage.replays += 1
        if stage.found is None or trial.rank < stage.found[1].rank:
            stage.found = point, trial
        if self.fine.found is not None:
            best = self.fine.found[1]
            off = f"{np.nanmean(best.errors) * self.longer:.2f} px off" + ", and folds" * (best.folds > 0)
            self.progress.enter(f"best so far {off}, work {best.work:.3f}")
        self.progress.advance(stage.cost)
        return trial

    def _recipe(self, base: Recipe, point: np.ndarray, part: float = 1.0) -> Recipe:
        """The recipe that a point of the cube stands for, its handles led a part of their ways."""
        searched = np.exp(self.low + point * (self.high - self.low)).tolist()
        values = [
            _rounded(value) if is_free else fixed
            for value, is_free, fixed in zip(searched, self.is_free, self.fixed, strict=True)
        ]
        count, handles = len(self.numbers), dict(enumerate(base.handle))
        for row, number in enumerate(self.numbers):
            (at, end), lead = self.pairs[number], self.aim.leads[number]
            to = self.aim.begins[number] + part * (np.clip(end, 0, 1) - self.aim.begins[number])
            values_of = {
                "at": (float(at[0]), float(at[1])),
                "to": (float(to[0]), float(to[1])),
                "radius": values[row],
                "stiffness": min(values[count + row], 1.0),
                "duration": _rounded(
                    values[2 * count + row] * max(min(base.duration, lead.until) - lead.handle.start, 0.0)
                ),
            }
            handles[self._slots[row]] = lead.handle.model_copy(update=lead.course(part) | values_of)
        fluid = base.fluid.model_copy(update={"viscosity": values[-1]})
        recipe = base.edited(handle=tuple(handles.values()), fluid=fluid)
        if base is not self.fine.recipe:  # where windows would cost what the coarse grid saves
            return recipe
        extent = self.extent[0], self.extent[1]
        for slot in self._slots:
            if not self.aim.own or handles[slot].detail:
                handles[slot] = with_detail(handles[slot], recipe, extent)
        return recipe.edited(handle=tuple(handles.values()))

    @property
    def _slots(self) -> list[int]:
        """The number that the handle of each pair that has one has in the recipe, from 0."""
        own, first = self.aim.own, len(self.aim.recipe.handle)
        return [own[number] if own else first + row for row, number in enumerate(self.numbers)]

    def _played(self, stage: _Stage, recipe: Recipe, progress: Progress) -> Trial:
        replay = Replay(self.device, recipe, stage.pictures, budget=0)
        sentinel, verdict = Sentinel(recipe.stop, recipe.fluid.dt), None
        try:
            work = 0.0
            while replay.tick < recipe.ticks and verdict is None:
                progress.check()
                replay.advance()
                work += _strain(replay) * recipe.fluid.dt
                if not sentinel.is_idle:
                    verdict = sentinel.verdict(replay.tick, observe(replay, sentinel))
            found = replay.warp.statistics()
            leads = [self.aim.leads[number] for number in self.numbers]
            points = np.concatenate([lead.shape.led for lead in leads])
            with ForwardMap(replay.warp) as forward:
                points = points + forward.at(points)
        finally:
            replay.release()
        arrived, off = np.full((len(self.pairs), 2), np.nan), np.full((len(self.pairs), 2), np.nan)
        several = np.split(points, np.cumsum([len(lead.shape.led) for lead in leads])[:-1])
        for number, lead, places in zip(self.numbers, leads, several, strict=True):
            arrived[number] = lead.shape.place(places, lead.begins) / self.extent
            off[number] = lead.off(places)
        residuals = off[self.hopeful, 1]
        return Trial(recipe, arrived, off[:, 0], residuals, work, found.det_min, found.folds, verdict)

    def _label(self, number: int) -> str:
        """What messages call a pair."""
        curve = self.aim.pairs.curves[number]
        return self.aim.names[number] + (f' of the curve "{curve[:40]}"' if curve else "")

    def _note_missed(self, missed: Sequence[int], errors: np.ndarray) -> None:
        """Note which pairs cannot be met, which are missed, and by how much: each pair in one sentence."""

        def away(numbers: Sequence[int]) -> tuple[str, str]:
            most = max((errors[number] for number in numbers), default=0.0)
            off = f"{in_pixels(most)} pixels from where"
            return f"ends {off} it should be", f"end up to {off} they should be"

        for numbers, one, more in self._caught:
            self._note([number for number in numbers if number not in missed], one, more)
        for numbers, one, more in self._caught:
            off = [number for number in numbers if number in missed]
            of_one, of_more = away(off)
            self._note(off, f"{one}; it {of_one}", f"{more}; they {of_more}")
        caught = [number for numbers, *_ in self._caught for number in numbers]
        others = [number for number in missed if number not in caught]
        self._note(others, *away(others))

    def _note(self, numbers: Sequence[int], of_one: str, of_more: str) -> None:
        """Note what is to be said of some pairs, in one sentence."""
        if len(numbers):
            named = few([self._label(number) for number in numbers])
            self.notices.append(f"{named} {of_one if len(numbers) == 1 else of_more}")

    def _explain(self, recipe: Recipe, has_missed: bool) -> None:
        """Note which handles are in each other's way, with what has been said of those that missed, if any."""
        said = list(objections(recipe.handle, recipe.pin, (self.extent[0], self.extent[1])))
        if not said:
            return
        more = len(said) - 1
        counted = "1 more conflict is there" if more == 1 else f"{more} more conflicts are there"
        told = said[0] + (f"; {counted}" if more else "")
        missed = [self.notices.pop()] if has_missed else []
        self.notices.append("; ".join([*missed, told]))

    def _usable(self, base: Recipe) -> np.ndarray:
        """The numbers of the pairs that get a handle; of the others it is noted why not."""
        inside = np.abs(self.pairs - 0.5).max(axis=2) <= 0.5
        # The middle of a line may be in the picture and none of its corners.
        inside[:, 0] &= [lead.handle.takes_hold for lead in self.aim.leads]
        (here, there), edge = inside.T, "the picture's edge"
        out, short = np.flatnonzero(~here), np.flatnonzero(here & ~there)
        self._note(
            out.tolist(),
            "is left out: its point is outside the picture",
            "are left out: their points are outside the picture",
        )
        self._note(
            short.tolist(),
            f"goes only to {edge}: its place is outside it",
            f"go only to {edge}: their places are outside",
        )
        numbers, taken = np.flatnonzero(inside[:, 0]), len(base.handle) + len(base.pin) - len(self.aim.own)
        if not len(numbers):
            if self.aim.own:
                raise UserError("all handles with a goal lie outside the picture; set one inside it")
            raise UserError("all pairs lie outside the picture; they are in pixels from its top-left corner")
        if len(numbers) + taken > MOST_HANDLES:
            others = f" beside the recipe's {taken} handles and pins" if taken else ""
            raise UserError(
                f"there are {len(numbers)} {self.noun}s{others}; at most {MOST_HANDLES} work together; leave some out"
            )
        return numbers

    def _reachable(self) -> np.ndarray:
        """The numbers of the pairs with nothing frozen at their ends or all across their ways; the others are caught.

        Of a mask that is changed later no such thing can be said: what is frozen at first may be thawed by then.
        """
        recipe = self.fine.recipe
        if any(edit.tick > 0 for edit in recipe.mask):
            return np.array(self.numbers, int)
        replay = Replay(self.device, recipe, self.fine.pictures, budget=0)
        solid, (nx, ny) = replay.solid, replay.grid.size
        replay.release()
        cells = np.arange(nx * ny).reshape(ny, nx)
        across, down = ~solid[:, :-1] & ~solid[:, 1:], ~solid[:-1] & ~solid[1:]
        one = np.concatenate([cells[:, :-1][across], cells[:-1][down]])
        other = np.concatenate([cells[:, 1:][across], cells[1:][down]])
        part = connected_components(cells.ravel(), one, other).reshape(ny, nx)
        hopeful, caught = [], {"point": [], "place": [], "": list[int]()}
        for number in self.numbers:
            ends = np.minimum(np.clip(self.pairs[number], 0, 1) * (nx, ny), np.array([nx, ny]) - 1).astype(int)
            (x0, y0), (x1, y1) = ends.tolist()
            frozen = [name for name, (x, y) in (("point", ends[0]), ("place", ends[1])) if solid[y, x]]
            if frozen:
                caught[frozen[0]].append(number)
            elif part[y0, x0] != part[y1, x1]:
                caught[""].append(number)
            else:
                hopeful.append(number)
        for end in ("point", "place"):
            told = f"cannot be met: its {end} is frozen", f"cannot be met: their {end}s are frozen"
            self._caught.append((caught[end], *told))
        between = "cannot be met: what is frozen lies between"
        self._caught.append(
            (caught[""], f"{between} its point and its place", f"{between} their points and their places")
        )
        return np.array(hopeful, int)


def _coarse(recipe: Recipe) -> Recipe:
    """The recipe on a grid, and with ticks, that are replayed quickly."""
    settings = recipe.fluid.model_copy(update={"grid": min(recipe.fluid.grid, COARSE_GRID)})
    if not (recipe.stroke or recipe.change or recipe.mask):  # which are told in ticks
        settings = settings.model_copy(update={"dt": max(settings.dt, min(COARSE_DT, recipe.duration / 24))})
    handles, pins = (
        tuple(led.model_copy(update={"detail": 0}) for led in each) for each in (recipe.handle, recipe.pin)
    )
    return recipe.edited(fluid=settings, handle=handles, pin=pins)


def _strain(replay: Replay) -> float:
    """The root mean square of grad u at this moment, of what carries the picture."""
    grid, (width, height) = replay.fluid.grid, replay.grid.extent
    faces, (hx, hy) = replay.fluid.carrier().get().astype(np.float64), grid.spacing
    faces = np.pad(faces, ((0, 1), (0, 1), (0, 0)))  # the far walls
    velocity = np.stack([faces[:-1, :-1, 0] + faces[:-1, 1:, 0], faces[:-1, :-1, 1] + faces[1:, :-1, 1]], axis=-1) / 2
    slopes = np.gradient(velocity, hx, axis=1), np.gradient(velocity, hy, axis=0)
    part = 1.0 if grid.is_whole else grid.extent[0] * grid.extent[1] / (width * height)  # the rest is at rest
    return float(np.sqrt(part * sum((slope**2).sum(axis=-1).mean() for slope in slopes)))


def _is_fitted(handle: RecipeHandle) -> bool:
    """True if a fit has made it for a pair."""
    word, _, number = handle.name.partition(" ")
    return word == NAME and number.isdecimal()


def _rounded(value: float) -> float:
    """To six digits, which are exact enough and can be read."""
    return float(f"{value:.6g}")

"""Fitting: handles that bring points to where they should be with the least work, found by replays of a recipe.

Long, as what is searched, what is tried and what is told of it share the numbering of the pairs.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

import numpy as np

from app.errors import Cancelled, UserError
from app.media.auxiliary import Pictures
from app.media.landmarks import Pairs
from app.model.handles import (
    ARRIVED,
    LARGEST_LEAD,
    MOST_HANDLES,
    MOST_OBJECTIONS,
    RecipeHandle,
    RecipePin,
    labelled,
    objections,
)
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.progress import Progress
from app.work.replay import Replay
from solver.components import connected_components
from solver.gl.device import Device

EVALUATIONS = 32  # replays on the coarse grid
A_FINE_ONE = 8  # of them for each on the recipe's own
COARSE_GRID, COARSE_PICTURE, COARSE_DT = 64, 512, 1 / 30
ALONE = 12  # pairs up to which each handle has values of its own: with more, all have the same
LEAST_DET = 0.2  # of the map, anywhere
# What is searched, from and to: radii in longer sides, stiffnesses, durations in parts of the recipe's, viscosities.
RANGES = (0.06, 0.5), (0.05, 1.0), (0.3, 0.9), (3e-4, 0.3)
DURATION = 1.0, 2.0  # seconds, from and to, for a recipe's own handles: a hand leads one after the other
DECIMALS = 8  # of places: those in a file of pairs are no more exact, and the same are to give the same
NAME = "pair"  # and a number: what the handle that is made for a pair is called
HALVINGS = 4  # of the way, where nothing else keeps it from folding


@dataclass(frozen=True)
class Trial:
    """What came of a replay.

    Attributes:
        recipe: that was played.
        arrived: where the pairs' points are in the end, (n, 2) in fractions; NaN of those without a handle.
        residuals: how far each pair that can be met is from its place, longer sides.
        work: the length of the way, the integral over time of the root mean square of grad u; how fast it is gone makes
            no difference. Landmarks are matched by flows along the shortest one (Joshi and Miller, 2000).
        det: the least det J of the map.
        folds: places where it is not positive.
    """

    recipe: Recipe
    arrived: np.ndarray
    residuals: np.ndarray
    work: float
    det: float
    folds: int

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
        errors: how far all are from where they should be, in pixels; NaN of those without a handle.
        stopped: the search was ended before its budget.
        notices: what the user should hear of.
    """

    trial: Trial
    pairs: Pairs
    errors: np.ndarray
    stopped: bool
    notices: tuple[str, ...]

    @property
    def told(self) -> str:
        """The result in a line."""
        errors, trial = self.errors[np.isfinite(self.errors)], self.trial
        return (
            f"{len(errors)} pairs, mean error {errors.mean():.3g} pixels, most {errors.max():.3g}; "
            f"work {trial.work:.3g}, least det J {trial.det:.3g}, {trial.folds} folds"
        )


def fitted(
    device: Device,
    recipe: Recipe,
    picture: Picture,
    folder: Path,
    pairs: Pairs | None,
    progress: Progress,
    evaluations: int = EVALUATIONS,
    local: float | None = None,
) -> Fitted:
    """The recipe with a handle for each pair, its values searched for the least work that reaches them without a fold.

    By COBYQA (Ragonneau and Zhang), a trust-region method without derivatives for bounds and constraints: on a coarse
    grid first with all handles alike, then the radius of each, then the duration of each; and with all alike again on
    the recipe's own. Many handles stay alike: for so many replays that is found better.
    Handles of an earlier fit are replaced. A budget ends it and no clock, so that the same is found again. If
    `progress` says to stop, the best so far is checked on the recipe's own grid and returned.

    Args:
        folder: where the names of the recipe's other pictures start from.
        pairs: None are those of the recipe's own handles, which are replaced; those that stay as they are become pins.
        evaluations: replays on the coarse grid.
        local: of all handles; None is 1 where there are curves, 0 of points, and the recipe's own keep theirs.

    Raises:
        UserError: if no pair lies in the picture, or there are too many.
        Cancelled: if it is stopped before anything has been found.
    """
    aim = _aimed(device, recipe, picture, folder, pairs)
    if local is not None:
        aim = replace(aim, handles=tuple(each.model_copy(update={"local": local}) for each in aim.handles))
    search = _Search(device, aim, picture, folder, progress)
    fine = max(evaluations // A_FINE_ONE, 1)
    progress.total = evaluations + fine
    point, stopped = search.start, False
    count = len(search.numbers)
    alike, each = _directions(count), np.eye(3 * count + 1)
    parts = (alike, 0.25, 3), (each[:, :count], 0.15, 2), (each[:, 2 * count : -1], 0.15, 1)
    try:
        for directions, reach, share in parts if count <= ALONE else [(alike, 0.25, 1)]:
            point = search.run(search.coarse, point, directions, reach, (evaluations - progress.done) // share)
        point = search.run(search.fine, point, alike, 0.05, fine)
    except Cancelled:
        if search.best is None:
            raise
        point, stopped = search.best[0], True
    return search.ended(point, stopped)


@dataclass(frozen=True)
class _Aim:
    """What is fitted: a recipe without its handles, and what becomes of each pair, but for what is searched.

    `names`: what messages call each pair. `begins`: where each handle's point is when it begins, (n, 2) in fractions.
    """

    recipe: Recipe
    pairs: Pairs
    names: tuple[str, ...]
    handles: tuple[RecipeHandle, ...]
    begins: np.ndarray


def _aimed(device: Device, recipe: Recipe, picture: Picture, folder: Path, pairs: Pairs | None) -> _Aim:
    """What is fitted to given pairs, or, None, to those of the recipe's own handles."""
    if pairs is not None:
        base = recipe.edited(handle=tuple(each for each in recipe.handle if not _is_fitted(each)))
        # What is local carries a curve's points between its handles along: a fluid flows back there. And all do, since
        # those that push as a fluid does halt where what is local has pressed the picture together.
        one = RecipeHandle(at=(0.5, 0.5), keys=(), local=1.0 if any(pairs.curves) else 0.0)
        names = tuple(f"{NAME} {number}" for number in range(1, len(pairs.places) + 1))
        made = tuple(one.model_copy(update={"name": name}) for name in names)
        places = np.round(pairs.places, DECIMALS)
        return _Aim(base, Pairs(places, pairs.curves), names, made, places[:, 0])
    led, names, places, begins, pins, muted = (
        [],
        [],
        [],
        [],
        list(recipe.pin),
        tuple(handle for handle in recipe.handle if handle.muted),
    )
    extent = np.array([picture.width, picture.height]) / max(picture.width, picture.height)
    starts = _starts(device, recipe, picture, folder)
    for number, (handle, start) in enumerate(zip(recipe.handle, starts, strict=True), 1):
        end = np.round(handle.goal or start, DECIMALS)
        if handle.muted:
            continue
        if handle.turns or np.hypot(*((end - handle.at) * extent)) > ARRIVED:
            led.append(handle)
            names.append(handle.name or f"{handle.kind} {number}")
            begins.append(start)
            places.append((np.round(handle.at, DECIMALS), end))
        else:
            pin = RecipePin.model_validate({name: getattr(handle, name) for name in RecipePin.model_fields})
            pins.append(pin if _has_times(recipe) else pin.model_copy(update={"start": 0.0, "end": None}))
    if not led:
        raise UserError("no handle of the recipe leads anywhere; give --pairs, or [[handle]]s with a place to go to")
    base = recipe.edited(handle=muted, pin=tuple(pins))
    pairs = Pairs.points(np.array(places))
    if not _has_times(base):
        base = base.edited(duration=min(max(base.duration, DURATION[0]), DURATION[1]))
        led, begins = [each.model_copy(update={"start": 0.0}) for each in led], pairs.places[:, 0]
    return _Aim(base, pairs, tuple(names), tuple(led), np.array(begins))


def _has_times(recipe: Recipe) -> bool:
    """True if something in it has its time: what is led after it, or beside it, is fitted there."""
    return bool(recipe.stroke or recipe.change or recipe.mask or recipe.force)


def _starts(device: Device, recipe: Recipe, picture: Picture, folder: Path) -> list[np.ndarray]:
    """Where the points of a recipe's handles are when they begin, if something moves them: (2,) each, in fractions."""
    starts, timed = [np.array(handle.at) for handle in recipe.handle], _has_times(recipe)
    ticks = [handle.first_tick(recipe.fluid.dt) for handle in recipe.handle if timed or handle.goal is None]
    if not ticks:
        return starts
    replay = Replay(device, recipe, Pictures(picture, folder), budget=0)
    replay.seek(min(max(ticks) + 1, recipe.ticks))
    labels = [label for label, _ in labelled(recipe.handle, ())]
    for (label, _), start in zip(replay.led, replay.handles.starts, strict=True):
        if label in labels and not np.isnan(start[0]):
            starts[labels.index(label)] = start / replay.grid.extent
    replay.release()
    return starts


def _directions(count: int) -> np.ndarray:
    """The directions in which all handles change alike, (3 count + 1, 4): radii, stiffnesses, durations, viscosity."""
    kinds = np.repeat(np.arange(4), [count, count, count, 1])
    return (kinds[:, None] == np.arange(4)).astype(float)


@dataclass(frozen=True)
class _Stage:
    """A recipe without the handles of the fit, and the pictures that it is played with."""

    recipe: Recipe
    pictures: Pictures


class _Search:
    """Points of the unit cube made into recipes, played and ranked."""

    def __init__(self, device: Device, aim: _Aim, picture: Picture, folder: Path, progress: Progress) -> None:
        self.device, self.aim, self.progress = device, aim, progress
        pairs, base = aim.pairs.places, aim.recipe
        self.pairs = pairs
        self.longer = max(picture.width, picture.height)
        self.extent = np.array([picture.width, picture.height]) / self.longer
        self.notices: list[str] = []
        self.numbers = self._usable(base)
        self.fine = _Stage(base, Pictures(picture, folder))
        self.hopeful = self._reachable()
        apart = -(-self.longer // COARSE_PICTURE)
        small = replace(picture, pixels=np.ascontiguousarray(picture.pixels[::apart, ::apart]))
        self.coarse = _Stage(_coarse(base), Pictures(small, folder))
        self.best: tuple[np.ndarray, Trial, _Stage] | None = None
        ways = np.hypot(*((pairs[:, 1] - aim.begins) * self.extent).T)[self.numbers]
        least = np.clip(1.01 * ways / LARGEST_LEAD, RANGES[0][0], 1.0)
        own = max(base.fluid.viscosity, 1e-6)

        def listed(radii: np.ndarray, stiffness: float, duration: float, mu: float) -> np.ndarray:
            return np.log([*radii, *[stiffness] * len(ways), *[duration] * len(ways), mu])

        (_, widest), *ranges = RANGES
        low, high = zip(*ranges, strict=True)
        self.low = listed(least, low[0], low[1], min(low[2], own))
        self.high = listed(np.maximum(least, widest), high[0], high[1], max(high[2], own))
        first = listed(np.maximum(1.5 * ways, 0.25), 1.0, 0.8, own)
        self.start = np.clip((first - self.low) / np.maximum(self.high - self.low, 1e-9), 0, 1)

    def run(self, stage: _Stage, origin: np.ndarray, groups: np.ndarray, reach: float, budget: int) -> np.ndarray:
        """The best point found from `origin` along `groups`: `budget` replays, at first `reach` of the cube apart."""
        from scipy.optimize import NonlinearConstraint, minimize

        tried: dict[bytes, Trial] = {}

        def trial(step: np.ndarray) -> Trial:
            if (key := step.tobytes()) not in tried:
                tried[key] = self._tried(stage, np.clip(origin + groups @ step, 0, 1))
            return tried[key]

        def constraints(step: np.ndarray) -> np.ndarray:
            found = trial(step)
            return np.array([-found.excess / ARRIVED, (found.det - LEAST_DET) / LEAST_DET])

        if self.best is not None and self.best[2] is not stage:
            self.best = None
        still = np.zeros(groups.shape[1])
        trial(still)
        if budget > 1:
            inside = [origin[group > 0] for group in groups.T]
            minimize(
                lambda step: trial(step).work,
                still,
                method="COBYQA",
                bounds=[(-part.min(), 1 - part.max()) for part in inside],
                constraints=NonlinearConstraint(constraints, 0, np.inf),
                options={"maxfev": budget, "initial_tr_radius": reach, "final_tr_radius": 1e-3},
            )
        assert self.best is not None
        return self.best[0]

    def ended(self, point: np.ndarray, stopped: bool) -> Fitted:
        """The result: the best on the recipe's own grid, and less of the way where that folds."""
        if self.best is None or self.best[2] is not self.fine:
            trial = self._played(self.fine, self._recipe(self.fine.recipe, point), Progress())
        else:
            trial = self.best[1]
        part = 1.0
        while trial.folds and part > 0:
            part = part / 2 if part > 0.5**HALVINGS else 0.0
            trial = self._played(self.fine, self._recipe(self.fine.recipe, point, part), Progress())
        if part < 1:
            self.notices.append(f"the pairs go only {part:g} of their ways: farther, the picture folds")
        if trial.folds:
            self.notices.append("the picture folds even so: the recipe itself folds it")
        errors = np.hypot(*((trial.arrived - self.pairs[:, 1]) * self.extent).T) * self.longer
        for number in self.numbers:
            if not errors[number] <= ARRIVED * self.longer:
                self.notices.append(f"{self._label(number)} ends {errors[number]:.3g} pixels from where it should be")
        said = objections(trial.recipe.handle, trial.recipe.pin, (self.extent[0], self.extent[1]))
        self.notices += list(islice(said, MOST_OBJECTIONS))
        arrived = np.stack([self.pairs[:, 0], trial.arrived], axis=1)[self.numbers]
        pairs = Pairs(arrived, tuple(self.aim.pairs.curves[number] for number in self.numbers))
        return Fitted(trial, pairs, errors, stopped, tuple(self.notices))

    def _tried(self, stage: _Stage, point: np.ndarray) -> Trial:
        trial = self._played(stage, self._recipe(stage.recipe, point), self.progress)
        if self.best is None or trial.rank < self.best[1].rank:
            self.best = point, trial, stage
        best = self.best[1]
        mean = float(best.residuals.mean()) * self.longer if len(best.residuals) else 0.0
        self.progress.enter(f"best so far {mean:.2f} px, work {best.work:.3f}")
        self.progress.advance()
        return trial

    def _recipe(self, base: Recipe, point: np.ndarray, part: float = 1.0) -> Recipe:
        """The recipe that a point of the cube stands for, its handles led a part of their ways."""
        values = [_rounded(value) for value in np.exp(self.low + point * (self.high - self.low))]
        count, handles = len(self.numbers), []
        for row, number in enumerate(self.numbers):
            (at, end), handle = self.pairs[number], self.aim.handles[number]
            to = self.aim.begins[number] + part * (np.clip(end, 0, 1) - self.aim.begins[number])
            values_of = {
                "at": (float(at[0]), float(at[1])),
                "to": (float(to[0]), float(to[1])),
                "keys": None,
                "end": None,
                "radius": values[row],
                "stiffness": min(values[count + row], 1.0),
                "duration": _rounded(values[2 * count + row] * max(base.duration - handle.start, 0.0)),
            }
            if handle.turned:
                _, values_of["rotate"], values_of["scale"] = handle.turned[-1]
                values_of["turned"] = ()
            handles.append(handle.model_copy(update=values_of))
        fluid = base.fluid.model_copy(update={"viscosity": values[-1]})
        return base.edited(handle=(*base.handle, *handles), fluid=fluid)

    def _played(self, stage: _Stage, recipe: Recipe, progress: Progress) -> Trial:
        replay = Replay(self.device, recipe, stage.pictures, budget=0)
        try:
            work = 0.0
            for _ in range(recipe.ticks):
                progress.check()
                replay.advance()
                work += _strain(replay) * recipe.fluid.dt
            found = replay.warp.statistics()
            arrived = np.full((len(self.pairs), 2), np.nan)
            # Handles come after pins, and those of the fit last.
            arrived[self.numbers] = replay.handles.places[-len(self.numbers) :] / self.extent
        finally:
            replay.release()
        ends = np.clip(self.pairs[self.hopeful, 1], 0, 1)
        residuals = np.hypot(*((arrived[self.hopeful] - ends) * self.extent).T)
        return Trial(recipe, arrived, residuals, work, found.det_min, found.folds)

    def _label(self, number: int) -> str:
        """What messages call a pair."""
        curve = self.aim.pairs.curves[number]
        return self.aim.names[number] + (f' of the curve "{curve[:40]}"' if curve else "")

    def _usable(self, base: Recipe) -> np.ndarray:
        """The numbers of the pairs that get a handle; of the others it is noted why not."""
        inside = np.abs(self.pairs - 0.5).max(axis=2) <= 0.5
        for number, (here, there) in enumerate(inside):
            if not here:
                self.notices.append(f"{self._label(number)} is left out: its point is outside the picture")
            elif not there:
                self.notices.append(f"{self._label(number)} goes only to the picture's edge: its place is outside it")
        numbers, taken = np.flatnonzero(inside[:, 0]), len(base.handle) + len(base.pin)
        if not len(numbers):
            raise UserError("no pair has its point in the picture; pairs are in pixels from its top-left corner")
        if len(numbers) + taken > MOST_HANDLES:
            others = f" beside the recipe's {taken} handles and pins" if taken else ""
            raise UserError(f"there are {len(numbers)} pairs{others}; at most {MOST_HANDLES} work together")
        return numbers

    def _reachable(self) -> np.ndarray:
        """The numbers of the pairs with nothing frozen at their ends or all across their ways; the others are noted."""
        recipe = self.fine.recipe
        replay = Replay(self.device, recipe, self.fine.pictures, budget=0)
        solid, (nx, ny) = replay.fluid.solid.get() == 255, replay.grid.size
        replay.release()
        cells = np.arange(nx * ny).reshape(ny, nx)
        across, down = ~solid[:, :-1] & ~solid[:, 1:], ~solid[:-1] & ~solid[1:]
        one = np.concatenate([cells[:, :-1][across], cells[:-1][down]])
        other = np.concatenate([cells[:, 1:][across], cells[1:][down]])
        part = connected_components(cells.ravel(), one, other).reshape(ny, nx)
        hopeful = []
        for number in self.numbers:
            ends = np.minimum(np.clip(self.pairs[number], 0, 1) * (nx, ny), np.array([nx, ny]) - 1).astype(int)
            (x0, y0), (x1, y1) = ends.tolist()
            frozen = [name for name, (x, y) in (("point", ends[0]), ("place", ends[1])) if solid[y, x]]
            if frozen:
                self.notices.append(f"{self._label(number)} cannot be met: its {frozen[0]} is frozen")
            elif part[y0, x0] != part[y1, x1]:
                self.notices.append(
                    f"{self._label(number)} cannot be met: what is frozen parts its point from its place"
                )
            else:
                hopeful.append(number)
        return np.array(hopeful, int)


def _coarse(recipe: Recipe) -> Recipe:
    """The recipe on a grid, and with ticks, that are replayed quickly."""
    settings = recipe.fluid.model_copy(update={"grid": min(recipe.fluid.grid, COARSE_GRID)})
    if not (recipe.stroke or recipe.change or recipe.mask):  # which are told in ticks
        settings = settings.model_copy(update={"dt": max(settings.dt, min(COARSE_DT, recipe.duration / 24))})
    return recipe.edited(fluid=settings)


def _strain(replay: Replay) -> float:
    """The root mean square of grad u at this moment, of what carries the picture."""
    faces, (hx, hy) = replay.fluid.carrier().get().astype(np.float64), replay.fluid.grid.spacing
    faces = np.pad(faces, ((0, 1), (0, 1), (0, 0)))  # the far walls
    velocity = np.stack([faces[:-1, :-1, 0] + faces[:-1, 1:, 0], faces[:-1, :-1, 1] + faces[1:, :-1, 1]], axis=-1) / 2
    slopes = np.gradient(velocity, hx, axis=1), np.gradient(velocity, hy, axis=0)
    return float(np.sqrt(sum((slope**2).sum(axis=-1).mean() for slope in slopes)))


def _is_fitted(handle: RecipeHandle) -> int:
    """The number of the pair that a handle was made for by a fit, from 1; 0 if it was not."""
    word, _, number = handle.name.partition(" ")
    return int(number) if word == NAME and number.isdecimal() else 0


def _rounded(value: float) -> float:
    """To six digits, which are exact enough and can be read."""
    return float(f"{value:.6g}")

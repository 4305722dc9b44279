"""Random arrangements of handles without contradiction, what becomes of them, and a spline of the same points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.interpolate import RBFInterpolator

from solver import Device, Fluid, FluidParams, Grid, Handle, Handles, WarpMap

PIXELS = 512
FARTHEST = 80 / PIXELS
RADIUS = 0.2
SPACING = 0.15  # of handles; pins keep as far from both ends of every way
MARGIN = 0.08
SECONDS, REST = 1.5, 0.75


def arrangement(seed: int, count: int, pins: int = 3) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places, targets and pins, (n, 2) each, on a square: ways out of a smooth field that keep neighbours neighbours.

    The longest way is 60 to 100 % of `FARTHEST`; distances between handles change by a third to a half at most.
    """
    random = np.random.default_rng(seed)
    while True:
        points = _scattered(random, count, np.zeros((0, 2)))
        if points is None:
            continue
        waves, phases = random.integers(0, 3, (6, 2)), random.uniform(0, 2 * np.pi, 6)
        field = np.cos(np.pi * points @ waves.T + phases) @ random.normal(size=(6, 2))
        field *= random.uniform(0.6, 1.0) * FARTHEST / np.hypot(*field.T).max()
        targets = points + field
        if targets.min() < MARGIN or targets.max() > 1 - MARGIN:
            continue
        pairs = np.triu_indices(count, 1)
        before, after = (np.hypot(*(p[pairs[0]] - p[pairs[1]]).T) for p in (points, targets))
        if count > 1 and ((after / before).min() < 0.7 or (after / before).max() > 1.5):
            continue
        held = _scattered(random, pins, np.concatenate([points, targets, (points + targets) / 2]))
        if held is not None:
            return points, targets, held


def _scattered(random: np.random.Generator, count: int, others: np.ndarray) -> np.ndarray | None:
    """Places that keep their distance from one another and from others; None if there is no room."""
    found: list[np.ndarray] = []
    for _ in range(2000):
        if len(found) == count:
            break
        place = random.uniform(MARGIN, 1 - MARGIN, 2)
        if all(np.hypot(*(place - other)) >= SPACING for other in (*found, *others)):
            found.append(place)
    return np.array(found).reshape(-1, 2) if len(found) == count else None


@dataclass(frozen=True)
class Led:
    """What became of an arrangement, in pixels of `PIXELS`; `displacement` in longer sides, (PIXELS, PIXELS, 2)."""

    error: float
    drift: float
    pins: float
    det: float
    folds: int
    displacement: np.ndarray

    @property
    def is_within(self) -> bool:
        """True if it is as near, as still and as smooth as is asked of handles."""
        return self.error <= 0.5 and self.drift < 0.1 and self.pins < 0.5 and self.det > 0.2 and not self.folds

    @property
    def told(self) -> str:
        return f"error {self.error:.3f}, drift {self.drift:.3f}, pins {self.pins:.3f}, det J {self.det:.3f}"


FEELS = ((0.3, 0.0), (0.03, 2.0), (0.0065, 0.0))  # viscosity and drag of Putty, Honey and Water


def led(
    device: Device,
    points: np.ndarray,
    targets: np.ndarray,
    pins: np.ndarray,
    seed: int = 1,
    cells: int = 128,
    dt: float = 1 / 60,
) -> Led:
    """Lead handles from points to targets between pins, with the feel that is the seed's turn, by steps of `dt`."""
    grid, (viscosity, drag) = Grid(cells, cells), FEELS[seed % 3]
    fluid, warp = Fluid(device, grid, FluidParams(drag=drag)), WarpMap(device, grid, (PIXELS, PIXELS))
    fluid.set_viscosity(viscosity)
    ways = [
        Handle((p[0], p[1]), (q[0], q[1]), RADIUS, duration=SECONDS)
        for p, q in zip(points.tolist(), targets.tolist(), strict=True)
    ]
    handles = Handles(fluid, warp, [*ways, *(Handle((p[0], p[1]), radius=RADIUS) for p in pins.tolist())])
    try:
        moved, before, still = 0.0, handles.places, round(0.25 / dt)
        steps, every = round((SECONDS + REST) / dt), round(1 / 6 / dt)
        for tick in range(steps):
            if tick == steps - still:
                before = handles.places
            handles.advance(dt)
            if len(pins) and tick % every == every - 1:
                moved = max(moved, float(handles.away[len(points) :].max()))
        drift = np.hypot(*(handles.places - before).T).max() / (still * dt)
        found, error = warp.statistics(), float(handles.away[: len(points)].max())
        shown = warp.read((PIXELS, PIXELS))
        return Led(error * PIXELS, float(drift) * PIXELS, moved * PIXELS, found.det_min, found.folds, shown)
    finally:
        for thing in (handles, warp, fluid):
            thing.release()


def spline(points: np.ndarray, targets: np.ndarray, pins: np.ndarray) -> np.ndarray:
    """The displacement of a thin-plate spline that looks up the points at their targets, (PIXELS, PIXELS, 2)."""
    ends, starts = np.concatenate([targets, pins]), np.concatenate([points, pins])
    fitted = RBFInterpolator(ends, starts - ends, kernel="thin_plate_spline", degree=1 if len(ends) > 3 else 0)
    centres = (np.arange(PIXELS) + 0.5) / PIXELS
    places = np.stack(np.meshgrid(centres, centres), axis=-1)
    return fitted(places.reshape(-1, 2)).reshape(PIXELS, PIXELS, 2)


class Distortion(NamedTuple):
    """Of the larger of stretch and its inverse: its mean and 99th percentile; and the least det J at the pixels."""

    mean: float
    percentile: float
    least: float


def distortion(displacement: np.ndarray) -> Distortion:
    """How a displacement distorts, by differences of its pixels."""
    h = 1 / PIXELS
    jacobian = np.stack([np.gradient(displacement, h, axis=1), np.gradient(displacement, h, axis=0)], axis=-1)
    jacobian += np.eye(2)
    stretch = np.linalg.svd(jacobian, compute_uv=False)
    worst = np.maximum(stretch[..., 0], 1 / np.maximum(stretch[..., 1], 1e-3))
    return Distortion(float(worst.mean()), float(np.percentile(worst, 99)), float(np.linalg.det(jacobian).min()))

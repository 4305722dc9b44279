"""What a stop condition looks at in a simulation."""

from __future__ import annotations

import numpy as np

from app.model.handles import RecipeHandle
from app.model.timeline import Observation, Sentinel
from app.work.replay import Replay
from solver.grid import Grid
from solver.warp.map import WarpMap

FINER = 3  # times finer than the simulation's grid a point is sought


def observe(replay: Replay, sentinel: Sentinel) -> Observation:
    """What the sentinel asks for, at this moment; reads back from the GPU."""
    motion = replay.fluid.motion() if sentinel.needs_motion else None
    distortion = replay.warp.statistics() if sentinel.needs_map else None
    return Observation(
        energy=motion and motion.kinetic_energy,
        speed=motion and motion.largest_speed,
        displacement=distortion and distortion.displacement_max,
        det=distortion and distortion.det_min,
        away=_farthest(replay) if sentinel.needs_handles else None,
        points=tuple(whereabouts(replay.warp, replay.grid, watch.point) for watch in sentinel.stop.watch),
        extent=replay.grid.extent,
    )


def whereabouts(warp: WarpMap, grid: Grid, point: tuple[float, float]) -> tuple[float, float]:
    """Where a point of the original (fractions of width and height) is now, in longer sides.

    The place that is looked up nearest to it, and from there one step of Newton's method: exact to second order.
    """
    fine = grid.refined(FINER)
    (hx, hy), (x, y) = fine.spacing, fine.centres()
    looked_up = warp.read(fine.size).astype(np.float64) + np.stack([x, y], axis=-1)
    wanted = np.multiply(point, grid.extent)
    j, i = np.unravel_index(((looked_up - wanted) ** 2).sum(axis=-1).argmin(), x.shape)
    around = looked_up[max(j - 1, 0) : j + 2, max(i - 1, 0) : i + 2]
    slopes = np.gradient(around, hx, axis=1), np.gradient(around, hy, axis=0)
    jacobian = np.stack([slope.mean(axis=(0, 1)) for slope in slopes], axis=-1)
    step = np.linalg.lstsq(jacobian, wanted - looked_up[j, i], rcond=None)[0]
    at_x, at_y = np.array([x[j, i], y[j, i]]) + np.clip(step, (-hx, -hy), (hx, hy))
    return float(at_x), float(at_y)


def _farthest(replay: Replay) -> float | None:
    """How far the handle that is farthest from where it is led is from there; None if there is none."""
    led = [isinstance(led, RecipeHandle) for _, led in replay.led]
    return float(replay.handles.away[led].max()) if any(led) else None

"""What a stop condition looks at in a simulation."""

from __future__ import annotations

import numpy as np

from app.model.handles import RecipeHandle
from app.model.timeline import Observation, Sentinel
from app.work.replay import Replay
from solver.warp.map import WarpMap


def observe(replay: Replay, sentinel: Sentinel) -> Observation:
    """What the sentinel asks for, at this moment; reads back from the GPU."""
    motion = replay.fluid.motion() if sentinel.needs_motion else None
    distortion = replay.warp.statistics() if sentinel.needs_map else None
    extent = replay.grid.extent
    watched = np.array([np.multiply(watch.point, extent) for watch in sentinel.stop.watch]).reshape(-1, 2)
    return Observation(
        energy=motion and motion.kinetic_energy,
        speed=motion and motion.largest_speed,
        displacement=distortion and distortion.displacement_max,
        det=distortion and distortion.det_min,
        away=_farthest(replay) if sentinel.needs_handles else None,
        points=tuple(map(tuple, whereabouts(replay.warp, watched).tolist())),
        extent=extent,
    )


def whereabouts(warp: WarpMap, points: np.ndarray) -> np.ndarray:
    """Where points (n, 2) of the original are now, both in longer sides: float64 (n, 2).

    By Newton's method, from the cell of the simulation that is looked up nearest to each, or from one of fewer places.
    """
    if not len(points):
        return np.zeros((0, 2))
    (across, down), (width, height) = warp.bounded(warp.coarse_size), warp.extent
    x, y = (np.arange(across) + 0.5) / across * width, (np.arange(down) + 0.5) / down * height
    cells = np.stack(np.meshgrid(x, y), axis=-1)
    looked_up = cells + warp.read((across, down))
    nearest = [((looked_up - point) ** 2).sum(axis=-1).argmin() for point in points]
    a_cell = np.full(len(points), np.hypot(width / across, height / down))
    found, _ = warp.seek(points, cells.reshape(-1, 2)[nearest], a_cell)
    return found


def _farthest(replay: Replay) -> float | None:
    """How far the handle that is farthest from where it is led is from there; None if there is none."""
    led = [isinstance(led, RecipeHandle) for _, led in replay.led]
    return float(replay.handles.away[led].max()) if any(led) else None

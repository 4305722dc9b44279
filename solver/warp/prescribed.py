"""Where a velocity that is given by a function carries from."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from solver.faces import Function, components
from solver.grid import Grid
from solver.limits import check_size
from solver.warp.submap import window_of


def traced(velocity: Function, grid: Grid, dt: float, time: float) -> np.ndarray:
    """How far back what arrives at the cells' centres at `time + dt` came from, in cells: (ny, nx, 2).

    A fourth-order Runge-Kutta step; what would come from beyond the grid's edge comes from the edge.

    Raises:
        ValueError: if the velocity has not two components, each shaped as the places, or is not finite or too large.
    """

    def velocity_at(x: np.ndarray, y: np.ndarray, time: float) -> tuple[np.ndarray, ...]:
        found = components("a velocity", velocity, x, y, time)
        for component in found:
            check_size("a velocity", component)
        return found

    x, y = grid.centres()
    back_x, back_y = _runge_kutta(velocity_at, x, y, time + dt, -dt)
    left, top, width, height = window_of(grid)
    back = np.stack([np.clip(back_x, left, left + width) - x, np.clip(back_y, top, top + height) - y], axis=-1)
    return back / grid.spacing


def _runge_kutta(
    velocity: Callable[..., tuple[np.ndarray, ...]], x: np.ndarray, y: np.ndarray, time: float, dt: float
) -> tuple[np.ndarray, np.ndarray]:
    """Where points are carried in `dt` by a velocity: the classical fourth-order step."""
    u1, v1 = velocity(x, y, time)
    u2, v2 = velocity(x + dt / 2 * u1, y + dt / 2 * v1, time + dt / 2)
    u3, v3 = velocity(x + dt / 2 * u2, y + dt / 2 * v2, time + dt / 2)
    u4, v4 = velocity(x + dt * u3, y + dt * v3, time + dt)
    return x + dt / 6 * (u1 + 2 * u2 + 2 * u3 + u4), y + dt / 6 * (v1 + 2 * v2 + 2 * v3 + v4)

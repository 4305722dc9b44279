"""Velocities with known answers, and what becomes of them."""

from __future__ import annotations

import numpy as np

from solver.grid import Grid
from solver.scheme import Scheme
from solver.warp.map import WarpMap

VORTEX_TIME = 8.0


def saved(thing: Scheme | WarpMap) -> dict[str, np.ndarray]:
    """All that a fluid or a map saves, by name."""
    state = thing.save()
    arrays = state.arrays()
    state.release()
    return arrays


def vortex(x: np.ndarray, y: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
    """The single vortex in a box, which turns back at T / 2 (Rider and Kothe 1998; T = 8)."""
    turn = np.cos(np.pi * t / VORTEX_TIME)
    u = np.sin(np.pi * x) ** 2 * np.sin(2 * np.pi * y) * turn
    v = -np.sin(2 * np.pi * x) * np.sin(np.pi * y) ** 2 * turn
    return u, v


def vortex_faces(grid: Grid, t: float) -> np.ndarray:
    """The vortex's means over the faces of a square grid: differences of its stream function, divergence-free."""
    e = np.arange(grid.nx + 1) * grid.h
    x, y = np.meshgrid(e, e)
    stream = np.sin(np.pi * x) ** 2 * np.sin(np.pi * y) ** 2 * np.cos(np.pi * t / VORTEX_TIME) / np.pi
    u = (stream[1:, :-1] - stream[:-1, :-1]) / grid.h
    v = -(stream[:-1, 1:] - stream[:-1, :-1]) / grid.h
    return np.stack([u, v], axis=-1).astype(np.float32)

"""Lines that are led anywhere, beside and across the edges too: nothing folds, and the fluid comes to rest."""

from __future__ import annotations

import numpy as np

from solver.brush.handle import Handle
from solver.brush.handles import Handles
from solver.fluid import Fluid
from solver.gl.device import Device
from solver.grid import Grid
from solver.params import FluidParams
from solver.warp.map import WarpMap
from support.leading import FARTHEST, FEELS

ARRIVED = 0.001  # longer sides
DT, MOST_TICKS, AT_REST = 1 / 30, 240, 0.01  # seconds; s; longer sides / s


def random_line(rng: np.random.Generator) -> Handle:
    """An open or a closed line about any place, which may reach out of the picture, moved and perhaps turned."""
    middle, closed, turned = rng.uniform(0, 1, 2), rng.random() < 0.5, rng.random() < 0.3
    count, size, angle = int(rng.integers(3, 12)), rng.uniform(0.04, 0.2), rng.uniform(0, 2 * np.pi)
    if closed:
        angles = angle + np.sort(rng.uniform(0, 1, count) + np.arange(count)) * 2 * np.pi / count
        corners = middle + size * rng.uniform(0.7, 1, (count, 1)) * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    else:
        along = np.linspace(-size, size, count)[:, None] * [np.cos(angle), np.sin(angle)]
        corners = middle + along + rng.normal(0, 0.1 * size, (count, 2))
    way, direction = FARTHEST * rng.uniform(0.2, 1), rng.uniform(0, 2 * np.pi)
    to = middle + way * np.array([np.cos(direction), np.sin(direction)])
    return Handle(
        (float(middle[0]), float(middle[1])),
        (float(to[0]), float(to[1])),
        radius=rng.uniform(0.06, 0.2),
        duration=rng.uniform(0.3, 0.8),
        points=tuple(map(tuple, corners.tolist())),
        closed=bool(closed),
        rotate=rng.uniform(-60, 60) if turned else None,
    )


def check_lines(device: Device, seed: int, cells: int = 32, texels: int = 128) -> dict[str, float]:
    """One to three lines among up to two pins: no fold, no NaN, and rest in a bounded time."""
    rng = np.random.default_rng(seed)
    grid, (viscosity, drag) = Grid(cells, cells), FEELS[seed % len(FEELS)]
    fluid, warp = Fluid(device, grid, FluidParams(drag=drag)), WarpMap(device, grid, (texels, texels))
    fluid.set_viscosity(viscosity)
    lines = [random_line(rng) for _ in range(rng.integers(1, 4))]
    pins = [Handle((x, y), radius=0.1) for x, y in rng.uniform(0.05, 0.95, (rng.integers(0, 3), 2)).tolist()]
    handles, ticks, speed = Handles(fluid, warp, [*lines, *pins]), 0, np.inf
    try:
        while speed > AT_REST:
            assert ticks < MOST_TICKS, f"{speed:.3g} longer sides a second after {ticks} ticks"
            for _ in range(30):
                handles.advance(DT)
            ticks += 30
            speed = fluid.motion().largest_speed
        found = warp.statistics()
        assert np.isfinite(warp.read()).all()
        assert np.isfinite(handles.away).all()
        lines_left, halts = handles.away[: len(lines)], handles.halts
        told = [why for left, why in zip(lines_left, halts, strict=False) if left > ARRIVED]
        assert found.folds == 0, f"{found.folds} folds, det J {found.det_min:.3f}"
        return {
            "least det J, from 1": 1 - found.det_min,
            "ticks": float(ticks),
            "lack": float(handles.away.max()),
            "without a reason": float(told.count(None)),
        }
    finally:
        for thing in (handles, warp, fluid):
            thing.release()

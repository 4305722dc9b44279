"""How exact the scheme is, and the paper's beside it: python tests/benchmarks/bench_accuracy.py [--slow]

Prints the error of the warp map on the single vortex in a box, what the projection leaves, and, with --slow, the
extrema of the lid-driven cavity at Re 1000 on 256 x 256 (several minutes on a processor). Nothing here is a time.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from bench_step import brushes
from rich.console import Console
from rich.progress import track
from rich.table import Table

from solver import Device, Fluid, FluidParams, Grid, PaperWarpMap, Walls, WarpMap

# The references lie with the tests.
sys.path.insert(0, str(Path(__file__).parents[1]))

from support import reference
from support.flows import VORTEX_TIME, vortex

# Of u on the vertical centre line, and v on the horizontal: Botella and Peyret, Computers & Fluids 27 (1998).
CAVITY_1000 = np.array([-0.3885698, 0.3769447, -0.5270771])


def vortex_rows(device: Device, table: Table) -> None:
    """Mean error in cells against traced particles at T / 2 and against the identity at T; 128 x 128, CFL 1."""
    grid = Grid(128, 128)
    steps = round(VORTEX_TIME / grid.h)
    dt = VORTEX_TIME / steps
    x, y = grid.centres()
    for name, kind in {"ours": WarpMap, "the paper's": PaperWarpMap}.items():
        warp = kind(device, grid)
        errors = []
        for step in range(steps):
            warp.advance_prescribed(vortex, dt, step * dt)
            if step + 1 in (steps // 2, steps):
                time = (step + 1) * dt
                traced_x, traced_y = reference.follow(vortex, x, y, time, 0.0, 400)
                there = warp.read().astype(np.float64) + np.stack([x, y], axis=-1)
                error = np.hypot(there[..., 0] - traced_x, there[..., 1] - traced_y)
                errors.append(float(error.mean()) / grid.h)
        table.add_row("vortex T = 8, 128², CFL 1", f"{name}: cells at T/2, at T", ", ".join(f"{e:.4f}" for e in errors))
        table.add_row("", f"{name}: mean |det - 1|", f"{warp.statistics().det_error:.1e}")
        warp.release()


def projection_rows(device: Device, table: Table) -> None:
    """What is left of the divergence of brush impulses."""
    for size in ((512, 512), (333, 217), (512, 100), (257, 255), (512, 341)):
        grid = Grid(*size)
        left = []
        for cycles in (1, 2, 3):
            fluid = Fluid(device, grid, FluidParams(pressure_cycles=cycles))
            fluid.set_velocity(brushes(grid))
            before = np.linalg.norm(fluid.divergence().astype(np.float64))
            fluid.project()
            left.append(float(np.linalg.norm(fluid.divergence().astype(np.float64)) / before))
            fluid.release()
        table.add_row(
            f"projection {size[0]} x {size[1]}", "left after 1, 2, 3 cycles", ", ".join(f"{e:.1e}" for e in left)
        )


def cavity_rows(device: Device, table: Table, finest: int) -> None:
    """Extrema of the lid-driven cavity at Re 1000, each grid started from the coarser one's end."""
    faces = None
    # Long enough to come to rest: on 256 x 256 the start from 128 x 128 is forgotten by half in some 6 s.
    for cells, seconds in ((32, 40), (64, 20), (128, 20), (256, 24)):
        if cells > finest:
            break
        grid = Grid(cells, cells)
        fluid = Fluid(device, grid, FluidParams(walls=Walls("none", (0.0, 0.0, 1.0, 0.0))))
        fluid.set_viscosity(1e-3)
        if faces is not None:
            fluid.set_velocity(faces.repeat(2, axis=0).repeat(2, axis=1))
        for _ in track(range(seconds * cells), f"cavity {cells} x {cells}", transient=True):
            fluid.step(grid.h)
        faces = fluid.velocity.read.get()
        middle = cells // 2
        # The lid is on top and y points down: the published v has the other sign.
        u, v = faces[:, middle, 0], -faces[middle, :, 1]
        found = np.array([u.min(), v.max(), v.min()])
        off = ", ".join(f"{100 * error:+.2f} %" for error in found / CAVITY_1000 - 1)
        table.add_row(f"cavity Re 1000, {cells}²", "u_min, v_max, v_min off by", off)
        fluid.release()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--slow", action="store_true", help="the cavity up to 256 x 256")
    options = parser.parse_args()
    table = Table("case", "measured", "value", title="accuracy")
    with Device.headless() as device:
        vortex_rows(device, table)
        projection_rows(device, table)
        cavity_rows(device, table, 256 if options.slow else 64)
    Console(width=110).print(table)


if __name__ == "__main__":
    main()

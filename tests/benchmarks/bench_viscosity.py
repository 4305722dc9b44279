"""The viscous step by class of mask: python tests/benchmarks/bench_viscosity.py [--seeds 3] [--sizes 96x96 200x133]

For each class, contrast and softest kappa = dt mu / h^2: the largest number of iterations, the largest error against a
direct solution and what doing nothing would leave, over the seeds; what a step costs in five-point Jacobi passes (J,
see bench_step.py) and what taking up the mask costs, in milliseconds, medians of processor time.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np
from bench_step import Jacobi
from rich.console import Console
from rich.table import Table

from solver import Device, Grid
from solver.viscosity.solve import Viscosity

sys.path.insert(0, str(Path(__file__).parent.parent))
from properties.viscosity import MASKS, Case, error

REPEATS = 5


def costs(device: Device, case: Case, jacobi: Jacobi) -> tuple[float, float]:
    """J of a step from rest, and milliseconds of taking up the mask."""
    ny, nx = case.viscosity.shape
    solver = Viscosity(device, (nx, ny))
    fields = device.upload(case.viscosity), device.upload(case.solid.astype(np.uint8) * np.uint8(255))
    velocity = device.double_field((nx, ny), 2, "velocity")
    ratios, prepared = [], []
    for _ in range(REPEATS):
        stamps = [time.process_time()]
        solver.set_spacing(solver.spacing)  # or nothing has changed, and nothing is taken up
        solver.set_coefficients(*fields, 1 / max(nx, ny) ** 2, case.walls)
        _ = solver.deflation.space  # else found in the first step
        for job in (lambda: None, jacobi.ten, lambda: solver.diffuse(velocity.read), jacobi.ten):
            device.ctx.finish()
            stamps.append(time.process_time())
            velocity.read.set(case.faces)
            solver.forget()
            job()
        device.ctx.finish()
        stamps.append(time.process_time())
        spent = np.diff(stamps)
        prepared.append(1e3 * spent[0])
        ratios.append(2 * 10 * len(jacobi.pairs) * spent[3] / (spent[2] + spent[4]))
    for item in (solver, velocity, *fields):
        item.release()
    return float(np.median(ratios)), float(np.median(prepared))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--sizes", nargs="+", default=["96x96", "200x133"])
    parser.add_argument("--contrasts", nargs="+", type=float, default=[1e2, 1e5, 1e8])
    parser.add_argument("--softest", nargs="+", type=float, default=[1.0, 30.0])
    options = parser.parse_args()
    console = Console(width=120)
    with Device.headless() as device:
        for text in options.sizes:
            size = int(text.split("x")[0]), int(text.split("x")[1])
            table = Table(title=f"viscous step, {text}")
            for column in ("kappa", "contrast", "mask", "iterations", "error", "doing nothing", "J", "mask, ms"):
                table.add_column(column, justify="left" if column == "mask" else "right")
            jacobi = Jacobi(device, Grid(*size), pairs=1)
            for softest in options.softest:
                for contrast in options.contrasts:
                    for kind in MASKS:
                        rows = []
                        for seed in range(options.seeds):
                            case = Case.random(kind, size, contrast, softest, np.random.default_rng(seed))
                            found, iterations = case.solved(device)
                            wanted = case.exact()
                            rows.append((iterations, error(found, wanted), error(case.faces, wanted)))
                        iterations, left, nothing = np.max(rows, axis=0)
                        cost, prepared = costs(device, case, jacobi)
                        table.add_row(f"{softest:g}", f"{contrast:g}", kind, f"{iterations:.0f}", f"{left:.4f}",
                                      f"{nothing:.3f}", f"{cost:.0f}", f"{prepared:.0f}")  # fmt: skip
            jacobi.release()
            console.print(table)


if __name__ == "__main__":
    main()

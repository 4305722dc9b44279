"""What a step costs, in five-point Jacobi passes measured beside it: python tests/benchmarks/bench_step.py

J is one full-screen five-point Jacobi sweep on R32F, texture() with nearest filtering, on the same grid in the same
run. Ratios hold when the machine's speed drifts; milliseconds do not. Everything is interleaved, medians are shown.
A software rasteriser is timed by the processor time of all its threads, which other programs change least.
"""

from __future__ import annotations

import argparse
import platform
import statistics
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
from rich.console import Console
from rich.table import Table
from scipy import ndimage

from solver import Device, Fluid, Grid, PaperFluid, PaperWarpMap, WarpMap
from solver.gl.field import Field
from solver.gl.program import FULL_SCREEN_VERTEX, assemble

JACOBI = """#version 330 core
uniform sampler2D u_p; uniform vec2 u_texel; in vec2 v_uv; out float out_p;
void main() {
    out_p = 0.25 * (texture(u_p, v_uv + vec2(u_texel.x, 0.0)).r + texture(u_p, v_uv - vec2(u_texel.x, 0.0)).r
                  + texture(u_p, v_uv + vec2(0.0, u_texel.y)).r + texture(u_p, v_uv - vec2(0.0, u_texel.y)).r
                  - 0.001 * texture(u_p, v_uv).r);
}
"""


# Steps that are timed together: the map looks whether to fold every 8 steps, and a fold costs as much as a step.
BATCH = 16


class Jacobi:
    """The unit: one five-point sweep. Of several pairs of textures: where they happen to lie moves it by a quarter."""

    def __init__(self, device: Device, grid: Grid, pairs: int = 4) -> None:
        self.pairs = [device.double_field(grid.size, 1, f"jacobi {number}") for number in range(pairs)]
        for pair in self.pairs:
            pair.read.set(np.random.default_rng(0).standard_normal((grid.ny, grid.nx)))
        vertex, _ = assemble(FULL_SCREEN_VERTEX, {})
        program = device.ctx.program(vertex_shader=vertex, fragment_shader=JACOBI)
        program["u_texel"] = self.pairs[0].read.texel
        self.vertices = device.ctx.vertex_array(program, [])

    def ten(self) -> None:
        """Ten sweeps of each pair, long enough to time."""
        for pair in self.pairs:
            for _ in range(10):
                pair.read.texture.use(0)
                pair.write.framebuffer.use()
                self.vertices.render(moderngl.TRIANGLES, vertices=3)
                pair.swap()

    def release(self) -> None:
        for pair in self.pairs:
            pair.release()


def brushes(grid: Grid, seed: int = 1) -> np.ndarray:
    """A velocity of a few brush impulses, not divergence-free, as the projection meets it while someone paints."""
    rng = np.random.default_rng(seed)
    faces = np.zeros((grid.ny, grid.nx, 2))
    for _ in range(6):
        x, y = rng.uniform(0.2, 0.8, 2) * grid.extent
        force, radius = rng.standard_normal(2), rng.uniform(0.03, 0.08)
        for axis, (fx, fy) in enumerate((grid.u_faces(), grid.v_faces())):
            faces[..., axis] += force[axis] * np.exp(-((fx - x) ** 2 + (fy - y) ** 2) / (2 * radius**2))
    return (0.5 * faces / np.abs(faces).max()).astype(np.float32)


def painted(grid: Grid, thin: float, contrast: float) -> np.ndarray:
    """A viscosity as someone paints it: hard and soft blobs, `contrast` times thicker than the rest."""
    x, y = grid.centres()
    width, height = grid.extent
    hard = (np.hypot(x - 0.3 * width, y - 0.4 * height) < 0.12) | (np.abs(y - 0.75 * height) < 0.03)
    soft = np.exp(-((x - 0.7 * width) ** 2 + (y - 0.45 * height) ** 2) / (2 * 0.08**2))
    return thin * contrast ** np.maximum(hard, soft)


def relative_divergence(fluid: Fluid, before: float) -> float:
    return float(np.linalg.norm(fluid.divergence().astype(np.float64))) / before


def median_times(
    device: Device, unit: Callable[[], None], jobs: dict[str, tuple[Callable[[], None], int]], rounds: int
) -> tuple[float, dict[str, tuple[float, float]]]:
    """Milliseconds of the unit; of one call of each job, and that in units: medians of rounds in which they take turns.

    So many calls of a job are timed together, the unit right before and after them, as the machine's speed drifts.
    """

    clock = time.process_time if device.limits.is_software else time.perf_counter

    def timed(job: Callable[[], None], calls: int) -> float:
        device.ctx.finish()
        start = clock()
        for _ in range(calls):
            job()
        device.ctx.finish()
        return (clock() - start) / calls * 1e3

    units: list[float] = []
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in jobs}
    for number in range(rounds + 1):
        for name, (job, calls) in jobs.items():
            before, taken, after = timed(unit, 1), timed(job, calls), timed(unit, 1)
            if number:  # the first round warms up
                units += [before, after]
                times[name].append((taken, 2.0 * taken / (before + after)))
    medians = {name: tuple(np.median(rows, axis=0).tolist()) for name, rows in times.items()}
    return statistics.median(units), medians


def numpy_jacobi(sweeps: int, rhs: np.ndarray) -> None:
    kernel = np.array([[0, 1, 0], [1, 0, 1], [0, 1, 0]], np.float32) / 4
    p = np.zeros_like(rhs)
    for _ in range(sweeps):
        p = ndimage.convolve(p, kernel, mode="nearest") - rhs


def numba_jacobi(rhs: np.ndarray) -> Callable[[int], None] | None:
    """Forty compiled sweeps, where Numba is installed."""
    try:
        import numba  # pyright: ignore[reportMissingImports]
    except ImportError:
        return None

    @numba.njit(parallel=True, fastmath=True)
    def sweep(p: np.ndarray, rhs: np.ndarray, out: np.ndarray) -> None:
        ny, nx = p.shape
        for j in numba.prange(ny):
            for i in range(nx):
                left, right = p[j, max(i - 1, 0)], p[j, min(i + 1, nx - 1)]
                above, below = p[max(j - 1, 0), i], p[min(j + 1, ny - 1), i]
                out[j, i] = 0.25 * (left + right + above + below - rhs[j, i])

    def run(sweeps: int) -> None:
        p, out = np.zeros_like(rhs), np.zeros_like(rhs)
        for _ in range(sweeps):
            sweep(p, rhs, out)
            p, out = out, p

    run(1)
    return run


def step_rows(device: Device, cells: int, rounds: int, table: Table) -> None:
    grid, dt = Grid(cells, cells), 1 / 60
    jacobi = Jacobi(device, grid)
    force = device.upload(brushes(grid, 5))
    start = brushes(grid)
    cases = {
        "uniform viscosity": (Fluid, WarpMap, 1e-3),
        "painted mask, contrast 1e5": (Fluid, WarpMap, painted(grid, 1e-4, 1e5)),
        "the paper's scheme, 40 + 40 Jacobi": (PaperFluid, PaperWarpMap, 1e-3),
    }
    jobs: dict[str, tuple[Callable[[], None], int]] = {}
    fluids: dict[str, Fluid | PaperFluid] = {}
    for name, (kind, map_kind, viscosity) in cases.items():
        fluid: Any = kind(device, grid)
        fluid.set_viscosity(viscosity)
        fluid.set_velocity(start)
        warp = map_kind(device, grid)

        def step(fluid: Any = fluid, warp: WarpMap = warp) -> None:
            fluid.step(dt, [(force, 1e-3)])
            with device.stage("warp map"):
                warp.follow(fluid, dt)

        fluids[name] = fluid
        jobs[name] = step, BATCH if kind is Fluid else 2
    unit, measured = median_times(device, jacobi.ten, jobs, rounds)
    sweeps = 10 * len(jacobi.pairs)
    unit /= sweeps
    reads = f"{5 * cells**2 / 1e6:.2f}"
    table.add_row(f"{cells}²", "J: one five-point Jacobi pass", f"{unit:.3f}", "1.0", "1", reads)
    for name, (milliseconds, ratio) in measured.items():
        fluid = fluids[name]
        device.timings.take()
        device.timings.enabled = True
        job, batch = jobs[name]
        for _ in range(batch):
            job()
        passes, reads, writes = (
            {stage: count / batch for stage, count in book.items()}
            for book in (device.timings.passes, device.timings.texel_reads, device.timings.texel_writes)
        )
        stages = {stage: taken / batch for stage, taken in device.timings.take().items()}
        device.timings.enabled = False
        before, after = divergence_of_a_step(fluid, force)
        traffic = 16 * (sum(writes.values())) * 2 / 1e6
        table.add_row(
            "",
            name,
            f"{milliseconds:.2f}",
            f"{ratio * sweeps:.1f}",
            f"{sum(passes.values()):.1f}",
            f"{sum(reads.values()) / 1e6:.2f}",
            f"{traffic:.0f}",
            f"{after / before:.1e}",
        )
        whole = sum(stages.values())
        for stage, share in stages.items():
            table.add_row(
                "",
                f"  {stage}",
                f"{milliseconds * share / whole:.2f}",
                f"{ratio * sweeps * share / whole:.1f}",
                f"{passes.get(stage, 0):.1f}",
                f"{reads.get(stage, 0) / 1e6:.2f}",
            )


def divergence_of_a_step(fluid: Fluid | PaperFluid, force: Field) -> tuple[float, float]:
    """L2 norm of the divergence before and after the projection of a step."""
    fluid.add_force([(force, 1e-3)], 1 / 60)
    fluid.advect(1 / 60)
    fluid.diffuse(1 / 60)
    before = float(np.linalg.norm(fluid.divergence().astype(np.float64)))
    fluid.project()
    return before, float(np.linalg.norm(fluid.divergence().astype(np.float64)))


def others(cells: int, table: Table) -> None:
    """Forty Jacobi sweeps elsewhere, for scale."""
    rhs = np.random.default_rng(0).standard_normal((cells, cells)).astype(np.float32)
    start = time.perf_counter()
    numpy_jacobi(40, rhs)
    table.add_row(f"{cells}²", "SciPy, 40 Jacobi sweeps", f"{(time.perf_counter() - start) * 1e3:.1f}")
    if run := numba_jacobi(rhs):
        start = time.perf_counter()
        run(40)
        table.add_row("", "Numba, 40 Jacobi sweeps", f"{(time.perf_counter() - start) * 1e3:.1f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--grids", type=int, nargs="+", default=[256, 512])
    parser.add_argument("--rounds", type=int, default=9)
    options = parser.parse_args()
    console = Console(width=130)
    with Device.headless() as device:
        facts = Path("/proc/cpuinfo").read_text().splitlines()
        cpu = next((line.split(":", 1)[1].strip() for line in facts if "model name" in line), platform.processor())
        console.print(f"{device.limits.renderer}, {device.limits.version}; {cpu}; Python {platform.python_version()}")
        console.print(", ".join(f"{name} {version(name)}" for name in ("moderngl", "numpy", "scipy")))
        table = Table(title="one step: force, advection, viscosity, projection, map")
        for column in ("grid", "what", "ms", "J", "passes", "Mreads", "MB floor", "divergence left"):
            table.add_column(column, justify="left" if column == "what" else "right")
        for cells in options.grids:
            step_rows(device, cells, options.rounds, table)
            others(cells, table)
        console.print(table)


if __name__ == "__main__":
    main()

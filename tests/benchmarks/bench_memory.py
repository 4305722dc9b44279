"""Whether memory grows with the number of frames, and what a very large picture takes beyond its source.

    python tests/benchmarks/bench_memory.py [frames]   grid 1024, a picture of 4000 x 3000, 300 frames as JPEG; long
    python tests/benchmarks/bench_memory.py --still    a picture of 12,000 x 9,000, RGB of 8 bits

Resident memory is that of this process, where a software rasteriser keeps its textures too; it encodes JPEG itself, so
that there is no other process to count.
"""

from __future__ import annotations

import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

from app.model.picture import Picture
from app.model.recipe import FluidSettings, Output, Recipe
from app.progress import Progress
from app.work.export import run
from app.work.jobs import Job, Outputs
from solver.gl.device import Device

MIB = 2**20
VORTEX = {"kind": "vortex", "point": (0.5, 0.5), "radius": 0.3, "strength": 3.0}


def resident() -> int:
    """Bytes of this process in memory."""
    status = Path("/proc/self/status").read_text()
    return int(status.split("VmRSS:")[1].split()[0]) * 1024


def picture(width: int, height: int) -> Picture:
    """Soft colours with fine noise, made in strips."""
    pixels = np.empty((height, width, 3), np.uint8)
    rng = np.random.default_rng(0)
    x = np.arange(width)[:, None] / width
    for top in range(0, height, 100):
        y = np.arange(top, min(top + 100, height))[:, None, None] / height
        soft = 120 + 90 * np.sin(9 * x + 7 * y + np.arange(3))
        pixels[top : top + 100] = soft + rng.integers(-8, 9, soft.shape)
    return Picture(pixels)


def recipe(grid: int, ticks: int) -> Recipe:
    fluid = FluidSettings(grid=grid)
    plain = Recipe.model_validate({"force": (VORTEX,), "duration": ticks * fluid.dt, "fluid": {"grid": grid}})
    return plain.edited(output=Output(fps=round(1 / fluid.dt)))


def animation(frames: int) -> None:
    source = picture(4000, 3000)
    seen: list[tuple[int, int]] = []

    def report(done: int, total: int | None) -> None:
        seen.append((done, resident()))

    with tempfile.TemporaryDirectory() as folder, Device.headless() as device:
        job = Job(recipe(1024, frames - 1), source, Path(folder), Outputs(Path(folder) / "f.%04d.jpg"))
        started = time.perf_counter()
        written = run(device, job, Progress(report=report)).frames
        spent = time.perf_counter() - started
        print(f"{device.limits.renderer}; grid 1024, 4000 x 3000, {written} frames in {spent:.0f} s")
    taken = [bytes_ for _, bytes_ in seen]
    per_frame = len(taken) / written
    for frame in sorted({1, written // 10, written // 4, written // 2, 3 * written // 4, written}):
        print(f"frame {frame:4}: {taken[min(len(taken) - 1, int(frame * per_frame) - 1)] / MIB:8.0f} MiB")
    late = np.array(taken[len(taken) // 10 :], float) / MIB
    slope = np.polyfit(np.arange(len(late)) / per_frame, late, 1)[0]
    print(f"after the first tenth: {late.min():.0f}-{late.max():.0f} MiB, {1024 * slope:+.0f} KiB a frame")


def still() -> None:
    source = picture(12_000, 9_000)
    with tempfile.TemporaryDirectory() as folder, Device.headless() as device:
        job = Job(recipe(256, 30), source, Path(folder), Outputs(Path(folder) / "a.png"))
        before, peak, ended = resident(), [0], threading.Event()

        def watch() -> None:
            while not ended.wait(0.01):
                peak[0] = max(peak[0], resident())

        thread = threading.Thread(target=watch)
        thread.start()
        started = time.perf_counter()
        run(device, job, Progress())
        spent = time.perf_counter() - started
        ended.set()
        thread.join()
    print(f"12,000 x 9,000 RGB of 8 bits in {spent:.0f} s: {(peak[0] - before) / 1e9:.2f} GB beyond the source")


if __name__ == "__main__":
    if "--still" in sys.argv[1:]:
        still()
    else:
        animation(int(sys.argv[1]) if len(sys.argv) > 1 else 300)

"""What looking a 3840 x 2160 picture up through a map costs, beside OpenCV's remap in the same run.

    python tests/benchmarks/bench_sampling.py

Ours are from an array to an array: upload, samples, read back. A picture that is read-only stays uploaded, as over an
animation of it; the places of a map that stands still are kept, as over a film; OpenCV is given them ready made. The
time of the processor is of all threads together; its ratios are what other programs running beside disturb least.
"""

from __future__ import annotations

import platform
import time
from collections.abc import Callable

import cv2
import numpy as np

from solver.gl.device import Device
from solver.grid import Grid
from solver.resample.plan import Sampling
from solver.resample.sampler import Sampler
from solver.warp.map import WarpMap

WIDTH, HEIGHT = 3840, 2160
ROUNDS = 5


def picture(width: int, height: int) -> np.ndarray:
    """Soft colours with fine noise, as a photograph has, (height, width, 3) uint8."""
    rng = np.random.default_rng(0)
    coarse = rng.uniform(30, 220, (height // 60, width // 60, 3)).astype(np.float32)
    soft = cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC)
    return np.clip(soft + rng.normal(0, 8, soft.shape), 0, 255).astype(np.uint8)


def twirl(grid: Grid) -> np.ndarray:
    """A turn of one radian that dies away towards the edges, and a little compression, (ny, nx, 2)."""
    x, y = grid.centres()
    dx, dy = x - grid.extent[0] / 2, y - grid.extent[1] / 2
    r2 = (dx**2 + dy**2) / 0.2**2
    turn, squeeze = np.exp(-r2), 1 + 0.2 * np.exp(-r2)
    u = squeeze * (np.cos(turn) * dx - np.sin(turn) * dy) - dx
    v = squeeze * (np.sin(turn) * dx + np.cos(turn) * dy) - dy
    return np.stack([u, v], axis=-1).astype(np.float32)


def main() -> None:
    device = Device.headless()
    grid = Grid.for_picture(WIDTH, HEIGHT, 512)
    warp = WarpMap(device, grid)
    warp.set(twirl(grid))
    source = picture(WIDTH, HEIGHT)
    still = source.copy()
    still.flags.writeable = False
    displacement = warp.read((WIDTH, HEIGHT)) * WIDTH
    x = (np.arange(WIDTH, dtype=np.float32) + displacement[..., 0]).astype(np.float32)
    y = (np.arange(HEIGHT, dtype=np.float32)[:, None] + displacement[..., 1]).astype(np.float32)
    sampler = Sampler(device)
    fast = Sampling("bilinear", samples=1, linear_light=False)

    def moved() -> WarpMap:
        warp.restore_under((0.5, 0.5), 0.01, amount=0.0)
        return warp

    def remap(kind: int) -> Callable[[], object]:
        return lambda: cv2.remap(source, x, y, kind)

    rows: dict[str, Callable[[], object]] = {
        "OpenCV remap, bilinear": remap(cv2.INTER_LINEAR),
        "bilinear, one sample, in gamma": lambda: sampler.apply(warp, source, how=fast),
        "the same, of a picture that stays": lambda: sampler.apply(warp, still, how=fast),
        "the same, of a map that moves": lambda: sampler.apply(moved(), source, how=fast),
        "OpenCV remap, Lanczos-4": remap(cv2.INTER_LANCZOS4),
        "Catmull-Rom, samples by stretch, linear light": lambda: sampler.apply(warp, source),
        "the same, of a picture that stays ": lambda: sampler.apply(warp, still),
        "the same, of a map that moves ": lambda: sampler.apply(moved(), source),
    }
    taken: dict[str, list[tuple[float, float]]] = {name: [] for name in rows}
    for round_ in range(ROUNDS + 1):
        for name, row in rows.items():
            row()  # the textures of the row before may have been of another kind
            start, busy = time.perf_counter(), time.process_time()
            row()
            if round_:
                taken[name].append(((time.perf_counter() - start) * 1e3, (time.process_time() - busy) * 1e3))
    middle = {name: np.median(times, axis=0) for name, times in taken.items()}

    print(f"{platform.machine()}, {platform.processor() or platform.system()}; {device.limits.renderer}")
    print(f"OpenCV {cv2.__version__} on {cv2.getNumThreads()} threads; {WIDTH} x {HEIGHT} RGB, 8 bits; map {grid.size}")
    print(f"{'':46} {'ms':>7} {'CPU ms':>7} {'/ bilinear':>11} {'CPU':>5} {'/ Lanczos-4':>11} {'CPU':>5}")
    for name, (wall, busy) in middle.items():
        shares = " ".join(
            f"{wall / middle[other][0]:11.2f} {busy / middle[other][1]:5.2f}"
            for other in ("OpenCV remap, bilinear", "OpenCV remap, Lanczos-4")
        )
        print(f"{name:46} {wall:7.1f} {busy:7.1f} {shares}")


if __name__ == "__main__":
    main()

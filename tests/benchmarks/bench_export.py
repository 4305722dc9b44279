"""How near an animation's export comes to its encoder: the same frames rendered and written, or fed from memory.

    python tests/benchmarks/bench_export.py [longer side] [frames]

By the same writer with the same settings; rendering alone is the export into a writer that takes everything. The runs
alternate, and the medians are compared. With a GPU the export is to be bound by the slower of the two; where the GL is
a software rasteriser, both want the same cores, and the best it can come to is 1 / (1 / encoder + 1 / rendering).
The last two columns are of processor time, of this process and of the encoder's: the work a frame takes, and the share
of it that is the encoder's. Other programs running beside disturb them least.
"""

from __future__ import annotations

import os
import resource
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from fractions import Fraction
from functools import partial
from pathlib import Path
from unittest.mock import patch

import numpy as np

from app.media.animation import AnimationOptions, animation_writer
from app.media.opening import open_recipe
from app.media.pictures import read_picture
from app.model.picture import Picture
from app.model.recipe import Output, Recipe
from app.progress import Progress
from app.work.export import run
from app.work.jobs import Job, Outputs
from solver.gl.device import Device

ROUNDS = 3
RATE = 30
ENDINGS = (".mp4", ".mov", ".%04d.png", ".webm", ".gif")


def encode(path: Path, frames: Iterable[np.ndarray]) -> None:
    """Feed frames that are there already to the writer the export uses, with the export's settings."""
    with animation_writer(path, Fraction(RATE), AnimationOptions(quality=90)) as write:
        for frame in frames:
            write(frame)


def main() -> None:
    side = int(sys.argv[1]) if len(sys.argv) > 1 else 1280
    wanted = int(sys.argv[2]) if len(sys.argv) > 2 else 60
    opened = open_recipe("coffee")
    source = opened.source().picture
    dt = opened.recipe.fluid.dt
    recipe = opened.recipe.edited(output=Output(size=side, fps=RATE), duration=max(dt, (wanted - 1) / RATE))
    device = Device.headless()
    print(f"{device.limits.renderer}, {os.cpu_count()} cores, {side} pixels, {wanted} frames")
    print("| output | encoder, frames/s | rendering | export | export / encoder | / in turns | CPU ms | encoder's |")
    print("|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        frames = rendered(device, recipe, source, opened.folder, Path(folder))
        for ending in ENDINGS:
            job = Job(recipe, source, opened.folder, Outputs(Path(folder) / f"b{ending}"))
            works = (
                partial(encode, Path(folder) / f"a{ending}", frames),
                partial(render, device, job),
                partial(run, device, job, Progress()),
            )
            rates: list[list[float]] = [[], [], []]
            costs: list[list[float]] = [[], [], []]
            for _ in range(ROUNDS):
                for do, found, spent in zip(works, rates, costs, strict=True):
                    started, busy = time.perf_counter(), processor_time()
                    do()
                    found.append(len(frames) / (time.perf_counter() - started))
                    spent.append((processor_time() - busy) / len(frames))
            encoder, rendering, export = map(statistics.median, rates)
            encoding, _, exporting = map(statistics.median, costs)
            turns = 1 / (1 / encoder + 1 / rendering)
            shares = (
                f"{export / encoder:.0%} | {export / turns:.0%} | {exporting * 1e3:.0f} | {encoding / exporting:.0%}"
            )
            print(f"| `{ending}` | {encoder:.1f} | {rendering:.1f} | {export:.1f} | {shares} |", flush=True)
    device.release()


def processor_time() -> float:
    """Seconds of the processor that this process and the encoders it ran have taken."""
    spent = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in spent)


@contextmanager
def nowhere(*_: object, **__: object) -> Iterator[Callable[[np.ndarray, int], None]]:
    """A writer that takes everything at once."""
    yield lambda frame, number: None


def render(device: Device, job: Job) -> None:
    """The export without its writer."""
    with patch("app.work.export.animation_writer", nowhere):
        run(device, job, Progress())


def rendered(device: Device, recipe: Recipe, source: Picture, folder: Path, target: Path) -> list[np.ndarray]:
    """The animation's frames in memory."""
    run(device, Job(recipe, source, folder, Outputs(target / "f.%04d.png")), Progress())
    return [read_picture(path).pixels for path in sorted(target.glob("f.*.png"))]


if __name__ == "__main__":
    main()

"""How well handles arrive: random arrangements without contradiction, beside a thin-plate spline of the same points.

`python tests/benchmarks/bench_handles.py --seeds 100`; the figures are in pixels of a picture of 512 x 512.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the program does, before NumPy is loaded

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[2]))

from solver.gl.device import Device
from support.leading import arrangement, distortion, led, spline


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--handles", type=int, nargs="*", default=[1, 4, 16])
    arguments = parser.parse_args()
    with Device.headless() as device:
        for count in arguments.handles:
            failed, rows, folded = [], [], [0, 0]
            for seed in interruptible(range(arguments.first, arguments.first + arguments.seeds)):
                points, targets, pins = arrangement(seed, count)
                found = led(device, points, targets, pins, seed=seed)
                other = spline(points, targets, pins)
                mine, theirs = distortion(found.displacement), distortion(other)
                folded[0] += found.folds > 0 or mine.least <= 0
                folded[1] += theirs.least <= 0
                rows.append((found.error, found.drift, found.pins, found.det, *mine, *theirs))
                if not found.is_within:
                    failed.append(seed)
                    print(f"  {count} handles, seed {seed}: {found.told}", flush=True)
            worst = np.array(rows)
            print(f"{count} handles, {len(rows)} seeds: {len(rows) - len(failed)} within bounds, not {failed}")
            print(
                f"  worst error {worst[:, 0].max():.4f} px, drift {worst[:, 1].max():.4f} px/s, "
                f"pins {worst[:, 2].max():.4f} px, least det J {worst[:, 3].min():.3f}"
            )
            for name, first, folds in (("handles", 4, folded[0]), ("spline", 7, folded[1])):
                mean, percentile, least = worst[:, first : first + 3].T
                print(
                    f"  {name}: {folds} folded; distortion mean {mean.mean():.3f}, 99th percentile "
                    f"{percentile.mean():.2f} (worst {percentile.max():.2f}), least det J {least.min():.3f}",
                    flush=True,
                )


def interruptible(seeds: range) -> Iterator[int]:
    """The seeds until Ctrl+C: what has been made by then is told."""
    asked: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, frame: asked.append(number))
    for seed in seeds:
        yield seed
        if asked:
            break
    signal.signal(signal.SIGINT, before)


if __name__ == "__main__":
    main()

"""How well pairs are fitted: ten held cases of six pairs on a picture of 512 x 512, beside a thin-plate spline.

`python tests/benchmarks/bench_fitting.py`. The errors are of the fitted recipe, replayed from its text, in pixels; the
seconds are processor time of all threads, which two idle cores do in half of them at best.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the program does, before NumPy is loaded

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[2]))

from app.media.auxiliary import Pictures
from app.media.landmarks import Pairs
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.progress import Progress
from app.work.fitting import EVALUATIONS, Fit
from app.work.replay import Replay
from solver.gl.device import Device
from solver.warp.inverse import ForwardMap
from support.leading import PIXELS, arrangement, distortion, spline

FIRST = 2000  # of the seeds, none of which was looked at while it was made
NO_PINS = np.zeros((0, 2))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=10)
    parser.add_argument("--pairs", type=int, default=6)
    parser.add_argument("--evaluations", type=int, default=EVALUATIONS)
    arguments = parser.parse_args()
    picture = Picture(np.zeros((PIXELS, PIXELS, 3), np.uint8))
    print(
        "| case | mean, largest error | folds | least det J | work | distortion, spline's | least det, spline's | s |"
    )
    with Device.headless() as device:
        for seed in range(FIRST, FIRST + arguments.cases):
            points, targets, _ = arrangement(seed, arguments.pairs, 0)
            pairs, began = np.stack([points, targets], axis=1), time.process_time()
            fit = Fit(Recipe(), picture, Path(), Pairs.points(pairs), arguments.evaluations)
            found = fit.perform(device, Progress())
            spent = time.process_time() - began
            recipe = Recipe.parse(found.trial.recipe.text())
            replay = Replay(device, recipe, Pictures(picture), budget=0)
            replay.seek(recipe.ticks)
            with ForwardMap(replay.warp) as forward:
                errors = np.hypot(*(points + forward.at(points) - targets).T) * PIXELS
            statistics = replay.warp.statistics((PIXELS, PIXELS))
            mine = distortion(replay.warp.read((PIXELS, PIXELS)))
            theirs = distortion(spline(points, targets, NO_PINS))
            replay.release()
            print(
                f"| {seed} | {errors.mean():.3f}, {errors.max():.3f} | {statistics.folds} | {statistics.det_min:.3f} | "
                f"{found.trial.work:.3f} | {mine.mean:.3f} {mine.percentile:.2f}, {theirs.mean:.3f} "
                f"{theirs.percentile:.2f} | {mine.least:.3f}, {theirs.least:.3f} | {spent:.0f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()

"""The retouching jobs in windows, against the same strokes on cells as small over the whole picture.

`python tests/benchmarks/bench_retouching.py`; the difference is how far apart the 6000 x 4000 pixels of the photograph
are looked up. The whole picture has a grid of the finest window's cells, up to 776,000 of them, and takes minutes.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from app.gallery.retouching import JOBS, PHOTOGRAPH
from app.gallery.studio import Studio, load
from app.model.recipe import Recipe
from app.progress import Progress
from solver.gl.device import Device

MOVED = 0.05  # pixels


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("jobs", nargs="*", default=list(JOBS), help="of the gallery")
    parser.add_argument("--smaller", type=int, default=1, help="times smaller the photograph is, and its map")
    arguments = parser.parse_args()
    with Device.headless() as device:
        studio = Studio(device, Path(), Progress())
        for name in arguments.jobs:
            recipe = load(name)
            detail = max(stroke.detail for stroke in recipe.stroke)
            windows, whole = (looked_up(studio, each, arguments.smaller) for each in (recipe, recipe.on_grid(detail)))
            off, moved = (np.linalg.norm(values, axis=-1) for values in (windows - whole, whole))
            there = off[np.maximum(off, moved) > MOVED]
            print(
                f"{name}, {detail} cells: {moved.max():.2f} px at most, off by {off.max():.3f}, "
                f"99 of 100 that move by {np.percentile(there, 99):.3f}, median {np.median(there):.4f}",
                flush=True,
            )


def looked_up(studio: Studio, recipe: Recipe, smaller: int) -> np.ndarray:
    """How far from itself each pixel of the photograph is looked up in the end, (h, w, 2), its pixels."""
    width, height = (side // smaller for side in PHOTOGRAPH)
    with studio.played(recipe, np.zeros((height, width, 3), np.uint8)) as replay:
        return replay.warp.read((width, height)) * PHOTOGRAPH[0]


if __name__ == "__main__":
    main()

"""Do strokes of Water fold a poster? `python tests/benchmarks/bench_posters.py [--strokes 200] [--seeds 0 1 2]`

For each seed, random pushes one after another on a picture of 2000 x 1600 pixels, on the editor's automatic grid, and
three seconds in which the fluid comes to rest. Folds are looked for at every eighth tick, at all texels of the map.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
import tomlkit

sys.path.insert(0, str(Path(__file__).parents[2]))
sys.path.insert(0, str(Path(__file__).parents[1]))

from app.media.auxiliary import Pictures
from app.model.presets import WATER
from app.model.recipe import Recipe
from app.work.replay import Replay
from solver.gl.device import Device
from support.editing import pattern

SIZE = 2000, 1600
GRID = 96
DT = 1 / 60
EVERY = 8


def stirred(strokes: int, seed: int) -> Recipe:
    """Straight pushes anywhere, .1 to .5 of the longer side long, in 10 to 40 ticks, with brushes of .03 to .12."""
    dice = np.random.default_rng(seed)
    tick, pushes = 0, []
    for _ in range(strokes):
        start, angle, length = dice.uniform(0, 1, 2), dice.uniform(0, 2 * np.pi), dice.uniform(0.1, 0.5)
        count = int(dice.integers(10, 41))
        places = start + np.linspace(0, length, count)[:, None] * [np.cos(angle), np.sin(angle)]
        samples = [[tick + number, *place, 1.0] for number, place in enumerate(np.clip(places, 0, 1).round(4).tolist())]
        pushes.append({"tool": "push", "radius": round(dice.uniform(0.03, 0.12), 4), "samples": samples})
        tick += count
    fluid = {"grid": GRID, "dt": DT, "viscosity": WATER.viscosity, "drag": WATER.drag}
    return Recipe.parse(tomlkit.dumps({"version": 5, "duration": tick * DT + 3, "fluid": fluid, "stroke": pushes}))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--strokes", type=int, default=200)
    parser.add_argument("--seeds", type=int, nargs="*", default=[0, 1, 2])
    arguments = parser.parse_args()
    with Device.headless() as device:
        for seed in arguments.seeds:
            recipe = stirred(arguments.strokes, seed)
            replay = Replay(device, recipe, Pictures(pattern(*SIZE), Path()))
            folds, least, most = 0, np.inf, -np.inf
            for tick in range(recipe.ticks):
                replay.advance()
                if tick % EVERY == EVERY - 1 or tick == recipe.ticks - 1:
                    found = replay.warp.statistics()
                    folds = max(folds, found.folds)
                    least, most = min(least, found.det_min), max(most, found.det_max)
            print(
                f"seed {seed}: {recipe.ticks} ticks, {folds} texels folded at most, det J {least:.2f} to {most:.2f}, "
                f"{found.displacement_max * max(SIZE):.0f} px in the end",
                flush=True,
            )
            replay.release()


if __name__ == "__main__":
    main()

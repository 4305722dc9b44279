"""Strokes as a hand makes them, slow and quick, over masks and across the edge: they fold nothing."""

from __future__ import annotations

from typing import Any

import numpy as np

from properties.led import DT, FEELS, played
from solver.gl.device import Device

CELLS = 48


def _path(rng: np.random.Generator, radius: float, fast: float) -> np.ndarray:
    """Places (n, 2) of a line, a bow or a zigzag of 2 to 10 radii, `fast` radii apart."""
    length = radius * rng.uniform(2, 10)
    count = max(int(np.ceil(length / (fast * radius))) + 1, 2)
    heading = rng.uniform(0, 2 * np.pi) + np.linspace(0, rng.choice([0.0, rng.uniform(-3, 3)]), count - 1)
    steps = length / (count - 1) * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    if rng.random() < 0.3:  # to and fro
        steps *= np.where(np.arange(count - 1) * fast // 2 % 2, -1.0, 1.0)[:, None]
    return rng.uniform(0.0, 1.0, 2) + np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])


def random_strokes(seed: int) -> dict[str, Any]:
    """One to three strokes of 3 to 12 cells, each of .1 to 8 radii a tick, maybe over something thick or frozen."""
    rng = np.random.default_rng(seed)
    viscosity, drag = FEELS[seed % len(FEELS)]
    strokes, tick = list[dict[str, Any]](), 0
    for tool in ("thicken", "freeze"):
        if rng.random() < 0.3:
            at = rng.uniform(0, 1, 2).round(4).tolist()
            strokes.append({"tool": tool, "radius": round(rng.uniform(0.05, 0.2), 4), "samples": [[0, *at, 1.0]]})
    for _ in range(int(rng.integers(1, 4))):
        radius = float(np.exp(rng.uniform(np.log(3), np.log(12)))) / CELLS
        path = _path(rng, radius, float(np.exp(rng.uniform(np.log(0.1), np.log(8)))))
        samples = [[tick + 1 + number, *place, 1.0] for number, place in enumerate(path.round(4).tolist())]
        stroke = {"tool": "push", "radius": round(radius, 4), "hardness": round(rng.uniform(0, 1), 3)}
        strokes.append(stroke | {"local": float(rng.choice([0, 0, 0.5, 1])), "samples": samples})
        tick += len(path)
    fluid = {"grid": CELLS, "dt": DT, "viscosity": viscosity, "drag": drag}
    return {"version": 5, "duration": round((tick + 12) * DT, 4), "fluid": fluid, "stroke": strokes}


def check_strokes_fold_nothing(device: Device, seed: int) -> dict[str, float]:
    """No place folds under pushes of any speed, nor in the fifth of a second after them."""
    folds, least, first = played(device, random_strokes(seed), (CELLS * 8, CELLS * 6))
    assert not folds, f"{folds} places fold, the first at tick {first}, least det J {least:.3f}"
    return {"least det J, from 1": 1 - least}

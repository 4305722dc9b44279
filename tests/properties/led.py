"""Recipes as people make them, with handles among everything else: they fold nothing but what folds without them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from app.media.auxiliary import Pictures
from app.model.recipe import Recipe
from app.work.replay import Replay
from solver.gl.device import Device
from support.editing import pattern

DT = 1 / 60
MOST_TICKS = 96
FEELS = [(0.001, 0.0), (0.01, 0.5), (0.1, 3.0), (1.0, 12.0)]  # viscosity, drag


def _place(rng: np.random.Generator, margin: float = 0.03) -> list[float]:
    return rng.uniform(margin, 1 - margin, 2).round(4).tolist()


def _line(rng: np.random.Generator, led: dict[str, Any]) -> None:
    """Give a handle or a pin a line or an outline about its place."""
    closed, count, size = bool(rng.random() < 0.5), int(rng.integers(3, 9)), rng.uniform(0.04, 0.2)
    angle = rng.uniform(0, 2 * np.pi)
    if closed:
        angles = angle + (rng.uniform(0, 0.8, count) + np.arange(count)) * 2 * np.pi / count
        corners = led["at"] + size * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    else:
        along = np.linspace(-size, size, count)[:, None] * [np.cos(angle), np.sin(angle)]
        corners = led["at"] + along + rng.normal(0, 0.1 * size, (count, 2))
    led |= {"points": corners.round(4).tolist(), "closed": closed}


def random_handle(rng: np.random.Generator, seconds: float) -> dict[str, Any]:
    """A point, a line or an outline, which goes somewhere, on, turns and grows."""
    handle: dict[str, Any] = {
        "at": _place(rng),
        "radius": round(float(np.exp(rng.uniform(np.log(0.04), np.log(0.35)))), 4),
    }
    if rng.random() < 0.35:
        _line(rng, handle)
    way, angle = handle["radius"] * rng.uniform(0.3, 1.5), rng.uniform(0, 2 * np.pi)
    handle["to"] = (np.array(handle["at"]) + way * np.array([np.cos(angle), np.sin(angle)])).round(4).tolist()
    handle["duration"] = round(rng.uniform(0.1, 0.6) * seconds, 3)
    if rng.random() < 0.3:
        handle["start"] = round(rng.uniform(0, 0.4) * seconds, 3)
    ready = handle.get("start", 0.0) + handle["duration"]
    if rng.random() < 0.3:
        on = (np.array(handle["to"]) + 0.7 * way * rng.uniform(-1, 1, 2)).round(4).tolist()
        handle["keys"] = [[round(ready + rng.uniform(0.1, 0.4) * seconds, 3), *on]]
    if rng.random() < 0.3:
        handle |= {"rotate": round(rng.uniform(-90, 90), 1), "scale": round(float(np.exp(rng.uniform(-0.5, 0.5))), 3)}
    if rng.random() < 0.5:
        handle["local"] = round(float(rng.choice([rng.uniform(0, 1), 1.0])), 3)
    if rng.random() < 0.15:
        handle["stiffness"] = round(float(np.exp(rng.uniform(-4, 0))), 4)
    if rng.random() < 0.1:
        handle["end"] = round(ready, 3)
    return handle


def _stroke(rng: np.random.Generator, tool: str, first: int, ticks: int) -> dict[str, Any]:
    start, end = (np.array(_place(rng, 0.0)) for _ in range(2))
    end = start + (end - start) * min(1.0, 0.3 / max(np.hypot(*(end - start)), 1e-9))
    samples = [
        [first + tick, *(start + (end - start) * tick / max(ticks - 1, 1)).round(4).tolist(), 1.0]
        for tick in range(ticks)
    ]
    radius = round(float(np.exp(rng.uniform(np.log(0.02), np.log(0.2)))), 4)
    return {"tool": tool, "radius": radius, "hardness": round(rng.uniform(0, 1), 3), "samples": samples}


def random_recipe(rng: np.random.Generator) -> dict[str, Any]:
    """One to six handles among pins, thick and frozen places, pushes and a vortex."""
    ticks = int(rng.integers(24, MOST_TICKS))
    seconds = ticks * DT
    viscosity, drag = FEELS[int(rng.integers(len(FEELS)))]
    recipe: dict[str, Any] = {
        "version": 5,
        "duration": round(seconds, 4),
        "fluid": {"grid": int(rng.choice([32, 48])), "dt": DT, "viscosity": viscosity, "drag": drag},
        "handle": [random_handle(rng, seconds) for _ in range(int(rng.integers(1, 7)))],
    }
    pins = []
    for _ in range(int(rng.integers(0, 3))):
        pin: dict[str, Any] = {"at": _place(rng), "radius": round(rng.uniform(0.05, 0.3), 3)}
        if rng.random() < 0.3:
            _line(rng, pin)
        pins.append(pin)
    if pins:
        recipe["pin"] = pins
    strokes = []
    for tool in ("thicken", "freeze"):
        strokes += [_stroke(rng, tool, 0, int(rng.integers(1, 12))) for _ in range(int(rng.integers(0, 3)))]
    for _ in range(int(rng.integers(0, 3))):
        first = int(rng.integers(0, ticks - 10))
        strokes.append(
            _stroke(rng, str(rng.choice(["push", "push", "twirl", "bloat"])), first, int(rng.integers(4, 11)))
        )
    if strokes:
        recipe["stroke"] = sorted(strokes, key=lambda stroke: stroke["samples"][0][0])
    if rng.random() < 0.2:
        vortex = {"kind": "vortex", "point": _place(rng), "radius": 0.2, "strength": round(rng.uniform(-2, 2), 2)}
        recipe["force"] = [vortex]
    return recipe


def played(device: Device, data: dict[str, Any], aspect: tuple[int, int]) -> tuple[int, float, int]:
    """The most places that fold at once, the least det J, and the first tick that folds or -1, while it is played."""
    import tomlkit

    recipe = Recipe.parse(tomlkit.dumps(data))
    worst, least, first = 0, np.inf, -1
    replay = Replay(device, recipe, Pictures(pattern(*aspect), Path()))
    try:
        for tick in range(recipe.ticks):
            replay.advance()
            if tick % 4 == 3 or tick == recipe.ticks - 1:
                found = replay.warp.statistics()
                worst, least = max(worst, found.folds), min(least, found.det_min)
                if found.folds and first < 0:
                    first = tick
        assert np.isfinite(replay.warp.read()).all()
        assert np.isfinite(replay.fluid.velocity_at_centres()).all()
    finally:
        replay.release()
    return worst, float(least), first


def scene(seed: int) -> tuple[dict[str, Any], tuple[int, int]]:
    """A recipe, and the size of its picture."""
    rng = np.random.default_rng(seed)
    recipe = random_recipe(rng)
    texels = recipe["fluid"]["grid"] * int(rng.choice([4, 8]))
    return recipe, [(texels, texels), (texels, 3 * texels // 4), (3 * texels // 4, texels)][int(rng.integers(3))]


def beside_frozen(seed: int) -> dict[str, Any]:
    """One or two handles beside a disc at the picture's edge that is frozen and smaller than a cell."""
    rng = np.random.default_rng(seed)
    viscosity, drag = FEELS[seed % len(FEELS)]
    along, side, off = rng.uniform(0.2, 0.8), int(rng.integers(4)), rng.uniform(0, 0.02)
    at = [[along, off], [along, 1 - off], [off, along], [1 - off, along]][side]
    disc = {"tool": "freeze", "radius": float(rng.uniform(0.004, 0.02)), "hardness": 0.9, "samples": [[0, *at, 1.0]]}
    handles = []
    for _ in range(int(rng.integers(1, 3))):
        place = np.clip(np.array(at) + rng.uniform(-0.12, 0.12, 2), 0.03, 0.97)
        angle, radius = rng.uniform(0, 6.3), rng.uniform(0.06, 0.25)
        way = radius * rng.uniform(0.3, 1.2) * np.array([np.cos(angle), np.sin(angle)])
        ends = {"at": place.round(4).tolist(), "to": (place + way).round(4).tolist()}
        handles.append(
            {**ends, "radius": round(radius, 4), "duration": 0.3, "local": float(rng.choice([0, 0, 1, 0.5]))}
        )
    fluid = {"grid": 32, "dt": DT, "viscosity": viscosity, "drag": drag}
    return {"version": 5, "duration": 0.6, "fluid": fluid, "stroke": [disc], "handle": handles}


def check_handles_beside_frozen(device: Device, seed: int) -> dict[str, float]:
    """No place folds beside a small frozen disc at the picture's edge, where nothing but handles moves anything."""
    folds, least, first = played(device, beside_frozen(seed), (128, 128))
    assert not folds, f"{folds} places fold, the first at tick {first}, least det J {least:.3f}"
    return {"least det J, from 1": 1 - least}


def _handles_only(recipe: dict[str, Any]) -> dict[str, Any]:
    """What is thick and frozen stays; no other stroke and no force moves anything."""
    kept = [stroke for stroke in recipe.get("stroke", []) if stroke["tool"] in ("thicken", "freeze")]
    return {key: value for key, value in recipe.items() if key not in ("stroke", "force")} | {"stroke": kept}


def check_handles_fold_nothing(device: Device, seed: int) -> dict[str, float]:
    """No place folds, unless it does without the handles, too."""
    recipe, size = scene(seed)
    folds, least, first = played(device, recipe, size)
    if folds:
        without = {key: value for key, value in recipe.items() if key not in ("handle", "pin")}
        alone, alone_least, _ = played(device, without, size)
        told = f"{folds} places fold, the first at tick {first}, least det J {least:.3f}"
        if not alone:  # whose fold it is: of the handles, of what else moves beside them, or of both
            by_handles, by_handles_least, _ = played(device, _handles_only(recipe), size)
            told += f"; without handles {alone_least:.3f}, by handles only {by_handles_least:.3f} ({by_handles} places)"
            raise AssertionError(told)
        return {"folded without handles": 1.0}
    return {"least det J, from 1": 1 - least}


def quick_push(seed: int) -> dict[str, Any]:
    """One push of a brush of one cell to three, one to two and a half of its radii a tick."""
    rng = np.random.default_rng(seed)
    (viscosity, drag), grid, ticks = FEELS[seed % len(FEELS)], int(rng.choice([32, 48])), int(rng.integers(4, 9))
    radius, angle = rng.uniform(1, 3) / grid, rng.uniform(0, 2 * np.pi)
    way = min(rng.uniform(1, 2.5) * radius * (ticks - 1), 0.6) * np.array([np.cos(angle), np.sin(angle)])
    start = rng.uniform(0.05, 0.95, 2)
    start = np.clip(start, 0.05 - np.minimum(way, 0), 0.95 - np.maximum(way, 0))
    samples = [[tick, *(start + way * tick / (ticks - 1)).round(4).tolist(), 1.0] for tick in range(ticks)]
    stroke = {"tool": "push", "radius": round(radius, 4), "hardness": round(rng.uniform(0, 1), 3), "samples": samples}
    fluid = {"grid": grid, "dt": DT, "viscosity": viscosity, "drag": drag}
    return {"version": 5, "duration": 0.4, "fluid": fluid, "stroke": [stroke]}


def check_quick_push(device: Device, seed: int) -> dict[str, float]:
    """No place folds where a step bends the submap farther than it may be bent."""
    recipe = quick_push(seed)
    texels = 8 * recipe["fluid"]["grid"]
    folds, least, first = played(device, recipe, (texels, texels))
    assert not folds, f"{folds} places fold, the first at tick {first}, least det J {least:.3f}"
    return {"least det J, from 1": 1 - least}

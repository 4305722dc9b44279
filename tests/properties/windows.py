"""Flows solved in windows of their own: played, sought or gone on with from any moment, they are the same bytes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from app.media.auxiliary import Pictures
from app.model.handles import RecipeHandle, RecipePin
from app.model.picture import Picture
from app.model.presets import HONEY, PUTTY, WATER, Feel
from app.model.recipe import FluidSettings, Recipe
from app.model.strokes import Stroke
from app.model.windows import FlowWindow, with_detail
from app.work.replay import Replay
from solver.gl.device import Device

EDITORS = 1 / 30  # seconds of a tick of the editor: each goes twice as far as one of a recipe


def painted(*strokes: Stroke, feel: Feel = PUTTY, cells: int = 64, ticks: int = 60, dt: float = 1 / 60) -> Recipe:
    fluid = FluidSettings(grid=cells, dt=dt, viscosity=feel.viscosity, drag=feel.drag)
    return Recipe(fluid=fluid, stroke=strokes, duration=ticks * dt)


def same(found: dict[str, np.ndarray], wanted: dict[str, np.ndarray]) -> None:
    assert found.keys() == wanted.keys()
    for name, array in wanted.items():
        np.testing.assert_array_equal(found[name], array, name)


def compare_paths(
    device: Device, recipe: Recipe, size: tuple[int, int], rng: np.random.Generator, less: Callable[[], dict[str, Any]]
) -> tuple[set[FlowWindow | None], int]:
    """Played, sought, with `less` of it for a while or gone on from a moment, it is the same; its windows and folds."""
    pictures = Pictures(Picture(np.zeros((size[1], size[0], 3), np.uint8)))
    plain, other = (Replay(device, recipe, pictures, budget) for budget in (0, 2**28))
    moments, windows = {}, set()
    asked = [(int(rng.integers(recipe.ticks + 1)), int(rng.integers(recipe.ticks))) for _ in range(2)]  # of each recipe
    looked_at = {tick for sought, start in asked for tick in (sought, start, start + 1)}
    for tick in range(recipe.ticks + 1):
        plain.seek(tick)
        windows.add(plain.window)
        if tick in looked_at:
            moments[tick] = plain.snapshot()
    assert np.isfinite(plain.warp.read()).all()
    for tick, start in asked:
        other.seek(tick)
        same(other.snapshot(), moments[tick])
        assert len(other.handles.halts) == len(recipe.handle) + len(recipe.pin)  # looking changes nothing
        other.use(recipe.edited(**less()))
        other.use(recipe)
        same(other.snapshot(), moments[tick])
        other.resume(start, moments[start])
        other.advance()
        same(other.snapshot(), moments[start + 1])
    folds = plain.warp.statistics().folds
    for item in (plain, other):
        item.release()
    return windows, folds


def check_handles_in_windows(device: Device, seed: int) -> dict[str, float]:
    """With strokes, masks, lines, turns and what is local among them; some on the whole picture, on any shape."""
    rng = np.random.default_rng(seed)
    size = [(600, 400), (400, 600), (900, 150), (300, 300)][seed % 4]
    extent = np.array(size) / max(size)
    ticks, handles, pins, strokes = 24, [], [], []
    for _ in range(int(rng.integers(2, 6))):
        radius, at_ = float(rng.uniform(0.015, 0.05)), rng.uniform(0.1, 0.9, 2)
        to = np.clip(at_ + rng.uniform(-1, 1, 2) * radius / extent, 0, 1)
        more: dict[str, Any] = {"start": float(rng.choice([0.0, 0.2, 0.4])), "duration": 0.3}
        if rng.random() < 0.3:
            more |= {"rotate": 30.0, "scale": 1.2}
        if rng.random() < 0.3:
            more["points"] = [(at_ + part * radius / extent * [1, 0]).tolist() for part in (-1.0, 0.0, 1.0)]
            more["points"] = tuple(map(tuple, np.clip(more["points"], 0, 1).tolist()))
        if rng.random() < 0.4:
            more["local"] = float(rng.choice([0.5, 1.0]))
        if rng.random() < 0.3:
            more["end"] = 0.6
        handles.append(RecipeHandle(at=tuple(at_.tolist()), to=tuple(to.tolist()), radius=radius, **more))
    for _ in range(int(rng.integers(0, 3))):
        pins.append(RecipePin(at=tuple(rng.uniform(0, 1, 2).tolist()), radius=float(rng.uniform(0.02, 0.2))))
    for first in range(0, 20, 6):
        tool, radius = rng.choice(["push", "twirl", "bloat", "freeze", "thicken"]), float(rng.uniform(0.01, 0.05))
        places = rng.uniform(0.1, 0.9, 2) + np.array([[0.0], [radius]])
        samples = tuple((first + 2 * k, *place, 1.0) for k, place in enumerate(places.tolist()))
        strokes.append(Stroke.model_validate({"tool": tool, "radius": radius, "detail": 455, "samples": samples}))
    recipe = painted(*strokes, feel=[PUTTY, HONEY, WATER][seed % 3], cells=24, ticks=ticks, dt=EDITORS)
    given = ([with_detail(one, recipe, tuple(extent.tolist())) for one in each] for each in (handles, pins))
    recipe = recipe.edited(**dict(zip(("handle", "pin"), map(tuple, given), strict=True)))

    def less() -> dict[str, Any]:
        return {"handle": recipe.handle[:1], "stroke": recipe.stroke[: int(rng.integers(4))]}

    windows, folds = compare_paths(device, recipe, size, rng, less)
    assert windows != {None}
    assert folds == 0
    return {"windows": float(len(windows)), "folds": float(folds)}

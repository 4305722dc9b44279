"""Freeze strokes: what the ring shows is what is frozen, and the picture beneath keeps every bit from then on."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from app.media.auxiliary import Pictures
from app.model.picture import Picture
from app.model.recipe import FluidSettings, Recipe
from app.model.strokes import Stroke
from app.model.windows import detail_for
from app.work.replay import Replay
from solver.gl.device import Device
from solver.resample.sampler import Sampler

WIDTH, HEIGHT = 6000, 400
RADIUS = 0.02


def drag(first: int, last: int, start: float, end: float) -> tuple[tuple[float, ...], ...]:
    return tuple((t, start + (end - start) * (t - first) / (last - first), 0.5, 1.0) for t in range(first, last + 1))


def test_the_picture_beneath_a_frozen_stroke_keeps_every_bit_up_to_the_ring(device: Device) -> None:
    pixels = np.random.default_rng(1).integers(0, 256, (HEIGHT, WIDTH, 3), np.uint8)
    strokes = [
        {"tool": "push", "samples": drag(0, 8, 0.36, 0.4), "radius": 0.03},
        {"tool": "freeze", "samples": drag(9, 12, 0.38, 0.4), "radius": RADIUS, "hardness": 0.3},
        {"tool": "push", "samples": drag(14, 24, 0.34, 0.44), "radius": 0.03},
    ]
    recipe = Recipe.parse(
        'version = 1\npicture = "noise.png"\nduration = 0.5\n[fluid]\ngrid = 256\nviscosity = 2e-3\ndrag = 10'
    )
    recipe = recipe.edited(stroke=tuple(Stroke.model_validate(stroke) for stroke in strokes))
    replay, sampler = Replay(device, recipe, Pictures(Picture(pixels)), budget=0), Sampler(device)
    replay.seek(14)
    before = sampler.apply(replay.warp, pixels)
    replay.seek(26)
    after = sampler.apply(replay.warp, pixels)
    row, column = np.mgrid[0:HEIGHT, 0:WIDTH] + 0.5
    ring = np.hypot(np.clip(column, 0.38 * WIDTH, 0.4 * WIDTH) - column, 0.5 * HEIGHT - row) - RADIUS * WIDTH
    np.testing.assert_array_equal(after[ring < -1], before[ring < -1])
    assert (before != pixels)[ring < -1].mean() > 0.3, "what had moved before it was frozen"
    assert (after != before)[(ring > 0) & (ring < RADIUS * WIDTH)].mean() > 0.5, "what is not frozen moves"
    frozen = replay.masks.frozen.get() >= 128
    assert frozen[ring < -1].all()
    assert not frozen[ring > 1].any()
    sampler.release()
    replay.release()


def wandering(rng: np.random.Generator, tool: str, first: int, last: int, radius: float) -> Stroke:
    """A straight stroke between two places about the middle."""
    (x0, y0), (x1, y1) = rng.uniform(0.4, 0.6, (2, 2)).tolist()
    parts = np.linspace(0, 1, last - first + 1).tolist()
    samples = tuple((first + n, x0 + (x1 - x0) * p, y0 + (y1 - y0) * p, 1.0) for n, p in enumerate(parts))
    return Stroke.model_validate({"tool": tool, "samples": samples, "radius": radius, "hardness": rng.uniform()})


@pytest.mark.parametrize(
    ("size", "seed", "grid"),
    [((320, 240), 1, 48), ((320, 240), 2, 96), ((301, 193), 1, 48), ((97, 400), 1, 48), ((1500, 40), 2, 48)],
)
def test_what_is_frozen_while_it_moves_keeps_every_bit(
    size: tuple[int, int], seed: int, grid: int, device: Device
) -> None:
    """Strokes at random: no pixel of the result, and no place of the map between the texels, changes by a bit."""
    (width, height), rng = size, np.random.default_rng([*size, seed])
    pixels = rng.integers(0, 256, (height, width, 3), np.uint8)
    strokes = (
        wandering(rng, "push", 0, 8, 0.15),
        wandering(rng, "freeze", 6, 10, rng.uniform(0.03, 0.1)),
        wandering(rng, "push", 9, 20, 0.15),
        wandering(rng, "freeze", 14, 16, 0.05),
        wandering(rng, "twirl", 20, 24, 0.12),
    )
    recipe = Recipe.parse(f'version = 1\npicture = "noise.png"\nduration = 1.0\n[fluid]\ngrid = {grid}')
    replay = Replay(device, recipe.edited(stroke=strokes), Pictures(Picture(pixels)), budget=0)
    sampler, points = Sampler(device), rng.random((4000, 2))
    column, row = (points * size).astype(int).T
    under = np.zeros(4000, bool)
    frozen, before, there, kept = np.zeros((height, width), bool), pixels, np.zeros((4000, 2)), 0
    for _ in range(30):
        replay.advance()
        now, at = sampler.apply(replay.warp, pixels), replay.warp.at(points * replay.grid.extent)
        np.testing.assert_array_equal(now[frozen], before[frozen])
        np.testing.assert_array_equal(at[under], there[under])
        kept += np.count_nonzero((now != pixels).any(axis=-1) & frozen)
        if replay.masks.frozen.size == replay.masks.canvas.size:
            finer = replay.masks.canvas.nx // width
            texels = replay.masks.frozen.get() >= 128
            frozen = np.asarray(texels.reshape(height, finer, width, finer).all(axis=(1, 3)))
            under = frozen[row, column]
        before, there = now, at
    assert kept > 1000, "what had moved before it was frozen"
    sampler.release()
    replay.release()


PUTTY, WATER = {"viscosity": 0.3, "local": 1.0}, {"viscosity": 0.0065, "local": 0.0}


@pytest.mark.parametrize(
    ("size", "grid", "detail", "feel", "seed", "frozen_first"),
    [
        ((640, 480), 48, 0, WATER, 0, True),
        ((640, 480), 48, 0, WATER, 0, False),
        ((640, 480), 96, 0, PUTTY, 0, False),
        ((1600, 1000), 24, 0, WATER, 1, True),
        ((1600, 1000), 64, 0, PUTTY, 1, False),
        ((900, 600), 48, 455, PUTTY, 2, True),
        ((900, 600), 48, 1079, WATER, 3, False),
    ],
)
def test_at_the_ring_the_map_has_no_step(
    size: tuple[int, int],
    grid: int,
    detail: int,
    feel: dict[str, float],
    seed: int,
    frozen_first: bool,
    device: Device,
) -> None:
    """Frozen at random, pushed at random, over the whole picture and in windows: a 256th of a texel beside a place
    that is held the map is a tenth of a texel off at most."""
    rng, radius = np.random.default_rng([grid, seed]), 6.8 / detail * 2 if detail else 0.1
    middle = rng.uniform(0.4, 0.6, 2)

    def stroke(tool: str, first: int, last: int, **how: float) -> Stroke:
        start, end = (middle + rng.uniform(-1.5 * radius, 1.5 * radius, (2, 2))).tolist()
        return Stroke.model_validate({"tool": tool, "samples": ((first, *start, 1.0), (last, *end, 1.0)), **how})

    early, late = (0, 6) if frozen_first else (6, 0)
    strokes = [
        stroke("freeze", early + n, early + n + 4, radius=radius * rng.uniform(0.2, 1), hardness=rng.uniform())
        for n in range(2)
    ]
    strokes += [
        stroke("push", late + 10 * n, late + 10 * n + 9, radius=radius, local=feel["local"], detail=detail)
        for n in range(3)
    ]
    recipe = Recipe.parse('version = 1\npicture = "none.png"\nduration = 1.0')
    fluid = recipe.fluid.model_copy(update={"grid": grid, "viscosity": feel["viscosity"], "drag": 0.0})
    recipe = recipe.edited(fluid=fluid, stroke=tuple(strokes))
    replay = Replay(device, recipe, Pictures(Picture(np.zeros((size[1], size[0], 3), np.uint8))), budget=0)
    for tick in (22, 45):
        replay.seek(tick)
        warp = replay.warp
        assert warp.held is not None
        held, texel = warp.held.get() >= 128, warp.extent[0] / warp.size[0]
        inner = np.asarray(ndimage.binary_erosion(held, np.ones((3, 3)), border_value=1), bool)
        ring = np.argwhere(held & ~inner)
        places = (ring[:, ::-1] + 0.5) * texel
        at = warp.at(places)
        for beside in np.array([(1, 0), (-1, 0), (0, 1), (0, -1)]) / 256:
            assert np.abs(warp.at(places + beside * texel) - at).max() < 0.1 * texel
    assert warp.statistics().displacement_max > 3 * texel
    replay.release()


@pytest.mark.parametrize("radius", [0.03, 0.04])
@pytest.mark.parametrize("past", [True, False])
def test_local_dabs_in_a_window_past_what_is_frozen_and_towards_it_fold_nothing(
    past: bool, radius: float, device: Device
) -> None:
    """Ten small ones about the same place: the picture is neither sheared nor torn at the ring."""
    rng, disc, size = np.random.default_rng(7), 1.5 * radius, (1500, 1000)
    strokes = [Stroke(tool="freeze", radius=disc, samples=((0, 0.5, 0.5, 1.0),))]
    recipe = Recipe(fluid=FluidSettings(grid=64, viscosity=0.3, drag=0.0), duration=1.0)
    detail = detail_for(radius, recipe, recipe.fluid)
    for first in range(2, 52, 5):
        turned, apart = rng.normal(0, 0.15), disc + radius * rng.uniform(0.1, 0.5)
        out = np.array([np.cos(turned), np.sin(turned)])
        way = 0.15 * radius * (np.array([-out[1], out[0]]) if past else -out)
        start, end = apart * out - way, apart * out + way
        (x0, y0), (x1, y1) = (0.5 + np.array([start, end]) * [1, 1.5]).tolist()
        samples = (first, x0, y0, 1.0), (first + 4, x1, y1, 1.0)
        strokes.append(Stroke(tool="push", radius=radius, detail=detail, local=1.0, samples=samples))
    replay = Replay(
        device, recipe.edited(stroke=tuple(strokes)), Pictures(Picture(np.zeros((*size[::-1], 3), np.uint8))), budget=0
    )
    replay.seek(recipe.ticks)
    assert replay.window is not None
    turned, apart = np.meshgrid(np.linspace(0, 2 * np.pi, 800), disc + np.linspace(0, radius, 80))
    ring = np.stack([0.5 + apart * np.cos(turned), 1 / 3 + apart * np.sin(turned)], axis=-1).reshape(-1, 2)
    assert replay.warp.determinants(ring).min() > 0
    assert replay.warp.statistics().displacement_max > radius
    replay.release()


@pytest.mark.parametrize(("size", "seed"), [((640, 480), 5), ((301, 193), 3), ((600, 400), 7)])
def test_the_map_goes_on_from_what_is_frozen_without_a_step(size: tuple[int, int], seed: int, device: Device) -> None:
    """Frozen while it moves, pushed and restored around: neighbours differ across the border as they do beside it."""
    rng = np.random.default_rng([*size, seed])
    strokes = (
        wandering(rng, "push", 0, 12, 0.15),
        wandering(rng, "freeze", 8, 12, 0.06),
        wandering(rng, "push", 16, 24, 0.12),
        wandering(rng, "restore", 13, 36, 0.12),
    )
    recipe = Recipe.parse('version = 1\npicture = "none.png"\nduration = 1.5\n[fluid]\ngrid = 48')
    pictures = Pictures(Picture(np.zeros((size[1], size[0], 3), np.uint8)))
    replay = Replay(device, recipe.edited(stroke=strokes), pictures, budget=0)
    replay.seek(10)
    frozen_before = replay.warp.read(replay.warp.size)
    replay.seek(40)
    displacement = replay.warp.read(replay.warp.size) * replay.warp.size[0]
    assert replay.warp.held is not None
    held = replay.warp.held.get() >= 128
    beside = np.asarray(ndimage.binary_dilation(held, iterations=12), bool) & ~held
    border, around = 0.0, 0.0
    for axis in (0, 1):
        jump = np.abs(np.diff(displacement, axis=axis)).max(axis=-1)
        first, second = (np.diff(mask.astype(int), axis=axis) for mask in (held, beside))
        border = max(border, jump[first != 0].max())
        around = max(around, jump[(second == 0) & np.delete(beside, 0, axis=axis)].max())
    assert border < 1.2 * around
    assert np.abs(frozen_before[held]).max() * replay.warp.size[0] > 0.3, "what had moved before it was frozen"
    replay.release()

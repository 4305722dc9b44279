"""A freeze stroke on a photograph of 6000 pixels: what its ring shows is what is frozen."""

from __future__ import annotations

import numpy as np

from app.media.auxiliary import Pictures
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.model.strokes import Stroke
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

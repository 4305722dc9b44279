"""Restoring on a picture whose cells are so many along its height that what is gathered would be too high a texture."""

from __future__ import annotations

import numpy as np

from app.media.auxiliary import Pictures
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.work.replay import Replay
from solver.gl.device import Device


def test_restoring_on_a_picture_of_a_few_columns_needs_no_texture_that_is_too_high(device: Device) -> None:
    pixels = np.random.default_rng(0).integers(0, 256, (3000, 8, 3), np.uint8)
    recipe = Recipe.parse("""
        version = 5
        [fluid]
        viscosity = 0.03
        [[stroke]]
        tool = "push"
        radius = 0.1
        samples = [[0, 0.5, 0.42, 1.0], [4, 0.5, 0.5, 1.0]]
        [[stroke]]
        tool = "twirl"
        radius = 0.05
        samples = [[5, 0.5, 0.45, 1.0], [45, 0.5, 0.45, 1.0]]
        [[stroke]]
        tool = "restore"
        radius = 0.05
        samples = [[46, 0.5, 0.45, 1.0], [50, 0.5, 0.45, 1.0]]
    """)
    replay = Replay(device, recipe, Pictures(Picture(pixels)), budget=0)
    replay.seek(46)
    before = np.abs(replay.warp.read()).mean()
    replay.seek(52)
    after = replay.warp.read()
    assert np.isfinite(after).all()
    assert np.abs(after).mean() < before
    replay.release()

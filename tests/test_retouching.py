"""The retouching jobs, on a photograph a fourth as wide, and the posters' recipes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from app.gallery import retouching
from app.gallery.studio import Studio, load, source_of
from app.model.presets import PUTTY, WATER
from app.model.strokes import Stroke
from app.progress import Progress
from solver.gl.device import Device


@pytest.mark.parametrize("name", retouching.JOBS)
def test_a_job_folds_nothing_and_moves_nothing_frozen_or_far_off(name: str, device: Device, tmp_path: Path) -> None:
    studio = Studio(device, tmp_path, Progress())
    numbers = retouching.retouch(studio, name, smaller=4)
    studio.release()
    assert numbers["folds"].startswith("0 of ")
    assert int(numbers["pixels changed"]) > 1000
    if name == "retouching-eye":
        assert int(numbers["pixels frozen"]) > 1000
        assert numbers["frozen pixels changed"] == "0"
    else:
        assert float(numbers["px beyond the sheet, most"]) < 0.05
    assert [path.name for path in tmp_path.iterdir()] == [f"{name}-sheet.png"]


@pytest.mark.parametrize("name", [*retouching.JOBS, *retouching.POSTERS])
def test_strokes_are_as_the_editor_records_them(name: str) -> None:
    recipe = load(name)
    assert source_of(recipe).ndim == 3
    is_poster = name in retouching.POSTERS
    assert (WATER if is_poster else PUTTY).fits(recipe.fluid)
    for stroke in recipe.stroke:
        assert (stroke.detail > recipe.fluid.grid) == (not is_poster and stroke.tool != "freeze")
        if stroke.tool == "push":
            assert stroke.local == (0 if is_poster else PUTTY.local)
    if name == "retouching-jaw":
        assert len(recipe.stroke) == 10


def test_a_photograph_has_the_portrait_in_its_middle() -> None:
    portrait = np.random.default_rng(0).integers(0, 256, (100, 100, 3), np.uint8)
    made = retouching.photograph(portrait, smaller=12)
    assert made.shape == (333, 500, 3)
    np.testing.assert_array_equal(made[116:216, 200:300], portrait)
    np.testing.assert_array_equal(made[116:216, 0], portrait[:, 0])


def test_what_a_ring_has_passed_over() -> None:
    stroke = Stroke(tool="freeze", radius=0.06, samples=((0, 0.3, 0.5, 1.0), (1, 0.7, 0.5, 1.0)))
    passed = retouching.beneath(stroke, (100, 60))
    row, column = np.nonzero(passed)
    assert (row.min(), row.max(), column.min(), column.max()) == (25, 34, 25, 74)
    assert passed[30, 25:75].all()
    assert not passed[25, 25], "its ends are round"

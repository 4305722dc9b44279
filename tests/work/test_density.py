"""Mode "density" from a recipe to a file: what moves, spreads and is fed are the picture's own values."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from app.media.auxiliary import Pictures
from app.media.pictures import read_picture
from app.model.edits import ending_at
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.progress import Progress
from app.work.export import run
from app.work.jobs import Job, Outputs
from app.work.replay import Replay
from solver.gl.device import Device

RECIPE = """
mode = "density"
duration = 0.2
[fluid]
grid = 32
dt = 0.02
"""
VORTEX = "[[force]]\nkind = 'vortex'\npoint = [0.5, 0.5]\nradius = 0.4\nstrength = 6\n"
SOFT = np.random.default_rng(2).integers(0, 256, (48, 64, 4), np.uint8)


def replay_of(device: Device, text: str, pixels: np.ndarray = SOFT) -> Replay:
    return Replay(device, Recipe.parse(RECIPE + text), Pictures(Picture(pixels)))


@pytest.mark.parametrize("channels", [3, 4])
def test_what_nothing_moves_is_written_as_it_was(device: Device, tmp_path: Path, channels: int) -> None:
    picture = Picture(SOFT[..., :channels])
    run(device, Job(Recipe.parse(RECIPE), picture, tmp_path, Outputs(tmp_path / "a.png")), Progress())
    np.testing.assert_array_equal(read_picture(tmp_path / "a.png").pixels, picture.pixels)


def test_what_is_seen_at_the_start_is_written_as_it_was(device: Device, tmp_path: Path) -> None:
    """A recipe lasts a step at least: in the one that is made for it nothing spreads or is fed, and nothing ends it."""
    text = RECIPE + VORTEX + "[density]\nkappa = 0.01\nsource = [0.5, 1, 0.2]\n[stop]\nenergy_below = 1e-9\n"
    recipe = ending_at(Recipe.parse(text), 0)
    report = run(device, Job(recipe, Picture(SOFT), tmp_path, Outputs(tmp_path / "a.png")), Progress())
    np.testing.assert_array_equal(read_picture(tmp_path / "a.png").pixels, SOFT)
    assert report.verdict is None


def test_a_map_to_begin_with_ends_nothing_at_the_start(device: Device, tmp_path: Path) -> None:
    np.save(tmp_path / "m.npy", np.full((48, 64, 2), 0.1, np.float32))
    recipe = Recipe.parse('map = "m.npy"\nduration = 0.2\nfluid = {grid = 32}\nstop = {displacement_above = 0.01}')
    verdicts = []
    for each in (recipe, ending_at(recipe, 0)):
        outputs = Outputs(tmp_path / "a.png")
        verdicts.append(run(device, Job(each, Picture(SOFT), tmp_path, outputs), Progress()).verdict)
    assert [verdict is None for verdict in verdicts] == [False, True]


def test_the_source_is_fed_by_the_second(device: Device) -> None:
    replay = replay_of(device, "[density]\nsource = [0.5, 0, -0.25]\n", np.full((48, 64, 4), 100, np.uint8))
    assert replay.density is not None
    replay.seek(10)
    wanted = 100 / 255 + 0.2 * np.array([0.5, 0, -0.25, 0])
    np.testing.assert_allclose(replay.density.get(), np.broadcast_to(wanted, (48, 64, 4)), atol=1e-6)
    replay.seek(Fraction(21, 2))
    np.testing.assert_allclose(replay.density.get()[0, 0], wanted + 0.01 * np.array([0.5, 0, -0.25, 0]), atol=1e-6)
    replay.release()


def test_it_is_carried_where_the_coordinates_are(device: Device) -> None:
    """A smooth picture is, moved by its values, nearly what it is moved by its coordinates; and half a tick is half."""
    y, x = np.mgrid[0:96, 0:128] / 128
    smooth = (127 + 100 * np.sin(9 * x)[..., None] * np.cos([7 * y, 5 * y, 3 * y]).transpose(1, 2, 0)).astype(np.uint8)
    replay = replay_of(device, VORTEX, smooth)
    assert replay.density is not None
    seen = []
    for position in (0, 9, Fraction(19, 2), 10):
        replay.seek(position)
        seen.append(replay.density.get()[..., :3].astype(float))
    at = replay.warp.read((128, 96)) * 128
    rows, columns = (
        np.clip(np.round(np.indices((96, 128))[k] + at[..., 1 - k]).astype(int), 0, n) for k, n in ((0, 95), (1, 127))
    )
    assert np.abs(seen[3] - smooth / 255).max() > 0.2
    assert np.abs(seen[3] - smooth[rows, columns] / 255).mean() < 0.02
    step = seen[3] - seen[1]
    assert np.abs(seen[2] - seen[1] - step / 2).max() < 0.1 * np.abs(step).max()
    replay.release()


def test_a_reset_brings_the_picture_back_and_going_back_the_same_bytes(device: Device) -> None:
    replay = replay_of(
        device, VORTEX + "[density]\nkappa = 1e-4\n[[change]]\ntick = 6\nreset_warp = true\nclear_velocity = true"
    )
    assert replay.density is not None
    seen = []
    for tick in (5, 10, 5):
        replay.seek(tick)
        seen.append(replay.density.get())
    np.testing.assert_array_equal(seen[0], seen[2])
    fresh = replay_of(device, "[density]\nkappa = 1e-4\n")
    assert fresh.density is not None
    fresh.seek(4)
    np.testing.assert_allclose(seen[1], fresh.density.get(), atol=1e-6)
    assert np.abs(seen[0] - seen[1]).max() > 0.1
    fresh.release()
    replay.release()

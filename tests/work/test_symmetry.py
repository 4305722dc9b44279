"""Symmetry: one stroke acts as several, on all sides of the middle."""

from __future__ import annotations

import numpy as np
import pytest

from app.media.auxiliary import Pictures
from app.model.picture import Picture
from app.model.recipe import FluidSettings, Recipe
from app.model.strokes import Stroke, Symmetry, ToolName
from app.work.replay import Replay
from solver.gl.device import Device

SQUARE = Picture(np.zeros((96, 96, 3), np.uint8))


def displacement(device: Device, tool: ToolName, symmetry: Symmetry, sectors: int = 6) -> np.ndarray:
    samples = tuple((n, 0.25 + 0.01 * n, 0.3 + 0.005 * n, 1.0) for n in range(10))
    stroke = Stroke(tool=tool, radius=0.1, samples=samples, symmetry=symmetry, sectors=sectors)
    fluid = FluidSettings(grid=48, dt=1 / 30, viscosity=0.01)
    replay = Replay(device, Recipe(stroke=(stroke,), duration=0.5, fluid=fluid), Pictures(SQUARE), budget=0)
    replay.seek(15)
    found = replay.warp.read((96, 96))
    replay.release()
    return found


@pytest.mark.parametrize("tool", ["push", "twirl", "bloat"])
@pytest.mark.parametrize(
    ("symmetry", "axes"), [("left-right", [1]), ("up-down", [0]), ("both", [0, 1])], ids=["sides", "up", "both"]
)
def test_a_mirrored_stroke_gives_a_mirrored_map(device: Device, tool: ToolName, symmetry: Symmetry, axes: list) -> None:
    found = displacement(device, tool, symmetry)
    assert np.abs(found).max() > 0.01
    for axis in axes:
        mirrored = np.flip(found, axis) * (np.array([-1, 1]) if axis == 1 else np.array([1, -1]))
        assert np.abs(mirrored - found).max() < 1e-4 * np.abs(found).max() + 1e-5


@pytest.mark.parametrize("tool", ["push", "twirl", "bloat"])
def test_four_sectors_give_a_map_that_is_the_same_after_a_quarter_turn(device: Device, tool: ToolName) -> None:
    found = displacement(device, tool, "radial", 4)
    turned = np.rot90(found)[..., ::-1] * np.array([1, -1])
    assert np.abs(turned - found).max() < 1e-4 * np.abs(found).max() + 1e-5


def test_without_symmetry_it_acts_once(device: Device) -> None:
    found = displacement(device, "push", "none")
    assert np.abs(found[60:, 60:]).max() < 0.2 * np.abs(found[:40, :50]).max()


@pytest.mark.parametrize("sectors", [2, 7, 16])
def test_as_many_images_as_sectors(sectors: int) -> None:
    stroke = Stroke(tool="push", samples=((0, 0.3, 0.4, 1.0),), symmetry="radial", sectors=sectors)
    images = [dabs[0] for dabs, _ in stroke.images(stroke.at(0), (1.0, 0.75))]
    assert len(images) == sectors
    far = [np.hypot(dab.x0 - 0.5, 0.75 * (dab.y0 - 0.5)) for dab in images]
    assert np.ptp(far) < 1e-12
    assert images[0][:2] == (0.3, 0.4)

"""Symmetry: one stroke acts as several, on all sides of the middle."""

from __future__ import annotations

import numpy as np
import pytest

from app.media.auxiliary import Pictures
from app.model.picture import Picture
from app.model.recipe import FluidSettings, Recipe
from app.model.strokes import Stroke, Symmetry, ToolName
from app.work.replay import Replay
from solver.brush.brush import Brush
from solver.brush.tip import Path, Tip
from solver.fluid import Fluid
from solver.gl.device import Device
from solver.grid import Grid

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


@pytest.mark.parametrize("sectors", [2, 8, 16])
def test_images_that_overlap_leave_no_trace_of_their_order(device: Device, sectors: int) -> None:
    """Around the middle all overlap: what they do there is still the same after half a turn, and no stronger."""
    brush, grid, dt = Brush(device), Grid(64, 64), 1 / 30
    angles = 2 * np.pi * np.arange(sectors) / sectors
    turned = [np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) for a in angles]
    ends = [0.5 + np.array([(0.03, 0.0), (0.03, 0.01)]) @ turn.T for turn in turned]
    (start, end, _), *others = (Path((a[0], a[1]), (b[0], b[1])) for a, b in map(np.ndarray.tolist, ends))

    def pushed(*others: Path) -> np.ndarray:
        fluid = Fluid(device, grid)
        brush.push(fluid, Tip(start, end, 0.2, others=others), dt)
        found = fluid.impulse.field.get()
        fluid.release()
        return found

    alone, together = pushed(), pushed(*others)
    u, v = together[..., 0], together[..., 1]
    np.testing.assert_allclose(u[:, 1:], -u[::-1, :0:-1], atol=1e-5)  # half a turn
    np.testing.assert_allclose(v[1:], -v[:0:-1, ::-1], atol=1e-5)
    assert 0 < np.abs(together).max() <= 1.01 * np.abs(alone).max()
    brush.release()


def test_images_side_by_side_push_as_one_would(device: Device) -> None:
    """A stroke along the axis of a mirror: its image is the same stroke once more."""
    brush, fluids = Brush(device), [Fluid(device, Grid(48, 48)) for _ in range(2)]
    path = Path((0.5, 0.4), (0.5, 0.43), True)
    for fluid, others in zip(fluids, ((), (path,)), strict=True):
        brush.push(fluid, Tip(*path[:2], 0.1, others=others), 1 / 30)
    alone, twice = (fluid.impulse.field.get() for fluid in fluids)
    assert np.abs(alone).max() > 0.5
    np.testing.assert_allclose(twice, alone, atol=1e-5)
    for item in (brush, *fluids):
        item.release()


def test_all_images_are_drawn_at_once(device: Device) -> None:
    def passes(symmetry: Symmetry) -> int:
        device.timings.take()
        displacement(device, "push", symmetry, 16)
        return device.timings.passes["brush"]

    assert passes("radial") == passes("none")

"""The grid covers exactly the picture, whatever its aspect and however many cells."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.media.auxiliary import Pictures
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.work.export import displacement
from app.work.replay import Replay
from solver.brush.brush import Brush
from solver.brush.tip import Tip
from solver.fluid import Fluid
from solver.gl.device import Device
from solver.grid import MOST_ALONG, SMALLEST_GRID, Grid
from solver.params import FluidParams, Walls
from support.flows import saved

SIZES = [(1500, 1000), (451, 300), (300, 451), (601, 599), (97, 1000), (4000, 9), (8, 4000), (12, 12)]


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("cells", [8, 57, 128, 1000])
def test_a_grid_covers_the_picture(size: tuple[int, int], cells: int):
    grid = Grid.for_picture(*size, cells)
    longer = max(size)
    assert grid.extent == (size[0] / longer, size[1] / longer)
    assert min(grid.size) >= SMALLEST_GRID
    assert max(grid.size) == cells or max(grid.size) <= MOST_ALONG
    (hx, hy), (x, y) = grid.spacing, grid.centres()
    assert hx * grid.nx == pytest.approx(grid.extent[0])
    assert hy * grid.ny == pytest.approx(grid.extent[1])
    # Cells are about square: rounding to 8 or more of them is off by a sixteenth at most.
    assert 0.9 < hx / hy < 1.1
    assert x[0, 0] == pytest.approx(hx / 2)
    assert y[-1, -1] == pytest.approx(grid.extent[1] - hy / 2)


def test_what_is_no_picture_is_refused():
    with pytest.raises(ValueError, match="below 8 x 8"):
        Grid(7, 20)
    for extent in ((1.0, 0.0), (0.5, 0.5), (1.0, 2.0)):
        with pytest.raises(ValueError, match="the longer must be 1"):
            Grid(8, 8, extent)


@pytest.mark.parametrize("wrong", [float("nan"), float("inf"), 1e30, "0.1", None, 0.1j, (0.1, 0.1, 0.1)], ids=str)
@pytest.mark.parametrize(("name", "side"), [(n, s) for n in ("extent", "origin", "picture") for s in (0, 1)])
def test_each_number_of_a_grid_is_looked_at(name: str, side: int, wrong: object):
    """And taken as floats, whatever they come in."""
    parts: dict[str, Any] = {"extent": [0.5, 0.25], "origin": [0.25, 0.125], "picture": [1, 0.5]}
    made = Grid(16, 8, **dict[str, Any]((key, np.array(part)) for key, part in parts.items()))
    assert made == Grid(16, 8, (0.5, 0.25), (0.25, 0.125), (1.0, 0.5))
    parts[name][side] = wrong
    with pytest.raises(ValueError, match=f"a grid's {name}"):
        Grid(16, 8, **parts)


def test_a_window_of_a_grid_is_its_part(device: Device):
    """A brush in a window draws what it draws in the whole."""
    whole = Grid(64, 48)
    window = Grid(24, 20, (24 / 64, 20 / 64), (16 / 64, 8 / 64), whole.picture)
    part = (slice(8, 28), slice(16, 40))
    for one, other in zip(whole.u_faces(), window.u_faces(), strict=True):
        np.testing.assert_allclose(other, one[part], atol=1e-12)
    assert whole.is_whole
    assert not window.is_whole
    assert whole.at_edge == (True, True, True, True)
    assert window.at_edge == (False, False, False, False)
    assert Grid(24, 20, (24 / 64, 20 / 64), (40 / 64, 28 / 64), whole.picture).at_edge == (False, True, False, True)
    with pytest.raises(ValueError, match="not within"):
        Grid(24, 20, (24 / 64, 20 / 64), (41 / 64, 0.0), whole.picture)
    tip, drawn = Tip((0.4, 0.3), (0.45, 0.33), 0.08, 0.2), []
    for grid in (whole, window):
        fluid, brush = Fluid(device, grid), Brush(device)
        brush.push(fluid, tip, 0.1)
        brush.twirl(fluid, tip, 2.0)
        drawn.append(fluid.impulse.field.get())
        brush.release()
        fluid.release()
    assert np.abs(drawn[1]).max() > 0.1
    np.testing.assert_allclose(drawn[1], drawn[0][part], atol=2e-6 * np.abs(drawn[1]).max())


def test_through_each_face_of_a_coarser_grid_goes_as_much_as_before(device: Device):
    fluid = Fluid(device, Grid(72, 48))
    fluid.set_velocity(np.random.default_rng(5).standard_normal((48, 72, 2)))
    flow, fine = fluid.flow_on(Grid(24, 16)), fluid.velocity.read.get()
    assert flow.carried is None
    found = flow.velocity.get()
    np.testing.assert_allclose(found[..., 0], fine[:, ::3, 0].reshape(16, 3, 24).mean(axis=1), atol=1e-5)
    np.testing.assert_allclose(found[..., 1], fine[::3, :, 1].reshape(16, 24, 3).mean(axis=2), atol=1e-5)
    flow.release()
    fluid.release()


def test_a_window_moved_by_whole_cells_takes_the_pressure_along(device: Device):
    whole = Grid(64, 48)
    here, there = (Grid(24, 20, (24 / 64, 20 / 64), (left / 64, 12 / 64), whole.picture) for left in (16, 20))
    fluid = Fluid(device, here)
    fluid.set_velocity(np.random.default_rng(6).standard_normal((20, 24, 2)))
    fluid.step(1e-3)
    before = saved(fluid)["carried"]
    flow = fluid.flow_on(there)
    fluid.lay_on(there)
    fluid.go_on_with(flow)
    after = saved(fluid)["carried"]
    assert np.abs(before).max() > 0
    np.testing.assert_allclose(after[:, 1:20], before[:, 5:], atol=1e-6 * np.abs(before).max())
    flow.release()
    fluid.release()


@pytest.mark.parametrize("viscosity", [1e-4, 0.01])
@pytest.mark.parametrize("left", [0, 60], ids=["at the picture's edge", "within it"])
def test_the_flow_in_a_window_is_that_of_the_whole(device: Device, left: int, viscosity: float):
    """Its sides stick, the picture's edge lets glide: a push in the middle of the window, and one beside that edge."""
    whole = Grid(200, 160)
    window = Grid(96, 96, (96 / 200, 96 / 200), (left / 200, 32 / 200), whole.picture)
    assert Walls.of("free", window.at_edge).sticky == (left > 0, True, True, True)
    x, y = (6 if left == 0 else left + 48) / 200, 80 / 200
    flows, brush = [], Brush(device)
    for grid in (whole, window):
        fluid = Fluid(device, grid, FluidParams(Walls.of("free", grid.at_edge)))
        fluid.set_viscosity(viscosity)
        for tick in range(6):
            start = x + 0.002 * tick, y + 0.004 * tick
            brush.push(fluid, Tip(start, (start[0] + 0.002, start[1] + 0.004), 0.04), 1 / 60)
            fluid.step(1 / 60)
        flows.append(fluid.velocity.read.get())
        fluid.release()
    brush.release()
    part = flows[0][32:128, left : left + 96]
    largest = np.abs(part).max()
    assert largest > 0.05
    near = slice(24, 72), slice(0, 48) if left == 0 else slice(24, 72)
    assert np.abs(flows[1][near] - part[near]).max() < 0.02 * largest
    # At the picture's own edge it glides as it does there, and at the sides it stands.
    assert np.abs(flows[1][:2, :, 0]).max() < 0.01 * largest
    if left == 0:
        assert np.abs(flows[1][24:72, 0, 1]).max() > 0.1 * largest


@pytest.mark.parametrize("size", [(331, 200), (200, 337)], ids=str)
def test_the_warp_converges_where_no_grid_divides_the_picture(device: Device, size: tuple[int, int]):
    """Grids whose shorter side is rounded differently see the same domain: order 1.5 or better."""
    text = """
duration = 0.5
[fluid]
grid = {}
viscosity = 0.002
[[force]]
kind = "vortex"
point = [0.4, 0.45]
radius = 0.35
strength = 4.0
at = 0.0
"""
    maps = []
    for cells in (48, 96, 288):
        pictures = Pictures(Picture(np.zeros((size[1], size[0], 3), np.uint8)))
        replay = Replay(device, Recipe.parse(text.format(cells)), pictures)
        replay.seek(replay.recipe.ticks)
        maps.append(displacement(replay, size).values.astype(np.float64))
        replay.release()
    coarse, fine = (float(np.sqrt(((some - maps[2]) ** 2).mean())) for some in maps[:2])
    assert np.log2(coarse / fine) > 1.5, (coarse, fine)


def test_a_narrow_strip_is_warped(device: Device, tmp_path: Path):
    """More cells along it than were asked for, so that there are enough across."""
    pictures = Pictures(Picture(np.zeros((12, 600, 3), np.uint8)))
    replay = Replay(
        device, Recipe.parse('[fluid]\ngrid = 16\n[[force]]\nkind = "vortex"\npoint = [0.5, 0.5]\nat = 0.0'), pictures
    )
    replay.seek(10)
    assert replay.grid.size == (400, 8)
    found = displacement(replay, (600, 12)).values
    assert np.isfinite(found).all()
    assert np.abs(found).max() > 1e-4
    replay.release()

"""Painted masks on a canvas of their own: what is painted, and what of it the fluid takes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from solver.brush.masks import LEAST_VISCOSITY, MOST, STEPS, ZERO, Masks
from solver.brush.tip import Tip
from solver.fluid import Fluid
from solver.gl.device import Device
from solver.grid import Grid
from solver.warp.frozen import REACH
from solver.warp.map import WarpMap
from support.flows import vortex_faces

CANVAS = Grid(600, 400)
GRID = Grid(24, 16)


@pytest.fixture
def masks(device: Device) -> Iterator[Masks]:
    masks = Masks(device, CANVAS)
    masks.set_base(0.03)
    yield masks
    masks.release()


def decades(masks: Masks) -> np.ndarray:
    return (masks.thickness.get().astype(float) - ZERO) / STEPS


def told(masks: Masks, device: Device, grid: Grid) -> tuple[np.ndarray, np.ndarray]:
    fluid = Fluid(device, grid)
    masks.apply(fluid)
    found = fluid.viscosity.get(), fluid.solid.get() > 127
    fluid.release()
    return found


def covered(values: np.ndarray, canvas: Grid, grid: Grid) -> np.ndarray:
    """Means of texels over the cells by the part of each that they cover, in float64."""
    for axis in (0, 1):
        n = values.shape[axis]
        start, h, cells = grid.origin[1 - axis], grid.spacing[1 - axis], grid.size[1 - axis]
        edges = (start + h * np.arange(cells + 1)) / canvas.spacing[1 - axis]
        low, high = edges[:-1, None], edges[1:, None]
        parts = (np.minimum(high, np.arange(n) + 1) - np.maximum(low, np.arange(n))).clip(0)
        values = np.moveaxis(np.tensordot(parts / parts.sum(axis=1, keepdims=True), values, (1, axis)), 0, axis)
    return values


def test_as_long_as_the_version_is_the_same_so_are_the_masks(device: Device, masks: Masks) -> None:
    """Also where they go back: the window shows them before anything is simulated."""
    fluid, empty = Fluid(device, GRID), masks.save()
    masks.freeze(Tip((0.5, 0.3), (0.5, 0.3), 0.1), 1)
    masks.apply(fluid)
    painted, version = masks.save(), masks.version
    masks.restore(painted)
    assert masks.version == version
    masks.restore(empty)
    assert masks.version > version
    for thing in (fluid, empty, painted):
        thing.release()


def test_nothing_is_kept_of_masks_that_are_not_painted(device: Device, masks: Masks) -> None:
    viscosity, solid = told(masks, device, GRID)
    assert (viscosity == np.float32(0.03)).all()
    assert not solid.any()
    assert masks.nbytes < 10 * GRID.nx * GRID.ny
    assert masks.take_frozen() is None
    masks.thicken(Tip((-1, -1), (-1, -1), 0.5), 1)
    masks.smooth(Tip((0.5, 0.3), (0.5, 0.3), 0.5), 1)
    assert masks.nbytes < 10 * GRID.nx * GRID.ny


@pytest.mark.parametrize("hardness", [0.0, 1.0])
def test_the_ring_is_what_is_frozen(hardness: float, device: Device, masks: Masks) -> None:
    """To half a texel, and however long the brush stays."""
    x, y = CANVAS.centres()
    far = np.hypot(np.clip(x, 0.4, 0.5) - x, 0.3 - y)
    tip = Tip((0.4, 0.3), (0.5, 0.3), 0.1, hardness)
    for _ in range(60):
        masks.freeze(tip, 0.7)
        frozen = masks.frozen.get() >= 128
        assert frozen[far < 0.1 - 0.55 * CANVAS.h].all()
        assert not frozen[far > 0.1 + 0.55 * CANVAS.h].any()
    masks.freeze(Tip((0.4, 0.3), (0.4, 0.3), 0.05), -1)
    thawed = frozen & ~(masks.frozen.get() >= 128)
    assert thawed.sum() * CANVAS.h**2 == pytest.approx(np.pi * 0.05**2, rel=0.01)


def test_a_weak_brush_freezes_in_time(masks: Masks, device: Device) -> None:
    """From half frozen on: before that it closes no cell either."""
    tip, grid = Tip((0.5, 0.3), (0.5, 0.3), 0.05), Grid(60, 40)
    for _ in range(5):
        masks.freeze(tip, 0.1)
    assert not (masks.frozen.get() >= 128).any()
    assert masks.frozen.get().max() > 64
    assert not told(masks, device, grid)[1].any()
    for _ in range(5):
        masks.freeze(tip, 0.1)
    assert (masks.frozen.get() >= 128).any()
    assert told(masks, device, grid)[1].any()


def test_thickness_is_painted_with_the_brush_s_falloff_within_its_limits(masks: Masks) -> None:
    x, y = CANVAS.centres()
    q = np.minimum(np.hypot(x - 0.5, y - 0.3) / 0.1, 1)
    tip = Tip((0.5, 0.3), (0.5, 0.3), 0.1)
    masks.thicken(tip, 0.5)
    masks.thicken(tip, -0.2)
    np.testing.assert_allclose(decades(masks), 0.3 * (1 - q**2) ** 3, atol=1.5 / STEPS)
    tip = Tip((0.5, 0.3), (0.5, 0.3), 0.1, 1.0)
    masks.thicken(tip, 100)
    assert decades(masks).max() == (MOST - ZERO) / STEPS
    masks.thicken(tip, -100)
    assert decades(masks).min() == -3


@pytest.mark.parametrize("hardness", [0.0, 0.4, 1.0])
def test_a_shaders_brush_falls_off_as_the_recipes(hardness: float, masks: Masks) -> None:
    """1 in a core of 0.9 of its hardness, then (1 - q^2)^3 to the rim."""
    x, y = CANVAS.centres()
    core = 0.9 * hardness * 0.2
    q = np.clip((np.hypot(x - 0.5, y - 0.3) - core) / (0.2 - core), 0, 1)
    masks.thicken(Tip((0.5, 0.3), (0.5, 0.3), 0.2, hardness), 2.0)
    np.testing.assert_allclose(decades(masks), 2.0 * (1 - q**2) ** 3, atol=1.5 / STEPS)


GRIDS = {
    "whole": Grid(60, 40),
    "no multiple": Grid(47, 31, CANVAS.extent),
    "window": Grid(20, 12, (0.23, 0.11), (0.31, 0.42), CANVAS.extent),
    "finer than the canvas": Grid(60, 40, (0.05, 0.03), (0.4, 0.2), CANVAS.extent),
}


@pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS.keys())
def test_a_cell_takes_the_mean_of_its_decades(grid: Grid, device: Device, masks: Masks) -> None:
    rng = np.random.default_rng(5)
    base = 10 ** rng.uniform(-4, 0, (grid.ny, grid.nx))
    base[0] = 0.0
    masks.set_base(base)
    for _ in range(12):
        place = tuple(rng.uniform(0, 1, 2) * CANVAS.extent)
        masks.thicken(Tip(place, place, rng.uniform(0.005, 0.1), 1.0), rng.uniform(-2, 4))
    viscosity, _ = told(masks, device, grid)
    thickness, painted = (covered(a, CANVAS, grid) for a in (decades(masks), decades(masks) != 0))
    wanted = np.where(painted > 0, np.maximum(base, LEAST_VISCOSITY) * 10**thickness, base)
    sure = (painted > 1e-3) | (painted == 0)  # float32 may miss a sliver of a texel
    np.testing.assert_allclose(viscosity[sure], wanted[sure], rtol=2e-3)


def test_of_many_texels_a_cell_some_stand_for_all(device: Device) -> None:
    """Means of 8 x 8 to 15 x 15 places of a cell: an edge is found to a 16th of a cell, soft brushes better."""
    canvas, grid = Grid(2310, 1540), Grid(60, 40)
    masks = Masks(device, canvas)
    masks.set_base(1.0)
    masks.thicken(Tip((0.5, 0.3), (0.5, 0.3), 0.15, 1.0), 4)
    masks.thicken(Tip((0.3, 0.4), (0.6, 0.2), 0.1, 0.0), -2)
    viscosity, _ = told(masks, device, grid)
    off = np.abs(np.log10(viscosity) - covered(decades(masks), canvas, grid))
    assert off.max() < 4 / 16
    assert off.mean() < 0.002
    masks.release()


@pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS.keys())
def test_cells_are_closed_by_their_distance_from_what_is_frozen(grid: Grid, device: Device, masks: Masks) -> None:
    masks.freeze(Tip((0.4, 0.2), (0.4, 0.45), 0.03), 1)
    masks.freeze(Tip((0.3, 0.05), (0.6, 0.25), 0.002), 1)  # a line
    fluid = Fluid(device, grid)
    masks.apply(fluid)
    texel = CANVAS.h
    low = np.argwhere(masks.frozen.get() >= 128)[:, ::-1] * texel
    middles = np.stack(grid.centres(), axis=-1).reshape(-1, 1, 2)
    far = np.empty(len(middles))
    for part in np.array_split(np.arange(len(middles)), 1 + len(middles) // 100):
        beyond = np.maximum(np.maximum(low - middles[part], middles[part] - low - texel), 0) / grid.spacing
        far[part] = np.sqrt((beyond**2).sum(axis=-1).min(axis=-1))
    solid = 0.5 + REACH * texel / min(grid.spacing)
    wanted = np.clip(solid + 1 - far, 0, 1).reshape(grid.ny, grid.nx)
    np.testing.assert_allclose(fluid.solid.get() / 255, wanted, atol=0.01)
    assert wanted.min() < 1
    assert wanted.max() > 0
    fluid.release()


def test_a_line_of_single_texels_lets_nothing_through(device: Device) -> None:
    canvas, grid = Grid(640, 640), Grid(64, 64)
    row, column = np.mgrid[0:640, 0:640]
    for slope in (0.0, 0.3, 0.9):
        masks, fluid = Masks(device, canvas), Fluid(device, grid)
        masks.set_base(1e-3)
        masks.set_frozen(np.floor(row - 319 - slope * (column - 320)) == 0)
        masks.apply(fluid)
        x, y = grid.centres()
        above = y - 0.5 < slope * (x - 0.5)
        fluid.set_velocity(vortex_faces(grid, 0.0) * above[..., None])
        for _ in range(10):
            fluid.step(1 / 60)
        speed = np.abs(fluid.velocity_at_centres()).max(axis=-1)
        assert speed[above].max() > 0.1
        assert speed[~above].max() < 1e-6
        for thing in (masks, fluid):
            thing.release()


def test_beside_what_is_frozen_a_coarse_grid_flows_as_a_fine_one(device: Device) -> None:
    """A disc in the vortex: two and a half cells from the ring the map is that of four times finer cells."""
    canvas, moved = Grid(960, 960), []
    x, y = canvas.centres()
    disc = np.hypot(x - 0.553, y - 0.5) < 0.121
    turn = np.linspace(0, 2 * np.pi, 90, endpoint=False)
    radius = 0.121 + 2.5 / 48
    ring = np.stack([0.553 + radius * np.cos(turn), 0.5 + radius * np.sin(turn)], axis=1)
    for cells in (48, 192):
        grid = Grid(cells, cells)
        masks, fluid, warp = Masks(device, canvas), Fluid(device, grid), WarpMap(device, grid, canvas.size)
        masks.set_base(1e-3)
        masks.set_frozen(disc)
        masks.apply(fluid)
        fluid.set_velocity(0.1 * vortex_faces(grid, 0.0))
        for _ in range(6):
            fluid.step(1 / 60)
            warp.follow(fluid, 1 / 60)
        assert np.abs(fluid.divergence()).max() < 5e-3
        moved.append(np.linalg.norm(warp.at(ring), axis=1))
        for thing in (masks, fluid, warp):
            thing.release()
    assert np.abs(moved[0] / moved[1] - 1).mean() < 0.1


def test_what_is_painted_bit_by_bit_is_what_is_painted_at_once(device: Device, masks: Masks) -> None:
    """Only cells under what has changed are averaged again; the rest holds what it held."""
    fluid = Fluid(device, Grid(37, 25, CANVAS.extent))
    rng = np.random.default_rng(7)
    masks.apply(fluid)
    kept = masks.save()
    for step in range(40):
        start, end = rng.uniform(-0.1, 1.1, (2, 2)) * CANVAS.extent
        tip = Tip(tuple(start), tuple(0.7 * start + 0.3 * end), 10 ** rng.uniform(-2.5, -1), rng.uniform())
        masks.thicken(tip, rng.uniform(-1, 1))
        masks.freeze(tip, rng.uniform(-1, 1))
        masks.smooth(tip, rng.uniform())
        if step == 25:
            masks.restore(kept)
        masks.apply(fluid)
        viscosity, solid = told(masks, device, fluid.grid)
        masks.apply(fluid)
        np.testing.assert_array_equal(fluid.viscosity.get(), viscosity)
        np.testing.assert_array_equal(fluid.solid.get() > 127, solid)
    kept.release()
    fluid.release()


def test_a_recipe_s_frozen_parts_can_be_thawed_and_come_back(device: Device, masks: Masks) -> None:
    frozen = np.zeros((CANVAS.ny, CANVAS.nx), bool)
    frozen[:, :200] = True
    masks.set_frozen(frozen)
    masks.freeze(Tip((0.2, 0.3), (0.2, 0.3), 0.1), -1)
    masks.freeze(Tip((0.8, 0.3), (0.8, 0.3), 0.1), 1)
    now = masks.frozen.get() >= 128
    assert not now[180, 120]
    assert now[180, 480]
    masks.clear()
    np.testing.assert_array_equal(masks.frozen.get() >= 128, frozen)


@pytest.mark.parametrize("by_recipe", [False, True])
@pytest.mark.parametrize("name", ["frozen", "thickness"])
def test_paint_is_taken_off_one_mask_and_the_other_keeps_its(
    device: Device, masks: Masks, name: str, by_recipe: bool
) -> None:
    """Where there was some, where there is none any more, and where there never was any."""
    frozen = np.zeros((CANVAS.ny, CANVAS.nx), bool)
    frozen[:, :200] = by_recipe
    masks.set_frozen(frozen)
    masks.take_off(name)
    before = told(masks, device, GRID)
    paint = {"frozen": lambda: masks.freeze(Tip((0.8, 0.3), (0.8, 0.3), 0.1), 1),
             "thickness": lambda: masks.thicken(Tip((0.6, 0.3), (0.6, 0.3), 0.1), 2)}  # fmt: skip
    paint[name]()
    assert any((one != other).any() for one, other in zip(told(masks, device, GRID), before, strict=True))
    for _ in range(2):
        masks.take_off(name)
        np.testing.assert_array_equal(told(masks, device, GRID), before)
    for one in paint.values():
        one()
    both = told(masks, device, GRID)
    masks.take_off(name)
    left = 0 if name == "frozen" else 1  # of viscosity and what is solid
    now = told(masks, device, GRID)
    np.testing.assert_array_equal(now[left], both[left])
    np.testing.assert_array_equal(now[1 - left], before[1 - left])


def test_smoothing_takes_a_mask_to_the_means_around(masks: Masks) -> None:
    tip = Tip((0.5, 0.3), (0.5, 0.3), 0.2)
    masks.thicken(Tip((0.5, 0.3), (0.5, 0.3), 0.1, 1.0), 2)
    before = decades(masks)
    for _ in range(60):
        masks.smooth(tip, 0.5)
    after = decades(masks)
    assert after.max() < 1.8
    assert np.abs(np.diff(after, axis=1)).max() < 0.5 * np.abs(np.diff(before, axis=1)).max()
    assert after.min() == 0


def test_a_smoothing_of_full_strength_leaves_nothing_but_the_means(masks: Masks) -> None:
    """A dot is spread over a mean's 15 x 15 texels."""
    masks.thicken(Tip((0.5, 0.3), (0.5, 0.3), 0.005, 1.0), 2)
    before = decades(masks)
    masks.smooth(Tip((0.5, 0.3), (0.5, 0.3), 0.2, 1.0), 1)
    assert before.max() == 2
    assert 0 < decades(masks).max() < 2 * before.sum() / 15**2


def test_states_go_back_to_the_bit_and_through_arrays(device: Device, masks: Masks) -> None:
    empty = masks.save()
    masks.thicken(Tip((0.5, 0.3), (0.5, 0.3), 0.1), 2)
    masks.freeze(Tip((0.2, 0.3), (0.2, 0.3), 0.1), 1)
    saved = masks.save()
    wanted = told(masks, device, GRID)
    masks.restore(empty)
    viscosity, solid = told(masks, device, GRID)
    assert (viscosity == np.float32(0.03)).all()
    assert not solid.any()
    other = Masks(device, CANVAS)
    other.set_base(0.03)
    nothing = other.save()
    given = nothing.with_arrays(device, saved.arrays())
    for mine, state in ((masks, saved), (other, given)):
        mine.restore(state)
        np.testing.assert_array_equal(told(mine, device, GRID), wanted)
    elsewhere = Masks(device, Grid(300, 200))
    with pytest.raises(ValueError, match="another canvas"):
        elsewhere.restore(saved)
    for thing in (empty, saved, nothing, given, other, elsewhere):
        thing.release()

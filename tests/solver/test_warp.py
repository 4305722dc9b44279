"""The warp map: against float64, against traced particles, and what every map must keep."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
import pytest
from scipy import ndimage

from properties.fluid import TURNS, turned_map, turned_walls
from solver.brush.masks import Masks
from solver.fluid import Fluid
from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.passes import Pass
from solver.gl.tiled import TILE, TiledField
from solver.grid import Grid
from solver.paper import PaperWarpMap
from solver.params import FluidParams, Walls
from solver.resample.sampler import Sampler
from solver.warp.accumulated import map_size
from solver.warp.factors import Factors
from solver.warp.frozen import FADED, Frozen
from solver.warp.inverse import ForwardMap
from solver.warp.map import WarpMap
from solver.warp.remapping import FEW_TILES, MOST_TILES, REMAP_STEPS
from solver.warp.state import MOST_CLOSED, closed_in
from solver.warp.submap import Level
from support import reference
from support.arrays import assert_near
from support.flows import VORTEX_TIME, saved, vortex, vortex_faces


def smooth(rng: np.random.Generator, size: tuple[int, int], amplitude: float) -> np.ndarray:
    """A few random waves, (h, w, 2)."""
    x, y = np.meshgrid((np.arange(size[0]) + 0.5) / size[0], (np.arange(size[1]) + 0.5) / size[1])
    field = np.zeros((size[1], size[0], 2))
    for _ in range(4):
        kx, ky, phase = *rng.integers(-3, 4, 2), rng.uniform(0, 2 * np.pi)
        field += rng.normal(size=2) * np.sin(2 * np.pi * (kx * x + ky * y) / 2 + phase)[..., None]
    return (amplitude * field / np.abs(field).max()).astype(np.float32)


def difference(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.abs(a - b).max() / np.abs(b).max())


@pytest.mark.parametrize("slip", ["free", "none"])
@pytest.mark.parametrize("size", [(37, 23), (8, 8), (16, 51)])
def test_one_step_agrees_with_float64(device: Device, size: tuple[int, int], slip: Literal["free", "none"]) -> None:
    """Within half a cell of the edges too, where it goes on as its image."""
    rng = np.random.default_rng(3)
    grid = Grid(*size)
    fluid, warp = Fluid(device, grid, FluidParams(walls=Walls(slip))), WarpMap(device, grid)
    fluid.set_velocity(reference.smooth_velocity(*size, seed=5, cells=2.0))
    submap, dt = smooth(rng, size, 0.1), 0.7 * grid.h
    warp.submap.field.set(submap)
    warp.follow(fluid, dt)
    side = 1 if slip == "free" else -1
    expected = reference.advance_map(submap, fluid.trace(dt).get(), grid.h, (side, side, side, side))
    assert difference(warp.submap.field.get(), expected) < 1e-5


@pytest.mark.parametrize("size", [(37, 23), (8, 8), (16, 51)])
def test_composition_agrees_with_float64(device: Device, size: tuple[int, int]) -> None:
    rng = np.random.default_rng(4)
    grid = Grid(*size)
    submap, accumulated = smooth(rng, size, 0.1), smooth(rng, (2 * size[0], 2 * size[1]), 0.3)
    warp = WarpMap(device, grid, (2 * size[0], 2 * size[1]))
    warp.set(accumulated)
    warp.advance_traced(device.field(grid.size, 2))  # by nothing: from now on there is something to take in
    warp.submap.field.set(submap)
    limits = tuple(saved(warp)["limits"].tolist())
    for wanted in (grid.size, (50, 31)):
        expected = reference.compose_map(submap, accumulated, grid.extent, wanted, limits)
        assert difference(warp.read(wanted), expected) < 1e-5
    before = warp.read()
    warp.remap()
    assert not warp.submap.field.get().any()
    assert difference(warp.read((2 * size[0], 2 * size[1])), warp.composed(exact=True).get()) < 1e-5
    assert difference(warp.read(), before) < 0.1


@pytest.mark.parametrize("slip", ["free", "none"])
@pytest.mark.parametrize("size", [(37, 23), (8, 8), (16, 51)])
def test_a_submap_is_read_between_its_cells_as_in_float64(
    device: Device, size: tuple[int, int], slip: Literal["free", "none"]
) -> None:
    """Up to the edges, beyond which it goes on as its image; and its slopes are those of what is read."""
    grid = Grid(*size)
    fluid, warp = Fluid(device, grid, FluidParams(walls=Walls(slip))), WarpMap(device, grid)
    warp.follow(fluid, 0.01)  # at rest: from now on there is something to read
    submap = smooth(np.random.default_rng(5), size, 0.5 * grid.h)
    warp.submap.field.set(submap)
    points = np.random.default_rng(6).uniform(1e-3, np.array(grid.extent) - 1e-3, (500, 2))
    side = 1 if slip == "free" else -1

    def read(at: np.ndarray) -> np.ndarray:
        moved = reference.bent_displacement(submap, at[:, 0] / grid.h, at[:, 1] / grid.h, (side, side, side, side))
        return np.clip(at + moved, 0, grid.extent) - at

    assert difference(warp.at(points), read(points)) < 1e-5
    bare = (np.abs(points + read(points) - np.divide(grid.extent, 2)) < np.divide(grid.extent, 2) - 1e-3).all(axis=1)
    step = 1e-6 * grid.h
    across, down = ((read(points + ahead) - read(points - ahead)) / (2 * step) for ahead in step * np.eye(2))
    slopes = np.linalg.det(np.stack([across, down], axis=-1) + np.eye(2))
    np.testing.assert_allclose(warp.determinants(points)[bare], slopes[bare], atol=1e-4)
    for thing in (fluid, warp):
        thing.release()


def test_vortex_comes_back(device: Device) -> None:
    """The single vortex in a box, T = 8, 128 x 128, CFL 1."""
    grid = Grid(128, 128)
    warp = WarpMap(device, grid)
    x, y = grid.centres()
    dt = grid.h
    steps = round(VORTEX_TIME / dt)

    def error(true_x: np.ndarray, true_y: np.ndarray) -> float:
        displacement = warp.read()
        return float(np.hypot(x + displacement[..., 0] - true_x, y + displacement[..., 1] - true_y).mean() / grid.h)

    for step in range(steps):
        warp.advance_prescribed(vortex, dt, step * dt)
        if step + 1 == steps // 2:
            assert error(*reference.follow(vortex, x, y, VORTEX_TIME / 2, 0.0, 200)) < 0.002
    assert error(x, y) < 0.003
    assert warp.statistics().det_error < 2e-4
    # The disc that was stretched into a spiral is round again: E_shape = max | distance - radius |.
    angle = np.linspace(0, 2 * np.pi, 500)
    rim = np.stack([0.5 + 0.15 * np.cos(angle), 0.75 + 0.15 * np.sin(angle)], axis=-1)
    found = rim + warp.at(rim)
    assert np.abs(np.hypot(found[:, 0] - 0.5, found[:, 1] - 0.75) - 0.15).max() < 5e-5


def test_a_step_that_bends_far_is_carried_in_parts(device: Device) -> None:
    """Each may end with a remap: a swirl by one and a half radians in one step is as exact as its trace."""
    grid = Grid(48, 48)
    fluid, warp = Fluid(device, grid), WarpMap(device, grid)

    def turning(x: np.ndarray, y: np.ndarray, _: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        x, y = x - 0.5, y - 0.5
        rate = 6 * np.exp(-(x**2 + y**2) / 0.02)
        return -y * rate, x * rate

    fluid.set_velocity(turning)
    assert fluid.strain(0.25) > 2
    warp.follow(fluid, 0.25)
    assert warp.statistics().det_min > 0.9
    points = np.random.default_rng(0).random((2000, 2))
    true = np.stack(reference.follow(turning, points[:, 0], points[:, 1], 0.25, 0.0, 50), axis=-1)
    off = np.linalg.norm(points + warp.at(points) - true, axis=-1)
    assert off.max() < 0.1 * grid.h
    still = fluid.trace(0.25).get()  # that the fluid's own next step follows is still of all of it
    assert np.abs(still).max() > 3
    for thing in (fluid, warp):
        thing.release()


def test_small_steps_do_not_blur(device: Device) -> None:
    """A quarter of the vortex's path in steps of CFL 0.1, where interpolating every step would blur most."""
    grid = Grid(48, 48)
    warp = WarpMap(device, grid)
    x, y = grid.centres()
    dt = 0.1 * grid.h
    steps = round(2.0 / dt)
    for step in range(steps):
        warp.advance_prescribed(vortex, dt, step * dt)
    true_x, true_y = reference.follow(vortex, x, y, steps * dt, 0.0, 200)
    displacement = warp.read()
    assert np.hypot(x + displacement[..., 0] - true_x, y + displacement[..., 1] - true_y).mean() < 0.01 * grid.h


def test_fluid_velocity_on_faces(device: Device) -> None:
    """The same vortex known only by its means over the faces: second order in the cell."""
    errors = []
    for n in (32, 64):
        grid = Grid(n, n)
        warp = WarpMap(device, grid)
        x, y = grid.centres()
        dt = 0.5 * grid.h
        steps = round(1.0 / dt)
        for step in range(steps):
            warp.advance_prescribed(vortex_faces(grid, (step + 0.5) * dt), dt)
        true_x, true_y = reference.follow(vortex, x, y, 1.0, 0.0, 100)
        displacement = warp.read()
        errors.append(np.hypot(x + displacement[..., 0] - true_x, y + displacement[..., 1] - true_y).mean())
    assert errors[1] < 1e-3
    assert errors[0] / errors[1] > 3.0


def read_between(
    device: Device, field: np.ndarray, images: tuple[float, ...], size: tuple[int, int], part: float, cubic: bool
) -> np.ndarray:
    """A displacement at a lattice of `size` over a part, 0-1, of its texels from the top left corner on."""
    given, found = device.upload(field.astype(np.float32)), device.field(size, 2)
    step = part / size[0], part / size[1]
    resample = device.pass_("warp/resample.frag", **({"CUBIC": 1} if cubic else {}))
    resample(found, displacement=given, images=images, origin=(0.0, 0.0), step=step)
    read = found.get()
    given.release()
    found.release()
    return read


@pytest.mark.parametrize("cubic", [True, False], ids=["cubic", "quintic"])
@pytest.mark.parametrize("seed", range(4))
def test_what_is_its_own_image_beyond_an_edge_goes_on_exactly(seed: int, cubic: bool, device: Device) -> None:
    """Odd polynomials across an edge times even ones along it, or odd ones where it sticks, up to the corner."""
    rng = np.random.default_rng(seed)
    sticks = rng.random(2) < 0.5  # at the left and the top edge
    images = -1.0 if sticks[0] else 1.0, 1.0, -1.0 if sticks[1] else 1.0, 1.0
    a = rng.normal(size=(2, 4))

    def wanted(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        parts = []
        for across, along, is_odd, k in ((x, y, sticks[1], 0), (y, x, sticks[0], 1)):
            first = along if is_odd else 1.0
            if cubic:  # blended: of the third degree along one axis or the other
                parts.append(first * (a[k, 0] * across * (1 + a[k, 1] * along**2) + a[k, 2] * across**3))
            else:
                odd = across + a[k, 0] * across**3 + a[k, 1] * across**5
                parts.append(first * odd * (1 + a[k, 2] * along**2 + a[k, 3] * along**4))
        return np.stack(parts, axis=-1)

    field = wanted(*np.meshgrid(*2 * [(np.arange(16) + 0.5) / 8]))
    expected = wanted(*np.meshgrid(*2 * [(np.arange(24) + 0.5) / 64]))  # of the first three texels
    assert_near(read_between(device, field, images, (24, 24), 3 / 16, cubic), expected, rel=1e-5, abs=1e-5)


@pytest.mark.parametrize("cubic", [True, False], ids=["cubic", "quintic"])
@pytest.mark.parametrize("seed", range(4))
def test_what_lies_beyond_the_edges_is_mirrored_and_transposed_with_the_map(
    seed: int, cubic: bool, device: Device
) -> None:
    rng = np.random.default_rng(seed)
    field, sticky = rng.normal(size=(12, 16, 2)), rng.random(4) < 0.5
    walls = Walls(sticky=tuple(sticky.tolist()))

    def found(turn: str) -> np.ndarray:
        size = (60, 80) if "t" in turn else (80, 60)
        return read_between(device, turned_map(field, turn), turned_walls(walls, turn).images, size, 1.0, cubic)

    plain = found("")
    for turn in TURNS:
        assert_near(found(turn), turned_map(plain, turn), rel=1e-5, abs=1e-5, note=turn)


def test_what_no_flow_crosses_the_map_does_not_leave(device: Device) -> None:
    """Along the edges it goes on to them, in all levels; else what is cut off there folds the last texels."""
    grid = Grid(16, 16)
    warp, along = WarpMap(device, grid, (128, 128)), np.linspace(0.01, 0.99, 33)
    faces = np.sin(np.pi * (np.arange(17) / 16))
    stream = 0.3 * faces[:, None] * faces  # gliding along the edges as fast as it flows anywhere
    flow = 16 * np.stack([np.diff(stream, axis=0)[:, :-1], -np.diff(stream, axis=1)[:-1]], axis=-1)
    for _ in range(24):
        warp.advance_prescribed(flow, 0.05)
        for axis, side in ((0, 0.0), (0, 1.0), (1, 0.0), (1, 1.0)):
            edge = np.stack([along, along], axis=-1)
            edge[:, axis] = side
            assert np.abs(warp.at(edge)[:, axis]).max() < 1e-6
    given = np.full((128, 128, 2), 0.05)  # such a map of one's own stays what it is
    warp.set(given)
    assert warp.at(np.array([[0.0, 0.3]])) == pytest.approx(0.05, abs=1e-6)


def test_where_the_fluid_sticks_the_edge_of_the_picture_stays(device: Device) -> None:
    """Once it glides the map glides too, and where it sticks from then on, it stays where it has come to."""
    grid = Grid(16, 16)
    along = np.linspace(0.01, 0.99, 33)
    top = np.stack([along, 0 * along], axis=-1)
    fluid, warp = Fluid(device, grid, FluidParams(walls=Walls("none"))), WarpMap(device, grid, (128, 128))
    stream = np.sin(np.pi * (np.arange(17) / 16))
    flow = 3 * np.stack([np.diff(s := stream[:, None] * stream, axis=0)[:, :-1], -np.diff(s, axis=1)[:-1]], axis=-1)
    fluid.set_velocity(flow)
    for _ in range(24):
        warp.follow(fluid, 0.05)
    assert np.abs(warp.read()).max() > 0.1
    assert np.abs(warp.at(top)).max() < 1e-6
    fluid.params = FluidParams()
    ways = [np.abs(warp.at(top)[:, 0]).max()]
    for _ in range(12):
        warp.follow(fluid, 0.05)
        ways.append(np.abs(warp.at(top)[:, 0]).max())
    assert np.diff(ways) == pytest.approx(np.full(12, ways[-1] / 12), rel=0.1), "no jump where it begins to glide"
    there = warp.at(top)
    assert np.abs(there[:, 0]).max() > 0.05
    fluid.params = FluidParams(walls=Walls("none"))
    for _ in range(24):
        warp.follow(fluid, 0.05)
    assert warp.at(top) == pytest.approx(there, abs=1e-5)
    assert warp.statistics().folds == 0
    for thing in (warp, fluid):
        thing.release()


def test_rest_is_the_identity_exactly(device: Device) -> None:
    warp = WarpMap(device, Grid(20, 12))
    still = device.field((20, 12), 2)
    for _ in range(40):
        warp.advance(still, 0.1)
    assert not warp.read((50, 30)).any()
    assert warp.statistics().det_min == warp.statistics().det_max == 1.0


@pytest.mark.parametrize(("side", "moments"), [(700, (5, 9, 13, 21, 24)), (2560, (10, 18))])
def test_saved_state_goes_on_bit_for_bit(device: Device, side: int, moments: tuple[int, ...]) -> None:
    """From anywhere between two remaps, and where one is half done; also off the GPU, into another map."""
    grid = Grid(48, 48)
    velocity = device.upload(vortex_faces(grid, 0.0))

    def go(warp: WarpMap, steps: int) -> None:
        for _ in range(steps):
            warp.advance(velocity, 0.02)

    warp, states, straight = WarpMap(device, grid, (side, side)), {}, {}
    for step in range(1, moments[-1] + 21):
        go(warp, 1)
        if step in moments:
            states[step] = warp.save()
        if step - 20 in moments:
            straight[step - 20] = warp.read()
    for at, state in states.items():
        assert ("pending" in state.fields) == (at >= 6), "remaps begin at steps 6, 12, 18 and 24"
        assert ("gathered" in state.fields) == (side == 2560 and at >= 12), "and 100 tiles take 13 steps"
        warp.restore(state)
        go(warp, 20)
        np.testing.assert_array_equal(warp.read(), straight[at])
        other = WarpMap(device, grid, (side, side))
        other.advance(velocity, 0.3)
        template = other.save()
        resumed = template.with_arrays(device, state.arrays())
        other.restore(resumed)
        go(other, 20)
        np.testing.assert_array_equal(other.read(), straight[at])
        for made in (state, template, resumed):
            made.release()
        other.release()
    warp.release()


def held_anew(warp: WarpMap) -> None:
    mask = np.zeros((48, 48), np.uint8)
    mask[10:30, 20:40] = 255
    frozen = warp.device.upload(mask)
    warp.hold(frozen)
    warp.advance_prescribed(vortex, 0.05)
    frozen.release()


def bump() -> np.ndarray:
    """A displacement that leads nothing out of the picture."""
    x, y = Grid(48, 48).centres()
    return 0.05 * (np.sin(np.pi * x) * np.sin(np.pi * y))[..., None] * np.array([1.0, -0.5])


CHANGES: dict[str, Callable[[WarpMap], None]] = {
    "a step": lambda warp: warp.advance_prescribed(vortex, 0.02),
    "another map": lambda warp: warp.set(bump()),
    "none": WarpMap.reset,
    "another one after a mask": held_anew,
    "a brush that restores": lambda warp: warp.restore_under((0.5, 0.5), 0.3),
    "what it closes": WarpMap.close,
    "what it takes in": WarpMap.remap,
    "other cells": lambda warp: warp.move_to(Grid(40, 40)),
}


@pytest.mark.parametrize("change", CHANGES)
def test_after_every_change_a_map_is_composed_anew(device: Device, change: str) -> None:
    """Of its own texels and of others; and what stands for all of it differs where it leads elsewhere."""
    warp = WarpMap(device, Grid(48, 48), (96, 96))
    for step in range(12):
        warp.advance_prescribed(vortex, 0.02, 0.02 * step)
    saved = warp.save()
    wants = [((96, 96), False), ((40, 31), False), ((40, 31), True)]
    for changes in (CHANGES[change], lambda warp: warp.restore(saved)):
        before = [warp.composed(size, exact).get() for size, exact in wants]
        version, leads = warp.version, warp.leads
        changes(warp)
        found = [warp.composed(size, exact).get() for size, exact in wants]
        for (size, exact), shown in zip(wants, found, strict=True):
            target = device.field(size, 2)
            warp.draw(target, (0.0, 0.0), target.texel, exact)
            np.testing.assert_allclose(shown, target.get(), atol=1e-6)
            target.release()
        if max(map(difference, found, before)) > 1e-3:
            assert version != warp.version
            assert leads != warp.leads
    saved.release()
    warp.release()


def test_looking_changes_nothing(device: Device) -> None:
    """Whoever reads the map, in whatever way and between whatever steps, it goes on to the same bits."""
    grid = Grid(48, 48)
    velocity = device.upload(vortex_faces(grid, 0.0))
    found = []
    for looked in (False, True):
        warp = WarpMap(device, grid, (400, 400))
        for _ in range(29):
            warp.advance(velocity, 0.02)
            if looked:
                warp.read((50, 50))
                warp.composed()
                warp.statistics()
                warp.at(np.array([[0.3, 0.4]]))
                warp.save().release()
        found.append(warp.read())
        warp.release()
    np.testing.assert_array_equal(*found)


def test_a_remap_of_two_grids_is_as_exact_as_the_finer_of_them_needs(
    device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The map has four texels for a cell of the picture, and fewer for one of the window: there it is read by six."""
    monkeypatch.setattr("solver.warp.remapping.FEW_TILES", -1)  # or the first is taken in before the second is given
    whole = Grid(48, 48)
    part, flow = window(whole.refined(3), 48, 48, 48, 48), swirl((0.5, 0.5), 0.14)
    warp = WarpMap(device, whole, (192, 192))
    warp.set(np.random.default_rng(0).normal(0, 0.001, (192, 192, 2)).astype(np.float32))
    for grid in (part, whole):
        warp.move_to(grid)
        warp.advance_prescribed(flow, 0.03)
    warp.move_to(part)
    before = warp.read(warp.size)
    warp.remap()
    assert difference(warp.read(warp.size), before) < 1e-4
    warp.release()


def test_a_remap_touches_only_what_has_moved(device: Device) -> None:
    """In a window, and saves share the rest; what is moved and what is not meet without a seam."""
    whole = Grid(96, 96)
    warp = WarpMap(device, whole, (1024, 1024))
    warp.set(smooth(np.random.default_rng(1), (64, 64), 0.05))
    first = warp.save()
    warp.move_to(window(whole.refined(2), 60, 60, 48, 48))
    before = warp.read((1024, 1024))
    flow = swirl((84 / 192, 84 / 192), 20 / 192)
    for _ in range(24):
        warp.advance_prescribed(flow, 0.1)
    second = warp.save()
    tiles = (texture for saved in second.tiles.values() for texture in saved.textures)  # what was steep has been closed
    shared = {*first.tiles["accumulated map"].textures}.intersection(tiles)
    assert len(shared) == 16 - 4, "the window lies in four of the tiles"
    warp.remap()
    after = warp.read((1024, 1024))
    outside = np.ones((1024, 1024), bool)
    outside[320:576, 320:576] = False
    np.testing.assert_array_equal(after[outside], before[outside])
    assert np.abs(after - before).max() > 0.05
    first.release()
    second.release()


def test_statistics_tell_the_smallest_and_the_largest_area(device: Device) -> None:
    """det = 1 + .6 (x - 1/2), at places half a cell apart."""
    grid = Grid(64, 32)
    x, y = grid.centres()
    warp = WarpMap(device, grid)
    warp.set(np.stack([0.3 * (x - 0.5) ** 2, 0 * y], axis=-1))
    found = warp.statistics()
    assert (found.det_min, found.det_max) == pytest.approx((0.7, 1.3), abs=0.02)
    warp.release()


def test_statistics_of_linear_maps(device: Device) -> None:
    grid = Grid(32, 16)
    x, y = grid.centres()
    warp = WarpMap(device, grid, (64, 32))
    warp.set(np.stack([0.2 * x, -0.5 * y], axis=-1))
    found = warp.statistics()
    assert found.det_min == pytest.approx(0.6, abs=1e-4)
    assert found.det_max == pytest.approx(0.6, abs=1e-4)
    assert found.folds == 0
    x, y = grid.refined(2).centres()
    displacement = np.hypot(0.2 * x, 0.5 * y)
    assert found.displacement_max == pytest.approx(displacement.max(), rel=1e-4)
    assert found.displacement_mean == pytest.approx(displacement.mean(), rel=1e-4)
    warp.set(np.stack([-2.0 * x, 0 * y], axis=-1))
    assert warp.statistics().folds == warp.statistics().places == 64 * 32
    assert warp.statistics().det_error == pytest.approx(2.0, abs=1e-3)


@pytest.mark.parametrize(
    ("size", "places"),
    [((64, 32), 64 * 32), ((66, 33), 33 * 17), ((128, 64), 64 * 32), ((192, 96), 64 * 32), ((256, 8), 256 * 8)],
)
def test_a_large_map_is_measured_at_as_many_of_its_texels_as_may_be(
    device: Device, monkeypatch: pytest.MonkeyPatch, size: tuple[int, int], places: int
) -> None:
    """At all, or at one of two or three in each direction."""
    monkeypatch.setattr("solver.warp.map.MOST_PLACES", 64 * 32)
    warp = WarpMap(device, Grid.for_picture(*size, 32), size)
    assert warp.statistics().places == places
    warp.release()


@pytest.mark.parametrize(
    ("picture", "result", "wanted"),
    [
        ((96, 48), (96, 48), (96, 48)),  # as large as the map's own
        ((500, 250), (48, 24), (48, 24)),  # of a small result no more than it has
        ((48, 24), (500, 250), (48, 24)),  # nor of a small picture
        ((32, 16), (500, 250), (32, 16)),
        ((6, 3), (500, 250), (32, 16)),  # but two a cell
        ((6, 3), (16, 8), (16, 8)),  # unless the result has fewer
        ((49, 3), (500, 250), (96, 48)),  # a whole number of the map's for one
        ((3, 25), (500, 250), (96, 48)),  # the same along both sides
        ((3, 3), (500, 5), (32, 16)),
        ((500, 250), (20, 24), (48, 24)),
    ],
)
def test_a_map_is_composed_no_finer_than_a_result_needs(
    device: Device, picture: tuple[int, int], result: tuple[int, int], wanted: tuple[int, int]
) -> None:
    """Of 16 x 8 cells, and in a picture that lies on its side; of what is held, all of its texels."""
    lying: list[Any] = [(16, 8), (1.0, 0.5), (96, 48), picture, result, wanted]
    for turn in (1, -1):
        cells, extent, size, given, asked, composed = (side[::turn] for side in lying)
        warp = WarpMap(device, Grid(cells[0], cells[1], extent), size)
        assert warp.size_for(given, asked) == composed
        frozen = device.upload(np.full(size[::-1], 255, np.uint8))
        warp.hold(frozen)
        assert warp.size_for(given, asked) == size
        frozen.release()
        warp.release()


def test_a_fold_between_the_places_that_a_large_map_is_measured_at_is_found_at_all_of_its_texels(
    device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In bands, each of at most so many places, as all at once."""
    size, most = (128, 96), 128 * 96 // 9
    warp = WarpMap(device, Grid.for_picture(*size, 32), size)
    given = np.zeros((96, 128, 2))
    given[46:48, 60:62, 0] = [[1.5 / 128, -1.5 / 128]] * 2
    warp.set(given)
    at_once = warp.statistics(size)
    assert at_once.folds > 0
    for module in ("map", "distortion"):
        monkeypatch.setattr(f"solver.warp.{module}.MOST_PLACES", most)
    assert warp.statistics().places <= most
    in_bands = warp.statistics(size)
    assert vars(in_bands) == pytest.approx(vars(at_once), rel=1e-5)
    assert in_bands.folds > warp.statistics().folds * 9
    warp.release()


def test_a_map_of_any_size_is_taken_over(device: Device) -> None:
    warp = WarpMap(device, Grid(40, 24))
    for size in ((40, 24), (80, 48), (123, 77)):
        given = smooth(np.random.default_rng(5), size, 0.2)
        warp.set(given)
        assert np.abs(warp.read(size) - given).max() < 2e-4
    with pytest.raises(ValueError, match="shape"):
        warp.set(np.zeros((20, 20)))
    with pytest.raises(ValueError, match="finite"):
        warp.set(np.full((20, 20, 2), np.nan))


@pytest.mark.parametrize(("open_edges", "speed"), [(True, 0.02), (False, 0.01)], ids=["open edges", "walls"])
def test_the_chain_rule_tells_of_the_map_as_it_is_looked_up_into_the_corners(
    device: Device, open_edges: bool, speed: float
) -> None:
    """Bent as far as cells can be, at random: differences of the map itself, also where it goes on beyond the cells."""
    rng, warp = np.random.default_rng(1), WarpMap(device, Grid(16, 12), (256, 192))
    if open_edges:  # as of every map that is set; what is not, twice as fast a flow presses to its edges and is cut off
        warp.set(np.zeros((192, 256, 2)))
    warp.advance_prescribed(rng.normal(0, speed, (12, 16, 2)), 1.0)
    points = np.concatenate([rng.uniform(0.01, 0.74, (200, 2)), rng.uniform(0.002, 0.03, (200, 2))])
    step = np.eye(2) * 1e-3
    jacobian = np.stack([(warp.at(points + e) - warp.at(points - e)) / 2e-3 + 1e3 * e for e in step], axis=-1)
    error = np.abs(np.linalg.det(jacobian.astype(np.float64)) - warp.determinants(points))
    assert np.median(error) < 2e-3
    assert np.sort(error)[-20] < 0.05, "but where a difference reaches over the side of a cell"
    assert error[200:].max() < 0.02, "the corner's cell has none"
    warp.release()


@pytest.mark.parametrize(
    "sticky", [(True, False, False, True), (False, True, False, False), (False, False, True, True)]
)
def test_the_chain_rule_tells_of_the_map_along_each_edge_whichever_of_them_the_fluid_sticks_to(
    device: Device, sticky: tuple[bool, bool, bool, bool]
) -> None:
    """Within the outermost texels, before all that has moved is taken in and after."""
    rng, grid, step = np.random.default_rng(3), Grid(12, 9), np.eye(2) * 1e-3
    fluid, warp = Fluid(device, grid, FluidParams(walls=Walls(sticky=sticky))), WarpMap(device, grid, (36, 27))
    points = (rng.integers((0, 0), (35, 26), (4, 50, 2)) + rng.uniform(0.6, 1.4, (4, 50, 2))) / 36  # beside no centre
    for side, (axis, edge) in enumerate(((0, 0.0), (0, 1.0), (1, 0.0), (1, 0.75))):
        points[side, :, axis] = np.abs(edge - rng.uniform(0.002, 0.012, 50))
    points = points.reshape(200, 2)
    fluid.set_velocity(rng.normal(0, 0.03, (9, 12, 2)))
    warp.follow(fluid, 1.0)
    for _ in range(2):
        jacobian = np.stack([(warp.at(points + e) - warp.at(points - e)) / 2e-3 + 1e3 * e for e in step], axis=-1)
        error = np.abs(np.linalg.det(jacobian.astype(np.float64)) - warp.determinants(points))
        assert error.max() < 0.06
        warp.remap()
    for thing in (warp, fluid):
        thing.release()


def test_restoring_makes_the_identity_under_the_brush_without_folds(device: Device) -> None:
    grid = Grid(64, 48)
    warp = WarpMap(device, grid)
    warp.set(smooth(np.random.default_rng(6), grid.size, 0.03))
    warp.advance_prescribed(vortex, 0.02)
    before = warp.read()
    for _ in range(60):
        warp.restore_under((0.5, 0.4), 0.3, hardness=0.4, amount=0.15)
        assert warp.statistics().folds == 0
    x, y = grid.centres()
    far = np.hypot(x - 0.5, y - 0.4)
    after = np.abs(warp.read())
    assert after[far < 0.1].max() < 1e-4
    np.testing.assert_allclose(warp.read()[far > 0.32], before[far > 0.32], atol=2e-3)
    warp.reset()
    assert not warp.read().any()


def test_restoring_around_what_was_frozen_in_motion_makes_the_identity_too(device: Device) -> None:
    """All of the map goes where the brush is full, six cells beside the frozen; nothing of it there, nor by a step."""
    grid = Grid(64, 48)
    warp = WarpMap(device, grid)
    warp.set(smooth(np.random.default_rng(6), grid.size, 0.03))
    warp.advance_prescribed(vortex, 0.05)
    x, y = grid.centres()
    warp.hold(device.upload((np.hypot(x - 0.5, y - 0.4) < 0.1).astype(np.uint8) * 255))
    turn, r = np.linspace(0, 2 * np.pi, 16, endpoint=False)[:, None], np.linspace(0.05, 0.25, 401)
    rays = np.stack([0.5 + r * np.cos(turn), 0.4 + r * np.sin(turn)], axis=-1)
    before = warp.at(rays.reshape(-1, 2)).reshape(rays.shape)
    warp.restore_under((0.5, 0.4), 0.3, hardness=0.9, amount=1.0)
    after = warp.at(rays.reshape(-1, 2)).reshape(rays.shape)
    assert np.abs(before).max() > 0.05
    np.testing.assert_array_equal(after[:, r < 0.08], before[:, r < 0.08])
    assert np.abs(after[:, r > 0.2]).max() < 1e-6
    assert np.linalg.norm(np.diff(after, axis=1), axis=-1).max() < 0.005
    warp.release()


def test_forward_map_follows_the_particles(device: Device) -> None:
    """Half a turn of the vortex: points of the original are found where particles have gone, and back."""
    grid = Grid(64, 64)
    warp = WarpMap(device, grid)
    end, steps = 1.5, 150
    for step in range(steps):
        warp.advance_prescribed(vortex, end / steps, step * end / steps)
    x, y = grid.centres()
    true_x, true_y = reference.follow(vortex, x, y, 0.0, end, 200)
    forward = ForwardMap(warp)
    found = forward.read()
    error = np.hypot(x + found[..., 0] - true_x, y + found[..., 1] - true_y)
    assert error.mean() < 0.003 * grid.h
    assert error.max() < 0.05 * grid.h
    points = np.stack([x, y], axis=-1).reshape(-1, 2)
    gone = points + forward.at(points)
    np.testing.assert_allclose(gone.reshape(64, 64, 2), np.stack([x, y], axis=-1) + found, atol=1e-6)
    assert np.abs(gone + warp.at(gone) - points).mean() < 1e-3 * grid.h


def test_forward_map_of_what_is_stirred_hard_is_as_exact(device: Device) -> None:
    """More than half a turn, with points wherever they fall: Newton's method goes on until float32 ends it."""
    grid = Grid(64, 64)
    warp = WarpMap(device, grid)
    for step in range(120):
        warp.advance_prescribed(vortex, 1 / 60, step / 60)
    points = np.random.default_rng(3).uniform(0.02, 0.98, (20000, 2))
    gone = points + ForwardMap(warp).at(points)
    left = np.hypot(*(gone + warp.at(gone) - points).T) / grid.h  # by the map itself
    assert np.median(left) < 1e-4
    assert np.quantile(left, 0.99) < 0.01


@pytest.mark.parametrize("folded", [False, True])
def test_forward_map_of_a_few_points_needs_a_part_of_the_map_only(
    device: Device, monkeypatch: pytest.MonkeyPatch, folded: bool
) -> None:
    """To the bit as where all of it is put together: at the edges, beyond them, and where it is wound up or folded."""
    grid = Grid(64, 48)
    rng = np.random.default_rng(4)
    warp = WarpMap(device, grid, (2560, 1920))
    if folded:
        warp.set(smooth(rng, warp.size, 0.4))
    for step in range(40):
        warp.advance_prescribed(vortex, 1 / 60, step / 60)
    points = np.vstack([rng.uniform((-0.1, -0.1), (1.1, 0.9), (24, 2)), [(0.0, 0.0), (1.0, 0.75), (0.5, 0.375)]])
    forward = ForwardMap(warp)
    drawn, few, draw = list[float](), [], WarpMap.draw

    def note(self: WarpMap, target: Field, *args: Any, **more: Any) -> None:
        drawn.append(np.prod(target.size) / np.prod(self.size))
        target.clear(np.nan, np.nan)
        draw(self, target, *args, **more)

    monkeypatch.setattr(WarpMap, "draw", note)
    for each in np.array_split(points, 9):
        few.append(forward.at(each))
        assert 0 < sum(drawn) < 0.5
        drawn.clear()
    many = np.tile(points, (40, 1))
    np.testing.assert_array_equal(np.concatenate(few), forward.at(many)[: len(points)])
    assert not drawn
    forward.release()
    warp.release()


@pytest.mark.parametrize("strength", [0.0, 0.1, 0.4, 2.0])
def test_forward_map_of_a_few_points_draws_only_what_is_looked_up_at_them(
    device: Device, monkeypatch: pytest.MonkeyPatch, strength: float
) -> None:
    """To the bit as where all cells are drawn, however far they go and wherever the points lie."""
    rng, drawn, call = np.random.default_rng(5), list[int](), Pass.__call__
    warp = WarpMap(device, Grid(64, 48), (1280, 960))
    if strength:
        warp.set(smooth(rng, warp.size, strength))
    inside, at_edges = rng.uniform((0.0, 0.0), (1.0, 0.75), (30, 2)), [(0.0, 0.0), (1.0, 0.75), (1.0, 0.2), (1.2, -0.3)]
    points = np.vstack([inside, at_edges])

    def note(self: Pass, *args: Any, triangles: Any = None, **more: Any) -> None:
        if triangles is not None:
            drawn.append(triangles[1])
        call(self, *args, triangles=triangles, **more)

    monkeypatch.setattr(Pass, "__call__", note)
    whole, few = ForwardMap(warp), ForwardMap(warp)
    wanted = whole.at(np.tile(points, (250, 1)))[: len(points)]
    (all_of_it,) = drawn
    drawn.clear()
    for point, expected in zip(points, wanted, strict=True):
        np.testing.assert_array_equal(few.at(point[None])[0], expected)
    assert sum(drawn) < 0.01 * all_of_it * len(points)
    np.testing.assert_array_equal(few.at(points), wanted)
    drawn.clear()
    few.at(points)
    few.at(np.tile(points, (250, 1)))
    few.at(points[:1])
    assert drawn == [all_of_it]  # what is known is not drawn anew
    for thing in (whole, few, warp):
        thing.release()


def test_forward_map_of_a_folded_one_is_finite(device: Device) -> None:
    grid = Grid(32, 20)
    warp = WarpMap(device, grid)
    warp.set(smooth(np.random.default_rng(8), grid.size, 0.4))
    assert warp.statistics().folds > 0
    found = ForwardMap(warp).read()
    x, _ = grid.centres()
    assert np.isfinite(found).all()
    assert (np.abs(x + found[..., 0] - 0.5) <= 0.5 + 1e-6).all()


def test_frozen_pixels_keep_every_bit(device: Device) -> None:
    """Whatever moved there before: frozen at random, thawed and frozen again, under the flow and the restore brush."""
    grid = Grid(41, 27)
    rng = np.random.default_rng(9)
    warp, sampler = WarpMap(device, grid), Sampler(device)
    masks, fluid = Masks(device, grid), Fluid(device, grid)
    masks.set_base(1e-4)
    picture = rng.integers(0, 256, (193, 301, 3), np.uint8)
    row, column = np.mgrid[0:193, 0:301]
    row, column = row * grid.ny // 193, column * grid.nx // 301
    points = rng.random((300, 2)) * grid.extent
    cell = (points / grid.h).astype(int)
    fluid.set_velocity(smooth(rng, grid.size, 0.3))
    for share in (0.005, 0.03, 0.0, 0.02):
        frozen = rng.random((grid.ny, grid.nx)) < share
        masks.set_frozen(frozen)
        masks.apply(fluid)
        warp.hold(device.upload(frozen.astype(np.uint8) * 255))
        fluid.step(0.02)
        flow = fluid.faces().get()
        before = warp.read((301, 193)), sampler.apply(warp, picture), warp.at(points)
        for step in range(35):
            warp.advance_prescribed(flow, 0.02)
            warp.restore_under((0.5, 0.3), 0.3, 0.5, 0.02)
            if step in (0, 20, 34):
                after = warp.read((301, 193)), sampler.apply(warp, picture), warp.at(points)
                for now, then, kept in zip(
                    after, before, (frozen[row, column],) * 2 + (frozen[cell[:, 1], cell[:, 0]],), strict=True
                ):
                    np.testing.assert_array_equal(now[kept], then[kept])
        assert np.abs(after[0] - before[0]).max() > 1e-3
    assert np.abs(before[0])[frozen[row, column]].max() > 1e-3, "what had moved before it was frozen"


@pytest.mark.parametrize("texels", [(700, 530), (350, 265)], ids=["the map's texels", "coarser ones"])
def test_what_is_held_is_found_where_the_mask_has_changed(device: Device, texels: tuple[int, int]) -> None:
    """Frozen and thawed piece by piece: the same texels as found at once, each with the map as it was held first."""
    size, rng = (700, 530), np.random.default_rng(4)
    grid = Grid(*size)
    warp, mask = WarpMap(device, Grid(70, 53, grid.extent), size), TiledField(device, texels, 1, "mask", "f1")
    frozen, values = Frozen(device, size), np.zeros(texels[::-1], np.uint8)
    before, wanted = np.zeros(size[::-1], bool), np.zeros((*size[::-1], 2), np.float32)
    scale = size[0] // texels[0]
    inside = np.outer(np.sin(np.linspace(0, np.pi, 53)), np.sin(np.linspace(0, np.pi, 70)))
    for step in range(12):
        x, y = (int(n) for n in rng.integers(0, texels))
        width, height = min(40, texels[0] - x), min(60, texels[1] - y)
        values[y : y + height, x : x + width] = rng.choice([0, 100, 127, 128, 200])
        changed = x, y, width, height
        if step == 7:
            values[:], changed = 100, (0, 0, *texels)
        mask.set(values)
        warp.set(smooth(rng, (70, 53), 0.01) * inside[..., None])
        frozen.hold(mask, changed, warp.draw_held)
        fine = (values > 127).repeat(scale, axis=0).repeat(scale, axis=1)
        assert frozen.held is not None
        assert frozen.kept is not None
        within, around = (np.asarray(ndimage.binary_dilation(fine, np.ones((n, n))), bool) for n in (3, 7))
        found, far = frozen.held.get(), np.full(around.shape, FADED + 1)
        if around.any():
            far = np.asarray(ndimage.distance_transform_cdt(~around, "taxicab"))
        wanted_held, near = np.where(within, 255, np.where(around, 170, 127 - far)), far <= FADED
        np.testing.assert_array_equal(found[near], wanted_held[near])
        assert found[~near].max(initial=0) < 127 - FADED
        wanted[around & ~before] = warp.composed().get()[around & ~before]
        np.testing.assert_array_equal(frozen.kept.get()[around], wanted[around])
        before = around
    assert np.abs(wanted).max() > 1e-3
    for thing in (frozen, mask, warp):
        thing.release()


def test_a_map_as_tall_as_a_texture_may_be_is_held_up_to_its_edges(device: Device) -> None:
    tall = device.limits.max_texture_size
    frozen, values = Frozen(device, (8, tall)), np.zeros((tall, 8), np.uint8)
    values[0] = values[-1] = 255
    mask = device.upload(values)
    frozen.hold(mask, (0, 0, *mask.size), lambda *_: None)
    assert frozen.held is not None
    assert (np.flatnonzero(frozen.held.get()[:, 0] > 127) % tall).tolist() == [0, 1, 2, 3, *range(tall - 4, tall)]
    for thing in (frozen, mask):
        thing.release()


def test_a_lattice_of_the_map_is_what_it_is_at_its_points(device: Device) -> None:
    """About what is held, far from it, and where it was thawed: also after going back, and on a lattice of a part."""
    grid, size, rng = Grid(64, 40), (320, 200), np.random.default_rng(8)
    warp, mask = WarpMap(device, grid, size), np.zeros((200, 320), np.uint8)
    flow = device.upload(smooth(rng, grid.size, 0.3), "flow")
    target = device.field((90, 70), 2, "part")
    row, column = np.mgrid[0:70, 0:90]
    origin, step = (13.7, -2.3), (1 / 120, 1 / 75)
    places = np.stack([(column + 0.5 + origin[0]) * step[0], (row + 0.5 + origin[1]) * step[1]], axis=-1)
    inside = (np.abs(places - 0.5) < 0.5).all(axis=-1)
    points = places[inside] * grid.picture
    saved, most = None, 0.0
    for tick in range(48):
        warp.advance(flow, 0.02)
        if tick in (5, 20, 40):
            mask[:] = 0
            mask[60 + tick : 80 + tick, 150 - tick : 190] = 255
            warp.hold(device.upload(mask))
        if tick == 30:
            saved = warp.save()
        if tick == 44 and saved:
            warp.restore(saved)
        if tick % 6 == 0 or tick > 40:
            warp.draw(target, origin, step, exact=True)
            drawn, found = target.get()[inside], warp.at(points)
            np.testing.assert_allclose(drawn, found, atol=2e-6)
            most = max(most, np.abs(found).max())
    assert most > 0.03
    assert warp.held is not None
    if saved:
        saved.release()
    warp.release()


def test_a_coarse_look_at_the_map_is_as_exact_as_itself(device: Device) -> None:
    """Between texels that are twice as far apart as the map's it is off by more; on a finer lattice it is the cubic."""
    grid, rng = Grid(48, 32), np.random.default_rng(3)
    warp = WarpMap(device, grid, (192, 128))
    for _ in range(20):
        warp.advance(device.upload(smooth(rng, grid.size, 0.2), "flow"), 0.02)
    warp.remap()
    found = {}
    for size in ((90, 60), (400, 260)):
        for coarsely in (False, True):
            target = device.field(size, 2, "look")
            warp.draw(target, (0.0, 0.0), target.texel, coarsely=coarsely)
            found[size, coarsely] = target.get()
    np.testing.assert_array_equal(found[(400, 260), True], found[(400, 260), False])
    cubic, linear = found[(90, 60), False], found[(90, 60), True]
    between = np.abs(0.5 * (cubic[:-2] + cubic[2:]) - cubic[1:-1]).max()
    assert 0 < np.abs(linear - cubic).max() < 0.5 * between


def test_holding_what_is_frozen_leaves_the_rest_as_it_flows(device: Device) -> None:
    """A frozen disc in the vortex: the same areas, and the same map two cells away, as if only the fluid knew of it."""
    grid = Grid(64, 64)
    x, y = grid.centres()
    disc = np.hypot(x - 0.55, y - 0.5) < 0.12
    found = []
    for held in (False, True):
        masks, fluid, warp = Masks(device, grid), Fluid(device, grid), WarpMap(device, grid)
        masks.set_base(1e-2)
        masks.set_frozen(disc)
        masks.apply(fluid)
        if held:
            warp.hold(device.upload(disc.astype(np.uint8) * 255))
        fluid.set_velocity(0.3 * vortex_faces(grid, 0.0))
        for _ in range(20):
            fluid.step(1 / 60)
            warp.follow(fluid, 1 / 60)
        found.append((warp.statistics(), warp.read()))
    (free, free_map), (held, held_map) = found
    assert held.folds == free.folds == 0
    assert held.det_error < 1.02 * free.det_error
    assert held.displacement_max == free.displacement_max > 0.02
    away = ~np.asarray(ndimage.binary_dilation(disc, np.ones((3, 3)), iterations=4), bool)
    assert np.abs(held_map - free_map)[away].max() < 0.02 * grid.h
    assert not held_map[disc].any()


@pytest.mark.parametrize("steps", [7, 13])
def test_what_is_frozen_while_the_map_is_made_anew_is_taken_in_once(device: Device, steps: int) -> None:
    """A submap that waits and one that has moved on, a disc frozen then: remaps leave the map as it is around too."""
    grid = Grid(48, 48)
    warp = WarpMap(device, grid, (384, 384), remap_every=5)
    for step in range(steps):
        warp.advance_prescribed(swirl((0.7, 0.7), 0.28), 0.04, step * 0.04)
    x, y = Grid(384, 384).centres()
    disc = np.hypot(x - 0.78, y - 0.7) < 0.07
    warp.hold(device.upload(disc.astype(np.uint8) * 255))
    before = warp.read((384, 384))
    assert np.abs(before[disc]).max() > 2 * grid.h
    for _ in range(2):
        warp.remap()
        after = warp.read((384, 384))
        np.testing.assert_array_equal(after[disc], before[disc])
        assert np.abs(after - before).max() < 5e-3 * grid.h
        warp.advance_prescribed(lambda x, y, t: (0 * x, 0 * y), 0.04)


@pytest.mark.parametrize("then", ["nothing", "elsewhere"])
def test_what_has_moved_since_what_moved_under_a_mask_alone_is_taken_in_when_that_changes(
    device: Device, monkeypatch: pytest.MonkeyPatch, then: str
) -> None:
    """A submap waits whose motion counts nowhere, as all of it is frozen; the next one takes its place at once."""
    monkeypatch.setattr("solver.warp.remapping.FEW_TILES", -1)  # or it does not wait
    grid, x, y = Grid(48, 48), *Grid(384, 384).centres()
    warp, alone = (WarpMap(device, grid, (384, 384), remap_every=4) for _ in range(2))
    masks = [device.upload((np.hypot(x - at, y - 0.3) < 0.2).astype(np.uint8) * 255) for at in (0.3, 0.7)]
    warp.hold(masks[0])
    for _ in range(4):
        warp.advance_prescribed(swirl((0.3, 0.3), 0.12), 0.04)
    for number, flow in enumerate((swirl((0.7, 0.7), 0.2), swirl((0.8, 0.75), 0.2))):
        for _ in range(4 + 20 * number):
            for each in (warp, alone):
                each.advance_prescribed(flow, 0.04)
        if not number:
            warp.hold(masks[1] if then == "elsewhere" else None)
        wanted = alone.read((384, 384))
        assert np.abs(wanted).max() > grid.h
        assert difference(warp.read((384, 384)), wanted) < 0.01 * grid.h
    for each in (warp, alone):
        each.release()


def test_the_distortion_of_what_is_frozen_is_that_of_what_is_looked_up(device: Device) -> None:
    grid = Grid(64, 64)
    masks, fluid, warp = Masks(device, grid), Fluid(device, grid), WarpMap(device, grid)
    fluid.set_velocity(lambda x, y, t: vortex(x, y, 0.0))
    for _ in range(20):
        fluid.step(1 / 30)
        warp.follow(fluid, 1 / 30)
    x, y = grid.centres()
    disc = np.hypot(x - 0.6, y - 0.5) < 0.12
    masks.set_frozen(disc)
    masks.apply(fluid)
    texels = np.stack(Grid(*warp.size).centres(), axis=-1).reshape(-1, 2)
    free = warp.determinants(texels)
    warp.hold(device.upload(disc.astype(np.uint8) * 255))
    assert np.abs(warp.determinants(texels) - free).max() < 0.05
    points = np.array([0.6, 0.5]) + np.random.default_rng(1).uniform(-0.06, 0.06, (200, 2))
    before, step = warp.determinants(points), 1 / 2048
    for _ in range(20):
        fluid.step(1 / 30)
        warp.follow(fluid, 1 / 30)
    warp.remap()
    np.testing.assert_array_equal(warp.determinants(points), before)
    across, down = (
        (warp.at(points + ahead).astype(np.float64) - warp.at(points - ahead)) / (2 * step)
        for ahead in step * np.eye(2)
    )
    differences = np.linalg.det(np.stack([across, down], axis=-1) + np.eye(2))
    assert np.median(np.abs(before - differences)) < 1e-3


def window(whole: Grid, left: int, top: int, nx: int, ny: int) -> Grid:
    """Some cells of a grid."""
    hx, hy = whole.spacing
    return Grid(nx, ny, (nx * hx, ny * hy), (left * hx, top * hy), whole.picture)


def swirl(centre: tuple[float, float], radius: float):
    """A flow that comes to rest `radius` from a centre, and is at rest beyond."""

    def velocity(x: np.ndarray, y: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
        right, down = x - centre[0], y - centre[1]
        turn = 4 * np.clip(1 - (right**2 + down**2) / radius**2, 0, None) ** 4
        return -turn * down, turn * right

    return velocity


def test_a_window_carries_what_the_whole_picture_carries(device: Device) -> None:
    """What moves within a window only, on the same cells; and outside it nothing."""
    whole = Grid(96, 64)
    part = window(whole, 20, 8, 40, 48)
    flow = swirl((40 * whole.h, 32 * whole.h), 15 * whole.h)
    maps = [WarpMap(device, grid, (384, 256)) for grid in (whole, part)]
    for warp in maps:
        for step in range(70):
            warp.advance_prescribed(flow, 0.05, step * 0.05)
    all_of_it, some = (warp.read((384, 256)) for warp in maps)
    assert np.abs(all_of_it).max() > 5 * whole.h
    assert np.abs(some - all_of_it).max() < 2e-3 * whole.h
    assert np.abs(maps[1].at(np.array([[0.4, 0.3]])) - maps[0].at(np.array([[0.4, 0.3]]))).max() < 2e-3 * whole.h
    outside = np.ones((256, 384), bool)
    outside[32:224, 80:240] = False
    assert not some[outside].any()


def test_at_the_inner_sides_of_a_window_the_map_has_no_step(device: Device) -> None:
    """What moves along them has come to rest there; at the picture's edge it glides on."""
    cells = window(Grid(32, 32), 8, 0, 16, 16)
    fluid, warp = Fluid(device, cells), WarpMap(device, cells, (128, 128))
    x, y = (np.arange(17) / 16 for _ in range(2))
    stream = 0.2 * np.sin(np.pi * x)[None] * np.sin(np.pi * y)[:, None]
    fluid.set_velocity(32 * np.stack([np.diff(stream, axis=0)[:, :-1], -np.diff(stream, axis=1)[:-1]], axis=-1))
    for _ in range(12):
        warp.follow(fluid, 1 / 600)
    (left, top), (width, height) = cells.origin, cells.extent
    along = np.linspace(0.02, 0.98, 33)
    inner = [(0 * along + left, top + height * along), (0 * along + left + width, top + height * along)]
    inner += [(left + width * along, 0 * along + top + height)]
    for side in inner:
        assert np.abs(warp.at(np.stack(side, axis=-1))).max() < 1e-6
    edge = warp.at(np.stack([left + width * along, 0 * along], axis=-1))
    assert np.abs(edge[:, 0]).max() > 0.005
    for thing in (fluid, warp):
        thing.release()


def wound_up(device: Device, time: float) -> WarpMap:
    """A map, of four texels a cell, that a swirl in the middle has wound up for so many seconds."""
    warp, flow = WarpMap(device, Grid(48, 48)), swirl((0.5, 0.5), 0.45)
    for _ in range(round(time / 0.05)):
        warp.advance_prescribed(flow, 0.05)
    return warp


def closed(warp: WarpMap) -> int:
    """How many maps it has closed."""
    return sum(name.startswith("closed") for name in saved_tiles(warp))


def saved_tiles(warp: WarpMap) -> set[str]:
    state = warp.save()
    names = set(state.tiles)
    state.release()
    return names


def test_what_is_wound_up_does_not_fold(device: Device) -> None:
    """Against the exact solution, in which each place has gone round by its own angle: stretched up to 30 times.

    One map on these texels would fold at a tenth of the places, with det J of -22 to 29.
    """
    warp = wound_up(device, 10.0)
    statistics = warp.statistics()
    assert statistics.folds == 0
    assert statistics.det_min > 0.95
    assert statistics.det_max < 1.05
    points = np.random.default_rng(0).random((4000, 2))
    right, down = (points - 0.5).T
    turn = -40 * np.clip(1 - (right**2 + down**2) / 0.45**2, 0, None) ** 4
    exact = np.stack([np.cos(turn) * right - np.sin(turn) * down, np.sin(turn) * right + np.cos(turn) * down], axis=-1)
    assert np.linalg.norm(warp.at(points) - (exact - (points - 0.5)), axis=-1).max() * 48 < 0.25, "cells"
    assert 3 <= closed(warp) <= 6
    warp.remap()
    assert difference(warp.composed(exact=True).get(), warp.read(warp.size)) == 0
    warp.reset()
    assert closed(warp) == 0
    assert not warp.read().any()
    warp.release()


@pytest.mark.parametrize("texels", [4, 6])
@pytest.mark.parametrize("seed", [2, 3, 11])
def test_a_map_is_closed_before_it_is_too_steep(seed: int, texels: int, device: Device) -> None:
    """Swirls one after another. With 6 texels a cell maps closed once they were too steep had a det J of .12, .06, -2.6
    in the end; with 4 maps closed by their steepness alone one of .16, -.18, .23."""
    rng, warp = np.random.default_rng(seed), WarpMap(device, Grid(32, 32), (32 * texels, 32 * texels))
    for _ in range(10):
        radius = rng.uniform(0.12, 0.3)
        flow, speed = swirl(tuple(rng.uniform(0.3, 0.7, 2)), radius), rng.choice([-2.0, 2.0])
        for _ in range(5):
            warp.advance_prescribed(lambda x, y, t, flow=flow, by=speed: tuple(by * v for v in flow(x, y, t)), 0.05)
    assert closed(warp) > 0
    assert warp.statistics().det_min > 0.5
    warp.release()


def test_a_bend_at_the_border_of_what_is_held_closes_no_map(device: Device) -> None:
    """There the cells around a texel rightly differ in their det J: what is held does not move."""
    warp, frozen = WarpMap(device, Grid(32, 32), (128, 128)), np.zeros((128, 128), np.float32)
    frozen[:, :40] = 1.0
    warp.hold(device.upload(frozen))

    def flow(x: np.ndarray, y: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
        speed = np.exp(-(((x - 0.3125) / 0.1) ** 2)) * np.sin(np.pi * y) ** 2 / 32
        return 0.35 * speed, 1.2 * speed

    for part in (0.1, 1.0, 1.0):
        warp.advance_prescribed(flow, part)
        warp.remap()
    assert closed(warp) == 0
    warp.release()


def test_a_map_that_is_closed_leads_where_it_has_led(device: Device) -> None:
    """Also what a remap has begun to take in; and of more than there may be none is closed."""
    warp = wound_up(device, 1.0)
    before = warp.read(warp.size)
    for number in range(MOST_CLOSED):
        assert closed(warp) == number
        warp.close()
        assert difference(warp.read(warp.size), before) < 1e-5
    warp.close()
    assert closed(warp) == MOST_CLOSED
    assert difference(warp.read(warp.size), before) < 1e-5
    warp.release()


def test_a_map_that_was_folded_before_is_not_closed_for_that(device: Device) -> None:
    """Closing would not mend it, and each remap would close one more."""
    warp, x = WarpMap(device, Grid(32, 32), (128, 128)), (np.arange(128) + 0.5) / 128
    given = np.zeros((128, 128, 2), np.float32)
    given[..., 0] = 0.02 * np.sin(32 * np.pi * x)
    warp.set(given)
    assert warp.statistics().folds > 0
    for _ in range(3):
        warp.advance_prescribed(lambda x, y, t: (0 * x + 0.05 / 32, 0 * x), 1.0)
        warp.remap()
    assert closed(warp) == 0
    warp.release()


def test_closed_maps_are_saved_and_come_back(device: Device) -> None:
    """To the same map, with none of them yet and with more than there were; also off the GPU, into another."""
    warp, flow = wound_up(device, 4.0), swirl((0.5, 0.5), 0.45)
    state, before = warp.save(), warp.read()
    count = closed(warp)
    assert count >= 1
    for _ in range(60):
        warp.advance_prescribed(flow, 0.05)
    assert closed(warp) > count
    later = warp.read()
    other = WarpMap(device, warp.grid)
    template = other.save()
    resumed = template.with_arrays(device, state.arrays())
    for again, moment in ((warp, state), (other, resumed)):
        again.restore(moment)
        np.testing.assert_array_equal(again.read(), before)
        for _ in range(60):
            again.advance_prescribed(flow, 0.05)
        np.testing.assert_array_equal(again.read(), later)
    arrays = state.arrays()
    broken = {name: array for name, array in arrays.items() if name != "closed map 0/texels"}
    with pytest.raises(ValueError, match="tiles are missing"):
        template.with_arrays(device, broken)
    parts = {part: arrays[f"closed map 0/{part}"] for part in ("places", "texels")}
    nine = {f"closed map {number}/{part}": array for number in range(9) for part, array in parts.items()}
    with pytest.raises(ValueError, match="9 closed ones, more than there may be"):
        template.with_arrays(device, arrays | nine)
    other.restore(template)
    assert not other.read().any()
    for made in (state, template, resumed, warp, other):
        made.release()


def test_a_map_of_more_texels_is_closed_later(device: Device) -> None:
    """With four times the texels along a cell, at most half as often, and det J stays 1 within 5 % either way."""
    grid, flow, points = Grid(48, 48), swirl((0.5, 0.5), 0.45), np.random.default_rng(0).uniform(0.36, 0.64, (4000, 2))
    maps = [WarpMap(device, grid, (size, size)) for size in (192, 768)]
    for _ in range(120):
        for warp in maps:
            warp.advance_prescribed(flow, 0.05)
    few, many = (closed(warp) for warp in maps)
    assert 1 <= many <= few / 2
    least = [warp.determinants(points).min() for warp in maps]
    assert min(least) > 0.95
    for warp in maps:
        warp.release()


def test_closed_maps_of_a_large_map_have_as_many_texels_as_there_is_room_for(
    device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Room for one of 16 texels a cell: with half as many each way it does not fold either, and saved states go on."""
    monkeypatch.setattr("solver.warp.accumulated.MOST_CLOSED_BYTES", 768 * 768 * 8)
    grid, flow = Grid(48, 48), swirl((0.5, 0.5), 0.45)
    warp, then, frozen = (WarpMap(device, grid, (768, 768)) for _ in range(3))
    frozen.hold(device.upload(np.eye(16, dtype=np.uint8) * 255))
    for step in range(160):
        if step == 100:
            warp.remap()
            warp.restore_under((0.8, 0.8), 0.2, 0.0, 0.1)  # an edge as wide as eight cells
            state = warp.save()
        for one in (warp, frozen):
            one.advance_prescribed(flow, 0.05)
    count = closed(warp)
    assert count >= 2
    assert {tuple(size) for size in state.values["closed sizes"].tolist()} == {(384, 384), (768, 768)}
    beside = frozen.save()
    assert beside.values["closed sizes"].tolist() == [[768, 768]], "in full beside what is held"
    points = np.random.default_rng(0).random((4000, 2))
    right, down = (points - 0.5).T
    turn = -32 * np.clip(1 - (right**2 + down**2) / 0.45**2, 0, None) ** 4
    exact = np.stack([np.cos(turn) * right - np.sin(turn) * down, np.sin(turn) * right + np.cos(turn) * down], axis=-1)
    off = np.linalg.norm(warp.at(points) - (exact - (points - 0.5)), axis=-1) * 48
    assert off[np.hypot(right, down) < 0.2].max() < 0.25, "cells"
    assert warp.determinants(points)[np.hypot(right, down) < 0.2].min() > 0.9
    later, template = warp.read(), then.save()
    resumed = template.with_arrays(device, state.arrays())
    then.restore(resumed)
    for _ in range(60):
        then.advance_prescribed(flow, 0.05)
    np.testing.assert_array_equal(then.read(), later)
    for sizes in (np.full((count + 2, 2), 384), np.full((count, 2), 999)):
        with pytest.raises(ValueError, match="sizes of its closed maps"):
            template.with_arrays(device, state.arrays() | {"closed sizes": sizes})
    for made in (state, beside, template, resumed, warp, then, frozen):
        made.release()


@pytest.mark.parametrize("centre", [(0.15, 0.15), (0.85, 0.15), (0.15, 0.85), (0.85, 0.85)])
def test_a_map_is_closed_with_fewer_texels_wherever_it_has_moved(
    device: Device, monkeypatch: pytest.MonkeyPatch, centre: tuple[float, float]
) -> None:
    """Of nine tiles the flow has reached one, in a corner."""
    monkeypatch.setattr("solver.warp.accumulated.MOST_CLOSED_BYTES", 768 * 768 * 8)
    warp = WarpMap(device, Grid(48, 48), (768, 768))
    for _ in range(10):
        warp.advance_prescribed(swirl(centre, 0.14), 0.05)
    before = warp.read(warp.size)
    assert np.abs(before).max() > 0.5 / 48
    warp.close()
    state = warp.save()
    assert state.values["closed sizes"].tolist() == [[384, 384]]
    assert difference(warp.read(warp.size), before) < 0.1 / 48
    state.release()
    warp.release()


@pytest.mark.parametrize("undo", [False, True])
def test_closed_maps_without_room_for_the_picture_are_boxes_of_it(
    undo: bool, device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They lead as those all over the picture do, are saved and come back, and are undone by the restore brush."""
    grid = Grid(192, 128, (1.0, 2 / 3))
    # At the left and the upper edge of the picture, away from all, and at the right and the lower edge.
    flows = [swirl(centre, 0.12) for centre in ((0.1, 0.11), (0.5, 0.3), (0.5, 0.32) if undo else (0.92, 0.6))]
    found = []
    for room in (2**27, 2**27, 1536 * 1024 * 8 - 1):
        monkeypatch.setattr("solver.warp.accumulated.MOST_CLOSED_BYTES", room)
        warp = WarpMap(device, grid, (1536, 1024))
        for number, flow in enumerate(flows):
            for _ in range(12):
                warp.advance_prescribed(flow, 0.04)
            warp.remap()
            warp.close()
            if undo and number == 1:
                warp.restore_under((0.5, 0.33), 0.07, 0.5, 0.6)
        found.append(warp)
    whole, again, boxed = found
    state = boxed.save()
    regions = state.values["closed regions"]
    assert len(regions) == (4 if undo else 3)
    assert (regions[:, 2:] < (1536, 1024)).any(axis=1).all()
    points = np.random.default_rng(2).uniform((0, 0), (1.0, 2 / 3), (8000, 2))
    np.testing.assert_array_equal(whole.at(points), again.at(points))
    assert difference(whole.read((300, 200)), boxed.read((300, 200))) < 2e-6
    assert difference(whole.at(points), boxed.at(points)) < 2e-6
    np.testing.assert_allclose(boxed.determinants(points), whole.determinants(points), atol=2e-3)
    seen = [one.seek(points, points, np.full(len(points), 0.05)) for one in (whole, boxed)]
    np.testing.assert_allclose(seen[1][0], seen[0][0], atol=1e-5)
    template, then = again.save(), WarpMap(device, grid, (1536, 1024))
    resumed = template.with_arrays(device, state.arrays())
    later = []
    for one, moment in ((boxed, state), (then, resumed)):
        one.restore(moment)
        one.advance_prescribed(flows[1], 0.02)
        later.append(one.read((300, 200)))
    np.testing.assert_array_equal(later[0], later[1])
    for wrong in (np.full_like(regions, 700), regions[:1], regions * 0, -regions):
        with pytest.raises(ValueError, match="regions of its closed maps"):
            template.with_arrays(device, state.arrays() | {"closed regions": wrong})
    for made in (state, template, resumed, then, *found):
        made.release()


def test_as_many_closed_maps_as_there_may_be_are_each_looked_up_in_their_own_box(
    device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    tiles, found = [((x + 0.5) / 3, (y + 0.5) / 3) for y in range(3) for x in range(3)], []
    for room in (2**27, 768 * 768 * 8 - 1):
        monkeypatch.setattr("solver.warp.accumulated.MOST_CLOSED_BYTES", room)
        found.append(warp := WarpMap(device, Grid(96, 96), (768, 768)))
        for place in tiles[:MOST_CLOSED]:
            for _ in range(3):
                warp.advance_prescribed(swirl(place, 0.12), 0.05)
            warp.remap()
            warp.close()
    whole, boxed = found
    state = boxed.save()
    assert len({tuple(region) for region in state.values["closed regions"].tolist()}) == MOST_CLOSED
    points = np.random.default_rng(2).random((8000, 2))
    assert np.abs(whole.at(points)).max() > 0.5 / 96
    assert difference(whole.at(points), boxed.at(points)) < 2e-6
    for made in (state, *found):
        made.release()


def test_a_map_resumed_from_bytes_closes_the_same_box(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where tiles that had moved hold nothing any more."""
    monkeypatch.setattr("solver.warp.accumulated.MOST_CLOSED_BYTES", 1024 * 1024 * 8 - 1)
    warp, then = (WarpMap(device, Grid(48, 48), (1024, 1024)) for _ in range(2))
    for centre in ((0.1, 0.1), (0.57, 0.57)):
        warp.advance_prescribed(swirl(centre, 0.1), 0.04)
        warp.remap()
        warp.restore_under((0.1, 0.1), 0.3, hardness=0.9, amount=1.0)
    state, template = warp.save(), then.save()
    assert "accumulated map/bare" in state.arrays()
    resumed = template.with_arrays(device, state.arrays())
    then.restore(resumed)
    closed_states = []
    for one in (warp, then):
        one.close()
        closed_states.append(one.save())
    first, second = (saved.values["closed regions"] for saved in closed_states)
    assert first.tolist() == second.tolist() == [[0, 0, 774, 774]]
    np.testing.assert_array_equal(then.read(), warp.read())
    for made in (state, template, resumed, *closed_states, warp, then):
        made.release()


def test_closed_maps_are_held_and_restored_as_one(device: Device) -> None:
    """What is frozen keeps every bit while more are closed; the restore brush gets through them to the identity."""
    warp, flow = wound_up(device, 5.0), swirl((0.5, 0.5), 0.45)
    count = closed(warp)
    frozen = np.zeros((96, 96), np.uint8)
    frozen[40:60, 60:80] = 255
    warp.hold(device.upload(frozen))
    before = warp.read((96, 96))
    for _ in range(60):
        warp.advance_prescribed(flow, 0.05)
    assert closed(warp) > count
    after = warp.read((96, 96))
    np.testing.assert_array_equal(after[frozen > 0], before[frozen > 0])
    assert np.abs(after - before)[frozen == 0].max() > 0.1
    warp.hold(None)
    for _ in range(60):
        warp.restore_under((0.5, 0.5), 0.6, hardness=0.9, amount=0.3)
    x, y = warp.grid.centres()
    assert np.abs(warp.read())[np.hypot(x - 0.5, y - 0.5) < 0.5].max() < 1e-4
    warp.release()


def test_what_is_restored_of_closed_maps_is_taken_away_under_the_brush_alone(device: Device) -> None:
    """Against the same part of what the map was; beyond the brush every bit stays, and nothing folds there.

    One map made of all of them folds all over the swirl.
    """
    warp = wound_up(device, 10.0)
    warp.remap()
    points = np.random.default_rng(1).random((20000, 2))
    centre, radius = (0.6, 0.55), 0.1
    far = np.hypot(*(points - centre).T) / radius
    before = warp.at(points)
    left = np.ones(len(points))
    for amount in (0.4, 0.7):
        warp.restore_under(centre, radius, 0.3, amount)
        part = np.clip((far - 0.3) / 0.7, 0, 1)
        left *= 1 - amount * (1 - part**2 * (3 - 2 * part))
    after, beyond = warp.at(points), far > 1 + 2 / 192 / radius  # the cubic reaches two texels
    assert np.linalg.norm(before[far < 1], axis=-1).max() > 0.4
    np.testing.assert_array_equal(after[beyond], before[beyond])
    assert np.linalg.norm(after - left[:, None] * before, axis=-1).max() * 192 < 0.2, "texels"
    determinants = warp.determinants(points)
    assert determinants[beyond].min() > 0.9
    step = np.eye(2) * 3e-5
    slopes = [(warp.at(points + e).astype(np.float64) - warp.at(points - e)) / 6e-5 for e in step]
    found = np.linalg.det(np.stack(slopes, axis=-1) + np.eye(2))
    error = np.abs(found - determinants)[far < 1] / (1 + np.abs(found[far < 1]))
    assert np.median(error) < 5e-3
    assert np.quantile(error, 0.95) < 0.05, "but where a difference reaches over the side of a texel"
    for _ in range(20):
        warp.restore_under(centre, radius, 0.3, 0.5)
    assert np.abs(warp.at(points[far < 0.3])).max() < 1e-5
    warp.release()


def test_what_is_restored_of_a_map_that_is_too_steep_to_be_closed_is_as_exact(
    device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Under a wide soft edge, where texels are read by the quintic: A and E add up between them too."""
    monkeypatch.setattr("solver.warp.accumulated.MOST_CLOSED", 2)
    warp, flow = WarpMap(device, Grid(48, 48), (128, 128)), swirl((0.5, 0.5), 0.45)
    for _ in range(160):
        warp.advance_prescribed(flow, 0.05)
    warp.remap()
    assert closed(warp) == 2
    points = np.random.default_rng(1).random((20000, 2))
    before, part = warp.at(points), np.clip(np.hypot(*(points - (0.6, 0.55)).T) / 0.3, 0, 1)
    left = np.ones(len(points))
    for amount in (0.4, 0.7):
        warp.restore_under((0.6, 0.55), 0.3, 0.0, amount)
        left *= 1 - amount * (1 - part**2 * (3 - 2 * part))
    error = np.linalg.norm(warp.at(points) - left[:, None] * before, axis=-1) * 128
    assert error.max() < 0.02, "texels; .18 where E is read by the cubic"
    warp.release()


def test_what_is_restored_of_closed_maps_goes_on_with_the_flow(device: Device) -> None:
    """It is where another flow carries it, over more than one closing; and saved states know of it, to the bit."""
    warp, flow = wound_up(device, 6.0), swirl((0.45, 0.5), 0.3)
    warp.remap()
    for _ in range(10):
        warp.restore_under((0.6, 0.55), 0.15, 0.3, 0.5)
    state, alone, then = warp.save(), WarpMap(device, warp.grid), WarpMap(device, warp.grid)
    assert [name for name in state.tiles if name.startswith("undone")] == [f"undone {closed(warp)}"]
    template = then.save()
    resumed = template.with_arrays(device, state.arrays())
    then.restore(resumed)
    points = np.random.default_rng(2).random((5000, 2))
    np.testing.assert_array_equal(then.at(points), warp.at(points))
    count = closed(warp)
    for _ in range(50):
        warp.advance_prescribed(flow, 0.05)
        alone.advance_prescribed(flow, 0.05)
    assert closed(warp) > count
    moved = alone.at(points).astype(np.float64)
    error = np.linalg.norm(moved + then.at(points + moved) - warp.at(points), axis=-1) * 48
    assert np.quantile(error, 0.99) < 0.02, "cells"
    later = warp.read((97, 97))
    for moment in (state, template, state):
        then.restore(moment)
    for _ in range(50):
        then.advance_prescribed(flow, 0.05)
    np.testing.assert_array_equal(then.read((97, 97)), later)
    warp.restore_under((0.6, 0.55), 0.15, 0.3, 0.5)  # once more: slopes by both, against differences
    slopes = [(warp.at(points + e).astype(np.float64) - warp.at(points - e)) / 4e-5 for e in 2e-5 * np.eye(2)]
    wanted = np.linalg.det(np.stack(slopes, axis=-1) + np.eye(2))
    error = np.abs(warp.determinants(points) - wanted) / (1 + np.abs(wanted))
    assert np.quantile(error, 0.99) < 0.1, "but where a difference reaches over the side of a texel"
    for step in range(90):
        if step < 30:
            warp.advance_prescribed(flow, 0.02)
        warp.restore_under((0.5, 0.5), 0.6, hardness=0.9, amount=0.3)
    x, y = warp.grid.centres()
    assert np.abs(warp.read())[np.hypot(x - 0.5, y - 0.5) < 0.5].max() < 1e-4
    wrong = {name.replace(f"undone {count}", "undone 0"): array for name, array in state.arrays().items()}
    with pytest.raises(ValueError, match="closed maps"):
        template.with_arrays(device, wrong)
    for made in (state, template, resumed, warp, alone, then):
        made.release()


def test_what_is_undone_of_closed_maps_stays_bounded_however_it_is_stirred_on(device: Device) -> None:
    """E of (S9) leads from one place of the picture to another; a polynomial that overshoots must not amplify it."""
    rng = np.random.default_rng(0)
    warp = WarpMap(device, Grid(24, 16))
    for _ in range(60):
        a, b = rng.normal(0, 1, 2)
        warp.advance_prescribed(lambda x, y, t, a=a, b=b: (a * np.sin(9 * y + a), b * np.sin(7 * x + b)), 0.5)
        warp.restore_under(tuple(rng.random(2) * warp.extent), 0.2, 0.5, 0.5)
    state = warp.save()
    undone = [a for name, a in state.arrays().items() if name.startswith("undone") and name.endswith("texels")]
    assert undone
    assert all(np.abs(texels[..., :2]).max(initial=0.0) <= 2.0 for texels in undone), "1 and what the last stroke took"
    for made in (state, warp):
        made.release()


def test_the_slopes_of_what_is_restored_are_right_where_it_is_carried_on(device: Device) -> None:
    """Against differences, at a sharp edge: there the cubic leads places on also where it takes no part away."""
    warp, flow = wound_up(device, 6.0), swirl((0.45, 0.5), 0.3)
    warp.remap()
    for _ in range(10):
        warp.restore_under((0.6, 0.55), 0.15, 0.9, 0.5)
    for _ in range(6):
        warp.advance_prescribed(flow, 0.05)
        warp.remap()
    points = 0.3 + 0.5 * np.random.default_rng(3).random((20000, 2))
    slopes = [(warp.at(points + e).astype(np.float64) - warp.at(points - e)) / 4e-5 for e in 2e-5 * np.eye(2)]
    wanted = np.linalg.det(np.stack(slopes, axis=-1) + np.eye(2))
    error = np.abs(warp.determinants(points) - wanted) / (1 + np.abs(wanted))
    assert np.quantile(error, 0.99) < 0.1, "but where a difference reaches over the side of a texel"
    assert (wanted <= 0).sum() > 300
    assert ((warp.determinants(points) <= 0) != (wanted <= 0)).mean() < 1e-3
    warp.release()


def test_moving_to_another_grid_keeps_the_map(device: Device) -> None:
    """Two swirls that overlap, each in a window of cells of its own, against float64; the map goes through both."""
    whole = Grid(64, 48)
    fine = whole.refined(2)
    flows = [swirl((0.4, 0.35), 0.22), swirl((0.6, 0.4), 0.25)]
    grids = [window(fine, 20, 10, 62, 70), window(whole, 20, 6, 40, 40)]
    warp = WarpMap(device, whole, (512, 384))
    for flow, grid in zip(flows, grids, strict=True):
        before = warp.read((100, 75))
        warp.move_to(grid)
        np.testing.assert_allclose(warp.read((100, 75)), before, atol=1e-5)
        for step in range(30):
            warp.advance_prescribed(flow, 0.02, step * 0.02)
    warp.move_to(whole)
    x, y = whole.refined(2).centres()
    places = x, y
    for flow in reversed(flows):  # back in time
        places = reference.follow(flow, *places, 0.6, 0.0, 100)
    found = warp.read((128, 96))
    assert np.hypot(x + found[..., 0] - places[0], y + found[..., 1] - places[1]).max() < 0.05 * whole.h
    assert warp.statistics().folds == 0
    with pytest.raises(ValueError, match="picture"):
        warp.move_to(Grid(20, 20))


def test_a_large_map_is_made_anew_a_little_in_each_step(device: Device) -> None:
    """Also where the next remap is wanted long before, or another grid; and it is as exact as one made anew at once."""
    whole = Grid(32, 32)
    grids = [whole, window(whole.refined(2), 8, 8, 40, 40), whole]
    flow, steps, dt = swirl((0.45, 0.45), 0.28), 26, 0.03
    warp, small = WarpMap(device, whole, (2560, 2560)), WarpMap(device, whole, (1280, 1280))
    most, gathered, kept = [], 0, [warp.save()]
    for grid in grids:
        before = warp.read((100, 100))
        warp.move_to(grid)
        small.move_to(grid)
        np.testing.assert_allclose(warp.read((100, 100)), before, atol=2e-3 * whole.h)
        for step in range(steps):
            device.timings.take()
            with device.stage("step"):
                warp.advance_prescribed(flow, dt, step * dt)
                kept.append(warp.save())
            small.advance_prescribed(flow, dt, step * dt)
            most.append(device.timings.texel_writes["step"] / TILE**2)
            gathered += "gathered" in kept[-1].fields
            kept.pop(0).release()  # as checkpoints do, those after it hold what they share with it
    kept[-1].release()
    assert gathered > steps
    assert max(most) < 2 * -(-100 // REMAP_STEPS) + 5, "tiles of 100, each drawn and copied, and what is gathered"
    assert np.median(most) < 2 * MOST_TILES + 2
    found = warp.read((100, 100))
    assert np.abs(found).max() > 5 * whole.h
    assert np.abs(found - small.read((100, 100))).max() < 2e-3 * whole.h
    assert warp.statistics().folds == 0
    warp.remap()
    np.testing.assert_allclose(warp.read((100, 100)), found, atol=5e-4 * whole.h, err_msg="resampled on the way")


def test_a_remap_soon_after_a_move_to_another_grid_finishes_no_more_than_it_must(device: Device) -> None:
    """What waits on one grid becomes one level, begun anew; of two grids the lower one is finished, and no more."""
    whole = Grid(32, 32)
    grids = [whole, window(whole.refined(2), 8, 8, 40, 40), window(whole.refined(2), 10, 12, 40, 40)]
    warp, at_once = (WarpMap(device, whole, (2560, 2560), remap_every=2) for _ in range(2))
    drawn = list[list[float]]()
    for grid, steps in zip(grids, (6, 4, 4), strict=True):
        warp.move_to(grid)
        at_once.move_to(grid)
        drawn.append([])
        for step in range(steps):
            device.timings.take()
            with device.stage("step"):
                warp.advance_prescribed(swirl((0.45, 0.45), 0.28), 0.03)
            drawn[-1].append(device.timings.texel_writes["step"] / TILE**2)
            at_once.advance_prescribed(swirl((0.45, 0.45), 0.28), 0.03)
            if step % 2:
                at_once.remap()
    tiles = 49  # that the swirl reaches
    hurry = 2 * -(-tiles // REMAP_STEPS) + 5  # each of them drawn and copied, and what is gathered
    assert max(drawn[0] + drawn[1]) < 2 * (MOST_TILES + FEW_TILES) + 2
    assert max(drawn[2]) < tiles, "what is left of one level of two"
    assert sorted(drawn[2])[-2] < hurry
    state = warp.save()
    assert {"gathered", "pending"} <= state.fields.keys()
    state.release()
    found = at_once.read((100, 100))
    assert np.abs(found).max() > 1.5 * whole.h
    assert np.abs(warp.read((100, 100)) - found).max() < 2e-3 * whole.h
    warp.release()
    at_once.release()


def test_where_nothing_moves_a_remap_draws_and_copies_nothing(device: Device) -> None:
    """What it draws once, the next one copies, as it draws into the other of two fields."""
    warp, drawn = WarpMap(device, Grid(32, 32), (2560, 2560)), list[float]()
    for centre in ((0.25, 0.25), (0.75, 0.75), (0.75, 0.75)):
        warp.advance_prescribed(swirl(centre, 0.08), 0.03)
        device.timings.take()
        with device.stage("step"):
            warp.remap()
        drawn.append(int(device.timings.texel_writes["step"] / TILE**2))  # beside them are coarse fields, less than one
    a_quarter = 25  # of 100 tiles
    assert drawn == [a_quarter, 2 * a_quarter, a_quarter]


def test_restoring_under_a_brush_reaches_through_a_window(device: Device) -> None:
    whole = Grid(64, 48)
    warp = WarpMap(device, whole)
    warp.set(smooth(np.random.default_rng(6), whole.size, 0.03))
    warp.move_to(window(whole, 30, 10, 24, 24))
    warp.advance_prescribed(swirl((0.65, 0.34), 0.15), 0.02)
    before = warp.read()
    warp.restore_under((0.5, 0.34), 0.2, hardness=0.9, amount=1.0)
    x, y = whole.centres()
    far = np.hypot(x - 0.5, y - 0.34)
    assert np.abs(before[far < 0.15]).max() > 1e-3
    assert np.abs(warp.read()[far < 0.15]).max() < 1e-6
    np.testing.assert_allclose(warp.read()[far > 0.25], before[far > 0.25], atol=1e-6)


@pytest.mark.parametrize(
    ("picture", "cells", "wanted"),
    [
        ((1536, 1024), 192, (1536, 1024)),
        ((12000, 9000), 256, (6000, 4500)),
        ((300, 200), 192, (900, 600)),
        ((5000, 1), 256, (20000, 32)),
    ],
)
def test_the_map_is_as_fine_as_the_picture(picture: tuple[int, int], cells: int, wanted: tuple[int, int]) -> None:
    assert map_size(Grid.for_picture(*picture, cells), picture, 32768) == wanted
    smaller = map_size(Grid.for_picture(*picture, cells), picture, 4096)
    assert max(smaller) <= 4096


def test_freezing_a_place_of_a_large_picture_looks_only_about_it(device: Device) -> None:
    """Also where the fluid moves everywhere: nothing is remapped for it, and nowhere does the map jump."""
    grid = Grid(64, 64)
    warp, mask = WarpMap(device, grid, (2048, 2048)), TiledField(device, (2048, 2048), 1, "mask", "f1")
    for _ in range(4):
        warp.advance_prescribed(lambda x, y, t: (0.3 * (y - 0.5), 0.3 * (0.5 - x)), 0.05)
    before = warp.read((512, 512))
    values = np.zeros((2048, 2048), np.uint8)
    values[600:620, 800:840] = 255
    mask.set(values)
    device.timings.take()
    with device.stage("hold"):
        warp.hold(mask, (780, 590, 90, 40))
    assert device.timings.texel_writes["hold"] < 5 * 100 * 60
    assert np.abs(before).max() > 0.02
    np.testing.assert_allclose(warp.read((512, 512)), before, atol=1e-6)
    mask.release()
    warp.release()


def test_what_one_step_has_turned_far_is_a_factor_that_holds_it_once(device: Device) -> None:
    grid = Grid(32, 32)
    x, y = (places - 0.5 for places in grid.centres())
    factors, maps = Factors(device, grid), list[Level]()
    for angle in (0.5, 2.9):  # the second alone turns too far to be scaled
        turn = angle * np.exp(-(x**2 + y**2) / 0.02)
        across, down = (np.cos(turn) - 1) * x - np.sin(turn) * y, np.sin(turn) * x + (np.cos(turn) - 1) * y
        displacement = np.stack([across, down], axis=-1)
        maps.append(Level(device.upload(displacement.astype(np.float32)), grid))
    little, far = maps
    factors.take(far, None)
    alone = [field.get() for field in factors.save().values()]
    assert len(alone) == 2, "nothing is no factor"
    factors.clear()
    factors.take(little, None)
    factors.take(far, None)
    first, second, rest = (field.get() for field in factors.save().values())
    assert first.any()
    assert np.array_equal(second, alone[0])
    assert not rest.any()
    for thing in (factors, little.field, far.field):
        thing.release()


def test_the_papers_map_is_exact_where_all_moves_alike(device: Device) -> None:
    """Its coordinates are linear then, and bilinear look-ups of them exact, away from the edges."""
    warp = PaperWarpMap(device, Grid(64, 48))
    for _ in range(5):
        warp.advance_prescribed(np.full((48, 64, 2), (0.2, -0.1), np.float32), 0.05)
    inner = np.stack(np.meshgrid(np.linspace(0.2, 0.8, 9), np.linspace(0.2, 0.55, 7)), axis=-1).reshape(-1, 2)
    np.testing.assert_allclose(warp.at(inner), np.broadcast_to((-0.05, 0.025), inner.shape), atol=1e-5)
    warp.release()


@pytest.mark.parametrize(
    ("names", "closed"),
    [
        (["moved", "closed map 1", "closed map 0"], ["closed map 0", "closed map 1"]),
        (["closed map 0", "undone 1"], ["closed map 0", "undone 1"]),
        (["undone 0"], None),
        (["undone 0", "closed map 1"], None),
        (["closed map 0", "undone 1", "undone 2"], None),
        (["closed map 0", "closed map 2"], None),
        (["closed map 0", "undone 0"], None),
        (["closed map x"], None),
    ],
)
def test_saved_closed_maps_are_in_a_row_and_what_is_undone_comes_after_one(
    names: list[str], closed: list[str] | None
) -> None:
    if closed is not None:
        assert closed_in(names) == closed
        return
    with pytest.raises(ValueError, match="closed maps"):
        closed_in(names)

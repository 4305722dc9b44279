"""The fluid as a whole against exact and published solutions."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy import fft, ndimage

from solver.brush.brush import Brush, Tip
from solver.brush.push import (
    FIRM_CARRIED,
    LOOSEST_CARRIED,
    Push,
    Slip,
    coasting,
    gain_compensation,
    quick_slip,
    slip_factor,
    strain_limit,
)
from solver.fluid import Fluid
from solver.gl.device import Device
from solver.grid import Grid
from solver.paper import PaperFluid
from solver.params import FluidParams, Walls
from solver.warp.map import WarpMap
from support import reference

PI = np.pi


def taylor_green(grid: Grid) -> np.ndarray:
    """(sin pi x cos pi y, -cos pi x sin pi y) on the faces of the unit square."""
    (ux, uy), (vx, vy) = grid.u_faces(), grid.v_faces()
    return np.stack([np.sin(PI * ux) * np.cos(PI * uy), -np.cos(PI * vx) * np.sin(PI * vy)], axis=-1)


def test_taylor_green_decays_at_its_rate(device: Device) -> None:
    grid, viscosity, dt, steps = Grid(128, 128), 0.01, 1 / 256, 128
    fluid = Fluid(device, grid)
    fluid.set_viscosity(viscosity)
    fluid.set_velocity(taylor_green(grid))
    before = fluid.motion().kinetic_energy
    for _ in range(steps):
        fluid.step(dt)
    rate = -np.log(fluid.motion().kinetic_energy / before) / (steps * dt)
    assert rate == pytest.approx(4 * viscosity * PI**2, rel=5e-3)
    fluid.release()


def test_taylor_green_hardly_fades_without_viscosity(device: Device) -> None:
    grid, dt, steps = Grid(96, 96), 1 / 96, 96
    energies = {}
    for name, kind in {"mac": Fluid, "paper": PaperFluid}.items():
        fluid = kind(device, grid)
        faces = taylor_green(grid)
        if name == "paper":
            x, y = grid.centres()
            faces = np.stack([np.sin(PI * x) * np.cos(PI * y), -np.cos(PI * x) * np.sin(PI * y)], axis=-1)
        fluid.set_velocity(faces)
        before = fluid.motion().kinetic_energy
        for _ in range(steps):
            fluid.step(dt)
        energies[name] = fluid.motion().kinetic_energy / before
        fluid.release()
    assert energies["mac"] > 0.99
    assert energies["mac"] > energies["paper"]


def test_lid_driven_cavity(device: Device) -> None:
    """Extrema on the centre lines at Re 100: Botella and Peyret, Computers & Fluids 27 (1998).

    Re 1000 takes minutes and is in benchmarks/bench_accuracy.py.
    """
    faces = None
    # A coarse cavity first: its steady state is what the fine one starts from.
    for cells, seconds in ((32, 10.0), (64, 6.0)):
        grid = Grid(cells, cells)
        fluid = Fluid(device, grid, FluidParams(walls=Walls("none", (0.0, 0.0, 1.0, 0.0))))
        fluid.set_viscosity(1 / 100)
        if faces is not None:
            fluid.set_velocity(faces.repeat(2, axis=0).repeat(2, axis=1))
        for _ in range(round(seconds * cells)):
            fluid.step(grid.h)
        faces = fluid.velocity.read.get()
        fluid.release()
    assert faces is not None
    # The lid is on top and y points down: the published v has the other sign.
    u, v = faces[:, 32, 0], -faces[32, :, 1]
    np.testing.assert_allclose([u.min(), v.max(), v.min()], [-0.21404, 0.1795728, -0.2538030], rtol=1e-2)


def shear_ring(cells: int, rho: float, delta: float, fine: int = 768) -> np.ndarray:
    """Faces of a shear layer, tanh(rho (r - 1/pi)), closed to a ring of the length 2 in the unit square.

    The double shear layer of Minion and Brown, J. Comput. Phys. 138 (1997), u = tanh(rho (y - 1/4)) and its image,
    v = delta sin 2 pi x, is periodic; between walls that let nothing through a straight layer must end. The ring is as
    long as both of its layers, has the velocities -1 and 1 on its sides (inside it turns as a whole, outside it is a
    potential flow), and is pushed out and in twice around. The corners of the square do so four times, which grows
    faster: it rolls up into four vortices, half a length apart where those of the periodic layers are one. With no
    vorticity at the walls the flow is that of a sine series, odd in every wall.
    """
    along = np.arange(1, fine) / fine
    x, y = np.meshgrid(along - 0.5, along - 0.5)
    across = np.tanh(rho * (np.hypot(x, y) - 1 / PI))
    wave = PI * np.arange(1, fine)
    vorticity = rho * (1 - across**2) - PI * (1 - across)
    sines = np.asarray(fft.dstn(vorticity, type=1)) / (wave**2 + wave[:, None] ** 2)
    pushed = delta * PI / 2 * (x**2 - y**2) * np.cos(PI * x) * np.cos(PI * y)
    psi = np.pad(np.asarray(fft.idstn(sines, type=1)) + pushed, 1)[:: fine // cells, :: fine // cells]
    return cells * np.stack([psi[1:, :-1] - psi[:-1, :-1], psi[:-1, :-1] - psi[:-1, 1:]], axis=-1)


def vortices(vorticity: np.ndarray, prominence: float = 0.05) -> int:
    """How many maxima of the vorticity, smoothed by .01 sides, stand above all around by a part of the largest."""
    smooth = ndimage.gaussian_filter(vorticity, 0.01 * (len(vorticity) - 1))
    smooth /= smooth.max()
    levels = np.arange(0.02, 1 - prominence, 0.02)
    parts = np.zeros(smooth.shape, np.int32)
    most = 0
    for low in levels:
        ndimage.label(smooth > low, np.ones((3, 3)), output=parts)
        most = max(most, len(np.unique(parts[smooth > low + prominence])))
    return most


@pytest.mark.parametrize(("cells", "spurious"), [(64, 4), (192, 0), (256, 0)])
def test_a_thin_shear_layer_rolls_up_into_no_more_vortices_than_it_should(
    device: Device, cells: int, spurious: int
) -> None:
    """rho = 80, viscosity 1 / 20000, rolled up once: four, as a pseudo-spectral solution of 512^2 sines has.

    On 64 x 64 cells the layer between two of them breaks up too.
    """
    fluid = Fluid(device, Grid(cells, cells))
    fluid.set_viscosity(1 / 20000)
    fluid.set_velocity(shear_ring(cells, rho=80, delta=0.05))
    for _ in range(cells // 2):
        fluid.step(1 / cells)
    assert vortices(fluid.vorticity()) == 4 + spurious
    fluid.release()


@pytest.mark.parametrize("size", [(8, 8), (9, 31), (64, 40)])
def test_push_is_divergence_free_and_moves_at_the_pointers_speed(device: Device, size: tuple[int, int]) -> None:
    grid = Grid(*size)
    fluid, brush = Fluid(device, grid), Brush(device)
    width, height = grid.extent
    at = (width / 2, height / 2)
    dt = 1 / 60
    tip = Tip((at[0] - 0.004, at[1]), (at[0] + 0.002, at[1] + 0.001), radius=0.3 * min(width, height))
    brush.push(fluid, tip, dt)
    faces = fluid.impulse.field.get()
    speed = np.abs(faces).max()
    assert np.abs(reference.divergence(faces, grid.h)).max() < 1e-5 * speed / grid.h
    if min(size) >= 40:
        end = (np.array(place / grid.h) for place in tip.end)
        u, v = reference.velocity_at(reference.padded_faces(faces), *end)
        assert (float(u), float(v)) == pytest.approx((0.006 / dt, 0.001 / dt), rel=0.03)
    fluid.release()
    brush.release()


def pushed(device: Device, push: Push, kind: type[Fluid | PaperFluid] = Fluid) -> tuple[np.ndarray, np.ndarray]:
    """What carries the picture, and the fluid, on faces after a step from rest, a cell in the way frozen."""
    fluid, brush = kind(device, Grid(48, 32)), Brush(device)
    fluid.set_viscosity(1e-3)
    fluid.set_solid(np.arange(48 * 32).reshape(32, 48) == 12 * 48 + 30)
    brush.lead(fluid, push)
    fluid.step(push.dt, steer=lambda velocity: brush.make_up(fluid, push, velocity))
    brush.carry(fluid, push)
    found = fluid.carrier().get(), fluid.faces().get()
    fluid.step(push.dt)
    assert fluid.local.is_empty
    fluid.release()
    brush.release()
    return found


@pytest.mark.parametrize("kind", [Fluid, PaperFluid])
def test_a_local_push_moves_what_is_under_it_and_nothing_else(device: Device, kind: type[Fluid | PaperFluid]) -> None:
    """But within the radius about the frozen cell, less and less."""
    tip = Tip((0.5, 0.3), (0.51, 0.295), radius=0.15)
    carrier, fluid = pushed(device, Push(tip, 1 / 60, local=1.0), kind)
    assert not fluid.any()
    grid, motion = Grid(48, 32), np.array([0.01, -0.005]) * 60
    x, y = grid.centres()
    cells = np.hypot(x - 30.5 / 48, y - 12.5 / 48)
    for axis, (x, y) in enumerate((grid.u_faces(), grid.v_faces())):
        along = np.clip(((x - 0.5) * 0.01 - (y - 0.3) * 0.005) / 1.25e-4, 0, 1)
        r = np.hypot(x - 0.5 - 0.01 * along, y - 0.3 + 0.005 * along) / 0.15
        apart = np.minimum((cells + np.roll(cells, 1, 1 - axis)) / 2 / 0.15, 1)
        wanted = np.maximum(1 - r**2, 0) ** 3 * apart**2 * (3 - 2 * apart) * motion[axis]
        frozen = (slice(12, 13), slice(30, 32)) if axis == 0 else (slice(12, 14), slice(30, 31))
        wanted[frozen] = 0.0
        np.testing.assert_allclose(carrier[..., axis], wanted, atol=1e-5)


def test_half_a_local_push_is_half_as_fast(device: Device) -> None:
    tip = Tip((0.5, 0.3), (0.51, 0.295), radius=0.15)
    whole, half = (pushed(device, Push(tip, 1 / 60, strength, local=1.0))[0] for strength in (1.0, 0.5))
    assert whole.max() > 0.1
    np.testing.assert_allclose(half, whole / 2, atol=1e-6)


def test_local_pushes_that_overlap_add_up(device: Device) -> None:
    grid, brush = Grid(48, 32), Brush(device)
    tips = [Tip((0.5, 0.3), (0.51, 0.295), radius=0.15), Tip((0.55, 0.35), (0.55, 0.37), radius=0.15)]
    found = []
    for together in ([0], [1], [0, 1]):
        fluid = Fluid(device, grid)
        for number in together:
            brush.carry(fluid, Push(tips[number], 1 / 60, local=1.0))
        found.append(fluid.carrier().get())
        fluid.release()
    brush.release()
    assert all(one.any() for one in found[:2])
    np.testing.assert_allclose(found[2], found[0] + found[1], atol=1e-6)


@pytest.mark.parametrize("inwards", [True, False])
def test_a_local_push_at_the_edge_does_not_fold(device: Device, inwards: bool) -> None:
    fluid, warp, brush = Fluid(device, Grid(48, 32)), WarpMap(device, Grid(48, 32)), Brush(device)
    places = np.linspace(0.0, 0.4, 21)[:: 1 if inwards else -1]
    for start, end in pairwise(places.tolist()):
        fluid.step(1 / 60)
        brush.carry(fluid, Push(Tip((start, 0.3), (end, 0.3), radius=0.25), 1 / 60, local=1.0))
        warp.follow(fluid, 1 / 60)
    assert warp.statistics().displacement_max > 0.1
    assert warp.statistics().det_min > 0
    for thing in (fluid, warp, brush):
        thing.release()


def test_a_local_push_from_beyond_the_edge_moves_nothing_against_it(device: Device) -> None:
    """Where the brush's image beyond the wall weighs more than the brush itself."""
    carrier, _ = pushed(device, Push(Tip((-0.1, 0.3), (-0.05, 0.32), radius=0.25), 1 / 60, local=1.0))
    assert carrier.min() == 0
    assert carrier.max() > 0.1


@pytest.mark.parametrize(("radii", "part"), [(0.0, 1.0), (0.7, 1.0), (1.2, 0.3 + 0.7 / 1.5), (1e4, 0.3)])
def test_a_stroke_holds_fast_for_seven_tenths_of_a_radius_and_slips_to_three_tenths(radii: float, part: float) -> None:
    assert slip_factor(radii) == pytest.approx(part, abs=1e-6)


@pytest.mark.parametrize(
    ("drag", "viscosity", "radii"),
    [(2.0, 0.0, 1.0), (0.0, 0.005, 1 / 3), (3.0, 0.005, 2 / 9), (0.0, 0.0, 2.0), (0.5, 0.0, 2.0), (1.0, 0.0, 2.0)],
)
def test_how_far_a_fluid_goes_on_without_the_brush(drag: float, viscosity: float, radii: float) -> None:
    """From a speed of 0.2: slowed by drag and by viscosity, 12 / radius^2 of it, but for a second at most."""
    tip = Tip((0.5, 0.5), (0.512, 0.484), radius=0.1)
    assert coasting(tip, 0.1, drag, viscosity) == pytest.approx(radii)


@pytest.mark.parametrize(
    ("travelled", "coasts", "part"),
    [
        (0.0, 0.0, 0.68), (0.6, 0.0, 0.78), (1.92, 0.0, 1.0), (50.0, 0.0, 1.0),
        (0.0, 1.0, 0.68 / 1.5 / 1.25), (50.0, 1.0, 1 / 1.25), (0.0, 0.4, 0.68 / 1.2 / 1.1),
        (50.0, 1.5, 1 / (1.375 + 1.5)), (0.0, 1.5, 0.68 / 1.75 / (1.375 + 1.5)), (50.0, 9.0, 1 / (1.375 + 1.5)),
    ],
)  # fmt: skip
def test_how_much_a_push_may_strain_grows_with_its_path_and_falls_with_how_far_the_fluid_coasts(
    travelled: float, coasts: float, part: float
) -> None:
    assert strain_limit(travelled, coasts) == pytest.approx(part)


@pytest.mark.parametrize(
    ("drag", "viscosity", "gain"), [(0, 0, 1), (3, 0, np.exp(0.03)), (0, 0.5, 1 + 12 * 0.5), (1e3, 1e3, 20)]
)
def test_a_brush_makes_up_for_drag_and_viscosity(drag: float, viscosity: float, gain: float) -> None:
    assert gain_compensation(radius=0.1, dt=0.01, drag=drag, viscosity=viscosity) == pytest.approx(gain, rel=1e-6)


def test_what_a_brush_has_drawn_acts_in_one_step(device: Device) -> None:
    fluid, brush = Fluid(device, Grid(32, 32)), Brush(device)
    brush.push(fluid, Tip((0.45, 0.5), (0.5, 0.5), radius=0.3), 1 / 60)
    fluid.step(1e-3)
    speed = fluid.motion().largest_speed
    assert speed > 1
    fluid.step(1e-3)
    assert fluid.motion().largest_speed == pytest.approx(speed, rel=0.1)
    for thing in (fluid, brush):
        thing.release()


@pytest.mark.parametrize(("far", "part"), [(0.05, 2.0), (0.1, 1.0), (0.3, 1 / 3)])
def test_a_push_carries_by_no_more_than_its_radius_in_a_step(far: float, part: float) -> None:
    assert quick_slip(Tip((0.2, 0.3), (0.2 + 0.6 * far, 0.3 - 0.8 * far), 0.1)) == pytest.approx(part)
    assert quick_slip(Tip((0.2, 0.3), (0.2, 0.3), 0.1)) > 1


@pytest.mark.parametrize("radii", [0.3, 1.0, 3.0])
def test_a_push_slips_by_the_path_that_the_picture_has_come_with_it(device: Device, radii: float) -> None:
    """What lies where a push to the right has brought it, unstrained, is pushed on, or back."""
    warp, slip = WarpMap(device, Grid(48, 32)), Slip(device)
    warp.set(np.broadcast_to((-0.1 * radii, 0.0), (32, 48, 2)))
    slip.find(Push(Tip((0.5, 0.3), (0.51, 0.3), 0.1), 1 / 60), warp)
    beyond = max(radii - FIRM_CARRIED, 0.0)
    wanted = LOOSEST_CARRIED + (1 - LOOSEST_CARRIED) / (1 + 2 * beyond**2)
    assert slip.factor.get()[slip.row, 0] == pytest.approx(wanted, abs=1e-3)
    slip.find(Push(Tip((0.5, 0.3), (0.49, 0.3), 0.1), 1 / 60), warp)
    assert slip.factor.get()[slip.row, 0] == pytest.approx(1.0, abs=1e-3)
    push = Push(Tip((0.5, 0.3), (0.51, 0.3), 0.1), 1 / 60)
    slip.find(push, warp)
    warp.reset()
    slip.find(push, warp)
    assert slip.factor.get()[slip.row, 0] == pytest.approx(1.0, abs=1e-3)
    slip.release()
    warp.release()


@pytest.mark.parametrize("hold", [0.0, 0.25, 1.0])
def test_a_push_that_holds_slips_by_so_much_less(device: Device, hold: float) -> None:
    """By each law: by its own path, and by how far it has carried and stretched what lies under it."""
    assert slip_factor(2.0, 0.0, hold) == pytest.approx(hold + (1 - hold) * slip_factor(2.0))
    assert slip_factor(2.0, 6.0, hold) == pytest.approx(slip_factor(2.0, 0.0, hold) / 4), "it coasts no farther"
    warp, slip = WarpMap(device, Grid(48, 48)), Slip(device)
    x = np.broadcast_to((np.arange(96) + 0.5) / 96 - 0.5, (96, 96))
    for displacement, slipping in ((np.full((96, 96), -0.1), 5 / 6), (9 * x, 0.0)):
        warp.set(np.stack([displacement, np.zeros((96, 96))], axis=-1))
        slip.find(Push(Tip((0.5, 0.5), (0.51, 0.5), 0.1), 1 / 60, hold=hold), warp)
        assert slip.factor.get()[slip.row, 0] == pytest.approx(hold + (1 - hold) * slipping, abs=0.01)
    slip.release()
    warp.release()


@pytest.mark.parametrize(("across", "down", "factor"), [(9, 9, 1.0), (9, 0, 0.0), (0, 0, 1.0)])
def test_a_push_lets_go_of_what_it_would_stretch_further(
    device: Device, across: float, down: float, factor: float
) -> None:
    """A flow that keeps areas stretches nothing that has grown alike in all directions."""
    warp, slip = WarpMap(device, Grid(48, 48)), Slip(device)
    x, y = (np.arange(96) + 0.5) / 96 - 0.5, (np.arange(96)[:, None] + 0.5) / 96 - 0.5
    warp.set(np.stack(np.broadcast_arrays(across * x, down * y), axis=-1))
    slip.find(Push(Tip((0.5, 0.5), (0.51, 0.5), 0.1), 1 / 60), warp)
    assert slip.factor.get()[slip.row, 0] == pytest.approx(factor, abs=0.01)
    slip.release()
    warp.release()


def test_a_brush_spares_what_is_thicker_and_does_less_beside_it(device: Device) -> None:
    """The thousandth of what is a thousand times thicker; and of 24 places in the brush one lies on that."""
    brush, drawn = Brush(device), []
    push = Push(Tip((0.34, 0.5), (0.35, 0.5), radius=0.3), 1 / 60)
    for thickest in (1e-3, 1.0):
        fluid, velocity = Fluid(device, Grid(40, 40)), device.upload(np.zeros((40, 40, 2), np.float32), "velocity")
        fluid.set_viscosity(np.broadcast_to(np.where(np.arange(40) < 24, 1e-3, thickest), (40, 40)))
        brush.make_up(fluid, push, velocity)
        drawn.append(velocity.get())
        velocity.release()
        fluid.release()
    part = 1 - (1 / 6) ** 2 * (3 - 2 / 6)
    assert np.abs(drawn[0]).max() > 0.5
    np.testing.assert_allclose(drawn[1][:, :23], part * drawn[0][:, :23], atol=1e-3)
    assert 0 < np.abs(drawn[1][:, 25:]).max() < 0.002 * np.abs(drawn[0][:, 25:]).max()
    brush.release()


def test_a_tip_between_two_cells_does_what_it_does_a_hair_to_either_side(device: Device) -> None:
    """What is thicker than at the tip is spared: the tip's own viscosity goes over from cell to cell without a step."""
    grid = Grid(24, 24)
    brush, fluid, drawn = Brush(device), Fluid(device, grid), []
    fluid.set_viscosity(np.broadcast_to(np.where(np.arange(24) == 12, 0.1, 1e-3), (24, 24)))
    for x in (0.5 - 1e-6, 0.5 + 1e-6):
        velocity = device.upload(np.zeros((24, 24, 2), np.float32), "velocity")
        brush.make_up(fluid, Push(Tip((x, 0.49), (x, 0.5), radius=0.3), 1 / 60), velocity)
        drawn.append(velocity.get())
        velocity.release()
    assert np.abs(drawn[0]).max() > 0.01
    np.testing.assert_allclose(drawn[1], drawn[0], atol=1e-3 * np.abs(drawn[0]).max())
    for item in (fluid, brush):
        item.release()


def test_between_fluid_and_local_a_push_is_a_mixture(device: Device) -> None:
    tip = Tip((0.5, 0.3), (0.51, 0.295), radius=0.15)
    flowing, half, local = (pushed(device, Push(tip, 1 / 60, local=part))[0] for part in (0.0, 0.5, 1.0))
    np.testing.assert_allclose(half, (flowing + local) / 2, atol=1e-3 * np.abs(flowing).max())
    assert np.abs(flowing - local).max() > 0.1


def test_twirl_turns_clockwise_at_its_rate_and_no_faster(device: Device) -> None:
    grid = Grid(64, 64)
    fluid, brush = Fluid(device, grid), Brush(device)
    tip = Tip((0.5, 0.5), (0.5, 0.5), radius=0.3, hardness=0.8)
    for _ in range(5):
        brush.twirl(fluid, tip, rate=3.0)
    fluid.set_velocity(fluid.impulse.field.get())
    velocity = fluid.velocity_at_centres()
    # To the right of the centre, clockwise on the screen (y down) is downwards.
    assert velocity[32, 32 + 9, 1] == pytest.approx(3.0 * 9.5 / 64, rel=0.05)
    assert velocity[32 - 9, 32, 0] == pytest.approx(3.0 * 8.5 / 64, rel=0.05)
    fluid.release()
    brush.release()


def test_a_twirl_that_moves_turns_about_where_it_is(device: Device) -> None:
    given = []
    for start in ((0.5, 0.5), (0.4, 0.45)):
        fluid, brush = Fluid(device, Grid(64, 64)), Brush(device)
        brush.twirl(fluid, Tip(start, (0.5, 0.5), radius=0.2), rate=3.0)
        given.append(fluid.impulse.field.get())
        fluid.release()
        brush.release()
    assert np.abs(given[0]).max() > 0.1
    np.testing.assert_allclose(given[1], given[0], atol=1e-6)


def test_what_is_read_of_a_flow_is_by_the_lengths_of_its_cells_which_are_not_squares(device: Device) -> None:
    """u = a x + b y, v = c x + d y: divergence a + d; and vorticity c - b, where no wall is near."""
    grid = Grid(24, 16, (1.0, 0.5))
    assert grid.spacing[0] > 1.3 * grid.spacing[1]
    a, b, c, d = 0.3, 0.7, -0.4, 0.2
    fluid, (hx, hy) = Fluid(device, grid), grid.spacing
    row, column = np.mgrid[0:16, 0:24]
    u = a * column * hx + b * (row + 0.5) * hy
    v = c * (column + 0.5) * hx + d * row * hy
    fluid.velocity.read.set(np.stack([u, v], axis=-1).astype(np.float32))
    inside = slice(1, -2), slice(1, -2)
    np.testing.assert_allclose(fluid.divergence()[inside], a + d, atol=1e-4)
    np.testing.assert_allclose(fluid.vorticity()[2:-2, 2:-2], c - b, atol=1e-4)
    fluid.release()


@pytest.mark.parametrize("how", ["cleared", "set to rest", "laid anew"])
@pytest.mark.parametrize("viscosity", [0.0, 0.01])
def test_a_fluid_that_is_stopped_goes_on_as_a_new_one(device: Device, how: str, viscosity: float) -> None:
    """To the bit: nothing of the steps before is left, neither pressure nor first guesses nor a brush's impulse."""
    grid, force = Grid(32, 24), np.random.default_rng(0).normal(0, 1, (24, 32, 2))
    flows = []
    for has_moved in (False, True):
        fluid, brush = Fluid(device, grid), Brush(device)
        fluid.set_viscosity(viscosity)
        if has_moved:
            for _ in range(4):
                fluid.step(0.05, -2 * force)
            brush.push(fluid, Tip((0.4, 0.4), (0.45, 0.4), radius=0.1), 0.05)
            if how == "cleared":
                fluid.clear_velocity()
            elif how == "set to rest":
                fluid.set_velocity(np.zeros((24, 32, 2)))
            else:
                fluid.lay_on(grid)
        for _ in range(3):
            fluid.step(0.05, force)
        flows.append((fluid.u, fluid.v))
        brush.release()
        fluid.release()
    np.testing.assert_array_equal(flows[0][0], flows[1][0])
    np.testing.assert_array_equal(flows[0][1], flows[1][1])


def test_expand_grows_by_its_integral(device: Device) -> None:
    grid = Grid(96, 64)
    fluid, brush = Fluid(device, grid), Brush(device)
    brush.expand(fluid, Tip((0.5, 0.3), (0.5, 0.3), radius=0.15), rate=2.0)
    source = fluid.source.field.get().astype(np.float64)
    fluid.project()
    div = fluid.divergence().astype(np.float64)
    wanted = source - source.mean()
    assert np.linalg.norm(div - wanted) < 2e-3 * np.linalg.norm(wanted)
    fluid.project()
    assert np.abs(fluid.divergence()).max() < 1e-2 * np.abs(div).max()
    fluid.release()
    brush.release()


def test_frozen_cells_stand_still_while_the_rest_flows(device: Device) -> None:
    grid = Grid(64, 48)
    fluid = Fluid(device, grid)
    x, y = grid.centres()
    solid = np.hypot(x - 0.5, y - 0.375) < 0.15
    fluid.set_solid(solid)
    fluid.set_viscosity(1e-3)
    fluid.set_velocity(reference.smooth_velocity(64, 48, seed=2))
    for _ in range(10):
        fluid.step(1 / 30)
    faces = fluid.velocity.read.get()
    assert (faces[..., 0][solid] == 0).all()
    assert (faces[..., 1][solid] == 0).all()
    assert (faces[:, 1:, 0][solid[:, :-1]] == 0).all()
    assert (faces[1:, :, 1][solid[:-1]] == 0).all()
    assert np.abs(faces).max() > 0.01
    fluid.release()


@pytest.mark.parametrize("kind", [Fluid, PaperFluid])
def test_state_brings_a_moment_back_exactly(device: Device, kind: type[Fluid | PaperFluid]) -> None:
    fluid = kind(device, Grid(40, 32))
    fluid.set_viscosity(0.01)
    fluid.set_velocity(reference.smooth_velocity(40, 32, seed=8))
    fluid.step(1 / 60)
    state = fluid.save()
    for _ in range(3):
        fluid.step(1 / 60)
    wanted = fluid.velocity.read.get()
    if isinstance(fluid, Fluid):
        fluid.trace(1 / 60)  # as what follows it asks for; the next step takes it where nothing has changed
    fluid.restore(state)
    for _ in range(3):
        fluid.step(1 / 60)
    np.testing.assert_array_equal(fluid.velocity.read.get(), wanted)
    state.release()
    fluid.release()


@pytest.mark.parametrize("courant", [0.5, 20.0])
def test_energy_never_grows(device: Device, courant: float) -> None:
    """Unconditionally stable: without a force the kinetic energy falls, whatever the step."""
    grid = Grid(64, 48)
    fluid = Fluid(device, grid)
    fluid.set_velocity(reference.smooth_velocity(64, 48, seed=4, cells=3))
    fluid.project()
    energy = [fluid.motion().kinetic_energy]
    for _ in range(100):
        fluid.step(courant * grid.h)
        energy.append(fluid.motion().kinetic_energy)
    assert max(energy) < 1.02 * energy[0]
    assert energy[-1] < energy[0]
    fluid.release()


@pytest.mark.parametrize("part", [1.0, 0.2])
def test_a_place_that_is_read_everywhere_gives_no_more_than_it_has(device: Device, part: float) -> None:
    """Advection alone would make the energy of all from that of two spots: what departs bounds what arrives (S6).

    Also where the spots are open in part, and each face counts by its part.
    """
    grid = Grid(48, 48)
    fluid = Fluid(device, grid)
    at = np.array([0.25, 0.75])

    def apart(x: np.ndarray, y: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
        # In a step of 1 s what arrives anywhere in a half comes from the middle of that half.
        return x - 0.5, y - at[(y > 0.5).astype(int)]

    force, opened = np.zeros((48, 48, 2)), np.ones((48, 48))
    for row, push in ((12, 100.0), (36, -100.0)):
        force[row - 2 : row + 2, 22:27, 0] = push
        opened[row - 3 : row + 3, 20:29] = part
    fluid.solid.set(np.rint(255 * (1 - opened)).astype(np.uint8))
    fluid.masks_changed()
    before = np.pad(opened, ((1, 0), (1, 0)), "edge")
    parts = np.stack([np.minimum(opened, before[1:, :-1]), np.minimum(opened, before[:-1, 1:])], axis=-1)
    fluid.set_velocity(apart)
    fluid.velocity.read.set((fluid.velocity.read.get() / parts).astype(np.float32))  # as much flows, through less

    def energy(velocity: np.ndarray) -> float:
        return float((parts * velocity.astype(np.float64) ** 2).sum())

    departed = energy(fluid.velocity.read.get() + force)
    fluid.step(1.0, force)
    assert 0.1 * departed < energy(fluid.velocity.read.get()) < 1.001 * departed
    fluid.release()

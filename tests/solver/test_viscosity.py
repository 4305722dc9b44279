"""The implicit viscous step against exact solutions, sparse direct solves and closed forms."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
import scipy.fft
import scipy.special
from scipy import ndimage

from solver import Fluid, Grid, WarpMap
from solver.gl.device import Device
from solver.params import Walls
from solver.viscosity import plan as plans
from solver.viscosity.plan import Plan
from solver.viscosity.solve import Viscosity
from support import reference


class Step:
    """A viscous step of given coefficients, as often as one likes; dt / h^2 is one unless dt is given."""

    def __init__(
        self,
        device: Device,
        viscosity: np.ndarray,
        dt: float | None = None,
        solid: np.ndarray | None = None,
        walls: Walls | None = None,
        aspect: float = 1.0,
    ) -> None:
        ny, nx = viscosity.shape
        self.h = 1 / max(nx, ny), aspect / max(nx, ny)
        self.dt = self.h[0] * self.h[1] if dt is None else dt
        self.walls = walls or Walls()
        self.solid = np.zeros((ny, nx), bool) if solid is None else solid
        # What the GPU is given, and so what the reference must be given too.
        self.viscosity = viscosity.astype(np.float32)
        self.device = device
        self.solver = Viscosity(device, (nx, ny), self.h)
        solid_field = device.upload(self.solid.astype(np.uint8) * np.uint8(255))
        self.solver.set_coefficients(device.upload(self.viscosity), solid_field, self.dt, self.walls)
        self.velocity = device.double_field((nx, ny), 2, "velocity")

    def __call__(self, faces: np.ndarray) -> np.ndarray:
        self.velocity.read.set(faces)
        self.solver.diffuse(self.velocity.read)
        return self.velocity.read.get().astype(np.float64)

    def exact(self, faces: np.ndarray) -> np.ndarray:
        return reference.viscous_step(
            faces,
            self.viscosity.astype(np.float64),
            self.dt,
            self.h,
            solid=self.solid,
            no_slip=self.walls.no_slip,
            speed=self.walls.speed,
        )

    def with_plan(self, **changes: Any) -> Step:
        self.solver.plan = dataclasses.replace(self.solver.plan, **changes)
        return self


def error(found: np.ndarray, wanted: np.ndarray) -> float:
    return float(np.linalg.norm(found - wanted) / np.linalg.norm(wanted))


def curl(stream: np.ndarray) -> np.ndarray:
    """Faces (ny, nx, 2) from a stream function at the (ny + 1, nx + 1) nodes, zero on the walls."""
    x, y = np.linspace(0, 1, stream.shape[1]), np.linspace(0, 1, stream.shape[0])[:, None]
    stream = stream * np.sin(np.pi * x) * np.sin(np.pi * y)
    faces = np.stack([stream[1:, :-1] - stream[:-1, :-1], stream[:-1, :-1] - stream[:-1, 1:]], axis=-1)
    return (faces / np.abs(faces).max()).astype(np.float32)


def push(ny: int, nx: int) -> np.ndarray:
    """A stroke of a brush."""
    y, x = np.mgrid[: ny + 1, : nx + 1] / max(nx, ny)
    return curl(np.exp(-((x - 0.4) ** 2 + (y - 0.35) ** 2) / 0.0072) * (2 * (y - 0.35) - (x - 0.4)))


def vortices(ny: int, nx: int) -> np.ndarray:
    return curl(ndimage.gaussian_filter(np.random.default_rng(2).standard_normal((ny + 1, nx + 1)), max(nx, ny) / 20))


def noise(ny: int, nx: int) -> np.ndarray:
    faces = np.random.default_rng(3).standard_normal((ny, nx, 2)).astype(np.float32)
    faces[:, 0, 0] = faces[0, :, 1] = 0
    return faces


def mask(kind: str, ny: int, nx: int) -> np.ndarray:
    """Masks from 0 (thin) to 1 (thick)."""
    y, x = (np.mgrid[:ny, :nx] + 0.5) / max(nx, ny)
    random = np.random.default_rng(1).standard_normal((ny, nx))
    if kind == "disc":
        return (np.hypot(x - 0.5, y - 0.45) < 0.2) * 1.0
    if kind == "soft disc":
        return np.clip((0.25 - np.hypot(x - 0.5, y - 0.5)) / 0.1, 0, 1)
    if kind == "stripes":
        return (x * 6 % 1 < 0.5) * 1.0
    if kind in ("blobs", "soft blobs"):
        blobs = ndimage.gaussian_filter(random, max(nx, ny) / 16)
        blobs /= blobs.std()
        return (blobs > 0.5) * 1.0 if kind == "blobs" else np.clip(0.8 * blobs, 0, 1)
    if kind == "lines":
        lines = np.abs(np.hypot(x - 0.5, y - 0.5) - 0.3) < 1.5 / max(nx, ny)
        for angle in (0.3, 1.1, 2.2):
            lines |= np.abs((x - 0.5) * np.sin(angle) - (y - 0.5) * np.cos(angle)) < 1.5 / max(nx, ny)
        return lines * 1.0
    if kind == "checkerboard":
        return np.add(*np.mgrid[:ny, :nx]) % 2 * 1.0
    return (random > 0) * 1.0


@pytest.mark.parametrize(
    ("nx", "ny", "walls", "with_solid"),
    [
        (8, 8, Walls(), False),
        (9, 8, Walls("none"), True),
        (64, 48, Walls("none", (0.3, -0.2, 1.0, 0.5)), False),
        (53, 37, Walls(), True),
        (40, 61, Walls("none", (0.3, -0.2, 1.0, 0.5)), True),
        (48, 48, Walls(sticky=(True, True, False, True)), False),
        (40, 61, Walls("free", (0.3, -0.2, 1.0, 0.5), (True, False, True, False)), True),
    ],
)
def test_converges_to_the_direct_solution(device: Device, nx: int, ny: int, walls: Walls, with_solid: bool) -> None:
    y, x = np.mgrid[:ny, :nx]
    solid = (np.hypot(x - nx / 3, y - ny / 2) < min(nx, ny) / 6) & with_solid
    viscosity = 10 ** (2 * np.random.default_rng(0).random((ny, nx)))
    step = Step(device, viscosity, solid=solid, walls=walls).with_plan(iterations=30, tolerance=0.0)
    found, wanted = step(noise(ny, nx)), step.exact(noise(ny, nx))
    assert error(found, wanted) < 2e-6
    still = solid | np.roll(solid, 1, 1)
    assert not found[still, 0].any()
    assert not found[:, 0, 0].any()


@pytest.mark.parametrize("contrast", [1e2, 1e5])
@pytest.mark.parametrize("kind", ["disc", "stripes", "blobs", "soft disc", "soft blobs", "lines"])
def test_painted_masks_as_solved_live(device: Device, kind: str, contrast: float) -> None:
    size = 90, 100
    step = Step(device, contrast ** mask(kind, *size))
    for faces in (push(*size), vortices(*size)):
        step.solver.forget()
        assert error(step(faces), step.exact(faces)) < {1e2: 0.01, 1e5: 0.05}[contrast]


def uniform_exactly(faces: np.ndarray, k: float) -> np.ndarray:
    """The step of uniform dt mu / h^2 = k between free-slip walls, by sines and cosines."""
    fft: Any = scipy.fft  # its annotations are those of a dispatcher
    ny, nx = faces.shape[:2]
    u, v = np.zeros((2, ny, nx))
    u[:, 1:] = fft.dct(fft.dst(faces[:, 1:, 0], 1, axis=1), axis=0)
    v[1:] = fft.dct(fft.dst(faces[1:, :, 1], 1, axis=0), axis=1)
    x, y = 2 * np.sin(np.pi * np.arange(nx) / 2 / nx), 2 * np.sin(np.pi * np.arange(ny) / 2 / ny)[:, None]
    along_u, along_v, across = 1 + k * (2 * x**2 + y**2), 1 + k * (2 * y**2 + x**2), k * x * y
    determinant = along_u * along_v - across**2
    u, v = (along_v * u - across * v) / determinant, (along_u * v - across * u) / determinant
    result = np.zeros(faces.shape)
    result[:, 1:, 0] = fft.idst(fft.idct(u[:, 1:], axis=0), 1, axis=1)
    result[1:, :, 1] = fft.idst(fft.idct(v[1:], axis=1), 1, axis=0)
    return result


@pytest.mark.parametrize("k", [1e-4, 0.01, 0.3, 4.0, 30.0, 300.0, 1e4, 1e6])
def test_uniform_viscosity_as_solved_live(device: Device, k: float) -> None:
    size = 180, 256
    step = Step(device, np.full(size, k / 256**-2), dt=256.0**-4)
    for faces in (push(*size), vortices(*size)):
        wanted = uniform_exactly(faces.astype(np.float64), k)
        found = step(faces)
        assert error(found, wanted) < 0.01
        # Where little changes, little may be wrong, or it adds up from step to step.
        assert np.linalg.norm(found - wanted) < 0.05 * np.linalg.norm(wanted - faces) + 1e-6 * np.linalg.norm(faces)


@pytest.mark.parametrize("k", [0.01, 4.0, 300.0, 1e4])
@pytest.mark.parametrize("sticky", [(True, True, True, True), (False, True, True, True), (False, False, True, False)])
def test_uniform_viscosity_in_a_window_as_solved_live(
    device: Device, sticky: tuple[bool, bool, bool, bool], k: float
) -> None:
    """Sides of a window that stick, beside the picture's that glide: no sines solve it, and it is off by up to 3 %."""
    size = 96, 96
    step = Step(device, np.full(size, k / 96**-2), dt=96.0**-4, walls=Walls(sticky=sticky))
    for faces in (push(*size), vortices(*size)):
        assert error(step(faces), step.exact(faces)) < 0.031


@pytest.mark.parametrize("size", [(8, 8), (16, 16), (9, 17), (17, 9)])
@pytest.mark.parametrize("k", [0.01, 4.0, 1e3])
def test_uniform_viscosity_on_the_smallest_grids(device: Device, size: tuple[int, int], k: float) -> None:
    """There is one grid only, and its solution is exact; where little flows it is not asked for, see `plan_for`."""
    step = Step(device, np.full(size, k / max(size) ** -2), dt=max(size) ** -4.0)
    faces = push(*size)
    assert error(step(faces), uniform_exactly(faces.astype(np.float64), k)) < (1e-3 if k < 0.05 else 1e-4)


@pytest.mark.parametrize("aspect", [0.7, 0.94, 1.06, 1.5])
@pytest.mark.parametrize("kind", ["uniform", "varying", "no-slip", "stiff"])
def test_cells_that_are_not_square(device: Device, kind: str, aspect: float) -> None:
    size = 96, 128
    viscosity = 30.0 ** np.random.default_rng(4).random(size) if kind != "uniform" else np.full(size, 5.0)
    if kind == "stiff":
        viscosity = 1e5 ** mask("disc", *size)
    walls = Walls("none", (0.3, -0.2, 1.0, 0.5)) if kind == "no-slip" else Walls()
    step = Step(device, viscosity, walls=walls, aspect=aspect)
    if kind != "uniform":
        step.with_plan(iterations=30, tolerance=0.0)
    assert error(step(push(*size)), step.exact(push(*size))) < (0.01 if kind == "uniform" else 1e-4)


def test_no_viscosity_changes_nothing(device: Device) -> None:
    step, faces = Step(device, np.zeros((20, 30))), noise(20, 30)
    np.testing.assert_array_equal(step(faces), faces)


@pytest.mark.parametrize("kind", ["checkerboard", "noise", "disc", "lines"])
@pytest.mark.parametrize("least", [1e-6, 1.0, 1e5])
def test_nothing_blows_up(device: Device, kind: str, least: float) -> None:
    size = 40, 56
    step, faces = Step(device, least * 1e6 ** mask(kind, *size)), noise(*size)
    for _ in range(3):
        before, faces = faces, step(faces)
        assert np.linalg.norm(faces) <= 1.001 * np.linalg.norm(before)


@pytest.mark.parametrize("thick_on_top", [False, True])
def test_two_layer_couette(device: Device, thick_on_top: bool) -> None:
    """Steady shear of two layers, contrast 1e5: the interface moves at mu1 / (mu1 + mu2) of the wall's speed."""
    ny, nx, contrast = 8, 160, 1e5
    upper, lower = (contrast, 1.0) if thick_on_top else (1.0, contrast)
    viscosity = np.repeat([upper, lower], ny // 2)[:, None] * np.full(nx, 1e3)
    step = Step(device, viscosity, walls=Walls("none", (0, 0, 1, 0))).with_plan(iterations=12, tolerance=0.0)
    faces = np.zeros((ny, nx, 2))
    for _ in range(6):
        faces = step(faces)
    interface = upper / (upper + lower)
    depth = (np.arange(ny) + 0.5) / ny
    wanted = np.interp(depth, [0, 0.5, 1], [1, interface, 0])
    # In the middle of so long a box its ends are not felt.
    np.testing.assert_allclose(faces[:, nx // 2, 0], wanted, atol=1e-5)


def test_manufactured_step_is_of_second_order(device: Device) -> None:
    """The vortex under mu = 10^(-2 + 2.5 (1 + sin 2 pi x sin 2 pi y)), no-slip, dt = 1."""

    def velocity(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return (
            np.sin(np.pi * x) ** 2 * np.sin(2 * np.pi * y),
            -np.sin(2 * np.pi * x) * np.sin(np.pi * y) ** 2,
        )

    def viscosity(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return 10 ** (-2 + 2.5 * (1 + np.sin(2 * np.pi * x) * np.sin(2 * np.pi * y)))

    def stress(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        mu, stretch = viscosity(x, y), np.pi * np.sin(2 * np.pi * x) * np.sin(2 * np.pi * y)
        shear = (
            2
            * np.pi
            * (np.sin(np.pi * x) ** 2 * np.cos(2 * np.pi * y) - np.cos(2 * np.pi * x) * np.sin(np.pi * y) ** 2)
        )
        return 2 * mu * stretch, mu * shear, -2 * mu * stretch

    def derivative(values: list[np.ndarray], e: float) -> np.ndarray:
        return (values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * e)

    def right_hand_side(x: np.ndarray, y: np.ndarray, component: int) -> np.ndarray:
        e = 1e-3
        at = (-2 * e, -e, e, 2 * e)
        along_x = derivative([stress(x + d, y)[component] for d in at], e)
        along_y = derivative([stress(x, y + d)[component + 1] for d in at], e)
        return velocity(x, y)[component] - along_x - along_y

    errors = []
    for n in (24, 48, 96):
        j, i = np.mgrid[:n, :n] / n
        half = 0.5 / n
        v_star = np.stack([right_hand_side(i, j + half, 0), right_hand_side(i + half, j, 1)], axis=-1)
        wanted = np.stack([velocity(i, j + half)[0], velocity(i + half, j)[1]], axis=-1)
        v_star[:, 0, 0] = v_star[0, :, 1] = 0
        step = Step(device, viscosity(i + half, j + half), dt=1.0, walls=Walls("none"))
        step.with_plan(iterations=20, tolerance=0.0)
        errors.append(error(step(v_star), wanted))
    assert errors[0] / errors[1] > 2**1.9
    assert errors[1] / errors[2] > 2**1.9


def test_residual_says_how_well_it_was_solved(device: Device) -> None:
    size = 48, 64
    step, faces = Step(device, 1e2 ** mask("disc", *size)), vortices(*size)
    step(faces)
    solver = step.solver
    solver.forget()
    unsolved, live = solver.residual_norm(solver.v_star), solver.residual_norm(solver.solve())
    step.with_plan(iterations=20, tolerance=0.0)
    assert solver.residual_norm(solver.solve()) < 1e-4 < live < unsolved


def test_the_same_step_twice_is_the_same(device: Device) -> None:
    size = 48, 64
    step, faces = Step(device, 1e5 ** mask("blobs", *size)), vortices(*size)
    first = step(faces)
    step.solver.forget()
    np.testing.assert_array_equal(first, step(faces))


@pytest.mark.parametrize(("kind", "part"), [("disc", 0.2), ("soft disc", 0.8), ("blobs", 0.95), ("lines", 0.9)])
def test_what_the_last_step_changed_makes_the_next_one_more_exact(device: Device, kind: str, part: float) -> None:
    size = 90, 100
    step, faces = Step(device, 1e5 ** mask(kind, *size)), vortices(*size)
    exact = step.exact(faces)
    errors = [error(step(faces), exact) for _ in range(5)]
    assert errors[4] < part * errors[0]
    # A wholly different flow is none the worse for it.
    exact = step.exact(push(*size))
    misled = error(step(push(*size)), exact)
    step.solver.forget()
    assert misled < 1.1 * error(step(push(*size)), exact)


def test_strokes_over_a_stiff_disc_end_where_exact_steps_would(device: Device) -> None:
    """What a step leaves undone must not add up: half a turn of a brush around the disc, then coasting."""
    n, dt = 64, 1 / 60
    grid = Grid(n, n)
    maps = {}
    for exactly in (False, True):
        fluid, warp = Fluid(device, grid), WarpMap(device, grid)
        viscosity = 1e-4 * 1e5 ** mask("disc", n, n)
        exact = Step(device, viscosity, dt).with_plan(iterations=30, tolerance=0.0)
        if not exactly:
            fluid.set_viscosity(viscosity)
        for step in range(40):
            turn = np.pi * step / 25
            x, y = 0.5 + 0.25 * np.cos(turn), 0.45 + 0.2 * np.sin(turn)
            stroke = [
                along * np.exp(-((faces[0] - x) ** 2 + (faces[1] - y) ** 2) / 0.005)
                for along, faces in ((-np.sin(turn), grid.u_faces()), (np.cos(turn), grid.v_faces()))
            ]
            force = device.upload(np.stack(stroke, axis=-1).astype(np.float32))
            # Exactly: the fluid leaves the viscous step out, and what steers it makes that.
            steer = exact.solver.diffuse if exactly else None
            fluid.step(dt, [(force, 0.03)] if step < 25 else [], steer)
            warp.follow(fluid, dt)
            force.release()
        maps[exactly] = warp.read()
        fluid.release()
        warp.release()
    moved = np.linalg.norm(maps[True], axis=-1).mean()
    assert np.linalg.norm(maps[False] - maps[True], axis=-1).mean() < 0.05 * moved


@pytest.mark.parametrize(
    ("size", "depth"), [((128, 128), 0), ((61, 40), 0), ((251, 160), 2), ((147, 360), 2), ((2048, 32), 3)]
)
@pytest.mark.parametrize("viscosity", [3.0, 500.0])
def test_one_viscosity_is_solved_exactly_on_one_grid(
    device: Device, size: tuple[int, int], depth: int, viscosity: float
) -> None:
    solver = Step(device, np.full((size[1], size[0]), viscosity)).solver
    multigrid = solver.multigrid
    level = multigrid.direct_level
    assert level.depth == depth
    rng = np.random.default_rng(7)
    for field in level.rhs.fields:
        field.set(rng.standard_normal((field.size[1], field.size[0], 4)))
    # What open faces keep of it.
    multigrid.residual(level, level.faces.read, level.rhs, level.faces.write)
    rhs = level.faces.write.fields
    for target, source in zip(level.rhs.fields, rhs, strict=True):
        target.copy_from(source)
    wanted = np.stack([field.get() for field in rhs])
    multigrid.direct_solve(level.rhs)
    multigrid.residual(level, level.faces.read, level.rhs, level.faces.write)
    left = np.stack([field.get() for field in level.faces.write.fields])
    assert np.linalg.norm(left) <= 2e-5 * np.linalg.norm(wanted)


@pytest.mark.parametrize("size", [(32, 24), (61, 40), (260, 150)])
@pytest.mark.parametrize("walls", [Walls(), Walls("none")], ids=["free", "sticky"])
@pytest.mark.parametrize("kappa", [0.5, 1.0, 5.0])
def test_a_cycle_begins_from_rest(device: Device, size: tuple[int, int], walls: Walls, kappa: float) -> None:
    """Whatever its levels hold of what was solved before."""
    shape = size[1], size[0]
    step = Step(device, np.full(shape, kappa), walls=walls)
    wanted = step(noise(*shape))
    step(push(*shape))
    step.solver.forget()
    np.testing.assert_array_equal(step(noise(*shape)), wanted)


def test_what_was_solved_before_does_not_matter(device: Device) -> None:
    """A barely viscous mask after one viscosity, and at once: the same bytes."""
    size, rng = (32, 24), np.random.default_rng(5)
    velocity = rng.standard_normal((24, 32, 2)).astype(np.float32)
    velocity[:, 0, 0] = velocity[0, :, 1] = 0.0
    solid = device.field(size, 1, "solid", "f1")
    mask = device.upload(np.where(rng.random((24, 32)) < 0.3, 1e-3, 2e-4).astype(np.float32))
    found = []
    for before in (None, 1.4e-3, 0.5):
        solver = Viscosity(device, size)
        if before is not None:
            solver.set_coefficients(device.upload(np.full((24, 32), before, np.float32)), solid, 1 / 30, Walls())
        solver.set_coefficients(mask, solid, 1 / 30, Walls())
        assert solver.plan.method == "smooth"
        faces = device.double_field(size, 2)
        faces.read.set(velocity)
        solver.diffuse(faces.read)
        found.append(faces.read.get())
        solver.release()
    for other in found[1:]:
        np.testing.assert_array_equal(other, found[0])


@pytest.mark.parametrize("softest", [1.0, 30.0])
def test_cell_by_cell_noise_is_solved_until_little_is_left(device: Device, softest: float) -> None:
    """Each iteration brings four fifths of the one before or more: that says too little of what is left."""
    size = 96, 96
    step = Step(device, softest * 1e5 ** np.random.default_rng(0).random(size))
    faces = vortices(*size)
    assert error(step(faces), step.exact(faces)) < 0.05


def test_fluid_at_rest_stays_so_at_no_iteration(device: Device) -> None:
    step = Step(device, 1e5 ** mask("disc", 40, 60))
    assert not step(np.zeros((40, 60, 2), np.float32)).any()
    assert step.solver.conjugate_gradients.iterations == 0
    assert step(vortices(40, 60)).any()
    assert not step(np.zeros((40, 60, 2), np.float32)).any()
    assert not any(field.get().any() for field in step.solver.state())


def test_what_is_solid_does_not_say_how_the_rest_is_solved(device: Device) -> None:
    solid = np.zeros((48, 64), bool)
    solid[10:20, 30:50] = True
    plans = []
    for inside in (5.0, 1e-6, 1e6):
        step = Step(device, np.where(solid, inside, 5.0), solid=solid)
        plans.append(step.solver.plan)
    assert plans[1:] == plans[:1] * 2
    assert plans[0].method == "cg"


@pytest.mark.parametrize("kappa", [1e-6, 0.01, 0.1, 0.4, 3.0, 1e4])
@pytest.mark.parametrize("leaves", [0.5, 0.01, 1e-5])
def test_no_more_sweeps_are_made_than_leave_so_little(kappa: float, leaves: float) -> None:
    """Of n of them the error is 1 / T_n(1 + 1 / (8 kappa)), by Chebyshev's polynomials."""
    count = plans.sweeps_alone(kappa, leaves)
    left = [1 / scipy.special.eval_chebyt(n, 1 + 1 / (8 * kappa)) for n in (count - 1, count)]
    assert left[1] <= leaves < left[0]


def test_where_nothing_is_to_be_left_out_one_sweep_is_made() -> None:
    assert plans.sweeps_alone(0.0, 1e-6) == plans.sweeps_alone(5.0, 1.0) == plans.sweeps_alone(5.0, 2.0) == 1


BEYOND = 1 + 1e-9


@pytest.mark.parametrize(
    ("least", "largest", "wanted"),
    [
        (1.0, 300.0, Plan("cg", 2, 0.012, stiff=30)),
        (1.0, 300 * BEYOND, Plan("cg", 1, 0.07, stiff=30)),
        (4.0, 1200.0, Plan("cg", 2, 0.012, stiff=30)),
        (4.0, 1200 * BEYOND, Plan("cg", 1, 0.07, stiff=30)),
        (4 * BEYOND, 1300.0, Plan("cg", 2, 0.07, stiff=30)),
        # What is stiff: 30, or four times the softest.
        (1.0, 30.0, Plan("cg", 2, 0.012)),
        (1.0, 30 * BEYOND, Plan("cg", 2, 0.012, stiff=30)),
        (7.5, 30 * BEYOND, Plan("cg", 2, 0.012, stiff=30)),
        (10.0, 40.0, Plan("cg", 2, 0.012)),
        (10.0, 40 * BEYOND, Plan("cg", 2, 0.012, stiff=40)),
    ],
)
def test_how_a_viscous_step_is_solved_by_its_contrast(least: float, largest: float, wanted: Plan) -> None:
    """Of many cells; of few, to a ninth of the tolerance, but where the contrast is large."""
    for cells, share in ((64 * 64 + 1, 1.0), (64 * 64, 1 / 9)):
        tolerance = wanted.tolerance * (share if wanted.tolerance < 0.07 else 1)
        found = plans.plan_for(least, largest, cells, False, False)
        assert found == dataclasses.replace(wanted, stiff=pytest.approx(wanted.stiff), tolerance=tolerance)


@pytest.mark.parametrize(
    ("least", "largest", "wanted"),
    [
        (1.0, 300.0, (2, 30, False)),  # with edges, but neither soft nor of a large contrast
        (1.0, 300 * BEYOND, (2, 40, True)),
        (4.0, 1200.0, (2, 30, False)),
        (5.0, 200.0, (2, 30, False)),  # 40 times the softest
        (5.0, 200 * BEYOND, (2, 200, True)),
        (0.5, 151.0, (2, 30, True)),  # least of all is 30
    ],
)
def test_parts_with_edges_are_moved_as_a_whole(least: float, largest: float, wanted: tuple[int, float, bool]) -> None:
    plan = plans.plan_for(least, largest, 10_000, False, True)
    assert (plan.sweeps, pytest.approx(plan.stiff), plan.rigid) == wanted


@pytest.mark.parametrize("cells", [64 * 64, 64 * 64 + 1])
def test_little_viscosity_is_smoothed_alone_and_one_has_a_cycle_that_is_known(cells: int) -> None:
    """Up to ten sweeps, which leave 0.008 of the energy, or on few cells a ninth of it."""
    share = 1.0 if cells > 64 * 64 else 1 / 9
    for kappa in np.linspace(0.005, 1, 200):
        count = plans.sweeps_alone(kappa, share * 0.008 / (16 * kappa))
        for is_one in (False, True):
            found = plans.plan_for(0.0, kappa, cells, is_one, False)
            assert (found.method, found.sweeps) == ("smooth", count) if count <= 10 else (found.method == "cg")
            if is_one and count > 10:
                assert found == Plan("cg", 2, share * 0.008, cycle_leaves=0.52)


def test_what_is_sharp_has_solids_or_edges_along_a_quarter_of_its_border() -> None:
    """A border is where the softest, up to 40 times of it, meets what is stiffer; an edge, by 300 times stiffer."""
    soft, none = np.full((8, 12), 5.0), np.zeros((8, 12), bool)
    assert not plans.is_sharp(soft, none)
    solid = none.copy()
    solid[3, 4] = True
    assert plans.is_sharp(soft, solid)
    for turn in (lambda one: one, np.transpose):
        for edges, wanted in ((2, False), (3, True)):
            kappa = soft.copy()
            kappa[:, 5:] = 5 * 41
            kappa[:edges, 5:] = 5 * 301  # of a border of eight
            assert plans.is_sharp(turn(kappa), turn(none)) == wanted
            assert not plans.is_sharp(turn(kappa * 4 / 5), turn(none))  # up to 4 the softest flows
        step = np.where(np.arange(12) < 5, 5.0, 5 * 300.0) * np.ones((8, 1))
        assert not plans.is_sharp(turn(step), turn(none))
        assert plans.is_sharp(turn(np.where(step > 5, 5 * 301.0, 5)), turn(none))

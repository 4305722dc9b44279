"""Every stage of a step against the same formula in NumPy, float64."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable

import numpy as np
import pytest

from solver.fluid import Fluid
from solver.gl.device import Device
from solver.grid import Grid
from solver.params import FluidParams, Walls
from support import reference

SIZES = [(8, 8), (33, 17), (64, 48), (31, 64)]
SPEED = (0.3, -0.2, 1.0, 0.5)
WALLS = [Walls(), Walls("none", SPEED), Walls("free", SPEED, (True, False, False, True))]


def relative(got: np.ndarray, wanted: np.ndarray) -> float:
    return float(np.abs(got - wanted).max() / np.abs(wanted).max())


@pytest.mark.parametrize("walls", WALLS, ids=["free-slip", "moving no-slip", "either"])
@pytest.mark.parametrize(("nx", "ny"), SIZES)
@pytest.mark.parametrize("courant", [0.4, 3.0])
def test_trace_and_advect(device: Device, nx: int, ny: int, walls: Walls, courant: float) -> None:
    faces = reference.smooth_velocity(nx, ny, seed=nx, cells=5 if courant < 1 else 20)
    carried = reference.smooth_velocity(nx, ny, seed=nx + 1)
    force = reference.smooth_velocity(nx, ny, seed=nx + 2)
    dt = courant / max(nx, ny)
    # Without viscosity, and with so much drag that the bound of the energy has nothing to do.
    fluid = Fluid(device, Grid(nx, ny), FluidParams(walls=walls, drag=0.5 / dt))
    faces[:, 0, 0] = faces[0, :, 1] = 0.0
    fluid.set_velocity(faces)
    before = fluid.save()
    fluid.restore(before.with_arrays(device, before.arrays() | {"carried": carried.astype(np.float32)}))
    traced = reference.trace(faces, courant, no_slip=walls.no_slip, speed=walls.speed)
    fluid.trace(0.5 * dt)  # another step's is not taken for it
    assert relative(fluid.trace(dt).get(), traced) < 1e-4
    advected: list[np.ndarray] = []
    fluid.step(dt, [(device.upload(force), 0.3)], steer=lambda velocity: advected.append(velocity.get()))
    (after,) = advected
    wanted = reference.advect(faces, courant, 0.3 * force - carried, no_slip=walls.no_slip, speed=walls.speed)
    wanted *= np.exp(-0.5)
    assert relative(after, wanted) < 1e-4
    assert (after[:, 0, 0] == 0).all()
    assert (after[0, :, 1] == 0).all()
    fluid.release()


CHANGES: dict[str, Callable[[Fluid], object]] = {
    "add_force": lambda fluid: fluid.add_force(lambda x, y, t: (5 * x * y, -5 * x * y), 0.3),
    "advect": lambda fluid: fluid.advect(0.1),
    "diffuse": lambda fluid: fluid.diffuse(0.1),
    "project": lambda fluid: fluid.project(),
    "step": lambda fluid: fluid.step(0.1),
    "set_velocity": lambda fluid: fluid.set_velocity(lambda x, y, t: (np.sin(9 * y), 0 * x)),
}


@pytest.mark.parametrize("change", CHANGES)
def test_after_every_change_the_trace_and_the_strain_are_of_the_velocity_as_it_is_then(
    device: Device, change: str
) -> None:
    grid = Grid(24, 16)
    fluid, fresh = Fluid(device, grid), Fluid(device, grid)
    fluid.set_viscosity(0.05)
    fluid.set_velocity(reference.smooth_velocity(24, 16, seed=2, cells=10))
    before, strain = fluid.trace(0.05).get(), fluid.strain(0.05)
    CHANGES[change](fluid)
    fresh.set_velocity(fluid.velocity.read.get())
    found = fluid.trace(0.05).get()
    assert relative(found, fresh.trace(0.05).get()) < 1e-6
    assert relative(found, before) > 1e-3
    assert fluid.strain(0.05) == pytest.approx(fresh.strain(0.05), rel=1e-5)
    assert fluid.strain(0.05) != pytest.approx(strain, rel=1e-4)
    fluid.release()
    fresh.release()


def test_add_force_and_source(device: Device) -> None:
    faces = reference.smooth_velocity(20, 14, seed=3).astype(np.float32)
    velocity, force = device.upload(faces), device.upload(faces[::-1].copy())
    device.pass_("step/add_impulse.frag")(velocity, add=True, force=force, impulse=0.25)
    np.testing.assert_allclose(velocity.get(), faces + np.float32(0.25) * faces[::-1], rtol=1e-6)


@pytest.mark.parametrize(("nx", "ny"), SIZES)
def test_paper_diffusion_sweep_is_appendix_a(device: Device, nx: int, ny: int) -> None:
    rng = np.random.default_rng(nx)
    velocity, before = rng.standard_normal((2, ny, nx, 2))
    viscosity = rng.uniform(0, 1, (ny, nx))
    out = device.field((nx, ny), 2)
    device.pass_("paper/diffuse.frag")(
        out,
        velocity=device.upload(velocity),
        before=device.upload(before),
        viscosity=device.upload(viscosity),
        solid=device.field((nx, ny), 1, dtype="f1"),
        dt_over_h2=0.7,
    )
    assert relative(out.get(), reference.paper_diffuse_sweep(velocity, before, viscosity, 0.7)) < 1e-4


def test_the_papers_velocity_loses_the_gradient_of_its_pressure(device: Device) -> None:
    rng = np.random.default_rng(4)
    velocity, pressure, solid = (
        rng.standard_normal((14, 20, 2)),
        rng.standard_normal((14, 20)),
        rng.random((14, 20)) < 0.1,
    )
    out, h = device.field((20, 14), 2), 0.05
    device.pass_("paper/subtract_gradient.frag")(
        out, velocity=device.upload(velocity), pressure=device.upload(pressure), solid=device.upload(solid * 1.0), h=h
    )
    padded = reference.paper_padded(pressure)
    gradient = np.stack([padded[1:-1, 2:] - padded[1:-1, :-2], padded[2:, 1:-1] - padded[:-2, 1:-1]], axis=-1) / (2 * h)
    assert relative(out.get(), np.where(solid[..., None], 0, velocity - gradient)) < 1e-5


TWO_DEVICES = """
import gc
import numpy as np
from solver import Device, Fluid, Grid

gc.disable()
first = Device.headless()
for _ in range(3):
    fluid = Fluid(first, Grid(32, 24))
    fluid.itself = fluid
    del fluid
second = Device.headless()
kept = [second.upload(np.full((5, 7), float(i), np.float32)) for i in range(300)]
gc.collect()
assert all((field.get() == i).all() for i, field in enumerate(kept))
fluid = Fluid(second, Grid(32, 24))
fluid.step(0.01, [])
assert all((field.get() == i).all() for i, field in enumerate(kept))
"""


def test_garbage_is_freed_in_its_own_context_only() -> None:
    """Names of textures are numbers: freed under another context they would take that one's textures away."""
    result = subprocess.run([sys.executable, "-c", TWO_DEVICES], capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr

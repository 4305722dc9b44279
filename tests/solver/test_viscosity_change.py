"""The viscous solve leaves a fraction of the change it makes: a steady state is a fixed point of it."""

from __future__ import annotations

import numpy as np

from solver.gl.device import Device
from solver.params import Walls
from solver.viscosity.solve import Viscosity
from support import reference


def test_error_is_a_fraction_of_the_change(device: Device) -> None:
    n, dt = 32, 1 / 32
    speed = (0.0, 0.0, 1.0, 0.0)
    viscosity = np.full((n, n), 0.01)
    faces = reference.smooth_velocity(n, n, seed=3)
    solver = Viscosity(device, (n, n))
    solid = device.field((n, n), 1, dtype="f1")
    solver.set_coefficients(device.upload(viscosity), solid, dt, Walls("none", speed))
    for _ in range(40):  # towards the steady state
        faces = reference.viscous_step(faces, viscosity, dt, 1 / n, no_slip=(True,) * 5, speed=speed)
    velocity = device.double_field((n, n), 2, "velocity")
    velocity.read.set(faces)
    solver.diffuse(velocity.read)
    wanted = reference.viscous_step(faces, viscosity, dt, 1 / n, no_slip=(True,) * 5, speed=speed)
    change = np.abs(wanted - faces).max()
    assert np.abs(velocity.read.get() - wanted).max() < 0.02 * change + 1e-5


def test_a_flow_that_goes_on_as_it_did_takes_one_cycle_and_no_products(device: Device) -> None:
    """Of one viscosity: the guess's residual tells that a cycle leaves little enough."""
    n, dt = 72, 1 / 60  # beyond `SMALL`: on smaller grids more is asked for
    viscosity, no_slip = np.full((n, n), 0.03), (True,) * 5
    start, more = (reference.smooth_velocity(n, n, seed=seed) for seed in (3, 4))
    solver = Viscosity(device, (n, n))
    solver.set_coefficients(device.upload(viscosity), device.field((n, n), 1, dtype="f1"), dt, Walls("none"))
    velocity = device.double_field((n, n), 2, "velocity")
    taken, left = [], []
    for step in range(6):
        v_star = start + 0.002 * step * more
        velocity.read.set(v_star)
        before = device.timings.passes["other"]
        solver.diffuse(velocity.read)
        taken.append(device.timings.passes["other"] - before)
        wanted = reference.viscous_step(v_star, viscosity, dt, 1 / n, no_slip=no_slip)
        left.append(np.linalg.norm(velocity.read.get() - wanted) / np.linalg.norm(wanted))
    assert max(left) < 0.005
    before = device.timings.passes["other"]
    solver.multigrid.precondition(solver.v_star, start=False)
    cycle = device.timings.passes["other"] - before
    assert taken[-1] == cycle + 4  # to pack, the guess, its correction, to unpack

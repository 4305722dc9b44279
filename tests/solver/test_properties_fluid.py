"""The properties of tests/properties/fluid.py with a few seeds; nightly.py tries them with new ones."""

from __future__ import annotations

import numpy as np
import pytest

from properties import fluid as properties
from solver.fluid import Fluid
from solver.gl.device import Device
from solver.grid import Grid


@pytest.mark.parametrize("seed", range(6))
def test_energy_of_unforced_flow_never_grows(device: Device, seed: int) -> None:
    properties.check_energy_of_unforced_flow(device, seed, steps=100)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(1))  # of 4 s each; `nightly.py` draws more
def test_whatever_is_put_in_all_stays_finite_and_bounded(device: Device, seed: int) -> None:
    properties.check_anything_goes(device, seed, steps=90, each=60)  # two set-ups, of 60 and 30


@pytest.mark.parametrize("seed", range(2))
def test_a_brush_to_and_fro_does_not_pump_the_fluid_up(device: Device, seed: int) -> None:
    properties.check_brush_to_and_fro(device, seed, seconds=5.0)


@pytest.mark.parametrize(("seed", "ticks"), [(0, 24), (1, 24), (310034, 60)])
def test_mirrored_and_turned_set_ups_give_mirrored_and_turned_maps(device: Device, seed: int, ticks: int) -> None:
    properties.check_symmetry(device, seed, ticks=ticks)


def test_they_do_with_masks(device: Device) -> None:
    properties.check_symmetry_with_masks(device, 0, ticks=24)


@pytest.mark.parametrize("turn", properties.TURNS)
def test_the_bend_of_a_flow_is_the_same_when_it_is_turned(device: Device, turn: str) -> None:
    """In how many parts the map is carried, and so when it is remapped, follows from the bend alone."""
    rng, grid = np.random.default_rng(0), Grid(19, 14)
    faces = rng.standard_normal((grid.ny, grid.nx, 2)).astype(np.float32)
    faces[:, 0, 0] = faces[0, :, 1] = 0.0
    found = []
    for flow, cells in ((faces, grid), (properties.turned(faces, turn), Grid(14, 19) if "t" in turn else grid)):
        fluid = Fluid(device, cells)
        fluid.set_velocity(flow)
        found.append(fluid.strain(1 / 60))
        fluid.release()
    assert found[1] == pytest.approx(found[0], rel=1e-5)


def test_the_bend_of_a_flow_is_its_gradient_at_the_corners(device: Device) -> None:
    """Of the strains of the four cells around one the mean; on the far walls the flow is at rest."""
    rng, grid = np.random.default_rng(0), Grid(19, 14, (1.0, 0.6))
    faces = rng.standard_normal((grid.ny, grid.nx, 2)).astype(np.float32)
    faces[:, 0, 0] = faces[0, :, 1] = 0.0
    fluid = Fluid(device, grid)
    fluid.set_velocity(faces)
    (hx, hy), (u, v) = grid.spacing, np.moveaxis(faces.astype(np.float64), -1, 0)
    across, down = (np.diff(of, axis=axis, append=0) for of, axis in ((u, 1), (v, 0)))
    around = [(slice(i, i + 13), slice(j, j + 18)) for i in (0, 1) for j in (0, 1)]
    strains = [np.mean([of[cells] for cells in around], axis=0) for of in (across / hx, down / hy)]
    shears = np.diff(u, axis=0)[:, 1:] / hy, np.diff(v, axis=1)[1:] / hx
    wanted = np.linalg.norm(np.stack([*strains, *shears]), axis=0).max() / 60
    assert fluid.strain(1 / 60) == pytest.approx(wanted, rel=1e-5)
    fluid.release()

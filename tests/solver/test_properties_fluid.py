"""The properties of tests/properties/fluid.py with a few seeds; nightly.py tries them with new ones."""

from __future__ import annotations

import pytest

from properties import fluid as properties
from solver.gl.device import Device


@pytest.mark.parametrize("seed", range(6))
def test_energy_of_unforced_flow_never_grows(device: Device, seed: int) -> None:
    properties.check_energy_of_unforced_flow(device, seed, steps=100)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(1))  # of 10 s each; `nightly.py` draws more
def test_whatever_is_put_in_all_stays_finite_and_bounded(device: Device, seed: int) -> None:
    properties.check_anything_goes(device, seed, steps=200)


@pytest.mark.parametrize("seed", range(2))
def test_a_brush_to_and_fro_does_not_pump_the_fluid_up(device: Device, seed: int) -> None:
    properties.check_brush_to_and_fro(device, seed, seconds=5.0)


@pytest.mark.parametrize("seed", [0, 1, 310034])
def test_mirrored_and_turned_set_ups_give_mirrored_and_turned_maps(device: Device, seed: int) -> None:
    properties.check_symmetry(device, seed)


def test_they_do_with_masks(device: Device) -> None:
    properties.check_symmetry_with_masks(device, 0)

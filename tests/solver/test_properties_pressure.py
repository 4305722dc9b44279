"""The properties of tests/properties/pressure.py with a few seeds; nightly.py tries them with new ones."""

from __future__ import annotations

import pytest

from properties import pressure as properties
from solver.gl.device import Device


@pytest.mark.parametrize("seed", range(14))
def test_a_thousandth_of_the_divergence_is_left(device: Device, seed: int) -> None:
    properties.check_divergence(device, seed)


@pytest.mark.parametrize("seed", range(0, 42, 3))  # each of seven masks at two of six sizes; nightly.py has all
def test_it_is_at_every_size(device: Device, seed: int) -> None:
    properties.check_divergence_of_large(device, seed)


@pytest.mark.parametrize("seed", range(7))
def test_a_source_acts_less_its_mean_over_each_region(device: Device, seed: int) -> None:
    properties.check_source(device, seed)


@pytest.mark.parametrize("seed", range(14))
def test_what_is_free_of_divergence_stays_as_it_is(device: Device, seed: int) -> None:
    properties.check_again_and_again(device, seed)


@pytest.mark.parametrize("seed", range(7))
def test_what_is_mirrored_or_transposed_is_projected_so(device: Device, seed: int) -> None:
    properties.check_symmetry(device, seed)


@pytest.mark.parametrize("seed", range(7))
def test_the_cycle_is_symmetric_and_definite(device: Device, seed: int) -> None:
    properties.check_cycle(device, seed)

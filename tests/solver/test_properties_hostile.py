"""The properties of tests/properties/hostile.py with a few seeds; nightly.py tries them with new ones."""

from __future__ import annotations

import pytest

from properties import hostile as properties
from solver.gl.device import Device


# 2, 28 and 40 had solid cells so long that one over their links is more than half a float holds; in 7099 r.z was 0 in
# float32, so slow was the fluid.
@pytest.mark.parametrize("seed", [*range(4), 28, 40, 7099])
def test_what_is_accepted_gives_finite_numbers_and_no_energy(device: Device, seed: int) -> None:
    properties.check_the_ends_of_what_is_accepted(device, seed)


# 14 drew a negative viscosity into the field that overflowed; 7316 gave a force that is refused, and NumPy warned too.
@pytest.mark.parametrize("seed", [*range(4), 14, 7316])
def test_whatever_is_called_is_done_or_refused_in_a_sentence(device: Device, seed: int) -> None:
    properties.check_calls_in_any_order(device, seed)

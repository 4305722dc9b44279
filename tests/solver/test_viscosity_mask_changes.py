"""Taking up a mask after another one, where only what has changed is made again, gives what taking it up first does."""

from __future__ import annotations

import numpy as np
import pytest

from properties import viscosity
from solver.gl.device import Device
from solver.viscosity.box import Box, changed


@pytest.mark.parametrize("seed", range(8))  # of 14 changes each; nightly.py draws more
def test_a_changed_mask_is_taken_up_as_a_new_one(device: Device, seed: int) -> None:
    viscosity.check_changed_viscous_mask(device, seed)


def test_the_changed_box_holds_every_cell_that_differs() -> None:
    before = np.zeros((5, 7))
    after = before.copy()
    assert changed(before, after) is None
    after[1, 2] = after[3, 5] = 1.0
    assert changed(before, after) == Box(1, 4, 2, 6)

"""Reductions agree with NumPy at any size."""

from __future__ import annotations

import numpy as np
import pytest

from solver.brush.brush import Sum
from solver.gl.device import Device
from solver.gl.reduction import Reduction


@pytest.mark.parametrize("size", [(1, 1), (16, 16), (17, 5), (64, 64), (333, 217), (5, 700)])
def test_reduction_agrees_with_numpy(device: Device, size: tuple[int, int]) -> None:
    array = np.random.default_rng(1).integers(-500, 500, (size[1], size[0], 3)).astype(np.float32)
    field = device.upload(array)
    flat = array.reshape(-1, 3).astype(np.float64)
    np.testing.assert_array_equal(Reduction(device, size, 3, "max")(field), flat.max(axis=0))
    np.testing.assert_array_equal(Reduction(device, size, 3, "sum")(field), flat.sum(axis=0))


@pytest.mark.parametrize("size", [(16, 16), (333, 217)])
@pytest.mark.parametrize("components", [1, 2])
def test_what_a_brush_draws_is_summed_up_in_each_component(
    device: Device, size: tuple[int, int], components: int
) -> None:
    array = np.random.default_rng(1).integers(-500, 500, (size[1], size[0], components)).astype(np.float32)
    drawn = Sum(device, size, components)
    found = drawn.of(lambda field: field.set(array))
    np.testing.assert_array_equal(found, array.astype(np.float64).sum(axis=(0, 1)))
    drawn.release()

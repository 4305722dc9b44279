"""A few seeds of the properties of the viscous step; more by hand, see tests/properties."""

from __future__ import annotations

import numpy as np
import pytest

from properties import viscosity
from solver.gl.device import Device


@pytest.mark.parametrize("seed", range(8))
def test_viscous_step_is_near_the_direct_solution(device: Device, seed: int) -> None:
    viscosity.check_viscous_step(device, seed)


@pytest.mark.parametrize("seed", range(16))
def test_viscous_step_is_the_same_in_the_mirror(device: Device, seed: int) -> None:
    viscosity.check_viscous_step_in_the_mirror(device, seed)


@pytest.mark.parametrize("seed", range(12))
def test_viscous_step_is_stable(device: Device, seed: int) -> None:
    viscosity.check_viscous_step_is_stable(device, seed)


@pytest.mark.parametrize("kind", viscosity.CLASSES)
@pytest.mark.parametrize(("contrast", "softest"), [(1e2, 1.0), (1e5, 1.0), (1e5, 30.0)])
def test_every_class_of_mask(device: Device, kind: str, contrast: float, softest: float) -> None:
    case = viscosity.Case.random(kind, (96, 96), contrast, softest, np.random.default_rng(0))
    found, iterations = case.solved(device)
    assert viscosity.error(found, case.exact()) < viscosity.ERROR[contrast]
    assert iterations <= viscosity.ITERATIONS[softest]

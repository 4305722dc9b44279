"""Equation (5) alone: densities carried by a known flow, diffused in known modes, fed at a known rate."""

from __future__ import annotations

import numpy as np
import pytest

from solver.gl.device import Device
from solver.grid import Grid
from solver.warp.density import Density

STILL = np.zeros((12, 16, 2), np.float32)
GRID = Grid(16, 12)


def advanced(device: Device, values: np.ndarray, dt: float, velocity: np.ndarray = STILL, **how: object) -> np.ndarray:
    density = Density(device, values, **how)  # type: ignore[arg-type]
    faces = device.upload(velocity)
    density.advance(faces, GRID, dt)
    found = density.get()
    density.release()
    faces.release()
    return found


@pytest.mark.parametrize("shape", [(24, 32), (24, 32, 3), (30, 40, 4)])
def test_it_is_carried_downstream_and_mixed_between_four(device: Device, shape: tuple[int, ...]) -> None:
    values = np.random.default_rng(0).random(shape, np.float32)
    velocity = np.broadcast_to(np.array([0.3, -0.2], np.float32), STILL.shape)
    dt = 0.25
    found = advanced(device, values, dt, velocity)
    # In texels; those whose way lies inside, away from the walls' own faces.
    across, down = dt * 0.3 * shape[1], -dt * 0.2 * shape[1]
    rows, columns = np.mgrid[6 : shape[0] - 9, 6 : shape[1] - 6]
    y, x = rows - down, columns - across
    i, j, fx, fy = np.floor(x).astype(int), np.floor(y).astype(int), x - np.floor(x), y - np.floor(y)
    fx, fy = (f.reshape(*f.shape, *(1,) * (len(shape) - 2)) for f in (fx, fy))
    upper = values[j, i] * (1 - fx) + values[j, i + 1] * fx
    lower = values[j + 1, i] * (1 - fx) + values[j + 1, i + 1] * fx
    np.testing.assert_allclose(found[rows, columns], upper * (1 - fy) + lower * fy, atol=2e-4)


@pytest.mark.parametrize("modes", [(1, 0), (0, 2), (3, 1)])
def test_a_mode_fades_at_its_rate_and_nothing_is_lost(device: Device, modes: tuple[int, int]) -> None:
    """cos(pi m x / width) cos(pi n y / height) is one of the implicit step between walls that let nothing through."""
    height, width, kappa, dt = 36, 48, 2e-3, 0.05
    m, n = modes
    x, y = (np.arange(width) + 0.5) / width, (np.arange(height)[:, None] + 0.5) / height
    wave = np.cos(np.pi * m * x) * np.cos(np.pi * n * y)
    found = advanced(device, (0.5 + 0.4 * wave).astype(np.float32), dt, kappa=kappa)
    rate = kappa * ((2 - 2 * np.cos(np.pi * m / width)) * width**2 + (2 - 2 * np.cos(np.pi * n / height)) * width**2)
    np.testing.assert_allclose(found, 0.5 + 0.4 * wave / (1 + dt * rate), atol=1e-4)


def test_the_source_is_added_by_the_second(device: Device) -> None:
    values = np.random.default_rng(1).random((24, 32, 4), np.float32)
    source = np.random.default_rng(2).random((24, 32, 4)).astype(np.float32)
    np.testing.assert_allclose(advanced(device, values, 0.1, source=source), values + 0.1 * source, atol=1e-6)

"""The operator of the viscous step in its parts: Galerkin levels, and direct solves with clusters."""

from __future__ import annotations

from itertools import pairwise, product

import numpy as np
import pytest

from solver.components import connected_components
from solver.gl.device import Device
from solver.packing import packed, unpacked
from solver.params import NoSlip
from solver.viscosity.clusters import ClusterMatrix
from solver.viscosity.conjugate_gradients import cg_coefficients
from solver.viscosity.multigrid import Multigrid
from solver.viscosity.operator import Coefficients
from solver.viscosity.plan import Plan


def along(count: int) -> np.ndarray:
    """Interpolation of faces along their normal, 1/2 1 1/2, (fine, coarse); there are walls at both ends."""
    fine, coarse = np.arange(count)[:, None], 2 * np.arange(count // 2)
    return np.maximum(1.0 - 0.5 * abs(fine - coarse), 0.0)


def across(count: int, sticks: tuple[bool, bool] = (False, False)) -> np.ndarray:
    """Interpolation of faces across it, 1/4 3/4; beyond a wall lies their image, or nothing where it sticks."""
    weights = np.zeros((count, count // 2))
    for fine in range(count):
        weights[fine, fine // 2] += 0.75
        beside = fine // 2 + (1 if fine % 2 else -1)
        within = min(max(beside, 0), count // 2 - 1)
        if beside == within or not sticks[beside > 0]:
            weights[fine, within] += 0.25
    return weights


SIZE = 32, 16


def of_random_viscosity(device: Device, aspect: float) -> Multigrid:
    """Random viscosity cell by cell, free-slip walls."""
    rng, (nx, ny) = np.random.default_rng(3), SIZE
    viscosity, solid = (10 ** rng.uniform(-2, 4, (ny, nx))).astype(np.float32), np.zeros((ny, nx), bool)
    fields = device.upload(viscosity), device.upload(solid.astype(np.uint8))
    multigrid = Multigrid(device, SIZE, (1 / nx, aspect / nx))
    multigrid.set_coefficients(*fields, viscosity, solid, 1 / nx**2, NoSlip(*5 * [False]), Plan())
    return multigrid


@pytest.mark.parametrize("aspect", [1.0, 1.3])
def test_a_coarse_residual_is_that_of_the_matrix(device: Device, aspect: float) -> None:
    rng, multigrid = np.random.default_rng(4), of_random_viscosity(device, aspect)
    for level in multigrid.levels:
        coefficients, (columns, rows) = level.coefficients(), level.texels
        is_open = np.stack([coefficients.open_u, coefficients.open_v])
        faces = is_open * rng.standard_normal((2, 2 * rows, 2 * columns))
        for field, cells in zip(level.faces.read.fields, faces, strict=True):
            field.set(np.pad(packed(cells), ((1, 1), (1, 1), (0, 0))).astype(np.float32))
        for field in level.rhs.fields:
            field.clear()
        multigrid.residual(level, level.faces.read, level.rhs, level.faces.write)
        found = np.stack([unpacked(field.get(level.region)) for field in level.faces.write.fields])
        wanted = is_open * (-coefficients.matrix() @ faces.ravel()).reshape(faces.shape)
        np.testing.assert_allclose(found, wanted, atol=1e-5 * abs(wanted).max())
    multigrid.release()


@pytest.mark.parametrize("size", [(57, 41), (64, 33), (9, 130)])
def test_a_coarse_level_covers_all_of_the_finer_one(device: Device, size: tuple[int, int]) -> None:
    """Also the last cell of an odd number."""
    multigrid = Multigrid(device, size, (1 / max(size), 1 / max(size)))
    for fine, coarse in pairwise(multigrid.levels):
        for whole, half in zip(fine.size, coarse.size, strict=True):
            assert whole <= 2 * half <= whole + 1
    multigrid.release()


@pytest.mark.parametrize("aspect", [1.0, 1.3])
def test_coarse_operators_are_galerkin_products(device: Device, aspect: float) -> None:
    """(A - I) of a level is P' (A - I) P / 4 of the next finer one."""
    (nx, ny), multigrid = SIZE, of_random_viscosity(device, aspect)
    strains = [
        level.coefficients().matrix() - np.eye(8 * level.texels[0] * level.texels[1]) for level in multigrid.levels
    ]
    assert len(strains) == 3
    for fine, coarse in pairwise(strains):
        u, v = np.kron(across(ny), along(nx)), np.kron(along(ny), across(nx))
        p = np.block([[u, np.zeros_like(u)], [np.zeros_like(v), v]])
        open_coarse = coarse.any(axis=0)
        wanted = (p.T @ fine @ p / 4.0)[open_coarse][:, open_coarse]
        assert abs(coarse[open_coarse][:, open_coarse] - wanted).max() < 1e-6 * abs(wanted).max()
        nx, ny = nx // 2, ny // 2
    multigrid.release()


@pytest.mark.parametrize("solids", [False, True])
@pytest.mark.parametrize("sides", [*product([False, True], repeat=4)])
def test_a_correction_is_spread_by_whether_each_side_sticks(
    device: Device, sides: tuple[bool, bool, bool, bool], solids: bool
) -> None:
    """Whatever solid cells do, of which there are none; onto each finer level."""
    rng, (nx, ny), (left, right, top, bottom) = np.random.default_rng(5), SIZE, sides
    viscosity, solid = (10 ** rng.uniform(-2, 4, (ny, nx))).astype(np.float32), np.zeros((ny, nx), bool)
    multigrid = Multigrid(device, SIZE, (1 / nx, 1 / nx))
    fields = device.upload(viscosity), device.upload(solid.astype(np.uint8))
    multigrid.set_coefficients(*fields, viscosity, solid, 1 / nx**2, NoSlip(*sides, solids), Plan())
    for fine, coarse in pairwise(multigrid.levels):
        is_open = [np.stack([level.coefficients().open_u, level.coefficients().open_v]) for level in (fine, coarse)]
        faces = is_open[1] * rng.uniform(1, 2, is_open[1].shape)
        for field, cells in zip(coarse.faces.read.fields, faces, strict=True):
            field.set(np.pad(packed(cells), ((1, 1), (1, 1), (0, 0))).astype(np.float32))
        device.pass_("viscosity/prolong.frag", CORRECTION=1, **fine.defines)(
            fine.faces.write.fields,
            region=fine.region,
            alone=coarse.alone,
            **coarse.faces.read.inputs("coarse_"),
            **fine.bounds,
        )
        found = np.stack([unpacked(field.get(fine.region)) for field in fine.faces.write.fields])
        u = across(ny, (top, bottom)) @ faces[0] @ along(nx).T
        v = along(ny) @ faces[1] @ across(nx, (left, right)).T
        np.testing.assert_allclose(found, is_open[0] * np.stack([u, v]), atol=1e-5)
        nx, ny = nx // 2, ny // 2
    multigrid.release()


@pytest.mark.parametrize("aspect", [1.0, 1.3, 0.4])
@pytest.mark.parametrize("sides", [(False, False, False, False), (True, False, False, True), (True, True, True, True)])
def test_one_viscosity_has_the_operator_of_a_mask_that_is_the_same_everywhere(
    device: Device, aspect: float, sides: tuple[bool, bool, bool, bool]
) -> None:
    """On cells of any shape, between walls that glide or stick."""
    no_slip, (columns, rows) = NoSlip(*sides, False), (10, 7)
    viscosity, solid = np.full((rows, columns), 3.0, np.float32), np.zeros((rows, columns), bool)
    fields = device.upload(viscosity), device.upload(solid.astype(np.uint8))
    multigrid = Multigrid(device, (columns, rows), (0.1, 0.1 * aspect))
    multigrid.set_coefficients(*fields, viscosity, solid, 0.02, no_slip, Plan())
    level, kappa = multigrid.finest, 3.0 * 0.02 / (0.1 * 0.1 * aspect)
    uniform = Coefficients.uniform(kappa, (columns, rows), level.texels, level.shear, no_slip)
    np.testing.assert_allclose(uniform.matrix(), level.coefficients().matrix(), atol=1e-5 * kappa)
    multigrid.release()


@pytest.mark.parametrize("seed", range(20))
def test_clusters_are_solved_directly(seed: int) -> None:
    """Unknowns in strips of which each meets its neighbours only, as few as one and as many as make several blocks."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 120))
    strip = 2 + rng.integers(0, rng.integers(1, 8), count)
    one, other = rng.integers(0, count, (2, rng.integers(0, 2 * count)))
    near = abs(strip[one] - strip[other]) < 2
    one, other = one[near], other[near]
    values = rng.normal(size=len(one))
    matrix = np.zeros((count, count))
    np.add.at(matrix, (one, other), values)
    matrix += matrix.T
    own = abs(matrix).sum(axis=1) + rng.uniform(0.1, 1.0, count)
    matrix += np.diag(own)
    each = np.arange(count)
    rows, columns = np.append(one, each), np.append(other, each)
    solver = ClusterMatrix(connected_components(each, one, other), strip, rows, columns, np.append(values, 0.5 * own))
    rhs = rng.normal(size=count)
    assert np.allclose(matrix @ solver.solve(rhs), rhs, atol=1e-9)


@pytest.mark.parametrize(
    ("numbers", "wanted"),
    [
        ((6.0, 2.0, 0.0, 0.0), (3.0, 0.0, 2.0)),  # the first direction is z itself
        ((6.0, 2.0, -1.0, 4.0), (6.0 / 1.75, 0.25, 1.75)),  # p . A p = z . A z + beta z . A p_before
        ((6.0, 2.0, 1.0, -4.0), (3.0, 0.0, 2.0)),
        ((6.0, 1.0, 1.0, 1.0), (0.0, 0.0, 0.0)),  # all of z has been in the direction before
        ((6.0, 1.0, 1.0, 1.0 / (1 - 2e-6)), (6.0 / 2e-6, -(1 - 2e-6), 2e-6)),
        ((6.0, 1.0, 1.0, 1.0 / (1 - 5e-7)), (0.0, 0.0, 0.0)),
        ((float("nan"), 2.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        ((float("inf"), 2.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        ((6.0, float("nan"), 0.0, 0.0), (0.0, 0.0, 0.0)),
        ((6.0, float("inf"), 0.0, 0.0), (0.0, 0.0, 0.0)),
        ((0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    ],
)
def test_a_direction_of_which_rounding_leaves_nothing_is_none(numbers: tuple[float, ...], wanted: tuple) -> None:
    assert cg_coefficients(*numbers) == pytest.approx(wanted)

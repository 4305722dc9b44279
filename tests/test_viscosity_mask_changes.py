"""Taking up a mask after another one, where only what has changed is made again, gives what taking it up first does."""

from __future__ import annotations

import numpy as np
import pytest

from solver.gl.device import Device
from solver.params import Walls
from solver.viscosity.changed import Box, changed
from solver.viscosity.solve import Viscosity

SIZES = (64, 48), (97, 61), (33, 130), (16, 200), (7, 9)


def textures(solver: Viscosity) -> dict[str, np.ndarray]:
    """All that passes read of the coefficients."""
    if "UNIFORM" in solver.multigrid.finest.defines:
        return {}  # they follow from the place
    grids = solver.multigrid.levels[: solver.multigrid.last.depth + 1]
    found = {field.label: field.get() for grid in grids for field in grid.packed.values()}
    if solver.multigrid.last is solver.multigrid.levels[-1]:
        found["inverse"] = solver.multigrid._inverse.get()
    if solver.deflation.space is not None:
        fields = *solver.deflation._part_of, solver.deflation._tables[0]
        found |= {field.label: field.get() for field in fields}
        count = solver.deflation.space.parts.count + 1
        found["motions"] = solver.deflation.space.solve(np.random.default_rng(0).normal(size=(count, 3)))
    return found


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("seed", range(3))
def test_a_changed_mask_is_taken_up_as_a_new_one(device: Device, size: tuple[int, int], seed: int) -> None:
    rng = np.random.default_rng(seed)
    nx, ny = size
    x, y = np.arange(nx) + 0.5, np.arange(ny)[:, None] + 0.5
    thick, solid = np.zeros((ny, nx)), np.zeros((ny, nx), bool)
    slip, contrast, dt = "free", 1e5, 1.0 / max(size) ** 2
    solver = Viscosity(device, size)
    for _ in range(14):
        near = (x - rng.uniform(0, nx)) ** 2 + (y - rng.uniform(0, ny)) ** 2 < rng.uniform(0.7, 9.0) ** 2
        match rng.choice(["thicken", "thin", "solid", "walls", "step", "same", "contrast"], p=[0.5, *6 * [1 / 12]]):
            case "thicken":
                thick = np.where(near, np.minimum(thick + rng.uniform(0, 1), 1.0), thick)
            case "thin":
                thick = np.where(near, 0.0, thick)
            case "solid":
                solid = solid ^ near
            case "walls":
                slip = "none" if slip == "free" else "free"
            case "step":
                dt *= 1.5
            case "contrast":
                contrast = rng.choice([2.0, 1e2, 1e5])
        fields = device.upload(contrast**thick), device.upload(solid.astype(np.uint8) * np.uint8(255))
        solver.set_coefficients(*fields, dt, Walls(slip))
        fresh = Viscosity(device, size)
        fresh.set_coefficients(*fields, dt, Walls(slip))
        assert solver.plan == fresh.plan
        found, wanted = textures(solver), textures(fresh)
        assert found.keys() == wanted.keys()
        for name in wanted:
            assert found[name].tobytes() == wanted[name].tobytes(), name
        for item in (fresh, *fields):
            item.release()
    solver.release()


def test_the_changed_box_holds_every_cell_that_differs() -> None:
    before = np.zeros((5, 7))
    after = before.copy()
    assert changed(before, after) is None
    after[1, 2] = after[3, 5] = 1.0
    assert changed(before, after) == Box(1, 4, 2, 6)

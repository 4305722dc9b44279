"""What handles are halted by: what the map has done around them, looked at on the GPU, beside the same in NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from solver import Device, Grid, WarpMap
from solver.warp.strain import Strain


def turning(x: np.ndarray, y: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
    """The more slowly the farther from a middle, and not at all at the picture's edges."""
    speed = 6 * np.maximum(1 - ((x - 0.45) ** 2 + (y - 0.4) ** 2) / 0.35**2, 0.0) ** 3
    return -(y - 0.4) * speed, (x - 0.45) * speed


@pytest.mark.parametrize("steps", [3, 12])  # in the submap only, and in all levels
def test_what_is_around_places_is_the_worst_within_their_boxes(steps: int, device: Device):
    grid = Grid(56, 42)  # no power of 2: what is looked up beside the middles of texels is rounded to others
    warp, extent = WarpMap(device, grid, (224, 168)), np.array([1.0, 0.75])
    for _ in range(steps):
        warp.advance_prescribed(turning, 1 / 20)
    places, radii = np.array([[0.4, 0.4], [0.98, 0.7], [0.05, 0.05]]), np.array([0.2, 0.3, 0.05])
    strain = Strain(warp)
    found = strain.around(places, radii)
    strain.release()

    texel, count = extent / warp.size, 2 * np.array(grid.size)
    x, y = (
        np.minimum((np.arange(n) + 0.5) / n * side, side - t) for n, side, t in zip(count, extent, texel, strict=True)
    )
    lattice = np.stack(np.meshgrid(x, y), axis=-1)

    def led(points: np.ndarray) -> np.ndarray:
        flat = points.reshape(-1, 2)
        return (flat + warp.at(flat).astype(np.float64)).reshape(points.shape)

    here = led(lattice)
    right, below, across = (led(lattice + texel * step) for step in ((1, 0), (0, 1), (1, 1)))
    loop = np.stack([here, right, across, below])  # the shoelace formula
    following = np.roll(loop, -1, axis=0)
    areas = (loop[..., 0] * following[..., 1] - loop[..., 1] * following[..., 0]).sum(axis=0) / (2 * texel.prod())
    determinants = warp.determinants(lattice.reshape(-1, 2)).reshape(areas.shape)
    across = np.hypot(*np.moveaxis(np.diff(here, axis=1), -1, 0)) / np.diff(x)
    down = np.hypot(*np.moveaxis(np.diff(here, axis=0), -1, 0)) / np.diff(y)[:, None]
    for (least, most, area, kept), place, radius in zip(found, places, radii, strict=True):
        left, top = np.maximum(np.floor((place - radius) / extent * count), 0).astype(int)
        far, low = np.minimum(np.ceil((place + radius) / extent * count), count).astype(int)
        box = np.s_[top:low, left:far]
        assert least == pytest.approx(determinants[box].min(), abs=2e-3)
        stretch = max(
            across[top:low, max(left - 1, 0) : far - 1].max(), down[max(top - 1, 0) : low - 1, left:far].max()
        )
        assert most == pytest.approx(stretch, rel=5e-3)
        assert area == pytest.approx(areas[box].min(), abs=2e-3)
        assert kept == min(least, area)
    assert found[0, 2] > 0.99  # where it is only turned, though a triangle of texels shrinks to .83
    assert found[0, 1] > 1.2 * found[2, 1]  # they are not all the same


def test_a_fold_between_two_texels_is_told(device: Device):
    """By the area between texels, whatever the lattice between them sees."""
    warp = WarpMap(device, Grid(16, 16), (32, 32))
    displacement = np.zeros((32, 32, 2), np.float32)
    displacement[:, 16, 0] = 1.5 / 32  # its column lies beyond the next
    warp.set(displacement)
    strain = Strain(warp)
    (_, _, crossed, _), (_, _, plain, _) = strain.around(np.array([[0.5, 0.5], [0.1, 0.5]]), np.array([0.1, 0.1]))
    strain.release()
    assert crossed < 0
    assert plain == pytest.approx(1, abs=1e-3)


@pytest.mark.parametrize("is_held", [False, True])
def test_points_are_sought_from_where_they_should_be(is_held: bool, device: Device):
    """As exactly as places are rounded, through all levels of the map, and no farther in a round than is allowed."""
    warp, extent = WarpMap(device, Grid(64, 48), (256, 192)), np.array([1.0, 0.75])
    for _ in range(12):
        warp.advance_prescribed(turning, 1 / 20)
    if is_held:
        warp.hold(device.upload(np.tri(48, 64, dtype=np.float32)))
    places = np.array([[0.4, 0.4], [0.45, 0.5], [0.99, 0.7], [0.62, 0.31]])
    points = places + warp.at(places)
    found, left = warp.seek(points, np.clip(places + 0.01, 0.0, extent), np.full(4, 0.02))
    assert left.max() < 3e-7
    assert np.abs(found + warp.at(found) - points).max() < 3e-7
    found, left = warp.seek(points, places + [[-0.3, 0.0]] * 4, np.full(4, 1e-3))
    assert np.hypot(*(found - places + [0.3, 0.0]).T).max() < 8e-3
    assert left.min() > 0.1
    warp.release()


@pytest.mark.parametrize(
    ("cells", "wanted"), [((96, 48), (192, 96)), ((200, 100), (256, 128)), ((300, 150), (300, 150))]
)
def test_a_map_is_looked_at_in_two_places_a_cell_up_to_256_and_then_in_one(
    cells: tuple[int, int], wanted: tuple[int, int], device: Device
):
    """Along the longer side, and as close to one another along the shorter one."""
    warp = WarpMap(device, Grid(*cells), cells)
    strain, taken = Strain(warp), [0]
    for _ in range(2):  # at first the map's own texels are looked at too
        strain.around(np.array([[0.5, 0.25]]), np.array([1.0]))
        taken.append(sum(device.timings.texel_writes.values()))
    assert 1 <= (taken[2] - taken[1]) / np.prod(wanted) < 1.02  # a little more for what is found
    for thing in (strain, warp):
        thing.release()

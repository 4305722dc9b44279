"""Small passes, each alone, against the same formula in NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import ndimage

from app.model.picture import srgb_to_linear
from solver.brush.tip import Tip
from solver.gl.device import Device
from solver.grid import Grid
from support.reference import PAD, with_images

GRID = Grid(20, 12, (1.0, 0.75))
ENDS = np.array([(0.3, 0.2), (0.6, 0.5)])
TIP = Tip((0.3, 0.2), (0.6, 0.5), 0.25, 0.4)
RNG = np.random.default_rng(8)


def distance(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """From the brush's path."""
    a, along = ENDS[0], ENDS[1] - ENDS[0]
    s = np.clip(((x - a[0]) * along[0] + (y - a[1]) * along[1]) / (along @ along), 0, 1)
    return np.hypot(x - a[0] - s * along[0], y - a[1] - s * along[1])


def weight(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Of the brush: 1 in its hard core, (1 - q^2)^3 from there to its radius."""
    core = 0.9 * 0.4 * 0.25
    q = np.clip((distance(x, y) - core) / (0.25 - core), 0, 1)
    return (1 - q**2) ** 3


def drawn(device: Device, shader: str, components: int, size: tuple[int, int] = GRID.size, **inputs: Any) -> np.ndarray:
    target = device.field(size, components)
    defines = {name: inputs.pop(name) for name in [*inputs] if name.isupper()}
    given: dict[str, Any] = {
        name: device.upload(value) if isinstance(value, np.ndarray) else value for name, value in inputs.items()
    }
    device.pass_(shader, **defines)(target, **given)
    return target.get().astype(np.float64)


def under(device: Device, shader: str, components: int, **inputs: Any) -> np.ndarray:
    """What a shader draws under the brush."""
    target = device.field(GRID.size, components)
    TIP.draw(device.pass_(shader), target, GRID, **inputs)
    return target.get().astype(np.float64)


@pytest.mark.parametrize(
    ("shader", "inputs"), [("expand", {"vectors": [(-2.5, 0.0)]}), ("thicken", {"amount": -2.5})], ids=str
)
def test_what_a_brush_puts_into_cells_falls_off_with_it(device: Device, shader: str, inputs: dict[str, Any]) -> None:
    found = under(device, f"brush/{shader}.frag", 1, **inputs)
    np.testing.assert_allclose(found, -2.5 * weight(*GRID.centres()), atol=1e-5)


def test_a_place_freezes_as_far_as_the_radius_and_its_edge_by_its_part(device: Device) -> None:
    found = under(device, "brush/freeze.frag", 4, towards=1.0, amount=0.5)
    part = np.clip((0.25 - distance(*GRID.centres())) / max(GRID.spacing) + 0.5, 0, 1)
    np.testing.assert_allclose(found[..., 3], 0.5 * part, atol=1e-5)
    assert (found[part > 0, :3] == 1).all()


def test_what_flows_under_a_brush_is_countered_but_at_walls(device: Device) -> None:
    found = under(device, "brush/counter.frag", 2, vectors=[(2.0, -3.0)])
    wanted = np.stack([2 * weight(*GRID.u_faces()), -3 * weight(*GRID.v_faces())], axis=-1)
    wanted[:, 0, 0] = wanted[0, :, 1] = 0
    np.testing.assert_allclose(found, wanted, atol=1e-5)


def test_a_cell_is_under_a_brush_as_far_as_it_is_open(device: Device) -> None:
    solid = RNG.choice([0, 51, 255], (12, 20)).astype(np.uint8)
    found = under(device, "brush/weigh.frag", 1, solid=device.upload(solid))
    np.testing.assert_allclose(found, (1 - solid / 255) * weight(*GRID.centres()), atol=1e-5)


@pytest.mark.parametrize("side", [8, 16])
def test_means_of_a_mask_are_of_64_places_without_those_beyond_it(device: Device, side: int) -> None:
    mask, corner = RNG.random((30, 44)).astype(np.float32), (4, 6)
    found = drawn(device, "brush/coarsen.frag", 1, (3, 2), mask=mask, corner=corner, side=float(side))
    middle = side // 16  # of each place's texels, the one right of and below its middle
    for row, column in np.ndindex(2, 3):
        top, left = corner[1] + row * side, corner[0] + column * side
        block = mask[top : top + side, left : left + side][middle :: side // 8, middle :: side // 8]
        assert found[row, column] == pytest.approx(block.mean() if block.size else np.nan, nan_ok=True)


def test_a_stream_function_s_flow_stands_still_at_the_walls(device: Device) -> None:
    stream = RNG.random((13, 21)).astype(np.float32)
    found = drawn(device, "brush/curl.frag", 2, spacing=GRID.spacing, stream=stream)
    hx, hy = GRID.spacing
    wanted = np.stack([np.diff(stream, axis=0)[:, :-1] / hy, -np.diff(stream, axis=1)[:-1] / hx], axis=-1)
    wanted[:, 0, 0] = wanted[0, :, 1] = 0
    np.testing.assert_allclose(found, wanted, atol=1e-5)


def test_what_flows_under_handles_is_calmed_by_each_of_them(device: Device) -> None:
    velocity = RNG.standard_normal((12, 20, 2)).astype(np.float32)
    handles = np.array([[(0.3, 0.3, 0.2, 1.0), (0.45, 0.4, 0.3, 0.5)]], np.float32)
    found = drawn(device, "brush/calm.frag", 2, spacing=GRID.spacing, handles=handles, velocity=velocity)
    for axis, (x, y) in enumerate((GRID.u_faces(), GRID.v_faces())):
        kept = np.ones(x.shape)
        for at_x, at_y, radius, amount in handles[0]:
            kept *= 1 - amount * np.maximum(1 - ((x - at_x) ** 2 + (y - at_y) ** 2) / radius**2, 0) ** 3
        np.testing.assert_allclose(found[..., axis], (kept - 1) * velocity[..., axis], atol=1e-5)


def test_a_part_of_a_map_takes_its_factors_scaled_and_not_whole(device: Device) -> None:
    whole, scaled, unscaled = RNG.standard_normal((3, 12, 20, 2)).astype(np.float32)
    found = drawn(device, "warp/scale.frag", 2, displacement=whole, amount=0.3)
    np.testing.assert_allclose(found, 0.3 * whole, atol=1e-6)
    given: dict[str, Any] = {"displacement": whole, "scaled": scaled, "unscaled": unscaled}
    given |= {"picture": (2.0, 1.5), "origin": (0.0, 0.0), "step": (1 / 20, 1 / 12)}
    found = drawn(device, "warp/scale.frag", 2, BENT=1, amount=0.3, **given)
    x = (np.stack(np.meshgrid(np.arange(20), np.arange(12)), axis=-1) + 0.5) * (2 / 20, 1.5 / 12)
    led = x + 0.3 * whole + scaled - 0.3 * unscaled
    assert ((led < 0) | (led > (2.0, 1.5))).any(), "some would leave the picture"
    np.testing.assert_allclose(x + found, np.clip(led, 0, (2.0, 1.5)), atol=1e-6)


@pytest.mark.parametrize(
    ("slope", "wanted"),
    [
        (((0.2, 0.0), (0.0, 0.1)), -1.0),  # 1 at nothing, more from there on
        (((-0.5, 0.0), (0.0, -0.5)), -1.0),  # 1/4 at the whole, which is least
        (((-1.0, -1.0), (1.0, -1.0)), -0.5),  # 1 at both ends, 1/2 half-way
        (((-1.5, 0.0), (0.0, -1.5)), 0.0),  # a fold at two thirds, 1/4 at the whole
        (((-2.0, 0.0), (0.0, 0.0)), -1.0),  # that folds itself
    ],
)
def test_how_near_a_part_of_a_factor_comes_to_a_fold(
    device: Device, slope: tuple[tuple[float, float], tuple[float, float]], wanted: float
) -> None:
    """-min det(1 + a M) over a from 0 to 1, of the smaller of 1 and det(1 + M)."""
    x, y = GRID.centres()
    factor = np.stack([row[0] * x + row[1] * y for row in slope], axis=-1).astype(np.float32)
    given = {"displacement": factor, "spacing": GRID.spacing, "side": 8.0}
    found = drawn(device, "warp/steepness.frag", 1, (3, 2), SCALING=1, **given)
    np.testing.assert_allclose(found, wanted, atol=1e-4)


@pytest.mark.parametrize("partial", [False, True])
def test_energy_is_summed_block_by_block(device: Device, partial: bool) -> None:
    u, v, left, up = RNG.standard_normal((4, 5, 7, 4)).astype(np.float32)
    departed = RNG.random((5, 7)).astype(np.float32)
    more = {"PARTIAL": 1, "left": left[:-1, :-1], "up": up[:-1, :-1]} if partial else {}
    inputs = {"u": u, "v": v, "departed": departed, "side": 4.0, **more}
    found = drawn(device, "step/energy.frag", 2, (2, 2), **inputs)
    squares = (u.astype(float) ** 2).sum(-1) + (v.astype(float) ** 2).sum(-1)
    if partial:  # packed faces have a ring around them that the open parts lack; it is clamped to their edge
        rows, columns = np.clip(np.arange(5) - 1, 0, 3), np.clip(np.arange(7) - 1, 0, 5)
        at = np.ix_(rows, columns)
        squares = (left[at] * u.astype(float) ** 2).sum(-1) + (up[at] * v.astype(float) ** 2).sum(-1)
    for row, column in np.ndindex(2, 2):
        block = slice(4 * row, 4 * row + 4), slice(4 * column, 4 * column + 4)
        assert found[row, column] == pytest.approx([squares[block].sum(), departed[block].sum()], rel=1e-5)


def test_the_energy_that_departs_counts_open_faces_by_their_parts(device: Device) -> None:
    """Of 12 x 8 cells. A texel of what is carried has two columns of two rows, of which the next has one again."""
    faces = RNG.standard_normal((2, 14, 17)).astype(np.float32)  # from two columns and rows before the first
    u, v = (np.stack([part[y::2, x : x + 16] for y in (0, 1) for x in (0, 1)], axis=-1) for part in faces)
    left, up = RNG.random((2, 4, 6, 4)).astype(np.float32)
    opened = RNG.integers(0, 4, (6, 8, 4)).astype(np.uint8)  # 1 for u, 2 for v
    targets = device.field((8, 6), 4), device.field((8, 6), 4), device.field((8, 6), 1)
    given = {"blocks_u": u, "blocks_v": v, "left": left, "up": up, "open": opened, "trace": np.zeros((8, 12, 2), "f4")}
    uploaded: dict[str, Any] = {name: device.upload(value) for name, value in given.items()}
    device.pass_("step/advect.frag", PARTIAL=1)(targets, decay=1.0, **uploaded)
    inside, own = opened[1:-1, 1:-1], (slice(1, 5), slice(2, 14, 2))
    wanted = (left * (inside % 2) * u[own] ** 2 + up * (inside // 2) * v[own] ** 2).sum(axis=-1)
    np.testing.assert_allclose(targets[2].get()[1:-1, 1:-1], wanted, rtol=1e-4)
    # What does not move stays, but for what is closed.
    np.testing.assert_allclose(targets[0].get()[1:-1, 1:-1], u[own] * (inside % 2), atol=1e-5)


def test_the_paper_s_divergence_and_pressure_are_central_differences(device: Device) -> None:
    """Beyond an edge the normal velocity is odd, and the pressure even."""
    velocity, pressure, source, wanted = (RNG.standard_normal((12, 20, n)).astype(np.float32) for n in (2, 1, 1, 1))
    found = drawn(device, "paper/divergence.frag", 1, velocity=velocity, source=source, h=0.05)
    u, v, p = (np.pad(part, 1, "symmetric") for part in (velocity[..., 0], velocity[..., 1], pressure[..., 0]))
    u[:, [0, -1]] *= -1
    v[[0, -1]] *= -1
    central = (u[1:-1, 2:] - u[1:-1, :-2] + v[2:, 1:-1] - v[:-2, 1:-1]) / 2
    np.testing.assert_allclose(found, central - 0.05 * source[..., 0], atol=1e-5)
    found = drawn(device, "paper/pressure.frag", 1, pressure=pressure, divergence=wanted, h=0.05)
    around = p[1:-1, 2:] + p[1:-1, :-2] + p[2:, 1:-1] + p[:-2, 1:-1]
    np.testing.assert_allclose(found, (around - 0.05 * wanted[..., 0]) / 4, atol=1e-5)


def test_packed_faces_are_scaled(device: Device) -> None:
    u, v = RNG.standard_normal((2, 5, 7, 4)).astype(np.float32)
    targets = device.field((7, 5), 4), device.field((7, 5), 4)
    device.pass_("step/scale.frag")(targets, u=device.upload(u), v=device.upload(v), factor=0.25)
    for target, given in zip(targets, (u, v), strict=True):
        np.testing.assert_array_equal(target.get(), 0.25 * given)


def test_the_steepest_corner_of_each_block_is_found(device: Device) -> None:
    moved = RNG.standard_normal((12, 20, 2)).astype(np.float32)
    hx, hy = GRID.spacing
    found = drawn(device, "warp/steepness.frag", 1, (3, 2), displacement=moved, spacing=GRID.spacing, side=8.0)
    wide, high = np.diff(moved, axis=1), np.diff(moved, axis=0)
    across, down = (wide[1:] + wide[:-1]) / 2 / hx, (high[:, 1:] + high[:, :-1]) / 2 / hy
    squares = (across.astype(float) ** 2 + down.astype(float) ** 2).sum(axis=-1)
    for row, column in np.ndindex(2, 3):
        block = squares[8 * row : 8 * row + 8, 8 * column : 8 * column + 8]
        assert found[row, column] == pytest.approx(block.max(), rel=1e-5)


def test_through_a_face_flows_as_much_as_the_more_closed_cell_lets(device: Device) -> None:
    velocity, local = RNG.standard_normal((2, 12, 20, 2)).astype(np.float32)
    solid = RNG.choice([0, 51, 255], (12, 20)).astype(np.uint8)
    closed = np.pad(solid / 255, ((1, 0), (1, 0)), "edge")
    opened = 1 - np.stack(
        [np.maximum(closed[1:, 1:], closed[1:, :-1]), np.maximum(closed[1:, 1:], closed[:-1, 1:])], axis=-1
    )
    found = drawn(device, "step/carry.frag", 2, velocity=velocity, solid=solid)
    np.testing.assert_allclose(found, opened * velocity, atol=1e-6)
    found = drawn(device, "step/carry.frag", 2, LOCAL=1, velocity=velocity, local=local, solid=solid)
    np.testing.assert_allclose(found, velocity + opened * local, atol=1e-6)


def test_solid_cells_are_widened_by_two(device: Device) -> None:
    frozen = (RNG.random((12, 20)) < 0.03).astype(np.uint8)
    found = drawn(device, "step/widen_solid.frag", 1, frozen=frozen)
    np.testing.assert_array_equal(found, ndimage.maximum_filter(frozen, 5, mode="nearest"))


@pytest.mark.parametrize("premultiplied", [False, True])
@pytest.mark.parametrize("light", [False, True])
def test_a_picture_is_looked_up_times_its_alpha_and_in_light(device: Device, premultiplied: bool, light: bool) -> None:
    picture = RNG.random((12, 20, 4)).astype(np.float32)
    if premultiplied:
        picture[..., :3] *= picture[..., 3:]
    defines: dict[str, Any] = {"PREMULTIPLIED": 1} if premultiplied else {}
    defines |= {"LINEAR_LIGHT": 1} if light else {}
    found = drawn(device, "resample/prepare.frag", 4, picture=picture, **defines)
    alpha = picture[..., 3:]
    straight = picture[..., :3] / alpha if premultiplied else picture[..., :3]
    wanted = (srgb_to_linear(straight) if light else straight) * alpha
    np.testing.assert_allclose(found, np.concatenate([wanted, alpha], axis=-1), atol=1e-5)


def test_faces_are_unpacked_two_by_two(device: Device) -> None:
    u, v = RNG.standard_normal((2, 8, 12, 4)).astype(np.float32)
    found = drawn(device, "viscosity/unpack.frag", 2, u=u, v=v)
    for axis, packed in enumerate((u, v)):
        inside = packed[1:-1, 1:-1].reshape(6, 10, 2, 2)  # within the ring
        np.testing.assert_array_equal(found[..., axis], inside.swapaxes(1, 2).reshape(12, 20))


@pytest.mark.parametrize(("images", "held"), [((1.0, -1.0, -1.0, 1.0), False), ((0.0,) * 4, False), ((1.0,) * 4, True)])
def test_where_the_cells_around_a_texel_disagree_on_its_area_is_found(
    images: tuple[float, float, float, float], held: bool, device: Device
) -> None:
    """Each cell by the cubic through its own texels; not in blocks that are not steep, nor next to what is held."""
    spacing, moved = GRID.spacing, 0.01 * RNG.standard_normal((12, 20, 2)).astype(np.float32)
    beyond = with_images(moved, images).astype(float)
    middle = slice(PAD, -PAD), slice(PAD, -PAD)
    slopes = []
    for axis, h in ((1, spacing[0]), (0, spacing[1])):
        for first in (-1, -2):  # the cell after the texel, and that before it
            fit = np.array([np.polyder(np.poly1d(np.polyfit(range(first, first + 4), one, 3)))(0) for one in np.eye(4)])
            parts = [fit[k] * np.roll(beyond, -(first + k), axis) for k in range(4)]
            slopes.append(np.sum(parts, axis=0)[middle] / h)
    dets = [(1 + a[..., 0]) * (1 + b[..., 1]) - a[..., 1] * b[..., 0] for a in slopes[:2] for b in slopes[2:]]
    least, greatest = np.min(dets, axis=0), np.max(dets, axis=0)
    uneven = np.where(greatest > 0, -least / np.where(greatest > 0, greatest, 1), 1)
    more: dict[str, Any] = {}
    if not any(images):
        uneven[:2] = uneven[-2:] = uneven[:, :2] = uneven[:, -2:] = -1
    if held:
        far = np.abs(np.arange(12) - 3)[:, None] + np.abs(np.arange(20) - 10)  # along the axes, from one held texel
        more = {"HELD": 1, "held": np.where(far == 0, 1, (127 - far) / 255).astype(np.float32)}
        uneven[far <= 1] = -1
    steepness = np.array([[2.0, 2.0, 2.0], [2.0, 0.9, 2.0]], np.float32)
    given = {
        "displacement": moved,
        "steepness": steepness,
        "spacing": spacing,
        "images": images,
        "side": 8.0,
        "flat": 1.0,
        **more,
    }
    found = drawn(device, "warp/evenness.frag", 1, (3, 2), **given)
    for row, column in np.ndindex(2, 3):
        block = uneven[8 * row : 8 * row + 8, 8 * column : 8 * column + 8]
        wanted = -1.0 if (row, column) == (1, 1) else block.max()
        assert found[row, column] == pytest.approx(wanted, rel=1e-4, abs=1e-4)
    assert np.unique(found).size > 3

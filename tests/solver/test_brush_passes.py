"""Passes of brushes that look at the fluid, the map and the masks, each alone, against the same formula in NumPy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from solver.brush.tip import Path, Tip
from solver.gl.device import Device
from solver.gl.images import for_images
from solver.grid import Grid
from support.reference import padded_faces, velocity_at

GRID = Grid(21, 13, (1.0, 0.7))  # of cells that are no squares
HX, HY = GRID.spacing
RNG = np.random.default_rng(14)
VELOCITY, IMPULSE = RNG.standard_normal((2, 13, 21, 2)).astype(np.float32)
VISCOSITY = np.exp(RNG.uniform(-1.0, -0.9, (13, 21))).astype(np.float32)
VISCOSITY[:5, :9] *= 2
SOLID = (RNG.random((13, 21)) < 0.08).astype(np.uint8) * np.uint8(255)
# In the middle, along an edge, and near two corners.
TIP = Tip((0.3, 0.2), (0.52, 0.31), 0.21, 0.4, others=(
    Path((0.6, 0.66), (0.7, 0.68)), Path((0.95, 0.1), (0.97, 0.03)), Path((0.1, 0.66), (0.015, 0.68)),
))  # fmt: skip
ENDS = [path[1] for path in TIP.paths]
COUNT = len(ENDS)


def uploaded(device: Device, inputs: dict[str, Any]) -> dict[str, Any]:
    """The arrays among them as fields."""
    return {name: device.upload(value) if isinstance(value, np.ndarray) else value for name, value in inputs.items()}


def drawn(device: Device, shader: str, components: int, size: tuple[int, int], **inputs: Any) -> np.ndarray:
    target = device.field(size, components)
    device.pass_(shader)(target, **uploaded(device, inputs))
    return target.get().astype(np.float64)


def fluid_at(x: float | np.ndarray, y: float | np.ndarray) -> np.ndarray:
    """The velocity with what is added to it, at a place in cells, (..., 2)."""
    x, y = np.asarray(x, float), np.asarray(y, float)
    found = [np.stack(velocity_at(padded_faces(each), x, y), axis=-1) for each in (VELOCITY, IMPULSE)]
    return np.add(*found)


def between(cells: np.ndarray, x: float, y: float) -> tuple[np.ndarray, float, float]:
    """The four cells (2, 2) that a place in cells lies between, and its part of the way across and down."""
    ny, nx = cells.shape
    x, y = np.clip(x - 0.5, 0, nx - 1), np.clip(y - 0.5, 0, ny - 1)
    column, row = int(x), int(y)
    columns, rows = [column, min(column + 1, nx - 1)], [row, min(row + 1, ny - 1)]
    return cells[np.ix_(rows, columns)].astype(float), x - column, y - row


def viscosity_at(x: float, y: float) -> float:
    """Harmonic, first across."""
    four, across, down = between(VISCOSITY, x, y)
    rows = 1 / ((1 - across) / four[:, 0] + across / four[:, 1])
    return 1 / ((1 - down) / rows[0] + down / rows[1])


def part_at(place: tuple[float, float], radius: float) -> float:
    """What a brush may do: nothing with a quarter of it on cells that are solid, or thicker than at its tip."""
    tip = viscosity_at(place[0] / HX, place[1] / HY)
    crowded = []
    for angle in 2 * np.pi * np.arange(8) / 8:
        for far in radius * np.array([1, 2, 3]) / 3:
            x, y = (place[0] + far * np.cos(angle)) / HX, (place[1] + far * np.sin(angle)) / HY
            thick, across, down = between(VISCOSITY, x, y)
            solid = between(SOLID, x, y)[0]
            spared = np.maximum(solid > 127, 1 - tip / np.maximum(thick, tip))
            crowded.append(np.array([1 - down, down]) @ spared @ np.array([1 - across, across]))
    s = min(float(np.mean(crowded)) / 0.25, 1.0)
    return 1 - s * s * (3 - 2 * s)


def flow(x: np.ndarray, y: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Of a soft push, r radii beside it: the curl of b(r) (F x r), by differences of that; (..., 2)."""

    def stream(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.maximum(1 - x * x - y * y, 0) ** 3 * (direction[0] * y - direction[1] * x)

    d = 1e-5
    return np.stack([stream(x, y + d) - stream(x, y - d), stream(x - d, y) - stream(x + d, y)], axis=-1) / (2 * d)


def test_what_a_brush_finds_where_it_ends_and_where_it_begins(device: Device) -> None:
    ends = [(a[0] / HX, a[1] / HY, b[0] / HX, b[1] / HY) for a, b, _ in TIP.paths]
    reach = (0.3, 0.4)
    found = drawn(
        device, "brush/probe.frag", 4, (COUNT, 2), velocity=VELOCITY, impulse=IMPULSE, viscosity=VISCOSITY,
        ends=for_images(ends), reach=reach, spacing=GRID.spacing,
    )  # fmt: skip
    for row, image in np.ndindex(2, COUNT):
        x, y = ends[image][2:] if row == 0 else ends[image][:2]
        turn = (fluid_at(x + reach[0], y)[1] - fluid_at(x - reach[0], y)[1]) / (2 * reach[0] * HX)
        turn -= (fluid_at(x, y + reach[1])[0] - fluid_at(x, y - reach[1])[0]) / (2 * reach[1] * HY)
        wanted = [*fluid_at(x, y), turn / 2, viscosity_at(x, y)]
        np.testing.assert_allclose(found[row, image], wanted, rtol=1e-4, atol=2e-4)


def test_what_handles_find_where_they_are(device: Device) -> None:
    handles = np.array([[(*end, radius, 0) for end in ENDS] for radius in (0.05, 0.21, 0.6)], np.float32)
    found = drawn(
        device, "brush/probe_handles.frag", 4, (COUNT, 3), handles=handles, velocity=VELOCITY, impulse=IMPULSE,
        viscosity=VISCOSITY, solid=SOLID, spacing=GRID.spacing,
    )  # fmt: skip
    for row, image in np.ndindex(3, COUNT):
        x, y, radius, _ = handles[row, image].tolist()
        wanted = [*fluid_at(x / HX, y / HY), part_at((x, y), radius), viscosity_at(x / HX, y / HY)]
        np.testing.assert_allclose(found[row, image], wanted, rtol=1e-3, atol=1e-3)
    assert ((found[..., 2] > 0) & (found[..., 2] < 1)).any()


@pytest.mark.parametrize("radius", [0.02, 0.08, 0.21])
def test_a_brush_may_do_less_the_more_of_it_lies_on_what_is_closed_or_thick(device: Device, radius: float) -> None:
    motion = np.zeros((2, COUNT, 4), np.float32)
    motion[0, :, 3] = [viscosity_at(x / HX, y / HY) for x, y in ENDS]
    shape = Tip(TIP.start, TIP.end, radius, others=TIP.others).shape(GRID)
    found = drawn(
        device, "brush/obstruct.frag", 1, (COUNT, 1), motion=motion, viscosity=VISCOSITY, solid=SOLID, **shape
    )  # fmt: skip
    np.testing.assert_allclose(found[0], [part_at(end, radius) for end in ENDS], atol=1e-3)


@pytest.mark.parametrize("most", [0.05, 0.3, 1.0, 2.0, 3.0, 5.0, 8.0, 50.0])
def test_a_push_leaves_no_more_energy_under_it_than_its_own_flow_has_so_many_times(device: Device, most: float) -> None:
    """Or than there was: a push that brakes a faster fluid is allowed. Summed over a lattice within the radius."""
    rng = np.random.default_rng(3)
    motion = np.concatenate([rng.standard_normal((1, COUNT, 2)), np.zeros((1, COUNT, 2))], axis=-1).astype(np.float32)
    slip = rng.random((2, COUNT)).astype(np.float32)
    velocities = rng.standard_normal((COUNT, 2)) * [[3.0], [0.3], [1.0], [2.0]]
    found = drawn(
        device, "brush/restrain.frag", 1, (COUNT, 1), velocity=VELOCITY, impulse=IMPULSE, motion=motion, slip=slip,
        row=1.0, velocities=for_images([tuple(each) for each in velocities.tolist()]), strength=0.7, most=most,
        **TIP.shape(GRID) | {"hardness": 0.0},
    )  # fmt: skip
    lattice = np.mgrid[-4:5, -4:5] / 4
    for image, (x, y) in enumerate(ENDS):
        lacking = 0.7 * (slip[1, image] * velocities[image] - motion[0, image, :2])
        px, py = (x + lattice[1] * TIP.radius) / HX, (y + lattice[0] * TIP.radius) / HY
        inside = ((lattice**2).sum(axis=0) < 1) & (px >= 0) & (py >= 0) & (px <= 21) & (py <= 13)
        there = fluid_at(px[inside], py[inside])
        own = flow(lattice[1][inside], lattice[0][inside], lacking)
        allowed = max(
            (there**2).sum(), most * (velocities[image] ** 2).sum() * (own**2).sum() / max(lacking @ lacking, 1e-20)
        )
        parts = np.linspace(0, 1, 4001)
        energy = ((there[None] + parts[:, None, None] * own[None]) ** 2).sum(axis=(1, 2))
        may = np.flatnonzero(energy <= allowed * (1 + 1e-9))
        assert found[0, image] == pytest.approx(parts[may.max()], abs=1e-3)


@pytest.mark.parametrize("hold", [0.0, 0.4, 1.0])
def test_a_push_slips_by_how_far_it_has_carried_and_by_what_it_would_stretch_more(device: Device, hold: float) -> None:
    """By the growth of C = J^T J under its own flow, in the mean over the brush of its fourth power."""
    fine, side = 8, 19
    x, y = np.meshgrid((np.arange(side) - 9) / fine, (np.arange(side) - 9) / fine)
    waves = [(0.0, 0.0), (0.15, -0.4), (0.5, 0.3), (-0.3, 0.2)]
    moved = []
    for image, carried in enumerate(waves):  # in radii
        bent = np.stack([0.3 * np.sin(2 * y + image), 0.3 * np.cos(1.5 * x - image)], axis=-1)
        bent += np.array([-1.5 * carried[0], 1.5 * carried[1]]) - bent[9, 9]
        moved.append(bent)
    around = (np.concatenate(moved) * TIP.radius).astype(np.float32)
    velocities = [(1.0, 0.2), (-0.5, 1.0), (0.0, -2.0), (0.0, 0.0)]
    limits, path = (0.2, 1.6), (0.25, 0.3)
    found = drawn(
        device, "brush/slip.frag", 1, (COUNT, 1), around=around, velocities=for_images(velocities), radius=TIP.radius,
        carried=path, hold=hold, strain=limits, places=for_images(ENDS), extent=GRID.extent,
    )  # fmt: skip

    def soft(low: float, high: float, value: float) -> float:
        s = np.clip((value - low) / (high - low), 0, 1)
        return s * s * (3 - 2 * s)

    for image, velocity in enumerate(velocities):
        speed = np.hypot(*velocity)
        if speed == 0:
            assert found[0, image] == 1
            continue
        direction = np.array(velocity) / speed
        back = moved[image][9, 9]
        far = np.hypot(*back)
        beyond = max(far * (1 - soft(0, 1, float(back @ direction) / far)) - path[0], 0) if far else 0.0
        by_path = 1 / (1 + 2 * beyond**2) * (1 - path[1]) + path[1]
        fourth = []
        for row, column in np.ndindex(side - 2, side - 2):
            here = np.array([x[row + 1, column + 1], y[row + 1, column + 1]])
            place = np.array(ENDS[image]) + here * TIP.radius
            if here @ here >= 1 or not ((place > 0) & (place < GRID.extent)).all():
                continue
            slopes = [np.zeros((2, 2)), np.zeros((2, 2))]  # of the map and of the flow, a column a direction
            for axis, step in enumerate(((1, 0), (0, 1))):
                one, other = (moved[image][row + 1 + sign * step[1], column + 1 + sign * step[0]] for sign in (1, -1))
                slopes[0][:, axis] = (one - other) * fine / 2
                ends = here[None] + np.outer([1, -1], step) / fine
                flows = flow(ends[:, 0], ends[:, 1], direction)
                slopes[1][:, axis] = (flows[0] - flows[1]) * fine / 2
            jacobian = np.eye(2) + slopes[0]
            stretched = jacobian.T @ jacobian
            change = -(slopes[1].T @ stretched + stretched @ slopes[1])
            fourth.append((np.sqrt(np.trace(stretched) / 2) * max(np.trace(change) / np.trace(stretched), 0)) ** 4)
        by_strain = 1 - soft(*limits, float(np.mean(fourth)) ** 0.25 if fourth else 0.0)
        wanted = hold + (1 - hold) * by_path * by_strain
        assert found[0, image] == pytest.approx(wanted, abs=2e-3)


# -- drawn under brushes, with images that overlap --------------------------------------------------------------------

CLOSE = Tip((0.3, 0.2), (0.52, 0.31), 0.21, 0.4, others=(Path((0.5, 0.2), (0.6, 0.35)), Path((0.8, 0.6), (0.9, 0.69))))
MOTION = RNG.standard_normal((2, 3, 4)).astype(np.float32)
SLIP, SCALING = RNG.random((2, 3)).astype(np.float32), RNG.random((1, 3)).astype(np.float32)
VECTORS = [(2.0, -1.0), (-0.5, 0.7), (1.0, 3.0)]


def weight_of(far: np.ndarray, tip: Tip = CLOSE) -> np.ndarray:
    core = 0.9 * tip.hardness * tip.radius
    return (1 - np.clip((far - core) / (tip.radius - core), 0, 1) ** 2) ** 3


def nearest(number: int, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The places of an image's path that are nearest, (..., 2)."""
    start, end, _ = CLOSE.paths[number]
    along = np.subtract(end, start)
    s = np.clip(((x - start[0]) * along[0] + (y - start[1]) * along[1]) / (along @ along), 0, 1)
    return np.array(start) + s[..., None] * along


def share_of(number: int) -> float:
    """One over the sum of the weights of all images where one ends."""
    (x, y) = CLOSE.paths[number].end
    ways = (nearest(k, np.array(x), np.array(y)) - (x, y) for k in range(3) if k != number)
    return 1 / (1 + sum(float(weight_of(np.hypot(*way))) for way in ways))


def under(device: Device, shader: str, vectors: list[tuple[float, float]], **inputs: Any) -> np.ndarray:
    target = device.field(GRID.size, 2)
    CLOSE.draw(device.pass_(shader), target, GRID, vectors, blend="add", **uploaded(device, inputs))
    return target.get().astype(np.float64)


def on_faces(total: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> np.ndarray:
    """What a function of places gives along each face, but at the left and the upper edge."""
    found = np.stack([total(*faces)[..., axis] for axis, faces in enumerate((GRID.u_faces(), GRID.v_faces()))], -1)
    found[:, 0, 0] = found[0, :, 1] = 0
    return found


def test_what_twirls_turns_what_does_not_turn_so_fast(device: Device) -> None:
    wanted_rates = [(3.0, 0.0), (-2.0, 0.0), (0.5, 0.0)]
    motion = MOTION.copy()
    motion[0, :, 2] = 1.0, -0.5, 2.0  # the last turns faster than it is wanted to, and is left

    def total(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        sum_ = np.zeros((*x.shape, 2))
        for number, (rate, _) in enumerate(wanted_rates):
            lacks = rate - motion[0, number, 2]
            lacks = max(lacks, 0) if rate > 0 else min(lacks, 0)
            way = np.stack([x, y], axis=-1) - CLOSE.paths[number].end
            turned = np.stack([-way[..., 1], way[..., 0]], axis=-1)
            far = np.hypot(*np.moveaxis(way, -1, 0))
            sum_ += 1.2 * share_of(number) * lacks * weight_of(far)[..., None] * turned
        return sum_

    found = under(device, "brush/twirl.frag", wanted_rates, motion=motion, gain=1.2)
    np.testing.assert_allclose(found, on_faces(total), atol=1e-4)
    assert share_of(0) < 0.9


@pytest.mark.parametrize("hold", [0.0, 0.6])
def test_a_push_is_the_curl_of_its_stream_function(device: Device, hold: float) -> None:
    """At the nodes, each around the point of the path that is nearest; what the fluid lacks where the path begins."""
    x, y = np.meshgrid(np.arange(22) * HX, np.arange(14) * HY)
    stream = np.zeros(x.shape)
    for number, (start, end, _) in enumerate(CLOSE.paths):
        part = 1.1 * SCALING[0, number] * 0.8 * share_of(number)
        force = part * (SLIP[1, number] * np.array(VECTORS[number]) - MOTION[0, number, :2])
        more = part * hold * (MOTION[0, number, :2] - MOTION[1, number, :2])
        at = nearest(number, x, y)
        within = min(np.hypot(*np.subtract(end, start)), CLOSE.radius)
        s = np.clip(np.hypot(*np.moveaxis(at - start, -1, 0)) / within, 0, 1)
        forces = force + (1 - s * s * (3 - 2 * s))[..., None] * more
        way = np.stack([x, y], axis=-1) - at
        far = np.hypot(*np.moveaxis(way, -1, 0))
        stream += weight_of(far) * (forces[..., 0] * way[..., 1] - forces[..., 1] * way[..., 0])
    wanted = np.stack([np.diff(stream, axis=0)[:, :-1] / HY, -np.diff(stream, axis=1)[:-1] / HX], axis=-1)
    wanted[:, 0, 0] = wanted[0, :, 1] = 0
    found = under(
        device, "brush/push.frag", VECTORS, motion=MOTION, slip=SLIP, row=1.0, scaling=SCALING, strength=0.8, gain=1.1,
        hold=hold,
    )  # fmt: skip
    np.testing.assert_allclose(found, wanted, atol=2e-4)


@pytest.mark.parametrize("solids", [False, True])
def test_what_is_local_is_carried_less_where_it_is_thicker_or_beside_what_is_closed(
    device: Device, solids: bool
) -> None:
    """And less by its image beyond each wall, where that is near."""
    motion = MOTION.copy()
    motion[0, :, 3] = 0.01, 0.1, 2.0
    distance = RNG.uniform(0, 0.4, (13, 21)).astype(np.float32)
    before = {axis: np.pad(VISCOSITY, ((0, 0), (1, 0)) if axis == 0 else ((1, 0), (0, 0)), "edge") for axis in (0, 1)}
    far_before = {
        axis: np.pad(distance, ((0, 0), (1, 0)) if axis == 0 else ((1, 0), (0, 0)), "edge") for axis in (0, 1)
    }
    wanted = np.zeros((13, 21, 2))
    for axis, (x, y) in enumerate((GRID.u_faces(), GRID.v_faces())):
        thickest = np.maximum(VISCOSITY, before[axis][:13, :21])
        beside = np.clip((distance + far_before[axis][:13, :21]) / 2 / CLOSE.radius, 0, 1)
        for number in range(3):
            weight = np.zeros(x.shape)
            images = [(x, y, 1), *((side, y, -1) if axis == 0 else (x, side, -1) for side in (
                (-x, 2 * GRID.extent[0] - x) if axis == 0 else (-y, 2 * GRID.extent[1] - y)
            ))]  # fmt: skip
            for at_x, at_y, sign in images:
                way = np.stack([at_x, at_y], axis=-1) - nearest(number, at_x, at_y)
                weight += sign * weight_of(np.hypot(*np.moveaxis(way, -1, 0)))
            weight = np.maximum(weight, 0) * np.minimum(motion[0, number, 3] / thickest, 1)
            if solids:
                weight = weight * beside**2 * (3 - 2 * beside)
            wanted[..., axis] += SLIP[1, number] * share_of(number) * weight * VECTORS[number][axis]
    wanted[:, 0, 0] = wanted[0, :, 1] = 0
    target = device.field(GRID.size, 2)
    given: dict[str, Any] = {"motion": motion, "slip": SLIP, "viscosity": VISCOSITY}
    given |= {"distance": distance} if solids else {}
    pass_ = device.pass_("brush/carry.frag", **({"SOLIDS": 1} if solids else {}))
    CLOSE.draw(pass_, target, GRID, VECTORS, blend="add", row=1.0, **uploaded(device, given))
    np.testing.assert_allclose(target.get(), wanted, atol=2e-4)

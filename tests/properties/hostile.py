"""Input up to the limits of what is accepted, which nobody would simulate; and any call with any argument."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any, cast

import numpy as np

from solver.brush.brush import Brush
from solver.brush.push import Push
from solver.brush.tip import Tip
from solver.brush.twirl import Twirl
from solver.fluid import Fluid
from solver.gl.device import Device
from solver.grid import LARGEST_ASPECT, Grid
from solver.limits import LARGEST_SPEED, LARGEST_VISCOSITY, LONGEST_STEP
from solver.params import FluidParams, Walls
from solver.warp.map import WarpMap

Rng = np.random.Generator
LEAST_ENERGY = 1e-24  # of a flow at 1e-12 longer sides / s; float32 does not hold the squares of much slower ones


def decades(rng: Rng, least: float, most: float, size: tuple[int, ...] = ()) -> np.ndarray:
    """Numbers of any size between two, each of its own or all of one; now and then all 0 or the largest."""
    end = rng.random()
    exponents = np.full(size, rng.uniform(np.log10(least), np.log10(most)))
    if rng.random() < 0.5:
        exponents = rng.uniform(np.log10(least), np.log10(most), size)
    return np.minimum(10.0**exponents, most) if end < 0.8 else np.full(size, 0.0 if end < 0.9 else most)


def of_either_sign(rng: Rng, numbers: np.ndarray) -> np.ndarray:
    return numbers * rng.choice([-1, 1], numbers.shape)


def one_of(rng: Rng, *choices: Any) -> Any:
    return choices[rng.integers(len(choices))]


def random_grid(rng: Rng) -> Grid:
    """Cells of any aspect over a picture, or over a window of it however small."""
    nx, ny = (round(10 ** rng.uniform(np.log10(8), np.log10(60))) for _ in "xy")
    if rng.random() < 0.4:
        return Grid(nx, ny)
    aspect = 10 ** (rng.uniform(-1, 1) * np.log10(0.9 * LARGEST_ASPECT))
    width, height = np.array([nx * aspect, ny]) / max(nx * aspect, ny)
    if rng.random() < 0.5:
        return Grid(nx, ny, (width, height))
    part = 10 ** rng.uniform(-4, 0)
    left, top = (1 - part) * rng.random(2)
    return Grid(nx, ny, (part * width, part * height), (left * width, top * height), (width, height))


def whole_map(device: Device, grid: Grid) -> WarpMap:
    """A map made on coarse cells of the whole picture, as those of a small window may be too many for a texture."""
    width, height = (round(2.0**40 * side) for side in grid.picture)
    warp = WarpMap(device, Grid(*Grid.for_picture(width, height, 16).size, grid.picture))
    warp.move_to(grid)
    return warp


def random_solid(rng: Rng, grid: Grid) -> np.ndarray:
    """How far each cell is closed, 0-255: none, all, at random, chequered, rows with gaps, or each by some part."""
    shape, (y, x) = (grid.ny, grid.nx), np.mgrid[: grid.ny, : grid.nx]
    masks = (
        np.zeros(shape),
        np.ones(shape),
        rng.random(shape) < rng.random(),
        (x + y) % 2,
        (y % 2) * (rng.random(shape) < 0.9),
        rng.random(shape) ** 4,
    )
    return np.round(255 * masks[rng.choice(6, p=(0.4, 0.04, 0.2, 0.06, 0.15, 0.15))]).astype(np.uint8)


def check_the_ends_of_what_is_accepted(device: Device, seed: int, steps: int = 8) -> dict[str, float]:
    """All that is not refused in a sentence gives finite numbers; unforced, no energy; and a map within the picture."""
    rng = np.random.default_rng(seed)
    grid = random_grid(rng)
    cells, faces = (grid.ny, grid.nx), (grid.ny, grid.nx, 2)
    moving = rng.random() < 0.2
    speeds = of_either_sign(rng, decades(rng, 1e-6, LARGEST_SPEED, (4,))) if moving else np.zeros(4)
    walls = Walls(one_of(rng, "free", "none"), cast(Any, tuple(speeds)), tuple(rng.random(4) < 0.3))
    fluid, brush, warp = Fluid(device, grid, FluidParams(walls)), Brush(device), whole_map(device, grid)
    refused, growth, is_steady = 0, 0.0, False
    try:
        for _ in range(steps):
            if rng.random() < 0.4:
                fluid.set_viscosity(decades(rng, 1e-20, LARGEST_VISCOSITY, cells))
            if rng.random() < 0.4:
                fluid.solid.set(random_solid(rng, grid))
                fluid.masks_changed()
                is_steady = False
            if rng.random() < 0.3:
                fluid.set_velocity(of_either_sign(rng, decades(rng, 1e-30, LARGEST_SPEED, faces)))
                fluid.params = FluidParams(walls)
                fluid.project()
                is_steady = True
            if rng.random() < 0.3:
                fluid.params = FluidParams(walls, float(decades(rng, 1e-9, LARGEST_SPEED)), one_of(rng, None, 1, 3))
            dt = float(decades(rng, 1e-12, LONGEST_STEP))
            before, is_forced, forces = energy(fluid), any(walls.driving_speed), []
            try:
                if rng.random() < 0.3:
                    forces = [decades(rng, 1e-9, 1e9, faces) * rng.choice([-1, 1])]
                    is_forced = True
                if dt > 0 and rng.random() < 0.4:
                    is_forced = True
                    _brush(rng, brush, fluid, warp, dt)
                fluid.step(dt, forces)
                warp.follow(fluid, dt)
            except ValueError as error:
                _check_sentence(error)
                refused += 1
                for added in (fluid.impulse, fluid.source, fluid.local):
                    added.clear()
            is_steady = is_steady and fluid.params.pressure_cycles is None
            if is_steady and not is_forced and before > LEAST_ENERGY:
                growth = max(growth, energy(fluid) / before)
            places = _look(fluid, warp)
            assert (places > -1e-5).all()
            assert (places < np.array(warp.extent) + 1e-5).all()
    finally:
        for item in (fluid, warp, brush):
            item.release()
    assert growth <= 1.001, growth
    return {"refused": refused, "growth": growth}


def random_array(rng: Rng, shape: tuple[int, ...]) -> np.ndarray:
    """Numbers of any size, sign and type; often of another shape, or with one that is not finite."""
    if rng.random() < 0.2:
        shape = one_of(rng, (), (0,), shape[:1], shape[::-1], (*shape, 1), (3, *shape[1:]))
    array = of_either_sign(rng, decades(rng, 1e-30, 1e30 if rng.random() < 0.3 else 1e5, shape))
    if rng.random() < 0.2 and array.size:
        array.flat[rng.integers(array.size)] = one_of(rng, np.nan, np.inf, -np.inf, 1e308)
    kind = one_of(rng, "f4", "f2", ">f8", "i4", "?", "c8", "O") if rng.random() < 0.4 else "f8"
    with warnings.catch_warnings():  # of what these cannot hold
        warnings.simplefilter("ignore")
        return array.astype(kind)


def random_number(rng: Rng) -> float:
    return float(rng.choice([0.0, -1.0, np.nan, np.inf, -np.inf, 1e300, 1e-300, *decades(rng, 1e-12, 1e6, (9,))]))


def check_calls_in_any_order(device: Device, seed: int, calls: int = 40) -> dict[str, float]:
    """Any call with any argument is done, and everything stays finite, or it is refused in a sentence."""
    rng = np.random.default_rng(seed)
    grid = random_grid(rng)
    cells, faces = (grid.ny, grid.nx), (grid.ny, grid.nx, 2)
    fluid, brush, warp = Fluid(device, grid), Brush(device), whole_map(device, grid)

    def number() -> float:
        return random_number(rng)

    def array(shape: tuple[int, ...]) -> np.ndarray:
        return random_array(rng, shape)

    def vector() -> Any:
        return one_of(rng, array(faces), array(faces), lambda x, y, t: (array(x.shape), array(x.shape)))

    def tip() -> Tip:
        return Tip((number(), 0.5), tuple(rng.random(2)), abs(number()), number(), bool(rng.random() < 0.3))

    def put_back() -> None:
        before, state = fluid.faces().get(), fluid.save()
        try:
            fluid.set_velocity(np.zeros(faces))
            fluid.restore(state)
            assert np.array_equal(fluid.faces().get(), before)
        finally:
            state.release()

    def flow_on() -> None:
        flow = fluid.flow_on(grid)
        try:
            fluid.go_on_with(flow)
        finally:
            flow.release()

    def set_params() -> None:
        walls = Walls(one_of(rng, "free", "none"), (number(), number(), number(), number()))
        fluid.params = FluidParams(walls, number(), one_of(rng, None, 0, 1, 3))

    acts: tuple[Callable[[], object], ...] = (
        lambda: fluid.step(number(), one_of(rng, (), vector())),
        lambda: fluid.step(number(), [(device.upload(array(faces)), number())]),
        lambda: fluid.step(0.1, steer=lambda velocity: brush.make_up(fluid, Push(tip(), number()), velocity, warp)),
        lambda: fluid.add_force(vector(), number()),
        lambda: fluid.advect(number()),
        lambda: fluid.diffuse(number()),
        lambda: fluid.trace(number()),
        fluid.project,
        fluid.clear_velocity,
        lambda: fluid.set_velocity(vector()),
        lambda: fluid.set_viscosity(one_of(rng, array(cells), number())),
        lambda: (fluid.viscosity.set(array(cells)), fluid.masks_changed()),
        lambda: fluid.set_solid(array(cells)),
        lambda: (fluid.solid.set(random_solid(rng, grid)), fluid.masks_changed()),
        lambda: fluid.add_source(device.upload(array(cells)), number()),
        lambda: fluid.add_local(device.upload(array(faces)), number()),
        lambda: brush.lead(fluid, Push(tip(), number(), number()), number(), warp),
        lambda: brush.lead(fluid, Twirl(tip(), number())),
        lambda: brush.expand(fluid, tip(), number()),
        lambda: warp.follow(fluid, number()),
        lambda: warp.advance_prescribed(vector(), number(), number()),
        lambda: warp.set(array((8, 9, 2))),
        lambda: warp.restore_under((number(), number()), number(), number(), number()),
        lambda: warp.hold(one_of(rng, fluid.solid, None)),
        warp.remap,
        set_params,
        put_back,
        flow_on,
        lambda: fluid.lay_on(grid),
    )
    refused = 0
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            for _ in range(calls):
                try:
                    one_of(rng, *acts)()
                except (ValueError, TypeError) as error:
                    _check_sentence(error)
                    refused += 1
                _look(fluid, warp)
    finally:
        for item in (fluid, warp, brush):
            item.release()
    return {"refused": refused}


def energy(fluid: Fluid) -> float:
    """|w|^2 + 2 |g|^2, each face times its open part: the sum of (S6)."""
    closed = fluid.closed.astype(float) / 255
    open_part = np.stack([1 - np.maximum(closed, np.roll(closed, 1, axis)) for axis in (1, 0)], axis=-1)
    state = fluid.save()
    arrays = state.arrays()
    state.release()
    w, g = (float((open_part * arrays[name].astype(float) ** 2).sum()) for name in ("velocity", "carried"))
    return w + 2 * g


def _brush(rng: Rng, brush: Brush, fluid: Fluid, warp: WarpMap, dt: float) -> None:
    ends = (rng.uniform(-0.2, 1.2, 2) if rng.random() < 0.8 else rng.uniform(-100, 100, 2) for _ in "ab")
    (a, b), radius = map(tuple, ends), float(10 ** rng.uniform(-6, 2))
    tip = Tip(a, b, radius, rng.uniform(-1, 2), near=bool(rng.random() < 0.3))
    match rng.integers(4):
        case 0:
            strength, local = rng.normal() * float(decades(rng, 1e-6, 1e6)), float(rng.random())
            push = Push(tip, dt, strength, hold=float(rng.random()), local=local)
            brush.lead(fluid, push, float(decades(rng, 1e-3, 1e6)), warp)
            brush.carry(fluid, push, warp)
        case 1:
            brush.lead(fluid, Twirl(tip, rng.normal() * float(decades(rng, 1e-6, 1e5))), 1.0, warp)
        case 2:
            brush.expand(fluid, tip, rng.normal() * float(decades(rng, 1e-6, 1e5)))
        case _:
            push = Push(tip, dt)
            fluid.step(dt, steer=lambda velocity: brush.make_up(fluid, push, velocity, warp))


def _check_sentence(error: Exception) -> None:
    assert "\n" not in str(error), error


def _look(fluid: Fluid, warp: WarpMap) -> np.ndarray:
    """Everything that may be read is finite; returns the places that the map looks up, (h, w, 2)."""
    read = {
        "velocity": fluid.velocity.read.get(),
        "centres": fluid.velocity_at_centres(),
        "divergence": fluid.divergence(),
        "pressure": fluid.pressure(),
        "vorticity": fluid.vorticity(),
        "stream function": fluid.stream_function(),
        "map": warp.read((24, 16)),
        "motion": np.array([fluid.motion().kinetic_energy, fluid.motion().largest_speed]),
    }
    for name, values in read.items():
        assert np.isfinite(values).all(), name
    assert "nan" not in repr(fluid)
    y, x = (np.mgrid[:16, :24] + 0.5) / np.array([16, 24])[:, None, None]
    return np.stack([x, y], axis=-1) * warp.extent + read["map"]

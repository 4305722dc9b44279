"""The step: energy, what forces and brushes may do to it, and symmetry, with random input.

Each `check_<name>(device, seed)` asserts, and gives figures that tell how near it came.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from scipy import ndimage

from solver.brush.brush import Brush, Motion
from solver.brush.masks import Masks
from solver.brush.push import Push, gain_compensation
from solver.brush.tip import Tip
from solver.brush.twirl import Twirl
from solver.fluid import Fluid
from solver.gl.device import Device
from solver.gl.field import Field
from solver.grid import Grid
from solver.params import FluidParams, Walls
from solver.warp.map import WarpMap

SIZES = ((8, 8), (9, 17), (33, 20), (24, 40), (50, 20))


def random_solid(rng: np.random.Generator, grid: Grid) -> np.ndarray:
    """No solid, discs, or bars, whose least thickness is two cells; and never everything."""
    x, y = grid.centres()
    solid = np.zeros((grid.ny, grid.nx), bool)
    for _ in range(rng.integers(0, 4)):
        at, size = rng.uniform(0, 1, 2) * grid.extent, rng.uniform(0.05, 0.2)
        if rng.random() < 0.5:
            solid |= np.hypot(x - at[0], y - at[1]) < size
        else:
            thin = 1.1 * grid.h
            across, down = (size, thin) if rng.random() < 0.5 else (thin, size)
            solid |= (abs(x - at[0]) < across) & (abs(y - at[1]) < down)
    return solid


def random_faces(rng: np.random.Generator, grid: Grid) -> np.ndarray:
    """A velocity that is rough from cell to cell, or smooth over a few."""
    faces = rng.standard_normal((grid.ny, grid.nx, 2))
    cells = rng.choice([0.0, 1.0, 3.0])
    faces = np.stack([ndimage.gaussian_filter(faces[..., axis], cells) for axis in (0, 1)], axis=-1)
    return (faces / np.abs(faces).max()).astype(np.float32)


def energy(fluid: Fluid) -> float:
    return float((fluid.velocity.read.get().astype(np.float64) ** 2).sum())


def check_energy_of_unforced_flow(device: Device, seed: int, steps: int = 400) -> dict[str, float]:
    """Unforced and inviscid, at any step, smooth or rough, between any walls and solids: it never grows."""
    rng = np.random.default_rng(seed)
    grid = Grid(*SIZES[rng.integers(len(SIZES))])
    fluid = Fluid(device, grid, FluidParams(Walls(rng.choice(["free", "none"]))))
    fluid.set_solid(random_solid(rng, grid))
    fluid.set_velocity(random_faces(rng, grid))
    fluid.project()
    first, speed = energy(fluid), fluid.motion().largest_speed
    dt = 10 ** rng.uniform(0, 2) * grid.h / max(speed, 1e-3)
    most = 0.0
    for step in range(steps):
        fluid.step(dt)
        if step < 10 or step % 10 == 9:
            most = max(most, energy(fluid))
    fluid.release()
    assert most <= 1.001 * first
    return {"energy": most / first if first else 0.0}


def check_anything_goes(device: Device, seed: int, steps: int = 2000, each: int = 100) -> dict[str, float]:
    """Random forces, brushes, masks, walls and steps: finite, no more than was put in, no place off the picture.

    What is bounded is the norm over all faces, and with it every face. Face by face nothing better holds: projection
    and advection keep norms, not maxima, and gather at one face what was put in at many. How far is a figure only.
    Walls, masks and the length of a step are others after `each` steps.
    """
    rng = np.random.default_rng(seed)
    grid = Grid(*SIZES[rng.integers(len(SIZES))])
    width, height = grid.extent
    fluid, warp, brush, masks = Fluid(device, grid), WarpMap(device, grid), Brush(device), Masks(device, grid)
    put_in, fastest_put_in, strength = 0.0, 0.0, 10 ** rng.uniform(-2, 3)
    worst, fastest = 0.0, 0.0

    def tip() -> Tip:
        start = rng.uniform(-0.1, 1.1, 2) * grid.extent
        end = start + rng.normal(0, 0.1, 2)
        return Tip(tuple(start), tuple(end), 10 ** rng.uniform(-2, -0.3), rng.uniform(0, 1))

    def steer(velocity: Field, motion: Motion) -> None:
        before = velocity.get()
        brush.make_up(fluid, motion, velocity, warp)
        note(velocity.get() - before)

    def note(added: np.ndarray) -> None:
        nonlocal put_in, fastest_put_in
        put_in += float(np.linalg.norm(added))
        fastest_put_in += float(np.abs(added).max())

    masks.set_base(0.0)
    for step in range(steps):
        if step % each == 0:
            fluid.params = FluidParams(Walls(rng.choice(["free", "none"])), drag=rng.choice([0.0, 1.0]))
            thick = 10 ** rng.uniform(-6, 3) if rng.random() < 0.7 else 0.0
            masks.set_base(thick * 10 ** rng.uniform(-3, 3, (grid.ny, grid.nx)))
            masks.set_frozen(random_solid(rng, grid))
            masks.apply(fluid)
            warp.hold(fluid.solid)
            dt = 10 ** rng.uniform(-4, 1)
        if rng.random() < 0.05:
            masks.thicken(tip(), rng.normal(0, 3))
            masks.freeze(tip(), rng.normal(0, 1))
            masks.apply(fluid)
            warp.hold(fluid.solid)
        forces, motion = [], None
        if rng.random() < 0.3:
            forces.append(strength * random_faces(rng, grid) / dt)
            note(dt * forces[0])
        if rng.random() < 0.3:
            motion = Push(tip(), dt, rng.normal()) if rng.random() < 0.5 else Twirl(tip(), strength * rng.normal())
            brush.lead(fluid, motion, gain_compensation(motion.tip.radius, dt, fluid.params.drag, thick), warp)
            note(fluid.impulse.field.get())
        if rng.random() < 0.05:
            brush.expand(fluid, tip(), rng.normal() / dt)
            # The flow that makes room: |grad phi| <= |lap phi| L / pi, and L is 1 or, round solids, less than 3.
            note(fluid.source.field.get())
        fluid.step(dt, forces, partial(steer, motion=motion) if motion and rng.random() < 0.5 else None)
        warp.follow(fluid, dt)
        if step % 50 == 49:
            speed = float(np.sqrt(energy(fluid)))
            assert np.isfinite(speed)
            assert speed <= 1.001 * put_in + 1e-6
            worst = max(worst, speed / max(put_in, 1e-9))
            fastest = max(fastest, float(np.abs(fluid.velocity.read.get()).max()) / max(fastest_put_in, 1e-9))
            displacement = warp.read()
            x, y = grid.centres()
            places = np.stack([x, y], axis=-1) + displacement
            assert np.isfinite(displacement).all()
            assert (places > -1e-5).all()
            assert (places < np.array([width, height]) + 1e-5).all()
    for item in (fluid, warp, brush, masks):
        item.release()
    return {"norm": worst, "largest face of the largest put in": fastest}


def check_brush_to_and_fro(device: Device, seed: int, seconds: float = 60.0) -> dict[str, float]:
    """A push to and fro for a minute, without drag: the fluid is never faster than twice the brush."""
    rng = np.random.default_rng(seed)
    cells = int(rng.integers(24, 49))
    grid = Grid(cells, int(cells * rng.uniform(0.6, 1)))
    fluid, brush = Fluid(device, grid), Brush(device)
    fluid.set_viscosity(rng.choice([0.0, 1e-4, 1e-2]))
    dt, speed, radius = 1 / 60, 1.6, rng.uniform(0.06, 0.2)
    (width, height), angle = grid.extent, rng.uniform(0, np.pi)
    along = np.array([np.cos(angle), np.sin(angle)])
    reach = 0.3 * min(width, height)

    def at(time: float) -> np.ndarray:
        back = abs((time * speed / (2 * reach)) % 2 - 1)
        return np.array([width / 2, height / 2]) + (2 * back - 1) * reach * along

    most = 0.0
    for tick in range(round(seconds / dt)):
        tip = Tip(tuple(at(tick * dt)), tuple(at((tick + 1) * dt)), radius)
        brush.push(fluid, tip, dt)
        fluid.step(dt)
        if tick % 10 == 9:
            most = max(most, fluid.motion().largest_speed)
    fluid.release()
    brush.release()
    assert most <= 2 * speed
    return {"speed of the brush's": most / speed}


# Mirrored left to right, top to bottom; turned by halves and quarters; transposed.
TURNS = ("x", "y", "xy", "t", "tx", "ty", "txy")


def turned(faces: np.ndarray, turn: str) -> np.ndarray:
    """A vector on MAC faces in the mirror, transposed first if that is asked for; far walls' faces are zero."""
    u, v = np.pad(faces[..., 0], ((0, 0), (0, 1))), np.pad(faces[..., 1], ((0, 1), (0, 0)))
    if "t" in turn:
        u, v = v.T, u.T
    if "x" in turn:
        u, v = -u[:, ::-1], v[:, ::-1]
    if "y" in turn:
        u, v = u[::-1], -v[::-1]
    return np.stack([u[:, :-1], v[:-1]], axis=-1)


def turned_cells(cells: np.ndarray, turn: str) -> np.ndarray:
    """The same of a scalar at cells."""
    cells = cells.T if "t" in turn else cells
    cells = cells[:, ::-1] if "x" in turn else cells
    return cells[::-1] if "y" in turn else cells


def turned_walls(walls: Walls, turn: str) -> Walls:
    """The same of the sides that the fluid sticks to."""
    left, right, top, bottom = walls.sticky
    if "t" in turn:
        left, right, top, bottom = top, bottom, left, right
    if "x" in turn:
        left, right = right, left
    if "y" in turn:
        top, bottom = bottom, top
    return replace(walls, sticky=(left, right, top, bottom))


def turned_map(displacement: np.ndarray, turn: str) -> np.ndarray:
    """The same of a vector at cells."""
    u, v = displacement[..., 0], displacement[..., 1]
    if "t" in turn:
        u, v = v, u
    u, v = (-u if "x" in turn else u), (-v if "y" in turn else v)
    return np.stack([turned_cells(u, turn), turned_cells(v, turn)], axis=-1)


def check_symmetry(device: Device, seed: int, masked: bool = False, ticks: int = 60) -> dict[str, float]:
    """Mirrored, turned and transposed set-ups give mirrored, turned and transposed maps, brushes and all."""
    rng = np.random.default_rng(seed)
    grid = Grid(*((32, 32), (40, 24), (26, 34), (25, 33), (33, 24), (27, 27))[rng.integers(6)])
    dt = 1 / 60
    walls = Walls(rng.choice(["free", "none"]), sticky=tuple((rng.random(4) < 0.5).tolist()))
    start = random_faces(rng, grid)
    for axis in (0, 1):  # none of it through the walls
        start[:, 0, 0] = start[0, :, 1] = 0.0
        start[..., axis] = ndimage.gaussian_filter(start[..., axis], 2)
    start *= 0.3 / np.abs(start).max()
    force = 0.3 * random_faces(rng, grid)
    force[:, 0, 0] = force[0, :, 1] = 0.0
    viscosity = np.full((grid.ny, grid.nx), 10 ** rng.uniform(-4, -1))
    solid = np.zeros_like(viscosity, bool)
    if masked:
        viscosity = viscosity * 100.0 ** (ndimage.gaussian_filter(rng.standard_normal(viscosity.shape), 4) > 0)
        solid = random_solid(rng, grid)
    (width, height), angle = grid.extent, rng.uniform(0, 6.28)
    middle, reach = np.array([width, height]) / 2, 0.25 * min(width, height)
    radius, rate = rng.uniform(0.08, 0.2), 3 * rng.normal()

    def place(point: np.ndarray, turn: str) -> tuple[float, float]:
        x, y = point
        w, h = grid.extent
        if "t" in turn:
            x, y, w, h = y, x, h, w
        return (w - x if "x" in turn else x), (h - y if "y" in turn else y)

    def warped(turn: str) -> np.ndarray:
        other = Grid(grid.ny, grid.nx) if "t" in turn else grid
        fluid, warp, brush = (
            Fluid(device, other, FluidParams(turned_walls(walls, turn))),
            WarpMap(device, other),
            Brush(device),
        )
        fluid.set_viscosity(turned_cells(viscosity, turn))
        fluid.set_solid(turned_cells(solid, turn))
        fluid.set_velocity(turned(start, turn))
        mirrored = len(turn) % 2 == 1
        pull = turned(force, turn)
        for tick in range(ticks):
            points = [
                middle + reach * np.array([np.cos(a), np.sin(a)]) for a in (angle + 0.05 * (tick + n) for n in (0, 1))
            ]
            tip = Tip(place(points[0], turn), place(points[1], turn), radius, 0.5)
            still = place(middle, turn)
            motion = Push(tip, dt)
            brush.lead(fluid, motion, warp=warp)
            brush.twirl(fluid, Tip(still, still, radius), -rate if mirrored else rate)
            fluid.step(dt, pull, lambda velocity, motion=motion: brush.make_up(fluid, motion, velocity, warp))
            warp.follow(fluid, dt)
        found = warp.read() / np.array(other.spacing)
        for item in (fluid, warp, brush):
            item.release()
        return found

    plain = warped("")
    far = {turn: float(np.abs(warped(turn) - turned_map(plain, turn)).max()) for turn in TURNS}
    assert np.abs(plain).max() > 0.1
    assert max(far.values()) < (0.1 if masked else 0.01), far
    return {"cells": max(far.values()), "moved": float(np.abs(plain).max())}


def check_symmetry_with_masks(device: Device, seed: int, ticks: int = 60) -> dict[str, float]:
    """The same with a varying viscosity and solids."""
    return check_symmetry(device, seed, masked=True, ticks=ticks)

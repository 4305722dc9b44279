"""The viscous step among random masks, against a direct solution of the same equation in float64."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from properties import pressure
from properties.fluid import TURNS, turned, turned_cells, turned_walls
from solver.gl.device import Device
from solver.params import Walls
from solver.viscosity.solve import Viscosity
from support import reference

SIZES = (96, 96), (200, 133), (256, 256)
CONTRASTS = 1e2, 1e5, 1e8
SOFTEST = 1.0, 30.0  # kappa = dt mu / h^2
# Error left at most, by contrast; beyond, no more than v* itself has.
ERROR = {1e2: 0.01, 1e5: 0.05}
ITERATIONS = {1.0: 5, 30.0: 10}

Rng = np.random.Generator


def blobs(rng: Rng, nx: int, ny: int) -> np.ndarray:
    return ndimage.gaussian_filter(rng.standard_normal((ny, nx)), max(nx, ny) / rng.uniform(12, 24))


def hard_blobs(rng: Rng, nx: int, ny: int) -> np.ndarray:
    field = blobs(rng, nx, ny)
    return (field > 0.5 * field.std()) * 1.0


def soft_blobs(rng: Rng, nx: int, ny: int) -> np.ndarray:
    field = blobs(rng, nx, ny)
    return np.clip(0.8 * field / field.std(), 0, 1)


def small_blobs(rng: Rng, nx: int, ny: int) -> np.ndarray:
    """Hundreds of discs of one to five cells."""
    y, x = np.mgrid[:ny, :nx] + 0.5
    mask = np.zeros((ny, nx), bool)
    for _ in range(30 + nx * ny // 220):
        mask |= np.hypot(x - rng.uniform(0, nx), y - rng.uniform(0, ny)) < rng.uniform(1, 5)
    return mask * 1.0


def snakes(rng: Rng, nx: int, ny: int) -> np.ndarray:
    """Winding lines of one to three cells."""
    mask = np.zeros((ny, nx), bool)
    for _ in range(12):
        place, angle, turn = rng.uniform(0, 1, 2) * (nx, ny), rng.uniform(0, 2 * np.pi), 0.0
        width = int(rng.integers(1, 4))
        for _ in range(int(2 * max(nx, ny) * rng.uniform(0.3, 1))):
            turn = 0.9 * turn + 0.05 * rng.standard_normal()
            angle += 0.5 * turn
            place = place + 0.5 * np.array([np.cos(angle), np.sin(angle)])
            i, j = int(place[0]), int(place[1])
            mask[max(j, 0) : max(j + width, 0), max(i, 0) : max(i + width, 0)] = True
    return mask * 1.0


def spiral(rng: Rng, nx: int, ny: int) -> np.ndarray:
    """Arms of one to three cells."""
    y, x = np.mgrid[:ny, :nx] + 0.5
    width, pitch = rng.uniform(1, 3), rng.uniform(6, 14)
    radius = np.hypot(x - nx / 2, y - ny / 2)
    angle = np.arctan2(y - ny / 2, x - nx / 2) + rng.uniform(0, 2 * np.pi)
    return (((radius - pitch * angle / (2 * np.pi)) % pitch < width) & (radius < 0.45 * min(nx, ny))) * 1.0


def checkerboard(rng: Rng, nx: int, ny: int) -> np.ndarray:
    side = int(rng.choice([1, 2, 3, 5, 8, 13]))
    y, x = np.mgrid[:ny, :nx] // side
    return (x + y) % 2 * 1.0


CLASSES: dict[str, Callable[[Rng, int, int], np.ndarray]] = {
    "hard blobs": hard_blobs,
    "soft blobs": soft_blobs,
    "small blobs": small_blobs,
    "snakes": snakes,
    "spiral": spiral,
    "checkerboard": checkerboard,
}


def of_solids(mask: Callable[[tuple[int, int], Rng], np.ndarray]) -> Callable[[Rng, int, int], np.ndarray]:
    """Viscous fluid where the pressure's mask is solid."""
    return lambda rng, nx, ny: mask((nx, ny), rng) * 1.0


# What else the projection is tried among.
WALLED = {
    "discs": of_solids(pressure.discs),
    "bars": of_solids(pressure.bars),
    "one-cell walls": of_solids(pressure.walls),
    "cavities": of_solids(pressure.cavities),
    "maze": of_solids(pressure.maze),
}
MASKS = CLASSES | WALLED


def eddies(rng: Rng, nx: int, ny: int) -> np.ndarray:
    """A velocity without divergence on MAC faces, (ny, nx, 2), smooth on a twentieth of the longer side."""
    stream = ndimage.gaussian_filter(rng.standard_normal((ny + 1, nx + 1)), max(nx, ny) / 20)
    stream *= np.sin(np.pi * np.linspace(0, 1, nx + 1)) * np.sin(np.pi * np.linspace(0, 1, ny + 1))[:, None]
    faces = np.stack([stream[1:, :-1] - stream[:-1, :-1], stream[:-1, :-1] - stream[:-1, 1:]], axis=-1)
    return (faces / np.abs(faces).max()).astype(np.float32)


def random_walls(rng: Rng) -> Walls:
    """Free-slip, no-slip, or sides of either kind."""
    kind = rng.integers(3)
    left, right, top, bottom = rng.random(4) < 0.5
    return (Walls(), Walls("none"), Walls(sticky=(left, right, top, bottom)))[kind]


@dataclass
class Case:
    """A step of random input; dt / (hx hy) is one, and so mu is kappa. The aspect is hy / hx."""

    viscosity: np.ndarray
    faces: np.ndarray
    walls: Walls
    solid: np.ndarray
    aspect: float = 1.0

    @classmethod
    def random(
        cls, kind: str, size: tuple[int, int], contrast: float, softest: float, rng: Rng, plain: bool = True
    ) -> Case:
        """A mask of the kind; unless `plain`, between random walls, and half of the times with a solid disc."""
        nx, ny = size
        viscosity = (softest * contrast ** MASKS[kind](rng, nx, ny)).astype(np.float32)
        faces = eddies(rng, nx, ny)
        solid, walls = np.zeros((ny, nx), bool), Walls()
        if not plain and rng.random() < 0.5:
            walls = random_walls(rng)
        if not plain and rng.random() < 0.5:
            y, x = np.mgrid[:ny, :nx]
            solid = np.hypot(x - rng.uniform(0, nx), y - rng.uniform(0, ny)) < rng.uniform(0.03, 0.2) * max(nx, ny)
            faces[solid] = 0.0
            faces[:, 1:, 0][solid[:, :-1]] = 0.0
            faces[1:, :, 1][solid[:-1]] = 0.0
        return cls(viscosity, faces, walls, solid)

    def solved(self, device: Device) -> tuple[np.ndarray, int]:
        """The solution and how many iterations it took."""
        ny, nx = self.viscosity.shape
        hx, hy = 1 / max(nx, ny), self.aspect / max(nx, ny)
        solver = Viscosity(device, (nx, ny), (hx, hy))
        fields = device.upload(self.viscosity), device.upload(self.solid.astype(np.uint8) * np.uint8(255))
        solver.set_coefficients(*fields, hx * hy, self.walls)
        velocity = device.double_field((nx, ny), 2, "velocity")
        velocity.read.set(self.faces)
        solver.diffuse(velocity.read)
        found = velocity.read.get().astype(np.float64)
        for item in (solver, velocity, *fields):
            item.release()
        return found, solver.conjugate_gradients.iterations

    def turned(self, turn: str) -> Case:
        """The same in the mirror, or transposed; see `TURNS`."""
        faces = turned(self.faces, turn).astype(np.float32)
        walls, solid = turned_walls(self.walls, turn), turned_cells(self.solid, turn)
        return Case(turned_cells(self.viscosity, turn), faces, walls, solid)

    def exact(self) -> np.ndarray:
        spacing = self.aspect**-0.5, self.aspect**0.5
        return reference.viscous_step(
            self.faces, self.viscosity.astype(np.float64), 1.0, spacing, solid=self.solid, no_slip=self.walls.no_slip
        )


def error(found: np.ndarray, wanted: np.ndarray) -> float:
    return float(np.linalg.norm(found - wanted) / np.linalg.norm(wanted))


def check_viscous_step(
    device: Device, seed: int, classes: Iterable[str] = CLASSES, sizes: Sequence[tuple[int, int]] = SIZES[:2]
) -> dict[str, float]:
    """Whatever the mask: near the direct solution, in few iterations, and never worse than doing nothing."""
    rng = np.random.default_rng(seed)
    kind, size = str(rng.choice(list(classes))), sizes[int(rng.integers(len(sizes)))]
    contrast, softest = float(rng.choice(CONTRASTS)), float(rng.choice(SOFTEST))
    case = Case.random(kind, size, contrast, softest, rng, plain=False)
    found, iterations = case.solved(device)
    wanted = case.exact()
    left, nothing = error(found, wanted), error(case.faces, wanted)
    told = f"seed {seed}: {kind}, {size}, contrast {contrast:g}, kappa {softest:g}: {left:.4f} in {iterations}"
    assert np.isfinite(found).all(), told
    assert left < min(ERROR.get(contrast, np.inf), nothing), told
    assert iterations <= ITERATIONS[softest] or contrast not in ERROR, told
    return {"error": left, "doing nothing": nothing, "iterations": iterations}


def check_viscous_step_on_three_grids(device: Device, seed: int) -> dict[str, float]:
    """The same among all masks, on 256 x 256 cells too."""
    return check_viscous_step(device, seed, MASKS, SIZES)


def check_viscous_step_in_a_channel(device: Device, seed: int) -> dict[str, float]:
    """A grid many times as long as it is wide, as viscous as may be: near the direct solution."""
    rng = np.random.default_rng(seed)
    kind, length, width = str(rng.choice(list(CLASSES))), int(rng.integers(200, 1100)), int(rng.integers(8, 17))
    size = (length, width) if rng.random() < 0.5 else (width, length)
    contrast, softest = float(rng.choice([1e2, 1e5])), float(10 ** rng.uniform(0, 3))
    case = Case.random(kind, size, contrast, softest, rng, plain=False)
    found, iterations = case.solved(device)
    left = error(found, case.exact())
    told = f"seed {seed}: {kind}, {case.viscosity.shape}, {case.walls.slip}, contrast {contrast:g}, kappa {softest:g}"
    assert left < ERROR[contrast], f"{told}: {left:.4f} in {iterations}"
    return {"error": left, "iterations": iterations}


def check_uniform_viscous_step(device: Device, seed: int) -> dict[str, float]:
    """One viscosity, noise or smooth, on any grid with cells of any aspect between any walls: within a hundredth."""
    rng = np.random.default_rng(seed)
    nx, ny = (round(10 ** rng.uniform(np.log10(3), np.log10(129))) for _ in "xy")
    kappa, aspect, walls = 10 ** rng.uniform(np.log10(0.05), 4), 2 ** rng.uniform(-0.6, 0.6), random_walls(rng)
    is_noise = bool(rng.random() < 0.5)
    faces = rng.standard_normal((ny, nx, 2)).astype(np.float32) if is_noise else eddies(rng, nx, ny)
    faces[:, 0, 0] = faces[0, :, 1] = 0.0
    case = Case(np.full((ny, nx), kappa, np.float32), faces, walls, np.zeros((ny, nx), bool), aspect)
    found, iterations = case.solved(device)
    left = error(found, case.exact())
    told = f"seed {seed}: {nx} x {ny}, aspect {aspect:.2f}, {walls.no_slip}, kappa {kappa:.3g}, noise {is_noise}"
    assert left < 0.01, f"{told}: {left:.4f} in {iterations}"
    return {"error": left, "iterations": iterations}


def check_viscous_step_in_the_mirror(device: Device, seed: int) -> dict[str, float]:
    """One viscosity or a mask, on odd and even grids of any aspect: near the direct solution, also mirrored."""
    rng = np.random.default_rng(seed)
    nx, ny = (round(10 ** rng.uniform(0.91, 2.1)) for _ in "xy")
    if rng.random() < 0.6:
        kind, contrast, softest = "one viscosity", 1e2, float(10 ** rng.uniform(-2, 6))
        walls, solid = Walls(rng.choice(["free", "none"])), np.zeros((ny, nx), bool)
        case = Case(np.full((ny, nx), softest, np.float32), eddies(rng, nx, ny), walls, solid)
    else:
        kind, contrast, softest = str(rng.choice(list(CLASSES))), float(rng.choice([1e2, 1e5])), 1.0
        case = Case.random(kind, (nx, ny), contrast, softest, rng, plain=False)
    found, _ = case.solved(device)
    left, size = error(found, case.exact()), float(np.linalg.norm(found))
    off = max(float(np.linalg.norm(case.turned(t).solved(device)[0] - turned(found, t))) / size for t in TURNS)
    told = f"seed {seed}: {kind}, {nx} x {ny}, {case.walls.slip}, contrast {contrast:g}, kappa {softest:g}"
    assert left < ERROR[contrast], f"{told}: {left:.4f} left"
    assert off < 2 * ERROR[contrast], f"{told}: {off:.4f} off in the mirror"
    return {"error": left, "off in the mirror": off}


def check_viscous_step_is_stable(device: Device, seed: int) -> dict[str, float]:
    """Any viscosity, cell by cell, any grid, any walls and solids, any velocity: energy never grows."""
    rng = np.random.default_rng(seed)
    nx, ny = (int(length) for length in rng.integers(8, 90, 2))
    viscosity = 10 ** (rng.uniform(-4, 8, (ny, nx)) if rng.random() < 0.5 else np.full((ny, nx), rng.uniform(-4, 8)))
    solid = rng.random((ny, nx)) < rng.choice([0.0, 0.05, 0.5])
    faces = rng.standard_normal((ny, nx, 2)).astype(np.float32)
    faces[solid] = faces[:, 0, 0] = faces[0, :, 1] = 0.0
    faces[:, 1:, 0][solid[:, :-1]] = 0.0
    faces[1:, :, 1][solid[:-1]] = 0.0
    case = Case(viscosity.astype(np.float32), faces, random_walls(rng), solid)
    found, iterations = case.solved(device)
    growth = float(np.linalg.norm(found) / max(np.linalg.norm(faces), 1e-30))
    assert growth <= 1.001, f"seed {seed}: {nx} x {ny}, growth {growth:.4f}"
    return {"growth": growth, "iterations": iterations}


def solved(solver: Viscosity, faces: np.ndarray) -> bytes:
    """A step by the coefficients that were taken up, in which all that was made of them takes part."""
    velocity = solver.device.double_field(solver.size, 2, "velocity")
    velocity.read.set(faces)
    solver.forget()
    solver.diffuse(velocity.read)
    found = velocity.read.get().tobytes()
    velocity.release()
    return found


def check_changed_viscous_mask(device: Device, seed: int) -> dict[str, float]:
    """A mask that changes step by step, in places or as a whole: the very bytes of taking each up afresh."""
    rng = np.random.default_rng(seed)
    nx, ny = size = int(rng.integers(7, 150)), int(rng.integers(7, 150))
    x, y = np.arange(nx) + 0.5, np.arange(ny)[:, None] + 0.5
    thick, solid = np.zeros((ny, nx)), np.zeros((ny, nx), bool)
    walls, contrast, dt = Walls(), 1e5, 1.0 / max(size) ** 2
    solver = Viscosity(device, size)
    parts = 0
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
                walls = random_walls(rng)
            case "step":
                dt *= 1.5
            case "contrast":
                contrast = rng.choice([2.0, 1e2, 1e5])
        fields = device.upload(contrast**thick), device.upload(solid.astype(np.uint8) * np.uint8(255))
        solver.set_coefficients(*fields, dt, walls)
        fresh = Viscosity(device, size)
        fresh.set_coefficients(*fields, dt, walls)
        assert solver.plan == fresh.plan, f"seed {seed}"
        # Also where the masks before were never solved with, and nothing was asked for.
        if rng.random() < 0.7:
            faces = rng.standard_normal((ny, nx, 2)).astype(np.float32)
            assert solved(solver, faces) == solved(fresh, faces), f"seed {seed}"
            parts = max(parts, fresh.deflation.space.parts.count if fresh.deflation.space else 0)
        for item in (fresh, *fields):
            item.release()
    solver.release()
    return {"parts": parts}

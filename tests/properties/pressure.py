"""Properties of the pressure projection that hold for random masks, sizes and velocities."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import ndimage

from solver.gl.device import Device
from solver.packing import packed
from solver.pressure.cycle import Cycle
from solver.pressure.projection import Projection

Size = tuple[int, int]
SIZES: list[Size] = [(8, 8), (9, 17), (100, 512), (333, 217), (512, 512), (1023, 8)]


# -- random masks, (ny, nx), true where solid --------------------------------------------------------------------------


def open_box(size: Size, rng: np.random.Generator) -> np.ndarray:
    return np.zeros(size[::-1], bool)


def discs(size: Size, rng: np.random.Generator) -> np.ndarray:
    x, y = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    solid = np.zeros(x.shape, bool)
    for _ in range(rng.integers(1, 9)):
        solid |= np.hypot(x - rng.uniform(0, size[0]), y - rng.uniform(0, size[1])) < rng.uniform(1, 0.15 * max(size))
    return solid


def bars(size: Size, rng: np.random.Generator) -> np.ndarray:
    """Some of them one cell wide, in any direction."""
    x, y = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    solid = np.zeros(x.shape, bool)
    for _ in range(rng.integers(1, 9)):
        angle, length = rng.uniform(0, np.pi), rng.uniform(0.1, 0.6) * max(size) / 2
        width = rng.choice([0.71, rng.uniform(0.5, max(1.0, 0.025 * max(size)))])
        dx, dy = x - rng.uniform(0, size[0]), y - rng.uniform(0, size[1])
        along, across = dx * np.cos(angle) + dy * np.sin(angle), dy * np.cos(angle) - dx * np.sin(angle)
        solid |= (np.abs(along) < length) & (np.abs(across) < width)
    return solid


def walls(size: Size, rng: np.random.Generator) -> np.ndarray:
    """One cell thick."""
    solid = np.zeros(size[::-1], bool)
    for _ in range(rng.integers(2, 13)):
        lines = solid if rng.random() < 0.5 else solid.T
        first, last = sorted(rng.integers(0, lines.shape[1] + 1, 2))
        lines[rng.integers(lines.shape[0]), first:last] = True
    return solid


def cavities(size: Size, rng: np.random.Generator) -> np.ndarray:
    """Closed boxes across each other, and single cells enclosed."""
    solid = np.zeros(size[::-1], bool)
    for _ in range(rng.integers(1, 9)):
        width, height = (int(rng.integers(3, max(4, length // 2))) for length in size)
        i, j = int(rng.integers(0, size[0] - width + 1)), int(rng.integers(0, size[1] - height + 1))
        solid[[j, j + height - 1], i : i + width] = True
        solid[j : j + height, [i, i + width - 1]] = True
    for _ in range(3):
        i, j = int(rng.integers(1, size[0] - 1)), int(rng.integers(1, size[1] - 1))
        solid[[j - 1, j, j, j + 1], [i, i - 1, i + 1, i]] = True
    return solid


def maze(size: Size, rng: np.random.Generator) -> np.ndarray:
    """Ways one to three cells wide between walls of one cell, by a walk that turns back where it finds no new room."""
    width = int(rng.integers(1, 4))
    nx, ny = ((length - 1) // (width + 1) for length in size)
    solid = np.ones(size[::-1], bool)
    if min(nx, ny) < 1:
        return solid
    seen = np.zeros((ny, nx), bool)
    seen[0, 0] = True
    trail = [(0, 0)]

    def open_up(x0: int, y0: int, x1: int, y1: int) -> None:
        pitch = width + 1
        solid[1 + pitch * y0 : 1 + pitch * y1 + width, 1 + pitch * x0 : 1 + pitch * x1 + width] = False

    open_up(0, 0, 0, 0)
    while trail:
        x, y = trail[-1]
        around = [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)]
        fresh = [(i, j) for i, j in around if 0 <= i < nx and 0 <= j < ny and not seen[j, i]]
        if not fresh:
            trail.pop()
            continue
        i, j = fresh[rng.integers(len(fresh))]
        seen[j, i] = True
        open_up(min(x, i), min(y, j), max(x, i), max(y, j))
        trail.append((i, j))
    return np.roll(solid, rng.integers(0, 2, 2), (0, 1))


def crumbs(size: Size, rng: np.random.Generator) -> np.ndarray:
    """Single cells at random."""
    return rng.random(size[::-1]) < rng.uniform(0.05, 0.6)


# And the most cycles that each may take.
MASKS: dict[Callable[[Size, np.random.Generator], np.ndarray], int] = {
    open_box: 8, discs: 8, bars: 8, walls: 8, cavities: 8, maze: 25, crumbs: 25,
}  # fmt: skip


# -- velocities and what is measured -----------------------------------------------------------------------------------


def random_velocity(size: Size, rng: np.random.Generator) -> np.ndarray:
    """Noise, or a few impulses, (ny, nx, 2)."""
    if rng.random() < 0.4:
        return rng.standard_normal((size[1], size[0], 2)).astype(np.float32)
    x, y = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    velocity = np.zeros((size[1], size[0], 2))
    for _ in range(6):
        distance = np.hypot(x - rng.uniform(0, size[0]), y - rng.uniform(0, size[1]))
        bell = np.exp(-((distance / (rng.uniform(0.03, 0.1) * max(size))) ** 2) / 2)
        velocity += bell[..., None] * rng.standard_normal(2)
    return velocity.astype(np.float32)


def open_faces(solid: np.ndarray) -> np.ndarray:
    """1 on faces between two fluid cells, (ny, nx, 2)."""
    faces = np.zeros((*solid.shape, 2))
    faces[:, 1:, 0] = ~(solid[:, 1:] | solid[:, :-1])
    faces[1:, :, 1] = ~(solid[1:] | solid[:-1])
    return faces


def divergence(velocity: np.ndarray, aspect: float) -> np.ndarray:
    """The divergence times the side of a cell along x, float64."""
    u, v = velocity[..., 0].astype(float), velocity[..., 1].astype(float)
    return np.pad(u, ((0, 0), (0, 1)))[:, 1:] - u + aspect * (np.pad(v, ((0, 1), (0, 0)))[1:] - v)


def random_spacing(size: Size, rng: np.random.Generator) -> tuple[float, float]:
    """Square cells, or nearly so."""
    h = 1.0 / max(size)
    return h, h * float(rng.choice([1.0, rng.uniform(0.94, 1.06)]))


def leave(device: Device, size: Size, kind: Callable[..., np.ndarray], rng: np.random.Generator) -> dict[str, float]:
    """Project three velocities that change little by little, the first cold; all must leave a thousandth."""
    solid, spacing = kind(size, rng), random_spacing(size, rng)
    aspect, faces = spacing[0] / spacing[1], open_faces(solid)
    projection, field = Projection(device, size, spacing), device.double_field(size, 2)
    if kind is not open_box:
        projection.set_solids(solid)
    velocity, change = random_velocity(size, rng), 0.05 * random_velocity(size, rng)
    worst, most = 0.0, 0
    for step in range(3):
        given = velocity + step * change
        field.read.set(given)
        most = max(most, projection.project(field, warm=True))
        before = np.linalg.norm(divergence(given * faces, aspect))
        result = field.read.get()
        left = np.linalg.norm(divergence(result, aspect))
        assert np.isfinite(result).all()
        assert not result[faces == 0.0].any()
        assert left <= 1e-3 * before, f"{kind.__name__} {size}: {left / before:.2e} left"
        worst = max(worst, float(left / before) if before else 0.0)
    assert most <= MASKS[kind], f"{kind.__name__} {size}: {most} cycles"
    for item in (projection, field):
        item.release()
    return {"left": worst, f"cycles of {kind.__name__}": most}


# -- the properties ----------------------------------------------------------------------------------------------------


def check_divergence(device: Device, seed: int) -> dict[str, float]:
    """A thousandth of the divergence or less is left, on small grids."""
    rng = np.random.default_rng(seed)
    kind = list(MASKS)[seed % len(MASKS)]
    size = int(rng.integers(8, 80)), int(rng.integers(8, 80))
    return leave(device, size, kind, rng)


def check_divergence_of_large(device: Device, seed: int) -> dict[str, float]:
    """The same on grids of all sizes, one after the other."""
    rng = np.random.default_rng(seed)
    return leave(device, SIZES[seed // len(MASKS) % len(SIZES)], list(MASKS)[seed % len(MASKS)], rng)


def check_source(device: Device, seed: int) -> dict[str, float]:
    """A source acts less its mean over each region of the fluid."""
    rng = np.random.default_rng(seed)
    size = int(rng.integers(8, 80)), int(rng.integers(8, 80))
    solid = list(MASKS)[seed % len(MASKS)](size, rng)
    asked = rng.standard_normal(size[::-1]).astype(np.float32)
    if rng.random() < 0.5:
        asked = ndimage.gaussian_filter(asked, 3.0)
    region = np.zeros(solid.shape, int)
    ndimage.label(~solid, output=region)
    mean = np.bincount(region.ravel(), asked.ravel()) / np.maximum(np.bincount(region.ravel()), 1)
    wanted = np.where(solid, 0.0, asked - mean[region]) / max(size)
    projection, field = Projection(device, size), device.double_field(size, 2)
    source = device.upload(asked)
    projection.set_solids(solid)
    cycles = projection.project(field, source=source)
    left = np.linalg.norm(divergence(field.read.get(), 1.0) - wanted)
    # A region of one cell wants exactly nothing; what float32 makes of its mean is left aside.
    assert left <= 1e-3 * np.linalg.norm(wanted) + 1e-6 / max(size)
    assert cycles <= 25
    for item in (projection, field, source):
        item.release()
    return {"left": float(left / max(np.linalg.norm(wanted), 1e-30)), "cycles": cycles}


def check_again_and_again(device: Device, seed: int) -> dict[str, float]:
    """What is free of divergence but for rounding, or has what is asked for, stays as it is, projected ever again."""
    rng = np.random.default_rng(seed)
    kind = list(MASKS)[seed % len(MASKS)]
    size = int(rng.integers(8, 40)), int(rng.integers(8, 40))
    projection, field = Projection(device, size), device.double_field(size, 2)
    frozen = kind(size, rng)
    source = device.upload(rng.standard_normal(size[::-1]).astype(np.float32)) if rng.random() < 0.3 else None
    if kind is not open_box:
        projection.set_solids(frozen)
    cycles, velocity = None if rng.random() < 0.7 else 8, random_velocity(size, rng)
    field.read.set(velocity)
    projection.project(field, cycles, source, warm=True)
    first = field.read.get().astype(np.float64)
    iterations = [projection.project(field, cycles, source, warm=True) for _ in range(60)]
    # What rounding leaves is not solved for: that would end nowhere.
    assert source or cycles or not any(iterations[10:]), f"{kind.__name__} {size}: {iterations}"
    moved = np.linalg.norm(field.read.get() - first) / np.linalg.norm(velocity)
    assert moved <= 1e-2, f"{kind.__name__} {size}: {moved:.2e}"
    for item in (projection, field, *([source] if source else [])):
        item.release()
    return {"moved": float(moved)}


def check_symmetry(device: Device, seed: int) -> dict[str, float]:
    """What is mirrored or transposed is projected to what is mirrored or transposed, but for what is left."""
    rng = np.random.default_rng(seed)
    kind = list(MASKS)[seed % len(MASKS)]
    size = int(rng.integers(8, 80)), int(rng.integers(8, 80))
    solid, velocity = kind(size, rng), random_velocity(size, rng)
    velocity = velocity * open_faces(solid)

    def project(solid: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        projection, field = Projection(device, solid.shape[::-1]), device.double_field(solid.shape[::-1], 2)
        projection.set_solids(solid if solid.any() else None)
        field.read.set(velocity)
        projection.project(field, 20)
        result = field.read.get()
        for item in (projection, field):
            item.release()
        return result

    def mirror(velocity: np.ndarray) -> np.ndarray:
        # The left face of a cell is the right one of its image, which is kept as the left one of the next.
        mirrored = velocity[:, ::-1].copy()
        mirrored[..., 0] = -np.roll(mirrored[..., 0], 1, axis=1)
        return mirrored

    result = project(solid, velocity)
    scale = max(float(np.abs(velocity).max()), 1e-30)
    mirrored = mirror(project(solid[:, ::-1].copy(), mirror(velocity)))
    transposed = project(solid.T.copy(), velocity.transpose(1, 0, 2)[..., ::-1].copy())
    off = max(
        float(np.abs(mirrored - result).max()), float(np.abs(transposed.transpose(1, 0, 2)[..., ::-1] - result).max())
    )
    assert off <= 2e-4 * scale
    return {"off": off / scale}


def check_cycle(device: Device, seed: int) -> dict[str, float]:
    """The cycle is symmetric and negative definite on the fluid's connected cells."""
    rng = np.random.default_rng(seed)
    kind = list(MASKS)[seed % len(MASKS)]
    size = 2 * int(rng.integers(8, 60)), 2 * int(rng.integers(8, 60))
    solid = kind(size, rng)
    cycle = Cycle(device, size, 1.0, None if kind is open_box else solid)
    faces, worst = open_faces(solid), 0.0

    def residual(velocity: np.ndarray) -> np.ndarray:
        return packed(divergence(velocity * faces, 1.0))

    for sweeps in (1, 2):
        residuals = [residual(random_velocity(size, rng)) for _ in range(2)]
        answers = []
        for array in residuals:
            field = device.upload(array.astype(np.float32))
            answers.append(cycle.solve(field, sweeps).get().astype(float))
            field.release()
        own = [float((r * z).sum()) for r, z in zip(residuals, answers, strict=True)]
        if min(np.abs(own)) == 0.0:
            continue
        assert max(own) < 0.0
        shared = float((residuals[0] * answers[1]).sum()), float((residuals[1] * answers[0]).sum())
        off = abs(shared[0] - shared[1]) / np.sqrt(own[0] * own[1])
        assert off <= 1e-3
        worst = max(worst, float(off))
    cycle.release()
    return {"asymmetry": worst}

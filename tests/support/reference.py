"""What the shaders compute, again: NumPy, float64, straight from the formulas and with arrays padded by hand."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse import linalg as sparse_linalg

Faces = np.ndarray
Images = tuple[float, float, float, float]

# ---------------------------------------------------------------------------------------------------------------------
# The stages of a step
# ---------------------------------------------------------------------------------------------------------------------

PAD = 4


def padded_faces(
    faces: Faces, no_slip: tuple[bool, ...] = (False,) * 5, speed: tuple[float, ...] = (0, 0, 0, 0)
) -> tuple[np.ndarray, ...]:
    """u and v with PAD ghost faces on every side, from (ny, nx, 2): the normal component zero on walls and odd beyond,
    the tangential one even, or 2 U minus its image where the left, right, top or bottom is `no_slip`."""
    u, v = (np.array(faces[..., axis], np.float64) for axis in (0, 1))
    u = np.pad(u[:, 1:], ((PAD, PAD), (0, 0)), mode="symmetric")
    v = np.pad(v[1:], ((0, 0), (PAD, PAD)), mode="symmetric")
    for beyond, sticks, wall in zip((v[:, :PAD], v[:, -PAD:], u[:PAD], u[-PAD:]), no_slip, speed, strict=False):
        if sticks:
            beyond[:] = 2 * wall - beyond
    # The walls' faces are added as zeros, and what is beyond them mirrored with the other sign.
    u = np.pad(np.pad(u, ((0, 0), (1, 1))), ((0, 0), (PAD, PAD)), mode="reflect", reflect_type="odd")
    v = np.pad(np.pad(v, ((1, 1), (0, 0))), ((PAD, PAD), (0, 0)), mode="reflect", reflect_type="odd")
    return u[:, :-1], v[:-1]


def interpolate(values: np.ndarray, x: np.ndarray, y: np.ndarray, order: str) -> np.ndarray:
    """Values at fractional indices (x, y) of an array padded by PAD, linear or cubic both ways."""
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = x - i, y - j
    rows, columns = values.shape
    nodes = (0, 1) if order == "linear" else (-1, 0, 1, 2)
    total = np.zeros_like(x, np.float64)
    for dy in nodes:
        for dx in nodes:
            row = np.clip(j + dy + PAD, 0, rows - 1)
            column = np.clip(i + dx + PAD, 0, columns - 1)
            total += _lagrange(nodes, dx, fx) * _lagrange(nodes, dy, fy) * values[row, column]
    return total


def _lagrange(nodes: tuple[int, ...], k: int, f: np.ndarray) -> np.ndarray:
    weight = np.ones_like(f)
    for other in nodes:
        if other != k:
            weight = weight * (f - other) / (k - other)
    return weight


def velocity_at(padded: tuple[np.ndarray, ...], x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Velocity at (x, y) in cells, each component bilinear between its faces."""
    u, v = padded
    return interpolate(u, x, y - 0.5, "linear"), interpolate(v, x - 0.5, y, "linear")


def trace(faces: Faces, dt_over_h: float, **walls: object) -> np.ndarray:
    """Midpoint backtrace of the cell centres, (ny, nx, 2) in cells; in two halves where the velocity changes by much.

    That is by a cell a step or more on the first half of the way; from half a cell on, some of each.
    """
    ny, nx = faces.shape[:2]
    padded = padded_faces(faces, **walls)  # type: ignore[arg-type]
    centres = np.stack(np.meshgrid(np.arange(nx) + 0.5, np.arange(ny) + 0.5))

    def back(at: np.ndarray, steps: float, velocity: np.ndarray) -> np.ndarray:
        return np.clip(at - steps * dt_over_h * velocity, 0, np.array([nx, ny])[:, None, None])

    def midpoint(at: np.ndarray, steps: float, velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        middle = np.stack(velocity_at(padded, *back(at, steps / 2, velocity)))
        return back(at, steps, middle), middle

    here = np.stack(velocity_at(padded, *centres))
    once, middle = midpoint(centres, 1.0, here)
    halfway, _ = midpoint(centres, 0.5, here)
    twice, _ = midpoint(halfway, 0.5, np.stack(velocity_at(padded, *halfway)))
    change = np.clip(2 * dt_over_h * np.hypot(*(middle - here)) - 1, 0, 1)
    bent = change**2 * (3 - 2 * change)
    return np.moveaxis(once + bent * (twice - once) - centres, 0, -1)


def advect(faces: Faces, dt_over_h: float, added: Faces | float = 0.0, **walls: object) -> np.ndarray:
    """Semi-Lagrangian advection of a MAC velocity, and what is added to it where it departs, by the velocity: cubic.

    Departures of faces are means of the cells'.
    """
    back = trace(faces, dt_over_h, **walls)
    u, v = padded_faces(faces + added, **walls)  # type: ignore[arg-type]
    ny, nx = faces.shape[:2]
    column, row = np.meshgrid(np.arange(nx), np.arange(ny))
    left = np.concatenate([back[:, :1], back[:, :-1]], axis=1)
    above = np.concatenate([back[:1], back[:-1]], axis=0)
    to_u, to_v = 0.5 * (back + left), 0.5 * (back + above)
    result = np.stack(
        [
            interpolate(u, column + to_u[..., 0], row + to_u[..., 1], "cubic"),
            interpolate(v, column + to_v[..., 0], row + to_v[..., 1], "cubic"),
        ],
        axis=-1,
    )
    result[:, 0, 0] = 0
    result[0, :, 1] = 0
    return result


def divergence(faces: Faces, h: float) -> np.ndarray:
    """Divergence of the cells, (ny, nx), far walls closed."""
    u = np.pad(np.asarray(faces[..., 0], np.float64), ((0, 0), (0, 1)))
    v = np.pad(np.asarray(faces[..., 1], np.float64), ((0, 1), (0, 0)))
    return (np.diff(u, axis=1) + np.diff(v, axis=0)) / h


def smooth_velocity(nx: int, ny: int, seed: int, cells: float = 6.0) -> np.ndarray:
    """A random smooth velocity on MAC faces, largest component 1, zero on the near walls."""
    rng = np.random.default_rng(seed)
    faces = np.stack([ndimage.gaussian_filter(rng.standard_normal((ny, nx)), cells) for _ in range(2)], axis=-1)
    faces /= np.abs(faces).max()
    faces[:, 0, 0] = 0
    faces[0, :, 1] = 0
    return faces


# ---------------------------------------------------------------------------------------------------------------------
# The paper's stages
# ---------------------------------------------------------------------------------------------------------------------


def paper_padded(values: np.ndarray, odd: bool = False, axis: int | None = None) -> np.ndarray:
    """One ghost cell around a collocated array; odd across the edges that `axis` is normal to."""
    padded = np.pad(values, 1, mode="edge")
    if odd and axis == 0:
        padded[:, 0], padded[:, -1] = -padded[:, 0], -padded[:, -1]
    if odd and axis == 1:
        padded[0], padded[-1] = -padded[0], -padded[-1]
    return padded


def paper_diffuse_sweep(
    velocity: np.ndarray, before: np.ndarray, viscosity: np.ndarray, dt_over_h2: float
) -> np.ndarray:
    """One Jacobi sweep of Appendix A, mended."""
    u, v = paper_padded(velocity[..., 0], True, 0), paper_padded(velocity[..., 1], True, 1)
    mu = paper_padded(viscosity)

    def around(a: np.ndarray) -> tuple[np.ndarray, ...]:
        return a[1:-1, :-2], a[1:-1, 2:], a[:-2, 1:-1], a[2:, 1:-1]

    ul, ur, ua, ub = around(u)
    vl, vr, va, vb = around(v)
    ml, mr, ma, mb = around(mu)
    k = dt_over_h2 * viscosity
    kx, ky = 0.5 * dt_over_h2 * (mr - ml), 0.5 * dt_over_h2 * (mb - ma)
    shear = ub - ua + vr - vl
    new_u = before[..., 0] + k * (ul + ur + ua + ub) + kx * (ur - ul) + 0.5 * ky * shear
    new_v = before[..., 1] + k * (vl + vr + va + vb) + ky * (vb - va) + 0.5 * kx * shear
    return np.stack([new_u, new_v], axis=-1) / (1 + 4 * k)[..., None]


# -- the warp map ---------------------------------------------------------------------------------------------------


def _nodes(position: np.ndarray, count: int, points: int, support: int) -> tuple[np.ndarray, np.ndarray]:
    """Indices and weights of the Lagrange polynomial on the middle `points` of the `support` texels around a position.

    At the edges the outermost `support` texels are taken.
    """
    first = np.clip(np.floor(position - 0.5).astype(int) - (support // 2 - 1), 0, count - support)
    first += (support - points) // 2
    f = position - 0.5 - first
    value = np.ones((*position.shape, points))
    for i in range(points):
        for j in set(range(points)) - {i}:
            value[..., i] *= (f - j) / (i - j)
    return first[..., None] + np.arange(points), value


def with_images(field: np.ndarray, images: Images) -> np.ndarray:
    """A displacement (ny, nx, 2) with PAD texels more on every side, images of those inside: the component across the
    edge is odd; that along the left, right, top and bottom edge counts as often as `images` says."""
    field = np.pad(field.astype(float), ((PAD, PAD), (PAD, PAD), (0, 0)), mode="symmetric")
    left, right, top, bottom = images
    for beyond, signs in (
        (field[:, :PAD], (-1, left)),
        (field[:, -PAD:], (-1, right)),
        (field[:PAD], (top, -1)),
        (field[-PAD:], (bottom, -1)),
    ):
        beyond *= signs
    return field


def lagrange(
    field: np.ndarray,
    x: np.ndarray,
    y: np.ndarray,
    points: tuple[int, int],
    support: int,
    images: Images | None = None,
) -> np.ndarray:
    """`field` (ny, nx, c) at positions x, y by Lagrange polynomials through `points` texels along x and y.

    With `images`, of (ny, nx, 2) what lies beyond the edges is found by them.
    """
    if images:
        return lagrange(with_images(field, images), np.asarray(x) + PAD, np.asarray(y) + PAD, points, support)
    x, y, (ny, nx) = np.asarray(x, float), np.asarray(y, float), field.shape[:2]
    columns, wx = _nodes(x, nx, points[0], support)
    rows, wy = _nodes(y, ny, points[1], support)
    values = field.astype(float)[rows[..., :, None], columns[..., None, :]]
    return np.einsum("...j,...i,...jic->...c", wy, wx, values)


def cubic_displacement(field: np.ndarray, x: np.ndarray, y: np.ndarray, images: Images | None = None) -> np.ndarray:
    """The Boolean sum of the cubic along x and the cubic along y."""
    along_x, along_y, linear = (lagrange(field, x, y, points, 4, images) for points in ((4, 2), (2, 4), (2, 2)))
    return along_x + along_y - linear


THROWN_BACK = 0.184  # of the fourth differences on the second (Comrie): within .0005 of them of Everett's sixth order


def _second(field: np.ndarray) -> np.ndarray:
    """Second differences along the first axis; at its ends those of the cubic through the next four."""
    inner = np.diff(field, n=2, axis=0)
    return np.concatenate([2 * inner[:1] - inner[1:2], inner, 2 * inner[-1:] - inner[-2:-1]])


def _modified(field: np.ndarray) -> np.ndarray:
    """The same with a part of the fourth differences, where there are five values."""
    second = _second(field)
    second[2:-2] -= THROWN_BACK * np.diff(field, n=4, axis=0)
    return second


def bent_displacement(field: np.ndarray, x: np.ndarray, y: np.ndarray, images: Images | None = None) -> np.ndarray:
    """Everett's formula up to modified second differences, along x, along y, and along both."""
    if images:
        return bent_displacement(with_images(field, images), np.asarray(x) + PAD, np.asarray(y) + PAD)
    values, (ny, nx) = field.astype(float), field.shape[:2]
    along_x, along_y = _modified(values.swapaxes(0, 1)).swapaxes(0, 1), _modified(values)
    both = np.pad(np.diff(np.diff(values, n=2, axis=0), n=2, axis=1), ((1, 1), (1, 1), (0, 0)), "edge")
    column, row = (np.clip(np.floor(at - 0.5), 0, n - 2).astype(int) for at, n in ((x, nx), (y, ny)))
    fx, fy, total = (x - 0.5 - column)[..., None], (y - 0.5 - row)[..., None], np.zeros((*np.shape(x), 2))
    for j, wy in enumerate((1 - fy, fy)):
        for i, wx in enumerate((1 - fx, fx)):
            at, ex, ey = (row + j, column + i), (wx**3 - wx) / 6, (wy**3 - wy) / 6
            total += wx * wy * values[at] + ex * wy * along_x[at] + wx * ey * along_y[at] + ex * ey * both[at]
    return total


def texel_centres(size: tuple[int, int], texels: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Positions of the centres of a `size` lattice in the texels of another one over the same domain."""
    x = (np.arange(size[0]) + 0.5) * texels[0] / size[0]
    y = (np.arange(size[1]) + 0.5) * texels[1] / size[1]
    return tuple(np.meshgrid(x, y))  # pyright: ignore[reportReturnType]


def advance_map(submap: np.ndarray, trace: np.ndarray, h: float, images: Images = (1, 1, 1, 1)) -> np.ndarray:
    """submap'(x) = (x_d - x) + submap(x_d), with x_d - x = `trace` in cells, no place outside the picture."""
    ny, nx = submap.shape[:2]
    x, y = texel_centres((nx, ny), (nx, ny))
    moved = trace + cubic_displacement(submap, x + trace[..., 0], y + trace[..., 1], images) / h
    return h * np.stack([np.clip(moved[..., 0], -x, nx - x), np.clip(moved[..., 1], -y, ny - y)], axis=-1)


def compose_map(
    submap: np.ndarray,
    accumulated: np.ndarray,
    extent: tuple[float, float],
    size: tuple[int, int],
    limits: tuple[float, float, float, float],
) -> np.ndarray:
    """submap(x) + accumulated(x + submap(x)) at the centres of a `size` lattice, the first place kept in the picture
    and the second within `limits` (left, top, right, bottom), of a map that was given."""
    x, y = texel_centres(size, (1, 1))
    x, y = x * extent[0], y * extent[1]
    moved = bent_displacement(submap, *texel_centres(size, submap.shape[1::-1]))
    there_x, there_y = np.clip(x + moved[..., 0], 0, extent[0]), np.clip(y + moved[..., 1], 0, extent[1])
    width, height = accumulated.shape[1::-1]
    further = lagrange(accumulated, there_x / extent[0] * width, there_y / extent[1] * height, (6, 6), 6)
    left, top, right, bottom = limits
    there_x, there_y = np.clip(there_x + further[..., 0], left, right), np.clip(there_y + further[..., 1], top, bottom)
    return np.stack([there_x - x, there_y - y], axis=-1)


def follow(
    velocity: Callable[[np.ndarray, np.ndarray, float], tuple[np.ndarray, np.ndarray]],
    x: np.ndarray,
    y: np.ndarray,
    start: float,
    end: float,
    steps: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Where particles at (x, y) at time `start` are at `end`: classical Runge-Kutta."""
    dt = (end - start) / steps
    for step in range(steps):
        t = start + step * dt
        u1, v1 = velocity(x, y, t)
        u2, v2 = velocity(x + dt / 2 * u1, y + dt / 2 * v1, t + dt / 2)
        u3, v3 = velocity(x + dt / 2 * u2, y + dt / 2 * v2, t + dt / 2)
        u4, v4 = velocity(x + dt * u3, y + dt * v3, t + dt)
        x, y = x + dt / 6 * (u1 + 2 * u2 + 2 * u3 + u4), y + dt / 6 * (v1 + 2 * v2 + 2 * v3 + v4)
    return x, y


# ---------------------------------------------------------------------------------------------------------------------
# The viscous step
# ---------------------------------------------------------------------------------------------------------------------


def viscous_system(
    viscosity: np.ndarray,
    dt: float,
    h: float | tuple[float, float],
    solid: np.ndarray | None = None,
    no_slip: tuple[bool, ...] = (False,) * 5,
    speed: tuple[float, ...] = (0, 0, 0, 0),
) -> tuple[sparse.csc_matrix, np.ndarray, np.ndarray]:
    """(I - dt div mu (grad + grad^T)) on MAC faces as a sparse matrix over (u, v) of (ny, nx) each; what moving walls
    (left, right, top, bottom) add to the right-hand side; and which faces are free, the others being zero.
    `h` is the side of a cell, or (hx, hy); `no_slip` is said of the same walls, and of solid cells."""
    ny, nx = viscosity.shape
    hx, hy = h if isinstance(h, tuple) else (h, h)
    fluid = np.pad(~(np.zeros((ny, nx), bool) if solid is None else np.asarray(solid, bool)), 1)
    mu = np.pad(np.asarray(viscosity, np.float64), 1)
    count = nx * ny
    # Numbers of the faces with a frame around them; pinned ones have none.
    u, v = np.full((2, ny + 2, nx + 2), -1)
    u[1:-1, 1:-1] = np.where(fluid[1:-1, 1:-1] & fluid[1:-1, :-2], np.arange(count).reshape(ny, nx), -1)
    v[1:-1, 1:-1] = np.where(fluid[1:-1, 1:-1] & fluid[:-2, 1:-1], np.arange(count).reshape(ny, nx) + count, -1)

    def rates(wanted: np.ndarray, *terms: tuple[np.ndarray, float]) -> sparse.csr_matrix:
        """A row for each wanted place: the sum of its faces, each by its weight."""
        faces = np.stack([numbers[wanted] for numbers, _ in terms], axis=-1)
        weights = np.broadcast_to([weight for _, weight in terms], faces.shape)
        rows = np.broadcast_to(np.arange(len(faces))[:, None], faces.shape)
        free = faces >= 0
        return sparse.csr_matrix((weights[free], (rows[free], faces[free])), (len(faces), 2 * count))

    cells = fluid[1:-1, 1:-1]
    inner, right, below = np.s_[1:-1, 1:-1], np.s_[1:-1, 2:], np.s_[2:, 1:-1]
    stretches = [
        rates(cells, (u[right], 1 / hx), (u[inner], -1 / hx)),
        rates(cells, (v[below], 1 / hy), (v[inner], -1 / hy)),
    ]
    # The nodes, at the corners of the cells: how many fluid cells are around, and which walls they lie on.
    corners = [np.s_[:-1, :-1], np.s_[:-1, 1:], np.s_[1:, :-1], np.s_[1:, 1:]]
    wet = np.sum([fluid[corner] for corner in corners], axis=0)
    resistance = np.sum([fluid[corner] / np.where(fluid[corner], mu[corner], 1.0) for corner in corners], axis=0)
    on = np.zeros((4, ny + 1, nx + 1), bool)  # left, right, top, bottom
    on[0, :, 0] = on[1, :, -1] = on[2, 0] = on[3, -1] = True
    sticks = np.where(on.any(axis=0), (on & np.array(no_slip[:4])[:, None, None]).any(axis=0), no_slip[4])
    sheared = (wet == 4) | (wet > 0) & sticks
    here, above, left = np.s_[1:, 1:], np.s_[:-1, 1:], np.s_[1:, :-1]
    shear = rates(sheared, (u[here], 1 / hy), (u[above], -1 / hy), (v[here], 1 / hx), (v[left], -1 / hx))
    # A flat wall: the velocity beyond it is 2 U minus the one inside, so the strain is twice what it is with a resting
    # face there, and half the energy belongs to the fluid's side.
    flat = wet[sheared] == 2
    node = wet[sheared] / resistance[sheared] * np.where(flat, 2, 1)
    pulls = np.array([-speed[0] / hx, speed[1] / hx, -speed[2] / hy, speed[3] / hy])
    moving = np.where(flat, np.tensordot(pulls, on, 1)[sheared], 0.0)
    strain_of = sparse.vstack([*stretches, shear])
    stiffness = np.concatenate([2 * mu[inner][cells], 2 * mu[inner][cells], node])
    wall_strain = np.concatenate([np.zeros(2 * np.count_nonzero(cells)), moving])
    weighted = strain_of.T @ sparse.diags(stiffness * dt)
    matrix = sparse.identity(2 * count) + weighted @ strain_of
    free = np.isin(np.arange(2 * count), np.concatenate([u, v]))
    return sparse.csc_matrix(matrix), -(weighted @ wall_strain), free


def viscous_step(
    faces: Faces, viscosity: np.ndarray, dt: float, h: float | tuple[float, float], **walls: object
) -> Faces:
    """The exact implicit viscous step of (ny, nx, 2) velocities on MAC faces."""
    matrix, added, free = viscous_system(viscosity, dt, h, **walls)  # pyright: ignore[reportArgumentType]
    right = np.where(free, np.moveaxis(np.asarray(faces, np.float64), -1, 0).ravel() + added, 0.0)
    # It is symmetric and positive definite, so no pivoting is needed: half the time and memory.
    factors = sparse_linalg.splu(matrix, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    solution = factors.solve(right)
    return np.moveaxis(solution.reshape(2, *viscosity.shape), 0, -1)

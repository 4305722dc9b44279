"""The viscous operator A = I + B' K B and its Galerkin coarse operators, as coefficients of strains.

B takes differences: e_xx and e_yy in the cells, the shear s_y du + s_x dv at the nodes. K holds 2 dt mu / h^2 in the
cells and dt mu / h^2 at the nodes. A coarse velocity that is interpolated has strains that are half an interpolation S
of the coarse strains, so that P' A P keeps the form: K_coarse = S' K S / 16 (with the restriction P' / 4), a small
stencil of couplings between strains of one kind. The identity is lumped. See README.md, "The viscous step".
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from solver.gl.device import Device
from solver.gl.passes import Region
from solver.packing import DoublePackedFaces, PackedFaces, framed, packed
from solver.params import NoSlip
from solver.viscosity.changed import Box, whole

# Texels (of 2 x 2 cells) of the coarsest level, whose inverse matrix is at hand: 64 unknowns. BLAS inverts 128 in
# threads, which wait longer than they work.
COARSEST = 8
# Couplings of a strain with the next ones, (rows, columns) further; those backwards follow by symmetry.
CELL_STENCIL = (0, 1, 2)
NODE_STENCIL = ((0, 0), (0, 1), (1, 0), (1, 1), (1, -1))
# So that a cell of no viscosity is still told from no fluid.
LEAST = 1e-20
# Cells around a box that its K, in the cells and at their corners, is made from: on the finest level, and coarse ones.
FINE_HALO = 2
COARSE_HALO = 3


@dataclass(frozen=True)
class Coefficients:
    """One level's K, cell by cell; `rows x columns` are even, cells beyond the grid hold no fluid.

    Attributes:
        xx: couplings of e_xx with e_xx 0, 1, 2 rows further, each (rows, columns).
        yy: couplings of e_yy with e_yy 0, 1, 2 columns further.
        nodes: couplings of shears by `NODE_STENCIL`, each (rows + 1, columns + 1).
        open_u, open_v: which faces move, (rows, columns).
        shear: (s_y, s_x), weights of du and dv in the shear: (1, 1) where cells are square.
    """

    xx: tuple[np.ndarray, ...]
    yy: tuple[np.ndarray, ...]
    nodes: dict[tuple[int, int], np.ndarray]
    open_u: np.ndarray
    open_v: np.ndarray
    shear: tuple[float, float]

    def part(self, box: Box) -> Coefficients:
        """K in a box only."""
        return Coefficients(
            tuple(k[box.cells] for k in self.xx),
            tuple(k[box.cells] for k in self.yy),
            {offset: k[box.nodes] for offset, k in self.nodes.items()},
            self.open_u[box.cells],
            self.open_v[box.cells],
            self.shear,
        )

    def put(self, box: Box, part: Coefficients, window: Box) -> None:
        """Take over K in a box from a `part` that was made for a larger `window`; open faces stay."""
        inner = box.within(window)
        for mine, other in zip(self.xx + self.yy, part.xx + part.yy, strict=True):
            mine[box.cells] = other[inner.cells]
        for offset, k in self.nodes.items():
            k[box.nodes] = part.nodes[offset][inner.nodes]

    def diagonal(self) -> tuple[np.ndarray, np.ndarray]:
        """The diagonal of A for u and for v."""
        (s_y, s_x), n = self.shear, self.nodes
        u = 1.0 + self.xx[0] + _behind(self.xx[0], 1) + s_y**2 * (n[0, 0][:-1, :-1] + n[0, 0][1:, :-1])
        v = 1.0 + self.yy[0] + _behind(self.yy[0], 0) + s_x**2 * (n[0, 0][:-1, :-1] + n[0, 0][:-1, 1:])
        if (1, 0) in n:
            u -= 2.0 * s_y**2 * n[1, 0][:-1, :-1]
            v -= 2.0 * s_x**2 * n[0, 1][:-1, :-1]
        return u, v

    def matrix(self) -> np.ndarray:
        """A as a dense matrix over all u, row after row, and then all v; the identity for fixed faces."""
        rows, columns = self.open_u.shape
        count = rows * columns
        moving = np.concatenate([self.open_u.ravel(), self.open_v.ravel()])
        faces = np.diag(moving.astype(float)).reshape(-1, 2, rows, columns)
        u, v = (np.pad(faces[:, axis], ((0, 0), (1, 1), (1, 1))) for axis in (0, 1))
        s_y, s_x = self.shear
        strains = (
            (_dense(dict(zip(((0, 0), (1, 0), (2, 0)), self.xx, strict=False))), np.diff(u, axis=2)[:, 1:-1, 1:]),
            (_dense(dict(zip(((0, 0), (0, 1), (0, 2)), self.yy, strict=False))), np.diff(v, axis=1)[:, 1:, 1:-1]),
            (_dense(self.nodes), s_y * np.diff(u, axis=1)[:, :, 1:] + s_x * np.diff(v, axis=2)[:, 1:, :]),
        )
        matrix = np.eye(2 * count)
        for stiffness, strain in strains:
            flat = strain.reshape(2 * count, -1)
            matrix += flat @ stiffness @ flat.T
        return matrix


def coefficients(
    viscosity: np.ndarray,
    solid: np.ndarray,
    dt: float,
    spacing: tuple[float, float],
    no_slip: NoSlip,
    box: tuple[int, int] | None = None,
) -> Coefficients:
    """K on the finest level from the viscosity of the cells, lengths^2 / s, (ny, nx), and the solid ones.

    `box`: (nx, ny) of the cells between the walls, if they are not all.

    mu at a node is the harmonic mean of the fluid cells that meet there. A wall node's shear is nil at free-slip walls;
    at no-slip ones a face beyond it stands still at the node, half a cell away, which doubles K; at a convex corner the
    resting face is a whole cell away, and K stays.
    """
    (rows, columns), ring = viscosity.shape, ((1, 1), (1, 1))
    even = (0, rows % 2), (0, columns % 2)
    fluid = framed(~solid, *even)
    amount = np.maximum(framed(viscosity.astype(np.float64) * dt, *even), LEAST) * fluid
    wet = framed(fluid, *ring)
    resistance = framed(np.divide(1.0, amount, out=np.zeros_like(amount), where=fluid), *ring)
    meeting = _corners(wet.astype(np.float64))
    node = np.divide(meeting, _corners(resistance), out=np.zeros_like(meeting), where=meeting > 0)
    open_u, open_v = wet[:, 1:] & wet[:, :-1], wet[1:] & wet[:-1]
    moving = open_u[1:].astype(int) + open_u[:-1] + open_v[:, 1:] + open_v[:, :-1]
    sticks = _where_it_sticks(no_slip, node.shape, box or (columns, rows))
    node *= np.where(sticks, np.where(moving < 2, 2.0, 1.0), moving == 4)
    hx, hy = spacing
    return Coefficients(
        (2.0 / hx**2 * amount,),
        (2.0 / hy**2 * amount,),
        {(0, 0): node / (hx * hy)},
        open_u[1:-1, :-1],
        open_v[:-1, 1:-1],
        (float(np.sqrt(hx / hy)), float(np.sqrt(hy / hx))),
    )


def coarsened(fine: Coefficients, no_slip: NoSlip, box: tuple[int, int], at: tuple[int, int] = (0, 0)) -> Coefficients:
    """K of the next coarser level: S' K S / 16; `box`: (nx, ny) of its cells between the walls; `at`: its first one.

    A coarse face is open if all the fine faces beside it are, so a correction never pushes through a wall.
    """
    rows, columns = (length // 2 for length in fine.open_u.shape)
    even = (0, rows % 2), (0, columns % 2)
    u = fine.open_u[::2] & fine.open_u[1::2]
    v = fine.open_v[:, ::2] & fine.open_v[:, 1::2]
    open_u = u[:, ::2] & u[:, 1::2] & _behind(u, 1)[:, ::2]
    open_v = v[::2] & v[1::2] & _behind(v, 0)[::2]
    below = np.arange(rows)[:, None] + at[1] >= box[1]
    behind = np.arange(columns) + at[0] >= box[0]
    moves_x = (open_u | _ahead(open_u, 1)) | np.where(below, no_slip.bottom, no_slip.solids)
    moves_y = (open_v | _ahead(open_v, 0)) | np.where(behind, no_slip.right, no_slip.solids)
    xx = _coarsened_cells([k[:, ::2] + k[:, 1::2] for k in fine.xx], moves_x)
    yy = [k.T for k in _coarsened_cells([k[::2].T + k[1::2].T for k in fine.yy], moves_y.T)]
    nodes = _coarsened_nodes(fine.nodes)
    if not all(no_slip):
        full_u, full_v = (framed(faces, (1, 1), (1, 1)) for faces in (open_u, open_v))
        moving = full_u[1:, 1:] & full_u[:-1, 1:] & full_v[1:, 1:] & full_v[1:, :-1]
        moving |= _where_it_sticks(no_slip, moving.shape, box, at)
        around = framed(moving, (1, 1), (1, 1))
        for (down, right), k in nodes.items():
            k *= moving & around[1 + down :, 1 + right :][: rows + 1, : columns + 1]
    return Coefficients(
        tuple(framed(k, *even) for k in xx),
        tuple(framed(k, *even) for k in yy),
        {offset: framed(k, *even) for offset, k in nodes.items()},
        framed(open_u, *even),
        framed(open_v, *even),
        fine.shear,
    )


def change_finest(
    level: Coefficients, box: Box, viscosity: np.ndarray, solid: np.ndarray, dt: float, spacing: tuple[float, float],
    no_slip: NoSlip,
) -> None:  # fmt: skip
    """Make K of the finest `level` that of another viscosity, which differs in a box; bit for bit what all is."""
    window = box.grown(FINE_HALO, level.open_u.shape)
    level.put(box, coefficients(viscosity[window.cells], solid[window.cells], dt, spacing, no_slip), window)


def change_coarse(level: Coefficients, box: Box, fine: Coefficients, no_slip: NoSlip, between: tuple[int, int]) -> None:
    """Make K of a coarse `level` that of the `fine` one, which has changed it in a box; bit for bit what all is.

    `between`: (nx, ny) of its cells between the walls.
    """
    window = box.grown(COARSE_HALO, level.open_u.shape)
    level.put(box, coarsened(fine.part(window.finer), no_slip, between, (window.left, window.top)), window)


def _where_it_sticks(
    no_slip: NoSlip, shape: tuple[int, ...], box: tuple[int, int], at: tuple[int, int] = (0, 0)
) -> np.ndarray:
    """Whether the fluid sticks to a wall at the nodes of cells from `at` on, `box` of them between the grid's sides."""
    rows, columns = np.arange(shape[0])[:, None] + at[1], np.arange(shape[1]) + at[0]
    sticks = np.full(shape, no_slip.solids)
    sides = columns <= 0, columns >= box[0], rows <= 0, rows >= box[1]
    for side, holds in zip(sides, no_slip, strict=False):
        sticks = np.where(side, holds, sticks)
    return sticks


def _behind(values: np.ndarray, axis: int) -> np.ndarray:
    """The values one place back along an axis, zero at the first."""
    shifted = np.zeros_like(values)
    if axis == 0:
        shifted[1:] = values[:-1]
    else:
        shifted[:, 1:] = values[:, :-1]
    return shifted


def _ahead(values: np.ndarray, axis: int) -> np.ndarray:
    """The values one place further along an axis, zero at the last."""
    return _behind(values[::-1, ::-1], axis)[::-1, ::-1]


def _corners(cells: np.ndarray) -> np.ndarray:
    """Sums over the four cells that meet at the nodes of cells with a frame around them."""
    return cells[1:, 1:] + cells[:-1, 1:] + cells[1:, :-1] + cells[:-1, :-1]


def _dense(stencil: dict[tuple[int, int], np.ndarray]) -> np.ndarray:
    """The symmetric matrix of couplings with the places (rows, columns) further."""
    shape = stencil[0, 0].shape
    matrix = np.zeros((*shape, *shape))
    for (down, right), k in stencil.items():
        for j, i in product(range(shape[0]), range(shape[1])):
            if j + down < shape[0] and 0 <= i + right < shape[1]:
                matrix[j, i, j + down, i + right] = matrix[j + down, i + right, j, i] = k[j, i]
    return matrix.reshape(k.size, k.size)


def _coarsened_cells(fine: list[np.ndarray], live: np.ndarray) -> list[np.ndarray]:
    """S' K S / 16 down the rows: a row counts 3/4 to the coarse row it lies in and 1/4 to the nearest other one.

    Where one of the two does not move (not `live`) the other counts whole.
    """
    rows = len(live)
    above, below = _behind(live, 0), _ahead(live, 0)
    # Weights of the four rows around a coarse row, by their places from its first one on; none beyond the last.
    places = ((-1, above, 0.25), (0, above, 0.75), (1, below, 0.75), (2, below, 0.25))
    weights = {place: framed(np.where(other, part, 1.0), (0, 2), (0, 0)) for place, other, part in places}
    around = [framed(k, (4, 6), (0, 0)) for k in fine]
    found = []
    for apart in CELL_STENCIL:
        total = np.zeros(live.shape)
        for place, step in product(weights, range(1 - len(fine), len(fine))):
            partner = place + step - 2 * apart
            if partner in weights:
                first = 4 + place + min(step, 0)
                stiffness = around[abs(step)][first : first + 2 * rows : 2]
                total += weights[place][:rows] * weights[partner][apart : apart + rows] * stiffness
        found.append(total / 16.0)
    return found


def _coarsened_nodes(fine: dict[tuple[int, int], np.ndarray]) -> dict[tuple[int, int], np.ndarray]:
    """S' K S / 16 at the nodes, S linear both ways: first along the rows, then down the columns."""
    weights = {-1: 0.5, 0: 1.0, 1: 0.5}
    rows, columns = (length // 2 + 1 for length in fine[0, 0].shape)
    whole = {offset: framed(k, (2, 2), (2, 2)) for offset, k in fine.items()}
    for (down, right), k in list(whole.items()):
        whole[-down, -right] = np.roll(k, (down, right), (0, 1))
    across: dict[tuple[int, int], Any] = {}
    for (down, right), k in whole.items():
        for place, apart in product(weights, (-1, 0, 1)):
            partner = place + right - 2 * apart
            if partner in weights:
                term = weights[place] * weights[partner] * k[:, 2 + place :: 2][:, :columns]
                across[down, apart] = across.get((down, apart), 0.0) + term
    found: dict[tuple[int, int], np.ndarray] = {}
    for apart_down, apart_right in NODE_STENCIL:
        total = np.zeros((rows, columns))
        for (down, right), k in across.items():
            for place in weights if right == apart_right else ():
                partner = place + down - 2 * apart_down
                if partner in weights:
                    total += weights[place] * weights[partner] * k[2 + place :: 2][:rows]
        found[apart_down, apart_right] = total / 16.0
    return found


class Level:
    """One level: its operator, its right-hand side and its iterate, as packed faces.

    Args:
        device: where it lives.
        size: (nx, ny) in cells of the level.
        depth: 0 is the finest.
        finest: (nx, ny) of the finest.
    """

    def __init__(self, device: Device, size: tuple[int, int], depth: int, finest: tuple[int, int]) -> None:
        self.size = size
        self.depth = depth
        self.texels = -(-size[0] // 2), -(-size[1] // 2)
        self.region: Region = (1, 1, *self.texels)
        ringed = self.texels[0] + 2, self.texels[1] + 2
        label = f"viscous level {depth}"
        names = ["inverse_u", "inverse_v"]
        if depth == 0:
            names += ["cells", "nodes"]
        else:
            names += [f"{kind}{apart}" for kind in ("xx", "yy") for apart in CELL_STENCIL]
            names += [f"node{number}" for number in range(len(NODE_STENCIL))]
        self.packed = {name: device.field(ringed, 4, f"{label} {name}") for name in names}
        self.packed["open"] = device.field(ringed, 4, f"{label} open", "f1")
        self.stress = [device.field(ringed, 4, f"{label} stress {name}") for name in ("xx", "yy", "xy") if depth]
        self.rhs = PackedFaces(device, ringed, f"{label} right-hand side")
        self.faces = DoublePackedFaces(device, ringed, f"{label} faces")
        # Without solids, what walls leave of a grid whose last column or row is only half in it, at least a channel.
        self.box = max(finest[0] >> depth, 1), max(finest[1] >> depth, 1)
        # What passes read: the operator, what stress.frag multiplies with, open faces, and where the fluid sticks.
        self.operator: dict[str, Any] = {}
        self.stencil: dict[str, Any] = {}
        self.open: dict[str, Any] = {}
        self.walls: dict[str, Any] = {}
        self.defines: dict[str, Any] = {}

    def set_coefficients(self, level: Coefficients, no_slip: NoSlip, box: Box | None = None) -> None:
        """Take the operator from coefficients of each cell, of which only those in a box are others, if it is given."""
        box = box or whole(level.open_u.shape)
        # Faces next to the box feel its strains; one texel more is there to be read only.
        window = box.grown(1 + 2, level.open_u.shape)
        self._upload(level.part(window), window)
        self.open = {"open": self.packed["open"]}
        names = ("inverse_u", "inverse_v", "open") + (() if self.depth else ("cells", "nodes"))
        self.operator = {**{name: self.packed[name] for name in names}, "shear": level.shear}
        self._take_walls({"COARSE": 1} if self.depth else {}, no_slip)
        if self.depth:
            self.stencil = {name: field for name, field in self.packed.items() if name not in names}
            self.stencil["shear"] = level.shear
            self.operator |= dict(zip(("stress_xx", "stress_yy", "stress_xy"), self.stress, strict=True))
        else:
            # K of e_yy over that of e_xx, (hx / hy)^2.
            self.operator["aspect"] = level.shear[0] ** 4

    def _upload(self, part: Coefficients, window: Box) -> None:
        """Write K of a window; its first cells are there to be read only, unless the level begins there."""
        of_u, of_v = part.diagonal()
        values = {"inverse_u": part.open_u / of_u, "inverse_v": part.open_v / of_v}
        node = part.nodes[0, 0]
        if self.depth == 0:
            # Signs tell which faces are open where these are read anyway; a node that resists nothing has one too.
            values["cells"] = np.where(part.open_u, part.xx[0], -part.xx[0])
            sign = framed(np.where(part.open_v, 2.0, 0.0), (0, 1), (0, 1)) - 1.0
            sign[-1] = sign[:, -1] = 1.0
            values["nodes"] = sign * np.maximum(node, 1e-30)
        else:
            values |= {f"{kind}{d}": k for kind in ("xx", "yy") for d, k in enumerate(getattr(part, kind))}
            values |= {f"node{number}": part.nodes[offset] for number, offset in enumerate(NODE_STENCIL)}
        written: dict[str, np.ndarray] = {name: cells.astype(np.float32) for name, cells in values.items()}
        written["open"] = (part.open_u + 2 * part.open_v).astype(np.uint8)
        inside = window.texels
        left, top = int(inside.left > 0), int(inside.top > 0)
        # Nodes on the far walls lie in the ring itself.
        columns = slice(left, inside.right - inside.left + (inside.right == self.texels[0]))
        rows = slice(top, inside.bottom - inside.top + (inside.bottom == self.texels[1]))
        at = 1 + inside.left + left, 1 + inside.top + top
        for name, cells in written.items():
            height, width = cells.shape
            texels = packed(framed(cells, (0, 2 - height % 2), (0, 2 - width % 2)))[rows, columns]
            # Without the check of `set`: K is finite where the viscosity is.
            viewport = (*at, texels.shape[1], texels.shape[0])
            self.packed[name].texture.write(np.ascontiguousarray(texels), viewport)

    def set_uniform(self, stiffness: float, shear: tuple[float, float], no_slip: NoSlip) -> None:
        """Take the operator of one viscosity in a box without solids, dt mu / (hx hy) of this level."""
        self.open, self.stencil = {"box": self.box}, {}
        self.operator = {"stiffness": stiffness, "shear": shear, **self.open}
        self._take_walls({"UNIFORM": 1}, no_slip)

    def _take_walls(self, defines: dict[str, Any], no_slip: NoSlip) -> None:
        self.defines, self.walls = defines, {}
        if any(no_slip):
            self.defines = {**defines, "NO_SLIP": 1}
            self.walls = {"no_slip": tuple(map(float, no_slip[:4])), "solids_no_slip": float(no_slip.solids)}
            self.operator |= self.walls | {"box": self.box}

    @property
    def bounds(self) -> dict[str, Any]:
        """What a pass reads that asks which faces are open, and where the fluid sticks."""
        return {**self.open, **self.walls, "box": self.box}

    @property
    def is_coarsest(self) -> bool:
        return self.texels[0] * self.texels[1] <= COARSEST

    @property
    def nbytes(self) -> int:
        """Bytes of texture memory."""
        pairs = [*self.rhs.fields, *self.faces.read.fields, *self.faces.write.fields]
        return sum(field.nbytes for field in (*self.packed.values(), *self.stress, *pairs))

    def release(self) -> None:
        for item in (*self.packed.values(), *self.stress, self.rhs, self.faces):
            item.release()


def inverse_matrix(level: Coefficients) -> np.ndarray:
    """A^-1 for `shaders/viscosity/direct_solve.frag`, (unknowns, unknowns / 4, 4), zero for fixed faces."""
    count = 2 * level.open_u.size
    moving = np.concatenate([level.open_u.ravel(), level.open_v.ravel()])
    inverse = np.linalg.inv(level.matrix()) * moving * moving[:, None]
    # In the order of the texture: texel after texel, all u before all v.
    numbers = np.arange(count).reshape(2, *level.open_u.shape)
    order = np.concatenate([packed(part).ravel() for part in numbers])
    return inverse[order[:, None], order].reshape(count, count // 4, 4)

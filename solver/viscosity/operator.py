"""The viscous operator A = I + B' K B (V3) and its Galerkin coarse operators (V4), as coefficients of strains.

B takes differences: e_xx and e_yy in the cells, the shear s_y du + s_x dv at the nodes. K holds 2 dt mu / h^2 in the
cells and dt mu / h^2 at the nodes. A coarse velocity that is interpolated has strains that are half an interpolation S
of the coarse strains, so that P' A P keeps the form: K_coarse = S' K S / 16 (with the restriction P' / 4), a small
stencil of couplings between strains of one kind. The identity is lumped. See README.md, "The viscous step".
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.passes import Region
from solver.packing import DoublePackedFaces, PackedFaces, packed, unpacked
from solver.params import NoSlip
from solver.viscosity.box import Box

# Texels (of 2 x 2 cells) of the coarsest level, which has a dense inverse: 96 unknowns. BLAS inverts 128 in threads,
# which wait longer than they work.
COARSEST = 12
# Couplings of a strain with the next ones, (rows, columns) further; those backwards follow by symmetry.
ROW_STENCIL = (0, 0), (1, 0), (2, 0)
COLUMN_STENCIL = (0, 0), (0, 1), (0, 2)
NODE_STENCIL = (0, 0), (0, 1), (1, 0), (1, 1), (1, -1)
# The textures of these.
CELLS = tuple(f"{kind}{number}" for kind in ("xx", "yy") for number in range(3))
NODES = tuple(f"node{number}" for number in range(5))

Stencil = dict[tuple[int, int], np.ndarray]


@dataclass(frozen=True)
class Coefficients:
    """K of one level; `rows x columns` are even, cells beyond the grid hold no fluid.

    Attributes:
        xx: couplings of e_xx by `ROW_STENCIL`, each (rows, columns); on the finest level the first only.
        yy: couplings of e_yy by `COLUMN_STENCIL`.
        nodes: couplings of shears by `NODE_STENCIL`, each (rows + 1, columns + 1).
        open_u, open_v: which faces move, (rows, columns).
        shear: (s_y, s_x), weights of du and dv in the shear: (1, 1) where cells are square.
    """

    xx: Stencil
    yy: Stencil
    nodes: Stencil
    open_u: np.ndarray
    open_v: np.ndarray
    shear: tuple[float, float]

    @classmethod
    def uniform(
        cls,
        stiffness: float,
        box: tuple[int, int],
        texels: tuple[int, int],
        shear: tuple[float, float],
        no_slip: NoSlip,
    ) -> Coefficients:
        """Those of one viscosity, dt mu / (hx hy), in a box of (columns, rows) without solids."""
        (width, height), (columns, rows), (s_y, s_x) = box, texels, shear
        across, down = np.arange(2 * columns + 1), np.arange(2 * rows + 1)[:, None]
        fluid = ((across < width) & (down < height))[:-1, :-1]
        nodes = 1.0 * ((across <= width) & (down <= height))
        for side, sticks in zip((across == 0, across == width, down == 0, down == height), no_slip, strict=False):
            nodes[np.broadcast_to(side, nodes.shape)] *= 2.0 * sticks
        return cls(
            {(0, 0): 2.0 * s_x**2 * stiffness * fluid},
            {(0, 0): 2.0 * s_y**2 * stiffness * fluid},
            {(0, 0): stiffness * nodes},
            fluid & (across[:-1] > 0),
            fluid & (down[:-1] > 0),
            shear,
        )

    def matrix(self) -> np.ndarray:
        """A as a dense matrix over all u, row after row, and then all v; the identity for fixed faces."""
        rows, columns = self.open_u.shape
        count = 2 * rows * columns
        moving = np.concatenate([self.open_u.ravel(), self.open_v.ravel()])
        faces = np.diag(moving.astype(float)).reshape(count, 2, rows, columns)
        # The strains of each face by itself.
        u, v = np.zeros((2, count, rows + 2, columns + 2))
        u[:, 1:-1, 1:-1], v[:, 1:-1, 1:-1] = faces[:, 0], faces[:, 1]
        s_y, s_x = self.shear
        shears = s_y * (u[:, 1:, 1:] - u[:, :-1, 1:]) + s_x * (v[:, 1:, 1:] - v[:, 1:, :-1])
        kinds = (
            (self.xx, u[:, 1:-1, 2:] - u[:, 1:-1, 1:-1]),
            (self.yy, v[:, 2:, 1:-1] - v[:, 1:-1, 1:-1]),
            (self.nodes, shears),
        )
        matrix = np.eye(count)
        for stencil, strain in kinds:
            height, width = strain.shape[1:]
            stress = np.zeros_like(strain)
            for (down, right), k in stencil.items():
                here = slice(0, height - down), slice(max(-right, 0), width - max(right, 0))
                there = slice(down, height), slice(max(right, 0), width + min(right, 0))
                stress[:, *here] += k[here] * strain[:, *there]
                if down or right:
                    stress[:, *there] += k[here] * strain[:, *here]
            matrix += strain.reshape(count, -1) @ stress.reshape(count, -1).T
        return matrix


class Level:
    """One level: its operator, its right-hand side, its iterate and the residual of that, as packed faces.

    Args:
        device: where it lives.
        size: (nx, ny) in cells of the level.
        depth: 0 is the finest.
        finest: (nx, ny) of the finest.

    Attributes:
        shear: (s_y, s_x), see `Coefficients`; of square cells, until it is set.
    """

    def __init__(self, device: Device, size: tuple[int, int], depth: int, finest: tuple[int, int]) -> None:
        self.device = device
        self.shear = 1.0, 1.0
        self.size = size
        self.depth = depth
        self.texels = -(-size[0] // 2), -(-size[1] // 2)
        self.region: Region = (1, 1, *self.texels)
        ringed = self.texels[0] + 2, self.texels[1] + 2
        label = f"viscous level {depth}"
        names = "inverse_u", "inverse_v", *(CELLS + NODES if depth else ("cells", "nodes"))
        self.packed = {name: device.field(ringed, 4, f"{label} {name}") for name in names}
        self.packed["open"] = device.field(ringed, 4, f"{label} open", "f1")
        self.stress = [device.field(ringed, 4, f"{label} stress {name}") for name in ("xx", "yy", "xy") if depth]
        self.rhs = PackedFaces(device, ringed, f"{label} right-hand side")
        self.faces = DoublePackedFaces(device, ringed, f"{label} faces")
        self.residual = PackedFaces(device, ringed, f"{label} residual")
        # Without solids, what walls leave of a grid whose last column or row is only half in it, at least a channel.
        self.box = max(finest[0] >> depth, 1), max(finest[1] >> depth, 1)
        # 2 where the finer level is a single column or row, which is coarsened along itself only, else 1.
        self.alone = tuple(2.0 if depth and side >> depth == 0 else 1.0 for side in finest)
        # What passes read: the operator, what stress.frag multiplies with, open faces, and where the fluid sticks.
        self.operator: dict[str, Any] = {}
        self.stencil: dict[str, Any] = {}
        self.open: dict[str, Any] = {}
        self.walls: dict[str, Any] = {}
        self.defines: dict[str, Any] = {}

    def set_masks(self, viscosity: Field, solid: Field, scale: float, most: float, no_slip: NoSlip, box: Box) -> None:
        """Take the operator of the finest level from the cells' viscosity and solid cells, where a box of them changed.

        Args:
            viscosity: lengths^2 / s.
            solid: above 0 in solid cells.
            scale: dt / (hx hy), s / length^2.
            most: what more viscosity counts as.
            no_slip: where the fluid sticks.
            box: those that have changed.
        """
        self.defines = self._take_walls(no_slip)
        draw = self.device.pass_("viscosity/coefficients.frag", **self.defines)
        names = "cells", "nodes", "inverse_u", "inverse_v", "open"
        draw([self.packed[name] for name in names], region=self._around(box), viscosity=viscosity, solid=solid,
             scale=scale, most=most, shear=self.shear, **self.walls)  # fmt: skip
        self.operator = {**self.packed, "shear": self.shear, "aspect": self.aspect, **self.walls}
        self.open, self.stencil = {"open": self.packed["open"]}, {}

    def coarsen(self, finer: Level, no_slip: NoSlip, box: Box, is_open_new: bool, most: float) -> None:
        """Take the Galerkin operator of the `finer` level, where a box of cells has changed, and maybe what is open.

        On the finest level kappa above `most` counts as that.
        """
        packed, region = self.packed, self._around(box)
        if is_open_new:
            self.device.pass_("viscosity/coarsen_open.frag")(
                packed["open"], region=self.region, open=finer.packed["open"], alone=self.alone
            )
        inputs: dict[str, Any] = {**finer.packed, "open": packed["open"]}
        slip = defines = self._take_walls(no_slip)
        if not finer.depth:
            inputs |= {"xx0": finer.packed["cells"], "node0": finer.packed["nodes"], "aspect": self.aspect}
            defines = {"FINE_IS_FINEST": 1, **slip}
        nodes = "nodes" if self.alone == (1.0, 1.0) else "line"
        for kind, names in (("cells", CELLS), (nodes, NODES)):
            draw = self.device.pass_(f"viscosity/coarsen_{kind}.frag", **defines)
            wanted = *names, "open", *(("aspect",) if kind == "cells" else ())
            read = {name: inputs[name] for name in wanted if name in inputs}
            if not finer.depth:
                read["most"] = most * 2.0 * self.shear[1] ** 2 if kind == "cells" else most
            draw([packed[name] for name in names], region=region, alone=self.alone, **read, **self.walls)
        draw = self.device.pass_("viscosity/inverse_diagonal.frag")
        read: dict[str, Any] = {name: packed[name] for name in ("xx0", "yy0", "node0", "node1", "node2", "open")}
        draw((packed["inverse_u"], packed["inverse_v"]), region=region, shear=self.shear, **read)
        self.open, self.defines = {"open": packed["open"]}, {"COARSE": 1, **slip}
        self.stencil = {name: packed[name] for name in CELLS + NODES} | {"shear": self.shear}
        stress = dict(zip(("stress_xx", "stress_yy", "stress_xy"), self.stress, strict=True))
        self.operator = {name: packed[name] for name in ("inverse_u", "inverse_v", "open")} | stress
        self.operator |= {"shear": self.shear, **self.walls}

    def _around(self, box: Box) -> Region:
        """The texels with faces that feel a strain in a box of cells; nodes on the far walls lie in the ring itself."""
        top, bottom, left, right = box
        x, y = max(left - 1, 0) // 2, max(top - 1, 0) // 2
        return 1 + x, 1 + y, right // 2 + 1 - x, bottom // 2 + 1 - y

    def coefficients(self, region: Region | None = None) -> Coefficients:
        """K as it is in the textures, in a region of texels or in all; waits for the GPU."""
        x, y, columns, rows = region or self.region

        def cells(name: str, more: int = 0) -> np.ndarray:
            texels = self.packed[name].get((x, y, columns + more, rows + more))
            return unpacked(texels)[: 2 * rows + more, : 2 * columns + more]

        is_open = cells("open")
        open_u, open_v = is_open % 2 > 0, is_open > 1
        if self.depth == 0:
            xx, node = np.abs(cells("cells")), np.abs(cells("nodes", 1))
            return Coefficients({(0, 0): xx}, {(0, 0): self.aspect * xx}, {(0, 0): node}, open_u, open_v, self.shear)
        xx, yy, nodes = (
            {offset: cells(f"{kind}{number}", more) for number, offset in enumerate(stencil)}
            for kind, more, stencil in (("xx", 0, ROW_STENCIL), ("yy", 0, COLUMN_STENCIL), ("node", 1, NODE_STENCIL))
        )
        return Coefficients(xx, yy, nodes, open_u, open_v, self.shear)

    def set_uniform(self, stiffness: float, no_slip: NoSlip) -> None:
        """Take the operator of one viscosity in a box without solids, dt mu / (hx hy) of this level."""
        self.defines = {"UNIFORM": 1, **self._take_walls(no_slip)}
        self.open, self.stencil = {"box": self.box}, {}
        self.operator = {"stiffness": stiffness, "shear": self.shear, **self.walls}

    def _take_walls(self, no_slip: NoSlip) -> dict[str, Any]:
        """Take up where the fluid sticks; the define of that."""
        self.walls = {"box": self.box}
        if not any(no_slip):
            return {}
        self.walls |= {"no_slip": tuple(map(float, no_slip[:4])), "solids_no_slip": float(no_slip.solids)}
        return {"NO_SLIP": 1}

    @property
    def aspect(self) -> float:
        """K of e_yy over that of e_xx, (hx / hy)^2."""
        return self.shear[0] ** 4

    @property
    def bounds(self) -> dict[str, Any]:
        """What a pass reads that asks which faces are open, and where the fluid sticks."""
        return {**self.open, **self.walls}

    @property
    def is_coarsest(self) -> bool:
        return self.texels[0] * self.texels[1] <= COARSEST

    def release(self) -> None:
        for item in (*self.packed.values(), *self.stress, self.rhs, self.faces, self.residual):
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

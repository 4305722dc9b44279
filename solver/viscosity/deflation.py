"""Deflation: the motions of very viscous parts that cost little energy, as a coarse space that is solved directly.

With harmonic means at the nodes a stiff cell forces no more than u to be constant along its row and v along its column,
and a node is stiff only if all its four cells are. So the motions without strain are spanned by *runs* (u along stiff
cells of a row, v along those of a column) and, where parts are at least five cells broad, by the rigid motions of
*cores*. Both end at the tiles' edges, so that long parts bend. Coarse correction (V5): f += Z E^-1 Z' r, E = Z' A Z, of
which only couplings within a cluster are kept: of parts that stiff strains connect.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from solver.components import connected_components
from solver.gl.device import Device
from solver.gl.field import Field
from solver.packing import PackedFaces, framed, packed
from solver.viscosity.box import Box, changed
from solver.viscosity.clusters import ClusterMatrix
from solver.viscosity.operator import Coefficients, Level
from solver.viscosity.parts import Parts, find_parts

# Tiles along the longer side, of 8 cells at least: finer ones bend better and leave more unknowns.
TILES = 32
SMALLEST_TILE = 8
WIDE = 64  # texels of a row of the parts' textures


class CoarseSpace:
    """The parts' motions as unknowns: three of a core (across, down, turn), one of a run.

    Args:
        parts: the cores and runs.
        level: K in the same cells.
        threshold: kappa above which strains connect parts.
        first: (column, row) of the first of these cells.
    """

    def __init__(self, parts: Parts, level: Coefficients, threshold: float, first: tuple[int, int]) -> None:
        self.parts = parts
        s_y, s_x = level.shear
        height, width = parts.of_u.shape
        # Arms of a turn, u = -turn y, v = turn x, without strain where cells are not square too.
        self._y, self._x = (np.arange(height) + first[1] + 0.5) / s_y, (np.arange(width) + first[0] + 0.5) / s_x
        # Of the faces that belong to parts: the part, and the place across the way they move.
        (row, column), (row_v, column_v) = np.nonzero(parts.of_u), np.nonzero(parts.of_v)
        faces_u, faces_v = (parts.of_u[row, column], self._y[row]), (parts.of_v[row_v, column_v], self._x[column_v])
        self.centres = np.stack([_means(*faces, parts.count) for faces in (faces_v, faces_u)], axis=1)
        # Z' Z, which is diagonal: faces of u, of v, and the squares of their arms.
        masses = [np.bincount(part, minlength=parts.count + 1) for part, _ in (faces_u, faces_v)]
        part = np.concatenate([faces_v[0], faces_u[0]])
        arm = np.concatenate([at - self.centres[of, axis] for axis, (of, at) in enumerate((faces_v, faces_u))])
        masses.append(np.bincount(part, arm**2, parts.count + 1))
        number = np.arange(parts.count + 1)
        is_core = (number > 0) & (number <= parts.cores)
        self._first = np.where(is_core, 3 * (number - 1), number - 1 + 2 * parts.cores)
        # Of each unknown its part, and which of (across, down, turn) it is.
        self.part = np.repeat(number[1:], np.where(is_core, 3, 1)[1:])
        runs = np.where(np.arange(parts.count - parts.cores) < parts.runs_of_u, 0, 1)
        self.motion = np.concatenate([np.tile([0, 1, 2], parts.cores), runs])
        self._masses = np.stack(masses, axis=1)[self.part, self.motion].astype(float)
        strains = self._strains(level)
        cluster = self._clusters(strains, threshold)[self.part]
        along = 0 if width >= height else 1
        strip = parts.tile[self.part, along]
        entries = rows, columns, values = self._entries(strains)
        self._matrix = ClusterMatrix(cluster, strip, *entries)
        apart = cluster[rows] != cluster[columns]
        self._between = rows[apart], columns[apart], values[apart]

    def _strains(self, level: Coefficients) -> list[Any]:
        """Of each kind of strain that some part feels: K, and of its faces (part, sign, arm, whether it is of v)."""
        s_y, s_x = level.shear
        u, v = (framed(at, (1, 1), (1, 1)) for at in (self.parts.of_u, self.parts.of_v))
        # Beyond the walls no face belongs to a part, and no arm counts.
        x, y = np.pad(self._x, 1), np.pad(self._y, 1)
        # K and, of each face, where the framed faces begin (row, column), its sign and whether it is of v.
        kinds = (
            (level.xx[0, 0], ((1, 2, 1.0, 0), (1, 1, -1.0, 0))),
            (level.yy[0, 0], ((2, 1, 1.0, 1), (1, 1, -1.0, 1))),
            (level.nodes[0, 0], ((1, 1, s_y, 0), (0, 1, -s_y, 0), (1, 1, s_x, 1), (1, 0, -s_x, 1))),
        )
        found = []
        for stiffness, faces in kinds:
            rows, columns = stiffness.shape
            parts = [(v if of_v else u)[down : down + rows, right : right + columns] for down, right, _, of_v in faces]
            # A part that moves as a whole feels no strain within.
            felt = np.logical_or.reduce([part != parts[0] for part in parts[1:]]) & (stiffness > 0)
            row, column = np.nonzero(felt)
            ends = []
            for part, (down, right, sign, of_v) in zip(parts, faces, strict=True):
                part = part[row, column].astype(int)
                arm = x[column + right] - self.centres[part, 0] if of_v else self.centres[part, 1] - y[row + down]
                ends.append((part, sign, arm, of_v))
            found.append((stiffness[row, column], ends))
        return found

    def _clusters(self, strains: list[Any], threshold: float) -> np.ndarray:
        """The cluster of each part: of those that strains stiffer than `threshold` connect."""
        one, other = [], []
        for stiffness, faces in strains:
            stiff = stiffness > threshold
            parts = [part[stiff] for part, *_ in faces]
            for a, b in pairwise(parts):
                both = (a > 0) & (b > 0) & (a != b)
                one.append(a[both])
                other.append(b[both])
            if len(parts) == 4:
                both = (parts[0] > 0) & (parts[3] > 0) & (parts[0] != parts[3])
                one.append(parts[0][both])
                other.append(parts[3][both])
        return connected_components(np.arange(self.parts.count + 1), np.concatenate(one), np.concatenate(other))

    def _entries(self, strains: list[Any]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Entries (row, column, value), of which Z' A Z is the sum and its transpose."""
        count, cores, first = self.parts.count + 1, self.parts.cores, self._first
        is_core = np.arange(count) <= cores
        rows, columns, values = [], [], []

        def add(one: np.ndarray, other: np.ndarray, value: np.ndarray) -> None:
            there = np.flatnonzero(value)
            rows.append(one.ravel()[there])
            columns.append(other.ravel()[there])
            values.append(value.ravel()[there])

        # Masses: the identity.
        each = np.arange(len(self.part))
        add(each, each, 0.5 * self._masses)
        for stiffness, faces in strains:
            # The unknowns that move a face, two of a core's three or a run's one, and what strain they make.
            unknown, felt = [], []
            for part, sign, arm, of_v in faces:
                core, start = is_core[part], first[part]
                unknown += [start + of_v * core, start + 2]
                felt += [sign * (part > 0), sign * core * (part > 0) * arm]
            one, other = np.triu_indices(len(felt))
            unknown, felt = np.stack(unknown), np.stack(felt)
            half = np.where(one == other, 0.5, 1.0)[:, None]
            add(unknown[one], unknown[other], half * stiffness * felt[one] * felt[other])
        return np.concatenate(rows), np.concatenate(columns), np.concatenate(values)

    def solve(self, loads: np.ndarray) -> np.ndarray:
        """E^-1 times the loads on the unknowns, (n,), each cluster by itself (V5)."""
        return self._matrix.solve(loads)

    def coupled(self, unknowns: np.ndarray) -> np.ndarray:
        """The loads (n,) that unknowns (n,) put on other clusters: the part of Z' A Z that E leaves out."""
        rows, columns, values = self._between
        ends, loads = (rows, columns), (values * unknowns[columns], values * unknowns[rows])
        return np.bincount(np.concatenate(ends), np.concatenate(loads), len(unknowns))

    def means(self, loads: np.ndarray) -> np.ndarray:
        """(Z' Z)^-1 times the loads on the unknowns, (n,): the mean motion of the parts."""
        return loads / np.maximum(self._masses, 1e-12)

    def motions(self, unknowns: np.ndarray) -> np.ndarray:
        """(a, b, turn) of all parts, (parts + 1, 3), part 0 at rest: u = a - turn y, v = b + turn x."""
        motions = np.zeros((self.parts.count + 1, 3))
        motions[self.part, self.motion] = unknowns
        motions[:, 0] += motions[:, 2] * self.centres[:, 1]
        motions[:, 1] -= motions[:, 2] * self.centres[:, 0]
        return motions


def _means(part: np.ndarray, at: np.ndarray, count: int) -> np.ndarray:
    return np.bincount(part, at, count + 1) / np.maximum(np.bincount(part, minlength=count + 1), 1)


class Deflation:
    """The coarse correction on the GPU: loads are gathered there, solved for in float64, and the motions spread there.

    Args:
        device: where it lives.
        level: the finest.
    """

    def __init__(self, device: Device, level: Level) -> None:
        self.device = device
        self.level = level
        self.side = max(SMALLEST_TILE, 2 * -(-max(level.texels) // TILES))
        ringed = level.rhs.u.size
        self._part_of = tuple(device.field(ringed, 4, f"deflated part of {name}") for name in "uv")
        self._averaged = PackedFaces(device, ringed, "averaged over parts")
        self._tables: list[Field] = []
        self._stiff: np.ndarray | None = None
        self._threshold = 0.0
        self._space: CoarseSpace | None = None

    def set_stiff(self, stiff: np.ndarray | None, threshold: float = 0.0) -> None:
        """Take up the stiff cells, (ny, nx), those with kappa above a `threshold`; None if there are none."""
        self._stiff, self._threshold, self._space = stiff, threshold, None

    @property
    def space(self) -> CoarseSpace | None:
        """The coarse space, None if there are no parts; made at the first use, as fluid at rest needs none."""
        if self._stiff is not None:
            box, self._stiff, stiff = changed(np.zeros_like(self._stiff), self._stiff), None, self._stiff
            if box:
                self._find(stiff, box)
        return self._space

    def _find(self, stiff: np.ndarray, box: Box) -> None:
        """Find the parts of the stiff cells, all of which are in a box."""
        # Whole tiles, and on each side one cell more that is not stiff.
        top, left = (max(start - 1, 0) // self.side * self.side for start in box[::2])
        width, height = ((end + 2 - first) // 2 for end, first in ((box.right, left), (box.bottom, top)))
        columns, rows = min(width, self.level.texels[0] - left // 2), min(height, self.level.texels[1] - top // 2)
        region = 1 + left // 2, 1 + top // 2, columns, rows
        part = stiff[top : top + 2 * rows, left : left + 2 * columns]
        part = framed(part, (0, 2 * rows - part.shape[0]), (0, 2 * columns - part.shape[1]))
        level = self.level.coefficients(region)
        parts = find_parts(part, level.xx[0, 0], level.open_u, level.open_v, self.side)
        if not parts.count:
            return
        self._space = CoarseSpace(parts, level, self._threshold, (left, top))
        for field, part_of in zip(self._part_of, (parts.of_u, parts.of_v), strict=True):
            field.clear()
            field.texture.write(packed(part_of.astype(np.float32)).tobytes(), region)
        height = -(-(parts.count + 1) // WIDE)
        if not self._tables or self._tables[0].height < height:
            for table in self._tables:
                table.release()
            names = "tiles", "loads", "motions"
            self._tables = [self.device.field((WIDE, height), 4, f"deflated {name}") for name in names]
        tiles = parts.tile * (self.side // 2) + region[:2]
        self._tables[0].set(self._rows_of(np.concatenate([tiles, self._space.centres], axis=1)))

    def correct(
        self, residual: PackedFaces, target: PackedFaces, add: bool = False, means: np.ndarray | None = None
    ) -> np.ndarray:
        """Draw Z E^-1 Z' times the residual (V5), or add it; returns the unknowns, (n,). Waits for the GPU.

        `means`: the expected motion of the parts of other clusters; at rest by default.
        """
        space, loads = self._made(), self._gather(residual)
        unknowns = space.solve(loads if means is None else loads - space.coupled(means))
        self._spread(target, unknowns, add)
        return unknowns

    def average(self, residual: PackedFaces, unknowns: np.ndarray) -> PackedFaces:
        """S' times the residual that is left once the parts have moved by the unknowns: on each part its mean.

        What it is there follows from these; between stiff parts a float32 would not tell it.
        """
        space = self._made()
        self._spread(self._averaged, space.means(-space.coupled(unknowns)), others=residual)
        return self._averaged

    def add_others(self, faces: PackedFaces, target: PackedFaces) -> np.ndarray:
        """Add the faces of no part to the target; returns the parts' mean motion, (n,). Waits for the GPU."""
        self._spread(target, None, add=True, others=faces)
        return self._made().means(self._gather(faces))

    def _made(self) -> CoarseSpace:
        assert self.space is not None
        return self.space

    def _gather(self, faces: PackedFaces) -> np.ndarray:
        """Z' times the faces, in float64."""
        space, (tiles, loads, _) = self._made(), self._tables
        count = space.parts.count + 1
        gather = self.device.pass_("viscosity/gather_loads.frag", SIDE=self.side // 2 + 1)
        gather(loads, region=(0, 0, WIDE, -(-count // WIDE)), tiles=tiles, **faces.inputs(), **self._belonging)
        return loads.get().reshape(-1, 4)[space.part, space.motion].astype(np.float64)

    def _spread(
        self, target: PackedFaces, unknowns: np.ndarray | None, add: bool = False, others: PackedFaces | None = None
    ) -> None:
        """Draw Z times the unknowns, and on faces of no part what `others` hold, or add it."""
        motions = self._tables[2]
        if unknowns is not None:
            motions.set(self._rows_of(self._made().motions(unknowns)))
        defines = ({"OTHERS": 1} if others else {}) | ({"STILL": 1} if unknowns is None else {})
        inputs: dict[str, Any] = {"motions": motions, **self._belonging, **(others.inputs() if others else {})}
        spread = self.device.pass_("viscosity/spread_motions.frag", WIDE=WIDE, **defines)
        spread(target.fields, add=add, region=self.level.region, **inputs)

    @property
    def _belonging(self) -> dict[str, Any]:
        return {"part_u": self._part_of[0], "part_v": self._part_of[1], "shear": self.level.shear}

    def _rows_of(self, values: np.ndarray) -> np.ndarray:
        table = self._tables[0]
        texels = np.zeros((table.height * WIDE, 4))
        texels[: len(values), : values.shape[1]] = values
        return texels.reshape(table.height, WIDE, 4)

    def release(self) -> None:
        """Free the textures."""
        for field in (*self._part_of, *self._tables, *self._averaged.fields):
            field.release()

"""Deflation: what moves at little energy in very viscous fluid, solved for directly as a coarse space.

With harmonic means at the nodes a stiff cell forces no more than u to be constant along its row and v along its
column, and a node is stiff only where all its four cells are. So the motions without strain are spanned by *runs* (u
along stiff cells of a row, v along those of a column) and, where it is at least five cells broad, by the rigid motions
of *cores*. Both end at the tiles' edges, so that long things bend. Coarse correction: f += Z E^-1 Z' r with E = Z' A Z,
of which only couplings within a cluster are kept, that is of parts which something stiff connects.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, pairwise, product
from typing import Any

import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field
from solver.packing import PackedFaces, framed, packed
from solver.viscosity.clusters import ClusterMatrix, connected
from solver.viscosity.operator import Coefficients

BROAD = 5  # cells across a core, at least
# Tiles along the longer side, of 8 cells at least: finer ones bend better and leave more unknowns.
TILES = 32
SMALLEST_TILE = 8
WIDE = 64  # texels of a row of the parts' textures


@dataclass(frozen=True)
class Parts:
    """Cores and runs, numbered from 1: cores, runs of u, runs of v.

    Attributes:
        of_u, of_v: the part of each face, 0 for none, (rows, columns).
        cores, runs_of_u: how many of each kind there are.
        tile: (column, row) of each part's tile, of part 0 too.
        side: cells along a tile.
    """

    of_u: np.ndarray
    of_v: np.ndarray
    cores: int
    runs_of_u: int
    tile: np.ndarray
    side: int

    @property
    def count(self) -> int:
        return len(self.tile) - 1


def find_parts(stiff: np.ndarray, open_u: np.ndarray, open_v: np.ndarray, side: int) -> Parts:
    """The cores and runs of the `stiff` cells, (rows, columns), in tiles of `side` cells."""
    rows, columns = stiff.shape
    core = _numbered(_opened(stiff), side)
    of_u = np.maximum(core, framed(core, (0, 0), (1, 0))[:, :-1]) * open_u
    of_v = np.maximum(core, framed(core, (1, 0), (0, 0))[:-1]) * open_v
    cores = int(core.max(initial=0))
    free = stiff & (core == 0)
    runs_u = _runs(free, open_u & (of_u == 0), side)
    runs_v = _runs(free.T, (open_v & (of_v == 0)).T, side).T
    runs_of_u = int(runs_u.max(initial=0))
    of_u += np.where(runs_u, cores + runs_u, 0)
    of_v += np.where(runs_v, cores + runs_of_u + runs_v, 0)
    tile = np.zeros((cores + runs_of_u + int(runs_v.max(initial=0)) + 1, 2), int)
    across, down = np.broadcast_arrays(np.arange(columns) // side, np.arange(rows)[:, None] // side)
    for parts in (np.where(runs_u, of_u, 0), np.where(runs_v, of_v, 0), core):
        tile[parts, 0], tile[parts, 1] = across, down
    return Parts(of_u, of_v, cores, runs_of_u, tile, side)


def _opened(stiff: np.ndarray) -> np.ndarray:
    """The union of all squares of `BROAD` cells in the stiff ones; walls count as stiff."""
    for axis in (0, 1):
        padding = [(BROAD - 1, BROAD - 1) if axis == other else (0, 0) for other in (0, 1)]
        full, count = np.pad(stiff, padding, constant_values=True), stiff.shape[axis] + BROAD - 1
        whole = np.logical_and.reduce([full.take(range(s, s + count), axis) for s in range(BROAD)])
        stiff = np.logical_or.reduce([whole.take(range(s, s + count - BROAD + 1), axis) for s in range(BROAD)])
    return stiff


def _numbered(inside: np.ndarray, side: int) -> np.ndarray:
    """The pieces of a mask within tiles, numbered from 1 on, 0 outside.

    Two cells side by side belong together if a node that both touch has all four cells inside; else they are a hinge.
    """
    number = np.arange(1, inside.size + 1).reshape(inside.shape) * inside
    around = framed(inside, (1, 1), (1, 1))
    whole = around[1:, 1:] & around[:-1, 1:] & around[1:, :-1] & around[:-1, :-1]
    links = []
    for turned, nodes in ((number, whole), (number.T, whole.T)):
        together = (nodes[:-1, 1:-1] | nodes[1:, 1:-1]) & (np.arange(1, turned.shape[1]) % side != 0)
        links.append((turned[:, :-1][together], turned[:, 1:][together]))
    one, other = (np.concatenate(ends) for ends in zip(*links, strict=True))
    used = np.zeros(inside.size + 1, int)
    used[number.ravel()] = used[0] = 1
    short = np.cumsum(used) - 1
    root = connected(int(short[-1]) + 1, short[one], short[other])
    first = np.cumsum(root == np.arange(len(root))) - 1
    return first[root][short[number]]


def _runs(free: np.ndarray, faces: np.ndarray, side: int) -> np.ndarray:
    """Faces along the rows of `free` cells, numbered run by run from 1 on; a tile's edge ends a run."""
    touching = faces & (free | framed(free, (0, 0), (1, 0))[:, :-1])
    on = np.zeros_like(touching)
    on[:, 1:] = touching[:, 1:] & touching[:, :-1] & free[:, :-1] & (np.arange(1, free.shape[1]) % side != 0)
    return np.cumsum((touching & ~on).ravel()).reshape(free.shape) * touching


class CoarseSpace:
    """The parts' motions as unknowns: three of a core (across, down, turn), one of a run."""

    def __init__(self, parts: Parts, level: Coefficients, threshold: float) -> None:
        self.parts = parts
        s_y, s_x = level.shear
        rows, columns = parts.of_u.shape
        # Arms of a turn, u = -turn y, v = turn x, without strain where cells are not square too.
        y = np.broadcast_to((np.arange(rows)[:, None] + 0.5) / s_y, (rows, columns))
        x = np.broadcast_to((np.arange(columns) + 0.5) / s_x, (rows, columns))
        centres = [_means(part, at, parts.count) for part, at in ((parts.of_v, x), (parts.of_u, y))]
        self.centres = np.stack(centres, axis=1)
        number = np.arange(parts.count + 1)
        is_core = (number > 0) & (number <= parts.cores)
        self._first = np.where(is_core, 3 * (number - 1), number - 1 + 2 * parts.cores)
        self.count = int(self._first[-1]) + 1 if parts.count else 0
        # Of each unknown its part, and which of (across, down, turn) it is.
        self.part = np.repeat(number[1:], np.where(is_core, 3, 1)[1:])
        runs = np.where(np.arange(parts.count - parts.cores) < parts.runs_of_u, 0, 1)
        self.motion = np.concatenate([np.tile([0, 1, 2], parts.cores), runs])
        arm_u, arm_v = centres[1][parts.of_u] - y, x - centres[0][parts.of_v]
        strains = self._strains(level, arm_u, arm_v)
        cluster = self._clusters(strains, threshold)
        along = 0 if columns >= rows else 1
        self._matrix = ClusterMatrix(cluster[self.part], parts.tile[self.part, along])
        self._matrix.factor(*self._entries(strains, cluster, arm_u, arm_v))

    def _strains(self, level: Coefficients, arm_u: np.ndarray, arm_v: np.ndarray) -> list[Any]:
        """Of each kind of strain that some part feels: K, and of its faces (part, sign, arm, whether it is of v)."""
        s_y, s_x = level.shear
        u, v, arm_u, arm_v = (framed(at, (1, 1), (1, 1)) for at in (self.parts.of_u, self.parts.of_v, arm_u, arm_v))
        inner = slice(1, -1)
        kinds = (
            (level.xx[0], ((u[inner, 2:], 1.0, arm_u[inner, 2:], 0), (u[inner, inner], -1.0, arm_u[inner, inner], 0))),
            (level.yy[0], ((v[2:, inner], 1.0, arm_v[2:, inner], 1), (v[inner, inner], -1.0, arm_v[inner, inner], 1))),
            (
                level.nodes[0, 0],
                (
                    (u[1:, 1:], s_y, arm_u[1:, 1:], 0),
                    (u[:-1, 1:], -s_y, arm_u[:-1, 1:], 0),
                    (v[1:, 1:], s_x, arm_v[1:, 1:], 1),
                    (v[1:, :-1], -s_x, arm_v[1:, :-1], 1),
                ),
            ),
        )
        found = []
        for stiffness, faces in kinds:
            first = faces[0][0]
            # A part that moves as a whole feels no strain within.
            felt = np.logical_or.reduce([face[0] != first for face in faces[1:]]) & (stiffness > 0)
            found.append((stiffness[felt], [(part[felt], sign, arm[felt], of_v) for part, sign, arm, of_v in faces]))
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
        return connected(self.parts.count + 1, np.concatenate(one), np.concatenate(other))

    def _entries(
        self, strains: list[Any], cluster: np.ndarray, arm_u: np.ndarray, arm_v: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Entries (row, column, value) within the clusters, of which Z' A Z is the sum and its transpose."""
        count, cores = self.parts.count + 1, self.parts.cores
        # Of each part by itself, its mass and what it strains around it: the upper triangle over its three motions.
        own = {pair: np.zeros(count) for pair in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))}
        for part, arm, of_v in ((self.parts.of_u, arm_u, 0), (self.parts.of_v, arm_v, 1)):
            faces = np.bincount(part.ravel(), minlength=count)
            own[of_v, of_v][: cores + 1] += faces[: cores + 1]
            own[0, 0][cores + 1 :] += faces[cores + 1 :]
            own[2, 2] += np.bincount(part.ravel(), (arm**2).ravel(), count)
        rows, columns, values = [], [], []
        for stiffness, faces in strains:
            # How a strain feels the three motions of each part it touches, at the first of the faces that belong to it.
            felt = [self._felt(*face) for face in faces]
            parts = [face[0] for face in faces]
            is_first = [part > 0 for part in parts]
            for earlier, later in combinations(range(len(parts)), 2):
                same = is_first[later] & is_first[earlier] & (parts[later] == parts[earlier])
                felt[earlier] += same * felt[later]
                is_first[later] = is_first[later] & ~same
            for number, part in enumerate(parts):
                at = np.nonzero(is_first[number])[0]
                one, motion, k = part[at], felt[number][:, at], stiffness[at]
                for first, second in own:
                    own[first, second] += np.bincount(one, k * motion[first] * motion[second], count)
                for later in range(number + 1, len(parts)):
                    both = is_first[number] & is_first[later] & (cluster[part] == cluster[parts[later]])
                    at = np.nonzero(both)[0]
                    one, other, k = part[at], parts[later][at], stiffness[at]
                    for first, second in product(range(3), range(3)):
                        there = ((one <= cores) | (first == 0)) & ((other <= cores) | (second == 0))
                        rows.append(self._first[one[there]] + first)
                        columns.append(self._first[other[there]] + second)
                        energy = k * felt[number][first, at] * felt[later][second, at]
                        values.append(energy[there])
        for (first, second), sums in own.items():
            number = np.arange(1, count if second == 0 else cores + 1)
            rows.append(self._first[number] + first)
            columns.append(self._first[number] + second)
            values.append((0.5 if first == second else 1.0) * sums[number])
        return np.concatenate(rows), np.concatenate(columns), np.concatenate(values)

    def _felt(self, part: np.ndarray, sign: float, arm: np.ndarray, of_v: int) -> np.ndarray:
        """A face's share in a strain as its part moves across, down and turns; a run's one motion is the first."""
        is_core = part <= self.parts.cores
        across = np.where(is_core, 1.0 - of_v, 1.0)
        return sign * np.stack([across, is_core * float(of_v), is_core * arm])

    def solve(self, loads: np.ndarray) -> np.ndarray:
        """What the loads (across, down, torque) of all parts move: (a, b, turn), u = a - turn y, v = b + turn x."""
        motions = np.zeros((self.parts.count + 1, 3))
        motions[self.part, self.motion] = self._matrix.solve(loads[self.part, self.motion])
        motions[:, 0] += motions[:, 2] * self.centres[:, 1]
        motions[:, 1] -= motions[:, 2] * self.centres[:, 0]
        return motions


def _means(part: np.ndarray, at: np.ndarray, count: int) -> np.ndarray:
    faces = np.bincount(part.ravel(), minlength=count + 1)
    return np.bincount(part.ravel(), at.ravel(), count + 1) / np.maximum(faces, 1)


class Deflation:
    """The coarse correction on the GPU: loads are gathered there, solved for in float64, and the motions spread there.

    Args:
        device: where it lives.
        texels: (width, height) of the packed faces, without their ring.
    """

    def __init__(self, device: Device, texels: tuple[int, int]) -> None:
        self.device = device
        self.region = (1, 1, *texels)
        self.side = max(SMALLEST_TILE, 2 * -(-max(texels) // TILES))
        ringed = texels[0] + 2, texels[1] + 2
        self._part_of = tuple(device.field(ringed, 4, f"deflated part of {name}") for name in "uv")
        self._tables: list[Field] = []
        self._shear = (1.0, 1.0)
        self.space: CoarseSpace | None = None

    def clear(self) -> None:
        """Nothing is stiff."""
        self.space = None

    def find(self, stiffness: np.ndarray, level: Coefficients, threshold: float) -> None:
        """Take up dt mu / (hx hy) of the cells, (rows, columns), and the finest level; stiff is above `threshold`."""
        parts = find_parts(stiffness > threshold, level.open_u, level.open_v, self.side)
        self.space = None
        if not parts.count:
            return
        self.space = CoarseSpace(parts, level, threshold)
        self._shear = level.shear
        for field, part in zip(self._part_of, (parts.of_u, parts.of_v), strict=True):
            field.set(packed(framed(part, (2, 2), (2, 2))))
        height = -(-(parts.count + 1) // WIDE)
        if not self._tables or self._tables[0].height < height:
            for table in self._tables:
                table.release()
            names = "tiles", "loads", "motions"
            self._tables = [self.device.field((WIDE, height), 4, f"deflated {name}") for name in names]
        about = np.concatenate([1 + parts.tile * (parts.side // 2), self.space.centres], axis=1)
        self._tables[0].set(self._rows_of(about))

    def correct(self, residual: PackedFaces, target: PackedFaces, add: bool = False) -> None:
        """Draw Z E^-1 Z' times the residual, or add it; waits for the GPU."""
        assert self.space is not None
        tiles, loads, motions = self._tables
        part_of = {"part_u": self._part_of[0], "part_v": self._part_of[1], "shear": self._shear}
        count = self.space.parts.count + 1
        gather = self.device.pass_("viscosity/gather_loads.frag", SIDE=self.side // 2 + 1)
        gather(loads, region=(0, 0, WIDE, -(-count // WIDE)), tiles=tiles, **residual.inputs(), **part_of)
        found = self.space.solve(loads.get().reshape(-1, 4)[:count, :3].astype(np.float64))
        motions.set(self._rows_of(found))
        spread = self.device.pass_("viscosity/spread_motions.frag")
        spread(target.fields, add=add, region=self.region, motions=motions, **part_of)

    def _rows_of(self, values: np.ndarray) -> np.ndarray:
        table = self._tables[0]
        texels = np.zeros((table.height * WIDE, 4))
        texels[: len(values), : values.shape[1]] = values
        return texels.reshape(table.height, WIDE, 4)

    @property
    def nbytes(self) -> int:
        """Bytes of texture memory."""
        return sum(field.nbytes for field in (*self._part_of, *self._tables))

    def release(self) -> None:
        """Free the textures."""
        for field in (*self._part_of, *self._tables):
            field.release()

"""Very viscous patches move almost as rigid pieces; here each is found, and moved as one piece."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.passes import Region

MOST_PARTS = 63
SMALLEST_PART = 12  # cells
SLENDER = 2  # cells on either side of a line or neck that bends, at most
TILE = 8  # texels, as in shaders/viscosity/gather_parts.frag
ENTRIES_WIDE = 64


def connected_parts(inside: np.ndarray) -> np.ndarray:
    """Number the 4-connected parts of a mask (ny, nx): 1, 2, ... by falling size, 0 outside and for the small ones."""
    edges = np.diff(np.pad(inside, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    starts = edges[:, :-1] > 0
    # Runs of cells along the rows, numbered from 1 on.
    run = np.cumsum(starts.ravel()).reshape(inside.shape) * inside
    touching = inside[1:] & inside[:-1] & (starts[1:] | starts[:-1])
    upper, lower = run[:-1][touching], run[1:][touching]
    root = np.arange(run.max() + 1)
    while True:
        a, b = root[upper], root[lower]
        if (a == b).all():
            break
        np.minimum.at(root, np.maximum(a, b), np.minimum(a, b))
        while (root != root[root]).any():
            root = root[root]
    part = root[run]
    sizes = np.bincount(part.ravel(), minlength=len(root))
    sizes[0] = 0
    largest = np.argsort(-sizes, kind="stable")[:MOST_PARTS]
    largest = largest[sizes[largest] >= SMALLEST_PART]
    number = np.zeros(len(root), np.int64)
    number[largest] = np.arange(1, len(largest) + 1)
    return number[part]


def some_bend(part: np.ndarray) -> bool:
    """Whether some of the numbered parts is a line, or pieces on thin necks: gone or apart once its rim is taken."""
    solid = np.pad(part > 0, SLENDER, constant_values=True)
    for axis in (0, 1):
        solid = np.logical_and.reduce([np.roll(solid, shift, axis) for shift in range(-SLENDER, SLENDER + 1)])
    pieces = connected_parts(solid[SLENDER:-SLENDER, SLENDER:-SLENDER])
    first = np.unique(pieces, return_index=True)[1]
    count = np.bincount(part.ravel()[first[pieces.ravel()[first] > 0]], minlength=int(part.max()) + 1)
    if (count > 1).any():
        return True
    # Small parts of which nothing is left may still be as broad as they are long.
    rows, columns = np.nonzero((part > 0) & (count[part] == 0))
    lengths = np.zeros(len(count), int)
    for at in (rows, columns):
        first, last = np.full(len(count), part.size), np.zeros(len(count), int)
        np.minimum.at(first, part[rows, columns], at)
        np.maximum.at(last, part[rows, columns], at)
        lengths = np.maximum(lengths, last + 1 - first)
    return bool((lengths > 3 * (2 * SLENDER + 1)).any())


class StiffParts:
    """The rigid motions of the stiff parts as a coarse space: f += Z (Z^T A Z)^-1 Z^T r, part by part.

    Multigrid glues stiff parts to their surroundings on coarse grids, and so moves them too little; this does not.

    Args:
        device: where it lives.
        texels: (width, height) of the packed faces (shaders/viscosity/block.glsl), without their ring.
    """

    def __init__(self, device: Device, texels: tuple[int, int]) -> None:
        self.device = device
        self.texels = texels
        self.count = 0
        self.some_bend = False
        self._region: Region = (1, 1, *texels)
        ringed = texels[0] + 2, texels[1] + 2
        tiles = -(-texels[0] // TILE) * -(-texels[1] // TILE)
        # A tile holds few parts; those that find no entry are left to multigrid.
        self._entries = device.field((ENTRIES_WIDE, -(-4 * tiles // ENTRIES_WIDE)), 4, "stiff parts' entries")
        self._loads = device.field(self._entries.size, 4, "stiff parts' loads")
        self._parts = device.field((MOST_PARTS + 1, 1), 4, "stiff parts")
        self._response = device.field((MOST_PARTS + 1, 3), 4, "stiff parts' response")
        self._motions = device.field((MOST_PARTS + 1, 1), 4, "stiff parts' motions")
        self._part_of = tuple(device.field(ringed, 4, f"stiff part of {name}", "f1") for name in "uv")

    def find(
        self,
        stiff: np.ndarray,
        solid: np.ndarray,
        apply_matrix: Callable[[Callable[[tuple[Field, Field]], None], Region], tuple[Field, Field]],
    ) -> None:
        """Take up the stiff cells and the solid ones, (ny, nx) each.

        `apply_matrix(draw, region)` lets `draw` fill packed faces and returns minus A times them there.
        """
        part = connected_parts(stiff & ~solid)
        self.count, self.some_bend = int(part.max()), some_bend(part)
        if not self.count:
            return
        faces = [np.maximum(part, np.roll(part, 1, axis)) for axis in (1, 0)]
        for axis, face in zip((1, 0), faces, strict=True):
            face[solid | np.roll(solid, 1, axis)] = 0
        faces[0][:, 0] = faces[1][0] = 0
        packed = [self._packed(face) for face in faces]
        for field, values in zip(self._part_of, packed, strict=True):
            field.set(np.pad(values, ((1, 1), (1, 1), (0, 0))).astype(np.uint8))
        rows, columns = np.nonzero((packed[0] + packed[1]).any(axis=2))
        first, last = (int(columns.min()), int(rows.min())), (int(columns.max()), int(rows.max()))
        self._region = (1 + first[0], 1 + first[1], 1 + last[0] - first[0], 1 + last[1] - first[1])
        of_entry, parts = self._list_entries(packed)
        cells = np.bincount(part.ravel(), minlength=self.count + 1)[1:]
        rows, columns = np.nonzero(part)
        for slot, at in ((2, columns), (3, rows)):
            parts[1 : self.count + 1, slot] = np.bincount(part[rows, columns], at + 0.5)[1:] / cells
        self._parts.set(parts[None])
        # What each part's three motions meet: the columns of its 3 x 3 matrix.
        matrix = np.zeros((self.count, 3, 3))
        for mode in range(3):
            motions = np.zeros_like(parts)
            motions[1:, mode] = 1.0
            if mode == 2:
                motions[1:, 0], motions[1:, 1] = parts[1:, 3], -parts[1:, 2]
            self._motions.set(motions[None])
            self._gather(apply_matrix(self._move, self._region))
            loads = self._loads.get().reshape(-1, 4)[: len(of_entry)]
            for row in range(3):
                matrix[:, row, mode] = -np.bincount(of_entry, loads[:, row], self.count + 1)[1:]
        response = np.zeros((3, MOST_PARTS + 1, 4))
        response[:, 1 : self.count + 1, :3] = np.moveaxis(_inverses(matrix), 1, 0)
        self._response.set(response)

    def add_fit(self, residual: tuple[Field, Field], target: tuple[Field, Field]) -> None:
        """Add to `target` the motions that the residual asks for."""
        self._gather(residual)
        motions = self.device.pass_("viscosity/part_motions.frag")
        motions(self._motions, loads=self._loads, parts=self._parts, response=self._response)
        self._move(target, add=True)

    @property
    def _fields(self) -> tuple[Field, ...]:
        maps = self._entries, self._loads, self._parts, self._response, self._motions
        return *maps, *self._part_of

    @property
    def nbytes(self) -> int:
        """Bytes of texture memory."""
        return sum(field.nbytes for field in self._fields)

    def release(self) -> None:
        """Free the textures."""
        for field in self._fields:
            field.release()

    def _gather(self, residual: tuple[Field, Field]) -> None:
        rows = -(-self._entry_count // ENTRIES_WIDE)
        self.device.pass_("viscosity/gather_parts.frag")(
            self._loads,
            region=(0, 0, ENTRIES_WIDE, rows),
            entries=self._entries,
            parts=self._parts,
            u=residual[0],
            v=residual[1],
            part_u=self._part_of[0],
            part_v=self._part_of[1],
        )

    def _move(self, target: tuple[Field, Field], add: bool = False) -> None:
        self.device.pass_("viscosity/move_parts.frag")(
            target,
            add=add,
            region=self._region,
            motions=self._motions,
            part_u=self._part_of[0],
            part_v=self._part_of[1],
        )

    def _packed(self, faces: np.ndarray) -> np.ndarray:
        width, height = self.texels
        padded = np.pad(faces, ((0, 2 * height - faces.shape[0]), (0, 2 * width - faces.shape[1])))
        return padded.reshape(height, 2, width, 2).transpose(0, 2, 1, 3).reshape(height, width, 4)

    def _list_entries(self, packed: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Upload the entries; the part of each, and the beginnings of `parts`: (first entry, entries, 0, 0) by part."""
        width, height = self.texels
        tiles_wide, tiles_high = -(-width // TILE), -(-height // TILE)
        tile = (np.arange(height)[:, None] // TILE) * tiles_wide + np.arange(width) // TILE
        present = np.zeros((MOST_PARTS + 1, tiles_wide * tiles_high), bool)
        for faces in packed:
            present[faces, tile[..., None]] = True
        present[0] = False
        of_entry, tiles = np.nonzero(present)
        room = self._entries.width * self._entries.height
        of_entry, tiles = of_entry[:room], tiles[:room]
        self._entry_count = len(of_entry)
        entries = np.zeros((room, 4))
        entries[: len(tiles), 0] = 1 + TILE * (tiles % tiles_wide)
        entries[: len(tiles), 1] = 1 + TILE * (tiles // tiles_wide)
        entries[: len(tiles), 2] = of_entry
        self._entries.set(entries.reshape(self._entries.height, self._entries.width, 4))
        parts = np.zeros((MOST_PARTS + 1, 4))
        parts[:, 0] = np.searchsorted(of_entry, np.arange(MOST_PARTS + 1))
        parts[:, 1] = np.bincount(of_entry, minlength=MOST_PARTS + 1)
        return of_entry, parts


def _inverses(matrices: np.ndarray) -> np.ndarray:
    """Inverses of symmetric positive matrices (parts, 3, 3) with rounding errors; nil where there is no telling."""
    symmetric = 0.5 * (matrices + matrices.transpose(0, 2, 1))
    values, vectors = np.linalg.eigh(symmetric)
    with np.errstate(divide="ignore"):
        inverse = np.where(values > 1e-6 * values[:, -1:], 1.0 / values, 0.0)
    return np.where(values[:, -1:, None] > 0, vectors * inverse[:, None, :] @ vectors.transpose(0, 2, 1), 0.0)

"""Cores and runs: the parts of very viscous fluid that move without strain, see deflation.py."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solver.components import connected_components
from solver.packing import framed

BROAD = 5  # cells across a core, at least
# Cells side by side whose stiffness differs by more belong to two parts: the softer one strains, however stiff it is.
EDGE = 30.0


@dataclass(frozen=True)
class Parts:
    """Cores and runs, numbered from 1: cores, runs of u, runs of v.

    Attributes:
        of_u, of_v: the part of each face, 0 for none, (rows, columns).
        cores, runs_of_u: how many of each kind there are.
        tile: (column, row) of each part's tile, of part 0 too.
    """

    of_u: np.ndarray
    of_v: np.ndarray
    cores: int
    runs_of_u: int
    tile: np.ndarray

    @property
    def count(self) -> int:
        return len(self.tile) - 1


def find_parts(stiff: np.ndarray, stiffness: np.ndarray, open_u: np.ndarray, open_v: np.ndarray, side: int) -> Parts:
    """The cores and runs of the `stiff` cells, (rows, columns), by the `stiffness` of all, in tiles of `side` cells.

    Where these are a part of the grid, no cell on its edge is stiff but at a wall.
    """
    inside = _opened(stiff)
    core, hinges = _numbered(inside, stiffness, side)
    cores = int(core.max(initial=0))
    # Faces of parts are few, so they are processed as lists: masks of bytes are cheap, whole arrays of numbers are not.
    # The first column of u and the first row of v are walls, so that a cell lies behind each open face.
    touch_u = open_u & (inside | framed(inside, (0, 0), (1, 0))[:, :-1])
    touch_v = open_v & (inside | framed(inside, (1, 0), (0, 0))[:-1])
    of_u, of_v = np.zeros(stiff.shape, np.int32), np.zeros(stiff.shape, np.int32)
    amount = np.where(inside & ~hinges, stiffness, 0.0).ravel()
    for of_face, touch, back in ((of_u, touch_u, 1), (of_v, touch_v, stiff.shape[1])):
        at = np.flatnonzero(touch)
        # The stiffer core's; of a hinge and a core the core's; of two as stiff, as at tiles' edges, the last one's.
        here, there = ((amount[cells], core.ravel()[cells]) for cells in (at, at - back))
        is_here = (here[0] > there[0]) | ((here[0] == there[0]) & (here[1] > there[1]))
        of_face.ravel()[at] = np.where(is_here, here[1], there[1])
    free = stiff & ~inside
    on_u, runs_u = _runs(free, stiffness, open_u & ~touch_u, side)
    across = (np.ascontiguousarray(of.T) for of in (free, stiffness, open_v & ~touch_v))
    on_v, runs_v = _runs(*across, side=side)
    runs_of_u, runs_of_v = int(runs_u.max(initial=0)), int(runs_v.max(initial=0))
    of_u[on_u] = cores + runs_u
    of_v.T[on_v] = cores + runs_of_u + runs_v
    tile = np.zeros((cores + runs_of_u + runs_of_v + 1, 2), int)
    for parts, on in ((core, inside), (of_u, on_u), (of_v, on_v.T)):
        row, column = np.nonzero(on)
        tile[parts[row, column]] = np.stack([column, row], axis=1) // side
    return Parts(of_u, of_v, cores, runs_of_u, tile)


def _opened(stiff: np.ndarray) -> np.ndarray:
    """The union of all squares of `BROAD` cells in the stiff ones; walls count as stiff."""
    whole = np.pad(stiff, BROAD - 1, constant_values=True)
    for combined in (np.logical_and, np.logical_or):  # which squares are stiff, and what lies in one of them
        for _ in ("down the rows", "then, turned over, across"):
            count = len(whole) - BROAD + 1
            whole = combined.reduce([whole[start : start + count] for start in range(BROAD)]).T
    return whole


def _numbered(inside: np.ndarray, stiffness: np.ndarray, side: int) -> tuple[np.ndarray, np.ndarray]:
    """The pieces of a mask within tiles, numbered from 1 on, 0 outside; and which of its cells are hinges.

    Two cells side by side belong together if neither is much softer, and a node that both touch has all four cells
    inside: only nodes resist a turn. A cell is a hinge if just two of its nodes have that, opposite ones: the parts
    above and below turn about it. It is joined only to the one above; its faces belong to the cells beside it.
    """
    count = int(np.count_nonzero(inside))
    number: np.ndarray = np.zeros(inside.shape, int)
    number[inside] = np.arange(count)
    around = framed(inside, (1, 1), (1, 1))
    whole = around[1:, 1:] & around[:-1, 1:] & around[1:, :-1] & around[:-1, :-1]
    above, below = (whole[:-1, :-1], whole[:-1, 1:]), (whole[1:, :-1], whole[1:, 1:])
    hinges = (above[0] != above[1]) & (above[0] == below[1]) & (above[1] == below[0])
    # By the nodes above and below the face between two cells of a row; left and right of that between two of a column.
    joined = (
        whole[:-1, 1:-1] | (whole[1:, 1:-1] & ~hinges[:, :-1] & ~hinges[:, 1:]),
        (whole[1:-1, :-1] | whole[1:-1, 1:]) & ~hinges[:-1],
    )
    links = []
    for turned, nodes, amount in ((number, joined[0], stiffness), (number.T, joined[1].T, stiffness.T)):
        together = nodes & (np.arange(1, turned.shape[1]) % side != 0)
        ends = amount[:, :-1][together], amount[:, 1:][together]
        alike = np.maximum(*ends) <= EDGE * np.minimum(*ends)
        links.append((turned[:, :-1][together][alike], turned[:, 1:][together][alike]))
    one, other = (np.concatenate(ends) for ends in zip(*links, strict=True))
    root = connected_components(np.arange(count), one, other)
    number[inside] = np.cumsum(root == np.arange(count))[root]
    return number, hinges


def _runs(free: np.ndarray, stiffness: np.ndarray, faces: np.ndarray, side: int) -> tuple[np.ndarray, np.ndarray]:
    """Which faces lie along the rows of `free` cells, and of these their run, from 1 on.

    A tile's edge ends a run, and so does a cell much softer than the one before or behind it.
    """
    touching = faces & (free | framed(free, (0, 0), (1, 0))[:, :-1])
    around = framed(stiffness, (0, 0), (1, 1))
    firm = free & (EDGE * stiffness >= np.maximum(around[:, 2:], around[:, :-2]))
    on = np.zeros_like(touching)
    on[:, 1:] = touching[:, 1:] & touching[:, :-1] & firm[:, :-1] & (np.arange(1, free.shape[1]) % side != 0)
    return touching, np.cumsum(~on[touching])

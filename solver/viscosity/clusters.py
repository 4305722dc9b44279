"""Direct solves with a sparse symmetric positive matrix that falls into clusters, small ones and long ones."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from solver.components import connected_components

# Unknowns of a cluster that is inverted with all the others of its kind at once; larger ones are eliminated by strips.
SMALL = 8


class Block(NamedTuple):
    """Unknowns that are eliminated together; `parent` is the later block that they are coupled with, -1 for none."""

    unknowns: np.ndarray
    parent: int
    inverse: np.ndarray
    beside: np.ndarray


class ClusterMatrix:
    """The sum of a matrix and its transpose, given by its entries, inverted once in float64 and then applied.

    A small cluster is inverted as it is. The unknowns of the others are ordered by strips of the plane, each coupled to
    its neighbours only, and eliminated from one strip to the next: block Gaussian elimination. Unknowns of a strip that
    no strip up to it connects are separate blocks, so that the arms of a coil stay apart.

    Args:
        cluster: number of the cluster of each unknown; entries between two clusters are left out.
        strip: number of the strip of each unknown.
        rows, columns, values: the entries.
    """

    def __init__(
        self, cluster: np.ndarray, strip: np.ndarray, rows: np.ndarray, columns: np.ndarray, values: np.ndarray
    ) -> None:
        same = cluster[rows] == cluster[columns]
        rows, columns, values = rows[same], columns[same], values[same]
        members = np.bincount(cluster)
        is_small = members[cluster] <= SMALL
        within = is_small[rows]
        self._of_small = np.nonzero(is_small)[0]
        # Of the unknowns of small clusters: the number of theirs, and the place in it.
        _, self._number, self._place = _grouped(cluster[self._of_small])
        self._count = int(self._number.max(initial=-1)) + 1
        at = np.zeros(len(cluster), int)
        at[self._of_small] = SMALL * self._number + self._place
        block_at = at[rows[within]] * SMALL + at[columns[within]] % SMALL
        blocks = np.bincount(block_at, values[within], self._count * SMALL**2).reshape(-1, SMALL, SMALL)
        self._small_inverse = np.linalg.inv(_regular(blocks + blocks.swapaxes(1, 2)))
        self._blocks: list[Block] = []
        if len(self._of_small) < len(cluster):
            large = np.nonzero(~is_small)[0]
            self._eliminate(large, strip, rows[~within], columns[~within], values[~within])

    def _eliminate(
        self, large: np.ndarray, strip: np.ndarray, rows: np.ndarray, columns: np.ndarray, values: np.ndarray
    ) -> None:
        """Make the blocks of the `large` clusters' unknowns, in the order of elimination."""
        turned = strip[rows] > strip[columns]
        rows, columns = np.where(turned, columns, rows), np.where(turned, rows, columns)
        # What the strips so far connect, when each of them is the last one.
        last = strip[columns]
        root, component = np.arange(len(strip)), np.zeros(len(strip), int)
        for number in range(int(strip[large].min()), int(strip[large].max()) + 1):
            here = last == number
            root = connected_components(root, rows[here], columns[here])
            there = large[strip[large] == number]
            component[there] = root[there]
        order, number, place_of = _grouped(strip[large] * len(strip) + component[large])
        block, place = np.zeros((2, len(strip)), int)
        block[large], place[large] = number, place_of
        sizes = np.bincount(number)
        unknowns = np.split(large[order], np.cumsum(sizes)[:-1])
        # Entries within blocks, and from each to its parent.
        own = block[rows] == block[columns]
        parent = np.full(len(sizes), -1)
        parent[block[rows[~own]]] = block[columns[~own]]
        widths = np.where(parent >= 0, sizes[parent], 0)
        own_at, beside_at = (np.concatenate([[0], np.cumsum(sizes * width)]) for width in (sizes, widths))
        sums = []
        for starts, width, chosen in ((own_at, sizes, own), (beside_at, widths, ~own)):
            row, column = rows[chosen], columns[chosen]
            at = starts[block[row]] + place[row] * width[block[row]] + place[column]
            sums.append(np.bincount(at, values[chosen], starts[-1]))
        matrices = [sums[0][own_at[k] : own_at[k + 1]].reshape(size, size) for k, size in enumerate(sizes)]
        matrices = [matrix + matrix.T for matrix in matrices]
        for k, size in enumerate(sizes):
            inverse = np.linalg.inv(_regular(matrices[k]))
            beside = sums[1][beside_at[k] : beside_at[k + 1]].reshape(size, widths[k])
            self._blocks.append(Block(unknowns[k], int(parent[k]), inverse, beside))
            if parent[k] >= 0:
                matrices[parent[k]] -= beside.T @ (inverse @ beside)

    def solve(self, rhs: np.ndarray) -> np.ndarray:
        """The solution for a right-hand side, (n,) both."""
        solution, rhs = np.zeros(len(rhs)), rhs.copy()
        small = np.zeros((self._count, SMALL))
        small[self._number, self._place] = rhs[self._of_small]
        solution[self._of_small] = np.einsum("nij,nj->ni", self._small_inverse, small)[self._number, self._place]
        for unknowns, parent, inverse, beside in self._blocks:
            solution[unknowns] = inverse @ rhs[unknowns]
            if parent >= 0:
                rhs[self._blocks[parent].unknowns] -= beside.T @ solution[unknowns]
        for unknowns, parent, inverse, beside in reversed(self._blocks):
            if parent >= 0:
                solution[unknowns] -= inverse @ (beside @ solution[self._blocks[parent].unknowns])
        return solution


def _grouped(groups: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The order of things by their groups; of each the number of its group, from 0 on, and its place in that."""
    order = np.argsort(groups, kind="stable")
    ordered = groups[order]
    is_first = np.append(True, ordered[1:] != ordered[:-1])[: len(groups)]
    number, place = np.zeros((2, len(groups)), int)
    number[order] = np.cumsum(is_first) - 1
    place[order] = np.arange(len(groups)) - np.searchsorted(ordered, ordered)
    return order, number, place


def _regular(blocks: np.ndarray) -> np.ndarray:
    """Blocks with one on the diagonal for unknowns that nothing meets: padding, and turns of what has no arm."""
    size = blocks.shape[-1]
    diagonal = blocks[..., np.arange(size), np.arange(size)]
    largest = diagonal.max(axis=-1, initial=1.0, keepdims=True)
    blocks[..., np.arange(size), np.arange(size)] += (diagonal <= 1e-12 * largest) * largest
    return blocks

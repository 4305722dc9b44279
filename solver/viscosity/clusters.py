"""Direct solves with a sparse symmetric positive matrix that falls into clusters, small ones and long ones."""

from __future__ import annotations

import numpy as np

# Unknowns of a cluster that is inverted with all the others of its kind at once; larger ones are eliminated by strips.
SMALL = 8


def connected(count: int, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """For each of `count` things the smallest number it is connected to, by the links `one[k]` to `other[k]`."""
    root = np.arange(count)
    while True:
        a, b = root[one], root[other]
        apart = a != b
        if not apart.any():
            return root
        a, b, one, other = a[apart], b[apart], one[apart], other[apart]
        np.minimum.at(root, np.maximum(a, b), np.minimum(a, b))
        while (root != root[root]).any():
            root = root[root]


class ClusterMatrix:
    """A matrix of clusters, inverted once in float64 and then applied.

    A small cluster is inverted as it is. The unknowns of the others are ordered by strips of the plane of which each
    meets its neighbours only, and eliminated from one strip to the next: block Gaussian elimination.

    Args:
        cluster: number of the cluster of each unknown; entries between two clusters are left out.
        strip: number of the strip of each unknown.
    """

    def __init__(self, cluster: np.ndarray, strip: np.ndarray) -> None:
        members = np.bincount(cluster)
        self._is_small = members[cluster] <= SMALL
        self._cluster = cluster
        # Small clusters: their number among the small ones, and the place in them.
        numbers = np.cumsum((members > 0) & (members <= SMALL)) - 1
        self._of_small = np.nonzero(self._is_small)[0]
        self._block, self._place = np.zeros((2, len(cluster)), int)
        self._block[self._of_small] = numbers[cluster[self._of_small]]
        self._place[self._of_small] = _places(cluster[self._of_small])
        self._count = int(numbers[-1]) + 1 if len(members) else 0
        # Large ones: the strips with something in them, in their order.
        large = np.nonzero(~self._is_small)[0]
        self._strip = np.where(self._is_small, -1, strip)
        self._first = int(strip[large].min()) if len(large) else 0
        self._place[large] = _places(strip[large])
        strips = np.bincount(strip[large] - self._first)
        self._sizes = strips
        self._rows = [large[strip[large] == self._first + number] for number in range(len(strips))]
        self._diagonal_at = np.concatenate([[0], np.cumsum(strips**2)])
        self._beside_at = np.concatenate([[0], np.cumsum(strips[:-1] * strips[1:])])
        self._small_inverse = np.zeros((0, SMALL, SMALL))
        self._pivots: list[np.ndarray] = []
        self._beside: list[np.ndarray] = []

    def factor(self, rows: np.ndarray, columns: np.ndarray, values: np.ndarray) -> None:
        """Take up the sum of a matrix of such entries and its transpose, and invert it."""
        same = self._cluster[rows] == self._cluster[columns]
        rows, columns, values = rows[same], columns[same], values[same]
        is_small = self._is_small[rows]
        small = rows[is_small]
        at = (self._block[small] * SMALL + self._place[small]) * SMALL + self._place[columns[is_small]]
        blocks = np.bincount(at, values[is_small], self._count * SMALL**2).reshape(-1, SMALL, SMALL)
        self._small_inverse = np.linalg.inv(_regular(blocks + blocks.swapaxes(1, 2)))
        if not len(self._sizes):
            return
        rows, columns, values = rows[~is_small], columns[~is_small], values[~is_small]
        strip, other = self._strip[rows] - self._first, self._strip[columns] - self._first
        row, column = self._place[rows], self._place[columns]
        within = strip == other
        at = (self._diagonal_at[strip] + row * self._sizes[strip] + column)[within]
        diagonal = np.bincount(at, values[within], self._diagonal_at[-1])
        # From each strip to the next one.
        row, column = (np.where(other > strip, a, b)[~within] for a, b in ((row, column), (column, row)))
        strip = np.minimum(strip, other)[~within]
        at = self._beside_at[strip] + row * self._sizes[1:][strip] + column
        beside = np.bincount(at, values[~within], self._beside_at[-1])
        self._pivots, self._beside = [], []
        for number, size in enumerate(self._sizes):
            block = diagonal[self._diagonal_at[number] : self._diagonal_at[number + 1]].reshape(size, size)
            block = _regular(block + block.T)
            if number:
                upper = self._beside[-1]
                block -= upper.T @ (self._pivots[-1] @ upper)
            self._pivots.append(np.linalg.inv(block))
            if number + 1 < len(self._sizes):
                first, last = self._beside_at[number : number + 2]
                self._beside.append(beside[first:last].reshape(size, self._sizes[number + 1]))

    def solve(self, rhs: np.ndarray) -> np.ndarray:
        """The solution for the unknowns."""
        solution = np.zeros(len(rhs))
        small = np.zeros((self._count, SMALL))
        block, place = self._block[self._of_small], self._place[self._of_small]
        small[block, place] = rhs[self._of_small]
        solution[self._of_small] = np.einsum("nij,nj->ni", self._small_inverse, small)[block, place]
        halfway: list[np.ndarray] = []
        for number, rows in enumerate(self._rows):
            load = rhs[rows]
            if number:
                load = load - self._beside[number - 1].T @ halfway[-1]
            halfway.append(self._pivots[number] @ load)
        for number in reversed(range(len(self._rows))):
            rows = self._rows[number]
            solution[rows] = halfway[number]
            if number + 1 < len(self._rows):
                solution[rows] -= self._pivots[number] @ (self._beside[number] @ solution[self._rows[number + 1]])
        return solution


def _places(groups: np.ndarray) -> np.ndarray:
    """The place of each in its group, in order."""
    order = np.argsort(groups, kind="stable")
    ordered = groups[order]
    places = np.empty(len(groups), int)
    places[order] = np.arange(len(groups)) - np.searchsorted(ordered, ordered)
    return places


def _regular(blocks: np.ndarray) -> np.ndarray:
    """Blocks with one on the diagonal for unknowns that nothing meets: padding, and turns of what has no arm."""
    size = blocks.shape[-1]
    diagonal = blocks[..., np.arange(size), np.arange(size)]
    largest = diagonal.max(axis=-1, initial=1.0, keepdims=True)
    blocks[..., np.arange(size), np.arange(size)] += (diagonal <= 1e-12 * largest) * largest
    return blocks

"""The coarse unknowns among solids, in NumPy: connected pieces of blocks of 2 x 2 cells, and the links between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solver.components import connected_components

# The links of a coarser graph are those of the finer one, added up, over this. A linear pressure, interpolated as
# constant on blocks, has twice its energy, so 2 would be exact, and of impulses between thin walls the more is left the
# smaller it is (after four cycles 6e-4 with 1.6, 1.5e-4 with 1.8, 6e-5 with 2). But of pressures really constant on
# blocks two visits take 2 c - c^2: .64 with 1.6, .36 with 1.8, nothing with 2, and the cycle must not be singular.
OVERCORRECTION = 1.8


def links_of(closed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The open part of every left and every upper face, each (ny, nx): that of the cell closed more, 0-1, beside it."""
    left, up = np.zeros(closed.shape, np.float32), np.zeros(closed.shape, np.float32)
    left[:, 1:] = 1 - np.maximum(closed[:, 1:], closed[:, :-1])
    up[1:] = 1 - np.maximum(closed[1:], closed[:-1])
    return left, up


def even(cells: np.ndarray) -> np.ndarray:
    """Cells (ny, nx) with zeros up to even numbers of rows and columns."""
    return np.pad(cells, ((0, cells.shape[0] % 2), (0, cells.shape[1] % 2)))


def has_one_piece_a_block(left: np.ndarray, up: np.ndarray) -> bool:
    """True if the cells of each block of 2 x 2 are connected within it; links as of `links_of`, (ny, nx) each."""
    left, up = even(left) > 0.0, even(up) > 0.0
    linked = left | up
    linked[:, :-1] |= left[:, 1:]
    linked[:-1] |= up[1:]
    cells = sum(linked[j::2, i::2].astype(int) for j in (0, 1) for i in (0, 1))
    inside = left[::2, 1::2].astype(int) + left[1::2, 1::2] + up[1::2, ::2] + up[1::2, 1::2]
    return bool((cells - inside + (inside == 4) <= 1).all())


def coarsen_links(left: np.ndarray, up: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The links between blocks of 2 x 2 cells, (ny / 2, nx / 2) each, rounded up: the mean of the finer ones."""
    left, up = even(left), even(up)
    return 0.5 * (left[::2, ::2] + left[1::2, ::2]), 0.5 * (up[::2, ::2] + up[::2, 1::2])


@dataclass(frozen=True)
class Graph:
    """Unknowns and the links between them.

    Attributes:
        place: cell (x, y) of its level that each unknown lies in, (n, 2).
        ends: the two unknowns of each link, (m, 2).
        weight: of each link, (m,).
    """

    place: np.ndarray
    ends: np.ndarray
    weight: np.ndarray

    @classmethod
    def of_cells(cls, left: np.ndarray, up: np.ndarray, aspect: float) -> Graph:
        """The cells of a grid, row after row, of links (ny, nx); those down weigh `aspect`^2 times as much (P3)."""
        ny, nx = left.shape
        number = np.arange(ny * nx).reshape(ny, nx)
        x, y = np.meshgrid(np.arange(nx), np.arange(ny))
        across, down = left > 0.0, up > 0.0
        here, there = np.r_[number[across], number[down]], np.r_[number[across] - 1, number[down] - nx]
        weight = np.r_[left[across], aspect**2 * up[down]]
        return cls(np.stack([x.ravel(), y.ravel()], axis=1), np.stack([here, there], axis=1), weight)

    def coarsen(self) -> tuple[Graph, np.ndarray]:
        """The graph of the connected pieces of blocks; and each unknown's piece, (n,), -1 where that has no links."""
        count, block = len(self.place), self.place // 2
        inside = (block[self.ends[:, 0]] == block[self.ends[:, 1]]).all(axis=1)
        first = connected_components(np.arange(count), *self.ends[inside].T)
        ends = first[self.ends[~inside]]
        pieces = np.unique(ends)
        piece = np.full(count, -1)
        piece[pieces] = np.arange(len(pieces))
        low, high = np.sort(piece[ends], axis=1).T
        pairs, which = np.unique(low * len(pieces) + high, return_inverse=True)
        weight = np.bincount(which, self.weight[~inside], len(pairs)) / OVERCORRECTION
        ends = np.stack(np.divmod(pairs, max(len(pieces), 1)), axis=1)
        return Graph(block[pieces], ends, weight), piece[first]

    def renumber(self, order: np.ndarray) -> Graph:
        """The same graph with the unknown `order[k]` as number k; `order` is a permutation, (n,)."""
        number = np.empty_like(order)
        number[order] = np.arange(len(order))
        return Graph(self.place[order], number[self.ends], self.weight)

    def neighbours(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Where in a list each unknown's neighbours begin, how many; the list (neighbour, weight), (2 m, 2)."""
        here, there = np.r_[self.ends[:, 0], self.ends[:, 1]], np.r_[self.ends[:, 1], self.ends[:, 0]]
        order = np.argsort(here, kind="stable")
        number = np.bincount(here, minlength=len(self.place))
        listed = np.stack([there[order], np.r_[self.weight, self.weight][order]], axis=1)
        return np.cumsum(number) - number, number, listed

    def inverse(self) -> np.ndarray:
        """The inverse of A (P3), (n, n) float64, the mean of each component held at 0.

        For right-hand sides that sum to 0 in each component, as A leaves a constant open there.
        """
        count = len(self.place)
        matrix = np.zeros((count, count))
        np.add.at(matrix, (self.ends[:, 0], self.ends[:, 1]), self.weight)
        matrix += matrix.T
        matrix -= np.diag(matrix.sum(axis=1))
        label = connected_components(np.arange(count), *self.ends.T)
        together = label[:, None] == label
        return np.linalg.inv(matrix - together / together.sum(axis=1))


def graphs_below(cells: Graph, most: int) -> tuple[list[Graph], list[np.ndarray]]:
    """The graphs of pieces below a grid's cells, down to one of at most `most` unknowns.

    Returns:
        graphs: from the finest on, numbered so that the finer unknowns of each coarser one stand next to each other.
        parents: of the cells and of every graph but the last: each unknown's on the next level, (n,), or -1.
    """
    graphs, parents = [cells], []
    while len(graphs) == 1 or len(graphs[-1].place) > most:
        graph, parent = graphs[-1].coarsen()
        graphs.append(graph)
        parents.append(parent)
    for k in range(len(graphs) - 2, 0, -1):
        # Those that stand for nothing on the next level come last.
        order = np.argsort(np.where(parents[k] < 0, len(graphs[k + 1].place), parents[k]), kind="stable")
        graphs[k], parents[k] = graphs[k].renumber(order), parents[k][order]
        number = np.empty_like(order)
        number[order] = np.arange(len(order))
        parents[k - 1] = np.where(parents[k - 1] < 0, -1, number[parents[k - 1]])
    return graphs[1:], parents

"""The multigrid cycle: a symmetric negative definite approximation of the inverse of the pressure's matrix."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from solver.packing import is_worth_a_transform
from solver.pressure.graph import Graph, coarsen_links, graphs_below, has_one_piece_a_block, links_of
from solver.pressure.level import DirectSolve, GraphLevel, GridLevel
from solver.pressure.transform import FastDiagonalization

if TYPE_CHECKING:
    from solver.gl.device import Device
    from solver.gl.field import Field

# A graph of at most so many unknowns is solved by a dense matrix. Preparing walls at 192 x 144 so takes 11 ms of
# processor time; with 256 unknowns it took 76.
DIRECT = 128


class Cycle:
    """Levels from the finest to one that is solved directly.

    An unknown of a level stands for a block of 2 x 2 cells of the finer one, or among solids for one connected piece of
    a block, so that no pressure leaks through a wall. Interpolation is constant, restriction its transpose, and the
    smoothing after the correction is that before it in reverse order: so the cycle is symmetric, which conjugate
    gradients need.

    Args:
        device: the device.
        size: (nx, ny) cells.
        aspect: side of a cell along x over that along y.
        solid: the part of each cell that is closed, (ny, nx), 0-1; None for no solids.
    """

    def __init__(self, device: Device, size: tuple[int, int], aspect: float, solid: np.ndarray | None) -> None:
        self.levels: list[GridLevel | GraphLevel] = []
        # The fraction of a warm start's residual that a cycle of one sweep leaves, rounded up from one flow each: .095
        # in a box, .14 or more around two discs.
        self.light_leaves = 0.1 if solid is None else 0.2
        self._direct = (
            self._coarsen_box(device, size, aspect) if solid is None else self._coarsen_around(device, solid, aspect)
        )

    @property
    def finest(self) -> GridLevel:
        level = self.levels[0]
        assert isinstance(level, GridLevel)
        return level

    def solve(self, residual: Field, sweeps: int) -> Field:
        """One cycle from zero: about A^-1 r, at blocks, for the `residual` r."""
        self._visit(0, residual, sweeps, from_zero=True)
        return self.levels[0].pressure.read

    def release(self) -> None:
        """Free the textures."""
        for item in (*self.levels, self._direct):
            item.release()

    def _visit(self, number: int, residual: Field, sweeps: int, from_zero: bool) -> None:
        level = self.levels[number]
        if number == len(self.levels) - 1:
            self._direct.solve(residual, level.pressure.read)
            return
        coarse = self.levels[number + 1]
        for sweep in range(sweeps):
            level.smooth(residual, from_zero=from_zero and sweep == 0)
        level.restrict(residual, coarse)
        self._visit(number + 1, coarse.residual, sweeps, from_zero=True)
        # Among thin walls one visit leaves too much to smooth. A second visit of the last level would change nothing,
        # and of the first coarse one it would cost as much as another cycle.
        if isinstance(coarse, GraphLevel) and 0 < number < len(self.levels) - 2:
            self._visit(number + 1, coarse.residual, sweeps, from_zero=False)
        level.prolong(coarse)
        for _ in range(sweeps):
            level.smooth(residual, backwards=True)

    def _coarsen_box(self, device: Device, size: tuple[int, int], aspect: float) -> FastDiagonalization:
        span = float(size[0]), float(size[1])
        level = GridLevel(device, span, aspect, 0)
        self.levels.append(level)
        while not is_worth_a_transform(level.size, is_finest=level is self.finest):
            span = span[0] / 2, span[1] / 2
            level = GridLevel(device, span, aspect, len(self.levels))
            self.levels.append(level)
        return FastDiagonalization(device, span, level.size, aspect)

    def _coarsen_around(self, device: Device, solid: np.ndarray, aspect: float) -> DirectSolve:
        left, up = links_of(solid)
        self.levels.append(GridLevel(device, solid.shape[::-1], aspect, 0, (left, up)))
        # As long as every block is one piece the coarser level is a grid as well, which costs less than a graph.
        while left.size > 4 * DIRECT and has_one_piece_a_block(left, up):
            left, up = coarsen_links(left, up)
            self.levels.append(GridLevel(device, left.shape[::-1], aspect, len(self.levels), (left, up)))
        graphs, parents = graphs_below(Graph.of_cells(left, up, aspect), DIRECT)
        grid = left.shape[1], left.shape[0]
        for k, graph in enumerate(graphs):
            above = parents[k + 1] if k + 1 < len(parents) else None
            self.levels.append(GraphLevel(device, graph, len(self.levels), parents[k], None if k else grid, above))
        return DirectSolve(device, graphs[-1])

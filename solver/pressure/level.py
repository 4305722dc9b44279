"""The levels of the pressure's multigrid: grids of cells, and among thin walls graphs of connected pieces."""

from __future__ import annotations

from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np

from solver.packing import packed
from solver.pressure.graph import Graph, even

if TYPE_CHECKING:
    from solver.gl.device import Device
    from solver.gl.field import Field
    from solver.gl.passes import Target

WIDTH = 256  # unknowns to a row of a list's texture, as in shaders/pressure/graph.glsl


class GridLevel:
    """A level of cells, 2 x 2 a texel, smoothed by red-black Gauss-Seidel.

    Args:
        device: the device.
        span: the finest grid's size in cells of this level; it halves exactly, the last cells may be less than whole.
        aspect: side of a cell along x over that along y.
        number: of the level, in labels.
        links: weights of the left and of the upper faces, (ny, nx); None without solids.
    """

    def __init__(
        self,
        device: Device,
        span: tuple[float, float],
        aspect: float,
        number: int,
        links: tuple[np.ndarray, np.ndarray] | None = None,
    ) -> None:
        self.device = device
        self.size = (ceil(span[0] / 2), ceil(span[1] / 2))
        label = f"pressure level {number}"
        self.residual = device.field(self.size, 4, f"{label} residual")
        self.pressure = device.double_field(self.size, 4, f"{label} pressure")
        self.inputs: dict[str, Any] = {"aspect": aspect}
        self.defines: dict[str, Any] = {}
        self._textures: dict[str, Field] = {}
        if links is None:
            self.defines["OPEN"] = 1
            self.inputs["span"] = span
        else:
            left, up = (np.pad(even(weights), ((0, 2), (0, 2))) for weights in links)
            right, down = left[:-2, 2::2], up[2::2, :-2]
            far = np.stack([right[::2], right[1::2], down[:, ::2], down[:, 1::2]], axis=-1)
            total = left[:-2, :-2] + left[:-2, 1:-1] + aspect**2 * (up[:-2, :-2] + up[1:-1, :-2])
            inverse = np.divide(1.0, total, out=np.zeros_like(total), where=total > 0.0)
            textures = {"left": packed(left), "up": packed(up), "far": far, "inverse": packed(inverse)}
            for name, texels in textures.items():
                texels = texels[: self.size[1], : self.size[0]]
                # One over the links of a cell far longer than wide may be more than 16 bits hold.
                dtype = "f2" if texels.max(initial=0.0) <= np.finfo(np.float16).max else "f4"
                self._textures[name] = device.upload(texels, f"{label} {name}", dtype)
            self.inputs |= self._textures

    def draw(self, shader: str, target: Target, defines: dict[str, Any] | None = None, **inputs: Any) -> None:
        """Draw a pass that needs the links of the level."""
        self.device.pass_(f"pressure/{shader}.frag", **self.defines, **(defines or {}))(target, **self.inputs, **inputs)

    def smooth(self, residual: Field, backwards: bool = False, from_zero: bool = False) -> None:
        """A sweep over the red cells and the black ones; backwards the black ones first."""
        if from_zero:
            self.draw("smooth", self.pressure.write, {"FROM_ZERO": 1}, residual=residual)
            self.pressure.swap()
            return
        colours: tuple[dict[str, Any], ...] = ({"RED": 1}, {})
        for colour in reversed(colours) if backwards else colours:
            self.draw("smooth", self.pressure.write, colour, pressure=self.pressure.read, residual=residual)
            self.pressure.swap()

    def restrict(self, residual: Field, coarse: GridLevel | GraphLevel) -> None:
        """r - A p becomes the residual of the coarser level."""
        defines, inputs = ({"GRAPH": 1}, {"cells": coarse.children}) if isinstance(coarse, GraphLevel) else ({}, {})
        self.draw("restrict", coarse.residual, defines, pressure=self.pressure.read, residual=residual, **inputs)

    def prolong(self, coarse: GridLevel | GraphLevel) -> None:
        """Add the coarser level's correction."""
        inputs: dict[str, Any] = {"pressure": self.pressure.read, "coarse": coarse.pressure.read}
        defines: dict[str, Any] = {}
        if isinstance(coarse, GraphLevel):
            defines["GRAPH"] = 1
            inputs["parents"] = coarse.parents
        self.device.pass_("pressure/prolong.frag", **defines)(self.pressure.write, **inputs)
        self.pressure.swap()

    def release(self) -> None:
        """Free the textures."""
        for item in (self.residual, self.pressure, *self._textures.values()):
            item.release()


class GraphLevel:
    """A level of the connected pieces of blocks, in a list, smoothed by damped Jacobi.

    Args:
        device: the device.
        graph: its unknowns, and the links between them.
        number: of the level, in labels.
        finer: for each of the finer level's unknowns, cells row after row or a list, the unknown of this one, or -1.
        grid: (nx, ny) of the finer level, if that is one of cells.
        parents: of the unknowns, on the next level, or -1; None on the last.
    """

    def __init__(
        self,
        device: Device,
        graph: Graph,
        number: int,
        finer: np.ndarray,
        grid: tuple[int, int] | None,
        parents: np.ndarray | None,
    ) -> None:
        self.device = device
        count, label = len(graph.place), f"pressure level {number}"
        first, neighbours, listed = graph.neighbours()
        diagonal = np.bincount(graph.ends.ravel(), np.repeat(graph.weight, 2), count)
        up = np.full(count, -1) if parents is None else parents
        self._rows = _upload(device, np.stack([first, neighbours, diagonal, up], axis=1), f"{label} rows")
        self._links = _upload(device, listed, f"{label} links")
        self.residual = device.field(self._rows.size, 1, f"{label} residual")
        self.pressure = device.double_field(self._rows.size, 1, f"{label} pressure")
        self.parents: Field | None = None
        if grid is None:
            children = np.bincount(finer[finer >= 0], minlength=count)
            self.children = _upload(device, np.c_[np.cumsum(children) - children, children], f"{label} children")
        else:
            cells = finer.reshape(grid[1], grid[0])
            y, x = np.nonzero(cells >= 0)
            bits = np.bincount(cells[y, x], 1 << (x % 2 + 2 * (y % 2)), count)
            self.children = _upload(device, np.c_[graph.place, bits], f"{label} cells")
            self.parents = device.upload(packed(even(cells + 1.0) - 1.0), f"{label} parents")

    def smooth(self, residual: Field, backwards: bool = False, from_zero: bool = False) -> None:
        """A sweep, the same in both directions."""
        zero = {"FROM_ZERO": 1} if from_zero else {}
        read: dict[str, Any] = {} if from_zero else {"pressure": self.pressure.read, "links": self._links}
        smooth = self.device.pass_("pressure/smooth_graph.frag", **zero)
        smooth(self.pressure.write, rows=self._rows, residual=residual, **read)
        self.pressure.swap()

    def restrict(self, residual: Field, coarse: GridLevel | GraphLevel) -> None:
        """r - A p becomes the residual of the coarser level."""
        assert isinstance(coarse, GraphLevel)
        self.device.pass_("pressure/restrict_graph.frag")(
            coarse.residual, pressure=self.pressure.read, residual=residual, rows=self._rows, links=self._links,
            children=coarse.children,
        )  # fmt: skip

    def prolong(self, coarse: GridLevel | GraphLevel) -> None:
        """Add the coarser level's correction."""
        prolong = self.device.pass_("pressure/prolong_graph.frag")
        prolong(self.pressure.write, pressure=self.pressure.read, rows=self._rows, coarse=coarse.pressure.read)
        self.pressure.swap()

    def release(self) -> None:
        """Free the textures."""
        for item in (self._rows, self._links, self.residual, self.pressure, self.children, self.parents):
            if item is not None:
                item.release()


class DirectSolve:
    """The inverse of a small graph's matrix.

    Args:
        device: the device.
        graph: of at most some hundred unknowns.
    """

    def __init__(self, device: Device, graph: Graph) -> None:
        self.device = device
        self._count = len(graph.place)
        padded = -(-max(self._count, 1) // 4) * 4
        inverse = np.pad(graph.inverse(), ((0, int(self._count == 0)), (0, padded - self._count)))
        self._inverse = device.upload(inverse.reshape(len(inverse), -1, 4), "pressure inverse")

    def solve(self, residual: Field, pressure: Field) -> None:
        """Solve A `pressure` = `residual`."""
        direct_solve = self.device.pass_("pressure/direct_solve.frag")
        direct_solve(pressure, residual=residual, inverse=self._inverse, count=self._count)

    def release(self) -> None:
        """Free the texture."""
        self._inverse.release()


def _upload(device: Device, rows: np.ndarray, label: str) -> Field:
    """A list of 2, 3 or 4 numbers each as a texture, WIDTH of them to a row."""
    height = max(-(-len(rows) // WIDTH), 1)
    texels = np.zeros((height * WIDTH, 2 if rows.shape[1] == 2 else 4), np.float32)
    texels[: len(rows), : rows.shape[1]] = rows
    return device.upload(texels.reshape(height, WIDTH, -1), label)

"""The implicit viscous step: (I - dt div mu (grad v + grad v^T)) v = v*, for viscosity that varies from cell to cell."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from solver.context import Device
from solver.field import DoubleField, Field
from solver.params import Walls
from solver.passes import Region
from solver.reduce import Reduction
from solver.stiff_parts import StiffParts

# Texels (of 2 x 2 cells) of the coarsest grid, on which the inverse matrix is at hand.
COARSEST = 64
# Eigenvalues of D^-1 A that a smoothing sweep is for: the upper end is above all that occur, the lower one is about where
# the next grid takes over.
SMOOTHED = (0.7, 8 / 3)


@dataclass(frozen=True)
class Plan:
    """How much is solved: chosen once for each viscosity and time step, see `plan_for`.

    Attributes:
        nested: multigrid cycles on each coarser grid while the start is carried up through them.
        steps: conjugate gradient steps after that, each with one multigrid cycle.
        sweeps: smoothing sweeps before and after the coarser grids: (on the finest, on the others).
        stiff: dt mu / h^2 above which patches of fluid are moved as rigid pieces too; 0: none are.
        visits: how often a cycle goes from a grid to the next coarser one, from the finest on; the last holds below.
    """

    nested: int = 1
    steps: int = 2
    sweeps: tuple[int, int] = (2, 2)
    stiff: float = 0.0
    visits: tuple[int, ...] = (1,)


def plan_for(least: float, largest: float) -> Plan:
    """The plan for dt mu / h^2 between `least` and `largest`."""
    return Plan(stiff=max(100.0, math.sqrt(least * largest)) if largest > 1e3 * least else 0.0)


class Pair:
    """Packed faces: u and v, 2 x 2 a texel, inside a ring of zeros (see shaders/viscosity/block.glsl)."""

    def __init__(self, device: Device, size: tuple[int, int], label: str) -> None:
        self.u = device.field(size, 4, f"{label} u")
        self.v = device.field(size, 4, f"{label} v")

    @property
    def fields(self) -> tuple[Field, Field]:
        return self.u, self.v

    def inputs(self, name: str = "") -> dict[str, object]:
        """The pair as a pass's inputs `<name>u` and `<name>v`."""
        return {f"{name}u": self.u, f"{name}v": self.v}

    def release(self) -> None:
        self.u.release()
        self.v.release()


class DoublePair:
    """A ping-pong of pairs: `read`, `write` and `swap()`."""

    def __init__(self, device: Device, size: tuple[int, int], label: str) -> None:
        self.read = Pair(device, size, f"{label} a")
        self.write = Pair(device, size, f"{label} b")

    def swap(self) -> None:
        self.read, self.write = self.write, self.read

    def release(self) -> None:
        self.read.release()
        self.write.release()


class Level:
    """One grid of the hierarchy: its matrix, its right-hand side and its iterate."""

    def __init__(self, device: Device, size: tuple[int, int], depth: int) -> None:
        self.size = size
        self.depth = depth
        self.texels = -(-size[0] // 2), -(-size[1] // 2)
        self.region: Region = (1, 1, *self.texels)
        ringed = self.texels[0] + 2, self.texels[1] + 2
        label = f"viscous grid {depth}"
        # One more row and column than the packed cells have, for the nodes on the far walls.
        self.cells = device.field((2 * self.texels[0] + 1, 2 * self.texels[1] + 1), 4, f"{label} cells")
        self.packed = {
            name: device.field(ringed, 4, f"{label} {name}")
            for name in ("cells_x", "cells_y", "nodes", "cell_halo", "node_halo", "inverse_u", "inverse_v", "open")
        }
        self.right = Pair(device, ringed, f"{label} right-hand side")
        self.faces = DoublePair(device, ringed, f"{label} faces")
        self.defines: dict[str, object] = {"FINEST": 1} if depth == 0 else {}

    @property
    def matrix(self) -> dict[str, object]:
        """The inputs of shaders/viscosity/block.glsl."""
        return {name: field for name, field in self.packed.items() if name != "open"}

    @property
    def inverse(self) -> dict[str, object]:
        """1 / diagonal, as inputs."""
        return {name: self.packed[name] for name in ("inverse_u", "inverse_v")}

    @property
    def is_coarsest(self) -> bool:
        return self.texels[0] * self.texels[1] <= COARSEST

    def release(self) -> None:
        for item in (self.cells, *self.packed.values(), self.right, self.faces):
            item.release()


class Viscosity:
    """Solves the viscous step by multigrid-preconditioned conjugate gradients, started on nested grids.

    Everything stays on the GPU but the inverse on the coarsest grid, which is made anew when the viscosity changes.
    Conservative stress form; error against the exact solution and cost: see `tests/test_viscosity.py` and `plan_for`.

    Args:
        device: where it lives.
        size: (nx, ny) of the grid.
    """

    def __init__(self, device: Device, size: tuple[int, int]) -> None:
        self.device = device
        self.size = size
        self.plan = Plan()
        self._slip: dict[str, object] = {}
        self._lid: dict[str, object] = {}
        self.levels: list[Level] = []
        while not self.levels or not self.levels[-1].is_coarsest:
            self.levels.append(Level(device, size, len(self.levels)))
            size = -(-size[0] // 2), -(-size[1] // 2)
        unknowns = 8 * math.prod(self.levels[-1].texels)
        self._inverse = device.field((unknowns // 4, unknowns), 4, "viscous inverse")
        finest = self.levels[0]
        ringed = finest.right.u.size
        self._solution = DoublePair(device, ringed, "viscous solution")
        self._residual = DoublePair(device, ringed, "viscous residual")
        self._direction = DoublePair(device, ringed, "viscous direction")
        self._stress = DoublePair(device, ringed, "viscous direction's stress")
        self._stiff_parts = StiffParts(device, finest.texels)
        self._factors = device.double_field((1, 1), 4, "viscous step")
        self._products = device.field(ringed, 2, "viscous products")
        self._sum = Reduction(device, ringed, 2, "sum")

    # -- what is solved ---------------------------------------------------------------------------------------------

    def set_coefficients(self, viscosity: Field, solid: Field, dt: float, walls: Walls) -> None:
        """Take up another viscosity (cells, lengths^2 / s), solid cells (1 = solid), time step (s) or walls."""
        self._slip = {"NO_SLIP": 1} if walls.slip == "none" else {}
        self._lid = {"wall_speed": walls.speed} if walls.slip == "none" else {}
        dt_over_h2 = dt * max(self.size) ** 2
        inputs: dict[str, object] = {"viscosity": viscosity, "solid": solid, "dt_over_h2": dt_over_h2}
        stage = "viscosity/coefficients.frag"
        for level in self.levels:
            self.device.pass_(stage)(level.cells, **inputs)
            pack = self.device.pass_("viscosity/pack.frag", **self._slip)
            pack(list(level.packed.values()), region=level.region, cells=level.cells)
            inputs, stage = {"cells": level.cells}, "viscosity/coarsen.frag"
        self._inverse.set(inverse_matrix(self.levels[-1]))
        frozen = solid.get() > 0
        scaled = np.where(frozen, np.nan, viscosity.get() * dt_over_h2)
        least, largest = (0.0, 0.0) if frozen.all() else (float(np.nanmin(scaled)), float(np.nanmax(scaled)))
        self.plan = plan_for(least, largest)
        stiff = scaled > self.plan.stiff if self.plan.stiff else np.zeros_like(frozen)
        self._stiff_parts.find(stiff, frozen, self._apply_matrix)

    def diffuse(self, velocity: DoubleField) -> None:
        """Replace the velocity on MAC faces (lengths / s) by the solution."""
        # NOTE FROM THE LEAD (remove when done): the error must be a fraction of the CHANGE v - v*, not of |v|: now a lid-
        # driven cavity at Re 100 ends at u_min -.159 instead of -.214 (worse for smaller dt), because 0.7 % of |v| is
        # wrong EVERY step. Solve A d = b - A v* for d, v = v* + d (FMG/CG on d). See tests/test_viscosity_change.py.
        finest = self.levels[0]
        load = self.device.pass_("viscosity/load.frag", **self._slip, **finest.defines)
        load(finest.right.fields, region=finest.region, velocity=velocity.read, **finest.matrix, **self._lid)
        self._start_on_nested_grids()
        solution = finest.faces.read
        if self.plan.steps:
            solution = self._conjugate_gradients()
        self.device.pass_("viscosity/store.frag")(velocity.write, **solution.inputs())
        velocity.swap()

    # -- conjugate gradients ----------------------------------------------------------------------------------------

    def _conjugate_gradients(self) -> Pair:
        """Improve the finest grid's iterate by `plan.steps` steps."""
        finest = self.levels[0]
        solution, residual, direction, stress = self._solution, self._residual, self._direction, self._stress
        solution.read, finest.faces.read = finest.faces.read, solution.read
        self._residual_of(finest, solution.read, finest.right, residual.read)
        if self._stiff_parts.count:
            self._stiff_parts.fit(residual.read.fields, solution.read.fields, solution.write.fields)
            solution.swap()
            self._residual_of(finest, solution.read, finest.right, residual.read)
        products = [self._products]
        for step in range(self.plan.steps):
            first: dict[str, object] = {"FIRST": 1} if step == 0 else {}
            last: dict[str, object] = {"LAST": 1} if step == self.plan.steps - 1 else {}
            self._cycle(finest, residual.read)
            if self._stiff_parts.count:
                self._stiff_parts.fit(residual.read.fields, finest.faces.read.fields, finest.faces.write.fields)
                finest.faces.swap()
            z, az = finest.faces.read, finest.faces.write
            measure = self.device.pass_("viscosity/measure.frag", **finest.defines)
            measure(
                (*az.fields, *products),
                region=finest.region,
                **z.inputs(),
                **residual.read.inputs("right_"),
                **finest.matrix,
            )
            factors = self.device.pass_("viscosity/gradients.frag", **first)
            factors(self._factors.write, products=self._sum.shrink(self._products), before=self._factors.read)
            self._factors.swap()
            targets = solution.write.fields
            if not last:
                targets += residual.write.fields + direction.write.fields + stress.write.fields
            self.device.pass_("viscosity/advance.frag", **first, **last)(
                targets,
                region=finest.region,
                factors=self._factors.read,
                **solution.read.inputs(),
                **residual.read.inputs("r_"),
                **direction.read.inputs("p_"),
                **stress.read.inputs("s_"),
                **z.inputs("z_"),
                **az.inputs("az_"),
            )
            for vector in (solution, residual, direction, stress):
                vector.swap()
        return solution.read

    # -- multigrid --------------------------------------------------------------------------------------------------

    def _start_on_nested_grids(self) -> None:
        """A first solution: exact on the coarsest grid, then carried up and improved grid by grid."""
        for finer, coarser in pairwise(self.levels):
            self._restrict(finer.right, coarser)
        self._solve_exactly(self.levels[-1].right)
        for finer, coarser in reversed(list(pairwise(self.levels))):
            prolong = self.device.pass_("viscosity/prolong.frag", START=1, **self._slip)
            prolong(
                finer.faces.write.fields,
                region=finer.region,
                **coarser.faces.read.inputs("coarse_"),
                **coarser.right.inputs("coarse_right_"),
                **finer.right.inputs(),
                **finer.inverse,
            )
            finer.faces.swap()
            self._smooth(finer, finer.right, self._weights(finer)[::-1])
            if finer.depth > 0 and self.plan.nested:
                # A cycle's coarser grids are used up by now; this one's right-hand side is still wanted.
                for _ in range(self.plan.nested):
                    self._cycle(finer, finer.right, warm=True)

    def _cycle(self, level: Level, right: Pair, warm: bool = False) -> None:
        """One multigrid cycle for A faces = right, from rest or (`warm`) from the level's iterate."""
        if level is self.levels[-1]:
            self._solve_exactly(right)
            return
        weights = self._weights(level)
        if not warm:
            start = self.device.pass_("viscosity/start.frag", **level.defines)
            start(
                level.faces.write.fields,
                region=level.region,
                weight=weights[0],
                **right.inputs("right_"),
                **level.matrix,
            )
            level.faces.swap()
        self._smooth(level, right, weights if warm else weights[1:])
        # The write side is free until the correction is added.
        self._residual_of(level, level.faces.read, right, level.faces.write)
        coarser = self.levels[level.depth + 1]
        self._restrict(level.faces.write, coarser)
        for visit in range(self._visits(level)):
            self._cycle(coarser, coarser.right, warm=visit > 0)
        self._prolong(coarser, level)
        self._smooth(level, right, weights[::-1])

    def _visits(self, level: Level) -> int:
        if level.depth >= len(self.levels) - 2:
            return 1
        return self.plan.visits[min(level.depth, len(self.plan.visits) - 1)]

    def _weights(self, level: Level) -> list[float]:
        """Chebyshev weights of the smoothing sweeps."""
        count = self.plan.sweeps[0 if level.depth == 0 else 1]
        middle, half = 0.5 * (SMOOTHED[1] + SMOOTHED[0]), 0.5 * (SMOOTHED[1] - SMOOTHED[0])
        return [1.0 / (middle + half * math.cos(math.pi * (2 * q + 1) / (2 * count))) for q in range(count)]

    def _smooth(self, level: Level, right: Pair, weights: list[float]) -> None:
        sweep = self.device.pass_("viscosity/sweep.frag", **level.defines)
        for weight in weights:
            sweep(
                level.faces.write.fields,
                region=level.region,
                weight=weight,
                **level.faces.read.inputs(),
                **right.inputs("right_"),
                **level.matrix,
            )
            level.faces.swap()

    def _residual_of(self, level: Level, faces: Pair, right: Pair, target: Pair) -> None:
        residual = self.device.pass_("viscosity/residual.frag", **level.defines)
        residual(target.fields, region=level.region, **faces.inputs(), **right.inputs("right_"), **level.matrix)

    def _apply_matrix(self, draw: Callable[[tuple[Field, Field]], None]) -> tuple[Field, Field]:
        """Minus the finest grid's matrix times the faces that `draw` fills, for `StiffParts.find`."""
        finest = self.levels[0]
        for field in (*finest.right.fields, *finest.faces.read.fields):
            field.clear()
        draw(finest.faces.read.fields)
        self._residual_of(finest, finest.faces.read, finest.right, self._residual.read)
        return self._residual.read.fields

    def _restrict(self, residual: Pair, coarser: Level) -> None:
        restrict = self.device.pass_("viscosity/restrict.frag", **self._slip)
        restrict(coarser.right.fields, region=coarser.region, open=coarser.packed["open"], **residual.inputs())

    def _prolong(self, coarser: Level, finer: Level) -> None:
        prolong = self.device.pass_("viscosity/prolong.frag", **self._slip)
        prolong(
            finer.faces.write.fields,
            region=finer.region,
            **coarser.faces.read.inputs("coarse_"),
            **finer.faces.read.inputs(),
            **finer.inverse,
        )
        finer.faces.swap()

    def _solve_exactly(self, right: Pair) -> None:
        level = self.levels[-1]
        exact = self.device.pass_("viscosity/exact.frag")
        exact(
            level.faces.write.fields,
            region=level.region,
            inverse=self._inverse,
            **right.inputs("right_"),
        )
        level.faces.swap()

    # -- statistics -------------------------------------------------------------------------------------------------

    def residual_norm(self, before: Field, after: Field) -> float:
        """|v* - A v| / |v*|, both velocities on MAC faces: v* before and v after the step; waits for the GPU."""
        finest = self.levels[0]
        load = self.device.pass_("viscosity/load.frag", **self._slip, **finest.defines)
        load(finest.right.fields, region=finest.region, velocity=before, **finest.matrix, **self._lid)
        still = {"wall_speed": (0.0, 0.0, 0.0, 0.0)} if self._lid else {}
        load(self._solution.read.fields, region=finest.region, velocity=after, **finest.matrix, **still)
        self._residual_of(finest, self._solution.read, finest.right, self._residual.read)
        wanted, left = (
            math.sqrt(sum(float((field.get().astype(np.float64) ** 2).sum()) for field in pair.fields))
            for pair in (finest.right, self._residual.read)
        )
        return left / wanted if wanted else 0.0

    @property
    def nbytes(self) -> int:
        """Bytes of texture memory."""
        return 0

    def release(self) -> None:
        """Free the textures."""
        for item in (*self.levels, self._inverse, self._solution, self._residual, self._direction, self._stress):
            item.release()
        self._factors.release()
        self._products.release()
        self._sum.release()


def inverse_matrix(level: Level) -> np.ndarray:
    """The inverse of a level's matrix as `shaders/viscosity/exact.frag` reads it, (unknowns, unknowns / 4, 4) float32."""
    width, height = level.texels
    packed = {name: field.get()[1:-1, 1:-1] for name, field in level.packed.items()}

    def unpacked(texels: np.ndarray) -> np.ndarray:
        return texels.reshape(height, width, 2, 2).transpose(0, 2, 1, 3).reshape(2 * height, 2 * width)

    cells_x, cells_y = (unpacked(packed[name]).astype(np.float64) for name in ("cells_x", "cells_y"))
    nodes = np.zeros((2 * height + 1, 2 * width + 1))
    nodes[:-1, :-1] = unpacked(packed["nodes"])
    nodes[:-1, -1] = packed["node_halo"][:, -1, :2].ravel()
    nodes[-1, :-1] = packed["node_halo"][-1, :, 2:].ravel()
    # Numbers of the unknowns in the order of the texels, -1 where a face is pinned, with a frame of pinned faces.
    texel = np.arange(width * height).reshape(height, width, 1) * 4 + np.arange(4)
    u = np.pad(np.where(unpacked(packed["inverse_u"]) > 0, unpacked(texel), -1), 1, constant_values=-1)
    v = np.pad(np.where(unpacked(packed["inverse_v"]) > 0, unpacked(texel) + texel.size, -1), 1, constant_values=-1)
    count = 2 * texel.size
    matrix = np.eye(count).ravel()
    strains = (
        (cells_x, ((u[1:-1, 2:], 1), (u[1:-1, 1:-1], -1))),
        (cells_y, ((v[2:, 1:-1], 1), (v[1:-1, 1:-1], -1))),
        (nodes, ((u[1:, 1:], 1), (u[:-1, 1:], -1), (v[1:, 1:], 1), (v[1:, :-1], -1))),
    )
    for stiffness, ends in strains:
        for row, row_sign in ends:
            for column, column_sign in ends:
                moves = (row >= 0) & (column >= 0)
                places = row[moves] * count + column[moves]
                matrix += np.bincount(places, row_sign * column_sign * stiffness[moves], count * count)
    inverse = np.linalg.inv(matrix.reshape(count, count))
    return inverse.reshape(count, count // 4, 4).astype(np.float32)

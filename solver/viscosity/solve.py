"""The implicit viscous step: (I - dt div mu (grad v + grad v^T)) v = v*, viscosity varying from cell to cell."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from solver.gl.device import Device
from solver.gl.field import DoubleField, Field
from solver.gl.passes import Region
from solver.gl.reduction import Reduction
from solver.gl.separable import ViscousWaves
from solver.packing import DoublePackedFaces, PackedFaces, Packing, unpacked
from solver.params import Walls
from solver.viscosity.deflation import StiffParts

# Texels (of 2 x 2 cells) of the coarsest grid, on which the inverse matrix is at hand.
COARSEST = 64
# dt mu / h^2 on the coarsest grid that is worth a visit.
LEAST_VISITED = 0.3
# Conjugate gradient steps, each of which keeps its way in memory.
MOST_STEPS = 5
# Eigenvalues of D^-1 A that a smoothing sweep is for: none found is above 8/3, at any contrast; the lower end is about
# where the next grid takes over.
SMOOTHED = (0.7, 8 / 3)


@dataclass(frozen=True)
class Plan:
    """How much is solved: chosen once for each viscosity and time step, see `plan_for`.

    Attributes:
        grids: coarser grids that are visited, at most; without any, and so without all that follows, v* is smoothed.
        nested: of these, the finest so many get a multigrid cycle while one correction is carried up through them.
        brief: such a cycle goes one grid down only.
        last: smoothing sweeps on the last of these grids, where it is not solved exactly; with 0 as on the others.
        steps: conjugate gradient steps after the first, at most, each with one multigrid cycle; with 0 there are no
            conjugate gradients: v* is corrected once and then smoothed.
        tolerance: steps end after one that has brought less than this part of the energy norm.
        sweeps: smoothing sweeps before and after the coarser grids: (on the finest, on the others).
        stiff: dt mu / h^2 above which patches of fluid are moved as rigid pieces too; 0: none are.
    """

    grids: int = 99
    nested: int = 99
    brief: bool = False
    last: int = 0
    steps: int = 5
    tolerance: float = 0.0
    sweeps: tuple[int, int] = (2, 2)
    stiff: float = 0.0


def plan_for(least: float, largest: float) -> Plan:
    """The plan for dt mu / h^2 between `least` and `largest`; the errors are for velocities smooth on the grid's scale.

    Barely viscous: two sweeps, below 0.1 %. Uniform: one correction, below 1 %. Varying: conjugate gradients, 1 % where
    the viscosity varies a hundredfold and 5 % where it varies 1e5-fold; less where the step before was a like one.
    """
    if largest <= 0.05:
        return Plan(grids=0, steps=0, sweeps=(2, 0))
    if largest <= 3.0 * least:
        grids = max(1, math.ceil(math.log(largest / LEAST_VISITED, 4.0)))
        # A second sweep halves the error of the change where that is small; from 3 on it hardly tells.
        sweeps = 2 if largest <= 3.0 else 1
        nested = 0 if largest <= 5.0 else 1 if largest <= 50.0 else 2
        # What a nested cycle meets is smooth only where the viscosity reaches far. Sweeps cost least on the last grid.
        return Plan(grids, nested, largest <= 150.0, 4 if grids == 1 else 5, steps=0, sweeps=(sweeps, 2))
    if largest <= 300.0 * least:
        return Plan(tolerance=0.03)
    # Rigid pieces pay only where they are far stiffer than what is around them.
    return Plan(tolerance=0.08, sweeps=(1, 1), stiff=max(100.0, math.sqrt(least * largest)))


class Level:
    """One grid of the hierarchy: its matrix, its right-hand side and its iterate."""

    def __init__(self, device: Device, size: tuple[int, int], depth: int, finest: tuple[int, int]) -> None:
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
            for name in ("cells_x", "cells_y", "nodes", "inverse_u", "inverse_v")
        }
        self.packed["open"] = device.field(ringed, 4, f"{label} open", "f1")
        self.right = PackedFaces(device, ringed, f"{label} right-hand side")
        self.faces = DoublePackedFaces(device, ringed, f"{label} faces")
        # Without solids, what walls leave of a grid whose last column or row is only half in it.
        self.box = finest[0] >> depth, finest[1] >> depth
        self.use(None, {})

    def use(self, stiffness: float | None, slip: dict[str, Any]) -> None:
        """Take the matrix from the packed fields, or from one `stiffness`, dt mu / h^2 of this grid, in a box."""
        self.matrix: dict[str, Any] = dict(self.packed)
        self.open: dict[str, Any] = {"open": self.packed["open"]}
        self.defines: dict[str, Any] = {"FINEST": 1, **slip} if self.depth == 0 else slip
        if stiffness is not None:
            self.open = {"box": self.box}
            self.matrix = {"stiffness": stiffness, **self.open}
            self.defines = {"UNIFORM": 1, **slip}

    @property
    def is_coarsest(self) -> bool:
        return self.texels[0] * self.texels[1] <= COARSEST

    def release(self) -> None:
        for item in (self.cells, *self.packed.values(), self.right, self.faces):
            item.release()


class Viscosity:
    """Solves the viscous step on nested grids, and where it varies by multigrid-preconditioned conjugate gradients.

    Everything stays on the GPU but the inverse on the coarsest grid, which is made anew when the viscosity changes. One
    viscosity without solids needs no coefficients in textures: they follow from the place.
    Conservative stress form; error against the exact solution and cost: see `tests/test_viscosity.py` and `plan_for`.

    Args:
        device: where it lives.
        size: (nx, ny) of the grid.
    """

    def __init__(self, device: Device, size: tuple[int, int]) -> None:
        self.device = device
        self.size = size
        self.plan = Plan()
        self._slip: dict[str, Any] = {}
        self._wall_speed: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
        self.levels: list[Level] = []
        while not self.levels or not self.levels[-1].is_coarsest:
            self.levels.append(Level(device, size, len(self.levels), self.size))
            size = -(-size[0] // 2), -(-size[1] // 2)
        # Between free-slip walls one viscosity is solved exactly on a much finer grid than any other.
        self._exact_level = self._wave_level = next(
            (level for level in self.levels[1:] if ViscousWaves.is_worth(level.texels)), self.levels[-1]
        )
        self._waves = ViscousWaves(device, self._wave_level.box, self._wave_level.texels)
        self._has_waves = False
        unknowns = 8 * math.prod(self.levels[-1].texels)
        self._inverse = device.field((unknowns // 4, unknowns), 4, "viscous inverse")
        finest = self.levels[0]
        ringed = finest.right.u.size
        self._ways = [PackedFaces(device, ringed, f"viscous way {step}") for step in range(1, MOST_STEPS + 1)]
        self._solution = PackedFaces(device, ringed, "viscous solution")
        # What the last step made of v*, v - v*: a flow changes little from step to step, and so does this.
        self._change = DoublePackedFaces(device, ringed, "viscous change")
        # Three follow one another; the last holds the right-hand side that moving walls make.
        self._residuals = [PackedFaces(device, ringed, f"viscous residual {step}") for step in range(4)]
        self._stiff_parts = StiffParts(device, finest.texels)
        self._az = PackedFaces(device, ringed, "viscous stress of z")
        self._a_change = PackedFaces(device, ringed, "viscous stress of the change")
        self._factors = device.double_field((MOST_STEPS + 1, 1), 4, "viscous steps")
        self._products = device.field(ringed, 4, "viscous products")
        self._sum = Reduction(device, ringed, 4, "sum")
        self._change_products = device.field(ringed, 1, "viscous product of the change")
        self._change_sum = Reduction(device, ringed, 1, "sum")
        coarser = self.levels[min(1, len(self.levels) - 1)].right.u.size
        self._weighed = device.field(coarser, 4, "viscous weights")
        self._weights_sum = Reduction(device, coarser, 4, "sum")

    # -- what is solved ---------------------------------------------------------------------------------------------

    def set_coefficients(self, viscosity: Field, solid: Field, dt: float, walls: Walls) -> None:
        """Take up another viscosity (cells, lengths^2 / s), solid cells (1 = solid), time step (s) or walls."""
        self._slip = {"NO_SLIP": 1} if walls.slip == "none" else {}
        self._wall_speed = walls.speed if self._slip else (0.0, 0.0, 0.0, 0.0)
        dt_over_h2 = dt * max(self.size) ** 2
        frozen, scaled = solid.get() > 0, viscosity.get() * np.float32(dt_over_h2)
        some_frozen = bool(frozen.any())
        fluid = scaled[~frozen] if some_frozen else scaled
        least, largest = (float(fluid.min()), float(fluid.max())) if fluid.size else (0.0, 0.0)
        self._largest = largest
        self.plan = plan_for(least, largest)
        if self.plan.grids and len(self.levels) == 1:
            # The only grid is solved exactly: one step along what v* has left.
            self.plan = replace(self.plan, steps=1)
        is_uniform = least == largest and not some_frozen
        for level in self.levels:
            level.use(least / 4.0**level.depth if is_uniform else None, self._slip)
        if not is_uniform:
            self._draw_coefficients({"viscosity": viscosity, "solid": solid, "dt_over_h2": dt_over_h2})
        self._has_waves = is_uniform and not self._slip
        self._exact_level = self._wave_level if self._has_waves else self.levels[-1]
        if self._last is self._exact_level and not self._has_waves:
            entries = box_entries if is_uniform else packed_entries
            self._inverse.set(inverse_matrix(*entries(self._last)))
        self._stiff_parts.count = 0
        if self.plan.stiff:
            finest = self.levels[0]
            for field in (*finest.right.fields, *finest.faces.read.fields):
                field.clear()
            self._stiff_parts.find(scaled > self.plan.stiff, frozen, self._apply_matrix)
            # A line bends as a whole, at little energy: more of it must be found before what is left is little.
            if self._stiff_parts.some_bend:
                self.plan = replace(self.plan, tolerance=0.03, sweeps=(2, 2))

    def _draw_coefficients(self, inputs: dict[str, Any]) -> None:
        stage = "viscosity/coefficients.frag"
        for level in self.levels:
            self.device.pass_(stage)(level.cells, **inputs)
            pack = self.device.pass_("viscosity/pack_cells.frag", **self._slip)
            # One more row and column than the region, for the nodes on the far walls.
            pack(list(level.packed.values()), region=(1, 1, *level.cells.size), cells=level.cells)
            inputs, stage = {"cells": level.cells}, "viscosity/coarsen.frag"

    @property
    def _last(self) -> Level:
        """The coarsest grid that is visited."""
        return self.levels[min(self.plan.grids, self._exact_level.depth)]

    @property
    def v_star(self) -> PackedFaces:
        """v*, packed, which is to be drawn here before `solve`: see `packing`."""
        return self.levels[0].right

    @property
    def packing(self) -> Packing:
        """How a pass draws packed faces, once the coefficients are set."""
        finest = self.levels[0]
        return Packing(finest.region, {"UNIFORM": 1} if "UNIFORM" in finest.defines else {}, finest.open)

    def diffuse(self, velocity: DoubleField) -> None:
        """Replace the velocity on MAC faces (lengths / s) by the solution; see `solve`."""
        self._pack(velocity.read, self.v_star)
        self.unpack(self.solve(), velocity.read)

    def solve(self) -> PackedFaces:
        """The solution for what is `v_star`, packed, in lengths / s; valid until the next solve.

        By conjugate gradients from rest, first along v* and what the last step made of its v*, or by one correction to
        a part of v*: where little changes the rest of the work goes into the change, so that a steady state stays one,
        and where v* is damped away nothing is left of it.
        """
        right = self._right_hand_side()
        if self.plan.steps:
            return self._conjugate_gradients(self.v_star, right)
        if self.plan.grids:
            return self._corrected(self.v_star, right)
        finest = self.levels[0]
        self._smooth(finest, right, self._weights(finest), start=self.v_star)
        return finest.faces.read

    def unpack(self, faces: PackedFaces, velocity: Field) -> None:
        """Packed faces as a velocity on MAC faces."""
        self.device.pass_("viscosity/unpack.frag")(velocity, **faces.inputs())

    def _pack(self, velocity: Field, target: PackedFaces) -> None:
        packing = self.packing
        pack = self.device.pass_("viscosity/pack.frag", **packing.defines)
        pack(target.fields, region=packing.region, velocity=velocity, **packing.open)

    def _right_hand_side(self) -> PackedFaces:
        """v*, and what walls that move drag along."""
        if not any(self._wall_speed):
            return self.v_star
        finest, right = self.levels[0], self._residuals[-1]
        drag = self.device.pass_("viscosity/drag.frag", **finest.defines)
        drag(right.fields, region=finest.region, wall_speed=self._wall_speed, cells=self.size, **self.v_star.inputs(),
             **finest.matrix)  # fmt: skip
        return right

    # -- conjugate gradients ----------------------------------------------------------------------------------------

    def _conjugate_gradients(self, v_star: PackedFaces, right: PackedFaces) -> PackedFaces:
        """Solve A x = right along v*, then along multigrid cycles of what is left, until a cycle brings little more."""
        solution = v_star
        for done in range(0, self.plan.steps, MOST_STEPS):
            is_enough = self._round(solution, right, min(self.plan.steps - done, MOST_STEPS))
            solution = self._solution
            if is_enough:
                break
        return solution

    def _round(self, first: PackedFaces, right: PackedFaces, count: int) -> bool:
        """Leave in `_solution` the best of the plane of `first` and the last change, and then of so many more ways.

        The ways z are kept as they are, and only their factors are made conjugate; they are added up once, at the end.

        Returns:
            Whether still more would do little.
        """
        finest, ways, before = self.levels[0], list[PackedFaces](), right
        self._measure_first(first, right)
        for step in range(count):
            left = self._residuals[step % 3]
            self._advance(right, before, left, step)
            before, right = right, left
            self._finest_cycle(right)
            finest.faces.read, self._ways[step] = self._ways[step], finest.faces.read
            ways.append(self._ways[step])
            self._measure(ways[-1], right, before, step + 1)
            if is_enough := self._is_enough(step + 1):
                break
        inputs = {name: field for step, way in enumerate(ways) for name, field in way.inputs(f"z{step + 1}_").items()}
        self.device.pass_("viscosity/combine.frag", WAYS=len(ways))(
            finest.faces.write.fields + self._change.write.fields,
            region=finest.region,
            factors=self._factors.read,
            **first.inputs("first_"),
            **self._change.read.inputs("change_"),
            **inputs,
        )
        finest.faces.write, self._solution = self._solution, finest.faces.write
        self._change.swap()
        return is_enough

    def _measure_first(self, first: PackedFaces, right: PackedFaces) -> None:
        """A times `first` and the last change, and how much of both has the least energy."""
        finest = self.levels[0]
        self.device.pass_("viscosity/measure_first.frag", **finest.defines)(
            (*self._az.fields, *self._a_change.fields, self._products, self._change_products),
            region=finest.region,
            **first.inputs(),
            **self._change.read.inputs("change_"),
            **right.inputs("right_"),
            **finest.matrix,
        )
        self.device.pass_("viscosity/least.frag")(
            self._factors.write,
            products=self._sum.shrink(self._products),
            change_products=self._change_sum.shrink(self._change_products),
        )
        self._factors.swap()

    def _measure(self, z: PackedFaces, right: PackedFaces, before: PackedFaces, step: int) -> None:
        """A z, and from the residuals now and before how far to go along z once it is conjugate to the last way."""
        finest = self.levels[0]
        self.device.pass_("viscosity/measure.frag", **finest.defines)(
            (*self._az.fields, self._products),
            region=finest.region,
            **z.inputs(),
            **right.inputs("right_"),
            **before.inputs("before_"),
            **finest.matrix,
        )
        factors = self.device.pass_("viscosity/gradients.frag")
        products = self._sum.shrink(self._products)
        factors(self._factors.write, products=products, before=self._factors.read, step=step)
        self._factors.swap()

    def _is_enough(self, step: int) -> bool:
        """Whether the last step has found so little energy that the next ones are not worth their time."""
        alpha, _, curvature, _ = self._factors.read.get()[0, : step + 1].T.astype(np.float64)
        gains = alpha**2 * curvature
        return bool(gains[step] <= self.plan.tolerance**2 * gains.sum())

    def _advance(self, right: PackedFaces, before: PackedFaces, left: PackedFaces, step: int) -> None:
        """What the step leaves of the residual, and on it the first sweep of a cycle from rest."""
        finest = self.levels[0]
        defines: dict[str, Any] = {} if step else {"FIRST": 1}
        self.device.pass_("viscosity/advance.frag", **finest.defines, **defines)(
            left.fields + finest.faces.write.fields,
            region=finest.region,
            factors=self._factors.read,
            step=step,
            weight=self._weights(finest)[0],
            **right.inputs("right_"),
            **self._az.inputs(),
            **(before.inputs("before_") if step else self._a_change.inputs("change_")),
            **finest.matrix,
        )
        finest.faces.swap()

    def _finest_cycle(self, right: PackedFaces) -> None:
        """The rest of a multigrid cycle on the finest grid, from the first sweep on; stiff parts move as pieces."""
        finest = self.levels[0]
        if len(self.levels) == 1:
            self._solve_exactly(right)
            return
        if self._stiff_parts.count:
            self._stiff_parts.add_fit(right.fields, finest.faces.read.fields)
        weights = self._weights(finest)
        self._smooth(finest, right, weights[1:])
        self._correct(finest, right)
        self._smooth(finest, right, weights[::-1])

    # -- multigrid --------------------------------------------------------------------------------------------------

    def _corrected(self, v_star: PackedFaces, right: PackedFaces) -> PackedFaces:
        """A part of v*, corrected once: on the coarser grids, and face by face for what these do not carry."""
        finest, coarser = self.levels[:2]
        residual, weights = self._residuals[0], self._weights(finest, 1 + self.plan.sweeps[0])
        self._residual_of(finest, v_star, right, residual)
        part = self._part_of(right, residual)
        # The part of it that the coarser grid does carry is not to be added face by face once more.
        k = self._largest
        self._nested_grids(taken=weights[0] * (1.0 + 1.5 * k) / (1.0 + 6.0 * k))
        dragged: dict[str, Any] = {} if right is v_star else {"DRAGGED": 1}
        finish = self.device.pass_("viscosity/prolong.frag", CORRECT=1, **dragged, **finest.defines)
        finish(
            finest.faces.write.fields,
            region=finest.region,
            weight=weights[0],
            **coarser.faces.read.inputs("coarse_"),
            **v_star.inputs(),
            **residual.inputs("r_"),
            part=part,
            **(right.inputs("right_") if dragged else {}),
            **finest.matrix,
        )
        finest.faces.swap()
        self._smooth(finest, right, weights[1:])
        return finest.faces.read

    def _part_of(self, right: PackedFaces, residual: PackedFaces) -> Field:
        """The part of v* that has least energy on the next coarser grid, one texel; what it leaves is `right` there."""
        coarser = self.levels[1]
        wanted, left, damped = coarser.faces.write, coarser.right, coarser.faces.read
        restrict = self.device.pass_("viscosity/restrict.frag", WEIGHED=1, **coarser.defines)
        restrict(left.fields + wanted.fields + (self._weighed,), region=coarser.region, **residual.inputs(),
                 **right.inputs("right_"), **coarser.open)  # fmt: skip
        factors = self.device.pass_("viscosity/gradients.frag")
        products = self._weights_sum.shrink(self._weighed)
        factors(self._factors.write, products=products, before=self._factors.read, step=0)
        self._factors.swap()
        damp = self.device.pass_("viscosity/damp.frag")
        damp(damped.fields, region=coarser.region, part=self._factors.read, **wanted.inputs(), **left.inputs("r_"))
        coarser.right, coarser.faces.read = damped, left
        return self._factors.read

    def _nested_grids(self, taken: float) -> None:
        """A correction on the coarser grids: solved on the coarsest, then carried up and improved grid by grid.

        From the finest of them so much of D^-1 times its right-hand side is taken away.
        """
        last = self._last
        levels = self.levels[1 : last.depth + 1]
        rights = [level.right for level in levels]
        for fine, coarser in zip(rights, levels[1:], strict=False):
            self._restrict(fine, coarser, coarser.right, self._first_weight(coarser) if coarser is last else 0.0)
        if len(levels) == 1 and last is not self._exact_level:
            self._start(last, rights[-1], last.faces.write, self._weights(last)[0])
            last.faces.swap()
        self._cycle(last, rights[-1], begun=True, taken=taken if len(levels) == 1 else 0.0)
        for finer, coarser, right in reversed(list(zip(levels, levels[1:], rights, strict=False))):
            prolong = self.device.pass_("viscosity/prolong.frag", START=1, **finer.defines)
            prolong(
                finer.faces.write.fields,
                region=finer.region,
                **coarser.faces.read.inputs("coarse_"),
                **coarser.right.inputs("coarse_right_"),
                **right.inputs(),
                **finer.matrix,
            )
            finer.faces.swap()
            # A cycle overwrites the right-hand sides of coarser grids only, and those are used up by now.
            is_nested, left = finer.depth <= self.plan.nested, taken if finer is levels[0] else 0.0
            self._smooth(finer, right, self._weights(finer)[::-1], taken=0.0 if is_nested else left)
            if is_nested:
                self._cycle(finer, right, is_brief=self.plan.brief, taken=left)

    def _cycle(
        self, level: Level, right: PackedFaces, begun: bool = False, is_brief: bool = False, taken: float = 0.0
    ) -> None:
        """One multigrid cycle for A faces = right, from the level's iterate, or, `begun`, on from its first sweep.

        A brief one goes one grid down only. Of D^-1 times `right` so much is `taken` away at the end.
        """
        if level is self._exact_level:
            self._solve_exactly(right)
            if taken:
                self._start(level, right, level.faces.read, -taken, add=True)
            return
        weights = self._weights(level)
        if level is self._last:
            self._smooth(level, right, weights[1:] if begun else weights, taken=taken)
            return
        self._smooth(level, right, weights[1:] if begun else weights)
        self._correct(level, right, is_brief)
        self._smooth(level, right, weights[::-1], taken=taken)

    def _correct(self, level: Level, right: PackedFaces, is_brief: bool = False) -> None:
        """Add what a cycle on the coarser grids makes of the residual, or a brief one's sweeps on the next of them."""
        # The write side is free until the correction is added.
        self._residual_of(level, level.faces.read, right, level.faces.write)
        coarser = self.levels[level.depth + 1]
        if is_brief:
            first, *others = self._weights(coarser, is_last=True)
            self._restrict(level.faces.write, coarser, coarser.right, first)
            self._smooth(coarser, coarser.right, others)
        else:
            self._restrict(level.faces.write, coarser, coarser.right, self._first_weight(coarser))
            self._cycle(coarser, coarser.right, begun=True)
        self._prolong(coarser, level)

    def _first_weight(self, level: Level) -> float:
        """Of the sweep that a cycle begins with, from rest; 0 where the level is solved exactly instead."""
        return 0.0 if level is self._exact_level else self._weights(level)[0]

    def _weights(self, level: Level, count: int = 0, is_last: bool = False) -> list[float]:
        """Chebyshev weights of the smoothing sweeps; `is_last`: no coarser grid follows."""
        is_last = is_last or level is self._last
        count = count or (is_last and self.plan.last) or self.plan.sweeps[0 if level.depth == 0 else 1]
        least, largest = SMOOTHED
        if not self.plan.steps:
            # As for one viscosity: A v = v + k |q|^2 v for a wave q of no divergence, at most 16 k for a gradient, D is
            # 1 + 6 k, and the coarser grid takes over about where |q|^2 is 1.
            k = self._largest / 4.0**level.depth
            taken_over = 0.0 if is_last else 1.0
            least, largest = (1.0 + taken_over * k) / (1.0 + 6.0 * k), (1.0 + 16.0 * k) / (1.0 + 6.0 * k)
        middle, half = 0.5 * (largest + least), 0.5 * (largest - least)
        return [1.0 / (middle + half * math.cos(math.pi * (2 * q + 1) / (2 * count))) for q in range(count)]

    def _start(self, level: Level, right: PackedFaces, target: PackedFaces, weight: float, add: bool = False) -> None:
        start = self.device.pass_("viscosity/start.frag", **level.defines)
        start(target.fields, add=add, region=level.region, weight=weight, **right.inputs("right_"), **level.matrix)

    def _smooth(
        self,
        level: Level,
        right: PackedFaces,
        weights: list[float],
        start: PackedFaces | None = None,
        taken: float = 0.0,
    ) -> None:
        """One sweep for each weight, on from the level's iterate or from `start`; see `_cycle` for `taken`."""
        sweep = self.device.pass_("viscosity/sweep.frag", **level.defines)
        for number, weight in enumerate(weights, 1):
            iterate = start or level.faces.read
            sweep(
                level.faces.write.fields,
                region=level.region,
                weight=weight,
                taken=taken if number == len(weights) else 0.0,
                **iterate.inputs(),
                **right.inputs("right_"),
                **level.matrix,
            )
            level.faces.swap()
            start = None

    def _residual_of(
        self, level: Level, faces: PackedFaces, right: PackedFaces, target: PackedFaces, region: Region | None = None
    ) -> None:
        residual = self.device.pass_("viscosity/residual.frag", **level.defines)
        residual(
            target.fields, region=region or level.region, **faces.inputs(), **right.inputs("right_"), **level.matrix
        )

    def _apply_matrix(self, draw: Callable[[tuple[Field, Field]], None], region: Region) -> tuple[Field, Field]:
        """Minus A times the faces that `draw` fills, the others being zero, in a region; for `StiffParts`."""
        finest = self.levels[0]
        draw(finest.faces.read.fields)
        self._residual_of(finest, finest.faces.read, finest.right, self._residuals[0], region)
        return self._residuals[0].fields

    def _restrict(self, residual: PackedFaces, coarser: Level, target: PackedFaces, weight: float = 0.0) -> None:
        """The residual on the coarser grid; with a `weight` the first sweep on it too, from rest."""
        if not weight:
            restrict = self.device.pass_("viscosity/restrict.frag", **coarser.defines)
            restrict(target.fields, region=coarser.region, **residual.inputs(), **coarser.open)
            return
        restrict = self.device.pass_("viscosity/restrict.frag", START=1, **coarser.defines)
        restrict(
            target.fields + coarser.faces.write.fields,
            region=coarser.region,
            weight=weight,
            **residual.inputs(),
            **coarser.matrix,
        )
        coarser.faces.swap()

    def _prolong(self, coarser: Level, finer: Level) -> None:
        prolong = self.device.pass_("viscosity/prolong.frag", **finer.defines)
        prolong(
            finer.faces.write.fields,
            region=finer.region,
            **coarser.faces.read.inputs("coarse_"),
            **finer.faces.read.inputs(),
            **finer.matrix,
        )
        finer.faces.swap()

    def _solve_exactly(self, right: PackedFaces) -> None:
        level = self._exact_level
        if self._has_waves:
            self._waves.solve(right.fields, level.faces.write.fields, level.matrix["stiffness"])
            level.faces.swap()
            return
        exact = self.device.pass_("viscosity/exact.frag")
        exact(
            level.faces.write.fields,
            region=level.region,
            inverse=self._inverse,
            **right.inputs("right_"),
        )
        level.faces.swap()

    # -- its state --------------------------------------------------------------------------------------------------

    def state(self) -> tuple[Field, Field]:
        """The fields that a later step depends on."""
        return self._change.read.fields

    def forget(self) -> None:
        """Expect no change: the velocity is a new one."""
        for field in self.state():
            field.clear()

    # -- statistics -------------------------------------------------------------------------------------------------

    def residual_norm(self, after: Field) -> float:
        """|v* - A v| / |v*|, v* what is `v_star`, v a velocity on MAC faces; waits for the GPU."""
        finest, right = self.levels[0], self._right_hand_side()
        self._pack(after, finest.faces.read)
        self._residual_of(finest, finest.faces.read, right, self._residuals[0])
        wanted, left = (
            math.sqrt(sum(float((field.get().astype(np.float64) ** 2).sum()) for field in pair.fields))
            for pair in (right, self._residuals[0])
        )
        return left / wanted if wanted else 0.0

    @property
    def nbytes(self) -> int:
        """Bytes of texture memory."""
        pairs = [side for level in self.levels for side in (level.faces.read, level.faces.write)]
        pairs += [*self._residuals, *self._ways, self._solution, self._az, self._a_change]
        pairs += [self._change.read, self._change.write]
        fields = [field for pair in pairs for field in pair.fields]
        for level in self.levels:
            fields += [level.cells, *level.packed.values(), *level.right.fields]
        fields += [self._inverse, self._products, self._change_products, self._weighed]
        others = self._sum, self._change_sum, self._weights_sum, self._stiff_parts, self._waves
        return sum(thing.nbytes for thing in (*fields, *others))

    def release(self) -> None:
        """Free the textures."""
        for item in (*self.levels, *self._residuals, *self._ways, self._solution, self._inverse):
            item.release()
        for item in (
            self._factors,
            self._products,
            self._az,
            self._a_change,
            self._change,
            self._change_products,
            self._change_sum,
            self._sum,
            self._weighed,
            self._weights_sum,
            self._waves,
            self._stiff_parts,
        ):
            item.release()


Entries = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def packed_entries(level: Level) -> Entries:
    """A level's K in cells (of u_x and of v_y) and at nodes, and which faces of u and of v are open."""
    width, height = level.texels
    packed = {name: np.abs(field.get()[1:-1, 1:-1]) for name, field in level.packed.items()}
    cells_x, cells_y, inverse_u, inverse_v = (
        unpacked(packed[name]) for name in ("cells_x", "cells_y", "inverse_u", "inverse_v")
    )
    nodes = unpacked(np.abs(level.packed["nodes"].get()[1:, 1:]))[: 2 * height + 1, : 2 * width + 1]
    return cells_x, cells_y, nodes, inverse_u > 0, inverse_v > 0


def box_entries(level: Level) -> Entries:
    """The same for a level of one stiffness."""
    (width, height), (across, down) = level.texels, level.box
    x, y = np.arange(2 * width + 1), np.arange(2 * height + 1)[:, None]
    wall = 2.0 if "NO_SLIP" in level.defines else 0.0
    at_walls = np.where((x == 0) | (x == across), wall, 1.0) * np.where((y == 0) | (y == down), wall, 1.0)
    cells = np.full((2 * height, 2 * width), 2.0 * level.matrix["stiffness"])
    inside = (x < across) & (y < down)
    open_u, open_v = (inside & (x > 0))[:-1, :-1], (inside & (y > 0))[:-1, :-1]
    return cells, cells, level.matrix["stiffness"] * at_walls, open_u, open_v


def inverse_matrix(
    cells_x: np.ndarray, cells_y: np.ndarray, nodes: np.ndarray, open_u: np.ndarray, open_v: np.ndarray
) -> np.ndarray:
    """The inverse of the matrix of these entries for `shaders/viscosity/exact.frag`, (unknowns, unknowns / 4, 4)."""
    height, width = cells_x.shape[0] // 2, cells_x.shape[1] // 2
    count = 8 * width * height
    # Texels in lines along the shorter side, u and v together: each line meets its neighbours only.
    texels = np.arange(count).reshape((height, width, 2, 4) if height >= width else (width, height, 2, 4))
    if height < width:
        texels = texels.swapaxes(0, 1)
    # Numbers of the unknowns, -1 where a face is pinned, with a frame of pinned faces.
    u = np.pad(np.where(open_u, unpacked(texels[:, :, 0]), -1), 1, constant_values=-1)
    v = np.pad(np.where(open_v, unpacked(texels[:, :, 1]), -1), 1, constant_values=-1)
    strains = (
        (cells_x, ((u[1:-1, 2:], 1), (u[1:-1, 1:-1], -1))),
        (cells_y, ((v[2:, 1:-1], 1), (v[1:-1, 1:-1], -1))),
        (nodes, ((u[1:, 1:], 1), (u[:-1, 1:], -1), (v[1:, 1:], 1), (v[1:, :-1], -1))),
    )
    places, entries = [np.arange(count) * (count + 1)], [np.ones(count)]
    for stiffness, ends in strains:
        for row, row_sign in ends:
            for column, column_sign in ends:
                moves = (row >= 0) & (column >= 0)
                places.append(row[moves] * count + column[moves])
                entries.append(row_sign * column_sign * stiffness[moves])
    matrix = np.bincount(np.concatenate(places), np.concatenate(entries), count**2).reshape(count, count)
    inverse = inverse_of_blocks(matrix, max(height, width)).astype(np.float32)
    # In the order of the texture: texel after texel, all u before all v.
    order = np.moveaxis(texels, 2, 0).ravel()
    return inverse[order[:, None], order].reshape(count, count // 4, 4)


def inverse_of_blocks(matrix: np.ndarray, count: int) -> np.ndarray:
    """The inverse of a symmetric positive matrix of so many blocks a side, each of which meets its neighbours only.

    A product of small blocks is left to one thread by the libraries: two wait for each other longer than they work.
    """
    size = len(matrix) // count
    blocks = matrix.reshape(count, size, count, size).swapaxes(1, 2)
    # Block elimination from the first to the last, then back.
    pivots = [np.linalg.inv(blocks[0, 0])]
    for i in range(1, count):
        beside = blocks[i - 1, i]
        pivots.append(np.linalg.inv(blocks[i, i] - beside.T @ pivots[-1] @ beside))
    inverse = np.empty_like(blocks)
    inverse[-1, -1] = pivots[-1]
    for i in range(count - 2, -1, -1):
        taken = pivots[i] @ blocks[i, i + 1]
        inverse[i, i + 1 :] = -taken @ inverse[i + 1, i + 1 :]
        inverse[i + 1 :, i] = inverse[i, i + 1 :].swapaxes(1, 2)
        inverse[i, i] = pivots[i] - inverse[i, i + 1] @ taken.T
    return inverse.swapaxes(1, 2).reshape(matrix.shape)

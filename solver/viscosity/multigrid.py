"""Multigrid cycles for the viscous operator: Chebyshev-Jacobi smoothing, transposed transfers, a direct solve.

The class is long because which cycle is made, and with which weights, follows from what its levels have taken up.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field
from solver.packing import PackedFaces, is_worth_a_transform
from solver.params import NoSlip
from solver.viscosity.box import Box, changed
from solver.viscosity.deflation import Deflation
from solver.viscosity.operator import Coefficients, Level, inverse_matrix
from solver.viscosity.plan import Plan, sweeps_alone
from solver.viscosity.transform import SineCosineTransform

# Largest eigenvalue of D^-1 A that the smoother assumes: on the finest level 2.8 was the largest found over random
# masks at any contrast; the Galerkin levels have 3 to 4, and rarely 5, where one sweep does not damp it.
LARGEST_EIGENVALUE = 2.8, 4.0
# The smoother damps eigenvalues from the largest over this up; by the number of sweeps.
SMOOTHED = {1: 3.8, 2: 5.0}

# With one viscosity, if so many sweeps leave at most a tenth of the error on a coarse level, an order less than the
# cycle does, no coarser level is used: two sweeps, transfers and coarser levels cost as much.
MOST_ALONE = 4
ALONE_LEAVES = 0.1

# A kappa that no cell reaches: the coarse levels cut nothing off.
UNBOUNDED = 1e30


def chebyshev_weights(least: float, largest: float, count: int) -> list[float]:
    """Weights of damped Jacobi sweeps that together damp eigenvalues of D^-1 A between the two best."""
    middle, half = 0.5 * (largest + least), 0.5 * (largest - least)
    return [1.0 / (middle + half * math.cos(math.pi * (2 * q + 1) / (2 * count))) for q in range(count)]


class TakenUp(NamedTuple):
    """What the coefficients in the textures were made from.

    Attributes:
        basis: (time step, where the fluid sticks, how many levels, kappa at which the coarse ones cut off): if these
            change, nothing can be kept.
        viscosity, solid: of the cells.
    """

    basis: tuple[float, NoSlip, int, float]
    viscosity: np.ndarray
    solid: np.ndarray


class Multigrid:
    """The levels, and cycles on them.

    One viscosity without solids needs no coefficients in textures: they follow from the place. Otherwise the coarse
    operators are Galerkin products.

    Args:
        device: where it lives.
        size: (nx, ny) of the grid.
        spacing: (hx, hy), sides of a cell.
    """

    def __init__(self, device: Device, size: tuple[int, int], spacing: tuple[float, float]) -> None:
        self.device = device
        self.levels: list[Level] = []
        finest = size
        while not self.levels or not self.levels[-1].is_coarsest:
            self.levels.append(Level(device, size, len(self.levels), finest))
            size = -(-size[0] // 2), -(-size[1] // 2)
        # Between free-slip walls one viscosity is solved directly on a much finer level than any other.
        worth = (level for level in self.levels if is_worth_a_transform(level.texels, is_finest=level is self.finest))
        self._transform_level = next(worth, self.levels[-1])
        self._transform = SineCosineTransform(device, self._transform_level.box, self._transform_level.texels)
        self.has_transform = False
        self.set_spacing(spacing)
        unknowns = 8 * math.prod(self.levels[-1].texels)
        self._inverse = device.field((unknowns // 4, unknowns), 4, "viscous inverse")
        self._sweeps = 1  # of a cycle, see `Plan`
        self._largest = 0.0  # kappa
        self._alone: Level | None = None  # of one viscosity: the first that needs no coarser one

    # -- what is solved ---------------------------------------------------------------------------------------------

    def set_spacing(self, spacing: tuple[float, float]) -> None:
        """Let the cells have other sides; the coefficients are to be set anew."""
        self.spacing = hx, hy = spacing
        self._taken_up: TakenUp | None = None
        for level in self.levels:
            level.shear = math.sqrt(hx / hy), math.sqrt(hy / hx)

    def set_uniform(self, viscosity: float, dt: float, no_slip: NoSlip, plan: Plan) -> None:
        """Take up one viscosity, lengths^2 / s, in a box without solids, and the `plan` for cycles."""
        self._taken_up, self._sweeps = None, plan.sweeps
        self._largest = viscosity * self._scale(dt)
        for level in self.levels:
            level.set_uniform(self._kappa(level), no_slip)
        self.has_transform = not any(no_slip)
        # The direct level is solved at once, and the finest has a plan of its own.
        between = self.levels[1 : self.direct_level.depth]
        self._alone = next((level for level in between if self._sweeps_alone(level) <= MOST_ALONE), None)
        last = self.levels[-1]
        if plan.method == "cg" and not self.has_transform and not self._alone:
            stiffness = last.operator["stiffness"]
            uniform = Coefficients.uniform(stiffness, last.box, last.texels, last.shear, no_slip)
            self._inverse.set(inverse_matrix(uniform))

    def set_coefficients(
        self,
        viscosity: Field,
        solid: Field,
        amount: np.ndarray,
        is_solid: np.ndarray,
        dt: float,
        no_slip: NoSlip,
        plan: Plan,
    ) -> None:
        """Take up the `viscosity` of the cells, lengths^2 / s, the `solid` cells, and the `plan` for cycles.

        `amount` and `is_solid` are the same as arrays (ny, nx). Only what has changed is drawn again: a dab of a brush
        changes few cells. Where the field holds more than the largest `amount`, it counts as that.
        """
        self.has_transform, self._alone = False, None
        self._sweeps = plan.sweeps
        self._largest = float(amount[~is_solid].max(initial=0.0)) * self._scale(dt)
        most = plan.stiff if plan.rigid else UNBOUNDED
        levels = self.levels if plan.method == "cg" else self.levels[:1]
        taken_up, basis = self._taken_up, (dt, no_slip, len(levels), most)
        self._taken_up = TakenUp(basis, amount, is_solid)
        box: Box | None = Box(0, amount.shape[0], 0, amount.shape[1])
        is_new = not taken_up or taken_up.basis != basis or not np.array_equal(taken_up.solid, is_solid)
        if taken_up and not is_new:
            box = changed(taken_up.viscosity, amount)
            if box is None:
                return
        self.finest.set_masks(viscosity, solid, self._scale(dt), float(amount.max()), no_slip, box)
        for finer, level in pairwise(levels):
            box = box.coarser
            level.coarsen(finer, no_slip, box, is_new, most)
        if levels is self.levels:
            self._inverse.set(inverse_matrix(levels[-1].coefficients()))

    def _kappa(self, level: Level) -> float:
        """The largest kappa on a level, of one viscosity."""
        return self._largest / 4.0**level.depth

    def _sweeps_alone(self, level: Level) -> int:
        """The sweeps that leave little enough of a coarse correction."""
        return sweeps_alone(self._kappa(level), ALONE_LEAVES)

    def _scale(self, dt: float) -> float:
        """kappa of a viscosity of one."""
        return dt / (self.spacing[0] * self.spacing[1])

    @property
    def finest(self) -> Level:
        return self.levels[0]

    @property
    def direct_level(self) -> Level:
        """The level that is solved directly."""
        return self._transform_level if self.has_transform else self.levels[-1]

    # -- cycles -----------------------------------------------------------------------------------------------------

    def precondition(self, rhs: PackedFaces, start: bool, rigid: Deflation | None = None) -> PackedFaces:
        """About A^-1 rhs, by one cycle from zero, or with `start` from what the finest level's iterate holds.

        With `rigid` parts: see `_coarse_correction`.
        """
        if "UNIFORM" in self.finest.defines:
            self.sawtooth(self.finest, rhs)
        else:
            self.cycle(self.finest, rhs, 0 if start else self._begin(self.finest, rhs), rigid)
        return self.finest.faces.read

    def cycle(self, level: Level, rhs: PackedFaces, begun: int, rigid: Deflation | None = None) -> None:
        """One V-cycle for A faces = rhs, from the level's iterate, of which `begun` sweeps are made."""
        if level is self.direct_level:
            self.direct_solve(rhs)
            return
        weights = self._weights(level)
        self.smooth(level, rhs, weights[begun:])
        self._coarse_correction(level, rhs, rigid)
        self.smooth(level, rhs, weights[::-1])

    def sawtooth(self, level: Level, rhs: PackedFaces) -> None:
        """A cycle from zero that smooths only after the coarse correction, for one viscosity.

        It leaves a fifth more than one that also smooths before (.63 of the error in the median of random grids and
        viscosities, where that leaves .53), and costs half.
        """
        if level is self.direct_level:
            self.direct_solve(rhs)
            return
        coarser = self.levels[level.depth + 1]
        begun = self._restrict(rhs, coarser, start=coarser is self._alone)
        if coarser is self._alone:
            self.smooth(coarser, coarser.rhs, self._weights(coarser)[begun:])
        else:
            self.sawtooth(coarser, coarser.rhs)
        prolong = self.device.pass_("viscosity/prolong.frag", CORRECTION=1, **level.defines)
        inputs = coarser.faces.read.inputs("coarse_")
        prolong(level.faces.write.fields, region=level.region, alone=coarser.alone, **inputs, **level.bounds)
        level.faces.swap()
        self.smooth(level, rhs, self._weights(level))

    def _coarse_correction(self, level: Level, rhs: PackedFaces, rigid: Deflation | None) -> None:
        """f += P A_coarse^-1 P' (rhs - A f); with `rigid` parts M P in place of P, between two corrections of these."""
        faces, residual = level.faces.read, level.residual
        self.residual(level, faces, rhs, residual)
        coarser = self.levels[level.depth + 1]
        averaged = residual
        if rigid:
            moved = rigid.correct(residual, faces, add=True)
            self.residual(level, faces, rhs, residual)
            averaged = rigid.average(residual, moved)
        self.cycle(coarser, coarser.rhs, self._restrict(averaged, coarser, start=True))
        prolong = self.device.pass_("viscosity/prolong.frag", **level.defines, **({"CORRECTION": 1} if rigid else {}))
        prolong(level.faces.write.fields, region=level.region, **coarser.faces.read.inputs("coarse_"),
                **faces.inputs(), alone=coarser.alone, **level.bounds)  # fmt: skip
        if rigid:
            means = rigid.add_others(level.faces.write, faces)
            self.residual(level, faces, rhs, residual)
            rigid.correct(residual, faces, add=True, means=means)
        else:
            level.faces.swap()

    # -- its parts --------------------------------------------------------------------------------------------------

    def smooth_alone(self, rhs: PackedFaces, start: PackedFaces, sweeps: int) -> None:
        """Sweeps on the finest level without coarser ones."""
        self.smooth(self.finest, rhs, self._weights_alone(self.finest, sweeps), start)

    def _weights_alone(self, level: Level, sweeps: int) -> list[float]:
        """Chebyshev weights for all eigenvalues: see `sweeps_alone`. D is 1 + 6 kappa."""
        k = self._kappa(level)
        return chebyshev_weights(1.0 / (1.0 + 6.0 * k), (1.0 + 16.0 * k) / (1.0 + 6.0 * k), sweeps)

    def _weights(self, level: Level) -> list[float]:
        """Chebyshev weights of a level's sweeps in a cycle."""
        if level is self._alone:
            return self._weights_alone(level, self._sweeps_alone(level))
        largest = LARGEST_EIGENVALUE[1 if level.stencil else 0]
        return chebyshev_weights(largest / SMOOTHED[self._sweeps], largest, self._sweeps)

    def smooth(self, level: Level, rhs: PackedFaces, weights: list[float], start: PackedFaces | None = None) -> None:
        """One sweep for each weight, on from the level's iterate or from `start`."""
        smooth = self.device.pass_("viscosity/smooth.frag", **level.defines)
        for weight in weights:
            iterate = start or level.faces.read
            self._stress(level, iterate)
            smooth(
                level.faces.write.fields,
                region=level.region,
                weight=weight,
                **iterate.inputs(),
                **rhs.inputs("rhs_"),
                **level.operator,
            )
            level.faces.swap()
            start = None

    def residual(self, level: Level, faces: PackedFaces, rhs: PackedFaces, target: PackedFaces) -> None:
        """Draw rhs - A faces."""
        self._stress(level, faces)
        residual = self.device.pass_("viscosity/residual.frag", **level.defines)
        residual(target.fields, region=level.region, **faces.inputs(), **rhs.inputs("rhs_"), **level.operator)

    def direct_solve(self, rhs: PackedFaces) -> None:
        """Solve on `direct_level`."""
        level = self.direct_level
        if self.has_transform:
            stiffness, (s_y, s_x) = math.sqrt(level.operator["stiffness"]), level.operator["shear"]
            self._transform.solve(rhs.fields, level.faces.write.fields, (stiffness * s_x, stiffness * s_y))
        else:
            solve = self.device.pass_("viscosity/direct_solve.frag")
            solve(level.faces.write.fields, region=level.region, inverse=self._inverse, **rhs.inputs("rhs_"))
        level.faces.swap()

    def _stress(self, level: Level, faces: PackedFaces) -> None:
        """On a Galerkin level: K B faces, which the operator is made of; one more row and column for the far walls."""
        if level.stencil:
            x, y, width, height = level.region
            stress = self.device.pass_("viscosity/stress.frag")
            stress(level.stress, region=(x, y, width + 1, height + 1), **faces.inputs(), **level.stencil)

    def _begin(self, level: Level, rhs: PackedFaces) -> int:
        """Make the first sweep from zero, unless the level is solved directly; returns the number of sweeps made."""
        if level is self.direct_level:
            return 0
        start = self.device.pass_("viscosity/start.frag", **level.defines)
        start(level.faces.write.fields, region=level.region, weight=self._weights(level)[0], **rhs.inputs("rhs_"),
              **level.operator)  # fmt: skip
        level.faces.swap()
        return 1

    def _restrict(self, residual: PackedFaces, coarser: Level, start: bool) -> int:
        """Draw the residual as rhs of the coarser level, with `start` the first sweep too; returns the sweeps made."""
        start = start and coarser is not self.direct_level
        restrict = self.device.pass_("viscosity/restrict.frag", **({"START": 1} if start else {}), **coarser.defines)
        inputs = {"weight": self._weights(coarser)[0], **coarser.operator} if start else coarser.bounds
        targets = coarser.rhs.fields + (coarser.faces.write.fields if start else ())
        restrict(targets, region=coarser.region, alone=coarser.alone, **residual.inputs(), **inputs)
        if start:
            coarser.faces.swap()
        return int(start)

    def release(self) -> None:
        """Free the textures."""
        for item in (*self.levels, self._inverse, self._transform):
            item.release()

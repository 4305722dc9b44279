"""Multigrid cycles for the viscous operator: Chebyshev-Jacobi smoothing, transposed transfers, a direct solve."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from solver.gl.device import Device
from solver.packing import PackedFaces
from solver.params import NoSlip
from solver.viscosity.changed import Box, changed
from solver.viscosity.operator import (
    Coefficients,
    Level,
    change_coarse,
    change_finest,
    coarsened,
    coefficients,
    inverse_matrix,
)
from solver.viscosity.plan import Plan
from solver.viscosity.transform import SineCosineTransform

# Largest eigenvalue of D^-1 A that the smoother reckons with: on the finest level 2.8 was the largest found over random
# masks at any contrast; the Galerkin levels have 3 to 4, and rarely 5 where one sweep then does nothing.
LARGEST_EIGENVALUE = 2.8, 4.0
# The smoothed part of the spectrum, up from the largest eigenvalue over this; by the number of sweeps.
SMOOTHED = {1: 3.8, 2: 5.0}

# Texels of a grid whose transform is less than the corrections around one.
SMALL_GRID = 64


def chebyshev_weights(least: float, largest: float, count: int) -> list[float]:
    """Weights of damped Jacobi sweeps that together damp eigenvalues of D^-1 A between the two most."""
    middle, half = 0.5 * (largest + least), 0.5 * (largest - least)
    return [1.0 / (middle + half * math.cos(math.pi * (2 * q + 1) / (2 * count))) for q in range(count)]


@dataclass(frozen=True)
class TakenUp:
    """What the coefficients in the textures were made from, and these.

    Attributes:
        basis: (time step, where the fluid sticks, depth of the last level): with others nothing can be kept.
        viscosity, solid: of the cells.
        levels: the coefficients, the finest first.
    """

    basis: tuple[float, NoSlip, int]
    viscosity: np.ndarray
    solid: np.ndarray
    levels: list[Coefficients]


class Multigrid:
    """The levels, and cycles on them.

    One viscosity without solids needs no coefficients in textures: they follow from the place. Any other has Galerkin
    coarse operators.

    Args:
        device: where it lives.
        size: (nx, ny) of the grid.
        spacing: (hx, hy), sides of a cell.
    """

    def __init__(self, device: Device, size: tuple[int, int], spacing: tuple[float, float]) -> None:
        self.device = device
        self.spacing = spacing
        self.plan = Plan()
        self.levels: list[Level] = []
        finest = size
        while not self.levels or not self.levels[-1].is_coarsest:
            self.levels.append(Level(device, size, len(self.levels), finest))
            size = -(-size[0] // 2), -(-size[1] // 2)
        # Between free-slip walls one viscosity is solved directly on a much finer level than any other.
        first = 0 if math.prod(self.levels[0].texels) <= SMALL_GRID else 1
        worth = [level for level in self.levels[first:] if SineCosineTransform.is_worth(level.texels)]
        self._transform_level = worth[0] if worth else self.levels[-1]
        self._transform = SineCosineTransform(device, self._transform_level.box, self._transform_level.texels)
        self.has_transform = False
        self._taken_up: TakenUp | None = None
        unknowns = 8 * math.prod(self.levels[-1].texels)
        self._inverse = device.field((unknowns // 4, unknowns), 4, "viscous inverse")
        self._largest = 0.0  # kappa

    # -- what is solved ---------------------------------------------------------------------------------------------

    def set_uniform(self, viscosity: float, dt: float, no_slip: NoSlip) -> None:
        """Take up one viscosity, lengths^2 / s, in a box without solids."""
        self._taken_up = None
        hx, hy = self.spacing
        self._largest = dt * viscosity / (hx * hy)
        shear = math.sqrt(hx / hy), math.sqrt(hy / hx)
        for level in self.levels:
            level.set_uniform(self._largest / 4.0**level.depth, shear, no_slip)
        self.has_transform = not any(no_slip)
        if not self.has_transform and self.last is self.levels[-1]:
            columns, rows = (2 * count for count in self.last.texels)
            (across, down), scale = self.last.box, 2.0**self.last.depth
            outside = (np.arange(columns) >= across) | (np.arange(rows)[:, None] >= down)
            everywhere, spacing = np.full((rows, columns), viscosity), (hx * scale, hy * scale)
            self._inverse.set(inverse_matrix(coefficients(everywhere, outside, dt, spacing, no_slip, self.last.box)))

    def set_coefficients(self, viscosity: np.ndarray, solid: np.ndarray, dt: float, no_slip: NoSlip) -> Coefficients:
        """Take up the viscosity of the cells, lengths^2 / s, and the solid ones, (ny, nx) both; those of the finest.

        What is made again is what has changed: a dab of a brush changes few cells.
        """
        self.has_transform = False
        self._largest = dt * float(viscosity[~solid].max(initial=0.0)) / (self.spacing[0] * self.spacing[1])
        taken_up, self._taken_up = self._taken_up, None
        basis = dt, no_slip, self.last.depth
        if taken_up and taken_up.basis == basis and np.array_equal(taken_up.solid, solid):
            levels = taken_up.levels
            self._change(levels, changed(taken_up.viscosity, viscosity), viscosity, solid, dt, no_slip)
        else:
            levels = [coefficients(viscosity, solid, dt, self.spacing, no_slip)]
            while len(levels) <= self.last.depth:
                levels.append(coarsened(levels[-1], no_slip, self.levels[len(levels)].box))
            for grid, level in zip(self.levels, levels, strict=False):
                grid.set_coefficients(level, no_slip)
        if self.last is self.levels[-1]:
            self._inverse.set(inverse_matrix(levels[-1]))
        self._taken_up = TakenUp(basis, viscosity, solid, levels)
        return levels[0]

    def _change(
        self, levels: list[Coefficients], box: Box | None, viscosity: np.ndarray, solid: np.ndarray, dt: float,
        no_slip: NoSlip,
    ) -> None:  # fmt: skip
        """Make the coefficients of all levels those of another viscosity, which differs in a box of cells."""
        if box is None:
            return
        change_finest(levels[0], box, viscosity, solid, dt, self.spacing, no_slip)
        self.finest.set_coefficients(levels[0], no_slip, box)
        for grid, level, fine in zip(self.levels[1:], levels[1:], levels, strict=False):
            box = box.coarser(level.open_u.shape)
            change_coarse(level, box, fine, no_slip, grid.box)
            grid.set_coefficients(level, no_slip, box)

    @property
    def finest(self) -> Level:
        return self.levels[0]

    @property
    def direct_level(self) -> Level:
        """The level that is solved directly."""
        return self._transform_level if self.has_transform else self.levels[-1]

    @property
    def last(self) -> Level:
        """The coarsest level that is visited."""
        return self.finest if self.plan.method == "smooth" else self.direct_level

    # -- cycles -----------------------------------------------------------------------------------------------------

    def precondition(self, rhs: PackedFaces, start: bool) -> PackedFaces:
        """About A^-1 rhs, by one cycle from rest, or from what the finest level's iterate holds if it is to `start`."""
        self.cycle(self.finest, rhs, begun=0 if start else self._begin(self.finest, rhs))
        return self.finest.faces.read

    def cycle(self, level: Level, rhs: PackedFaces, begun: int) -> None:
        """One multigrid cycle for A faces = rhs, from the level's iterate, on which so many sweeps have `begun`."""
        if level is self.direct_level:
            self.direct_solve(rhs)
            return
        weights = self.weights(level)
        self.smooth(level, rhs, weights[begun:])
        self._coarse_correction(level, rhs)
        self.smooth(level, rhs, weights[::-1])

    def _coarse_correction(self, level: Level, rhs: PackedFaces) -> None:
        # The write side is free until the correction is added.
        self.residual(level, level.faces.read, rhs, level.faces.write)
        coarser = self.levels[level.depth + 1]
        self.cycle(coarser, coarser.rhs, begun=self._restrict(level.faces.write, coarser))
        prolong = self.device.pass_("viscosity/prolong.frag", **level.defines)
        prolong(level.faces.write.fields, region=level.region, **coarser.faces.read.inputs("coarse_"),
                **level.faces.read.inputs(), **level.open)  # fmt: skip
        level.faces.swap()

    # -- its parts --------------------------------------------------------------------------------------------------

    def weights(self, level: Level) -> list[float]:
        """Chebyshev weights of the smoothing sweeps."""
        count = self.plan.sweeps
        if self.plan.method == "cg":
            largest = LARGEST_EIGENVALUE[1 if level.stencil else 0]
            return chebyshev_weights(largest / SMOOTHED[count], largest, count)
        # As for one viscosity: A v = v + k |q|^2 v for a wave q of no divergence, at most 16 k for a gradient; D is
        # 1 + 6 k, and no coarser level takes over.
        k = self._largest
        return chebyshev_weights(1.0 / (1.0 + 6.0 * k), (1.0 + 16.0 * k) / (1.0 + 6.0 * k), count)

    def smooth(
        self, level: Level, rhs: PackedFaces, weights: list[float], start: PackedFaces | None = None
    ) -> None:  # fmt: skip
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
        """The solution on the level where it is at hand."""
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
        """The first sweep from rest, where there is one; how many were made."""
        if level is self.direct_level:
            return 0
        start = self.device.pass_("viscosity/start.frag", **level.defines)
        start(level.faces.write.fields, region=level.region, weight=self.weights(level)[0], **rhs.inputs("rhs_"),
              **level.operator)  # fmt: skip
        level.faces.swap()
        return 1

    def _restrict(self, residual: PackedFaces, coarser: Level) -> int:
        """The residual as rhs of the coarser level, and the first sweep on it if it has any; how many were made."""
        if coarser is self.direct_level:
            restrict = self.device.pass_("viscosity/restrict.frag", **coarser.defines)
            restrict(coarser.rhs.fields, region=coarser.region, **residual.inputs(), **coarser.bounds)
            return 0
        restrict = self.device.pass_("viscosity/restrict.frag", START=1, **coarser.defines)
        restrict(
            coarser.rhs.fields + coarser.faces.write.fields,
            region=coarser.region,
            weight=self.weights(coarser)[0],
            **residual.inputs(),
            **coarser.operator,
        )
        coarser.faces.swap()
        return 1

    @property
    def nbytes(self) -> int:
        """Bytes of texture memory."""
        return sum(item.nbytes for item in (*self.levels, self._inverse, self._transform))

    def release(self) -> None:
        """Free the textures."""
        for item in (*self.levels, self._inverse, self._transform):
            item.release()

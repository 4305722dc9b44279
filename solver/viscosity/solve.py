"""The implicit viscous step: v - dt div( mu (grad v + grad v^T) ) = v*, viscosity varying from cell to cell (V1)."""

from __future__ import annotations

import math

import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field
from solver.packing import DoublePackedFaces, PackedFaces, Packing
from solver.params import Walls
from solver.viscosity.conjugate_gradients import ConjugateGradients
from solver.viscosity.deflation import Deflation
from solver.viscosity.multigrid import Multigrid
from solver.viscosity.plan import Plan, is_sharp, plan_for

# Larger dt mu / h^2 count as this. With more, a float64 loses the mass of a stiff part next to its stiffness, and in
# float32 the flows are the same.
MOST = 1e12


class Viscosity:
    """Solves the viscous step in conservative stress form, by the method that `plan` chooses for the viscosity.

    Args:
        device: where it lives.
        size: (nx, ny) of the grid.
        spacing: (hx, hy), sides of a cell in longer sides of the picture; by default square cells, `1 / max(size)`.

    Attributes:
        plan: chosen by `set_coefficients`.
    """

    def __init__(self, device: Device, size: tuple[int, int], spacing: tuple[float, float] | None = None) -> None:
        self.device = device
        self.size = size
        self.plan = Plan()
        self.spacing = spacing or (1.0 / max(size), 1.0 / max(size))
        self._wall_speed: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
        self.multigrid = Multigrid(device, size, self.spacing)
        finest = self.multigrid.finest
        self.conjugate_gradients = ConjugateGradients(device, finest)
        self.deflation = Deflation(device, finest)
        ringed = finest.rhs.u.size
        # v - v* of the last step: a flow changes little from step to step, and so does this.
        self._change = DoublePackedFaces(device, ringed, "viscous change")
        self._dragged = PackedFaces(device, ringed, "viscous right-hand side between moving walls")

    def set_spacing(self, spacing: tuple[float, float]) -> None:
        """Change the sides of the cells; the coefficients have to be set again."""
        self.spacing = spacing
        self.multigrid.set_spacing(spacing)

    def set_coefficients(self, viscosity: Field, solid: Field, dt: float, walls: Walls) -> None:
        """Take up another viscosity (cells, lengths^2 / s), solid cells (1 = solid), time step (s) or walls."""
        self._wall_speed = walls.driving_speed
        hx, hy = self.spacing
        kappa = dt / (hx * hy)
        is_solid = solid.get() == 255
        amount = np.clip(viscosity.get(), 0.0, MOST / max(kappa, 1e-25))
        fluid = amount[~is_solid] if is_solid.any() else amount
        least, largest = (float(fluid.min()), float(fluid.max())) if fluid.size else (0.0, 0.0)
        is_one, cells = least == largest and not is_solid.any(), self.size[0] * self.size[1]
        self.plan = plan_for(kappa * least, kappa * largest, cells, is_one, is_sharp(kappa * amount, is_solid))
        self.deflation.set_stiff(None)
        if is_one:
            self.multigrid.set_uniform(least, dt, walls.no_slip, self.plan)
        else:
            self.multigrid.set_coefficients(viscosity, solid, amount, is_solid, dt, walls.no_slip, self.plan)
        if self.plan.method != "smooth" and self.multigrid.direct_level is self.multigrid.finest:
            self.plan = Plan("direct")
        elif self.plan.stiff:
            self.deflation.set_stiff(~is_solid & (kappa * amount > self.plan.stiff), self.plan.stiff)

    @property
    def v_star(self) -> PackedFaces:
        """v*, packed; to be drawn here before `solve`, see `packing`."""
        return self.multigrid.finest.rhs

    @property
    def packing(self) -> Packing:
        """How a pass draws packed faces, once the coefficients are set."""
        finest = self.multigrid.finest
        return Packing(finest.region, {"UNIFORM": 1} if "UNIFORM" in finest.defines else {}, finest.open)

    def diffuse(self, velocity: Field) -> None:
        """Replace the velocity on MAC faces (lengths / s) by the solution; see `solve`."""
        self._pack(velocity, self.v_star)
        self.unpack(self.solve(), velocity)

    def solve(self) -> PackedFaces:
        """The solution for `v_star`, packed, in lengths / s; valid until the next solve."""
        v_star, rhs, finest = self.v_star, self._right_hand_side(), self.multigrid.finest
        if self.plan.method == "cg":
            plan, solve = self.plan, self.conjugate_gradients.solve
            wanted = plan.tolerance, plan.iterations, plan.cycle_leaves
            return solve(v_star, self._change, rhs, self._precondition, *wanted)
        if self.plan.method == "direct":
            self.multigrid.direct_solve(rhs)
        else:
            self.multigrid.smooth_alone(rhs, v_star, self.plan.sweeps)
        return finest.faces.read

    def _precondition(self, residual: PackedFaces) -> PackedFaces:
        finest = self.multigrid.finest
        if self.deflation.space is None:
            return self.multigrid.precondition(residual, start=False)
        if self.plan.rigid:
            return self.multigrid.precondition(residual, start=False, rigid=self.deflation)
        self.deflation.correct(residual, finest.faces.write)
        finest.faces.swap()
        return self.multigrid.precondition(residual, start=True)

    def unpack(self, faces: PackedFaces, velocity: Field) -> None:
        """Packed faces as a velocity on MAC faces."""
        self.device.pass_("viscosity/unpack.frag")(velocity, **faces.inputs())

    def _pack(self, velocity: Field, target: PackedFaces) -> None:
        packing = self.packing
        pack = self.device.pass_("viscosity/pack.frag", **packing.defines)
        pack(target.fields, region=packing.region, velocity=velocity, **packing.open)

    def _right_hand_side(self) -> PackedFaces:
        """v*, plus the drag of moving walls."""
        if not any(self._wall_speed):
            return self.v_star
        finest, rhs = self.multigrid.finest, self._dragged
        drag = self.device.pass_("viscosity/drag.frag", **finest.defines)
        drag(rhs.fields, region=finest.region, wall_speed=self._wall_speed, size=self.size, **self.v_star.inputs(),
             **finest.operator)  # fmt: skip
        return rhs

    def state(self) -> tuple[Field, Field]:
        """The fields that a later step depends on."""
        return self._change.read.fields

    def forget(self) -> None:
        """Start from v* next time: the velocity is a new one."""
        for field in self.state():
            field.clear()

    def residual_norm(self, solution: PackedFaces) -> float:
        """|b - A v| / |b| of what `solve` gave, or of any other packed faces; waits for the GPU."""
        finest, rhs = self.multigrid.finest, self._right_hand_side()
        self.multigrid.residual(finest, solution, rhs, finest.residual)
        wanted, found = (
            math.sqrt(sum(float((field.get().astype(np.float64) ** 2).sum()) for field in pair.fields))
            for pair in (rhs, finest.residual)
        )
        return found / wanted if wanted else 0.0

    def release(self) -> None:
        """Free the textures."""
        for item in (self._change, self._dragged, self.multigrid, self.conjugate_gradients, self.deflation):
            item.release()

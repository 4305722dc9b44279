"""The viscous step for one viscosity: a part of v*, corrected once by full multigrid."""

from __future__ import annotations

from typing import Any

from solver.gl.field import Field
from solver.gl.reduction import Reduction
from solver.packing import PackedFaces
from solver.viscosity.multigrid import Multigrid


class FullMultigrid:
    """One correction on the coarser levels of a `multigrid`, carried up level by level."""

    def __init__(self, multigrid: Multigrid) -> None:
        self.device = device = multigrid.device
        self.multigrid = multigrid
        self._residual = PackedFaces(device, multigrid.finest.rhs.u.size, "viscous residual of v*")
        coarser = multigrid.levels[min(1, len(multigrid.levels) - 1)].rhs.u.size
        self._products = device.field(coarser, 4, "viscous scaling products")
        self._sum = Reduction(device, coarser, 4, "sum")
        self._scaling = device.field((1, 1), 1, "viscous scaling")

    def correct(self, v_star: PackedFaces, rhs: PackedFaces) -> PackedFaces:
        """The step for one viscosity: a part of v*, corrected once by full multigrid, and smoothed.

        What the coarser levels do not carry of the right-hand side is divided by the diagonal, face by face.
        """
        grids = self.multigrid
        finest, coarser, residual = grids.finest, grids.levels[1], self._residual
        weights = grids.weights(finest, 1 + grids.plan.sweeps[0])
        grids.residual(finest, v_star, rhs, residual)
        self._restrict_scaled(rhs, residual)
        # The part that the coarser level does carry is not to be added face by face once more.
        k = grids.largest
        self._full_multigrid(scaling=weights[0] * (1.0 + 1.5 * k) / (1.0 + 6.0 * k))
        dragged: dict[str, Any] = {} if rhs is v_star else {"DRAGGED": 1}
        finish = self.device.pass_("viscosity/prolong.frag", CORRECT=1, **dragged, **finest.defines)
        finish(
            finest.faces.write.fields,
            region=finest.region,
            weight=weights[0],
            part=self._scaling,
            **coarser.faces.read.inputs("coarse_"),
            **v_star.inputs(),
            **residual.inputs("r_"),
            **(rhs.inputs("rhs_") if dragged else {}),
            **finest.operator,
        )
        finest.faces.swap()
        grids.smooth(finest, rhs, weights[1:])
        return finest.faces.read

    def _restrict_scaled(self, rhs: PackedFaces, residual: PackedFaces) -> None:
        """The right-hand side of the next level: what that part of v* leaves which has least energy there."""
        coarser = self.multigrid.levels[1]
        wanted, left = coarser.faces.write, coarser.faces.read
        restrict = self.device.pass_("viscosity/restrict.frag", WEIGHED=1, **coarser.defines)
        restrict((*left.fields, *wanted.fields, self._products), region=coarser.region, **residual.inputs(),
                 **rhs.inputs("rhs_"), **coarser.open)  # fmt: skip
        self.device.pass_("viscosity/scaling.frag")(self._scaling, products=self._sum.shrink(self._products))
        damp = self.device.pass_("viscosity/damp.frag")
        damp(coarser.rhs.fields, region=coarser.region, part=self._scaling, **wanted.inputs(), **left.inputs("r_"))

    def _full_multigrid(self, scaling: float) -> None:
        """A correction on the coarser levels: solved on the last, then carried up and improved level by level.

        From the finest of them so much of D^-1 rhs as `scaling` is taken away.
        """
        grids = self.multigrid
        last = grids.last
        levels = grids.levels[1 : last.depth + 1]
        right_hand_sides = [level.rhs for level in levels]
        begun = 0
        for rhs, coarser in zip(right_hand_sides, levels[1:], strict=False):
            begun = grids.restrict(rhs, coarser, grids.first_weight(coarser) if coarser is last else 0.0)
        if len(levels) == 1:
            begun = grids.begin(last, last.rhs)
        grids.cycle(last, last.rhs, begun, scaling=scaling if len(levels) == 1 else 0.0)
        for finer, coarser, rhs in reversed(list(zip(levels, levels[1:], right_hand_sides, strict=False))):
            prolong = self.device.pass_("viscosity/prolong.frag", START=1, **finer.defines)
            prolong(
                finer.faces.write.fields,
                region=finer.region,
                **coarser.faces.read.inputs("coarse_"),
                **coarser.rhs.inputs("coarse_rhs_"),
                **rhs.inputs(),
                **finer.operator,
            )
            finer.faces.swap()
            # A cycle overwrites the right-hand sides of coarser levels only, and those are used up by now.
            is_nested, at_end = finer.depth <= grids.plan.nested, scaling if finer is levels[0] else 0.0
            grids.smooth(finer, rhs, grids.weights(finer)[::-1], scaling=0.0 if is_nested else at_end)
            if is_nested:
                grids.cycle(finer, rhs, begun=0, two_grid=grids.plan.two_grid, scaling=at_end)

    @property
    def _fields(self) -> tuple[Field, ...]:
        return *self._residual.fields, self._products, self._scaling

    @property
    def nbytes(self) -> int:
        """Bytes of texture memory."""
        return sum(item.nbytes for item in (*self._fields, self._sum))

    def release(self) -> None:
        """Free the textures."""
        for item in (*self._fields, self._sum):
            item.release()

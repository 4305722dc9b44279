"""Flexible preconditioned conjugate gradients on packed faces."""

from __future__ import annotations

from collections.abc import Callable
from math import inf, isfinite, sqrt
from typing import Any

from solver.gl.device import Device
from solver.gl.reduction import Reduction
from solver.packing import DoublePackedFaces, PackedFaces
from solver.viscosity.operator import Level

# v* + d, d = v - v* of the last step, is taken as first guess if the best guess is better by no more than this fraction
# of the tolerated error: its residual is known already, which saves an eighth of a step in a flow that goes on as it
# did.
NEAR = 0.5


class ConjugateGradients:
    """Solves A x = b; the scalar products are summed up in float64, and wait for the GPU.

    The preconditioner need not be the same from one iteration to the next: beta makes the search direction conjugate to
    the last one by A itself (Notay, SIAM J. Sci. Comput. 22, 2000).

    Args:
        device: where it lives.
        level: whose operator A is.
    """

    def __init__(self, device: Device, level: Level) -> None:
        self.device = device
        self.level = level
        ringed = level.rhs.u.size
        names = "solution", "residual", "direction", "A p"
        self._x, self._r, self._p, self._ap = (DoublePackedFaces(device, ringed, f"viscous {name}") for name in names)
        self._az = PackedFaces(device, ringed, "viscous A z")
        self._products = device.field(ringed, 4, "viscous products")
        self._sum = Reduction(device, ringed, 4, "sum")
        # Of the guess, with the strains on the far walls, which lie in the ring.
        self._guess_products = device.field(ringed, 4, "viscous products of the guess")
        self._more_products = device.field(ringed, 2, "viscous products of the change and of the residual")
        self._sum_of_more = Reduction(device, ringed, 2, "sum")
        self.iterations = 0

    def solve(
        self,
        v_star: PackedFaces,
        change: DoublePackedFaces,
        rhs: PackedFaces,
        precondition: Callable[[PackedFaces], PackedFaces],
        tolerance: float,
        most: int,
        cycle_leaves: float = inf,
    ) -> PackedFaces:
        """The solution, from about the best first guess in the plane of `v_star` and the last step's `change`.

        `change` becomes v - v* of this step. Ends when less than the fraction `tolerance`^2 is left, see README.md, or
        after `most` iterations. The energy left is estimated as the rest of the geometric series of the iterations'
        gains, but no less than the last gain, nor than r . z. `precondition(r)` returns about A^-1 r. If it is known to
        leave at most the fraction `cycle_leaves` of the energy of any error, the first iteration may be the last
        without A z and its products: the error of the guess v* + d has the energy r . A^-1 r <= r . r, as A >= 1.
        """
        iterate: dict[str, Any] = {"parts": (1.0, 1.0), **v_star.inputs(), **change.read.inputs("change_")}
        self._guess(iterate, rhs)
        bv, bd, vav, vad = self._sum(self._guess_products).tolist()
        dad, rr = self._sum_of_more(self._more_products).tolist()
        self.iterations = 0
        if rhs is v_star and not vav:  # at rest
            for field in change.read.fields:
                field.clear()
            return v_star
        a, c = least_energy(bv, bd, vav, vad, dad)
        found, lost = a * bv + c * bd, (1.0 - a) ** 2 * vav + 2.0 * (1.0 - a) * (1.0 - c) * vad + (1.0 - c) ** 2 * dad
        if not lost <= (NEAR * tolerance) ** 2 * found:
            iterate["parts"] = a, c
            self._guess(iterate, rhs)
        else:
            found -= lost
            if cycle_leaves * rr <= tolerance**2 * found:
                self.iterations = 1
                return self._finish(change, iterate, precondition(self._r.read), 1.0)
        curvature, gained_before = 0.0, inf
        while True:
            self.iterations += 1
            z = precondition(self._r.read)
            rz, z_az, z_ap, xx = self._apply_operator(z, iterate)
            alpha, iterate["beta"], curvature = cg_coefficients(rz, z_az, z_ap, curvature)
            gained = alpha**2 * curvature
            found += gained
            left = max(gained, rz, _series(gained, gained_before))
            size = found if cycle_leaves < inf else sqrt(max(found * xx, 0.0))
            if not alpha or self.iterations == most or left <= tolerance**2 * size:
                # With alpha 0, z may hold NaN.
                return self._finish(change, iterate, z if alpha else self._r.read, alpha)
            gained_before = gained
            self._update(iterate, z, alpha)
            iterate = {**v_star.inputs(), **self._x.read.inputs("x_"), **self._p.read.inputs("p_"), "beta": 0.0}

    def _guess(self, guess: dict[str, Any], rhs: PackedFaces) -> None:
        """The residual of a v* + c d, (a, c) its `parts`, and the products that give the best ones."""
        x, y, width, height = self.level.region
        draw = self.device.pass_("viscosity/guess_residual.frag", **self.level.defines)
        targets = *self._r.read.fields, self._guess_products, self._more_products
        draw(targets, region=(x, y, width + 1, height + 1), **guess, **rhs.inputs("rhs_"), **self.level.operator)

    def _apply_operator(self, z: PackedFaces, iterate: dict[str, Any]) -> list[float]:
        """A z, and r . z, z . A z, z . A p (at first 0) and x . x (of one viscosity 0)."""
        first, targets = _first(iterate), (*self._az.fields, self._products)
        draw = self.device.pass_("viscosity/apply_operator.frag", **first, **self.level.defines)
        draw(targets, region=self.level.region, **iterate, **z.inputs("z_"), **self._r.read.inputs("r_"),
             **({} if first else self._ap.read.inputs("ap_")), **self.level.operator)  # fmt: skip
        return self._sum(self._products).tolist()

    def _update(self, iterate: dict[str, Any], z: PackedFaces, alpha: float) -> None:
        """p = z + beta p, A p likewise, x + alpha p, r - alpha A p."""
        first, pairs = _first(iterate), (self._x, self._r, self._p, self._ap)
        update = self.device.pass_("viscosity/update.frag", **first)
        targets = [field for pair in pairs for field in pair.write.fields]
        update(targets, region=self.level.region, alpha=alpha, **iterate, **z.inputs("z_"), **self._az.inputs("az_"),
               **self._r.read.inputs("r_"), **({} if first else self._ap.read.inputs("ap_")))  # fmt: skip
        for pair in pairs:
            pair.swap()

    def _finish(self, change: DoublePackedFaces, iterate: dict[str, Any], z: PackedFaces, alpha: float) -> PackedFaces:
        """x + alpha p, and its difference to v* as the `change`."""
        finish = self.device.pass_("viscosity/finish.frag", **_first(iterate))
        targets = (*self._x.write.fields, *change.write.fields)
        finish(targets, region=self.level.region, alpha=alpha, **iterate, **z.inputs("z_"))
        change.swap()
        return self._x.write

    def release(self) -> None:
        """Free the textures."""
        for item in (self._x, self._r, self._p, self._ap, self._az):
            item.release()
        for item in (self._products, self._sum, self._guess_products, self._more_products, self._sum_of_more):
            item.release()


def least_energy(bv: float, bd: float, vav: float, vad: float, dad: float) -> tuple[float, float]:
    """(a, c) of the x = a v* + c d of least energy, from products of v*, d and b; zeros if they are not finite."""
    # Along v*; then along the part of d that is conjugate to v*, unless that is lost in rounding.
    a = bv / vav if vav > 0.0 else 0.0
    conjugate = vad / vav if vav > 0.0 else 0.0
    left = dad - conjugate * vad
    c = (bd - conjugate * bv) / left if left > 1e-5 * dad else 0.0
    a -= conjugate * c
    return (a, c) if isfinite(a) and isfinite(c) else (0.0, 0.0)


def _series(last: float, before: float) -> float:
    """The rest of the geometric series with these two terms."""
    return last**2 / (before - last) if before > last else inf


def _first(iterate: dict[str, Any]) -> dict[str, Any]:
    """The variant of a pass for the first iteration: the iterate is the guess, and there is no search direction."""
    return {"FIRST": 1} if "parts" in iterate else {}


def cg_coefficients(rz: float, z_az: float, z_ap: float, p_ap: float) -> tuple[float, float, float]:
    """(alpha, beta, p . A p) of the next direction p = z + beta p_before; alpha is 0 if rounding leaves none."""
    beta = -z_ap / p_ap if p_ap > 0.0 else 0.0
    curvature = z_az + beta * z_ap
    if not (isfinite(curvature) and isfinite(rz)) or curvature <= 1e-6 * z_az:
        return 0.0, 0.0, 0.0
    return rz / curvature, beta, curvature

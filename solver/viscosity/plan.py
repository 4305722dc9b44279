"""Which method solves a viscous step, and how much of it: chosen from kappa = dt mu / h^2 alone.

The errors are those of `tests/benchmarks/bench_viscosity.py`, against a direct solution.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

# kappa up to which two smoothing sweeps leave less than 0.1 %.
BARELY_VISCOUS = 0.05
# A viscosity that varies less than so many times is solved as if it were one: the correction then still holds 1 %.
NEARLY_UNIFORM = 3.0
# Deflated is what is stiffer than this: below, multigrid alone takes no more iterations. A node that touches the
# softest cell is never stiffer than 4 kappa_min, the harmonic mean of four of which three resist everything.
STIFF = 30.0
STIFF_OF_SOFTEST = 4.0
# Softest kappa up to which one sweep before and after the coarser levels does as well as two, and costs three fifths.
ONE_SWEEP = 4.0
# Conjugate gradients end when less than this part of the energy, squared, is left: the error is below 1 % where the
# viscosity varies so much at most, and below 5 % beyond.
MODERATE = 300.0
TOLERANCE = 0.017
TOLERANCE_STIFF = 0.07, 0.036  # for the softest kappa below and above ONE_SWEEP
# Iterations at most: only rounding errors, at contrasts beyond 1e8, can ask for more.
MOST_ITERATIONS = 30


@dataclass(frozen=True)
class Plan:
    """How a viscous step is solved; see `plan_for`.

    Attributes:
        method: "smooth": v* is smoothed; "direct": the grid is so small that its inverse is at hand; "fmg": v* is
            corrected once, by full multigrid, and smoothed; "cg": by conjugate gradients, each iteration with one
            multigrid cycle.
        sweeps: smoothing sweeps before and after the coarser levels: (on the finest, on the others).
        tolerance: of the conjugate gradients.
        iterations: of the conjugate gradients, at most.
        stiff: dt mu / h^2 above which cores and runs are deflated; 0: none are.
        deflate_twice: once more after the cycle: what stiff parts have to do with each other through viscous fluid.
        levels: coarser levels that are visited, at most.
        nested: of these, the finest so many get a cycle while full multigrid carries a correction up through them.
        two_grid: such a cycle goes one level down only.
    """

    method: Literal["smooth", "direct", "fmg", "cg"] = "cg"
    sweeps: tuple[int, int] = (1, 1)
    tolerance: float = TOLERANCE
    iterations: int = MOST_ITERATIONS
    stiff: float = 0.0
    deflate_twice: bool = False
    levels: int = 99
    nested: int = 99
    two_grid: bool = False


def plan_for(least: float, largest: float) -> Plan:
    """The plan for kappa between `least` and `largest`."""
    if largest <= BARELY_VISCOUS:
        return Plan("smooth", (2, 0), levels=0)
    if largest <= NEARLY_UNIFORM * least:
        # What a nested cycle meets is smooth only where the viscosity reaches far.
        nested = 0 if largest <= 5.0 else 1 if largest <= 50.0 else 2
        return Plan("fmg", (2, 2), nested=nested, two_grid=largest <= 150.0)
    is_soft = least <= ONE_SWEEP
    count = 1 if is_soft else 2
    stiff = max(STIFF, STIFF_OF_SOFTEST * least)
    tolerance = TOLERANCE if largest <= MODERATE * least else TOLERANCE_STIFF[count - 1]
    if largest <= stiff:
        return Plan("cg", (count, count), tolerance)
    return Plan("cg", (count, count), tolerance, stiff=stiff, deflate_twice=not is_soft)

"""Which method solves a viscous step, and how much of it: chosen from kappa = dt mu / h^2 alone.

The errors are those of `tests/benchmarks/bench_viscosity.py`, against a direct solution.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

# Smoothing sweeps up to which they alone are the viscous step, as many as the bound of `sweeps_alone` asks for: that is
# up to kappa = .4. A solve of one iteration costs as much as ten (512^2, one viscosity; a sweep 1.1 J, the solve 11).
MOST_SWEEPS = 10
# Deflated is what is stiffer than this: below, multigrid alone takes no more iterations. A node that touches the
# softest cell is never stiffer than 4 kappa_min, the harmonic mean of four of which three resist everything.
STIFF = 30.0
STIFF_OF_SOFTEST = 4.0
# Where all is viscous, stiff parts move together through what lies between them. If they have edges, the coarse levels,
# which count strains in them that they do not have, cannot carry that; nor beside solids, where coarse strains are not
# those of the fine level. There the coarse levels move parts above this kappa, in those of the softest cell, as a
# whole; what is less stiff strains a little, and is theirs. Smooth masks take half the iterations without, or a third.
# F-cycles repeat the coarse correction, which is overshot beside solids: it could point uphill, which ended a
# step of contrast 100 at 9 % of error in three iterations.
RIGID_OF_SOFTEST = 40.0
# The share of what bounds stiff parts that is an edge from which on they have edges: it is .5 to 1 of masks of two
# values and of noise, and 0 to .06 of smooth ones, also where these jump by far more than `MODERATE` in a few places.
EDGED = 0.25
# Softest kappa of a mask up to which one sweep before and after the coarser levels does as well as two, and costs three
# fifths, if a contrast beyond `MODERATE` leaves more. Of one viscosity there are two, both after the coarser levels.
ONE_SWEEP = 4.0
# Conjugate gradients end when less than this part, squared, is left (README.md): the error is below 1 % where the
# viscosity varies so much at most, and below 5 % beyond. With .017 noise of one viscosity was 1.8 % off; .012 leaves
# .5 % at most of 300 random masks, and .008 took half an iteration more.
MODERATE = 300.0
TOLERANCE = 0.008
TOLERANCE_MODERATE = 0.012
TOLERANCE_STIFF = 0.07
# On a grid of so few cells an iteration costs next to nothing, and what all steps leave adds up to more of it: there a
# third of the tolerance is asked for, and of one viscosity a ninth. A moderate mask of 27 x 27 cells with walls was .22
# cells off its turned set-up after 60 steps that moved 12, and is .06; one viscosity on 25 x 33 was .020, and is .001.
SMALL = 64 * 64
# Of one viscosity a cycle leaves so much of the energy of an error at most: .72^2. By power iteration on 40 x 31 and
# 97 x 130 cells it is .40^2 (kappa .5) to .67^2 (100) between free-slip walls, .34^2 to .72^2 between no-slip ones.
UNIFORM_CYCLE_LEAVES = 0.52
# Iterations at most: only rounding errors, at contrasts beyond 1e8, can ask for more.
MOST_ITERATIONS = 30


@dataclass(frozen=True)
class Plan:
    """How a viscous step is solved; see `plan_for`.

    Attributes:
        method: "smooth": v* is smoothed, by Chebyshev's weights; "direct": the grid is so small that its transform or
            inverse is at hand; "cg": by conjugate gradients, each iteration with one multigrid cycle.
        sweeps: smoothing sweeps; of conjugate gradients, before and after the coarser levels, or of one viscosity only
            after them.
        tolerance: of the conjugate gradients.
        iterations: of the conjugate gradients, at most.
        cycle_leaves: of the energy of any error, that a cycle leaves at most, where it is known.
        stiff: dt mu / h^2 above which cores and runs are deflated; 0: none are.
        rigid: the coarse levels move each of these parts as a whole, and count no viscosity above `stiff`.
        full: cycles are F-cycles.
    """

    method: Literal["smooth", "direct", "cg"] = "cg"
    sweeps: int = 1
    tolerance: float = TOLERANCE
    iterations: int = MOST_ITERATIONS
    cycle_leaves: float = math.inf
    stiff: float = 0.0
    rigid: bool = False
    full: bool = False


def is_sharp(kappa: np.ndarray, solid: np.ndarray) -> bool:
    """True if coarse levels must move stiff parts as a whole, should there be any; see `RIGID_OF_SOFTEST`.

    `kappa`, `solid`: of the cells, (ny, nx).
    """
    if solid.any():
        return True
    if kappa.min() <= ONE_SWEEP:
        return False
    borders = edges = 0
    for one, other in (kappa[1:], kappa[:-1]), (kappa[:, 1:], kappa[:, :-1]):
        less, more = np.minimum(one, other), np.maximum(one, other)
        is_border = (less <= RIGID_OF_SOFTEST * kappa.min()) & (more > RIGID_OF_SOFTEST * kappa.min())
        borders += np.count_nonzero(is_border)
        edges += np.count_nonzero(is_border & (more > MODERATE * less))
    return bool(edges > EDGED * borders)


def sweeps_alone(kappa: float, leaves: float) -> int:
    """Chebyshev-Jacobi sweeps after which that part of the error is left at most, by kappa of one viscosity.

    A is 1 + kappa |q|^2 for a wave q of no divergence and at most 1 + 16 kappa for a gradient, so n sweeps leave
    1 / T_n(1 + 1 / (8 kappa)). At first the error of v* is 16 kappa |v| at most.
    """
    if kappa <= 0.0 or leaves >= 1.0:
        return 1
    return math.ceil(math.acosh(1.0 / leaves) / math.acosh(1.0 + 0.125 / kappa))


def plan_for(least: float, largest: float, cells: int, is_one: bool, is_sharp: bool) -> Plan:
    """The plan for kappa between `least` and `largest` on so many cells; see `is_sharp`.

    `is_one`: there is but one viscosity, and nothing solid.
    """
    share, of_one = (1.0, 1.0) if cells > SMALL else (1.0 / 3.0, 1.0 / 9.0)
    count = sweeps_alone(largest, share * TOLERANCE / (16.0 * max(largest, 1e-30)))
    if count <= MOST_SWEEPS:
        return Plan("smooth", count)
    if is_one:
        return Plan("cg", 2, of_one * TOLERANCE, cycle_leaves=UNIFORM_CYCLE_LEAVES)
    varies = largest > MODERATE * least
    # Sharp and moderate are only masks with solids.
    rigid = is_sharp and (varies or (least > ONE_SWEEP and largest > RIGID_OF_SOFTEST * least))
    count = 1 if least <= ONE_SWEEP and varies and not rigid else 2
    stiff = max(STIFF, (RIGID_OF_SOFTEST if rigid else STIFF_OF_SOFTEST) * least)
    tolerance = TOLERANCE_STIFF if varies else share * TOLERANCE_MODERATE
    full = least > ONE_SWEEP and not is_sharp
    if largest <= stiff:
        return Plan("cg", count, tolerance, full=full)
    return Plan("cg", count, tolerance, stiff=stiff, rigid=rigid, full=full)

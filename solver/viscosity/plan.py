"""Which method solves a viscous step, and with what effort: chosen from kappa = dt mu / h^2 and the solid cells alone.

Errors are against a direct solution (`tests/benchmarks/bench_viscosity.py`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

# If the bound of `sweeps_alone` needs no more smoothing sweeps than this, they alone are the viscous step: up to
# kappa = .43. A solve of one iteration costs as much as ten (512^2, one viscosity; a sweep 1.1 J, the solve 11).
MOST_SWEEPS = 10
# Cells stiffer than this are deflated: below, multigrid alone takes no more iterations. A node that touches the
# softest cell is never stiffer than 4 kappa_min, the harmonic mean of four of which three are infinitely stiff.
STIFF = 30.0
STIFF_OF_SOFTEST = 4.0
# Where all is viscous, stiff parts move together with the fluid between them. Coarse levels cannot represent that where
# the parts have sharp edges, since coarse motions strain them, nor next to solids, where coarse strains are not those
# of the fine level. There the coarse levels move parts stiffer than this times the softest cell as a whole; less stiff
# parts may strain a little. Smooth masks take half or a third of the iterations without.
RIGID_OF_SOFTEST = 40.0
# Stiff parts count as sharp if at least this share of their border is an edge. It is .5 to 1 for masks of two values
# and for noise, and 0 to .06 for smooth ones, even if these jump by far more than `MODERATE` in a few places.
EDGED = 0.25
# Up to this softest kappa, and beyond a contrast of `MODERATE`, one sweep before and one after the coarser levels do as
# well as two each, and cost three fifths. With one viscosity there are two, both after the coarser levels.
ONE_SWEEP = 4.0
# Conjugate gradients end when less than the square of the tolerance is left (README.md). The error is then below 1 % up
# to a contrast of `MODERATE`, and below 5 % beyond. With .017 noise of one viscosity was 1.8 % off; .012 leaves .5 % at
# most in 300 random masks, where .008 took half an iteration more.
MODERATE = 300.0
TOLERANCE = 0.008
TOLERANCE_MODERATE = 0.012
TOLERANCE_STIFF = 0.07
# On a grid of at most so many cells an iteration costs next to nothing, and the errors of all steps add up to more of a
# cell. There the tolerance is a ninth, up to a contrast of `MODERATE`. Such masks with walls on up to 40 x 40 cells
# were up to .22 cells off their turned set-up after 60 steps that moved 12; with a third still .13, now .08. One
# viscosity on 25 x 33 was .020 off, and is .001.
SMALL = 64 * 64
# With one viscosity a cycle leaves at most this fraction of the energy of any error: .72^2. By power iteration on 40 x
# 31 and 97 x 130 cells it is .40^2 (kappa .5) to .67^2 (100) between free-slip walls, .34^2 to .72^2 between no-slip
# ones.
UNIFORM_CYCLE_LEAVES = 0.52
# Only rounding errors, at contrasts beyond 1e8, could need more iterations; and the ninth of the tolerance on small
# grids, in noise and mazes of a contrast near `MODERATE` and kappa beyond 6e3: two of 292 took all, at most .2 % off.
MOST_ITERATIONS = 30


@dataclass(frozen=True)
class Plan:
    """How a viscous step is solved; see `plan_for`.

    Attributes:
        method: "smooth": Chebyshev-Jacobi sweeps from v*; "direct": the grid is small enough for a transform or a dense
            inverse; "cg": conjugate gradients, one multigrid cycle an iteration.
        sweeps: smoothing sweeps; with "cg" before and after the coarser levels, or with one viscosity only after them.
        tolerance: of the conjugate gradients.
        iterations: of the conjugate gradients, at most.
        cycle_leaves: the fraction of the energy of any error that a cycle leaves at most, where it is known.
        stiff: dt mu / h^2 above which cores and runs are deflated; 0: none are.
        rigid: the coarse levels move each of these parts as a whole, and cut viscosity off at `stiff`.
    """

    method: Literal["smooth", "direct", "cg"] = "cg"
    sweeps: int = 1
    tolerance: float = TOLERANCE
    iterations: int = MOST_ITERATIONS
    cycle_leaves: float = math.inf
    stiff: float = 0.0
    rigid: bool = False


def is_sharp(kappa: np.ndarray, solid: np.ndarray) -> bool:
    """True if coarse levels must move stiff parts, if there are any, as a whole; see `RIGID_OF_SOFTEST`.

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
    """Chebyshev-Jacobi sweeps that leave at most the fraction `leaves` of any error, by kappa of one viscosity.

    A is 1 + kappa |q|^2 for a wave q without divergence and at most 1 + 16 kappa for a gradient, so n sweeps leave
    1 / T_n(1 + 1 / (8 kappa)). The error of v* is 16 kappa |v| at most.
    """
    if kappa <= 0.0 or leaves >= 1.0:
        return 1
    return math.ceil(math.acosh(1.0 / leaves) / math.acosh(1.0 + 0.125 / kappa))


def plan_for(least: float, largest: float, cells: int, is_one: bool, has_edges: bool) -> Plan:
    """The plan for kappa between `least` and `largest` on so many cells.

    `is_one`: there is only one viscosity, and nothing solid. `has_edges`: of stiff parts, see `is_sharp`.
    """
    share = 1.0 if cells > SMALL else 1.0 / 9.0
    count = sweeps_alone(largest, share * TOLERANCE / (16.0 * max(largest, 1e-30)))
    if count <= MOST_SWEEPS:
        return Plan("smooth", count)
    if is_one:
        return Plan("cg", 2, share * TOLERANCE, cycle_leaves=UNIFORM_CYCLE_LEAVES)
    varies = largest > MODERATE * least
    # Below `MODERATE` only masks with solids are sharp.
    rigid = has_edges and (varies or (least > ONE_SWEEP and largest > RIGID_OF_SOFTEST * least))
    count = 1 if least <= ONE_SWEEP and varies and not rigid else 2
    stiff = max(STIFF, (RIGID_OF_SOFTEST if rigid else STIFF_OF_SOFTEST) * least)
    tolerance = TOLERANCE_STIFF if varies else share * TOLERANCE_MODERATE
    if largest <= stiff:
        return Plan("cg", count, tolerance)
    return Plan("cg", count, tolerance, stiff=stiff, rigid=rigid)

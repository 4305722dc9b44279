"""The balance of pushes (H3): strengths that together do what is wanted, none more than a step bears."""

from __future__ import annotations

import numpy as np

# In which those that would be too strong are weighed anew: so many rounds, and no more than take so many
# multiplications, as many as a core does in about a quarter of a second.
ROUNDS, MOST_WORK = 12, 2**32
CLOSE = 1.01  # times its bound where that ends; by as much as one still exceeds it, all are less


class Balance:
    """Least squares as (H3) for pushes of handles and turns of rings, with a bound for every push.

    Those of one width that overlap keep the bound together, too.

    Args:
        influence: what each unknown does to each thing that is wanted, K, (n, k); of the unknowns the first 2 m are the
            forces of m pushes, the others are not bounded.
        soft: what is added to the squares of each that is wanted, (n,).
        shares: what the unknowns count there, W, (k,).
        owners: of each that is wanted, (n,), and of each unknown, (k,), the number of its handle.
        bounds: of pushes, (m,).
        narrow: how many of the pushes, the first, are narrow ones, one at each point that is wanted to move, in their
            order; the others are wide ones. All of them if it is not given.
    """

    def __init__(
        self,
        influence: np.ndarray,
        soft: np.ndarray,
        shares: np.ndarray,
        owners: tuple[np.ndarray, np.ndarray],
        bounds: np.ndarray,
        narrow: int | None = None,
    ) -> None:
        self._influence, self._soft, self._shares, self._owners = influence, soft, shares, owners
        self._bounds = np.concatenate([np.repeat(bounds, 2), np.full(len(shares) - 2 * len(bounds), np.inf)])
        self._pushes, self._narrow = 2 * len(bounds), 2 * (len(bounds) if narrow is None else narrow)
        self._of_all = _system(influence, soft, shares)

    def strengths(self, wanted: np.ndarray, parts: np.ndarray | float = 1.0) -> np.ndarray:
        """Of all unknowns, (k,), for what is wanted, (n,), of each a part, (k,), as it is then no longer balanced."""
        found = parts * self._each_within(wanted)
        return found / max(self._over_together(found), 1.0)

    def _each_within(self, wanted: np.ndarray) -> np.ndarray:
        """The same, every push within its bound, however many lie on one another."""
        found = solved(self._influence, self._soft, wanted, self._shares, self._of_all)
        if self._over(found).max(initial=0.0) <= 1:
            return found
        wanted, shares = self._as_one(wanted), self._shares
        found = solved(self._influence, self._soft, wanted, self._shares, self._of_all)
        count, unknowns = self._influence.shape
        for _ in range(min(ROUNDS, MOST_WORK // max(count * count * unknowns, 1))):
            over = self._over(found)
            if over.max() <= CLOSE:
                break
            # What is too strong counts less, and the others make up for it: cut off, it would leave them unbalanced. At
            # rest on the bounds this is the constrained minimum; it ends as soon as all are within.
            shares = np.minimum(self._shares, shares / np.maximum(over, 1e-30))
            found = solved(self._influence, self._soft, wanted, shares)
        return found / max(self._over(found).max(), 1.0)

    def _over_together(self, found: np.ndarray) -> float:
        """How many times the bound of one push the narrow ones move a point together, or the wide ones, at most.

        Of many that lie on one another each may be within its own. And where narrow ones and wide ones are opposed,
        they cancel at the points, but not around them.
        """
        narrow, wide = slice(0, self._narrow), slice(self._narrow, self._pushes)

        def over(kind: slice, bounds: np.ndarray) -> float:
            moved = np.hypot(*(self._influence[: self._narrow, kind] @ found[kind]).reshape(-1, 2).T)
            return float((moved / bounds).max(initial=0.0))

        over_narrow = over(narrow, self._bounds[narrow][::2])
        return max(over_narrow, over(wide, self._bounds[wide].max())) if wide.stop > wide.start else over_narrow

    def _as_one(self, wanted: np.ndarray) -> np.ndarray:
        """What is wanted of each handle, all in the proportion that its own pushes would bear if it were alone."""
        wanted, (rows, columns) = wanted.copy(), self._owners
        for owner in np.unique(rows):
            mine, own = rows == owner, columns == owner
            alone = solved(self._influence[np.ix_(mine, own)], self._soft[mine], wanted[mine], self._shares[own])
            wanted[mine] /= max(self._over(alone, own).max(initial=0.0), 1.0)
        return wanted

    def _over(self, found: np.ndarray, which: np.ndarray | slice = slice(None)) -> np.ndarray:
        """How many times its bound each of some unknowns is."""
        bounds, over = self._bounds[which], np.zeros(len(found))
        pushes = np.isfinite(bounds)
        over[pushes] = np.repeat(np.hypot(*found[pushes].reshape(-1, 2).T), 2) / bounds[pushes]
        return over


def _system(influence: np.ndarray, soft: np.ndarray, shares: np.ndarray | float = 1.0) -> np.ndarray:
    """K W K' + diag(soft) of (H3)."""
    half = np.sqrt(shares) * influence
    matrix = half @ half.T  # numpy computes one half of what is symmetric so
    matrix[np.diag_indices_from(matrix)] += soft
    return matrix


def solved(
    influence: np.ndarray,
    soft: np.ndarray,
    wanted: np.ndarray,
    shares: np.ndarray | float = 1.0,
    matrix: np.ndarray | None = None,
) -> np.ndarray:
    """W K' times the inverse of the matrix of (H3), found if it is not at hand, times what is wanted."""
    matrix = _system(influence, soft, shares) if matrix is None else matrix
    return shares * (np.linalg.solve(matrix, wanted) @ influence)

"""Connected components beside SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components as reference

from solver.components import connected_components


@pytest.mark.parametrize("shape", ["random", "path", "tree"])
def test_they_are_those_of_scipy_by_their_smallest_number(shape: str) -> None:
    for seed in range(30):
        random = np.random.default_rng(seed)
        count = int(random.integers(2, 300))
        numbers = random.permutation(count)
        if shape == "random":
            one, other = random.integers(0, count, (2, int(random.integers(0, 2 * count))))
        elif shape == "path":
            one, other = numbers[:-1], numbers[1:]
        else:
            one, other = numbers[1:], numbers[[int(random.integers(0, k)) for k in range(1, count)]]
        found = connected_components(np.arange(count), one, other)
        graph = coo_array((np.ones(len(one)), (one, other)), shape=(count, count))
        parts = reference(graph, directed=False)[1]
        least = np.full(parts.max() + 1, count)
        np.minimum.at(least, parts, np.arange(count))
        np.testing.assert_array_equal(found, least[parts])

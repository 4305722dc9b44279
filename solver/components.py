"""The connected components of a graph, in NumPy."""

from __future__ import annotations

import numpy as np


def connected_components(root: np.ndarray, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """For each vertex the smallest number among those that it is connected with.

    Args:
        root: (n,), what is known already: of each vertex one that it is connected with, itself if none.
        one, other: (m,), the vertices at both ends of each edge.
    """
    while True:
        a, b = root[one], root[other]
        apart = a != b
        if not apart.any():
            return root
        a, b, one, other = a[apart], b[apart], one[apart], other[apart]
        root = root.copy()
        # Edges are hung on the representatives, and the paths to these halved: the rounds grow as the logarithm.
        np.minimum.at(root, np.maximum(a, b), np.minimum(a, b))
        while (root != root[root]).any():
            root = root[root]

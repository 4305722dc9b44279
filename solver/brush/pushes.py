"""The pushes of handles, with their images in the picture's edges: what they do to each other, and to the fluid."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np

from solver.brush.listed import draw_listed
from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.passes import Pass
from solver.grid import Grid

BLOCK = 2**17  # pairs of an image and a place that are looked at in one go: of lines there are four millions


class Pushes:
    """Pushes (H2) at some places, longer sides, so that none crosses an edge and the projection takes nothing of it.

    Args:
        grid: the fluid's.
        places: their middles, (m, 2).
        radii: how far they reach, (m,).
    """

    def __init__(self, grid: Grid, places: np.ndarray, radii: np.ndarray) -> None:
        self._grid = grid
        mirrors, shifts = _images(grid)
        middles = mirrors * places[:, None] + shifts
        outside = np.maximum(np.maximum(-middles, middles - grid.picture), 0.0)
        reaches = np.hypot(outside[..., 0], outside[..., 1]) < radii[:, None]
        reaches[:, 0] = True
        # Of every image that reaches into the picture: whose it is, how it is mirrored, where and how large it is.
        self._numbers, image = np.nonzero(reaches)
        self._firsts = np.searchsorted(self._numbers, np.arange(len(places)))
        self._mirrors, self._middles, self._radii = mirrors[image], middles[reaches], radii[self._numbers]

    def influence(self, places: np.ndarray) -> np.ndarray:
        """The velocities at places (n, 2) for their forces, (n, a, m, b): the curl of (1 - q)^5 (1 + 5 q) (F x r)."""

        def matrices(x: np.ndarray, y: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            far = np.maximum(1 - q, 0.0)
            across = far**4
            along, across = far * across * (1 + 5 * q), 30 * across
            return along - across * y * y, across * x * y, along - across * x * x

        return self._at(places, matrices)

    def local_influence(self, places: np.ndarray) -> np.ndarray:
        """The same of local brushes, (1 - q^2)^3: as in carry.frag, images in one edge take off what points at it."""
        both = self._mirrors.sum(axis=1)

        def matrices(x: np.ndarray, y: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            weight = np.maximum(1 - q**2, 0.0) ** 3 * (both >= 0)
            across, down = (weight * ((both > 0) | (mirror < 0)) for mirror in self._mirrors.T)
            return across, np.zeros_like(x), down

        return self._at(places, matrices)

    def draw(self, device: Device, shader: Pass, target: Field, forces: np.ndarray) -> None:
        """Add what a shader draws of them, with forces (m, 2), whatever the viscosity; see `draw_listed`."""
        vectors = self._mirrors * forces[self._numbers]
        draw_listed(device, shader, target, self._grid, self._middles, self._radii, vectors)

    def _at(self, places: np.ndarray, matrices: Callable[..., tuple[np.ndarray, np.ndarray, np.ndarray]]) -> np.ndarray:
        """What all images do at places (n, 2), from the entries of each one's matrix there, some places at a time."""
        several = max(BLOCK // max(len(self._radii), 1), 1)
        found = np.empty((len(places), len(self._firsts), 2, 2)).transpose(0, 2, 1, 3)
        for start in range(0, len(places), several):
            block = slice(start, start + several)
            found[block] = self._together(*matrices(*self._apart(places[block])))
        return found

    def _apart(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """From each image to each place, in radii: x, y, and how far."""
        x, y = ((places[:, None, axis] - self._middles[:, axis]) / self._radii for axis in (0, 1))
        return x, y, np.hypot(x, y)

    def _together(self, xx: np.ndarray, xy: np.ndarray, yy: np.ndarray) -> np.ndarray:
        """What all images of a push do, from the symmetric matrices (n, images) of each."""
        mirrored = [part * self._mirrors[:, axis] for part, axis in ((xx, 0), (xy, 1), (xy, 0), (yy, 1))]
        if not len(self._firsts):
            return np.zeros((len(xx), 2, 0, 2))
        summed = [np.add.reduceat(part, self._firsts, axis=1) for part in mirrored]
        return np.stack(summed, axis=-1).reshape(len(xx), -1, 2, 2).transpose(0, 2, 1, 3)


def _images(grid: Grid) -> tuple[np.ndarray, np.ndarray]:
    """The images of a brush in the picture's edges, itself first, (k, 2) each: x -> mirror x + shift."""
    left, right, top, bottom = grid.at_edge
    across = [(1.0, 0.0)] + [(-1.0, 0.0)] * left + [(-1.0, 2 * grid.picture[0])] * right
    down = [(1.0, 0.0)] + [(-1.0, 0.0)] * top + [(-1.0, 2 * grid.picture[1])] * bottom
    images = np.array([*product(across, down)])
    return images[..., 0], images[..., 1]

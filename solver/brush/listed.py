"""Many brushes from a list in one draw: on a software rasteriser starting a draw costs more than a small draw."""

from __future__ import annotations

from typing import Any

import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.passes import Pass
from solver.gl.points import in_rows
from solver.grid import Grid

A_ROW = 128  # brushes in a row of the texture that lists them


def draw_listed(
    device: Device,
    shader: Pass,
    target: Field,
    grid: Grid,
    places: np.ndarray,
    radii: np.ndarray,
    vectors: np.ndarray,
    **inputs: Any,
) -> None:
    """Add what a shader with the vertices of `lib/listed.vert` draws of brushes to a target, in their order.

    Args:
        device: where they are drawn.
        shader: what they draw.
        target: nodes or cells of the grid.
        grid: whose corner places are counted from.
        places: their middles in the picture, (n, 2), longer sides.
        radii: how far they reach, (n,).
        vectors: what they do, (n, 2), lengths / s.
        inputs: what the shader reads besides.
    """
    texels = np.zeros((len(places), 2, 4))
    texels[:, 0] = np.column_stack([places - grid.origin, radii, np.zeros(len(places))])
    texels[:, 1, :2] = vectors
    brushes = device.upload(in_rows(texels, A_ROW).reshape(-1, 2 * A_ROW, 4), "brushes")
    inputs |= {"brushes": brushes, "spacing": grid.spacing, "texels": target.size}
    shader(target, add=True, triangles=(0, 6 * len(places)), **inputs)
    brushes.release()

"""Drawing at points out of a list instead of on a lattice."""

from __future__ import annotations

from typing import Any

import numpy as np

from solver.gl.device import Device

_ROW = 256  # points in a row of the texture that lists them


def draw_at(
    device: Device,
    points: np.ndarray,
    domain: tuple[float, float],
    shader: str,
    defines: dict[str, object] | None = None,
    components: int = 2,
    more: np.ndarray | None = None,
    **inputs: Any,
) -> np.ndarray:
    """What a shader that includes `lib/place.glsl` gives at points (n, 2), in longer sides: float32 (n, components).

    `more`: what it is told of each besides, as `u_more`, (n, 1-4).
    """
    lists = {"points": points / domain} | ({} if more is None else {"more": more})
    row = min(max(len(points), 1), _ROW)
    rows = max(1, -(-len(points) // row))
    listed = {}
    for name, values in lists.items():
        texels = np.zeros((rows * row, values.shape[1]), np.float32)
        texels[: len(values)] = values
        listed[name] = device.upload(texels.reshape(rows, row, -1), f"{name} of a list")
    found = device.field((row, rows), components, "found at points")
    device.pass_(shader, POINTS=1, **(defines or {}))(found, **listed, **inputs)
    values = found.get().reshape(-1, components)[: len(points)]
    for field in (*listed.values(), found):
        field.release()
    return values

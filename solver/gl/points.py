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
    **inputs: Any,
) -> np.ndarray:
    """What a shader that includes `lib/place.glsl` gives at points (n, 2), in longer sides: float32 (n, components)."""
    rows = max(1, -(-len(points) // _ROW))
    listed = np.zeros((rows * _ROW, 2), np.float32)
    listed[: len(points)] = points / domain
    places = device.upload(listed.reshape(rows, _ROW, 2), "points")
    found = device.field(places.size, components, "found at points")
    device.pass_(shader, POINTS=1, **(defines or {}))(found, points=places, **inputs)
    values = found.get().reshape(-1, components)[: len(points)]
    places.release()
    found.release()
    return values

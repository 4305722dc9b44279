"""Lists in textures, and drawing at the points of a list instead of on a lattice."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field

_ROW = 256  # points in a row of the texture that lists them


def in_rows(values: np.ndarray, length: int) -> np.ndarray:
    """A list (n, ...) in rows of a texture, (rows, length, ...) float32, filled up with zeros; one row at least."""
    rows = max(1, -(-len(values) // length))
    listed = np.zeros((rows * length, *values.shape[1:]), np.float32)
    listed[: len(values)] = values
    return listed.reshape(rows, length, *values.shape[1:])


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

    `more`: what it is told of each besides, (n, 4).
    """
    return drawn_at(device, points, domain, shader, defines, components, more, **inputs)()


def drawn_at(
    device: Device,
    points: np.ndarray,
    domain: tuple[float, float],
    shader: str,
    defines: dict[str, object] | None = None,
    components: int = 2,
    more: np.ndarray | None = None,
    **inputs: Any,
) -> Callable[[], np.ndarray]:
    """The same, drawn now and read back by what is returned, once: until then nothing waits for the GPU."""
    row = min(max(len(points), 1), _ROW)
    rows = in_rows(points / domain, row)
    size = row, len(rows)
    if more is not None:  # below the points, in one texture with them
        rows = np.concatenate([np.pad(rows, ((0, 0), (0, 0), (0, 2))), in_rows(more, row)])
    listed = device.upload(rows, "points of a list")
    found = Field(device, size, components, "found at points", cleared=False)
    device.pass_(shader, POINTS=1, **(defines or {}))(found, points=listed, **inputs)
    listed.release()

    def read() -> np.ndarray:
        values = found.get().reshape(-1, components)[: len(points)]
        found.release()
        return values

    return read

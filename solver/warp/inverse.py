"""The forward map: where every point of the original goes."""

from __future__ import annotations

from typing import Any

import numpy as np

from solver.gl.points import draw_at
from solver.limits import places
from solver.warp.map import WarpMap
from solver.warp.scaled import ScaledMap

MOST_ALONG = 1024  # texels along a side of the first guess


class ForwardMap:
    """The inverse of a warp map: y -> y + F(y) gives, for a point of the original, its place in the result.

    Found when asked for: the map's cells are drawn as triangles where they are looked up, which gives every point a
    start on the right branch however far it has been moved, and Newton's method does the rest. Where the map is folded
    one of the branches is taken; a point that is looked up nowhere, or where the map is wound up too far for these
    cells (solver/MEASURED.md), keeps the nearest place that was tried.
    """

    def __init__(self, warp: WarpMap | ScaledMap) -> None:
        self._warp = warp
        self._guess = warp.device.field(_bounded(warp.size), 2, "forward map, guess")
        self._guessed: object = None

    def read(self, size: tuple[int, int] | None = None) -> np.ndarray:
        """The displacement F at the pixel centres of a picture of `size`, by default the map's `coarse_size`.

        Returns:
            float32 (height, width, 2), longer sides.
        """
        size = self._warp.coarse_size if size is None else size
        field = self._warp.device.field(size, 2, "forward map, to read")
        invert = self._warp.device.pass_("warp/invert.frag")
        invert(field, **self._inputs(), origin=(0.0, 0.0), step=field.texel)
        displacement = field.get()
        field.release()
        return displacement

    def at(self, points: np.ndarray) -> np.ndarray:
        """The displacement F at points (n, 2) of the original, in longer sides: float32 (n, 2)."""
        return draw_at(self._warp.device, places(points), self._warp.extent, "warp/invert.frag", **self._inputs())

    def release(self) -> None:
        """Free the texture."""
        self._guess.release()

    def __enter__(self) -> ForwardMap:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    def _inputs(self) -> dict[str, Any]:
        warp = self._warp
        if self._guessed != warp.version:
            self._guess.clear()
            cells = (self._guess.width + 1) * (self._guess.height + 1)
            scatter = warp.device.pass_("warp/scatter.frag")
            scatter(
                self._guess, triangles=(0, 6 * cells), displacement=warp.composed(self._guess.size), extent=warp.extent
            )
            self._guessed = warp.version
        return {"displacement": warp.composed(exact=True), "guess": self._guess, "extent": warp.extent}


def _bounded(size: tuple[int, int]) -> tuple[int, int]:
    """A size divided by four, or by what brings it down to `MOST_ALONG`."""
    over = max(4.0, max(size) / MOST_ALONG)
    return max(8, round(size[0] / over)), max(8, round(size[1] / over))

"""What a map has done to what lies around some places, so that it can be told how much more it bears."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from solver.gl.field import Field, FieldPool
from solver.warp.map import WarpMap

PLACES = 256  # along the longer side of the picture where it is looked at: two a cell up to so many, or one a cell
RINGS = (1 / 64, 1 / 32, 1 / 16)  # radii of rings of `AROUND` places around a middle, likewise: what two handles that
AROUND = 16  # nearly meet lead apart is less than that far across
BLOCK = 64  # places along either side in which the part of it is reckoned that a window needs


class Strain:
    """Looks at a map: at places of a lattice over the picture, and on rings close to what is asked for."""

    def __init__(self, warp: WarpMap) -> None:
        self._warp, self._coarse = warp, warp.coarse_size
        self._fields = FieldPool(warp.device, "strain")

    def around(
        self, places: np.ndarray, radii: np.ndarray, expected: Field | None = None, coarsely: bool = False
    ) -> np.ndarray:
        """The least det J, largest stretch and least area between texels within a radius of each place (n, 2); and the
        least part of det J and of that area that is left of what is expected of both.

        The stretch is how many times farther apart in the original two neighbours of the lattice lie; the area,
        what becomes of that between four neighbouring texels, as a remap keeps what is at its texels only.
        `expected`: the logarithm of det J over the picture; by default it is 0. `coarsely`: on the lattice of the cells
        that the map had at first, also where it goes on in a window.

        Returns:
            float64 (n, 4).
        """
        return self.look(places, radii, expected, coarsely)()

    def look(
        self, places: np.ndarray, radii: np.ndarray, expected: Field | None = None, coarsely: bool = False
    ) -> Callable[[], np.ndarray]:
        """The same, by what is returned, called before the next look: until then nothing waits for the GPU."""
        cells = self._coarse if coarsely else self._warp.coarse_size
        on_lattice = self._on_lattice(places, radii, expected, np.array(cells))
        on_rings = self._on_rings(places, radii, expected)

        def around() -> np.ndarray:
            found = np.stack([on_lattice(), on_rings()])
            least, most = found.min(axis=0), found.max(axis=0)
            return np.stack([least[:, 0], most[:, 1], least[:, 2], least[:, 3]], axis=-1)

        return around

    def release(self) -> None:
        """Free the textures."""
        self._fields.release()

    def _on_lattice(
        self, places: np.ndarray, radii: np.ndarray, expected: Field | None, cells: np.ndarray
    ) -> Callable[[], np.ndarray]:
        warp, extent = self._warp, np.array(self._warp.extent)
        count = np.maximum(cells, np.minimum(2 * cells, PLACES * extent / extent.max())).astype(int)
        low = np.clip(np.floor((places - radii[:, None]) / extent * count), 0, count - 1)
        high = np.clip(np.ceil((places + radii[:, None]) / extent * count), low + 1, count)
        first, end = (np.maximum(low.min(axis=0) - 1, 0).astype(int), high.max(axis=0).astype(int))
        across, down = (int(side) for side in count)
        if warp.grid.is_whole:
            size, corner = (across, down), (0, 0)
        else:  # of a lattice as fine as in a window there is only so much as is looked at
            size, corner = tuple((-(-(end - first) // BLOCK) * BLOCK).tolist()), tuple(first.tolist())
        lattice = self._fields.get("lattice", size, 4)
        warp.draw_strain(lattice, (*(first - corner).tolist(), *(end - first).tolist()), corner, (across, down))
        boxes = self._fields.get("boxes", (1, len(places)), 4)
        boxes.set(np.concatenate([low, high], axis=-1)[:, None])

        def around() -> np.ndarray:
            found = self._fields.get("around", (size[1], len(places)), 4)
            region = 0, 0, int((high - low)[:, 1].max()), len(places)
            step, last = tuple(extent / count), tuple(extent - extent / warp.size)
            worst = warp.device.pass_("warp/strain_around.frag", **({} if expected is None else {"EXPECTED": 1}))
            given: dict[str, Any] = {} if expected is None else {"expected": expected}
            given |= {"corner": corner, "count": (across, down)}
            worst(found, region=region, strain=lattice, boxes=boxes, step=step, last=last, **given)
            rows = found.get(region).astype(np.float64)
            least, most = rows.min(axis=1), np.sqrt(rows[..., 1].max(axis=1))
            return np.stack([least[:, 0], most, least[:, 2], least[:, 3]], axis=-1)

        return around

    def _on_rings(self, places: np.ndarray, radii: np.ndarray, expected: Field | None) -> Callable[[], np.ndarray]:
        warp, angles = self._warp, 2 * np.pi * np.arange(AROUND + 1) / AROUND
        rings = np.array(RINGS)[:, None, None] * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        last = np.subtract(warp.extent, np.divide(warp.extent, warp.size))
        close = np.clip(places[:, None, None] + rings * radii[:, None, None, None], 0.0, last)
        read = warp.strain(close.reshape(-1, 2))

        def around() -> np.ndarray:
            found = read().astype(np.float64).reshape(*close.shape[:-1], 4)
            original, most = close + found[..., :2], np.zeros(len(places))
            for axis in (1, 2):
                before, after = (np.hypot(*np.moveaxis(np.diff(each, axis=axis), -1, 0)) for each in (original, close))
                ratio = np.where(after > 1e-6, before / np.maximum(after, 1e-6), 0.0)
                most = np.maximum(most, ratio.max(axis=(1, 2)))
            bent = found[..., 2:].min(axis=-1)
            if expected is not None:
                bent /= np.exp(between_texels(expected.get(), close / warp.extent))
            return np.stack([*found[..., 2:].min(axis=(1, 2)).T, most, bent.min(axis=(1, 2))], axis=-1)[:, [0, 2, 1, 3]]

        return around


def between_texels(values: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Values (h, w) at places (..., 2), 0-1 of either side, bilinear; beyond the outermost texels those."""
    last = np.array(values.shape[::-1]) - 1
    at = np.clip(places * (last + 1) - 0.5, 0.0, last)
    first = np.minimum(at.astype(int), np.maximum(last - 1, 0))
    (x, y), (fx, fy) = np.moveaxis(first, -1, 0), np.moveaxis(at - first, -1, 0)
    right, below = np.minimum(x + 1, last[0]), np.minimum(y + 1, last[1])
    upper, lower = ((1 - fx) * values[row, x] + fx * values[row, right] for row in (y, below))
    return (1 - fy) * upper + fy * lower

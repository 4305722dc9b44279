"""Looking pictures up through maps from elsewhere, which may be of any size, hold nothing in places, or be forward."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from app.media.displacement import Displacement, MapError, check_size, cropped, folds, is_beside
from app.media.numbered import is_sequence
from app.model.picture import opaque_value
from app.work.export import Target, looked_up, with_alpha
from app.work.layers import widened
from solver.gl.device import Device
from solver.gl.field import FieldError
from solver.grid import Grid
from solver.resample.plan import Edges, GivenMap, Quality, Sampling, SamplingError
from solver.resample.sampler import Sampler
from solver.warp.inverse import ForwardMap
from solver.warp.map import WarpMap

MOST_CELLS = 1024  # along the longer side, for turning a map round
REACH = 4  # pixels of a map that interpolation and the stretch reach beyond a place


class MapSampler:
    """Looks pictures up through given maps; keeps the last map on the GPU, as most stay for many frames.

    Attributes:
        how: the pictures are looked up.
    """

    def __init__(
        self, device: Device, edges: Edges, quality: Quality = "catmull-rom", premultiplied: bool = False
    ) -> None:
        self._device = device
        self.how = Sampling(quality, edges, premultiplied=premultiplied)
        self._sampler = Sampler(device)
        self._given: Displacement | None = None
        self._map: GivenMap | None = None
        self._outside: np.ndarray | None = None
        self._wide: tuple[Displacement, tuple[int, int, int, int], Displacement] | None = None
        self._folds: list[int] = []  # of the maps that fold over themselves, in how many pixels each
        self._beside = 0  # how many maps show nothing of the picture

    def __enter__(self) -> MapSampler:
        return self

    def __exit__(self, *exception: object) -> None:
        self._sampler.release()
        if self._map is not None:
            self._map.release()

    def warped(self, given: Displacement, pixels: np.ndarray, target: Target) -> np.ndarray:
        """Pixels (h, w, c) looked up through the map. Raises `MapError` where that cannot be."""
        try:
            if given is not self._given or self._map is None:
                self._take(given, pixels)
            assert self._map is not None
            found = looked_up(self._sampler, self._map, pixels, target)
        except (SamplingError, FieldError) as error:
            raise MapError(str(error)) from None
        return found if self._outside is None else emptied(found, self._outside, target.how.edges, target.alpha)

    def _take(self, given: Displacement, pixels: np.ndarray) -> None:
        check_size(given)
        if self._map is not None:
            self._map.release()
        inverse = inverted(self._device, given) if given.forward else given
        values = cropped(inverse.fitted(pixels.shape[1], pixels.shape[0])).values
        if folded := folds(values):
            self._folds.append(folded)
        if self.how.edges in ("transparent", "black"):
            self._beside += is_beside(values)
        outside = np.asarray(np.isnan(values).any(axis=2))
        self._outside = outside if outside.any() else None
        self._map, self._given = GivenMap(self._device, filled(values, outside)), given

    def widened(self, given: Displacement, margins: tuple[int, int, int, int]) -> Displacement:
        """A map with margins around it; the same again where both are the same."""
        if self._wide is None or self._wide[0] is not given or self._wide[1] != margins:
            self._wide = given, margins, Displacement(widened(given, margins))
        return self._wide[2]

    def notices(self, path: Path) -> list[str]:
        """What the user should hear of the maps of `path`."""
        said = []
        if self._beside:
            named = f"{self._beside} of the maps {path.name} look" if is_sequence(path) else f"{path.name} looks"
            said = [
                f"{named} up nothing inside of the picture, which is empty then; perhaps --kind or --grid is another"
            ]
        if not self._folds:
            return said
        if is_sequence(path):
            return [
                *said,
                f"folds in {len(self._folds)} of the maps {path.name}, the worst in {max(self._folds)} of its pixels",
            ]
        return [*said, f"{path.name} folds over itself in {self._folds[0]} of its pixels"]


def inverted(device: Device, given: Displacement) -> Displacement:
    """The map the other way round: where the points of the original go, if it told where they come from.

    Raises:
        MapError: if the map has holes, or is too small, too narrow or too large to be looked up.
    """
    check_size(given)
    values = cropped(given).values
    if np.isnan(values).any():
        raise MapError("it is NaN in places, and cannot be inverted; fill it first")
    width, height = given.width, given.height
    try:
        warp = WarpMap(device, Grid.for_picture(width, height, min(max(width, height), MOST_CELLS)), (width, height))
        try:
            warp.set(values)
            with ForwardMap(warp) as forward:
                found = forward.read((width, height))
        finally:
            warp.release()
    except ValueError as error:
        raise MapError(f"it cannot be inverted: {error}") from None
    return Displacement(found.astype(np.float32), 0, not given.forward)


def filled(values: np.ndarray, outside: np.ndarray) -> np.ndarray:
    """The values (h, w, 2) of a map, and where it is `outside` (h, w) those nearby, as far as a look-up reaches."""
    if not outside.any():
        return values
    values, empty = np.where(outside[..., None], 0, values), outside.copy()
    for _ in range(REACH):
        for axis, step in ((0, 1), (0, -1), (1, 1), (1, -1)):
            there = np.roll(~empty, step, axis)
            there[(slice(None),) * axis + (0 if step > 0 else -1,)] = False  # what was rolled round the edge
            there &= empty
            values[there] = np.roll(values, step, axis)[there]
            empty &= ~there
    return values


def emptied(pixels: np.ndarray, outside: np.ndarray, edges: Edges, alpha: bool) -> np.ndarray:
    """Pixels (h, w, c), nothing in those whose nearest one of the map is `outside` (h, w); `alpha` as in `Target`."""
    if alpha and edges != "black":
        pixels = with_alpha(pixels)
    (height, width), (rows, columns) = pixels.shape[:2], outside.shape
    row = (np.arange(height) * 2 + 1) * rows // (2 * height)
    column = (np.arange(width) * 2 + 1) * columns // (2 * width)
    here = outside[row[:, None], column]
    pixels[here] = 0
    if pixels.shape[2] in (2, 4) and edges == "black":
        pixels[here, -1] = opaque_value(pixels)
    return pixels

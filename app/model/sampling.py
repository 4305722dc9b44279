"""Pictures and shapes as numbers on the simulation's grid: intensities, segmentations, windows, all in [0, 1].

Everything is averaged over the cells (never point-sampled), so that grids of 256 and 512 see the same picture.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from itertools import product
from typing import Annotated, Literal, Protocol, Self

import numpy as np
from pydantic import Field, model_validator

from app.model.picture import Picture, linear_to_srgb
from app.model.schema import FileName, Fraction01, Model, Place
from solver.components import connected_components
from solver.grid import Grid

BLOCKS = 24  # into which the longer side of a canvas is cut where only what is near matters
PAIRS = 2**15  # of a cell and a line that are looked at in one go
SLACK = 1e-9  # longer sides, more than distances are rounded by
FINEST = 2048  # pixels along the longer side, at most, that masks are worked out on
ROWS_AT_ONCE = 64  # of a canvas
SOURCE = "source"
"""The name by which a recipe calls the picture that is warped, where it could name an auxiliary one."""

PictureName = FileName
Point = tuple[Place, Place]
"""x and y as fractions of the picture's width and height, from its top left corner."""
FrameNumber = Annotated[int, Field(ge=0, le=1_000_000)]
Box = tuple[Place, Place, Place, Place]
"""Left, top, right and bottom, as fractions of the picture's width and height."""


class NamedPictures(Protocol):
    """The picture that is warped and the others that a recipe names; `app.media.auxiliary.Pictures` reads them."""

    def load(self, name: str, frame: int = 0) -> Picture:
        """The picture called `name`; the one that is warped is called `SOURCE`, and may be a frame of a clip, of which
        0 is the first. Raises UserError.
        """
        ...

    def notice(self, text: str) -> None:
        """Note something the user should hear of, once."""
        ...


class SmallPictures:
    """The pictures of `full`, but those of more than `FINEST` pixels along a side made smaller, once."""

    def __init__(self, full: NamedPictures) -> None:
        self.full = full
        self.notice = full.notice
        self._made: dict[tuple[str, bool], tuple[Picture, Picture]] = {}

    def load(self, name: str, frame: int = 0) -> Picture:
        """The picture called `name`, in the means of squares of pixels where it is large. Raises UserError."""
        picture = self.full.load(name, frame)
        key = name, frame > 0  # of a clip's frames but the first only the last that was asked for is kept
        if key not in self._made or self._made[key][0] is not picture:
            self._made[key] = picture, _shrunk(picture, math.ceil(max(picture.width, picture.height) / FINEST))
        return self._made[key][1]


def _shrunk(picture: Picture, side: int) -> Picture:
    """A picture in the means of squares of `side` pixels; what is left at the right and below is left out."""
    if side == 1:
        return picture
    pixels, height, width = picture.pixels, picture.height // side, picture.width // side
    floats = picture.linear
    sums = np.zeros((height, width, pixels.shape[2]), np.float32 if floats else np.uint32)
    for row in range(side):
        for column in range(side):
            sums += pixels[row::side, column::side][:height, :width]
    means = sums / np.float32(side**2) if floats else (sums + side**2 // 2) // side**2
    return picture.with_pixels(means.astype(pixels.dtype))


# Pictures as numbers ------------------------------------------------------------------------------------------------


def channels(picture: Picture) -> tuple[np.ndarray, np.ndarray]:
    """Red, green and blue (h, w, 3) as the eye sees them (sRGB curve), and alpha (h, w), float32 in [0, 1]."""
    pixels = picture.straight().pixels
    if picture.linear:
        colours = linear_to_srgb(np.clip(np.nan_to_num(pixels), 0, 1)).astype(np.float32)
    else:
        colours = pixels.astype(np.float32) / np.iinfo(pixels.dtype).max
    if picture.has_alpha:
        # The curve does not hold for alpha; it never was in it.
        alpha = np.clip(pixels[..., -1], 0, 1) if picture.linear else colours[..., -1]
        colours = colours[..., :-1]
    else:
        alpha = np.ones(pixels.shape[:2], np.float32)
    return np.broadcast_to(colours, (*colours.shape[:2], 3)), alpha.astype(np.float32)


def intensity(picture: Picture) -> np.ndarray:
    """The grey of each pixel (h, w), float32 in [0, 1]; what is transparent is black. Rec. 709 luma."""
    colours, alpha = channels(picture)
    return colours @ np.array([0.2126, 0.7152, 0.0722], np.float32) * alpha


def alike(picture: Picture, colour: np.ndarray, tolerance: float) -> np.ndarray:
    """Which pixels (h, w) are within `tolerance` of a colour (3,), as the distance in RGB, and not mostly transparent.

    Of whole numbers the squares are looked up: there are fewer values than pixels.
    """
    if picture.linear:
        colours, alpha = channels(picture)
        return (np.linalg.norm(colours - colour, axis=-1) <= tolerance) & (alpha > 0.5)
    pixels = picture.straight().pixels
    most, last = np.iinfo(pixels.dtype).max, pixels.shape[2] - 1
    values = np.arange(most + 1, dtype=np.float32) / most
    colours = last if picture.has_alpha else last + 1  # 1 of a grey picture
    squares = sum(((values - own) ** 2)[pixels[..., k % colours]] for k, own in enumerate(colour))
    near = np.sqrt(squares) <= tolerance
    return near & (values > 0.5)[pixels[..., last]] if picture.has_alpha else near


def to_grid(values: np.ndarray, grid: Grid) -> np.ndarray:
    """Values of pixels (h, w) as averages over the cells (ny, nx), float32; the picture is fitted to the whole grid."""
    return _resized(_resized(values, grid.nx, 1), grid.ny, 0).astype(np.float32)


def workable(canvas: Grid) -> Grid:
    """A canvas, or above `FINEST` cells along its longer side the grid of about that many in its place."""
    if max(canvas.size) <= FINEST:
        return canvas
    return Grid(*Grid.for_picture(*canvas.size, FINEST).size, canvas.extent, canvas.origin, canvas.picture)


def strips(values: np.ndarray, grid: Grid) -> Iterator[tuple[slice, np.ndarray]]:
    """The rows of a grid a few at a time, each time with `values` (h, w) of no more cells interpolated to them.

    Rows in which all of them are 0 are left out.
    """
    values = values.astype(np.float32, copy=False)
    above, below, down = _between(len(values), grid.ny)
    left, right, across = _between(values.shape[1], grid.nx)
    down, across = down.astype(np.float32), across.astype(np.float32)
    for top in range(0, grid.ny, ROWS_AT_ONCE):
        here = slice(top, min(top + ROWS_AT_ONCE, grid.ny))
        part = down[here, None]
        tall = values[above[here]] * (1 - part) + values[below[here]] * part
        if tall.any():
            yield here, tall[:, left] * (1 - across) + tall[:, right] * across


def _between(m: int, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """For each of `n` cells between which two of `m` its middle lies, and what part it has of the second."""
    at = np.clip((np.arange(n) + 0.5) * m / n - 0.5, 0, m - 1)
    first = np.minimum(at.astype(int), max(m - 2, 0))
    return first, np.minimum(first + 1, m - 1), at - first


def pixel_at(place: Point, pixels: np.ndarray) -> tuple[int, int]:
    """The row and the column of the pixel at a place of a picture (h, w, ...)."""
    height, width = pixels.shape[:2]
    return min(int(place[1] * height), height - 1), min(int(place[0] * width), width - 1)


def connected(chosen: np.ndarray, place: tuple[int, int]) -> np.ndarray:
    """What of the pixels chosen, (h, w) bool, is connected by their sides with the one at a place (row, column).

    Raises:
        ValueError: if that is not chosen.
    """
    if not chosen[place]:
        raise ValueError("'at' names a place that is not chosen; name one that is")
    # The runs of each row are vertices, and those that touch in two rows are connected.
    run = np.cumsum(chosen & ~np.pad(chosen, ((0, 0), (1, 0)))[:, :-1]).reshape(chosen.shape)
    both = chosen[:-1] & chosen[1:]
    upper, lower = run[:-1][both], run[1:][both]
    new = np.diff(upper, prepend=-1).astype(bool) | np.diff(lower, prepend=-1).astype(bool)
    label = connected_components(np.arange(run[-1, -1] + 1), upper[new], lower[new])
    return chosen & (label[run] == label[run[place]])


def _resized(values: np.ndarray, n: int, axis: int) -> np.ndarray:
    """Values resampled to `n` along an axis: exact means over the new cells, or interpolated if there are more."""
    values = np.moveaxis(values, axis, 0)
    m = len(values)
    if n >= m:
        first, second, part = _between(m, n)
        part = part.reshape(-1, *(1,) * (values.ndim - 1))
        resized = values[first] * (1 - part) + values[second] * part
    else:
        # The integral up to each of the new edges, which may lie within a pixel.
        integral = np.cumsum(values, axis=0, dtype=np.float64)
        integral = np.concatenate([np.zeros_like(integral[:1]), integral])
        edges = np.arange(n + 1) * (m / n)
        k = np.minimum(edges.astype(int), m - 1)
        part = (edges - k).reshape(-1, *(1,) * (values.ndim - 1))
        resized = np.diff(integral[k] * (1 - part) + integral[k + 1] * part, axis=0) * (n / m)
    return np.moveaxis(resized, 0, axis)


def blurred(values: np.ndarray, radius: float, grid: Grid) -> np.ndarray:
    """(ny, nx) values blurred by a Gaussian of deviation `radius` / 2, longer sides, mirrored at the edges."""
    hx, hy = grid.spacing
    rows, columns = (_blur_matrix(n, radius / 2 / h) for n, h in zip(values.shape, (hy, hx), strict=True))
    return rows @ values @ columns.T


def _blur_matrix(n: int, sigma: float) -> np.ndarray:
    """(n, n), rows of sum 1: as dense matrices, blurs of any width cost the same, and little."""
    here = np.arange(n)[:, None]
    there = np.arange(-n, 2 * n)[None, :]
    weights = np.exp(-0.5 * ((there - here) / max(sigma, 1e-3)) ** 2)
    mirrored = weights[:, n : 2 * n] + weights[:, n - 1 :: -1] + weights[:, : 2 * n - 1 : -1]
    return mirrored / mirrored.sum(axis=1, keepdims=True)


def quantised(values: np.ndarray, levels: int) -> np.ndarray:
    """Values in [0, 1], of any shape, cut into `levels` equal steps, the lowest 0 and the highest 1."""
    return np.minimum(np.floor(values * levels), levels - 1) / (levels - 1)


# Shapes -------------------------------------------------------------------------------------------------------------


def smoothstep(values: np.ndarray) -> np.ndarray:
    """0 below 0, 1 above 1, 3 s^2 - 2 s^3 in between; of any shape."""
    s = np.clip(values, 0.0, 1.0)
    return s * s * (3 - 2 * s)


def falloff(q: np.ndarray, hardness: float = 0.0) -> np.ndarray:
    """A brush's weight at `q` radii, of any shape, from its path, as `shaders/lib/brush.glsl` draws it."""
    core = 0.9 * hardness
    w = 1.0 - np.clip((q - core) / (1.0 - core), 0.0, 1.0) ** 2
    return w**3


def places(points: Sequence[tuple[float, float]], grid: Grid) -> np.ndarray:
    """Fractions of width and height as lengths on the grid, (n, 2) float64."""
    return np.asarray(points, np.float64) * grid.extent


def distance_to_path(points: np.ndarray, grid: Grid, within: float = math.inf) -> np.ndarray:
    """Distance (ny, nx) of the cell centres from a polyline (n, 2), or from a single point; all in lengths.

    within: farther off, what is found may be too far.
    """
    x, y = grid.centres()
    nearest = np.full(x.shape, np.inf)
    ways = np.diff(points, axis=0) if len(points) > 1 else np.zeros((1, 2))
    lines = points[: len(ways)], ways, np.array([float(way @ way) for way in ways])
    side = -(-max(x.shape) // BLOCKS)
    for row, column in product(*(range(0, count, side) for count in x.shape)):
        block = slice(row, row + side), slice(column, column + side)
        x_here, y_here = x[block], y[block]
        middle_x, middle_y = x_here.mean(keepdims=True), y_here.mean(keepdims=True)
        reach = np.hypot(x_here - middle_x, y_here - middle_y).max()
        far = _from_lines(middle_x, middle_y, *lines)[0, 0]
        # Only these may be the nearest of any cell here: the others are farther off than one of them, wherever it lies.
        near = np.flatnonzero(far <= min(far.min() + 2 * reach, within + reach) + SLACK)
        several = max(PAIRS // x_here.size, 1)
        for first in range(0, len(near), several):
            found = _from_lines(x_here, y_here, *(part[near[first : first + several]] for part in lines)).min(axis=2)
            np.minimum(nearest[block], found, out=nearest[block])
    return nearest


def _from_lines(x: np.ndarray, y: np.ndarray, starts: np.ndarray, ways: np.ndarray, lengths2: np.ndarray) -> np.ndarray:
    """Distances (h, w, n) of places (h, w) from lines that begin at starts (n, 2) and go ways (n, 2), squared (n,)."""
    (along_x, along_y), x, y = ways.T, x[..., None] - starts[:, 0], y[..., None] - starts[:, 1]
    s = np.clip((x * along_x + y * along_y) / np.where(lengths2 > 0, lengths2, 1.0), 0, 1)
    return np.hypot(x - s * along_x, y - s * along_y)


class Window(Model):
    """A part of the picture: 1 inside, 0 outside, soft within the edge.

    Attributes:
        box: left, top, right, bottom, as fractions of the picture's width and height.
        shape: the rectangle itself or the ellipse in it.
        soft: how far inside the edge the weight has risen to 1, in longer sides; outside it is 0 in any case.
        invert: 1 outside and 0 inside.
    """

    box: Box
    shape: Literal["rectangle", "ellipse"] = "rectangle"
    soft: Annotated[float, Field(ge=0, le=10)] = 0.0
    invert: bool = False

    @model_validator(mode="after")
    def _has_area(self) -> Self:
        left, top, right, bottom = self.box
        if right <= left or bottom <= top:
            raise ValueError("'box' must be [left, top, right, bottom] with left < right and top < bottom")
        return self

    def weight(self, grid: Grid) -> np.ndarray:
        """The window on the cells, (ny, nx) float64 in [0, 1]."""
        (left, top), (right, bottom) = places((self.box[:2], self.box[2:]), grid)
        x, y = grid.centres()
        x, y = x - (left + right) / 2, y - (top + bottom) / 2
        a, b = (right - left) / 2, (bottom - top) / 2
        if self.shape == "rectangle":
            depth = np.minimum(a - np.abs(x), b - np.abs(y))
        else:
            # First order in the distance from the ellipse, as is enough for a soft edge.
            norm = np.hypot(x / a, y / b)
            slope = np.hypot(x / a**2, y / b**2)
            depth = np.where(norm > 0, (1 - norm) * norm / np.maximum(slope, 1e-12), min(a, b))
        # Without a soft edge, a cell that the edge cuts is in by the part of it that lies inside.
        weight = smoothstep(depth / self.soft) if self.soft > grid.h else np.clip(0.5 + depth / grid.h, 0.0, 1.0)
        return 1.0 - weight if self.invert else weight


class Segment(Model):
    """A segmentation of a picture: 1 in what is chosen, 0 elsewhere. One of the four choices, within the window.

    Attributes:
        above, below: intensity, 0-1; both together are a band.
        color: "#rrggbb"; pixels within `tolerance` of it, as the distance in RGB, each of 0-1.
        mask: a picture file, chosen where it is brighter than middle grey.
        at: only what is connected with this place, as fractions of the picture.
        frame: of a clip that is warped, the one it is chosen in; 0 is the first. A picture has no other.
        window: nothing outside it is chosen.
    """

    above: Fraction01 | None = None
    below: Fraction01 | None = None
    color: str | None = None
    tolerance: Annotated[float, Field(gt=0, le=2)] = 0.15
    mask: PictureName | None = None
    at: tuple[Fraction01, Fraction01] | None = None
    frame: FrameNumber = 0
    window: Window | None = None

    @model_validator(mode="after")
    def _one_choice(self) -> Self:
        given = [
            name
            for name, there in (
                ("above/below", self.above is not None or self.below is not None),
                ("color", self.color is not None),
                ("mask", self.mask is not None),
            )
            if there
        ]
        if len(given) != 1:
            here = " and ".join(given) or "none of them"
            raise ValueError(f"a segment chooses by 'above' and 'below', by 'color' or by 'mask'; here is {here}")
        if self.above is not None and self.below is not None and self.below <= self.above:
            raise ValueError(f"nothing lies above {self.above:g} and below {self.below:g}")
        if self.color is not None and not re.fullmatch(r"#[0-9a-fA-F]{6}", self.color):
            raise ValueError(f"'color' must be like \"#c8a040\", not {self.color!r}")
        return self

    def weight(self, picture: str, grid: Grid, pictures: NamedPictures) -> np.ndarray:
        """As `chosen`, (ny, nx), of what has an edge.

        Raises:
            ValueError: if it chooses nothing or everything.
        """
        chosen = self.chosen(picture, grid, pictures)
        if chosen.min() > 0.5:
            raise ValueError("the segmentation chooses the whole picture, so that it has no edge")
        return chosen

    def chosen(self, picture: str, grid: Grid, pictures: NamedPictures) -> np.ndarray:
        """How much of each cell (ny, nx) is chosen, in [0, 1].

        Raises:
            ValueError: if it chooses nothing.
        """
        chosen = to_grid(self._pixels(picture, pictures).astype(np.float32), grid).astype(np.float64)
        if self.window:
            chosen = chosen * self.window.weight(grid)
        if chosen.max() < 0.5:
            raise ValueError("the segmentation is empty; nothing in the picture is chosen by it")
        return chosen

    def _pixels(self, picture: str, pictures: NamedPictures) -> np.ndarray:
        pixels = self._alike(picture, pictures)
        if self.at is None:
            return pixels
        return connected(pixels, pixel_at(self.at, pixels))

    def _alike(self, picture: str, pictures: NamedPictures) -> np.ndarray:
        if self.mask is not None:
            return intensity(pictures.load(self.mask)) > 0.5
        if self.color is not None:
            wanted = np.array([int(self.color[k : k + 2], 16) / 255 for k in (1, 3, 5)], np.float32)
            return alike(pictures.load(picture, self.frame), wanted, self.tolerance)
        grey = intensity(pictures.load(picture, self.frame))
        low = -1.0 if self.above is None else self.above
        high = 2.0 if self.below is None else self.below
        return (grey > low) & (grey < high)

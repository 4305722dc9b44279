"""The viscosity mu(x) and the freeze mask of a recipe, from pictures, segmentations, windows and painted paths.

Each layer is an intensity in [0, 1] on the grid's cells, made into a viscosity or a choice of solid cells, and combined
with the layers before it (paper, section 4.2: "a normalization of the image values to [0,1] and global scaling
factor").

Viscosities that differ by powers of ten are mixed geometrically: a layer's `range` runs from its low to its high end in
equal factors, and soft windows and edges blend the logarithms. Halfway between 1e-5 and 1 is then 3e-3, not 0.5, which
would widen a stiff region by its whole soft edge. Where one of the two is 0 there is no logarithm, and they are mixed
linearly.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from app.errors import UserError
from app.model.sampling import (
    SOURCE,
    NamedPictures,
    PictureName,
    Point,
    Segment,
    Window,
    blurred,
    distance_to_path,
    falloff,
    intensity,
    places,
    quantised,
    to_grid,
    workable,
)
from app.model.schema import Fraction01, Model, Radius, Several, label_of
from solver.grid import Grid

MOST_VISCOUS = 1e6
MOST_POINTS = 20_000  # of a layer's path: each takes 35 microseconds and more
FINE = 1024  # cells along the longer side, at least, that a picture is quantised on
Viscosity = Annotated[float, Field(ge=0, le=MOST_VISCOUS)]


class _Layer(Model, ABC):
    """What all layers share.

    Attributes:
        name: what messages call it.
        window: the layer works only in it.
    """

    name: str = ""
    window: Window | None = None

    @abstractmethod
    def intensity(self, grid: Grid, pictures: NamedPictures) -> np.ndarray:
        """The layer on the cells, (ny, nx) float64 in [0, 1].

        Raises:
            ValueError: what is wrong with it on this picture.
        """

    def coverage(self, grid: Grid) -> np.ndarray:
        """How much it works in each cell, (ny, nx) in [0, 1]."""
        return self.window.weight(grid) if self.window else np.ones((grid.ny, grid.nx))


class _Constant(_Layer):
    """The same everywhere (in its window)."""

    kind: Literal["constant"]

    def intensity(self, grid: Grid, pictures: NamedPictures) -> np.ndarray:
        return np.ones((grid.ny, grid.nx))


class _PictureLayer(_Layer):
    """The intensity of a picture, 0 black and 1 white, or a segmentation of it.

    In this order: segmented, averaged over the cells, stretched, inverted, blurred, quantised.

    Attributes:
        picture: "source" or a file.
        segment: 1 in what it chooses and 0 elsewhere, instead of the intensity.
        stretch: the darkest cell is 0 and the brightest 1.
        invert: white is 0 and black is 1.
        blur: radius of the blur, in longer sides; 0 is none.
        levels: cut into so many equal steps (the paper's Figure 4).
    """

    kind: Literal["picture"]
    picture: PictureName = SOURCE
    segment: Segment | None = None
    stretch: bool = False
    invert: bool = False
    blur: Annotated[float, Field(ge=0, le=10)] = 0.0
    levels: Annotated[int, Field(ge=2, le=256)] | None = None

    def intensity(self, grid: Grid, pictures: NamedPictures) -> np.ndarray:
        if self.levels is None:
            return self._shades(grid, pictures)
        # The steps are cut on a fine grid and then averaged, or their edges would lie elsewhere on every grid.
        finer = math.ceil(FINE / max(grid.nx, grid.ny))
        steps = quantised(self._shades(grid.refined(finer), pictures), self.levels)
        return steps.reshape(grid.ny, finer, grid.nx, finer).mean(axis=(1, 3))

    def _shades(self, grid: Grid, pictures: NamedPictures) -> np.ndarray:
        if self.segment:
            values = self.segment.weight(self.picture, grid, pictures)
        else:
            values = to_grid(intensity(pictures.load(self.picture)), grid).astype(np.float64)
        if self.stretch:
            low, high = float(values.min()), float(values.max())
            if high - low < 1e-6:
                raise ValueError(f"{self.picture} is the same everywhere and cannot be stretched to [0, 1]")
            values = (values - low) / (high - low)
        if self.invert:
            values = 1.0 - values
        if self.blur > 0:
            values = blurred(values, self.blur, grid)
        return np.clip(values, 0.0, 1.0)


class _Path(_Layer):
    """Painted with a brush along points; the intensity is the brush's falloff.

    Attributes:
        points: of the brush's path; a single one is a dab.
        radius: of the brush, in longer sides.
        hardness: 0 is a soft falloff, 1 a hard edge, as of a stroke.
    """

    kind: Literal["path"]
    points: Annotated[Several[Point], Field(min_length=1)]
    radius: Radius = 0.08
    hardness: Fraction01 = 0.5

    @model_validator(mode="after")
    def _affordable(self) -> Self:
        if len(self.points) > MOST_POINTS:
            raise ValueError(f"its path has {len(self.points)} points; at most {MOST_POINTS} work")
        return self

    def intensity(self, grid: Grid, pictures: NamedPictures) -> np.ndarray:
        return falloff(distance_to_path(places(self.points, grid), grid, self.radius) / self.radius, self.hardness)


class _Thickness(Model):
    """How a layer's intensity becomes a viscosity, and how that meets the layers before.

    Attributes:
        scale: viscosity of intensity 1, and 0 that of intensity 0, in longer sides squared per second.
        range: [low, high], the viscosities of intensity 0 and 1, with equal factors in between; instead of `scale`.
        combine: the larger of both ("max"), their product ("multiply", the layer is then a plain factor), or this one
            ("replace").
    """

    scale: Viscosity | None = None
    range: tuple[Viscosity, Viscosity] | None = None
    combine: Literal["max", "multiply", "replace"] = "replace"

    @model_validator(mode="after")
    def _one_measure(self) -> Self:
        if (self.scale is None) == (self.range is None):
            raise ValueError("give either 'scale' (viscosity of white) or 'range' ([viscosity of black, of white])")
        if self.range and min(self.range) <= 0:
            raise ValueError("'range' must be above 0 at both ends; for a viscosity of 0 use 'scale'")
        return self

    def onto(self, below: np.ndarray, intensity: np.ndarray, coverage: np.ndarray) -> np.ndarray:
        """The viscosity with this layer on top of `below`, (ny, nx) float64."""
        if self.range:
            low, high = self.range
            layer = low ** (1 - intensity) * high**intensity
        else:
            assert self.scale is not None
            layer = self.scale * intensity
        if self.combine == "max":
            layer = np.maximum(below, layer)
        elif self.combine == "multiply":
            layer = below * layer
        return _mixed(below, layer, coverage)


class ConstantViscosity(_Constant, _Thickness):
    """One viscosity, `scale`, everywhere in the window."""


class PictureViscosity(_PictureLayer, _Thickness):
    """Viscosity from the intensity of a picture."""


class PathViscosity(_Path, _Thickness):
    """Viscosity painted along a path, blending into what is below with the brush's falloff."""

    def intensity(self, grid: Grid, pictures: NamedPictures) -> np.ndarray:
        return np.ones((grid.ny, grid.nx))

    def coverage(self, grid: Grid) -> np.ndarray:
        return super().coverage(grid) * _Path.intensity(self, grid, None)  # type: ignore[arg-type]


class _Choice(Model):
    """How a layer's intensity freezes cells.

    Attributes:
        threshold: cells of at least this intensity are chosen.
        combine: what is done with them: "add" freezes them, "remove" thaws them, "replace" freezes them and no others.
    """

    threshold: Annotated[float, Field(gt=0, le=1)] = 0.5
    combine: Literal["add", "remove", "replace"] = "add"

    def onto(self, below: np.ndarray, intensity: np.ndarray, coverage: np.ndarray) -> np.ndarray:
        """The frozen cells with this layer on top of `below`, (ny, nx) bool."""
        chosen = intensity * coverage >= self.threshold
        if self.combine == "replace":
            return chosen
        return below & ~chosen if self.combine == "remove" else below | chosen


class ConstantFreeze(_Constant, _Choice):
    """Everything in the window."""


class PictureFreeze(_PictureLayer, _Choice):
    """What is bright in a picture, or chosen by a segmentation of it."""


class PathFreeze(_Path, _Choice):
    """What is painted along a path."""


ViscosityLayer = Annotated[ConstantViscosity | PictureViscosity | PathViscosity, Field(discriminator="kind")]
FreezeLayer = Annotated[ConstantFreeze | PictureFreeze | PathFreeze, Field(discriminator="kind")]


def viscosity(layers: Sequence[ViscosityLayer], base: float, grid: Grid, pictures: NamedPictures) -> np.ndarray:
    """The viscosity of the cells, (ny, nx) float32: `base` with the layers on top, in order.

    Raises:
        UserError: naming the layer by its index and name, and what is wrong with it.
    """
    result = np.full((grid.ny, grid.nx), float(base))
    for number, layer in enumerate(layers, 1):
        try:
            result = layer.onto(result, layer.intensity(grid, pictures), layer.coverage(grid))
            if result.max() > MOST_VISCOUS:
                raise ValueError(f"the viscosity reaches {result.max():.3g}; the most is {MOST_VISCOUS:g}")
        except (ValueError, UserError) as error:
            raise UserError(f"{label_of('viscosity', number, layer.name)}: {error}") from None
    return result.astype(np.float32)


def solid(layers: Sequence[FreezeLayer], canvas: Grid, pictures: NamedPictures) -> np.ndarray:
    """What is frozen on a canvas, (ny, nx) bool: nothing, with the layers on top, in order.

    On a large canvas it is worked out on a `workable` one, and its edge interpolated.

    Raises:
        UserError: naming the layer by its index and name, and what is wrong with it.
    """
    grid = workable(canvas)
    result = np.zeros((grid.ny, grid.nx), bool)
    for number, layer in enumerate(layers, 1):
        try:
            result = layer.onto(result, layer.intensity(grid, pictures), layer.coverage(grid))
        except (ValueError, UserError) as error:
            raise UserError(f"{label_of('freeze', number, layer.name)}: {error}") from None
    return result if grid is canvas else to_grid(result.astype(np.float32), canvas) >= 0.5


def _mixed(below: np.ndarray, above: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """`above` where the weight is 1, `below` where it is 0; see the module."""
    both = (below > 0) & (above > 0)
    with np.errstate(over="ignore"):  # what is too thick is told where it is used
        ratio = np.where(both, above, 1.0) / np.where(both, below, 1.0)
        return np.where(both, below * ratio**weight, below + (above - below) * weight)

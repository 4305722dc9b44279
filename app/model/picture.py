"""A picture as a value: its pixels and what belongs to them, wherever they came from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Layer:
    """A channel of an EXR beside the colours of the picture: warped along with them, unless `exact` without mixing.

    Attributes:
        values: (h, w) float16, float32 or uint32, of the picture's size with its margins.
        exact: ids, depths and places, a mean of which is none.
        part: which of the file's parts it is in, from 0.
    """

    name: str
    values: np.ndarray
    exact: bool = False
    part: int = 0


@dataclass(frozen=True)
class Picture:
    """Pixels, top row first, with what belongs to them.

    Attributes:
        pixels: (h, w, c), c = 1 grey, 2 grey and alpha, 3 RGB, 4 RGBA; uint8 and uint16 hold the whole range in the
            transfer curve of `icc` (sRGB without one), float32 is linear light with white at 1.
        premultiplied: where there is alpha, the colours are multiplied by it, as the file has them. They stay so, since
            dividing rounds, and since the colour where alpha is 0 (a flame, a glow) would be lost.
        attributes: of an EXR's header by name, such as pixelAspectRatio.
        chunks: a PNG's, that say what its colours mean.
        layers: an EXR's further channels.
        parts: the attributes of each of an EXR's parts, the colours' own without those above.
        wide: the pixels with those that lie beyond the display window, where there are any.
        margins: how many more `wide` has on the left, at the top, on the right and at the bottom.
        origin: where an EXR's display window begins, x and y.
        group: part and layer of the colours, such as (0, "beauty.").
        half: their floats are of 16 bits.
        note: what of the file is lost, in a sentence that names it; "" if nothing.
    """

    pixels: np.ndarray
    icc: bytes | None = None
    exif: bytes | None = None
    xmp: bytes | None = None
    dpi: tuple[float, float] | None = None
    chromaticities: tuple[float, ...] | None = None
    texts: Mapping[str, str] = field(default_factory=dict)
    premultiplied: bool = False
    attributes: Mapping[str, Any] = field(default_factory=dict)
    chunks: Mapping[bytes, bytes] = field(default_factory=dict)
    layers: tuple[Layer, ...] = ()
    parts: tuple[Mapping[str, Any], ...] = ()
    group: tuple[int, str] = (0, "")
    half: bool = False
    wide: np.ndarray | None = None
    margins: tuple[int, int, int, int] = (0, 0, 0, 0)
    origin: tuple[int, int] = (0, 0)
    note: str = ""

    @property
    def width(self) -> int:
        return self.pixels.shape[1]

    @property
    def height(self) -> int:
        return self.pixels.shape[0]

    @property
    def bits(self) -> int:
        """Bits a channel: 8, 16 or 32."""
        return self.pixels.dtype.itemsize * 8

    @property
    def linear(self) -> bool:
        """Whether the values are linear light."""
        return self.pixels.dtype == np.float32

    @property
    def has_alpha(self) -> bool:
        return self.pixels.shape[2] in (2, 4)

    def with_pixels(self, pixels: np.ndarray) -> Picture:
        """The same picture with other pixels (h, w, c) of any size, and without layers and margins."""
        return replace(self, pixels=pixels, layers=(), wide=None, margins=(0, 0, 0, 0))

    def with_wide(self, wide: np.ndarray, layers: tuple[Layer, ...]) -> Picture:
        """The same picture with other pixels (h, w, c) and layers, both with its margins."""
        return replace(self, pixels=np.ascontiguousarray(wide[self._inside]), wide=wide, layers=layers)

    def cropped(self) -> Picture:
        """The same picture without margins."""
        layers = tuple(replace(layer, values=layer.values[self._inside]) for layer in self.layers)
        return replace(self, layers=layers, wide=None, margins=(0, 0, 0, 0))

    @property
    def _inside(self) -> tuple[slice, slice]:
        left, top, _, _ = self.margins
        return slice(top, top + self.height), slice(left, left + self.width)

    def stripped(self) -> Picture:
        """The same pixels without the metadata; what the colours mean is kept."""
        kept = {key: value for key, value in self.attributes.items() if key == "pixelAspectRatio"}
        texts = {key: text for key, text in self.texts.items() if key.startswith("cryptomatte/") and self.layers}
        return replace(self, exif=None, xmp=None, dpi=None, texts=texts, attributes=kept)

    def straight(self) -> Picture:
        """The same picture, its colours not multiplied by alpha."""
        if not self.premultiplied:
            return self
        pixels = unpremultiplied(self.pixels) if self.has_alpha else self.pixels
        return replace(self, pixels=pixels, premultiplied=False)


def srgb_to_linear(values: np.ndarray) -> np.ndarray:
    """Linear light of sRGB values 0-1 of any shape (IEC 61966-2-1)."""
    return np.where(values <= 0.04045, values / 12.92, ((np.maximum(values, 0.04045) + 0.055) / 1.055) ** 2.4)


def linear_to_srgb(values: np.ndarray) -> np.ndarray:
    """sRGB values 0-1 of linear light of any shape (IEC 61966-2-1)."""
    return np.where(values <= 0.0031308, values * 12.92, 1.055 * np.maximum(values, 0.0031308) ** (1 / 2.4) - 0.055)


def opaque_value(pixels: np.ndarray) -> int:
    """The alpha of a pixel that hides what is below it."""
    return 1 if pixels.dtype == np.float32 else np.iinfo(pixels.dtype).max


def unpremultiplied(pixels: np.ndarray) -> np.ndarray:
    """Pixels (h, w, 2 or 4) with straight alpha from premultiplied; colour where alpha is 0 is left as it is."""
    alpha = pixels[..., -1:].astype(np.float32)
    whole = opaque_value(pixels)
    with np.errstate(all="ignore"):  # what is infinite or NaN stays so
        scale = np.divide(whole, alpha, out=np.ones_like(alpha), where=alpha > 0)
        colours = pixels[..., :-1] * scale
    if pixels.dtype != np.float32:
        colours = np.clip(colours + 0.5, 0, whole)
    return np.concatenate([colours.astype(pixels.dtype), pixels[..., -1:]], axis=2)

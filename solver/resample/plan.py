"""What is to be looked up: one picture, through one map, at one size, and all that follows from these."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from numbers import Integral
from typing import Literal, get_args

import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field
from solver.warp.map import WarpMap
from solver.warp.scaled import ScaledMap

Quality = Literal["catmull-rom", "limited", "bilinear", "nearest"]
Edges = Literal["transparent", "black", "clamp", "mirror", "wrap"]

MOST_SAMPLES = 8
_TAPS = {"nearest": 1, "bilinear": 2, "limited": 4, "catmull-rom": 4}
REACH = 2  # pixels that the taps reach beyond a sample point
KINDS = {np.dtype(np.uint8): ("f1", 255.0), np.dtype(np.uint16): ("nu2", 65535.0), np.dtype(np.float32): ("f4", 0.0)}
TARGET_COMPONENTS = {1: 1, 2: 2, 3: 4, 4: 4}  # targets of three components are not promised by GL


class SamplingError(ValueError):
    """A picture or a map that cannot be looked up."""


@dataclass(frozen=True)
class Sampling:
    """How a picture is looked up.

    Attributes:
        quality: interpolation between pixels. "limited" is Catmull-Rom, kept for each colour, times alpha, within the
            range of the pixels that its sample points lie between: it does not ring, and is never below zero where
            they are not.
        edges: what lies beyond the picture. "transparent" is black where the picture has no alpha.
        samples: points looked up along a side of each pixel of the result, 1 or an even number; "auto" follows the
            stretch s of the map in that direction there: 2 clamp(ceil(0.75 s), 1, 4), 1 where it shifts or enlarges.
        linear_light: mix in linear light; uint8 and uint16 are taken as sRGB, float32 as linear already.
        dither: spread the rounding to 8 bits by a fixed pattern; by default where light is mixed.
        premultiplied: the colours are multiplied by alpha already, and stay so.

    Raises:
        SamplingError: for what is none of these.
    """

    quality: Quality = "catmull-rom"
    edges: Edges = "transparent"
    samples: int | Literal["auto"] = "auto"
    linear_light: bool = True
    dither: bool | None = None
    premultiplied: bool = False

    def __post_init__(self) -> None:
        for what, kinds in (("quality", get_args(Quality)), ("edges", get_args(Edges))):
            if getattr(self, what) not in kinds:
                raise SamplingError(f"{what} of {getattr(self, what)!r} were asked for, {', '.join(kinds)} there are")
        several = self.samples
        if several not in ("auto", 1) and not (isinstance(several, int) and several > 0 and several % 2 == 0):
            raise SamplingError(f"{several!r} samples were asked for; it must be auto, 1 or an even number")


class GivenMap:
    """A map made elsewhere, laid over the whole of any picture.

    Args:
        device: the device.
        displacement: (h, w, 2) from 6 x 6, in its own longer sides.

    Raises:
        SamplingError: on another shape.
        FieldError: on a value that is not finite.
    """

    version = 0

    def __init__(self, device: Device, displacement: np.ndarray) -> None:
        displacement = np.asarray(displacement)
        if displacement.ndim != 3 or displacement.shape[2] != 2 or min(displacement.shape[:2]) < 6:
            raise SamplingError(f"a map of shape {displacement.shape} was given, (h, w, 2) from 6 x 6 is wanted")
        height, width = displacement.shape[:2]
        self.device = device
        self.extent = width / max(width, height), height / max(width, height)
        self._field = device.upload(displacement, "given map", "f4")

    def composed(self) -> Field:
        """The displacement."""
        return self._field

    def release(self) -> None:
        """Free the texture."""
        self._field.release()


Map = WarpMap | ScaledMap | GivenMap


@dataclass(frozen=True)
class Plan:
    """One picture, one map and one size, with what follows from them; see `plan_for`."""

    displacement: Field
    held: Field | None
    extent: tuple[float, float]
    slack: float
    key: tuple[object, ...]
    picture: np.ndarray
    size: tuple[int, int]
    how: Sampling

    @property
    def source_size(self) -> tuple[int, int]:
        return self.picture.shape[1], self.picture.shape[0]

    @property
    def channels(self) -> int:
        return self.picture.shape[2]

    @property
    def has_alpha(self) -> bool:
        return self.channels in (2, 4)

    @property
    def is_premultiplied(self) -> bool:
        return self.has_alpha and self.how.premultiplied

    @property
    def is_curved(self) -> bool:
        """True if the values are sRGB and are to be mixed in linear light."""
        return self.how.linear_light and self.picture.dtype != np.float32

    @property
    def is_prepared(self) -> bool:
        return self.how.quality != "nearest" and (self.is_curved or self.has_alpha != self.is_premultiplied)

    @property
    def preparation(self) -> tuple[bool, bool, bool, bool]:
        """What the picture on the GPU depends on."""
        return self.is_prepared, self.is_curved, self.is_premultiplied, self.is_packed

    @cached_property
    def is_packed(self) -> bool:
        """True if a texel of what is prepared holds two neighbours in x, 16 bits a colour: enough for opaque bytes."""
        if not (self.is_prepared and self.is_curved and self.picture.dtype == np.uint8 and self.channels >= 3):
            return False
        if self.how.quality == "limited":  # which looks at each pixel by itself
            return False
        return self.channels == 3 or bool((self.picture[..., 3] == 255).all())

    @property
    def is_single(self) -> bool:
        return self.how.quality == "nearest" or self.how.samples == 1

    @property
    def is_paired(self) -> bool:
        """True if two neighbours in x are drawn at once, packed as two whole numbers of four bytes each."""
        return self.picture.dtype == np.uint8 and self.channels >= 3

    @property
    def zoom(self) -> tuple[float, float]:
        """Pixels of the picture to a pixel of the result."""
        return self.source_size[0] / self.size[0], self.source_size[1] / self.size[1]

    @property
    def longer(self) -> tuple[float, float]:
        """Pixels of the picture to a longer side; the map is laid over the whole of it."""
        return self.source_size[0] / self.extent[0], self.source_size[1] / self.extent[1]

    @property
    def is_repeated(self) -> bool:
        return self.how.edges in ("mirror", "wrap")

    @property
    def is_bounded(self) -> bool:
        """True if there is nothing beyond the picture."""
        return self.how.edges in ("transparent", "black")

    @property
    def middle(self) -> tuple[float, float]:
        """Middle of the picture, in pixels."""
        return 0.5 * self.source_size[0], 0.5 * self.source_size[1]

    @property
    def half(self) -> tuple[float, float]:
        """Half of the sides of the rectangle, in pixels, beyond which there is nothing."""
        # What is a part of a texel of the map outside is there because of the interpolation, not of the fluid.
        width, height = self.source_size
        return 0.5 * width + self.slack, 0.5 * height + self.slack

    @property
    def pairs(self) -> tuple[int, int]:
        """The fewest and the most pairs of samples along a side of a pixel, where one is not enough."""
        samples = self.how.samples
        return (1, MOST_SAMPLES // 2) if samples == "auto" else (samples // 2, samples // 2)

    def defines(self, whole: bool, samples: int, inside: bool, at_centres: bool) -> dict[str, object]:
        """Of `look_up.frag`, for blocks of one sample a pixel (0), four (1) or more (2), inside or not."""
        kind, levels = KINDS[self.picture.dtype]
        dither = self.is_curved if self.how.dither is None else self.how.dither
        flags = {
            "WHOLE": whole,
            "ZOOMED": self.zoom != (1.0, 1.0),
            "BOUNDED": self.is_bounded and not inside,
            "ONE": samples == 0,
            "AT_CENTRES": samples == 0 and at_centres,
            "PREPARED": self.is_prepared,
            "PACKED": self.is_packed,
            "LINEAR_LIGHT": self.is_curved and self.is_prepared,
            "CODES": levels > 0,  # of 8 or 16 bits, and so neither infinite nor NaN
            "LIMITED": self.how.quality == "limited",
            # What is limited may overshoot once it is divided by alpha.
            "CLAMPED": levels > 0 and self.how.quality in ("catmull-rom", "limited"),
            "DITHER": dither and kind == "f1" and self.how.quality != "nearest",
            "OPAQUE": not self.has_alpha,
            "PREMULTIPLIED": self.is_premultiplied,
            "GREY_ALPHA": self.channels == 2,
            "PAIRED": self.is_paired,
        }
        values: dict[str, object] = {name: 1 for name, wanted in flags.items() if wanted}
        least, most = self.pairs
        values |= {"TAPS": _TAPS[self.how.quality], "LEAST_PAIRS": least, "MOST_PAIRS": most if samples == 2 else 1}
        return values


def plan_for(warp: Map, picture: np.ndarray, size: tuple[int, int] | None, how: Sampling) -> Plan:
    """What follows from a map, a picture and how it is to be looked up; raises `SamplingError`."""
    if not isinstance(warp, Map) or not isinstance(picture, np.ndarray):
        given = f"a {type(picture).__name__} through a {type(warp).__name__}"
        raise SamplingError(f"{given} was to be looked up; an array through a WarpMap or a GivenMap is wanted")
    if picture.dtype not in KINDS or picture.ndim not in (2, 3) or picture.size == 0:
        raise SamplingError(f"a picture of shape {picture.shape} of {picture.dtype} cannot be looked up")
    shaped = picture.reshape(*picture.shape[:2], -1)
    if shaped.shape[2] > 4:
        raise SamplingError(f"a picture of {shaped.shape[2]} channels cannot be looked up, 1 to 4 can")
    size = size or (picture.shape[1], picture.shape[0])
    if np.shape(size) != (2,) or not all(isinstance(side, Integral) and side >= 1 for side in size):
        raise SamplingError(f"a result of {size!r} was asked for, (width, height) in whole pixels is wanted")
    if not isinstance(warp, GivenMap):
        field = warp.composed(warp.size_for((picture.shape[1], picture.shape[0]), size))
        held, slack = warp.held, 0.5 * picture.shape[1] / field.width
    else:
        field, held, slack = warp.composed(), None, 0.01
    return Plan(field, held, warp.extent, slack, (warp, warp.version), shaped, size, how)

"""Frames that are laid over one another, as those of an animated PNG or GIF."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from app.media.codecs.png import spread_key

NONE, BACKGROUND, PREVIOUS = range(3)  # what becomes of a frame when the next one comes
PNG_BITS = 24  # the place of the bits a channel in a PNG
AT_ONCE = 2**20  # pixels that are mixed: in floats they take many times the memory


@dataclass(frozen=True, slots=True)
class Frame:
    """A frame as the file has it.

    Attributes:
        x, y, width, height: its place.
        seconds: that it is shown.
        disposal: one of the three above.
        is_over: it is laid over what is there, and does not replace it.
        pieces: of a file, PNG or GIF, of it alone.
        is_opaque: nothing of it can be seen through, by the kind of its samples.
        pixels: of that file, which may reach beyond its place.
    """

    x: int
    y: int
    width: int
    height: int
    seconds: Fraction
    disposal: int
    is_over: bool
    pieces: tuple[bytes, ...]
    is_opaque: bool
    pixels: int

    @property
    def is_empty(self) -> bool:
        return not (self.width and self.height)

    def covers(self, other: Frame) -> bool:
        """Whether nothing of the other's place is beyond its own."""
        right, bottom = self.x + self.width, self.y + self.height
        beyond = other.x + other.width > right or other.y + other.height > bottom
        return not beyond and other.x >= self.x and other.y >= self.y

    @property
    def place(self) -> tuple[slice, slice]:
        return slice(self.y, self.y + self.height), slice(self.x, self.x + self.width)

    def place_in(self, other: Frame) -> tuple[slice, slice]:
        """Its place among the pixels of another that covers it."""
        x, y = self.x - other.x, self.y - other.y
        return slice(y, y + self.height), slice(x, x + self.width)


@dataclass(frozen=True)
class Animation:
    """The frames in a file, its width and height, and how often it is played, 0 for ever."""

    size: tuple[int, int]
    frames: Sequence[Frame]
    plays: int

    def has_alpha(self, most: int) -> bool:
        """Whether anything of any frame is seen through.

        Only frames that may show it are decoded: not those that lie over what is opaque. Of an animation of which that
        would be more than `most` pixels, it is believed that what can have alpha has it.
        """
        asked = list[tuple[Frame, tuple[slice, slice]]]()
        cleared: Frame | None = Frame(
            0, 0, *self.size, Fraction(0), BACKGROUND, False, (), False, 0
        )  # as all is at first
        for number, frame in enumerate(self.frames):
            if cleared is not None and not frame.covers(cleared):
                return True
            if not frame.is_opaque and not frame.is_over:
                asked.append((frame, (slice(None), slice(None))))
            elif not frame.is_opaque and cleared is not None:
                asked.append((frame, cleared.place_in(frame)))
            if frame.disposal == BACKGROUND or (frame.disposal == PREVIOUS and not number):
                cleared = None if frame.is_empty else frame
            elif frame.disposal == NONE:
                cleared = None
        for frame, part in asked:
            most -= frame.pixels
            if not frame.is_empty and (most < 0 or _is_seen_through(frame, part)):
                return True
        return False

    def shown(self) -> Iterator[np.ndarray]:
        """What is seen of each frame in turn, (h, w, 4) uint8; the array is drawn on for the next."""
        canvas = np.zeros((self.size[1], self.size[0], 4), np.uint8)
        for number, frame in enumerate(self.frames):
            place = canvas[frame.place]
            is_restored = frame.disposal == PREVIOUS and number > 0
            before = place.copy() if is_restored else None
            drawn = _decoded(frame)
            band = AT_ONCE // max(frame.width, 1) + 1
            for rows in (slice(row, row + band) for row in range(0, frame.height, band)):
                place[rows] = _over(drawn[rows], place[rows]) if frame.is_over else drawn[rows]
            del drawn
            yield canvas
            if before is not None:
                place[:] = before
            elif frame.disposal != NONE:
                place[:] = 0


def _decoded(frame: Frame) -> np.ndarray:
    """The pixels (h, w, 4) of a frame, in 8 bits."""
    if frame.is_empty:
        return np.zeros((frame.height, frame.width, 4), np.uint8)
    file = b"".join(frame.pieces)
    if _bits(file) == 16:
        deep = _deep(file)
        grey, alpha = deep.shape[2] < 3, deep.shape[2] in (2, 4)
        opaque = deep[..., -1:] if alpha else np.full_like(deep[..., :1], 255)
        return np.concatenate([deep[..., [0, 0, 0] if grey else [0, 1, 2]], opaque], axis=2)
    with _opened(file) as image:
        return np.asarray(image.convert("RGBA"))[: frame.height, : frame.width]


def _is_seen_through(frame: Frame, part: tuple[slice, slice]) -> bool:
    """Whether anything of a part of a frame's pixels is; nothing is made of them but this."""
    file = b"".join(frame.pieces)
    rows, columns = (range(length)[one] for length, one in zip((frame.height, frame.width), part, strict=True))
    if _bits(file) == 16:
        deep = _deep(file)
        return deep.shape[2] in (2, 4) and bool(deep[part][..., -1].min() < 255)
    with _opened(file) as image:
        image = image.crop((columns.start, rows.start, columns.stop, rows.stop))
        if image.mode == "P" and isinstance(key := image.info.get("transparency"), int):
            return image.histogram()[key] > 0
        if image.mode not in ("LA", "RGBA"):
            image = image.convert("RGBA")
        return image.getchannel("A").getextrema()[0] < 255


def _bits(file: bytes) -> int:
    return file[PNG_BITS] if file.startswith(b"\x89PNG") else 8


def _deep(file: bytes) -> np.ndarray:
    """The upper 8 of the 16 bits of a PNG, (h, w, channels)."""
    import imagecodecs

    deep: np.ndarray = imagecodecs.png_decode(file)
    return (deep[..., None] if deep.ndim == 2 else deep).astype("<u2", copy=False).view(np.uint8)[..., 1::2]


@contextmanager
def _opened(file: bytes) -> Iterator[Any]:
    from PIL import Image

    with Image.open(io.BytesIO(file), formats=["PNG", "GIF"]) as image:
        spread_key(image, _bits(file))
        yield image


def _over(drawn: np.ndarray, below: np.ndarray) -> np.ndarray:
    """Straight colours (h, w, 4) over others; what covers all or nothing changes no bit."""
    own = drawn[..., 3:].astype(np.float32) / 255
    rest = below[..., 3:].astype(np.float32) / 255 * (1 - own)
    alpha = own + rest
    colours = (drawn[..., :3] * own + below[..., :3] * rest) / np.where(alpha > 0, alpha, 1)
    mixed = (np.concatenate([colours, 255 * alpha], axis=2) + 0.5).astype(np.uint8)
    return np.where(drawn[..., 3:] == 255, drawn, np.where(drawn[..., 3:] == 0, below, mixed))

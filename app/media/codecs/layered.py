"""Frames that are laid over one another, as those of an animated PNG or GIF."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from app.media.codecs.png import spread_key

NONE, BACKGROUND, PREVIOUS = range(3)  # what becomes of a frame when the next one comes
PNG_BITS = 24  # the place of the bits a channel in a PNG
AT_ONCE = 2**20  # pixels that are mixed: in floats they take many times the memory


@dataclass(frozen=True)
class Frame:
    """A frame as the file has it.

    Attributes:
        x, y, width, height: its place.
        seconds: that it is shown.
        disposal: one of the three above.
        is_over: it is laid over what is there, and does not replace it.
        file: a PNG or GIF of it alone.
        is_opaque: nothing of it can be seen through, by the kind of its samples.
    """

    x: int
    y: int
    width: int
    height: int
    seconds: Fraction
    disposal: int
    is_over: bool
    file: bytes
    is_opaque: bool = False

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
        cleared: Frame | None = Frame(0, 0, *self.size, Fraction(0), BACKGROUND, False, b"")  # as all is at first
        for number, frame in enumerate(self.frames):
            if cleared is not None and not frame.covers(cleared):
                return True
            if not frame.is_opaque and not frame.is_over:
                asked.append((frame, (slice(None), slice(None))))
            elif not frame.is_opaque and cleared is not None:
                asked.append((frame, cleared.place_in(frame)))
            if frame.disposal == BACKGROUND or (frame.disposal == PREVIOUS and not number):
                cleared = frame
            elif frame.disposal == NONE:
                cleared = None
        for frame, part in asked:
            most -= frame.width * frame.height
            if most < 0 or _decoded(frame)[part][..., 3].min() < 255:
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
            band = max(1, AT_ONCE // frame.width)
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
    from PIL import Image

    bits = frame.file[PNG_BITS] if frame.file.startswith(b"\x89PNG") else 8
    if bits == 16:
        import imagecodecs

        deep = (imagecodecs.png_decode(frame.file) >> 8).astype(np.uint8)
        deep = deep.reshape(frame.height, frame.width, -1)
        grey, alpha = deep.shape[2] < 3, deep.shape[2] in (2, 4)
        opaque = deep[..., -1:] if alpha else np.full_like(deep[..., :1], 255)
        return np.concatenate([deep[..., [0, 0, 0] if grey else [0, 1, 2]], opaque], axis=2)
    with Image.open(io.BytesIO(frame.file), formats=["PNG", "GIF"]) as image:
        spread_key(image, bits)
        return np.asarray(image.convert("RGBA"))


def _over(drawn: np.ndarray, below: np.ndarray) -> np.ndarray:
    """Straight colours (h, w, 4) over others; what covers all or nothing changes no bit."""
    own = drawn[..., 3:].astype(np.float32) / 255
    rest = below[..., 3:].astype(np.float32) / 255 * (1 - own)
    alpha = own + rest
    colours = (drawn[..., :3] * own + below[..., :3] * rest) / np.where(alpha > 0, alpha, 1)
    mixed = (np.concatenate([colours, 255 * alpha], axis=2) + 0.5).astype(np.uint8)
    return np.where(drawn[..., 3:] == 255, drawn, np.where(drawn[..., 3:] == 0, below, mixed))

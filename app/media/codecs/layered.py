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


@dataclass(frozen=True)
class Frame:
    """A frame as the file has it.

    Attributes:
        x, y, width, height: its place.
        seconds: that it is shown.
        disposal: one of the three above.
        is_over: it is laid over what is there, and does not replace it.
        file: a PNG or GIF of it alone.
    """

    x: int
    y: int
    width: int
    height: int
    seconds: Fraction
    disposal: int
    is_over: bool
    file: bytes

    def covers(self, other: Frame) -> bool:
        """Whether nothing of the other's place is beyond its own."""
        right, bottom = self.x + self.width, self.y + self.height
        beyond = other.x + other.width > right or other.y + other.height > bottom
        return not beyond and other.x >= self.x and other.y >= self.y

    @property
    def place(self) -> tuple[slice, slice]:
        return slice(self.y, self.y + self.height), slice(self.x, self.x + self.width)


@dataclass(frozen=True)
class Animation:
    """The frames in a file, its width and height, and how often it is played, 0 for ever."""

    size: tuple[int, int]
    frames: Sequence[Frame]
    plays: int

    def has_alpha(self) -> bool:
        """Whether anything of any frame is seen through; only what a frame changes is looked at."""
        cleared = Frame(0, 0, *self.size, Fraction(0), BACKGROUND, False, b"")  # as all is at first
        found = False
        for number, (frame, canvas) in enumerate(zip(self.frames, self.shown(), strict=True)):
            is_bare = cleared is not None and not frame.covers(cleared)
            found = found or is_bare or bool(canvas[frame.place][..., 3].min() < 255)
            is_gone = frame.disposal == BACKGROUND or (frame.disposal == PREVIOUS and not number)
            cleared = frame if is_gone else None
        return found

    def shown(self) -> Iterator[np.ndarray]:
        """What is seen of each frame in turn, (h, w, 4) uint8; the array is drawn on for the next."""
        canvas = np.zeros((self.size[1], self.size[0], 4), np.uint8)
        for number, frame in enumerate(self.frames):
            before = canvas[frame.place].copy()
            drawn = _decoded(frame)
            canvas[frame.place] = _over(drawn, before) if frame.is_over else drawn
            yield canvas
            if frame.disposal == PREVIOUS and number:
                canvas[frame.place] = before
            elif frame.disposal != NONE:
                canvas[frame.place] = 0


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

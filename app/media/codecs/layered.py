"""Frames that are laid over one another, as those of an animated PNG, GIF or WebP."""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import islice
from typing import Any

import numpy as np

from app.media.codecs.decoding import quiet
from app.media.depth import rgba

NONE, BACKGROUND, PREVIOUS = range(3)  # what becomes of a frame when the next one comes
PNG, GIF = b"\x89PNG", b"GIF"  # the start of one
MOST_FRAMES = 100_000  # of an animation: at 30 a second nearly an hour
AT_ONCE = 2**20  # pixels that are mixed: in floats they take many times the memory


class TooManyFrames(ValueError):
    """An animation has more than `MOST_FRAMES`."""


@dataclass(frozen=True, slots=True)
class Frame:
    """A frame as the file has it.

    Attributes:
        x, y, width, height: its place.
        seconds: that it is shown.
        disposal: one of the three above.
        is_over: it is laid over what is there, and does not replace it.
        pieces: of a file, PNG, GIF or WebP, of it alone.
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

    def hides(self, size: tuple[int, int]) -> bool:
        """Whether nothing can be seen through, wherever in a picture of this size."""
        return self.is_opaque and (self.width, self.height) == size

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
        # All is, at first.
        cleared: Frame | None = Frame(0, 0, *self.size, Fraction(0), BACKGROUND, False, (), False, 0)
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
        asked = [(frame, part) for frame, part in asked if not frame.is_empty]
        if sum(frame.pixels for frame, _ in asked) > most:
            return True
        with quiet():
            return any(_is_seen_through(frame, part) for frame, part in asked)

    def shown(self) -> Iterator[np.ndarray]:
        """What is seen of each frame in turn, (h, w, 4) uint8; the array is drawn on for the next."""
        canvas = np.zeros((self.size[1], self.size[0], 4), np.uint8)
        for number, frame in enumerate(self.frames):
            place = canvas[frame.place]
            is_restored = frame.disposal == PREVIOUS and number > 0
            before = place.copy() if is_restored else None
            for rows, drawn in _decoded(frame):
                if frame.is_over and not frame.is_opaque:
                    _lay_over(drawn, place[rows])
                else:
                    place[rows] = drawn
            yield canvas
            if before is not None:
                place[:] = before
            elif frame.disposal != NONE:
                place[:] = 0


def bounded(frames: Iterable[Frame]) -> list[Frame]:
    """The frames as they come. Raises `TooManyFrames`."""
    found = list(islice(frames, MOST_FRAMES + 1))
    if len(found) > MOST_FRAMES:
        raise TooManyFrames
    return found


def _decoded(frame: Frame) -> Iterator[tuple[slice, np.ndarray]]:
    """The pixels (h, w, 4) of a frame in 8 bits, some rows after others: all at once take as much memory once more."""
    if frame.is_empty:
        return
    band = AT_ONCE // frame.width + 1
    file = b"".join(frame.pieces)
    image = _image(file) if file.startswith(GIF) else None
    samples = _samples(file) if image is None else np.empty(0)
    for rows in (slice(row, min(row + band, frame.height)) for row in range(0, frame.height, band)):
        if image is None:
            yield rows, rgba(samples[rows])
        else:
            yield rows, np.asarray(image.crop((0, rows.start, frame.width, rows.stop)).convert("RGBA"))


def _is_seen_through(frame: Frame, part: tuple[slice, slice]) -> bool:
    """Whether anything of a part of a frame's pixels is; nothing is made of them but this."""
    file = b"".join(frame.pieces)
    if not file.startswith(GIF):
        samples = _samples(file)
        return samples.shape[2] in (2, 4) and bool(samples[part][..., -1].min() < 255)
    rows, columns = (range(length)[one] for length, one in zip((frame.height, frame.width), part, strict=True))
    image = _image(file).crop((columns.start, rows.start, columns.stop, rows.stop))
    if image.mode == "P" and isinstance(key := image.info.get("transparency"), int):
        return image.histogram()[key] > 0
    return image.convert("RGBA").getchannel("A").getextrema()[0] < 255


def _image(file: bytes) -> Any:
    """Pillow's image of a GIF, which has a byte a pixel."""
    from PIL import Image

    return Image.open(io.BytesIO(file), formats=["GIF"])


def _samples(file: bytes) -> np.ndarray:
    """The samples of a PNG or WebP, (h, w, channels), of 16 bits the upper 8, of few bits or a palette spread."""
    import imagecodecs

    decode = imagecodecs.png_decode if file.startswith(PNG) else imagecodecs.webp_decode
    with quiet():
        samples: np.ndarray = decode(file)
    samples = samples[..., None] if samples.ndim == 2 else samples
    return samples if samples.dtype == np.uint8 else samples.astype("<u2", copy=False).view(np.uint8)[..., 1::2]


def _lay_over(drawn: np.ndarray, below: np.ndarray) -> None:
    """Lay straight colours (h, w, 4) over others; what covers all or nothing changes no bit."""
    alpha = drawn[..., 3]
    np.copyto(below, drawn, where=(alpha == 255)[..., None])
    partly = (alpha > 0) & (alpha < 255)
    if partly.any():
        below[partly] = _mixed(drawn[partly], below[partly])


def _mixed(drawn: np.ndarray, below: np.ndarray) -> np.ndarray:
    """What is seen of straight colours (n, 4) over others."""
    own = drawn[:, 3:].astype(np.float32) / 255
    rest = below[:, 3:].astype(np.float32) / 255 * (1 - own)
    alpha = own + rest
    colours = (drawn[:, :3] * own + below[:, :3] * rest) / alpha
    return (np.concatenate([colours, 255 * alpha], axis=1) + 0.5).astype(np.uint8)

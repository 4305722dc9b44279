"""The frames of an animated PNG, laid over one another as PNG (third edition, 12.11 to 12.13) says.

Pillow pastes frames: where one is half transparent the result is too, on whatever it lies.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from app.media.codecs.png import spread_key

SIGNATURE = 8
NONE, BACKGROUND, PREVIOUS = range(3)  # what becomes of a frame when the next one comes
KEPT = (b"PLTE", b"tRNS")
HUNDREDTHS = 100  # of a second are the steps of a frame that names none


@dataclass(frozen=True)
class Frame:
    """A frame as the file has it.

    Attributes:
        x, y, width, height: its place.
        seconds: that it is shown.
        disposal: one of the three above.
        is_over: it is laid over what is there, and does not replace it.
        file: a PNG of it alone.
    """

    x: int
    y: int
    width: int
    height: int
    seconds: Fraction
    disposal: int
    is_over: bool
    file: bytes

    @property
    def place(self) -> tuple[slice, slice]:
        return slice(self.y, self.y + self.height), slice(self.x, self.x + self.width)


@dataclass(frozen=True)
class Animation:
    """The frames in a file, its width and height, and how often it is played, 0 for ever."""

    size: tuple[int, int]
    frames: Sequence[Frame]
    plays: int

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


def read(file: Path) -> Animation | None:
    """What is in a file; None if it is no animation. Raises `ValueError` if it is damaged."""
    data = file.read_bytes()
    head, told, kept, frames, control, pieces = b"", (0, 0), [], [], None, list[bytes]()
    for kind, body in _chunks(data):
        match kind:
            case b"IHDR":
                head = body
            case b"acTL":
                told = struct.unpack_from(">II", body)
            case b"fcTL":
                if control is not None:
                    frames.append(_frame(control, head, kept, pieces))
                control, pieces = body, []
            case b"IDAT" if control is not None:
                pieces.append(body)
            case b"fdAT":
                pieces.append(body[4:])
            case _ if kind in KEPT:
                kept.append((kind, body))
    if control is not None:
        frames.append(_frame(control, head, kept, pieces))
    if told[0] < 2 and len(frames) < 2:
        return None
    if len(frames) < told[0]:
        raise ValueError(f"it has {len(frames)} of its {told[0]} frames")
    return Animation(struct.unpack_from(">II", head), frames[: told[0]], told[1])


def _chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    at = SIGNATURE
    while at + 8 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        body, check = data[at + 8 : at + 8 + length], data[at + 8 + length : at + 12 + length]
        if len(check) < 4 or struct.unpack(">I", check)[0] != zlib.crc32(body, zlib.crc32(kind)):
            raise ValueError(f"its chunk {kind.decode('latin-1')} is damaged")
        if kind == b"IEND":
            return
        yield kind, body
        at += 12 + length


def _frame(control: bytes, head: bytes, kept: Sequence[tuple[bytes, bytes]], pieces: Sequence[bytes]) -> Frame:
    """A frame of what its control chunk, the file's header and its data say. Raises `ValueError`."""
    if len(control) < 26 or len(head) < 13 or not pieces:
        raise ValueError("a frame of it is cut")
    width, height, x, y, above, below, disposal, blend = struct.unpack_from(">IIIIHHBB", control, 4)
    most = struct.unpack_from(">II", head)
    if not (0 < width <= most[0] - x and 0 < height <= most[1] - y):
        raise ValueError("a frame of it reaches beyond the picture")
    chunks = [(b"IHDR", struct.pack(">II", width, height) + head[8:]), *kept]
    chunks += [*((b"IDAT", piece) for piece in pieces), (b"IEND", b"")]
    file = b"".join(
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(body, zlib.crc32(kind)))
        for kind, body in chunks
    )
    seconds = Fraction(above, below or HUNDREDTHS)
    return Frame(x, y, width, height, seconds, disposal, blend == 1, b"\x89PNG\r\n\x1a\n" + file)


def _decoded(frame: Frame) -> np.ndarray:
    """The pixels (h, w, 4) of a frame, in 8 bits."""
    from PIL import Image

    bits = frame.file[SIGNATURE + 16]
    if bits == 16:
        import imagecodecs

        deep = (imagecodecs.png_decode(frame.file) >> 8).astype(np.uint8)
        deep = deep.reshape(frame.height, frame.width, -1)
        grey, alpha = deep.shape[2] < 3, deep.shape[2] in (2, 4)
        opaque = deep[..., -1:] if alpha else np.full_like(deep[..., :1], 255)
        return np.concatenate([deep[..., [0, 0, 0] if grey else [0, 1, 2]], opaque], axis=2)
    with Image.open(io.BytesIO(frame.file), formats=["PNG"]) as image:
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

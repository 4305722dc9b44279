"""WebP: 8 bits of RGB, lossless at quality 100; and the frames of an animation, laid over one another as by browsers.

What no frame covers, or one clears, is transparent. Pillow makes it black where the file does not tell of alpha.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from fractions import Fraction
from itertools import islice
from pathlib import Path

from app.media.codecs import pillow
from app.media.codecs.layered import BACKGROUND, NONE, Animation, Frame, bounded
from app.model.picture import Picture

HEAD = 12  # bytes of the header of the file; each chunk has one of 8
FRAME = 16  # bytes of the header of a frame
HAS_ALPHA = 0x10  # in the flags of the file
CLEARED, REPLACES = 1, 2  # in the flags of a frame


def read(file: Path, max_pixels: int) -> Picture:
    """The first frame of a WebP."""
    with pillow.opened("WEBP", file, max_pixels) as image:
        found = frames(file.read_bytes(), 1) if image.is_animated and image.mode == "RGB" else None
        is_opaque = found is None or found.frames[0].hides(image.size)
        return pillow.picture_of(image, file, [], None if found is None or is_opaque else next(found.shown()))


def frames(data: bytes, most: int | None = None) -> Animation | None:
    """What is in a file, of its frames the first `most`; None if it is no animation.

    Raises `ValueError` if it is damaged, and `TooManyFrames`.
    """
    size, plays = None, 1
    for kind, body in _chunks(data, HEAD):
        if kind == b"VP8X" and len(body) >= 10:
            size = _u24(body, 4) + 1, _u24(body, 7) + 1
        elif kind == b"ANIM" and len(body) >= 6:
            (plays,) = struct.unpack_from("<H", body, 4)
        elif kind == b"ANMF":
            break
    if size is None:
        return None
    found = bounded(islice((_frame(body, size) for kind, body in _chunks(data, HEAD) if kind == b"ANMF"), most))
    return Animation(size, found, plays) if found else None


def _u24(data: bytes, at: int) -> int:
    return int.from_bytes(data[at : at + 3], "little")


def _chunks(data: bytes, at: int) -> Iterator[tuple[bytes, bytes]]:
    while at + 8 <= len(data):
        kind, length = struct.unpack_from("<4sI", data, at)
        yield kind, data[at + 8 : at + 8 + length]
        at += 8 + length + length % 2


def _frame(body: bytes, most: tuple[int, int]) -> Frame:
    """A frame of what its chunk says, in a file of so many pixels. Raises `ValueError`."""
    if len(body) < FRAME:
        raise ValueError("a frame of it is cut")
    x, y, width, height, lasts = (_u24(body, at) for at in range(0, 15, 3))
    x, y, width, height, flags = 2 * x, 2 * y, width + 1, height + 1, body[15]
    if x + width > most[0] or y + height > most[1]:
        raise ValueError("a frame of it reaches beyond the picture")
    parts = {kind: part for kind, part in _chunks(body, FRAME) if kind in (b"ALPH", b"VP8 ", b"VP8L")}
    if (lossless := parts.get(b"VP8L")) is not None:
        head = int.from_bytes(lossless[1:5].ljust(4, b"\0"), "little")
        parts, told, has_alpha = {b"VP8L": lossless}, (head % 2**14 + 1, (head >> 14) % 2**14 + 1), bool(head >> 28 & 1)
    else:
        told, has_alpha = struct.unpack("<HH", parts.get(b"VP8 ", b"")[6:10].ljust(4, b"\0")), b"ALPH" in parts
        told = told[0] % 2**14, told[1] % 2**14
    if told != (width, height):
        raise ValueError("a frame of it is not as large as it says")
    if b"ALPH" in parts:
        parts = {b"VP8X": struct.pack("<I", HAS_ALPHA) + body[6:12], **parts}
    chunks = [piece for kind, part in parts.items() for piece in (_head(kind, part), part, b"\0" * (len(part) % 2))]
    head = b"RIFF" + struct.pack("<I", 4 + sum(map(len, chunks))) + b"WEBP"
    disposal, is_over = BACKGROUND if flags & CLEARED else NONE, not flags & REPLACES
    seconds = Fraction(lasts, 1000)
    return Frame(x, y, width, height, seconds, disposal, is_over, (head, *chunks), not has_alpha, width * height)


def _head(kind: bytes, body: bytes) -> bytes:
    return kind + struct.pack("<I", len(body))


def write(path: Path, picture: Picture, quality: int) -> None:
    """Write a WebP, with the colours of what is transparent."""
    pillow.write("WEBP", path, picture, quality, lossless=quality == 100, exact=True)

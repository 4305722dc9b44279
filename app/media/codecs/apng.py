"""The frames of an animated PNG, laid over one another as PNG (third edition, 12.11 to 12.13) says.

Pillow pastes frames: where one is half transparent the result is too, on whatever it lies.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Sequence
from fractions import Fraction

from app.media.codecs.layered import MOST_FRAMES, Animation, Frame, TooManyFrames
from app.media.losses import few

SIGNATURE = 8
KEPT = (b"PLTE", b"tRNS")
ALPHA = 4  # in the kind of samples that the header tells
HUNDREDTHS = 100  # of a second are the steps of a frame that names none


def read(data: bytes) -> Animation | None:
    """What is in a file; None if it is no animation. Raises `ValueError` if it is damaged, and `TooManyFrames`."""
    head, told, kept, frames, control, pieces = b"", (0, 0), [], [], None, list[bytes]()
    for kind, body in _chunks(data):
        match kind:
            case b"IHDR":
                head = body
            case b"acTL" if not told[0]:  # a second one tells nothing
                told = struct.unpack_from(">II", body)
            case b"fcTL":
                if control is not None:
                    frames.append(_frame(control, head, kept, pieces))
                    if len(frames) == MOST_FRAMES:
                        raise TooManyFrames
                control, pieces = body, []
            case b"IDAT" if not told[0]:  # frames are told of before the picture (5.6), or it is a still
                return None
            case b"IDAT" if control is not None:
                pieces.append(body)
            case b"fdAT":
                pieces.append(body[4:])
            case _ if kind in KEPT:
                kept.append((kind, body))
    if control is not None:
        frames.append(_frame(control, head, kept, pieces))
    if told[0] < 2:  # whatever frames it has: without being told of two, browsers show a still
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
            raise ValueError(f"its chunk {few([kind.decode('latin-1')])} is damaged")
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
    file = [b"\x89PNG\r\n\x1a\n"]
    for kind, body in chunks:
        file += struct.pack(">I", len(body)) + kind, body, struct.pack(">I", zlib.crc32(body, zlib.crc32(kind)))
    seconds = Fraction(above, below or HUNDREDTHS)
    is_opaque = not head[9] & ALPHA and all(kind != b"tRNS" for kind, _ in kept)
    return Frame(x, y, width, height, seconds, disposal, blend == 1, tuple(file), is_opaque, width * height)

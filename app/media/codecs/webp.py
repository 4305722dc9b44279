"""WebP: 8 bits of RGB, lossless at quality 100."""

from __future__ import annotations

import struct
from functools import partial
from pathlib import Path

from app.media.codecs import pillow
from app.model.picture import Picture

HEAD = 12  # bytes of the header of the file; each chunk has one of 8
DURATION = slice(12, 15)  # of an ANMF chunk: milliseconds

read = partial(pillow.read, "WEBP")


def durations(data: bytes) -> list[int]:
    """The milliseconds of each frame of an animation."""
    found, at = list[int](), HEAD
    while at + 8 <= len(data):
        kind, length = struct.unpack_from("<4sI", data, at)
        if kind == b"ANMF":
            found.append(int.from_bytes(data[at + 8 : at + 8 + length][DURATION], "little"))
        at += 8 + length + length % 2
    return found


def write(path: Path, picture: Picture, quality: int) -> None:
    """Write a WebP, with the colours of what is transparent."""
    pillow.write("WEBP", path, picture, quality, lossless=quality == 100, exact=True)

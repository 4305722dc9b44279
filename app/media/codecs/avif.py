"""AVIF: 8 bits out, and in 10 and 12 as well, which become 16."""

from __future__ import annotations

import re
import struct
from dataclasses import replace
from pathlib import Path

from app.errors import UserError
from app.media.codecs import pillow
from app.media.codecs.decoding import quiet, start_of
from app.media.codecs.png import coded
from app.media.depth import spread
from app.media.losses import unusual_colours
from app.model.picture import Picture


def read(file: Path, max_pixels: int) -> Picture:
    """Read an AVIF in its depth."""
    with pillow.opened("AVIF", file, max_pixels) as image:
        codes = None if image.info.get("icc_profile") else re.search(rb"colrnclx(....)", start_of(file), re.DOTALL)
        primaries, transfer = struct.unpack(">HH", codes[1]) if codes else (1, 13)
        colours = unusual_colours(primaries, transfer)
        losses = [f"its colours are {colours} (nclx) and are treated as sRGB"] if colours else []
        pixels = None
        if (deep := _bits(file)) > 8:
            import imagecodecs

            with quiet():  # Pillow gives 8 bits of these without a word
                pixels = spread(imagecodecs.avif_decode(file.read_bytes()), deep, 16)
        picture = pillow.picture_of(image, file, losses, pixels)
        return replace(picture, chunks=coded(primaries, transfer)) if colours else picture


def _bits(file: Path) -> int:
    """Bits a channel, from the flags of the first AV1 configuration (AV1 in ISOBMFF, 2.3.3)."""
    start = start_of(file)
    at = start.find(b"av1C")
    flags = start[at + 6] if 0 <= at < len(start) - 6 else 0
    return 8 if not flags & 0x40 else 12 if flags & 0x20 else 10


def write(path: Path, picture: Picture, quality: int) -> None:
    """Write an AVIF, its colours in full resolution. Raises `UserError` where Pillow cannot."""
    from PIL import features

    if not features.check("avif"):
        raise UserError("This Pillow was built without AVIF; use another format or install Pillow from PyPI.")
    pillow.write("AVIF", path, picture, quality, subsampling="4:4:4")

"""Reading and writing pictures, each in its own depth, through the table of formats."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from app.errors import UserError
from app.media.codecs.decoding import decoding, head_of
from app.media.codecs.metadata import printed_at
from app.media.depth import over, to_bits
from app.media.files import replacing
from app.media.formats import TABLE, check_picture_output, fits_profile, kind_of, picture_format, written_depth
from app.media.inputs import MAX_PIXELS
from app.model.picture import Picture


def read_picture(path: str | os.PathLike[str], max_pixels: int = MAX_PIXELS) -> Picture:
    """Read a picture in its own depth, upright, its first page or frame; palette and CMYK become RGB.

    The content decides the format, not the ending. Raises `UserError` for what is no picture, damaged or larger than
    `max_pixels`.
    """
    file = Path(path)
    kind = kind_of(file, head_of(file))
    if kind is None:
        known = ", ".join(kind.name for kind in TABLE)
        raise UserError(f"Cannot read {file}: it is not a picture of a known kind ({known}); convert it to one.")
    with decoding(file, kind.name):
        return kind.read(file, max_pixels)


def write_picture(
    path: str | os.PathLike[str],
    picture: Picture,
    *,
    bits: int | None = None,
    quality: int = 95,
    strip: bool = False,
    background: tuple[int, int, int] = (0, 0, 0),
    codec: str | None = None,
    dpi: float | None = None,
    whole: Callable[[Path], None] = lambda file: None,
) -> None:
    """Write a picture in the format of the ending of `path`, whole or not at all.

    bits: 8, 16 or 32 a channel; None keeps the picture's own, or the deepest below it that the format has. An EXR's 16
        are half floats; None keeps those of a picture that had them, and makes 32 of all else.
    quality: 1-100 for JPEG, WebP and AVIF; WebP is lossless at 100.
    strip: leave out EXIF, XMP, resolution and texts; the colour profile stays.
    codec: the compression of an EXR; None is zip.
    dpi: dots per inch along both sides; None keeps the picture's own, which may be none.
    background: what shows through where the format has no alpha.
    whole: see `replacing`.
    Raises `UserError`.
    """
    check_picture_output(path, bits, (picture.width, picture.height), codec)
    chosen = picture_format(path)
    if strip:
        picture = picture.stripped()
    if dpi is not None:
        picture = printed_at(picture, dpi)
    depth, half = written_depth(chosen, picture, bits)
    if "half" in chosen.keeps:
        picture = replace(picture, half=half)
    if depth != picture.bits or "premultiplied" not in chosen.keeps:
        picture = picture.straight()
    picture = replace(picture, pixels=to_bits(picture.pixels, depth))
    if picture.has_alpha and not chosen.alpha:
        picture = replace(picture, pixels=over(picture.pixels, background))
    if not fits_profile(picture, chosen):
        picture = replace(picture, icc=None)
    assert chosen.write is not None
    with replacing(path, whole=whole) as temporary:
        chosen.write(temporary, picture, quality, **({} if codec is None else {"codec": codec}))

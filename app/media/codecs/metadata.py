"""What belongs to a picture besides its pixels, made true of the upright picture in its present size."""

from __future__ import annotations

import io
import re
from collections.abc import Collection
from dataclasses import replace
from typing import Any

import numpy as np

from app.model.picture import Picture

ORIENTATION, EXIF_IFD, GPS_IFD, INTEROPERABILITY = 0x0112, 0x8769, 0x8825, 0xA005
# More dots an inch no fraction of EXIF and TIFF tells, and OpenEXR has no pixel that is longer in comparison.
MOST_DOTS, NARROWEST = 2.0**31, 1e6
INCHES = {2: 1.0, 3: 2.54}  # dots an inch for one in each of the units that are lengths
RESOLUTION = {0x011A: 0, 0x011B: 0, 0x0128: 2}  # EXIF's codes of x, y and their unit; 2 is an inch


# What is told elsewhere in a file, or by every EXIF of itself: orientation, resolution, how colours are laid out, its
# version, components, colour space, size, and where further directories are (CIPA DC-008, 4.6).
FORMAL = {*RESOLUTION, ORIENTATION, 0x0213, 0x0214, EXIF_IFD, GPS_IFD, INTEROPERABILITY}
FORMAL_INSIDE = {0x9000, 0x9101, 0xA000, 0xA001, 0xA002, 0xA003, INTEROPERABILITY}


def first_names(encoded: bytes | None, but: Collection[int] = ()) -> list[str]:
    """What the tags of EXIF's first directory are called, without those that say nothing of a picture's own."""
    from PIL import ExifTags, Image

    exif = Image.Exif()
    exif.load(encoded or b"")
    return [ExifTags.TAGS.get(code, f"{code:#06x}") for code in exif if code not in FORMAL and code not in but]


def tag_names(encoded: bytes | None) -> list[str]:
    """What all tags of EXIF are called, without those that say nothing of a picture's own."""
    from PIL import ExifTags, Image

    if not encoded:
        return []
    exif = Image.Exif()
    exif.load(encoded)
    inner = [ExifTags.TAGS.get(code, f"{code:#06x}") for code in exif.get_ifd(EXIF_IFD) if code not in FORMAL_INSIDE]
    return first_names(encoded) + inner + ["GPSInfo"] * bool(exif.get_ifd(GPS_IFD))


def upright_dpi(dpi: Any, orientation: int) -> tuple[float, float] | None:
    """Pixels an inch along x and y of the upright picture, if they are told, and so that every kind of file can."""
    if not dpi or len(dpi) != 2 or not all(1 / MOST_DOTS < float(value) < MOST_DOTS for value in dpi):
        return None
    x, y = float(dpi[0]), float(dpi[1])
    if not 1 / NARROWEST < y / x < NARROWEST:
        return None
    return (y, x) if orientation in (5, 6, 7, 8) else (x, y)


def told_dpi(exif: Any) -> tuple[float, float] | None:
    """Dots an inch along x and y that Pillow's `exif` tells, if it does; perhaps damaged ones."""
    try:
        unit = INCHES[exif.get(0x0128, 2)]
        return float(exif[0x011A]) * unit, float(exif[0x011B]) * unit
    except (KeyError, TypeError, ValueError, OverflowError):
        return None


def upright(pixels: np.ndarray, orientation: int) -> np.ndarray:
    """Pixels (h, w, ...) turned and mirrored as EXIF's orientation 1-8 says (CIPA DC-008, 4.6.4)."""
    if orientation in (5, 6, 7, 8):
        pixels = pixels.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return np.ascontiguousarray(pixels)


def upright_exif(exif: Any) -> bytes | None:
    """Pillow's `exif` as bytes, its orientation undone; the thumbnail, stale after a warp, falls away."""
    if not exif:
        return None
    if ORIENTATION in exif:
        x, y, _ = RESOLUTION
        if exif[ORIENTATION] in (5, 6, 7, 8) and x in exif and y in exif:
            exif[x], exif[y] = exif[y], exif[x]
        exif[ORIENTATION] = 1
    try:
        return exif.tobytes()
    except Exception:  # a camera's damaged EXIF must not cost the picture
        return None


def upright_xmp(xmp: bytes | None) -> bytes | None:
    """XMP with its orientation undone."""
    if xmp is None:
        return None
    return re.sub(rb"(tiff:Orientation(?:=\"|>))[0-9]", rb"\g<1>1", xmp)


def exif_of(picture: Picture) -> Any:
    """Pillow's EXIF of a picture, telling its present size."""
    from PIL import Image

    exif = Image.Exif()
    if picture.exif:
        exif.load(picture.exif)
        inner = exif.get_ifd(EXIF_IFD)
        for code, size in ((0xA002, picture.width), (0xA003, picture.height)):
            if code in inner:
                inner[code] = size
    return exif


def printed_at(picture: Picture, dpi: float) -> Picture:
    """The picture at so many dots per inch, also where its EXIF tells another number."""
    from PIL import Image

    encoded = picture.exif
    if encoded:
        exif = Image.Exif()
        exif.load(encoded)
        if exif.keys() & RESOLUTION.keys():
            exif.update({code: value or dpi for code, value in RESOLUTION.items()})
            encoded = exif.tobytes()
    return replace(picture, dpi=(dpi, dpi), exif=encoded)


def sized_exif(picture: Picture, with_dpi: bool = False) -> bytes:
    """The picture's EXIF, telling its present size, and its resolution if that has no other place in a file."""
    exif, dpi = exif_of(picture), picture.dpi if with_dpi else None
    if dpi and told_dpi(exif) != dpi:
        exif.update(dict(zip(RESOLUTION, (*dpi, 2), strict=True)))
    return exif.tobytes() if picture.exif or dpi else b""


def profile_name(icc: bytes) -> str:
    """What an ICC profile calls itself; "" if it is damaged."""
    from PIL import ImageCms

    try:
        return ImageCms.getProfileDescription(ImageCms.ImageCmsProfile(io.BytesIO(icc))).strip() or "unnamed"
    except (ImageCms.PyCMSError, OSError):
        return ""

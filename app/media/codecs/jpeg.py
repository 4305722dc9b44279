"""JPEG: 8 bits of grey or RGB, and of its texts one comment."""

from __future__ import annotations

import re
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

from app.errors import UserError
from app.media.codecs import pillow
from app.media.codecs.metadata import sized_exif, tag_names, told_dpi
from app.media.losses import not_kept
from app.model.picture import Picture

START_OF_SCAN, END, COMMENT = 0xDA, 0xD9, 0xFE
COMMENT_NAME = "Comment"
APPLICATION = range(0xE0, 0xF0)
FRAMES = {*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC}  # which begin with their bits; the others are tables
LOSSLESS = (0xC3, 0xC7, 0xCB, 0xCF)
MARKER = re.compile(rb"\xff[^\x00\xff\xd0-\xd7]")  # in a scan: neither a stuffed byte nor a restart
# Of JFIF (ITU T.871, 10.1): where its unit is in a file, the units, dots an inch for one of each, and the most dots.
UNIT_AT, INCH, CENTIMETRE, MOST_DOTS = 13, 1, 2, 0xFFFF
INCHES = {INCH: 1.0, CENTIMETRE: 2.54}
IPTC = b"8BIM\x04\x04"  # of Photoshop's resources the one that holds it
MOST_BYTES = 0xFFFF - 2  # of a segment
XMP_MARK = b"http://ns.adobe.com/xap/1.0/\0"
# What is kept, of the encoding or a thumbnail, or told as further pictures.
UNDERSTOOD = ("JFIF", "JFXX", "Exif", "http://ns.adobe.com/xap/1.0/", "ICC_PROFILE", "MPF", "Adobe", "Ducky")


def read(file: Path, max_pixels: int) -> Picture:
    """Read a JPEG, the first of its pictures."""
    if (said := _beyond(file.read_bytes())) is not None:
        raise UserError(f"Cannot read {file}: a JPEG {said} is not supported; convert it to a PNG or TIFF of 16 bits.")
    with pillow.opened("JPEG", file, max_pixels) as image:
        losses = _losses(file.read_bytes(), getattr(image, "n_frames", 1) > 1)
        x, y = image.info.get("jfif_density", (1, 1))  # without a unit only the shape of a pixel
        if image.info.get("jfif_unit") == 0 and x != y and x and y and told_dpi(image.getexif()) is None:
            losses.append(f"the shape of its pixels ({y}:{x}) is not kept")
        return pillow.picture_of(image, file, losses)


def _beyond(data: bytes) -> str | None:
    """What its frame is that is coded as no decoder at hand reads (ITU T.81, B.2.2); None for what is usual."""
    at = 2
    while found := MARKER.search(data, at):
        kind, body = data[found.start() + 1], found.end() + 2
        if kind in FRAMES:
            bits = data[body] if body < len(data) else 8
            return "without loss" if kind in LOSSLESS else f"of {bits} bits a channel" if bits != 8 else None
        if kind in (START_OF_SCAN, END) or body > len(data):
            return None
        at = body - 2 + struct.unpack_from(">H", data, found.end())[0]
    return None


def _losses(data: bytes, is_many: bool) -> list[str]:
    """What the segments of a JPEG hold, or follows its end, that is not kept (ITU T.81, B.1.1)."""
    at, comments, unknown, end = 2, 0, dict[str, None](), len(data)
    while (found := MARKER.search(data, at)) and (kind := data[found.start() + 1]) != END:
        if found.end() + 2 > len(data):
            break
        body = found.end() + 2
        at = body - 2 + struct.unpack_from(">H", data, found.end())[0]
        comments += kind == COMMENT
        if kind in APPLICATION:
            name = data[body : min(at, body + 40)].partition(b"\0")[0].decode("latin-1")
            if name.startswith("Photoshop") and IPTC in data[body:at]:
                name += " (IPTC)"
            if name not in UNDERSTOOD:
                unknown[f"APP{kind - APPLICATION.start} {name}"] = None
    else:
        end = found.end() if found else end
    losses = [not_kept("segment", list(unknown))] if unknown else []
    losses += [f"of its {comments} comments only the last is kept"] if comments > 1 else []
    if data[end:].strip(b"\0\xff\r\n") and not is_many:  # what pads a file is nothing
        losses.append(f"the {len(data) - end} bytes after its end are not kept")
    return losses


def write(path: Path, picture: Picture, quality: int) -> None:
    """Write a JPEG, its colours in full resolution."""
    # Not optimized: that gains a few per cent, holds the file in memory once more, and fails where noise makes the
    # file larger than the buffer Pillow guesses.
    picture = replace(
        picture,
        exif=None if unheld_exif(picture) else picture.exif,
        xmp=None if unheld_xmp(picture) else picture.xmp,
    )
    comment = "" if COMMENT_NAME in unheld_texts(picture) else picture.texts.get(COMMENT_NAME, "")
    options: dict[str, Any] = {"subsampling": 0, "comment": comment}
    unit = 0
    if picture.dpi:
        unit, *options["dpi"] = _density(picture.dpi)
    pillow.write("JPEG", path, picture, quality, **options)
    if unit == CENTIMETRE:  # Pillow writes dots an inch only
        with path.open("r+b") as file:
            file.seek(UNIT_AT)
            file.write(bytes([unit]))


def unheld_exif(picture: Picture) -> list[str]:
    """The names of all tags if they are more than a segment has room for."""
    return tag_names(picture.exif) if len(sized_exif(picture)) > MOST_BYTES else []


def unheld_xmp(picture: Picture) -> list[str]:
    """As `unheld_exif`."""
    return ["XMP"] if picture.xmp and len(XMP_MARK + picture.xmp) > MOST_BYTES else []


def unheld_texts(picture: Picture) -> list[str]:
    """The names of all texts but a comment that a segment has room for."""
    comment = picture.texts.get(COMMENT_NAME, "")
    held = COMMENT_NAME if len(comment.encode()) <= MOST_BYTES else None
    return [name for name in picture.texts if name != held]


def held_dpi(dpi: tuple[float, float]) -> tuple[float, float]:
    """Dots an inch along x and y as a JPEG tells them that is written of a picture with so many."""
    unit, x, y = _density(dpi)
    return x * INCHES[unit], y * INCHES[unit]


def _density(dpi: tuple[float, float]) -> tuple[int, int, int]:
    """The unit of JFIF, and whole dots of it along x and y: dots an inch, or a centimetre where that is nearer."""

    def nearest(unit: int) -> tuple[float, tuple[int, int, int]]:
        x, y = (min(max(round(value / INCHES[unit]), 1), MOST_DOTS) for value in dpi)
        off = max(abs(x * INCHES[unit] - dpi[0]), abs(y * INCHES[unit] - dpi[1]))
        return round(off, 6), (unit, x, y)

    return min(nearest(INCH), nearest(CENTIMETRE))[1]

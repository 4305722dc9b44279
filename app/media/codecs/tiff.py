"""TIFF of any kind that is a picture."""

from __future__ import annotations

import logging
import math
import os
import re
import struct
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from app.errors import UserError
from app.media.codecs import ZLIB_LEVEL
from app.media.codecs.cmyk import cmyk_to_rgb
from app.media.codecs.metadata import (
    EXIF_IFD,
    GPS_IFD,
    INCHES,
    ORIENTATION,
    exif_of,
    first_names,
    upright,
    upright_dpi,
    upright_exif,
    upright_xmp,
)
from app.media.depth import spread
from app.media.inputs import check_size
from app.media.losses import lost, not_kept
from app.model.picture import Picture

DESCRIPTION = 0x010E
BIG, LONG, LONG8 = 43, 4, 16  # the mark of a BigTIFF, and types of numbers
# Document, description, make, model, page, software, date, artist, host, copyright: what of a TIFF's first directory is
# not about its layout.
TEXTS = (0x010D, DESCRIPTION, 0x010F, 0x0110, 0x011D, 0x0131, 0x0132, 0x013B, 0x013C, 0x8298)
# What says how the samples are stored, has a place of its own in a picture, or is of smaller versions of it.
UNDERSTOOD = {
    *range(254, 267), 273, 274, *range(277, 285), *range(288, 294), 296, 297, 317, *range(320, 326), 330,
    *range(332, 335), *range(336, 348), *range(512, 522), *range(529, 533), 559, 700, 34675, EXIF_IFD, GPS_IFD, *TEXTS,
    50674,
}  # fmt: skip
DECODED = {6, 7, 33007, 34892}  # ways of JPEG, of which tifffile makes RGB
COLOURS = {"MINISBLACK": 1, "MINISWHITE": 1, "PALETTE": 1, "SEPARATED": 4}
# Descriptions in which tifffile, ImageJ and OME keep the shape, which readers believe and a result would belie.
LAYOUT = re.compile(r'\s*\{"shape": ?\[|ImageJ=|.{0,400}<OME[\s>]', re.DOTALL)


@contextmanager
def opened(file: Path) -> Iterator[Any]:
    """tifffile's object of a TIFF, whose pages are found one after the other."""
    import tifffile

    tifffile.logger().setLevel(logging.CRITICAL)  # what it says of damaged files, it raises too
    with tifffile.TiffFile(file) as tiff:
        yield tiff


def pages_of(file: Path) -> list[int]:
    """Which of a TIFF's pages are pictures: neither smaller versions nor masks."""
    with opened(file) as tiff:
        return [place for place, page in enumerate(_pages(tiff)) if not page.subfiletype & 5]


def _pages(tiff: Any) -> Iterator[Any]:
    """A TIFF's pages, each once: tifffile follows them without end where one names an earlier one as the next."""
    seen: set[int] = set()
    for page in tiff.pages:
        if page.offset in seen:
            return
        seen.add(page.offset)
        yield page


def head(file: Path, max_pixels: int) -> tuple[int, int, str]:
    """The width and height of a TIFF's first page once it is upright, and its description."""
    with opened(file) as tiff:
        page: Any = tiff.pages[0]
        size = page.imagewidth, page.imagelength
        check_size(file, *size, max_pixels, page.samplesperpixel)
        orientation = page.tags.get(ORIENTATION)
        if orientation is not None and int(orientation.value) in range(5, 9):
            size = size[::-1]
        return *size, page.description


def read(file: Path, max_pixels: int) -> Picture:
    """Read the first page of a TIFF; what is lost of the others is told."""
    with opened(file) as tiff:
        return page_of(tiff, file, max_pixels)


def page_of(tiff: Any, file: Path, max_pixels: int, place: int | None = None) -> Picture:
    """A page of an open TIFF; where none is asked for the first, and what is lost of the others is told."""
    import tifffile

    page: Any = tiff.pages[place or 0]
    check_size(file, page.imagewidth, page.imagelength, max_pixels, page.samplesperpixel)
    tags = {tag.code: tag.value for tag in page.tags}
    samples = [axis for axis in page.axes if axis in "YXS"]
    if "".join(sorted(samples)) not in ("XY", "SXY") or page.axes.strip("YXS"):
        raise UserError(f"Cannot read {file}: a TIFF of axes {page.axes} is not a picture; save one page of it.")
    pieces = math.prod(page.chunked)
    if not page.is_contiguous and len(page.dataoffsets) < pieces:  # tifffile fills what is missing with zeros
        raise ValueError(f"it has {len(page.dataoffsets)} of its {pieces} strips or tiles")
    photometric = tifffile.PHOTOMETRIC(page.photometric).name
    if photometric == "YCBCR" and int(page.compression) not in DECODED:
        raise UserError(f"Cannot read {file}: a TIFF in YCbCr is not supported but as JPEG; convert it to RGB.")
    told = page.bitspersample
    bits = told if isinstance(told, int) else 0
    if not bits or 16 < bits < 32:  # of which tifffile does not heed the order of bytes
        named = str(told).strip("()")
        raise UserError(f"Cannot read {file}: {named} bits a channel of a TIFF are not supported; convert it to 16.")
    losses = _losses(tiff) if place is None else []
    if unkept := [tag.name for tag in page.tags if tag.code not in UNDERSTOOD]:
        losses.append(not_kept("tag", unkept))
    pixels = page.asarray()
    losses += _cut(pixels, bits)
    place_of_tags, layout = page.offset, (tiff.byteorder, tiff.is_bigtiff)
    is_half = pixels.dtype == np.float16
    pixels = np.moveaxis(pixels, 0, -1) if page.axes == "SYX" else pixels.reshape(*pixels.shape[:2], -1)
    pixels = plain_depth(file, pixels, bits if photometric != "PALETTE" else None)
    icc = tags.get(34675)
    colours = COLOURS.get(photometric, 3)
    used = colours + bool(page.extrasamples and photometric not in ("PALETTE", "SEPARATED"))
    if pixels.shape[2] > used:  # further samples are masks and spot colours
        losses.append(f"of its {pixels.shape[2]} samples a pixel only the first {used} are used")
        pixels = pixels[..., :used]
    kinds = page.extrasamples[: pixels.shape[2] - colours]
    premultiplied = tuple(kinds) == (tifffile.EXTRASAMPLE.ASSOCALPHA,)
    if tuple(kinds) == (tifffile.EXTRASAMPLE.UNSPECIFIED,):
        losses.append(f"its sample {used} is of no kind that it names, and is taken for alpha")
    if photometric == "PALETTE":
        pixels = _palette(tags[320])[pixels[..., 0] if bits > 1 else pixels[..., 0] >> 7]
    elif photometric == "SEPARATED":
        pixels, icc, turned = cmyk_to_rgb(pixels, icc)
        losses.append(turned)
    elif photometric == "MINISWHITE" and pixels.dtype != np.float32:
        pixels = _ink_to_light(pixels, premultiplied)
    elif photometric not in ("MINISBLACK", "RGB", "YCBCR"):
        raise UserError(f"Cannot read {file}: a TIFF in {photometric} is not supported; convert it to RGB.")

    try:
        exif, is_damaged = _exif(file, place_of_tags, layout)
        encoded = upright_exif(exif)
    except Exception:  # damaged metadata must not cost the picture
        encoded, is_damaged = None, True
    if is_damaged:
        losses.append("its EXIF is damaged and not kept whole")
    orientation = int(tags.get(ORIENTATION, 1))
    unit = INCHES.get(int(tags.get(296, 2)))
    resolution = [tags[code][0] / tags[code][1] for code in (282, 283) if code in tags and tags[code][1]]
    if unit is None and len(set(resolution)) > 1:
        losses.append(f"the shape of its pixels ({resolution[1]:g}:{resolution[0]:g}) is not kept")
    return Picture(
        upright(pixels, orientation),
        icc=bytes(icc) if icc is not None else None,
        exif=encoded,
        xmp=upright_xmp(bytes(tags[700])) if 700 in tags else None,
        dpi=upright_dpi([value * unit for value in resolution], orientation) if unit else None,
        premultiplied=premultiplied,
        half=is_half,
        note=lost(file, losses),
    )


def _exif(file: Path, place: int, layout: tuple[str, bool]) -> tuple[Any, bool]:
    """Pillow's EXIF of the directory at `place`, and whether its own directories are damaged.

    layout: the order of bytes, and whether it is a BigTIFF.
    """
    from PIL import Image

    exif = Image.Exif()
    exif.endian, exif.bigtiff = layout
    with file.open("rb") as stream:
        exif.load_from_fp(stream, place)
        for code in set(exif) - {*TEXTS, ORIENTATION, EXIF_IFD, GPS_IFD}:
            del exif[code]
        with warnings.catch_warnings(record=True) as complaints:
            warnings.simplefilter("always")
            for code in (EXIF_IFD, GPS_IFD):
                exif.get_ifd(code)  # read while the file is open; of what is cut Pillow only warns
    exif.bigtiff = False  # as which it is written elsewhere
    if LAYOUT.match(str(exif.get(DESCRIPTION, ""))):
        del exif[DESCRIPTION]
    return exif, bool(complaints)


def _ink_to_light(pixels: np.ndarray, premultiplied: bool) -> np.ndarray:
    """Grey (h, w, 1 or 2) of which 0 is white, as light; alpha, by which ink is multiplied too, stays as it is."""
    ink, alpha = pixels[..., :1], pixels[..., 1:]
    white = alpha if premultiplied else pixels.dtype.type(np.iinfo(pixels.dtype).max)
    return np.concatenate([white - np.minimum(ink, white), alpha], axis=2)


def _palette(table: Any) -> np.ndarray:
    """A colour map (n, 3): of 8 bits where it is that, spread to 16 by 256 or by 257 as writers do, else of 16."""
    colours = np.moveaxis(np.asarray(table, np.uint16), 0, -1)
    high, low = colours >> 8, colours & 255
    return high.astype(np.uint8) if not low.any() or (low == high).all() else colours


def _losses(tiff: Any) -> list[str]:
    """What of a TIFF is not in its first page."""
    losses = []
    with suppress(Exception):  # pages after the first may be damaged
        kinds = [page.subfiletype & 5 for page in _pages(tiff)]  # 1: smaller versions, 4: masks
        if (pages := kinds.count(0)) > 1:
            losses.append(f"of its {pages} pages only the first is used")
        if any(kind & 4 for kind in kinds):
            losses.append("its mask is not kept")
        if any(kind & 1 for kind in kinds) or tiff.pages.first.subifds:
            losses.append("its smaller versions are not kept")
    return losses


def _cut(pixels: np.ndarray, bits: int) -> list[str]:
    """Whether samples of so many bits lose something on being made what a picture has."""
    kind, size = pixels.dtype.kind, pixels.dtype.itemsize
    if kind == "u" and size == 4:
        top = pixels >> 16
        return [] if np.array_equal(top * 65537, pixels) else [f"its {bits} bits become 16"]
    if kind == "f" and size == 8:
        with np.errstate(over="ignore"):
            same = np.array_equal(pixels.astype(np.float32), pixels, equal_nan=True)
        return [] if same else ["its 64 bits become 32"]
    return []


def plain_depth(file: Path, pixels: np.ndarray, bits: int | None = None) -> np.ndarray:
    """Samples of any kind and shape as uint8, uint16 or float32, whole numbers by their full range.

    bits: that are used of each, the lowest; None are all.
    """
    kind, bits = pixels.dtype.kind, bits or 8 * pixels.dtype.itemsize
    if kind == "b":
        return pixels.astype(np.uint8) * np.uint8(255)
    if kind == "f":
        return pixels.astype(np.float32)
    if kind == "u" and pixels.dtype.itemsize == 4:
        return (pixels >> 16).astype(np.uint16)
    if kind == "u" and bits < 8 * pixels.dtype.itemsize <= 16:
        return spread(pixels, bits, 8 * pixels.dtype.itemsize)
    if kind == "u" and pixels.dtype.itemsize <= 2:
        return pixels.astype(pixels.dtype.newbyteorder("="))
    raise UserError(f"Cannot read {file}: samples of {pixels.dtype} are not supported; convert to uint16 or float32.")


def unheld_exif(picture: Picture) -> list[str]:
    """The names of the tags of EXIF's first directory that are not written into a TIFF's."""
    held = {code for code, value in exif_of(picture).items() if code in TEXTS and isinstance(value, str)}
    return first_names(picture.exif, held)


def write(path: Path, picture: Picture, quality: int) -> None:
    """Write a TIFF in 8, 16 or 32 bits, compressed without loss."""
    import tifffile

    exif = exif_of(picture)
    extra: list[tuple[int, int | str, int, Any, bool]] = []
    for code in TEXTS:
        if isinstance(text := exif.get(code), str):
            extra.append((code, "s", 0, text.encode(), True))
    if picture.xmp:
        extra.append((700, "B", len(picture.xmp), picture.xmp, True))
    directories = {code: exif.get_ifd(code) for code in (EXIF_IFD, GPS_IFD) if exif.get_ifd(code)}
    channels = picture.pixels.shape[2]
    tifffile.imwrite(
        path,
        picture.pixels if channels > 1 else picture.pixels[..., 0],
        photometric="rgb" if channels >= 3 else "minisblack",
        planarconfig="contig" if channels > 1 else None,
        extrasamples=["assocalpha" if picture.premultiplied else "unassalpha"] if picture.has_alpha else None,
        compression="zlib",
        compressionargs={"level": ZLIB_LEVEL},
        predictor=True,
        iccprofile=picture.icc,
        resolution=picture.dpi,
        resolutionunit="inch" if picture.dpi else None,
        byteorder="<",
        software=False,
        metadata=None,
        extratags=extra,
    )
    if directories:
        _append_directories(path, directories)


def _append_directories(path: Path, directories: Mapping[int, Mapping[int, Any]]) -> None:
    """Put EXIF's own directories at the end of a TIFF, and a first directory that knows them (TIFF 6.0, section 2).

    tifffile writes no directories but those of images. A BigTIFF, of 4 GB, has longer numbers.
    """
    from PIL.TiffImagePlugin import ImageFileDirectory_v2

    with path.open("r+b") as stream:
        is_big = stream.read(4)[2] == BIG
        stream.seek(0)
        head = stream.read(16 if is_big else 8)
        number, counter, kind, at = ("Q", "Q", LONG8, 8) if is_big else ("I", "H", LONG, 4)
        entry, (start,) = f"<HH{number}{number}", struct.unpack_from(f"<{number}", head, at)
        stream.seek(start)
        (count,) = struct.unpack(f"<{counter}", stream.read(struct.calcsize(counter)))
        entries = [stream.read(struct.calcsize(entry)) for _ in range(count)]
        for code, values in directories.items():
            directory = ImageFileDirectory_v2(head, group=code)
            for tag, value in values.items():
                directory[tag] = value
            end = stream.seek(0, os.SEEK_END)
            stream.write(directory.tobytes(end))
            entries.append(struct.pack(entry, code, kind, 1, end))
        end = stream.seek(0, os.SEEK_END)
        entries.sort(key=lambda entry: struct.unpack_from("<H", entry))
        stream.write(struct.pack(f"<{counter}", len(entries)) + b"".join(entries) + struct.pack(f"<{number}", 0))
        stream.seek(at)
        stream.write(struct.pack(f"<{number}", end))

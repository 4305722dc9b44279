"""The table of picture files: what each kind holds, what it keeps, and the codec that reads and writes it."""

from __future__ import annotations

import io
import os
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from app.errors import UserError
from app.media.codecs import avif, exr, gif, jpeg, other, pillow, png, tiff, webp
from app.media.codecs.metadata import profile_name
from app.model.picture import Picture


@dataclass(frozen=True)
class Format:
    """A kind of picture file.

    Attributes:
        read: reads a file, given the most pixels it may have.
        write: writes a picture in a quality of 1-100; None where we do not.
        signature: a pattern that such a file begins with; None where the ending must tell.
        bits: a channel of what is written, deepest last.
        alpha, grey: whether it has them.
        longest: pixels along a side at most.
        codecs: ways to compress that can be asked for, the usual one first.
        held_dpi: the dots an inch that it tells for some, where those are not the same.
        keeps: the fields of a `Picture` besides its pixels that come back from a written file.
        but: what of such a field does not, by the names in it.
        multiplied: its colours are multiplied by alpha, whatever the picture's are.
    """

    name: str
    endings: tuple[str, ...]
    read: Callable[[Path, int], Picture]
    write: Callable[..., None] | None = None
    signature: bytes | None = None
    bits: tuple[int, ...] = ()
    alpha: bool = True
    grey: bool = True
    longest: int = 2**31 - 1
    codecs: tuple[str, ...] = ()
    held_dpi: Callable[[tuple[float, float]], tuple[float, float]] | None = None
    keeps: frozenset[str] = frozenset()
    but: Mapping[str, Callable[[Picture], Collection[str]]] = field(default_factory=dict, hash=False)
    multiplied: bool = False


ONLY_READ = {
    "DDS": (".dds",), "ICO": (".ico",), "JPEG 2000": (".j2k", ".jp2"), "PBM": (".pbm",), "PCX": (".pcx",),
    "PGM": (".pgm",), "PNM": (".pnm",), "PPM": (".ppm",), "QOI": (".qoi",), "SGI": (".sgi",), "TGA": (".tga",),
}  # fmt: skip
# XYZ of red, green and blue as profiles have them, for a white of D50 (IEC 61966-2-1, ICC.1).
SRGB_PRIMARIES = ((0.4361, 0.2225, 0.0139), (0.3851, 0.7169, 0.0971), (0.1431, 0.0606, 0.7141))
EMBEDDED = frozenset({"icc", "exif", "xmp"})
HEADER = frozenset({"chromaticities", "texts", "attributes"})
TABLE = (
    Format(
        "PNG", (".png",), png.read, png.write, rb"\x89PNG\r\n\x1a\n",
        bits=(8, 16), longest=1_000_000, held_dpi=png.held_dpi, keeps=EMBEDDED | {"dpi", "texts", "chunks"},
        but={"texts": png.unheld_texts, "xmp": png.unheld_xmp},
    ),
    Format(
        "JPEG", (".jpg", ".jpeg"), jpeg.read, jpeg.write, rb"\xff\xd8\xff",
        bits=(8,), alpha=False, longest=65500, held_dpi=jpeg.held_dpi, keeps=EMBEDDED | {"dpi", "texts"},
        but={"exif": jpeg.unheld_exif, "xmp": jpeg.unheld_xmp, "texts": jpeg.unheld_texts},
    ),
    Format(
        "WebP", (".webp",), webp.read, webp.write, rb"RIFF....WEBP",
        bits=(8,), grey=False, longest=16383, keeps=EMBEDDED | {"dpi"},
    ),
    Format(
        "AVIF", (".avif",), avif.read, avif.write, rb"....ftypavi[fs]",
        bits=(8,), grey=False, longest=32768, keeps=EMBEDDED | {"dpi"},  # what decoders take
    ),
    Format(
        "TIFF", (".tif", ".tiff"), tiff.read, tiff.write, rb"II[*+]\0|MM\0[*+]",
        bits=(8, 16, 32), keeps=EMBEDDED | {"dpi", "premultiplied"}, but={"exif": tiff.unheld_exif},
    ),
    Format(
        "OpenEXR", (".exr",), exr.read, exr.write, rb"v/1\x01",
        bits=(16, 32), codecs=exr.COMPRESSIONS, but={"texts": exr.unheld_texts}, multiplied=True,
        keeps=HEADER | {"dpi", "layers", "parts", "group", "half", "wide", "margins", "origin", "premultiplied"},
    ),
    Format("GIF", (".gif",), gif.read, signature=rb"GIF8[79]a"),
    Format("BMP", (".bmp",), partial(pillow.read, "BMP"), signature=rb"BM"),
    *(Format(name, endings, partial(other.read, name)) for name, endings in ONLY_READ.items()),
)  # fmt: skip

ENDINGS = {ending: kind for kind in TABLE for ending in kind.endings}
"""Every ending of a picture that is read, and its kind."""

FORMATS = {ending: kind for ending, kind in ENDINGS.items() if kind.write}
"""Those that are written."""


def kind_of(file: Path, head: bytes) -> Format | None:
    """The kind of a file that begins with `head`, by that if it can be told, else by its ending; None if unknown."""

    def fits(kind: Format) -> bool:
        if kind.signature is None:
            return file.suffix.lower() in kind.endings
        return re.match(kind.signature, head, re.DOTALL) is not None

    return next(filter(fits, TABLE), None)


def picture_format(path: str | os.PathLike[str]) -> Format:
    """The format the ending of `path` asks for; raises `UserError` when it is none we write."""
    known = FORMATS.get(Path(path).suffix.lower())
    if known is None:
        raise UserError(f"Cannot write {path}: a picture's name must end in one of {' '.join(FORMATS)}.")
    return known


def check_picture_output(
    path: str | os.PathLike[str],
    bits: int | None = None,
    size: tuple[int, int] | None = None,
    codec: str | None = None,
) -> None:
    """Raise `UserError` if `path` has no ending of a picture we write, or its format not these bits, size or codec."""
    chosen = picture_format(path)
    if bits is not None and bits not in chosen.bits:
        raise UserError(
            f"Cannot write {path}: {chosen.name} holds {' or '.join(map(str, chosen.bits))} bits a channel, not {bits}."
        )
    if codec is not None and codec not in chosen.codecs:
        if chosen.codecs:
            why = f"{chosen.name} is compressed as {' '.join(chosen.codecs)}, not {codec}; change --codec"
        else:
            why = "a picture has no codec; leave out --codec, or write a video"
        raise UserError(f"Cannot write {path}: {why}.")
    if size is not None and max(size) > chosen.longest:
        raise UserError(
            f"Cannot write {path}: the result is {size[0]} x {size[1]} pixels, and {chosen.name} holds no side longer "
            f"than {chosen.longest}; make it smaller, or write a TIFF."
        )


def is_srgb(icc: bytes) -> bool:
    """Whether an ICC profile is that of sRGB, by its name and its primaries."""
    from PIL import ImageCms

    if "sRGB" not in profile_name(icc) or icc[16:20] != b"RGB ":
        return False
    told: Any = ImageCms.ImageCmsProfile(io.BytesIO(icc)).profile
    primaries = [told.red_colorant, told.green_colorant, told.blue_colorant]
    return all(one and np.allclose(one[0], xyz, atol=2e-3) for one, xyz in zip(primaries, SRGB_PRIMARIES, strict=True))


def fits_profile(picture: Picture, kind: Format) -> bool:
    """Whether the picture's profile can be written: readers complain of one for grey where there is RGB."""
    space = b"GRAY" if picture.pixels.shape[2] < 3 and kind.grey else b"RGB "
    return "icc" in kind.keeps and picture.icc is not None and picture.icc[16:20] == space


def written_depth(kind: Format, picture: Picture, bits: int | None = None) -> tuple[int, bool]:
    """The depth that a picture is written in, 8, 16 or 32, and of 32 whether as half floats; see `write_picture`."""
    if "half" in kind.keeps:
        return 32, picture.half if bits is None else bits == 16
    return bits or max((held for held in kind.bits if held <= picture.bits), default=kind.bits[0]), False

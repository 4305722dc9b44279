"""The table of picture files: what each kind holds, what it keeps, and the codec that reads and writes it."""

from __future__ import annotations

import io
import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from app.errors import UserError
from app.media.codecs import avif, exr, jpeg, other, pillow, png, tiff, webp
from app.media.files import is_sequence
from app.media.losses import REC709, counted, few
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


ONLY_READ = {
    "DDS": (".dds",), "ICO": (".ico",), "JPEG 2000": (".j2k", ".jp2"), "PBM": (".pbm",), "PCX": (".pcx",),
    "PGM": (".pgm",), "PNM": (".pnm",), "PPM": (".ppm",), "QOI": (".qoi",), "SGI": (".sgi",), "TGA": (".tga",),
}  # fmt: skip
EMBEDDED = frozenset({"icc", "exif", "xmp"})
PNG_STEP = png.METRE  # PNG tells whole dots a metre, and no 72 an inch
HEADER = frozenset({"chromaticities", "texts", "attributes"})
TABLE = (
    Format(
        "PNG", (".png",), png.read, png.write, rb"\x89PNG\r\n\x1a\n",
        bits=(8, 16), longest=1_000_000, held_dpi=png.held_dpi, keeps=EMBEDDED | {"dpi", "texts", "chunks"},
    ),
    Format(
        "JPEG", (".jpg", ".jpeg"), jpeg.read, jpeg.write, rb"\xff\xd8\xff",
        bits=(8,), alpha=False, longest=65500, held_dpi=jpeg.held_dpi, keeps=EMBEDDED | {"dpi", "texts"},
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
        bits=(8, 16, 32), keeps=EMBEDDED | {"dpi", "premultiplied"},
    ),
    Format(
        "OpenEXR", (".exr",), exr.read, exr.write, rb"v/1\x01",
        bits=(16, 32), codecs=exr.COMPRESSIONS,
        keeps=HEADER | {"dpi", "layers", "parts", "group", "half", "wide", "margins", "origin", "premultiplied"},
    ),
    Format("GIF", (".gif",), partial(pillow.read, "GIF"), signature=rb"GIF8[79]a"),
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


def profile_name(icc: bytes) -> str:
    """What an ICC profile calls itself; "" if it is damaged."""
    from PIL import ImageCms

    try:
        return ImageCms.getProfileDescription(ImageCms.ImageCmsProfile(io.BytesIO(icc))).strip() or "unnamed"
    except (ImageCms.PyCMSError, OSError):
        return ""


def unheld(
    path: str | os.PathLike[str],
    picture: Picture,
    *,
    with_layers: bool = True,
    with_margins: bool = True,
    with_dpi: bool = True,
    animated: bool = False,
) -> str:
    """What of a picture the file `path` does not hold, in a sentence; "" if nothing.

    with_layers, with_margins: whether these were warped, as they are for a still that shows its own pixels.
    with_dpi: whether its own resolution is written.
    animated: it holds all frames, unless it is one of a sequence.
    """
    own, kind = picture.chromaticities, FORMATS.get(Path(path).suffix.lower())
    if animated and not is_sequence(path):
        kind = None
    keeps, losses = kind.keeps if kind else frozenset[str](), []
    if own is not None and not np.allclose(own, REC709, atol=1e-3) and "chromaticities" not in keeps:
        losses.append("cannot tell the primaries (chromaticities) of the picture, and is read as BT.709")
    if picture.icc and "icc" not in keeps and (name := profile_name(picture.icc)) and "sRGB" not in name:
        losses.append(f"cannot hold the picture's colour profile ({few([name])}), and is read as sRGB")
    if picture.layers and not (with_layers and "layers" in keeps):
        losses.append(f"lacks the picture's {counted('channel', [layer.name for layer in picture.layers])}")
    if picture.wide is not None and not (with_margins and "wide" in keeps):
        losses.append(f"lacks the picture's overscan ({max(picture.margins)} px beyond the display window)")
    if picture.origin != (0, 0) and "origin" not in keeps:
        losses.append(f"begins at 0, 0 and not at {picture.origin[0]}, {picture.origin[1]} as the display window")
    if picture.dpi and with_dpi and kind is not None and kind.held_dpi is not None:
        held = kind.held_dpi(picture.dpi)
        if not np.allclose(held, picture.dpi, rtol=0, atol=PNG_STEP):
            losses.append(
                f"says {_dots(held)} dpi and not {_dots(picture.dpi)} as the picture: {kind.name} holds whole numbers"
            )
    return f"{Path(path).name} {'; it '.join(losses)}" if losses else ""


def _dots(dpi: tuple[float, float]) -> str:
    """Dots an inch along x and y, or along both."""
    return " x ".join(f"{value:g}" for value in dict.fromkeys(dpi))

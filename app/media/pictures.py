"""Reading and writing pictures, each in its own depth."""

from __future__ import annotations

import io
import logging
import math
import os
import re
import struct
import sys
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from app.errors import UserError
from app.media.files import replacing
from app.media.inputs import read_start
from app.model.picture import Picture, linear_to_srgb, srgb_to_linear

EXR_LAYOUT = frozenset({"version", "chunkCount", "maxSamplesPerPixel", "dwaCompressionLevel"})

MAX_PIXELS = 400_000_000
MOST_TEXT = 64 * 2**20  # bytes of a profile or text in a PNG, unpacked
PNG_LEVEL = 4  # on photographs as small as zlib's 6 within 1 %, in half the time

ORIENTATION, DESCRIPTION, EXIF_IFD, GPS_IFD = 0x0112, 0x010E, 0x8769, 0x8825
# description, make, model, software, date, artist, copyright: what of a TIFF's first directory is not about its layout
TIFF_TEXTS = (DESCRIPTION, 0x010F, 0x0110, 0x0131, 0x0132, 0x013B, 0x8298)
# Descriptions in which tifffile, ImageJ and OME keep the shape, which readers believe and a result would belie.
LAYOUT = re.compile(r'\s*\{"shape": ?\[|ImageJ=|.{0,400}<OME[\s>]', re.DOTALL)


@dataclass(frozen=True)
class Format:
    """What a file format can hold: bits a channel, deepest last; alpha, grey; the longest side in pixels."""

    name: str
    bits: tuple[int, ...]
    alpha: bool = True
    grey: bool = True
    longest: int = 2**31 - 1


PNG = Format("PNG", (8, 16), longest=1_000_000)
JPEG = Format("JPEG", (8,), alpha=False, longest=65500)
WEBP = Format("WebP", (8,), grey=False, longest=16383)
AVIF = Format("AVIF", (8,), grey=False, longest=32768)  # what decoders take
TIFF = Format("TIFF", (8, 16, 32))
EXR = Format("OpenEXR", (32,))

FORMATS = {
    ".png": PNG, ".jpg": JPEG, ".jpeg": JPEG, ".webp": WEBP, ".avif": AVIF, ".tif": TIFF, ".tiff": TIFF, ".exr": EXR,
}  # fmt: skip
SIGNATURES = {
    "PNG": rb"\x89PNG\r\n\x1a\n", "JPEG": rb"\xff\xd8\xff", "WebP": rb"RIFF....WEBP", "AVIF": rb"....ftypavi[fs]",
    "TIFF": rb"II[*+]\0|MM\0[*+]", "OpenEXR": rb"v/1\x01", "GIF": rb"GIF8[79]a", "BMP": rb"BM",
}  # fmt: skip
# What the codes of H.273 mean, where it is not what sRGB and BT.709 have; other codes are told as numbers.
PRIMARIES = {5: "BT.601", 6: "BT.601", 9: "BT.2020", 10: "XYZ", 11: "DCI-P3", 12: "Display P3"}
TRANSFERS = {4: "gamma 2.2", 5: "gamma 2.8", 8: "linear", 16: "PQ", 18: "HLG"}
USUAL_PRIMARIES, USUAL_TRANSFERS = (1, 2), (1, 2, 6, 13, 14, 15)
INK = "its inks (CMYK) become RGB"
UNKEPT_CHUNKS = {b"bKGD": "background colour", b"sBIT": "number of significant bits"}
COLOUR_CHUNKS = {b"cICP": 4, b"gAMA": 4, b"cHRM": 32, b"sRGB": 1, b"mDCV": 24, b"cLLI": 8}  # and their lengths
USUAL_GAMMA = range(45000, 46000)  # 1 / 2.2, as sRGB has it on the whole
REC709 = (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329)

# What imageio reads for us, by the ending: some of these, as TGA, have no signature.
OTHERS = {
    ".dds": "DDS", ".ico": "ICO", ".j2k": "JPEG 2000", ".jp2": "JPEG 2000", ".pbm": "PBM", ".pcx": "PCX", ".pgm": "PGM",
    ".pnm": "PNM", ".ppm": "PPM", ".qoi": "QOI", ".sgi": "SGI", ".tga": "TGA",
}  # fmt: skip


def picture_format(path: str | os.PathLike[str]) -> Format:
    """The format the ending of `path` asks for; raises `UserError` when it is none we write."""
    known = FORMATS.get(Path(path).suffix.lower())
    if known is None:
        raise UserError(f"Cannot write {path}: a picture's name must end in one of {' '.join(FORMATS)}.")
    return known


def check_picture_output(
    path: str | os.PathLike[str], bits: int | None = None, size: tuple[int, int] | None = None
) -> None:
    """Raise `UserError` if `path` has no ending of a picture we write, or its format not these bits or this size."""
    chosen = picture_format(path)
    if bits is not None and bits not in chosen.bits:
        raise UserError(
            f"Cannot write {path}: {chosen.name} holds {' or '.join(map(str, chosen.bits))} bits a channel, not {bits}."
        )
    if size is not None and max(size) > chosen.longest:
        raise UserError(
            f"Cannot write {path}: the result is {size[0]} x {size[1]} pixels, and {chosen.name} holds no side longer "
            f"than {chosen.longest}; make it smaller, or write a TIFF."
        )


# Depth and alpha ----------------------------------------------------------------------------------------------------


def to_bits(pixels: np.ndarray, bits: int, *, dither: bool = True) -> np.ndarray:
    """Pixels (h, w, c) in another depth: 8 and 16 are sRGB, 32 is linear light; alpha is never curved.

    Going to 8 bits adds noise of one step before cutting, always the same, which leaves exact values exact. Works in
    strips, so that the extra memory does not depend on the size.
    """
    if pixels.dtype.itemsize * 8 == bits:
        return pixels
    out = np.empty(pixels.shape, {8: np.uint8, 16: np.uint16, 32: np.float32}[bits])
    noise = np.random.default_rng(0) if dither and bits == 8 else None
    rows = max(1, 500_000 // max(1, pixels[0].size))
    for top in range(0, len(pixels), rows):
        out[top : top + rows] = _strip_to_bits(pixels[top : top + rows], bits, noise)
    return out


def _strip_to_bits(pixels: np.ndarray, bits: int, noise: np.random.Generator | None) -> np.ndarray:
    if pixels.dtype == np.uint8 and bits == 16:
        return pixels * np.uint16(257)
    colours = pixels.shape[2] - (pixels.shape[2] in (2, 4))
    if bits == 32:
        values = pixels.astype(np.float32) / np.iinfo(pixels.dtype).max
        values[..., :colours] = srgb_to_linear(values[..., :colours])
        return values
    top = 2**bits - 1
    if pixels.dtype == np.uint16:
        values = pixels / np.float32(257)
    else:
        values = np.clip(np.nan_to_num(pixels), 0, 1)
        values[..., :colours] = linear_to_srgb(values[..., :colours])
        values *= top
    # a little less than a whole step, so that rounding errors do not move values that are exact
    offset = 0.5 if noise is None else 0.001 + 0.998 * noise.random(values.shape, np.float32)
    return np.minimum(values + offset, top).astype(np.uint8 if bits == 8 else np.uint16)


def over(pixels: np.ndarray, background: tuple[int, int, int]) -> np.ndarray:
    """8-bit pixels with alpha laid over an opaque 8-bit RGB colour, as programs do it: in the values, not the light."""
    alpha = pixels[..., -1:].astype(np.float32) / 255
    ground = np.asarray(background if pixels.shape[2] == 4 else [np.mean(background)], np.float32)
    return (pixels[..., :-1] * alpha + ground * (1 - alpha) + 0.5).astype(np.uint8)


# Reading ------------------------------------------------------------------------------------------------------------


def read_picture(path: str | os.PathLike[str], max_pixels: int = MAX_PIXELS) -> Picture:
    """Read a picture in its own depth, upright, its first page or frame; palette and CMYK become RGB.

    The content decides the format, not the ending. Raises `UserError` for what is no picture, damaged or larger than
    `max_pixels`.
    """
    file = Path(path)
    head = _head(file)
    name = next((name for name, start in SIGNATURES.items() if re.match(start, head, re.DOTALL)), None)
    if name is None and (name := OTHERS.get(file.suffix.lower())) is None:
        known = ", ".join([*SIGNATURES, *sorted(set(OTHERS.values()))])
        raise UserError(f"Cannot read {file}: it is no picture of a known kind ({known}).")
    reader = {"TIFF": _read_tiff, "OpenEXR": _read_exr}.get(name, _read_pillow if name in SIGNATURES else _read_other)
    with _decoding(file, name):
        return reader(file, name, max_pixels)


def _head(file: Path) -> bytes:
    """The first bytes of a file that is there and not empty."""
    head = read_start(file, "picture", 16)
    if not head:
        raise UserError(f"Cannot read {file}: the file is empty; save or download it again.")
    return head


@contextmanager
def _decoding(file: Path, name: str) -> Iterator[None]:
    """Turn whatever a decoder raises into `UserError`, and keep it from warning."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except UserError:
        raise
    except MemoryError:
        raise UserError(f"Cannot read {file}: it does not fit into the memory.") from None
    except Exception as error:  # decoders of damaged files raise anything: IndexError, struct.error, zlib.error ...
        lines = [line.strip() for line in str(error).splitlines()]
        reason = next((line for line in lines if line.strip("0123456789")), type(error).__name__)
        message = f"Cannot read {file}: the {name} file is truncated or damaged ({reason}); get it again."
        raise UserError(message) from error


def lost(file: Path, losses: Sequence[str]) -> str:
    """What of a file is lost, in one sentence that names it; "" if nothing."""
    return f"{file.name}: {'; '.join(losses)}" if losses else ""


def _few(names: Sequence[str]) -> str:
    """Some of the names that a file gives to its parts, for a message: no control characters, not too many or long."""
    shown = ["".join(letter if letter.isprintable() else "?" for letter in name[:40]) for name in names[:4]]
    return ", ".join(shown) + (f" and {len(names) - len(shown)} more" if len(names) > len(shown) else "")


def _not_kept(kind: str, names: Sequence[str]) -> str:
    """That parts of a file are lost, as "its channels A, B are not kept"."""
    return f"its {kind}{'s' * (len(names) > 1)} {_few(names)} {'are' if len(names) > 1 else 'is'} not kept"


def _unusual_colours(primaries: int, transfer: int) -> str:
    """What colours are, by the codes of H.273, if they are neither sRGB's nor BT.709's; else ""."""
    named = [PRIMARIES.get(primaries, f"primaries {primaries}")] if primaries not in USUAL_PRIMARIES else []
    named += [TRANSFERS.get(transfer, f"transfer {transfer}")] if transfer not in USUAL_TRANSFERS else []
    return " ".join(named)


def unheld(path: str | os.PathLike[str], picture: Picture) -> str:
    """What a picture's colours mean and the format of `path` cannot tell, in a sentence; "" if nothing."""
    own = picture.chromaticities
    if own is None or np.allclose(own, REC709, atol=1e-3) or Path(path).suffix.lower() == ".exr":
        return ""
    return f"{Path(path).name} cannot tell the primaries (chromaticities) of the picture, and is taken for BT.709"


def check_size(file: Path, width: int, height: int, max_pixels: int) -> None:
    """Raise `UserError` for more than `max_pixels`, telling how to raise the limit."""
    if width * height > max_pixels:
        size = f"Cannot read {file}: {width} x {height} pixels are more than the limit of {max_pixels}"
        raise UserError(
            f"{size}; if you trust the file, raise it with --max-pixels {width * height}.",
            in_window=f"{size}; make it smaller first.",
        )


def _read_pillow(file: Path, name: str, max_pixels: int) -> Picture:
    from PIL import Image, PngImagePlugin

    Image.MAX_IMAGE_PIXELS = None  # its limit cannot be raised for one file; ours is in check_size
    PngImagePlugin.MAX_TEXT_CHUNK = MOST_TEXT  # 1 MiB of its own is less than some profiles have
    with Image.open(file, formats=["JPEG", "MPO"] if name == "JPEG" else [name]) as image:
        check_size(file, *image.size, max_pixels)
        icc = image.info.get("icc_profile")
        chunks, unkept = _png_chunks(file) if name == "PNG" else ({}, [])
        losses = _colours_lost(file, name, chunks, icc is not None)
        if unkept:
            losses.append(f"what it says of its {', '.join(unkept)} is not kept")
        if name == "PNG" and _png_bits(file) == 16:
            import imagecodecs

            with _quiet():
                pixels = imagecodecs.png_decode(file.read_bytes())  # Pillow gives 8 bits of 16 without a word
        elif name == "AVIF" and (deep := _avif_bits(file)) > 8:
            import imagecodecs

            with _quiet():  # Pillow gives 8 bits of these too
                pixels = _spread_to_16(imagecodecs.avif_decode(file.read_bytes()), deep)
        elif image.mode == "CMYK":
            losses.append(INK)
            pixels, icc = cmyk_to_rgb(np.asarray(image), icc)
        else:
            pixels = np.asarray(image if image.mode == (mode := _plain_mode(image)) else image.convert(mode))
        exif = image.getexif()
        orientation = exif.get(ORIENTATION, 1)
        texts = {key: str(text) for key, text in getattr(image, "text", {}).items() if key != "XML:com.adobe.xmp"}
        if isinstance(comment := image.info.get("comment"), bytes):
            texts["Comment"] = comment.decode("utf-8", "replace")
        xmp = image.info.get("xmp")
        with suppress(Exception):  # those after the first may be damaged
            if (count := getattr(image, "n_frames", 1)) > 1:
                losses.append(f"of its {count} {'pictures' if name == 'JPEG' else 'frames'} the first is taken")
        return Picture(
            upright(pixels if pixels.ndim == 3 else pixels[..., None], orientation),
            icc=icc,
            exif=_upright_exif(exif),
            xmp=_upright_xmp(xmp.encode() if isinstance(xmp, str) else xmp),
            dpi=_upright_dpi(image.info.get("dpi"), orientation),
            texts={key: text.replace("\0", "") for key, text in texts.items() if key},
            chunks=chunks,
            note=lost(file, losses),
        )


def _read_other(file: Path, name: str, max_pixels: int) -> Picture:
    import imageio.v3 as iio

    if (deepest := re.match(rb"P[36]\s+(?:#.*\s+)*\d+\s+\d+\s+(\d+)", _start(file))) and int(deepest[1]) > 255:
        # it would be read as 8 bits without a word
        raise UserError(f"Cannot read {file}: a {name} of 16-bit colours is not understood; convert it to PNG or TIFF.")
    # the plugin is named, or imageio takes whichever it can open the file with
    with iio.imopen(file, "r", plugin="pillow") as opened:
        height, width = opened.properties(index=0).shape[:2]
        check_size(file, width, height, max_pixels)
        pixels = opened.read(index=0)
    if pixels.dtype == np.int32:  # Pillow's mode for 16-bit grey
        pixels = np.clip(pixels, 0, 65535).astype(np.uint16)
    return Picture(_plain_depth(file, pixels if pixels.ndim == 3 else pixels[..., None]))


def _start(file: Path) -> bytes:
    with file.open("rb") as stream:
        return stream.read(4096)


def _png_bits(file: Path) -> int:
    with file.open("rb") as stream:
        return stream.read(25)[24]


def _png_chunks(file: Path) -> tuple[dict[bytes, bytes], list[str]]:
    """The chunks of a PNG that say what its colours mean, and in words those that are not kept."""
    found: dict[bytes, bytes] = {}
    unkept: dict[str, None] = {}
    with file.open("rb") as stream:
        stream.seek(8)
        while len(head := stream.read(8)) == 8 and (kind := head[4:]) != b"IEND":
            length = int.from_bytes(head[:4], "big")
            end = stream.tell() + length + 4
            if kind in UNKEPT_CHUNKS:
                unkept[UNKEPT_CHUNKS[kind]] = None
            if COLOUR_CHUNKS.get(kind) == length:
                found[kind] = stream.read(length)
            stream.seek(end)
    return found, list(unkept)


def _colours_lost(file: Path, name: str, chunks: Mapping[bytes, bytes], has_profile: bool) -> list[str]:
    """What a PNG or an AVIF tells of its colours, and we do not understand."""
    if name == "AVIF":
        codes = re.search(rb"colrnclx(....)", _start(file), re.DOTALL)
        colours = _unusual_colours(*struct.unpack(">HH", codes[1])) if codes else ""
        return [f"its colours are {colours} (nclx) and are taken for sRGB"] if colours else []
    if codes := chunks.get(b"cICP"):
        colours = _unusual_colours(codes[0], codes[1])
        return [f"its colours are {colours} (cICP), which a PNG keeps, and are mixed as if sRGB"] if colours else []
    if has_profile or b"sRGB" in chunks:
        return []
    told = []
    if b"gAMA" in chunks and (value := int.from_bytes(chunks[b"gAMA"], "big")) not in USUAL_GAMMA:
        told.append(f"gamma of {value / 100000:g} (gAMA)")
    if b"cHRM" in chunks:
        x_y = np.frombuffer(chunks[b"cHRM"], ">u4") / 100000
        if not np.allclose(np.roll(x_y, -2), REC709, atol=2e-3):
            told.append("primaries (cHRM)")
    return [f"a PNG alone keeps its {' and '.join(told)}, and its colours are mixed as if sRGB"] if told else []


def _avif_bits(file: Path) -> int:
    """Bits a channel, from the flags of the first AV1 configuration (AV1 in ISOBMFF, 2.3.3)."""
    start = _start(file)
    at = start.find(b"av1C")
    flags = start[at + 6] if 0 <= at < len(start) - 6 else 0
    return 8 if not flags & 0x40 else 12 if flags & 0x20 else 10


def _spread_to_16(pixels: np.ndarray, bits: int) -> np.ndarray:
    """Values of 10 or 12 bits as uint16, black and white where they are."""
    return (pixels.astype(np.uint32) * 65535 // (2**bits - 1)).astype(np.uint16)


def _plain_mode(image: Any) -> str:
    """The mode of 8-bit grey or RGB, with or without alpha, that loses nothing of Pillow's `image`."""
    grey = image.mode in ("1", "L", "LA", "La")
    alpha = image.mode in ("LA", "La", "RGBA", "RGBa", "PA") or "transparency" in image.info
    return ("L" if grey else "RGB") + ("A" if alpha else "")


def _upright_dpi(dpi: Any, orientation: int) -> tuple[float, float] | None:
    """Pixels an inch along x and y of the upright picture, if they are told at all."""
    if not dpi or len(dpi) != 2 or float(dpi[0]) <= 0 or float(dpi[1]) <= 0:
        return None
    x, y = float(dpi[0]), float(dpi[1])
    return (y, x) if orientation in (5, 6, 7, 8) else (x, y)


def upright(pixels: np.ndarray, orientation: int) -> np.ndarray:
    """Pixels turned and mirrored as EXIF's orientation 1-8 says (CIPA DC-008, 4.6.4)."""
    if orientation in (5, 6, 7, 8):
        pixels = pixels.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return np.ascontiguousarray(pixels)


def _upright_exif(exif: Any) -> bytes | None:
    """Pillow's `exif` as bytes, its orientation undone; the thumbnail, stale after a warp, falls away."""
    if not exif:
        return None
    if ORIENTATION in exif:
        exif[ORIENTATION] = 1
    try:
        return exif.tobytes()
    except Exception:  # a camera's damaged EXIF must not cost the picture
        return None


def _upright_xmp(xmp: bytes | None) -> bytes | None:
    if xmp is None:
        return None
    return re.sub(rb"(tiff:Orientation(?:=\"|>))[0-9]", rb"\g<1>1", xmp)


def cmyk_to_rgb(pixels: np.ndarray, icc: bytes | None) -> tuple[np.ndarray, bytes | None]:
    """RGB of CMYK (h, w, 4; 0 = no ink) through its profile, or by the plain formula; the profile the RGB is in."""
    if icc is not None:
        import imagecodecs

        srgb = imagecodecs.cms_profile("srgb")
        try:
            rgb = imagecodecs.cms_transform(
                np.ascontiguousarray(pixels),
                icc,
                srgb,
                colorspace="cmyk",
                outcolorspace="rgb",
                intent=imagecodecs.CMS.INTENT.RELATIVE_COLORIMETRIC,
            )
            return rgb, srgb
        except (imagecodecs.CmsError, ValueError):
            pass  # a broken profile: colours by the formula are better than no picture
    white = np.iinfo(pixels.dtype).max
    light = white - pixels.astype(np.uint32)
    return ((light[..., :3] * light[..., 3:] + white // 2) // white).astype(pixels.dtype), None


def _read_tiff(file: Path, name: str, max_pixels: int) -> Picture:
    import tifffile
    from PIL import Image

    tifffile.logger().setLevel(logging.CRITICAL)  # what it says of damaged files, it raises too
    with tifffile.TiffFile(file) as tiff:
        page = tiff.pages.first
        check_size(file, page.imagewidth, page.imagelength, max_pixels)
        tags = {tag.code: tag.value for tag in page.tags}
        samples = [axis for axis in page.axes if axis in "YXS"]
        if "".join(sorted(samples)) not in ("XY", "SXY") or page.axes.strip("YXS"):
            raise UserError(f"Cannot read {file}: a TIFF with the axes {page.axes} is no picture; save one page of it.")
        pieces = math.prod(page.chunked)
        if not page.is_contiguous and len(page.dataoffsets) < pieces:  # tifffile fills what is missing with zeros
            raise ValueError(f"it has {len(page.dataoffsets)} of its {pieces} strips or tiles")
        losses = _tiff_losses(tiff)
        pixels = page.asarray()
        photometric = tifffile.PHOTOMETRIC(page.photometric).name
    pixels = np.moveaxis(pixels, 0, -1) if page.axes == "SYX" else pixels.reshape(*pixels.shape[:2], -1)
    pixels = _plain_depth(file, pixels)
    icc = tags.get(34675)
    if photometric == "PALETTE":
        pixels = np.moveaxis(np.asarray(tags[320], np.uint16), 0, -1)[pixels[..., 0]]
    elif photometric == "SEPARATED":
        losses.append(INK)
        pixels, icc = cmyk_to_rgb(pixels[..., :4], icc)
    elif photometric == "MINISWHITE" and pixels.dtype != np.float32:
        pixels = np.iinfo(pixels.dtype).max - pixels
    elif photometric not in ("MINISBLACK", "RGB", "YCBCR"):
        raise UserError(f"Cannot read {file}: a TIFF in {photometric} is not understood; convert it to RGB.")
    if pixels.shape[2] > 4:  # further samples are masks and spot colours
        taken = 4 if page.extrasamples else 3
        losses.append(f"of its {pixels.shape[2]} samples a pixel the first {taken} are taken")
        pixels = pixels[..., :taken]

    premultiplied = tuple(page.extrasamples[:1]) == (tifffile.EXTRASAMPLE.ASSOCALPHA,)

    exif = Image.Exif()
    with file.open("rb") as stream:
        try:
            exif.load_from_fp(stream)
            for code in set(exif) - {*TIFF_TEXTS, ORIENTATION, EXIF_IFD, GPS_IFD}:
                del exif[code]
            if LAYOUT.match(str(exif.get(DESCRIPTION, ""))):
                del exif[DESCRIPTION]
            encoded = _upright_exif(exif)
        except Exception:  # damaged metadata must not cost the picture
            encoded = None
    orientation = int(tags.get(ORIENTATION, 1))
    unit = {2: 1.0, 3: 2.54}.get(int(tags.get(296, 2)))
    resolution = [tags[code][0] / tags[code][1] for code in (282, 283) if code in tags and tags[code][1]]
    return Picture(
        upright(pixels, orientation),
        icc=bytes(icc) if icc is not None else None,
        exif=encoded,
        xmp=_upright_xmp(bytes(tags[700])) if 700 in tags else None,
        dpi=_upright_dpi([value * unit for value in resolution], orientation) if unit else None,
        premultiplied=premultiplied,
        note=lost(file, losses),
    )


def _tiff_losses(tiff: Any) -> list[str]:
    """What of a TIFF is not in its first page, and what is cut of its samples."""
    losses = []
    with suppress(Exception):  # pages after the first may be damaged
        pages = sum(not page.subfiletype & 5 for page in tiff.pages)  # neither smaller versions nor masks
        if pages > 1:
            losses.append(f"of its {pages} pages the first is taken")
    if (kind := tiff.pages.first.dtype) is not None and kind.itemsize > (2 if kind.kind == "u" else 4):
        losses.append(f"its {8 * kind.itemsize} bits become {16 if kind.kind == 'u' else 32}")
    return losses


def _plain_depth(file: Path, pixels: np.ndarray) -> np.ndarray:
    """TIFF samples of any kind as uint8, uint16 or float32."""
    kind = pixels.dtype.kind
    if kind == "b":
        return pixels.astype(np.uint8) * np.uint8(255)
    if kind == "f":
        return pixels.astype(np.float32)
    if kind == "u" and pixels.dtype.itemsize == 4:
        return (pixels >> 16).astype(np.uint16)
    if kind == "u" and pixels.dtype.itemsize <= 2:
        return pixels.astype(pixels.dtype.newbyteorder("="))
    raise UserError(f"Cannot read {file}: samples of {pixels.dtype} are not understood; convert it to 16 bits.")


@contextmanager
def _quiet() -> Iterator[None]:
    """Hold back what OpenEXR and libpng print about a damaged file by themselves, where we raise an error of ours."""
    sys.stderr.flush()
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        with redirect_stdout(io.StringIO()):
            yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


def exr_channels(file: Path) -> list[str]:
    """The names of the channels of an EXR's first part, by its header; raises `UserError`."""
    import OpenEXR

    _head(file)
    with _decoding(file, "OpenEXR"), _quiet():
        return [channel.name for channel in OpenEXR.File(str(file), header_only=True).header()["channels"]]


def read_exr(file: Path, max_pixels: int = MAX_PIXELS) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """The channels (h, w) float32 by name, filling the data window, and the header of an EXR's first part.

    Raises `UserError`.
    """
    import OpenEXR

    _head(file)
    with _decoding(file, "OpenEXR"), _quiet():
        header = OpenEXR.File(str(file), header_only=True).header()
        for window in ("dataWindow", "displayWindow"):
            (left, top), (right, bottom) = header[window]
            check_size(file, int(right) - int(left) + 1, int(bottom) - int(top) + 1, max_pixels)
        exr = OpenEXR.File(str(file), separate_channels=True)
        # a file that ends early is announced on stdout, not raised: it just has no part
        channels = exr.channels() if exr.parts else {}
        if not channels:
            raise ValueError("pixel data is missing")
        return {key: np.asarray(channel.pixels, np.float32) for key, channel in channels.items()}, header


def _read_exr(file: Path, name: str, max_pixels: int) -> Picture:
    channels, header = read_exr(file, max_pixels)
    for wanted in (("R", "G", "B", "A"), ("R", "G", "B"), ("Y", "A"), ("Y",)):
        if set(wanted) <= set(channels) and "RY" not in channels:
            break
    else:
        names = " ".join(channels)
        raise UserError(f"Cannot read {file}: of its channels {names} none are R G B or Y; save a plain RGB layer.")
    (left, top), _ = header["dataWindow"]
    (first_x, first_y), (last_x, last_y) = header["displayWindow"]
    data = np.stack([channels[key] for key in wanted], axis=-1)
    pixels = np.zeros((last_y - first_y + 1, last_x - first_x + 1, len(wanted)), np.float32)
    place_window(data, (left - first_x, top - first_y), pixels)
    chromaticities = header.get("chromaticities")
    others = [key for key in channels if key not in wanted]
    losses = [_not_kept("channel", others)] if others else []
    losses += _exr_losses(file, header)
    return Picture(
        pixels,
        chromaticities=tuple(float(value) for value in chromaticities) if chromaticities is not None else None,
        texts={key: value for key, value in header.items() if isinstance(value, str) and key not in ("name", "view")},
        premultiplied=True,
        attributes={key: value for key, value in header.items() if _is_kept(key, value)},
        note=lost(file, losses),
    )


def _exr_losses(file: Path, header: Mapping[str, Any]) -> list[str]:
    """What of an EXR lies beside its first part, or beyond its display window."""
    import OpenEXR

    with _quiet():
        parts = [part.header.get("name", "") for part in OpenEXR.File(str(file), header_only=True).parts[1:]]
    losses = [_not_kept("further part", parts)] if parts else []
    (left, top), (right, bottom) = header["dataWindow"]
    (first_x, first_y), (last_x, last_y) = header["displayWindow"]
    beyond = max(first_x - left, first_y - top, right - last_x, bottom - last_y)
    if beyond > 0:
        losses.append(f"its overscan ({int(beyond)} px beyond the display window) is not kept")
    if first_x or first_y:
        losses.append(f"its display window begins at {int(first_x)}, {int(first_y)} and is moved to 0, 0")
    return losses


def _is_kept(key: str, value: Any) -> bool:
    """Whether an attribute of an EXR is a number or a few, and says nothing about how the file is laid out."""
    numbers = isinstance(value, int | float) or (isinstance(value, np.ndarray) and value.dtype.kind == "f")
    return numbers and key not in EXR_LAYOUT


def place_window(data: np.ndarray, at: tuple[int, int], into: np.ndarray) -> None:
    """Copy what of `data`, its corner laid at pixel `at` (x, y), falls on `into`."""
    spans = []
    for start, length, room in zip(at[::-1], data.shape, into.shape, strict=False):
        first, last = max(0, int(start)), min(room, int(start) + length)
        spans.append((slice(first, max(first, last)), slice(first - int(start), max(first, last) - int(start))))
    into[spans[0][0], spans[1][0]] = data[spans[0][1], spans[1][1]]


# Writing ------------------------------------------------------------------------------------------------------------


def write_picture(
    path: str | os.PathLike[str],
    picture: Picture,
    *,
    bits: int | None = None,
    quality: int = 95,
    strip: bool = False,
    background: tuple[int, int, int] = (0, 0, 0),
) -> None:
    """Write a picture in the format of the ending of `path`, whole or not at all.

    bits: 8, 16 or 32 a channel; None keeps the picture's own, or the deepest below it that the format has.
    quality: 1-100 for JPEG, WebP and AVIF; WebP is lossless at 100.
    strip: leave out EXIF, XMP, resolution and texts; the colour profile stays.
    background: what shows through where the format has no alpha.
    Raises `UserError`.
    """
    check_picture_output(path, bits, (picture.width, picture.height))
    chosen = picture_format(path)
    if strip:
        picture = picture.stripped()
    depth = bits or max((held for held in chosen.bits if held <= picture.bits), default=chosen.bits[0])
    if depth != picture.bits or chosen not in (TIFF, EXR):
        picture = picture.straight()
    picture = picture.with_pixels(to_bits(picture.pixels, depth))
    if picture.has_alpha and not chosen.alpha:
        picture = picture.with_pixels(over(picture.pixels, background))
    if picture.icc and picture.icc[16:20] != (b"GRAY" if picture.pixels.shape[2] < 3 and chosen.grey else b"RGB "):
        picture = replace(picture, icc=None)  # a profile of the other kind is not allowed, and readers complain
    with replacing(path) as temporary:
        if chosen is TIFF:
            _write_tiff(temporary, picture)
        elif chosen is EXR:
            _write_exr(temporary, picture)
        else:
            # encoded in memory: on a full disk Pillow's own writing loses the reason
            encoded = _encode_png(picture) if chosen is PNG else _encode_pillow(picture, chosen, quality)
            temporary.write_bytes(encoded)


def _encode_png(picture: Picture) -> bytes:
    import zlib

    import imagecodecs
    from PIL.PngImagePlugin import PngInfo, putchunk

    pixels = np.ascontiguousarray(picture.pixels)
    # What is narrow and noisy grows: by a byte a row, and by an eighth where zlib has a small window for it.
    filtered = pixels.nbytes + picture.height
    most = filtered + filtered // 64 + 4096
    # a view, so that its parts are no copies: of a large picture each would take a hundred megabytes
    pixels = pixels if pixels.shape[2] > 1 else pixels[..., 0]
    encoded = memoryview(imagecodecs.png_encode(pixels, level=PNG_LEVEL, out=most))
    extra = PngInfo()
    for kind, data in picture.chunks.items():
        extra.add(kind, data)
    if picture.icc:
        extra.add(b"iCCP", b"ICC Profile\0\0" + zlib.compress(picture.icc))
    if picture.dpi:
        metre = [round(value / 0.0254).to_bytes(4, "big") for value in picture.dpi]
        extra.add(b"pHYs", b"".join(metre) + b"\1")
    if picture.exif:
        extra.add(b"eXIf", _sized_exif(picture).removeprefix(b"Exif\0\0"))
    if picture.xmp:
        extra.add_itxt("XML:com.adobe.xmp", picture.xmp.decode("utf-8", "replace"))
    for key, text in picture.texts.items():
        extra.add_itxt(key.encode("latin-1", "replace")[:79], text)
    chunks = io.BytesIO()
    for kind, data, _ in extra.chunks:
        putchunk(chunks, kind, data)
    header = 8 + 25  # the signature and IHDR, after which all of these may stand
    return b"".join([encoded[:header], chunks.getvalue(), encoded[header:]])


def _encode_pillow(picture: Picture, chosen: Format, quality: int) -> bytes:
    from PIL import Image, features

    if chosen is AVIF and not features.check("avif"):
        raise UserError("This Pillow was built without AVIF; use another format or install Pillow from PyPI.")
    options: dict[str, Any] = {"quality": quality, "icc_profile": picture.icc, "exif": _sized_exif(picture)}
    if picture.xmp:
        options["xmp"] = picture.xmp
    if chosen is JPEG:
        # Not optimized: that gains a few per cent, holds the file in memory once more, and fails where noise makes the
        # file larger than the buffer Pillow guesses.
        options |= {"subsampling": 0, "comment": picture.texts.get("Comment", "")}
        if picture.dpi:
            options["dpi"] = tuple(round(value) for value in picture.dpi)
    elif chosen is WEBP:
        options |= {"lossless": quality == 100, "exact": True}
    else:
        options |= {"subsampling": "4:4:4"}
    pixels = picture.pixels[..., 0] if picture.pixels.shape[2] == 1 else picture.pixels
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, format=chosen.name.upper(), **options)
    return buffer.getvalue()


def _exif_of(picture: Picture) -> Any:
    from PIL import Image

    exif = Image.Exif()
    if picture.exif:
        exif.load(picture.exif)
        inner = exif.get_ifd(EXIF_IFD)
        for code, size in ((0xA002, picture.width), (0xA003, picture.height)):
            if code in inner:
                inner[code] = size
    return exif


def _sized_exif(picture: Picture) -> bytes:
    """The picture's EXIF, telling its present size."""
    return _exif_of(picture).tobytes() if picture.exif else b""


def _write_tiff(temporary: Path, picture: Picture) -> None:
    import tifffile

    exif = _exif_of(picture)
    extra: list[tuple[int, int | str, int, Any, bool]] = []
    for code in TIFF_TEXTS:
        if isinstance(text := exif.get(code), str):
            extra.append((code, "s", 0, text.encode(), True))
    if picture.xmp:
        extra.append((700, "B", len(picture.xmp), picture.xmp, True))
    directories = {code: exif.get_ifd(code) for code in (EXIF_IFD, GPS_IFD) if exif.get_ifd(code)}
    channels = picture.pixels.shape[2]
    tifffile.imwrite(
        temporary,
        picture.pixels if channels > 1 else picture.pixels[..., 0],
        photometric="rgb" if channels >= 3 else "minisblack",
        planarconfig="contig" if channels > 1 else None,
        extrasamples=["assocalpha" if picture.premultiplied else "unassalpha"] if picture.has_alpha else None,
        compression="zlib",
        compressionargs={"level": PNG_LEVEL},
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
        _append_directories(temporary, directories)


def _append_directories(temporary: Path, directories: Mapping[int, Mapping[int, Any]]) -> None:
    """Put EXIF's own directories at the end of a TIFF, and a first directory that knows them (TIFF 6.0, section 2).

    tifffile writes no directories but those of images.
    """
    from PIL.TiffImagePlugin import ImageFileDirectory_v2

    with temporary.open("r+b") as stream:
        mark, start = struct.unpack("<4sI", stream.read(8))
        if mark != b"II*\0":  # a BigTIFF of 4 GB goes without
            return
        stream.seek(start)
        (count,) = struct.unpack("<H", stream.read(2))
        entries = [stream.read(12) for _ in range(count)]
        for code, values in directories.items():
            directory = ImageFileDirectory_v2(group=code)
            for tag, value in values.items():
                directory[tag] = value
            end = stream.seek(0, os.SEEK_END)
            stream.write(directory.tobytes(end))
            entries.append(struct.pack("<HHII", code, 4, 1, end))
        end = stream.seek(0, os.SEEK_END)
        entries.sort(key=lambda entry: struct.unpack("<H", entry[:2]))
        stream.write(struct.pack("<H", len(entries)) + b"".join(entries) + struct.pack("<I", 0))
        stream.seek(4)
        stream.write(struct.pack("<I", end))


def _write_exr(temporary: Path, picture: Picture) -> None:
    pixels = picture.pixels
    if pixels.shape[2] == 2:  # luminance with alpha is allowed, and misread by ffmpeg
        pixels = pixels[..., [0, 0, 0, 1]]
    names = {1: "Y", 3: "RGB", 4: "RGBA"}[pixels.shape[2]]
    if picture.has_alpha and not picture.premultiplied:  # OpenEXR's convention
        with np.errstate(all="ignore"):
            pixels = np.concatenate([pixels[..., :-1] * pixels[..., -1:], pixels[..., -1:]], axis=2)
    attributes: dict[str, Any] = {**picture.texts, **picture.attributes}
    if picture.chromaticities:
        attributes["chromaticities"] = picture.chromaticities
    write_exr(temporary, {name: pixels[..., index] for index, name in enumerate(names)}, attributes)


def write_exr(
    temporary: Path, channels: Mapping[str, np.ndarray], attributes: Mapping[str, Any], overscan: int = 0
) -> None:
    """Write float32 channels (h, w) by name; `overscan` pixels on each side lie outside the display window."""
    import OpenEXR

    height, width = next(iter(channels.values())).shape

    def window(left: int, top: int, right: int, bottom: int) -> tuple[np.ndarray, np.ndarray]:
        return np.array([left, top], np.int32), np.array([right, bottom], np.int32)

    header = {
        **attributes,
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "displayWindow": window(0, 0, width - 2 * overscan - 1, height - 2 * overscan - 1),
        "dataWindow": window(-overscan, -overscan, width - overscan - 1, height - overscan - 1),
    }
    planes = {name: np.ascontiguousarray(plane, np.float32) for name, plane in channels.items()}
    with temporary.open("wb") as stream:  # given a name OpenEXR writes to a full disk without a word
        OpenEXR.File(header, planes).write(stream)

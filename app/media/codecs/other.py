"""Kinds that are read only, through Pillow; some of them, as TGA, have no signature."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from app.errors import UserError
from app.media.codecs.decoding import start_of
from app.media.codecs.tiff import plain_depth
from app.media.depth import spread
from app.media.inputs import check_size
from app.media.losses import lost, not_kept
from app.model.picture import Picture

GAP = rb"(?:\s|#[^\n\r]*+)++"  # possessive: each way to split a comment into comments would be tried otherwise
DEEPEST = rb"P[36]" + GAP + rb"\d++" + GAP + rb"\d++" + GAP + rb"(\d{1,5})"  # of a PPM's header (ppm(5))

PILLOW = {"JPEG 2000": "JPEG2000", "PBM": "PPM", "PGM": "PPM", "PNM": "PPM"}  # its names, where they are others
KINDS = {"DDS", "ICO", "JPEG2000", "PPM", "PCX", "QOI", "SGI", "TGA"}
JPEG_2000_BOXES = (b"jP  ", b"ftyp", b"jp2c", b"ihdr", b"bpcc", b"pclr", b"cmap", b"cdef")
MOST_BOXES = 1000  # that are looked at
BC6 = (94, 95, 96)  # of DXGI_FORMAT, blocks of floats


def read(name: str, file: Path, max_pixels: int) -> Picture:
    """Read the first picture of a file; `name` is what messages call its kind."""
    from PIL import Image

    Image.MAX_IMAGE_PIXELS = None  # ours is in check_size, and can be raised for a file
    if (deepest := re.match(DEEPEST, start_of(file))) and int(deepest[1]) > 255:
        # it would be read as 8 bits without a word
        raise UserError(f"Cannot read {file}: a {name} of 16-bit colours is not supported; convert it to PNG or TIFF.")
    own = PILLOW.get(name, name)
    # its own kind is tried first: a TGA with a text of ten letters begins as a PCX does
    with Image.open(file, formats=[own, *sorted(KINDS - {own})]) as image:
        check_size(file, *image.size, max_pixels)
        further = _after_netpbm(image, file)
        pixels = np.asarray(image.convert(image.palette.mode) if image.mode == "P" and image.palette else image)
    if pixels.dtype == np.int32:  # Pillow's mode for 16-bit grey
        pixels = np.clip(pixels, 0, 65535).astype(np.uint16)
    if name == "JPEG 2000" and pixels.ndim == 2 and (bits := _depth(file)[1]) < (most := 8 * pixels.dtype.itemsize):
        pixels = spread(pixels >> most - bits, bits, most)  # Pillow puts zeros behind, so that white would be grey
    losses = further + (_LOSSES[name](file) if name in _LOSSES else [])
    return Picture(plain_depth(file, pixels if pixels.ndim == 3 else pixels[..., None]), note=lost(file, losses))


def _after_netpbm(image: Any, file: Path) -> list[str]:
    """What follows the pixels of a binary PBM, PGM or PPM: further pictures, as a rule (pbm(5))."""
    kind = start_of(file)[:2]
    if image.format != "PPM" or kind not in (b"P4", b"P5", b"P6") or not image.tile:
        return []
    width, height = image.size
    told = re.match(rb"P[56]" + GAP + rb"\d++" + GAP + rb"\d++" + GAP + rb"(\d{1,5})", start_of(file))
    size = 2 if told and int(told[1]) > 255 else 1
    row = -(-width // 8) if kind == b"P4" else width * size * (3 if kind == b"P6" else 1)
    rest = file.stat().st_size - image.tile[0].offset - row * height
    return [f"the {rest} bytes after its first picture are not kept"] if rest > len(b"\r\n") else []


def _of_jpeg_2000(file: Path) -> list[str]:
    """What a JPEG 2000 has beside its pixels, and how deep they are (ITU-T T.800, A.5.1 and I.4)."""
    losses = [not_kept("box", names)] if (names := list(dict.fromkeys(_boxes(file)))) else []
    components, bits = _depth(file)
    return losses + ([f"its {bits} bits a channel become 8"] if bits > 8 and components > 1 else [])


def _depth(file: Path) -> tuple[int, int]:
    """How many components a JPEG 2000 has, and the bits of the first; 1 of 16 where it does not tell."""
    start = start_of(file)
    at = start.find(b"\xff\x4f\xff\x51")  # the start of the codestream, and of what it says of its size
    if not 0 <= at < len(start) - 42:
        return 1, 16
    return int.from_bytes(start[at + 40 : at + 42], "big"), (start[at + 42] & 0x7F) + 1


def _boxes(file: Path, within: tuple[int, int] | None = None) -> Iterator[str]:
    """The names of the boxes of a JPEG 2000 file that are not understood; the one that has a profile is such a one."""
    at, end = within or (0, file.stat().st_size)
    with file.open("rb") as stream:
        if within is None and stream.read(4) == b"\xff\x4f\xff\x51":
            return  # a codestream alone
        for _ in range(MOST_BOXES):
            if at + 8 > end:
                return
            stream.seek(at)
            length, kind, large = struct.unpack(">I4sQ", stream.read(16).ljust(16, b"\0"))
            head, length = (16, large) if length == 1 else (8, length or end - at)
            if kind == b"jp2h" and within is None:
                yield from _boxes(file, (at + head, min(at + length, end)))
            elif kind == b"colr":
                stream.seek(at + head)
                yield from ["colr (a colour profile)"] * (stream.read(1) == b"\x02")
            elif kind not in JPEG_2000_BOXES:
                yield kind.decode("latin-1")
            at += max(length, 8)


def _of_sgi(file: Path) -> list[str]:
    return ["its 16 bits a channel become 8"] * (start_of(file)[3] == 2)


def _of_tga(file: Path) -> list[str]:
    """A TGA's text is before its pixels; what it says more of itself follows them."""
    with file.open("rb") as stream:
        length = stream.read(1)
        stream.seek(max(0, file.stat().st_size - 26))
        places = struct.unpack("<II18s", stream.read(26).ljust(26, b"\0"))
    parts = ["text"] * (length != b"\0") + ["extension"] * (places[0] > 0 and places[2].startswith(b"TRUEVISION-XFILE"))
    return [f"its {part} is not kept" for part in parts]


def _of_ico(file: Path) -> list[str]:
    count = int.from_bytes(start_of(file)[4:6], "little")
    return [f"of its {count} pictures only the largest is used"] if count > 1 else []


def _of_dds(file: Path) -> list[str]:
    start = start_of(file)
    is_float = start[84:88] == b"DX10" and int.from_bytes(start[128:132], "little") in BC6
    return ["its floats become 8 bits a channel"] if is_float else []


_LOSSES = {"JPEG 2000": _of_jpeg_2000, "SGI": _of_sgi, "TGA": _of_tga, "ICO": _of_ico, "DDS": _of_dds}

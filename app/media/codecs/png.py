"""PNG (ISO/IEC 15948): 16 bits by libpng, and every chunk that says what the colours mean."""

from __future__ import annotations

import io
import os
import struct
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from app.errors import UserError
from app.media.codecs import ZLIB_LEVEL, pillow
from app.media.codecs.decoding import quiet
from app.media.codecs.metadata import sized_exif
from app.media.losses import REC709, counted, few, not_kept, unusual_colours
from app.model.picture import Picture

UNKEPT_CHUNKS = {b"bKGD": "background colour", b"sBIT": "number of significant bits"}
LIGHT_CHUNKS = {b"mDCV": "mastering display (mDCV)", b"cLLI": "light levels (cLLI)"}  # which say nothing of the values
COLOUR_CHUNKS = {b"cICP": 4, b"gAMA": 4, b"cHRM": 32, b"sRGB": 1, b"mDCV": 24, b"cLLI": 8}  # and their lengths
TEXT_CHUNKS = (b"tEXt", b"zTXt", b"iTXt")
LONGEST_KEYWORD = 79
XMP_NAME = "XML:com.adobe.xmp"
EMPTY = {b"tEXt": range(2), b"zTXt": range(10, 11), b"iTXt": range(5, 14)}  # bytes after the name of a text of nothing
MOST_CHUNKS = 500_000  # of a file: those of an animation are two or more a frame
MOST_HEADER = 300  # bytes that a text's name, compression and language are looked for in
# What is kept otherwise, is made anew (tIME, iDOT, hIST), or is of frames that are told themselves.
UNDERSTOOD = {
    b"IHDR", b"PLTE", b"IDAT", b"tRNS", b"iCCP", b"pHYs", b"eXIf", b"tIME", b"acTL", b"fcTL", b"fdAT", b"iDOT", b"hIST",
}  # fmt: skip
METRE, MOST_DOTS = 0.0254, 2**31 - 1  # dots an inch for one a metre, of which there are whole ones, and how many
USUAL_GAMMA = range(45000, 46000)  # 1 / 2.2, as sRGB has it on the whole


def read(file: Path, max_pixels: int) -> Picture:
    """Read a PNG in its depth."""
    _check_chunks(file)
    with pillow.opened("PNG", file, max_pixels) as image:
        chunks, unkept = _chunks(file, image)
        colours = unusual(chunks, image.info.get("icc_profile") is not None)
        losses = [f"its colours are mixed as if sRGB, in spite of its {' and '.join(colours)}"] if colours else []
        losses += unkept
        shape = image.info.get("aspect", (1, 1))
        if shape[0] != shape[1] and all(shape):  # with a 0 ffmpeg says that it is not known
            losses.append(f"the shape of its pixels ({shape[0]}:{shape[1]}) is not kept")
        pixels, bits = None, _bits(file)
        spread_key(image, bits)
        if bits == 16:
            import imagecodecs

            with quiet():
                pixels = imagecodecs.png_decode(file.read_bytes())  # Pillow gives 8 bits of 16 without a word
        return replace(pillow.picture_of(image, file, losses, pixels), chunks=chunks)


def _check_chunks(file: Path) -> None:
    """Raise `UserError` of a file with more chunks than can be looked at in some seconds."""
    with file.open("rb") as stream:
        stream.seek(8)
        for _ in range(MOST_CHUNKS):
            head = stream.read(8)
            if len(head) < 8 or head[4:] == b"IEND":
                return
            stream.seek(int.from_bytes(head[:4], "big") + 4, os.SEEK_CUR)
    raise UserError(f"Cannot read {file}: it has more than {MOST_CHUNKS} chunks; save it anew with another program.")


def spread_key(image: Any, bits: int) -> None:
    """Give a grey picture its transparent grey in 8 bits: Pillow spreads the pixels, and not their key."""
    if image.mode == "L" and bits in (2, 4) and isinstance(key := image.info.get("transparency"), int):
        image.info["transparency"] = key * 255 // (2**bits - 1)


def _bits(file: Path) -> int:
    with file.open("rb") as stream:
        return stream.read(25)[24]


def _chunks(file: Path, image: Any) -> tuple[dict[bytes, bytes], list[str]]:
    """The chunks of a PNG that say what its colours mean, and in words what of the others is not kept of `image`."""
    found: dict[bytes, bytes] = {}
    unkept: dict[str, None] = {}
    unknown: dict[str, None] = {}
    texts, damaged, translated, profiles = list[str](), list[str](), list[str](), 0
    with file.open("rb") as stream:
        stream.seek(8)
        while len(head := stream.read(8)) == 8 and (kind := head[4:]) != b"IEND":
            length = int.from_bytes(head[:4], "big")
            end = stream.tell() + length + 4
            profiles += kind == b"iCCP"
            if kind in UNKEPT_CHUNKS and not (kind == b"sBIT" and _are_all(stream.read(length), image, file)):
                unkept[UNKEPT_CHUNKS[kind]] = None
            if COLOUR_CHUNKS.get(kind) == length:
                found[kind] = stream.read(length)
            elif kind in TEXT_CHUNKS:
                key, _, rest = stream.read(min(length, MOST_HEADER)).partition(b"\0")
                texts.append(key.decode("latin-1"))
                if not _is_read(kind, texts[-1], length - len(key), image):
                    damaged.append(texts[-1] or "without a name")
                if kind == b"iTXt" and rest[2:4] != b"\0\0":  # how it is compressed, its language, its name in that
                    translated.append(texts[-1])
            elif kind not in UNKEPT_CHUNKS and kind not in UNDERSTOOD:
                unknown[kind.decode("latin-1")] = None
            stream.seek(end)
        rest = file.stat().st_size - (stream.tell() + 4)  # the end has no contents, and a sum of four bytes
    losses = [f"what it says of its {', '.join(unkept)} is not kept"] if unkept else []
    losses += [not_kept("chunk", list(unknown))] if unknown else []
    profile = image.info.get("icc_profile") or b""
    if profiles and len(profile) < int.from_bytes(profile[:4] or b"\1", "big"):  # as it says itself (ICC.1, 7.2.2)
        losses.append("its colour profile is damaged and not kept whole")
    elif profiles > 1:
        losses.append(f"of its {profiles} colour profiles only the last is kept")
    if repeated := [text for text, count in Counter(texts).items() if count > 1]:
        losses.append(f"of several texts under one name only the last is kept: {few(repeated)}")
    if damaged:
        losses.append(not_kept("damaged text", damaged))
    if translated:
        losses.append(f"the language of its {counted('text', translated)} is not kept")
    if rest > 0:
        losses.append(f"the {rest} bytes after its end are not kept")
    return found, losses


def _is_read(kind: bytes, text: str, length: int, image: Any) -> bool:
    """Whether Pillow has read a text of a PNG, which has so many bytes after its name."""
    if text == XMP_NAME:
        return bool(image.info.get("xmp"))
    return bool(text) and (bool(image.text.get(text)) or (text in image.text and length in EMPTY[kind]))


def _are_all(significant: bytes, image: Any, file: Path) -> bool:
    """Whether sBIT names as many bits as there are."""
    return min(significant, default=0) >= (8 if image.mode == "P" else _bits(file))


def coded(primaries: int, transfer: int) -> dict[bytes, bytes]:
    """The chunk that tells what the colours of RGB are, by the codes of H.273 (11.3.2.6)."""
    return {b"cICP": bytes([primaries, transfer, 0, 1])} if max(primaries, transfer) < 256 else {}


def unusual(chunks: Mapping[bytes, bytes], has_profile: bool) -> list[str]:
    """What a PNG's chunks tell of its colours, and we do not understand, in words."""
    if codes := chunks.get(b"cICP"):
        told = [unusual_colours(codes[0], codes[1]), "" if codes[3] else "narrow range"]
        return [f"{' '.join(filter(None, told))} (cICP)"] if any(told) else []
    if has_profile or b"sRGB" in chunks:
        return []
    found = []
    if b"gAMA" in chunks and (value := int.from_bytes(chunks[b"gAMA"], "big")) not in USUAL_GAMMA:
        found.append(f"gamma of {value / 100000:g} (gAMA)")
    if b"cHRM" in chunks:
        x_y = np.frombuffer(chunks[b"cHRM"], ">u4") / 100000
        if not np.allclose(np.roll(x_y, -2), REC709, atol=2e-3):
            found.append("primaries (cHRM)")
    return found


def light(chunks: Mapping[bytes, bytes]) -> list[str]:
    """What a PNG's chunks tell of how bright its light was meant to be shown, in words."""
    return [words for kind, words in LIGHT_CHUNKS.items() if kind in chunks]


def unheld_xmp(picture: Picture) -> list[str]:
    """XMP that is no UTF-8, as a PNG's has to be (11.3.3.4)."""
    with suppress(UnicodeDecodeError):
        (picture.xmp or b"").decode()
        return []
    return ["XMP"]


def unheld_texts(picture: Picture) -> list[str]:
    """The names of texts that a PNG cannot have, and that are changed."""
    return [key for key in picture.texts if _keyword(key).decode("latin-1") != key]


def _keyword(name: str) -> bytes:
    """A text's name as a PNG can have it (11.3.3.2)."""
    return name.encode("latin-1", "replace")[:LONGEST_KEYWORD]


def write(path: Path, picture: Picture, quality: int) -> None:
    """Write a PNG in 8 or 16 bits."""
    import zlib

    import imagecodecs
    from PIL.PngImagePlugin import PngInfo, putchunk

    pixels = np.ascontiguousarray(picture.pixels)
    # What is narrow and noisy grows: by a byte a row, and by an eighth where zlib has a small window for it.
    filtered = pixels.nbytes + picture.height
    most = filtered + filtered // 64 + 4096
    # a view, so that its parts are no copies: of a large picture each would take a hundred megabytes
    pixels = pixels if pixels.shape[2] > 1 else pixels[..., 0]
    encoded = memoryview(imagecodecs.png_encode(pixels, level=ZLIB_LEVEL, out=most))
    extra = PngInfo()
    for kind, data in picture.chunks.items():
        extra.add(kind, data)
    if picture.icc:
        extra.add(b"iCCP", b"ICC Profile\0\0" + zlib.compress(picture.icc))
    if picture.dpi:
        extra.add(b"pHYs", struct.pack(">IIB", *_dots_a_metre(picture.dpi), 1))
    if picture.exif:
        extra.add(b"eXIf", sized_exif(picture).removeprefix(b"Exif\0\0"))
    if picture.xmp and not unheld_xmp(picture):
        extra.add_itxt(XMP_NAME, picture.xmp.decode())
    for key, text in picture.texts.items():
        extra.add_itxt(_keyword(key), text)
    chunks = io.BytesIO()
    for kind, data, _ in extra.chunks:
        putchunk(chunks, kind, data)
    header = 8 + 25  # the signature and IHDR, after which all of these may stand
    path.write_bytes(b"".join([encoded[:header], chunks.getvalue(), encoded[header:]]))


def held_dpi(dpi: tuple[float, float]) -> tuple[float, float]:
    """Dots an inch along x and y as a PNG tells them that is written of a picture with so many."""
    x, y = _dots_a_metre(dpi)
    return x * METRE, y * METRE


def _dots_a_metre(dpi: tuple[float, float]) -> tuple[int, int]:
    x, y = (min(max(round(value / METRE), 1), MOST_DOTS) for value in dpi)
    return x, y

"""GIF (GIF87a and 89a): a still, and the frames of an animation, laid over one another as browsers do it.

What no frame covers, or one clears, is transparent. Pillow gives some of it the file's background colour, and lets a
frame that does not say what becomes of it fare as the one before it.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from itertools import islice
from pathlib import Path

import numpy as np

from app.media.codecs import pillow
from app.media.codecs.layered import BACKGROUND, MOST_FRAMES, NONE, PREVIOUS, Animation, Frame, bounded
from app.media.inputs import read_start
from app.model.picture import Picture

CONTROL, IMAGE, EXTENSION, END = 0xF9, 0x2C, 0x21, 0x3B
BLOCK = re.compile(b"[!,;]")  # what starts one
MOST_EXTENSIONS = 500_000  # of a file: an animation has one a frame
HEAD = 13  # bytes of the header and the screen


def read(file: Path, max_pixels: int) -> Picture:
    """The first frame of a GIF."""
    with pillow.opened("GIF", file, max_pixels) as image:
        left, top, right, bottom = image.tile[0][1]
        losses, count = unkept(read_start(file, "picture", HEAD)), _count(file.read_bytes())
        if (left, top, right, bottom) == (0, 0, *image.size):
            return pillow.picture_of(image, file, losses, count=count)
        pixels = np.zeros((image.height, image.width, 4), np.uint8)
        place = slice(top, bottom), slice(left, right)
        pixels[place] = np.asarray(image.convert("RGBA"))[place]
        return pillow.picture_of(image, file, losses, pixels, count)


def _count(data: bytes) -> int:
    """How many frames there are, or one more than are read; 1 where those after the first are damaged."""
    with suppress(IndexError, struct.error):
        return sum(1 for _ in islice(_frames(data, HEAD + len(_table(data, HEAD, data[10])), b""), MOST_FRAMES + 1))
    return 1


def unkept(head: bytes) -> list[str]:
    """What the start of a file says that is not kept, in words: the shape of its pixels, width by height."""
    aspect = Fraction(head[12] + 15, 64) if len(head) >= HEAD and head[12] else Fraction(1)
    return [] if aspect == 1 else [f"the shape of its pixels ({float(aspect):g}:1) is not kept"]


def frames(data: bytes, loop: int | None) -> Animation | None:
    """What is in a file; None if it is no animation. Raises `ValueError` if it is damaged.

    loop: how often the file says that it begins again, 0 for ever; None if it does not say.
    """
    try:
        table = _table(data, HEAD, data[10])
        found = bounded(_frames(data, HEAD + len(table), table))
        width, height = struct.unpack_from("<HH", data, 6)
    except (IndexError, struct.error):
        raise ValueError("a frame of it is cut") from None
    if len(found) < 2:
        return None
    size = max(width, found[0].x + found[0].width), max(height, found[0].y + found[0].height)
    return Animation(size, [_within(frame, size) for frame in found], 1 if loop is None else loop + 1 if loop else 0)


def _within(frame: Frame, size: tuple[int, int]) -> Frame:
    """A frame without what of it is beyond the picture."""
    width = max(0, min(frame.width, size[0] - frame.x))
    height = max(0, min(frame.height, size[1] - frame.y))
    return frame if (width, height) == (frame.width, frame.height) else replace(frame, width=width, height=height)


def _table(data: bytes, at: int, flags: int) -> bytes:
    """The table of colours that stands there, if the flags say so."""
    return data[at : at + 3 * 2 ** ((flags & 7) + 1)] if flags & 0x80 else b""


def _frames(data: bytes, at: int, common: bytes) -> Iterator[Frame]:
    """The frames from a place on; those without a table of their own have the common one."""
    control, kinds, extensions = bytes(4), {2: BACKGROUND, 3: PREVIOUS}, 0
    while at < len(data) and data[at] != END:
        if data[at] == EXTENSION:
            extensions += 1
            if extensions > MOST_EXTENSIONS:
                raise ValueError(f"it has more than {MOST_EXTENSIONS} blocks that are no picture")
            if data[at + 1] == CONTROL:
                control = data[at + 3 : at + 7]
            at = _after_blocks(data, at + 2)
        elif data[at] == IMAGE:
            x, y, width, height, flags = struct.unpack_from("<HHHHB", data, at + 1)
            table = _table(data, at + 10, flags)
            end = _after_blocks(data, at + 11 + len(table))
            has_key, disposal = bool(control[0] & 1), kinds.get(control[0] >> 2 & 7, NONE)
            seconds = Fraction(int.from_bytes(control[1:3], "little"), 100)
            pieces = (
                struct.pack("<6sHHBBB", data[:6], width, height, data[10], 0, 0),
                common,
                bytes([EXTENSION, CONTROL, 4, has_key, 0, 0, control[3], 0]),
                struct.pack("<BHHHHB", IMAGE, 0, 0, width, height, flags),
                data[at + 10 : end],
                bytes([END]),
            )
            yield Frame(x, y, width, height, seconds, disposal, True, pieces, not has_key, width * height)
            at, control = end, bytes(4)
        else:  # between blocks Pillow passes over what is none
            found = BLOCK.search(data, at)
            at = len(data) if found is None else found.start()


def _after_blocks(data: bytes, at: int) -> int:
    while data[at]:
        at += data[at] + 1
    return at + 1

"""The frames of a GIF (GIF89a) that clear what they have drawn though the first of them is opaque.

Of these Pillow's picture has no alpha, and what is cleared gets the colour whose number means transparent.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction

from app.media.codecs.layered import BACKGROUND, NONE, PREVIOUS, Animation, Frame

CONTROL, IMAGE, EXTENSION, END = 0xF9, 0x2C, 0x21, 0x3B
HEAD = 13  # bytes of the header and the screen


def read(data: bytes) -> Animation | None:
    """What is in such a file; None of any other, which Pillow reads rightly, or that is damaged."""
    try:
        size: tuple[int, int] = struct.unpack_from("<HH", data, 6)
        table = _table(data, HEAD, data[10])
        frames = list(_frames(data, HEAD + len(table), data[:10] + data[10:HEAD] + table))
    except (IndexError, struct.error):
        return None
    if not frames or (frames[0].x, frames[0].y, frames[0].width, frames[0].height) != (0, 0, *size):
        return None
    clears = [frame.disposal == BACKGROUND and frame.is_over for frame in frames[:-1]]
    is_beyond = any(frame.x + frame.width > size[0] or frame.y + frame.height > size[1] for frame in frames)
    return None if frames[0].is_over or is_beyond or not any(clears) else Animation(size, frames, 0)


def frames_of(data: bytes) -> list[Frame]:
    """The frames as far as the file is whole; a colour of those that are `is_over` is seen through."""
    found = list[Frame]()
    with suppress(IndexError, struct.error):
        head = data[: HEAD + len(_table(data, HEAD, data[10]))]
        for frame in _frames(data, len(head), head):
            found.append(replace(frame, file=b""))
    return found


def _table(data: bytes, at: int, flags: int) -> bytes:
    """The table of colours that stands there, if the flags say so."""
    return data[at : at + 3 * 2 ** ((flags & 7) + 1)] if flags & 0x80 else b""


def _frames(data: bytes, at: int, head: bytes) -> Iterator[Frame]:
    control = bytes(4)
    while at < len(data) and data[at] != END:
        if data[at] not in (IMAGE, EXTENSION):  # between blocks Pillow passes over what is none
            at += 1
            continue
        if data[at] == EXTENSION:
            if data[at + 1] == CONTROL:
                control = data[at + 3 : at + 7]
            at = _after_blocks(data, at + 2)
            continue
        x, y, width, height, flags = struct.unpack_from("<HHHHB", data, at + 1)
        table = _table(data, at + 10, flags)
        end = _after_blocks(data, at + 11 + len(table))
        screen = head[:6] + struct.pack("<HH", width, height) + head[10:]
        own = struct.pack("<BHHHHB", IMAGE, 0, 0, width, height, flags)
        has_key, disposal = control[0] & 1, control[0] >> 2 & 7
        file = screen + bytes([EXTENSION, CONTROL, 4, control[0] & 1, 0, 0, control[3], 0]) + own + data[at + 10 : end]
        kinds = {2: BACKGROUND, 3: PREVIOUS}
        seconds = Fraction(int.from_bytes(control[1:3], "little"), 100)
        yield Frame(x, y, width, height, seconds, kinds.get(disposal, NONE), bool(has_key), file + b";")
        at, control = end, bytes(4)


def _after_blocks(data: bytes, at: int) -> int:
    while data[at]:
        at += data[at] + 1
    return at + 1

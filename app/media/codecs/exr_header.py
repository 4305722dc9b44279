"""Attributes of an EXR that OpenEXR's Python module reads and does not write, such as rational: byte for byte."""

from __future__ import annotations

import mmap
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

MULTIPART = 0x1000  # of the version's flags
MOST_TEXT = 64 * 2**20  # bytes of an attribute
PLACE = "~room"
LONG = 32  # letters, from which on the file must say that it has long names


@dataclass(frozen=True)
class Raw:
    """The value of an attribute as it is in the file."""

    kind: str
    data: bytes


def raw_attributes(file: Path) -> list[dict[str, Raw]]:
    """All attributes of each part of an EXR, by name; raises `ValueError` where the file is damaged.

    The layout is that of "OpenEXR File Layout": a magic number, a version, and headers of name, type, size and value.
    """
    with file.open("rb") as stream:
        _, version = struct.unpack("<II", stream.read(8))
        headers = [dict(_header(stream))]
        while version & MULTIPART and (further := dict(_header(stream))):
            headers.append(further)
        return headers


def _header(stream: BinaryIO) -> Iterator[tuple[str, Raw]]:
    while name := _text(stream):
        kind = _text(stream)
        (size,) = struct.unpack("<i", stream.read(4))
        if not 0 <= size <= MOST_TEXT or len(data := stream.read(size)) < size:
            raise ValueError(f"its attribute of {size} bytes is cut")
        yield name, Raw(kind, data)


def _text(stream: BinaryIO) -> str:
    letters = bytearray()
    while (letter := stream.read(1)) not in (b"", b"\0"):
        letters += letter
        if len(letters) > 255:
            raise ValueError("a name in its header is too long")
    return letters.decode("utf-8", "surrogateescape")


def _encoded(attributes: Mapping[str, Raw]) -> bytes:
    def text(value: str) -> bytes:
        return value.encode("utf-8", "surrogateescape") + b"\0"

    return b"".join(
        text(name) + text(raw.kind) + struct.pack("<i", len(raw.data)) + raw.data for name, raw in attributes.items()
    )


def room_for(attributes: Mapping[str, Raw]) -> dict[str, str]:
    """A text as an attribute that takes as many bytes as `attributes` do, to be replaced by them once it is written."""
    name = PLACE.ljust(LONG, "~") if any(len(name) >= LONG for name in attributes) else PLACE
    room = len(_encoded(attributes)) - len(_encoded({name: Raw("string", b"")}))
    return {name: "X" * room} if room >= 0 else {}


def fill_rooms(file: Path, parts: Sequence[Mapping[str, Raw]]) -> None:
    """Put the attributes of each part where `room_for` has kept room in the header."""
    with file.open("r+b") as stream, mmap.mmap(stream.fileno(), 0) as data:
        at = 0
        for attributes in filter(room_for, parts):
            new = _encoded(attributes)
            at = data.find(PLACE.encode(), at)
            data[at : at + len(new)] = new
            at += len(new)

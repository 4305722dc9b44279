"""A reader of uncompressed EXR files by the letter of "OpenEXR File Layout", which shares nothing with the library."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np

TYPES = {0: np.dtype("<u4"), 1: np.dtype("<f2"), 2: np.dtype("<f4")}


@dataclass
class Part:
    """attributes: (type, bytes) by name. channels: (h, w) by name, filling the data window."""

    attributes: dict[str, tuple[str, bytes]]
    channels: dict[str, np.ndarray]

    def window(self, name: str) -> tuple[int, ...]:
        return struct.unpack("<4i", self.attributes[name][1])


class _Bytes:
    def __init__(self, data: bytes) -> None:
        self.data, self.at = data, 0

    def take(self, count: int) -> bytes:
        self.at += count
        return self.data[self.at - count : self.at]

    def number(self) -> int:
        return struct.unpack("<i", self.take(4))[0]

    def text(self) -> str:
        end = self.data.index(b"\0", self.at)
        return self.take(end + 1 - self.at)[:-1].decode()


def read_exr(path: Path) -> list[Part]:
    """The parts of an uncompressed file of scan lines."""
    data = _Bytes(path.read_bytes())
    assert data.number() == 20000630
    version = data.number()
    assert version & 0xFF == 2
    is_multipart = bool(version & 0x1000)
    parts = []
    while not parts or is_multipart:
        attributes = {}
        while name := data.text():
            assert len(name) < 32 or version & 0x400  # a file with long names says so
            kind = data.text()
            attributes[name] = kind, data.take(data.number())
        if not attributes:
            break
        parts.append(Part(attributes, {}))
    lines = 0
    for part in parts:
        assert part.attributes["compression"][1] == b"\0"
        left, top, right, bottom = part.window("dataWindow")
        listed = _Bytes(part.attributes["channels"][1])
        while name := listed.text():
            kind = TYPES[listed.number()]
            listed.take(12)
            part.channels[name] = np.zeros((bottom - top + 1, right - left + 1), kind)
        data.take(8 * (bottom - top + 1))  # where each line begins, which is where the last one ends
        lines += bottom - top + 1
    for _ in range(lines):
        part = parts[data.number() if is_multipart else 0]
        row = data.number() - part.window("dataWindow")[1]
        line = _Bytes(data.take(data.number()))
        for plane in part.channels.values():
            plane[row] = np.frombuffer(line.take(plane[row].nbytes), plane.dtype)
    assert data.at == len(data.data)
    return parts

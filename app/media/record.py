"""For `--resume`: what the files of a sequence were made of, kept beside them, so that none is made twice."""

from __future__ import annotations

import errno
import hashlib
import os
import stat
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from app.errors import UserError
from app.media.files import cannot_write
from app.media.inputs import open_input, read_input
from app.media.numbered import numbered

ONLY_A_FILE = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)  # no link, and no pipe that nobody reads
NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
MOST = 256 * 2**20  # bytes of a record: two million frames


class Record:
    """A line for each file of a sequence that was written: its number, what it was made of, a digest of it, its bytes.

    It is a hidden file in the folder of the sequence. Each line is appended in one piece, so that several tasks can
    write to it at a time; one that is damaged means no more than that its file is made again.

    Args:
        pattern: of the sequence, such as `name.%04d.png`.
        made_of: a digest of all that a file is made of, by its number.

    Raises:
        UserError: if something else is at its place, as a link, which is not followed.
    """

    def __init__(self, pattern: Path, made_of: Callable[[int], str]) -> None:
        self._pattern = pattern
        self._made_of = made_of
        name = hashlib.sha256(numbered(pattern, 0).name.encode("utf-8", "surrogateescape")).hexdigest()[:16]
        self._path = pattern.parent / f".fluidwarp-frames-{name}"
        self._lines: dict[int, str] | None = None
        with suppress(FileNotFoundError):
            self._check(os.lstat(self._path))

    def _check(self, status: os.stat_result) -> None:
        if not stat.S_ISREG(status.st_mode):
            what = "a link" if stat.S_ISLNK(status.st_mode) else "no ordinary file"
            raise UserError(f"Cannot write {self._path}: it is {what}; remove it, or write to another folder.")

    def holds(self, number: int) -> bool:
        """Whether the file of this number is there, byte for byte as it was made of what it would be made of now."""
        if self._lines is None:
            self._lines = dict(self._read())
        line = self._lines.get(number, "")
        with suppress(OSError, UserError):
            # A file of another size is not read: it may be one without end.
            file = numbered(self._pattern, number)
            return _size(file) == line.rpartition(" ")[2] and line == self._line(number, file)
        return False

    def add(self, number: int, file: Path) -> None:
        """Note that the file of this number is written, which is still `file`: another task may write it, too.

        Raises `UserError`.
        """
        try:
            line = f"{number} {self._line(number, file)}\n".encode()
            record = os.open(self._path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | ONLY_A_FILE, 0o666)
            try:
                self._check(os.fstat(record))
                # a line that was cut by a full disk or a kill ends here
                os.write(record, line if self._ends_whole() else b"\n" + line)
            finally:
                os.close(record)
        except OSError as error:
            # What is in the record's place is told by its name; where there is no room, nobody has heard of that.
            raise cannot_write(self._pattern if error.errno in NO_ROOM else self._path, error) from error

    def _line(self, number: int, file: Path) -> str:
        return f"{self._made_of(number)} {digest_of_file(file)} {_size(file)}"

    def _ends_whole(self) -> bool:
        with self._path.open("rb") as stream:
            if not stream.seek(0, os.SEEK_END):
                return True
            stream.seek(-1, os.SEEK_END)
            return stream.read(1) == b"\n"

    def _read(self) -> Iterable[tuple[int, str]]:
        if not self._path.exists():
            return
        if self._path.stat().st_size > MOST:
            raise UserError(f"Cannot read {self._path}: it has more than {MOST >> 20} MB; remove it.")
        for line in read_input(self._path, "record", MOST).decode("ascii", "replace").splitlines():
            number, _, made_of = line.partition(" ")
            if number.isdecimal() and len(number) < 19:
                yield int(number), made_of


def _size(file: Path) -> str:
    return str(os.stat(file).st_size)


def digest_of_file(path: Path) -> str:
    """A digest of the bytes of a file. Raises `UserError` or `OSError`."""
    digest = hashlib.sha256()
    with open_input(path) as stream:
        while block := stream.read(2**20):
            digest.update(block)
    return digest.hexdigest()


def digest_of(*parts: Any) -> str:
    """A digest of values: arrays by their elements, what has parts by these, all else by how it is shown."""
    digest = hashlib.sha256()
    for part in parts:
        digest.update(_bytes_of(part))
    return digest.hexdigest()


def _bytes_of(part: Any) -> bytes:
    if isinstance(part, np.ndarray):
        values = np.ascontiguousarray(part)
        return digest_of(part.shape, str(part.dtype)).encode() + hashlib.sha256(values.data.cast("B")).digest()
    if is_dataclass(part) and not isinstance(part, type):
        return digest_of(*(getattr(part, field.name) for field in fields(part))).encode()
    if isinstance(part, (list, tuple)):
        return digest_of(type(part).__name__, *part).encode()
    if isinstance(part, Mapping):
        return digest_of(*part.items()).encode()
    return hashlib.sha256(repr(part).encode("utf-8", "surrogateescape")).digest()

"""Opening what others made: ordinary files of a bounded size, and archives that unpack to no more than they may."""

from __future__ import annotations

import errno
import io
import os
import re
import stat
import zipfile
from pathlib import Path
from typing import BinaryIO

from app.errors import UserError

MENDS = {
    errno.ENOENT: "there is no such file; check the name",
    errno.EACCES: "no permission to read it; change its permissions",
    errno.EPERM: "no permission to read it; change its permissions",
    errno.ELOOP: "it is a link that leads back to itself; give the name of the file",
    errno.ENAMETOOLONG: "the name is too long; check it",
    errno.ENOTDIR: "a part of its path is a file; check the name",
    errno.EIO: "the disk fails to read it; get it from another copy",
}
MAX_PIXELS = 400_000_000  # of a picture that is unpacked, if nothing else is said
MOST_TEXT = 64 * 2**20  # bytes of a recipe: twice as much as its most numbers take when they are saved
SMALL = 2 * 2**20  # bytes that anything may unpack to
MOST_UNPACKED = 20  # times its size that a larger member of an archive may unpack to; strokes come to 3
SIZE = 2  # place of a file's bytes in its `state_of`
MOST_INDEX = 16 * 2**20  # bytes of an archive's list of members


NO_ADDRESS = "it is an address, and only files are read; download it first"


def open_input(path: str | os.PathLike[str], kind: str = "file", most: int | None = None) -> BinaryIO:
    """Open an ordinary file of no more than `most` bytes for reading: never a pipe or a device, which might not end.

    kind: what messages call it. Raises `UserError`.
    """
    try:
        _check(path, os.stat(path), kind, most)
        stream = open(path, "rb", opener=_without_waiting)  # noqa: SIM115 - whoever asked for it closes it
        try:
            _check(path, os.fstat(stream.fileno()), kind, most)
        except UserError:
            stream.close()
            raise
        return stream
    except ValueError as error:
        raise no_name(path, error) from None
    except OSError as error:
        raise cannot_read(path, error) from None


def no_name(path: str | os.PathLike[str], error: ValueError) -> UserError:
    """What it means for the user that the system takes `path` for no name of a file at all."""
    if isinstance(error, UnicodeEncodeError):
        return UserError(
            f"Cannot read {path}: names of files are {error.encoding} here, which lacks some of its characters; "
            "set LC_ALL=C.UTF-8."
        )
    return UserError(f"Cannot read {path}: no file has a NUL in its name; check the name.")


def is_address(name: str) -> bool:
    """Whether what is no file is an address of the web; a path leaves one slash of the two."""
    return re.match("[a-zA-Z]{2,}:/", name) is not None


def cannot_read(path: str | os.PathLike[str], error: OSError) -> UserError:
    """What `error` means for the user who wanted `path` read."""
    reason = MENDS.get(error.errno or 0, f"{error.strerror or error or 'the system gave no reason'}; try a copy of it")
    if error.errno == errno.ENOENT and is_address(str(path)):
        reason = NO_ADDRESS
    return UserError(f"Cannot read {path}: {reason}.")


def state_of(path: str | os.PathLike[str] | int) -> tuple[int, ...] | None:
    """What tells a file from one that is written later in its place; None if there is none."""
    try:
        found = os.stat(path)
    except OSError:
        return None
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns


def _without_waiting(path: str, flags: int) -> int:
    """Open what may have become a pipe since it was looked at."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def read_input(path: str | os.PathLike[str], kind: str, most: int) -> bytes:
    """All of an ordinary file of no more than `most` bytes. Raises `UserError`."""
    data = read_start(path, kind, most + 1, most)
    if len(data) > most:  # it grew, or is one of the system's files whose size is told as 0
        raise _too_large(path, kind, most)
    return data


def read_start(path: str | os.PathLike[str], kind: str, count: int, most: int | None = None) -> bytes:
    """The first `count` bytes of an ordinary file of no more than `most`, or all that it has. Raises `UserError`."""
    with open_input(path, kind, most) as stream:
        try:
            return stream.read(count)
        except OSError as error:  # of the disk or the network, or of a file of the system's that cannot be read
            raise cannot_read(path, error) from None


def _check(path: str | os.PathLike[str], status: os.stat_result, kind: str, most: int | None) -> None:
    if stat.S_ISDIR(status.st_mode):
        raise UserError(f"Cannot read {path}: it is a folder; give the name of a {kind}.")
    if not stat.S_ISREG(status.st_mode):
        raise UserError(f"Cannot read {path}: it is a pipe or a device; save it as an ordinary file first.")
    if most is not None and status.st_size > most:
        raise _too_large(path, kind, most)


def _too_large(path: str | os.PathLike[str], kind: str, most: int) -> UserError:
    size = f"{most >> 20} MB" if most >= 2**20 else f"{most} bytes"
    return UserError(f"Cannot read {path}: it has more than {size}, the most that a {kind} may have; get it again.")


def check_size(file: Path, width: int, height: int, max_pixels: int, channels: int = 1) -> None:
    """Raise `UserError` for more than `max_pixels`, or more values than these have in RGBA, telling how to raise it."""
    needed = max(width * height, -(-width * height * channels // 4))
    if needed > max_pixels:
        each = f" of {channels} channels" if needed > width * height else ""
        size = f"Cannot read {file}: {width} x {height} pixels{each} are more than the limit of {max_pixels}"
        raise UserError(
            f"{size}; if you trust the file, raise it with --max-pixels {needed}.",
            in_window=f"{size}; make it smaller first.",
        )


class Archive(zipfile.ZipFile):
    """A zip file whose members are read without unpacking more than they may.

    stream: from `open_input`. Raises whatever `zipfile` does where it is damaged.
    """

    def __init__(self, stream: BinaryIO) -> None:
        super().__init__(_Reader(stream))

    def check(self, name: str) -> None:
        """Raise `ValueError` if a member unpacks to more than it may, or in another way than that of projects."""
        member = self.getinfo(name)
        if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise ValueError(f"{name} is compressed in an unknown way")  # in others, a step may unpack to any size
        if member.file_size > max(SMALL, MOST_UNPACKED * member.compress_size):
            raise ValueError(f"{name} unpacks to {member.file_size} bytes, far more than a file like it")

    def check_stored(self) -> None:
        """Raise `ValueError` if any member is compressed, so that all have no more bytes than the file."""
        if any(member.compress_type != zipfile.ZIP_STORED for member in self.infolist()):
            raise ValueError("it is compressed")

    def member(self, name: str) -> bytes:
        """All of a member. Raises `KeyError` if there is none, or as `check`."""
        self.check(name)
        with self.open(name) as stream:
            unpacked = bytearray()
            # In steps, since read() unpacks everything there is before it looks at what the index says.
            while step := stream.read(2**20):
                unpacked += step
        return bytes(unpacked)

    def unpack(self, name: str, folder: Path) -> None:
        """Write a member to where `name` leads from `folder`. Raises as `check`."""
        self.check(name)
        self.extract(name, folder)  # in small steps, and it lets nothing out of the folder


class _Reader(io.BufferedIOBase):
    """A stream that gives no more at once than an archive's index may have: `ZipFile` reads that as a whole."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream

    def read(self, size: int | None = -1, /) -> bytes:
        data = self._stream.read(MOST_INDEX + 1 if size is None or size < 0 else min(size, MOST_INDEX + 1))
        if len(data) > MOST_INDEX:
            raise ValueError("its list of members is too long")
        return data

    def seek(self, offset: int, whence: int = 0, /) -> int:
        return self._stream.seek(offset, whence)

    def tell(self) -> int:
        return self._stream.tell()

    def seekable(self) -> bool:
        return True

    def readable(self) -> bool:
        return True

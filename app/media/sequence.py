"""Reading a clip whose frames are numbered files."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from app.errors import About, Cancelled, UserError
from app.media.clip import DEEP, SHALLOW, WHOLE, Clip, FrameRange
from app.media.inputs import MAX_PIXELS
from app.media.losses import joined, lost
from app.media.numbered import NUMBER, check_numbers, numbered_files
from app.media.pictures import read_picture
from app.media.record import digest_of_file
from app.model.picture import Picture
from app.progress import never


@dataclass(frozen=True, kw_only=True)
class PictureSequence(Clip):
    """The files of `name.%04d.exr`, each a picture of its own with all that belongs to it.

    Attributes:
        files: those that are there, by number.
        channels: of each.
        max_pixels: larger ones are refused.
    """

    files: Mapping[int, Path]
    channels: int
    max_pixels: int

    def check(self, part: FrameRange) -> None:
        """Raise `UserError`, naming them, if files of the part are missing."""
        if part != WHOLE and part[0] > max(self.files):
            raise UserError(
                f"Cannot read {self.path}: it has the frames {self.start}-{max(self.files)}, and none from {part[0]} on"
            )
        check_numbers(self.path, self.files, self._numbers(part))

    def _numbers(self, part: FrameRange) -> range:
        first, last = part
        return range(self.start if part == WHOLE else first, (max(self.files) if last is None else last) + 1)

    def pictures(
        self,
        part: FrameRange = WHOLE,
        is_kept: Callable[[int], bool] = lambda number: False,
        cancel: Callable[[], bool] = never,
        notice: Callable[[str], None] = lambda said: None,
    ) -> Generator[tuple[int, Picture], None, None]:
        """See `Clip`."""
        reported = {_said(self.note)}
        for number in self._numbers(part):
            if cancel():
                raise Cancelled
            if is_kept(number):
                continue
            picture = read_picture(self.files[number], self.max_pixels)
            self._check_alike(self.files[number], picture)
            if picture.note and _said(picture.note) not in reported:  # once, if each has lost it
                reported.add(_said(picture.note))
                notice(picture.note)
            yield number, picture

    def _check_alike(self, file: Path, picture: Picture) -> None:
        mine, wanted = _shape(picture), (self.width, self.height, self.bits, self.channels)
        if mine != wanted:
            raise UserError(
                f"Cannot read {file}: it has {_described(*mine)}, and the first of its sequence {_described(*wanted)}; "
                "make them alike."
            )

    def digest(self, number: int) -> str:
        """See `Clip`."""
        return digest_of_file(self.files[number])


def read_sequence(path: str | os.PathLike[str], max_pixels: int = MAX_PIXELS) -> tuple[PictureSequence, Picture]:
    """The sequence of files `path`, such as `name.%04d.exr` or `name.####.exr`, and its first picture.

    Raises:
        UserError: if there is none, or the first cannot be read.
    """
    files = numbered_files(path)
    negative = _negative(Path(path))
    start = next(iter(files))
    first = read_picture(files[start], max_pixels)
    width, height, bits, channels = _shape(first)
    clip = PictureSequence(
        path=Path(path),
        width=width,
        height=height,
        bits=bits,
        channels=channels,
        alpha=first.has_alpha,
        fps=None,
        is_whole=True,
        pixel_format=(SHALLOW if bits == 8 else DEEP)[channels - 1],
        frames=len(files),
        start=start,
        note=first.note,
        files=files,
        max_pixels=max_pixels,
    )
    return clip, replace(first, note=joined(first.note, lost(Path(path), negative)))


def _negative(path: Path) -> list[str]:
    """That files with numbers below 0 are no frames, where there are some."""
    before, after = (re.escape(part) for part in NUMBER.split(path.name)[:: NUMBER.groups + 1])
    count = sum(re.fullmatch(f"{before}-\\d+{after}", name) is not None for name in os.listdir(path.parent))
    told = (
        "a file with a number below 0 is not used" if count == 1 else f"{count} files with numbers below 0 are not used"
    )
    return [told] if count else []


def _said(note: str) -> str:
    """What a note says, whichever file it is about."""
    return note.said if isinstance(note, About) else note


def _shape(picture: Picture) -> tuple[int, int, int, int]:
    return picture.width, picture.height, picture.bits, picture.pixels.shape[2]


def _described(width: int, height: int, bits: int, channels: int) -> str:
    return f"{width} x {height} pixels of {channels} x {bits} bits"

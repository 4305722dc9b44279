"""What moves: the pictures of a video, or of a sequence of files, one after the other."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Mapping
from contextlib import closing
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from pathlib import Path

from app.errors import UserError
from app.media.losses import USUAL_TRANSFERS, unusual_colours
from app.media.record import digest_of_file
from app.model.picture import Picture
from app.model.timeline import frame_rate
from app.progress import never

CHANGED = 65  # exit status when a clip changes under the job

FrameRange = tuple[int, int | None]
"""The first and the last number of the frames that are wanted; None is to the end."""

WHOLE: FrameRange = (0, None)

SHALLOW, DEEP = ("gray", "ya8", "rgb24", "rgba"), ("gray16le", "ya16le", "rgb48le", "rgba64le")
"""ffmpeg's names of frames of 8 bits and of more, by channels."""


@dataclass(frozen=True)
class Colours:
    """What the colours of a clip are, by ffmpeg's names; the usual ones are BT.709's."""

    primaries: str = "bt709"
    transfer: str = "bt709"
    matrix: str = "bt709"

    @property
    def is_usual(self) -> bool:
        return self == Colours()

    @property
    def is_high(self) -> bool:
        """Of a high dynamic range, which 8 bits a channel would show in steps."""
        return self.transfer in HIGH


USUAL = Colours()
HIGH = ("smpte2084", "arib-std-b67")
CODES = {"bt709": 1, "bt2020": 9, "smpte431": 11, "smpte432": 12, "smpte2084": 16, "arib-std-b67": 18}  # of H.273


def coded(colours: Colours) -> dict[bytes, bytes]:
    """The chunk in which a PNG tells what its colours are; none for the usual ones (PNG, 11.3.2.6)."""
    if colours.is_usual:
        return {}
    return {b"cICP": bytes([CODES[colours.primaries], CODES[colours.transfer], 0, 1])}


def uncoded(chunks: Mapping[bytes, bytes]) -> Colours | None:
    """What the chunk of a PNG tells of its colours, as far as a clip can have them; None if it cannot."""
    codes = chunks.get(b"cICP")
    if codes is None or not unusual_colours(codes[0], codes[1]):
        return USUAL
    primaries = next((name for name, code in CODES.items() if code == codes[0] and name not in HIGH), None)
    transfer = next((name for name, code in CODES.items() if code == codes[1] and name in HIGH), "bt709")
    if primaries is None or (transfer == "bt709" and codes[1] not in USUAL_TRANSFERS):
        return None
    return Colours(primaries, transfer, "bt2020nc" if primaries == "bt2020" else "bt709")


@dataclass(frozen=True, kw_only=True)
class Clip(ABC):
    """Frames of one size and depth.

    Attributes:
        bits, alpha: of a frame as it is read.
        pixel_format: ffmpeg's name of what a frame is stored in, such as yuv420p.
        fps: frames a second; None where the recipe says it.
        frames: about how many there are; None where that is not known.
        start: the number of the first.
        sounds: the codecs of its sound tracks.
        layouts: how these are spread over loudspeakers, such as stereo or 5.1; of each, or of none.
        roles: what these are marked as, besides default, such as comment or forced.
        languages: of these, as far as they are named.
        late: seconds from the file's start, as a rule its sound's, to the first frame; 0 where ffmpeg does not say.
        durations: of the frames, in steps of 1 / fps, where they differ.
        loops: how often it is played, 0 for ever.
        is_whole: each frame is a picture of its own, with all that belongs to it.
        timecode: of the first frame, as 01:00:00:00; None where there is none.
        is_linked: a project refers to it, and does not keep it.
        is_steady: a frame can be decoded without those before it.
        note: what of it is lost, in a sentence; "" if nothing.
    """

    path: Path
    width: int
    height: int
    bits: int
    alpha: bool
    pixel_format: str
    fps: Fraction | None
    frames: int | None = None
    start: int = 0
    sounds: tuple[str, ...] = ()
    layouts: tuple[str, ...] = ()
    roles: tuple[str, ...] = ()
    languages: tuple[str, ...] = ()
    late: float = 0.0
    durations: tuple[int, ...] | None = None
    loops: int = 0
    is_whole: bool = False
    colours: Colours = USUAL
    timecode: str | None = None
    is_linked: bool = True
    is_steady: bool = True
    note: str = ""

    @property
    def sound(self) -> str | None:
        """The codec of its first sound track; None if it is silent."""
        return next(iter(self.sounds), None)

    def moment(self, number: int) -> int:
        """When a frame is shown, in steps of 1 / fps after the first."""
        return number - self.start

    def number_at(self, moment: int) -> int:
        """The number of the frame that is shown at a moment, if the clip is that long; see `moment`."""
        return self.start + moment

    def lengths(self, part: FrameRange) -> list[int] | None:
        """The durations of the frames of a part, where they differ."""
        if self.durations is None:
            return None
        return list(self.durations[part[0] : None if part[1] is None else part[1] + 1])

    def timecode_at(self, number: int) -> str | None:
        """The time code of a frame, if there is one (SMPTE ST 12-1): after a ";" some numbers are dropped."""
        if self.timecode is None or self.fps is None:
            return self.timecode
        hours, minutes, seconds, frames = (int(part) for part in (*self.timecode[:-3].split(":"), self.timecode[-2:]))
        base, mark = round(self.fps), self.timecode[-3]
        drops = base // 15 if mark in ";." else 0  # at the start of every minute but each tenth
        minute = hours * 60 + minutes
        count = (minute * 60 + seconds) * base + frames - drops * (minute - minute // 10) + number - self.start
        tens, rest = divmod(count, 600 * base - 9 * drops)
        count += 9 * drops * tens + drops * max(0, (rest - drops) // (60 * base - drops)) if drops else 0
        seconds, frames = divmod(count, base)
        return f"{seconds // 3600 % 24:02d}:{seconds // 60 % 60:02d}:{seconds % 60:02d}{mark}{frames:02d}"

    def check(self, part: FrameRange) -> None:  # noqa: B027 - as a rule nothing is
        """Raise `UserError` if it is known beforehand that the frames of a part are not all there."""

    @abstractmethod
    def pictures(
        self,
        part: FrameRange = WHOLE,
        is_kept: Callable[[int], bool] = lambda number: False,
        cancel: Callable[[], bool] = never,
        notice: Callable[[str], None] = lambda said: None,
    ) -> Generator[tuple[int, Picture], None, None]:
        """Yield the number and the picture of each frame of a part, but for those that are kept as they are.

        Args:
            cancel: asked with each; true raises `Cancelled`.
            notice: hears of what is lost.

        Raises:
            UserError: if one cannot be read.
        """

    def pictures_from(
        self, number: int, cancel: Callable[[], bool] = never, notice: Callable[[str], None] = lambda said: None
    ) -> Generator[tuple[int, Picture], None, None]:
        """As `pictures` from a frame on, which comes as soon as may be: for looking at."""
        return self.pictures((number, None), cancel=cancel, notice=notice)

    @abstractmethod
    def digest(self, number: int) -> str:
        """What a frame is made of: the bytes of its file. Raises `UserError` or `OSError`."""


def rate_of(clip: Clip | None, fps: float) -> Fraction:
    """Frames a second: the clip's own, or `fps` where it has none."""
    return (clip and clip.fps) or frame_rate(fps)


def frame_of(clip: Clip, number: int) -> Picture:
    """One frame of a clip. Raises `UserError`."""
    with closing(clip.pictures_from(number)) as pictures:
        found = next(pictures, None)
    if found is None:
        raise UserError(f"Cannot read {clip.path}: it has no frame {number}; choose an earlier one.")
    return replace(found[1], chunks={**found[1].chunks, **coded(clip.colours)})


def has_changed(path: Path, before: int, size: int) -> UserError:
    """What is told of a clip whose file is not as it was when it was opened, of so many bytes before and now."""
    sizes = f", from {before} to {size} bytes" if size != before else ""
    return UserError(
        f"Cannot read {path}: it changed while it was read{sizes}; start again when it is written whole.",
        CHANGED,
        in_window=f"Cannot read {path}: it is not as it was{sizes}; open it again when that is finished.",
    )


@dataclass(frozen=True, kw_only=True)
class FileClip(Clip):
    """A clip whose frames are all in one file, which may be large, and is read for a digest once."""

    @cached_property
    def _digest(self) -> str:
        return digest_of_file(self.path)

    def digest(self, number: int) -> str:
        """See `Clip`."""
        return self._digest

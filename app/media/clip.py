"""What moves: the pictures of a video, or of a sequence of files, one after the other."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from app.model.picture import Picture
from app.progress import never

Part = tuple[int, int | None]
"""The first and the last number of the frames that are wanted; None is to the end."""

WHOLE: Part = (0, None)

SHALLOW, DEEP = ("gray", "ya8", "rgb24", "rgba"), ("gray16le", "ya16le", "rgb48le", "rgba64le")
"""ffmpeg's names of frames of 8 bits and of more, by channels."""


@dataclass(frozen=True, kw_only=True)
class Clip:
    """Frames of one size and depth.

    fps: frames a second; None where the recipe says it. frames: about how many; None when unknown.
    start: the number of the first. bits, alpha: of a frame as it is read; pixel_format: ffmpeg's name of what it is
    stored in, such as yuv420p.
    sound: name of its first sound track's codec, None if silent. late: seconds that its frames begin after the file,
    as a rule after its sound; 0 where an older ffmpeg does not tell.
    durations: of the frames, in steps of 1 / fps, where they differ. loops: how often it is played, 0 for ever.
    is_whole: each frame is a picture of its own, with all that belongs to it.
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
    sound: str | None = None
    late: float = 0.0
    durations: tuple[int, ...] | None = None
    loops: int = 0
    is_whole: bool = False
    note: str = ""

    def moment(self, number: int) -> int:
        """When a frame is shown, in steps of 1 / fps after the first."""
        return number - self.start

    @property
    def shortest(self) -> int:
        """Of its frames, in steps of 1 / fps."""
        return min(self.durations or [1])

    def lengths(self, part: Part) -> list[int] | None:
        """The durations of the frames of a part, where they differ."""
        if self.durations is None:
            return None
        return list(self.durations[part[0] : None if part[1] is None else part[1] + 1])

    def check(self, part: Part) -> None:
        """Raise `UserError` if it is known beforehand that the frames of a part are not all there."""

    def pictures(
        self,
        part: Part = WHOLE,
        is_kept: Callable[[int], bool] = lambda number: False,
        cancel: Callable[[], bool] = never,
        notice: Callable[[str], None] = lambda said: None,
    ) -> Generator[tuple[int, Picture], None, None]:
        """Yield the number and the picture of each frame of a part, but for those that are kept as they are.

        cancel: asked with each; true raises `Cancelled`. notice: hears of what is lost. Raises `UserError`.
        """
        raise NotImplementedError

    def digest(self, number: int) -> str:
        """What a frame is made of: the bytes of its file. Raises `UserError` or `OSError`."""
        raise NotImplementedError

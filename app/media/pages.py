"""Reading a clip out of one file of pictures: an animated GIF, PNG or WebP, or the pages of a TIFF."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property, lru_cache
from itertools import accumulate
from math import gcd, lcm
from pathlib import Path

from app.errors import Cancelled, UserError
from app.media.clip import DEEP, SHALLOW, WHOLE, FileClip, FrameRange, has_changed
from app.media.codecs import apng, gif, pillow, tiff, webp
from app.media.codecs.decoding import decoding, head_of
from app.media.codecs.layered import MOST_FRAMES, Animation, TooManyFrames
from app.media.formats import kind_of
from app.media.inputs import MAX_PIXELS, SIZE, open_input, state_of
from app.media.losses import lost
from app.model.picture import Picture
from app.progress import never

ANIMATED = {"GIF": "GIF", "PNG": "PNG", "WebP": "WEBP"}  # and Pillow's names of them
UNTOLD = 100  # milliseconds of a frame of no length, as browsers show it


@dataclass(frozen=True, kw_only=True)
class Pages(FileClip):
    """The frames or pages of a file, all of one size.

    Attributes:
        kind: of the file, as in the table of formats.
        places: of the frames in the file, without what is none.
        state: of the file when it was opened; see `state_of`.
    """

    kind: str
    places: tuple[int, ...]
    max_pixels: int
    state: tuple[int, ...] | None = field(compare=False)

    def check(self, part: FrameRange) -> None:
        """Raise `UserError` if the part begins after the last frame."""
        if part[0] >= len(self.places):
            lacks = f"it has the frames 0-{len(self.places) - 1}, and none from {part[0]} on"
            raise UserError(f"Cannot read {self.path}: {lacks}; give --frames.")

    def moment(self, number: int) -> int:
        """See `Clip`."""
        return self._moments[min(number, len(self.places) - 1)]

    def number_at(self, moment: int) -> int:
        """See `Clip`."""
        return min(bisect_right(self._moments, moment), len(self.places)) - 1

    @cached_property
    def _moments(self) -> list[int]:
        return [0, *accumulate(self.durations or [1] * len(self.places))]

    def pictures(
        self,
        part: FrameRange = WHOLE,
        is_kept: Callable[[int], bool] = lambda number: False,
        cancel: Callable[[], bool] = never,
        notice: Callable[[str], None] = lambda said: None,
    ) -> Generator[tuple[int, Picture], None, None]:
        """See `Clip`."""
        first, last = part
        with decoding(self.path, self.kind):
            self._check_unchanged()
            with self._reader() as read:
                for number in range(first, min(len(self.places) if last is None else last + 1, len(self.places))):
                    if cancel():
                        raise Cancelled
                    if is_kept(number):
                        continue
                    self._check_unchanged()
                    try:
                        picture = read(number)
                    except Exception:
                        self._check_unchanged()  # in the meantime
                        raise
                    mine = picture.width, picture.height, picture.bits, picture.has_alpha
                    if mine != (self.width, self.height, self.bits, self.alpha):
                        raise UserError(
                            f"Cannot read {self.path}: frame {number} has {picture.width} x {picture.height} pixels of "
                            f"{picture.pixels.shape[2]} x {picture.bits} bits, unlike the first; make them alike."
                        )
                    yield number, picture

    def _check_unchanged(self) -> None:
        """Raise `UserError` if the file is not as it was: a frame would be of another, or none."""
        with open_input(self.path, "clip") as stream:  # by now it may be a pipe, for which a decoder waits for ever
            state = state_of(stream.fileno())
        if self.state and state and state != self.state:
            raise has_changed(self.path, self.state[SIZE], state[SIZE])

    @contextmanager
    def _reader(self) -> Iterator[Callable[[int], Picture]]:
        """What gives one frame after another, by rising numbers; those between are decoded only if they must."""
        if self.kind == "TIFF":
            with tiff.opened(self.path) as file:
                yield lambda number: tiff.page_of(file, self.path, self.max_pixels, self.places[number])
            return
        layered = _layered(self.kind, self.path, self.max_pixels)
        if layered is None:
            raise ValueError("it is no animation any more")
        shown = enumerate(layered.shown())

        def of_layers(number: int) -> Picture:
            canvas = next(canvas for at, canvas in shown if at == number)
            return Picture((canvas if self.alpha else canvas[..., :3]).copy())

        yield of_layers


def read_pages(path: Path, first: Picture, max_pixels: int = MAX_PIXELS) -> Pages | None:
    """The clip in a file whose first frame is `first`; None if that is all there is. Raises `UserError`."""
    state = state_of(path)
    kind = kind_of(path, head_of(path))
    if kind is None or kind.name not in (*ANIMATED, "TIFF"):
        return None
    with decoding(path, kind.name):
        if kind.name == "TIFF":
            places, durations, alpha, loops = tiff.pages_of(path), None, first.has_alpha, 0
        else:
            durations, alpha, loops = _animation(kind.name, path, max_pixels)
            places = range(len(durations))
    if len(places) < 2:
        return None
    channels = first.pixels.shape[2] if kind.name == "TIFF" else 3 + alpha
    bits = first.bits if kind.name == "TIFF" else 8
    losses = ["its 16 bits a channel become 8"] if first.bits > bits else []
    losses += gif.unkept(head_of(path)) if kind.name == "GIF" else []
    rate, steps = _steps(durations) if durations else (None, None)
    return Pages(
        path=path,
        width=first.width,
        height=first.height,
        bits=bits,
        alpha=alpha,
        pixel_format=(SHALLOW if bits == 8 else DEEP)[channels - 1],
        fps=rate,
        frames=len(places),
        durations=steps if steps and len(set(steps)) > 1 else None,
        loops=loops,
        is_whole=kind.name == "TIFF",
        is_linked=False,
        note=lost(path, losses),
        kind=kind.name,
        places=tuple(places),
        max_pixels=max_pixels,
        state=state,
    )


def _animation(kind: str, path: Path, max_pixels: int) -> tuple[list[Fraction], bool, int]:
    """The durations of an animation's frames, in seconds, whether any has alpha, and how often it plays."""
    layered = _layered(kind, path, max_pixels)
    if layered is None:
        return [], False, 0
    durations = [_shown_for(1000 * one.seconds) for one in layered.frames]
    return durations, layered.has_alpha(max_pixels), layered.plays


def _layered(kind: str, path: Path, max_pixels: int) -> Animation | None:
    """The frames of an animation; None if it is none. Raises `UserError` if one is too large."""
    with pillow.opened(ANIMATED[kind], path, max_pixels) as image:  # which is not too large
        loop = image.info.get("loop")
    with open_input(path, "clip") as stream:
        data = stream.read()
    try:
        match kind:
            case "PNG":
                found = apng.read(data)
            case "GIF":
                found = gif.frames(data, loop)
            case _:
                found = webp.frames(data)
    except TooManyFrames:
        raise UserError(f"Cannot read {path}: it has more than {MOST_FRAMES} frames; cut it into parts.") from None
    if found is not None and max(frame.pixels for frame in found.frames) > max_pixels:
        raise pillow.too_large(path, max_pixels)
    return found


@lru_cache
def _shown_for(milliseconds: Fraction) -> Fraction:
    """The seconds that a frame is shown."""
    return (milliseconds or Fraction(UNTOLD)).limit_denominator(1000) / 1000


def _steps(durations: Sequence[Fraction]) -> tuple[Fraction, tuple[int, ...]]:
    """A rate of which all durations are whole numbers of frames, and these; to the millisecond if need be."""
    below = lcm(*(duration.denominator for duration in durations))
    wholes = [int(duration * below) for duration in durations]
    step = gcd(*wholes)
    rate = Fraction(below, step)
    if rate > 1000:
        return _steps([max(1, round(duration * 1000)) / Fraction(1000) for duration in durations])
    return rate, tuple(whole // step for whole in wholes)

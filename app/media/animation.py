"""Writing animations frame by frame: videos, animated pictures and numbered sequences.

Long, as the three are written to the same rules: what is half-written, cancelled or fails leaves nothing behind.
"""

from __future__ import annotations

import errno
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Protocol, TypeVar

import numpy as np

from app.errors import Cancelled, UserError
from app.media import ffmpeg
from app.media.clip import USUAL, Colours
from app.media.depth import to_bits
from app.media.encoders import ANIMATIONS, SIX_BITS, Container, Encoding, Stream, check_animation, lossless
from app.media.files import cannot_write, replacing, temporary_beside, temporary_file
from app.media.numbered import is_sequence, numbered
from app.media.pictures import write_picture
from app.media.video import sound_tracks
from app.model.picture import Picture
from app.progress import never

T_contra = TypeVar("T_contra", contravariant=True)
T = TypeVar("T")

Frame = np.ndarray | Picture
"""(h, w, c), uint8 or uint16 sRGB, or float32 linear light, all of one kind in one animation; or all that is written of
one, with what belongs to it."""


class NumberedWriter(Protocol[T_contra]):
    """Takes a frame and, for a sequence, its number; None is the one after the last."""

    def __call__(self, item: T_contra, number: int | None = None, /) -> None: ...


FrameWriter = NumberedWriter[Frame]


@dataclass(frozen=True)
class AnimationOptions:
    """How an animation is written; what its format has no use for is passed over.

    Attributes:
        codec: one of the container's; None is its first.
        quality: 1-100 of a video with losses or of a sequence's pictures; None is what is usual for the codec.
        bits: of a sequence's pictures; see `write_picture`.
        loops: GIF, APNG, WebP; 0 is for ever.
        durations: of the frames, in steps of 1 / fps; None is 1 for each.
        sound: a file whose sound is carried over, from the second `sound_from`, cut to the length of `frames`.
        colours, timecode: what a video is told to have, the latter of its first frame.
        like: the picture whose profile and metadata the pictures of a sequence get; whether its alpha is premultiplied,
            so that of the frames is.
        resumed: it may be that no file of a sequence is left to write.
    """

    codec: str | None = None
    quality: int | None = None
    bits: int | None = None
    loops: int = 0
    durations: Sequence[int] | None = None
    sound: Path | None = None
    sound_from: float = 0.0
    frames: int | None = None
    colours: Colours = USUAL
    timecode: str | None = None
    like: Picture | None = None
    resumed: bool = False


@contextmanager
def animation_writer(
    path: str | os.PathLike[str],
    fps: float | Fraction = 30,
    options: AnimationOptions = AnimationOptions(),
    *,
    cancel: Callable[[], bool] = never,
    passed: Callable[[int], None] = lambda frames: None,
    written: Callable[[int, Path], None] = lambda number, file: None,
) -> Iterator[FrameWriter]:
    """Yield a function that appends a frame; the file appears when the block ends well, else nothing does.

    Frames go to the encoder at once: memory does not grow with their number. Raises `UserError`.

    Args:
        path: its ending chooses the format; `name.%04d.png` (or .tif, .exr ...) numbers pictures, each of which appears
            as soon as it is written, and stays.
        cancel: asked with each frame, and ten times a second while the encoder keeps us waiting; true raises
            `Cancelled`.
        passed: hears of frames that a later pass has gone through, after all were given, in formats with `passes`.
        written: hears of each file of a sequence, by its number, see `sequence_writer`; of another file as of number 0,
            just before it appears.
    """
    for steps in set(options.durations or [1]):
        check_animation(path, fps / steps, options.codec)
    like, quality = options.like, 95 if options.quality is None else options.quality
    if is_sequence(path):
        template = like or Picture(np.empty((0, 0, 1), np.uint8))

        def write_one(file: Path, frame: Frame, whole: Callable[[Path], None]) -> None:
            picture = frame if isinstance(frame, Picture) else template.with_pixels(frame)
            write_picture(file, picture, bits=options.bits, quality=quality, codec=options.codec, whole=whole)

        with sequence_writer(path, write_one, cancel, written, options.resumed) as write:
            yield write
        return

    def straight(frame: Frame) -> np.ndarray:
        if isinstance(frame, Picture):
            return frame.straight().pixels
        return like.with_pixels(frame).straight().pixels if like else frame

    container = ANIMATIONS[Path(path).suffix.lower()]
    rate = Fraction(fps).limit_denominator(100_000)
    with ExitStack() as stack:
        temporary = stack.enter_context(replacing(path, whole=partial(written, 0)))
        if container.name == "GIF":
            with _gif_writer(temporary, str(path), rate, options, cancel, passed) as write:
                yield lambda frame, number=None: write(straight(frame))
            return
        spool = stack.enter_context(temporary_file(temporary_beside(Path(path).with_suffix(".mka"))))
        given, sound = _sound(container, options, rate, spool, cancel)
        if options.timecode is not None and container.sound:
            sound = [*sound, "-metadata", f"timecode={options.timecode}"]
        encoding, lasting, last = container.encoding(options.codec), options.durations, np.empty(0)
        stands = bool(container.sound and lasting and lasting[-1] > 1)
        if stands and lasting:  # a video ends a step after its last frame, which so is given again for that step
            options = replace(options, durations=[*lasting[:-1], lasting[-1] - 1, 1])
        with _Video(temporary, str(path), encoding, rate, container.even, options, (given, sound), cancel) as video:

            def give(frame: Frame, number: int | None = None) -> None:
                nonlocal last
                last = straight(frame)
                video.write(last)

            yield give
            if stands and last.size:
                video.write(last)
            video.finish()
        if container.name == "animated WebP" and options.durations:
            _end_webp(temporary, round(sum(options.durations) * 1000 / rate))


@dataclass
class _Video:
    """Frames into one run of ffmpeg, started when the first frame shows what they are like."""

    temporary: Path
    label: str
    encoding: Encoding
    rate: Fraction
    even: bool = False
    options: AnimationOptions = AnimationOptions()
    sound: tuple[Sequence[str], Sequence[str]] = (), ()
    cancel: Callable[[], bool] = never
    _process: ffmpeg.Ffmpeg | None = field(default=None, init=False)
    _kind: tuple[tuple[int, ...], np.dtype] | None = field(default=None, init=False)

    def __enter__(self) -> _Video:
        return self

    def __exit__(self, *exception: object) -> None:
        if self._process is not None:
            self._process.__exit__(*exception)

    def write(self, frame: np.ndarray) -> None:
        if self.cancel():
            raise Cancelled
        if not self.temporary.parent.is_dir():  # the encoder would write on into a file without a name
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT))
        if self._process is None:
            self._kind = frame.shape, frame.dtype
            self._process = self._start(frame)
        elif (frame.shape, frame.dtype) != self._kind:
            raise ValueError(f"a frame {frame.shape} {frame.dtype} among frames {self._kind}")
        if frame.dtype == np.float32:
            frame = to_bits(frame, 16)
        if self.even and (frame.shape[0] % 2 or frame.shape[1] % 2):
            # the edge is repeated: a black line would show, a resize would blur
            frame = np.pad(frame, ((0, frame.shape[0] % 2), (0, frame.shape[1] % 2), (0, 0)), mode="edge")
        self._process.feed(np.ascontiguousarray(frame).data.cast("B"))

    def _start(self, frame: np.ndarray) -> ffmpeg.Ffmpeg:
        height, width, channels = frame.shape
        if self.even:
            height, width = height + height % 2, width + width % 2
        bits = 8 if frame.dtype == np.uint8 else 16
        how, alpha = self.options, channels in (2, 4)
        names = ("gray", "ya8", "rgb24", "rgba") if bits == 8 else ("gray16le", "ya16le", "rgb48le", "rgba64le")
        return ffmpeg.Ffmpeg(
            [
                *["-f", "rawvideo", "-pix_fmt", names[channels - 1], "-s", f"{width}x{height}", "-r", str(self.rate)],
                *["-i", "-", *self.sound[0], "-map", "0:v:0"],
                *self._timed(self.encoding(Stream(alpha, bits, how.quality, how.loops, how.colours))),
                *self.sound[1],
                f"file:{self.temporary}",
            ],
            self.label,
            cancel=self.cancel,
        )

    def _timed(self, options: list[str]) -> list[str]:
        """The options, for frames that are shown for as long as they are to be."""
        durations = self.options.durations
        if durations is None:
            return options
        options, filters = [*options], [shown_for(durations)]
        if "-vf" in options:
            place = options.index("-vf")
            filters.append(options[place + 1])
            del options[place : place + 2]
        last = ["-final_delay", str(durations[-1] / self.rate)] if "apng" in options else []
        return ["-vf", ",".join(filters), "-fps_mode", "passthrough", *options, *last]

    def finish(self) -> None:
        """Wait for the encoder to have written everything."""
        if self._process is None:
            raise UserError(f"Cannot write {self.label}: the animation has no frame.")
        self._process.finish()


def shown_for(durations: Sequence[int]) -> str:
    """A filter of ffmpeg's that shows each frame for so many steps of its time base."""
    changes = [(at, after - before) for at, (before, after) in enumerate(pairwise(durations), 1) if after != before]
    # the sum of the durations before frame N, from where these change
    later = "".join(f"+gte(N\\,{at})*(N-{at})*({by})" for at, by in changes)
    return f"setpts=N*{durations[0]}{later}"


def _end_webp(file: Path, total: int) -> None:
    """Let an animated WebP last `total` milliseconds: ffmpeg gives its last frame the mean of the others."""
    with file.open("r+b") as stream:
        place, size, last, before = 12, file.stat().st_size, 0, 0
        while place + 8 <= size:
            stream.seek(place)
            kind, length = stream.read(4), int.from_bytes(stream.read(4), "little")
            if kind == b"ANMF":
                stream.seek(place + 8 + 12)  # after the frame's place and size
                last, before = place + 8 + 12, before + int.from_bytes(stream.read(3), "little")
            place += 8 + length + length % 2
        if last:
            stream.seek(last)
            own = int.from_bytes(stream.read(3), "little")
            stream.seek(last)
            stream.write(min(max(1, total - before + own), 2**24 - 1).to_bytes(3, "little"))


def _sound(
    container: Container, how: AnimationOptions, rate: Fraction, spool: Path, cancel: Callable[[], bool]
) -> tuple[list[str], list[str]]:
    """ffmpeg's input and output options that carry the sound of a file over; `spool` is for one without a usable clock.

    Raises `UserError` or `Cancelled`.
    """
    sound, start = how.sound, how.sound_from
    if sound is None or not container.sound:
        return [], []
    found, is_early = sound_tracks(sound)
    tracks = [(number, track) for number, track in enumerate(found) if track.codec != "none"]
    if not tracks:
        return [], []
    begin = ["-ss", f"{start:.6f}"] if start else []
    if is_early:
        chosen = [word for place, _ in tracks for word in ("-map", f"0:a:{place}")]
        ffmpeg.run(["-i", f"file:{sound}", *chosen, "-c", "copy", f"file:{spool}"], str(spool), cancel=cancel)
        # With the pictures' own times, which begin at 0 now: the sound may begin later.
        begin, sound = ["-ss", f"{start:.6f}", "-seek_timestamp", "1"], spool
        tracks = list(enumerate(track for _, track in tracks))
    length = [] if how.frames is None else ["-t", f"{float(how.frames / rate):.6f}"]
    options = ["-map_chapters", "-1"]  # which belong to all of it: that they are not kept is told
    for number, (place, track) in enumerate(tracks):
        # Of a part, what is copied would else begin where the file can be sought to, and hold the first frame back.
        prior = "1" if track.codec in container.ahead and not begin else "0"
        chosen = ("-c", "copy", "-copypriorss", prior) if track.codec in container.sound else container.encoder
        options += ["-map", f"1:a:{place}"]
        named = {"title": track.name, "language": (container.languages or {}).get(track.language)}
        for name, value in named.items():
            options += [f"-metadata:s:a:{number}", f"{name}={value}"] if value else []
        for name, value in zip(chosen[::2], chosen[1::2], strict=True):
            options += [f"{name}:a:{number}", value]
    return [*begin, *length, "-i", f"file:{sound}"], options


class _FewColours:
    """The colours of all frames, as long as a GIF's palette holds them: 255, and one more for transparent pixels.

    With this palette no pixel changes; one that ffmpeg chooses is rounded.
    """

    def __init__(self) -> None:
        self._seen: np.ndarray | None = np.zeros(2**24, bool)
        self._alpha = False

    def look(self, frame: np.ndarray) -> None:
        """Add the colours of a frame, (h, w, channels) uint8."""
        if self._seen is None:
            return
        channels = frame.shape[2]
        self._alpha = channels in (2, 4)
        red, green, blue = (frame[..., channel if channels > 2 else 0].astype(np.uint32) for channel in range(3))
        packed = red << 16 | green << 8 | blue
        self._seen[packed[frame[..., -1] >= 128] if self._alpha else packed] = True
        if np.count_nonzero(self._seen) > 255:
            self._seen = None

    def palette(self) -> np.ndarray | None:
        """A palette of them, (16, 16, 4) uint8, as ffmpeg reads one; None if they are too many."""
        if self._seen is None:
            return None
        found = np.flatnonzero(self._seen)
        palette = np.zeros((256, 4), np.uint8)
        palette[: len(found), :3] = np.stack([found >> 16, found >> 8 & 255, found & 255], axis=-1)
        palette[:, 3] = 255
        palette[255, 3] = 0 if self._alpha else 255  # of two, ffmpeg's filter and encoder take different ones
        return palette.reshape(16, 16, 4)


@contextmanager
def _gif_writer(
    temporary: Path,
    label: str,
    rate: Fraction,
    options: AnimationOptions,
    cancel: Callable[[], bool],
    passed: Callable[[int], None],
) -> Iterator[Callable[[np.ndarray], None]]:
    """Frames into a lossless file first: a palette of all colours needs all frames, which may not fit in memory."""
    loops, durations = options.loops, options.durations
    name = temporary_beside(temporary.with_suffix(".mkv"))
    with temporary_file(name) as spool, temporary_file(name.with_suffix(".png")) as palette:

        def with_palette(stream: Stream) -> list[str]:
            generate = f"{SIX_BITS},palettegen=stats_mode=full:reserve_transparent={int(stream.alpha)}"
            first = ["-vf", generate, "-update", "1", f"file:{palette}"]
            return [*first, "-map", "0:v:0", *lossless(stream)]

        few = _FewColours()
        with _Video(spool, label, with_palette, rate, cancel=cancel) as video:

            def write(frame: np.ndarray) -> None:
                few.look(in_bytes := to_bits(frame, 8))
                video.write(in_bytes)

            yield write
            video.finish()
        if (colours := few.palette()) is not None:
            write_picture(palette, Picture(colours))
        dithered, shown = "paletteuse=dither=sierra2_4a:diff_mode=rectangle", []
        if durations is not None:
            dithered = f"[0:v]settb={1 / rate},{shown_for(durations)}[shown];[shown][1:v]{dithered}"
            shown = ["-fps_mode", "passthrough", "-final_delay", str(round(100 * durations[-1] / rate))]
        use = ["-lavfi", dithered, *shown]
        # ffmpeg counts repetitions, and -1 means none
        repeat = ["-loop", str(loops - 1 if loops > 1 else -1 if loops == 1 else 0)]
        files = ["-i", f"file:{spool}", "-i", f"file:{palette}"]
        ffmpeg.run([*files, *use, *repeat, f"file:{temporary}"], label, cancel=cancel, passed=passed)


@contextmanager
def sequence_writer(
    path: str | os.PathLike[str],
    write_one: Callable[[Path, T, Callable[[Path], None]], None],
    cancel: Callable[[], bool] = never,
    written: Callable[[int, Path], None] = lambda number, file: None,
    resumed: bool = False,
) -> Iterator[NumberedWriter[T]]:
    """Yield a function that writes one numbered file by `write_one`, which lets it appear whole; see `replacing`.

    Several threads may call it at a time, if they give numbers.

    Args:
        path: such as `name.%04d.png`; numbered from 0 where no number is given.
        written: hears of each file, by its number, and by its temporary name before it appears.
        resumed: there may be none left to write.

    Raises:
        UserError: if one cannot be written.
    """
    last = -1

    def write(item: T, number: int | None = None, /) -> None:
        nonlocal last
        if cancel():
            raise Cancelled
        # `last` may be another thread's by the next line.
        last = own = last + 1 if number is None else number
        write_one(numbered(path, own), item, partial(written, own))

    yield write
    if last == -1 and not resumed:
        raise UserError(f"Cannot write {path}: the animation has no frame.")


# Order of frames ----------------------------------------------------------------------------------------------------


def frame_order(count: int, *, ping_pong: bool = False, hold_first: int = 0, hold_last: int = 0) -> list[int]:
    """The indices of `count` frames in the order they are shown.

    ping_pong: there and back, without showing the two ends twice, so that rounds follow each other smoothly.
    hold_first, hold_last: how many times more the first and the last frame are shown.
    """
    there = [0] * (hold_first + 1) + list(range(1, count)) + [count - 1] * hold_last if count else []
    return there + list(range(count - 2, 0, -1)) if ping_pong else there


def reordered(
    frames: Iterable[np.ndarray], order: Iterable[int], folder: str | os.PathLike[str]
) -> Iterator[np.ndarray]:
    """Frames that come once, one after the other, shown in any `order`; kept in a file in `folder`, not in memory.

    The file has no name and is gone with the process. Raises `UserError` when the disk is full.
    """
    source = iter(frames)
    count = 0
    latest = np.empty(0)
    try:
        with tempfile.TemporaryFile(dir=folder) as spool:
            for index in order:
                while count <= index:
                    latest = np.ascontiguousarray(next(source))
                    spool.seek(count * latest.nbytes)
                    spool.write(latest.data)
                    count += 1
                if index == count - 1:
                    yield latest
                else:
                    spool.seek(index * latest.nbytes)
                    yield np.frombuffer(spool.read(latest.nbytes), latest.dtype).reshape(latest.shape)
    except OSError as error:
        raise cannot_write(folder, error) from error

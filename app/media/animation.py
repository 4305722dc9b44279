"""Writing animations frame by frame: videos, animated pictures and numbered sequences."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Protocol, TypeVar

import numpy as np

from app.errors import Cancelled, UserError
from app.media import ffmpeg
from app.media.clip import USUAL, Clip, Colours
from app.media.depth import to_bits
from app.media.files import (
    NUMBER,
    cannot_write,
    is_sequence,
    numbered,
    replacing,
    temporary_beside,
    temporary_file,
)
from app.media.formats import FORMATS, check_picture_output
from app.media.losses import lost
from app.media.pictures import write_picture
from app.media.video import NAMES, sound_codecs
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


# What players take a video for. The filters set the tags: the frames' own overrule those given to the encoder.
def tagged(colours: Colours) -> str:
    matrix, tags = colours.matrix, f"color_primaries={colours.primaries}:color_trc={colours.transfer}"
    scaled = f"scale=out_color_matrix={matrix}:out_range=tv:flags=accurate_rnd+full_chroma_int+lanczos"
    return f"{scaled},setparams=colorspace={matrix}:{tags}:range=tv"


# palettegen counts every colour it meets: among 64 levels a channel it is 20 times faster, as good, and bounded
SIX_BITS = "lutrgb=" + ":".join(f"{channel}='round(val*63/255)*255/63'" for channel in "rgb")
ON_BLACK = "format=gbrap,premultiply=inplace=1,format=gbrp,"


class Encoding(Protocol):
    """ffmpeg's output options for frames with or without alpha, of 8 or 16 bits a channel."""

    def __call__(self, alpha: bool, bits: int, crf: int | None, loops: int, colours: Colours) -> list[str]: ...


def _mp4(alpha: bool, bits: int, crf: int | None, loops: int, colours: Colours) -> list[str]:
    quality = ["-c:v", "libx264", "-preset", "medium", "-crf", str(18 if crf is None else crf)]
    return [
        *["-vf", (ON_BLACK if alpha else "") + tagged(colours), "-pix_fmt", "yuv420p", *quality],
        *["-movflags", "+faststart"],
    ]


def _h265(alpha: bool, bits: int, crf: int | None, loops: int, colours: Colours) -> list[str]:
    if "libx265" not in ffmpeg.encoders():
        raise UserError(
            "This ffmpeg has no encoder for H.265; leave out --codec, or set IMAGEIO_FFMPEG_EXE to another."
        )
    kind = "yuv420p" if bits == 8 else "yuv420p10le"
    quality = ["-c:v", "libx265", "-preset", "medium", "-crf", str(20 if crf is None else crf), "-tag:v", "hvc1"]
    filters = (ON_BLACK if alpha else "") + tagged(colours)
    return ["-vf", filters, "-pix_fmt", kind, *quality, "-x265-params", "log-level=error", "-movflags", "+faststart"]


def _webm(alpha: bool, bits: int, crf: int | None, loops: int, colours: Colours) -> list[str]:
    quality = ["-c:v", "libvpx-vp9", "-b:v", "0", "-crf", str(24 if crf is None else crf), "-row-mt", "1"]
    speed = ["-deadline", "good", "-cpu-used", "4"]
    return ["-vf", tagged(colours), "-pix_fmt", "yuva420p" if alpha else "yuv420p", *quality, *speed]


def _av1(alpha: bool, bits: int, crf: int | None, loops: int, colours: Colours) -> list[str]:
    quality = ["-crf", str(30 if crf is None else crf)]
    speed = {
        "libsvtav1": ["-c:v", "libsvtav1", "-preset", "8"],
        "libaom-av1": ["-c:v", "libaom-av1", "-b:v", "0", "-cpu-used", "6", "-row-mt", "1"],
    }
    encoder = next((name for name in speed if name in ffmpeg.encoders()), None)
    if encoder is None:
        raise UserError("This ffmpeg has no encoder for AV1; leave out --codec, or set IMAGEIO_FFMPEG_EXE to another.")
    kind = "yuv420p" if bits == 8 else "yuv420p10le"
    return ["-vf", (ON_BLACK if alpha else "") + tagged(colours), "-pix_fmt", kind, *speed[encoder], *quality]


def _ffv1(alpha: bool, bits: int, crf: int | None, loops: int, colours: Colours) -> list[str]:
    kind = {(False, 8): "bgr0", (True, 8): "bgra", (False, 16): "gbrp16le", (True, 16): "gbrap16le"}[alpha, bits]
    transfer = "iec61966-2-1" if colours.transfer == "bt709" else colours.transfer
    told = f"setparams=color_primaries={colours.primaries}:color_trc={transfer}"
    return ["-vf", told, "-c:v", "ffv1", "-level", "3", "-g", "1", "-slicecrc", "1", "-pix_fmt", kind]


def _prores(alpha: bool, bits: int, crf: int | None, loops: int, colours: Colours) -> list[str]:
    kind = ["-profile:v", "4444", "-pix_fmt", "yuva444p10le" if alpha else "yuv444p10le", "-vendor", "apl0"]
    return ["-vf", tagged(colours), "-c:v", "prores_ks", *kind]


def _prores_422_hq(alpha: bool, bits: int, crf: int | None, loops: int, colours: Colours) -> list[str]:
    kind = ["-profile:v", "hq", "-pix_fmt", "yuv422p10le", "-vendor", "apl0"]
    return ["-vf", (ON_BLACK if alpha else "") + tagged(colours), "-c:v", "prores_ks", *kind]


def _apng(alpha: bool, bits: int, crf: int | None, loops: int, colours: Colours) -> list[str]:
    return ["-c:v", "apng", "-pix_fmt", "rgba" if alpha else "rgb24", "-plays", str(loops), "-f", "apng"]


def _webp(alpha: bool, bits: int, crf: int | None, loops: int, colours: Colours) -> list[str]:
    kind = ["-pix_fmt", "yuva420p" if alpha else "yuv420p", "-quality", "90", "-compression_level", "3"]
    return ["-c:v", "libwebp_anim", *kind, "-loop", str(loops), "-f", "webp"]


@dataclass(frozen=True)
class Container:
    """A kind of animation file: its options by codec, whether sides must be even, the sound, how often frames are read.

    The first codec is what it gets where none is asked for. `sound` names the codecs taken over as they are; any other
    is turned into the first one, by the options `encoder`, in pairs.
    """

    name: str
    codecs: Mapping[str, Encoding]
    even: bool = False
    sound: tuple[str, ...] = ()
    encoder: tuple[str, ...] = ()
    passes: int = 1

    def encoding(self, codec: str | None) -> Encoding:
        return self.codecs[codec or next(iter(self.codecs))]


# The widest and highest picture that an encoder, or what holds it, takes.
LARGEST = {
    "h264": (16384, 16384), "h265": (8192, 8192), "vp9": (65536, 65536), "av1": (16384, 8704),
    "prores-4444": (65534, 65534),
    "prores-422-hq": (65534, 65534), "gif": (65535, 65535), "webp": (FORMATS[".webp"].longest,) * 2,
}  # fmt: skip

ANIMATIONS = {
    ".mp4": Container(
        "MP4",
        {"h264": _mp4, "h265": _h265},
        even=True,
        sound=("aac", "mp3", "ac3"),
        encoder=("-c", "aac", "-b", "192k"),
    ),
    ".webm": Container(
        "WebM",
        {"vp9": _webm, "av1": _av1},
        even=True,
        sound=("opus", "vorbis"),
        encoder=("-c", "libopus", "-b", "128k"),
    ),
    ".mkv": Container(
        "FFV1", {"ffv1": _ffv1}, sound=("flac", "aac", "mp3", "ac3", "opus", "vorbis"), encoder=("-c", "flac")
    ),
    ".mov": Container(
        "ProRes",
        {"prores-4444": _prores, "prores-422-hq": _prores_422_hq},
        even=True,
        sound=("pcm_s16le", "pcm_s24le", "aac"),
        encoder=("-c", "pcm_s16le"),
    ),
    ".gif": Container("GIF", {"gif": _ffv1}, passes=2),  # by way of a lossless file, see _gif_writer
    ".apng": Container("APNG", {"apng": _apng}),
    ".webp": Container("animated WebP", {"webp": _webp}),
}


def is_animation(path: str | os.PathLike[str]) -> bool:
    """Whether the name alone asks for more than one frame; `.webp` does not, it may be a still."""
    suffix = Path(path).suffix.lower()
    return is_sequence(path) or (suffix in ANIMATIONS and suffix != ".webp")


def passes(path: str | os.PathLike[str]) -> int:
    """How many times each frame of an animation is gone through until it is written."""
    return 1 if is_sequence(path) else ANIMATIONS[Path(path).suffix.lower()].passes


def check_animation(
    path: str | os.PathLike[str],
    fps: float | Fraction = 1,
    codec: str | None = None,
    size: tuple[int, int] | None = None,
) -> None:
    """Raise `UserError` if `animation_writer` has no format for `path`, or not this frame rate, codec or size."""
    if not 0 < fps <= 1000:
        raise UserError(f"Cannot write {path}: a frame rate of {float(fps):g} is not between 0 and 1000.")
    if is_sequence(path):
        if NUMBER.search(NUMBER.sub("", Path(path).name, count=1)):
            raise UserError(f"Cannot write {path}: a sequence's name holds one number, as in name.%04d.png.")
        suffix = Path(path).suffix.lower()
        if suffix in ANIMATIONS and suffix not in FORMATS:
            mend = f"end in one of {' '.join(FORMATS)}, or leave out the number for one {suffix}"
            raise UserError(f"Cannot write {path}: a sequence's files are pictures; {mend}.")
        check_picture_output(path, size=size, codec=codec)
        return
    suffix = Path(path).suffix.lower()
    if suffix not in ANIMATIONS:
        endings = " ".join(ANIMATIONS)
        raise UserError(f"Cannot write {path}: an animation ends in one of {endings}, or is name.%04d.png.")
    known = ANIMATIONS[suffix].codecs
    if codec is not None and codec not in known:
        raise UserError(f"Cannot write {path}: {suffix} holds {' or '.join(known)}, not {codec}; change --codec.")
    if suffix == ".gif" and fps > 50:
        raise UserError(f"Cannot write {path}: GIF shows at most 50 frames a second; lower the rate or use .apng.")
    used = codec or next(iter(known))
    most = LARGEST.get(used)
    if size is not None and most is not None and (size[0] > most[0] or size[1] > most[1]):
        raise UserError(
            f"Cannot write {path}: the result is {size[0]} x {size[1]} pixels, and {used} holds no more than "
            f"{most[0]} x {most[1]}; make it smaller, or write name.%04d.png."
        )


def unheld_of_clip(path: str | os.PathLike[str], codec: str | None, clip: Clip) -> str:
    """What of a clip's depth and of its colours' resolution a video's format has no room for, in a sentence, or ""."""
    container = ANIMATIONS.get(Path(path).suffix.lower())
    if container is None or container.passes > 1 or is_sequence(path):
        return ""
    options = container.encoding(codec)(clip.alpha, clip.bits, None, 0, clip.colours)
    (bits, chroma), (room, kept) = map(_depth, (clip.pixel_format, options[options.index("-pix_fmt") + 1]))
    losses = [f"its {bits} bits a channel become {room}"] if bits > room else []
    losses += [f"its colours of 4:{chroma} become 4:{kept}"] if chroma > kept else []
    return lost(clip.path, losses)


def check_colours(path: str | os.PathLike[str], codec: str | None, clip: Clip, animated: bool) -> None:
    """Raise `UserError` if a file cannot tell what a clip's colours are, or has too few bits for their range."""
    if clip.colours.is_usual:
        return
    suffix = Path(path).suffix.lower()
    container = ANIMATIONS.get(suffix) if animated and not is_sequence(path) else None
    named = " ".join(
        NAMES.get(name, name) for name in (clip.colours.primaries, clip.colours.transfer) if name != "bt709"
    )
    mend = "write .mov, .mkv, .mp4 with --codec h265, .webm with --codec av1, or name.%04d.png"
    if container is None and suffix == ".png":
        return
    if container is None or suffix not in (".mp4", ".webm", ".mkv", ".mov"):
        raise UserError(f"Cannot write {path}: it cannot tell that the colours of {clip.path} are {named}; {mend}.")
    options = container.encoding(codec)(clip.alpha, clip.bits, None, 0, clip.colours)
    if clip.colours.is_high and _depth(options[options.index("-pix_fmt") + 1])[0] < 10:
        raise UserError(f"Cannot write {path}: the colours of {clip.path} are {named}, and 8 bits too few; {mend}.")


def _depth(pixel_format: str) -> tuple[int, str]:
    """Bits a channel of one of ffmpeg's formats, and its chroma subsampling: the digits after the 4."""
    deep = re.search(r"(9|10|12|14|16|48|64)(le|be)$", pixel_format)
    planar = re.search(r"4([0-4])([0-4])p", pixel_format)
    chroma = ":".join(planar.groups()) if planar else "2:0" if pixel_format.startswith("gray") else "4:4"
    return {48: 16, 64: 16}.get(bits := int(deep[1]) if deep else 8, bits), chroma


def check_output(
    path: str | os.PathLike[str],
    *,
    animated: bool = False,
    fps: float | Fraction = 1,
    codec: str | None = None,
    bits: int | None = None,
    size: tuple[int, int] | None = None,
) -> None:
    """Raise `UserError` if there is no format for `path`, as an animation if `animated` or so named, else a still.

    The format must have the codec, the bits a channel and room for the size, (width, height) in pixels, that are given.
    """
    if animated or is_animation(path):
        check_animation(path, fps, codec, size)
        return
    if Path(path).suffix.lower() not in FORMATS:
        endings = f"a picture's name must end in one of {' '.join(FORMATS)}, an animation's in {' '.join(ANIMATIONS)}"
        raise UserError(f"Cannot write {path}: {endings}.")
    check_picture_output(path, bits, size, codec)


def crf_of(quality: int) -> int:
    """The constant rate factor of a video of quality 1 to 100: 45 to 15."""
    return round(45 - 0.3 * quality)


@contextmanager
def animation_writer(
    path: str | os.PathLike[str],
    fps: float | Fraction = 30,
    *,
    codec: str | None = None,
    crf: int | None = None,
    quality: int = 95,
    bits: int | None = None,
    loops: int = 0,
    sound: str | os.PathLike[str] | None = None,
    sound_from: float = 0.0,
    frames: int | None = None,
    first: int = 0,
    resumed: bool = False,
    durations: Sequence[int] | None = None,
    colours: Colours = USUAL,
    timecode: str | None = None,
    like: Picture | None = None,
    cancel: Callable[[], bool] = never,
    passed: Callable[[int], None] = lambda frames: None,
    written: Callable[[int], None] = lambda number: None,
) -> Iterator[FrameWriter]:
    """Yield a function that appends a frame; the file appears when the block ends well, else nothing does.

    path: its ending chooses the format; `name.%04d.png` (or .tif, .exr ...) numbers pictures from `first` on, each of
        which appears as soon as it is written, and stays.
    codec: one of the container's; None is its first. crf: constant rate factor of H.264 (18), VP9 (24) or AV1 (30).
    loops: GIF, APNG, WebP; 0 is for ever. durations: of the frames, in steps of 1 / fps; None is 1 for each.
    colours, timecode: what a video is told to have, the latter of its first frame.
    quality, bits: of a sequence's pictures; see `write_picture`.
    sound: a file whose sound is carried over, from the second `sound_from`, cut to the length of `frames`.
    like: the picture whose profile and metadata the pictures of a sequence get; whether its alpha is premultiplied, so
        that of the frames is.
    cancel: asked with each frame, and ten times a second while the encoder keeps us waiting; true raises `Cancelled`.
    passed: hears of frames that a later pass has gone through, after all were given, in formats that have `passes`.
    written: hears of each file of a sequence, by its number. resumed: it may be that none of them is left to write.
    Frames go to the encoder at once: memory does not grow with their number. Raises `UserError`.
    """
    check_animation(path, fps / min(durations or [1]), codec)
    if is_sequence(path):
        template = like or Picture(np.empty((0, 0, 1), np.uint8))

        def write_one(file: Path, frame: Frame) -> None:
            picture = frame if isinstance(frame, Picture) else template.with_pixels(frame)
            write_picture(file, picture, bits=bits, quality=quality, codec=codec)

        with sequence_writer(path, write_one, first, cancel, written, resumed) as write:
            yield write
        return

    def straight(frame: Frame) -> np.ndarray:
        if isinstance(frame, Picture):
            return frame.straight().pixels
        return like.with_pixels(frame).straight().pixels if like else frame

    container = ANIMATIONS[Path(path).suffix.lower()]
    rate = Fraction(fps).limit_denominator(100_000)
    with replacing(path) as temporary:
        if container.name == "GIF":
            with _gif_writer(temporary, str(path), rate, loops, durations, cancel, passed) as write:
                yield lambda frame, number=None: write(straight(frame))
            return
        sound_in, sound_out = _sound(container, sound, rate, frames, sound_from)
        if timecode is not None and container.even | (container.name == "FFV1"):
            sound_out = [*sound_out, "-metadata", f"timecode={timecode}"]
        encoding = container.encoding(codec)
        even = container.even
        with _Video(
            temporary, str(path), encoding, rate, even, crf, loops, sound_in, sound_out, cancel, durations, colours
        ) as video:
            yield lambda frame, number=None: video.write(straight(frame))
            video.finish()
        if container.name == "animated WebP" and durations:
            _end_webp(temporary, round(sum(durations) * 1000 / rate))


class _Video:
    """Frames into one run of ffmpeg, started when the first frame shows what they are like."""

    def __init__(
        self,
        temporary: Path,
        label: str,
        encoding: Encoding,
        rate: Fraction,
        even: bool = False,
        crf: int | None = None,
        loops: int = 0,
        sound_in: list[str] | None = None,
        sound_out: list[str] | None = None,
        cancel: Callable[[], bool] = never,
        durations: Sequence[int] | None = None,
        colours: Colours = USUAL,
    ) -> None:
        self._durations, self._colours = durations, colours
        self._temporary, self._label, self._encoding, self._rate, self._even = temporary, label, encoding, rate, even
        self._crf, self._loops, self._cancel = crf, loops, cancel
        self._sound_in, self._sound_out = sound_in or [], sound_out or []
        self._process: ffmpeg.Ffmpeg | None = None
        self._kind: tuple[tuple[int, ...], np.dtype] | None = None

    def __enter__(self) -> _Video:
        return self

    def __exit__(self, *exception: object) -> None:
        if self._process is not None:
            self._process.__exit__(*exception)

    def write(self, frame: np.ndarray) -> None:
        if self._cancel():
            raise Cancelled
        if self._process is None:
            self._kind = frame.shape, frame.dtype
            self._process = self._start(frame)
        elif (frame.shape, frame.dtype) != self._kind:
            raise ValueError(f"a frame {frame.shape} {frame.dtype} among frames {self._kind}")
        if frame.dtype == np.float32:
            frame = to_bits(frame, 16)
        if self._even and (frame.shape[0] % 2 or frame.shape[1] % 2):
            # the edge is repeated: a black line would show, a resize would blur
            frame = np.pad(frame, ((0, frame.shape[0] % 2), (0, frame.shape[1] % 2), (0, 0)), mode="edge")
        self._process.feed(np.ascontiguousarray(frame).data.cast("B"))

    def _start(self, frame: np.ndarray) -> ffmpeg.Ffmpeg:
        height, width, channels = frame.shape
        if self._even:
            height, width = height + height % 2, width + width % 2
        bits = 8 if frame.dtype == np.uint8 else 16
        names = ("gray", "ya8", "rgb24", "rgba") if bits == 8 else ("gray16le", "ya16le", "rgb48le", "rgba64le")
        return ffmpeg.Ffmpeg(
            [
                *["-f", "rawvideo", "-pix_fmt", names[channels - 1], "-s", f"{width}x{height}", "-r", str(self._rate)],
                *["-i", "-", *self._sound_in, "-map", "0:v:0"],
                *self._timed(self._encoding(channels in (2, 4), bits, self._crf, self._loops, self._colours)),
                *self._sound_out,
                f"file:{self._temporary}",
            ],
            self._label,
            cancel=self._cancel,
        )

    def _timed(self, options: list[str]) -> list[str]:
        """The options, for frames that are shown for as long as they are to be."""
        if self._durations is None:
            return options
        options, filters = [*options], [shown_for(self._durations)]
        if "-vf" in options:
            place = options.index("-vf")
            filters.append(options[place + 1])
            del options[place : place + 2]
        last = ["-final_delay", str(self._durations[-1] / self._rate)] if "apng" in options else []
        return ["-vf", ",".join(filters), "-fps_mode", "passthrough", *options, *last]

    def finish(self) -> None:
        """Wait for the encoder to have written everything."""
        if self._process is None:
            raise UserError(f"Cannot write {self._label}: the animation has no frame.")
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
    container: Container, sound: str | os.PathLike[str] | None, rate: Fraction, frames: int | None, start: float = 0.0
) -> tuple[list[str], list[str]]:
    """ffmpeg's input and output options that carry the sound of a file over."""
    if sound is None or not container.sound:
        return [], []
    tracks = [(track, codec) for track, codec in enumerate(sound_codecs(sound)) if codec != "none"]
    if not tracks:
        return [], []
    begin = ["-ss", f"{start:.6f}"] if start else []
    length = [] if frames is None else ["-t", f"{float(frames / rate):.6f}"]
    options: list[str] = []
    for number, (track, codec) in enumerate(tracks):
        # What is copied would else begin where the file can be sought to, and hold the first frame back until then.
        chosen = ("-c", "copy", "-copypriorss", "0") if codec in container.sound else container.encoder
        options += ["-map", f"1:a:{track}"]
        for name, value in zip(chosen[::2], chosen[1::2], strict=True):
            options += [f"{name}:a:{number}", value]
    return [*begin, *length, "-i", f"file:{sound}"], options


@contextmanager
def _gif_writer(
    temporary: Path,
    label: str,
    rate: Fraction,
    loops: int,
    durations: Sequence[int] | None,
    cancel: Callable[[], bool],
    passed: Callable[[int], None],
) -> Iterator[Callable[[np.ndarray], None]]:
    """Frames into a lossless file first: a palette of all colours needs all frames, which may not fit in memory."""
    name = temporary_beside(temporary.with_suffix(".mkv"))
    with temporary_file(name) as spool, temporary_file(name.with_suffix(".png")) as palette:

        def with_palette(alpha: bool, bits: int, crf: int | None, loops: int, colours: Colours) -> list[str]:
            generate = f"{SIX_BITS},palettegen=stats_mode=full:reserve_transparent={int(alpha)}"
            first = ["-vf", generate, "-update", "1", f"file:{palette}"]
            return [*first, "-map", "0:v:0", *_ffv1(alpha, bits, crf, loops, colours)]

        with _Video(spool, label, with_palette, rate, cancel=cancel) as video:
            yield lambda frame: video.write(to_bits(frame, 8))
            video.finish()
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
    write_one: Callable[[Path, T], None],
    first: int = 0,
    cancel: Callable[[], bool] = never,
    written: Callable[[int], None] = lambda number: None,
    resumed: bool = False,
) -> Iterator[NumberedWriter[T]]:
    """Yield a function that writes one numbered file by `write_one`, which lets it appear whole.

    path: such as `name.%04d.png`; first: the first number; written: hears of each; resumed: there may be none left to
    write. Raises `UserError`.
    """
    last = first - 1

    def write(item: T, number: int | None = None, /) -> None:
        nonlocal last
        if cancel():
            raise Cancelled
        last = last + 1 if number is None else number
        write_one(numbered(path, last), item)
        written(last)

    yield write
    if last == first - 1 and not resumed:
        raise UserError(f"Cannot write {path}: the animation has no frame.")


# Order of frames ----------------------------------------------------------------------------------------------------


def frame_order(
    count: int, *, ping_pong: bool = False, rounds: int = 1, hold_first: int = 0, hold_last: int = 0
) -> Iterator[int]:
    """The indices of `count` frames in the order they are shown.

    ping_pong: there and back, without showing the two ends twice, so that rounds follow each other smoothly.
    hold_first, hold_last: how many times more the first and the last frame are shown.
    """
    there = [0] * (hold_first + 1) + list(range(1, count)) + [count - 1] * hold_last if count else []
    once = there + list(range(count - 2, 0, -1)) if ping_pong else there
    for _ in range(rounds):
        yield from once


def order_length(
    count: int, *, ping_pong: bool = False, rounds: int = 1, hold_first: int = 0, hold_last: int = 0
) -> int:
    """How many indices `frame_order` gives."""
    back = max(0, count - 2) if ping_pong else 0
    return rounds * (count + back + hold_first + hold_last) if count else 0


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

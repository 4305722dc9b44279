"""What each kind of animation file is encoded with: its containers and codecs, their quality, and what they hold.

Long, as every kind has its row in one table, and the checks below read it.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import inf
from pathlib import Path

from app.errors import UserError
from app.media import ffmpeg
from app.media.clip import USUAL, Clip, Colours, uncoded
from app.media.files import writable
from app.media.formats import FORMATS, check_picture_output, fits_profile
from app.media.losses import lost, unusual_colours
from app.media.numbered import NUMBER, is_sequence
from app.media.video import NAMES, WHITE
from app.model.picture import Picture


def tagged(colours: Colours, bits: int) -> str:
    """The filters that make limited YUV of RGB of so many bits, with the tags players go by.

    The frames' own tags overrule those given to the encoder.
    """
    lowered = TO_WHITE if bits > 8 else ""
    matrix, tags = colours.matrix, f"color_primaries={colours.primaries}:color_trc={colours.transfer}"
    scaled = f"scale=out_color_matrix={matrix}:out_range=tv:flags=accurate_rnd+full_chroma_int+lanczos"
    return f"{lowered}{scaled},setparams=colorspace={matrix}:{tags}:range=tv"


# palettegen counts every colour it meets: among 64 levels a channel it is 20 times faster, as good, and bounded
SIX_BITS = "lutrgb=" + ":".join(f"{channel}='round(val*63/255)*255/63'" for channel in "rgb")
ON_BLACK = "format=gbrap,premultiply=inplace=1,format=gbrp,"
TO_WHITE = "lutrgb=" + ":".join(f"{channel}='val*{WHITE}/65535+0.5'" for channel in "rgb") + ","


@dataclass(frozen=True)
class Stream:
    """Frames for an encoder, with alpha or not, of 8 or 16 bits a channel; `quality` None is the codec's usual one."""

    alpha: bool
    bits: int
    quality: int | None = None
    loops: int = 0
    colours: Colours = USUAL

    @property
    def on_black(self) -> str:
        """The filters for a codec without alpha."""
        # In 8 bits, as ffmpeg 9 makes white black where it multiplies 16.
        return ON_BLACK + tagged(self.colours, 8) if self.alpha else tagged(self.colours, self.bits)

    def crf_or(self, usual: int) -> list[str]:
        """The constant rate factor, the usual one where no quality is asked for."""
        return ["-crf", str(usual if self.quality is None else crf_of(self.quality))]


Encoding = Callable[[Stream], list[str]]
"""ffmpeg's output options for a stream."""


# A Matroska file else has numbers drawn by chance in it, and what is rendered twice would not be the same.
SAME_AGAIN = ("-fflags", "+bitexact")


def _mp4(stream: Stream) -> list[str]:
    quality = ["-c:v", "libx264", "-preset", "medium", *stream.crf_or(18)]
    return ["-vf", stream.on_black, "-pix_fmt", "yuv420p", *quality, "-movflags", "+faststart"]


def _h265(stream: Stream) -> list[str]:
    if "libx265" not in ffmpeg.encoders():
        raise UserError(
            "This ffmpeg has no encoder for H.265; leave out --codec, or set IMAGEIO_FFMPEG_EXE to another."
        )
    kind = "yuv420p" if stream.bits == 8 else "yuv420p10le"
    quality = ["-c:v", "libx265", "-preset", "medium", *stream.crf_or(20), "-tag:v", "hvc1"]
    quiet = ["-x265-params", "log-level=error"]
    return ["-vf", stream.on_black, "-pix_fmt", kind, *quality, *quiet, "-movflags", "+faststart"]


def _webm(stream: Stream) -> list[str]:
    quality = ["-c:v", "libvpx-vp9", "-b:v", "0", *stream.crf_or(24), "-row-mt", "1"]
    speed, kind = ["-deadline", "good", "-cpu-used", "4"], "yuva420p" if stream.alpha else "yuv420p"
    return ["-vf", tagged(stream.colours, stream.bits), "-pix_fmt", kind, *quality, *speed, *SAME_AGAIN]


def _av1(stream: Stream) -> list[str]:
    quality = stream.crf_or(30)
    speed = {
        "libsvtav1": ["-c:v", "libsvtav1", "-preset", "8"],
        "libaom-av1": ["-c:v", "libaom-av1", "-b:v", "0", "-cpu-used", "6", "-row-mt", "1"],
    }
    encoder = next((name for name in speed if name in ffmpeg.encoders()), None)
    if encoder is None:
        raise UserError("This ffmpeg has no encoder for AV1; leave out --codec, or set IMAGEIO_FFMPEG_EXE to another.")
    kind = "yuv420p" if stream.bits == 8 else "yuv420p10le"
    return ["-vf", stream.on_black, "-pix_fmt", kind, *speed[encoder], *quality, *SAME_AGAIN]


def lossless(stream: Stream) -> list[str]:
    kinds = {(False, 8): "bgr0", (True, 8): "bgra", (False, 16): "gbrp16le", (True, 16): "gbrap16le"}
    kind, colours = kinds[stream.alpha, stream.bits], stream.colours
    transfer = "iec61966-2-1" if colours.transfer == "bt709" else colours.transfer
    tags = f"setparams=color_primaries={colours.primaries}:color_trc={transfer}"
    return ["-vf", tags, "-c:v", "ffv1", "-level", "3", "-g", "1", "-slicecrc", "1", "-pix_fmt", kind, *SAME_AGAIN]


def _prores(stream: Stream) -> list[str]:
    kind = ["-profile:v", "4444", "-pix_fmt", "yuva444p10le" if stream.alpha else "yuv444p10le", "-vendor", "apl0"]
    return ["-vf", tagged(stream.colours, stream.bits), "-c:v", "prores_ks", *kind]


def _prores_422_hq(stream: Stream) -> list[str]:
    kind = ["-profile:v", "hq", "-pix_fmt", "yuv422p10le", "-vendor", "apl0"]
    return ["-vf", stream.on_black, "-c:v", "prores_ks", *kind]


def _apng(stream: Stream) -> list[str]:
    return ["-c:v", "apng", "-pix_fmt", "rgba" if stream.alpha else "rgb24", "-plays", str(stream.loops), "-f", "apng"]


def _webp(stream: Stream) -> list[str]:
    if (quality := 90 if stream.quality is None else stream.quality) == 100:
        # Of a lossless file the quality is the encoder's effort.
        kind = ["-pix_fmt", "bgra", "-lossless", "1", "-quality", "75"]
    else:
        kind = ["-pix_fmt", "yuva420p" if stream.alpha else "yuv420p", "-quality", str(quality)]
    return ["-c:v", "libwebp_anim", *kind, "-compression_level", "3", "-loop", str(stream.loops), "-f", "webp"]


@dataclass(frozen=True)
class Container:
    """A kind of animation file: its options by codec, whether sides must be even, the sound, how often frames are read.

    The first codec is what it gets where none is asked for. `sound` names the codecs taken over as they are; any other
    is turned into the first one, by the options `encoder`, in pairs, for the `layouts` of loudspeakers that it has;
    None: all. `ahead` names those whose first packet may begin before the pictures, as decoders need. `roles` is what
    sound can be marked as, `languages` what it calls each of those that it knows; None: it knows all, as ISO 639-2
    calls them.
    """

    name: str
    codecs: Mapping[str, Encoding]
    even: bool = False
    sound: tuple[str, ...] = ()
    encoder: tuple[str, ...] = ()
    layouts: tuple[str, ...] | None = None
    ahead: tuple[str, ...] = ()
    roles: tuple[str, ...] = ()
    languages: Mapping[str, str] | None = None
    passes: int = 1

    def encoding(self, codec: str | None) -> Encoding:
        return self.codecs[codec or next(iter(self.codecs))]


# The widest and highest picture that an encoder, or what holds it, takes.
LARGEST = {
    "h264": (16384, 16384), "h265": (8192, 8192), "vp9": (65536, 65536), "av1": (16384, 8704),
    "prores-4444": (65534, 65534),
    "prores-422-hq": (65534, 65534), "gif": (65535, 65535), "webp": (FORMATS[".webp"].longest,) * 2,
}  # fmt: skip

# Seconds that a frame can be shown for, where a format has no number for more.
LONGEST_SHOWN = {".gif": 655.35, ".webp": 16777.215, ".apng": 65535.0}

# What ffmpeg's muxers were seen to write down and its readers to find again.
ROLES = ("dub", "comment", "forced", "hearing impaired", "visual impaired")

# In a MOV languages are numbers. ffmpeg writes and reads these names of them and, of all others of three letters, none;
# some have other names in ISO 639-2.
MAC_LANGUAGES = """
alb amh ara arm asm aym aze baq bel ben bul bur cat ces chi dan dut dzo eng epo est fin fra geo ger gre grn guj heb hin
hun ice ind iri ita jav jpn kan kas kaz khm kin kir kor kur lao lat lav lit mac mal mar may mlg mlt mol mon nep nor nya
ori orm per pol por pus que ron run rus san sin slk slv smi snd som spa sve swa tam tat tel tgk tgl tha tib tir tuk tur
uig ukr urd uzb vie wel yid
"""
MAC_NAMES = {name: name for name in MAC_LANGUAGES.split()} | {
    "bod": "tib", "cym": "wel", "cze": "ces", "deu": "ger", "ell": "gre", "eus": "baq", "fas": "per", "fre": "fra",
    "gle": "iri", "hye": "arm", "isl": "ice", "kat": "geo", "mkd": "mac", "msa": "may", "mya": "bur", "nld": "dut",
    "rum": "ron", "slo": "slk", "sqi": "alb", "swe": "sve", "zho": "chi",
}  # fmt: skip

# What Opus and FLAC hold (RFC 7845, 5.1.1.2; RFC 9639, 9.1.3): of another ffmpeg makes the nearest for Opus, and names
# it wrongly in FLAC. The 5.1(side) of AC-3 is 5.1 in the words of ffmpeg.
LAYOUTS = ("mono", "stereo", "3.0", "quad", "5.0", "5.1", "6.1", "7.1")

ANIMATIONS = {
    ".mp4": Container(
        "MP4",
        {"h264": _mp4, "h265": _h265},
        even=True,
        sound=("aac", "mp3", "ac3"),
        encoder=("-c", "aac", "-b", "192k"),
        ahead=("aac", "mp3", "ac3"),
        roles=(*ROLES, "captions", "descriptions"),
    ),
    ".webm": Container(
        "WebM",
        {"vp9": _webm, "av1": _av1},
        even=True,
        sound=("opus", "vorbis"),
        encoder=("-c", "libopus", "-b", "128k", "-filter", f"aformat=channel_layouts={'|'.join(LAYOUTS)}"),
        ahead=("opus", "vorbis"),
        layouts=LAYOUTS,
        roles=("forced",),
    ),
    ".mkv": Container(
        "FFV1",
        {"ffv1": lossless},
        sound=("flac", "aac", "mp3", "ac3", "opus", "vorbis"),
        encoder=("-c", "flac"),
        ahead=("ac3", "opus", "vorbis"),  # of AAC and MP3 it would hold the first frame back by a packet
        layouts=LAYOUTS,
        roles=(*ROLES, "original"),
    ),
    ".mov": Container(
        "ProRes",
        {"prores-4444": _prores, "prores-422-hq": _prores_422_hq},
        even=True,
        languages=MAC_NAMES,
        sound=("pcm_s16le", "pcm_s24le", "aac"),
        encoder=("-c", "pcm_s16le"),
        ahead=("aac",),
    ),
    ".gif": Container("GIF", {"gif": lossless}, passes=2),  # by way of a lossless file, see `animation_writer`
    ".apng": Container("APNG", {"apng": _apng}),
    ".webp": Container("animated WebP", {"webp": _webp}),
}


# The videos that tell what their colours are, with the codecs that have enough bits for a high dynamic range.
TELLING = {".mov": None, ".mkv": None, ".mp4": "h265", ".webm": "av1"}


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
    bits: int | None = None,
) -> None:
    """Raise `UserError` if `animation_writer` has no format for `path`, or not this frame rate, codec, size or depth.

    bits: a channel, of the pictures of a sequence; other animations have their codec's.
    """
    if not 0 < fps <= 1000:
        raise UserError(f"Cannot write {path}: a frame rate of {float(fps):g} is not between 0 and 1000.")
    if is_sequence(path):
        if NUMBER.search(NUMBER.sub("", Path(path).name, count=1)):
            raise UserError(f"Cannot write {path}: a sequence's name holds one number, as in name.%04d.png.")
        suffix = Path(path).suffix.lower()
        if suffix in ANIMATIONS and suffix not in FORMATS:
            mend = f"end in one of {' '.join(FORMATS)}, or leave out the number for one {suffix}"
            raise UserError(f"Cannot write {path}: a sequence's files are pictures; {mend}.")
        check_picture_output(path, bits, size, codec)
        return
    suffix = Path(path).suffix.lower()
    if suffix not in ANIMATIONS:
        endings = " ".join(ANIMATIONS)
        raise UserError(f"Cannot write {path}: an animation ends in one of {endings}, or is name.%04d.png.")
    known = ANIMATIONS[suffix].codecs
    if bits is not None:
        mend = "leave out --bits, or write name.%04d.png"
        raise UserError(f"Cannot write {path}: an animation has as many bits a channel as its codec; {mend}.")
    if codec is not None and codec not in known:
        raise UserError(f"Cannot write {path}: {suffix} holds {' or '.join(known)}, not {codec}; change --codec.")
    if suffix == ".gif" and fps > 50:
        raise UserError(f"Cannot write {path}: GIF shows at most 50 frames a second; lower the rate or use .apng.")
    longest = LONGEST_SHOWN.get(suffix, inf)
    if fps * longest < 1 - 1e-9:
        most = f"{suffix} shows no frame for more than {longest:g} seconds"
        raise UserError(f"Cannot write {path}: {most}; use .mp4.")
    used = codec or next(iter(known))
    most = LARGEST.get(used)
    if size is not None and most is not None and (size[0] > most[0] or size[1] > most[1]):
        raise UserError(
            f"Cannot write {path}: the result is {size[0]} x {size[1]} pixels, and {used} holds no more than "
            f"{most[0]} x {most[1]}; make it smaller, or write name.%04d.png."
        )


def unheld_of_clip(
    path: str | os.PathLike[str], codec: str | None, clip: Clip, size: tuple[int, int] | None = None
) -> str:
    """What of a clip's sound, time code, depth and colours' resolution a format has no room for, in a sentence, or "".

    size: of the result, of which some formats have no odd sides.
    """
    container = None if is_sequence(path) else ANIMATIONS.get(Path(path).suffix.lower())
    if container is None or not container.sound:
        has = {"sound": clip.sound, "time code": clip.timecode}
        losses = [f"its {name} is not kept" for name, told in has.items() if told is not None]
        losses += ["how long its frames stand is not kept"] if container is None and clip.durations else []
    else:
        other = dict.fromkeys(sound for sound in clip.sounds if sound not in (*container.sound, "none"))
        losses = [f"its sound ({' '.join(other)}) becomes {container.sound[0]}"] if other else []
        turned = [layout for sound, layout in zip(clip.sounds, clip.layouts, strict=False) if sound in other]
        known = container.layouts
        if known and (moved := [layout for layout in turned if layout.removesuffix("(side)") not in (*known, "")]):
            losses.append(f"the loudspeakers of its sound ({', '.join(dict.fromkeys(moved))}) become others")
        if dropped := [role for role in clip.roles if role not in container.roles]:
            losses.append(f"what its sound is marked as ({', '.join(dropped)}) is not kept")
        spoken = container.languages
        if unknown := [language for language in clip.languages if spoken is not None and language not in spoken]:
            losses.append(f"what its sound is spoken in ({', '.join(unknown)}) is not kept")
        if container.even and size is not None and (size[0] % 2 or size[1] % 2):
            losses.append(f"its last pixels are repeated, as {container.name} has no odd sides")
    if clip.loops > 1 and (container is None or container.sound):
        losses.append(f"that it is played {clip.loops} times is not kept")
    if container is None:
        return lost(clip.path, losses)
    if container.passes > 1:
        room, kept = 8, "4:4"  # by way of a lossless file
    else:
        options = container.encoding(codec)(Stream(clip.alpha, min(clip.bits, 16), colours=clip.colours))
        room, kept = depth_of(options[options.index("-pix_fmt") + 1])
    bits, chroma = depth_of(clip.pixel_format)
    losses += [f"its {bits} bits a channel become {room}"] if bits > room and not clip.is_whole else []
    losses += [f"its colours of 4:{chroma} become 4:{kept}"] if chroma > kept else []
    return lost(clip.path, losses)


def written_size(path: str | os.PathLike[str], size: tuple[int, int]) -> tuple[int, int]:
    """The width and height with which an animation's frames are written: some formats have no odd sides."""
    container = None if is_sequence(path) else ANIMATIONS.get(Path(path).suffix.lower())
    width, height = size
    return (width + width % 2, height + height % 2) if container is not None and container.even else size


def check_colours(
    path: str | os.PathLike[str],
    codec: str | None,
    clip: Clip,
    animated: bool,
    size: tuple[int, int] | None = None,
) -> None:
    """Raise `UserError` if a file cannot tell what a clip's colours are, or has too few bits for their range.

    size: of the result, which what is advised instead has room for.
    """
    if clip.colours.is_usual:
        return
    suffix = Path(path).suffix.lower()
    container = ANIMATIONS.get(suffix) if animated and not is_sequence(path) else None
    named = " ".join(
        NAMES.get(name, name) for name in (clip.colours.primaries, clip.colours.transfer) if name != "bt709"
    )
    if container is None and suffix == ".png":
        return
    stream = Stream(clip.alpha, clip.bits, colours=clip.colours)
    _check_told(path, codec, container, stream, f"the colours of {clip.path} are {named}", not animated, size)


def check_colours_of_picture(
    path: str | os.PathLike[str],
    codec: str | None,
    picture: Picture,
    animated: bool = False,
    size: tuple[int, int] | None = None,
) -> None:
    """Raise `UserError` if a file cannot tell what a picture's colours are, or has too few bits for their range.

    Where the picture has a profile as well, that may tell it. For `size` see `check_colours`.
    """
    codes = picture.chunks.get(b"cICP")
    if codes is None or not (named := unusual_colours(codes[0], codes[1])):
        return
    kind = None if animated and not is_sequence(path) else FORMATS.get(Path(path).suffix.lower())
    if kind is not None and ("chunks" in kind.keeps or fits_profile(picture, kind)):
        return
    container = ANIMATIONS.get(Path(path).suffix.lower()) if kind is None else None
    colours = uncoded(picture.chunks)
    stream = colours and Stream(picture.has_alpha, min(picture.bits, 16), colours=colours)
    _check_told(path, codec, container, stream, f"the picture's colours are {named}", not animated, size)


def _check_told(
    path: str | os.PathLike[str],
    codec: str | None,
    container: Container | None,
    stream: Stream | None,
    what: str,
    is_still: bool,
    size: tuple[int, int] | None,
) -> None:
    """Raise `UserError` for colours that a file of this kind cannot tell, as only some videos can.

    stream: what of them a video would be made of; None if none can tell them.
    """
    kinds = [kind for kind in TELLING.items() if _is_offered(stream, *kind, size)] if stream is not None else []
    videos = [f"{ending} with --codec {codec}" if codec else ending for ending, codec in kinds]
    if stream is None or container is None or Path(path).suffix.lower() not in TELLING:
        mend = _either([".png"] if is_still else [*videos, "name.%04d.png"])
        raise UserError(f"Cannot write {path}: it cannot tell that {what}; {mend}.")
    if not _has_bits(container.encoding(codec), stream):
        mend = _either([*videos, *(["name.%04d.png"] if stream.bits > 8 else [])])  # which has no more than the stream
        raise UserError(f"Cannot write {path}: {what}, and 8 bits are too few; {mend}.")


def _either(kinds: Sequence[str]) -> str:
    """That one of these is to be written; if there is none, as all are too small, that the result is to be smaller."""
    *most, last = kinds or [""]
    return f"write {', '.join(most)}{',' * (len(most) > 1)}{' or ' * bool(most)}{last}" if last else "make it smaller"


def _is_offered(stream: Stream, ending: str, codec: str | None, size: tuple[int, int] | None) -> bool:
    """Whether frames can be written so, in this size, and by this ffmpeg."""
    try:
        check_animation(f"name{ending}", codec=codec, size=size)
        return _has_bits(ANIMATIONS[ending].encoding(codec), stream)
    except UserError:  # an encoder that is not there, or holds no such size
        return False


def _has_bits(encoding: Encoding, stream: Stream) -> bool:
    options = encoding(stream)
    return not stream.colours.is_high or depth_of(options[options.index("-pix_fmt") + 1])[0] >= 10


def depth_of(pixel_format: str) -> tuple[int, str]:
    """Bits a channel of one of ffmpeg's formats, and its chroma subsampling: the digits after the 4."""
    deep = re.search(r"(9|10|12|14|16|48|64)(le|be)$", pixel_format)
    planar = re.search(r"4([0-4])([0-4])p", pixel_format)
    chroma = ":".join(planar.groups()) if planar else "2:0" if pixel_format.startswith("gray") else "4:4"
    return {48: 16, 64: 16}.get(bits := int(deep[1]) if deep else 8, bits), chroma


def has_alpha(pixel_format: str) -> bool:
    """Whether one of ffmpeg's formats has alpha."""
    return re.match(r"yuva|rgba|bgra|gbrap|ya", pixel_format) is not None


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
        check_animation(path, fps, codec, size, bits)
        return
    if Path(path).suffix.lower() not in FORMATS:
        writable(path)  # of a folder or a device it is not the name's ending that is told
        endings = f"a picture's name must end in one of {' '.join(FORMATS)}, an animation's in {' '.join(ANIMATIONS)}"
        raise UserError(f"Cannot write {path}: {endings}.")
    check_picture_output(path, bits, size, codec)


def crf_of(quality: int) -> int:
    """The constant rate factor of a video of quality 1 to 100: 45 to 15."""
    return round(45 - 0.3 * quality)

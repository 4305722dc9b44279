"""Reading a clip: what it is, and its frames one after the other.

Long, as everything known of a clip is picked out of the lines that ffmpeg prints of it, by the functions below.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Generator
from contextlib import closing
from dataclasses import dataclass
from fractions import Fraction
from itertools import islice
from pathlib import Path

import numpy as np

from app.errors import About, UserError
from app.media import ffmpeg
from app.media.clip import HIGH, WHOLE, Colours, FileClip, FrameRange, has_changed
from app.media.inputs import MAX_PIXELS, check_size, open_input, read_start
from app.media.losses import lost, not_kept
from app.model.picture import Picture
from app.progress import never

# swscale takes 16 bits of RGB for 8 with bits behind: what it makes of the white of limited YUV, and takes for it.
WHITE = 65283

SEEKABLE = (".mp4", ".m4v", ".mov", ".mkv", ".webm", ".avi")

# What ffmpeg calls colours that are BT.709 or sRGB, or nearly; and the others' usual names.
USUAL_PRIMARIES = {"", "unknown", "reserved", "bt709", "gbr"}
USUAL_TRANSFERS = {*USUAL_PRIMARIES, "iec61966-2-1", "smpte170m", "bt2020-10", "bt2020-12"}
NAMES = {
    "bt2020": "BT.2020", "smpte2084": "PQ", "arib-std-b67": "HLG", "smpte432": "Display P3", "smpte431": "DCI-P3",
    "smpte170m": "BT.601", "bt470bg": "BT.601",
}  # fmt: skip

KEPT_PRIMARIES = ("bt2020", "smpte432", "smpte431")
UNKEPT = {
    "subtitles": r"Stream #0.*: Subtitle: ", "chapters": r"Chapter #0", "attachments": r"Stream #0.*: Attachment: ",
    "cover pictures": r"Stream #0.*: Video: .*attached pic",
}  # fmt: skip
# What every file has of its own, and the time code, which is kept.
OWN_TAGS = {"major_brand", "minor_version", "compatible_brands", "encoder", "creation_time", "timecode"}
# Of a track: what is written anew, counted by the muxer, or kept otherwise.
OWN_TRACK_TAGS = {*OWN_TAGS, "handler_name", "vendor_id", "duration", "alpha_mode", "rotate"}
COUNTED = re.compile("bps|number_of_|_statistics_|duration|source_id", re.IGNORECASE)
# What is applied, is of the encoding, or told by `_mastering`; ffmpegs write the names with and without spaces.
OWN_SIDE_DATA = {"displaymatrix", "cpb", "cpbproperties", "masteringdisplaymetadata", "contentlightlevelmetadata"}
TRACK = re.compile(
    r"^( *)Stream #0:\d+(?:\[\w+\])?(?:\(([^)\n]*)\))?: (Video|Audio|Data): (.*)\n((?:\1 +.*\n)*)", re.MULTILINE
)
TIMECODE = re.compile(r"^\s+timecode\s*: (\d\d:\d\d:\d\d[:;.]\d\d)\s*$", re.MULTILINE | re.IGNORECASE)


@dataclass(frozen=True, kw_only=True)
class Video(FileClip):
    """A video file as it is shown: upright, with square pixels, at a constant rate.

    Attributes:
        frames: by its duration.
        uncut: how many it should have, if it ends before its header says that it does.
        bits: 8, or 16 for what has more than 8.
        file_size, inode, written: of the file when it was looked into; the last in nanoseconds.
    """

    fps: Fraction
    uncut: int | None = None
    decoder: tuple[str, ...]
    filters: str
    file_size: int
    inode: tuple[int, int]
    written: int

    def pictures(
        self,
        part: FrameRange = WHOLE,
        is_kept: Callable[[int], bool] = lambda number: False,
        cancel: Callable[[], bool] = never,
        notice: Callable[[str], None] = lambda said: None,
    ) -> Generator[tuple[int, Picture], None, None]:
        """See `Clip`. Raises `UserError` if it ends before the part begins."""
        (first, last), number = part, -1
        with closing(self.read_frames(cancel, notice)) as frames:
            for number, frame in enumerate(islice(frames, None if last is None else last + 1)):
                if number >= first and not is_kept(number):
                    yield number, Picture(frame)
        if 0 <= number < first:
            raise UserError(f"the clip has the frames 0-{number}, and none from {first} on")

    def pictures_from(
        self, number: int, cancel: Callable[[], bool] = never, notice: Callable[[str], None] = lambda said: None
    ) -> Generator[tuple[int, Picture], None, None]:
        """See `Clip`: what comes before is not decoded, where the frames can be found by their times."""
        if not number or not self.is_steady:
            yield from self.pictures((number, None), cancel=cancel, notice=notice)
            return
        with closing(self.read_frames(cancel, notice, number)) as frames:
            for at, frame in enumerate(frames, number):
                yield at, Picture(frame)

    def read_frames(
        self,
        cancel: Callable[[], bool] = never,
        notice: Callable[[str], None] = lambda said: None,
        first: int = 0,
    ) -> Generator[np.ndarray, None, None]:
        """Yield each frame (h, w, 3 or 4), uint8 or uint16, top row first; memory holds one at a time.

        first: of a steady clip, where to begin.
        notice: hears, at the end, what was damaged or missing in a clip that could be read all the same.
        Raises `UserError`, with a status of its own if the file was cut or written anew meanwhile.
        """
        channels = 4 if self.alpha else 3
        kind = {(False, 8): "rgb24", (True, 8): "rgba", (False, 16): "rgb48le", (True, 16): "rgba64le"}
        seek, filters = [], self.filters
        if first:
            # A quarter of a frame early: no rounding of times leaves it out, and none is shown twice to fill the gap.
            seek = ["-ss", f"{self.late + (first - 0.25) / self.fps:.6f}"]
            filters = filters.removeprefix(_delayed(self.late))
        arguments = [
            *[*self.decoder, *seek, "-i", f"file:{self.path}", "-map", "0:v:0", "-vf", filters, "-r", str(self.fps)],
            *["-f", "rawvideo", "-pix_fmt", kind[self.alpha, self.bits], "-"],
        ]
        self._check_unchanged(begins=True)
        dtype = np.dtype(np.uint8 if self.bits == 8 else np.uint16)
        shape = self.height, self.width, channels
        name = str(self.path)
        with ffmpeg.Ffmpeg(arguments, name, doing="read", cancel=cancel, level="info") as process:
            count = first
            try:
                for block in process.blocks(int(np.prod(shape)) * dtype.itemsize):
                    yield np.frombuffer(block, dtype).reshape(shape)
                    count += 1
            except UserError:
                self._check_unchanged()
                raise
            self._check_unchanged()
            if len(sizes := process.sizes()) > 1:
                shown = f"{self.width} x {self.height}"
                notice(About(name, f": its frames are of {' and '.join(sizes)} pixels, and all become {shown}"))
            if self.uncut is not None and self.uncut > count:
                notice(About(name, f" was cut: of the {self.uncut} frames that it should have, {count} are there"))
            elif complaint := process.complaint():
                notice(About(name, f" is damaged, and what could be read of it was used (ffmpeg says: {complaint})"))
            elif self.frames is not None and count < self.frames - max(2, self.fps):  # by more than a second
                besides = ": its sound is longer, or it was cut" if self.sounds else ""
                notice(About(name, f" should have about {self.frames} frames by its length, and has {count}{besides}"))

    def _check_unchanged(self, begins: bool = False) -> None:
        """Raise `UserError` if the file is not as it was: the frames would be fewer, or some of another clip.

        One that was deleted or replaced by another since reading began is still read to its end.
        """
        try:
            now = self.path.stat()
        except OSError:
            return
        is_same = (now.st_dev, now.st_ino) == self.inode
        if (is_same or begins) and (is_same, now.st_size, now.st_mtime_ns) != (True, self.file_size, self.written):
            raise has_changed(self.path, self.file_size, now.st_size)


def read_clip(path: str | os.PathLike[str], max_pixels: int = MAX_PIXELS) -> Video:
    """Look into a video file; raises `UserError` when it is none."""
    file = Path(path)
    with open_input(file, "video") as stream:
        seen = os.fstat(stream.fileno())  # before it is looked into: what is written after that is a change
    uncut = _uncut(read_start(file, "video", 52), seen.st_size)
    told = _banner(file)
    video = next((line for line in told.splitlines() if re.search(r"Stream #0.*: Video: ", line)), None)
    if video is None:
        raise UserError(f"Cannot read {path}: it is not a video, or it is damaged; give the name of a video.")
    kind = re.search(r"Video: [^,]*, ?(?:none, )?(\w+)", video)
    pixel_format = kind.group(1) if kind else ""
    hidden = "Video: vp9" in video and "alpha_mode" in told  # a second stream, which only libvpx decodes
    alpha = hidden or bool(re.match(r"(yuva|gbrap|rgba|bgra|argb|abgr|ya\d|pal8)", pixel_format))
    matrix = "" if re.search(r"bt709|bt2020|smpte170m|bt470bg|gbr", video) else _untagged(video)
    filters = f"scale={'iw*sar' if _wide(video) else 'iw'}:ih{matrix}:flags=accurate_rnd+full_chroma_int,setsar=1"
    deep = re.search(r"(9|10|12|14|16|48|64)(le|be)$", pixel_format) is not None
    if deep:
        filters += _to_white(pixel_format, is_full=re.search(rf"{pixel_format}\(pc", video) is not None, alpha=alpha)
    late = _late(told, video)
    if late:  # or the first frame would be shown from the sound's start on
        filters = _delayed(late) + filters
    width, height, fps = _shown(file, filters)
    filters = re.sub(r"scale=iw(\*sar)?:ih", f"scale={width}:{height}", filters)  # should others follow
    colours, sounds = _colours(video), _sounds(told)
    check_size(file, width, height, max_pixels)
    seconds = _seconds(told)
    return Video(
        path=file,
        width=width,
        height=height,
        fps=fps,
        frames=max(1, round((seconds - late) * fps)) if seconds is not None else None,
        uncut=uncut,
        sounds=tuple(track.codec for track in sounds),
        layouts=tuple(track.layout for track in sounds),
        roles=tuple(dict.fromkeys(role for track in sounds for role in track.roles)),
        languages=tuple(dict.fromkeys(track.language for track in sounds if track.language)),
        late=late,
        bits=16 if deep else 8,
        pixel_format=pixel_format,
        alpha=alpha,
        decoder=("-c:v", "libvpx-vp9") if hidden else (),
        filters=filters,
        is_steady=abs(_shortest(video) - 1) < 0.02 and file.suffix.lower() in SEEKABLE and not _is_early(told),
        note=lost(file, [*_losses(told, video, fps), *(_mastering(file) if colours.is_high else [])]),
        colours=colours,
        timecode=found[1] if (found := TIMECODE.search(told)) else None,
        file_size=seen.st_size,
        inode=(seen.st_dev, seen.st_ino),
        written=seen.st_mtime_ns,
    )


def _uncut(head: bytes, size: int) -> int | None:
    """How many frames a file of this size should have, if it is an AVI that was cut; ffmpeg tells how many are left.

    What was never finished has no length in its header, or -1, and tells of no frames (AVI RIFF File Reference).
    """
    found = re.match(rb"RIFF(.{4})AVI LIST.{4}hdrlavih.{20}(.{4})", head, re.DOTALL)
    length, frames = (int.from_bytes(part, "little") for part in found.groups()) if found else (0, 0)
    return frames if size < 8 + length < 2**32 else None


def _wide(video: str) -> str:
    """The width and height of a pixel, as 4:3, by ffmpeg's words about a stream; "" of square ones."""
    aspect = re.search(r"SAR (\d+):(\d+)", video)
    return "" if aspect is None or aspect[1] == aspect[2] else f"{aspect[1]}:{aspect[2]}"


def _to_white(pixel_format: str, is_full: bool, alpha: bool) -> str:
    """The filter that puts the white of more than 8 bits, and what is opaque, where 16 bits of RGB have it.

    Of limited YUV swscale makes a white of `WHITE`, of full YUV, grey and alpha the code with zeros behind.
    """
    if re.match(r"(gbr|rgb|bgr|argb|abgr|x2|0rgb|xyz)", pixel_format):
        return ""
    bits = int(found[1]) if (found := re.search(r"(9|10|12|14|16)(?:le|be)$", pixel_format)) else 16
    shifted = (2**bits - 1) << (16 - bits)
    white = shifted if is_full or pixel_format.startswith(("gray", "ya")) else WHITE
    lifts = [f"{channel}='val*65535/{white}+0.5'" for channel in "rgb"] + [f"a='val*65535/{shifted}+0.5'"] * alpha
    return f",format={'rgba64le' if alpha else 'rgb48le'},lutrgb={':'.join(lifts)}"


def _delayed(late: float) -> str:
    """The filter that lets frames begin `late` seconds earlier."""
    return f"setpts=PTS-{late}/TB,"


def _pixel_words(video: str) -> list[str]:
    """What ffmpeg says of a stream's pixels, in brackets after their format: range, colours, fields."""
    found = re.search(r"Video: [^,]*, ?(?:none, )?\w+\(([^)]*)", video)
    return [word.strip() for word in found[1].split(",")] if found else []


def _losses(told: str, video: str, fps: Fraction) -> list[str]:
    """What of a clip is not understood, or not carried over, by ffmpeg's words about its first video stream."""
    losses = []
    _, primaries, transfer = _named_colours(video)
    odd = [primaries] if primaries not in USUAL_PRIMARIES else []
    odd += [transfer] if transfer not in USUAL_TRANSFERS and transfer not in odd else []
    if odd:
        named = " ".join(NAMES.get(name, name) for name in odd)
        kept = all(name in (*KEPT_PRIMARIES, *HIGH) for name in odd)
        losses.append(f"its colours are {named} and are {'mixed as if' if kept else 'treated as'} BT.709")
    if any(word.startswith(("top", "bottom")) for word in _pixel_words(video)):
        losses.append("it is interlaced, and its fields are treated as whole frames")
    if min(abs(_shortest(video) - 1), abs(_shortest(video) - 2)) > 0.02:  # 2: of fields
        losses.append(f"its frames come at a rate that varies, and become {float(fps):g} a second")
    if ratio := _wide(video):
        losses.append(f"its pixels of {ratio} become square")
    count = sum("attached pic" not in line for line in re.findall(r"Stream #0.*: Video: .*", told))
    if count > 1:
        losses.append(f"of its {count} video tracks only the first is used")
    losses += [f"its {name} are not kept" for name, sign in UNKEPT.items() if re.search(sign, told)]
    head = told.partition("Input #0")[2].partition("Duration: ")[0]
    if tags := [tag for tag in re.findall(r"^    (\S+)\s*: ", head, re.MULTILINE) if tag.lower() not in OWN_TAGS]:
        losses.append(not_kept("tag", tags))
    return losses + _losses_of_tracks(told)


def _losses_of_tracks(told: str) -> list[str]:
    """What belongs to the tracks of pictures and of time codes, and is not carried over."""
    tags: dict[str, None] = {}
    sides: dict[str, None] = {}
    for _, language, kind, _, lines in TRACK.findall(told):
        if kind == "Audio":
            continue
        if kind == "Video" and language not in ("", "und"):
            tags["language"] = None
        metadata, _, side_data = lines.partition("Side data:")
        for tag in re.findall(r"^ +(\S[^:]*?) *: ", metadata, re.MULTILINE):
            if tag.lower() not in OWN_TRACK_TAGS and not COUNTED.match(tag):
                tags[tag] = None
        for side in re.findall(r"^ +(\w[^:,\n]*)[:,]", side_data, re.MULTILINE):
            if side.replace(" ", "").lower() not in OWN_SIDE_DATA:
                sides[side] = None
    losses = [not_kept("track's tag", list(tags))] if tags else []
    return losses + ([not_kept("data block", list(sides))] if sides else [])


def _mastering(file: Path) -> list[str]:
    """What the first frame tells of the display that it was graded on and of its lights, which is not kept."""
    first = ("-map", "0:v:0", "-frames:v", "1")
    done = ffmpeg.ask("-i", f"file:{file}", *first, "-vf", "showinfo", "-f", "null", "-")
    told = done.stderr.decode("utf-8", "replace")
    kinds = {"Mastering display metadata": "mastering display", "Content light level metadata": "light levels"}
    found = [name for sign, name in kinds.items() if sign in told]
    return [f"its {' and '.join(found)} (HDR10) are not kept"] if found else []


def _shortest(video: str) -> float:
    """How many of a stream's shortest frames make one as long as they are on average; 1 where it is not told."""
    rates = re.search(r", ([\d.]+) fps, ([\d.]+)(k?) tbr", video)
    return float(rates[2]) * (1000 if rates[3] else 1) / float(rates[1]) if rates else 1.0


def _named_colours(video: str) -> tuple[str, str, str]:
    """ffmpeg's names of a stream's matrix, primaries and transfer, one for all where they are alike; "" if untold."""
    named = next((word for word in _pixel_words(video) if re.search(r"/|bt|smpte|arib|film|iec", word)), "")
    parts = named.split("/")
    return (parts[0], parts[1], parts[2]) if len(parts) == 3 else (named, named, named)


def _colours(video: str) -> Colours:
    """What is written again of a stream's colours: the usual where they are taken for these."""
    _, primaries, transfer = _named_colours(video)
    primaries = primaries if primaries in KEPT_PRIMARIES else "bt709"
    transfer = transfer if transfer in HIGH else "bt709"
    return Colours(primaries, transfer, "bt2020nc" if primaries == "bt2020" else "bt709")


@dataclass(frozen=True)
class SoundTrack:
    """A sound track, as ffmpeg tells of it.

    Attributes:
        codec: "none" where ffmpeg knows none for it.
        name: what an MP4 or MOV calls it; ffmpeg takes it over as a title from other containers only.
        roles: what it is for, such as comment or forced, besides default.
        language: three letters of ISO 639-2; "" if it does not say.
        layout: of its channels, as 5.1(side); "" if there is none.
    """

    codec: str
    name: str
    roles: tuple[str, ...]
    language: str
    layout: str = ""


def sound_tracks(path: str | os.PathLike[str]) -> tuple[list[SoundTrack], bool]:
    """The sound tracks of a file, and whether its times begin below 0: there ffmpeg seeks elsewhere, or not at all.

    Raises `UserError` when it has neither picture nor sound.
    """
    told = _banner(Path(path))
    if "Stream #0" not in told:
        raise UserError(f"Cannot read {path}: there is neither picture nor sound in it; give the name of a clip.")
    return _sounds(told), _is_early(told)


def _sounds(told: str) -> list[SoundTrack]:
    tracks = []
    for _, language, kind, words, lines in TRACK.findall(told):
        if kind == "Audio":
            codec, name = re.match(r"\w+", words), re.search(r"^ +name +: (.*?) *$", lines, re.MULTILINE)
            roles = [role for role in re.findall(r" \(([a-z ]+)\)", words) if role != "default"]
            spoken = "" if language == "und" else language
            layout = re.search(r" Hz, ([^, ]+)", words)
            tracks.append(
                SoundTrack(
                    codec[0] if codec else "none",
                    name[1] if name else "",
                    tuple(roles),
                    spoken,
                    layout[1] if layout else "",
                )
            )
    return tracks


def _seconds(told: str) -> float | None:
    """How long a file is, from its start on, by ffmpeg's words; None if it does not say."""
    length = re.search(r"Duration: (\d+):(\d+):([\d.]+)(?:, start: (-?[\d.]+))?", told)
    if length is None:
        return None
    seconds = int(length[1]) * 3600 + int(length[2]) * 60 + float(length[3])
    start = float(length[4] or 0)
    # Of a Matroska this is when it ends, which counts from 0 whenever it starts, as a recording that went on.
    return seconds - start if "Input #0, matroska" in told and seconds > start else seconds


def _is_early(told: str) -> bool:
    return re.search(r"Duration: .*, start: -", told) is not None


def _late(told: str, video: str) -> float:
    """Seconds that a video stream starts after its file does."""
    file, stream = re.search(r"Duration: .*, start: (-?[\d.]+)", told), re.search(r", start (-?[\d.]+)", video)
    return max(0.0, round(float(stream.group(1)) - float(file.group(1)), 6)) if file and stream else 0.0


def _banner(file: Path) -> str:
    """What ffmpeg says of a file it opens; imageio-ffmpeg brings no ffprobe."""
    if not read_start(file, "video", 1):
        raise UserError(f"Cannot read {file}: the file is empty; save or download it again.")
    return ffmpeg.ask("-i", f"file:{file}").stderr.decode("utf-8", "replace")


def _untagged(video: str) -> str:
    """The matrix players take for a video that does not tell: BT.709 from 720 lines on."""
    size = re.search(r", (\d{2,5})x(\d{2,5})", video)
    return ":in_color_matrix=bt709" if size and "yuv" in video and int(size.group(2)) >= 720 else ""


def _shown(file: Path, filters: str) -> tuple[int, int, Fraction]:
    """Width, height and exact frame rate of the first frame as decoded, from the header of `framemd5`."""
    arguments = ["-i", f"file:{file}", "-map", "0:v:0", "-vf", filters, "-frames:v", "1", "-f", "framemd5", "-"]
    with ffmpeg.Ffmpeg(arguments, str(file), doing="read") as process:
        told = b"".join(bytes(block) for block in process.blocks(1)).decode()
    size = re.search(r"#dimensions 0: (\d+)x(\d+)", told)
    step = re.search(r"#tb 0: (\d+)/(\d+)", told)
    if size is None or step is None:
        raise UserError(f"Cannot read {file}: it has no frame that can be decoded; get it again.")
    return int(size.group(1)), int(size.group(2)), Fraction(int(step.group(2)), int(step.group(1)))

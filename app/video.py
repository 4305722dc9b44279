"""Reading a clip: what it is, and its frames one after the other."""

from __future__ import annotations

import os
import re
import subprocess
from collections.abc import Callable, Generator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from app import ffmpeg
from app.errors import UserError
from app.inputs import open_input
from app.pictures import MAX_PIXELS, check_size
from app.progress import never


@dataclass(frozen=True)
class Clip:
    """A video file as it is shown: upright, with square pixels, at a constant rate.

    rotation: degrees clockwise that were undone. frames: about how many, by its duration; None when unknown.
    sound: name of its first sound track's codec, None if silent. late: seconds that its frames begin after the file,
    as a rule after its sound; 0 where an older ffmpeg does not tell. bits: 8, or 16 for what has more than 8.
    """

    path: Path
    width: int
    height: int
    fps: Fraction
    frames: int | None
    rotation: int
    sound: str | None
    late: float
    bits: int
    alpha: bool
    decoder: tuple[str, ...]
    filters: str

    def read_frames(
        self, cancel: Callable[[], bool] = never, notice: Callable[[str], None] = lambda said: None
    ) -> Generator[np.ndarray, None, None]:
        """Yield each frame (h, w, 3 or 4), uint8 or uint16, top row first; memory holds one at a time.

        notice: hears, at the end, what was damaged in a clip that could be read all the same.
        """
        channels = 4 if self.alpha else 3
        kind = {(False, 8): "rgb24", (True, 8): "rgba", (False, 16): "rgb48le", (True, 16): "rgba64le"}
        arguments = [
            *[*self.decoder, "-i", f"file:{self.path}", "-map", "0:v:0", "-vf", self.filters, "-r", str(self.fps)],
            *["-f", "rawvideo", "-pix_fmt", kind[self.alpha, self.bits], "-"],
        ]
        dtype = np.dtype(np.uint8 if self.bits == 8 else np.uint16)
        shape = self.height, self.width, channels
        with ffmpeg.Ffmpeg(arguments, str(self.path), doing="read", cancel=cancel) as process:
            for block in process.blocks(int(np.prod(shape)) * dtype.itemsize):
                yield np.frombuffer(block, dtype).reshape(shape)
            if complaint := process.complaint():
                notice(f"{self.path} is damaged, and what could be read of it was used (ffmpeg says: {complaint})")


def read_clip(path: str | os.PathLike[str], max_pixels: int = MAX_PIXELS) -> Clip:
    """Look into a video file; raises `UserError` when it is none."""
    file = Path(path)
    told = _banner(file)
    video = next((line for line in told.splitlines() if re.search(r"Stream #0.*: Video: ", line)), None)
    if video is None:
        raise UserError(f"Cannot read {path}: it is no video, or damaged; give the name of a video.")
    kind = re.search(r"Video: [^,]*, ?(?:none, )?(\w+)", video)
    pixel_format = kind.group(1) if kind else ""
    hidden = "Video: vp9" in video and "alpha_mode" in told  # a second stream, which only libvpx decodes
    alpha = hidden or bool(re.match(r"(yuva|gbrap|rgba|bgra|argb|abgr|ya\d|pal8)", pixel_format))
    matrix = "" if re.search(r"bt709|bt2020|smpte170m|bt470bg|gbr", video) else _untagged(video)
    aspect = re.search(r"SAR (\d+):(\d+)", video)
    square = aspect is None or aspect.group(1) == aspect.group(2)
    filters = f"scale={'iw' if square else 'iw*sar'}:ih{matrix}:flags=accurate_rnd+full_chroma_int,setsar=1"
    late = _late(told, video)
    if late:  # or the first frame would be shown from the sound's start on
        filters = f"setpts=PTS-{late}/TB,{filters}"
    width, height, fps = _shown(file, filters)
    check_size(file, width, height, max_pixels)
    length = re.search(r"Duration: (\d+):(\d+):([\d.]+)", told)
    seconds = sum(float(n) * s for n, s in zip(length.groups(), (3600, 60, 1), strict=True)) if length else None
    rotation = re.search(r"rotation of (-?[\d.]+) degrees", told)
    return Clip(
        path=file,
        width=width,
        height=height,
        fps=fps,
        frames=max(1, round((seconds - late) * fps)) if seconds is not None else None,
        rotation=round(-float(rotation.group(1))) % 360 if rotation else 0,
        sound=_sound_codec(told),
        late=late,
        bits=16 if re.search(r"(9|10|12|14|16|48|64)(le|be)$", pixel_format) else 8,
        alpha=alpha,
        decoder=("-c:v", "libvpx-vp9") if hidden else (),
        filters=filters,
    )


def sound_codec(path: str | os.PathLike[str]) -> str | None:
    """The codec of a file's first sound track, None when it has no sound; raises `UserError` when it has nothing."""
    told = _banner(Path(path))
    if "Stream #0" not in told:
        raise UserError(f"Cannot read {path}: there is neither picture nor sound in it; give the name of a clip.")
    return _sound_codec(told)


def _sound_codec(told: str) -> str | None:
    found = re.search(r"Stream #0.*: Audio: (\w+)", told)
    return found.group(1) if found else None


def _late(told: str, video: str) -> float:
    """Seconds that a video stream starts after its file does."""
    file, stream = re.search(r"Duration: .*, start: (-?[\d.]+)", told), re.search(r", start (-?[\d.]+)", video)
    return max(0.0, round(float(stream.group(1)) - float(file.group(1)), 6)) if file and stream else 0.0


def _banner(file: Path) -> str:
    """What ffmpeg says of a file it opens; imageio-ffmpeg brings no ffprobe."""
    with open_input(file, "video") as stream:
        if not stream.read(1):
            raise UserError(f"Cannot read {file}: the file is empty; save or download it again.")
    command = [ffmpeg.executable(), "-hide_banner", "-i", f"file:{file}"]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, check=False)
    return done.stderr.decode("utf-8", "replace")


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

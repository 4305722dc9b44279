"""Animations and clips: checked with ffprobe and Pillow; failures, a full disk and the wish to stop leave nothing."""

from __future__ import annotations

import itertools
import json
import os
import re
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from PIL import Image, ImageCms

from app.errors import Cancelled, UserError
from app.media import animation, encoders, ffmpeg, files
from app.media.animation import AnimationOptions, animation_writer, frame_order, reordered
from app.media.clip import USUAL, Colours
from app.media.depth import to_bits
from app.media.encoders import check_animation, crf_of, is_animation, unheld_of_clip
from app.media.pictures import read_picture
from app.media.sequence import PictureSequence
from app.media.source import open_source
from app.media.video import read_clip, sound_tracks
from app.model.picture import Picture

# What is left open is told when it is collected, where nothing can be raised any more.
pytestmark = [
    pytest.mark.usefixtures("collected"),
    pytest.mark.filterwarnings("error::ResourceWarning", "error::pytest.PytestUnraisableExceptionWarning"),
]

SRGB = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()


def frames(
    count: int, channels: int = 3, height: int = 31, width: int = 45, dtype: type = np.uint8
) -> Iterator[np.ndarray]:
    """Smooth pictures that move, no two alike."""
    y, x = np.mgrid[0:height, 0:width]
    for index in range(count):
        light = 127 + 100 * np.sin(x / 9 + index) * np.cos(y / 7)
        planes = [light, 255 - light, np.full_like(light, index * 20 % 255), np.clip(x * 8, 0, 255)]
        chosen = [[0], [0, 3], [0, 1, 2], [0, 1, 2, 3]][channels - 1]
        eight = np.stack([planes[index] for index in chosen], axis=-1).astype(np.uint8)
        yield eight if dtype is np.uint8 else to_bits(eight, np.dtype(dtype).itemsize * 8)


def save(path: Path, count: int = 5, fps: float | Fraction = 12, channels: int = 3, dtype: type = np.uint8, **options):
    with animation_writer(path, fps, AnimationOptions(**options)) as write:
        for frame in frames(count, channels, dtype=dtype):
            write(frame)


def probe(path: Path) -> list[dict]:
    """The streams of a file as ffprobe has them."""
    command = ["ffprobe", "-v", "error", "-count_frames", "-show_streams", "-of", "json", str(path)]
    return json.loads(subprocess.run(command, capture_output=True, check=True).stdout)["streams"]


def contents(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


# Formats ------------------------------------------------------------------------------------------------------------


PIXEL_FORMATS = {  # without and with alpha
    (".mp4", 8): ("h264", "yuv420p", "yuv420p"),
    (".mp4", 16): ("h264", "yuv420p", "yuv420p"),
    (".webm", 8): ("vp9", "yuv420p", "yuv420p"),  # alpha is a second stream, see below
    (".mkv", 8): ("ffv1", "bgr0", "bgra"),
    (".mkv", 16): ("ffv1", "gbrp16le", "gbrap16le"),
    (".mov", 8): ("prores", "yuv444p1", "yuva444p1"),  # ffprobe says 10 or 12 bits, by its version
    (".mov", 16): ("prores", "yuv444p1", "yuva444p1"),
    (".apng", 8): ("apng", "rgb24", "rgba"),
    (".gif", 8): ("gif", "bgra", "bgra"),
}


@pytest.mark.parametrize("ending", [".mkv", ".webm"])
def test_what_is_written_twice_is_the_same(tmp_path: Path, ending: str):
    for name in ("once", "again"):
        save(tmp_path / (name + ending), count=1)
    assert (tmp_path / f"once{ending}").read_bytes() == (tmp_path / f"again{ending}").read_bytes()


@pytest.mark.parametrize("channels", [2, 3])
@pytest.mark.parametrize(("ending", "bits"), PIXEL_FORMATS)
def test_ffprobe_finds_what_was_asked(tmp_path: Path, ending: str, bits: int, channels: int):
    path = tmp_path / f"a{ending}"
    save(path, 5, Fraction(30000, 1001) if ending == ".mp4" else 12, channels, np.uint8 if bits == 8 else np.uint16)
    (stream,) = probe(path)
    codec, plain, with_alpha = PIXEL_FORMATS[ending, bits]
    assert stream["codec_name"] == codec
    assert stream["pix_fmt"].startswith(with_alpha if channels in (2, 4) else plain)
    even = ending in (".mp4", ".webm", ".mov")
    assert (stream["width"], stream["height"]) == ((46, 32) if even else (45, 31))
    assert int(stream["nb_read_frames"]) == 5
    assert stream["r_frame_rate"] == ("30000/1001" if ending == ".mp4" else "12/1")
    if ending in (".mp4", ".webm", ".mov"):
        tags = stream["color_range"], stream["color_space"], stream["color_transfer"], stream["color_primaries"]
        assert tags == ("tv", "bt709", "bt709", "bt709")
    if ending == ".webm" and channels in (2, 4):
        assert stream["tags"]["alpha_mode"] == "1"
    if "duration" in stream:
        assert float(stream["duration"]) == pytest.approx(5 / Fraction(stream["r_frame_rate"]), abs=0.02)
    assert contents(tmp_path) == [path.name]


@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize(
    ("ending", "codec", "dtype", "name", "pixel_format", "profile"),
    [
        (".webm", "vp9", np.uint8, "vp9", "yuv420p", "Profile 0"),
        (".webm", "av1", np.uint8, "av1", "yuv420p", "Main"),
        (".webm", "av1", np.uint16, "av1", "yuv420p10le", "Main"),
        (".mov", "prores-422-hq", np.uint8, "prores", "yuv422p10le", "HQ"),
        (".mov", "prores-422-hq", np.uint16, "prores", "yuv422p10le", "HQ"),
    ],
)
def test_codecs_that_are_asked_for(
    tmp_path: Path,
    ending: str,
    codec: str,
    dtype: type,
    name: str,
    pixel_format: str,
    profile: str,
    channels: int,
):
    """Pixel format, tags, frames, rate and duration by ffprobe, and the frames come back."""
    path = tmp_path / f"a{ending}"
    with animation_writer(path, Fraction(24000, 1001), AnimationOptions(codec=codec, quality=100)) as write:
        for frame in frames(6, channels, 64, 96, dtype):
            write(frame)
    (stream,) = probe(path)
    assert (stream["codec_name"], stream["pix_fmt"], stream["profile"]) == (name, pixel_format, profile)
    assert (stream["width"], stream["height"], stream["r_frame_rate"]) == (96, 64, "24000/1001")
    assert int(stream["nb_read_frames"]) == 6
    tags = stream["color_range"], stream["color_space"], stream["color_transfer"], stream["color_primaries"]
    assert tags == ("tv", "bt709", "bt709", "bt709")
    duration = subprocess.run(
        ["ffprobe", "-v", "error", "-show_entries", "format=duration", "-of", "csv=p=0", str(path)],
        capture_output=True,
        check=True,
    ).stdout
    assert float(duration) == pytest.approx(6 * 1001 / 24000, abs=0.02)
    scale = 1 if dtype is np.uint8 else 257
    for seen, given in zip(read_clip(path).read_frames(), frames(6, channels, 64, 96, dtype), strict=True):
        shown = given[..., :3].astype(float)
        if channels == 4 and name != "vp9":  # these have no alpha: the frame is laid over black
            shown *= given[..., 3:] / np.iinfo(dtype).max
        seen = seen[..., :3] * (1.0 if seen.dtype == dtype else 1 / 257 if dtype is np.uint8 else 257.0)
        near = given[..., 3] > np.iinfo(dtype).max // 8 if channels == 4 and name == "vp9" else np.ones((64, 96), bool)
        assert np.abs(seen - shown)[near].mean() < 3 * scale


def test_a_codec_that_does_not_fit_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    for name, codec, message in [
        ("a.mp4", "av1", r"a\.mp4: \.mp4 holds h264 or h265, not av1; change --codec"),
        ("a.mov", "x", "holds prores-4444 or prores-422-hq, not x"),
        ("a.%d.png", "av1", "a picture has no codec"),
    ]:
        with pytest.raises(UserError, match=message):
            check_animation(tmp_path / name, 25, codec)
    monkeypatch.setattr(ffmpeg, "encoders", lambda: frozenset({"libaom-av1"}))  # of a build without SVT-AV1
    save(tmp_path / "a.webm", 2, codec="av1")
    assert [stream["codec_name"] for stream in probe(tmp_path / "a.webm")] == ["av1"]
    (tmp_path / "a.webm").unlink()
    monkeypatch.setattr(ffmpeg, "encoders", lambda: frozenset({"libx264"}))
    with (
        pytest.raises(UserError, match="has no encoder for AV1"),
        animation_writer(tmp_path / "a.webm", options=AnimationOptions(codec="av1")) as write,
    ):
        write(np.zeros((64, 64, 3), np.uint8))
    assert contents(tmp_path) == []


@pytest.mark.parametrize(("quality", "crf"), [(1, 45), (50, 30), (75, 22), (90, 18), (100, 15)])
def test_quality_is_a_constant_rate_factor(quality: int, crf: int):
    assert crf_of(quality) == crf


def test_mp4_starts_fast_and_follows_the_quality(tmp_path: Path):
    for quality in (100, 50):
        save(tmp_path / f"{quality}.mp4", quality=quality)
    data = (tmp_path / "100.mp4").read_bytes()
    assert data.index(b"moov") < data.index(b"mdat")
    assert b"crf=15.0" in data  # x264 writes its settings into the stream
    assert len(data) > (tmp_path / "50.mp4").stat().st_size
    save(tmp_path / "default.mp4")
    assert b"crf=18.0" in (tmp_path / "default.mp4").read_bytes()


@pytest.mark.parametrize(
    ("ending", "dtype", "channels", "tolerance"),
    [
        (".mkv", np.uint8, 4, 0),
        (".mkv", np.uint16, 4, 0),
        (".mov", np.uint16, 4, 400),
        (".mp4", np.uint8, 3, 6),
        (".webm", np.uint8, 4, 6),
        (".apng", np.uint8, 4, 0),
        (".gif", np.uint8, 3, 12),
    ],
)
def test_the_frames_come_back(tmp_path: Path, ending: str, dtype: type, channels: int, tolerance: float):
    path = tmp_path / f"a{ending}"
    save(path, 6, channels=channels, dtype=dtype)
    read = list(read_clip(path).read_frames())
    assert len(read) == 6
    for seen, given in zip(read, frames(6, channels, dtype=dtype), strict=True):
        assert seen.dtype == dtype
        # the added edge repeats the last pixel
        given = np.pad(
            given, [(0, n - m) for n, m in zip(seen.shape[:2], given.shape[:2], strict=True)] + [(0, 0)], mode="edge"
        )
        difference = np.abs(seen[..., :channels].astype(int) - given)
        shown = (
            given[..., 3] > np.iinfo(dtype).max // 8 if channels == 4 and tolerance else np.ones(given.shape[:2], bool)
        )
        assert difference[shown].mean() <= tolerance / 2
        assert np.quantile(difference[shown], 0.9) <= tolerance


def test_a_gif_of_a_few_colours_too_many_is_near_all_of_them(tmp_path: Path):
    """256 to 511 in all: no palette holds them, and none is taken for one."""
    red, green = np.mgrid[0:15, 0:20].astype(np.uint8) * 12
    frame = np.stack([red, green, 0 * red + 128], axis=-1)
    with animation_writer(tmp_path / "a.gif", 10) as write:
        write(frame)
        write(frame[::-1])
    seen, *_ = read_clip(tmp_path / "a.gif").read_frames()
    assert np.abs(seen[..., :3].astype(int) - frame).mean() < 8


def test_alpha_is_laid_over_black_where_a_format_has_none(tmp_path: Path):
    frame = np.full((16, 16, 4), (200, 100, 50, 128), np.uint8)
    with animation_writer(tmp_path / "a.mp4", 10) as write:
        write(frame)
    (seen,) = read_clip(tmp_path / "a.mp4").read_frames()
    assert np.abs(seen[8, 8].astype(int) - [100, 50, 25]).max() <= 3


@pytest.mark.parametrize(("ending", "loops"), [*itertools.product([".gif", ".apng", ".webp"], [0, 1, 3])])
def test_pillow_plays_animated_pictures(tmp_path: Path, ending: str, loops: int):
    path = tmp_path / f"a{ending}"
    save(path, 4, 10, channels=4, loops=loops)
    with Image.open(path) as image:
        assert image.n_frames == 4  # type: ignore[attr-defined]
        # Pillow tells a GIF's repetitions, and none of a GIF that is shown once
        told = image.info.get("loop")
        assert told == ({0: 0, 1: None, 3: 2}[loops] if ending == ".gif" else loops)
        image.seek(3)
        image.load()
        assert image.info["duration"] == pytest.approx(100)
        seen = np.asarray(image.convert("RGBA")).astype(int)
    *_, last = frames(4, 4)
    opaque = last[..., 3] > 200
    assert np.abs(seen - last)[opaque].mean() < 10
    if ending == ".gif":
        assert set(np.unique(seen[..., 3])) == {0, 255}


@pytest.mark.parametrize(
    ("ending", "dtype", "stored"),
    [
        (".png", np.uint8, np.uint8),
        (".png", np.uint16, np.uint16),
        (".tif", np.float32, np.float32),
        (".exr", np.uint8, np.float32),
        (".jpg", np.uint16, np.uint8),
    ],
)
def test_sequences(tmp_path: Path, ending: str, dtype: type, stored: type):
    like = Picture(np.zeros((1, 1, 3), np.uint8), icc=SRGB)
    with animation_writer(tmp_path / f"a.%04d{ending}", options=AnimationOptions(like=like)) as write:
        for number, frame in enumerate(frames(3, dtype=dtype), 98):
            write(frame, number)
    assert contents(tmp_path) == [f"a.{number:04d}{ending}" for number in (98, 99, 100)]
    *_, last = frames(3, dtype=dtype)
    read = read_picture(tmp_path / f"a.0100{ending}")
    assert read.pixels.dtype == stored
    if dtype == stored:
        np.testing.assert_array_equal(read.pixels, last)
    assert ending == ".exr" or read.icc == SRGB


def test_a_single_frame_and_a_single_pixel(tmp_path: Path):
    for ending in (".mp4", ".webm", ".mkv", ".mov", ".gif", ".apng", ".webp"):
        with animation_writer(tmp_path / f"a{ending}", 25) as write:
            write(np.full((1, 1, 1), 200, np.uint8))
        assert (tmp_path / f"a{ending}").stat().st_size > 0


MEASURE = """
import resource, sys
import numpy as np
from app.media.animation import animation_writer
path, count = sys.argv[1], int(sys.argv[2])
ramp = np.arange(320, dtype=np.uint8)
frame = np.stack([np.broadcast_to(ramp, (240, 320)), np.broadcast_to(ramp[:240, None], (240, 320))] * 2, axis=-1)
with animation_writer(path, 25) as write:
    for index in range(count):
        write(np.roll(frame[..., :3], index, axis=0))
for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN):
    print(resource.getrusage(who).ru_maxrss)
"""


@pytest.mark.parametrize("ending", [".mp4", ".gif"])
def test_memory_does_not_grow_with_the_frames(tmp_path: Path, ending: str):
    """Neither ours nor ffmpeg's, even for a GIF, whose palette needs all frames."""

    def peaks(count: int) -> np.ndarray:
        command = [sys.executable, "-c", MEASURE, str(tmp_path / f"a{ending}"), str(count)]
        root = Path(__file__).parents[2]
        told = subprocess.run(command, capture_output=True, check=True, cwd=root).stdout
        return np.array([int(kibibytes) for kibibytes in told.split()])

    few, many = peaks(70), peaks(170)
    if np.max(many - few) >= 8_000:
        # x264 looks some 50 frames ahead; on a busy machine its threads may once have more in hand, which is no growth.
        many = np.minimum(many, peaks(170))
    assert np.max(many - few) < 8_000  # 100 further frames have 22 MiB


# Names and rates ----------------------------------------------------------------------------------------------------


def test_names_tell_what_is_wanted():
    assert [name for name in ("a.mp4", "a.gif", "a.%04d.png", "a%d.exr", "a.webp", "a.png") if is_animation(name)] == [
        "a.mp4",
        "a.gif",
        "a.%04d.png",
        "a%d.exr",
    ]
    for name, rate, message in [
        ("a.avi", 25, r"an animation ends in one of \.mp4"),
        ("a.%04d.bmp", 25, "must end in one of .png"),
        ("a.%d.%d.png", 25, "holds one number"),
        ("a.mp4", 0, "a frame rate of 0 is not between"),
        ("a.mp4", float("nan"), "a frame rate of nan is not between"),
        ("a.gif", 60, "at most 50 frames a second"),
        ("a.gif", 0.0015, r"\.gif shows no frame for more than 655\.35 seconds; use \.mp4"),
        ("a.webp", 5.9e-5, r"no frame for more than 16777\.2 seconds"),
        ("a.apng", 1.5e-5, r"no frame for more than 65535 seconds"),
    ]:
        with pytest.raises(UserError, match=message):
            check_animation(name, rate)


@pytest.mark.parametrize(("name", "seconds"), [("a.gif", "655.35"), ("a.webp", "16777.215"), ("a.apng", "65535")])
def test_a_frame_is_shown_for_as_long_as_its_format_can_tell_and_refused_for_longer(
    tmp_path: Path, name: str, seconds: str
):
    longest = Fraction(seconds)
    frames = [np.full((4, 4, 3), value, np.uint8) for value in (0, 200)]
    with animation_writer(tmp_path / name, 1 / longest) as write:
        for frame in frames:
            write(frame)
    with Image.open(tmp_path / name) as image:  # another program's view
        for number in range(2):
            image.seek(number)
            image.load()
            assert image.info["duration"] == pytest.approx(float(longest) * 1000)
    with (
        pytest.raises(UserError, match="shows no frame for more than"),
        animation_writer(tmp_path / f"2{name}", 2 / longest, AnimationOptions(durations=[1, 3])),
    ):
        pass
    assert not (tmp_path / f"2{name}").exists()


@pytest.mark.parametrize("name", ["a.mp4", "a.gif", "a.%04d.png"])
def test_an_animation_needs_a_frame(tmp_path: Path, name: str):
    with pytest.raises(UserError, match="has no frame"), animation_writer(tmp_path / name):
        pass
    assert contents(tmp_path) == []


# Failures -----------------------------------------------------------------------------------------------------------


NAMES = ["a.mp4", "a.webm", "a.mkv", "a.mov", "a.gif", "a.apng", "a.webp", "a.%04d.png"]


@pytest.mark.parametrize("name", NAMES[:-1])
@pytest.mark.parametrize("at", ["between frames", "while encoding"])
def test_cancelling_leaves_what_was_there(tmp_path: Path, name: str, at: str):
    earlier = tmp_path / name
    earlier.write_bytes(b"earlier")
    wish = threading.Event()

    def work() -> None:
        with animation_writer(tmp_path / name, cancel=wish.is_set) as write:
            for index in itertools.count():
                if at == "between frames" and index == 3:
                    wish.set()
                write(next(frames(1, height=200, width=300)))

    if at == "while encoding":
        threading.Timer(0.3, wish.set).start()
    with pytest.raises(Cancelled):
        work()
    assert earlier.read_bytes() == b"earlier"
    assert contents(tmp_path) == [earlier.name]


def test_the_files_of_a_sequence_appear_as_they_are_done(tmp_path: Path):
    """Whole, and they stay when it is cancelled or fails."""
    wish = threading.Event()

    def work() -> None:
        with animation_writer(tmp_path / "a.####.png", cancel=wish.is_set) as write:
            for number, frame in enumerate(frames(4), 1001):
                if number == 1004:
                    wish.set()
                write(frame, number)
                assert contents(tmp_path) == [f"a.{done}.png" for done in range(1001, number + 1)]
                np.testing.assert_array_equal(read_picture(tmp_path / f"a.{number}.png").pixels, frame)

    with pytest.raises(Cancelled):
        work()
    assert contents(tmp_path) == ["a.1001.png", "a.1002.png", "a.1003.png"]


def test_a_slow_encoder_is_ended_and_not_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """One that takes nothing from us: the wish must be heard while we wait for it."""
    sleeper, over = tmp_path / "sleeper", tmp_path / "over"
    sleeper.write_text(f"#!{sys.executable}\nimport time\ntime.sleep(30)\nopen({str(over)!r}, 'w').close()\n")
    sleeper.chmod(0o755)
    monkeypatch.setattr(ffmpeg, "executable", lambda: str(sleeper))

    def cancel() -> bool:
        return time.monotonic() - started > 0.3

    def work() -> None:
        with animation_writer(tmp_path / "a.mp4", cancel=cancel) as write:
            for frame in frames(50, height=500, width=500):
                write(frame)

    started = time.monotonic()
    with pytest.raises(Cancelled):
        work()
    assert contents(tmp_path) == ["sleeper"]


def test_an_encoder_stopped_while_it_finishes_is_not_told_as_killed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """The wish is heard by the watcher first, which ends the process while we wait for its end."""
    sleeper = tmp_path / "sleeper"
    sleeper.write_text("#!/bin/sh\ncat > /dev/null\nexec sleep 60\n")
    sleeper.chmod(0o755)
    monkeypatch.setattr(ffmpeg, "executable", lambda: str(sleeper))
    given, asked = threading.Event(), threading.Event()

    def cancel() -> bool:
        if given.is_set() and threading.current_thread().name == "ffmpeg watcher":
            asked.set()
        return asked.is_set()

    def work() -> None:
        with animation_writer(tmp_path / "a.mp4", cancel=cancel) as write:
            for frame in frames(3):
                write(frame)
            given.set()

    with pytest.raises(Cancelled):
        work()
    assert contents(tmp_path) == ["sleeper"]


@pytest.mark.parametrize("name", NAMES[:-1])
def test_an_error_between_frames_leaves_nothing(tmp_path: Path, name: str):
    def work() -> None:
        with animation_writer(tmp_path / name) as write:
            for frame in frames(3):
                write(frame)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        work()
    assert contents(tmp_path) == []


def test_an_encoder_that_dies_is_quoted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    with pytest.raises(UserError, match=r"Cannot write .*a\.mp4: ffmpeg says: .*nonsense") as raised:
        save(tmp_path / "a.mp4", colours=Colours(primaries="nonsense"))
    assert "\n" not in str(raised.value)

    dying = tmp_path / "dying"
    dying.write_text("#!/bin/sh\nhead -c 100000 >/dev/null\necho '[x @ 0x1] out of luck' >&2\nexit 3\n")
    dying.chmod(0o755)
    monkeypatch.setattr(ffmpeg, "executable", lambda: str(dying))
    with pytest.raises(UserError, match=r"a\.mp4: ffmpeg says: out of luck\."):
        save(tmp_path / "a.mp4", 100)
    assert contents(tmp_path) == ["dying"]


def test_an_ffmpeg_that_does_not_run_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "text").write_text("no program")
    (tmp_path / "text").chmod(0o755)
    for name in ("gone", "text", "false"):
        found = "/bin/false" if name == "false" else str(tmp_path / name)
        monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", found)
        with pytest.raises(UserError, match=f"^{found} is no ffmpeg that runs here; set IMAGEIO_FFMPEG_EXE to one"):
            ffmpeg.executable.__wrapped__()


@pytest.mark.skipif(sys.platform != "linux", reason="asks /proc")
def test_ctrl_c_does_not_reach_an_ffmpeg_that_is_asked_something(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """It would say half of it, and be taken for one that does not run."""
    (tmp_path / "ffmpeg").write_text("#!/bin/sh\ncut -d' ' -f6 /proc/$$/stat\n")
    (tmp_path / "ffmpeg").chmod(0o755)
    monkeypatch.setattr(ffmpeg, "executable", lambda: str(tmp_path / "ffmpeg"))
    assert int(ffmpeg.ask().stdout) != os.getsid(0)


def test_an_encoder_that_is_killed_says_why(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """By the system, for want of memory as a rule; and by its own write beyond the largest file that is allowed."""
    real, wrapper = ffmpeg.executable(), tmp_path / "wrapper"
    monkeypatch.setattr(ffmpeg, "executable", lambda: str(wrapper))
    for script, message in {
        "head -c 100000 >/dev/null\nkill -KILL $$": r"ffmpeg was killed \(SIGKILL\), perhaps for want of memory; try",
        f'ulimit -f 8\nexec {real} "$@"': "the file grows larger than this disk allows; choose another folder",
    }.items():
        wrapper.write_text(f"#!/bin/sh\n{script}\n")
        wrapper.chmod(0o755)
        with pytest.raises(UserError, match=rf"^Cannot write .*a\.mkv: {message}"):
            save(tmp_path / "a.mkv", 100)
    assert contents(tmp_path) == ["wrapper"]


@pytest.mark.parametrize("name", NAMES)
def test_a_full_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str):
    def link(path: Path) -> Path:
        temporary = path.with_name(f".full{path.suffix}")
        temporary.symlink_to("/dev/full")
        return temporary

    for module in (files, animation):
        if "%" in name:  # the pictures' temporary files, not the folder's
            monkeypatch.setattr(files, "temporary_beside", lambda path: link(path) if path.suffix else path)
        else:
            monkeypatch.setattr(module, "temporary_beside", link)
    shown = name % 0 if "%" in name else name
    with pytest.raises(UserError, match=f"^Cannot write {tmp_path / shown}: the disk is full; free some space"):
        save(tmp_path / name, 30)
    assert contents(tmp_path) == []


@pytest.mark.parametrize("moved", [False, True])
@pytest.mark.parametrize("name", ["a.%04d.png", "a.mp4", "a.gif", "a.apng"])
def test_a_folder_that_vanishes_meanwhile(tmp_path: Path, name: str, moved: bool) -> None:
    folder, elsewhere = tmp_path / "folder", tmp_path / "elsewhere"
    folder.mkdir()
    taken = 0

    def frames() -> None:
        nonlocal taken
        with animation_writer(folder / name) as write:
            for number in range(4):
                write(np.full((32, 32, 3), 40 * number, np.uint8))
                taken += 1
                if number == 1:
                    folder.rename(elsewhere)
                    if not moved:
                        shutil.rmtree(elsewhere)

    with pytest.raises(UserError, match=rf"^Cannot write {folder}/a[.a-z0-9]*: .*folder.* make it (first|again)"):
        frames()
    assert taken == 2  # it is told with the next one, not after hours at the end
    assert not folder.exists()


def test_outputs_that_cannot_be(tmp_path: Path):
    with pytest.raises(UserError, match="there is no folder"):
        save(tmp_path / "nowhere" / "a.mp4")
    with pytest.raises(UserError, match="there is no folder"):
        save(tmp_path / "nowhere" / "a.%d.png")

    def change_size() -> None:
        with animation_writer(tmp_path / "a.mp4") as write:
            write(np.zeros((4, 4, 3), np.uint8))
            write(np.zeros((4, 5, 3), np.uint8))

    with pytest.raises(ValueError, match="a frame"):
        change_size()
    assert contents(tmp_path) == []


# Order of frames ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("count", "options", "expected"),
    [
        (4, {}, "0123"),
        (4, {"ping_pong": True}, "012321"),
        (3, {"hold_first": 2, "hold_last": 1}, "000122"),
        (3, {"hold_first": 1, "hold_last": 1, "ping_pong": True}, "001221"),
        (1, {"ping_pong": True, "hold_last": 2}, "000"),
        (2, {"ping_pong": True}, "01"),
        (0, {"hold_first": 3}, ""),
    ],
)
def test_the_order_of_frames(count: int, options: dict, expected: str):
    assert "".join(map(str, frame_order(count, **options))) == expected


def test_reordering_keeps_the_frames_on_disk(tmp_path: Path):
    given = list(frames(4, dtype=np.uint16))
    order = 2 * frame_order(4, ping_pong=True, hold_last=1)
    for frame, index in zip(reordered(iter(given), order, tmp_path), order, strict=True):
        np.testing.assert_array_equal(frame, given[index])
    assert contents(tmp_path) == []


# Clips in -----------------------------------------------------------------------------------------------------------


def generate(path: Path, *arguments: str) -> Path:
    command = [ffmpeg.executable(), "-v", "error", "-y", "-f", "lavfi", "-i"]
    subprocess.run([*command, *arguments, str(path)], check=True)
    return path


def test_a_clip_tells_what_it_is(tmp_path: Path):
    path = generate(tmp_path / "a.mp4", "testsrc=s=64x48:r=30000/1001:d=1", "-pix_fmt", "yuv420p")
    clip = read_clip(path)
    assert (clip.width, clip.height, clip.fps, clip.sound) == (64, 48, Fraction(30000, 1001), None)
    assert (clip.bits, clip.alpha, clip.frames) == (8, False, 30)
    assert sum(1 for _ in clip.read_frames()) == 30


def test_a_turned_clip_is_read_upright(tmp_path: Path):
    plain = generate(tmp_path / "a.mp4", "testsrc=s=64x48:r=10:d=0.5", "-pix_fmt", "yuv420p", "-crf", "5")
    turned = tmp_path / "b.mp4"
    command = [ffmpeg.executable(), "-v", "error", "-display_rotation", "-90", "-i", str(plain), "-c", "copy"]
    subprocess.run([*command, str(turned)], check=True)
    clip = read_clip(turned)
    assert (clip.width, clip.height, clip.note) == (48, 64, "")
    upright = next(read_clip(plain).read_frames())
    assert np.abs(next(clip.read_frames()).astype(int) - np.rot90(upright, -1)).mean() < 1


def test_wide_pixels_become_square(tmp_path: Path):
    clip = read_clip(generate(tmp_path / "a.mkv", "testsrc=s=64x48:r=10:d=0.5,setsar=3/2", "-c:v", "ffv1"))
    assert (clip.width, clip.height) == (96, 48)
    assert next(clip.read_frames()).shape == (48, 96, 3)
    assert clip.note == "a.mkv: its pixels of 3:2 become square"


def test_a_still_of_a_clip_tells_of_the_frames_it_leaves_out(tmp_path: Path):
    for seconds, said in ((0.5, "a.mkv: of its frames only the first is used"), (0.1, "")):
        clip = generate(tmp_path / "a.mkv", f"testsrc=s=64x48:r=10:d={seconds}", "-c:v", "ffv1")
        assert open_source(clip, animated=False).picture.note == said
        assert open_source(clip).picture.note == ""


def test_ten_bits_are_read_as_sixteen(tmp_path: Path):
    clip = read_clip(
        generate(tmp_path / "a.mkv", "testsrc=s=64x48:r=10:d=0.5", "-c:v", "ffv1", "-pix_fmt", "yuv422p10")
    )
    assert clip.bits == 16
    assert next(clip.read_frames()).dtype == np.uint16


@pytest.mark.parametrize(
    ("source", "ending", "codec"),
    [
        ("aac", ".mp4", "aac"),
        ("pcm_s16le", ".mp4", "aac"),
        ("aac", ".webm", "opus"),
        ("libopus", ".webm", "opus"),
        ("aac", ".mkv", "aac"),
        ("pcm_s16le", ".mov", "pcm_s16le"),
        ("libopus", ".mov", "pcm_s16le"),
        ("aac", ".gif", None),
        ("aac", ".apng", None),
    ],
)
def test_sound_is_carried_over(tmp_path: Path, source: str, ending: str, codec: str | None):
    sound = ["-f", "lavfi", "-i", "sine=d=2", "-c:a", source]
    clip = generate(tmp_path / "in.mkv", "testsrc=s=64x48:r=10:d=2", *sound)
    save(tmp_path / f"a{ending}", 10, 10, sound=clip, frames=10)
    video, *rest = probe(tmp_path / f"a{ending}")
    assert int(video["nb_read_frames"]) == 10
    assert [stream["codec_name"] for stream in rest] == ([codec] if codec else [])
    if rest and "duration" in rest[0]:
        assert float(rest[0]["duration"]) == pytest.approx(1, abs=0.1)


def test_a_webp_of_a_clip_with_sound_is_written_without_it(tmp_path: Path):
    clip = generate(tmp_path / "in.mkv", "testsrc=s=64x48:r=10:d=1", "-f", "lavfi", "-i", "sine=d=1")
    save(tmp_path / "a.webp", 10, 10, sound=clip, frames=10)
    with Image.open(tmp_path / "a.webp") as image:
        assert getattr(image, "n_frames", 1) == 10


@pytest.mark.parametrize(
    ("codec", "source", "ending"),
    [("aac", "mp4", "mp4"), ("aac", "mov", "mov"), ("ac3", "mp4", "mp4"), ("libmp3lame", "mp4", "mp4"),
     ("libopus", "webm", "webm"), ("libopus", "webm", "mkv"), ("libvorbis", "webm", "webm")],
)  # fmt: skip
def test_sound_that_is_copied_whole_is_heard_as_it_was(tmp_path: Path, codec: str, source: str, ending: str):
    """An encoder's first packet begins before the pictures: without it up to 27 ms were lost, or sounded otherwise."""

    def heard(path: Path) -> np.ndarray:
        found = ffmpeg.ask("-i", f"file:{path}", "-map", "0:a", "-f", "s16le", "-")
        return np.frombuffer(found.stdout, np.int16)

    sound = ["-f", "lavfi", "-i", "aevalsrc=0.5*sin(2800*t)*(1-t):s=48000:d=0.6", "-c:a", codec]
    pictures = ["-c:v", "libvpx"] if source == "webm" else []
    clip = generate(tmp_path / f"a.{source}", "testsrc=s=64x48:r=25:d=0.6", *sound, *pictures)
    save(tmp_path / f"b.{ending}", 15, 25, sound=clip, frames=15)
    before, after = heard(clip), heard(tmp_path / f"b.{ending}")
    count = min(len(before), len(after))
    assert count == pytest.approx(0.6 * 48000, abs=64)
    assert np.array_equal(before[:count], after[:count])
    assert float(probe(tmp_path / f"b.{ending}")[0]["start_time"]) == 0


def test_sound_from_a_file_without_pictures(tmp_path: Path):
    sound = generate(tmp_path / "a.wav", "sine=d=1")
    save(tmp_path / "a.mp4", 10, 10, sound=sound)
    assert [stream["codec_name"] for stream in probe(tmp_path / "a.mp4")] == ["h264", "aac"]
    (tmp_path / "junk").write_bytes(b"junk" * 9)
    with pytest.raises(UserError, match="neither picture nor sound"):
        save(tmp_path / "b.mp4", sound=tmp_path / "junk")
    assert not (tmp_path / "b.mp4").exists()


def test_what_is_no_clip(tmp_path: Path):
    (tmp_path / "empty.mp4").touch()
    (tmp_path / "junk.mp4").write_bytes(b"junk" * 99)
    save(tmp_path / "whole.mp4")
    (tmp_path / "cut.mp4").write_bytes((tmp_path / "whole.mp4").read_bytes()[:300])
    for name, message in {
        "missing.mp4": "there is no such file",
        "empty.mp4": "the file is empty",
        "junk.mp4": "it is not a video, or it is damaged",
        "cut.mp4": r"cut\.mp4",
        ".": "it is a folder",
    }.items():
        with pytest.raises(UserError, match=message) as raised:
            read_clip(tmp_path / name)
        assert "\n" not in str(raised.value)
    with pytest.raises(UserError, match="more than the limit of 100"):
        read_clip(tmp_path / "whole.mp4", max_pixels=100)
    with pytest.raises(Cancelled):
        next(read_clip(tmp_path / "whole.mp4").read_frames(lambda: True))


def tagged(path: Path, setting: str, *options: str) -> str:
    """The note about a clip whose frames are tagged so."""
    return read_clip(generate(path, "testsrc=s=64x48:r=10:d=0.4", "-vf", setting, *options)).note


def test_what_of_a_clip_is_not_understood_is_told(tmp_path: Path):
    ten, hdr = "format=yuv420p10le", "setparams=colorspace=bt2020nc:color_primaries=bt2020:color_trc="
    assert tagged(tmp_path / "a.mp4", "format=yuv420p") == ""
    assert tagged(tmp_path / "a.mp4", f"format=yuv420p,{encoders.tagged(USUAL, 8)}") == ""
    assert (
        tagged(tmp_path / "a.mkv", "format=gbrp,setparams=color_primaries=bt709:color_trc=iec61966-2-1", "-c:v", "ffv1")
        == ""
    )
    said = tagged(tmp_path / "pq.mp4", f"{ten},{hdr}smpte2084")
    assert said == "pq.mp4: its colours are BT.2020 PQ and are mixed as if BT.709"
    graded = "log-level=none:hdr10=1:max-cll=1000,400:master-display=G(13250,34500)B(7500,3000)R(34000,16000)"
    graded += "WP(15635,16450)L(10000000,1)"
    said = tagged(tmp_path / "ten.mp4", f"{ten},{hdr}smpte2084", "-c:v", "libx265", "-x265-params", graded)
    assert said.endswith("mixed as if BT.709; its mastering display and light levels (HDR10) are not kept")
    said = tagged(tmp_path / "lin.mkv", f"{ten},{hdr}linear")
    assert said == "lin.mkv: its colours are BT.2020 linear and are treated as BT.709"
    assert "BT.2020 HLG" in tagged(tmp_path / "hlg.mkv", f"{ten},{hdr}arib-std-b67")
    assert "BT.2020 and" in tagged(tmp_path / "sdr.mp4", f"{ten},{hdr}bt709")
    assert "BT.601 and" in tagged(
        tmp_path / "sd.mp4", "setparams=colorspace=smpte170m:color_primaries=smpte170m:color_trc=smpte170m"
    )
    assert "linear and" in tagged(tmp_path / "a.mkv", "format=gbrp,setparams=color_trc=linear", "-c:v", "ffv1")
    said = tagged(tmp_path / "a.mp4", "format=yuv420p,tinterlace=interleave_top", "-flags", "+ildct+ilme")
    assert said == "a.mp4: it is interlaced, and its fields are treated as whole frames"
    said = tagged(tmp_path / "a.mov", "format=yuv422p10,setfield=bff", "-flags", "+ildct+ilme", "-c:v", "prores_ks")
    assert "interlaced" in said


@pytest.mark.parametrize("is_full", [False, True])
@pytest.mark.parametrize("kind", ["yuv444p10le", "yuva444p12le", "gray10le", "gbrp10le", "yuv444p"])
def test_black_grey_and_white_of_a_clip_are_as_the_standard_says(tmp_path: Path, kind: str, is_full: bool):
    """By BT.2100, table 9, in float64: swscale's white of 16 bits is .4 % darker, and its opaque is not opaque."""
    bits, planes = (10 if "10" in kind else 12 if "12" in kind else 8), 1 if kind.startswith("gray") else 3
    limited, dtype = kind.startswith("yuv") and not is_full, np.uint8 if kind == "yuv444p" else np.uint16
    top, step = 2**bits - 1, 2 ** (bits - 8)
    black, white = (16 * step, 235 * step) if limited else (0, top)
    codes = np.linspace(black, white, 48).round().astype(dtype)
    frame = np.empty((4 if "a" in kind[:4] and planes == 3 else planes, 48, 64), dtype)
    frame[:] = codes[:, None] if not kind.startswith("yuv") else 128 * step
    frame[0] = codes[:, None]
    if len(frame) == 4:
        frame[3] = np.linspace(0, top, 64).round()
    tags = ["-color_range", "pc" if is_full else "tv", *(["-colorspace", "bt709"] if kind.startswith("yuv") else [])]
    how = ["-f", "rawvideo", "-pix_fmt", kind, "-s", "64x48", "-r", "5", *tags, "-i", "-"]
    clip = tmp_path / "a.mkv"
    command = [ffmpeg.executable(), "-v", "error", *how, "-c:v", "ffv1", *tags, str(clip)]
    subprocess.run(command, input=frame.tobytes(), check=True)
    (seen,) = read_clip(clip).read_frames()
    most = np.iinfo(seen.dtype).max
    wanted = np.broadcast_to(((codes.astype(float) - black) / (white - black) * most)[:, None], (48, 64))
    assert np.abs(seen[..., :3] - wanted[..., None]).max() < (1 if bits == 8 else 4)
    if len(frame) == 4:
        assert np.abs(seen[..., 3] - np.linspace(0, top, 64).round() / top * most).max() < 1


@pytest.mark.parametrize(("kind", "dtype"), [("yuv444p", "u1"), ("yuv422p10le", "<u2"), ("yuva444p12le", "<u2")])
def test_light_above_white_of_limited_range_is_white_and_below_black_black(tmp_path: Path, kind: str, dtype: str):
    """Through all codes that a frame may have: nothing wraps around, and what lies between is as the standard says."""
    bits = int(found[1]) if (found := re.search(r"(10|12)le", kind)) else 8
    step, narrow = 2 ** (bits - 8), "422" in kind
    codes = np.arange(step, 255 * step, dtype=dtype).repeat(2)  # 0 and 255 are for synchronisation
    grey = np.full(codes.size // (2 if narrow else 1), 128 * step, dtype)
    planes = [codes, grey, grey, *([np.full_like(codes, 2**bits - 1)] if "a" in kind else [])]
    frame = b"".join(np.tile(plane, (8, 1)).tobytes() for plane in planes)
    tags = ["-color_range", "tv", "-colorspace", "bt709"]
    how = ["-f", "rawvideo", "-pix_fmt", kind, "-s", f"{codes.size}x8", "-r", "5", *tags, "-i", "-"]
    command = [ffmpeg.executable(), "-v", "error", *how, "-c:v", "ffv1", *tags, str(tmp_path / "a.mkv")]
    subprocess.run(command, input=frame, check=True)
    (seen,) = read_clip(tmp_path / "a.mkv").read_frames()
    most = np.iinfo(seen.dtype).max
    wanted = ((codes.astype(float) - 16 * step) / (219 * step)).clip(0, 1) * most
    assert np.abs(seen[..., :3] - wanted[None, :, None]).max() < (1 if bits == 8 else 4)
    assert (seen[:, codes >= 235 * step, :3] == most).all()
    assert not seen[:, codes <= 16 * step, :3].any()


@pytest.mark.parametrize(
    ("ending", "codec", "kind", "white"),
    [
        (".mp4", None, "yuv420p", 235),
        (".mp4", "h265", "yuv420p10le", 940),
        (".mov", None, "yuva444p12le", 3760),
        (".mov", "prores-422-hq", "yuv422p10le", 940),
        (".webm", None, "yuv420p", 235),
        (".webm", "av1", "yuv420p10le", 940),
        (".mkv", None, "gbrp16le", 65535),
    ],
)
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_white_is_written_as_the_standard_says(
    tmp_path: Path, ending: str, codec: str | None, kind: str, white: int, dtype: type
):
    if ending == ".mkv" and dtype is np.uint8:
        pytest.skip("which is written in 8 bits of RGB")
    channels = 4 if kind.startswith("yuva") else 3
    with animation_writer(tmp_path / f"a{ending}", 5, AnimationOptions(codec=codec, quality=100)) as write:
        write(np.full((48, 64, channels), np.iinfo(dtype).max, dtype))
    command = [ffmpeg.executable(), "-v", "error", "-i", str(tmp_path / f"a{ending}"), "-f", "rawvideo"]
    done = subprocess.run([*command, "-pix_fmt", kind, "-"], capture_output=True, check=True)
    codes = np.frombuffer(done.stdout, np.uint8 if kind.endswith("p") else "<u2")
    assert set(codes[: 48 * 64].tolist()) == {white}
    if channels == 4:
        assert set(codes[-48 * 64 :].tolist()) == {4095}


def test_further_tracks_of_a_clip_are_told(tmp_path: Path):
    (tmp_path / "words.srt").write_text("1\n00:00:00,000 --> 00:00:01,000\nhello\n")
    inputs = ["-f", "lavfi", "-i", "sine=d=1", "-i", str(tmp_path / "words.srt")]
    tracks = ["-map", "0:v", "-map", "1:a", "-map", "1:a", "-map", "2:s", "-c:v", "ffv1"]
    clip = read_clip(generate(tmp_path / "a.mkv", "testsrc=s=64x48:r=10:d=1", *inputs, *tracks))
    assert clip.note == "a.mkv: its subtitles are not kept"


@pytest.mark.parametrize(
    ("ending", "codecs"),
    [
        (".mp4", ["aac", "mp3", "aac"]),
        (".webm", ["opus", "opus", "opus"]),
        (".mkv", ["aac", "mp3", "flac"]),
        (".mov", ["aac", "pcm_s16le", "pcm_s16le"]),
    ],
)
def test_every_sound_track_is_carried_over(tmp_path: Path, ending: str, codecs: list[str]):
    tones = [word for tone in (300, 600, 900) for word in ("-f", "lavfi", "-i", f"sine=f={tone}:d=1")]
    maps = [word for number in range(4) for word in ("-map", str(number))]
    named = ["-metadata:s:a:0", "language=ger", "-metadata:s:a:1", "language=spa"]
    kinds = ["-c:v", "ffv1", "-c:a:0", "aac", "-c:a:1", "libmp3lame", "-c:a:2", "pcm_s16le"]
    clip = generate(tmp_path / "in.mkv", "testsrc=s=64x48:r=10:d=1", *tones, *maps, *kinds, *named)
    save(tmp_path / f"a{ending}", 10, 10, sound=clip, frames=10)
    video, *tracks = probe(tmp_path / f"a{ending}")
    assert video["codec_type"] == "video"
    assert [track["codec_name"] for track in tracks] == codecs
    assert [track["tags"]["language"] for track in tracks[:2]] == ["ger", "spa"]
    for number, tone in enumerate((300, 600, 900)):
        command = [ffmpeg.executable(), "-v", "error", "-i", str(tmp_path / f"a{ending}"), "-map", f"0:a:{number}"]
        raw = subprocess.run([*command, "-ac", "1", "-ar", "8000", "-f", "f32le", "-"], capture_output=True, check=True)
        heard = np.frombuffer(raw.stdout, np.float32)
        assert len(heard) == pytest.approx(8000, rel=0.1)
        assert np.argmax(np.abs(np.fft.rfft(heard))) * 8000 / len(heard) == pytest.approx(tone, abs=4)


def test_a_sound_track_keeps_its_name_and_role(tmp_path: Path):
    named = ["-metadata:s:a:0", "title=The mix", "-disposition:a:0", "comment"]
    clip = generate(tmp_path / "in.mp4", "testsrc=s=64x48:r=10:d=0.3", "-f", "lavfi", "-i", "sine=d=0.3", *named)
    assert read_clip(clip).roles == ("comment",)
    for again in ("a.mkv", "a.mp4"):  # of a Matroska's title ffmpeg makes the name by itself
        save(tmp_path / again, 3, 10, sound=clip, frames=3)
        clip = tmp_path / again
        (track,), _ = sound_tracks(clip)
        assert track.roles == ("comment",)
    assert track.name == "The mix"
    assert probe(tmp_path / "a.mkv")[1]["tags"]["title"] == "The mix"


def test_a_sound_track_keeps_its_language_or_that_is_told(tmp_path: Path) -> None:
    languages = ("deu", "fre", "swe", "ell", "per", "nob", "und")
    tracks = [
        word
        for number, language in enumerate(languages)
        for word in ("-map", "1", f"-metadata:s:a:{number}", f"language={language}")
    ]
    clip = generate(
        tmp_path / "in.mp4", "testsrc=s=64x48:r=10:d=0.3", "-f", "lavfi", "-i", "sine=d=0.3", *tracks, "-map", "0"
    )
    named = [*languages[:-1]]
    assert read_clip(clip).languages == (*named,)
    for ending, found in (".mov", ["ger", "fra", "sve", "gre", "per"]), (".mkv", named), (".mp4", named):
        save(tmp_path / f"a{ending}", 3, 10, sound=clip, frames=3)
        said = [track["tags"].get("language", "und") for track in probe(tmp_path / f"a{ending}")[1:]]
        assert [language for language in said if language != "und"] == found
        told = unheld_of_clip(f"a{ending}", None, replace(read_clip(clip), bits=8))
        assert ("what its sound is spoken in (nob) is not kept" in told) == (ending == ".mov")


def test_sound_of_a_cinema_goes_into_any_container(tmp_path: Path) -> None:
    """AC-3, which films have, calls the loudspeakers behind side ones, and libopus knows none."""
    noise = ["-f", "lavfi", "-i", "anoisesrc=d=0.3,aformat=channel_layouts=5.1(side)", "-c:a", "eac3"]
    clip = generate(tmp_path / "in.mkv", "testsrc=s=64x48:r=10:d=0.3", *noise)
    assert read_clip(clip).layouts == ("5.1(side)",)
    for ending in (".webm", ".mkv", ".mp4", ".mov"):
        save(tmp_path / f"a{ending}", 3, 10, sound=clip, frames=3)
        assert probe(tmp_path / f"a{ending}")[1]["channels"] == 6
        assert "loudspeakers" not in unheld_of_clip(f"a{ending}", None, replace(read_clip(clip), bits=8))


def test_what_else_a_clip_holds_is_told(tmp_path: Path):
    told = tmp_path / "told.txt"
    told.write_text(";FFMETADATA1\ntitle=A day\nartist=Me\n[CHAPTER]\nTIMEBASE=1/1\nSTART=0\nEND=1\ntitle=Morning\n")
    further = ["-i", str(told), "-map_metadata", "1", "-attach", str(told), "-metadata:s:t", "mimetype=text/plain"]
    path = generate(tmp_path / "a.mkv", "testsrc=s=64x48:r=10:d=1", *further)
    assert (
        read_clip(path).note
        == "a.mkv: its chapters are not kept; its attachments are not kept; its tags title, ARTIST are not kept"
    )
    assert read_clip(generate(tmp_path / "b.mkv", "testsrc=s=64x48:r=10:d=1")).note == ""


def test_a_cover_picture_is_told_and_chapters_are_as_they_are_told(tmp_path: Path) -> None:
    cover, told = tmp_path / "cover.png", tmp_path / "told.txt"
    cv2.imwrite(str(cover), np.zeros((8, 8, 3), np.uint8))
    told.write_text(";FFMETADATA1\n[CHAPTER]\nTIMEBASE=1/1\nSTART=0\nEND=1\ntitle=Morning\n")
    sound, mapped = ("-f", "lavfi", "-i", "sine=d=1"), ("-map", "0", "-map", "1", "-map", "2")
    further = [*sound, "-i", str(cover), "-i", str(told), *mapped, "-map_metadata", "3", "-map_chapters", "3"]
    clip = generate(
        tmp_path / "a.mp4", "testsrc=s=64x48:r=10:d=1", *further, "-disposition:v:1", "attached_pic", "-c:v:1", "png"
    )
    assert read_clip(clip).note == "a.mp4: its chapters are not kept; its cover pictures are not kept"
    for ending in (".mp4", ".mkv", ".mov"):
        save(tmp_path / f"b{ending}", 3, 10, sound=clip, frames=3)
        command = ["ffprobe", "-v", "error", "-show_chapters", str(tmp_path / f"b{ending}")]
        assert subprocess.run(command, capture_output=True, check=True).stdout == b""


def test_what_belongs_to_a_track_is_told(tmp_path: Path):
    further = ["-metadata:s:v:0", "title=A take", "-metadata:s:v:0", "language=fra", "-timecode", "01:00:00:00"]
    source = "testsrc=s=64x48:r=10:d=0.1,format=yuvj420p"
    stereo = generate(
        tmp_path / "a.mkv", source, "-c:v", "mjpeg", *further, "-metadata:s:v:0", "stereo_mode=left_right"
    )
    assert read_clip(stereo).note == (
        "a.mkv: its track's tags language, title, stereo_mode are not kept; its data block Stereo 3D is not kept"
    )
    reel = ["-c:v", "mjpeg", "-timecode", "01:00:00:00", "-metadata:s:v:0", "reel_name=A001C002"]
    assert read_clip(generate(tmp_path / "a.mov", source, *reel)).note == "a.mov: its track's tag reel_name is not kept"


def test_what_muxers_count_of_a_track_is_no_loss(tmp_path: Path):
    """As mkvmerge writes it."""
    counted = ["BPS", "BPS-eng", "DURATION-eng", "NUMBER_OF_FRAMES", "NUMBER_OF_BYTES-eng", "SOURCE_ID"]
    counted += [f"_STATISTICS_{name}" for name in ("WRITING_APP", "WRITING_DATE_UTC", "TAGS")]
    further = [word for tag in counted for word in ("-metadata:s:v:0", f"{tag}=1")]
    assert read_clip(generate(tmp_path / "a.mkv", "testsrc=s=64x48:r=10:d=0.1", *further)).note == ""
    further += ["-metadata:s:v:0", "SCENE=1"]
    said = "b.mkv: its track's tag SCENE is not kept"
    assert read_clip(generate(tmp_path / "b.mkv", "testsrc=s=64x48:r=10:d=0.1", *further)).note == said


def test_sound_and_times_that_a_format_has_no_room_for_are_told(tmp_path: Path):
    clip = PictureSequence(
        **{"path": Path("a.mov"), "width": 63, "height": 48, "bits": 8, "alpha": False, "pixel_format": "yuv420p"},
        **{"fps": Fraction(24), "files": {}, "channels": 3, "max_pixels": 1},
        sounds=("aac", "pcm_s24le", "none"),
        timecode="01:00:00:00",
    )
    for name in ("a.gif", "a.apng", "a.%04d.png"):
        assert unheld_of_clip(name, None, clip) == "a.mov: its sound is not kept; its time code is not kept"
    assert unheld_of_clip("a.mp4", None, clip) == "a.mov: its sound (pcm_s24le) becomes aac"
    assert unheld_of_clip("a.webm", None, clip) == "a.mov: its sound (aac pcm_s24le) becomes opus"
    assert unheld_of_clip("a.mov", None, clip) == ""
    assert unheld_of_clip("a.mkv", None, replace(clip, sounds=()), (63, 48)) == ""
    assert unheld_of_clip("a.mov", None, clip, (64, 48)) == ""
    marked = replace(clip, sounds=("aac",), roles=("dub", "forced"))
    assert unheld_of_clip("a.mp4", None, marked) == unheld_of_clip("a.mkv", None, marked) == ""
    assert unheld_of_clip("a.mov", None, marked) == "a.mov: what its sound is marked as (dub, forced) is not kept"
    for layouts, moved in ((("stereo", "5.1(side)", ""), ""), (("2.1", "4.0", ""), "4.0"), (("", "2.1", "7.0"), "2.1")):
        spread = replace(clip, layouts=layouts)
        said = f"; the loudspeakers of its sound ({moved}) become others" if moved else ""
        assert unheld_of_clip("a.mkv", None, spread) == f"a.mov: its sound (pcm_s24le) becomes flac{said}"
        assert unheld_of_clip("a.mov", None, spread) == ""
    assert "its sound (2.1, 4.0) become" in unheld_of_clip("a.webm", None, replace(clip, layouts=("2.1", "4.0", "")))
    assert "becomes opus; what its sound is marked as (dub) is not kept" in unheld_of_clip("a.webm", None, marked)
    assert unheld_of_clip("a.mov", None, clip, (63, 48)) == (
        "a.mov: its last pixels are repeated, as ProRes has no odd sides"
    )


def test_frames_are_as_long_as_ffmpeg_says_or_fields_are(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """In its words "25 fps, 50 tbr" of frames that are stored as two fields, as it says of some codecs."""
    path, ask = generate(tmp_path / "a.mp4", "testsrc=s=16x16:r=25:d=0.2", "-vf", "format=yuv420p"), ffmpeg.ask
    shortest = ""

    def other(*words: str) -> subprocess.CompletedProcess[bytes]:
        done = ask(*words)
        assert done.stderr.count(b", 25 tbr") == 1
        done.stderr = done.stderr.replace(b", 25 tbr", f", {shortest} tbr".encode())
        return done

    monkeypatch.setattr(ffmpeg, "ask", other)
    for shortest, varies, is_steady in (
        ("25.25", False, True), ("24.25", True, False), ("50", False, False), ("51.25", True, False),
    ):  # fmt: skip
        clip = read_clip(path)
        told = "a.mp4: its frames come at a rate that varies, and become 25 a second" if varies else ""
        assert (clip.note, clip.is_steady) == (told, is_steady), shortest


def test_a_rate_that_varies_is_told(tmp_path: Path):
    slower = "setpts='if(lt(N,10),N/25,10/25+(N-10)/10)/TB'"
    path = generate(
        tmp_path / "a.mp4", "testsrc=s=64x48:r=25:d=1", "-vf", f"{slower},format=yuv420p", "-fps_mode", "vfr"
    )
    assert read_clip(path).note == "a.mp4: its frames come at a rate that varies, and become 25 a second"
    for rate in ("24000/1001", "25", "30000/1001", "60", "12.5"):
        assert read_clip(generate(path, f"testsrc=s=64x48:r={rate}:d=2", "-vf", "format=yuv420p")).note == ""


@pytest.mark.parametrize(
    ("kind", "ending", "codec", "told"),
    [
        ("yuv420p", ".mp4", None, ""),
        ("yuv420p10le", ".mp4", None, "its 10 bits a channel become 8"),
        ("yuv420p10le", ".webm", "av1", ""),
        ("yuv444p", ".mp4", None, "its colours of 4:4:4 become 4:2:0"),
        ("yuv422p10le", ".mp4", None, "its 10 bits a channel become 8; its colours of 4:2:2 become 4:2:0"),
        ("yuv422p10le", ".mov", "prores-422-hq", ""),
        ("gbrp16le", ".mov", None, "its 16 bits a channel become 10"),
        ("gbrp16le", ".mkv", None, ""),
        ("gray10le", ".mp4", None, "its 10 bits a channel become 8"),
        ("yuv420p10le", ".%04d.png", None, ""),
    ],
)
def test_depth_and_colours_of_a_clip_that_a_format_has_no_room_for_are_told(
    tmp_path: Path, kind: str, ending: str, codec: str | None, told: str
):
    path = generate(tmp_path / "a.mkv", "testsrc=s=64x48:r=10:d=0.2", "-vf", f"format={kind}", "-c:v", "ffv1")
    said = encoders.unheld_of_clip(tmp_path / f"b{ending}", codec, read_clip(path))
    assert said == (told and f"a.mkv: {told}")


def test_a_clip_that_grows_while_it_is_looked_into_has_changed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path = generate(tmp_path / "a.avi", "testsrc=s=64x48:r=10:d=1", "-c:v", "mjpeg")
    run = subprocess.run

    def slow_run(command: list[str], **options: Any) -> subprocess.CompletedProcess[Any]:
        told = run(command, **options)
        if f"file:{path}" in command:
            with path.open("ab") as stream:
                stream.write(bytes(99))
        return told

    monkeypatch.setattr(subprocess, "run", slow_run)
    with pytest.raises(UserError, match="it changed while it was read"):
        list(read_clip(path).read_frames())


NOISE = "nullsrc=s=640x480:r=10:d=4,geq=random(1)*255"


@pytest.mark.parametrize("ending", [".mkv", ".mp4", ".avi"])
def test_a_clip_that_is_cut_while_it_is_read_is_a_failure_of_its_own(tmp_path: Path, ending: str):
    path = generate(tmp_path / f"a{ending}", NOISE, "-c:v", "mjpeg", "-q:v", "2")
    size, clip = path.stat().st_size, read_clip(path)
    assert size > 4_000_000  # more than lies in the pipes
    reading = clip.read_frames()
    next(reading)
    os.truncate(path, size // 2)
    with pytest.raises(UserError, match=f"a{ending}: it changed while it was read, from {size} to") as raised:
        list(reading)
    assert raised.value.status == 65


@pytest.mark.parametrize(("kept", "said"), [(1.0, "ffmpeg says no"), (0.5, "it changed while it was read")])
def test_what_fails_of_a_clip_that_has_changed_is_that(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kept: float, said: str
):
    """Whatever ffmpeg says of it then; of one that has not it is what ffmpeg says."""
    path = generate(tmp_path / "a.mkv", "testsrc=s=64x48:r=10:d=1", "-c:v", "mjpeg")
    clip = read_clip(path)

    def failing(*_: object) -> Iterator[bytes]:
        if kept < 1:
            os.truncate(path, round(kept * path.stat().st_size))
        yield from ()
        raise UserError("ffmpeg says no.")

    monkeypatch.setattr(ffmpeg.Ffmpeg, "blocks", failing)
    with pytest.raises(UserError, match=said):
        list(clip.read_frames())


def test_a_clip_that_is_written_anew_in_its_place_has_changed(tmp_path: Path):
    """It may be as long as before by the time all is read."""
    path = generate(tmp_path / "a.mkv", NOISE, "-c:v", "mjpeg", "-q:v", "2")
    data = path.read_bytes()
    reading = read_clip(path).read_frames()
    next(reading)
    path.write_bytes(data[: len(data) // 2] + bytes(len(data) - len(data) // 2))
    with pytest.raises(UserError, match=r"a\.mkv: it changed while it was read; start again") as raised:
        list(reading)
    assert raised.value.status == 65


@pytest.mark.parametrize("change", ["nothing", "another file", "its size", "its time"])
def test_a_clip_is_read_only_as_it_was_when_it_was_opened(tmp_path: Path, change: str):
    """Each by itself: of the others nothing could be seen."""
    path, other = (
        generate(tmp_path / name, "testsrc=s=32x24:r=10:d=0.2", "-c:v", "ffv1") for name in ("a.mkv", "b.mkv")
    )
    clip = read_clip(path)
    if change == "another file":
        other.write_bytes(path.read_bytes())
        other.replace(path)
    elif change == "its size":
        path.write_bytes(path.read_bytes() + b"0")
    os.utime(path, ns=(clip.written, clip.written + (change == "its time")))
    if change == "nothing":
        assert len(list(clip.read_frames())) == 2
    else:
        with pytest.raises(UserError, match=r"a\.mkv: it changed while it was read"):
            list(clip.read_frames())


def test_a_clip_that_was_cut_before_is_read_and_told(tmp_path: Path):
    """By what ffmpeg complains of, or else by the length that the file tells."""
    said: list[str] = []
    path = generate(tmp_path / "a.mkv", "testsrc=s=64x48:r=10:d=4", "-c:v", "mjpeg")
    os.truncate(path, path.stat().st_size // 2)
    assert 10 < len(list(read_clip(path).read_frames(notice=said.append))) < 30
    path = generate(tmp_path / "b.mkv", "testsrc=s=64x48:r=10:d=4", "-f", "lavfi", "-i", "sine=d=8", "-c:v", "mjpeg")
    clip = read_clip(path)
    assert len(list(clip.read_frames(notice=said.append))) == 40
    assert len(said) == 2
    heard: list[str] = []
    for pictures in (
        clip.pictures(notice=heard.append), clip.pictures_from(0, notice=heard.append),
        clip.pictures_from(3, notice=heard.append),
    ):  # fmt: skip
        assert list(pictures)[-1][0] == 39
    assert heard == said[1:] * 3, "whichever way its frames are asked for"
    assert "a.mkv is damaged, and what could be read of it was used" in said[0]
    told = f"{path} should have about 80 frames by its length, and has 40"
    assert said[1] == f"{told}: its sound is longer, or it was cut"


@pytest.mark.parametrize("before", [0, 100], ids=["between two frames", "in a frame"])
def test_an_avi_that_was_cut_is_told_by_how_many_frames(tmp_path: Path, before: int):
    """ffmpeg takes it for as long as what is left; only a frame that is not whole makes it warn."""
    said: list[str] = []
    path = generate(tmp_path / "a.avi", "testsrc2=s=64x48:r=10:d=2", "-c:v", "mjpeg")
    assert len(list(read_clip(path).read_frames(notice=said.append))) == 20
    assert said == []
    data = path.read_bytes()
    os.truncate(path, data.rfind(b"00dc", 0, round(0.9 * len(data))) - before)
    count = len(list(read_clip(path).read_frames(notice=said.append)))
    assert 10 < count < 19
    assert said == [f"{path} was cut: of the 20 frames that it should have, {count} are there"]


def test_a_frame_that_is_not_whole_is_told_where_the_file_does_not_say_how_many_there_are(tmp_path: Path):
    """As of a recording that went on until the power failed: the length in its header is -1."""
    said: list[str] = []
    path = generate(tmp_path / "a.avi", "testsrc2=s=64x48:r=10:d=2", "-c:v", "mjpeg")
    data = path.read_bytes()
    path.write_bytes(data[:4] + b"\xff" * 4 + data[8 : data.rfind(b"00dc", 0, round(0.9 * len(data))) + 2000])
    list(read_clip(path).read_frames(notice=said.append))
    assert [f"{path} is damaged, and what could be read of it was used" in one for one in said] == [True]
    assert "Packet corrupt" in said[0]


@pytest.mark.parametrize("offset", [0, 1.5, 36000])
@pytest.mark.parametrize("ending", ["mkv", "webm", "mov"])
def test_a_clip_of_which_the_clock_began_long_before_is_as_long_as_it_is(tmp_path: Path, offset: float, ending: str):
    """A recording that went on keeps its time in a Matroska, whose length is told from 0: of 10 hours, not 2 s."""
    codec = "libvpx-vp9" if ending == "webm" else "mjpeg"
    path = generate(
        tmp_path / f"a.{ending}", "testsrc=s=64x48:r=10:d=2", "-c:v", codec, "-output_ts_offset", str(offset)
    )
    said: list[str] = []
    clip = read_clip(path)
    assert clip.frames == 20
    assert len(list(clip.read_frames(notice=said.append))) == 20
    assert not said


@pytest.mark.parametrize("ending", ["mkv", "webm"])
def test_a_clip_whose_times_begin_below_zero_is_read_from_there(tmp_path: Path, ending: str):
    """Where ffmpeg cannot seek, the window showed another frame, or none, and the length was half of what it is."""
    codec = "libvpx-vp9" if ending == "webm" else "mjpeg"
    how = ("-c:v", codec, "-output_ts_offset", "-1", "-avoid_negative_ts", "disabled")
    clip = read_clip(generate(tmp_path / f"a.{ending}", "testsrc=s=64x48:r=10:d=2", *how))
    assert clip.frames == 20
    frames = list(clip.read_frames())
    assert len(frames) == 20
    number, picture = next(clip.pictures_from(12))
    assert number == 12
    assert np.array_equal(picture.pixels, frames[12])


@pytest.mark.parametrize("name", ["a.mkv", "a.ogv", "a.gif", "a.apng", "f.%02d.png"])
def test_frames_from_any_number_on_are_those_of_the_whole_and_can_be_cancelled(tmp_path: Path, name: str):
    """Of clips that can be searched, that must be read from their beginning, and whose frames are pictures."""
    codec = {"a.mkv": ("-c:v", "ffv1"), "a.apng": ("-f", "apng")}.get(name, ())
    generate(tmp_path / name, "testsrc2=s=32x24:r=10:d=0.5", *codec)
    clip = open_source(tmp_path / name).clip
    assert clip is not None
    whole = list(clip.pictures())
    assert [number for number, _ in whole] == list(range(clip.start, clip.start + 5))
    for first in range(5):
        found = list(clip.pictures_from(clip.start + first))
        assert [number for number, _ in found] == [number for number, _ in whole[first:]]
        for (_, one), (_, other) in zip(found, whole[first:], strict=True):
            assert np.array_equal(one.pixels, other.pixels)
        for ways in (clip.pictures((clip.start + first, None), cancel=lambda: True),
                     clip.pictures((clip.start + first, None), lambda number: True, lambda: True),  # all are kept
                     clip.pictures_from(clip.start + first, cancel=lambda: True)):  # fmt: skip
            with pytest.raises(Cancelled):
                list(ways)


@pytest.mark.parametrize("ending", ["mp4", "mov", "mkv", "webm"])
@pytest.mark.parametrize("first", [0, 12])
def test_the_sound_of_a_clip_whose_times_begin_below_zero_is_kept(tmp_path: Path, ending: str, first: int):
    source = tmp_path / "a.webm"
    sound = "aevalsrc='if(gt(t,1.5),sin(2000*t),0)':s=48000:d=2"  # nothing is heard of the first second and a half
    command = ["-f", "lavfi", "-i", "testsrc=s=64x48:r=10:d=2", "-f", "lavfi", "-i", sound, "-c:v", "libvpx"]
    ffmpeg.run([*command, "-output_ts_offset", "-1", "-avoid_negative_ts", "disabled", str(source)], str(source))
    clip = read_clip(source)
    how = AnimationOptions(sound=source, frames=20 - first, sound_from=first / 10 + clip.late)
    with animation_writer(tmp_path / f"b.{ending}", 10, how) as write:
        for frame in list(clip.read_frames())[first:]:
            write(frame)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.webm", f"b.{ending}"]
    heard = ffmpeg.ask(
        "-i", f"file:{tmp_path / f'b.{ending}'}", "-map", "0:a", "-f", "f32le", "-ac", "1", "-ar", "48000", "-"
    )
    samples = np.frombuffer(heard.stdout, np.float32)
    assert len(samples) / 48000 == pytest.approx(2 - first / 10, abs=0.05)
    assert np.flatnonzero(np.abs(samples) > 0.1)[0] / 48000 == pytest.approx(1.5 - first / 10, abs=0.03)


@pytest.mark.parametrize("second", ["64x48", "128x96"])
def test_frames_that_change_their_size_are_told(tmp_path: Path, second: str):
    """An MPEG of two recordings; and one that is read from a frame of the second on, as the window does."""
    joined = b""
    for number, size in enumerate(("64x48", second)):
        part = generate(tmp_path / f"{number}.m2v", f"testsrc=s={size}:r=10:d=1", "-c:v", "mpeg2video")
        joined += part.read_bytes()
    path = tmp_path / "a.m2v"
    path.write_bytes(joined)
    clip, said = read_clip(path), list[str]()
    assert {frame.shape for frame in clip.read_frames(notice=said.append)} == {(48, 64, 3)}
    told = f"{path}: its frames are of 64 x 48 and 128 x 96 pixels, and all become 64 x 48"
    assert [line for line in said if "frames are of" in line] == ([told] if second == "128x96" else [])


def test_a_clip_that_is_replaced_or_deleted_while_it_is_read_is_read_to_its_end(tmp_path: Path):
    path = generate(tmp_path / "a.mkv", "testsrc=s=640x480:r=10:d=4", "-c:v", "ffv1")
    other = generate(tmp_path / "b.mkv", "testsrc=s=64x48:r=10:d=1", "-c:v", "ffv1")
    reading = read_clip(path).read_frames()
    next(reading)
    os.replace(other, path)
    assert len(list(reading)) == 39
    reading = read_clip(path).read_frames()
    next(reading)
    path.unlink()
    assert len(list(reading)) == 9

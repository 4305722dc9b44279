"""What animations are encoded with: quality, depth and alpha of each codec, and how large they may be."""

from __future__ import annotations

import re
from collections.abc import Generator
from contextlib import nullcontext
from dataclasses import replace
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import ImageCms

from app.errors import UserError
from app.media import ffmpeg
from app.media.clip import USUAL, FileClip, uncoded
from app.media.encoders import (
    ANIMATIONS,
    Stream,
    check_animation,
    check_colours,
    check_colours_of_picture,
    check_output,
    depth_of,
    is_animation,
    passes,
    written_size,
)
from app.media.formats import FORMATS
from app.model.picture import Picture


class Still(FileClip):
    """A clip without a frame, as only what is known of it is asked."""

    def pictures(self, *given: Any, **named: Any) -> Generator[tuple[int, Picture], None, None]:
        yield from ()


def option(options: list[str], name: str) -> str | None:
    return options[options.index(name) + 1] if name in options else None


@pytest.mark.parametrize(
    ("ending", "codec", "crf", "formats"),
    [
        (".mp4", None, 18, ["yuv420p", "yuv420p", "yuv420p", "yuv420p"]),
        (".mp4", "h265", 20, ["yuv420p", "yuv420p", "yuv420p10le", "yuv420p10le"]),
        (".webm", None, 24, ["yuv420p", "yuva420p", "yuv420p", "yuva420p"]),
        (".webm", "av1", 30, ["yuv420p", "yuv420p", "yuv420p10le", "yuv420p10le"]),
        (".mkv", None, None, ["bgr0", "bgra", "gbrp16le", "gbrap16le"]),
        (".mov", None, None, ["yuv444p10le", "yuva444p10le", "yuv444p10le", "yuva444p10le"]),
        (".mov", "prores-422-hq", None, ["yuv422p10le"] * 4),
        (".apng", None, None, ["rgb24", "rgba", "rgb24", "rgba"]),
        (".webp", None, None, ["yuv420p", "yuva420p", "yuv420p", "yuva420p"]),
    ],
)
def test_each_codec_holds_what_it_can_and_lays_alpha_over_black_where_it_has_none(
    ending: str, codec: str | None, crf: int | None, formats: list[str]
) -> None:
    encoding = ANIMATIONS[ending].encoding(codec)
    streams = [Stream(alpha, bits) for bits in (8, 16) for alpha in (False, True)]
    assert [option(encoding(stream), "-pix_fmt") for stream in streams] == formats
    assert option(encoding(streams[0]), "-crf") == (crf and str(crf))
    assert option(encoding(Stream(False, 8, quality=50)), "-crf") == (crf and "30")
    filters = option(encoding(streams[1]), "-vf") or ""
    assert ("premultiply" in filters) == (ending == ".mp4" or codec in ("av1", "prores-422-hq"))
    assert "premultiply" not in (option(encoding(streams[0]), "-vf") or "")


@pytest.mark.parametrize(
    ("ending", "codec", "most"),
    [
        (".mp4", None, (16384, 16384)),
        (".mp4", "h265", (8192, 8192)),
        (".webm", None, (65536, 65536)),
        (".webm", "av1", (16384, 8704)),
        (".mov", None, (65534, 65534)),
        (".mov", "prores-422-hq", (65534, 65534)),
        (".gif", None, (65535, 65535)),
        (".webp", None, (16383, 16383)),
    ],
)
def test_no_codec_is_given_more_than_it_holds(ending: str, codec: str | None, most: tuple[int, int]) -> None:
    check_animation(f"a{ending}", 25, codec, most)
    for more in ((most[0] + 1, 16), (16, most[1] + 1)):
        with pytest.raises(UserError, match=f"holds no more than {most[0]} x {most[1]}"):
            check_animation(f"a{ending}", 25, codec, more)


def test_what_a_name_asks_for() -> None:
    names = ("a.mp4", "a.MOV", "a.gif", "a.webp", "a.png", "a.%04d.png", "a.####.exr")
    assert [is_animation(name) for name in names] == [True, True, True, False, False, True, True]
    assert [passes(name) for name in ("a.gif", "a.mp4", "a.%04d.png")] == [2, 1, 1]
    check_output("a.webp", animated=True, fps=30)
    check_output("a.png", bits=16)
    refused: list[tuple[str, dict[str, Any], str]] = [
        ("a.png", {"animated": True}, "an animation ends in one of"),
        ("a.mp4", {"codec": "av1"}, "h264 or h265, not av1"),
        ("a.%04d.gif", {}, "a sequence's files are pictures"),
        ("a.%04d.%02d.png", {}, "holds one number"),
        ("a.txt", {}, "a picture's name must end in one of"),
        ("a.png", {"bits": 32}, "holds 8 or 16 bits a channel, not 32"),
    ]
    for name, how, said in refused:
        with pytest.raises(UserError, match=said):
            check_output(name, **how)


TOLD = {"": (1, 13), "BT.2020 PQ": (9, 16), "BT.2020 HLG": (9, 18), "Display P3": (12, 13), "XYZ": (10, 13)}
VIDEOS = ".mp4", ".webm", ".mkv", ".mov"
NAMES = [
    (f"a{number}{ending}", codec, animated)
    for number, endings, animated in (("", FORMATS, False), ("", ANIMATIONS, True), (".%d", FORMATS, True))
    for ending in endings
    for codec in (None, *(ANIMATIONS[ending].codecs if not number and animated else ()))
]


@pytest.mark.parametrize(
    ("has", "offered"),
    [
        ("libx264 libx265 libaom-av1", ".mov, .mkv, .mp4 with --codec h265, .webm with --codec av1, or name"),
        ("libx264 libx265", ".mov, .mkv, .mp4 with --codec h265, or name"),
        ("libx264", ".mov, .mkv, or name"),
    ],
)
def test_what_is_advised_is_what_this_ffmpeg_can_encode(
    monkeypatch: pytest.MonkeyPatch, has: str, offered: str
) -> None:
    """It was H.265 and AV1 whatever encoders there are."""
    monkeypatch.setattr(ffmpeg, "encoders", lambda: frozenset(has.split()))
    picture = Picture(np.zeros((4, 4, 3), np.uint16), chunks={b"cICP": bytes([9, 16, 0, 1])})
    for name in ("a.gif", "a.mp4"):
        with pytest.raises(UserError) as raised:
            check_colours_of_picture(name, None, picture, animated=True)
        assert str(raised.value).partition("; write ")[2] == f"{offered}.%04d.png."


@pytest.mark.parametrize(
    ("longest", "offered"),
    [
        (8192, ".mov, .mkv, .mp4 with --codec h265, .webm with --codec av1, or name"),
        (9000, ".mov, .mkv, .webm with --codec av1, or name"), (17000, ".mov, .mkv, or name"),
        (70000, ".mkv or name"),
    ],
)  # fmt: skip
def test_what_is_advised_has_room_for_the_result(monkeypatch: pytest.MonkeyPatch, longest: int, offered: str) -> None:
    monkeypatch.setattr(ffmpeg, "encoders", lambda: frozenset(["libx264", "libx265", "libaom-av1"]))
    picture = Picture(np.zeros((4, 4, 3), np.uint16), chunks={b"cICP": bytes([9, 16, 0, 1])})
    with pytest.raises(UserError) as raised:
        check_colours_of_picture("a.gif", None, picture, animated=True, size=(longest, longest // 4))
    assert str(raised.value).partition("; write ")[2] == f"{offered}.%04d.png."
    shallow = replace(picture, pixels=np.zeros((4, 4, 3), np.uint8))
    with pytest.raises(UserError) as raised:
        check_colours_of_picture("a.mp4", None, shallow, animated=True, size=(longest, longest // 4))
    mend = "make it smaller" if longest > 65534 else "write .mov"
    assert str(raised.value).endswith(f"BT.2020 PQ, and 8 bits are too few; {mend}.")


@pytest.mark.parametrize("named", TOLD)
@pytest.mark.parametrize("bits", [8, 16])
def test_colours_go_where_they_can_be_told_and_a_refusal_names_what_tells_them(named: str, bits: int) -> None:
    """Of stills and of animations of a picture, and of a clip, whose colours are written as a picture's are."""
    values = np.zeros((4, 4, 3), np.uint8 if bits == 8 else np.uint16)
    picture = Picture(values, chunks={b"cICP": bytes([*TOLD[named], 0, 1])})
    colours = uncoded(picture.chunks)
    assert (colours is None) == (named == "XYZ")
    clip = Still(path=Path("b.mov"), width=4, height=4, bits=bits, alpha=False, pixel_format="yuv444p10le",
                 fps=Fraction(25), colours=colours or USUAL)  # fmt: skip
    for name, codec, animated in NAMES:
        ending = Path(name).suffix
        is_video = animated and ending in VIDEOS
        few = is_video and bits_of(ending, codec, bits) < 10 and ("PQ" in named or "HLG" in named)
        takes = not named or ((is_video and named != "XYZ" and not few) or (ending == ".png"))
        asked = [partial(check_colours_of_picture, picture=picture)]
        asked += [partial(check_colours, clip=clip)] if named != "XYZ" else []
        for check in asked:
            if takes:
                check(name, codec, animated=animated)
                continue
            with pytest.raises(UserError) as raised:
                check(name, codec, animated=animated)
            what = "the colours of b.mov" if check.func is check_colours else "the picture's colours"
            said = f"{what} are {named}, and 8 bits are too few" if few else f"it cannot tell that {what} are {named}"
            assert str(raised.value).startswith(f"Cannot write {name}: {said}; write ")
            mends = re.findall(r"(\S*\.\w+)(?: with --codec (\w+))?", str(raised.value).partition("; write ")[2])
            assert mends
            assert not (few and bits == 8 and "png" in str(raised.value)), "which has 8 bits too"
            assert (mends == [(".png", "")]) == (not animated), "of a still a still"
            for other, more in mends:
                other = f"a{other}" if other.startswith(".") else other
                check(other, more or None, animated=is_animation(other))


def bits_of(ending: str, codec: str | None, bits: int) -> int:
    """Bits a channel that a video has, made of a picture with `bits`."""
    options = ANIMATIONS[ending].encoding(codec)(Stream(False, bits))
    return depth_of(option(options, "-pix_fmt") or "")[0]


def test_a_profile_tells_the_colours_too_where_a_file_has_one() -> None:
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    picture = Picture(np.zeros((4, 4, 3), np.uint8), icc=profile, chunks={b"cICP": bytes([9, 16, 0, 1])})
    for ending, kind in FORMATS.items():
        for name, animated in ((f"a{ending}", False), (f"a.%d{ending}", True)):
            with nullcontext() if "icc" in kind.keeps else pytest.raises(UserError, match="it cannot tell that"):
                check_colours_of_picture(name, None, picture, animated)


@pytest.mark.parametrize("ending", [*FORMATS, *ANIMATIONS])
def test_a_result_has_the_size_that_is_told_of_it(ending: str) -> None:
    """Odd sides become even in the videos whose encoders have no others, and in no file of a sequence."""
    even = ending in (".mp4", ".webm", ".mov")
    for size in ((4, 6), (5, 6), (4, 7), (5, 7), (1, 1)):
        assert written_size(f"a{ending}", size) == tuple(side + side % 2 * even for side in size)
        assert written_size(f"a.%d{ending}", size) == size


def test_a_video_says_what_its_colours_are_and_a_lossless_one_that_they_are_srgb_s() -> None:
    mp4, mkv = (ANIMATIONS[ending].encoding(None)(Stream(False, 8, colours=USUAL)) for ending in (".mp4", ".mkv"))
    assert "colorspace=bt709:color_primaries=bt709:color_trc=bt709:range=tv" in (option(mp4, "-vf") or "")
    assert option(mkv, "-vf") == "setparams=color_primaries=bt709:color_trc=iec61966-2-1"

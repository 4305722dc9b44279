"""What animations are encoded with: quality, depth and alpha of each codec, and how large they may be."""

from __future__ import annotations

from typing import Any

import pytest

from app.errors import UserError
from app.media.clip import USUAL
from app.media.encoders import ANIMATIONS, Stream, check_animation, check_output, is_animation, passes


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


def test_a_video_says_what_its_colours_are_and_a_lossless_one_that_they_are_srgb_s() -> None:
    mp4, mkv = (ANIMATIONS[ending].encoding(None)(Stream(False, 8, colours=USUAL)) for ending in (".mp4", ".mkv"))
    assert "colorspace=bt709:color_primaries=bt709:color_trc=bt709:range=tv" in (option(mp4, "-vf") or "")
    assert option(mkv, "-vf") == "setparams=color_primaries=bt709:color_trc=iec61966-2-1"

"""What comes back from files of every kind, and what is said of what does not, as `golden/media.txt` has it in sums."""

from __future__ import annotations

import re
from collections.abc import Callable, Generator, Iterator
from dataclasses import replace
from fractions import Fraction
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from app.errors import UserError
from app.media.clip import Colours, FileClip, coded
from app.media.depth import as_half, over, to_bits
from app.media.displacement import Displacement, cropped, folds
from app.media.encoders import (
    ANIMATIONS,
    check_colours,
    check_output,
    crf_of,
    is_animation,
    unheld_of_clip,
)
from app.media.formats import FORMATS, check_picture_output
from app.media.holding import unheld
from app.media.landmarks import Pairs, read_pairs, write_pairs
from app.media.losses import unusual_colours
from app.media.maps import MAP_ENDINGS, holds, read_map, write_map
from app.media.outlines import paired, read_outlines, resampled
from app.media.pictures import read_picture, write_picture
from app.model.picture import Layer, Picture
from support.golden import Golden, Sum

# What is left open is told when it is collected, where nothing can be raised any more.
pytestmark = [
    pytest.mark.usefixtures("collected"),
    pytest.mark.filterwarnings("error::ResourceWarning", "error::pytest.PytestUnraisableExceptionWarning"),
]

CLOSE, CLOSE_LOSSY = 1e-4, 0.03
LOSSY = re.compile(r"\.(jpe?g|webp|avif|jp2)")
SIZE = 20, 14
DTYPES = {8: np.uint8, 16: np.uint16, 32: np.float32}
BAD_PAIRS = {
    "a.csv": (
        "x0,y0,x1,y1\n1,2,3", "x0,y0,x1\n1,2,3", "x0,y0,x1,y1\n1,2,3,a", "", "x0,y0,x1,y1\n",
        "curve,x0,y0,x1,y1\na,1,2,3,4\na,,,5,6", "curve,x0,y0,x1,y1\na,1,2,,", "x0,y0,x1,y1\n1,2,3,inf",
        "1,2,3,4\n5,6,7,8",
    ),
    "a.pts": (
        "version: 1\nn_points: 2\n{\n1 2\n}", "version: 1\nn_points: 1\n{\n1\n}", "n_points: x\n{\n}", "{\n1 2", "1 2",
    ),
    "a.tps": (
        "LM=1\n1 2\nLM=2\n1 2\n3 4", "LM=2\n1 2\nID=0", "LM=x", "1 2", "LM=1\n1 b\n",
        "LM=1\n1 2\nLM=1\n3 4\nLM=1\n5 6",
    ),
}  # fmt: skip


def picture(channels: int, bits: int) -> Picture:
    y, x = np.mgrid[0 : SIZE[1], 0 : SIZE[0]] / 20
    waves = [0.5 + 0.45 * np.sin((5 + 2 * k) * x + k) * np.cos(4 * y - k) for k in range(channels)]
    values = np.stack(waves, axis=-1)
    values = values * {8: 255, 16: 65535, 32: 1.0}[bits]
    return Picture(values.astype(DTYPES[bits]), dpi=(300.0, 150.0), texts={"Author": "somebody"})


def tried(what: Callable[[], Any]) -> Any:
    """What comes of it, or what is said against it."""
    try:
        return what()
    except (UserError, ValueError) as error:
        return re.sub(r"[^ ]*/", "", f"{type(error).__name__}: {error}")  # without the folder


def told(picture: Picture) -> dict[str, Any]:
    """A picture, but for what libraries make of its metadata."""
    return vars(picture) | {name: getattr(picture, name) is not None for name in ("icc", "exif", "xmp")}


def of_pictures(folder: Path) -> Iterator[tuple[str, Any]]:
    """Every way to write one."""
    for ending, channels, bits in product(FORMATS, range(1, 5), (8, 16, 32)):
        given, path = picture(channels, bits), folder / f"a{ending}"
        ways: list[dict[str, Any]] = [{}, {"quality": 20}, *({"bits": asked} for asked in FORMATS[ending].bits)]
        for way in ways if channels in (1, 4) else ways[:1]:
            yield (
                f"{ending} {channels} {bits} {way}",
                tried(lambda p=path, g=given, w=way: write_picture(p, g, **w) or told(read_picture(p))),
            )
    for codec in (*FORMATS[".exr"].codecs, "zip9", "h264"):
        path = folder / "a.exr"
        given = picture(3, 32)
        yield (
            f"codec {codec}",
            tried(lambda c=codec, p=path, g=given: write_picture(p, g, codec=c) or told(read_picture(p))),
        )


def of_what_is_read(folder: Path) -> Iterator[tuple[str, Any]]:
    """Pictures as another program writes them, in its modes."""
    base = Image.fromarray(picture(4, 8).pixels)
    for mode, ending in product(
        ("1", "L", "LA", "P", "RGB", "RGBA", "CMYK", "YCbCr", "I;16", "I", "F", "HSV"),
        (".png", ".tif", ".bmp", ".gif", ".tga", ".ppm", ".pgm", ".pcx", ".sgi", ".ico", ".jp2", ".dds"),
    ):
        path = folder / f"b{ending}"
        path.unlink(missing_ok=True)
        try:
            (base.convert("I").convert(mode) if mode in ("I;16", "F") else base.convert(mode)).save(path)
        except (OSError, ValueError, KeyError):
            continue
        yield f"{mode} {ending}", tried(lambda p=path: told(read_picture(p)))
        yield f"{mode} {ending} limit", tried(lambda p=path: read_picture(p, 100))
    for orientation in range(1, 9):
        exif = Image.Exif()
        exif[0x0112] = orientation
        for ending in (".tif", ".png"):
            base.convert("RGB").save(folder / f"c{ending}", exif=exif, dpi=(200, 100))
            yield f"turned {orientation} {ending}", told(read_picture(folder / f"c{ending}"))


def of_losses(folder: Path) -> Iterator[tuple[str, Any]]:
    layered = replace(picture(4, 32), layers=(Layer("Z", np.ones((14, 20), np.float32)),), origin=(3, 4),
                      chromaticities=(0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.329),
                      wide=np.zeros((16, 22, 4), np.float32), margins=(1, 1, 1, 1))  # fmt: skip
    for ending in (*FORMATS, ".mp4"):
        animated = ending == ".mp4"
        ways = [unheld(f"a{ending}", layered, with_layers=how, animated=animated) for how in (True, False)]
        yield f"unheld {ending}", ways
        for bits, size, codec in ((8, None, None), (32, None, None), (None, (20000, 5), None), (None, None, "piz")):
            yield (
                f"asked {ending}",
                tried(lambda e=ending, b=bits, s=size, c=codec: check_picture_output(f"a{e}", b, s, c)),
            )
    for primaries, transfer in product((1, 2, 9, 12), (1, 2, 13, 16, 18)):
        yield "colours", unusual_colours(primaries, transfer)
    for primaries, transfer in product(("bt709", "bt2020", "smpte432"), ("bt709", "smpte2084")):
        colours = Colours(primaries, transfer)
        yield "coded", [colours.is_usual, colours.is_high, {str(key): [*part] for key, part in coded(colours).items()}]
    for bits, given in product((8, 16, 32), (8, 16, 32)):
        yield (
            f"depth {given} {bits}",
            [to_bits(picture(3, given).pixels, bits, dither=dither) for dither in (False, True)],
        )
        yield f"over {given}", over(picture(4, given).pixels, (200, 100, 50))
    yield "halves", as_half(np.array([1e9, -1e9, 1e-9, 0.1, np.inf, -np.inf, 65504, 65520]))
    part = picture(4, 32)
    for one in (layered, layered.cropped(), layered.stripped(), replace(part, premultiplied=True).straight()):
        yield "values", [told(one), one.width, one.height, one.bits, one.linear, one.has_alpha]


class Still(FileClip):
    """A clip of which only what is known of it is asked."""

    def pictures(self, *given: Any, **named: Any) -> Generator[tuple[int, Picture], None, None]:
        yield 0, picture(3, self.bits)


def of_clips(folder: Path) -> Iterator[tuple[str, Any]]:
    (folder / "a.mov").write_bytes(b"a clip")
    clips = [
        Still(path=folder / "a.mov", width=20, height=14, bits=bits, alpha=alpha, pixel_format=stored,
              fps=Fraction(fps), colours=Colours(*colours), timecode=timecode, durations=durations, start=2)
        for bits, alpha, stored, fps, colours, timecode, durations in (
            (8, False, "yuv420p", "25", (), None, None),
            (16, False, "yuv422p10le", "30000/1001", ("bt2020", "smpte2084", "bt2020nc"), "00:59:59;28",
             (1, 3, 2)),
            (8, True, "rgba", "24", ("smpte432", "bt709"), "23:59:59:23", None),
            (16, True, "gbrap16le", "60000/1001", ("bt2020", "arib-std-b67"), "01:00:00;02", None),
        )
    ]  # fmt: skip
    for clip in clips:
        yield "clip", [clip.moment(7), clip.lengths((1, None)), clip.lengths((0, 1)), clip.digest(3)]
        yield "time codes", [clip.timecode_at(number) for number in (2, 3, 27, 100, 1799, 1802, 3600, 18000, 40000)]
    for ending in (*ANIMATIONS, *FORMATS, ".avi"):
        known = [codec for codec in getattr(ANIMATIONS.get(ending), "codecs", ()) if codec not in ("h265", "av1")]
        codecs = (None, *known, "other")  # some ffmpegs have not all
        for clip, codec in product(clips, codecs[:-1]):
            for name, animated in ((f"a{ending}", True), (f"a{ending}", False), (f"a.%02d{ending}", True)):
                yield f"colours {ending}", tried(lambda n=name, c=codec, k=clip, a=animated: check_colours(n, c, k, a))
            if codec:
                yield f"unheld {ending}", unheld_of_clip(f"a{ending}", codec, clip)
        for codec, fps, size, bits in product(codecs, (0, 30, 60, 2000), (None, (17000, 9000)), (None, 16)):
            name = f"a{ending}"
            yield (
                f"output {ending}",
                tried(lambda n=name, c=codec, f=fps, s=size, b=bits: check_output(n, fps=f, codec=c, bits=b, size=s)),
            )
        yield f"kind {ending}", [is_animation(f"a{ending}"), is_animation(f"a.%d{ending}")]
    yield "quality", [crf_of(quality) for quality in (1, 50, 100)]


def of_maps(folder: Path) -> Iterator[tuple[str, Any]]:
    y, x = np.mgrid[0:14, 0:20]
    values = np.stack([0.09 * np.sin(y / 3) + 0.2 * np.sin(x), 0.05 * np.cos(x / 2)], axis=-1).astype(np.float32)
    with_holes = values.copy()
    with_holes[3:5, 6] = np.nan
    for ending, kind, overscan, field in product(MAP_ENDINGS, ("st", "offsets"), (0, 2), (values, with_holes)):
        path, given = folder / f"m{ending}", Displacement(field, overscan, forward=overscan > 0)
        write_map(path, given, kind)
        yield f"{ending} {kind} {overscan}", [holds(path), np.nan_to_num(read_map(path).values, nan=9.0)]
        ways: tuple[dict[str, Any], ...] = (
            {"kind": "offsets"}, {"grid": "corners"}, {"grid": "pixels"}, {"overscan": 3}, {"overscan": 7},
            {"max_pixels": 9},
        )  # fmt: skip
        for more in ways:
            found = tried(lambda p=path, m=more: read_map(p, **m))
            yield f"{ending} {more}", [found if isinstance(found, str) else np.nan_to_num(found.values, nan=9.0)]
        yield (
            "fitted",
            [
                tried(lambda g=given, s=size: np.nan_to_num(g.fitted(*s).values))
                for size in ((40, 28), (41, 28), (50, 28))
            ],
        )
        yield "cropped", np.nan_to_num(cropped(given).values)
    yield "folds", [folds(scale * values.astype(np.float64)) for scale in (0.1, 0.5, 1, 3)]
    y, x = np.mgrid[0:30, 0:40]
    for name, middle in (("one", 15), ("other", 22)):
        chosen = (np.hypot(x - middle, y - 14) < 9).astype(np.uint8) * 255
        write_picture(folder / f"{name}.png", Picture(np.dstack([chosen] * 3)))
    line, notices = read_outlines(folder / "one.png", folder / "other.png", (40, 30))
    yield "outlines", [line, notices]
    corners = np.array([[0, 0], [3, 0], [3, 4], [0.5, 5]], float)
    yield "lines", [resampled(corners, 7), paired(corners, corners[::-1] + 1, 0.7)]


def fields_of(pairs: Pairs) -> dict[str, Any]:
    return {"places": pairs.places, "curves": pairs.curves}


def of_pairs(folder: Path) -> Iterator[tuple[str, Any]]:
    places = np.random.default_rng(3).random((5, 2, 2))
    for ending, curves in product((".csv", ".pts", ".tps"), (("",) * 5, ("", "a", "a", "b", "b"))):
        path = folder / f"p{ending}"
        write_pairs(path, Pairs(places, curves), SIZE)
        yield f"written {ending}", path.read_text()
        files = [path] * (2 if ending == ".pts" else 1)
        yield f"read {ending}", tried(lambda f=files: fields_of(read_pairs(f, SIZE)))
    for name, texts in BAD_PAIRS.items():
        for text in texts:
            (folder / name).write_text(text)
            yield f"bad {name}", tried(lambda n=name: fields_of(read_pairs([folder / n], SIZE)))


@pytest.mark.parametrize(
    "kind", [of_pictures, of_what_is_read, of_losses, of_clips, of_maps, of_pairs], ids=lambda kind: kind.__name__
)
def test_files_give_what_is_written_down(
    kind: Callable[[Path], Iterator[tuple[str, Any]]], tmp_path: Path, golden: Golden
):
    sums: dict[str, Sum] = {}
    for name, value in kind(tmp_path):
        name = f"{kind.__name__} {name}".replace(": ", " ")
        sums.setdefault(name, Sum(1.0)).add(value)
    found = {name: one.row for name, one in sums.items()}
    golden.compare_all(found, f"{kind.__name__} ", lambda name, row: CLOSE_LOSSY if LOSSY.search(name) else CLOSE)


@pytest.fixture(scope="module")
def golden() -> Iterator[Golden]:
    golden = Golden("media.txt")
    yield golden
    golden.close()

"""What a file does not hold of a picture, and which other file would."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from PIL import ExifTags, Image

from app.media.animation import ANIMATIONS
from app.media.depth import to_bits
from app.media.formats import FORMATS
from app.media.holding import Losses, Written
from app.model.picture import Layer, Picture

BESIDE: tuple[dict[str, Any], ...] = (
    {}, {"dpi": (72.5, 72.5)}, {"dpi": (30.0, 60.0)}, {"texts": {"Title": "x"}}, {"xmp": b"<x/>"}, {"origin": (1, 2)},
)  # fmt: skip


def losses(path: str, picture: Picture, **how: Any) -> Losses:
    found = Losses(path, Written(**how))
    found.look(picture)
    return found


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.float32])
def test_what_a_sentence_says_to_write_keeps_all_that_it_says_is_lost(kind: type) -> None:
    """Of pictures, and of animations; also where fewer bits were asked for."""
    values = np.random.default_rng(0).integers(0, 65536, (8, 8, 4)).astype(np.uint16)
    pixels = {np.uint8: values >> 8, np.float32: values / np.float32(40000)}.get(kind, values).astype(kind)
    ways: list[tuple[str, dict[str, Any]]] = [(f"a{ending}", {}) for ending in FORMATS]
    ways += [(f"a{ending}", {"bits": 8}) for ending in FORMATS if ending != ".exr"]
    ways += [(f"a{ending}", {"animated": True}) for ending in ANIMATIONS]
    told = 0
    for beside in BESIDE:
        for channels in (1, 2, 3, 4):
            picture = Picture(np.ascontiguousarray(pixels[..., -channels:]), **beside)
            for path, how in ways:
                found = losses(path, picture, **how)
                if "write" in found.said:
                    ending = re.search(r"write (\.\w+|it with more bits) to keep", found.said)
                    assert ending is not None
                    other = f"a{ending[1]}" if ending[1].startswith(".") else path
                    kept = losses(other, picture, **how | {"bits": None})
                    assert not found.lost & kept.lost, found.said
                    told += 1
    assert told > 50


@pytest.mark.parametrize(
    ("path", "kind", "beside", "named"),
    [
        ("a.jpg", np.uint8, {}, ".png"), ("a.%02d.jpg", np.uint8, {}, ".png"), ("a.avif", np.uint16, {}, ".png"),
        ("a.tif", np.uint16, {"texts": {"T": "x"}}, ".png"), ("a.png", np.uint16, {"premultiplied": True}, ".tif"),
        ("a.png", np.uint8, {"origin": (1, 2)}, ".exr"), ("a.png", np.float32, {}, ".exr"),
        ("a.jpg", np.float32, {}, ".exr"), ("a.tif", np.float32, {"texts": {"T": "x"}}, ".exr"),
        ("a.exr", np.float32, {"xmp": b"<x/>"}, ".tif"), ("a.mp4", np.uint8, {}, ".mkv"),
        ("a.gif", np.uint8, {}, ".mkv"), ("a.webm", np.uint16, {}, ".mkv"), ("a.mov", np.uint16, {}, ".mkv"),
    ],
)  # fmt: skip
def test_of_several_kinds_that_hold_it_the_usual_one_is_named(
    path: str, kind: type, beside: dict[str, Any], named: str
) -> None:
    """Of stills PNG, then TIFF; of light EXR, then TIFF; of animations Matroska."""
    values = np.random.default_rng(0).integers(0, 65536, (8, 8, 4)).astype(np.uint16)
    pixels = {np.uint8: values >> 8, np.float32: values / np.float32(40000)}.get(kind, values).astype(kind)
    animated = "%" in path or f".{path.split('.')[-1]}" in ANIMATIONS
    assert f"; write {named} to keep" in losses(path, Picture(pixels, **beside), animated=animated).said


@pytest.mark.parametrize("is_light", [False, True])
def test_only_what_is_multiplied_by_alpha_is_divided_by_it(is_light: bool) -> None:
    """A PNG of 16 bits holds codes of 16 bits with any alpha, unless the colours are brighter than white."""
    codes = np.random.default_rng(0).integers(1, 65536, (8, 8, 4)).astype(np.uint16)
    pixels = to_bits(codes, 32) if is_light else codes
    assert not losses("a.png", Picture(pixels)).lost
    assert "above" in losses("a.png", Picture(pixels, premultiplied=True)).lost


def sequence(path: str, *pictures: Picture) -> Losses:
    found = Losses(path, Written(animated=True))
    for picture in pictures:
        found.look(picture)
    return found


def test_what_later_pictures_lose_besides_is_told_in_the_same_words() -> None:
    """Each name once, however often it comes; of many only some, and how many more."""
    grey = np.zeros((8, 8, 1), np.uint8)
    one, two, both = (Picture(grey, texts=dict.fromkeys(names, "x")) for names in (["T2"], ["T4"], ["T4", "T2"]))
    for path, mend in (("a.%d.jpg", "; write .png to keep it"), ("a.gif", "")):
        assert (
            sequence(path, Picture(grey), one, one, two, both).said == f"{path} lacks the picture's texts T2, T4{mend}"
        )
    many = sequence("a.%d.jpg", *(Picture(grey, texts={f"T{number}": "x"}) for number in range(1000)))
    assert "lacks the picture's texts T0, T1, T2, T3 and 996 more; write" in many.said
    exif = [Image.Exif(), Image.Exif()]
    exif[0][ExifTags.Base.ImageDescription], exif[1][ExifTags.Base.Artist] = "a cup", "me"
    said = sequence("a.%d.exr", *(Picture(grey, exif=each.tobytes()[6:]) for each in exif)).said
    assert said == "a.%d.exr lacks the picture's EXIF (ImageDescription, Artist); write .png to keep it"


def test_what_is_advised_holds_what_later_pictures_lose_besides() -> None:
    """A PNG has texts, but none of such names."""
    grey = np.zeros((8, 8, 1), np.uint8)
    first, second = (Picture(grey, texts={name: "x"}) for name in ("T", "\u03b1"))
    assert sequence("a.%d.jpg", first).said.endswith("write .png to keep it")
    assert sequence("a.%d.jpg", first, second).said.endswith("write .exr to keep it")


def test_what_is_advised_has_room_for_the_result() -> None:
    """Of what neither PNG nor TIFF holds, WebP does, and JPEG where that is too large."""
    exif = Image.Exif()
    exif[ExifTags.Base.Rating] = 3
    picture = Picture(np.zeros((8, 8, 3), np.uint8), xmp=b"\xff", exif=exif.tobytes()[6:])
    for longest, ending in ((16383, ".webp"), (16384, ".jpg")):
        assert losses("a.exr", picture, size=(longest, 8)).said.endswith(f"; write {ending} to keep all of it")


def test_what_differs_from_picture_to_picture_is_told_shortly() -> None:
    light = np.zeros((8, 8, 3), np.float32)
    wide = [Picture(light, wide=np.zeros((8 + by, 8 + by, 3), np.float32), margins=(0, by, by, 0)) for by in (3, 7, 5)]
    assert "lacks the picture's overscan (up to 7 px beyond" in sequence("a.%d.tif", *wide).said
    colours = np.zeros((8, 8, 3), np.uint8)
    gammas = [Picture(colours, chunks={b"gAMA": value.to_bytes(4, "big")}) for value in range(50_000, 150_000, 10_000)]
    told = "gamma of 0.5 (gAMA) and gamma of 0.6 (gAMA) and gamma of 0.7 (gAMA) and gamma of 0.8 (gAMA) and others"
    assert f"cannot tell the picture's {told};" in sequence("a.%d.jpg", *gammas).said
    origins = [Picture(light, origin=(place, 2)) for place in (1, 3, 1)]
    assert "begins at 0, 0 and not at 1, 2 or 3, 2 as" in sequence("a.%d.tif", *origins).said
    dots = [Picture(colours, dpi=(dpi, dpi)) for dpi in (72.4, 300.4)]
    values = np.zeros((8, 8), np.float32)
    parts = ({"name": "beauty"}, {"name": "depth"}, {})
    layers = [Picture(light, layers=(Layer(name, values, part=at),), parts=parts) for name, at in (("Z", 1), ("id", 2))]
    told = "lacks the picture's channels Z, id of the parts depth, 3;"
    assert told in sequence("a.%d.jpg", *layers, *layers).said
    told = "says 72 dpi and not 72.4 or 300 dpi and not 300.4 as the picture: JPEG"
    assert told in sequence("a.%d.jpg", *dots).said


def test_a_name_in_capitals_holds_the_same() -> None:
    values = np.random.default_rng(0).random((8, 8, 4), np.float32) * 2
    picture = Picture(values, xmp=b"<x/>", dpi=(72.5, 72.5))
    ways: list[tuple[str, dict[str, Any]]] = [(ending, {}) for ending in FORMATS]
    ways += [(ending, {"animated": True}) for ending in ANIMATIONS]
    told = 0
    for ending, how in ways:
        found, loud = losses(f"a{ending}", picture, **how), losses(f"a{ending.upper()}", picture, **how)
        assert (loud.lost, loud.said.lower()) == (found.lost, found.said.lower())
        told += bool(found.lost)
    assert told > 10

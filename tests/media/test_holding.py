"""What a file does not hold of a picture, and which other file would."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from app.media.animation import ANIMATIONS
from app.media.depth import to_bits
from app.media.formats import FORMATS
from app.media.holding import Losses, Written
from app.model.picture import Picture

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

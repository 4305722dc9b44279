"""What a file does not hold of a picture, and which other file would."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from app.media.animation import ANIMATIONS
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

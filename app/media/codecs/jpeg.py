"""JPEG: 8 bits of grey or RGB, and of its texts one comment."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

from app.media.codecs import pillow
from app.model.picture import Picture

read = partial(pillow.read, "JPEG")


def write(path: Path, picture: Picture, quality: int) -> None:
    """Write a JPEG, its colours in full resolution."""
    # Not optimized: that gains a few per cent, holds the file in memory once more, and fails where noise makes the
    # file larger than the buffer Pillow guesses.
    options: dict[str, Any] = {"subsampling": 0, "comment": picture.texts.get("Comment", "")}
    if picture.dpi:
        options["dpi"] = tuple(round(value) for value in picture.dpi)
    pillow.write("JPEG", path, picture, quality, **options)

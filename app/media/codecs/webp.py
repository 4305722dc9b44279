"""WebP: 8 bits of RGB, lossless at quality 100."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from app.media.codecs import pillow
from app.model.picture import Picture

read = partial(pillow.read, "WEBP")


def write(path: Path, picture: Picture, quality: int) -> None:
    """Write a WebP, with the colours of what is transparent."""
    pillow.write("WEBP", path, picture, quality, lossless=quality == 100, exact=True)

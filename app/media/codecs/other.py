"""Kinds that are read only, through imageio; some of them, as TGA, have no signature."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from app.errors import UserError
from app.media.codecs.decoding import start_of
from app.media.codecs.tiff import plain_depth
from app.media.inputs import check_size
from app.model.picture import Picture

GAP = rb"(?:\s|#[^\n\r]*+)++"  # possessive: each way to split a comment into comments would be tried otherwise
DEEPEST = rb"P[36]" + GAP + rb"\d++" + GAP + rb"\d++" + GAP + rb"(\d{1,5})"  # of a PPM's header (ppm(5))


def read(name: str, file: Path, max_pixels: int) -> Picture:
    """Read the first picture of a file; `name` is what messages call its kind."""
    import imageio.v3 as iio
    from PIL import Image

    Image.MAX_IMAGE_PIXELS = None  # ours is in check_size, and can be raised for a file
    if (deepest := re.match(DEEPEST, start_of(file))) and int(deepest[1]) > 255:
        # it would be read as 8 bits without a word
        raise UserError(f"Cannot read {file}: a {name} of 16-bit colours is not supported; convert it to PNG or TIFF.")
    # the plugin is named, or imageio takes whichever it can open the file with
    with iio.imopen(file, "r", plugin="pillow") as opened:
        height, width = opened.properties(index=0).shape[:2]
        check_size(file, width, height, max_pixels)
        pixels = opened.read(index=0)
    if pixels.dtype == np.int32:  # Pillow's mode for 16-bit grey
        pixels = np.clip(pixels, 0, 65535).astype(np.uint16)
    return Picture(plain_depth(file, pixels if pixels.ndim == 3 else pixels[..., None]))

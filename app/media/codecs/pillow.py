"""What Pillow decodes and encodes, for several kinds of files."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from app.errors import UserError
from app.media.codecs.cmyk import cmyk_to_rgb
from app.media.codecs.layered import MOST_FRAMES
from app.media.codecs.metadata import ORIENTATION, sized_exif, told_dpi, upright, upright_dpi, upright_exif, upright_xmp
from app.media.inputs import check_size
from app.media.losses import lost
from app.model.picture import Picture

IN_EXIF = ("WEBP", "AVIF")  # which tell their resolution there, and nowhere else
RAW_EXIF = "Raw profile type exif"  # the text of a PNG that was EXIF before there was a chunk for that
MOST_TEXT = 64 * 2**20  # bytes of a profile or text in a PNG, unpacked


def read(name: str, file: Path, max_pixels: int) -> Picture:
    """The first frame of a file that is of Pillow's kind `name`."""
    with opened(name, file, max_pixels) as image:
        return picture_of(image, file, [])


@contextmanager
def opened(name: str, file: Path, max_pixels: int) -> Iterator[Any]:
    """Pillow's image of a file that is of its kind `name`, not decoded yet."""
    from PIL import Image, PngImagePlugin

    Image.MAX_IMAGE_PIXELS = None  # what a file says of itself has our limit: see check_size
    warnings.simplefilter("ignore", Image.DecompressionBombWarning)
    PngImagePlugin.MAX_TEXT_CHUNK = MOST_TEXT  # 1 MiB of its own is less than some profiles have
    with Image.open(file, formats=["JPEG", "MPO"] if name == "JPEG" else [name]) as image:
        check_size(file, *image.size, max_pixels)
        try:
            Image.MAX_IMAGE_PIXELS = max(max_pixels // 2, 1)  # a later frame is refused beyond twice this
            yield image
        except Image.DecompressionBombError:
            raise too_large(file, max_pixels) from None


def too_large(file: Path, max_pixels: int) -> UserError:
    """What is said of a file of which a later frame is larger than a picture may be."""
    return UserError(f"Cannot read {file}: a frame of it has more than the limit of {max_pixels} pixels; get it again.")


def picture_of(
    image: Any, file: Path, losses: list[str], pixels: np.ndarray | None = None, count: int | None = None
) -> Picture:
    """The picture that `image` is, with these `pixels` if they are given, and what belongs to it.

    losses: what is known to be lost of the file; what else is goes to their end.
    count: of the frames in the file, for which Pillow else is asked.
    """
    from PIL import ExifTags, Image

    icc = image.info.get("icc_profile")
    if pixels is None and image.mode == "CMYK":
        pixels, icc, told = cmyk_to_rgb(np.asarray(image), icc)
        losses.append(told)
    elif pixels is None:
        pixels = np.asarray(image if image.mode == (mode := _plain_mode(image)) else image.convert(mode))
    with warnings.catch_warnings(record=True) as complaints:
        warnings.simplefilter("always")
        Image.Exif().load(image.info.get("exif", b""))  # read once more: of a JPEG that is done when it is opened
        exif = image.getexif()
        # Of a JPEG with EXIF that says nothing Pillow says 72.
        in_exif = image.format in IN_EXIF or (image.format in ("JPEG", "MPO") and not image.info.get("jfif_unit"))
        dpi = told_dpi(exif) if in_exif else image.info.get("dpi")
        orientation, encoded = exif.get(ORIENTATION, 1), upright_exif(exif)
    if complaints or (exif and encoded is None):
        losses.append("its EXIF is damaged and not kept whole")
    elif exif and exif.get_ifd(ExifTags.IFD.IFD1):
        losses.append("its thumbnail is not kept")
    texts = {key: str(text) for key, text in getattr(image, "text", {}).items() if key != "XML:com.adobe.xmp"}
    if encoded is not None:  # as which it is written, upright: a reader of the text would turn it once more
        texts.pop(RAW_EXIF, None)
    if isinstance(comment := image.info.get("comment"), bytes):
        texts["Comment"] = comment.decode("utf-8", "replace")
    xmp = image.info.get("xmp")
    with suppress(Exception):  # those after the first may be damaged
        if (there := count or getattr(image, "n_frames", 1)) > 1:
            frames = "pictures" if image.format in ("JPEG", "MPO") else "frames"
            used = "only the first is used"
            if not count and getattr(image, "default_image", False):  # of an APNG, and is none of its frames
                there, used = there - 1, "none is used, but the still before them"
                frames = "frame" if there == 1 else frames
            told = there if there <= MOST_FRAMES else f"more than {MOST_FRAMES}"
            losses.append(f"of its {told} {frames} {used}")
    return Picture(
        upright(pixels if pixels.ndim == 3 else pixels[..., None], orientation),
        icc=icc,
        exif=encoded,
        xmp=upright_xmp(xmp.encode() if isinstance(xmp, str) else xmp),
        dpi=upright_dpi(dpi, orientation),
        texts={key: text.replace("\0", "") for key, text in texts.items() if key},
        note=lost(file, losses),
    )


def _plain_mode(image: Any) -> str:
    """The mode of 8-bit grey or RGB, with or without alpha, that loses nothing of Pillow's `image`."""
    grey = image.mode in ("1", "L", "LA", "La")
    alpha = image.mode in ("LA", "La", "RGBA", "RGBa", "PA") or "transparency" in image.info
    return ("L" if grey else "RGB") + ("A" if alpha else "")


def write(name: str, path: Path, picture: Picture, quality: int, **options: Any) -> None:
    """Write a file of Pillow's kind `name`, with these options of its encoder."""
    from PIL import Image

    options |= {"quality": quality, "icc_profile": picture.icc, "exif": sized_exif(picture, with_dpi=name in IN_EXIF)}
    if picture.xmp:
        options["xmp"] = picture.xmp
    pixels = picture.pixels[..., 0] if picture.pixels.shape[2] == 1 else picture.pixels
    buffer = io.BytesIO()  # in memory: on a full disk Pillow's own writing loses the reason
    Image.fromarray(pixels).save(buffer, format=name, **options)
    path.write_bytes(buffer.getvalue())

"""OpenEXR."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from app.errors import UserError
from app.media.codecs.decoding import decoding, head_of, quiet
from app.media.inputs import MAX_PIXELS, check_size
from app.media.losses import lost, not_kept
from app.model.picture import Picture

LAYOUT = frozenset({"version", "chunkCount", "maxSamplesPerPixel", "dwaCompressionLevel"})


def channel_names(file: Path) -> list[str]:
    """The names of the channels of an EXR's first part, by its header; raises `UserError`."""
    import OpenEXR

    head_of(file)
    with decoding(file, "OpenEXR"), quiet():
        return [channel.name for channel in OpenEXR.File(str(file), header_only=True).header()["channels"]]


def read_channels(file: Path, max_pixels: int = MAX_PIXELS) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """The channels (h, w) float32 by name, filling the data window, and the header of an EXR's first part.

    Raises `UserError`.
    """
    import OpenEXR

    head_of(file)
    with decoding(file, "OpenEXR"), quiet():
        header = OpenEXR.File(str(file), header_only=True).header()
        for window in ("dataWindow", "displayWindow"):
            (left, top), (right, bottom) = header[window]
            check_size(file, int(right) - int(left) + 1, int(bottom) - int(top) + 1, max_pixels)
        exr = OpenEXR.File(str(file), separate_channels=True)
        # a file that ends early is announced on stdout, not raised: it just has no part
        channels = exr.channels() if exr.parts else {}
        if not channels:
            raise ValueError("pixel data is missing")
        return {key: np.asarray(channel.pixels, np.float32) for key, channel in channels.items()}, header


def read(file: Path, max_pixels: int) -> Picture:
    """Read the colours of the first part of an EXR, in its display window."""
    channels, header = read_channels(file, max_pixels)
    for wanted in (("R", "G", "B", "A"), ("R", "G", "B"), ("Y", "A"), ("Y",)):
        if set(wanted) <= set(channels) and "RY" not in channels:
            break
    else:
        names = " ".join(channels)
        raise UserError(f"Cannot read {file}: of its channels {names} none are R G B or Y; save a plain RGB layer.")
    (left, top), _ = header["dataWindow"]
    (first_x, first_y), (last_x, last_y) = header["displayWindow"]
    data = np.stack([channels[key] for key in wanted], axis=-1)
    pixels = np.zeros((last_y - first_y + 1, last_x - first_x + 1, len(wanted)), np.float32)
    place_window(data, (left - first_x, top - first_y), pixels)
    chromaticities = header.get("chromaticities")
    others = [key for key in channels if key not in wanted]
    losses = [not_kept("channel", others)] if others else []
    losses += _losses(file, header)
    return Picture(
        pixels,
        chromaticities=tuple(float(value) for value in chromaticities) if chromaticities is not None else None,
        texts={key: value for key, value in header.items() if isinstance(value, str) and key not in ("name", "view")},
        premultiplied=True,
        attributes={key: value for key, value in header.items() if _is_kept(key, value)},
        note=lost(file, losses),
    )


def _losses(file: Path, header: Mapping[str, Any]) -> list[str]:
    """What of an EXR lies beside its first part, or beyond its display window."""
    import OpenEXR

    with quiet():
        parts = [part.header.get("name", "") for part in OpenEXR.File(str(file), header_only=True).parts[1:]]
    losses = [not_kept("further part", parts)] if parts else []
    (left, top), (right, bottom) = header["dataWindow"]
    (first_x, first_y), (last_x, last_y) = header["displayWindow"]
    beyond = max(first_x - left, first_y - top, right - last_x, bottom - last_y)
    if beyond > 0:
        losses.append(f"its overscan ({int(beyond)} px beyond the display window) is not kept")
    if first_x or first_y:
        losses.append(f"its display window begins at {int(first_x)}, {int(first_y)} and is moved to 0, 0")
    return losses


def _is_kept(key: str, value: Any) -> bool:
    """Whether an attribute of an EXR is a number or a few, and says nothing about how the file is laid out."""
    numbers = isinstance(value, int | float) or (isinstance(value, np.ndarray) and value.dtype.kind == "f")
    return numbers and key not in LAYOUT


def place_window(data: np.ndarray, at: tuple[int, int], into: np.ndarray) -> None:
    """Copy what of `data`, its corner laid at pixel `at` (x, y), falls on `into`."""
    spans = []
    for start, length, room in zip(at[::-1], data.shape, into.shape, strict=False):
        first, last = max(0, int(start)), min(room, int(start) + length)
        spans.append((slice(first, max(first, last)), slice(first - int(start), max(first, last) - int(start))))
    into[spans[0][0], spans[1][0]] = data[spans[0][1], spans[1][1]]


def write(path: Path, picture: Picture, quality: int) -> None:
    """Write an EXR of 32-bit floats, its colours multiplied by alpha."""
    pixels = picture.pixels
    if pixels.shape[2] == 2:  # luminance with alpha is allowed, and misread by ffmpeg
        pixels = pixels[..., [0, 0, 0, 1]]
    names = {1: "Y", 3: "RGB", 4: "RGBA"}[pixels.shape[2]]
    if picture.has_alpha and not picture.premultiplied:  # OpenEXR's convention
        with np.errstate(all="ignore"):
            pixels = np.concatenate([pixels[..., :-1] * pixels[..., -1:], pixels[..., -1:]], axis=2)
    attributes: dict[str, Any] = {**picture.texts, **picture.attributes}
    if picture.chromaticities:
        attributes["chromaticities"] = picture.chromaticities
    write_channels(path, {name: pixels[..., index] for index, name in enumerate(names)}, attributes)


def write_channels(
    path: Path, channels: Mapping[str, np.ndarray], attributes: Mapping[str, Any], overscan: int = 0
) -> None:
    """Write float32 channels (h, w) by name; `overscan` pixels on each side lie outside the display window."""
    import OpenEXR

    height, width = next(iter(channels.values())).shape

    def window(left: int, top: int, right: int, bottom: int) -> tuple[np.ndarray, np.ndarray]:
        return np.array([left, top], np.int32), np.array([right, bottom], np.int32)

    header = {
        **attributes,
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "displayWindow": window(0, 0, width - 2 * overscan - 1, height - 2 * overscan - 1),
        "dataWindow": window(-overscan, -overscan, width - overscan - 1, height - overscan - 1),
    }
    planes = {name: np.ascontiguousarray(plane, np.float32) for name, plane in channels.items()}
    with path.open("wb") as stream:  # given a name OpenEXR writes to a full disk without a word
        OpenEXR.File(header, planes).write(stream)

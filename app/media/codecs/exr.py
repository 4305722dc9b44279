"""OpenEXR: colours, further channels and parts, windows and attributes."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from app.errors import UserError
from app.media.codecs.decoding import decoding, head_of, quiet
from app.media.codecs.exr_header import Raw, fill_rooms, raw_attributes, room_for
from app.media.codecs.metadata import upright_dpi
from app.media.depth import as_half
from app.media.inputs import MAX_PIXELS, check_size
from app.media.losses import counted, lost, not_kept
from app.model.picture import Layer, Picture

# Attributes that say how a file is laid out, and those that have a place of their own in a picture.
LAYOUT = frozenset(
    {
        *("type", "version", "channels", "compression", "dwaCompressionLevel", "lineOrder", "tiles", "chunkCount"),
        *("dataWindow", "displayWindow", "maxSamplesPerPixel", "chromaticities"),
    }
)
PART_NAMES = ("name", "view")
SHARED = {"pixelAspectRatio", "timeCode", "chromaticities"}  # which all parts must have alike
# Dots an inch along x; along y there are so many times as many.
DENSITY, ASPECT = "xDensity", "pixelAspectRatio"
NUMBERS, CENTRE = ("int", "float"), "screenWindowCenter"  # that a header always has, and OpenEXR writes itself

# What a header says of its own, so that no text of another kind of file can have the name.
RESERVED = LAYOUT | {*PART_NAMES, DENSITY, ASPECT, CENTRE, "screenWindowWidth", "preview"}

COMPRESSIONS = ("zip", "zips", "piz", "rle", "none", "pxr24", "dwaa", "dwab", "b44", "b44a")
"""What `--codec` may be; those from pxr24 on lose something."""

Window = tuple[int, int, int, int]
"""Left, top, right and bottom; of a window the last pixels belong to it."""

# Names of channels and layers, by what renderers and Nuke call them.
BEAUTY = re.compile(r"(^|[.])(beauty|rgba?|combined|composite|final)[.]$", re.IGNORECASE)
EXACT = re.compile(
    r"[zZ]|ZBack|P|Pref|.*I[dD]s?\d*"
    r"|(?i:(.*[\W_])?ids?\d*|(object|material|instance|asset)id\d*|.*depth.*|.*crypto.*|.*position.*)"
)
MOTION = re.compile(r"(?i:forward|backward|mv|.*motion.*|.*velocity.*)")


def channel_names(file: Path) -> list[str]:
    """The names of the channels of an EXR's first part, by its header; raises `UserError`."""
    import OpenEXR

    with decoding(file, "OpenEXR"), quiet():
        return [channel.name for channel in OpenEXR.File(str(file), header_only=True).header()["channels"]]


def read_channels(
    file: Path, max_pixels: int = MAX_PIXELS, check: Callable[[dict[str, Any]], None] = lambda header: None
) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """The channels (h, w) float32 by name, filling the data window, and the header of an EXR's first part.

    check: is called with the header before anything else is read. Raises `UserError`.
    """
    import OpenEXR

    head_of(file)
    with decoding(file, "OpenEXR"), quiet():
        header = _headers(file, max_pixels)[0]
        check(header)
        exr = OpenEXR.File(str(file), separate_channels=True)
        # a file that ends early is announced on stdout, not raised: it just has no part
        channels = exr.channels() if exr.parts else {}
        if not channels:
            raise ValueError("pixel data is missing")
        return {key: np.asarray(channel.pixels, np.float32) for key, channel in channels.items()}, header


def read(file: Path, max_pixels: int) -> Picture:
    """Read the colours of an EXR in its display window; its further channels and parts become layers."""
    parts = _parts(file, max_pixels)
    found = _colours(parts)
    if found is None:
        names = " ".join(parts[0].channels)
        raise UserError(f"Cannot read {file}: of its channels {names} none are R G B or Y; save a plain RGB layer.")
    index, prefix, wanted = found
    own = parts[index]
    colours = [prefix + name for name in wanted]
    margins, losses = _margins([part for part in parts if part.is_flat], max_pixels)
    cryptomattes = tuple(
        text for part in parts for key, text in part.texts.items() if re.fullmatch("cryptomatte/.*/name", key)
    )
    layers = []
    if any(part.is_unseen for part in parts):
        losses.append("pixels that all lie outside of its display window are not kept")
    for number, part in enumerate(parts):
        further = [name for name in part.channels if number != index or name not in colours]
        if part.is_flat:
            layers += [
                Layer(name, part.shown(name, margins), _is_exact(name, part.channels[name].dtype, cryptomattes), number)
                for name in further
            ]
        else:
            losses.append(not_kept("further part", [part.texts.get("name") or f"{number + 1}"]))
        losses += [loss for loss in part.losses if loss not in losses]
        if part.subsampled:
            losses.append(not_kept("channel", part.subsampled))
    if turned := [layer.name for layer in layers if any(MOTION.fullmatch(word) for word in layer.name.split("."))]:
        losses.append(f"the arrows of its {counted('channel', turned)} are moved and not turned")
    if whole := [own.channels[name] for name in colours if own.channels[name].dtype == np.uint32]:
        rounded = ", rounded beyond 16777216" if any((channel > 2**24).any() for channel in whole) else ""
        losses.append(f"its colours are whole numbers (uint), and are taken for light with white at 1{rounded}")
    wide = np.stack([own.shown(name, margins) for name in colours], axis=-1, dtype=np.float32)
    left, top, right, bottom = margins
    inside = wide[top : len(wide) - bottom, left : wide.shape[1] - right]
    return Picture(
        np.ascontiguousarray(inside),
        chromaticities=own.chromaticities,
        texts={key: text for key, text in own.texts.items() if key not in PART_NAMES},
        dpi=_dpi(own.attributes),
        premultiplied=True,
        attributes=own.attributes,
        layers=tuple(layers),
        parts=tuple(part.header(whole=part is not own) for part in parts),
        group=(index, prefix),
        half=all(own.channels[name].dtype == np.float16 for name in colours),
        wide=wide if any(margins) else None,
        margins=margins,
        origin=own.windows[1][:2],
        note=lost(file, losses),
    )


@dataclass(frozen=True)
class _Part:
    """One part of an EXR: its channels (h, w) in their own type, in the data window, and what its header says.

    windows: of the data and of the display, (left, top, right, bottom) each, the last pixels among them.
    losses: what of it is not kept, in words.
    """

    channels: Mapping[str, np.ndarray]
    subsampled: Sequence[str]
    is_flat: bool
    windows: tuple[Window, Window]
    texts: Mapping[str, str]
    attributes: Mapping[str, Any]
    chromaticities: tuple[float, ...] | None
    losses: Sequence[str]

    def shown(self, name: str, margins: Window) -> np.ndarray:
        """A channel in the display window and margins around it, 0 where there is no data."""
        (left, top, *_), (first_x, first_y, last_x, last_y) = self.windows
        height = last_y - first_y + 1 + margins[1] + margins[3]
        width = last_x - first_x + 1 + margins[0] + margins[2]
        plane = np.zeros((height, width), self.channels[name].dtype)
        place_window(self.channels[name], (left - first_x + margins[0], top - first_y + margins[1]), plane)
        return plane

    @property
    def is_unseen(self) -> bool:
        """Whether none of its data are in the display window."""
        (left, top, right, bottom), (first_x, first_y, last_x, last_y) = self.windows
        return left > last_x or top > last_y or right < first_x or bottom < first_y

    def margins(self) -> Window:
        """How far its data reach beyond the display window, if they are in it at all."""
        if self.is_unseen:
            return 0, 0, 0, 0
        (left, top, right, bottom), (first_x, first_y, last_x, last_y) = self.windows
        return max(0, first_x - left), max(0, first_y - top), max(0, right - last_x), max(0, bottom - last_y)

    def header(self, whole: bool) -> dict[str, Any]:
        """What is written of it again: all, or its names alone."""
        names = {key: text for key, text in self.texts.items() if whole or key in PART_NAMES}
        if not whole:
            return names
        primaries = {} if self.chromaticities is None else {"chromaticities": self.chromaticities}
        return {**names, **self.attributes, **primaries}


def _parts(file: Path, max_pixels: int) -> list[_Part]:
    import OpenEXR

    with quiet():
        headers = _headers(file, max_pixels)
        # a file that ends early is announced on stdout, not raised: it just has no part
        read = OpenEXR.File(str(file), separate_channels=True).parts
    if not read or not all(part.channels for part in read):
        raise ValueError("pixel data is missing")
    parts = []
    for header, part, raw in zip(headers, read, raw_attributes(file), strict=True):
        primaries = header.get("chromaticities")
        sampled = {name: (channel.xSampling, channel.ySampling) for name, channel in part.channels.items()}
        parts.append(
            _Part(
                {
                    name: np.asarray(channel.pixels)
                    for name, channel in part.channels.items()
                    if sampled[name] == (1, 1)
                },
                [name for name, steps in sampled.items() if steps != (1, 1)],
                header["type"] in (OpenEXR.scanlineimage, OpenEXR.tiledimage),
                (_corners(header["dataWindow"]), _corners(header["displayWindow"])),
                {key: value for key, value in header.items() if isinstance(value, str)},
                {
                    key: header[key] if value.kind in NUMBERS or key == CENTRE else value
                    for key, value in raw.items()
                    if key not in LAYOUT and value.kind not in ("string", "preview")  # of the picture as it was
                },
                tuple(float(value) for value in primaries) if primaries is not None else None,
                _unkept(raw) + _unmarked(part.channels),
            )
        )
    return parts


def _unkept(raw: Mapping[str, Raw]) -> list[str]:
    """What is made of a part's picture as it was, and so would not be true of the result."""
    has_levels = "tiles" in raw and raw["tiles"].data[-1] & 15  # the mode, after the size of a tile
    losses = ["its smaller versions (mipmaps) are not kept"] if has_levels else []
    return losses + (["its preview is not kept"] if any(value.kind == "preview" for value in raw.values()) else [])


def _unmarked(channels: Mapping[str, Any]) -> list[str]:
    """What the channels say of themselves and what is written does not; only B44 heeds it."""
    names = [name for name, channel in channels.items() if channel.pLinear]
    return [not_kept("mark pLinear of channel", names)] if names else []


def _headers(file: Path, max_pixels: int) -> list[Any]:
    """The header of each part. Raises `UserError` for more than may be unpacked."""
    import OpenEXR

    headers = [part.header for part in OpenEXR.File(str(file), header_only=True).parts]
    channels = sum(len(header["channels"]) for header in headers)
    for header in headers:
        for window in ("dataWindow", "displayWindow"):
            left, top, right, bottom = _corners(header[window])
            check_size(file, right - left + 1, bottom - top + 1, max_pixels, channels)
    return headers


def _corners(window: Any) -> Window:
    (left, top), (right, bottom) = window
    return int(left), int(top), int(right), int(bottom)


def _margins(parts: Sequence[_Part], max_pixels: int) -> tuple[Window, list[str]]:
    """How far the data of any part reach beyond the display window, and in words if that is too much to be kept."""
    left, top, right, bottom = (max(sides) for sides in zip(*(part.margins() for part in parts), strict=True))
    first_x, first_y, last_x, last_y = parts[0].windows[1]
    pixels = (left + last_x - first_x + 1 + right) * (top + last_y - first_y + 1 + bottom)
    if pixels * max(4, sum(len(part.channels) for part in parts)) > 4 * max_pixels:
        far = max(left, top, right, bottom)
        return (0, 0, 0, 0), [f"its overscan ({far} px beyond the display window) is not kept"]
    return (left, top, right, bottom), []


def _colours(parts: Sequence[_Part]) -> tuple[int, str, str] | None:
    """The part, the layer and the channels that are the picture: plain ones, else a beauty, else the first RGB."""
    found = []
    for number, part in enumerate(parts):
        for prefix in dict.fromkeys(name[: name.rfind(".") + 1] for name in part.channels):
            for wanted in ("RGBA", "RGB", *(("YA", "Y") if not prefix or BEAUTY.search(prefix) else ())):
                if part.is_flat and all(prefix + name in part.channels for name in wanted):
                    if "RY" not in (*part.subsampled, *part.channels):
                        found.append((bool(prefix), not BEAUTY.search(prefix), number, prefix, wanted))
                    break
    return min(found, key=lambda one: one[:3])[2:] if found else None


def _dpi(attributes: Mapping[str, Any]) -> tuple[float, float] | None:
    """Dots an inch along x and y, if the header tells them as it should."""
    x, aspect = attributes.get(DENSITY), attributes.get(ASPECT, 1.0)
    return upright_dpi((x, x * aspect), 1) if isinstance(x, float) and isinstance(aspect, float) else None


def _is_exact(name: str, dtype: np.dtype, cryptomattes: tuple[str, ...]) -> bool:
    """Whether a mean of a channel's values would be none of them: ids, depths and places."""
    words = name.split(".")
    return dtype == np.uint32 or name.startswith(cryptomattes) or any(EXACT.fullmatch(word) for word in words)


def place_window(data: np.ndarray, at: tuple[int, int], into: np.ndarray) -> None:
    """Copy the part of `data` (h, w, ...), its corner laid at pixel `at` (x, y), that falls on `into` (h, w, ...)."""
    spans = []
    for start, length, room in zip(at[::-1], data.shape, into.shape, strict=False):
        first, last = max(0, int(start)), min(room, int(start) + length)
        spans.append((slice(first, max(first, last)), slice(first - int(start), max(first, last) - int(start))))
    into[spans[0][0], spans[1][0]] = data[spans[0][1], spans[1][1]]


def unheld_texts(picture: Picture) -> list[str]:
    """The names of texts that have another meaning in a header."""
    return [key for key in picture.texts if key in RESERVED]


def unusual_attributes(attributes: Mapping[str, Any], shape_is_told: bool) -> list[str]:
    """The names of attributes that say more than every header does; `shape_is_told`: that of a pixel, by its dots."""
    usual = {"screenWindowWidth": 1.0, CENTRE: (0.0, 0.0), ASPECT: 1.0}
    placed = {DENSITY, *([ASPECT] if shape_is_told else [])}
    return [
        name
        for name, value in attributes.items()
        if name not in placed and not (name in usual and np.array_equal(value, usual[name]))
    ]


def write(path: Path, picture: Picture, quality: int, codec: str | None = None) -> None:
    """Write an EXR, its colours multiplied by alpha, with the layers in the parts they are from.

    codec: the compression, one of `COMPRESSIONS`; None is the first.
    """
    pixels = picture.pixels if picture.wide is None else picture.wide
    if pixels.shape[2] == 2:  # luminance with alpha is allowed, and misread by ffmpeg
        pixels = pixels[..., [0, 0, 0, 1]]
    names = {1: "Y", 3: "RGB", 4: "RGBA"}[pixels.shape[2]]
    if picture.has_alpha and not picture.premultiplied:  # OpenEXR's convention
        with np.errstate(all="ignore"):
            pixels = np.concatenate([pixels[..., :-1] * pixels[..., -1:], pixels[..., -1:]], axis=2)
    if picture.half:
        pixels = as_half(pixels)
    texts = {key: text for key, text in picture.texts.items() if key not in RESERVED}
    attributes: dict[str, Any] = {**texts, **picture.attributes}
    if picture.dpi:
        attributes[DENSITY] = picture.dpi[0]
        if picture.dpi[0] != picture.dpi[1]:  # a picture's own says what is seen, and is not for print alone
            attributes.setdefault(ASPECT, picture.dpi[1] / picture.dpi[0])
    if picture.chromaticities:
        attributes["chromaticities"] = picture.chromaticities
    own, prefix = picture.group
    channels = {own: {prefix + name: pixels[..., index] for index, name in enumerate(names)}}
    for layer in picture.layers:
        channels.setdefault(layer.part, {})[layer.name] = layer.values
    parts = []
    for number in sorted(channels):
        header = dict(picture.parts[number]) if number < len(picture.parts) else {}
        header |= {key: attributes[key] for key in SHARED & attributes.keys()}
        if len(channels) > 1:
            header.setdefault("name", f"part {number}")
        parts.append((header | attributes if number == own else header, channels[number]))
    _write_parts(path, parts, _compression(codec or COMPRESSIONS[0]), picture.margins, picture.origin)


def _compression(name: str) -> Any:
    import OpenEXR

    return OpenEXR.NO_COMPRESSION if name == "none" else getattr(OpenEXR, f"{name.upper()}_COMPRESSION")


def write_channels(
    path: Path, channels: Mapping[str, np.ndarray], attributes: Mapping[str, Any], overscan: int = 0
) -> None:
    """Write float32 channels (h, w) by name; `overscan` pixels on each side lie outside the display window."""
    import OpenEXR

    planes = {name: plane.astype(np.float32, copy=False) for name, plane in channels.items()}
    _write_parts(path, [(attributes, planes)], OpenEXR.ZIP_COMPRESSION, (overscan, overscan, overscan, overscan))


def _write_parts(
    path: Path,
    parts: Sequence[tuple[Mapping[str, Any], Mapping[str, np.ndarray]]],
    compression: Any,
    margins: Window,
    origin: tuple[int, int] = (0, 0),
) -> None:
    """Write parts, each of attributes and channels (h, w) by name, with margins beyond the display window."""
    import OpenEXR

    def window(left: int, top: int, right: int, bottom: int) -> tuple[np.ndarray, np.ndarray]:
        x, y = origin
        return np.array([x + left, y + top], np.int32), np.array([x + right, y + bottom], np.int32)

    (left, top, right, bottom), made, raws = margins, [], []
    for attributes, channels in parts:
        height, width = next(iter(channels.values())).shape
        raw = {key: value for key, value in attributes.items() if isinstance(value, Raw)}
        header = {
            **{key: value for key, value in attributes.items() if key not in raw},
            **room_for(raw),
            "compression": compression,
            "type": OpenEXR.scanlineimage,
            "displayWindow": window(0, 0, width - left - right - 1, height - top - bottom - 1),
            "dataWindow": window(-left, -top, width - left - 1, height - top - 1),
        }
        made.append(OpenEXR.Part(header, {name: np.ascontiguousarray(plane) for name, plane in channels.items()}))
        raws.append(raw)
    with path.open("wb") as stream:  # given a name OpenEXR writes to a full disk without a word
        OpenEXR.File(made).write(stream)
    fill_rooms(path, raws)

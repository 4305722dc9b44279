"""What of a picture the file that is made of it does not hold: one table, for stills, sequences and animations.

Long, as each field of a picture has its row, with the reason and the sentence.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from app.errors import About, UserError
from app.media.clip import Clip
from app.media.codecs import png
from app.media.codecs.exr import unusual_attributes
from app.media.codecs.metadata import profile_name, tag_names
from app.media.depth import as_half, few_rows, to_bits
from app.media.encoders import ANIMATIONS, Stream, check_colours_of_picture, check_output, depth_of, has_alpha
from app.media.formats import Format, fits_profile, is_srgb, picture_format, written_depth
from app.media.losses import REC709, counted, few
from app.media.numbered import is_sequence
from app.model.picture import Picture, opaque_value, srgb_to_linear, unpremultiplied

PNG_STEP = png.METRE  # PNG tells whole dots a metre, and no 72 an inch
HALF_DIGITS, FLOAT_DIGITS = 11, 24  # significant binary ones (IEEE 754)
LARGEST_HALF = 65520.0  # what is less is rounded to a half that is finite
# What is named first where several hold what is lost: of stills, of those with floats, of animations.
BETTER, BETTER_LIGHT = (".png", ".tif", ".exr", ".webp", ".jpg"), (".exr", ".tif", ".png")
BETTER_MOVING = (".mkv", ".mov", ".webm")


@dataclass(frozen=True)
class Written:
    """How a picture is written.

    Attributes:
        bits, codec: see `write_picture` and `animation_writer`.
        animated: it is one of many, in one file or in a sequence.
        with_layers, with_margins: whether these were warped, as they are for a still that shows its own pixels.
        with_dpi: whether its own resolution is written.
        strip: its metadata are left out, as was asked for; of them nothing is lost.
        clip: that it is a frame of.
        size: (width, height) of what is written; None is its own.
    """

    bits: int | None = None
    codec: str | None = None
    animated: bool = False
    with_layers: bool = True
    with_margins: bool = True
    with_dpi: bool = True
    strip: bool = False
    clip: Clip | None = None
    size: tuple[int, int] | None = None


@dataclass(frozen=True)
class Room:
    """What a file has room for.

    Attributes:
        name: what its kind is called.
        keeps: as of a `Format`.
        bits: a channel.
        is_float: its values are not bounded by 0 and 1.
        has_alpha, has_partial: alpha, and alpha that is neither 0 nor 1.
        kind: of a still or a sequence.
        how: it is written.
    """

    name: str
    keeps: frozenset[str]
    bits: int
    is_float: bool
    has_alpha: bool
    has_partial: bool
    kind: Format | None
    how: Written

    @property
    def digits(self) -> int:
        """How many binary ones a value near white is told by."""
        return self.bits if not self.is_float else HALF_DIGITS if self.bits == 16 else FLOAT_DIGITS


def room_of(path: str | os.PathLike[str], picture: Picture, how: Written) -> Room:
    """What the file `path` has room for, as it is written of such a picture. Raises `UserError` if there is none."""
    if not how.animated or is_sequence(path):
        kind = picture_format(path)
        depth, half = written_depth(kind, picture, how.bits)
        is_float = depth == 32
        return Room(
            kind.name, kind.keeps, 16 if is_float and half else depth, is_float, kind.alpha, kind.alpha, kind, how
        )
    container = ANIMATIONS[Path(path).suffix.lower()]
    if container.passes > 1:  # by way of a lossless file, into a palette
        return Room(container.name, frozenset(), 8, False, True, False, None, how)
    options = container.encoding(how.codec)(Stream(picture.has_alpha, min(picture.bits, 16)))
    layout = options[options.index("-pix_fmt") + 1]
    alpha = has_alpha(layout)
    return Room(container.name, frozenset(), depth_of(layout)[0], False, alpha, alpha, None, how)


@dataclass(frozen=True)
class Named:
    """A loss that differs from picture to picture.

    Attributes:
        names: of what is lost of one.
        words: how it is told, of the names of several, each once.
    """

    names: tuple[Any, ...]
    words: Callable[[Sequence[Any]], str]

    def and_of(self, other: Named) -> Named:
        """What is lost of both."""
        return Named(tuple(dict.fromkeys((*self.names, *other.names))), self.words)

    def __str__(self) -> str:
        return self.words(self.names)


Told = Callable[[Picture, Room], str | Named]
"""How a loss is told, in words that follow the name of the file; "" if there is none.

What is looked for in the pixels, which takes long, is told in words that are the same for all pictures."""


def _some(names: Sequence[str], word: str) -> str:
    """Not too many names, with "and" or "or" between them."""
    return f" {word} ".join([*names[:4], *(["others"] if len(names) > 4 else [])])


# Of the pixels ------------------------------------------------------------------------------------------------------


def _strips(picture: Picture) -> Iterator[np.ndarray]:
    """The pixels, a few rows at a time."""
    return (picture.pixels[rows] for rows in few_rows(picture.pixels))


def _straight(picture: Picture) -> Iterator[np.ndarray]:
    """The pixels as they are before they are cut to whole numbers."""
    is_multiplied = picture.premultiplied and picture.has_alpha
    for strip in _strips(picture):
        yield strip if not is_multiplied or (strip[..., -1] == opaque_value(strip)).all() else unpremultiplied(strip)


def _depth(picture: Picture, room: Room) -> str:
    clip = room.how.clip
    if clip is None or clip.is_whole:
        digits = _digits(picture, room)
        if digits <= room.digits or all(_is_held(strip, room) for strip in _straight(picture)):
            return ""
        named = f"{16 if digits == HALF_DIGITS else 32}-bit floats" if picture.linear else f"{digits}"
    elif room.kind is None:
        return ""  # of a video among videos it is told beside the resolution of its colours: `unheld_of_clip`
    else:
        digits = depth_of(clip.pixel_format)[0]
        if digits <= room.digits:
            return ""
        named = f"{digits}"
    return f"holds {room.bits}{'-bit floats' if room.is_float else ' bits a channel'} and not the picture's {named}"


def _digits(picture: Picture, room: Room) -> int:
    """How many binary ones the values of a picture need, as far as it matters for a room."""
    most = 8 if picture.bits == 8 else 16 if not picture.linear else HALF_DIGITS if picture.half else FLOAT_DIGITS
    fewer = {16: (8, 10, 12), FLOAT_DIGITS: (HALF_DIGITS,)}.get(most, ())
    if most <= room.digits:
        return most
    return next((digits for digits in fewer if all(_has(strip, digits) for strip in _strips(picture))), most)


def _has(strip: np.ndarray, digits: int) -> bool:
    """Whether values of 16 bits are fewer ones spread, or floats are halves."""
    if strip.dtype == np.float32:
        with np.errstate(over="ignore"):
            return bool(np.array_equal(strip.astype(np.float16), strip, equal_nan=True))
    fewer = (strip >> 8) * np.uint16(257) if digits == 8 else _fewer(strip, digits)  # the same, and ten times as fast
    return bool(np.array_equal(fewer, strip))


def _fewer(values: np.ndarray, digits: int) -> np.ndarray:
    """Values of 16 bits as they are once they have been of fewer."""
    top = 2**digits - 1
    return ((values.astype(np.uint64) * top + 32767) // 65535 * 65535 // top).astype(np.uint16)


def _is_held(strip: np.ndarray, room: Room) -> bool:
    """Whether there and back again the pixels are the same, but for those beyond black and white."""
    bits = strip.dtype.itemsize * 8
    if strip.dtype == np.float32:
        strip = np.nan_to_num(strip)
        strip = strip if room.is_float else np.clip(strip, 0, 1)
        if ((strip == 0) | (strip == 1)).all():
            return True
    if room.is_float:
        there = as_half(to_bits(strip, 32)).astype(np.float32)
        strip = np.clip(strip, -LARGEST_HALF, LARGEST_HALF) if bits == 32 else strip
    else:
        there = _fewer(to_bits(strip, 16), room.bits)
    return bool(np.array_equal(to_bits(there, bits, dither=False), strip))


def _most(room: Room) -> float:
    """The largest code of a value."""
    return 2.0**room.bits - 1


def _is_cut(picture: Picture, room: Room) -> bool:
    """Whether values are cut to whole numbers from black to white."""
    return picture.linear and not room.is_float


def _below(picture: Picture, room: Room) -> str:
    """Values that are rounded to a code below 0, if there were one."""
    least = -0.5 / _most(room)
    if not _is_cut(picture, room) or not any(_passes(strip, _light(least), least, -1) for strip in _straight(picture)):
        return ""
    return "below 0"


def _above(picture: Picture, room: Room) -> str:
    """Values that are rounded to a code above that of white, if there were one, or to a half that is infinite."""
    if picture.linear and room.is_float and room.bits == 16:
        beyond = ((np.isfinite(strip) & (np.abs(strip) >= LARGEST_HALF)).any() for strip in _strips(picture))
        return "beyond 65504" if any(beyond) else ""
    if picture.premultiplied and not picture.linear and room.has_alpha and not _stays_multiplied(picture, room):
        brighter = ((strip[..., :-1] > strip[..., -1:]) & (strip[..., -1:] > 0) for strip in _strips(picture))
        return "above 1" if any(map(np.any, brighter)) else ""
    if not _is_cut(picture, room):
        return ""
    largest = 1 + 0.5 / _most(room)
    return "above 1" if any(_passes(strip, _light(largest), largest, 1) for strip in _straight(picture)) else ""


def _light(value: float) -> float:
    return float(srgb_to_linear(np.array(value)))


def _passes(strip: np.ndarray, light: float, alpha: float, side: int) -> bool:
    """Whether colours lie beyond so much light, or alphas beyond that alpha, on one side."""
    colours = strip.shape[2] - (strip.shape[2] in (2, 4))
    ends = np.array([light] * colours + [alpha] * (strip.shape[2] - colours), np.float32)
    with np.errstate(invalid="ignore"):
        return bool((strip >= ends).any() if side > 0 else (strip <= ends).any())


def _nowhere(picture: Picture, room: Room) -> str:
    if not _is_cut(picture, room) or not any(np.isnan(strip).any() for strip in _strips(picture)):
        return ""
    return "makes NaN black"


def _alpha(picture: Picture, room: Room) -> str:
    if not picture.has_alpha or room.has_partial:
        return ""
    most = opaque_value(picture.pixels)
    for strip in _strips(picture):
        alpha = strip[..., -1]
        if not room.has_alpha and (alpha != most).any():
            return "has no alpha, and is laid over black"
        if room.has_alpha and ((alpha > 0) & (alpha < most)).any():
            return "makes half-transparent pixels either whole or empty"
    return ""


def _unseen(picture: Picture, room: Room) -> str:
    """Colours where alpha is 0: light without a body where they are multiplied, else what may be uncovered again."""
    if not picture.has_alpha or not (room.has_alpha or picture.premultiplied):
        return ""
    if _stays_multiplied(picture, room) or (not picture.premultiplied and not (room.kind and room.kind.multiplied)):
        return ""
    for strip in _strips(picture):
        if (strip[..., :-1][strip[..., -1] == 0] != 0).any():
            return "has no colours where alpha is 0"
    return ""


def _stays_multiplied(picture: Picture, room: Room) -> bool:
    """Whether colours that are multiplied by alpha are written as they are."""
    is_as_deep = picture.linear == room.is_float and (picture.linear or picture.bits == room.bits)
    return picture.premultiplied and "premultiplied" in room.keeps and is_as_deep


# Of what belongs to them --------------------------------------------------------------------------------------------


def _chromaticities(picture: Picture, room: Room) -> str:
    own = picture.chromaticities
    if own is None or "chromaticities" in room.keeps or np.allclose(own, REC709, atol=1e-3):
        return ""
    return "cannot tell the primaries (chromaticities) of the picture, and is read as BT.709"


def _icc(picture: Picture, room: Room) -> str | Named:
    if not picture.icc or (room.kind and fits_profile(picture, room.kind)):
        return ""
    name = profile_name(picture.icc) or "damaged"
    if "icc" in room.keeps:
        return Named((name,), lambda names: f"lacks {_profile(names)}, which is not for its colours")
    if is_srgb(picture.icc):
        return ""
    return Named((name,), lambda names: f"cannot hold {_profile(names)}, and is read as sRGB")


def _profile(names: Sequence[str]) -> str:
    return f"the picture's colour profile ({few(names)})"


def _chunks(picture: Picture, room: Room) -> str | Named:
    if "chunks" in room.keeps or (room.kind is None and b"cICP" in picture.chunks):
        return ""  # a video that cannot tell it is refused: `check_colours_of_picture`
    told = png.unusual(picture.chunks, picture.icc is not None) + png.light(picture.chunks)
    return Named(tuple(told), lambda names: f"cannot tell the picture's {_some(names, 'and')}") if told else ""


def _wide(picture: Picture, room: Room) -> str | Named:
    if picture.wide is None or (room.how.with_margins and "wide" in room.keeps):
        return ""
    return Named((max(picture.margins),), _overscan)


def _overscan(widths: Sequence[int]) -> str:
    most = f"{'up to ' if len(widths) > 1 else ''}{max(widths)}"
    return f"lacks the picture's overscan ({most} px beyond the display window)"


def _origin(picture: Picture, room: Room) -> str | Named:
    if picture.origin == (0, 0) or "origin" in room.keeps:
        return ""
    own = f"{picture.origin[0]}, {picture.origin[1]}"
    return Named((own,), lambda names: f"begins at 0, 0 and not at {_some(names, 'or')} as the display window")


def _dpi(picture: Picture, room: Room) -> str | Named:
    if not picture.dpi or not room.how.with_dpi or room.kind is None or room.kind.held_dpi is None:
        return ""
    held = room.kind.held_dpi(picture.dpi)
    if np.allclose(held, picture.dpi, rtol=0, atol=PNG_STEP):
        return ""
    dots = f"{_dots(held)} dpi and not {_dots(picture.dpi)}"
    return Named((dots,), lambda names: f"says {_some(names, 'or')} as the picture: {room.name} holds whole numbers")


def _dots(dpi: tuple[float, float]) -> str:
    """Dots an inch along x and y, or along both."""
    return " x ".join(f"{value:g}" for value in dict.fromkeys(dpi))


def _named(key: str, told: Callable[[Picture], Sequence[str]], words: Callable[[Sequence[str]], str]) -> Told:
    """What is lost of a part with names in it: all where the kind keeps none, else what it has no room for."""

    def lost(picture: Picture, room: Room) -> str | Named:
        names = told(picture)
        if room.kind is not None and key in room.keeps:
            but = room.kind.but.get(key)
            unheld = set(but(picture)) if names and but else set[str]()
            names = [name for name in names if name in unheld]
        return Named(tuple(names), words) if names else ""

    return lost


def _layers(picture: Picture, room: Room) -> str | Named:
    if not picture.layers or (room.how.with_layers and "layers" in room.keeps):
        return ""
    parts = {number: part.get("name") or f"{number + 1}" for number, part in enumerate(picture.parts)}
    parts.pop(picture.group[0], None)
    return Named(tuple((layer.name, parts.get(layer.part, "")) for layer in picture.layers), _channels)


def _channels(layers: Sequence[tuple[str, str]]) -> str:
    """Channels, each with its part if that is another than the picture's."""
    names, parts = ([*dict.fromkeys(filter(None, each))] for each in zip(*layers, strict=True))
    return counted("channel", names) + (f" of the {counted('part', parts)}" if parts else "")


def _attributes(picture: Picture, room: Room) -> str | Named:
    if "attributes" in room.keeps:
        return ""
    shape_is_told = picture.dpi is not None and "dpi" in room.keeps
    names = unusual_attributes(picture.attributes, shape_is_told)
    return Named(tuple(names), lambda names: counted("attribute", names)) if names else ""


def _grey(picture: Picture, room: Room) -> str:
    """Of an EXR the channels have names, and grey with alpha is written as colours."""
    is_named = bool(picture.parts) and room.kind is not None and room.kind.name == "OpenEXR"
    return "has the picture's Y and A as R, G, B and A" if is_named and picture.pixels.shape[2] == 2 else ""


TABLE: dict[str, Told] = {
    "grey": _grey,
    "bits": _depth,
    "below": _below,
    "above": _above,
    "nowhere": _nowhere,
    "alpha": _alpha,
    "unseen": _unseen,
    "chromaticities": _chromaticities,
    "icc": _icc,
    "chunks": _chunks,
    "wide": _wide,
    "origin": _origin,
    "dpi": _dpi,
    "exif": _named("exif", lambda picture: tag_names(picture.exif), lambda names: f"EXIF ({few(names)})"),
    "xmp": _named("xmp", lambda picture: ["XMP"] if picture.xmp else [], lambda names: "XMP"),
    "texts": _named("texts", lambda picture: list(picture.texts), lambda names: counted("text", names)),
    "attributes": _attributes,
    "layers": _layers,
}
"""What of a picture may be lost, and how it is told.

Besides `Format.keeps` this is all that is known of what is lost where: a new field of a picture gets a row here."""

HEADS = {
    "cuts values": (("below", "above"), " and "),
    "lacks the picture's": (("exif", "xmp", "texts", "attributes", "layers"), ", its "),
}
"""What several rows are told with in one: by its first words, which rows, and what is between them."""


class Losses:
    """What of the pictures that become a file, or the files of a sequence, it does not hold; each loss is told once."""

    def __init__(self, path: str | os.PathLike[str], how: Written) -> None:
        self.path, self.how = path, how
        self._own = Path(path).suffix.lower()
        self._found: dict[str, str | Named] = {}
        self._is_light = False
        is_picture = not how.animated or is_sequence(path)
        kinds = {ending for ending in (BETTER if is_picture else BETTER_MOVING) if ending != self._own}
        self._better = kinds | ({self._own} if how.bits is not None else set())

    def look(self, picture: Picture) -> Picture:
        """See what of one is lost; it is given back."""
        wanted = picture.stripped() if self.how.strip else picture
        room = room_of(self.path, wanted, self.how)
        self._is_light = self._is_light or picture.linear
        for key, told in TABLE.items():
            before = self._found.get(key, "")
            if isinstance(before, str) and before:
                continue
            found = told(wanted, room)
            if isinstance(before, Named) and isinstance(found, Named):
                found = before.and_of(found)
            if found and found != before:
                self._found[key] = found
                self._better = {ending for ending in self._better if self._would_hold(ending, key, wanted)}
        return picture

    @property
    def lost(self) -> frozenset[str]:
        """The rows of the table that tell a loss."""
        return frozenset(self._found)

    @property
    def said(self) -> str:
        """All of it in a sentence, with a kind of file that would hold it; "" if nothing is lost."""
        groups: dict[str, list[str]] = {}
        for key in filter(self._found.__contains__, TABLE):
            said = str(self._found[key])
            groups.setdefault(next((head for head, (keys, _) in HEADS.items() if key in keys), said), []).append(said)
        if not groups:
            return ""
        told = [f"{head} {HEADS[head][1].join(parts)}" if head in HEADS else head for head, parts in groups.items()]
        return About(Path(self.path).name, f" {'; it '.join(told)}{self._mend}")

    @property
    def _mend(self) -> str:
        """How it would be kept, if there is a way."""
        all_of_it = "all of it" if len(self._found) > 1 else "it"
        if self._own in self._better:
            return f"; write it with more bits to keep {all_of_it}"
        kinds = [*(BETTER_LIGHT if self._is_light else ()), *BETTER, *BETTER_MOVING]
        better = next((ending for ending in kinds if ending in self._better), None)
        return f"; write {better} to keep {all_of_it}" if better else ""

    def _would_hold(self, ending: str, key: str, picture: Picture) -> bool:
        """Whether a file of this ending, written as is usual, would hold what this one does not."""
        other, how = Path(self.path).with_suffix(ending), replace(self.how, bits=None, codec=None)
        try:
            check_output(other, animated=how.animated, size=how.size or (picture.width, picture.height))
            check_colours_of_picture(other, None, picture, how.animated)
            return not TABLE[key](picture, room_of(other, picture, how))
        except UserError:  # a size or colours that it has no room for, an encoder that is not there
            return False


def unheld(path: str | os.PathLike[str], picture: Picture, **how: Any) -> str:
    """What of a picture the file `path` does not hold, in a sentence, "" if nothing; `how` is as in `Written`."""
    losses = Losses(path, Written(**how))
    losses.look(picture)
    return losses.said

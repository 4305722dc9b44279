"""A picture looked up through a map, at the quality of an export."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from math import ceil, floor, prod, sqrt
from typing import Any, Literal

import moderngl
import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.passes import Region
from solver.warp.map import WarpMap

Quality = Literal["catmull-rom", "bilinear", "nearest"]
Edges = Literal["transparent", "black", "clamp", "mirror", "wrap"]

MOST_SAMPLES = 8
_TAPS = {"nearest": 1, "bilinear": 2, "catmull-rom": 4}
_REACH = 2  # pixels that the taps reach beyond a place
_KINDS = {np.dtype(np.uint8): ("f1", 255.0), np.dtype(np.uint16): ("nu2", 65535.0), np.dtype(np.float32): ("f4", 0.0)}
_WORDS = {"f1": np.uint32, "nu2": np.uint64}  # that hold four values of it
_SWIZZLES = {1: "RRR1", 2: "RRRG", 3: "RGB1", 4: "RGBA"}
_TARGET_COMPONENTS = {1: 1, 2: 2, 3: 4, 4: 4}  # targets of three components are not promised by GL
_WIDENED = 1 << 17  # pixels that are given a fourth value at once
_SMALLEST_TILE = 16  # pixels of the picture, were there no map
_BLOCK = 64  # pixels along a block of the result that is drawn by a shader of its own kind; as llvmpipe's tiles


class SamplingError(ValueError):
    """A picture or a map that cannot be looked up."""


@dataclass(frozen=True)
class Sampling:
    """How a picture is looked up.

    Attributes:
        quality: interpolation between pixels.
        edges: what lies beyond the picture. "transparent" is black where the picture has no alpha.
        samples: places looked up along a side of each pixel of the result, 1 or an even number; "auto" follows the
            stretch s of the map in that direction there: 2 clamp(ceil(0.75 s), 1, 4), 1 where it shifts or enlarges.
        linear_light: mix in linear light; uint8 and uint16 are taken as sRGB, float32 as linear already.
        dither: spread the rounding to 8 bits by a fixed pattern; by default where light is mixed.
        premultiplied: the colours are multiplied by alpha already, and stay so.
    """

    quality: Quality = "catmull-rom"
    edges: Edges = "transparent"
    samples: int | Literal["auto"] = "auto"
    linear_light: bool = True
    dither: bool | None = None
    premultiplied: bool = False


class GivenMap:
    """A map made elsewhere, laid over the whole of any picture.

    Args:
        device: the device.
        displacement: (h, w, 2) from 6 x 6, in its own longer sides.

    Raises:
        SamplingError: on another shape.
    """

    version = 0

    def __init__(self, device: Device, displacement: np.ndarray) -> None:
        if displacement.ndim != 3 or displacement.shape[2] != 2 or min(displacement.shape[:2]) < 6:
            raise SamplingError(f"a map of shape {displacement.shape} was given, (h, w, 2) from 6 x 6 is wanted")
        height, width = displacement.shape[:2]
        self.device = device
        self.extent = width / max(width, height), height / max(width, height)
        self._field = device.upload(displacement.astype(np.float32, copy=False), "given map")

    def composed(self) -> Field:
        """The displacement."""
        return self._field

    def release(self) -> None:
        """Free the texture."""
        self._field.release()


@dataclass(frozen=True)
class _Job:
    """One picture, one map and one size, with what follows from them."""

    displacement: Field
    extent: tuple[float, float]
    slack: float
    key: tuple[object, ...]
    picture: np.ndarray
    size: tuple[int, int]
    how: Sampling

    @property
    def source_size(self) -> tuple[int, int]:
        return self.picture.shape[1], self.picture.shape[0]

    @property
    def channels(self) -> int:
        return self.picture.shape[2]

    @property
    def has_alpha(self) -> bool:
        return self.channels in (2, 4)

    @property
    def is_premultiplied(self) -> bool:
        return self.has_alpha and self.how.premultiplied

    @property
    def is_curved(self) -> bool:
        """True if the values are sRGB and are to be mixed in linear light."""
        return self.how.linear_light and self.picture.dtype != np.float32

    @property
    def is_prepared(self) -> bool:
        return self.how.quality != "nearest" and (self.is_curved or self.has_alpha != self.is_premultiplied)

    @property
    def preparation(self) -> tuple[bool, bool, bool]:
        """What the picture on the GPU depends on."""
        return self.is_prepared, self.is_curved, self.is_premultiplied

    @cached_property
    def is_packed(self) -> bool:
        """True if a texel of what is prepared holds two neighbours in x, 16 bits a colour: enough for opaque bytes."""
        if not (self.is_prepared and self.is_curved and self.picture.dtype == np.uint8 and self.channels >= 3):
            return False
        return self.channels == 3 or bool((self.picture[..., 3] == 255).all())

    @property
    def is_single(self) -> bool:
        return self.how.quality == "nearest" or self.how.samples == 1

    @property
    def is_paired(self) -> bool:
        """True if two neighbours in x are drawn at once, packed as two whole numbers of four bytes each."""
        return self.picture.dtype == np.uint8 and self.channels >= 3

    @property
    def zoom(self) -> tuple[float, float]:
        """Pixels of the picture to a pixel of the result."""
        return self.source_size[0] / self.size[0], self.source_size[1] / self.size[1]

    @property
    def longer(self) -> tuple[float, float]:
        """Pixels of the picture to a longer side; the map is laid over the whole of it."""
        return self.source_size[0] / self.extent[0], self.source_size[1] / self.extent[1]

    @property
    def is_repeated(self) -> bool:
        return self.how.edges in ("mirror", "wrap")

    @property
    def is_bounded(self) -> bool:
        """True if there is nothing beyond the picture."""
        return self.how.edges in ("transparent", "black")

    @property
    def middle(self) -> tuple[float, float]:
        """Middle of the picture, in pixels."""
        return 0.5 * self.source_size[0], 0.5 * self.source_size[1]

    @property
    def half(self) -> tuple[float, float]:
        """Half of the sides of the rectangle, in pixels, beyond which there is nothing."""
        # What is a part of a texel of the map outside is there because of the interpolation, not of the fluid.
        width, height = self.source_size
        return 0.5 * width + self.slack, 0.5 * height + self.slack

    @property
    def pairs(self) -> tuple[int, int]:
        """The fewest and the most pairs of places along a side of a pixel, where one place is not enough."""
        samples = self.how.samples
        return (1, MOST_SAMPLES // 2) if samples == "auto" else (samples // 2, samples // 2)

    def defines(self, whole: bool, places: int, inside: bool, spread: bool) -> dict[str, object]:
        """Of `look_up.frag`, for blocks that want one place a pixel (0), four (1) or more (2) and lie inside or not."""
        kind, levels = _KINDS[self.picture.dtype]
        dither = self.is_curved if self.how.dither is None else self.how.dither
        flags = {
            "WHOLE": whole,
            "ZOOMED": self.zoom != (1.0, 1.0),
            "BOUNDED": self.is_bounded and not inside,
            "ONE": places == 0,
            "SPREAD": places == 0 and spread,
            "PREPARED": self.is_prepared,
            "PACKED": self.is_packed,
            "LINEAR_LIGHT": self.is_curved and self.is_prepared,
            "CODES": levels > 0,  # of 8 or 16 bits, and so neither infinite nor NaN
            "CLAMPED": levels > 0 and self.how.quality == "catmull-rom",  # the only one that overshoots
            "DITHER": dither and kind == "f1" and self.how.quality != "nearest",
            "OPAQUE": not self.has_alpha,
            "PREMULTIPLIED": self.is_premultiplied,
            "GREY_ALPHA": self.channels == 2,
            "PAIRED": self.is_paired,
        }
        values: dict[str, object] = {name: 1 for name, wanted in flags.items() if wanted}
        least, most = self.pairs
        values |= {"TAPS": _TAPS[self.how.quality], "LEAST_PAIRS": least, "MOST_PAIRS": most if places == 2 else 1}
        return values


class Sampler:
    """Looks pictures up through maps; keeps its textures from one picture to the next, as in a film.

    Args:
        device: the device.
        whole: pixels up to which a picture is worked on in one piece; larger ones, and those above the GL's largest
            texture, are done in tiles with the pieces of the original they need, to the same bits.
        tile: (width, height) of such a tile.
    """

    def __init__(self, device: Device, whole: int = 10_000_000, tile: tuple[int, int] = (2048, 1024)) -> None:
        self.device = device
        self.whole = whole
        self.tile = tile
        self._fields: dict[str, Field] = {}
        self._textures: dict[str, tuple[moderngl.Texture, tuple[object, ...]]] = {}
        self._spread_for: dict[str, tuple[object, ...]] = {}  # what was spread last, by the field it is in
        self._classes_for: tuple[object, ...] = ()
        self._classes = np.empty((0, 0), np.uint8)
        self._held: tuple[np.ndarray, bool, bool, bool] | None = None

    def apply(
        self,
        warp: WarpMap | GivenMap,
        picture: np.ndarray,
        size: tuple[int, int] | None = None,
        how: Sampling | None = None,
    ) -> np.ndarray:
        """The picture looked up at x + D(x).

        Args:
            warp: the map, laid over the whole of the picture.
            picture: (h, w) or (h, w, 1-4), uint8, uint16 or float32, alpha last. A read-only array that is
                given again is still there and is not uploaded again.
            size: (width, height) of the result, by default the picture's.
            how: see `Sampling`.

        Returns:
            An array like `picture`, of the wanted size. Where the map is the identity, the very values of the picture.

        Raises:
            SamplingError: on a picture of another type or shape, or a map that tears a tile apart.
        """
        width, height = size or (picture.shape[1], picture.shape[0])
        result = np.empty((height, width, *picture.shape[2:]), picture.dtype)
        for _ in self.bands(warp, picture, size, how, result):
            pass
        return result

    def bands(
        self,
        warp: WarpMap | GivenMap,
        picture: np.ndarray,
        size: tuple[int, int] | None = None,
        how: Sampling | None = None,
        result: np.ndarray | None = None,
    ) -> Iterator[np.ndarray]:
        """The rows of `apply`'s result from the top, some at a time, so that a large one need never exist as a whole.

        `result` takes them, if given; otherwise each band is an array of its own.
        """
        job = self._job(warp, picture, size, how or Sampling())
        width, height = job.size
        whole = self._fits(job.source_size) and not job.is_repeated
        columns, rows = job.size if whole and self._fits(job.size) else self._tile(job.size)
        room = None if whole else self._room(job, (columns, rows))
        if whole and not self._holds(picture, job):
            self._load(job, (0, 0, *job.source_size))
            # The array itself and not its id: no other can take its place in memory as long as it is held.
            self._held = None if picture.flags.writeable else (picture, *job.preparation)
        for top in range(0, height, rows):
            bottom = min(top + rows, height)
            shape = bottom - top, width, job.channels
            band = np.empty(shape, job.picture.dtype) if result is None else result[top:bottom].reshape(shape)
            for left in range(0, width, columns):
                right = min(left + columns, width)
                # Some may reach a pixel beyond the result: so all are of one size, and no texture is made anew.
                self._draw(job, (left, top, left + columns, top + rows), room)
                self._take(job, band[:, left:right])
            yield band.reshape(bottom - top, width, *picture.shape[2:])

    def release(self) -> None:
        """Free the textures."""
        for field in self._fields.values():
            field.release()
        for texture, _ in self._textures.values():
            texture.release()
        self._held = None
        self._fields.clear()
        self._textures.clear()

    # -- one tile ---------------------------------------------------------------------------------------------------

    def _job(self, warp: WarpMap | GivenMap, picture: np.ndarray, size: tuple[int, int] | None, how: Sampling) -> _Job:
        if picture.dtype not in _KINDS or picture.ndim not in (2, 3) or picture.size == 0:
            raise SamplingError(f"a picture of shape {picture.shape} of {picture.dtype} cannot be looked up")
        shaped = picture.reshape(*picture.shape[:2], -1)
        if shaped.shape[2] > 4:
            raise SamplingError(f"a picture of {shaped.shape[2]} channels cannot be looked up, 1 to 4 can")
        size = size or (picture.shape[1], picture.shape[0])
        field = warp.composed()
        slack = 0.5 * picture.shape[1] / field.width if isinstance(warp, WarpMap) else 0.01
        return _Job(field, warp.extent, slack, (warp, warp.version), shaped, size, how)

    def _fits(self, size: tuple[int, int]) -> bool:
        # The lattice of corners is one larger than the picture.
        return size[0] * size[1] <= self.whole and max(size) < self.device.limits.max_texture_size

    def _tile(self, size: tuple[int, int]) -> tuple[int, int]:
        """(width, height) of the tiles of a result: all alike."""
        width, height = (ceil(side / ceil(side / most)) for side, most in zip(size, self.tile, strict=True))
        return width + width % 2, height  # so that no pair is torn apart

    def _room(self, job: _Job, tile: tuple[int, int]) -> tuple[int, int]:
        """(width, height) of the textures for pieces of the picture: what a tile turned by any angle needs.

        Were they as large as each piece, those of a film would change with every frame, and memory fall to bits.
        """
        needed = min(tile[0] * job.zoom[0] + tile[1] * job.zoom[1], sum(self.tile))
        side = ceil(needed / sqrt(2)) + 2 * _REACH + 2
        return (side, side) if job.is_repeated else (min(side, job.source_size[0]), min(side, job.source_size[1]))

    def _draw(self, job: _Job, tile: tuple[int, int, int, int], room: tuple[int, int] | None) -> None:
        """Draw one tile of the result into the field "result", from the whole picture or by pieces that fit `room`."""
        left, top, right, bottom = tile
        if job.is_paired:
            self._field("result", ((right - left + 1) // 2, bottom - top), 2, "u4")
        else:
            kind, _ = _KINDS[job.picture.dtype]
            self._field("result", (right - left, bottom - top), _TARGET_COMPONENTS[job.channels], kind)
        if room is None:
            self._look_up(job, tile, (0, 0, right - left, bottom - top), None)
        else:
            more = 0 if job.is_single else 1
            lattice = self._spread(job, tile, at_centres=job.is_single)
            places = lattice.get().reshape(lattice.height, -1, 2)[:, : right - left + more]
            places *= np.array(job.longer, np.float32)
            places[..., 0] += (np.arange(left, right + more) * job.zoom[0])[None, :]
            places[..., 1] += (np.arange(top, bottom + more) * job.zoom[1])[:, None]
            self._draw_pieces(job, tile, places, (0, 0, right - left, bottom - top), room)

    def _draw_pieces(
        self,
        job: _Job,
        tile: tuple[int, int, int, int],
        places: np.ndarray,
        region: tuple[int, int, int, int],
        room: tuple[int, int],
    ) -> None:
        """Draw a region of a tile from the piece of the picture it needs, or its halves, if that is too large."""
        x, y, width, height = region
        piece = _piece(job, places, region)
        size = _size(piece)
        fits = self._fits(size)
        unwarped = max(width * max(job.zoom[0], 1), height * max(job.zoom[1], 1))
        is_smallest = unwarped <= _SMALLEST_TILE or (width <= 2 and height == 1)
        if is_smallest and not fits:
            raise SamplingError(
                f"the map tears a patch of {width} x {height} pixels over {size[0]} x {size[1]} pixels of the picture"
            )
        if not is_smallest and (size[0] > room[0] or size[1] > room[1]):
            if width >= height and width > 2:
                left = width // 4 * 2 or 2  # no pair is torn apart
                halves = (x, y, left, height), (x + left, y, width - left, height)
            else:
                halves = (x, y, width, height // 2), (x, y + height // 2, width, height - height // 2)
            # Where the map is torn, both halves may need what the whole does.
            if not fits or sum(prod(_size(_piece(job, places, half))) for half in halves) < 1.5 * prod(size):
                for half in halves:
                    self._draw_pieces(job, tile, places, half, room)
                return
        self._load(job, piece, room)
        self._look_up(job, tile, region, piece)

    def _spread(
        self, job: _Job, tile: tuple[int, int, int, int], at_centres: bool, region: list[Region] | None = None
    ) -> Field:
        """The displacement at the corners of a tile's pixels, or at their centres; only in a `region`, if given."""
        _, top, _, bottom = tile
        more, shift = (0, 0.5) if at_centres else (1, 0.0)
        scale = job.displacement.height / job.size[1]
        columns = None
        if region:
            # Of the rows, all that the region is interpolated from.
            low, high = min(y for _, y, _, _ in region), max(y + height for _, y, _, height in region)
            left, right = min(x for x, _, _, _ in region), max(x + width for x, _, width, _ in region)
            first = min(floor((top + low) * scale) - _REACH, job.displacement.height - 4)
            columns = [(left, first, right - left, ceil((top + high) * scale) + 2 * _REACH - first)]
        rows = self._spread_along_x(job, tile, at_centres, columns)
        lattice = self._field("lattice", (rows.width, bottom - top + more), rows.components, "f4")
        if self._is_new("lattice", (*job.key, job.size, job.is_paired, at_centres, tile, region and tuple(region))):
            along_y = self.device.pass_("resample/spread.frag", **({"PAIRED": 1} if job.is_paired else {}))
            along_y(lattice, region=region, displacement=rows, first=top + shift, scale=scale)
        return lattice

    def _spread_along_x(
        self, job: _Job, tile: tuple[int, int, int, int], at_centres: bool, region: list[Region] | None = None
    ) -> Field:
        """The same between the map's texels along x only, on all of its rows."""
        left, _, right, _ = tile
        more, shift = (0, 0.5) if at_centres else (1, 0.0)
        role = "centres along x" if at_centres else "corners along x"
        width, components, scale = right - left + more, 2, job.displacement.width / job.size[0]
        defines: dict[str, object] = {"ALONG_X": 1}
        if job.is_paired:
            width, components = (right - left + 1) // 2 + more, 4
            defines |= {"PAIRED": 1, "NEAR": 1} if scale <= 1.0 else {"PAIRED": 1}
        rows = self._field(role, (width, job.displacement.height), components, "f4")
        if self._is_new(role, self._key(job, tile, region)):
            along_x = self.device.pass_("resample/spread.frag", **defines)
            along_x(rows, region=region, displacement=job.displacement, first=left + shift, scale=scale)
        return rows

    def _key(
        self, job: _Job, tile: tuple[int, int, int, int], region: list[Region] | None = None
    ) -> tuple[object, ...]:
        """What tells apart what is spread along x."""
        return *job.key, job.size, job.is_paired, tile[0], tile[2], region and tuple(region)

    def _is_new(self, role: str, key: tuple[object, ...]) -> bool:
        """Whether a field is to hold another thing than before: over a batch of pictures the map is the same."""
        is_new = self._spread_for.get(role) != key
        self._spread_for[role] = key
        return is_new

    def _look_up(
        self,
        job: _Job,
        tile: tuple[int, int, int, int],
        region: tuple[int, int, int, int],
        piece: tuple[int, int, int, int] | None,
    ) -> None:
        """Draw a region of a tile from a piece of the picture, or from all of it."""
        raw, _ = self._textures["raw"]
        target, classes, origin = self._fields["result"], self._classify(job), tile[:2]
        source = self._fields["prepared"].texture if job.is_prepared else raw
        extent = piece or (0, 0, *job.source_size)
        opaque = job.how.edges == "black" or not job.has_alpha
        left, top = region[0] + origin[0], region[1] + origin[1]
        shown = classes[
            top // _BLOCK : -(-(top + region[3]) // _BLOCK), left // _BLOCK : -(-(left + region[2]) // _BLOCK)
        ]

        def regions(wanted: np.ndarray, more: int = 0) -> list[Region]:
            """Where the blocks are in the tile, with `more` of the lattice to the right and below."""
            blocks = _rectangles(wanted) * _BLOCK
            blocks[:, :2] += np.array((left // _BLOCK, top // _BLOCK)) * _BLOCK - origin
            found = [_overlap(block, region) for block in blocks.tolist()]
            if job.is_paired:
                found = [(x // 2, y, (width + 1) // 2, height) for x, y, width, height in found]
            return [(x, y, width + more, height + more) for x, y, width, height in found]

        # A map that is looked through again, as in a batch, is worth being spread once and for all.
        is_known = job.is_single and self._spread_for.get("centres along x") == self._key(job, tile)
        for kind in np.unique(shown).tolist():
            defines = job.defines(whole=piece is None, places=kind // 2, inside=kind % 2 == 1, spread=is_known)
            if is_known:
                displacement = self._spread(job, tile, at_centres=True)
            elif kind < 2:
                displacement = self._spread_along_x(job, tile, at_centres=True)
            else:
                several = None if piece else regions(shown >= 2, more=1)
                displacement = self._spread(job, tile, at_centres=False, region=several)
            self.device.pass_("resample/look_up.frag", **defines)(
                target,
                region=regions(shown == kind),
                source=source,
                raw=raw,
                displacement=displacement,
                texel=(1 / source.width, 1 / source.height),
                raw_texel=(1 / raw.width, 1 / raw.height),
                next=displacement.texel,
                scale=job.displacement.height / job.size[1],
                corner=extent[:2],
                extent=(extent[2] - extent[0], extent[3] - extent[1]),
                pixel=origin,
                zoom=job.zoom,
                longer=job.longer,
                middle=job.middle,
                half=job.half,
                outside=1.0 if opaque else 0.0,
            )

    def _classify(self, job: _Job) -> np.ndarray:
        """What each block of the result wants, (rows, columns) uint8, as `classify.frag` has it.

        The blocks are of the result and not of a tile of it, so that tiles are drawn to the same bits as the whole.
        """
        key = (*job.key, job.size, job.source_size, job.how)
        if key != self._classes_for:
            self._classes_for = key
            columns, rows = -(-job.size[0] // _BLOCK), -(-job.size[1] // _BLOCK)
            classes = self._field("classes", (columns, rows), 1, "f1")
            source = job.displacement
            defines: dict[str, object] = {"SINGLE": 1} if job.is_single else {}
            if job.how.samples != "auto":
                defines["EVERYWHERE"] = min(job.pairs[0], 2)
            self.device.pass_("resample/classify.frag", **defines)(
                classes,
                displacement=source,
                texel=source.texel,
                side=float(_BLOCK),
                scale=(source.width / job.size[0], source.height / job.size[1]),
                zoom=job.zoom,
                longer=job.longer,
                middle=job.middle,
                half=job.half,
            )
            self._classes = classes.get()
        return self._classes

    # -- textures ---------------------------------------------------------------------------------------------------

    def _holds(self, picture: np.ndarray, job: _Job) -> bool:
        """Whether all of the picture is on the GPU as the job needs it."""
        if self._held is None or self._held[0] is not picture:
            return False
        return self._held[1:] == job.preparation

    def _load(self, job: _Job, piece: tuple[int, int, int, int], room: tuple[int, int] | None = None) -> None:
        """Upload a piece of the picture (left, top, right, bottom) and prepare it; without `room` it is all of it."""
        self._held = None
        left, top, right, bottom = piece
        width, height = right - left, bottom - top
        if job.is_repeated:
            columns = _edge_index(np.arange(left, right), job.source_size[0], job.how.edges)
            rows = _edge_index(np.arange(top, bottom), job.source_size[1], job.how.edges)
            pixels = job.picture[rows[:, None], columns]
        else:
            pixels = job.picture[top:bottom, left:right]
        kind, _ = _KINDS[job.picture.dtype]
        least = (width, height) if room is None else (max(width, room[0]), max(height, room[1]))
        raw = self._texture("raw", least, job.channels, kind, exact=room is None)
        _write(raw, np.ascontiguousarray(pixels))
        if job.is_prepared:
            flags = {"LINEAR_LIGHT": job.is_curved, "PREMULTIPLIED": job.is_premultiplied}
            defines: dict[str, object] = {name: 1 for name, wanted in flags.items() if wanted}
            more = 0
            if job.is_packed:
                defines["PACKED"], more = 1, 1
            prepared = self._field("prepared", (raw.width + more, raw.height), 4, "u4" if job.is_packed else "f4")
            prepare = self.device.pass_("resample/prepare.frag", **defines)
            prepare(prepared, region=(0, 0, width + more, height), picture=raw, count=(width, height))

    def _take(self, job: _Job, target: np.ndarray) -> None:
        """Read the field "result" into an array."""
        field = self._fields["result"]
        height, width, channels = target.shape
        if job.is_paired:
            read = partial(field.framebuffer.read_into, components=2, dtype="u4", alignment=1)
            if channels == 4 and target.flags.c_contiguous and field.size == (width // 2, height):
                read(target)
                return
            # Some rows at a time stay in the cache.
            rows = min(height, max(1, _WIDENED // width))
            wide = np.empty((rows, 2 * field.width, 4), target.dtype)
            for top in range(0, height, rows):
                some = target[top : top + rows]
                read(wide, viewport=(0, top, field.width, len(some)))
                _narrow(wide[: len(some), :width], some)
            return
        settings: dict[str, Any] = {"components": channels, "dtype": field.dtype, "alignment": 1}
        if target.flags.c_contiguous:
            field.framebuffer.read_into(target, (width, height), **settings)
        else:
            data = field.framebuffer.read((width, height), **settings)
            target[...] = np.frombuffer(data, target.dtype).reshape(target.shape)

    def _field(self, role: str, size: tuple[int, int], components: int, dtype: str) -> Field:
        """The field kept for `role`, made anew when it has to be another."""
        kept = self._fields.get(role)
        if kept is None or (kept.size, kept.components, kept.dtype) != (size, components, dtype):
            if kept is not None:
                kept.release()
            self._fields[role] = self.device.field(size, components, f"sampling, {role}", dtype)
        return self._fields[role]

    def _texture(self, role: str, size: tuple[int, int], channels: int, dtype: str, exact: bool) -> moderngl.Texture:
        """The texture kept for `role`, of that size or larger; not a field, as it need not be drawn into."""
        kept, kind = self._textures.get(role, (None, ()))
        enough = kept is not None and (kept.size == size or (not exact and min(np.subtract(kept.size, size)) >= 0))
        if kept is None or kind != (channels, dtype) or not enough:
            if kept is not None:
                kept.release()
            components = 4 if channels == 3 and dtype in _WORDS else channels
            texture = self.device.ctx.texture(size, components, dtype=dtype, alignment=1)
            texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
            texture.repeat_x = texture.repeat_y = False
            texture.swizzle = _SWIZZLES[channels]
            self._textures[role] = texture, (channels, dtype)
        return self._textures[role][0]


def apply(
    warp: WarpMap, picture: np.ndarray, size: tuple[int, int] | None = None, how: Sampling | None = None
) -> np.ndarray:
    """`Sampler.apply` for a single picture."""
    sampler = Sampler(warp.device)
    try:
        return sampler.apply(warp, picture, size, how)
    finally:
        sampler.release()


def _write(texture: moderngl.Texture, pixels: np.ndarray) -> None:
    """Write contiguous pixels into the top left corner of a texture of as many components, or of four for three."""
    height, width, channels = pixels.shape
    if texture.components == channels:
        texture.write(pixels, viewport=(0, 0, width, height))
        return
    # A driver widens pixels of three values one by one. Here each is copied together with the first value of the next,
    # which takes half the time; nobody looks at that value. Some rows at a time stay in the cache.
    rows = max(1, _WIDENED // width)
    wide = np.empty((rows, width, 4), pixels.dtype)
    words = wide.reshape(-1).view(_WORDS[texture.dtype])
    for top in range(0, height, rows):
        some = pixels[top : top + rows]
        count = len(some) * width - 1
        words[:count] = np.ndarray(count, words.dtype, some, strides=(3 * pixels.itemsize,))
        wide.reshape(-1, 4)[count, :3] = some[-1, -1]
        texture.write(wide[: len(some)], viewport=(0, top, width, len(some)))


def _narrow(wide: np.ndarray, pixels: np.ndarray) -> None:
    """Copy pixels (h, w, 4) of bytes into an array of as many values, or of three."""
    height, width, channels = pixels.shape
    if channels == 4 or not pixels.flags.c_contiguous or not wide.flags.c_contiguous:
        pixels[...] = wide[..., :channels]
        return
    # Whole words, one row after the other: the fourth value of each is overwritten by the next.
    count = height * width - 1
    np.ndarray(count, np.uint32, pixels, strides=(3,))[...] = wide.reshape(-1).view(np.uint32)[:count]
    pixels[-1, -1] = wide[-1, -1, :3]


def _rectangles(mask: np.ndarray) -> np.ndarray:
    """What is true in a mask as rectangles, (n, 4) of x, y, width and height: runs in its rows, joined downwards."""
    padded = np.pad(mask, ((0, 0), (1, 1)))
    rows, edges = np.nonzero(padded[:, 1:] != padded[:, :-1])
    found: list[list[int]] = []
    above: dict[tuple[int, int], list[int]] = {}
    for y, x, end in zip(rows[::2].tolist(), edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        rectangle = above.get((x, end))
        if rectangle and rectangle[1] + rectangle[3] == y:
            rectangle[3] += 1
        else:
            above[x, end] = rectangle = [x, y, end - x, 1]
            found.append(rectangle)
    return np.array(found, int).reshape(-1, 4)


def _overlap(a: Sequence[int], b: Sequence[int]) -> Region:
    """What two rectangles (x, y, width, height) have in common."""
    x, y = max(a[0], b[0]), max(a[1], b[1])
    return x, y, min(a[0] + a[2], b[0] + b[2]) - x, min(a[1] + a[3], b[1] + b[3]) - y


def _piece(job: _Job, places: np.ndarray, region: tuple[int, int, int, int]) -> tuple[int, int, int, int]:
    """What a region (x, y, width, height) of a tile needs of the picture: left, top, right and bottom."""
    x, y, width, height = region
    more = 0 if job.is_single else 1
    within = places[y : y + height + more, x : x + width + more]
    # One axis after the other: over both at once NumPy is fifty times slower.
    low = np.floor(within.min(axis=0).min(axis=0)).astype(int) - _REACH
    high = np.ceil(within.max(axis=0).max(axis=0) + np.array(job.zoom)).astype(int) + _REACH
    if not job.is_repeated:
        limits = np.array(job.source_size)
        low, high = np.clip(low, 0, limits - 1), np.clip(high, 1, limits)
    return int(low[0]), int(low[1]), int(high[0]), int(high[1])


def _size(piece: tuple[int, int, int, int]) -> tuple[int, int]:
    return piece[2] - piece[0], piece[3] - piece[1]


def _edge_index(index: np.ndarray, count: int, edges: str) -> np.ndarray:
    """The pixel of a picture of `count` that stands for pixel `index` beyond it."""
    if edges == "wrap":
        return index % count
    index = index % (2 * count)
    return np.minimum(index, 2 * count - 1 - index)

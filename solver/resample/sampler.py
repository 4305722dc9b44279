"""A picture looked up through a map, at the quality of an export."""

from __future__ import annotations

from collections.abc import Iterator
from math import prod
from typing import Any

import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field, FieldPool
from solver.gl.passes import Region
from solver.resample.plan import KINDS, TARGET_COMPONENTS, Map, Plan, Sampling, SamplingError, plan_for
from solver.resample.sample_points import SamplePoints
from solver.resample.tiles import SMALLEST_TILE, Piece, Tiling, halves_of, overlap, piece_of, rectangles, size_of
from solver.resample.transfer import PictureTexture, read_result

BLOCK = 64  # pixels along a block of the result that is drawn by a shader of its own kind; as llvmpipe's tiles


class Sampler:
    """Looks pictures up through maps; keeps its textures from one picture to the next, as in a film.

    Args:
        device: the device.
        whole: pixels up to which a picture is worked on in one piece; larger ones, and those above the GL's largest
            texture, are done in tiles with the pieces of the original they need, to the same bits.
        tile: (width, height) of such a tile.

    Attributes:
        source: the picture on the GPU.
        points: where it is looked up.
    """

    def __init__(self, device: Device, whole: int = 10_000_000, tile: tuple[int, int] = (2048, 1024)) -> None:
        self.device = device
        self.tiling = Tiling(whole, tile, device.limits.max_texture_size)
        self._fields = FieldPool(device, "resample")
        self.source = PictureTexture(device)
        self.points = SamplePoints(device)
        self._classes_for: tuple[object, ...] = ()
        self._classes = np.empty((0, 0), np.uint8)

    def apply(
        self,
        warp: Map,
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
        plan = plan_for(warp, picture, size, how or Sampling())
        width, height = plan.size
        result = np.empty((height, width, *picture.shape[2:]), picture.dtype)
        for _ in self._bands(plan, picture, result):
            pass
        return result

    def bands(
        self,
        warp: Map,
        picture: np.ndarray,
        size: tuple[int, int] | None = None,
        how: Sampling | None = None,
        result: np.ndarray | None = None,
    ) -> Iterator[np.ndarray]:
        """The rows of `apply`'s result from the top, some at a time, so that a large one need never exist as a whole.

        `result` takes them, if given; otherwise each band is an array of its own.
        """
        return self._bands(plan_for(warp, picture, size, how or Sampling()), picture, result)

    def _bands(self, plan: Plan, picture: np.ndarray, result: np.ndarray | None) -> Iterator[np.ndarray]:
        width, height = plan.size
        whole = self.tiling.fits(plan.source_size) and not plan.is_repeated
        columns, rows = plan.size if whole and self.tiling.fits(plan.size) else self.tiling.tile_of(plan.size)
        room = None if whole else self.tiling.room(plan, (columns, rows))
        if whole:
            self.source.hold(plan, picture)
        for top in range(0, height, rows):
            bottom = min(top + rows, height)
            shape = bottom - top, width, plan.channels
            band = np.empty(shape, plan.picture.dtype) if result is None else result[top:bottom].reshape(shape)
            for left in range(0, width, columns):
                right = min(left + columns, width)
                # Some may reach a pixel beyond the result: so all are of one size, and no texture is made anew.
                read_result(self._draw(plan, (left, top, left + columns, top + rows), room), plan, band[:, left:right])
            yield band.reshape(bottom - top, width, *picture.shape[2:])

    @property
    def textures(self) -> tuple[int, ...]:
        """The GL's names of all textures that are kept."""
        fields = *self._fields.fields, *self.source.prepared.fields, *self.points.fields.fields
        raw = () if self.source.raw is None else (self.source.raw.glo,)
        return *raw, *(field.texture.glo for field in fields)

    def release(self) -> None:
        """Free the textures."""
        for thing in (self._fields, self.source, self.points):
            thing.release()

    # -- one tile ---------------------------------------------------------------------------------------------------

    def _draw(self, plan: Plan, tile: Piece, room: tuple[int, int] | None) -> Field:
        """Draw one tile of the result, from the whole picture or by pieces that fit `room`."""
        left, top, right, bottom = tile
        region = 0, 0, right - left, bottom - top
        if plan.is_paired:
            target = self._fields.get("result", ((right - left + 1) // 2, bottom - top), 2, "u4")
        else:
            kind, _ = KINDS[plan.picture.dtype]
            target = self._fields.get("result", (right - left, bottom - top), TARGET_COMPONENTS[plan.channels], kind)
        if room is None:
            self._look_up(plan, target, tile, region)
        else:
            self._draw_pieces(plan, target, tile, self.points.positions(plan, tile), region, room)
        return target

    def _draw_pieces(
        self, plan: Plan, target: Field, tile: Piece, positions: np.ndarray, region: Region, room: tuple[int, int]
    ) -> None:
        """Draw a region of a tile from the piece of the picture it needs, or its halves, if that is too large."""
        _, _, width, height = region
        piece = piece_of(plan, positions, region)
        size = size_of(piece)
        fits = self.tiling.fits(size)
        unwarped = max(width * max(plan.zoom[0], 1), height * max(plan.zoom[1], 1))
        is_smallest = unwarped <= SMALLEST_TILE or (width <= 2 and height == 1)
        if is_smallest and not fits:
            raise SamplingError(
                f"the map tears a patch of {width} x {height} pixels over {size[0]} x {size[1]} pixels of the picture"
            )
        if not is_smallest and (size[0] > room[0] or size[1] > room[1]):
            halves = halves_of(region)
            # Where the map is torn, both halves may need what the whole does.
            if not fits or sum(prod(size_of(piece_of(plan, positions, half))) for half in halves) < 1.5 * prod(size):
                for half in halves:
                    self._draw_pieces(plan, target, tile, positions, half, room)
                return
        self.source.load(plan, piece, room)
        self._look_up(plan, target, tile, region)

    def _look_up(self, plan: Plan, target: Field, tile: Piece, region: Region) -> None:
        """Draw a region of a tile from the piece of the picture that is on the GPU."""
        source, raw = self.source.textures(plan)
        classes, origin, piece = self._classify(plan), tile[:2], self.source.piece
        is_whole = piece == (0, 0, *plan.source_size)
        opaque = plan.how.edges == "black" or not plan.has_alpha
        left, top = region[0] + origin[0], region[1] + origin[1]
        shown = classes[top // BLOCK : -(-(top + region[3]) // BLOCK), left // BLOCK : -(-(left + region[2]) // BLOCK)]

        def regions(wanted: np.ndarray, more: int = 0) -> list[Region]:
            """Where the blocks are in the tile, with `more` of the lattice to the right and below."""
            blocks = rectangles(wanted) * BLOCK
            blocks[:, :2] += np.array((left // BLOCK, top // BLOCK)) * BLOCK - origin
            found = [overlap(block, region) for block in blocks.tolist()]
            if plan.is_paired:
                found = [(x // 2, y, (width + 1) // 2, height) for x, y, width, height in found]
            return [(x, y, width + more, height + more) for x, y, width, height in found]

        is_known = plan.is_single and self.points.is_known(plan, tile)
        for kind in np.unique(shown).tolist():
            defines = plan.defines(whole=is_whole, samples=kind // 2, inside=kind % 2 == 1, at_centres=is_known)
            if is_known:
                displacement = self.points.lattice(plan, tile, at_centres=True)
            elif kind < 2:
                displacement = self.points.along_x(plan, tile, at_centres=True)
            else:
                several = regions(shown >= 2, more=1) if is_whole else None
                displacement = self.points.lattice(plan, tile, at_centres=False, region=several)
            self.device.pass_("resample/look_up.frag", **defines)(
                target,
                region=regions(shown == kind),
                source=source,
                raw=raw,
                displacement=displacement,
                texel=(1 / source.width, 1 / source.height),
                raw_texel=(1 / raw.width, 1 / raw.height),
                next=displacement.texel,
                scale=plan.displacement.height / plan.size[1],
                corner=piece[:2],
                extent=size_of(piece),
                pixel=origin,
                zoom=plan.zoom,
                longer=plan.longer,
                middle=plan.middle,
                half=plan.half,
                outside=1.0 if opaque else 0.0,
            )

    def _classify(self, plan: Plan) -> np.ndarray:
        """What each block of the result wants, (rows, columns) uint8, as `classify.frag` has it.

        The blocks are of the result and not of a tile of it, so that tiles are drawn to the same bits as the whole.
        """
        key = (*plan.key, plan.size, plan.source_size, plan.how)
        if key != self._classes_for:
            self._classes_for = key
            columns, rows = -(-plan.size[0] // BLOCK), -(-plan.size[1] // BLOCK)
            classes = self._fields.get("classes", (columns, rows), 1, "f1")
            source = plan.displacement
            defines: dict[str, object] = {"SINGLE": 1} if plan.is_single else {}
            if plan.how.samples != "auto":
                defines["EVERYWHERE"] = min(plan.pairs[0], 2)
            held: dict[str, Any] = {}
            if plan.held is not None:
                defines["HELD"], held["held"] = 1, plan.held
            self.device.pass_("resample/classify.frag", **defines)(
                classes,
                displacement=source,
                texel=source.texel,
                side=float(BLOCK),
                scale=(source.width / plan.size[0], source.height / plan.size[1]),
                zoom=plan.zoom,
                longer=plan.longer,
                middle=plan.middle,
                half=plan.half,
                **held,
            )
            self._classes = classes.get()
        return self._classes

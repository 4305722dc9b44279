"""Pictures that go to the GPU and back."""

from __future__ import annotations

from functools import partial
from typing import Any

import moderngl
import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field, FieldPool, new_texture
from solver.resample.plan import KINDS, Plan
from solver.resample.tiles import Piece, edge_index

WORDS = {"f1": np.uint32, "nu2": np.uint64}  # that hold four values of it
SWIZZLES = {1: "RRR1", 2: "RRRG", 3: "RGB1", 4: "RGBA"}
WIDENED = 1 << 17  # pixels that are given a fourth value at once


class PictureTexture:
    """The picture that is looked up, or a piece of it, on the GPU: as it is, and as it is best interpolated.

    Attributes:
        raw: the pixels as they are.
        prepared: what is interpolated, where that is something else.
        piece: what of the picture they are, (left, top, right, bottom).
    """

    def __init__(self, device: Device) -> None:
        self.device = device
        self.raw: moderngl.Texture | None = None
        self.piece: Piece = (0, 0, 0, 0)
        self._kind: tuple[object, ...] = ()  # channels and type of the texture
        self.prepared = FieldPool(device, "picture")
        self._held: tuple[np.ndarray, bool, bool, bool, bool] | None = None

    def textures(self, plan: Plan) -> tuple[moderngl.Texture, moderngl.Texture]:
        """What is interpolated, and the pixels as they are."""
        assert self.raw is not None
        return self.prepared["prepared"].texture if plan.is_prepared else self.raw, self.raw

    def hold(self, plan: Plan, picture: np.ndarray) -> None:
        """Have all of the picture (h, w, c) on the GPU; it stays as long as a read-only one is given again."""
        if self._held is None or self._held[0] is not picture or self._held[1:] != plan.preparation:
            self.load(plan, (0, 0, *plan.source_size))
            # The array itself and not its id: no other can take its place in memory as long as it is held.
            self._held = None if picture.flags.writeable else (picture, *plan.preparation)

    def load(self, plan: Plan, piece: Piece, room: tuple[int, int] | None = None) -> None:
        """Upload a piece of the picture (left, top, right, bottom) and prepare it; without `room` it is all of it."""
        self.device.use()
        self._held = None
        self.piece = piece
        left, top, right, bottom = piece
        width, height = right - left, bottom - top
        if plan.is_repeated:
            columns = edge_index(np.arange(left, right), plan.source_size[0], plan.how.edges)
            rows = edge_index(np.arange(top, bottom), plan.source_size[1], plan.how.edges)
            pixels = plan.picture[rows[:, None], columns]
        else:
            pixels = plan.picture[top:bottom, left:right]
        kind, _ = KINDS[plan.picture.dtype]
        least = (width, height) if room is None else (max(width, room[0]), max(height, room[1]))
        raw = self.raw = self._texture(least, plan.channels, kind, exact=room is None)
        write(raw, np.ascontiguousarray(pixels))
        if plan.is_prepared:
            flags = {"LINEAR_LIGHT": plan.is_curved, "PREMULTIPLIED": plan.is_premultiplied}
            defines: dict[str, object] = {name: 1 for name, wanted in flags.items() if wanted}
            more = 0
            if plan.is_packed:
                defines["PACKED"], more = 1, 1
            prepared = self.prepared.get(
                "prepared", (raw.width + more, raw.height), 4, "u4" if plan.is_packed else "f4"
            )
            prepare = self.device.pass_("resample/prepare.frag", **defines)
            prepare(prepared, region=(0, 0, width + more, height), picture=raw, count=(width, height))

    def release(self) -> None:
        """Free the textures."""
        self.prepared.release()
        if self.raw is not None:
            self.raw.release()
        self.raw = self._held = None

    def _texture(self, size: tuple[int, int], channels: int, dtype: str, exact: bool) -> moderngl.Texture:
        """A texture of that size or larger; not a field, as it need not be drawn into."""
        kept = self.raw
        enough = kept is not None and (kept.size == size or (not exact and min(np.subtract(kept.size, size)) >= 0))
        if kept is not None and self._kind == (channels, dtype) and enough:
            return kept
        if kept is not None:
            kept.release()
        components = 4 if channels == 3 and dtype in WORDS else channels
        texture = new_texture(self.device.ctx, size, components, dtype)
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        texture.repeat_x = texture.repeat_y = False
        texture.swizzle = SWIZZLES[channels]
        self._kind = channels, dtype
        return texture


def read_result(field: Field, plan: Plan, target: np.ndarray) -> None:
    """Read a result that was drawn into a field into an array (h, w, channels)."""
    height, width, channels = target.shape
    if plan.is_paired:
        read = partial(field.framebuffer.read_into, components=2, dtype="u4", alignment=1)
        if channels == 4 and target.flags.c_contiguous and field.size == (width // 2, height):
            read(target)
            return
        # Some rows at a time stay in the cache.
        rows = min(height, max(1, WIDENED // width))
        wide = np.empty((rows, 2 * field.width, 4), target.dtype)
        for top in range(0, height, rows):
            some = target[top : top + rows]
            read(wide, viewport=(0, top, field.width, len(some)))
            narrow(wide[: len(some), :width], some)
        return
    settings: dict[str, Any] = {"components": channels, "dtype": field.dtype, "alignment": 1}
    if target.flags.c_contiguous:
        field.framebuffer.read_into(target, (width, height), **settings)
    else:
        data = field.framebuffer.read((width, height), **settings)
        target[...] = np.frombuffer(data, target.dtype).reshape(target.shape)


def write(texture: moderngl.Texture, pixels: np.ndarray) -> None:
    """Write contiguous pixels (h, w, c) into the top left corner of a texture of c components, or of four for three."""
    height, width, channels = pixels.shape
    if texture.components == channels:
        texture.write(pixels, viewport=(0, 0, width, height))
        return
    # A driver widens pixels of three values one by one. Here each is copied together with the first value of the next,
    # which takes half the time; nobody looks at that value. Some rows at a time stay in the cache.
    rows = max(1, WIDENED // width)
    wide = np.empty((rows, width, 4), pixels.dtype)
    words = wide.reshape(-1).view(WORDS[texture.dtype])
    for top in range(0, height, rows):
        some = pixels[top : top + rows]
        count = len(some) * width - 1
        words[:count] = np.ndarray(count, words.dtype, some, strides=(3 * pixels.itemsize,))
        wide.reshape(-1, 4)[count, :3] = some[-1, -1]
        texture.write(wide[: len(some)], viewport=(0, top, width, len(some)))


def narrow(wide: np.ndarray, pixels: np.ndarray) -> None:
    """Copy pixels (h, w, 4) of bytes into an array of as many values, or of three."""
    height, width, channels = pixels.shape
    if channels == 4 or not pixels.flags.c_contiguous or not wide.flags.c_contiguous:
        pixels[...] = wide[..., :channels]
        return
    # Whole words, one row after the other: the fourth value of each is overwritten by the next.
    count = height * width - 1
    np.ndarray(count, np.uint32, pixels, strides=(3,))[...] = wide.reshape(-1).view(np.uint32)[:count]
    pixels[-1, -1] = wide[-1, -1, :3]

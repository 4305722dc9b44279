"""Float textures that passes read from and draw into."""

from __future__ import annotations

from collections.abc import Sized
from numbers import Integral
from typing import Any

import moderngl
import numpy as np

from solver.gl.context import Context, making

DTYPES = {"f1": np.uint8, "nu2": np.uint16, "u4": np.uint32, "f2": np.float16, "f4": np.float32}


class GraphicsMemoryError(MemoryError):
    """The graphics memory is full."""


class FieldError(ValueError):
    """A field of an impossible size, or data that does not fit it."""


def whole(size: tuple[int, int], label: str) -> tuple[int, int]:
    """A size that is (width, height) in whole texels. Raises `FieldError`."""
    if not (isinstance(size, Sized) and len(size) == 2 and all(isinstance(side, Integral) for side in size)):
        raise FieldError(f"{label}: a size of {size!r} was given, (width, height) in whole texels is wanted")
    return size


class Field:
    """One texture, with a framebuffer once it is drawn into or read back: nearest filtering, clamped to the edge.

    Args:
        device: the device it lives in.
        size: (width, height) in texels, each from 1 to the GL's limit.
        components: 1-4.
        label: its name in errors and in a frame debugger.
        dtype: "f4" (float32), "f1" and "nu2" (8 and 16 bits, read as 0-1), "u4" (whole numbers) or "f2".
        cleared: it holds zeros; else nothing of it may be read that has not been written or drawn, which saves a
            draw.
    """

    def __init__(
        self,
        device: Context,
        size: tuple[int, int],
        components: int,
        label: str,
        dtype: str = "f4",
        cleared: bool = True,
    ) -> None:
        width, height = whole(size, label)
        limit = device.limits.max_texture_size
        # A texture that is too large, or empty, is returned without an error and fails much later.
        if not (1 <= width <= limit and 1 <= height <= limit):
            raise FieldError(f"{label}: {width} x {height} is outside 1 x 1 to {limit} x {limit} of this GL")
        device.collect()
        self.device = device
        self.size = (width, height)
        self.components = components
        self.label = label
        self.dtype = dtype
        texture = new_texture(device.ctx, self.size, components, dtype)
        texture.repeat_x = texture.repeat_y = False
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        texture.label = label
        # Plain attributes, until it is released: a pass asks for ten textures.
        self.texture: moderngl.Texture = texture
        self.framebuffer: moderngl.Framebuffer  # see `__getattr__`
        self._is_released = False
        if cleared:
            self.clear()

    def __getattr__(self, name: str) -> Any:
        if name not in ("texture", "framebuffer"):
            raise AttributeError(f"{type(self).__name__} has no {name}")
        if self._is_released:
            raise FieldError(f"{self.label} was released")
        self.device.use()
        # Not one of `device.framebuffer`, which would keep the texture of a field that is dropped and not released.
        with making():
            self.framebuffer = framebuffer = self.device.ctx.framebuffer([self.texture])
        framebuffer.label = self.label
        return framebuffer

    @property
    def width(self) -> int:
        return self.size[0]

    @property
    def height(self) -> int:
        return self.size[1]

    @property
    def texel(self) -> tuple[float, float]:
        """(1 / width, 1 / height)."""
        return 1.0 / self.size[0], 1.0 / self.size[1]

    @property
    def nbytes(self) -> int:
        """Bytes of texture memory."""
        return self.size[0] * self.size[1] * self.components * DTYPES[self.dtype]().itemsize

    def clear(self, *values: float) -> None:
        """Fill with `values`, by default zero."""
        self.before_drawing()
        self.device.use()
        red, green, blue, alpha = (*values, 0.0, 0.0, 0.0, 0.0)[:4]
        self.framebuffer.clear(red, green, blue, alpha)
        self.device.fences.hold()

    def set(self, array: np.ndarray, region: tuple[int, int, int, int] | None = None) -> None:
        """Write an array of shape (height, width) or (height, width, components), row 0 on top.

        Args:
            array: of the field's size, or of the region's.
            region: (x, y, width, height) in texels of what is written; by default all.

        Raises:
            FieldError: on another shape, or on a value that is masked, no number or not finite.
        """
        array = numbers_in(self.label, array)
        width, height = region[2:] if region else self.size
        shape = (height, width) if self.components == 1 else (height, width, self.components)
        if array.shape != shape and array.shape != (*shape, 1):
            raise FieldError(f"{self.label}: an array of shape {array.shape} was given, {shape} is wanted")
        with np.errstate(over="ignore"):  # it is told below
            data = array.astype(DTYPES[self.dtype], copy=False)
        if self.dtype in ("f2", "f4") and not np.isfinite(data).all():
            raise FieldError(f"{self.label}: the array holds a value that is not finite")
        self.before_drawing(region)
        self.device.use()
        self.texture.write(np.ascontiguousarray(data).tobytes(), viewport=region)

    def get(self, region: tuple[int, int, int, int] | None = None) -> np.ndarray:
        """Read back as an array of shape (height, width) or (height, width, components), row 0 on top.

        Args:
            region: (x, y, width, height) in texels of what is wanted; by default all.
        """
        x, y, width, height = region or (0, 0, *self.size)
        shape = (height, width) if self.components == 1 else (height, width, self.components)
        array = np.empty(shape, DTYPES[self.dtype])
        viewport = x, y, width, height
        self.device.use()
        self.framebuffer.read_into(array, viewport, self.components, dtype=self.dtype, alignment=1)
        return array

    def copy_from(self, other: Field) -> None:
        """Take over the texels of `other`, which has the same size and components.

        Raises:
            FieldError: if it has not, or is another device's.
        """
        kind, others = ((field.device, field.size, field.components, field.dtype) for field in (self, other))
        if kind != others:
            raise FieldError(f"{self} cannot take over {other}")
        self.device.use()
        self.device.ctx.copy_framebuffer(self.framebuffer, other.framebuffer)
        self.device.fences.hold()
        # One driver (softpipe) leaves an error behind at its first copy, though that is made; who asks for errors next
        # would take it for his own.
        _ = self.device.ctx.error

    def before_drawing(self, region: tuple[int, int, int, int] | None = None) -> None:
        """Hear that something will be drawn into it, or into (x, y, width, height) of it."""

    def release(self) -> None:
        """Free the texture; the field can no longer be used."""
        if not self._is_released:
            self._is_released = True
            self.device.forget_targets(self.texture)
            if framebuffer := vars(self).pop("framebuffer", None):
                framebuffer.release()
            self.texture.release()
            del self.texture

    def __repr__(self) -> str:
        return f"Field({self.label}, {self.width} x {self.height} x {self.components} {self.dtype})"


def numbers_in(label: str, values: object) -> np.ndarray:
    """Real numbers as an array. Raises `FieldError` for others, masked ones, and rows of unequal length."""
    if np.ma.is_masked(values):
        raise FieldError(f"{label}: the array is masked in some places; `filled` gives them a value")
    try:
        array = np.asarray(values)
    except ValueError:
        raise FieldError(f"{label}: the array has rows of unequal length") from None
    if array.dtype.kind not in "fiub":
        raise FieldError(f"{label}: an array of {array.dtype} was given, real numbers are wanted")
    return array


def new_texture(ctx: moderngl.Context, size: tuple[int, int], components: int, dtype: str) -> moderngl.Texture:
    """A texture whose rows are not padded. Raises `GraphicsMemoryError` and as `making`."""
    _ = ctx.error  # of whatever was before
    with making():
        texture = ctx.texture(size, components, dtype=dtype, alignment=1)
    if ctx.error == "GL_OUT_OF_MEMORY":
        texture.release()
        raise GraphicsMemoryError(f"there is no room for {size[0]} x {size[1]} x {components} more")
    return texture


class DoubleField:
    """A ping-pong pair: a pass reads `read`, draws into `write`, then `swap()` makes the result the one to read."""

    def __init__(self, device: Context, size: tuple[int, int], components: int, label: str) -> None:
        self.read = Field(device, size, components, f"{label} a")
        self.write = Field(device, size, components, f"{label} b")

    def swap(self) -> None:
        self.read, self.write = self.write, self.read

    def release(self) -> None:
        self.read.release()
        self.write.release()


class FieldPool:
    """Fields kept by what they are for, each made anew when it has to be another one.

    Args:
        device: where they live.
        label: what their names begin with.
    """

    def __init__(self, device: Context, label: str) -> None:
        self.device = device
        self.label = label
        self._fields: dict[str, Field] = {}

    def __getitem__(self, role: str) -> Field:
        return self._fields[role]

    @property
    def fields(self) -> list[Field]:
        """All that are kept."""
        return list(self._fields.values())

    def get(self, role: str, size: tuple[int, int], components: int, dtype: str = "f4") -> Field:
        """The field for `role`; what it holds is kept as long as it is asked for as the same."""
        kept = self._fields.get(role)
        if kept is None or (kept.size, kept.components, kept.dtype) != (size, components, dtype):
            if kept is not None:
                kept.release()
            self._fields[role] = Field(self.device, size, components, f"{self.label}, {role}", dtype)
        return self._fields[role]

    def release(self) -> None:
        """Free them all."""
        for field in self.fields:
            field.release()
        self._fields.clear()

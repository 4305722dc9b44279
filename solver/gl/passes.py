"""A pass: one fragment shader drawn over the whole of its target."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Literal

import moderngl
import numpy as np

from solver.gl.context import Context
from solver.gl.field import Field, FieldError
from solver.gl.program import ShaderError, compile_program, declared_reads, program_sources

GL_SAMPLERS = 0x8B5E, 0x8DD2  # sampler2D, usampler2D

Target = Field | Sequence[Field]
Region = tuple[int, int, int, int]
"""Texels: left, top, width, height."""
Blend = Literal["add", "subtract", "mix", "over"]
FACTORS = {
    "mix": (moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA),
    "over": (moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA),
}


class Pass:
    """One full-screen draw of a fragment shader, with its inputs given by name.

    `pass_(target, velocity=field, dt=0.1)` sets `uniform sampler2D u_velocity` and `uniform float u_dt`, and draws into
    `target`, a field or several (the outputs in the order of their locations). Texture units are given out once.

    Raises:
        ShaderError: if the shader does not compile, or an input is none of its uniforms.
    """

    def __init__(self, device: Context, shader: str, defines: dict[str, object]) -> None:
        device.use()
        self.device = device
        self.shader = shader
        self.reads = declared_reads(shader)
        self._source = "".join(program_sources(shader, defines)[:2])
        self.program = compile_program(device.ctx, shader, defines)
        self.program.label = shader
        self._vertices = device.ctx.vertex_array(self.program, [])
        # By the names of the inputs, without their `u_`.
        self._units: dict[str, int] = {}
        self._uniforms: dict[str, moderngl.Uniform] = {}  # that are no textures
        self._numbers: dict[str, object] = {}  # what these hold
        self._dropped: set[str] = set()  # inputs that the compiler has no use for
        for name in self.program:
            member = self.program[name]
            if isinstance(member, moderngl.Uniform):
                if member.gl_type in GL_SAMPLERS:  # pyright: ignore[reportAttributeAccessIssue]
                    self._units[name.removeprefix("u_")] = member.value = len(self._units)
                else:
                    self._uniforms[name.removeprefix("u_")] = member

    def __call__(
        self,
        target: Target,
        *,
        add: bool = False,
        blend: Blend | None = None,
        region: Region | list[Region] | None = None,
        triangles: tuple[int, int] | None = None,
        **inputs: object,
    ) -> None:
        """Draw into `target`.

        Args:
            target: a field, or several fields of one size.
            add: the same as `blend="add"`.
            blend: what is done with what the target holds instead of replacing it: this is added to it, taken from it,
                takes its place by the part that is its alpha ("mix"), or so, multiplied by that already ("over").
                Fields of 8 and 16 bits stay within 0-1.
            region: (x, y, width, height) in texels, or several of them, to draw only there; clipped to the target.
            triangles: the first of their vertices and how many, where the pass has a vertex shader of its own. A region
                then tells where they are, and cuts nothing off.
            inputs: the shader's uniforms without their `u_`.
        """
        fields = (target,) if isinstance(target, Field) else tuple(target)
        device, size = self.device, fields[0].size
        for field in fields:
            if field.device is not device:
                raise FieldError(f"{field} is another device's")
        if device.watch is not None:
            device.watch()
        regions = [(0, 0, *size)] if region is None else _clipped(region, size)
        if not regions:
            return
        for field, part in product(fields, regions):
            field.before_drawing(part)
        device.use()
        self._bind(inputs)
        if len(fields) == 1:
            framebuffer = fields[0].framebuffer
        else:
            framebuffer = device.framebuffer(tuple([field.texture for field in fields]))
        blend = "add" if add else blend
        if blend:
            self._begin_blending(blend)
        # What has vertices of its own is drawn at once, wherever it lies.
        cuts = triangles is None and region is not None
        first, count = triangles or (0, 3)
        for part in regions if cuts else regions[:1]:
            if cuts:
                framebuffer.scissor = part
            framebuffer.use()
            self._vertices.render(moderngl.TRIANGLES, count, first=first)
        pixels = sum([width * height for _, _, width, height in regions])
        device.timings.count(pixels, self.reads, len(regions) if cuts else 1)
        if blend:
            device.ctx.enable_only(moderngl.NOTHING)
        if cuts:
            framebuffer.scissor = None  # pyright: ignore[reportAttributeAccessIssue]
        device.fences.hold()

    def draw_into(
        self,
        framebuffer: moderngl.Framebuffer,
        smooth: Sequence[str] = (),
        blend: Blend | None = None,
        triangles: tuple[int, int] = (0, 3),
        **inputs: object,
    ) -> None:
        """Draw over the viewport of a framebuffer that is not a field's, such as the window's.

        Args:
            framebuffer: the target; its viewport says where.
            smooth: names of inputs that are read with linear filtering, whatever their textures say.
            blend, triangles, inputs: as of a call.
        """
        self.device.use()
        self._bind(inputs)
        units = [self._units[name] for name in smooth if name in self._units]
        for unit in units:
            self.device.linear.use(unit)
        if blend:
            self._begin_blending(blend)
        framebuffer.use()
        first, count = triangles
        self._vertices.render(moderngl.TRIANGLES, count, first=first)
        if blend:
            self.device.ctx.enable_only(moderngl.NOTHING)
        self.device.fences.hold()
        for unit in units:
            self.device.linear.clear(unit)

    def _begin_blending(self, blend: Blend) -> None:
        ctx = self.device.ctx
        ctx.enable_only(moderngl.BLEND)
        ctx.blend_func = FACTORS.get(blend, (moderngl.ONE, moderngl.ONE))
        equation = moderngl.FUNC_REVERSE_SUBTRACT if blend == "subtract" else moderngl.FUNC_ADD
        ctx.blend_equation = equation  # pyright: ignore[reportAttributeAccessIssue]

    def _bind(self, inputs: dict[str, object]) -> None:
        units, numbers, device = self._units, self._numbers, self.device
        for name, value in inputs.items():
            if name in units:
                if isinstance(value, Field):
                    if value.device is not device:
                        raise FieldError(f"{value} is another device's")
                    value = value.texture
                value.use(units[name])  # pyright: ignore[reportAttributeAccessIssue]
            elif name not in self._dropped and numbers.get(name) != value:
                self._set(name, value)

    def _set(self, name: str, value: object) -> None:
        uniform = self._uniforms.get(name)
        if uniform is not None:
            uniform.value = value  # pyright: ignore[reportAttributeAccessIssue]
            self._numbers[name] = value
        elif f"u_{name}" in self._source:
            # The compiler drops uniforms it has no use for; only a name the source does not know is a mistake.
            self._dropped.add(name)
        else:
            raise ShaderError(f"shaders/{self.shader} has no uniform u_{name}")


def differing(before: np.ndarray, after: np.ndarray) -> Region | None:
    """The smallest region outside of which two arrays (h, w) are the same; None if they are everywhere."""
    differs = before != after
    rows, columns = np.flatnonzero(differs.any(axis=1)), np.flatnonzero(differs.any(axis=0))
    if not len(rows):
        return None
    x, y = int(columns[0]), int(rows[0])
    return x, y, int(columns[-1]) + 1 - x, int(rows[-1]) + 1 - y


def hull(region: Region, other: Region | None) -> Region:
    """The smallest region about two, or about the first."""
    if other is None:
        return region
    (x, right), (y, bottom) = (
        (min(region[k], other[k]), max(region[k] + region[k + 2], other[k] + other[k + 2])) for k in (0, 1)
    )
    return x, y, right - x, bottom - y


def split(region: Region, inner: Region) -> tuple[list[Region], list[Region]]:
    """A region's part in another, if there is one, and up to four around it."""
    (x, x0, x1, right), (y, y0, y1, bottom) = (
        (low, *(min(max(at, low), low + side) for at in (first, first + count)), low + side)
        for low, side, first, count in zip(region[:2], region[2:], inner[:2], inner[2:], strict=True)
    )
    if x0 == x1 or y0 == y1:
        return [], [region]
    ends = (x, y, right, y0), (x, y1, right, bottom), (x, y0, x0, y1), (x1, y0, right, y1)
    around = [(left, top, far - left, low - top) for left, top, far, low in ends if left < far and top < low]
    return [(x0, y0, x1 - x0, y1 - y0)], around


def _clipped(region: Region | list[Region], size: tuple[int, int]) -> list[Region]:
    """The parts of one region or several that lie within a target."""
    several = region if isinstance(region, list) else [region]
    found: list[Region] = []
    for part in several:
        left, top, width, height = part
        right, bottom = left + width, top + height
        if left < 0 or top < 0 or right > size[0] or bottom > size[1]:
            left, top, right, bottom = max(left, 0), max(top, 0), min(right, size[0]), min(bottom, size[1])
            part = left, top, right - left, bottom - top
        if right > left and bottom > top:
            found.append(part)
    return found

"""Drawing the picture through its warp, with what is laid over it.

Long, as all of it shares what was drawn last: what has not changed is not drawn again.
"""

from __future__ import annotations

from math import ceil, floor, log2
from typing import Any, NamedTuple

import moderngl
import numpy as np
from PIL import Image

from app.media.depth import to_bits
from app.media.project import Project
from app.model.picture import Picture
from app.ui.editor_state import EditorState
from app.ui.theme import Palette
from app.ui.thumbnails import Thumbnails
from app.ui.viewport import Rect, Viewport
from app.work.session import Session
from solver.gl.device import Device
from solver.gl.field import Field, FieldPool
from solver.grid import Grid

LARGEST = 8192  # pixels along a side of the picture as it is shown; what is exported has them all
LARGEST_FRAME = 4096  # of a clip, which is sent to the GPU frame by frame
EDGES = {"transparent": 0, "black": 1, "clamp": 2, "mirror": 3, "wrap": 4}
ARROW = 30.0  # points between two arrows
FORCE_ARROW = 32.0
FASTEST = 0.4  # longer sides a second that fill an arrow
FORCE_COLOUR = (1.0, 0.87, 0.2)
RESTING = 0.5  # how strong a force is shown while it does not act
GRID_LINES = 24.0
MOVING = 4  # pixels of the screen to one for which the warp is found while things move: nobody sees the difference
PARTS = 8  # frames the picture at rest is spread over: as many as samples a side that a pixel may have in picture.frag
ROWS = 16  # pixels high are its strips, so that what is pressed together lies in those of several frames

WHOLE = 0.0, 0.0, 1.0, 1.0

Pixels = tuple[int, int, int, int]
"""Left, top, right, bottom."""


class Lattice(NamedTuple):
    """Texels that the displacement is found for: (texel + origin) step is a place, 0-1 of the picture."""

    size: tuple[int, int]
    origin: tuple[float, float]
    step: tuple[float, float]

    @property
    def shown(self) -> tuple[float, ...]:
        """Left, top, width and height, 0-1 of the picture."""
        (width, height), (x, y), (across, down) = self
        return x * across, y * down, width * across, height * down


class Canvas:
    """The canvas of one picture.

    Args:
        device: where it is drawn.
        project: whose picture is shown as sRGB.
        pixels: `shown_pixels` of it, if somebody has made them already.

    Attributes:
        largest: pixels along a side of the picture that are shown.
    """

    def __init__(self, device: Device, project: Project, pixels: np.ndarray | None = None) -> None:
        self.device = device
        self.largest = largest_shown(project, device.limits.max_texture_size)
        picture = project.picture
        pixels = shown_pixels(picture, self.largest) if pixels is None else pixels
        height, width = pixels.shape[:2]
        self.size = (picture.width, picture.height)
        self._shrunk = max(width, height) / max(self.size)
        self._has_alpha = picture.has_alpha
        self._texture = device.ctx.texture((width, height), 4, pixels.tobytes())
        self._texture.repeat_x = self._texture.repeat_y = False
        self._texture.build_mipmaps()
        self._is_reduced = True  # the smaller versions of the texture are of what is in it
        self._still = device.field((1, 1), 2, "no displacement")
        self._fields = FieldPool(device, "canvas")
        self._drawn: object = None  # what the displacement was found for while things moved
        self._resting: object = None  # what it and the picture through it are drawn for at rest,
        self._parts = PARTS  # of which there are so many parts
        self._masks_drawn: object = None  # what the layer of the masks was drawn for
        # The warp as it was last seen, shown on while it is made again on another grid.
        self._last: tuple[Field, tuple[float, ...]] | None = None
        self._selected: Field | None = None
        self._selected_area: np.ndarray | None = None
        self.thumbnails = Thumbnails(device, self.size, self._draw_small)
        self._force_fields: tuple[Field, Field] | None = None
        self._forces_of: object = None

    @property
    def reduction(self) -> int:
        """Pixels of the picture along a side of one that is shown."""
        return round(1 / self._shrunk)

    @property
    def is_unfinished(self) -> bool:
        """The next frame draws more of the picture at rest."""
        return self._parts < PARTS

    def show(self, pixels: np.ndarray) -> None:
        """Show another frame from now on, as `shown_pixels` makes it of a picture of the same size."""
        self._texture.write(pixels)
        self._is_reduced = False
        self._resting = None

    def draw(
        self,
        target: moderngl.Framebuffer,
        height: int,
        viewport: Viewport,
        session: Session,
        state: EditorState,
        palette: Palette,
        scale: float,
    ) -> None:
        """Draw the canvas into `target`, `height` pixels high: what of the picture lies on it, and the ground."""
        density, rect = viewport.density, viewport.drawn
        visible = _common(rect, viewport.canvas)
        seen = (0, 0, 0, 0) if visible is None else _in_pixels(visible, density)
        for strip in _around(seen, _in_pixels(viewport.canvas, density)):
            target.clear(*palette.ground, viewport=_from_below(strip, height))
        self.device.fences.hold()
        # What is not looked at now is not gone on with.
        if self.is_unfinished and (visible is None or state.before):
            self._resting, self._parts = None, PARTS
        if visible is None:
            return
        replay = session.replay
        level = self._filter(viewport, session.is_moving)
        defines: dict[str, object] = {"EDGES": EDGES[session.recipe.edges]}
        inputs: dict[str, Any] = {
            "picture": self._texture,
            "displacement": self._still,
            "shown": WHOLE,
            "origin": (rect.x * density, rect.y * density),
            "step": (1 / (rect.width * density), 1 / (rect.height * density)),
            "extent": session.extent,
            "target_height": float(height),
        }
        corner = {"corner": (float(seen[0]), float(height - seen[3]))}
        if replay.density is not None:
            defines["MOVED"] = 1
            inputs["moved"] = replay.density.values.texture
        elif not state.before:
            is_on_it = seen[0] < target.width and seen[3] > height - target.height
            inputs["displacement"], inputs["shown"], picture = self._seen(
                session, state, viewport, seen, inputs, level, is_on_it
            )
            if picture is not None:
                inputs |= {"seen": picture, **corner}
                defines["SEEN"] = 1
        if state.before or state.split is not None:
            defines["SPLIT"] = 1
            inputs["split"] = 2.0 if state.before else state.split
        if self._has_alpha or session.recipe.edges == "transparent" or replay.density is not None:
            defines["CHECKER"] = 1
            inputs |= {"light": palette.checker[1][:3], "dark": palette.checker[0][:3], "tile": 8.0 * scale * density}
        self._add_overlays(defines, inputs, state, scale * density)
        if not state.before and (masks := self._masks(session, state, seen, inputs, scale * density)):
            defines["MASKS"] = 1
            inputs |= {"masks": masks, **corner}
        forces, velocity = state.overlays["forces"], state.overlays["velocity"]
        arrows: list[dict[str, Any]] = []
        if forces.shown and not state.before and replay.forces:
            force, room = self._forces(session)
            defines["ROOM"] = 1
            inputs |= {"room": room, "room_opacity": forces.opacity}
            arrows.append({"field": force, "window": WHOLE, "most": 1.0, "side": FORCE_ARROW * scale * density})
            arrows[-1] |= {"colour": FORCE_COLOUR, "opacity": forces.opacity}
        if velocity.shown and not state.before:
            arrows.append({"field": replay.fluid.carrier(), "window": _window_of(replay.fluid.grid), "most": FASTEST})
            arrows[-1] |= {"colour": (1.0, 1.0, 1.0), "opacity": velocity.opacity, "side": ARROW * scale * density}
        before = target.viewport
        target.viewport = _from_below(seen, height)
        draw = self.device.pass_("view/canvas.frag", **defines)
        draw.draw_into(target, ("displacement", "room"), **inputs)
        shared = {name: inputs[name] for name in ("origin", "step", "target_height", "split") if name in inputs}
        for each in arrows:
            self._draw_arrows(target, seen, **shared, **each)
        target.viewport = before

    def _draw_arrows(
        self, target: moderngl.Framebuffer, seen: Pixels, origin: tuple[float, float], side: float, **inputs: Any
    ) -> None:
        """Draw the arrows of a field, one in every square of `side` pixels, over the viewport, which is `seen`."""
        (left, top), (right, bottom) = (
            [round_((at - start) / side) for at, start in zip(ends, origin, strict=True)]
            for ends, round_ in ((seen[:2], floor), (seen[2:], ceil))
        )
        arrows = self.device.pass_("view/arrows.frag", **({"SPLIT": 1} if "split" in inputs else {}))
        inputs |= {"origin": origin, "side": side, "first": (float(left), float(top)), "across": float(right - left)}
        count = (right - left) * (bottom - top)
        viewport = tuple(float(edge) for edge in target.viewport)
        arrows.draw_into(target, ("field",), blend="over", triangles=(0, 6 * count), viewport=viewport, **inputs)

    def _draw_small(self, target: moderngl.Framebuffer, session: Session) -> None:
        """Draw all of the picture as it is now into a small framebuffer, with nothing laid over it."""
        (width, height), edges = target.size, EDGES[session.recipe.edges]
        inputs: dict[str, Any] = {"shown": WHOLE, "extent": session.extent, "target_height": float(height)}
        inputs |= {"origin": (0.0, 0.0), "step": (1 / width, 1 / height)}
        defines: dict[str, object] = {"EDGES": edges}
        if (density := session.replay.density) is not None:
            inputs |= {"picture": density.values.texture, "displacement": self._still}
        else:
            displacement = self._fields.get("thumbnail's displacement", target.size, 2)
            session.seen.draw(displacement, (0.0, 0.0), displacement.texel)
            self._reduce()
            self._texture.filter = moderngl.LINEAR_MIPMAP_NEAREST, moderngl.LINEAR
            inputs |= {"picture": self._texture, "displacement": displacement}
            layer, level = self._fields.get("thumbnail", target.size, 4, "f1"), _halvings(width / self._texture.width)
            spacing = self._spacing(inputs["step"], level)
            averaged = self.device.pass_("view/picture.frag", EDGES=edges)
            averaged.draw_into(layer.framebuffer, ("displacement",), **inputs, level=float(level), spacing=spacing)
            defines["SEEN"] = 1
            inputs |= {"seen": layer, "corner": (0.0, 0.0)}
        self.device.pass_("view/canvas.frag", **defines).draw_into(target, ("displacement",), **inputs)

    def release(self) -> None:
        self._texture.release()
        self.thumbnails.release()
        self._still.release()
        self._fields.release()
        if self._selected is not None:
            self._selected.release()
        self._release_forces()

    def _release_forces(self) -> None:
        for field in self._force_fields or ():
            field.release()
        self._force_fields = self._forces_of = None

    def _forces(self, session: Session) -> tuple[Field, Field]:
        """The recipe's own forces, all in one: on MAC faces, and as room that is made; 1 where one is strongest."""
        replay, dt = session.replay, session.dt
        start = replay.tick * dt
        acting = tuple(force.acts_within(start, start + dt) for force in replay.forces)
        key = (tuple(map(id, replay.forces)), acting)
        if self._force_fields is not None and key == self._forces_of:
            return self._force_fields
        self._release_forces()
        size = replay.grid.size
        fields = self.device.field(size, 2, "forces shown"), self.device.field(size, 1, "sources shown")
        for force, acts in zip(replay.forces, acting, strict=True):
            share = 1.0 if acts else RESTING
            if force.faces is not None and force.strongest:
                add = self.device.pass_("step/add_impulse.frag")
                add(fields[0], add=True, force=force.faces, impulse=share / force.strongest)
            if force.divergence is not None and force.widest:
                add = self.device.pass_("step/add_source.frag")
                add(fields[1], add=True, source=force.divergence, amount=share / force.widest)
        self._force_fields, self._forces_of = fields, key
        return fields

    def _seen(
        self,
        session: Session,
        state: EditorState,
        viewport: Viewport,
        seen: Pixels,
        inputs: dict[str, Any],
        level: int,
        is_on_target: bool,
    ) -> tuple[Field, tuple[float, ...], Field | None]:
        """The displacement to show, where it lies, 0-1 of the picture, and the picture through it if that is drawn.

        Found for the pixels of the screen only, so that it costs no more at any zoom and on any picture.
        """
        warp = session.seen
        if session.is_rebuilding and self._last is not None:
            return *self._last, None
        if warp.is_untouched:
            self._last = self._still, WHOLE
            return *self._last, None
        (left, top, right, bottom), rect, density = seen, viewport.drawn, viewport.density

        def lattice(stride: int) -> Lattice:
            # One more on every side, to be interpolated between.
            return Lattice(
                (-(-(right - left) // stride) + 2, -(-(bottom - top) // stride) + 2),
                ((left - rect.x * density) / stride - 1, (top - rect.y * density) / stride - 1),
                (stride / (rect.width * density), stride / (rect.height * density)),
            )

        # Of a picture that is magnified, as far apart as what is exported of it is found too.
        whole = ceil(rect.width * density), ceil(rect.height * density)
        stride = max(1, whole[0] // warp.size_for(self.size, whole)[0])
        if not (session.is_moving or state.is_scaling):
            at_rest = lattice(stride)
            if (picture := self._picture(session, at_rest, stride, seen, inputs, level, is_on_target)) is not None:
                self._last = self._fields["displacement"], at_rest.shown
                return *self._last, picture
        moving = lattice(max(stride, MOVING))
        field = self._fields.get("displacement, moving", moving.size, 2)
        if (drawn := (field, warp, warp.version, moving)) != self._drawn:
            warp.draw(field, moving.origin, moving.step, coarsely=True)
            self._drawn = drawn
        self._last = field, moving.shown
        return *self._last, None

    def _picture(
        self,
        session: Session,
        lattice: Lattice,
        stride: int,
        seen: Pixels,
        inputs: dict[str, Any],
        level: int,
        is_on_target: bool,
    ) -> Field | None:
        """The picture at the pixels that are `seen` as an export has it; None until the last part has been drawn.

        Args:
            lattice: of the displacement for it, `stride` pixels from one texel to the next.
            level: how often the picture is halved.
            is_on_target: the target has some of them; else they are not drawn.
        """
        left, top, right, bottom = seen
        height, step = bottom - top, inputs["step"]
        numbers: dict[str, Any] = {"shown": lattice.shown, "step": step, "extent": inputs["extent"]}
        numbers |= {"origin": (inputs["origin"][0] - left, inputs["origin"][1] - top), "level": float(level)}
        numbers |= {"spacing": self._spacing(step, level), "target_height": float(height)}
        warp, edges = session.seen, EDGES[session.recipe.edges]
        displacement = self._fields.get("displacement", lattice.size, 2)
        layer = self._fields.get("picture", (right - left, height), 4, "f1")
        drawn = displacement, layer, warp, warp.version, self._texture.filter, edges, numbers, is_on_target
        if drawn != self._resting:
            self._resting, self._parts = drawn, 0
        if self.is_unfinished and not is_on_target:
            self._parts += 1
        elif self.is_unfinished:
            strips = [(first, min(first + ROWS, height)) for first in range(self._parts * ROWS, height, PARTS * ROWS)]
            # Of the displacement a strip takes what lies beside its pixels too, to be interpolated between.
            rows = [(start // stride, -(-end // stride) + 2) for start, end in strips]
            regions = [(0, first, lattice.size[0], end - first) for first, end in rows]
            warp.draw(displacement, lattice.origin, lattice.step, regions=regions)
            displacement.texture.filter = moderngl.LINEAR, moderngl.LINEAR
            self.device.pass_("view/picture.frag", EDGES=edges)(
                layer,
                region=[(0, height - end, right - left, end - start) for start, end in strips],
                picture=self._texture,
                displacement=displacement,
                **numbers,
            )
            self._parts += 1
        return None if self.is_unfinished else layer

    def _spacing(self, step: tuple[float, float], level: int) -> tuple[float, ...]:
        """How far apart samples of the picture, so often halved, may be, 0-1 of it, for pixels a `step` apart."""
        return tuple(max(2**level / side, one) for side, one in zip(self._texture.size, step, strict=True))

    def _masks(
        self, session: Session, state: EditorState, seen: Pixels, inputs: dict[str, Any], scale: float
    ) -> Field | None:
        """What is laid over the pixels that are `seen` for the masks that are shown, drawn where they have changed."""
        replay, shown = session.replay, state.overlays
        masks, numbers, fields = replay.masks, dict[str, Any](), dict[str, Field]()
        (left, top, right, bottom), height = seen, inputs["target_height"]
        if state.shows_viscosity:
            fields |= {"viscosity": masks.base_viscosity, "thickness": masks.thickness}
            numbers |= {"viscosity_opacity": shown["viscosity"].opacity, "contour": scale}
            numbers |= {"base": max(replay.settings.viscosity, 1e-6), "window": _window_of(replay.fluid.grid)}
        if state.shows_frozen:
            fields["frozen"] = masks.frozen
            numbers |= {"frozen_opacity": shown["frozen"].opacity, "hatch": 11.0 * scale}
            numbers["first"] = float(left + height - bottom)  # the stripes stay where they are on the screen
        if not fields:
            return None
        numbers |= {"origin": (inputs["origin"][0] - left, inputs["origin"][1] - top), "step": inputs["step"]}
        numbers |= {"target_height": float(bottom - top)}
        layer = self._fields.get("masks", (right - left, bottom - top), 4, "f1")
        if (drawn := (layer, masks, masks.version, numbers)) != self._masks_drawn:
            defines = {name.upper(): 1 for name in ("viscosity", "frozen") if name in fields}
            self.device.pass_("view/masks.frag", **defines).draw_into(
                layer.framebuffer, tuple(fields), **fields, **numbers
            )
            self._masks_drawn = drawn
        return layer

    def _selection(self, area: np.ndarray) -> Field:
        """What is selected, uploaded where it is another."""
        if area is not self._selected_area:
            if self._selected is not None:
                self._selected.release()
            self._selected, self._selected_area = self.device.upload(area, "selection", "f1"), area
            self._selected.texture.filter = moderngl.LINEAR, moderngl.LINEAR
        assert self._selected is not None
        return self._selected

    def _reduce(self) -> None:
        """Make the smaller versions of what is shown, if they are not made yet."""
        if not self._is_reduced:
            self._texture.build_mipmaps()
            self._is_reduced = True

    def _filter(self, viewport: Viewport, moves: bool) -> int:
        """Choose how the picture is looked at; how often it is halved for that."""
        zoom = viewport.scale * viewport.density / self._shrunk
        small, level = moderngl.LINEAR, 0
        # Of a clip that runs, each frame would have to be reduced: up to a half nobody misses it.
        if zoom < (0.5 if moves and not self._is_reduced else 0.75):
            self._reduce()
            small, level = moderngl.LINEAR_MIPMAP_NEAREST, _halvings(zoom)
        self._texture.filter = (small, moderngl.NEAREST if zoom >= 6 else moderngl.LINEAR)
        return level

    def _add_overlays(
        self, defines: dict[str, object], inputs: dict[str, object], state: EditorState, scale: float
    ) -> None:
        if state.before:
            return
        shown = state.overlays
        if shown["grid"].shown:
            defines["GRID"] = 1
            inputs |= {"grid": GRID_LINES, "grid_opacity": shown["grid"].opacity, "pixel": scale}
        if state.tool_name == "select" and state.selected_area is not None:
            defines["SELECTED"] = 1
            inputs |= {"selected": self._selection(state.selected_area), "dash": 8.0 * scale, "dash_width": scale}


def _window_of(grid: Grid) -> tuple[float, ...]:
    """Left, top, width and height of a grid, 0-1 of the picture."""
    return tuple(np.divide((*grid.origin, *grid.extent), grid.picture * 2).tolist())


def largest_shown(project: Project, largest: int) -> int:
    """Pixels along a side of its picture that are shown, on a GPU with textures that are so large."""
    return min(LARGEST if project.clip is None else LARGEST_FRAME, largest)


def shown_pixels(picture: Picture, largest: int) -> np.ndarray:
    """A picture as the canvas shows it: RGBA, 8 bits, premultiplied, at most `largest` pixels along a side."""
    pixels = picture.pixels
    step = -(-max(picture.width, picture.height) // largest)
    if step > 1:
        # A side that is shorter than that is one pixel.
        down, across = (min(step, size) for size in pixels.shape[:2])
        height, width = (size // each * each for size, each in zip(pixels.shape[:2], (down, across), strict=True))
        pixels = pixels[:height, :width]
        if pixels.dtype == np.uint8 and pixels.shape[2] in (3, 4):
            # The same means, several times faster, and other threads go on meanwhile.
            pixels = np.asarray(Image.fromarray(pixels).reduce((across, down)))
        else:
            blocks = pixels.reshape(height // down, down, width // across, across, -1)
            pixels = blocks.mean(axis=(1, 3), dtype=np.float32).astype(picture.pixels.dtype)
    shown = picture.with_pixels(pixels)
    straight = shown.straight().pixels
    pixels = to_bits(straight, 8, dither=False)
    if pixels.shape[2] <= 2:
        pixels = np.concatenate([pixels[..., :1].repeat(3, axis=2), pixels[..., 1:]], axis=2)
    if pixels.shape[2] == 3:
        opaque = np.full((*pixels.shape[:2], 4), 255, np.uint8)
        for channel in range(3):  # of a frame of a clip a third of what it takes to copy three at once
            opaque[..., channel] = pixels[..., channel]
        return opaque
    alpha = pixels[..., 3:].astype(np.uint16)
    colours = ((pixels[..., :3] * alpha + 127) // 255).astype(np.uint8)
    if shown.premultiplied and shown.linear:
        # A flame is light that covers nothing: what is brighter than white would be at this alpha is added.
        light = shown.pixels[..., :-1] - np.clip(straight[..., :-1], 0, 1) * straight[..., -1:]
        colours = np.minimum(colours.astype(np.uint16) + to_bits(light, 8, dither=False), 255).astype(np.uint8)
    return np.ascontiguousarray(np.concatenate([colours, pixels[..., 3:]], axis=2))


def _halvings(zoom: float) -> int:
    """How often the picture is halved to be seen at `zoom` pixels a texel."""
    return max(round(-log2(zoom)), 0)


def _in_pixels(rect: Rect, density: float) -> Pixels:
    """A rectangle of points in whole pixels: one more or less is nobody's; none twice is what counts."""
    left, top, right, bottom = (round(side * density) for side in (rect.x, rect.y, rect.right, rect.bottom))
    return left, top, right, bottom


def _from_below(pixels: Pixels, height: int) -> Pixels:
    """Pixels as GL counts them: x, y from below, width, height."""
    left, top, right, bottom = pixels
    return left, height - bottom, right - left, bottom - top


def _around(inner: Pixels, outer: Pixels) -> list[Pixels]:
    """What of `outer` is not `inner`, which lies within it or is empty: clearing less than all of it is cheaper."""
    left, top, right, bottom = inner
    if right <= left or bottom <= top:
        return [outer]
    x0, y0, x1, y1 = outer
    strips = [(x0, y0, x1, top), (x0, bottom, x1, y1), (x0, top, left, bottom), (right, top, x1, bottom)]
    return [strip for strip in strips if strip[0] < strip[2] and strip[1] < strip[3]]


def _common(a: Rect, b: Rect) -> Rect | None:
    x, y = max(a.x, b.x), max(a.y, b.y)
    width, height = min(a.right, b.right) - x, min(a.bottom, b.bottom) - y
    return Rect(x, y, width, height) if width > 0 and height > 0 else None

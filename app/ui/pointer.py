"""The pointer on the canvas: what it does to the picture, the view, the brush and the split."""

from __future__ import annotations

from dataclasses import replace
from math import exp
from typing import TYPE_CHECKING

from app.model.tools import Press
from app.ui.editor_state import LARGEST, SMALLEST
from app.ui.events import LEFT, MIDDLE, RIGHT, Button, Event, Key, Mods, Move, Wheel

if TYPE_CHECKING:
    from app.ui.editor import Editor

SPLIT_REACH = 8.0  # points from the split's line at which it is taken hold of


class PointerController:
    """Turns events on the canvas into what they mean; at most one drag is under way.

    Attributes:
        x, y: where the pointer is, in points.
        drag: what the button that is down does: "paint", "pan", "zoom", "brush", "split", or None.
        space: Space is held, so that any tool pans.
    """

    def __init__(self, editor: Editor) -> None:
        self.editor = editor
        self.x = self.y = -1e6
        self.pressure = 1.0
        self.mods = Mods()
        self.drag: str | None = None
        self.space = False
        self._button = LEFT
        self._space_used = False
        self._start = (0.0, 0.0)
        self._moved = False

    @property
    def is_over_canvas(self) -> bool:
        return self.drag is not None or self.editor.is_canvas_at(self.x, self.y)

    def handle(self, event: Event) -> None:
        """Take part in an event, if it is about the canvas."""
        match event:
            case Move(x, y, pressure, mods):
                self._move(x, y, pressure, mods)
            case Button(button, True, mods):
                self.mods = mods
                if self.drag is None and self.editor.is_canvas_at(self.x, self.y):
                    self._press(button)
            case Button(button, False, mods):
                self.mods = mods
                if self.drag is not None and button == self._button:
                    self._release()
            case Wheel(dx, dy, mods):
                if self.editor.is_canvas_at(self.x, self.y):
                    self._wheel(dx, dy, mods)
            case Key(key, down, mods, repeat):
                self.mods = mods
                if key == "space":
                    self._hold_space(down, repeat)

    # -- what is held -----------------------------------------------------------------------------------------------

    def _hold_space(self, down: bool, repeat: bool) -> None:
        """Space held pans; Space tapped plays."""
        if down and not repeat:
            self.space, self._space_used = True, False
        elif not down and self.space:
            self.space = False
            if not self._space_used and self.drag is None:
                self.editor.do("play")

    def release_all(self) -> None:
        """The window lost the keyboard: nothing is held any more."""
        self.space = False
        if self.drag is not None:
            self._release()

    # -- the pointer ------------------------------------------------------------------------------------------------

    def _press(self, button: int) -> None:
        editor, state = self.editor, self.editor.state
        tool = state.tool
        self._button, self._start, self._moved = button, (self.x, self.y), False
        if button == MIDDLE or (button == LEFT and (self.space or tool.name == "pan")):
            self.drag, self._space_used = "pan", True
        elif button == RIGHT:
            self.drag = "brush"
        elif button == LEFT and self._is_on_split():
            self.drag = "split"
        elif button == LEFT and tool.name == "zoom":
            self.drag = "zoom"
        elif button == LEFT:
            self.drag = "paint"
            editor.dismiss_hint()
            session, place = editor.session, editor.view.to_picture(self.x, self.y)
            opposite = state.opposite.get(tool.name, False) != self.mods.alt
            press = Press(state.brush, opposite, session.extent, session.dt)
            session.press(tool, press, *place, self.pressure, self.mods.shift)

    def _move(self, x: float, y: float, pressure: float, mods: Mods) -> None:
        dx, dy = x - self.x, y - self.y
        self.x, self.y, self.pressure, self.mods = x, y, pressure, mods
        editor = self.editor
        if abs(x - self._start[0]) + abs(y - self._start[1]) > 3:
            self._moved = True
        match self.drag:
            case "paint":
                editor.session.move(*editor.view.to_picture(x, y), pressure, mods.shift)
            case "pan":
                editor.view = editor.view.panned(dx, dy)
            case "zoom":
                view = editor.view
                editor.view = view.zoomed((view.zoom or view.fit_zoom) * exp(0.008 * dx), *self._start)
            case "brush":
                brush = editor.state.brush
                radius = min(max(brush.radius + dx / editor.view.longer, SMALLEST), LARGEST)
                hardness = min(max(brush.hardness - dy * 0.004, 0.0), 1.0)
                editor.state.brush = replace(brush, radius=radius, hardness=hardness)
            case "split":
                editor.state.split = min(max(editor.view.to_picture(x, y)[0], 0.0), 1.0)

    def _release(self) -> None:
        drag, self.drag = self.drag, None
        editor = self.editor
        if drag == "paint":
            editor.session.release()
        elif drag == "zoom" and not self._moved:
            editor.view = editor.view.stepped(not self.mods.alt, self.x, self.y)

    def _wheel(self, dx: float, dy: float, mods: Mods) -> None:
        editor, view = self.editor, self.editor.view
        if mods.shift:
            editor.view = view.panned(48 * (dx or dy), 0)
        elif mods.alt:
            editor.resize_brush(1.1**dy)
        else:
            editor.view = view.zoomed((view.zoom or view.fit_zoom) * 1.15**dy, self.x, self.y)

    def _is_on_split(self) -> bool:
        split = self.editor.state.split
        if split is None:
            return False
        return abs(self.editor.view.to_screen(split, 0)[0] - self.x) <= SPLIT_REACH * self.editor.ui.scale

    @property
    def cursor(self) -> str:
        """The pointer's shape: "none" where the brush's ring takes its place."""
        if not self.is_over_canvas:
            return "arrow"
        if self.drag == "pan" or self.space or self.editor.state.tool_name == "pan":
            return "hand"
        if self.drag == "split" or (self.drag is None and self._is_on_split()):
            return "resize_ew"
        if self.editor.state.tool_name == "zoom":
            return "crosshair"
        return "none" if self.editor.shows_ring else "arrow"

"""The pointer on the canvas: what it does to the picture, the view, the brush and the split.

One class: what a press begins, moves go on with and a release ends.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import exp, hypot

from app.model.handles import RecipeHandle, labelled
from app.model.sampling import Point
from app.model.tools import Press
from app.ui.clock import TWICE
from app.ui.dialogs import Dialogs
from app.ui.editor_state import LARGEST, EditorState
from app.ui.events import LEFT, MIDDLE, RIGHT, Button, Event, Key, Mods, Move, Wheel
from app.ui.preferences import Preferences
from app.ui.selecting import Selecting
from app.ui.widgets import Ui
from app.ui.workspace import Workspace
from app.work.handle_status import Held

SPLIT_REACH = 8.0  # points from the split's line at which it is taken hold of
GRIP = 11.0  # points from a handle's middle, likewise
SHAKE = 3.0  # points that the pointer may move and is not dragged yet
NEAR = 6.0  # points between the clicks of a double click at most


@dataclass
class PointerController:
    """Turns events on the canvas into what they mean; at most one drag is under way.

    Attributes:
        tap: called where Space was tapped, with its chord.
        x, y: where the pointer is, in points.
        drag: what the button that is down does: "paint", "hold" a handle that may be dragged, "pan", "zoom", "brush",
            "split", "select", or None.
        space: Space is held, so that any tool pans.
    """

    workspace: Workspace
    state: EditorState
    ui: Ui
    dialogs: Dialogs
    preferences: Preferences
    selecting: Selecting
    tap: Callable[[str], None]
    x: float = -1e6
    y: float = -1e6
    pressure: float = 1.0
    mods: Mods = field(default_factory=Mods)
    drag: str | None = None
    space: bool = False
    _button: int = field(default=LEFT, init=False)
    _space_used: bool = field(default=False, init=False)
    _space_chord: str = field(default="", init=False)
    _start: tuple[float, float] = field(default=(0.0, 0.0), init=False)
    _moved: bool = field(default=False, init=False)
    _pressed: Held | None = field(default=None, init=False)
    _elsewhere: tuple[float, float] = field(default=(-1e6, -1e6), init=False)  # the last press off the canvas
    _since: float = field(default=0.0, init=False)  # seconds since then

    @property
    def is_over_canvas(self) -> bool:
        """A drag that began on the canvas is under way, or nothing lies over the canvas where the pointer is."""
        return self.drag is not None or self._could_begin

    @property
    def _could_begin(self) -> bool:
        return self.reaches_canvas(self.x, self.y)

    def reaches_canvas(self, x: float, y: float) -> bool:
        """Nothing lies over the canvas at a point of the window."""
        is_free = not self.dialogs.shown and not self.ui.is_covered(x, y)
        return is_free and self.workspace.view.canvas.contains(x, y)

    @property
    def _is_second_click(self) -> bool:
        """The first one of a double click was on something that has gone since: a message, a dialog, a menu."""
        x, y = self._elsewhere
        return self._since <= TWICE and hypot(x - self.x, y - self.y) <= NEAR

    @property
    def shows_ring(self) -> bool:
        """The brush's ring is drawn where the pointer is."""
        has_ring = self.state.tool.gesture is not None and self.drag in (None, "paint", "brush")
        return has_ring and self.is_over_canvas and self.hovered is None

    @property
    def hovered(self) -> Held | None:
        """The handle or pin under the pointer, if the tool takes hold of them and nothing is held yet."""
        if self.state.tool_name != "handle" or self.drag is not None or self.space or not self._could_begin:
            return None
        return self._nearest()

    def _nearest(self) -> Held | None:
        """The handle or pin whose mark is nearest to the pointer, by where it is and shall be, within its grip."""
        view = self.workspace.view

        def far(held: Held) -> float:
            places = [view.to_screen(*place) for place in (held.target, held.now)]
            line = [view.to_screen(*place) for place in held.line]
            pieces = [*((place, place) for place in places), *pairwise(line)]
            return min(_distance((self.x, self.y), *piece) for piece in pieces)

        held = min(self.workspace.session.marks, key=far, default=None)
        return held if held is not None and far(held) <= self.ui.px(GRIP) else None

    @property
    def ring_at(self) -> tuple[float, float]:
        """The middle of the ring, which stays where it is while the brush is made larger, and follows on its string."""
        session = self.workspace.session
        if self.drag == "paint" and self.state.stabiliser and session.path:
            return self.workspace.view.to_screen(*session.path[-1])
        return self._start if self.drag == "brush" else (self.x, self.y)

    @property
    def is_opposite(self) -> bool:
        """The tool works in its other direction, by the switch or by Alt."""
        return self.state.is_opposite != self.mods.alt

    def elapse(self, dt: float) -> None:
        """Let `dt` seconds go by."""
        self._since += dt

    def handle(self, event: Event) -> None:
        """Take part in an event, if it is about the canvas."""
        match event:
            case Move(x, y, pressure, mods):
                self._move(x, y, pressure, mods)
            case Button(button, True, mods):
                self.mods = mods
                if self.drag is None and not self._could_begin:
                    self._elsewhere, self._since = (self.x, self.y), 0.0
                elif self.drag is None and not self._is_second_click:
                    self._press(button)
            case Button(button, False, mods):
                self.mods = mods
                if self.drag is not None and button == self._button:
                    self._release()
            case Wheel(dx, dy, mods):
                if self._could_begin:
                    self._wheel(dx, dy, mods)
            case Key(key, down, mods, repeat):
                self.mods = mods
                if key == "space":
                    self._hold_space(down, repeat)

    # -- what is held -----------------------------------------------------------------------------------------------

    def _hold_space(self, down: bool, repeat: bool) -> None:
        """Space held pans; Space tapped is a key as any other."""
        if down and not repeat:
            self.space, self._space_used, self._space_chord = True, False, self.mods.chord("space")
        elif not down and self.space:
            self.space = False
            if not self._space_used and self.drag is None:
                self.tap(self._space_chord)

    def release_all(self) -> None:
        """The window lost the keyboard: nothing is held any more."""
        self.space = False
        if self.drag is not None:
            self._release()

    # -- the pointer ------------------------------------------------------------------------------------------------

    def _press(self, button: int) -> None:
        tool = self.state.tool
        self._button, self._start, self._moved = button, (self.x, self.y), False
        if button == MIDDLE or (button == LEFT and (self.space or tool.name == "pan")):
            self.drag, self._space_used = "pan", True
        elif button == RIGHT:
            self.drag = "brush"
        elif button == LEFT and self._is_on_split():
            self.drag = "split"
        elif button == LEFT and tool.name == "zoom":
            self.drag = "zoom"
        elif button == LEFT and tool.name == "select":
            self.drag = "select"
            self.preferences.dismiss_hint()
            self.selecting.press(*self.workspace.view.to_picture(self.x, self.y), self.mods)
        elif button == LEFT and (held := self.hovered) is not None:
            if self.mods.alt:
                self.workspace.session.let_go(held.label)
                self.state.selected = ""
            else:
                self.drag, self._pressed, self.state.selected = "hold", held, held.label
        elif button == LEFT:
            self._paint(None)
            self.drag = "paint"

    def _paint(self, held: Held | None) -> None:
        """A gesture begins where the button went down; with a handle that is there, if one was taken hold of."""
        self.preferences.dismiss_hint()
        view, session, state = self.workspace.view, self.workspace.session, self.state
        press = Press(
            state.brush,
            self.is_opposite,
            session.extent,
            session.dt,
            slack=SHAKE / view.longer,
            string=0.0 if state.tool_name == "handle" else state.stabiliser / view.longer,
            symmetry=state.symmetry,
            sectors=state.sectors,
        )
        session.press(state.tool, press, *view.to_picture(*self._start), self.pressure, self.mods.shift, held)
        if isinstance(session.made, RecipeHandle):
            recipe = session.recipe
            state.selected = next(label for label, led in labelled(recipe.handle, recipe.pin) if led == session.made)

    def _move(self, x: float, y: float, pressure: float, mods: Mods) -> None:
        dx, dy = x - self.x, y - self.y
        self.x, self.y, self.pressure, self.mods = x, y, pressure, mods
        workspace, view, brush = self.workspace, self.workspace.view, self.state.brush
        if abs(x - self._start[0]) + abs(y - self._start[1]) > SHAKE:
            self._moved = True
        if self.drag == "hold" and self._moved and self._pressed is not None:
            self.drag, label = "paint", self._pressed.label
            self._paint(next((held for held in workspace.session.held if held.label == label), self._pressed))
        match self.drag:
            case "paint":
                workspace.session.move(*view.to_picture(x, y), pressure, mods.shift)
            case "pan":
                workspace.view = view.panned(dx, dy)
            case "select":
                self.selecting.move(*view.to_picture(x, y))
            case "zoom":
                workspace.view = view.zoomed((view.zoom or view.fit_zoom) * exp(0.008 * dx), *self._start)
            case "brush":
                radius = min(max(brush.radius + dx / view.longer, self.state.smallest), LARGEST)
                hardness = min(max(brush.hardness - dy * 0.004, 0.0), 1.0)
                self.state.brush = replace(brush, radius=radius, hardness=hardness)
            case "split":
                self.state.split = min(max(view.to_picture(x, y)[0], 0.0), 1.0)

    def _release(self) -> None:
        drag, self.drag = self.drag, None
        if drag == "paint":
            session = self.workspace.session
            held = len(session.recipe.handle)
            session.release()
            if len(session.recipe.handle) > held:  # a line, of which nothing was there before it was drawn
                self.state.selected = labelled(session.recipe.handle, ())[-1][0]
        elif drag == "select":
            self.selecting.release()
        elif drag == "zoom" and not self._moved:
            self.workspace.view = self.workspace.view.stepped(not self.mods.alt, self.x, self.y)

    def _wheel(self, dx: float, dy: float, mods: Mods) -> None:
        view = self.workspace.view
        if mods.shift:
            self.workspace.view = view.panned(48 * (dx or dy), 0)
        elif mods.alt:
            self.state.resize_brush(1.1**dy)
        else:
            self.workspace.view = view.zoomed((view.zoom or view.fit_zoom) * 1.15**dy, self.x, self.y)

    def _is_on_split(self) -> bool:
        split = self.state.split
        if split is None:
            return False
        return abs(self.workspace.view.to_screen(split, 0)[0] - self.x) <= self.ui.px(SPLIT_REACH)

    def zoom_step(self, up: bool) -> None:
        """The next round zoom where the pointer is, or in the middle."""
        view = self.workspace.view
        at = (self.x, self.y) if view.canvas.contains(self.x, self.y) else view.canvas.middle
        self.workspace.view = view.stepped(up, *at)

    @property
    def cursor(self) -> str:
        """The pointer's shape: "none" where the brush's ring takes its place."""
        if not self.is_over_canvas:
            return "arrow"
        if self.drag == "pan" or self.space or self.state.tool_name == "pan":
            return "hand"
        if self.drag == "split" or (self.drag is None and self._is_on_split()):
            return "resize_ew"
        if self.state.tool_name in ("zoom", "select"):
            return "crosshair"
        if self.drag == "hold" or self.hovered is not None:
            return "hand"
        return "none" if self.shows_ring else "arrow"


def _distance(place: Point, start: Point, end: Point) -> float:
    """How far a place is from a straight piece of a line."""
    along = end[0] - start[0], end[1] - start[1]
    from_start = place[0] - start[0], place[1] - start[1]
    part = (from_start[0] * along[0] + from_start[1] * along[1]) / max(along[0] ** 2 + along[1] ** 2, 1e-12)
    part = min(max(part, 0.0), 1.0)
    return hypot(from_start[0] - part * along[0], from_start[1] - part * along[1])

"""The editor: one frame is a function of its state, the events since the last one, and the time passed."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
from imgui_bundle import imgui
from imgui_bundle.imgui import internal

from app.errors import UserError
from app.media.project import Project
from app.model.presets import Feel
from app.model.tools import TOOLS
from app.ui import panels, theme
from app.ui.actions import ACTIONS, BY_KEY
from app.ui.canvas import Canvas
from app.ui.clock import PACE, Clock
from app.ui.dialogs import Dialog, Preferring, Shortcuts, Unsaved
from app.ui.events import Button, CloseWish, Drop, Event, Focus, Key, Move, Wheel
from app.ui.exporting import ExportDialog, Exports, StillExporting
from app.ui.files import Files
from app.ui.hand import Hand
from app.ui.host import Host
from app.ui.layout import NARROW, Layout
from app.ui.messages import Messages
from app.ui.numbers import Numbers
from app.ui.panels.strip import GROUP_ENDS
from app.ui.preferences import Preferences
from app.ui.quality import Quality
from app.ui.recovering import Recovery
from app.ui.state import LARGEST, SMALLEST, State
from app.ui.viewport import Viewport
from app.ui.widgets import Ui
from app.work.recovery import Found
from app.work.session import Session
from solver.gl.device import Device

# Bytes of pixels of the pictures that were open before, to which Undo comes back.
OPENED_BUDGET = 2**30


class Editor:
    """The whole window but for the window itself.

    Args:
        device: the GL of the window, or a headless one.
        project: what is open first.
        preferences: what the person likes.
        journals: the folder in which unsaved work outlasts a crash; None keeps nothing, for tests.

    Attributes:
        closed: the person has left.
        clipboard: puts a text on the clipboard; the window sets it.
        placeholder: work that is only there until something else has been read: untouched, it is nothing to go back to.
    """

    def __init__(
        self,
        device: Device,
        project: Project,
        preferences: Preferences | None = None,
        journals: Path | None = None,
    ) -> None:
        self.device = device
        self.preferences = preferences or Preferences()
        self.state = State(
            inspector=self.preferences.inspector,
            auto_quality=self.preferences.auto_quality,
        )
        self.host = Host(device)
        self.ui = Ui(theme.PALETTES[self.preferences.theme], self.host.fonts, self.preferences.scale)
        self.clock = Clock()
        self.messages = Messages(self.clock.stir)
        self.hand = Hand(self)
        self.files = Files(self)
        self.exports = Exports(self.messages)
        self.quality = Quality(self)
        self.numbers = Numbers()
        self.recovery = Recovery(self, journals)
        self.dialogs: list[Dialog] = []
        self.closed = False
        self.clipboard: Callable[[str], None] = imgui.set_clipboard_text
        self.layout = self._layout(1280, 800)
        self._styled: tuple[object, ...] = ()
        self._held_by_imgui = False
        self._popup_open = False
        self._once_typed: list[str] = []  # actions that wait until what is being typed has been taken
        self.placeholder: Session | None = None
        self._sessions: list[tuple[Session, Canvas]] = []
        self._index = -1
        self.view = Viewport(self.layout.canvas, (1, 1))
        self.open(project)

    # -- the work that is open --------------------------------------------------------------------------------------

    @property
    def session(self) -> Session:
        return self._sessions[self._index][0]

    @property
    def canvas(self) -> Canvas:
        return self._sessions[self._index][1]

    @property
    def is_dirty(self) -> bool:
        return self.session.document.is_dirty

    @property
    def title(self) -> str:
        return f"{self.session.project.name}{' *' if self.is_dirty else ''} - fluidwarp"

    def open(self, project: Project, pixels: np.ndarray | None = None, found: Found | None = None) -> None:
        """Work on another project; Undo at its very start comes back to this one.

        `pixels`: the picture as the canvas shows it, if it is at hand. `found`: what the project was restored from.
        """
        canvas = Canvas(self.device, project.picture, pixels)
        try:
            session = Session(self.device, project)
        except Exception:
            canvas.release()
            raise
        if found is not None:
            session.document.restore(found.work.history, found.work.saved)
        self.recovery.opened(session, found)
        for old in self._sessions[self._index + 1 :]:
            self._close(*old)
        kept = self._sessions[: self._index + 1]
        replaced = kept.pop() if kept and kept[-1][0] is self.placeholder and not self.is_dirty else None
        # Those further back keep what makes them, and replay it when they are wanted.
        for old, _ in kept[:-1]:
            old.replay.checkpoints.clear()
        while len(kept) > 1 and sum(old.project.picture.pixels.nbytes for old, _ in kept) > OPENED_BUDGET:
            self._close(*kept.pop(0))
        self._sessions = [*kept, (session, canvas)]
        self._turn_to(len(self._sessions) - 1)
        if replaced is not None:
            self._close(*replaced)
        self.quality.opened(found)

    def undo(self) -> None:
        if self.session.document.history.can_undo:
            self.session.undo()
        elif self._index > 0:
            self._turn_to(self._index - 1)

    def redo(self) -> None:
        if self.session.document.history.can_redo:
            self.session.redo()
        elif self._index < len(self._sessions) - 1:
            self._turn_to(self._index + 1)

    @property
    def can_undo(self) -> bool:
        return self.session.document.history.can_undo or self._index > 0 or self.session.is_painting

    @property
    def can_redo(self) -> bool:
        return self.session.document.history.can_redo or self._index < len(self._sessions) - 1

    def change(self, name: str, **settings: Any) -> None:
        """Change the fluid from the playhead on."""
        if self.session.end or settings.keys() <= {"viscosity", "drag", "walls"}:
            self.session.change(name, **settings)

    def _turn_to(self, index: int) -> None:
        if self._index >= 0:
            self.session.stop_recording()
            self.session.forget_grid()
            self.recovery.keep()
        self._index = index
        self.view = Viewport(self.layout.canvas, self.canvas.size, self.ui.density)

    def _close(self, session: Session, canvas: Canvas) -> None:
        self.recovery.closed(session)
        session.release_gpu()
        canvas.release()

    # -- a frame ----------------------------------------------------------------------------------------------------

    def frame(
        self,
        target: moderngl.Framebuffer,
        size: tuple[int, int],
        dt: float,
        events: Sequence[Event] = (),
        density: float = 1.0,
        scale: float = 1.0,
    ) -> None:
        """Take in `events`, let `dt` seconds go by, and draw everything into `target`.

        Args:
            target: a framebuffer of `size` pixels.
            size: width and height in pixels.
            dt: seconds since the last frame.
            events: in their order.
            density: pixels a point of the events' coordinates.
            scale: of the interface, as the screen asks for; the preferences' own comes on top.
        """
        begun = time.perf_counter()
        self.clock.elapse(dt)
        self.messages.elapse(dt)
        with self.clock.measure("frame"):
            self._lay_out((size[0] / density, size[1] / density), density, scale)
            self._hear(events)
            self.recovery.keep()
            with self.clock.measure("simulate"):
                self.session.advance(self.clock.ticks(dt, self.session.dt, self.session.is_moving))
            self.quality.look(dt)
            self._draw(target, size, dt, events)
            self.recovery.keep()
        if self.quality.is_measuring:
            self.quality.warm_up(begun)

    def wants_frame(self) -> bool:
        """True while something moves by itself."""
        busy = self.quality.is_measuring or self.quality.is_preparing
        return busy or self.session.is_moving or self.clock.settling

    def wait(self) -> float:
        """Seconds that may pass before the next frame if no event comes."""
        if self.wants_frame():
            return 0.0
        if self.clock.hovering:
            return PACE
        # What goes on elsewhere is looked at now and then: frames would only take the processor from it.
        elsewhere = self.exports.is_running or self.files.is_waiting or self.files.is_loading or self.recovery.is_busy
        if elsewhere or any(dialog.is_busy for dialog in self.dialogs):
            return 0.1
        return min(self.messages.next_in or 60.0, 60.0)

    def _lay_out(self, size: tuple[float, float], density: float, scale: float) -> None:
        self.ui.scale = scale * self.preferences.scale
        self.ui.density = density
        styled = (self.preferences.theme, self.ui.scale)
        if styled != self._styled:
            self._styled = styled
            self.clock.stir()
            self.ui.palette = theme.PALETTES[self.preferences.theme]
            theme.apply(self.ui.palette, self.ui.scale)
        self.layout = self._layout(*size)
        self.view = replace(self.view, canvas=self.layout.canvas, density=density)

    def _layout(self, width: float, height: float) -> Layout:
        self._is_narrow = width < NARROW * self.ui.scale
        inspector = self.state.over_narrow if self._is_narrow else self.state.inspector
        return Layout.of(width, height, self.ui.scale, inspector, len(TOOLS), len(GROUP_ENDS) + 1)

    def _hear(self, events: Sequence[Event]) -> None:
        for event in events:
            self.clock.stir()
            try:
                self._hear_one(event)
            except UserError as error:
                self.messages.warn(error.in_window)

    def _hear_one(self, event: Event) -> None:
        match event:
            case Key(key, down, mods, repeat):
                if key == "\\":
                    self.state.before = down and not self._is_typing
                if down and not self.dialogs:
                    self._key(key, mods.chord(key), repeat)
                if not self.dialogs and not self._is_typing:
                    self.hand.hear(event)
            case Move() | Button() | Wheel():
                self.hand.hear(event)
            case Focus(False):
                self.hand.let_go()
                self.state.before = False
            # A dialog is about the work that is open, and is answered before there is another one.
            case Drop(paths) if paths and not self.dialogs:
                self.files.open(Path(paths[0]))
            case CloseWish():
                self.do("quit")

    def _key(self, key: str, chord: str, repeat: bool) -> None:
        action = BY_KEY.get(chord) or (BY_KEY.get(key) if key in "{}+=" else None)
        # Space is also held to pan, so that it plays only once it is let go.
        if action is None or key == "space" or (repeat and not action.repeats):
            return
        if not self._is_typing:
            self.do(action.name)
        elif action.group == "File":
            self._once_typed.append(action.name)

    def do(self, name: str) -> None:
        """Do one of the actions, if it can be done now."""
        action = ACTIONS[name]
        if not action.enabled(self):
            return
        try:
            action.run(self)
        except UserError as error:
            self.messages.warn(error.in_window)

    def _draw(self, target: moderngl.Framebuffer, size: tuple[int, int], dt: float, events: Sequence[Event]) -> None:
        target.viewport = (0, 0, *size)
        # Clearing is many times cheaper than the same rectangles drawn by imgui, which blends every pixel.
        target.clear(*self.ui.palette.panel)
        self.device.fences.hold()
        with self.clock.measure("canvas"):
            self.canvas.draw(target, size[1], self.view, self.session, self.state, self.ui.palette, self.ui.scale)
        points, by_keys = (size[0] / self.ui.density, size[1] / self.ui.density), bool(self.dialogs) or self._popup_open
        self.host.begin(points, self.ui.density, dt, events, by_keys)
        if self._once_typed:
            # The field is left, as if by Enter, so that what was typed is taken before it is saved.
            internal.clear_active_id()
        try:
            with self.clock.measure("panels"):
                panels.draw(self.ui, self)
                if self.session.notice:
                    self.messages.say(self.session.notice)
                    self.session.notice = None
                self.exports.draw(self.ui, self.layout.canvas)
                self.files.draw(self.ui, self.layout.canvas)
                self.messages.draw(self.ui, self.layout.canvas)
                self._draw_dialog()
            names, self._once_typed = self._once_typed, []
            for name in names:
                self.do(name)
        except UserError as error:
            self.messages.warn(error.in_window)
        self.ui.end_frame()
        io = imgui.get_io()
        self._held_by_imgui = io.want_capture_mouse
        self._is_typing_now = io.want_text_input
        anywhere = imgui.PopupFlags_.any_popup_id | imgui.PopupFlags_.any_popup_level
        self._popup_open = imgui.is_popup_open("", anywhere)
        with self.clock.measure("interface"):
            self.host.end(target)

    def _draw_dialog(self) -> None:
        self.files.poll()
        self.recovery.poll()
        if self.dialogs and not self.dialogs[-1].draw(self.ui, self):
            self.dialogs.pop()

    _is_typing_now = False

    @property
    def _is_typing(self) -> bool:
        return self._is_typing_now

    # -- the canvas -------------------------------------------------------------------------------------------------

    def is_canvas_at(self, x: float, y: float) -> bool:
        """True if nothing lies over the canvas at a point of the screen."""
        if self.dialogs or self._popup_open or not self.layout.canvas.contains(x, y):
            return False
        return not any(rect.contains(x, y) for rect in self.ui.covers)

    @property
    def shows_ring(self) -> bool:
        """The brush's ring is drawn where the pointer is."""
        tool = self.state.tool
        return tool.gesture is not None and self.hand.is_over_canvas and self.hand.drag in (None, "paint", "brush")

    def choose_tool(self, name: str, opposite: bool) -> None:
        self.state.tool_name = name
        if self.state.tool.directions:
            self.state.opposite[name] = opposite

    def choose_feel(self, feel: Feel) -> None:
        """Let the fluid feel so from now on, and pushes be as local as is best for it."""
        self.session.change(feel.name, viscosity=feel.viscosity, drag=feel.drag)
        self.state.brush = replace(self.state.brush, local=feel.local)

    def resize_brush(self, factor: float) -> None:
        brush = self.state.brush
        self.state.brush = replace(brush, radius=min(max(brush.radius * factor, SMALLEST), LARGEST))

    def harden_brush(self, by: float) -> None:
        brush = self.state.brush
        self.state.brush = replace(brush, hardness=round(min(max(brush.hardness + by, 0.0), 1.0), 3))

    def strengthen_brush(self, by: float) -> None:
        brush = self.state.brush
        self.state.brush = replace(brush, strength=round(min(max(brush.strength + by, 0.05), 1.0), 3))

    def zoom_step(self, up: bool) -> None:
        canvas = self.layout.canvas
        over = canvas.contains(self.hand.x, self.hand.y)
        middle = (self.hand.x, self.hand.y) if over else (canvas.x + canvas.width / 2, canvas.y + canvas.height / 2)
        self.view = self.view.stepped(up, *middle)

    def zoom_fit(self) -> None:
        self.view = self.view.fitted()

    def zoom_to(self, zoom: float) -> None:
        canvas = self.layout.canvas
        self.view = self.view.zoomed(zoom, canvas.x + canvas.width / 2, canvas.y + canvas.height / 2)

    # -- what is shown ----------------------------------------------------------------------------------------------

    def toggle_split(self) -> None:
        self.state.split = 0.5 if self.state.split is None else None

    def toggle_inspector(self) -> None:
        if self._is_narrow:
            self.state.over_narrow = not self.state.over_narrow
            return
        self.state.inspector = self.preferences.inspector = not self.state.inspector
        self.preferences.save()

    def dismiss_hint(self) -> None:
        """The first hint has been followed or closed, and does not come again."""
        if self.preferences.hint:
            self.preferences.hint = False
            self.preferences.save()

    def toggle_statistics(self) -> None:
        self.state.statistics = not self.state.statistics
        self.device.timings.enabled = self.state.statistics

    def toggle_theme(self) -> None:
        self.preferences.theme = "light" if self.preferences.theme == "dark" else "dark"
        self.preferences.save()

    def toggle_overlay(self, name: str) -> None:
        overlay = self.state.overlays[name]
        overlay.shown = not overlay.shown

    def step_back(self) -> None:
        self.session.seek(self.session.target - 1)

    # -- dialogs ----------------------------------------------------------------------------------------------------

    def show_shortcuts(self) -> None:
        self.dialogs.append(Shortcuts())

    def ask_preferences(self) -> None:
        self.dialogs.append(Preferring())

    def ask_export(self) -> None:
        self.session.release()
        likes = self.preferences
        folder = next((name for name in (likes.export_folder, likes.folder) if name and os.path.isdir(name)), "")
        self.dialogs.append(ExportDialog(self.session, folder))

    def ask_quit(self) -> None:
        """Leave, after having asked about what is not saved and what is being exported."""
        self.unless_unsaved("quit", self._quit_unless_exporting)

    @property
    def asks_before_quitting(self) -> bool:
        """Who leaves now is asked something first."""
        return bool(self.is_dirty or self.session.is_painting or self.exports.is_running)

    def _quit_unless_exporting(self) -> None:
        if self.exports.is_running:
            self._ask(StillExporting(self.exports, self._quit))
        else:
            self._quit()

    def unless_unsaved(self, what: str, then: Callable[[], None]) -> None:
        """Do something that would lose unsaved work, once the person has said what shall become of it."""
        self.session.release()
        if self.is_dirty:
            self._ask(Unsaved(what, then))
        else:
            then()

    def _ask(self, question: Dialog) -> None:
        """Ask; of the same kind the last one counts, as where a person closes the window once more."""
        self.dialogs = [*[other for other in self.dialogs if type(other) is not type(question)], question]

    def copy_recipe(self) -> None:
        self.clipboard(self.session.recipe.text())
        self.messages.done("The recipe is on the clipboard, as TOML.")

    def _quit(self) -> None:
        self.exports.cancel()
        self.closed = True

    def release(self) -> None:
        """Free everything."""
        self.exports.cancel()
        self.preferences.save()
        self.recovery.release(discard=self.closed)
        for work in self._sessions:
            self._close(*work)
        self.host.release()

"""The editor: one frame is a function of its state, the events since the last one, and the time passed.

Long, as it makes all parts of the window, and says in which order they hear, act and are drawn.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import moderngl
import numpy as np
from imgui_bundle.imgui import internal

from app.errors import UserError
from app.media.project import Project
from app.model.tools import TOOLS
from app.ui import theme
from app.ui.actions import ACTIONS
from app.ui.canvas import Canvas
from app.ui.cautions import Cautions
from app.ui.chooser import FileChooser
from app.ui.clock import PACE, Clock
from app.ui.commands import Commands
from app.ui.dialogs import Dialogs
from app.ui.editor_state import EditorState
from app.ui.events import Button, CloseWish, Drop, Event, Focus, Key, Move, Text, Wheel
from app.ui.export_dialog import Exports
from app.ui.files import Files
from app.ui.fitting import Fits
from app.ui.imgui_backend import ImGuiBackend
from app.ui.journals import Journals
from app.ui.keymap import Keymap
from app.ui.layout import NARROW, Layout
from app.ui.messages import Messages
from app.ui.numbers import Numbers
from app.ui.panels import bar, hud, inspector, lanes, marks, strip, timebar
from app.ui.pointer import PointerController
from app.ui.preferences import Preferences
from app.ui.quality import Quality
from app.ui.recovery_dialog import Recovery
from app.ui.rehearsal import Rehearsal
from app.ui.selecting import Selecting
from app.ui.viewport import Viewport
from app.ui.widgets import Ui
from app.ui.workspace import Workspace
from app.work.recovery import Found
from app.work.session import Session
from solver.gl.device import Device
from solver.gl.field import GraphicsMemoryError

# Keys that, with Ctrl too, go through a list or a menu, choose in it and close it, or would take away what lies below.
IN_LISTS = ("enter", "space", "up", "down", "left", "right", "home", "end", "tab", "escape", "delete", "backspace")
AWAITING = 0.02  # seconds between two looks at whether a frame of a clip has been decoded
TOLD = 2  # frames after a click or a key that may begin or end typing, in which imgui tells whether text is typed


class Editor:
    """The whole window but for the window itself: makes its parts, which do not know it, and frees them.

    Args:
        device: the GL of the window, or a headless one.
        project: what is open first.
        preferences: what the person likes.
        journals: the folder in which unsaved work outlasts a crash; None keeps nothing, for tests.
    """

    def __init__(
        self,
        device: Device,
        project: Project,
        preferences: Preferences | None = None,
        journals: Path | None = None,
    ) -> None:
        self.preferences = likes = preferences or Preferences()
        self.state = EditorState.recalled(likes)
        self.keys = Keymap(ACTIONS.values(), likes.keys, likes.save)
        self._device = device
        self.backend = ImGuiBackend(device)
        self.ui = Ui(theme.PALETTES[likes.theme], self.backend.fonts, likes.scale, chord=self.keys.now)
        self.layout = self._layout(1280, 800)
        self.clock = Clock()
        self.numbers = Numbers()
        self.messages = Messages(self.clock.stir)
        self.dialogs = Dialogs(self.clock.stir)
        self.chooser = FileChooser(self.dialogs, self.messages)
        self.journals = Journals(journals, self.messages)
        self.workspace = Workspace(device, self.journals, Viewport(self.layout.canvas, (1, 1)))
        self.fits = Fits(self.workspace, self.messages)
        self.files = Files(
            self.workspace, self.chooser, self.dialogs, self.messages, likes, self.open, self.fits.start_with
        )
        self.exports = Exports(self.messages)
        self.cautions = Cautions(self.workspace, self.messages)
        self.rehearsal = Rehearsal(self.workspace)
        self.quality = Quality(
            self.workspace, self.state, self.files, self.exports, self.fits, self.messages, self.rehearsal
        )
        self.recovery = Recovery(self.journals, self.dialogs, self.messages, self.files.restore)
        self.selecting = Selecting(self.workspace, self.state, self.messages)
        self.pointer = PointerController(
            self.workspace,
            self.state,
            self.ui,
            self.dialogs,
            likes,
            self.selecting,
            lambda chord: self._key("space", chord if self.keys.action(chord) else "space"),
        )
        self.commands = Commands(
            workspace=self.workspace, state=self.state, pointer=self.pointer, files=self.files, chooser=self.chooser,
            exports=self.exports, fits=self.fits, dialogs=self.dialogs, messages=self.messages, preferences=likes,
            selecting=self.selecting, keys=self.keys,
        )  # fmt: skip
        self._styled: tuple[object, ...] = ()
        self._once_typed: list[str] = []  # actions that wait until what is being typed has been taken
        self._later: list[Event] = []  # what the next frame hears first
        self._clicked = self._typed = False  # off the canvas, and into a field: imgui has not taken it up
        self._known = TOLD  # frames for which it has been known whether text is being typed
        self.open(project)

    @property
    def session(self) -> Session:
        """The work that is open."""
        return self.workspace.session

    @property
    def canvas(self) -> Canvas:
        return self.workspace.canvas

    @property
    def view(self) -> Viewport:
        return self.workspace.view

    @property
    def title(self) -> str:
        return f"{self.session.project.name}{' *' if self.workspace.is_dirty else ''} - fluidwarp"

    def open(self, project: Project, pixels: np.ndarray | None = None, found: Found | None = None) -> None:
        """Work on another project; see `Workspace.open`."""
        self.workspace.open(project, pixels, found)
        self.state.suit(self.session.recipe.fluid_at(self.session.target))
        self.quality.opened(found)
        self.clock.stir()

    def do(self, name: str) -> None:
        """Do one of the actions."""
        try:
            ACTIONS[name].run(self.commands)
        except UserError as error:
            self.messages.warn(error.in_window)

    def release(self) -> None:
        """Free everything."""
        self.exports.cancel()
        self.fits.give_up()
        self.files.give_up_loading()
        self.remember()
        self.recovery.later()
        self.journals.release(discard=self.commands.closed)
        self.dialogs.release()
        self.quality.release()
        self.rehearsal.release()
        self.workspace.release()
        self.backend.release()

    def remember(self) -> None:
        """Keep for the next time what the person has set of the window and of the brushes."""
        self.state.remember(self.preferences)
        self.preferences.save()

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
        events = self._heard(events)
        self.workspace.release_left()
        self.clock.elapse(dt)
        if events:
            self.messages.see()
        self.messages.elapse(dt)
        self.pointer.elapse(dt)
        with self.clock.measure("frame"):
            self._lay_out((size[0] / density, size[1] / density), density, scale)
            takes_keys = self.dialogs.is_listening
            self._handle(events)
            if takes_keys:
                events = [event for event in events if not (isinstance(event, Text) or _is_press(event))]
            self.workspace.keep()
            with self.clock.measure("simulate"):
                self._advance(dt)
            for said in self.workspace.work.look():
                self.messages.warn(said)
            self.quality.look(dt)
            self.selecting.look()
            self.canvas.thumbnails.look(self.session)
            self._draw(target, size, dt, events)
            self.workspace.keep()
        if self.quality.is_measuring:
            self.quality.warm_up(begun)
        elif self._is_rehearsing:
            self.rehearsal.go_on()

    def wants_frame(self) -> bool:
        """True while something moves by itself."""
        busy = self.quality.is_measuring or self.quality.is_preparing or self._is_rehearsing
        waits = self.backend.is_behind or bool(self._later or self._once_typed)
        return busy or waits or self.session.is_moving or self.clock.settling or self.canvas.is_unfinished

    @property
    def _is_rehearsing(self) -> bool:
        """There is time for what the person will do."""
        elsewhere = self.exports.is_running or self.fits.is_running or self.files.is_loading
        return self.rehearsal.is_wanted and not (elsewhere or self.quality.is_preparing)

    def wait(self) -> float:
        """Seconds that may pass before the next frame if no event comes."""
        if self.wants_frame():
            return 0.0
        if self.clock.hovering and self.backend.is_hovering:
            return PACE
        if self.workspace.work.awaits_frame:
            return AWAITING
        # What goes on elsewhere is looked at now and then: frames would only take the processor from it.
        working = self.exports.is_running or self.fits.is_running
        elsewhere = working or self.chooser.is_waiting or self.files.is_loading or self.recovery.is_busy
        if elsewhere or self.dialogs.is_busy or self.selecting.is_busy:
            return 0.1
        return min(self.messages.next_in or 60.0, 60.0)

    def _heard(self, events: Sequence[Event]) -> list[Event]:
        """What this frame hears: keys and presses on the canvas wait, with what comes after them, for imgui.

        A key waits until imgui can tell whether it is text; both until what was clicked on before has acted; presses
        until what was typed before has. On a slow machine a click into a field, what is typed there, and the key of an
        action come all at once, and so do the click on a tool, a size for it, and the stroke that is drawn with it.
        """
        heard, self._later = [*self._later, *events], []
        self._clicked &= self.backend.is_behind
        self._typed &= self.backend.is_behind
        at = self.pointer.x, self.pointer.y
        for number, event in enumerate(heard):
            match event:
                case Move(x, y):
                    at = x, y
                case Text() | Key(down=True) if self._known < TOLD or self._clicked:
                    heard, self._later = heard[:number], heard[number:]
                    break
                case Button(down=True) if (self._clicked or self._typed) and self.pointer.reaches_canvas(*at):
                    heard, self._later = heard[:number], heard[number:]
                    break
                case Button(down=down):
                    self._clicked |= not self.pointer.reaches_canvas(*at)
                    self._known = 0 if down else self._known
                # imgui hears no repeats; those of a key that is held would pile up behind one another.
                case Key("enter" | "escape" | "tab", True, repeat=False):
                    self._known = 0
                case Key(key, True, mods) if self.backend.is_typing and self._leaves_a_field(mods.chord(key)):
                    self._known = 0
            self._typed |= self.backend.is_typing and isinstance(event, Text | Key)
        if not self.backend.is_behind:  # else it has not yet taken up the click
            self._known += 1
        return heard

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
        self.state.fit_brushes(self.canvas.size)
        self.workspace.view = replace(self.view, canvas=self.layout.canvas, density=density)

    def _layout(self, width: float, height: float) -> Layout:
        state = self.state
        state.is_narrow = width < NARROW * self.ui.scale
        is_open = state.over_narrow if state.is_narrow else state.inspector
        names, groups = self.preferences.names, len(strip.GROUP_ENDS) + 1
        lanes_height = state.lanes.height if state.lanes.shown else 0.0
        return Layout.of(width, height, self.ui.scale, is_open, len(TOOLS), groups, names, lanes_height)

    def _advance(self, dt: float) -> None:
        if self.rehearsal.is_needed:
            self.rehearsal.go_on()
            return
        ticks = self.clock.ticks(dt, self.session.dt, self.session.is_moving)
        self._attempt(lambda: self.session.advance(ticks), self.messages.warn)

    def _handle(self, events: Sequence[Event]) -> None:
        for event in events:
            self.clock.stir()
            # What the hand tries in vain is no state of the work, that somebody would have to take note of.
            tell = self.messages.caution if isinstance(event, (Button, Move)) else self.messages.warn
            self._attempt(partial(self._handle_one, event), tell)

    def _attempt(self, act: Callable[[], None], tell: Callable[[str], None]) -> None:
        """Do `act`, and `tell` what hinders it; a full graphics memory makes room."""
        is_full = False
        try:
            act()
        except UserError as error:
            tell(error.in_window)
        except GraphicsMemoryError:
            is_full = True  # room is made below, as the error itself holds what was half made
        if is_full:
            self.messages.warn(self.session.make_room())

    def _handle_one(self, event: Event) -> None:
        match event:
            case Key(key, down, mods, repeat):
                if key == "\\":
                    self.state.before = down and not self.backend.is_typing
                if down and self.dialogs.shown:
                    if key and not repeat:
                        self.dialogs.shown[-1].hear(mods.chord(key))
                elif down and self.ui.has_popup and (key in IN_LISTS or not mods.ctrl):
                    return
                elif down and key != "space":  # which is also held to pan, so that it acts only once it is let go
                    self._key(key, mods.chord(key), repeat)
                if not self.dialogs.shown and not self.backend.is_typing:
                    self.pointer.handle(event)
            case Move() | Button() | Wheel():
                self.pointer.handle(event)
            case Focus(False):
                self.pointer.release_all()
                self.state.before = False
                self.remember()
            # A dialog is about the work that is open, and is answered before there is another one.
            case Drop(paths) if paths and not self.dialogs.shown:
                self.files.open(*map(Path, paths))
            case CloseWish():
                self.do("quit")

    def _key(self, key: str, chord: str, repeat: bool = False) -> None:
        name = self.keys.action(chord) or (self.keys.action(key) if key in "{}+=" else None)
        action = ACTIONS[name] if name else None
        if action is None or (repeat and not action.repeats):
            return
        if not self.backend.is_typing:
            self.do(action.name)
        elif self._leaves_a_field(chord):
            self._once_typed.append(action.name)

    def _leaves_a_field(self, chord: str) -> bool:
        """Whether its action is about files, and done while something is typed too, which is taken first."""
        name = self.keys.action(chord)
        return name is not None and ACTIONS[name].group == "File"

    def _draw(self, target: moderngl.Framebuffer, size: tuple[int, int], dt: float, events: Sequence[Event]) -> None:
        target.viewport = (0, 0, *size)
        # Clearing is many times cheaper than the same rectangles drawn by imgui, which blends every pixel.
        target.clear(*self.ui.palette.panel)
        self._device.fences.hold()
        # Where handles are is read back, which waits for all that is being drawn: so before the canvas, with which a
        # software rasteriser goes on while the panels are made.
        _ = self.session.marks
        with self.clock.measure("canvas"):
            self.canvas.draw(target, size[1], self.view, self.session, self.state, self.ui.palette, self.ui.scale)
        by_keys = bool(self.dialogs.shown) or self.ui.has_popup
        # What is typed in this frame the field takes only as it is drawn.
        is_typed = self.backend.is_behind or any(isinstance(event, Key | Text) for event in events)
        has_typed = bool(self._once_typed) and not is_typed
        self.backend.begin((size[0] / self.ui.density, size[1] / self.ui.density), self.ui.density, dt, events, by_keys)
        if has_typed:
            # The field is left, as if by Enter, so that what was typed is taken before it is saved.
            internal.clear_active_id()
        try:
            with self.clock.measure("panels"):
                self._draw_panels()
                self._draw_over_canvas()
            if has_typed:
                names, self._once_typed = self._once_typed, []
                for name in names:
                    self.do(name)
        except UserError as error:
            self.messages.warn(error.in_window)
        self.ui.end_frame()
        with self.clock.measure("interface"):
            self.backend.end(target)

    def _draw_panels(self) -> None:
        ui, layout, workspace, state, likes = self.ui, self.layout, self.workspace, self.state, self.preferences
        marks.draw(ui, self.view, self.session, state, self.pointer, self.selecting.outline)
        busy = self.exports.is_running or self.fits.is_running or self.files.is_loading
        back = self.pointer.is_opposite
        hud.draw(ui, workspace, state, self.selecting, likes, self.numbers, self.clock, self.do, busy, back)
        strip.draw(ui, layout, state)
        if layout.inspector is not None:
            inspector.draw(ui, layout.inspector, workspace, state, self.selecting, self.quality, self.clock, self.do)
        if layout.lanes is not None:
            lanes.draw(ui, layout.lanes, self.session, state, self.do)
        timebar.draw(ui, layout.timebar, self.session, state, self.do)
        bar.draw(ui, layout, workspace, state, likes, self.files.open_work, self.do)

    def _draw_over_canvas(self) -> None:
        """What tells of work under way, messages and dialogs."""
        if (session := self.session).notice:
            before = session.retracted
            self.messages.say(session.notice, lambda: session.retracted == before)
            session.notice = None
        self.cautions.look()
        self.exports.draw(self.ui, self.layout.canvas)
        self.fits.draw(self.ui, self.layout.canvas)
        self.files.draw(self.ui, self.layout.canvas)
        self.messages.draw(self.ui, self.layout.canvas)
        self.files.poll()
        self.chooser.poll()
        self.recovery.poll()
        self.dialogs.draw(self.ui)


def _is_press(event: Event) -> bool:
    return isinstance(event, Key) and event.down

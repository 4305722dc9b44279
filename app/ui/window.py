"""The window: the only place that knows glfw. It turns callbacks into events, and hands the editor a framebuffer."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

import glfw
import moderngl

from app.errors import UserError
from app.media.numbered import is_sequence
from app.progress import interruptible, never
from app.ui.editor import Editor
from app.ui.events import Button, CloseWish, Drop, Event, Focus, Key, Mods, Move, Text, Wheel
from app.ui.files import load_any
from app.ui.preferences import Preferences
from app.work.recovery import default_folder
from solver.gl.device import Device

TITLE = "fluidwarp"
SIZE = (1280, 800)
SMALLEST = (800, 520)
GRASP = 24  # of a window's height, that has to be on a screen for it to be got hold of
FASTEST = 1 / 120  # seconds between two frames where the screen does not set the pace
NO_DISPLAY = 2

_NAMED = {
    glfw.KEY_SPACE: "space", glfw.KEY_ESCAPE: "escape", glfw.KEY_ENTER: "enter", glfw.KEY_KP_ENTER: "enter",
    glfw.KEY_TAB: "tab", glfw.KEY_BACKSPACE: "backspace", glfw.KEY_DELETE: "delete", glfw.KEY_LEFT: "left",
    glfw.KEY_RIGHT: "right", glfw.KEY_UP: "up", glfw.KEY_DOWN: "down", glfw.KEY_HOME: "home", glfw.KEY_END: "end",
    glfw.KEY_PAGE_UP: "pageup", glfw.KEY_PAGE_DOWN: "pagedown",
} | {getattr(glfw, f"KEY_F{number}"): f"f{number}" for number in range(1, 13)}  # fmt: skip
_CURSORS = {
    "arrow": glfw.ARROW_CURSOR, "hand": glfw.HAND_CURSOR, "crosshair": glfw.CROSSHAIR_CURSOR,
    "resize_ew": glfw.HRESIZE_CURSOR, "text": glfw.IBEAM_CURSOR,
}  # fmt: skip


class _Loader:
    """How moderngl finds the functions of the GL that glfw has made current."""

    def load_opengl_function(self, name: str) -> Any:
        return glfw.get_proc_address(name) or 0

    def __enter__(self) -> None:
        pass

    def __exit__(self, *_: object) -> None:
        pass

    def release(self) -> None:
        pass


class GlfwWindow:
    """A window of the system with a GL, and the events that happen in it.

    Args:
        place: left, top, width and height as `place` told them last, and whether it filled the screen; or nothing.
    """

    def __init__(self, place: Sequence[int] = ()) -> None:
        # Errors are read where they matter; glfw's warnings about them would only be noise.
        glfw.ERROR_REPORTING = False
        if not glfw.init():
            raise UserError(_why(), NO_DISPLAY)
        glfw.window_hint(glfw.CONTEXT_VERSION_MAJOR, 3)
        glfw.window_hint(glfw.CONTEXT_VERSION_MINOR, 3)
        glfw.window_hint(glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE)
        glfw.window_hint(glfw.OPENGL_FORWARD_COMPAT, True)
        glfw.window_hint(glfw.SCALE_TO_MONITOR, True)
        glfw.window_hint(glfw.VISIBLE, False)  # until it has its size and place
        glfw.window_hint(glfw.SAMPLES, 0)
        glfw.window_hint(glfw.DEPTH_BITS, 0)
        glfw.window_hint_string(glfw.X11_CLASS_NAME, TITLE)
        self.handle = glfw.create_window(*_fitting(SIZE), TITLE, None, None)
        if not self.handle:
            why = _why()
            glfw.terminate()
            raise UserError(why, NO_DISPLAY)
        glfw.make_context_current(self.handle)
        glfw.swap_interval(1)
        # On a screen of 200 % it has become twice as large.
        glfw.set_window_size(self.handle, *_fitting(glfw.get_window_size(self.handle)))
        smallest = _fitting((round(SMALLEST[0] * self.scale), round(SMALLEST[1] * self.scale)))
        glfw.set_window_size_limits(self.handle, *smallest, glfw.DONT_CARE, glfw.DONT_CARE)
        self._go_to(place)
        glfw.show_window(self.handle)
        self.events: list[Event] = []
        self._held = Mods()
        self._title = TITLE
        self._cursor = "arrow"
        self._cursors: dict[str, Any] = {}
        self._must_draw = True
        self._listen()
        loader: Any = _Loader()
        self.device = Device(moderngl.create_context(require=330, context=loader))

    # -- what the editor is given -----------------------------------------------------------------------------------

    @property
    def size(self) -> tuple[int, int]:
        """In pixels."""
        return glfw.get_framebuffer_size(self.handle)

    @property
    def density(self) -> float:
        """Pixels a point of the pointer's coordinates."""
        points = glfw.get_window_size(self.handle)
        return max(self.size[0], 1) / max(points[0], 1)

    @property
    def scale(self) -> float:
        """Of the interface, in points."""
        return max(glfw.get_window_content_scale(self.handle)[0] / self.density, 0.5)

    @property
    def place(self) -> list[int]:
        """Left, top, width and height, and whether it fills the screen; nothing while it is minimised."""
        if glfw.get_window_attrib(self.handle, glfw.ICONIFIED):
            return []
        fills = glfw.get_window_attrib(self.handle, glfw.MAXIMIZED)
        return [*glfw.get_window_pos(self.handle), *glfw.get_window_size(self.handle), fills]

    def _go_to(self, place: Sequence[int]) -> None:
        """Be where the window was the last time, as far as a screen is there still."""
        if not place:
            return
        left, top, width, height, fills = place
        for monitor in glfw.get_monitors():
            x, y, across, down = glfw.get_monitor_workarea(monitor)
            if x <= left + width / 2 < x + across and y <= top + GRASP <= y + down:
                if fills:
                    glfw.maximize_window(self.handle)
                else:
                    glfw.set_window_size(self.handle, min(width, across), min(height, down))
                    glfw.set_window_pos(self.handle, left, max(top, y))
                return

    def show(self, editor: Editor, cancel: Callable[[], bool] = never) -> None:
        """Run the editor until the person leaves, or `cancel` says so."""
        last = time.perf_counter()
        editor.commands.clipboard = lambda text: glfw.set_clipboard_string(self.handle, text)
        editor.chooser.native = True
        editor.rehearsal.has_news = self._has_news
        screen = self.device.ctx.detect_framebuffer(0)
        while not (editor.commands.closed or cancel()):
            self._wait(editor, cancel)
            if glfw.get_window_attrib(self.handle, glfw.ICONIFIED):
                if any(isinstance(event, CloseWish) for event in self.events):
                    if editor.commands.asks_before_quitting:
                        glfw.restore_window(self.handle)
                elif not editor.dialogs.is_busy:
                    # What has happened waits too.
                    glfw.wait_events_timeout(0.1)
                    continue
            events, self.events = self.events, []
            now = time.perf_counter()
            dt, last = now - last, now
            editor.frame(screen, self.size, dt, events, self.density, self.scale)
            self._must_draw = False
            self._show_title(editor)
            self._show_cursor(editor.pointer.cursor)
            glfw.swap_buffers(self.handle)
            spare = FASTEST - (time.perf_counter() - now)
            if spare > 0:
                time.sleep(spare)

    def close(self) -> None:
        """Close the window; its GL goes with it, and what Python still holds of that must not be touched any more."""
        context: Any = self.device.ctx
        context.gc_mode = None
        glfw.destroy_window(self.handle)
        glfw.terminate()

    # -- what happens in it -----------------------------------------------------------------------------------------

    def _wait(self, editor: Editor, cancel: Callable[[], bool]) -> None:
        """Wait until there is something to draw."""
        glfw.poll_events()
        started = time.perf_counter()
        while not (self.events or self._must_draw or cancel()):
            left = editor.wait() - (time.perf_counter() - started)
            if left <= 0:
                return
            glfw.wait_events_timeout(min(left, 1.0))

    def _has_news(self) -> bool:
        """Something has been pressed, or let go, since the frame that is being drawn began."""
        glfw.poll_events()
        return any(
            not (isinstance(event, (Move, Focus)) or (isinstance(event, Key) and event.repeat)) for event in self.events
        )

    def _listen(self) -> None:
        handle = self.handle
        glfw.set_cursor_pos_callback(handle, lambda _, x, y: self._add(Move(x, y, 1.0, self._held)))
        glfw.set_cursor_enter_callback(handle, lambda _, inside: None if inside else self._left())
        glfw.set_mouse_button_callback(handle, self._button)
        glfw.set_scroll_callback(handle, lambda _, dx, dy: self._add(Wheel(dx, dy, self._held)))
        glfw.set_key_callback(handle, self._key)
        glfw.set_char_callback(handle, lambda _, code: self._add(Text(chr(code))))
        on_drop: Any = lambda _, paths: self._add(Drop(tuple(paths)))  # noqa: E731
        glfw.set_drop_callback(handle, on_drop)
        glfw.set_window_focus_callback(handle, lambda _, focused: self._add(Focus(bool(focused))))
        glfw.set_window_close_callback(handle, self._close_wish)
        glfw.set_framebuffer_size_callback(handle, lambda *_: self._redraw())
        glfw.set_window_refresh_callback(handle, lambda *_: self._redraw())

    def _add(self, event: Event) -> None:
        self.events.append(event)

    def _redraw(self) -> None:
        self._must_draw = True

    def _left(self) -> None:
        """The pointer left the window; a drag goes on outside."""
        if not any(glfw.get_mouse_button(self.handle, button) for button in range(3)):
            self._add(Move(-1e4, -1e4))

    def _close_wish(self, handle: Any) -> None:
        glfw.set_window_should_close(handle, False)
        self._add(CloseWish())

    def _button(self, handle: Any, button: int, action: int, mods: int) -> None:
        if button <= glfw.MOUSE_BUTTON_MIDDLE:
            self._held = _mods(mods)
            self._add(Button(button, action == glfw.PRESS, self._held))

    def _key(self, handle: Any, key: int, code: int, action: int, mods: int) -> None:
        # Digits are where they are, whatever the layout prints on them; all other keys are what they print.
        digit = chr(key) if glfw.KEY_0 <= key <= glfw.KEY_9 else None
        name = _NAMED.get(key) or digit or glfw.get_key_name(key, code)
        # A modifier's own event does not yet, or does still, have it among the modifiers.
        self._held = _with_own(_mods(mods), key, action)
        if name:
            self._add(Key(name.lower(), action != glfw.RELEASE, self._held, action == glfw.REPEAT))
        else:
            self._add(Key("", action != glfw.RELEASE, self._held))

    def _show_title(self, editor: Editor) -> None:
        if editor.title != self._title:
            self._title = editor.title
            glfw.set_window_title(self.handle, self._title)

    def _show_cursor(self, name: str) -> None:
        if name == self._cursor:
            return
        self._cursor = name
        if name not in self._cursors:
            # Not GLFW's hidden mode: whenever a mode is set, GLFW asks where the pointer is by now, and then leaves out
            # the move to there, which comes after what has happened on the way.
            nothing: Any = 1, 1, [[(0, 0, 0, 0)]]  # of a pixel
            made = glfw.create_cursor(nothing, 0, 0) if name == "none" else glfw.create_standard_cursor(_CURSORS[name])
            self._cursors[name] = made
        glfw.set_cursor(self.handle, self._cursors[name])


def run(file: Path | None = None) -> None:
    """Open the editor with the sample picture, and on it, as if it had been dropped there, a file.

    Raises:
        UserError: if there is no window to be had (status 2), or no such file.
        KeyboardInterrupt: after Ctrl+C and the like; what was not saved is kept for the next start.
    """
    if file is not None and not (os.path.exists(file) or is_sequence(file)):
        load_any(file)
    likes = Preferences.load()
    with interruptible() as cancel:  # an exception in the middle of a callback of the window's would be lost
        window = GlfwWindow(likes.window)
        try:
            editor = Editor(window.device, load_any(sample()), likes, default_folder())
            if file is not None:
                editor.workspace.placeholder = editor.session
                window.events.append(Drop((str(file),)))
            try:
                window.show(editor, cancel)
            finally:
                likes.window = window.place or likes.window
                editor.release()
        finally:
            window.close()
        if cancel():
            raise KeyboardInterrupt


def sample() -> Path:
    """The picture the editor opens with."""
    return Path(str(resources.files("assets"))) / "sample.webp"


def _mods(bits: int) -> Mods:
    ctrl = glfw.MOD_SUPER if sys.platform == "darwin" else glfw.MOD_CONTROL
    return Mods(bool(bits & ctrl), bool(bits & glfw.MOD_SHIFT), bool(bits & glfw.MOD_ALT))


def _with_own(mods: Mods, key: int, action: int) -> Mods:
    down = action != glfw.RELEASE
    own = {
        glfw.KEY_LEFT_ALT: "alt", glfw.KEY_RIGHT_ALT: "alt", glfw.KEY_LEFT_SHIFT: "shift",
        glfw.KEY_RIGHT_SHIFT: "shift", glfw.KEY_LEFT_CONTROL: "ctrl", glfw.KEY_RIGHT_CONTROL: "ctrl",
    }.get(key)  # fmt: skip
    return replace(mods, **{own: down}) if own else mods


def _fitting(size: tuple[int, int]) -> tuple[int, int]:
    """The size, or what of it the screen has room for."""
    monitor = glfw.get_primary_monitor()
    if not monitor:
        return size
    _, _, width, height = glfw.get_monitor_workarea(monitor)
    return min(size[0], width or size[0]), min(size[1], height or size[1])


def _why() -> str:
    """Why there is no window, and what to do instead."""
    _, words = glfw.get_error()
    text = words.decode("utf-8", "replace") if isinstance(words, bytes) else str(words or "no reason given")
    text = text.removeprefix("X11: ").removeprefix("GLX: ").removeprefix("Wayland: ")
    return (
        f"no window can be opened here ({text}). `fluidwarp render RECIPE PICTURE -o OUT.png` works without one; "
        "`fluidwarp doctor` says what is missing."
    )

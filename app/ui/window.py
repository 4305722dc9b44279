"""The window: it hands the editor events and a framebuffer. With `callbacks.py` the only place that knows glfw."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import glfw
import moderngl

from app.errors import UserError
from app.media.numbered import is_sequence
from app.progress import interruptible, never
from app.ui.callbacks import Callbacks
from app.ui.editor import Editor
from app.ui.events import CloseWish, Drop
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
        self.heard = Callbacks()
        self._title = TITLE
        self._cursor = "arrow"
        self._cursors: dict[str, Any] = {}
        self._must_draw = True
        self.heard.listen(self.handle)
        glfw.set_framebuffer_size_callback(self.handle, lambda *_: self._redraw())
        glfw.set_window_refresh_callback(self.handle, lambda *_: self._redraw())
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
        screens = [glfw.get_monitor_workarea(monitor) for monitor in glfw.get_monitors()]
        if (at := placed(place, screens)) is None:
            return
        left, top, width, height, fills = at
        if fills:
            glfw.maximize_window(self.handle)
        else:
            glfw.set_window_size(self.handle, width, height)
            glfw.set_window_pos(self.handle, left, top)

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
                if any(isinstance(event, CloseWish) for event in self.heard.events):
                    if editor.commands.asks_before_quitting:
                        glfw.restore_window(self.handle)
                elif not editor.dialogs.is_busy:
                    # What has happened waits too.
                    glfw.wait_events_timeout(0.1)
                    continue
            now = time.perf_counter()
            dt, last = now - last, now
            editor.frame(screen, self.size, dt, self.heard.take(), self.density, self.scale)
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
        while not (self.heard.events or self._must_draw or cancel()):
            left = editor.wait() - (time.perf_counter() - started)
            if left <= 0:
                return
            glfw.wait_events_timeout(min(left, 1.0))

    def _has_news(self) -> bool:
        """Something has been pressed, or let go, since the frame that is being drawn began."""
        glfw.poll_events()
        return self.heard.are_news

    def _redraw(self) -> None:
        self._must_draw = True

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
                window.heard.add(Drop((str(file),)))
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


def placed(place: Sequence[int], screens: Iterable[Sequence[int]]) -> list[int] | None:
    """Where a window can be got hold of that was at `place`; None if no screen is there any more, or it was nowhere.

    Args:
        place: left, top, width, height, and whether it filled the screen.
        screens: left, top, width and height of what each has room for.
    """
    if not place:
        return None
    left, top, width, height, fills = place
    for x, y, across, down in screens:
        if x <= left + width / 2 < x + across and y <= top + GRASP <= y + down:
            return [left, max(top, y), min(width, across), min(height, down), fills]
    return None


def _fitting(size: tuple[int, int]) -> tuple[int, int]:
    """The size, or what of it the screen has room for."""
    monitor = glfw.get_primary_monitor()
    return fitting(size, glfw.get_monitor_workarea(monitor)) if monitor else size


def fitting(size: tuple[int, int], screen: Sequence[int]) -> tuple[int, int]:
    """The size, or what of it a screen (left, top, width, height) has room for; one that says nothing has all."""
    _, _, width, height = screen
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

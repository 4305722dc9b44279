"""imgui on a GL context: fed with our events, drawn into any framebuffer."""

from __future__ import annotations

from collections.abc import Iterable

import moderngl
from imgui_bundle import imgui

from app.ui import theme
from app.ui.clock import TWICE
from app.ui.events import Button, Event, Focus, Key, Mods, Move, Text, Wheel
from solver.gl.device import Device

_NAMED = {
    "left": imgui.Key.left_arrow, "right": imgui.Key.right_arrow, "up": imgui.Key.up_arrow,
    "down": imgui.Key.down_arrow, "enter": imgui.Key.enter, "escape": imgui.Key.escape, "tab": imgui.Key.tab,
    "backspace": imgui.Key.backspace, "delete": imgui.Key.delete, "home": imgui.Key.home, "end": imgui.Key.end,
    "pageup": imgui.Key.page_up, "pagedown": imgui.Key.page_down, "space": imgui.Key.space,
}  # fmt: skip
_LETTERS = {letter: getattr(imgui.Key, letter) for letter in "acvxyz"}
_KEYS = _NAMED | _LETTERS


class ImGuiBackend:
    """The one imgui context of the process.

    Args:
        device: the GL it draws with; its context must be current.
    """

    def __init__(self, device: Device) -> None:
        self.device = device
        self._context = imgui.create_context()
        io = imgui.get_io()
        io.set_ini_filename("")
        # The second one, which nothing here goes by, has to be longer.
        io.mouse_double_click_time, io.mouse_single_click_delay = TWICE, 2 * TWICE
        # An exception in the middle of a frame must end in a message, not in an assertion about a missing End().
        io.config_error_recovery_enable_assert = False
        io.config_error_recovery_enable_tooltip = False
        io.config_nav_cursor_visible_auto = True
        # At rest nothing is drawn, and a cursor that blinks might rest while it is not to be seen.
        io.config_input_text_cursor_blink = False
        self._down: set[imgui.Key] = set()
        self._mods = Mods()
        self._later: list[Event] = []
        self._owed = 0.0  # seconds that have gone by while events waited
        self.fonts = theme.load_fonts()
        imgui.backends.opengl3_init("#version 330")

    @property
    def is_typing(self) -> bool:
        """Text is being typed into a field, as of the last frame."""
        return imgui.get_io().want_text_input

    @property
    def is_hovering(self) -> bool:
        """The pointer is on something, of which more may be shown if it rests there, as of the last frame."""
        return imgui.is_any_item_hovered() or bool(self._context.hover_item_delay_id)

    @property
    def is_behind(self) -> bool:
        """Events wait for later frames: imgui takes up one change of a key or a button in each."""
        return bool(self._later) or self._context.input_events_queue.size() > 0

    def begin(
        self, size: tuple[float, float], density: float, dt: float, events: Iterable[Event], by_keys: bool = False
    ) -> None:
        """Start a frame of `size` points with `density` pixels each; `by_keys`: Tab and arrows go through widgets."""
        io = imgui.get_io()
        # Only in dialogs and menus: elsewhere Space, Tab and the arrows are the editor's.
        through = imgui.ConfigFlags_.nav_enable_keyboard.value
        io.config_flags = io.config_flags | through if by_keys else io.config_flags & ~through
        # imgui goes through number fields by Tab without that flag too; it may from one that is being typed in.
        if not (by_keys or io.want_text_input):
            events = [event for event in events if not (isinstance(event, Key) and event.key == "tab")]
        io.display_size = imgui.ImVec2(*size)
        io.display_framebuffer_scale = imgui.ImVec2(density, density)
        # What waits came before this frame's time went by: however slow frames are, a double click stays one.
        self._owed, dt = (self._owed + dt, 0.0) if self.is_behind else (0.0, self._owed + dt)
        io.delta_time = max(dt, 1e-4)
        self._later += events
        # What is dragged does not follow in the frame in which it is let go of: the last way takes a frame of its own.
        moved = self._context.input_events_queue.size() > 0
        while self._later:
            event = self._later[0]
            if moved and isinstance(event, Button) and not event.down:
                break
            moved = moved or isinstance(event, Move)
            self._feed(io, self._later.pop(0))
        imgui.backends.opengl3_new_frame()
        imgui.new_frame()

    def end(self, target: moderngl.Framebuffer) -> None:
        """Finish the frame and draw it over what `target` holds."""
        imgui.render()
        target.use()
        imgui.backends.opengl3_render_draw_data(imgui.get_draw_data())
        self.device.fences.hold()

    def release(self) -> None:
        imgui.backends.opengl3_shutdown()
        imgui.destroy_context(self._context)

    def _feed(self, io: imgui.IO, event: Event) -> None:
        match event:
            case Move(x, y):
                io.add_mouse_pos_event(x, y)
            case Button(button, down, mods):
                self._feed_mods(io, mods)
                io.add_mouse_button_event(button, down)
            case Wheel(dx, dy):
                io.add_mouse_wheel_event(dx, dy)
            case Key(key, down, mods):
                self._feed_mods(io, mods)
                if key in _KEYS:
                    io.add_key_event(_KEYS[key], down)
                    (self._down.add if down else self._down.discard)(_KEYS[key])
            case Text(text):
                io.add_input_characters_utf8(text)
            case Focus(focused):
                io.add_focus_event(focused)

    def _feed_mods(self, io: imgui.IO, mods: Mods) -> None:
        if mods != self._mods:
            # A key counts with the modifiers that it was pressed with. imgui would take those at the end of a frame, in
            # which Ctrl may have been let go of, or pressed for the next chord; it lets no key change twice in one.
            for key in self._down:
                io.add_key_event(key, False)
            self._down.clear()
            self._mods = mods
        io.add_key_event(imgui.Key.mod_ctrl, mods.ctrl)
        io.add_key_event(imgui.Key.mod_shift, mods.shift)
        io.add_key_event(imgui.Key.mod_alt, mods.alt)

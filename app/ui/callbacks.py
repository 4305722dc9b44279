"""What GLFW calls back, as the editor's events."""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import Any

import glfw

from app.ui.events import Button, CloseWish, Drop, Event, Focus, Key, Mods, Move, Text, Wheel

NAMED = {
    glfw.KEY_SPACE: "space", glfw.KEY_ESCAPE: "escape", glfw.KEY_ENTER: "enter", glfw.KEY_KP_ENTER: "enter",
    glfw.KEY_TAB: "tab", glfw.KEY_BACKSPACE: "backspace", glfw.KEY_DELETE: "delete", glfw.KEY_LEFT: "left",
    glfw.KEY_RIGHT: "right", glfw.KEY_UP: "up", glfw.KEY_DOWN: "down", glfw.KEY_HOME: "home", glfw.KEY_END: "end",
    glfw.KEY_PAGE_UP: "pageup", glfw.KEY_PAGE_DOWN: "pagedown",
} | {getattr(glfw, f"KEY_F{number}"): f"f{number}" for number in range(1, 13)}  # fmt: skip
CONTROL = glfw.MOD_CONTROL, glfw.KEY_LEFT_CONTROL, glfw.KEY_RIGHT_CONTROL
COMMAND = glfw.MOD_SUPER, glfw.KEY_LEFT_SUPER, glfw.KEY_RIGHT_SUPER


class Callbacks:
    """The events of a window, in their order.

    Attributes:
        events: those that have not been taken yet.
        held: the modifier keys that are held.
    """

    def __init__(self) -> None:
        self.events: list[Event] = []
        self.held = Mods()

    def listen(self, handle: Any) -> None:
        """Hear what happens in a window."""
        glfw.set_cursor_pos_callback(handle, lambda _, x, y: self.add(Move(x, y, 1.0, self.held)))
        glfw.set_cursor_enter_callback(handle, lambda _, inside: None if inside else self.left(_is_dragging(handle)))
        glfw.set_mouse_button_callback(handle, lambda _, button, action, bits: self.button(button, action, bits))
        glfw.set_scroll_callback(handle, lambda _, dx, dy: self.add(Wheel(dx, dy, self.held)))
        glfw.set_key_callback(
            handle, lambda _, key, code, action, bits: self.key(key, action, bits, glfw.get_key_name(key, code))
        )
        glfw.set_char_callback(handle, lambda _, code: self.add(Text(chr(code))))
        on_drop: Any = lambda _, paths: self.add(Drop(tuple(paths)))  # noqa: E731
        glfw.set_drop_callback(handle, on_drop)
        glfw.set_window_focus_callback(handle, lambda _, focused: self.add(Focus(bool(focused))))
        glfw.set_window_close_callback(handle, self._close_wish)

    def take(self) -> list[Event]:
        """What has happened since this was asked last."""
        events, self.events = self.events, []
        return events

    @property
    def are_news(self) -> bool:
        """Among the events something was pressed or let go, by hand, or fell on the window."""
        return any(
            not (isinstance(event, (Move, Focus)) or (isinstance(event, Key) and event.repeat)) for event in self.events
        )

    def add(self, event: Event) -> None:
        self.events.append(event)

    def left(self, is_dragging: bool) -> None:
        """The pointer left the window; a drag goes on outside."""
        if not is_dragging:
            self.add(Move(-1e4, -1e4))

    def button(self, button: int, action: int, bits: int) -> None:
        """One of the pointer's buttons, with the bits of the modifiers that are held."""
        if button <= glfw.MOUSE_BUTTON_MIDDLE:
            self.held = _mods(bits)
            self.add(Button(button, action == glfw.PRESS, self.held))

    def key(self, key: int, action: int, bits: int, printed: str | None = None) -> None:
        """A key, with the bits of the modifiers that are held, and what the layout prints on it."""
        # Digits are where they are, whatever the layout prints on them; all other keys are what they print.
        digit = chr(key) if glfw.KEY_0 <= key <= glfw.KEY_9 else None
        name = NAMED.get(key) or digit or printed
        # A modifier's own event does not yet, or does still, have it among the modifiers.
        self.held = _with_own(_mods(bits), key, action)
        if name:
            self.add(Key(name.lower(), action != glfw.RELEASE, self.held, action == glfw.REPEAT))
        else:
            self.add(Key("", action != glfw.RELEASE, self.held))

    def _close_wish(self, handle: Any) -> None:
        glfw.set_window_should_close(handle, False)
        self.add(CloseWish())


def _is_dragging(handle: Any) -> bool:
    return any(glfw.get_mouse_button(handle, button) for button in range(3))


def _mods(bits: int) -> Mods:
    return Mods(bool(bits & _control()[0]), bool(bits & glfw.MOD_SHIFT), bool(bits & glfw.MOD_ALT))


def _with_own(mods: Mods, key: int, action: int) -> Mods:
    own = {
        glfw.KEY_LEFT_ALT: "alt", glfw.KEY_RIGHT_ALT: "alt", glfw.KEY_LEFT_SHIFT: "shift",
        glfw.KEY_RIGHT_SHIFT: "shift", **dict.fromkeys(_control()[1:], "ctrl"),
    }.get(key)  # fmt: skip
    return replace(mods, **{own: action != glfw.RELEASE}) if own else mods


def _control() -> tuple[int, int, int]:
    """The bit and the keys of what is called ctrl: on macOS, Command."""
    return COMMAND if sys.platform == "darwin" else CONTROL

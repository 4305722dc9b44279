"""What GLFW calls back becomes the editor's events, by tables and without a screen."""

from __future__ import annotations

import re
import sys
from itertools import product
from typing import Any

import glfw
import pytest

from app.errors import UserError
from app.ui import window
from app.ui.actions import ACTIONS
from app.ui.events import LEFT, MIDDLE, RIGHT, Button, CloseWish, Drop, Event, Focus, Key, Mods, Move, Text, Wheel
from app.ui.window import GlfwWindow

NAMES = {
    "space": "SPACE", "escape": "ESCAPE", "enter": "ENTER KP_ENTER", "tab": "TAB", "backspace": "BACKSPACE",
    "delete": "DELETE", "left": "LEFT", "right": "RIGHT", "up": "UP", "down": "DOWN", "home": "HOME", "end": "END",
    "pageup": "PAGE_UP", "pagedown": "PAGE_DOWN",
} | {f"f{n}": f"F{n}" for n in range(1, 13)} | {str(digit): str(digit) for digit in range(10)}  # fmt: skip
OWN = {
    "LEFT_ALT": "alt", "RIGHT_ALT": "alt", "LEFT_SHIFT": "shift", "RIGHT_SHIFT": "shift", "LEFT_CONTROL": "ctrl",
    "RIGHT_CONTROL": "ctrl",
}  # fmt: skip
BITS = {"shift": glfw.MOD_SHIFT, "alt": glfw.MOD_ALT, "ctrl": glfw.MOD_CONTROL}
HELD = [dict(zip(BITS, held, strict=True)) for held in product((False, True), repeat=3)]

pytestmark = pytest.mark.skipif(sys.platform == "darwin", reason="Ctrl is the command key there")


def bits(held: dict[str, bool]) -> int:
    return sum(bit for name, bit in BITS.items() if held[name])


class System:
    """GLFW's constants, and its functions as notes of how they were called: a window without a screen."""

    def __init__(self) -> None:
        self.told: dict[str, list[tuple[Any, ...]]] = {}
        self.says: dict[str, Any] = {
            "get_key_name": lambda key, code: {glfw.KEY_Y: "Z", glfw.KEY_1: "&"}.get(key),
            "get_monitor_workarea": lambda monitor: AREAS[monitor],
            "get_window_size": lambda handle: (1280, 800),
            "get_framebuffer_size": lambda handle: (1280, 800),
            "get_window_content_scale": lambda handle: (1.0, 1.0),
            "get_primary_monitor": lambda: None,
            "get_monitors": lambda: list(AREAS)[:2],
            "get_mouse_button": lambda handle, button: glfw.RELEASE,
        }

    def __getattr__(self, name: str) -> Any:
        if name.isupper():
            return getattr(glfw, name)

        def called(*given: Any) -> Any:
            self.told.setdefault(name, []).append(given[1:])
            return self.says[name](*given) if name in self.says else True

        return called

    def call(self, what: str, *given: Any) -> None:
        """Call back what is called for an event."""
        self.told[f"set_{what}_callback"][-1][0](None, *given)


AREAS = {"one": (0, 30, 1000, 700), "two": (1000, 30, 1000, 700), "small": (0, 0, 1000, 900), "none": (0, 0, 0, 0)}


@pytest.fixture
def system(monkeypatch: pytest.MonkeyPatch) -> System:
    system = System()
    monkeypatch.setattr(window, "glfw", system)
    monkeypatch.setattr(window, "Device", lambda context: None)
    monkeypatch.setattr(window.moderngl, "create_context", lambda **given: None)
    return system


@pytest.fixture
def quiet(system: System) -> GlfwWindow:
    return GlfwWindow()


@pytest.mark.parametrize("held", HELD, ids=lambda held: "+".join(name for name in held if held[name]) or "none")
def test_each_key_has_its_name_and_the_modifiers_that_are_held(
    quiet: GlfwWindow, system: System, held: dict[str, bool]
) -> None:
    wanted = list[Event]()
    for name, keys in NAMES.items():
        for key in keys.split():
            for action in (glfw.PRESS, glfw.REPEAT, glfw.RELEASE):
                system.call("key", getattr(glfw, f"KEY_{key}"), 0, action, bits(held))
                wanted.append(Key(name, action != glfw.RELEASE, Mods(**held), action == glfw.REPEAT))
    system.call("key", glfw.KEY_Y, 0, glfw.PRESS, bits(held))
    wanted.append(Key("z", True, Mods(**held)))
    for key, own in OWN.items():
        for action in (glfw.PRESS, glfw.RELEASE):
            system.call("key", getattr(glfw, f"KEY_{key}"), 0, action, bits(held))
            wanted.append(Key("", action == glfw.PRESS, Mods(**held | {own: action == glfw.PRESS})))
    assert quiet.events == wanted


def test_all_keys_that_do_something_have_a_name() -> None:
    chords = {key.split("+")[-1] or "+" for action in ACTIONS.values() for key in action.keys}
    assert {key for key in chords if len(key) > 1} <= set(NAMES)


def test_three_buttons_are_heard_with_what_is_held_and_no_other(quiet: GlfwWindow, system: System) -> None:
    for button in range(8):
        for action, held in product((glfw.PRESS, glfw.RELEASE), HELD):
            system.call("mouse_button", button, action, bits(held))
    assert quiet.events == [
        Button(button, action == glfw.PRESS, Mods(**held))
        for button in (LEFT, RIGHT, MIDDLE)
        for action, held in product((glfw.PRESS, glfw.RELEASE), HELD)
    ]


@pytest.mark.parametrize("down", [None, 0, 1, 2])
def test_a_pointer_that_leaves_is_nowhere_unless_it_drags(quiet: GlfwWindow, system: System, down: int | None) -> None:
    system.says["get_mouse_button"] = lambda handle, button: glfw.PRESS if button == down else glfw.RELEASE
    system.call("cursor_enter", True)
    assert not quiet.events
    system.call("cursor_enter", False)
    assert len(quiet.events) == (down is None)
    if quiet.events:
        left = quiet.events[0]
        assert isinstance(left, Move)
        assert max(left.x, left.y) < 0


def test_all_else_that_happens_is_heard_with_what_is_held(quiet: GlfwWindow, system: System) -> None:
    system.call("key", glfw.KEY_LEFT_ALT, 0, glfw.PRESS, 0)
    system.call("cursor_pos", 3.0, 4.0)
    system.call("scroll", 1.0, -2.0)
    system.call("char", ord("a"))
    system.call("drop", ["a.png", "b.png"])
    system.call("window_focus", 0)
    system.call("window_close")
    held = Mods(alt=True)
    assert quiet.events[1:] == [
        Move(3.0, 4.0, 1.0, held), Wheel(1.0, -2.0, held), Text("a"), Drop(("a.png", "b.png")), Focus(False),
        CloseWish(),
    ]  # fmt: skip
    assert system.told["set_window_should_close"] == [(False,)]


PLACES = {
    "as it was": ([100, 50, 800, 600, 0], (800, 600), (100, 50), False),
    "larger than the screen": ([0, 40, 1900, 2000, 0], (1000, 700), (0, 40), False),
    "behind the bar at the top": ([100, 10, 800, 600, 0], (800, 600), (100, 30), False),
    "half beyond the left": ([-390, 50, 800, 600, 0], (800, 600), (-390, 50), False),
    "on the second screen": ([1200, 50, 400, 300, 0], (400, 300), (1200, 50), False),
    "it filled the screen": ([100, 50, 800, 600, 1], None, None, True),
    "beyond the left": ([-401, 50, 800, 600, 0], None, None, False),
    "beyond the right": ([1601, 50, 800, 600, 0], None, None, False),
    "below": ([100, 707, 800, 600, 0], None, None, False),
    "above": ([100, 5, 800, 600, 0], None, None, False),
    "nowhere": ([], None, None, False),
}
"""Where it was; size and place that it is given now, and whether it fills the screen."""


@pytest.mark.parametrize("name", PLACES)
def test_a_window_comes_back_where_a_screen_is_still(system: System, name: str) -> None:
    place, *wanted = PLACES[name]
    GlfwWindow(place)
    told = system.told
    size = told["set_window_size"][1:]  # the first is its own
    found = [size[0] if size else None, *told.get("set_window_pos", [None]), "maximize_window" in told]
    assert found == wanted


@pytest.mark.parametrize(("screen", "wanted"), [(None, (1280, 800)), ("small", (1000, 800)), ("none", (1280, 800))])
def test_a_window_is_no_larger_than_the_screen(system: System, screen: str | None, wanted: tuple[int, int]) -> None:
    system.says["get_primary_monitor"] = lambda: screen
    system.says["create_window"] = lambda *size: system.told.setdefault("made", []).append(size[:2]) or "window"
    GlfwWindow()
    assert (system.told["made"], system.told["set_window_size"]) == ([wanted], [wanted])


@pytest.mark.parametrize("words", [b"X11: no display", "GLX: no display", "Wayland: no display", b"no display"])
def test_why_there_is_no_window_is_told_without_the_library_s_words(system: System, words: str | bytes) -> None:
    system.says |= {"init": lambda: False, "get_error": lambda: (1, words)}
    with pytest.raises(UserError, match=re.escape("no window can be opened here (no display). ")):
        GlfwWindow()

"""What GLFW calls back becomes the editor's events, by tables and without a screen."""

from __future__ import annotations

import sys
from itertools import product
from typing import Any

import glfw
import pytest

from app.ui import window
from app.ui.actions import ACTIONS
from app.ui.events import LEFT, MIDDLE, RIGHT, Button, CloseWish, Event, Key, Mods, Move
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


@pytest.fixture
def quiet(monkeypatch: pytest.MonkeyPatch) -> Any:
    """A window's part that hears, of no window of the system; what a layout prints on a key is on none."""
    monkeypatch.setattr(glfw, "get_key_name", lambda key, code: {glfw.KEY_Y: "Z", glfw.KEY_1: "&"}.get(key))
    heard = object.__new__(GlfwWindow)
    heard.events, heard._held, heard.handle = list[Event](), Mods(), None
    return heard


@pytest.mark.parametrize("held", HELD, ids=lambda held: "+".join(name for name in held if held[name]) or "none")
def test_each_key_has_its_name_and_the_modifiers_that_are_held(quiet: Any, held: dict[str, bool]) -> None:
    wanted = list[Event]()
    for name, keys in NAMES.items():
        for key in keys.split():
            for action in (glfw.PRESS, glfw.REPEAT, glfw.RELEASE):
                quiet._key(None, getattr(glfw, f"KEY_{key}"), 0, action, bits(held))
                wanted.append(Key(name, action != glfw.RELEASE, Mods(**held), action == glfw.REPEAT))
    quiet._key(None, glfw.KEY_Y, 0, glfw.PRESS, bits(held))
    wanted.append(Key("z", True, Mods(**held)))
    for key, own in OWN.items():
        for action in (glfw.PRESS, glfw.RELEASE):
            quiet._key(None, getattr(glfw, f"KEY_{key}"), 0, action, bits(held))
            wanted.append(Key("", action == glfw.PRESS, Mods(**held | {own: action == glfw.PRESS})))
            assert quiet._held == wanted[-1].mods  # pyright: ignore[reportAttributeAccessIssue]
    assert quiet.events == wanted


def test_all_keys_that_do_something_have_a_name() -> None:
    chords = {key.split("+")[-1] or "+" for action in ACTIONS.values() for key in action.keys}
    assert {key for key in chords if len(key) > 1} <= set(NAMES)


def test_three_buttons_are_heard_with_what_is_held_and_no_other(quiet: Any) -> None:
    for button in range(8):
        for action, held in product((glfw.PRESS, glfw.RELEASE), HELD):
            quiet._button(None, button, action, bits(held))
    assert quiet.events == [
        Button(button, action == glfw.PRESS, Mods(**held))
        for button in (LEFT, RIGHT, MIDDLE)
        for action, held in product((glfw.PRESS, glfw.RELEASE), HELD)
    ]


@pytest.mark.parametrize("down", [None, 0, 1, 2])
def test_a_pointer_that_leaves_is_nowhere_unless_it_drags(
    quiet: Any, monkeypatch: pytest.MonkeyPatch, down: int | None
) -> None:
    monkeypatch.setattr(glfw, "get_mouse_button", lambda handle, button: glfw.PRESS if button == down else glfw.RELEASE)
    quiet._left()
    assert len(quiet.events) == (down is None)
    if quiet.events:
        left = quiet.events[0]
        assert isinstance(left, Move)
        assert max(left.x, left.y) < 0


def test_a_window_that_shall_close_stays_and_asks(quiet: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[object] = []
    monkeypatch.setattr(glfw, "set_window_should_close", lambda *given: told.append(given))
    quiet._close_wish("handle")
    assert (told, quiet.events) == ([("handle", False)], [CloseWish()])


@pytest.mark.parametrize(
    ("event", "is_news"),
    [
        (Button(LEFT, True), True),
        (Button(LEFT, False), True),
        (Key("a", True), True),
        (Key("a", False), True),
        (Key("a", True, repeat=True), False),
        (Move(1, 2), False),
        (CloseWish(), True),
    ],
    ids=repr,
)
def test_what_is_pressed_or_let_go_is_news(
    quiet: Any, monkeypatch: pytest.MonkeyPatch, event: Event, is_news: bool
) -> None:
    monkeypatch.setattr(glfw, "poll_events", lambda: quiet.events.append(event))
    assert quiet._has_news() == is_news


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
def test_a_window_comes_back_where_a_screen_is_still(quiet: Any, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    place, *wanted = PLACES[name]
    areas = {"one": (0, 30, 1000, 700), "two": (1000, 30, 1000, 700)}
    told: dict[str, object] = {}
    monkeypatch.setattr(glfw, "get_monitors", lambda: list(areas))
    monkeypatch.setattr(glfw, "get_monitor_workarea", areas.__getitem__)
    monkeypatch.setattr(glfw, "set_window_size", lambda handle, *size: told.update(size=size))
    monkeypatch.setattr(glfw, "set_window_pos", lambda handle, *at: told.update(at=at))
    monkeypatch.setattr(glfw, "maximize_window", lambda handle: told.update(fills=True))
    quiet._go_to(place)
    assert [told.get("size"), told.get("at"), told.get("fills", False)] == wanted


def test_a_cursor_is_made_once_and_set_where_it_changes(quiet: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    made, given = list[object](), list[object]()
    quiet._cursor, quiet._cursors = "arrow", {}
    monkeypatch.setattr(glfw, "create_cursor", lambda *_: made.append("none") or "none")
    monkeypatch.setattr(glfw, "create_standard_cursor", lambda shape: made.append(shape) or shape)
    monkeypatch.setattr(glfw, "set_cursor", lambda handle, cursor: given.append(cursor))
    for name in ("arrow", "none", "none", "hand", "crosshair", "resize_ew", "arrow", "none", "hand"):
        quiet._show_cursor(name)
    shapes = [glfw.HAND_CURSOR, glfw.CROSSHAIR_CURSOR, glfw.HRESIZE_CURSOR, glfw.ARROW_CURSOR]
    assert made == ["none", *shapes]
    assert given == ["none", *shapes, "none", glfw.HAND_CURSOR]


@pytest.mark.parametrize(
    ("screen", "wanted"), [(None, (1280, 800)), ((0, 0, 1000, 900), (1000, 800)), ((0, 0, 0, 0), (1280, 800))]
)
def test_a_window_is_no_larger_than_the_screen(
    monkeypatch: pytest.MonkeyPatch, screen: tuple[int, ...] | None, wanted: tuple[int, int]
) -> None:
    monkeypatch.setattr(glfw, "get_primary_monitor", lambda: screen)
    monkeypatch.setattr(glfw, "get_monitor_workarea", lambda monitor: monitor)
    assert window._fitting((1280, 800)) == wanted


@pytest.mark.parametrize("words", [b"X11: no display", "GLX: no display", "Wayland: no display", b"no display"])
def test_why_there_is_no_window_is_told_without_the_library_s_words(
    monkeypatch: pytest.MonkeyPatch, words: str | bytes
) -> None:
    monkeypatch.setattr(glfw, "get_error", lambda: (1, words))
    assert window._why().startswith("no window can be opened here (no display). ")

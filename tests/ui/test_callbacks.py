"""What GLFW calls back becomes the editor's events, and where a window may be: by tables, and without a screen."""

from __future__ import annotations

import sys
from itertools import product

import glfw
import pytest

from app.ui.actions import ACTIONS
from app.ui.callbacks import Callbacks
from app.ui.events import LEFT, MIDDLE, RIGHT, Button, CloseWish, Drop, Event, Focus, Key, Mods, Move, Wheel
from app.ui.window import fitting, placed

KEYS = {
    "space": "SPACE", "escape": "ESCAPE", "enter": "ENTER KP_ENTER", "tab": "TAB", "backspace": "BACKSPACE",
    "delete": "DELETE", "left": "LEFT", "right": "RIGHT", "up": "UP", "down": "DOWN", "home": "HOME", "end": "END",
    "pageup": "PAGE_UP", "pagedown": "PAGE_DOWN",
} | {f"f{n}": f"F{n}" for n in range(1, 13)} | {str(digit): str(digit) for digit in range(10)}  # fmt: skip
CTRL = "SUPER" if sys.platform == "darwin" else "CONTROL"
BITS = {"shift": glfw.MOD_SHIFT, "alt": glfw.MOD_ALT, "ctrl": getattr(glfw, f"MOD_{CTRL}")}
HELD = [dict(zip(BITS, held, strict=True)) for held in product((False, True), repeat=3)]


def bits(held: dict[str, bool]) -> int:
    return sum(bit for name, bit in BITS.items() if held[name])


@pytest.mark.parametrize("held", HELD, ids=lambda held: "+".join(name for name in held if held[name]) or "none")
def test_each_key_has_its_name_and_the_modifiers_that_are_held(held: dict[str, bool]) -> None:
    heard, wanted = Callbacks(), list[Event]()
    for name, keys in KEYS.items():
        for key in keys.split():
            for action in (glfw.PRESS, glfw.REPEAT, glfw.RELEASE):
                heard.key(getattr(glfw, f"KEY_{key}"), action, bits(held), "&" if name.isdigit() else None)
                wanted.append(Key(name, action != glfw.RELEASE, Mods(**held), action == glfw.REPEAT))
    heard.key(glfw.KEY_Y, glfw.PRESS, bits(held), "Z")  # as a German layout prints it
    wanted.append(Key("z", True, Mods(**held)))
    assert heard.take() == wanted
    assert heard.take() == []


@pytest.mark.parametrize(("platform", "control"), [("linux", "CONTROL"), ("win32", "CONTROL"), ("darwin", "SUPER")])
def test_a_modifier_is_held_from_its_own_event_on(platform: str, control: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", platform)
    names = {"SHIFT": "shift", "ALT": "alt", "CONTROL": None, "SUPER": None} | {control: "ctrl"}
    heard = Callbacks()
    for name, side, before in product(names, ("LEFT", "RIGHT"), product((False, True), repeat=4)):
        held = dict(zip(names, before, strict=True))
        for action in (glfw.PRESS, glfw.RELEASE):
            before_it = sum(getattr(glfw, f"MOD_{one}") for one in held if held[one])
            heard.key(getattr(glfw, f"KEY_{side}_{name}"), action, before_it)
            then = held | {name: action == glfw.PRESS}
            mods = Mods(**{own: then[one] for one, own in names.items() if own})
            assert heard.held == mods
            assert heard.take() == [Key("", action == glfw.PRESS, mods)]


def test_all_keys_that_do_something_have_a_name() -> None:
    chords = {key.split("+")[-1] or "+" for action in ACTIONS.values() for key in action.keys}
    assert {key for key in chords if len(key) > 1} <= set(KEYS)


def test_three_buttons_are_heard_with_what_is_held_and_no_other() -> None:
    heard = Callbacks()
    for button, action, held in product(range(8), (glfw.PRESS, glfw.RELEASE), HELD):
        heard.button(button, action, bits(held))
    assert heard.take() == [
        Button(button, action == glfw.PRESS, Mods(**held))
        for button, action, held in product((LEFT, RIGHT, MIDDLE), (glfw.PRESS, glfw.RELEASE), HELD)
    ]


@pytest.mark.parametrize("is_dragging", [False, True])
def test_a_pointer_that_leaves_is_nowhere_unless_it_drags(is_dragging: bool) -> None:
    heard = Callbacks()
    heard.left(is_dragging)
    assert [isinstance(event, Move) and max(event.x, event.y) < -1000 for event in heard.events] == (
        [] if is_dragging else [True]
    )


@pytest.mark.parametrize(
    ("event", "are_news"),
    [
        (Button(LEFT, True), True),
        (Button(LEFT, False), True),
        (Wheel(0, 1), True),
        (Key("a", True), True),
        (Key("a", False), True),
        (Key("a", True, repeat=True), False),
        (Move(1, 2), False),
        (Focus(True), False),
        (Drop(("a.png",)), True),
        (CloseWish(), True),
    ],
    ids=repr,
)
def test_what_is_pressed_or_let_go_is_news(event: Event, are_news: bool) -> None:
    heard = Callbacks()
    for each in (Move(0, 0), event, Key("b", True, repeat=True)):
        heard.add(each)
    assert heard.are_news == are_news


SCREENS = (0, 30, 1000, 700), (1000, 30, 1000, 700)
PLACES: dict[str, tuple[list[int], list[int] | None]] = {
    "as it was": ([100, 50, 800, 600, 0], [100, 50, 800, 600, 0]),
    "larger than the screen": ([0, 40, 1900, 2000, 0], [0, 40, 1000, 700, 0]),
    "behind the bar at the top": ([100, 10, 800, 600, 0], [100, 30, 800, 600, 0]),
    "half beyond the left": ([-390, 50, 800, 600, 0], [-390, 50, 800, 600, 0]),
    "on the second screen": ([1200, 50, 400, 300, 0], [1200, 50, 400, 300, 0]),
    "it filled the screen": ([100, 50, 800, 600, 1], [100, 50, 800, 600, 1]),
    "beyond the left": ([-401, 50, 800, 600, 0], None),
    "beyond the right": ([1601, 50, 800, 600, 0], None),
    "below": ([100, 707, 800, 600, 0], None),
    "above": ([100, 5, 800, 600, 0], None),
    "nowhere": ([], None),
}


@pytest.mark.parametrize("name", PLACES)
def test_a_window_comes_back_where_a_screen_is_still(name: str) -> None:
    was, wanted = PLACES[name]
    assert placed(was, SCREENS) == wanted


@pytest.mark.parametrize(
    ("screen", "wanted"), [((0, 0, 1000, 900), (1000, 800)), ((9, 9, 2000, 700), (1280, 700)), ((0,) * 4, (1280, 800))]
)
def test_a_window_is_no_larger_than_the_screen(screen: tuple[int, ...], wanted: tuple[int, int]) -> None:
    assert fitting((1280, 800), screen) == wanted

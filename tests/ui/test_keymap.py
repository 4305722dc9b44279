"""Keys that the person chooses: which action a chord does, and the sheet on which it is chosen."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from app.ui.actions import ACTIONS
from app.ui.editor import Editor
from app.ui.events import Key, Mods
from app.ui.key_sheet import KeySheet
from app.ui.keymap import Keymap
from app.ui.preferences import Preferences
from solver.gl.device import Device
from support.editing import BY_KEY, Robot, small_project
from support.widgets import Widgets


@pytest.fixture
def robot(device: Device, tmp_path: Path) -> Iterator[Robot]:
    preferences = Preferences(auto_quality=False, path=tmp_path / "kept" / "preferences.json")
    with Robot(device, small_project(tmp_path), preferences=preferences) as robot:
        yield robot


@pytest.fixture
def sheet(robot: Robot) -> KeySheet:
    robot.key("f1")
    robot.frame(count=3)
    shown = robot.editor.dialogs.shown[-1]
    assert isinstance(shown, KeySheet)
    return shown


def choose(robot: Robot, sheet: KeySheet, name: str, chord: str) -> None:
    """As a click on the action's row and the key do."""
    sheet.choose(ACTIONS[name])
    robot.frame()
    robot.key(chord)
    robot.frame(count=2)


def test_without_a_choice_all_is_as_it_comes() -> None:
    keys = Keymap(ACTIONS.values(), {}, lambda: None)
    assert {chord: keys.action(chord) for chord in BY_KEY} == {chord: action.name for chord, action in BY_KEY.items()}
    assert {name: keys.of(name) for name in ACTIONS} == {name: action.key for name, action in ACTIONS.items()}
    assert all(keys.now(chord) == chord for chord in BY_KEY)
    assert not keys.are_changed


def test_a_chord_that_is_taken_from_another_action_is_done_by_one_alone() -> None:
    changed: dict[str, list[str]] = {}
    keys = Keymap(ACTIONS.values(), changed, lambda: None)
    keys.set("tool_push", "ctrl+y")
    assert (keys.action("ctrl+y"), keys.action("p"), keys.now("p")) == ("tool_push", None, "ctrl+y")
    assert keys.of("redo") == "ctrl+shift+z", "it had two"
    keys.set("tool_push", "ctrl+shift+z")
    assert (keys.of("redo"), keys.now("ctrl+shift+z")) == ("", "")
    assert changed == {"redo": [], "tool_push": ["ctrl+shift+z"]}
    keys.reset()
    assert (keys.of("redo"), keys.action("p"), changed) == ("ctrl+shift+z", "tool_push", {})


def test_a_file_of_preferences_with_one_chord_twice_gives_it_to_one() -> None:
    keys = Keymap(ACTIONS.values(), {"export": ["p"], "quit": ["p"], "no such action": ["k"]}, lambda: None)
    assert [name for name in ACTIONS if keys.of(name) == "p"] == [keys.action("p")]
    assert keys.action("k") is None


def test_a_key_is_chosen_and_kept(robot: Robot, sheet: KeySheet, device: Device, tmp_path: Path) -> None:
    choose(robot, sheet, "tool_twirl", "k")
    assert robot.editor.state.tool_name == "push", "a key that is chosen does nothing else"
    robot.key("escape")
    robot.frame(count=2)
    assert not robot.editor.dialogs.shown
    robot.key("t")
    assert robot.editor.state.tool_name == "push"
    robot.key("k")
    assert robot.editor.state.tool_name == "twirl"
    assert robot.editor.ui.shown("t") == "K", "tooltips tell it"


def test_kept_keys_are_read_again(robot: Robot, sheet: KeySheet, monkeypatch: pytest.MonkeyPatch) -> None:
    choose(robot, sheet, "play", "k")
    path = robot.editor.preferences.path
    assert path is not None
    monkeypatch.setattr("platformdirs.user_config_path", lambda name: path.parent)
    kept = Preferences.load()
    assert kept.keys == {"play": ["k"]}
    assert Keymap(ACTIONS.values(), kept.keys, kept.save).action("space") is None


def test_a_conflict_is_told_and_taken_or_left(robot: Robot, widgets: Widgets, sheet: KeySheet) -> None:
    choose(robot, sheet, "tool_twirl", "ctrl+s")
    widgets.click("Cancel")
    assert not robot.editor.keys.are_changed
    choose(robot, sheet, "tool_twirl", "ctrl+s")
    robot.key("enter")
    robot.frame(count=2)
    keys = robot.editor.keys
    assert (keys.action("ctrl+s"), keys.of("save")) == ("tool_twirl", "")
    choose(robot, sheet, "tool_twirl", "\\")
    widgets.look()
    assert "Take it" not in widgets.at, "this one is for nothing else"
    widgets.click("Cancel")
    widgets.click("Reset all keys")
    assert (keys.action("ctrl+s"), keys.action("t")) == ("save", "tool_twirl")


@pytest.mark.parametrize("chord", ["enter", "tab", "space", "down", "ctrl+shift+f5"])
def test_any_key_can_be_chosen_and_goes_nowhere_else(robot: Robot, sheet: KeySheet, chord: str) -> None:
    choose(robot, sheet, "actual", chord)
    if chord in BY_KEY:
        robot.key("enter")  # as who presses "Take it"
        robot.frame(count=2)
    assert robot.editor.keys.of("actual") == chord
    assert robot.editor.dialogs.shown == [sheet]
    assert not sheet.is_listening


def test_escape_gives_up_choosing_and_not_the_sheet(robot: Robot, sheet: KeySheet) -> None:
    choose(robot, sheet, "actual", "escape")
    assert (robot.editor.dialogs.shown, sheet.is_listening) == ([sheet], False)
    assert not robot.editor.keys.are_changed


def test_a_modifier_alone_is_no_key(robot: Robot, sheet: KeySheet) -> None:
    sheet.choose(ACTIONS["actual"])
    robot.frame(Key("", True, Mods(ctrl=True)))
    assert sheet.is_listening


def test_what_space_does_can_be_changed(robot: Robot, sheet: KeySheet) -> None:
    choose(robot, sheet, "tool_twirl", "space")
    robot.key("enter")
    robot.key("escape")
    robot.frame(count=2)
    robot.key("space")
    assert robot.editor.state.tool_name == "twirl"


def test_space_with_a_modifier_is_a_chord_too(robot: Robot, sheet: KeySheet) -> None:
    choose(robot, sheet, "tool_twirl", "ctrl+space")
    robot.key("escape")
    robot.frame(count=2)
    robot.key("space")
    assert robot.editor.state.tool_name == "push"
    robot.key("ctrl+space")
    assert robot.editor.state.tool_name == "twirl"


def test_a_row_that_is_clicked_waits_for_its_key(robot: Robot, sheet: KeySheet) -> None:
    """The first row of the first column: Open."""
    robot.click(sheet.rect.x + 60, sheet.rect.y + 88)
    assert sheet.is_listening
    robot.key("ctrl+shift+k")
    assert robot.editor.keys.of("open") == "ctrl+shift+k"


@pytest.mark.parametrize(
    ("chord", "times"), [("[", 4), ("shift+[", 4), (";", 4), ("=", 4), ("left", 4), ("y", 1), ("t", 1), ("ctrl+i", 1)]
)
def test_what_goes_by_steps_is_done_again_while_its_key_is_held_and_nothing_else(
    robot: Robot, monkeypatch: pytest.MonkeyPatch, chord: str, times: int
) -> None:
    done: list[str] = []
    monkeypatch.setattr(Editor, "do", lambda editor, name: done.append(name))
    *held, key = chord.split("+")
    mods = Mods("ctrl" in held, "shift" in held)
    robot.frame(*(Key(key, True, mods, repeat=number > 0) for number in range(4)))
    robot.frame(count=4)
    robot.frame(Key(key, False, mods))
    assert done == [BY_KEY[chord].name] * times

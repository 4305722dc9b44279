"""Which button does what, and what an action sets is there again after a start."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
from imgui_bundle import imgui

from app.model.handles import RecipeHandle
from app.model.strokes import Stroke
from app.model.tools import TOOL
from app.ui.actions import ACTIONS
from app.ui.editor_state import EditorState
from app.ui.preferences import Preferences
from app.ui.widgets import Ui
from solver.gl.device import Device
from support.editing import Robot, add_bars, small_project
from support.widgets import Widgets

DOES = {
    "Load ...": "mask_load", "Save ...": "mask_save", "Invert": "mask_invert", "Fill": "mask_fill",
    "Clear": "mask_clear", "Feather": "mask_feather", "Grow": "mask_grow", "Shrink": "mask_shrink",
    "Clear the masks": "clear_masks", "Stop all motion": "clear_velocity", "Reset the warp": "reset_warp",
    "Copy as recipe": "copy_recipe", "Export": "export", "out": "zoom_out", "in": "zoom_in", "fit": "fit",
    "start": "start", "play": "play", "step": "step", "repeat": "repeat", "lanes": "lanes", "undo": "undo",
    "redo": "redo", "split": "split", "inspector": "inspector", "bars_together": "bars_together",
    "bars_mute": "bars_mute", "remove": "remove", "Remove": "remove", "Fit": "fit_handles",
    "Fit a mask to another ...": "fit_masks", "Invert the selection": "select_invert", "Freeze": "select_fill",
    "Thaw": "select_clear",
}  # fmt: skip
"""What stands on a button, or what an icon is called, and the action that it does."""


def test_every_button_does_what_stands_on_it(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    """All that are drawn, also those that are not enabled now; the icon of a tool takes that tool."""
    state, done, now = robot.editor.state, dict[str, list[str]](), [""]

    def press(kind: str) -> None:
        draw = getattr(Ui, kind)

        def drawn(ui: Ui, label: str, *more: Any, **named: Any) -> bool:
            draw(ui, label, *more, **named)
            words = label.split("##")[0]
            done.setdefault(words, [])
            return words == now[0]

        monkeypatch.setattr(Ui, kind, drawn)

    press("button")
    press("icon_button")
    monkeypatch.setattr(robot.editor, "do", lambda name: done[now[0]].append(name))
    robot.editor.session.edit("Handle", handle=(RecipeHandle(at=(0.2, 0.2), to=(0.3, 0.2)),))
    state.choose_tool("select", False)
    state.selected, state.lanes.shown = "handle[1]", True
    state.sections |= dict.fromkeys(("masks", "selection", "handles"), True)
    robot.frame(count=3)
    for words in list(done):
        now[0] = words
        robot.frame()
        if words in TOOL:
            assert state.tool_name == words
        state.choose_tool("select", False)
    assert {words: names for words, names in done.items() if names} == {words: [name] for words, name in DOES.items()}
    assert set(TOOL) <= done.keys()


def rows_of_the_menu(robot: Robot, widgets: Widgets) -> dict[str, tuple[float, float]]:
    """Its rows, and "recent", the one that opens another menu; the menu is open then."""
    widgets.look()
    robot.click(*next(widget.rect.middle for widget in widgets.drawn if widget.words == "menu"))
    robot.frame(count=3)
    rows = {widget.words: widget.rect.middle for widget in widgets.drawn if widget.kind == "menu_item"}
    (x, above), (_, below) = rows["Open ..."], rows["Paste a picture"]
    return rows | {"recent": (x, (above + below) / 2)}


def test_every_row_of_the_menu_does_what_stands_on_it(
    robot: Robot, widgets: Widgets, monkeypatch: pytest.MonkeyPatch
) -> None:
    done, labels = list[str](), {action.label: name for name, action in ACTIONS.items()}
    rows = rows_of_the_menu(robot, widgets)
    robot.key("escape")
    monkeypatch.setattr(robot.editor, "do", done.append)
    assert len(rows) == 14
    for words in rows.keys() - {"recent"}:
        robot.click(*rows_of_the_menu(robot, widgets)[words])
        robot.frame(count=2)
        assert done == [labels[words]]
        done.clear()


@pytest.mark.parametrize("number", [0, 1])
def test_what_was_open_is_opened_from_the_menu_and_told_where_it_is(
    robot: Robot, widgets: Widgets, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    opened, told = list[Path](), list[str]()
    files = tmp_path / "here" / "a.png", tmp_path / "there" / "b.fluidwarp"
    robot.editor.preferences.recent = [str(file) for file in files]
    monkeypatch.setattr(robot.editor.files, "open_work", opened.append)
    monkeypatch.setattr(imgui, "set_tooltip", told.append)
    robot.click(*rows_of_the_menu(robot, widgets)["recent"])
    robot.frame(count=3)
    row = next(widget.rect.middle for widget in widgets.drawn if widget.words == files[number].name)
    robot.move(*row)
    robot.frame(count=2)
    assert set(told) == {str(files[number].parent)}
    robot.click(*row)
    assert opened == [files[number]]


def test_what_an_action_sets_is_there_again_after_a_start(
    device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of what the state takes from the preferences, after every action that needs no dialog; there and back."""
    monkeypatch.setattr("platformdirs.user_config_path", lambda name: tmp_path / "kept")
    likes = Preferences(auto_quality=False, path=tmp_path / "kept" / "preferences.json")

    def kept(state: EditorState) -> dict[str, Any]:
        lanes = state.lanes.shown, state.lanes.height
        brushes = {name: asdict(brush) for name, brush in state.brushes.items()}
        return {"lanes": lanes, "inspector": state.inspector, "brushes": brushes, "sections": dict(state.sections)}

    changed = set[str]()
    with Robot(device, small_project(tmp_path), preferences=likes) as robot:
        state = robot.editor.state
        for name, action in ACTIONS.items():
            if action.group not in ("Tools", "Brush", "View"):
                continue
            before = kept(state) | {"theme": likes.theme}
            robot.editor.do(name)
            robot.editor.remember()
            after, found = kept(state) | {"theme": likes.theme}, Preferences.load()
            assert kept(EditorState.recalled(found)) | {"theme": found.theme} == after, name
            changed |= {key for key in after if after[key] != before[key]}
        robot.editor.do("lanes")
        assert Preferences.load().lanes is state.lanes.shown is True
    assert changed == {"inspector", "brushes", "sections", "theme"}


def test_letters_have_the_same_size_of_the_design_at_every_scale(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is handed to imgui is multiplied by it: all that is drawn, with bars in the timeline."""
    strokes = tuple(
        Stroke(tool="push", samples=((first, 0.2, 0.2, 1.0), (first + 20, 0.3, 0.2, 1.0))) for first in (0, 5, 9)
    )
    robot.editor.session.edit("Strokes", stroke=strokes, duration=2.0)
    add_bars(robot.editor.session)
    robot.editor.state.lanes.shown = True
    robot.editor.state.sections = dict.fromkeys(("masks", "view", "quality", "fluid"), False)
    push, sizes = imgui.push_font, set[float]()

    def pushed(font: imgui.ImFont, size: float) -> None:
        sizes.add(round(size, 3))
        push(font, size)

    monkeypatch.setattr(imgui, "push_font", pushed)
    found = []
    for scale in (1.0, 1.25):
        robot.editor.preferences.scale = scale
        robot.frame(count=3)
        sizes.clear()
        robot.frame(count=2)
        found.append(set(sizes))
    assert len(found[0]) > 2
    assert found[1] == found[0]

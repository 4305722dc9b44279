"""What a person does with the window's widgets, messages and dialogs, without a window."""

from __future__ import annotations

import json
import os
import re
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest
from imgui_bundle import imgui

from app.media.displacement import Displacement
from app.media.maps import write_map
from app.media.pictures import write_picture
from app.media.project import Project
from app.model.handles import RecipeHandle
from app.model.masks import PathFreeze
from app.model.picture import Picture
from app.model.presets import PUTTY, WATER
from app.model.tools import TOOL, TOOLS, Press
from app.ui.chooser import FileChooser
from app.ui.clock import FRAMES, HOVERING, PACE
from app.ui.editor import Editor
from app.ui.editor_state import SELECT_BY
from app.ui.events import LEFT, Button, Event, Key, Mods, Move, Text, Wheel
from app.ui.export_choices import ANIMATION
from app.ui.export_dialog import ExportDialog
from app.ui.files import load_any
from app.ui.layout import Layout
from app.ui.panels.hud import BEHIND
from app.ui.preferences import Preferences
from app.ui.saving import SaveDialog
from app.ui.viewport import Rect
from app.ui.widgets import Ui, fitting
from solver.gl.device import Device
from solver.gl.passes import Pass
from support.editing import BY_KEY, Robot, Still, export_dialog, pattern, small_project
from support.widgets import Widgets


def live(robot: Robot, seconds: float) -> int:
    """Let time go by as the window does it, which draws only when the editor wants it; how often it has drawn."""
    drawn, gone = 0, 0.0
    while gone < seconds:
        wait = max(robot.editor.wait(), 1 / 60)
        if gone + wait > seconds:
            return drawn
        robot.frame(dt=wait)
        gone, drawn = gone + wait, drawn + 1
    return drawn


def ctrl_click(robot: Robot, x: float, y: float) -> None:
    robot.mods = Mods(ctrl=True)
    robot.click(x, y)
    robot.mods = Mods()
    robot.frame(Key("", False))


def naming_an_export(robot: Robot) -> ExportDialog:
    """The export dialog, opened, with the cursor at the end of the file's name."""
    robot.key("ctrl+e")
    robot.frame(count=3)
    dialog = robot.editor.dialogs.shown[-1]
    assert isinstance(dialog, ExportDialog)
    robot.click(dialog.rect.x + 100, dialog.rect.y + 397)
    robot.key("end")
    return dialog


def type_into(robot: Robot, x: float, y: float, text: str) -> None:
    """Ctrl+click a slider, type, and take it by Enter."""
    ctrl_click(robot, x, y)
    robot.type(text)
    robot.frame(count=2)
    robot.key("enter")
    robot.frame(count=2)


# Rest and motion ----------------------------------------------------------------------------------------------------


def test_a_tooltip_comes_to_a_pointer_that_rests(robot: Robot) -> None:
    robot.see()
    live(robot, 5)
    robot.frame(Move(24, 130))
    before = robot.pixels().astype(int)
    live(robot, 5)
    shown = np.abs(robot.pixels() - before)[140:200, 40:200].max(axis=-1) > 20
    assert shown.sum() > 200


def test_a_tooltip_at_the_bottom_leaves_what_it_is_about_to_be_seen(robot: Robot) -> None:
    robot.see()
    height, width = robot.pixels().shape[:2]
    live(robot, 5)
    robot.frame(Move(width - 60, height - 28))  # on the slider of the amount
    robot.frame()
    before = robot.pixels().astype(int)
    live(robot, 5)
    shown = np.abs(robot.pixels() - before).max(axis=-1) > 20
    assert shown[height - 110 : height - 44, width - 200 :].sum() > 200
    assert not shown[height - 42 :].any()


def test_at_rest_nothing_is_drawn(robot: Robot) -> None:
    robot.frame(Move(24, 130))
    live(robot, 5)
    assert live(robot, 59) == 0
    assert robot.editor.wait() == 60


def test_a_frame_in_which_nothing_changes_gives_the_gpu_nothing_new(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of all that is shown: of a clip's frame that has just come, of overlays, a selection, the history and bars."""
    workspace, state = robot.editor.workspace, robot.editor.state
    robot.drag((0.3, 0.5), (0.5, 0.5), steps=1)
    robot.editor.session.settle()
    state.lanes.shown = True
    for name in state.overlays:
        state.toggle_overlay(name)
    state.choose_tool("select", False)
    robot.drag((0.2, 0.2), (0.6, 0.6), steps=1)
    workspace.canvas.show(np.full((*robot.editor.session.project.picture.pixels.shape[:2], 4), 99, np.uint8))
    workspace.view = replace(workspace.view, zoom=0.3)  # its smaller versions are needed
    robot.frame(count=3)
    while workspace.canvas.is_unfinished:
        robot.frame()
    done: list[str] = []
    for kind, names in (
        (moderngl.Texture, ("write", "read", "read_into", "build_mipmaps")),
        (moderngl.Framebuffer, ("read", "read_into")),
        (moderngl.Context, ("texture", "framebuffer")),
        (Pass, ("__call__",)),
    ):
        for name in names:
            monkeypatch.setattr(kind, name, noting(getattr(kind, name), f"{kind.__name__}.{name}", done))
    robot.frame()
    assert not done


def noting(function: Callable[..., Any], name: str, done: list[str]) -> Callable[..., Any]:
    """It, which is told of each time."""

    def noted(*args: Any, **named: Any) -> Any:
        done.append(name)
        return function(*args, **named)

    return noted


def test_frames_are_drawn_for_a_pointer_that_rests_only_where_something_may_come_to_it(robot: Robot) -> None:
    for place, wait in (((24, 130), PACE), (robot.at(0.5, 0.5), 60)):
        robot.frame(Move(*place))
        robot.frame(count=FRAMES, dt=0.01)
        assert robot.editor.clock.hovering
        assert robot.editor.wait() == wait


@contextmanager
def exporting(robot: Robot, folder: Path, patched: pytest.MonkeyPatch) -> Iterator[None]:
    patched.setattr("app.ui.export_dialog.ExportProcess", Still)
    robot.editor.exports.start(export_dialog(robot, folder).job())
    try:
        yield
    finally:
        robot.editor.exports.cancel()


@contextmanager
def a_fit(robot: Robot, folder: Path, patched: pytest.MonkeyPatch) -> Iterator[None]:
    patched.setattr("app.ui.fitting.FitProcess", Still)
    led = RecipeHandle(at=(0.4, 0.5), to=(0.45, 0.5), duration=0.05)
    robot.editor.session.edit("Handle", handle=(led,), duration=0.1)
    robot.editor.session.settle()
    robot.editor.fits.start()
    try:
        yield
    finally:
        robot.editor.fits.give_up()


@contextmanager
def a_file_that_is_opened(robot: Robot, folder: Path, patched: pytest.MonkeyPatch) -> Iterator[None]:
    done, project = threading.Event(), robot.editor.session.project

    def load() -> Project:
        done.wait(60)
        return project

    robot.editor.files.read(folder / "slow.png", load)
    try:
        yield
    finally:
        robot.editor.files.give_up_loading()
        done.set()


@contextmanager
def a_preview(robot: Robot, folder: Path, patched: pytest.MonkeyPatch) -> Iterator[None]:
    patched.setattr("app.ui.export_dialog.ExportProcess", Still)
    dialog = export_dialog(robot, folder)
    dialog.choices.finer = 1
    robot.editor.dialogs.show(dialog)
    Widgets(robot, patched).click("Preview")
    robot.move(2, 2)
    try:
        yield
    finally:
        dialog.close()
        robot.frame()


@contextmanager
def a_dialog_of_the_system(robot: Robot, folder: Path, patched: pytest.MonkeyPatch) -> Iterator[None]:
    waits = f"while [ -e {folder}/zenity ] && [ ! -e {folder}/done ]; do sleep 0.02; done"
    (folder / "zenity").write_text(f"#!/bin/sh\n{waits}\n")
    (folder / "zenity").chmod(0o755)
    patched.setenv("PATH", f"{folder}:{os.environ['PATH']}")
    robot.editor.chooser.native = True
    robot.key("ctrl+o")
    try:
        yield
    finally:
        (folder / "done").touch()
        robot.until(lambda: not robot.editor.chooser.is_waiting)
        robot.editor.dialogs.shown[-1].close()  # ours, as that one had no answer
        robot.frame()


ELSEWHERE = (exporting, a_fit, a_file_that_is_opened, a_preview, a_dialog_of_the_system)


@pytest.mark.parametrize("work", ELSEWHERE, ids=lambda work: work.__name__)
def test_what_goes_on_elsewhere_is_looked_at_ten_times_a_second(
    robot: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, work: Callable[..., AbstractContextManager[None]]
) -> None:
    robot.move(*robot.at(0.5, 0.5))
    with work(robot, tmp_path, monkeypatch):
        robot.until(lambda: not robot.editor.wants_frame())
        assert robot.editor.wait() == 0.1
    robot.until(lambda: not robot.editor.wants_frame())
    assert robot.editor.wait() > 1


@pytest.mark.parametrize("work", ELSEWHERE[:3], ids=lambda work: work.__name__)
def test_nothing_is_tried_ahead_while_another_process_or_thread_needs_the_machine(
    robot: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, work: Callable[..., AbstractContextManager[None]]
) -> None:
    rehearsal = robot.editor.rehearsal
    robot.move(*robot.at(0.5, 0.5))
    with work(robot, tmp_path, monkeypatch):
        robot.rest()
        rehearsal.has_news = lambda: False
        robot.frame(count=3)
        assert rehearsal.is_wanted
        assert rehearsal.trial is None
    robot.frame()
    assert rehearsal.trial is not None


def begin_to_select(robot: Robot) -> None:
    robot.key("m")
    robot.move(*robot.at(0.3, 0.3))
    robot.press()
    robot.move(*robot.at(0.4, 0.4))


def select(robot: Robot) -> None:
    begin_to_select(robot)
    robot.release()


def look_for_a_subject(robot: Robot) -> None:
    robot.editor.state.select_by = "subject"
    select(robot)
    assert robot.editor.selecting.is_busy


def select_a_bar(robot: Robot) -> None:
    robot.key("l")
    robot.frame(count=2)
    robot.click(*robot.editor.state.lanes.drawn[0][1].middle)
    robot.frame()
    assert robot.editor.state.lanes.selected


@pytest.mark.parametrize(
    "begin", [begin_to_select, select, look_for_a_subject, select_a_bar], ids=lambda way: way.__name__
)
def test_escape_gives_up_what_is_in_hand_or_selected_and_only_the_next_one_stops_a_fit(
    robot: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, begin: Callable[[Robot], None]
) -> None:
    finished = list[Still]()
    monkeypatch.setattr(Still, "finish", lambda still: finished.append(still))
    with a_fit(robot, tmp_path, monkeypatch):
        begin(robot)
        robot.key("escape")
        assert finished == []
        assert robot.editor.fits.is_running
        state, selecting = robot.editor.state, robot.editor.selecting
        assert not any((selecting.path, selecting.is_busy))
        assert not any((state.selection, state.lanes.selected))
        robot.release()
        robot.key("escape")
        assert len(finished) == 1


def test_a_message_stays_for_five_seconds(robot: Robot) -> None:
    live(robot, 5)
    robot.key("ctrl+shift+c")
    assert len(robot.editor.messages.shown) == 1
    gone = 0.0
    while robot.editor.messages.shown:
        wait = max(robot.editor.wait(), 1 / 60)
        robot.frame(dt=wait)
        gone += wait
    assert gone == pytest.approx(5, abs=0.2)


def test_a_message_after_a_long_rest_is_not_over_at_once(robot: Robot) -> None:
    live(robot, 5)
    robot.frame(Key("c", True, Mods(ctrl=True, shift=True)), dt=100)
    assert len(robot.editor.messages.shown) == 1


def test_the_rest_before_a_stroke_does_not_count_to_it(robot: Robot) -> None:
    live(robot, 5)
    robot.move(*robot.at(0.5, 0.5))
    robot.frame(dt=30)
    robot.frame(Button(LEFT, True), dt=30)
    assert robot.editor.session.tick <= 2


@pytest.mark.parametrize("scale", [1.25, 2.0])
def test_a_dialog_of_another_size_comes_to_rest(robot: Robot, scale: float) -> None:
    robot.see()
    robot.key("ctrl+,")
    live(robot, 3)
    robot.editor.preferences.scale = scale
    robot.frame(Move(5, 5))
    live(robot, 3)
    seen = robot.pixels().astype(int)
    robot.frame(count=10)
    assert np.abs(robot.pixels() - seen).max() == 0


# Numbers ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("typed", "pixels"), [("60", 60), ("60 px", 60), ("60px", 60), ("48,5", 48.5)])
def test_the_brush_is_typed_in_pixels(robot: Robot, typed: str, pixels: float) -> None:
    type_into(robot, 300, 24, typed)
    assert robot.editor.state.brush.radius * 2 * 240 == pytest.approx(pixels)


@pytest.mark.parametrize("typed", ["80", "80%", "80 %"])
@pytest.mark.parametrize(("x", "name"), [(400, "hardness"), (520, "strength")])
def test_shares_are_typed_in_percent(robot: Robot, typed: str, x: float, name: str) -> None:
    type_into(robot, x, 24, typed)
    assert getattr(robot.editor.state.brush, name) == pytest.approx(0.8)


def test_what_is_offered_is_what_is_shown_and_taking_it_changes_nothing(robot: Robot) -> None:
    radius = 0.14987
    robot.editor.state.brush = replace(robot.editor.state.brush, radius=radius)
    for typed, ending in (("72", "enter"), ("20", "escape")):
        robot.frame(count=20)  # no double click
        ctrl_click(robot, 300, 24)
        robot.type(typed)
        robot.frame(count=2)
        robot.key(ending)
        robot.frame(count=2)
        assert robot.editor.state.brush.radius == radius


def test_what_is_typed_while_a_frame_takes_long_is_typed_and_the_next_key_acts_on_it(robot: Robot) -> None:
    """A click into a field, a number and the key of an action that come all at once."""
    rect, held = robot.editor.layout.inspector, Mods(ctrl=True)
    assert rect is not None
    x, y = rect.x + 120, rect.y + 111
    click = Move(x, y), Button(LEFT, True, held), Button(LEFT, False, held), Key("a", True, held), Key("a", False)
    typed = [event for letter in "0.7" for event in (Key(letter, True), Text(letter), Key(letter, False))]
    robot.frame(*click, *typed, Key("e", True, held), Key("e", False, held), dt=0.5)
    robot.frame(count=20)
    assert robot.editor.session.recipe.fluid.viscosity == pytest.approx(0.7)
    assert isinstance(robot.editor.dialogs.shown[-1], ExportDialog)
    assert not any(overlay.shown for overlay in robot.editor.state.overlays.values())


def test_clicks_and_keys_that_come_all_at_once_are_heard_one_after_the_other(robot: Robot) -> None:
    """Clicks beside a field and into it, a number, the key of an action that leaves the field, and keys after it."""
    rect, held = robot.editor.layout.inspector, Mods(ctrl=True)
    assert rect is not None
    x, y = rect.x + 120, rect.y + 111
    beside = Move(x, rect.y + 20), Button(LEFT, True), Button(LEFT, False)
    into = Move(x, y), Button(LEFT, True, held), Button(LEFT, False, held), Key("a", True, held), Key("a", False)
    typed = [event for letter in "0.7" for event in (Key(letter, True), Text(letter), Key(letter, False))]
    action = Key("e", True, held), Key("e", False)
    after = Key("escape", True), Key("escape", False), Key("t", True), Text("t"), Key("t", False)
    robot.frame(*beside, *beside, *into, *typed, *action, *after, dt=0.5)
    robot.frame(count=30)
    assert robot.editor.session.recipe.fluid.viscosity == pytest.approx(0.7)
    assert not robot.editor.dialogs.shown
    assert robot.editor.state.tool_name == "twirl"


@pytest.mark.parametrize("action", [None, "export"])
def test_keys_that_come_with_the_one_that_leaves_a_field_wait_for_that(robot: Robot, action: str | None) -> None:
    """Into a field that is typed in: a number, Enter or the key of an action that has no Ctrl, and keys after it."""
    rect = robot.editor.layout.inspector
    assert rect is not None
    ctrl_click(robot, rect.x + 120, rect.y + 111)
    robot.frame(count=5)
    left = ["enter"]
    if action:
        robot.editor.keys.set(action, "f9")
        left = ["f9", "escape"]
    typed = [event for letter in "0.7" for event in (Key(letter, True), Text(letter), Key(letter, False))]
    keys = [Key(key, down) for key in left for down in (True, False)]
    robot.frame(*typed, *keys, Key("t", True), Text("t"), Key("t", False), dt=0.5)
    robot.frame(count=30)
    assert robot.editor.session.recipe.fluid.viscosity == pytest.approx(0.7)
    assert robot.editor.state.tool_name == "twirl"
    assert not robot.editor.dialogs.shown


@pytest.mark.parametrize("together", [True, False], ids=["click", "release"])
def test_a_stroke_that_comes_together_with_the_click_on_its_tool_is_drawn_with_it(robot: Robot, together: bool) -> None:
    """Also if only the release of that click comes with the stroke, as a button acts when it is let go of."""
    tool, start, end = (24.0, 76.0), robot.at(0.4, 0.5), robot.at(0.6, 0.5)  # the uppermost of the strip
    robot.key("m")
    robot.move(*tool)
    press = Button(LEFT, True)
    if not together:
        robot.press()
        robot.frame(count=5)
    stroke = Move(*start), press, Move(*end), Button(LEFT, False)
    robot.frame(*((press,) if together else ()), Button(LEFT, False), *stroke, dt=0.5)
    robot.frame(count=10)
    assert robot.editor.state.tool_name == "push"
    assert [made.tool for made in robot.editor.session.recipe.stroke] == ["push"]


@pytest.mark.parametrize("together", [True, False], ids=["at once", "typed before"])
def test_a_stroke_that_comes_together_with_a_number_for_its_brush_has_that(robot: Robot, together: bool) -> None:
    """Also if the number came some frames before, as each of its letters takes one."""
    start, end = robot.at(0.4, 0.5), robot.at(0.6, 0.5)
    ctrl_click(robot, 300, 24)
    robot.frame(count=5)
    typed = [event for letter in "12" for event in (Key(letter, True), Text(letter), Key(letter, False))]
    typed += [Key("enter", True), Key("enter", False)]
    stroke = [Move(*start), Button(LEFT, True), Move(*end), Button(LEFT, False)]
    if together:
        robot.frame(*typed, *stroke, dt=0.5)
    else:
        robot.frame(*typed, dt=0.5)
        robot.frame(*stroke, dt=0.5)
    robot.frame(count=30)
    (made,) = robot.editor.session.recipe.stroke
    assert made.radius == pytest.approx(12 / 2 / max(robot.editor.view.picture))


@pytest.mark.parametrize("key", ["tab", "escape", "enter"])
def test_nothing_waits_for_the_repeats_of_a_key_that_was_held(robot: Robot, key: str) -> None:
    robot.frame(Key(key, True))
    for _ in range(5):
        robot.frame(*[Key(key, True, repeat=True)] * 2)
    robot.frame(Key(key, False), Key("t", True), Text("t"), Key("t", False))
    assert robot.editor.state.tool_name == "twirl"


@pytest.mark.parametrize(("rest", "is_one"), [(0.1, True), (0.7, False)])
def test_a_double_click_is_one_however_slow_frames_are(robot: Robot, rest: float, is_one: bool) -> None:
    """imgui takes a frame for each press and release, and the time of those in which they wait is not between them."""
    robot.frame(Move(1100, 30))
    robot.frame(Button(LEFT, True), dt=0.3)
    robot.frame(dt=rest)
    found = False
    for events in ((Button(LEFT, False), Button(LEFT, True), Button(LEFT, False)), (), (), ()):
        robot.frame(*events, dt=0.3)
        found |= imgui.is_mouse_double_clicked(0)
    assert found == is_one


def test_two_clicks_in_half_a_second_are_a_double_click(robot: Robot) -> None:
    """As where a frame takes long."""
    rect = robot.editor.layout.inspector
    assert rect is not None
    type_into(robot, rect.x + 120, rect.y + 111, "0.7")
    robot.frame(dt=2.0)
    for down in (True, False, True, False):
        robot.frame(Button(LEFT, down), dt=0.2)
    robot.frame(count=2)
    assert robot.editor.session.recipe.fluid.viscosity == pytest.approx(0.03)


def test_what_is_typed_into_a_slider_is_seen(robot: Robot, widgets: Widgets) -> None:
    robot.see()
    rect = widgets.at["Drag"]
    robot.mods = Mods(ctrl=True)
    robot.click(*rect.middle)
    robot.mods = Mods()
    robot.key("ctrl+a")
    seen = []
    for text in ("1", ".000000"):
        robot.type(text)
        robot.frame(Move(5, 5), count=3)
        rows, columns = slice(round(rect.y), round(rect.bottom)), slice(round(rect.x), round(rect.right))
        seen.append(robot.pixels()[rows, columns].astype(int))
    columns = (np.abs(seen[1] - seen[0]) > 60).any(axis=(0, 2))
    assert columns.sum() > 20  # of six digits; the cursor alone has two


def test_the_first_hint_is_one_row(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = dict[str, float]()
    text = Ui.text

    def noting(ui: Ui, words: str, *given: Any, **named: Any) -> None:
        text(ui, words, *given, **named)
        rows[words.split()[0]] = (imgui.get_item_rect_min().y + imgui.get_item_rect_max().y) / 2

    monkeypatch.setattr(Ui, "text", noting)
    robot.frame()
    assert rows["Drag"] == pytest.approx(rows["Drop"], abs=1)


def test_a_hint_is_of_the_tool_in_hand(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    """And of its direction: with Pinch the picture was said to swell."""
    said, text = list[str](), Ui.text
    monkeypatch.setattr(
        Ui, "text", lambda ui, words, *given, **named: (said.append(words.strip()), text(ui, words, *given, **named))
    )
    robot.size = (1280, 800)
    handle = RecipeHandle(at=(0.4, 0.5), to=(0.45, 0.5), duration=0.1)
    robot.editor.session.edit(
        "Handle", handle=(handle,), freeze=(PathFreeze(kind="path", points=((0.2, 0.2),), radius=0.1),)
    )
    robot.rest()
    shows_legend = {"thicken", "smooth"}  # in the place of a hint
    selecting = SELECT_BY["rectangle"]
    known = {selecting, *(f"{hint}." for tool in TOOLS for hint in (tool.hint, tool.back) if hint)}
    for tool, is_opposite in product(TOOLS, (False, True)):
        robot.editor.state.choose_tool(tool.name, is_opposite)
        robot.frame(count=2)
        said.clear()
        robot.frame()
        own = selecting if tool.name == "select" else f"{(is_opposite and tool.back) or tool.hint}."
        is_there = tool.name == "select" or (tool.gesture is not None and tool.name not in shows_legend)
        assert known & {*said} == ({own} if is_there else set()), tool.name
    robot.editor.state.choose_tool("bloat", False)
    for is_held, hint in ((True, TOOL["bloat"].back), (False, TOOL["bloat"].hint)):  # Alt, which is the other direction
        robot.mods = Mods(alt=is_held)
        robot.move(*robot.at(0.5, 0.5))
        robot.frame()
        said.clear()
        robot.frame()
        assert known & {*said} == {f"{hint}."}
    robot.mods, robot.editor.state.before = Mods(), True  # which has no legend
    for is_opposite, hint in ((False, "should move less, with Honey and Water"), (True, "should give way")):
        robot.editor.state.choose_tool("thicken", is_opposite)
        robot.frame(count=2)
        said.clear()
        robot.frame()
        assert known & {*said} == {f"Paint where the picture {hint}."}
    robot.editor.state.before = False
    robot.editor.state.choose_tool("handle", False)
    robot.size = (560, 500)
    robot.frame(count=2)
    said.clear()
    robot.frame()
    assert not any(words.startswith("Drag a point") for words in said), "where there is no room for it"


@pytest.mark.parametrize("typed", ["nan", "banana", ""])
def test_what_is_no_number_changes_nothing(robot: Robot, typed: str) -> None:
    before = robot.editor.session.recipe
    rect = robot.editor.layout.inspector
    assert rect is not None
    type_into(robot, rect.x + 120, rect.y + 111, typed)
    assert robot.editor.session.recipe.fluid.viscosity == before.fluid.viscosity


def test_dragging_stops_at_numbers_that_are_shown(robot: Robot) -> None:
    robot.move(300, 24)
    robot.press()
    for x in range(301, 331, 7):
        robot.move(x, 24)
        pixels = robot.editor.state.brush.radius * 2 * 240
        assert pixels == pytest.approx(round(pixels), abs=1e-6)
    robot.release()


@pytest.mark.parametrize(("width", "height", "typed"), [(240, 180, 120), (180, 240, 90)])
def test_the_size_of_an_export_is_typed_as_it_is_shown(
    device: Device, tmp_path: Path, width: int, height: int, typed: int
) -> None:
    write_picture(tmp_path / "a.png", pattern(width, height))
    robot = Robot(device, load_any(tmp_path / "a.png"))
    robot.key("ctrl+e")
    robot.frame(count=3)
    dialog = robot.editor.dialogs.shown[-1]
    assert isinstance(dialog, ExportDialog)
    assert dialog.choices.size == 240
    type_into(robot, dialog.rect.x + 250, dialog.rect.y + 238, f"{typed} pixels")
    assert dialog.choices.size == 120
    robot.close()


def test_questions_show_the_files_that_answer_them(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[tuple[str, ...]] = []
    monkeypatch.setattr(FileChooser, "ask_which", lambda chooser, title, folder, endings, chosen: shown.append(endings))
    files, every = robot.editor.files, ("fluidwarp", "mp4", "npy", "png", "toml")
    for ask, wanted in (
        (files.ask_open, every), (files.ask_frames, ("png",)), (files.ask_apply, ("mp4", "png")),
        (files.ask_map, ("npy",)), (lambda: files.ask_mask(robot.editor.state), ("png",)),
        (files.ask_outlines, ("png",)),
    ):  # fmt: skip
        ask()
        assert tuple(ending for ending in every if f".{ending}" in shown[-1]) == wanted


# Keys ---------------------------------------------------------------------------------------------------------------


def test_tab_opens_and_closes_the_inspector_and_nothing_else(robot: Robot) -> None:
    for _ in range(4):
        robot.key("tab")
        robot.frame(count=2)
        assert not robot.editor.backend.is_typing
    robot.key("f")
    assert robot.editor.state.tool_name == "freeze"


def test_enter_ends_the_typing_in_an_export_field_and_starts_nothing(robot: Robot, tmp_path: Path) -> None:
    robot.editor.preferences.export_folder = str(tmp_path)
    robot.key("ctrl+e")
    robot.frame(count=3)
    dialog = robot.editor.dialogs.shown[-1]
    assert isinstance(dialog, ExportDialog)
    type_into(robot, dialog.rect.x + 250, dialog.rect.y + 238, "100")
    assert dialog.choices.size == 100
    assert not robot.editor.exports.is_running
    robot.click(dialog.rect.x + 100, dialog.rect.y + 397)
    robot.key("end")
    robot.type("2")
    robot.frame(count=2)
    robot.key("enter")
    robot.frame(count=2)
    assert dialog.name.endswith("2")
    assert robot.editor.dialogs.shown == [dialog]
    assert not robot.editor.exports.is_running
    # Nothing is being typed now.
    robot.key("enter")
    assert not robot.editor.dialogs.shown
    robot.until(lambda: not robot.editor.exports.is_running)
    assert (tmp_path / f"{dialog.name}.png").exists()


def test_the_wheel_goes_through_the_history(robot: Robot) -> None:
    for number in range(12):
        robot.drag((0.3 + 0.03 * number, 0.4), (0.35 + 0.03 * number, 0.45), steps=2)
    robot.rest()
    robot.see()
    robot.frame(Move(1140, 640))
    live(robot, 3)
    before = robot.pixels().astype(int)
    robot.frame(Wheel(0, 2))
    live(robot, 3)
    changed = np.abs(robot.pixels() - before)[570:690, 1016:1270].max(axis=-1) > 20
    assert changed.sum() > 1000
    assert robot.editor.view.zoom is None


CTRL = Mods(ctrl=True)


@pytest.mark.parametrize(
    "frames",
    [
        [[Key("", True, CTRL)], [Key("a", True, CTRL), Key("", False), Key("a", False)]],
        [[Key("", True, CTRL), Key("a", True, CTRL), Key("", False), Key("a", False)]],
        [[Key("", True, CTRL)], [Key("a", True, CTRL)], [Key("", False)], [Key("a", False)]],
    ],
    ids=["two frames", "one frame", "four frames"],
)
def test_a_chord_in_a_field_counts_with_the_modifier_that_it_was_pressed_with(
    robot: Robot, frames: list[list[Event]]
) -> None:
    dialog = naming_an_export(robot)
    for events in frames:
        robot.frame(*events)
    robot.type("new")
    robot.frame(count=4)
    assert dialog.name == "new"


# Over the picture ---------------------------------------------------------------------------------------------------


def is_untouched(robot: Robot) -> bool:
    session = robot.editor.session
    return session.recipe.stroke == () and len(session.document.history.entries) == 1


def test_closing_a_message_does_not_paint(robot: Robot) -> None:
    robot.editor.messages.warn("Cannot read a.png: it is no picture, or damaged; get it again.")
    robot.frame(count=3)
    rect = robot.editor.ui.covers[-1]
    x, y = rect.right - 14 - 11, rect.y + 10 + 9
    robot.move(x, y)
    assert not robot.editor.pointer.shows_ring
    robot.press()
    robot.frame(count=2)
    robot.release()
    robot.frame(count=2)
    assert not robot.editor.messages.shown
    assert is_untouched(robot)
    robot.frame(count=2)
    assert robot.editor.pointer.shows_ring


@pytest.mark.parametrize("what", ["message", "dialog"])
def test_a_double_click_on_what_goes_with_its_first_click_does_not_paint(robot: Robot, what: str) -> None:
    robot.key("t")  # a push that stays where it is would do nothing
    if what == "message":
        robot.editor.messages.warn("Cannot read a.png: it is no picture, or damaged; get it again.")
        robot.frame(count=3)
        rect = robot.editor.ui.covers[-1]
        x, y = rect.right - 14 - 11, rect.y + 10 + 9
    else:
        robot.key("ctrl+,")
        robot.frame(count=3)
        rect = robot.editor.dialogs.shown[-1].rect
        x, y = rect.right - 60, rect.bottom - 36
    robot.click(x, y)
    robot.frame(count=2)
    assert not robot.editor.messages.shown
    assert not robot.editor.dialogs.shown
    robot.click(x, y)
    assert is_untouched(robot)
    # Who waits a moment means the picture.
    robot.frame(dt=1.0)
    robot.click(x, y)
    assert not is_untouched(robot)


def test_the_ring_is_not_drawn_around_a_pointer_on_a_message(robot: Robot) -> None:
    robot.see()
    robot.editor.messages.warn("Cannot read a.png: it is no picture, or damaged; get it again.")
    robot.frame(count=6)
    plain, rect = robot.pixels(), robot.editor.ui.covers[-1]
    below = slice(int(rect.bottom) + 2, int(rect.bottom) + 40), slice(int(rect.x), int(rect.right))
    robot.move(rect.x + 60, rect.bottom - 6)
    robot.frame(count=6)
    assert np.array_equal(robot.pixels()[below], plain[below])
    robot.move(rect.x + 60, rect.bottom + 20)
    robot.frame(count=6)
    assert not np.array_equal(robot.pixels()[below], plain[below])


def test_cancelling_an_export_does_not_paint(robot: Robot, tmp_path: Path) -> None:
    dialog = export_dialog(robot, tmp_path)
    robot.editor.exports.start(dialog.job())
    robot.frame(count=3)
    rect = robot.editor.ui.covers[-1]
    robot.move(rect.right - 40, rect.y + 20)
    assert not robot.editor.pointer.shows_ring
    robot.press()
    robot.frame(count=2)
    robot.release()
    robot.frame(count=2)
    assert not robot.editor.exports.is_running
    assert is_untouched(robot)


def test_the_wheel_over_the_statistics_does_not_zoom(robot: Robot) -> None:
    robot.key("ctrl+i")
    robot.frame(count=3)
    robot.move(100, 80)
    robot.wheel(3)
    assert robot.editor.view.zoom is None


def test_a_stroke_may_begin_where_it_is_told_that_strokes_wait(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.work.playing.QUICK", 0.0)  # else a quick machine hardly ever falls behind
    editor = robot.editor
    session, canvas = editor.session, editor.layout.canvas
    press = Press(editor.state.brush, False, session.extent, session.dt)
    while session.target - session.tick <= BEHIND:
        session.press(TOOL["push"], press, 0.3, 0.5)
        session.move(0.5, 0.5)
        session.advance(1)
        session.release()
    robot.frame(count=3, dt=0)
    x, y = canvas.x + canvas.width / 2, canvas.y + 24
    robot.move(x, y)
    assert editor.pointer.shows_ring
    robot.press()
    assert session.is_painting


# Dialogs ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [(1280, 800), (800, 600), (800, 520)])
def test_the_head_of_a_dialog_stays_where_it_is(device: Device, tmp_path: Path, size: tuple[int, int]) -> None:
    robot = Robot(device, small_project(tmp_path), size)
    robot.drag((0.4, 0.4), (0.5, 0.4))
    robot.rest()
    robot.key("ctrl+e")
    robot.frame(count=5)
    dialog = robot.editor.dialogs.shown[-1]
    assert isinstance(dialog, ExportDialog)
    top, heights = dialog.rect.y, set()
    for kind in (1, 2, 0, 1):
        robot.click(dialog.rect.x + 100 + 150 * kind, top + 109)
        robot.frame(count=5)
        assert dialog.choices.kind == kind
        assert dialog.rect.y == top
        assert dialog.rect.bottom <= size[1]
        heights.add(dialog.rect.height)
    assert len(heights) > 1 or min(heights) > 0.9 * size[1]  # every kind fills a low window
    robot.close()


def test_all_that_a_frame_has_heard_is_taken_up_in_it_unless_a_button_has_to_wait(robot: Robot) -> None:
    """A pointer moves a thousand times a second, and frames are fewer: what is drawn must not fall behind."""
    places = [(100 + 4 * number, 300 + number % 7) for number in range(60)]
    robot.frame(*(Move(x, y, 1.0, robot.mods) for x, y in places))
    pointer = imgui.get_io().mouse_pos
    assert (pointer.x, pointer.y) == places[-1]
    dialog = naming_an_export(robot)
    robot.frame(*(Text(letter) for letter in "a long name"))
    robot.frame()
    assert dialog.name == "pattern warpeda long name"


@pytest.mark.parametrize("by_click", [False, True])
@pytest.mark.parametrize(("keys", "made"), [("ctrl+e", "pattern warped.png"), ("ctrl+s", "typed.fluidwarp")])
def test_what_goes_wrong_in_a_dialog_is_told_in_it(
    keys: str, made: str, by_click: bool, robot: Robot, tmp_path: Path
) -> None:
    robot.key(keys)
    robot.frame(count=3)
    dialog = robot.editor.dialogs.shown[-1]
    assert isinstance(dialog, ExportDialog | SaveDialog)

    def go_on() -> None:
        if by_click:
            robot.click(dialog.rect.right - 60, dialog.rect.bottom - 36)
        else:
            robot.key("enter")
        robot.frame(count=3)

    dialog.folder = tmp_path / "nowhere"
    robot.frame(count=2)
    before = dialog.rect.height
    go_on()
    assert robot.editor.dialogs.shown == [dialog]
    assert "nowhere" in dialog.problem
    assert not robot.editor.messages.shown
    assert dialog.rect.height > before
    dialog.folder = tmp_path
    if isinstance(dialog, SaveDialog):  # its name has the keys again
        robot.type("typed")
        robot.frame(count=2)
        assert dialog.name == "typed"
    go_on()
    assert not robot.editor.dialogs.shown
    robot.until(lambda: not robot.editor.exports.is_running)
    assert (tmp_path / made).exists()


# What is remembered -------------------------------------------------------------------------------------------------


def test_opening_a_picture_keeps_the_feel_and_the_export_folder(robot: Robot, tmp_path: Path) -> None:
    out, pictures = tmp_path / "out", tmp_path / "pictures"
    out.mkdir()
    pictures.mkdir()
    write_picture(pictures / "other.png", pattern(100, 60))
    session = robot.editor.session
    session.change(WATER.name, viscosity=WATER.viscosity, drag=WATER.drag)
    assert robot.editor.files.save_as(tmp_path / "work.fluidwarp")
    robot.key("ctrl+e")
    robot.frame(count=3)
    dialog = robot.editor.dialogs.shown[-1]
    assert isinstance(dialog, ExportDialog)
    assert dialog.folder == tmp_path
    dialog.folder = out
    robot.key("enter")
    robot.until(lambda: not robot.editor.exports.is_running)
    robot.drop(pictures / "other.png")
    assert robot.editor.canvas.size == (100, 60)
    assert WATER.fits(robot.editor.session.recipe.fluid)
    assert not robot.editor.workspace.can_redo
    assert not robot.editor.workspace.is_dirty
    robot.key("ctrl+e")
    robot.frame(count=3)
    dialog = robot.editor.dialogs.shown[-1]
    assert isinstance(dialog, ExportDialog)
    assert dialog.folder == out


def test_the_grid_is_chosen_for_a_picture_with_another_feel_too(device: Device, tmp_path: Path) -> None:
    from app.ui.quality import Speed

    write_picture(tmp_path / "other.png", pattern(100, 60))
    robot = Robot(device, small_project(tmp_path), preferences=Preferences(auto_quality=True))
    quality, speed = robot.editor.quality, Speed(1.0, 1000.0, 1.0)
    quality.speed, quality.grid = speed, speed.best_grid  # as if it had been measured
    robot.editor.session.change(PUTTY.name, viscosity=PUTTY.viscosity, drag=PUTTY.drag)
    assert robot.editor.files.save_as(tmp_path / "work.fluidwarp")
    robot.drop(tmp_path / "other.png")
    assert PUTTY.fits(robot.editor.session.recipe.fluid)
    assert robot.editor.session.recipe.fluid.grid == speed.best_grid
    robot.close()


def test_messages_of_the_window_name_no_options_of_the_command_line(robot: Robot, tmp_path: Path) -> None:
    write_picture(tmp_path / "strip.png", Picture(np.zeros((8, 4200, 3), np.uint8)))
    write_map(tmp_path / "forward.exr", Displacement(np.zeros((180, 240, 2), np.float32), forward=True))
    robot.drop(tmp_path / "strip.png")
    robot.drop(tmp_path / "forward.exr")
    narrow, forward = (message.text for message in robot.editor.messages.shown)
    assert narrow.startswith("strip.png is ")
    assert "too narrow for any grid" in narrow
    assert "tells where each point goes" in forward
    assert "--" not in narrow + forward


def test_escape_leaves_a_field_before_its_dialog(robot: Robot) -> None:
    dialog = naming_an_export(robot)
    robot.type("2")
    robot.frame(count=2)
    assert dialog.name.endswith("2")
    robot.key("escape")
    robot.frame(count=2)
    assert robot.editor.dialogs.shown == [dialog]
    ctrl_click(robot, dialog.rect.x + 250, dialog.rect.y + 238)
    robot.frame(count=2)
    robot.key("escape")
    robot.frame(count=2)
    assert robot.editor.dialogs.shown == [dialog]
    robot.key("escape")
    robot.frame(count=2)
    assert not robot.editor.dialogs.shown


def test_the_first_hint_does_not_come_back_after_a_kill(device: Device, tmp_path: Path) -> None:
    file = tmp_path / "preferences.json"
    robot = Robot(device, small_project(tmp_path), preferences=Preferences(auto_quality=False, path=file))
    try:
        robot.drag((0.3, 0.4), (0.4, 0.4))
        assert json.loads(file.read_text())["hint"] is False
    finally:
        robot.close()


def test_what_cannot_be_opened_asks_nothing_about_unsaved_work(robot: Robot, tmp_path: Path) -> None:
    (tmp_path / "junk.png").write_bytes(b"no picture")
    robot.drag((0.3, 0.4), (0.45, 0.4))
    robot.rest()
    robot.drop(tmp_path / "junk.png")
    robot.frame(count=2)
    assert not robot.editor.dialogs.shown
    (message,) = robot.editor.messages.shown
    assert "junk.png" in message.text


@pytest.mark.parametrize("grid", [48, 96, 160, 1024])
def test_the_grid_of_the_work_is_chosen_in_the_inspector(robot: Robot, widgets: Widgets, grid: int) -> None:
    session = robot.editor.session
    robot.editor.state.sections |= {"quality": True, "view": False, "fluid": False}
    robot.frame(count=3)
    fluid = session.recipe.fluid.model_copy(update={"grid": grid})
    session.preview(fluid=fluid)
    widgets.look()
    rows, index = widgets.lists["##detail"]
    assert str(grid) in rows[index]


# Small windows ------------------------------------------------------------------------------------------------------

SIZES = [(800, 600, 1.0), (800, 520, 1.0), (1280, 800, 2.0), (800, 600, 2.0), (800, 520, 2.0)]


@pytest.fixture(params=SIZES, ids=lambda size: f"{size[0]}x{size[1]} at {size[2]:.0%}")
def small(device: Device, tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Robot]:
    width, height, scale = request.param
    likes = Preferences(auto_quality=False, scale=scale)
    robot = Robot(device, small_project(tmp_path), (width, height), preferences=likes)
    robot.frame(count=3)
    yield robot
    robot.close()


def scaled(robot: Robot, rect: Rect) -> Rect:
    scale = robot.editor.ui.scale
    return Rect(rect.x / scale, rect.y / scale, rect.width / scale, rect.height / scale)


def test_every_tool_can_be_clicked_in_a_small_window(small: Robot) -> None:
    strip, scale = small.editor.layout.strip, small.editor.ui.scale
    assert strip is not None
    chosen = set()
    y = strip.y + 20 * scale
    while y < strip.bottom:
        for column in range(small.editor.layout.columns):
            small.click(strip.x + (24 + 44 * column) * scale, y)
            chosen.add(small.editor.state.tool_name)
        y += 20 * scale
    assert chosen == {tool.name for tool in TOOLS}


def test_the_inspector_comes_in_a_small_window(small: Robot) -> None:
    wide = scaled(small, small.editor.layout.canvas).width
    if small.editor.layout.inspector is None:
        small.key("tab")
    rect = small.editor.layout.inspector
    small.frame(count=2)
    rect = small.editor.layout.inspector
    assert rect is not None
    assert scaled(small, rect).width >= 200
    # And the picture is seen beside it, and can be painted.
    assert scaled(small, small.editor.layout.canvas).width >= 120
    small.drag((0.4, 0.3), (0.6, 0.3))
    assert len(small.editor.session.recipe.stroke) == 1
    assert rect.right <= small.size[0]
    small.key("tab")
    small.frame()
    assert small.editor.layout.inspector is None
    assert scaled(small, small.editor.layout.canvas).width >= min(wide, 200)


def test_what_the_lanes_say_ends_in_dots_where_it_has_no_room(small: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    """And all of it is told where the pointer rests."""
    whole, said, told = "Strokes become bars here: move them, stretch them, repeat them.", set[str](), set[str]()
    monkeypatch.setattr("app.ui.panels.lanes.fitting", lambda *given: said.add(line := fitting(*given)) or line)
    tooltip = Ui.tooltip
    monkeypatch.setattr(Ui, "tooltip", lambda *given, more="", **kinds: told.add(more) or tooltip(*given, **kinds))
    small.key("l")
    small.frame(count=2)
    is_cut = small.size[0] / small.editor.ui.scale < 600
    assert any(line.endswith(" ...") for line in said) == is_cut
    assert (whole in told) == is_cut
    assert is_cut or said == {whole}


BRUSH = {"radius", "hardness", "strength", "hold", "local"}  # of a push


def test_everything_about_the_brush_can_be_set_in_a_small_window(small: Robot) -> None:
    """What the bar has no room for is behind the button that ends it."""
    scale, width = small.editor.ui.scale, small.size[0]
    changed = set()
    for x in range(60, int(width / scale) - 270, 16):
        small.editor.state.brush = before = replace(
            small.editor.state.brush, radius=0.1, hardness=0.5, strength=0.5, hold=0.5, local=0.5
        )
        small.click(x * scale, 24 * scale)
        changed |= differing(small, before)
        small.frame(count=2)
        if small.editor.ui.has_popup:
            for down in (0, -1):  # what it has no room for is a turn of the wheel away
                small.frame(Move((x + 30) * scale, 100 * scale), Wheel(0.0, down))
                for y in range(60, 240, 12):
                    small.editor.state.brush = before
                    small.click((x + 30) * scale, y * scale)
                    if small.editor.ui.has_popup:
                        changed |= differing(small, before)
            small.key("escape")
            small.frame(count=2)
    assert changed == BRUSH


def differing(robot: Robot, before: object) -> set[str]:
    now = robot.editor.state.brush
    return {name for name in BRUSH if getattr(now, name) != getattr(before, name)}


def test_the_end_of_every_dialog_is_reached_in_a_small_window(small: Robot) -> None:
    small.key("ctrl+e")
    small.frame(count=4)
    dialog = small.editor.dialogs.shown[-1]
    assert isinstance(dialog, ExportDialog)
    dialog.choices.kind = ANIMATION
    small.frame(count=4)
    assert dialog.rect.bottom <= small.size[1]
    assert dialog.rect.y >= 0
    small.move(dialog.rect.x + dialog.rect.width / 2, dialog.rect.y + dialog.rect.height / 2)
    for _ in range(12):
        small.wheel(-3)
        small.frame()
    scale = small.editor.ui.scale
    # Cancel, left of Export in the lower right corner.
    small.click(dialog.rect.right - (24 + 96 + 8 + 48) * scale, dialog.rect.bottom - 36 * scale)
    small.frame(count=2)
    assert not small.editor.dialogs.shown


def test_names_come_at_once_and_what_they_do_to_a_pointer_that_rests(robot: Robot) -> None:
    robot.see()
    live(robot, 5)
    before = robot.pixels().astype(int)
    robot.frame(Move(24, 130))
    robot.frame()

    def lit(pixels: np.ndarray) -> int:
        """Pixels of a tooltip, right of the strip."""
        return int((np.abs(pixels - before)[100:220, 50:360].max(axis=-1) > 20).sum())

    name = lit(robot.pixels())
    assert name > 500
    live(robot, 5)
    assert lit(robot.pixels()) > 1.5 * name


def test_names_stand_beside_the_tools_if_they_are_wanted_and_there_is_room(robot: Robot) -> None:
    narrow = robot.editor.layout.canvas.width
    robot.editor.preferences.names = True
    robot.frame(count=2)
    strip = robot.editor.layout.strip
    assert strip is not None
    assert robot.editor.layout.canvas.width == narrow - 94
    robot.click(strip.right - 20, strip.y + 8 + 44 + 20)
    assert robot.editor.state.tool_name == "curve", "the name is a part of the button"
    for width in range(400, 1400, 50):
        layout = Layout.of(width, 700, 1.0, True, 12, 4, names=True)
        assert layout.tool == 40 or layout.canvas.width >= 360


@pytest.mark.parametrize(
    ("size", "scale"),
    [((1280, 800), 1.0), ((1280, 800), 2.0), ((800, 520), 1.0), ((800, 520), 2.0), ((3840, 2160), 2.0)],
)
def test_a_message_is_alone_in_a_corner_and_never_over_the_middle(
    device: Device, tmp_path: Path, size: tuple[int, int], scale: float
) -> None:
    robot = Robot(device, small_project(tmp_path), size, scale=scale)
    robot.editor.messages.warn("Cannot read a.png: it is no picture, or damaged; get it again.")
    robot.editor.messages.say("Another one that was said later, and that is seen first.")
    canvas = robot.editor.layout.canvas
    for _ in range(2):
        robot.frame(count=4)
        middle = canvas.middle
        assert not robot.editor.ui.is_covered(*middle)
        (rect,) = [rect for rect in robot.editor.ui.covers if rect.y < middle[1]]
        assert (rect.right, rect.y) == pytest.approx((canvas.right - 12 * scale, canvas.y + 12 * scale), abs=1)
        robot.editor.messages.shown.pop()
    robot.close()


def test_enter_saves_where_unsaved_work_is_asked_about(robot: Robot, tmp_path: Path) -> None:
    robot.drag((0.3, 0.4), (0.45, 0.4))
    robot.rest()
    assert robot.editor.files.save_as(tmp_path / "work.fluidwarp")
    robot.drag((0.3, 0.6), (0.45, 0.6))
    robot.rest()
    robot.key("ctrl+q")
    robot.frame(count=2)
    robot.key("enter")
    assert robot.editor.commands.closed
    assert not robot.editor.workspace.is_dirty
    assert not robot.editor.dialogs.shown


def test_waking_lasts_longer_than_the_hover_delays(robot: Robot) -> None:
    from imgui_bundle import imgui

    style = imgui.get_style()
    assert max(style.hover_stationary_delay + style.hover_delay_short, style.hover_delay_normal) < HOVERING


def test_every_button_that_shows_a_key_does_what_the_key_does(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of those that lie around the picture."""
    drawn, told, done = imgui.invisible_button, Ui.tooltip, list[str]()
    last, pressed, keys = "", "", dict[str, str]()

    def button(name: str, *more: Any) -> bool:
        nonlocal last
        last = name
        return drawn(name, *more) or name == pressed

    def tooltip(ui: Ui, title: str, key: str = "", *more: Any, **named: Any) -> None:
        nonlocal last
        if last and key in BY_KEY:
            keys[last] = key
        last = ""
        told(ui, title, key, *more, **named)

    monkeypatch.setattr(imgui, "invisible_button", button)
    monkeypatch.setattr(Ui, "tooltip", tooltip)
    monkeypatch.setattr(Editor, "do", lambda editor, name: done.append(name))
    robot.drag((0.4, 0.5), (0.5, 0.5), steps=2)  # so that there is something to undo
    robot.frame()
    by_action = set[str]()
    for name, key in dict(keys).items():
        pressed = name
        robot.frame(Move(700.0 + len(done) % 2, 20.0))
        pressed = ""
        assert done in ([], [BY_KEY[key].name]), name
        by_action |= set(done)
        done.clear()
    assert {"undo", "split", "inspector", "fit", "actual", "zoom_in", "zoom_out", "lanes", "play"} <= by_action


def test_the_statistics_are_of_the_map_before_the_first_step_and_of_steps_after_it(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    words, text = list[str](), Ui.text  # which dim words go through
    monkeypatch.setattr(
        Ui, "text", lambda ui, said, *more, **named: (words.append(said), text(ui, said, *more, **named))
    )
    robot.key("ctrl+i")
    robot.frame(count=3)
    assert "det J  1.00 to 1.00    folds 0" in words
    assert not [said for said in words if said.startswith("Step")]
    robot.drag((0.4, 0.5), (0.5, 0.5))
    robot.rest()
    robot.until(lambda: any(re.fullmatch(r"Step  \d+\.\d ms", said) for said in words))


def test_a_drag_goes_on_when_a_panel_comes_up(robot: Robot, widgets: Widgets) -> None:
    session = robot.editor.session
    before = session.recipe.fluid.drag
    widgets.look()
    x, y = widgets.at["Drag"].middle
    robot.move(x, y)
    robot.press()
    robot.editor.state.statistics = True  # as the note does that the picture is simulated again
    robot.frame(count=2)
    for step in range(4):
        robot.move(x + 10 * step, y)
    in_the_middle = session.recipe.fluid.drag
    robot.move(x + 80, y)
    robot.release()
    robot.rest()
    assert before != in_the_middle < session.recipe.fluid.drag


def test_keys_go_through_widgets_while_a_dialog_is_open_and_no_longer(robot: Robot) -> None:
    """Elsewhere Space and the arrows are the editor's, also after it."""
    through, seen = imgui.ConfigFlags_.nav_enable_keyboard.value, list[bool]()
    for key in ("", "ctrl+e", "escape", "f1", "escape"):
        if key:
            robot.key(key)
        robot.frame(count=3)
        seen.append(bool(imgui.get_io().config_flags & through))
    assert seen == [False, True, False, True, False]


def test_a_tool_that_is_chosen_by_its_key_is_brought_into_view(robot: Robot, widgets: Widgets) -> None:
    robot.size = (200, 300)  # too narrow for more columns
    widgets.look()

    def place(name: str) -> Rect:
        return next(each.rect for each in widgets.drawn if each.kind == "icon_button" and each.words == name)

    strip = robot.editor.layout.strip
    assert place("zoom").y > strip.bottom
    robot.key("z")
    robot.frame(count=2)
    widgets.look()
    assert strip.y <= place("zoom").y
    assert place("zoom").bottom <= strip.bottom

"""From the smallest window to the largest screen, at every size of the interface: nothing is cut off."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from datetime import datetime
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from app.media.animation import animation_writer
from app.media.pictures import write_picture
from app.media.project import from_picture
from app.model.bars import Which
from app.model.handles import RecipeHandle, RecipePin, labelled
from app.model.recipe import Recipe
from app.model.strokes import Stroke, ToolName
from app.model.tools import TOOLS
from app.model.undo import Entry
from app.ui.actions import ACTIONS
from app.ui.browser import Browser
from app.ui.dialogs import Dialog, PictureOrMap, Preferring, Unsaved
from app.ui.editor_state import SELECT_BY
from app.ui.export_choices import KINDS
from app.ui.export_dialog import ExportDialog
from app.ui.key_sheet import KeySheet
from app.ui.preferences import Preferences
from app.ui.recovery_dialog import Offer
from app.ui.saving import SaveDialog
from app.ui.window import SMALLEST
from app.work.journal import Origin, Work
from app.work.recovery import Found
from solver.gl.device import Device
from support.drawn import Drawn
from support.editing import Robot, Still, add_bars, pattern, small_project
from support.laid import Laid
from support.widgets import Widgets

SIZES = (SMALLEST, (1280, 800), (3840, 2160))
# Where room is short at every size of the interface, and where there is more at one or two: pairs, not all nine.
AT_SCALES = (*((SIZES[0], scale) for scale in (1.0, 1.5, 2.0)), (SIZES[1], 1.5), (SIZES[2], 1.0), (SIZES[2], 2.0))


def tools(robot: Robot, places: object) -> Iterator[str]:
    """Each with what can be set about it, in the bar and behind its last button."""
    state = robot.editor.state
    robot.editor.preferences.hint = True
    yield "start"
    for tool in TOOLS:
        for shown in (False, True):
            state.lanes.shown = shown
            state.choose_tool(tool.name, False)
            yield f"{tool.name}{', lanes' * shown}"
    state.lanes.shown = False
    for way in SELECT_BY:
        state.choose_tool("select", False)
        state.select_by = way
        yield f"select by {way}"
    state.choose_tool("push", False)
    state.statistics = True
    yield "statistics"


def time(robot: Robot, places: object) -> Iterator[str]:
    """The timeline, its bars and all of the inspector."""
    editor, state, session = robot.editor, robot.editor.state, robot.editor.session
    state.lanes.shown = state.inspector = state.over_narrow = True
    yield "no bars yet"
    ways: tuple[tuple[ToolName, float], ...] = ("push", 0.3), ("twirl", 0.6), ("bloat", 0.5), ("freeze", 0.8)
    strokes = tuple(
        Stroke(tool=tool, samples=((15 * k, x, 0.5, 1.0), (15 * k + 12, x + 0.1, 0.4, 1.0)))
        for k, (tool, x) in enumerate(ways)
    )
    led = RecipeHandle(at=(0.4, 0.5), to=(0.5, 0.45), duration=0.1, start=0.05)
    line = RecipeHandle(points=((0.2, 0.8), (0.35, 0.85), (0.5, 0.8)), at=(0.35, 0.8), to=(0.4, 0.7), duration=0.1)
    parts = {"handle": (led, line), "pin": (RecipePin(at=(0.7, 0.3)),)}
    session.edit("Strokes, handles and a pin with a long name", stroke=strokes, duration=2.0, **parts)
    add_bars(session)
    session.seek(session.end // 2)
    session.settle()
    editor.messages.shown.clear()
    yield "bars"
    those: tuple[Which, ...] = ("stroke", 1), ("force", 0), ("force", 1), ("handle", 0), ("pin", 0)
    for which in those:
        state.lanes.selected = {which}
        yield f"{which} is selected"
    state.lanes.selected = {("stroke", 0), ("stroke", 1)}
    yield "several are selected"
    state.lanes.selected = set()
    robot.key("g")
    for label in ("", "handle[1]", "handle[2]", "pin[1]"):
        state.selected = label
        yield f"the handle {label!r}"
    robot.key("f")
    state.sections = dict.fromkeys(("fluid", "symmetry", "view", "quality", "masks", "history", "numbers"), True)
    state.symmetry, state.split = "radial", 0.4
    for overlay in state.overlays.values():
        overlay.shown = True
    yield "all sections"
    state.mask = "thickness"
    yield "of the other mask"
    state.lanes.shown = False
    yield "without lanes"
    editor.preferences.names = True
    yield "names beside the tools"


def over(robot: Robot, places: dict[str, tuple[float, float]]) -> Iterator[str]:
    """What opens over the window, and what tells of work under way."""
    editor = robot.editor
    likes, scale, do = editor.preferences, editor.ui.scale, lambda *_: None
    likes.presets["My own"] = {"radius": 0.05, "hardness": 1.0, "strength": 0.5}
    likes.recent = ["/somewhere/a.png", "/elsewhere/b.fluidwarp"]
    robot.click(24 * scale, 24 * scale)
    yield "the menu"
    robot.key("escape")
    for tool in ("push", "twirl", "handle", "thicken"):
        editor.state.choose_tool(tool, False)
        robot.frame(count=2)
        robot.click(*places["more"])
        yield f"more about {tool}"
        robot.key("escape")
        robot.frame(count=2)
    robot.key("ctrl+e")
    asked = editor.dialogs.shown[-1]
    assert isinstance(asked, ExportDialog)
    for kind, (label, files) in enumerate(KINDS):
        asked.choices.kind = kind
        for number, file in enumerate(files):
            asked.choices.format[kind], asked.choices.finer = number, number % 2
            yield f"export {label} {file.name}"
    yield from ended(robot, asked)
    project = editor.session.project
    keys = KeySheet(editor.keys)
    for dialog in (
        Unsaved(editor.workspace, "quit", False, do, do),
        PictureOrMap("a picture with a long name, or a map.exr", do, do),
        SaveDialog(project, Path("folder/a.fluidwarp"), Preferences(), editor.chooser, do, None),
        Browser("Open", Path(__file__).parent, (".py",), do),
        Browser("Save the mask", Path(__file__).parent, (".py",), do, "mask.png"),
        Preferring(likes, editor.state),
        keys,
    ):
        editor.dialogs.show(dialog)
        yield dialog.title
        if dialog is keys:
            keys.choose(ACTIONS["export"])
            yield "a key is wanted"
            keys.hear("ctrl+s")
            yield "a key that is taken"
        yield from ended(robot, dialog)


def ended(robot: Robot, dialog: Dialog) -> Iterator[str]:
    dialog.problem = "Cannot write a.png: there is no room left on the disk; make some, or choose another folder."
    yield f"{dialog.title}: a problem"
    dialog.close()
    robot.frame(count=2)


def restoring(robot: Robot, places: object) -> Iterator[str]:
    """What is found at the start: more than fits without scrolling, and one."""
    editor = robot.editor
    recipe = Recipe(stroke=(Stroke(tool="push", samples=((0, 0.3, 0.5, 1.0),)),), pin=(RecipePin(at=(0.7, 0.3)),))
    entries = (Entry("Open", Recipe(), 0), Entry("Push", recipe, 0))
    origin = Origin("a picture with a long name, and more than that", "/of/somebody", None, False, False, 0, 0)
    held: Any = None  # which nobody lets go of
    found = [Found(held, origin, Work(entries, 1, Recipe()), datetime(2024, 12, 24, 20)) for _ in range(6)]
    source: Any = SimpleNamespace(offered=found, later=found.clear)
    for count in (6, 1):
        del found[count:]
        editor.dialogs.show(offer := Offer(source))
        yield f"{count} works to restore"
        offer.close()
        robot.frame(count=2)


def work(robot: Robot, places: object) -> Iterator[str]:
    """What is found at the start, a clip, and what goes on in other processes; in the light theme."""
    editor, folder = robot.editor, robot.editor.session.project.folder
    editor.preferences.theme = "light"
    yield from restoring(robot, places)
    with animation_writer(folder / "clip.apng", Fraction(5)) as write:
        for _ in range(3):
            write(pattern(96, 64).pixels)
    robot.drop(folder / "clip.apng")
    assert editor.session.project.clip is not None
    yield "a clip"
    robot.key("ctrl+e")
    asked = editor.dialogs.shown[-1]
    assert isinstance(asked, ExportDialog)
    asked.choices.kind = 1
    yield "export of a clip"
    asked.close()
    led = RecipeHandle(at=(0.4, 0.5), to=(0.5, 0.45), duration=0.1)
    editor.session.edit("A handle", handle=(led,), duration=0.5)
    editor.session.settle()
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("app.ui.export_dialog.ExportProcess", Still)
        patched.setattr("app.ui.fitting.FitProcess", Still)
        editor.fits.start()
        yield "a fit under way"
        job: Any = SimpleNamespace(target=Path("a picture with a long name warped.png"), check=lambda: None)
        editor.exports.start(job)
        yield "an export as well"
        editor.state.lanes.shown = True
        yield "and lanes, so that there may be no room for both"
        assert (editor.exports.is_running, editor.fits.is_running) == (True, True)
        editor.state.lanes.shown = False
    editor.messages.caution(
        "Handle 1 is 69.5 pixels from where it should be: the picture around it cannot bend further."
    )
    yield "a message as well"
    editor.fits.give_up()
    editor.session.seek(0)
    editor.session.replay.seek(0)
    editor.session.seek(editor.session.end)
    yield "a message, and an export"
    editor.exports.cancel()
    yield "a message"


TOURS = (tools, time, over, work)


@pytest.mark.parametrize("tour", TOURS, ids=lambda tour: tour.__name__)
@pytest.mark.parametrize(
    ("size", "scale"), AT_SCALES, ids=[f"{width}x{height}-{scale:.0%}" for (width, height), scale in AT_SCALES]
)
def test_nothing_is_cut_off_or_over_something_else(
    device: Device, tmp_path: Path, size: tuple[int, int], scale: float, tour: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    likes = Preferences(auto_quality=False, scale=scale)
    laid, told = Laid(monkeypatch), dict[str, str]()
    with Robot(device, small_project(tmp_path), size, preferences=likes) as robot:
        for state in tour(robot, laid.places):  # pyright: ignore[reportCallIssue]
            robot.move(size[0] / 2, size[1] / 2)
            robot.frame(count=2 if tour is work else 1)  # what is at work goes on meanwhile
            if laid.faults(robot.frame):  # what has come in this frame is laid out in the next one
                robot.frame(count=2)
                told |= {fault: state for fault in laid.faults(robot.frame) if fault not in told}
    assert not told, "\n".join(f"{state}: {fault}" for fault, state in told.items())


def test_what_floats_lies_on_the_canvas_however_narrow_that_is(
    device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also on a screen that is smaller than the smallest window."""
    likes, told = Preferences(auto_quality=False, hint=True), list[str]()
    laid, widths = Laid(monkeypatch), set[float]()
    with Robot(device, small_project(tmp_path), SIZES[0], preferences=likes) as robot:
        for tool in ("push", "freeze", "handle", "select"):
            robot.editor.state.choose_tool(tool, False)
            robot.editor.state.overlays["viscosity"].shown = tool == "push"
            for width in range(500, 900, 12):
                robot.size = width, 520
                robot.frame(count=2)
                canvas = robot.editor.layout.canvas
                found = laid.faults(robot.frame, canvas)
                told += [f"{tool}, {canvas.width}: {fault}" for fault in found if fault.endswith("the canvas")]
                widths.add(canvas.width)
    assert len(widths) > 20
    assert not told


def test_answers_stand_in_one_row_wherever_that_leaves_eight_points_between_them(
    device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    likes, rows, do = Preferences(auto_quality=False), list[bool](), lambda *_: None
    with Robot(device, small_project(tmp_path), (460, 400), preferences=likes) as robot:
        widgets = Widgets(robot, monkeypatch)
        robot.editor.dialogs.show(PictureOrMap("a.exr", do, do))
        for width in range(460, 436, -1):
            robot.size = width, 400
            robot.frame(count=2)
            first, second = widgets.at["Cancel"], widgets.at["Use as map"]
            rows.append(abs(first.y - second.y) < 1)
            assert rows[-1] == (second.x - first.right >= 8), width
    assert set(rows) == {True, False}


def test_the_bar_has_room_for_export_however_narrow_it_is(
    device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Sliders that it has no room for go behind its last button, which has to have room itself."""
    likes, told, laid = Preferences(auto_quality=False, scale=1.5), dict[str, list[str]](), Laid(monkeypatch)
    with Robot(device, small_project(tmp_path), SIZES[0], preferences=likes) as robot:
        for tool in TOOLS:
            robot.editor.state.choose_tool(tool.name, False)
            hints = range(1000, 1300, 11) if tool.gesture is None else ()  # for which there is room in some of these
            for width in (*range(700, 900, 11), *hints):
                robot.size = width, 520
                robot.frame(count=2)
                if faults := laid.faults(robot.frame):
                    told[f"{tool.name}, {width}"] = faults
    assert not told


DRAWN = ("add_", "push_clip_rect", "text_unformatted", "input_text", "combo")  # at places of the screen
PLACES = {"add_circle": 2, "add_circle_filled": 2, "add_polyline": 6, "add_text": 2, "text_unformatted": 2}  # else 4
ACROSS, DOWN, WIDE, THIN = 6.0, 2.0, 5.0, 0.3  # points that are no fault: of places, widths, and thicknesses
NARROW = 8.0  # points; what is narrower has no letters on it, and is as wide as it is meant to be


@pytest.mark.parametrize("tour", [time, over, restoring], ids=lambda tour: tour.__name__)
def test_at_200_percent_all_is_twice_as_far_apart_and_twice_as_large(
    device: Device, tmp_path: Path, tour: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    """But for what letters are rounded to, which adds up along a row."""
    laid, told = Laid(monkeypatch), list[str]()
    scenes: tuple[dict[str, list[str]], ...] = {}, {}
    recipe = small_project(tmp_path).recipe
    write_picture(tmp_path / "pattern.png", pattern(960, 720))
    for scale, found in zip((1.0, 2.0), scenes, strict=True):
        size, likes = (round(1280 * scale), round(800 * scale)), Preferences(auto_quality=False, scale=scale)
        with Robot(device, from_picture(tmp_path / "pattern.png", recipe), size, preferences=likes) as robot:
            for state in tour(robot, laid.places):  # pyright: ignore[reportCallIssue]
                view = robot.editor.workspace.view
                robot.editor.workspace.view = replace(view, zoom=0.8 * scale)
                robot.move(0.1 * size[0], 0.12 * size[1])  # beside what opens
                robot.frame(count=3)
                laid.faults(robot.frame)  # which notes where things are
                with pytest.MonkeyPatch.context() as noting:  # of one frame in several: what is noted takes its time
                    drawn = Drawn(noting)
                    robot.frame()
                found[state] = [line for line in drawn.take() if line.startswith(DRAWN)]
    for state, lines in scenes[0].items():
        if not state.startswith(("Preferences", "Keyboard", "a key")):  # which show the scale itself; many rows
            twice = scenes[1][state]
            assert len(lines) == len(twice), state
            told += [f"{state}: {a}    {b}" for a, b in zip(lines, twice, strict=True) if not _is_twice(a, b)]
    assert not told, "\n".join(told[:40])


def _is_twice(line: str, other: str) -> bool:
    """Whether `other` is `line` twice as large; both are as `Drawn` notes them, and only lengths have a point."""
    split = (re.sub(r"\|.*", _without_numbers, each).split(" | ") for each in (line, other))
    (numbers, *words), (twice, *words_too) = split
    (name, *mine), (name_too, *theirs) = numbers.split(), twice.split()
    if (name, words, len(mine)) != (name_too, words_too, len(theirs)):
        return False
    places, off = PLACES.get(name, 4), list[float]()
    for a, b in zip(mine, theirs, strict=True):
        if "." in a and "." in b:
            off.append(float(b) / 2 - float(a))
        elif a != b:
            return False
    rest = off[places:] if name != "add_image" else []  # which part of it
    if name == "add_rect_filled" and float(mine[2]) - float(mine[0]) < NARROW:
        rest.append(off[2] - off[0])
    return (
        all(abs(each) < ACROSS for each in off[:places:2])
        and all(abs(each) < DOWN for each in off[1:places:2])
        and (places != 4 or abs(off[2] - off[0]) < WIDE)
        and all(abs(each) < THIN for each in rest)
    )


def _without_numbers(found: re.Match[str]) -> str:
    """Words as they are on any machine, at any size of the picture."""
    return re.sub(r"\d[\d.]*", "0", found[0])


def test_how_far_a_handle_with_a_name_goes_is_told_below_it(
    device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beside the name there was no room for "up to 60 px left"."""
    ends = (0.3, 0.5), (0.6, 0.5)
    line = RecipeHandle(name="a sleeve", at=(0.45, 0.5), points=ends, to=(0.5, 0.5), rotate=90.0, end=0.1)
    laid = Laid(monkeypatch)
    with Robot(device, small_project(tmp_path), SIZES[1], preferences=Preferences(auto_quality=False)) as robot:
        session, state = robot.editor.session, robot.editor.state
        session.edit("Handle", handle=(line,), duration=0.05)
        session.seek(session.end)
        state.choose_tool("handle", False)
        ((state.selected, _),) = labelled((line,), ())
        robot.rest()
        assert laid.faults(robot.frame) == []

"""What the window draws in its states, shape by shape and word by word, as it is written down.

After a change of the looks that is meant: `FLUIDWARP_GOLDEN=write pytest tests/ui/test_drawn.py`, and read the change.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from imgui_bundle import imgui

from app.model.forces import PointForce, VortexForce
from app.model.handles import RecipeHandle, RecipePin
from app.model.strokes import Change, Stroke, ToolName
from app.ui import theme
from app.ui.actions import ACTIONS
from app.ui.browser import Browser
from app.ui.dialogs import PictureOrMap, Unsaved
from app.ui.editor_state import SELECT_BY
from app.ui.events import Mods
from app.ui.export_choices import ANIMATION, MAP
from app.ui.export_dialog import ExportDialog
from app.ui.preferences import Preferences
from app.ui.saving import SaveDialog
from app.work import playing, recording
from solver.gl.device import Device
from support.drawn import Drawn, differences, new_in
from support.editing import Robot, add_bars, small_project, summary
from support.golden import GOLDEN, WRITES, scenes_of
from support.widgets import Widgets

FILE = GOLDEN / "drawn.txt"
HIGH = (1100, 1500)  # all of the inspector is seen


def tools_and_marks(robot: Robot) -> Iterator[str]:
    """The picture and what lies over it."""
    state, session = robot.editor.state, robot.editor.session
    robot.move(700, 20)
    yield "start"
    for key in ("1", "2", "3", "4", "5"):
        robot.key(key)
    state.overlays["grid"].opacity = 0.4
    state.symmetry, state.sectors, state.split = "radial", 5, 0.3
    robot.key("shift+p")
    whirl = VortexForce(kind="vortex", point=(0.5, 0.5), strength=0.1, name="Whirl", during=(0.5, 1.8))
    drop = PointForce(kind="point", point=(0.2, 0.7), direction=(1.0, 0.0), radius=0.1, at=(0.2,))
    session.edit("Forces", force=(whirl, drop), freeze=())
    robot.drag((0.35, 0.5), (0.5, 0.45))
    robot.move(*robot.at(0.4, 0.6))
    yield "overlays, a split, sectors and the ring"
    state.symmetry, state.split, state.stabiliser = "both", None, 40.0
    robot.move(*robot.at(0.6, 0.6))
    yield "a string that pulls nothing yet"
    robot.press()
    for step in range(20):
        robot.move(*robot.at(0.6 + 0.01 * step, 0.6 - 0.02 * step))
    yield "a stroke under way, on its string"
    robot.release()
    robot.rest()
    state.symmetry, state.stabiliser = "none", 0.0
    for key in ("1", "2", "3", "4", "5"):
        robot.key(key)
    robot.key("\\")
    robot.hold("\\", True)
    yield "before"
    robot.hold("\\", False)
    robot.key("n")
    robot.editor.commands.zoom_to(3.0)
    yield "zoomed"
    robot.editor.commands.zoom_fit()
    robot.click(*robot.at(0.1, 0.9))
    robot.mods = Mods(shift=True)
    robot.click(*robot.at(0.9, 0.9))
    robot.mods = Mods()
    yield "a long stroke that waits"
    robot.rest()
    for way in SELECT_BY:
        state.choose_tool("select", False)
        state.select_by = way
        robot.move(*robot.at(0.2, 0.3))
        robot.press()
        for step in range(8):
            robot.move(*robot.at(0.2 + 0.05 * step, 0.3 + 0.004 * step * step))
        yield f"selecting by {way}"
        robot.editor.pointer.drag = None
        robot.editor.selecting.path = []
    state.mask = "thickness"
    yield "a selection of thickness"
    state.choose_tool("push", False)


def handles(robot: Robot) -> Iterator[str]:
    state = robot.editor.state
    robot.key("g")
    yield "no handles yet"
    line = RecipeHandle(points=((0.2, 0.8), (0.35, 0.85), (0.5, 0.8)), at=(0.35, 0.8), to=(0.4, 0.7), duration=0.1)
    handle = RecipeHandle(at=(0.4, 0.5), to=(0.5, 0.45), duration=0.1, start=0.05)
    parts = {"handle": (handle, line), "pin": (RecipePin(at=(0.7, 0.3)),)}
    robot.editor.session.edit("Handles", **parts, duration=0.5)
    robot.editor.session.seek(5)
    robot.editor.session.settle()
    state.selected = "handle[2]"
    robot.move(700, 20)
    yield "a line on its way, which is selected"
    state.selected = "handle[1]"
    yield "a handle is selected"
    robot.key("p")
    robot.move(700, 20)
    yield "another tool in hand"


def begin_with_strokes(robot: Robot) -> None:
    """Four of them, one after the other, in two seconds."""
    ways: tuple[tuple[ToolName, float, float], ...]
    ways = (("push", 0.3, 0.4), ("twirl", 0.6, 0.6), ("bloat", 0.5, 0.5), ("freeze", 0.8, 0.9))
    strokes = tuple(
        Stroke(tool=tool, samples=((15 * k, start, 0.5, 1.0), (15 * k + 12, end, 0.4, 1.0)))
        for k, (tool, start, end) in enumerate(ways)
    )
    robot.editor.session.edit("Strokes", stroke=strokes, duration=2.0)
    robot.frame(count=2)


def time(robot: Robot) -> Iterator[str]:
    """The timeline and its bars."""
    session, state = robot.editor.session, robot.editor.state
    begin_with_strokes(robot)
    add_bars(session)
    session.edit("Change", change=(Change(tick=9, drag=1.0),))
    session.seek(session.end // 2)
    session.settle()
    robot.frame(count=2)
    yield "half way through"
    robot.key("l")
    robot.move(700, 20)
    yield "bars"
    for which in (("stroke", 1), ("force", 0), ("force", 1)):
        rect = next(rect for bar, rect in state.lanes.drawn if bar.which == which)
        robot.click(*rect.middle)
        robot.frame(dt=1.0)
        robot.frame(dt=1.0)
        yield f"{which} is selected"
    rect = next(rect for bar, rect in state.lanes.drawn if bar.which == ("stroke", 0))
    robot.move(*rect.middle)
    robot.press()
    robot.move(rect.middle[0] + 40, rect.middle[1])
    yield "a bar in hand"
    robot.release()
    session.settle()
    state.lanes.selected = {("stroke", 0), ("stroke", 1)}
    state.lanes.zoom(session.end, session.end / 2, 0.3)
    robot.move(700, 20)
    yield "several, nearer"
    session.repeat(loops=False, returns=True)
    session.preview(amount=0.5)
    yield "there and back, half of it"
    session.commit("Amount")
    brief = [Stroke(tool="push", samples=((tick, 0.3, 0.5, 1.0),), repeat=9, every=2) for tick in (0, 400)]
    hit = PointForce(kind="point", point=(0.2, 0.7), direction=(1.0, 0.0), radius=0.1, at=(0.2,))
    session.edit("Brief", stroke=tuple(brief), force=(hit,), duration=90.0)
    state.lanes.view = None
    robot.frame(count=2)
    yield "bars that are as narrow as can be"


def dialogs(robot: Robot) -> Iterator[str]:
    """What opens over the window."""
    editor = robot.editor
    robot.drag((0.35, 0.5), (0.5, 0.45))
    robot.rest()
    editor.preferences.presets["My own"] = {"radius": 0.05, "hardness": 1.0, "strength": 0.5}
    editor.preferences.recent = ["/somewhere/a.png", "/elsewhere/b.fluidwarp"]
    with pytest.MonkeyPatch.context() as noting:
        places = {widget.words: widget.rect.middle for widget in Widgets(robot, noting).drawn}
    for name, button in (("menu", "menu"), ("more of the brush", "more")):
        robot.click(*places[button])
        robot.frame(count=2)
        yield name
        robot.key("escape")
        robot.frame(count=2)
    editor.messages.say("First.")
    editor.messages.done("Second, which went well.")
    editor.messages.warn("Cannot read a.png: it is no picture, or damaged; get it again.")
    robot.frame(count=2)
    yield "messages"
    before, robot.size = robot.size, (1300, 720)
    robot.frame(count=2)
    yield "messages beside what is under way"
    robot.size = before
    editor.messages.shown.clear()
    robot.key("ctrl+e")
    asked = editor.dialogs.shown[-1]
    assert isinstance(asked, ExportDialog)
    asked.folder = Path("folder")
    for kind, number, variant in (*((0, n, 0) for n in range(2)), (ANIMATION, 0, 1), (ANIMATION, 5, 0), (MAP, 0, 0)):
        asked.choices.kind, asked.choices.format[kind], asked.choices.variant[kind][number] = kind, number, variant
        asked.choices.finer = 1
        robot.frame(count=3)
        yield f"export {kind} {number}"
    asked.close()
    robot.frame(count=2)
    for chord, name in (("f1", "shortcuts"), ("ctrl+,", "preferences")):
        robot.key(chord)
        robot.frame(count=3)
        yield name
        editor.dialogs.shown[-1].close()
        robot.frame(count=2)
    project, do = editor.session.project, lambda *_: None
    short = replace(project, folder=Path("pictures"))  # words are broken by how long they are
    shown = (
        Unsaved(editor.workspace, "quit", False, do, do),
        Unsaved(editor.workspace, "open a.png", True, do, do),
        PictureOrMap("a.exr", do, do),
        SaveDialog(short, Path("folder/a.fluidwarp"), Preferences(), editor.chooser, do, None),
        SaveDialog(short, Path("folder/a.fluidwarp"), Preferences(embed=False), editor.chooser, do, None),
        Browser("Open", project.folder, (".png",), do),
        Browser("Save the mask", project.folder, (".png",), do, "mask.png"),
    )
    for number, dialog in enumerate(shown):
        editor.dialogs.show(dialog)
        robot.frame(count=3)
        yield f"{number} {dialog.title}"
        dialog.close()
        robot.frame(count=2)


def panels(robot: Robot) -> Iterator[str]:
    """All sections of the inspector, both themes, other sizes."""
    state, editor = robot.editor.state, robot.editor
    robot.key("f")
    robot.drag((0.35, 0.5), (0.5, 0.45))
    robot.rest()
    robot.key("p")
    robot.drag((0.35, 0.7), (0.4, 0.65))
    robot.rest()
    names = ("fluid", "symmetry", "view", "quality", "masks", "history")
    state.sections = dict.fromkeys(names, True) | {"numbers": False}
    state.symmetry = "radial"
    state.toggle_overlay("frozen")
    robot.move(700, 20)
    yield "all sections"
    robot.move(1000, 110)
    yield "a slider under the pointer"
    state.mask = "thickness"
    editor.session.undo()
    robot.rest()
    yield "another mask, and an edit taken back"
    robot.key("ctrl+l")
    yield "light"
    editor.preferences.scale = 1.5
    robot.frame(count=2)
    yield "half as large again"
    editor.preferences.scale, editor.preferences.names = 1.0, True
    robot.frame(count=2)
    yield "names beside the tools"
    robot.key("tab")
    robot.frame(count=2)
    yield "without the inspector"
    robot.key("tab")
    for tool in ("pan", "zoom", "freeze", "handle"):
        state.choose_tool(tool, False)
        yield f"{tool} in hand"
    robot.size = (600, 400)
    robot.frame(count=2)
    yield "a small window"
    robot.size = (200, 300)
    robot.frame(count=2)
    yield "a very small window"


TOURS = (tools_and_marks, handles, time, dialogs, panels)


@pytest.fixture(scope="module")
def golden() -> Iterator[dict[str, list[str]]]:
    """What was written down, by tour and scene; or, where it is to be written anew, what is found."""
    yield from scenes_of(FILE, imgui.get_version())


@pytest.fixture(autouse=True)
def a_tick_a_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    """However fast the machine is."""
    monkeypatch.setattr(playing, "QUICK", 0.0)
    monkeypatch.setattr(playing, "PATIENCE", 0.0)
    monkeypatch.setattr(recording, "RETURN", 600.0)


@pytest.mark.parametrize("tour", TOURS, ids=lambda tour: tour.__name__)
def test_draws_what_is_written_down(device: Device, tmp_path: Path, tour: object, golden: dict[str, list[str]]) -> None:
    if not device.limits.is_software or (not WRITES and FILE.read_text("utf-8").split("\n")[0] != imgui.get_version()):
        pytest.skip("letters lie elsewhere in other versions of imgui, and numbers differ on other GPUs")
    robot = Robot(device, small_project(tmp_path), HIGH if tour in (panels, handles) else (1100, 720), sees=True)
    before, told = Counter[str](), list[str]()

    def drawn_in_a_frame() -> list[str]:
        """Of one in several: what is noted takes its time."""
        with pytest.MonkeyPatch.context() as noting:
            drawn = Drawn(noting, pressed=True)
            robot.frame()
        return drawn.take()

    try:
        if tour is not tools_and_marks:  # of which the first scene is what all begin with
            before = Counter(drawn_in_a_frame())
        for scene in tour(robot):  # pyright: ignore[reportCallIssue]
            lines = [re.sub(r"at \d\d:\d\d", "at some time", line) for line in drawn_in_a_frame()]
            lines = [line.replace(str(tmp_path), "FOLDER").replace("\n", " ") for line in lines]
            lines = [line for line in lines if "Simulating" not in line]  # so many steps as there was time for
            # What stays as it is, is written down once.
            found, before = new_in(lines, before), Counter(lines)
            name = f"{tour.__name__}: {scene}"  # pyright: ignore[reportAttributeAccessIssue]
            if WRITES:
                golden[name] = found
            told += [f"{scene}: {line}" for line in differences(found, golden[name])]
    finally:
        robot.close()
    assert not told, "\n".join(told[:40])


@pytest.mark.parametrize("scale", [1.0, 1.5])
@pytest.mark.parametrize("name", theme.PALETTES)
def test_imguis_own_widgets_look_as_is_written_down(name: str, scale: float, golden: dict[str, list[str]]) -> None:
    context = imgui.create_context()
    try:
        theme.apply(theme.PALETTES[name], scale)
        style = imgui.get_style()
        found = [f"{part} {getattr(style, part)}" for part in dir(style) if not part.startswith("_")]
        found = [line for line in found if "<" not in line and "object" not in line]
        for colour in imgui.Col_:
            if colour.name != "count":
                value = style.color_(colour)
                found.append(
                    f"{colour.name} {' '.join(f'{part:.3f}' for part in (value.x, value.y, value.z, value.w))}"
                )
    finally:
        imgui.destroy_context(context)
    if WRITES:
        golden[f"style {name} {scale}"] = found
    assert found == golden[f"style {name} {scale}"]


def test_every_action_does_what_is_written_down(device: Device, tmp_path: Path, golden: dict[str, list[str]]) -> None:
    """One after the other, on a work of two strokes and a handle, the playhead in the middle."""
    robot, found = Robot(device, small_project(tmp_path), (400, 300)), list[str]()
    editor = robot.editor
    try:
        robot.editor.commands.clipboard = lambda text: None

        begin_with_strokes(robot)
        editor.session.edit("Handle", handle=(RecipeHandle(at=(0.5, 0.3), to=(0.6, 0.3)),))
        editor.session.seek(editor.session.end // 2)
        for name in ACTIONS:
            if name in ("copy_picture", "paste", "fit_handles"):  # want a clipboard, or another process
                continue
            if name.startswith("bars_"):
                editor.state.lanes.selected = {("stroke", 0), ("stroke", 1)}
            before = summary(robot)
            editor.do(name)
            robot.frame()
            after = summary(robot)
            told = (f"{key} {value}" for key, value in after.items() if value != before[key])
            found.append(f"{name}: {'; '.join(told)}".replace(str(tmp_path), "FOLDER"))
            editor.session.settle()  # or it would pause half-way, the sooner the more checkpoints there are
            editor.session.pause()
            while editor.dialogs.shown:
                editor.dialogs.shown[-1].close()
                robot.frame(count=2)
            editor.messages.shown.clear()
    finally:
        robot.close()
    if WRITES:
        golden["actions"] = found
    assert found == golden["actions"]

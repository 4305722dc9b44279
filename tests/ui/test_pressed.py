"""What comes of each widget of dialogs and panels that is pressed, as `golden/pressed.txt` has it.

What is set by it, done and told, and which words come and go. After a change that is meant: `FLUIDWARP_GOLDEN=write
pytest` of this file, and read the change.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from copy import deepcopy
from dataclasses import asdict, fields, is_dataclass, replace
from datetime import datetime
from fractions import Fraction
from importlib import import_module
from pathlib import Path, PurePath
from types import SimpleNamespace
from typing import Any

import pytest
from imgui_bundle import imgui

from app.errors import UserError
from app.media.animation import animation_writer
from app.model.areas import Part
from app.model.bars import Which
from app.model.handles import RecipeHandle, RecipePin
from app.model.recipe import Recipe
from app.model.strokes import Stroke
from app.model.undo import Entry
from app.ui.actions import ACTIONS
from app.ui.browser import Browser
from app.ui.dialogs import Dialog, PictureOrMap, Preferring, Unsaved
from app.ui.events import Move
from app.ui.export_choices import ANIMATION, MAP, PICTURE
from app.ui.export_dialog import ExportDialog, StillExporting
from app.ui.key_sheet import KeySheet
from app.ui.recovery_dialog import Offer
from app.ui.saving import SaveDialog
from app.ui.viewport import Rect
from app.work import playing, recording
from app.work.journal import Origin, Work
from app.work.recovery import Found
from app.work.worker import Outcome
from solver.gl.device import Device
from support.drawn import Drawn, new_in
from support.editing import Robot, add_bars, export_dialog, pattern, small_project, summary
from support.golden import GOLDEN, WRITES, scenes_of
from support.widgets import Widget, Widgets

FILE = GOLDEN / "pressed.txt"
SIZE = (1280, 2000)  # all of the inspector is seen
LAID = ("rect", "entered", "_top", "_placed_for", "_highest", "_scrolls", "_is_settled", "_doubted_at")
"""Of a dialog, what tells where it lies and when something was pressed."""
WORDS = ("add_text ", "text_unformatted ", "menu_item ", "begin_menu ", "input_text ")
PANELS = "bar", "strip", "timebar", "inspector", "hud"
KINDS = "key", "button", "icon_button", "slider", "check", "choice", "input_text", "selectable"
IN_PANELS = "slider", "slider twice", "check", "choice", "list", "section", "input_text_with_hint"
"""What their buttons do, `test_actions.py` tells."""
MOST = 8  # changes that are written down of one press


@pytest.fixture(autouse=True)
def a_tick_a_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    """However fast the machine is; and a step where the work is as it was again."""
    monkeypatch.setattr(playing, "QUICK", 0.0)
    monkeypatch.setattr(playing, "PATIENCE", 0.0)
    monkeypatch.setattr(recording, "RETURN", 0.0)


@pytest.fixture(scope="module")
def golden() -> Iterator[dict[str, list[str]]]:
    """What was written down, by scene; or, where it is to be written anew, what is found."""
    if not WRITES and FILE.read_text("utf-8").split("\n")[0] != imgui.get_version():
        pytest.skip("widgets lie elsewhere in other versions of imgui")
    yield from scenes_of(FILE, imgui.get_version())


def leaves(value: Any, path: str = "") -> Iterator[tuple[str, str]]:
    """The plain values in what holds others, by where they are in it."""
    if isinstance(value, dict):
        parts = list(value.items())
    elif is_dataclass(value) and not isinstance(value, type):
        parts = [(each.name, getattr(value, each.name)) for each in fields(value)]
    elif isinstance(value, (list, tuple)) and any(isinstance(part, (dict, list, tuple)) for part in value):
        parts = list(enumerate(value))
    else:
        if isinstance(value, float):
            value = f"{value:.4g}"
        elif isinstance(value, (list, tuple)):
            value = [f"{part:.4g}" if isinstance(part, float) else part for part in value]
        yield path, str(value)
        return
    for name, part in parts:
        yield from leaves(part, f"{path}.{name}" if path else str(name))


def plain(owner: object) -> dict[str, Any]:
    """The attributes that are numbers, words, paths or tuples and dicts of these."""
    kinds = (str, int, float, type(None), tuple, PurePath, dict)
    return {name: value for name, value in vars(owner).items() if isinstance(value, kinds) and name not in LAID}


class Pressing:
    """Presses one widget after the other, and begins again each time where it was.

    Args:
        robot: whose window it is.
        folder: of the test, which is written "FOLDER".
    """

    def __init__(self, robot: Robot, monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
        self.robot, self.folder = robot, folder
        self.drawn = Drawn(monkeypatch, ("add_text",))
        self.widgets = Widgets(robot, monkeypatch)
        self.told: list[str] = []
        self.read = Counter[str]()  # when the scene before began
        self.panels: tuple[str, ...] = PANELS  # that are drawn: each takes its part of a frame
        for name in PANELS:
            self._draw_if_wanted(monkeypatch, name)
        self.done: set[tuple[str, ...]] = set()
        self.kinds: tuple[str, ...] = KINDS
        editor = robot.editor
        self.first = deepcopy(editor.preferences.__dict__), deepcopy(plain(editor.state)), editor.view
        self.work, self.at = editor.session.document.history.index, editor.session.target

    def _draw_if_wanted(self, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
        draw = import_module(f"app.ui.panels.{name}").draw
        monkeypatch.setattr(f"app.ui.panels.{name}.draw", lambda *given: draw(*given) if name in self.panels else None)

    def tell(self, what: str) -> Callable[..., None]:
        """Something to be called that notes what it is, and with what it is called."""
        return lambda *given: self.told.append(f"{what}({', '.join(_short(each) for each in given)})")

    def state(self, asked: Dialog | None) -> dict[str, str]:
        """All that could have been changed."""
        editor = self.robot.editor
        history = editor.session.document.history
        found: dict[str, Any] = summary(self.robot) | {
            "likes": asdict(editor.preferences),
            "state": plain(editor.state) | {"overlays": editor.state.overlays},
            "history": (history.index, history.entries[history.index].name),
            "recipe": editor.session.recipe.model_dump(exclude_defaults=True),
            "automatic": editor.session.is_grid_automatic,
            "dialog": plain(asked) if asked else {},
            "choices": vars(asked.choices) if isinstance(asked, ExportDialog) else {},
            "job": _of_job(asked.job()) if isinstance(asked, ExportDialog) else {},
            "told": list(self.told),
        }
        return dict(leaves(found))

    def words(self) -> Counter[str]:
        """What is to be read, also what has come to a pointer that rests."""
        self.drawn.take()
        self.robot.frame()
        return Counter(line.split(" | ", 1)[1] for line in self.drawn.take() if line.startswith(WORDS))

    def press(self, widget: Widget) -> None:
        robot = self.robot
        if widget.kind == "key":
            robot.key(widget.words)
        else:
            robot.click(*widget.rect.middle)
        if widget.kind == "slider twice":  # it is as by default then, and the history as before
            robot.click(*widget.rect.middle)
        elif widget.kind.startswith("input"):
            robot.key("ctrl+a")
            robot.type("x5")
            robot.frame(count=2)
            robot.key("enter")
        elif widget.kind == "list":
            robot.key("down")
            robot.key("enter")
        robot.frame(dt=1.0)  # so that what it is comes to the pointer

    def all_of(self, scene: Callable[[], Dialog | None], is_of: Callable[[Widget], bool]) -> list[str]:
        """What comes of each widget of a scene that has not been pressed yet."""
        robot, lines = self.robot, list[str]()
        before, read = dict[str, str](), Counter[str]()
        while True:
            asked = self.begin(scene)
            if not before:
                messages = [message.text for message in robot.editor.messages.shown]
                told = f"begins: {'; '.join((*self.told, *messages))}"
                before, read = self.state(asked), self.words()
                come, self.read = new_in(sorted(read.elements()), self.read), read
                lines += map(self.row, (told, f"    + {' / '.join(come)}"))
            count = Counter[tuple[str, ...]]()
            keys = [Widget("key", "###dialog", key, Rect(0, 0, 0, 0)) for key in ("enter", "escape") if asked]
            twice = [replace(each, kind="slider twice") for each in self.widgets.drawn if each.kind == "slider"]
            for widget in (*keys, *self.widgets.drawn, *twice):
                window = "dialog" if "###dialog" in widget.window else widget.window
                which = widget.kind, window, widget.words
                count[which] += 1
                if widget.kind in self.kinds and is_of(widget) and (*which, str(count[which])) not in self.done:
                    self.done.add((*which, str(count[which])))
                    break
            else:
                return lines
            top = asked.rect.y if asked else 0.0
            self.press(widget)
            after, now = self.state(asked), self.words()
            changes = [f"{key} {value}" for key, value in after.items() if before.get(key) != value]
            changes += [f"no {key}" for key in before if key not in after]
            changes[MOST:] = [f"{len(changes) - MOST} more"] if len(changes) > MOST else []
            come, gone = (new_in(sorted(a.elements()), b) for a, b in ((now, read), (read, now)))
            rows = [f"{widget.kind} {widget.words}: {'; '.join(changes) or 'nothing'}"]
            rows += [f"    + {' / '.join(come)}"] if 0 < len(come) <= MOST else []
            is_closed = asked is not None and asked not in robot.editor.dialogs.shown  # and so are all its words
            rows += [f"    - {' / '.join(gone)}"] if 0 < len(gone) <= MOST and not is_closed else []
            rows += ["    its head moves"] if asked and not is_closed and abs(asked.rect.y - top) > 1 else []
            lines += map(self.row, rows)

    def row(self, text: str) -> str:
        return text.replace(str(self.folder), "FOLDER").replace("\n", " ")

    def begin(self, scene: Callable[[], Dialog | None]) -> Dialog | None:
        """Close what is open, and let the scene be as it was at first."""
        robot, editor = self.robot, self.robot.editor
        if editor.ui.has_popup and not editor.dialogs.shown:
            robot.key("escape")
        while editor.dialogs.shown:
            editor.dialogs.shown[-1].close()
            robot.frame()
        editor.messages.shown.clear()
        editor.exports.cancel()
        session, (likes, state, view) = editor.session, self.first
        editor.preferences.__dict__.update(deepcopy(likes))
        editor.state.__dict__.update(deepcopy(state))
        editor.keys.reset()
        editor.workspace.view = view
        session.loops = session.is_grid_automatic = False
        if session.document.history.index != self.work:
            session.go_to(self.work)
        if session.target != self.at:
            session.seek(self.at)
        session.settle()
        self.told.clear()
        asked = scene()
        robot.frame(Move(5, 5), dt=1.0)  # so that no double click comes of two presses
        robot.frame()
        self.widgets.drawn.clear()
        robot.frame()
        return asked


def compared(name: str, found: list[str], golden: dict[str, list[str]]) -> list[str]:
    """What of a scene is not as it is written down."""
    if WRITES:
        golden[name] = found
    more, less = new_in(found, Counter(golden[name])), new_in(golden[name], Counter(found))
    return [f"{name}: {line}" for line in (*more, *(f"not {line}" for line in less))]


def _short(value: object) -> str:
    return f"<{type(value).__name__}>" if hasattr(value, "__dict__") and not isinstance(value, Path) else str(value)


def is_over_all(widget: Widget) -> bool:
    return "###dialog" in widget.window or widget.window == "exporting"


def _of_job(job: Any) -> dict[str, Any]:
    """What an export has been asked for, but for where it goes."""
    recipe = job.recipe.model_dump(include={"output", "time", "duration", "fluid"}, exclude_defaults=True)
    clip = {"frame": job.frame is not None, "all": job.clip is not None}
    return {"outputs": job.outputs, "recipe": recipe, "clip": clip}


class Still:
    """A process that is at work, and gets no further."""

    part, state, is_done, error, outcome = 0.3, "", False, "", Outcome("")
    last: Still

    def __init__(self, job: Any) -> None:
        self.job = job
        Still.last = self

    def poll(self, *heard: object) -> None: ...
    def stop(self, then: Callable[[], None]) -> None:
        then()


def of_files(pressing: Pressing) -> Iterator[tuple[str, Callable[[], Dialog | None]]]:
    """What asks for files, or about them, and what is found at the start."""
    editor, tell, folder = pressing.robot.editor, pressing.tell, pressing.folder
    inside = folder / "inside"
    (inside / "further").mkdir(parents=True)
    for name in ("a.png", "b.PNG", "c.txt", ".d.png"):
        (inside / name).write_bytes(b"")

    def show(dialog: Dialog) -> Dialog:
        editor.dialogs.show(dialog)
        return dialog

    def refuse(path: Path) -> None:
        raise UserError(f"Cannot read {path.name}: it is empty")

    endings, take = (".png",), tell("taken")
    yield "unsaved", lambda: show(Unsaved(editor.workspace, "quit", False, tell("save"), tell("then")))
    yield "picture or map", lambda: show(PictureOrMap("a.exr", tell("picture"), tell("map")))
    yield "open", lambda: show(Browser("Open", inside, endings, take))
    yield "save a new file", lambda: show(Browser("Save the mask", inside, endings, take, "new.png"))
    yield "replace a file", lambda: show(Browser("Save the mask", inside, endings, take, "a.png"))
    yield "save without a name", lambda: show(Browser("Save the mask", inside / "further", endings, take, ""))

    def with_row(name: str | None, row: int, take: Callable[[Path], None]) -> Dialog:
        dialog = show(Browser("Save" if name else "Open", inside, endings, take, name))
        pressing.robot.frame(count=2)
        pressing.widgets.look()
        pressing.press([widget for widget in pressing.widgets.drawn if widget.kind == "selectable"][row])
        return dialog

    for row, what in enumerate(("a folder", "a file")):
        yield f"open {what}", lambda row=row: with_row(None, row, take)
    yield "save over a file that is picked", lambda: with_row("new.png", 1, take)
    yield "open what cannot be", lambda: with_row(None, 2, refuse)
    project = replace(editor.session.project, folder=Path("pictures"))
    (folder / "there.fluidwarp").write_bytes(b"")
    for embed, name in ((False, "new"), (True, "there")):
        likes, path = replace(editor.preferences, embed=embed), folder / f"{name}.fluidwarp"
        yield (
            f"save {name}, {embed}",
            lambda likes=likes, path=path: show(
                SaveDialog(project, path, likes, editor.chooser, tell("written"), tell("then"))
            ),
        )
    alone = replace(project, keeper=Path("a.fluidwarp"))
    yield (
        "save what is only in a project",
        lambda: show(
            SaveDialog(alone, folder / "new.fluidwarp", editor.preferences, editor.chooser, tell("written"), None)
        ),
    )


def of_the_window(pressing: Pressing) -> Iterator[tuple[str, Callable[[], Dialog | None]]]:
    """Preferences, keys, work to restore, and an export that is left."""
    editor, tell = pressing.robot.editor, pressing.tell

    def show(dialog: Dialog) -> Dialog:
        editor.dialogs.show(dialog)
        return dialog

    def keys(*heard: str) -> Dialog:
        sheet = KeySheet(editor.keys)
        if heard:
            sheet.choose(ACTIONS["export"])
        for chord in heard[1:]:
            sheet.hear(chord)
        return show(sheet)

    def with_a_key() -> Dialog:
        editor.keys.set("export", "f7")
        return keys()

    yield "preferences", lambda: show(Preferring(editor.preferences, editor.state))
    yield "keys", keys
    yield "keys of which one is changed", with_a_key
    yield "a key is wanted", lambda: keys("")
    yield "a key that is taken", lambda: keys("", "ctrl+s")
    yield "a key that nothing can have", lambda: keys("", "f1" if "f1" not in editor.keys.actions else "tab")
    recipe = Recipe(stroke=(Stroke(tool="push", samples=((0, 0.3, 0.5, 1.0),)),) * 2, pin=(RecipePin(at=(0.7, 0.3)),))
    held: Any = None  # which nobody lets go of

    def offer(count: int, doubted: bool = False) -> Dialog:
        found = [
            Found(
                held,
                Origin(name, "/pictures", None, False, False, 0, 0),
                Work((Entry("Open", Recipe(), 0), Entry("Push", recipe, 0)), 1, Recipe(), is_cut=False),
                datetime(2024, 12, 24 - number, 20, 5),
            )
            for number, name in enumerate(("one", "two")[:count])
        ]
        source: Any = SimpleNamespace(
            offered=found,
            later=tell("later"),
            restore=lambda found: tell("restore")(found.origin.name),
            discard=lambda found: tell("discard")(found.origin.name),
        )
        dialog = show(Offer(source))
        if doubted:
            pressing.robot.frame(count=2)
            pressing.widgets.click("Discard")
            pressing.robot.frame(dt=1.0)
        return dialog

    yield "work to restore", lambda: offer(2)
    yield "work that is to be discarded", lambda: offer(2, doubted=True)

    for waits in (False, True):
        for running, well in ((True, False), (False, True), (False, False)):
            exports: Any = SimpleNamespace(is_running=True, went_well=False, name="a.mp4", part=0.3)

            def leaving(
                exports: Any = exports, waits: bool = waits, running: bool = running, well: bool = well
            ) -> Dialog:
                exports.is_running, exports.went_well = True, False
                dialog = show(StillExporting(exports, tell("leave")))
                pressing.robot.frame(count=2)
                if waits:
                    pressing.widgets.click("Quit when finished")
                exports.is_running, exports.went_well = running, well
                return dialog

            yield f"leaving, {waits}, {running}, {well}", leaving


def of_exports(pressing: Pressing) -> Iterator[tuple[str, Callable[[], Dialog | None]]]:
    """All kinds of files."""
    editor, folder = pressing.robot.editor, pressing.folder

    def ask(kind: int, number: int, **choices: Any) -> Dialog:
        dialog = export_dialog(pressing.robot, folder)
        dialog.choices.kind, dialog.choices.format[kind] = kind, number
        vars(dialog.choices).update(choices)
        dialog.name = choices.get("name", "a")
        editor.dialogs.show(dialog)
        return dialog

    for kind, count in ((PICTURE, 6), (ANIMATION, 8), (MAP, 4)):
        pressing.done.clear()
        for number in range(count):
            yield f"{kind} {number}", lambda kind=kind, number=number: ask(kind, number)
        yield f"{kind} finer", lambda kind=kind: ask(kind, 0, finer=1)
    pressing.done.clear()
    yield "there and back", lambda: ask(ANIMATION, 0, returns=True)
    yield "dissolves", lambda: ask(ANIMATION, 0, dissolve=0.3)
    yield "without a name", lambda: ask(PICTURE, 0, name=" ")


def of_a_clip(pressing: Pressing) -> Iterator[tuple[str, Callable[[], Dialog | None]]]:
    """Its export."""
    editor, folder = pressing.robot.editor, pressing.folder
    with animation_writer(folder / "clip.apng", Fraction(5)) as write:
        for _ in range(6):
            write(pattern(96, 64).pixels)
    pressing.robot.drop(folder / "clip.apng")
    assert editor.session.project.clip is not None
    pressing.work, pressing.at, pressing.kinds = 0, editor.session.target, ("slider", "check")

    def ask() -> Dialog:
        dialog = export_dialog(pressing.robot, folder)
        dialog.choices.kind, dialog.name = ANIMATION, "a"
        editor.dialogs.show(dialog)
        return dialog

    yield "a clip", ask


def of_work(pressing: Pressing) -> Iterator[tuple[str, Callable[[], Dialog | None]]]:
    """An export under way, or a picture on its way to the clipboard, and what is told of how it went."""
    editor, tell = pressing.robot.editor, pressing.tell

    def export(**becomes: Any) -> None:
        job: Any = SimpleNamespace(target=Path("somewhere/a.png"), check=lambda: None)
        editor.exports.start(job)
        vars(Still.last).update(becomes)

    def copy(given: str | None = None, **becomes: Any) -> None:
        editor.session.seek(20)
        editor.exports.copy(editor.session)
        tell("copied")(*(f"{name} {value}" for name, value in leaves(_of_job(Still.last.job)) if "file" not in name))
        vars(Still.last).update(becomes)
        Given.is_done, Given.error = given is not None, given or ""

    told, ended = Outcome("", notices=("a loss", "another")), Outcome("", verdict="the fluid is at rest at 1.5 s")
    yield "an export", export
    yield "an export that says what it does", lambda: export(state="writing")
    yield "an export that went well", lambda: export(is_done=True, outcome=told)
    yield "an export that a stop ended", lambda: export(is_done=True, outcome=ended)
    yield "an export that failed", lambda: export(is_done=True, error="Cannot write a.png: there is no room.")
    yield "a copy", copy
    yield "a copy on its way", lambda: copy(is_done=True)
    yield "a copy that is there", lambda: copy("", is_done=True)
    yield "a copy that failed", lambda: copy("There is no way.", is_done=True)


class Given:
    """A picture that is on its way to the clipboard, or is there, or cannot be."""

    is_done, error = False, ""

    def __init__(self, path: Path) -> None: ...


TOURS = (of_work, of_a_clip, of_files, of_the_window, of_exports)


def of_panels(pressing: Pressing) -> Iterator[tuple[str, Callable[[], Dialog | None]]]:
    """All sections of the inspector, the bar, the timeline and its bars."""
    state, robot = pressing.robot.editor.state, pressing.robot

    def take(tool: str, label: str = "", bars: tuple[Which, ...] = (), **more: Any) -> None:
        state.sections = dict.fromkeys(SECTIONS, not bars) | {"history": False}
        state.lanes.shown, state.lanes.selected = bool(bars), set(bars)
        vars(state).update(more)
        state.choose_tool(tool, False)
        state.selected = label

    pressing.panels = "bar", "timebar", "strip"
    yield "the brush", lambda: take("push")
    yield "the brush of thickness", lambda: take("thicken")
    pressing.panels = ("inspector",)
    yield "the inspector", lambda: take("push")
    yield "thickness", lambda: take("thicken", symmetry="radial")
    yield "a selection by colour", lambda: take("select", select_by="colour", selection=SELECTED)
    yield "nothing selected", lambda: take("select", mask="thickness")
    those: tuple[Which, ...] = ("stroke", 0), ("stroke", 1), ("force", 0), ("force", 1)
    for which in those:
        pressing.done -= {key for key in pressing.done if key[1] == "inspector" and key[0] == "slider"}
        yield f"bars: {which}", lambda which=which: take("twirl", "", (which,))
    yield "several bars", lambda: take("twirl", "", (("stroke", 0), ("stroke", 1)))

    def more() -> None:
        take("bloat")
        robot.frame(count=2)
        (button,) = (widget for widget in pressing.widgets.drawn if widget.words == "more")
        robot.click(*button.rect.middle)

    pressing.panels = ("bar",)
    yield "more about the brush", more

    session = robot.editor.session
    session.go_to(pressing.work)
    led = RecipeHandle(at=(0.4, 0.5), to=(0.5, 0.45), duration=0.1)
    keyed = led.edited(at=(0.7, 0.6), turned=((0.5, 20.0, 1.1), (1.0, 40.0, 1.2)))
    ends, goals = ((0.2, 0.8), (0.5, 0.8)), ((0.2, 0.7), (0.5, 0.75))
    line = RecipeHandle(points=ends, at=(0.35, 0.8), goals=goals, duration=0.1)
    session.edit("Handles", handle=(led, keyed, line), pin=(RecipePin(at=(0.7, 0.3)),))
    session.seek(0)
    pressing.work, pressing.panels = session.document.history.index, ("inspector",)
    yield "a handle", lambda: take("handle", "handle[1]")
    yield "a handle with keys", lambda: take("handle", "handle[2]")
    yield "a line of goals", lambda: take("handle", "handle[3]")
    yield "a pin", lambda: take("handle", "pin[1]")
    those = ("handle", 0), ("pin", 0)
    for which in those:
        pressing.done -= {key for key in pressing.done if key[1] == "inspector" and key[0] == "slider"}
        yield f"bars: {which}", lambda which=which: take("twirl", "", (which,))


SECTIONS = ("fluid", "symmetry", "view", "quality", "masks", "handles", "selection")
SELECTED = (Part(outline=((0.1, 0.1), (0.5, 0.1), (0.3, 0.6))),)


@pytest.mark.parametrize("tour", TOURS, ids=lambda tour: tour.__name__)
def test_what_is_pressed_in_a_dialog_does_what_is_written_down(
    device: Device, tmp_path: Path, tour: Any, golden: dict[str, list[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    told = []
    with Robot(device, small_project(tmp_path), (1280, 1000)) as robot:
        if tour is not of_a_clip:  # before which it would be asked whether that is to be saved
            stroke = Stroke(tool="push", samples=((0, 0.3, 0.5, 1.0), (20, 0.4, 0.4, 1.0)))
            robot.editor.session.edit("Push", stroke=(stroke,), duration=2.0)
            robot.editor.session.seek(30)
        pressing = Pressing(robot, monkeypatch, tmp_path)
        monkeypatch.setattr("app.ui.export_dialog.ExportProcess", Still)
        monkeypatch.setattr("app.ui.export_dialog.Giving", Given)
        monkeypatch.setattr("app.ui.export_dialog.check", lambda: None)
        pressing.panels = ()
        for name, scene in tour(pressing):
            if tour is not of_exports:
                pressing.done.clear()
            found = pressing.all_of(scene, is_over_all)
            told += compared(f"{tour.__name__}: {name}", found, golden)
    assert not told, "\n".join(told[:40])


def test_what_is_pressed_in_a_panel_does_what_is_written_down(
    device: Device, tmp_path: Path, golden: dict[str, list[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    told = []
    with Robot(device, small_project(tmp_path), SIZE) as robot:
        session = robot.editor.session
        strokes = tuple(
            Stroke(tool=tool, samples=((15 * k, 0.3, 0.5, 1.0), (15 * k + 12, 0.4, 0.4, 1.0)))
            for k, tool in enumerate(("push", "twirl", "bloat"))
        )
        session.edit("Work", stroke=strokes, duration=2.0)
        add_bars(session)
        session.seek(0)
        robot.editor.state.lanes.shown = True
        robot.frame(count=2)  # so that the lanes know the work
        robot.editor.state.lanes.shown = False
        pressing = Pressing(robot, monkeypatch, tmp_path)
        monkeypatch.setattr(robot.editor, "do", pressing.tell("do"))
        pressing.kinds = IN_PANELS
        for name, scene in of_panels(pressing):
            found = pressing.all_of(scene, lambda widget: widget.words != "Statistics")
            told += compared(name, found, golden)
    assert not told, "\n".join(told[:40])

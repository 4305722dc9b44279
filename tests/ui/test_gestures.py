"""What comes of gestures that nobody makes on purpose, and of works opened between, as `golden/gestures.txt` has it.

Buttons go down and up in any order, keys are held, the window loses the keyboard in the middle of a drag, pictures fall
on it: what `test_walks.py`, of whole gestures, never does. After each event it is looked at what the next one would
meet. After a change that is meant: `FLUIDWARP_GOLDEN=write pytest` of this file.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict
from fractions import Fraction
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from imgui_bundle import imgui

from app.errors import UserError
from app.media.animation import animation_writer
from app.media.pictures import write_picture
from app.media.project import from_picture, save
from app.model.forces import VortexForce
from app.model.handles import RecipeHandle, RecipePin
from app.model.picture import Picture
from app.model.presets import BRUSHES, PUTTY
from app.model.recipe import FluidSettings, Recipe
from app.model.strokes import Change, Stroke
from app.model.tools import TOOLS
from app.ui import files
from app.ui.actions import ACTIONS
from app.ui.dialogs import Unsaved
from app.ui.editor_state import SELECT_BY
from app.ui.events import LEFT, MIDDLE, RIGHT, Button, CloseWish, Drop, Event, Focus, Key, Mods, Move, Wheel
from app.ui.files import fresh_recipe
from app.ui.preferences import Preferences
from app.work import playing, recording
from solver.gl.device import Device
from support.editing import Robot, pattern, small_project, summary
from support.golden import WRITES, Golden, Sum
from support.widgets import Widgets

CLOSE = 2e-3
WORKS = 24
HANDS = (  # what is mostly in hand, pixels a point, the interface's size, the zoom, and how many events there are
    ("push", 1.0, 1.0, None, 64),
    ("select", 2.0, 1.0, 3.0, 100),
    ("handle", 1.0, 2.0, None, 36),
    ("zoom", 1.5, 1.25, 0.7, 64),
)
APART = ("save", "copy_picture", "copy_recipe", "paste", "fit_handles", "quit", "statistics")
DONE = sorted(a.name for a in ACTIONS.values() if a.name not in APART and a.group != "Tools" and a.label[-1] != ".")
"""Actions but the choice of a tool that want no file, no process and no clipboard; times are told by the last."""


def now(robot: Robot) -> dict[str, Any]:
    """What the next event would meet."""
    editor, state, pointer, workspace = robot.editor, robot.editor.state, robot.editor.pointer, robot.editor.workspace
    selecting, session, lanes, likes = editor.selecting, editor.session, state.lanes, editor.preferences
    hovered, kept, entries = pointer.hovered, asdict(likes), session.document.history.entries
    of, when = editor.canvas.thumbnails.of, editor.canvas.thumbnails.when
    return summary(robot) | {
        "recipe": session.recipe,
        "brush": {name: asdict(brush) for name, brush in state.brushes.items()},
        "pointer": (pointer.drag, pointer.space, pointer.cursor, pointer.is_over_canvas, pointer.is_opposite),
        "ring": (pointer.shows_ring, pointer.ring_at if pointer.is_over_canvas else None, hovered and hovered.label),
        "compared": (state.before, state.split, state.shows_frozen, state.shows_viscosity, state.smallest),
        "selecting": (selecting.outline, selecting.hint, selecting.is_busy, round(state.selected_part, 2)),
        "parts": [part.model_dump(exclude_defaults=True) for part in state.selection],
        "bars": (lanes.drag is not None, lanes.box, lanes.view, sorted(lanes.selected)),
        "session": (session.is_painting, session.is_moving, session.playing, session.coasting, session.path[-1:]),
        "work": (editor.title, workspace.can_undo, workspace.can_redo, workspace.is_dirty, editor.canvas.size),
        "small": [(of(entry.number) is not None, when(entry.number) is not None) for entry in entries],
        "wait": (editor.wants_frame(), editor.wait() if not session.is_moving else 0.0),
        "kept": {name: value for name, value in kept.items() if name not in ("path", "recent", "folder")},
        "places": (len(likes.recent), [Path(name).name for name in likes.recent], Path(likes.folder).name),
    }


class Hand:
    """Sends one event after the other, as they come to it by chance."""

    def __init__(self, robot: Robot, dice: Random, tool: str) -> None:
        self.robot, self.dice, self.tool, self.button = robot, dice, tool, LEFT

    def place(self) -> tuple[float, float]:
        """A point of the window: of the picture, on a mark or the split's line, or anywhere."""
        editor, dice = self.robot.editor, self.dice
        marks, split = editor.session.marks, editor.state.split
        match dice.choice(("picture",) * 8 + ("mark",) * 3 + ("split", "window", "outside")):
            case "mark" if marks:
                return editor.view.to_screen(*dice.choice(marks).now)
            case "split" if split is not None:
                x, y = editor.view.to_screen(split, dice.random())
                return x + dice.uniform(-10, 10), y
            case "window":
                return dice.uniform(0, editor.layout.canvas.right + 60), dice.uniform(
                    0, editor.layout.canvas.bottom + 60
                )
            case "outside":
                return -1e4, -1e4
        return editor.view.to_screen(dice.random(), dice.random())

    def event(self) -> Event:
        dice, mods = self.dice, self.robot.mods
        begun = self.robot.editor.pointer.drag is not None
        usual = ("move", "move", "move", "up", "up") if begun else ("move", "down", "down")
        match dice.choice((*usual * 3, "wheel", "key", "focus", "held", "held", "back")):
            case "move":
                x, y = self.place()
                return Move(round(x, 1), round(y, 1), round(dice.random(), 2), mods)
            case "down":
                self.button = dice.choice((LEFT, LEFT, LEFT, LEFT, RIGHT, MIDDLE))
                return Button(self.button, True, mods)
            case "up":
                return Button(dice.choice((self.button,) * 6 + (LEFT, RIGHT, MIDDLE)), False, mods)
            case "wheel":
                return Wheel(dice.choice((0, 0, 1)), dice.choice((-1, 1, 2)), mods)
            case "focus":
                return Focus(dice.random() < 0.4)
            case "held":
                is_held = {"space": self.robot.editor.pointer.space, "\\": self.robot.editor.state.before}
                key = next((key for key in is_held if is_held[key]), dice.choice(sorted(is_held)))
                return Key(key, dice.random() < (0.2 if is_held[key] else 0.8), mods, dice.random() < 0.2)
            case "back":
                return Key(dice.choice(("escape", "z", "delete")), True, dice.choice((Mods(), Mods(ctrl=True))))
        return Key(dice.choice("yim=-][u"), True, mods)

    def step(self) -> None:
        dice, robot, state = self.dice, self.robot, self.robot.editor.state
        if dice.random() < 0.3:
            robot.mods = Mods(*(dice.random() < 0.25 for _ in range(3)))
        if dice.random() < 0.2:
            state.choose_tool(
                dice.choice((self.tool, self.tool, self.tool, dice.choice(TOOLS).name)), dice.random() < 0.3
            )
        if dice.random() < 0.2:
            state.select_by = dice.choice(
                [way for way in SELECT_BY if way != "subject"]
            )  # which takes a thread its time
        if dice.random() < 0.06:
            state.symmetry = dice.choice(("none", "left-right", "both", "radial"))
            state.stabiliser = dice.choice((0.0, 25.0))
        if dice.random() < 0.04:
            robot.key("ctrl+,")
        if dice.random() < 0.15:
            robot.editor.do(dice.choice(DONE))
        robot.frame(event := self.event(), dt=dice.choice((1 / 30, 1 / 30, 0.6)))
        pointer, session = robot.editor.pointer, robot.editor.session
        assert not session.is_painting or pointer.drag == "paint"
        if event == Focus(False):
            assert (pointer.drag, pointer.space, state.before, session.is_painting) == (None, False, False, False)


@pytest.fixture(scope="module")
def golden(shared_device: Device) -> Iterator[Golden]:
    with Golden.of_software(shared_device, "gestures.txt") as golden:
        yield golden


def named(golden: Golden, walk: str) -> str:
    """What the rows of a walk begin with; it is skipped where none do."""
    name = f"{imgui.get_version()} {walk}"
    if not WRITES and not golden.has(name):
        pytest.skip("letters lie elsewhere in other versions of imgui")
    return name


@pytest.fixture(autouse=True)
def a_tick_a_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    """However fast the machine is."""
    monkeypatch.setattr(playing, "QUICK", 0.0)
    monkeypatch.setattr(playing, "PATIENCE", 0.0)
    monkeypatch.setattr(recording, "RETURN", 600.0)


@pytest.mark.parametrize("number", range(len(HANDS)))
def test_any_events_in_any_order_lead_where_they_did(
    device: Device, tmp_path: Path, number: int, golden: Golden
) -> None:
    tool, density, scale, zoom, steps = HANDS[number]
    name, dice, found = named(golden, f"hand {number}"), Random(f"hand {number}"), dict[str, list[float]]()
    with Robot(device, small_project(tmp_path, 24), (1100, 720), scale, density=density) as robot:
        editor, state = robot.editor, robot.editor.state
        if tool == "handle":
            handle, pin = RecipeHandle(at=(0.4, 0.6), to=(0.5, 0.7), duration=0.1), RecipePin(at=(0.8, 0.2))
            editor.session.edit("Handles", handle=(handle,), pin=(pin,), duration=0.2)
        state.choose_tool(tool, False)
        if zoom is not None:
            editor.commands.zoom_to(zoom)
        hand, what = Hand(robot, dice, tool), Sum()
        for step in range(1, steps + 1):
            hand.step()
            if not editor.session.is_painting:
                editor.session.settle()
            if editor.dialogs.shown and dice.random() < 0.4:
                robot.key("escape")
            what.add(now(robot))
            if step % 4 == 0:
                found[f"{name} {step}"], what = what.row, Sum()
    golden.compare_all(found, f"{name} ", CLOSE)


def files_in(folder: Path) -> None:
    """What falls on the window: pictures, a clip, a project, a recipe with a force, and what is none."""
    write_picture(folder / "wide.png", pattern(60, 40))
    clear = np.concatenate([pattern(40, 60).pixels, np.full((60, 40, 1), 99, np.uint8)], axis=2)
    write_picture(folder / "clear.png", Picture(clear))
    with animation_writer(folder / "clip.apng", Fraction(5)) as write:
        for _ in range(3):
            write(pattern(48, 36).pixels)
    recipe = Recipe(
        fluid=FluidSettings(grid=16, viscosity=0.05, drag=3.0), duration=0.5, picture="wide.png", edges="clamp"
    )
    whirl = VortexForce(kind="vortex", point=(0.5, 0.5), strength=0.1)
    (folder / "forces.toml").write_text(recipe.edited(force=(whirl,)).text(), "utf-8")
    stroke = Stroke(tool="push", samples=((0, 0.3, 0.5, 1.0), (9, 0.6, 0.5, 1.0)))
    putty = Change(tick=6, viscosity=PUTTY.viscosity, drag=PUTTY.drag)
    save(
        from_picture(folder / "clear.png", recipe.edited(stroke=(stroke,), change=(putty,))),
        folder / "kept.fluidwarp",
        True,
    )
    (folder / "none.png").write_text("no picture")


FILES = "wide.png", "clear.png", "clip.apng", "kept.fluidwarp", "forces.toml", "none.png"


def go_on(robot: Robot, widgets: Widgets, folder: Path, dice: Random) -> None:
    """Something that is done with a work, or between two."""
    editor, state = robot.editor, robot.editor.state
    session, files = editor.session, editor.files
    file = folder / dice.choice(FILES)

    def fall_beside_a_dialog() -> None:
        editor.do("preferences")
        robot.frame(Drop((str(file),)))
        robot.key("escape")

    def fall_during_a_stroke() -> None:
        robot.move(*robot.at(0.4, 0.4))
        robot.press()
        robot.move(*robot.at(0.5, 0.5))
        robot.frame(Drop((str(file),)))
        robot.frame(count=2)
        robot.release()
        robot.frame(count=2)

    def bars() -> None:
        state.lanes.shown = True
        session.edit("Pins", pin=(*session.recipe.pin, RecipePin(at=(0.5, 0.5))))
        state.lanes.selected, state.lanes.view, state.selected = {("pin", 0)}, (0.0, 30.0), "pin[1]"

    def select() -> None:
        state.choose_tool("select", False)
        state.select_by = dice.choice(("rectangle", "colour", "lasso"))
        robot.drag((0.3, 0.3), (0.6, 0.5), steps=3)

    doing: list[tuple[int, Callable[[], object]]] = [
        (5, lambda: robot.drop(file)),
        (1, fall_beside_a_dialog),
        (1, fall_during_a_stroke),
        (1, lambda: files.apply(file)),
        (3, lambda: robot.key("ctrl+z")),
        (2, lambda: robot.key("ctrl+shift+z")),
        (3, lambda: robot.drag((dice.random(), 0.4), (0.5, dice.random()), steps=3)),
        (1, lambda: files.save_as(folder / "work.fluidwarp")),
        (1, lambda: files.save()),
        (1, lambda: robot.frame(CloseWish())),
        (2, bars),
        (2, select),
        (1, lambda: editor.do(dice.choice(("mask_fill", "mask_grow", "mask_invert", "clear_masks", "select_fill")))),
        (1, lambda: session.change("Feel", viscosity=dice.choice((0.01, 0.1)), drag=dice.choice((0.5, 2.0)))),
        (1, lambda: editor.commands.zoom_to(2.0)),
        (1, lambda: session.seek(dice.randint(0, session.end))),
        (1, lambda: state.take_brush(dice.choice(BRUSHES))),
        (1, lambda: state.make_local(dice.choice((0.0, 0.6)))),
        (1, lambda: editor.do("repeat")),
        (1, lambda: editor.do("play")),
    ]
    try:
        dice.choices([do for _, do in doing], [weight for weight, _ in doing])[0]()
    except UserError as error:
        editor.messages.warn(error.in_window)
    robot.frame(count=2)
    while editor.dialogs.shown:
        if isinstance(editor.dialogs.shown[-1], Unsaved):
            widgets.click(dice.choice(("Don't save", "Don't save", "Cancel", "Save")))
        else:
            editor.dialogs.shown[-1].close()
        robot.frame(count=2)


@pytest.mark.parametrize("number", range(2))
def test_works_that_are_opened_in_between_lead_where_they_did(
    device: Device, tmp_path: Path, number: int, golden: Golden, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(files, "AT_ONCE", 60.0)  # or it would be read in one frame or another

    def coarse(*given: Any) -> Recipe:
        recipe = fresh_recipe(*given)
        return recipe.edited(fluid=recipe.fluid.model_copy(update={"grid": 16}))

    monkeypatch.setattr(files, "fresh_recipe", coarse)
    name, dice, found = named(golden, f"works {number}"), Random(f"works {number}"), dict[str, list[float]]()
    folder = tmp_path / "works"  # whose name is kept, and pytest numbers its own
    folder.mkdir()
    files_in(folder)
    likes = Preferences(auto_quality=False, embed=number == 0)
    with Robot(device, small_project(folder, 16), (900, 600), preferences=likes) as robot:
        widgets, editor, what = Widgets(robot, monkeypatch), robot.editor, Sum()
        for step in range(1, WORKS + 1):
            go_on(robot, widgets, folder, dice)
            editor.session.settle()
            editor.session.pause()
            robot.until(lambda: not editor.workspace.work.awaits_frame)
            editor.commands.closed = False
            told = [message.text.replace(str(folder), "FOLDER") for message in editor.messages.shown]
            what.add(now(robot) | {"messages": told})
            if step % 4 == 0:
                found[f"{name} {step}"], what = what.row, Sum()
    golden.compare_all(found, f"{name} ", CLOSE)

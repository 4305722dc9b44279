"""A hand for the tests: drives the editor without a window, by the same events that a window would send."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import moderngl
import numpy as np
from imgui_bundle import imgui

from app.media.project import Project, from_picture
from app.model.bars import Which
from app.model.forces import VortexForce
from app.model.picture import Picture
from app.ui.actions import ACTIONS
from app.ui.editor import Editor
from app.ui.events import LEFT, Button, Drop, Event, Key, Mods, Move, Text, Wheel
from app.ui.export_dialog import ExportDialog
from app.ui.files import fresh_recipe
from app.ui.preferences import Preferences
from app.work.session import Session
from solver.gl.device import Device

SIZE = (1280, 800)
TICK = 1 / 30
BY_KEY = {key: action for action in ACTIONS.values() for key in action.keys}


def pattern(width: int = 240, height: int = 180) -> Picture:
    """A picture on which every shift shows: a checkerboard in colours that change all over it."""
    return Picture(_pattern(width, height).copy())


@cache
def _pattern(width: int, height: int) -> np.ndarray:
    y, x = np.mgrid[0:height, 0:width]
    board = ((x // 12 + y // 12) % 2)[..., None]
    colours = np.stack([x * 255 // width, y * 255 // height, 128 + 0 * x], axis=-1)
    return np.where(board, colours, 255 - colours).astype(np.uint8)


@cache
def _file() -> bytes:
    """The pattern's file: most tests of the window begin with it."""
    from app.media.pictures import write_picture

    with TemporaryDirectory() as folder:
        write_picture(Path(folder) / "pattern.png", pattern())
        return (Path(folder) / "pattern.png").read_bytes()


def small_project(folder: Path, grid: int = 48) -> Project:
    """The pattern as a new project, on a coarse grid."""
    (folder / "pattern.png").write_bytes(_file())
    recipe = fresh_recipe()
    return from_picture(folder / "pattern.png", recipe.edited(fluid=recipe.fluid.model_copy(update={"grid": grid})))


def folding() -> np.ndarray:
    """A displacement of the pattern, in longer sides, that folds over itself at one place."""
    y, x = np.mgrid[0:180, 0:240] / 240
    bump = -1.5 * (x - 0.5) * np.exp(-((x - 0.5) ** 2 + (y - 0.4) ** 2) / 0.1**2)
    return np.stack([bump, 0 * y], axis=-1).astype(np.float32)


def add_bars(session: Session) -> None:
    """For three strokes: forces with a name and with a formula; a stroke is muted and one repeats."""
    whirl = VortexForce(kind="vortex", point=(0.5, 0.5), strength=0.1, name="Whirl", during=(0.5, 1.8))
    session.edit("Forces", force=(whirl, whirl.edited(during=None, formula="t", name="")))
    edits: dict[Which, dict[str, object]]
    edits = {("stroke", 2): {"muted": True}, ("stroke", 1): {"repeat": 3, "every": 30}}
    for which, keys in edits.items():
        session.edit_bars("Bar", {which}, lambda one, keys=keys: one.model_copy(update=keys))


def write_foreign_map(path: Path, width: int, height: int, names: str = "RGB") -> None:
    """An ST map as other programs write them, with nothing in it that says so: all goes a tenth to the left."""
    import OpenEXR

    y, x = np.mgrid[0:height, 0:width].astype(np.float32)
    planes = ((x + 0.5) / width + 0.1, 1 - (y + 0.5) / height, np.ones_like(x))
    channels = {name: OpenEXR.Channel(np.ascontiguousarray(plane)) for name, plane in zip(names, planes, strict=False)}
    OpenEXR.File({"type": OpenEXR.scanlineimage}, channels).write(str(path))


class Still:
    """A process that is at work, and gets no further."""

    part, state, is_done = 0.3, "looking where the handles were set, 98 % of them are where they should be", False

    def __init__(self, work: Any) -> None:
        self.job = self.fit = work

    def poll(self, *heard: object) -> None: ...
    def finish(self) -> None: ...
    def stop(self, then: object = None) -> None: ...


class Robot:
    """An editor with a framebuffer, and a pointer and keys to use it with.

    Until `see` is called, or unless it `sees` from the beginning, only one pixel of each frame is drawn, and nothing of
    the picture at rest: most of a frame's cost.
    """

    def __init__(
        self,
        device: Device,
        project: Project,
        size: tuple[int, int] = SIZE,
        scale: float = 1.0,
        preferences: Preferences | None = None,
        density: float = 1.0,
        journals: Path | None = None,
        sees: bool = False,
    ) -> None:
        self.device, self.scale, self.density = device, scale, density
        self.size = size = round(size[0] * density), round(size[1] * density)
        self.target = self._framebuffer(size if sees else (1, 1))
        self.editor = Editor(device, project, preferences or Preferences(auto_quality=False), journals)
        imgui.get_io().config_error_recovery_enable_assert = True  # what was begun and not ended, say
        self.mods = Mods()
        self.frame()
        self.frame()

    def frame(self, *events: Event, count: int = 1, dt: float = TICK) -> None:
        for number in range(count):
            self.editor.frame(self.target, self.size, dt, events if number == 0 else (), self.density, self.scale)

    def see(self) -> None:
        """Draw all of each frame, from one that is drawn now on."""
        before = self.target
        self.target = self._framebuffer(self.size)
        self.frame()
        _release(before)

    def _framebuffer(self, size: tuple[int, int]) -> moderngl.Framebuffer:
        return self.device.ctx.framebuffer([self.device.ctx.texture(size, 4)])

    def pixels(self) -> np.ndarray:
        """What is seen, (h, w, 3) uint8, top row first."""
        assert self.target.size == self.size, "nothing is seen before `see`"
        while self.editor.canvas.is_unfinished:
            self.frame()
        data = np.frombuffer(self.target.read(components=3, alignment=1), np.uint8)
        return data.reshape(self.size[1], self.size[0], 3)[::-1].copy()

    def canvas(self) -> np.ndarray:
        """The pixels of the picture alone, without what lies on the canvas's lower edge."""
        rect = self.editor.view.rect
        x0, y0 = round(rect.x), round(rect.y)
        return self.pixels()[y0 : y0 + round(rect.height) - 60, x0 : x0 + round(rect.width)]

    def at(self, x: float, y: float) -> tuple[float, float]:
        """The point of the screen over a place of the picture."""
        return self.editor.view.to_screen(x, y)

    def move(self, x: float, y: float, pressure: float = 1.0) -> None:
        self.frame(Move(x, y, pressure, self.mods))

    def press(self, button: int = LEFT) -> None:
        self.frame(Button(button, True, self.mods))

    def release(self, button: int = LEFT) -> None:
        self.frame(Button(button, False, self.mods))

    def click(self, x: float, y: float, button: int = LEFT) -> None:
        self.move(x, y)
        self.press(button)
        self.release(button)
        self.frame()

    def drag(
        self, start: tuple[float, float], end: tuple[float, float], steps: int = 8, button: int = LEFT, hold: int = 0
    ) -> None:
        """Drag between two places of the picture."""
        (x0, y0), (x1, y1) = self.at(*start), self.at(*end)
        self.move(x0, y0)
        self.press(button)
        for step in range(1, steps + 1):
            self.move(x0 + (x1 - x0) * step / steps, y0 + (y1 - y0) * step / steps)
        self.frame(count=hold) if hold else None
        self.release(button)

    def key(self, chord: str) -> None:
        """Press and let go of a key with its modifiers, written as in the table of actions."""
        *held, key = chord.split("+") if chord not in ("+", "ctrl++") else [*chord.split("+")[:-2], "+"]
        mods = Mods("ctrl" in held, "shift" in held, "alt" in held)
        self.frame(Key(key, True, mods))
        self.frame(Key(key, False, Mods()))

    def hold(self, key: str, down: bool) -> None:
        self.frame(Key(key, down, self.mods))

    def type(self, text: str) -> None:
        self.frame(Text(text))

    def wheel(self, notches: float) -> None:
        self.frame(Wheel(0, notches, self.mods))

    def rest(self) -> None:
        """Let everything come to rest."""
        self.editor.session.settle()
        self.frame(count=2)

    def drop(self, path: Path) -> None:
        """Let a file fall on the window, and wait until it has been read."""
        self.frame(Drop((str(path),)))
        self.until(lambda: not self.editor.files.is_loading)

    def until(self, condition: Callable[[], bool], seconds: float = 60.0) -> None:
        """Draw frames until something is so."""
        deadline = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < deadline, [message.text for message in self.editor.messages.shown]
            self.frame()
            time.sleep(min(self.editor.wait(), 0.05))  # for those that are waited for, if the editor itself has no work
        self.frame()

    def warp(self) -> np.ndarray:
        """The displacement, (h, w, 2), longer sides."""
        return self.editor.session.replay.warp.read()

    def __enter__(self) -> Robot:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        self.editor.release()
        _release(self.target)


def _release(framebuffer: moderngl.Framebuffer) -> None:
    framebuffer.color_attachments[0].release()
    framebuffer.release()


def export_dialog(robot: Robot, folder: Path) -> ExportDialog:
    """What a person who exports into a folder is asked."""
    editor = robot.editor
    return ExportDialog(editor.session, editor.exports, editor.chooser, Preferences(export_folder=str(folder)))


def summary(robot: Robot) -> dict[str, object]:
    """What a person has set, and what has become of the work."""
    editor, state = robot.editor, robot.editor.state
    session, likes, view = editor.session, editor.preferences, editor.view
    history = session.document.history
    return {
        **{name: getattr(state, name) for name in ("tool_name", "brush", "mask", "select_by", "split", "statistics")},
        "opposite": sorted(name for name, is_so in state.opposite.items() if is_so),
        "overlays": [name for name, overlay in state.overlays.items() if overlay.shown],
        "panels": (state.inspector, state.lanes.shown, likes.inspector, likes.lanes, likes.theme),
        "selected": (state.selected, sorted(state.lanes.selected), len(state.selection)),
        "history": (history.index, history.entries[-1].name),
        "time": (session.end, session.playing, session.coasting, session.loops),
        "playhead": None if session.playing or session.coasting else session.target,
        "bars": [(stroke.first_tick, stroke.end_tick, stroke.muted) for stroke in session.recipe.stroke],
        "parts": session.recipe.model_dump(include={"time", "mask", "change"}, exclude_defaults=True),
        "handles": len(session.recipe.handle),
        "view": tuple(round(number, 3) for number in (view.zoom or 0.0, *view.centre)),
        "shown": [dialog.title for dialog in editor.dialogs.shown],
        "messages": [message.text for message in editor.messages.shown],
        "closed": editor.commands.closed,
    }

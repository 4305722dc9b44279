"""The pictures of the window in the README: `python -m app.ui.screenshots [FOLDER]`, made without a window."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace
from importlib import resources
from math import cos, pi, sin
from pathlib import Path

import numpy as np

from app.media.pictures import write_picture
from app.model.picture import Picture
from app.model.presets import PUTTY
from app.ui.editor import Editor
from app.ui.events import LEFT, Button, Event, Key, Mods, Move
from app.ui.files import load_any
from app.ui.preferences import Preferences
from app.ui.window import sample
from solver.gl.device import Device

SIZE = (1280, 800)
TICK = 1 / 30
Place = tuple[float, float]


class OffscreenEditor:
    """An editor without a window that is photographed.

    Args:
        device: where it is drawn.
        density: pixels a point.
        grid: of the simulation.
        file: that is open in it, the sample picture if not given.
    """

    def __init__(self, device: Device, density: float = 1.0, grid: int = 256, file: Path | None = None) -> None:
        self.density = density
        self.size = round(SIZE[0] * density), round(SIZE[1] * density)
        self.target = device.ctx.framebuffer([device.ctx.texture(self.size, 4)])
        self.editor = Editor(device, load_any(file or sample()), Preferences(auto_quality=False))
        self.editor.session.begin_with(grid=grid)
        self.frame()
        self.frame()

    def frame(self, *events: Event) -> None:
        self.editor.frame(self.target, self.size, TICK, events, self.density)

    def key(self, key: str, mods: Mods | None = None) -> None:
        self.frame(Key(key, True, mods or Mods()))
        self.frame(Key(key, False))

    def stroke(self, path: Callable[[float], Place], steps: int, finish: bool = True) -> None:
        """Drag along a path over the picture, from 0 to 1."""
        for step in range(steps + 1):
            self.frame(Move(*self.editor.view.to_screen(*path(step / steps))))
            if step == 0:
                self.frame(Button(LEFT, True))
        if finish:
            self.frame(Button(LEFT, False))
            self.editor.session.settle()

    def picture(self) -> np.ndarray:
        """What is seen, (h, w, 3) uint8, top row first."""
        self.frame()
        while self.editor.canvas.is_unfinished:
            self.frame()
        data = np.frombuffer(self.target.read(components=3, alignment=1), np.uint8)
        return data.reshape(self.size[1], self.size[0], 3)[::-1].copy()

    def close(self) -> None:
        self.editor.release()


def line(start: Place, end: Place, bow: float = 0.0) -> Callable[[float], Place]:
    """A path between two places, bent to one side by `bow`."""

    def path(part: float) -> Place:
        bent = bow * sin(pi * part)
        return start[0] + (end[0] - start[0]) * part, start[1] + (end[1] - start[1]) * part + bent

    return path


def paint(offscreen: OffscreenEditor) -> None:
    """What the pictures show: the billiard table and the lamps, drawn out like honey."""
    editor = offscreen.editor
    offscreen.stroke(line((0.52, 0.52), (0.64, 0.46), -0.03), 16)
    editor.state.brush = replace(editor.state.brush, radius=0.11)
    offscreen.stroke(line((0.53, 0.19), (0.47, 0.31), 0.0), 12)
    offscreen.stroke(line((0.86, 0.15), (0.80, 0.25), 0.0), 12)
    editor.state.choose_tool("twirl", False)
    editor.state.brush = replace(editor.state.brush, radius=0.11)
    offscreen.stroke(lambda part: (0.19 + 0.002 * cos(part), 0.15), 20)
    editor.state.choose_tool("push", False)
    editor.state.brush = replace(editor.state.brush, radius=0.15)
    offscreen.stroke(line((0.30, 0.82), (0.42, 0.78), 0.04), 16)


def editor(offscreen: OffscreenEditor) -> np.ndarray:
    """The window after a few strokes."""
    paint(offscreen)
    offscreen.frame(Move(*offscreen.editor.view.to_screen(0.64, 0.46)))
    return offscreen.picture()


def overlays(offscreen: OffscreenEditor) -> np.ndarray:
    """A frozen figure, the grid and the velocity while a stroke goes past it."""
    offscreen.key("f")
    offscreen.editor.state.brush = replace(offscreen.editor.state.brush, radius=0.07, hardness=0.6)
    offscreen.stroke(line((0.67, 0.37), (0.675, 0.50)), 8)
    offscreen.key("p")
    for key in ("1", "3", "4"):
        offscreen.key(key)
    offscreen.stroke(line((0.42, 0.62), (0.58, 0.50), -0.03), 12, finish=False)
    return offscreen.picture()


def compare(offscreen: OffscreenEditor) -> np.ndarray:
    """Before and after in the light theme: a portrait, retouched with Putty on the right of the line."""
    state = offscreen.editor.state
    offscreen.editor.session.change(PUTTY.name, viscosity=PUTTY.viscosity, drag=PUTTY.drag)
    state.make_local(PUTTY.local)
    state.brush = replace(state.brush, radius=0.08)
    offscreen.stroke(line((0.555, 0.69), (0.576, 0.666)), 10)
    for *start, far in (0.72, 0.655, 0.022), (0.70, 0.73, 0.024), (0.665, 0.80, 0.02), (0.61, 0.86, 0.012):
        way = 0.42 - start[0], 0.55 - start[1]
        part = far / np.hypot(*way)
        offscreen.stroke(line((start[0], start[1]), (start[0] + part * way[0], start[1] + part * way[1])), 6)
    state.choose_tool("bloat", False)
    state.brush = replace(state.brush, radius=0.09, strength=0.6)
    offscreen.stroke(lambda part: (0.55 + 1e-4 * part, 0.418), 14)
    offscreen.editor.preferences.theme = "light"
    offscreen.key("y")
    state.split = 0.425
    offscreen.frame(Move(640, 20))
    return offscreen.picture()


def export(offscreen: OffscreenEditor) -> np.ndarray:
    """The export dialog."""
    paint(offscreen)
    offscreen.editor.preferences.folder = ""
    offscreen.key("e", Mods(ctrl=True))
    offscreen.editor.dialogs.shown[-1].folder = Path("pictures")  # pyright: ignore[reportAttributeAccessIssue]
    offscreen.frame()
    offscreen.frame()
    return offscreen.picture()


SCENES = {"editor": editor, "overlays": overlays, "compare": compare, "export": export}
OPENED = {"compare": Path(str(resources.files("assets"))) / "gallery" / "astronaut.jpg"}
"""What a scene opens, if not the sample picture."""


def film(offscreen: OffscreenEditor, path: Path) -> None:
    """A stroke as it is made, at half the size."""
    from PIL import Image

    frames = []

    def take() -> None:
        picture = Image.fromarray(offscreen.picture())
        frames.append(picture.resize((SIZE[0] // 2, SIZE[1] // 2), Image.Resampling.LANCZOS))

    editor, way = offscreen.editor, line((0.50, 0.52), (0.64, 0.44), -0.03)
    for step in range(21):
        offscreen.frame(Move(*editor.view.to_screen(*way(step / 20))))
        if step == 0:
            take()
            offscreen.frame(Button(LEFT, True))
        take()
    offscreen.frame(Button(LEFT, False))
    for _ in range(18):
        take()
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=50, loop=0, quality=80, method=4)


def main(folder: Path) -> None:
    """Write all pictures into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    with Device.headless() as device:
        for name, scene in SCENES.items():
            offscreen = OffscreenEditor(device, file=OPENED.get(name))
            write_picture(folder / f"{name}.webp", Picture(scene(offscreen)))
            offscreen.close()
        offscreen = OffscreenEditor(device)
        film(offscreen, folder / "stroke.webp")
        offscreen.close()


if __name__ == "__main__":
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("folder", nargs="?", type=Path, default=Path("assets/screenshots"), help="default: %(default)s")
    main(words.parse_args().folder)

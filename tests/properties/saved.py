"""Strokes of any tools that are painted, saved and rendered: the map of the file is the one that was seen."""

from __future__ import annotations

import random
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from app.media import project as projects
from app.model.tools import TOOL, TOOLS, BrushSettings, Press
from app.progress import Progress
from app.work.export import run
from app.work.jobs import Job, MapOutput, Outputs
from app.work.session import Session
from solver.gl.device import Device
from support.editing import small_project

PAINTING = [tool for tool in TOOLS if tool.gesture is not None]


def paint(
    session: Session,
    tool: str,
    start: tuple[float, float],
    end: tuple[float, float],
    ticks: int = 4,
    back: bool = False,
) -> None:
    """A stroke, with the time that it takes."""
    press = Press(BrushSettings(0.12, 0.2), back, session.extent, session.dt)
    session.press(TOOL[tool], press, *start)
    for k in range(1, ticks + 1):
        part = k / ticks
        session.move(start[0] + (end[0] - start[0]) * part, start[1] + (end[1] - start[1]) * part)
        session.advance(1)
    session.release()


def check_saved(device: Device, seed: int, count: int = 200) -> dict[str, float]:
    """Among them up to four handles and pins: each is led at every tick from then on, which is most of the time."""
    dice = random.Random(seed)
    with tempfile.TemporaryDirectory() as folder:
        session, root = Session(device, small_project(Path(folder), grid=32)), Path(folder)
        try:
            for _ in range(count):
                start = dice.uniform(0.1, 0.9), dice.uniform(0.1, 0.9)
                end = start[0] + dice.uniform(-0.08, 0.08), start[1] + dice.uniform(-0.08, 0.08)
                led = len(session.recipe.handle) + len(session.recipe.pin)
                tools = [tool.name for tool in PAINTING if tool.name != "handle" or led < 4]
                paint(session, dice.choice(tools), start, end, 1, dice.random() < 0.3)
                session.advance(dice.randrange(2))
            session.settle()
            recipe = session.recipe
            projects.save(replace(session.project, recipe=session.document.recipe), root / "w.fluidwarp")
            loaded = projects.load(root / "w.fluidwarp")
            assert loaded.recipe == recipe
            maps = MapOutput(root / "w.npy")
            run(device, Job(loaded.recipe, loaded.picture, loaded.folder, Outputs(None, maps=maps)), Progress())
            size = loaded.picture.width, loaded.picture.height
            assert np.array_equal(np.load(maps.path), session.replay.warp.read(size))
        finally:
            session.release_gpu()
    led = len(recipe.handle) + len(recipe.pin)
    return {"handles and pins": float(led), "strokes": float(len(recipe.stroke))}

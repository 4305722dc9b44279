"""Works that are opened one after another: what is not worked on has nothing on the GPU, and comes back as it was."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from pathlib import Path
from threading import Event, Thread
from threading import enumerate as enumerate_threads
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from app.media.pictures import write_picture
from app.media.project import from_picture
from app.model.handles import RecipeHandle
from app.ui.export_dialog import ExportDialog
from app.ui.files import fresh_recipe, load_any
from app.ui.preferences import Preferences
from app.ui.quality import TICKS
from solver.gl.device import Device
from support.editing import Robot, pattern, small_project
from support.gl_objects import Made, living
from support.resources import resident
from support.widgets import Widgets

DRAWN_WITH = "Texture", "Framebuffer", "Buffer", "Query"


def test_what_is_left_is_still_in_the_frame_that_is_drawn(robot: Robot, tmp_path: Path) -> None:
    """The history shows pictures of a work that a file, once it has been read, takes the place of."""
    editor, path, device = robot.editor, tmp_path / "other.png", robot.device
    write_picture(path, pattern(100, 80))
    editor.workspace.placeholder = editor.session
    robot.frame(count=2)
    slow = Event()
    editor.files.read(path, lambda: load_any(path) if slow.wait(60) else robot.editor.session.project, leaves=True)
    robot.frame()
    slow.set()
    while editor.files.is_loading:
        robot.frame()
        assert device.ctx.error == "GL_NO_ERROR"
    assert editor.session.project.name == "other"


def test_many_works_need_no_more_of_the_gpu_than_a_few(device: Device, tmp_path: Path) -> None:
    """Undo goes back through all of them, to the bit, and closing leaves nothing behind."""
    before = living(device, *DRAWN_WITH)
    robot = Robot(device, small_project(tmp_path))
    editor, warps, objects = robot.editor, [robot.warp()], []
    for number in range(4):
        name = tmp_path / f"{number}.png"
        write_picture(name, pattern(200 + 20 * number, 180))
        recipe = fresh_recipe()
        recipe = recipe.edited(fluid=recipe.fluid.model_copy(update={"grid": 48}))
        editor.open(from_picture(name, recipe))
        robot.frame()
        robot.drag((0.3, 0.5), (0.6, 0.4), 4)
        robot.rest()
        warps.append(robot.warp())
        objects.append(sum(living(device, *DRAWN_WITH).values()))
    assert max(objects[1:]) < 1.2 * objects[1]
    for warp in reversed(warps):
        robot.rest()
        assert np.array_equal(robot.warp(), warp)
        editor.do("undo")  # the stroke
        editor.do("undo")  # the work before it
    editor.do("redo")
    editor.do("redo")
    robot.rest()
    assert np.array_equal(robot.warp(), warps[1])
    robot.close()
    assert living(device, *DRAWN_WITH) == before


class Still:
    """A process that is at work, and gets no further."""

    part, state, is_done, stopped = 0.3, "", False, 0

    def __init__(self, work: Any) -> None:
        self.job = self.fit = work

    def poll(self, *heard: object) -> None: ...
    def stop(self, then: object = None) -> None:
        type(self).stopped += 1


@pytest.mark.parametrize("under_way", ["nothing", "a measurement", "a rehearsal", "an export", "a preview", "a fit"])
def test_closing_ends_what_is_under_way_and_frees_all_of_it(
    device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, under_way: str
) -> None:
    """At once, and not when Python comes to it."""
    made, is_new = Made(monkeypatch), under_way == "a measurement"
    likes, project = Preferences(auto_quality=is_new, path=tmp_path / "likes.json"), small_project(tmp_path)
    project = from_picture(tmp_path / "pattern.png", fresh_recipe()) if is_new else project
    monkeypatch.setattr(Still, "stopped", 0)
    monkeypatch.setattr("app.ui.export_dialog.ExportProcess", Still)
    monkeypatch.setattr("app.ui.fitting.FitProcess", Still)
    with Robot(device, project, preferences=likes) as robot:
        editor = robot.editor
        robot.key("t")
        robot.key("]")
        size = editor.state.brush.radius
        if under_way == "a rehearsal":
            editor.rehearsal.has_news = lambda: False
        elif under_way == "an export":
            job: Any = SimpleNamespace(target=Path("warped.png"), check=lambda: None)
            editor.exports.start(job)
        elif under_way == "a fit":
            led = RecipeHandle(at=(0.4, 0.5), to=(0.5, 0.45), duration=0.1)
            editor.session.edit("A handle", handle=(led,), duration=0.1)
            editor.fits.start()
        elif under_way == "a preview":
            robot.key("ctrl+e")
            asked = editor.dialogs.shown[-1]
            assert isinstance(asked, ExportDialog)
            asked.choices.finer = 1
            Widgets(robot, monkeypatch).click("Preview")
        robot.frame(count=TICKS)
        assert editor.quality.is_measuring == is_new
        assert (editor.rehearsal.trial is not None) == (under_way == "a rehearsal")
    assert made.left == []
    assert Still.stopped == (under_way in ("an export", "a preview", "a fit"))
    assert json.loads((tmp_path / "likes.json").read_text("utf-8"))["brushes"]["twirl"]["radius"] == size


def test_saved_work_that_is_left_keeps_no_thread(device: Device, tmp_path: Path) -> None:
    """Nor does Undo lose it: what is done to it then is in a journal again."""
    write_picture(tmp_path / "other.png", pattern(100, 80))
    robot = Robot(device, small_project(tmp_path), journals=tmp_path / "journals")
    robot.drag((0.3, 0.5), (0.6, 0.4), 2)
    robot.rest()
    assert robot.editor.files.save_as(tmp_path / "a.fluidwarp")
    robot.drop(tmp_path / "other.png")
    robot.until(lambda: not journal_threads())
    robot.editor.do("undo")
    robot.drag((0.3, 0.5), (0.6, 0.6), 2)
    robot.rest()
    robot.until(lambda: not robot.editor.journals.are_behind)
    assert len(list((tmp_path / "journals").glob("*/work.journal"))) == 1
    robot.close()


def journal_threads() -> list[Thread]:
    return [thread for thread in enumerate_threads() if thread.name == "journal"]


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc can be asked")
def test_the_system_has_what_left_works_had(robot: Robot, tmp_path: Path) -> None:
    """Memory that was freed between blocks that are still in use, as checkpoints of a software rasteriser are."""
    write_picture(tmp_path / "other.png", pattern(100, 80))
    blocks = [np.ones(100_000, np.uint8) for _ in range(1280)]
    robot.drop(tmp_path / "other.png")
    pins = blocks[::32]
    del blocks
    before = resident()
    robot.drop(tmp_path / "other.png")
    robot.frame()
    assert len(pins) == 40
    assert resident() < before - 64 * 2**20  # of 118; the new work takes some


# Blocks as large as tiles of the map, and in between what stays; said is what the system had back of them.
FREEING = """
import numpy as np
from app.ui.screenshots import OffscreenEditor
from solver.gl.device import Device
from support.resources import resident
editor = OffscreenEditor(Device.headless())
larger = np.ones(2**24, np.uint8)
del larger
made = [(np.ones(2**19, np.uint8), bytes(4000)) for _ in range(200)]
pins = [pin for _, pin in made]
before = resident()
del made
print(before - resident())
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc can be asked")
def test_large_blocks_are_the_systems_once_they_are_freed() -> None:
    """In a process of its own, whose heap nobody else has left gaps in."""
    path = os.pathsep.join([str(Path(__file__).parents[1]), *filter(None, sys.path)])
    done = subprocess.run([sys.executable, "-c", FREEING], env={**os.environ, "PYTHONPATH": path}, capture_output=True)
    assert done.returncode == 0, done.stderr.decode()
    assert int(done.stdout) > 80 * 2**20  # of 100

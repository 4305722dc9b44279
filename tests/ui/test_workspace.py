"""Works that are opened one after another: what is not worked on has nothing on the GPU, and comes back as it was."""

from __future__ import annotations

import platform
from pathlib import Path
from threading import Event, Thread
from threading import enumerate as enumerate_threads

import numpy as np
import pytest

from app.media.pictures import write_picture
from app.media.project import from_picture
from app.ui.files import fresh_recipe, load_any
from solver.gl.device import Device
from support.editing import Robot, pattern, small_project
from support.gl_objects import living
from support.resources import resident

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
    for number in range(5):
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

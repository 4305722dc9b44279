"""Pictures from the system's clipboard and to it, on a virtual screen with another program."""

from __future__ import annotations

import io
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from PIL import Image

from app.errors import UserError
from app.media import project as projects
from app.media.pictures import read_picture, write_picture
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.ui import clipboard
from app.ui.actions import ACTIONS
from app.ui.preferences import Preferences
from app.ui.saving import SaveDialog
from app.work.jobs import Job
from app.work.replay import Replay
from solver.gl.device import Device
from support.commands import Run
from support.desk import Desk, needs_a_screen
from support.editing import Robot, Still, export_dialog, pattern, small_project

FILLING = """
import copykitten, numpy as np
from PIL import Image
pixels = np.asarray(Image.open({path!r}).convert("RGBA"))
copykitten.copy_image(pixels.tobytes(), pixels.shape[1], pixels.shape[0], detach=True)
"""


@pytest.fixture
def desk(tmp_path: Path) -> Iterator[Desk]:
    pytest.importorskip("copykitten")
    desk = Desk(tmp_path)
    yield desk
    take_clipboard(desk)
    desk.close()


def take_clipboard(desk: Desk) -> None:
    """As another program that fills it: who serves it until then ends, and would outlast its screen otherwise."""
    from Xlib import X, display

    screen = display.Display(desk.env["DISPLAY"])
    window = screen.screen().root.create_window(0, 0, 1, 1, 0, 0)
    window.set_selection_owner(screen.intern_atom("CLIPBOARD"), X.CurrentTime)
    screen.sync()
    screen.close()


def on_clipboard(desk: Desk) -> np.ndarray | None:
    """The picture that another program gets, by the protocol of X alone; None if there is none."""
    from Xlib import X, display

    screen = display.Display(desk.env["DISPLAY"])
    window = screen.screen().root.create_window(0, 0, 1, 1, 0, 0)
    place = screen.intern_atom("FLUIDWARP_TEST")
    window.convert_selection(screen.intern_atom("CLIPBOARD"), screen.intern_atom("image/png"), place, X.CurrentTime)
    while screen.next_event().type != X.SelectionNotify:
        pass
    found = window.get_full_property(place, X.AnyPropertyType)
    screen.close()
    return np.asarray(Image.open(io.BytesIO(bytes(found.value))).convert("RGB")) if found else None


@needs_a_screen
def test_a_picture_is_pasted_warped_and_copied(desk: Desk, tmp_path: Path, fluidwarp: Run) -> None:
    other = pattern(200, 160)
    write_picture(tmp_path / "other.png", other)
    desk.open_pattern()
    filling = FILLING.format(path=str(tmp_path / "other.png"))
    subprocess.run([sys.executable, "-c", filling], env=desk.env, check=True)
    desk.insist(lambda: desk.key("ctrl+v"), lambda: desk.title().startswith("pasted "), "the picture to be pasted")
    desk.drag((400, 400), (520, 400))
    desk.until(lambda: " * - " in desk.title(), "the push to be recorded")
    desk.save(tmp_path / "work.fluidwarp")
    work = projects.load(tmp_path / "work.fluidwarp")
    assert np.array_equal(work.picture.pixels, other.pixels)
    assert work.embedded
    desk.key("ctrl+c")

    def is_copied() -> bool:
        found = on_clipboard(desk)
        return found is not None and not np.array_equal(found, other.pixels)

    desk.until(is_copied, "the picture to be on the clipboard")
    assert fluidwarp(tmp_path, "render", "work.fluidwarp", "-o", "rendered.png").returncode == 0
    found = on_clipboard(desk)
    assert found is not None
    assert np.array_equal(found, read_picture(tmp_path / "rendered.png").pixels)


@pytest.fixture
def robot(device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Robot]:
    """An editor where copykitten is not installed."""
    monkeypatch.setitem(sys.modules, "copykitten", None)
    with Robot(device, small_project(tmp_path)) as robot:
        yield robot


class Board:
    """The system's clipboard, as copykitten has it: 8 bits of red, green, blue and alpha."""

    CopykittenError = OSError

    def __init__(self) -> None:
        self.held: tuple[bytes, int, int] | None = None

    def copy_image(self, data: bytes, width: int, height: int, detach: bool) -> None:
        assert detach == (sys.platform == "linux")
        self.held = data, width, height

    def paste_image(self) -> tuple[bytes, int, int]:
        if self.held is None:
            raise OSError("nothing")
        return self.held


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_any_picture_is_copied_with_alpha_and_pasted_without_where_it_is_opaque(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, channels: int
) -> None:
    board = Board()
    monkeypatch.setitem(sys.modules, "copykitten", board)
    with pytest.raises(UserError, match="There is no picture on the clipboard"):
        clipboard.paste(tmp_path / "pasted.png")
    pixels = np.random.default_rng(3).integers(0, 256, (3, 5, channels)).astype(np.uint8)
    pixels[0, 0, -1] = 255  # opaque somewhere
    write_picture(tmp_path / "given.png", Picture(pixels))
    clipboard.give(str(tmp_path / "given.png"))
    assert board.held is not None
    colours = pixels[..., : 3 if channels > 2 else 1] + np.zeros((3, 5, 3), np.uint8)
    alpha = pixels[..., -1:] if channels in (2, 4) else np.full((3, 5, 1), 255, np.uint8)
    wanted = np.concatenate([colours, alpha], axis=-1)
    assert board.held == (wanted.tobytes(), 5, 3)
    clipboard.paste(tmp_path / "pasted.png")
    found = read_picture(tmp_path / "pasted.png").pixels
    np.testing.assert_array_equal(found, wanted if channels in (2, 4) else colours)


@pytest.mark.parametrize("chord", ["ctrl+c", "ctrl+v"])
def test_without_copykitten_a_sentence_says_how_to_get_it(robot: Robot, chord: str) -> None:
    robot.key(chord)
    robot.frame()
    (message,) = robot.editor.messages.shown
    assert message.text == "Pictures on the clipboard need copykitten; install it with: pip install copykitten"
    assert not robot.editor.exports.is_running


class Asked:
    """Takes the place of the process that exports, of which it has the job."""

    is_done = False
    jobs: ClassVar[list[Job]] = []

    def __init__(self, job: Job) -> None:
        self.jobs.append(job)

    def poll(self, warn: object) -> None:
        """It is never done."""

    def stop(self, then: Callable[[], object] = lambda: None) -> None:
        then()


@pytest.mark.parametrize("way", ["copy", "export"])
@pytest.mark.parametrize("tick", [0, 1, 4])
def test_what_is_copied_or_exported_at_any_moment_is_a_recipe_that_can_be_read_again(
    robot: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, tick: int, way: str
) -> None:
    """And of what is seen, also at the start: no recipe lasts less than a step, and in none does anything act there."""
    monkeypatch.setitem(sys.modules, "copykitten", Board())
    monkeypatch.setattr("app.ui.export_dialog.ExportProcess", Asked)
    editor, acts = robot.editor, "[[force]]\nkind = 'vortex'\npoint = [0.5, 0.5]\n"
    acts += "[[stroke]]\ntool = 'push'\nsamples = [[0, 0.3, 0.3, 1], [3, 0.4, 0.3, 1]]\n"
    made = Recipe.parse(acts + "[[handle]]\nat = [0.7, 0.7]\nto = [0.8, 0.7]")
    parts = {"force": made.force, "stroke": made.stroke, "handle": made.handle}
    editor.session.edit("Whirl", **parts, duration=5 * editor.session.dt)
    robot.rest()
    editor.session.seek(tick)
    robot.rest()
    if way == "export":
        job = export_dialog(robot, tmp_path).job()
    else:
        editor.exports.copy(editor.session)
        job = Asked.jobs.pop()
    assert job.recipe.ticks == max(tick, 1)
    assert Recipe.parse(job.recipe.text()) == job.recipe
    replay = Replay(editor.session.device, job.recipe, editor.session.pictures)
    replay.seek(job.recipe.ticks)
    seen, made_again = editor.session.replay.warp.read(), replay.warp.read()
    replay.release()
    assert editor.session.tick == tick
    assert np.array_equal(seen, made_again)
    assert seen.any() == (tick > 0)


def test_a_copy_that_is_stopped_is_on_no_clipboard_and_leaves_nothing(
    robot: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    board, folder, exports = Board(), tmp_path / "temporary", robot.editor.exports
    folder.mkdir()
    monkeypatch.setitem(sys.modules, "copykitten", board)
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    robot.key("ctrl+c")
    robot.frame()
    assert exports.is_running
    assert list(folder.iterdir())
    exports.cancel()
    assert not exports.is_running
    robot.until(lambda: not list(folder.iterdir()))
    assert board.held is None


def test_only_the_newest_pasted_pictures_are_kept(tmp_path: Path) -> None:
    names = [clipboard.new_name().name for _ in range(clipboard.KEPT + 3)]
    for name in (*names, "own.png"):
        (tmp_path / name).touch()
    clipboard.prune(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["own.png", *names[3:]]


def test_a_pasted_picture_goes_into_its_project(robot: Robot, tmp_path: Path) -> None:
    """Its own file is only kept until others have been pasted."""

    def dialog(folder: Path) -> SaveDialog:
        project = replace(robot.editor.session.project, folder=folder, keeper=None)
        chooser = robot.editor.chooser
        return SaveDialog(
            project, tmp_path / "a.fluidwarp", Preferences(embed=False), chooser, robot.editor.files.write, None
        )

    pasted, other = dialog(clipboard.pasted_folder()), dialog(tmp_path)
    assert (pasted.must_embed, pasted.embed) == (True, True)
    assert (other.must_embed, other.embed) == (False, False)


def test_while_a_file_is_exported_no_picture_is_copied(
    device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "copykitten", Board())
    monkeypatch.setattr("app.ui.export_dialog.ExportProcess", Still)
    with Robot(device, small_project(tmp_path)) as robot:
        exports = robot.editor.exports
        exports.start(export_dialog(robot, tmp_path).job())
        name = exports.name
        robot.key(ACTIONS["copy_picture"].keys[0])
        assert "An export is still running" in robot.editor.messages.shown[-1].text
        assert (exports.is_running, exports.name) == (True, name)
        exports.cancel()

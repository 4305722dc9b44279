"""A clip in the window: the frame that belongs to the playhead, playing, painting, exporting, saving."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Generator
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from threading import Semaphore
from typing import Any

import numpy as np
import pytest
from PIL import Image

from app.errors import UserError
from app.media.animation import animation_writer
from app.media.clip import WHOLE, Clip, FrameRange
from app.media.numbered import sequence_of
from app.media.pictures import read_picture, write_picture
from app.media.reel import AHEAD, Reel
from app.model.picture import Picture
from app.progress import Progress
from app.ui.export_choices import ANIMATION, ANIMATIONS, PICTURE
from app.ui.files import tick_for
from app.ui.widgets import Ui
from app.work.export import run
from app.work.jobs import Outputs
from app.work.journal import Origin, project_of
from app.work.tasks import Task
from solver.gl.device import Device
from support.editing import Robot, export_dialog, pattern, small_project
from support.widgets import Widgets

FRAMES, RATE = 20, Fraction(25)


def frame(number: int) -> np.ndarray:
    """The pattern, a step further to the right in each."""
    return np.roll(pattern(96, 64).pixels, 3 * number, axis=1)


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A clip that is read as it was written."""
    path = tmp_path_factory.mktemp("film") / "film.mkv"
    with animation_writer(path, RATE) as write:
        for number in range(FRAMES):
            write(frame(number))
    return path


@pytest.fixture
def clip(tmp_path: Path, film: Path) -> Path:
    return Path(shutil.copy(film, tmp_path))


@pytest.fixture
def viewer(robot: Robot, clip: Path) -> Robot:
    """With the clip open, on a coarse grid."""
    robot.drop(clip)
    robot.editor.session.begin_with(grid=32)
    return robot


def shown(robot: Robot) -> np.ndarray:
    """The frame that is looked up, unless it is the first."""
    picture = robot.editor.workspace.work.picture
    assert picture is not None
    return picture.pixels


def go_to(robot: Robot, tick: int) -> None:
    robot.editor.session.seek(tick)
    robot.frame()
    robot.until(lambda: not robot.editor.session.is_moving and not robot.editor.workspace.work.awaits_frame)


def test_scrubbing_shows_the_very_frame(viewer: Robot):
    session = viewer.editor.session
    assert (session.length, session.dt) == (FRAMES - 1, 1 / 25)
    for tick in (7, 3, FRAMES - 1, 0, 12):
        go_to(viewer, tick)
        assert session.frame == viewer.editor.workspace.work.frame == tick
        np.testing.assert_array_equal(shown(viewer), frame(tick))
    viewer.see()
    seen = viewer.canvas()
    height, width = (side // 8 for side in seen.shape[:2])
    places = [(7 * width // 2, 5 * height // 2), (width // 2, height // 2)]  # far from where colours change
    rect = viewer.editor.view.rect
    for x, y in places:
        expected = frame(12)[int(y / rect.height * 64), int(x / rect.width * 96)].astype(int)
        assert np.abs(seen[y, x].astype(int) - expected).max() <= 3


def test_it_is_played_to_its_end_and_painted_on(viewer: Robot):
    """What is painted at a moment begins there; the clip goes on while the fluid comes to rest, and after it."""
    session = viewer.editor.session
    go_to(viewer, 4)
    viewer.drag((0.4, 0.5), (0.6, 0.5), steps=3)
    viewer.rest()
    (stroke,) = session.recipe.stroke
    assert stroke.first_tick == 4
    assert session.moment == session.end > stroke.last_tick
    np.testing.assert_array_equal(session.replay.warp.read() == 0, False)
    go_to(viewer, 0)
    viewer.key("space")
    viewer.until(lambda: not session.playing)
    assert session.moment == session.length
    viewer.until(lambda: viewer.editor.workspace.work.frame == FRAMES - 1)
    viewer.key("ctrl+z")
    assert session.recipe.stroke == ()


def test_what_is_exported_is_what_the_command_line_makes(viewer: Robot, device: Device, tmp_path: Path):
    """Of the project and of the saved recipe: the clip in its rate; a still is the moment's frame with its warp."""
    editor, session = viewer.editor, viewer.editor.session
    go_to(viewer, 4)
    frozen = freeze_colour(viewer, frame(4), 40, 31)
    viewer.key("p")
    viewer.drag((0.3, 0.5), (0.6, 0.5), steps=3)
    viewer.rest()
    go_to(viewer, 6)
    dialog = export_dialog(viewer, tmp_path)
    assert [preset.name for preset in dialog.presets] == ["Web", "Print", "Film"], "no ping-pong of a clip"
    dialog.choices.kind, dialog.name = ANIMATION, "dialog"
    dialog.choices.format[ANIMATION] = next(n for n, kind in enumerate(ANIMATIONS) if kind.name == "MP4")
    run(device, dialog.job(), Progress())
    dialog.start, dialog.end, dialog.name = 0.2, 0.24, "part"
    run(device, dialog.job(), Progress())
    dialog.choices.kind, dialog.name = PICTURE, "still"
    run(device, dialog.job(), Progress())
    editor.files.write(tmp_path / "work.fluidwarp")
    (tmp_path / "work.toml").write_text(session.recipe.text(), "utf-8")

    def rendered(recipe: str, output: str, **options: object) -> bytes:
        outputs = Outputs(tmp_path / output, **options)  # type: ignore[arg-type]
        Task(recipe=str(tmp_path / recipe), edits={}, picture=None, outputs=outputs).perform(lambda: device, Progress())
        return outputs.file.read_bytes() if outputs.file and outputs.file.exists() else b""

    whole = (tmp_path / "dialog.mp4").read_bytes()
    assert rendered("work.toml", "again.mp4") == rendered("work.fluidwarp", "saved.mp4") == whole
    assert rendered("work.toml", "again.part.mp4", part=(5, 6)) == (tmp_path / "part.mp4").read_bytes()
    rendered("work.toml", "f.%02d.png", part=(6, 6))
    one, other = (read_picture(tmp_path / name).pixels for name in ("f.06.png", "still.png"))
    np.testing.assert_array_equal(one, other[..., :3])
    assert (one != frame(6)).any()
    rendered("work.fluidwarp", "first.png")
    np.testing.assert_array_equal(read_picture(tmp_path / "first.png").pixels[frozen][:, :3], frame(0)[frozen])


def freeze_colour(viewer: Robot, pixels: np.ndarray, x: int, y: int) -> np.ndarray:
    """Freeze what is all over the canvas of the colour of a pixel of what it shows; where that is, (h, w) bool."""
    state, session = viewer.editor.state, viewer.editor.session
    viewer.key("m")
    state.select_by, state.connected, state.tolerance = "colour", False, 0.05
    viewer.click(*viewer.at((x + 0.5) / 96, (y + 0.5) / 64))
    viewer.key("enter")
    near = np.linalg.norm((pixels.astype(float) - pixels[y, x]) / 255, axis=2) <= 0.05
    texels = session.replay.masks.frozen.get()
    found = texels[
        texels.shape[0] // 64 // 2 :: texels.shape[0] // 64, texels.shape[1] // 96 // 2 :: texels.shape[1] // 96
    ]
    np.testing.assert_array_equal(found > 127, near)
    return near


def test_thickness_by_brightness_is_that_of_the_frame_that_is_seen(viewer: Robot, widgets: Widgets):
    go_to(viewer, 12)
    viewer.key("m")
    widgets.click("Thickness")
    widgets.type("By brightness", "100")
    texels = viewer.editor.session.replay.masks.thickness.get().reshape(64, 2, 96, 2).mean(axis=(1, 3))
    grey = frame(12) @ [0.2126, 0.7152, 0.0722]
    assert np.corrcoef(texels.ravel(), grey.ravel())[0, 1] > 0.97


@pytest.mark.parametrize("tick", [0, 5])
def test_after_two_others_it_comes_back_with_the_frame_at_the_playhead(viewer: Robot, tmp_path: Path, tick: int):
    """Also if the playhead went there when no other was drawn yet: it was the first, and the last was taken for it."""
    workspace = viewer.editor.workspace
    go_to(viewer, 12)
    session = viewer.editor.session
    session.seek(tick)
    for _ in range(2):
        workspace.open(small_project(tmp_path))
        viewer.frame()
    workspace.undo()
    workspace.undo()
    assert viewer.editor.session is session
    viewer.frame()
    viewer.until(lambda: not session.is_moving and not workspace.work.awaits_frame)
    assert (session.frame, workspace.frames_after_first) == (tick, tick)
    if tick:
        np.testing.assert_array_equal(shown(viewer), frame(tick))
    else:
        assert workspace.work.picture is None


def test_the_pace_sound_and_time_code_of_what_is_exported_are_told(
    viewer: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    dialog, words, wrapped = export_dialog(viewer, tmp_path), list[str](), Ui.wrapped
    clip, dialog.choices.kind = dialog.clip, ANIMATION
    assert clip is not None
    viewer.editor.dialogs.show(dialog)
    monkeypatch.setattr(Ui, "wrapped", lambda ui, said, *how: words.append(said) or wrapped(ui, said, *how))
    sound, code = {"sounds": ("aac",)}, {"timecode": "01:00:00:00"}
    about: list[tuple[dict[str, Any], str]] = [
        ({}, "at its 25 frames a second."),
        ({"fps": Fraction(30000, 1001)}, "at its 29.97 frames a second."),
        ({"durations": (1, 3)}, "at its own pace."),
        (sound, "at its 25 frames a second, with its sound."),
        (code, "at its 25 frames a second, with its time code."),
        (sound | code, "at its 25 frames a second, with its sound and time code."),
    ]
    for changes, told in about:
        dialog.clip = replace(clip, **changes)
        words.clear()
        viewer.frame()
        assert [said for said in words if said.startswith("The clip")] == [f"The clip warped, {told}"]


def test_it_comes_back_with_its_project_and_is_missed_with_a_sentence(viewer: Robot, clip: Path, tmp_path: Path):
    """A project refers to its clip; unsaved work on it outlasts a crash."""
    editor = viewer.editor
    viewer.drag((0.4, 0.5), (0.6, 0.5), steps=3)
    viewer.rest()
    editor.files.write(tmp_path / "work.fluidwarp", embed=True)
    assert (tmp_path / "work.fluidwarp").stat().st_size < clip.stat().st_size
    assert not editor.session.project.embedded
    viewer.drop(tmp_path / "work.fluidwarp")
    go_to(viewer, 15)
    np.testing.assert_array_equal(shown(viewer), frame(15))
    assert editor.session.length > FRAMES - 1
    origin = Origin.of(editor.session.project)
    again = project_of(origin, editor.session.recipe)
    assert again.clip == editor.session.project.clip
    assert origin.is_of(again.data)
    clip.rename(tmp_path / "moved.mkv")
    go_to(viewer, 3)  # it is still open
    viewer.drop(tmp_path / "work.fluidwarp")
    assert editor.messages.shown[-1].text == (
        f"Cannot read {clip}, which {tmp_path / 'work.fluidwarp'} names: there is no such file; "
        "check the name, or put it back."
    )


@pytest.mark.parametrize("name", ["a.gif", "a.webp", "a.tif", "s.%03d.png"])
def test_pages_and_numbered_files_are_clips_too(robot: Robot, tmp_path: Path, name: str):
    """Those of one file are kept in the project, as pictures are."""
    images = [Image.fromarray(frame(number)) for number in range(5)]
    if name == "s.%03d.png":
        for number, image in enumerate(images, 7):
            image.save(tmp_path / (name % number))
    else:
        lossless: dict[str, Any] = {"lossless": True, "exact": True} if name.endswith(".webp") else {}
        images[0].save(tmp_path / name, save_all=True, append_images=images[1:], duration=40, **lossless)
    robot.drop(tmp_path / name)
    editor = robot.editor
    editor.session.begin_with(grid=32)
    assert editor.session.length == 4
    for path in (None, tmp_path / "work.fluidwarp"):
        if path is not None:
            editor.files.write(path, embed=True)
            robot.drop(path)
        go_to(robot, 3)
        assert editor.workspace.work.frame == (10 if name.startswith("s") else 3)
        if not name.endswith(".gif"):  # which has 256 colours
            np.testing.assert_array_equal(shown(robot), frame(3))
    assert editor.session.project.embedded != name.startswith("s")


def test_a_clip_that_is_cut_short_ends_where_it_ends(robot: Robot, clip: Path):
    """And one that is written anew is told of, and the work goes on."""
    data = clip.read_bytes()
    clip.write_bytes(data[: len(data) * 2 // 3])
    robot.drop(clip)
    editor = robot.editor
    go_to(robot, FRAMES - 1)
    last = editor.workspace.work.frame
    assert 5 < last < FRAMES - 1
    assert editor.session.length == last
    np.testing.assert_array_equal(shown(robot), frame(last))
    clip.write_bytes(data[: len(data) // 2])
    go_to(robot, 2)
    assert f"Cannot read {clip}: it is not as it was" in editor.messages.shown[-1].text
    assert not editor.workspace.work.awaits_frame
    robot.drag((0.4, 0.5), (0.6, 0.5), steps=2)
    assert len(editor.session.recipe.stroke) == 1


@dataclass(frozen=True, kw_only=True)
class Counted(Clip):
    """A hundred frames of one grey each, of which its file would tell of five."""

    def pictures(self, part: FrameRange = WHOLE, *_: Any, **others: Any) -> Generator[tuple[int, Picture], None, None]:
        for number in range(part[0], 100):
            yield number, Picture(np.full((2, 2, 3), number, np.uint8))

    def digest(self, number: int) -> str:
        return ""


def test_a_clip_that_is_longer_than_its_file_tells_is_played_on():
    """What is read ahead shows that there is more; at its end that is known."""
    clip = Counted(path=Path("a"), width=2, height=2, bits=8, alpha=False, pixel_format="rgb24", fps=RATE, frames=5)
    reel = Reel(clip, lambda picture: picture.pixels)
    assert reel.frames == 5
    for wanted, frames in ((4, 5 + AHEAD), (28, 29 + AHEAD), (90, 100)):
        reel.want(wanted, runs=True)
        deadline = time.monotonic() + 60
        while reel.frames != frames and time.monotonic() < deadline:
            time.sleep(0.001)
        assert reel.frames == frames
    reel.close()


@dataclass(frozen=True, kw_only=True)
class Slow(Counted):
    """Of it a frame comes when somebody lets it."""

    let: Semaphore

    def pictures(self, part: FrameRange = WHOLE, *_: Any, **others: Any) -> Generator[tuple[int, Picture], None, None]:
        for each in super().pictures(part):
            self.let.acquire()
            yield each


def test_a_frame_is_awaited_until_it_is_the_one_that_is_shown() -> None:
    """Also once it has been read: nothing else would make the window draw again."""
    clip = Counted(path=Path("a"), width=2, height=2, bits=8, alpha=False, pixel_format="rgb24", fps=RATE, frames=5)
    reel = Reel(clip, lambda picture: picture.pixels)
    reel.want(3, runs=False)
    deadline = time.monotonic() + 60
    while ((best := reel.best()) is None or best[0] != 3) and time.monotonic() < deadline:
        time.sleep(0.001)
    assert (reel.awaits(2), reel.awaits(3)) == (True, False)
    reel.close()


@dataclass(frozen=True, kw_only=True)
class Failing(Counted):
    """It cannot be read from its fourth frame on."""

    def pictures(self, part: FrameRange = WHOLE, *_: Any, **others: Any) -> Generator[tuple[int, Picture], None, None]:
        for number, picture in super().pictures(part):
            if number >= 3:
                raise UserError("it cannot be read")
            yield number, picture


def test_of_what_cannot_be_read_nothing_is_awaited_but_what_is_there() -> None:
    clip = Failing(path=Path("a"), width=2, height=2, bits=8, alpha=False, pixel_format="", fps=RATE, frames=5)
    reel = Reel(clip, lambda picture: picture.pixels)
    reel.want(1, runs=False)
    deadline = time.monotonic() + 60
    while reel.best() is None and time.monotonic() < deadline:
        time.sleep(0.001)
    assert reel.awaits(0)
    reel.want(4, runs=True)
    while not reel.error and time.monotonic() < deadline:
        time.sleep(0.001)
    assert not reel.awaits(1)
    reel.want(1, runs=True)
    assert reel.error == "it cannot be read"
    assert (reel.awaits(1), reel.awaits(0)) == (False, True)
    reel.close()


@dataclass(frozen=True, kw_only=True)
class Losing(Counted):
    """Of it two things are lost when it is read."""

    def pictures(
        self, part: FrameRange = WHOLE, *_: Any, notice: Callable[[str], None] = print, **others: Any
    ) -> Generator[tuple[int, Picture], None, None]:
        notice("its depth is lost")
        notice("its alpha is lost")
        yield from super().pictures(part)


def test_what_is_lost_of_a_clip_that_is_looked_at_is_told() -> None:
    clip = Losing(path=Path("a"), width=2, height=2, bits=8, alpha=False, pixel_format="", fps=RATE, frames=5)
    reel = Reel(clip, lambda picture: picture.pixels)
    reel.want(3, runs=False)
    deadline = time.monotonic() + 60
    while ((found := reel.best()) is None or found[0] != 3) and time.monotonic() < deadline:
        time.sleep(0.001)
    assert reel.take_words() == ["its depth is lost", "its alpha is lost"], "all of it, in order"
    assert reel.take_words() == []
    reel.close()


@pytest.mark.parametrize("runs", [True, False])
def test_the_newest_frame_before_it_stands_in_for_one_that_is_late(runs: bool) -> None:
    """While it runs; one that is looked for is not shown as another that lies farther on."""
    let = Semaphore(0)
    clip = Slow(path=Path("a"), width=2, height=2, bits=8, alpha=False, pixel_format="", fps=RATE, frames=9, let=let)
    reel = Reel(clip, lambda picture: picture.pixels)

    def stands_in() -> int | None:
        return found[0] if (found := reel.best()) else None

    for wanted, come in ((0, 3), (4, 0)):
        reel.want(wanted, runs)
        let.release(come) if come else None
        deadline = time.monotonic() + 60
        while reel.best() is None and time.monotonic() < deadline:
            time.sleep(0.001)
    while stands_in() != 2 and time.monotonic() < deadline:
        time.sleep(0.001)
    assert stands_in() == 2
    reel.close()
    let.release(99)


def test_numbered_files_that_are_not_all_there_are_told_of(robot: Robot, tmp_path: Path):
    """In words of the window."""
    for number in (1, 2, 4):
        write_picture(tmp_path / f"f{number}.png", pattern(96, 64))
    robot.drop(tmp_path / "f%d.png")
    said = robot.editor.messages.shown[-1].text
    assert said.endswith("f%d.png: of 1-4 it lacks the frame 3; make them, or number the others without a gap.")


def test_numbered_files_are_opened_by_one_of_them(robot: Robot, tmp_path: Path):
    """Padded or not; the others of the folder are none of them."""
    for name in ("a1_008.png", "a1_009.png", "a1_010.png", "b9.png", "b10.png", "c.png"):
        write_picture(tmp_path / name, pattern(96, 64))
    assert sequence_of(tmp_path / "a1_010.png").name == "a1_%03d.png"
    assert sequence_of(tmp_path / "b10.png").name == "b%d.png"
    with pytest.raises(UserError, match=r"There is no number in the name c\.png"):
        sequence_of(tmp_path / "c.png")
    robot.editor.files.open_work(sequence_of(tmp_path / "a1_009.png"))
    robot.until(lambda: not robot.editor.files.is_loading)
    assert robot.editor.session.frame == 8
    assert robot.editor.session.length == 2


@pytest.mark.parametrize(
    ("rate", "tick"),
    [(25, 1 / 25), (60, 1 / 30), (Fraction(24000, 1001), 1001 / 24000), (10, 1 / 30), (100, 3 / 100), (50, 1 / 25)],
)
def test_ticks_and_frames_begin_together(rate: int | Fraction, tick: float):
    assert tick_for(Fraction(rate)) == pytest.approx(tick, abs=1e-12)

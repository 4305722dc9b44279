"""The real window under a virtual X server, used with a real pointer and real keys."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from app.media import project as projects
from app.media.pictures import read_picture, write_picture
from app.model.mask_edits import MaskStroke
from app.work.journal import Damaged, read
from app.work.recovery import JOURNAL, find
from support.commands import Run
from support.desk import PATIENCE, Desk, needs_a_screen
from support.editing import pattern, small_project, write_foreign_map

pytestmark = needs_a_screen


@pytest.fixture
def desk(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Desk]:
    desk = Desk(tmp_path, **getattr(request, "param", {}))
    yield desk
    desk.close()


@pytest.mark.parametrize("desk", [{"threads": True, "rehearses": False}], indirect=True, ids=["threads"])
def test_a_whole_session(desk: Desk, tmp_path: Path, fluidwarp: Run) -> None:
    picture, work = tmp_path / "pattern.png", tmp_path / "work.fluidwarp"
    write_picture(picture, pattern())
    desk.open(picture)
    desk.drag((400, 400), (520, 400))
    desk.until(lambda: desk.title() == "pattern * - fluidwarp", "the push to be recorded")
    desk.key("f")
    desk.drag((700, 300), (720, 360))
    desk.key("ctrl+z")
    desk.key("ctrl+z")
    desk.until(lambda: desk.title() == "pattern - fluidwarp", "everything to be undone")
    desk.key("ctrl+shift+z")
    desk.key("ctrl+y")
    desk.until(lambda: desk.title() == "pattern * - fluidwarp", "everything to be redone")

    desk.save(work)
    saved = projects.load(work)
    # What is frozen was painted in time, or in none, if the fluid was at rest by then.
    painted = [edit for edit in saved.recipe.mask if isinstance(edit, MaskStroke)]
    assert [stroke.tool for stroke in (*saved.recipe.stroke, *painted)] == ["push", "freeze"]
    assert np.array_equal(saved.picture.pixels, pattern().pixels)

    exported = tmp_path / "work warped.png"

    def export() -> None:
        desk.ask("ctrl+e")
        desk.key("Return")

    desk.insist(export, exported.exists, "the export")
    desk.leave()

    desk.open(work)
    desk.leave()
    rendered = tmp_path / "rendered.png"
    assert fluidwarp(tmp_path, "render", work.name, "-o", rendered.name).returncode == 0
    assert np.array_equal(read_picture(exported).pixels, read_picture(rendered).pixels)


@pytest.mark.parametrize("desk", [{"rehearses": True}], indirect=True, ids=["rehearsed"])
def test_quick_strokes_on_a_fine_grid_all_act_in_full(desk: Desk, tmp_path: Path, fluidwarp: Run) -> None:
    """Four of them are drawn while the first is simulated, and exported while the last ones still wait."""
    work, exported, rendered = (tmp_path / name for name in ("work.fluidwarp", "work warped.png", "rendered.png"))
    projects.save(small_project(tmp_path, grid=128), work)
    desk.open(work)
    words = ["mousemove", "300", "200", "sleep", "0.5"]
    for y in (200, 300, 400, 500):
        # Each begins where the pointer stops as it comes from a panel, while its shape changes.
        words += ["mousemove", "1100", "600", "sleep", "0.4", "mousemove", "300", str(y + 50), "sleep", "0.02"]
        words += ["mousemove", "300", str(y), "mousedown", "1", "sleep", "0.05"]
        words += ["mousemove", "500", str(y), "sleep", "0.05", "mousemove", "700", str(y), "mouseup", "1"]
    with desk.busy():  # on which a grid of 128 is as fine as one of 256 otherwise
        desk.do(*words)
        desk.until(lambda: desk.title() == "work * - fluidwarp", "the strokes to be recorded")
        desk.insist(lambda: desk.key("ctrl+s"), lambda: desk.title() == "work - fluidwarp", "it to be saved")

    def export() -> None:
        desk.ask("ctrl+e")
        desk.key("Return")

    desk.insist(export, exported.exists, "the export")
    strokes = projects.load(work).recipe.stroke
    assert len(strokes) == 4
    for stroke in strokes:
        assert stroke.samples[-1][1] - stroke.samples[0][1] == pytest.approx(400 / 864, abs=0.01)
    begun = [stroke.samples[0][2] for stroke in strokes]
    assert np.diff(begun) == pytest.approx(3 * [100 / 648], abs=1e-4)
    assert all(later.first_tick > stroke.last_tick for stroke, later in pairwise(strokes))
    assert fluidwarp(tmp_path, "render", work.name, "-o", rendered.name).returncode == 0
    assert exported.read_bytes() == rendered.read_bytes()


def pushes_in(journals: Path) -> int:
    """In the one journal that there is, as far as it has been written."""
    for journal in journals.glob(f"*/{JOURNAL}"):
        with suppress(Damaged):
            return [entry.name for entry in read(journal.read_bytes())[1].entries].count("Push")
    return 0


def test_a_killed_editor_gives_the_work_back(desk: Desk, tmp_path: Path) -> None:
    work, journals = tmp_path / "work.fluidwarp", tmp_path / "state" / "fluidwarp" / "journals"
    desk.open_pattern()
    for number in range(3):
        desk.drag((400, 300 + 100 * number), (520, 300 + 100 * number))
    desk.until(lambda: pushes_in(journals) == 3, "the pushes to be recorded on the disk")
    assert find(journals) == ([], [])  # while its editor lives
    assert desk.editor is not None
    desk.editor.kill()
    desk.editor.wait()
    (found,), notices = find(journals)
    assert notices == []
    assert [entry.name for entry in found.work.entries if entry.name == "Push"] == ["Push"] * 3
    found.leave()

    desk.open_pattern()
    desk.until(lambda: desk.is_asking, "the work to be offered")

    def restore() -> None:
        desk.do("mousemove", "846", "405", "sleep", "0.6", "click", "1", "sleep", "1")

    desk.insist(restore, lambda: desk.title() == "pattern * - fluidwarp", "the work to be restored")
    desk.save(work)
    assert repr(projects.load(work).recipe) == repr(found.work.recipe)
    assert list(journals.iterdir()) == []
    desk.leave()
    desk.open(work)  # and is asked nothing
    desk.leave()


def close_minimised(desk: Desk) -> None:
    """Minimise the window, as a window manager does, and press its close button in the list of windows."""
    from Xlib import X, display
    from Xlib.protocol import event

    screen = display.Display(desk.env["DISPLAY"])
    window = screen.create_resource_object("window", int(desk.window))
    state, protocols, close = map(screen.intern_atom, ("WM_STATE", "WM_PROTOCOLS", "WM_DELETE_WINDOW"))
    window.change_property(state, state, 32, [3, 0])  # iconic
    window.unmap()
    screen.sync()
    time.sleep(0.5)
    window.send_event(
        event.ClientMessage(window=window, client_type=protocols, data=(32, [close, X.CurrentTime, 0, 0, 0]))
    )
    screen.sync()


def test_the_window_comes_back_as_it_was_left_and_a_minimised_one_is_closed_at_once(desk: Desk, tmp_path: Path) -> None:
    desk.open_pattern()
    desk.do("windowsize", desk.window, "900", "610", "windowmove", desk.window, "140", "70")
    time.sleep(0.5)
    desk.key("ctrl+l")
    desk.key("Tab")
    desk.key("bracketright")
    desk.leave()
    desk.open_pattern()
    wanted = {"X": "140", "Y": "70", "WIDTH": "900", "HEIGHT": "610"}

    def is_there() -> bool:
        told = dict(line.split("=") for line in desk.do("getwindowgeometry", "--shell", desk.window).split())
        return wanted.items() <= told.items()

    desk.until(is_there, "the window to be where it was")
    kept = json.loads((tmp_path / "config" / "fluidwarp" / "preferences.json").read_text())
    assert (kept["theme"], kept["inspector"]) == ("light", False)
    assert kept["brushes"]["push"]["radius"] == pytest.approx(0.15 * 1.15)
    # The bar is light, and where the inspector was is the ground around the picture.
    desk.until(lambda: desk.seen()[75, 400].min() > 200, "the bar to be light")
    assert (desk.seen()[400, 1030] == 0xD2).all()
    close_minimised(desk)
    desk.until_gone()


def test_a_minimised_window_with_unsaved_work_comes_back_to_ask(desk: Desk) -> None:
    desk.open_pattern()
    desk.drag((400, 400), (520, 400))
    desk.until(lambda: desk.title() == "pattern * - fluidwarp", "the push to be recorded")
    close_minimised(desk)
    desk.until(lambda: desk.is_shown, "the window")
    assert desk.editor is not None
    assert desk.editor.poll() is None


def test_a_window_that_is_interrupted_closes_and_what_was_not_saved_is_offered(desk: Desk, tmp_path: Path) -> None:
    desk.open_pattern()
    desk.drag((400, 400), (520, 400))
    desk.until(lambda: desk.title() == "pattern * - fluidwarp", "the push to be recorded")
    assert desk.editor is not None
    desk.editor.send_signal(signal.SIGINT)
    assert desk.editor.wait(60) == 130
    (found,), notices = find(tmp_path / "state" / "fluidwarp" / "journals")
    found.leave()
    assert (notices, found.work.strokes) == ([], 1)


def test_without_a_display_it_says_what_works(tmp_path: Path) -> None:
    env = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
    done = subprocess.run(
        [sys.executable, "-m", "app", "edit"], env=env, capture_output=True, text=True, cwd=Path(__file__).parents[2]
    )
    assert done.returncode == 2
    assert "fluidwarp render" in done.stderr
    assert "fluidwarp doctor" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


@pytest.mark.parametrize("name", ["nonesuch.png", "nonesuch.toml", "nonesuch.fluidwarp"])
def test_a_file_that_is_not_there_opens_no_window(tmp_path: Path, fluidwarp: Run, name: str) -> None:
    done = fluidwarp(tmp_path, "edit", name)
    assert done.returncode == 1
    assert name in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_a_picture_and_a_map_of_another_program_dropped_on_the_window(desk: Desk, tmp_path: Path) -> None:
    other = tmp_path / "Käse 2.png"
    write_picture(other, pattern(100, 60))
    desk.open_pattern()
    command = [sys.executable, str(Path(__file__).parents[1] / "support" / "dropping.py"), desk.window, str(other)]
    subprocess.run(command, env=desk.env, check=True, timeout=PATIENCE)
    desk.until(lambda: desk.title() == "Käse 2 - fluidwarp", "the dropped picture")
    desk.key("ctrl+z")
    desk.until(lambda: desk.title() == "pattern - fluidwarp", "the first picture again")
    # The sample that was there until the picture had been read is nothing to go back to.
    desk.key("ctrl+z")
    time.sleep(0.5)
    assert desk.title() == "pattern - fluidwarp"

    st_map = tmp_path / "st.exr"
    write_foreign_map(st_map, 240, 180)
    command = [sys.executable, str(Path(__file__).parents[1] / "support" / "dropping.py"), desk.window, str(st_map)]

    def use_as_map() -> None:
        subprocess.run(command, env=desk.env, check=True, timeout=PATIENCE)
        desk.do("sleep", "1.5", "mousemove", "643", "440", "sleep", "0.4", "click", "1", "sleep", "0.6")

    desk.insist(use_as_map, lambda: desk.title() == "pattern * - fluidwarp", "the map to be taken")


def test_sliders_take_a_typed_number_and_their_default_and_keys_of_files_work_while_it_is_typed(
    desk: Desk, tmp_path: Path
) -> None:
    work = tmp_path / "work.fluidwarp"
    desk.open_pattern()
    desk.save(work)

    def viscosity() -> float:
        """As it is in the project, saved now; saving takes it."""
        desk.insist(lambda: desk.key("ctrl+s"), lambda: desk.title() == "work - fluidwarp", "it to be saved")
        return projects.load(work).recipe.fluid.viscosity

    def leave_typed(text: str) -> None:
        """Type a number, and leave it so."""
        hold, let_go = ("keydown", "ctrl", "sleep", "0.2"), ("sleep", "0.2", "keyup", "ctrl", "sleep", "0.5")
        desk.do("mousemove", "1128", "159", "sleep", "0.3", *hold, "click", "1", *let_go)
        desk.key("ctrl+a")
        desk.type(text)

    def type_number() -> None:
        leave_typed("1.25")
        desk.key("Return")

    def click_twice() -> None:
        desk.do(
            "mousemove", "1128", "159", "sleep", "0.3", "click", "--repeat", "2", "--delay", "60", "1", "sleep", "1"
        )

    desk.insist(type_number, lambda: viscosity() == pytest.approx(1.25), "the number to be taken")
    desk.insist(click_twice, lambda: viscosity() == pytest.approx(0.03), "the default to be taken")

    def save() -> None:
        leave_typed("1.25")
        desk.key("ctrl+s")
        time.sleep(1)

    desk.insist(save, lambda: projects.load(work).recipe.fluid.viscosity == 1.25, "the number to be saved")
    assert desk.title() == "work - fluidwarp"
    desk.drag((400, 400), (520, 400))
    desk.until(lambda: desk.title() == "work * - fluidwarp", "the push to be recorded")

    def export() -> None:
        leave_typed("0.5")
        desk.ask("ctrl+e")
        desk.key("Return")
        desk.until((tmp_path / "work warped.png").exists, "the export")
        desk.insist(lambda: desk.key("ctrl+s"), lambda: desk.title() == "work - fluidwarp", "it to be saved")

    def is_taken() -> bool:
        return any(change.viscosity == 0.5 for change in projects.load(work).recipe.change[-1:])

    desk.insist(export, is_taken, "the number to be taken before the export")


# Where in a window of 1280 x 800 the export dialog has its kinds, and how far down its formats.
KINDS = {"picture": (489, 177), "animation": (639, 177), "map": (790, 177)}
FORMATS = 213


EXPORTS = (
    ("picture", 753, "work warped.tif"),
    ("map", 470, "work map.exr"),
    ("animation", 838, "work warped.%04d.png"),
)


def test_what_is_exported_is_what_the_command_line_makes(desk: Desk, tmp_path: Path, fluidwarp: Run) -> None:
    desk.open_pattern()
    desk.drag((400, 400), (520, 400))
    desk.until(lambda: desk.title() == "pattern * - fluidwarp", "the push to be recorded")
    desk.save(tmp_path / "work.fluidwarp")

    def begun(name: str) -> bool:
        return any(tmp_path.glob(name.replace("%04d", "*")))

    for kind, across, name in EXPORTS:
        desk.insist(lambda kind=kind, across=across: export(desk, kind, across), lambda name=name: begun(name), name)
        compare(desk, tmp_path, fluidwarp, kind, name)


def export(desk: Desk, kind: str, across: int) -> None:
    desk.ask("ctrl+e")
    for x, y in (KINDS[kind], (across, FORMATS)):
        desk.do("mousemove", str(x), str(y), "sleep", "0.4", "click", "1", "sleep", "0.6")
    desk.key("Return")


def compare(desk: Desk, folder: Path, fluidwarp: Run, kind: str, name: str) -> None:
    """What the window writes, and what the command line makes of the saved work."""
    pattern_of_names = name.replace("%04d", "*")
    line = folder / "line"
    line.mkdir(exist_ok=True)
    how = ["--map" if kind == "map" else "-o", str(line / name)]
    assert fluidwarp(folder, "render", "work.fluidwarp", *how).returncode == 0
    made = sorted(line.glob(pattern_of_names))
    assert (len(made) > 10) == (kind == "animation")
    # The files of a sequence appear one by one; the window cannot resume, and leaves no record of them.
    desk.until(lambda: len(list(folder.glob(pattern_of_names))) >= len(made), f"all of {name}")
    assert [path.name for path in made] == sorted(path.name for path in folder.glob(pattern_of_names))
    assert not list(folder.glob(".fluidwarp-frames-*"))
    for path in made:
        same = (
            folder / path.name
        ).read_bytes() == path.read_bytes()  # asserted as a whole: their diff would take hours
        assert same, path.name
    if kind != "map":
        with Image.open(folder / made[-1].name) as seen:
            assert seen.size == (240, 180)
            assert seen.format == {"tif": "TIFF", "png": "PNG"}[name[-3:]]
            difference = np.abs(np.asarray(seen.convert("RGB"), float) - pattern().pixels).mean()
        assert difference > 1

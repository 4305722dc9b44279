"""The real window in the hands of a person who rests, types, clicks beside the picture and has little room."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

from app.media import project as projects
from app.media.pictures import write_picture
from support.commands import Run
from support.desk import Desk, needs_a_screen
from support.editing import pattern

pytestmark = needs_a_screen

RESTED = 2.0  # seconds in which everything that comes by itself has come, also on a busy machine


@pytest.fixture(params=[False, True], ids=["idle", "busy"])
def desk(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Desk]:
    """A screen with the pattern in the editor, on a machine that has nothing else to do, or has."""
    desk = Desk(tmp_path)
    try:
        desk.open_pattern()
        still(desk)
        with desk.busy() if request.param else nullcontext():
            yield desk
    finally:
        desk.close()


# What asks nothing of a machine at rest that it does not ask of a busy one.
busy = pytest.mark.parametrize("desk", [True], indirect=True, ids=["busy"])
# And what asks nothing of a busy one that it does not ask of one at rest.
idle = pytest.mark.parametrize("desk", [False], indirect=True, ids=["idle"])


def still(desk: Desk) -> np.ndarray:
    """What is seen once it does not change any more."""
    before, since = desk.dump(), time.monotonic()
    while time.monotonic() - since < RESTED:
        time.sleep(0.1)
        dump = desk.dump()
        if dump != before:
            before, since = dump, time.monotonic()
    return desk.seen(before)


def changed(seen: np.ndarray, before: np.ndarray, left: int, top: int, right: int, bottom: int) -> np.ndarray:
    """Where a part of the screen differs, (h, w) bool."""
    part = slice(top, bottom), slice(left, right)
    return np.abs(seen[part].astype(int) - before[part]).max(axis=-1) > 20


def differs(seen: np.ndarray, before: np.ndarray, left: int, top: int, right: int, bottom: int) -> bool:
    return bool(changed(seen, before, left, top, right, bottom).sum() > 100)


def test_what_is_told_goes_by_itself_and_what_is_explained_comes_to_a_pointer_that_rests(desk: Desk) -> None:
    """A message; then a tooltip and menus. One window for both: its start is most of what either takes."""
    desk.do("mousemove", "1140", "780")
    before = still(desk)
    desk.key("ctrl+shift+c")
    desk.until(lambda: differs(desk.seen(), before, 640, 50, 1000, 130), "the message")
    # It stays until somebody is there, and on a slow machine comes after the keys were let go.
    desk.do("mousemove", "1140", "778")
    desk.until(lambda: not differs(desk.seen(), before, 640, 50, 1000, 130), "the message to go")
    desk.do("mousemove", "24", "400")
    time.sleep(RESTED)
    before = desk.seen()
    desk.do("mousemove", "24", "120")
    desk.until(lambda: differs(desk.seen(), before, 60, 100, 300, 200), "the tooltip")
    desk.do("mousemove", "24", "24", "click", "1", "sleep", "0.5")
    desk.until(lambda: differs(desk.seen(), before, 20, 200, 280, 320), "the menu")
    menu = still(desk)
    desk.do("mousemove", "80", "86")
    desk.until(lambda: differs(desk.seen(), menu, 300, 72, 390, 100), "what was opened lately")


@busy
def test_a_dialog_is_whole_after_the_interface_has_changed_its_size(desk: Desk) -> None:
    desk.key("ctrl+comma")
    before = still(desk)
    # 150 % of the five sizes.
    desk.do("mousemove", "730", "347", "sleep", "0.3", "click", "1")
    desk.until(lambda: differs(desk.seen(), before, 300, 100, 980, 700), "the new size")
    seen = still(desk)
    # Nothing has been left for later: a key that does nothing draws some frames more.
    for _ in range(5):
        desk.key("shift")
    assert not differs(still(desk), seen, 300, 100, 980, 700)


@idle
def test_what_was_covered_is_drawn_again(desk: Desk) -> None:
    """And not only with the next frame, for which nothing asks: the pointer rests elsewhere."""
    desk.do("mousemove", "1140", "640")
    before = still(desk)
    with desk.covered(500, 300, 700, 450):
        still(desk)
    assert not differs(still(desk), before, 500, 300, 700, 450)


@busy
def test_a_number_is_typed_in_the_unit_that_is_shown(desk: Desk, tmp_path: Path) -> None:
    def strokes(path: Path) -> list[float]:
        return [stroke.radius for stroke in projects.load(path).recipe.stroke]

    def type_size(text: str) -> None:
        desk.do("mousemove", "300", "24", "sleep", "0.3", "keydown", "ctrl", "sleep", "0.2", "click", "1")
        desk.do("sleep", "0.2", "keyup", "ctrl", "sleep", "0.5")
        desk.type(text)
        desk.key("Return")

    type_size("60 px")
    desk.drag((400, 400), (440, 400))
    desk.until(lambda: desk.title() == "pattern * - fluidwarp", "the push to be recorded")
    desk.save(tmp_path / "work.fluidwarp")
    assert strokes(tmp_path / "work.fluidwarp")[0] == pytest.approx(60 / 2 / 240)


@busy
def test_clicks_beside_the_picture_do_not_paint(desk: Desk, tmp_path: Path) -> None:
    # Tab twice is the inspector and back; the next keys are still the editor's.
    part = 900, 50, 1000, 130  # the right end of the message, but not the hint of the tool, which may come late
    desk.key("Tab")
    desk.key("Tab")
    before = still(desk)
    desk.key("f")
    desk.until(lambda: differs(desk.seen(), before, 50, 0, 220, 48), "the tool")
    (tmp_path / "no.png").write_bytes(b"no picture")
    command = [
        sys.executable,
        str(Path(__file__).parents[1] / "support" / "dropping.py"),
        desk.window,
        str(tmp_path / "no.png"),
    ]
    desk.do("mousemove", "1140", "780")
    before = still(desk)
    subprocess.run(command, env=desk.env, check=True, timeout=60)
    desk.until(lambda: differs(desk.seen(), before, *part), "the message")
    message = still(desk)
    rows, columns = np.nonzero(changed(message, before, *part))
    right, top = int(columns.max()) + 900, int(rows.min()) + 50
    desk.do("mousemove", str(right - 25), str(top + 20), "sleep", "0.5", "click", "1", "sleep", "0.5")
    desk.do("mousemove", "1140", "780")
    desk.until(lambda: not differs(desk.seen(), before, *part), "the message to be closed")
    assert desk.title() == "pattern - fluidwarp"


@busy
def test_the_wheel_goes_through_the_history(desk: Desk) -> None:
    desk.key("t")  # which acts where it is held
    for step in range(12):
        place = str(300 + 20 * step), "300"
        desk.do("mousemove", *place, "sleep", "0.1", "mousedown", "1", "sleep", "0.1", "mouseup", "1", "sleep", "0.1")
    desk.do("mousemove", "1140", "640")
    before = still(desk)
    desk.do("click", "4", "sleep", "0.1", "click", "4", "sleep", "0.1", "click", "4")
    desk.until(lambda: differs(desk.seen(), before, 1016, 570, 1270, 690), "the history to move")


@pytest.mark.parametrize("name", ["render", "pattern.toml"])  # a picture is in test_window.py
def test_a_file_alone_is_opened(tmp_path: Path, name: str) -> None:
    write_picture(tmp_path / "pattern.png", pattern())
    (tmp_path / "render").write_bytes((tmp_path / "pattern.png").read_bytes())
    (tmp_path / "pattern.toml").write_text('picture = "pattern.png"\nduration = 0.1\n')
    desk = Desk(tmp_path)
    try:
        desk.open(tmp_path / name)
        assert desk.title() == f"{Path(name).stem} - fluidwarp"
    finally:
        desk.close()


def test_with_little_room_everything_is_reached(tmp_path: Path) -> None:
    desk = Desk(tmp_path, (800, 520))
    try:
        desk.open_pattern()
        seen = still(desk)
        # The last tool, in the second column.
        desk.do("mousemove", "70", "252", "sleep", "0.3", "click", "1")
        desk.until(lambda: differs(desk.seen(), seen, 50, 0, 540, 48), "the tool")
        desk.key("p")
        seen = still(desk)
        # What the bar has no room for.
        desk.do("mousemove", "488", "24", "sleep", "0.3", "click", "1", "sleep", "0.5")
        desk.until(lambda: differs(desk.seen(), seen, 480, 60, 700, 110), "the rest of the bar")
    finally:
        desk.close()


@pytest.mark.parametrize("size", [(1600, 1040), (3000, 1700)], ids=["small", "large"])
def test_at_200_percent_the_window_is_twice_as_large_but_fits(tmp_path: Path, size: tuple[int, int]) -> None:
    desk = Desk(tmp_path, size)
    try:
        desk.scale(2.0)
        desk.open_pattern()
        told = dict(line.split("=") for line in desk.do("getwindowgeometry", "--shell", desk.window).split())
        assert (int(told["WIDTH"]), int(told["HEIGHT"])) == (min(size[0], 2560), min(size[1], 1600))
    finally:
        desk.close()


def test_a_file_that_is_not_there_and_a_command_that_is_none_are_told_in_a_sentence(
    tmp_path: Path, fluidwarp: Run
) -> None:
    for word, status, said in (
        ("nonesuch.png", 1, "nonesuch.png does not exist"),
        ("./nonesuch", 1, "does not exist"),
        ("rendr", 2, "neither a file nor a command; the commands are edit, render"),
    ):
        ran = fluidwarp(tmp_path, word)
        assert ran.returncode == status
        assert said in ran.stderr
        assert len(ran.stderr.strip().splitlines()) == 1
    # A command stays one, whatever lies in the folder.
    (tmp_path / "doctor").write_text("no picture")
    ran = fluidwarp(tmp_path, "doctor", "--nonesuch")
    assert ran.returncode == 2
    assert "no such option" in ran.stderr

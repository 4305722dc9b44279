"""Unsaved work outlasts a kill: it is found by the next start, by one at a time, and by none while its owner lives."""

from __future__ import annotations

import errno
import gc
import os
import random
import shutil
import struct
import subprocess
import sys
import tempfile
import threading
import time
import weakref
import zlib
from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from imgui_bundle import imgui

from app.errors import UserError
from app.media import project as projects
from app.media.pictures import write_picture
from app.media.project import Project
from app.model.document import Document
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.model.strokes import Stroke
from app.model.undo import History
from app.ui.recovery_dialog import Offer, about
from app.ui.widgets import Ui
from app.work import locks, recovery
from app.work.locks import Lock
from app.work.recovery import Found, Journal, find
from app.work.session import Session
from killing import Painter, digest_of, digest_of_warp
from solver.gl.device import Device
from support.editing import Robot, pattern, small_project
from support.permissions import as_a_user, needs_permissions
from support.widgets import Widgets


def until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.005)


class Desk:
    """A project that is open, and its journal."""

    def __init__(self, root: Path, project: Project) -> None:
        self.root = root
        self.project = project
        self.document = Document(project.recipe)
        self.journal = Journal(root)

    def push(self, count: int = 1, samples: int = 3) -> None:
        for _ in range(count):
            now = self.document.recipe
            places = tuple((now.ticks + k, 0.1 + k / (7 * samples), 0.5, 1.0) for k in range(samples))
            stroke = Stroke(tool="push", samples=places)
            recipe = now.edited(stroke=(*now.stroke, stroke), duration=now.duration + 1 / 3)
            self.document.history.commit("Push", recipe)
            self.keep()

    def keep(self) -> None:
        self.journal.keep(self.project, self.document)

    def save(self, path: Path, embedded: bool = True) -> None:
        self.project = projects.save(replace(self.project, recipe=self.document.recipe), path, embedded)
        self.document.saved()
        self.keep()

    def write(self) -> None:
        """Wait until all is on the disk."""
        until(lambda: not self.journal.is_behind)

    def die(self) -> None:
        """Leave the journal as a kill would."""
        self.journal.end(discard=False)
        self.journal.join()


@pytest.fixture
def desk(tmp_path: Path) -> Desk:
    return Desk(tmp_path / "state" / "journals", small_project(tmp_path))


class Late(threading.Event):
    """An event after whose waiting for the pause something happens before the waiter goes on."""

    then: ClassVar[list[Callable[[], None]]] = []

    def wait(self, timeout: float | None = None) -> bool:
        heard = super().wait(timeout)
        if timeout == recovery.PAUSE:
            while self.then:
                self.then.pop()()
        return heard


def test_a_stroke_just_after_the_pause_for_the_fluid_is_written_through(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(threading, "Event", Late)
    desk = Desk(tmp_path / "journals", small_project(tmp_path))
    written: list[int] = []
    desk.push()
    desk.write()
    sync = os.fsync
    monkeypatch.setattr(os, "fsync", lambda file: (sync(file), written.append(file)))
    Late.then.append(desk.push)
    recipe = desk.document.recipe
    desk.document.history.amend(recipe.edited(duration=recipe.duration + 1 / 30))
    desk.keep()
    until(lambda: not Late.then and not desk.journal.is_behind)
    until(lambda: bool(written))
    desk.die()


def found_in(root: Path) -> Found:
    """The one work that is found; without a sentence about any other."""
    found, notices = find(root)
    assert notices == []
    (one,) = found
    return one


def is_all_of(found: Found, document: Document) -> bool:
    history = document.history
    told = [repr((entry.name, entry.recipe)) for entry in history.entries]
    same = [repr((entry.name, entry.recipe)) for entry in found.work.entries] == told
    return same and found.work.index == history.index and found.work.saved == document.saved_recipe


def files_in(root: Path) -> list[str]:
    return sorted(str(path.relative_to(root)) for path in root.rglob("*")) if root.exists() else []


# The journal of one work ---------------------------------------------------------------------------------------------


def test_a_stroke_for_which_the_oldest_one_goes_waits_for_no_pause(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    """There are no more of them than before, as while the fluid comes to rest."""
    desk.push()
    history = desk.document.history
    desk.push()
    desk.write()
    history.budget = history.nbytes + history.entries[-1].nbytes - 1
    count = len(history.entries)
    monkeypatch.setattr(recovery, "PAUSE", 1e3)
    desk.push()
    assert len(history.entries) == count
    desk.write()
    desk.die()
    assert is_all_of(found_in(desk.root), desk.document)


def test_what_was_not_saved_is_found(desk: Desk) -> None:
    desk.push(3)
    desk.document.history.undo()
    desk.keep()
    desk.die()
    found = found_in(desk.root)
    assert is_all_of(found, desk.document)
    assert found.work.strokes == 3
    project = found.load()
    assert project.recipe == desk.document.recipe
    assert np.array_equal(project.picture.pixels, desk.project.picture.pixels)
    assert (project.name, project.folder, project.path) == ("pattern", desk.project.folder, None)
    assert found.is_as_it_was(project)


@pytest.mark.parametrize("clock", [-2e9, 0, 4e9, 1e12])
def test_what_was_not_saved_is_found_whatever_the_clock_said(tmp_path: Path, clock: float) -> None:
    """In memory, where there is such a disk: it keeps times that others do not, of years that have no date."""
    shared = Path("/dev/shm")
    with tempfile.TemporaryDirectory(dir=shared if shared.is_dir() else tmp_path) as folder:
        desk = Desk(Path(folder), small_project(tmp_path))
        desk.push(3)
        desk.die()
        for path in Path(folder).rglob("*"):
            os.utime(path, (clock, clock))
        found = found_in(desk.root)
        assert is_all_of(found, desk.document)
        assert about(found, date(2026, 1, 1)).startswith("3 strokes, ")


def test_nothing_is_written_where_nothing_would_be_lost(desk: Desk, tmp_path: Path) -> None:
    desk.keep()
    desk.document.begin_with(desk.document.recipe.edited(duration=0.5))
    desk.keep()
    assert not desk.root.exists()
    desk.push()
    desk.write()
    assert len(files_in(desk.root)) == 3
    desk.document.history.undo()
    desk.keep()
    desk.write()
    assert len(files_in(desk.root)) == 3  # a redo would be lost
    desk.document.history.redo()
    desk.save(tmp_path / "work.fluidwarp")
    desk.write()
    assert files_in(desk.root) == []
    desk.push()
    desk.journal.end(discard=True)
    desk.journal.join()
    assert files_in(desk.root) == []


def test_after_saving_with_something_to_redo_nothing_is_offered(desk: Desk, tmp_path: Path) -> None:
    desk.push(2)
    desk.document.history.undo()
    desk.keep()
    desk.save(tmp_path / "work.fluidwarp")
    desk.write()
    assert files_in(desk.root) == []
    desk.document.history.redo()
    desk.keep()
    desk.die()
    assert is_all_of(found_in(desk.root), desk.document)


def test_what_is_done_right_after_saving_belongs_to_what_was_saved(desk: Desk, tmp_path: Path) -> None:
    """Before the journal has heard of the saving, too."""
    path = tmp_path / "work.fluidwarp"
    desk.push(2)
    desk.write()
    desk.save(path)
    desk.push()
    desk.die()
    found = found_in(desk.root)
    assert is_all_of(found, desk.document)
    assert found.file == path


def test_another_grid_for_all_of_it_is_no_saving(desk: Desk) -> None:
    desk.push(2)
    desk.document.history.undo()
    desk.keep()
    desk.write()
    history = desk.document.history

    def on_a_fine_grid(recipe: Recipe) -> Recipe:
        return recipe.edited(fluid=recipe.fluid.model_copy(update={"grid": 64}))

    entries = [replace(entry, recipe=on_a_fine_grid(entry.recipe)) for entry in history.entries]
    desk.document.restore(History.restored(entries, history.index), on_a_fine_grid(desk.document.saved_recipe))
    desk.keep()
    desk.die()
    assert is_all_of(found_in(desk.root), desk.document)


def test_a_journal_does_not_grow_without_bound(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recovery, "SLACK", 5000)
    largest = 0
    desk.push(3)
    for _ in range(200):
        desk.document.history.undo()
        desk.keep()
        desk.document.history.redo()
        desk.keep()
        desk.write()
        file = next(desk.root.rglob(recovery.JOURNAL))
        largest = max(largest, file.stat().st_size)
    begun = len(b"".join(recovery.beginning(*_whole(desk))))
    assert largest < 2 * begun + 5000 + 200
    assert largest > begun + 4000  # and it had grown meanwhile
    desk.push()
    desk.die()
    assert is_all_of(found_in(desk.root), desk.document)


def _whole(desk: Desk) -> tuple[recovery.Origin, recovery.Work]:
    history = desk.document.history
    return recovery.Origin.of(desk.project), recovery.Work(history.entries, history.index, desk.document.saved_recipe)


def test_a_journal_torn_anywhere_gives_what_was_whole(desk: Desk) -> None:
    desk.push(6)
    desk.write()
    desk.die()
    file = next(desk.root.rglob(recovery.JOURNAL))
    whole = file.read_bytes()
    dice = random.Random(1)
    recipes = [repr(entry.recipe) for entry in desk.document.history.entries]
    for _ in range(40):
        file.write_bytes(whole[: dice.randrange(len(whole))])
        found, notices = find(desk.root)
        assert len(found) + len(notices) <= 1
        for one in found:
            kept = [repr(entry.recipe) for entry in one.work.entries]
            assert kept == recipes[: len(kept)]
            one.leave()
        if not file.parent.exists():  # nothing but the beginning: nothing would be lost
            file.parent.mkdir()


@pytest.mark.parametrize("discard", [False, True])
def test_work_that_was_restored_outlasts_a_failure_before_its_first_frame(desk: Desk, discard: bool) -> None:
    """And does not outlast the person who leaves it then."""
    desk.push()
    desk.die()
    journal = Journal(desk.root, found_in(desk.root).held)
    journal.end(discard)
    journal.join()
    if discard:
        assert files_in(desk.root) == []
    else:
        assert is_all_of(found_in(desk.root), desk.document)


def test_of_work_that_was_closed_nothing_stays_in_memory(tmp_path: Path) -> None:
    desk = Desk(tmp_path / "journals", small_project(tmp_path))
    desk.push()
    journal, project = desk.journal, weakref.ref(desk.project)
    journal.end(discard=True)
    journal.join()
    del desk
    gc.collect()
    assert project() is None


def test_a_journal_goes_on_after_it_was_restored(desk: Desk) -> None:
    """And at every moment of it there is one journal, with everything."""
    desk.push(2)
    desk.die()
    with next(desk.root.rglob(recovery.JOURNAL)).open("ab") as file:
        file.write(b"01234567 {torn")
    found = found_in(desk.root)
    folder = found.held.folder
    again = Desk(desk.root, found.load())
    again.document.restore(found.work.history, found.work.saved)
    again.journal = Journal(desk.root, found.held)
    assert again.document.is_dirty
    again.keep()
    again.push()
    again.write()
    assert [path.name for path in desk.root.iterdir()] == [folder.name]
    again.die()
    assert is_all_of(found_in(desk.root), again.document)


# Whose it is ---------------------------------------------------------------------------------------------------------


def test_a_journal_belongs_to_one(desk: Desk, tmp_path: Path) -> None:
    other = Desk(desk.root, small_project(tmp_path))
    desk.push()
    other.push(2)
    desk.write()
    other.write()
    assert find(desk.root) == ([], [])  # both live
    desk.die()
    found = found_in(desk.root)
    assert is_all_of(found, desk.document)
    assert find(desk.root) == ([], [])  # somebody is being asked about it
    found.leave()
    again = found_in(desk.root)
    assert is_all_of(again, desk.document)
    again.discard()
    assert find(desk.root) == ([], [])
    other.push()
    other.die()
    assert is_all_of(found_in(desk.root), other.document)


def test_an_empty_folder_that_is_taken_while_it_is_removed_stays_its_takers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A window begins a journal while another one starts and tidies: its lock was gone, so a third was offered it."""
    mine = recovery.LockedFolder.new(tmp_path)
    taken: list[Lock | None] = []
    release = Lock.release

    def released(lock: Lock) -> None:
        release(lock)
        monkeypatch.setattr(Lock, "release", release)
        taken.append(Lock.take(mine.folder / recovery.LOCK))

    monkeypatch.setattr(Lock, "release", released)
    mine.discard()
    assert taken[0] is not None
    assert Lock.take(mine.folder / recovery.LOCK) is None
    taken[0].release()


def test_a_folder_that_is_removed_before_it_is_locked_is_made_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[Path] = []
    mkdtemp = tempfile.mkdtemp

    def make(prefix: str, dir: Path) -> str:
        made.append(Path(mkdtemp(prefix=prefix, dir=dir)))
        if len(made) == 1:
            made[0].rmdir()  # by another one, which found nothing in it
        return str(made[-1])

    monkeypatch.setattr(tempfile, "mkdtemp", make)
    mine = recovery.LockedFolder.new(tmp_path)
    assert [mine.folder] == made[1:]
    mine.discard()
    assert list(tmp_path.iterdir()) == []


def test_a_lock_ends_with_its_process(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    code = (
        "import sys, time; from pathlib import Path; from app.work.locks import Lock\n"
        f"lock = Lock.take(Path({str(path)!r})); print(lock is not None, flush=True); time.sleep(600)"
    )
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, cwd=Path.cwd())
    assert process.stdout is not None
    assert process.stdout.readline() == "True\n"
    assert Lock.take(path) is None
    process.kill()
    process.wait()
    lock = Lock.take(path)
    assert lock is not None
    lock.release()


def test_what_a_kill_leaves_before_the_first_record_is_swept(desk: Desk) -> None:
    desk.push()
    desk.write()
    for name, files in {"a": (), "b": ("lock",), "c": ("lock", f"{recovery.JOURNAL}.new")}.items():
        (desk.root / name).mkdir()
        for file in files:
            (desk.root / name / file).write_bytes(b"")
    assert find(desk.root) == ([], [])
    assert len(list(desk.root.iterdir())) == 1
    desk.die()
    assert is_all_of(found_in(desk.root), desk.document)


# What goes wrong -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("data", "words"), [(b"fluidwarp journal 9 1\nx\n", "newer fluidwarp"), (b"\0\0\0", "damaged and cannot be read")]
)
def test_what_cannot_be_read_is_left_alone_with_a_sentence(desk: Desk, data: bytes, words: str) -> None:
    desk.push()
    desk.die()
    file = next(desk.root.rglob(recovery.JOURNAL))
    file.write_bytes(data)
    found, notices = find(desk.root)
    assert found == []
    assert len(notices) == 1
    assert words in notices[0]
    assert str(file.parent) in notices[0]
    assert file.read_bytes() == data


@pytest.mark.skipif(sys.platform == "win32", reason="links and pipes are made otherwise there")
@pytest.mark.parametrize("place", [recovery.JOURNAL, "lock", "."])
def test_no_link_among_the_journals_is_followed(desk: Desk, place: str) -> None:
    """Whether it leads somewhere or not: nothing is made, removed or written there."""
    desk.push()
    desk.die()
    folder = next(desk.root.rglob(recovery.JOURNAL)).parent
    path, kept = Path(os.path.normpath(folder / place)), desk.root.parent / "kept"
    path.rename(kept)
    path.symlink_to(kept)
    before = {file: file.read_bytes() for file in desk.root.parent.rglob("*") if file.is_file()}
    for _ in range(2):
        found, (notice,) = find(desk.root)
        assert found == []
        assert notice == (
            f"The journal of unsaved work in {folder} cannot be read (it is a link, or something in it is); "
            "it is left there."
        )
        assert path.is_symlink()
        assert {file: file.read_bytes() for file in desk.root.parent.rglob("*") if file.is_file()} == before
        if kept.is_file() and place == "lock":  # now it leads nowhere
            kept.unlink()
            before = {file: data for file, data in before.items() if file not in (kept, path)}


@pytest.mark.skipif(sys.platform == "win32", reason="links are made otherwise there")
def test_a_journal_is_not_written_through_a_link(desk: Desk) -> None:
    desk.push()
    desk.die()
    (victim := desk.root.parent / "victim").write_bytes(b"of somebody")
    folder = next(desk.root.rglob(recovery.JOURNAL)).parent
    (folder / recovery.NEW).symlink_to(victim)
    again = Desk(desk.root, desk.project)
    again.journal = Journal(desk.root, found_in(desk.root).held)
    again.push()
    told = list[str | None]()
    until(lambda: told.append(again.journal.trouble) or told[-1] is not None)
    assert "it is a link; remove it" in (told[-1] or "")
    again.push()  # the link is gone with what was to be written in its place
    again.die()
    assert victim.read_bytes() == b"of somebody"
    assert is_all_of(found_in(desk.root), again.document)


@pytest.mark.skipif(sys.platform == "win32", reason="links and pipes are made otherwise there")
@pytest.mark.parametrize("what", ["folder", "link", "pipe"])
@pytest.mark.parametrize("place", [recovery.JOURNAL, "lock", ".", ".."])
def test_what_is_no_file_is_told_in_a_sentence_and_nothing_of_it_is_removed(desk: Desk, what: str, place: str) -> None:
    desk.push()
    desk.die()
    folder = next(desk.root.rglob(recovery.JOURNAL)).parent
    path = Path(os.path.normpath(folder / place))
    path.rename(kept := desk.root.parent / "kept")
    if what == "link":
        path.symlink_to(path.name)
    elif what == "folder" or place == ".":
        path.mkdir()
        (path / "inside").write_text("of somebody")
    else:
        os.mkfifo(path)
    before = sorted(path.rglob("*"))
    found, notices = find(desk.root)
    for one in found:
        one.leave()
    assert found == [] or (place, what) == ("lock", "pipe")  # which can be locked as any file
    is_foreign = what != "link" and place in (".", "..")
    assert len(notices) == (not found and not is_foreign)
    assert all(" (" in notice or place == recovery.JOURNAL for notice in notices)
    assert all("left there" in notice and str(desk.root) in notice for notice in notices)
    assert os.path.lexists(path)
    assert sorted(path.rglob("*")) == before
    assert kept.exists()


@pytest.mark.skipif(sys.platform != "linux", reason="names are text there")
def test_work_on_a_picture_whose_name_is_not_utf8_is_found(tmp_path: Path) -> None:
    small_project(tmp_path)
    picture = tmp_path / os.fsdecode(b"caf\xe9.png")
    (tmp_path / "pattern.png").rename(picture)
    desk = Desk(tmp_path / "journals", projects.from_picture(picture))
    desk.push(2)
    desk.die()
    found = found_in(desk.root)
    assert found.work.strokes == 2
    assert (found.file, found.load().recipe) == (picture, desk.document.recipe)


@pytest.mark.parametrize("is_project", [False, True])
def test_a_picture_that_is_gone_is_told_and_the_work_kept(desk: Desk, tmp_path: Path, is_project: bool) -> None:
    """By its own name, also where a project names it."""
    if is_project:
        desk.save(tmp_path / "work.fluidwarp", embedded=False)
    desk.push()
    desk.die()
    picture = tmp_path / "pattern.png"
    picture.rename(tmp_path / "elsewhere.png")
    found = found_in(desk.root)
    with pytest.raises(UserError, match=r"There is no .*pattern\.png any more\. .* is kept; put the file back"):
        found.load()
    found.leave()
    (tmp_path / "elsewhere.png").rename(picture)
    assert is_all_of(found_in(desk.root), desk.document)


def test_a_picture_that_was_saved_in_the_project_may_go(desk: Desk, tmp_path: Path) -> None:
    desk.save(tmp_path / "work.fluidwarp")
    desk.push()
    desk.die()
    (tmp_path / "pattern.png").unlink()
    found = found_in(desk.root)
    project = found.load()
    assert np.array_equal(project.picture.pixels, desk.project.picture.pixels)
    assert project.path == tmp_path / "work.fluidwarp"
    assert found.is_as_it_was(project)


def test_a_picture_that_is_only_in_a_project_is_found_there(tmp_path: Path) -> None:
    path = tmp_path / "work.fluidwarp"
    projects.save(small_project(tmp_path), path)
    (tmp_path / "pattern.png").unlink()
    desk = Desk(tmp_path / "journals", projects.load(path))
    desk.push()
    desk.die()
    found = found_in(desk.root)
    project = found.load()
    assert project.recipe == desk.document.recipe
    assert project.keeper is not None
    assert (project.name, project.path) == ("work", path)
    assert found.is_as_it_was(project)
    path.unlink()
    with pytest.raises(UserError, match=r"There is no .*work\.fluidwarp any more"):
        found.load()


def test_what_is_told_of_a_damaged_project_is_in_whole_sentences(tmp_path: Path) -> None:
    path = tmp_path / "work.fluidwarp"
    projects.save(small_project(tmp_path), path)
    desk = Desk(tmp_path / "journals", projects.load(path))
    desk.push()
    desk.die()
    path.write_bytes(b"no project")
    with pytest.raises(UserError, match=r"get it again\. The work on “work” is kept; put the file back"):
        found_in(desk.root).load()


def test_a_picture_that_is_too_large_by_now_is_told_as_in_a_window(desk: Desk, tmp_path: Path) -> None:
    """Which has no --max-pixels."""
    desk.push()
    desk.die()
    data = bytearray((tmp_path / "pattern.png").read_bytes())
    data[16:24] = struct.pack(">II", 30000, 30000)
    data[29:33] = struct.pack(">I", zlib.crc32(data[12:29]))
    (tmp_path / "pattern.png").write_bytes(data)
    with pytest.raises(
        UserError, match=r"30000 x 30000 pixels .* make it smaller first\. The work on “pattern” is kept;"
    ):
        found_in(desk.root).load()


@pytest.mark.parametrize("embedded", [True, False])
@pytest.mark.parametrize("reopened", [True, False], ids=["reopened", "saved"])
def test_what_another_has_saved_since_is_noticed(tmp_path: Path, embedded: bool, reopened: bool) -> None:
    """Work that is restored would otherwise be saved over it without a question."""
    path = tmp_path / "work.fluidwarp"
    project = projects.save(small_project(tmp_path), path, embedded)
    desk = Desk(tmp_path / "journals", projects.load(path) if reopened else project)
    desk.push()
    desk.die()
    found = found_in(desk.root)
    assert not found.load().is_overtaken
    projects.save(projects.load(path), path, embedded)
    assert found.load().is_overtaken


def test_another_picture_of_the_same_name_is_noticed(desk: Desk, tmp_path: Path) -> None:
    desk.push()
    desk.die()
    write_picture(tmp_path / "pattern.png", Picture(np.zeros((180, 240, 3), np.uint8)))
    found = found_in(desk.root)
    assert not found.is_as_it_was(found.load())


def test_a_folder_that_cannot_be_written_is_told_and_tried_again(desk: Desk) -> None:
    desk.root.parent.mkdir()
    desk.root.write_text("a file is in the way")
    desk.push(2)
    desk.write()
    assert desk.journal.trouble is not None
    assert str(desk.root) in desk.journal.trouble
    desk.root.unlink()
    desk.push()
    desk.write()
    desk.die()
    assert is_all_of(found_in(desk.root), desk.document)


def test_what_could_not_be_written_is_tried_again_though_nothing_more_is_done(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recovery, "AGAIN", 0.05)
    desk.root.parent.mkdir()
    desk.root.write_text("a file is in the way")
    desk.push(2)
    desk.write()
    assert desk.journal.trouble is not None
    desk.root.unlink()
    until(lambda: desk.journal.trouble is None)
    desk.die()
    assert is_all_of(found_in(desk.root), desk.document)


def test_what_could_not_be_written_is_tried_again_at_the_end(desk: Desk) -> None:
    desk.root.parent.mkdir()
    desk.root.write_text("a file is in the way")
    desk.push(2)
    desk.write()
    assert desk.journal.trouble is not None
    desk.root.unlink()
    desk.die()
    assert is_all_of(found_in(desk.root), desk.document)


def test_a_journal_that_is_too_large_is_neither_written_nor_read(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recovery, "MOST", 2000)
    whole = 0
    while desk.journal.trouble is None:
        whole = len(desk.document.recipe.stroke)
        desk.push()
        desk.write()
    assert whole > 2
    assert "with all its history it has more than 0 MB; save the work" in desk.journal.trouble
    desk.die()
    found = found_in(desk.root)
    assert found.work.strokes == whole
    folder = found.held.folder
    found.leave()
    assert files_in(folder) == ["lock", recovery.JOURNAL]
    monkeypatch.setattr(recovery, "MOST", (folder / recovery.JOURNAL).stat().st_size - 1)
    assert find(desk.root)[1] == [
        f"The journal of unsaved work in {folder} has more than 0 MB, the most that one may have; it is left there."
    ]
    assert files_in(folder) == ["lock", recovery.JOURNAL]


def test_work_whose_last_is_damaged_is_found_with_a_sentence(desk: Desk) -> None:
    desk.push(3)
    desk.write()
    desk.die()
    file = next(desk.root.rglob(recovery.JOURNAL))
    *lines, third, fourth = file.read_bytes().splitlines(keepends=True)
    file.write_bytes(b"".join([*lines, third.replace(b"push", b"hush"), fourth]))
    (found,), notices = find(desk.root)
    said = "damaged; what came before it can be restored, and what came after it cannot."
    assert notices == [f"A part of the unsaved work on “pattern” is {said}"]
    assert 0 < found.work.strokes < 3
    found.leave()


def test_work_whose_first_is_damaged_is_told_and_kept(desk: Desk) -> None:
    for _ in range(3):
        desk.push()
        desk.write()
    desk.die()
    file = next(desk.root.rglob(recovery.JOURNAL))
    head, opened, first, *later = file.read_bytes().splitlines(keepends=True)
    damaged = b"".join([head, opened, first.replace(b"push", b"hush"), *later])
    file.write_bytes(damaged)
    found, (said,) = find(desk.root)
    assert not found
    assert said.endswith("is damaged and cannot be read; it is left there.")
    assert file.read_bytes() == damaged


def test_lines_of_nothing_in_a_journal_take_no_time(desk: Desk) -> None:
    desk.push()
    desk.write()
    desk.die()
    file = next(desk.root.rglob(recovery.JOURNAL))
    with file.open("ab") as stream:
        stream.write(b"\n" * 20_000_000)
    (found,), notices = find(desk.root)
    assert (found.work.strokes, notices) == (1, [])
    found.leave()


def test_work_that_no_recipe_may_hold_is_told_and_kept(desk: Desk) -> None:
    """Each of its parts is valid in itself; together they would be a hundred million ticks."""
    desk.push()
    now = desk.document.recipe
    fluid = now.fluid.model_copy(update={"dt": 0.001})
    desk.document.history.commit("Long", now.edited(duration=1e6, fluid=fluid))
    desk.keep()
    desk.die()
    found = found_in(desk.root)
    with pytest.raises(
        UserError, match=r"“pattern”: 'duration' .* ticks; make dt larger\. The work is left as it is, in"
    ):
        found.load()
    found.leave()
    assert is_all_of(found_in(desk.root), desk.document)


@pytest.mark.parametrize("gone", ["the journal", "its folder", "all journals"])
def test_a_journal_that_is_taken_away_is_begun_anew(desk: Desk, gone: str) -> None:
    desk.push(2)
    desk.write()
    ((journal,),) = [list(desk.root.glob("*/work.journal"))]
    if gone == "the journal":
        journal.unlink()
    else:
        shutil.rmtree(journal.parent if gone == "its folder" else desk.root)
    desk.push(2)
    desk.write()
    assert desk.journal.trouble is None
    desk.die()
    assert is_all_of(found_in(desk.root), desk.document)


def test_on_a_disk_without_locks_nothing_is_left(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(handle: int) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(locks, "try_lock", refuse)
    desk.push(2)
    desk.write()
    assert desk.journal.trouble is not None
    desk.die()
    assert files_in(desk.root) == []


@pytest.mark.skipif(sys.platform != "linux", reason="limits the size of files as Linux does")
def test_a_disk_that_is_full_loses_nothing_that_was_written(tmp_path: Path) -> None:
    """In a process of its own, whose files may not grow beyond 10,000 bytes, as on a full disk."""
    code = f"""
import resource, signal, sys
from pathlib import Path
sys.path[:0] = {[str(folder) for folder in Path(__file__).parents[:3]]!r}
from test_recovery import Desk, small_project
desk = Desk(Path({str(tmp_path)!r}) / "journals", small_project(Path({str(tmp_path)!r})))
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, 10_000))
for number in range(30):
    desk.push(samples=20)
    desk.write()
    print(number + 1, desk.journal.trouble, flush=True)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    told = [line.split(" ", 1) for line in done.stdout.splitlines()]
    well = max(int(number) for number, trouble in told if trouble == "None")
    assert 3 < well < 30
    assert "cannot be written" in told[-1][1]
    assert found_in(tmp_path / "journals").work.strokes >= well


@needs_permissions
def test_a_folder_of_journals_that_is_read_only_is_told_and_written_once_it_is_not(tmp_path: Path) -> None:
    (tmp_path / "journals").mkdir(mode=0o555)
    code = """
from pathlib import Path
from work.test_recovery import Desk, recovery, small_project, until
recovery.AGAIN = 0.05
root = Path("journals").resolve()
desk = Desk(root, small_project(Path.cwd()))
desk.push(2)
desk.write()
print(desk.journal.trouble)
print(recovery.find(root))
root.chmod(0o755)
until(lambda: desk.journal.trouble is None)
root.chmod(0o111)
print(recovery.find(root))
root.chmod(0o755)
desk.die()
"""
    done = as_a_user(code, tmp_path)
    assert done.stderr == ""
    root = tmp_path / "journals"
    assert done.stdout.splitlines() == [
        f"If fluidwarp crashes, what is not saved is lost: the journal in {root} cannot be written (no permission; "
        "change its permissions).",
        "([], [])",
        f"([], ['The journal of unsaved work in {root} cannot be read (Permission denied); it is left there.'])",
    ]
    assert found_in(root).work.strokes == 2


# In the window -------------------------------------------------------------------------------------------------------


@pytest.fixture
def root(tmp_path: Path) -> Path:
    return tmp_path / "journals"


class Starter:
    """Starts editors, one at a time: imgui has room for one."""

    def __init__(self, device: Device, root: Path) -> None:
        self.device, self.root = device, root
        self._robot: Robot | None = None

    def start(self, folder: Path) -> Robot:
        """An editor with the pattern in a folder; the one before it, if it is still there, is killed."""
        self.kill()
        self._robot = Robot(self.device, small_project(folder), (720, 540), journals=self.root)
        self._robot.until(lambda: not self.robot.editor.recovery.is_busy)
        return self._robot

    @property
    def robot(self) -> Robot:
        assert self._robot is not None
        return self._robot

    def kill(self) -> None:
        """End it as a kill would, with everything written that had to be."""
        if self._robot is not None:
            self._robot.close()
            self._robot = None


@pytest.fixture
def starter(device: Device, root: Path) -> Iterator[Starter]:
    starter = Starter(device, root)
    yield starter
    starter.kill()


@pytest.fixture
def before(starter: Starter, tmp_path: Path) -> Project:
    """Work of two strokes whose editor was killed, as it was."""
    robot = starter.start(tmp_path)
    robot.drag((0.4, 0.5), (0.55, 0.5))
    robot.rest()
    robot.drag((0.5, 0.3), (0.5, 0.45))
    robot.rest()
    project = replace(robot.editor.session.project, recipe=robot.editor.session.document.recipe)
    starter.kill()
    return project


def offer_of(robot: Robot) -> Offer:
    (dialog,) = robot.editor.dialogs.shown
    assert isinstance(dialog, Offer)
    return dialog


def answer(robot: Robot, choice: str) -> None:
    """Click one of the buttons of the only row, or the one below."""
    robot.until(lambda: not robot.editor.clock.settling)  # a dialog takes some frames to become as high as it is
    rect = offer_of(robot).rect
    x = {"Discard": rect.right - 180, "Restore": rect.right - 72, "Later": rect.right - 72}[choice]
    y = rect.bottom - 36 if choice == "Later" else rect.y + 118
    robot.click(x, y)
    robot.until(lambda: not robot.editor.files.is_loading)


def test_what_is_offered_is_told_beside_its_buttons_also_in_a_small_window(
    starter: Starter, before: Project, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert before.recipe.stroke
    robot = starter.start(tmp_path)
    widgets, told = Widgets(robot, monkeypatch), dict[str, float]()

    def dim(ui: Ui, words: str, *more: float) -> None:
        plain(ui, words, *more)
        told[words] = imgui.get_item_rect_max().x

    plain = Ui.dim
    monkeypatch.setattr(Ui, "dim", dim)
    sizes = list[tuple[float, float]]()
    for scale in (1.0, 2.0):
        robot.scale, robot.size = scale, (round(400 * scale), round(260 * scale))
        robot.frame(count=4)
        sizes.append((offer_of(robot).rect.width, offer_of(robot).rect.height))
    assert np.multiply(sizes[0], 2) == pytest.approx(sizes[1], abs=1.0)  # the room around it too
    assert told
    assert max(told.values()) <= min(widgets.at["Discard"].x, widgets.at["Restore"].x)


def test_restored_work_is_as_it_was_and_unsaved(
    device: Device, starter: Starter, before: Project, tmp_path: Path
) -> None:
    robot = starter.start(tmp_path)
    answer(robot, "Restore")
    robot.rest()
    session = robot.editor.session
    assert robot.editor.dialogs.shown == []
    assert session.document.recipe == before.recipe
    assert repr(session.document.recipe) == repr(before.recipe)
    assert robot.editor.title == "pattern * - fluidwarp"
    assert [entry.name for entry in session.document.history.entries] == ["Open", "Push", "Push"]
    seen = robot.warp()
    again = Session(device, before)
    again.settle()
    assert np.array_equal(seen, again.replay.warp.read())
    again.release_gpu()
    robot.key("ctrl+z")
    robot.key("ctrl+z")
    robot.rest()
    assert not session.document.is_dirty
    assert np.abs(robot.warp()).max() == 0
    robot.key("ctrl+y")
    robot.key("ctrl+y")
    robot.rest()
    assert np.array_equal(robot.warp(), seen)
    # It goes on, and outlasts another kill.
    robot.drag((0.2, 0.2), (0.3, 0.2))
    robot.until(lambda: not robot.editor.recovery.is_busy)
    starter.kill()
    assert found_in(starter.root).work.strokes == 3


@pytest.mark.usefixtures("before")
def test_of_several_works_the_one_whose_button_is_pressed_is_restored(
    starter: Starter, tmp_path: Path, root: Path
) -> None:
    robot = starter.start(tmp_path)
    answer(robot, "Later")
    robot.drag((0.3, 0.4), (0.45, 0.4))
    robot.rest()
    robot = starter.start(tmp_path)
    answer(robot, "Later")
    found, _ = find(root)
    assert len(found) == 2  # nobody holds any of them
    for each in found:
        each.leave()
    robot = starter.start(tmp_path)
    answer(robot, "Restore")  # the first row: the newest
    assert robot.editor.dialogs.shown == []
    assert len(robot.editor.session.document.recipe.stroke) == 1


@pytest.mark.parametrize("is_automatic", [True, False])
def test_restored_work_has_the_choice_of_its_grid(starter: Starter, tmp_path: Path, is_automatic: bool) -> None:
    robot = starter.start(tmp_path)
    robot.editor.session.is_grid_automatic = is_automatic
    robot.drag((0.3, 0.4), (0.45, 0.4))
    robot.rest()
    starter.kill()
    robot = starter.start(tmp_path)
    answer(robot, "Restore")
    assert robot.editor.session.is_grid_automatic is is_automatic


@pytest.mark.usefixtures("before")
def test_work_that_is_put_off_is_offered_again_until_it_is_discarded(
    starter: Starter, tmp_path: Path, root: Path
) -> None:
    robot = starter.start(tmp_path)
    assert find(root) == ([], [])  # another fluidwarp that starts now asks nothing
    answer(robot, "Later")
    assert robot.editor.dialogs.shown == []
    robot = starter.start(tmp_path)
    robot.key("escape")
    robot.frame()
    assert robot.editor.dialogs.shown == []
    robot = starter.start(tmp_path)
    answer(robot, "Discard")
    assert offer_of(robot)  # is still there, and asks once more
    answer(robot, "Discard")
    assert offer_of(robot)  # a double click is no answer to that
    assert files_in(root) != []
    robot.frame(dt=1.0)
    answer(robot, "Discard")
    robot.frame()
    assert robot.editor.dialogs.shown == []
    starter.kill()
    assert files_in(root) == []


def test_who_leaves_or_saves_is_offered_nothing(starter: Starter, tmp_path: Path, root: Path) -> None:
    robot = starter.start(tmp_path)
    robot.drag((0.4, 0.5), (0.55, 0.5))
    robot.rest()
    robot.until(lambda: not robot.editor.recovery.is_busy)
    assert files_in(root) != []
    assert robot.editor.files.save_as(tmp_path / "work.fluidwarp")
    robot.frame()
    robot.until(lambda: not robot.editor.recovery.is_busy)
    assert files_in(root) == []
    robot.drag((0.4, 0.5), (0.55, 0.5))
    robot.editor.commands.closed = True  # as after "Don't save"
    starter.kill()
    assert files_in(root) == []


def test_who_leaves_waits_until_the_journal_of_what_was_closed_before_is_gone(
    starter: Starter, tmp_path: Path, root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    discard = recovery.LockedFolder.discard
    monkeypatch.setattr(recovery.LockedFolder, "discard", lambda held: (time.sleep(0.3), discard(held)))
    robot = starter.start(tmp_path)
    robot.drag((0.4, 0.5), (0.55, 0.5))
    robot.rest()
    robot.until(lambda: not robot.editor.recovery.is_busy)
    assert files_in(root) != []
    robot.editor.journals.close(robot.editor.session)
    starter.kill()
    assert files_in(root) == []


@pytest.mark.parametrize("comes_back", [False, True])
def test_what_was_not_to_be_saved_is_offered_only_to_who_came_back_to_it(
    starter: Starter, tmp_path: Path, root: Path, comes_back: bool
) -> None:
    write_picture(tmp_path / "other.png", pattern(100, 60))
    robot = starter.start(tmp_path)
    robot.drag((0.4, 0.5), (0.55, 0.5))
    robot.rest()
    robot.until(lambda: not robot.editor.recovery.is_busy)
    assert files_in(root) != []
    robot.drop(tmp_path / "other.png")
    robot.frame(count=2)
    asked = robot.editor.dialogs.shown[-1]
    robot.click(asked.rect.x + 60, asked.rect.bottom - 36)  # Don't save
    assert robot.editor.canvas.size == (100, 60)
    if comes_back:
        robot.key("ctrl+z")
        robot.frame(count=2)
        assert robot.editor.canvas.size != (100, 60)
    robot.until(lambda: not robot.editor.recovery.is_busy)
    starter.kill()
    assert bool(files_in(root)) == comes_back
    if comes_back:
        assert found_in(root).work.strokes == 1


@pytest.mark.usefixtures("before")
@pytest.mark.parametrize("way", ["leaves", "gives up", "opens another"])
def test_what_was_not_restored_yet_is_offered_again(
    starter: Starter, tmp_path: Path, root: Path, monkeypatch: pytest.MonkeyPatch, way: str
) -> None:
    """To who has left, or wanted something else, before its picture had been read."""
    goes_on, has_ended, load = threading.Event(), threading.Event(), Found.load

    def later(found: Found) -> Project:
        goes_on.wait(60)
        try:
            return load(found)
        finally:
            has_ended.set()

    monkeypatch.setattr(Found, "load", later)
    robot = starter.start(tmp_path)
    (offered,) = robot.editor.recovery.offered
    robot.editor.recovery.restore(offered)
    assert robot.editor.files.is_loading
    assert find(root) == ([], [])
    if way == "leaves":
        starter.kill()
    elif way == "gives up":
        robot.editor.files.give_up_loading()
    else:
        robot.editor.files.open(tmp_path / "pattern.png")
    assert found_in(root).work.strokes == 2
    goes_on.set()
    assert has_ended.wait(60)  # or it would still read the picture when no file may be open


@pytest.mark.usefixtures("before")
def test_a_picture_that_is_gone_is_told_in_the_window(starter: Starter, tmp_path: Path, root: Path) -> None:
    away = tmp_path / "away"
    away.mkdir()
    robot = starter.start(away)
    (tmp_path / "pattern.png").rename(tmp_path / "moved.png")
    answer(robot, "Restore")
    robot.until(lambda: bool(robot.editor.messages.shown))
    (message,) = robot.editor.messages.shown
    assert f"There is no {tmp_path / 'pattern.png'} any more" in message.text
    assert robot.editor.session.project.folder == away
    assert found_in(root).work.strokes == 2


@pytest.mark.usefixtures("before")
def test_another_picture_of_the_same_name_is_told_in_the_window(starter: Starter, tmp_path: Path) -> None:
    away = tmp_path / "away"
    away.mkdir()
    robot = starter.start(away)
    write_picture(tmp_path / "pattern.png", Picture(np.zeros((180, 240, 3), np.uint8)))
    answer(robot, "Restore")
    (message,) = robot.editor.messages.shown
    assert message.text.startswith(
        "All strokes are restored, but pattern.png is not the picture that they were made on"
    )


def test_trouble_with_the_journal_is_told_once_and_painting_goes_on(
    starter: Starter, tmp_path: Path, root: Path
) -> None:
    root.write_text("a file is in the way")
    robot = starter.start(tmp_path)
    for number in range(3):
        robot.drag((0.4, 0.3 + 0.1 * number), (0.5, 0.3 + 0.1 * number))
        robot.until(lambda: not robot.editor.recovery.is_busy)
        if number == 0:
            (message,) = robot.editor.messages.shown
            assert "cannot be written" in message.text
            robot.editor.messages.shown.clear()
    assert robot.editor.messages.shown == []
    assert len(robot.editor.session.recipe.stroke) == 3


# Kills ---------------------------------------------------------------------------------------------------------------


def test_a_kill_at_any_moment_loses_no_stroke(device: Device, starter: Starter, tmp_path: Path) -> None:
    """Of an editor that paints; `python tests/killing.py` does it a hundred times, and in the real window."""
    dice = random.Random(os.getpid())
    compared = 0
    for rests in (False, True):
        painter = Painter.without_window(tmp_path, starter.root, dice.randrange(1000))
        if rests:
            painter.paint_until_rest()
        painter.paint_for(dice.uniform(0, 1))
        outcome = painter.kill()
        assert outcome.is_exact, outcome
        assert outcome.lost == 0, outcome
        # What the killed editor showed when it had come to rest is seen again, to the byte.
        robot = starter.start(tmp_path)
        answer(robot, "Restore")
        session = robot.editor.session
        entries = session.document.history.entries
        shown = [n for n, entry in enumerate(entries) if digest_of(entry.recipe) in painter.shown]
        for number in shown[-1:]:
            session.go_to(number)
            robot.rest()
            assert digest_of_warp(robot.warp()) == painter.shown[digest_of(entries[number].recipe)]
            compared += 1
        robot.editor.commands.closed = True
        starter.kill()
        assert files_in(starter.root) == []
    assert compared


def test_two_editors_at_once_do_not_get_in_each_others_way(tmp_path: Path) -> None:
    root = tmp_path / "journals"
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    one, other = (Painter.without_window(tmp_path / name, root, 1) for name in "ab")
    for painter in (one, other):
        painter.paint_for(0.5)
    outcome = one.kill()
    # Nothing is found but what belongs to nobody any more.
    assert outcome.is_exact, outcome
    found = found_in(root)
    assert found.file == tmp_path / "a" / "pattern.png"
    found.discard()
    outcome = other.kill()
    assert outcome.is_exact, outcome
    assert found_in(root).file == tmp_path / "b" / "pattern.png"

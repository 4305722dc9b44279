"""Unsaved work outlasts a crash: each work that is open has a journal on the disk, and the next start finds it.

A journal is a folder of its own in the user's state folder, with a lock that dies with the process that writes it: what
can be locked belongs to nobody that lives.

Long, as a writer and a finder must agree on every file of such a folder, and on who may remove it.
"""

from __future__ import annotations

import errno
import os
import shutil
import stat
import tempfile
import threading
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from app.errors import UserError
from app.media.files import MENDS, sync, temporary_file
from app.media.project import Project
from app.model.document import Document
from app.model.undo import DEFAULT_BUDGET
from app.work.journal import Damaged, Newer, Origin, Work, beginning, continuation, picture_file, project_of, read
from app.work.locks import NO_LINK, Lock

JOURNAL = "work.journal"
NEW = f"{JOURNAL}.new"  # until it is whole
LOCK = "lock"
SLACK = 4 * 2**20  # bytes that a journal may grow before it is begun anew; and as many again as it began with
HANDING = 0.1  # seconds that a frame in which a stroke ends may wait for the journal: mostly it is less than one tick
MOST = DEFAULT_BUDGET  # bytes of a journal: a history takes more in memory than its text takes here
PAUSE = 0.25  # seconds in which the records of a fluid that comes to rest are put together; a stroke waits for nothing
AGAIN = 5.0  # seconds after which what could not be written is tried again
LEAVING = 5.0  # seconds that the disk may take when the program ends
PLAIN = NO_LINK | getattr(os, "O_BINARY", 0)  # Windows writes other line ends without it


class Large(Exception):
    """A journal has more than `MOST` bytes."""


def default_folder() -> Path:
    """Where journals are kept."""
    from platformdirs import user_state_path

    return user_state_path("fluidwarp") / "journals"


@dataclass
class LockedFolder:
    """The folder of a journal, locked by this process."""

    folder: Path
    lock: Lock

    @classmethod
    def new(cls, root: Path) -> LockedFolder:
        """A folder of a new name in `root`.

        Raises:
            OSError: if it cannot be made.
        """
        root.mkdir(parents=True, exist_ok=True, mode=0o700)
        while True:
            folder = Path(tempfile.mkdtemp(prefix="", dir=root))
            try:
                lock = Lock.take(folder / LOCK)
            except OSError:  # of a disk without locks; with every edit it is tried again
                shutil.rmtree(folder, ignore_errors=True)
                raise
            # None: one who looks for journals has it in hand, and will remove it.
            if lock is not None:
                return cls(folder, lock)

    def discard(self) -> None:
        """Remove it; what is left of it if that fails half-way is no journal any more."""
        # The lock goes while it is held: whoever takes one from then on has made it anew, and keeps it.
        for name in (JOURNAL, NEW, LOCK):
            with suppress(OSError):
                (self.folder / name).unlink()
        self.lock.release()
        if os.name == "nt":  # where what is open cannot be removed
            with suppress(OSError):
                (self.folder / LOCK).unlink()
        # What anybody else has put there stays there.
        with suppress(OSError):
            self.folder.rmdir()


# -- writing ----------------------------------------------------------------------------------------------------------


class Journal:
    """Writes down what becomes of one work, in a thread of its own.

    A stroke is handed to the system at once, after which no kill takes it back, and then written through to the disk,
    which nobody waits for. There is none on the disk as long as nothing would be lost.

    Args:
        root: the folder of all journals.
        held: the journal that the work was restored from, which this one takes the place of.

    Attributes:
        trouble: why nothing can be written, as a sentence, as long as that is so; for the window to take.
    """

    def __init__(self, root: Path, held: LockedFolder | None = None) -> None:
        self.trouble: str | None = None
        self._root = root
        self._held = held
        self._seen: tuple[object, ...] = ()
        self._wanted: tuple[Project, Work] | None = None
        self._written: tuple[Project, Work] | None = None  # is what the file holds
        self._tried: tuple[Project, Work] | None = None
        self._leaving = False
        self._changed, self._urgent, self._handed = threading.Event(), threading.Event(), threading.Event()
        self._asking = threading.Lock()  # what is wanted, how urgently, and whether it is handed over go together
        self._thread: threading.Thread | None = None
        self._file: int | None = None
        self._size = self._most = 0

    def keep(self, project: Project, document: Document, is_grid_automatic: bool = False) -> None:
        """Take note of what the work is now; costs next to nothing where it is as it was."""
        history, saved = document.history, document.saved_recipe
        before, self._seen = self._seen, (project, history.recipe, history.index, saved, is_grid_automatic)
        if before and all(a is b for a, b in zip(before, self._seen, strict=True)):
            return
        work = Work(history.entries, history.index, saved, is_grid_automatic)
        is_just_saved = bool(before) and before[0] is not project
        if is_just_saved or not work.is_unsaved:
            work = None
        is_amended = work is not None and self._wanted is not None and work.edits == self._wanted[1].edits
        if work is None and self._wanted is None and self._held is None:
            return
        with self._asking:
            self._handed.clear()
            self._wanted = work and (project, work)
        self._wake(urgent=not is_amended)
        if work is not None and not is_amended:
            self._handed.wait(HANDING)

    @property
    def is_behind(self) -> bool:
        """True while something has still to be written, and that has not failed yet."""
        return self._wanted is not self._tried

    def end(self, discard: bool) -> None:
        """Write what has still to be written, and leave the journal where it is; or, `discard`, remove it."""
        self._seen = ()  # of work that is closed, nothing stays in memory
        if self._thread is None and not (discard and self._held):
            # Nothing has been heard of the work; if it was restored, it is still in the journal.
            if self._held is not None:
                self._held.lock.release()
            return
        if discard:
            self._wanted = None
        self._leaving = True
        self._wake(urgent=True)

    def join(self) -> None:
        """Wait until that has been done."""
        if self._thread is not None:
            self._thread.join(LEAVING)

    def _wake(self, urgent: bool) -> None:
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name="journal", daemon=True)
            self._thread.start()
        with self._asking:
            if urgent:
                self._urgent.set()
            self._changed.set()

    # In the thread.

    def _work(self) -> None:
        leaving, again = False, None
        while not leaving:
            self._changed.wait(again)
            self._urgent.wait(PAUSE)
            with self._asking:  # what is asked for from here on wakes it again, and is not cleared away unheard
                urgent = self._urgent.is_set()
                self._changed.clear()
                self._urgent.clear()
                leaving, wanted = self._leaving, self._wanted
            try:
                if wanted is None:
                    self._forget()
                elif wanted is not self._written:
                    self._write(*wanted)
                with self._asking:
                    if wanted is self._wanted:
                        self._handed.set()
                if self._file is not None and urgent:
                    os.fsync(self._file)
                self._written, self.trouble, again = wanted, None, None
            except Exception as error:
                # What is in the file now is not known: with the next edit, or soon, all of it is written anew.
                self._close_file()
                self._written, again = None, AGAIN if isinstance(error, OSError) else None
                self.trouble = _trouble(error, self._root)
                self._handed.set()
            self._tried = wanted
        self._close_file()
        if self._held is not None:
            self._held.lock.release()

    def _write(self, project: Project, work: Work) -> None:
        if self._file is not None and self._written is not None and self._is_there:
            before = self._written[1]
            if self._written[0] is project and before.saved is work.saved:
                line = continuation(work, before)
                if self._size + len(line) <= self._most:
                    _write_all(self._file, line)
                    self._size += len(line)
                    return
        self._begin(project, work)

    @property
    def _is_there(self) -> bool:
        """The file that is open still has its name: in one that was taken away nobody finds anything."""
        if self._file is None or self._held is None:
            return False
        try:
            return os.path.samestat(os.fstat(self._file), os.stat(self._held.folder / JOURNAL))
        except OSError:
            return False

    def _begin(self, project: Project, work: Work) -> None:
        """Write all of it into a new file, which takes the place of the one that is there."""
        self._close_file()
        if self._held is not None and not self._held.folder.is_dir():
            self._held.lock.release()
            self._held = None
        if self._held is None:
            self._held = LockedFolder.new(self._root)
        folder = self._held.folder
        path, temporary = folder / JOURNAL, folder / NEW
        with temporary_file(temporary):
            file = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | PLAIN, 0o600)
            try:
                for line in beginning(Origin.of(project), work):
                    _write_all(file, line)
                    if os.fstat(file).st_size > MOST:
                        raise Large
                self._size = os.fstat(file).st_size
                if path.exists():
                    os.fsync(file)  # or a power cut could leave neither of them
            finally:
                os.close(file)
            os.replace(temporary, path)
        self._file = os.open(path, os.O_WRONLY | os.O_APPEND | PLAIN)
        self._most = min(2 * self._size + SLACK, MOST)
        for changed in (folder, self._root):
            sync(changed)

    def _forget(self) -> None:
        self._close_file()
        if self._held is not None:
            self._held.discard()
            self._held = None

    def _close_file(self) -> None:
        if self._file is not None:
            os.close(self._file)
            self._file = None


def _write_all(file: int, data: bytes) -> None:
    left = memoryview(data)
    while left:
        left = left[os.write(file, left) :]


def _trouble(error: Exception, root: Path) -> str:
    reason = (MENDS.get(error.errno or 0) if isinstance(error, OSError) else None) or str(error)
    if isinstance(error, Large):
        reason = f"with all its history it has more than {MOST >> 20} MB; save the work, and open it again"
    # Nobody chooses this folder or its names.
    reason = reason.removesuffix(" or choose another folder").removesuffix("; choose another folder")
    reason = reason.replace("choose another folder or ", "")
    return f"If fluidwarp crashes, what is not saved is lost: the journal in {root} cannot be written ({reason})."


# -- finding ----------------------------------------------------------------------------------------------------------


@dataclass
class Found:
    """Work that was not saved when its fluidwarp ended; nobody else is offered it as long as this one is held.

    Attributes:
        origin: where its pictures are.
        work: all of it.
        when: the last edit was made.
    """

    held: LockedFolder
    origin: Origin
    work: Work
    when: datetime

    @property
    def file(self) -> Path:
        """What the person opened: the project's file, or the picture's."""
        return Path(self.origin.path) if self.origin.path else picture_file(self.origin, self.work.recipe)

    def load(self) -> Project:
        """The project that was worked on, with its picture read again.

        Raises:
            UserError: if the picture is gone, or cannot be read, or the work is none that can be done.
        """
        try:
            self.work.recipe.edited(picture=None).checked(f"“{self.origin.name}”")
        except UserError as error:
            raise UserError(f"{error}. The work is left as it is, in {self.held.folder}.") from None
        file = picture_file(self.origin, self.work.recipe)
        try:
            return project_of(self.origin, self.work.recipe)
        except (UserError, OSError) as error:
            said = error.in_window if isinstance(error, UserError) else str(error)
            why = said.removesuffix(".") if os.path.exists(file) else f"There is no {file} any more"
            kept = f"The work on “{self.origin.name}” is kept; put the file back, and the next start offers it again."
            raise UserError(f"{why}. {kept}") from None

    def is_as_it_was(self, project: Project) -> bool:
        """True if the picture is the one that was worked on, to the byte."""
        return self.origin.is_of(project.data)

    def leave(self) -> None:
        """Keep it for another start, or for another fluidwarp."""
        self.held.lock.release()

    def discard(self) -> None:
        """Remove it."""
        self.held.discard()


def find(root: Path) -> tuple[list[Found], list[str]]:
    """What was not saved and belongs to no fluidwarp that runs, the newest first; and sentences about what is left."""
    found, notices = [], []
    try:
        folders = sorted(path for path in root.iterdir() if path.is_dir() or path.is_symlink())
    except (FileNotFoundError, NotADirectoryError):
        return [], []
    except OSError as error:
        return [], [_unread(root, error)]
    for folder in folders:
        if folder.is_symlink():  # to what may be anybody's
            notices.append(_unread(folder, OSError(errno.ELOOP, "")))
            continue
        try:
            lock = Lock.take(folder / LOCK)
        except OSError as error:
            if os.path.lexists(folder / JOURNAL):
                notices.append(_unread(folder, error))
            continue
        if lock is None:
            continue
        held = LockedFolder(folder, lock)
        try:
            one = _look_into(held)
        except Damaged:
            notices.append(f"The journal of unsaved work in {folder} is damaged and cannot be read; it is left there.")
        except Large:
            more = f"has more than {MOST >> 20} MB, the most that one may have"
            notices.append(f"The journal of unsaved work in {folder} {more}; it is left there.")
        except Newer:
            notices.append(f"There is unsaved work of a newer fluidwarp, which alone can restore it: {folder}.")
        except OSError as error:
            notices.append(_unread(folder, error))
        else:
            if one is None:
                held.discard()
            else:
                found.append(one)
                if one.work.is_cut:
                    cut = f"A part of the unsaved work on “{one.origin.name}” is damaged"
                    notices.append(f"{cut}; what came before it can be restored, and what came after it cannot.")
                continue
        lock.release()
    return sorted(found, key=lambda one: one.when, reverse=True), notices


def _unread(folder: Path, error: OSError) -> str:
    why = "it is a link, or something in it is" if error.errno == errno.ELOOP else error.strerror
    return f"The journal of unsaved work in {folder} cannot be read ({why}); it is left there."


def _look_into(held: LockedFolder) -> Found | None:
    """What is in a folder; None where nothing would be lost with it."""
    path = held.folder / JOURNAL
    if not os.path.lexists(path):
        return None
    status = path.lstat()
    if stat.S_ISLNK(status.st_mode):
        raise OSError(errno.ELOOP, "")
    if not stat.S_ISREG(status.st_mode):  # a folder, or a pipe, for which one would wait for ever
        raise Damaged
    if status.st_size > MOST:
        raise Large
    with path.open("rb") as stream:
        origin, work = read(stream.read(MOST))
    if work.is_cut and not work.is_unsaved:  # what is unsaved comes after what is damaged
        raise Damaged
    try:
        when = datetime.fromtimestamp(path.stat().st_mtime)
    except (ValueError, OverflowError):  # the clock, or the disk, is wrong by thousands of years
        when = datetime.max
    return Found(held, origin, work, when) if work.is_unsaved else None

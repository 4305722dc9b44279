"""Writing a file whole or not at all, and never over what is still needed."""

from __future__ import annotations

import errno
import os
import shutil
import stat
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from itertools import product
from pathlib import Path

from app.errors import About, UserError
from app.media.inputs import no_name, state_of
from app.media.leftovers import sweep, temporary_name
from app.media.numbered import is_sequence, number_in, numbered, stands_for_files
from app.progress import if_abandoned

MENDS = {
    errno.ENOENT: "its folder is gone; make it again or choose another",
    errno.ENOSPC: "the disk is full; free some space or choose another folder",
    errno.EDQUOT: "your disk quota is used up; free some space or choose another folder",
    errno.EACCES: "no permission; choose another folder or change its permissions",
    errno.EPERM: "no permission; choose another folder or change its permissions",
    errno.EROFS: "the disk is read-only; choose another folder",
    errno.ENAMETOOLONG: "the name is too long; choose a shorter one",
    errno.ELOOP: "it is a link; remove it, or choose another folder",
    errno.EEXIST: "a file of this name is in the way; choose another folder",
    errno.ENOTDIR: "a part of its path is a file; choose another folder",
    errno.EFBIG: "the file grows larger than this disk allows; choose another folder or a smaller size",
}


@contextmanager
def temporary_file(path: Path) -> Iterator[Path]:
    """Yield `path`, which is gone when the block ends, unless it has been moved elsewhere.

    It goes also from a folder that has another name by then, where the system lets a folder be held.
    """
    with ExitStack() as stack:
        remove: Callable[[], None] = partial(path.unlink, missing_ok=True)
        with suppress(OSError):  # there is no folder, as will be told when the file is made
            if os.unlink in os.supports_dir_fd:
                # what is only held, as Linux has it, need not be readable
                folder = os.open(path.parent, getattr(os, "O_PATH", os.O_RDONLY) | os.O_DIRECTORY)
                stack.callback(os.close, folder)
                remove = partial(_remove_from, folder, path.name)
        stack.enter_context(if_abandoned(remove))
        try:
            yield path
        finally:
            remove()


def _remove_from(folder: int, name: str) -> None:
    with suppress(FileNotFoundError):
        os.unlink(name, dir_fd=folder)


def temporary_beside(path: Path) -> Path:
    """A hidden name nobody uses in the folder of `path`, with the same ending."""
    return path.with_name(temporary_name(path.stem, path.suffix))


def name_from(folder: Path, file: Path) -> str:
    """A file as a recipe in a folder names it: by the way there, with slashes; from another drive by its whole path."""
    try:
        return Path(os.path.relpath(file, folder)).as_posix()
    except ValueError:  # another drive
        return Path(os.path.abspath(file)).as_posix()


def in_text(name: str) -> str:
    """A file's name, for a recipe, whose text is UTF-8. Raises `UserError` if the name is not."""
    try:
        name.encode()
    except UnicodeEncodeError:
        raise UserError(f"Cannot refer to {name}: its name is not UTF-8; rename it.") from None
    return name


def writable(path: str | os.PathLike[str]) -> Path:
    """The real path behind `path`, known to be a file or free, in a folder that is there.

    Call it before a long job, so that a slip in the name costs no time. Raises `UserError`.
    """
    target = Path(os.path.realpath(path))  # through a link: the link stays, the file behind it is replaced
    try:
        if target.is_dir():
            raise UserError(f"Cannot write {path}: it is a folder; give the name of a file in it.")
        if os.path.exists(path) and not os.path.isfile(path):  # a pipe's real path is no file's name
            raise UserError(f"Cannot write {path}: it is not an ordinary file; give another name.")
        if any(folder.is_file() for folder in target.parents):
            raise cannot_write(path, OSError(errno.ENOTDIR, ""))
        if not target.parent.is_dir():
            raise UserError(f"Cannot write {path}: there is no folder {target.parent}; make it first.")
        if target.exists() and (number := _forbidden(target, os.W_OK)):  # it would be replaced all the same
            if number == errno.EROFS:
                raise cannot_write(path, OSError(number, ""))
            raise UserError(
                f"Cannot write {path}: that file is read-only; change its permissions or give another name."
            )
    except OSError as error:  # a name that is too long, a folder that cannot be looked into
        raise cannot_write(path, error) from None
    if number := _forbidden(target.parent):
        raise cannot_write(path, OSError(number, ""))
    return target


def _forbidden(path: Path, mode: int = os.W_OK | os.X_OK) -> int:
    """The number of the system's error if what is there, as a rule a folder, may not be written to; else 0.

    `os.access` does not say whether it is permissions or a disk that is read-only, whoever asks.
    """
    if os.access(path, mode):
        return 0
    with suppress(AttributeError, OSError):  # Windows has no statvfs
        if os.statvfs(path).f_flag & os.ST_RDONLY:
            return errno.EROFS
    return errno.EACCES


def make_folder(path: Path) -> None:
    """Make a folder, if there is none. Raises `UserError`."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise cannot_write(path, error) from None


@contextmanager
def no_empty_folder(path: Path | None) -> Iterator[None]:
    """When the block ends, a folder that was not there before it, or a part of the way there, goes if it is empty."""
    new = [] if path is None else [folder for folder in (path, *path.parents) if not os.path.exists(folder)]

    def remove() -> None:
        with suppress(OSError):  # as of one that is not empty
            for folder in new:
                folder.rmdir()

    with if_abandoned(remove):
        try:
            yield
        finally:
            remove()


def check_folder(path: Path) -> None:
    """Raise `UserError` if a folder cannot be made, or written to, as far as that can be told before."""
    try:
        there = next(folder for folder in (path, *path.absolute().parents) if folder.exists())
    except OSError as error:
        raise cannot_write(path, error) from None
    number = errno.ENOTDIR if not there.is_dir() else _forbidden(there)
    if number:
        raise cannot_write(path, OSError(number, os.strerror(number)))


def takes_place(output: str | os.PathLike[str], source: str | os.PathLike[str]) -> bool:
    """Whether writing `output` can replace `source`; both are real paths of a file or of a sequence."""
    folder, name = os.path.split(source)
    if not _is_one(os.path.dirname(output), folder):
        return False
    pattern = os.path.basename(output)
    if stands_for_files(source):
        # with so many digits two that differ in nothing but their padding are alike
        return number_in(name, pattern) is not None or numbered(name, 10**17) == numbered(pattern, 10**17)
    return _is_one(output, source) or name == pattern or number_in(pattern, name) is not None


def _is_one(path: str | os.PathLike[str], other: str | os.PathLike[str]) -> bool:
    """Whether two real paths are one: also those that differ in capitals, where the disk takes these for the same."""
    path, other = os.fspath(path), os.fspath(other)
    if path == other or path.casefold() != other.casefold():
        return path == other
    try:
        return os.path.samefile(path, other)
    except OSError:  # one of them is not there
        return False


def ignores_capitals(folder: Path) -> bool:
    """Whether names that differ in capitals alone are the same, on the disk of a folder that may have to be made."""
    there = next(parent for parent in (folder.absolute(), *folder.absolute().parents) if os.path.isdir(parent))
    try:
        with tempfile.NamedTemporaryFile(dir=there, prefix=".fluidwarp-") as probe:
            return os.path.exists(there / Path(probe.name).name.upper())
    except OSError:  # nothing can be written there, as will be told
        return False


def check_kept(source: str | os.PathLike[str], output: str | os.PathLike[str]) -> None:
    """Make sure that what is made of `source`, or about it, does not take its place. Raises `UserError`."""
    if any(takes_place(place, kept) for place, kept in product(_real_places(output), _real_places(source))):
        raise UserError(f"{source} would be replaced by its own result; choose another name")


def _real_places(path: str | os.PathLike[str]) -> list[str]:
    """The real path of a file or of a sequence, and those of its files that are links to somewhere else.

    Raises `UserError` if the system knows no such name.
    """
    try:
        places = [os.path.realpath(path)]
    except ValueError as error:
        raise no_name(path, error) from None
    if is_sequence(path):
        with suppress(OSError):
            links = (link for link in os.scandir(Path(path).parent) if link.is_symlink())
            places += [os.path.realpath(link.path) for link in links if number_in(path, link.name) is not None]
    return places


def cannot_write(path: str | os.PathLike[str], error: OSError) -> UserError:
    """What `error` means for the user who wanted `path` written."""
    reason = MENDS.get(error.errno or 0, error.strerror or str(error) or "the system gave no reason")
    if error.errno == errno.ENOENT and Path(path).parent.is_dir():  # as of /proc
        reason = "its folder takes no new files; choose another"
    return UserError(f"Cannot write {path}: {reason}.")


@contextmanager
def telling(written: list[Path]) -> Iterator[None]:
    """Let a `UserError` of the block also say which of several results are `written` by then: they stay."""
    try:
        yield
    except UserError as error:
        if not written:
            raise
        are = f"{' and '.join(path.name for path in written)} {'are' if len(written) > 1 else 'is'} written"
        told, in_window = (f"{said.removesuffix('.')}. {are}." for said in (str(error), error.in_window))
        raise UserError(told, error.status, in_window) from error


def sync(path: Path) -> None:
    """Wait until what is in a file, or which files are in a folder, is on the disk itself: a power cut leaves it."""
    if path.is_dir() and os.name == "nt":
        return  # there a folder cannot be opened, and is written at once
    handle = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@contextmanager
def replacing(
    path: str | os.PathLike[str], backup: Path | None = None, whole: Callable[[Path], None] = lambda file: None
) -> Iterator[Path]:
    """Yield a temporary name beside `path`, which takes the place of `path` once the block has ended well.

    When the block raises, the temporary file goes and `path` is as it was. `OSError` becomes `UserError`.

    backup: where what `path` was is kept, instead of what was kept there; both outlast a power cut then, and at every
    moment there is a whole file under the name `path`.
    whole: is called with the temporary file once it is written, as what is at `path` later may be another's.
    """
    target = writable(path)
    sweep(target.parent)
    try:
        with temporary_file(temporary_beside(target)) as temporary:
            yield temporary
            whole(temporary)
            with suppress(OSError):  # who may read it stays as it was, if it is there and the disk knows of that
                _hand_over(temporary, target.stat())
            if backup is not None:
                sync(temporary)
                if target.exists():
                    _keep(target, backup)
            os.replace(temporary, target)
            if backup is not None:
                sync(target.parent)
    except OSError as error:
        raise cannot_write(path, error) from error
    except UserError:  # of ffmpeg, in words of its own and with a name that nobody knows
        if target.parent.is_dir():
            raise
        raise cannot_write(path, FileNotFoundError(errno.ENOENT, "")) from None


def noticing(path: str | os.PathLike[str], notice: Callable[[str], object]) -> Callable[[Path], None]:
    """Make the `whole` of `replacing` that tells `notice` if another program has written `path` since now."""
    before = state_of(path)

    def look(file: Path) -> None:
        if state_of(path) not in (None, before):
            told = "another program wrote this file while it was being made; what that wrote is replaced"
            notice(About(Path(path).name, f": {told}"))

    return look


def _hand_over(path: Path, status: os.stat_result) -> None:
    """Let a new file be whose the one of this status was, as far as this process may say so, with its permissions.

    Raises `OSError`.
    """
    if hasattr(os, "chown"):  # not on Windows
        try:
            os.chown(path, status.st_uid, status.st_gid)
        except OSError:  # only the superuser gives files away, but anybody to a group of theirs
            with suppress(OSError):
                os.chown(path, -1, status.st_gid)
    os.chmod(path, stat.S_IMODE(status.st_mode) & ~(stat.S_ISUID | stat.S_ISGID))  # of what was in it


def _keep(path: Path, backup: Path) -> None:
    """Let `backup` be what `path` is, which stays."""
    with temporary_file(temporary_beside(backup)) as temporary:
        try:
            os.link(path, temporary)
        except OSError:  # a disk without hard links
            shutil.copy2(path, temporary)
            sync(temporary)
        os.replace(temporary, backup)

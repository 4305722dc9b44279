"""Writing a file whole or not at all."""

from __future__ import annotations

import errno
import os
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from app.errors import UserError
from app.media.leftovers import sweep, temporary_name
from app.progress import appearing, if_abandoned

MENDS = {
    errno.ENOSPC: "the disk is full; free some space or choose another folder",
    errno.EDQUOT: "your disk quota is used up; free some space or choose another folder",
    errno.EACCES: "no permission; choose another folder or change its permissions",
    errno.EPERM: "no permission; choose another folder or change its permissions",
    errno.EROFS: "the disk is read-only; choose another folder",
    errno.ENAMETOOLONG: "the name is too long; choose a shorter one",
    errno.EEXIST: "a file of this name is in the way; choose another folder",
    errno.ENOTDIR: "a part of its path is a file; choose another folder",
    errno.EFBIG: "the file grows larger than this disk allows; choose another folder or a smaller size",
}


NUMBER = re.compile(r"%(0\d+)?d")


@contextmanager
def temporary_file(path: Path) -> Iterator[Path]:
    """Yield `path`, which is gone when the block ends, unless it has been moved elsewhere."""
    remove = partial(path.unlink, missing_ok=True)
    with if_abandoned(remove):
        try:
            yield path
        finally:
            remove()


def temporary_beside(path: Path) -> Path:
    """A hidden name nobody uses in the folder of `path`, with the same ending."""
    return path.with_name(temporary_name(path.stem, path.suffix))


def writable(path: str | os.PathLike[str]) -> Path:
    """The real path behind `path`, known to be a file or free, in a folder that is there.

    Call it before a long job, so that a slip in the name costs no time. Raises `UserError`.
    """
    target = Path(os.path.realpath(path))  # through a link: the link stays, the file behind it is replaced
    try:
        if target.is_dir():
            raise UserError(f"Cannot write {path}: it is a folder; give the name of a file in it.")
        if target.exists() and not target.is_file():
            raise UserError(f"Cannot write {path}: it is no ordinary file; give another name.")
        if not target.parent.is_dir():
            raise UserError(f"Cannot write {path}: there is no folder {target.parent}; make it first.")
    except OSError as error:  # a name that is too long, a folder that cannot be looked into
        raise cannot_write(path, error) from None
    if not os.access(target.parent, os.W_OK | os.X_OK):
        raise UserError(f"Cannot write {path}: {MENDS[errno.EACCES]}.")
    return target


def is_sequence(path: str | os.PathLike[str]) -> bool:
    """Whether `path` numbers its files, as `name.%04d.png` does."""
    return NUMBER.search(Path(path).name) is not None


def number_in(pattern: str | os.PathLike[str], name: str) -> int | None:
    """What stands in a file's name where the sequence `pattern` has its %d; None if it is none of its files."""
    wanted = Path(pattern).name
    found = NUMBER.search(wanted)
    if found is None:
        return None
    match = re.fullmatch(rf"{re.escape(wanted[: found.start()])}(\d+){re.escape(wanted[found.end() :])}", name)
    return int(match[1]) if match else None


def takes_place(output: str | os.PathLike[str], source: str | os.PathLike[str]) -> bool:
    """Whether writing `output`, a file or all the files of a sequence, can replace `source`; both are real paths."""
    folder, name = os.path.split(source)
    if os.path.dirname(output) != folder:
        return False
    pattern = os.path.basename(output)
    number = number_in(pattern, name)
    return name == (pattern if number is None else NUMBER.sub(lambda found: found[0] % number, pattern, count=1))


def check_kept(source: str | os.PathLike[str], output: str | os.PathLike[str]) -> None:
    """Make sure that what is made of `source`, or about it, does not take its place. Raises `UserError`."""
    if takes_place(os.path.realpath(output), os.path.realpath(source)):
        raise UserError(f"{source} would be replaced by its own result; choose another name")


def cannot_write(path: str | os.PathLike[str], error: OSError) -> UserError:
    """What `error` means for the user who wanted `path` written."""
    reason = MENDS.get(error.errno or 0, error.strerror or str(error) or "the system gave no reason")
    return UserError(f"Cannot write {path}: {reason}.")


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
def replacing(path: str | os.PathLike[str], backup: Path | None = None) -> Iterator[Path]:
    """Yield a temporary name beside `path`, which takes the place of `path` once the block has ended well.

    When the block raises, the temporary file goes and `path` is as it was. `OSError` becomes `UserError`.

    backup: where what `path` was is kept, instead of what was kept there; both outlast a power cut then, and at every
    moment there is a whole file under the name `path`.
    """
    target = writable(path)
    sweep(target.parent)
    try:
        with temporary_file(temporary_beside(target)) as temporary:
            yield temporary
            if backup is not None:
                sync(temporary)
                if target.exists():
                    _keep(target, backup)
            os.replace(temporary, target)
            if backup is not None:
                sync(target.parent)
    except OSError as error:
        raise cannot_write(path, error) from error


def _keep(path: Path, backup: Path) -> None:
    """Let `backup` be what `path` is, which stays."""
    with temporary_file(temporary_beside(backup)) as temporary:
        try:
            os.link(path, temporary)
        except OSError:  # a disk without hard links
            shutil.copy2(path, temporary)
            sync(temporary)
        os.replace(temporary, backup)


@contextmanager
def replacing_many(folder: str | os.PathLike[str], label: str) -> Iterator[Path]:
    """Yield a temporary folder in `folder`, whose files move up into `folder` once the block has ended well.

    When the block raises, they all go and `folder` is as it was. `label` names the output in errors.
    """
    target = writable(Path(folder) / label).parent
    sweep(target)
    temporary = temporary_beside(target / "sequence")
    remove = partial(shutil.rmtree, temporary, ignore_errors=True)
    with if_abandoned(remove):
        try:
            temporary.mkdir()
            yield temporary
            with appearing:
                for file in sorted(temporary.iterdir()):
                    os.replace(file, target / file.name)
        except OSError as error:
            raise cannot_write(Path(folder) / label, error) from error
        finally:
            remove()

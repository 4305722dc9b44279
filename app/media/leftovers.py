"""Temporary files that bear their owner's name, so that what a killed process left can be told from what is in use.

A name holds who made it: this host, its start and the processes that are seen from there, and the process with the time
it started. So a number that another process has by now, a machine that shares the folder, and a container that has
other processes of the same numbers are not mistaken for the owner.
"""

from __future__ import annotations

import hashlib
import os
import platform
import re
import secrets
import shutil
import stat
import tempfile
import threading
from contextlib import suppress
from functools import cache
from pathlib import Path

_OWNED = re.compile(
    r"\..*\.fluidwarp-(?P<host>[0-9a-f]{8})-(?P<start>[0-9a-f]{8})-(?P<pid>\d+)-(?P<since>\d+)-[0-9a-f]{8}(\.[^.]*)?",
    re.DOTALL,
)
PROC = Path("/proc")

_swept: set[str] = set()
_sweeping = threading.Lock()


def temporary_name(stem: str, suffix: str = "") -> str:
    """A hidden name that nobody uses, and that this process owns: `.stem.fluidwarp-...suffix`."""
    host, start = _here()
    owner = f"{host}-{start}-{os.getpid()}-{_since(os.getpid()) or 0}"
    # A name has at most 255 bytes, and a character up to 4 of them.
    return f".{stem[:40]}.fluidwarp-{owner}-{secrets.token_hex(4)}{suffix}"


def temporary_folder() -> tempfile.TemporaryDirectory[str]:
    """A folder among the system's temporary files that this process owns, gone with the last reference to it."""
    sweep(Path(tempfile.gettempdir()))
    return tempfile.TemporaryDirectory(prefix=f"{temporary_name('pictures')}.", ignore_cleanup_errors=True)


def sweep(folder: Path) -> None:
    """Remove from a folder what processes of this host that are no more have left; once in a process for each folder.

    Where it is not known which processes there are (without /proc), nothing is removed.
    """
    if _since(os.getpid()) is None:
        return
    key = os.path.realpath(folder)
    with _sweeping:
        if key in _swept:
            return
        _swept.add(key)
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in [entry for entry in entries if _OWNED.fullmatch(entry.name)]:
            with suppress(OSError):
                status = entry.stat(follow_symlinks=False)
                if status.st_uid == os.getuid() and _is_left(entry.name, status.st_mtime):
                    if stat.S_ISDIR(status.st_mode):
                        shutil.rmtree(entry.path)
                    elif stat.S_ISREG(status.st_mode):
                        os.unlink(entry.path)


def _is_left(name: str, changed: float) -> bool:
    """Whether a file of this name, last changed at a time, has no owner any more."""
    owner = _OWNED.fullmatch(name)
    host, start = _here()
    if owner is None or owner["host"] != host:
        return False
    if owner["start"] != start:
        # From before this host was started; or from a container beside this one, or a copy of this host, at work.
        return changed < _started()
    return _since(int(owner["pid"])) != int(owner["since"])


def _since(pid: int) -> int | None:
    """When a process started, in ticks since this host did; None if there is none, or it only waits to be buried."""
    try:
        # After the name in brackets, which may hold anything, comes the state as the third word (proc_pid_stat(5)).
        words = (PROC / str(pid) / "stat").read_bytes().rpartition(b")")[2].split()
        return None if words[0] in (b"Z", b"X") else int(words[19])
    except (OSError, IndexError, ValueError):
        return None


def _started() -> float:
    """When this host was started, in seconds of the epoch; 0 if that is not known."""
    with suppress(OSError):
        if found := re.search(rb"^btime (\d+)$", (PROC / "stat").read_bytes(), re.MULTILINE):
            return float(found[1])
    return 0.0


@cache
def _here() -> tuple[str, str]:
    """This host; and its start, with the processes that are seen from here."""
    start = _text_of(PROC / "sys/kernel/random/boot_id")
    with suppress(OSError):
        start += os.readlink(PROC / "self/ns/pid")
    return _digest(platform.node() + _text_of(Path("/etc/machine-id"))), _digest(start)


def _text_of(path: Path) -> str:
    try:
        return path.read_text("utf-8", "replace")
    except OSError:
        return ""


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:8]

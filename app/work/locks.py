"""Locks that other processes see, and that the system takes away when their process dies, however it dies."""

from __future__ import annotations

import os
import sys
from pathlib import Path

if sys.platform == "win32":
    import msvcrt

    def try_lock(handle: int) -> None:
        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)

else:
    import fcntl

    def try_lock(handle: int) -> None:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)


NO_LINK = getattr(os, "O_NOFOLLOW", 0)  # which Windows does not have


class Lock:
    """A file that is held by this process alone, until it is released or the process ends."""

    def __init__(self, handle: int) -> None:
        self._handle: int | None = handle

    @classmethod
    def take(cls, path: Path) -> Lock | None:
        """Hold the file `path`, made if need be; None where somebody else holds it, or has just removed it.

        Raises:
            OSError: if it cannot be made, is a link, or there are no locks on this disk.
        """
        try:
            # closed in every process that this one starts
            handle = os.open(path, os.O_RDWR | os.O_CREAT | NO_LINK, 0o600)
        except FileNotFoundError:  # with its folder
            return None
        try:
            try_lock(handle)
            held = cls(handle)
            # Who held it before may have removed it meanwhile: then it is no longer what others look at.
            if os.path.samestat(os.fstat(handle), os.stat(path)):
                return held
        except (BlockingIOError, PermissionError, FileNotFoundError):
            pass
        except BaseException:
            os.close(handle)
            raise
        os.close(handle)
        return None

    def release(self) -> None:
        """Let others have it."""
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None

"""A worker of a batch that dies, imported by the worker's own process."""

from __future__ import annotations

import os
import signal
from contextlib import suppress
from pathlib import Path

from app.progress import Progress
from app.work.tasks import Task
from app.work.worker import Outcome, Work


def dying(task: Work, progress: Progress) -> Outcome:
    """A worker's work that kills it: for p0 the first time, for p3 each time. Notes how many others there are then."""
    assert isinstance(task, Task)
    assert task.picture is not None
    mark = task.picture.with_suffix(".tried")
    if mark.exists():
        task.picture.with_suffix(".beside").write_text(str(_others()))
    if task.picture.stem == "p3" or (task.picture.stem == "p0" and not mark.exists()):
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return Outcome(task.label)


def _others() -> int:
    """How many processes besides this one do such work for the same one."""
    found = set[str]()
    for children in Path(f"/proc/{os.getppid()}/task").glob("*/children"):
        for pid in children.read_text().split():
            with suppress(OSError):  # it has ended since
                if b"support.dying" in Path(f"/proc/{pid}/cmdline").read_bytes():
                    found.add(pid)
    return len(found - {str(os.getpid())})

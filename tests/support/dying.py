"""A worker of a batch that dies, imported by the worker's own process."""

from __future__ import annotations

import os
import signal

from app.progress import Progress
from app.work.tasks import Task
from app.work.worker import Outcome, Work


def dying(task: Work, progress: Progress) -> Outcome:
    """A worker's work that kills it: for p0 the first time, for p3 each time."""
    assert isinstance(task, Task)
    assert task.picture is not None
    mark = task.picture.with_suffix(".tried")
    if task.picture.stem == "p3" or (task.picture.stem == "p0" and not mark.exists()):
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return Outcome(task.label)

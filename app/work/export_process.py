"""An export in a process of its own, with a GL of its own: the same replay as the command line's."""

from __future__ import annotations

import queue
import threading

from app.work.jobs import Job
from app.work.worker import Heard, Outcome, Part, Worker


class ExportProcess:
    """A job that is being done elsewhere.

    Attributes:
        job: what is done.
        part: how much of it is done, 0-1.
        state: what is being done beside the work itself, as "writing"; or "".
        is_done: it has ended, well or not.
        error: why it failed, as a sentence; "" if it did not.
        notices: what the person should hear of it, once it has ended well.
    """

    def __init__(self, job: Job) -> None:
        self.job = job
        self.part = 0.0
        self.state = ""
        self.is_done = False
        self.error = ""
        self.notices: tuple[str, ...] = ()
        self._inbox: queue.SimpleQueue[tuple[Worker, Heard]] = queue.SimpleQueue()
        self._worker = Worker(self._inbox)
        # A picture is more than a pipe holds: the window would wait until the other is awake.
        threading.Thread(target=self._worker.begin, args=(job,), daemon=True).start()

    def poll(self) -> None:
        """Hear how far it is."""
        while not self.is_done and not self._inbox.empty():
            match self._inbox.get()[1]:
                case Part(done, state):
                    self.part, self.state = done, state
                case Outcome() as outcome:
                    self.is_done, self.error, self.notices = True, outcome.in_window, outcome.notices
                case None:
                    self.is_done = True
                    self.error = f"The export of {self.job.target.name} stopped unexpectedly; try a smaller size."
        if self.is_done:
            self._worker.end()

    def stop(self) -> None:
        """End it; nothing of it is left."""
        self._worker.end()

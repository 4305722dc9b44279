"""An export or a fit in a process of its own, with a GL of its own: the same replay as the command line's."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable

from app.work.fitting import Fit
from app.work.jobs import Job
from app.work.worker import Outcome, Reply, Status, Warned, Work, Worker


class WorkProcess:
    """A piece of work that is being done elsewhere.

    Args:
        work: what is done.
        died: what is said if its process dies.

    Attributes:
        part: how much of it is done, 0-1.
        state: what is being done beside the work itself, as "writing"; or "".
        is_done: it has ended, well or not.
        error: why it failed, as a sentence; "" if it did not.
        outcome: how it went, once it has ended by itself.
    """

    def __init__(self, work: Work, died: str) -> None:
        self.part = 0.0
        self.state = ""
        self.is_done = False
        self.error = ""
        self.outcome = Outcome("")
        self._died = died
        self._inbox: queue.SimpleQueue[tuple[Worker, Reply]] = queue.SimpleQueue()
        self._worker = Worker(self._inbox)
        # A picture is more than a pipe holds: the window would wait until the other is awake.
        threading.Thread(target=self._worker.begin, args=(work,), daemon=True).start()

    def poll(self, warn: Callable[[str], object] = lambda said: None) -> None:
        """Hear how far it is; `warn` is told what the person may want to stop it for, and no notice says it again."""
        if self.is_done:
            return
        while not self.is_done and not self._inbox.empty():
            match self._inbox.get()[1]:
                case Status(done, state):
                    self.part, self.state = done, state
                case Warned(said):
                    warn(said)
                case Outcome() as outcome:
                    self.is_done, self.error, self.outcome = True, outcome.in_window, outcome
                case None:
                    self.is_done, self.error = True, self._died
        if self.is_done:
            self.stop()

    def stop(self, then: Callable[[], object] = lambda: None) -> None:
        """End it, with nothing of it left, while nobody waits; `then` is called in a thread once it has ended."""

        def end() -> None:
            self._worker.end()
            then()

        # No daemon: whoever leaves has what was half-written taken away.
        threading.Thread(target=end).start()


class ExportProcess(WorkProcess):
    """A job that is being done elsewhere."""

    def __init__(self, job: Job) -> None:
        self.job = job
        super().__init__(job, f"The export of {job.target.name} stopped unexpectedly; try a smaller size.")


class FitProcess(WorkProcess):
    """A fit that is being made elsewhere."""

    def __init__(self, fit: Fit) -> None:
        self.fit = fit
        super().__init__(fit, "The fit stopped unexpectedly, perhaps for want of memory.")

    def finish(self) -> None:
        """Let it end with the best that it has."""
        threading.Thread(target=self._worker.finish, daemon=True).start()

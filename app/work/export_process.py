"""An export in a process of its own, with a GL of its own: the same replay as the command line's."""

from __future__ import annotations

import multiprocessing
import threading
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any

from app.work.export import Job

PATIENCE = 5.0  # seconds that a cancelled export has to clean up after itself


class ExportProcess:
    """A job that is being done elsewhere.

    Attributes:
        job: what is done.
        part: how much of it is done, 0-1.
        state: what is being done beside the work itself, as "writing"; or "".
        is_done: it has ended, well or not.
        error: why it failed, as a sentence; "" if it did not.
        notices: what the person should hear of it, once it has ended well.
        cancelled: it was stopped.
    """

    def __init__(self, job: Job) -> None:
        self.job = job
        self.part = 0.0
        self.state = ""
        self.is_done = False
        self.error = ""
        self.notices: tuple[str, ...] = ()
        self.cancelled = False
        # A forked process would share this one's GL, which no driver survives.
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._wish = context.Event()
        self._process = context.Process(target=_work, args=(theirs, self._wish), daemon=True)
        self._process.start()
        theirs.close()
        # A picture is more than a pipe holds: given at the start it would keep the window waiting until the other is
        # awake, and for ever if it dies before.
        threading.Thread(target=self._hand_over, daemon=True).start()

    def _hand_over(self) -> None:
        with suppress(OSError):  # it has died, as `poll` will find
            self._pipe.send(self.job)

    def poll(self) -> None:
        """Hear how far it is."""
        try:
            while self._pipe.poll():
                kind, value = self._pipe.recv()
                if kind == "part":
                    self.part = value
                elif kind == "state":
                    self.state = value
                else:
                    self.is_done = True
                    self.error = value if kind == "error" else ""
                    self.notices = value if kind == "done" else ()
                    self.cancelled = kind == "cancelled"
        except (EOFError, OSError):
            if not self.is_done:
                self.is_done = True
                self.error = f"The export of {self.job.target.name} stopped unexpectedly; try a smaller size."
        if self.is_done:
            self._process.join(PATIENCE)

    def stop(self) -> None:
        """Cancel it, and wait until it has cleaned up."""
        self._wish.set()
        self._process.join(PATIENCE)
        if self._process.is_alive():
            self._process.terminate()


def _work(pipe: Connection, wish: Any) -> None:
    from app.errors import Cancelled, UserError
    from app.progress import Progress
    from app.work.export import run
    from solver.gl.device import Device

    def report(done: int, total: int | None) -> None:
        pipe.send(("part", done / total if total else 0.0))

    try:
        job = pipe.recv()
    except EOFError:  # nobody is left who wants it
        return
    try:
        with Device.headless() as device:
            told = run(device, job, Progress(None, report, wish.is_set, lambda state: pipe.send(("state", state))))
        pipe.send(("done", told.notices))
    except Cancelled:
        pipe.send(("cancelled", ""))
    except UserError as error:
        pipe.send(("error", error.in_window))
    except Exception as error:
        pipe.send(("error", f"The export failed: {error}"))

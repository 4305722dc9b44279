"""A process that does one piece of work after the other: for many pictures, for a cluster, and for the window."""

from __future__ import annotations

import os
import pickle
import queue
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cache

from app.errors import Cancelled, UserError
from app.model.recipe import Recipe
from app.progress import GRACE, INTERRUPTED, Progress, abandon, deaf_children, interruptible
from app.work.export import run
from app.work.fitting import Fit
from app.work.jobs import Job
from app.work.tasks import Piece
from solver.gl.context import ContextError
from solver.gl.device import Device

SERVING = "from app.work.worker import serve; serve()"
ATTEMPTS = 3  # at a picture whose worker dies: it may have been another's fault
DIED = "its process died each time, perhaps for want of memory; use fewer --jobs or a smaller --size"
LOOK = 0.1  # seconds between two looks at the wish to stop

Work = Piece | Job | Fit


class Finish:
    """What is said to a worker that is to end its piece of work with the best that it has, as only a fit can."""


@dataclass(frozen=True)
class Outcome:
    """How a piece of work went.

    Attributes:
        label: what the user calls it.
        error: why it failed, as a sentence; "" if it went well.
        in_window: the same for someone who gave no command.
        notices: what the user should hear of.
        verdict: which stop condition ended the simulation and when, or how well a fit went; "" if neither.
        recipe: that has been fitted.
        is_met: what was fitted has come where it should; see `Fitted`.
        stopped: it was ended before its budget; likewise.
    """

    label: str
    error: str = ""
    in_window: str = ""
    notices: tuple[str, ...] = ()
    verdict: str = ""
    recipe: Recipe | None = None
    is_met: bool = True
    stopped: bool = False


@dataclass(frozen=True)
class Status:
    """How much of a piece of work is done, 0 to 1, and what is being done beside the work itself, as "writing"."""

    done: float
    state: str


@dataclass(frozen=True)
class Warned:
    """What the user may want to stop a piece of work for, before that takes its time; no outcome says it again."""

    said: str


Reply = Status | Warned | Outcome | None
"""What a worker says; None once it has died."""


@cache
def own_device() -> Device:
    """The one of this process, in whose main thread it is used."""
    return Device.headless()


def perform(work: Work, progress: Progress) -> Outcome:
    """Do it here, on the device that is kept for the next one. Raises nothing but `Cancelled`."""
    label, what = work.label, "The fit" if isinstance(work, Fit) else "The export"
    try:
        if isinstance(work, Fit):
            found = work.perform(own_device(), progress)
            how = {"recipe": found.trial.recipe, "is_met": found.is_met, "stopped": found.stopped}
            return Outcome(label, notices=found.notices, verdict=found.told, **how)
        if isinstance(work, Piece):
            report = work.perform(own_device, progress)
        else:
            work.check()
            report = run(own_device(), work, progress)
    except Cancelled:
        if isinstance(work, Fit):  # that was to end before it had found anything
            return Outcome(label)
        raise
    except UserError as error:
        return Outcome(label, str(error), error.in_window)
    except MemoryError:
        little = "there is not enough memory for it"
        return Outcome(label, f"{little}; use fewer --jobs or a smaller --size", f"{little}; choose a smaller size")
    except ContextError as error:
        return Outcome(label, str(error), str(error))
    except Exception as error:
        return Outcome(label, f"{type(error).__name__}: {in_a_line(error)}", f"{what} failed: {in_a_line(error)}")
    return Outcome(label, notices=report.notices, verdict=report.verdict or "")


def in_a_line(error: BaseException) -> str:
    """What an error says."""
    return " ".join(str(error).split()) or "no reason given"


class Worker:
    """A process that does one piece of work after the other, and ends as soon as nobody is left who could give it one.

    A forked process would share this one's GL, which no driver survives. A pool of the standard library's is lost with
    any of its processes; here each stands for itself.

    Args:
        inbox: gets what it says, each with the worker itself; an `Outcome` ends a piece of work, None the worker.
    """

    def __init__(self, inbox: queue.SimpleQueue[tuple[Worker, Reply]]) -> None:
        with deaf_children():
            self._process = subprocess.Popen(
                [sys.executable, "-c", SERVING],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            )
        self._speaking = threading.Lock()
        threading.Thread(target=self._listen, args=(inbox,), daemon=True).start()

    def begin(self, work: Work) -> None:
        """Give it a piece of work; it has none. Waits until the process has taken it."""
        self._tell(work)

    def finish(self) -> None:
        """Let it end its fit with the best that it has. Waits until the process has heard it."""
        self._tell(Finish())

    def _tell(self, word: Work | Finish) -> None:
        said = self._process.stdin
        assert said is not None
        with self._speaking, suppress(OSError, ValueError):  # it has died, as the inbox will tell
            pickle.dump(word, said)
            said.flush()

    def end(self) -> None:
        """End it in the middle of whatever it does, with nothing half-written left. Waits until it has ended."""
        # The pipe is not closed before a piece of work that is still going through it has been taken or refused.
        threading.Thread(target=self._hang_up, daemon=True).start()
        try:
            self._process.wait(10 * GRACE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _hang_up(self) -> None:
        assert self._process.stdin is not None
        with suppress(OSError):
            self._process.stdin.close()

    def _listen(self, inbox: queue.SimpleQueue[tuple[Worker, Reply]]) -> None:
        said = self._process.stdout
        assert said is not None
        with said, suppress(EOFError, pickle.UnpicklingError):
            while True:
                inbox.put((self, pickle.load(said)))
        inbox.put((self, None))


def serve(do: Callable[[Work, Progress], Outcome] = perform) -> None:
    """Do the work that comes by standard input, until its end or SIGTERM comes, in the middle of some if need be."""
    said = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # nothing else may get among what is said
    waiting, finish = queue.SimpleQueue[Work](), threading.Event()

    def say(word: Reply) -> None:
        pickle.dump(word, said)
        said.flush()

    with interruptible(_end_now) as cancel, suppress(Cancelled, KeyboardInterrupt, BrokenPipeError):
        threading.Thread(target=_take, args=(waiting, finish), daemon=True).start()
        while True:
            say(do(waiting.get(), _told(say, lambda: cancel() or finish.is_set())))
    _end_now()


def _told(say: Callable[[Reply], None], cancel: Callable[[], bool]) -> Progress:
    """The progress of a piece of work, said to whoever gave it."""
    now = Status(0.0, "")

    def report(done: int, total: int | None) -> None:
        nonlocal now
        now = Status(done / total if total else 0.0, now.state)
        say(now)

    def tell(state: str) -> None:
        nonlocal now
        now = Status(now.done, state)
        say(now)

    return Progress(None, report, cancel, tell, lambda said: say(Warned(said)))


def _take(waiting: queue.SimpleQueue[Work], finish: threading.Event) -> None:
    while True:
        try:
            word = pickle.load(sys.stdin.buffer)
        except Exception:  # its end, or something that is no work
            _end_now()
        if isinstance(word, Finish):
            finish.set()
        else:
            finish.clear()
            waiting.put(word)


def _end_now() -> None:
    abandon()
    os._exit(INTERRUPTED)

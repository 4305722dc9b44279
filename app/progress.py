"""How far a long job is, and the wish to stop it: one thing for the command line and for the window."""

from __future__ import annotations

import os
import signal
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress

from app.errors import Cancelled

# Ctrl+C, a scheduler's, and that the terminal was closed, where the system knows it
SIGNALS = tuple(number for number in signal.Signals if number.name in ("SIGINT", "SIGTERM", "SIGHUP"))
GRACE = 0.2  # seconds that a job has to notice Ctrl+C between two of its steps
INTERRUPTED = 130

_undoing: list[Callable[[], object]] = []
_beginning = threading.Lock()


def never() -> bool:
    """The wish to stop that nobody has."""
    return False


class Progress:
    """Counts the steps of a job; `report(done, total)` hears of each, `cancel()` answers whether to stop.

    `tell(state)` hears what is being done: "writing" and the like, where a step takes long; "" is the work itself.
    `warn(said)` hears of what the user may want to stop it for; without it that is among the notices of the work.
    The window passes its own callbacks; the command line uses `on_terminal`.
    """

    def __init__(
        self,
        total: int | None = None,
        report: Callable[[int, int | None], None] = lambda done, total: None,
        cancel: Callable[[], bool] = never,
        tell: Callable[[str], None] = lambda state: None,
        warn: Callable[[str], object] | None = None,
    ) -> None:
        self._total = total
        self.done = 0
        self.cancel = cancel
        self._report = report
        self._tell = tell
        self.warn = warn

    @property
    def total(self) -> int | None:
        """How many steps there are, or None while that is not known; `report` hears of another."""
        return self._total

    @total.setter
    def total(self, total: int | None) -> None:
        self._total = total
        self._report(self.done, total)

    def check(self) -> None:
        """Raise `Cancelled` if the user wants to stop."""
        if self.cancel():
            raise Cancelled

    def advance(self, steps: int = 1) -> None:
        """Count `steps` as done; raises `Cancelled` if the user wants to stop."""
        self.check()
        self.count(steps)

    def count(self, steps: int) -> None:
        """Count `steps` as done, whatever the user wants: what they made is finished."""
        self.done += steps
        self._report(self.done, self.total)

    def expect(self, steps: int) -> None:
        """Count `steps` more, or less, as what there is to do, if that is known at all."""
        if self.total is not None:
            self.total += steps

    def enter(self, state: str) -> None:
        """Say what is being done from now on; raises `Cancelled` if the user wants to stop."""
        self.check()
        self._tell(state)

    def parts(self, steps: int, count: int) -> Callable[[int], None]:
        """A function to call with how many more of `count` parts are done: it advances by their share of `steps`."""
        done = 0

        def on_progress(more: int) -> None:
            nonlocal done
            before, done = done, done + more
            self.advance(done * steps // count - before * steps // count)

        return on_progress


def abandon() -> None:
    """Undo everything that is half done, for a process that is about to end at once."""
    _beginning.acquire(timeout=GRACE)  # never released: nothing begins any more
    for undo in reversed(_undoing):
        with suppress(OSError):
            undo()


@contextmanager
def beginning() -> Iterator[None]:
    """Begin another process, and say how it is undone, in the block: `abandon` waits until that is known."""
    with _beginning:
        yield


@contextmanager
def if_abandoned(undo: Callable[[], object]) -> Iterator[None]:
    """While the block runs, `abandon` calls `undo`."""
    _undoing.append(undo)
    try:
        yield
    finally:
        _undoing.remove(undo)


def leave() -> None:
    """End this process in the middle of whatever it is doing, with nothing half-written left."""
    abandon()
    with suppress(OSError):  # the terminal may be gone
        print("fluidwarp: cancelled; nothing half-written is left", file=sys.stderr, flush=True)
    os._exit(INTERRUPTED)


def heeded(number: signal.Signals) -> bool:
    """False for a hang-up under `nohup`, which is to go on."""
    return number.name != "SIGHUP" or signal.getsignal(number) is not signal.SIG_IGN


@contextmanager
def interruptible(at_once: Callable[[], None] | None = None) -> Iterator[Callable[[], bool]]:
    """Turn Ctrl+C, SIGTERM and SIGHUP into a wish to stop while the block runs; yields the callable that answers it.

    at_once: called in a thread if the block has not ended soon after the wish: some steps cannot be interrupted.
    A second Ctrl+C interrupts at once. Outside the main thread, where signals do not arrive, it does nothing.
    """
    wish = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield wish.is_set
        return

    asked = threading.Event()

    def ask(number: int, frame: object) -> None:
        wish.set()
        if asked.is_set():
            raise KeyboardInterrupt
        asked.set()

    with ExitStack() as stack:
        if at_once is not None:
            stack.enter_context(_watchdog(wish, at_once))
        for number in filter(heeded, SIGNALS):
            stack.callback(signal.signal, number, signal.signal(number, ask))
        yield wish.is_set


@contextmanager
def _watchdog(wish: threading.Event, at_once: Callable[[], None]) -> Iterator[None]:
    """Call `at_once` in a thread if the block goes on after a signal has come.

    A handler in Python waits until the main thread is back from C; the byte in the wakeup descriptor does not wait.
    """
    ours, theirs = socket.socketpair()
    theirs.setblocking(False)
    ended = threading.Event()

    def watch() -> None:
        while told := ours.recv(1):
            if told[0] in SIGNALS:
                wish.set()
                if not ended.wait(GRACE):
                    at_once()

    before = signal.set_wakeup_fd(theirs.fileno(), warn_on_full_buffer=False)
    thread = threading.Thread(target=watch, name="watchdog", daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        signal.set_wakeup_fd(before)
        theirs.close()
        thread.join()
        ours.close()


@contextmanager
def deaf_children() -> Iterator[None]:
    """Keep Ctrl+C and a hang-up, which reach every process of a terminal, from those that are started in the block.

    They inherit what this thread has blocked, while for itself it only waits until the block ends; a handler that a
    process sets for itself would come too late for one that is still being started.
    """
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGHUP})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def on_terminal(
    description: str,
    total: int | None,
    at_once: Callable[[], None] | None = leave,
    warn: Callable[[str], object] | None = None,
) -> Iterator[Progress]:
    """A `Progress` drawn as a bar with the time left on stderr, silent when that is no terminal; Ctrl+C cancels.

    at_once: see `interruptible`.
    warn: see `Progress`.
    """
    with interruptible(at_once) as cancel:
        if not sys.stderr.isatty():
            yield Progress(total, cancel=cancel, warn=warn)
            return
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
        from rich.progress import Progress as Bars

        columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
        with Bars(*columns, console=Console(stderr=True), transient=True) as bars:
            task = bars.add_task(description, total=total)

            def report(done: int, total: int | None) -> None:
                bars.update(task, completed=done, total=total)

            def tell(state: str) -> None:
                bars.update(task, description=f"{description}: {state}" if state else description)

            yield Progress(total, report, cancel, tell, warn)

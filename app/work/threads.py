"""Two ends of a stream in threads of their own, so that decoding, rendering and encoding go on at the same time."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TypeVar

from app.errors import UserError

T = TypeVar("T")

DEPTH = 2  # items that wait: enough to even out a slow one, and the memory stays bounded
_END = object()


@contextmanager
def write_behind(write: Callable[[T], None], threads: int = 1) -> Iterator[Callable[[T], None]]:
    """Yield a function that hands an item to `write` in another thread, and waits once `DEPTH` items lie there.

    With several threads `write` is called by all of them at a time, and items may overtake each other.

    What `write` raises is raised by the next call, or when the block ends; all has been written once it has ended, well
    or with a `UserError`. What is handed over must not be changed afterwards.

    However it ends, nothing is being written any more: also a Ctrl+C meanwhile waits for what has been begun.
    """
    waiting: queue.Queue[object] = queue.Queue(DEPTH)
    failed: list[BaseException] = []
    stopped = threading.Event()

    def work(end: threading.Event) -> None:
        while (item := waiting.get()) is not _END:
            if failed or stopped.is_set():
                continue  # the other side must not be left waiting for room
            try:
                write(item)  # type: ignore[arg-type]
            except BaseException as error:
                failed.append(error)
        with suppress(queue.Full):  # of ends, which are enough for the others
            waiting.put_nowait(_END)
        end.set()

    def put(item: T) -> None:
        if failed:
            raise failed[0]
        waiting.put(item)

    ended = [threading.Event() for _ in range(threads)]
    for end in ended:
        threading.Thread(target=work, args=(end,), name="writer", daemon=True).start()
    try:
        yield put
    except UserError:
        raise  # a fault of what comes next: what has been handed over is written
    except BaseException:
        stopped.set()
        raise
    finally:
        _end(waiting, ended)
    if failed:
        raise failed[0]


def _end(waiting: queue.Queue[object], ended: list[threading.Event]) -> None:
    """Let the threads come to their end; a process that went before they do would leave what they are in the midst of.

    A join that is interrupted takes its thread for one that has ended (CPython 3.11), and so does `is_alive` then.
    """
    interrupted: KeyboardInterrupt | None = None
    is_told = False
    while not all(one.is_set() for one in ended):
        try:
            if not is_told:
                waiting.put(_END)  # each hands it on
                is_told = True
            for one in ended:
                one.wait()
        except KeyboardInterrupt as error:
            interrupted = error
    if interrupted is not None:
        raise interrupted


@contextmanager
def prefetch(items: Iterator[T]) -> Iterator[Iterator[T]]:
    """Yield an iterator over `items`, which are made in another thread, `DEPTH` of them in advance.

    When the block ends before the items do, `items` is closed if it is a generator.
    """
    ready: queue.Queue[object] = queue.Queue(DEPTH)
    failed: list[BaseException] = []
    stopped = threading.Event()

    def work() -> None:
        try:
            for item in items:
                ready.put(item)
                if stopped.is_set():
                    break
        except BaseException as error:
            failed.append(error)
        finally:
            if (close := getattr(items, "close", None)) is not None:
                close()
            ready.put(_END)

    def read() -> Iterator[T]:
        while (item := ready.get()) is not _END:
            yield item  # type: ignore[misc]
        if failed:
            raise failed[0]

    thread = threading.Thread(target=work, name="reader", daemon=True)
    thread.start()
    try:
        yield read()
    finally:
        stopped.set()
        while thread.is_alive():
            with suppress(queue.Empty):
                ready.get(timeout=0.01)

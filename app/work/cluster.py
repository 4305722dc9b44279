"""Tasks on the machines of a Dask cluster."""

from __future__ import annotations

import asyncio
import logging
import queue
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from typing import Any

from app.errors import Cancelled, UserError
from app.progress import Progress
from app.work.tasks import Piece
from app.work.worker import ATTEMPTS, DIED, LOOK, Outcome, Reply, Status, Warned, Worker, in_a_line

CONNECTING = 10  # seconds that a scheduler has to answer
WATCHING = 5  # seconds between two looks at whether a scheduler has any worker
SCHEMES = ("tcp", "tls", "ws", "wss", "ucx")  # what a scheduler's address may begin with


class _Here(threading.local):
    """What a thread of a Dask worker has of its own: the process that does its work, and what that says."""

    worker: Worker | None = None
    inbox: queue.SimpleQueue[tuple[Worker, Reply]]


_here = _Here()


def _perform_on_worker(task: Piece, topic: str) -> Outcome:
    """In a thread of a Dask worker, which forgets a task that its client has cancelled; warnings go by the topic.

    A GL context wants a process whose other threads leave its objects alone; Dask's collect garbage at any time. And a
    driver that crashes does not take the worker with it.
    """
    from distributed import get_worker

    worker = get_worker()
    key = worker.get_current_task()

    def warn(said: str) -> None:
        worker.log_event(topic, {"key": key, "said": said})

    def forgotten() -> bool:
        known = worker.state.tasks.get(key)
        return known is None or known.state in ("cancelled", "released", "forgotten")

    for _ in range(ATTEMPTS):
        if _here.worker is None:
            _here.inbox = queue.SimpleQueue()
            _here.worker = Worker(_here.inbox)
        _here.worker.begin(task)
        try:
            outcome = _outcome_of(_here.inbox, warn, forgotten)
        except Cancelled:
            _end_worker()
            raise
        if outcome is not None:
            return outcome
        _end_worker()
    return Outcome(task.label, DIED)


def _outcome_of(
    inbox: queue.SimpleQueue[tuple[Worker, Reply]], warn: Callable[[str], None], forgotten: Callable[[], bool]
) -> Outcome | None:
    """What becomes of the task; None if the worker dies of it. Raises `Cancelled` once nobody wants it."""
    while True:
        with suppress(queue.Empty):
            _, message = inbox.get(timeout=LOOK)
            if isinstance(message, Warned):
                warn(message.said)
            elif not isinstance(message, Status):
                return message
        if forgotten():
            raise Cancelled


def _end_worker() -> None:
    if _here.worker is not None:
        _here.worker.end()
        _here.worker = None


def run_on_cluster(
    tasks: Sequence[Piece],
    address: str,
    report: Callable[[Outcome], None],
    progress: Progress,
    notice: Callable[[str], None],
    warn: Callable[[str, str], None],
) -> None:
    """Do all tasks where a Dask scheduler sends them; `report` is called with each outcome, `notice` with what
    is waited for, `warn` with a task's label and what its outcome does not say again.

    Raises:
        UserError: if there is no such scheduler, or it goes; how many are written is said.
        Cancelled: if `progress` says so.
    """
    before = [_stamps(task) for task in tasks]
    watched, idle = time.monotonic(), False
    inbox, warned = queue.SimpleQueue[tuple[str, str]](), set[tuple[str, str]]()
    with _client(address) as client:
        client.subscribe_topic(client.id, lambda event: inbox.put((event[1]["key"], event[1]["said"])))
        # Dask gives the tasks of a worker that dies to the others, as often as its allowed-failures says.
        pending = {client.submit(_perform_on_worker, task, client.id, pure=False): task for task in tasks}
        labels = {future.key: task.label for future, task in pending.items()}
        try:
            while pending:
                progress.check()
                time.sleep(LOOK)
                done = [future for future in pending if future.done()]
                while not inbox.empty():  # where all is by now that was said before they were done
                    key, said = told = inbox.get()
                    if told not in warned:  # by a worker that has died since
                        warned.add(told)
                        warn(labels[key], said)
                for future in done:
                    outcome = _outcome(future, pending[future])
                    if outcome is not None:
                        report(outcome)
                        del pending[future]
                if time.monotonic() > watched + WATCHING:
                    watched, was_idle, idle = time.monotonic(), idle, not _has_workers(client)
                    if idle and not was_idle:
                        mend = f"start one with: dask worker {address}"
                        notice(f"the Dask scheduler at {address} has no worker, and is waited for; {mend}")
        except _Gone:
            # What is written appears whole, so that it can be told by its files alone.
            written = sum(_are_new(_stamps(task), then) for task, then in zip(tasks, before, strict=True))
            raise UserError(
                f"the Dask scheduler at {address} is gone; {written} of {len(tasks)} pictures are written, and its "
                "workers may still finish what they have in hand; start it again, and then this for the others"
            ) from None
        except BaseException:
            client.cancel(list(pending), force=True)
            raise


def _has_workers(client: Any) -> bool:
    try:
        return bool(client.nthreads())
    except OSError:  # it is gone, as the futures will tell
        return True


class _Gone(Exception):
    """The scheduler does not know of our tasks any more."""


def _outcome(future: Any, task: Piece) -> Outcome | None:
    """What became of a task that has ended; None if it is done again, for a worker that died took its answer along."""
    status = future.status
    if status == "error":
        error = future.exception()
        if type(error).__name__ == "KilledWorker":
            return Outcome(task.label, "every worker that tried it died, perhaps for want of memory")
        return Outcome(task.label, f"it failed on the cluster ({in_a_line(error)})")
    if status == "finished":
        with suppress(CancelledError, OSError, TimeoutError):
            return future.result(CONNECTING)
    if future.cancelled():  # by nobody but the client, when it loses the scheduler
        raise _Gone
    return None


Stamps = tuple[tuple[int, int] | None, ...]


def _stamps(task: Piece) -> Stamps:
    """What changes when the files of a task are replaced; None for one that is not there."""
    found = []
    for path in task.outputs.files:
        try:
            status = path.stat()
            found.append((status.st_ino, status.st_mtime_ns))
        except OSError:
            found.append(None)
    return tuple(found)


def _are_new(now: Stamps, before: Stamps) -> bool:
    return all(mine is not None and mine != other for mine, other in zip(now, before, strict=True))


@contextmanager
def _client(address: str) -> Iterator[Any]:
    try:
        from distributed import Client
        from distributed.comm.addressing import parse_address, parse_host_port
        from distributed.comm.core import connect
        from distributed.security import Security
    except ImportError:
        raise UserError("a cluster needs Dask; install it with: pip install 'fluidwarp[cluster]'", 2) from None

    # Dask tells by itself, at length and also afterwards, what is told here in a sentence; nothing else here logs.
    logging.disable(logging.CRITICAL)

    async def look(security: Security) -> None:
        # Its own limit is for the connection alone, and not for the first words.
        arguments = security.get_connection_args("client")
        comm = await asyncio.wait_for(connect(address, timeout=CONNECTING, **arguments), CONNECTING + 1)
        comm.abort()

    # The client finds out too, but goes on for half a minute and ends in a traceback.
    try:
        scheme, place = parse_address(address)
        if scheme not in SCHEMES:
            raise ValueError(f"an address begins with {' or '.join(f'{known}://' for known in SCHEMES)}")
        if not 0 < parse_host_port(place)[1] < 65536:
            raise ValueError("there is no such port")
        asyncio.run(look(Security()))
        client = Client(address, timeout=CONNECTING, set_as_default=False)
    except Exception as error:  # of what answers there, but is no scheduler, Dask raises anything
        said = str(error).strip().splitlines() or ["what is there says nothing"]
        raise UserError(
            f"no Dask scheduler answers at {address} ({said[0]}); give for example tcp://host:8786"
        ) from None
    with client:
        yield client

"""Many pictures by one recipe: one after the other, in several processes, or on a Dask cluster."""

from __future__ import annotations

import queue
from collections import deque
from collections.abc import Callable, Sequence
from functools import partial

from app.progress import Progress
from app.work.cluster import run_on_cluster
from app.work.tasks import Piece
from app.work.worker import ATTEMPTS, DIED, LOOK, Outcome, Reply, Status, Warned, Worker, perform

Warn = Callable[[str, str], None]
"""Is told, with a label, what the user may want to stop a piece of work for."""


def run_batch(
    tasks: Sequence[Piece],
    report: Callable[[Outcome], None],
    progress: Progress,
    jobs: int = 1,
    cluster: str | None = None,
    notice: Callable[[str], None] = lambda said: None,
    warn: Warn = lambda label, said: None,
) -> int:
    """Do all tasks, whatever becomes of any; `report` is called with each outcome. Says how many failed.

    Args:
        jobs: processes on this machine.
        cluster: the address of a Dask scheduler, which decides instead.
        notice: is told what is waited for.
        warn: is told that a piece of work takes long, before it does, and its outcome does not say so again.

    Raises:
        UserError: if there is no such scheduler, or it goes; how many are written is said.
        Cancelled: if `progress` says so; what is finished stays, nothing is half-written.
    """
    failures = 0
    progress.total = len(tasks)

    def count(outcome: Outcome) -> None:
        nonlocal failures
        failures += bool(outcome.error)
        report(outcome)
        progress.advance()

    if cluster is not None:
        run_on_cluster(tasks, cluster, count, progress, notice, warn)
    elif min(jobs, len(tasks)) > 1:
        _run_in_processes(tasks, min(jobs, len(tasks)), count, progress, warn)
    else:
        for task in tasks:
            count(perform(task, Progress(cancel=progress.cancel, warn=partial(warn, task.label))))
    return failures


def _run_in_processes(
    tasks: Sequence[Piece], jobs: int, report: Callable[[Outcome], None], progress: Progress, warn: Warn
) -> None:
    waiting = deque((task, 1) for task in tasks)
    busy: dict[Worker, tuple[Piece, int]] = {}
    idle: list[Worker] = []
    inbox: queue.SimpleQueue[tuple[Worker, Reply]] = queue.SimpleQueue()
    warned = set[tuple[str, str]]()  # also of pieces whose worker died then, which are done again
    try:
        while waiting or busy:
            # One that has died is tried again when all others are done, alone, with all the memory there is.
            while waiting and len(busy) < (jobs if waiting[0][1] == 1 else 1):
                if waiting[0][1] > 1:
                    while idle:
                        idle.pop().end()
                worker = idle.pop() if idle else Worker(inbox)
                busy[worker] = task, _ = waiting.popleft()
                worker.begin(task)
            progress.check()
            try:
                worker, message = inbox.get(timeout=LOOK)
            except queue.Empty:
                continue
            if isinstance(message, Status) or worker not in busy:
                continue
            if isinstance(message, Warned):
                if (told := (busy[worker][0].label, message.said)) not in warned:
                    warned.add(told)
                    warn(*told)
                continue
            task, attempt = busy.pop(worker)
            if message is not None:
                idle.append(worker)
            else:
                worker.end()
                if attempt < ATTEMPTS:
                    waiting.append((task, attempt + 1))
                    continue
                message = Outcome(task.label, DIED)
            report(message)
    finally:
        for worker in (*busy, *idle):
            worker.end()

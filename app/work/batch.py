"""Many pictures by one recipe: one after the other, in several processes, or on a Dask cluster."""

from __future__ import annotations

import asyncio
import logging
import os
import pickle
import queue
import select
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from app.errors import Cancelled, UserError
from app.media.animation import ANIMATIONS
from app.media.files import cannot_write, check_kept, is_sequence, takes_place
from app.media.formats import FORMATS
from app.media.inputs import MAX_PIXELS
from app.media.opening import CLIP_ENDINGS, Opened, open_recipe
from app.media.project import picture_names
from app.model.recipe import Recipe
from app.progress import GRACE, INTERRUPTED, Progress, abandon, interruptible, never
from app.work.export import Job, MapOutput, run
from solver.gl.device import Device

NAME = "{name}"
"""What stands for the name of each picture in the name of an output."""

COMMAND_LINE = "the command line"
FLAGS = {  # by which the command line sets a key of the recipe
    "'fluid.grid'": "--grid", "'fluid.solver'": "--solver", "'output.size'": "--size", "'output.fps'": "--fps",
    "'output.quality'": "--quality", "'time.start'": "--from", "'time.end'": "--to", "'duration'": "--duration",
    "time: 'end'": "--to", "'start'": "--from", "'edges'": "--edges",
}  # fmt: skip

ATTEMPTS = 3  # at a picture whose worker dies: it may have been another's fault
DIED = "its process died each time, perhaps for want of memory; use fewer --jobs or a smaller --size"
CONNECTING = 10  # seconds that a scheduler has to answer
WATCHING = 5  # seconds between two looks at whether a scheduler has any worker
SCHEMES = ("tcp", "tls", "ws", "wss", "ucx")  # what a scheduler's address may begin with
LOOK = 0.1  # seconds between two looks at the wish to stop


@dataclass(frozen=True)
class Edits:
    """What is asked for instead of what the recipe says: keys of its tables, and keys of its own."""

    tables: tuple[tuple[str, tuple[tuple[str, Any], ...]], ...] = ()
    keys: tuple[tuple[str, Any], ...] = ()

    @classmethod
    def of(cls, tables: dict[str, dict[str, Any]], keys: dict[str, Any]) -> Edits:
        """Those that were given: not None."""
        given = {name: tuple((k, v) for k, v in table.items() if v is not None) for name, table in tables.items()}
        return cls(
            tuple((name, table) for name, table in given.items() if table),
            tuple((name, value) for name, value in keys.items() if value is not None),
        )

    def applied(self, recipe: Recipe) -> Recipe:
        """The recipe with them. Raises `UserError` where they are no values for it."""
        parts = dict(self.keys)
        for name, table in self.tables:
            parts[name] = getattr(recipe, name).model_copy(update=dict(table))
        try:
            return recipe.edited(**parts).checked(COMMAND_LINE) if parts else recipe
        except UserError as error:
            said = str(error).removeprefix(f"{COMMAND_LINE}: ")
            for key, flag in FLAGS.items():
                said = said.replace(key, flag)
            raise UserError(said) from None


@dataclass(frozen=True)
class Task:
    """One picture of a batch, in names only, so that any process that sees the same files can do it.

    Attributes:
        recipe: its file, or the name of one that comes with fluidwarp.
        edits: to the recipe.
        picture: the picture or clip; None is the recipe's own.
        output, stats, maps, part, animated, bits, strip, codec, states: as in `Job`.
        max_pixels: larger pictures are refused.
    """

    recipe: str
    edits: Edits
    picture: Path | None
    output: Path | None
    stats: Path | None = None
    maps: MapOutput | None = None
    part: tuple[int, int | None] = (0, None)
    animated: bool = False
    bits: int | None = None
    strip: bool = False
    max_pixels: int = MAX_PIXELS
    codec: str | None = None
    states: Path | None = None

    @property
    def label(self) -> str:
        """What the user calls it."""
        return str(self.picture or self.recipe)

    def named(self) -> Task:
        """The task with the picture's name where "{name}" stands in the names of what it writes."""
        if self.picture is None:
            return self
        maps = self.maps and replace(self.maps, path=named(self.maps.path, self.picture))
        output, stats = (path and named(path, self.picture) for path in (self.output, self.stats))
        return replace(self, output=output, stats=stats, maps=maps)

    @property
    def written(self) -> list[Path]:
        """The names of all that it writes."""
        return [path for path in (self.output, self.stats, self.maps and self.maps.path) if path is not None]

    def check_names(self, read: Sequence[Path]) -> None:
        """Raise `UserError` if two of its outputs are one file, or one of them is among the files `read`."""
        seen: set[str] = set()
        for path in self.written:
            for source in read:
                check_kept(source, path)
            real = os.path.realpath(path)
            if real in seen:
                raise UserError(f"{path} cannot hold two results; give --output, --map and --stats different names")
            seen.add(real)

    def job(self, opened: Opened | None = None) -> Job:
        """The job, with its picture read. Raises `UserError`."""
        opened = opened or _opened(self.recipe, self.max_pixels)
        file = opened.source_file(self.picture)
        own = opened.recipe if self.picture is None else opened.recipe.edited(picture=None)
        read = [Path(opened.label), *(opened.folder / name for name in picture_names(own))]
        self.check_names(read if file is None else [*read, file])
        source = opened.source(self.picture, self.max_pixels)
        return Job(
            self.edits.applied(opened.recipe),
            source.picture,
            opened.folder,
            self.output,
            self.stats,
            self.maps,
            source.clip,
            self.part,
            self.animated,
            self.bits,
            self.strip,
            self.codec,
            self.states,
        )


@dataclass(frozen=True)
class Outcome:
    """How a task went: `error` is "" if well."""

    label: str
    error: str = ""
    notices: tuple[str, ...] = ()


def spread(task: Task, pictures: Sequence[Path]) -> list[Task]:
    """The task for each of the pictures: its output is a folder, which is made, or a name with "{name}" in it.

    In a folder they keep their names and endings, or get .png where theirs cannot be written.

    Raises:
        UserError: if two would be written to the same file, or one to where it is read from.
    """
    recipe = str(Path(task.recipe).absolute()) if os.path.exists(task.recipe) else task.recipe
    output = task.output
    folder = output if NAME not in str(output) else None
    if folder is not None and folder.suffix and not os.path.isdir(folder):
        raise UserError(f"{len(pictures)} pictures cannot all become {output}; write a folder, or out/{NAME}.png")
    for path in (task.stats, task.maps and task.maps.path):
        if path is not None and NAME not in str(path) and len(pictures) > 1:
            raise UserError(f"{len(pictures)} pictures cannot all write {path}; put {NAME} into its name")
    tasks = []
    for picture in pictures:
        into = output and (output if NAME in str(output) else output / (picture.stem + _ending(picture)))
        one = replace(task, recipe=recipe, picture=picture, output=into).named()
        states = one.states and one.states.absolute()
        tasks.append(replace(one, output=one.output and one.output.absolute(), states=states))
    _check_apart(tasks)
    if folder is not None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise cannot_write(folder, error) from None
    # A cluster's workers do not start from this folder.
    return [replace(one, picture=one.picture and one.picture.absolute()) for one in tasks]


def _ending(picture: Path) -> str:
    suffix = picture.suffix.lower()
    if suffix in CLIP_ENDINGS:
        return picture.suffix if suffix in ANIMATIONS else ".mp4"
    return picture.suffix if suffix in FORMATS else ".png"


def _check_apart(tasks: Sequence[Task]) -> None:
    """Raise `UserError` if two would be written to one file, or one to where any is read from."""
    pictures = {os.path.realpath(task.picture): task.picture for task in tasks if task.picture is not None}
    seen: dict[str, Path | None] = {}
    for task in tasks:
        task.check_names([] if task.picture is None else [task.picture])
        for path in task.written:
            real = os.path.realpath(path)
            replaced = [real] if real in pictures else pictures if is_sequence(real) else []
            for other in replaced:
                if takes_place(real, other):
                    raise UserError(f"{pictures[other]} would be replaced by what {task.picture} becomes; rename one")
            if real in seen:
                raise UserError(f"{seen[real]} and {task.picture} would both become {path}; rename one")
            seen[real] = task.picture


def named(path: Path, picture: Path) -> Path:
    """`path` with the picture's name in place of "{name}"."""
    return Path(str(path).replace(NAME, picture.stem))


# Doing them ---------------------------------------------------------------------------------------------------------

Report = Callable[[Outcome], None]


def run_batch(
    tasks: Sequence[Task],
    report: Report,
    progress: Progress,
    jobs: int = 1,
    cluster: str | None = None,
    notice: Callable[[str], None] = lambda said: None,
) -> int:
    """Do all tasks, whatever becomes of any; `report` hears of each as it ends. Says how many failed.

    jobs: processes on this machine. cluster: the address of a Dask scheduler, which decides instead. notice: hears what
    is waited for.

    Raises:
        UserError: if there is no such scheduler, or it goes; how many are written is said.
        Cancelled: if `progress` says so; what is finished stays, nothing is half-written.
    """
    failures = 0
    progress.total = len(tasks)

    def heard(outcome: Outcome) -> None:
        nonlocal failures
        failures += bool(outcome.error)
        report(outcome)
        progress.advance()

    if cluster is not None:
        _run_on_cluster(tasks, cluster, heard, progress, notice)
    elif min(jobs, len(tasks)) > 1:
        _run_in_processes(tasks, min(jobs, len(tasks)), heard, progress)
    else:
        for task in tasks:
            heard(perform(task, progress.cancel))
    return failures


_here = threading.local()


def perform(task: Task, cancel: Callable[[], bool] = never) -> Outcome:
    """Do a task in this thread, on a device that is kept for the next one. Raises nothing but `Cancelled`."""
    try:
        job = task.job()
        job.check()
        if not hasattr(_here, "device"):  # a GL context belongs to one thread
            _here.device = Device.headless()
        told = run(_here.device, job, Progress(cancel=cancel))
    except Cancelled:
        raise
    except UserError as error:
        return Outcome(task.label, str(error))
    except MemoryError:
        return Outcome(task.label, "there is not enough memory for it; use fewer --jobs or a smaller --size")
    except Exception as error:
        return Outcome(task.label, f"{type(error).__name__}: {_in_a_line(error) or 'no reason given'}")
    return Outcome(task.label, notices=(*told.notices, *([told.verdict] if told.verdict else [])))


def _in_a_line(error: BaseException) -> str:
    return " ".join(str(error).split())


@lru_cache(maxsize=4)
def _opened(name: str, max_pixels: int) -> Opened:
    return open_recipe(name, max_pixels)


# Processes ----------------------------------------------------------------------------------------------------------

SERVING = "from app.work.batch import serve; serve()"


class _Child:
    """A process that does one task after the other, and ends as soon as nobody is left who could give it one.

    A forked process would share this one's GL, which no driver survives. A pool of the standard library's is lost with
    any of its processes; here each stands for itself.
    """

    def __init__(self) -> None:
        with _deaf_children():
            self._process = subprocess.Popen(
                [sys.executable, "-c", SERVING],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._tasks = self._process.stdin
        self._outcomes = self._process.stdout

    def fileno(self) -> int:
        """What can be read from when it has done its task, or died."""
        return self._outcomes.fileno()

    def begin(self, task: Task) -> None:
        """Give it a task; it has none."""
        with suppress(BrokenPipeError):  # it has died, as `outcome` will find
            self._tasks.write(pickle.dumps(task))
            self._tasks.flush()

    def outcome(self) -> Outcome:
        """What became of the task, once there is something to read. Raises `EOFError` if the process died of it."""
        try:
            return pickle.load(self._outcomes)
        except pickle.UnpicklingError:
            raise EOFError from None

    def end(self) -> None:
        """End it in the middle of whatever it does, with nothing half-written left."""
        with suppress(BrokenPipeError):
            self._tasks.close()
        try:
            self._process.wait(10 * GRACE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._outcomes.close()


@contextmanager
def _deaf_children() -> Iterator[None]:
    """Keep Ctrl+C and a hang-up, which reach every process of a terminal, from those that are started in the block.

    They inherit what this thread has blocked, while for itself it only waits until the block ends; a handler that a
    process sets for itself would come too late for one that is still being started.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGHUP})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def serve() -> None:
    """Do the tasks that come by standard input, until its end or SIGTERM comes, in the middle of one if need be."""
    outcomes = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # nothing else may get among the outcomes
    tasks: queue.SimpleQueue[Task] = queue.SimpleQueue()
    with interruptible(_end_now) as cancel, suppress(Cancelled, KeyboardInterrupt, BrokenPipeError):
        threading.Thread(target=_listen, args=(tasks,), daemon=True).start()
        while True:
            outcome = perform(tasks.get(), cancel)
            outcomes.write(pickle.dumps(outcome))
            outcomes.flush()
    _end_now()


def _listen(tasks: queue.SimpleQueue[Task]) -> None:
    while True:
        try:
            tasks.put(pickle.load(sys.stdin.buffer))
        except (EOFError, pickle.UnpicklingError):
            _end_now()


def _end_now() -> None:
    abandon()
    os._exit(INTERRUPTED)


def _run_in_processes(tasks: Sequence[Task], jobs: int, report: Report, progress: Progress) -> None:
    waiting = deque((task, 1) for task in tasks)
    busy: dict[_Child, tuple[Task, int]] = {}
    idle: list[_Child] = []
    try:
        while waiting or busy:
            # One that has died is tried again when all others are done, alone, with all the memory there is.
            while waiting and len(busy) < (jobs if waiting[0][1] == 1 else 1):
                if waiting[0][1] > 1:
                    while idle:
                        idle.pop().end()
                child = idle.pop() if idle else _Child()
                busy[child] = task, _ = waiting.popleft()
                child.begin(task)
            done, _, _ = select.select([*busy], [], [], LOOK)
            progress.check()
            for child in done:
                task, attempt = busy.pop(child)
                try:
                    outcome = child.outcome()
                    idle.append(child)
                except EOFError:
                    child.end()
                    if attempt < ATTEMPTS:
                        waiting.append((task, attempt + 1))
                        continue
                    outcome = Outcome(task.label, DIED)
                report(outcome)
    finally:
        for child in (*busy, *idle):
            child.end()


# A cluster ----------------------------------------------------------------------------------------------------------


def _perform_on_worker(task: Task) -> Outcome:
    """In a thread of a Dask worker, which forgets a task that its client has cancelled.

    A GL context wants a process whose other threads leave its objects alone; Dask's collect garbage at any time. And a
    driver that crashes does not take the worker with it.
    """
    from distributed import get_worker

    worker = get_worker()
    key = worker.get_current_task()

    def forgotten() -> bool:
        known = worker.state.tasks.get(key)
        return known is None or known.state in ("cancelled", "released", "forgotten")

    for _ in range(ATTEMPTS):
        if not hasattr(_here, "child"):
            _here.child = _Child()
        child: _Child = _here.child
        try:
            child.begin(task)
            while not select.select([child], [], [], LOOK)[0]:
                if forgotten():
                    raise Cancelled
            return child.outcome()
        except (EOFError, Cancelled) as error:
            del _here.child
            child.end()
            if isinstance(error, Cancelled):
                raise
    return Outcome(task.label, DIED)


def _run_on_cluster(
    tasks: Sequence[Task], address: str, report: Report, progress: Progress, notice: Callable[[str], None]
) -> None:
    ended: queue.SimpleQueue[Any] = queue.SimpleQueue()
    before = {task: _stamps(task) for task in tasks}
    heard: set[Task] = set()
    watched, idle = time.monotonic(), False
    with _client(address) as client:
        # Dask gives the tasks of a worker that dies to the others, as often as its allowed-failures says.
        futures = {client.submit(_perform_on_worker, task, pure=False): task for task in tasks}
        for future in futures:
            future.add_done_callback(ended.put)
        try:
            while len(heard) < len(tasks):
                progress.check()
                try:
                    future = ended.get(timeout=LOOK)
                except queue.Empty:
                    if time.monotonic() > watched + WATCHING:
                        watched, was_idle, idle = time.monotonic(), idle, not _has_workers(client)
                        if idle and not was_idle:
                            mend = f"start one with: dask worker {address}"
                            notice(f"the Dask scheduler at {address} has no worker, and is waited for; {mend}")
                    continue
                report(_outcome(future, futures[future]))
                heard.add(futures[future])
        except _Gone:
            # What is written appears whole, so that it can be told by its files alone.
            written = sum(_are_new(_stamps(task), before[task]) for task in tasks)
            raise UserError(
                f"the Dask scheduler at {address} is gone; {written} of {len(tasks)} pictures are written, and its "
                "workers may still finish what they have in hand; start it again, and then this for the others"
            ) from None
        except BaseException:
            client.cancel(list(futures), force=True)
            raise


def _has_workers(client: Any) -> bool:
    try:
        return bool(client.nthreads())
    except OSError:  # it is gone, as the futures will tell
        return True


class _Gone(Exception):
    """The scheduler does not know of our tasks any more."""


def _outcome(future: Any, task: Task) -> Outcome:
    if future.status == "finished":
        try:
            return future.result(CONNECTING)
        except (CancelledError, OSError, TimeoutError):
            raise _Gone from None
    if future.status != "error":  # nobody but the client cancels, when it loses the scheduler
        raise _Gone
    error = future.exception()
    if type(error).__name__ == "KilledWorker":
        return Outcome(task.label, "every worker that tried it died, perhaps for want of memory")
    return Outcome(task.label, f"it failed on the cluster ({_in_a_line(error)})")


Stamps = tuple[tuple[int, int] | None, ...]


def _stamps(task: Task) -> Stamps:
    """What changes when the files of a task are replaced; None for one that is not there."""
    found = []
    for path in task.written:
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

"""Running the ffmpeg that imageio-ffmpeg brings along: fed and read, stopped at will."""

from __future__ import annotations

import errno
import functools
import os
import re
import select
import signal
import subprocess
import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack

from app.errors import Cancelled, UserError
from app.media.files import cannot_write
from app.progress import beginning, if_abandoned, never

# A packet that is corrupt is a warning to ffmpeg: of a file that was cut it is all that is said.
MERE_NEWS = r"(\[[^\]]*\] )*\[(info|warning)\] (?!Packet corrupt)| *Last message repeated"
PIPES = 4  # to a process: its input, output and complaints, and one by which Python hears that it has begun
PATIENCE = 0.1  # seconds between two looks at the wish to stop


@functools.cache
def executable() -> str:
    """Path of ffmpeg; raises `UserError` when there is none for this machine."""
    import imageio_ffmpeg

    _check_room()
    try:
        found = imageio_ffmpeg.get_ffmpeg_exe()
    except RuntimeError as error:
        raise UserError("No ffmpeg was found: install one, or set IMAGEIO_FFMPEG_EXE to its path.") from error
    try:
        _said([found, "-version"]).check_returncode()
    except (OSError, subprocess.CalledProcessError):  # what the variable names is taken as it is
        raise UserError(f"{found} is no ffmpeg that runs here; set IMAGEIO_FFMPEG_EXE to one, or to nothing.") from None
    return found


def _check_room() -> None:
    """Raise `UserError` if this process may not open what one of ffmpeg's needs: imageio-ffmpeg says it is missing."""
    pipes = list[int]()
    try:
        for _ in range(PIPES):
            pipes += os.pipe()
    except OSError as error:
        if error.errno not in (errno.EMFILE, errno.ENFILE):
            raise
        mend = "allow more, as by: ulimit -n 256"
        raise UserError(f"ffmpeg cannot be started: more files would be open than may be; {mend}.") from None
    finally:
        for pipe in pipes:
            os.close(pipe)


@functools.cache
def encoders() -> frozenset[str]:
    """Names of the encoders that this ffmpeg has."""
    listed = ask("-encoders").stdout.decode("utf-8", "replace")
    return frozenset(re.findall(r"^ [VAS][A-Z.]{5} (\S+)", listed, re.MULTILINE))


def ask(*arguments: str) -> subprocess.CompletedProcess[bytes]:
    """What ffmpeg says to `ffmpeg arguments...`, in which it writes no file."""
    return _said([executable(), "-hide_banner", *arguments])


def _said(command: list[str]) -> subprocess.CompletedProcess[bytes]:
    # In a session of its own, since Ctrl+C is ours to handle: one that it has ended would say nothing, or half of it.
    return subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, start_new_session=True)


class Ffmpeg:
    """One run of ffmpeg; as a context manager it never outlives its block.

    arguments: what follows `ffmpeg -y`.
    label: the file a failure is told about, with `doing` ("write", "read") as the verb.
    level: what it tells, as by its own `-loglevel`.
    cancel: asked about ten times a second while ffmpeg keeps us waiting, in any thread; when true, `Cancelled` comes.
    """

    def __init__(
        self,
        arguments: Sequence[str],
        label: str,
        *,
        doing: str = "write",
        cancel: Callable[[], bool] = never,
        level: str = "error",
    ) -> None:
        self._label, self._doing, self._cancel = label, doing, cancel
        self._complaints = tempfile.TemporaryFile()  # noqa: SIM115 - closed in __exit__; a pipe could fill and block
        self._ending = ExitStack()
        command = [executable(), "-hide_banner", "-nostats", "-loglevel", f"+level+{level}", "-y", *arguments]
        with beginning():
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._complaints,
                bufsize=0,
                pipesize=1 << 18,
                start_new_session=True,  # Ctrl+C is ours to handle
            )
            self._ending.enter_context(if_abandoned(self._end))
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._stdin, self._stdout = self._process.stdin, self._process.stdout
        os.set_blocking(self._stdout.fileno(), False)
        self._watcher: threading.Thread | None = None
        self._ended = threading.Event()

    def __enter__(self) -> Ffmpeg:
        return self

    def __exit__(self, *exception: object) -> None:
        self._ended.set()
        self._ending.close()
        self._end()
        self._stdin.close()
        self._stdout.close()
        self._complaints.close()

    def _end(self) -> None:
        """End it, so that it makes no file any more."""
        self._process.kill()
        self._process.wait()

    def feed(self, data: memoryview) -> None:
        """Write all of `data`, bytes, to its standard input."""
        self._check()
        if self._watcher is None:
            self._watcher = threading.Thread(target=self._watch, name="ffmpeg watcher", daemon=True)
            self._watcher.start()
        try:
            # In one call, that waits without the interpreter's lock: a thread that renders keeps it long, and would
            # let each part of a frame wait for it anew.
            while data:
                data = data[os.write(self._stdin.fileno(), data) :]
        except BrokenPipeError:
            self._check()
            self._process.wait()
            raise self.failure() from None

    def _watch(self) -> None:
        """End the process, and so a write that waits for it, when it is to be stopped."""
        while not self._ended.wait(PATIENCE):
            if self._cancel():
                self._process.kill()
                return

    def blocks(self, size: int) -> Iterator[bytearray]:
        """Its standard output in blocks of `size` bytes; raises `UserError` when it fails."""
        pipe = self._stdout.fileno()
        while True:
            block = bytearray(size)
            view = memoryview(block)
            while view:
                self._check()
                if not select.select([pipe], [], [], PATIENCE)[0]:
                    continue
                count = os.readv(pipe, [view])
                if not count:
                    break
                view = view[count:]
            if view:  # the end, where a partial block can only come from a failure
                self.finish()
                return
            yield block

    def finish(self) -> None:
        """Close its input and wait for its end; raises `UserError` when it failed."""
        self._stdin.close()
        while True:
            self._check()
            try:
                status = self._process.wait(PATIENCE)
            except subprocess.TimeoutExpired:
                continue
            if status:
                self._check()  # the watcher may have ended it
                raise self.failure()
            return

    def _check(self) -> None:
        if self._cancel():
            raise Cancelled

    def complaint(self) -> str:
        """The first thing it has complained of, without a full stop; "" if nothing."""
        said = [line for line in self._said().splitlines() if line.strip() and not re.match(MERE_NEWS, line)]
        lines = [re.sub(r"^(\[[^\]]*\] )+", "", line).strip() for line in said]
        return lines[0].rstrip(".") if lines else ""  # the reason stands first, its consequences follow it

    def sizes(self) -> list[str]:
        """The sizes of the pictures that it has read, at the level "info", as 64 x 48, in the order of their coming."""
        said = self._said()
        first = re.findall(r"^\[info\] +Stream #0:.* Video: .*?, (\d+)x(\d+)", said, re.MULTILINE)[:1]
        others = re.findall(r"Reconfiguring filter graph because video parameters changed to .*?, (\d+)x(\d+)", said)
        return list(dict.fromkeys(f"{width} x {height}" for width, height in [*first, *others]))

    def failure(self) -> UserError:
        """What its complaints mean for the user."""
        said, status = self._said(), self._process.returncode
        for number in (errno.ENOSPC, errno.EFBIG):
            if os.strerror(number) in said or (number == errno.EFBIG and status == -signal.SIGXFSZ):
                return cannot_write(self._label, OSError(number, os.strerror(number)))
        if status is not None and status < 0:
            killed = f"ffmpeg was killed ({signal_name(-status)}), perhaps for want of memory"
            mend = "try again with fewer programs running, or a smaller size"
            return UserError(f"Cannot {self._doing} {self._label}: {killed}; {mend}.")
        reason = self.complaint() or f"it ended with status {status}"
        return UserError(f"Cannot {self._doing} {self._label}: ffmpeg says: {reason}.")

    def _said(self) -> str:
        self._complaints.seek(0)
        return self._complaints.read().decode("utf-8", "replace")


def signal_name(number: int) -> str:
    """Such as SIGKILL."""
    try:
        return signal.Signals(number).name
    except ValueError:  # a real-time signal
        return f"signal {number}"


def run(
    arguments: Sequence[str],
    label: str,
    *,
    cancel: Callable[[], bool] = never,
    passed: Callable[[int], None] = lambda frames: None,
) -> None:
    """Run ffmpeg to its end; `passed` hears of frames that it has put out. Raises `UserError` or `Cancelled`."""
    with Ffmpeg(["-progress", "pipe:1", *arguments], label, cancel=cancel) as process:
        frames, line = 0, b""
        for byte in process.blocks(1):
            line += byte
            if byte == b"\n":
                if found := re.match(rb"frame=\s*(\d+)", line):
                    passed(int(found[1]) - frames)
                    frames = int(found[1])
                line = b""

"""Progress and the wish to stop, as the command line and as the window use them."""

from __future__ import annotations

import os
import pty
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from app.errors import Cancelled
from app.progress import GRACE, Progress, interruptible, on_terminal

ROOT = Path(__file__).parents[1]

JOB = """
import sys, time
from app.errors import Cancelled
from app.progress import on_terminal
try:
    with on_terminal("Rendering", int(sys.argv[1])) as progress:
        print("started", flush=True)
        for step in range(int(sys.argv[1])):
            time.sleep(0.01)
            progress.enter("writing" if step > 20 else "")
            progress.advance()
    print("finished")
except Cancelled:
    print("cancelled", step)
"""


def test_progress_reports_and_stops():
    heard: list[tuple[int, int | None]] = []
    wish = threading.Event()
    progress = Progress(4, lambda done, total: heard.append((done, total)), wish.is_set)
    progress.advance()
    progress.advance(2)
    assert heard == [(1, 4), (3, 4)]
    wish.set()
    with pytest.raises(Cancelled):
        progress.advance()
    assert len(heard) == 2


def test_parts_of_a_step_add_up_to_it():
    heard: list[int] = []
    progress = Progress(10, lambda done, total: heard.append(done))
    progress.advance(3)
    progress.expect(7)
    hear = progress.parts(7, 4)
    for _ in range(4):
        hear(1)
    assert heard == [3, 3, 4, 6, 8, 10]
    assert progress.total == 17
    wish = threading.Event()
    wish.set()
    progress.cancel = wish.is_set
    with pytest.raises(Cancelled):
        progress.enter("writing")
    progress.count(7)  # what is finished is finished
    assert progress.done == 17


def test_it_is_silent_when_piped():
    done = subprocess.run([sys.executable, "-c", JOB, "5"], capture_output=True, cwd=ROOT, check=True)
    assert (done.stdout, done.stderr) == (b"started\nfinished\n", b"")


def test_a_terminal_sees_a_bar_with_the_time_left():
    ours, theirs = pty.openpty()
    environment = os.environ | {"TERM": "xterm", "COLUMNS": "80"}
    job = subprocess.Popen(
        [sys.executable, "-c", JOB, "60"], stdout=subprocess.PIPE, stderr=theirs, cwd=ROOT, env=environment
    )
    os.close(theirs)
    seen = b""
    try:
        while block := os.read(ours, 4096):
            seen += block
    except OSError:  # the terminal is gone with its program
        pass
    os.close(ours)
    assert job.wait() == 0
    assert b"Rendering " in seen
    assert b"Rendering: writing" in seen
    assert b"/60" in seen
    assert b"0:00:0" in seen


def test_ctrl_c_stops_a_job_of_a_minute_at_its_next_step():
    job = subprocess.Popen([sys.executable, "-c", JOB, "6000"], stdout=subprocess.PIPE, cwd=ROOT)
    assert job.stdout is not None
    assert job.stdout.readline() == b"started\n"
    job.send_signal(signal.SIGINT)
    words, done = job.stdout.readline().split()
    assert words == b"cancelled"
    assert int(done) < 3000  # of 6000: half a minute, were nobody to hear
    assert job.wait() == 0


def test_a_hang_up_stops_too_but_not_under_nohup():
    before = signal.getsignal(signal.SIGHUP)
    try:
        for handler, stops in ((signal.SIG_DFL, True), (signal.SIG_IGN, False)):
            signal.signal(signal.SIGHUP, handler)
            with interruptible() as cancel:
                os.kill(os.getpid(), signal.SIGHUP)
                assert cancel() is stops
    finally:
        signal.signal(signal.SIGHUP, before)


def test_signals_are_given_back():
    before = signal.getsignal(signal.SIGINT)
    with interruptible() as cancel:
        assert not cancel()
        os.kill(os.getpid(), signal.SIGTERM)
        assert cancel()
    assert signal.getsignal(signal.SIGINT) is before


def test_a_second_ctrl_c_interrupts_at_once():
    with interruptible() as cancel:
        signal.raise_signal(signal.SIGINT)
        assert cancel()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)


def test_where_nobody_answers_it_is_called_at_once_and_not_where_the_block_has_ended():
    called = threading.Event()
    with interruptible(called.set) as cancel:
        signal.raise_signal(signal.SIGINT)
        assert cancel()
    assert not called.is_set()
    with interruptible(called.set):
        signal.raise_signal(signal.SIGINT)
        assert called.wait(20 * GRACE)


def test_other_threads_may_use_it():
    counted: list[int] = []

    def work() -> None:
        with on_terminal("x", 2) as progress:
            progress.advance(2)
            counted.append(progress.done)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert counted == [2]

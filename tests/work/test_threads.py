"""Two ends of a stream in threads of their own."""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
import time

import pytest

from app.work.threads import write_behind


def ends(thread: threading.Thread) -> bool:
    """It waits at the end of a block."""
    frame, waits = sys._current_frames().get(thread.ident or 0), False
    while frame is not None and frame.f_code.co_filename != contextlib.__file__:
        waits |= frame.f_code.co_name in ("wait", "join")
        frame = frame.f_back
    return waits and frame is not None and frame.f_code.co_name == "__exit__"


@pytest.mark.parametrize("threads", [1, 3])
def test_what_is_being_written_is_waited_for_whenever_ctrl_c_comes(threads: int) -> None:
    """Else the process would end in the middle of a file, whose temporary name nobody removes."""
    main, begun, left = threading.current_thread(), threading.Barrier(threads + 1), threading.Event()
    heard, ended = threading.Event(), threading.Semaphore(0)
    found: list[bool] = []

    def hear(number: int, frame: object) -> None:
        heard.set()
        raise KeyboardInterrupt

    def write(item: int) -> None:
        begun.wait()
        while not (ends(main) or left.is_set()):
            time.sleep(0.001)
        if item == 0:
            signal.pthread_kill(main.ident or 0, signal.SIGINT)
        heard.wait()
        while not (ends(main) or left.is_set()):
            time.sleep(0.001)
        found.append(left.is_set())
        ended.release()

    def interrupted() -> None:
        with write_behind(write, threads) as put:
            for item in range(threads):
                put(item)
            begun.wait()
            raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, hear)
    try:
        with pytest.raises(KeyboardInterrupt):
            interrupted()
        left.set()
        for _ in range(threads):
            ended.acquire()
    finally:
        signal.signal(signal.SIGINT, before)
    assert found == [False] * threads

"""Two ends of a stream in threads of their own."""

from __future__ import annotations

import signal
import threading
import time

import pytest

from app.work.threads import write_behind

WHILE = 0.1  # seconds, in which the main thread comes to where it waits, or, if it does not wait, leaves


@pytest.mark.parametrize("threads", [1, 3])
def test_what_is_being_written_is_waited_for_whenever_ctrl_c_comes(threads: int) -> None:
    """Else the process would end in the middle of a file, whose temporary name nobody removes."""
    main, begun, left = threading.current_thread(), threading.Barrier(threads + 1), threading.Event()
    leaves, heard, ended = threading.Event(), threading.Event(), threading.Semaphore(0)
    found: list[bool] = []

    def hear(number: int, frame: object) -> None:
        heard.set()
        raise KeyboardInterrupt

    def write(item: int) -> None:
        begun.wait()
        leaves.wait()
        time.sleep(WHILE)
        if item == 0:
            signal.pthread_kill(main.ident or 0, signal.SIGINT)
        heard.wait()
        time.sleep(WHILE)
        found.append(left.is_set())
        ended.release()

    def interrupted() -> None:
        with write_behind(write, threads) as put:
            for item in range(threads):
                put(item)
            begun.wait()
            leaves.set()
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

"""Two ends of a stream in threads of their own."""

from __future__ import annotations

import signal
import threading
import time

import pytest

from app.errors import Cancelled, UserError
from app.work.threads import prefetch, write_behind

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


def test_what_is_handed_over_arrives_in_order():
    came: list[int] = []
    with write_behind(came.append) as put:
        for number in range(100):
            put(number)
    assert came == list(range(100))
    with prefetch(iter(range(100))) as items:
        assert list(items) == list(range(100))


def test_several_threads_write_at_a_time_and_all_is_written():
    """Each waits until another one writes, too: one thread alone would wait in vain."""
    together, came = threading.Barrier(2), list[int]()

    def write(number: int) -> None:
        together.wait(timeout=60)
        came.append(number)

    with write_behind(write, threads=2) as put:
        for number in range(10):
            put(number)
    assert sorted(came) == list(range(10))


@pytest.mark.parametrize("threads", [1, 3])
def test_what_several_threads_cannot_write_is_heard(threads: int):
    def write(number: int) -> None:
        if number == 5:
            raise UserError("the disk is full")

    with pytest.raises(UserError, match="disk is full"), write_behind(write, threads) as put:
        all(put(number) is None for number in range(1000))
    assert not [one for one in threading.enumerate() if one.name == "writer"]


def test_what_was_handed_over_before_a_fault_is_written():
    came: list[int] = []

    def slow(number: int) -> None:
        time.sleep(0.05)
        came.append(number)

    def hand_over() -> None:
        with write_behind(slow) as put:
            put(0)
            put(1)
            raise UserError("the next cannot be read")

    with pytest.raises(UserError, match="the next"):
        hand_over()
    assert came == [0, 1]


def test_what_goes_wrong_at_one_end_is_heard_at_the_other():
    def refuse(number: int) -> None:
        if number == 3:
            raise Cancelled

    def broken():
        yield 1
        raise UserError("the clip ends here")

    with pytest.raises(Cancelled), write_behind(refuse) as put:
        all(put(number) is None for number in range(1000))
    with pytest.raises(UserError, match="ends here"), prefetch(broken()) as items:
        list(items)
    closed: list[bool] = []

    def endless():
        try:
            while True:
                yield 0
        finally:
            closed.append(True)

    with prefetch(endless()) as items:
        next(items)
    assert closed == [True]

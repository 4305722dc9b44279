"""What decoders print by themselves."""

from __future__ import annotations

import os
import sys
import threading

import pytest

from app.media.codecs.decoding import quiet


def test_two_threads_that_hold_back_what_decoders_print_leave_the_output_as_it_was(capfd: pytest.CaptureFixture[str]):
    first, second, out = quiet(), quiet(), sys.stdout
    begun, ended = threading.Event(), threading.Event()

    def other() -> None:
        with second:
            begun.set()
            ended.wait()

    thread = threading.Thread(target=other)
    with first:
        thread.start()
        begun.wait()
    os.write(2, b"the other is still within\n")
    ended.set()
    thread.join()
    os.write(2, b"told\n")
    assert sys.stdout is out
    assert capfd.readouterr().err == "told\n"

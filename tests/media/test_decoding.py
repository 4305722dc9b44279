"""What decoders print by themselves."""

from __future__ import annotations

import os
import sys
import threading
import warnings
from pathlib import Path

import pytest

from app.errors import Cancelled, UserError
from app.media.codecs.decoding import decoding, quiet


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


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (None, ""),
        (ValueError("a row is gone"), "the PNG file is truncated or damaged (a row is gone); get it again."),
        (KeyError(), "the PNG file is truncated or damaged; get it again."),
        (IndexError("1234\nsecond"), "the PNG file is truncated or damaged (second); get it again."),
        (MemoryError(), "it does not fit into the memory; close other programs, or make it smaller first."),
        (RecursionError("deep"), "the PNG file is truncated or damaged (deep); get it again."),
    ],
)
def test_whatever_a_decoder_raises_is_a_sentence_and_its_warnings_are_nobodys(
    error: Exception | None, told: str
) -> None:
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        try:
            with decoding(Path("a.png"), "PNG"):
                warnings.warn("odd", stacklevel=1)
                if error is not None:
                    raise error
            said = ""
        except UserError as found:
            said = str(found).removeprefix("Cannot read a.png: ")
    assert (said, heard) == (told, [])


@pytest.mark.parametrize("error", [UserError("as it is"), Cancelled()])
def test_what_is_said_already_is_left_as_it_is(error: Exception) -> None:
    with pytest.raises(type(error)) as raised, decoding(Path("a.png"), "PNG"):
        raise error
    assert raised.value is error

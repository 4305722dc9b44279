"""What decoders raise and print about a damaged file, made into one sentence."""

from __future__ import annotations

import io
import os
import sys
import threading
import warnings
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path

from app.errors import Cancelled, UserError
from app.media.inputs import read_start


@contextmanager
def decoding(file: Path, name: str) -> Iterator[None]:
    """Turn whatever a decoder raises into `UserError`, and keep it from warning."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except (UserError, Cancelled):
        raise
    except MemoryError:
        raise UserError(
            f"Cannot read {file}: it does not fit into the memory; close other programs, or make it smaller first."
        ) from None
    except Exception as error:  # decoders of damaged files raise anything: IndexError, struct.error, zlib.error ...
        lines = [line.strip() for line in str(error).splitlines()]
        reason = next((f" ({line})" for line in lines if line.strip("0123456789")), "")
        message = f"Cannot read {file}: the {name} file is truncated or damaged{reason}; get it again."
        raise UserError(message) from error


@dataclass
class _Quiet:
    """Nothing reaches the process's output while anybody is within; of several threads the last one out ends that."""

    lock: threading.Lock = field(default_factory=threading.Lock)
    within: int = 0
    ended: ExitStack = field(default_factory=ExitStack)

    def __enter__(self) -> None:
        with self.lock:
            self.within += 1
            if self.within > 1:
                return
            sys.stderr.flush()
            kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
            self.ended.callback(os.close, kept)
            self.ended.callback(os.dup2, kept, 2)
            os.dup2(nowhere, 2)
            os.close(nowhere)
            self.ended.enter_context(redirect_stdout(io.StringIO()))

    def __exit__(self, *exception: object) -> None:
        with self.lock:
            self.within -= 1
            if not self.within:
                self.ended.close()


_QUIET = _Quiet()


def quiet() -> AbstractContextManager[None]:
    """Hold back what OpenEXR and libpng print about a damaged file by themselves, where we raise an error of ours."""
    return _QUIET


def head_of(file: Path) -> bytes:
    """The first bytes of a file that is there and not empty; raises `UserError`."""
    head = read_start(file, "picture", 16)
    if not head:
        raise UserError(f"Cannot read {file}: the file is empty; save or download it again.")
    return head


def start_of(file: Path) -> bytes:
    """As much of a file as tells what is in it."""
    with file.open("rb") as stream:
        return stream.read(4096)

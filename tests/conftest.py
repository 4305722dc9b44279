"""Shared fixtures: a headless device, the check that GL was left clean, and the command line in this process."""

from __future__ import annotations

import os
import sys

# The tests' processes keep the cores busy: threads of linear algebra would only wait for one another, at full speed.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy is loaded
# Or each of the processes that are started, a hundred or more, would compile all modules anew.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

import gc
import re
import subprocess
import threading
import warnings
from collections.abc import Generator, Iterator
from contextlib import suppress
from functools import cache, wraps
from pathlib import Path
from typing import Any

import moderngl
import pytest
import typer.main

import solver.gl.passes
from app import cli
from app.errors import BUG, UserError
from app.work.recovery import LOCK
from solver.gl.device import Device
from support.commands import Run
from support.desk import Desk
from support.khronos import Programs

COMMAND = cache(typer.main.get_command)
"""Typer reads all annotations anew for each command line, which is most of what a wrong one costs."""

AS_PYTHON = re.compile(
    r"""[(\[{](['"])[^'"]*\1, ?['"]|\((['"])[^'"]*\2,\)|<[\w.]+ (object|at) |[a-z]\w+_keys\(|Path\("""
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What waits for a window comes first, then what is long: no process is left alone with it in the end."""

    def turn(item: pytest.Item) -> int:
        if getattr(getattr(item, "module", None), "Desk", None) is Desk:
            return 0
        return 1 if item.get_closest_marker("long") else 2

    items.sort(key=turn)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """What is imported and collected stays: the garbage collector need not go through it, then or again and again."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.collect()
        gc.freeze()
        gc.enable()


@pytest.fixture(scope="session", autouse=True)
def khronos_accepts_every_program() -> Iterator[None]:
    """Every program that the tests of this process compile passes the Khronos reference compiler too."""
    compile_program, programs = solver.gl.passes.compile_program, Programs()

    def noting(ctx: moderngl.Context, fragment: str, defines: dict[str, object]) -> moderngl.Program:
        program = compile_program(ctx, fragment, defines)
        programs.add(fragment, defines)
        return program

    solver.gl.passes.compile_program = noting
    yield
    solver.gl.passes.compile_program = compile_program
    assert not programs.complaints()


@pytest.fixture(scope="session", autouse=True)
def no_thread_holds_up_the_end() -> Iterator[None]:
    """Every thread that the program starts may be left where it is, but for those that take files away."""
    make, held = threading.Thread.__init__, set[str]()

    def noting(self: threading.Thread, *args: Any, **named: Any) -> None:
        make(self, *args, **named)
        target = named.get("target")
        place = f"{getattr(target, '__module__', '')}.{getattr(target, '__name__', '')}"
        if not self.daemon and place.startswith(("app.", "solver.")):
            held.add(place)

    threading.Thread.__init__ = noting
    yield
    threading.Thread.__init__ = make
    assert held <= {"app.work.export_process.end"}


@pytest.fixture(scope="session", autouse=True)
def no_message_is_written_as_python_writes_values() -> Iterator[None]:
    """A list in a message is words one after the other, without Python's brackets and quotes."""
    make, told = UserError.__init__, set[str]()

    @wraps(make)
    def noting(self: UserError, *given: Any, **named: Any) -> None:
        make(self, *given, **named)
        if AS_PYTHON.search(str(self)):
            told.add(str(self))

    UserError.__init__ = noting
    yield
    UserError.__init__ = make
    assert not told


def _held_open(root: Path) -> set[str]:
    """What this process has open beneath a folder, as far as the system tells."""
    held = set[str]()
    for number in os.listdir("/proc/self/fd") if os.path.isdir("/proc/self/fd") else ():
        with suppress(OSError):  # it has just been closed, as the list itself
            held.add(os.readlink(f"/proc/self/fd/{number}"))
    # Whose work is found, or dies with its journal open, keeps its lock: many tests of journals end there.
    return {place for place in held if place.startswith(f"{root}{os.sep}") and os.path.basename(place) != LOCK}


@pytest.fixture(autouse=True)
def no_file_stays_open(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Every file that a test has opened is closed at its end, by whoever had it and not by chance."""
    root = tmp_path_factory.getbasetemp()
    before = _held_open(root)
    yield
    if left := _held_open(root) - before:
        gc.collect()
        left = _held_open(root) - before
    assert not left


@pytest.fixture(scope="module")
def collected() -> None:
    """What the tests of other modules have left is gone."""
    with warnings.catch_warnings(action="ignore"):
        gc.collect()


@pytest.fixture(scope="session")
def shared_device() -> Iterator[Device]:
    """One headless device for the whole test process.

    llvmpipe draws in the process's own thread: handing small passes to others costs up to a third more, and the tests'
    processes keep the cores busy anyway. What they start (the command line, test_fences.py, one of the windows) has
    threads.
    """
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("LP_NUM_THREADS", "0")
        device = Device.headless()
    yield device
    device.release()


@pytest.fixture
def device(shared_device: Device) -> Iterator[Device]:
    """The headless device; fails the test that leaves a GL error behind."""
    shared_device.use()  # the last test may have used one of its own
    assert shared_device.ctx.error == "GL_NO_ERROR"
    yield shared_device
    assert shared_device.ctx.error == "GL_NO_ERROR"


@pytest.fixture
def fluidwarp(device: Device, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Run:
    """`fluidwarp(folder, *words)` is the command line in that folder, without the start of a process and of GL."""
    monkeypatch.setattr(Device, "headless", classmethod(lambda kind: device))
    monkeypatch.setattr(device, "release", lambda: None)
    monkeypatch.setattr(typer.main, "get_command", COMMAND)

    def run(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
        status = 0
        with pytest.MonkeyPatch.context() as place, warnings.catch_warnings():
            place.chdir(folder)
            place.setattr(sys, "argv", ["fluidwarp", *words])
            warnings.simplefilter("error", RuntimeWarning)  # a process would tell it on stderr
            try:
                cli.main()
            except SystemExit as ended:
                status = int(ended.code or 0)
        assert status != BUG, capfd.readouterr().err
        return subprocess.CompletedProcess(words, status, *capfd.readouterr())

    return run

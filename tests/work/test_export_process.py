"""An export in a process of its own: what happens to it, the window hears of."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from app.media.pictures import read_picture
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.work.export_process import ExportProcess
from app.work.jobs import Job, Outputs

PICTURE = Path(__file__).parents[2] / "assets" / "pictures" / "coffee.png"
PATIENCE = 60.0  # seconds


@dataclass(frozen=True)
class Called:
    """Whoever unpickles it calls a function first."""

    what: Callable[..., Any]
    argument: Any

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any]]:
        return self.what, (self.argument,)


@dataclass(frozen=True)
class Dying(Job):
    """A job that kills its process before all of it is read, as the system does."""

    deadly: Any = None
    rest: bytes = b""

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        return Dying, (Called(signal.raise_signal, signal.SIGKILL), self.rest)


@dataclass(frozen=True)
class Slow(Job):
    """A job whose process takes its time to read it, and makes a file before it reads the rest."""

    slow: Path = Path()
    rest: bytes = b""

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        return Slow, (Called(make_late, self.slow), self.rest)


def make_late(file: Path) -> None:
    time.sleep(PATIENCE)
    file.touch()


def ended(process: ExportProcess, warn: Callable[[str], object] = lambda said: None) -> ExportProcess:
    deadline = time.monotonic() + PATIENCE
    while not process.is_done and time.monotonic() < deadline:
        process.poll(warn)
        time.sleep(0.01)
    assert process.is_done, "still at work"
    return process


def test_a_process_that_dies_while_it_gets_its_job_is_told_of(tmp_path: Path):
    """Nor does whoever started it wait, though the picture is more than a pipe holds."""
    picture = read_picture(PICTURE)
    job = Dying(Recipe(), picture, tmp_path, Outputs(tmp_path / "out.png"), rest=bytes(10_000_000))
    assert "stopped unexpectedly" in ended(ExportProcess(job)).error


def test_a_picture_larger_than_a_pipe_is_exported(tmp_path: Path):
    recipe = Recipe.parse("duration = 0.1\n[fluid]\ngrid = 16\n")
    process = ended(ExportProcess(Job(recipe, read_picture(PICTURE), tmp_path, Outputs(tmp_path / "out.png"))))
    assert process.error == ""
    assert (read_picture(tmp_path / "out.png").pixels == read_picture(PICTURE).pixels).all()


def test_what_is_told_before_the_work_is_heard_before_it_is_done_and_not_again(tmp_path: Path):
    force = "[[force]]\nkind = 'vortex'\npoint = [0.5, 0.5]\nradius = 0.3\nstrength = 5\n"
    recipe = Recipe.parse(f"duration = 0.02\n[fluid]\ngrid = 388\n{force}")
    small = Picture(np.zeros((48, 64, 3), np.uint8))
    process, heard = ExportProcess(Job(recipe, small, tmp_path, Outputs(tmp_path / "out.png"))), list[str]()

    def warn(said: str) -> None:
        assert not process.is_done
        heard.append(said)

    assert ended(process, warn).outcome.notices == ()
    (said,) = heard
    assert said.startswith("a grid of 388 cells is 6.06 times as fine as the picture")


def test_nobody_waits_for_one_that_is_stopped_also_while_its_process_is_getting_it(tmp_path: Path):
    """Nor does whoever starts it wait until it has got it. Whoever stops it hears when it has ended, which is soon."""
    picture, outputs, late = read_picture(PICTURE), Outputs(tmp_path / "out.png"), tmp_path / "late"
    job = Slow(Recipe(), picture, tmp_path, outputs, slow=late, rest=bytes(10_000_000))
    process, has_ended = ExportProcess(job), threading.Event()
    assert not late.exists()
    started = time.monotonic()
    process.stop(has_ended.set)
    assert time.monotonic() - started < 1
    assert has_ended.wait(PATIENCE / 2)

"""Many pictures by one recipe: failures, processes that die, a cluster that loses a worker, and parts of animations."""

from __future__ import annotations

import gc
import json
import os
import queue
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.errors import Cancelled, UserError
from app.media import files
from app.media.auxiliary import Pictures
from app.media.files import no_empty_folder
from app.media.pictures import read_picture, write_picture
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.progress import INTERRUPTED, Progress
from app.work import cluster, states, worker
from app.work.apply_job import Application, MapSource
from app.work.batch import run_batch
from app.work.fitting import Fit
from app.work.jobs import Job, MapOutput, Outputs
from app.work.replay import Replay
from app.work.tasks import Task, named, spread
from app.work.worker import Outcome, Status, Work, perform
from solver.gl.context import NoSuchDevice
from solver.gl.device import Device
from support.commands import Run

ROOT = Path(__file__).parents[2]
RECIPE = """
duration = 0.2
[fluid]
grid = 32
dt = 0.02
[[force]]
kind = "vortex"
point = [0.5, 0.5]
radius = 0.3
strength = 5
"""
FINE = RECIPE.replace("grid = 32", "grid = 388").replace("duration = 0.2", "duration = 0.02")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "a.toml").write_text(RECIPE)
    for number in range(6):
        draw(tmp_path / f"p{number}.png", number)
    return tmp_path


@pytest.fixture(autouse=True)
def _shared(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """One GL context for the whole test process: a second one would take the other tests' place."""
    monkeypatch.setattr(worker, "own_device", lambda: device)


def order(recipe: str | Path, picture: Path | None, outputs: Outputs) -> Task:
    return Task(recipe=str(recipe), edits={}, picture=picture, outputs=outputs)


def draw(path: Path, number: int, width: int = 64) -> None:
    y, x = np.mgrid[0:48, 0:width]
    write_picture(path, Picture(np.stack([x * 3, y * 4, (x + y + 40 * number) % 256], axis=-1).astype(np.uint8)))


def tasks(folder: Path, pictures: list[Path], **options: object) -> list[Task]:
    task = order(folder / "a.toml", None, Outputs(folder / "out", **options))  # type: ignore[arg-type]
    return spread(task, pictures)


def alone(folder: Path, pictures: list[Path]) -> dict[str, bytes]:
    """What each becomes on its own, in this process."""
    (folder / "alone").mkdir()
    made = {}
    for picture in pictures:
        output = folder / "alone" / picture.name
        assert perform(order(folder / "a.toml", picture, Outputs(output)), Progress()).error == ""
        made[picture.name] = output.read_bytes()
    return made


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if not path.name.startswith(".fluidwarp-frames")}


# Names --------------------------------------------------------------------------------------------------------------


def test_names_of_the_results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    task = order("coffee", None, Outputs(tmp_path / "new/out"))
    pictures = [Path(name) for name in ("a.JPG", "b.bmp", "c.mov", "d.avi")]
    made = [one.outputs.file for one in spread(task, pictures)]
    assert made == [tmp_path / "new/out" / name for name in ("a.JPG", "b.png", "c.mov", "d.mp4")]
    assert not (tmp_path / "new").exists()  # yet
    # A process elsewhere finds the recipe too: by its place, or by its name if it comes with the program.
    (tmp_path / "own.toml").write_text(RECIPE)
    monkeypatch.chdir(tmp_path)
    for recipe, wanted in (("coffee", "coffee"), ("own.toml", str(tmp_path / "own.toml"))):
        assert {one.recipe for one in spread(replace(task, recipe=recipe), pictures)} == {wanted}

    pattern = order("coffee", None, Outputs(tmp_path / "{name} new.tif", stats=tmp_path / "{name}.json"))
    (one,) = spread(pattern, [Path("x/e.png")])
    assert (one.outputs.file, one.outputs.stats) == (tmp_path / "e new.tif", tmp_path / "e.json")
    assert one.picture == Path("x/e.png").absolute()


@pytest.mark.parametrize(
    ("pattern", "picture", "name"),
    [
        ("{name}.png", "cat.jpg", "cat.png"),
        ("{name}.%04d.png", "cat.jpg", "cat.%04d.png"),
        ("{name}.png", "cat.%d.jpg", "cat.%d.png"),
        ("{name}.PNG", "cat.%d.JPG", "cat.%d.PNG"),
        ("{name}.mp4", "cat.%d.jpg", "cat.mp4"),
        ("{name}.MP4", "cat.%d.jpg", "cat.MP4"),
        ("{name}.png", "one%d.jpg", None),
        ("{name}.mp4", "one%d.jpg", None),
        ("out.png", "one%d.jpg", "out.png"),
        ("f.%d.png", "one%d.jpg", "f.%d.png"),
    ],
)
def test_only_of_a_sequence_or_where_it_is_asked_for_files_are_numbered(
    tmp_path: Path, pattern: str, picture: str, name: str | None
) -> None:
    (tmp_path / "one%d.jpg").touch()  # which is a file of that name, and stands for no others
    if name is None:
        with pytest.raises(UserError, match=r"named after one%d\.jpg would be a sequence of numbered files"):
            named(tmp_path / pattern, tmp_path / picture)
    else:
        assert named(tmp_path / pattern, tmp_path / picture) == tmp_path / name


def paths_in(value: object) -> list[Path]:
    if is_dataclass(value):
        return [path for field in fields(value) for path in paths_in(getattr(value, field.name))]
    return [value] if isinstance(value, Path) else []


def test_what_a_process_elsewhere_is_given_depends_on_no_present_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    maps = MapOutput(Path("{name}.npy"), kind="offsets", forward=True, overscan=2, size=9)
    outputs = Outputs(Path("out"), Path("{name}.json"), maps, states=Path("states"), bits=16, strip=True)
    given = MapSource(Path("m.npy"), "offsets", "corners", 3, 99)
    for piece in (
        replace(order("coffee", None, outputs), max_pixels=99),
        Application(maps=given, outputs=outputs, picture=None, edges="wrap", size=9, quality=7, fps=5, max_pixels=99),
    ):
        (found,) = spread(piece, [Path("in/a.png")])
        made = [Path("in/a.png"), Path("out/a.png"), Path("a.json"), Path("a.npy"), Path("states"), Path("out")]
        assert set(paths_in(found)) == {tmp_path / path for path in (*made, *paths_in(getattr(piece, "maps", None)))}
        back = replace(
            found, picture=None, folder=None, outputs=outputs,
            **({"maps": replace(found.maps, path=given.path)} if isinstance(found, Application) else {}),
        )  # fmt: skip
        assert back == piece
        there = replace(outputs, file=found.outputs.file, stats=found.outputs.stats, states=found.outputs.states)
        assert found.outputs.maps is not None
        assert found.outputs == replace(there, maps=replace(maps, path=found.outputs.maps.path))


@pytest.mark.parametrize(
    ("output", "pictures", "message"),
    [
        ("out", ["a/x.png", "b/x.png"], "would both become"),
        (".", ["x.png", "y.png"], "replaced by its own result"),
        ("x.png", ["a.png", "b.png"], r"^2 pictures cannot all become x\.png; write a folder, or out/\{name\}\.png$"),
        ("x.png", ["a.png"], r"^a picture of a cluster cannot become x\.png; write a folder, or out/\{name\}\.png$"),
        ("{name}-w.png", ["a.png", "a-w.png"], "a-w.png would be replaced by what a.png becomes"),
    ],
)
def test_names_that_cannot_be(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, output: str, pictures: list[str], message: str
):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UserError, match=message):
        spread(order("coffee", None, Outputs(Path(output))), [Path(name) for name in pictures])


def test_a_folder_that_is_there_may_have_a_dot_in_its_name(tmp_path: Path):
    """While one that is not there would be a file."""
    task = order("coffee", None, Outputs(tmp_path / "shots.v2"))
    pictures = [Path("in/a.png"), Path("in/b.png")]
    with pytest.raises(UserError, match=r"2 pictures cannot all become .*shots\.v2"):
        spread(task, pictures)
    (tmp_path / "shots.v2").mkdir()
    made = [one.outputs.file for one in spread(task, pictures)]
    assert made == [tmp_path / "shots.v2" / name for name in ("a.png", "b.png")]


def test_one_file_of_numbers_for_many_pictures_is_refused(tmp_path: Path):
    with pytest.raises(UserError, match=r"put \{name\} into its name"):
        spread(order("coffee", None, Outputs(tmp_path, stats=tmp_path / "s.json")), [Path("a.png"), Path("b.png")])


@pytest.mark.parametrize("name", ["file", "file/out", "file/out/deeper"])
def test_a_folder_that_cannot_be_made_is_told_once_before_any_picture_is_read(
    folder: Path, fluidwarp: Run, name: str
) -> None:
    (folder / "file").touch()
    ran = fluidwarp(folder, "render", "a.toml", "p0.png", "gone.png", "-o", name)
    assert ran.returncode == 1
    assert re.fullmatch(rf"fluidwarp: Cannot write {name}: .*file.*\n", ran.stderr)


def test_numbers_of_two_pictures_in_one_file_are_refused(tmp_path: Path):
    with pytest.raises(UserError, match="would both become"):
        spread(
            order("coffee", None, Outputs(tmp_path, stats=tmp_path / "{name}.json")),
            [Path("a.png"), Path("a.jpg")],
        )


def test_an_error_is_told_in_the_words_of_the_command_line_and_of_the_window(folder: Path):
    task = replace(order(folder / "a.toml", folder / "p0.png", Outputs(folder / "w.png")), max_pixels=3071)
    told = perform(task, Progress())
    start = f"Cannot read {folder / 'p0.png'}: 64 x 48 pixels are more than the limit of 3071;"
    assert told.error == f"{start} if you trust the file, raise it with --max-pixels 3072."
    assert told.in_window == f"{start} make it smaller first."


# One after the other, and in processes ------------------------------------------------------------------------------


def test_a_missing_device_is_told_as_it_is(folder: Path, monkeypatch: pytest.MonkeyPatch):
    def none() -> Device:
        raise NoSuchDevice(7, 1)

    monkeypatch.setattr(worker, "own_device", none)
    told = perform(order(folder / "a.toml", folder / "p0.png", Outputs(folder / "x.png")), Progress())
    assert told.error == told.in_window == "graphics device 7 is not there; there is only 0"


@pytest.mark.parametrize(
    ("error", "told", "in_window"),
    [
        (UserError("it is so", in_window="so it is"), "it is so", "so it is"),
        (
            MemoryError(),
            "there is not enough memory for it; use fewer --jobs or a smaller --size",
            "there is not enough memory for it; choose a smaller size",
        ),
        (ValueError("one\n  two"), "ValueError: one two", "{} failed: one two"),
        (KeyError(), "KeyError: no reason given", "{} failed: no reason given"),
        (Cancelled(), None, None),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, Exception) else "",
)
def test_whatever_goes_wrong_with_a_piece_of_work_is_told_in_a_line(
    folder: Path, monkeypatch: pytest.MonkeyPatch, error: Exception, told: str | None, in_window: str | None
):
    """Of each kind of work; a fit that is stopped before it has found anything tells nothing."""

    def failing() -> Device:
        raise error

    monkeypatch.setattr(worker, "own_device", failing)
    picture, recipe, outputs = read_picture(folder / "p0.png"), Recipe.parse(RECIPE), Outputs(folder / "x.png")
    works: list[tuple[Work, str]] = [
        (order(folder / "a.toml", folder / "p0.png", outputs), "The export"),
        (Job(recipe, picture, folder, outputs), "The export"),
        (Fit(recipe, picture, folder), "The fit"),
    ]
    for work, what in works:
        if told is not None and in_window is not None:
            assert perform(work, Progress()) == Outcome(work.label, told, in_window.format(what))
        elif isinstance(work, Fit):
            assert perform(work, Progress()) == Outcome(work.label)
        else:
            with pytest.raises(Cancelled):
                perform(work, Progress())


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="counts threads as Linux tells them")
@pytest.mark.parametrize("first", ["app.cli", "app.work.worker"])
def test_linear_algebra_has_one_thread(first: str):
    """Of the command line and of its processes, whatever loads NumPy first."""
    telling = f"import {first}, numpy as np, os; np.eye(400) @ np.eye(400); print(len(os.listdir('/proc/self/task')))"
    bare = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    ran = subprocess.run(
        [sys.executable, "-c", telling], cwd=ROOT, env=bare, capture_output=True, text=True, check=True
    )
    assert int(ran.stdout) == 1


@pytest.mark.parametrize("jobs", [1, 2])
def test_one_that_fails_does_not_stop_the_others(folder: Path, jobs: int):
    """A line for each, and the same bytes as each gets alone."""
    good = [folder / f"p{number}.png" for number in range(3)]
    (folder / "cut.png").write_bytes(good[0].read_bytes()[:50])
    heard: list[Outcome] = []
    pictures = [good[0], folder / "cut.png", good[1], folder / "gone.png", good[2]]
    failures = run_batch(tasks(folder, pictures), heard.append, Progress(), jobs)
    assert failures == 2
    assert {Path(outcome.label).name: bool(outcome.error) for outcome in heard} == {
        "p0.png": False, "cut.png": True, "p1.png": False, "gone.png": True, "p2.png": False,
    }  # fmt: skip
    assert all(Path(outcome.label).name in outcome.error for outcome in heard if outcome.error)
    assert contents(folder / "out") == alone(folder, good)


def test_a_grid_far_finer_than_a_picture_is_told_before_that_picture_is_done(folder: Path):
    """It came with the first that was done."""
    (folder / "a.toml").write_text(FINE)
    order = list[tuple[str, str]]()
    run_batch(
        tasks(folder, [folder / "p0.png", folder / "p1.png"]),
        lambda outcome: order.append((outcome.label, "".join((*outcome.notices, outcome.error)))),
        Progress(),
        warn=lambda label, said: order.append((label, said)),
    )
    assert [Path(label).name for label, _ in order] == ["p0.png", "p0.png", "p1.png", "p1.png"]
    for (_, told), (_, done) in zip(order[::2], order[1::2], strict=True):
        assert told.startswith("a grid of 388 cells is 6.06 times as fine as the picture of 64 x 48 pixels")
        assert done == "", "nor is it told again"


def test_a_process_that_dies_is_replaced(folder: Path, monkeypatch: pytest.MonkeyPatch):
    """Killed as for want of memory: whatever it had is done by another; what kills each of them is told."""
    monkeypatch.setattr(worker, "SERVING", "import support.dying as d, app.work.worker as w; w.serve(d.dying)")
    pictures = [folder / f"p{number}.png" for number in range(4)]
    heard: list[Outcome] = []
    assert run_batch(tasks(folder, pictures), heard.append, Progress(), 3) == 1
    told = {Path(outcome.label).name: outcome.error for outcome in heard}
    assert sorted(told) == [path.name for path in pictures]
    assert [name for name, error in told.items() if error] == ["p3.png"]
    assert told["p3.png"] == worker.DIED
    # What has died is tried again when no other has anything in memory.
    assert {path.name: path.read_text() for path in folder.glob("*.beside")} == {"p0.beside": "0", "p3.beside": "0"}


def test_cancelling_leaves_what_is_finished(folder: Path):
    pictures = [folder / f"p{number}.png" for number in range(4)]
    heard: list[Outcome] = []
    with pytest.raises(Cancelled):
        run_batch(tasks(folder, pictures), heard.append, Progress(cancel=lambda: len(heard) >= 2))
    assert sorted(contents(folder / "out")) == ["p0.png", "p1.png"]


def test_the_command_line(folder: Path, fluidwarp: Run):
    """Two processes, a failure, a line about it, a status; and with nothing wrong, not a word."""

    def render(*words: str) -> subprocess.CompletedProcess[str]:
        return fluidwarp(folder, "render", "a.toml", *words)

    ran = render("p0.png", "gone.png", "p1.png", "-o", "out", "--jobs", "2")
    assert ran.returncode == 1
    assert ran.stderr.splitlines() == [
        f"fluidwarp: Cannot read {folder / 'gone.png'}: there is no such file; check the name.",
        "fluidwarp: 1 of 3 pictures failed; all others are written",
    ]
    assert sorted(contents(folder / "out")) == ["p0.png", "p1.png"]
    gone = [*(f"gone.{number}.png" for number in (1001, 1002, 1003, 1010)), "new\nline.png"]
    ran = render(*gone, "-o", "new/folder")
    assert ran.returncode == 1
    assert ran.stderr.splitlines() == [
        f"fluidwarp: Cannot read {folder / gone[0]}: there is no such file; check the name.",
        r"fluidwarp: 5 of 5 pictures failed: gone.1001-1003,1010.png, new\nline.png; none is written",
    ]
    assert not (folder / "new").exists()
    (folder / "empty.png").write_bytes(b"")
    ran = render("gone.png", "p0.png", "empty.png", "-o", "out")
    named = "gone.png, empty.png; --verbose tells why"
    assert ran.stderr.splitlines()[1:] == [f"fluidwarp: 2 of 3 pictures failed: {named}; all others are written"]
    ran = render("gone.png", "p0.png", "empty.png", "-o", "out", "--verbose")
    assert ran.stderr.splitlines() == [
        f"fluidwarp: Cannot read {folder / 'gone.png'}: there is no such file; check the name.",
        f"fluidwarp: Cannot read {folder / 'empty.png'}: the file is empty; save or download it again.",
        "fluidwarp: 2 of 3 pictures failed: gone.png, empty.png; all others are written",
    ]
    letters = [f"{letter}.png" for letter in "abcdefghij"]
    ran = render(*letters, "-o", "new")
    assert ran.stderr.endswith("h.png and 2 more; --verbose tells all names; none is written\n")
    ran = render(*letters, "-o", "new", "--verbose")
    assert [line.partition(": there is")[0] for line in ran.stderr.splitlines()[:-1]] == [
        f"fluidwarp: Cannot read {folder / name}" for name in letters
    ]
    assert ran.stderr.endswith("h.png and 2 more; none is written\n")
    ran = render("gone.png", "-o", "out")
    assert ran.returncode == 1
    assert ran.stderr == f"fluidwarp: Cannot read {folder / 'gone.png'}: there is no such file; check the name.\n"
    ran = render("p0.png", "p1.png", "-o", "a.toml/out")
    assert ran.stderr == "fluidwarp: Cannot write a.toml/out: a part of its path is a file; choose another folder.\n"
    ran = render("p2.png", "-o", "out")
    assert (ran.returncode, ran.stdout, ran.stderr) == (0, "", "")
    assert (folder / "out/p2.png").is_file()
    (folder / "a.toml").write_text(FINE)
    ran = render("p2.png", "p3.png", "-o", "fine", "--jobs", "2", "--verbose")
    for line, name in zip(sorted(ran.stderr.splitlines()), ("p2.png", "p3.png"), strict=True):
        assert line.startswith(f"fluidwarp: {folder / name}: a grid of 388 cells is 6.06 times as fine as the picture")


def at_work(folder: Path) -> subprocess.Popen[str]:
    """Four pictures in two processes, each of which takes a minute; a session of its own, as a terminal's job is."""
    (folder / "a.toml").write_text(RECIPE.replace("duration = 0.2", "duration = 200"))
    words = ["render", "a.toml", "p0.png", "p1.png", "p2.png", "p3.png", "-o", "{name}.mp4", "--jobs", "2"]
    return subprocess.Popen(
        [sys.executable, "-m", "app", *words],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_DFL),  # the tests may have been begun by nohup
    )


def workers(of: int) -> list[int]:
    """The processes that any thread of a process has started to work in."""
    found = []
    for children in Path(f"/proc/{of}/task").glob("*/children"):
        with suppress(FileNotFoundError, ProcessLookupError):  # it has ended since, before it is opened or after
            for pid in children.read_text().split():
                if b"serve()" in Path(f"/proc/{pid}/cmdline").read_bytes():
                    found.append(int(pid))
    return found


def wait_until(true: Callable[[], object]) -> None:
    asked = time.monotonic()
    while not true():
        assert time.monotonic() < asked + 180  # for a busy machine
        time.sleep(0.02)


@pytest.mark.parametrize(
    ("number", "moment"),
    [
        (signal.SIGINT, "starting"),
        (signal.SIGINT, "working"),
        (signal.SIGTERM, "working"),
        (signal.SIGHUP, "working"),
        (signal.SIGTERM, "a worker was killed"),
    ],
)
def test_stopping_all_processes_at_once(folder: Path, number: signal.Signals, moment: str):
    """As Ctrl+C, a scheduler and a closed terminal do, at any time: one line, and nothing half-written."""
    job = at_work(folder)
    before = {*contents(folder)}
    wait_until(lambda: workers(job.pid))
    if moment != "starting":
        wait_until(lambda: len({*contents(folder)} - before) == 2)
    if moment == "a worker was killed":
        killed = workers(job.pid)[0]
        os.kill(killed, signal.SIGKILL)
        wait_until(
            lambda: len(workers(job.pid)) == 2 and killed not in workers(job.pid)
        )  # another has begun the next picture
    os.killpg(job.pid, number)
    try:
        _, told = job.communicate(timeout=30)
    except subprocess.TimeoutExpired:  # it would go on for minutes, beside all other tests
        os.killpg(job.pid, signal.SIGKILL)
        raise
    line = "fluidwarp: cancelled; 0 of 4 pictures are written, nothing is half-written\n"
    assert (job.returncode, told) == (INTERRUPTED, line)
    left = {*contents(folder)} - before
    assert all(name.startswith(".") for name in left)
    assert len(left) <= (moment == "a worker was killed")  # what is killed outright cannot clean up after itself


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGHUP])
def test_what_a_terminal_tells_all_of_its_processes_the_ones_that_work_do_not_hear(
    folder: Path, number: signal.Signals
):
    """The one that waits for them hears it, and says what becomes of them."""
    inbox, before = queue.SimpleQueue[Any](), {*workers(os.getpid())}
    one = worker.Worker(inbox)
    try:
        (pid,) = {*workers(os.getpid())} - before
        os.kill(pid, number)
        one.begin(order(folder / "a.toml", folder / "p0.png", Outputs(folder / "out.png")))
        said: Any = Status(0.0, "")
        while isinstance(said, Status):
            wait_until(lambda: not inbox.empty())
            said = inbox.get()[1]
            os.kill(pid, number)
    finally:
        one.end()
    assert said is not None
    assert said.error == ""
    assert (folder / "out.png").exists()


# A cluster ----------------------------------------------------------------------------------------------------------


def test_without_dask_a_cluster_is_a_sentence_with_the_status_of_wrong_words(
    folder: Path, fluidwarp: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    ran = fluidwarp(folder, "render", "a.toml", "p0.png", "-o", "out", "--cluster", "tcp://127.0.0.1:1")
    assert ran.stderr == "fluidwarp: a cluster needs Dask; install it with: pip install 'fluidwarp[cluster]'\n"
    assert ran.returncode == 2
    assert not (folder / "out").exists()


def test_a_cluster_loses_a_worker_and_nothing_else(folder: Path):
    """Two worker processes, one of them killed at work, with answers that nobody has fetched yet: every picture comes
    out as it does alone."""
    distributed = pytest.importorskip("distributed")
    pictures = []
    for number in range(8):
        pictures.append(folder / f"q{number}.png")
        draw(pictures[-1], number, width=80)
    expected = alone(folder, pictures)
    (folder / "a.toml").write_text(RECIPE)
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address=None
    ) as cluster:
        victim, other = cluster.workers[0], cluster.workers[1]
        address = victim.worker_address
        heard, fine = list[Outcome](), list[str]()

        def hear(outcome: Outcome) -> None:
            heard.append(outcome)
            if len(heard) == 1:
                wait_until(lambda: len(finished(folder / "out")) >= 6)
                os.kill(other.pid, signal.SIGSTOP)  # what is lost is not done again at once
                os.kill(victim.pid, signal.SIGKILL)
                wait_until(lambda: address not in cluster.scheduler.workers)
                threading.Timer(0.5, os.kill, (other.pid, signal.SIGCONT)).start()

        failures = run_batch(tasks(folder, pictures), hear, Progress(), cluster=cluster.scheduler_address)
        # What is cancelled at work is not gone on with: its process ends, while one without work is kept.
        (folder / "a.toml").write_text(RECIPE.replace("duration = 0.2", "duration = 200"))
        endless = spread(order(folder / "a.toml", None, Outputs(folder / "{name}.%04d.png")), pictures[:1])
        at_work: list[list[int]] = []

        def has_begun() -> bool:
            at_work.append([pid for one in cluster.workers.values() for pid in workers(one.pid)])
            return (folder / "q0.0000.png").exists()

        (folder / "b.toml").write_text(FINE)
        one = spread(order(folder / "b.toml", None, Outputs(folder / "fine")), pictures[:1])
        run_batch(
            one,
            lambda outcome: fine.extend((*outcome.notices, "done")),
            Progress(),
            cluster=cluster.scheduler_address,
            warn=lambda label, said: fine.append(f"{Path(label).name}: {said[:24]}"),
        )
        with pytest.raises(Cancelled):
            run_batch(endless, hear, Progress(cancel=has_begun), cluster=cluster.scheduler_address)
        wait_until(lambda: not all(Path(f"/proc/{pid}").exists() for pid in at_work[-1]))
    assert failures == 0, [outcome.error for outcome in heard if outcome.error]
    assert fine == ["q0.png: a grid of 388 cells is 4", "done"], "before it takes its time"
    assert sorted(Path(outcome.label).name for outcome in heard) == sorted(expected)
    written = {name: data for name, data in contents(folder / "out").items() if not name.startswith(".")}
    assert written == expected  # what was killed in the middle of writing may have left its hidden file


def test_no_cluster_is_told(folder: Path, monkeypatch: pytest.MonkeyPatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(cluster, "CONNECTING", 1)
    with pytest.raises(UserError, match=r"no Dask scheduler answers at tcp://127\.0\.0\.1:9"):
        run_batch(tasks(folder, [folder / "p0.png"]), lambda outcome: None, Progress(), cluster="tcp://127.0.0.1:9")


@pytest.mark.parametrize(
    ("address", "words"),
    [
        ("http://127.0.0.1:9", "an address begins with tcp://"),
        ("inproc://x", "an address begins with tcp://"),
        ("127.0.0.1", "missing port number"),
        ("tcp://127.0.0.1:99999", "there is no such port"),
        ("tls://127.0.0.1:9", "no Dask scheduler answers"),
        ("", "no Dask scheduler answers"),
    ],
)
def test_a_wrong_address_is_told(folder: Path, address: str, words: str, capfd: pytest.CaptureFixture[str]):
    pytest.importorskip("distributed")
    with pytest.raises(UserError, match=re.escape(words)):
        run_batch(tasks(folder, [folder / "p0.png"]), lambda outcome: None, Progress(), cluster=address)
    gc.collect()  # what is half made may complain when it goes
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    "answer", [b"", b"HTTP/1.1 400 Bad Request\r\n\r\n", b"\0" * 100], ids=["silence", "HTTP", "noise"]
)
def test_what_is_no_scheduler_is_told(
    folder: Path, answer: bytes, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
):
    """Something else answers there, or takes the call and is silent."""
    pytest.importorskip("distributed")
    monkeypatch.setattr(cluster, "CONNECTING", 1)
    with socket.create_server(("127.0.0.1", 0)) as server:
        kept: list[socket.socket] = []

        def serve() -> None:
            with suppress(OSError):
                while True:
                    kept.append(server.accept()[0])
                    kept[-1].sendall(answer)

        threading.Thread(target=serve, daemon=True).start()
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        with pytest.raises(UserError, match=f"no Dask scheduler answers at {address}"):
            run_batch(tasks(folder, [folder / "p0.png"]), lambda outcome: None, Progress(), cluster=address)
        for connection in kept:
            connection.close()
    gc.collect()
    assert capfd.readouterr().err == ""


def test_a_scheduler_without_workers_and_one_that_dies_are_told(folder: Path):
    """A sentence each, and the number of pictures that are written."""
    pytest.importorskip("distributed")
    (folder / "a.toml").write_text(RECIPE.replace("duration = 0.2", "duration = 4"))
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    pictures = [f"p{number}.png" for number in range(6)]
    with ExitStack() as running:

        def start(*words: str, **options: Any) -> subprocess.Popen[str]:
            command = [sys.executable, "-m", *words]
            process = subprocess.Popen(command, cwd=folder, env=environment, text=True, **options)
            running.callback(process.wait)
            running.callback(process.kill)
            return process

        quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        local = ["--host", "127.0.0.1", "--no-dashboard"]
        scheduler = start("dask", "scheduler", *local, "--port", "0", "--scheduler-file", "where.json", **quiet)
        wait_until((folder / "where.json").exists)
        address = json.loads((folder / "where.json").read_text())["address"]
        job = start("app", "render", "a.toml", *pictures, "-o", "out", "--cluster", address, stderr=subprocess.PIPE)
        assert job.stderr is not None
        assert job.stderr.readline() == (
            f"fluidwarp: the Dask scheduler at {address} has no worker, and is waited for; "
            f"start one with: dask worker {address}\n"
        )
        assert not (folder / "out").exists()  # nothing has been read yet
        worker = start("dask", "worker", address, *local, "--nthreads", "1", "--no-nanny", **quiet)
        wait_until(lambda: len(finished(folder / "out")) >= 2)
        scheduler.kill()
        _, told = job.communicate(timeout=60)
        worker.terminate()
        worker.wait(60)
    assert job.returncode == 1
    found = re.fullmatch(
        rf"fluidwarp: the Dask scheduler at {address} is gone; (\d) of 6 pictures are written, and its workers may "
        r"still finish what they have in hand; start it again, and then this for the others\n",
        told.splitlines(keepends=True)[-1],  # before it, what was written had folds to tell of
    )
    assert found, told
    assert 2 <= int(found[1]) <= len(finished(folder / "out")) < 6


def finished(folder: Path) -> list[str]:
    """The pictures in a folder, if it has been made."""
    return [path.name for path in folder.glob("[!.]*")]


# Parts of an animation ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("playback", ["", "[time]\nping_pong = true\nhold_first = 0.1", "[time]\nreverse = true"])
def test_the_parts_are_the_whole(folder: Path, playback: str):
    """Bit for bit, and numbered as in the whole: so that a scheduler can split one animation into many jobs."""
    (folder / "b.toml").write_text(f"{RECIPE}[output]\nfps = 30\n{playback}\n")
    whole, parts = folder / "whole", folder / "parts"
    for path in (whole, parts):
        path.mkdir()
    recipe, picture = str(folder / "b.toml"), folder / "p0.png"
    assert perform(order(recipe, picture, Outputs(whole / "f.%03d.png")), Progress()).error == ""
    count = len(contents(whole))
    for first in range(0, count, 4):
        outcome = perform(order(recipe, picture, Outputs(parts / "f.%03d.png", part=(first, first + 3))), Progress())
        assert outcome.error == ""
    assert contents(parts) == contents(whole)
    told = perform(order(recipe, picture, Outputs(parts / "f.%03d.png", part=(count, None))), Progress())
    assert f"the frames 0-{count - 1}, and none from {count} on" in told.error
    assert read_picture(whole / "f.000.png").pixels.shape == (48, 64, 3)


# Stored states ------------------------------------------------------------------------------------------------------

WORK = {
    "forces": RECIPE,
    "paper": RECIPE.replace("grid = 32", 'grid = 32\nsolver = "paper"'),
    "density": 'mode = "density"' + RECIPE,
    "strokes": RECIPE
    + """
[[change]]
tick = 4
viscosity = 0.01
[[stroke]]
tool = "thicken"
radius = 0.2
samples = [[1, 0.3, 0.5, 1.0], [6, 0.6, 0.5, 1.0]]
[[stroke]]
tool = "freeze"
radius = 0.1
samples = [[2, 0.7, 0.3, 1.0], [3, 0.7, 0.4, 1.0]]
[[stroke]]
tool = "push"
radius = 0.2
samples = [[1, 0.3, 0.5, 1.0], [9, 0.7, 0.5, 1.0]]
""",
}


def part(
    folder: Path, output: str, first: int, last: int | None, recipe: str = "b.toml", **options: Any
) -> tuple[int, Outcome]:
    """A part of the animation in a folder of its own, and how many steps were simulated for it."""
    (folder / output).mkdir(exist_ok=True)
    outputs = Outputs(folder / output / "f.%03d.png", part=(first, last), **options)
    task = order(folder / recipe, folder / "p0.png", outputs)
    steps: list[int] = []
    advance = Replay.advance
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(Replay, "advance", lambda replay: (steps.append(replay.tick), advance(replay))[1])
        outcome = perform(task, Progress())
    return len(steps), outcome


@pytest.mark.parametrize("work", WORK)
def test_a_part_begins_with_the_nearest_stored_state(folder: Path, work: str, monkeypatch: pytest.MonkeyPatch):
    """And comes to the same bytes: frames between the ticks, painted masks, the folds of the map, other solvers."""
    monkeypatch.setattr(states, "EVERY", 3)
    (folder / "b.toml").write_text(WORK[work] + "[output]\nfps = 70\n")
    assert part(folder, "whole", 0, None)[1].error == ""
    count, kept = len(contents(folder / "whole")), folder / "states"
    assert count == 15
    taken = [part(folder, "parts", first, first + 3, states=kept) for first in range(0, count, 4)]
    assert [outcome for _, outcome in taken] == [Outcome(str(folder / "p0.png"))] * 4
    assert [steps for steps, _ in taken] == [2, 3, 2, 3]  # together the ticks of the whole
    assert contents(folder / "parts") == contents(folder / "whole")
    assert {3, 6, 9} <= {int(path.name.split("-")[1][:7]) for path in kept.iterdir()}
    # Out of order, and again when all is there.
    again = [part(folder, "again", first, first + 3, states=kept)[0] for first in (12, 4, 0, 8)]
    assert again == [3, 3, 2, 2]
    assert contents(folder / "again") == contents(folder / "whole")


def test_another_process_takes_the_same_states(folder: Path):
    """Python hashes texts otherwise in each."""
    (folder / "b.toml").write_text(RECIPE)
    assert part(folder, "one", 0, None, states=folder / "states")[1].error == ""
    stored = {path.name for path in (folder / "states").iterdir()}
    words = ["render", "b.toml", "p0.png", "-o", "two/f.%03d.png", "--states", "states"]
    (folder / "two").mkdir()
    environment = os.environ | {"PYTHONPATH": str(ROOT), "PYTHONHASHSEED": "1"}
    subprocess.run([sys.executable, "-m", "app", *words], cwd=folder, env=environment, check=True)
    assert stored
    assert {path.name for path in (folder / "states").iterdir()} == stored
    assert contents(folder / "one") == contents(folder / "two")


def test_states_of_something_else_are_not_taken(folder: Path, monkeypatch: pytest.MonkeyPatch):
    """Another recipe, another picture, another grid, a damaged file, one under another's name."""
    monkeypatch.setattr(states, "EVERY", 2)
    kept = folder / "states"

    def fresh(name: str, recipe: str) -> tuple[int, Outcome]:
        (folder / f"{name}.toml").write_text(recipe)
        part(folder, f"{name}-alone", 5, 6, f"{name}.toml")
        found = part(folder, name, 5, 6, f"{name}.toml", states=kept)
        assert found[1].error == ""
        assert contents(folder / name) == contents(folder / f"{name}-alone")
        return found

    whole = fresh("first", RECIPE)[0]
    assert whole == fresh("strength", RECIPE.replace("strength = 5", "strength = 4"))[0] == 10
    assert fresh("grid", RECIPE.replace("grid = 32", "grid = 40"))[0] == whole
    assert fresh("named", f'name = "another name"{RECIPE}')[0] == 2
    draw(folder / "p0.png", 7)  # the fluid does not look at it here, but it could
    assert fresh("picture", RECIPE)[0] == whole
    draw(folder / "p0.png", 0)
    for path in kept.iterdir():
        data = bytearray(path.read_bytes())
        data[len(data) // 2] ^= 1
        path.write_bytes(data[: len(data) // 3] if "08" in path.name else data)
    steps, outcome = fresh("damaged", RECIPE)
    assert steps == whole
    assert len(outcome.notices) == 4  # of the ticks 8, 6, 4 and 2
    assert all("is damaged" in notice and "made anew" in notice for notice in outcome.notices)
    assert fresh("mended", RECIPE) == (2, Outcome(str(folder / "p0.png")))
    named = {path.name[-17:-10]: path for path in kept.glob(f"{newest(kept).name[:32]}-*")}
    named["0000008"].unlink()
    named["0000002"].rename(str(named["0000002"]).replace("0000002", "0000007"))
    with np.load(named["0000006"]) as stored:
        parts = dict(stored)
    np.savez_compressed(named["0000006"], **parts)  # which may have any number of bytes in it
    steps, outcome = fresh("misnamed", RECIPE)
    assert steps == 6  # from 4
    told = ["it is of another simulation", "it is compressed"]
    assert [[why in notice for why in told] for notice in outcome.notices] == [[True, False], [False, True]]


def test_states_of_another_driver_or_version_of_it_are_not_taken(
    device: Device, folder: Path, monkeypatch: pytest.MonkeyPatch
):
    def stored() -> tuple[Replay, states.StoredStates]:
        replay = Replay(device, Recipe.parse(RECIPE), Pictures(read_picture(folder / "p0.png")), budget=0)
        return replay, states.StoredStates(folder / "states", replay, pytest.fail)

    replay, kept = stored()
    replay.seek(2)
    kept.keep(last=True)
    replay.release()
    for change, is_found in (({}, True), ({"renderer": "another"}, False), ({"version": "another"}, False)):
        with monkeypatch.context() as driver:
            driver.setattr(device, "limits", replace(device.limits, **change))
            replay, kept = stored()
            assert kept.resume(5) is is_found
            replay.release()


def test_a_state_that_stands_under_another_simulation_s_name_is_not_taken(device: Device, folder: Path):
    told, files = list[str](), list[Path]()
    for strength in (5, 4, 4):
        recipe = Recipe.parse(RECIPE.replace("strength = 5", f"strength = {strength}"))
        replay = Replay(device, recipe, Pictures(read_picture(folder / "p0.png")), budget=0)
        kept = states.StoredStates(folder / "states", replay, told.append)
        if len(files) < 2:
            replay.seek(2)
            kept.keep(last=True)
            files += [path for path in (folder / "states").iterdir() if path not in files]
        else:
            files[1].write_bytes(files[0].read_bytes())
            assert not kept.resume(2)
        replay.release()
    assert told == [f"{files[1]} is damaged (it is of another simulation) and is made anew"]


def test_a_state_is_kept_every_64_ticks_and_at_the_end(device: Device, folder: Path):
    still = Recipe.parse("duration = 10\nfluid = { grid = 8 }\n")
    replay = Replay(device, still, Pictures(read_picture(folder / "p0.png")), budget=0)
    kept = states.StoredStates(folder / "states", replay, pytest.fail)
    for _ in range(130):
        kept.keep()
        replay.advance()
    kept.keep(last=True)
    assert sorted(int(path.name[-17:-10]) for path in (folder / "states").iterdir()) == [64, 128, 130]
    there = newest(folder / "states")  # and somebody's copy of one, under a name that is no tick
    there.with_name(there.name.replace("0000130", "copy-of-1")).write_bytes(there.read_bytes())
    for wanted, found in ((63, None), (127, 64), (129, 128), (200, 130)):
        other = Replay(device, still, Pictures(read_picture(folder / "p0.png")), budget=0)
        assert states.StoredStates(folder / "states", other, pytest.fail).resume(wanted) == (found is not None)
        assert other.tick == (found or 0)
        other.release()
    replay.release()


def newest(folder: Path) -> Path:
    return max(folder.iterdir(), key=lambda path: path.stat().st_mtime)


def test_a_folder_of_states_is_bounded_and_may_be_full(folder: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(states, "EVERY", 1)
    (folder / "b.toml").write_text(RECIPE)
    part(folder, "out", 0, None, states=folder / "all")
    sizes = [path.stat().st_size for path in (folder / "all").iterdir()]
    assert len(sizes) == 10
    monkeypatch.setattr(states, "BUDGET", 4 * max(sizes))
    part(folder, "bounded", 0, None, states=folder / "some")
    assert sorted(path.name[-17:] for path in (folder / "some").iterdir()) == [
        f"{tick:07d}.state.npz" for tick in (7, 8, 9, 10)
    ]
    (folder / "file").touch()
    assert "Cannot write" in part(folder, "none", 0, 1, states=folder / "file")[1].error

    def full(path: Path) -> Path:
        if not path.name.endswith(".npz"):
            return path.with_name(f".{path.name}")
        temporary = path.with_name(f".full{path.suffix}")
        temporary.symlink_to("/dev/full")
        return temporary

    monkeypatch.setattr(files, "temporary_beside", full)
    outcome = part(folder, "full", 0, None, states=folder / "disk")[1]
    assert outcome.error == ""
    assert len(outcome.notices) == 1
    assert "No more states are kept" in outcome.notices[0]
    assert "the disk is full" in outcome.notices[0]
    assert contents(folder / "full") == contents(folder / "out")


@pytest.mark.skipif(sys.platform == "win32", reason="links are made otherwise there")
def test_a_link_among_states_is_not_followed(folder: Path):
    """What it leads to may be anything of whoever has put it there, or of whoever renders."""
    (folder / "b.toml").write_text(f"{next(iter(WORK.values()))}[output]\nfps = 70\n")
    words = {"first": 0, "last": None, "states": folder / "states"}
    assert part(folder, "a", **words)[1].error == ""
    *_, state = sorted((folder / "states").iterdir())
    (folder / "precious").write_text("of somebody")
    state.unlink()
    state.symlink_to(folder / "precious")
    _, outcome = part(folder, "b", **words)
    assert outcome.error == ""
    assert outcome.notices == (f"No more states are kept: {state} is a link; remove it",)
    assert (folder / "precious").read_text() == "of somebody"
    assert contents(folder / "a") == contents(folder / "b")


def test_a_name_of_two_lines_is_told_in_one_and_once(folder: Path, fluidwarp: Run) -> None:
    (folder / "two\nlines.png").write_bytes(b"nothing")
    ran = fluidwarp(folder, "render", "a.toml", "p0.png", "two\nlines.png", "-o", "out")
    first, *others = ran.stderr.splitlines()
    assert others == ["fluidwarp: 1 of 2 pictures failed; all others are written"]
    assert first.startswith(rf"fluidwarp: Cannot read {folder}/two\nlines.png: it is not a picture")
    assert first.count("lines.png") == 1


def test_a_map_fits_its_picture_whatever_the_result_s_size(folder: Path, fluidwarp: Run) -> None:
    """1000 x 333 pixels become 100 x 33, which are of other proportions."""
    write_picture(folder / "wide.png", Picture(np.zeros((333, 1000, 3), np.uint8)))
    np.save(folder / "wide.npy", np.zeros((333, 1000, 2), np.float32))
    ran = fluidwarp(folder, "apply", "wide.npy", "wide.png", "-o", "small.png", "--size", "100")
    assert (ran.returncode, ran.stderr) == (0, "")
    assert read_picture(folder / "small.png").pixels.shape == (33, 100, 3)


def test_two_results_whose_names_differ_in_capitals_alone(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They are one file on most disks of macOS and Windows, and the one picture replaced the other without a word."""
    names = [folder / "p.png", folder / "P.png", folder / "p.jpg"]
    assert not files.ignores_capitals(folder / "new")
    assert len(tasks(folder, names)) == 3
    exists = os.path.exists
    monkeypatch.setattr(os.path, "exists", lambda path: exists(Path(path).with_name(Path(path).name.lower())))
    assert files.ignores_capitals(folder / "new")
    with pytest.raises(UserError, match=r"p\.png and .*P\.png would both become .*P\.png on this disk; rename one"):
        tasks(folder, names)
    assert len(tasks(folder, names[1:])) == 2
    assert not [path.name for path in folder.iterdir() if path.name.startswith(".fluidwarp-")]


def test_where_nothing_is_written_no_folder_is_left(folder: Path, fluidwarp: Run) -> None:
    """Also of what fails once its picture is read; but one that was there stays, and so does what others put there."""
    np.save(folder / "square.npy", np.zeros((20, 20, 2), np.float32))
    for jobs in "1", "2":
        ran = fluidwarp(folder, "apply", "square.npy", "p0.png", "p1.png", "-o", "new/er/out", "--jobs", jobs)
        assert "must have the same proportions" in ran.stderr
        assert ran.stderr.endswith("2 of 2 pictures failed: p0-1.png; none is written\n"), ran.stderr
        assert not (folder / "new").exists()
    (folder / "new").mkdir()
    fluidwarp(folder, "apply", "square.npy", "p0.png", "-o", "new/out")
    assert list((folder / "new").iterdir()) == []
    with no_empty_folder(folder / "new" / "a" / "b"):
        (folder / "new" / "a" / "b").mkdir(parents=True)
        (folder / "new" / "a" / "else").touch()
    assert [path.name for path in (folder / "new" / "a").iterdir()] == ["else"]

"""What a killed process leaves is swept by the next in that folder, and nothing else ever is."""

from __future__ import annotations

import importlib.util
import os
import platform
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from app.media import leftovers
from app.media.files import replacing, temporary_beside
from app.media.leftovers import sweep, temporary_folder, temporary_name
from support.permissions import as_a_user, needs_permissions

ROOT = Path(__file__).parents[2]

# Holds two files and the folder of a project, half written, until it is killed.
HOLDING = """
import sys, time
from pathlib import Path
from app.media.files import replacing
from app.media.leftovers import temporary_folder
with replacing("a.png") as one, replacing("f.0001.png") as two:
    kept = temporary_folder()
    one.write_bytes(b"half")
    two.write_bytes(b"half")
    print(one, two, kept.name, flush=True)
    time.sleep(600)
"""


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Everything in a folder of the test's own, and nothing remembered of others."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)


@pytest.fixture
def at_work(tmp_path: Path) -> Iterator[Callable[[], tuple[subprocess.Popen[str], list[Path]]]]:
    started: list[subprocess.Popen[str]] = []

    def start() -> tuple[subprocess.Popen[str], list[Path]]:
        environment = os.environ | {"PYTHONPATH": str(ROOT)}
        started.append(
            subprocess.Popen([sys.executable, "-c", HOLDING], env=environment, stdout=subprocess.PIPE, text=True)
        )
        assert started[-1].stdout is not None
        return started[-1], [tmp_path / name for name in started[-1].stdout.readline().split()]

    yield start
    for process in started:
        process.kill()
        process.wait()


def test_what_killed_processes_left_is_swept_by_the_next(
    tmp_path: Path, at_work: Callable[[], tuple[subprocess.Popen[str], list[Path]]]
):
    """Also while nobody has heard yet that they died; and what another is at work on stays."""
    living, held = at_work()
    left = []
    for _ in range(3):
        process, paths = at_work()
        process.kill()
        left += paths
    assert len({*held, *left}) == 12
    assert all(path.exists() for path in held)
    os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)  # dead, and not yet buried
    with replacing("b.png") as temporary:
        temporary.write_bytes(b"whole")
    assert not any(path.exists() for path in left)
    assert all(path.exists() for path in held)
    assert living.poll() is None
    assert sorted(path.name for path in tmp_path.iterdir() if path not in held) == ["b.png"]


def test_a_folder_is_swept_once_in_a_process(tmp_path: Path):
    """A batch of thousands of pictures does not list its folder for each."""
    name = owned(pid=dead())
    for number in range(2):
        (tmp_path / name).touch()
        with replacing("b.png") as temporary:
            temporary.touch()
            assert (tmp_path / name).exists() == bool(number)


@needs_permissions
def test_into_a_folder_that_cannot_be_listed_a_file_is_written_all_the_same(tmp_path: Path):
    (tmp_path / "drop").mkdir(0o300)
    code = f"""
from app.media.files import replacing
with replacing({str(tmp_path / "drop/a.png")!r}) as temporary:
    temporary.write_bytes(b"whole")
"""
    assert as_a_user(code, tmp_path).stderr == ""
    assert (tmp_path / "drop/a.png").read_bytes() == b"whole"


def dead() -> int:
    """The number of a process that is no more."""
    process = subprocess.Popen(["true"])
    process.wait()
    return process.pid


def owned(stem: str = "a", suffix: str = ".png", **parts: object) -> str:
    """The name of a temporary file of this process, but for some of its parts."""
    start, *words, end = temporary_name(stem, suffix).rsplit("-", 5)
    words = dict(zip(("host", "start", "pid", "since"), words, strict=True)) | parts
    return "-".join([start, *map(str, words.values()), end])


def test_nothing_else_is_swept(tmp_path: Path):
    gone, mine = dead(), os.getpid()
    since = int(Path("/proc/self/stat").read_text().rpartition(")")[2].split()[19])
    away = [
        owned(pid=gone),
        owned(pid=mine, since=since - 1),  # another process had that number before
        owned("x" * 300, pid=gone),
        owned("\U0001f642" * 300, pid=gone),
        owned("of.several dots\nand lines", pid=gone),
        owned("a", "", pid=gone),
        temporary_beside(Path(owned(pid=gone))).name.replace(f"-{mine}-", f"-{gone}-"),  # as a GIF's spool is called
    ]
    stays = [
        owned(),
        owned(pid=gone, host="0" * 8),  # of another host, which may be at work in this folder
        owned(pid=gone, start="0" * 8),  # of a container beside this one, or of a copy of this host
        owned(pid=gone)[1:],  # not hidden
        owned(pid=gone).replace("fluidwarp", "fluidwarm"),
        owned(pid=gone) + ".mine.png",
        ".a.0123abcd.png",  # as they were once called: whose it is nobody knows
        ".a.fluidwarp-notes.png",
        "a.png",
    ]
    for name in away + stays:
        (tmp_path / name).write_bytes(b"")
    (tmp_path / "somebody's").mkdir()
    (tmp_path / "somebody's/file").touch()
    (tmp_path / owned(pid=gone)).symlink_to("somebody's")
    links = [path.name for path in tmp_path.iterdir() if path.is_symlink()]
    (tmp_path / (pipe := owned(pid=gone))).unlink(missing_ok=True)
    os.mkfifo(tmp_path / pipe)
    sweep(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([*stays, *links, pipe, "somebody's"])
    assert (tmp_path / "somebody's/file").exists()


def test_what_is_from_before_this_host_was_started_is_swept(tmp_path: Path):
    started = time.time() - float(Path("/proc/uptime").read_text().split()[0])
    old, new = (tmp_path / owned(start="0" * 8) for _ in range(2))
    for path, changed in ((old, started - 60), (new, started + 60)):
        path.touch()
        os.utime(path, (changed, changed))
    sweep(tmp_path)
    assert list(tmp_path.iterdir()) == [new]


@pytest.mark.parametrize("told", [None, "", "1", "1 (a) S", "1 (a) S " + "x " * 30, "1 (a) Z " + "1 " * 30])
def test_without_a_list_of_processes_nothing_is_swept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, told: str | None
):
    """Nor where the system tells of this one what cannot be understood."""
    path = tmp_path / owned(pid=dead())
    path.touch()
    monkeypatch.setattr(leftovers, "PROC", tmp_path / "proc")
    if told is not None:
        (own := tmp_path / "proc" / str(os.getpid())).mkdir(parents=True)
        (own / "stat").write_text(told)
    sweep(tmp_path)
    assert path.exists()


def test_a_name_tells_this_host_its_start_and_what_is_seen_from_here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def owner(host: str, start: str, seen: str) -> list[str]:
        """The host and the start in a name that is made at the first look at such a place."""
        spec = importlib.util.find_spec("app.media.leftovers")
        assert spec is not None
        assert spec.loader is not None
        anew = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(anew)
        monkeypatch.setattr(platform, "node", lambda: host)
        (tmp_path / "self/ns/pid").unlink(missing_ok=True)
        (tmp_path / "self/ns/pid").symlink_to(seen)
        (tmp_path / "sys/kernel/random/boot_id").write_text(start)
        monkeypatch.setattr(anew, "PROC", tmp_path)
        return anew.temporary_name("a").split("-")[1:3]

    for folder in ("self/ns", "sys/kernel/random"):
        (tmp_path / folder).mkdir(parents=True)
    (here, now), again = owner("one", "first", "all"), owner("one", "first", "all")
    assert again == [here, now]
    assert owner("one", "second", "all")[1] not in (here, now)
    assert owner("one", "first", "few")[1] != now
    assert owner("two", "first", "all")[0] != here


def test_names_are_hidden_short_enough_and_keep_the_ending(tmp_path: Path):
    for stem in ("a", "\U0001f642" * 60, ".a"):
        path = temporary_beside(tmp_path / f"{stem}.webp")
        path.touch()
        assert re.fullmatch(r"\..+\.fluidwarp-.+\.webp", path.name)
    kept = temporary_folder()
    assert Path(kept.name).parent == tmp_path
    sweep(tmp_path)
    assert Path(kept.name).is_dir()

"""Kills what saves, renders and exports, at random moments, and looks at what is left of the files.

    python tests/killing_files.py [--of saving] [--kills 100] [--seed 1]

Every file that had been there is as it was, or as whole as without the kill; every project opens; and after the next
run nothing is left that it would not have left by itself. Ends with 0 if that was so each time.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from itertools import count
from multiprocessing.context import ForkProcess
from pathlib import Path

ROOT = Path(__file__).parent.parent
sys.path[:0] = [path for path in (str(ROOT), str(ROOT / "tests")) if path not in sys.path]

from app.errors import UserError  # noqa: E402
from app.media import project as projects  # noqa: E402
from app.media.pictures import read_picture, write_picture  # noqa: E402
from app.model.recipe import Recipe  # noqa: E402
from app.work.export_process import ExportProcess  # noqa: E402
from app.work.jobs import Job, MapOutput, Outputs  # noqa: E402
from support.editing import pattern  # noqa: E402

RECIPE = """
duration = 0.2
[fluid]
grid = 16
[[stroke]]
tool = "push"
radius = 0.2
samples = [[0, 0.3, 0.5, 1.0], [5, 0.6, 0.5, 1.0]]
[output]
fps = 30
"""
OLD = b"what was there before\n" * 400
RESULTS = "out.png", "out.exr", "out.tif", "out.mp4", "out.gif", "frames.%04d.png", "frames.%04d.exr"
BACKUP, SAID = "work.fluidwarp~", "tmp.said"
PATIENCE = 60.0  # seconds for what a killed process has begun to end

Act = Callable[[Path, bool], None]
"""What is done in a folder, once or, True, until it is killed."""


def save(folder: Path, endless: bool) -> None:
    """Save two works in turn to one file."""
    works = [projects.load(folder / f"{name}.fluidwarp") for name in ("one", "other")]
    for number in count() if endless else range(1):
        projects.save(works[number % 2], folder / "work.fluidwarp")


def render(result: str, resumes: bool) -> Act:
    """Render as the command line does."""

    def act(folder: Path, endless: bool) -> None:
        from app.cli import main

        os.chdir(folder)
        sys.argv = ["fluidwarp", "render", "recipe.toml", "picture.png", "-o", result]
        if resumes and not endless and "%" in result:
            sys.argv.append("--resume")
        main()

    return act


def export(result: str) -> Act:
    """Export as the editor does: in a process of its own, which is to end with the editor."""

    def act(folder: Path, endless: bool) -> None:
        picture = read_picture(folder / "picture.png")
        maps = MapOutput(folder / "map.exr")
        outputs = Outputs(folder / result, maps=maps)
        process = ExportProcess(Job(Recipe.parse(RECIPE), picture, folder, outputs))
        while not process.is_done:
            process.poll()
            time.sleep(0.002)
        assert not process.error, process.error

    return act


def prepare(folder: Path, result: str, has_old: bool) -> None:
    """Make a folder to work in, with files where others will be written, in a process that no other has to do with."""
    (folder / "tmp").mkdir(parents=True)

    def act(folder: Path, endless: bool) -> None:
        (folder / "recipe.toml").write_text(RECIPE, "utf-8")
        write_picture(folder / "picture.png", pattern(48, 36))
        for name, amount in (("one", 1.0), ("other", 0.5), ("work", 1.0)):
            work = projects.from_picture(folder / "picture.png", Recipe.parse(RECIPE).edited(amount=amount))
            projects.save(work, folder / f"{name}.fluidwarp")
        names = ((result % 0, result % 3) if "%" in result else (result, "map.exr")) if has_old else ()
        for name in names:
            (folder / name).write_bytes(OLD)

    assert ended(begun(act, folder, endless=False)) == 0, (folder / SAID).read_text("utf-8")


def begun(act: Act, folder: Path, endless: bool) -> ForkProcess:
    """A process that does it, leading a group of its own."""

    def lead() -> None:
        os.setsid()
        said = os.open(folder / SAID, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(said, 1)
        os.dup2(said, 2)
        os.environ["TMPDIR"] = tempfile.tempdir = str(folder / "tmp")
        act(folder, endless)

    process = multiprocessing.get_context("fork").Process(target=lead)
    process.start()
    return process


def ended(process: ForkProcess) -> int:
    """Its exit status, negative of a signal, once all of its group have ended."""
    process.join()
    number, status = process.pid, process.exitcode
    assert number is not None
    assert status is not None
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        try:
            os.killpg(number, 0)
        except ProcessLookupError:
            return status
        time.sleep(0.01)
    os.killpg(number, signal.SIGKILL)
    raise AssertionError("what it had begun did not end")


def files_in(folder: Path) -> dict[str, bytes]:
    """All files of a folder, but for what was said, by their names from there."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and path.name != SAID
    }


def is_whole(name: str, data: bytes, before: bytes | None, wanted: bytes | None, folder: Path) -> bool:
    """True if a file is what it was, or what it would have become."""
    if ".fluidwarp" not in name:
        return data in (before, wanted)
    try:
        work = projects.load(folder / name)
    except UserError:
        return False
    return any(
        work.recipe == other.recipe and work.picture.pixels.tobytes() == other.picture.pixels.tobytes()
        for other in (projects.load(folder / f"{kind}.fluidwarp") for kind in ("one", "other"))
    )


def harmed(before: dict[str, bytes], wanted: dict[str, bytes], folder: Path) -> list[str]:
    """The files that a kill has harmed; hidden ones are swept by the next run."""
    wrong = [name for name in before if not (folder / name).is_file()]
    for name, data in files_in(folder).items():
        if name.startswith(("tmp/", ".")):
            continue
        is_meant = name in before or name in wanted or name == BACKUP
        if not is_meant or not is_whole(name, data, before.get(name), wanted.get(name), folder):
            wrong.append(name)
    return wrong


def left_over(before: dict[str, bytes], wanted: dict[str, bytes], folder: Path) -> list[str]:
    """What is there after the next run and should not, or should and is not, or is something else."""
    after = files_in(folder)
    wrong = sorted((set(after) ^ (set(wanted) | set(before))) - {BACKUP})
    same = (name for name in set(wanted) & set(after) if ".fluidwarp" not in name)  # which tells when it was made
    return wrong + [f"{name} differs" for name in same if after[name] != wanted[name]]


class Killing:
    """Kills one thing again and again.

    Attributes:
        halfway: of how many kills something half-written was left to the next run.
    """

    def __init__(self, of: str, seed: int, root: Path) -> None:
        self.halfway = 0
        self._of, self._root = of, root
        self._dice = random.Random(seed)
        self._whole: dict[str, tuple[float, dict[str, bytes]]] = {}  # how long each takes, and what is left of it

    def kill(self) -> list[str] | None:
        """What is wrong after one; None if it came too late."""
        result, has_old, resumes = self._dice.choice(RESULTS), self._dice.random() < 0.7, self._dice.random() < 0.5
        kills_all = self._dice.random() < 0.5  # an editor's export process too, which would else tidy up after it
        act = {"saving": save, "rendering": render(result, resumes), "exporting": export(result)}[self._of]
        lasts, wanted = self._undisturbed(act, result)
        folder = self._root / "killed"
        prepare(folder, result, has_old)
        before = files_in(folder)
        process = begun(act, folder, endless=True)
        time.sleep(self._dice.uniform(0, 0.5 if self._of == "saving" else 1.05 * lasts))
        with suppress(ProcessLookupError):  # no group yet, or none any more
            if kills_all and process.pid is not None:
                os.killpg(process.pid, signal.SIGKILL)
        process.kill()
        wrong = None
        if ended(process) == -signal.SIGKILL:
            wrong = harmed(before, wanted, folder)
            self.halfway += bool(set(files_in(folder)) - {*before, *wanted, BACKUP})
            if ended(begun(act, folder, endless=False)):
                wrong.append((folder / SAID).read_text("utf-8"))
            wrong += left_over(before, wanted, folder)
        shutil.rmtree(folder)
        return wrong

    def _undisturbed(self, act: Act, result: str) -> tuple[float, dict[str, bytes]]:
        if result not in self._whole:
            folder = self._root / "whole"
            prepare(folder, result, has_old=False)
            start = time.monotonic()
            assert ended(begun(act, folder, endless=False)) == 0, (folder / SAID).read_text("utf-8")
            self._whole[result] = time.monotonic() - start, files_in(folder)
            shutil.rmtree(folder)
        return self._whole[result]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--of", choices=("saving", "rendering", "exporting"), default="saving")
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    kills = bad = 0
    with tempfile.TemporaryDirectory() as name:
        killing = Killing(given.of, given.seed, Path(name))
        while kills < given.kills:
            if (wrong := killing.kill()) is None:
                continue
            kills += 1
            bad += bool(wrong)
            print(f"{kills}: {wrong or 'nothing is wrong'}", flush=True)
    print(f"{kills} kills of {given.of}, {killing.halfway} while a file was being written, {bad} bad")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())

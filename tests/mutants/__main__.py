"""Put each mutant into a copy of the tree, run the tests that should notice, and tell which survived.

    python -m tests.mutants [--room ROOM] [--name PART] [--jobs N] [--limit SECONDS] [--baseline] [--list]

Ends with status 1 if one survived, 2 if an entry is stale or its tests do not run.
"""

from __future__ import annotations

import argparse
import compileall
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from .catalogue import ROOT, Mutant, Stale, read

SAID = {"noticed": ".", "out of time": "t", "survived": "SURVIVED", "broken": "BROKEN"}


@dataclass(frozen=True)
class Ran:
    """What became of a mutant: "noticed", "out of time" (noticed too), "survived"; "broken" if no test could be run."""

    verdict: str
    seconds: float
    said: str

    @property
    def by(self) -> str:
        """The test that noticed, and what it said."""
        lines = [line for line in self.said.splitlines() if line.startswith(("FAILED ", "ERROR "))]
        return f" {lines[0][:200]}" if self.verdict == "noticed" and lines else ""


def copy_tree(folder: Path) -> Path:
    """A copy of the tree as it is now, with what git does not ignore, compiled."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        check=True,
        capture_output=True,
    )
    for name in filter(None, listed.stdout.decode().split("\0")):
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
    for room in ("app", "solver", "shaders", "tests"):
        compileall.compile_dir(folder / room, quiet=2)
    return folder


def run_tests(tree: Path, tests: tuple[str, ...], limit: float) -> Ran:
    """Run the tests in a copy of the tree, which its processes take the program from too."""
    places = os.pathsep.join([str(tree), str(tree / "tests")])
    environment = os.environ | {"PYTHONPATH": places, "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "--no-header", *tests]
    begun = time.monotonic()
    with tempfile.TemporaryFile() as output:
        process = subprocess.Popen(
            command, cwd=tree, env=environment, stdin=subprocess.DEVNULL, stdout=output, stderr=output,
            start_new_session=True,
        )  # fmt: skip
        try:
            status = process.wait(limit)
        except subprocess.TimeoutExpired:
            status = None
            os.killpg(process.pid, 9)
            process.wait()
        output.seek(0)
        said = output.read().decode("utf-8", "replace")
    verdict = {0: "survived", 1: "noticed", None: "out of time"}.get(status, "broken")
    return Ran(verdict, time.monotonic() - begun, said)


def run_mutant(tree: Path, mutant: Mutant, limit: float) -> Ran:
    """Put a mutant into a copy of the tree, run its tests, and undo it; no Python at all is broken, not noticed."""
    path, text = tree / mutant.file, mutant.text_in(tree)
    before, times = path.read_bytes(), path.stat()
    try:
        if path.suffix == ".py":
            compile(text, mutant.file, "exec")
        path.write_text(text, "utf-8")
        return run_tests(tree, mutant.tests, limit)
    except SyntaxError as error:
        return Ran("broken", 0.0, f"{mutant.name}: {error}")
    finally:
        path.write_bytes(before)
        os.utime(path, (times.st_atime, times.st_mtime))  # the compiled file is of that time


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description="Which faults do the tests notice?")
    parser.add_argument("--room", help="only those of a room: the name of its TOML file")
    parser.add_argument("--name", default="", help="only those with this in their name")
    parser.add_argument("--again", type=Path, help="only those that the run which printed this did not notice")
    parser.add_argument("--jobs", type=int, default=1, help="copies of the tree in which they are tried at once")
    parser.add_argument("--limit", type=float, default=180.0, help="seconds that the tests of one may take")
    parser.add_argument("--baseline", action="store_true", help="run the tests without the faults: all must pass")
    parser.add_argument("--list", action="store_true", help="tell the mutants, and run nothing")
    asked = parser.parse_args()
    try:
        wanted = [m for m in read() if asked.room in (None, m.room) and asked.name in m.name]
        if asked.again:
            lines = asked.again.read_text("utf-8").splitlines()
            wanted = [m for m in wanted if any(f"{m.room}: {m.name} [" in line and line[0] != "." for line in lines)]
        for mutant in wanted:
            mutant.text_in(ROOT)
    except Stale as error:
        print(error, file=sys.stderr)
        return 2
    if asked.list or not wanted:
        print(*(f"{m.room}: {m.name} ({m.file})" for m in wanted) if wanted else ["there is none like that"], sep="\n")
        return 0 if wanted else 2
    if asked.baseline:
        wanted = list({mutant.tests: mutant for mutant in wanted}.values())

    mine = threading.local()
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder, ThreadPoolExecutor(asked.jobs) as pool:

        def tried(mutant: Mutant) -> Ran:
            if not hasattr(mine, "tree"):
                mine.tree = copy_tree(Path(tempfile.mkdtemp(dir=folder)))
            if asked.baseline:
                return run_tests(mine.tree, mutant.tests, asked.limit)
            return run_mutant(mine.tree, mutant, asked.limit)

        found: Counter[str] = Counter()
        for mutant, ran in zip(wanted, pool.map(tried, wanted), strict=True):
            verdict = ran.verdict
            if asked.baseline:
                verdict = "passed" if verdict == "survived" else f"FAILED ({verdict})"
            found[verdict] += 1
            what = " ".join(mutant.tests) if asked.baseline else f"{mutant.room}: {mutant.name}"
            print(f"{SAID.get(verdict, verdict)} {what} [{ran.seconds:.0f} s]{ran.by}", flush=True)
            if verdict == "broken" or verdict.startswith("FAILED"):
                print(ran.said[-3000:], flush=True)
    print(f"{len(wanted)} in all: " + ", ".join(f"{count} {verdict}" for verdict, count in sorted(found.items())))
    if asked.baseline:
        return 0 if set(found) == {"passed"} else 2
    return 2 if found["broken"] else 1 if found["survived"] else 0


if __name__ == "__main__":
    sys.exit(main())

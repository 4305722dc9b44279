"""Damaged input for every reader, chosen by what of the program it reaches: does any crash, hang or grow?

    pip install atheris
    python tests/guided.py [--reader png ...] [--seconds 60] [--seed 0] [--findings DIR] [--corpus DIR]

The readers, what their inputs are made of and what is a finding are those of `fuzz.py`. libFuzzer, by way of atheris,
keeps an input where it reaches a branch of the Python code that none has before, and goes on from it; libraries in C
are not looked into. With --corpus, those that reach lines of `app` which a whole file does not are kept in DIR, the
smallest first and none above `LARGEST` bytes: `tests/corpus` is made so, and `test_corpus.py` reads it. Findings that
are mended go there too.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from types import FrameType
from typing import Any

ROOT = Path(__file__).parent.parent
sys.path[:0] = [path for path in (str(ROOT), str(ROOT / "tests")) if path not in sys.path]

LOOKED_INTO = ["app", "tifffile", "tomllib", "tomlkit", "zipfile"]
CORPUS = ROOT / "tests" / "corpus"
LONGEST = 5  # seconds of an input
LARGEST = 2048  # bytes of a file that is kept in a corpus
MOST_BYTES = 2**16  # of an input
RSS = 1500  # MiB: of a process, with the libraries that it has loaded


def child(reader: str, work: Path, seed: int, *words: str) -> None:
    """Read one input after another until something is found or time is over; libFuzzer's own words go to stderr."""
    atheris: Any = importlib.import_module("atheris")  # not needed for the tests, so not always there
    with atheris.instrument_imports(include=LOOKED_INTO):
        import fuzz
    import random

    path = work / f"in{Path(reader).suffix}"
    dice = random.Random(seed)

    def read(data: bytes) -> None:
        path.write_bytes(data)
        fuzz.judged(reader, path)

    def changed(data: bytes, most: int, seed: int) -> bytes:
        if dice.random() < 0.5:
            return fuzz.damaged(data, random.Random(seed))[:most]
        return atheris.Mutate(data, most)

    atheris.Setup([sys.argv[0], *words], read, custom_mutator=changed)
    atheris.Fuzz()


class Tally:
    """How much was tried, as libFuzzer tells it."""

    def __init__(self) -> None:
        self.inputs = self.branches = 0

    def add(self, said: str) -> None:
        last = re.findall(r"stat::number_of_executed_units: (\d+)", said)
        last = last or re.findall(r"^#(\d+)", said, re.MULTILINE)  # of a process that died
        self.inputs += int(last[-1]) if last else 0
        self.branches = max([self.branches, *map(int, re.findall(r"cov: (\d+)", said))])


def guided(reader: str, seconds: float, seed: int, findings: Path, corpus: Path | None) -> tuple[Tally, list[str]]:
    """Let processes read damaged inputs for so long; how much was tried, and what was found, a line each."""
    import fuzz

    tally, found, end = Tally(), list[str](), time.monotonic() + seconds
    with tempfile.TemporaryDirectory() as folder:
        work, inputs, ill = Path(folder), Path(folder) / "inputs", Path(folder) / "ill"
        inputs.mkdir()
        ill.mkdir()
        (inputs / "whole").write_bytes(fuzz.whole_file(reader, work))
        for kept in files_of(CORPUS, reader):
            (inputs / kept.name).write_bytes(kept.read_bytes())
        while (left := round(end - time.monotonic())) > 0:
            words = [inputs, f"-artifact_prefix={ill}/", f"-max_total_time={left}", f"-timeout={LONGEST}"]
            words += [f"-rss_limit_mb={RSS}", f"-max_len={MOST_BYTES}", f"-seed={seed + 1}", "-print_final_stats=1"]
            command = [sys.executable, __file__, "--child", reader, folder, seed, *words]
            with (work / "said").open("w+b") as said:
                subprocess.run([*map(str, command)], stdout=subprocess.DEVNULL, stderr=said, check=False)
                said.seek(0)
                told = said.read().decode("utf-8", "replace")
            tally.add(told)
            for one in ill.iterdir():
                findings.mkdir(parents=True, exist_ok=True)
                kept = findings / f"{reader.partition('.')[0]}-{one.name[:20]}{Path(reader).suffix}"
                kept.write_bytes(one.read_bytes())
                what = re.search(r"^(\w[\w.]*(?:Error|Exception)\b.*|==\d+== ERROR.*)$", told, re.MULTILINE)
                found.append(f"{kept}: {what[1] if what else 'see the file'}")
                one.unlink()
            if not re.search(r"^#\d+", told, re.MULTILINE):
                found.append(f"{reader}: the process did not begin: {told[-300:]}")
                break
            seed += 1
        if corpus is not None:
            keep(reader, [path.read_bytes() for path in inputs.iterdir()], corpus)
    return tally, found


def files_of(corpus: Path, reader: str) -> list[Path]:
    """The inputs of a reader that are kept."""
    return sorted((corpus / reader).glob(f"*{Path(reader).suffix}"))


def keep(reader: str, inputs: list[bytes], corpus: Path) -> None:
    """Put the smallest inputs that reach lines of `app` which a whole file does not into a corpus."""
    import fuzz

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"in{Path(reader).suffix}"
        reached = set[tuple[str, int]]()
        path.write_bytes(fuzz.whole_file(reader, Path(folder)))
        reached |= lines_of(reader, path)
        for data in [path.read_bytes() for path in files_of(corpus, reader)] + sorted(inputs, key=len):
            path.write_bytes(data)
            new = lines_of(reader, path) - reached
            if new and len(data) <= LARGEST:
                reached |= new
                kept = corpus / reader / f"{hashlib.sha256(data).hexdigest()[:12]}{path.suffix}"
                kept.parent.mkdir(parents=True, exist_ok=True)
                kept.write_bytes(data)


def lines_of(reader: str, path: Path) -> set[tuple[str, int]]:
    """The lines of `app` that a reader runs through with a file."""
    import fuzz

    own, lines = str(ROOT / "app"), set[tuple[str, int]]()

    def trace(frame: FrameType, event: str, _: Any) -> Any:
        if not frame.f_code.co_filename.startswith(own):
            return None
        lines.add((frame.f_code.co_filename, frame.f_lineno))
        return trace

    sys.settrace(trace)
    try:
        fuzz.judged(reader, path)
    except Exception:  # a finding, told by the child
        pass
    finally:
        sys.settrace(None)
    return lines


def main() -> int:
    if sys.argv[1:2] == ["--child"]:
        reader, work, seed, *words = sys.argv[2:]
        child(reader, Path(work), int(seed), *words)
        return 0
    import fuzz

    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--reader", nargs="*", default=list(fuzz.READERS), help="a part of its name is enough")
    parser.add_argument("--seconds", type=float, default=60, help="for each reader")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--findings", type=Path, default=Path("findings"))
    parser.add_argument("--corpus", type=Path, help="keep the inputs that reach further there")
    options = parser.parse_args()
    found: list[str] = []
    for reader in fuzz.READERS:
        if any(wanted in reader for wanted in options.reader):
            tally, here = guided(reader, options.seconds, options.seed, options.findings, options.corpus)
            print(f"{reader}: {tally.inputs} inputs, {tally.branches} branches, {len(here)} findings", flush=True)
            found += here
    print(*found, sep="\n")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())

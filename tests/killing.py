"""Kills editors that paint, at random moments, and looks at what the next start finds.

    python tests/killing.py [--kills 100]            editors without a window
    python tests/killing.py --window [--kills 30]    the real window under Xvfb, painted on with xdotool
    python tests/killing.py --busy ...               with two other processes that never rest

Ends with 0 if everything that was found was exact, and no stroke was lost that had been made a second before.
"""

from __future__ import annotations

import argparse
import hashlib
import random
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from pathlib import Path

ROOT = Path(__file__).parent.parent
sys.path[:0] = [path for path in (str(ROOT), str(ROOT / "tests")) if path not in sys.path]

import numpy as np  # noqa: E402

from app.history import Entry  # noqa: E402
from app.pictures import write_picture  # noqa: E402
from app.recipe import Recipe  # noqa: E402
from app.recovery import find  # noqa: E402


@dataclass(frozen=True)
class Outcome:
    """What a kill left.

    Attributes:
        strokes: made until then.
        lost: of them not found.
        lost_after_a_second: those of them that had been made more than a second before the kill.
        late: seconds that the oldest of the lost ones had been there.
        is_exact: what was found is, to the bit, a state that there was.
    """

    strokes: int
    lost: int
    lost_after_a_second: int
    late: float
    is_exact: bool


def digest(entries: tuple[Entry, ...], index: int) -> str:
    """Of all of a history."""
    return _digest([(entry.name, entry.recipe) for entry in entries], index)


def digest_of(recipe: Recipe) -> str:
    return _digest(recipe)


def digest_of_warp(warp: np.ndarray) -> str:
    return hashlib.sha256(warp.tobytes()).hexdigest()


def _digest(*parts: object) -> str:
    # The repr of a float is its own alone.
    return hashlib.sha256(repr(parts).encode()).hexdigest()


# -- an editor without a window -------------------------------------------------------------------------------------


class Painter:
    """A process that paints without end, and tells every state of its work before its journal hears of it.

    Attributes:
        root: the folder of journals.
        shown: what the warp was when it had come to rest, by the digest of the recipe.
    """

    def __init__(self, folder: Path, root: Path, seed: int) -> None:
        self.root = root
        self.shown: dict[str, str] = {}
        command = [sys.executable, str(Path(__file__)), "--paint", str(folder), str(root), "--seed", str(seed)]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT)
        self._states: dict[str, tuple[float, int]] = {}
        self._at_rest = threading.Event()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            match line.split():
                case ["state", moment, strokes, told]:
                    self._states[told] = float(moment), int(strokes)
                case ["shown", recipe, warp]:
                    self.shown[recipe] = warp
                    self._at_rest.set()

    def paint_for(self, seconds: float) -> None:
        """Let it paint, from when its first stroke has come to rest."""
        assert self._at_rest.wait(120)
        time.sleep(seconds)

    def kill(self) -> Outcome:
        """End it at once; what is found then."""
        self._process.kill()
        when = time.monotonic()
        self._process.wait()
        self._reader.join()
        strokes = max(made for _, made in self._states.values())
        found, notices = find(self.root)
        for one in found:
            one.leave()
        if not found:
            return Outcome(strokes, strokes, *_late(self._states, 0, when), is_exact=not notices)
        entries, index = found[0].work.entries, found[0].work.index
        is_exact = digest(entries, index) in self._states and len(found) == 1 and not notices
        kept = len(entries) - 1
        return Outcome(strokes, strokes - kept, *_late(self._states, kept, when), is_exact)


def _late(states: dict[str, tuple[float, int]], kept: int, when: float) -> tuple[int, float]:
    """How many strokes beyond `kept` had been made more than a second before, and how old the oldest was."""
    strokes = range(kept + 1, max(made for _, made in states.values()) + 1)
    ages = [when - min(moment for moment, made in states.values() if made >= number) for number in strokes]
    return sum(age > 1 for age in ages), max(ages, default=0.0)


def paint(folder: Path, root: Path, seed: int) -> None:
    """Paint on a picture made in `folder` until somebody puts an end to it."""
    from editing import Robot, small_project
    from solver.context import Device

    dice = random.Random(seed)
    robot = Robot(Device.headless(), small_project(folder), size=(640, 480), journals=root)
    editor = robot.editor
    keep, seen = editor.recovery.keep, [""]

    def tell_and_keep() -> None:
        history = editor.session.document.history
        told = digest(history.entries, history.index)
        if told != seen[0] and len(history.entries) > 1:
            seen[0] = told
            print("state", time.monotonic(), len(history.entries) - 1, told, flush=True)
        keep()

    editor.recovery.keep = tell_and_keep
    for number in count():
        robot.key(dice.choice("wtbvfs"))
        start = dice.uniform(0.2, 0.8), dice.uniform(0.2, 0.8)
        end = start[0] + dice.uniform(-0.1, 0.1), start[1] + dice.uniform(-0.1, 0.1)
        robot.drag(start, end, steps=dice.randint(1, 12))
        robot.frame(count=dice.randint(0, 12))
        if number % 8 == 0:
            robot.rest()
            print("shown", digest_of(editor.session.recipe), digest_of_warp(robot.warp()), flush=True)


# -- the real window ------------------------------------------------------------------------------------------------


def kill_windows(kills: int, seed: int) -> list[Outcome]:
    """Kill the real editor, painted on with xdotool."""
    from editing import pattern
    from test_window import Desk

    outcomes = []
    dice = random.Random(seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        desk = Desk(folder)
        write_picture(folder / "pattern.png", pattern())
        root = folder / "state" / "fluidwarp" / "journals"
        try:
            for number in range(kills):
                desk.window = ""
                desk.open(folder / "pattern.png")
                assert desk.editor is not None
                made: list[float] = []
                until = time.monotonic() + dice.uniform(0.5, 6)
                killer = threading.Thread(target=_kill_at, args=(desk.editor, until))
                killer.start()
                while desk.editor.poll() is None:
                    x, y = dice.randint(250, 750), dice.randint(250, 600)
                    dx, dy = dice.randint(20, 60), dice.randint(-60, 60)
                    down = ("mousemove", str(x), str(y), "mousedown", "1")
                    way = [("mousemove", str(x + dx * k // 4), str(y + dy * k // 4), "sleep", "0.03") for k in range(5)]
                    desk.do(*down, *(word for step in way for word in step), "mouseup", "1")
                    made.append(time.monotonic())
                    time.sleep(dice.uniform(0, 0.4))
                killer.join()
                made = [moment for moment in made if moment < until]
                found, notices = find(root)
                entries = found[0].work.entries if found else ()
                kept = sum(entry.name == "Push" for entry in entries)
                ages = [until - moment for moment in made[kept:]]
                exact = not notices and len(found) == (kept > 0)
                outcomes.append(Outcome(len(made), len(ages), sum(a > 1 for a in ages), max(ages, default=0.0), exact))
                print(f"{number + 1}: {outcomes[-1]}", flush=True)
                for one in found:
                    one.discard()
        finally:
            desk.close()
    return outcomes


def _kill_at(process: subprocess.Popen[str], moment: float) -> None:
    time.sleep(max(moment - time.monotonic(), 0))
    process.kill()
    process.wait()


# -- from the command line --------------------------------------------------------------------------------------------


@contextmanager
def busy(count: int) -> Iterator[None]:
    """Other processes that never rest."""
    others = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for other in others:
            other.kill()
            other.wait()


def kill_painters(kills: int, seed: int) -> list[Outcome]:
    outcomes = []
    dice = random.Random(seed)
    for number in range(kills):
        with tempfile.TemporaryDirectory() as name:
            painter = Painter(Path(name), Path(name) / "journals", dice.randrange(10**6))
            painter.paint_for(dice.uniform(0, 4))
            outcomes.append(painter.kill())
            print(f"{number + 1}: {outcomes[-1]}", flush=True)
    return outcomes


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--window", action="store_true")
    parser.add_argument("--busy", action="store_true")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--paint", type=Path, nargs=2, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.paint is not None:
        folder, root = given.paint
        paint(folder, root, given.seed)
    with busy(2 if given.busy else 0):
        outcomes = (kill_windows if given.window else kill_painters)(given.kills, given.seed)
    strokes, lost = sum(one.strokes for one in outcomes), sum(one.lost for one in outcomes)
    late = sum(one.lost_after_a_second for one in outcomes)
    inexact = sum(not one.is_exact for one in outcomes)
    print(f"{len(outcomes)} kills, {strokes} strokes: {lost} lost of the last second, {late} older, {inexact} inexact;")
    print(f"the oldest lost one was {max(one.late for one in outcomes):.3f} s old")
    return 0 if not late and not inexact else 1


if __name__ == "__main__":
    sys.exit(main())

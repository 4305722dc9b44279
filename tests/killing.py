"""Kills editors that paint, at random moments, and looks at what the next start finds.

    python tests/killing.py [--kills 100]            editors without a window
    python tests/killing.py --window [--kills 30]    the real window under Xvfb, painted on with xdotool
    python tests/killing.py --busy ...               with two other processes that never rest

Ends with 0 if everything that was found was exact, and no stroke was lost.
"""

from __future__ import annotations

import argparse
import hashlib
import random
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from pathlib import Path

ROOT = Path(__file__).parent.parent
sys.path[:0] = [path for path in (str(ROOT), str(ROOT / "tests")) if path not in sys.path]

import numpy as np  # noqa: E402

from app.media.pictures import write_picture  # noqa: E402
from app.model.recipe import Recipe  # noqa: E402
from app.model.undo import Entry  # noqa: E402
from app.work.recovery import find  # noqa: E402


@dataclass(frozen=True)
class Outcome:
    """What a kill left.

    Attributes:
        strokes: committed until then, the frame's work for them done.
        lost: of them not found.
        late: seconds that the oldest of the lost ones had been there.
        is_exact: what was found is, to the bit, a state that there was.
    """

    strokes: int
    lost: int
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


# -- editors that tell what they do ---------------------------------------------------------------------------------


class Painter:
    """A process with an editor that tells every state of its work, before and after its journal hears of it.

    Attributes:
        process: the editor.
        shown: what the warp was when it had come to rest, by the digest of the recipe; of one without a window.
    """

    def __init__(self, root: Path, words: list[str], env: dict[str, str] | None = None) -> None:
        self._root = root
        self.shown: dict[str, str] = {}
        self._states: set[str] = set()
        self._made: list[tuple[float, int]] = []
        self._has_begun, self._has_rested = threading.Event(), threading.Event()
        command = [sys.executable, str(Path(__file__)), *words]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT, env=env)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @classmethod
    def without_window(cls, folder: Path, root: Path, seed: int) -> Painter:
        """One that paints by itself, on a picture in `folder`."""
        return cls(root, ["--paint", str(folder), str(root), "--seed", str(seed)])

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            match line.split():
                case ["state", told]:
                    self._states.add(told)
                case ["made", moment, strokes]:
                    self._made.append((float(moment), int(strokes)))
                    self._has_begun.set()
                case ["shown", recipe, warp]:
                    self.shown[recipe] = warp
                    self._has_rested.set()

    @property
    def has_begun(self) -> bool:
        """Its first stroke has been made."""
        return self._has_begun.is_set()

    def paint_for(self, seconds: float) -> None:
        """Let it paint, from its first stroke on."""
        assert self._has_begun.wait(120)
        time.sleep(seconds)

    def paint_until_rest(self) -> None:
        """Let it paint until it has shown something at rest."""
        assert self._has_rested.wait(120)

    def kill(self) -> Outcome:
        """End it at once; what is found then."""
        self.process.kill()
        return self.outcome(time.monotonic())

    def outcome(self, when: float) -> Outcome:
        """What is found after it was killed at a moment, and left there."""
        self.process.wait()
        self._reader.join()
        strokes = max(count for _, count in self._made)
        found, notices = find(self._root)
        for one in found:
            one.leave()
        if not found:
            return Outcome(strokes, strokes, when - self._made[0][0], is_exact=not notices)
        entries, index = found[0].work.entries, found[0].work.index
        is_exact = digest(entries, index) in self._states and len(found) == 1 and not notices
        kept = _strokes(entries)
        late = when - min((moment for moment, made in self._made if made > kept), default=when)
        return Outcome(strokes, max(strokes - kept, 0), late, is_exact)


def _strokes(entries: tuple[Entry, ...]) -> int:
    return max(len(entry.recipe.stroke) for entry in entries)


def tell_states() -> None:
    """Let editors of this process print their states."""
    from app.ui.workspace import Workspace

    keep, seen = Workspace.keep, [""]

    def tell_and_keep(self: Workspace) -> None:
        history = self.session.document.history
        told = digest(history.entries, history.index)
        is_new = told != seen[0] and _strokes(history.entries) > 0
        seen[0] = told
        if is_new:
            print("state", told, flush=True)
        keep(self)
        if is_new:
            print("made", time.monotonic(), _strokes(history.entries), flush=True)

    Workspace.keep = tell_and_keep


def paint(folder: Path, root: Path, seed: int) -> None:
    """Paint on a picture made in `folder`, without a window, until somebody puts an end to it."""
    from solver.gl.device import Device
    from support.editing import Robot, small_project

    tell_states()
    dice = random.Random(seed)
    robot = Robot(Device.headless(), small_project(folder), size=(640, 480), journals=root)
    for number in count():
        robot.key(dice.choice("wtbvfs"))
        start = dice.uniform(0.2, 0.8), dice.uniform(0.2, 0.8)
        end = start[0] + dice.uniform(-0.1, 0.1), start[1] + dice.uniform(-0.1, 0.1)
        robot.drag(start, end, steps=dice.randint(1, 12))
        robot.frame(count=dice.randint(0, 12))
        if number % 8 == 0:
            robot.rest()
            robot.until(lambda: not robot.editor.recovery.is_busy)
            recipe = robot.editor.session.recipe
            print("shown", digest_of(recipe), digest_of_warp(robot.warp()), flush=True)


def open_window(file: Path) -> None:
    """The real editor."""
    from app.ui.window import run

    tell_states()
    run(file)


# -- killing them ---------------------------------------------------------------------------------------------------


def kill_painters(kills: int, seed: int) -> Iterator[Outcome]:
    """Kill editors without a window."""
    dice = random.Random(seed)
    for _ in range(kills):
        with tempfile.TemporaryDirectory() as name:
            painter = Painter.without_window(Path(name), Path(name) / "journals", dice.randrange(10**6))
            painter.paint_for(dice.uniform(0, 4))
            yield painter.kill()


def kill_windows(kills: int, seed: int) -> Iterator[Outcome]:
    """Kill the real editor, painted on with xdotool."""
    from support.desk import Desk
    from support.editing import pattern

    dice = random.Random(seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        root = folder / "state" / "fluidwarp" / "journals"
        write_picture(folder / "pattern.png", pattern())
        desk = Desk(folder, threads=True)
        try:
            for _ in range(kills):
                painter = Painter(root, ["--edit", str(folder / "pattern.png")], desk.env)
                moment = 0.0
                while painter.process.poll() is None:
                    _drag(desk.do, dice)
                    if painter.has_begun and not moment:
                        delay = dice.uniform(0, 6)
                        moment = time.monotonic() + delay
                        threading.Timer(delay, painter.process.kill).start()
                    time.sleep(dice.uniform(0, 0.4))
                yield painter.outcome(moment)
                shutil.rmtree(root)
        finally:
            desk.close()


def _drag(do: Callable[..., str], dice: random.Random) -> None:
    x, y, dx, dy = dice.randint(250, 750), dice.randint(250, 600), dice.randint(20, 60), dice.randint(-60, 60)
    words = ["mousemove", str(x), str(y), "mousedown", "1"]
    for step in range(1, 5):
        words += ["mousemove", str(x + dx * step // 4), str(y + dy * step // 4), "sleep", "0.03"]
    do(*words, "mouseup", "1")


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


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--window", action="store_true")
    parser.add_argument("--busy", action="store_true")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--paint", type=Path, nargs=2, help=argparse.SUPPRESS)
    parser.add_argument("--edit", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.paint is not None:
        folder, root = given.paint
        paint(folder, root, given.seed)
    if given.edit is not None:
        open_window(given.edit)
        return 0
    outcomes = []
    with busy(2 if given.busy else 0):
        for outcome in (kill_windows if given.window else kill_painters)(given.kills, given.seed):
            outcomes.append(outcome)
            print(f"{len(outcomes)}: {outcome}", flush=True)
    strokes, lost = sum(one.strokes for one in outcomes), sum(one.lost for one in outcomes)
    inexact = sum(not one.is_exact for one in outcomes)
    print(f"{len(outcomes)} kills, {strokes} strokes, {lost} lost, {inexact} inexact")
    return 1 if lost or inexact else 0


if __name__ == "__main__":
    sys.exit(main())

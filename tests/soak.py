"""A long day's painting in a row, without a window: does memory stay flat?

    python tests/soak.py [--strokes 10000] [--undos 1000] [--pictures 100] [--seed 0]

Every so many strokes another picture is opened in the same editor, after the last one was saved; every so many of them
some are undone and made again. Told are resident memory and the objects of OpenGL, each time that a picture is opened;
ends with 0 if both are at the end within a tenth of what they were when a tenth was done.
"""

from __future__ import annotations

import argparse
import os
import random
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parent.parent
sys.path[:0] = [path for path in (str(ROOT), str(ROOT / "tests")) if path not in sys.path]

import numpy as np  # noqa: E402

from app.media.pictures import write_picture  # noqa: E402
from app.ui.files import load_any  # noqa: E402
from solver.gl.device import Device  # noqa: E402
from support.editing import Robot, pattern, small_project  # noqa: E402
from support.gl_objects import living  # noqa: E402

MOST = 1.1  # times what it was after the warm-up
TOOLS = "wtbvfseg"


def resident() -> float:
    """MiB of this process in memory."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def paint(robot: Robot, dice: random.Random, strokes: int, undos: int) -> None:
    """Strokes of all tools anywhere, and, spread among them, as many undone and made again."""
    undone = 0
    for number in range(strokes):
        robot.key(dice.choice(TOOLS))
        start = dice.uniform(0.05, 0.95), dice.uniform(0.05, 0.95)
        robot.drag(start, (dice.uniform(0.05, 0.95), dice.uniform(0.05, 0.95)), steps=dice.randint(1, 4))
        robot.rest()
        while undone < undos * (number + 1) // strokes:
            back = min(dice.randint(1, 4), undos - undone)
            for chord in ("ctrl+z", "ctrl+shift+z"):
                for _ in range(back):
                    robot.key(chord)
                robot.rest()
            undone += back
    assert np.isfinite(robot.warp()).all()


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--strokes", type=int, default=10_000)
    parser.add_argument("--undos", type=int, default=1_000)
    parser.add_argument("--pictures", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    dice, sizes, begun = random.Random(options.seed), [], time.monotonic()
    with tempfile.TemporaryDirectory() as name, Device.headless() as device:
        folder = Path(name)
        robot = Robot(device, small_project(folder), size=(640, 480), journals=folder / "journals")
        for number in range(options.pictures):
            picture = folder / f"{number}.png"
            write_picture(picture, pattern(dice.randint(100, 400), dice.randint(100, 400)))
            robot.editor.open(load_any(picture))
            robot.editor.session.begin_with(grid=64)
            paint(robot, dice, options.strokes // options.pictures, options.undos // options.pictures)
            assert robot.editor.files.save_as(folder / f"{number}.fluidwarp")
            robot.until(lambda: not robot.editor.recovery.is_busy)
            sizes.append((resident(), sum(living(device).values())))
            took = time.monotonic() - begun
            print(f"{number + 1} pictures, {took:.0f} s: {sizes[-1][0]:.0f} MiB, {sizes[-1][1]} objects", flush=True)
        robot.close()
    warm = sizes[len(sizes) // 10]
    ratios = [last / then for last, then in zip(sizes[-1], warm, strict=True)]
    print(f"at the end {ratios[0]:.3f} of the memory and {ratios[1]:.3f} of the objects after a tenth")
    return int(max(ratios) > MOST)


if __name__ == "__main__":
    sys.exit(main())

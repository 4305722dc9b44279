"""A long day's painting in a row, without a window: does memory stay flat?

    python tests/soak.py [--strokes 10000] [--undos 1000] [--pictures 100] [--seed 0]

Every so many strokes another picture is opened in the same editor, after the last one was saved; every so many of them
some are undone and made again. What a work holds while it is painted on depends on its size: up to 320 MiB of
checkpoints, and as much of the work before it. So memory and the objects of OpenGL are looked at where there is the
same to hold each time: when the work has been left, for a small picture that is opened twice and not touched. Both are
told; ends with 0 if at the end they are within a tenth of what they were after the warm-up, which is over once a tenth
is done and as many works are open as Undo comes back to at most.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parent.parent
sys.path[:0] = [path for path in (str(ROOT), str(ROOT / "tests")) if path not in sys.path]

import numpy as np  # noqa: E402

from app.media.pictures import write_picture  # noqa: E402
from app.ui.workspace import MOST_OPENED  # noqa: E402
from solver.gl.device import Device  # noqa: E402
from support.editing import Robot, pattern, small_project  # noqa: E402
from support.gl_objects import living  # noqa: E402
from support.resources import resident  # noqa: E402

MOST = 1.1  # times what it was after the warm-up
TOOLS = "wtbvfseg"
LEAVING = 2  # works later one has nothing on the GPU any more


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
    each = options.strokes // options.pictures, options.undos // options.pictures
    dice, sizes, begun = random.Random(options.seed), [], time.monotonic()
    with tempfile.TemporaryDirectory() as name, Device.headless() as device:
        folder = Path(name)
        robot = Robot(device, small_project(folder), size=(640, 480), journals=folder / "journals")
        for number in range(options.pictures):
            picture = folder / f"{number}.png"
            write_picture(picture, pattern(dice.randint(100, 400), dice.randint(100, 400)))
            robot.drop(picture)
            robot.editor.session.begin_with(grid=64)
            paint(robot, dice, *each)
            assert robot.editor.files.save_as(folder / f"{number}.fluidwarp")
            painted, kept = resident() / 2**20, robot.editor.session.replay.checkpoints.nbytes / 2**20
            for _ in range(LEAVING):
                robot.drop(folder / "pattern.png")
            sizes.append((resident() / 2**20, sum(living(device).values())))
            at_work = f"{painted:.0f} MiB, {kept:.0f} of them its checkpoints"
            left = f"{sizes[-1][0]:.0f} MiB, {sizes[-1][1]} objects when left"
            print(f"{number + 1} pictures, {time.monotonic() - begun:.0f} s: {at_work}; {left}", flush=True)
        robot.close()
    warm = sizes[min(max(len(sizes) // 10, MOST_OPENED // (1 + LEAVING) + 1), len(sizes) - 1)]
    ratios = [last / then for last, then in zip(sizes[-1], warm, strict=True)]
    print(f"at the end {ratios[0]:.3f} of the memory and {ratios[1]:.3f} of the objects after the warm-up")
    return int(max(ratios) > MOST)


if __name__ == "__main__":
    sys.exit(main())

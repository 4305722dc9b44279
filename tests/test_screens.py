"""The window as it should look: pictures of its main states, compared with a tolerance on a software rasteriser.

After a change of the looks that is meant: `FLUIDWARP_GOLDEN=write pytest tests/test_screens.py`, and look at them.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from app.pictures import Picture, read_picture, write_picture
from editing import Robot, small_project
from solver.context import Device

GOLDEN = Path(__file__).parent / "golden"
SIZE = (960, 600)
SQUARE = 24


@pytest.fixture
def robot(device: Device, tmp_path: Path) -> Iterator[Robot]:
    if not device.limits.is_software:
        pytest.skip("golden pictures are of the software rasteriser")
    robot = Robot(device, small_project(tmp_path), SIZE)
    yield robot
    robot.close()


def start(robot: Robot) -> None:
    robot.move(700, 20)


def warped(robot: Robot) -> None:
    robot.drag((0.35, 0.5), (0.5, 0.45))
    robot.rest()
    robot.key("f")
    robot.drag((0.7, 0.4), (0.7, 0.5), steps=4)
    robot.rest()
    for key in ("1", "3", "4"):
        robot.key(key)
    robot.move(700, 20)


def shortcuts(robot: Robot) -> None:
    robot.key("f1")
    robot.move(5, 5)
    robot.frame(count=3)


def export(robot: Robot) -> None:
    robot.drag((0.35, 0.5), (0.5, 0.45))
    robot.rest()
    robot.key("ctrl+e")
    robot.editor.dialogs[-1].folder = Path("folder")  # pyright: ignore[reportAttributeAccessIssue]
    robot.move(5, 5)
    robot.frame(count=3)


def light(robot: Robot) -> None:
    robot.drag((0.35, 0.5), (0.5, 0.45))
    robot.rest()
    robot.key("ctrl+l")
    robot.key("y")
    robot.move(700, 20)


def coarse(pixels: np.ndarray) -> np.ndarray:
    """The means of squares of `SQUARE` pixels."""
    height, width = (side // SQUARE for side in pixels.shape[:2])
    squares = pixels[: height * SQUARE, : width * SQUARE].reshape(height, SQUARE, width, SQUARE, 3)
    return squares.mean(axis=(1, 3))


@pytest.mark.parametrize("state", [start, warped, shortcuts, export, light], ids=lambda state: state.__name__)
def test_looks_as_it_should(robot: Robot, state: Callable[[Robot], None], tmp_path: Path) -> None:
    state(robot)
    robot.frame(count=2)
    seen = robot.pixels()
    path = GOLDEN / f"editor-{state.__name__}.png"
    if os.environ.get("FLUIDWARP_GOLDEN") == "write":
        write_picture(path, Picture(seen))
    difference = np.abs(coarse(seen) - coarse(read_picture(path).pixels)).max(axis=2)
    # Letters and thin lines may fall a little differently with another version of the libraries or another rounding of
    # the solver; what is where, and in which colour, may not.
    if difference.mean() >= 3 or (difference > 40).mean() >= 0.02:
        write_picture(tmp_path / "seen.png", Picture(seen))
        magnified = np.minimum(np.kron(difference * 4, np.ones((SQUARE, SQUARE))), 255).astype(np.uint8)[..., None]
        write_picture(tmp_path / "difference.png", Picture(magnified))
        pytest.fail(f"differs by {difference.mean():.2f} on average; see {tmp_path}")

"""The window as it should look: pictures of its main states, compared with a tolerance on a software rasteriser.

After a change of the looks that is meant: `FLUIDWARP_GOLDEN=write pytest tests/ui/test_screens.py`, and look at them.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from app.media.pictures import read_picture, write_picture
from app.model.picture import Picture
from app.ui.events import Mods
from solver.gl.device import Device
from support.editing import Robot, add_bars, small_project

GOLDEN = Path(__file__).parents[1] / "golden"
SIZE = (960, 600)
SQUARE = 24


@pytest.fixture
def robot(device: Device, tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Robot]:
    """An editor on a screen of one pixel a point, or of as many as the test says."""
    if not device.limits.is_software:
        pytest.skip("golden pictures are of the software rasteriser")
    with Robot(device, small_project(tmp_path), SIZE, density=getattr(request, "param", 1.0)) as robot:
        yield robot


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
    robot.editor.dialogs.shown[-1].folder = Path("folder")  # pyright: ignore[reportAttributeAccessIssue]
    robot.move(5, 5)
    robot.frame(count=3)


def light(robot: Robot) -> None:
    robot.drag((0.35, 0.5), (0.5, 0.45))
    robot.rest()
    robot.key("ctrl+l")
    robot.key("y")
    robot.move(700, 20)


def light_masks(robot: Robot) -> None:
    robot.key("ctrl+l")
    robot.key("v")
    robot.drag((0.3, 0.5), (0.4, 0.5), hold=20)
    robot.key("f")
    robot.drag((0.7, 0.4), (0.7, 0.5), steps=4)
    robot.rest()
    for key in ("2", "3"):
        robot.key(key)
    robot.move(700, 20)


def selected(robot: Robot) -> None:
    robot.key("m")
    robot.drag((0.1, 0.2), (0.6, 0.7))
    robot.editor.state.select_by = "ellipse"
    robot.mods = Mods(alt=True)
    robot.drag((0.3, 0.3), (0.5, 0.6))
    robot.mods = Mods()
    robot.move(700, 20)


def lanes(robot: Robot) -> None:
    for tool, start, end in (
        ("p", (0.3, 0.5), (0.4, 0.5)),
        ("t", (0.6, 0.5), (0.6, 0.4)),
        ("b", (0.5, 0.3), (0.5, 0.3)),
    ):
        robot.key(tool)
        robot.drag(start, end, steps=14)
        robot.rest()
    session = robot.editor.session
    add_bars(session)
    robot.rest()
    session.seek(session.end // 2)
    robot.key("l")
    robot.rest()
    rect = next(rect for bar, rect in robot.editor.state.lanes.drawn if bar.which == ("stroke", 1))
    robot.click(*rect.middle)
    robot.move(700, 20)


def light_export(robot: Robot) -> None:
    robot.key("ctrl+l")
    export(robot)


def error(robot: Robot) -> None:
    robot.key("ctrl+l")
    robot.editor.messages.warn("Cannot read a.png: it is no picture, or damaged; get it again.")
    robot.move(700, 20)


def coarse(pixels: np.ndarray) -> np.ndarray:
    """The means of squares of `SQUARE` pixels."""
    height, width = (side // SQUARE for side in pixels.shape[:2])
    squares = pixels[: height * SQUARE, : width * SQUARE].reshape(height, SQUARE, width, SQUARE, 3)
    return squares.mean(axis=(1, 3))


STATES = [start, warped, shortcuts, export, light, light_masks, selected, lanes, light_export, error]


@pytest.mark.parametrize("state", STATES, ids=lambda state: state.__name__)
def test_looks_as_it_should(robot: Robot, state: Callable[[Robot], None], tmp_path: Path) -> None:
    compare(robot, state, f"editor-{state.__name__}.png", tmp_path)


@pytest.mark.parametrize("robot", [2.0], indirect=True, ids=["2x"])
@pytest.mark.parametrize("state", [start, light_masks], ids=lambda state: state.__name__)
def test_looks_as_it_should_on_a_fine_screen(robot: Robot, state: Callable[[Robot], None], tmp_path: Path) -> None:
    compare(robot, state, f"editor-{state.__name__}-2x.png", tmp_path)


def compare(robot: Robot, state: Callable[[Robot], None], name: str, folder: Path) -> None:
    """Make the state, and see that it looks like the golden picture of that name."""
    state(robot)
    robot.see()
    robot.frame()
    seen = robot.pixels()
    path = GOLDEN / name
    if os.environ.get("FLUIDWARP_GOLDEN") == "write":
        write_picture(path, Picture(seen))
    difference = np.abs(coarse(seen) - coarse(read_picture(path).pixels)).max(axis=2)
    # Letters and thin lines may fall a little differently with another version of the libraries or another rounding of
    # the solver; what is where, and in which colour, may not.
    if difference.mean() >= 1 or (difference > 40).mean() > 0.002:
        write_picture(folder / "seen.png", Picture(seen))
        magnified = np.minimum(np.kron(difference * 4, np.ones((SQUARE, SQUARE))), 255).astype(np.uint8)[..., None]
        write_picture(folder / "difference.png", Picture(magnified))
        pytest.fail(f"differs by {difference.mean():.2f} on average; see {folder}")

"""What is drawn over the picture, measured in pixels: the brush's ring and the split."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.media.pictures import write_picture
from app.model.handles import RecipeHandle
from app.model.picture import Picture
from app.ui.files import load_any
from app.ui.theme import PALETTES
from solver.gl.device import Device
from support.editing import Robot


@pytest.fixture(params=[(240, 120), (120, 240)], ids=["wide", "high"])
def robot(device: Device, tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Robot]:
    """A picture of middle grey, on which black and white show."""
    width, height = request.param
    write_picture(tmp_path / "grey.png", Picture(np.full((height, width, 3), 110, np.uint8)))
    with Robot(device, load_any(tmp_path / "grey.png")) as robot:
        yield robot


def brightness_by_radius(robot: Robot, x: float, y: float) -> np.ndarray:
    """The mean brightness at each distance, in pixels, from a point of the screen."""
    seen = robot.pixels().mean(axis=-1)
    rows, columns = np.indices(seen.shape)
    r = np.hypot(columns + 0.5 - x, rows + 0.5 - y).round().astype(int)
    near = r < 250
    return np.bincount(r[near], seen[near]) / np.bincount(r[near])


@pytest.mark.parametrize(
    ("tool", "radius", "hardness"), [("p", 0.2, 0.0), ("p", 0.1, 0.5), ("t", 0.15, 1.0), ("f", 0.2, 0.0)]
)
def test_the_ring_is_as_large_as_the_brush(robot: Robot, tool: str, radius: float, hardness: float) -> None:
    """Faint where the brush ends, bright where it is half as strong; of what freezes, both in one."""
    robot.see()
    robot.key(tool)
    robot.editor.state.brush = replace(robot.editor.state.brush, radius=radius, hardness=hardness)
    x, y = (round(place) + 0.5 for place in robot.at(0.5, 0.5))
    robot.move(x, y)
    robot.frame(count=2)
    found = brightness_by_radius(robot, x, y)
    reach = radius * robot.editor.view.longer
    core = 1.0 if tool == "f" else 0.9 * hardness
    half = reach * (core + (1 - core) * (1 - 0.5 ** (1 / 3)) ** 0.5)
    lit = np.flatnonzero(found > 125)
    assert lit[lit > 6].max() == pytest.approx(reach if half < reach - 3 else half, abs=1.6)
    assert found[8:].argmax() + 8 == pytest.approx(half, abs=1.1)
    assert found[round(reach) + 5 : round(reach) + 15] == pytest.approx(110, abs=6)


def test_under_a_transparent_picture_lie_squares_of_the_themes_tones(device: Device, tmp_path: Path) -> None:
    write_picture(tmp_path / "clear.png", Picture(np.zeros((120, 160, 4), np.uint8)))
    robot = Robot(device, load_any(tmp_path / "clear.png"))
    try:
        robot.see()
        for theme in (PALETTES["dark"], PALETTES["light"]):
            robot.move(5, 5)
            robot.frame(count=2)
            x, y = (round(place) for place in robot.at(0.5, 0.5))
            tones, counts = np.unique(
                robot.pixels()[y - 32 : y + 32, x - 32 : x + 32].reshape(-1, 3), axis=0, return_counts=True
            )
            wanted = sorted(tuple(round(255 * part) for part in tone[:3]) for tone in theme.checker)
            assert [tuple(tone) for tone in tones] == wanted
            assert counts == pytest.approx(2048, abs=1)
            robot.key("ctrl+l")
    finally:
        robot.close()


def test_what_is_opaque_beside_what_is_transparent_shows_no_squares(device: Device, tmp_path: Path) -> None:
    pixels = np.full((120, 160, 4), (110, 110, 110, 255), np.uint8)
    pixels[:, :40, 3] = 0
    write_picture(tmp_path / "half.png", Picture(pixels))
    robot = Robot(device, load_any(tmp_path / "half.png"))
    try:
        robot.see()
        robot.move(5, 5)
        robot.frame(count=2)
        x, y = (round(place) for place in robot.at(0.7, 0.5))
        assert robot.pixels()[y - 20 : y + 20, x - 20 : x + 20] == pytest.approx(110, abs=1)
    finally:
        robot.close()


def test_the_other_direction_has_a_minus_in_the_ring(robot: Robot) -> None:
    robot.see()
    x, y = (round(place) + 0.5 for place in robot.at(0.5, 0.5))
    robot.move(x, y)
    plain = robot.pixels().astype(int)
    robot.key("shift+p")
    robot.frame()
    changed = (
        np.abs(robot.pixels() - plain)[round(y) - 12 : round(y) + 12, round(x) - 12 : round(x) + 12].max(axis=-1) > 30
    )
    rows, columns = np.nonzero(changed)
    assert np.ptp(columns) >= 8 > 4 >= np.ptp(rows)


def test_the_split_shows_what_was_on_its_left(robot: Robot) -> None:
    """ "Before" is the longer word: the box on its ground reaches farther than that of "After"."""
    robot.see()
    robot.key("y")
    robot.move(5, 5)
    robot.frame(count=2)
    x, _ = robot.at(0.5, 0.5)
    top = max(robot.editor.view.rect.y, robot.editor.view.canvas.y)
    row = robot.pixels()[round(top) + 13].astype(int).max(axis=-1) < 80
    left, right = (
        int(row[part].sum()) for part in (slice(round(x) - 90, round(x) - 8), slice(round(x) + 8, round(x) + 90))
    )
    assert left > right + 5 > 25


def test_over_the_original_there_are_no_marks(robot: Robot) -> None:
    """Axes, the split and handles belong to the result."""
    robot.see()
    state, session = robot.editor.state, robot.editor.session
    robot.move(5, 5)
    robot.hold("\\", True)
    robot.frame(count=2)
    original = robot.pixels()
    robot.hold("\\", False)
    state.symmetry, state.split = "both", 0.3
    session.edit("Handle", handle=(RecipeHandle(at=(0.3, 0.3), to=(0.4, 0.3)),))
    robot.hold("\\", True)
    robot.frame(count=2)
    shown = robot.pixels()
    canvas = robot.editor.view.canvas
    there = slice(int(canvas.y), int(canvas.bottom)), slice(int(canvas.x), int(canvas.right))
    np.testing.assert_array_equal(shown[there], original[there])
    robot.hold("\\", False)
    robot.frame(count=2)
    assert (robot.pixels()[there] != original[there]).any(axis=-1).sum() > 100

"""Viscosity laid over the picture: its tints, the contour lines of its decades, and the legend."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from app.media.pictures import write_picture
from app.model.mask_edits import PictureMask, mask_edit
from app.model.picture import Picture
from app.ui.files import load_any
from solver.gl.device import Device
from support.editing import Robot


@pytest.fixture
def robot(device: Device, tmp_path: Path) -> Iterator[Robot]:
    """A picture of the grey that the legend's tints lie on."""
    write_picture(tmp_path / "grey.png", Picture(np.full((240, 480, 3), 128, np.uint8)))
    robot = Robot(device, load_any(tmp_path / "grey.png"))
    robot.see()
    robot.editor.state.overlays["viscosity"].shown = True
    yield robot
    robot.close()


def decades(robot: Robot, of_white: float) -> None:
    """Let the picture be thicker from left to right, evenly, by so many decades at its right edge."""
    folder = robot.editor.session.project.folder
    ramp = np.broadcast_to((np.arange(480) + 0.5) / 480, (240, 480))
    write_picture(folder / "ramp.png", Picture((ramp * 65535).round().astype(np.uint16)[..., None]))
    name = str(folder / "ramp.png")
    edit = PictureMask(kind="picture", tick=0, of="thickness", picture=name, white=of_white)
    robot.editor.session.edit_masks("ramp", edit)
    robot.move(5, 5)
    robot.frame(count=3)


def middle_row(robot: Robot) -> np.ndarray:
    """The brightness of a row of the picture, and of a wide one below it, in pixels of the screen."""
    rect = robot.editor.view.rect
    y, x = round(rect.y + rect.height / 2), round(rect.x)
    return robot.pixels()[y, x : x + round(rect.width)].astype(int).sum(axis=-1)


@pytest.mark.parametrize("of_white", [5.0, 2.5, -2.5])
def test_a_line_runs_along_every_whole_decade(robot: Robot, of_white: float) -> None:
    decades(robot, of_white)
    row = middle_row(robot)
    beside = np.maximum(np.roll(row, 6), np.roll(row, -6))
    lit = np.flatnonzero(row[8:-8] - beside[8:-8] > 60) + 8
    groups = np.split(lit, np.flatnonzero(np.diff(lit) > 3) + 1)
    wanted = [number / abs(of_white) for number in range(1, int(np.ceil(abs(of_white))))]
    assert [group.mean() / len(row) for group in groups] == pytest.approx(wanted, abs=2 / len(row))


def test_where_it_is_the_same_all_over_there_is_no_line(robot: Robot) -> None:
    for amount in (1.0, 2.0):
        robot.editor.session.edit_masks(
            "fill", mask_edit({"kind": "fill", "tick": 0, "of": "thickness", "amount": amount})
        )
        robot.move(5, 5)
        robot.frame(count=3)
        row = middle_row(robot)
        assert len(set(row[10:-10])) == 1


def test_the_legend_has_the_tints_of_the_picture(robot: Robot) -> None:
    seen = {}
    for amount in (-1.0, 0.0, 1.0, 2.0, 3.0):
        robot.editor.session.edit_masks(
            "fill", mask_edit({"kind": "fill", "tick": 0, "of": "thickness", "amount": amount})
        )
        robot.move(5, 5)
        robot.frame(count=3)
        x, y = robot.at(0.5, 0.5)
        seen[amount] = robot.pixels()[round(y), round(x)].astype(int)
    canvas = robot.editor.layout.canvas
    pixels = robot.pixels()[round(canvas.bottom) - 34 : round(canvas.bottom) - 18, round(canvas.x) + 12 :][:, :300]
    for amount, tint in seen.items():
        same = (np.abs(pixels - tint).max(axis=-1) <= 1).sum()
        assert same > 60, f"{amount} decades"
    assert len({tuple(tint) for tint in seen.values()}) == 5

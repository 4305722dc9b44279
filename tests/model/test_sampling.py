"""Pictures and shapes as numbers: the very numbers, where others only look at what is made of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from app.media.auxiliary import Pictures
from app.media.pictures import write_picture
from app.model.picture import Picture
from app.model.sampling import Segment, Window, distance_to_path, falloff, intensity
from solver.grid import Grid


def row(*colours: tuple[int, ...]) -> Picture:
    return Picture(np.array([colours], np.uint8))


def test_luma_is_that_of_rec_709() -> None:
    found = intensity(row((255, 0, 0, 255), (0, 255, 0, 255), (0, 0, 255, 255), (255, 255, 255, 51)))
    np.testing.assert_allclose(found[0], [0.2126, 0.7152, 0.0722, 0.2], atol=1e-6)


@pytest.mark.parametrize("hardness", [0.0, 0.5, 1.0])
def test_a_brush_falls_off_as_it_is_defined(hardness: float) -> None:
    q = np.linspace(0, 1.2, 25)
    core = 0.9 * hardness
    wanted = np.where(q < core, 1, np.where(q < 1, (1 - ((q - core) / (1 - core)) ** 2), 0) ** 3)
    np.testing.assert_allclose(falloff(q, hardness), wanted, atol=1e-12)


def test_a_path_ends_at_its_ends() -> None:
    grid = Grid(40, 20)
    x, y = grid.centres()
    found = distance_to_path(np.array([(0.3, 0.25), (0.5, 0.25), (0.5, 0.4)]), grid)
    along = np.hypot(x - x.clip(0.3, 0.5), y - 0.25), np.hypot(x - 0.5, y - y.clip(0.25, 0.4))
    np.testing.assert_allclose(found, np.minimum(*along), atol=1e-12)
    dot = distance_to_path(np.array([(0.3, 0.25)]), grid)
    np.testing.assert_allclose(dot, np.hypot(x - 0.3, y - 0.25), atol=1e-12)


def test_a_window_rises_smoothly_within_its_soft_edge() -> None:
    grid = Grid(100, 50)
    x, _ = grid.centres()
    weight = Window(box=(0.1, -1.0, 0.9, 2.0), soft=0.2).weight(grid)
    part = (np.minimum(x - 0.1, 0.9 - x) / 0.2).clip(0, 1)
    np.testing.assert_allclose(weight, part**2 * (3 - 2 * part), atol=1e-12)
    np.testing.assert_allclose(Window(box=(0.1, -1.0, 0.9, 2.0), soft=0.2, invert=True).weight(grid), 1 - weight)


def test_a_color_s_tolerance_is_the_distance_in_rgb(tmp_path: Path) -> None:
    """Two columns of pixels at each distance, one for the cells to either side."""
    picture = np.full((16, 32, 4), (100, 100, 100, 255), np.uint8)
    picture[:, 8:16, 0] += 30
    picture[:, 16:24] = (121, 121, 121, 255)  # 36.4 away
    picture[:, 24:, 3] = 100
    write_picture(tmp_path / "p.png", Picture(picture))
    for tolerance, columns in ((29, [1, 0, 0, 0]), (31, [1, 1, 0, 0]), (37, [1, 1, 1, 0])):
        segment = Segment(color="#646464", tolerance=tolerance / 255)
        found = segment.weight("p.png", Grid(32, 16), Pictures(Picture(picture), tmp_path))
        assert found[8, 4::8].tolist() == columns

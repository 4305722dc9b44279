"""Which grid a machine can paint on."""

from __future__ import annotations

import pytest

from app.ui.quality import Speed


@pytest.mark.parametrize(("growing", "grid"), [(8, 256), (32, 128), (500, 96), (0.1, 384)])
def test_the_grid_is_the_finest_that_leaves_three_tenths_of_a_frame(growing: float, grid: int) -> None:
    """Of a sixtieth of a second that is 11.7 ms, of which drawing takes 1.7."""
    assert Speed(fixed=2, growing=growing, drawing=1.65).best_grid == grid


@pytest.mark.parametrize(
    ("fine", "coarse", "drawing", "wanted"),
    [
        (20.0, 8.0, 2.0, (2.0, 16.0)),
        (9.0, 9.0, 3.0, (6.0, 0.0)),
        (8.0, 9.0, 3.0, (5.0, 0.0)),
        (20.0, 5.0, 2.0, (0.0, 20.0)),
    ],
)
def test_a_speed_gives_back_the_frames_that_it_was_told_from(
    fine: float, coarse: float, drawing: float, wanted: tuple[float, float]
) -> None:
    """With a tick on 256 cells and on 128; noise makes nothing negative."""
    speed = Speed.of(fine, coarse, drawing)
    assert (speed.fixed, speed.growing, speed.drawing) == (*wanted, drawing)
    if fine >= coarse and speed.fixed:
        assert (speed.tick(256), speed.tick(128)) == (fine - drawing, coarse - drawing)

"""Which grid a machine can paint on."""

from __future__ import annotations

import pytest

from app.ui.quality import Speed


@pytest.mark.parametrize(("growing", "grid"), [(8, 256), (32, 128), (500, 96), (0.1, 384)])
def test_the_grid_is_the_finest_that_leaves_three_tenths_of_a_frame(growing: float, grid: int) -> None:
    """Of a sixtieth of a second that is 11.7 ms, of which drawing takes 1.7."""
    assert Speed(fixed=2, growing=growing, drawing=1.65).best_grid == grid

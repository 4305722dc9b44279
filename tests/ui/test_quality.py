"""Which grid a machine can paint on."""

from __future__ import annotations

import pytest

from app.ui.quality import Speed


@pytest.mark.parametrize(("growing", "grid"), [(16, 256), (64, 128), (1000, 96), (0.1, 384)])
def test_the_grid_is_the_finest_that_leaves_three_tenths_of_a_frame(growing: float, grid: int) -> None:
    """Of a thirtieth of a second that is 23.3 ms, of which drawing takes 3.3."""
    assert Speed(fixed=4, growing=growing, drawing=3.3).best_grid == grid

"""The properties of tests/properties/strokes.py with a few seeds; nightly.py tries them with new ones."""

from __future__ import annotations

import pytest

from properties.strokes import check_strokes_fold_nothing
from solver import Device


# That folded where the map made any step in one: along the edge, across it, over a frozen place, out of the picture.
@pytest.mark.parametrize("seed", [10, 34, 54, 51])
def test_quick_strokes_fold_nothing(device: Device, seed: int):
    check_strokes_fold_nothing(device, seed)

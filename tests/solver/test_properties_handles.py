"""Lines led at random; more seeds: tests/nightly.py -k handles."""

from __future__ import annotations

import pytest

from properties.handles import check_lines
from solver import Device


@pytest.mark.parametrize("seed", [1])
def test_lines_led_at_random_fold_nothing_and_come_to_rest(seed: int, device: Device):
    assert check_lines(device, seed, cells=16, texels=64)["without a reason"] == 0

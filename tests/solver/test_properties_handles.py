"""Lines, and recipes with handles, at random; more seeds: tests/nightly.py -k handles."""

from __future__ import annotations

import pytest

from properties.handles import check_lines
from properties.led import check_handles_beside_frozen, check_handles_fold_nothing, check_quick_push
from solver import Device


@pytest.mark.parametrize("seed", [1])
def test_lines_led_at_random_fold_nothing_and_come_to_rest(seed: int, device: Device):
    assert check_lines(device, seed, cells=16, texels=64)["without a reason"] == 0


# Which folded; 109 until the map had images at the edge, 342 until a map was closed where its cubic is uneven.
@pytest.mark.parametrize("seed", [102, 109, 116, 342])
def test_handles_in_a_recipe_fold_nothing(seed: int, device: Device):
    check_handles_fold_nothing(device, seed)


@pytest.mark.parametrize("seed", [0, 34])  # that folded in the last half cell before the picture's edge
def test_handles_beside_a_small_frozen_disc_at_the_edge_fold_nothing(seed: int, device: Device):
    check_handles_beside_frozen(device, seed)


@pytest.mark.parametrize("seed", [33, 34, 35])  # that folded while a tick was one step of the map
def test_a_push_of_more_than_a_radius_a_tick_folds_nothing(seed: int, device: Device):
    check_quick_push(device, seed)

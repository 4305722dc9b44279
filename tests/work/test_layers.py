"""Channels beside the colours: looked up together, and each of them as it would be alone."""

from __future__ import annotations

import numpy as np
import pytest

from app.model.picture import Layer
from app.work.layers import resample_layers
from solver.resample.plan import Quality

KINDS = {"float32": False, "float16": False, "uint32": True}


@pytest.mark.parametrize("counts", [(0, 0), (1, 0), (2, 0), (3, 1), (4, 2), (5, 3), (0, 4), (8, 5)], ids=str)
def test_any_number_of_channels_is_looked_up_in_their_order(counts: tuple[int, int]) -> None:
    """Some are mixed, some exact, in turns; by one or three planes at once, as more would be taken for alpha."""
    dice, asked = np.random.default_rng(0), set[tuple[int, Quality]]()

    def look_up(pixels: np.ndarray, quality: Quality) -> np.ndarray:
        asked.add((pixels.shape[2], quality))
        return pixels[::-1, ::-1]

    kinds = [kind for kind, count in zip(("float32", "uint32"), counts, strict=True) for _ in range(count)]
    layers = []
    for number in dice.permutation(len(kinds)).tolist():
        kind = "float16" if kinds[number] == "float32" and number % 2 else kinds[number]
        values = (dice.random((4, 6)) * (2**32 - 1 if KINDS[kind] else 1)).astype(kind)
        layers.append(Layer(f"n{number}", values, KINDS[kind]))
    made = resample_layers(layers, look_up, "catmull-rom")
    assert [layer.name for layer in made] == [layer.name for layer in layers]
    for layer, given in zip(made, layers, strict=True):
        assert layer.values.dtype == given.values.dtype
        np.testing.assert_array_equal(layer.values, given.values[::-1, ::-1])
    assert asked <= {(count, quality) for count in (1, 3) for quality in ("catmull-rom", "nearest")}

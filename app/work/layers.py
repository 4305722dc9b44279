"""The further channels of a picture, and what lies beyond its display window, looked up where its colours are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from app.media.depth import as_half
from app.media.displacement import Displacement
from app.model.picture import Layer
from solver.resample.plan import Quality

AT_ONCE = 3  # planes: with two or four the last would be taken for alpha

LookUp = Callable[[np.ndarray, Quality], np.ndarray]
"""Looks up pixels (h, w, 1 or 3), uint16 or float32."""


def resample_layers(layers: Sequence[Layer], look_up: LookUp, quality: Quality) -> tuple[Layer, ...]:
    """Layers looked up in a quality, but for the exact ones: bit for bit from the nearest pixel."""
    mixed = [layer for layer in layers if not layer.exact]
    floats = _in_threes([layer.values.astype(np.float32, copy=False) for layer in mixed], look_up, quality)
    exact = [layer for layer in layers if layer.exact]
    # as whole numbers of 16 bits each, of which a GPU keeps every one
    split = [np.ascontiguousarray(layer.values).view(np.uint16) for layer in exact]
    words = [(values.shape[1] // layer.values.shape[1]) for layer, values in zip(exact, split, strict=True)]
    planes = [values[:, start::step] for values, step in zip(split, words, strict=True) for start in range(step)]
    found = iter(_in_threes(planes, look_up, "nearest"))
    made = {id(layer): _typed(plane, layer) for layer, plane in zip(mixed, floats, strict=True)}
    for layer, step in zip(exact, words, strict=True):
        together = np.stack([next(found) for _ in range(step)], axis=-1)
        made[id(layer)] = together.view(layer.values.dtype)[..., 0]
    return tuple(replace(layer, values=made[id(layer)]) for layer in layers)


def widened(given: Displacement, margins: tuple[int, int, int, int]) -> np.ndarray:
    """A map's values with margins around it, (h, w, 2) in longer sides of that; where it ends, its edge goes on."""
    left, top, right, bottom = margins
    more = max(0, max(margins) - given.overscan)
    values = np.pad(given.values, ((more, more), (more, more), (0, 0)), mode="edge")
    edge = given.overscan + more
    values = values[edge - top : len(values) - edge + bottom, edge - left : values.shape[1] - edge + right]
    return (values * (given.longest / max(values.shape[:2]))).astype(np.float32)


def _typed(plane: np.ndarray, layer: Layer) -> np.ndarray:
    return as_half(plane) if layer.values.dtype == np.float16 else plane


def _in_threes(planes: Sequence[np.ndarray], look_up: LookUp, quality: Quality) -> list[np.ndarray]:
    found: list[np.ndarray] = []
    for start in range(0, len(planes), AT_ONCE):
        taken = planes[start : start + AT_ONCE]
        together = np.stack([*taken, taken[0]] if len(taken) == 2 else taken, axis=-1)
        seen = look_up(np.ascontiguousarray(together), quality)
        found += [np.ascontiguousarray(seen[..., index]) for index in range(len(taken))]
    return found

"""Arrays that are nearly the same: `pytest.approx` goes through them number by number, a hundred times as slowly."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike


def assert_near(found: ArrayLike, wanted: ArrayLike, *, rel: float = 0.0, abs: float = 0.0, note: str = "") -> None:
    """As `found == pytest.approx(wanted, rel, abs)`: nowhere further off than the greater of both bounds.

    Args:
        found, wanted: of the same shape, but that `wanted` may be a single number.
        rel: part of what is wanted.
        abs: in the units of both.
        note: what is said if they differ.
    """
    there, here = np.asarray(wanted, float), np.asarray(found, float)
    assert there.ndim == 0 or here.shape == there.shape, f"{here.shape} is not {there.shape}: {note}"
    off = np.abs(here - there)
    beyond = ~(off <= np.maximum(rel * np.abs(there), abs))  # what is no number is far off
    assert not beyond.any(), f"{beyond.sum()} of {beyond.size} differ, by {np.nanmax(off[beyond])}: {note}"

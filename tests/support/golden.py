"""Numbers that are written down in `tests/golden`: they tell that something has changed, and not what is right.

After a change that is meant, `FLUIDWARP_GOLDEN=write pytest` of the one file with tests writes them anew; the reason
goes into the commit.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Self

import numpy as np
import pytest

from solver.gl.device import Device

GOLDEN = Path(__file__).parents[1] / "golden"
WRITES = os.environ.get("FLUIDWARP_GOLDEN") == "write"
CLOSE = 1e-4  # of the root mean square: another order of additions changes a tenth of that


def told(values: np.ndarray) -> list[float]:
    """The root mean square, and three sums of the values with random signs and weights, about as large."""
    flat = np.asarray(values, np.float64).ravel()
    weights = np.random.default_rng(flat.size).normal(size=(3, flat.size))
    return [float(np.sqrt((flat**2).mean())), *(weights @ flat / np.sqrt(flat.size)).tolist()]


class Golden:
    """The rows of a file, by name."""

    def __init__(self, name: str) -> None:
        self._path = GOLDEN / name
        lines = [] if WRITES else self._path.read_text("utf-8").splitlines()
        self._rows = {key: [float(n) for n in row.split()] for key, row in (line.split(": ") for line in lines)}

    @classmethod
    @contextmanager
    def of_software(cls, device: Device, name: str) -> Iterator[Self]:
        """Those of the software rasteriser, written in the end if that is wanted; elsewhere the test is skipped."""
        if not device.limits.is_software:
            pytest.skip("what is written down is of the software rasteriser")
        golden = cls(name)
        yield golden
        golden.close()

    def compare(self, name: str, numbers: list[float], close: float | None = None) -> None:
        """Assert that these are the numbers of a row: to `CLOSE` of the first, or to `close`."""
        if WRITES:
            self._rows[name] = numbers
        wanted = self._rows[name]
        assert numbers == pytest.approx(wanted, rel=0, abs=CLOSE * abs(wanted[0]) + 1e-9 if close is None else close), (
            name
        )

    def close(self) -> None:
        """Write what has been found, if that is wanted."""
        if WRITES:
            rows = (f"{name}: {' '.join(f'{number:.7g}' for number in row)}\n" for name, row in self._rows.items())
            self._path.write_text("".join(rows), "utf-8")

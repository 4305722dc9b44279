"""Numbers that are written down in `tests/golden`: they tell that something has changed, and not what is right.

After a change that is meant, `FLUIDWARP_GOLDEN=write pytest` of the one file with tests writes them anew; the reason
goes into the commit.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, Self

import numpy as np
import pytest
from pydantic import BaseModel

from solver.gl.device import Device

GOLDEN = Path(__file__).parents[1] / "golden"
WRITES = os.environ.get("FLUIDWARP_GOLDEN") == "write"
CLOSE = 1e-4  # of the root mean square: another order of additions changes a tenth of that

NAN, MOST = 12345.6, 1e30  # what NaN and infinity count as in a `Sum`


def told(values: np.ndarray) -> list[float]:
    """The root mean square, and three sums of the values with random signs and weights, about as large."""
    flat = np.asarray(values, np.float64).ravel()
    weights = np.random.default_rng(flat.size).normal(size=(3, flat.size))
    return [float(np.sqrt((flat**2).mean())), *(weights @ flat / np.sqrt(flat.size)).tolist()]


class Sum:
    """Any values as a few numbers: how many there are, a checksum of what are none, and what is told of them.

    Numbers count as `asinh(1e6 number)`: about a part of each, however small it is.
    """

    def __init__(self, scale: float = 1e6) -> None:
        self._scale = scale
        self._numbers: list[float] = []
        self._words = 0

    def add(self, value: Any) -> None:
        """One value more: a number, words, an array, or what holds several of these."""
        if type(value) is float:
            self._numbers.append(value)
        elif isinstance(value, np.ndarray) and value.dtype.kind in "biuf":
            self._word(f"array {value.shape}")
            self._numbers += value.astype(np.float64).ravel().tolist()
        elif isinstance(value, (float, int, Fraction, np.number)):
            self._numbers.append(float(value))
        elif isinstance(value, BaseModel):
            self.add({name: part for name, part in value if part != type(value).model_fields[name].default})
        elif is_dataclass(value):
            self.add({part.name: getattr(value, part.name) for part in fields(value)})
        elif isinstance(value, Mapping):
            for key in sorted(value, key=str):
                self._word(str(key))
                self.add(value[key])
        elif isinstance(value, (list, tuple)):
            self._word(f"{len(value)} of")
            for part in value:
                self.add(part)
        else:
            self._word(str(value))

    def _word(self, word: str) -> None:
        self._words = zlib.crc32(word.encode(), self._words)

    @property
    def row(self) -> list[float]:
        numbers = np.nan_to_num(np.array(self._numbers), nan=NAN, posinf=MOST, neginf=-MOST)
        parts = told(np.arcsinh(self._scale * numbers)) if self._numbers else []
        return [float(len(self._numbers)), float(self._words % 100_000), *parts]


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

    def has(self, prefix: str) -> bool:
        """Whether there are rows whose names begin so."""
        return any(name.startswith(prefix) for name in self._rows)

    def compare(self, name: str, numbers: list[float], close: float | None = None) -> None:
        """Assert that these are the numbers of a row: to `CLOSE` of the first, or to `close`."""
        if WRITES:
            self._rows[name] = numbers
        wanted = self._rows[name]
        assert numbers == pytest.approx(wanted, rel=0, abs=CLOSE * abs(wanted[0]) + 1e-9 if close is None else close), (
            name
        )

    def compare_all(
        self, found: dict[str, list[float]], prefix: str, close: float | Callable[[str, list[float]], float]
    ) -> None:
        """Assert that these are all rows whose names begin so, each to `close`, or as that says of it."""
        if WRITES:
            self._rows = {name: row for name, row in self._rows.items() if not name.startswith(prefix)} | found
        wanted = {name: row for name, row in self._rows.items() if name.startswith(prefix)}
        assert sorted(found) == sorted(wanted)
        told = [
            f"{name}: {found[name]} not {row}"
            for name, row in wanted.items()
            if found[name] != pytest.approx(row, rel=0, abs=close(name, row) if callable(close) else close)
        ]
        assert not told, "\n".join(told[:20])

    def close(self) -> None:
        """Write what has been found, if that is wanted."""
        if WRITES:
            rows = (f"{name}: {' '.join(f'{number:.7g}' for number in row)}\n" for name, row in self._rows.items())
            self._path.write_text("".join(rows), "utf-8")


def scenes_of(file: Path, version: str) -> Iterator[dict[str, list[str]]]:
    """The lines of a golden by scene, for a fixture; where it is to be written anew, what the tests put in there.

    `version`: of what has drawn it, its first line.
    """
    parts = {} if WRITES else dict(part.split("\n", 1) for part in file.read_text("utf-8").split("== ")[1:])
    scenes = {name: text.splitlines() for name, text in parts.items()}
    yield scenes
    if WRITES:
        lines = [line for name, found in scenes.items() for line in (f"== {name}", *found)]
        file.write_text("\n".join([version, *lines]) + "\n", "utf-8")

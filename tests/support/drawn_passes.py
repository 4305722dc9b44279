"""What each pass draws at first: a fault in one of many steps shows there, and need not in what comes of them all."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from solver.gl.field import Field
from solver.gl.passes import Pass
from support.golden import told

FIRST = 4  # draws of each program


class FirstDraws:
    """Notes what each program draws into fields the first times, by its shader and, of several of one, its number.

    Args:
        monkeypatch: of the test, at whose end nothing is noted any more.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self._names: dict[int, str] = {}
        self._kept: list[Pass] = []  # or another one could be taken for one that is gone
        self._drawn: dict[str, list[list[np.ndarray]]] = {}
        count, draw = Counter[str](), Pass.__call__

        def noting(one: Pass, target: Field | Sequence[Field], **inputs: Any) -> None:
            draw(one, target, **inputs)
            if id(one) not in self._names:
                count[one.shader] += 1
                self._names[id(one)] = f"{one.shader} {count[one.shader]}"
                self._kept.append(one)
            before = self._drawn.setdefault(self._names[id(one)], [])
            if len(before) < FIRST:
                fields = (target,) if isinstance(target, Field) else target
                before.append([_within(field, inputs.get("region")) for field in fields])

        monkeypatch.setattr(Pass, "__call__", noting)

    @property
    def rows(self) -> dict[str, list[float]]:
        """The numbers that tell of each output, a row for each."""
        return {
            f"{name} {number}": told(np.concatenate(several))
            for name, draws in self._drawn.items()
            for number, several in enumerate(zip(*draws, strict=True))
            if any(map(len, several))
        }


def _within(field: Field, region: Any) -> np.ndarray:
    """What a field holds in a region or several, and only there: elsewhere there may be anything."""
    parts = region if isinstance(region, list) else [region or (0, 0, *field.size)]
    found = [np.empty(0)]
    for left, top, width, height in parts:
        x, y = max(left, 0), max(top, 0)
        right, bottom = min(left + width, field.width), min(top + height, field.height)
        if right > x and bottom > y:
            found.append(field.get((x, y, right - x, bottom - y)).ravel())
    return np.nan_to_num(np.concatenate(found), nan=-1.0)

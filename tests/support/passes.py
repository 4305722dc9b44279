"""What each shader is given and draws, noted there: its draws, fields, numbers, regions, first texels.

Fast paths and early-outs change no result, and what an iteration corrects hardly one; but they are seen here.
"""

from __future__ import annotations

from collections import defaultdict
from typing import Any

import moderngl
import numpy as np
import pytest

from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.passes import Pass
from support.golden import Golden, Sum, told

CLOSE = 1e-3
"""Of numbers as `Sum` takes them: about a thousandth of each."""
NEAR = 3e-4
"""Of what is drawn, of the root mean square."""
ROUNDING = 1e-7
"""Of what is drawn: a residual is the difference of numbers about 1, and rounds as they do, however small it is."""
LOOKED_AT = 2  # of the draws of a pass


class Passes:
    """Notes from now on, and writes down by shader.

    Args:
        monkeypatch: of the test, at whose end nothing is noted any more.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self._draws: defaultdict[str, int] = defaultdict(int)
        self._drawn: defaultdict[str, list[np.ndarray]] = defaultdict(list)
        self._sums: defaultdict[str, Sum] = defaultdict(lambda: Sum(1e9))
        draw, write, read, copy = Pass.__call__, Field.set, Field.get, Field.copy_from
        compiled = Device.pass_
        names: dict[int, str] = {}

        def naming(device: Device, shader: str, **defines: object) -> Pass:
            found = compiled(device, shader, **defines)
            names[id(found)] = " ".join([shader, *(f"{name}={value}" for name, value in sorted(defines.items()))])
            return found

        def drawing(shown: Pass, target: Any, *, region: Any = None, **inputs: Any) -> None:
            targets = [target] if isinstance(target, Field) else list(target)
            regions = region if isinstance(region, list) else [] if region is None else [region]
            name = names.get(id(shown), shown.shader)
            self._note(name, {"target": targets, "regions": regions} | inputs)
            draw(shown, target, region=region, **inputs)
            if self._draws[name] <= LOOKED_AT:
                self._drawn[name] += [read(field).ravel() for field in targets]

        def writing(field: Field, array: np.ndarray, region: Any = None) -> None:
            self._note(f"into {_kind(field)}", {"region": region, "values": told(np.asarray(array))})
            write(field, array, region)

        def reading(field: Field, region: Any = None) -> np.ndarray:
            self._note(f"out of {_kind(field)}", {"region": region})
            return read(field, region)

        def copying(field: Field, other: Field) -> None:
            self._note(f"copied to {_kind(field)}", {"other": other})
            copy(field, other)

        monkeypatch.setattr(Device, "pass_", naming)
        monkeypatch.setattr(Pass, "__call__", drawing)
        monkeypatch.setattr(Field, "set", writing)
        monkeypatch.setattr(Field, "get", reading)
        monkeypatch.setattr(Field, "copy_from", copying)

    def _note(self, name: str, inputs: dict[str, Any]) -> None:
        self._draws[name] += 1
        for key in sorted(inputs):
            self._sums[name].add(key)
            self._sums[name].add(_plain(inputs[key]))

    def compare(self, golden: Golden, run: str) -> None:
        """Assert that all is as it is written down, and that nothing else was drawn."""
        found = {f"{run} {name}": [float(count), *self._sums[name].row] for name, count in self._draws.items()}
        found |= {f"{run} {name} drawn": told(np.concatenate(values)) for name, values in self._drawn.items()}
        golden.compare_all(found, f"{run} ", _tolerance)


def _tolerance(name: str, row: list[float]) -> float:
    return NEAR * row[0] + ROUNDING if name.endswith(" drawn") else CLOSE


def _plain(value: Any) -> Any:
    """A value with words for the fields in it."""
    if isinstance(value, (list, tuple)):
        return [_plain(part) for part in value]
    return _kind(value) if isinstance(value, Field | moderngl.Texture) else value


def _kind(field: Field | moderngl.Texture) -> str:
    return f"{field.label} {field.width} x {field.height} x {field.components} {field.dtype}"

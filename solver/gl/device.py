"""The GPU as the solver sees it: one GL 3.3 context, its compiled passes and its float textures."""

from __future__ import annotations

from collections import OrderedDict

import moderngl
import numpy as np

from solver.gl.context import Context
from solver.gl.field import DoubleField, Field, FieldError, numbers_in
from solver.gl.passes import Pass

# Passes that are kept compiled. Painting with all tools asks for some 200, and a frame for 60. Mesa keeps the code of
# each in memory, 1 to 15 MiB, and there are thousands of sets of defines.
MOST_PASSES = 192


class Device(Context):
    """One GL context and everything made in it."""

    def __init__(self, ctx: moderngl.Context, owns_context: bool = False) -> None:
        super().__init__(ctx, owns_context)
        self._passes: OrderedDict[tuple[str, frozenset[tuple[str, object]]], Pass] = OrderedDict()  # last used last

    def field(
        self,
        size: tuple[int, int],
        components: int = 1,
        label: str = "field",
        dtype: str = "f4",
    ) -> Field:
        """A zeroed texture that can be drawn into; see `solver.gl.field.Field`."""
        return Field(self, size, components, label, dtype)

    def double_field(self, size: tuple[int, int], components: int = 1, label: str = "field") -> DoubleField:
        """A ping-pong pair of fields; see `solver.gl.field.DoubleField`."""
        return DoubleField(self, size, components, label)

    def upload(self, array: np.ndarray, label: str = "upload", dtype: str | None = None) -> Field:
        """A field holding `array`, `(h, w)` or `(h, w, c)`; dtype from the array: uint8 -> f1, else f4.

        Raises:
            FieldError: on another shape, or on a value that is masked, no number or not finite.
        """
        array = numbers_in(label, array)
        if array.ndim not in (2, 3) or (array.ndim == 3 and not 1 <= array.shape[2] <= 4):
            raise FieldError(f"{label}: an array of shape {array.shape} was given, (h, w) or (h, w, 1-4) is wanted")
        kind = dtype or ("f1" if array.dtype == np.uint8 else "f4")
        components = 1 if array.ndim == 2 else array.shape[2]
        field = Field(self, (array.shape[1], array.shape[0]), components, label, kind, cleared=False)
        field.set(array)
        return field

    def pass_(self, shader: str, **defines: object) -> Pass:
        """The pass of fragment shader `shader` (a path below `shaders/`), compiled once for each set of defines.

        Of more than `MOST_PASSES` the least recently used is let go, and compiled again when it is wanted again.
        """
        key = shader, frozenset(defines.items())
        found = self._passes.get(key)
        if found is None:
            found = self._passes[key] = Pass(self, shader, defines)
            if len(self._passes) > MOST_PASSES:
                self._passes.popitem(last=False)
        else:
            self._passes.move_to_end(key)
        return found

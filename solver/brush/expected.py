"""The expected det J of a map, if it lost nothing: only sources and local motion change areas."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from solver.gl.device import Device
from solver.gl.field import DoubleField, Field
from solver.scheme import Scheme
from solver.state import State
from solver.warp.map import WarpMap
from solver.warp.strain import between_texels

LEAST = 1e-3  # that det J counts as at first
FINEST = 1024  # texels along the longer side, or as many as there are cells on the whole picture
EXPECTED = "expected"  # the name of the logarithms in a saved state


@dataclass(frozen=True)
class HandleState(State):
    """A copy of what handles know, with what is expected of the map if something is."""

    def with_arrays(self, device: Device, arrays: Mapping[str, np.ndarray]) -> HandleState:
        """One that holds what `arrays()` of any gave; ValueError if that is of something else."""
        rest, fields = dict(arrays), dict[str, Field]()
        given = rest.pop(EXPECTED, None)
        if given is not None:
            if given.ndim != 2 or min(given.shape) < 4 or given.dtype != np.float32 or not np.isfinite(given).all():
                raise ValueError(f"its {EXPECTED} is of another kind")
            fields[EXPECTED] = device.upload(given, f"{EXPECTED}, given")
        return HandleState(fields, rest)


class Expected:
    """ln det J over the whole picture, carried along with it, where only what carries it with a divergence changes it.

    The fluid keeps areas, but for sources and what is local. So what det J has besides this, the map has not resolved.
    It begins with the map as it is when the first handle swells it or moves it locally.

    Args:
        warp: the map.
    """

    def __init__(self, warp: WarpMap) -> None:
        self._warp = warp
        self._values: DoubleField | None = None
        self._most = max(FINEST, *warp.coarse_size)

    @property
    def field(self) -> Field | None:
        """The logarithms, R32F; None as long as no handle has swelled or been local."""
        return None if self._values is None else self._values.read

    def begin(self) -> None:
        """Expect the map as it is, if nothing has been expected before; waits for the GPU then."""
        if self._values is None:
            size = self._size
            now = self._warp.device.field(size, 4, "strain, to begin with")
            self._warp.draw_strain(now, (0, 0, *size))
            self._values = self._begun(size)
            self._values.read.set(np.log(np.maximum(now.get()[..., 2:].min(axis=-1), LEAST)))
            now.release()

    def follow(self, fluid: Scheme, dt: float) -> None:
        """Carry it `dt` seconds by what carries the picture, before that is drawn anew."""
        if self._values is None:
            return
        self._refine()
        grid, (width, height) = fluid.grid, self._values.read.size
        texel = np.array(grid.picture) / (width, height)
        inputs: dict[str, Any] = {"velocity": fluid.carrier(), **fluid.params.walls.inputs}
        inputs |= {"corner": tuple(grid.origin / texel), "scale": tuple(texel / grid.spacing)}
        expect = fluid.device.pass_("brush/expect.frag", **fluid.params.walls.defines)
        (hx, hy), now, then = grid.spacing, self._values.read, self._values.write
        inputs |= {"expected": now, "cells_a_speed": (dt / hx, dt / hy)}
        if grid.is_whole:
            expect(then, **inputs)
            self._values.swap()
            return
        low, high = (np.add(grid.origin, part) / texel for part in ((0.0, 0.0), grid.extent))
        region = *np.floor(low).astype(int).tolist(), *(np.ceil(high) - np.floor(low)).astype(int).tolist()
        expect(then, region=region, **inputs)
        fluid.device.pass_("brush/expected.frag")(now, region=region, expected=then)

    @property
    def _size(self) -> tuple[int, int]:
        """As many texels as cells would lie over the picture, up to `FINEST`."""
        across, down = self._warp.coarse_size
        part = min(1.0, self._most / max(across, down))
        return max(round(part * across), 4), max(round(part * down), 4)

    def _refine(self) -> None:
        """Go on with smaller texels where the fluid does with smaller cells."""
        assert self._values is not None
        now, (width, height) = self._values.read, self._size
        if width <= now.size[0] and height <= now.size[1]:
            return
        x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
        finer = self._begun((width, height))
        finer.read.set(between_texels(now.get(), np.stack([x, y], axis=-1)).astype(np.float32))
        self._values.release()
        self._values = finer

    def clear(self) -> None:
        """Expect nothing."""
        self.release()
        self._values = None

    def restore(self, saved: Field | None) -> None:
        """Be a copy of what `field` was."""
        self.clear()
        if saved is not None:
            self._values = self._begun(saved.size)
            self._values.read.copy_from(saved)

    def release(self) -> None:
        """Free the textures."""
        if self._values is not None:
            self._values.release()

    def _begun(self, size: tuple[int, int]) -> DoubleField:
        return self._warp.device.double_field(size, 1, "expected det J, logarithm")

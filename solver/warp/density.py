"""Density mode: the picture's values themselves moved by the fluid, as the paper shows not to do (Figure 1c)."""

from __future__ import annotations

import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field
from solver.grid import Grid
from solver.limits import LARGEST_VISCOSITY, check_shape, check_step
from solver.state import State

DIFFUSION_SWEEPS = 20


class Density:
    """Up to four densities carried, diffused and fed by a fluid: equation (5), section 3.2.

    Args:
        device: where it lives.
        values: what it starts as, (h, w) or (h, w, c), c <= 4; its size need not be the fluid's, its extent is.
        kappa: diffusion rate, lengths^2 / s.
        source: what is added, per second, shaped as `values`.

    Raises:
        ValueError: for values of another shape, or a kappa that is negative or beyond all measure.
    """

    def __init__(
        self, device: Device, values: np.ndarray, kappa: float = 0.0, source: np.ndarray | None = None
    ) -> None:
        self.device = device
        if not 0 <= kappa <= LARGEST_VISCOSITY:
            raise ValueError(f"a diffusion of {kappa} was asked for; it must be from 0 to {LARGEST_VISCOSITY:g}")
        self.kappa = kappa
        if source is not None:
            check_shape("a source of density", source, values.shape)
        height, width, self._components = values.shape if values.ndim == 3 else (*values.shape, 1)
        self._values = device.double_field((width, height), 4, "density")
        self._before = device.field((width, height), 4, "density before diffusion")
        self._source = None if source is None else device.upload(self._padded(source), "density source")
        self.set(values)

    def advance(self, faces: Field, grid: Grid, dt: float) -> None:
        """Move by the velocity on `faces` of the fluid's `grid` for `dt` seconds, diffuse, and add the source."""
        dt = check_step(dt)
        with self.device.stage("density"):
            hx, hy = grid.spacing
            advect = self.device.pass_("warp/density/advect.frag")
            advect(self._values.write, density=self._values.read, velocity=faces, cells_a_speed=(dt / hx, dt / hy))
            self._values.swap()
            if self.kappa > 0:
                self._diffuse(dt, grid)
            if self._source is not None:
                self.device.pass_("warp/density/add_source.frag")(
                    self._values.read, add=True, source=self._source, dt=dt
                )

    @property
    def values(self) -> Field:
        """The densities now, as a field of four components."""
        return self._values.read

    def set(self, values: np.ndarray) -> None:
        """Start again from (h, w) or (h, w, c)."""
        self._values.read.set(self._padded(values))

    def get(self) -> np.ndarray:
        """The densities now, shaped as they were given, float32."""
        values = self._values.read.get()[..., : self._components]
        return values[..., 0] if self._components == 1 else values

    def save(self) -> State:
        """A copy of this moment, on the GPU, which the caller releases."""
        return State.of(self.device, {"density": self.values})

    def restore(self, state: State) -> None:
        """Go back to a saved state."""
        state.write_to({"density": self.values})

    def release(self) -> None:
        for item in (self._values, self._before, self._source):
            if item is not None:
                item.release()

    def _diffuse(self, dt: float, grid: Grid) -> None:
        self._before.copy_from(self._values.read)
        k = [dt * self.kappa * (count / side) ** 2 for count, side in zip(self._before.size, grid.extent, strict=True)]
        sweep = self.device.pass_("warp/density/diffuse.frag")
        for _ in range(DIFFUSION_SWEEPS):
            sweep(self._values.write, density=self._values.read, before=self._before, k=k)
            self._values.swap()

    def _padded(self, values: np.ndarray) -> np.ndarray:
        values = np.asarray(values, np.float32)
        if values.ndim == 2:
            values = values[..., None]
        return np.pad(values, ((0, 0), (0, 0), (0, 4 - values.shape[2])))

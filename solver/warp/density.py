"""Density mode: the picture's values themselves moved by the fluid, as the paper shows not to do (Figure 1c)."""

from __future__ import annotations

import numpy as np

from solver.faces import check_field
from solver.gl.device import Device
from solver.gl.field import Field
from solver.grid import Grid
from solver.limits import LARGEST_VISCOSITY, check_shape, check_size, check_step, check_type, real_array
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
        ValueError: for values of another shape, not finite or too large, or such a kappa, or a negative one.
    """

    def __init__(
        self, device: Device, values: np.ndarray, kappa: float = 0.0, source: np.ndarray | None = None
    ) -> None:
        self.device = device
        check_type("a diffusion", kappa)
        if not 0 <= float(kappa) <= LARGEST_VISCOSITY:
            raise ValueError(f"a diffusion of {kappa} was asked for; it must be from 0 to {LARGEST_VISCOSITY:g}")
        self.kappa = kappa
        self._shape = real_array("a density", values).shape
        if 0 in self._shape or not (len(self._shape) == 2 or (len(self._shape) == 3 and self._shape[2] <= 4)):
            raise ValueError(f"a density of shape {self._shape} was given, (h, w) or (h, w, 1-4) is wanted")
        start = self._padded("a density", values)
        added = None if source is None else self._padded("a source of density", source)
        self._values = device.double_field(self._shape[1::-1], 4, "density")
        self._before = device.field(self._shape[1::-1], 4, "density before diffusion")
        self._source = None if added is None else device.upload(added, "density source")
        self._values.read.set(start)

    def advance(self, faces: Field, grid: Grid, dt: float) -> None:
        """Move by the velocity on `faces` of the fluid's `grid` for `dt` seconds, diffuse, and add the source."""
        dt = check_step(dt)
        check_type("the cells of a fluid", grid, Grid)
        check_field("a velocity", faces, grid)
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
        """Start again from values shaped as the first.

        Raises:
            ValueError: on another shape, or a value that is not finite or too large.
        """
        self._values.read.set(self._padded("a density", values))

    def get(self) -> np.ndarray:
        """The densities now, shaped as they were given, float32."""
        components = self._shape[2] if len(self._shape) == 3 else 1
        return self._values.read.get()[..., :components].reshape(self._shape)

    def save(self) -> State:
        """A copy of this moment, on the GPU, which the caller releases."""
        return State.of(self.device, {"density": self.values})

    def restore(self, state: State) -> None:
        """Go back to a saved state; ValueError if it is of something else."""
        check_type("what to go back to", state, State)
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

    def _padded(self, what: str, values: np.ndarray) -> np.ndarray:
        array = real_array(what, values)
        check_shape(what, array, self._shape)
        check_size(what, array)
        array = array.astype(np.float32).reshape(*self._shape[:2], -1)
        return np.pad(array, ((0, 0), (0, 0), (0, 4 - array.shape[2])))

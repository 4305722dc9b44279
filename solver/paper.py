"""The paper's own scheme, as the baseline the default is measured against: collocated grid, Jacobi, bilinear."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

import numpy as np

from solver.fluid import Fluid, Force
from solver.gl.device import Device
from solver.gl.field import Field
from solver.grid import Grid
from solver.params import FluidParams
from solver.warp.map import Velocity, WarpMap


class PaperFluid(Fluid):
    """`Fluid` with every stage as the paper discretises it.

    Velocity at cell centres, first-order backtrace, Appendix A (its misprints mended) and the Poisson equation by
    `params.sweeps` Jacobi sweeps each. As in the paper it diverges at hard viscosity edges of high contrast; what
    overflows is set to rest, so that no NaN reaches a texture. Walls that move are not part of it.
    """

    def __init__(self, device: Device, grid: Grid, params: FluidParams | None = None) -> None:
        super().__init__(device, grid, params)
        self._pressure = device.double_field(grid.size, 1, "paper pressure")
        self._divergence = device.field(grid.size, 1, "paper divergence")
        self._before = device.field(grid.size, 2, "paper right-hand side")
        self._faces = device.field(grid.size, 2, "paper velocity on faces")

    def add_force(self, forces: Iterable[Force]) -> None:
        with self.device.stage("add force"):
            add = self.device.pass_("paper/add_force.frag")
            for force, impulse in forces:
                if impulse != 0.0:
                    add(self.velocity.read, add=True, force=force, impulse=impulse)

    def add_impulse(self, draw: Callable[[Field], None]) -> None:
        self._faces.clear()
        draw(self._faces)
        self.add_force([(self._faces, 1.0)])

    def advect(self, dt: float) -> None:
        with self.device.stage("advect"):
            advect = self.device.pass_("paper/advect.frag", **self._wall_defines())
            decay = math.exp(-self.params.drag * dt)
            advect(self.velocity.write, velocity=self.velocity.read, dt_over_h=dt / self.grid.h, decay=decay)
            self.velocity.swap()

    def diffuse(self, dt: float, unpack: bool = True) -> None:
        with self.device.stage("diffuse"):
            self._before.copy_from(self.velocity.read)
            sweep = self.device.pass_("paper/diffuse.frag", **self._wall_defines())
            for _ in range(self.params.sweeps):
                sweep(
                    self.velocity.write,
                    velocity=self.velocity.read,
                    before=self._before,
                    viscosity=self.viscosity,
                    solid=self.solid,
                    dt_over_h2=dt / self.grid.h**2,
                )
                self.velocity.swap()

    def project(self) -> None:
        with self.device.stage("project"):
            defines, h = self._wall_defines(), self.grid.h
            divergence = self.device.pass_("paper/divergence.frag", **defines)
            divergence(self._divergence, velocity=self.velocity.read, source=self.source, h=h)
            self._pressure.read.clear()
            sweep = self.device.pass_("paper/pressure.frag")
            for _ in range(self.params.sweeps):
                sweep(self._pressure.write, pressure=self._pressure.read, divergence=self._divergence, h=h)
                self._pressure.swap()
            subtract = self.device.pass_("paper/subtract_gradient.frag")
            subtract(
                self.velocity.write, velocity=self.velocity.read, pressure=self._pressure.read, solid=self.solid, h=h
            )
            self.velocity.swap()
            if self._has_source:
                self.source.clear()
                self._has_source = False

    def set_velocity(self, array: np.ndarray) -> None:
        """Set the velocity at cell centres from (ny, nx, 2)."""
        self.velocity.read.set(np.asarray(array, np.float32))
        self._forget_last_step()

    def faces(self) -> Field:
        self.device.pass_("paper/to_faces.frag", **self._wall_defines())(self._faces, velocity=self.velocity.read)
        return self._faces

    def velocity_at_centres(self) -> np.ndarray:
        return self.velocity.read.get()

    def divergence(self) -> np.ndarray:
        """Divergence by central differences, (ny, nx) float32, 1 / s."""
        divergence = self.device.pass_("paper/divergence.frag", **self._wall_defines())
        divergence(self._divergence, velocity=self.velocity.read, source=self.source, h=self.grid.h)
        return self._divergence.get() / np.float32(self.grid.h)

    def pressure(self) -> np.ndarray:
        return self._pressure.read.get()

    def _viscous_residual(self) -> float | None:
        return None

    def release(self) -> None:
        super().release()
        for item in (self._pressure, self._divergence, self._before, self._faces):
            item.release()


class PaperWarpMap(WarpMap):
    """The paper's warp map: coordinates advected like a density, first-order backtrace and bilinear, never folded.

    It blurs a little at every step, which is what the default map is measured against. Velocities are at cell centres.
    """

    def __init__(self, device: Device, grid: Grid) -> None:
        super().__init__(device, grid, base_scale=1)

    def hold(self, solid: Field) -> None:
        """Nothing: the paper's map is what its scheme makes of it."""

    def follow(self, fluid: Fluid, dt: float) -> None:
        self.advance(fluid.velocity.read, dt)

    def advance(self, velocity: Field, dt: float) -> None:
        """Carry the map one step by a velocity at cell centres, such as `PaperFluid.velocity.read`."""
        advance = self.device.pass_("paper/advance_coordinates.frag")
        advance(
            self._near.write,
            displacement=self._near.read,
            velocity=velocity,
            dt_over_h=dt / self.grid.h,
            h=self.grid.h,
        )
        self._near.swap()
        self._steps += 1  # the whole map is not the base
        self._changed()

    def advance_prescribed(self, velocity: Velocity | np.ndarray, dt: float, time: float = 0.0) -> None:
        """Carry the map from `time` to `time + dt` by a function (x, y, t) or an array (ny, nx, 2), at cell centres."""
        if not isinstance(velocity, np.ndarray):
            velocity = np.stack(velocity(*self.grid.centres(), time + 0.5 * dt), axis=-1)
        field = self.device.upload(velocity.astype(np.float32), "prescribed velocity")
        self.advance(field, dt)
        field.release()

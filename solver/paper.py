"""The paper's own scheme, as the baseline the default is measured against: collocated grid, Jacobi, bilinear."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from solver.faces import Forces, Vector, at_centres, impulses
from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.passes import Region
from solver.grid import Grid
from solver.limits import check_finite, check_size, check_step, check_type
from solver.params import FluidParams
from solver.scheme import Residuals, Scheme
from solver.warp.map import WarpMap


class PaperFluid(Scheme):
    """The fluid with every stage as the paper discretises it.

    Velocity at cell centres, first-order backtrace, Appendix A (its misprints mended) and the Poisson equation by
    `params.sweeps` Jacobi sweeps each. Advection is stable at any step, and the rest is not: at hard edges of the
    viscosity, from a contrast of about a thousand on, the sweeps of Appendix A diverge, and the velocity can blow up
    until it is no number any more. Walls that move are not part of it. Cells are taken to be square, with the longer of
    their sides: along the other, of n cells, lengths are wrong by up to 1 part in 2 n, and by far more in pictures that
    are narrower than 8 of the cells along them.

    Attributes:
        velocity: at cell centres, lengths / s: `read` is what it is now.
    """

    def __init__(self, device: Device, grid: Grid, params: FluidParams | None = None) -> None:
        super().__init__(device, grid, params)
        self.velocity = device.double_field(grid.size, 2, "paper velocity")
        self._pressure = device.double_field(grid.size, 1, "paper pressure")
        self._divergence = device.field(grid.size, 1, "paper divergence")
        self._before = device.field(grid.size, 2, "paper right-hand side")
        self._faces = device.field(grid.size, 2, "paper velocity on faces")

    # -- the paper's step -------------------------------------------------------------------------------------------

    def step(self, dt: float, forces: Forces = (), steer: Callable[[Field], None] | None = None) -> None:
        dt = check_step(dt)
        if steer is not None:
            check_type("what steers", steer, Callable)
        self.local.clear()
        self.add_force(forces, dt)
        self.advect(dt)
        self.diffuse(dt)
        if steer is not None:
            self._faces.clear()
            steer(self._faces)
            self._add(self._faces, 1.0)
        wanted = self.source.field.get() if self.measuring else None
        before = self._divergence_norm(wanted)
        self.project()
        self.residuals = Residuals(before, self._divergence_norm(wanted))
        self.time += dt

    def add_force(self, forces: Forces, dt: float) -> None:
        """w1 = w0 + dt f, f the sum of the forces and of what brushes have drawn."""
        fields, faces = impulses(forces, self.grid, self.time, check_step(dt))
        with self.device.stage("add force"):
            if faces is not None:
                upload = self.device.upload(faces, "force")
                self._add(upload, 1.0)
                upload.release()
            if not self.impulse.is_empty:
                fields.append((self.impulse.field, 1.0))
            for force, impulse in fields:
                self._add(force, impulse)
            self.impulse.clear()

    def advect(self, dt: float) -> None:
        """w2(x) = decay w1(x - dt w1(x)): first-order backtrace, bilinear."""
        dt = check_step(dt)
        with self.device.stage("advect"):
            advect = self.device.pass_("paper/advect.frag", **self.params.walls.defines)
            decay = math.exp(-self.params.drag * dt)
            advect(self.velocity.write, velocity=self.velocity.read, dt_over_h=dt / self.grid.h, decay=decay)
            self.velocity.swap()

    def diffuse(self, dt: float) -> None:
        """w3 from w2 by the viscous term of Appendix A, implicit, in `sweeps` Jacobi sweeps."""
        dt = check_step(dt)
        with self.device.stage("diffuse"):
            self._before.copy_from(self.velocity.read)
            sweep = self.device.pass_("paper/diffuse.frag", **self.params.walls.defines)
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
        """w4 = w3 - grad q with lap q = div w3 - source, by central differences."""
        with self.device.stage("project"):
            h = self.grid.h
            self._find_divergence()
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
            self.source.clear()

    # -- what is put in ---------------------------------------------------------------------------------------------

    def set_velocity(self, velocity: Vector) -> None:
        """Set the velocity at cell centres from (ny, nx, 2) or a function (x, y, t)."""
        array = at_centres("a velocity", velocity, self.grid, self.time)
        check_size("a velocity", array)
        self.velocity.read.set(array)
        self.impulse.clear()

    def clear_velocity(self) -> None:
        self.velocity.read.clear()
        self.impulse.clear()

    def masks_changed(self) -> None:
        """Nothing: every sweep reads the masks as they are."""

    # -- what is read out -------------------------------------------------------------------------------------------

    def faces(self) -> Field:
        self.device.pass_("paper/to_faces.frag", **self.params.walls.defines)(self._faces, velocity=self.velocity.read)
        return self._faces

    def carrier_at_centres(self) -> Field:
        """What carries the picture, at cell centres; see `carrier`."""
        if self.local.is_empty:
            return self.velocity.read
        self._carrier.copy_from(self.velocity.read)
        add = self.device.pass_("paper/add_force.frag")
        add(self._carrier, add=True, force=self.local.field, impulse=1.0)
        return self._carrier

    @property
    def closed(self) -> np.ndarray:
        return self.solid.get()

    def velocity_at_centres(self) -> np.ndarray:
        return self.velocity.read.get()

    def divergence(self) -> np.ndarray:
        """Divergence by central differences, (ny, nx) float32, 1 / s."""
        self._find_divergence()
        return self._divergence.get() / np.float32(self.grid.h) + self.source.field.get()

    def pressure(self) -> np.ndarray:
        return self._pressure.read.get()

    # -- its state --------------------------------------------------------------------------------------------------

    def release(self) -> None:
        super().release()
        for item in (self.velocity, self._pressure, self._divergence, self._before, self._faces):
            item.release()

    def _live(self) -> dict[str, Field]:
        return {"velocity": self.velocity.read, "viscosity": self.viscosity, "solid": self.solid}

    def _add(self, faces: Field, impulse: float) -> None:
        add = self.device.pass_("paper/add_force.frag")
        add(self.velocity.read, add=True, force=faces, impulse=impulse)

    def _find_divergence(self) -> None:
        divergence = self.device.pass_("paper/divergence.frag", **self.params.walls.defines)
        divergence(self._divergence, velocity=self.velocity.read, source=self.source.field, h=self.grid.h)


class PaperWarpMap(WarpMap):
    """The paper's warp map: coordinates advected like a density, first-order backtrace and bilinear, never remapped.

    It blurs a little at every step, which is what the default map is measured against. Velocities are at cell centres.
    """

    def __init__(self, device: Device, grid: Grid, size: tuple[int, int] | None = None) -> None:
        super().__init__(device, grid, grid.size)  # of whatever size it is wanted: it stays the identity

    def hold(self, frozen: Field | None, changed: Region | None = None) -> None:
        """Nothing: the paper's map is what its scheme makes of it."""

    def follow(self, fluid: Scheme, dt: float) -> None:
        if not isinstance(fluid, PaperFluid):
            raise TypeError("a PaperWarpMap follows a PaperFluid")
        self.advance(fluid.carrier_at_centres(), dt)

    def advance(self, velocity: Field, dt: float) -> None:
        """Carry the map one step by a velocity at cell centres, such as `PaperFluid.velocity.read`."""
        advance = self.device.pass_("paper/advance_coordinates.frag")
        advance(
            self._submap.write,
            displacement=self._submap.read,
            velocity=velocity,
            dt_over_h=check_step(dt) / self.grid.h,
            h=self.grid.h,
        )
        self._submap.swap()
        self._steps += 1  # the whole map is not the accumulated one
        self._changed()

    def advance_prescribed(self, velocity: Vector, dt: float, time: float = 0.0) -> None:
        """Carry the map from `time` to `time + dt` by a function (x, y, t) or an array (ny, nx, 2), at cell centres."""
        check_finite("a time", time)
        array = at_centres("a velocity", velocity, self.grid, time + 0.5 * check_step(dt))
        check_size("a velocity", array)
        field = self.device.upload(array, "prescribed velocity")
        self.advance(field, dt)
        field.release()

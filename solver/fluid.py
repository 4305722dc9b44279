"""The fluid: Stable Fluids with spatially varying viscosity, in the paper's order.

The class is long because `step`, its stages, and each stage as a call of its own read best together. Their work is done
in `advection`, `viscosity`, `energy` and `pressure`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from solver.advection import Advected, Advection, Blocks
from solver.energy import EnergyBound
from solver.faces import Forces, Impulses, Vector, impulses, on_faces
from solver.flow import Flow
from solver.gl.device import Device
from solver.gl.field import Field
from solver.grid import Grid
from solver.limits import check_size, check_step, check_type
from solver.packing import PackedFaces
from solver.params import FluidParams
from solver.pressure.projection import Projection
from solver.scheme import Residuals, Scheme
from solver.trace import Trace, Tracing
from solver.viscosity.solve import Viscosity


class Fluid(Scheme):
    """An incompressible fluid of spatially varying viscosity on a MAC grid; see solver/README.md.

    Paper: section 3, equation (4). See `Scheme` for its arguments and what is put in and read out.

    Attributes:
        velocity: on MAC faces, lengths / s: `read` is what it is now.
    """

    def __init__(self, device: Device, grid: Grid, params: FluidParams | None = None) -> None:
        super().__init__(device, grid, params)
        self.velocity = device.double_field(grid.size, 2, "velocity")
        # g of (S2): half of the last step's velocity change by pressure; the next step subtracts it at the departure.
        self._carried = device.double_field(grid.size, 2, "half the pressure gradient")
        self._trace = Trace(device, grid.size)
        self._flux = device.field(grid.size, 2, "velocity times the open part of the faces")
        self._is_flux_drawn = False
        self._viscosity_solver = Viscosity(device, grid.size, grid.spacing)
        self._pressure_solver = Projection(device, grid.size, grid.spacing)
        packed = self._viscosity_solver.v_star.u.size
        self._advection = Advection(device, grid.size, packed)
        self._energy_bound = EnergyBound(device, grid.nx * grid.ny, packed)
        # Which masks the solvers have taken up; None if they have to be read again.
        self._coefficients_of: object = None
        self._solids_of: np.ndarray | None = None
        self._solid: np.ndarray | None = None
        self._has_edges = False  # cells that are closed in part

    # -- the paper's step -------------------------------------------------------------------------------------------

    def step(self, dt: float, forces: Forces = (), steer: Callable[[Field], None] | None = None) -> None:
        """Advance by `dt` seconds: w0 -> add force -> w1 -> advect -> w2 -> diffuse -> w3 -> project -> w4.

        See `Scheme.step`. Unconditionally stable: without forces the energy never grows (equation S6).
        """
        dt = check_step(dt)
        if steer is not None:
            check_type("what steers", steer, Callable)
        self._check_source()
        given = impulses(forces, self.grid, self.time, dt)
        self.local.clear()
        self.residuals = Residuals()
        with self._whole_or_not_at_all():
            w2 = self._advect(self._add_force(given), dt)
            w3 = self._bound_energy(self._diffuse(w2), w2.energy)
            if steer is None:
                self._project(w3)
            else:
                self._replace(partial(self._viscosity_solver.unpack, w3), steer)
                self._project()
        self.time += dt

    def _add_force(self, given: Impulses) -> Blocks:
        """w1 = w0 - g + dt f, f the sum of the forces and of what brushes have drawn: equation (S2).

        g, half of the pressure's work, acts here, where the fluid departs, the other half in the projection, where it
        arrives. So pressure acts along the path by the trapezoidal rule, which is of second order in time.
        """
        force = self._together(given)
        with self.device.stage("add force"):
            w1 = self._advection.depart(self.velocity.read, self.params.walls, carried=self._carried.read, **force)
        self.impulse.clear()
        return w1

    def _advect(self, w1: Blocks, dt: float) -> Advected:
        """w2(x) = w1(x_d), each component from where it departs; and drag.

        Carried by w0 where the paper has w1: w0 is free of divergence and does not cross solids, and the warp map has
        just been carried by it, so the trace is drawn already.
        """
        trace = self.trace(dt)
        self._take_up_masks(dt)
        self._take_up_solids()
        target, packing = self._viscosity_solver.v_star, self._viscosity_solver.packing
        with self.device.stage("advect"):
            decay = math.exp(-self.params.drag * dt)
            return self._advection.advect(w1, trace, decay, target, packing, self._pressure_solver.weights)

    def _diffuse(self, w2: Advected) -> PackedFaces:
        """(I - dt div mu (grad + grad^T)) w3 = w2: implicit, both components coupled: equation (V1)."""
        assert w2.faces is self._viscosity_solver.v_star
        with self.device.stage("diffuse"):
            w3 = self._viscosity_solver.solve()
        if self.measuring:
            left = self._viscosity_solver.residual_norm(w3)
            self.residuals = replace(self.residuals, viscous_residual=left)
        return w3

    def _bound_energy(self, w3: PackedFaces, before: Field) -> PackedFaces:
        """w3, scaled down if it has more energy than w1: equation (S5). Moving walls may add energy.

        Raises:
            ValueError: if w1 is not finite, or too large.
        """
        with self.device.stage("diffuse"):
            wall_speed = max(map(abs, self.params.walls.driving_speed))
            return self._energy_bound.apply(w3, before, wall_speed, self._pressure_solver.weights)

    def _project(self, w3: PackedFaces | None = None, carries: bool = True) -> None:
        """w4 = w3 - grad q with lap q = div w3 - source, and g for the next step; w3 is by default `velocity`."""
        if self.measuring and w3 is not None:
            self._unpack(w3)
            w3 = None
        wanted = self.source.field.get() if self.measuring else None
        before = self._divergence_norm(wanted)
        with self.device.stage("project"):
            self._take_up_solids()
            self._pressure_solver.project(
                self.velocity,
                self.params.pressure_cycles,
                None if self.source.is_empty else self.source.field,
                warm=True,
                carried=self._carried if carries else None,
                packed=w3,
            )
            self.source.clear()
            self._velocity_changed()
        after = self._divergence_norm(wanted)
        self.residuals = replace(self.residuals, divergence_before=before, divergence_after=after)

    # -- its stages, each alone -------------------------------------------------------------------------------------

    def add_force(self, forces: Forces, dt: float) -> None:
        """Add forces, and what brushes have drawn, to the velocity; see `Scheme.step`."""
        given = impulses(forces, self.grid, self.time, check_step(dt))
        with self._whole_or_not_at_all():
            if force := self._together(given):
                before, add = self.velocity.read, self.device.pass_("step/add_impulse.frag")
                self._replace(lambda faces: faces.copy_from(before), partial(add, add=True, **force))
        self.impulse.clear()

    def advect(self, dt: float) -> None:
        """Let the velocity carry itself for `dt` seconds, with no more energy; the result is not free of divergence."""
        dt = check_step(dt)
        with self._whole_or_not_at_all():
            w2 = self._advect(self._advection.depart(self.velocity.read, self.params.walls), dt)
            self._unpack(self._bound_energy(w2.faces, w2.energy))

    def diffuse(self, dt: float) -> None:
        """Let viscosity act on the velocity for `dt` seconds; the result is not free of divergence."""
        self._take_up_masks(check_step(dt))
        with self.device.stage("diffuse"):
            self._viscosity_solver.diffuse(self.velocity.read)
            self._velocity_changed()

    def project(self) -> None:
        """Make the velocity free of divergence, but for what brushes ask for."""
        self._check_source()
        self.residuals = Residuals()
        self._project(carries=False)

    def trace(self, dt: float) -> Field:
        """Where the fluid that arrives at the cells' centres in `dt` seconds comes from: x_departed - x, cells.

        Valid until the velocity changes. The next step uses it too.
        """
        dt = check_step(dt)
        if tracing := self._begin_own_trace(dt):
            with self.device.stage("trace"):
                self.device.pass_("step/trace.frag", **tracing.defines)(tracing.target, **tracing.inputs)
        return self._trace.field

    def strain(self, dt: float) -> float:
        """How much `carrier` bends in `dt` seconds what it carries, dt max |grad w|; waits for the GPU."""
        return self._trace.strain(self.faces() if self.local.is_empty else self.carrier(), check_step(dt), self.grid)

    def begin_trace(self, dt: float) -> Tracing | None:
        """What it takes to draw the trace of `carrier`, for a pass that draws it together with something else.

        None if it is the same as `trace`, and that is drawn already.
        """
        if self.local.is_empty:
            return self._begin_own_trace(dt)
        tracing = self._trace.begin(self.carrier(), dt, self.grid, self.params.walls, in_parts=True)
        self._trace.forget()  # not the fluid's own: the next step cannot use it
        return tracing

    def _begin_own_trace(self, dt: float) -> Tracing | None:
        walls = self.params.walls
        return None if self._trace.is_of(dt, walls) else self._trace.begin(self.faces(), dt, self.grid, walls)

    # -- what is put in ---------------------------------------------------------------------------------------------

    def set_velocity(self, velocity: Vector) -> None:
        """Set u on left faces and v on upper faces from (ny, nx, 2) or a function (x, y, t); walls' faces become zero.

        Raises:
            ValueError: on another shape, or a value that is not finite or too large.
        """
        faces = on_faces("a velocity", velocity, self.grid, self.time)
        check_size("a velocity", faces)
        faces[:, 0, 0] = 0.0
        faces[0, :, 1] = 0.0
        self.velocity.read.set(faces)
        self._forget_last_step()

    def clear_velocity(self) -> None:
        """Stop all motion."""
        self.velocity.read.clear()
        self._forget_last_step()

    def masks_changed(self) -> None:
        """Tell that something was drawn into `viscosity` or `solid`; the next step takes it up."""
        self._coefficients_of = None
        self._solid = None
        self._velocity_changed()  # what carries the fluid stands still in solid cells

    # -- on another grid of the picture ------------------------------------------------------------------------------

    def lay_on(self, grid: Grid) -> None:
        """Go on at rest on another grid with as many cells; viscosity and solid cells have to be set again.

        Raises:
            ValueError: if the numbers of cells differ, or the pictures.
        """
        check_type("where a fluid is laid", grid, Grid)
        if (grid.size, grid.picture) != (self.grid.size, self.grid.picture):
            raise ValueError(f"a fluid of {self.grid} cannot be laid on {grid}")
        self.grid = grid
        self._viscosity_solver.set_spacing(grid.spacing)
        self._pressure_solver.set_spacing(grid.spacing)
        self.clear_velocity()
        self.masks_changed()

    def flow_on(self, grid: Grid) -> Flow:
        """The flow on the faces of another grid of the same picture, which the caller releases; see `go_on_with`.

        On cells of the same size, moved by whole cells, it is the same to the bit; see `Flow.resampled`.
        """
        flow = Flow(self.time, self.velocity.read, self._carried.read)
        return flow.resampled(self.device, self.grid, grid, self.params.walls)

    def go_on_with(self, flow: Flow) -> None:
        """Take over a flow on this grid, from `flow_on`, made free of divergence between its walls and solids.

        Raises:
            ValueError: if it is on another grid.
        """
        check_type("what flows on", flow, Flow)
        self.velocity.read.copy_from(flow.velocity)
        self._forget_last_step()
        self.project()
        if flow.carried is not None:
            self._carried.read.copy_from(flow.carried)
        self._pressure_solver.forget()
        self.time = flow.time

    # -- what is read out -------------------------------------------------------------------------------------------

    def faces(self) -> Field:
        self._look_at_solids()
        if not self._has_edges:
            return self.velocity.read
        if not self._is_flux_drawn:
            self.device.pass_("step/carry.frag")(self._flux, velocity=self.velocity.read, solid=self.solid)
            self._is_flux_drawn = True
        return self._flux

    @property
    def closed(self) -> np.ndarray:
        return self._look_at_solids()

    def velocity_at_centres(self) -> np.ndarray:
        u, v = self.u, self.v
        return 0.5 * np.stack([u[:, :-1] + u[:, 1:], v[:-1] + v[1:]], axis=-1)

    def divergence(self) -> np.ndarray:
        hx, hy = self.grid.spacing
        return np.diff(self.u, axis=1) / np.float32(hx) + np.diff(self.v, axis=0) / np.float32(hy)

    def pressure(self) -> np.ndarray:
        return self._pressure_solver.pressure

    # -- its state --------------------------------------------------------------------------------------------------

    def release(self) -> None:
        super().release()
        for item in (self.velocity, self._carried, self._trace, self._flux, self._advection, self._energy_bound):
            item.release()
        self._viscosity_solver.release()
        self._pressure_solver.release()

    def _live(self) -> dict[str, Field]:
        solvers = {"viscosity solver": self._viscosity_solver.state(), "pressure solver": self._pressure_solver.state()}
        kept = {f"{name} {number}": part for name, parts in solvers.items() for number, part in enumerate(parts)}
        fields = {"velocity": self.velocity.read, "carried": self._carried.read}
        return {**fields, **kept, "viscosity": self.viscosity, "solid": self.solid}

    # -- parts of the stages ----------------------------------------------------------------------------------------

    def _together(self, given: Impulses) -> dict[str, Any]:
        """All that acts in a step as one `force` and its `impulse`, empty if nothing does.

        Several forces are added up in `impulse`, where brushes draw too.
        """
        fields, faces = given
        upload = None if faces is None else self.device.upload(faces, "force")
        if upload:
            fields.append((upload, 1.0))
        if upload or len(fields) > 1 or not self.impulse.is_empty:
            add = self.device.pass_("step/add_impulse.frag")
            for force, impulse in fields:
                self.impulse.add(partial(add, add=True, force=force, impulse=impulse))
            fields = [(self.impulse.field, 1.0)]
        if upload:
            upload.release()
        return {"force": fields[0][0], "impulse": fields[0][1]} if fields else {}

    @contextmanager
    def _whole_or_not_at_all(self) -> Iterator[None]:
        """If something fails inside, the velocity stays as it was, and the input for the step is forgotten."""
        try:
            yield
        except BaseException:
            self._forget_last_step()
            raise

    def _replace(self, *draws: Callable[[Field], object]) -> None:
        """Let `draws`, one after the other, draw a new velocity, and take it if it is not too large."""
        for draw in draws:
            draw(self.velocity.write)
        check_size("the velocity", self.velocity.write.get())
        self.velocity.swap()
        self._velocity_changed()

    def _unpack(self, faces: PackedFaces) -> None:
        """Make packed faces the velocity."""
        self._viscosity_solver.unpack(faces, self.velocity.read)
        self._velocity_changed()

    def _check_source(self) -> None:
        if self.source.is_empty:
            return
        try:
            check_size("the divergence that brushes ask for", self.source.field.get())
        except ValueError:
            self.source.clear()
            raise

    def _forget_last_step(self) -> None:
        self.impulse.clear()
        self._velocity_changed()
        self._carried.read.clear()
        self._viscosity_solver.forget()
        self._pressure_solver.forget()

    def _take_up_masks(self, dt: float) -> None:
        """Hand viscosity and solid cells to the viscous solver, if they, the step or the walls have changed."""
        key = (dt, self.params.walls)
        if key != self._coefficients_of:
            with self.device.stage("diffuse"):
                self._viscosity_solver.set_coefficients(self.viscosity, self.solid, dt, self.params.walls)
            self._coefficients_of = key

    def _take_up_solids(self) -> None:
        """Hand the solid cells to the projection, if they have changed: most strokes of paint only thicken."""
        solid = self._look_at_solids()
        if solid is not self._solids_of and (self._solids_of is None or not np.array_equal(solid, self._solids_of)):
            self._pressure_solver.set_solids(solid / np.float32(255) if solid.any() else None)
        self._solids_of = solid

    def _look_at_solids(self) -> np.ndarray:
        """The solid cells, read back if they may have changed."""
        if self._solid is None:
            self._solid = self.solid.get()
            self._has_edges = bool(((self._solid > 0) & (self._solid < 255)).any())
        return self._solid

    def _velocity_changed(self) -> None:
        self._trace.forget()
        self._is_flux_drawn = False

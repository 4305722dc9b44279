"""The fluid: Stable Fluids with spatially varying viscosity, in the paper's order.

Longer than most: `step`, its stages, and each of them once more for who calls it alone, read best one below the other.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.reduction import Reduction
from solver.grid import Grid, check_type
from solver.packing import PackedFaces
from solver.params import FluidParams
from solver.pressure.projection import Projection
from solver.scheme import (
    LARGEST_SPEED,
    Forces,
    Residuals,
    Scheme,
    State,
    Vector,
    check_size,
    check_step,
    on_faces,
)
from solver.viscosity.solve import Viscosity

Departing = tuple[Field, Field]  # w1: of u and of v, 2 x 2 faces a texel: see `depart.frag`


@dataclass(frozen=True)
class Tracing:
    """What drawing the trace takes: where to, and the defines and inputs of `trace.frag`."""

    target: Field
    defines: dict[str, Any]
    inputs: dict[str, Any]


@dataclass(frozen=True)
class Flow:
    """A flow on the faces of a grid: time, velocity, and half the last pressure gradient where that is known."""

    time: float
    velocity: Field
    carried: Field | None = None

    def release(self) -> None:
        """Free the textures."""
        for field in (self.velocity, self.carried):
            if field is not None:
                field.release()


class Fluid(Scheme):
    """An incompressible fluid of spatially varying viscosity on a MAC grid; see solver/README.md.

    Paper: section 3, equation (4). See `Scheme` for its arguments and what is put in and read out.

    Attributes:
        velocity: on MAC faces, lengths / s: `read` is what it is now.
    """

    def __init__(self, device: Device, grid: Grid, params: FluidParams | None = None) -> None:
        super().__init__(device, grid, params)
        self.velocity = device.double_field(grid.size, 2, "velocity")
        # Half the last pressure gradient, which the next step takes off where the fluid departs.
        self._carried = device.double_field(grid.size, 2, "half the pressure gradient")
        blocks = grid.nx + 4, (grid.ny + 1) // 2 + 3
        self._departing = device.field(blocks, 4, "departing u"), device.field(blocks, 4, "departing v")
        self._trace = device.field(grid.size, 2, "trace")
        self._traced: float | None = None  # the step that it is of; None if the velocity has changed since
        packed = -(-grid.nx // 2) + 2, -(-grid.ny // 2) + 2
        self._departed = device.field(packed, 1, "departed energy")
        self._squares = device.field(packed, 2, "energies")
        self._sum_of_squares = Reduction(device, packed, 2, "sum")
        self._limited = PackedFaces(device, packed, "limited velocity")
        self._viscosity_solver = Viscosity(device, grid.size, grid.spacing)
        self._pressure_solver = Projection(device, grid.size, grid.spacing)
        # What the solvers hold of the masks; None if they have to look.
        self._coefficients_of: object = None
        self._solids_of: np.ndarray | None = None
        self._has_new_solids = True

    # -- the paper's step -------------------------------------------------------------------------------------------

    def step(self, dt: float, forces: Forces = (), steer: Callable[[Field], None] | None = None) -> None:
        """Advance by `dt` seconds: w0 -> add force -> w1 -> advect -> w2 -> diffuse -> w3 -> project -> w4.

        See `Scheme.step`. Unconditionally stable: without forces the energy never grows (equation S6).
        """
        dt = check_step(dt)
        if steer is not None:
            check_type("what steers", steer, Callable)
        self.local.clear()
        w1 = self._add_force(forces, dt)
        w2 = self._advect(w1, dt)
        w3 = self._diffuse(w2, dt)
        viscous_residual = self._viscous_residual(w3) if self.measuring else None
        w3 = self._bound_energy(w3)
        self._project(w3 if steer is None else self._steered(w3, steer))
        if self.measuring:
            self.residuals = replace(self.residuals, viscous_residual=viscous_residual)
        self.time += dt

    def _add_force(self, forces: Forces, dt: float) -> Departing:
        """w1 = w0 - g + dt f, f the sum of the forces and of what brushes have drawn.

        g is half the last pressure gradient: with the projection, where the fluid arrives, pressure then acts along the
        path by the trapezoidal rule, second order in time, where the paper's splitting is first order and dissipates
        (it takes dt^2 |grad p|^2 of energy a step). Xiu and Karniadakis, J. Comput. Phys. 172 (2001), treat such
        schemes.
        """
        self._check_source()
        force = self._force(forces, dt)
        with self.device.stage("add force"):
            departing = self._depart(carried=self._carried.read, **force)
        self.impulse.clear()
        return departing

    def _advect(self, departing: Departing, dt: float) -> PackedFaces:
        """w2(x) = w1(x_d): second-order backtrace, cubic interpolation, each component from where it departs; and drag.

        Carried by w0 where the paper has w1: that is free of divergence and does not cross solids, and the warp map has
        just been carried by it, so that the trace is there already.
        """
        trace = self.trace(dt)
        self._take_up_masks(dt)
        with self.device.stage("advect"):
            advected, packing = self._viscosity_solver.v_star, self._viscosity_solver.packing
            advect = self.device.pass_("step/advect.frag", **packing.defines)
            u, v = departing
            advect((*advected.fields, self._departed), region=packing.region, departing_u=u, departing_v=v,
                   trace=trace, decay=math.exp(-self.params.drag * dt), **packing.open)  # fmt: skip
        return advected

    def _diffuse(self, advected: PackedFaces, dt: float) -> PackedFaces:
        """(I - dt div mu (grad + grad^T)) w3 = w2: implicit, both components coupled."""
        assert advected is self._viscosity_solver.v_star
        self._take_up_masks(dt)
        with self.device.stage("diffuse"):
            return self._viscosity_solver.solve()

    def _bound_energy(self, diffused: PackedFaces) -> PackedFaces:
        """w3, made smaller where it has more energy than departed: advection moves energy and viscosity takes it.

        A semi-Lagrangian step reads some places more often than others and so may make energy; see equation (S6). Walls
        that move may besides bring all of the fluid to their own speed.

        Raises:
            ValueError: if what departed is not finite, or beyond all measure; the velocity stays as it was.
        """
        with self.device.stage("diffuse"):
            energy = self.device.pass_("step/energy.frag")
            energy(self._squares, **diffused.inputs(), departed=self._departed)
            after, before = self._sum_of_squares(self._squares).tolist()
            cells = self.grid.nx * self.grid.ny
            if not (before <= cells * LARGEST_SPEED**2 and math.isfinite(after)):
                self._forget_last_step()
                raise ValueError("the forces and brushes of this step are beyond all measure")
            moved = max(map(abs, self.params.walls.drag))
            most = math.sqrt(before) + moved * math.sqrt(cells)
            if math.sqrt(after) <= most:
                return diffused
            scale = self.device.pass_("step/scale.frag")
            scale(self._limited.fields, **diffused.inputs(), factor=most / math.sqrt(after))
            return self._limited

    def _steered(self, diffused: PackedFaces, steer: Callable[[Field], None]) -> None:
        """w3 in the hand of brushes: from here on it is what `velocity` holds."""
        self._unpack(diffused)
        steer(self.velocity.read)

    def _project(self, diffused: PackedFaces | None, carried: bool = True) -> None:
        """w4 = w3 - grad q with lap q = div w3 - source; w3 is what `velocity` holds, if it is not given."""
        if self.measuring and diffused is not None:
            self._unpack(diffused)
            diffused = None
        wanted = self.source.field.get() if self.measuring else None
        before = self._divergence_norm(wanted)
        with self.device.stage("project"):
            self._take_up_solids()
            source = None if self.source.is_empty else self.source.field
            self._pressure_solver.project(
                self.velocity,
                self.params.pressure_cycles,
                source,
                warm=True,
                carried=self._carried if carried else None,
                packed=diffused,
            )
            self.source.clear()
            self._traced = None
        self.residuals = Residuals(before, self._divergence_norm(wanted))

    # -- its stages, each alone -------------------------------------------------------------------------------------

    def add_force(self, forces: Forces, dt: float) -> None:
        """Add forces, and what brushes have drawn, to the velocity; see `step`."""
        if force := self._force(forces, check_step(dt)):
            self.device.pass_("step/add_impulse.frag")(self.velocity.read, add=True, **force)
        self.impulse.clear()
        self._traced = None

    def advect(self, dt: float) -> None:
        """Let the velocity carry itself for `dt` seconds; the result is not free of divergence."""
        dt = check_step(dt)
        self._unpack(self._advect(self._depart(), dt))

    def diffuse(self, dt: float) -> None:
        """Let viscosity act on the velocity for `dt` seconds; the result is not free of divergence."""
        self._take_up_masks(check_step(dt))
        with self.device.stage("diffuse"):
            self._viscosity_solver.diffuse(self.velocity)
            self._traced = None

    def project(self) -> None:
        """Make the velocity free of divergence, but for what brushes ask for."""
        self._check_source()
        self._project(None, carried=False)

    def trace(self, dt: float) -> Field:
        """How far the velocity carries in `dt` seconds what arrives at the cells' centres: x_departed - x, cells.

        Valid until the velocity changes. The next step follows it.
        """
        dt = check_step(dt)
        if self._traced != dt:
            self._traced, tracing = dt, self._tracing(self.faces(), dt)
            with self.device.stage("trace"):
                self.device.pass_("step/trace.frag", **tracing.defines)(tracing.target, **tracing.inputs)
        return self._trace

    def begin_trace(self, dt: float) -> Tracing | None:
        """The trace of what carries the picture, for whoever then draws it beside something else; None if it is `trace`
        and that is there already.
        """
        if not self.local.is_empty:
            self._traced = None  # what is drawn is not the fluid's own
            return self._tracing(self.carrier(), dt)
        if self._traced == dt:
            return None
        self._traced = dt
        return self._tracing(self.faces(), dt)

    def _tracing(self, velocity: Field, dt: float) -> Tracing:
        hx, hy = self.grid.spacing
        inputs = {"velocity": velocity, "cells_a_speed": (dt / hx, dt / hy), **self._wall_inputs()}
        return Tracing(self._trace, self._wall_defines(), inputs)

    # -- what is put in ---------------------------------------------------------------------------------------------

    def set_velocity(self, velocity: Vector) -> None:
        """Set u on left faces and v on upper faces from (ny, nx, 2) or a function (x, y, t); walls' faces become zero.

        Raises:
            ValueError: on another shape, or a value that is not finite or beyond all measure.
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
        """Say that something was drawn into `viscosity` or `solid`; the next step takes it up."""
        self._coefficients_of = None
        self._has_new_solids = True

    # -- on another grid of the picture ------------------------------------------------------------------------------

    def lay_on(self, grid: Grid) -> None:
        """Go on at rest with as many cells elsewhere in the picture; viscosity and solid cells are to be set anew.

        Raises:
            ValueError: if there are not as many.
        """
        if grid.size != self.grid.size:
            raise ValueError(f"a fluid of {self.grid} cannot be laid on {grid}")
        self.grid = grid
        self._viscosity_solver.set_spacing(grid.spacing)
        self._pressure_solver.set_spacing(grid.spacing)
        self.clear_velocity()
        self.masks_changed()

    def flow_on(self, grid: Grid) -> Flow:
        """The flow on the faces of another grid of the same picture, which the caller releases; see `go_on_with`.

        Where that is the same cells, moved by whole ones, it is the same to the bit, and else a mean over each face, so
        that as much flows through it. Outside the fluid's own grid all is at rest.
        """
        step = np.divide(grid.spacing, self.grid.spacing)
        origin = np.subtract(grid.origin, self.grid.origin) / self.grid.spacing
        is_moved = bool(np.allclose(step, 1.0, rtol=0.0, atol=1e-6))
        if is_moved:
            step, origin = np.ones(2), np.round(origin)
        inputs: dict[str, Any] = {"origin": tuple(origin.tolist()), "step": tuple(step.tolist())}
        inputs |= {"samples": tuple(np.maximum(np.ceil(step), 1.0).tolist()), **self._wall_inputs()}
        carry_over, fields = self.device.pass_("step/carry_over.frag", **self._wall_defines()), []
        for live in (self.velocity.read, self._carried.read)[: 2 if is_moved else 1]:
            fields.append(self.device.field(grid.size, 2, f"{live.label}, carried over"))
            carry_over(fields[-1], velocity=live, **inputs)
        return Flow(self.time, *fields)

    def go_on_with(self, flow: Flow) -> None:
        """Take over a flow on this grid, from `flow_on`, made free of divergence between its walls and solids."""
        self.velocity.read.copy_from(flow.velocity)
        self._forget_last_step()
        self.project()
        if flow.carried is not None:
            self._carried.read.copy_from(flow.carried)
        self._pressure_solver.forget()
        self.time = flow.time

    # -- what is read out -------------------------------------------------------------------------------------------

    def faces(self) -> Field:
        return self.velocity.read

    def velocity_at_centres(self) -> np.ndarray:
        u, v = self.u, self.v
        return 0.5 * np.stack([u[:, :-1] + u[:, 1:], v[:-1] + v[1:]], axis=-1)

    def divergence(self) -> np.ndarray:
        hx, hy = self.grid.spacing
        return np.diff(self.u, axis=1) / np.float32(hx) + np.diff(self.v, axis=0) / np.float32(hy)

    def pressure(self) -> np.ndarray:
        return self._pressure_solver.pressure

    # -- its state --------------------------------------------------------------------------------------------------

    def restore(self, state: State) -> None:
        super().restore(state)
        self._traced = None

    def release(self) -> None:
        super().release()
        for item in (self.velocity, self._carried, *self._departing, self._trace, self._departed):
            item.release()
        for item in (self._squares, self._sum_of_squares, self._limited, self._viscosity_solver, self._pressure_solver):
            item.release()

    def _live(self) -> dict[str, Field]:
        solvers = {"viscosity solver": self._viscosity_solver.state(), "pressure solver": self._pressure_solver.state()}
        kept = {f"{name} {number}": part for name, parts in solvers.items() for number, part in enumerate(parts)}
        fields = {"velocity": self.velocity.read, "carried": self._carried.read}
        return {**fields, **kept, "viscosity": self.viscosity, "solid": self.solid}

    # -- parts of the stages ----------------------------------------------------------------------------------------

    def _force(self, forces: Forces, dt: float) -> dict[str, Any]:
        """All that acts in a step as one `force` and its `impulse`, empty if nothing does.

        More than one are added up where brushes draw.
        """
        fields, faces = self._acting(forces, dt)
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

    def _depart(self, **parts: Any) -> Departing:
        """The velocity, less what is `carried` and with a `force`, if they are given, as advection reads it."""
        departing, (nx, ny) = self._departing, self.grid.size
        width, height = departing[0].size
        # Texels whose faces are all inside: none beyond a wall or on it.
        left, right, above, below = 3, nx + 1, 2, ny // 2 + 1
        inside = (left, above, right - left, below - above)
        around = [(0, 0, width, above), (0, below, width, height - below)]
        around += [(0, above, left, below - above), (right, above, width - right, below - above)]
        given = {name.upper(): 1 for name in parts if name != "impulse"}
        self.device.pass_("step/depart.frag", **given)(departing, region=inside, velocity=self.velocity.read, **parts)
        edges = self.device.pass_("step/depart.frag", EDGES=1, **given, **self._wall_defines())
        edges(departing, region=around, velocity=self.velocity.read, **parts, **self._wall_inputs())
        return departing

    def _unpack(self, faces: PackedFaces) -> None:
        """Let packed faces be the velocity."""
        self._viscosity_solver.unpack(faces, self.velocity.read)
        self._traced = None

    def _check_source(self) -> None:
        if self.source.is_empty:
            return
        try:
            check_size("the divergence that brushes ask for", self.source.field.get())
        except ValueError:
            self.source.clear()
            raise

    def _viscous_residual(self, diffused: PackedFaces) -> float:
        self._viscosity_solver.unpack(diffused, self.velocity.write)
        return self._viscosity_solver.residual_norm(self.velocity.write)

    def _forget_last_step(self) -> None:
        self.impulse.clear()
        self._traced = None
        self._carried.read.clear()
        self._viscosity_solver.forget()
        self._pressure_solver.forget()

    def _take_up_masks(self, dt: float) -> None:
        """Hand viscosity and solid cells to the viscous solver, if they or the step are other ones."""
        key = (dt, self.params.walls)
        if key != self._coefficients_of:
            with self.device.stage("diffuse"):
                self._viscosity_solver.set_coefficients(self.viscosity, self.solid, dt, self.params.walls)
            self._coefficients_of = key

    def _take_up_solids(self) -> None:
        """Hand the solid cells to the projection, if they are other ones: most strokes of paint only thicken."""
        if self._has_new_solids:
            solid = self.solid.get()
            if self._solids_of is None or not np.array_equal(solid, self._solids_of):
                self._pressure_solver.set_solids(self.solid if solid.any() else None)
                self._solids_of = solid
            self._has_new_solids = False

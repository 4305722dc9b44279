"""The fluid: Stable Fluids with spatially varying viscosity, in the paper's order."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from solver.gl.device import Device
from solver.gl.field import DoubleField, Field
from solver.grid import Grid
from solver.packing import PackedFaces
from solver.params import FluidParams
from solver.pressure.projection import Pressure
from solver.viscosity.solve import Viscosity

# Cells along the edges of what departs that depend on the walls.
RIM = 3

# A force field on the grid's faces, and its time law integrated over the tick (seconds).
Force = tuple[Field, float]


@dataclass(frozen=True)
class Residuals:
    """What the two solves of the last step left; see `Fluid.measuring`.

    Attributes:
        divergence_before, divergence_after: root mean square over the cells, 1 / s, less what brushes ask for.
        viscous_residual: of the implicit viscous step, relative; None where the scheme does not tell.
    """

    divergence_before: float = 0.0
    divergence_after: float = 0.0
    viscous_residual: float | None = None

    @property
    def divergence_left(self) -> float:
        """The part of the divergence that the projection has left."""
        return self.divergence_after / self.divergence_before if self.divergence_before else 0.0


@dataclass(frozen=True)
class Motion:
    """How fast the fluid moves: what stop conditions and statistics look at."""

    kinetic_energy: float
    largest_speed: float


class Fluid:
    """An incompressible fluid of spatially varying viscosity on a MAC grid.

    Everything is in the units of CONTRIBUTING.md: the longer side of the picture is 1, y points down, velocities are
    lengths per second. Paper: section 3, equation (4).

    Args:
        device: where it lives.
        grid: its cells; see `Grid.for_picture`.
        params: walls, drag, cycles; may be replaced between steps.

    Attributes:
        impulse: what brushes have drawn on MAC faces for the next step, lengths / s.
        measuring: let every step leave its `residuals`; it changes no result, and is slow.
    """

    def __init__(self, device: Device, grid: Grid, params: FluidParams | None = None) -> None:
        self.device = device
        self.grid = grid
        self.params = params or FluidParams()
        self.velocity = device.double_field(grid.size, 2, "velocity")
        self.viscosity = device.field(grid.size, 1, "viscosity")
        self.solid = device.field(grid.size, 1, "solid", "f1")
        self.source = device.field(grid.size, 1, "divergence source")
        self.impulse = device.field(grid.size, 2, "impulse")
        self._trace = device.field(grid.size, 2, "trace")
        # Two cells more on every side, for what walls make of the velocity there.
        self._departing = device.field((grid.nx + 4, grid.ny + 4), 2, "departing velocity")
        self._carried = device.double_field(grid.size, 2, "half the pressure gradient")
        self.measuring = False
        self.residuals = Residuals()
        self._has_impulse = False
        self._has_source = False
        self._traced_dt: float | None = None  # of what `_trace` holds for the velocity as it is
        self._is_diffused = False  # between diffusion and projection: w3 is in place
        self._solids_changed = True
        self._solids_of: np.ndarray | None = None
        self._coefficients_of: object = None
        self._packed: PackedFaces | None = None  # w2, then w3, between the stages of a step
        self._viscosity_solver = Viscosity(device, grid.size)
        self._pressure_solver = Pressure(device, grid.size)

    # -- the paper's step -------------------------------------------------------------------------------------------

    def step(self, dt: float, forces: Iterable[Force] = (), steer: Callable[[], None] | None = None) -> None:
        """Advance by `dt` seconds: w0 -> add force -> w1 -> advect -> w2 -> diffuse -> w3 -> project -> w4.

        `steer` is called with w3 in place: brushes that lead the picture by hand make up there for what viscosity took.
        """
        self.add_force(forces)
        self.advect(dt)
        self.diffuse(dt, unpack=steer is not None or self.measuring)
        if self.measuring:
            self.residuals = Residuals(viscous_residual=self._viscous_residual())
        if steer is not None:
            self._is_diffused = True
            steer()
            self._is_diffused = False
        with self._watching_projection():
            self.project()
        self._traced_dt = None

    def add_force(self, forces: Iterable[Force]) -> None:
        """w1 = w0 + dt f, f the sum of the forces and of what brushes have drawn; laid out to be advected.

        Half the last pressure gradient is subtracted where the fluid departs, so that with the projection, where it
        arrives, pressure acts along the path by the trapezoidal rule: second order in time, where the paper's splitting
        is first order and dissipates (it takes dt^2 |grad p|^2 of energy a step). Xiu and Karniadakis, J. Comput. Phys.
        172 (2001), treat such schemes.
        """
        with self.device.stage("add force"):
            acting = [(force, impulse) for force, impulse in forces if impulse != 0.0]
            if self._has_impulse or len(acting) > 1:
                add = self.device.pass_("step/add_force.frag")
                for force, impulse in acting:
                    add(self.impulse, add=True, force=force, impulse=impulse)
                acting, self._has_impulse = [(self.impulse, 1.0)], True
            inputs: dict[str, Any] = {"velocity": self.velocity.read, "carried": self._carried.read}
            defines: dict[str, Any] = {}
            for force, impulse in acting:
                inputs |= {"force": force, "impulse": impulse}
                defines = {"FORCE": 1}
            width, height = self._departing.size
            inside = (RIM, RIM, width - 2 * RIM, height - 2 * RIM)
            around = [(0, 0, width, RIM), (0, height - RIM, width, RIM)]
            around += [(x, RIM, RIM, height - 2 * RIM) for x in (0, width - RIM)]
            self.device.pass_("step/depart.frag", **defines)(self._departing, region=inside, **inputs)
            edges = self.device.pass_("step/depart.frag", EDGES=1, **defines, **self._wall_defines())
            edges(self._departing, region=around, **inputs, **self._wall_inputs())
            self._forget_impulse()

    def add_impulse(self, draw: Callable[[Field], None]) -> None:
        """Let `draw` add a change of velocity, lengths / s, to the field of MAC faces it is handed.

        It acts in the next step, with the forces; on w3 while a step is being steered.
        """
        with self.device.stage("add force"):
            if self._is_diffused:
                draw(self.velocity.read)
            else:
                draw(self.impulse)
                self._has_impulse = True

    def advect(self, dt: float) -> None:
        """w2(x) = w1(x - dt w0(x)): second-order backtrace, cubic interpolation; drag acts on the way.

        Carried by w0 where the paper has w1: that is free of divergence and does not cross solids, and the warp map has
        just been carried by it, so that the trace is there already.
        """
        trace = self.trace(dt)
        self._take_up_masks(dt)
        with self.device.stage("advect"):
            self._packed = self._viscosity_solver.v_star
            packing = self._viscosity_solver.packing
            advect = self.device.pass_("step/advect.frag", **packing.defines)
            decay = math.exp(-self.params.drag * dt)
            advect(self._packed.fields, region=packing.region, departing=self._departing, trace=trace, decay=decay,
                   **packing.open)  # fmt: skip

    def trace(self, dt: float) -> Field:
        """How far the velocity carries in `dt` seconds what arrives at the cells' centres: x_departed - x, cells.

        Valid until the velocity changes.
        """
        if dt != self._traced_dt:
            with self.device.stage("trace"):
                trace = self.device.pass_("step/trace.frag", **self._wall_defines())
                trace(self._trace, velocity=self.faces(), dt_over_h=dt / self.grid.h, **self._wall_inputs())
            self._traced_dt = dt
        return self._trace

    def carry(self, displacement: DoubleField, dt: float) -> None:
        """Carry a displacement at the cells' centres, longer sides, along `dt` seconds of the velocity.

        What is carried first after a step is drawn together with the trace, which the next step takes over.
        """
        inputs: dict[str, Any] = {"displacement": displacement.read, "h": self.grid.h}
        if dt == self._traced_dt:
            self.device.pass_("warp/advance.frag")(displacement.write, trace=self._trace, **inputs)
        else:
            advance = self.device.pass_("warp/advance.frag", TRACE=1, **self._wall_defines())
            inputs |= {"velocity": self.faces(), "dt_over_h": dt / self.grid.h, **self._wall_inputs()}
            advance((displacement.write, self._trace), **inputs)
            self._traced_dt = dt
        displacement.swap()

    def diffuse(self, dt: float, unpack: bool = True) -> None:
        """(I - dt div mu (grad + grad^T)) w3 = w2: implicit, both components coupled.

        Without `unpack` w3 stays as the viscous solver packs it, for the projection, and `velocity` is w0 until then.
        """
        with self.device.stage("diffuse"):
            self._packed = self._viscosity_solver.solve()
            if unpack:
                self._viscosity_solver.unpack(self._packed, self.velocity.read)
                self._packed = None

    def project(self) -> None:
        """w4 = w3 - grad q with lap q = div w3 - source: divergence-free but for the brushes' sources."""
        with self.device.stage("project"):
            self._take_up_solids()
            source = self.source if self._has_source else None
            packed, self._packed = self._packed, None
            self._pressure_solver.project(
                self.velocity, self.params.pressure_cycles, source, warm=True, carried=self._carried, packed=packed
            )
            if self._has_source:
                self.source.clear()
                self._has_source = False
            self._traced_dt = None

    # -- what is put in ---------------------------------------------------------------------------------------------

    def set_velocity(self, array: np.ndarray) -> None:
        """Set u on left faces and v on upper faces from (ny, nx, 2); the walls' own faces become zero."""
        faces = np.array(array, np.float32)
        faces[:, 0, 0] = 0.0
        faces[0, :, 1] = 0.0
        self.velocity.read.set(faces)
        self._forget_last_step()

    def set_viscosity(self, viscosity: np.ndarray | float) -> None:
        """Set the viscosity of the cells, lengths^2 / s, from (ny, nx) or one number.

        Raises:
            ValueError: if a value is negative or not finite.
        """
        array = np.broadcast_to(np.asarray(viscosity, np.float32), (self.grid.ny, self.grid.nx))
        if not (np.isfinite(array).all() and (array >= 0).all()):
            raise ValueError("viscosity must be finite and not negative everywhere")
        self.viscosity.set(array)
        self.masks_changed()

    def set_solid(self, solid: np.ndarray) -> None:
        """Freeze the cells where the (ny, nx) array is true or non-zero: their faces do not move."""
        self.solid.set(np.where(np.asarray(solid), 255, 0).astype(np.uint8))
        self.masks_changed()

    def masks_changed(self) -> None:
        """Say that something was drawn into `viscosity` or `solid`; the next step takes it up."""
        self._coefficients_of = None
        self._solids_changed = True

    def add_source(self, source: Field, amount: float = 1.0) -> None:
        """Let the next projection leave a divergence of `amount` times `source` (cells, 1 / s): bloat, or pinch."""
        self.device.pass_("step/add_source.frag")(self.source, add=True, source=source, amount=amount)
        self.source_drawn()

    def source_drawn(self) -> None:
        """Say that something was drawn into `source`; the next projection uses it up."""
        self._has_source = True

    # -- what is read out -------------------------------------------------------------------------------------------

    def faces(self) -> Field:
        """The velocity on MAC faces, as the warp map, the overlays and the density take it."""
        return self.velocity.read

    def velocity_at_centres(self) -> np.ndarray:
        """Velocity at cell centres, (ny, nx, 2) float32."""
        faces = np.pad(self.faces().get(), ((0, 1), (0, 1), (0, 0)))
        return 0.5 * np.stack([faces[:-1, :-1, 0] + faces[:-1, 1:, 0], faces[:-1, :-1, 1] + faces[1:, :-1, 1]], axis=-1)

    def divergence(self) -> np.ndarray:
        """Divergence of the velocity, (ny, nx) float32, 1 / s."""
        faces = np.pad(self.velocity.read.get(), ((0, 1), (0, 1), (0, 0)))
        across, down = np.diff(faces[:-1, :, 0], axis=1), np.diff(faces[:, :-1, 1], axis=0)
        return (across + down) / np.float32(self.grid.h)

    def pressure(self) -> np.ndarray:
        """The last projection's q, (ny, nx) float32, lengths^2 / s: pressure times dt."""
        return self._pressure_solver.pressure

    def motion(self) -> Motion:
        """Kinetic energy (integral of |v|^2 / 2) and largest speed; reads the velocity back."""
        speed = np.linalg.norm(self.velocity_at_centres().astype(np.float64), axis=-1)
        return Motion(float(0.5 * (speed**2).sum() * self.grid.h**2), float(speed.max()))

    @contextmanager
    def _watching_projection(self) -> Iterator[None]:
        if not self.measuring:
            yield
            return
        wanted = self.source.get()
        norms = [self._divergence_norm(wanted)]
        yield
        norms.append(self._divergence_norm(wanted))
        self.residuals = replace(self.residuals, divergence_before=norms[0], divergence_after=norms[1])

    def _divergence_norm(self, wanted: np.ndarray) -> float:
        return float(np.sqrt(np.mean((self.divergence().astype(np.float64) - wanted) ** 2)))

    def _viscous_residual(self) -> float | None:
        return self._viscosity_solver.residual_norm(self.velocity.read)

    # -- checkpoints ------------------------------------------------------------------------------------------------

    def state(self) -> Sequence[Field]:
        """The fields that a later step depends on, for checkpoints: copies of them bring this moment back exactly."""
        solvers = *self._viscosity_solver.state(), *self._pressure_solver.state()
        return self.velocity.read, self._carried.read, *solvers, self.viscosity, self.solid

    def load(self, state: Sequence[Field]) -> None:
        """Go back to copies of `state()` taken earlier."""
        for field, saved in zip(self.state(), state, strict=True):
            field.copy_from(saved)
        self._traced_dt = None
        self._forget_impulse()
        self.masks_changed()

    def clear_velocity(self) -> None:
        """Stop all motion."""
        self.velocity.read.clear()
        self._forget_last_step()

    def release(self) -> None:
        """Free the textures."""
        for item in (self.velocity, self.viscosity, self.solid, self.source):
            item.release()
        for item in (self.impulse, self._trace, self._departing, self._carried):
            item.release()
        self._viscosity_solver.release()
        self._pressure_solver.release()

    def _forget_impulse(self) -> None:
        if self._has_impulse:
            self.impulse.clear()
            self._has_impulse = False

    def _forget_last_step(self) -> None:
        self._forget_impulse()
        self._traced_dt = None
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
        if self._solids_changed:
            solid = self.solid.get()
            if self._solids_of is None or not np.array_equal(solid, self._solids_of):
                self._pressure_solver.set_solids(self.solid if solid.any() else None)
                self._solids_of = solid
            self._solids_changed = False

    def _wall_defines(self) -> dict[str, Any]:
        return {"NO_SLIP": 1} if self.params.walls.slip == "none" else {}

    def _wall_inputs(self) -> dict[str, Any]:
        return {"wall_speed": self.params.walls.speed} if self.params.walls.slip == "none" else {}

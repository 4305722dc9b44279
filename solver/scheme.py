"""What a fluid scheme is: the stages of a step, what is put in, what is read out, and its state."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from solver.faces import Forces, Vector, check_field
from solver.gl.context import ContextError
from solver.gl.device import Device
from solver.gl.field import Field, FieldError
from solver.grid import Grid
from solver.limits import as_mask, check_finite, check_type, viscosities
from solver.params import FluidParams
from solver.state import State


@dataclass(frozen=True)
class Residuals:
    """What the two solves of the last step left over; see `Scheme.measuring`.

    Attributes:
        divergence_before, divergence_after: root mean square over the cells, 1 / s, of the divergence less the source.
        viscous_residual: of the implicit viscous step, relative; None where the scheme does not tell.
    """

    divergence_before: float = 0.0
    divergence_after: float = 0.0
    viscous_residual: float | None = None

    @property
    def divergence_left(self) -> float:
        """The fraction of the divergence that the projection has left."""
        return self.divergence_after / self.divergence_before if self.divergence_before else 0.0


@dataclass(frozen=True)
class FlowStatistics:
    """How fast the fluid moves, for stop conditions and statistics."""

    kinetic_energy: float
    largest_speed: float


class Additions:
    """A field that sums up what is added between two steps, and is used up by the next."""

    def __init__(self, device: Device, size: tuple[int, int], components: int, label: str) -> None:
        self.field = device.field(size, components, label)
        self.is_empty = True

    def add(self, draw: Callable[[Field], None]) -> None:
        """Let `draw` add to the field."""
        draw(self.field)
        self.is_empty = False

    def clear(self) -> None:
        """Empty it."""
        if not self.is_empty:
            self.field.clear()
            self.is_empty = True

    def release(self) -> None:
        self.field.release()


class Scheme(ABC):
    """A fluid on a grid: what `Fluid` and `PaperFluid` both are, for brushes, maps and the program.

    Everything is in the units of CONTRIBUTING.md: the longer side of the picture is 1, y points down, velocities are
    lengths per second.

    Args:
        device: where it lives.
        grid: its cells; see `Grid.for_picture`.
        params: walls, drag, cycles; may be replaced between steps.

    Attributes:
        time: seconds that its steps have made up to now.
        viscosity, solid: at cells, lengths^2 / s, and how far each is closed, 1 for solid; call `masks_changed` after
            drawing into them.
        impulse: what brushes have drawn on MAC faces for the next step, lengths / s.
        source: the divergence that the next projection shall leave, at cells, 1 / s: bloat, or pinch.
        local: a motion on MAC faces, lengths / s, that carries the picture, but not the fluid, until the next step.
        measuring: every step computes its `residuals`, which is slow and changes no result.
    """

    def __init__(self, device: Device, grid: Grid, params: FluidParams | None = None) -> None:
        check_type("what a fluid lives in", device, Device)
        check_type("the cells of a fluid", grid, Grid)
        self.device = device
        self.grid = grid
        self.params = params or FluidParams()
        self.time = 0.0
        self.viscosity = device.field(grid.size, 1, "viscosity")
        self.solid = device.field(grid.size, 1, "solid", "f1")
        self.impulse = Additions(device, grid.size, 2, "impulse")
        self.source = Additions(device, grid.size, 1, "divergence source")
        self.local = Additions(device, grid.size, 2, "local motion")
        self._carrier = device.field(grid.size, 2, "what carries the picture")
        self.measuring = False
        self.residuals = Residuals()

    @property
    def params(self) -> FluidParams:
        """How a step is made; may be replaced between steps."""
        return self._params

    @params.setter
    def params(self, params: FluidParams) -> None:
        check_type("how a step is made", params, FluidParams)
        self._params = params

    # -- the paper's step -------------------------------------------------------------------------------------------

    @abstractmethod
    def step(self, dt: float, forces: Forces = (), steer: Callable[[Field], None] | None = None) -> None:
        """Advance by `dt` seconds: add force, advect, diffuse, project.

        Args:
            dt: seconds, of any size.
            forces: one or several: arrays (ny, nx, 2) on MAC faces, lengths / s^2; functions (x, y, t) that give both
                components; or pairs of a field on MAC faces and its time law integrated over the step.
            steer: is called with the velocity on MAC faces between diffusion and projection, and adds to it: there
                brushes make up for what viscosity took.

        Raises:
            ValueError: for a step or a force that is not finite, negative, of another shape, or too large.
            TypeError: for a step that is no number, a force that is none, or `steer` that cannot be called.
        """

    # -- what is put in ---------------------------------------------------------------------------------------------

    @abstractmethod
    def set_velocity(self, velocity: Vector) -> None:
        """Set the velocity, and forget the steps before."""

    @abstractmethod
    def clear_velocity(self) -> None:
        """Stop all motion."""

    def set_viscosity(self, viscosity: np.ndarray | float) -> None:
        """Set the viscosity of the cells, lengths^2 / s, from (ny, nx) or one number.

        Raises:
            ValueError: on another shape, or if a value is negative, not finite or too large.
        """
        self.viscosity.set(viscosities(viscosity, (self.grid.ny, self.grid.nx)))
        self.masks_changed()

    def set_solid(self, solid: np.ndarray) -> None:
        """Make exactly those cells solid where the (ny, nx) array is true or non-zero: nothing flows through them.

        Raises:
            ValueError: on another shape or a NaN.
        """
        self.solid.set(as_mask("solid cells", solid, (self.grid.ny, self.grid.nx)))
        self.masks_changed()

    @abstractmethod
    def masks_changed(self) -> None:
        """Say that something was drawn into `viscosity` or `solid`; the next step takes it up."""

    def add_source(self, source: Field, amount: float = 1.0) -> None:
        """Make the next projection leave a divergence of `amount` times `source` (cells, 1 / s): bloat, or pinch."""
        check_type("a source", source, Field)
        if source.size != self.grid.size or source.components != 1:
            raise ValueError(f"a source is {source}, {self.grid.nx} x {self.grid.ny} x 1 is wanted")
        check_finite("an amount of a source", amount)
        add = self.device.pass_("step/add_source.frag")
        self.source.add(lambda field: add(field, add=True, source=source, amount=amount))

    def add_local(self, motion: Field, amount: float = 1.0) -> None:
        """Make `amount` times `motion` (MAC faces, lengths / s) carry the picture until the next step; see `local`."""
        check_field("a motion", motion, self.grid)
        check_finite("an amount of a motion", amount)
        add = self.device.pass_("step/add_impulse.frag")
        self.local.add(lambda field: add(field, add=True, force=motion, impulse=amount))

    # -- what is read out -------------------------------------------------------------------------------------------

    @abstractmethod
    def faces(self) -> Field:
        """What flows through the MAC faces: the fluid's velocity times the open part of each, lengths / s."""

    def carrier(self) -> Field:
        """The velocity on MAC faces that carries the picture: the fluid's, plus `local` where faces are open."""
        faces = self.faces()
        if self.local.is_empty:
            return faces
        carry = self.device.pass_("step/carry.frag", LOCAL=1)
        carry(self._carrier, velocity=faces, local=self.local.field, solid=self.solid)
        return self._carrier

    @property
    def has_solids(self) -> bool:
        """True if some cell is closed, if only in part; waits for the GPU where one was drawn."""
        return bool(self.closed.any())

    @property
    @abstractmethod
    def closed(self) -> np.ndarray:
        """How far each cell is closed, (ny, nx) uint8, 255 for solid; read back where one was drawn."""

    @abstractmethod
    def velocity_at_centres(self) -> np.ndarray:
        """Velocity at cell centres, (ny, nx, 2) float32."""

    @abstractmethod
    def divergence(self) -> np.ndarray:
        """Divergence of the velocity, (ny, nx) float32, 1 / s."""

    @abstractmethod
    def pressure(self) -> np.ndarray:
        """The last projection's q, (ny, nx) float32, lengths^2 / s.

        It is dt times the pressure in the paper's scheme and in a first step of `Fluid`, half of that later: see (S2).
        """

    @property
    def u(self) -> np.ndarray:
        """What flows to the right through the faces between columns, with walls, (ny, nx + 1) float32; see `faces`."""
        return np.pad(self.faces().get()[..., 0], ((0, 0), (0, 1)))

    @property
    def v(self) -> np.ndarray:
        """What flows downwards through the faces between rows, with walls, (ny + 1, nx) float32; see `faces`."""
        return np.pad(self.faces().get()[..., 1], ((0, 1), (0, 0)))

    def vorticity(self) -> np.ndarray:
        """dv/dx - du/dy at the cells' corners, (ny + 1, nx + 1) float32, 1 / s, positive clockwise on the screen."""
        hx, hy = self.grid.spacing
        u, v = np.pad(self.u, ((1, 1), (0, 0)), mode="edge"), np.pad(self.v, ((0, 0), (1, 1)), mode="edge")
        beyond = v[:, 0], v[:, -1], u[0], u[-1]
        for image, sticks, speed in zip(beyond, self.params.walls.no_slip, self.params.walls.speed, strict=False):
            if sticks:
                image[:] = 2 * speed - image
        return np.diff(v, axis=1) / np.float32(hx) - np.diff(u, axis=0) / np.float32(hy)

    def stream_function(self) -> np.ndarray:
        """psi at the cells' corners with u = dpsi/dy and v = -dpsi/dx, (ny + 1, nx + 1) float32, lengths^2 / s.

        Zero at the walls. It describes the whole flow where that is free of divergence: not after a brush's source, and
        not between single stages and `project`.
        """
        return np.pad(np.cumsum(self.u * np.float32(self.grid.spacing[1]), axis=0), ((1, 0), (0, 0)))

    def motion(self) -> FlowStatistics:
        """Kinetic energy (integral of |v|^2 / 2, summed over the faces) and largest speed at cell centres."""
        faces, (hx, hy) = self.faces().get().astype(np.float64), self.grid.spacing
        speed = np.linalg.norm(self.velocity_at_centres().astype(np.float64), axis=-1)
        return FlowStatistics(float(0.5 * (faces**2).sum() * hx * hy), float(speed.max()))

    def _divergence_norm(self, wanted: np.ndarray | None) -> float:
        """Root mean square of the divergence less what is wanted, 1 / s; 0 if not `measuring`."""
        if wanted is None:
            return 0.0
        return float(np.sqrt(np.mean((self.divergence().astype(np.float64) - wanted) ** 2)))

    # -- its state --------------------------------------------------------------------------------------------------

    def save(self) -> State:
        """A copy of this moment, on the GPU, which the caller releases."""
        return replace(State.of(self.device, self._live(), time=self.time), grid=self.grid)

    def restore(self, state: State) -> None:
        """Go back to a saved moment, exactly; input for the next step is forgotten.

        Raises:
            ValueError: if the state is of another grid or of another scheme.
        """
        check_type("what to go back to", state, State)
        time = state.values.get("time", np.array(np.nan))
        if time.shape or not np.isfinite(time):
            raise ValueError("the state is of no time")
        if state.grid != self.grid:
            raise ValueError(f"the state is of another grid, {state.grid}, than {self.grid}")
        state.write_to(self._live())
        self.time = float(time)
        self.impulse.clear()
        self.source.clear()
        self.local.clear()
        self.masks_changed()

    @abstractmethod
    def _live(self) -> dict[str, Field]:
        """The textures that a later step depends on."""

    def release(self) -> None:
        """Free the textures."""
        for item in (self.viscosity, self.solid, self.impulse, self.source, self.local, self._carrier):
            item.release()

    def __repr__(self) -> str:
        cells = f"{type(self).__name__}({self.grid.nx} x {self.grid.ny} cells, t = {self.time:.6g} s"
        try:
            motion = self.motion()
        except (FieldError, ContextError) as error:
            return f"{cells}, {error})"
        return (
            f"{cells}, "
            f"{self.params.walls.slip}-slip walls, energy {motion.kinetic_energy:.4g}, "
            f"fastest {motion.largest_speed:.4g} sides / s)".replace("none-slip", "no-slip")
        )

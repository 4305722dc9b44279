"""The warp map: where every point of the result is looked up in the original."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field, FieldError
from solver.gl.points import draw_at
from solver.gl.reduction import Reduction
from solver.grid import Grid
from solver.scheme import State, check_field, check_step, on_faces
from solver.warp.inverse import ForwardMap

if TYPE_CHECKING:
    from solver.fluid import Fluid

Velocity = Callable[[np.ndarray, np.ndarray, float], tuple[np.ndarray, np.ndarray]]

CHECK_EVERY = 8  # steps between two looks at how far the map is bent since the last remap
STEEPEST = 1.0  # largest |grad D| that the cubic carries well


@dataclass(frozen=True)
class MapStatistics:
    """How a map distorts, by central differences at the simulation's cell centres.

    Attributes:
        det_min, det_max: of the Jacobian of x + D(x): how many times larger an area it is looked up in.
        folds: cells where it is zero or negative.
        det_error: mean of |det - 1|.
        displacement_max, displacement_mean: |D|, longer sides.
    """

    det_min: float
    det_max: float
    folds: int
    det_error: float
    displacement_max: float
    displacement_mean: float


class WarpMap:
    """The map x -> x + D(x) from the result to the original, carried along by a fluid without blurring.

    Two levels (the characteristic mapping method): a submap of what has moved lately, on the simulation's grid, and the
    accumulated map A, on a finer one, which takes the submap S in (a remap) before that is bent so far that
    interpolating it every step would show. D(x) = S(x) + A(x + S(x)); longer sides, RG32F at cell centres.
    Every place x + S(x) lies in the picture, and every x + D(x) there or where a map that was `set` had looked.

    Args:
        device: the device.
        grid: the simulation's grid.
        scale: texels of the accumulated map along a cell.
        remap_every: most steps between two remaps.
    """

    def __init__(self, device: Device, grid: Grid, scale: int = 2, remap_every: int = 64) -> None:
        self.device = device
        self.grid = grid
        self.scale = scale
        self.remap_every = remap_every
        fine = grid.nx * scale, grid.ny * scale
        self._submap = device.double_field(grid.size, 2, "submap")
        self._accumulated = device.double_field(fine, 2, "accumulated map")
        self._trace = device.field(grid.size, 2, "warp map, trace")
        self._largest = device.field(grid.size, 4, "warp map, largest distortion")
        self._total = device.field(grid.size, 4, "warp map, total distortion")
        corners = grid.nx - 1, grid.ny - 1
        self._steepness = device.field(corners, 1, "warp map, steepness")
        self._find_steepest = Reduction(device, corners, 1, "max")
        self._find_largest = Reduction(device, grid.size, 4, "max")
        self._find_total = Reduction(device, grid.size, 4, "sum")
        self._scratch = self._trace, self._steepness, self._largest, self._total
        self._reductions = self._find_steepest, self._find_largest, self._find_total
        self._held: Field | None = None
        self._held_cells: np.ndarray | None = None  # what it holds; None if no cell
        self._composed: dict[tuple[int, bool], Field] = {}
        self._fresh: set[tuple[int, bool]] = set()  # of these, what holds the present map
        self._steps = 0  # since the last remap
        self._limits = self._picture = (0.0, 0.0, *grid.extent)  # of the places looked up: left, top, right, bottom
        self.version = 0  # counts the changes, for those who keep what they made of the map

    # -- moving it --------------------------------------------------------------------------------------------------

    def follow(self, fluid: Fluid, dt: float) -> None:
        """Carry the map one step by a fluid, along the trace that the fluid's own next step follows too."""
        self.advance_traced(fluid.trace(check_step(dt)))

    def advance(self, velocity: Field, dt: float) -> None:
        """Carry the map one step by a velocity on the MAC grid, constant over the step: second-order backtrace."""
        check_field("a velocity", velocity, self.grid)
        hx, hy = self.grid.spacing
        dt = check_step(dt)
        self.device.pass_("step/trace.frag")(self._trace, velocity=velocity, cells_a_speed=(dt / hx, dt / hy))
        self.advance_traced(self._trace)

    def advance_traced(self, trace: Field) -> None:
        """Carry the map one step, given for every cell centre how far back the fluid came from, in cells."""
        check_field("a trace", trace, self.grid)
        advance = self.device.pass_("warp/advance.frag")
        advance(self._submap.write, displacement=self._submap.read, trace=trace, spacing=self.grid.spacing)
        self._submap.swap()
        self._advanced()

    def _advanced(self) -> None:
        """Count a step, and remap if it is time to."""
        self._steps += 1
        self._changed()
        # The look waits for the GPU, so not at every step; at fixed steps, so that a replay remaps at the same ones.
        if self._steps >= self.remap_every or (self._steps % CHECK_EVERY == 0 and self._is_steep()):
            self.remap()

    def advance_prescribed(self, velocity: Velocity | np.ndarray, dt: float, time: float = 0.0) -> None:
        """Carry the map from `time` to `time + dt` by a velocity that is given.

        Args:
            velocity: a function (x, y, t) -> (u, v) on float64 arrays, lengths per second, followed back by a
                fourth-order Runge-Kutta step of its own exact values; or an array (ny, nx, 2) on the MAC grid.
                What would come from beyond the picture's edge comes from the edge.
            dt: the step.
            time: where it begins, for the function.

        Raises:
            ValueError: on an array of another shape, a value that is not finite, or a step that is none.
        """
        dt = check_step(dt)
        if isinstance(velocity, np.ndarray):
            field = self.device.upload(on_faces("a velocity", velocity, self.grid), "prescribed velocity")
            self.advance(field, dt)
            field.release()
            return
        x, y = self.grid.centres()
        back_x, back_y = _runge_kutta(velocity, x, y, time + dt, -dt)
        width, height = self.grid.extent
        back = np.stack([np.clip(back_x, 0, width) - x, np.clip(back_y, 0, height) - y], axis=-1)
        self._trace.set(back / self.grid.spacing)
        self.advance_traced(self._trace)

    def remap(self) -> None:
        """Let the accumulated map take in what has moved lately; the whole map stays what it was."""
        if self._steps:
            self._compose(self._accumulated.write)
            self._accumulated.swap()
            self._submap.read.clear()
            self._steps = 0

    def hold(self, solid: Field) -> None:
        """From now on, change nothing inside solids: in the solid cells whose eight neighbours are solid as well.

        The outermost solid cells let the map go over into what moves. Looking a picture up reaches into the next cell,
        so that pixels whose cells lie two inside a solid stay as they are to the bit, moved before or not.
        """
        if solid.size != self.grid.size:
            raise ValueError(f"solid cells are {solid}, {self.grid.nx} x {self.grid.ny} are wanted")
        cells = _inside(solid.get() > 0)
        given = cells if cells.any() else None
        if not _same(given, self._held_cells):
            self.remap()
            self._set_held(given)
            self._changed()

    def restore_under(
        self, center: tuple[float, float], radius: float, hardness: float = 0.0, amount: float = 1.0
    ) -> None:
        """Let the map go back to the identity under a round brush, but in held cells.

        Args:
            center, radius: longer sides.
            hardness: the part of the radius that is fully under the brush, 0-1; the rest falls off smoothly.
            amount: 0-1, the part of the displacement that is taken away at the centre.
        """
        for pair in (self._submap, self._accumulated):
            self.device.pass_("warp/restore.frag", **self._held_defines())(
                pair.write,
                displacement=pair.read,
                extent=self.grid.extent,
                center=center,
                radius=radius,
                hardness=min(hardness, 0.99),
                amount=amount,
                **self._held_inputs(),
            )
            pair.swap()
        self._changed()

    # -- its state --------------------------------------------------------------------------------------------------

    def reset(self) -> None:
        """Back to the identity."""
        self._submap.read.clear()
        self._accumulated.read.clear()
        self._steps = 0
        self._limits = self._picture
        self._changed()

    def set(self, displacement: np.ndarray) -> None:
        """Take over a displacement (h, w, 2) in longer sides, of any size from 6 x 6, laid over the whole domain.

        Raises:
            FieldError: on another shape, also one that is upright for a picture that is not, or a value that is not
                finite.
        """
        displacement = np.asarray(displacement)
        if displacement.ndim != 3 or displacement.shape[2] != 2 or min(displacement.shape[:2]) < 6:
            raise FieldError(f"a map of shape {displacement.shape} was given, (h, w, 2) from 6 x 6 is wanted")
        given = self.device.upload(displacement.astype(np.float32), "given map")
        (rows, columns), (width, height) = displacement.shape[:2], self.extent
        if (columns - rows) * (width - height) < 0:
            given.release()
            raise FieldError(
                f"a map of {columns} x {rows} was given for a picture of {width:.4g} x {height:.4g}: is it transposed?"
            )
        self.reset()
        self._resample(given, self._accumulated.read, (0.0, 0.0), self._accumulated.read.texel)
        given.release()
        x, y = (np.arange(columns) + 0.5) / columns * width, (np.arange(rows) + 0.5) / rows * height
        across, down = x + displacement[..., 0], y[:, None] + displacement[..., 1]
        # Each of them in float32, as the shaders take them.
        lowest, highest = np.minimum(0, [across.min(), down.min()]), [across.max(), down.max()]
        self._limits = (*lowest.tolist(), *np.maximum(self.extent, highest).tolist())

    def save(self) -> State:
        """A copy of this moment, on the GPU, which the caller releases."""
        values = {"steps": self._steps, "limits": self._limits, "held": self._held_cells}
        return State.of(self.device, self._live(), **values)

    def restore(self, state: State) -> None:
        """Go back to a saved state, exactly.

        Raises:
            ValueError: if it is of another grid.
        """
        state.write_to(self._live())
        self._steps = int(state.values["steps"])
        left, top, right, bottom = state.values["limits"].tolist()
        self._limits = left, top, right, bottom
        held = state.values.get("held")
        if not _same(held, self._held_cells):
            self._set_held(held)
        self._changed()

    def _live(self) -> dict[str, Field]:
        return {"submap": self._submap.read, "accumulated map": self._accumulated.read}

    @property
    def extent(self) -> tuple[float, float]:
        """(width, height) of the domain, the longer of them 1."""
        return self.grid.extent

    @property
    def nbytes(self) -> int:
        """Bytes of texture memory, as long as nothing is read at other sizes."""
        own = [
            self._submap.read,
            self._submap.write,
            self._accumulated.read,
            self._accumulated.write,
            *self._composed.values(),
        ]
        return sum(thing.nbytes for thing in (*own, *self._scratch, *self._reductions))

    def release(self) -> None:
        """Free the textures."""
        self._set_held(None)
        for thing in (self._submap, self._accumulated, *self._composed.values(), *self._scratch, *self._reductions):
            thing.release()
        if "forward" in self.__dict__:
            self.forward.release()

    # -- reading it -------------------------------------------------------------------------------------------------

    def composed(self, scale: int | None = None, exact: bool = False) -> Field:
        """The whole map's displacement on `scale` texels a cell, by default the accumulated map's.

        Valid until the map changes, and to be looked up between its texels by the cubic; unless `exact`, so is the
        accumulated map for it.
        """
        scale = scale or self.scale
        if scale == self.scale and self._steps == 0:
            return self._accumulated.read
        key = scale, exact
        if key not in self._composed:
            size = self.grid.nx * scale, self.grid.ny * scale
            self._composed[key] = self.device.field(size, 2, f"warp map at {scale}")
        if key not in self._fresh:
            self._compose(self._composed[key], **({} if exact else {"CUBIC": 1}))
            self._fresh.add(key)
        return self._composed[key]

    def read(self, size: tuple[int, int] | None = None) -> np.ndarray:
        """The displacement at the pixel centres of a picture of `size` (width, height), by default the grid's.

        Returns:
            float32 (height, width, 2), longer sides.
        """
        field = self.device.field(size or self.grid.size, 2, "warp map, to read")
        self._compose(field)
        displacement = field.get()
        field.release()
        return displacement

    def at(self, points: np.ndarray) -> np.ndarray:
        """The displacement at points (n, 2) of the result, in longer sides: float32 (n, 2)."""
        return draw_at(
            self.device, points, self.grid.extent, "warp/compose.frag", self._held_defines(), **self._parts()
        )

    def probe(self, target: Field, place: tuple[float, float], step: tuple[float, float]) -> None:
        """Draw the displacement around a place into a small field, its texels `step` apart, both 0-1 of the domain."""
        origin = place[0] / step[0] - target.size[0] / 2, place[1] / step[1] - target.size[1] / 2
        compose = self.device.pass_("warp/compose.frag", **self._held_defines())
        compose(target, **self._parts(), origin=origin, step=step)

    @cached_property
    def forward(self) -> ForwardMap:
        """The inverse: where points of the original go."""
        return ForwardMap(self)

    def statistics(self) -> MapStatistics:
        """How the whole map distorts; waits for the GPU."""
        targets = self._largest, self._total
        self.device.pass_("warp/distortion.frag")(targets, displacement=self.composed(1), spacing=self.grid.spacing)
        largest, total = self._find_largest(self._largest).tolist(), self._find_total(self._total).tolist()
        cells = self.grid.nx * self.grid.ny
        return MapStatistics(
            det_min=-largest[0],
            det_max=largest[1],
            folds=int(total[0]),
            det_error=total[2] / cells,
            displacement_max=largest[2],
            displacement_mean=total[1] / cells,
        )

    # -- its parts --------------------------------------------------------------------------------------------------

    def _compose(self, target: Field, **defines: object) -> None:
        compose = self.device.pass_("warp/compose.frag", **self._held_defines(), **defines)
        compose(target, **self._parts(), origin=(0.0, 0.0), step=target.texel)

    def _parts(self) -> dict[str, Any]:
        """What `compose.frag` puts together."""
        maps = {"submap": self._submap.read, "accumulated": self._accumulated.read}
        return {**maps, "extent": self.grid.extent, "limits": self._limits, **self._held_inputs()}

    def _held_defines(self) -> dict[str, object]:
        return {"HELD": 1} if self._held else {}

    def _held_inputs(self) -> dict[str, Any]:
        return {"held": self._held} if self._held else {}

    def _set_held(self, cells: np.ndarray | None) -> None:
        if self._held is not None:
            self._held.release()
        self._held = None if cells is None else self.device.upload(cells.astype(np.uint8) * 255, "held cells")
        self._held_cells = cells

    def _is_steep(self) -> bool:
        """True if the map is bent too far since the last remap; waits for the GPU."""
        self.device.pass_("warp/steepness.frag")(
            self._steepness, displacement=self._submap.read, spacing=self.grid.spacing
        )
        return self._find_steepest(self._steepness)[0] > STEEPEST**2

    def _resample(self, source: Field, target: Field, origin: tuple[float, float], step: tuple[float, float]) -> None:
        self.device.pass_("warp/resample.frag")(target, displacement=source, origin=origin, step=step)

    def _changed(self) -> None:
        self.version += 1
        self._fresh.clear()


def _inside(cells: np.ndarray) -> np.ndarray:
    """The cells whose eight neighbours are chosen too; beyond the edge it goes on as at the edge."""
    for axis in (0, 1):
        padded = np.pad(cells, [(1, 1) if axis == k else (0, 0) for k in (0, 1)], mode="edge")
        n = cells.shape[axis]
        cells = np.all([np.take(padded, range(shift, shift + n), axis) for shift in (0, 1, 2)], axis=0)
    return cells


def _same(a: np.ndarray | None, b: np.ndarray | None) -> bool:
    return (a is None and b is None) or (a is not None and b is not None and np.array_equal(a, b))


def _runge_kutta(
    velocity: Velocity, x: np.ndarray, y: np.ndarray, time: float, dt: float
) -> tuple[np.ndarray, np.ndarray]:
    """Where points are carried in `dt` by a velocity: the classical fourth-order step."""
    u1, v1 = velocity(x, y, time)
    u2, v2 = velocity(x + dt / 2 * u1, y + dt / 2 * v1, time + dt / 2)
    u3, v3 = velocity(x + dt / 2 * u2, y + dt / 2 * v2, time + dt / 2)
    u4, v4 = velocity(x + dt * u3, y + dt * v3, time + dt)
    return x + dt / 6 * (u1 + 2 * u2 + 2 * u3 + u4), y + dt / 6 * (v1 + 2 * v2 + 2 * v3 + v4)

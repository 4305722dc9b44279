"""The warp map: where every point of the result is looked up in the original."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field, FieldError
from solver.gl.points import draw_at
from solver.grid import Grid
from solver.scheme import State, check_field, check_step, on_faces
from solver.warp.accumulated import LEAST_TEXELS, AccumulatedMap
from solver.warp.distortion import MapStatistics, distortion
from solver.warp.frozen import Frozen, saved_of
from solver.warp.state import MapState, grid_in, kind_values, values_of
from solver.warp.submap import Submap, window_of

if TYPE_CHECKING:
    from solver.fluid import Fluid

Velocity = Callable[[np.ndarray, np.ndarray, float], tuple[np.ndarray, np.ndarray]]

CHECK_EVERY = 8  # steps between two looks at how far the map is bent since the last remap
MOST_PLACES = 2**19  # at which its distortion is looked at
REMAP_STEPS = CHECK_EVERY  # steps over which a remap is spread; the next one cannot begin before they are over


class WarpMap:
    """The map x -> x + D(x) from the result to the original, carried along by a fluid without blurring.

    Two levels (the characteristic mapping method): a submap of what has moved lately, on the simulation's grid, which
    may be a window of the picture, and the accumulated map A of the whole picture, which takes the submap S in (a
    remap) before that is bent so far that interpolating it every step would show. D(x) = S(x) + A(x + S(x)), S = 0
    outside the window; longer sides, RG32F at the centres of cells and texels. Only tiles of A that have moved are made
    anew, some in each of `REMAP_STEPS` steps; until all are there, the submap that they take in, *pending*, stands
    between S and A. Every place x + S(x) lies in the picture, and every x + D(x) there or where a map that was `set`
    had looked. Looking at the map changes nothing of it.

    Args:
        device: the device.
        grid: the simulation's grid.
        size: (width, height) of the accumulated map in texels, as of `map_size`; by default `LEAST_TEXELS` a cell.
        remap_every: most steps between two remaps.

    Attributes:
        grid: of the submap.
        extent: (width, height) of the picture, the longer of them 1.
        version: counts the changes, for those who keep what they made of the map.
    """

    def __init__(self, device: Device, grid: Grid, size: tuple[int, int] | None = None, remap_every: int = 64) -> None:
        self.device = device
        self.extent = grid.picture
        self.remap_every = remap_every
        self._submap = Submap(device, grid)
        across, down = self.coarse_size
        self.size = size or (LEAST_TEXELS * across, LEAST_TEXELS * down)
        self._accumulated = AccumulatedMap(device, self.size, self.extent)
        self._pending: Field | None = None
        self._pending_grid = grid
        self._remapping = 0  # steps that the pending submap has been taken in for
        self._frozen = Frozen(device, self.size)
        self._composed: dict[tuple[tuple[int, int], bool], Field] = {}
        self._fresh: set[tuple[tuple[int, int], bool]] = set()  # of these, what holds the present map
        self._steps = 0  # since the last remap
        self._limits = self._picture = (0.0, 0.0, *self.extent)  # of the places looked up: left, top, right, bottom
        self.version = 0

    @property
    def grid(self) -> Grid:
        return self._submap.grid

    # -- moving it --------------------------------------------------------------------------------------------------

    def follow(self, fluid: Fluid, dt: float) -> None:
        """Carry the map one step by a fluid, along the trace that the fluid's own next step follows too."""
        check_field("a velocity", fluid.faces(), self.grid)
        if tracing := fluid.begin_trace(check_step(dt)):
            self._submap.advance_tracing(tracing.target, tracing.defines, tracing.inputs)
            self._advanced()
        else:
            self.advance_traced(fluid.trace(dt))

    def advance(self, velocity: Field, dt: float) -> None:
        """Carry the map one step by a velocity on the MAC grid, constant over the step: second-order backtrace."""
        check_field("a velocity", velocity, self.grid)
        hx, hy = self.grid.spacing
        dt = check_step(dt)
        trace = self._submap.trace
        self.device.pass_("step/trace.frag")(trace, velocity=velocity, cells_a_speed=(dt / hx, dt / hy))
        self.advance_traced(trace)

    def advance_traced(self, trace: Field) -> None:
        """Carry the map one step, given for every cell centre how far back the fluid came from, in cells."""
        check_field("a trace", trace, self.grid)
        self._submap.advance(trace)
        self._advanced()

    def _advanced(self) -> None:
        """A step was made: remap as far as it is time to."""
        self._steps += 1
        self._changed()
        if self._pending is not None:
            self._remapping += 1
            self._take_in(self._remapping / REMAP_STEPS)
        # The look waits for the GPU, so not at every step; at fixed steps, so that a replay remaps at the same ones.
        if self._steps >= self.remap_every or (self._steps % CHECK_EVERY == 0 and self._submap.is_steep):
            self._begin_remap()

    def advance_prescribed(self, velocity: Velocity | np.ndarray, dt: float, time: float = 0.0) -> None:
        """Carry the map from `time` to `time + dt` by a velocity that is given.

        Args:
            velocity: a function (x, y, t) -> (u, v) on float64 arrays, lengths per second, followed back by a
                fourth-order Runge-Kutta step of its own exact values; or an array (ny, nx, 2) on the MAC grid.
                What would come from beyond the grid's edge comes from the edge.
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
        left, top, width, height = window_of(self.grid)
        back = np.stack([np.clip(back_x, left, left + width) - x, np.clip(back_y, top, top + height) - y], axis=-1)
        self._submap.trace.set(back / self.grid.spacing)
        self.advance_traced(self._submap.trace)

    def remap(self) -> None:
        """Let the accumulated map take in all that has moved, at once; the whole map stays what it was."""
        self._begin_remap()
        self._take_in(1.0)

    def move_to(self, grid: Grid) -> None:
        """Go on with a submap on another grid of the same picture; the map stays what it was.

        Raises:
            ValueError: if it is a grid of another picture.
        """
        if grid == self.grid:
            return
        if grid.picture != self.extent:
            raise ValueError(f"a map of a picture of {self.extent} cannot go on in one of {grid.picture}")
        self._begin_remap()
        if self._frozen.near is not None:
            self._take_in(1.0)  # it fades over the cells of its own grid
        self._submap.release()
        self._submap = Submap(self.device, grid)
        self._frozen.fade_over(self._cell)
        self._steps = 0
        self._changed()

    def hold(self, frozen: Field | None) -> None:
        """From now on, change nothing where a mask over the whole picture, of any size, is 1.

        Nor within two texels of the accumulated map around it, or three where the mask has other texels: what is looked
        up on a frozen pixel is interpolated from there. So frozen pixels stay as they are to the bit, moved before or
        not. Over one cell from there the map goes over into what flows.
        """
        saved = None if frozen is None else saved_of(self.device, frozen)
        if self._frozen.differs(saved):
            self.remap()
            self._frozen.restore(saved, self._cell)
            self._changed()
        if saved is not None:
            saved.release()

    def restore_under(
        self, center: tuple[float, float], radius: float, hardness: float = 0.0, amount: float = 1.0
    ) -> None:
        """Let the map go back to the identity under a round brush, but where it is frozen.

        Args:
            center, radius: longer sides.
            hardness: the part of the radius that is fully under the brush, 0-1; the rest falls off smoothly.
            amount: 0-1, the part of the displacement that is taken away at the centre.
        """
        self._take_in(1.0)
        restore = self.device.pass_("warp/restore.frag", **self._held_defines())
        inputs: dict[str, Any] = {"center": center, "radius": radius, "hardness": min(hardness, 0.99), "amount": amount}
        if self._frozen.near is not None:
            inputs |= {"near": self._frozen.near, "picture": self.extent}
        submap, accumulated = self._submap, self._accumulated
        restore(submap.write, displacement=submap.read, window=window_of(self.grid), **inputs)
        submap.swap()
        sides = zip(center, self.size, self.extent, strict=True)
        (left, right), (top, bottom) = (
            (max(math.floor((at - radius) / side * n), 0), min(math.ceil((at + radius) / side * n), n))
            for at, n, side in sides
        )
        if right > left and bottom > top:
            accumulated.change(
                (left, top, right - left, bottom - top),
                lambda target, regions: restore(
                    target, region=regions, displacement=accumulated.now, window=self._picture, **inputs
                ),
            )
        self._changed()

    # -- its state --------------------------------------------------------------------------------------------------

    def reset(self) -> None:
        """Back to the identity."""
        self._drop_pending()
        self._submap.read.clear()
        self._accumulated.clear()
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
        resample = self.device.pass_("warp/resample.frag")
        self._accumulated.set(lambda target: resample(target, displacement=given, origin=(0.0, 0.0), step=target.texel))
        given.release()
        x, y = (np.arange(columns) + 0.5) / columns * width, (np.arange(rows) + 0.5) / rows * height
        across, down = x + displacement[..., 0], y[:, None] + displacement[..., 1]
        # Each of them in float32, as the shaders take them.
        lowest, highest = np.minimum(0, [across.min(), down.min()]), [across.max(), down.max()]
        self._limits = (*lowest.tolist(), *np.maximum(self.extent, highest).tolist())

    def save(self) -> MapState:
        """A copy of this moment, on the GPU, which the caller releases; it shares with others what is the same."""
        fields: dict[str, Field] = {"submap": self._submap.read, "accumulated map": self._accumulated.now}
        values: dict[str, Any] = {"steps": self._steps, "limits": self._limits, "grid": values_of(self.grid)}
        if self._pending is not None:
            fields["pending"] = self._pending
            values |= {"remapping": self._remapping, "pending grid": values_of(self._pending_grid)}
        state = MapState.of(self.device, fields, **values)
        if self._frozen.saved is not None:
            state.tiles["frozen"] = self._frozen.saved.held()
            state.values["frozen kind"] = kind_values(self._frozen.saved.kind)
        return state

    def restore(self, state: State) -> None:
        """Go back to a saved state, exactly, and to the grid that it was on.

        Raises:
            ValueError: if it is of another picture.
        """
        grid = grid_in(state.values, "grid")
        tiles = state.tiles.get("accumulated map")
        if grid.picture != self.extent or tiles is None or tiles.kind != self._accumulated.now.kind:
            raise ValueError("the state is of another picture")
        self._accumulated.restore(tiles)
        if grid != self.grid:
            self._submap.release()
            self._submap = Submap(self.device, grid)
        self._submap.read.copy_from(state.fields["submap"])
        self._steps = int(state.values["steps"])
        left, top, right, bottom = state.values["limits"].tolist()
        self._limits = left, top, right, bottom
        self._frozen.restore(state.tiles.get("frozen"), self._cell)
        self._drop_pending()
        if (pending := state.fields.get("pending")) is not None:
            self._pending = self.device.field(pending.size, 2, "pending submap")
            self._pending.copy_from(pending)
            self._pending_grid = grid_in(state.values, "pending grid")
            self._remapping = int(state.values["remapping"])
            self._accumulated.begin(self._pending.get(), self._pending_grid)
        self._changed()

    @property
    def nbytes(self) -> int:
        """Bytes of texture memory, as long as nothing is read at other sizes."""
        parts = [self._submap, self._accumulated, self._frozen, *self._composed.values()]
        return sum(part.nbytes for part in parts) + (0 if self._pending is None else self._pending.nbytes)

    def release(self) -> None:
        """Free the textures."""
        self._drop_pending()
        for thing in (self._submap, self._accumulated, self._frozen, *self._composed.values()):
            thing.release()

    # -- reading it -------------------------------------------------------------------------------------------------

    def composed(self, size: tuple[int, int] | None = None, exact: bool = False) -> Field:
        """The whole map's displacement on `size` texels (width, height), by default the accumulated map's.

        Valid until the map changes, and to be looked up between its texels by the cubic; unless `exact`, so is the
        accumulated map for it.
        """
        size = size or self.size
        if size == self.size and self._steps == 0 and self._pending is None:
            return self._accumulated.now
        key = size, exact
        if key not in self._composed:
            self._composed[key] = self.device.field(size, 2, f"warp map at {size[0]} x {size[1]}")
        if key not in self._fresh:
            self._compose(self._composed[key], **({} if exact else {"CUBIC": 1}))
            self._fresh.add(key)
        return self._composed[key]

    def size_for(self, picture: tuple[int, int], result: tuple[int, int]) -> tuple[int, int]:
        """Texels to compose for a result of a picture, both in pixels: not finer than either needs.

        The accumulated map's, or one for a whole number of them: as many as the result has pixels, or else the picture,
        or two a cell. Where something is frozen it is the accumulated map's: what is looked up between coarser texels
        would reach beyond what is held.
        """
        if self._frozen.near is not None:
            return self.size
        sides = zip(self.size, result, picture, self.coarse_size, strict=True)
        times = max(1, min(own // min(wanted, max(given, 2 * cells)) for own, wanted, given, cells in sides))
        return -(-self.size[0] // times), -(-self.size[1] // times)

    @property
    def coarse_size(self) -> tuple[int, int]:
        """(width, height) in texels as large as the grid's cells, with the whole picture."""
        across, down = (side / step for side, step in zip(self.extent, self.grid.spacing, strict=True))
        return round(across), round(down)

    def read(self, size: tuple[int, int] | None = None) -> np.ndarray:
        """The displacement at the pixel centres of a picture of `size` (width, height), by default `coarse_size`.

        Returns:
            float32 (height, width, 2), longer sides.
        """
        field = self.device.field(size or self.coarse_size, 2, "warp map, to read")
        self._compose(field)
        displacement = field.get()
        field.release()
        return displacement

    def at(self, points: np.ndarray) -> np.ndarray:
        """The displacement at points (n, 2) of the result, in longer sides: float32 (n, 2)."""
        return draw_at(self.device, points, self.extent, "warp/compose.frag", self._defines(), **self._parts())

    def draw(self, target: Field, origin: tuple[float, float], step: tuple[float, float]) -> None:
        """Draw the displacement at (fragment + origin) step, 0-1 of the picture, to be looked at between its texels."""
        compose = self.device.pass_("warp/compose.frag", **self._defines() | {"CUBIC": 1})
        compose(target, **self._parts(), origin=origin, step=step)

    def probe(self, target: Field, place: tuple[float, float], step: tuple[float, float]) -> None:
        """Draw the displacement around a place into a small field, its texels `step` apart, both 0-1 of the picture."""
        origin = place[0] / step[0] - target.size[0] / 2, place[1] / step[1] - target.size[1] / 2
        compose = self.device.pass_("warp/compose.frag", **self._defines())
        compose(target, **self._parts(), origin=origin, step=step)

    def statistics(self, size: tuple[int, int] | None = None) -> MapStatistics:
        """How the whole map distorts, looked at on a lattice of `size`; waits for the GPU.

        By default that has a place for each texel of the accumulated map, or for a whole number of them where they
        would be more than `MOST_PLACES`.
        """
        if size is None:
            width, height = self.size
            apart = math.ceil(math.sqrt(width * height / MOST_PLACES))
            size = -(-width // apart), -(-height // apart)
        return distortion(self.device, size, self._chain_defines(), self._parts())

    # -- its parts --------------------------------------------------------------------------------------------------

    def _begin_remap(self) -> None:
        """Let what has moved stand by to be taken in, and begin with a submap of nothing."""
        if not self._steps:
            return
        self._take_in(1.0)
        self._steps = 0
        if self._accumulated.begin(self._submap.read.get(), self.grid):
            self._pending, self._pending_grid = self._submap.replace(), self.grid
            self._remapping = 0

    def _take_in(self, part: float) -> None:
        """Come to a `part`, 0-1, of what the pending submap wants."""
        if self._pending is None:
            return
        inputs = self._inputs() | {"submap": self._pending, "window": window_of(self._pending_grid)}
        fine = {"CUBIC": 1} if self._accumulated.is_fine(self._pending_grid) else {}
        compose = self.device.pass_("warp/compose.frag", REMAP=1, **fine, **self._held_defines())
        self._accumulated.draw(part, lambda target, regions: compose(target, region=regions, **inputs))
        if part >= 1:
            self._drop_pending()

    def _drop_pending(self) -> None:
        if self._pending is not None:
            self._pending.release()
        self._pending = None

    def _compose(self, target: Field, **defines: object) -> None:
        compose = self.device.pass_("warp/compose.frag", **self._defines() | defines)
        compose(target, **self._parts(), origin=(0.0, 0.0), step=target.texel)

    def _defines(self) -> dict[str, object]:
        """How the whole map is put together."""
        fine: dict[str, object] = {"CUBIC": 1} if self._accumulated.is_fine(self.grid) else {}
        return fine | self._chain_defines()

    def _chain_defines(self) -> dict[str, object]:
        return self._held_defines() | ({} if self._pending is None else {"PENDING": 1})

    def _held_defines(self) -> dict[str, object]:
        return {} if self._frozen.near is None else {"HELD": 1}

    def _parts(self) -> dict[str, Any]:
        """What `lib/warp.glsl` puts together."""
        inputs = self._inputs() | {"submap": self._submap.read, "window": window_of(self.grid)}
        if self._pending is not None:
            inputs |= {"pending": self._pending, "pending_window": window_of(self._pending_grid)}
        return inputs

    def _inputs(self) -> dict[str, Any]:
        """The same but for the submaps."""
        inputs = {"accumulated": self._accumulated.now, "picture": self.extent, "limits": self._limits}
        return inputs if self._frozen.near is None else inputs | {"near": self._frozen.near}

    @property
    def _cell(self) -> tuple[float, float]:
        """Texels of the accumulated map along a cell."""
        (across, down), (hx, hy), (width, height) = self.size, self.grid.spacing, self.extent
        return across * hx / width, down * hy / height

    def _changed(self) -> None:
        self.version += 1
        self._fresh.clear()


def _runge_kutta(
    velocity: Velocity, x: np.ndarray, y: np.ndarray, time: float, dt: float
) -> tuple[np.ndarray, np.ndarray]:
    """Where points are carried in `dt` by a velocity: the classical fourth-order step."""
    u1, v1 = velocity(x, y, time)
    u2, v2 = velocity(x + dt / 2 * u1, y + dt / 2 * v1, time + dt / 2)
    u3, v3 = velocity(x + dt / 2 * u2, y + dt / 2 * v2, time + dt / 2)
    u4, v4 = velocity(x + dt * u3, y + dt * v3, time + dt)
    return x + dt / 6 * (u1 + 2 * u2 + 2 * u3 + u4), y + dt / 6 * (v1 + 2 * v2 + 2 * v3 + v4)

"""The warp map: where every point of the result is looked up in the original.

Longer than most: the submap, the accumulated map and what is frozen have modules of their own; what moves, remaps,
saves and reads all of them together is here.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from solver.faces import check_field, on_faces
from solver.gl.device import Device
from solver.gl.field import Field, FieldError
from solver.gl.passes import Region
from solver.gl.points import draw_at
from solver.grid import Grid
from solver.limits import check_step, check_type, real_array
from solver.scheme import Scheme
from solver.state import State
from solver.warp.accumulated import LEAST_TEXELS, AccumulatedMap
from solver.warp.distortion import MapStatistics, distortion
from solver.warp.frozen import Frozen
from solver.warp.state import SUBMAPS, MapState, grid_in, values_of
from solver.warp.submap import Level, Submap, window_of

if TYPE_CHECKING:
    from solver.fluid import Fluid

Velocity = Callable[[np.ndarray, np.ndarray, float], tuple[np.ndarray, np.ndarray]]

CHECK_EVERY = 8  # steps between two looks at how far the map is bent since the last remap
MOST_PLACES = 2**19  # at which its distortion is looked at
REMAP_STEPS = CHECK_EVERY  # steps over which a remap is spread, at least
MOST_TILES = 8  # that are made anew in a step, unless something has to be out of the way: the work of one of the fluid
MOST_GATHERED = 8, 2**19  # texels of what is gathered, along a cell and in all, but for `LEAST_TEXELS` along a cell
NAMES = ("submap", "window"), ("second", "second_window"), ("third", "third_window")  # of levels, in shaders


class WarpMap:
    """The map x -> x + D(x) from the result to the original, carried along by a fluid without blurring.

    Two levels (the characteristic mapping method): a submap of what has moved lately, on the simulation's grid, which
    may be a window of the picture, and the accumulated map A of the whole picture, which takes the submap S in (a
    remap) before that is bent so far that interpolating it every step would show. D(x) = S(x) + A(x + S(x)), S = 0
    outside the window; longer sides, RG32F at the centres of cells and texels. Only tiles of A that have moved are made
    anew, a few in each step; until all are there, the submap that they take in, *pending*, stands between S and A, and
    what is to be remapped meanwhile is *gathered* in a level between the two, of several texels a cell. Every place
    x + S(x) lies in the picture, and every x + D(x) there or where a map that was `set` had looked. Looking at the map
    changes nothing of it.

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
        self._gathered: Level | None = None  # only while another is pending
        self._pending: Level | None = None
        self._tiles = 0  # that are made anew for it
        self._remapping = 0  # how far they are, of `_whole`
        self._frozen = Frozen(device, self.size)
        self._composed: dict[tuple[tuple[int, int], bool], Field] = {}
        self._fresh: set[tuple[tuple[int, int], bool]] = set()  # of these, what holds the present map
        self._steps = 0  # since the last remap
        self._is_settled = True  # the submap leads nowhere where the map is held
        self._limits = self._picture = (0.0, 0.0, *self.extent)  # of the places looked up: left, top, right, bottom
        self.version = 0

    @property
    def grid(self) -> Grid:
        return self._submap.grid

    @property
    def held(self) -> Field | None:
        """Where it is held, texel by texel, from 1/2 on; None if nothing is."""
        return self._frozen.held

    # -- moving it --------------------------------------------------------------------------------------------------

    def follow(self, fluid: Fluid, dt: float) -> None:
        """Carry the map one step by a fluid, along the trace that the fluid's own next step follows too."""
        check_type("what the map is to follow", fluid, Scheme)
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
            # What was gathered on another grid has to be out of the way when the submap on this one is bent.
            waits = self._gathered is not None and self._gathered.grid != self.grid
            self._remapping += self._whole // REMAP_STEPS if waits else REMAP_STEPS
            self._take_in(min(self._remapping / self._whole, 1.0))
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
        check_type("a velocity", velocity, Callable)
        check_type("a time", time)
        x, y = self.grid.centres()
        back_x, back_y = _runge_kutta(velocity, x, y, time + dt, -dt)
        left, top, width, height = window_of(self.grid)
        back = np.stack([np.clip(back_x, left, left + width) - x, np.clip(back_y, top, top + height) - y], axis=-1)
        self._submap.trace.set(back / self.grid.spacing)
        self.advance_traced(self._submap.trace)

    def remap(self) -> None:
        """Let the accumulated map take in all that has moved, at once; the whole map stays what it was."""
        self._begin_remap()
        self._take_in_all()

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
        self._submap.release()
        self._submap = Submap(self.device, grid)
        self._steps = 0
        self._changed()

    def hold(self, frozen: Field | None, changed: Region | None = None) -> None:
        """From now on, change nothing where a mask over the whole picture, of any size, is 1.

        Nor within three texels of the accumulated map around it: what is looked up on a frozen pixel is interpolated
        from there. What the map is there is kept to the bit, however it came about. Within two cells the submap stands
        still, so that what is around goes on from it without a step.

        Args:
            frozen: the mask; None holds nothing.
            changed: (x, y, width, height) in the mask's texels, outside of which it is as it was given before.
        """
        if frozen is None:
            self._frozen.release()
        else:
            self._frozen.hold(frozen, changed or (0, 0, *frozen.size), self._keep)
            self._is_settled &= not self._steps
        self._changed()

    def restore_under(
        self, center: tuple[float, float], radius: float, hardness: float = 0.0, amount: float = 1.0
    ) -> None:
        """Let the map go back to the identity under a round brush, but where it is frozen.

        Args:
            center, radius: longer sides.
            hardness: the part of the radius that is fully under the brush, 0-1; the rest falls off smoothly.
            amount: 0-1, the part of the displacement that is taken away at the centre.
        """
        if not self._is_settled:
            self._begin_remap()  # or what is around the held places would not go on from them
        self._take_in_all()
        restore = self.device.pass_("warp/restore.frag", **self._held_defines())
        inputs: dict[str, Any] = {"center": center, "radius": radius, "hardness": min(hardness, 0.99), "amount": amount}
        still = None
        if self._frozen.held is not None:
            still, window = self._still_under(center, radius)
            inputs |= {"still": still, "still_window": window}
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
        if still is not None:
            still.release()
        self._changed()

    # -- its state --------------------------------------------------------------------------------------------------

    def reset(self) -> None:
        """Back to the identity."""
        self._drop_waiting()
        self._submap.read.clear()
        self._accumulated.clear()
        self._steps = 0
        self._is_settled = True
        self._limits = self._picture
        self._frozen.draw_anew(self._keep)
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
        self._frozen.draw_anew(self._keep)

    def save(self) -> MapState:
        """A copy of this moment, on the GPU, which the caller releases; it shares with others what is the same."""
        fields: dict[str, Field] = {"submap": self._submap.read, "accumulated map": self._accumulated.now}
        values: dict[str, Any] = {"steps": self._steps, "limits": self._limits, "grid": values_of(self.grid)}
        values["settled"] = self._is_settled
        for name, level in (("gathered", self._gathered), ("pending", self._pending)):
            if level is not None:
                fields[name] = level.field
                values |= {SUBMAPS[name]: values_of(level.grid), "remapping": self._remapping}
        state = MapState.of(self.device, fields, **values)
        state.tiles.update(self._frozen.save())
        return state

    def restore(self, state: State) -> None:
        """Go back to a saved state, exactly, and to the grid that it was on.

        Raises:
            ValueError: if it is of another picture.
        """
        check_type("what to go back to", state, State)
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
        self._is_settled = bool(state.values["settled"])
        self._frozen.restore(state.tiles)
        self._drop_waiting()
        self._pending, self._gathered = self._level_in(state, "pending"), self._level_in(state, "gathered")
        if self._pending is not None:
            self._stand_by(self._pending, int(state.values["remapping"]))
        self._changed()

    def release(self) -> None:
        """Free the textures."""
        self._drop_waiting()
        for thing in (self._submap, self._accumulated, self._frozen, *self._composed.values()):
            thing.release()

    # -- reading it -------------------------------------------------------------------------------------------------

    def composed(self, size: tuple[int, int] | None = None, exact: bool = False) -> Field:
        """The whole map's displacement on `size` texels (width, height), by default the accumulated map's.

        Valid until the map changes, and to be looked up between its texels by the cubic; unless `exact`, so is the
        accumulated map for it.
        """
        size = size or self.size
        if size == self.size and self._steps == 0 and self._pending is None and self._frozen.held is None:
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
        if self._frozen.held is not None:
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
        if size is not None and np.shape(size) != (2,):
            raise ValueError(f"a size of {size!r} was given, (width, height) is wanted")
        field = self.device.field(size or self.coarse_size, 2, "warp map, to read")
        self._compose(field)
        displacement = field.get()
        field.release()
        return displacement

    def at(self, points: np.ndarray) -> np.ndarray:
        """The displacement at points (n, 2) of the result, in longer sides: float32 (n, 2)."""
        points = real_array("places", points)
        if points.shape[-1:] != (2,):
            raise ValueError(f"places of shape {points.shape} were given, (n, 2) is wanted")
        return draw_at(self.device, points, self.extent, "warp/compose.frag", self._defines(), **self._parts())

    def determinants(self, points: np.ndarray) -> np.ndarray:
        """det J at points (n, 2) of the result, in longer sides, by the chain rule: float32 (n,)."""
        return draw_at(
            self.device,
            points,
            self.extent,
            "warp/distortion.frag",
            self._held_defines() | _depth(self._levels),
            **self._parts(),
        )[:, 1]

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
        return distortion(self.device, size, self._held_defines() | _depth(self._levels), self._parts())

    # -- its parts --------------------------------------------------------------------------------------------------

    def _begin_remap(self) -> None:
        """Let what has moved stand by to be taken in, and begin with a submap of nothing."""
        if not self._steps:
            return
        if self._gathered is not None and self._gathered.grid != self.grid:
            self._take_in_all()
        elif self._tiles * (1 - self._remapping / self._whole) <= MOST_TILES:
            self._take_in(1.0)  # which is less work than to gather
        self._steps = 0
        self._is_settled = True
        if self._pending is not None:
            self._gather()
        elif self._stand_by(Level(self._submap.read, self.grid)):
            self._submap.replace()

    def _stand_by(self, moved: Level, remapping: int = 0) -> bool:
        """Let a level be taken in from the next step on, or go on with it; False if there is nothing to take in."""
        self._tiles = self._accumulated.begin((moved.field.get(), moved.grid))
        self._remapping = max(0, min(remapping, self._whole - 1))
        self._accumulated.begun = self._remapping / self._whole
        self._pending = moved if self._tiles else None
        return self._tiles > 0

    def _gather(self) -> None:
        """Let the submap go into what is to be taken in after what is pending."""
        (nx, ny), (most, in_all) = self.grid.size, MOST_GATHERED
        times = max(LEAST_TEXELS, min(math.isqrt(in_all // (nx * ny)), most))
        field = self.device.field((times * nx, times * ny), 2, "gathered submap")
        levels = [Level(self._submap.read, self.grid), *([] if self._gathered is None else [self._gathered])]
        compose = self.device.pass_("warp/compose.frag", GATHER=1, **_depth(levels))
        left, top, width, height = window_of(self.grid)
        step = width / field.width, height / field.height
        origin = left / step[0], top / step[1]
        compose(field, **self._parts_of(levels), origin=origin, step=np.divide(step, self.extent).tolist())
        self._submap.read.clear()
        if self._gathered is not None:
            self._gathered.field.release()
        self._gathered = Level(field, self.grid)

    def _take_in(self, part: float) -> None:
        """Come to a `part`, 0-1, of what the pending level wants."""
        if self._pending is None:
            return
        self._draw_anew([self._pending], part)
        if part >= 1:
            gathered, self._gathered = self._gathered, None
            self._drop_waiting()
            if gathered is not None and not self._stand_by(gathered):
                gathered.field.release()

    def _take_in_all(self) -> None:
        """Let the accumulated map take in all levels but the submap, at once."""
        if self._gathered is None:
            self._take_in(1.0)
        else:
            self._accumulated.begin(*((level.field.get(), level.grid) for level in self._waiting))
            self._draw_anew(self._waiting, 1.0)
            self._drop_waiting()

    def _draw_anew(self, levels: list[Level], part: float) -> None:
        fine = {"CUBIC": 1} if all(self._accumulated.is_fine(level.grid) for level in levels) else {}
        # Also where the map is held: places beside that may look into it, and once it is thawed it goes on from there.
        compose = self.device.pass_("warp/compose.frag", REMAP=1, **fine, **_depth(levels))
        inputs = self._parts_of(levels)
        self._accumulated.draw(part, lambda target, regions: compose(target, region=regions, **inputs))

    def _drop_waiting(self) -> None:
        for level in self._waiting:
            level.field.release()
        self._gathered = self._pending = None

    def _level_in(self, state: State, name: str) -> Level | None:
        """A copy of a level that a state holds."""
        if (saved := state.fields.get(name)) is None:
            return None
        field = self.device.field(saved.size, 2, f"{name} submap")
        field.copy_from(saved)
        return Level(field, grid_in(state.values, SUBMAPS[name]))

    def _keep(self, target: Field, regions: list[Region], now: Field, corner: tuple[int, int], before: Field) -> None:
        """Draw the map where it is held now and was not before; see `Frozen`."""
        fine = {"CUBIC": 1} if self._accumulated.is_fine(self.grid) else {}
        compose = self.device.pass_("warp/compose.frag", REMAP=1, KEEP=1, **fine, **_depth(self._levels))
        compose(target, region=regions, now=now, before=before, corner=corner, **self._parts())

    def _still_under(
        self, center: tuple[float, float], radius: float
    ) -> tuple[Field, tuple[float, float, float, float]]:
        """Cells, the submap's or larger, under a brush and around it, about what is held, and their window."""
        sides, counts = [], []
        for at, step, side in zip(center, self.grid.spacing, self.extent, strict=True):
            step = max(step, radius / 32)
            start, end = max(at - radius - 2 * step, 0.0), min(at + radius + 2 * step, side)
            counts.append(max(math.ceil((end - start) / step), 1))
            sides.append((start, end - start))
        window = sides[0][0], sides[1][0], sides[0][1], sides[1][1]
        still = self.device.field((counts[0], counts[1]), 1, "still under a brush", "f1")
        self._frozen.widen(still, window, self.extent)
        return still, window

    def _compose(self, target: Field, **defines: object) -> None:
        compose = self.device.pass_("warp/compose.frag", **self._defines() | defines)
        compose(target, **self._parts(), origin=(0.0, 0.0), step=target.texel)

    @property
    def _whole(self) -> int:
        """`REMAP_STEPS` times the steps that the pending level is taken in over, if nothing waits."""
        return REMAP_STEPS * max(REMAP_STEPS, math.ceil(self._tiles / MOST_TILES))

    @property
    def _waiting(self) -> list[Level]:
        """What stands between the submap and the accumulated map."""
        return [level for level in (self._gathered, self._pending) if level is not None]

    @property
    def _levels(self) -> list[Level]:
        """All above the accumulated map."""
        return [Level(self._submap.read, self.grid), *self._waiting]

    def _defines(self) -> dict[str, object]:
        """How the whole map is put together."""
        fine: dict[str, object] = {"CUBIC": 1} if self._accumulated.is_fine(self.grid) else {}
        return fine | self._held_defines() | _depth(self._levels)

    def _held_defines(self) -> dict[str, object]:
        return {} if self._frozen.held is None else {"HELD": 1}

    def _parts(self) -> dict[str, Any]:
        """What `lib/warp.glsl` puts together."""
        return self._parts_of(self._levels)

    def _parts_of(self, levels: list[Level]) -> dict[str, Any]:
        parts: dict[str, Any] = {"accumulated": self._accumulated.now, "picture": self.extent, "limits": self._limits}
        for (name, window), level in zip(NAMES, levels, strict=False):
            parts |= {name: level.field, window: window_of(level.grid)}
        return parts if self._frozen.held is None else parts | {"held": self._frozen.held, "kept": self._frozen.kept}

    def _changed(self) -> None:
        self.version += 1
        self._fresh.clear()


def _depth(levels: list[Level]) -> dict[str, object]:
    return {"LEVELS": len(levels)} if len(levels) > 1 else {}


def _runge_kutta(
    velocity: Velocity, x: np.ndarray, y: np.ndarray, time: float, dt: float
) -> tuple[np.ndarray, np.ndarray]:
    """Where points are carried in `dt` by a velocity: the classical fourth-order step."""
    u1, v1 = velocity(x, y, time)
    u2, v2 = velocity(x + dt / 2 * u1, y + dt / 2 * v1, time + dt / 2)
    u3, v3 = velocity(x + dt / 2 * u2, y + dt / 2 * v2, time + dt / 2)
    u4, v4 = velocity(x + dt * u3, y + dt * v3, time + dt)
    return x + dt / 6 * (u1 + 2 * u2 + 2 * u3 + u4), y + dt / 6 * (v1 + 2 * v2 + 2 * v3 + v4)

"""The warp map: where every point of the result is looked up in the original.

The class is long because everything that moves or reads the map needs all its levels; the work is in the other modules
of this folder.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from numbers import Integral
from typing import Any

import numpy as np

from solver.faces import Vector, check_field, on_faces
from solver.fluid import Fluid
from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.images import for_images
from solver.gl.passes import Region
from solver.gl.points import draw_at, drawn_at
from solver.grid import Grid
from solver.limits import check_finite, check_size, check_step, check_type, numbers, places, real_array
from solver.params import Walls
from solver.state import State
from solver.trace import MOST_PARTS, Tracing
from solver.warp.accumulated import LEAST_TEXELS, AccumulatedMap
from solver.warp.distortion import MOST_PLACES, MapStatistics, distortion
from solver.warp.factors import Factors
from solver.warp.frozen import Frozen
from solver.warp.prescribed import traced
from solver.warp.remapping import Remapping
from solver.warp.state import (
    ACCUMULATED,
    EDGES,
    FACTOR,
    OPEN,
    REGIONS,
    SIZES,
    SUBMAPS,
    Images,
    MapState,
    chain_images_in,
    closed_in,
    grid_in,
    images_in,
    regions_in,
    values_of,
)
from solver.warp.submap import STEEPEST, Level, Submap, away_from_held, defines_of, images_of, inputs_of, window_of

CHECK_EVERY = 2  # steps between two looks at how far the map is bent: a quick push bends it by 1 in two


class WarpMap:
    """The map x -> x + D(x) from the result to the original, carried along by a fluid without blurring.

    Two levels (the characteristic mapping method): the submap S holds what has moved lately, on the simulation's grid,
    which may be a window of the picture; the accumulated map A of the whole picture takes S in (a remap) before S is
    bent so far that interpolating it every step would show. D(x) = S(x) + A(x + S(x)), S = 0 outside the window. Before
    A gets too steep for its texels it is closed, and another begins before it. Longer sides, RG32F at the centres of
    cells and texels. Only tiles of A that have moved are redrawn, a few in each step. Until all are done, the submap
    being taken in, *pending*, stands between S and A; what has to be remapped meanwhile is *gathered* in a level
    between S and the pending one. Every place x + S(x) lies in the picture, and every x + D(x) there or where a map
    that was `set` had looked. Reading the map changes nothing in it.

    Args:
        device: the device.
        grid: the simulation's grid.
        size: (width, height) of the accumulated map in texels, see `map_size`; by default `LEAST_TEXELS` a cell.
        remap_every: the most steps between two remaps.

    Attributes:
        grid: of the submap.
        extent: (width, height) of the picture, the longer of them 1.
        version: counts the changes, for callers that cache what they made of the map.
        leads: counts the changes of where it leads.
        factors: what it is made of, without the submap, for `ScaledMap`.
    """

    def __init__(self, device: Device, grid: Grid, size: tuple[int, int] | None = None, remap_every: int = 64) -> None:
        check_type("what a map lives in", device, Device)
        check_type("the cells of a map", grid, Grid)
        self.device = device
        self.extent = grid.picture
        self.remap_every = remap_every
        self._submap = Submap(device, grid)
        across, down = self.coarse_size
        sides = numbers("the size of a map", size or (LEAST_TEXELS * across, LEAST_TEXELS * down), 2)
        if not all(side >= 6 and side % 1 == 0 for side in sides):
            raise ValueError(f"a map of {size} texels was asked for; whole numbers from 6 are wanted")
        self.size = int(sides[0]), int(sides[1])
        if not (isinstance(remap_every, Integral) and remap_every >= 1):
            raise ValueError(f"{remap_every!r} steps between remaps were asked for; a whole number from 1 is wanted")
        self._accumulated = AccumulatedMap(device, self.size, self.extent)
        self._frozen = Frozen(device, self.size)
        self._remapping = Remapping(device, self._accumulated, self._frozen)
        self.factors = Factors(device, Grid(across, down, self.extent))
        self._composed: dict[tuple[tuple[int, int], bool], Field] = {}
        self._fresh: set[tuple[tuple[int, int], bool]] = set()  # of these, what holds the present map
        self._steps = 0  # since the last remap
        self._is_settled = True  # the submap began with what is held now
        self.version = self.leads = 0

    @property
    def grid(self) -> Grid:
        return self._submap.grid

    @property
    def submap(self) -> Level:
        """What has moved since the last remap."""
        return self._submap.level(self._is_weighed)

    @property
    def held(self) -> Field | None:
        """Where it is held: texels of 1/2 and more; None if it is held nowhere."""
        return self._frozen.held

    @property
    def edges(self) -> Images:
        """What lies beyond the picture's edges; see `lib/displacement.glsl`."""
        return self._accumulated.edges

    @property
    def is_untouched(self) -> bool:
        """True if it has been the identity from its beginning."""
        return self.version == 0

    # -- moving it --------------------------------------------------------------------------------------------------

    def follow(self, fluid: Fluid, dt: float) -> None:
        """Carry the map `dt` seconds by a fluid, along the trace that the fluid's own next step follows too.

        In parts, if the submap would be bent too far in one, so that each may end with a remap.
        """
        check_type("what the map is to follow", fluid, Fluid)
        if fluid.grid != self.grid:
            raise ValueError(f"a map on {self.grid} cannot follow a fluid on {fluid.grid}; `move_to` takes it there")
        strain = fluid.strain(check_step(dt))
        parts = math.ceil(min(strain / STEEPEST, MOST_PARTS)) if strain > STEEPEST else 1
        for _ in range(parts):
            self._advance(fluid.begin_trace(dt / parts) or fluid.trace(dt / parts), fluid.params.walls, parts > 1)

    def advance(self, velocity: Field, dt: float) -> None:
        """Carry the map one step by a velocity on the MAC grid, constant over the step: second-order backtrace."""
        check_field("a velocity", velocity, self.grid)
        hx, hy = self.grid.spacing
        dt = check_step(dt)
        trace = self._submap.trace
        self.device.pass_("step/trace.frag")(trace, velocity=velocity, cells_a_speed=(dt / hx, dt / hy))
        self.advance_traced(trace)

    def advance_traced(self, trace: Field) -> None:
        """Carry the map one step by a trace: x_departed - x at every cell centre, in cells."""
        check_field("a trace", trace, self.grid)
        self._advance(trace)

    def _advance(self, trace: Field | Tracing, walls: Walls | None = None, looks: bool = False) -> None:
        """Make a step between walls, and go on with a remap, or begin one if it is time: `looks` at once whether."""
        images = images_of(walls or Walls(), self.grid)
        if images != self._submap.images:
            self._begin_remap()
            self._submap.images = images
        self._submap.advance(trace, self._accumulated.is_walled)
        self._steps += 1
        self._changed()
        self._remapping.advance(self.grid)
        # Reading the steepness waits for the GPU, so not at every step; at fixed ones, so that a replay remaps alike.
        looks = looks or self._steps % CHECK_EVERY == 0
        if self._steps >= self.remap_every or (looks and (not self._is_settled or self._submap.is_steep)):
            self._begin_remap()

    def advance_prescribed(self, velocity: Vector, dt: float, time: float = 0.0) -> None:
        """Carry the map from `time` to `time + dt` by a velocity that is given.

        Args:
            velocity: a function (x, y, t) -> (u, v) on float64 arrays, lengths per second, followed back by a
                fourth-order Runge-Kutta step of its own exact values; or an array (ny, nx, 2) on the MAC grid.
                What would come from beyond the grid's edge comes from the edge.
            dt: the step.
            time: where it begins, for the function.

        Raises:
            ValueError: on an array of another shape, a value that is not finite or too large, or a step or a
                time that is none.
        """
        dt = check_step(dt)
        check_finite("a time", time)
        if callable(velocity):
            self._submap.trace.set(traced(velocity, self.grid, dt, time))
            self._accumulated.is_walled = False  # it may cross the edges
            self.advance_traced(self._submap.trace)
        else:
            faces = on_faces("a velocity", velocity, self.grid)
            check_size("a velocity", faces)
            field = self.device.upload(faces, "prescribed velocity")
            self.advance(field, dt)
            field.release()

    def remap(self) -> None:
        """Take all that has moved into the accumulated map at once; the whole map stays the same."""
        self._remapping.finish()  # or what has moved would be gathered, and resampled once more
        self._begin_remap()
        self._remapping.finish()

    def move_to(self, grid: Grid) -> None:
        """Go on with a submap on another grid of the same picture; the map stays the same.

        Raises:
            ValueError: if it is a grid of another picture.
        """
        check_type("what the map moves to", grid, Grid)
        if grid == self.grid:
            return
        if grid.picture != self.extent:
            raise ValueError(f"a map of a picture of {self.extent} cannot go on in one of {grid.picture}")
        self._begin_remap()
        self._submap.release()
        self._submap = Submap(self.device, grid)
        self._steps = 0
        leads = self.leads
        self._changed()
        self.leads = leads

    def hold(self, frozen: Field | None, changed: Region | None = None) -> None:
        """From now on, change nothing where a mask over the whole picture, of any size, is 1.

        Nor within three texels of the accumulated map around it, from which a frozen pixel is interpolated. The map
        there is kept to the bit. Over the last cell before it the motion falls to zero, so that the map has no step.

        Args:
            frozen: the mask; None holds nothing.
            changed: (x, y, width, height) in the mask's texels; outside of it the mask is the same as last time.
        """
        if frozen is not None:
            check_type("what is frozen", frozen, Field)
        if self._frozen.held is not None and self._is_settled:
            self._begin_remap()
        self._is_settled = not self._steps
        self._remapping.settle()
        if frozen is None:
            self._frozen.release()
        else:
            # The identity is what fields begin with: nothing is drawn into them, and saves of them take no memory.
            draw = (lambda *_: None) if self.is_untouched else self.draw_held
            self._frozen.hold(frozen, changed or (0, 0, *frozen.size), draw)
        self._changed()

    def restore_under(
        self, center: tuple[float, float], radius: float, hardness: float = 0.0, amount: float = 1.0
    ) -> None:
        """Bring the map back to the identity under a round brush, except where it is frozen.

        Args:
            center, radius: longer sides.
            hardness: the part of the radius that is fully under the brush, 0-1; the rest falls off smoothly.
            amount: 0-1, the part of the displacement that is taken away at the centre.

        Raises:
            ValueError: if a number is not finite, too large, or outside these limits.
        """
        x, y = numbers("a brush's centre", center, 2)
        center = x, y  # also of a list or an array
        numbers("a brush", (radius, hardness, amount), 3)
        if radius <= 0:
            raise ValueError(f"a brush of radius {radius:g} was given; it must be above 0")
        for what, part in (("hardness", hardness), ("amount", amount)):
            if not 0 <= part <= 1:
                raise ValueError(f"a brush of {what} {part:g} was to restore; it must be from 0 to 1")
        if not self._is_settled:
            self._begin_remap()  # or there would be a step around the held places
        self._remapping.finish()
        held = {} if self._frozen.held is None else {"HELD": 1}
        restore = self.device.pass_("warp/restore.frag", **held)
        inputs: dict[str, Any] = {"center": center, "radius": radius, "hardness": min(hardness, 0.99), "amount": amount}
        still = None
        if self._frozen.held is not None:
            still, window = self._still_under(center, radius)
            inputs |= {"still": still, "still_window": window}
        submap, accumulated = self._submap, self._accumulated
        restore(submap.write, displacement=submap.read, window=window_of(self.grid), **inputs)
        submap.swap()
        window = 0.0, 0.0, *self.extent
        sides = zip(center, self.size, self.extent, strict=True)
        (left, right), (top, bottom) = (
            (max(math.floor((at - radius) / side * n), 0), min(math.ceil((at + radius) / side * n), n))
            for at, n, side in sides
        )
        if right > left and bottom > top:

            def draw(target: Field, regions: list[Region], /, **undone: Any) -> None:
                takes = self.device.pass_("warp/restore.frag", **held, **({"UNDONE": 1} if undone else {}))
                takes(target, region=regions, displacement=accumulated.now, window=window, **undone, **inputs)

            edge = radius * (1 - inputs["hardness"])
            accumulated.undo((left, top, right - left, bottom - top), draw, edge)
        self.factors.change(lambda target, factor: restore(target, displacement=factor, window=window, **inputs))
        if still is not None:
            still.release()
        self._changed()

    # -- its state --------------------------------------------------------------------------------------------------

    def reset(self) -> None:
        """Back to the identity."""
        self._remapping.drop()
        self._submap.read.clear()
        self._submap.changed()
        self._accumulated.clear()
        self.factors.clear()
        self._steps = 0
        self._is_settled = True
        self._frozen.draw_anew(self.draw_held)
        self._changed()

    def close(self) -> None:
        """Go on with an accumulated map of nothing above the one so far, as a remap does when that becomes too steep.

        Every place leads where it has led. Nothing happens if as many maps are closed as may be.
        """
        self._remapping.finish()
        if self._accumulated.may_close:
            self._accumulated.close()
            self._changed()

    def set(self, displacement: np.ndarray) -> None:
        """Take over a displacement (h, w, 2) in longer sides, of any size from 6 x 6, laid over the whole domain.

        Raises:
            ValueError: on another shape, also one that is upright for a picture that is not, or a value that is not
                finite or too large.
        """
        displacement = real_array("a map", displacement)
        if displacement.ndim != 3 or displacement.shape[2] != 2 or min(displacement.shape[:2]) < 6:
            raise ValueError(f"a map of shape {displacement.shape} was given, (h, w, 2) from 6 x 6 is wanted")
        check_size("a map", displacement)
        (rows, columns), (width, height) = displacement.shape[:2], self.extent
        if (columns - rows) * (width - height) < 0:
            raise ValueError(
                f"a map of {columns} x {rows} was given for a picture of {width:.4g} x {height:.4g}: is it transposed?"
            )
        given = self.device.upload(displacement, "given map")
        self.reset()
        resample = self.device.pass_("warp/resample.frag")
        x, y = (np.arange(columns) + 0.5) / columns * width, (np.arange(rows) + 0.5) / rows * height
        across, down = x + displacement[..., 0], y[:, None] + displacement[..., 1]
        # Each of them in float32, as the shaders take them.
        lowest, highest = np.minimum(0, [across.min(), down.min()]), [across.max(), down.max()]
        self._accumulated.set(
            lambda target: resample(target, displacement=given, images=OPEN, origin=(0.0, 0.0), step=target.texel),
            (*lowest.tolist(), *np.maximum(self.extent, highest).tolist()),
        )
        self.factors.begin_with(
            lambda target: resample(target, displacement=given, images=OPEN, origin=(0.0, 0.0), step=target.texel)
        )
        given.release()
        self._frozen.draw_anew(self.draw_held)

    def save(self) -> MapState:
        """A copy of this moment, on the GPU, which the caller releases; states share tiles that are the same."""
        fields: dict[str, Field] = {"submap": self._submap.read, **self._accumulated.saved()}
        accumulated = self._accumulated
        values: dict[str, Any] = {"steps": self._steps, "limits": accumulated.limits, "walled": accumulated.is_walled}
        values[f"{ACCUMULATED} images"] = accumulated.images
        values["finest"] = accumulated.finest
        if accumulated.chain:
            values[SIZES] = [closed.field.size for closed in accumulated.chain]
            values[REGIONS] = [closed.region for closed in accumulated.chain]
            values[EDGES] = [closed.images for closed in accumulated.chain]
        values |= {"grid": values_of(self.grid), "settled": self._is_settled, "submap images": self._submap.images}
        fields |= self.factors.save()
        for name, level in self._remapping.saved():
            fields[name] = level.field
            values |= {SUBMAPS[name]: values_of(level.grid), f"{name} images": level.images}
            values["remapping"] = self._remapping.progress
            values["weighed"] = self._remapping.is_weighed
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
        tiles = state.tiles.get(ACCUMULATED)
        if grid.picture != self.extent or tiles is None or tiles.kind != self._accumulated.now.kind:
            raise ValueError("the state is of another picture")
        images = {name: images_in(state.values, name) for name in (*SUBMAPS, ACCUMULATED)}
        left, top, right, bottom = state.values["limits"].tolist()
        is_walled = bool(state.values.get("walled", True))
        finest = float(state.values.get("finest", 0.0))
        count, size = len(closed_in(state.tiles)), self._accumulated.size
        closed = list(zip(regions_in(state.values, count, size), chain_images_in(state.values, count), strict=True))
        mine = images[ACCUMULATED]
        self._accumulated.restore(state.tiles, closed, (left, top, right, bottom), is_walled, mine, finest)
        if grid != self.grid:
            self._submap.release()
            self._submap = Submap(self.device, grid)
        self._submap.read.copy_from(state.fields["submap"])
        self._submap.changed()
        self._submap.images = images["submap"]
        self._steps = int(state.values["steps"])
        self._is_settled = bool(state.values["settled"])
        self._frozen.restore(state.tiles)
        is_weighed = bool(state.values.get("weighed", False))
        waiting = {
            name: Level(
                state.fields[name], grid_in(state.values, place), name == "pending" and is_weighed, images[name]
            )
            for name, place in SUBMAPS.items()
            if name != "submap" and name in state.fields
        }
        self._remapping.restore(waiting, int(state.values.get("remapping", 0)))
        self.factors.restore({name: field for name, field in state.fields.items() if name.startswith(FACTOR)})
        self._changed()

    def release(self) -> None:
        """Free the textures."""
        self._remapping.drop()
        for thing in (self._submap, self._accumulated, self._frozen, self.factors, *self._composed.values()):
            thing.release()

    # -- reading it -------------------------------------------------------------------------------------------------

    @property
    def at_rest(self) -> Field | None:
        """The accumulated map, as long as that is all of the map; else None."""
        is_alone = self._steps == 0 and self._remapping.is_idle and not self._accumulated.closed
        return self._accumulated.now if is_alone and self._frozen.held is None else None

    def composed(self, size: tuple[int, int] | None = None, exact: bool = False) -> Field:
        """The whole map's displacement on `size` texels (width, height), by default the accumulated map's.

        Valid until the map changes, and to be looked up between its texels by the cubic; unless `exact`, so is the
        accumulated map for it.
        """
        size = self.size if size is None else size
        if size == self.size and (known := self.at_rest) is not None:
            return known
        key = size, exact
        if key not in self._composed:
            self._composed[key] = Field(self.device, size, 2, f"warp map at {size[0]} x {size[1]}", cleared=False)
        if key not in self._fresh:
            field = self._composed[key]
            self._compose(field, (0.0, 0.0), field.texel, **({} if exact else {"CUBIC": 1}))
            self._fresh.add(key)
        return self._composed[key]

    def size_for(self, picture: tuple[int, int], result: tuple[int, int]) -> tuple[int, int]:
        """Texels to compose for a result of a picture, both in pixels: not finer than needed.

        The accumulated map's, or one for a whole number of them: along each side no fewer than the result's pixels, or
        than the larger of the picture's pixels and two a cell. If something is frozen it is the accumulated map's, as
        interpolation between coarser texels would reach beyond what is held.
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

    def bounded(self, size: tuple[int, int]) -> tuple[int, int]:
        """The size of a lattice, or of one with a place for a whole number of its places: at most `MOST_PLACES`."""
        width, height = size
        stride = max(
            math.ceil(math.sqrt(width * height / MOST_PLACES)),
            math.ceil(max(size) / self.device.limits.max_texture_size),
        )
        return -(-width // stride), -(-height // stride)

    def read(self, size: tuple[int, int] | None = None) -> np.ndarray:
        """The displacement at the pixel centres of a picture of `size` (width, height), by default `coarse_size`.

        Returns:
            float32 (height, width, 2), longer sides.
        """
        field = self.device.field(self.coarse_size if size is None else size, 2, "warp map, to read")
        self._compose(field, (0.0, 0.0), field.texel)
        displacement = field.get()
        field.release()
        return displacement

    def at(self, points: np.ndarray) -> np.ndarray:
        """The displacement at points (n, 2) of the result, in longer sides: float32 (n, 2)."""
        shader, defines = "warp/compose.frag", self._defines()
        return draw_at(self.device, places(points), self.extent, shader, defines, **self._parts())

    def seek(self, points: np.ndarray, guesses: np.ndarray, farthest: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where points (n, 2) of the original are, by Newton's method from guesses (n, 2), in longer sides.

        Args:
            farthest: the longest step of one round, (n,).

        Returns:
            The best places found, float64 (n, 2); and how far from the points these are looked up, (n,).
        """
        more = np.column_stack([guesses - points, farthest, np.zeros(len(points))])
        shader, defines = "warp/seek.frag", self._defines()
        found = draw_at(self.device, guesses, self.extent, shader, defines, components=4, more=more, **self._parts())
        return guesses + found[:, :2].astype(np.float64), found[:, 2].astype(np.float64)

    def determinants(self, points: np.ndarray) -> np.ndarray:
        """det J at points (n, 2) of the result, in longer sides, by the chain rule: float32 (n,)."""
        shader, defines = "warp/distortion.frag", self._held_defines()
        return draw_at(self.device, places(points), self.extent, shader, defines, **self._parts())[:, 1]

    def strain(self, points: np.ndarray) -> Callable[[], np.ndarray]:
        """Displacement and strain close to points (n, 2), in longer sides, by `warp/strain.frag`; see `drawn_at`.

        Reads back float32 (n, 4).
        """
        shader, defines = "warp/strain.frag", self._held_defines()
        return drawn_at(self.device, places(points), self.extent, shader, defines, components=4, **self._parts())

    def draw_strain(
        self,
        target: Field,
        region: Region,
        corner: tuple[int, int] = (0, 0),
        count: tuple[int, int] | None = None,
    ) -> None:
        """Draw the same into a region of a field over the picture, or over a lattice of `count` from `corner` on."""
        strain = self.device.pass_("warp/strain.frag", **self._held_defines())
        across, down = count or target.size
        strain(target, region=region, **self._parts(), origin=corner, step=(1 / across, 1 / down))

    def draw(
        self,
        target: Field,
        origin: tuple[float, float],
        step: tuple[float, float],
        exact: bool = False,
        moved: Field | None = None,
        coarsely: bool = False,
        regions: list[Region] | None = None,
    ) -> None:
        """Draw the displacement at (fragment + origin) step, 0-1 of the picture.

        Args:
            exact: the target will not be interpolated.
            moved: another displacement of `target`'s size that is applied first.
            coarsely: linear interpolation of the accumulated map is enough, as for `target`.
            regions: of `target`, where it is drawn; by default everywhere.
        """
        # Its own texels must not be farther apart than those of the target.
        linear = coarsely and all(side * n >= 1.0 for side, n in zip(step, self.size, strict=True))
        cubic = {} if exact else {"LINEAR": 1} if linear else {"CUBIC": 1}
        if moved is None:
            self._compose(target, origin, step, regions, **cubic)
        else:
            compose = self.device.pass_("warp/compose.frag", FROM=1, **self._defines() | cubic)
            inputs: dict[str, Any] = self._parts() | {"from": moved}
            compose(target, region=regions, **inputs, origin=origin, step=step)

    def draw_held(
        self, target: Field, regions: list[Region], now: Field, corner: tuple[int, int], before: Field
    ) -> None:
        """Draw the map where it is held now and was not before; see `Frozen`."""
        fine = {"CUBIC": 1} if self._accumulated.is_fine(self.grid) else {}
        defines = fine | defines_of(self._levels) | self._accumulated.defines
        compose = self.device.pass_("warp/compose.frag", REMAP=1, KEEP=1, **defines)
        compose(target, region=regions, now=now, before=before, corner=corner, **self._parts())

    def probe(self, target: Field, places: list[tuple[float, float]], step: tuple[float, float]) -> None:
        """Draw the displacement on a square lattice around each of some places, one below the other.

        Args:
            target: as wide as a lattice, with room for `MOST_IMAGES` of them.
            places: their middles, 0-1 of the picture.
            step: how far apart the texels are, 0-1 of the picture.
        """
        side = target.width
        origins = [(x / step[0] - side / 2, y / step[1] - side / 2) for x, y in places]
        compose = self.device.pass_("warp/compose.frag", LATTICES=side, **self._defines())
        region = 0, 0, side, len(places) * side
        compose(target, region=region, **self._parts(), origins=for_images(origins), step=step)

    def statistics(self, size: tuple[int, int] | None = None, amount: float = 1.0) -> MapStatistics:
        """How the whole map distorts, measured on a lattice of `size`; waits for the GPU.

        By default it has a place for each texel of the accumulated map, and is `bounded`. `amount`: of the map, scaled
        as one displacement; see `ScaledMap`.
        """
        size = size or self.bounded(self.size)
        defines, parts = self._held_defines(), self._parts()
        if amount != 1:
            defines, parts = defines | {"PART": 1}, parts | {"amount": amount}
        return distortion(self.device, size, defines, parts)

    # -- its parts --------------------------------------------------------------------------------------------------

    def _begin_remap(self) -> None:
        """Hand what has moved to the remapping, and begin with an empty submap."""
        if self._steps:
            self.factors.take(self.submap, self.held, self.edges)
            self._remapping.give(self._submap, self._is_weighed)
            self._steps = 0
            self._is_settled = True

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

    def _compose(
        self,
        target: Field,
        origin: tuple[float, float],
        step: tuple[float, float],
        regions: list[Region] | None = None,
        /,
        **defines: object,
    ) -> None:
        for is_near, parts in self._frozen.parts(regions or [(0, 0, *target.size)], origin, step):
            compose = self.device.pass_("warp/compose.frag", **self._defines(is_near) | defines)
            compose(target, region=parts, **self._parts(), origin=origin, step=step)

    @property
    def _levels(self) -> list[Level]:
        """All above the accumulated map."""
        return [self.submap, *self._remapping.levels]

    @property
    def _is_weighed(self) -> bool:
        """Whether the submap is."""
        return self._is_settled and self._frozen.held is not None

    def _defines(self, is_near: bool = True) -> dict[str, object]:
        """How the whole map is put together, where something is held near or not: see `Frozen.parts`."""
        fine: dict[str, object] = {"CUBIC": 1} if self._accumulated.is_fine(self.grid) else {}
        if is_near:
            return fine | self._held_defines()
        return fine | defines_of(away_from_held(self._levels)) | self._accumulated.defines

    def _held_defines(self) -> dict[str, object]:
        held = {} if self._frozen.held is None else {"HELD": 1}
        return defines_of(self._levels) | self._accumulated.defines | held

    def _parts(self) -> dict[str, Any]:
        """What `lib/warp.glsl` puts together."""
        return self._accumulated.inputs() | inputs_of(self.device, self._levels, self.edges, self._frozen.inputs())

    def _changed(self) -> None:
        self.version += 1
        self.leads += 1
        self._fresh.clear()

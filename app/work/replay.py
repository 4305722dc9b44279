"""Driving the solver by a recipe: the one way to a warp, for the window and for the command line.

One long class: a step, and going back by a checkpoint, need all parts of the simulation.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache
from math import ceil, hypot
from typing import Any

import numpy as np

from app.errors import UserError
from app.media.auxiliary import Pictures
from app.model.forces import BuiltForce, build
from app.model.handles import RecipeHandle, RecipePin, labelled, objections
from app.model.mask_edits import ClearMask, MaskStroke, edited, remaining
from app.model.masks import solid, viscosity
from app.model.recipe import FluidSettings, Recipe
from app.model.sampling import FINEST, SmallPictures, channels
from app.model.strokes import FINEST_DETAIL, Act, BrushPath, Change, Dab
from app.model.timelaws import Feedback, Law
from app.model.timeline import Observation, Sentinel
from app.model.windows import FLOWING, Window, may_have_windows
from app.work.checkpoints import DEFAULT_BUDGET, Checkpoint, Checkpoints, Moment
from solver.brush.brush import Brush, Motion
from solver.brush.handle import Handle
from solver.brush.handles import Handles
from solver.brush.masks import Masks
from solver.brush.push import Push, coasting, gain_compensation, slip_factor, strain_limit
from solver.brush.tip import Tip
from solver.brush.twirl import Twirl
from solver.fluid import Fluid
from solver.gl.device import Device
from solver.gl.field import Field
from solver.grid import SMALLEST_GRID, Grid
from solver.paper import PaperFluid, PaperWarpMap
from solver.params import FluidParams, Walls
from solver.state import State
from solver.warp.accumulated import map_size
from solver.warp.density import Density
from solver.warp.map import WarpMap
from solver.warp.scaled import ScaledMap

CHECKPOINT_EVERY = 16  # ticks
FINER = 3  # times finer than the simulation's grid a point is sought

# What a tool of strength 1 does under a brush at full pressure.
TWIRL = 4.0  # radians per second
GROWTH = 2.0  # of area, per second
BLOW = 0.5  # longer sides per second along a curve
THICKENING = 4.0  # decades of viscosity per second
RESTORING = 6.0  # per second, the part of the displacement that is taken away

# What a force may do within a tick, and the map still follow: in longer sides, and in e-folds of area.
FARTHEST = 2.0
WIDEST = 3.0

SOLVERS = {"mac": (Fluid, WarpMap), "paper": (PaperFluid, PaperWarpMap)}


@dataclass(frozen=True)
class LoadedForce:
    """A force on the GPU, and the largest values in its fields."""

    label: str
    law: Law
    faces: Field | None
    divergence: Field | None
    motion: Field | None
    strongest: float
    widest: float
    fastest: float

    @classmethod
    def of(cls, device: Device, force: BuiltForce) -> LoadedForce:
        arrays = force.faces, force.divergence, force.motion
        faces, divergence, motion = (None if a is None else device.upload(a, force.label) for a in arrays)
        strongest, widest, fastest = (0.0 if a is None else float(np.abs(a).max()) for a in arrays)
        return cls(force.label, force.law, faces, divergence, motion, strongest, widest, fastest)

    def acts_within(self, start: float, end: float) -> bool:
        """True if it is at work between two times, in seconds; one that is fed back always may be."""
        return isinstance(self.law, Feedback) or self.law.impulse(start, end) != 0

    def check(self, impulse: float, dt: float, time: float) -> None:
        """Make sure that the force is one that a step can follow.

        Raises:
            UserError: if it throws the fluid farther than the picture, or swells it out of all measure, within a tick.
        """
        mend = "make its 'strength' or 'fluid.dt' smaller"
        if (thrown := (self.strongest * dt + self.fastest) * abs(impulse)) > FARTHEST:
            raise UserError(
                f"{self.label}: at t = {time:.3g} s it throws the fluid {thrown:.3g} times the picture's size within "
                f"one tick; {mend}"
            )
        if (swollen := self.widest * abs(impulse)) > WIDEST:
            grown = f"makes areas e^{swollen:.3g} times as large within one tick"
            raise UserError(f"{self.label}: at t = {time:.3g} s it {grown}; {mend}")


class Replay:
    """A recipe's simulation at a tick, which can go to any other tick.

    The state at a tick depends on nothing but the recipe: going there from the start, from a checkpoint or by way of
    later ticks gives the same bytes.

    Args:
        device: where it is simulated.
        recipe: what is simulated.
        pictures: the source and the auxiliary pictures by name.
        budget: bytes of texture memory for checkpoints.

    Attributes:
        tick: the steps made so far. What is done to masks at this tick in no time is done; strokes and changes at it
            come next.
        grid: of the whole picture.
        small_pictures: its pictures as edits of masks look at them.
        window: where the flow is solved on finer cells instead, None if nowhere; `fluid.grid` are its cells.
        fluid, warp, masks, density: the simulation at this moment; `density` only in density mode.
        forces: the recipe's own.
        handles: the recipe's pins and handles, those that are in the picture.
        steps: made in all, whichever way; for measuring.
    """

    def __init__(self, device: Device, recipe: Recipe, pictures: Pictures, budget: int = DEFAULT_BUDGET) -> None:
        self.device = device
        self.recipe = recipe
        self.pictures = pictures
        self.small_pictures = SmallPictures(pictures)
        self.tick = self.steps = 0
        self.checkpoints = Checkpoints(budget)
        self._brush = Brush(device)
        self._passing: Moment | None = None
        self._leading: list[Motion] = []
        self._motions: list[tuple[Field, float]] = []  # of forces, and their part in this tick
        self._build()

    # -- going through time -----------------------------------------------------------------------------------------

    def advance(self) -> None:
        """Make one step: everything that the recipe has at this tick.

        Raises:
            UserError: if the map could not follow a force; it is then at some moment before.
        """
        self._leave_passing()
        if self.tick % CHECKPOINT_EVERY == 0 or self._begins_here():
            self.checkpoint()
        try:
            self._step(1.0)
        except UserError:
            self._load(self.checkpoints.nearest(self.recipe, self.tick))
            raise
        self.tick += 1
        self._edit_masks()

    def seek(self, position: int | Fraction) -> None:
        """Go to a tick, or between two: there the step from the earlier one is made, with the map carried on only by
        the part of it that has passed. The next `advance` or `seek` goes on from the whole tick.
        """
        self._leave_passing()
        whole, part = int(position // 1), float(position % 1)
        nearest = self.checkpoints.nearest(self.recipe, whole)
        if whole < self.tick or (nearest is not None and nearest.tick > self.tick):
            self._load(nearest)
        while self.tick < whole:
            self.advance()
        if part:
            self._passing = self._save()
            self._step(part)

    def head_for(self, tick: int) -> None:
        """Go to the last moment up to a tick that is kept, unless this one lies between the two."""
        nearest = self.checkpoints.nearest(self.recipe, tick)
        if tick < self.tick or (nearest is not None and nearest.tick > self.tick):
            self.seek(nearest.tick if nearest is not None else 0)

    def use(self, recipe: Recipe, keep: bool = True) -> None:
        """Go on with another recipe at the same tick, making again what differs in its past.

        `keep`: what is left behind may be wanted again, by redo.
        """
        self._leave_passing()
        before, self.recipe = self.recipe, recipe
        if recipe.force != before.force and recipe.is_set_up_as(before):
            self._release_forces()
            self.forces = self._loaded_forces()
        if not recipe.is_set_up_as(before):
            self._release_simulation()
            self.checkpoints.clear()
            tick, self.tick = self.tick, 0
            self._build()
            self.seek(tick)
        elif not recipe.goes_on_from(before, self.tick):
            if keep:
                self._keep(before)
            tick = self.tick
            self.handles.replace(self._handles_in_picture())
            self._load(self.checkpoints.nearest(recipe, tick))
            self.seek(tick)
        else:
            self.handles.replace(self._handles_in_picture())
            self._edit_masks(before)

    def check_forces(self, recipe: Recipe) -> None:
        """Raise `UserError` if the forces of a recipe cannot be made here, and are not those at work."""
        if recipe.force != self.recipe.force:
            build(recipe.force, self.grid, self.pictures, recipe.duration)

    def checkpoint(self) -> None:
        """Keep this moment, so that going back to it costs nothing."""
        self._leave_passing()
        self._keep(self.recipe)

    def snapshot(self) -> dict[str, np.ndarray]:
        """A copy of this moment off the GPU, by name, for `resume`."""
        self._leave_passing()
        moment = self._save()
        arrays = moment.arrays()
        moment.release()
        return arrays

    def resume(self, tick: int, snapshot: dict[str, np.ndarray]) -> None:
        """Go to a tick by a snapshot taken there, of the same simulation.

        Raises:
            ValueError: if it is not of this simulation.
        """
        self._leave_passing()
        before = self._save()
        try:
            self._look_at(_window(snapshot.get("settings/window", np.zeros(0))))
            self.warp.move_to(self.fluid.grid)
            now = self._save()
            try:
                then = now.with_arrays(self.device, snapshot)
            finally:
                now.release()
        except ValueError:
            self._restore(before)
            raise
        finally:
            before.release()
        self._restore(then)
        then.release()
        self.tick = tick

    def release(self) -> None:
        """Free the textures."""
        self._leave_passing()
        self.checkpoints.clear()
        self._release_simulation()
        self._brush.release()

    # -- what it looks at -------------------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """Simulated seconds so far."""
        return self.tick * self.recipe.fluid.dt

    @property
    def seen(self) -> WarpMap | ScaledMap:
        """What the picture is looked up through: the warp, or as much of it as the recipe says."""
        self._scaled.amount = self.recipe.amount
        return self.warp if self.recipe.amount == 1 else self._scaled

    @property
    def settings(self) -> FluidSettings:
        """The fluid's settings as they are in force at this tick."""
        return self.recipe.fluid_at(self.tick)

    def observe(self, sentinel: Sentinel) -> Observation:
        """What the sentinel asks for, at this moment; reads back from the GPU."""
        motion = self.fluid.motion() if sentinel.needs_motion else None
        distortion = self.warp.statistics() if sentinel.needs_map else None
        return Observation(
            energy=motion and motion.kinetic_energy,
            speed=motion and motion.largest_speed,
            displacement=distortion and distortion.displacement_max,
            det=distortion and distortion.det_min,
            away=self._farthest_handle() if sentinel.needs_handles else None,
            points=tuple(self.whereabouts(watch.point) for watch in sentinel.stop.watch),
            extent=self.grid.extent,
        )

    @property
    def led(self) -> list[tuple[str, RecipeHandle | RecipePin]]:
        """The recipe's pins and handles that take hold of something, with what messages call them; pins come first."""
        led = labelled(self.recipe.handle, self.recipe.pin)
        return sorted((each for each in led if each[1].takes_hold), key=lambda each: isinstance(each[1], RecipeHandle))

    def unmet(self, within: float) -> Iterator[str]:
        """Which handles are farther than `within` longer sides from where they are led at this moment, and how far."""
        if not self.handles.handles:
            return
        solid = self.fluid.solid.get()
        for (label, led), far, points in zip(self.led, self.handles.away, self.handles.shapes, strict=True):
            if not far <= within:
                held = points if led.points else points[:1]
                columns, rows = np.clip(held / self.grid.spacing, 0, np.array(self.grid.size) - 1).astype(int).T
                why = ": what it holds is frozen" if (solid[rows, columns] == 255).any() else ""
                pixels = far * max(self.pictures.source.width, self.pictures.source.height)
                yield f"{label} is {far:.3g} longer sides ({pixels:.3g} pixels) away from where it is led{why}"

    def whereabouts(self, point: tuple[float, float]) -> tuple[float, float]:
        """Where a point of the original (fractions of width and height) is now, in longer sides.

        The place that is looked up nearest to it, and from there one step of Newton's method: exact to second order.
        """
        fine = self.grid.refined(FINER)
        (hx, hy), (x, y) = fine.spacing, fine.centres()
        looked_up = self.warp.read(fine.size).astype(np.float64) + np.stack([x, y], axis=-1)
        wanted = np.multiply(point, self.grid.extent)
        j, i = np.unravel_index(((looked_up - wanted) ** 2).sum(axis=-1).argmin(), x.shape)
        around = looked_up[max(j - 1, 0) : j + 2, max(i - 1, 0) : i + 2]
        slopes = np.gradient(around, hx, axis=1), np.gradient(around, hy, axis=0)
        jacobian = np.stack([slope.mean(axis=(0, 1)) for slope in slopes], axis=-1)
        step = np.linalg.lstsq(jacobian, wanted - looked_up[j, i], rcond=None)[0]
        at_x, at_y = np.array([x[j, i], y[j, i]]) + np.clip(step, (-hx, -hy), (hx, hy))
        return float(at_x), float(at_y)

    def as_seen(self, values: np.ndarray, grid: Grid) -> np.ndarray:
        """Values of the original's cells, (ny, nx) or (ny, nx, c), where the warp shows them at this moment."""
        if self.tick == 0 and self.recipe.map is None:
            return values
        moved, (hx, hy), (x, y) = self.warp.read(grid.size), grid.spacing, grid.centres()
        column, row = np.floor((x + moved[..., 0]) / hx), np.floor((y + moved[..., 1]) / hy)
        return values[np.clip(row, 0, grid.ny - 1).astype(int), np.clip(column, 0, grid.nx - 1).astype(int)]

    # -- one step ---------------------------------------------------------------------------------------------------

    def _step(self, part: float) -> None:
        """Everything at this tick; the warp is carried on by `part` of the step."""
        dt = self.recipe.fluid.dt
        self.steps += 1
        for change in self.recipe.change:
            if change.tick == self.tick:
                self._change(change)
        leads = any(led.is_in_force(self.tick, dt) for _, led in self.led)
        acts = [act for stroke in self.recipe.stroke for act in stroke.acts(self.tick)]
        self._follow([act for act in acts if act.stroke.tool in FLOWING], leads)
        self._set_parameters(self.settings)
        painted = False
        self._leading.clear()
        with self.device.stage("brush"):
            for act in acts:
                painted |= self._draw(act.stroke, act.tick, act.dabs, dt, part)
            if painted:
                self._apply_masks()
            if leads:
                self.handles.lead(dt, self.tick * dt)
        steer = (lambda velocity: self._steer(velocity, leads)) if self._leading or leads else None
        self.fluid.step(dt, self._forces(dt), steer)
        self._carry(leads)
        with self.device.stage("warp map"):
            self.warp.follow(self.fluid, dt * part)
        if self.density is not None:
            self.density.advance(self.fluid.carrier(), self.grid, dt * part)

    def _change(self, change: Change) -> None:
        if change.clear_velocity:
            self.fluid.clear_velocity()
        if change.reset_warp:
            self.warp.reset()
            if self.density is not None:
                self.density.set(self._density_values())
        if change.clear_masks:
            self.masks.clear()
            self._viscosity_in_force = None

    def _set_parameters(self, settings: FluidSettings) -> None:
        slip = "free" if settings.walls == "free-slip" else "none"
        params = FluidParams(walls=Walls.of(slip, self.fluid.grid.at_edge), drag=settings.drag, sweeps=settings.sweeps)
        if params != self.fluid.params:
            self.fluid.params = params
        if settings.viscosity != self._viscosity_in_force:
            self._use_viscosity(settings.viscosity)
            self._apply_masks()

    def _follow(self, acts: list[Act], leads: bool) -> None:
        """Let the flow be solved where the strokes of this tick want it; without any it stays where it is.

        Handles act on the whole picture.
        """
        if (acts or leads) and self._has_windows:
            window = None if leads else Window.of(acts, self.window, self.grid)
            if window != self.window:
                assert isinstance(self.fluid, Fluid)
                with self.device.stage("window"):
                    self._set_parameters(self.settings)  # also of a fluid that has just been restored
                    flow = self.fluid.flow_on(self._cells_of(window))
                    self._look_at(window)
                    self.warp.move_to(self.fluid.grid)
                    self._set_parameters(self.settings)
                    self._apply_masks()
                    self.fluid.go_on_with(flow)
                    flow.release()

    def _cells_of(self, window: Window | None) -> Grid:
        return self.grid if window is None else window.grid_in(self.grid)

    def _look_at(self, window: Window | None) -> None:
        """Go on in another window, with a fluid at rest that no masks have been applied to; not yet with the map."""
        if window == self.window:
            return
        grid, self.window = self._cells_of(window), window
        if window is None:
            self.fluid = self._on_whole
        else:
            if self._in_window is None or self._in_window.grid.size != grid.size:
                if self._in_window is not None:
                    self._in_window.release()
                self._in_window = Fluid(self.device, grid)
            self.fluid = self._in_window
        if isinstance(self.fluid, Fluid):
            self.fluid.lay_on(grid)
        self.masks.forget_fluid()

    def _use_viscosity(self, base: float) -> None:
        """Let the masks be painted over the recipe's layers on another base."""
        self.masks.set_base(lambda grid: self._viscosity_on(base, grid))
        self._viscosity_in_force = base

    def _apply_masks(self) -> None:
        self.masks.apply(self.fluid)
        if taken := self.masks.take_frozen():
            self.warp.hold(*taken)

    def _forces(self, dt: float) -> list[tuple[Field, float]]:
        """The force fields and their impulses in this tick; sources go into the fluid's own, motions are kept."""
        start, pushes = self.tick * dt, []
        self._motions.clear()
        for force in self.forces:
            impulse = force.law.impulse(start, start + dt, self)
            force.check(impulse, dt, start)
            if impulse and force.faces is not None:
                pushes.append((force.faces, impulse))
            if impulse and force.divergence is not None:
                # The velocity that holds during this tick has to make all the room that the tick shall make.
                self.fluid.add_source(force.divergence, impulse / dt)
            if impulse and force.motion is not None:
                self._motions.append((force.motion, impulse / dt))
        return pushes

    def _draw(self, stroke: BrushPath, tick: int, dabs: tuple[Dab, ...], dt: float, part: float) -> bool:
        """Let a stroke act, with its images, at one of its own ticks; True if it painted on the masks."""
        painted = False
        far = stroke.travelled(tick, self.grid.extent) / stroke.radius if stroke.tool == "push" else 0.0
        for image, mirrored in stroke.images(dabs, self.grid.extent):
            painted |= self._draw_image(stroke, far, image, mirrored, dt, part)
        return painted

    def _draw_image(
        self, stroke: BrushPath, far: float, dabs: tuple[Dab, ...], mirrored: bool, dt: float, part: float
    ) -> bool:
        reverse = stroke.reverse != (mirrored and stroke.tool == "twirl")
        strength = -stroke.strength if reverse else stroke.strength
        tips = [(self._tip(stroke, dab), strength * dab.pressure) for dab in dabs]
        # Several samples in one tick: the fluid is carried by the whole way, a mask is painted piece by piece.
        whole = replace(tips[0][0], end=tips[-1][0].end)
        pressed = sum(amount for _, amount in tips) / len(tips)
        match stroke.tool:
            case "push":
                fluid = self.settings
                on = coasting(whole, dt, fluid.drag, fluid.viscosity)
                self._lead(Push(whole, dt, pressed, slip_factor(far, on), strain_limit(far, on), stroke.local))
            case "curve":
                for tip, amount in tips:
                    length = hypot(tip.end[0] - tip.start[0], tip.end[1] - tip.start[1])
                    if length:
                        self._brush.push(self.fluid, tip, length / BLOW, amount)
            case "twirl":
                self._lead(Twirl(whole, TWIRL * pressed))
            case "bloat":
                self._brush.expand(self.fluid, whole, GROWTH * pressed)
            case "pinch":
                self._brush.expand(self.fluid, whole, -GROWTH * pressed)
            case "restore":
                for tip, amount in tips:
                    share = 1 - np.exp(-RESTORING * abs(amount) * dt * part / len(tips))
                    self.warp.restore_under(tip.end, tip.radius, tip.hardness, float(share))
            case _:
                for tip, amount in tips:
                    self._paint(stroke, tip, amount, dt / len(tips))
                return True
        return False

    def _lead(self, motion: Motion) -> None:
        """Let a brush lead the fluid: with what viscosity and drag will take of it, and again once they have."""
        fluid = self.settings
        gain = gain_compensation(motion.tip.radius, fluid.dt, fluid.drag, fluid.viscosity)
        self._brush.lead(self.fluid, motion, gain, self.warp)
        self._leading.append(motion)

    def _steer(self, velocity: Field, leads: bool) -> None:
        with self.device.stage("brush"):
            for motion in self._leading:
                self._brush.make_up(self.fluid, motion, velocity, self.warp)
            if leads:
                self.handles.make_up(velocity)

    def _carry(self, leads: bool) -> None:
        """Let what is local of brushes and forces carry the picture besides the fluid."""
        with self.device.stage("brush"):
            for motion in self._leading:
                if isinstance(motion, Push):
                    self._brush.carry(self.fluid, motion, self.warp)
            if leads:
                self.handles.carry()
            for field, amount in self._motions:
                self.fluid.add_local(field, amount)

    def _paint(self, stroke: BrushPath, tip: Tip, amount: float, dt: float) -> None:
        match stroke.tool:
            case "thicken":
                self.masks.thicken(tip, THICKENING * amount * dt)
            case "thin":
                self.masks.thicken(tip, -THICKENING * amount * dt)
            case "freeze":
                self.masks.freeze(tip, amount)
            case "thaw":
                self.masks.freeze(tip, -amount)
            case "smooth":
                self.masks.smooth(tip, amount)

    def _tip(self, stroke: BrushPath, dab: Dab) -> Tip:
        width, height = self.grid.extent
        start, end = (dab.x0 * width, dab.y0 * height), (dab.x1 * width, dab.y1 * height)
        return Tip(start, end, stroke.radius, stroke.hardness, near=stroke.detail > 0)

    def _edit_masks(self, before: Recipe | None = None) -> None:
        """Do what is done to the masks at this tick in no time, but for what was done of `before`."""
        here, canvas, pictures = self.recipe.masks_at(self.tick), self.masks.canvas, self.small_pictures
        left = remaining(here, before.masks_at(self.tick) if before is not None else ())
        assert left is not None
        for edit, first in left:
            if isinstance(edit, MaskStroke):
                for hand in range(first, edit.last_tick + 1):
                    self._draw(edit, hand, edit.at(hand), self.recipe.fluid.dt, 1.0)
            elif isinstance(edit, ClearMask):
                self.masks.take_off(edit.of)
            else:
                try:
                    self.masks.edit(
                        edit.of, lambda words, edit=edit: edited(words, edit, canvas, pictures, self.as_seen)
                    )
                except (ValueError, UserError) as error:
                    raise UserError(f"mask[{self.recipe.mask.index(edit) + 1}]: {error}") from None
        if left:
            with self.device.stage("brush"):
                self._apply_masks()

    # -- its state --------------------------------------------------------------------------------------------------

    def _build(self) -> None:
        """Everything as it is at tick 0."""
        recipe, source = self.recipe, self.pictures.source
        self.grid = Grid.for_picture(source.width, source.height, recipe.fluid.grid)
        fluid, warp = SOLVERS[recipe.fluid.solver]
        self.window: Window | None = None
        self._has_windows = may_have_windows(recipe)
        self.fluid = self._on_whole = fluid(self.device, self.grid)
        self._in_window: Fluid | None = None
        largest = self.device.limits.max_texture_size
        fine = map_size(self.grid, (source.width, source.height), largest)
        self.warp = warp(self.device, self.grid, fine)
        self._scaled = ScaledMap(self.warp)
        if recipe.map is not None:
            self._begin_with(recipe.map)
        canvas = Grid(max(fine[0], SMALLEST_GRID), max(fine[1], SMALLEST_GRID), self.grid.picture)
        self.masks = Masks(self.device, canvas)
        if recipe.freeze:
            self.masks.set_frozen(solid(recipe.freeze, canvas, self.pictures))
        for said in objections(recipe.handle, recipe.pin, self.grid.extent):
            self.pictures.notice(said)
        self.handles = Handles(self.fluid, self.warp, self._handles_in_picture())
        self.density = self._new_density() if recipe.mode == "density" else None
        self._viscosity_in_force: float | None = None
        self.forces = self._loaded_forces()
        self._viscosity = lru_cache(4)(lambda base, grid: viscosity(recipe.viscosity, base, grid, self.pictures))
        self._set_parameters(recipe.fluid)  # changes come with the tick
        self._edit_masks()

    def _loaded_forces(self) -> list[LoadedForce]:
        built = build(self.recipe.force, self.grid, self.pictures, self.recipe.duration)
        return [LoadedForce.of(self.device, force) for force in built]

    def _release_forces(self) -> None:
        for force in self.forces:
            for field in (force.faces, force.divergence, force.motion):
                if field is not None:
                    field.release()

    def _handles_in_picture(self) -> list[Handle]:
        made, extent = [], self.grid.extent
        for _, led in self.led:
            at = led.at[0] * extent[0], led.at[1] * extent[1]
            way: dict[str, Any] = {
                "points": np.multiply(led.points, extent) if led.points else (),
                "closed": led.closed,
            }
            if isinstance(led, RecipeHandle):
                way |= {"duration": led.duration, "local": led.local, "rotate": led.rotate, "scale": led.scale}
                way |= {"turned": led.turned}
                way |= {"to": led.to and self._in_longer_sides(led.to)}
                way |= {"keys": tuple((time, *self._in_longer_sides((x, y))) for time, x, y in led.keys or ())}
                way |= {"goals": np.multiply(led.goals, extent) if led.goals else ()}
            made.append(Handle(at, radius=led.radius, start=led.start, end=led.let_go, stiffness=led.stiffness, **way))
        return made

    def _in_longer_sides(self, place: tuple[float, float]) -> tuple[float, float]:
        """A place in fractions of the picture, within it."""
        x, y = (min(max(part, 0.0), 1.0) * side for part, side in zip(place, self.grid.extent, strict=True))
        return x, y

    def _farthest_handle(self) -> float | None:
        """How far the handle that is farthest from where it is led is from there; None if there is none."""
        led = [isinstance(led, RecipeHandle) for _, led in self.led]
        return float(self.handles.away[led].max()) if any(led) else None

    def _begin_with(self, name: str) -> None:
        try:
            self.warp.set(self.pictures.load_map(name))
        except ValueError as error:
            raise UserError(f"{name} cannot be the map to begin with: {error}") from None

    def _new_density(self) -> Density:
        values, settings = self._density_values(), self.recipe.density
        colour = np.asarray((*settings.source, 0.0)[: values.shape[2]], np.float32)
        source = np.broadcast_to(colour, values.shape) if colour.any() else None
        return Density(self.device, values, settings.kappa, source)

    def _density_values(self) -> np.ndarray:
        """The picture's colours and alpha as the eye sees them, (h, w, 4) float32 in [0, 1]."""
        colours, alpha = channels(self.pictures.source)
        return np.concatenate([colours, alpha[..., None]], axis=2)

    def _viscosity_on(self, base: float, grid: Grid) -> np.ndarray | float:
        """The recipe's viscosity on a grid; in a window, of cells as small over the whole picture those in it."""
        if not self.recipe.viscosity:
            return base
        if grid.is_whole:
            return self._viscosity(base, grid)
        source = self.pictures.source
        whole = Grid.for_picture(source.width, source.height, min(ceil(1 / min(grid.spacing)), FINEST))
        x, y = grid.centres()
        (hx, hy), last = whole.spacing, np.array(whole.size) - 1
        column, row = np.minimum(x[0] // hx, last[0]).astype(int), np.minimum(y[:, 0] // hy, last[1]).astype(int)
        return self._viscosity(base, whole)[np.ix_(row, column)]

    def _release_simulation(self) -> None:
        self._release_forces()
        for thing in (
            self._on_whole,
            self._in_window,
            self._scaled,
            self.warp,
            self.masks,
            self.density,
            self.handles,
        ):
            if thing is not None:
                thing.release()

    def _parts(self) -> dict[str, Fluid | PaperFluid | Masks | Density | WarpMap | Handles]:
        """All that has a state, by name."""
        parts = {"fluid": self.fluid, "masks": self.masks, "density": self.density, "warp": self.warp}
        parts |= {"handles": self.handles}
        return {name: part for name, part in parts.items() if part is not None}

    def _save(self) -> Moment:
        states = {name: part.save() for name, part in self._parts().items()}
        settings = {"viscosity": np.array(self._viscosity_in_force), "window": np.array(self.window or (), np.int64)}
        return Moment(states | {"settings": State({}, settings)})

    def _restore(self, moment: Moment) -> None:
        self._look_at(_window(moment.states["settings"].values["window"]))
        for name, part in self._parts().items():
            part.restore(moment.states[name])
        viscosity = float(moment.states["settings"].values["viscosity"])
        if viscosity != self._viscosity_in_force:
            self._use_viscosity(viscosity)

    def _load(self, checkpoint: Checkpoint | None) -> None:
        if checkpoint is None:
            self._release_simulation()
            self.tick = 0
            self._build()
        else:
            self._restore(checkpoint.moment)
            self.tick = checkpoint.tick
            self._edit_masks(checkpoint.recipe)

    def _keep(self, recipe: Recipe) -> None:
        if self.checkpoints.budget and not self.checkpoints.has(recipe, self.tick):
            self.checkpoints.add(Checkpoint(recipe, self.tick, self._save()))

    def _leave_passing(self) -> None:
        """Come back to the whole tick from between two."""
        if self._passing is not None:
            self._restore(self._passing)
            self._passing.release()
            self._passing = None

    def _begins_here(self) -> bool:
        recipe, tick = self.recipe, self.tick
        led = (*recipe.handle, *recipe.pin)
        return (
            any(stroke.begins_at(tick) for stroke in recipe.stroke)
            or any(change.tick == tick for change in recipe.change)
            or any(one.first_tick(recipe.fluid.dt) == tick for one in led)
        )


def _window(saved: np.ndarray) -> Window | None:
    """The window that a state was saved in.

    Raises:
        ValueError: if it is none.
    """
    numbers = saved.tolist()
    if not numbers:
        return None
    if saved.shape != (3,) or saved.dtype != np.int64 or not 0 < numbers[0] <= FINEST_DETAIL or min(numbers) < 0:
        raise ValueError("it is of no window")
    return Window(*numbers)

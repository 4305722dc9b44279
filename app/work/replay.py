"""Driving the solver by a recipe: the one way to a warp, for the window and for the command line.

One long class: a step, and going back by a checkpoint, need all parts of the simulation. What strokes, forces and
handles do in a step is in `brushwork.py`, `loaded_forces.py` and `loaded_handles.py`.
"""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from itertools import islice
from math import ceil

import numpy as np

from app.errors import UserError
from app.media.auxiliary import Pictures
from app.model.forces import build
from app.model.handles import MOST_OBJECTIONS, RecipeHandle, RecipePin, labelled, objections
from app.model.mask_edits import ClearMask, MaskStroke, edited, remaining
from app.model.masks import solid, viscosity
from app.model.recipe import FluidSettings, Recipe
from app.model.sampling import FINEST, SmallPictures, channels
from app.model.strokes import FINEST_DETAIL, Act, Change
from app.model.windows import FLOWING, FlowWindow, Led, may_have_windows
from app.work.brushwork import Brushwork, Scene
from app.work.checkpoints import DEFAULT_BUDGET, Checkpoint, Checkpoints, Moment
from app.work.loaded_forces import LoadedForce, acting
from app.work.loaded_handles import LoadedHandles
from solver.brush.handle import Handle
from solver.brush.handles import Begun, Handles
from solver.brush.masks import Masks
from solver.fluid import Fluid
from solver.gl.device import Device
from solver.gl.field import Field, FieldError
from solver.grid import SMALLEST_GRID, Grid
from solver.paper import PaperFluid, PaperWarpMap
from solver.params import FluidParams, Walls
from solver.state import State
from solver.warp.accumulated import map_size
from solver.warp.density import Density
from solver.warp.map import WarpMap
from solver.warp.scaled import ScaledMap
from solver.warp.submap import differences_of

CHECKPOINT_EVERY = 16  # ticks

# What wants the whole picture.
WHOLE = Led(0, 1.0, 1.0, np.zeros((1, 2)), np.zeros((1, 2)), is_moving=True, begins=False)

SOLVERS = {"mac": (Fluid, WarpMap), "paper": (PaperFluid, PaperWarpMap)}


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
        self._brushwork = Brushwork(device)
        self._passing: Moment | None = None
        self._led: list[tuple[str, RecipeHandle | RecipePin]] = []
        self._led_of: Recipe | None = None
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

    def pass_time(self, tick: int) -> None:
        """Go on to a tick as long as nothing has been done yet, which takes no steps, and leaves nothing to keep."""
        self._leave_passing()
        stop = min(tick, self.recipe.begins)
        if self.tick >= stop:
            return
        for _ in range(self.tick, stop):
            self.fluid.time += self.recipe.fluid.dt  # one by one, as steps do, for the same digits
        self.tick = stop
        self._edit_masks()

    def seek(self, position: int | Fraction) -> None:
        """Go to a tick, or between two: there the step from the earlier one is made, with the map carried on only by
        the part of it that has passed. The next `advance` or `seek` goes on from the whole tick.
        """
        whole, part = int(position // 1), float(position % 1)
        self.head_for(whole)
        while self.tick < whole:
            self.advance()
        if part:
            self._passing = self._save()
            self._step(part)

    def head_for(self, tick: int) -> None:
        """Go to the last moment up to a tick that is kept, unless this one lies between; and to where all begins."""
        self._leave_passing()
        nearest = self.checkpoints.nearest(self.recipe, tick)
        if tick < self.tick or (nearest is not None and nearest.tick > self.tick):
            self._load(nearest)
        self.pass_time(tick)

    def use(self, recipe: Recipe, keep: bool = True) -> None:
        """Go on with another recipe at the same tick, making again what differs in its past.

        `keep`: what is left behind may be wanted again, by redo.
        """
        self._leave_passing()
        before, self.recipe = self.recipe, recipe
        leads_as_before = (recipe.handle, recipe.pin) == (before.handle, before.pin)
        if recipe.force != before.force and recipe.is_set_up_as(before):
            self._release_forces()
            self._load_forces()
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
            if not leads_as_before:
                self.handles.replace(self._handles())
            self._load(self.checkpoints.nearest(recipe, tick))
            self.seek(tick)
        else:
            if not leads_as_before:
                self.handles.replace(self._handles())
            self._edit_masks(before)

    def grid_of(self, recipe: Recipe) -> Grid:
        """The grid that a recipe is simulated on. Raises `UserError` if the device cannot hold it."""
        source = self.pictures.source
        grid = Grid.for_picture(source.width, source.height, recipe.fluid.grid)
        if max(differences_of(grid.size)) > self.device.limits.max_texture_size:
            large = f"grid of {grid.nx} x {grid.ny} cells is more than this graphics device can hold"
            raise UserError(f"a {large}; use a smaller --grid or 'fluid.grid'", in_window=f"A {large}; choose fewer.")
        return grid

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
        self._brushwork.release()

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

    @property
    def led(self) -> list[tuple[str, RecipeHandle | RecipePin]]:
        """The recipe's pins and handles that take hold of something, with what messages call them; pins come first."""
        recipe = self.recipe
        if self._led_of is not recipe:
            led = [each for each in labelled(recipe.handle, recipe.pin) if each[1].takes_hold]
            self._led_of, self._led = recipe, sorted(led, key=lambda each: isinstance(each[1], RecipeHandle))
        return self._led

    @property
    def solid(self) -> np.ndarray:
        """The cells of the whole picture that are wholly closed, (ny, nx); reads back from the GPU."""
        if self.window is None:
            return self.fluid.solid.get() == 255
        x, y = self.grid.centres()
        frozen = self.masks.frozen.get() >= 128  # from a half on
        (rows, columns), (width, height) = frozen.shape, self.grid.extent
        return frozen[(y / height * rows).astype(int), (x / width * columns).astype(int)]

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
        if self.tick < self.recipe.begins:
            self.fluid.time += dt
            return
        self.steps += 1
        for change in self.recipe.change:
            if change.tick == self.tick:
                self._change(change)
        leads = any(led.is_in_force(self.tick, dt) for _, led in self.led)
        acts = [act for stroke in self.recipe.stroke for act in stroke.acts(self.tick)]
        begun = self._follow([act for act in acts if act.stroke.tool in FLOWING], leads)
        self._set_parameters(self.settings)
        scene, brushwork, painted = self._scene(part), self._brushwork, False
        brushwork.begin()
        with self.device.stage("brush"):
            for act in acts:
                try:
                    painted |= brushwork.draw(scene, act.stroke, act.tick, act.dabs)
                except FieldError:  # a fault of the program's and of no stroke: it names the field
                    raise
                except ValueError as error:  # of a speed, to which the length of a tick belongs
                    name, mend = f"stroke[{self.recipe.stroke.index(act.stroke) + 1}]", "let it take more ticks"
                    raise UserError(
                        f"{name}: at {self.tick * dt:.6g} s {error}; {mend}, or make fluid.dt longer"
                    ) from None
            if painted:
                self._apply_masks()
            if leads:
                self.handles.lead(dt, self.tick * dt, begun)

        def steer(velocity: Field) -> None:
            with self.device.stage("brush"):
                brushwork.make_up(scene, velocity)
                if leads:
                    self.handles.make_up(velocity)

        pushes, motions = acting(self.forces, self.fluid, self.tick * dt, dt, self)
        try:
            self.fluid.step(dt, pushes, steer if brushwork.is_leading or leads else None)
        except FieldError:
            raise
        except ValueError as error:  # of numbers that no key is alone in: many at once, each within its own bounds
            mend = "make their strength less, or let fewer of them act at once"
            raise UserError(f"At {self.tick * dt:.6g} s {error}; {mend}") from None
        with self.device.stage("brush"):  # what is local carries the picture besides the fluid
            brushwork.carry(scene)
            if leads:
                self.handles.carry()
            for field, amount in motions:
                self.fluid.add_local(field, amount)
        with self.device.stage("warp map"):
            self.handles.follow(self.fluid, dt * part)
            self.warp.follow(self.fluid, dt * part)
        if self.density is not None:
            self.density.advance(self.fluid.carrier(), self.grid, dt * part)

    def _scene(self, part: float = 1.0) -> Scene:
        return Scene(self.fluid, self.warp, self.masks, self.settings, self.grid.extent, part)

    def _change(self, change: Change) -> None:
        if change.clear_velocity:
            self.fluid.clear_velocity()
        if change.reset_warp:
            self.warp.reset()
            self.handles.forget_map()
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

    def _follow(self, acts: list[Act], leads: bool) -> Begun | None:
        """Let the flow be solved where strokes and handles of this tick want it; without any it stays where it is.

        Returns what `Handles.lead` need not look for again.
        """
        begun = None
        if (acts or leads) and self._has_windows:
            led, begun = self._moves() if leads else ([], None)
            window = FlowWindow.of(acts, self.window, self.grid, led)
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
        return begun

    def _moves(self) -> tuple[list[Led], Begun | None]:
        """The handles and pins that are in force in this tick, and what `Handles.lead` need not look for again."""
        if not all(led.detail for _, led in self.led if led.is_in_force(self.tick, self.recipe.fluid.dt)):
            return [WHOLE], None
        dt, found = self.recipe.fluid.dt, list[Led]()
        moves, begun = self.handles.moves(self.tick * dt, dt)
        for number, here, then, is_moving, begins, is_late in moves:
            (_, led), handle = self.led[number], self.handles.handles[number]
            found.append(Led(led.detail, handle.reach, handle.push_radius, here, then, is_moving, begins, is_late))
        return found, begun

    def _cells_of(self, window: FlowWindow | None) -> Grid:
        return self.grid if window is None else window.grid_in(self.grid)

    def _look_at(self, window: FlowWindow | None) -> None:
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
        self.handles.go_on_with(self.fluid)
        self.masks.forget_fluid()

    def _use_viscosity(self, base: float) -> None:
        """Let the masks be painted over the recipe's layers on another base."""
        self.masks.set_base(lambda grid: self._viscosity_on(base, grid))
        self._viscosity_in_force = base

    def _apply_masks(self) -> None:
        self.masks.apply(self.fluid)
        if taken := self.masks.take_frozen():
            self.warp.hold(*taken)

    def _edit_masks(self, before: Recipe | None = None) -> None:
        """Do what is done to the masks at this tick in no time, but for what was done of `before`."""
        here, canvas, pictures = self.recipe.masks_at(self.tick), self.masks.canvas, self.small_pictures
        left = remaining(here, before.masks_at(self.tick) if before is not None else ())
        assert left is not None
        # What is thawed and frozen again at once is held anew: so each is applied by itself, as where a hand does it.
        for edit, first in left:
            if isinstance(edit, MaskStroke):
                for hand in range(first, edit.last_tick + 1):
                    self._brushwork.draw(self._scene(), edit, hand, edit.at(hand))
            elif isinstance(edit, ClearMask):
                self.masks.take_off(edit.of)
            else:
                try:
                    self.masks.edit(
                        edit.of, lambda words, edit=edit: edited(words, edit, canvas, pictures, self.as_seen)
                    )
                except (ValueError, UserError) as error:
                    raise UserError(f"mask[{self.recipe.mask.index(edit) + 1}]: {error}") from None
            with self.device.stage("brush"):
                self._apply_masks()

    # -- its state --------------------------------------------------------------------------------------------------

    def _build(self) -> None:
        """Everything as it is at tick 0."""
        recipe, source = self.recipe, self.pictures.source
        self.grid, largest = self.grid_of(recipe), self.device.limits.max_texture_size
        fluid, warp = SOLVERS[recipe.fluid.solver]
        self.window: FlowWindow | None = None
        self._has_windows = may_have_windows(recipe)
        self.fluid = self._on_whole = fluid(self.device, self.grid)
        self._in_window: Fluid | None = None
        fine = map_size(self.grid, (source.width, source.height), largest)
        self.warp = warp(self.device, self.grid, fine)
        self._scaled = ScaledMap(self.warp)
        if recipe.map is not None:
            self._begin_with(recipe.map)
        canvas = Grid(max(fine[0], SMALLEST_GRID), max(fine[1], SMALLEST_GRID), self.grid.picture)
        self.masks = Masks(self.device, canvas)
        if recipe.freeze:
            self.masks.set_frozen(solid(recipe.freeze, canvas, self.pictures))
        for said in islice(objections(recipe.handle, recipe.pin, self.grid.extent), MOST_OBJECTIONS):
            self.pictures.notice(said)
        self._loaded_handles = LoadedHandles(self.grid.extent)
        self.handles = Handles(self.fluid, self.warp, self._handles())
        self.density = self._new_density() if recipe.mode == "density" else None
        self._viscosity_in_force: float | None = None
        self._load_forces()
        self._viscosity = lru_cache(4)(lambda base, grid: viscosity(recipe.viscosity, base, grid, self.pictures))
        self._set_parameters(recipe.fluid)  # changes come with the tick
        self._edit_masks()

    def _load_forces(self) -> None:
        built = build(self.recipe.force, self.grid, self.pictures, self.recipe.duration)
        self.forces = [LoadedForce.of(self.device, force) for force in built]

    def _release_forces(self) -> None:
        for force in self.forces:
            force.release()

    def _handles(self) -> list[Handle]:
        return self._loaded_handles.of(led for _, led in self.led)

    def _begin_with(self, name: str) -> None:
        try:
            self.warp.set(self.pictures.load_map(name))
        except ValueError as error:
            raise UserError(f"{name} cannot be the map to begin with: {error}; make it anew") from None

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


def _window(saved: np.ndarray) -> FlowWindow | None:
    """The window that a state was saved in.

    Raises:
        ValueError: if it is none.
    """
    numbers = saved.tolist()
    if not numbers:
        return None
    if saved.shape != (3,) or saved.dtype != np.int64 or not 0 < numbers[0] <= FINEST_DETAIL or min(numbers) < 0:
        raise ValueError("it is of no window")
    return FlowWindow(*numbers)

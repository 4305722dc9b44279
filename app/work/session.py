"""Working on a document live: gestures become strokes, time goes on while something moves, every edit is kept.

Knows the solver and no window; the clock comes in from outside, as ticks. It lies in layers, a module each:
`recording.py`, `painting.py`, `editing.py`, `playing.py`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import islice
from typing import Any, TypeVar

import numpy as np

from app.media.project import Project
from app.model.handles import MOST_OBJECTIONS, objections
from app.model.windows import on_grid
from app.work.handle_status import FIT, Held, Unmet, as_seen, held_in, near_enough, unmet
from app.work.playing import Playing
from app.work.recording import BUDGET
from app.work.replay import Replay
from solver.gl.device import Device

LEAST_BUDGET = BUDGET // 64  # with less, it is the grid that is too large
COARSEST = 32  # cells that a full graphics memory leaves

T = TypeVar("T")


class Session(Playing):
    """A document being worked on, what it tells of its simulation, and the grid it is simulated on.

    Args:
        device: where it is simulated.
        project: what is worked on.

    Attributes:
        is_grid_automatic: nobody has chosen the grid, and it may follow the machine.
    """

    def __init__(self, device: Device, project: Project) -> None:
        super().__init__(device, project)
        self.is_grid_automatic = False
        self._prepared: Replay | None = None  # the simulation on another grid, which is to take this one's place
        self._found: dict[str, tuple[object, Any]] = {}  # what was looked for, and in what state

    @property
    def held(self) -> list[Held]:
        """The handles and pins in force at the playhead; looking reads back from the GPU where something has moved.

        Each goes to where the hand has led it, however far the simulation is behind the hand.
        """
        self._take_up()
        aimed = self.target
        return self._once("held", (self._state, aimed), lambda: held_in(self.replay, aimed))

    @property
    def marks(self) -> list[Held]:
        """`held`, where the picture is seen at its amount."""
        held, amount = self.held, 1.0 if self.is_painting else self.replay.recipe.amount
        return self._once(
            "marks", (self._state, self.target, amount), lambda: held if amount == 1 else as_seen(held, self.replay)
        )

    @property
    def objections(self) -> tuple[str, ...]:
        """What of the handles and pins cannot be met, by number, as the command line says it; but for what is being
        changed.
        """
        led = self.document.recipe.handle, self.document.recipe.pin
        return self._once("objections", led, lambda: tuple(islice(objections(*led, self.extent), MOST_OBJECTIONS)))

    @property
    def unmet(self) -> dict[str, Unmet]:
        """Which handles have come to rest, at the end, elsewhere than where they are led, by what messages call them;
        reads back from the GPU.
        """
        replay = self.replay
        if self.is_moving or self.tick != self.end or not replay.recipe.leads:
            return {}
        is_fitted = self.document.history.undo_name == FIT

        def find() -> dict[str, Unmet]:
            return {each.label: each for each in unmet(replay, near_enough(replay), is_fitted)}

        return self._once("unmet", (self._state, is_fitted), find)

    @property
    def folds(self) -> tuple[int, int]:
        """In how many places the warp folds over itself as it is seen at this moment, and of how many: two a cell along
        each axis, if these are not too many to be looked at in a frame.

        Reads back from the GPU; an export, which may take longer, looks at each texel of the map.
        """
        seen = self.replay.seen
        if seen.is_untouched:
            return 0, 0
        width, height = seen.coarse_size
        size = self.replay.warp.bounded((2 * width, 2 * height))
        found = self._once("folds", (seen, seen.version), lambda: seen.statistics(size))
        return found.folds, found.places

    def divergence(self) -> float:
        """The largest divergence that is left, 1 / s; reads the velocity back."""
        return float(np.abs(self.replay.fluid.divergence()).max())

    @property
    def _state(self) -> tuple[object, ...]:
        return self.replay, self.replay.recipe, self.replay.tick, self.replay.warp.version

    def _once(self, what: str, state: object, find: Callable[[], T]) -> T:
        """What is found, looked for anew only in another state than the last time."""
        if what not in self._found or self._found[what][0] != state:
            self._found[what] = state, find()
        return self._found[what][1]

    # -- the grid -----------------------------------------------------------------------------------------------------

    def set_grid(self, cells: int, name: str = "Quality") -> None:
        """Simulate on another grid, by replaying all that has been done; from now on it is the person's choice."""
        self.release()
        self.is_grid_automatic = False
        self.forget_grid()
        if cells != self._live.fluid.grid:
            moved = on_grid(self._live, cells)
            self.edit(name, fluid=moved.fluid, stroke=moved.stroke)

    def prepare_grid(self, cells: int, seconds: float) -> bool:
        """Simulate on another grid too, for about `seconds`; True once it has come as far and taken this one's place.

        Until then everything stays as it is, and also then it is no edit.
        """
        recipe, start = on_grid(self._live, cells), time.perf_counter()
        if self._prepared is not None and not recipe.is_set_up_as(self._prepared.recipe):
            self.forget_grid()
        if self._prepared is None:
            self._prepared = Replay(self.device, recipe, self.pictures, self.replay.checkpoints.budget // 2)
        prepared = self._prepared
        if (common := recipe.agrees_until(prepared.recipe)) < prepared.tick:
            prepared.head_for(int(common))
        prepared.use(recipe)
        prepared.head_for(self.tick)
        while prepared.tick < self.tick:
            prepared.advance()
            if time.perf_counter() - start > seconds:
                break
        if prepared.tick < self.tick:
            return False
        prepared.checkpoints.budget = self.replay.checkpoints.budget
        self.replay.release()
        self.replay, self._prepared = prepared, None
        self.document.simulate_on(cells)
        self._base, self._live = on_grid(self._base, cells), recipe
        self.changes += 1
        return True

    def forget_grid(self) -> None:
        """Go on with this grid, whatever another one was prepared for."""
        if self._prepared is not None:
            self._prepared.release()
            self._prepared = None

    def saved(self, project: Project) -> None:
        """Take note that the work has been saved as `project`: what is in the file is exported too, grid and all."""
        self.project = project
        self.is_grid_automatic = False
        self.forget_grid()
        self.document.saved()

    def make_room(self) -> str:
        """Where the graphics memory is full: keep less of the past or, if that is little, simulate on half the cells.

        The present is made anew over the next frames. Says what has been done.

        Raises:
            MemoryError: if there can be no less.
        """
        checkpoints, cells = self.replay.checkpoints, self._live.fluid.grid // 2
        if checkpoints.budget > LEAST_BUDGET:
            checkpoints.budget //= 8
            said = "less of the past is kept now, and going back takes longer."
        elif cells >= COARSEST:
            self.document.simulate_on(cells)
            self._base, self._live = on_grid(self._base, cells), on_grid(self._live, cells)
            said = f"the simulation goes on with {cells} cells."
        else:
            raise MemoryError
        self.release_gpu()
        self.wake()
        return f"The graphics memory is full: {said}"

    def release_gpu(self) -> None:
        """Free the textures; what makes them is kept."""
        self.forget_grid()
        self.replay.release()

    def wake(self) -> None:
        """Go on after `release_gpu`: what was there is played again over the next frames."""
        tick = self.replay.tick if self._target is None else self._target
        self.replay = Replay(self.device, self._live, self.pictures, self.replay.checkpoints.budget)
        self._send(tick)
        self.is_rebuilding = self._target is not None
        self.changes += 1

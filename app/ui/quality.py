"""Automatic quality: as fine a grid as this machine can paint on."""

from __future__ import annotations

import time
from dataclasses import dataclass
from statistics import median_low
from typing import TYPE_CHECKING

from app.replay import Replay
from app.strokes import Stroke
from app.ui.files import fresh_recipe, settings_of

if TYPE_CHECKING:
    from app.ui.editor import Editor

GRIDS = (96, 128, 160, 192, 256, 384)
PATIENCE = 1.5  # seconds below the wanted rate before something is done about it
WANTED = 30.0  # frames a second while painting
# Of a frame: painting takes a tenth more than what is measured, by checkpoints, looks at the map and a longer recipe;
# and other programs want their part.
SPARE = 0.3
TRIALS = (256, 128)  # cells, of the grids that the machine is measured on
TICKS = 8  # on each of them
FAST = 4.0  # milliseconds; a tick that takes less may be made 60 times a second


@dataclass(frozen=True)
class Speed:
    """What a frame of painting takes on this machine, in milliseconds.

    Attributes:
        fixed: of a tick, on whatever grid: many passes cost the same on any.
        growing: of a tick on a grid of `TRIALS[0]`, in proportion to its cells.
        drawing: of the canvas and the interface.
    """

    fixed: float
    growing: float
    drawing: float

    @classmethod
    def of(cls, fine: float, coarse: float, drawing: float) -> Speed:
        """From what a tick takes on the two grids of `TRIALS`."""
        share = (TRIALS[1] / TRIALS[0]) ** 2
        growing = max(fine - coarse, 0.0) / (1 - share)
        return cls(max(fine - growing, 0.0), growing, drawing)

    def tick(self, grid: int) -> float:
        return self.fixed + self.growing * (grid / TRIALS[0]) ** 2

    @property
    def best_grid(self) -> int:
        """The finest grid on which painting reaches the wanted rate, with something to spare."""
        room = (1 - SPARE) * 1e3 / WANTED - self.drawing
        return max((grid for grid in GRIDS if self.tick(grid) <= room), default=GRIDS[0])


class Quality:
    """Chooses the grid when something is opened, and a coarser one when painting is slow."""

    def __init__(self, editor: Editor) -> None:
        self.editor = editor
        self._slow_for = 0.0
        self._pending = False
        self._limit = GRIDS[-1]
        self._frames = 0
        self._speed: Speed | None = None
        self._trial: Replay | None = None
        self._spent: list[list[float]] = []  # milliseconds of the ticks on each grid of `TRIALS` so far
        self._drawing: list[float] = []

    def opened(self) -> None:
        """Something new is open; an untouched picture is given the grid that this machine does well on."""
        self._slow_for, self._pending = 0.0, False
        session = self.editor.session
        # Who has undone everything may want it back: what can be redone was made on the grid as it is.
        history = session.document.history
        fresh = len(history.entries) == 1 and history.recipe.edited(picture=None) == fresh_recipe(
            settings_of(history.recipe.fluid)
        )
        if self._speed is None or not self.editor.state.auto_quality or not fresh:
            return
        grid = min(self._speed.best_grid, self._limit)
        session.begin_with(grid=grid, dt=1 / 60 if self._speed.tick(grid) < FAST else 1 / 30)

    @property
    def is_measuring(self) -> bool:
        return self.editor.state.auto_quality and self._speed is None

    def warm_up(self, begun: float) -> None:
        """After the first frames, a tick a frame: compile what the first stroke needs, and measure this machine.

        `begun`: when the frame was, on `time.perf_counter`.
        """
        self._frames += 1
        session, finish = self.editor.session, self.editor.device.ctx.finish
        if self._frames < 2 or session.is_moving:
            return
        finish()
        self._drawing.append((time.perf_counter() - begun) * 1e3)
        if self._trial is None:
            self._trial = self._new_trial(TRIALS[len(self._spent)])
            self._spent.append([])
        start = time.perf_counter()
        self._trial.advance()
        self._trial.warp.composed(1)
        finish()
        self._spent[-1].append((time.perf_counter() - start) * 1e3)
        if len(self._spent[-1]) < TICKS:
            return
        self._trial.release()
        self._trial = None
        if len(self._spent) == len(TRIALS):
            # The first ones compile.
            fine, coarse = (median_low(ticks[2:]) for ticks in self._spent)
            self._speed = Speed.of(fine, coarse, median_low(self._drawing[2:]))
            self.opened()

    def _new_trial(self, grid: int) -> Replay:
        """A push of which the picture on the canvas knows nothing."""
        session = self.editor.session
        stroke = Stroke(tool="push", radius=0.15, samples=((0, 0.4, 0.5, 1.0), (TICKS, 0.52, 0.5, 1.0)))
        fluid = session.recipe.fluid.model_copy(update={"grid": grid})
        recipe = session.recipe.edited(stroke=(stroke,), change=(), fluid=fluid)
        return Replay(self.editor.device, recipe, session.pictures, budget=0)

    def look(self, dt: float) -> None:
        """Watch the rate while the person paints; a coarser grid is taken when the stroke is finished.

        `dt`: seconds since the last frame.
        """
        editor = self.editor
        if not editor.state.auto_quality:
            return
        if editor.session.is_painting:
            # A hiccup, such as a shader that is compiled, is no slow machine.
            if dt < 0.25:
                slow = dt > 1.1 / WANTED
                self._slow_for = min(max(self._slow_for + (dt if slow else -dt), 0.0), 3.0)
            self._pending = self._pending or self._slow_for > PATIENCE
        elif self._pending and not editor.session.is_moving and not editor.session.document.history.can_redo:
            # Another grid is an edit, after which there is nothing to redo; nobody has asked for it.
            self._pending, self._slow_for = False, 0.0
            self._coarsen()

    def _coarsen(self) -> None:
        editor = self.editor
        now = editor.session.recipe.fluid.grid
        coarser = [grid for grid in GRIDS if grid < now]
        if not coarser:
            return
        editor.session.set_grid(coarser[-1], f"Grid of {coarser[-1]}")
        self._limit = coarser[-1]
        editor.messages.say(
            f"Painting fell below {WANTED:.0f} frames a second, so the grid is now {coarser[-1]} cells instead "
            f"of {now}. Quality in the inspector changes it."
        )

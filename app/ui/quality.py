"""Automatic quality: as fine a grid as this machine can paint on."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from app.replay import Replay
from app.strokes import Stroke
from app.ui.files import fresh_recipe

if TYPE_CHECKING:
    from app.ui.editor import Editor

GRIDS = (96, 128, 192, 256, 384)
PATIENCE = 1.5  # seconds below the wanted rate before something is done about it
WANTED = 30.0  # frames a second while painting
ROOM = 10.0  # milliseconds of a frame that are not the simulation's
TRIALS = 6  # ticks
FIRST = 256  # cells, of the grid that the machine is measured on


class Quality:
    """Chooses the grid when something is opened, and a coarser one when painting is slow."""

    def __init__(self, editor: Editor) -> None:
        self.editor = editor
        self._slow_for = 0.0
        self._pending = False
        self._limit = GRIDS[-1]
        self._frames = 0
        self._measured: float | None = None
        self._trial: Replay | None = None
        self._spent: list[float] = []

    def opened(self) -> None:
        """Something new is open; an untouched picture is given the grid that this machine does well on."""
        self._slow_for, self._pending = 0.0, False
        session = self.editor.session
        # Who has undone everything may want it back: what can be redone was made on the grid as it is.
        history = session.document.history
        fresh = len(history.entries) == 1 and history.recipe.edited(picture=None) == fresh_recipe()
        if self._measured is None or not self.editor.state.auto_quality or not fresh:
            return
        grid = self.best_grid(self._measured)
        grid = min(grid, self._limit)
        fast = self._measured * (grid / FIRST) ** 2 < 4
        session.begin_with(grid=grid, dt=1 / 60 if fast else 1 / 30)

    @staticmethod
    def best_grid(milliseconds: float) -> int:
        """The finest grid that leaves `ROOM` in a frame, where a tick on `FIRST` takes `milliseconds`."""
        good = [grid for grid in GRIDS if milliseconds * (grid / FIRST) ** 2 <= 1e3 / WANTED - ROOM]
        return max(good, default=GRIDS[0])

    @property
    def is_measuring(self) -> bool:
        return self.editor.state.auto_quality and self._measured is None

    def warm_up(self) -> None:
        """After the first frames, a tick a frame: compile what the first stroke needs, and measure this machine."""
        self._frames += 1
        session = self.editor.session
        if self._frames < 2 or session.is_moving:
            return
        if self._trial is None:
            stroke = Stroke(tool="push", radius=0.15, samples=((0, 0.4, 0.5, 1.0), (TRIALS, 0.5, 0.5, 1.0)))
            fluid = session.recipe.fluid.model_copy(update={"grid": FIRST})
            recipe = session.recipe.edited(stroke=(stroke,), change=(), fluid=fluid)
            self._trial = Replay(self.editor.device, recipe, session.pictures, budget=0)
        start = time.perf_counter()
        self._trial.advance()
        self.editor.device.ctx.finish()
        self._spent.append((time.perf_counter() - start) * 1e3)
        if len(self._spent) == TRIALS:
            self._trial.release()
            self._trial = None
            # The first ones compile; the quickest is the one that nobody else's work has slowed down.
            self._measured = min(self._spent[2:])
            self.opened()

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
                slow = dt > 1.2 / WANTED
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

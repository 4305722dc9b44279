"""Rehearsal: what a hand may do first is done ahead, unseen, since drivers compile shaders at their first use."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from math import ceil
from typing import Any

import numpy as np

from app.errors import UserError
from app.media.auxiliary import Pictures
from app.model.handles import RecipeHandle, RecipePin
from app.model.mask_edits import MaskStroke
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.model.strokes import Stroke
from app.ui.canvas import MOVING
from app.ui.viewport import Viewport
from app.ui.workspace import Workspace
from app.work.handle_status import held_in
from app.work.replay import Replay
from solver.gl.device import Device
from solver.gl.field import GraphicsMemoryError
from solver.gl.tiled import TILE

# Pixels along the longer side of the picture that is moved, at least: a map of fewer tiles is remapped at once.
PIXELS = 4 * TILE
TICKS = 10  # of each part; by then its picture is moved so far that the map has three levels
CLOSED = 3  # maps, as many as half a minute of stirring closes

PUSH = Stroke(tool="push", radius=0.1, samples=((0, 0.2, 0.5, 1.0), (TICKS, 0.9, 0.5, 1.0)))
AROUND = ((0, 0.5, 0.4, 1.0), (1, 0.5, 0.5, 1.0))


@dataclass(frozen=True)
class Part:
    """Something to do for the first time.

    Attributes:
        parts: of a recipe.
        is_for: whether a recipe needs it.
        closed: how many maps are closed before.
    """

    parts: dict[str, Any]
    is_for: Callable[[Recipe], bool]
    closed: int = 0


PARTS = (
    Part({"stroke": (PUSH,)}, lambda recipe: True),
    Part(
        {"handle": (RecipeHandle(at=(0.3, 0.5), to=(0.5, 0.5), duration=0.1),), "pin": (RecipePin(at=(0.7, 0.5)),)},
        lambda recipe: recipe.leads,
    ),
    Part(
        {
            "mask": tuple(
                MaskStroke(kind="stroke", tool=tool, radius=0.1, samples=AROUND) for tool in ("freeze", "thicken")
            ),
            "stroke": (PUSH,),
        },
        lambda recipe: bool(recipe.mask or recipe.viscosity or recipe.freeze),
    ),
    *(Part({"stroke": (PUSH,)}, lambda recipe: False, closed) for closed in range(1, CLOSED + 1)),
)


class Interrupted(Exception):
    """The person has pressed something, or let it go."""


class Rehearsal:
    """Lets a driver compile what the first stroke, handle and mask need, in frames that a press interrupts.

    A driver compiles a program as it first draws with it, and once more for some shapes of textures: half a second to
    three in the frame of a first stroke, which hears nothing meanwhile. What no frame has heard of is in no journal
    either. Here it is done while nothing moves; and where the person begins before that, strokes wait for it.

    Args:
        workspace: another simulation is made by the settings of its own, and a picture of nothing moved by it.

    Attributes:
        has_news: tells whether something has been pressed, or let go, that no frame has heard of; None where nobody
            presses.
        trial: that simulation, while it is made.
    """

    def __init__(self, workspace: Workspace) -> None:
        self.has_news: Callable[[], bool] | None = None
        self._workspace = workspace
        self._grid: tuple[int, int] | None = None
        self._left: list[Part] = []
        self.trial: Replay | None = None
        self._of: Part | None = None  # of which it is

    @property
    def is_wanted(self) -> bool:
        """Something has not been done yet, and there is time for it."""
        return self.has_news is not None and not self._workspace.session.is_moving and bool(self._ahead)

    @property
    def is_needed(self) -> bool:
        """The simulation has to wait for it."""
        session = self._workspace.session
        if self.has_news is None or not session.is_moving:
            return False
        return any(part.is_for(session.recipe) for part in self._ahead)

    @property
    def _ahead(self) -> list[Part]:
        """What has not been done yet on the grid of what is open."""
        return self._left if self._workspace.session.replay.grid.size == self._grid else list(PARTS)

    def go_on(self) -> None:
        """Do a tick of it: of what the simulation waits for, if there is such a thing."""
        session = self._workspace.session
        across, down = grid = session.replay.grid.size
        if grid != self._grid:
            self.release()
            self._grid, self._left = grid, list(PARTS)
        part = next((part for part in self._left if session.is_moving and part.is_for(session.recipe)), self._left[0])
        if part is not self._of:
            self.release()
        try:
            with self.interruptible(session.device):
                if self.trial is None:
                    self._of, recipe = part, Recipe(fluid=session.recipe.fluid, **part.parts)
                    finer = ceil(PIXELS / max(grid))
                    plain = Picture(np.zeros((finer * down, finer * across, 3), np.uint8))
                    self.trial = Replay(session.device, recipe, Pictures(plain), budget=0)
                    for _ in range(part.closed):
                        self.trial.warp.close()
                self.trial.advance()
                held_in(self.trial)
                look_at(self.trial, self._workspace.view)
                if self.trial.tick == TICKS:
                    self.trial.warp.close()  # what is left of a remap is done at once
        except Interrupted:
            self.release()
            return
        except (UserError, GraphicsMemoryError):  # which the person is told of who really does it
            self._left.clear()
            self.release()
            return
        if self.trial.tick >= TICKS:
            self._left.remove(part)
            self.release()

    @contextmanager
    def interruptible(self, device: Device) -> Iterator[None]:
        """What is drawn in the block is given up, by `Interrupted`, when the person presses something."""

        def look() -> None:
            if self.has_news is not None and self.has_news():
                raise Interrupted

        device.watch = look
        try:
            yield
        finally:
            device.watch = None

    def release(self) -> None:
        """Give up what is under way."""
        if self.trial is not None:
            self.trial.release()
            self.trial = None


def look_at(replay: Replay, view: Viewport) -> None:
    """Draw the map as the canvas has it drawn while things move."""
    width, height = (max(1, round(side * view.density / MOVING)) for side in (view.canvas.width, view.canvas.height))
    field = replay.device.field((width, height), 2, "displacement, tried")
    replay.warp.draw(field, (0.0, 0.0), (1 / width, 1 / height), coarsely=True)
    field.release()

"""Automatic quality: as fine a grid as this machine can paint on."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from app.ui.editor import Editor

GRIDS = (96, 128, 192, 256, 384, 512)
PATIENCE = 1.5  # seconds below the wanted rate before something is done about it
WANTED = 30.0  # frames a second while painting


class Quality:
    """Chooses the grid when something is opened, and a coarser one when painting is slow."""

    def __init__(self, editor: Editor) -> None:
        self.editor = editor
        self._slow_for = 0.0
        self._frames = 0
        self._last = 0.0
        self._pending = False

    def opened(self) -> None:
        """Something new is open; an untouched picture is given the grid that did well last time."""
        self._slow_for, self._pending = 0.0, False
        known, session = self.editor.preferences.grid, self.editor.session
        if self.editor.state.auto_quality and known in GRIDS and not session.end and known < session.recipe.fluid.grid:
            session.set_grid(known)
            session.settle()

    def look(self, dt: float) -> None:
        """Watch the rate while the person paints; a coarser grid is taken when the stroke is finished."""
        editor = self.editor
        now = time.perf_counter()
        spent, self._last = now - self._last, now
        if not editor.state.auto_quality:
            return
        if editor.session.is_painting:
            # A hiccup, such as a shader that is compiled, is no slow machine.
            if spent < 0.25:
                slow = spent > 1.2 / WANTED
                self._slow_for = min(max(self._slow_for + (spent if slow else -spent), 0.0), 3.0)
            self._pending = self._pending or self._slow_for > PATIENCE
        elif self._pending and not editor.session.is_moving:
            self._pending, self._slow_for = False, 0.0
            self._coarsen()

    def _coarsen(self) -> None:
        editor = self.editor
        now = editor.session.recipe.fluid.grid
        coarser = [grid for grid in GRIDS if grid < now]
        if not coarser:
            return
        editor.session.set_grid(coarser[-1], f"Grid of {coarser[-1]}")
        editor.preferences.grid = coarser[-1]
        editor.preferences.save()
        editor.messages.say(
            f"Painting fell below {WANTED:.0f} frames a second, so the grid is now {coarser[-1]} cells instead "
            f"of {now}. Quality in the inspector changes it."
        )

"""Edits of the recipe, each an entry of the history; what they make of its parts is in `app/model/edits.py`."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from math import ceil
from typing import Any

from app.errors import UserError
from app.media.project import Project
from app.model.bars import Changed, Which, check_length, with_changed
from app.model.edits import check_size, with_change, with_led
from app.model.handles import ARRIVED, RecipeHandle, RecipePin
from app.model.mask_edits import MaskEdit
from app.model.recipe import Recipe
from app.model.windows import with_detail
from app.work.handle_status import held_in
from app.work.painting import Painting
from solver.gl.device import Device


class Editing(Painting):
    """A recording that is edited. Every edit ends the gesture that is open, and what it changes is simulated again."""

    def __init__(self, device: Device, project: Project) -> None:
        super().__init__(device, project)
        # The state that the next joined edit goes on from, and the bars that it is of.
        self._joined: tuple[Recipe, frozenset[Which]] | None = None

    def edit_masks(self, name: str, *edits: MaskEdit, commit: bool = True) -> None:
        """Do something to masks, in no time: where the recording ends, or the playhead was sent back to.

        Args:
            edits: whatever their ticks.
            commit: as an entry of the history; not while a slider is dragged, for which what moves stands still.

        Raises:
            UserError: what is wrong with it on this picture.
        """
        self.release()
        self.playing = False
        tick = self._go_on()
        self.coasting &= commit
        if not self.coasting:
            self._send(tick)
        if self._live is self._base:
            self.replay.checkpoint()
        self._keep_masks(name, *(edit.model_copy(update={"tick": tick}) for edit in edits), commit=commit)

    def change(self, name: str, **settings: Any) -> None:
        """Set something from the playhead on: viscosity, drag, walls, clear_velocity, reset_warp, clear_masks."""
        self.preview_change(**settings)
        self.commit(name)
        if self._last is None:  # an edit of nothing lets nothing go on
            return
        if self.tick == self.end - 1:
            self._arrive()
        if self.end and (self.is_behind or self._is_fast()):
            self._coast()

    def preview_change(self, **settings: Any) -> None:
        """As `change`, without an entry in the history yet: for a slider that is being dragged."""
        self.release()
        base, lasts = self._base, settings.keys() <= {"viscosity", "drag", "walls"}
        if not (base.stroke or base.change or (base.mask and self.end)) and self.target == 0 and lasts:
            self._use_edited(base.edited(fluid=base.fluid.model_copy(update=settings)))
            return
        saved, tick = self.document.recipe, self.next_tick
        fluid = saved.fluid_at(tick)
        if lasts and fluid.model_copy(update=settings) == fluid:  # what is set to what it is already is no edit
            self._use_edited(saved)
            if base != saved:  # a slider that is dragged back gives back what it had cut off
                self._base, self.notice = saved, None
                self.retracted += 1
                self._go_back(tick)
            return
        tick = self._go_on()
        self.playing = self.coasting = False
        self._use_edited(with_change(self._base, tick, settings, lasts))
        self._changes_at = tick
        self._send(self.end)

    def preview(self, **parts: Any) -> None:
        """Replace parts of the recipe, without an entry in the history yet."""
        self.release()
        self._use_edited(self._base.edited(**parts))

    def edit(self, name: str, **parts: Any) -> None:
        """Replace parts of the recipe, as one entry of the history."""
        self.preview(**parts)
        self.commit(name)

    def edit_bars(
        self, name: str, which: Collection[Which], changed: Changed, commit: bool = True, joined: bool = False
    ) -> None:
        """Put others in the place of strokes and forces, or nothing; what comes after them is made again.

        Args:
            commit: as an entry of the history; not while a slider is dragged.
            joined: as the same entry as the edit before, if that was joined too: for a key that is pressed again.

        Raises:
            UserError: if it would take too long, or a force cannot be made.
        """
        self.release()
        recipe = self._base.edited(**with_changed(self._base, which, changed))
        check_size(recipe, self._base)
        self.replay.check_forces(recipe)
        at_end, coasts = self.target >= self.end, self.coasting
        self.coasting = False
        self._use(recipe)
        if at_end:
            self._send(self.end)
        self._went_back &= self.target < self.end
        if not commit:
            return
        history, those = self.document.history, frozenset(which)
        goes_on = joined and self._joined is not None and self._joined[0] is history.recipe and self._joined[1] == those
        if goes_on:
            history.amend(recipe)
        self.commit(name)
        self._joined = (history.recipe, those) if joined and (goes_on or self._last) else None
        if coasts:
            self._last = self._last and replace(self._last, coasts_on=True)
            self._coast()

    def edit_held(self, name: str, label: str, commit: bool = True, **settings: Any) -> None:
        """Set something about the handle or pin that messages call so, from its start on, and let it arrive.

        Args:
            commit: as an entry of the history; not while a slider is dragged.

        Raises:
            UserError: if it would take too long to arrive.
        """
        self.release()

        def changed(led: RecipeHandle | RecipePin) -> RecipeHandle | RecipePin:
            led = led.model_copy(update=settings)
            return with_detail(led, self._live, self.extent) if "radius" in settings else led

        parts = with_led(self._live, label, changed)
        last = max((handle.last for handle in parts["handle"] if handle.turns), default=0.0)
        if lasts := last > self._base.duration:
            check_length(ticks := ceil(last / self.dt) + 1)
            parts["duration"] = ticks * self.dt
        self.preview(**parts)
        if lasts:
            self._send(self.end)
            self._went_back = False
        if commit:
            self.commit(name)
            # An edit of nothing lets nothing arrive, and so must not make the recording longer.
            if self._last and self.target == self.end and (self.is_behind or self._is_away()):
                self._coast()

    def _is_away(self) -> bool:
        """Something is not yet where the recipe leads it, at the playhead."""
        self._take_up()
        return any(held.left > ARRIVED for held in held_in(self.replay))

    def let_go(self, label: str) -> None:
        """Take a handle or a pin away, as if it had never been."""
        self.release()
        self.edit(f"Remove {label.partition('[')[0]}", **with_led(self._live, label, lambda _: None))

    def start_from_map(self, name: str | None) -> None:
        """Begin with a warp map instead of the picture as it is, or, None, as it is again; an entry of the history.

        Raises:
            UserError: if it cannot be read, or does not fit the picture or the machine.
        """
        self.release()
        recipe = self._base.edited(map=name)
        if name is not None:
            self.pictures.forget(name)
            height, width = self.pictures.load_map(name).shape[:2]
            most = self.device.limits.max_texture_size
            if min(width, height) < 6 or max(width, height) > most:
                raise UserError(f"{name} is {width} x {height}: a map to begin with has from 6 to {most} along a side")
            recipe.checked(name)
        if recipe.map == self._live.map:
            # The same name, and perhaps another file by now.
            self.preview(map=None)
        self.edit("Start from a map" if name else "Start from the picture", map=name)

    def begin_with(self, **fluid: Any) -> None:
        """Other settings of the fluid for work that has not begun yet: no edit, and nothing to save."""
        if self.has_begun:
            return
        recipe = self._live.edited(fluid=self._live.fluid.model_copy(update=fluid))
        recipe = recipe.edited(duration=recipe.fluid.dt)
        self.document.begin_with(recipe)
        self._base = recipe
        self._use(recipe)
        self._target = None

    def undo(self) -> str | None:
        """Take back the last edit; its name."""
        self.release()
        name = self.document.history.undo_name
        if name is not None:
            self._show(self.document.history.undo())
        return name

    def redo(self) -> str | None:
        """Make an edit again that was taken back; its name."""
        self.release()
        name = self.document.history.redo_name
        if name is not None:
            self._show(self.document.history.redo())
        return name

    def go_to(self, index: int) -> None:
        """Any state of the history."""
        self.release()
        self._show(self.document.history.go_to(index))

"""Gestures: from the press of a pointer to its release they become strokes, masks and handles of the recipe."""

from __future__ import annotations

from dataclasses import replace
from math import ceil

import numpy as np

from app.errors import UserError
from app.media.project import Project
from app.model.edits import LONGEST_GESTURE, check_room, check_size, with_made, with_taken
from app.model.handles import RecipeHandle, RecipePin, is_inside
from app.model.mask_edits import MaskEdit, MaskStroke, with_edit
from app.model.sampling import Point
from app.model.strokes import Stroke
from app.model.tools import Press, Tool, Touch
from app.model.windows import detail_for, with_detail
from app.work.gesture import OpenGesture, kept_near
from app.work.handle_status import Held
from app.work.recording import Recording
from solver.gl.device import Device


class Painting(Recording):
    """A recording that the pointer works on; what a gesture makes of its samples is in `gesture.py`."""

    def __init__(self, device: Device, project: Project) -> None:
        super().__init__(device, project)
        self.last_place: tuple[float, float] | None = None
        self._plays_on = False  # a clip that was being played is played again once all has come to rest

    def press(
        self,
        tool: Tool,
        press: Press,
        x: float,
        y: float,
        pressure: float = 1.0,
        shift: bool = False,
        held: Held | None = None,
    ) -> None:
        """The pointer went down at (x, y), fractions of the picture: a gesture begins, and time with it.

        While time stands still, it goes on to do so for a tool that paints masks. Where strokes before it are not yet
        simulated to their ends, it is recorded behind them.

        Args:
            held: what was taken hold of, by a tool that does that.

        Raises:
            UserError: if there is nothing to take hold of, too much is held already, or the work is too large.
        """
        if tool.gesture is None:
            return
        self.release()
        check_size(self._base)
        if held is not None and not self._can_take(held.led):
            return
        if tool.name == "handle" and held is None:
            check_room(self._base, line=shift)
            press = replace(press, at=self._under(x, y), under=self._original)
        stands, came_from = not self.is_moving, self.moment
        self._plays_on = self.project.clip is not None and (self.playing or (self.coasting and self._plays_on))
        self.playing = False
        pen, taken = self._go_on(), None
        stands &= pen == self.tick
        idles_at = came_from if tool.name == "push" and stands and self._is_at_rest() else None
        press = replace(press, timeless=tool.masks and stands)
        if held is not None:
            self._base, taken = with_taken(self._base, held.led, pen)
            press = replace(press, held=self._base.handle[taken], rests=held.target)
        self._target = None
        detail = detail_for(press.brush.radius, self._base, self._base.fluid_at(pen))
        base, extent = self._base, self.extent
        press = replace(press, last=self.last_place, detail=detail, finely=lambda led: with_detail(led, base, extent))
        touch = Touch(pen, *kept_near(x, y), pressure, shift)
        self._gesture = OpenGesture(tool, press, touch, self.extent, taken, idles_at)
        self.replay.checkpoint()
        self._gesture.begin()
        self._hear(self._gesture)

    def move(self, x: float, y: float, pressure: float = 1.0, shift: bool = False) -> None:
        """The pointer moved to (x, y), fractions of the picture; every sample counts."""
        if self._gesture is not None:
            self._gesture.move(x, y, pressure, shift)
            self._hear(self._gesture)
            self._end_if_long(self._gesture)

    def _end_if_long(self, gesture: OpenGesture) -> None:
        """End a gesture of as many moves, or of as many ticks, as one may have; a pen held still makes no moves."""
        if max(len(gesture.path), gesture.ticks) >= LONGEST_GESTURE:
            self.release()
            self.notice = "This stroke has reached its greatest length. Press again to continue."

    def release(self) -> None:
        """The pointer went up: the gesture becomes an entry of the history, and the fluid comes to rest by itself."""
        if self._gesture is None:
            return
        for _ in self._gesture.catch_up(self.dt):
            self._hear(self._gesture)
        self._take_up()
        gesture, self._gesture = self._gesture, None
        made = gesture.end()
        if gesture.idles_at is not None and isinstance(made, Stroke) and made.stays:
            made, self.last_place = None, gesture.path[-1]
        if made is None:
            if not self.coasting:
                self._show(self.document.recipe)
            if gesture.idles_at is not None:
                self._go_back(gesture.idles_at)
            return
        if isinstance(made, (Stroke, MaskStroke)):
            self.last_place, last = gesture.path[-1], made.last_tick
        else:
            last = max(made.first_tick(self.dt), ceil(made.last / self.dt - 0.5))
        try:
            if isinstance(made, MaskStroke):
                self._keep_masks(gesture.label_of(made), made)
                return
            recipe = with_made(self._base, made, max(gesture.pen, last + 1), gesture.taken)
            check_size(recipe, self._base)  # others may go on behind the recording's end, and act with it
        except UserError:
            self._show(self.document.recipe)
            raise
        self._live = recipe
        self.replay.use(self._live)
        self.commit(gesture.label_of(made))
        self._coast()

    def cancel(self) -> None:
        """Give up the gesture, as if it had not been."""
        if self._gesture is None:
            return
        self._take_up()
        self._gesture, coasting = None, self.coasting
        self._show(self.document.recipe)
        if coasting:
            self._coast()

    def _hear(self, gesture: OpenGesture) -> None:
        if gesture.made is not None:
            self._live = with_made(self._base, gesture.made, gesture.pen + 1, gesture.taken)
            self._is_heard = self._is_timeless
        self.changes += 1

    def _hold(self) -> None:
        """A tick of the hand: the open stroke stays where the pointer is."""
        if self._gesture is not None:
            if self._gesture.hold():
                self._hear(self._gesture)
            self._gesture.pen += 1

    def _paint_masks(self) -> None:
        """A tick of the hand, in which no time goes on: what it has painted is seen."""
        self._hold()
        assert self._gesture is not None
        assert isinstance(self._gesture.made, MaskStroke)
        if painted := self._gesture.made.before(self._gesture.pen):
            self.replay.use(with_made(self._base, painted, 0))

    def _keep_masks(self, name: str, *edits: MaskEdit, commit: bool = True) -> None:
        masks = self._base.mask
        for edit in edits:
            masks = with_edit(masks, edit)
        recipe = self._base.edited(mask=masks)
        check_size(recipe, self._base)
        try:
            self.replay.use(recipe, keep=self._live is self._base)
        except UserError:
            self.replay.use(self._live)
            raise
        self._live = recipe
        self.changes += 1
        if commit:
            self.commit(name)

    def _under(self, x: float, y: float) -> Point:
        """The place in the original of what is seen at a place."""
        (at,) = self._original([(x, y)])
        if not is_inside((x, y)) or not is_inside(at):
            raise UserError("There is nothing of the picture here to take hold of.")
        return at

    def _original(self, seen: list[Point]) -> list[Point]:
        """The places in the original of what is seen at places."""
        moved = np.array(seen) + self.replay.warp.at(np.multiply(seen, self.extent)) / self.extent
        return [(round(float(x), 6), round(float(y), 6)) for x, y in moved]

    def _can_take(self, led: RecipeHandle | RecipePin) -> bool:
        """True if it is still there, and has begun where what is done next begins."""
        return led in (*self._live.handle, *self._live.pin) and led.first_tick(self.dt) < self.next_tick

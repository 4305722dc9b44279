"""Time of a recording: it goes on while something moves, and what has been recorded is played."""

from __future__ import annotations

import time

from app.errors import UserError
from app.media.project import Project
from app.work.editing import Editing
from app.work.handle_status import is_awaited
from solver.gl.device import Device

LOOK_EVERY = 5  # ticks between two looks at whether the fluid is at rest; each waits for the GPU
MOST_COASTING = 60.0  # seconds
PATIENCE = 0.05  # seconds of a frame for getting to where the playhead was sent
QUICK = 0.01  # seconds a tick may take for another one in the same frame: rather a slower fluid than fewer frames


class Playing(Editing):
    """A recording in time.

    Attributes:
        loops: the recording begins anew where it ends, as it does there and back again with its `time.ping_pong`.
    """

    def __init__(self, device: Device, project: Project) -> None:
        super().__init__(device, project)
        self.loops = False
        self._backwards = False  # it is played from its end to its start

    def advance(self, ticks: int) -> None:
        """Let time go on by up to `ticks`, but always by one; on the way to the playhead's target, by what it takes.

        Raises:
            UserError: if the map could not follow a force; time stands still before it.
        """
        try:
            self._advance(ticks)
        except UserError:
            self.playing = self.coasting = self.is_rebuilding = False
            self._target = None
            self.changes += 1
            raise

    def _advance(self, ticks: int) -> None:
        start = time.perf_counter()
        if self._target is not None:
            self._approach(start + PATIENCE)
            return
        while ticks > 0 or self.is_behind:
            if self._gesture is not None:
                self._end_if_long(self._gesture)
            if self._is_timeless:
                self._paint_masks()
            elif self.is_painting and ticks > 0 and (self.made is not None or self.coasting):
                self._record()
            elif self.is_behind:
                self._step()
            elif self.coasting:
                self._record()
                self._look_for_rest()
            elif self.playing and (self.moment < self.length or self._repeats):
                self._play_on()
            else:
                self.playing = False
                break
            ticks -= 1
            if time.perf_counter() - start > QUICK:
                break
        if not self.is_behind:
            self.is_rebuilding = False

    def play(self) -> None:
        """Play the recording, from the start when it is at its end; while the fluid moves, pause."""
        self.release()
        if self.coasting or self.playing or (self._target is not None and not self._went_back):
            self.pause()
        elif not self._went_back and self.tick < self.end:
            self._finish()
        elif self.end and self.moment == self.end and self._is_fast() and not self._repeats:
            self._plays_on = self.project.clip is not None
            self._coast()
        elif self.length:
            self._backwards = False
            if self.moment >= self.length:
                self.seek(0)
            self.playing = True

    @property
    def _repeats(self) -> bool:
        return self.length > 0 and (self.loops or self._returns)

    @property
    def _returns(self) -> bool:
        """It is played there and back again, as no clip is."""
        return self._live.time.ping_pong and self.project.clip is None

    def _play_on(self) -> None:
        """A tick of the recording, on or back; after its end it begins anew, or turns."""
        goes_back = self._returns
        self._backwards = goes_back and (self.tick >= self.end or (self._backwards and self.tick > 0))
        if self._backwards:
            self.replay.seek(self.tick - 1)
        elif self.tick < self.end:
            self._step()
        elif self.moment < self.length:
            self._beyond += 1
        else:
            self._beyond = 0
            self.replay.seek(0)
        self._went_back = self.tick < self.end
        self.changes += 1

    def repeat(self, loops: bool, returns: bool) -> None:
        """Play the recording over and over, or not; `returns`: there and back again, in what is exported too."""
        self.loops = loops
        if returns != self._live.time.ping_pong:
            name = "Ping-pong" if returns else "One way"
            self.edit(name, time=self._live.time.model_copy(update={"ping_pong": returns}))

    def pause(self) -> None:
        """Let time stand still, also while strokes are waiting; a playhead that was sent back still arrives."""
        self.release()
        self.playing = self.coasting = False
        if not self._went_back and not self.is_rebuilding:
            self._target = None
        self.changes += 1

    def stop_recording(self) -> None:
        """Let time stand still at the end of all that has been done; what is still waiting is simulated."""
        self.release()
        self.playing = self.coasting = False
        if not self._went_back:
            self._send(self.end)
        self.changes += 1

    def step(self) -> None:
        """One tick forward; at the end of the recording, it is recorded."""
        self.pause()
        self._arrive()
        if self.tick < self.end:
            self._step()
        elif self.moment < self.length:
            self._beyond += 1
        elif self.end:
            self._record()

    def retract(self) -> None:
        """Take back what was committed last, if it changed anything, as if it had never been: it cannot be redone.

        The playhead stays where it is, or goes back to where a setting was changed: the hand goes on with that there.
        What has been played all along, as with the amount, plays on, and fluid that has coasted coasts on.
        """
        if (last := self._last) is not None:
            tick = self.moment if last.changed_at is None else last.changed_at
            plays, coasts = self.playing, self.coasting and last.coasts_on
            self.release()
            self.notice = None
            self.retracted += 1
            self._show(self.document.history.retract())
            self.seek(min(tick, self.end) if coasts else tick)
            self.playing = plays
            if coasts:
                self._coast()

    def seek(self, tick: int) -> None:
        """Send the playhead to a tick of the recording; it arrives over the next frames."""
        self.release()
        self._go_back(tick)

    def settle(self, patience: float = 600.0) -> None:
        """Let everything that moves come to rest, at once, within `patience` seconds: for saving, for tests."""
        deadline = time.perf_counter() + patience
        self._arrive()
        while self.coasting and time.perf_counter() < deadline:
            self.advance(1)

    def _finish(self) -> None:
        """Go on through what is waiting; the fluid comes to rest by itself if it ends with a stroke."""
        if any(stroke.end_tick + 1 >= self.end and not stroke.muted for stroke in self._live.stroke):
            self._coast()
        else:
            self._send(self.end)

    def _record(self) -> None:
        """One tick more than there has been, and a step; the open stroke stays where the pointer is.

        While strokes are waiting, a gesture is recorded as it would be without them: a tick for every step.
        """
        self._hold()
        ticks = self._gesture.pen if self._gesture is not None else self.tick + 1
        if self._live.ticks < ticks:
            longer, is_previewed = {"duration": ticks * self.dt}, self._live is not self._base
            end_together = self._base.ticks == self._live.ticks
            self._live = self._live.edited(**longer)
            self._is_heard = False
            if self.made is None and end_together:
                # What is previewed is no part of what was done before it: it becomes an entry of its own, and what it
                # has cut off stays in the one before. Where it ends elsewhere, only itself goes on.
                is_whole = self._base == self.document.recipe
                self._base = self._base.edited(**longer) if is_previewed else self._live
                if is_whole:
                    self.document.history.go_on(self._base)
        self._step()

    def _look_for_rest(self) -> None:
        self._coasted += 1
        if self._coasted % LOOK_EVERY:
            return
        if not (self._is_fast() or is_awaited(self.replay)) or self._coasted * self.dt > MOST_COASTING:
            self.coasting, self.playing = False, self._plays_on
            self.replay.checkpoint()
            self.changes += 1

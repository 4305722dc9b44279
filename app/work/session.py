"""Working on a document live: gestures become strokes, time goes on while something moves, every edit is kept.

Knows the solver and no window; the clock comes in from outside, as ticks. One long class: gestures, time and edits
all move the playhead. What a gesture makes is in `gesture.py`, what edits make of a recipe in `app/model/edits.py`.
"""

from __future__ import annotations

import time
from collections.abc import Collection
from dataclasses import replace
from fractions import Fraction
from itertools import islice
from math import ceil
from typing import Any

import numpy as np

from app.errors import UserError
from app.media.auxiliary import Pictures
from app.media.clip import Clip, rate_of
from app.media.project import Project
from app.model.bars import Changed, Which, with_changed
from app.model.document import Document
from app.model.edits import (
    LONGEST_GESTURE,
    TIMED,
    check_room,
    check_size,
    cut_off,
    with_change,
    with_led,
    with_made,
    with_taken,
)
from app.model.handles import ARRIVED, MOST_OBJECTIONS, RecipeHandle, RecipePin, is_inside, objections
from app.model.mask_edits import MaskEdit, MaskStroke, with_edit
from app.model.recipe import Recipe
from app.model.sampling import Point
from app.model.strokes import Stroke
from app.model.timeline import NEARLY, Timeline, moment_at
from app.model.tools import Made, Press, Tool, Touch
from app.model.windows import detail_for
from app.work.gesture import OpenGesture, kept_near
from app.work.held import FIT, Held, as_seen, held_in, unmet
from app.work.replay import Replay
from solver.gl.device import Device
from solver.warp.map import WarpMap
from solver.warp.scaled import ScaledMap

REST = 0.004  # longer sides a second: a pixel of a screen in four frames
LOOK_EVERY = 5  # ticks between two looks at whether the fluid is at rest; each waits for the GPU
KEEP_EVERY = 4  # ticks between checkpoints of what is recorded, for scrubbing
MOST_COASTING = 60.0  # seconds
BUDGET = 400 * 2**20  # bytes of texture memory for checkpoints
LEAST_BUDGET = BUDGET // 64  # with less, it is the grid that is too large
COARSEST = 32  # cells that a full graphics memory leaves
PATIENCE = 0.05  # seconds of a frame for getting to where the playhead was sent
RETURN = 0.08  # seconds of the frame in which another state of the history is asked for
QUICK = 0.01  # seconds a tick may take for another one in the same frame: rather a slower fluid than fewer frames


class Session:
    """A document being worked on, and its simulation at the playhead.

    Args:
        device: where it is simulated.
        project: what is worked on.

    Attributes:
        project: where it came from and is saved to.
        document: the recipe with all its edits.
        replay: the simulation.
        playing: the recording is being played.
        loops: the recording begins anew where it ends, as it does there and back again with its `time.ping_pong`.
        coasting: time goes on because the fluid still moves.
        is_rebuilding: all is made again on another grid; what is seen in between is of no interest.
        notice: something the person should hear of, for the window to take.
        is_grid_automatic: nobody has chosen the grid, and it may follow the machine.
        changes: grows with everything that changes what is seen.
        clip_frames: how many the clip has, as far as is known.
    """

    def __init__(self, device: Device, project: Project) -> None:
        self.device = device
        self.project = project
        self.document = Document(project.picture, project.recipe, project.path)
        self.pictures = Pictures(project.picture, project.folder, project.clip)
        self.replay = Replay(device, project.recipe, self.pictures, BUDGET)
        self.playing = False
        self.loops = False
        self.coasting = False
        self.notice: str | None = None
        self.changes = 0
        self.is_rebuilding = False
        self.is_grid_automatic = False
        self.last_place: tuple[float, float] | None = None
        self._gesture: OpenGesture | None = None
        self._is_heard = True  # the simulation knows all that the gesture has made
        # The person has sent the playhead back, and what is done next takes the place of what comes after it.
        self._went_back = False
        self._prepared: Replay | None = None  # the simulation on another grid, which is to take this one's place
        self._held: tuple[object, list[Held]] = (None, [])
        self._marks: tuple[object, list[Held]] = (None, [])
        self._objections: tuple[object, tuple[str, ...]] = (None, ())
        self._unmet: tuple[object, dict[str, str]] = (None, {})
        self._folds: tuple[object, tuple[int, int]] = (None, (0, 0))
        # What gestures and edits start from: the document's recipe, or that cut off at the playhead.
        self._base = project.recipe
        self._live = project.recipe
        self._target: int | None = self.end or None
        self._backwards = False  # it is played from its end to its start
        self.clip_frames = max((project.clip and project.clip.frames) or 1, 1)
        # Ticks from the recording's end to the playhead: a clip that is longer goes on with the last warp.
        self._beyond = 0
        self._plays_on = False  # a clip that was being played is played again once all has come to rest
        self._coasted = 0
        # The state that the next joined edit goes on from, and the bars that it is of.
        self._joined: tuple[Recipe, frozenset[Which]] | None = None
        self._has_committed = False  # the last commit was an edit, and not of nothing

    # -- what it is now ---------------------------------------------------------------------------------------------

    @property
    def recipe(self) -> Recipe:
        """The recipe as it is now, with the stroke that is open."""
        return self._live

    @property
    def seen(self) -> WarpMap | ScaledMap:
        """What the picture is seen through; all of the warp while a brush moves it."""
        return self.replay.warp if self.is_painting else self.replay.seen

    @property
    def tick(self) -> int:
        """The playhead."""
        return self.replay.tick

    @property
    def end(self) -> int:
        """Ticks recorded; 0 where nothing has been yet."""
        return self._live.recorded

    @property
    def length(self) -> int:
        """Ticks that there is something to see of: the recording's, or the clip's if that is longer."""
        return max(self.end, self._clip_ticks)

    @property
    def moment(self) -> int:
        """Where the playhead is or is going: `target`, or after the recording's end in a clip."""
        return self.target + self._beyond

    @property
    def clip_rate(self) -> Fraction:
        """Frames a second of the clip, or of an animation."""
        return rate_of(self.project.clip, self._live.output.fps)

    @property
    def frame(self) -> int:
        """The number of the clip's frame that belongs to the playhead; 0 of a picture."""
        clip = self.project.clip
        if clip is None:
            return 0
        timeline = Timeline.of(self._live) if self.end else Timeline(0, self.dt)
        moment = moment_at(timeline, self._live.time, float(self.clip_rate), self.moment)
        return min(clip.number_at(moment), clip.start + self.clip_frames - 1)

    @property
    def still(self) -> tuple[Clip, int] | None:
        """The clip and the number of its frame that belongs to the playhead; None of a picture."""
        clip = self.project.clip
        return None if clip is None else (clip, self.frame)

    @property
    def _clip_ticks(self) -> int:
        """Up to the clip's last frame."""
        clip = self.project.clip
        if clip is None:
            return 0
        last = clip.moment(clip.start + self.clip_frames - 1)
        return ceil(last / float(self.clip_rate) / self.dt - NEARLY)

    @property
    def has_begun(self) -> bool:
        """Something has been done."""
        return self.end > 0 or bool(self._live.mask)

    @property
    def dt(self) -> float:
        """Seconds a tick."""
        return self._live.fluid.dt

    @property
    def extent(self) -> tuple[float, float]:
        """(width, height) of the picture, the longer of them 1."""
        return self.replay.grid.extent

    @property
    def is_painting(self) -> bool:
        return self._gesture is not None

    @property
    def path(self) -> list[Point]:
        """Where the gesture that is under way has been, as fractions of the picture."""
        return self._gesture.path if self._gesture else []

    @property
    def made(self) -> Made | None:
        """The stroke that is open, or the handle in hand."""
        return self._gesture and self._gesture.made

    @property
    def is_moving(self) -> bool:
        """True while time goes on."""
        return self.playing or self.coasting or self.is_painting or self.is_behind

    @property
    def is_behind(self) -> bool:
        """True while the playhead is on its way: to where it was sent, or through strokes that are still waiting."""
        return self.target != self.tick

    @property
    def target(self) -> int:
        """Where the playhead is or is going."""
        if self._target is not None:
            return self._target
        if self._gesture is not None and not self._is_timeless:
            return self._gesture.pen
        return self.end if self.coasting else self.tick

    @property
    def _is_timeless(self) -> bool:
        """A mask is being painted, and no time goes on."""
        return isinstance(self.made, MaskStroke)

    @property
    def waiting(self) -> list[Stroke]:
        """The strokes that are drawn already, and that the simulation has not come to the end of."""
        if self._target is not None or not (self.is_painting or self.coasting):
            return []
        return [stroke for stroke in self._live.stroke if stroke.end_tick >= self.tick and not stroke.muted]

    # -- painting ---------------------------------------------------------------------------------------------------

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
        press = replace(press, last=self.last_place, detail=detail)
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
        """End what has as many moves, or ticks of holding still, as there is to be room for."""
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
                self.seek(gesture.idles_at)
            return
        if isinstance(made, (Stroke, MaskStroke)):
            self.last_place, last = gesture.path[-1], made.last_tick
        else:
            last = max(made.first_tick(self.dt), ceil(made.last / self.dt - 0.5))
        if isinstance(made, MaskStroke):
            try:
                self._keep_masks(gesture.label_of(made), made)
            except UserError:
                self._show(self.document.recipe)
                raise
            return
        self._live = with_made(self._base, made, max(gesture.pen, last + 1), gesture.taken)
        self.replay.use(self._live)
        self.commit(gesture.label_of(made))
        self._coast()

    def cancel(self) -> None:
        """Give up the gesture, as if it had not been."""
        if self._gesture is None:
            return
        self._take_up()
        self._gesture.close()
        self._gesture, coasting = None, self.coasting
        self._show(self.document.recipe)
        if coasting:
            self._coast()

    def _hear(self, gesture: OpenGesture) -> None:
        if gesture.made is not None:
            self._live = with_made(self._base, gesture.made, gesture.pen + 1, gesture.taken)
            self._is_heard = self._is_timeless
        self.changes += 1

    def _take_up(self) -> None:
        """Let the simulation know what the hand has done: once a step, however many samples of it there are."""
        if not self._is_heard:
            self._is_heard = True
            self.replay.use(self._live)

    # -- handles ----------------------------------------------------------------------------------------------------

    @property
    def held(self) -> list[Held]:
        """The handles and pins in force at the playhead; looking reads back from the GPU where something has moved."""
        self._take_up()
        replay = self.replay
        seen = replay, replay.recipe, replay.tick, replay.warp.version
        if self._held[0] != seen:
            self._held = seen, held_in(replay)
        return self._held[1]

    @property
    def marks(self) -> list[Held]:
        """`held`, where the picture is seen at its amount."""
        held, amount = self.held, 1.0 if self.is_painting else self.replay.recipe.amount
        if self._marks[0] != (seen := (self._held[0], amount)):
            self._marks = seen, held if amount == 1 else as_seen(held, self.replay)
        return self._marks[1]

    @property
    def objections(self) -> tuple[str, ...]:
        """What of the handles and pins cannot be met, by number, as the command line says it; but for what is being
        changed.
        """
        led = self.document.recipe.handle, self.document.recipe.pin
        if self._objections[0] != led:
            self._objections = led, tuple(islice(objections(*led, self.extent), MOST_OBJECTIONS))
        return self._objections[1]

    @property
    def unmet(self) -> dict[str, str]:
        """Which handles have come to rest, at the end, elsewhere than where they are led, and how the command line says
        it, by what messages call them; reads back from the GPU.
        """
        replay = self.replay
        if self.is_moving or self.tick != self.end or not replay.recipe.leads:
            return {}
        is_fitted = self.document.history.undo_name == FIT
        seen = replay, replay.recipe, replay.tick, replay.warp.version, is_fitted
        if self._unmet[0] != seen:
            self._unmet = seen, dict(unmet(replay, ARRIVED, is_fitted))
        return self._unmet[1]

    @property
    def folds(self) -> tuple[int, int]:
        """In how many places the warp folds over itself at this moment, and of how many, two a cell along each axis.

        Reads back from the GPU; an export, which may take longer, looks at more of them.
        """
        warp = self.replay.warp
        if warp.is_untouched:
            return 0, 0
        if self._folds[0] != (seen := (warp, warp.version)):
            width, height = warp.coarse_size
            found = warp.statistics((2 * width, 2 * height))
            self._folds = seen, (found.folds, found.places)
        return self._folds[1]

    def edit_held(self, name: str, label: str, commit: bool = True, **settings: Any) -> None:
        """Set something about the handle or pin that messages call so, from its start on, and let it arrive.

        `commit`: as an entry of the history; not while a slider is dragged.
        """
        parts = with_led(self._live, label, lambda led: led.model_copy(update=settings))
        last = max((handle.last for handle in parts["handle"] if handle.turns), default=0.0)
        if lasts := last > self._base.duration:
            parts["duration"] = (ceil(last / self.dt) + 1) * self.dt
        self.preview(**parts)
        if lasts:
            self._send(self.end)
        if commit:
            self.commit(name)
            if self.is_behind and self.target == self.end:
                self._coast()

    def let_go(self, label: str) -> None:
        """Take a handle or a pin away, as if it had never been."""
        self.release()
        parts = with_led(self._live, label, lambda _: None)
        if not parts["handle"]:
            parts["stop"] = self._base.stop.model_copy(update={"handles_within": None})
        self.edit(f"Remove {label.partition('[')[0]}", **parts)

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
        return led in (*self._live.handle, *self._live.pin) and led.first_tick(self.dt) < self._next

    # -- time -------------------------------------------------------------------------------------------------------

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

    def seek(self, tick: int) -> None:
        """Send the playhead to a tick of the recording; it arrives over the next frames."""
        self.release()
        self.playing = self.coasting = False
        moment = min(max(tick, 0), self.length)
        tick = min(moment, self.end)
        self._beyond, self._went_back = moment - tick, tick < self.end
        self._send(tick)
        self.changes += 1

    def settle(self, patience: float = 600.0) -> None:
        """Let everything that moves come to rest, at once, within `patience` seconds: for saving, for tests."""
        deadline = time.perf_counter() + patience
        self._arrive()
        while self.coasting and time.perf_counter() < deadline:
            self.advance(1)

    def _coast(self) -> None:
        self.coasting, self._coasted = True, 0
        self.changes += 1

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
            self._live = self._live.edited(duration=ticks * self.dt)
            self._is_heard = False
            if self.made is None:
                self.document.history.go_on(self._live)
                self._base = self._live
        self._step()

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

    def _step(self) -> None:
        self._take_up()
        self.replay.advance()
        if self.tick % KEEP_EVERY == 0:
            self.replay.checkpoint()
        self.changes += 1

    def _look_for_rest(self) -> None:
        self._coasted += 1
        if self._coasted % LOOK_EVERY:
            return
        if not self._is_fast() or self._coasted * self.dt > MOST_COASTING:
            self.coasting, self.playing = False, self._plays_on
            self.replay.checkpoint()
            self.changes += 1

    def _is_at_rest(self) -> bool:
        """Nothing happens by itself; else a brush that stays where it is holds what flows under it."""
        return not (self._base.force or self._base.leads or self._is_fast())

    def _is_fast(self) -> bool:
        return self.replay.fluid.motion().largest_speed > REST

    def _send(self, tick: int) -> None:
        """Let the playhead go to a tick over the next frames."""
        self._target = tick if tick != self.tick else None

    def _approach(self, deadline: float) -> None:
        """Work towards the target until the deadline, by way of the nearest checkpoint."""
        target = self._target
        if target is None:
            return
        self.replay.head_for(target)
        while self.tick < target:
            self._step()
            if time.perf_counter() > deadline:
                break
        self.changes += 1
        if self.tick == target:
            self._target, self.is_rebuilding = None, False

    def _arrive(self) -> None:
        while self._target is not None:
            self._approach(time.perf_counter() + 60)

    # -- edits ------------------------------------------------------------------------------------------------------

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

    def change(self, name: str, **settings: Any) -> None:
        """Set something from the playhead on: viscosity, drag, walls, clear_velocity, reset_warp, clear_masks."""
        self.preview_change(**settings)
        self.commit(name)
        if self.tick == self.end - 1:
            self._arrive()
        if self.end and (self.is_behind or self._is_fast()):
            self._coast()

    def preview_change(self, **settings: Any) -> None:
        """As `change`, without an entry in the history yet: for a slider that is being dragged."""
        self.release()
        base, lasts = self._base, settings.keys() <= {"viscosity", "drag", "walls"}
        if not (base.stroke or base.change or base.mask) and self.target == 0 and lasts:
            self._use_edited(base.edited(fluid=base.fluid.model_copy(update=settings)))
            return
        tick = self._go_on()
        self.playing = self.coasting = False
        self._use_edited(with_change(self._base, tick, settings, lasts))
        self._send(self.end)

    def preview(self, **parts: Any) -> None:
        """Replace parts of the recipe, without an entry in the history yet."""
        self.release()
        self._use_edited(self._base.edited(**parts))

    def commit(self, name: str) -> None:
        """Make what was previewed an entry of the history."""
        history = self.document.history
        before = history.recipe
        history.commit(name, self._live)
        self._has_committed = history.recipe is not before
        self._base = self._live
        self.changes += 1

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
        self._joined = (history.recipe, those) if joined and (goes_on or self._has_committed) else None
        if coasts:
            self._coast()

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

    def set_grid(self, cells: int, name: str = "Quality") -> None:
        """Simulate on another grid, by replaying all that has been done; from now on it is the person's choice."""
        self.is_grid_automatic = False
        self.forget_grid()
        if cells != self._live.fluid.grid:
            self.edit(name, fluid=self._live.fluid.model_copy(update={"grid": cells}))

    def prepare_grid(self, cells: int, seconds: float) -> bool:
        """Simulate on another grid too, for about `seconds`; True once it has come as far and taken this one's place.

        Until then everything stays as it is, and also then it is no edit.
        """
        recipe, start = self._live.on_grid(cells), time.perf_counter()
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
        self._base, self._live = self._base.on_grid(cells), recipe
        self.changes += 1
        return True

    def forget_grid(self) -> None:
        """Go on with this grid, whatever another one was prepared for."""
        if self._prepared is not None:
            self._prepared.release()
            self._prepared = None

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

    def retract(self) -> None:
        """Take back what was committed last, unless it had changed nothing: Undo would take what was done before it."""
        if self._has_committed:
            self.undo()

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

    def _show(self, recipe: Recipe) -> None:
        """Another state of the work, with the playhead at its end."""
        moment = self.moment
        self.playing = self.coasting = self._went_back = False
        self.replay.checkpoint()
        self._base = recipe
        self._use(recipe)
        self._beyond = max(min(moment, self.length) - self.end, 0)
        self._target = self.end
        self._approach(time.perf_counter() + RETURN)

    def _use_edited(self, recipe: Recipe) -> None:
        check_size(recipe, self._base)
        self._use(recipe)

    def _use(self, recipe: Recipe) -> None:
        """Simulate another recipe; what differs in the past is made again over the next frames."""
        before, replay = self._live, self.replay
        if recipe is before or recipe == before:
            self._live = recipe
            return
        tick = self.target
        if not recipe.is_set_up_as(before):
            self.is_rebuilding = tick > 0
            replay.seek(0)
        else:
            common = recipe.agrees_until(before)
            if common < replay.tick:
                replay.head_for(int(common))
        self._live = recipe
        replay.use(recipe)
        self._send(min(tick, self.end))
        self.changes += 1

    @property
    def _next(self) -> int:
        """The tick at which the next thing begins: behind all that is recorded, or where the playhead was sent to."""
        return self.target if self._went_back else self.end + self._beyond

    def _go_on(self) -> int:
        """Go where what is done next begins, and tell the tick; what was recorded after it is left to undo."""
        tick = self._next
        self.replay.head_for(tick)
        if tick < self.end:
            self._cut(tick)
        elif self._beyond:
            self._base = self._live = self._base.edited(duration=tick * self.dt)
            self.replay.use(self._base)
            self.replay.pass_time(tick)
            self._target = None if self.tick == tick else tick
        self._beyond, self._went_back = 0, False
        return tick

    def _cut(self, tick: int) -> None:
        before, cut = self._base, cut_off(self._base, tick)
        if any(getattr(cut, part) != getattr(before, part) for part in TIMED):
            self.notice = f"Going on from {tick * self.dt:.1f} s. What came after it is one Undo away."
        self._base = self._live = cut
        self.replay.use(cut)

    # -- numbers ----------------------------------------------------------------------------------------------------

    def divergence(self) -> float:
        """The largest divergence that is left, 1 / s; reads the velocity back."""
        return float(np.abs(self.replay.fluid.divergence()).max())

    def saved(self, project: Project) -> None:
        """Take note that the work has been saved as `project`: what is in the file is exported too, grid and all."""
        assert project.path is not None
        self.project = project
        self.is_grid_automatic = False
        self.forget_grid()
        self.document.saved(project.path)

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
            self._base, self._live = self._base.on_grid(cells), self._live.on_grid(cells)
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

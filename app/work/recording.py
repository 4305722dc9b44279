"""What is worked on, and its simulation at the playhead: the state that gestures, edits and playing share.

A document is worked on live by four layers, each of which knows only those below it: `Recording` is this, `Painting`
turns gestures into strokes, `Editing` changes the recipe, `Playing` lets time go on. `Session` is all of it. No layer
knows a window, and the clock comes in from outside, as ticks. This one is long, as it holds what the others share.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from fractions import Fraction
from math import ceil

from app.media.auxiliary import Pictures
from app.media.clip import Clip, rate_of
from app.media.project import Project
from app.model.document import Document
from app.model.edits import TIMED, check_size, cut_off
from app.model.mask_edits import MaskStroke
from app.model.recipe import Recipe
from app.model.sampling import Point
from app.model.strokes import Stroke
from app.model.timeline import NEARLY, Timeline, moment_at
from app.model.tools import BrushSettings, Made
from app.work.gesture import OpenGesture
from app.work.replay import Replay
from solver.gl.device import Device
from solver.warp.map import WarpMap
from solver.warp.scaled import ScaledMap

KEEP_EVERY = 4  # ticks between checkpoints of what is recorded, for scrubbing
# Bytes of texture memory for checkpoints: with a map of 12,000 x 9,000 pixels and with what OpenGL keeps for itself,
# the editor takes less than 1.4 GB beyond the picture and its file.
BUDGET = 256 * 2**20
REST = 0.004  # longer sides a second: a pixel of a screen in four frames
RETURN = 0.08  # seconds of the frame in which another state of the history is asked for


@dataclass(frozen=True)
class Committed:
    """An edit that was made an entry of the history.

    Attributes:
        changed_at: the tick at which it changes a setting; None if it changes none.
        coasts_on: it let the fluid coast on.
    """

    changed_at: int | None
    coasts_on: bool


class Recording:
    """A document being worked on, and its simulation at the playhead.

    Args:
        device: where it is simulated.
        project: what is worked on.

    Attributes:
        project: where it came from and is saved to.
        document: the recipe with all its edits.
        replay: the simulation.
        playing: the recording is being played.
        coasting: time goes on because the fluid still moves.
        is_rebuilding: all is made again on another grid; what is seen in between is of no interest.
        notice: something the person should hear of, for the window to take.
        retracted: how many edits, or previews of one, were taken back as if they had never been.
        changes: grows with everything that changes what is seen.
        clip_frames: how many the clip has, as far as is known.
    """

    def __init__(self, device: Device, project: Project) -> None:
        self.device = device
        self.project = project
        self.document = Document(project.recipe)
        self.pictures = Pictures(project.picture, project.folder, project.clip, project.label)
        self.replay = Replay(device, project.recipe, self.pictures, BUDGET)
        self.playing = False
        self.coasting = False
        self.notice: str | None = None
        self.retracted = 0
        self.changes = 0
        self.is_rebuilding = False
        self.clip_frames = max((project.clip and project.clip.frames) or 1, 1)
        self._gesture: OpenGesture | None = None
        self._is_heard = True  # the simulation knows all that the gesture has made
        # What gestures and edits start from: the document's recipe, or that cut off at the playhead.
        self._base = project.recipe
        self._live = project.recipe  # the recipe as it is now, with the stroke that is open
        self._target: int | None = self.end or None  # where the playhead was sent, until it has arrived
        # The person has sent the playhead back, and what is done next takes the place of what comes after it.
        self._went_back = False
        # Ticks from the recording's end to the playhead: a clip that is longer goes on with the last warp.
        self._beyond = 0
        self._coasted = 0
        self._last: Committed | None = None  # unless the last commit was of nothing, or another state is shown since
        self._changes_at: int | None = None  # the tick at which what is previewed changes a setting

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
    def brush(self) -> BrushSettings | None:
        """That of the gesture under way, which it keeps whatever is set meanwhile."""
        return self._gesture and self._gesture.brush

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

    # -- the playhead -------------------------------------------------------------------------------------------------

    def _is_at_rest(self) -> bool:
        """Nothing happens by itself; else a brush that stays where it is holds what flows under it."""
        return not (self._base.force or self._base.leads or self._is_fast())

    def _is_fast(self) -> bool:
        return self.replay.fluid.motion().largest_speed > REST

    def _coast(self) -> None:
        self.coasting, self._coasted = True, 0
        self.changes += 1

    def _take_up(self) -> None:
        """Let the simulation know what the hand has done: once a step, however many samples of it there are."""
        if not self._is_heard:
            self._is_heard = True
            self.replay.use(self._live)

    def _step(self) -> None:
        self._take_up()
        self.replay.advance()
        if self.tick % KEEP_EVERY == 0:
            self.replay.checkpoint()
        self.changes += 1

    def _send(self, tick: int) -> None:
        """Let the playhead go to a tick over the next frames."""
        self._target = tick if tick != self.tick else None

    def _go_back(self, tick: int) -> None:
        """Stop, and let the playhead go to a tick of the recording, or of a longer clip."""
        self.playing = self.coasting = False
        moment = min(max(tick, 0), self.length)
        tick = min(moment, self.end)
        self._beyond, self._went_back = moment - tick, tick < self.end
        self._send(tick)
        self.changes += 1

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

    @property
    def next_tick(self) -> int:
        """The tick at which the next thing begins: behind all that is recorded, or where the playhead was sent to.

        A setting that is dragged goes on to change where it did at first: at tick 0 that is before the recording's end.
        """
        if self._went_back:
            return self.target
        return self._base.recorded + self._beyond if self._changes_at is None else self._changes_at

    def _go_on(self) -> int:
        """Go where what is done next begins, and tell the tick; what was recorded after it is left to undo."""
        tick = self.next_tick
        if self._live is not self._base:  # what is previewed, and not kept, is no part of what is gone on from
            self._use(self._base)
        self.replay.head_for(tick)
        if tick < self.end:
            self._cut(tick)
        elif self._beyond:
            self._base = self._live = self._base.edited(duration=tick * self.dt)
            self.replay.use(self._base)
            self.replay.pass_time(tick)
            self._target = None if self.tick == tick else tick
        self._beyond, self._went_back, self._changes_at = 0, False, None
        return tick

    def _cut(self, tick: int) -> None:
        before, cut = self._base, cut_off(self._base, tick)
        kept = all(getattr(cut, part) == getattr(before, part) for part in TIMED if part != "change")
        if not kept or any(change.before(tick) != change for change in before.change):
            self.notice = f"Going on from {tick * self.dt:.1f} s. What came after it is one Undo away."
        self._base = self._live = cut
        self.replay.use(cut)

    # -- another recipe -----------------------------------------------------------------------------------------------

    def _use(self, recipe: Recipe) -> None:
        """Simulate another recipe; what differs in the past is made again over the next frames."""
        self._changes_at = None
        before, replay = self._live, self.replay
        if recipe is before or recipe == before:
            self._live = recipe
            return
        tick = self.target
        if not recipe.is_set_up_as(before):
            replay.grid_of(recipe)  # before anything is changed, as that may be refused
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

    def _use_edited(self, recipe: Recipe) -> None:
        check_size(recipe, self._base)
        self._use(recipe)

    def _show(self, recipe: Recipe) -> None:
        """Another state of the work, with the playhead at its end."""
        moment = self.moment
        self.playing = self.coasting = self._went_back = False
        self._last = None
        self.replay.checkpoint()
        self._base = recipe
        self._use(recipe)
        self._beyond = max(min(moment, self.length) - self.end, 0)
        self._target = self.end
        self._approach(time.perf_counter() + RETURN)

    def commit(self, name: str) -> None:
        """Make what was previewed an entry of the history."""
        history = self.document.history
        before = history.recipe
        history.commit(name, self._live)
        self._last = Committed(self._changes_at, self.coasting) if history.recipe is not before else None
        self._changes_at = None
        self._base = self._live
        self.changes += 1

"""Automatic quality: as fine a grid as this machine can paint on."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from statistics import median_low

from app.model.strokes import Stroke
from app.ui.editor_state import EditorState
from app.ui.export_dialog import Exports
from app.ui.files import Files, fresh_recipe, settings_of
from app.ui.fitting import Fits
from app.ui.messages import Messages
from app.ui.rehearsal import Interrupted, Rehearsal, look_at
from app.ui.workspace import Workspace
from app.work.recovery import Found
from app.work.replay import Replay
from app.work.session import Session

GRIDS = (96, 128, 160, 192, 256, 384)
PATIENCE = 1.5  # seconds below the wanted rate, or with time to spare, before something is done about it
HICCUP = 0.25  # seconds of one frame that count
AT_ONCE = 0.02  # seconds of a frame for preparing another grid
LONGEST = 120.0  # seconds that preparing one may take: a machine at rest should rest
WANTED = 60.0  # frames a second while painting, for which a grid is chosen;
LEAST = 30.0  # below so many, another one is
# Of a frame. Painting takes what is measured on a grid of `TRIALS` (31 to 35 ms of processor time, three strokes on 128
# cells, where 32 to 34 were measured), and up to a quarter more between them, as small grids are solved by transforms
# and others by iterations; and showing the frame and other programs want their part.
SPARE = 0.3
TRIALS = (256, 128)  # cells, of the grids that the machine is measured on
TICKS = 8  # on each of them, and as many frames without
COMPILING = 2  # of them, which are not measured
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
        """From what a frame takes with a tick on each of the two grids of `TRIALS`, and without one."""
        share = (TRIALS[1] / TRIALS[0]) ** 2
        growing = max(fine - coarse, 0.0) / (1 - share)
        return cls(max(fine - drawing - growing, 0.0), growing, drawing)

    def tick(self, grid: int) -> float:
        return self.fixed + self.growing * (grid / TRIALS[0]) ** 2

    @property
    def best_grid(self) -> int:
        """The finest grid on which painting reaches the wanted rate, with something to spare."""
        room = (1 - SPARE) * 1e3 / WANTED - self.drawing
        return max((grid for grid in GRIDS if self.tick(grid) <= room), default=GRIDS[0])


@dataclass
class Quality:
    """Chooses the grid when a picture is opened, and another one where painting is slow or has time to spare.

    Only as long as the person has not chosen one; and what is seen and the history stay as they are: another grid is
    prepared while nothing moves, and takes the place of this one when it is where this one is.

    Attributes:
        files, exports, fits: what is read, written and searched has the machine first.
        rehearsal: what is measured also compiles, and can be interrupted like it.
        speed: of this machine, once it has been measured.
        grid: that painting has been well on.
    """

    workspace: Workspace
    state: EditorState
    files: Files
    exports: Exports
    fits: Fits
    messages: Messages
    rehearsal: Rehearsal
    speed: Speed | None = None
    grid: int | None = None
    _session: Session | None = field(default=None, init=False)  # that is watched
    _wanted: int | None = field(default=None, init=False)
    _slow_for: float = field(default=0.0, init=False)
    _spare_for: float = field(default=0.0, init=False)
    _steps: int = field(default=0, init=False)
    _has_stepped: bool = field(default=False, init=False)
    _frames: int = field(default=0, init=False)
    _trial: Replay | None = field(default=None, init=False)
    # ms of frames that draw only, and of those with a tick on each grid of `TRIALS`.
    _spent: list[list[float]] = field(default_factory=lambda: [[]], init=False)

    @property
    def is_on(self) -> bool:
        """The grid of what is open follows the machine."""
        return self.state.auto_quality and self.workspace.session.is_grid_automatic

    def turn_on(self) -> None:
        """Let the grid of what is open follow the machine, whoever has chosen it."""
        self.state.auto_quality = self.workspace.session.is_grid_automatic = True
        self._begin()

    def opened(self, found: Found | None) -> None:
        """Something new is open; of an untouched picture, nobody has chosen the grid. `found`: what was restored."""
        session = self.workspace.session
        recipe = session.recipe
        fresh = recipe.edited(picture=None) == fresh_recipe(settings_of(recipe.fluid), recipe.fluid.dt)
        session.is_grid_automatic = fresh if found is None else found.work.is_grid_automatic
        self._begin()

    def _begin(self) -> None:
        """Take the grid that this machine does well on, as far as that is known."""
        session = self.workspace.session
        self._watch(session)
        if self.speed is None or self.grid is None or not self.is_on:
            return
        # Who has undone everything may want it back: what can be redone was made with the ticks as they are.
        if session.end == 0 and len(session.document.history.entries) == 1:
            dt = 1 / 60 if self.speed.tick(self.grid) < FAST else 1 / 30
            session.begin_with(grid=self.grid, dt=session.dt if session.project.clip else dt)
        elif session.recipe.fluid.grid != self.grid:
            self._wanted = self.grid

    def _watch(self, session: Session) -> None:
        """Begin to watch the rate anew, and to measure if that has not come to an end."""
        self._session, self._wanted = session, None
        self._steps, self._has_stepped = session.replay.steps, False
        self._slow_for = self._spare_for = 0.0
        if self.speed is None:
            self.release()
            self._frames, self._spent = 0, [[]]

    def release(self) -> None:
        """Give up what is being measured."""
        if self._trial is not None:
            self._trial.release()
            self._trial = None

    @property
    def is_measuring(self) -> bool:
        return self.is_on and self.speed is None

    def warm_up(self, begun: float) -> None:
        """After the first frames, one that paints each: compile what the first stroke needs, and measure this machine.

        A frame is measured as a whole, with the tick and with the map as the canvas has it drawn while things move, and
        waits for the GPU only at its end: while that works, the interface is laid out. `begun`: when the frame was, on
        `time.perf_counter`.
        """
        self._frames += 1
        session = self.workspace.session
        if self._frames < 2 or session.is_moving:
            return
        if self._trial is not None and len(self._spent[-1]) < COMPILING:
            try:
                with self.rehearsal.interruptible(session.device):
                    self._try()
            except Interrupted:
                self.release()
                self._trial, self._spent[-1] = self._new_trial(TRIALS[len(self._spent) - 2]), []
                return
        elif self._trial is not None:
            self._try()
        session.device.ctx.finish()
        self._spent[-1].append((time.perf_counter() - begun) * 1e3)
        if len(self._spent[-1]) < TICKS:
            return
        self.release()
        if len(self._spent) <= len(TRIALS):
            self._trial = self._new_trial(TRIALS[len(self._spent) - 1])
            self._spent.append([])
        else:
            drawing, fine, coarse = (median_low(frames[COMPILING:]) for frames in self._spent)
            self.speed = Speed.of(fine, coarse, drawing)
            self.grid = self.speed.best_grid
            self._begin()

    def _try(self) -> None:
        assert self._trial is not None
        self._trial.advance()
        look_at(self._trial, self.workspace.view)

    def _new_trial(self, grid: int) -> Replay:
        """A push of which the picture on the canvas knows nothing."""
        session = self.workspace.session
        stroke = Stroke(tool="push", radius=0.15, samples=((0, 0.4, 0.5, 1.0), (TICKS, 0.52, 0.5, 1.0)))
        fluid = session.recipe.fluid.model_copy(update={"grid": grid})
        recipe = session.recipe.edited(stroke=(stroke,), change=(), mask=(), force=(), handle=(), pin=(), fluid=fluid)
        return Replay(session.device, recipe, session.pictures, budget=0)

    def look(self, dt: float) -> None:
        """Watch the rate while the person paints; another grid is prepared when nothing moves.

        `dt`: seconds since the last frame.
        """
        session = self.workspace.session
        if session is not self._session or not self.is_on:
            self._watch(session)
        if not self.is_on:
            session.forget_grid()
        elif session.is_painting:
            self._judge(dt)
        if self.is_preparing:
            assert self._wanted is not None
            before = session.recipe.fluid.grid
            if session.prepare_grid(self._wanted, AT_ONCE):
                self.grid = self._wanted
                self._watch(session)
                if self.grid < before:
                    self.messages.say(
                        f"Painting fell below {LEAST:.0f} frames a second, so the grid is now {self.grid} cells "
                        f"instead of {before}. Detail in the inspector, under Picture and quality, changes it."
                    )

    @property
    def is_preparing(self) -> bool:
        """Another grid is wanted, and there is time for it."""
        elsewhere = self.files.is_loading or self.exports.is_running or self.fits.is_running
        busy = self.workspace.session.is_moving or elsewhere
        return self._wanted is not None and self.is_on and not busy

    def _judge(self, dt: float) -> None:
        """Learn from a frame while the person paints what grid would be better."""
        session = self.workspace.session
        # A hiccup, such as a shader that is compiled, is no slow machine.
        dt = min(dt, HICCUP)
        # `dt` is what the frame before took, so what was done in that one counts.
        has_stepped, self._has_stepped = self._has_stepped, session.replay.steps != self._steps
        self._steps = session.replay.steps
        now = session.recipe.fluid.grid
        coarser = max((grid for grid in GRIDS if grid < now), default=None)
        finer = min((grid for grid in GRIDS if grid > now), default=None)
        slow = dt > 1.1 / LEAST
        self._slow_for = min(max(self._slow_for + (dt if slow else -dt), 0.0), 2 * PATIENCE)
        if has_stepped and finer is not None and self.speed is not None:
            more = (self.speed.tick(finer) - self.speed.tick(now)) * 1e-3
            # A screen of 60 Hz sets the pace: whether there is time to spare, only what was measured tells.
            paced = dt < 1.1 / WANTED and finer <= self.speed.best_grid
            spare = paced or dt + more < (1 - SPARE) / WANTED
            self._spare_for = min(max(self._spare_for + (dt if spare else -dt), 0.0), 2 * PATIENCE)
        if self._slow_for > PATIENCE:
            self._wanted = coarser
        elif self._spare_for > PATIENCE:
            self._wanted = finer
        if self._wanted is not None and self._takes(self._wanted) > LONGEST:
            self._wanted = None

    def _takes(self, grid: int) -> float:
        """Seconds to simulate all that has been done on a grid."""
        return 0.0 if self.speed is None else self.workspace.session.tick * self.speed.tick(grid) * 1e-3

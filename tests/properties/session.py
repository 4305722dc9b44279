"""Random work in a session by hypothesis, beside a model of what a person expects of its history, files and journal."""

from __future__ import annotations

import tempfile
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from hypothesis import HealthCheck, seed, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)

from app.errors import UserError
from app.media.pictures import write_picture
from app.media.project import Project, from_picture, load, save
from app.model.bars import Actor, Which, bars, moved, named, stretched
from app.model.forces import VortexForce
from app.model.handles import labelled
from app.model.mask_edits import mask_edit
from app.model.presets import FEELS, Feel
from app.model.recipe import Recipe
from app.model.schema import frozen
from app.model.strokes import Stroke
from app.model.tools import TOOL, TOOLS, BrushSettings, Press
from app.model.undo import Entry
from app.model.windows import on_grid
from app.ui.files import fresh_recipe
from app.work.recovery import Found, Journal, find
from app.work.replay import Replay
from app.work.session import Session
from solver.gl.device import Device
from support.editing import pattern
from support.gl_objects import living

PLACES = st.tuples(st.floats(-0.1, 1.1), st.floats(-0.1, 1.1))
PARTS = st.floats(0, 1)
Way = tuple[tuple[float, float], tuple[float, float]]
WAYS = st.tuples(PLACES, PLACES)
TICKS = st.integers(1, 3)
ENDS = st.sampled_from(("rest", "rest", "rest", "on", "cancel"))
FLOWING = [tool.name for tool in TOOLS if tool.gesture is not None and not tool.masks and tool.name != "handle"]
MASKS = st.sampled_from(("frozen", "thickness"))
SELECTED: list[dict[str, Any]] = [
    {},
    {"window": {"box": [0.1, 0.2, 0.5, 0.6], "shape": "ellipse"}},
    {"outline": [[0.2, 0.1], [0.9, 0.4], [0.4, 0.9]]},
    {"segment": {"at": [0.4, 0.4], "above": 0.5}},
    {"window": {"box": [0, 0, 0.6, 1]}, "then": [{"combine": "subtract", "window": {"box": [0.2, 0, 0.4, 1]}}]},
]
WHOLE: list[dict[str, Any]] = [
    *({"kind": "fill", "amount": amount, **area} for area in SELECTED for amount in (1, 0)),
    {"kind": "invert"},
    {"kind": "feather", "radius": 0.2},
    {"kind": "grow", "radius": 0.1},
    {"kind": "shrink", "radius": 0.1},
    {"kind": "picture", "white": 0.8},
    {"kind": "clear"},
]
LASTING: list[dict[str, Any]] = [
    {"viscosity": 0.3}, {"drag": 20.0}, {"walls": "no-slip"},
    {"clear_velocity": True}, {"reset_warp": True}, {"clear_masks": True},
]  # fmt: skip
SET: list[dict[str, Any]] = [
    {"amount": 0.5}, {"amount": 1.3}, {"amount": 1.0}, {"edges": "mirror"}, {"edges": "black"}, {"seed": 3},
]  # fmt: skip
BARS: dict[str, Callable[[Actor, int, float], Actor | None]] = {
    "Move": moved,
    "Stretch": lambda one, by, dt: stretched(one, 2, 6 + abs(by), dt),
    "Mute": lambda one, by, dt: one.model_copy(update={"muted": not one.muted}),
    "Repeat": lambda one, by, dt: one.repeated(1 + abs(by) % 3, 4) if isinstance(one, Stroke) else one,
    "Delete": lambda one, by, dt: None,
}
LED: list[dict[str, Any]] = [{"stiffness": 0.5}, {"radius": 0.3}, {"local": 1.0}]
CALM: dict[str, Any] = {"deadline": None, "database": None, "suppress_health_check": list(HealthCheck)}
LITTLE = 9000  # bytes of a history that soon lets its oldest entries go
AGES = 1e6  # seconds


KEPT = "warp", "seen", "frozen", "thickness", "velocity"


class Look(NamedTuple):
    """What is seen at a tick, and decides what comes next."""

    warp: bytes
    seen: bytes
    frozen: bytes | None
    thickness: bytes | None
    velocity: bytes


def look_of(replay: Replay) -> Look:
    masks = [replay.masks.words(name) for name in ("frozen", "thickness")]
    solid, thickness = (None if words is None or (words == words.flat[0]).all() else words.tobytes() for words in masks)
    warp, velocity = replay.warp.read(), replay.fluid.velocity_at_centres()
    assert np.isfinite(warp).all()
    assert np.isfinite(velocity).all()
    return Look(warp.tobytes(), replay.seen.read().tobytes(), solid, thickness, velocity.tobytes())


class Work(RuleBasedStateMachine):
    """A person's work without a window, and what should be in its history, in its file and in its journal.

    What the history is to be is reckoned here, from what was there before an act and its name. What is to be seen is
    known by the recipe: at each tick the same, whichever way the work has come there.
    """

    device: Device

    def __init__(self) -> None:
        super().__init__()
        self.folder = tempfile.TemporaryDirectory()
        self.root = Path(self.folder.name)
        self.session: Session | None = None
        self.looks: dict[tuple[str, int], Look] = {}
        self.entries: list[Entry] = []
        self.index = 0
        self.saved = Recipe()

    @initialize(drag=st.sampled_from((20.0, 60.0)), is_little=st.booleans())
    def begin(self, drag: float, is_little: bool) -> None:
        write_picture(self.root / "pattern.png", pattern(40, 30))
        recipe = fresh_recipe()
        # at rest within a second, or an act takes minutes
        fluid = recipe.fluid.model_copy(update={"grid": 12, "drag": drag, "viscosity": 0.05})
        self._open(from_picture(self.root / "pattern.png", recipe.edited(fluid=fluid)))
        self.work.document.history.budget = LITTLE if is_little else self.work.document.history.budget

    def _open(self, project: Project, found: Found | None = None) -> None:
        if self.session is not None:
            self.session.release_gpu()
        self.session = session = Session(self.device, project)
        if found is not None:
            session.document.restore(found.work.history, found.work.saved)
        self.journal = Journal(self.root / "journals", found and found.held)
        self.entries, self.index = list(session.document.history.entries), session.document.history.index
        self.saved = session.document.saved_recipe
        self.just_saved: tuple[int, Recipe] | None = None

    @property
    def work(self) -> Session:
        assert self.session is not None
        return self.session

    # -- what is expected -------------------------------------------------------------------------------------------

    def _did(self, *names: str) -> None:
        """An act has ended, with an entry of one of these names; or with none, if it changed nothing."""
        self._went_on()
        now, was = list(self.work.document.history.entries), self.entries[: self.index + 1]
        if [entry.number for entry in now] == [entry.number for entry in self.entries]:
            assert not self.work.is_painting
            self._is(self.index, self.entries)
            return
        assert now[-1].name in names
        assert now[-1].recipe != was[-1].recipe
        assert now[-1].number > max(entry.number for entry in self.entries)
        self._is(len(was), [*was, now[-1]])

    def _turned(self, index: int) -> None:
        """Another entry of the history is the present."""
        self._is(index, self.entries)

    def _went_on(self) -> None:
        """Time has gone on: the recording of the present has become longer, if anything."""
        now, was = self.work.document.history.entries, self.entries[self.index]
        here = next((entry for entry in now if entry.number == was.number), None)
        if here is not None and here.recipe != was.recipe:
            assert here.name == was.name
            assert here.recipe.duration > was.recipe.duration
            assert here.recipe.edited(duration=was.recipe.duration) == was.recipe
            self.entries[self.index] = here

    def _is(self, index: int, entries: list[Entry]) -> None:
        """The history is so, but for its oldest, which go where it grows too large."""
        history = self.work.document.history
        now = history.entries
        gone = len(entries) - len(now)
        if gone:
            assert gone > 0
            assert sum(entry.nbytes for entry in entries[gone - 1 :]) > history.budget
        entries = entries[gone:]
        assert history.index == index - gone
        assert [(entry.name, entry.number) for entry in now] == [(entry.name, entry.number) for entry in entries]
        for mine, theirs in zip(now, entries, strict=True):
            assert mine.recipe is theirs.recipe or mine.recipe == theirs.recipe
        self.entries, self.index = entries, index - gone
        assert history.undo_name == (self.entries[self.index].name if self.index else None)
        after = self.entries[self.index + 1 :]
        assert history.redo_name == (after[0].name if after else None)
        assert history.recipe is now[self.index].recipe

    def _look(self) -> None:
        """What is seen at the end of the work, and on the way, is what has been seen there of this recipe before."""
        work = self.work
        work.settle()
        self._went_on()
        self._is(self.index, self.entries)
        work.seek(work.end)
        work.settle()
        assert work.tick == work.end
        self._compare(work.replay)

    def _compare(self, replay: Replay) -> None:
        recipe = replay.recipe.edited(picture="", duration=1.0)
        now, key = look_of(replay), (recipe.model_dump_json(), replay.tick)
        known = self.looks.setdefault(key, now)
        wrong = [name for name, mine, theirs in zip(KEPT, now, known, strict=True) if mine != theirs]
        assert not wrong, wrong

    # -- what is done ------------------------------------------------------------------------------------------------

    @rule(tool=st.sampled_from(FLOWING), ends=WAYS, ticks=TICKS, back=st.booleans(), shift=st.booleans(),
          symmetry=st.sampled_from(("none", "none", "both", "radial")), hold=PARTS, local=PARTS, how=ENDS)  # fmt: skip
    def paint(
        self,
        tool: str,
        ends: Way,
        ticks: int,
        back: bool,
        shift: bool,
        symmetry: Any,
        hold: float,
        local: float,
        how: str,
    ) -> None:
        brush = BrushSettings(0.3, 0.5, hold=hold, local=local)
        press = Press(brush, back, self.work.extent, self.work.dt, symmetry=symmetry, sectors=5)
        self._draw(tool, press, ends, ticks, shift, how, TOOL[tool].label, "Pinch")

    @rule(tool=st.sampled_from(("freeze", "thicken", "smooth")), ends=WAYS, ticks=TICKS, back=st.booleans(), how=ENDS)
    def mask(self, tool: str, ends: Way, ticks: int, back: bool, how: str) -> None:
        """In no time where nothing moves."""
        press = Press(BrushSettings(0.3, 0.5), back, self.work.extent, self.work.dt)
        self._draw(tool, press, ends, ticks, False, how, TOOL[tool].label, "Thin", "Thaw")

    @rule(ends=WAYS, ticks=TICKS, line=st.booleans(), how=ENDS)
    def hold(self, ends: Way, ticks: int, line: bool, how: str) -> None:
        """A handle, a pin or a line, unless there is nothing to take hold of."""
        press = Press(BrushSettings(0.3), False, self.work.extent, self.work.dt)
        with suppress(UserError):
            self._draw("handle", press, ends, ticks, line, how, "Pin", "Handle", "Line")

    def _draw(self, tool: str, press: Press, ends: Way, ticks: int, shift: bool, how: str, *names: str) -> None:
        """A gesture that begins where the playhead is, or was sent to, and comes to rest, goes on, or is given up."""
        work, (start, end) = self.work, ends
        work.press(TOOL[tool], press, *start, shift=shift)
        for tick in range(1, ticks + 1):
            x, y = (a + tick / ticks * (b - a) for a, b in zip(start, end, strict=True))
            work.move(x, y, shift=shift)
            work.advance(1)
        if how == "cancel":
            work.cancel()
            self._did()
        else:
            work.release()
            self._did(*names)
        if how == "rest":
            self._look()

    @precondition(lambda self: self.work.recipe.leads)
    @rule(which=st.integers(0, 9), by=st.tuples(st.floats(-0.2, 0.2), st.floats(-0.2, 0.2)))
    def lead_on(self, which: int, by: tuple[float, float]) -> None:
        work = self.work
        if not work.held:
            return
        held = work.held[which % len(work.held)]
        x, y = held.now
        work.press(TOOL["handle"], Press(BrushSettings(0.3), False, work.extent, work.dt), x, y, held=held)
        work.move(x + by[0], y + by[1])
        work.advance(1)
        work.release()
        self._did("Lead on")
        self._look()

    @precondition(lambda self: self.work.recipe.leads)
    @rule(which=st.integers(0, 9), how=st.sampled_from((*LED, None)))
    def set_held(self, which: int, how: dict[str, Any] | None) -> None:
        """Something about a handle or a pin; or take it away."""
        work = self.work
        label, led = (both := labelled(work.recipe.handle, work.recipe.pin))[which % len(both)]
        if how is None:
            work.let_go(label)
            self._did(f"Remove {led.kind}")
        else:
            work.edit_held("Set", label, **how)
            self._did("Set")
        self._look()

    @rule(of=MASKS, whole=st.sampled_from(WHOLE), tries=st.booleans())
    def edit_mask(self, of: str, whole: dict[str, Any], tries: bool) -> None:
        """`tries`: a slider is dragged before."""
        edit = mask_edit(frozen({**whole, "of": of, "tick": 0}))
        with suppress(UserError):  # a segment may choose nothing
            if tries:
                self.work.edit_masks("Edit", edit, commit=False)
            self.work.edit_masks("Edit", edit)
        if tries and self.work.recipe != self.work.document.recipe:
            self.work.commit("Edit")
        self._did("Edit")
        self._look()

    @rule(settings=st.sampled_from(LASTING), tries=st.booleans())
    def change(self, settings: dict[str, Any], tries: bool) -> None:
        if tries:
            self.work.preview_change(**settings)
        self.work.change("Change", **settings)
        self._did("Change")
        self._look()

    @rule(feel=st.sampled_from(FEELS))
    def choose(self, feel: Feel) -> None:
        """A feel of the fluid, and its drag, so that it comes to rest soon."""
        self.work.change(feel.name, viscosity=feel.viscosity, drag=20.0)
        self._did(feel.name)
        self._look()

    @rule(parts=st.sampled_from(SET), tries=st.booleans())
    def set(self, parts: dict[str, Any], tries: bool) -> None:
        if tries:
            self.work.preview(**parts)
        self.work.edit("Set", **parts)
        self._did("Set")
        self._look()

    @rule(returns=st.booleans(), loops=st.booleans())
    def repeat(self, returns: bool, loops: bool) -> None:
        self.work.repeat(loops, returns)
        self._did("Ping-pong" if returns else "One way")

    @rule(at=PLACES, strength=st.floats(-0.5, 0.5))
    def push_by_force(self, at: tuple[float, float], strength: float) -> None:
        force = VortexForce(kind="vortex", point=at, radius=0.2, strength=strength, during=(0.0, 0.1))
        self.work.edit("Force", force=(*self.work.recipe.force, force))
        self._did("Force")
        self._look()

    @precondition(lambda self: bool(bars(self.work.recipe)))
    @rule(verb=st.sampled_from(sorted(BARS)), which=st.integers(0, 9), by=st.integers(-9, 9), again=st.booleans())
    def edit_bars(self, verb: str, which: int, by: int, again: bool) -> None:
        """`again`: the key that does it is pressed twice, and is one edit."""
        work, dt = self.work, self.work.dt
        all_ = bars(work.recipe)
        those: set[Which] = {all_[which % len(all_)].which}
        again &= verb == "Move"
        for _ in range(1 + again):
            work.edit_bars(named(verb, those), those, lambda one: BARS[verb](one, by, dt), joined=again)
        self._did(named(verb, those))
        self._look()

    @rule(cells=st.sampled_from((10, 12)))
    def set_grid(self, cells: int) -> None:
        self.work.set_grid(cells)
        self._did("Quality")
        self._look()

    @rule(cells=st.sampled_from((10, 12)))
    def follow_the_machine(self, cells: int) -> None:
        """To another grid without an edit: all entries are of it then, and what was saved is."""
        work = self.work
        work.settle()
        self._went_on()
        assert work.prepare_grid(cells, AGES)
        self.entries = [replace(entry, recipe=on_grid(entry.recipe, cells)) for entry in self.entries]
        self.saved = on_grid(self.saved, cells)
        self._look()

    @rule(part=PARTS, ticks=st.integers(0, 3), plays=st.booleans(), steps=st.booleans())
    def go(self, part: float, ticks: int, plays: bool, steps: bool) -> None:
        """The playhead somewhere else, from where it may go on by itself, and where the next thing begins."""
        work = self.work
        work.seek(round(part * work.end))
        if plays:
            work.play()
        work.advance(ticks)
        if not plays:
            work.settle()
            assert work.tick == work.target
            self._compare(work.replay)
        work.pause()
        if steps:
            work.step()
        self._went_on()

    @rule(ticks=st.integers(0, 4))
    def play(self, ticks: int) -> None:
        """On from here; if all has been played, what moves is recorded on."""
        self.work.play()
        self.work.advance(ticks)
        self._went_on()

    @rule(shown=st.booleans())
    def undo(self, shown: bool) -> None:
        self._went_on()
        name = self.work.undo()
        assert name == (self.entries[self.index].name if self.index else None)
        self._turned(max(self.index - 1, 0))
        if shown:
            self._look()

    @rule(shown=st.booleans())
    def redo(self, shown: bool) -> None:
        self._went_on()
        after = self.entries[self.index + 1 :]
        assert self.work.redo() == (after[0].name if after else None)
        self._turned(self.index + bool(after))
        if shown:
            self._look()

    @rule(part=PARTS)
    def go_to(self, part: float) -> None:
        self._went_on()
        index = round(part * (len(self.entries) - 1))
        self.work.go_to(index)
        self._turned(index)
        self._look()

    @rule()
    def undo_and_redo_all(self) -> None:
        """Each step is the edit before, or after, and looks as it did."""
        self._look()
        here = self.index
        for index in (*reversed(range(here)), *range(1, here + 1)):
            self.work.undo() if index < self.index else self.work.redo()
            self._turned(index)
            self._look()

    @rule()
    def retract(self) -> None:
        """What a slider has done is taken back as if it had never been, unless that was nothing."""
        self._look()
        amount = self.work.recipe.amount
        for value in (amount, 0.7 if amount != 0.7 else 0.8):
            index, entries = self.index, self.entries
            self.work.edit("Amount", amount=value)
            self._did("Amount")
            edit = self.entries[-1]
            self._note()
            self.work.retract()
            now = self.work.document.history
            # What there was no room for beside the edit is gone: the oldest, and the last of what could be redone.
            gone = [entry.number for entry in entries].index(now.entries[0].number)
            kept = entries[gone : gone + len(now.entries)]
            assert kept == entries or sum(entry.nbytes for entry in (*entries, edit)) > now.budget
            self._is(index - gone, kept)
            self._look()

    @rule()
    def sleep(self) -> None:
        """Nothing of it stays on the GPU while another work is in front."""
        self._look()
        self.work.release_gpu()
        self.work.wake()
        self._look()

    @rule(embedded=st.booleans(), reopens=st.booleans())
    def save(self, embedded: bool, reopens: bool) -> None:
        """What is opened is what was saved, and is played as it was painted."""
        self._look()
        work, path = self.work, self.root / "work.fluidwarp"
        self._note()
        # What is nowhere but in the project's file stays in it, as the dialog has it.
        embedded |= work.project.keeper is not None
        saved = save(replace(work.project, recipe=work.document.recipe), path, embedded)
        work.saved(saved)
        self._note()
        self.saved = work.document.recipe
        self.just_saved = self.index, self.saved
        found = load(path)
        assert found.recipe == self.saved.edited(picture=found.recipe.picture)  # beside it, or inside
        assert np.array_equal(found.picture.pixels, work.project.picture.pixels)
        assert found.data == work.project.data
        if reopens:
            self.journal.end(discard=True)
            self.journal.join()
            self._open(found)
            self._look()

    @rule()
    def crash(self) -> None:
        """The next start offers what has not been saved, with all that can be undone and redone."""
        self._look()
        self._note()
        self.journal.end(discard=False)
        self.journal.join()
        found, notices = find(self.root / "journals")
        assert not notices
        unsaved = self.entries[self.index].recipe != self.saved or self.index < len(self.entries) - 1
        assert bool(found) == (unsaved and self.just_saved is None)
        if found:
            (one,) = found
            entries, index, saved = self.entries, self.index, self.saved
            assert one.is_as_it_was(self.work.project)
            self._open(one.load(), one)
            assert [entry.name for entry in self.entries] == [entry.name for entry in entries]
            assert [entry.recipe for entry in self.entries] == [entry.recipe for entry in entries]
            assert self.index == index
            assert self.saved == saved
            self._look()
        else:
            self.journal = Journal(self.root / "journals")

    def _note(self) -> None:
        """What a frame does after an act."""
        work = self.work
        self.journal.keep(work.project, work.document, work.is_grid_automatic)
        if (self.index, self.work.document.recipe) != self.just_saved:
            self.just_saved = None

    # -- what always holds ------------------------------------------------------------------------------------------

    @invariant()
    def is_well(self) -> None:
        if self.session is None:
            return
        document = self.work.document
        self._note()
        self._is(self.index, self.entries)
        assert not self.work.is_painting
        assert self.work.recipe == document.recipe
        assert document.saved_recipe == self.saved
        assert document.is_dirty == (document.recipe != self.saved)
        assert 0 <= self.work.tick <= max(self.work.end, self.work.target)
        assert 0 <= self.work.target <= self.work.end
        assert self.device.ctx.error == "GL_NO_ERROR"

    def teardown(self) -> None:
        if self.session is not None:
            self._anew()
            self.session.release_gpu()
            self.journal.end(discard=True)
            self.journal.join()
        self.folder.cleanup()

    def _anew(self) -> None:
        """The command line, which knows the recipe only, comes to the same."""
        self._look()
        replay = Replay(self.device, self.work.document.recipe, self.work.pictures)
        try:
            replay.seek(self.work.end)
            self._compare(replay)
        finally:
            replay.release()


def walk(device: Device) -> None:
    """Every act of `Work` once or twice, in an order in which each has something to lose."""
    way: Way = ((0.3, 0.4), (0.6, 0.5))
    back: Way = ((0.7, 0.6), (0.4, 0.3))
    area, other = WHOLE[2], WHOLE[4]
    state = type("Work", (Work,), {"device": device})()
    acts: tuple[Callable[[], None], ...] = (
        lambda: state.edit_mask("thickness", area, tries=True),
        lambda: state.edit_mask("frozen", other, tries=False),
        lambda: state.mask("thicken", way, 3, False, "rest"),
        lambda: state.undo_and_redo_all(),
        lambda: state.paint("push", way, 3, False, False, "none", 0.5, 1.0, "rest"),
        lambda: state.undo(shown=False),
        lambda: state.crash(),  # with nothing but what can be redone
        lambda: state.redo(shown=True),
        lambda: state.edit_mask("frozen", WHOLE[1], tries=False),
        lambda: state.edit_mask("frozen", other, tries=False),
        lambda: state.paint("push", back, 2, False, False, "both", 0.5, 0.0, "on"),
        lambda: state.choose(FEELS[0]),
        lambda: state.hold(way, 3, False, "rest"),
        lambda: state.lead_on(0, (0.1, 0.1)),
        lambda: state.change({"viscosity": 0.3}, tries=True),
        lambda: state.go(0.5, 0, plays=False, steps=False),
        lambda: state.save(embedded=False, reopens=False),
        lambda: state.retract(),
        lambda: state.undo(shown=True),
        lambda: state.undo(shown=False),
        lambda: state.go(1.0, 0, plays=False, steps=True),  # which loses nothing that can be redone
        lambda: state.go(1.0, 0, plays=False, steps=True),
        lambda: state.crash(),
        lambda: state.redo(shown=False),
        lambda: state.undo(shown=False),
        lambda: state.follow_the_machine(10),
        lambda: state.redo(shown=True),
        lambda: state.edit_bars("Move", 0, 3, again=True),
        lambda: state.edit_bars("Mute", 0, 3, again=False),
        lambda: state.set_held(0, LED[0]),
        lambda: state.set_held(0, None),
        lambda: state.go(0.6, 0, plays=False, steps=False),
        lambda: state.paint("twirl", way, 2, False, False, "none", 0.5, 0.0, "cancel"),
        lambda: state.go(0.4, 0, plays=False, steps=False),
        lambda: state.paint("twirl", way, 2, False, False, "none", 0.5, 0.0, "rest"),
        lambda: state.undo(shown=True),
        lambda: state.set({"amount": 0.5}, tries=True),
        lambda: state.push_by_force((0.4, 0.4), 0.5),
        lambda: state.crash(),
        lambda: state.sleep(),
        lambda: state.undo_and_redo_all(),
        lambda: state.set_grid(12),
        lambda: state.save(embedded=True, reopens=True),
    )
    try:
        state.begin(drag=60.0, is_little=False)
        for act in acts:
            act()
            state.is_well()
    finally:
        state.teardown()


def objects_of(device: Device) -> Counter[str]:
    """How many there are of what a simulation makes in OpenGL."""
    return living(device, "Texture", "Framebuffer", "Buffer", "Query", "VertexArray")


def check_session(device: Device, number: int, examples: int = 4, acts: int = 25) -> dict[str, float]:
    """Random work in a session is as its model says, and nothing is left on the GPU."""

    machine = type("Work", (Work,), {"device": device})
    how = settings(max_examples=examples, stateful_step_count=acts, **CALM)
    counts = []
    for _ in range(2):  # what is made once, and kept, is there after the first time
        run_state_machine_as_test(seed(number)(machine), settings=how)  # type: ignore[arg-type]
        counts.append(objects_of(device))
    assert counts[0] == counts[1], f"{counts[1] - counts[0]} of OpenGL are left"
    return {"objects": counts[1].total()}

"""The bars of the timeline: which are selected, what is dragged, and where they lie."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import ceil, floor, inf, log2
from operator import is_
from typing import Literal, NamedTuple

from app.model.bars import (
    KINDS,
    Actor,
    Bar,
    Changed,
    Kind,
    Which,
    bar_of,
    bars_of,
    lanes,
    moved,
    named,
    one_of,
    several_of,
    stretched,
    with_last,
)
from app.model.handles import RecipeHandle, RecipePin
from app.model.recipe import Recipe
from app.model.strokes import Stroke
from app.ui.layout import LANES
from app.ui.viewport import Rect
from app.work.session import Session

Part = Literal["move", "start", "end"]
Strokes = tuple[Stroke, ...]
ROOM = 0.06  # of the recording that is shown after its end, for bars that go there
CLOSEST = 24  # ticks that are shown at least
MOST_BLOCKS = 100  # of one stroke on the track


@dataclass
class Drag:
    """A bar in hand.

    Attributes:
        bar: as it was taken.
        part: what of it was taken.
        at: the tick where.
        x: the pointer's place then, in points.
        ticks: how far it has been dragged.
        moved: it is more than a click.
        adds: it is added to what is selected, or taken away.
        shown: the ticks from and to which are shown meanwhile, though the recording may grow.
    """

    bar: Bar
    part: Part
    at: float
    x: float
    adds: bool
    shown: tuple[float, float]
    ticks: int = 0
    moved: bool = False


class Block(NamedTuple):
    """Strokes on the track: ticks from and to, the tool of the first, and whether they are muted."""

    start: float
    end: float
    tool: str
    muted: bool


@dataclass
class Lanes:
    """What of the bars the window remembers.

    Attributes:
        shown: the lanes are folded open.
        height: of them all, in points of the design, where the window has room.
        selected: the bars that the next edit is about.
        drag: the bar in hand.
        box: where a box around bars was begun, in points; and what was selected before, and stays so.
        drawn: the bars that are seen, and where, as of the last frame.
        view: ticks from and to which are shown; None shows all.
    """

    shown: bool = False
    height: float = LANES
    selected: set[Which] = field(default_factory=set)
    drag: Drag | None = None
    box: tuple[float, float, frozenset[Which]] | None = None
    drawn: list[tuple[Bar, Rect]] = field(default_factory=list)
    view: tuple[float, float] | None = None
    _packed: tuple[tuple[object, ...], list[list[Bar]]] = field(default=((), []), init=False)
    # The lanes of strokes, and blocks, and what both are of: of all but the last, which may be painted just now.
    _laid: tuple[Strokes, float, list[list[Bar]]] = field(default=((), 0.0, []), init=False)
    _blocks: tuple[Strokes, float, list[Block]] = field(default=((), 0.0, []), init=False)
    _of: tuple[Recipe | None, Session | None] = field(default=(None, None), init=False)

    def look(self, session: Session) -> None:
        """Let go of what has gone: bars that are no more, or are something else by now."""
        recipe, (before, of) = session.recipe, self._of
        if recipe is before and session is of:
            return
        self._of = recipe, session
        if session is not of or before is None:
            self.selected, self.drag, self.box, self.view = set(), None, None, None
            return
        if all(several_of(recipe, kind) is several_of(before, kind) for kind in KINDS):
            return
        self.selected = {which for which in self.selected if _alike(one_of(before, which), one_of(recipe, which))}
        if self.drag is not None:
            which = self.drag.bar.which
            self.drag = self.drag if one_of(before, which) is one_of(recipe, which) else None

    def packed(self, recipe: Recipe, ticks: int, least: float) -> list[list[Bar]]:
        """The lanes, those of forces first and of strokes last; each bar takes `least` ticks, or up to twice as many.

        So they are packed anew only where a recording has become twice as long, and stay where they are meanwhile.
        """
        kinds: list[Kind] = [kind for kind in KINDS if kind != "stroke"]
        others = [several_of(recipe, kind) for kind in kinds]
        wide = 2.0 ** ceil(log2(least))
        made_of = recipe.stroke, *others, ticks if any(others) else 0, wide
        if not _same(self._packed[0], made_of):
            bars = (bars_of(kind, several, recipe) for kind, several in zip(kinds, others, strict=True))
            packed = [lane for several in bars for lane in lanes(several, wide)]
            self._packed = made_of, [*packed, *self._lanes_of_strokes(recipe, wide)]
        return self._packed[1]

    def _lanes_of_strokes(self, recipe: Recipe, least: float) -> list[list[Bar]]:
        done, last = recipe.stroke[:-1], bars_of("stroke", recipe.stroke, recipe, len(recipe.stroke) - 1)
        strokes, wide, packed = self._laid
        if wide != least or not _are(strokes, done):
            packed = lanes(bars_of("stroke", done, recipe), least)
            self._laid = done, least, packed
        for bar in last:
            if any(lane[-1].start > bar.start for lane in packed):
                return lanes(bars_of("stroke", recipe.stroke, recipe), least)
            packed = with_last(packed, bar, least)
        return packed

    def blocks(self, recipe: Recipe, pixel: float) -> list[Block]:
        """The strokes as they are seen on the track, where a pixel is so many ticks: many lie in the same one."""
        done, pixel = recipe.stroke[:-1], 2.0 ** floor(log2(pixel))
        strokes, narrow, blocks = self._blocks
        if narrow != pixel or not _are(strokes, done):
            blocks = _blocks(done, pixel)
            self._blocks = done, pixel, blocks
        return [*blocks, *_blocks(recipe.stroke[-1:], pixel)]

    # -- what is shown ----------------------------------------------------------------------------------------------

    def span(self, end: int) -> tuple[float, float]:
        """The ticks from and to which are shown of a recording of so many."""
        if self.drag is not None:
            return self.drag.shown
        whole = max(end * (1 + ROOM), end + 6.0, CLOSEST)
        if self.view is None:
            return 0.0, whole
        length = min(self.view[1] - self.view[0], whole)
        start = min(max(self.view[0], 0.0), whole - length)
        return start, start + length

    def zoom(self, end: int, at: float, factor: float) -> None:
        """Show so many times as much of time, with a tick staying where it is."""
        start, stop = self.span(end)
        whole = Lanes().span(end)[1]
        length = min(max((stop - start) * factor, CLOSEST), whole)
        start = at - (at - start) * length / (stop - start)
        self.view = None if length >= whole else (start, start + length)

    def pan(self, end: int, part: float) -> None:
        """Show what comes later, by a part of what is shown."""
        if self.view is not None:
            start, stop = self.span(end)
            self.view = start + part * (stop - start), stop + part * (stop - start)

    # -- what is selected -------------------------------------------------------------------------------------------

    def only(self, recipe: Recipe) -> tuple[Which, Actor] | None:
        """The one bar that is selected, and what it is of; None if there are none or several."""
        if len(self.selected) != 1:
            return None
        which = next(iter(self.selected))
        one = one_of(recipe, which)
        return None if one is None else (which, one)

    def press(self, bar: Bar, part: Part, at: float, x: float, adds: bool, end: int) -> None:
        """The pointer went down on a bar, at a tick and a place; `end`: ticks that are seen."""
        if not adds and bar.which not in self.selected:
            self.selected = {bar.which}
        if part == "end" and bar.end == inf:
            bar = bar._replace(end=round(at))
        self.drag = Drag(bar, part, at, x, adds, self.span(end))

    def press_beside(self, x: float, y: float, adds: bool) -> None:
        """The pointer went down where no bar is: a box begins."""
        self.selected = self.selected if adds else set()
        self.box = x, y, frozenset(self.selected)

    def stretch_box(self, x: float, y: float) -> None:
        """The bars that are seen between where the box was begun and a point are selected."""
        if self.box is not None:
            (left, right), (top, bottom) = sorted((self.box[0], x)), sorted((self.box[1], y))
            touched = {
                bar.which
                for bar, rect in self.drawn
                if rect.x <= right and left <= rect.right and rect.y <= bottom and top <= rect.bottom
            }
            self.selected = set(self.box[2] | touched)

    def release(self, session: Session) -> None:
        """The pointer went up: the bar stays where it is, or was only clicked; or the box is done."""
        drag, self.drag, self.box = self.drag, None, None
        if drag is None:
            return
        which = drag.bar.which
        if not drag.moved:
            self.selected = self.selected ^ {which} if drag.adds else {which}
        elif drag.ticks and drag.bar.is_free:
            self.selected |= {which}
            edited = self.selected if drag.part == "move" else {which}
            dt = session.dt
            verb = "Move" if drag.part == "move" else "Stretch"
            session.edit_bars(named(verb, edited), edited, lambda one: self.dragged(one, drag, dt))

    def dragged(self, one: Actor, drag: Drag, dt: float) -> Actor:
        """What becomes of one that is dragged so."""
        if drag.part == "move":
            return moved(one, drag.ticks, dt)
        start, end = drag.bar.start, drag.bar.end
        if drag.part == "start":
            return stretched(one, min(start + drag.ticks, end - 1), end, dt)
        return stretched(one, start, max(end + drag.ticks, start + 1), dt)

    def earliest(self, session: Session) -> float:
        """The tick at which the first of the bars begins that are selected or in hand."""
        recipe, those = session.recipe, self.selected | ({self.drag.bar.which} if self.drag else set())
        ones = ((which, one_of(recipe, which)) for which in those)
        return min(bar_of(one, which, session.end, session.dt).start for which, one in ones if one is not None)

    # -- edits ------------------------------------------------------------------------------------------------------

    def _edit(self, session: Session, verb: str, changed: Changed) -> None:
        if self.selected:
            session.edit_bars(named(verb, self.selected), self.selected, changed)

    def nudge(self, session: Session, ticks: int) -> None:
        """Move what is selected by ticks; one edit, however often it is done in a row."""
        if self.selected and not self.drag:
            ticks = max(ticks, -int(self.earliest(session)))
            name, dt = named("Move", self.selected), session.dt
            session.edit_bars(name, self.selected, lambda one: moved(one, ticks, dt), joined=True)

    def together(self, session: Session) -> None:
        """Let what is selected begin with the first of it."""
        if len(self.selected) > 1:
            first, dt = self.earliest(session), session.dt

            def changed(one: Actor) -> Actor:
                return moved(one, round(first - bar_of(one, ("stroke", 0), session.end, dt).start), dt)

            session.edit_bars("Start together", self.selected, changed)

    def is_muted(self, session: Session) -> bool:
        """All that is selected is muted."""
        ones = [one_of(session.recipe, which) for which in self.selected]
        return bool(ones) and all(one is None or one.muted for one in ones)

    def mute(self, session: Session) -> None:
        """Let what is selected do nothing; if that is so already, let it act again."""
        muted = not self.is_muted(session)

        def changed(one: Actor) -> Actor:
            return one.model_copy(update={"muted": muted})

        self._edit(session, "Mute" if muted else "Unmute", changed)

    def remove(self, session: Session) -> None:
        """Take what is selected away."""
        self._edit(session, "Delete", lambda one: None)
        self.selected = set()

    def cancel(self) -> bool:
        """Give up the drag or the box, or else what is selected; True if there was something."""
        had = self.drag is not None or self.box is not None or bool(self.selected)
        if self.drag is None:
            self.selected = set(self.box[2]) if self.box is not None else set()
        self.drag = self.box = None
        return had


def _blocks(strokes: Strokes, pixel: float) -> list[Block]:
    seen: dict[tuple[int, int, str], Block] = {}
    for stroke in strokes:
        # Where it repeats so often that the track would be full of it, it is one block.
        times, last = (1, stroke.end_tick) if stroke.repeat > MOST_BLOCKS else (stroke.repeat, stroke.last_tick)
        length = last + 1 - stroke.first_tick
        for time in range(times):
            start = stroke.first_tick + time * stroke.every
            block = Block(start, start + length, stroke.tool, stroke.muted)
            at = int(start / pixel), int((start + length) / pixel), stroke.tool
            if at not in seen or seen[at].muted:
                seen[at] = block
    return list(seen.values())


def _are(strokes: Strokes, others: Strokes) -> bool:
    """The same strokes."""
    return len(strokes) == len(others) and all(map(is_, strokes, others))


def _same(one: tuple[object, ...], other: tuple[object, ...]) -> bool:
    """The same things, lists not compared item by item."""
    return len(one) == len(other) and all(
        a is b or (not isinstance(a, tuple) and a == b) for a, b in zip(one, other, strict=True)
    )


def _alike(one: Actor | None, other: Actor | None) -> bool:
    """They may be the same, before an edit and after it."""
    if one is None or other is None:
        return False
    if isinstance(one, Stroke) and isinstance(other, Stroke):
        return one.tool == other.tool and one.samples[0][1:] == other.samples[0][1:]
    if isinstance(one, RecipeHandle | RecipePin) and isinstance(other, RecipeHandle | RecipePin):
        return one.kind == other.kind and one.at == other.at
    return type(one) is type(other)

"""The fields of what is selected by its bar: when, how long, how strong, how often."""

from __future__ import annotations

from collections.abc import Callable
from math import inf

from app.model.bars import Actor, Which, bar_of, stretched
from app.model.handles import RecipeHandle, RecipePin
from app.model.strokes import Stroke
from app.ui.editor_state import EditorState
from app.ui.panels.lanes import name_of
from app.ui.units import PERCENT, PLAIN, SECONDS, THREE_DIGITS
from app.ui.widgets import Slid, Ui
from app.work.session import Session

STRONGEST = 2.0  # of a stroke, by the slider; of a force, times its own
FARTHEST = 1.5  # recordings from the beginning, likewise
OFTENEST = 24  # times that a stroke repeats, likewise


def draw(ui: Ui, session: Session, state: EditorState) -> None:
    """The fields of the one that is selected."""
    only = state.lanes.only(session.recipe)
    if only is None:
        ui.dim(f"{len(state.lanes.selected)} selected")
        return
    which, one = only
    ui.text(name_of(one, which), size=14)
    _times(ui, session, which, one)
    if isinstance(one, Stroke):
        most = max(STRONGEST, one.strength)
        slid = ui.slider(
            "bar strength", "Strength", one.strength, 0.0, most, PERCENT, 1.0,
            title="Strength", more="100 % carries along at the pointer's speed, or works at the tool's own rate.",
        )  # fmt: skip
        _set(session, which, "Strength of a stroke", slid, lambda one: one.model_copy(update={"strength": slid.value}))
        _repeats(ui, session, which, one)
    elif not isinstance(one, RecipeHandle | RecipePin):  # which have a section of their own
        saved = state.lanes.only(session.document.recipe)
        before = saved[1] if saved and isinstance(saved[1], type(one)) else one
        most = STRONGEST * max(abs(before.strength), 0.5)
        slid = ui.slider(
            "bar strength", "Strength", one.strength, -most, most, THREE_DIGITS,
            title="Strength", more="Below zero it acts the other way round.",
        )  # fmt: skip
        _set(session, which, "Strength of a force", slid, lambda one: one.model_copy(update={"strength": slid.value}))


def _times(ui: Ui, session: Session, which: Which, one: Actor) -> None:
    # Of what is saved: what is previewed may end later, and the range would grow under a pointer that rests.
    dt, end = session.dt, max(session.document.recipe.recorded, 1)
    bar = bar_of(one, which, end, dt)
    if not bar.is_free:
        ui.dim("It acts by a formula of the time.")
        return
    latest = max(FARTHEST * end, bar.start) * dt
    slid = ui.slider("bar start", "Start", bar.start * dt, 0.0, latest, SECONDS, title="When it begins")

    def begun(one: Actor) -> Actor:
        here = bar_of(one, which, end, dt)
        return stretched(one, slid.value / dt, slid.value / dt + here.end - here.start, dt)

    _set(session, which, f"Move {which[0]}", slid, begun)
    if not isinstance(one, Stroke) and one.span is not None and one.span[0] == one.span[1]:
        return  # an instant
    if bar.end == inf:
        return
    length = bar.end - bar.start
    slid = ui.slider(
        "bar length", "Duration", length * dt, dt, max(FARTHEST * end, length) * dt, SECONDS,
        title="How long it lasts", more="The brush moves that much faster, or slower." if which[0] == "stroke" else "",
    )  # fmt: skip

    def lasted(one: Actor) -> Actor:
        start = bar_of(one, which, end, dt).start
        return stretched(one, start, start + max(round(slid.value / dt), 1), dt)

    _set(session, which, f"Stretch {which[0]}", slid, lasted)


def _repeats(ui: Ui, session: Session, which: Which, one: Stroke) -> None:
    dt, length = session.dt, one.last_tick + 1 - one.first_tick
    slid = ui.slider(
        "bar repeat", "Times", one.repeat, 1, max(OFTENEST, one.repeat), PLAIN, 1,
        title="How many times in all", more="It repeats the same way, over what has been moved by then.",
    )  # fmt: skip
    times = max(round(slid.value), 1)
    _set(session, which, "Repeat stroke", slid, lambda one: _repeated(one, times, 0))
    if one.repeat == 1:
        return
    slid = ui.slider(
        "bar every", "Every", one.every * dt, dt, max(4 * length, one.every, 120) * dt, SECONDS, length * dt,
        title="From one beginning to the next",
    )  # fmt: skip
    every = max(round(slid.value / dt), 1)
    _set(session, which, "Repeat stroke", slid, lambda one: _repeated(one, 0, every))


def _repeated(one: Actor, times: int, every: int) -> Actor:
    """With other times or another spacing; 0 leaves it, and the first spacing is one right after the other."""
    if not isinstance(one, Stroke):
        return one
    return one.repeated(times or one.repeat, every or one.every or one.last_tick + 1 - one.first_tick)


def _set(session: Session, which: Which, name: str, slid: Slid, changed: Callable[[Actor], Actor]) -> None:
    """Set what a slider says: an edit once it is let go of."""
    if slid.again:
        session.retract()
    if slid.changed or slid.done:
        session.edit_bars(name, {which}, changed, commit=slid.done)

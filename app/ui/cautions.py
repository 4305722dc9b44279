"""Cautions: handles that miss their goals, and folds, told as soon as they come up, as on the command line."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from app.model.handles import RecipeHandle, RecipePin, heading
from app.model.tools import TOOL
from app.ui.messages import Messages
from app.ui.workspace import Workspace
from app.work.handle_status import ANEW, FIT, Held
from app.work.session import Session

TOLD = 3  # sentences in a message; the inspector has all of them

Led = tuple[tuple[RecipeHandle, ...], tuple[RecipePin, ...]]


class Cautions:
    """Tells, each time once, which handles contradict each other, and which have come to rest where they should not.

    And that the warp folds over itself, once until it does not any more; and which held back a stroke.
    """

    def __init__(self, workspace: Workspace, messages: Messages) -> None:
        self._workspace, self._messages = workspace, messages
        self._session: Session | None = None
        self._led: Led | None = None  # what the known ones are of
        self._folds = False  # as was known last
        self._edit = 0  # the number of the last one that was looked at
        self._held_back = set[str]()  # who is known to hold
        self._known: set[str] = set()  # sentences, and what is unmet by its label: how far it is changes

    def look(self) -> None:
        """Tell what is new."""
        session = self._workspace.session
        if session.is_painting:
            return
        unmet = session.unmet
        said = {each: each for each in session.objections} | {label: each.said for label, each in unmet.items()}
        if session is not self._session:
            self._session, self._known, self._folds = session, set(), False
            self._edit, self._held_back = session.document.history.entries[session.document.history.index].number, set()
        self._look_at_folds(session)
        self._look_at_held(session)
        new = {key: sentence for key, sentence in said.items() if key not in self._known}
        led = _led(session)
        # While it moves, or is looked at before its end, nobody can tell what will be unmet.
        self._known = self._known | said.keys() if led == self._led or session.is_moving else set(said)
        self._led = led
        history = session.document.history
        if new and history.entries[history.index].name != FIT:  # which has told what it could not meet
            words = [f"{heading(sentence)}." for sentence in [*new.values()][:TOLD]]
            rest = [f"{len(new) - TOLD} more like these: see the inspector."] * (len(new) > TOLD)
            rest += [f"{heading(ANEW)}."] * any(unmet[key].helped for key in new if key in unmet)
            self._messages.caution(" ".join([*words, *rest]), self._as_long_as_leads(session, led))

    def _look_at_folds(self, session: Session) -> None:
        # A frame that draws the picture at rest has enough to do.
        if session.is_moving or self._workspace.canvas.is_unfinished:
            return
        folds, places = session.folds
        if folds and not self._folds:
            # Where Restore has made the fold, more of it need not help.
            restored = session.document.history.undo_name == TOOL["restore"].label
            mend = "Undo" if restored else "Undo, or Restore it there"
            if session.replay.recipe.amount != 1 and not session.replay.warp.statistics().folds:
                mend = "Set Amount to 100 %, where it does not"
            self._messages.caution(
                f"The warp folds over itself in {folds} of {places} places. {mend}.",
                lambda: session is self._workspace.session and self._folds,
            )
        self._folds = folds > 0

    def _look_at_held(self, session: Session) -> None:
        """Tell of a handle that holds its place against the stroke that has just been drawn over it."""
        history = session.document.history
        entry = history.entries[history.index]
        if entry.number <= self._edit:
            return
        self._edit = entry.number
        strokes, before = entry.recipe.stroke, history.entries[max(history.index - 1, 0)].recipe.stroke
        if len(strokes) <= len(before) or not entry.recipe.leads or not _moves(strokes[-1].tool):
            return
        new = [held for held in session.held if held.label not in self._held_back and _is_over(session, held)]
        if new:
            self._held_back |= {held.label for held in new}
            self._messages.caution(
                f"{heading(new[0].label)} holds its place, so that the stroke moves less there. "
                "To push it freely, mute or remove it first.",
                self._as_long_as_leads(session, _led(session)),
            )

    def _as_long_as_leads(self, session: Session, led: Led) -> Callable[[], bool]:
        """Whether a work is still open, and leads the same."""
        return lambda: session is self._workspace.session and _led(session) == led


def _moves(tool: str) -> bool:
    return tool in TOOL and not TOOL[tool].masks and tool != "restore"


def _is_over(session: Session, held: Held) -> bool:
    """The last stroke's brush has been over what a handle holds."""
    stroke = session.document.recipe.stroke[-1]
    path = np.array([sample[1:3] for sample in stroke.samples]) * session.extent
    places = np.array([held.now, *held.line]) * session.extent
    return bool(np.min(np.linalg.norm(path[:, None] - places[None], axis=-1)) <= stroke.radius)


def _led(session: Session) -> Led:
    return session.document.recipe.handle, session.document.recipe.pin

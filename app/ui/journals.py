"""The journals of the works that are open: what has been done outlasts a crash."""

from __future__ import annotations

from pathlib import Path

from app.ui.messages import Messages
from app.work.recovery import Found, Journal
from app.work.session import Session


class Journals:
    """One journal for each work that is open.

    Args:
        root: their folder; None keeps none, for tests.
        messages: are told, once, of a journal that cannot be written, as long as that is so.
    """

    def __init__(self, root: Path | None, messages: Messages) -> None:
        self.root = root
        self._messages = messages
        self._journals: dict[Session, Journal] = {}
        self._ended: list[Journal] = []
        self._has_warned = False

    @property
    def are_behind(self) -> bool:
        """Something is still to be written, in another thread."""
        return any(journal.is_behind for journal in self._journals.values())

    def open(self, session: Session, found: Found | None) -> None:
        """A work has been opened; `found` where it was restored."""
        if self.root is not None:
            self._journals[session] = Journal(self.root, found and found.held)

    def keep(self, session: Session) -> None:
        """Take note of what has been done to a work; Undo may have come back to one that was given up."""
        if self.root is None:
            return
        if session not in self._journals:
            self.open(session, None)
        journal = self._journals[session]
        journal.keep(session.project, session.document, session.is_grid_automatic)
        if journal.trouble is not None and not self._has_warned:
            self._messages.warn(journal.trouble, lambda: journal.trouble is not None)
        self._has_warned = journal.trouble is not None

    def close(self, session: Session) -> None:
        """A work that was open is given up, with what is kept of it."""
        if session in self._journals:
            self._ended.append(self._journals.pop(session))
            self._ended[-1].end(discard=True)

    def release(self, discard: bool) -> None:
        """Stop; `discard` if the person has left, and not where the program fails."""
        for journal in self._journals.values():
            journal.end(discard)
        for journal in (*self._ended, *self._journals.values()):
            journal.join()
        self._journals.clear()

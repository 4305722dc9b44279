"""Undo and redo: a list of recipes, each of which shares with its neighbours all that did not change."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from app.model.recipe import Recipe

DEFAULT_BUDGET = 256 * 2**20
LISTS = ("viscosity", "freeze", "force", "handle", "pin", "change", "mask", "stroke")  # of a recipe


@dataclass(frozen=True)
class Entry:
    """One state of the work, and the name of the edit that led to it.

    Attributes:
        number: of the edit among all that were made, with those that are gone.
    """

    name: str
    recipe: Recipe
    nbytes: int
    number: int = field(default=0, compare=False)


class History:
    """Every edit of a recipe, one entry each; unlimited but for `budget` bytes, beyond which the oldest go.

    Args:
        recipe: where the work begins.
        budget: bytes that the entries may hold together; what entries share is counted once.
    """

    def __init__(self, recipe: Recipe, budget: int = DEFAULT_BUDGET) -> None:
        self.budget = budget
        self._entries = [Entry("Open", recipe, _own_bytes(recipe, None))]
        self._index = self._made = 0
        # The present before the last commit and what could be redone then, for `retract`; none once that cannot be.
        self._before: list[Entry] = []

    @classmethod
    def restored(cls, entries: Sequence[Entry], index: int) -> History:
        """The history that had these entries; `index` is the present."""
        history = cls(entries[0].recipe)
        history._entries = [replace(entry, number=number) for number, entry in enumerate(entries)]
        history._made = len(entries) - 1
        history.go_to(index)
        return history

    @property
    def recipe(self) -> Recipe:
        """The recipe as it is now."""
        return self._entries[self._index].recipe

    @property
    def entries(self) -> tuple[Entry, ...]:
        """All states from the oldest, with those that can be redone."""
        return tuple(self._entries)

    @property
    def index(self) -> int:
        """Which of `entries` is the present."""
        return self._index

    @property
    def can_undo(self) -> bool:
        return self._index > 0

    @property
    def can_redo(self) -> bool:
        return self._index < len(self._entries) - 1

    @property
    def undo_name(self) -> str | None:
        """The edit that `undo` would take back."""
        return self._entries[self._index].name if self.can_undo else None

    @property
    def redo_name(self) -> str | None:
        """The edit that `redo` would make again."""
        return self._entries[self._index + 1].name if self.can_redo else None

    @property
    def nbytes(self) -> int:
        """Bytes that the entries hold, roughly, with those that only `retract` has a use for."""
        return sum(entry.nbytes for entry in (*self._entries, *self._before[1:]))

    def commit(self, name: str, recipe: Recipe) -> None:
        """Make `recipe` the present, as the edit `name`; what could be redone is gone. An edit of nothing is none."""
        if recipe is self.recipe or recipe == self.recipe:
            return
        self._made += 1
        self._before = self._entries[self._index :]
        del self._entries[self._index + 1 :]
        self._entries.append(Entry(name, recipe, _own_bytes(recipe, self.recipe), self._made))
        self._index += 1
        while self.nbytes > self.budget and self._before[1:]:
            del self._before[-1]
        while self.nbytes > self.budget and self._index > 0:
            del self._entries[0]
            self._index -= 1

    def amend(self, recipe: Recipe) -> None:
        """Let the present be `recipe`, as one edit with what led to it; what could be redone is gone."""
        if recipe is self.recipe or recipe == self.recipe:
            return
        del self._entries[self._index + 1 :]
        self.go_on(recipe)
        self._before = []

    def go_on(self, recipe: Recipe) -> None:
        """Let the present be `recipe`, as no edit: the recording goes on. What can be redone stays."""
        before = self._entries[self._index - 1].recipe if self._index else None
        nbytes = _own_bytes(recipe, before)
        self._entries[self._index] = replace(self._entries[self._index], recipe=recipe, nbytes=nbytes)

    def replace_all(self, change: Callable[[Recipe], Recipe]) -> None:
        """Let every state be another recipe, which is no edit: the list stays as it is, and so does the present."""

        def changed(entries: list[Entry]) -> list[Entry]:
            return [replace(entry, recipe=change(entry.recipe)) for entry in entries]

        self._entries, self._before = changed(self._entries), changed(self._before)

    def undo(self) -> Recipe:
        """The recipe one edit earlier; the present one where there is none."""
        self._before = []
        self._index = max(self._index - 1, 0)
        return self.recipe

    def redo(self) -> Recipe:
        """The recipe one edit later; the present one where there is none."""
        self._before = []
        self._index = min(self._index + 1, len(self._entries) - 1)
        return self.recipe

    def go_to(self, index: int) -> Recipe:
        """The recipe of an entry of the list.

        Raises:
            IndexError: if there is no such entry.
        """
        if not 0 <= index < len(self._entries):
            raise IndexError(f"the history has {len(self._entries)} entries, not one number {index}")
        self._before = []
        self._index = index
        return self.recipe

    def retract(self) -> Recipe:
        """Take the last commit back as if it had never been, if nothing else has been done since; the present recipe.

        It cannot be redone, and what could be redone before it can be again, but for the last of it where `budget` is
        too small for both.
        """
        if self._before:
            self._index = max(self._index - 1, 0)  # 0 where the commit had let even the one before it go
            self._entries[self._index :], self._before = self._before, []
        return self.recipe


def _own_bytes(recipe: Recipe, before: Recipe | None) -> int:
    """Bytes that `recipe` needs beside `before`: the parts that are not the same objects, roughly."""
    size = 1024
    for name in LISTS:
        known = {id(part) for part in getattr(before, name)} if before is not None else set()
        parts = getattr(recipe, name)
        size += 8 * len(parts)
        for part in parts:
            if id(part) not in known:
                # A sample is a tuple of four numbers: 96 bytes and three floats of 24.
                size += 1024 + 170 * len(getattr(part, "samples", None) or getattr(part, "keys", None) or ())
    return size

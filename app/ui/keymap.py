"""Which key does what now: by default as the rows of `actions.py` have it, and what the person has changed of that."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

TAKEN = {"\\": "Shows the picture as it was", "escape": "Gives up"}
"""Keys that are not for anything else, and what they do."""


@dataclass(frozen=True)
class Keyed:
    """Something that keys do.

    Attributes:
        name: by which the panels ask for it.
        label: as the person reads it.
        group: the heading it stands under.
        keys: chords that do it by default, the first of which is shown.
    """

    name: str
    label: str
    group: str
    keys: tuple[str, ...]

    @property
    def key(self) -> str:
        return self.keys[0] if self.keys else ""


class Keymap:
    """The chords of all actions.

    Args:
        actions: all of them.
        changed: the chords of those for which the person has chosen others, by their names; kept up to date.
        save: called when that has changed.
    """

    def __init__(self, actions: Iterable[Keyed], changed: dict[str, list[str]], save: Callable[[], None]) -> None:
        self.actions = {action.name: action for action in actions}
        self._changed = changed
        self._save = save
        self._defaults = {key: name for name, action in self.actions.items() for key in action.keys}
        self._chords: dict[str, tuple[str, ...]] = {}
        self._names: dict[str, str] = {}
        self._sort()

    @property
    def are_changed(self) -> bool:
        """Some are not as they come."""
        return bool(self._changed)

    def of(self, name: str) -> str:
        """The chord that is shown for an action; "" if it has none."""
        return next(iter(self._chords[name]), "")

    def action(self, chord: str) -> str | None:
        """The name of the action that a chord does."""
        return self._names.get(chord)

    def now(self, chord: str) -> str:
        """What is pressed for what a chord does by default."""
        name = self._defaults.get(chord)
        return chord if name is None or chord in self._chords[name] else self.of(name)

    def set(self, name: str, chord: str) -> None:
        """Let a chord do an action, and that one alone; it is the only one that does."""
        other = self.action(chord)
        if other is not None and other != name:
            self._changed[other] = [key for key in self._chords[other] if key != chord]
        self._changed[name] = [chord]
        self._take()

    def reset(self) -> None:
        """All as they come with fluidwarp."""
        self._changed.clear()
        self._take()

    def _take(self) -> None:
        self._sort()
        self._save()

    def _sort(self) -> None:
        """Chosen chords go before default ones: of two actions with the same one, the second goes without."""
        self._names = {}
        names = sorted(self.actions, key=lambda name: name not in self._changed)
        chords = {name: tuple(self._changed.get(name, self.actions[name].keys)) for name in names}
        for name in names:
            for chord in chords[name]:
                self._names.setdefault(chord, name)
        self._chords = {
            name: tuple(chord for chord in chords[name] if self._names[chord] == name) for name in self.actions
        }

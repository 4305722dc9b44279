"""What a person does, as values: the editor's frame is a function of its state, these, and the time passed."""

from __future__ import annotations

from dataclasses import dataclass

LEFT, RIGHT, MIDDLE = 0, 1, 2


@dataclass(frozen=True)
class Mods:
    """The modifier keys that were held."""

    ctrl: bool = False
    shift: bool = False
    alt: bool = False

    def chord(self, key: str) -> str:
        """The key with its modifiers, written as in `actions.py`: "ctrl+shift+z"."""
        held = [name for name in ("ctrl", "shift", "alt") if getattr(self, name)]
        return "+".join([*held, key])


@dataclass(frozen=True)
class Move:
    """The pointer is at (x, y), in the window's points from its top left corner; pressure 0-1."""

    x: float
    y: float
    pressure: float = 1.0
    mods: Mods = Mods()


@dataclass(frozen=True)
class Button:
    """A button went down or up where the pointer was last."""

    button: int
    down: bool
    mods: Mods = Mods()


@dataclass(frozen=True)
class Wheel:
    """The wheel turned, in notches, positive away from the person."""

    dx: float
    dy: float
    mods: Mods = Mods()


@dataclass(frozen=True)
class Key:
    """A key went down (again, if `repeat`) or up; `key` is lower case: "z", "f1", "space", "[", "left"."""

    key: str
    down: bool
    mods: Mods = Mods()
    repeat: bool = False


@dataclass(frozen=True)
class Text:
    """Characters were typed."""

    text: str


@dataclass(frozen=True)
class Drop:
    """Files were dropped on the window."""

    paths: tuple[str, ...]


@dataclass(frozen=True)
class Focus:
    """The window came to the front, or left it."""

    focused: bool


@dataclass(frozen=True)
class CloseWish:
    """The window's close button was pressed."""


Event = Move | Button | Wheel | Key | Text | Drop | Focus | CloseWish

"""The last value that was computed, for what is asked for in every frame and seldom changes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")


class Memo(Generic[T]):
    """Keeps one value for as long as the key that it was computed for stays the same."""

    def __init__(self) -> None:
        self._kept: tuple[object, T] | None = None

    def get(self, key: object, compute: Callable[[], T]) -> T:
        """The value for `key`, computed if the last one was for another."""
        if self._kept is None or self._kept[0] != key:
            self._kept = key, compute()
        return self._kept[1]

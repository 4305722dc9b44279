"""Small pictures of the states of the history."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import datetime

import moderngl

from app.model.recipe import Recipe
from app.work.session import Session
from solver.gl.device import Device

LONGER = 80  # pixels along the longer side
MOST = 48  # of one work


@dataclass
class Thumbnail:
    """A state as it was seen, top row last, and the recipe that it was seen with."""

    target: moderngl.Framebuffer
    texture: moderngl.Texture
    recipe: Recipe


class Thumbnails:
    """Those of one work: each is drawn on the GPU when its step ends, and never read back.

    Args:
        device: where they are drawn.
        size: of the picture.
        draw: draws the picture as it is now, all of it, into a framebuffer.
    """

    def __init__(
        self, device: Device, size: tuple[int, int], draw: Callable[[moderngl.Framebuffer, Session], None]
    ) -> None:
        self._ctx = device.ctx
        width, height = (max(1, round(LONGER * side / max(size))) for side in size)
        self._size = width, height
        self._draw = draw
        self._kept: dict[int, Thumbnail] = {}
        self._when: dict[int, datetime] = {}
        self._newest: int | None = None

    def look(self, session: Session) -> None:
        """Once a frame: take one of a step that has ended, and another one once all that came of it is at rest."""
        history = session.document.history
        newest, entry = history.entries[-1].number, history.entries[history.index]
        if self._newest is not None and newest > self._newest:
            self._when[newest] = datetime.now()
        self._newest = newest
        if session.is_painting or session.is_behind or session.tick != session.end:
            return
        kept = self._kept.get(entry.number)
        if session.recipe is entry.recipe and (
            kept is None or (kept.recipe is not entry.recipe and not session.is_moving)
        ):
            self.take(entry.number, session)

    def take(self, number: int, session: Session) -> None:
        """Draw the picture of an entry, in the place of the oldest where there are enough."""
        oldest = number if number in self._kept or len(self._kept) < MOST else next(iter(self._kept))
        kept = self._kept.pop(oldest, None)
        if kept is None:
            texture = self._ctx.texture(self._size, 4)
            kept = Thumbnail(self._ctx.framebuffer([texture]), texture, session.recipe)
        self._draw(kept.target, session)
        self._kept[number] = replace(kept, recipe=session.recipe)

    def of(self, number: int) -> moderngl.Texture | None:
        """That of the state that an edit led to, by its number, if there is one."""
        return self._kept[number].texture if number in self._kept else None

    def when(self, number: int) -> datetime | None:
        """When the edit was made, if that was seen."""
        return self._when.get(number)

    def release(self) -> None:
        for kept in self._kept.values():
            kept.target.release()
            kept.texture.release()
        self._kept.clear()

"""The works that are open in the window, and the one that is worked on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from app.media.project import Project
from app.ui.canvas import Canvas
from app.ui.journals import Journals
from app.ui.viewport import Viewport
from app.work.recovery import Found
from app.work.session import Session
from solver.gl.device import Device

# Bytes of pixels of the pictures that were open before, to which Undo comes back.
OPENED_BUDGET = 2**30


@dataclass
class Work:
    """Something that has been opened; without a canvas it is asleep, and has nothing on the GPU."""

    session: Session
    canvas: Canvas | None

    def wake(self, device: Device) -> Canvas:
        """What draws it; it is played again if it was asleep."""
        if self.canvas is None:
            self.canvas = Canvas(device, self.session.project.picture)
            self.session.wake()
        return self.canvas

    def sleep(self) -> None:
        """Keep only what makes it."""
        if self.canvas is not None:
            self.session.release_gpu()
            self.canvas.release()
            self.canvas = None


class Workspace:
    """The works that have been opened one after another, as a history: Undo at the start of one is back in the last.

    Only the one that is worked on and those beside it are on the GPU.

    Args:
        device: the GL of the window.
        journals: of the works.
        view: the canvas on the screen.

    Attributes:
        view: where the picture lies on the canvas.
        placeholder: work that is only there until something else has been read: untouched, it is nothing to go back to.
    """

    def __init__(self, device: Device, journals: Journals, view: Viewport) -> None:
        self.view = view
        self.placeholder: Session | None = None
        self._device = device
        self._journals = journals
        self._works: list[Work] = []
        self._index = -1

    @property
    def session(self) -> Session:
        return self._works[self._index].session

    @property
    def canvas(self) -> Canvas:
        return self._works[self._index].wake(self._device)

    @property
    def is_dirty(self) -> bool:
        return self.session.document.is_dirty

    def open(self, project: Project, pixels: np.ndarray | None = None, found: Found | None = None) -> None:
        """Work on another project; Undo at its very start comes back to this one.

        `pixels`: the picture as the canvas shows it, if it is at hand. `found`: what the project was restored from.
        """
        canvas = Canvas(self._device, project.picture, pixels)
        try:
            session = Session(self._device, project)
        except Exception:
            canvas.release()
            raise
        if found is not None:
            session.document.restore(found.work.history, found.work.saved)
        self._journals.open(session, found)
        for old in self._works[self._index + 1 :]:
            self._close(old)
        kept = self._works[: self._index + 1]
        replaced = kept.pop() if kept and kept[-1].session is self.placeholder and not self.is_dirty else None
        while len(kept) > 1 and sum(old.session.project.picture.pixels.nbytes for old in kept) > OPENED_BUDGET:
            self._close(kept.pop(0))
        self._leave()
        self._works = [*kept, Work(session, canvas)]
        self._turn_to(len(self._works) - 1)
        if replaced is not None:
            self._close(replaced)

    def undo(self) -> None:
        if self.session.document.history.can_undo:
            self.session.undo()
        elif self._index > 0:
            self._leave()
            self._turn_to(self._index - 1)

    def redo(self) -> None:
        if self.session.document.history.can_redo:
            self.session.redo()
        elif self._index < len(self._works) - 1:
            self._leave()
            self._turn_to(self._index + 1)

    @property
    def can_undo(self) -> bool:
        return self.session.document.history.can_undo or self._index > 0 or self.session.is_painting

    @property
    def can_redo(self) -> bool:
        return self.session.document.history.can_redo or self._index < len(self._works) - 1

    def change(self, name: str, **settings: Any) -> None:
        """Change the fluid from the playhead on."""
        if self.session.end or settings.keys() <= {"viscosity", "drag", "walls"}:
            self.session.change(name, **settings)

    def give_up(self, session: Session) -> None:
        """Nobody wants a work back that has been left, unless Undo comes back to it: no crash brings it up again."""
        if session is not self.session:
            self._journals.close(session)

    def keep(self) -> None:
        """Take note in the journal of what has been done."""
        self._journals.keep(self.session)

    def release(self) -> None:
        for work in self._works:
            self._close(work)

    def _leave(self) -> None:
        if self._index >= 0:
            self.session.stop_recording()
            self.session.forget_grid()
            self.keep()

    def _turn_to(self, index: int) -> None:
        self._index = index
        for place, work in enumerate(self._works):
            if abs(place - index) > 1:
                work.sleep()
        self.view = Viewport(self.view.canvas, self.canvas.size, self.view.density)

    def _close(self, work: Work) -> None:
        self._journals.close(work.session)
        work.sleep()

"""The works that are open in the window, and the one that is worked on."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from app.media.project import Project
from app.media.reel import Reel
from app.model.picture import Picture
from app.ui.canvas import Canvas, shown_pixels
from app.ui.journals import Journals
from app.ui.memory import hand_back, map_large_blocks
from app.ui.viewport import Viewport
from app.work.recovery import Found
from app.work.session import Session
from solver.gl.device import Device

# What was open before, to which Undo comes back: works, and bytes of their pixels and histories.
MOST_OPENED = 16
OPENED_BUDGET = 2**30


@dataclass
class Work:
    """Something that has been opened; without a canvas it is asleep, and has nothing on the GPU."""

    session: Session
    canvas: Canvas | None
    reel: Reel | None = None
    frame: int = field(init=False)  # of the clip, that the canvas shows; 0 of a picture
    pixels: np.ndarray | None = field(init=False)  # of that frame, where it is not the first

    def __post_init__(self) -> None:
        self._begin()

    def _begin(self) -> None:
        clip = self.session.project.clip
        self.frame, self.pixels = clip.start if clip else 0, None

    def wake(self, device: Device) -> Canvas:
        """What draws it; it is played again if it was asleep."""
        if self.canvas is None:
            self.canvas = Canvas(device, self.session.project)
            self.session.wake()
        return self.canvas

    def look(self) -> list[str]:
        """Let the canvas show the frame of the clip that belongs to the playhead; what there is to say of it.

        It is shown as soon as it is there, and while time goes on the newest one that is there in time.
        """
        session, clip, canvas = self.session, self.session.project.clip, self.canvas
        if clip is None or canvas is None or (self.reel is None and session.frame == clip.start):
            return []
        if self.reel is None:
            self.reel = Reel(clip, partial(shown_pixels, largest=canvas.largest))
        self.reel.want(session.frame, session.is_moving)
        if (found := self.reel.best()) is not None and found[0] != self.frame:
            self.frame, self.pixels = found
            canvas.show(self.pixels)
        session.clip_frames = self.reel.frames
        return self.reel.take_words()

    @property
    def nbytes(self) -> int:
        """Bytes that it holds when it is asleep, roughly."""
        return self.session.project.picture.pixels.nbytes + self.session.document.history.nbytes

    @property
    def awaits_frame(self) -> bool:
        """A frame of the clip is still to be shown."""
        return self.reel is not None and self.reel.awaits(self.frame)

    @property
    def picture(self) -> Picture | None:
        """The frame of the clip, as the canvas shows it, if it is not the first."""
        return None if self.pixels is None else Picture(self.pixels[..., :3])

    def sleep(self) -> Canvas | None:
        """Keep only what makes it; what drew it is to be released."""
        if self.reel is not None:
            self.reel.close()
            self.reel = None
            self._begin()  # as the next canvas does
        canvas, self.canvas = self.canvas, None
        if canvas is not None:
            self.session.release_gpu()
        return canvas


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
        self._left: list[Canvas] = []  # whose pictures the frame that is being drawn may still hold
        self._index = -1
        map_large_blocks()

    @property
    def work(self) -> Work:
        """The one that is worked on."""
        return self._works[self._index]

    @property
    def session(self) -> Session:
        return self.work.session

    @property
    def canvas(self) -> Canvas:
        return self.work.wake(self._device)

    @property
    def is_dirty(self) -> bool:
        return self.session.document.is_dirty

    def open(self, project: Project, pixels: np.ndarray | None = None, found: Found | None = None) -> None:
        """Work on another project; Undo at its very start comes back to this one.

        `pixels`: the picture as the canvas shows it, if it is at hand. `found`: what the project was restored from.
        """
        # Where no session can be begun, nothing holds the canvas any more, and its textures are given back.
        canvas, session = Canvas(self._device, project, pixels), Session(self._device, project)
        if found is not None:
            session.document.restore(found.work.history, found.work.saved)
        self._journals.open(session, found)
        for old in self._works[self._index + 1 :]:
            self._close(old)
        kept = self._works[: self._index + 1]
        replaced = kept.pop() if kept and kept[-1].session is self.placeholder and not self.is_dirty else None
        while len(kept) > 1 and (len(kept) > MOST_OPENED or sum(old.nbytes for old in kept) > OPENED_BUDGET):
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

    @property
    def frames_after_first(self) -> int:
        """How many frames after its first one of the clip the canvas shows; 0 of a picture."""
        clip = self.session.project.clip
        return self.work.frame - clip.start if clip else 0

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
        self.release_left()

    def release_left(self) -> None:
        """Free what drew works that have been left; before a frame is drawn."""
        if self._left:
            for canvas in self._left:
                canvas.release()
            self._left.clear()
            hand_back()

    def _put_to_sleep(self, work: Work) -> None:
        if (canvas := work.sleep()) is not None:
            self._left.append(canvas)

    def _leave(self) -> None:
        if self._index >= 0:
            self.session.stop_recording()
            self.session.forget_grid()
            self.keep()
            if not self.is_dirty:  # nothing of it would be lost: no thread has to wait for more
                self._journals.close(self.session)

    def _turn_to(self, index: int) -> None:
        self._index = index
        for place, work in enumerate(self._works):
            if abs(place - index) > 1:
                self._put_to_sleep(work)
        self.view = Viewport(self.view.canvas, self.canvas.size, self.view.density)

    def _close(self, work: Work) -> None:
        self._journals.close(work.session)
        self._put_to_sleep(work)

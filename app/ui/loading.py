"""Reading a picture or a project in the background, so that a large one does not hold the window up."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from app.errors import UserError
from app.media.project import Project
from app.model.recipe import Recipe
from app.ui.canvas import largest_shown, shown_pixels
from app.ui.clipboard import pasted_folder
from app.work.recovery import Found


@dataclass
class Loading:
    """A file that is being read.

    Attributes:
        path: the file.
        load: reads it; runs in a thread of its own, and knows no GL.
        largest: pixels along a side of a texture.
        recipe: the work that may be left for it without a question; None is none.
        found: what it is that is restored, where it is not just opened.
        project, pixels: what has been read, and the picture as the canvas shows it.
        error: why it could not be read, as a sentence.
    """

    path: Path
    load: Callable[[], Project]
    largest: int
    recipe: Recipe | None
    found: Found | None = None
    project: Project | None = None
    pixels: np.ndarray | None = None
    error: str = ""
    _thread: threading.Thread = field(init=False, repr=False)

    def __post_init__(self) -> None:
        # A daemon: whoever leaves does not have to wait for it.
        self._thread = threading.Thread(target=self._read, name=f"reading {self.path.name}", daemon=True)
        self._thread.start()

    @property
    def name(self) -> str:
        """What a person calls it."""
        return "the copied picture" if self.path.parent == pasted_folder() else self.path.name

    def is_done(self, patience: float = 0.0) -> bool:
        """True if it has been read, or has failed; waits for it for so many seconds."""
        self._thread.join(patience)
        return not self._thread.is_alive()

    def _read(self) -> None:
        try:
            project = self.load()
            self.pixels = shown_pixels(project.picture, largest_shown(project, self.largest))
            self.project = project
        except UserError as error:
            self.error = error.in_window
        except MemoryError:
            self.error = f"There is not enough memory to open {self.path}."
        except Exception as error:
            self.error = f"{self.path} cannot be opened: {error}"

"""Pictures on the system's clipboard, of which GLFW has only texts: by copykitten, where it is installed."""

from __future__ import annotations

import subprocess
import sys
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from app.errors import UserError
from app.media.depth import rgba
from app.media.files import make_folder
from app.media.pictures import read_picture, write_picture
from app.model.picture import Picture
from app.progress import deaf_children

KEPT = 20  # pictures that were pasted
GIVING = "from app.ui.clipboard import give; give({path!r})"


def pasted_folder() -> Path:
    """Where pictures that were pasted are kept as files, so that unsaved work on them outlasts a crash."""
    from platformdirs import user_state_path

    return user_state_path("fluidwarp") / "pasted"


def new_name() -> Path:
    """A file for a picture that is to be pasted."""
    return pasted_folder() / f"pasted {datetime.now():%Y-%m-%d %H.%M.%S.%f}.png"


def paste(path: Path) -> None:
    """Write the picture on the clipboard into a file of `pasted_folder`, where the newest are kept.

    Raises:
        UserError: if there is none, or it cannot be had or written.
    """
    library = _library()
    try:
        data, width, height = library.paste_image()
    except library.CopykittenError:
        raise UserError("There is no picture on the clipboard.") from None
    pixels = np.frombuffer(data, np.uint8).reshape(height, width, 4)
    if (pixels[..., 3] == 255).all():
        pixels = pixels[..., :3]
    make_folder(path.parent)
    write_picture(path, Picture(np.ascontiguousarray(pixels)))
    prune(path.parent)


def prune(folder: Path) -> None:
    """Remove all pictures that were pasted but the newest."""
    for old in sorted(folder.glob("pasted *.png"))[:-KEPT]:  # their names begin with the time
        old.unlink(missing_ok=True)


class Giving:
    """A picture's file on its way to the clipboard, in a process of its own: encoding a large one takes seconds.

    On Linux a clipboard asks the program that filled it, and the process stays for that until another one fills it.
    """

    def __init__(self, path: Path) -> None:
        command = [sys.executable, "-c", GIVING.format(path=str(path))]
        with deaf_children():
            self._process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)

    @property
    def is_done(self) -> bool:
        return self._process.poll() is not None

    @property
    def error(self) -> str:
        """Why it failed, as a sentence; "" if it did not."""
        if self._process.returncode == 0:
            return ""
        return "The system's clipboard did not take the picture."


def give(path: str) -> None:
    """Put a picture's file, of 8 bits, on the clipboard."""
    pixels = rgba(read_picture(path).pixels)
    height, width = pixels.shape[:2]
    _library().copy_image(np.ascontiguousarray(pixels).tobytes(), width, height, detach=sys.platform == "linux")


def check() -> None:
    """Raise `UserError` if there is no way to the clipboard."""
    _library()


def _library() -> Any:
    try:
        import copykitten
    except ImportError:
        raise UserError("Pictures on the clipboard need copykitten; install it with: pip install copykitten") from None
    return copykitten

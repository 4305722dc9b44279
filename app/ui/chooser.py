"""Choosing a file: with the system's own dialogs where there are any, with ours where there are none."""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from app.ui.browser import Browser
from app.ui.dialogs import Dialogs
from app.ui.messages import Messages

TOO_FAST = 0.4  # seconds in which nobody answers a dialog
Chosen = Callable[[Path], None]


@dataclass
class _Waiting:
    """A dialog of the system that is open, who is told the answer, and ours that takes its place if it fails."""

    dialog: Any
    chosen: Chosen
    instead: Callable[[], Browser]
    since: float = field(default_factory=time.monotonic)


class FileChooser:
    """Asks for files, one at a time.

    Attributes:
        native: the system's own dialogs are used; the window says so.
    """

    def __init__(self, dialogs: Dialogs, messages: Messages) -> None:
        self.native = False
        self._dialogs = dialogs
        self._messages = messages
        self._waiting: _Waiting | None = None

    @property
    def is_waiting(self) -> bool:
        """A dialog of the system is open."""
        return self._waiting is not None

    def ask_which(self, title: str, folder: Path, endings: tuple[str, ...], chosen: Chosen) -> None:
        """Let the person choose among the files that there are."""

        def systems(dialogs: Any) -> Any:
            patterns = " ".join(f"*{ending}" for ending in endings)
            return dialogs.open_file(title, str(folder), ["Pictures and projects", patterns, "All files", "*"])

        self._ask(systems, chosen, lambda: Browser(title, folder, endings, chosen))

    def ask_where(self, title: str, path: Path, endings: tuple[str, ...], chosen: Chosen) -> None:
        """Let the person say where something is to be written."""

        def systems(dialogs: Any) -> Any:
            return dialogs.save_file(title, str(path), [title, " ".join(f"*{ending}" for ending in endings)])

        self._ask(systems, chosen, lambda: Browser(title, path.parent, endings, chosen, path.name))

    def _ask(self, systems: Callable[[Any], Any], chosen: Chosen, ours: Callable[[], Browser]) -> None:
        if self._waiting is not None:
            return
        if self._has_system_dialogs():
            from imgui_bundle import portable_file_dialogs

            self._waiting = _Waiting(systems(portable_file_dialogs), chosen, ours)
        else:
            self._dialogs.show(ours())

    def poll(self) -> None:
        """See whether the system's dialog has been answered."""
        if self._waiting is None or not self._waiting.dialog.ready(0):
            return
        waiting, self._waiting = self._waiting, None
        answer: str | list[str] = waiting.dialog.result()
        name = answer if isinstance(answer, str) else next(iter(answer), "")
        if name:
            waiting.chosen(Path(name))
        elif time.monotonic() - waiting.since < TOO_FAST:
            # A program that fails answers like a person who cancels, only faster than one can.
            self.native = False
            self._messages.warn(
                "The system's file dialog did not open, so here is our own. "
                "`zenity --file-selection` in a terminal shows what is wrong with it."
            )
            self._dialogs.show(waiting.instead())

    def _has_system_dialogs(self) -> bool:
        if not self.native:
            return False
        helpers = ("zenity", "kdialog", "matedialog", "qarma")
        found = sys.platform in ("win32", "darwin") or any(shutil.which(helper) for helper in helpers)
        if not found:
            self.native = False
            self._messages.say("There is no zenity or kdialog here, so this is fluidwarp's own file dialog.")
        return found

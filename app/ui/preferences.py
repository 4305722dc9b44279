"""What a person likes, and what was opened lately: kept in the user's configuration folder."""

from __future__ import annotations

import json
import math
import os
from copy import deepcopy
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from app.errors import UserError, shown
from app.media.files import temporary_beside, temporary_file
from app.media.inputs import read_input
from app.media.opening import shipped_recipes
from app.ui.clipboard import pasted_folder
from app.ui.layout import LANES, LEAST_LANES, TALLEST_LANES

MOST_RECENT = 10
MOST_BYTES = 2**20  # of the file
MOST_PIXELS = 2**20  # from the corner of the screen to that of a window
LONGEST_STRING = 200.0  # points of the screen, of the stabiliser


@dataclass
class Preferences:
    """Kept between sessions; `path` None keeps nothing, for tests.

    Attributes:
        theme: "dark" or "light".
        scale: of the interface, 1 as the screen asks for.
        recent: paths of what was opened lately, newest first.
        embed: projects hold their picture.
        folder: of what was opened or saved last.
        export_folder, export_as: of what was exported last, and as what.
        names: the tools' names stand beside their icons.
        sections: which of the inspector's are open, by name.
        window: where the window was, as `GlfwWindow.place` tells it.
        keys: chords of the actions for which the person has chosen others, by the action's name.
        brushes: of each tool, by its name; `presets`: the person's own brushes, by theirs.
        lanes_height: points of the design.
        stabiliser: points of the screen, of the string that the pen pulls the brush by.
        suited: how local pushes were made for a fluid; see `EditorState`.
    """

    theme: str = "dark"
    scale: float = 1.0
    inspector: bool = True
    lanes: bool = False
    lanes_height: float = LANES
    auto_quality: bool = True
    embed: bool = True
    hint: bool = True
    recent: list[str] = field(default_factory=list)
    folder: str = ""
    export_folder: str = ""
    export_as: str = ""
    names: bool = False
    sections: dict[str, bool] = field(default_factory=dict)
    window: list[int] = field(default_factory=list)
    keys: dict[str, list[str]] = field(default_factory=dict)
    brushes: dict[str, dict[str, float]] = field(default_factory=dict)
    presets: dict[str, dict[str, float]] = field(default_factory=dict)
    stabiliser: float = 0.0
    suited: float = 0.0
    path: Path | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        self._kept = dict[str, Any]()  # the values when they were read or saved last

    @classmethod
    def load(cls) -> Preferences:
        """From the configuration folder; what is missing or broken there is as by default."""
        from platformdirs import user_config_path

        return cls._of(user_config_path("fluidwarp") / "preferences.json")

    @classmethod
    def _of(cls, path: Path) -> Preferences:
        try:
            data: Any = json.loads(read_input(path, "file of preferences", MOST_BYTES))
        except (UserError, ValueError, RecursionError):
            data = {}
        kept = cls(path=path)
        if isinstance(data, dict):
            for name in cls._parts():
                value = data.get(name)
                if isinstance(value, type(getattr(kept, name))):
                    setattr(kept, name, value)
        kept.theme = kept.theme if kept.theme in ("dark", "light") else "dark"
        kept.scale = min(max(kept.scale, 0.75), 3.0) if math.isfinite(kept.scale) else 1.0
        kept.recent = [str(name) for name in kept.recent][:MOST_RECENT]
        kept.stabiliser = min(max(kept.stabiliser, 0.0), LONGEST_STRING) if math.isfinite(kept.stabiliser) else 0.0
        kept.suited = min(max(kept.suited, 0.0), 1.0) if math.isfinite(kept.suited) else 0.0
        tall = kept.lanes_height
        kept.lanes_height = min(max(tall, LEAST_LANES), TALLEST_LANES) if math.isfinite(tall) else LANES
        is_place = len(kept.window) == 5 and all(isinstance(n, int) and abs(n) < MOST_PIXELS for n in kept.window)
        kept.window = kept.window if is_place else []
        kept.sections = {name: shown for name, shown in kept.sections.items() if isinstance(shown, bool)}
        kept.keys = {name: keys for name, keys in kept.keys.items() if isinstance(keys, list) and _can_be_shown(*keys)}
        kept.brushes = _numbers(kept.brushes)
        kept.presets = {name: brush for name, brush in _numbers(kept.presets).items() if _can_be_shown(name)}
        kept._kept = kept._values()
        return kept

    @classmethod
    def _parts(cls) -> list[str]:
        """The names of what is kept."""
        return [part.name for part in fields(cls) if part.name != "path"]

    def _values(self) -> dict[str, Any]:
        return {name: deepcopy(getattr(self, name)) for name in self._parts()}

    def save(self) -> None:
        """To the configuration folder, if it can be written; what another window has changed there meanwhile stays."""
        if self.path is None:
            return
        mine, before = self._values(), self._kept
        theirs = Preferences._of(self.path)._values() if before and os.path.exists(self.path) else mine
        data = {name: _merged(before.get(name), mine[name], theirs[name]) for name in mine}
        if mine["recent"] != before.get("recent"):
            data["recent"] = list(dict.fromkeys([*mine["recent"][:1], *theirs["recent"], *mine["recent"]]))
        self._kept = mine
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with temporary_file(temporary_beside(self.path)) as temporary:
                temporary.write_text(json.dumps(data, indent=1), "utf-8")
                temporary.replace(self.path)
        except OSError:
            pass  # preferences are not worth a message

    def opened(self, path: Path) -> None:
        """Take note of a file that was opened or saved; what was pasted is no file to the person."""
        if path.parent == pasted_folder():
            return
        name = str(path.resolve())
        self.recent = [name, *(other for other in self.recent if other != name)][:MOST_RECENT]
        if path.resolve() not in shipped_recipes().values():  # or what is saved next would go into the program's folder
            self.folder = str(path.resolve().parent)
        self.save()

    def exported(self, path: Path, kind: str) -> None:
        """Take note of where something was exported to, and as what kind of file."""
        self.export_folder, self.export_as = str(path.resolve().parent), kind
        self.save()

    def dismiss_hint(self) -> None:
        """The first hint has been followed or closed, and does not come again."""
        if self.hint:
            self.hint = False
            self.save()

    def toggle_theme(self) -> None:
        self.theme = "light" if self.theme == "dark" else "dark"
        self.save()

    @property
    def open_from(self) -> Path:
        """The folder in which to look for files."""
        return _first_of(self.folder)

    @property
    def export_to(self) -> Path:
        """The folder to export to."""
        return _first_of(self.export_folder, self.folder)


def _can_be_shown(*words: Any) -> bool:
    """They are texts, and of letters that the window has."""
    return all(isinstance(word, str) and word and shown(word) == word for word in words)


def _numbers(table: dict[str, Any]) -> dict[str, dict[str, float]]:
    """What of a table that was read holds finite numbers by name."""
    rows = {name: row for name, row in table.items() if isinstance(row, dict)}
    kinds = (int, float)
    return {
        name: {key: float(value) for key, value in row.items() if isinstance(value, kinds) and abs(value) < 1e9}
        for name, row in rows.items()
    }


def _merged(before: Any, mine: Any, theirs: Any) -> Any:
    """What is kept of a value: as it is here if that is not `before` any more, else as in the file; of a table each."""
    if isinstance(mine, dict) and before is not None:
        changed = {key: mine.get(key) for key in {*before, *mine} if key not in mine or before.get(key) != mine[key]}
        kept = {key: value for key, value in theirs.items() if key not in changed}
        return kept | {key: value for key, value in changed.items() if key in mine}
    return theirs if mine == before else mine


def _first_of(*folders: str) -> Path:
    """The first of the folders that is there, or the person's own."""
    return next((Path(name) for name in folders if name and os.path.isdir(name)), Path.home())

"""Opening and saving: with the system's own dialogs where there are any, with ours where there are none."""

from __future__ import annotations

import os
import shutil
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from imgui_bundle import imgui

from app.errors import UserError
from app.media import project as projects
from app.media.maps import MAP_ENDINGS, holds
from app.media.opening import PICTURE_ENDINGS, check_picture
from app.media.project import SUFFIX, Project
from app.model.recipe import FluidSettings, Recipe
from app.ui.browser import Browser
from app.ui.dialogs import PictureOrMap
from app.ui.loading import Loading
from app.ui.saving import SaveDialog
from app.ui.viewport import Rect
from app.ui.widgets import Ui
from app.work.recovery import Found

if TYPE_CHECKING:
    from app.ui.editor import Editor

OPENABLE = tuple(dict.fromkeys((*PICTURE_ENDINGS, SUFFIX, ".toml", *MAP_ENDINGS)))
TOO_FAST = 0.4  # seconds in which nobody answers a dialog
AT_ONCE = 0.15  # seconds that opening may take without a word about it
Chosen = Callable[[Path], None]


@dataclass
class _Waiting:
    """A dialog of the system that is open, who is told the answer, and ours that takes its place if it fails."""

    dialog: Any
    chosen: Chosen
    instead: Callable[[], Browser]
    since: float = field(default_factory=time.monotonic)


class Files:
    """Everything about files that the window does.

    Attributes:
        native: the system's own dialogs are used; the window says so.
    """

    def __init__(self, editor: Editor) -> None:
        self.editor = editor
        self.native = False
        self._waiting: _Waiting | None = None
        self._loading: Loading | None = None

    # -- opening ----------------------------------------------------------------------------------------------------

    def ask_open(self) -> None:
        self._ask_for("Open", OPENABLE, self.open)

    def ask_apply(self) -> None:
        self._ask_for("Apply this project to", PICTURE_ENDINGS, self.apply)

    def ask_map(self) -> None:
        self._ask_for("Start from a warp map", MAP_ENDINGS, self.start_from_map)

    def open(self, path: Path) -> None:
        """Open a picture, a recipe or a project, after asking about unsaved work; of a warp map, start from it.

        What may be a picture as well as a map is asked about.
        """
        match holds(path):
            case "map":
                self.start_from_map(path)
            case "either":
                asked = PictureOrMap(path.name, lambda: self.open_work(path), lambda: self.start_from_map(path))
                self.editor.dialogs.append(asked)
            case "picture":
                self.open_work(path)

    def open_work(self, path: Path) -> None:
        """Open a picture, a recipe or a project; about unsaved work is asked once that has been read."""
        fluid = self._feel()
        self._open(path, lambda: load_any(path, fluid), leaves=True)

    def _feel(self) -> dict[str, Any]:
        """What the person has set of the fluid; a recipe with forces of its own has been set by nobody here."""
        session = self.editor.session
        return {} if session.recipe.force else settings_of(session.recipe.fluid_at(session.tick))

    def apply(self, path: Path) -> None:
        """Do to another picture what has been done to this one."""
        recipe = self.editor.session.recipe
        self._open(path, lambda: projects.from_picture(path, recipe))

    def restore(self, found: Found) -> None:
        """Go on with work that was not saved when fluidwarp ended."""

        def load() -> Project:
            project = found.load()
            check_picture(project.picture)
            return project

        self._open(found.file, load, found)

    def start_from_map(self, path: Path) -> None:
        """Let what is done to the picture begin with a warp map instead of the picture as it is; can be undone.

        Raises:
            UserError: if it is none, or does not fit the picture.
        """
        editor, path = self.editor, path.resolve()
        editor.session.start_from_map(str(path))
        editor.preferences.folder = str(path.parent)
        editor.messages.done(f"The picture now starts from {path.name}. Undo takes it away again.")

    def _open(self, path: Path, load: Callable[[], Project], found: Found | None = None, leaves: bool = False) -> None:
        """Read a file in the background, and open it then; what was being read before is not wanted any more.

        `leaves`: the work that is open has not to do with it.
        """
        editor = self.editor
        self.give_up_loading()
        recipe = None if leaves else editor.session.document.recipe
        self._loading = Loading(path, load, editor.canvas.largest, recipe, found)
        self._loading.is_done(AT_ONCE)
        self._look_at_loading()

    @property
    def is_loading(self) -> bool:
        """A file is being read."""
        return self._loading is not None

    def give_up_loading(self) -> None:
        """Open nothing; the thread ends by itself."""
        if self._loading is not None:
            self._leave(self._loading)
        self._loading = None

    def _look_at_loading(self) -> None:
        editor, loading = self.editor, self._loading
        if loading is None or not loading.is_done():
            return
        # Nobody's stroke is broken off by a file that has come at last, nor does a dialog about the work lose it.
        if editor.session.is_painting or (editor.dialogs and editor.session is not editor.placeholder):
            return
        self._loading = None
        if loading.error:
            self._leave(loading)
            editor.messages.warn(loading.error)
        elif editor.is_dirty and editor.session.document.recipe is not loading.recipe:
            editor.unless_unsaved(f"open {loading.path.name}", lambda: self._show(loading))
        else:
            self._show(loading)

    def _show(self, loading: Loading) -> None:
        editor = self.editor
        assert loading.project is not None
        try:
            editor.open(loading.project, loading.pixels, loading.found)
        except UserError as error:
            self._leave(loading)
            editor.messages.warn(error.in_window)
            return
        editor.preferences.opened(loading.path)
        for notice in editor.session.pictures.notices:
            editor.messages.say(notice)
        if loading.found is None:
            return
        if loading.found.is_as_it_was(loading.project):
            editor.messages.done(f"“{editor.session.project.name}” is as it was. It has not been saved yet.")
        else:
            name = loading.project.recipe.picture
            editor.messages.warn(
                f"All strokes are here, but {name} is not the same picture any more as when they were made."
            )

    @staticmethod
    def _leave(loading: Loading) -> None:
        """What could not be restored, or was not wanted yet, is offered again."""
        if loading.found is not None:
            loading.found.leave()

    def draw(self, ui: Ui, canvas: Rect) -> None:
        """What is being read, with a button to give it up."""
        if self._loading is None:
            return
        with ui.floating("loading", canvas.x + canvas.width / 2, canvas.y + ui.px(16), (0.5, 0)):
            imgui.begin_group()
            ui.text(f"Opening {self._loading.path.name} ...", size=14)
            ui.dim("You can go on meanwhile.")
            imgui.end_group()
            imgui.same_line(0, ui.px(16))
            if ui.button("Cancel##loading", height=30):
                self.give_up_loading()

    # -- saving -----------------------------------------------------------------------------------------------------

    def save(self) -> bool:
        """Save where it was saved last; where that is nowhere, ask. True if it is saved now."""
        path = self.editor.session.project.path
        if path is None:
            self.ask_save()
            return False
        return self.save_as(path)

    def ask_save(self, then: Callable[[], None] | None = None) -> None:
        project = self.editor.session.project
        path = project.path or self._folder() / f"{project.name}{SUFFIX}"
        self.editor.dialogs.append(SaveDialog(self.editor, path, then))

    def save_as(self, path: Path, embed: bool | None = None) -> bool:
        """Save the project as `write` does; True if it could be done."""
        try:
            self.write(path, embed)
        except UserError as error:
            self.editor.messages.warn(error.in_window)
            return False
        return True

    def write(self, path: Path, embed: bool | None = None) -> None:
        """Save the project. What is still moving comes to rest first.

        `embed`: the picture is kept in it; None is as it was saved last, or else as the person likes.

        Raises:
            UserError: if it cannot be done.
        """
        from dataclasses import replace

        editor, session = self.editor, self.editor.session
        session.release()
        if session.coasting:
            session.settle(2.0)
            session.stop_recording()
        project = replace(session.project, recipe=session.document.recipe)
        if embed is None:
            embed = project.embedded if project.path is not None else editor.preferences.embed
        session.saved(projects.save(project, path, embed))
        editor.preferences.opened(path)
        editor.messages.done(f"Saved {path.name}")

    # -- choosing a file --------------------------------------------------------------------------------------------

    def ask_where(self, title: str, path: Path, endings: tuple[str, ...], chosen: Chosen) -> None:
        """Let the person say where something is to be written."""
        self._ask_where(title, path, endings, chosen)

    @property
    def is_waiting(self) -> bool:
        """A dialog of the system is open."""
        return self._waiting is not None

    def poll(self) -> None:
        """See whether the system's dialog has been answered, and a file has been read."""
        self._look_at_loading()
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
            self.editor.messages.warn(
                "The system's file dialog did not open, so here is our own. "
                "`zenity --file-selection` in a terminal shows what is wrong with it."
            )
            self.editor.dialogs.append(waiting.instead())

    def _folder(self) -> Path:
        folder = Path(self.editor.preferences.folder or Path.home())
        return folder if os.path.isdir(folder) else Path.home()

    def _ask_for(self, title: str, endings: tuple[str, ...], chosen: Chosen) -> None:
        def ours() -> Browser:
            return Browser(title, self._folder(), endings, chosen)

        if self._waiting is not None:
            return
        if self._has_system_dialogs():
            from imgui_bundle import portable_file_dialogs as dialogs

            patterns = " ".join(f"*{ending}" for ending in endings)
            filters = ["Pictures and projects", patterns, "All files", "*"]
            self._waiting = _Waiting(dialogs.open_file(title, str(self._folder()), filters), chosen, ours)
        else:
            self.editor.dialogs.append(ours())

    def _ask_where(self, title: str, path: Path, endings: tuple[str, ...], chosen: Chosen) -> None:
        def ours() -> Browser:
            return Browser(title, path.parent, endings, chosen, path.name)

        if self._waiting is not None:
            return
        if self._has_system_dialogs():
            from imgui_bundle import portable_file_dialogs as dialogs

            patterns = " ".join(f"*{ending}" for ending in endings)
            self._waiting = _Waiting(dialogs.save_file(title, str(path), [title, patterns]), chosen, ours)
        else:
            self.editor.dialogs.append(ours())

    def _has_system_dialogs(self) -> bool:
        if not self.native:
            return False
        helpers = ("zenity", "kdialog", "matedialog", "qarma")
        found = sys.platform in ("win32", "darwin") or any(shutil.which(helper) for helper in helpers)
        if not found:
            self.native = False
            self.editor.messages.say("There is no zenity or kdialog here, so this is fluidwarp's own file dialog.")
        return found


def load_any(path: Path, fluid: dict[str, Any] | None = None) -> Project:
    """The project behind a picture, a recipe or a project file.

    `fluid`: settings with which the work on a picture begins.

    Raises:
        UserError: if it is none of them, or cannot be read.
    """
    if path.suffix.lower() == ".toml":
        project = projects.from_recipe(path)
    elif projects.is_project(path):
        project = projects.load(path)
    else:
        project = projects.from_picture(path, fresh_recipe(fluid))
    check_picture(project.picture, path.name)
    return project


def settings_of(fluid: FluidSettings) -> dict[str, Any]:
    """What the inspector sets of a fluid."""
    return {name: getattr(fluid, name) for name in ("viscosity", "drag", "walls")}


def fresh_recipe(settings: dict[str, Any] | None = None) -> Recipe:
    """What a picture that is newly opened starts with: the default, and what of the fluid the person has set."""
    from app.model.presets import DEFAULT

    fluid = FluidSettings(dt=1 / 30, viscosity=DEFAULT.viscosity, drag=DEFAULT.drag)
    fluid = fluid.model_copy(update=settings or {})
    return Recipe(duration=fluid.dt, fluid=fluid, edges="clamp")

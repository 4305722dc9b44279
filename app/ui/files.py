"""Opening and saving: with the system's own dialogs where there are any, with ours where there are none."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app import project as projects
from app.errors import UserError
from app.opening import PICTURE_ENDINGS, check_picture
from app.project import SUFFIX, Project
from app.recipe import Recipe
from app.ui.browser import Browser

if TYPE_CHECKING:
    from app.ui.editor import Editor

OPENABLE = (*PICTURE_ENDINGS, SUFFIX, ".toml")
Chosen = Callable[[Path], None]


class Files:
    """Everything about files that the window does.

    Attributes:
        native: the system's own dialogs are used; the window says so.
    """

    def __init__(self, editor: Editor) -> None:
        self.editor = editor
        self.native = False
        self._waiting: tuple[Any, Chosen] | None = None

    # -- opening ----------------------------------------------------------------------------------------------------

    def ask_open(self) -> None:
        self._ask_for("Open", OPENABLE, self.open)

    def ask_apply(self) -> None:
        self._ask_for("Apply this project to", PICTURE_ENDINGS, self.apply)

    def open(self, path: Path) -> None:
        """Open a picture, a recipe or a project, after asking about unsaved work."""
        self.editor.unless_unsaved("open something else", lambda: self._open(path))

    def apply(self, path: Path) -> None:
        """Do to another picture what has been done to this one."""
        recipe = self.editor.session.recipe
        self._open(path, lambda: projects.from_picture(path, recipe))

    def _open(self, path: Path, load: Callable[[], Project] | None = None) -> None:
        editor = self.editor
        try:
            editor.open(load() if load else load_any(path))
        except UserError as error:
            editor.messages.warn(str(error))
            return
        editor.preferences.opened(path)
        for notice in editor.session.pictures.notices:
            editor.messages.say(notice)

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

        def chosen(path: Path) -> None:
            path = path if path.suffix.lower() == SUFFIX else path.with_name(path.name + SUFFIX)
            if self.save_as(path) and then is not None:
                then()

        name = project.path or self._folder() / f"{project.name}{SUFFIX}"
        self._ask_where("Save", name, (SUFFIX,), chosen)

    def save_as(self, path: Path) -> bool:
        """Save the project; True if it could be done. What is still moving comes to rest first."""
        from dataclasses import replace

        editor, session = self.editor, self.editor.session
        session.release()
        if session.coasting:
            session.settle(2.0)
            session.pause()
        project = replace(session.project, recipe=session.document.recipe)
        try:
            session.saved(projects.save(project, path, editor.preferences.embed))
        except UserError as error:
            editor.messages.warn(str(error))
            return False
        editor.preferences.opened(path)
        editor.messages.done(f"Saved {path.name}")
        return True

    # -- choosing a file --------------------------------------------------------------------------------------------

    def ask_where(self, title: str, path: Path, endings: tuple[str, ...], chosen: Chosen) -> None:
        """Let the person say where something is to be written."""
        self._ask_where(title, path, endings, chosen)

    @property
    def is_waiting(self) -> bool:
        """A dialog of the system is open."""
        return self._waiting is not None

    def poll(self) -> None:
        """See whether the system's dialog has been answered."""
        if self._waiting is None or not self._waiting[0].ready(0):
            return
        (dialog, chosen), self._waiting = self._waiting, None
        answer: str | list[str] = dialog.result()
        name = answer if isinstance(answer, str) else next(iter(answer), "")
        if name:
            chosen(Path(name))

    def _folder(self) -> Path:
        folder = Path(self.editor.preferences.folder or Path.home())
        return folder if folder.is_dir() else Path.home()

    def _ask_for(self, title: str, endings: tuple[str, ...], chosen: Chosen) -> None:
        if self._waiting is not None:
            return
        if self._has_system_dialogs():
            from imgui_bundle import portable_file_dialogs as dialogs

            patterns = " ".join(f"*{ending}" for ending in endings)
            dialog = dialogs.open_file(
                title, str(self._folder()), ["Pictures and projects", patterns, "All files", "*"]
            )
            self._waiting = (dialog, chosen)
        else:
            self.editor.dialogs.append(Browser(title, self._folder(), endings, chosen))

    def _ask_where(self, title: str, path: Path, endings: tuple[str, ...], chosen: Chosen) -> None:
        if self._waiting is not None:
            return
        if self._has_system_dialogs():
            from imgui_bundle import portable_file_dialogs as dialogs

            patterns = " ".join(f"*{ending}" for ending in endings)
            self._waiting = (dialogs.save_file(title, str(path), [title, patterns]), chosen)
        else:
            self.editor.dialogs.append(Browser(title, path.parent, endings, chosen, path.name))

    def _has_system_dialogs(self) -> bool:
        if not self.native:
            return False
        helpers = ("zenity", "kdialog", "matedialog", "qarma")
        return sys.platform in ("win32", "darwin") or any(shutil.which(helper) for helper in helpers)


def load_any(path: Path) -> Project:
    """The project behind a picture, a recipe or a project file.

    Raises:
        UserError: if it is none of them, or cannot be read.
    """
    if path.suffix.lower() == ".toml":
        project = projects.from_recipe(path)
    elif projects.is_project(path):
        project = projects.load(path)
    else:
        project = projects.from_picture(path, fresh_recipe())
    check_picture(project.picture, project.recipe.fluid.grid)
    return project


def fresh_recipe() -> Recipe:
    """What a picture that is newly opened starts with."""
    from app.presets import DEFAULT
    from app.recipe import FluidSettings

    fluid = FluidSettings(dt=1 / 30, viscosity=DEFAULT.viscosity, drag=DEFAULT.drag)
    return Recipe(duration=fluid.dt, fluid=fluid, edges="clamp")

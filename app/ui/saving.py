"""Asking where a project is saved, and whether its picture goes into it."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from imgui_bundle import imgui
from imgui_bundle.imgui import ImVec2

from app.errors import printable
from app.media.project import SUFFIX, Project
from app.ui.chooser import FileChooser
from app.ui.clipboard import pasted_folder
from app.ui.dialogs import EXISTS, Dialog, Replaced
from app.ui.preferences import Preferences
from app.ui.widgets import Ui


class SaveDialog(Dialog):
    """The name of a project, and the choice between keeping its picture and referring to it.

    Args:
        project: what is saved.
        path: proposed.
        preferences: say whether the picture goes into it, and are told.
        chooser: lets the person look for another place.
        write: saves it at a path, with its picture or without.
        then: what is done once it is saved.
    """

    width = 500

    def __init__(
        self,
        project: Project,
        path: Path,
        preferences: Preferences,
        chooser: FileChooser,
        write: Callable[[Path, bool], None],
        then: Callable[[], None] | None,
    ) -> None:
        super().__init__("Save the project")
        self.folder = path.parent
        self.name = printable(path.name).removesuffix(SUFFIX)
        # A picture that is only inside a project has no file to refer to.
        self.must_embed = not project.is_linked and (project.keeper is not None or project.folder == pasted_folder())
        self.must_link = project.is_linked
        self.embed = self.must_embed or (preferences.embed and not self.must_link)
        self._picture = project.folder / (project.recipe.picture or "")
        self._bytes = len(project.data)
        self._own, self._project = project.path, project
        self._preferences = preferences
        self._chooser = chooser
        self._write = write
        self._then = then
        self._asks_name = True
        self._replaced = Replaced()

    @property
    def path(self) -> Path:
        return self.folder / (self.name.strip().removesuffix(SUFFIX) + SUFFIX)

    def body(self, ui: Ui) -> bool:
        with self.scrolled(ui, foot=6 + 32):
            entered = self._ask(ui)
        imgui.dummy(ImVec2(0, ui.px(6)))
        imgui.set_cursor_pos_x(imgui.get_window_width() - ui.px(24 + 96 + 8 + 96))
        if ui.button("Cancel", width=96):
            return False
        imgui.same_line()
        with ui.enabled(bool(self.name.strip())):
            if (ui.button("Save", primary=True, width=96) or entered) and self.name.strip():
                return not self._save()
        return True

    def _ask(self, ui: Ui) -> bool:
        """Where it goes, and what goes into it; True if Enter was pressed in the name."""
        imgui.set_next_item_width(imgui.get_content_region_avail().x - ui.px(104))
        if self._asks_name:
            imgui.set_keyboard_focus_here()
            self._asks_name = False
        flags = imgui.InputTextFlags_.enter_returns_true | imgui.InputTextFlags_.auto_select_all
        entered, self.name = imgui.input_text("##name", self.name, flags)
        imgui.same_line()
        if ui.button("Browse", width=96, height=27):
            self._chooser.ask_where("Save", self.path, (SUFFIX,), self._chosen)
        ui.wrapped(str(self.path), ui.palette.dim, 13)
        said = ""
        if os.path.exists(self.path) and self.path != self._own:
            said = EXISTS
        elif self.path == self._own and self._project.is_overtaken:
            said = "Something else has saved into this file since you opened it. What it saved will be replaced."
        self._replaced.tell(ui, self.path, said)
        imgui.dummy(ImVec2(0, ui.px(2)))
        with ui.enabled(not (self.must_embed or self.must_link)):
            self.embed = ui.check("Keep the picture inside the project", self.embed)
        if self.must_embed:
            about = "The picture is only in the project, and stays there."
        elif self.must_link:
            about = f"A clip is never kept inside: the project needs {self._picture} to stay where it is."
        elif self.embed:
            about = f"One file that opens anywhere, with {_size(self._bytes)} of picture in it."
        else:
            about = f"A small file that needs {self._picture} to stay where it is."
        ui.wrapped(about, ui.palette.dim, 13)
        return entered

    def _save(self) -> bool:
        if not self._replaced.is_told:
            self._asks_name = True
            return False
        if not (self.must_embed or self.must_link):
            self._preferences.embed = self.embed
        saved = self.attempt(lambda: self._write(self.path, self.embed))
        if saved and self._then is not None:
            self._then()
        self._asks_name = not saved  # Enter has taken the keys away from it
        return saved

    def _chosen(self, path: Path) -> None:
        self.folder, self.name = path.parent, printable(path.name).removesuffix(SUFFIX)


def _size(count: int) -> str:
    """A number of bytes as a person reads it."""
    return f"{count / 2**20:.1f} MB" if count >= 2**20 else f"{max(count / 2**10, 1):.0f} KB"

"""Choosing a file inside the window, where the system has no dialog for it."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from imgui_bundle import imgui, imgui_ctx
from imgui_bundle.imgui import ImVec2

from app.errors import printable, shown
from app.ui import icons
from app.ui.dialogs import Dialog
from app.ui.theme import packed
from app.ui.widgets import Ui


class Browser(Dialog):
    """A list of a folder's files.

    Args:
        title: what the file is chosen for.
        folder: where to begin.
        endings: the files that are shown, by how their names end.
        chosen: is told the file.
        name: proposes a name; None chooses among what there is.

    Attributes:
        inside: what is listed.
    """

    width, height = 640, 460

    def __init__(
        self,
        title: str,
        folder: Path,
        endings: tuple[str, ...],
        chosen: Callable[[Path], None],
        name: str | None = None,
    ) -> None:
        super().__init__(title)
        self.endings = endings
        self.name = printable(name or "")
        self.writes = name is not None
        self._chosen = chosen
        self._selected: Path | None = None
        self._replaces: Path | None = None  # what the person has been told is there already
        self.go(folder if os.path.isdir(folder) else Path.home())

    def go(self, folder: Path) -> None:
        """Show another folder."""
        self.folder, self.typed = folder, printable(str(folder))
        self._selected, self._problem, self.problem = None, "", ""
        try:
            inside = [Path(entry.path) for entry in os.scandir(folder) if not entry.name.startswith(".")]
        except OSError as error:
            self._problem, inside = error.strerror or "it cannot be read", []
        # Not what Path has of them, which raises where the folder may not be searched.
        folders = [path for path in inside if os.path.isdir(path)]
        files = [path for path in inside if path.suffix.lower() in self.endings and os.path.isfile(path)]
        self.inside = sorted(folders, key=_by_name) + sorted(files, key=_by_name)

    def body(self, ui: Ui) -> bool:
        if ui.icon_button("up", "up", "The folder above", size=30):
            self.go(self.folder.parent)
        imgui.same_line()
        imgui.set_next_item_width(-1)
        entered, self.typed = imgui.input_text("##folder", self.typed, imgui.InputTextFlags_.enter_returns_true)
        if entered and not self._go_to_typed():
            return False
        foot = ui.px(88 if self.writes else 48)
        with imgui_ctx.begin_child("files", ImVec2(0, -foot)):
            going: Path | None = None
            done = False
            for number, path in enumerate(self.inside):
                imgui.push_id(number)
                going, done = self._row(ui, path, going, done)
                imgui.pop_id()
            if not self.inside:
                ui.dim(self._problem or "Nothing here that can be opened.")
        if going is not None:
            self.go(going)
        named = False
        if self.writes:
            imgui.set_next_item_width(-1)
            named, self.name = imgui.input_text("##name", self.name, imgui.InputTextFlags_.enter_returns_true)
        pressed = self._foot(ui) or named
        if pressed and self._is_typed:  # of a folder, where the name belongs
            if not self._go_to_typed():
                return False
            done = self.writes and not self._is_typed and not self.problem
        elif pressed and self._selected is not None and os.path.isdir(self._selected):
            self.go(self._selected)
        else:
            done = done or pressed
        target = self._target
        return target is None or not done or not self._take(target)

    @property
    def _is_typed(self) -> bool:
        """Another path has been typed than that of the folder that is shown."""
        return self.typed != printable(str(self.folder))

    @property
    def _target(self) -> Path | None:
        """The file that is chosen in the folder that is shown."""
        return (self.folder / self.name if self.name else None) if self.writes else self._selected

    def _go_to_typed(self) -> bool:
        """Show the folder that is typed, or hand the file over; False once that is done."""
        typed = Path(self.typed).expanduser()
        if os.path.isdir(typed):  # unlike Path's own, no error where a name is too long
            self.go(typed)
        elif os.path.exists(typed) or self.writes:
            return not self._take(typed)
        else:
            self.problem = shown(f"There is no {typed}.")
        return True

    def _row(self, ui: Ui, path: Path, going: Path | None, done: bool) -> tuple[Path | None, bool]:
        corner = imgui.get_cursor_screen_pos()
        flags = imgui.SelectableFlags_.allow_double_click
        picked, _ = imgui.selectable("##file", path == self._selected, flags, ImVec2(0, ui.px(26)))
        draw = imgui.get_window_draw_list()
        icon = "folder" if os.path.isdir(path) else "picture"
        ink = packed(ui.palette.accent if os.path.isdir(path) else ui.palette.dim)
        icons.draw(draw, icon, corner.x + ui.px(4), corner.y + ui.px(4), ui.px(18), ink)
        draw.add_text(ImVec2(corner.x + ui.px(30), corner.y + ui.px(5)), packed(ui.palette.text), printable(path.name))
        if picked:
            twice = imgui.is_mouse_double_clicked(0)
            self.typed = printable(str(self.folder))  # what is picked counts now
            if os.path.isdir(path):
                self._selected = None if self.writes else path
                return (path if twice else going), done
            self._selected = path
            if self.writes:
                self.name = printable(path.name)
            return going, done or twice
        return going, done

    def _foot(self, ui: Ui) -> bool:
        typed = Path(self.typed).expanduser() if self._is_typed else self._target
        asks = typed is not None and typed == self._replaces
        label = "Replace" if asks else self.title.split()[0]
        if typed is not None and asks:
            ui.text(f"{printable(typed.name)} is there already.", ui.palette.accent, 14)
            imgui.same_line()
        imgui.set_cursor_pos_x(imgui.get_window_width() - ui.px(204))
        if ui.button("Cancel", width=88):
            self.close()
        imgui.same_line()
        with ui.enabled(self._is_typed or self._target is not None):
            return ui.button(label, primary=True, width=88)

    def _take(self, path: Path) -> bool:
        """Hand the file over; False where that fails, or the person has to say first that it may be replaced."""
        if self.writes and os.path.exists(path) and path != self._replaces:
            self._replaces = path
            return False
        return self.attempt(lambda: self._chosen(path))


def _by_name(path: Path) -> str:
    return path.name.casefold()

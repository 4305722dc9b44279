"""Dialogs: what has to be answered before anything else."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import floor
from pathlib import Path

from imgui_bundle import imgui, imgui_ctx
from imgui_bundle.imgui import ImVec2

from app.errors import UserError
from app.media.inputs import state_of
from app.ui.editor_state import EditorState
from app.ui.preferences import Preferences
from app.ui.viewport import Rect
from app.ui.widgets import Ui
from app.ui.workspace import Workspace

EXISTS = "This file exists and will be replaced."


class Dialog(ABC):
    """A window over everything, until it is answered or Escape is pressed.

    Attributes:
        width, height: in points of the design; a height of 0 is that of what is in it.
        tallest: to which it may grow; it begins as high up as leaves room for that.
        rect: where it was drawn last.
        entered: Enter was pressed in this frame, and belongs neither to a field that is being typed in nor to what the
            arrows have gone to.
        problem: why what the person wanted of it could not be done.
    """

    width, height = 480.0, 0.0
    tallest = 0.0

    def __init__(self, title: str) -> None:
        self.title = title
        self.rect = Rect(0, 0, 0, 0)
        self.problem = ""
        self.entered = False
        self._open = True
        self._highest = 0.0  # pixels, to which the window lets it grow
        self._scrolls = 0.0  # pixels, the height of what can be scrolled
        self._is_settled = True
        self._top: float | None = None
        self._placed_for: tuple[float, float, float] | None = None

    @property
    def is_busy(self) -> bool:
        """Something is going on in it, so that frames have to be drawn."""
        return False

    def close(self) -> None:
        self._open = False

    @property
    def is_listening(self) -> bool:
        """Whatever key is pressed next is taken by `hear`, and does nothing else."""
        return False

    def hear(self, chord: str) -> None:  # noqa: B027
        """A key was pressed."""

    def attempt(self, doing: Callable[[], object]) -> bool:
        """Do what the person wants; True if it went well. What went wrong is told here: a message would lie below."""
        self.problem = ""
        try:
            doing()
        except UserError as error:
            self.problem = error.in_window
        return not self.problem

    @abstractmethod
    def body(self, ui: Ui) -> bool:
        """Draw what is in it; False once it is done with."""

    @contextmanager
    def scrolled(self, ui: Ui, foot: float, most: float = float("inf")) -> Iterator[None]:
        """Draw what scrolls if higher than `most` points or the window; `foot` points stay below it, for buttons."""
        beneath = 2 * imgui.get_style().item_spacing.y + ui.px(foot) + self._padding(ui)
        room = max(self._highest - imgui.get_cursor_pos_y() - beneath, ui.px(40))
        imgui.set_next_window_size_constraints(ImVec2(0, 0), ImVec2(float("inf"), min(room, ui.px(most))))
        flags = imgui.ChildFlags_.auto_resize_y | imgui.ChildFlags_.nav_flattened
        with imgui_ctx.begin_child("scrolled", ImVec2(0, 0), flags):
            yield
            height, self._scrolls = self._scrolls, imgui.get_cursor_pos_y()
        self._is_settled = self._scrolls == height  # it takes its height in the next frame

    def release(self) -> None:  # noqa: B027
        """Free what it holds, if anything; it is not drawn any more."""

    def draw(self, ui: Ui, dialogs: Dialogs) -> bool:
        """Draw it; False once it is done with."""
        name = f"###dialog{id(self)}"
        if not imgui.is_popup_open(name):
            imgui.open_popup(name)
        display, edge = imgui.get_io().display_size, ui.px(16)
        self._place(ui, display, edge)
        width, self._highest = min(ui.px(self.width), display.x - 2 * edge), max(display.y - 2 * edge, 1.0)
        imgui.set_next_window_size(ImVec2(width, min(ui.px(self.height), self._highest)))
        imgui.set_next_window_size_constraints(ImVec2(width, 0), ImVec2(width, self._highest))
        imgui.push_style_var(imgui.StyleVar_.window_padding, ImVec2(ui.px(24), self._padding(ui)))
        imgui.push_style_var(imgui.StyleVar_.window_rounding, ui.px(12))
        flags = imgui.WindowFlags_.no_title_bar | imgui.WindowFlags_.no_resize | imgui.WindowFlags_.no_move
        flags |= imgui.WindowFlags_.no_saved_settings
        if not self.height:
            flags |= imgui.WindowFlags_.always_auto_resize
        shown, _ = imgui.begin_popup_modal(name, None, flags)
        imgui.pop_style_var(2)
        if not shown:
            return self._open
        try:
            ui.text(self.title, size=19, bold=True)
            imgui.dummy(ImVec2(0, ui.px(4)))
            if self.problem:
                ui.wrapped(self.problem, ui.palette.accent, 14)
                imgui.dummy(ImVec2(0, ui.px(4)))
            self._take_note(imgui.get_window_pos(), imgui.get_window_size(), dialogs.changed)
            # A field that is being typed in is left by Escape first.
            escaped = imgui.is_key_pressed(imgui.Key.escape) and not imgui.is_any_item_active()
            entered = imgui.is_key_pressed(imgui.Key.enter, False) and not imgui.is_any_item_active()
            self.entered = entered and not imgui.get_io().nav_visible
            self._is_settled = True
            going_on = self.body(ui) and self._open
            if not self._is_settled:
                dialogs.changed()
            # Only the topmost dialog hears Escape; it may just have opened another one.
            is_topmost = dialogs.shown[-1] is self
            going_on = going_on and not (escaped and is_topmost)
            if not (going_on and is_topmost):
                imgui.close_current_popup()
        finally:
            imgui.end_popup()
        return going_on

    def _padding(self, ui: Ui) -> float:
        """Pixels above and below; fewer where there is no room to give away."""
        return floor(min(ui.px(20), self._highest / 20))

    def _place(self, ui: Ui, display: ImVec2, edge: float) -> None:
        """In the middle, and then with its head where it is: what is in it changes under a pointer that rests."""
        if self._placed_for != (display.x, display.y, ui.scale):
            self._placed_for, self._top = (display.x, display.y, ui.scale), None
            if self.tallest:
                self._top = max((display.y - ui.px(self.tallest)) / 2, edge)
        if self._top is None:
            imgui.set_next_window_pos(ImVec2(display.x / 2, display.y / 2), imgui.Cond_.always, ImVec2(0.5, 0.5))
        else:
            top = max(min(self._top, display.y - edge - self.rect.height), edge)
            imgui.set_next_window_pos(ImVec2(display.x / 2, top), imgui.Cond_.always, ImVec2(0.5, 0.0))

    def _take_note(self, corner: ImVec2, size: ImVec2, changed: Callable[[], None]) -> None:
        """Remember where it is; its size follows what is in it a frame later."""
        rect = Rect(corner.x, corner.y, size.x, size.y)
        if (rect.width, rect.height) != (self.rect.width, self.rect.height):
            changed()
        elif self._top is None:
            self._top = rect.y
        self.rect = rect


class Dialogs:
    """The dialogs that are open, the last of which is drawn and answered first.

    Args:
        changed: called when the size of one does, as that of messages.
    """

    def __init__(self, changed: Callable[[], None]) -> None:
        self.shown: list[Dialog] = []
        self.changed = changed
        self._done: list[Dialog] = []  # with which the frame that is being drawn may still hold pictures

    @property
    def is_busy(self) -> bool:
        """Something is going on in one, so that frames have to be drawn."""
        return any(dialog.is_busy for dialog in self.shown)

    @property
    def is_listening(self) -> bool:
        """The topmost one takes the next key, whatever it does otherwise."""
        return bool(self.shown) and self.shown[-1].is_listening

    def show(self, dialog: Dialog) -> None:
        self.shown.append(dialog)

    def ask(self, question: Dialog) -> None:
        """Show one; of the same kind the last one counts, as where a person closes the window once more."""
        for other in [other for other in self.shown if type(other) is type(question)]:
            self._remove(other)
        self.shown.append(question)

    def draw(self, ui: Ui) -> None:
        """Draw the topmost one."""
        self._release_done()
        if self.shown and not (dialog := self.shown[-1]).draw(ui, self):
            self._remove(dialog)

    def release(self) -> None:
        self._done += self.shown
        self.shown = []
        self._release_done()

    def _remove(self, dialog: Dialog) -> None:
        if dialog in self.shown:  # it may be gone, for another of its kind
            self.shown.remove(dialog)
            self._done.append(dialog)

    def _release_done(self) -> None:
        for dialog in self._done:
            dialog.release()
        self._done.clear()


def beside(ui: Ui, left: float, right: float) -> None:
    """Go to the right end of a row that begins with `left` points, or of the next one if `right` more do not fit."""
    start = imgui.get_window_width() - ui.px(24 + right)
    if start >= ui.px(24 + left + 8):
        imgui.same_line(start)
    else:
        imgui.set_cursor_pos_x(max(start, ui.px(24)))


class Replaced:
    """Tells that a file will be replaced: what a frame before has told of may be.

    Attributes:
        is_told: the file that is there now, if any, was told of before this frame.
    """

    def __init__(self) -> None:
        self.is_told = True
        self._told: tuple[Path, tuple[int, ...] | None] | None = None

    def tell(self, ui: Ui, path: Path, said: str) -> None:
        """Draw what is said of the file at `path`; "" if none is replaced."""
        now = (path, state_of(path)) if said else None
        self.is_told, self._told = now in (None, self._told), now
        if said:
            ui.wrapped(said, ui.palette.accent, 13)


class Unsaved(Dialog):
    """Asks what shall become of unsaved work.

    Args:
        workspace: whose work it is.
        what: the person is about to do.
        can_undo: Undo comes back to the work afterwards, as long as the window is open and has room for it.
        save: saves, and then does what it is given.
        then: does what the person is about to do.
    """

    def __init__(
        self,
        workspace: Workspace,
        what: str,
        can_undo: bool,
        save: Callable[[Callable[[], None]], None],
        then: Callable[[], None],
    ) -> None:
        super().__init__("Save your changes first?")
        self._workspace = workspace
        self._what = what
        self._can_undo = can_undo
        self._save = save
        self._then = then

    def body(self, ui: Ui) -> bool:
        name = self._workspace.session.project.name
        said = f"is lost if you {self._what} without saving."
        if self._can_undo:
            said = f"is not saved. After you {self._what}, you can come back to it with Undo; it is lost when you quit."
        ui.wrapped(f"What you have done to “{name}” {said}", ui.palette.dim, 14)
        imgui.dummy(ImVec2(0, ui.px(8)))
        if ui.button("Don't save", width=108):
            session = self._workspace.session
            self._then()
            self._workspace.give_up(session)
            return False
        imgui.same_line(imgui.get_window_width() - ui.px(24 + 96 + 8 + 96))
        if ui.button("Cancel", width=96):
            return False
        imgui.same_line()
        if ui.button("Save", primary=True, width=96) or self.entered:
            self._save(self._then)
            return False
        return True


class PictureOrMap(Dialog):
    """Asks what a file is to be taken for that may be either."""

    def __init__(self, name: str, picture: Callable[[], None], use: Callable[[], None]) -> None:
        super().__init__("A picture or a warp map?")
        self._name = name
        self._picture = picture
        self._use = use

    def body(self, ui: Ui) -> bool:
        about = f"“{self._name}” holds floating-point colours, or the places of an ST map."
        ui.wrapped(about, ui.palette.dim, 14)
        imgui.dummy(ImVec2(0, ui.px(8)))
        if ui.button("Cancel", width=96):
            return False
        beside(ui, 96, 144 + 8 + 112)
        chosen = None
        if ui.button("Use as map", width=112):
            chosen = self._use
        imgui.same_line()
        if ui.button("Open as picture", primary=True, width=144) or self.entered:
            chosen = self._picture
        if chosen is None:
            return True
        # Answered, whatever comes of it.
        self.close()
        chosen()
        return False


class Preferring(Dialog):
    """What the person likes."""

    width = 420

    def __init__(self, preferences: Preferences, state: EditorState) -> None:
        super().__init__("Preferences")
        self._preferences = preferences
        self._state = state

    def body(self, ui: Ui) -> bool:
        likes = self._preferences
        with self.scrolled(ui, foot=8 + 32):
            ui.dim("Theme")
            themes = ("dark", "light")
            likes.theme = themes[ui.segmented("theme", ("Dark", "Light"), themes.index(likes.theme), -1)]
            ui.dim("Size of the interface")
            scales = (0.85, 1.0, 1.25, 1.5, 2.0)
            names = [f"{scale:.0%}".replace("%", " %") for scale in scales]
            nearest = min(range(len(scales)), key=lambda k: abs(scales[k] - likes.scale))
            likes.scale = scales[ui.segmented("scale", names, nearest, -1)]
            imgui.dummy(ImVec2(0, ui.px(2)))
            likes.embed = ui.check("Keep the picture inside the project", likes.embed)
            likes.names = ui.check("Names beside the tools", likes.names)
            automatic = ui.check("Choose the quality automatically", self._state.auto_quality)
            self._state.auto_quality = likes.auto_quality = automatic
        imgui.dummy(ImVec2(0, ui.px(8)))
        imgui.set_cursor_pos_x(imgui.get_window_width() - ui.px(24 + 96))
        if ui.button("Done", primary=True, width=96) or self.entered:
            likes.save()
            return False
        return True

"""Messages in a corner of the canvas, one at a time: they go once they were there to be read, or wait to be closed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from imgui_bundle import imgui, imgui_ctx
from imgui_bundle.imgui import ImVec2

from app.errors import printable
from app.ui import icons
from app.ui.theme import packed
from app.ui.viewport import Rect
from app.ui.widgets import PANEL, Ui, fitting

SECONDS = 5.0
MOST = 3
LEAST = 70.0  # points of the canvas's height that a message needs
ABOVE = 54.0  # and that it leaves to the zoom


@dataclass
class Message:
    """Words, and how long they have still to stay, None until they are closed; but no longer than they hold.

    `seen`: somebody is there, since when the time runs: what a long export says at its end waits for the person.
    """

    text: str
    icon: str = "info"
    left: float | None = SECONDS
    holds: Callable[[], bool] = lambda: True
    seen: bool = False


class Messages:
    """The messages that are shown.

    Args:
        changed: called when one comes or goes, as they do without anybody's hand; their windows fit themselves to
            what is in them in the frames after that.
    """

    def __init__(self, changed: Callable[[], None]) -> None:
        self.shown: list[Message] = []
        self._changed = changed

    def say(self, text: str, holds: Callable[[], bool] = lambda: True) -> None:
        """Something to know."""
        self._add(Message(text, holds=holds))

    def warn(self, text: str, holds: Callable[[], bool] = lambda: True) -> None:
        """Something that went wrong; it stays until it is closed, or does not hold any more."""
        self._add(Message(text, "warn", None, holds))

    def caution(self, text: str, holds: Callable[[], bool] = lambda: True) -> None:
        """Something that cannot be, or will not turn out as it is wished; it goes by itself."""
        self._add(Message(text, "warn", SECONDS, holds))

    def done(self, text: str) -> None:
        """Something that went well."""
        self._add(Message(text, "check"))

    @property
    def next_in(self) -> float | None:
        """Seconds until the message that is shown goes; None if it stays as long as nobody does anything."""
        return self.shown[-1].left if self.shown and self.shown[-1].seen else None

    def see(self) -> None:
        """Somebody moves the pointer, or does something else."""
        if self.shown:
            self.shown[-1].seen = True

    def elapse(self, dt: float) -> None:
        """Let `dt` seconds go by, only for the one that is shown and seen; what does not hold any more goes."""
        if gone := [message for message in self.shown if not message.holds()]:
            self.shown = [message for message in self.shown if message not in gone]
            self._changed()
        if self.shown and (message := self.shown[-1]).seen and message.left is not None:
            message.left -= dt
            if message.left <= 0:
                self.shown.remove(message)
                self._changed()

    def draw(self, ui: Ui, canvas: Rect) -> None:
        """Draw the newest in the canvas's upper corner, below what tells of work under way; the others wait."""
        if not self.shown:
            return
        message, others = self.shown[-1], len(self.shown) - 1
        beside = canvas.width / 2 - ui.px(165)  # of what tells of work under way
        # Where there is no room for that it lies below, and is as wide and low as it can be.
        width = min(ui.px(440), beside if beside >= ui.px(260) else ui.px(440), canvas.width - ui.px(24))
        right = canvas.right - ui.px(12)
        top = ui.free_below(right - width, right, canvas.y + ui.px(12))
        if top > canvas.y + ui.px(12) and top + ui.px(LEAST) > canvas.bottom - ui.px(ABOVE):
            message.seen = False  # it waits until there is room
            return
        imgui.set_next_window_pos(ImVec2(right, top), imgui.Cond_.always, ImVec2(1.0, 0.0))
        imgui.push_style_var(imgui.StyleVar_.window_padding, ImVec2(ui.px(14), ui.px(10)))
        imgui.push_style_var(imgui.StyleVar_.window_rounding, ui.px(9))
        imgui.push_style_var(imgui.StyleVar_.window_border_size, ui.px(1))
        flags = PANEL | imgui.WindowFlags_.always_auto_resize
        imgui.begin("message", None, flags)
        imgui.pop_style_var(3)
        corner = imgui.get_cursor_screen_pos()
        ink = packed(ui.palette.accent)
        icons.draw(imgui.get_window_draw_list(), message.icon, corner.x, corner.y, ui.px(18), ink)
        room = width - ui.px(80)
        height = min(max(canvas.middle[1] - top, ui.px(LEAST)), canvas.bottom - ui.px(ABOVE) - top) - ui.px(24)
        words = fitting(message.text, room, height)
        text = imgui.calc_text_size(words, wrap_width=room)
        imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + ui.px(28))
        end = imgui.get_cursor_pos_x() + min(room, text.x + 2)
        with imgui_ctx.begin_group(), imgui_ctx.push_text_wrap_pos(end):
            ui.text(words, size=14)
            if words != message.text:
                ui.tooltip("All of it", more=message.text)
            if others and text.y + ui.px(20) <= height:
                ui.dim(f"{others} more", 12)
        imgui.same_line(0, ui.px(12))
        imgui.set_cursor_pos_y(imgui.get_cursor_pos_y() - ui.px(2))
        if ui.icon_button("close", "close", size=22, icon_size=13):
            self.shown.remove(message)
        ui.cover()
        imgui.end()

    def _add(self, message: Message) -> None:
        message.text = printable(message.text)
        self.shown = [*[other for other in self.shown if other.text != message.text][-(MOST - 1) :], message]
        self._changed()

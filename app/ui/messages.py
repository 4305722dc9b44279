"""Messages over the canvas that go by themselves; what must not be missed waits to be closed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from imgui_bundle import imgui
from imgui_bundle.imgui import ImVec2

from app.ui import icons
from app.ui.theme import packed
from app.ui.viewport import Rect
from app.ui.widgets import PANEL, Ui

SECONDS = 5.0
MOST = 3


@dataclass
class Message:
    """Words, and how long they have still to stay; None until they are closed."""

    text: str
    icon: str = "info"
    left: float | None = SECONDS


class Messages:
    """The messages that are shown.

    Args:
        changed: called when one comes or goes, as they do without anybody's hand; their windows fit themselves to
            what is in them in the frames after that.
    """

    def __init__(self, changed: Callable[[], None]) -> None:
        self.shown: list[Message] = []
        self._changed = changed

    def say(self, text: str) -> None:
        """Something to know."""
        self._add(Message(text))

    def warn(self, text: str) -> None:
        """Something that went wrong; it stays until it is closed."""
        self._add(Message(text, "warn", None))

    def done(self, text: str) -> None:
        """Something that went well."""
        self._add(Message(text, "check"))

    @property
    def next_in(self) -> float | None:
        """Seconds until the next message goes."""
        waits = [message.left for message in self.shown if message.left is not None]
        return min(waits) if waits else None

    def elapse(self, dt: float) -> None:
        """Let `dt` seconds go by."""
        for message in list(self.shown):
            if message.left is not None:
                message.left -= dt
                if message.left <= 0:
                    self.shown.remove(message)
                    self._changed()

    def draw(self, ui: Ui, canvas: Rect) -> None:
        """Draw them on the canvas, the newest lowest."""
        y = canvas.bottom - ui.px(60)
        for number, message in enumerate(reversed(self.shown)):
            y -= self._draw_one(ui, canvas, message, len(self.shown) - number, y) + ui.px(8)

    def _draw_one(self, ui: Ui, canvas: Rect, message: Message, number: int, y: float) -> float:
        width = min(ui.px(440), max(canvas.width - ui.px(32), ui.px(240)))
        imgui.set_next_window_pos(ImVec2(canvas.x + canvas.width / 2, y), imgui.Cond_.always, ImVec2(0.5, 1.0))
        imgui.push_style_var(imgui.StyleVar_.window_padding, ImVec2(ui.px(14), ui.px(10)))
        imgui.push_style_var(imgui.StyleVar_.window_rounding, ui.px(9))
        imgui.push_style_var(imgui.StyleVar_.window_border_size, ui.px(1))
        flags = PANEL | imgui.WindowFlags_.always_auto_resize | imgui.WindowFlags_.no_focus_on_appearing
        imgui.begin(f"message {number}", None, flags)
        imgui.pop_style_var(3)
        corner = imgui.get_cursor_screen_pos()
        ink = packed(ui.palette.accent)
        icons.draw(imgui.get_window_draw_list(), message.icon, corner.x, corner.y, ui.px(18), ink)
        room = width - ui.px(80)
        text = imgui.calc_text_size(message.text, wrap_width=room)
        imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + ui.px(28))
        imgui.push_text_wrap_pos(imgui.get_cursor_pos_x() + min(room, text.x + 2))
        ui.text(message.text, size=14)
        imgui.pop_text_wrap_pos()
        imgui.same_line(0, ui.px(12))
        imgui.set_cursor_pos_y(imgui.get_cursor_pos_y() - ui.px(2))
        if ui.icon_button(f"close {number}", "close", size=22, icon_size=13):
            self.shown.remove(message)
        ui.cover()
        height = imgui.get_window_height()
        imgui.end()
        return height

    def _add(self, message: Message) -> None:
        self.shown = [*[other for other in self.shown if other.text != message.text][-(MOST - 1) :], message]
        self._changed()

"""Offering work that was not saved when fluidwarp ended."""

from __future__ import annotations

import threading
from collections.abc import Callable
from datetime import date, datetime
from pathlib import Path

from imgui_bundle import imgui, imgui_ctx
from imgui_bundle.imgui import ImVec2

from app.ui.clock import TWICE
from app.ui.dialogs import Dialog, Dialogs
from app.ui.journals import Journals
from app.ui.messages import Messages
from app.ui.widgets import Ui
from app.work import recovery
from app.work.recovery import Found

ROWS = 4  # works that are seen without scrolling
HEIGHT = 74  # of a row


class Recovery:
    """Works that were not saved when fluidwarp ended; looked for in another thread.

    Args:
        journals: of the works that are open; the others are beside them.
        dialogs, messages: ask and tell the person.
        restore: opens one.

    Attributes:
        offered: what can be restored, the newest first.
    """

    def __init__(
        self, journals: Journals, dialogs: Dialogs, messages: Messages, restore: Callable[[Found], None]
    ) -> None:
        self._journals = journals
        self._dialogs = dialogs
        self._messages = messages
        self._restore = restore
        self.offered: list[Found] = []
        self._notices: list[str] = []
        self._search: threading.Thread | None = None
        if journals.root is not None:
            self._search = threading.Thread(
                target=self._find, args=(journals.root,), name="finding journals", daemon=True
            )
            self._search.start()

    @property
    def is_busy(self) -> bool:
        """Something goes on in another thread, of which there will be something to see."""
        return self._search is not None or self._journals.are_behind

    def _find(self, root: Path) -> None:
        self.offered, self._notices = recovery.find(root)

    def poll(self) -> None:
        """Offer what has been found."""
        if self._search is None or self._search.is_alive():
            return
        self._search = None
        for notice in self._notices:
            self._messages.warn(notice)
        if self.offered:
            self._dialogs.show(Offer(self))

    def restore(self, found: Found) -> None:
        """Open one of them, and keep the others for another start."""
        self.offered.remove(found)
        self.later()
        self._restore(found)

    def discard(self, found: Found) -> None:
        """Remove one of them for good."""
        self.offered.remove(found)
        found.discard()

    def later(self) -> None:
        """Keep them all for another start."""
        for found in self.offered:
            found.leave()
        self.offered = []


class Offer(Dialog):
    """Asks what shall become of work that was not saved."""

    width = 560

    def __init__(self, recovery: Recovery) -> None:
        super().__init__("Restore your work?")
        self._recovery = recovery
        self._doubted: Found | None = None  # its Discard has been pressed once
        self._doubted_at = 0.0  # imgui's seconds

    def body(self, ui: Ui) -> bool:
        offered = self._recovery.offered
        ui.wrapped("fluidwarp ended before this was saved. It is here up to the last change.", ui.palette.dim, 14)
        imgui.dummy(ImVec2(0, ui.px(4)))
        restored = discarded = None
        with self.scrolled(ui, foot=2 + 32, most=HEIGHT * ROWS):
            for number, found in enumerate(offered):
                imgui.push_id(number)
                pressed = self._row(ui, found, ui.px(HEIGHT) * number)
                restored = found if pressed == "restore" else restored
                discarded = found if pressed == "discard" else discarded
                imgui.pop_id()
        imgui.dummy(ImVec2(0, ui.px(2)))
        imgui.set_cursor_pos_x(imgui.get_window_width() - ui.px(24 + 96))
        later = ui.button("Later", width=96)
        if restored is not None:
            # Answered, whatever comes of it.
            self.close()
            self._recovery.restore(restored)
            return False
        if discarded is not None and discarded is not self._doubted:
            self._doubted, self._doubted_at = discarded, imgui.get_time()
        elif discarded is not None and imgui.get_time() - self._doubted_at > TWICE:
            # A double click has not read the question.
            self._recovery.discard(discarded)
        if imgui.is_key_pressed(imgui.Key.escape) or later:
            self._recovery.later()
            return False
        return bool(self._recovery.offered)

    def _row(self, ui: Ui, found: Found, top: float) -> str:
        """One of the works, at a height in the list; what has been pressed, or ""."""
        imgui.set_cursor_pos(ImVec2(0, top))
        right, what = imgui.get_content_region_avail().x, about(found, date.today())
        is_narrow = imgui.calc_text_size(what).x > right - ui.px(224)
        across = ui.px(100 if is_narrow else 208)
        room = right - across - ui.px(16)
        with imgui_ctx.begin_group():
            with imgui_ctx.push_font(ui.fonts.bold, 15):
                name = _shortened(found.origin.name, room, from_start=True)
            ui.text(name, size=15, bold=True)
            ui.dim(_shortened(what, room, from_start=True))
            ui.dim(_shortened(str(found.file), room))
        imgui.set_cursor_pos(ImVec2(right - across, top + ui.px(2 if is_narrow else 14)))
        discard = ui.button("Really?" if found is self._doubted else "Discard", width=100)
        if is_narrow:
            imgui.set_cursor_pos(ImVec2(right - across, top + ui.px(HEIGHT / 2)))
        else:
            imgui.same_line(0, ui.px(8))
        restore = ui.button("Restore", primary=True, width=100)
        return "restore" if restore else "discard" if discard else ""


def about(found: Found, today: date) -> str:
    """How much there is, and from when."""
    work = found.work
    counts = [(work.strokes, "stroke"), (work.handles, "handle")]
    told = [f"{count} {noun}{'s' if count > 1 else ''}" for count, noun in counts if count]
    return f"{' and '.join(told) or 'other changes'}, {_moment(found.when, today)}"


def _moment(when: datetime, today: date) -> str:
    days = (today - when.date()).days
    day = {0: "today", 1: "yesterday"}.get(days, f"{when:%Y-%m-%d}")
    return f"{day} at {when:%H:%M}"


def _shortened(text: str, width: float, from_start: bool = False) -> str:
    """The end of it, or the start, as much as there is room for."""
    if imgui.calc_text_size(text).x <= width:
        return text
    while len(text) > 4 and imgui.calc_text_size(f"... {text}").x > width:
        text = text[:-1] if from_start else text[1:]
    return f"{text} ..." if from_start else f"... {text}"

"""The widgets of the window by what stands on them: a test presses "Edges hold" and not a point of the screen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import pytest
from imgui_bundle import imgui
from imgui_bundle.imgui import internal

from app.ui.events import Mods, Move
from app.ui.viewport import Rect
from app.ui.widgets import Ui
from support.editing import Robot


@dataclass(frozen=True)
class Widget:
    """One that has been drawn: its kind, the window that it is in, which stands alone, and what is written on it."""

    kind: str
    window: str
    words: str
    rect: Rect


class Widgets:
    """Notes where each widget is drawn, by what is written on it; of choices, each.

    Args:
        robot: whose window it is.
        monkeypatch: of the test, at whose end nothing is noted any more.

    Attributes:
        at: where each lies, by what is written on it.
        drawn: all of the last frame, also those on which the same is written, buttons with icons, fields and rows.
    """

    def __init__(self, robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
        self.robot = robot
        self.drawn: list[Widget] = []
        self._frame = 0
        self.at: dict[str, Rect] = {}
        self.lists: dict[str, tuple[list[str], int]] = {}
        for kind in ("slider", "button", "check", "section"):
            self._note(monkeypatch, Ui, kind, 1 if kind == "slider" else 0)
        for owner, kind in ((Ui, "icon_button"), (imgui, "input_text"), (imgui, "input_text_with_hint"),
                            (imgui, "selectable"), (imgui, "menu_item")):  # fmt: skip
            self._note(monkeypatch, owner, kind, None)
        segmented, combo = Ui.segmented, imgui.combo

        def choices(ui: Ui, name: str, words: Sequence[str], index: int, *more: Any) -> int:
            corner, chosen = imgui.get_cursor_screen_pos(), segmented(ui, name, words, index, *more)
            low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
            imgui.push_font(ui.fonts.regular, 13.5)
            shares = [1.0 if any(more) else imgui.calc_text_size(word).x + ui.px(20) for word in words]
            imgui.pop_font()
            x = corner.x
            for word, share in zip(words, shares, strict=True):
                across = (high.x - low.x) * share / sum(shares)
                self.at[word] = Rect(x, low.y, across, high.y - low.y)
                self._add("choice", word, self.at[word])
                x += across
            return chosen

        def listed(name: str, index: int, words: list[str]) -> tuple[bool, int]:
            said = combo(name, index, words)
            self.at[name], self.lists[name] = _last(), (words, index)
            self._add("list", name, _last())
            return said

        monkeypatch.setattr(Ui, "segmented", choices)
        monkeypatch.setattr(imgui, "combo", listed)
        self.look()

    def _note(self, monkeypatch: pytest.MonkeyPatch, owner: Any, kind: str, place: int | None) -> None:
        """`place`: of the argument that is written on it; None where that is the first, and it is not found by that."""
        drawn = getattr(owner, kind)

        def noting(*given: Any, **named: Any) -> Any:
            said = drawn(*given, **named)
            words = given[(owner is Ui) + (place or 0)].split("##")[0].strip()
            if place is not None:
                self.at[words] = _last()
            self._add(kind, words or given[0], _last())
            return said

        monkeypatch.setattr(owner, kind, noting)

    def _add(self, kind: str, words: str, rect: Rect) -> None:
        if imgui.get_frame_count() != self._frame:
            self._frame = imgui.get_frame_count()
            self.drawn.clear()
        window = internal.get_current_window()
        while window.flags & imgui.WindowFlags_.child_window and window.parent_window is not None:
            window = window.parent_window
        self.drawn.append(Widget(kind, window.name, words, rect))

    def look(self) -> None:
        """Draw until everything is where it stays."""
        self.robot.move(5, 5)
        self.robot.frame(count=2)
        self.at.clear()
        self.robot.frame()

    def click(self, words: str) -> None:
        """Click on the middle of what these words stand on."""
        self.look()
        self.robot.click(*self.at[words].middle)
        self.robot.frame(count=2)

    def type(self, words: str, text: str) -> None:
        """Ctrl+click the slider of this label, type, and take it by Enter."""
        self.look()
        self.robot.mods = Mods(ctrl=True)
        self.robot.click(*self.at[words].middle)
        self.robot.mods = Mods()
        self.robot.key("ctrl+a")
        self.robot.type(text)
        self.robot.frame(count=2)
        self.robot.key("enter")
        self.robot.frame(Move(5, 5), dt=1.0)  # so that no double click comes of the next one

    def choose(self, name: str, words: str) -> None:
        """Open a list and go to one of its rows by the arrows."""
        self.click(name)
        rows, index = self.lists[name]
        steps = rows.index(words) - index
        for _ in range(abs(steps)):
            self.robot.key("down" if steps > 0 else "up")
        self.robot.key("enter")
        self.robot.frame(count=2)


def _last() -> Rect:
    low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
    return Rect(low.x, low.y, high.x - low.x, high.y - low.y)

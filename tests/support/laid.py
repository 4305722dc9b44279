"""Where everything in the window lies: every widget and word, noted where it is drawn, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import pytest
from imgui_bundle import imgui
from imgui_bundle.imgui import internal

from app.ui.viewport import Rect

CLICKED = ("invisible_button", "slider_float", "combo", "input_text", "input_text_with_hint", "menu_item",
           "begin_menu")  # fmt: skip
ANSWERS = ("Cancel", "Export", "Save", "Don't save", "Open", "Done", "Later")  # seen without scrolling
NEAR = 1.5  # points that are no fault
CANVAS = ("zoom", "how", "hint", "legend", "statistics", "catching up", "message", "exporting", "fitting", "loading")


@dataclass
class Thing:
    """A widget or words: what it is called, its rectangle, the windows that it is in from the inside out, its clip.

    `is_hidden`: its window is not seen yet, as its size is not known.
    """

    name: str
    rect: Rect
    within: list[internal.Window]
    clip: Rect
    is_words: bool
    is_hidden: bool

    @property
    def window(self) -> str:
        return self.within[0].name


class Laid:
    """Notes what is laid out in the frames that are looked at.

    Args:
        monkeypatch: of the test, at whose end nothing is noted any more.

    Attributes:
        places: the middle of each widget, as of when it was drawn last.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.things: list[Thing] = []
        self._looks = False
        self.places: dict[str, tuple[float, float]] = {}
        for name in CLICKED:
            self._note(monkeypatch, name, is_words=False)
        self._note(monkeypatch, "text_unformatted", is_words=True)
        drawn = imgui.ImDrawList.add_text

        def writing(lines: imgui.ImDrawList, at: Any, *given: Any) -> None:
            drawn(lines, at, *given)
            if not self._looks:
                return
            window = internal.get_current_window()
            # What is written on the canvas itself, beside handles, may be cut off by its edge as the picture is.
            if isinstance(at, imgui.ImVec2) and not window.is_fallback_window:
                size = imgui.calc_text_size(given[-1])
                low, high = lines.get_clip_rect_min(), lines.get_clip_rect_max()
                clip = Rect(low.x, low.y, high.x - low.x, high.y - low.y)
                self.things.append(
                    Thing(given[-1], Rect(at.x, at.y, size.x, size.y), _chain(window), clip, True, window.hidden)
                )

        monkeypatch.setattr(imgui.ImDrawList, "add_text", writing)

    def _note(self, monkeypatch: pytest.MonkeyPatch, kind: str, is_words: bool) -> None:
        drawn = getattr(imgui, kind)

        def noting(name: str, *given: Any, **named: Any) -> Any:
            if not self._looks:
                return drawn(name, *given, **named)
            within = _chain(internal.get_current_window())
            said = drawn(name, *given, **named)
            if kind != "begin_menu" or said is not True:
                clip, self.places[name] = within[0].inner_clip_rect, _last().middle
                self.things.append(Thing(name, _last(), within, _rect(clip), is_words, within[-1].hidden))
            return said

        monkeypatch.setattr(imgui, kind, noting)

    def faults(self, frame: Callable[[], None], canvas: Rect | None = None) -> list[str]:
        """What is cut off, beyond reach, over something else or floats beyond the canvas, in a frame drawn now."""
        self._looks = True
        frame()
        self._looks = False
        things, self.things = [thing for thing in self.things if not thing.is_hidden], []
        display = imgui.get_io().display_size
        screen = Rect(0, 0, display.x, display.y)
        told = [fault for thing in things if (fault := _cut(thing, screen))]
        by_window: dict[int, list[Thing]] = {}
        for thing in things:
            by_window.setdefault(thing.within[0].id_, []).append(thing)
        for several in by_window.values():
            told += [f"{one.window}: {one.name!r} lies over {other.name!r}" for one, other in _collisions(several)]
        roots = {thing.within[-1].id_: thing.within[-1] for thing in things}.values()
        floating = [root for root in roots if root.name in CANVAS]
        told += [
            f"{one.name} lies over {other.name}"
            for one, other in combinations(floating, 2)
            if _overlap(_whole(one), _whole(other))
        ]
        if canvas is not None:
            told += [
                f"{one.name} sticks out of the canvas" for one in floating if _sticks_out(_whole(one), canvas, True)
            ]
        return told


def _chain(window: internal.Window) -> list[internal.Window]:
    """The windows that a thing is in, its own first and the one that stands alone last."""
    found = [window]
    while found[-1].flags & imgui.WindowFlags_.child_window and found[-1].parent_window is not None:
        found.append(found[-1].parent_window)
    return found


def _cut(thing: Thing, screen: Rect) -> str:
    """How it is cut off, unless what it is in can be scrolled to it; "" if all of it is seen."""
    is_clipped = thing.is_words and thing.clip.width < _rect(thing.within[0].inner_clip_rect).width - NEAR
    rect, down = _seen(thing) if is_clipped else thing.rect, True
    is_answer = thing.name in ANSWERS and not thing.is_words
    for window in thing.within:
        inside = _rect(window.inner_rect)
        down = is_answer or (down and not window.scrollbar_y)
        if _sticks_out(rect, inside, down):
            return f"{thing.window}: {thing.name!r} {_told(rect)} is cut off by {window.name} {_told(inside)}"
        rect = _whole(window)
    if _sticks_out(rect, screen, True):
        return f"{thing.window}: {_told(rect)} is cut off by the screen {_told(screen)}"
    return ""


def _sticks_out(rect: Rect, inside: Rect, down: bool) -> bool:
    across = rect.x < inside.x - NEAR or rect.right > inside.right + NEAR
    return across or (down and (rect.y < inside.y - NEAR or rect.bottom > inside.bottom + NEAR))


def _collisions(things: list[Thing]) -> Iterator[tuple[Thing, Thing]]:
    """Those that lie over each other, of things of one window; from the top down, so that few have to be compared."""
    placed = sorted(((_seen(thing), thing) for thing in things), key=lambda pair: pair[0].y)
    for number, (a, one) in enumerate(placed):
        for b, other in placed[number + 1 :]:
            if b.y > a.bottom:
                break
            if _overlap(a, b) and _collide(one, other, a, b):
                yield one, other


def _collide(one: Thing, other: Thing, a: Rect, b: Rect) -> bool:
    if one.is_words and other.is_words:
        return True
    if one.is_words or other.is_words:
        words, widget = (a, b) if one.is_words else (b, a)
        return _sticks_out(words, widget, True)  # partly on it: what stands on a widget lies wholly on it
    return True


def _seen(thing: Thing) -> Rect:
    """The part that is not clipped on purpose."""
    x, y = max(thing.rect.x, thing.clip.x), max(thing.rect.y, thing.clip.y)
    right, bottom = min(thing.rect.right, thing.clip.right), min(thing.rect.bottom, thing.clip.bottom)
    return Rect(x, y, max(right - x, 0.0), max(bottom - y, 0.0))


def _overlap(a: Rect, b: Rect) -> bool:
    across = min(a.right, b.right) - max(a.x, b.x)
    return across > NEAR and min(a.bottom, b.bottom) - max(a.y, b.y) > NEAR


def _last() -> Rect:
    low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
    return Rect(low.x, low.y, high.x - low.x, high.y - low.y)


def _rect(rect: internal.ImRect) -> Rect:
    return Rect(rect.min.x, rect.min.y, rect.max.x - rect.min.x, rect.max.y - rect.min.y)


def _whole(window: internal.Window) -> Rect:
    return Rect(window.pos.x, window.pos.y, window.size.x, window.size.y)


def _told(rect: Rect) -> str:
    return f"{rect.x:.0f}..{rect.right:.0f} x {rect.y:.0f}..{rect.bottom:.0f}"

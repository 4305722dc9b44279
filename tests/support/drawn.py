"""What the window draws, in words: every line, shape and text with its place and colour, noted where it is drawn."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from typing import Any

import pytest
from imgui_bundle import imgui

from app.ui.widgets import Ui
from solver.gl.passes import Pass

SHAPES = (
    "add_circle", "add_circle_filled", "add_convex_poly_filled", "add_image", "add_line", "add_polyline", "add_rect",
    "add_rect_filled", "add_text", "add_triangle_filled", "push_clip_rect", "pop_clip_rect",
)  # fmt: skip
# Invisible buttons that are larger than, or beside, what is drawn.
UNSEEN = ("percent", "edge", "ruler", "bars", "entry", "preset", "track")
NEAR = 0.6  # points, and of the numbers for the canvas's shader, parts of a hundred


class Drawn:
    """Notes what is drawn from now on, as lines of a kind, numbers in points, `|` and words.

    Args:
        monkeypatch: of the test, at whose end nothing is noted any more.
        shapes: those that are noted; each that is costs time.
        pressed: also where those of `UNSEEN` can be pressed, and lists and fields.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch, shapes: Sequence[str] = SHAPES, pressed: bool = False) -> None:
        self.lines: list[str] = []
        for name in shapes:
            self._note_shape(monkeypatch, name)
        for name in ("menu_item", "combo", "begin_menu", "text_unformatted", "input_text"):
            self._note_words(monkeypatch, name)
        if pressed:
            self._note_pressed(monkeypatch)
        tooltip, call, draw_into = Ui.tooltip, Pass.__call__, Pass.draw_into

        def told(ui: Ui, title: str, key: str = "", more: str = "", at_once: bool = False, above: bool = False) -> None:
            self.lines.append(f"tooltip | {title} | {ui.shown(key)} | {more} | {at_once}")
            tooltip(ui, title, key, more, at_once, above)

        def note(shader: str, inputs: dict[str, Any]) -> None:
            if shader.startswith("view/"):
                what = shader.removeprefix("view/").removesuffix(".frag")
                numbers = {name: value for name, value in inputs.items() if isinstance(value, (float, tuple))}
                self.lines += [f"{what} {name} {_told(value, 4)}" for name, value in numbers.items()]
                self.lines.append(f"{what} | {sorted(inputs)}")

        def calling(self_: Pass, target: Any, **inputs: Any) -> None:
            note(self_.shader, inputs)
            call(self_, target, **inputs)

        def drawing(self_: Pass, framebuffer: Any, smooth: Any = (), **inputs: Any) -> None:
            note(self_.shader, inputs)
            draw_into(self_, framebuffer, smooth, **inputs)

        monkeypatch.setattr(Ui, "tooltip", told)
        monkeypatch.setattr(Pass, "__call__", calling)
        monkeypatch.setattr(Pass, "draw_into", drawing)

    def _note_shape(self, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
        drawn = getattr(imgui.ImDrawList, name)

        def noting(lines: imgui.ImDrawList, *given: Any) -> Any:
            words = "".join(f" | {value}" for value in given if isinstance(value, str))
            told = " ".join(_told(value) for value in given if not isinstance(value, (str, imgui.ImTextureRef)))
            self.lines.append(f"{name} {told}{words}")
            return drawn(lines, *given)

        monkeypatch.setattr(imgui.ImDrawList, name, noting)

    def _note_words(self, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
        drawn = getattr(imgui, name)

        def noting(*given: Any) -> Any:
            at, size = imgui.get_cursor_screen_pos(), imgui.get_font_size()
            ink = _told(imgui.get_color_u32(imgui.Col_.text))
            self.lines.append(f"{name} {_told(at)} {_told(size)} {ink} | {' | '.join(str(value) for value in given)}")
            return drawn(*given)

        monkeypatch.setattr(imgui, name, noting)

    def _note_pressed(self, monkeypatch: pytest.MonkeyPatch) -> None:
        drawn = imgui.invisible_button

        def noting(name: str, size: imgui.ImVec2, *flags: Any) -> bool:
            if name.startswith(UNSEEN):
                self.lines.append(f"pressed {_told(imgui.get_cursor_screen_pos())} {_told(size)} | {name}")
            return drawn(name, size, *flags)

        monkeypatch.setattr(imgui, "invisible_button", noting)
        for name in ("combo", "input_text", "input_text_with_hint"):
            self._note_field(monkeypatch, name)

    def _note_field(self, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
        drawn = getattr(imgui, name)

        def noting(label: str, *given: Any) -> Any:
            said = drawn(label, *given)
            self.lines.append(
                f"pressed {_told(imgui.get_item_rect_min())} {_told(imgui.get_item_rect_size())} | {label}"
            )
            return said

        monkeypatch.setattr(imgui, name, noting)

    def take(self) -> list[str]:
        """What has been noted since the last time."""
        taken, self.lines = self.lines, []
        return taken


def new_in(lines: list[str], before: Counter[str]) -> list[str]:
    """Those that are not, or not so often, among others."""
    left = before.copy()
    found = []
    for line in lines:
        if left[line]:
            left[line] -= 1
        else:
            found.append(line)
    return found


def differences(found: list[str], wanted: list[str]) -> list[str]:
    """The lines of one that the other has not, numbers compared with a tolerance."""
    if len(found) == len(wanted):
        return [f"{one}    not    {other}" for one, other in zip(found, wanted, strict=True) if not _alike(one, other)]
    more, less = new_in(found, Counter(wanted)), new_in(wanted, Counter(found))
    return [*(f"+ {line}" for line in more), *(f"- {line}" for line in less)]


def _alike(one: str, other: str) -> bool:
    (numbers, *words), (numbers_too, *words_too) = one.split(" | "), other.split(" | ")
    mine, theirs = numbers.split(), numbers_too.split()
    if words != words_too or len(mine) != len(theirs):
        return False
    share = 0.01 if mine[:1] == ["canvas"] else 0.0
    for a, b in zip(mine, theirs, strict=True):
        if a != b and not (_is_number(a) and _is_number(b)):
            return False
        if a != b and abs(float(a) - float(b)) > (share * max(abs(float(b)), 0.01) if share else NEAR):
            return False
    return True


def _is_number(text: str) -> bool:
    return re.fullmatch(r"-?[\d.]+(e-?\d+)?", text) is not None


def _told(value: Any, digits: int = 1) -> str:
    if isinstance(value, bool):
        return str(value)
    if isinstance(value, int):
        return f"#{value:08x}" if value > 0xFFFF else str(value)
    if isinstance(value, float):
        return f"{value:.{digits}f}" if digits == 1 else f"{value:.{digits}g}"
    if isinstance(value, imgui.ImVec2):
        return f"{_told(value.x)} {_told(value.y)}"
    if isinstance(value, list):
        return f"{len(value)} {_told(value[0])} {_told(value[-1])} {_told(_middle(value))}"
    if isinstance(value, tuple):
        return " ".join(_told(float(part), digits) for part in value)
    return str(value)


def _middle(places: list[imgui.ImVec2]) -> imgui.ImVec2:
    return imgui.ImVec2(sum(place.x for place in places) / len(places), sum(place.y for place in places) / len(places))

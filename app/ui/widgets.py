"""Our own widgets on imgui: buttons with icons, sliders that say what they are, choices, sections.

One long class: each widget is a method of what it draws with, and there is nothing else between them.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, field
from math import isfinite, log
from typing import Any

from imgui_bundle import imgui, imgui_ctx
from imgui_bundle.imgui import ImVec2, internal

from app.errors import printable
from app.ui import icons
from app.ui.theme import GRID, Colour, Fonts, Palette, packed
from app.ui.units import PLAIN, Unit
from app.ui.viewport import Rect

PANEL = int(
    imgui.WindowFlags_.no_decoration
    | imgui.WindowFlags_.no_move
    | imgui.WindowFlags_.no_saved_settings
    | imgui.WindowFlags_.no_bring_to_front_on_focus
    | imgui.WindowFlags_.no_nav_focus
    # One that comes up while a slider is dragged would end the drag.
    | imgui.WindowFlags_.no_focus_on_appearing
)
# Put together once: each costs as much as drawing a widget.
ON_GROUND = PANEL | int(imgui.WindowFlags_.no_background)
FLOATING = PANEL | int(imgui.WindowFlags_.always_auto_resize)
ANYWHERE = int(imgui.PopupFlags_.any_popup_id | imgui.PopupFlags_.any_popup_level)
DISABLED_TOO = int(imgui.HoveredFlags_.allow_when_disabled)
RESTS = int(imgui.HoveredFlags_.for_tooltip) | DISABLED_TOO


@dataclass
class Slid:
    """What a slider says: its value, whether it changed in this frame, and whether the person let go of it.

    `again`: it was set to its default by a double click whose first click had set it to something else.
    """

    value: float
    changed: bool
    done: bool
    again: bool = False


@dataclass
class Ui:
    """What every panel draws with: colours, letters and the interface's scale.

    Attributes:
        covers: where the canvas is covered by something that can be clicked, as of the last frame.
        covering: the same of the frame that is being drawn, as far as it is.
        floating_over: what lies there and the pointer goes through, likewise.
        has_popup: a menu or a dialog is open, as of then.
        chord: the chord that the person has chosen for what another one does by default; "" if there is none.
    """

    palette: Palette
    fonts: Fonts
    scale: float
    density: float = 1.0
    covers: list[Rect] = field(default_factory=list)
    covering: list[Rect] = field(default_factory=list)
    floating_over: list[Rect] = field(default_factory=list)
    has_popup: bool = False
    chord: Callable[[str], str] = str
    _slid: tuple[str, float] = ("", -1.0)  # the slider that was let go of last, and when
    _untyped: dict[str, float] = field(default_factory=dict)  # values of sliders before one is typed

    def px(self, points: float) -> float:
        """Points of the design on this screen."""
        return points * self.scale

    def shown(self, chord: str) -> str:
        """What is pressed for what a chord does by default, as a person reads it."""
        return keys_shown(self.chord(chord))

    # -- containers -------------------------------------------------------------------------------------------------

    @contextmanager
    def panel(self, name: str, rect: Rect, padding: tuple[float, float] = (8, 8), flags: int = 0) -> Iterator[None]:
        """A part of the window that stays where it is, on the ground that `Editor` has filled."""
        imgui.set_next_window_pos(ImVec2(rect.x, rect.y))
        imgui.set_next_window_size(ImVec2(rect.width, rect.height))
        imgui.push_style_var(imgui.StyleVar_.window_padding, ImVec2(self.px(padding[0]), self.px(padding[1])))
        imgui.push_style_var(imgui.StyleVar_.window_rounding, 0.0)
        with imgui_ctx.begin(name, None, ON_GROUND | flags):
            imgui.pop_style_var(2)
            yield

    @contextmanager
    def floating(
        self,
        name: str,
        x: float,
        y: float,
        pivot: tuple[float, float],
        alpha: float = 0.94,
        clicked: bool = True,
        tallest: float = 0.0,
    ) -> Iterator[None]:
        """A small panel that lies on the canvas and is as large as what is in it; the pointer may go through it.

        `tallest`: it scrolls where it would be higher than that, in points of the screen; 0 if it never does.
        """
        imgui.set_next_window_pos(ImVec2(x, y), imgui.Cond_.always, ImVec2(*pivot))
        imgui.set_next_window_bg_alpha(alpha)
        imgui.push_style_var(imgui.StyleVar_.window_padding, ImVec2(self.px(6), self.px(4)))
        imgui.push_style_var(imgui.StyleVar_.window_rounding, self.px(8))
        flags = FLOATING | (0 if clicked else int(imgui.WindowFlags_.no_inputs))
        if tallest:
            imgui.set_next_window_size_constraints(ImVec2(0, 0), ImVec2(imgui.FLT_MAX, max(tallest, 1.0)))
            flags &= ~int(imgui.WindowFlags_.no_scrollbar)
        with imgui_ctx.begin(name, None, flags):
            imgui.pop_style_var(2)
            yield
            if clicked:
                self.cover()
            else:
                self.floating_over.append(self._window())

    def cover(self) -> None:
        """Take note that the window being drawn lies on the canvas."""
        self.covering.append(self._window())

    def free_below(self, left: float, right: float, top: float) -> float:
        """How far down from `top` something may begin that lies on the canvas from `left` to `right`: below all that
        has been drawn there before.
        """
        for rect in sorted([*self.covering, *self.floating_over], key=lambda rect: rect.y):
            if rect.y < top + self.px(12) and rect.x < right and rect.right > left:
                top = max(top, rect.bottom + self.px(8))
        return top

    def _window(self) -> Rect:
        place, size = imgui.get_window_pos(), imgui.get_window_size()
        return Rect(place.x, place.y, size.x, size.y)

    def end_frame(self) -> None:
        """Everything has been drawn: what covers the canvas is known."""
        self.covers, self.covering, self.floating_over = self.covering, [], []
        self.has_popup = imgui.is_popup_open("", ANYWHERE)

    def is_covered(self, x: float, y: float) -> bool:
        """Something that can be clicked lies at a point of the screen, or might."""
        return self.has_popup or any(rect.contains(x, y) for rect in self.covers)

    def enabled(self, condition: bool) -> AbstractContextManager[None]:
        """What is drawn inside can be used only on a condition."""
        return nullcontext() if condition else _disabled()

    # -- words ------------------------------------------------------------------------------------------------------

    def text(self, text: str, colour: Colour | None = None, size: float = 0.0, bold: bool = False) -> None:
        """Words; `size` in points of the design, 0 for the ordinary one."""
        imgui.push_font(self.fonts.bold if bold else self.fonts.regular, size)
        imgui.push_style_color(imgui.Col_.text, colour or self.palette.text)
        imgui.text_unformatted(printable(text))
        imgui.pop_style_color()
        imgui.pop_font()

    def dim(self, text: str, size: float = 13.0) -> None:
        self.text(text, self.palette.dim, size)

    def wrapped(self, text: str, colour: Colour | None = None, size: float = 0.0) -> None:
        with imgui_ctx.push_text_wrap_pos(0.0):
            self.text(text, colour, size)

    def tooltip(self, title: str, key: str = "", more: str = "", at_once: bool = False, above: bool = False) -> None:
        """What the last item is, shown when the pointer rests on it; `at_once`: its name, beside it, on the way there.

        `key`: the chord that does it by default. `above`: where it covers nothing below.
        """
        rests = imgui.is_item_hovered(RESTS)
        if not (rests or (at_once and imgui.is_item_hovered(DISABLED_TOO))):
            return
        if at_once or above:
            self._place_beside(imgui.get_item_rect_min(), imgui.get_item_rect_max(), above)
        elif imgui.get_item_rect_max().y > (display := imgui.get_io().display_size).y - self.px(4 * GRID):
            # Below the pointer there is no room, and imgui would put it over the item.
            x, y = imgui.get_mouse_pos().x, imgui.get_item_rect_min().y - self.px(6)
            imgui.set_next_window_pos(ImVec2(x, y), imgui.Cond_.always, ImVec2(x / display.x, 1.0))
        imgui.push_style_var(imgui.StyleVar_.window_padding, ImVec2(self.px(10), self.px(7)))
        imgui.push_style_var(imgui.StyleVar_.window_rounding, self.px(6))
        if imgui.begin_tooltip():
            self.text(title, size=14)
            if keys := self.shown(key):
                imgui.same_line(0, self.px(12))
                self.text(keys, self.palette.accent, 13)
            if more and rests:
                with imgui_ctx.push_text_wrap_pos(self.px(280)):
                    self.dim(more)
            imgui.end_tooltip()
        imgui.pop_style_var(2)

    def _place_beside(self, low: ImVec2, high: ImVec2, above: bool) -> None:
        """Put the next window beside an item: to the right of one at the left edge, else below or above it."""
        display, gap = imgui.get_io().display_size, self.px(6)
        if low.x < self.px(GRID) and low.y > self.px(GRID):
            imgui.set_next_window_pos(ImVec2(high.x + gap, low.y), imgui.Cond_.always)
            return
        right, below = low.x > 0.6 * display.x, high.y < 0.7 * display.y and not above
        at = ImVec2(high.x if right else low.x, high.y + gap if below else low.y - gap)
        imgui.set_next_window_pos(at, imgui.Cond_.always, ImVec2(float(right), 0.0 if below else 1.0))

    # -- buttons ----------------------------------------------------------------------------------------------------

    def icon_button(
        self,
        name: str,
        icon: str,
        title: str = "",
        key: str = "",
        more: str = "",
        active: bool = False,
        enabled: bool = True,
        size: float = 32,
        icon_size: float = 20,
        width: float = 0.0,
    ) -> bool:
        """A square button with an icon, or a wide one with its title beside that; `active` shows it as pressed in."""
        side = self.px(size)
        across = self.px(width) or side
        corner = imgui.get_cursor_screen_pos()
        with self.enabled(enabled):
            clicked = imgui.invisible_button(name, ImVec2(across, side))
            hovered, held = imgui.is_item_hovered(), imgui.is_item_active()
        if title:
            self.tooltip(title, key, more, at_once=True)
        draw, palette = imgui.get_window_draw_list(), self.palette
        ground = palette.accent_soft if active else palette.pressed if held else palette.hover if hovered else None
        if ground is not None:
            draw.add_rect_filled(corner, corner + ImVec2(across, side), packed(ground), self.px(7))
        colour = palette.accent if active else palette.text if hovered else palette.dim
        inner, ink = self.px(icon_size), packed(colour, 1.0 if enabled else 0.35)
        at = (side - inner) / 2
        icons.draw(draw, icon, corner.x + at, corner.y + at, inner, ink)
        if width:
            with imgui_ctx.push_font(self.fonts.regular, 13.5):
                draw.add_text(ImVec2(corner.x + side, corner.y + (side - imgui.get_font_size()) / 2), ink, title)
        return clicked

    def button(self, label: str, primary: bool = False, width: float = 0.0, icon: str = "", height: float = 32) -> bool:
        """A button with words; the primary one is what most people want next."""
        palette, words = self.palette, label.split("##")[0]
        with imgui_ctx.push_font(self.fonts.bold if primary else self.fonts.regular, 14.0):
            text = imgui.calc_text_size(words)
            room = self.px(22) if icon else 0.0
            size = ImVec2(self.px(width) if width > 0 else text.x + room + self.px(28), self.px(height))
            if width < 0:
                size.x = imgui.get_content_region_avail().x
            corner = imgui.get_cursor_screen_pos()
            clicked = imgui.invisible_button(label, size)
            hovered, held, focused = imgui.is_item_hovered(), imgui.is_item_active(), imgui.is_item_focused()
            ground = (
                palette.accent if primary else palette.pressed if held else palette.hover if hovered else palette.raised
            )
            draw = imgui.get_window_draw_list()
            alpha = imgui.get_style().alpha * (0.85 if primary and (hovered or held) else 1.0)
            draw.add_rect_filled(corner, corner + size, packed(ground, alpha), self.px(6))
            if focused and imgui.get_io().nav_visible:
                draw.add_rect(corner, corner + size, packed(palette.text), self.px(6), self.px(1.5))
            ink = palette.on_accent if primary else palette.text
            x = corner.x + (size.x - text.x - room) / 2
            if icon:
                icons.draw(draw, icon, x, corner.y + (size.y - self.px(16)) / 2, self.px(16), packed(ink, alpha))
            draw.add_text(ImVec2(x + room, corner.y + (size.y - text.y) / 2), packed(ink, alpha), words)
        return clicked

    def segmented_width(self, choices: Sequence[str]) -> float:
        """What `segmented` takes if no width is asked for."""
        with imgui_ctx.push_font(self.fonts.regular, 13.5):
            width = sum(imgui.calc_text_size(choice).x + self.px(20) for choice in choices)
        return width

    def segmented(
        self, name: str, choices: Sequence[str], index: int, width: float = 0.0, about: Sequence[str] = ()
    ) -> int:
        """One of a few choices side by side; the index that is chosen now.

        `about`: of each, told above it, where it covers nothing of what the choice changes.
        """
        palette, draw = self.palette, imgui.get_window_draw_list()
        with imgui_ctx.push_font(self.fonts.regular, 13.5):
            widths = [imgui.calc_text_size(choice).x + self.px(20) for choice in choices]
            if width:
                whole = imgui.get_content_region_avail().x if width < 0 else self.px(width)
                widths = [whole / len(choices)] * len(choices)
            corner, height = imgui.get_cursor_screen_pos(), self.px(28)
            draw.add_rect_filled(corner, corner + ImVec2(sum(widths), height), packed(palette.raised), self.px(6))
            chosen, x = index, corner.x
            with imgui_ctx.begin_group():
                for number, (choice, across) in enumerate(zip(choices, widths, strict=True)):
                    if number:
                        imgui.same_line(0, 0)
                    if imgui.invisible_button(f"{name}{number}", ImVec2(across, height)):
                        chosen = number
                    hovered = imgui.is_item_hovered()
                    if about:
                        self.tooltip(choice, more=about[number], above=True)
                    box = self.px(2)
                    if number == index:
                        low, high = ImVec2(x + box, corner.y + box), ImVec2(x + across - box, corner.y + height - box)
                        draw.add_rect_filled(low, high, packed(palette.pressed), self.px(5))
                    size = imgui.calc_text_size(choice)
                    ink = palette.text if number == index or hovered else palette.dim
                    at = ImVec2(x + (across - size.x) / 2, corner.y + (height - size.y) / 2)
                    draw.add_text(at, packed(ink, imgui.get_style().alpha), choice)
                    x += across
        return chosen

    def check(self, label: str, value: bool, key: str = "") -> bool:
        """A switch over the whole width; its value now."""
        palette, draw = self.palette, imgui.get_window_draw_list()
        corner, width, height = imgui.get_cursor_screen_pos(), imgui.get_content_region_avail().x, self.px(28)
        if imgui.invisible_button(label, ImVec2(width, height)):
            value = not value
        hovered = imgui.is_item_hovered()
        with imgui_ctx.push_font(self.fonts.regular, 14.0):
            words = label.split("##")[0]
            text = imgui.calc_text_size(words)
            ink = palette.text if hovered or value else palette.dim
            y = corner.y + (height - text.y) / 2
            draw.add_text(ImVec2(corner.x, y), packed(ink), words)
            if key:
                at = ImVec2(corner.x + text.x + self.px(8), y)
                draw.add_text(at, packed(palette.faint), self.shown(key))
        track, thick = self.px(26), self.px(15)
        x0, y0 = corner.x + width - track, corner.y + (height - thick) / 2
        ground = palette.accent if value else palette.pressed
        draw.add_rect_filled(ImVec2(x0, y0), ImVec2(x0 + track, y0 + thick), packed(ground), thick / 2)
        knob = x0 + (track - thick / 2 if value else thick / 2)
        inside = palette.on_accent if value else palette.dim
        draw.add_circle_filled(ImVec2(knob, y0 + thick / 2), thick / 2 - self.px(2.5), packed(inside), 20)
        return value

    # -- sliders ----------------------------------------------------------------------------------------------------

    def slider(
        self,
        name: str,
        label: str,
        value: float,
        low: float,
        high: float,
        unit: Unit = PLAIN,
        default: float | None = None,
        shown: str = "",
        logarithmic: bool = False,
        width: float = -1.0,
        title: str = "",
        key: str = "",
        more: str = "",
    ) -> Slid:
        """A slider with its label and value inside; Ctrl+click types a number, a double click takes the default.

        Args:
            name: of its own.
            label: stands in it.
            value, low, high, default: as the program has them.
            unit: in which the value is shown, dragged and typed.
            shown: stands in it instead of the value in its unit.
            logarithmic: equal ways are equal ratios.
            width: in points of the design, -1 all there is.
            title, key, more: of its tooltip.
        """
        palette, shown = self.palette, shown or unit.text(value)
        across = imgui.get_content_region_avail().x if width < 0 else self.px(width)
        corner = imgui.get_cursor_screen_pos()
        ident = f"##{name}"
        typing = internal.temp_input_is_active(imgui.get_id(ident))
        clear = (0.0, 0.0, 0.0, 0.0)
        imgui.set_next_item_width(across)
        imgui.push_style_var(imgui.StyleVar_.frame_padding, ImVec2(self.px(9), self.px(7)))
        imgui.push_style_color(imgui.Col_.slider_grab, clear)
        imgui.push_style_color(imgui.Col_.slider_grab_active, clear)
        imgui.push_style_color(imgui.Col_.text, palette.text if typing else clear)
        flags: Any = imgui.SliderFlags_.always_clamp
        if logarithmic:
            flags |= imgui.SliderFlags_.logarithmic
        imgui.push_font(self.fonts.regular, 14.0)
        # It holds the number that is shown, so that this is what Ctrl+click offers; a unit typed after it is ignored.
        changed, number = imgui.slider_float(ident, unit.number(value), low * unit.per, high * unit.per, "%.6g", flags)
        new = value
        if not typing:
            self._untyped[name] = value
            new = unit.value(unit.number(number / unit.per)) if changed else value
        elif changed and isfinite(number):
            # The number that was offered, as after Escape, is the value from before, with all its digits.
            before = self._untyped.get(name, value)
            new = before if unit.value(number) == unit.value(unit.number(before)) else unit.value(number)
        if changed:  # a number of few digits may be less than the least, and no value at all: 0 of .2 pixels
            new = min(max(new, low), high) + 0.0  # and not -0
        done = imgui.is_item_deactivated_after_edit()
        hovered, held, again = imgui.is_item_hovered(), imgui.is_item_active(), False
        if hovered and default is not None and imgui.is_mouse_double_clicked(0) and not typing:
            internal.clear_active_id()
            new, changed, done = default, True, True
            slid, when = self._slid
            again = slid == name and imgui.get_time() - when < imgui.get_io().mouse_double_click_time
        elif done:
            self._slid = name, imgui.get_time()
        imgui.pop_style_color(3)
        imgui.pop_style_var()
        size = imgui.get_item_rect_size()
        if not typing:
            self._fill(corner, size, _fraction(new, low, high, logarithmic), hovered or held)
            draw = imgui.get_window_draw_list()
            y = corner.y + (size.y - imgui.get_font_size()) / 2
            ink = imgui.get_style().alpha
            draw.add_text(ImVec2(corner.x + self.px(9), y), packed(palette.text, 0.75 * ink), label)
            right = corner.x + size.x - self.px(9) - imgui.calc_text_size(shown).x
            draw.add_text(ImVec2(right, y), packed(palette.text, ink), shown)
        imgui.pop_font()
        if title and not held:
            self.tooltip(title, key, more)
        return Slid(new, changed, done, again)

    def _fill(self, corner: ImVec2, size: ImVec2, part: float, lit: bool) -> None:
        draw, palette = imgui.get_window_draw_list(), self.palette
        x = corner.x + max(size.x * part, 0)
        radius = self.px(6)
        if part > 0.005:
            draw.push_clip_rect(corner, ImVec2(x, corner.y + size.y), True)
            soft = packed(palette.accent, 0.42 if lit else 0.30)
            draw.add_rect_filled(corner, corner + size, soft, radius)
            draw.pop_clip_rect()
        if not lit:
            return
        at = min(max(x, corner.x + self.px(2)), corner.x + size.x - self.px(2))
        low, high = (
            ImVec2(at - self.px(1), corner.y + self.px(5)),
            ImVec2(at + self.px(1), corner.y + size.y - self.px(5)),
        )
        draw.add_rect_filled(low, high, packed(palette.accent), self.px(1))

    # -- parts of the inspector -------------------------------------------------------------------------------------

    def section(self, label: str, is_open: bool) -> bool:
        """The head of a section that opens and closes; whether it is open now."""
        palette, draw = self.palette, imgui.get_window_draw_list()
        corner, width, height = imgui.get_cursor_screen_pos(), imgui.get_content_region_avail().x, self.px(28)
        if imgui.invisible_button(f"section {label}", ImVec2(width, height)):
            is_open = not is_open
        ink = palette.text if imgui.is_item_hovered() else palette.dim
        icon = "chevron_down" if is_open else "chevron_right"
        icons.draw(draw, icon, corner.x - self.px(2), corner.y + self.px(7), self.px(14), packed(ink), 2.2)
        with imgui_ctx.push_font(self.fonts.bold, 13.0):
            draw.add_text(ImVec2(corner.x + self.px(17), corner.y + self.px(7)), packed(ink), label)
        return is_open

    def rule(self, low: ImVec2, high: ImVec2) -> None:
        """A thin line as a rectangle: a line proper would be smoothed over two rows of pixels."""
        imgui.get_window_draw_list().add_rect_filled(low, high, packed(self.palette.line))

    def line(self) -> None:
        """A thin line across, from edge to edge."""
        window, corner = imgui.get_window_pos(), imgui.get_cursor_screen_pos()
        y = corner.y - self.px(4)
        self.rule(ImVec2(window.x, y), ImVec2(window.x + imgui.get_window_width(), y + self.px(1)))

    def divider(self) -> None:
        """A thin upright line between two groups of a bar."""
        imgui.same_line(0, self.px(GRID))
        corner = imgui.get_cursor_screen_pos()
        self.rule(corner + ImVec2(0, self.px(6)), corner + ImVec2(self.px(1), self.px(26)))
        imgui.dummy(ImVec2(self.px(1), self.px(32)))
        imgui.same_line(0, self.px(GRID))


@contextmanager
def _disabled() -> Iterator[None]:
    imgui.begin_disabled()
    try:
        yield
    finally:
        imgui.end_disabled()


def _fraction(value: float, low: float, high: float, logarithmic: bool) -> float:
    if logarithmic:
        floor = max(low, high * 1e-6)
        return min(max(log(max(value, floor) / floor) / log(high / floor), 0.0), 1.0)
    return min(max((value - low) / (high - low), 0.0), 1.0)


_NAMES = {
    "ctrl": "Ctrl", "shift": "Shift", "alt": "Alt", "space": "Space", "left": "Left", "right": "Right", "up": "Up",
    "down": "Down", "pageup": "Page Up", "pagedown": "Page Down", "escape": "Esc", "delete": "Del", "home": "Home",
    "end": "End", "enter": "Enter", "tab": "Tab", "backspace": "Backspace",
}  # fmt: skip


def keys_shown(chord: str) -> str:
    """A chord as a person reads it: "ctrl+shift+z" is Ctrl+Shift+Z."""
    if chord.endswith("++"):
        return keys_shown(chord[:-2]) + "++"
    return "+".join(_NAMES.get(part, part.upper()) for part in chord.split("+")) if chord != "+" else chord


def fitting(text: str, width: float, height: float) -> str:
    """As much of a text as there is room for."""

    def is_too_long(text: str) -> bool:
        return imgui.calc_text_size(text, wrap_width=width).y > height

    if not is_too_long(text):
        return text
    first = bisect_left(range(len(text)), True, key=lambda count: is_too_long(f"{text[:count]} ..."))
    return f"{text[: max(first - 1, 1)]} ..."

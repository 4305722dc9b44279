"""Colours, sizes and fonts: one accent, one grid of 8 points, one family of letters."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from pathlib import Path

from imgui_bundle import imgui

Colour = tuple[float, float, float, float]

GRID = 8.0


def rgb(text: str, alpha: float = 1.0) -> Colour:
    """A colour from its hexadecimal digits."""
    return int(text[0:2], 16) / 255, int(text[2:4], 16) / 255, int(text[4:6], 16) / 255, alpha


@dataclass(frozen=True)
class Palette:
    """The colours of a theme, sRGB 0-1; neutral greys, so that they do not tint the eye's view of the picture."""

    ground: Colour
    panel: Colour
    raised: Colour
    hover: Colour
    pressed: Colour
    line: Colour
    text: Colour
    dim: Colour
    faint: Colour
    accent: Colour
    on_accent: Colour
    accent_soft: Colour
    checker: tuple[Colour, Colour]
    dark: bool


DARK = Palette(
    ground=rgb("161616"),
    panel=rgb("222222"),
    raised=rgb("2d2d2d"),
    hover=rgb("383838"),
    pressed=rgb("424242"),
    line=rgb("333333"),
    text=rgb("ececec"),
    dim=rgb("a8a8a8"),
    faint=rgb("6f6f6f"),
    accent=rgb("f2a93b"),
    on_accent=rgb("241700"),
    accent_soft=rgb("f2a93b", 0.16),
    checker=(rgb("2a2a2a"), rgb("353535")),
    dark=True,
)
LIGHT = Palette(
    ground=rgb("d2d2d2"),
    panel=rgb("f4f4f4"),
    raised=rgb("e6e6e6"),
    hover=rgb("dcdcdc"),
    pressed=rgb("cfcfcf"),
    line=rgb("d6d6d6"),
    text=rgb("1c1c1c"),
    dim=rgb("4c4c4c"),
    faint=rgb("737373"),
    accent=rgb("a35d00"),
    on_accent=rgb("ffffff"),
    accent_soft=rgb("a35d00", 0.14),
    checker=(rgb("ffffff"), rgb("e4e4e4")),
    dark=False,
)
PALETTES = {"dark": DARK, "light": LIGHT}


@lru_cache(maxsize=4096)
def packed(colour: Colour, alpha: float = 1.0) -> int:
    """A colour as the draw lists take it."""
    r, g, b, a = (round(min(max(part, 0.0), 1.0) * 255) for part in (*colour[:3], colour[3] * alpha))
    return r | g << 8 | b << 16 | a << 24


def blend(a: Colour, b: Colour, part: float) -> Colour:
    """From `a` to `b`."""
    red, green, blue, alpha = (x + (y - x) * part for x, y in zip(a, b, strict=True))
    return red, green, blue, alpha


@dataclass(frozen=True)
class Fonts:
    """The letters: regular and bold, with the same set of signs."""

    regular: imgui.ImFont
    bold: imgui.ImFont


def load_fonts() -> Fonts:
    """Load the letters that come with imgui_bundle: Roboto, and what it lacks from Droid Sans."""
    folder = Path(str(resources.files("imgui_bundle"))) / "assets" / "fonts"
    return Fonts(_font(folder, "Roboto-Regular.ttf"), _font(folder, "Roboto-Bold.ttf"))


def _font(folder: Path, name: str) -> imgui.ImFont:
    atlas = imgui.get_io().fonts
    font = atlas.add_font_from_file_ttf(str(folder / "Roboto" / name), 15.0)
    more = imgui.ImFontConfig()
    more.merge_mode = True
    atlas.add_font_from_file_ttf(str(folder / "DroidSans.ttf"), 15.0, more)
    return font


def apply(palette: Palette, scale: float) -> None:
    """Make imgui's own widgets look like ours; `scale` is 1 on an ordinary screen."""
    fresh = imgui.Style()
    style = imgui.get_style()
    for name in ("frame_padding", "item_spacing", "item_inner_spacing", "window_padding"):
        setattr(style, name, getattr(fresh, name))
    style.font_size_base = 15.0
    style.font_scale_dpi = scale
    style.window_padding = imgui.ImVec2(2 * GRID * scale, 1.5 * GRID * scale)
    style.frame_padding = imgui.ImVec2(1.25 * GRID * scale, 0.75 * GRID * scale)
    style.item_spacing = imgui.ImVec2(GRID * scale, GRID * scale)
    style.item_inner_spacing = imgui.ImVec2(0.75 * GRID * scale, 0.75 * GRID * scale)
    style.window_rounding = style.popup_rounding = 1.25 * GRID * scale
    style.child_rounding = style.frame_rounding = style.grab_rounding = 0.75 * GRID * scale
    style.selectable_rounding = style.menu_item_rounding = 0.625 * GRID * scale
    style.window_border_size = 0.0
    style.popup_border_size = 1.0
    style.frame_border_size = 0.0
    style.scrollbar_size = 1.25 * GRID * scale
    style.scrollbar_rounding = GRID * scale
    style.grab_min_size = GRID * scale
    style.window_menu_button_position = imgui.Dir.none
    style.hover_delay_normal = 0.45
    style.disabled_alpha = 0.38
    names = imgui.Col_
    clear = (0.0, 0.0, 0.0, 0.0)
    colours = {
        names.text: palette.text,
        names.text_disabled: palette.dim,
        names.window_bg: palette.panel,
        names.child_bg: clear,
        names.popup_bg: palette.panel,
        names.border: palette.line,
        names.border_shadow: clear,
        names.frame_bg: palette.raised,
        names.frame_bg_hovered: palette.hover,
        names.frame_bg_active: palette.pressed,
        names.title_bg: palette.panel,
        names.title_bg_active: palette.panel,
        names.menu_bar_bg: palette.panel,
        names.scrollbar_bg: clear,
        names.scrollbar_grab: palette.pressed,
        names.scrollbar_grab_hovered: palette.faint,
        names.scrollbar_grab_active: palette.faint,
        names.check_mark: palette.accent,
        names.slider_grab: palette.accent,
        names.slider_grab_active: palette.accent,
        names.button: palette.raised,
        names.button_hovered: palette.hover,
        names.button_active: palette.pressed,
        names.header: palette.accent_soft,
        names.header_hovered: palette.hover,
        names.header_active: palette.pressed,
        names.separator: palette.line,
        names.text_selected_bg: blend(palette.panel, palette.accent, 0.4),
        names.nav_cursor: palette.accent,
        names.modal_window_dim_bg: (0.0, 0.0, 0.0, 0.5 if palette.dark else 0.3),
    }
    for name, colour in colours.items():
        style.set_color_(name, imgui.ImVec4(*colour))

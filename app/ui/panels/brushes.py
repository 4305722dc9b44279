"""Brushes to choose from: those that come with fluidwarp, and the person's own."""

from __future__ import annotations

from imgui_bundle import imgui, imgui_ctx
from imgui_bundle.imgui import ImVec2

from app.ui.editor_state import EditorState, presets
from app.ui.preferences import Preferences
from app.ui.theme import packed
from app.ui.widgets import Ui

ROW = 28  # points
LONGEST_NAME = 40


def draw(ui: Ui, state: EditorState, likes: Preferences, width: float) -> None:
    """The list, what a click takes away of the person's own, and a field for the name of another one."""
    ui.dim("Brushes")
    brush, width = state.brush, ui.px(width)
    for number, preset in enumerate(presets(likes)):
        imgui.push_id(number)
        corner = imgui.get_cursor_screen_pos()
        is_own = preset.name in likes.presets
        if imgui.invisible_button("preset", ImVec2(width - ui.px(ROW) * is_own, ui.px(ROW))):
            state.take_brush(preset)
        lines, size = imgui.get_window_draw_list(), ImVec2(width, ui.px(ROW))
        is_on = (preset.radius, preset.hardness, preset.strength) == (brush.radius, brush.hardness, brush.strength)
        if is_on or imgui.is_item_hovered():
            ground = ui.palette.accent_soft if is_on else ui.palette.hover
            lines.add_rect_filled(corner, corner + size, packed(ground), ui.px(5))
        _tip(ui, lines, corner + ImVec2(ui.px(14), ui.px(ROW / 2)), preset.radius, preset.hardness, preset.strength)
        with imgui_ctx.push_font(ui.fonts.regular, 14.0):
            lines.push_clip_rect(corner, corner + ImVec2(width - ui.px(ROW), ui.px(ROW)), True)
            lines.add_text(corner + ImVec2(ui.px(32), ui.px(5)), packed(ui.palette.text), preset.name)
            lines.pop_clip_rect()
        if is_own:
            imgui.same_line(0, 0)
            if ui.icon_button("delete", "close", f"Delete {preset.name}", size=ROW, icon_size=13):
                del likes.presets[preset.name]
                likes.save()
        imgui.pop_id()
    imgui.set_next_item_width(width - ui.px(72))
    entered, state.preset_name = imgui.input_text_with_hint(
        "##preset name", "Name of this brush", state.preset_name, imgui.InputTextFlags_.enter_returns_true
    )
    name = state.preset_name.strip()[:LONGEST_NAME]
    imgui.same_line(0, ui.px(8))
    with ui.enabled(bool(name)):
        if (ui.button("Keep", width=64, height=27) or entered) and name:
            likes.presets[name] = {
                "radius": brush.radius, "hardness": brush.hardness, "strength": brush.strength,
            }  # fmt: skip
            likes.save()
            state.preset_name = ""


def _tip(ui: Ui, lines: imgui.ImDrawList, middle: ImVec2, radius: float, hardness: float, strength: float) -> None:
    """A dot as large, as hard and as strong as the brush, in proportion."""
    reach, steps = ui.px(2.5 + 9.5 * min((radius / 0.25) ** 0.5, 1.0)), 5
    for step in range(steps):
        part = 1 - (1 - hardness) * step / steps
        lines.add_circle_filled(middle, reach * part, packed(ui.palette.text, 0.2 + 0.8 * strength / steps), 24)

"""The strip of tools on the left."""

from __future__ import annotations

from imgui_bundle import imgui
from imgui_bundle.imgui import ImVec2

from app.model.tools import TOOLS
from app.ui.editor_state import EditorState
from app.ui.layout import BETWEEN, GROUP, TOOL, Layout
from app.ui.widgets import Ui

GROUP_ENDS = ("handle", "select", "restore")


def draw(ui: Ui, layout: Layout, state: EditorState) -> None:
    """One button for each tool; the one that is taken in hand comes into sight."""
    columns, width = layout.columns, layout.tool
    imgui.push_style_var(imgui.StyleVar_.item_spacing, ImVec2(ui.px(BETWEEN), ui.px(BETWEEN)))
    with ui.panel("tools", layout.strip, (4, 8)):
        imgui.begin_child("all tools")
        for number, tool in enumerate(TOOLS):
            if number % columns:
                imgui.same_line()
            active = state.tool_name == tool.name
            more = tool.hint
            if tool.directions:
                more += f". Alt: {tool.directions[1].lower()}."
            if ui.icon_button(
                tool.name, tool.name, tool.label, tool.key, more, active, size=TOOL, icon_size=22,
                width=width if width > TOOL else 0.0,
            ):  # fmt: skip
                state.choose_tool(tool.name, state.opposite.get(tool.name, False))
            if active and state.tool_seen != tool.name:
                state.tool_seen = tool.name
                if not imgui.is_item_visible():
                    imgui.set_scroll_here_y()
            if tool.name in GROUP_ENDS and columns == 1:
                corner, across = imgui.get_cursor_screen_pos(), ui.px(width)
                ui.rule(corner + ImVec2(ui.px(8), ui.px(3)), corner + ImVec2(across - ui.px(8), ui.px(4)))
                imgui.dummy(ImVec2(across, ui.px(GROUP - BETWEEN)))
        imgui.end_child()
    imgui.pop_style_var()

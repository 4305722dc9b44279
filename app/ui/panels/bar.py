"""The bar above the picture: the tool in hand and what can be set about it; undo, compare, export."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from imgui_bundle import imgui, imgui_ctx
from imgui_bundle.imgui import ImVec2

from app.errors import printable
from app.model.presets import FEELS
from app.model.tools import BrushSettings, Tool
from app.ui.actions import ACTIONS, Do
from app.ui.editor_state import LIMITS, EditorState
from app.ui.layout import Layout
from app.ui.panels import brushes, feels
from app.ui.preferences import LONGEST_STRING, Preferences
from app.ui.units import PERCENT, POINTS, picture_pixels
from app.ui.widgets import Ui
from app.ui.workspace import Workspace

MENU = (
    "open", "recent", "paste", "open_frames", "import_map", "", "save", "save_as", "apply_to", "", "copy_picture",
    "copy_recipe", "export", "", "preferences", "shortcuts", "", "quit",
)  # fmt: skip


@dataclass(frozen=True)
class Setting:
    """A slider for a part of the brush; `key` makes it less, `raises` more."""

    name: str
    label: str
    title: str
    more: str
    key: str = ""
    raises: str = ""


SETTINGS = (
    Setting("radius", "Size", "Size of the brush", "Or drag with the right button.", "[", "]"),
    Setting("hardness", "Hardness", "Hardness", "A soft brush bends the picture gently.", "{", "}"),
    Setting("strength", "Strength", "Strength", "Full strength moves the picture with the pointer.", ";", "'"),
    Setting("stiffness", "Stiffness", "Stiffness",
            "At 100 % a handle follows exactly. With less it gives way to the fluid and to other handles."),
    Setting("hold", "Hold", "Hold",
            "At 0 % a long push gradually lets go of the picture. At 100 % it carries it as far as you go."),
    Setting("local", "Local", "Local",
            "At 0 % the picture flows back beside the brush, as a fluid does. At 100 % only what is under it moves."),
)  # fmt: skip
DEFAULTS = BrushSettings()
WIDE, NARROW = 148, 112  # points, of a slider where all have room, and where they have not
BRUSHES_WIDTH = 236  # points, of what the button for more about the brush opens
RIGHT = 4 * 32 + 3 * 4 + 17 + 96 + 8  # points, of what is at the right end of the bar


def draw(
    ui: Ui,
    layout: Layout,
    workspace: Workspace,
    state: EditorState,
    likes: Preferences,
    open_file: Callable[[Path], None],
    do: Do,
) -> None:
    """The whole bar.

    Args:
        likes: has the paths of what was opened lately, and the person's own brushes.
        open_file: opens one of those files.
    """
    with ui.panel("bar", layout.bar, (8, 8)):
        if ui.icon_button("menu", "menu", "Menu"):
            imgui.open_popup("main menu")
        _menu(ui, layout.bar.height, likes.recent, open_file, do)
        ui.divider()
        room = imgui.get_window_width() - ui.px(RIGHT)
        has_brush = state.tool.gesture is not None
        _title(ui, state.tool, room - ui.px(48) * has_brush)
        if has_brush:
            _brush(ui, layout, workspace, state, likes, room)
        _right(ui, layout, workspace, state, do)


def _title(ui: Ui, tool: Tool, room: float) -> None:
    """The tool's name, if there is room for it, and what a tool without a brush does."""
    start = imgui.get_cursor_pos_x()
    with imgui_ctx.push_font(ui.fonts.bold, 0):
        width = imgui.calc_text_size(tool.label).x
    with imgui_ctx.begin_group():
        if start + width <= room:
            imgui.set_cursor_pos_y(imgui.get_cursor_pos_y() + ui.px(8.5))
            ui.text(tool.label, bold=True)
            start += width + ui.px(12)
            if tool.gesture is None and start + imgui.calc_text_size(tool.hint).x <= room:
                imgui.same_line(0, ui.px(12))
                imgui.set_cursor_pos_y(imgui.get_cursor_pos_y() + ui.px(9))
                ui.dim(tool.hint, 14)


def _brush(ui: Ui, layout: Layout, workspace: Workspace, state: EditorState, likes: Preferences, room: float) -> None:
    """What can be set about the brush, up to `room`; for the rest, and for presets, there is a button."""
    settings = [setting for setting in SETTINGS if setting.name in state.tool.settings]
    button = ui.px(8 + 32)
    start = imgui.get_item_rect_max().x - imgui.get_window_pos().x + ui.px(16) + button
    if state.tool.directions:
        start += ui.segmented_width(state.tool.directions) + ui.px(16)
    across = WIDE if start + len(settings) * ui.px(WIDE + 8) <= room else NARROW
    parts: list[tuple[float, Callable[[float], None]]] = [
        (ui.px(across), lambda width, setting=setting: _slider(ui, workspace, state, setting, width))
        for setting in settings
    ]
    if state.tool.directions:
        width = ui.segmented_width(state.tool.directions)
        parts.insert(0, (width, lambda width: _directions(ui, state, width)))
    gap = ui.px(16)
    while parts:
        imgui.same_line(0, gap)
        width, draw = parts[0]
        gap = ui.px(16 if len(parts) > len(settings) else 8)  # more behind the directions
        if imgui.get_cursor_pos_x() + width + gap + ui.px(32) > room:
            break
        imgui.set_cursor_pos_y(ui.px(10))
        draw(across)
        del parts[0]
    else:
        imgui.same_line(0, ui.px(8))
    _more(ui, layout, state, likes, [draw for _, draw in parts])
    imgui.same_line(0, ui.px(16))
    if layout.inspector is None and imgui.get_cursor_pos_x() + ui.segmented_width([f.name for f in FEELS]) <= room:
        imgui.set_cursor_pos_y(ui.px(10))
        feels.choose(ui, "bar feel", workspace.session, state)


def _more(ui: Ui, layout: Layout, state: EditorState, likes: Preferences, parts: list[Callable[[float], None]]) -> None:
    """A button for what the bar has no room for, the stabiliser and the brushes to choose from."""
    imgui.set_cursor_pos_y(ui.px(8))
    if ui.icon_button("more", "sliders", "More about the brush", more="Its stabiliser, and brushes to choose from."):
        imgui.open_popup("more of the brush")
    low, display = imgui.get_item_rect_min(), imgui.get_io().display_size
    left = max(min(low.x, display.x - ui.px(BRUSHES_WIDTH + 24 + 8)), 0.0)
    imgui.set_next_window_pos(ImVec2(left, layout.bar.height))
    imgui.set_next_window_size_constraints(ImVec2(0, 0), ImVec2(display.x, display.y - layout.bar.height - ui.px(8)))
    with imgui_ctx.push_style_var(imgui.StyleVar_.window_padding, ImVec2(ui.px(12), ui.px(12))):
        if imgui.begin_popup("more of the brush"):
            for draw in parts:
                draw(BRUSHES_WIDTH)
            if state.tool_name != "handle":
                slid = ui.slider(
                    "stabiliser", "Stabiliser", state.stabiliser, 0.0, LONGEST_STRING, POINTS, 0.0, width=BRUSHES_WIDTH,
                    title="Stabiliser",
                    more="How far behind the pointer the brush follows, so that a shaky hand draws smoothly. "
                    "It catches up when you let go.",
                )  # fmt: skip
                state.stabiliser = slid.value
            brushes.draw(ui, state, likes, BRUSHES_WIDTH)
            imgui.end_popup()


def _directions(ui: Ui, state: EditorState, width: float) -> None:
    tool = state.tool
    assert tool.directions is not None
    with imgui_ctx.begin_group():
        state.opposite[tool.name] = bool(ui.segmented("direction", tool.directions, int(state.is_opposite)))
    ui.tooltip("Direction", f"shift+{tool.key}", "Hold Alt for the other one.")


def _slider(ui: Ui, workspace: Workspace, state: EditorState, setting: Setting, width: float) -> None:
    brush, is_size = state.brush, setting.name == "radius"
    value: float = getattr(brush, setting.name)
    unit = picture_pixels(2 * max(workspace.canvas.size)) if is_size else PERCENT
    low, high = LIMITS[setting.name]
    low = state.smallest if is_size else low
    raises = f"{ui.shown(setting.raises)}: more. " if ui.shown(setting.raises) else ""
    slid = ui.slider(
        setting.name, setting.label, value, low, high, unit, getattr(DEFAULTS, setting.name),
        logarithmic=is_size, width=width, title=setting.title, key=setting.key, more=raises + setting.more,
    )  # fmt: skip
    if slid.changed:
        state.brush = replace(brush, **{setting.name: slid.value})


def _right(ui: Ui, layout: Layout, workspace: Workspace, state: EditorState, do: Do) -> None:
    imgui.same_line()
    imgui.set_cursor_pos(ImVec2(max(imgui.get_window_width() - ui.px(RIGHT), imgui.get_cursor_pos_x()), ui.px(8)))
    history = workspace.session.document.history
    undo, redo = history.undo_name, history.redo_name
    if ui.icon_button("undo", "undo", f"Undo {undo}" if undo else "Undo", "ctrl+z", enabled=workspace.can_undo):
        do("undo")
    imgui.same_line(0, ui.px(4))
    title = f"Redo {redo}" if redo else "Redo"
    if ui.icon_button("redo", "redo", title, "ctrl+shift+z", enabled=workspace.can_redo):
        do("redo")
    imgui.same_line(0, ui.px(4))
    more = "Drag the line. Or hold \\ to see the picture as it was."
    if ui.icon_button("split", "compare", "Compare", "y", more, active=state.split is not None):
        do("split")
    imgui.same_line(0, ui.px(4))
    if ui.icon_button("inspector", "inspector", "Inspector", "tab", active=layout.inspector is not None):
        do("inspector")
    ui.divider()
    if ui.button("Export", primary=True, width=92, icon="export"):
        do("export")
    ui.tooltip("Export a picture, an animation or the warp map", "ctrl+e")


def _menu(ui: Ui, top: float, recent: list[str], open_file: Callable[[Path], None], do: Do) -> None:
    imgui.set_next_window_pos(ImVec2(ui.px(8), top))
    below = imgui.get_io().display_size.y - top - ui.px(8)
    imgui.set_next_window_size_constraints(ImVec2(0, 0), ImVec2(imgui.get_io().display_size.x, below))
    imgui.push_style_var(imgui.StyleVar_.item_spacing, ImVec2(ui.px(8), ui.px(7)))
    imgui.push_style_var(imgui.StyleVar_.window_padding, ImVec2(ui.px(8), ui.px(8)))
    if imgui.begin_popup("main menu"):
        for name in MENU:
            if not name:
                imgui.separator()
            elif name == "recent":
                _recent(recent, open_file)
            else:
                action = ACTIONS[name]
                keys = ui.shown(action.key) + "   "
                if imgui.menu_item(f"{action.label}    ", keys, False)[0]:
                    do(name)
        imgui.end_popup()
    imgui.pop_style_var(2)


def _recent(recent: list[str], open_file: Callable[[Path], None]) -> None:
    if imgui.begin_menu("Open recent", bool(recent)):
        for number, path in enumerate(map(Path, recent)):
            if imgui.menu_item(f"{printable(path.name)}##{number}", "", False)[0]:
                open_file(path)
            if imgui.is_item_hovered():
                imgui.set_tooltip(printable(str(path.parent)))
        imgui.end_menu()

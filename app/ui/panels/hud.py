"""What floats over the canvas: the zoom, the first hint, statistics, how far the simulation is behind."""

from __future__ import annotations

from imgui_bundle import imgui, imgui_ctx
from imgui_bundle.imgui import ImVec2

from app.model.recipe import Recipe
from app.ui.actions import Do
from app.ui.clock import Clock
from app.ui.editor_state import EditorState
from app.ui.numbers import Numbers
from app.ui.panels.marks import BEHIND
from app.ui.preferences import Preferences
from app.ui.selecting import Selecting
from app.ui.theme import blend, packed
from app.ui.viewport import Rect
from app.ui.widgets import Ui
from app.ui.workspace import Workspace
from app.work.session import Session

ZOOM, HINT = 160.0, 260.0  # points of the canvas's width that what lies on it needs
LOW = 160.0  # points of its height up to which hints would lie over what they are about
BESIDE = 84.0  # points that the first hint needs beside its words
LEGEND = ((-1, "0.1x"), (0, "1x"), (1, "10x"), (2, "100x"), (3, "1000x"))
"""Decades of viscosity, and what they are called; their tints are those of canvas.frag."""
THICK, THIN, GREY = (0.80, 0.30, 0.62, 1.0), (0.34, 0.71, 0.91, 1.0), (0.5, 0.5, 0.5, 1.0)


def draw(
    ui: Ui,
    workspace: Workspace,
    state: EditorState,
    selecting: Selecting,
    preferences: Preferences,
    numbers: Numbers,
    clock: Clock,
    do: Do,
    is_covered: bool,
    is_opposite: bool,
) -> None:
    """Everything that floats over the canvas.

    Args:
        is_covered: what is under way is told where hints stand.
        is_opposite: the tool in hand works in its other direction.
    """
    session, canvas = workspace.session, workspace.view.canvas
    if canvas.width > ui.px(ZOOM) and not (is_covered and canvas.height <= ui.px(LOW)):
        _zoom(ui, workspace, do)
    how = selecting.hint
    if state.tool_name == "handle" and not session.recipe.leads:
        how = "Drag a point to where it should go. Click to pin one where it is."
    elif state.tool_name == "freeze" and not _has_frozen(session.recipe):
        how = "What is frozen holds back the fluid beside it: leave some space to what you push."
    has_room = canvas.width > ui.px(HINT) and canvas.height > ui.px(LOW)
    has_legend = state.shows_viscosity and not state.before and canvas.width > ui.px(HINT)
    if how and not is_covered and has_room:
        _how(ui, canvas, how)
    elif preferences.hint and state.tool.gesture and not how and has_room and not has_legend and not state.statistics:
        _hint(ui, canvas, (is_opposite and state.tool.back) or state.tool.hint, preferences)
    if has_legend:
        _legend(ui, canvas, state.overlays["viscosity"].opacity)
    if state.statistics:
        _statistics(ui, canvas, session, numbers, clock)
    if session.is_behind and session.target - session.tick >= BEHIND:
        _catching_up(ui, canvas, session)


def _has_frozen(recipe: Recipe) -> bool:
    """True if something has been frozen: by the recipe, in no time, or while the fluid moved."""
    return bool(recipe.freeze or recipe.mask) or any(stroke.tool == "freeze" for stroke in recipe.stroke)


def _zoom(ui: Ui, workspace: Workspace, do: Do) -> None:
    canvas = workspace.view.canvas
    with ui.floating("zoom", canvas.right - ui.px(12), canvas.bottom - ui.px(12), (1, 1), 0.88):
        if ui.icon_button("out", "minus", "Zoom out", "-", size=24, icon_size=14):
            do("zoom_out")
        imgui.same_line(0, ui.px(2))
        label = f"{workspace.view.percent:.0f} %"
        corner = imgui.get_cursor_screen_pos()
        width = ui.px(52)
        if imgui.invisible_button("percent", ImVec2(width, ui.px(24))):
            do("actual")
        ui.tooltip("To 100 %", "ctrl+1")
        with imgui_ctx.push_font(ui.fonts.regular, 13.0):
            size = imgui.calc_text_size(label)
            at = ImVec2(corner.x + (width - size.x) / 2, corner.y + (ui.px(24) - size.y) / 2)
            imgui.get_window_draw_list().add_text(at, packed(ui.palette.text), label)
        imgui.same_line(0, ui.px(2))
        if ui.icon_button("in", "plus", "Zoom in", "+", size=24, icon_size=14):
            do("zoom_in")
        imgui.same_line(0, ui.px(2))
        fitted = workspace.view.zoom is None
        if ui.icon_button("fit", "fit", "Fit", "0", size=24, icon_size=15, active=fitted):
            do("fit")


def _legend(ui: Ui, canvas: Rect, opacity: float) -> None:
    """The tints of viscosity, as times that of the fluid: beside the zoom, or above it."""
    bottom = canvas.bottom - ui.px(12 if canvas.width > ui.px(HINT + ZOOM) else 54)
    with ui.floating("legend", canvas.x + ui.px(12), bottom, (0, 1), 0.88, clicked=False):
        for number, (decades, words) in enumerate(LEGEND):
            if number:
                imgui.same_line(0, ui.px(9))
            corner, side = imgui.get_cursor_screen_pos(), ui.px(14)
            tint = blend(GREY, THICK if decades > 0 else THIN, opacity * min(abs(decades) * 0.28, 0.75))
            lines, low = imgui.get_window_draw_list(), corner + ImVec2(0, ui.px(3))
            lines.add_rect_filled(low, low + ImVec2(side, side), packed(tint), ui.px(3))
            lines.add_rect(low, low + ImVec2(side, side), packed(ui.palette.faint), ui.px(3))
            imgui.dummy(ImVec2(side, ui.px(20)))
            imgui.same_line(0, ui.px(4))
            imgui.set_cursor_pos_y(imgui.get_cursor_pos_y() + ui.px(1.5))
            ui.text(words, size=13)


def _how(ui: Ui, canvas: Rect, words: str) -> None:
    with ui.floating("how", canvas.x + canvas.width / 2, canvas.y + ui.px(14), (0.5, 0), 0.9, clicked=False):
        imgui.push_text_wrap_pos(canvas.width - ui.px(24))
        ui.text(f"  {words}  ", size=14)
        imgui.pop_text_wrap_pos()


def _hint(ui: Ui, canvas: Rect, hint: str, preferences: Preferences) -> None:
    """What the tool in hand does, if there is room for it; until something has been painted."""
    words = f"{hint}."
    with imgui_ctx.push_font(ui.fonts.bold, 14.0):
        width = imgui.calc_text_size(words).x + ui.px(BESIDE)
    if canvas.width < width:
        return
    # Beside the zoom, or above it.
    bottom = canvas.bottom - ui.px(14 if canvas.width > width + ui.px(2 * ZOOM) else 54)
    with ui.floating("hint", canvas.x + canvas.width / 2, bottom, (0.5, 1), 0.9):
        top = imgui.get_cursor_pos_y()
        imgui.dummy(ImVec2(ui.px(4), ui.px(24)))
        imgui.same_line(0, 0)
        imgui.set_cursor_pos_y(top + ui.px(4))
        ui.text(words, size=14, bold=True)
        if canvas.width > width + ui.px(600) and not preferences.recent:
            imgui.same_line(0, ui.px(8))
            imgui.set_cursor_pos_y(top + ui.px(4))
            ui.dim(f"Drop your own picture here, or press {ui.shown('ctrl+o')}.", 14)
        imgui.same_line(0, ui.px(6))
        imgui.set_cursor_pos_y(top)
        if ui.icon_button("no hint", "close", size=24, icon_size=12):
            preferences.dismiss_hint()


def _statistics(ui: Ui, canvas: Rect, session: Session, numbers: Numbers, clock: Clock) -> None:
    stats = numbers.take(session)
    tallest = canvas.height - ui.px(12 + 54)  # above the zoom
    with ui.floating("statistics", canvas.x + ui.px(12), canvas.y + ui.px(12), (0, 0), 0.85, tallest=tallest):
        spent = clock.milliseconds
        ui.text(f"Frame  {spent.get('frame', 0):.1f} ms", size=13)
        for name in ("simulate", "canvas", "panels", "interface"):
            ui.dim(f"    {name}  {spent.get(name, 0):.1f} ms")
        if stats.stages:
            ui.text(f"Step  {sum(stats.stages.values()):.1f} ms", size=13)
        for name, value in stats.stages.items():
            ui.dim(f"    {name}  {value:.1f} ms")
        if stats.map is not None:
            ui.dim(f"det J  {stats.map.det_min:.2f} to {stats.map.det_max:.2f}    folds {stats.map.folds}")
            ui.dim(f"Divergence  {stats.divergence:.1e} / s")
        grid, window = session.replay.fluid.grid, session.replay.window
        part = f" of {window.detail} where it moves" if window else ""
        ui.dim(f"Grid {grid.nx} x {grid.ny}{part}    tick {session.tick}")


def _catching_up(ui: Ui, canvas: Rect, session: Session) -> None:
    with ui.floating("catching up", canvas.x + canvas.width / 2, canvas.y + ui.px(14), (0.5, 0), 0.9, clicked=False):
        ui.dim(f"  Simulating: {session.tick} of {session.target} steps  ", 13.5)

"""What lies on the canvas: the brush's ring, the split, the zoom, the first hint, statistics."""

from __future__ import annotations

from math import hypot
from typing import TYPE_CHECKING, Any

from imgui_bundle import imgui
from imgui_bundle.imgui import ImVec2

from app.ui.state import Overlay
from app.ui.theme import Colour, packed, rgb
from app.ui.widgets import Ui

if TYPE_CHECKING:
    from app.ui.editor import Editor

BEHIND = 12  # ticks from which on it is told that the simulation is behind
MOST_WAITING = 100  # strokes that are drawn
ZOOM, HINT = 160.0, 260.0  # points of the canvas's width that what lies on it needs
WHITE, BLACK = rgb("ffffff"), rgb("000000")


def draw(ui: Ui, editor: Editor) -> None:
    """Everything that lies on the canvas."""
    canvas = editor.layout.canvas
    lines = imgui.get_background_draw_list()
    lines.push_clip_rect(ImVec2(canvas.x, canvas.y), ImVec2(canvas.right, canvas.bottom), True)
    if editor.state.overlays["forces"].shown:
        _forces(ui, editor, lines)
    _split(ui, editor, lines)
    _path(ui, editor, lines)
    _waiting(ui, editor, lines)
    if editor.shows_ring:
        _ring(ui, editor, lines)
    lines.pop_clip_rect()
    if canvas.width > ui.px(ZOOM):
        _zoom(ui, editor)
    if editor.preferences.hint and canvas.width > ui.px(HINT):
        _hint(ui, editor)
    if editor.state.statistics:
        _statistics(ui, editor)
    if editor.session.is_behind:
        _catching_up(ui, editor)


def _ring(ui: Ui, editor: Editor, lines: imgui.ImDrawList) -> None:
    """A faint ring as far as the brush reaches, a bright one where it is half as strong: one ring when it is hard.

    What is frozen is so as far as the brush reaches, however hard it is.
    """
    hand, brush = editor.hand, editor.state.brush
    x, y = hand._start if hand.drag == "brush" else (hand.x, hand.y)
    reach = brush.radius * editor.view.longer
    core = 1.0 if editor.state.tool_name == "freeze" else 0.9 * brush.hardness
    # Where the brush is half as strong as in its middle: (1 - q^2)^3 = 1/2, between the core and the reach.
    half = reach * (core + 0.4542 * (1 - core))
    middle, count = ImVec2(x, y), max(32, min(int(reach), 96))
    soft = rgb("000000", 0.45)
    lines.add_circle(middle, reach, packed(soft, 0.5), count, ui.px(2.0))
    lines.add_circle(middle, reach, packed(WHITE, 0.55), count, ui.px(1.0))
    lines.add_circle(middle, half, packed(soft), count, ui.px(2.6))
    lines.add_circle(middle, half, packed(WHITE, 0.95), count, ui.px(1.3))
    lines.add_circle_filled(middle, ui.px(2.2), packed(soft), 12)
    lines.add_circle_filled(middle, ui.px(1.4), packed(WHITE), 12)
    opposite = editor.state.opposite.get(editor.state.tool_name, False) != hand.mods.alt
    if opposite:
        reach = ui.px(5)
        lines.add_line(ImVec2(x - reach, y), ImVec2(x + reach, y), packed(soft), ui.px(3.2))
        lines.add_line(ImVec2(x - reach, y), ImVec2(x + reach, y), packed(WHITE), ui.px(1.6))


def _path(ui: Ui, editor: Editor, lines: imgui.ImDrawList) -> None:
    """The path of a curve that is being drawn."""
    session = editor.session
    if session.stroke is not None or len(session.path) < 2:
        return
    points: list[Any] = [ImVec2(*editor.view.to_screen(*place)) for place in session.path]
    lines.add_polyline(points, packed(BLACK, 0.45), ui.px(5), 0)
    lines.add_polyline(points, packed(ui.palette.accent), ui.px(2.4), 0)
    _arrow_head(lines, points[max(len(points) - 6, 0)], points[-1], ui.px(10), ui.palette.accent)


def _waiting(ui: Ui, editor: Editor, lines: imgui.ImDrawList) -> None:
    """Where strokes will act that are drawn already, while the simulation is clearly behind them."""
    session = editor.session
    if session.target - session.tick < BEHIND:
        return
    for stroke in session.waiting[:MOST_WAITING]:
        step = max(len(stroke.samples) // 40, 1)
        places = [*(sample[1:3] for sample in stroke.samples[::step]), stroke.samples[-1][1:3]]
        points: list[Any] = [ImVec2(*editor.view.to_screen(*place)) for place in places]
        lines.add_polyline(points, packed(BLACK, 0.3), ui.px(3.5), 0)
        lines.add_polyline(points, packed(WHITE, 0.7), ui.px(1.5), 0)


def _arrow_head(lines: imgui.ImDrawList, start: ImVec2, end: ImVec2, size: float, colour: Colour) -> None:
    dx, dy = end.x - start.x, end.y - start.y
    length = hypot(dx, dy)
    if length < 1e-3:
        return
    dx, dy = dx / length * size, dy / length * size
    left = ImVec2(end.x - dx - dy * 0.6, end.y - dy + dx * 0.6)
    right = ImVec2(end.x - dx + dy * 0.6, end.y - dy - dx * 0.6)
    lines.add_triangle_filled(end, left, right, packed(colour))


def _forces(ui: Ui, editor: Editor, lines: imgui.ImDrawList) -> None:
    """Where strokes push, up to the playhead; older ones fainter."""
    session = editor.session
    overlay: Overlay = editor.state.overlays["forces"]
    for stroke in session.recipe.stroke[-60:]:
        if stroke.first_tick > session.tick or stroke.tool not in ("push", "curve"):
            continue
        step = max(len(stroke.samples) // 40, 1)
        places = [sample[1:3] for sample in stroke.samples[::step]]
        points: list[Any] = [ImVec2(*editor.view.to_screen(*place)) for place in places]
        active = stroke.last_tick >= session.tick - 1
        alpha = overlay.opacity * (1.0 if active else 0.6)
        lines.add_polyline(points, packed(BLACK, 0.5 * alpha), ui.px(4.5), 0)
        colour = (*ui.palette.accent[:3], alpha)
        lines.add_polyline(points, packed(colour), ui.px(2), 0)
        if len(points) > 1:
            _arrow_head(lines, points[-2], points[-1], ui.px(9), colour)


def _split(ui: Ui, editor: Editor, lines: imgui.ImDrawList) -> None:
    split = editor.state.split
    if split is None or editor.state.before:
        return
    rect, canvas = editor.view.rect, editor.layout.canvas
    x = rect.x + split * rect.width
    top, bottom = max(rect.y, canvas.y), min(rect.bottom, canvas.bottom)
    lines.add_line(ImVec2(x, top), ImVec2(x, bottom), packed(BLACK, 0.4), ui.px(4))
    lines.add_line(ImVec2(x, top), ImVec2(x, bottom), packed(WHITE), ui.px(1.6))
    middle, radius = ImVec2(x, (top + bottom) / 2), ui.px(13)
    lines.add_circle_filled(middle, radius, packed(WHITE), 28)
    for side in (-1, 1):
        tip = ImVec2(x + side * ui.px(8), middle.y)
        low, high = ImVec2(x + side * ui.px(3), middle.y - ui.px(4)), ImVec2(x + side * ui.px(3), middle.y + ui.px(4))
        lines.add_triangle_filled(tip, low, high, packed(rgb("222222")))
    imgui.push_font(ui.fonts.bold, 12.0)
    for label, left in (("Before", True), ("After", False)):
        size = imgui.calc_text_size(label)
        at = ImVec2(x - size.x - ui.px(18) if left else x + ui.px(18), top + ui.px(14))
        box = ImVec2(ui.px(7), ui.px(3))
        lines.add_rect_filled(at - box, at + size + box, packed(BLACK, 0.5), ui.px(5))
        lines.add_text(at, packed(WHITE), label)
    imgui.pop_font()


def _zoom(ui: Ui, editor: Editor) -> None:
    canvas = editor.layout.canvas
    with ui.floating("zoom", canvas.right - ui.px(12), canvas.bottom - ui.px(12), (1, 1), 0.88):
        if ui.icon_button("out", "minus", "Zoom out", "-", size=24, icon_size=14):
            editor.do("zoom_out")
        imgui.same_line(0, ui.px(2))
        label = f"{editor.view.percent:.0f} %"
        corner = imgui.get_cursor_screen_pos()
        width = ui.px(52)
        if imgui.invisible_button("percent", ImVec2(width, ui.px(24))):
            editor.do("actual")
        ui.tooltip("To 100 %", "ctrl+1")
        imgui.push_font(ui.fonts.regular, 13.0)
        size = imgui.calc_text_size(label)
        at = ImVec2(corner.x + (width - size.x) / 2, corner.y + (ui.px(24) - size.y) / 2)
        imgui.get_window_draw_list().add_text(at, packed(ui.palette.text), label)
        imgui.pop_font()
        imgui.same_line(0, ui.px(2))
        if ui.icon_button("in", "plus", "Zoom in", "+", size=24, icon_size=14):
            editor.do("zoom_in")
        imgui.same_line(0, ui.px(2))
        fitted = editor.view.zoom is None
        if ui.icon_button("fit", "fit", "Fit", "0", size=24, icon_size=15, active=fitted):
            editor.do("fit")


def _hint(ui: Ui, editor: Editor) -> None:
    canvas = editor.layout.canvas
    # Beside the zoom, or above it.
    bottom = canvas.bottom - ui.px(14 if canvas.width > ui.px(HINT + 2 * ZOOM) else 54)
    with ui.floating("hint", canvas.x + canvas.width / 2, bottom, (0.5, 1), 0.9):
        top = imgui.get_cursor_pos_y()
        imgui.dummy(ImVec2(ui.px(4), ui.px(24)))
        imgui.same_line(0, 0)
        imgui.set_cursor_pos_y(top + ui.px(4))
        ui.text("Drag on the picture to push it.", size=14, bold=True)
        if canvas.width > ui.px(860):
            imgui.same_line(0, ui.px(8))
            imgui.set_cursor_pos_y(top + ui.px(4))
            ui.dim("Drop your own picture here, or press Ctrl+O.", 14)
        imgui.same_line(0, ui.px(6))
        imgui.set_cursor_pos_y(top)
        if ui.icon_button("no hint", "close", size=24, icon_size=12):
            editor.dismiss_hint()


def _statistics(ui: Ui, editor: Editor) -> None:
    canvas, session = editor.layout.canvas, editor.session
    stats = editor.numbers.take(session)
    with ui.floating("statistics", canvas.x + ui.px(12), canvas.y + ui.px(12), (0, 0), 0.85):
        clock = editor.clock.milliseconds
        ui.text(f"Frame  {clock.get('frame', 0):.1f} ms", size=13)
        for name in ("simulate", "canvas", "panels", "interface"):
            ui.dim(f"    {name}  {clock.get(name, 0):.1f} ms")
        if stats.stages:
            ui.text(f"Step  {sum(stats.stages.values()):.1f} ms", size=13)
        for name, value in stats.stages.items():
            ui.dim(f"    {name}  {value:.1f} ms")
        if stats.map is not None:
            ui.dim(f"det J  {stats.map.det_min:.2f} to {stats.map.det_max:.2f}    folds {stats.map.folds}")
            ui.dim(f"Divergence  {stats.divergence:.1e} / s")
        grid, window = session.replay.fluid.grid, session.replay.window
        part = f" of {window.detail} around the brush" if window else ""
        ui.dim(f"Grid {grid.nx} x {grid.ny}{part}    tick {session.tick}")


def _catching_up(ui: Ui, editor: Editor) -> None:
    session, canvas = editor.session, editor.layout.canvas
    if session.target - session.tick < BEHIND:
        return
    with ui.floating("catching up", canvas.x + canvas.width / 2, canvas.y + ui.px(14), (0.5, 0), 0.9, clicked=False):
        ui.dim(f"  Simulating: {session.tick} of {session.target} steps  ", 13.5)

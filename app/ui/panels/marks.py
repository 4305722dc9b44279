"""What is drawn over the picture: the brush's ring, the split, and where strokes are, push and wait."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from math import cos, hypot, pi, sin
from typing import Any

from imgui_bundle import imgui, imgui_ctx
from imgui_bundle.imgui import ImVec2

from app.model.handles import in_words
from app.model.sampling import Point
from app.model.strokes import turns
from app.ui.editor_state import EditorState, Overlay
from app.ui.pointer import PointerController
from app.ui.theme import Colour, packed, rgb
from app.ui.viewport import Viewport
from app.ui.widgets import Ui
from app.work.session import Session

BEHIND = 12  # ticks from which on it is told that the simulation is behind
MOST_WAITING = 100  # strokes that are drawn
WHITE, BLACK, WARN = rgb("ffffff"), rgb("000000"), rgb("f2a93b")


def draw(
    ui: Ui,
    view: Viewport,
    session: Session,
    state: EditorState,
    pointer: PointerController,
    selecting: Sequence[Point],
) -> None:
    """Everything that is drawn over the picture; `selecting`: what is being dragged around."""
    canvas = view.canvas
    lines = imgui.get_background_draw_list()
    lines.push_clip_rect(ImVec2(canvas.x, canvas.y), ImVec2(canvas.right, canvas.bottom), True)
    if (forces := state.overlays["forces"]).shown:
        _forces(ui, view, session, forces, lines)
    if state.split is not None and not state.before:
        _split(ui, view, state.split, lines)
    if not state.before:
        _axes(ui, view, state, lines)
    _path(ui, view, session, lines)
    _waiting(ui, view, session, lines)
    if not state.before:
        _handles(ui, view, session, state, pointer, lines)
    _dashes(ui, [view.to_screen(*place) for place in selecting], lines)
    if pointer.shows_ring:
        _ring(ui, view, session, state, pointer, lines)
    lines.pop_clip_rect()


def _dashes(ui: Ui, corners: list[Point], lines: imgui.ImDrawList) -> None:
    """A closed line in white dashes on black."""
    points: list[Any] = [ImVec2(*corner) for corner in corners]
    if len(points) < 2:
        return
    lines.add_polyline(points, packed(BLACK, 0.7), ui.px(1.6), int(imgui.ImDrawFlags_.closed))
    dash, gone = ui.px(4), 0.0
    for (x0, y0), (x1, y1) in pairwise([*corners, corners[0]]):
        length = hypot(x1 - x0, y1 - y0)
        at = -gone
        while at < length:
            start, end = max(at, 0.0), min(at + dash, length)
            if end > start:  # so that a side of no length, as of a lasso that ends where it began, has none
                parts = start / length, end / length
                first, last = (ImVec2(x0 + (x1 - x0) * part, y0 + (y1 - y0) * part) for part in parts)
                lines.add_line(first, last, packed(WHITE), ui.px(1.6))
            at += 2 * dash
        gone = (gone + length) % (2 * dash)


def _axes(ui: Ui, view: Viewport, state: EditorState, lines: imgui.ImDrawList) -> None:
    """The axes of symmetry, or the sides of the sectors, through the picture's middle."""
    rect = view.rect
    x, y = rect.x + rect.width / 2, rect.y + rect.height / 2
    angles = {"left-right": [pi / 2], "up-down": [0.0], "both": [0.0, pi / 2]}
    turns = [angle + side for angle in angles.get(state.symmetry, []) for side in (0.0, pi)]
    turns += [2 * pi * k / state.sectors - pi / 2 for k in range(state.sectors) if state.symmetry == "radial"]
    for angle in turns:
        across, down = cos(angle), sin(angle)
        sides = (rect.width / 2 / max(abs(across), 1e-9), rect.height / 2 / max(abs(down), 1e-9))
        end = ImVec2(x + across * min(sides), y + down * min(sides))
        lines.add_line(ImVec2(x, y), end, packed(BLACK, 0.45), ui.px(2.6))
        lines.add_line(ImVec2(x, y), end, packed(WHITE, 0.8), ui.px(1.0))


def _ring(
    ui: Ui, view: Viewport, session: Session, state: EditorState, pointer: PointerController, lines: imgui.ImDrawList
) -> None:
    """A faint ring as far as the brush reaches, a bright one where it is half as strong: one ring when it is hard.

    Of a stroke under way it shows the brush that acts: one that is resized meanwhile is the next stroke's. What is
    frozen is so as far as the brush reaches, however hard it is. Where the symmetry lets it act too, the second is
    faint.
    """
    brush, (x, y) = session.brush or state.brush, pointer.ring_at
    reach = brush.radius * view.longer
    core = 1.0 if state.tool_name == "freeze" else 0.9 * brush.hardness
    # Where the brush is half as strong as in its middle: (1 - q^2)^3 = 1/2, between the core and the reach.
    half = reach * (core + 0.4542 * (1 - core))
    middle, count = ImVec2(x, y), max(32, min(int(reach), 96))
    soft = rgb("000000", 0.45)
    if pointer.drag == "paint" and state.stabiliser:
        pen = ImVec2(pointer.x, pointer.y)
        lines.add_line(middle, pen, packed(soft), ui.px(2.6))
        lines.add_line(middle, pen, packed(WHITE, 0.95), ui.px(1.0))
        lines.add_circle_filled(pen, ui.px(2.6), packed(WHITE), 12)
    if state.tool_name != "handle":  # which has none
        rect = view.rect
        centre = rect.x + rect.width / 2, rect.y + rect.height / 2
        dx, dy = x - centre[0], y - centre[1]
        for a, b, c, d in turns(state.symmetry, state.sectors):
            image = ImVec2(centre[0] + a * dx + b * dy, centre[1] + c * dx + d * dy)
            lines.add_circle(image, half, packed(soft, 0.5), count, ui.px(2.0))
            lines.add_circle(image, half, packed(WHITE, 0.55), count, ui.px(1.0))
    lines.add_circle(middle, reach, packed(soft, 0.5), count, ui.px(2.0))
    lines.add_circle(middle, reach, packed(WHITE, 0.55), count, ui.px(1.0))
    lines.add_circle(middle, half, packed(soft), count, ui.px(2.6))
    lines.add_circle(middle, half, packed(WHITE, 0.95), count, ui.px(1.3))
    lines.add_circle_filled(middle, ui.px(2.2), packed(soft), 12)
    lines.add_circle_filled(middle, ui.px(1.4), packed(WHITE), 12)
    if pointer.is_opposite:
        reach = ui.px(5)
        lines.add_line(ImVec2(x - reach, y), ImVec2(x + reach, y), packed(soft), ui.px(3.2))
        lines.add_line(ImVec2(x - reach, y), ImVec2(x + reach, y), packed(WHITE), ui.px(1.6))


def _handles(
    ui: Ui, view: Viewport, session: Session, state: EditorState, pointer: PointerController, lines: imgui.ImDrawList
) -> None:
    """Where handles were, are and shall be; faint, and without their numbers, while another tool is in hand.

    A pin is a dot in a ring.
    """
    in_hand = state.tool_name == "handle"
    alpha, hovered = 1.0 if in_hand else 0.45, pointer.hovered
    shade, ground = packed(BLACK, 0.45 * alpha), packed(ui.palette.panel, 0.85 * alpha)
    for held in session.marks:
        start, now, target = (ImVec2(*view.to_screen(*place)) for place in (held.start, held.now, held.target))
        selected = in_hand and held.label == state.selected
        is_hovered = hovered is not None and held.label == hovered.label
        ink = ui.palette.accent if selected or is_hovered else WHITE
        if selected:
            reach = held.led.radius * view.longer
            lines.add_circle(target, reach, packed(BLACK, 0.3), max(32, min(int(reach), 96)), ui.px(2.0))
            lines.add_circle(target, reach, packed(ink, 0.6), max(32, min(int(reach), 96)), ui.px(1.0))
        line: list[Any] = [ImVec2(*view.to_screen(*place)) for place in held.line]
        if line:
            lines.add_polyline(line, shade, ui.px(4.6), 0)
            lines.add_polyline(line, packed(ink, 0.8 * alpha), ui.px(2.2), 0)
        if held.is_away and held.due:
            due: list[Any] = [ImVec2(*view.to_screen(*place)) for place in held.due]
            lines.add_polyline(due, shade, ui.px(3.4), 0)
            lines.add_polyline(due, packed(WARN, 0.8 * alpha), ui.px(1.2), 0)
        if hypot(target.x - start.x, target.y - start.y) > ui.px(8):
            lines.add_line(start, target, shade, ui.px(3.6))
            lines.add_line(start, target, packed(ink, 0.8 * alpha), ui.px(1.6))
            lines.add_circle_filled(start, ui.px(3.2), shade, 16)
            lines.add_circle_filled(start, ui.px(2.2), packed(ink, alpha), 16)
        radius = ui.px(7 if selected or is_hovered else 6)
        lines.add_circle_filled(target, radius + ui.px(1.4), shade, 24)
        lines.add_circle_filled(target, radius, ground, 24)
        lines.add_circle(target, radius, packed(ink, alpha), 24, ui.px(1.8))
        if held.is_away:
            lines.add_line(now, target, packed(WARN, alpha), ui.px(1.6))
            lines.add_circle_filled(now, ui.px(4), shade, 16)
            lines.add_circle_filled(now, ui.px(3), packed(WARN, alpha), 16)
        else:
            lines.add_circle_filled(target, ui.px(2.6), packed(ink, alpha), 16)
        if in_hand:
            is_left = start.x > target.x
            across = (radius + ui.px(7)) * (-1 if is_left else 1)
            at = ImVec2(target.x + across, target.y)
            _number(ui, held.label, at, is_left, selected or is_hovered, lines)


def _number(ui: Ui, label: str, at: ImVec2, is_left: bool, is_lit: bool, lines: imgui.ImDrawList) -> None:
    """What messages call a handle or a pin, beside its mark, away from where it came from; of handles the number and
    the name. Lit it is a box of the accent.
    """
    ground, ink = (packed(ui.palette.accent), ui.palette.on_accent) if is_lit else (packed(BLACK, 0.5), WHITE)
    words = _words(label)
    with imgui_ctx.push_font(ui.fonts.bold, 12.0):
        size, box = imgui.calc_text_size(words), ImVec2(ui.px(3), 0.0)
        at = ImVec2(at.x - (size.x if is_left else 0.0), at.y - size.y / 2)
        lines.add_rect_filled(at - box, at + size + box, ground, ui.px(4))
        lines.add_text(at, packed(ink), words)


@lru_cache(256)
def _words(label: str) -> str:
    words = in_words(label).removeprefix("handle ")
    return re.sub(r'^(\d+) "pair \1"$', r"\1", words)  # a fit's own name says no more


def _path(ui: Ui, view: Viewport, session: Session, lines: imgui.ImDrawList) -> None:
    """The path of a curve that is being drawn."""
    if session.made is not None or len(session.path) < 2:
        return
    points: list[Any] = [ImVec2(*view.to_screen(*place)) for place in session.path]
    lines.add_polyline(points, packed(BLACK, 0.45), ui.px(5), 0)
    lines.add_polyline(points, packed(ui.palette.accent), ui.px(2.4), 0)
    _arrow_head(lines, points[max(len(points) - 6, 0)], points[-1], ui.px(10), ui.palette.accent)


def _waiting(ui: Ui, view: Viewport, session: Session, lines: imgui.ImDrawList) -> None:
    """Where strokes will act that are drawn already, while the simulation is clearly behind them."""
    if session.target - session.tick < BEHIND:
        return
    for stroke in session.waiting[:MOST_WAITING]:
        step = max(len(stroke.samples) // 40, 1)
        places = [*(sample[1:3] for sample in stroke.samples[::step]), stroke.samples[-1][1:3]]
        points: list[Any] = [ImVec2(*view.to_screen(*place)) for place in places]
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


def _forces(ui: Ui, view: Viewport, session: Session, overlay: Overlay, lines: imgui.ImDrawList) -> None:
    """Where strokes push, up to the playhead; older ones fainter."""
    for stroke in session.recipe.stroke[-60:]:
        if stroke.muted or stroke.first_tick > session.tick or stroke.tool not in ("push", "curve"):
            continue
        step = max(len(stroke.samples) // 40, 1)
        places = [sample[1:3] for sample in stroke.samples[::step]]
        points: list[Any] = [ImVec2(*view.to_screen(*place)) for place in places]
        active = stroke.end_tick >= session.tick - 1
        alpha = overlay.opacity * (1.0 if active else 0.6)
        lines.add_polyline(points, packed(BLACK, 0.5 * alpha), ui.px(4.5), 0)
        colour = (*ui.palette.accent[:3], alpha)
        lines.add_polyline(points, packed(colour), ui.px(2), 0)
        if len(points) > 1:
            _arrow_head(lines, points[-2], points[-1], ui.px(9), colour)


def _split(ui: Ui, view: Viewport, split: float, lines: imgui.ImDrawList) -> None:
    rect, canvas = view.rect, view.canvas
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
    with imgui_ctx.push_font(ui.fonts.bold, 12.0):
        for label, left in (("Before", True), ("After", False)):
            size = imgui.calc_text_size(label)
            at = ImVec2(x - size.x - ui.px(18) if left else x + ui.px(18), top + ui.px(14))
            box = ImVec2(ui.px(7), ui.px(3))
            lines.add_rect_filled(at - box, at + size + box, packed(BLACK, 0.5), ui.px(5))
            lines.add_text(at, packed(WHITE), label)

"""The lanes above the timeline: strokes, forces and handles as bars, to be moved, stretched, muted and taken away."""

from __future__ import annotations

from bisect import bisect_right
from math import ceil, floor, inf
from typing import NamedTuple

from imgui_bundle import imgui, imgui_ctx
from imgui_bundle.imgui import ImVec2

from app.model.bars import KINDS, Actor, Bar, Which, bar_of, one_of, several_of
from app.model.handles import RecipeHandle, RecipePin, heading
from app.model.recipe import MOST_TICKS
from app.model.schema import label_of
from app.model.strokes import Stroke
from app.ui import icons
from app.ui.actions import ACTIONS, Do
from app.ui.editor_state import EditorState
from app.ui.lanes import Lanes, Part
from app.ui.layout import LEAST_LANES, TALLEST_LANES
from app.ui.panels import timebar
from app.ui.panels.timebar import FORCES, HANDLES, MASKS
from app.ui.theme import packed, rgb
from app.ui.viewport import Rect
from app.ui.widgets import Ui, fitting
from app.work.session import Session

ROW, GAP = 20.0, 3.0
HEAD, RULER = 30.0, 18.0
LOW = 100.0  # points of height up to which there is no ruler
EDGE = 4.0  # points of the upper edge that can be taken hold of
GRIP = 6.0  # points at a bar's ends by which it is stretched
NARROWEST = 9.0  # points of a bar
SHAKE = 3.0  # points that the pointer may move and is not dragging yet
INK = rgb("1a1a1a")
ICONS = {"thin": "thicken", "thaw": "freeze", "vortex": "twirl", "source": "bloat", "sink": "pinch", "pin": "handle"}
STEPS = (0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800, 3600)  # seconds between two numbers


class Scale(NamedTuple):
    """Where ticks lie on the screen: from `start` to `stop` between `x0` and `x1`."""

    x0: float
    x1: float
    start: float
    stop: float

    @property
    def a_tick(self) -> float:
        """Points that a tick takes."""
        return (self.x1 - self.x0) / (self.stop - self.start)

    def across(self, tick: float) -> float:
        """Where a tick lies; what has no end lies at the end."""
        return self.x1 if tick == inf else self.x0 + (tick - self.start) * self.a_tick

    def tick_at(self, x: float) -> float:
        """The tick that lies there."""
        return self.start + (x - self.x0) / self.a_tick


def draw(ui: Ui, rect: Rect, session: Session, state: EditorState, do: Do) -> None:
    """What is selected and what can be done with it, the seconds, and the bars."""
    lanes = state.lanes
    lanes.look(session)
    if session.is_painting:
        lanes.selected = set()
    with ui.panel("lanes", rect, (12, 4), imgui.WindowFlags_.no_scroll_with_mouse):
        _edge(ui, rect, lanes)
        _head(ui, session, state, do)
        bar = imgui.get_style().scrollbar_size
        x0 = rect.x + ui.px(12)
        scale = Scale(x0, max(rect.right - ui.px(14) - bar, x0 + 1.0), *lanes.span(session.length))
        with imgui_ctx.push_style_var(imgui.StyleVar_.item_spacing, ImVec2(0, 0)):
            if rect.height > ui.px(LOW):
                _ruler(ui, session, scale)
            let_go = _bars(ui, session, state, scale)
    if let_go:
        lanes.release(session)


def _edge(ui: Ui, rect: Rect, lanes: Lanes) -> None:
    """The upper edge, which is dragged to make room for more lanes."""
    corner = imgui.get_cursor_screen_pos()
    imgui.set_cursor_screen_pos(ImVec2(rect.x, rect.y))
    imgui.invisible_button("edge", ImVec2(rect.width, ui.px(EDGE)))
    held, hovered = imgui.is_item_active(), imgui.is_item_hovered()
    if held and imgui.get_io().mouse_delta.y:
        lanes.height = min(max((rect.bottom - imgui.get_mouse_pos().y) / ui.scale, LEAST_LANES), TALLEST_LANES)
    ui.tooltip("The lanes", more="Drag to show more or fewer of them.")
    low, high = ImVec2(rect.x, rect.y), ImVec2(rect.right, rect.y + ui.px(2 if held or hovered else 1))
    if held or hovered:
        imgui.get_window_draw_list().add_rect_filled(low, high, packed(ui.palette.accent))
    else:
        ui.rule(low, high)
    imgui.set_cursor_screen_pos(corner)


def _head(ui: Ui, session: Session, state: EditorState, do: Do) -> None:
    lanes = state.lanes
    corner, inside = imgui.get_cursor_screen_pos(), imgui.get_content_region_avail().x
    some = bool(lanes.selected)
    muted = lanes.is_muted(session)
    buttons = (
        ("bars_together", "together", "They begin with the first of them.", len(lanes.selected) > 1, False),
        ("bars_mute", "mute", "" if muted else "It stays, and does nothing.", some, muted),
        ("remove", "trash", "", some, False),
    )
    size, between = 24.0, 4.0
    left = inside - ui.px(len(buttons) * (size + between))
    _words(ui, _told(session, state), corner, left)
    for number, (name, icon, more, enabled, active) in enumerate(buttons):
        imgui.set_cursor_screen_pos(ImVec2(corner.x + left + ui.px(between + number * (size + between)), corner.y))
        action = ACTIONS[name]
        title = "Delete" if name == "remove" else "Let them act again" if active else action.label
        if ui.icon_button(name, icon, title, action.key, more, active, enabled, size, 16):
            do(name)
    imgui.set_cursor_screen_pos(corner + ImVec2(0, ui.px(HEAD - 4)))


def _words(ui: Ui, words: str, corner: ImVec2, room: float) -> None:
    with imgui_ctx.push_font(ui.fonts.regular, 13.5):
        line = fitting(words, room, imgui.get_text_line_height())
        imgui.get_window_draw_list().add_text(corner + ImVec2(0, ui.px(4)), packed(ui.palette.dim), line)
    if line != words:
        imgui.dummy(ImVec2(room, ui.px(HEAD - 4)))
        ui.tooltip("All of it", more=words)


def _told(session: Session, state: EditorState) -> str:
    recipe, lanes = session.recipe, state.lanes
    if only := lanes.only(recipe):
        which, one = only
        return f"{name_of(one, which)}: {when(session, bar_of(one, which, session.end, session.dt))}"
    if lanes.selected:
        return f"{len(lanes.selected)} selected"
    counts = [(len(several_of(recipe, kind)), kind) for kind in reversed(KINDS)]
    told = [f"{count} {noun}{'s' if count != 1 else ''}" for count, noun in counts if count]
    return ", ".join(told) or "Strokes become bars here: move them, stretch them, repeat them."


def name_of(one: Actor, which: Which) -> str:
    """What a person calls it; handles and pins have their number, which messages tell."""
    if isinstance(one, Stroke):
        return one.tool.capitalize()
    if isinstance(one, RecipeHandle | RecipePin):
        is_pin = isinstance(one, RecipeHandle) and not one.is_led
        return f"{heading(label_of(one.kind, which[1] + 1, one.name))}{' (pin)' * is_pin}"
    return one.name or f"{one.kind.capitalize()} force"


def when(session: Session, bar: Bar) -> str:
    """When a bar begins and how long it lasts, in words."""
    if not bar.is_free:
        return "by a formula of the time"
    dt = session.dt
    lasts = "on" if bar.end == inf else f"for {(bar.end - bar.start) * dt:.2f} s"
    return f"from {bar.start * dt:.2f} s{', ' * (bar.end < inf) or ' '}{lasts}"


def _ruler(ui: Ui, session: Session, scale: Scale) -> None:
    """Seconds, and the playhead, which follows the pointer that is pressed here."""
    corner, height, dt, x1 = imgui.get_cursor_screen_pos(), ui.px(RULER), session.dt, scale.x1
    imgui.invisible_button("ruler", ImVec2(max(x1 - corner.x, 1.0), height))
    if imgui.is_item_active() and session.length:
        tick = round(min(max(scale.tick_at(imgui.get_mouse_pos().x), 0), session.length))
        if tick != session.moment:
            session.seek(tick)
    elif imgui.is_item_hovered():
        ui.tooltip("The recording", more="Drag to move through it. Ctrl and the wheel zoom.")
    draw, palette = imgui.get_window_draw_list(), ui.palette
    step = next((step for step in STEPS if step * scale.a_tick / dt >= ui.px(56)), STEPS[-1])
    with imgui_ctx.push_font(ui.fonts.regular, 11.5):
        for number in range(ceil(scale.start * dt / step - 1e-6), floor(scale.stop * dt / step + 1e-6) + 1):
            x = scale.across(number * step / dt)
            words = f"{number * step:g} s"
            ui.rule(ImVec2(x, corner.y + height - ui.px(5)), ImVec2(x + ui.px(1), corner.y + height))
            if x + imgui.calc_text_size(words).x + ui.px(4) < x1 + ui.px(14):
                draw.add_text(ImVec2(x + ui.px(3), corner.y), packed(palette.faint), words)
    ui.rule(ImVec2(corner.x, corner.y + height - ui.px(1)), ImVec2(x1, corner.y + height))


def _bars(ui: Ui, session: Session, state: EditorState, scale: Scale) -> bool:
    """The bars; True if the pointer has let go of them."""
    lanes = state.lanes
    packed_lanes = lanes.packed(session.recipe, session.end, ui.px(NARROWEST) / scale.a_tick)
    with imgui_ctx.begin_child("rows", ImVec2(0, 0), 0, imgui.WindowFlags_.no_background):
        corner, row = imgui.get_cursor_screen_pos(), ui.px(ROW + GAP)
        room = imgui.get_content_region_avail().y
        height = max(len(packed_lanes) * row + ui.px(GAP), room)
        imgui.invisible_button("bars", ImVec2(max(imgui.get_content_region_avail().x, 1.0), height))
        let_go = _point(ui, session, state, scale)
        draw = imgui.get_window_draw_list()
        top = imgui.get_window_pos().y
        lanes.drawn.clear()
        first = max(floor((top - corner.y) / row), 0)
        last = ceil((top + imgui.get_window_height() - corner.y) / row)
        for number in range(first, min(last, len(packed_lanes))):
            lane = packed_lanes[number]
            y = corner.y + ui.px(GAP) + number * row
            at = max(bisect_right(lane, scale.start, key=lambda bar: bar.start) - 1, 0)
            for bar in lane[at:]:
                if bar.start > scale.stop:
                    break
                _bar(ui, session, state, bar, y, scale)
        now = scale.across(session.moment)
        if scale.x0 <= now <= scale.x1 and session.length:
            low, high = ImVec2(now, top), ImVec2(now + ui.px(1.5), top + imgui.get_window_height())
            draw.add_rect_filled(low, high, packed(ui.palette.text))
        if lanes.box is not None:
            begun, here = ImVec2(*lanes.box[:2]), imgui.get_mouse_pos()
            draw.add_rect_filled(begun, here, packed(ui.palette.text, 0.12))
            draw.add_rect(begun, here, packed(ui.palette.text, 0.6))
    return let_go


def _bar(ui: Ui, session: Session, state: EditorState, bar: Bar, y: float, scale: Scale) -> None:
    lanes, draw, palette = state.lanes, imgui.get_window_draw_list(), ui.palette
    one = one_of(session.recipe, bar.which)
    if one is None:
        return
    drag = lanes.drag
    if drag is not None and drag.moved:
        taken = lanes.selected if drag.part == "move" else ()
        if bar.which == drag.bar.which or bar.which in taken:
            one = lanes.dragged(one, drag, session.dt)
            bar = bar_of(one, bar.which, session.end, session.dt)
    left, right = scale.across(bar.start), scale.across(bar.end)
    right = max(right - ui.px(1), left + ui.px(NARROWEST - 2))
    low, high = ImVec2(left, y), ImVec2(right, y + ui.px(ROW))
    lanes.drawn.append((bar, Rect(left, y, right - left, ui.px(ROW))))
    kind = one.tool if isinstance(one, Stroke) else one.kind
    if isinstance(one, Stroke):
        colour = timebar.KINDS.get(kind, MASKS)
    else:
        colour = HANDLES if isinstance(one, RecipeHandle | RecipePin) else FORCES
    faint = 0.28 if bar.muted else 1.0
    if bar.stops > bar.end:
        _after(ui, bar, y, packed(colour, 0.45 * faint), scale)
    draw.add_rect_filled(low, high, packed(colour, faint), ui.px(4))
    if bar.which in lanes.selected:
        draw.add_rect(low, high, packed(palette.text), ui.px(4), ui.px(2))
    elif state.selected and state.selected == _label(session, bar):  # on the picture
        draw.add_rect(low, high, packed(palette.accent), ui.px(4), ui.px(2))
    ink = packed(palette.text if bar.muted else INK, 0.6 if bar.muted else 0.9)
    if isinstance(one, RecipeHandle):
        for time, *_ in one.turned:  # diamonds, as keyframes are everywhere
            x = min(max(scale.across(time / session.dt), left + ui.px(5)), right - ui.px(5))
            draw.add_circle_filled(ImVec2(x, high.y - ui.px(4)), ui.px(3.5), ink, 4)
    icon = "mute" if bar.muted else ICONS.get(kind, kind)
    icon = icon if icon in icons.PATHS else "force"
    is_numbered, room = isinstance(one, RecipeHandle | RecipePin), right - left - ui.px(10)
    with imgui_ctx.push_font(ui.fonts.regular, 12.5):
        words = name_of(one, bar.which)
        if is_numbered and ui.px(18) + imgui.calc_text_size(words).x > room:
            words = str(bar.which[1] + 1)  # as at its mark on the picture, which tells more than the icon
        width = imgui.calc_text_size(words).x
        x = max(left, scale.x0) + ui.px(6)
        draw.push_clip_rect(low, ImVec2(high.x - ui.px(4), high.y), True)
        if room > (ui.px(18) + width if is_numbered else ui.px(16)):
            icons.draw(draw, icon, x, y + ui.px(3.5), ui.px(13), ink, 2.0)
            x += ui.px(18)
        if room > (width if is_numbered else ui.px(50)):
            draw.add_text(ImVec2(x, y + ui.px(3)), ink, words)
        draw.pop_clip_rect()
        if is_numbered and room <= width < min(scale.across(bar.stops), scale.x1) - right - ui.px(8):
            draw.add_text(ImVec2(right + ui.px(4), y + ui.px(3)), packed(palette.text, 0.9), words)


def _after(ui: Ui, bar: Bar, y: float, colour: int, scale: Scale) -> None:
    """The repetitions of a bar that are seen, or what it holds; one long bar where they cannot be told apart."""
    draw, length, across = imgui.get_window_draw_list(), bar.end - bar.start, scale.across
    spacing = bar.every * scale.a_tick
    top, bottom = y + ui.px(3), y + ui.px(ROW - 3)
    if spacing < ui.px(4):
        low, high = ImVec2(max(across(bar.end), scale.x0), top), ImVec2(min(across(bar.stops), scale.x1), bottom)
        draw.add_rect_filled(low, high, colour, ui.px(3))
        return
    times = round((bar.stops - bar.end) / bar.every)
    first = max(floor((scale.x0 - across(bar.end)) / spacing), 1)
    last = min(ceil((scale.x1 - across(bar.start)) / spacing), times)
    for time in range(first, last + 1):
        left, right = across(bar.start + time * bar.every), across(bar.start + time * bar.every + length)
        right = max(right - ui.px(1), left + ui.px(3))
        draw.add_rect_filled(ImVec2(left, top), ImVec2(right, bottom), colour, ui.px(3))


def _point(ui: Ui, session: Session, state: EditorState, scale: Scale) -> bool:
    """What the pointer does to the bars; True if it has let go of them."""
    lanes, mouse, io = state.lanes, imgui.get_mouse_pos(), imgui.get_io()
    hovered, let_go = imgui.is_item_hovered(), imgui.is_item_deactivated()
    found = _under(ui, state, mouse.x, mouse.y) if hovered else None
    if imgui.is_item_activated():
        adds = io.key_shift or io.key_ctrl
        if found is not None:
            state.selected = _label(session, found[0])
            lanes.press(*found, scale.tick_at(mouse.x), mouse.x, adds, session.length)
        else:
            lanes.press_beside(mouse.x, mouse.y, adds)
    elif imgui.is_item_active() and lanes.box is not None:
        if max(abs(mouse.x - lanes.box[0]), abs(mouse.y - lanes.box[1])) > ui.px(SHAKE):
            lanes.stretch_box(mouse.x, mouse.y)
    elif imgui.is_item_active() and lanes.drag is not None:
        drag = lanes.drag
        drag.moved |= abs(mouse.x - drag.x) > ui.px(SHAKE)
        drag.ticks = _limited(state, session, round(scale.tick_at(mouse.x) - drag.at))
    elif found is not None:
        _tell(ui, session, found[0])
    if hovered and io.mouse_wheel and io.key_ctrl:
        lanes.zoom(session.length, scale.tick_at(mouse.x), 0.8**io.mouse_wheel)
    elif hovered and (io.mouse_wheel_h or (io.mouse_wheel and io.key_shift)):
        lanes.pan(session.length, -0.1 * (io.mouse_wheel_h or io.mouse_wheel))
    return let_go


def _limited(state: EditorState, session: Session, ticks: int) -> int:
    """So many ticks, but nothing goes before the beginning, nor is stretched to nothing."""
    drag = state.lanes.drag
    assert drag is not None
    if not drag.bar.is_free:
        return 0
    if drag.part == "move":
        return max(ticks, -int(state.lanes.earliest(session)))
    length = int(min(drag.bar.end - drag.bar.start, MOST_TICKS))
    return max(min(ticks, length - 1), -int(drag.bar.start)) if drag.part == "start" else max(ticks, 1 - length)


def _under(ui: Ui, state: EditorState, x: float, y: float) -> tuple[Bar, Part] | None:
    """The bar under the pointer, and which part of it."""
    for bar, rect in state.lanes.drawn:
        if rect.y <= y <= rect.bottom and rect.x - ui.px(1) <= x <= rect.right + ui.px(2):
            grip = min(ui.px(GRIP), rect.width / 4)
            if not bar.is_free:
                return bar, "move"
            if x > rect.right - grip:
                return bar, "end"
            return bar, "start" if x < rect.x + grip and rect.width > 2 * ui.px(GRIP) else "move"
    return None


def _label(session: Session, bar: Bar) -> str:
    """What messages call the handle or pin of a bar; nothing where it is of none."""
    one = one_of(session.recipe, bar.which)
    held = isinstance(one, RecipeHandle | RecipePin)
    return label_of(one.kind, bar.which[1] + 1, one.name) if held else ""


def _tell(ui: Ui, session: Session, bar: Bar) -> None:
    one = one_of(session.recipe, bar.which)
    if one is None:
        return
    told = when(session, bar)
    more = [f"{told[0].upper()}{told[1:]}."]
    if isinstance(one, Stroke) and one.repeat > 1:
        more.append(f"{one.repeat} times, every {one.every * session.dt:.2f} s.")
    if bar.muted:
        more.append("Muted: it does nothing.")
    more.append("Drag to move it, its ends to stretch it." if bar.is_free else "It acts all the time.")
    ui.tooltip(name_of(one, bar.which), more=" ".join(more))

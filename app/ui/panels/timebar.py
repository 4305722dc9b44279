"""The timeline along the bottom: play, scrub, and go on from anywhere."""

from __future__ import annotations

from collections.abc import Callable

from imgui_bundle import imgui, imgui_ctx
from imgui_bundle.imgui import ImVec2

from app.model.handles import RecipeHandle, labelled
from app.ui.actions import ACTIONS, Do
from app.ui.editor_state import EditorState
from app.ui.theme import Colour, blend, packed, rgb
from app.ui.units import PERCENT
from app.ui.viewport import Rect
from app.ui.widgets import Ui
from app.work.session import Session

# Blocks on the track, by what the stroke does; told apart without red against green.
KINDS: dict[str, Colour] = {
    "push": rgb("f2a93b"), "curve": rgb("f2a93b"), "twirl": rgb("cc79a7"), "bloat": rgb("56b4e9"),
    "pinch": rgb("56b4e9"), "restore": rgb("bdbdbd"),
}  # fmt: skip
MASKS = rgb("0f86c9")
HANDLES = rgb("4fc1a6")
FORCES = rgb("a99be0")
REPEATS = {  # how the recording is played: icon, name, and what a click makes of it
    "once": ("once", "Plays once", "Click to play it in a loop."),
    "loop": (
        "loop",
        "Loop: plays over and over",
        "Click for ping-pong: there and back again, in what is exported too.",
    ),
    "returns": (
        "returns",
        "Ping-pong: plays there and back again",
        "Without a jump, in what is exported too. Click to play it once.",
    ),
}
LANES = 4  # of bars of handles, one below the other


def draw(ui: Ui, rect: Rect, session: Session, state: EditorState, do: Do) -> None:
    """Buttons, the time, the track, and how much of the warp is seen."""
    with ui.panel("timeline", rect, (8, 12)):
        some = session.length > 0
        if ui.icon_button("start", "back", "To the start", "home", enabled=some):
            do("start")
        imgui.same_line(0, ui.px(2))
        moving = session.playing or session.coasting
        title = "Pause" if moving else "Play"
        if ui.icon_button("play", "pause" if moving else "play", title, "space", "Tap Space.", enabled=some):
            do("play")
        imgui.same_line(0, ui.px(2))
        if ui.icon_button("step", "step", "One step forward", ".", enabled=some):
            do("step")
        imgui.same_line(0, ui.px(2))
        returns = session.recipe.time.ping_pong
        icon, now, coming = REPEATS["returns" if returns else "loop" if session.loops else "once"]
        if session.project.clip is not None and session.loops:
            coming = "Click to play it once."
        if ui.icon_button("repeat", icon, now, more=coming, active=icon != "once", enabled=some):
            do("repeat")
        imgui.same_line(0, ui.px(2))
        shown = state.lanes.shown
        if ui.icon_button("lanes", "lanes", ACTIONS["lanes"].label, "l", "To move them in time.", active=shown):
            do("lanes")
        imgui.same_line(0, ui.px(10))
        if imgui.get_window_width() > ui.px(560):
            _time(ui, session.moment * session.dt, session.length * session.dt)
            imgui.same_line(0, ui.px(16))
        across = min(168, 0.3 * imgui.get_window_width() / ui.scale)
        amount = ui.px(across)
        _track(ui, session, state, imgui.get_content_region_avail().x - amount - ui.px(16))
        imgui.same_line(0, ui.px(16))
        imgui.set_cursor_pos_y(ui.px(14))
        _amount(ui, session, state, across)


def _amount(ui: Ui, session: Session, state: EditorState, across: float) -> None:
    with ui.enabled(session.recipe.mode == "coordinates"):
        slid = ui.slider(
            "amount", "Amount", session.recipe.amount, 0, 1.5, PERCENT, 1.0, width=across, title="Amount of the warp",
            more="How much of it is seen and exported, whatever the time.",
        )  # fmt: skip
        state.is_scaling = imgui.is_item_active() and not slid.done
    if slid.again:
        session.retract()
    if slid.changed:
        session.preview(amount=round(slid.value, 4))
    if slid.done:
        session.commit("Amount")


def _time(ui: Ui, now: float, end: float) -> None:
    corner = imgui.get_cursor_screen_pos()
    with imgui_ctx.push_font(ui.fonts.regular, 14.0):
        shown = f"{now:.2f}"
        draw = imgui.get_window_draw_list()
        y = corner.y + (ui.px(32) - imgui.get_font_size()) / 2
        right = corner.x + ui.px(42)
        draw.add_text(ImVec2(right - imgui.calc_text_size(shown).x, y), packed(ui.palette.text), shown)
        draw.add_text(ImVec2(right + ui.px(5), y), packed(ui.palette.faint), f"/  {end:.2f} s")
    imgui.dummy(ImVec2(ui.px(108), ui.px(32)))


def _track(ui: Ui, session: Session, state: EditorState, width: float) -> None:
    palette = ui.palette
    width = max(width, ui.px(40))
    corner, height = imgui.get_cursor_screen_pos(), ui.px(32)
    imgui.invisible_button("track", ImVec2(width, height))
    hovered, held = imgui.is_item_hovered(), imgui.is_item_active()
    inset = ui.px(7)
    x0, x1 = corner.x + inset, corner.x + width - inset
    end = session.length
    if held and end:
        part = min(max((imgui.get_mouse_pos().x - x0) / (x1 - x0), 0.0), 1.0)
        tick = round(part * end)
        if tick != session.moment:
            session.seek(tick)
    draw = imgui.get_window_draw_list()
    top, bottom = corner.y + ui.px(10), corner.y + ui.px(22)
    draw.add_rect_filled(ImVec2(x0, top), ImVec2(x1, bottom), packed(palette.raised), ui.px(4))

    def across(tick: float) -> float:
        return x0 + (x1 - x0) * min(tick / max(end, 1), 1.0)

    for x in {across(edit.tick) for edit in session.recipe.mask}:
        draw.add_line(ImVec2(x, top - ui.px(3)), ImVec2(x, bottom + ui.px(3)), packed(MASKS), ui.px(2))
    if not end:
        return
    now = across(session.moment)
    played = blend(palette.raised, palette.accent, 0.16)
    draw.add_rect_filled(ImVec2(x0, top), ImVec2(now, bottom), packed(played), ui.px(4))
    passed = min(session.tick, session.target)
    for block in state.lanes.blocks(session.recipe, end / max(x1 - x0, 1.0)):
        a, b = across(block.start), across(block.end)
        faded = (1.0 if block.start < passed else 0.45) * (0.4 if block.muted else 1.0)
        low, high = ImVec2(a, top + ui.px(3)), ImVec2(max(b - ui.px(1), a + ui.px(2)), bottom - ui.px(3))
        draw.add_rect_filled(low, high, packed(KINDS.get(block.tool, MASKS), faded), ui.px(2))
    _handles(ui, session, state, across, top, bottom, draw)
    for change in session.recipe.change:
        x = across(change.tick)
        draw.add_line(ImVec2(x, top), ImVec2(x, bottom), packed(palette.dim), ui.px(1))
    radius = ui.px(7 if hovered or held else 6)
    ink = palette.text
    draw.add_line(ImVec2(now, top - ui.px(4)), ImVec2(now, bottom + ui.px(4)), packed(ink), ui.px(2))
    draw.add_circle_filled(ImVec2(now, (top + bottom) / 2), radius, packed(ink), 24)
    if hovered and not held:
        ui.tooltip("The recording", more="Drag to go through it both ways. Paint anywhere to go on from there.")


def _handles(
    ui: Ui,
    session: Session,
    state: EditorState,
    across: Callable[[float], float],
    top: float,
    bottom: float,
    draw: imgui.ImDrawList,
) -> None:
    """A bar for each handle and pin, bright while it is led, faint while it only holds.

    The selected one is white; gaps are keyframes.
    """
    recipe, dt = session.recipe, session.dt
    led = labelled(recipe.handle, recipe.pin)
    if not led:
        return
    lanes, end, point = min(len(led), LANES), session.end * dt, ui.px(1)
    first, room = top + ui.px(2), bottom - top - ui.px(4)
    height = max(room / lanes - point, ui.px(1.5))
    for number, (label, one) in enumerate(led):
        last = one.last if isinstance(one, RecipeHandle) else one.start
        x, y = across(one.start / dt), first + room * (number % lanes) / lanes
        colour = ui.palette.text if label == state.selected else HANDLES
        for until, alpha in ((end if one.end is None else one.end, 0.4), (last, 1.0)):
            high = ImVec2(max(across(until / dt), x + 2 * point), y + height)
            draw.add_rect_filled(ImVec2(x, y), high, packed(colour, alpha), point)
        for time in [key[0] for key in one.turned] if isinstance(one, RecipeHandle) else ():
            x = across(time / dt)  # a keyframe: a gap in its bar
            draw.add_rect_filled(ImVec2(x - point, y), ImVec2(x + point, y + height), packed(ui.palette.ground))

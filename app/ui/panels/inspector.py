"""The inspector on the right: the fluid, what is seen, the edits, and numbers for those who want them.

Long, as every section is a function here, and none has parts that another panel shows.
"""

from __future__ import annotations

from collections.abc import Callable
from math import hypot, log10
from pathlib import PurePath
from typing import Any

import moderngl
import numpy as np
from imgui_bundle import imgui, imgui_ctx
from imgui_bundle.imgui import ImVec2

from app.model.handles import ARRIVED, RecipeHandle, RecipePin, heading, labelled
from app.model.mask_edits import MASKS, THICKEST, THINNEST, MaskStroke, PictureMask, is_brightness
from app.model.presets import DEFAULT
from app.model.strokes import Symmetry
from app.ui.actions import ACTIONS, Do
from app.ui.clock import Clock
from app.ui.editor_state import SELECT_BY, EditorState
from app.ui.panels import feels, selected_bar
from app.ui.quality import Quality
from app.ui.selecting import Selecting
from app.ui.theme import packed
from app.ui.units import DEGREES, PER_SECOND, PERCENT, THREE_DIGITS, TIMES, picture_pixels
from app.ui.viewport import Rect
from app.ui.widgets import Slid, Ui
from app.ui.workspace import Workspace
from app.work.session import Session

DETAILS = {128: "coarse", 160: "rather coarse", 192: "medium", 256: "fine", 384: "very fine"}
GRIDS = tuple(DETAILS)
EDGES = ("clamp", "mirror", "wrap", "transparent", "black")
SYMMETRIES: dict[Symmetry, str] = {
    "none": "Off", "left-right": "Left and right", "up-down": "Top and bottom", "both": "Both", "radial": "Radial",
}  # fmt: skip
WALLS = ("free-slip", "no-slip")
ROW = 32  # points, of the history
ABOUT_MASKS = {
    "invert": "Swaps thickest and thinnest, or frozen and free.",
    "fill": "All of the picture.",
    "clear": "Removes all paint.",
    "feather": "Softens edges, or rounds the corners of frozen areas.",
    "load": "A picture: white is frozen, or thickest.",
    "save": "A picture of 16 bits.",
}


def draw(
    ui: Ui,
    rect: Rect,
    workspace: Workspace,
    state: EditorState,
    selecting: Selecting,
    quality: Quality,
    clock: Clock,
    do: Do,
) -> None:
    """All sections, one below the other."""
    session = workspace.session
    handles = _about_handles(ui, workspace, state, do)
    bars, selection = _about_bars(ui, session, state), _about_selection(ui, workspace, state, selecting, do)
    # With another tool in hand it is below all else: what a push brings about in it moves nothing under the pointer.
    is_in_hand = state.tool_name == "handle" or bool(bars)
    in_hand = [*selection, *(handles if is_in_hand else []), *bars]
    with ui.panel("inspector", rect, (16, 4), imgui.WindowFlags_.none), imgui_ctx.begin_child("sections"):
        before, state.in_hand = state.in_hand, {name for name, *_ in in_hand}
        if state.in_hand - before:  # what has come on top is seen, wherever one has scrolled to
            imgui.set_scroll_y(0)
        for name, label, section, opened in (
            *in_hand,
            ("fluid", "Fluid", lambda: _fluid(ui, session, state), True),
            ("symmetry", "Symmetry", lambda: _symmetry(ui, state), False),
            ("view", "Overlays", lambda: _view(ui, state), True),
            ("quality", "Picture and quality", lambda: _quality(ui, workspace, quality), False),
            ("masks", "Masks and motion", lambda: _masks(ui, workspace, state, do), False),
            ("history", "History", lambda: _history(ui, workspace, state), True),
            ("numbers", "Statistics", lambda: _numbers(ui, session, state, clock, do), False),
            *([] if is_in_hand else handles),
        ):
            state.sections[name] = ui.section(label, state.sections.get(name, opened))
            if state.sections[name]:
                section()
                imgui.dummy(ImVec2(0, 0))
            ui.line()


def _about_handles(
    ui: Ui, workspace: Workspace, state: EditorState, do: Do
) -> list[tuple[str, str, Callable[[], None], bool]]:
    """The section about handles, where there is something to say."""
    session = workspace.session
    if state.tool_name != "handle" and not session.recipe.leads:
        return []
    return [("handles", "Handles and pins", lambda: _handles(ui, workspace, state, do), True)]


def _about_selection(
    ui: Ui, workspace: Workspace, state: EditorState, selecting: Selecting, do: Do
) -> list[tuple[str, str, Callable[[], None], bool]]:
    """The section about what is selected, with its tool in hand."""
    if state.tool_name != "select":
        return []
    return [("selection", "Selection", lambda: _selection(ui, workspace, state, selecting, do), True)]


def _about_bars(ui: Ui, session: Session, state: EditorState) -> list[tuple[str, str, Callable[[], None], bool]]:
    """The section about the bars that are selected in the timeline."""
    if not (state.lanes.shown and state.lanes.selected):
        return []
    return [("bar", "Selected in the timeline", lambda: selected_bar.draw(ui, session, state), True)]


def _selection(ui: Ui, workspace: Workspace, state: EditorState, selecting: Selecting, do: Do) -> None:
    ways = list(SELECT_BY)
    for first in (0, 3):
        row, now = ways[first : first + 3], ways.index(state.select_by)
        chosen = ui.segmented(f"select {first}", [way.capitalize() for way in row], now - first, -1)
        if chosen != now - first:
            state.select_by = row[chosen]
    if state.select_by in ("colour", "brightness"):
        slid = ui.slider(
            "tolerance", "Tolerance", state.tolerance, 0.01, 1.0, PERCENT, 0.2,
            title="Tolerance", more="How different from the clicked pixel it may be.",
        )  # fmt: skip
        connected = ui.check("Only what is connected", state.connected)
        if slid.changed or connected != state.connected:
            selecting.set_tolerance(slid.value, connected)
    ui.wrapped(
        f"{SELECT_BY[state.select_by]} Shift adds, Alt takes away, both intersect, Esc cancels.", ui.palette.dim, 13
    )
    part = "Less than 0.1%" if 0 < state.selected_part < 0.001 else f"{state.selected_part:.1%}"
    ui.dim(f"{part} of the picture is selected." if state.selection else "Nothing is selected.")
    with ui.enabled(bool(state.selection)):
        if ui.button("Invert the selection", width=-1, height=30):
            do("select_invert")
        ui.tooltip("Select the rest instead", ACTIONS["select_invert"].key)
    _which_mask(ui, state)
    words = ("Freeze", "Thaw") if state.mask == "frozen" else ("Fill", "Clear")
    width = (imgui.get_content_region_avail().x / ui.scale - 8) / 2
    with ui.enabled(bool(state.selection)):
        for number, (name, label) in enumerate(zip(("select_fill", "select_clear"), words, strict=True)):
            if number:
                imgui.same_line(0, ui.px(8))
            if ui.button(f"{label}##selection", width=width, height=30, primary=number == 0):
                do(name)
            ui.tooltip(f"{label} what is selected", ACTIONS[name].key)
    if state.mask == "thickness":
        _brightness(ui, workspace, state)


def _which_mask(ui: Ui, state: EditorState) -> None:
    """The mask that is edited, and what it is filled with."""
    names = list(MASKS)
    state.mask = names[ui.segmented("mask", ("Frozen", "Thickness"), names.index(state.mask), -1)]
    if state.mask == "thickness":
        slid = ui.slider(
            "mask amount", "Fill with", 10**state.mask_decades, 10**THINNEST, 10**THICKEST, TIMES, 100.0,
            logarithmic=True, title="What Fill fills with", more="How many times as thick as the fluid.",
        )  # fmt: skip
        state.mask_decades = round(log10(slid.value), 3)


def _handles(ui: Ui, workspace: Workspace, state: EditorState, do: Do) -> None:
    session = workspace.session
    pixels = picture_pixels(2 * max(workspace.canvas.size))
    label, recipe = state.selected, session.recipe
    if (led := dict(labelled(recipe.handle, recipe.pin)).get(label)) is None:
        ui.wrapped(
            "Drag a point of the picture to where it should go, or click to pin it. With Shift draw a line, which is "
            "dragged as one. Click one to select it. Or drop a file of pairs on the window: CSV, PTS or TPS.",
            ui.palette.dim,
            13,
        )
    else:
        ui.text(heading(label), size=14)
        imgui.same_line()
        words = whereabouts(workspace, label, led)
        if imgui.calc_text_size(words).x > imgui.get_content_region_avail().x:
            imgui.new_line()
        ui.dim(words)
        slid = ui.slider(
            "held radius", "Size", led.radius, state.smallest, 1.0, pixels, 0.15, logarithmic=True,
            title="How far across it reaches", more="It goes at most that far.",
        )  # fmt: skip
        _set_held(session, label, f"Size of a {led.kind}", slid, radius=slid.value)
        slid = ui.slider(
            "held stiffness", "Stiffness", led.stiffness, 0.01, 1.0, PERCENT, 1.0,
            title="Stiffness", more="With less it gives way to the fluid and to other handles.",
        )  # fmt: skip
        _set_held(session, label, f"Stiffness of a {led.kind}", slid, stiffness=slid.value)
        if isinstance(led, RecipeHandle):
            slid = ui.slider(
                "held local", "Local", led.local, 0.0, 1.0, PERCENT, 0.0,
                title="Local", more="At 0 % the picture flows back beside it. At 100 % only what is under it moves.",
            )  # fmt: skip
            _set_held(session, label, f"Flow of a {led.kind}", slid, local=slid.value)
            if led.goals:
                ui.wrapped("No Rotate or Scale: each place of this line has its own goal.", ui.palette.dim, 13)
            else:
                _turn(ui, session, label, led)
        if ui.button("Remove", width=-1, height=30):
            do("remove")
        ui.tooltip("Remove it and its effect", "delete", "Or click it with Alt.")
    away, unmet = sum(held.is_away for held in session.held), session.unmet
    rest = f", {len(unmet)} did not arrive" if unmet else f", {away} not there yet" if away else ""
    if recipe.leads:
        ui.dim(f"{len(recipe.handle) + len(recipe.pin)} in all{rest}")
    with ui.enabled(recipe.can_fit):
        if ui.button("Fit##handles", width=-1, height=30):
            do("fit_handles")
        more = "Finds a size and a speed for each, which may bring them nearer. May take a minute."
        ui.tooltip("Move all of them together, with the least work", ACTIONS["fit_handles"].key, more, above=True)
    if ui.button("Fit a mask to another ...", width=-1, height=30):
        do("fit_masks")
    ui.tooltip("Leads the outline of the white area of one picture to that of another", more="Makes handles along it.")
    for said in (*session.objections, *(each.said for each in unmet.values())):
        ui.wrapped(f"{heading(said)}.", ui.palette.text, 13)


def _turn(ui: Ui, session: Session, label: str, led: RecipeHandle) -> None:
    """How a handle is turned and scaled: from its start on, or, once it has keys, at the playhead."""
    tick, dt = session.target, session.dt
    _, rotate, scale = led.turn_key(tick, dt)
    is_early = led.is_turning_first(tick, dt)
    when = "A keyframe at the playhead." if led.turned and not is_early else "From its start on."
    slid = ui.slider(
        "held rotate", "Rotate", rotate, -180.0, 180.0, DEGREES, 0.0, title="Rotate", more=f"Clockwise. {when}"
    )
    _set_turn(session, label, led, f"Turn of a {led.kind}", slid, rotate=slid.value)
    slid = ui.slider("held scale", "Scale", scale, 0.25, 4.0, PERCENT, 1.0, logarithmic=True, title="Scale", more=when)
    _set_turn(session, label, led, f"Scale of a {led.kind}", slid, scale=slid.value)
    keyed = led.turned_to(tick, dt, rotate, scale)
    is_key = keyed.turned == led.turned
    if ui.button("Remove this keyframe" if is_key else "Add a keyframe here", width=-1, height=30):
        changed = led.without_turn_key(tick, dt) if is_key else keyed
        session.edit_held(f"Keyframe of a {led.kind}", label, keys=changed.keys, turned=changed.turned)
    more = "Rotate and Scale are kept until here; where you change them at another time, a keyframe is added."
    where = "where its first turn ends" if is_early else "at the playhead"
    ui.tooltip(f"A keyframe of Rotate and Scale {where}", more=more)


def _set_turn(session: Session, label: str, led: RecipeHandle, name: str, slid: Slid, **setting: float) -> None:
    """Set how far a handle is turned, or its size; what is set to the value that it has stays as it was.

    A handle that was never turned goes with the fluid, and one that is turned by 0 does not; nor is a keyframe added.
    """
    if slid.again:
        session.retract()
    if not (slid.changed or slid.done):
        return
    tick, dt, saved = session.target, session.dt, session.document.recipe
    before = dict(labelled(saved.handle, saved.pin)).get(label)
    led = before if isinstance(before, RecipeHandle) else led  # without what the slider has previewed
    _, rotate, scale = led.turn_key(tick, dt)
    turn = {"rotate": rotate, "scale": scale} | setting
    if turn != {"rotate": rotate, "scale": scale}:
        led = led.turned_to(tick, dt, **turn) if led.turned else led.model_copy(update=setting)
    session.edit_held(name, label, slid.done, rotate=led.rotate, scale=led.scale, turned=led.turned)


def whereabouts(workspace: Workspace, label: str, led: RecipeHandle | RecipePin) -> str:
    """How far the middle of the handle that is called so is led, and how far what is farthest of it has still to go, in
    pixels; or why it does nothing.
    """
    session, pixels = workspace.session, picture_pixels(max(workspace.canvas.size))
    for held in session.held:
        if held.label == label:
            way = hypot(*np.subtract(held.start, held.target) * session.extent)
            turns, bends = (led.turns, bool(led.goals)) if isinstance(led, RecipeHandle) else (False, False)
            at_most = "up to " * (turns or bends)
            rest = f", {at_most}{pixels.text(held.left)} left" if held.is_away else ""
            if way > ARRIVED or pixels.number(way) >= 0.5:
                return f"moves {pixels.text(way)}{rest}"
            return f"{'turned' if turns else 'bent' if bends else 'stays'}{rest}"
    return "muted" if led.muted else "not at work at this moment"


def _set_held(session: Session, label: str, name: str, slid: Slid, **setting: Any) -> None:
    if slid.again:
        session.retract()
    if slid.changed or slid.done:
        session.edit_held(name, label, slid.done, **setting)


def _fluid(ui: Ui, session: Session, state: EditorState) -> None:
    fluid = session.recipe.fluid_at(session.next_tick)
    now = feels.choose(ui, "feel", session, state, -1)
    ui.dim(f"{now.line}." if now else "Your own mixture.")
    viscosity = max(fluid.viscosity, 1e-5)
    slid = ui.slider(
        "viscosity", "Viscosity", viscosity, 1e-5, 10.0, THREE_DIGITS, DEFAULT.viscosity, logarithmic=True,
        title="Viscosity",
        more="How thick the fluid is. Thin fluids swirl on, thick ones move as one piece and stop at once.",
    )  # fmt: skip
    _set(session, "Viscosity", slid, viscosity=slid.value)
    slid = ui.slider(
        "drag", "Drag", fluid.drag, 0.0, 10.0, PER_SECOND, DEFAULT.drag,
        title="Drag", more="How fast all motion dies away. At 0 only viscosity brings it to rest.",
    )  # fmt: skip
    _set(session, "Drag", slid, drag=slid.value)
    slip = WALLS.index(fluid.walls)
    chosen = ui.segmented("walls", ("Edges glide", "Edges hold"), slip, -1)
    if chosen != slip:
        session.change("Edges of the fluid", walls=WALLS[chosen])
    ui.tooltip("At the picture's edges", more="The fluid glides along them, or sticks to them.")


def _set(session: Session, name: str, slid: Slid, **setting: float) -> None:
    """Set what a slider says: an edit once it is let go of."""
    if slid.again:
        session.retract()
    if slid.changed:
        session.preview_change(**setting)
    if slid.done:
        session.commit(name)


def _symmetry(ui: Ui, state: EditorState) -> None:
    names = list(SYMMETRIES)
    imgui.set_next_item_width(-1)
    _, chosen = imgui.combo("##symmetry", names.index(state.symmetry), list(SYMMETRIES.values()))
    state.symmetry = names[chosen]
    ui.tooltip(
        "A stroke acts on the other sides of the middle too", more="It is one stroke: Undo takes all of it back."
    )
    if state.symmetry == "radial":
        slid = ui.slider("sectors", "Sectors", state.sectors, 2, 16, default=6, title="How many times in all")
        state.sectors = round(slid.value)


def _view(ui: Ui, state: EditorState) -> None:
    with imgui_ctx.push_style_var(imgui.StyleVar_.item_spacing, ImVec2(ui.px(8), ui.px(4))):
        for overlay in state.overlays.values():
            overlay.shown = ui.check(f"{overlay.label}##overlay", overlay.shown, overlay.key)
            if overlay.shown:
                slid = ui.slider(f"opacity {overlay.name}", "Opacity", overlay.opacity, 0, 1, PERCENT, 0.7)
                overlay.opacity = slid.value


def _quality(ui: Ui, workspace: Workspace, quality: Quality) -> None:
    session = workspace.session
    width, height = workspace.canvas.size
    grid = session.recipe.fluid.grid
    ui.dim(f"{width} x {height} pixels, {session.project.picture.bits} bits")
    if (reduction := workspace.canvas.reduction) > 1:
        ui.dim(f"Shown at 1/{reduction} of that; an export has all.")
    automatic = quality.is_on
    # What saved work or a recipe is simulated on may be none of those that are offered.
    grids = sorted({*GRIDS, grid})
    labels = [f"Detail: automatic ({grid})" if automatic else "Detail: automatic"]
    labels += [f"Detail: {DETAILS[cells]} ({cells})" if cells in DETAILS else f"Detail: {cells}" for cells in grids]
    index = 0 if automatic else 1 + grids.index(grid)
    imgui.set_next_item_width(-1)
    changed, chosen = imgui.combo("##detail", index, labels)
    more = (
        "In brackets, cells along the picture's longer side. More are finer and slower; automatic is as many as this "
        "machine can paint on. What is seen is what is exported."
    )
    ui.tooltip("How finely the flow is simulated", more=more)
    if changed and chosen == 0:
        quality.turn_on()
    elif changed and chosen != index:
        session.set_grid(grids[chosen - 1], f"Grid of {grids[chosen - 1]}")
    if session.recipe.map is not None:
        ui.dim(f"Starts from the map {PurePath(session.recipe.map).name}")
        if ui.button("Start from the picture", width=-1, height=30):
            session.start_from_map(None)
    ui.dim("Beyond the edges of the picture")
    beyond = ("Its outermost pixels", "Mirrored", "Repeated", "Transparent", "Black")
    imgui.set_next_item_width(-1)
    changed, number = imgui.combo("##edges", EDGES.index(session.recipe.edges), list(beyond))
    if changed:
        session.edit("Edges of the picture", edges=EDGES[number])


def _masks(ui: Ui, workspace: Workspace, state: EditorState, do: Do) -> None:
    if state.tool_name != "select":
        _which_mask(ui, state)
        if state.mask == "thickness":
            _brightness(ui, workspace, state)
    for row in (("invert", "fill", "clear"), ("feather", "grow", "shrink"), ("load", "save")):
        if "grow" in row:
            slid = ui.slider(
                "mask reach", "By", state.mask_reach, 0.001, 0.25, picture_pixels(max(workspace.canvas.size)), 0.02,
                logarithmic=True, title="How far", more="How far Feather, Grow and Shrink move its edges.",
            )  # fmt: skip
            state.mask_reach = slid.value
        width = (imgui.get_content_region_avail().x / ui.scale - 8 * (len(row) - 1)) / len(row)
        for number, name in enumerate(row):
            if number:
                imgui.same_line(0, ui.px(8))
            label = name.capitalize() + (" ..." if name in ("load", "save") else "")
            if ui.button(f"{label}##mask", width=width, height=30):
                do(f"mask_{name}")
            ui.tooltip(ACTIONS[f"mask_{name}"].label, ACTIONS[f"mask_{name}"].key, ABOUT_MASKS.get(name, ""))
    session = workspace.session
    for name, label in (
        ("clear_masks", "Clear the masks"),
        ("clear_velocity", "Stop all motion"),
        ("reset_warp", "Reset the warp"),
    ):
        with ui.enabled(session.end > 0 or (name == "clear_masks" and session.has_begun)):
            if ui.button(label, width=-1, height=30):
                do(name)
    if ui.button("Copy as recipe", width=-1, height=30):
        do("copy_recipe")


def _brightness(ui: Ui, workspace: Workspace, state: EditorState) -> None:
    """Thickness from the picture's own brightness, as long as nothing but strokes has come over it."""
    session = workspace.session
    last = next((edit for edit in reversed(session.recipe.mask) if not isinstance(edit, MaskStroke)), None)
    own = last if last is not None and last.of == "thickness" and is_brightness(last) else None
    contrast, dark_is_thick = (own.white, own.invert) if own else (0.0, state.dark_is_thick)
    slid = ui.slider(
        "brightness", "By brightness", 10**contrast, 1.0, 10**THICKEST, TIMES, 1.0, logarithmic=True,
        title="Thickness from the picture's own brightness",
        more="How many times as thick the brightest is as the darkest, or the other way round.",
    )  # fmt: skip
    way = bool(ui.segmented("thick", ("Bright is thick", "Dark is thick"), int(dark_is_thick), -1))
    state.dark_is_thick, turned = way, own is not None and way != dark_is_thick
    if slid.again:
        session.retract()
    if slid.changed or turned:
        white, frame = round(log10(slid.value), 3), workspace.frames_after_first
        edit = PictureMask(kind="picture", tick=0, of="thickness", white=white, frame=frame, invert=way)
        session.edit_masks("Thickness by brightness", edit, commit=turned)
        state.show_mask()
    if slid.done:
        session.commit("Thickness by brightness")


def _history(ui: Ui, workspace: Workspace, state: EditorState) -> None:
    """What has been done, each with what it led to and how long the recording was by then."""
    session, thumbnails = workspace.session, workspace.canvas.thumbnails
    history, palette = session.document.history, ui.palette
    entries, present = history.entries, history.index
    # As much as is in sight without scrolling the inspector, the header of the section below included.
    room = imgui.get_content_region_avail().y - ui.px(60)
    most = max(4, int(room / ui.px(ROW)))
    height = min(len(entries), most) * ui.px(ROW) + ui.px(4)
    imgui.begin_child("entries", ImVec2(0, height))
    imgui.push_style_var(imgui.StyleVar_.item_spacing, ImVec2(0, 0))
    clipper = imgui.ListClipper()
    clipper.begin(len(entries), ui.px(ROW))
    chosen: int | None = None
    while clipper.step():
        for number in range(clipper.display_start, clipper.display_end):
            corner = imgui.get_cursor_screen_pos()
            size = ImVec2(imgui.get_content_region_avail().x, ui.px(ROW))
            if imgui.invisible_button(f"entry {number}", size):
                chosen = number
            entry = entries[number]
            if when := thumbnails.when(entry.number):
                ui.tooltip(entry.name, more=f"Done at {when:%H:%M}.")
            draw = imgui.get_window_draw_list()
            if imgui.is_item_hovered() or number == present:
                low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
                ground = palette.accent_soft if number == present else palette.hover
                draw.add_rect_filled(low, high, packed(ground), ui.px(5))
            ink = palette.text if number <= present else palette.faint
            if (texture := thumbnails.of(entry.number)) is not None:
                _thumbnail(ui, texture, corner)
            with imgui_ctx.push_font(ui.fonts.regular, 13.5):
                y = corner.y + (size.y - imgui.get_font_size()) / 2
                time = f"{entry.recipe.recorded * entry.recipe.fluid.dt:.1f} s"
                right = corner.x + size.x - ui.px(8) - imgui.calc_text_size(time).x
                draw.push_clip_rect(corner, ImVec2(right - ui.px(6), corner.y + size.y), True)
                draw.add_text(ImVec2(corner.x + ui.px(50), y), packed(ink), entry.name)
                draw.pop_clip_rect()
                draw.add_text(ImVec2(right, y), packed(palette.dim if number <= present else palette.faint), time)
    clipper.end()
    if state.history_seen != present:
        state.history_seen = present
        imgui.set_scroll_y(max(present * ui.px(ROW) - height / 2, 0))
    imgui.pop_style_var()
    imgui.end_child()
    if chosen is not None and chosen != present:
        session.go_to(chosen)


def _thumbnail(ui: Ui, texture: moderngl.Texture, corner: ImVec2) -> None:
    """A small picture at the left end of a row, as large as there is room for."""
    (width, height), room = texture.size, (ui.px(40), ui.px(ROW - 4))
    share = min(room[0] / width, room[1] / height)
    low = corner + ImVec2(ui.px(4) + (room[0] - width * share) / 2, ui.px(2) + (room[1] - height * share) / 2)
    high = low + ImVec2(width * share, height * share)
    picture = imgui.ImTextureRef(texture.glo)
    imgui.get_window_draw_list().add_image(picture, low, high, ImVec2(0, 1), ImVec2(1, 0))


def _numbers(ui: Ui, session: Session, state: EditorState, clock: Clock, do: Do) -> None:
    before = state.statistics
    after = ui.check("Show over the picture", before, "ctrl+i")
    if after != before:
        do("statistics")
    for name, value in clock.milliseconds.items():
        ui.dim(f"{name.capitalize()}: {value:.1f} ms")
    ui.dim(f"{session.device.limits.renderer.split('(')[0]}")

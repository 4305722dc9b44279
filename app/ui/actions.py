"""Everything a person can do, and by which key: one table for the keys, the menu, the tooltips and the sheet on F1."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from app.model.tools import TOOLS
from app.ui.commands import Commands
from app.ui.editor_state import overlays
from app.ui.keymap import Keyed

Do = Callable[[str], None]
"""Does the action of a name."""


@dataclass(frozen=True)
class Action(Keyed):
    """Something to do.

    Attributes:
        run: does it.
        repeats: doing it again while the key is held makes sense.
    """

    run: Callable[[Commands], object]
    repeats: bool = False


def _table() -> list[Action]:
    made: list[Action] = []

    def add(group: str, name: str, label: str, keys: str, run: Callable[[Commands], object], **more: object) -> None:
        made.append(Action(name, label, group, tuple(keys.split()), run, **more))  # pyright: ignore[reportArgumentType]

    add("File", "open", "Open ...", "ctrl+o", lambda c: c.files.ask_open())
    add("File", "open_frames", "Open numbered files ...", "", lambda c: c.files.ask_frames())
    add("File", "save", "Save", "ctrl+s", lambda c: c.files.save())
    add("File", "save_as", "Save as ...", "ctrl+shift+s", lambda c: c.files.ask_save())
    add("File", "apply_to", "Apply to another picture ...", "ctrl+shift+o", lambda c: c.files.ask_apply())
    add("File", "import_map", "Start from a warp map ...", "ctrl+shift+m", lambda c: c.files.ask_map())
    add("File", "export", "Export ...", "ctrl+e", lambda c: c.ask_export())
    add("File", "copy_recipe", "Copy as recipe", "ctrl+shift+c", lambda c: c.copy_recipe())
    add("File", "preferences", "Preferences ...", "ctrl+,", lambda c: c.ask_preferences())
    add("File", "quit", "Quit", "ctrl+q", lambda c: c.ask_quit())

    add("Edit", "undo", "Undo", "ctrl+z", lambda c: c.workspace.undo(), repeats=True)
    add("Edit", "redo", "Redo", "ctrl+shift+z ctrl+y", lambda c: c.workspace.redo(), repeats=True)
    for name, label, key in (("clear_velocity", "Stop all motion", "x"), ("reset_warp", "Reset the warp", "ctrl+r")):
        add("Edit", name, label, key, lambda c, n=name, label=label: c.workspace.change(label, **{n: True}))
    add("Edit", "copy_picture", "Copy the picture", "ctrl+c", lambda c: c.copy_picture())
    add("Edit", "paste", "Paste a picture", "ctrl+v", lambda c: c.files.paste())
    add("Edit", "clear_masks", "Clear the masks", "ctrl+d", lambda c: c.clear_masks())
    add("Edit", "remove", "Delete handle or bars", "delete backspace", lambda c: c.remove_selected())
    add("Edit", "fit_handles", "Fit the handles", "shift+g", lambda c: c.fits.start())
    add("Edit", "fit_masks", "Fit a mask to another ...", "", lambda c: c.files.ask_outlines())
    add("Edit", "cancel", "Cancel, deselect or stop a fit", "escape", lambda c: c.cancel())

    for tool in TOOLS:
        add("Tools", f"tool_{tool.name}", tool.label, tool.key, lambda c, n=tool.name: c.state.choose_tool(n, False))
        if tool.directions:
            label = tool.directions[1] if tool.name in ("bloat", "thicken", "freeze") else f"{tool.label}, reversed"
            keys = f"shift+{tool.key}" + (" d" if tool.name == "freeze" else "")
            add("Tools", f"tool_{tool.name}_back", label, keys, lambda c, n=tool.name: c.state.choose_tool(n, True))
    add("Tools", "select_next", "Select by another method", "shift+m", lambda c: c.state.select_next())
    add("Masks", "select_invert", "Invert the selection", "i", lambda c: c.selecting.invert())
    add("Masks", "invert", "Invert the selection or mask", "ctrl+shift+i", lambda c: c.invert())
    add("Masks", "select_fill", "Fill the selection", "enter", lambda c: c.selecting.fill(off=False))
    add("Masks", "select_clear", "Take the selection off the mask", "shift+enter", lambda c: c.selecting.fill(off=True))
    for kind, label, key in (
        ("invert", "Invert the mask", ""),
        ("fill", "Fill the mask", "ctrl+shift+f"),
        ("clear", "Clear the mask", ""),
        ("feather", "Feather the mask", ""),
        ("grow", "Grow the mask", ""),
        ("shrink", "Shrink the mask", ""),
    ):
        add("Masks", f"mask_{kind}", label, key, lambda c, kind=kind: c.edit_mask(kind))
    add("Masks", "mask_load", "Load a mask ...", "", lambda c: c.files.ask_mask(c.state))
    add("Masks", "mask_save", "Save the mask ...", "", lambda c: c.files.ask_save_mask(c.state.mask))
    add("Brush", "smaller", "Smaller", "[", lambda c: c.state.resize_brush(1 / 1.15), repeats=True)
    add("Brush", "larger", "Larger", "]", lambda c: c.state.resize_brush(1.15), repeats=True)
    add("Brush", "softer", "Softer", "{ shift+[", lambda c: c.state.harden_brush(-0.1), repeats=True)
    add("Brush", "harder", "Harder", "} shift+]", lambda c: c.state.harden_brush(0.1), repeats=True)
    add("Brush", "weaker", "Weaker", ";", lambda c: c.state.strengthen_brush(-0.1), repeats=True)
    add("Brush", "stronger", "Stronger", "'", lambda c: c.state.strengthen_brush(0.1), repeats=True)

    add("View", "zoom_in", "Zoom in", "ctrl+= = ctrl++ +", lambda c: c.pointer.zoom_step(True), repeats=True)
    add("View", "zoom_out", "Zoom out", "ctrl+- -", lambda c: c.pointer.zoom_step(False), repeats=True)
    add("View", "fit", "Fit", "ctrl+0 0", lambda c: c.zoom_fit())
    add("View", "actual", "100 %", "ctrl+1", lambda c: c.zoom_to(1.0))
    add("View", "split", "Compare side by side", "y", lambda c: c.state.toggle_split())
    add("View", "inspector", "Inspector", "tab", lambda c: c.toggle_inspector())
    add("View", "statistics", "Statistics", "ctrl+i", lambda c: c.toggle_statistics())
    add("View", "theme", "Dark or light", "ctrl+l", lambda c: c.preferences.toggle_theme())
    for name, overlay in overlays().items():
        add("View", f"overlay_{name}", overlay.label, overlay.key, lambda c, n=name: c.state.toggle_overlay(n))

    add("Time", "play", "Play or pause", "space", lambda c: c.workspace.session.play())
    add("Time", "step", "One step forward", ".", lambda c: c.workspace.session.step(), repeats=True)
    add("Time", "back", "One step back", ",", lambda c: c.step_back(), repeats=True)
    add("Time", "repeat", "Play once, in a loop, or as ping-pong", "", lambda c: c.repeat())
    add("Time", "start", "To the start", "home", lambda c: c.workspace.session.seek(0))
    add("Time", "end", "To the end", "end", lambda c: c.workspace.session.seek(c.workspace.session.length))

    add("Time", "lanes", "Strokes, forces and handles as bars", "l", lambda c: c.toggle_lanes())
    add("Time", "bars_earlier", "Bars a step earlier", "left", lambda c: c.nudge(-1), repeats=True)
    add("Time", "bars_later", "Bars a step later", "right", lambda c: c.nudge(1), repeats=True)
    add("Time", "bars_together", "Start together", "", lambda c: c.bars_together())
    add("Time", "bars_mute", "Mute the selected bars", "u", lambda c: c.mute_bars())

    add("Help", "shortcuts", "Keyboard shortcuts", "f1", lambda c: c.ask_shortcuts())
    return made


ACTIONS = {action.name: action for action in _table()}

"""Everything a person can do with a key: one table for the shortcuts, the menu, the tooltips and the sheet on F1."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from app.model.tools import TOOLS

if TYPE_CHECKING:
    from app.ui.editor import Editor


def _always(editor: Editor) -> bool:
    return True


@dataclass(frozen=True)
class Action:
    """Something to do.

    Attributes:
        name: by which the panels call it.
        label: as the person reads it.
        group: the heading it stands under.
        keys: chords that do it, the first of which is shown.
        run: does it.
        enabled: says whether it can be done now.
        repeats: doing it again while the key is held makes sense.
    """

    name: str
    label: str
    group: str
    keys: tuple[str, ...]
    run: Callable[[Editor], object]
    enabled: Callable[[Editor], bool] = _always
    repeats: bool = False

    @property
    def key(self) -> str:
        return self.keys[0] if self.keys else ""


def _table() -> list[Action]:
    made: list[Action] = []

    def add(group: str, name: str, label: str, keys: str, run: Callable[[Editor], object], **more: object) -> None:
        made.append(Action(name, label, group, tuple(keys.split()), run, **more))  # pyright: ignore[reportArgumentType]

    add("File", "open", "Open ...", "ctrl+o", lambda e: e.files.ask_open())
    add("File", "save", "Save", "ctrl+s", lambda e: e.files.save())
    add("File", "save_as", "Save as ...", "ctrl+shift+s", lambda e: e.files.ask_save())
    add("File", "apply_to", "Apply to another picture ...", "ctrl+shift+o", lambda e: e.files.ask_apply())
    add("File", "import_map", "Start from a warp map ...", "ctrl+shift+m", lambda e: e.files.ask_map())
    add("File", "export", "Export ...", "ctrl+e", lambda e: e.ask_export())
    add("File", "copy_recipe", "Copy as recipe", "ctrl+shift+c", lambda e: e.copy_recipe())
    add("File", "preferences", "Preferences ...", "ctrl+,", lambda e: e.ask_preferences())
    add("File", "quit", "Quit", "ctrl+q", lambda e: e.ask_quit())

    add("Edit", "undo", "Undo", "ctrl+z", lambda e: e.undo(), enabled=lambda e: e.can_undo, repeats=True)
    add("Edit", "redo", "Redo", "ctrl+shift+z ctrl+y", lambda e: e.redo(), enabled=lambda e: e.can_redo, repeats=True)
    add("Edit", "clear_velocity", "Stop all motion", "x", lambda e: e.change("Stop all motion", clear_velocity=True))
    add("Edit", "reset_warp", "Reset the warp", "ctrl+r", lambda e: e.change("Reset the warp", reset_warp=True))
    add("Edit", "clear_masks", "Clear the masks", "ctrl+d", lambda e: e.change("Clear the masks", clear_masks=True))
    add("Edit", "cancel", "Give up the stroke", "escape", lambda e: e.session.cancel())

    for tool in TOOLS:
        add("Tools", f"tool_{tool.name}", tool.label, tool.key, lambda e, name=tool.name: e.choose_tool(name, False))
        if tool.directions:
            label = tool.directions[1] if tool.name in ("bloat", "thicken", "freeze") else f"{tool.label}, reversed"
            keys = f"shift+{tool.key}" + (" d" if tool.name == "freeze" else "")
            add("Tools", f"tool_{tool.name}_back", label, keys, lambda e, n=tool.name: e.choose_tool(n, True))
    add("Brush", "smaller", "Smaller", "[", lambda e: e.resize_brush(1 / 1.15), repeats=True)
    add("Brush", "larger", "Larger", "]", lambda e: e.resize_brush(1.15), repeats=True)
    add("Brush", "softer", "Softer", "{ shift+[", lambda e: e.harden_brush(-0.1), repeats=True)
    add("Brush", "harder", "Harder", "} shift+]", lambda e: e.harden_brush(0.1), repeats=True)
    add("Brush", "weaker", "Weaker", ";", lambda e: e.strengthen_brush(-0.1), repeats=True)
    add("Brush", "stronger", "Stronger", "'", lambda e: e.strengthen_brush(0.1), repeats=True)

    add("View", "zoom_in", "Zoom in", "ctrl+= = ctrl++ +", lambda e: e.zoom_step(True), repeats=True)
    add("View", "zoom_out", "Zoom out", "ctrl+- -", lambda e: e.zoom_step(False), repeats=True)
    add("View", "fit", "Fit", "ctrl+0 0", lambda e: e.zoom_fit())
    add("View", "actual", "100 %", "ctrl+1", lambda e: e.zoom_to(1.0))
    add("View", "split", "Compare side by side", "y", lambda e: e.toggle_split())
    add("View", "inspector", "Inspector", "tab", lambda e: e.toggle_inspector())
    add("View", "statistics", "Statistics", "ctrl+i", lambda e: e.toggle_statistics())
    add("View", "theme", "Dark or light", "ctrl+l", lambda e: e.toggle_theme())
    for name in ("grid", "viscosity", "frozen", "velocity", "forces"):
        key = str(1 + ("grid", "viscosity", "frozen", "velocity", "forces").index(name))
        label = {"grid": "Warp grid"}.get(name, name.capitalize())
        add("View", f"overlay_{name}", label, key, lambda e, n=name: e.toggle_overlay(n))

    add("Time", "play", "Play or pause", "space", lambda e: e.session.play())
    add("Time", "step", "One step on", ".", lambda e: e.session.step(), repeats=True)
    add("Time", "back", "One step back", ",", lambda e: e.step_back(), repeats=True)
    add("Time", "start", "To the start", "home", lambda e: e.session.seek(0))
    add("Time", "end", "To the end", "end", lambda e: e.session.seek(e.session.end))

    add("Help", "shortcuts", "Keyboard shortcuts", "f1", lambda e: e.show_shortcuts())
    return made


ACTIONS = {action.name: action for action in _table()}
BY_KEY = {key: action for action in ACTIONS.values() for key in action.keys}

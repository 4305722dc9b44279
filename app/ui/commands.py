"""What a person can do that is more than a call of one of the window's parts; `actions.py` says by which key."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from imgui_bundle import imgui

from app.model.handles import labelled
from app.model.mask_edits import MASKS, ClearMask, mask_edit
from app.ui.chooser import FileChooser
from app.ui.dialogs import Dialogs, Preferring
from app.ui.editor_state import EditorState
from app.ui.export_dialog import ExportDialog, Exports, StillExporting
from app.ui.files import Files
from app.ui.fitting import Fits
from app.ui.key_sheet import KeySheet
from app.ui.keymap import Keymap
from app.ui.messages import Messages
from app.ui.pointer import PointerController
from app.ui.preferences import Preferences
from app.ui.selecting import Selecting
from app.ui.workspace import Workspace


@dataclass
class Commands:
    """The window's parts, and what takes several of them.

    Attributes:
        clipboard: puts a text on the clipboard; the window sets it.
        closed: the person has left.
    """

    workspace: Workspace
    state: EditorState
    pointer: PointerController
    files: Files
    chooser: FileChooser
    exports: Exports
    fits: Fits
    dialogs: Dialogs
    messages: Messages
    preferences: Preferences
    selecting: Selecting
    keys: Keymap
    clipboard: Callable[[str], None] = imgui.set_clipboard_text
    closed: bool = False

    def zoom_fit(self) -> None:
        self.workspace.view = self.workspace.view.fitted()

    def zoom_to(self, zoom: float) -> None:
        view = self.workspace.view
        self.workspace.view = view.zoomed(zoom, *view.canvas.middle)

    def step_back(self) -> None:
        self.workspace.session.seek(self.workspace.session.moment - 1)

    def repeat(self) -> None:
        """Play once, then in a loop, then there and back again but for a clip, then once."""
        session = self.workspace.session
        returns = session.recipe.time.ping_pong
        session.repeat(not session.loops and not returns, session.loops and not (returns or session.project.clip))

    @property
    def bars_selected(self) -> bool:
        """Bars of the timeline are selected, and seen."""
        lanes = self.state.lanes
        lanes.look(self.workspace.session)  # what was done in this frame may have taken them away
        return lanes.shown and bool(lanes.selected)

    def toggle_lanes(self) -> None:
        lanes = self.state.lanes
        lanes.shown = self.preferences.lanes = not lanes.shown
        lanes.selected, lanes.drag = set(), None
        self.preferences.save()

    def nudge(self, ticks: int) -> None:
        """Move the selected bars."""
        if self.bars_selected:
            self.state.lanes.nudge(self.workspace.session, ticks)

    def bars_together(self) -> None:
        """Let the selected bars begin with the first of them."""
        if self.bars_selected:
            self.state.lanes.together(self.workspace.session)

    def mute_bars(self) -> None:
        """Mute the selected bars, or let them act again."""
        if self.bars_selected:
            self.state.lanes.mute(self.workspace.session)

    def toggle_inspector(self) -> None:
        state = self.state
        if state.is_narrow:
            state.over_narrow = not state.over_narrow
            return
        state.inspector = self.preferences.inspector = not state.inspector
        self.preferences.save()

    def toggle_statistics(self) -> None:
        self.state.statistics = not self.state.statistics
        self.workspace.session.device.timings.enabled = self.state.statistics

    def remove_selected(self) -> None:
        """Take away the bars or the handle that are selected; what an area is selected for, off its mask."""
        if self.bars_selected:
            self.state.lanes.remove(self.workspace.session)
            return
        if self.state.tool_name == "select":
            self.selecting.fill(off=True)
            return
        session, selected = self.workspace.session, self.state.selected
        if selected in dict(labelled(session.recipe.handle, session.recipe.pin)):
            session.let_go(selected)
        self.state.selected = ""

    def cancel(self) -> None:
        """Give up what is being drawn or dragged, or what is selected; or stop the fit that is under way."""
        if self.workspace.session.is_painting:
            self.workspace.session.cancel()
            return
        lanes, selects = self.state.lanes, self.state.tool_name == "select"
        if not (lanes.shown and lanes.cancel()) and not (selects and self.selecting.cancel()):
            self.fits.finish()

    def clear_masks(self) -> None:
        """Take all paint off both masks."""
        if self.workspace.session.has_begun:
            edits = (ClearMask(kind="clear", tick=0, of=name) for name in MASKS)
            self.workspace.session.edit_masks("Clear the masks", *edits)

    def invert(self) -> None:
        """Invert the selection; where there is none, the mask."""
        if self.state.tool_name == "select" and self.state.selection:
            self.selecting.invert()
        else:
            self.edit_mask("invert")

    def edit_mask(self, kind: str) -> None:
        """Do something to the mask that is chosen, and show it."""
        state, edit = self.state, {"kind": kind, "tick": 0, "of": self.state.mask}
        if kind in ("feather", "grow", "shrink"):
            edit["radius"] = state.mask_reach
        if kind == "fill":
            edit["amount"] = 1.0 if state.mask == "frozen" else state.mask_decades
        self.workspace.session.edit_masks(f"{kind.capitalize()} {MASKS[state.mask]}", mask_edit(edit))
        state.show_mask()

    def copy_picture(self) -> None:
        """Put what is seen, in full size, on the clipboard."""
        session = self.workspace.session
        session.release()
        self.exports.copy(session)

    def copy_recipe(self) -> None:
        self.clipboard(self.workspace.session.recipe.text())
        self.messages.done("The recipe is on the clipboard, as TOML.")

    def ask_shortcuts(self) -> None:
        self.dialogs.show(KeySheet(self.keys))

    def ask_preferences(self) -> None:
        self.dialogs.show(Preferring(self.preferences, self.state))

    def ask_export(self) -> None:
        session = self.workspace.session
        session.release()
        if session.playing and not session.coasting:  # a picture is of the moment that was seen
            session.pause()
        self.dialogs.show(ExportDialog(session, self.exports, self.chooser, self.preferences))

    def ask_quit(self) -> None:
        """Leave, after having asked about what is not saved and what is being exported."""
        self.files.unless_unsaved("quit", self._quit_unless_exporting)

    @property
    def asks_before_quitting(self) -> bool:
        """Who leaves now is asked something first."""
        return self.workspace.is_dirty or self.workspace.session.is_painting or self.exports.is_running

    def _quit_unless_exporting(self) -> None:
        if self.exports.is_running:
            self.dialogs.ask(StillExporting(self.exports, self._quit))
        else:
            self._quit()

    def _quit(self) -> None:
        self.exports.cancel()
        self.closed = True

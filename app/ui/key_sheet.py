"""The sheet on F1: all keys and what they do, each of which can be changed there."""

from __future__ import annotations

from imgui_bundle import imgui, imgui_ctx
from imgui_bundle.imgui import ImVec2

from app.ui.dialogs import Dialog, beside
from app.ui.keymap import TAKEN, Keyed, Keymap
from app.ui.theme import packed
from app.ui.widgets import Ui, keys_shown

MOUSE = (
    ("Paint", "Drag"),
    ("The other direction", "Alt + drag"),
    ("Straight along an axis", "Shift + drag"),
    ("Straight from the last end", "Shift + click"),
    ("Brush size and hardness", "Right drag"),
    ("Pan", "Middle drag"),
    ("Pan with any tool", "Space + drag"),
    ("Zoom", "Wheel"),
    ("As it was, while held", "\\"),
    ("Back to default", "Double click"),
    ("Type a number", "Ctrl + click"),
)
COLUMNS = (("File", "Edit", "Time", "Masks"), ("Tools", "Brush"), ("View", "Help", "Mouse"))
ROW = 19.5  # points


class KeySheet(Dialog):
    """Shows all keys, and takes others for them."""

    width, height = 880, 720

    def __init__(self, keys: Keymap) -> None:
        super().__init__("Keyboard and mouse")
        self._keys = keys
        self._wanted: Keyed | None = None  # for which a key is to be pressed
        self._pressed = ""  # that was pressed for it, and does something else

    @property
    def is_listening(self) -> bool:
        return self._wanted is not None and not self._pressed

    def choose(self, action: Keyed) -> None:
        """Let the next key that is pressed be this action's."""
        self._wanted, self._pressed = action, ""

    def hear(self, chord: str) -> None:
        if self._wanted is None or self._pressed:
            return
        if chord == "escape":
            self._wanted = None
        elif chord in TAKEN or self._keys.action(chord) not in (None, self._wanted.name):
            self._pressed = chord
        else:
            self._keys.set(self._wanted.name, chord)
            self._wanted = None

    def body(self, ui: Ui) -> bool:
        groups: dict[str, list[Keyed]] = {}
        for action in self._keys.actions.values():
            groups.setdefault(action.group, []).append(action)
        with imgui_ctx.begin_child("keys", ImVec2(0, -ui.px(48))):
            across = min(max(int(imgui.get_content_region_avail().x / ui.px(230)), 1), len(COLUMNS))
            if imgui.begin_table("sheet", across, imgui.TableFlags_.sizing_stretch_same):
                imgui.table_next_row()
                for column in COLUMNS:
                    imgui.table_next_column()
                    for group in column:
                        self._group(ui, group, groups.get(group, []))
                imgui.end_table()
        imgui.dummy(ImVec2(0, 0))
        return self._foot(ui)

    def _foot(self, ui: Ui) -> bool:
        """What can be done, or what is the matter; False once the dialog is done with."""
        wanted = self._wanted
        if wanted is not None and self._pressed:
            other = self._keys.action(self._pressed)
            does = self._keys.actions[other].label if other else TAKEN[self._pressed]
            ui.text(f"{keys_shown(self._pressed)} is for “{does}”.", ui.palette.accent, 14)
            beside(ui, imgui.get_item_rect_size().x / ui.scale, 96 + (8 + 96 if other else 0))
            if ui.button("Cancel", width=96):
                self._wanted, self._pressed = None, ""
            if other:
                imgui.same_line()
                if ui.button("Take it", primary=True, width=96) or self.entered:
                    self._keys.set(wanted.name, self._pressed)
                    self._wanted, self._pressed = None, ""
            return True
        ui.dim(f"Press a key for “{wanted.label}”, or Esc." if wanted else "Click on a row to change its key.", 14)
        change = self._keys.are_changed and wanted is None
        beside(ui, imgui.get_item_rect_size().x / ui.scale, 96 + (8 + 128 if change else 0))
        if change:
            if ui.button("Reset all keys", width=128):
                self._keys.reset()
            imgui.same_line()
        return not (ui.button("Close", primary=True, width=96) or (self.entered and wanted is None))

    def _group(self, ui: Ui, name: str, actions: list[Keyed]) -> None:
        ui.text(name, ui.palette.accent, 13, bold=True)
        with imgui_ctx.push_style_var(imgui.StyleVar_.item_spacing, ImVec2(ui.px(8), 0)):
            for action in actions:
                if self._row(ui, action.label, keys_shown(self._keys.of(action.name)), action):
                    self.choose(action)
            if name == "Mouse":
                for label, keys in MOUSE:
                    self._row(ui, label, keys)
        imgui.dummy(ImVec2(0, ui.px(2)))

    def _row(self, ui: Ui, label: str, keys: str, action: Keyed | None = None) -> bool:
        """What is done, and the keys for it; True if it was clicked on."""
        corner, size = imgui.get_cursor_screen_pos(), ImVec2(imgui.get_content_region_avail().x, ui.px(ROW))
        lines, edge = imgui.get_window_draw_list(), ImVec2(ui.px(4), 0)
        clicked, lit = False, action is not None and action is self._wanted
        if action is None:
            imgui.dummy(size)
        else:
            clicked = imgui.invisible_button(action.name, size)
            lit |= imgui.is_item_hovered() or (imgui.is_item_focused() and imgui.get_io().nav_visible)
        if lit:
            lines.add_rect_filled(corner - edge, corner + size, packed(ui.palette.hover), ui.px(4))
        with imgui_ctx.push_font(ui.fonts.regular, 13.5):
            keys = "Press a key" if action is not None and action is self._wanted else keys
            width = imgui.calc_text_size(keys).x
            right, down = corner.x + size.x - ui.px(20), corner.y + ui.px(1.5)
            ink = ui.palette.accent if action is not None and action is self._wanted else ui.palette.dim
            lines.add_text(ImVec2(corner.x, down), packed(ui.palette.text), label)
            lines.add_text(ImVec2(right - width, down), packed(ink), keys)
        return clicked

"""What the editor remembers between frames, apart from the work itself."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, fields, replace

import numpy as np

from app.model.areas import Part
from app.model.mask_edits import MaskName
from app.model.presets import BRUSHES, FEELS, BrushPreset
from app.model.recipe import FluidSettings
from app.model.strokes import Symmetry
from app.model.tools import TOOL, BrushSettings, Tool
from app.ui.lanes import Lanes
from app.ui.preferences import Preferences

MASK_OF: dict[str, MaskName] = {"freeze": "frozen", "thicken": "thickness"}
SELECT_BY = {
    "rectangle": "Drag over what you want.",
    "ellipse": "Drag over what you want.",
    "lasso": "Draw around what you want.",
    "colour": "Click on a colour.",
    "brightness": "Click on something as bright or dark.",
    "subject": "Drag a rough box around it.",
}
"""By what is selected, and how."""
SMALLEST, LARGEST = 0.001, 0.5  # of a brush's radius, in longer sides: an eyelash of a photograph is a few pixels wide
LIMITS = {
    "radius": (SMALLEST, LARGEST), "hardness": (0.0, 1.0), "strength": (0.05, 1.0), "hold": (0.0, 1.0),
    "local": (0.0, 1.0), "stiffness": (0.01, 1.0),
}  # fmt: skip
"""From where to where a brush can be set."""


@dataclass
class Overlay:
    """Something that can be laid over the picture."""

    name: str
    label: str
    key: str
    shown: bool = False
    opacity: float = 0.7


def overlays() -> dict[str, Overlay]:
    """All of them, hidden, by name, in the order of their keys."""
    names = (
        ("grid", "Warp grid"),
        ("viscosity", "Viscosity"),
        ("frozen", "Frozen"),
        ("velocity", "Velocity"),
        ("forces", "Forces"),
    )
    return {name: Overlay(name, label, str(key)) for key, (name, label) in enumerate(names, 1)}


@dataclass
class EditorState:
    """What the tools, the panels and the keys set about the window.

    Attributes:
        tool_name: the tool in hand.
        tool_seen: the one that the strip was scrolled to last.
        brushes: of the tools for which something has been set, by their names.
        smallest: radius of the smallest brush, longer sides: less than a pixel of the picture across is not seen.
        suited: how local pushes have been made for the last fluid that was a feel.
        stabiliser: points of the screen, of the string that the pen pulls the brush by; 0 is none.
        preset_name: that has been typed for the brush, to keep it by.
        opposite: tools that are switched to their other direction.
        overlays: by name, in the order of their keys.
        is_narrow: the window has no room for the inspector beside the picture.
        inspector: the inspector is open, in a window that has room for it.
        over_narrow: it is open in one that has not.
        sections: which of its sections are open.
        in_hand: which of them are about what is in hand, and stand on top.
        history_seen: the entry of the history that was scrolled to last.
        mask: the one that the inspector edits; that of the tool that was chosen last.
        mask_reach: by how much it is feathered, grown and shrunk, longer sides.
        mask_decades: of thickness, with which it is filled.
        dark_is_thick: thickness that comes of the picture's brightness does so the other way round.
        select_by: one of `SELECT_BY`.
        tolerance: how unlike a colour or a brightness may be to be selected, of 1.
        connected: only what is connected with the place that was clicked on is.
        selection: what is selected, the first part and what is added to it and taken away.
        selected_area: the same as it is shown, (h, w) uint8, 255 in it; None where there is none.
        selected_part: how much of the picture that is, 0-1.
        selected: what messages call the handle or pin that the inspector is about; "" where there is none.
        lanes: the bars of the timeline.
        is_scaling: the amount of the warp is being dragged.
        symmetry, sectors: of the strokes that are painted.
        before: the picture is shown as it was, as long as a key is held.
        split: where the picture is divided into before and after, as a fraction of its width; None where it is not.
        statistics: numbers are shown over the canvas.
        auto_quality: the grid follows the machine.
    """

    tool_name: str = "push"
    tool_seen: str = ""
    brushes: dict[str, BrushSettings] = field(default_factory=dict)
    smallest: float = SMALLEST
    suited: float = BrushSettings.local
    stabiliser: float = 0.0
    preset_name: str = ""
    opposite: dict[str, bool] = field(default_factory=dict)
    overlays: dict[str, Overlay] = field(default_factory=overlays)
    is_narrow: bool = False
    inspector: bool = True
    over_narrow: bool = False
    sections: dict[str, bool] = field(default_factory=dict)
    in_hand: set[str] = field(default_factory=set)
    history_seen: int = -1
    mask: MaskName = "frozen"
    mask_reach: float = 0.02
    mask_decades: float = 2.0
    dark_is_thick: bool = False
    select_by: str = "rectangle"
    tolerance: float = 0.2
    connected: bool = True
    selection: tuple[Part, ...] = ()
    selected_area: np.ndarray | None = None
    selected_part: float = 0.0
    selected: str = ""
    lanes: Lanes = field(default_factory=Lanes)
    is_scaling: bool = False
    symmetry: Symmetry = "none"
    sectors: int = 6
    before: bool = False
    split: float | None = None
    statistics: bool = False
    auto_quality: bool = True

    @classmethod
    def recalled(cls, likes: Preferences) -> EditorState:
        """As it was left."""
        lanes = Lanes(shown=likes.lanes, height=likes.lanes_height)
        state = cls(
            inspector=likes.inspector, auto_quality=likes.auto_quality, stabiliser=likes.stabiliser, lanes=lanes
        )
        state.sections, state.suited = dict(likes.sections), likes.suited
        state.brushes = {name: _within(brush) for name, brush in likes.brushes.items() if name in TOOL}
        return state

    def remember(self, likes: Preferences) -> None:
        """Take note in the preferences of what `recalled` takes from them."""
        likes.stabiliser, likes.sections = self.stabiliser, dict(self.sections)
        likes.lanes_height, likes.suited = self.lanes.height, self.suited
        likes.brushes = {name: asdict(brush) for name, brush in self.brushes.items()}

    @property
    def tool(self) -> Tool:
        return TOOL[self.tool_name]

    @property
    def brush(self) -> BrushSettings:
        """That of the tool in hand: each has its own."""
        brush = self.brushes.get(self.tool_name, BrushSettings())
        return replace(brush, radius=max(brush.radius, self.smallest))

    @brush.setter
    def brush(self, brush: BrushSettings) -> None:
        self.brushes[self.tool_name] = brush

    def take_brush(self, preset: BrushPreset) -> None:
        """Set the tool's brush as a preset has it."""
        self._set_brush(radius=preset.radius, hardness=preset.hardness, strength=preset.strength)

    def make_local(self, local: float) -> None:
        """Let what pushes be so local, whichever tool it is done with, as is best for a feel of the fluid."""
        self.suited = local
        for name, tool in TOOL.items():
            if "local" in tool.settings:
                self.brushes[name] = replace(self.brushes.get(name, BrushSettings()), local=local)

    def suit(self, fluid: FluidSettings) -> None:
        """Let pushes be as local as is best for the fluid of a work that is opened.

        What a person has set stays if it is another part, or if the fluid is as that of the work before.
        """
        best = next((feel.local for feel in FEELS if feel.fits(fluid)), self.suited)
        before, self.suited = self.suited, best
        if best != before and {brush.local for brush in self.brushes.values()} <= {feel.local for feel in FEELS}:
            self.make_local(best)

    @property
    def is_opposite(self) -> bool:
        """The tool in hand is switched to its other direction."""
        return self.opposite.get(self.tool_name, False)

    def choose_tool(self, name: str, opposite: bool) -> None:
        self.tool_name = name
        if name in MASK_OF:
            self.mask = MASK_OF[name]
        if self.tool.masks:
            self.sections["masks"] = True
        if self.tool.directions:
            self.opposite[name] = opposite

    def fit_brushes(self, size: tuple[int, int]) -> None:
        """Let them be no smaller than is seen in a picture of (width, height) pixels."""
        self.smallest = max(SMALLEST, 0.5 / max(size))

    def resize_brush(self, factor: float) -> None:
        self._set_brush(radius=min(max(self.brush.radius * factor, self.smallest), LARGEST))

    def harden_brush(self, by: float) -> None:
        self._set_brush(hardness=round(min(max(self.brush.hardness + by, 0.0), 1.0), 3))

    def strengthen_brush(self, by: float) -> None:
        self._set_brush(strength=round(min(max(self.brush.strength + by, 0.05), 1.0), 3))

    def _set_brush(self, **settings: float) -> None:
        self.brush = replace(self.brush, **settings)

    def select_next(self) -> None:
        """Take the selecting tool in hand; if it is, select by the next of what can be selected by."""
        ways = list(SELECT_BY)
        if self.tool_name == "select":
            self.select_by = ways[(ways.index(self.select_by) + 1) % len(ways)]
        self.choose_tool("select", False)

    def edits_mask(self, name: MaskName, *tools: str) -> bool:
        """True if one of these tools is in hand, or selections are made for this mask: then it is shown."""
        return self.tool_name in tools or (self.tool_name == "select" and self.mask == name)

    @property
    def shows_frozen(self) -> bool:
        """What is frozen is laid over the picture."""
        return self.overlays["frozen"].shown or self.edits_mask("frozen", "freeze", "smooth")

    @property
    def shows_viscosity(self) -> bool:
        """It is laid over the picture."""
        return self.overlays["viscosity"].shown or self.edits_mask("thickness", "thicken", "smooth")

    def show_mask(self) -> None:
        """Let the mask that is edited be seen, if the tool in hand does not show it anyway."""
        if self.mask == "frozen" and not self.shows_frozen:
            self.overlays["frozen"].shown = True
        elif self.mask == "thickness" and not self.shows_viscosity:
            self.overlays["viscosity"].shown = True

    def toggle_split(self) -> None:
        self.split = 0.5 if self.split is None else None

    def toggle_overlay(self, name: str) -> None:
        self.overlays[name].shown = not self.overlays[name].shown


def _within(kept: dict[str, float]) -> BrushSettings:
    """A brush as it was kept, within its limits."""
    names = {part.name for part in fields(BrushSettings)} & kept.keys()
    return BrushSettings(**{name: min(max(kept[name], LIMITS[name][0]), LIMITS[name][1]) for name in names})


def presets(likes: Preferences) -> list[BrushPreset]:
    """Brushes that can be chosen: the person's own, and of those that come with fluidwarp the ones of other names."""
    own = [
        BrushPreset(name, brush.radius, brush.hardness, brush.strength)
        for name, brush in ((name, _within(kept)) for name, kept in likes.presets.items())
    ]
    return [*(preset for preset in BRUSHES if preset.name not in likes.presets), *own]

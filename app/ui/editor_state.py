"""What the window remembers between frames, apart from the work itself."""

from __future__ import annotations

from dataclasses import dataclass, field

from app.model.tools import TOOL, BrushSettings, Tool

SMALLEST, LARGEST = 0.005, 0.5  # of a brush's radius, in longer sides


@dataclass
class Overlay:
    """Something that can be laid over the picture."""

    name: str
    label: str
    key: str
    shown: bool = False
    opacity: float = 0.7


def _overlays() -> dict[str, Overlay]:
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
    """The window's own state.

    Attributes:
        tool_name: the tool in pointer.
        brush: shared by all tools, so that changing the tool does not change its size.
        opposite: tools that are switched to their other direction.
        overlays: by name, in the order of their keys.
        inspector: the inspector is open, in a window that has room for it.
        over_narrow: it is open in one that has not.
        sections: which of its sections are open.
        before: the picture is shown as it was, as long as a key is held.
        split: where the picture is divided into before and after, as a fraction of its width; None where it is not.
        statistics: numbers are shown over the canvas.
        auto_quality: the grid follows the machine.
    """

    tool_name: str = "push"
    brush: BrushSettings = field(default_factory=BrushSettings)
    opposite: dict[str, bool] = field(default_factory=dict)
    overlays: dict[str, Overlay] = field(default_factory=_overlays)
    inspector: bool = True
    over_narrow: bool = False
    sections: dict[str, bool] = field(default_factory=dict)
    before: bool = False
    split: float | None = None
    statistics: bool = False
    auto_quality: bool = True

    @property
    def tool(self) -> Tool:
        return TOOL[self.tool_name]

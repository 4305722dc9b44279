"""Named sets of parameters: feels of the fluid, so that a person need not know what viscosity is, and brushes."""

from __future__ import annotations

from dataclasses import dataclass

from app.model.recipe import FluidSettings


@dataclass(frozen=True)
class Feel:
    """A named fluid: viscosity in longer sides squared per second, drag per second, and what it feels like.

    Attributes:
        local: how local a push is where it is chosen; see `Stroke`.
    """

    name: str
    line: str
    viscosity: float
    drag: float
    local: float = 0.0

    def fits(self, fluid: FluidSettings) -> bool:
        return fluid.viscosity == self.viscosity and fluid.drag == self.drag


# Local, for faces: small pushes along a jaw leave bulges as large as they are where the fluid flows back beside them.
PUTTY = Feel("Putty", "Stops with the brush", 0.3, 0.0, local=1.0)
HONEY = Feel("Honey", "Sinks softly to rest", 0.03, 2.0)
# As thin as a single stroke of moderate length allows: thinner, its whirls wind up into layers thinner than a cell, and
# the map folds. There is no drag, which would end the wide, slow whirls as soon as the small ones, though they bend
# little: with 1 / s a push with the brush of .15 came to rest 1.7 s after it, without 3.5 s after it.
WATER = Feel("Water", "Swirls on by itself", 0.0065, 0.0)
FEELS = (PUTTY, HONEY, WATER)
"""From stiff to thin."""

DEFAULT = HONEY


@dataclass(frozen=True)
class BrushPreset:
    """A named brush: its radius in longer sides, hardness and strength 0-1; the rest of a brush stays as it is."""

    name: str
    radius: float
    hardness: float
    strength: float


BRUSHES = (
    BrushPreset("Wide and soft", 0.25, 0.0, 1.0),
    BrushPreset("Everyday", 0.15, 0.0, 1.0),
    BrushPreset("Gentle", 0.12, 0.0, 0.4),
    BrushPreset("Firm edge", 0.08, 1.0, 1.0),
    BrushPreset("Detail", 0.03, 0.3, 0.7),
)
"""Those that come with fluidwarp, from large to small."""

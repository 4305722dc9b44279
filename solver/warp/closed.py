"""A closed map: an accumulated map kept as it was while a new one goes on over it, or what is undone of such."""

from __future__ import annotations

from typing import NamedTuple

from solver.gl.passes import Region
from solver.gl.tiled import TiledField
from solver.warp.state import UNDONE_COMPONENTS, Images


class ClosedMap(NamedTuple):
    """A map that was closed, or what is undone of those before it.

    Attributes:
        field: the displacement, longer sides, and of what is undone the part in the third component.
        region: the texels of the accumulated map that it covers. Beyond these it is nothing.
        images: what lies beyond the picture's edges, as of the accumulated map.
    """

    field: TiledField
    region: Region
    images: Images

    @property
    def is_undone(self) -> bool:
        """True if it is what is undone."""
        return self.field.components == UNDONE_COMPONENTS

    @property
    def box(self) -> tuple[float, float, float, float]:
        """`u_box` of `lib/warp.glsl`: its corner in texels of the accumulated map, and its own texels for each."""
        x, y, width, height = self.region
        return x, y, self.field.width / width, self.field.height / height

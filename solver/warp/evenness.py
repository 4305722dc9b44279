"""Evenness of a map: how well the cubics of neighbouring cells agree on det J."""

from __future__ import annotations

from typing import Any

from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.passes import Region
from solver.gl.reduction import SIDE, Reduction, blocks_of
from solver.warp.state import Images

FLAT = 1.0  # |grad D| up to which a cubic carries a map well, whatever its texels; see `STEEPEST` of submaps


class Evenness:
    """How far the cells around each texel of a map agree on det J there, each by its own cubic.

    Args:
        device: the device.
        size: (width, height) of the map.
        steepness: of the map, block by block, as `Steepness` draws it.
    """

    def __init__(self, device: Device, size: tuple[int, int], steepness: Field) -> None:
        self.device = device
        self._steepness = steepness
        self._largest = device.field(blocks_of(size), 1, "evenness")
        self._find_largest = Reduction(device, self._largest.size, 1, "max")

    def of(
        self,
        displacement: Field,
        spacing: tuple[float, float],
        images: Images,
        regions: list[Region],
        held: Field | None,
    ) -> float:
        """The least part that one cell's det J is of another's, in the steep blocks of regions; waits for the GPU.

        Args:
            displacement: of the map; its texels are `spacing` apart.
            images: beyond its edges.
            regions: which begin with whole blocks.
            held: where it is held, see `Frozen`; next to that, and there, nothing is looked at.
        """
        self._largest.clear(-1.0)
        defines: dict[str, object] = {} if held is None else {"HELD": 1}
        given: dict[str, Any] = {} if held is None else {"held": held}
        blocks = [(x // SIDE, y // SIDE, *blocks_of((width, height))) for x, y, width, height in regions]
        look = self.device.pass_("warp/evenness.frag", **defines)
        look(
            self._largest,
            region=blocks,
            displacement=displacement,
            steepness=self._steepness,
            spacing=spacing,
            images=images,
            side=SIDE,
            flat=FLAT,
            **given,
        )
        return -float(self._find_largest(self._largest)[0])

    def release(self) -> None:
        """Free the textures."""
        for item in (self._largest, self._find_largest):
            item.release()

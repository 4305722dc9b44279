"""How steep a field is, as one number."""

from __future__ import annotations

from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.passes import Region
from solver.gl.reduction import SIDE, Reduction, blocks_of


class Steepness:
    """The largest |grad D|^2 of fields D of one size, or what else `warp/steepness.frag` finds of grad D.

    Args:
        device: the device.
        size: (width, height) of the fields.
        name: of what is looked at.
        defines: of the shader.

    Attributes:
        blocks: what was found, one for each block of the corners between the texels.
    """

    def __init__(self, device: Device, size: tuple[int, int], name: str, **defines: object) -> None:
        self.device = device
        self._defines = defines
        blocks = blocks_of((size[0] - 1, size[1] - 1))
        self.blocks = device.field(blocks, 1, f"{name}, steepness")
        self._find_largest = Reduction(device, blocks, 1, "max")

    def of(self, field: Field, spacing: tuple[float, float]) -> float:
        """That of a field whose texels are `spacing` apart; waits for the GPU."""
        self.look(field, spacing)
        return self.found()

    def look(self, field: Field, spacing: tuple[float, float], regions: list[Region] | None = None) -> None:
        """Look at `regions` of a field, which begin with whole blocks, or at all of it."""
        if regions is not None:
            regions = [(x // SIDE, y // SIDE, *blocks_of((width, height))) for x, y, width, height in regions]
        find = self.device.pass_("warp/steepness.frag", **self._defines)
        find(self.blocks, region=regions, displacement=field, spacing=spacing, side=SIDE)

    def found(self) -> float:
        """The largest of all that was looked at since `forget`; waits for the GPU."""
        return float(self._find_largest(self.blocks)[0])

    def forget(self) -> None:
        """Forget what was looked at."""
        self.blocks.clear()

    def release(self) -> None:
        """Free the textures."""
        for item in (self.blocks, self._find_largest):
            item.release()

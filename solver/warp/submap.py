"""The submap: what has moved lately, on the fluid's grid."""

from __future__ import annotations

from dataclasses import dataclass, replace
from dataclasses import field as member
from operator import mul
from typing import Any

from solver.gl.device import Device
from solver.gl.field import DoubleField, Field
from solver.grid import Grid
from solver.params import Walls
from solver.steepness import Steepness
from solver.trace import Tracing
from solver.warp.frozen import FADED
from solver.warp.state import GLIDING, OPEN, Images

STEEPEST = 1.0  # largest |grad S| that the cubic carries well, by which a step reads it
NAMES = "", "second_", "third_"  # of levels, in shaders


class Differences:
    """What a displacement is read from between its cells, drawn when it is asked for; see `warp/difference.frag`."""

    def __init__(self) -> None:
        self._drawn: Field | None = None
        self._images: Images | None = None  # that it was drawn with; None if it is not drawn

    def of(self, device: Device, displacement: Field, images: Images) -> Field:
        """Of a displacement that is the same as last time, unless `forget` was called."""
        width, height = size = differences_of(displacement.size)
        if self._drawn is None:
            self._drawn = Field(device, size, 4, "differences", cleared=False)
        if self._images != images:
            half = height // 2
            for y in (0, half):
                draw = device.pass_("warp/difference.frag", **({"BENDS": 1} if y else {}))
                draw(self._drawn, region=(0, y, width, half), displacement=displacement, images=images)
            self._images = images
        return self._drawn

    def forget(self) -> None:
        """Hear that the displacement has changed."""
        self._images = None

    def release(self) -> None:
        """Free the texture."""
        if self._drawn is not None:
            self._drawn.release()
        self._drawn = self._images = None


class Submap(DoubleField):
    """A displacement S on the cells of a grid, RG32F, longer sides; outside the grid's window nothing moves.

    Args:
        device: the device.
        grid: the cells.

    Attributes:
        trace: how far back the fluid came from, in cells, for a caller without a trace of its own.
        images: what lies beyond its sides, as of what has moved it since it was empty.
    """

    def __init__(self, device: Device, grid: Grid) -> None:
        super().__init__(device, grid.size, 2, "submap")
        self.device = device
        self.grid = grid
        self.trace = device.field(grid.size, 2, "submap, trace")
        self.images = GLIDING
        self._differences = Differences()
        self._steepness = Steepness(device, grid.size, "submap")

    def advance(self, trace: Field | Tracing, is_walled: bool) -> None:
        """Carry it one step, given how far back the fluid came from, in cells at their centres; or draw that too."""
        target, inputs, defines = [self.write], dict[str, Any](trace=trace), dict[str, Any]()
        if isinstance(trace, Tracing):
            target, inputs, defines = [self.write, trace.target], trace.inputs, {"TRACE": 1, **trace.defines}
        inner = tuple(0.0 if at_edge else 1.0 for at_edge in self.grid.at_edge)
        if any(inner):
            inputs, defines = {**inputs, "inner": inner}, {**defines, "INNER": 1}
        advance = self.device.pass_("warp/advance.frag", **defines)
        inputs["images"] = self.images if is_walled else OPEN
        advance(target, displacement=self.read, spacing=self.grid.spacing, **inputs)
        self.swap()

    def level(self, is_weighed: bool) -> Level:
        """What has moved, valid until it changes."""
        return Level(self.read, self.grid, is_weighed, self.images, self._differences)

    def replace(self) -> None:
        """Hand over what has moved, as `level` had it; it begins anew with nothing."""
        self.read, self._differences = self.device.field(self.grid.size, 2, "submap"), Differences()

    def changed(self) -> None:
        """Hear that `read` was drawn into."""
        self._differences.forget()

    def swap(self) -> None:
        super().swap()
        self.changed()

    @property
    def is_steep(self) -> bool:
        """True if it is bent too far for its interpolation; waits for the GPU."""
        return self._steepness.of(self.read, self.grid.spacing) > STEEPEST**2

    def release(self) -> None:
        super().release()
        for part in (self.trace, self._steepness, self._differences):
            part.release()


@dataclass(frozen=True)
class Level:
    """A submap and the grid it moved on: with a texel, or a whole number both ways, for each of its cells.

    Attributes:
        is_weighed: it moves less and less before what is held; see `lib/warp.glsl`.
        images: of the submap.
        differences: what it is read from.
    """

    field: Field
    grid: Grid
    is_weighed: bool = False
    images: Images = GLIDING
    differences: Differences = member(default_factory=Differences)

    @property
    def images_at_edges(self) -> Images:
        """What it says of what lies beyond the picture's edges: 0 of those that it does not reach."""
        left, right, top, bottom = map(mul, self.images, self.grid.at_edge)
        return left, right, top, bottom

    def release(self) -> None:
        """Free the textures."""
        for thing in (self.field, self.differences):
            thing.release()


def differences_of(size: tuple[int, int]) -> tuple[int, int]:
    """The size of `Differences` of a displacement of a size: two halves, each within a border of a cell."""
    return size[0] + 2, 2 * (size[1] + 2)


def window_of(grid: Grid) -> tuple[float, float, float, float]:
    """Left, top, width and height of what a grid covers, longer sides."""
    return *grid.origin, *grid.extent


def images_of(walls: Walls, grid: Grid) -> Images:
    """What lies beyond the sides of what a fluid moves between walls.

    What sticks to a wall at rest is odd there, as the velocity is; a wall that moves carries it along. Beyond a side
    that is not the picture's edge nothing moves.
    """
    sides = zip(walls.images, walls.speed, grid.at_edge, strict=True)
    left, right, top, bottom = (-1.0 if not at_edge else 1.0 if speed else image for image, speed, at_edge in sides)
    return left, right, top, bottom


def defines_of(levels: list[Level]) -> dict[str, object]:
    """The defines of `lib/warp.glsl` for levels, the uppermost first."""
    weighed = sum(1 << k for k, level in enumerate(levels) if level.is_weighed)
    counts = {"LEVELS": len(levels) if len(levels) > 1 else 0, "WEIGHED": weighed, "FADED": FADED if weighed else 0}
    return {name: count for name, count in counts.items() if count}


def away_from_held(levels: list[Level]) -> list[Level]:
    """Levels as they are where nothing is held: there the uppermost moves in full; those below it look elsewhere."""
    return [replace(levels[0], is_weighed=False), *levels[1:]]


def inputs_of(device: Device, levels: list[Level], edges: Images, held: dict[str, Any]) -> dict[str, Any]:
    """Levels, the uppermost first, between the edges of a map, and what is held as `lib/warp.glsl` has them."""
    parts = dict(held)
    for name, level in zip(NAMES, levels, strict=False):
        there = name.removesuffix("_") or "submap"
        left, right, top, bottom = (abs(edge) * image for edge, image in zip(edges, level.images, strict=True))
        images = left, right, top, bottom
        parts[there] = level.differences.of(device, level.field, images)
        parts |= {f"{name}window": window_of(level.grid), f"{name}images": images}
    return parts

"""Brushes: what a stroke does to the fluid in one tick, drawn over the part of the grid it touches."""

from __future__ import annotations

import math
from dataclasses import dataclass

from solver.context import Device
from solver.fluid import Fluid
from solver.grid import Grid
from solver.passes import Region

Point = tuple[float, float]


@dataclass(frozen=True)
class Tip:
    """A brush tip on its way from `start` to `end` within one tick.

    Attributes:
        start, end: places, in lengths (the longer side of the picture is 1), y down.
        radius: in lengths.
        hardness: 0 is a soft falloff, 1 a core of nine tenths of the radius.
    """

    start: Point
    end: Point
    radius: float
    hardness: float = 0.0

    def inputs(self, grid: Grid) -> dict[str, object]:
        """The uniforms of `lib/brush.glsl`."""
        return {
            "segment": (*self.start, *self.end),
            "radius": self.radius,
            "hardness": min(max(self.hardness, 0.0), 1.0),
            "h": grid.h,
        }

    def region(self, grid: Grid) -> Region:
        """The cells it touches, with one to spare."""
        low = [math.floor((min(a, b) - self.radius) / grid.h) - 1 for a, b in zip(self.start, self.end, strict=True)]
        high = [math.ceil((max(a, b) + self.radius) / grid.h) + 2 for a, b in zip(self.start, self.end, strict=True)]
        return low[0], low[1], high[0] - low[0], high[1] - low[1]


class Brush:
    """Draws tips into a fluid.

    Push and twirl are closed loops: they add what the fluid lacks of the wanted motion at the brush, so that the
    picture follows the pointer at its own speed however thick the fluid is, and a resting brush holds it still.
    """

    def __init__(self, device: Device) -> None:
        self.device = device
        self._motion = device.field((1, 1), 4, "motion at the brush")

    def push(self, fluid: Fluid, tip: Tip, dt: float, strength: float = 1.0) -> None:
        """Carry the fluid under the tip along; strength 1 moves it at the tip's own speed, negative against it."""
        velocity = ((tip.end[0] - tip.start[0]) / dt, (tip.end[1] - tip.start[1]) / dt)
        if strength < 0:
            velocity, strength = (-velocity[0], -velocity[1]), -strength
        self._probe(fluid, tip)
        self._draw(fluid, "brush/push.frag", tip, brush_velocity=velocity, strength=strength)

    def twirl(self, fluid: Fluid, tip: Tip, rate: float) -> None:
        """Turn the fluid under the tip at `rate` rad/s, positive clockwise."""
        self._probe(fluid, tip)
        self._draw(fluid, "brush/twirl.frag", tip, rate=rate)

    def expand(self, fluid: Fluid, tip: Tip, rate: float) -> None:
        """Let the area under the tip grow (or, negative, shrink) at `rate` 1/s in the next projection."""
        self.device.pass_("brush/expand.frag")(
            fluid.source, add=True, region=tip.region(fluid.grid), rate=rate, **tip.inputs(fluid.grid)
        )
        fluid.source_drawn()

    def release(self) -> None:
        self._motion.release()

    def _probe(self, fluid: Fluid, tip: Tip) -> None:
        h = fluid.grid.h
        at = (tip.end[0] / h, tip.end[1] / h)
        reach = max(0.25 * tip.radius / h, 0.5)
        self.device.pass_("brush/probe.frag")(self._motion, velocity=fluid.faces(), at=at, reach=reach, h=h)

    def _draw(self, fluid: Fluid, shader: str, tip: Tip, **inputs: object) -> None:
        region = tip.region(fluid.grid)
        inputs |= tip.inputs(fluid.grid)
        paint = self.device.pass_(shader)
        fluid.add_impulse(lambda faces: paint(faces, add=True, region=region, motion=self._motion, **inputs))

"""Brushes: what a stroke does to the fluid in one tick, drawn over the part of the grid it touches."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from solver.fluid import Fluid
from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.passes import Region
from solver.grid import Grid
from solver.warp.map import WarpMap

Point = tuple[float, float]

# Of the lattice on which a push looks at the map: texels along the brush's radius, and along the lattice, which reaches
# one beyond the brush on either side.
FINE = 8
AROUND = 2 * (FINE + 1) + 1

# Of a brush's hardness, for a push: all that the core of its stream function moves has to flow back beside it, and with
# little room left there it would do so many times faster than the brush moves. With .3 a stroke of Putty folds there.
HARDEST_PUSH = 0.15


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

    def inputs(self, grid: Grid) -> dict[str, Any]:
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


@dataclass(frozen=True)
class Push:
    """Carry the fluid under the tip along in `dt`; strength 1 moves it at the tip's own speed, negative against it.

    `grip` is the part of its own speed that the tip gives to the fluid, however long it leads it; `patience` the part
    of the strain that a push may put on the picture at which it slips.
    """

    tip: Tip
    dt: float
    strength: float = 1.0
    grip: float = 1.0
    patience: float = 1.0

    @property
    def shader(self) -> str:
        return "brush/push.frag"

    @property
    def velocity(self) -> Point:
        """What it gives to the fluid: against the drag at the whole speed, and no stronger than along it."""
        (x0, y0), (x1, y1) = self.tip.start, self.tip.end
        speed = (self.grip if self.strength > 0 else -self.grip) / self.dt
        return (x1 - x0) * speed, (y1 - y0) * speed

    def inputs(self, grip: Field) -> dict[str, Any]:
        return {
            "brush_velocity": self.velocity,
            "strength": abs(self.strength),
            "hardness": HARDEST_PUSH * min(max(self.tip.hardness, 0.0), 1.0),
            "grip": grip,
        }


@dataclass(frozen=True)
class Twirl:
    """Turn the fluid under the tip at `rate` rad/s, positive clockwise."""

    tip: Tip
    rate: float

    @property
    def shader(self) -> str:
        return "brush/twirl.frag"

    def inputs(self, grip: Field) -> dict[str, Any]:
        return {"rate": self.rate}


class Brush:
    """Draws tips into a fluid.

    Push and twirl are closed loops: they add what the fluid lacks of the wanted motion at the brush, so that the
    picture follows the pointer at its own speed however thick the fluid is, and a resting brush holds it still.
    """

    def __init__(self, device: Device) -> None:
        self.device = device
        self._motion = device.field((1, 1), 4, "motion at the brush")
        self._around = device.field((AROUND, AROUND), 2, "displacement around the brush")
        self._leeway = device.field((1, 1), 1, "leeway of the brush")
        self._grip = device.field((1, 1), 1, "grip of the brush")
        self._gripping: Push | None = None

    def lead(
        self,
        fluid: Fluid,
        motion: Push | Twirl,
        headway: float = 1.0,
        yielding: bool = False,
        warp: WarpMap | None = None,
    ) -> None:
        """Add what the fluid lacks of a motion, `headway` times.

        With `warp`, the picture's map, a push lets slip what has come a long way with it already, and what it would
        stretch too far.
        With `yielding` it spares what is thicker than the fluid at the tip, and does less the more of the brush lies on
        what is thicker or frozen: for the last touch before the projection, which viscosity does not spread any more.
        """
        h, tip = fluid.grid.h, motion.tip
        at = (tip.end[0] / h, tip.end[1] / h)
        reach = max(0.25 * tip.radius / h, 0.5)
        probe = self.device.pass_("brush/probe.frag")
        probe(self._motion, velocity=fluid.faces(), impulse=fluid.impulse, viscosity=fluid.viscosity,
              at=at, reach=reach, h=h)  # fmt: skip
        # The map does not change before the last touch of the same push.
        if isinstance(motion, Push) and motion is not self._gripping:
            self._find_grip(motion, warp)
            self._gripping = motion
        region = tip.region(fluid.grid)
        inputs = tip.inputs(fluid.grid) | motion.inputs(self._grip) | {"motion": self._motion, "headway": headway}
        masks = {}
        if yielding:
            masks = {"viscosity": fluid.viscosity, "leeway": self._leeway}
            leeway = self.device.pass_("brush/leeway.frag")
            leeway(
                self._leeway,
                motion=self._motion,
                viscosity=fluid.viscosity,
                solid=fluid.solid,
                **tip.inputs(fluid.grid),
            )
        paint = self.device.pass_(motion.shader, **({"YIELDING": 1} if yielding else {}))
        fluid.add_impulse(lambda faces: paint(faces, add=True, region=region, **masks, **inputs))

    def _find_grip(self, push: Push, warp: WarpMap | None) -> None:
        """How firmly a push holds what it has carried and stretched already; without a map, as firmly as it can."""
        if warp is None:
            self._grip.clear(1.0)
            return
        width, height = warp.extent
        x, y = (min(max(at, 0.0), far) for at, far in zip(push.tip.start, warp.extent, strict=True))
        step = push.tip.radius / FINE
        warp.probe(self._around, (x / width, y / height), (step / width, step / height))
        self.device.pass_("brush/grip.frag")(
            self._grip,
            around=self._around,
            brush_velocity=push.velocity,
            radius=push.tip.radius,
            patience=push.patience,
            place=(x, y),
            extent=warp.extent,
        )

    def push(self, fluid: Fluid, tip: Tip, dt: float, strength: float = 1.0) -> None:
        """Carry the fluid under the tip along; see `Push`."""
        self.lead(fluid, Push(tip, dt, strength))

    def twirl(self, fluid: Fluid, tip: Tip, rate: float) -> None:
        """Turn the fluid under the tip; see `Twirl`."""
        self.lead(fluid, Twirl(tip, rate))

    def expand(self, fluid: Fluid, tip: Tip, rate: float) -> None:
        """Let the area under the tip grow (or, negative, shrink) at `rate` 1/s in the next projection."""
        self.device.pass_("brush/expand.frag")(
            fluid.source, add=True, region=tip.region(fluid.grid), rate=rate, **tip.inputs(fluid.grid)
        )
        fluid.source_drawn()

    def release(self) -> None:
        self._motion.release()
        self._around.release()
        self._grip.release()
        self._leeway.release()

"""Brushes of motion: what a stroke does to the fluid in one tick, drawn over the part of the grid it touches."""

from __future__ import annotations

from typing import Any

from solver.brush.push import Push, Slip
from solver.brush.tip import Tip
from solver.brush.twirl import Twirl
from solver.gl.device import Device
from solver.gl.field import Field
from solver.scheme import Scheme, check_finite
from solver.warp.map import WarpMap

Motion = Push | Twirl


class Brush:
    """Draws tips into a fluid.

    Push and twirl are closed loops: they add what the fluid lacks of the wanted motion at the brush, so that the
    picture follows the pointer at its own speed however thick the fluid is, and a resting brush holds it still.
    """

    def __init__(self, device: Device) -> None:
        self.device = device
        self._motion = device.field((1, 1), 4, "motion at the brush")
        self._obstruction = device.field((1, 1), 1, "obstruction factor")
        self._slip = Slip(device)

    def lead(self, fluid: Scheme, motion: Motion, gain: float = 1.0, warp: WarpMap | None = None) -> None:
        """Add to the fluid's next step what it lacks of a motion, `gain` times (see `gain_compensation`).

        With `warp`, the picture's map, a push lets slip what has come a long way with it already, and what it would
        stretch too far.
        """
        check_finite("a gain", gain)
        self._look(fluid, motion, fluid.faces(), warp)
        fluid.impulse.add(lambda faces: self._draw(fluid, motion, faces, gain))

    def make_up(self, fluid: Scheme, motion: Motion, velocity: Field, warp: WarpMap | None = None) -> None:
        """Add to a velocity on MAC faces what it lacks of a motion: the last touch before the projection.

        Viscosity does not spread that any more. So it spares what is thicker than the fluid at the tip, and does less
        the more of the brush lies on what is thicker or frozen. For `steer` of `Scheme.step`.
        """
        self._look(fluid, motion, velocity, warp)
        obstruct, tip = self.device.pass_("brush/obstruct.frag"), motion.tip.inputs(fluid.grid)
        obstruct(self._obstruction, motion=self._motion, viscosity=fluid.viscosity, solid=fluid.solid, **tip)
        attenuation = {"viscosity": fluid.viscosity, "obstruction": self._obstruction}
        self._draw(fluid, motion, velocity, 1.0, attenuation)

    def carry(self, fluid: Scheme, push: Push, warp: WarpMap | None = None) -> None:
        """Let the local part of a push carry the picture until the fluid's next step; what is thicker, less."""
        if not push.local:
            return
        self._look(fluid, push, fluid.faces(), warp)
        carry, region = self.device.pass_("brush/carry.frag"), push.tip.region(fluid.grid)
        inputs = push.tip.inputs(fluid.grid) | {"brush_velocity": push.local_velocity, "viscosity": fluid.viscosity}
        inputs |= {"motion": self._motion, "slip": self._slip.factor}
        fluid.local.add(lambda motion: carry(motion, add=True, region=region, **inputs))

    def push(self, fluid: Scheme, tip: Tip, dt: float, strength: float = 1.0) -> None:
        """Carry the fluid under the tip along; see `Push`."""
        self.lead(fluid, Push(tip, dt, strength))

    def twirl(self, fluid: Scheme, tip: Tip, rate: float) -> None:
        """Turn the fluid under the tip; see `Twirl`."""
        self.lead(fluid, Twirl(tip, rate))

    def expand(self, fluid: Scheme, tip: Tip, rate: float) -> None:
        """Let the area under the tip grow (or, negative, shrink) at `rate` 1/s in the next projection."""
        check_finite("a rate", rate)
        expand, region = self.device.pass_("brush/expand.frag"), tip.region(fluid.grid)
        fluid.source.add(lambda source: expand(source, add=True, region=region, rate=rate, **tip.inputs(fluid.grid)))

    def release(self) -> None:
        """Free the textures."""
        for item in (self._motion, self._obstruction, self._slip):
            item.release()

    def _look(self, fluid: Scheme, motion: Motion, velocity: Field, warp: WarpMap | None) -> None:
        """Find how the fluid moves at the brush, and how firmly a push holds the picture."""
        (hx, hy), (left, top), tip = fluid.grid.spacing, fluid.grid.origin, motion.tip
        probe = self.device.pass_("brush/probe.frag")
        probe(
            self._motion,
            velocity=velocity,
            impulse=fluid.impulse.field,
            viscosity=fluid.viscosity,
            at=((tip.end[0] - left) / hx, (tip.end[1] - top) / hy),
            reach=tuple(max(0.25 * tip.radius / h, 0.5) for h in (hx, hy)),
            spacing=(hx, hy),
        )
        if isinstance(motion, Push):
            self._slip.find(motion, warp)
            at_brush = {"velocity": velocity, "impulse": fluid.impulse.field, "motion": self._motion}
            self._slip.restrain(motion, fluid.grid, **at_brush)

    def _draw(
        self, fluid: Scheme, motion: Motion, faces: Field, gain: float, attenuation: dict[str, Any] | None = None
    ) -> None:
        paint = self.device.pass_(motion.shader, **({"ATTENUATED": 1} if attenuation else {}))
        inputs = motion.tip.inputs(fluid.grid) | motion.inputs() | {"motion": self._motion, "gain": gain}
        if isinstance(motion, Push):
            inputs |= {"slip": self._slip.factor, "part": self._slip.part}
        paint(faces, add=True, region=motion.tip.region(fluid.grid), **inputs, **(attenuation or {}))

"""Where the strokes of a recipe become forces and sources of the fluid, or paint on the map and the masks."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import hypot

import numpy as np

from app.model.recipe import FluidSettings
from app.model.strokes import BrushPath, Dab
from solver.brush.brush import Brush, Motion
from solver.brush.masks import Masks
from solver.brush.push import Push, coasting, gain_compensation, slip_factor, strain_limit
from solver.brush.tip import Tip
from solver.brush.twirl import Twirl
from solver.gl.device import Device
from solver.gl.field import Field
from solver.scheme import Scheme
from solver.warp.map import WarpMap

# What a tool of strength 1 does under a brush at full pressure.
TWIRL = 4.0  # radians per second
GROWTH = 2.0  # of area, per second
BLOW = 0.5  # longer sides per second along a curve
THICKENING = 4.0  # decades of viscosity per second
RESTORING = 6.0  # per second, the part of the displacement that is taken away


@dataclass(frozen=True)
class Scene:
    """What strokes act on in a tick.

    Attributes:
        settings: of the fluid, as they are in force.
        extent: (width, height) of the picture, the longer of them 1.
        part: of the tick that passes.
    """

    fluid: Scheme
    warp: WarpMap
    masks: Masks
    settings: FluidSettings
    extent: tuple[float, float]
    part: float = 1.0


class Brushwork:
    """Draws strokes, tick by tick; those that lead the fluid do so before its step, in it and after it."""

    def __init__(self, device: Device) -> None:
        self._brush = Brush(device)
        self._leading: list[Motion] = []

    @property
    def is_leading(self) -> bool:
        """Something drawn since `begin` leads the fluid."""
        return bool(self._leading)

    def begin(self) -> None:
        """Begin another tick."""
        self._leading.clear()

    def draw(self, scene: Scene, stroke: BrushPath, tick: int, dabs: tuple[Dab, ...]) -> bool:
        """Let a stroke act, with its images, at one of its own ticks; True if it painted on the masks."""
        painted = False
        far = stroke.travelled(tick, scene.extent) / stroke.radius if stroke.tool == "push" else 0.0
        for image, mirrored in stroke.images(dabs, scene.extent):
            painted |= self._draw_image(scene, stroke, far, image, mirrored)
        return painted

    def make_up(self, scene: Scene, velocity: Field) -> None:
        """What leads adds what it lacks, as the last touch before the projection; see `Brush.make_up`."""
        for motion in self._leading:
            self._brush.make_up(scene.fluid, motion, velocity, scene.warp)

    def carry(self, scene: Scene) -> None:
        """Let what is local of pushes carry the picture besides the fluid."""
        for motion in self._leading:
            if isinstance(motion, Push):
                self._brush.carry(scene.fluid, motion, scene.warp)

    def release(self) -> None:
        """Free the textures."""
        self._brush.release()

    def _draw_image(self, scene: Scene, stroke: BrushPath, far: float, dabs: tuple[Dab, ...], mirrored: bool) -> bool:
        dt, fluid = scene.settings.dt, scene.fluid
        reverse = stroke.reverse != (mirrored and stroke.tool == "twirl")
        strength = -stroke.strength if reverse else stroke.strength
        tips = [(_tip(stroke, dab, scene.extent), strength * dab.pressure) for dab in dabs]
        # Several samples in one tick: the fluid is carried by the whole way, a mask is painted piece by piece.
        whole = replace(tips[0][0], end=tips[-1][0].end)
        pressed = sum(amount for _, amount in tips) / len(tips)
        match stroke.tool:
            case "push":
                on = coasting(whole, dt, scene.settings.drag, scene.settings.viscosity)
                self._lead(scene, Push(whole, dt, pressed, slip_factor(far, on), strain_limit(far, on), stroke.local))
            case "curve":
                for tip, amount in tips:
                    length = hypot(tip.end[0] - tip.start[0], tip.end[1] - tip.start[1])
                    if length:
                        self._brush.push(fluid, tip, length / BLOW, amount)
            case "twirl":
                self._lead(scene, Twirl(whole, TWIRL * pressed))
            case "bloat":
                self._brush.expand(fluid, whole, GROWTH * pressed)
            case "pinch":
                self._brush.expand(fluid, whole, -GROWTH * pressed)
            case "restore":
                for tip, amount in tips:
                    share = 1 - np.exp(-RESTORING * abs(amount) * dt * scene.part / len(tips))
                    scene.warp.restore_under(tip.end, tip.radius, tip.hardness, float(share))
            case _:
                for tip, amount in tips:
                    _paint(scene.masks, stroke.tool, tip, amount, dt / len(tips))
                return True
        return False

    def _lead(self, scene: Scene, motion: Motion) -> None:
        """Let a brush lead the fluid: with what viscosity and drag will take of it, and again once they have."""
        settings = scene.settings
        gain = gain_compensation(motion.tip.radius, settings.dt, settings.drag, settings.viscosity)
        self._brush.lead(scene.fluid, motion, gain, scene.warp)
        self._leading.append(motion)


def _paint(masks: Masks, tool: str, tip: Tip, amount: float, dt: float) -> None:
    match tool:
        case "thicken":
            masks.thicken(tip, THICKENING * amount * dt)
        case "thin":
            masks.thicken(tip, -THICKENING * amount * dt)
        case "freeze":
            masks.freeze(tip, amount)
        case "thaw":
            masks.freeze(tip, -amount)
        case "smooth":
            masks.smooth(tip, amount)


def _tip(stroke: BrushPath, dab: Dab, extent: tuple[float, float]) -> Tip:
    width, height = extent
    start, end = (dab.x0 * width, dab.y0 * height), (dab.x1 * width, dab.y1 * height)
    return Tip(start, end, stroke.radius, stroke.hardness, near=stroke.detail > 0)

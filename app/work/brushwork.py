"""Where the strokes of a recipe become forces and sources of the fluid, or paint on the map and the masks."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot
from sys import float_info

import numpy as np

from app.model.recipe import FluidSettings
from app.model.strokes import BrushPath, Dab
from solver.brush.brush import Brush, Motion
from solver.brush.masks import Masks
from solver.brush.push import Push, coasting, gain_compensation, quick_slip, slip_factor, strain_limit
from solver.brush.tip import Path, Tip
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
        dt, fluid = scene.settings.dt, scene.fluid
        strength = -stroke.strength if stroke.reverse else stroke.strength
        tips = [
            (tip, strength * dab.pressure) for tip, dab in zip(_tips(stroke, dabs, scene.extent), dabs, strict=True)
        ]
        # Several samples in one tick: the fluid is carried by the whole way, a mask is painted piece by piece.
        whole = tips[0][0].to(tips[-1][0])
        pressed = sum(amount for _, amount in tips) / len(tips)
        match stroke.tool:
            case "push":
                far = stroke.travelled(tick, scene.extent) / stroke.radius
                on = coasting(whole, dt, scene.settings.drag, scene.settings.viscosity)
                slip = min(slip_factor(far, on, stroke.hold), quick_slip(whole))
                self._lead(scene, Push(whole, dt, pressed, slip, strain_limit(far, on), stroke.hold, stroke.local))
            case "curve":
                for tip, amount in tips:
                    length = hypot(tip.end[0] - tip.start[0], tip.end[1] - tip.start[1])
                    if length >= float_info.min:  # a shorter one has no speed
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
                    for _, place, _ in tip.paths:
                        scene.warp.restore_under(place, tip.radius, tip.hardness, float(share))
            case _:
                for tip, amount in tips:
                    _paint(scene.masks, stroke.tool, tip, amount, dt / len(tips))
                return True
        return False

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


def _tips(stroke: BrushPath, dabs: tuple[Dab, ...], extent: tuple[float, float]) -> list[Tip]:
    """A tip for each piece of a stroke's path, with its images."""
    width, height = extent
    images = [
        [Path((x0 * width, y0 * height), (x1 * width, y1 * height), mirrored) for x0, y0, x1, y1, _ in pieces]
        for pieces, mirrored in stroke.images(dabs, extent)
    ]
    near = stroke.detail > 0
    return [
        Tip(own.start, own.end, stroke.radius, stroke.hardness, near, tuple(others))
        for own, *others in zip(*images, strict=True)
    ]

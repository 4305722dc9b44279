"""Brushes of motion: what a stroke does to the fluid in one tick, drawn over the part of the grid it touches."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from solver.brush.distance import Distance
from solver.brush.push import Push, Slip
from solver.brush.tip import NEAR, Path, Tip
from solver.brush.twirl import Twirl
from solver.faces import check_field
from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.images import MOST_IMAGES, for_images
from solver.gl.reduction import Reduction
from solver.limits import check_finite, check_type
from solver.scheme import Scheme
from solver.warp.map import WarpMap

Motion = Push | Twirl


class Brush:
    """Draws tips into a fluid.

    Push and twirl are closed loops: they add what the fluid lacks of the wanted motion at the brush, so that the
    picture follows the pointer at its own speed however thick the fluid is, and a resting brush holds it still.
    """

    def __init__(self, device: Device) -> None:
        self.device = device
        self._motion = device.field((MOST_IMAGES, 2), 4, "motion at the brush")
        self._obstruction = device.field((MOST_IMAGES, 1), 1, "obstruction factor")
        self._slip = Slip(device)
        self._distance = Distance(device)
        self._sums: dict[tuple[tuple[int, int], int], Sum] = {}

    def lead(self, fluid: Scheme, motion: Motion, gain: float = 1.0, warp: WarpMap | None = None) -> None:
        """Add to the fluid's next step what it lacks of a motion, `gain` times (see `gain_compensation`).

        With `warp`, the picture's map, a push lets slip what has come a long path with it already, and what it would
        stretch too far.
        """
        check_finite("a gain", gain)
        _check(fluid, motion, warp)
        velocity = fluid.faces()
        self._look(fluid, motion, velocity, warp)
        self._restrain(fluid, motion, velocity)
        fluid.impulse.add(lambda faces: self._draw(fluid, motion, faces, gain))

    def make_up(self, fluid: Scheme, motion: Motion, velocity: Field, warp: WarpMap | None = None) -> None:
        """Add to a velocity on MAC faces what it lacks of a motion, after viscosity and before the projection.

        Viscosity does not spread this any more. So it is less where the fluid is thicker than at the tip, and less the
        more of the brush lies on thicker fluid or solids. For `steer` of `Scheme.step`.
        """
        _check(fluid, motion, warp)
        check_field("a velocity", velocity, fluid.grid)
        self._look(fluid, motion, velocity, warp)
        self._restrain(fluid, motion, velocity)
        obstruct, inputs = self.device.pass_("brush/obstruct.frag"), motion.tip.shape(fluid.grid)
        inputs |= {"motion": self._motion, "viscosity": fluid.viscosity, "solid": fluid.solid}
        obstruct(self._obstruction, region=(0, 0, len(motion.tip.paths), 1), **inputs)
        attenuation = {"viscosity": fluid.viscosity, "obstruction": self._obstruction}
        self._draw(fluid, motion, velocity, 1.0, attenuation)

    def carry(self, fluid: Scheme, push: Push, warp: WarpMap | None = None) -> None:
        """Make the local part of a push carry the picture for a step, less in thicker fluid and near solids."""
        check_type("what is carried", push, Push)
        _check(fluid, push, warp)
        if not push.local:
            return
        self._look(fluid, push, fluid.faces(), warp)
        solids: dict[str, Any] = {"distance": self._distance.of(fluid)} if fluid.has_solids else {}
        carry = self.device.pass_("brush/carry.frag", **({"SOLIDS": 1} if solids else {}))
        inputs = {"motion": self._motion, "viscosity": fluid.viscosity, **solids} | self._slip.inputs()
        inputs["hardness"] = push.local_hardness
        vectors = push.local_velocities
        fluid.local.add(lambda motion: push.tip.draw(carry, motion, fluid.grid, vectors, add=True, **inputs))

    def push(self, fluid: Scheme, tip: Tip, dt: float, strength: float = 1.0) -> None:
        """Carry the fluid under the tip along; see `Push`."""
        self.lead(fluid, Push(tip, dt, strength))

    def twirl(self, fluid: Scheme, tip: Tip, rate: float) -> None:
        """Turn the fluid under the tip; see `Twirl`."""
        self.lead(fluid, Twirl(tip, rate))

    def expand(self, fluid: Scheme, tip: Tip, rate: float) -> None:
        """Make the area under the tip grow (or, negative, shrink) at `rate` 1/s in the next projection.

        The room comes from all of the fluid or, if the tip is near, from that around it.
        """
        check_finite("a rate", rate)
        check_type("what expands", tip, Tip)
        check_type("what a brush moves", fluid, Scheme)
        images = range(len(tip.paths))
        self._expand(fluid, tip, [rate for _ in images])
        if tip.near:
            areas = [(self._area(fluid, tip, image), self._area(fluid, tip.wide, image)) for image in images]
            self._expand(fluid, tip.wide, [-rate * area / around if around else 0.0 for area, around in areas])

    def release(self) -> None:
        """Free the textures."""
        for item in (self._motion, self._obstruction, self._slip, self._distance, *self._sums.values()):
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
            region=(0, 0, len(tip.paths), 2),
            ends=for_images(
                [
                    ((a[0] - left) / hx, (a[1] - top) / hy, (b[0] - left) / hx, (b[1] - top) / hy)
                    for a, b, _ in tip.paths
                ]
            ),
            reach=tuple(max(0.25 * tip.radius / h, 0.5) for h in (hx, hy)),
            spacing=(hx, hy),
        )
        if isinstance(motion, Push):
            self._slip.find(motion, warp)

    def _restrain(self, fluid: Scheme, motion: Motion, velocity: Field) -> None:
        """After `_look`: find by how much a push is scaled."""
        if isinstance(motion, Push):
            at_brush = {"velocity": velocity, "impulse": fluid.impulse.field, "motion": self._motion}
            self._slip.restrain(motion, fluid.grid, **at_brush)

    def _draw(
        self, fluid: Scheme, motion: Motion, faces: Field, gain: float, attenuation: dict[str, Any] | None = None
    ) -> None:
        paint, tip = self.device.pass_(motion.shader, **({"ATTENUATED": 1} if attenuation else {})), motion.tip
        inputs: dict[str, Any] = motion.inputs() | {"motion": self._motion, "gain": gain} | (attenuation or {})
        if isinstance(motion, Push):
            inputs |= self._slip.inputs() | {"scaling": self._slip.scaling, "hold": motion.hold}

        def draw(target: Field, only: int | None = None) -> None:
            tip.draw(paint, target, fluid.grid, motion.vectors, only, add=True, **inputs)

        draw(faces)
        for image, path in enumerate(tip.paths if tip.near else ()):
            if any(glides := _glides(fluid, tip, path)):
                given = self._sum(fluid, 2, lambda target, image=image: draw(target, image))
                self._take_back(fluid, tip, path, faces, np.where(glides, given, 0.0))

    def _take_back(self, fluid: Scheme, tip: Tip, path: Path, faces: Field, given: np.ndarray) -> None:
        """Add what has the opposite momentum of `given`, a sum over the faces, around the end of a path of a tip.

        A curl within the fluid has none. But where the picture's edge cuts through it and the fluid glides, some is
        left, and drives the fluid along the edge as far as that goes: what is driven falls off with the logarithm of
        the distance only (Stokes' paradox).
        """
        foot = tuple(0.0 if 2 * at < side else side for at, side in zip(path.end, fluid.grid.picture, strict=True))
        hx, hy = fluid.grid.spacing
        counter = self.device.pass_("brush/counter.frag")
        for axis in np.flatnonzero(given):
            # The momentum of u is that along the edges above and below.
            place = (path.end[0], foot[1]) if axis == 0 else (foot[0], path.end[1])
            wide = Tip(place, place, NEAR * tip.radius)
            # A soft brush of half a disc has the integral pi r^2 / 8.
            speed = np.zeros(2)
            speed[axis] = -given[axis] * hx * hy / (math.pi * wide.radius**2 / 8)
            wide.draw(counter, faces, fluid.grid, [(float(speed[0]), float(speed[1]))], add=True)

    def _expand(self, fluid: Scheme, tip: Tip, rates: list[float]) -> None:
        expand, vectors = self.device.pass_("brush/expand.frag"), [(rate, 0.0) for rate in rates]
        fluid.source.add(lambda source: tip.draw(expand, source, fluid.grid, vectors, add=True))

    def _area(self, fluid: Scheme, tip: Tip, image: int) -> float:
        """The fluid's cells under an image of a tip, each by how much it is under it."""
        weigh = self.device.pass_("brush/weigh.frag")
        draw = lambda weights: tip.draw(weigh, weights, fluid.grid, only=image, solid=fluid.solid)  # noqa: E731
        return float(self._sum(fluid, 1, draw)[0])

    def _sum(self, fluid: Scheme, components: int, draw: Callable[[Field], None]) -> np.ndarray:
        """The sum over the grid of what `draw` draws; waits for the GPU."""
        key = fluid.grid.size, components
        if key not in self._sums:
            self._sums[key] = Sum(self.device, *key)
        return self._sums[key].of(draw)


def _check(fluid: Scheme, motion: Motion, warp: WarpMap | None) -> None:
    check_type("what a brush moves", fluid, Scheme)
    check_type("what a brush does", motion, Motion)
    if warp is not None:
        check_type("what a brush looks at", warp, WarpMap)


class Sum:
    """The sum of what is drawn: a field to draw into, and its reduction."""

    def __init__(self, device: Device, size: tuple[int, int], components: int) -> None:
        self._drawn = device.field(size, components, "drawn to be summed up")
        self._reduction = Reduction(device, size, components, "sum")

    def of(self, draw: Callable[[Field], None]) -> np.ndarray:
        """What `draw` draws into a field of zeros, one number a component."""
        self._drawn.clear()
        draw(self._drawn)
        return self._reduction(self._drawn)

    def release(self) -> None:
        self._drawn.release()
        self._reduction.release()


def _glides(fluid: Scheme, tip: Tip, path: Path) -> tuple[bool, bool]:
    """Whether a tip reaches over edges along which the fluid glides, on a path: for u, and for v."""
    edges = [edge and not sticks for edge, sticks in zip(fluid.grid.at_edge, fluid.params.walls.no_slip, strict=False)]
    over = [
        over
        for a, b, side in zip(path.start, path.end, fluid.grid.picture, strict=True)
        for over in (min(a, b) < tip.radius, max(a, b) > side - tip.radius)
    ]
    left, right, top, bottom = (at_edge and beyond for at_edge, beyond in zip(edges, over, strict=True))
    return top or bottom, left or right

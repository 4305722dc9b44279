"""The push: carry what is under the brush along, and the laws by which it slips."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from solver.brush.tip import Point, Tip
from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.images import MOST_IMAGES, for_images
from solver.grid import Grid
from solver.limits import check_finite, check_step, check_type
from solver.warp.map import WarpMap

# A push slips so that what it draws out does not become thinner than the map can resolve, where the map would fold. How
# much it shall hold all the same is set (`Push.hold`): h makes h + (1 - h) s of the factor s of the first law, and of
# that of the second and third together; see (B3) of solver/README.md. The other laws do not give way to it.
#
# 1. By the brush's own path: it holds fast for FIRM radii, and in the end gives LOOSEST of its speed; one over a square
#    in between. Else a long stroke would draw out what lay at its start into a thread.
FIRM, LOOSEST = 0.7, 0.3
# 2. By the path that the picture under it has come with it, in this stroke or before: the same law. What is pushed back
#    to where it came from becomes shorter again and is held as firmly as at first.
FIRM_CARRIED, LOOSEST_CARRIED = 0.5, 0.5
# 3. By strain, in e-folds a radius of the path times how far the picture is stretched already: where a push with all of
#    the strain limit begins to slip, and where it gives nothing.
SLIPPING, HELD_OFF = 4.0, 5.25
# The strain limit: its part at the beginning of a stroke; the radii of the path in which as much is added; and how much
# less for every radius that the fluid will coast, go on without the brush, after the first. Found, as all of these, by
# making the same push again and again, with all feels and brushes of 9 to 20 cells: none folds, or hardly.
BEGINNING, GAINING, COASTING = 0.68, 6.0, 3.0

# 4. By coasting: it gives no more speed than lets the fluid coast so many radii, beyond which the strain limit would
#    leave nothing of it, where what nothing slows down counts as coming to rest in so many seconds.
FARTHEST_COASTING, LONGEST_COASTING = 1.5, 1.0

# 5. By energy: it leaves the fluid under the brush with no more than so many times the energy of the brush's own flow,
#    or than it has already. One stroke does not come there by itself, with any feel. Stirred for a minute without drag,
#    a fluid moves at 7 times the brush's speed without this law, and with it at less than twice in 99 of 100 cases
#    (MEASURED.md).
MOST_ENERGY = 1.5

# 6. By time: in one step it carries what is under it no farther than its radius, however fast the tip is. A quicker tip
#    leaves behind what it cannot carry, as it does on a long path: in one step the jet that it makes would draw it out.
LONGEST_STEP = 1.0

# A brush's own flow is damped by viscosity as a mode of k^2 = 12 / radius^2 (measured), and no more is put in for it
# than so many times what is wanted.
SQUARED_WAVENUMBER = 12.0
MOST_GAIN = 20.0

# All that the core of the stream function moves has to flow back beside it, and with little room left there it would
# do so many times faster than the brush moves. With .3 a stroke of Putty folds there.
HARDEST = 0.15

# The part of the radius that is the core of a fully hard tip, as `lib/brush.glsl` has it.
CORE = 0.9

# The lattice on which strain is looked at: texels along the brush's radius, and one beyond the brush on either side.
FINE = 8
AROUND = 2 * (FINE + 1) + 1

KEPT = 1024  # pushes of one step whose factors are kept


def coasting(tip: Tip, dt: float, drag: float, viscosity: float) -> float:
    """Radii that the fluid goes on without the brush, from the tip's speed: seconds, 1 / s, lengths^2 / s."""
    speed = math.hypot(tip.end[0] - tip.start[0], tip.end[1] - tip.start[1]) / dt
    slowing = drag + SQUARED_WAVENUMBER * viscosity / tip.radius**2
    return speed / max(slowing, 1 / LONGEST_COASTING) / tip.radius


def slip_factor(travelled: float, coasting: float = 0.0, hold: float = 0.0) -> float:
    """The part of its speed that a push gives, `travelled` radii after its stroke began: laws 1 and 4."""
    by_path = LOOSEST + (1 - LOOSEST) / (1 + 2 * max(travelled - FIRM, 0.0) ** 2)
    return (hold + (1 - hold) * by_path) * FARTHEST_COASTING / max(coasting, FARTHEST_COASTING)


def quick_slip(tip: Tip) -> float:
    """The most of its speed that a push gives whose tip goes its whole way in one step: the sixth law."""
    far = math.dist(tip.start, tip.end)
    return LONGEST_STEP * tip.radius / far if far else math.inf


def strain_limit(travelled: float, coasting: float) -> float:
    """The part of the most strain at which a push slips, `travelled` radii after its stroke began: the third law.

    All that a stroke strains by itself it may; one that begins where the picture is strained already slips soon. So
    does one in a fluid that will go on by itself for about the brush's radius, because then there is no brush to slip.
    Nothing depends on the grid: a recipe gives the same warp on any.
    """
    far = min(coasting, FARTHEST_COASTING)
    begin = BEGINNING / (1 + far / 2)
    return min(begin + travelled / GAINING, 1.0) / (1 + far / 4 + COASTING * max(far - 1, 0.0))


def gain_compensation(radius: float, dt: float, drag: float, viscosity: float) -> float:
    """How many times a brush's motion is put in, so that about all of it is left after a tick of viscosity and drag."""
    gain = math.exp(min(drag * dt, 10.0)) * (1 + SQUARED_WAVENUMBER * dt * viscosity / radius**2)
    return min(gain, MOST_GAIN)


@dataclass(frozen=True)
class Push:
    """Carry the fluid under the tip along in `dt`; strength 1 moves it at the tip's own speed, negative against it.

    Attributes:
        slip: the part of its own speed that the tip gives to the fluid, by what is known without looking at the map;
            see `slip_factor` and `quick_slip`.
        strain_limit: the part of the most strain at which it slips; see `strain_limit`.
        hold: how little it slips by what it has carried and stretched: 0 all of that, 1 not at all. Its part in
            `slip` is in there already.
        local: the part of its motion, 0-1, that carries what is under the tip and nothing else: the fluid does not feel
            it, and nothing flows back beside the brush; see `Brush.carry`.

    Raises:
        ValueError: if a number is not finite, or the tip is faster than the solvers can follow.
    """

    tip: Tip
    dt: float
    strength: float = 1.0
    slip: float = 1.0
    strain_limit: float = 1.0
    hold: float = 0.0
    local: float = 0.0

    def __post_init__(self) -> None:
        check_type("what pushes", self.tip, Tip)
        if not check_step(self.dt) > 0:
            raise ValueError("a push takes some time")
        for name in ("strength", "slip", "strain_limit"):
            check_finite(f"a push's {name}", getattr(self, name))
        for what, part in (("how firmly a push holds", self.hold), ("the local part of a push", self.local)):
            check_type(what, part)
            if not 0 <= part <= 1:
                raise ValueError(f"{what} must be from 0 to 1")
        for velocity in self.velocities:
            for speed in velocity:
                check_finite("a push's speed", speed)

    @property
    def shader(self) -> str:
        return "brush/push.frag"

    @property
    def velocities(self) -> list[Point]:
        """What its images give: against the drag at the whole speed, and no stronger than along it."""
        speed = (self.slip if self.strength > 0 else -self.slip) / self.dt
        return [((end[0] - start[0]) * speed, (end[1] - start[1]) * speed) for start, end, _ in self.tip.paths]

    @property
    def local_velocities(self) -> list[Point]:
        """What of it carries the picture and not the fluid."""
        amount = self.local * abs(self.strength)
        return [(amount * u, amount * v) for u, v in self.velocities]

    @property
    def local_hardness(self) -> float:
        """Of that: the tip's, but for a rim that is no narrower than what it moves in a step is wide.

        What goes on through a rim presses what is in it together by e to the power of the way over the rim's width.
        """
        far = max(math.hypot(*velocity) for velocity in self.local_velocities) * self.dt / self.tip.radius
        return max(min(self.tip.hardness, 1.0, (1 - far) / CORE), 0.0)

    @property
    def vectors(self) -> list[Point]:
        """What of it moves the fluid, lengths / s."""
        return [((1 - self.local) * u, (1 - self.local) * v) for u, v in self.velocities]

    def inputs(self) -> dict[str, Any]:
        return {"strength": abs(self.strength), "hardness": HARDEST * min(max(self.tip.hardness, 0.0), 1.0)}


class Slip:
    """How firmly a push holds: the laws that look at the map and at the fluid, on the GPU.

    Attributes:
        factor: the part of its speed that it gives, by what it has carried and stretched: the second and third law. A
            push has a row of it.
        row: that of the push that `find` was last asked for.
        scaling: the part that it gives of what the fluid lacks, by energy: the fifth.
    """

    def __init__(self, device: Device) -> None:
        self.device = device
        self.factor = device.field((MOST_IMAGES, KEPT), 1, "slip factor")
        self.row = 0
        self.scaling = device.field((MOST_IMAGES, 1), 1, "scaling of the push")
        self._around = device.field((AROUND, MOST_IMAGES * AROUND), 2, "displacement around the brush")
        self._seen: tuple[WarpMap | None, int] | None = None  # the map that the factors were found on
        self._found: dict[int, tuple[Push, int]] = {}  # their rows, by the identity of the push

    def find(self, push: Push, warp: WarpMap | None) -> None:
        """Set `row`, and what `factor` has there, for a push on a map; without one it holds as firmly as it can."""
        # A push leads, makes up and carries in one step, in which the map is the same.
        if (seen := (warp, 0 if warp is None else warp.version)) != self._seen or len(self._found) == KEPT:
            self._seen = seen
            self._found.clear()
            if warp is None:
                self.factor.clear(1.0)
        if warp is None:
            self.row = 0
            return
        if (found := self._found.get(id(push))) is not None:
            self.row = found[1]
            return
        self.row = len(self._found)
        self._found[id(push)] = push, self.row
        width, height = warp.extent
        places = [(min(max(start[0], 0.0), width), min(max(start[1], 0.0), height)) for start, _, _ in push.tip.paths]
        step = push.tip.radius / FINE
        warp.probe(self._around, [(x / width, y / height) for x, y in places], (step / width, step / height))
        self.device.pass_("brush/slip.frag")(
            self.factor,
            region=(0, self.row, len(places), 1),
            around=self._around,
            velocities=for_images(push.velocities),
            radius=push.tip.radius,
            carried=(FIRM_CARRIED, LOOSEST_CARRIED),
            hold=push.hold,
            strain=(push.strain_limit * SLIPPING, push.strain_limit * HELD_OFF),
            places=for_images(places),
            extent=warp.extent,
        )

    def restrain(self, push: Push, grid: Grid, **at_brush: Field) -> None:
        """Set `scaling`, after `factor`, for a push on a fluid: its velocity, impulse and motion at the brush."""
        inputs: dict[str, Any] = push.tip.shape(grid) | push.inputs() | self.inputs() | {"most": MOST_ENERGY}
        inputs |= {"velocities": for_images(push.vectors), "region": (0, 0, len(push.tip.paths), 1)}
        self.device.pass_("brush/restrain.frag")(self.scaling, **at_brush, **inputs)

    def inputs(self) -> dict[str, Any]:
        """What shaders read the factor from."""
        return {"slip": self.factor, "row": float(self.row)}

    def release(self) -> None:
        self.factor.release()
        self.scaling.release()
        self._around.release()

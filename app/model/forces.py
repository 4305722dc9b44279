"""The forces of a recipe: f = sum of f_i, each with a field in space, a strength and a time law (paper, section 4.2).

A force that pushes has `faces`: an acceleration on the MAC faces, lengths / s^2 (an impulse, lengths / s, if it is
instantaneous). One that makes or takes room has a `divergence`, 1 / s, which the projection leaves in the velocity: an
incompressible fluid could not swell otherwise. One that is local has a `motion`, lengths / s, which carries the picture
and not the fluid. All are for a time law of 1; `build` makes them ready for the solver.

Long, as all kinds stand together: they share the shapes below them.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, field_validator, model_validator

from app.errors import UserError
from app.model.sampling import (
    SOURCE,
    NamedPictures,
    PictureName,
    Point,
    Segment,
    Window,
    blurred,
    intensity,
    places,
    to_grid,
)
from app.model.schema import Fraction01, Radius, Several, label_of
from app.model.timelaws import Law, Timed
from solver.grid import Grid

Falloff = Literal["smooth", "gaussian"]
Strength = Annotated[float, Field(ge=-1e6, le=1e6)]
MOST_FORCES = 512  # each has a picture of itself as large as the grid: of 256 cells, 200 MB in all
MOST_PIECES = 20_000  # of a curve; around the edge of a picture, of a radius of two thousandths
MOST_PIECES_IN_ALL = 60_000  # of all curves: each takes 15 microseconds
# Times that all their pieces may cover the whole picture: on 256 cells each takes half a millisecond.
MOST_COVERED = 1500


class _Force(Timed):
    """What every force has besides its time law.

    Attributes:
        name: what messages call it.
        muted: it does nothing.
        strength: multiplies the field; see the kind for the unit.
    """

    name: str = ""
    muted: bool = False
    strength: Strength = 1.0

    def starts(self, dt: float) -> float:
        """A tick before which it does nothing; infinite where it is muted."""
        return math.inf if self.muted else _tick_before(self.starts_at, dt)

    def agrees_until(self, other: _Force, dt: float) -> float:
        """A tick before which both do the same; infinite where they do so for ever."""
        if self == other or (self.muted and other.muted):
            return math.inf
        mine, theirs = self.during, other.during
        if mine and theirs and mine[0] == theirs[0] and self.edited(during=theirs) == other:
            return _tick_before(min(mine[1], theirs[1]), dt)
        return min(self.starts(dt), other.starts(dt))

    def faces(self, grid: Grid, pictures: NamedPictures) -> np.ndarray | None:
        """Acceleration (ny, nx, 2) float32 on left and upper faces, the walls' own faces zero; None if it has none.

        Raises:
            ValueError: what is wrong with it on this picture.
        """
        return None

    def divergence(self, grid: Grid, pictures: NamedPictures) -> np.ndarray | None:
        """Divergence (ny, nx) float32 the velocity shall have, of zero net; None if it has none."""
        return None

    def motion(self, grid: Grid, pictures: NamedPictures) -> np.ndarray | None:
        """Velocity (ny, nx, 2) float32 on left and upper faces that carries the picture alone; None if it has none."""
        return None


class _Push(_Force):
    """What a point and a curve have in common.

    Attributes:
        radius: in longer sides; see `falloff`.
        falloff: "smooth" is (1 - q^2)^3, nothing beyond the radius; "gaussian" has half the radius as its deviation.
        local: from 0, a force on the fluid, to 1, a motion of what is under it and of nothing else, whatever the fluid
            does; in between, that part of the one and of the other. Of the motion, strength is the speed, lengths / s;
            at an instant it is how far.
    """

    radius: Radius = 0.1
    falloff: Falloff = "smooth"
    local: Fraction01 = 0.0

    def faces(self, grid: Grid, pictures: NamedPictures) -> np.ndarray | None:
        return None if self.local == 1 else (1 - self.local) * self._force(grid)

    def motion(self, grid: Grid, pictures: NamedPictures) -> np.ndarray | None:
        return None if self.local == 0 else self.local * self._bare(grid)

    def _force(self, grid: Grid) -> np.ndarray:
        """The acceleration on the faces, of a force that is not local."""
        return self._bare(grid)

    @abstractmethod
    def _bare(self, grid: Grid) -> np.ndarray:
        """Its strength, direction and falloff on the faces, and nothing beside it."""


class PointForce(_Push):
    """A push at a point. Strength: the acceleration at the point.

    Attributes:
        point: where.
        direction: (x, y), y down; its length does not matter.
        divergence_free: with the return flow on both sides that an incompressible fluid has, so that projection changes
            nothing; without, the bare push, of which projection leaves about half.
    """

    kind: Literal["point"]
    point: Point
    direction: tuple[float, float]
    divergence_free: bool = True

    _unit = field_validator("direction")(lambda direction: _checked_direction(direction))

    def _force(self, grid: Grid) -> np.ndarray:
        if not self.divergence_free:
            return self._bare(grid)
        (centre,) = places([self.point], grid)
        push = self.strength * _unit(self.direction)

        def stream(x: np.ndarray, y: np.ndarray) -> np.ndarray:
            # Its curl is the push F at the centre; with a Gaussian g of deviation s, it is
            # g ((1 - r^2 / s^2) F + x (F . x) / s^2).
            weight = _profile(np.hypot(x, y), self.radius, self.falloff)
            return weight * (push[0] * y - push[1] * x)

        return _curl(grid, centre, stream)

    def _bare(self, grid: Grid) -> np.ndarray:
        (centre,) = places([self.point], grid)
        push = self.strength * _unit(self.direction)
        u, v = (
            push[axis] * _profile(np.hypot(x - centre[0], y - centre[1]), self.radius, self.falloff)
            for axis, (x, y) in enumerate((grid.u_faces(), grid.v_faces()))
        )
        return _on_faces(u, v)


class CurveForce(_Push):
    """A push all along a curve. Strength: the acceleration on a straight piece of it.

    The force is the falloff convolved with the curve, so that it has no seams at corners; it ends softly at the ends,
    and adds up where a curve meets itself.

    Attributes:
        points: the curve, two points or more.
        spline: a Catmull-Rom spline through the points instead of a polyline.
        direction: along its "tangent", from the first to the last point; along its "normal", to the right of that; or
            [x, y], y down.
    """

    kind: Literal["curve"]
    points: Several[Point]
    spline: bool = False
    direction: Literal["tangent", "normal"] | tuple[float, float] = "tangent"
    radius: Radius = 0.05

    @model_validator(mode="after")
    def _is_a_curve(self) -> Self:
        if len(self.points) < 2:
            raise ValueError(f"a curve needs at least two points, not {len(self.points)}")
        if len(set(self.points)) < 2:
            raise ValueError("all points of the curve are the same; a curve needs a length")
        if self.pieces > MOST_PIECES:
            raise ValueError(
                f"'radius' ({self.radius:g}) is too small for so long a curve: it is cut into eight pieces a radius, "
                f"{MOST_PIECES} at most"
            )
        if not isinstance(self.direction, str):
            _checked_direction(self.direction)
        return self

    @property
    def pieces(self) -> float:
        """How many it is cut into, or a few less."""
        return len(self.points) + 8 * sum(math.dist(*ends) for ends in pairwise(self.points)) / self.radius

    @property
    def covered(self) -> float:
        """About how many times its pieces cover the whole picture."""
        return self.pieces * min(2 * _reach(self.radius, self.falloff), 1.0) ** 2

    def _bare(self, grid: Grid) -> np.ndarray:
        at, tangents, lengths = pieces_of(places(self.points, grid), self.spline, self.radius / 8)
        if self.direction == "tangent":
            pushes = tangents
        elif self.direction == "normal":
            pushes = np.stack([-tangents[:, 1], tangents[:, 0]], axis=-1)
        else:
            pushes = np.broadcast_to(_unit(self.direction), tangents.shape)
        # So that an infinite straight line has exactly the strength on it.
        across = self.radius * (math.sqrt(math.pi / 2) if self.falloff == "gaussian" else 32 / 35)
        pushes = pushes * (self.strength * lengths / across)[:, None]
        out = []
        for axis, (x, y) in enumerate((grid.u_faces(), grid.v_faces())):
            total = np.zeros(x.shape)
            for place, push in zip(at, pushes[:, axis], strict=True):
                if push != 0.0:
                    rows, columns = _neighbourhood(grid, place, self.radius, self.falloff)
                    across = _in_radii(np.abs(x[0, columns] - place[0]), self.radius) ** 2
                    down = _in_radii(np.abs(y[rows, 0] - place[1]), self.radius)[:, None] ** 2
                    # The profile, without a root or a power of each cell: there may be a billion of them.
                    if self.falloff == "gaussian":
                        total[rows, columns] += push * np.exp(-2 * down) * np.exp(-2 * across)
                    else:
                        near = np.maximum((1 - down) - across, 0.0)
                        weight = near * near
                        weight *= near
                        weight *= push
                        total[rows, columns] += weight
            out.append(total)
        return _on_faces(*out)


class FieldForce(_Force):
    """A vector field encoded as a picture. Strength: the acceleration where a channel is at its end.

    Red is x, green is y. In 8 bits 128 is exactly zero and (c - 128) / 127 the value, in 16 bits (c - 32768) / 32767; a
    floating-point picture holds the values themselves. Where the picture is transparent there is no force.

    Attributes:
        picture: the file; it is stretched to the whole of the source picture.
        green: whether green above zero points "up" or "down".
    """

    kind: Literal["field"]
    picture: PictureName
    green: Literal["up", "down"] = "down"

    def faces(self, grid: Grid, pictures: NamedPictures) -> np.ndarray:
        if self.picture == SOURCE:
            raise ValueError("a field needs a picture of its own, not the source")
        picture = pictures.load(self.picture)
        if picture.pixels.shape[2] < 3:
            raise ValueError(f"{self.picture} is grey; a field needs red (x) and green (y)")
        x, y = (to_grid(component, grid) for component in _decoded(picture.straight().pixels))
        return _on_faces(*_to_faces(self.strength * x, self.strength * (y if self.green == "down" else -y)))


class GradientForce(_Force):
    """The gradient of a picture, or of a segmentation of it, blurred. Strength: that across a straight, full edge.

    By itself an incompressible fluid balances a gradient by pressure and stands still; where the viscosity varies, only
    the splitting into stages moves it a little. (In the paper it moves because few Jacobi sweeps leave most of the
    divergence.) So either the force acts only `within` a window, whose border makes it push, or with `swell` it is a
    velocity, lengths / s, whose divergence the projection leaves in, and what is chosen grows. Both together lift
    what is in the window: it is pressed together ahead and stretched behind, and nothing flows back beside it.

    Attributes:
        picture: "source" or a file.
        segment: what of it; without, the picture's intensity itself.
        blur: radius of the blur, in longer sides; its deviation is half of that.
        direction: "outward" points from the chosen (or bright) to the rest, "inward" to the chosen (or bright).
        within: weighs the force.
        swell: see above.
    """

    kind: Literal["gradient"]
    picture: PictureName = SOURCE
    segment: Segment | None = None
    blur: Radius = 0.04
    direction: Literal["outward", "inward"] = "outward"
    within: Window | None = None
    swell: bool = False

    def faces(self, grid: Grid, pictures: NamedPictures) -> np.ndarray | None:
        return None if self.swell else self._faces(grid, pictures)

    def divergence(self, grid: Grid, pictures: NamedPictures) -> np.ndarray | None:
        if not self.swell:
            return None
        faces = np.pad(self._faces(grid, pictures).astype(np.float64), ((0, 1), (0, 1), (0, 0)))
        u, v = faces[..., 0], faces[..., 1]
        across, down = np.diff(u[:-1], axis=1), np.diff(v[:, :-1], axis=0)
        return (across / grid.spacing[0] + down / grid.spacing[1]).astype(np.float32)

    def _faces(self, grid: Grid, pictures: NamedPictures) -> np.ndarray:
        height = self.potential(grid, pictures)
        if np.ptp(height) < 1e-6:
            raise ValueError(f"{self.picture} is the same everywhere, so that it has no gradient")
        # The steepest place of a blurred edge of height 1 then has gradient 1, whatever the blur.
        scale = self.strength * self.blur / 2 * math.sqrt(2 * math.pi)
        scale *= -1.0 if self.direction == "outward" else 1.0
        u, v = np.zeros_like(height), np.zeros_like(height)
        u[:, 1:] = scale * np.diff(height, axis=1) / grid.spacing[0]
        v[1:] = scale * np.diff(height, axis=0) / grid.spacing[1]
        if self.within:
            weight_u, weight_v = _to_faces(*(self.within.weight(grid),) * 2)
            u, v = u * weight_u, v * weight_v
        return _on_faces(u, v)

    def potential(self, grid: Grid, pictures: NamedPictures) -> np.ndarray:
        """What the force is the gradient of, (ny, nx) in [0, 1]."""
        if self.segment:
            height = self.segment.weight(self.picture, grid, pictures)
        else:
            height = to_grid(intensity(pictures.load(self.picture)), grid)
        return blurred(height, self.blur, grid)


class VortexForce(_Force):
    """A twirl. Strength: the angular acceleration at the centre, radians / s^2, clockwise.

    Attributes:
        point: the centre.
        radius, falloff: as of a point.
    """

    kind: Literal["vortex"]
    point: Point
    radius: Radius = 0.15
    falloff: Falloff = "smooth"

    def faces(self, grid: Grid, pictures: NamedPictures) -> np.ndarray:
        (centre,) = places([self.point], grid)

        def stream(x: np.ndarray, y: np.ndarray) -> np.ndarray:
            r, radius = np.hypot(x, y), self.radius
            if self.falloff == "gaussian":
                return self.strength * (radius / 2) ** 2 * _profile(r, radius, "gaussian")
            return self.strength * radius**2 / 8 * np.maximum(1 - _in_radii(r, radius) ** 2, 0.0) ** 4

        return _curl(grid, centre, stream)


class _Room(_Force):
    """Makes room at a point, or takes it away. Strength: how fast the area grows at the centre, 1 / s.

    An instantaneous one of strength 1 therefore makes the area at its centre e times as large.

    Attributes:
        point: the centre.
        radius, falloff: as of a point.
        room: where the room comes from: from a "ring" around, so that nothing beyond is moved, or from "everywhere".
    """

    point: Point
    radius: Radius = 0.15
    falloff: Falloff = "smooth"
    room: Literal["ring", "everywhere"] = "ring"

    _sign = 1.0

    def divergence(self, grid: Grid, pictures: NamedPictures) -> np.ndarray:
        (centre,) = places([self.point], grid)
        x, y = grid.centres()
        # A source smaller than a cell would fall between the centres.
        r, radius = np.hypot(x - centre[0], y - centre[1]), max(self.radius, 2 * grid.h)
        rate = _profile(r, radius, self.falloff)
        if self.room == "ring":
            # The divergence of x/2 times the profile: its net is zero.
            rate = rate + r / 2 * _slope(r, radius, self.falloff)
        rate *= self._sign * self.strength
        return (rate - rate.mean()).astype(np.float32)


class SourceForce(_Room):
    """Bloat; see `_Room`."""

    kind: Literal["source"]


class SinkForce(_Room):
    """Pinch: the source's opposite."""

    kind: Literal["sink"]
    _sign = -1.0


Force = Annotated[
    PointForce | CurveForce | FieldForce | GradientForce | VortexForce | SourceForce | SinkForce,
    Field(discriminator="kind"),
]


@dataclass(frozen=True)
class BuiltForce:
    """A force on a grid: its time law multiplies `faces`, `divergence` and `motion`, any of which may be missing."""

    label: str
    law: Law
    faces: np.ndarray | None
    divergence: np.ndarray | None
    motion: np.ndarray | None


def excess(forces: Sequence[Force]) -> str | None:
    """A message if a simulation could not build the forces in a second or two; else None."""
    curves = [force for force in forces if isinstance(force, CurveForce) and not force.muted]
    if len(forces) > MOST_FORCES:
        return f"there are {len(forces)} forces; at most {MOST_FORCES} work"
    if (pieces := sum(curve.pieces for curve in curves)) > MOST_PIECES_IN_ALL:
        return (
            f"the curves of the forces are cut into {pieces:.0f} pieces, eight a radius; at most {MOST_PIECES_IN_ALL} "
            "work"
        )
    if (covered := sum(curve.covered for curve in curves)) > MOST_COVERED:
        return (
            f"the pieces of the forces' curves, eight a radius, cover the whole picture {covered:.0f} times; at most "
            f"{MOST_COVERED} times work"
        )
    return None


def build(forces: Sequence[Force], grid: Grid, pictures: NamedPictures, duration: float) -> list[BuiltForce]:
    """The recipe's forces on a grid, without those that are muted, for a simulation of `duration` seconds.

    Raises:
        UserError: naming the force by its index and name, and what is wrong with it.
    """
    built = []
    for number, force in enumerate(forces, 1):
        label = label_of("force", number, force.name)
        if force.muted:
            continue
        try:
            if remark := force.law.check(duration):
                pictures.notice(f"{label} {remark}")
            fields = (field(grid, pictures) for field in (force.faces, force.divergence, force.motion))
            built.append(BuiltForce(label, force.law, *fields))
        except (ValueError, UserError) as error:
            raise UserError(f"{label}: {error}") from None
    return built


def _tick_before(seconds: float, dt: float) -> int:
    """A tick that a time does not come before, however it was rounded."""
    return max(math.floor(seconds / dt - 1e-6), 0)


# Shapes of forces ---------------------------------------------------------------------------------------------------


def _checked_direction(direction: tuple[float, float]) -> tuple[float, float]:
    if direction == (0.0, 0.0):
        raise ValueError("'direction' is [0, 0], which points nowhere")
    return direction


def _unit(direction: tuple[float, float]) -> np.ndarray:
    return np.asarray(direction) / math.hypot(*direction)


def _profile(r: np.ndarray, radius: float, falloff: Falloff) -> np.ndarray:
    """1 in the centre, falling off with the distance r."""
    if falloff == "gaussian":
        return np.exp(-2 * _in_radii(r, radius) ** 2)
    return np.maximum(1 - _in_radii(r, radius) ** 2, 0.0) ** 3


def _in_radii(r: np.ndarray, radius: float) -> np.ndarray:
    """Distances in radii, 40 at most, where nothing is left of either falloff: of a tiny radius they would overflow."""
    return np.minimum(r, 40 * radius) / radius


def _slope(r: np.ndarray, radius: float, falloff: Falloff) -> np.ndarray:
    """The derivative of the profile by r."""
    if falloff == "gaussian":
        return -4 * r / radius**2 * _profile(r, radius, falloff)
    return -6 * r / radius**2 * np.maximum(1 - (r / radius) ** 2, 0.0) ** 2


def _reach(radius: float, falloff: Falloff) -> float:
    """The distance beyond which nothing is left of a profile."""
    return radius * (3.5 if falloff == "gaussian" else 1.0)


def _neighbourhood(grid: Grid, place: np.ndarray, radius: float, falloff: Falloff) -> tuple[slice, slice]:
    """The cells that a profile at `place` reaches, as rows and columns."""
    reach = _reach(radius, falloff)
    low = np.maximum(np.floor((place - reach) / grid.spacing).astype(int), 0)
    high = np.maximum(np.ceil((place + reach) / grid.spacing).astype(int) + 1, 0)
    return slice(low[1], high[1]), slice(low[0], high[0])


def _curl(grid: Grid, centre: np.ndarray, stream: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> np.ndarray:
    """u = d stream / dy, v = -d stream / dx on the faces from values at the nodes: divergence-free to rounding.

    `stream(x, y)` takes places relative to `centre`. A brush that reaches over the edge is cut off there.
    """
    hx, hy = grid.spacing
    x, y = np.meshgrid(np.arange(grid.nx + 1) * hx - centre[0], np.arange(grid.ny + 1) * hy - centre[1])
    nodes = stream(x, y)
    return _on_faces(np.diff(nodes, axis=0)[:, :-1] / hy, -np.diff(nodes, axis=1)[:-1] / hx)


def _to_faces(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Components in the cells as means on left and on upper faces."""
    u, v = x.copy(), y.copy()
    u[:, 1:] = (x[:, 1:] + x[:, :-1]) / 2
    v[1:] = (y[1:] + y[:-1]) / 2
    return u, v


def _on_faces(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """(ny, nx, 2) float32, the walls' own faces zero."""
    faces = np.stack([u, v], axis=-1).astype(np.float32)
    faces[:, 0, 0] = 0.0
    faces[0, :, 1] = 0.0
    return faces


def pieces_of(points: np.ndarray, spline: bool, spacing: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A curve through points (n, 2) in pieces of at most `spacing`: middles, unit tangents (m, 2), lengths (m,)."""
    line = [points[0]]
    for k, (a, b) in enumerate(pairwise(points)):
        pieces = max(1, math.ceil(float(np.hypot(*(b - a))) / spacing))
        if not spline:
            line += [a + (b - a) * j / pieces for j in range(1, pieces + 1)]
            continue
        before, after = points[max(k - 1, 0)], points[min(k + 2, len(points) - 1)]
        # A spline's piece is longer than its chord: twice the pieces keep the spacing.
        for s in np.arange(1, 2 * pieces + 1) / (2 * pieces):
            tangent_a, tangent_b = (b - before) / 2, (after - a) / 2
            h00, h10, h01, h11 = 2 * s**3 - 3 * s**2 + 1, s**3 - 2 * s**2 + s, -2 * s**3 + 3 * s**2, s**3 - s**2
            line.append(h00 * a + h10 * tangent_a + h01 * b + h11 * tangent_b)
    ends = np.asarray(line)
    steps = np.diff(ends, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    keep = lengths > 0
    steps, lengths = steps[keep], lengths[keep]
    return ((ends[:-1] + ends[1:]) / 2)[keep], steps / lengths[:, None], lengths


def _decoded(pixels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """x and y (h, w) float32 of a field's pixels; see `FieldForce`."""
    xy = pixels[..., :2].astype(np.float32)
    full = 1.0
    if pixels.dtype != np.float32:
        full = float(np.iinfo(pixels.dtype).max)
        zero = (full + 1) / 2
        xy = (xy - zero) / (zero - 1)
    elif not np.isfinite(xy).all():
        raise ValueError("the field's picture holds values that are not finite")
    if pixels.shape[2] == 4:
        xy = xy * (pixels[..., 3:].astype(np.float32) / full)
    return xy[..., 0], xy[..., 1]

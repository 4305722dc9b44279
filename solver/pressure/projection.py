"""The pressure: makes a velocity on the MAC grid free of divergence, by multigrid over blocks of 2 x 2 cells."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import ceil, cos, pi, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from solver.gl.field import DoubleField, Field
from solver.gl.passes import Target
from solver.gl.reduction import Reduction
from solver.gl.separable import Separable

if TYPE_CHECKING:
    from solver.gl.device import Device
    from solver.packing import PackedFaces

# A level of no more blocks of 2 x 2 cells than this is solved directly, by a dense matrix.
DIRECT_BLOCKS = 64


def chebyshev_weights(sweeps: int, smallest: float) -> tuple[float, ...]:
    """Jacobi weights that together damp all modes with eigenvalues from `smallest` to 2 as evenly as can be.

    The largest weight comes first, so that the others smooth what it throws up.
    """
    middle, half = (2.0 + smallest) / 2, (2.0 - smallest) / 2
    return tuple(sorted((1 / (middle + half * cos(pi * (k + 0.5) / sweeps)) for k in range(sweeps)), reverse=True))


# What the projection may leave of the divergence, and the most cycles it takes for it.
WANTED_LEFT = 1e-3
MOST_CYCLES = 8


@dataclass(frozen=True)
class Cycle:
    """How a cycle smooths, and what it leaves, about: found with impulses, strokes, painted viscosities and walls.

    Attributes:
        sweeps: their weights after each interpolation, from the finest level down; the last entry serves all coarser
            ones. There are none before a restriction: from a zero guess the residual is the right-hand side itself, and
            the way down costs little.
        rough: the part that the first cycle leaves of what differs from the means over blocks of 2 x 2 cells.
        smooth: and of all.
        each: the part of that which every further one leaves.
        twice: each of the first so many levels visits the next coarser one twice: thin walls cost accuracy there.
    """

    sweeps: tuple[tuple[float, ...], ...]
    rough: float
    smooth: float
    each: float
    twice: int = 0

    def left(self, whole: float, rough: float, cycles: int = 1, is_warm: bool = False) -> float:
        """What so many cycles leave of the whole divergence and its rough part, from rest or from a warm start.

        What is left at a warm start is what such cycles before were worst at, and so is this one.
        """
        first = self.rough * rough + self.smooth * whole
        return max(first, self.each * whole if is_warm else 0.0) * self.each ** (cycles - 1)


_FAINT = chebyshev_weights(1, 0.4), chebyshev_weights(3, 0.35)
_LIGHT = chebyshev_weights(2, 0.6), chebyshev_weights(3, 0.35), chebyshev_weights(4, 0.25)
_COARSER = chebyshev_weights(4, 0.35), chebyshev_weights(5, 0.25)
_QUICK = chebyshev_weights(3, 0.7), *_COARSER
_THOROUGH = chebyshev_weights(4, 0.5), *_COARSER
# From the cheapest on.
OPEN = (
    Cycle(_FAINT, rough=0.6, smooth=0.02, each=0.4),
    Cycle(_LIGHT, rough=0.35, smooth=0.003, each=0.2),
    Cycle(_QUICK, rough=0.25, smooth=0.0025, each=0.1),
    Cycle(_THOROUGH, rough=0.17, smooth=0.002, each=0.05),
)
# Among walls each is followed by a step to where the residual is least, and that is measured.
WALLED = (
    Cycle(_LIGHT, rough=0.3, smooth=0.003, each=0.25),
    Cycle(_QUICK, rough=0.2, smooth=0.0025, each=0.2),
    Cycle(_THOROUGH, rough=0.16, smooth=0.002, each=0.1, twice=2),
)
# A cycle that leaves more than this part has met a wall that takes second visits.
POOR = 0.35
# And if these leave more, there is no more to be had: a source in a closed pocket.
STALLED = 0.9


def cheapest(cycles: tuple[Cycle, ...], whole: float, rough: float, is_warm: bool = False) -> tuple[Cycle, int]:
    """The kind of cycle, of these, and the number of them that leave little enough at the least cost."""
    plans = ((cycle, number) for number in range(1, MOST_CYCLES) for cycle in cycles)
    enough = ((cycle, number) for cycle, number in plans if cycle.left(whole, rough, number, is_warm) <= WANTED_LEFT)
    return next(enough, (cycles[-1], MOST_CYCLES))


class Level:
    """The textures of one grid: faces, right-hand side, solution.

    Attributes:
        span: the finest grid's size in cells of this level, which halves exactly: the last cells may be narrower.
        size: in blocks.
        is_whole: no cell is narrower.
    """

    def __init__(self, device: Device, span: tuple[float, float], number: int) -> None:
        self.span = span
        self.size = (ceil(span[0] / 2), ceil(span[1] / 2))
        self.is_whole = all(length == int(length) for length in span)
        label = f"pressure level {number}"
        # Between cells that are narrower than the others a face can count for more than 1.
        kind = "f2" if number else "f1"
        self.left, self.up, self.far = (
            device.field(self.size, 4, f"{label} {name}", kind) for name in ("left", "up", "far")
        )
        self.links = device.field(self.size, 4, f"{label} links", "f1")
        self.faces: dict[str, Any] = {"left": self.left, "up": self.up, "far": self.far}
        self.residual = device.double_field(self.size, 4, f"{label} residual")
        self.pressure = device.double_field(self.size, 4, f"{label} pressure")
        self.kept = device.field(self.size, 4, f"{label} kept")

    def release(self) -> None:
        for field in (self.left, self.up, self.far, self.links, self.residual, self.pressure, self.kept):
            field.release()


class Pressure:
    """The projection u <- u - grad p with lap p = div u - s, and no flow through the edges and the solid cells.

    What is kept on the GPU is p / h, in lengths / s, so that only the source needs the size of a cell. Each cycle
    solves for a correction to what the cycles before it left, so that float32 sets no floor to the divergence. A flow
    changes little from step to step: the trend of the last pressures mostly leaves so little that one cycle is enough.
    Without solids a level of some 60 x 60 cells is solved exactly, and the kind of cycle and their number follow from
    what the start leaves. Among solids each cycle is taken so as to leave the least, so that no mask can make the
    divergence grow, and they end when little enough is left.

    Args:
        device: the device.
        size: (nx, ny) cells, of any size.
        h: side of a cell, lengths; 1 / max(nx, ny) if not given.
    """

    def __init__(self, device: Device, size: tuple[int, int], h: float | None = None) -> None:
        self.device = device
        self.size = size
        self.h = h or 1.0 / max(size)
        self._levels = [Level(device, size, 0)]
        while self._levels[-1].size[0] * self._levels[-1].size[1] > DIRECT_BLOCKS:
            width, height = self._levels[-1].span
            self._levels.append(Level(device, (width / 2, height / 2), len(self._levels)))
        blocks, coarsest = self._levels[0].size, self._levels[-1].size
        count = coarsest[0] * coarsest[1]
        self._inverse = device.field((4 * count, count), 4, "pressure inverse")
        # Where there are no solids a much finer level can be solved directly.
        separable = next(level for level in self._levels if Separable.is_worth(level.size))
        self._separable_level = separable
        self._separable = Separable(device, separable.span, separable.size)
        self._base, self._last, self._change, self._way, self._applied_way = (
            device.double_field(blocks, 4, f"pressure {name}")
            for name in ("base", "last", "change", "way", "applied way")
        )
        self._applied = device.field(blocks, 4, "pressure applied")
        # While a velocity is projected, the first holds what is wanted of its divergence; then the pressure's gradient.
        self._across, self._down = (device.field(blocks, 4, f"pressure {name}") for name in ("across", "down"))
        # What is summed over the grid, block by block, and read back at once.
        self._products = device.field(blocks, 4, "pressure products")
        self._add_up = Reduction(device, blocks, 4, "sum")
        self.set_solids(None)

    def release(self) -> None:
        """Free the textures."""
        for item in (*self._levels, self._inverse, self._separable, self._base, self._last, self._change):
            item.release()
        for item in (self._way, self._applied_way, self._applied, self._products, self._add_up):
            item.release()
        for item in (self._across, self._down):
            item.release()

    # -- what goes in and comes out ---------------------------------------------------------------------------------

    def set_solids(self, solid: Field | None) -> None:
        """Close every face of the solid cells (R8 at cells, 1 = solid), and of no others; None for no solids at all."""
        shader, levels = self.device.pass_, self._levels
        self._has_solids = solid is not None
        self._variant: dict[str, Any] = {} if self._has_solids else {"OPEN": 1}
        finest = levels[0]
        everywhere = solid or self.device.field(self.size, 1, "no solids", "f1")
        shader("pressure/open_faces.frag")((finest.left, finest.up, finest.far), solid=everywhere)
        if solid is None:
            everywhere.release()
        for fine, coarse in pairwise(levels):
            shader("pressure/coarsen_faces.frag")((coarse.left, coarse.up, coarse.far), **fine.faces, span=fine.span)
            shader("pressure/links.frag")(
                fine.links, **fine.faces, coarse_left=coarse.left, coarse_up=coarse.up, coarse_far=coarse.far
            )
        self._inverse.set(_inverse(levels[-1]))

    def project(
        self,
        velocity: DoubleField,
        cycles: int | None = None,
        source: Field | None = None,
        warm: bool = False,
        carried: DoubleField | None = None,
        packed: PackedFaces | None = None,
    ) -> int:
        """Make `velocity` free of divergence, or its divergence equal to the source's; writes and swaps.

        Args:
            velocity: MAC velocity, lengths / s; its faces at edges and solids become exactly zero.
            cycles: multigrid cycles, by default as many as leave a thousandth of the divergence.
            source: wanted divergence at cells, 1 / s; its mean over the fluid is taken off: nothing leaves the grid.
            warm: start from the pressure that the last two let expect, unless that is worse than to start from rest.
            carried: gradients at MAC faces, lengths / s, replaced by their mean with that of this pressure.
            packed: the velocity to be made so, as the viscous solver packs it, instead of what `velocity` holds.

        Returns:
            The number of cycles.
        """
        finest = self._levels[0]
        given: dict[str, Any] = packed.inputs() if packed else {"velocity": velocity.read}
        norm, at_rest, expected = self._try_expected(given, source)
        light = WALLED[0] if self._has_solids else OPEN[0]
        is_warm = warm and light.left(*expected) <= 1.5 * light.left(*at_rest)
        if not is_warm:
            self._take_divergence(given, source)
        start = expected if is_warm else at_rest
        if self._has_solids:
            cycles = self._cycle_among_walls(norm, start, cycles, before=int(is_warm))
        else:
            cycles = self._cycle_in_the_open(start, cycles, before=int(is_warm))
        if cycles + is_warm < 2:
            self._change.read.clear()
        targets = self._across, self._down, self._last.write, self._base.write
        parts: dict[str, Any] = {"base": self._base.read, "change": self._change.read, "before": self._last.read}
        self._draw("gradient", targets, finest, trend=float(is_warm), **parts)
        pass_ = self.device.pass_
        inputs: dict[str, Any] = {**given, "across": self._across, "down": self._down}
        variant = {**self._variant, **_packing(given)}
        if self._has_solids:
            inputs |= {"left": finest.left, "up": finest.up}
        if carried is None:
            pass_("pressure/subtract_gradient.frag", **variant)(velocity.write, **inputs)
        else:
            targets = velocity.write, carried.write
            pass_("pressure/subtract_gradient.frag", CARRY=1, **variant)(targets, carried=carried.read, **inputs)
            carried.swap()
        for pair in (velocity, self._last, self._base):
            pair.swap()
        return cycles

    def state(self) -> tuple[Field, Field]:
        """The fields that a later warm start depends on."""
        return self._last.read, self._base.read

    def forget(self) -> None:
        """Expect no pressure: the velocity is a new one."""
        for field in self.state():
            field.clear()

    @property
    def pressure(self) -> np.ndarray:
        """The last pressure, (ny, nx) float32, lengths^2 / s: it includes the time step.

        After a warm start what that step changed is a little smoother than what was subtracted; see `gradient.frag`.
        """
        return _cells(self._last.read.get(), self.size) * np.float32(self.h)

    def divergence_norm(self, velocity: Field) -> float:
        """Root mean square divergence of a MAC velocity over all cells, 1 / s; waits for the GPU."""
        self._take_divergence({"velocity": velocity}, None)
        squares = float((self._levels[0].residual.read.get().astype(np.float64) ** 2).sum())
        return sqrt(squares / (self.size[0] * self.size[1])) / self.h

    # -- the solve --------------------------------------------------------------------------------------------------

    def _draw(
        self, shader: str, target: Target, level: Level, defines: dict[str, Any] | None = None, **inputs: Any
    ) -> None:
        """Draw a pass that needs the faces of its level."""
        whole = {"WHOLE": 1} if not self._has_solids and level.is_whole else {}
        pass_ = self.device.pass_(f"pressure/{shader}.frag", **self._variant, **whole, **(defines or {}))
        pass_(target, **(level.faces if self._has_solids else {"span": level.span}), **inputs)

    def _take_divergence(self, given: dict[str, Any], source: Field | None, **expected: Any) -> None:
        """The right-hand side of the finest level; less what is `expected`, with the squares of both."""
        finest = self._levels[0]
        defines = _packing(given)
        target: Target = finest.residual.read
        if expected:
            defines["EXPECTED"] = 1
            target = finest.residual.read, self._products
        if source is not None:
            defines["WITH_SOURCE"] = 1
            self._draw("gather_source", (self._across, self._products), finest, source=source, scale=self.h)
            total, cells, *_ = self._add_up(self._products).tolist()
            expected |= {"source": self._across, "mean": total / max(cells, 1.0)}
        self._draw("divergence", target, finest, defines, **given, **expected)

    def _try_expected(
        self, given: dict[str, Any], source: Field | None
    ) -> tuple[float, tuple[float, float], tuple[float, float]]:
        """Start from the pressure expected, and wait for what that leaves.

        Returns:
            The norm of the divergence, and the parts of it, of all and of the rough, that there are at rest and there.
        """
        self._take_divergence(given, source, expected=self._base.read)
        squares = self._add_up(self._products)
        whole, rough, left, left_rough = np.sqrt(np.maximum(squares, 0.0) / (squares[0] or 1.0)).tolist()
        return sqrt(squares[0]), (whole, rough), (left, left_rough)

    def _cycle_in_the_open(self, start: tuple[float, float], cycles: int | None, before: int) -> int:
        """So many cycles, or as many as do; see `_keep_correction` for `before`."""
        self._kind, number = (OPEN[-1], cycles) if cycles else cheapest(OPEN, *start, bool(before))
        for cycle in range(number):
            self._solve(0)
            if cycle < number - 1:
                self._subtract_laplacian(self._levels[0], self._levels[0].pressure.read)
            self._keep_correction(before + cycle)
        return number

    def _cycle_among_walls(self, norm: float, start: tuple[float, float], cycles: int | None, before: int) -> int:
        """The same among solids, where what a cycle leaves depends on their shape: it is measured; waits each time."""
        light, quick, thorough = WALLED
        self._kind = thorough if cycles else light if light.left(*start) <= WANTED_LEFT else quick
        left, wanted = start[0] * norm, WANTED_LEFT * norm
        for cycle in range(cycles or MOST_CYCLES):
            self._solve(0)
            last, left = left, self._step_along(self._levels[0], is_first=cycle == 0)
            self._keep_correction(before + cycle)
            if cycles:
                continue
            if left <= wanted or (self._kind is thorough and left > STALLED * last):
                return cycle + 1
            self._kind = thorough if left > POOR * last else light if light.each * left <= wanted else quick
        return cycles or MOST_CYCLES

    def _solve(self, number: int) -> None:
        """One cycle from a level down: from a zero guess, the `pressure` that roughly accounts for its `residual`."""
        pass_, level = self.device.pass_, self._levels[number]
        if not self._has_solids and level is self._separable_level:
            self._separable.solve(level.residual.read, level.pressure.read)
            return
        if level is self._levels[-1]:
            pass_("pressure/solve_directly.frag")(
                level.pressure.read, residual=level.residual.read, inverse=self._inverse
            )
            return
        pressure, coarser = level.pressure, self._levels[number + 1]
        pass_("pressure/restrict.frag", **self._variant)(
            coarser.residual.read, residual=level.residual.read, links=level.links
        )
        self._solve(number + 1)
        if number < self._kind.twice and coarser is not self._levels[-1]:
            coarser.kept, coarser.pressure.read = coarser.pressure.read, coarser.kept
            self._subtract_laplacian(coarser, coarser.kept)
            self._solve(number + 1)
            pass_("pressure/add.frag")(coarser.pressure.write, a=coarser.kept, b=coarser.pressure.read)
            coarser.pressure.swap()
        pass_("pressure/prolong.frag", **self._variant)(
            pressure.read, coarse=coarser.pressure.read, links=level.links, span=level.span
        )
        for weight in self._kind.sweeps[min(number, len(self._kind.sweeps) - 1)]:
            self._draw("smooth", pressure.write, level,
                       pressure=pressure.read, residual=level.residual.read, weight=weight)  # fmt: skip
            pressure.swap()

    def _subtract_laplacian(self, level: Level, correction: Field) -> None:
        """Take from a level's residual what a correction accounts for."""
        self._draw("residual", level.residual.write, level, pressure=correction, residual=level.residual.read)
        level.residual.swap()

    def _step_along(self, level: Level, is_first: bool) -> float:
        """Replace a level's `pressure` by what leaves the least residual, along it and the way of the step before.

        One step of the generalised conjugate residual method: Eisenstat, Elman and Schultz, SIAM J. Numer. Anal. 20
        (1983). No step makes the residual larger, whatever the walls do to a cycle.

        Returns:
            The norm of what is left; waits for the GPU.
        """
        pressure, residual = level.pressure, level.residual
        first: dict[str, Any] = {"FIRST": 1} if is_first else {}
        before: dict[str, Any] = {} if is_first else {"before": self._applied_way.read}
        self._draw("residual", (self._applied, self._products), level, {"PRODUCTS": 1, **first},
                   pressure=pressure.read, residual=residual.read, **before)  # fmt: skip
        along, length2, shared, left2 = self._add_up(self._products).tolist()
        beta = 0.0
        if not is_first:
            before["way"] = self._way.read
            # Unless there is nothing new in it.
            if length2 * self._way_length2 - shared**2 > 1e-5 * length2 * self._way_length2:
                beta = shared / self._way_length2
        self._way_length2 = length2 - beta * shared
        alpha = along / self._way_length2 if self._way_length2 > 0.0 else 0.0
        self.device.pass_("pressure/step.frag", **first)(
            (pressure.write, residual.write, self._way.write, self._applied_way.write),
            alpha=alpha, beta=beta, z=pressure.read, applied=self._applied, residual=residual.read, **before,
        )  # fmt: skip
        for pair in (pressure, residual, self._way, self._applied_way):
            pair.swap()
        return sqrt(max(left2 - alpha * along, 0.0))

    def _keep_correction(self, before: int) -> None:
        """Make the correction part of the pressure: the base, or the change, or added to it, after `before` others."""
        pressure = self._levels[0].pressure
        if before == 0:
            self._base.read, pressure.read = pressure.read, self._base.read
        elif before == 1:
            self._change.read, pressure.read = pressure.read, self._change.read
        else:
            self.device.pass_("pressure/add.frag")(self._change.write, a=self._change.read, b=pressure.read)
            self._change.swap()


def _packing(given: dict[str, Any]) -> dict[str, Any]:
    """The variant of a pass for a velocity that is given on MAC faces, or packed."""
    return {} if "velocity" in given else {"PACKED": 1}


def _cells(blocks: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """The cells of an array of blocks, (h, w, 4) -> (ny, nx)."""
    height, width, _ = blocks.shape
    cells = blocks.reshape(height, width, 2, 2).transpose(0, 2, 1, 3).reshape(2 * height, 2 * width)
    return cells[: size[1], : size[0]]


def _inverse(level: Level) -> np.ndarray:
    """The pseudo-inverse of a level's Laplacian, laid out for `solve_directly.frag`: (blocks, 4 blocks, 4).

    Pseudo, because each region of the fluid leaves the pressure's constant open.
    """
    width, height = level.size
    size = (2 * width, 2 * height)
    left, up = (_cells(field.get() / (255.0 if field.dtype == "f1" else 1.0), size) for field in (level.left, level.up))
    # Numbered block after block, as the texels' cells lie.
    number = _cells(np.arange(4 * width * height).reshape(height, width, 4), size)
    matrix = np.zeros((number.size, number.size))
    for open_, here, there in ((left[:, 1:], number[:, 1:], number[:, :-1]), (up[1:], number[1:], number[:-1])):
        matrix[here, there] = matrix[there, here] = open_
    matrix -= np.diag(matrix.sum(axis=1))
    inverse = np.linalg.pinv(matrix, rcond=1e-6, hermitian=True)
    return inverse.reshape(width * height, 4, -1).transpose(0, 2, 1)

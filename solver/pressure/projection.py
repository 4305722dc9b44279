"""The pressure projection: makes a velocity on the MAC grid free of divergence."""

from __future__ import annotations

from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np

from solver.components import connected_components
from solver.gl.field import DoubleField, Field
from solver.packing import unpacked
from solver.pressure.conjugate_gradients import ConjugateGradients
from solver.pressure.cycle import Cycle
from solver.pressure.graph import Graph, links_of

if TYPE_CHECKING:
    from solver.gl.device import Device
    from solver.packing import PackedFaces

# The fraction of the divergence that a projection may leave: a target, not derived.
WANTED_LEFT = 1e-3

# How large |r|^2 may be by rounding alone, as a fraction of the squares of the velocities and sources that r is made
# of. Each is rounded to half an epsilon of float32, a cell sums up five of them, and a velocity counts in two cells.
# Rounding errors do not sum to zero in each region, so no pressure accounts for them, and conjugate gradients that go
# on below them diverge (Kaasschieter, J. Comput. Appl. Math. 24, 1988).
ROUNDING = 2.5 * float(np.finfo(np.float32).eps) ** 2


class Projection:
    """The projection u <- u - grad q with lap q = div u - s (P1 to P3), and no flow through edges and solid cells.

    The GPU holds p, which is q over the side of a cell along x, in lengths / s. Conjugate gradients solve for the
    difference to the expected pressure, extrapolated from the last two: in a flow that changes little one iteration is
    enough, and float32 sets no floor to the divergence.

    Args:
        device: the device.
        size: (nx, ny) cells, of any size.
        spacing: sides (hx, hy) of a cell, lengths; 1 / max(nx, ny) both if not given.
    """

    def __init__(self, device: Device, size: tuple[int, int], spacing: tuple[float, float] | None = None) -> None:
        self.device = device
        self.size = size
        self.spacing = spacing or (1.0 / max(size), 1.0 / max(size))
        self._aspect = self.spacing[0] / self.spacing[1]
        blocks = ceil(size[0] / 2), ceil(size[1] / 2)
        self._solver = ConjugateGradients(device, blocks)
        self._residual, self._expected, self._last = (
            device.double_field(blocks, 4, f"pressure {name}") for name in ("residual", "expected", "last")
        )
        self._across, self._down = (device.field(blocks, 4, f"pressure {name}") for name in ("across", "down"))
        self._squares = device.field(blocks, 4, "squares of the divergence")
        self._source = device.field(size, 1, "balanced source")
        self._solid: np.ndarray | None = None
        self._regions: np.ndarray | None = None
        self._is_partial = False
        self._cycle = Cycle(device, size, self._aspect, None)

    def release(self) -> None:
        """Free the textures."""
        for item in (self._solver, self._cycle, self._residual, self._expected, self._last):
            item.release()
        for item in (self._across, self._down, self._squares, self._source):
            item.release()

    # -- what goes in and comes out ---------------------------------------------------------------------------------

    def set_spacing(self, spacing: tuple[float, float]) -> None:
        """Let the cells have other sides."""
        self.spacing = spacing
        if self._aspect != spacing[0] / spacing[1]:
            self._aspect = spacing[0] / spacing[1]
            self._prepare()

    def set_solids(self, solid: np.ndarray | None) -> None:
        """Close the faces of solid cells, (ny, nx), by the part of each that is solid, 0-1; None for no solids."""
        self._solid = None if solid is None else np.asarray(solid, np.float32)
        self._is_partial = bool(self._solid is not None and ((self._solid > 0) & (self._solid < 1)).any())
        self._regions = None
        self._prepare()

    def _prepare(self) -> None:
        """Make the cycle anew; the one before stays until that is done, as a mask may fail to be taken up."""
        before, self._cycle = self._cycle, Cycle(self.device, self.size, self._aspect, self._solid)
        before.release()

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
            source: wanted divergence of a cell's open part, 1 / s; its mean over each connected region of the fluid is
                taken off: nothing leaves one.
            warm: start from the expected pressure, unless that leaves more than half of the divergence.
            carried: gradients at MAC faces, lengths / s, replaced by their mean with that of this pressure.
            packed: the velocity to project, as the viscous solver packs it, instead of what `velocity` holds.

        Returns:
            The number of cycles.
        """
        given: dict[str, Any] = packed.inputs() if packed else {"velocity": velocity.read}
        wanted = {} if source is None else {"source": self._balance(source)}
        if not warm:
            self._expected.read.clear()
        squares, left, terms = self._take_divergence(given, **wanted, expected=self._expected.read)
        if warm and left > 0.25 * squares:
            warm = False
            self._expected.read.clear()
            squares, left, terms = self._take_divergence(given, **wanted)
        least = max(WANTED_LEFT**2 * squares if cycles is None else 0.0, ROUNDING * terms)
        # Two sweeps leave about a thirtieth, and take half as long again as one.
        sweeps = 1 if self._cycle.light_leaves**2 * left <= least else 2
        iterations = self._solver.solve(self._cycle, self._residual, left, least, sweeps, cycles)
        if not warm and cycles is None:
            # What float32 has rounded off a pressure much larger than its gradient is corrected.
            self._expected.read.copy_from(self._solver.pressure)
            _, left, _ = self._take_divergence(given, **wanted, expected=self._expected.read)
            iterations += self._solver.solve(self._cycle, self._residual, left, least, sweeps)
        self._subtract_gradient(velocity, given, carried, trend=float(warm))
        return iterations

    @property
    def weights(self) -> dict[str, Any]:
        """The open parts of left and upper faces, as `lib/block.glsl` has them, if some are open in part."""
        return {name: self._cycle.finest.inputs[name] for name in ("left", "up")} if self._is_partial else {}

    def state(self) -> tuple[Field, Field]:
        """The fields that a later warm start depends on."""
        return self._last.read, self._expected.read

    def forget(self) -> None:
        """Start from zero pressure next time: the velocity is a new one."""
        for field in self.state():
            field.clear()

    @property
    def pressure(self) -> np.ndarray:
        """The last q, (ny, nx) float32, lengths^2 / s: it includes the time step.

        After a warm start the change in that step is a little smoother than what was subtracted; see `gradient.frag`.
        """
        return unpacked(self._last.read.get())[: self.size[1], : self.size[0]] * np.float32(self.spacing[0])

    # -- its stages -------------------------------------------------------------------------------------------------

    def _balance(self, source: Field) -> Field:
        """The source in the open part of each cell, times its side, less the mean over each connected region."""
        array = source.get().astype(np.float64)
        if self._solid is None:
            array -= array.mean()
        else:
            if self._regions is None:
                ends = Graph.of_cells(*links_of(self._solid), 1.0).ends
                self._regions = connected_components(np.arange(array.size), *ends.T)
            open_part = 1.0 - self._solid.astype(np.float64)
            sums, cells = (np.bincount(self._regions, (a * open_part).ravel()) for a in (array, np.ones(array.shape)))
            means = np.divide(sums, cells, out=np.zeros_like(sums), where=cells > 0)
            array = open_part * (array - means[self._regions].reshape(array.shape))
        self._source.set(array * self.spacing[0])
        return self._source

    def _take_divergence(self, given: dict[str, Any], **less: Field) -> tuple[float, float, float]:
        """Draw the residual: the divergence less the source and A `expected`.

        Returns the sums of squares: of the residual without `expected`, with it, and of all terms it is made of.
        """
        defines = {name.upper(): 1 for name in less} | _packing(given)
        self._cycle.finest.draw("divergence", (self._residual.read, self._squares), defines, **given, **less)
        squares, left, terms, _ = self._solver.add_up(self._squares).tolist()
        return squares, left, terms

    def _subtract_gradient(
        self, velocity: DoubleField, given: dict[str, Any], carried: DoubleField | None, trend: float
    ) -> None:
        """Subtract the pressure's gradient from the velocity, and extrapolate the pressure to expect next."""
        finest = self._cycle.finest
        finest.draw(
            "gradient", (self._across, self._down, self._last.write, self._expected.write),
            expected=self._expected.read, change=self._solver.pressure, before=self._last.read, trend=trend,
        )  # fmt: skip
        for pair in (self._last, self._expected):
            pair.swap()
        faces = {name: finest.inputs[name] for name in ("left", "up", "aspect") if name in finest.inputs}
        inputs: dict[str, Any] = {**given, **faces, "across": self._across, "down": self._down}
        defines = finest.defines | _packing(given)
        if carried is None:
            self.device.pass_("pressure/subtract_gradient.frag", **defines)(velocity.write, **inputs)
        else:
            targets = velocity.write, carried.write
            subtract = self.device.pass_("pressure/subtract_gradient.frag", CARRY=1, **defines)
            subtract(targets, **inputs, carried=carried.read)
            carried.swap()
        velocity.swap()


def _packing(given: dict[str, Any]) -> dict[str, Any]:
    """The variant of a pass for a velocity that is given on MAC faces, or packed."""
    return {} if "velocity" in given else {"PACKED": 1}

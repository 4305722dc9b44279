"""Conjugate gradients for the pressure, preconditioned by a multigrid cycle."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from solver.gl.reduction import Reduction

if TYPE_CHECKING:
    from solver.gl.device import Device
    from solver.gl.field import DoubleField, Field
    from solver.pressure.cycle import Cycle

# Only so that it ends: of some thousand random masks of square cells none has needed more than 11.
MOST_ITERATIONS = 40

# How many times the smallest |r|^2 so far the next may be. Rounding errors of float32 do not sum to zero in each of
# many enclosed regions. No pressure accounts for them, and once they are all that is left the residual grows without
# end (Kaasschieter, J. Comput. Appl. Math. 24, 1988). In a solve that goes well |r| may grow tenfold.
GROWTH = 100.0


class ConjugateGradients:
    """Solves A p = r on the finest level, until little enough of r is left.

    Hestenes and Stiefel (1952), with the cycle of McAdams, Sifakis and Teran (2010) as preconditioner.

    Args:
        device: the device.
        blocks: size of the finest level, in blocks.

    Attributes:
        add_up: sums of the four components of a field at blocks.
    """

    def __init__(self, device: Device, blocks: tuple[int, int]) -> None:
        self.device = device
        self._pressure, self._direction = (
            device.double_field(blocks, 4, f"pressure {name}") for name in ("change", "search direction")
        )
        self._applied = device.field(blocks, 4, "pressure applied")
        # Terms of the dot products, summed over the grid and read back together.
        self._products = device.field(blocks, 4, "pressure products")
        self.add_up = Reduction(device, blocks, 4, "sum")

    @property
    def pressure(self) -> Field:
        """The solution at blocks."""
        return self._pressure.read

    def solve(
        self,
        cycle: Cycle,
        residual: DoubleField,
        squares: float,
        wanted: float,
        sweeps: int,
        iterations: int | None = None,
    ) -> int:
        """Solve for `pressure`; waits for the GPU. The residual is used up.

        Args:
            cycle: the preconditioner.
            residual: r at blocks.
            squares: |r|^2.
            wanted: |r|^2 at which it ends.
            sweeps: of the smoother before and after each correction.
            iterations: at most; by default `MOST_ITERATIONS`.

        Returns:
            The number of iterations.
        """
        most = iterations or MOST_ITERATIONS
        count, rz, smallest = 0, 0.0, squares
        while count < most and squares > wanted:
            z = direction = cycle.solve(residual.read, sweeps)
            targets = self._products, self._applied
            first: dict[str, Any] = {"FIRST": 1} if count == 0 else {}
            before: dict[str, Any] = {}
            so_far: dict[str, Any] = {}
            if count > 0:
                self.device.pass_("pressure/dot.frag")(self._products, residual=residual.read, z=z)
                rz_before = rz
                rz, squares, *_ = self.add_up(self._products).tolist()
                if squares <= wanted:
                    break
                before = {"before": self._direction.read, "beta": rz / rz_before}
                so_far = {"pressure": self._pressure.read}
                direction = self._direction.write
                targets = *targets, direction
            cycle.finest.draw("apply_operator", targets, first, z=z, residual=residual.read, **before)
            rz, curvature, rq, qq = self.add_up(self._products).tolist()
            if not (rz and curvature):  # too small for float32
                break
            alpha = rz / curvature
            squares = max(squares - 2.0 * alpha * rq + alpha**2 * qq, 0.0)
            if count > 0 and squares > GROWTH * smallest:
                break
            smallest = min(smallest, squares)
            count += 1
            if count == most or squares <= wanted:
                last = self.device.pass_("pressure/update.frag", LAST=1, **first)
                last(self._pressure.write, direction=direction, alpha=alpha, **so_far)
            else:
                if first:
                    self._direction.write.copy_from(z)
                self._direction.swap()
                self.device.pass_("pressure/update.frag", **first)(
                    (self._pressure.write, residual.write), residual=residual.read, direction=self._direction.read,
                    applied=self._applied, alpha=alpha, **so_far,
                )  # fmt: skip
                residual.swap()
            self._pressure.swap()
        if count == 0:
            self._pressure.read.clear()
        return count

    def release(self) -> None:
        """Free the textures."""
        for item in (self._pressure, self._direction, self._applied, self._products, self.add_up):
            item.release()

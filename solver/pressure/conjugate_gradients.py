"""Conjugate gradients for the pressure, preconditioned by a multigrid cycle."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from solver.gl.reduction import Reduction

if TYPE_CHECKING:
    from solver.gl.device import Device
    from solver.gl.field import DoubleField, Field
    from solver.pressure.cycle import Cycle

# A bound, for no endless run: of some thousand random masks none has needed more than 11.
MOST_ITERATIONS = 40

# Times the smallest residual, in squares, that the next may be. Among many enclosed regions what is rounded off to
# float32 does not sum to zero in each; no pressure accounts for it, and once it is all that is left the residual grows
# without end (Kaasschieter, J. Comput. Appl. Math. 24, 1988). In a solve that goes well its norm may grow tenfold.
GROWTH = 100.0


class ConjugateGradients:
    """Solves A p = r on the finest level, until little enough of r is left.

    Hestenes and Stiefel (1952), with the cycle of McAdams, Sifakis and Teran (2010) as preconditioner.

    Args:
        device: the device.
        blocks: size of the finest level, in blocks.
    """

    def __init__(self, device: Device, blocks: tuple[int, int]) -> None:
        self.device = device
        self._pressure, self._direction = (
            device.double_field(blocks, 4, f"pressure {name}") for name in ("change", "search direction")
        )
        self._applied = device.field(blocks, 4, "pressure applied")
        # What is summed over the grid, block by block, and read back at once.
        self.products = device.field(blocks, 4, "pressure products")
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
            squares: the sum of its squares.
            wanted: the sum of squares at which it ends.
            sweeps: of the smoother before and after each correction.
            iterations: at most; by default `MOST_ITERATIONS`.

        Returns:
            The number of iterations.
        """
        most = iterations or MOST_ITERATIONS
        count, rz, smallest = 0, 0.0, squares
        while count < most and squares > wanted:
            z = direction = cycle.solve(residual.read, sweeps)
            targets = self.products, self._applied
            first: dict[str, Any] = {"FIRST": 1} if count == 0 else {}
            before: dict[str, Any] = {}
            so_far: dict[str, Any] = {}
            if count > 0:
                self.device.pass_("pressure/dot.frag")(self.products, residual=residual.read, z=z)
                rz_before = rz
                rz, squares, *_ = self.add_up(self.products).tolist()
                if squares <= wanted:
                    break
                before = {"before": self._direction.read, "beta": rz / rz_before}
                so_far = {"pressure": self._pressure.read}
                direction = self._direction.write
                targets = *targets, direction
            cycle.finest.draw("apply_operator", targets, first, z=z, residual=residual.read, **before)
            rz, curvature, rq, qq = self.add_up(self.products).tolist()
            if not (rz and curvature):  # as small as float32 does not hold
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
        for item in (self._pressure, self._direction, self._applied, self.products, self.add_up):
            item.release()

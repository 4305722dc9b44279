"""A warp map as a product of factors, each of which may be scaled without folding."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from solver.gl.device import Device
from solver.gl.field import DoubleField, Field
from solver.gl.passes import Region
from solver.grid import Grid
from solver.steepness import Steepness
from solver.warp.state import FACTOR, OPEN, Images
from solver.warp.submap import Level, defines_of, inputs_of

# How far det J may fall where a factor is scaled, as a fraction of min(1, det J) at 100 %: 1/2 is a quarter turn. The
# present submap may turn by another 41 degrees before its remap, and then det J still falls to no less than 0.1.
LEAST_LEFT, SPLIT = 0.5, 0.05
MOST = 12  # closed factors, as every checkpoint has a copy of them; all that follows goes into one
TEXELS = 2  # of a factor along a cell: with one, two of twelve random recipes without folds fold between 60 and 90 %


class Factors:
    """The product of a map's submaps, cut into factors before one turns too far to be scaled.

    W = F_1 F_2 ... F_n S, with S the submap that moves, each F a displacement of the whole picture.

    Args:
        device: the device.
        grid: the whole picture's.
    """

    def __init__(self, device: Device, grid: Grid) -> None:
        self.device = device
        self.picture = grid.picture
        self._closed: list[Field] = []
        size = grid.refined(TEXELS).size
        self._open = DoubleField(device, size, 2, "open factor")
        self._spacing = self.picture[0] / size[0], self.picture[1] / size[1]
        self._scaling = Steepness(device, size, "scaling of a factor", SCALING=1)

    @property
    def is_one(self) -> bool:
        """True if all of the map may be scaled as it is."""
        return not self._closed

    def take(self, submap: Level, held: Field | None, edges: Images = OPEN) -> None:
        """Take in what a submap has moved, before it is emptied; `held` and `edges`: the map's."""
        self._merge(self._open.write, submap, held, edges)
        left = self._left(self._open.write) if len(self._closed) < MOST else 1.0
        # If one remap turns the open factor too far, it begins a new one, unless nothing was turned before.
        if left < SPLIT and self._left(self._open.read) < 1:
            self._close(self._open.read)
            self._open.read.clear()
            self._merge(self._open.write, submap, held, edges)
            left = self._left(self._open.write)
        self._open.swap()
        if left < LEAST_LEFT and len(self._closed) < MOST:
            self._close(self._open.read)
            self._open.read.clear()

    def begin_with(self, draw: Callable[[Field], None]) -> None:
        """One factor, which is drawn."""
        self.clear()
        draw(self._open.read)

    def change(self, draw: Callable[[Field, Field], None]) -> None:
        """Draw all factors anew, each from what it is into another field."""
        kept = [self._open.read, *self._closed]
        for field in kept:
            draw(self._open.write, field)
            field.copy_from(self._open.write)

    def draw(
        self,
        targets: tuple[Field, Field],
        amount: float,
        submap: Level,
        origin: tuple[float, float],
        step: tuple[float, float],
        moved: Field | None = None,
        regions: list[Region] | None = None,
        edges: Images = OPEN,
    ) -> Field:
        """Draw the product with every factor scaled at (fragment + origin) step, 0-1 of the picture, after `moved`.

        The map must be held nowhere. It is drawn in `regions`, by default everywhere.

        Returns:
            The one of both targets that holds it.
        """
        self._merge(self._open.write, submap, None, edges)
        target, other = targets
        for factor in (self._open.write, *reversed(self._closed)):
            inputs: dict[str, Any] = {"factor": factor, "amount": amount, "picture": self.picture}
            inputs |= {"origin": origin, "step": step, "edges": edges} | ({} if moved is None else {"moved": moved})
            follow = self.device.pass_("warp/follow_factor.frag", **({"FIRST": 1} if moved is None else {}))
            follow(target, region=regions, **inputs)
            moved, target, other = target, other, target
        return other

    # -- its state --------------------------------------------------------------------------------------------------

    def save(self) -> dict[str, Field]:
        """The factors by name, the first one first; not to be changed."""
        return {f"{FACTOR}{number}": field for number, field in enumerate((*self._closed, self._open.read))}

    def restore(self, saved: dict[str, Field]) -> None:
        """Be what `save` gave, or copies of it."""
        self.clear()
        *closed, last = (saved[name] for name in sorted(saved, key=_number))
        for field in closed:
            self._close(field)
        self._open.read.copy_from(last)

    def clear(self) -> None:
        """The identity."""
        for field in self._closed:
            field.release()
        self._closed.clear()
        self._open.read.clear()

    def release(self) -> None:
        """Free the textures."""
        for thing in (*self._closed, self._open, self._scaling):
            thing.release()

    def _close(self, field: Field) -> None:
        closed = self.device.field(field.size, 2, f"factor {len(self._closed)}")
        closed.copy_from(field)
        self._closed.append(closed)

    def _merge(self, target: Field, submap: Level, held: Field | None, edges: Images) -> None:
        """Draw the open factor after what a submap has moved."""
        levels = [submap]
        known = {} if held is None else {"held": held}
        follow = self.device.pass_("warp/follow_factor.frag", FIRST=1, SUBMAP=1, **defines_of(levels))
        inputs = inputs_of(self.device, levels, edges, known)
        place: dict[str, Any] = {"origin": (0.0, 0.0), "step": target.texel, "edges": edges}
        follow(target, factor=self._open.read, amount=1.0, picture=self.picture, **inputs, **place)

    def _left(self, factor: Field) -> float:
        """What is left of its least det J where it is scaled; waits for the GPU."""
        return -self._scaling.of(factor, self._spacing)


def _number(name: str) -> int:
    return int(name.removeprefix(FACTOR))

"""Masks on a canvas of their own: how thick the fluid is and where it is frozen, painted as finely as the picture.

The class is long because painting, applying and saving all keep track of which texels the fluid has not got yet.
"""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, floor
from typing import Any

import moderngl
import numpy as np

from solver.brush.tip import Tip
from solver.gl.device import Device
from solver.gl.field import Field, FieldPool
from solver.gl.passes import Blend, Region, differing, hull
from solver.gl.tiled import TILE, Kind, SavedTiles, TiledField
from solver.grid import Grid
from solver.limits import LARGEST_VISCOSITY, as_mask, check_finite, check_type, viscosities
from solver.scheme import Scheme
from solver.state import State
from solver.warp.frozen import REACH

# Thickness is kept in 16 bits: so many steps a decade and the step that is zero leave room for 3 decades that painting
# may thin by and 5 that it may thicken by; `lib/decades.glsl` has them too.
STEPS, ZERO, MOST = 8192, 24576, 65535
BLANK = {"thickness": ZERO / MOST, "frozen": 0.0}
LEAST_VISCOSITY = 1e-6  # that painting starts from where there is none
SMOOTHED = 1 / 8  # radii over which `smooth` takes means

Base = float | np.ndarray | Callable[[Grid], np.ndarray | float]


class Masks:
    """Thickness (decades of viscosity) and frozenness painted by hand, over what the recipe sets.

    Nothing is kept of a mask that nothing has been painted on.

    Args:
        device: where they live.
        canvas: the texels they are painted on, over the whole picture; see `map_size`.

    Attributes:
        version: grows where `apply` or `restore` finds that something has changed.
    """

    def __init__(self, device: Device, canvas: Grid) -> None:
        check_type("what masks are painted on", canvas, Grid)
        self.device = device
        self.canvas = canvas
        self.version = 0
        self._kinds = {
            "thickness": Kind(canvas.size, 1, "nu2", TILE),
            "frozen": Kind(canvas.size, 1, "f1", TILE),
        }
        self._painted: dict[str, TiledField] = {}
        self._nothing: dict[str, Field] = {
            name: TiledField(device, (1, 1), 1, f"no {name}", kind.dtype, blank=BLANK[name])
            for name, kind in self._kinds.items()
        }
        self._frozen_before: SavedTiles | None = None  # what is frozen by the recipe
        self._base: Base = 0.0
        self._cells = FieldPool(device, "masks")
        # The fluid that got them last, if it need not get all of them, and the texels of a mask changed since.
        self._applied_to: tuple[Scheme, Grid] | None = None
        self._changed: dict[str, Region] = {}
        self._frozen_in: Region | None = None  # the texels frozen or thawed since that was asked last

    # -- what is painted over ---------------------------------------------------------------------------------------

    def set_base(self, viscosity: Base) -> None:
        """Set the viscosity that is painted over, lengths^2 / s: of all cells, (ny, nx), or a function of the grid.

        Raises:
            ValueError: if a value is negative, not finite or too large.
        """
        self._base = viscosity if callable(viscosity) else viscosities(viscosity)
        self._applied_to = None

    def set_frozen(self, frozen: np.ndarray | None) -> None:
        """Set what is frozen by the recipe, (h, w) true or false on the canvas; paint on it is taken off.

        Raises:
            ValueError: on another shape or a NaN.
        """
        texels = None if frozen is None else as_mask("frozen texels", frozen, (self.canvas.ny, self.canvas.nx))
        if self._frozen_before is not None:
            self._frozen_before.release()
            self._frozen_before = None
        self._clear("frozen")
        if texels is not None and texels.any():
            self._field("frozen").set(texels)
            self._frozen_before = self._field("frozen").save()
        self._frozen_in = 0, 0, *self.canvas.size
        self._applied_to = None

    # -- painting ---------------------------------------------------------------------------------------------------

    def thicken(self, tip: Tip, decades: float) -> None:
        """Thicken by `decades` at the tip's centre; negative thins."""
        check_finite("a thickening", decades)
        amount = min(abs(decades) * STEPS / MOST, 1.0)
        self._paint("thickness", tip, "brush/thicken.frag", "add" if decades > 0 else "subtract", amount=amount)

    def freeze(self, tip: Tip, amount: float) -> None:
        """Freeze by `amount` (0-1) as far as the tip reaches; negative thaws. From 1/2 on a place is frozen."""
        check_finite("a freezing", amount)
        towards, amount = float(amount > 0), min(abs(amount), 1.0)
        self._paint("frozen", tip, "brush/freeze.frag", "mix", towards=towards, amount=amount)

    def smooth(self, tip: Tip, strength: float) -> None:
        """Smooth both masks under the tip; `strength` 1 leaves means over squares with sides of `SMOOTHED` radii.

        The sign of the strength does not count.
        """
        check_finite("a smoothing", strength)
        for image in range(len(tip.paths)):
            self._smooth(tip, image, min(abs(strength), 1.0))

    def _smooth(self, tip: Tip, image: int, strength: float) -> None:
        left, top, width, height = self._regions(tip)[image]
        if not (width and height):
            return
        side = max(3, round(SMOOTHED * tip.radius / self.canvas.h))
        size = -(-width // side), -(-height // side)
        blocks = {"corner": (float(left), float(top)), "side": float(side)}
        means = self.device.field(size, 1, "means of a mask")
        means.texture.filter = moderngl.LINEAR, moderngl.LINEAR
        for name, mask in self._painted.items():
            self.device.pass_("brush/coarsen.frag")(means, mask=mask, **blocks)
            if name == "frozen" and not means.get().any():
                continue  # to the map, what is no longer frozen and what never was must be the same
            self._paint(name, tip, "brush/smooth.frag", "mix", image, means=means, strength=strength, **blocks)
        means.release()

    def clear(self) -> None:
        """Take all paint off."""
        for name in self._kinds:
            self.take_off(name)

    def words(self, name: str) -> np.ndarray | None:
        """The texels (h, w) of a mask as `edit` has them; None if nothing has been painted on it."""
        return self._painted[name].get() if name in self._painted else None

    def edit(self, name: str, change: Callable[[np.ndarray], np.ndarray]) -> None:
        """Make a mask anew from its texels, by a function that leaves what it is given as it is.

        The texels are (h, w), uint16 of "thickness", uint8 of "frozen", in which 255 is all.
        """
        field = self._field(name)
        before = field.get()
        after = change(before)
        if region := differing(before, after):
            x, y, width, height = region
            field.set(after[y : y + height, x : x + width], region)
            self._note_change(name, region)

    def take_off(self, name: str) -> None:
        """Take all paint off one mask; of what has none, whether it ever had, nothing changes."""
        if name not in self._painted:
            return
        field = self._painted[name]
        before = field.get()
        if name == "frozen" and self._frozen_before is not None:
            field.restore(self._frozen_before)
        else:
            self._clear(name)
        if region := differing(before, field.get()):
            self._note_change(name, region)

    # -- what the fluid takes of them -------------------------------------------------------------------------------

    def apply(self, fluid: Scheme) -> None:
        """Give a fluid, on the whole picture or a window, its viscosity and solid cells; the next step takes them up.

        They are worked out where a mask has changed since it got them last (B2): viscosity by the mean over a cell,
        solid cells by the distance of their middles from what the map holds, which is what is frozen and `REACH` texels
        more. Within half a cell they are solid, so not even a line of single texels lets anything through; over one
        more cell they are closed less and less: there the map passes from what it holds to what flows.

        Raises:
            ValueError: for a fluid of another picture.
        """
        check_type("what gets masks", fluid, Scheme)
        grid = fluid.grid
        if grid.picture != self.canvas.picture:
            raise ValueError(f"masks on a picture of {self.canvas.picture} do not fit one of {grid.picture}")
        base = self._cells.get("base viscosity", grid.size, 1)
        if self._applied_to != (fluid, grid):
            viscosity = self._base(grid) if callable(self._base) else self._base
            base.set(viscosities(viscosity, (grid.ny, grid.nx)))
            fluid.viscosity.copy_from(base)
            fluid.solid.clear()
            self._changed = dict.fromkeys(self._painted, (0, 0, *self.canvas.size))
        elif not self._changed:
            return
        self.version += 1
        cells: dict[str, Any] = {
            "origin": tuple(a / b for a, b in zip(grid.origin, grid.picture, strict=True)),
            "cell": tuple(a / b for a, b in zip(grid.spacing, grid.picture, strict=True)),
        }
        if changed := self._changed.get("thickness"):
            self.device.pass_("step/average_thickness.frag")(
                fluid.viscosity,
                region=self._cells_over(changed, grid),
                base_viscosity=base,
                thickness=self.thickness,
                least=LEAST_VISCOSITY,
                most=LARGEST_VISCOSITY,
                **cells,
            )
        if changed := self._changed.get("frozen"):
            covered = self._cells.get("covered", grid.size, 1, "f1")
            x, y, width, height = region = self._cells_over(changed, grid)
            self.device.pass_("step/average_frozen.frag")(covered, region=region, frozen=self.frozen, **cells)
            solid = 0.5 + REACH * max(a / b for a, b in zip(self.canvas.spacing, grid.spacing, strict=True))
            reach = ceil(solid + 0.5)
            self.device.pass_("step/close_cells.frag")(
                fluid.solid,
                region=(x - reach, y - reach, width + 2 * reach, height + 2 * reach),
                frozen=self.frozen,
                covered=covered,
                solid=solid,
                reach=float(reach),
                **cells,
            )
        self._applied_to = fluid, grid
        self._changed.clear()
        fluid.masks_changed()

    def forget_fluid(self) -> None:
        """Give the fluid everything next time, as it lies elsewhere now or is another one."""
        self._applied_to = None

    @property
    def base_viscosity(self) -> Field:
        """What is painted over, on the cells of the fluid that got them last, lengths^2 / s."""
        return self._cells["base viscosity"]

    @property
    def thickness(self) -> Field:
        """Painted thickness on the canvas (see `lib/decades.glsl`), or one texel if there is none."""
        return self._painted.get("thickness", self._nothing["thickness"])

    @property
    def frozen(self) -> Field:
        """What is frozen on the canvas, from 1/2 on, or one texel of nothing."""
        return self._painted.get("frozen", self._nothing["frozen"])

    def take_frozen(self) -> tuple[Field, Region] | None:
        """What is frozen on the canvas, from 1/2 on, and where that changed since this was asked last, if it did."""
        region, self._frozen_in = self._frozen_in, None
        return None if region is None or "frozen" not in self._painted else (self._painted["frozen"], region)

    # -- their state ------------------------------------------------------------------------------------------------

    def save(self) -> State:
        """A copy of this moment, on the GPU, which the caller releases; it shares what did not change."""
        tiles = {
            name: self._painted[name].save() if name in self._painted else SavedTiles.nothing(kind, BLANK[name])
            for name, kind in self._kinds.items()
        }
        return State({}, {}, tiles)

    def restore(self, state: State) -> None:
        """Go back to a saved state; call `apply` after it. `take_frozen` does not tell of it: the map goes back too.

        Raises:
            ValueError: if it is of another canvas.
        """
        check_type("what to go back to", state, State)
        if {name: saved.kind for name, saved in state.tiles.items()} != self._kinds:
            raise ValueError("the state is of another canvas")
        for name, saved in state.tiles.items():
            if name in self._painted or not saved.is_blank:
                for region in self._field(name).restore(saved):
                    self._changed[name] = hull(region, self._changed.get(name))
                    self.version += 1  # it is shown before anybody calls `apply`
        self._frozen_in = None

    @property
    def nbytes(self) -> int:
        """Bytes of texture memory."""
        return sum(field.nbytes for field in (*self._painted.values(), *self._cells.fields))

    def release(self) -> None:
        """Free the textures."""
        if self._frozen_before is not None:
            self._frozen_before.release()
        for thing in (*self._painted.values(), *self._nothing.values(), self._cells):
            thing.release()
        self._painted.clear()

    # -- its parts --------------------------------------------------------------------------------------------------

    def _field(self, name: str) -> TiledField:
        """The field of a mask, made when it is wanted first."""
        if name not in self._painted:
            kind = self._kinds[name]
            self._painted[name] = TiledField(
                self.device, kind.size, kind.components, f"painted {name}", kind.dtype, kind.tile, BLANK[name]
            )
            self._applied_to = None
        return self._painted[name]

    def _clear(self, name: str) -> None:
        if name in self._painted:
            self._painted[name].clear()

    def _paint(self, name: str, tip: Tip, shader: str, blend: Blend, only: int | None = None, **inputs: Any) -> None:
        regions = [
            region
            for image, region in enumerate(self._regions(tip))
            if only in (None, image) and region[2] and region[3]
        ]
        if regions:
            tip.draw(self.device.pass_(shader), self._field(name), self.canvas, only=only, blend=blend, **inputs)
        for region in regions:
            self._note_change(name, region)

    def _note_change(self, name: str, region: Region) -> None:
        self._changed[name] = hull(region, self._changed.get(name))
        if name == "frozen":
            self._frozen_in = hull(region, self._frozen_in)

    def _regions(self, tip: Tip) -> list[Region]:
        """The texels of the canvas that each image of a tip touches."""
        check_type("what paints", tip, Tip)
        found = list[Region]()
        for x, y, width, height in tip.regions(self.canvas):
            left, top = max(x, 0), max(y, 0)
            right, bottom = min(x + width, self.canvas.nx), min(y + height, self.canvas.ny)
            found.append((left, top, max(right - left, 0), max(bottom - top, 0)))
        return found

    def _cells_over(self, region: Region, grid: Grid) -> Region:
        """The cells over texels of the canvas."""
        sides = zip(region[:2], region[2:], self.canvas.spacing, grid.origin, grid.spacing, strict=True)
        ends = [((first * texel - start) / h, ((first + n) * texel - start) / h) for first, n, texel, start, h in sides]
        (left, right), (top, bottom) = ((floor(a), ceil(b)) for a, b in ends)
        return left, top, right - left, bottom - top

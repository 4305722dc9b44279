"""Where the pixels of a result are looked up: the map's displacement at their centres or corners."""

from __future__ import annotations

from math import ceil, floor

import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field, FieldPool
from solver.gl.passes import Region
from solver.resample.plan import REACH, Plan
from solver.resample.tiles import Piece


class SamplePoints:
    """The displacement interpolated at the pixels of one tile after another; kept while the map stays the same.

    Attributes:
        fields: where it is kept.
    """

    def __init__(self, device: Device) -> None:
        self.device = device
        self.fields = FieldPool(device, "sample points")
        self._holds: dict[str, tuple[object, ...]] = {}  # what each field was drawn for last

    def lattice(self, plan: Plan, tile: Piece, at_centres: bool, region: list[Region] | None = None) -> Field:
        """The displacement at the corners of a tile's pixels, or at their centres; only in a `region`, if given."""
        _, top, _, bottom = tile
        more, shift = (0, 0.5) if at_centres else (1, 0.0)
        scale = plan.displacement.height / plan.size[1]
        columns = None
        if region:
            # Of the rows, all that the region is interpolated from.
            low, high = min(y for _, y, _, _ in region), max(y + height for _, y, _, height in region)
            left, right = min(x for x, _, _, _ in region), max(x + width for x, _, width, _ in region)
            first = min(floor((top + low) * scale) - REACH, plan.displacement.height - 4)
            columns = [(left, first, right - left, ceil((top + high) * scale) + 2 * REACH - first)]
        rows = self.along_x(plan, tile, at_centres, columns)
        points = self.fields.get("lattice", (rows.width, bottom - top + more), rows.components, "f4")
        if self._is_new("lattice", (*plan.key, plan.size, plan.is_paired, at_centres, tile, region and tuple(region))):
            along_y = self.device.pass_("resample/sample_points.frag", **({"PAIRED": 1} if plan.is_paired else {}))
            along_y(points, region=region, displacement=rows, first=top + shift, scale=scale)
        return points

    def along_x(self, plan: Plan, tile: Piece, at_centres: bool, region: list[Region] | None = None) -> Field:
        """The same between the map's texels along x only, on all of its rows."""
        left, _, right, _ = tile
        more, shift = (0, 0.5) if at_centres else (1, 0.0)
        role = "centres along x" if at_centres else "corners along x"
        width, components, scale = right - left + more, 2, plan.displacement.width / plan.size[0]
        defines: dict[str, object] = {"ALONG_X": 1}
        if plan.is_paired:
            width, components = (right - left + 1) // 2 + more, 4
            defines |= {"PAIRED": 1, "NEAR": 1} if scale <= 1.0 else {"PAIRED": 1}
        rows = self.fields.get(role, (width, plan.displacement.height), components, "f4")
        if self._is_new(role, self._key(plan, tile, region)):
            along_x = self.device.pass_("resample/sample_points.frag", **defines)
            along_x(rows, region=region, displacement=plan.displacement, first=left + shift, scale=scale)
        return rows

    def positions(self, plan: Plan, tile: Piece) -> np.ndarray:
        """Where in the picture a tile's pixels are looked up, in its pixels; waits for the GPU.

        (rows, columns, 2) float32 at the pixels' centres, or with one row and column more at their corners.
        """
        left, top, right, bottom = tile
        more = 0 if plan.is_single else 1
        field = self.lattice(plan, tile, at_centres=plan.is_single)
        positions = field.get().reshape(field.height, -1, 2)[:, : right - left + more]
        positions *= np.array(plan.longer, np.float32)
        positions[..., 0] += (np.arange(left, right + more) * plan.zoom[0])[None, :]
        positions[..., 1] += (np.arange(top, bottom + more) * plan.zoom[1])[:, None]
        return positions

    def is_known(self, plan: Plan, tile: Piece) -> bool:
        """Whether the centres were asked for before, as in a batch, where it pays to interpolate them for good."""
        return self._holds.get("centres along x") == self._key(plan, tile)

    def release(self) -> None:
        """Free the textures."""
        self.fields.release()
        self._holds.clear()

    def _key(self, plan: Plan, tile: Piece, region: list[Region] | None = None) -> tuple[object, ...]:
        """What tells apart what is taken along x."""
        return *plan.key, plan.size, plan.is_paired, tile[0], tile[2], region and tuple(region)

    def _is_new(self, role: str, key: tuple[object, ...]) -> bool:
        """Whether a field is to hold another thing than before: over a batch of pictures the map is the same."""
        is_new = self._holds.get(role) != key
        self._holds[role] = key
        return is_new

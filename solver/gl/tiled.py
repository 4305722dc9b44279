"""A large field of which a copy costs no more than what was drawn into it since the last one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from solver.gl.device import Device
from solver.gl.field import DTYPES, Field
from solver.gl.passes import Region

TILE = 256  # texels along a tile


@dataclass
class _Tile:
    """A copy of one tile, shared by all that hold it; `field` is None for a tile of zeros."""

    field: Field | None
    holders: int = 0

    def release(self) -> None:
        self.holders -= 1
        if self.holders == 0 and self.field is not None:
            self.field.release()


@dataclass(frozen=True)
class SavedTiles:
    """What a `TiledField` held at a moment; whoever has it releases it.

    Attributes:
        kind: (size, components, dtype, tile) of the field.
        tiles: its tiles, (rows, columns), each shared with other saves where nothing was drawn in between.
    """

    kind: tuple[tuple[int, int], int, str, int]
    tiles: np.ndarray

    @property
    def textures(self) -> list[Field]:
        """The textures that it holds, alone or with others."""
        return [tile.field for tile in self.tiles.flat if tile.field is not None]

    def arrays(self) -> dict[str, np.ndarray]:
        """The tiles that are not zero, off the GPU: `places` (n,), counted by rows, and all their `texels` in a row."""
        places, texels = list[int](), list[np.ndarray]()
        for place, tile in enumerate(self.tiles.flat):
            if tile.field is not None:
                values = tile.field.get().ravel()
                if values.view(f"u{values.itemsize}").any():
                    places.append(place)
                    texels.append(values)
        empty = np.zeros(0, np.dtype(DTYPES[self.kind[2]]))
        return {"places": np.array(places, np.int32), "texels": np.concatenate(texels) if texels else empty}

    def with_arrays(self, device: Device, arrays: Mapping[str, np.ndarray]) -> SavedTiles:
        """A new one of the same kind, holding what `arrays()` gave.

        Raises:
            ValueError: if that is of something else.
        """
        size, components, dtype, side = self.kind
        places, texels = arrays.get("places"), arrays.get("texels")
        regions = list(_regions(size, side))
        if places is None or texels is None or texels.dtype != DTYPES[dtype]:
            raise ValueError("tiles are missing, or of another kind")
        if places.ndim != 1 or ((places < 0) | (places >= len(regions))).any() or (np.diff(places) <= 0).any():
            raise ValueError("tiles lie outside the field")
        shapes = [(regions[place][3], regions[place][2], components) for place in places]
        ends = np.cumsum([np.prod(shape) for shape in shapes], dtype=int)
        if texels.shape != (ends[-1] if len(ends) else 0,):
            raise ValueError("tiles are of another size")
        blank = _Tile(None)
        tiles = np.full(self.tiles.shape, blank)
        for place, shape, values in zip(places, shapes, np.split(texels, ends[:-1]), strict=False):
            tiles.flat[place] = _Tile(device.upload(values.reshape(shape), "saved tile", dtype))
        return _held(SavedTiles(self.kind, tiles))

    def held(self) -> SavedTiles:
        """The same once more, to be released by whoever has it."""
        return _held(self)

    def release(self) -> None:
        """Free the textures that no other save holds."""
        for tile in self.tiles.flat:
            tile.release()


class TiledField(Field):
    """A field that begins as zeros, and of which saves share the tiles that were not drawn into in between.

    Every pass that draws into it, `set`, `clear` and `copy_from` are noticed; who draws in another way calls `drawn`.

    Args:
        tile: texels along a tile; the other arguments are those of `Field`.
    """

    def __init__(
        self,
        device: Device,
        size: tuple[int, int],
        components: int,
        label: str,
        dtype: str = "f4",
        tile: int = TILE,
    ) -> None:
        self.tile = tile
        # What each tile was last saved as or restored from; None where something was drawn since.
        self._same = np.full((-(-size[1] // tile), -(-size[0] // tile)), None, object)
        super().__init__(device, size, components, label, dtype)

    @property
    def kind(self) -> tuple[tuple[int, int], int, str, int]:
        """What a save must have in common with it to be taken back."""
        return self.size, self.components, self.dtype, self.tile

    def drawn(self, region: Region | None = None) -> None:
        if region is None:
            self._same[...] = None
            return
        x, y, width, height = region
        side = self.tile
        self._same[y // side : -(-(y + height) // side), x // side : -(-(x + width) // side)] = None

    def clear(self, *values: float) -> None:
        super().clear(*values)
        if not any(values):
            self._same[...] = _Tile(None)

    def save(self) -> SavedTiles:
        """A copy of this moment, sharing with earlier ones what is the same."""
        for place, (x, y, width, height) in enumerate(_regions(self.size, self.tile)):
            same: _Tile | None = self._same.flat[place]
            if same is None or (same.field is not None and same.holders == 0):
                copy = Field(self.device, (width, height), self.components, f"{self.label}, saved tile", self.dtype)
                self.device.pass_("gl/copy.frag")(copy, field=self, offset=(x, y))
                self._same.flat[place] = _Tile(copy)
        return _held(SavedTiles(self.kind, self._same.copy()))

    def restore(self, saved: SavedTiles) -> list[Region]:
        """Go back to what was saved, exactly; the regions that were another.

        Raises:
            ValueError: if it was saved of another field.
        """
        if saved.kind != self.kind:
            raise ValueError(f"{self.label}: what was saved is of another size or kind")
        changed = list[Region]()
        for place, region in enumerate(_regions(self.size, self.tile)):
            tile, same = saved.tiles.flat[place], self._same.flat[place]
            if tile is same or (same is not None and tile.field is None and same.field is None):
                continue
            if tile.field is None:
                self.framebuffer.clear(viewport=region)
            else:
                self._copy(tile.field, region, (-region[0], -region[1]))
            self._same.flat[place] = tile
            changed.append(region)
        return changed

    def copy_from(self, other: Field, region: Region | None = None) -> None:
        """Take over the texels of `other`, of the same size and components, or those in (x, y, width, height)."""
        self._copy(other, region, (0, 0))

    def take(self, other: TiledField, tiles: Iterable[Region]) -> None:
        """Take over whole tiles of a field of the same kind, and share what they were saved as."""
        for region in tiles:
            self._copy(other, region, (0, 0))
            place = region[1] // self.tile, region[0] // self.tile
            self._same[place] = other._same[place]

    def _copy(self, other: Field, region: Region | None, offset: tuple[int, int]) -> None:
        self.device.pass_("gl/copy.frag")(self, region=region, field=other, offset=offset)


def _held(saved: SavedTiles) -> SavedTiles:
    for tile in saved.tiles.flat:
        tile.holders += 1
    return saved


def _regions(size: tuple[int, int], side: int) -> Iterator[Region]:
    """The tiles of a field by rows."""
    width, height = size
    for y in range(0, height, side):
        for x in range(0, width, side):
            yield x, y, min(side, width - x), min(side, height - y)

"""A large field of which a copy costs no more than what is drawn into it afterwards."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from solver.gl.device import Device
from solver.gl.field import DTYPES, Field
from solver.gl.passes import Region

TILE = 256  # texels along a tile


class Kind(NamedTuple):
    """What a save must have in common with a field to be taken back.

    Attributes:
        size, components, dtype: of the field.
        tile: texels along a tile.
    """

    size: tuple[int, int]
    components: int
    dtype: str
    tile: int

    @property
    def rows_and_columns(self) -> tuple[int, int]:
        """How many tiles there are down and across."""
        return -(-self.size[1] // self.tile), -(-self.size[0] // self.tile)

    @property
    def regions(self) -> list[Region]:
        """The tiles by rows."""
        (width, height), side = self.size, self.tile
        return [
            (x, y, min(side, width - x), min(side, height - y))
            for y in range(0, height, side)
            for x in range(0, width, side)
        ]


class Tile:
    """What one tile was at a moment, shared by all saves that hold it.

    It is copied only when the last field that is still the same there is about to be drawn into, and only if a save
    holds it.

    Args:
        nbytes: of texture memory; 0 of a blank one.
        field: a copy.
    """

    def __init__(self, nbytes: int = 0, field: Field | None = None) -> None:
        self.nbytes = nbytes
        self.field = field
        self.holders = 0  # saves
        self.living = set[TiledField]()  # fields that are the same there

    @property
    def is_blank(self) -> bool:
        return self.nbytes == 0

    def get(self, region: Region) -> np.ndarray:
        """Its texels; `region`: where it is in the fields."""
        return next(iter(self.living)).get(region) if self.field is None else self.field.get()

    def release(self) -> None:
        self.holders -= 1
        if self.holders == 0 and self.field is not None:
            self.field.release()
            self.field = None


@dataclass(frozen=True)
class SavedTiles:
    """What a `TiledField` held at a moment; whoever has it releases it.

    Attributes:
        kind: of the field.
        tiles: its tiles, (rows, columns), each shared with other saves where nothing was drawn in between.
        blank: what all components of a blank tile are.
    """

    kind: Kind
    tiles: np.ndarray
    blank: float

    @classmethod
    def nothing(cls, kind: Kind, blank: float = 0.0) -> SavedTiles:
        """What a field of this kind holds before anything is drawn into it."""
        return _held(cls(kind, np.full(kind.rows_and_columns, Tile()), blank))

    @property
    def is_blank(self) -> bool:
        """True if nothing has been drawn into any tile."""
        return all(tile.is_blank for tile in self.tiles.flat)

    @property
    def textures(self) -> list[Tile]:
        """The tiles that it holds, alone or with others, but blank ones."""
        return [tile for tile in self.tiles.flat if not tile.is_blank]

    def arrays(self) -> dict[str, np.ndarray]:
        """The tiles that are not blank, off the GPU: their `places` (n,), counted by rows, and all `texels` of them."""
        places, texels = list[int](), list[np.ndarray]()
        dtype = np.dtype(DTYPES[self.kind.dtype])
        blank = round(self.blank * np.iinfo(dtype).max) if dtype.kind == "u" else self.blank
        bits = np.array([blank], dtype).view(f"u{dtype.itemsize}")
        for place, (tile, region) in enumerate(zip(self.tiles.flat, self.kind.regions, strict=True)):
            if not tile.is_blank:
                values = tile.get(region).ravel()
                if (values.view(bits.dtype) != bits).any():
                    places.append(place)
                    texels.append(values)
        return {"places": np.array(places, np.int32), "texels": np.concatenate([np.zeros(0, dtype), *texels])}

    def bare(self, places: np.ndarray) -> np.ndarray:
        """Those that something was drawn into, besides these."""
        drawn = np.flatnonzero([not tile.is_blank for tile in self.tiles.flat])
        return np.setdiff1d(drawn, places).astype(np.int32)

    def with_arrays(self, device: Device, arrays: Mapping[str, np.ndarray]) -> SavedTiles:
        """A new one of the same kind, holding what `arrays()` gave; `bare` besides, if it is there.

        Raises:
            ValueError: if that is of something else.
        """
        kind, regions = self.kind, self.kind.regions
        places, texels = arrays.get("places"), arrays.get("texels")
        bare = arrays.get("bare", np.zeros(0, np.int32))
        if places is None or texels is None or texels.dtype != DTYPES[kind.dtype]:
            raise ValueError("tiles are missing, or of another kind")
        for some in (places, bare):
            if some.ndim != 1 or ((some < 0) | (some >= len(regions))).any() or (np.diff(some) <= 0).any():
                raise ValueError("tiles lie outside the field")
        if np.isin(bare, places).any():
            raise ValueError("tiles are there twice")
        shapes = [(regions[place][3], regions[place][2], kind.components) for place in places]
        ends = np.cumsum([np.prod(shape) for shape in shapes], dtype=int)
        if texels.shape != (ends[-1] if len(ends) else 0,):
            raise ValueError("tiles are of another size")
        tiles = np.full(self.tiles.shape, Tile())
        for place, shape, values in zip(places, shapes, np.split(texels, ends[:-1]), strict=False):
            tiles.flat[place] = Tile(values.nbytes, device.upload(values.reshape(shape), "saved tile", kind.dtype))
        for place in bare:
            width, height = regions[place][2:]
            field = Field(device, (width, height), kind.components, "saved tile", kind.dtype, cleared=False)
            field.clear(*[self.blank] * 4)
            tiles.flat[place] = Tile(width * height * kind.components * np.dtype(DTYPES[kind.dtype]).itemsize, field)
        return _held(SavedTiles(kind, tiles, self.blank))

    def held(self) -> SavedTiles:
        """The same once more, to be released by whoever has it."""
        return _held(self)

    def release(self) -> None:
        """Free the textures that no other save holds."""
        for tile in self.tiles.flat:
            tile.release()


class TiledField(Field):
    """A field of which saves share the tiles that were not drawn into in between.

    A save copies nothing: a tile is copied before it is drawn into. Every pass that draws into it, `set`, `clear` and
    `copy_from` tell before they do; who draws in another way calls `before_drawing`.

    Args:
        blank: what all its components are at first, and where `clear` is not told another value.
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
        blank: float = 0.0,
    ) -> None:
        self.kind = Kind(size, components, dtype, tile)
        self.tile = tile
        self.blank = blank
        # What each tile was last saved as or restored from; None where something was drawn since.
        self._same = np.full(self.kind.rows_and_columns, None, object)
        self._pass = device.pass_
        super().__init__(device, size, components, label, dtype)

    @property
    def tiles(self) -> list[Region]:
        """Those that something was drawn into; the others are blank."""
        tiles = zip(self.kind.regions, self._same.flat, strict=True)
        return [region for region, same in tiles if same is None or not same.is_blank]

    def before_drawing(self, region: Region | None = None) -> None:
        x, y, width, height = (0, 0, *self.size) if region is None else region
        side, columns = self.kind.tile, self.kind.rows_and_columns[1]
        for row in range(y // side, -(-(y + height) // side)):
            for column in range(x // side, -(-(x + width) // side)):
                if self._same[row, column] is not None:
                    self._match(row * columns + column, None)

    def clear(self, *values: float) -> None:
        super().clear(*(values or self._blank_values))
        if not values:
            self._same[...] = Tile()

    def save(self) -> SavedTiles:
        """This moment, sharing with earlier ones what is the same."""
        for place, (_, _, width, height) in enumerate(self.kind.regions):
            if self._same.flat[place] is None:
                self._match(place, Tile(width * height * self.components * np.dtype(DTYPES[self.dtype]).itemsize))
        return _held(SavedTiles(self.kind, self._same.copy(), self.blank))

    def restore(self, saved: SavedTiles) -> list[Region]:
        """Go back to what was saved, exactly; the regions that were another.

        Raises:
            ValueError: if it was saved of another field.
        """
        if (saved.kind, saved.blank) != (self.kind, self.blank):
            raise ValueError(f"{self.label}: what was saved is of another size or kind")
        changed = list[Region]()
        for place, region in enumerate(self.kind.regions):
            tile, same = saved.tiles.flat[place], self._same.flat[place]
            if tile is same or (same is not None and tile.is_blank and same.is_blank):
                continue
            if tile.is_blank:
                self.before_drawing(region)
                self.device.use()
                self.framebuffer.clear(*self._blank_values, viewport=region)
                self.device.fences.hold()
            elif tile.field is None:
                self._copy(next(iter(tile.living)), region, (0, 0))
            else:
                self._copy(tile.field, region, (-region[0], -region[1]))
            self._match(place, tile)
            changed.append(region)
        return changed

    def release(self) -> None:
        if not self._is_released:
            self.before_drawing()
        super().release()

    def copy_from(self, other: Field, region: Region | None = None) -> None:
        """Take over the texels of `other`, of the same size and components, or those in (x, y, width, height)."""
        self._copy(other, region, (0, 0))

    def take(self, other: TiledField, tiles: Iterable[Region]) -> None:
        """Take over whole tiles of a field of the same kind, and share what they were saved as."""
        columns = self.kind.rows_and_columns[1]
        for region in tiles:
            self._copy(other, region, (0, 0))
            place = region[1] // self.tile * columns + region[0] // self.tile
            self._match(place, other._same.flat[place])

    def _match(self, place: int, tile: Tile | None) -> None:
        """Note that it is the same as a saved tile at a place, or as none; copy what a save would lose."""
        before: Tile | None = self._same.flat[place]
        if before is not None and self in before.living:
            if before.holders and before.field is None and len(before.living) == 1:
                before.field = self._copy_of(self.kind.regions[place])
            before.living.remove(self)
        self._same.flat[place] = tile
        if tile is not None and not tile.is_blank:
            tile.living.add(self)

    def _copy_of(self, region: Region) -> Field:
        x, y, *size = region
        copy = Field(self.device, (size[0], size[1]), self.components, f"{self.label}, saved tile", self.dtype, False)
        self._pass("gl/copy.frag")(copy, field=self, offset=(x, y))
        return copy

    @property
    def _blank_values(self) -> tuple[float, float, float, float]:
        return self.blank, self.blank, self.blank, self.blank

    def _copy(self, other: Field, region: Region | None, offset: tuple[int, int]) -> None:
        self._pass("gl/copy.frag")(self, region=region, field=other, offset=offset)


def _held(saved: SavedTiles) -> SavedTiles:
    for tile in saved.tiles.flat:
        tile.holders += 1
    return saved

"""A copy of a moment: everything that later steps depend on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.tiled import SavedTiles, Tile, TiledField
from solver.grid import Grid


@dataclass(frozen=True)
class State:
    """A copy of everything that later steps depend on, on the GPU; its owner releases it.

    Attributes:
        fields: the textures by name.
        values: everything else, by name.
        tiles: the saved tiles of tiled fields, by name.
        grid: that it is of, where that is not among the values.
    """

    fields: dict[str, Field]
    values: dict[str, np.ndarray] = field(default_factory=dict)
    tiles: dict[str, SavedTiles] = field(default_factory=dict)
    grid: Grid | None = None

    @classmethod
    def of(cls, device: Device, fields: Mapping[str, Field], **values: object) -> Self:
        """Copy `fields` and `values`; a value that is None is left out."""
        copies, tiles = dict[str, Field](), dict[str, SavedTiles]()
        for name, live in fields.items():
            if isinstance(live, TiledField):
                tiles[name] = live.save()
            else:
                copies[name] = Field(device, live.size, live.components, f"{live.label}, saved", live.dtype, False)
                copies[name].copy_from(live)
        given = {name: np.array(value) for name, value in values.items() if value is not None}
        return cls(copies, given, tiles)

    def write_to(self, fields: Mapping[str, Field]) -> None:
        """Copy the saved textures back into the live ones of the same names.

        Raises:
            ValueError: if they are of another grid or scheme.
        """
        saved = {name: (item.size, item.components, item.dtype) for name, item in self.fields.items()}
        saved |= {name: item.kind for name, item in self.tiles.items()}
        kinds = {
            name: item.kind if isinstance(item, TiledField) else (item.size, item.components, item.dtype)
            for name, item in fields.items()
        }
        if saved != kinds:
            raise ValueError("the state is of another grid or of another scheme")
        for name, live in fields.items():
            if isinstance(live, TiledField):
                live.restore(self.tiles[name])
            else:
                live.copy_from(self.fields[name])

    def arrays(self) -> dict[str, np.ndarray]:
        """Everything in it by name, read back from the GPU; of tiled fields what is not zero."""
        tiles = {f"{name}/{part}": a for name, item in self.tiles.items() for part, a in item.arrays().items()}
        return {name: saved.get() for name, saved in self.fields.items()} | tiles | self.values

    def with_arrays(self, device: Device, arrays: Mapping[str, np.ndarray]) -> State:
        """A state like this one that holds what `arrays()` gave.

        Raises:
            ValueError: if an array is missing or of another size.
        """
        rest, fields, tiles = dict(arrays), dict[str, Field](), dict[str, SavedTiles]()
        made = State(fields, rest, tiles, self.grid)
        try:
            for name, saved in self.fields.items():
                given, now = rest.pop(name, None), saved.get()
                if given is None or (given.shape, given.dtype) != (now.shape, now.dtype):
                    raise ValueError(f"its {name} is missing or of another size")
                fields[name] = device.upload(given, f"{saved.label}, given", saved.dtype)
            for name, saved in self.tiles.items():
                parts = {key.removeprefix(f"{name}/"): rest.pop(key) for key in arrays if key.startswith(f"{name}/")}
                tiles[name] = saved.with_arrays(device, parts)
        except ValueError:
            made.release()
            raise
        return made

    @property
    def textures(self) -> list[Field | Tile]:
        """The textures that it holds, alone or, as tiles of tiled fields, together with other states."""
        return [*self.fields.values(), *(texture for saved in self.tiles.values() for texture in saved.textures)]

    def release(self) -> None:
        """Free the textures that no other state holds."""
        for saved in (*self.fields.values(), *self.tiles.values()):
            saved.release()

"""A warp map at a moment."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from solver.gl.device import Device
from solver.gl.field import DTYPES
from solver.gl.tiled import Kind, SavedTiles
from solver.grid import Grid
from solver.scheme import State

SUBMAPS = {"submap": "grid", "gathered": "gathered grid", "pending": "pending grid"}  # and where their grids are


class MapState(State):
    """The state of a warp map: of its submap and of those that wait, each of a grid, and of its tiles."""

    def with_arrays(self, device: Device, arrays: Mapping[str, np.ndarray]) -> MapState:
        """A state of a map of the same picture, on whatever grid, that holds what `arrays()` gave.

        Raises:
            ValueError: if those were of something else.
        """
        rest, made = dict(arrays), MapState({})
        try:
            for name, place in SUBMAPS.items():
                if name in rest:
                    grid, given = grid_in(arrays, place), rest.pop(name)
                    times = 1 if name == "submap" or given.ndim != 3 else max(given.shape[1] // grid.nx, 1)
                    if (given.shape, given.dtype) != ((grid.ny * times, grid.nx * times, 2), np.float32):
                        raise ValueError(f"its {name} is not of its grid")
                    made.fields[name] = device.upload(given, f"{name}, given")
            if "gathered" in made.fields and "pending" not in made.fields:
                raise ValueError("what its map has gathered waits for nothing")
            tiles = {name: saved for name, saved in self.tiles.items() if name != "frozen"}
            if "frozen kind" in rest:
                tiles["frozen"] = SavedTiles.nothing(_kind_in(arrays))
            for name, saved in tiles.items():
                parts = {key.removeprefix(f"{name}/"): rest.pop(key) for key in arrays if key.startswith(f"{name}/")}
                made.tiles[name] = saved.with_arrays(device, parts)
        except ValueError:
            made.release()
            raise
        made.values.update(rest)
        return made


def kind_values(kind: Kind) -> np.ndarray:
    """The kind of a mask as numbers, for `MapState`, (5,)."""
    return np.array([*kind.size, kind.components, kind.tile, np.dtype(DTYPES[kind.dtype]).num])


def _kind_in(arrays: Mapping[str, np.ndarray]) -> Kind:
    numbers = arrays["frozen kind"]
    dtypes = {np.dtype(dtype).num: name for name, dtype in DTYPES.items()}
    if numbers.shape != (5,) or min(numbers[:4]) < 1 or int(numbers[4]) not in dtypes:
        raise ValueError("its mask is of no kind")
    width, height, components, tile, dtype = numbers.tolist()
    return Kind((width, height), components, dtypes[dtype], tile)


def values_of(grid: Grid) -> np.ndarray:
    """A grid as numbers: cells, extent, origin and picture, (8,) float64."""
    return np.array([*grid.size, *grid.extent, *grid.origin, *grid.picture], np.float64)


def grid_in(values: Mapping[str, np.ndarray], name: str) -> Grid:
    """The grid of which `values_of` gave these.

    Raises:
        ValueError: if they are none.
    """
    numbers = values.get(name)
    if numbers is None or numbers.shape != (8,) or not np.isfinite(numbers).all():
        raise ValueError(f"its {name} is missing")
    nx, ny, *rest = numbers.tolist()
    width, height, left, top, across, down = rest
    return Grid(int(nx), int(ny), (width, height), (left, top), (across, down))

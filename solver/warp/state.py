"""A warp map at a moment."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import pairwise

import numpy as np

from solver.gl.device import Device
from solver.gl.passes import Region
from solver.gl.tiled import TILE, Kind, SavedTiles
from solver.grid import Grid
from solver.state import State

SUBMAPS = {"submap": "grid", "gathered": "gathered grid", "pending": "pending grid"}  # and where their grids are
FACTOR, CLOSED, UNDONE = "factor ", "closed map ", "undone "  # and their numbers
ACCUMULATED = "accumulated map"
SIZES, REGIONS, EDGES = "closed sizes", "closed regions", "closed images"  # and of what is undone beside it
# Closed maps, each with what is undone of those before it counted as one more. With what is undone beside the
# accumulated map, `seek.frag` then reads 16 textures, as many as OpenGL 3.3 promises a stage.
MOST_CLOSED = 8
MOST_CLOSED_BYTES = 2**27  # of them in all
UNDONE_COMPONENTS = 4  # of what is undone: three, and one more as OpenGL 3.3 draws into no texture of three

Images = tuple[float, float, float, float]
"""What lies beyond the left, right, top and bottom side: `images` of `lib/displacement.glsl`."""

OPEN: Images = (0.0, 0.0, 0.0, 0.0)
GLIDING: Images = (1.0, 1.0, 1.0, 1.0)


class MapState(State):
    """The state of a warp map: its submap and those that wait, each of a grid, its factors and its tiles."""

    def arrays(self) -> dict[str, np.ndarray]:
        """As of any state, and which tiles have moved and hold nothing any more: they are closed with the map."""
        arrays = super().arrays()
        for name, saved in self.tiles.items():
            if name == ACCUMULATED or name.startswith(UNDONE):
                bare = saved.bare(arrays[f"{name}/places"])
                arrays |= {f"{name}/bare": bare} if bare.size else {}
        return arrays

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
            size = next(field.size for name, field in self.fields.items() if name.startswith(FACTOR))
            for number in range(sum(name.startswith(FACTOR) for name in arrays)):
                name = f"{FACTOR}{number}"
                given = rest.pop(name, None)
                if given is None or (given.shape, given.dtype) != ((*size[::-1], 2), np.float32):
                    raise ValueError(f"its {name} is missing or of another size")
                made.fields[name] = device.upload(given, f"{name}, given")
            accumulated = self.tiles[ACCUMULATED]
            tiles = {ACCUMULATED: accumulated}
            closed = closed_in(name.removesuffix("/places") for name in arrays if name.endswith("/places"))
            if len(closed) - (closed[-1:] != [] and closed[-1].startswith(UNDONE)) > MOST_CLOSED:
                raise ValueError(f"its map has {len(closed)} closed ones, more than there may be")
            regions_in(arrays, len(closed), accumulated.kind.size)
            for name, size in zip(closed, _sizes(arrays, len(closed), accumulated.kind.size), strict=True):
                components = UNDONE_COMPONENTS if name.startswith(UNDONE) else 2
                tiles[name] = SavedTiles.nothing(accumulated.kind._replace(size=size, components=components))
            for name, kind in held_kinds(accumulated.kind.size).items():
                if f"{name}/places" in rest:
                    tiles[name] = SavedTiles.nothing(kind)
            for name, saved in tiles.items():
                parts = {key.removeprefix(f"{name}/"): rest.pop(key) for key in arrays if key.startswith(f"{name}/")}
                made.tiles[name] = saved.with_arrays(device, parts)
        except ValueError:
            made.release()
            raise
        made.values.update(rest)
        return made


def _sizes(arrays: Mapping[str, np.ndarray], count: int, largest: tuple[int, int]) -> list[tuple[int, int]]:
    """Of so many closed maps, in texels; the largest if they are not told."""
    sizes = arrays.get(SIZES, np.tile(largest, (count, 1)))
    if sizes.shape != (count, 2) or ((sizes < 1) | (sizes > largest)).any():
        raise ValueError("the sizes of its closed maps are missing")
    return [(int(width), int(height)) for width, height in sizes]


def regions_in(values: Mapping[str, np.ndarray], count: int, size: tuple[int, int]) -> list[Region]:
    """The texels of a map of `size` that so many closed ones cover; all of them if they are not told.

    Raises:
        ValueError: if they are none.
    """
    regions = np.asarray(values.get(REGIONS, [(0, 0, *size)] * count)).reshape(-1, 4)
    corners, sides = regions[:, :2], regions[:, 2:]
    if len(regions) != count or (corners < 0).any() or (sides < 1).any() or (corners + sides > size).any():
        raise ValueError("the regions of its closed maps are missing")
    return [(int(x), int(y), int(width), int(height)) for x, y, width, height in regions]


def closed_in(names: Iterable[str]) -> list[str]:
    """Of the names of tiles, those of closed maps and of what is undone before them, in the order of their numbers.

    Raises:
        ValueError: if a number is missing or there twice, or what is undone has no closed map before it.
    """
    found = dict[int, str]()
    for name in names:
        kind = next((kind for kind in (CLOSED, UNDONE) if name.startswith(kind)), None)
        if kind is not None:
            number = name.removeprefix(kind)
            if not number.isdecimal() or found.setdefault(int(number), name) != name:
                raise ValueError(f"its {name} is not one of its closed maps")
    closed = [found.get(number, "") for number in range(len(found))]
    if not all(closed) or any(b.startswith(UNDONE) and not a.startswith(CLOSED) for a, b in pairwise(["", *closed])):
        raise ValueError("its closed maps are not in a row")
    return closed


def held_kinds(size: tuple[int, int]) -> dict[str, Kind]:
    """Of the tiles of `Frozen`, by name, for a map of `size` texels."""
    return {"held": Kind(size, 1, "f1", TILE), "kept": Kind(size, 2, "f4", TILE)}


def images_in(values: Mapping[str, np.ndarray], name: str) -> Images:
    """The images of a map of this name, as saved; one that was saved without any glides.

    Raises:
        ValueError: if they are none.
    """
    return _images(values.get(f"{name} images", np.ones(4)), f"its {name}")


def chain_images_in(values: Mapping[str, np.ndarray], count: int) -> list[Images]:
    """The images of so many closed maps and of what is undone, as saved; without any, the accumulated map's.

    Raises:
        ValueError: if they are none.
    """
    rows = np.asarray(values.get(EDGES, [images_in(values, ACCUMULATED)] * count))
    if len(rows) != count:
        raise ValueError(f"what lies beyond the edges of its {count} closed maps is missing")
    return [_images(row, "its closed maps") for row in rows]


def _images(given: np.ndarray, whose: str) -> Images:
    numbers = np.asarray(given)
    if numbers.shape != (4,) or not np.isin(numbers, (-1.0, 0.0, 1.0)).all():
        raise ValueError(f"what lies beyond the edges of {whose} is missing")
    left, right, top, bottom = numbers.tolist()
    return left, right, top, bottom


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

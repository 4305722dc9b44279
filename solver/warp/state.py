"""A warp map at a moment."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import pairwise

import numpy as np

from solver.gl.device import Device
from solver.gl.tiled import TILE, Kind, SavedTiles
from solver.grid import Grid
from solver.state import State

SUBMAPS = {"submap": "grid", "gathered": "gathered grid", "pending": "pending grid"}  # and where their grids are
FACTOR, CLOSED, UNDONE = "factor ", "closed map ", "undone "  # and their numbers
ACCUMULATED, SIZES, CORNERS = "accumulated map", "closed sizes", "closed corners"
# Closed maps, each with what is undone of those before it counted as one more. With what is undone beside the
# accumulated map, `seek.frag` then reads 16 textures, as many as OpenGL 3.3 promises a stage.
MOST_CLOSED = 8
MOST_CLOSED_BYTES = 2**27  # of them in all
UNDONE_COMPONENTS = 4  # of what is undone: three, and one more as OpenGL 3.3 draws into no texture of three

Images = tuple[float, float, float, float]
"""What lies beyond the left, right, top and bottom side: `images` of `lib/displacement.glsl`."""

Corner = tuple[int, int]
"""The first texel of the accumulated map that a closed one has, if it is a box of it."""

WHOLE: Corner = (-1, -1)  # where a state tells of one all over the picture

OPEN: Images = (0.0, 0.0, 0.0, 0.0)
GLIDING: Images = (1.0, 1.0, 1.0, 1.0)
STICKING: Images = (-1.0, -1.0, -1.0, -1.0)


class MapState(State):
    """The state of a warp map: its submap and those that wait, each of a grid, its factors and its tiles."""

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
            sizes = _sizes(arrays, len(closed), accumulated.kind.size)
            _check_corners(arrays, sizes, accumulated.kind.size)
            for name, size in zip(closed, sizes, strict=True):
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


def _check_corners(arrays: Mapping[str, np.ndarray], sizes: list[tuple[int, int]], largest: tuple[int, int]) -> None:
    """Raise `ValueError` if closed maps of these sizes do not lie in the map where they are told to."""
    corners = corners_in(arrays, len(sizes))
    if any(
        corner is not None and (min(corner) < 0 or (np.add(corner, size) > largest).any())
        for corner, size in zip(corners, sizes, strict=True)
    ):
        raise ValueError("the corners of its closed maps are missing")


def corners_in(values: Mapping[str, np.ndarray], count: int) -> list[Corner | None]:
    """Of so many closed maps, where they begin; None of those all over the picture.

    Raises:
        ValueError: if they are not told of each.
    """
    corners = np.asarray(values.get(CORNERS, np.full((count, 2), WHOLE[0])))
    if corners.shape != (count, 2) or corners.dtype.kind not in "iu":
        raise ValueError("the corners of its closed maps are missing")
    return [None if (x, y) == WHOLE else (x, y) for x, y in corners.tolist()]


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
    numbers = np.asarray(values.get(f"{name} images", np.ones(4)))
    if numbers.shape != (4,) or not np.isin(numbers, (-1.0, 1.0)).all():
        raise ValueError(f"what lies beyond the edges of its {name} is missing")
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

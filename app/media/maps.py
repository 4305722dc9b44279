"""Files of warp maps, a function for each kind: ST maps, pixel offsets, Middlebury .flo and NumPy .npy."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any, Literal

import numpy as np

from app.errors import UserError
from app.media.animation import NumberedWriter, sequence_writer
from app.media.codecs import exr, tiff
from app.media.codecs.decoding import decoding, head_of
from app.media.displacement import (
    Displacement,
    MapError,
    PixelPlaces,
    check_proportions,
    cropped,
    from_offsets,
    from_st,
    to_offsets,
    to_st,
)
from app.media.files import replacing
from app.media.inputs import MAX_PIXELS, cannot_read, check_size, open_input, read_start
from app.media.pictures import read_picture
from app.progress import never

Kind = Literal["st", "offsets"]
"""What an EXR or TIFF holds: absolute places in 0-1 from the bottom left, or pixels from here to there, y up."""

Holds = Literal["map", "picture", "either"]

FLO_MAGIC = np.float32(202021.25)
FLO_UNKNOWN = np.float32(1e10)  # what is written where nothing is known, beyond 1e9 (Middlebury's flowIO.h)
MAP_ENDINGS = (".exr", ".tif", ".tiff", ".flo", ".npy")

# Names of the channels of an EXR that hold a map, whatever layer they are in.
PAIRS = (("R", "G"), ("U", "V"), ("u", "v"), ("X", "Y"))

Check = Callable[[int, int, int], int]
"""What is asked with a map's width, height and overscan as its header tells them; gives the overscan that it has."""

LARGEST = 1e30  # of what is no infinite value: in pixels it is still one of 32 bits

HEAD = 65_536  # bytes at the start of a file in which an EXR or TIFF map says what it is

CONVENTIONS = {
    "st": "ST map: R = u, G = v of the place looked up, 0-1, origin bottom left, pixel centres at (x + .5) / width",
    "offsets": "R = x, G = y offset in pixels to the place looked up, x to the right, y up",
}


def check_map(path: str | os.PathLike[str]) -> None:
    """Raise `UserError` if `path` has no ending of a map."""
    if Path(path).suffix.lower() not in MAP_ENDINGS:
        raise UserError(f"{path}: a map's name must end in one of {' '.join(MAP_ENDINGS)}.")


def holds(path: str | os.PathLike[str]) -> Holds:
    """What a file holds, by its ending and its header: "either" where three channels of floats say nothing about it.

    A file that cannot be read is taken for a picture, or whatever else it turns out to be when it is opened.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in (".exr", ".tif", ".tiff"):
        return "map" if suffix in MAP_ENDINGS else "picture"
    try:
        with open_input(path) as stream:
            head = stream.read(HEAD)
        if any(convention.encode() in head for convention in CONVENTIONS.values()):
            return "map"
        return _exr_holds(path) if suffix == ".exr" else _tiff_holds(path)
    except Exception:  # the decoders raise anything
        return "picture"


def _exr_holds(file: Path) -> Holds:
    names = [name.rpartition(".")[2] for name in exr.channel_names(file)]
    if len(names) == 2 and any(set(pair) == set(names) for pair in PAIRS):
        return "map"
    return "either" if sorted(names) == ["B", "G", "R"] else "picture"


def _tiff_holds(file: Path) -> Holds:
    import tifffile

    with tifffile.TiffFile(file) as tiff:
        page = tiff.pages.first
        if page.dtype is None or page.dtype.kind != "f":
            return "picture"
        alpha = any(extra in (1, 2) for extra in page.extrasamples)
        if page.samplesperpixel == 2 and not alpha:
            return "map"
        return "either" if page.samplesperpixel == 3 else "picture"


def write_map(
    path: str | os.PathLike[str],
    displacement: Displacement,
    kind: Kind = "st",
    whole: Callable[[Path], None] = lambda file: None,
) -> None:
    """Write a map, whole or not at all: .exr and .tif hold `kind` in 32 bits, with the convention in the metadata.

    .flo holds offsets in pixels, y down; .npy the displacement itself, (h, w, 2) float32. Neither tells its overscan,
    so they are cut to the picture. For `whole` see `replacing`. Raises `UserError`.
    """
    check_map(path)
    suffix = Path(path).suffix.lower()
    with replacing(path, whole=whole) as temporary:
        if suffix in (".flo", ".npy"):
            displacement = cropped(displacement)
            with temporary.open("wb") as stream:
                if suffix == ".npy":
                    values = np.ascontiguousarray(displacement.values, np.float32)
                    # not np.save, which on a full disk loses the reason
                    np.lib.format.write_array_header_1_0(stream, np.lib.format.header_data_from_array_1_0(values))
                    stream.write(values.data)
                else:
                    stream.write(FLO_MAGIC.tobytes())
                    stream.write(np.array([displacement.width, displacement.height], np.int32).tobytes())
                    offsets = to_offsets(displacement, up=False)
                    stream.write(np.where(np.isnan(offsets), FLO_UNKNOWN, offsets).data)
            return
        values = to_st(displacement) if kind == "st" else to_offsets(displacement, up=True)
        metadata = {
            "map": kind,
            "grid": "centres",
            "direction": "forward" if displacement.forward else "inverse",
            "overscan": str(displacement.overscan),
        }
        if suffix == ".exr":
            attributes = {f"fluidwarp/{key}": value for key, value in metadata.items()}
            attributes["comments"] = CONVENTIONS[kind]
            channels = {"R": values[..., 0], "G": values[..., 1], "B": _third(values)}
            exr.write_channels(temporary, channels, attributes, displacement.overscan)
        else:
            _write_tiff(temporary, values, {"fluidwarp": metadata, "convention": CONVENTIONS[kind]})


def _third(values: np.ndarray) -> np.ndarray:
    """Ones: Blender's Map UV takes the third channel for the alpha of the result, others ignore it."""
    return np.ones(values.shape[:2], np.float32)


def _write_tiff(temporary: Path, values: np.ndarray, metadata: dict[str, Any]) -> None:
    import tifffile

    tifffile.imwrite(
        temporary,
        np.dstack([values, _third(values)]),
        photometric="rgb",
        compression="zlib",
        predictor=True,
        description=json.dumps(metadata),
        metadata=None,
        software=False,
    )


def map_writer(
    path: str | os.PathLike[str],
    kind: Kind = "st",
    *,
    cancel: Callable[[], bool] = never,
    written: Callable[[int, Path], None] = lambda number, file: None,
    resumed: bool = False,
) -> AbstractContextManager[NumberedWriter[Displacement]]:
    """A context that yields a function appending a map to the sequence `name.%04d.exr`; see `animation_writer`."""
    check_map(path)

    def write_one(file: Path, displacement: Displacement, whole: Callable[[Path], None]) -> None:
        write_map(file, displacement, kind, whole)

    return sequence_writer(path, write_one, cancel, written, resumed)


def read_map(
    path: str | os.PathLike[str],
    *,
    kind: Kind | None = None,
    grid: PixelPlaces | None = None,
    overscan: int | None = None,
    max_pixels: int = MAX_PIXELS,
    picture: tuple[int, int] | None = None,
) -> Displacement:
    """Read a map, also one made elsewhere.

    What is NaN, unknown in a .flo, or not in an EXR's data window is NaN in x and y.

    Args:
        kind, grid: what an EXR or TIFF holds; None believes its metadata, and without any takes it for an ST map on
            pixel centres.
        overscan: None believes the metadata, and is 0 without any.
        picture: the size of the one that it is for.

    Raises:
        UserError: if it is no map, damaged, infinite, or NaN everywhere; and, before its values are read, if it has
            other proportions than the picture.
    """
    check_map(path)
    suffix = Path(path).suffix.lower()

    def check(width: int, height: int, told: int) -> int:
        edge = told if overscan is None else overscan
        if edge < 0 or 2 * edge >= min(width, height):
            named = f"an overscan of {edge}" if overscan is None else f"--overscan {edge}"
            raise UserError(f"Cannot read {path}: {named} leaves nothing of its {width} x {height} pixels.")
        if picture is not None:
            with telling_of(path):
                check_proportions((width - 2 * edge, height - 2 * edge), picture)
        return edge

    read = {".flo": _read_flo, ".npy": _read_npy, ".exr": _read_exr}.get(suffix, _read_tiff)
    values, metadata, edge = read(Path(path), max_pixels, check)
    values = _known(path, values)
    if suffix == ".npy":
        return Displacement(values, edge)
    if suffix == ".flo":
        return from_offsets(values, up=False, overscan=edge)
    if (kind or metadata.get("map", "st")) == "offsets":
        read = from_offsets(values, up=True, overscan=edge)
    else:
        named = grid or metadata.get("grid", "centres")
        read = from_st(values, named if named in ("corners", "pixels") else "centres", edge)
    return Displacement(read.values, edge, forward=metadata.get("direction") == "forward")


@contextmanager
def telling_of(path: str | os.PathLike[str]) -> Iterator[None]:
    """Let the `UserError` that is made of a `MapError` of the block name the map's file."""
    try:
        yield
    except MapError as error:
        raise UserError(f"Cannot use {path}: {error}.") from None


def _known(path: str | os.PathLike[str], values: np.ndarray) -> np.ndarray:
    """The values, both NaN where one is; raises `UserError` for infinite ones, or if none is left.

    Those of 16 bits become ones of 32: in half precision `LARGEST` is infinite, and much of what is computed.
    """
    values = values.astype(np.float32) if values.dtype.itemsize < 4 else values
    bad = (np.abs(values) > LARGEST).any(axis=2)
    if bad.any():
        row, column = np.argwhere(bad)[0]
        raise UserError(
            f"Cannot use {path}: {int(bad.sum())} of its pixels are infinite, "
            f"the first at x {column}, y {row}; fill them where the map was made."
        )
    nowhere = np.asarray(np.isnan(values).any(axis=2))
    if nowhere.all():
        raise UserError(f"Cannot use {path}: all of it is NaN or outside of its picture; make it again.")
    return np.where(nowhere[..., None], values.dtype.type(np.nan), values) if nowhere.any() else values


def _read_flo(file: Path, max_pixels: int, check: Check) -> tuple[np.ndarray, dict[str, str], int]:
    head = read_start(file, "map", 12)
    with open_input(file, "map") as stream:
        stream.seek(len(head))
        width, height = (int(side) for side in np.frombuffer(head[4:12].ljust(8, b"\0"), "<i4"))
        if len(head) < 12 or np.frombuffer(head[:4], "<f4")[0] != FLO_MAGIC or min(width, height) < 1:
            raise UserError(f"Cannot read {file}: it is not a Middlebury .flo file; get it again.")
        check_size(file, width, height, max_pixels)
        if os.fstat(stream.fileno()).st_size != 12 + width * height * 8:
            raise UserError(
                f"Cannot read {file}: {width} x {height} offsets do not fit the length of the file; get it again."
            )
        edge = check(width, height, 0)
        offsets = _in_memory(file, lambda: np.fromfile(stream, "<f4", 2 * width * height)).reshape(height, width, 2)
    unknown = (np.abs(offsets) > FLO_UNKNOWN / 10).any(axis=2, keepdims=True)
    return np.where(unknown, np.float32(np.nan), offsets), {}, edge


def _read_npy(file: Path, max_pixels: int, check: Check) -> tuple[np.ndarray, dict[str, str], int]:
    with open_input(file, "map") as stream:
        try:
            headers = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
            shape, _, kind = headers[np.lib.format.read_magic(stream)](stream)
            if any(isinstance(side, bool) for side in shape):  # Python's whole numbers, but not NumPy's
                raise ValueError(f"its shape is {shape}")
        except Exception as error:  # its header is read by Python's own tokenizer, which raises anything
            raise UserError(f"Cannot read {file}: it is not a NumPy array, or damaged; get it again.") from error
        if len(shape) != 3 or shape[2] != 2 or kind.kind != "f":
            raise UserError(
                f"Cannot read {file}: a map is a float array (height, width, 2), this one is {kind} {shape}."
            )
        if min(shape) < 1:
            raise UserError(f"Cannot read {file}: the array {shape} is empty; make it again.")
        check_size(file, shape[1], shape[0], max_pixels)
        if os.fstat(stream.fileno()).st_size < stream.tell() + math.prod(shape) * kind.itemsize:
            raise UserError(f"Cannot read {file}: it is truncated; get it again.")
        edge = check(shape[1], shape[0], 0)
        stream.seek(0)
        values = _in_memory(file, lambda: np.load(stream, allow_pickle=False))
        return np.ascontiguousarray(values), {}, edge  # also one of Fortran's order


def _in_memory(file: Path, read: Callable[[], np.ndarray]) -> np.ndarray:
    try:
        return read()
    except MemoryError:
        raise UserError(
            f"Cannot read {file}: it does not fit into the memory; close other programs, or make it smaller first."
        ) from None
    except OSError as error:
        raise cannot_read(file, error) from None


def _read_exr(file: Path, max_pixels: int, check: Check) -> tuple[np.ndarray, dict[str, str], int]:
    edge = 0

    def check_header(header: Mapping[str, Any]) -> None:
        nonlocal edge
        edge = check(*_shown(header))

    channels, header = exr.read_channels(file, max_pixels, check_header)
    for x, y in PAIRS:
        found = {key.rpartition(".")[2]: plane for key, plane in reversed(channels.items())}
        if x in found and y in found:
            values = np.stack([found[x], found[y]], axis=-1)
            break
    else:
        raise UserError(f"Cannot read {file}: its channels {' '.join(channels)} are not a map; it needs R and G.")
    metadata = {key.removeprefix("fluidwarp/"): value for key, value in header.items() if key.startswith("fluidwarp/")}
    (left, top), (first_x, first_y) = (tuple(map(int, header[name][0])) for name in ("dataWindow", "displayWindow"))
    width, height, around = _shown(header)
    shown = np.full((height, width, 2), np.nan, np.float32)
    exr.place_window(values, (left - first_x + around, top - first_y + around), shown)
    return shown, metadata, edge


def _shown(header: Mapping[str, Any]) -> tuple[int, int, int]:
    """The width and height of what is read of an EXR, and as much overscan as all four sides have."""
    (left, top), (right, bottom) = ((int(x), int(y)) for x, y in header["dataWindow"])
    (first_x, first_y), (last_x, last_y) = ((int(x), int(y)) for x, y in header["displayWindow"])
    edge = max(0, min(first_x - left, first_y - top, right - last_x, bottom - last_y))
    return last_x - first_x + 1 + 2 * edge, last_y - first_y + 1 + 2 * edge, edge


def _read_tiff(file: Path, max_pixels: int, check: Check) -> tuple[np.ndarray, dict[str, str], int]:
    head_of(file)
    with decoding(file, "TIFF"):
        width, height, description = tiff.head(file, max_pixels)
    metadata: dict[str, str] = {}
    try:
        metadata = json.loads(description)["fluidwarp"]
        edge = int(metadata["overscan"])
    except (ValueError, TypeError, KeyError, OverflowError, RecursionError):  # made elsewhere
        edge = 0
    edge = check(width, height, edge)
    pixels = read_picture(file, max_pixels).pixels
    if pixels.shape[2] < 2 or pixels.dtype == np.uint8:
        raise UserError(f"Cannot read {file}: a map needs two channels of 16 or 32 bits; write it as 32-bit float.")
    values = pixels[..., :2] if pixels.dtype == np.float32 else pixels[..., :2] / np.float64(65535)
    return values, metadata, edge

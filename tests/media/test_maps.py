"""Maps: what is written is what other programs read, every format back again, and maps that must be refused."""

from __future__ import annotations

import json
import os
import resource
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import tifffile
from scipy import ndimage

from app.errors import UserError
from app.media import files
from app.media.codecs.exr import read_channels
from app.media.displacement import (
    Displacement,
    MapError,
    PixelPlaces,
    cropped,
    folds,
    from_offsets,
    from_st,
    is_beside,
    to_offsets,
    to_st,
)
from app.media.maps import Kind, holds, map_writer, read_map, write_map
from app.media.pictures import write_picture
from app.model.picture import Picture

ROOT = Path(__file__).parents[2]
SIZES = [(48, 64), (64, 48), (33, 33), (1, 7)]


def swirl(height: int, width: int, overscan: int = 0) -> Displacement:
    """A smooth displacement, in longer sides, float32."""
    longest = max(height, width)
    y, x = (np.mgrid[-overscan : height + overscan, -overscan : width + overscan] + 0.5) / longest
    values = np.stack([0.1 * np.sin(5 * y + 1), 0.07 * np.cos(4 * x) - 0.03], axis=-1)
    return Displacement(values.astype(np.float32), overscan)


def identity(height: int, width: int) -> Displacement:
    return Displacement(np.zeros((height, width, 2), np.float32))


READING = """
import resource, sys
from pathlib import Path
from app.errors import UserError
from app.media.maps import read_map
in_use = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (in_use + 2**30, resource.getrlimit(resource.RLIMIT_AS)[1]))
try:
    read_map(Path(sys.argv[1]), max_pixels=2**40)
except UserError as error:
    print(error)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the address space is asked of Linux")
@pytest.mark.parametrize("ending", [".npy", ".flo"])
def test_a_map_that_does_not_fit_into_the_memory_is_told_by_its_name(tmp_path: Path, ending: str):
    """Of 4 GiB, none of which is on the disk, where one more is left to a process of its own."""
    file, rows, columns = tmp_path / f"large{ending}", 2**14, 2**15
    with file.open("wb") as stream:
        if ending == ".npy":
            about = {"descr": "<f4", "fortran_order": False, "shape": (rows, columns, 2)}
            np.lib.format.write_array_header_1_0(stream, about)
        else:
            stream.write(struct.pack("<fii", 202021.25, columns, rows))
        stream.truncate(stream.tell() + 8 * rows * columns)
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    ran = subprocess.run(
        [sys.executable, "-c", READING, file], capture_output=True, text=True, env=environment, timeout=300
    )
    told = f"Cannot read {file}: it does not fit into the memory; close other programs, or make it smaller first."
    assert (ran.returncode, ran.stdout) == (0, f"{told}\n"), ran.stderr


# What the files hold ------------------------------------------------------------------------------------------------


def test_the_identity_st_map_is_the_one_of_the_convention(tmp_path: Path):
    write_map(tmp_path / "a.exr", identity(6, 10))
    channels, header = read_channels(tmp_path / "a.exr")
    np.testing.assert_array_equal(channels["R"][0], ((np.arange(10) + 0.5) / 10).astype(np.float32))
    assert channels["G"][0, 0] == np.float32((6 - 0.5) / 6)  # the top row: the origin is at the bottom
    assert channels["G"][-1, 0] == np.float32(0.5 / 6)
    assert (channels["B"] == 1).all()
    assert channels["R"].dtype == np.float32
    assert (header["fluidwarp/map"], header["fluidwarp/grid"], header["fluidwarp/direction"]) == (
        "st",
        "centres",
        "inverse",
    )
    assert "origin bottom left" in header["comments"]


def test_a_shift_points_where_it_should(tmp_path: Path):
    """Looking 2 pixels to the right and 1 down, in every format's own terms."""
    shift = Displacement(np.full((4, 8, 2), (2 / 8, 1 / 8), np.float32))
    st = to_st(shift)
    np.testing.assert_allclose(st[0, 0], [2.5 / 8, 1 - 1.5 / 4], atol=1e-7)
    assert to_offsets(shift, up=False)[0, 0].tolist() == [2, 1]
    assert to_offsets(shift, up=True)[0, 0].tolist() == [2, -1]
    write_map(tmp_path / "a.flo", shift)
    data = (tmp_path / "a.flo").read_bytes()
    assert struct.unpack("<fii", data[:12]) == (pytest.approx(202021.25), 8, 4)
    assert struct.unpack("<ff", data[12:20]) == (2, 1)
    write_map(tmp_path / "a.npy", shift)
    np.testing.assert_array_equal(np.load(tmp_path / "a.npy"), shift.values)


def test_opencv_reads_flo_and_tiff(tmp_path: Path):
    map_ = swirl(20, 30)
    write_map(tmp_path / "a.flo", map_)
    np.testing.assert_array_equal(cv2.readOpticalFlow(str(tmp_path / "a.flo")), to_offsets(map_, up=False))
    expectations: dict[Kind, np.ndarray] = {"st": to_st(map_), "offsets": to_offsets(map_, up=True)}
    for kind, expected in expectations.items():
        write_map(tmp_path / "a.tif", map_, kind)
        image = cv2.imread(str(tmp_path / "a.tif"), cv2.IMREAD_UNCHANGED)
        assert image is not None
        np.testing.assert_array_equal(image[..., [2, 1]], expected)
        with tifffile.TiffFile(tmp_path / "a.tif") as tiff:
            told = json.loads(tiff.pages.first.description)
        assert told["fluidwarp"]["map"] == kind


def test_opencv_warps_by_the_st_map_as_the_displacement_says(tmp_path: Path):
    map_ = swirl(48, 64)
    y, x = np.mgrid[0:48, 0:64].astype(np.float32)
    picture = 100 + x + 2 * y  # bilinear sampling of a plane is exact
    write_map(tmp_path / "a.tif", map_)
    st = tifffile.imread(tmp_path / "a.tif")
    looked_up = cv2.remap(picture, st[..., 0] * 64 - 0.5, (1 - st[..., 1]) * 48 - 0.5, cv2.INTER_LINEAR)
    expected = 100 + x + 64 * map_.values[..., 0] + 2 * (y + 64 * map_.values[..., 1])
    np.testing.assert_allclose(looked_up[12:-12, 12:-12], expected[12:-12, 12:-12], atol=0.1)


# There and back -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize(
    ("ending", "kind"),
    [(".exr", "st"), (".exr", "offsets"), (".tif", "st"), (".tif", "offsets"), (".flo", "st"), (".npy", "st")],
)
def test_maps_come_back(tmp_path: Path, ending: str, kind: Kind, size: tuple[int, int]):
    map_ = swirl(*size)
    first, second = tmp_path / f"a{ending}", tmp_path / f"b{ending}"
    write_map(first, map_, kind)
    read = read_map(first)
    assert (read.width, read.height, read.forward) == (size[1], size[0], False)
    # an absolute place in float32 knows a displacement to 2^-25, in fractions of the sides
    np.testing.assert_allclose(read.values, map_.values, atol=6.1e-8)
    write_map(second, read, kind)
    assert second.read_bytes() == first.read_bytes()


def test_st_values_are_exact_to_the_last_bit(tmp_path: Path):
    """Any float32 place survives: file, displacement, another format, and back."""
    random = np.random.default_rng(0)
    st = random.uniform(-0.5, 1.5, (40, 56, 2)).astype(np.float32)
    st[:5] = 0  # as programs leave what they do not know
    st[5:8] = 1
    np.testing.assert_array_equal(to_st(from_st(st)), st)
    tifffile.imwrite(tmp_path / "a.tif", np.dstack([st, st[..., :1]]), photometric="rgb")
    write_map(tmp_path / "b.exr", read_map(tmp_path / "a.tif"))
    write_map(tmp_path / "c.tiff", read_map(tmp_path / "b.exr"))
    channels, _ = read_channels(tmp_path / "b.exr")
    np.testing.assert_array_equal(np.stack([channels["R"], channels["G"]], -1), st)
    np.testing.assert_array_equal(tifffile.imread(tmp_path / "c.tiff")[..., :2], st)


def test_converting_between_all_formats_keeps_the_map(tmp_path: Path):
    map_ = swirl(30, 20)
    path = tmp_path / "0.npy"
    write_map(path, map_)
    steps: list[tuple[str, Kind]] = [
        (".exr", "st"),
        (".flo", "st"),
        (".tif", "offsets"),
        (".exr", "offsets"),
        (".tif", "st"),
        (".npy", "st"),
    ]
    for index, (ending, kind) in enumerate(steps):
        following = tmp_path / f"{index + 1}{ending}"
        write_map(following, read_map(path), kind)
        path = following
    np.testing.assert_allclose(read_map(path).values, map_.values, atol=3e-7)


@pytest.mark.parametrize("grid", ["centres", "corners", "pixels"])
def test_the_three_grids_all_mean_nothing_happens(tmp_path: Path, grid: PixelPlaces):
    height, width = 6, 9
    steps = {
        "centres": lambda n: (np.arange(n) + 0.5) / n,
        "corners": lambda n: np.arange(n) / (n - 1),
        "pixels": lambda n: np.arange(n) / n,
    }[grid]
    u, v = np.meshgrid(steps(width), steps(height)[::-1])
    tifffile.imwrite(tmp_path / "a.tif", np.dstack([u, v, u]).astype(np.float32), photometric="rgb")
    np.testing.assert_allclose(read_map(tmp_path / "a.tif", grid=grid).values, 0, atol=2e-7)
    shifted = np.dstack([u + (steps(width)[1] - steps(width)[0]), v]).astype(np.float32)
    np.testing.assert_allclose(from_st(shifted, grid).values[..., 0], 1 / 9, atol=2e-7)


@pytest.mark.parametrize("ending", [".exr", ".tif"])
@pytest.mark.parametrize("kind", ["st", "offsets"])
def test_overscan_and_direction_are_kept(tmp_path: Path, ending: str, kind: Kind):
    map_ = Displacement(swirl(20, 30, overscan=4).values, 4, forward=True)
    write_map(tmp_path / f"a{ending}", map_, kind)
    read = read_map(tmp_path / f"a{ending}")
    assert (read.width, read.height, read.overscan, read.forward) == (30, 20, 4, True)
    np.testing.assert_allclose(read.values, map_.values, atol=1.3e-7)
    if ending == ".exr":
        _, header = read_channels(tmp_path / "a.exr")
        assert [corner.tolist() for corner in header["displayWindow"]] == [[0, 0], [29, 19]]
        assert [corner.tolist() for corner in header["dataWindow"]] == [[-4, -4], [33, 23]]
    write_map(tmp_path / "a.flo", map_)
    inner = read_map(tmp_path / "a.flo")
    np.testing.assert_allclose(inner.values, map_.values[4:-4, 4:-4], atol=1e-7)


def test_maps_made_elsewhere(tmp_path: Path):
    import OpenEXR

    map_ = swirl(20, 30)
    st = to_st(map_)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    for x, y in (("U", "V"), ("uv.R", "uv.G"), ("forward.u", "forward.v")):
        OpenEXR.File(header, {x: st[..., 0].copy(), y: st[..., 1].copy()}).write(str(tmp_path / "a.exr"))
        np.testing.assert_allclose(read_map(tmp_path / "a.exr").values, map_.values, atol=6.1e-8)
    parts = [
        OpenEXR.Part(header | {"name": name}, {"R": s.copy(), "G": t.copy()})
        for name, (s, t) in {"st": (st[..., 0], st[..., 1]), "other": (st[..., 1], st[..., 0])}.items()
    ]
    OpenEXR.File(parts).write(str(tmp_path / "parts.exr"))
    np.testing.assert_allclose(read_map(tmp_path / "parts.exr").values, map_.values, atol=6.1e-8)
    write_picture(
        tmp_path / "a.tif", Picture(np.round(np.dstack([st, st[..., :1]]).clip(0, 1) * 65535).astype(np.uint16))
    )
    inside = ((st > 0) & (st < 1)).all(axis=2)
    np.testing.assert_allclose(read_map(tmp_path / "a.tif").values[inside], map_.values[inside], atol=1e-5)
    offsets = to_offsets(map_, up=True)
    tifffile.imwrite(tmp_path / "b.tif", np.dstack([offsets, offsets[..., :1]]), photometric="rgb")
    np.testing.assert_allclose(read_map(tmp_path / "b.tif", kind="offsets").values, map_.values, atol=1e-7)


def test_a_map_sequence(tmp_path: Path):
    with map_writer(tmp_path / "m.%03d.exr") as write:
        for number, amount in enumerate((0.0, 0.5, 1.0), 7):
            write(Displacement(swirl(8, 8).values * np.float32(amount)), number)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["m.007.exr", "m.008.exr", "m.009.exr"]
    np.testing.assert_allclose(read_map(tmp_path / "m.009.exr").values, swirl(8, 8).values, atol=6.1e-8)


def test_fitting_to_a_picture():
    map_ = swirl(48, 64)
    assert map_.fitted(4000, 3000).values is map_.values
    # 1000 x 667 laid on 512 x 342: a rounding of the sides changes the longer side's measure by as little
    fitted = swirl(342, 512).fitted(1000, 667)
    np.testing.assert_allclose(fitted.values, swirl(342, 512).values, rtol=2e-3)
    with pytest.raises(MapError, match=r"it is 64 x 48 and the picture 800 x 800, .* same proportions"):
        map_.fitted(800, 800)
    with pytest.raises(MapError, match="same proportions"):
        map_.fitted(48, 64)


@pytest.mark.parametrize("ending", [".exr", ".tif", ".flo", ".npy"])
def test_a_map_of_other_proportions_is_refused_by_its_header(tmp_path: Path, ending: str):
    """Its values, which may be 400 million, are not read for that: these would be refused, too."""
    path = tmp_path / f"m{ending}"
    write_map(path, Displacement(np.full((32, 64, 2), np.inf, np.float32)))
    with pytest.raises(UserError, match=rf"Cannot use .*/m\{ending}: it is 64 x 32 and the picture 30 x 30, and they"):
        read_map(path, picture=(30, 30))
    with pytest.raises(UserError, match=r"it is 44 x 12 and the picture 640 x 320, "):
        read_map(path, picture=(640, 320), overscan=10)
    with pytest.raises(UserError, match=r"infinite|all of it is NaN"):
        read_map(path, picture=(640, 320))


@pytest.mark.parametrize("orientation", range(1, 9))
def test_a_tiff_map_is_for_the_picture_it_is_turned_to(tmp_path: Path, orientation: int):
    (lying, standing), size = ((12, 16), (16, 12)), (6, 8)
    if orientation > 4:  # on its side
        lying, standing, size = standing, lying, size[::-1]
    tag = (274, "H", 1, orientation, True)
    tifffile.imwrite(tmp_path / "m.tif", np.full((8, 6, 3), 0.5, np.float32), photometric="rgb", extratags=[tag])
    assert read_map(tmp_path / "m.tif", picture=lying).width == size[0]
    with pytest.raises(UserError, match=f"it is {size[0]} x {size[1]} and the picture {standing[0]} x {standing[1]}"):
        read_map(tmp_path / "m.tif", picture=standing)


def test_a_picture_of_another_kind_with_the_ending_of_a_tiff_is_told(tmp_path: Path):
    write_picture(tmp_path / "a.png", Picture(np.zeros((8, 8, 3), np.uint16)))
    (tmp_path / "a.png").rename(tmp_path / "m.tif")
    with pytest.raises(UserError, match=r"Cannot read .*/m\.tif: the TIFF file is .* damaged \(not a TIFF file"):
        read_map(tmp_path / "m.tif")


# What must be refused -----------------------------------------------------------------------------------------------


def test_a_map_fitted_to_other_proportions_keeps_its_fractions():
    """200 x 100 is, but for rounding, as 202 x 100 is not: half of the height stays half of the height."""
    fitted = Displacement(np.full((50, 100, 2), 0.25)).fitted(202, 100)
    np.testing.assert_allclose(fitted.values[..., 0], 0.25)
    np.testing.assert_allclose(fitted.values[..., 1], 0.5 * 100 / 202)


@pytest.mark.parametrize("ending", [".exr", ".tif", ".npy"])
def test_infinite_places_are_refused(tmp_path: Path, ending: str):
    map_ = swirl(8, 9)
    map_.values[3, 5] = np.nan
    map_.values[4, 6, 0] = np.inf
    write_map(tmp_path / f"a{ending}", map_)
    with pytest.raises(UserError, match=r"1 of its pixels are infinite, the first at x 6, y 4"):
        read_map(tmp_path / f"a{ending}")


def test_an_array_of_fortrans_order_is_a_map_as_any(tmp_path: Path) -> None:
    values = np.random.default_rng(0).random((5, 7, 2), np.float32) / 8
    np.save(tmp_path / "a.npy", np.asfortranarray(values))
    write_map(tmp_path / "b.flo", read_map(tmp_path / "a.npy"))
    np.testing.assert_allclose(read_map(tmp_path / "b.flo").values, values, atol=1e-6)


def test_values_that_are_infinite_in_32_bits_are_refused(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.full((5, 7, 2), 1e300))
    with pytest.raises(UserError, match=r"35 of its pixels are infinite, the first at x 0, y 0"):
        read_map(tmp_path / "a.npy")


@pytest.mark.parametrize("order", ["<", ">"])
def test_an_array_of_16_bits_is_a_map_as_any(tmp_path: Path, order: str) -> None:
    """What is infinite in it is refused as in another, and what is made of it is made in 32 bits."""
    values = np.full((5, 7, 2), 300.0, f"{order}f2")
    np.save(tmp_path / "a.npy", values)
    read = read_map(tmp_path / "a.npy")
    np.testing.assert_array_equal(read.values, values)
    assert np.isfinite(read.values * 300).all()
    values[2, 3] = np.inf
    np.save(tmp_path / "a.npy", values)
    with pytest.raises(UserError, match=r"1 of its pixels are infinite, the first at x 3, y 2"):
        read_map(tmp_path / "a.npy")


@pytest.mark.parametrize("ending", [".exr", ".tif", ".flo", ".npy"])
def test_nan_is_kept(tmp_path: Path, ending: str):
    map_ = swirl(8, 9)
    map_.values[3, 5] = np.nan
    map_.values[4, 6, 0] = np.nan
    write_map(tmp_path / f"a{ending}", map_)
    read = read_map(tmp_path / f"a{ending}").values
    assert np.argwhere(np.isnan(read)).tolist() == [[3, 5, 0], [3, 5, 1], [4, 6, 0], [4, 6, 1]]
    write_map(tmp_path / f"none{ending}", Displacement(np.full((8, 9, 2), np.nan, np.float32)))
    with pytest.raises(UserError, match="all of it is NaN"):
        read_map(tmp_path / f"none{ending}")


def test_a_flo_of_middlebury_has_what_is_unknown(tmp_path: Path):
    """As their flowIO.h marks it: a component beyond 1e9, as a rule both 1e10."""
    values = np.zeros((6, 7, 2), np.float32)
    values[2, 3] = 1e10
    header = np.float32(202021.25).tobytes() + np.array([7, 6], np.int32).tobytes()
    (tmp_path / "a.flo").write_bytes(header + values.tobytes())
    assert np.argwhere(np.isnan(read_map(tmp_path / "a.flo").values[..., 0])).tolist() == [[2, 3]]
    write_map(tmp_path / "b.flo", read_map(tmp_path / "a.flo"))
    assert (tmp_path / "b.flo").read_bytes() == (tmp_path / "a.flo").read_bytes()


@pytest.mark.parametrize(
    "cut", [(2, 0, 0, 0), (0, 3, 0, 0), (0, 0, 1, 0), (0, 0, 0, 2), (1, 2, -3, 4), (-2, -2, -2, -2)]
)
def test_an_exr_map_cropped_on_any_side(tmp_path: Path, cut: tuple[int, int, int, int]):
    """Its data window within the display window on the left, at the top, on the right or below, or beyond it."""
    import OpenEXR

    width, height = 16, 12
    y, x = np.mgrid[-4 : height + 4, -4 : width + 4]
    u, v = (x + 0.5) / width + 0.01 * y, 1 - (y + 0.5) / height
    left, top, right, bottom = cut
    data = slice(4 + top, 4 + height - bottom), slice(4 + left, 4 + width - right)
    header = {
        "type": OpenEXR.scanlineimage,
        "displayWindow": (np.array([0, 0], np.int32), np.array([width - 1, height - 1], np.int32)),
        "dataWindow": (np.array([left, top], np.int32), np.array([width - 1 - right, height - 1 - bottom], np.int32)),
    }
    channels = {name: np.ascontiguousarray(plane[data], np.float32) for name, plane in (("R", u), ("G", v))}
    OpenEXR.File(header, channels).write(str(tmp_path / "a.exr"))
    read = read_map(tmp_path / "a.exr")
    edge = 2 if cut == (-2, -2, -2, -2) else 0
    assert (read.width, read.height, read.overscan) == (width, height, edge)
    there = np.zeros((height, width), bool)
    there[max(0, top) : height - max(0, bottom), max(0, left) : width - max(0, right)] = True
    inner = cropped(read).values
    assert (np.isnan(inner).any(axis=2) == ~there).all()
    np.testing.assert_allclose((inner[..., 0] * width)[there], (0.01 * width * y[4:-4, 4:-4])[there], atol=1e-5)


@pytest.mark.parametrize("ending", [".exr", ".tif", ".flo", ".npy"])
@pytest.mark.parametrize("damage", ["missing", "empty", "junk", "cut", "folder"])
def test_damaged_maps(tmp_path: Path, ending: str, damage: str):
    path = tmp_path / f"a{ending}"
    write_map(path, swirl(30, 40))
    whole = path.read_bytes()
    path.unlink()
    if damage == "folder":
        path.mkdir()
    elif damage != "missing":
        path.write_bytes({"empty": b"", "junk": b"junk" * 50, "cut": whole[: len(whole) // 2]}[damage])
    with pytest.raises(UserError, match=f"a{ending}") as raised:
        read_map(path)
    assert "\n" not in str(raised.value)
    said = str(raised.value).removeprefix(f"Cannot read {path}: ")
    by_ending = {".flo": "it is not a Middlebury .flo file", ".npy": "it is not a NumPy array, or damaged"}
    words = {
        "missing": "there is no such file",
        "empty": by_ending.get(ending, "the file is empty"),
        "junk": by_ending.get(ending, "file is truncated or damaged"),
        "cut": {".flo": "40 x 30 offsets do not fit the length of the file"}.get(ending, "truncated"),
        "folder": "it is a folder",
    }
    assert words[damage] in said


def test_a_flo_file_without_pixels_is_none(tmp_path: Path):
    for sides in ((0, 3), (3, 0), (-2, 3), (3, -2)):
        (tmp_path / "a.flo").write_bytes(b"PIEH" + np.array(sides, "<i4").tobytes())
        with pytest.raises(UserError, match=r"it is not a Middlebury \.flo file"):
            read_map(tmp_path / "a.flo")


def test_what_is_no_map(tmp_path: Path):
    with pytest.raises(UserError, match=r"a map's name must end in one of \.exr \.tif \.tiff \.flo \.npy\.$"):
        read_map(tmp_path / "a.jpg")
    with pytest.raises(UserError, match="a map's name must end in one of"):
        write_map(tmp_path / "a.png", identity(4, 4))
    write_picture(tmp_path / "a.tif", Picture(np.zeros((4, 4, 3), np.uint8)))
    with pytest.raises(UserError, match="two channels of 16 or 32 bits"):
        read_map(tmp_path / "a.tif")
    write_picture(tmp_path / "a.exr", Picture(np.zeros((4, 4, 1), np.float32)))
    with pytest.raises(UserError, match="its channels Y are not a map"):
        read_map(tmp_path / "a.exr")
    np.save(tmp_path / "a.npy", np.zeros((4, 4, 3), np.float32))
    with pytest.raises(
        UserError, match=r"a map is a float array \(height, width, 2\), this one is float32 \(4, 4, 3\)"
    ):
        read_map(tmp_path / "a.npy")
    np.save(tmp_path / "a.npy", np.zeros((4, 4, 2), np.int32))
    with pytest.raises(UserError, match=r"this one is int32 \(4, 4, 2\)"):
        read_map(tmp_path / "a.npy")
    np.save(tmp_path / "a.npy", np.array([{}]), allow_pickle=True)
    with pytest.raises(UserError, match=r"this one is object \(1,\)"):
        read_map(tmp_path / "a.npy")
    header = b"{'descr': '<f4', 'fortran_order': False, 'shape': (True, 4, 2)}\n"
    (tmp_path / "a.npy").write_bytes(b"\x93NUMPY\1\0" + len(header).to_bytes(2, "little") + header + bytes(32))
    with pytest.raises(UserError, match=r"it is not a NumPy array, or damaged; get it again\.$"):
        read_map(tmp_path / "a.npy")
    with pytest.raises(UserError, match=r"b\.npy: there is no such file; check the name\.$"):
        read_map(tmp_path / "b.npy")
    write_map(tmp_path / "b.tif", identity(8, 8))
    with pytest.raises(UserError, match="--overscan 4 leaves nothing of its"):
        read_map(tmp_path / "b.tif", overscan=4)
    for name in ("b.tif", "b.exr", "b.flo", "b.npy"):
        write_map(tmp_path / name, identity(8, 8))
        with pytest.raises(UserError, match="more than the limit of 10"):
            read_map(tmp_path / name, max_pixels=10)


@pytest.mark.parametrize("ending", [".exr", ".tif", ".flo", ".npy"])
def test_a_full_disk_leaves_the_earlier_map(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ending: str):
    path = tmp_path / f"a{ending}"
    write_map(path, swirl(8, 8))
    before = path.read_bytes()

    def link(path: Path) -> Path:
        temporary = path.with_name(f".full{path.suffix}")
        temporary.symlink_to("/dev/full")
        return temporary

    monkeypatch.setattr(files, "temporary_beside", link)
    with pytest.raises(UserError, match="the disk is full"):
        write_map(path, swirl(80, 80))
    assert path.read_bytes() == before
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize("ending", [".exr", ".tif", ".flo", ".npy"])
def test_a_disk_that_fills_up_in_the_middle(tmp_path: Path, ending: str):
    """A part is taken, and the rest is not."""
    path = tmp_path / f"a{ending}"
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, before[1]))
    try:
        with pytest.raises(UserError, match=f"Cannot write {path}: the file grows larger than this disk allows"):
            write_map(path, Displacement(np.random.default_rng(0).random((80, 80, 2), np.float32)))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert not list(tmp_path.iterdir())


def test_folds_are_counted():
    y, x = np.mgrid[0:90, 0:600] / 600
    values = np.zeros((90, 600, 2))
    assert folds(values) == 0
    values[..., 0] = -1.5 * np.clip(x - 0.5, 0, 0.1)  # beyond the middle the picture is turned over, a tenth wide
    assert abs(folds(values) - 60 * 90) <= 2 * 90
    values[..., 0] = -0.5 * x
    values[..., 1] = -2 * y
    assert folds(values) == values[..., 0].size
    turned = np.stack([-x - y, x - y], axis=-1)  # by a quarter, which folds nothing
    assert folds(turned) == 0
    assert folds(np.zeros((1, 9, 2))) == 0


def test_offsets_there_and_back():
    map_ = swirl(20, 30, overscan=3)
    for up in (True, False):
        back = from_offsets(to_offsets(map_, up=up), up=up, overscan=3)
        np.testing.assert_allclose(back.values, map_.values, atol=1e-8)


@pytest.mark.parametrize(
    ("channels", "found"),
    [("RG", "map"), ("UV", "map"), ("uv", "map"), ("RGB", "either"), ("RGBA", "picture"), ("YA", "picture")],
)
def test_what_an_exr_of_another_program_holds(tmp_path: Path, channels: str, found: str) -> None:
    import OpenEXR

    planes = {name: OpenEXR.Channel(np.zeros((4, 6), np.float32)) for name in channels}
    OpenEXR.File({"type": OpenEXR.scanlineimage}, planes).write(str(tmp_path / "a.exr"))
    assert holds(tmp_path / "a.exr") == found


@pytest.mark.parametrize(
    ("shape", "dtype", "extra", "found"),
    [
        ((4, 6, 2), np.float32, ["unspecified"], "map"),
        ((4, 6, 2), np.float32, ["unassalpha"], "picture"),
        ((4, 6, 2), np.uint16, ["unspecified"], "picture"),
        ((4, 6, 3), np.float32, None, "either"),
        ((4, 6, 3), np.uint16, None, "picture"),
        ((4, 6, 4), np.float32, ["unassalpha"], "picture"),
        ((4, 6), np.float32, None, "picture"),
    ],
)
def test_what_a_tiff_of_another_program_holds(
    tmp_path: Path, shape: tuple[int, ...], dtype: type, extra: list[str] | None, found: str
) -> None:
    import tifffile

    kind = "rgb" if shape[2:] > (2,) else "minisblack"
    options: dict[str, Any] = {"planarconfig": "contig"} if len(shape) > 2 else {}
    tifffile.imwrite(tmp_path / "a.tif", np.zeros(shape, dtype), photometric=kind, extrasamples=extra, **options)
    assert holds(tmp_path / "a.tif") == found


def test_what_is_no_exr_at_all_is_left_to_the_reader_of_pictures(tmp_path: Path) -> None:
    (tmp_path / "a.exr").write_bytes(b"nothing of the kind" * 9)
    assert holds(tmp_path / "a.exr") == "picture"
    assert holds(tmp_path / "nonesuch.tif") == "picture"
    assert holds(tmp_path / "a.flo") == holds(tmp_path / "a.npy") == "map"
    assert {holds(tmp_path / f"a.{ending}") for ending in ("png", "JPG", "webp", "gif", "mp4", "toml")} == {"picture"}


@pytest.mark.parametrize("ending", [".flo", ".npy"])
def test_overscan_can_be_told_of_a_map_that_does_not(tmp_path: Path, ending: str):
    inner = Displacement((np.random.default_rng(0).standard_normal((6, 9, 2)) / 9).astype(np.float32), 2)
    whole = Displacement(inner.values * np.float32(5 / 9), 0)  # in the longer sides of all of it
    write_map(tmp_path / f"a{ending}", whole if ending == ".flo" else Displacement(inner.values))
    read = read_map(tmp_path / f"a{ending}", overscan=2)
    assert (read.width, read.height, read.overscan) == (5, 2, 2)
    np.testing.assert_allclose(read.values, inner.values, rtol=1e-6)
    with pytest.raises(UserError, match="--overscan 1000000 leaves nothing of its 9 x 6 pixels"):
        read_map(tmp_path / f"a{ending}", overscan=1_000_000)


def test_the_folds_of_a_large_map_are_counted_once() -> None:
    """It is looked at in strips, beside all of it at once."""
    rng = np.random.default_rng(0)
    values = 0.02 * ndimage.gaussian_filter(rng.standard_normal((700, 1100, 2)), (3, 3, 0)).astype(np.float32)
    (down_x, down_y), (across_x, across_y) = (
        [np.asarray(np.gradient(1100 * values[..., part].astype(np.float64), axis=axis)) for part in (0, 1)]
        for axis in (0, 1)
    )
    wanted = np.count_nonzero((1 + across_x) * (1 + down_y) <= across_y * down_x)
    assert 1000 < wanted < 0.5 * 700 * 1100
    assert folds(values) == wanted


@pytest.mark.parametrize(("height", "width"), [(48, 64), (64, 48)])
@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("way", [-1, 1])
def test_a_map_is_beside_the_picture_once_it_is_shifted_off_it(height: int, width: int, axis: int, way: int) -> None:
    """Also along the shorter side, by less than the longer one; a pixel less, and one row looks up what is there."""
    side = (width, height)[axis]
    for pixels, is_off in ((side, True), (side - 1, False)):
        shift = np.zeros((height, width, 2), np.float32)
        shift[..., axis] = way * pixels / 64
        assert is_beside(shift) is is_off

"""What of an EXR lies beside its colours: kept to the bit, and warped along; read back by a reader of our own."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest

from app.errors import UserError
from app.media.codecs.exr import COMPRESSIONS
from app.media.displacement import Displacement
from app.media.holding import Losses, Written
from app.media.maps import read_map, write_map
from app.media.pictures import read_picture, write_picture
from app.media.source import open_source
from app.model.picture import Picture
from app.model.recipe import FluidSettings, Output, Recipe
from app.progress import Progress
from app.work.apply_job import Application, MapSource
from app.work.export import run
from app.work.jobs import Job, Outputs
from solver.gl.device import Device
from support.commands import Run
from support.exr import Part, read_exr

HEIGHT, WIDTH = 40, 56
TIMECODE = OpenEXR.TimeCode(1, 2, 3, 4, *[0] * 14)
CAMERA = np.arange(16, dtype=np.float32).reshape(4, 4)
FILE_ATTRIBUTES: dict[str, Any] = {
    "owner": "me", "framesPerSecond": OpenEXR.Rational(24000, 1001), "timeCode": TIMECODE, "worldToCamera": CAMERA,
    "multiView": ["left", "right"], "whiteLuminance": 203.0, "take": 7,
    "screenWindowCenter": np.array([0.5, 0.25], np.float32),
    "a name of more than thirty-one letters": np.array([1.5, 2.5]),
}  # fmt: skip


def test_grey_with_alpha_becomes_colours_and_that_is_told(tmp_path: Path) -> None:
    planes = {"Y": np.full((40, 30), 0.5, np.float32), "A": np.full((40, 30), 0.75, np.float32)}
    picture = read_picture(saved(tmp_path / "a.exr", ({}, planes)))
    for ending, said in ((".exr", "b.exr has the picture's Y and A as R, G, B and A"), (".tif", "")):
        losses = Losses(tmp_path / f"b{ending}", Written())
        write_picture(tmp_path / f"b{ending}", losses.look(picture))
        assert losses.said.partition(";")[0] == said
    names = OpenEXR.File(str(tmp_path / "b.exr"), separate_channels=True).channels()
    assert sorted(names) == ["A", "B", "G", "R"]


def noise(seed: int, dtype: type) -> np.ndarray:
    """Every bit at random, in floats mostly of ordinary size."""
    random = np.random.default_rng(seed)
    if dtype is np.uint32:
        return random.integers(0, 2**32, (HEIGHT, WIDTH), np.uint32)
    return random.random((HEIGHT, WIDTH), np.float32).astype(dtype)


def hashes(seed: int) -> np.ndarray:
    """Floats of any bits, as cryptomattes hold them; NaN, infinities and denormals among them."""
    return noise(seed, np.uint32).view(np.float32)


def saved(path: Path, *parts: tuple[dict[str, Any], dict[str, np.ndarray]]) -> Path:
    """A file by OpenEXR; its rational is put in by hand, as OpenEXR's module cannot write one."""
    made = []
    for attributes, channels in parts:
        rational = attributes.get("framesPerSecond")
        plain = {key: value for key, value in attributes.items() if key != "framesPerSecond"}
        room = {"framesPerSecond__": "12345678"} if rational else {}
        made.append(OpenEXR.Part({"compression": OpenEXR.PIZ_COMPRESSION, **plain, **room}, dict(channels)))
    OpenEXR.File(made).write(str(path))
    value = struct.pack("<iI", 24000, 1001)
    was, now = b"framesPerSecond__\0string\0\x08\0\0\x0012345678", b"framesPerSecond\0rational\0\x08\0\0\0" + value
    path.write_bytes(path.read_bytes().replace(was, now))
    return path


def a_shot(path: Path) -> tuple[Path, list[dict[str, np.ndarray]]]:
    """What a renderer writes: colours, layers, depth and ids in one part, a cryptomatte and a second view in others."""
    colours = {name: noise(number, np.float16) for number, name in enumerate("RGBA")}
    own = {**colours, "diffuse.R": noise(5, np.float16), "diffuse.G": noise(6, np.float32), "Z": noise(7, np.float32)}
    own["instance.id"] = noise(8, np.uint32)
    crypto = {f"uCryptoObject00.{name}": hashes(number) for number, name in enumerate("RGBA", 10)}
    right = {name: noise(number, np.float32) for number, name in enumerate("RGB", 20)}
    keys = {"cryptomatte/1a2b3c4/name": "uCryptoObject", "cryptomatte/1a2b3c4/manifest": '{"cup":"3f800000"}'}
    parts = [own, crypto, right]
    headers = [{**FILE_ATTRIBUTES, "name": "rgba"}, {**keys, "name": "crypto"}, {"name": "right", "view": "right"}]
    return saved(path, *zip(headers, parts, strict=True)), parts


def rendered(device: Device, source: Path, output: Path, **how: Any) -> tuple[str, ...]:
    """The source through a recipe that does nothing; says the notices."""
    recipe = Recipe(duration=0.1, fluid=FluidSettings(grid=24), output=Output(quality=100, fps=20))
    return run(
        device, Job(recipe, open_source(source).picture, source.parent, Outputs(output, **how)), Progress()
    ).notices


def assert_same(found: Part, channels: dict[str, np.ndarray]) -> None:
    assert sorted(found.channels) == sorted(channels)
    for name, plane in channels.items():
        assert found.channels[name].dtype == plane.dtype, name
        kind = f"u{plane.dtype.itemsize}"
        np.testing.assert_array_equal(found.channels[name].view(kind), plane.view(kind), err_msg=name)


def test_what_nothing_is_done_to_keeps_every_channel_part_and_attribute(device: Device, tmp_path: Path):
    source, parts = a_shot(tmp_path / "shot.exr")
    assert rendered(device, source, tmp_path / "out.exr", codec="none") == ()
    found = read_exr(tmp_path / "out.exr")
    assert len(found) == 3
    for part, channels in zip(found, parts, strict=True):
        assert_same(part, channels)
    uncompressed = tmp_path / "plain.exr"
    told = found[0].attributes
    assert told["framesPerSecond"] == ("rational", struct.pack("<iI", 24000, 1001))
    assert told["timeCode"] == ("timecode", struct.pack("<II", 0x01020304, 0))
    assert told["worldToCamera"] == ("m44f", CAMERA.tobytes())
    assert told["multiView"][0] == "stringvector"
    assert told["whiteLuminance"] == ("float", struct.pack("<f", 203))
    assert told["take"] == ("int", struct.pack("<i", 7))
    assert told["screenWindowCenter"] == ("v2f", struct.pack("<ff", 0.5, 0.25))
    assert told["a name of more than thirty-one letters"] == ("v2d", struct.pack("<dd", 1.5, 2.5))
    assert [part.attributes["name"][1] for part in found] == [b"rgba", b"crypto", b"right"]
    assert found[2].attributes["view"] == ("string", b"right")
    assert found[1].attributes["cryptomatte/1a2b3c4/manifest"][1] == b'{"cup":"3f800000"}'
    # and once more, by way of the library
    again = read_picture(tmp_path / "out.exr")
    write_picture(uncompressed, again, codec="none")
    assert uncompressed.read_bytes() == (tmp_path / "out.exr").read_bytes()


def test_layers_go_where_the_colours_go_and_ids_stay_ids(device: Device, tmp_path: Path):
    colours = {name: noise(number, np.float32) for number, name in enumerate("RGB")}
    deep, ids, many = noise(7, np.float32) * 900, hashes(8), noise(9, np.uint32)
    layers = {"spec.R": colours["R"], "spec.G": colours["G"], "Z": deep, "ids.uCryptoAsset": ids, "id": many}
    layers |= {"P.X": deep, "left.depth.V": deep}
    source = saved(tmp_path / "shot.exr", ({}, {**colours, **layers}))
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    values = np.stack([3.3 + 2 * np.sin(y / 5), 1.7 * np.cos(x / 7)], axis=-1) / WIDTH
    write_map(tmp_path / "map.npy", Displacement(values))
    outputs = Outputs(tmp_path / "out.exr", codec="none")
    job = Application(maps=MapSource(tmp_path / "map.npy"), picture=source, outputs=outputs, edges="clamp")
    assert job.perform(lambda: device, Progress()).notices == ()
    (found,) = read_exr(tmp_path / "out.exr")
    seen = found.channels
    np.testing.assert_array_equal(seen["spec.R"], seen["R"])
    np.testing.assert_array_equal(seen["spec.G"], seen["G"])
    assert np.abs(seen["R"] - colours["R"]).mean() > 0.1
    # the nearest pixel, but where two are as near; of all three the same one
    px, py = values[..., 0] * WIDTH + x, values[..., 1] * WIDTH + y
    sure = (np.abs(px % 1 - 0.5) > 0.02) & (np.abs(py % 1 - 0.5) > 0.02)
    column, row = (np.clip(np.round(p).astype(int), 0, most - 1) for p, most in ((px, WIDTH), (py, HEIGHT)))
    for name, plane in list(layers.items())[2:]:
        wanted = plane[row, column].view(np.uint32)
        np.testing.assert_array_equal(seen[name].view(np.uint32)[sure], wanted[sure], err_msg=name)


@pytest.mark.parametrize("filtered", [(), ("--filter", "limited")])
def test_light_rings_below_zero_unless_that_is_limited(tmp_path: Path, fluidwarp: Run, filtered: tuple[str, ...]):
    """Colours, layers and what lies beyond the window, by a recipe and by its map."""
    lamps = {
        name: np.where(noise(number, np.float32) < 0.1, 900, 0).astype(np.float32) for number, name in enumerate("RGB")
    }
    windows = {"dataWindow": window(0, 0, WIDTH - 1, HEIGHT - 1), "displayWindow": window(0, 0, WIDTH - 5, HEIGHT - 1)}
    saved(tmp_path / "lamps.exr", (windows, {**lamps, "spec.R": lamps["R"]}))
    (tmp_path / "a.toml").write_text(
        'picture = "lamps.exr"\nduration = 0.1\nedges = "clamp"\n[fluid]\ngrid = 24\n[[force]]\nkind = "vortex"\n'
        "point = [0.5, 0.5]\nradius = 0.4\nstrength = 9\nat = 0\n"
    )
    for words in (
        ["render", "a.toml", "-o", "out.exr", "--codec", "none", "--map", "map.npy"],
        ["apply", "map.npy", "lamps.exr", "-o", "out.exr", "--codec", "none", "--edges", "clamp"],
    ):
        ran = fluidwarp(tmp_path, *words, *filtered)
        assert (ran.returncode, ran.stderr) == (0, "")
        (found,) = read_exr(tmp_path / "out.exr")
        assert all((plane.min() < -10) == (not filtered) for plane in found.channels.values())
        assert all((plane.max() > 910) == (not filtered) for plane in found.channels.values())
        np.testing.assert_array_equal(found.channels["spec.R"], found.channels["R"])


def test_what_an_output_cannot_hold_is_told_in_a_line(device: Device, tmp_path: Path):
    source, _ = a_shot(tmp_path / "shot.exr")
    lost = "channels Z, diffuse.G, diffuse.R, instance.id and 7 more of the parts crypto, right"
    attributes = "attributes a name of more than thirty-one letters, framesPerSecond, multiView, screenWindowCenter"
    assert rendered(device, source, tmp_path / "out.png") == (
        f"out.png cuts values above 1; it lacks the picture's {attributes} and 4 more, its {lost}; "
        "write .exr to keep all of it",
    )
    assert rendered(device, source, tmp_path / "f.%02d.exr", codec="none") == (
        f"f.%02d.exr lacks the picture's {lost}",
    )
    (frame,) = read_exr(tmp_path / "f.00.exr")
    assert sorted(frame.channels) == sorted("RGBA")
    grey = dict.fromkeys("RGB", noise(1, np.float32))
    moving = saved(tmp_path / "m.exr", ({}, {**grey, "forward.u": noise(2, np.float32)}))
    assert read_picture(moving).note == "m.exr: the arrows of its channel forward.u are moved and not turned"


def test_colours_are_found_in_a_layer_or_a_part(device: Device, tmp_path: Path):
    planes = {name: noise(number, np.float32) for number, name in enumerate("RGB")}
    wanted = np.stack(list(planes.values()), axis=-1)
    other = {f"albedo.{name}": noise(number, np.float32) for number, name in enumerate("RGB", 5)}
    beauty = {f"beauty.{name}": plane for name, plane in planes.items()}
    source = saved(tmp_path / "layers.exr", ({}, {**other, **beauty}))
    np.testing.assert_array_equal(read_picture(source).pixels, wanted)
    rendered(device, source, tmp_path / "out.exr", codec="none")
    assert_same(read_exr(tmp_path / "out.exr")[0], {**other, **beauty})
    source = saved(tmp_path / "parts.exr", ({"name": "depth"}, {"Z": noise(9, np.float32)}), ({"name": "rgb"}, planes))
    np.testing.assert_array_equal(read_picture(source).pixels, wanted)
    rendered(device, source, tmp_path / "out.exr", codec="none")
    deep, colours = read_exr(tmp_path / "out.exr")
    assert_same(deep, {"Z": noise(9, np.float32)})
    assert_same(colours, planes)
    source = saved(tmp_path / "mask.exr", ({}, {"a.Y": noise(9, np.float32), **other}))  # a plane is no picture
    np.testing.assert_array_equal(read_picture(source).pixels, np.stack(list(other.values()), axis=-1))


@pytest.mark.parametrize("bits", [16, 32, None])
@pytest.mark.parametrize("half", [True, False])
def test_floats_of_16_or_32_bits(tmp_path: Path, half: bool, bits: int | None):
    pixels = np.stack([noise(number, np.float32) for number in range(3)], axis=-1)
    pixels[0, :3, 0] = 7e4, -7e4, np.inf
    write_picture(tmp_path / "a.exr", Picture(pixels, half=half), bits=bits, codec="none")
    (part,) = read_exr(tmp_path / "a.exr")
    red = part.channels["R"]
    assert red.dtype == (np.float16 if bits == 16 or (half and bits is None) else np.float32)
    if red.dtype == np.float16:
        assert red[0, :3].tolist() == [65504, -65504, np.inf]  # what is finite stays so
    np.testing.assert_array_equal(red[1:], pixels[1:, :, 0].astype(red.dtype))
    assert read_picture(tmp_path / "a.exr").half == (red.dtype == np.float16)


@pytest.mark.parametrize("codec", COMPRESSIONS)
def test_a_compression_of_choice(tmp_path: Path, codec: str):
    codes = {"none": 0, "rle": 1, "zips": 2, "zip": 3, "piz": 4, "pxr24": 5, "b44": 6, "b44a": 7, "dwaa": 8, "dwab": 9}
    y, x = np.mgrid[0:64, 0:64]
    pixels = np.stack([x / 64, y / 64, x * y / 4096], axis=-1).astype(np.float32)
    write_picture(tmp_path / "a.exr", Picture(pixels), bits=16, codec=codec)
    data = (tmp_path / "a.exr").read_bytes()
    at = data.index(b"compression\0compression\0") + len(b"compression\0compression\0") + 4
    assert data[at] == codes[codec]
    read = read_picture(tmp_path / "a.exr").pixels
    np.testing.assert_allclose(read, pixels.astype(np.float16), atol=0 if codes[codec] < 5 else 0.02)


def test_a_compression_that_there_is_not(tmp_path: Path):
    with pytest.raises(UserError, match=r"a\.exr: OpenEXR is compressed as zip .*, not h264; change --codec"):
        write_picture(tmp_path / "a.exr", Picture(np.zeros((8, 8, 3), np.float32)), codec="h264")
    with pytest.raises(UserError, match=r"a\.png: a picture has no codec"):
        write_picture(tmp_path / "a.png", Picture(np.zeros((8, 8, 3), np.float32)), codec="piz")


@pytest.mark.parametrize("part", [0.5, 0.99])
def test_pixels_that_are_missing_are_told_as_that(tmp_path: Path, part: float):
    source = tmp_path / "a.exr"
    write_picture(source, Picture(np.random.default_rng(1).random((40, 50, 3), np.float32)))
    data = source.read_bytes()
    source.write_bytes(data[: int(part * len(data))])
    for reading in (read_picture, read_map):
        with pytest.raises(UserError, match=r"truncated or damaged \(pixel data is missing\); get it again"):
            reading(source)


@pytest.mark.parametrize("count", [9, 30, 200, 400])
def test_a_damaged_header_is_told(tmp_path: Path, count: int):
    source, _ = a_shot(tmp_path / "shot.exr")
    source.write_bytes(source.read_bytes()[:count])
    with pytest.raises(UserError, match="truncated or damaged"):
        read_picture(source)


def window(*corners: int) -> tuple[np.ndarray, np.ndarray]:
    return np.array(corners[:2], np.int32), np.array(corners[2:], np.int32)


def windowed(path: Path) -> tuple[Path, np.ndarray]:
    """A picture of 56 x 40 at 10, 20, with 6 pixels more on the left, 4 below and none elsewhere; its red."""
    y, x = np.mgrid[0 : HEIGHT + 4, 0 : WIDTH + 6].astype(np.float32)
    planes = {"R": x / 64, "G": y / 64, "B": x * 0 + 0.5, "Z": noise(3, np.float32).repeat(2, 0).repeat(2, 1)[: len(x)]}
    planes["Z"] = np.ascontiguousarray(planes["Z"][:, : WIDTH + 6])
    windows = {"dataWindow": window(4, 20, 65, 63), "displayWindow": window(10, 20, 65, 59)}
    return saved(path, (windows, planes)), planes["R"]


@pytest.mark.parametrize("edges", ["transparent", "clamp", "mirror"])
def test_windows_and_overscan_come_back(device: Device, tmp_path: Path, edges: str):
    source, _ = windowed(tmp_path / "shot.exr")
    recipe = Recipe(duration=0.1, fluid=FluidSettings(grid=24), edges=edges)  # type: ignore[arg-type]
    picture = open_source(source).picture
    assert picture.pixels.shape == (HEIGHT, WIDTH, 3)
    report = run(device, Job(recipe, picture, tmp_path, Outputs(tmp_path / "out.exr", codec="none")), Progress())
    assert report.notices == ()
    (found,) = read_exr(tmp_path / "out.exr")
    assert found.window("dataWindow") == (4, 20, 65, 63)
    assert found.window("displayWindow") == (10, 20, 65, 59)
    write_picture(tmp_path / "plain.exr", read_picture(source), codec="none")
    assert_same(found, read_exr(tmp_path / "plain.exr")[0].channels)
    library = OpenEXR.File(str(source), separate_channels=True).channels()
    assert_same(found, {name: channel.pixels for name, channel in library.items()})


def test_what_enters_at_an_edge_comes_from_the_overscan(device: Device, tmp_path: Path):
    source, red = windowed(tmp_path / "shot.exr")
    shift = np.zeros((HEIGHT, WIDTH, 2))
    shift[..., 0] = -4 / WIDTH  # looked up 4 pixels to the left
    write_map(tmp_path / "map.npy", Displacement(shift))
    outputs = Outputs(tmp_path / "out.exr", codec="none", bits=32)
    job = Application(maps=MapSource(tmp_path / "map.npy"), picture=source, outputs=outputs)
    assert job.perform(lambda: device, Progress()).notices == ()
    (found,) = read_exr(tmp_path / "out.exr")
    assert found.window("dataWindow") == (4, 20, 65, 63)
    np.testing.assert_allclose(found.channels["R"][:, 6:], red[:, 2:-4], atol=1e-5)
    np.testing.assert_allclose(found.channels["R"][:, 4:6], red[:, :2], atol=1e-5)


def test_overscan_that_has_no_place_is_told(device: Device, tmp_path: Path):
    source, _ = windowed(tmp_path / "shot.exr")
    recipe = Recipe(duration=0.1, fluid=FluidSettings(grid=24), output=Output(size=112))
    said = run(
        device, Job(recipe, read_picture(source), tmp_path, Outputs(tmp_path / "o.exr", codec="none")), Progress()
    ).notices
    assert said == ("o.exr lacks the picture's overscan (6 px beyond the display window)",)
    (found,) = read_exr(tmp_path / "o.exr")
    assert found.window("dataWindow") == found.window("displayWindow") == (10, 20, 121, 99)
    assert found.channels["Z"].shape == (80, 112)
    (said,) = rendered(device, source, tmp_path / "o.png")
    assert said == (
        "o.png lacks the picture's overscan (6 px beyond the display window); "
        "it begins at 0, 0 and not at 10, 20 as the display window; "
        "it lacks the picture's channel Z; write .exr to keep all of it"
    )


def test_data_beside_the_display_window_are_told(tmp_path: Path):
    """Nothing of them is shown, and so far away they are no overscan."""
    there = np.array([200, 0], np.int32), np.array([199 + WIDTH, HEIGHT - 1], np.int32)
    shown = np.zeros(2, np.int32), np.array([99, 79], np.int32)
    header = {"dataWindow": there, "displayWindow": shown}
    OpenEXR.File(header, {name: noise(0, np.float32) for name in "RGB"}).write(str(tmp_path / "far.exr"))
    picture = read_picture(tmp_path / "far.exr")
    assert not picture.pixels.any()
    assert picture.wide is None
    assert picture.margins == (0, 0, 0, 0)
    assert picture.note == "far.exr: pixels that all lie outside of its display window are not kept"


def test_what_is_made_of_a_picture_as_it_was_is_told(tmp_path: Path):
    path = tmp_path / "a.exr"
    colours = {name: noise(number, np.uint32) >> 8 for number, name in enumerate("RGB")}
    OpenEXR.File({"preview": OpenEXR.PreviewImage(np.zeros((4, 5, 4), np.uint8))}, colours).write(str(path))
    assert read_picture(path).note == (
        "a.exr: its preview is not kept; its colours are whole numbers (uint), and are taken for light with white at 1"
    )
    OpenEXR.File({}, {name: np.full((2, 3), 2**24 + (name == "G"), np.uint32) for name in "RGB"}).write(str(path))
    assert read_picture(path).note.endswith("taken for light with white at 1, rounded beyond 16777216")
    path.write_bytes(mipmapped(np.array([[1, 2], [3, 4]], np.float32), np.array([[2.5]], np.float32)))
    picture = read_picture(path)
    assert picture.note == "a.exr: its smaller versions (mipmaps) are not kept"
    assert picture.pixels[..., 0].tolist() == [[1, 2], [3, 4]]


def mipmapped(*levels: np.ndarray) -> bytes:
    """An EXR of one tile a level, by "OpenEXR File Layout": OpenEXR's module writes no levels."""
    corner = levels[0].shape[0] - 1
    box, side = struct.pack("<4i", 0, 0, corner, corner), struct.pack("<f", 1)
    attributes = {
        "channels": ("chlist", b"Y\0" + struct.pack("<iB3xii", 2, 0, 1, 1) + b"\0"),
        "compression": ("compression", b"\0"), "dataWindow": ("box2i", box), "displayWindow": ("box2i", box),
        "lineOrder": ("lineOrder", b"\0"), "pixelAspectRatio": ("float", side),
        "screenWindowCenter": ("v2f", bytes(8)), "screenWindowWidth": ("float", side),
        "tiles": ("tiledesc", struct.pack("<IIB", corner + 1, corner + 1, 1)),
    }  # fmt: skip
    data = struct.pack("<II", 20000630, 2 | 0x200)
    for name, (kind, value) in attributes.items():
        data += name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value
    data += b"\0"
    chunks = [
        struct.pack("<5i", 0, 0, number, number, level.nbytes) + level.tobytes() for number, level in enumerate(levels)
    ]
    at = len(data) + 8 * len(levels)
    places = [at + sum(map(len, chunks[:number])) for number in range(len(levels))]
    return data + struct.pack(f"<{len(levels)}Q", *places) + b"".join(chunks)

"""What nothing is done to: every value of every format comes back bit for bit, as other programs read it."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import OpenEXR
import pytest
import tifffile
from PIL import Image

from app.media.animation import animation_writer
from app.media.depth import to_bits
from app.media.displacement import Displacement
from app.media.ffmpeg import executable
from app.media.maps import write_map
from app.media.pictures import read_picture, write_picture
from app.media.source import open_source
from app.media.video import read_clip
from app.model.picture import Picture
from app.model.recipe import FluidSettings, Output, Recipe
from app.progress import Progress
from app.work.apply_job import Application, MapSource
from app.work.export import run
from app.work.jobs import Job, Outputs
from solver.gl.device import Device
from solver.resample.plan import GivenMap, Sampling
from solver.resample.sampler import Sampler

SIZES = [(37, 23), (8, 131), (64, 9)]
CHANNELS = {1: "grey", 2: "grey+alpha", 3: "RGB", 4: "RGBA"}


def noise(channels: int, dtype: type, size: tuple[int, int] = (37, 23)) -> np.ndarray:
    """Random pixels (h, w, channels), alpha of 0 and of all among them, and of floats everything that there is."""
    random = np.random.default_rng(channels)
    width, height = size
    if dtype is not np.float32:
        pixels = random.integers(0, np.iinfo(dtype).max, (height, width, channels), dtype, endpoint=True)
        if channels in (2, 4):
            pixels[random.random((height, width)) < 0.3, -1] = 0
            pixels[random.random((height, width)) < 0.3, -1] = np.iinfo(dtype).max
        return pixels
    pixels = (random.standard_normal((height, width, channels)) * 3).astype(np.float32)
    wild = [np.inf, -np.inf, np.nan, 65504, 1e30, -1e30, 1e-30, 5e-42, -0.0, 0.0]
    at = random.random(pixels.shape) < 0.1
    pixels[at] = random.choice(np.array(wild, np.float32), int(at.sum()))
    if channels in (2, 4):
        pixels[random.random((height, width)) < 0.3, -1] = 0
        pixels[random.random((height, width)) < 0.3, -1] = 1
    return pixels


def assert_same_bits(found: np.ndarray, wanted: np.ndarray) -> None:
    assert (found.shape, found.dtype) == (wanted.shape, wanted.dtype)
    kind = f"u{wanted.dtype.itemsize}"
    bits = np.ascontiguousarray(found).view(kind), np.ascontiguousarray(wanted).view(kind)
    np.testing.assert_array_equal(*bits)


def in_exr(path: Path) -> np.ndarray:
    channels = OpenEXR.File(str(path), separate_channels=True).channels()
    names = [name for name in ("Y", "R", "G", "B", "A") if name in channels]
    return np.stack([channels[name].pixels for name in names], axis=-1)


def in_png(path: Path) -> np.ndarray:
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    assert image is not None
    return image[..., None] if image.ndim == 2 else image[..., [2, 1, 0, 3][: image.shape[2]]]


def in_tiff(path: Path) -> np.ndarray:
    image = tifffile.imread(path)
    return image if image.ndim == 3 else image[..., None]


def in_webp(path: Path) -> np.ndarray:
    return np.asarray(Image.open(path))


def written(path: Path, pixels: np.ndarray, **tags: object) -> Path:
    """A picture of these very values, by another program."""
    names = {1: "Y", 2: "YA", 3: "RGB", 4: "RGBA"}[pixels.shape[2]]
    if path.suffix == ".exr":
        header = {"compression": OpenEXR.PIZ_COMPRESSION, "type": OpenEXR.scanlineimage, **tags}
        planes = {name: np.ascontiguousarray(pixels[..., index]) for index, name in enumerate(names)}
        OpenEXR.File(header, planes).write(str(path))
    elif path.suffix == ".tif":
        kind = "rgb" if pixels.shape[2] > 2 else "minisblack"
        contiguous = {"planarconfig": "contig"} if pixels.shape[2] > 1 else {}
        stored = pixels if pixels.shape[2] > 1 else pixels[..., 0]
        tifffile.imwrite(path, stored, photometric=kind, **contiguous, **tags)  # type: ignore[arg-type]
    elif pixels.shape[2] == 2:  # OpenCV writes no grey with alpha
        write_picture(path, Picture(pixels))
    else:
        cv2.imwrite(str(path), pixels[..., [2, 1, 0, 3][: pixels.shape[2]]] if pixels.shape[2] > 2 else pixels)
    return path


def rendered(device: Device, source: Path, output: Path, animated: bool = False, edges: str = "transparent") -> None:
    """The source through a recipe that does nothing."""
    recipe = Recipe(duration=0.1, fluid=FluidSettings(grid=24), output=Output(quality=100, fps=20), edges=edges)  # type: ignore[arg-type]
    if min(open_source(source).picture.pixels.shape[:2]) < 12:
        recipe = recipe.edited(fluid=FluidSettings(grid=160))
    opened = open_source(source)
    run(
        device,
        Job(recipe, opened.picture, source.parent, Outputs(output, animated=animated), clip=opened.clip),
        Progress(),
    )


@pytest.mark.parametrize("channels", CHANNELS, ids=CHANNELS.get)
@pytest.mark.parametrize("edges", ["transparent", "clamp", "mirror"])
@pytest.mark.parametrize("size", SIZES, ids=str)
def test_a_float_exr_comes_back(device: Device, tmp_path: Path, size: tuple[int, int], edges: str, channels: int):
    pixels = noise(channels, np.float32, size)
    source = written(tmp_path / "in.exr", pixels)
    rendered(device, source, tmp_path / "out.exr", edges=edges)
    assert_same_bits(in_exr(tmp_path / "out.exr"), pixels[..., [0, 0, 0, 1]] if channels == 2 else pixels)


@pytest.mark.parametrize("channels", CHANNELS, ids=CHANNELS.get)
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("alpha", ["unassalpha", "assocalpha"])
def test_a_tiff_comes_back_with_its_own_kind_of_alpha(
    device: Device, tmp_path: Path, alpha: str, dtype: type, channels: int
):
    pixels, tags = noise(channels, dtype), {"extrasamples": [alpha]} if channels in (2, 4) else {}
    rendered(device, written(tmp_path / "in.tif", pixels, **tags), tmp_path / "out.tif")
    assert_same_bits(in_tiff(tmp_path / "out.tif"), pixels)
    with tifffile.TiffFile(tmp_path / "out.tif") as tiff:
        kept = [tifffile.EXTRASAMPLE[alpha.upper()]] if tags else []
        assert list(tiff.pages.first.extrasamples) == kept


@pytest.mark.parametrize("channels", CHANNELS, ids=CHANNELS.get)
@pytest.mark.parametrize(("ending", "dtype"), [(".png", np.uint8), (".png", np.uint16), (".webp", np.uint8)])
def test_png_and_lossless_webp_come_back(device: Device, tmp_path: Path, ending: str, dtype: type, channels: int):
    pixels = noise(channels, dtype, (64, 9))
    source = written(tmp_path / "in.png", pixels)
    rendered(device, source, tmp_path / f"out{ending}")
    wanted = pixels[..., [0, 0, 0, 1]] if channels == 2 else pixels  # OpenCV makes RGBA of grey with alpha
    if ending == ".webp" and channels == 1:
        wanted = pixels[..., [0, 0, 0]]
    assert_same_bits((in_png if ending == ".png" else in_webp)(tmp_path / f"out{ending}"), wanted)


@pytest.mark.parametrize(
    ("name", "dtype"), [("f.%04d.exr", np.float32), ("f.%04d.tif", np.float32), ("f.%04d.png", np.uint16)]
)
def test_every_frame_of_a_sequence_is_the_picture(device: Device, tmp_path: Path, name: str, dtype: type):
    pixels = noise(4, dtype)
    ending = Path(name).suffix
    rendered(device, written(tmp_path / f"in{ending}", pixels), tmp_path / name)
    read = {".exr": in_exr, ".tif": in_tiff, ".png": in_png}[ending]
    for number in range(3):
        assert_same_bits(read(tmp_path / (name % number)), pixels)


@pytest.mark.parametrize(("dtype", "channels"), [(np.uint8, 3), (np.uint8, 4), (np.uint16, 3), (np.uint16, 4)])
def test_a_lossless_clip_comes_back(device: Device, tmp_path: Path, dtype: type, channels: int):
    frames = [noise(channels, dtype, (37, 23)) // (k + 1) for k in range(3)]
    kind = {(8, 3): "rgb24", (8, 4): "rgba", (16, 3): "rgb48le", (16, 4): "rgba64le"}[np.iinfo(dtype).bits, channels]
    inner = {"rgb24": "bgr0", "rgba": "bgra", "rgb48le": "gbrp16le", "rgba64le": "gbrap16le"}[kind]
    raw = ["-f", "rawvideo", "-pix_fmt", kind]
    data = b"".join(frame.tobytes() for frame in frames)
    command = [
        executable(),
        "-v",
        "error",
        *raw,
        "-s",
        "37x23",
        "-r",
        "10",
        "-i",
        "-",
        "-c:v",
        "ffv1",
        "-pix_fmt",
        inner,
    ]
    subprocess.run([*command, str(tmp_path / "in.mkv")], input=data, check=True)
    rendered(device, tmp_path / "in.mkv", tmp_path / "out.mkv")
    read = [executable(), "-v", "error", "-i", str(tmp_path / "out.mkv"), *raw, "-"]
    found = subprocess.run(read, capture_output=True, check=True).stdout
    assert_same_bits(np.frombuffer(found, dtype).reshape(3, 23, 37, channels), np.stack(frames))


@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize("ending", [".webp", ".apng"])
def test_an_animated_picture_comes_back(device: Device, tmp_path: Path, ending: str, channels: int) -> None:
    """As OpenCV reads it: all frames and how long each is shown. WebP keeps no colour that is wholly transparent."""
    random = np.random.default_rng(channels)
    frames = [random.integers(0, 256, (23, 37, channels)).astype(np.uint8) for _ in range(4)]
    for number, frame in enumerate(frames):
        frame[number : number + 5, :9, 3:] = 0
        frame[9 + number :, :9] = frames[0][9 + number :, :9]  # what an encoder may leave out
    first, *others = map(Image.fromarray, frames)
    lengths = [100, 40, 200, 60]
    first.save(tmp_path / "in.apng", save_all=True, append_images=others, duration=lengths)
    rendered(device, tmp_path / "in.apng", tmp_path / f"out{ending}", animated=True)
    read, animation = cv2.imreadanimation(str(tmp_path / f"out{ending}"))
    assert read
    assert len(animation.frames) == 4
    assert list(animation.durations) == lengths
    for found, wanted in zip(animation.frames, frames, strict=True):
        colours = found[..., [2, 1, 0]]
        alpha = found[..., 3:] if found.shape[2] == 4 else np.full_like(found[..., :1], 255)
        np.testing.assert_array_equal(alpha, wanted[..., 3:] if channels == 4 else 255)
        shown = alpha > 0 if ending == ".webp" else True
        np.testing.assert_array_equal(colours * shown, wanted[..., :3] * shown)


@pytest.mark.parametrize("size", [(1, 1), (1, 7), (9, 1), (2, 3)], ids=str)
@pytest.mark.parametrize("ending", [".exr", ".tif", ".png"])
def test_the_smallest_pictures_come_back_through_a_map_that_does_nothing(
    device: Device, tmp_path: Path, ending: str, size: tuple[int, int]
):
    pixels = noise(4, np.uint16 if ending == ".png" else np.float32, size)
    write_map(tmp_path / "map.npy", Displacement(np.zeros((8 * size[1], 8 * size[0], 2), np.float32)))
    source = written(tmp_path / f"in{ending}", pixels)
    job = Application(maps=MapSource(tmp_path / "map.npy"), picture=source, outputs=Outputs(tmp_path / f"out{ending}"))
    job.perform(lambda: device, Progress())
    read = {".exr": in_exr, ".tif": in_tiff, ".png": in_png}[ending]
    assert_same_bits(read(tmp_path / f"out{ending}"), pixels)


def test_light_without_alpha_survives_a_warp(device: Device, tmp_path: Path):
    """A flame: colour that covers nothing of what is behind it."""
    flame = np.zeros((32, 48, 4), np.float32)
    flame[8:24, 8:40, :3] = 4.0, 2.0, 0.5
    written(tmp_path / "in.exr", flame)
    picture = read_picture(tmp_path / "in.exr")
    assert picture.premultiplied
    shift = np.tile(np.array([0.5 / 48, 0], np.float32), (32, 48, 1))
    for samples in ("auto", 1):
        how = Sampling("bilinear", samples=samples, premultiplied=True)
        found = Sampler(device).apply(GivenMap(device, shift), picture.pixels, how=how)
        np.testing.assert_allclose(found[16, 20], (4, 2, 0.5, 0), rtol=1e-6)
        np.testing.assert_allclose(found[16, 7], (2, 1, 0.25, 0), rtol=1e-5)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_premultiplied_codes_are_warped_as_straight_ones(device: Device, dtype: type):
    """To within what the premultiplied ones were rounded by."""
    top = np.iinfo(dtype).max
    y, x = np.mgrid[0:40, 0:60].astype(np.float32)
    straight = np.stack(
        [0.3 + 0.3 * np.sin(x / 9), 0.5 + 0.4 * np.sin(y / 7), 0 * x + 0.8, 0.75 + 0.25 * np.cos(x / 8)], -1
    )
    multiplied = np.concatenate([straight[..., :3] * straight[..., 3:], straight[..., 3:]], axis=2)
    straight, multiplied = ((values * top).round().astype(dtype) for values in (straight, multiplied))
    warp = GivenMap(device, np.stack([0.05 * np.sin(y / 11), 0.05 * np.cos(x / 13)], axis=-1).astype(np.float32))
    how = {"edges": "clamp", "dither": False}
    wanted = Sampler(device).apply(warp, straight, how=Sampling(**how)) / top  # type: ignore[arg-type]
    found = Sampler(device).apply(warp, multiplied, how=Sampling(**how, premultiplied=True)) / top  # type: ignore[arg-type]
    np.testing.assert_allclose(found[..., 3], wanted[..., 3], atol=1e-6)
    np.testing.assert_allclose(found[..., :3], wanted[..., :3] * wanted[..., 3:], atol=2.5 / top + 1e-6)


def test_a_pixel_that_is_no_number_spoils_only_its_neighbours(device: Device):
    picture = np.ones((40, 60, 4), np.float32)
    picture[20, 30, 0] = np.inf
    warp = GivenMap(device, np.tile(np.array([0.4 / 60, 0.3 / 60], np.float32), (40, 60, 1)))
    found = Sampler(device).apply(warp, picture, how=Sampling(edges="clamp", premultiplied=True))
    spoiled = np.argwhere(~np.isfinite(found))
    assert 0 < len(spoiled) <= 16
    assert np.abs(spoiled[:, :2] - (20, 30)).max() <= 2
    assert (spoiled[:, 2] == 0).all()


def test_the_shape_of_pixels_and_other_numbers_of_an_exr_stay(device: Device, tmp_path: Path):
    told = {"pixelAspectRatio": 2.0, "isoSpeed": 400.0, "owner": "me", "whiteLuminance": 80.0}
    source = written(tmp_path / "in.exr", np.ones((16, 24, 3), np.float32), **told)
    rendered(device, source, tmp_path / "out.exr")
    header = OpenEXR.File(str(tmp_path / "out.exr"), header_only=True).header()
    assert {key: header[key] for key in told} == told
    write_picture(tmp_path / "bare.exr", read_picture(source), strip=True)
    header = OpenEXR.File(str(tmp_path / "bare.exr"), header_only=True).header()
    assert header["pixelAspectRatio"] == 2.0
    assert "owner" not in header
    assert "isoSpeed" not in header


@pytest.mark.parametrize(
    ("name", "how"),
    [("a.jpg", {"quality": 37, "strip": True}), ("a.exr", {"bits": 16, "codec": "none"}), ("a.png", {"bits": 16})],
)
def test_a_still_is_written_as_is_asked_for(device: Device, tmp_path: Path, name: str, how: dict[str, Any]):
    """By either command: the very bytes of a file that is written so at once."""
    picture = Picture(noise(3, np.uint8), dpi=(150.0, 150.0))
    write_picture(tmp_path / "in.tif", picture)
    write_picture(tmp_path / name, picture, **how)
    wanted = (tmp_path / name).read_bytes()
    quality = how.pop("quality", 90)
    outputs = Outputs(tmp_path / f"out-{name}", **how)
    recipe = Recipe(duration=0.1, fluid=FluidSettings(grid=24), output=Output(quality=quality))
    run(device, Job(recipe, read_picture(tmp_path / "in.tif"), tmp_path, outputs), Progress())
    assert outputs.file is not None
    assert outputs.file.read_bytes() == wanted
    write_map(tmp_path / "still.npy", Displacement(np.zeros((23, 37, 2))))
    maps = MapSource(tmp_path / "still.npy")
    Application(picture=tmp_path / "in.tif", outputs=outputs, maps=maps, quality=quality).perform(
        lambda: device, Progress()
    )
    assert outputs.file.read_bytes() == wanted


def test_what_holds_no_premultiplied_colours_gets_straight_ones(device: Device, tmp_path: Path):
    half = np.zeros((24, 36, 4), np.float32)
    half[:] = 0.25, 0.125, 0.0, 0.5
    source = written(tmp_path / "in.exr", half)
    wanted = to_bits(np.array([[[0.5, 0.25, 0.0, 0.5]]], np.float32), 16)[0, 0]
    rendered(device, source, tmp_path / "out.png")
    assert (in_png(tmp_path / "out.png") == wanted).all()
    rendered(device, source, tmp_path / "f.%d.png")
    assert (in_png(tmp_path / "f.0.png") == wanted).all()
    rendered(device, source, tmp_path / "out.mkv")
    frame = next(read_clip(tmp_path / "out.mkv").read_frames())
    assert (frame == wanted).all()
    recipe = Recipe(duration=0.1, fluid=FluidSettings(grid=24), mode="density")
    run(device, Job(recipe, read_picture(source), tmp_path, Outputs(tmp_path / "density.png")), Progress())
    np.testing.assert_allclose(in_png(tmp_path / "density.png")[12, 18], wanted // 257, atol=1)


def test_tiles_of_premultiplied_colours_are_the_same_to_the_bit(device: Device):
    y, x = np.mgrid[0:150, 0:230].astype(np.float32)
    warp = GivenMap(device, np.stack([0.1 * np.sin(y / 21), 0.1 * np.cos(x / 33)], axis=-1).astype(np.float32))
    whole, tiled = Sampler(device), Sampler(device, whole=12_000, tile=(64, 50))
    how = Sampling(premultiplied=True)
    for top, dtype in ((255, np.uint8), (65535, np.uint16), (1, np.float32)):
        pixels = (np.random.default_rng(0).random((150, 230, 4), np.float32) * top).astype(dtype)
        np.testing.assert_array_equal(tiled.apply(warp, pixels, how=how), whole.apply(warp, pixels, how=how))


@pytest.mark.parametrize("channels", [1, 3, 4])
@pytest.mark.parametrize("count", [2, 255])
def test_a_gif_of_few_colours_keeps_them(tmp_path: Path, channels: int, count: int) -> None:
    """Those of all frames together; with more, ffmpeg chooses among 64 levels of each channel."""
    random = np.random.default_rng(count)
    colours = random.permutation(256)[:count, None] if channels == 1 else random.integers(0, 256, (count, 3))
    frames = colours[random.integers(0, count, (4, 24, 32))].astype(np.uint8)
    if channels == 4:
        frames = np.concatenate([frames, random.choice([0, 255], (4, 24, 32, 1)).astype(np.uint8)], axis=-1)
    with animation_writer(tmp_path / "a.gif") as write:
        for frame in frames:
            write(frame)
    with Image.open(tmp_path / "a.gif") as image:
        for number, frame in enumerate(frames):
            image.seek(number)
            found, wanted = np.asarray(image.convert("RGBA")), Image.fromarray(frame.squeeze()).convert("RGBA")
            visible = np.asarray(wanted)[..., 3:] > 0
            np.testing.assert_array_equal(found[..., 3:] > 0, visible)
            np.testing.assert_array_equal(found * visible, np.asarray(wanted) * visible)

"""Pictures: every format in every depth and mode, read back by another program; and everything that can go wrong."""

from __future__ import annotations

import io
import os
import struct
import subprocess
import sys
import time
import zlib
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import imagecodecs
import numpy as np
import OpenEXR
import pytest
import tifffile
from PIL import Image, ImageCms, JpegImagePlugin, PngImagePlugin
from PIL.PngImagePlugin import PngInfo

from app.errors import UserError
from app.media import files
from app.media.codecs import jpeg, png
from app.media.codecs.cmyk import cmyk_to_rgb
from app.media.codecs.exr import read_channels
from app.media.codecs.metadata import upright_dpi
from app.media.depth import to_bits
from app.media.encoders import check_output
from app.media.ffmpeg import executable
from app.media.formats import FORMATS
from app.media.holding import unheld
from app.media.pictures import read_picture, write_picture
from app.model.picture import Picture, linear_to_srgb, srgb_to_linear
from app.work.jobs import Outputs

MODES = {1: "grey", 2: "grey+alpha", 3: "RGB", 4: "RGBA"}
SRGB = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
XMP = b'<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf tiff:Orientation="6"/></x:xmpmeta>'


def noise(channels: int, dtype: type, size: tuple[int, int] = (12, 10)) -> np.ndarray:
    values = np.random.default_rng(channels).random((*size, channels), dtype=np.float32)
    return values if dtype is np.float32 else (values * np.iinfo(dtype).max).astype(dtype)


def smooth(channels: int) -> np.ndarray:
    """8-bit pixels that lossy formats keep."""
    y, x = np.mgrid[0:48, 0:64]
    planes = np.stack([x * 3 + 20, y * 4 + 30, 240 - x * 2 - y, 255 - y * 3], axis=-1).astype(np.uint8)
    return planes[..., [[0], [0, 3], [0, 1, 2], [0, 1, 2, 3]][channels - 1]]


def with_opencv(path: Path) -> np.ndarray:
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    assert image is not None
    return image[..., None] if image.ndim == 2 else image[..., [2, 1, 0, 3][: image.shape[2]]]


def with_ffmpeg(path: Path, shape: tuple[int, ...]) -> np.ndarray:
    """The float planes ffmpeg makes of an EXR, which it orders G, B, R, A."""
    channels = shape[2]
    kind = {1: "grayf32le", 3: "gbrpf32le", 4: "gbrapf32le"}[channels]
    command = [executable(), "-v", "error", "-i", str(path), "-f", "rawvideo", "-pix_fmt", kind, "-"]
    raw = subprocess.run(command, capture_output=True, check=True).stdout
    planes = np.frombuffer(raw, np.float32).reshape(channels, *shape[:2])
    return np.moveaxis(planes if channels == 1 else planes[[2, 0, 1, 3][:channels]], 0, -1)


# Formats, depths and modes ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("channels", MODES, ids=MODES.get)
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_png_is_exact(tmp_path: Path, dtype: type, channels: int):
    pixels, path = noise(channels, dtype), tmp_path / "a.png"
    write_picture(path, Picture(pixels))
    read = read_picture(path).pixels
    assert read.dtype == dtype
    np.testing.assert_array_equal(read, pixels)
    # OpenCV makes RGBA of grey with alpha
    seen = with_opencv(path)
    np.testing.assert_array_equal(seen, pixels[..., [0, 0, 0, 1]] if channels == 2 else pixels)


@pytest.mark.parametrize("channels", MODES, ids=MODES.get)
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_tiff_is_exact(tmp_path: Path, dtype: type, channels: int):
    pixels, path = noise(channels, dtype), tmp_path / "a.tif"
    write_picture(path, Picture(pixels))
    read = read_picture(path).pixels
    assert read.dtype == dtype
    np.testing.assert_array_equal(read, pixels)
    if channels in (1, 3):
        np.testing.assert_array_equal(with_opencv(path), pixels)
    else:  # OpenCV has no grey with alpha, and premultiplies RGBA
        np.testing.assert_array_equal(tifffile.imread(path), pixels)
        with tifffile.TiffFile(path) as tiff:
            assert tiff.pages.first.extrasamples == (tifffile.EXTRASAMPLE.UNASSALPHA,)


@pytest.mark.parametrize("channels", MODES, ids=MODES.get)
def test_exr_is_exact(tmp_path: Path, channels: int):
    pixels, path = noise(channels, np.float32) * 4 - 1, tmp_path / "a.exr"
    if channels in (2, 4):
        pixels[..., -1] = noise(1, np.float32)[..., 0]
    write_picture(path, Picture(pixels))
    pixels = pixels[..., [0, 0, 0, 1]] if channels == 2 else pixels
    stored = pixels
    if channels in (2, 4):
        stored = np.concatenate([pixels[..., :3] * pixels[..., 3:], pixels[..., 3:]], axis=2)
    np.testing.assert_array_equal(with_ffmpeg(path, pixels.shape), stored)
    read = read_picture(path)
    assert read.pixels.dtype == np.float32
    assert read.linear
    np.testing.assert_array_equal(read.pixels, stored)
    np.testing.assert_allclose(read.straight().pixels, pixels, rtol=3e-7)


@pytest.mark.parametrize("bits", [10, 12])
@pytest.mark.parametrize("channels", [3, 4])
def test_a_deep_avif_is_read_in_its_depth(tmp_path: Path, bits: int, channels: int):
    import imagecodecs

    top = 2**bits - 1
    values = np.linspace(0, top, 40 * 48 * channels).round().astype(np.uint16).reshape(40, 48, channels)
    (tmp_path / "a.avif").write_bytes(
        imagecodecs.avif_encode(values, level=100, bitspersample=bits, pixelformat="444", matrix=0)
    )
    read = read_picture(tmp_path / "a.avif")
    assert read.pixels.dtype == np.uint16
    assert (read.pixels.min(), read.pixels.max()) == (0, 65535)
    np.testing.assert_array_equal(np.round(read.pixels / 65535 * top), values)


def test_a_pillow_without_avif_is_told_and_writes_all_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    picture = Picture(smooth(3))
    write_picture(tmp_path / "a.avif", picture)  # Pillow keeps what it has once found, for the tests after this one
    (tmp_path / "a.avif").unlink()
    monkeypatch.setitem(sys.modules, "PIL._avif", None)
    with pytest.raises(UserError, match="Pillow was built without AVIF; use another format or install Pillow"):
        write_picture(tmp_path / "a.avif", picture)
    for ending in (".webp", ".jpg", ".png"):
        write_picture(tmp_path / f"a{ending}", picture)
    assert {path.suffix for path in tmp_path.iterdir()} == {".webp", ".jpg", ".png"}


@pytest.mark.parametrize("channels", MODES, ids=MODES.get)
@pytest.mark.parametrize("ending", [".jpg", ".webp", ".avif"])
def test_lossy_formats_are_close(tmp_path: Path, ending: str, channels: int):
    pixels, path = smooth(channels), tmp_path / f"a{ending}"
    write_picture(path, Picture(pixels), background=(255, 255, 255))
    expected = pixels.astype(float)
    if ending == ".jpg" and channels in (2, 4):  # laid over the background
        opacity = expected[..., -1:] / 255
        expected = expected[..., :-1] * opacity + 255 * (1 - opacity)
    elif ending != ".jpg" and channels < 3:
        expected = expected[..., [0, 0, 0, 1][: channels + 2]]
    seen = with_opencv(path).astype(float)
    assert seen.shape == expected.shape
    assert np.abs(seen - expected).mean() < 2
    assert np.abs(read_picture(path).pixels - seen).mean() < 1
    if ending == ".jpg" and seen.shape[2] == 3:
        with Image.open(path) as image:
            assert JpegImagePlugin.get_sampling(image) == 0, "colours of full resolution"


def test_webp_at_full_quality_is_lossless(tmp_path: Path):
    pixels = noise(4, np.uint8)
    write_picture(tmp_path / "a.webp", Picture(pixels), quality=100)
    np.testing.assert_array_equal(np.asarray(Image.open(tmp_path / "a.webp")), pixels)


@pytest.mark.parametrize(
    ("ending", "depths"),
    [
        (".png", {8: np.uint8, 16: np.uint16, 32: np.uint16}),
        (".jpg", {8: np.uint8, 16: np.uint8, 32: np.uint8}),
        (".tif", {8: np.uint8, 16: np.uint16, 32: np.float32}),
        (".exr", {8: np.float32, 16: np.float32, 32: np.float32}),
    ],
)
def test_a_format_takes_the_nearest_depth_it_has(tmp_path: Path, ending: str, depths: dict[int, type]):
    for bits, dtype in depths.items():
        source = to_bits(smooth(3), bits, dither=False)
        write_picture(tmp_path / f"a{ending}", Picture(source))
        read = read_picture(tmp_path / f"a{ending}").pixels
        assert read.dtype == dtype
        assert np.abs(to_bits(read, 8).astype(int) - smooth(3)).mean() < 2
    write_picture(tmp_path / "b.tif", Picture(smooth(3)), bits=32)
    assert read_picture(tmp_path / "b.tif").bits == 32
    with pytest.raises(UserError, match=r"b\.jpg: JPEG holds 8 bits a channel, not 16"):
        write_picture(tmp_path / "b.jpg", Picture(smooth(3)), bits=16)


def test_changing_the_depth_keeps_exact_values_and_the_mean():
    every = np.arange(256, dtype=np.uint8).reshape(16, 16, 1)
    for bits in (16, 32):
        np.testing.assert_array_equal(to_bits(to_bits(every, bits), 8), every)
    every16 = np.arange(65536, dtype=np.uint16).reshape(256, 256, 1)
    np.testing.assert_array_equal(to_bits(to_bits(every16, 32), 16), every16)
    np.testing.assert_allclose(linear_to_srgb(srgb_to_linear(every / 255)), every / 255, atol=1e-12)
    # a flat grey between two steps comes out as their mixture, not as one of them
    between = np.full((200, 200, 3), int(100.25 * 257), np.uint16)
    assert to_bits(between, 8).mean() == pytest.approx(100.25, abs=0.01)
    alpha = np.full((4, 4, 4), 0.5, np.float32)
    assert to_bits(alpha, 16)[0, 0].tolist() == [48192, 48192, 48192, 32768]
    wild = np.array([[[np.nan, np.inf, -5]]], np.float32)
    with np.errstate(invalid="raise"):  # what no number becomes is ours to say, and not the machine's
        assert to_bits(wild, 8).tolist() == [[[0, 255, 0]]]


# What other programs write ------------------------------------------------------------------------------------------


def test_palettes_and_keyed_transparency(tmp_path: Path):
    rgb = smooth(3)
    Image.fromarray(rgb).quantize(16).save(tmp_path / "p.png")
    Image.fromarray(rgb).quantize(16).save(tmp_path / "p.gif")
    Image.fromarray(rgb).quantize(16).save(tmp_path / "t.png", transparency=3)
    Image.fromarray(rgb[..., 0]).save(tmp_path / "key.png", transparency=int(rgb[5, 5, 0]))
    Image.fromarray(rgb[..., 0] > 99).save(tmp_path / "bits.png")
    for name in ("p.png", "p.gif"):
        np.testing.assert_array_equal(
            read_picture(tmp_path / name).pixels, np.asarray(Image.open(tmp_path / name).convert("RGB"))
        )
    keyed = read_picture(tmp_path / "t.png").pixels
    assert keyed.shape[2] == 4
    assert set(np.unique(keyed[..., 3])) == {0, 255}
    grey = read_picture(tmp_path / "key.png").pixels
    assert grey.shape[2] == 2
    assert grey[5, 5, 1] == 0
    np.testing.assert_array_equal(read_picture(tmp_path / "bits.png").pixels[..., 0], (rgb[..., 0] > 99) * 255)


def cmyk_profile() -> bytes:
    """A small profile of CMYK to Lab, made of a table with two points a side, in which magenta ink looks green."""

    def fixed(*values: float) -> bytes:
        return b"".join(struct.pack(">i", round(value * 65536)) for value in values)

    table = bytearray()
    for c, m, y, k in np.ndindex(2, 2, 2, 2):
        lightness = (1 - k) * (1 - 0.2 * (c + m + y))
        table += bytes([round(255 * lightness), 128 - 60 * m, 128 + 40 * y - 40 * c])
    identity = bytes(range(256))
    lut = b"mft1" + bytes(4) + bytes([4, 3, 2, 0]) + fixed(1, 0, 0, 0, 1, 0, 0, 0, 1)
    lut += identity * 4 + bytes(table) + identity * 3
    lut += bytes(-len(lut) % 4)
    white = b"XYZ " + bytes(4) + fixed(0.9642, 1, 0.8249)
    text = b"text" + bytes(4) + b"test\0" + bytes(3)
    entries, offset, body = b"", 128 + 4 + 12 * 4, b""
    for name, data in ((b"A2B0", lut), (b"wtpt", white), (b"cprt", text), (b"desc", text)):
        entries += name + struct.pack(">II", offset + len(body), len(data))
        body += data
    head = struct.pack(">I4sI4s4s4s", 0, b"lcms", 0x02400000, b"prtr", b"CMYK", b"Lab ")
    head += bytes(12) + b"acsp" + bytes(28) + fixed(0.9642, 1, 0.8249) + bytes(48)
    profile = head + struct.pack(">I", 4) + entries + body
    return struct.pack(">I", len(profile)) + profile[4:]


@pytest.mark.parametrize("ending", ["jpg", "tif"])
def test_cmyk_becomes_rgb_through_its_profile(tmp_path: Path, ending: str):
    ink = np.zeros((32, 32, 4), np.uint8)
    ink[:, 16:, 1] = 255
    image = Image.frombytes("CMYK", (32, 32), ink.tobytes())
    image.save(tmp_path / f"plain.{ending}")
    image.save(tmp_path / f"managed.{ending}", icc_profile=cmyk_profile())
    plain, managed = read_picture(tmp_path / f"plain.{ending}"), read_picture(tmp_path / f"managed.{ending}")
    assert np.abs(plain.pixels[8, [4, 28]].astype(int) - [[255, 255, 255], [255, 0, 255]]).max() < 4
    assert plain.icc is None
    paper, magenta = managed.pixels[8, 4].astype(int), managed.pixels[8, 28].astype(int)
    assert paper.min() > 250
    assert magenta[1] > magenta[0] + 50
    assert managed.icc is not None
    assert managed.icc[16:20] == b"RGB "
    assert plain.note == f"plain.{ending}: its inks (CMYK) become RGB"
    assert managed.note == f"managed.{ending}: its inks (CMYK) become RGB by its colour profile (test)"
    image.save(tmp_path / f"other.{ending}", icc_profile=SRGB)
    image.save(tmp_path / f"broken.{ending}", icc_profile=cmyk_profile()[:200])
    for name, called in (("other", "sRGB built-in"), ("broken", "unnamed")):
        other = read_picture(tmp_path / f"{name}.{ending}")
        np.testing.assert_array_equal(other.pixels, plain.pixels)
        told = f"its inks (CMYK) become RGB without its colour profile ({called}), which is damaged or not for them"
        assert (other.icc, other.note) == (None, f"{name}.{ending}: {told}")


@pytest.mark.parametrize("compression", ["none", "lzw", "zlib", "packbits", "zstd", "lzma"])
def test_compressed_tiffs_of_16_bits(tmp_path: Path, compression: str):
    pixels = noise(3, np.uint16, (33, 40))
    predictor = compression in ("lzw", "zlib")
    tifffile.imwrite(tmp_path / "a.tif", pixels, photometric="rgb", compression=compression, predictor=predictor)
    np.testing.assert_array_equal(read_picture(tmp_path / "a.tif").pixels, pixels)


@pytest.mark.parametrize("size", [(1, 1), (1, 200), (2, 5000), (5000, 1), (127, 127), (1, 40_000)])
@pytest.mark.parametrize("channels", [1, 3, 4])
def test_noise_of_any_shape_is_a_png(size: tuple[int, int], channels: int, tmp_path: Path):
    for dtype in (np.uint8, np.uint16):
        pixels = np.random.default_rng(1).integers(0, np.iinfo(dtype).max, (size[1], size[0], channels), dtype, True)
        write_picture(tmp_path / "a.png", Picture(pixels))
        np.testing.assert_array_equal(read_picture(tmp_path / "a.png").pixels, pixels)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_inks_without_a_profile_are_multiplied(dtype: type):
    """What is left of the light: (1 - ink) (1 - black)."""
    inks = np.random.default_rng(2).integers(0, np.iinfo(dtype).max, (5, 7, 4), dtype, True)
    left = 1 - inks / np.iinfo(dtype).max
    pixels, icc, told = cmyk_to_rgb(inks, None)
    assert (icc, told) == (None, "its inks (CMYK) become RGB")
    assert pixels.dtype == dtype
    np.testing.assert_allclose(pixels, left[..., :3] * left[..., 3:] * np.iinfo(dtype).max, atol=0.5001)


def test_a_large_profile_in_a_png_is_kept_and_a_bomb_refused(tmp_path: Path):
    profile = cmyk_profile()[:16] + b"RGB " + cmyk_profile()[20:]
    large = profile + np.random.default_rng(0).bytes(2_000_000)
    write_picture(tmp_path / "a.png", Picture(smooth(3), icc=large))
    assert read_picture(tmp_path / "a.png").icc == large
    write_picture(tmp_path / "b.png", Picture(smooth(3), icc=profile + bytes(100_000_000)))
    assert (tmp_path / "b.png").stat().st_size < 200_000
    with pytest.raises(UserError, match=r"b\.png: .*too large"):
        read_picture(tmp_path / "b.png")


@pytest.mark.parametrize("writer", [{}, {"imagej": True}, {"ome": True}])
def test_a_description_of_the_layout_is_not_kept(tmp_path: Path, caplog: pytest.LogCaptureFixture, writer: dict):
    """It tells the size of the picture as it was, and tifffile takes it for the result's."""
    tifffile.imwrite(tmp_path / "a.tif", smooth(1)[..., 0], **writer)
    picture = read_picture(tmp_path / "a.tif")
    write_picture(tmp_path / "b.tif", picture.with_pixels(picture.pixels[::2, ::2]))
    with tifffile.TiffFile(tmp_path / "b.tif") as made:
        assert made.pages.first.description == ""
        assert made.series[0].shape == picture.pixels[::2, ::2, 0].shape
    assert not caplog.records


def test_odd_tiffs(tmp_path: Path):
    path = tmp_path / "a.tif"
    rgb = noise(3, np.uint8)
    tifffile.imwrite(path, np.moveaxis(rgb, -1, 0), photometric="rgb", planarconfig="separate", byteorder=">")
    np.testing.assert_array_equal(read_picture(path).pixels, rgb)
    tifffile.imwrite(path, rgb[..., 0], photometric="miniswhite")
    np.testing.assert_array_equal(read_picture(path).pixels, 255 - rgb[..., :1])
    tifffile.imwrite(path, rgb[..., 0], photometric="palette", colormap=np.arange(768, dtype=np.uint16).reshape(3, 256))
    np.testing.assert_array_equal(read_picture(path).pixels, rgb[..., :1] + np.array([0, 256, 512], np.uint16))
    tifffile.imwrite(path, noise(3, np.float32).astype(np.float16), photometric="rgb")
    assert read_picture(path).pixels.dtype == np.float32
    tifffile.imwrite(path, np.stack([rgb, rgb // 2]), photometric="rgb")  # two pages
    np.testing.assert_array_equal(read_picture(path).pixels, rgb)
    premultiplied = np.full((4, 4, 4), 64, np.uint8)
    premultiplied[..., 3] = 128
    tifffile.imwrite(path, premultiplied, photometric="rgb", extrasamples=["assocalpha"])
    assert read_picture(path).pixels[0, 0].tolist() == [64, 64, 64, 128]
    assert read_picture(path).straight().pixels[0, 0].tolist() == [128, 128, 128, 128]
    for other, bits in ((tmp_path / "same.png", None), (tmp_path / "deep.png", 16), (tmp_path / "deep.tif", 16)):
        write_picture(other, read_picture(path), bits=bits)
        again = read_picture(other)
        assert (again.premultiplied, again.pixels[0, 0].tolist()) == (False, 4 * [128 * (257 if bits else 1)])
    whole = noise(3, np.uint16).astype(np.uint32) * 65536 + 40_000
    tifffile.imwrite(path, whole, photometric="rgb")
    np.testing.assert_array_equal(read_picture(path).pixels, whole // 65536)
    for unsupported in (np.zeros((4, 4), np.complex64), np.zeros((4, 4), np.int16)):
        tifffile.imwrite(path, unsupported)
        with pytest.raises(UserError, match="convert to uint16 or float32"):
            read_picture(path)


def test_exr_with_other_windows_and_channels(tmp_path: Path):
    import OpenEXR

    def save(channels: dict, **header: object) -> Path:
        base = {"compression": OpenEXR.PIZ_COMPRESSION, "type": OpenEXR.scanlineimage}
        OpenEXR.File(base | header, channels).write(str(tmp_path / "a.exr"))
        return tmp_path / "a.exr"

    def window(*corners: int) -> tuple[np.ndarray, np.ndarray]:
        return np.array(corners[:2], np.int32), np.array(corners[2:], np.int32)

    plane = noise(1, np.float32, (5, 4))[..., 0]
    half = save({name: plane.astype(np.float16) for name in "RGB"})
    assert read_picture(half).pixels.dtype == np.float32
    np.testing.assert_array_equal(read_picture(half).pixels[..., 1], plane.astype(np.float16))
    # data that covers a part of the picture and sticks out of it
    shifted = save({"Y": plane}, dataWindow=window(-1, 2, 2, 6), displayWindow=window(0, 0, 9, 5))
    expected = np.zeros((6, 10), np.float32)
    expected[2:6, :3] = plane[:4, 1:]
    np.testing.assert_array_equal(read_picture(shifted).pixels[..., 0], expected)
    elsewhere = save({"Y": plane}, dataWindow=window(50, 50, 53, 54), displayWindow=window(0, 0, 9, 5))
    assert not read_picture(elsewhere).pixels.any()
    with pytest.raises(UserError, match="of its channels depth none are R G B or Y"):
        read_picture(save({"depth": plane}))


# What is lost -------------------------------------------------------------------------------------------------------


def test_what_of_an_exr_is_lost_is_told(tmp_path: Path):
    import OpenEXR

    plane = noise(1, np.float32, (5, 4))[..., 0]
    rgb = dict.fromkeys("RGB", plane)
    path = tmp_path / "shot.exr"

    def note(*parts: OpenEXR.Part) -> str:
        OpenEXR.File(list(parts)).write(str(path))
        return read_picture(path).note

    assert note(OpenEXR.Part({}, rgb)) == ""
    samples = np.empty(plane.shape, object)
    for at in np.ndindex(plane.shape):
        samples[at] = np.ones(2, np.float32)
    deep = {"type": OpenEXR.deepscanline, "compression": OpenEXR.ZIPS_COMPRESSION, "name": "deep\x1b[31m"}
    said = note(OpenEXR.Part({"name": "left"}, rgb), OpenEXR.Part(deep, {"Z": samples, "A": samples}))
    assert said == "shot.exr: its further part deep?[31m is not kept"


def with_chunks(path: Path, **chunks: bytes) -> str:
    """The note about a PNG that has these chunks."""
    Image.fromarray(smooth(3)).save(path)
    plain = path.read_bytes()
    added = b"".join(
        struct.pack(">I", len(data)) + name.encode() + data + struct.pack(">I", zlib.crc32(name.encode() + data))
        for name, data in chunks.items()
    )
    path.write_bytes(plain[:33] + added + plain[33:])
    return read_picture(path).note


def test_what_a_png_tells_of_its_colours_stays_and_is_told_where_it_matters(tmp_path: Path):
    path = tmp_path / "a.png"
    usual = struct.pack(">8I", 31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000)
    wide = struct.pack(">8I", 31270, 32900, 68000, 32000, 26500, 69000, 15000, 6000)
    light = struct.pack(">I", 100000)
    assert with_chunks(path) == ""
    assert with_chunks(path, gAMA=struct.pack(">I", 45455), cHRM=usual) == ""
    assert with_chunks(path, gAMA=light, sRGB=b"\0") == ""
    assert "in spite of its gamma of 0.55556 (gAMA)" in with_chunks(path, gAMA=struct.pack(">I", 55556))
    assert with_chunks(path, cICP=bytes([1, 13, 0, 1])) == ""
    said = with_chunks(path, gAMA=light, cHRM=wide)
    assert said == ("a.png: its colours are mixed as if sRGB, in spite of its gamma of 1 (gAMA) and primaries (cHRM)")
    assert "in spite of its gamma of 1 (gAMA)" in with_chunks(path, gAMA=light)
    said = with_chunks(path, cICP=bytes([9, 16, 0, 1]), gAMA=light, cLLI=bytes(8))
    assert said == "a.png: its colours are mixed as if sRGB, in spite of its BT.2020 PQ (cICP)"
    picture = read_picture(path)
    for given in (picture, picture.with_pixels(to_bits(picture.pixels, 16))):
        write_picture(tmp_path / "b.png", given, strip=True)
        kept = (tmp_path / "b.png").read_bytes()
        for name, data in {b"cICP": bytes([9, 16, 0, 1]), b"gAMA": light, b"cLLI": bytes(8)}.items():
            chunk = struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
            assert kept.count(chunk) == 1
            assert kept.index(chunk) < kept.index(b"IDAT")
        np.testing.assert_array_equal(with_opencv(tmp_path / "b.png"), given.pixels)


def test_what_of_a_png_is_not_kept_is_told(tmp_path: Path):
    path = tmp_path / "a.png"
    assert (
        with_chunks(path, sBIT=bytes([5, 6, 5])) == "a.png: what it says of its number of significant bits is not kept"
    )
    # The time of its last change (tIME) is no loss: the result was changed now.
    said = with_chunks(path, bKGD=bytes(6), sBIT=bytes([5, 6, 5]), tIME=struct.pack(">H5B", 2026, 1, 2, 3, 4, 5))
    assert said == "a.png: what it says of its background colour, number of significant bits is not kept"
    Image.fromarray(smooth(3)).save(path)
    data = path.read_bytes()  # it may come after the pixels
    chunk = (
        struct.pack(">I", 3) + b"sBIT" + bytes([5, 6, 5]) + struct.pack(">I", zlib.crc32(b"sBIT" + bytes([5, 6, 5])))
    )
    path.write_bytes(data[:-12] + chunk + data[-12:])
    assert read_picture(path).note == "a.png: what it says of its number of significant bits is not kept"


def test_every_chunk_of_a_png_is_kept_or_told(tmp_path: Path):
    path = tmp_path / "a.png"
    for name, data in {"oFFs": bytes(9), "sPLT": b"n\0\x08" + bytes(6), "prVt": b"a private one"}.items():
        assert with_chunks(path, **{name: data}) == f"a.png: its chunk {name} is not kept"
    assert with_chunks(path, iDOT=bytes(28), tEXt=b"Author\0A", iTXt=b"Title\0\0\0\0\0T") == ""
    assert with_chunks(path, tEXt=b"Author\0A", zTXt=b"Author\0\0" + zlib.compress(b"B")) == (
        "a.png: of several texts under one name only the last is kept: Author"
    )
    wide = struct.pack(">IIB", 2, 1, 0)  # no unit: only the shape of a pixel
    assert with_chunks(path, pHYs=wide) == "a.png: the shape of its pixels (2:1) is not kept"
    assert with_chunks(path, pHYs=struct.pack(">IIB", 1, 1, 0)) == ""
    assert with_chunks(path, pHYs=struct.pack(">IIB", 0, 1, 0)) == ""  # as ffmpeg writes what it does not know


def test_exif_in_a_text_of_a_png_is_written_once_and_upright(tmp_path: Path):
    """A reader of the text, whose orientation is still that of the file, would turn the picture again."""
    exif, info = Image.Exif(), PngInfo()
    exif[0x013B], exif[0x0112] = "somebody", 6
    raw = (b"Exif\0\0" + exif.tobytes()).hex()
    info.add_text("Raw profile type exif", f"\nexif\n{len(raw) // 2:8}\n{raw}\n", zip=True)
    Image.fromarray(smooth(3)[:16]).save(tmp_path / "a.png", pnginfo=info)
    picture = read_picture(tmp_path / "a.png")
    assert (picture.width, picture.note) == (16, "")
    write_picture(tmp_path / "b.png", picture)
    with Image.open(tmp_path / "b.png") as image:
        assert image.info.get("Raw profile type exif") is None
        assert (image.getexif()[0x013B], image.getexif().get(0x0112, 1)) == ("somebody", 1)


def test_what_of_a_png_is_damaged_or_left_behind_is_told(tmp_path: Path):
    path, profile = tmp_path / "a.png", ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    packed = zlib.compress(profile)
    assert with_chunks(path, iCCP=b"p\0\0" + packed) == ""
    for cut in (5, 90):
        said = with_chunks(path, iCCP=b"p\0\0" + packed[:cut])
        assert said == "a.png: its colour profile is damaged and not kept whole"
    text, word = b"Title\0\0", zlib.compress(b"a word")
    assert with_chunks(path, zTXt=text + word) == with_chunks(path, zTXt=text + zlib.compress(b"")) == ""
    assert with_chunks(path, tEXt=b"Title\0") == with_chunks(path, iTXt=text + b"\0\0\0") == ""
    assert with_chunks(path, zTXt=text + b"bad") == "a.png: its damaged text Title is not kept"
    assert with_chunks(path, tEXt=b"\0b") == "a.png: its damaged text without a name is not kept"
    said = with_chunks(path, iTXt=b"Title\0\0\0fr\0Titre\0Un titre")
    assert said == "a.png: the language of its text Title is not kept"
    assert with_chunks(path, iTXt=b"XML:com.adobe.xmp\0\0\0\0\0<x/>") == with_chunks(path, sBIT=bytes([8, 8, 8])) == ""
    path.write_bytes(path.read_bytes() + bytes(7))
    assert read_picture(path).note == "a.png: the 7 bytes after its end are not kept"
    once = with_chunks(path, iCCP=b"p\0\0" + packed)
    data, chunk = path.read_bytes(), path.read_bytes()[33 : 33 + 12 + 3 + len(packed)]
    path.write_bytes(data[:33] + chunk + data[33:])
    assert (once, read_picture(path).note) == ("", "a.png: of its 2 colour profiles only the last is kept")


def test_what_of_light_and_range_another_kind_cannot_tell_is_told(tmp_path: Path):
    path = tmp_path / "a.png"
    assert with_chunks(path, mDCV=bytes(24), cLLI=bytes(8)) == ""
    picture, light = read_picture(path), "mastering display (mDCV) and light levels (cLLI)"
    assert unheld("o.png", picture) == ""
    assert unheld("o.tif", picture) == f"o.tif cannot tell the picture's {light}; write .png to keep it"
    narrow = "a.png: its colours are mixed as if sRGB, in spite of its narrow range (cICP)"
    assert with_chunks(path, cICP=bytes([1, 13, 0, 0])) == narrow
    assert "cannot tell the picture's narrow range (cICP)" in unheld("o.tif", read_picture(path))


def test_xmp_that_is_no_utf_8_is_told_where_it_has_to_be(tmp_path: Path):
    picture = replace(Picture(np.zeros((2, 3, 3), np.uint8)), xmp=b"<x>\xff</x>")
    assert unheld("o.png", picture) == "o.png lacks the picture's XMP; write .tif to keep it"
    write_picture(tmp_path / "o.png", picture, strip=False)
    assert read_picture(tmp_path / "o.png").xmp is None


def test_a_profile_is_that_of_srgb_by_its_primaries_too() -> None:
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    count = int.from_bytes(profile[128:132], "big")
    tags = {
        profile[at : at + 4]: int.from_bytes(profile[at + 4 : at + 8], "big") for at in range(132, 132 + 12 * count, 12)
    }
    at = tags[b"rXYZ"] + 8  # X, in 65,536 parts
    wide = profile[:at] + struct.pack(">i", 39322) + profile[at + 4 :]
    pixels = np.zeros((2, 3, 3), np.uint8)
    assert unheld("o.exr", replace(Picture(pixels), icc=profile)) == ""
    said = unheld("o.exr", replace(Picture(pixels), icc=wide))
    assert "cannot hold the picture's colour profile (sRGB built-in), and is read as sRGB; write .png" in said


def test_colours_above_their_alpha_are_told_where_they_are_divided_by_it() -> None:
    pixels = np.full((2, 3, 4), 90, np.uint8)
    for alpha, told in ((90, ""), (89, "o.png cuts values above 1; write .tif to keep it")):
        pixels[0, 0, 3] = alpha
        picture = replace(Picture(pixels.copy()), premultiplied=True)
        assert (unheld("o.png", picture), unheld("o.tif", picture)) == (told, "")


def test_what_of_a_tiff_is_beside_its_first_page_or_cut_is_told(tmp_path: Path):
    path, pixels = tmp_path / "a.tif", smooth(3)
    rng = np.random.default_rng(0)
    seen = pixels[..., 0] > 9
    for kind, page, colours, said in (
        (1, pixels[::2], "rgb", "its smaller versions are not kept"),
        (4, seen, "mask", "its mask is not kept"),
    ):
        with tifffile.TiffWriter(path) as writer:
            writer.write(pixels, photometric="rgb")
            writer.write(page, photometric=colours, subfiletype=kind)
        assert read_picture(path).note == f"a.tif: {said}"
    with tifffile.TiffWriter(path) as writer:
        writer.write(pixels, photometric="rgb", subifds=1)
        writer.write(pixels[::2, ::2], photometric="rgb", subfiletype=1)
    assert read_picture(path).note == "a.tif: its smaller versions are not kept"
    for samples, said in (
        (rng.random((4, 5, 3)), "a.tif: its 64 bits become 32"),
        (rng.random((4, 5, 3)).astype(np.float32).astype(float), ""),
        (rng.integers(0, 2**32, (4, 5, 3), np.uint32), "a.tif: its 32 bits become 16"),
        (rng.integers(0, 2**16, (4, 5, 3), np.uint32) * 65537, ""),
    ):
        tifffile.imwrite(path, samples, photometric="rgb")
        assert read_picture(path).note == said
    tifffile.imwrite(path, pixels, photometric="ycbcr", subsampling=(1, 1))
    with pytest.raises(UserError, match=r"a TIFF in YCbCr is not supported but as JPEG; convert it to RGB\.$"):
        read_picture(path)


@pytest.mark.parametrize("bits", [1, 2, 4, 8])
def test_the_key_of_a_grey_png_is_in_its_own_bits(tmp_path: Path, bits: int):
    codes = np.random.default_rng(bits).integers(0, 2**bits, (4, 8), np.uint8)
    packed = np.packbits(np.unpackbits(codes[..., None], axis=2)[..., 8 - bits :].reshape(4, -1), axis=1)
    head = struct.pack(">IIBBBBB", 8, 4, bits, 0, 0, 0, 0)
    rows = zlib.compress(np.insert(packed, 0, 0, axis=1).tobytes())
    chunks = {b"IHDR": head, b"tRNS": struct.pack(">H", 1), b"IDAT": rows, b"IEND": b""}
    (tmp_path / "a.png").write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + b"".join(
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
            for kind, data in chunks.items()
        )
    )
    pixels = read_picture(tmp_path / "a.png").pixels
    np.testing.assert_array_equal(pixels[..., 0], codes.astype(int) * 255 // (2**bits - 1))
    np.testing.assert_array_equal(pixels[..., 1], np.where(codes == 1, 0, 255))


@pytest.mark.parametrize(
    ("options", "said"), [({"bitspersample": 12}, "of 12 bits a channel"), ({"lossless": True}, "without loss")]
)
def test_a_jpeg_that_no_decoder_reads_is_not_called_damaged(tmp_path: Path, options: dict[str, Any], said: str):
    import imagecodecs

    (tmp_path / "a.jpg").write_bytes(imagecodecs.jpeg_encode(noise(3, np.uint16) >> 4, **options))
    with pytest.raises(UserError, match=f"a JPEG {said} is not supported; convert it to a PNG or TIFF of 16 bits"):
        read_picture(tmp_path / "a.jpg")


@pytest.mark.parametrize("kind", [kind for kind in range(0xC0, 0xD0) if kind not in (0xC4, 0xC8, 0xCC)])
def test_every_way_of_a_jpeg_without_loss_is_told(tmp_path: Path, kind: int):
    """They are the fourth of each four (ITU T.81, table B.1); of the others none is taken for one."""
    Image.fromarray(smooth(3)).save(path := tmp_path / "a.jpg")
    data = path.read_bytes()
    at = data.index(b"\xff\xc0")
    path.write_bytes(data[:at] + bytes([0xFF, kind]) + data[at + 2 :])
    said = "a JPEG without loss is not supported" if kind % 4 == 3 else ""
    try:
        read_picture(path)
        told = ""
    except UserError as error:
        told = str(error)
    assert ("without loss" in told, said in told) == (bool(said), True)


def test_every_segment_of_a_jpeg_is_kept_or_told(tmp_path: Path):
    path = tmp_path / "a.jpg"
    Image.fromarray(smooth(3)).save(path, comment=b"a", dpi=(300, 300), exif=exif_bytes(), progressive=True)
    plain = path.read_bytes()
    assert read_picture(path).note == ""

    def told(*segments: tuple[int, bytes], after: bytes = b"") -> str:
        added = b"".join(bytes([255, kind]) + struct.pack(">H", len(data) + 2) + data for kind, data in segments)
        path.write_bytes(plain[:2] + added + plain[2:] + after)
        return read_picture(path).note

    assert told((0xED, b"Photoshop 3.0\0" + bytes(12)), (0xEB, b"JP\0\0")) == (
        "a.jpg: its segments APP13 Photoshop 3.0, APP11 JP are not kept"
    )
    assert told((0xFE, b"another")) == "a.jpg: of its 2 comments only the last is kept"
    assert told((0xE1, b"http://ns.adobe.com/xap/1.0/\0<x/>")) == ""
    assert told(after=b"\0\0\0\x18ftypmp42") == "a.jpg: the 12 bytes after its end are not kept"
    assert told(after=bytes(7)) == ""


def test_the_colours_of_an_avif_are_told(tmp_path: Path):
    import imagecodecs

    encoded = imagecodecs.avif_encode(smooth(3), level=100, primaries=9, transfer=16, matrix=0)
    (tmp_path / "a.avif").write_bytes(encoded)
    assert read_picture(tmp_path / "a.avif").note == (
        "a.avif: its colours are BT.2020 PQ (nclx) and are treated as sRGB"
    )
    assert read_picture(tmp_path / "a.avif").chunks == {b"cICP": bytes([9, 16, 0, 1])}  # of RGB, and of its full range
    write_picture(tmp_path / "a.avif", Picture(smooth(3)))
    assert read_picture(tmp_path / "a.avif").note == ""
    plain = (tmp_path / "a.avif").read_bytes()
    assert plain.count(b"colrnclx") == 1
    (tmp_path / "b.avif").write_bytes(plain.replace(b"colrnclx", b"freenclx"))  # which says nothing of them
    assert read_picture(tmp_path / "b.avif").note == ""


@pytest.mark.parametrize(("density", "exif", "said"), [
    ((0, 2, 1), {}, "a.jpg: the shape of its pixels (1:2) is not kept"),
    ((0, 1, 1), {}, ""),
    ((0, 0, 1), {}, ""),
    ((1, 72, 36), {}, ""),
    ((0, 2, 1), {282: 300.0, 283: 150.0, 296: 2}, ""),
])  # fmt: skip
def test_a_jpeg_of_pixels_that_are_not_square_is_told(
    tmp_path: Path, density: tuple[int, ...], exif: dict[int, float], said: str
):
    tags, buffer = Image.Exif(), io.BytesIO()
    tags.update(exif)
    Image.fromarray(smooth(3)).save(buffer, "JPEG", exif=tags.tobytes())
    data = buffer.getvalue()
    at = data.index(b"JFIF\0") + 7
    (tmp_path / "a.jpg").write_bytes(data[:at] + struct.pack(">BHH", *density) + data[at + 5 :])
    read = read_picture(tmp_path / "a.jpg")
    assert (read.note, read.dpi) == (said, (300, 150) if exif else (72, 36) if density[0] else None)


@pytest.mark.parametrize(
    ("name", "one"),
    [
        ("a.ppm", b"P6 9 8 255\n" + bytes(216)),
        ("a.pgm", b"P5 9 8 255\n" + bytes(72)),
        ("a.pgm", b"P5\n# 1\n9 8\n65535\n" + bytes(144)),
        ("a.pgm", b"P5 9 8 100\n" + bytes(72)),
        ("a.pbm", b"P4 9 8\n" + bytes(16)),
    ],
)
def test_further_pictures_of_a_netpbm_file_are_told(tmp_path: Path, name: str, one: bytes):
    for data, said in ((one, ""), (one + b"\n", ""), (one + one, f"{name}: the {len(one)} bytes after its first")):
        (tmp_path / name).write_bytes(data)
        told = read_picture(tmp_path / name)
        assert told.note.startswith(said)
        assert bool(told.note) == bool(said)
        assert (told.width, told.height) == (9, 8)


@pytest.mark.parametrize("bits", [1, 4, 10, 12])
def test_a_grey_jpeg_2000_is_white_where_it_is(tmp_path: Path, bits: int):
    kind = np.uint8 if bits <= 8 else np.uint16
    codes = np.random.default_rng(bits).integers(0, 2**bits, (8, 16), kind)
    (tmp_path / "a.jp2").write_bytes(imagecodecs.jpeg2k_encode(codes, level=0, reversible=True, bitspersample=bits))
    read = read_picture(tmp_path / "a.jp2")
    assert (read.pixels.dtype, read.note) == (kind, "")
    np.testing.assert_array_equal(read.pixels[..., 0], codes.astype(int) * np.iinfo(kind).max // (2**bits - 1))


@pytest.mark.parametrize(("bits", "channels"), [(8, 1), (8, 3), (16, 1), (16, 3)])
def test_a_codestream_alone_is_a_jpeg_2000_as_in_its_file(tmp_path: Path, bits: int, channels: int):
    """It has no boxes, of which any could be lost; and tells its depth as one in a file does."""
    kind = np.uint8 if bits == 8 else np.uint16
    codes = np.random.default_rng(bits).integers(0, 2**bits, (8, 16, channels), kind).squeeze()
    notes = []
    for name, codec in (("a.jp2", "jp2"), ("a.j2k", "j2k")):
        data = imagecodecs.jpeg2k_encode(codes, level=0, reversible=True, codecformat=codec)
        (tmp_path / name).write_bytes(data)
        read = read_picture(tmp_path / name)
        told = f"{name}: its 16 bits a channel become 8" if (bits, channels) == (16, 3) else ""
        assert (read.note, read.pixels.shape) == (told, (8, 16, channels))
        notes.append(read.pixels)
    np.testing.assert_array_equal(*notes)


def test_a_jpeg_2000_of_boxes_without_end_is_read_at_once(tmp_path: Path):
    import imagecodecs

    whole = imagecodecs.jpeg2k_encode(smooth(3), level=0)
    path, box = tmp_path / "a.jp2", struct.pack(">I", 8) + b"free"
    path.write_bytes(whole + box * 1_000_000)
    start = time.process_time()
    assert read_picture(path).note == "a.jp2: its box free is not kept"
    assert time.process_time() - start < 2


@pytest.mark.parametrize("ending", [".gif", ".png", ".webp", ".tif", ".jpg", ".avif"])
def test_further_frames_and_pages_are_told(tmp_path: Path, ending: str):
    path = tmp_path / f"a{ending}"
    pictures = [Image.fromarray(np.roll(smooth(3), number, axis=1)) for number in range(3)]
    kind = {".jpg": "MPO"}.get(ending)
    pictures[0].save(path, kind, save_all=True, append_images=pictures[1:])
    what = {".tif": "pages", ".jpg": "pictures"}.get(ending, "frames")
    read = read_picture(path)
    assert read.note == f"a{ending}: of its 3 {what} only the first is used"
    assert np.abs(read.pixels.astype(int) - np.asarray(Image.open(path).convert("RGB"))).mean() < 1
    pictures[0].save(path)
    assert read_picture(path).note == ""


def test_what_of_a_tiff_is_lost_is_told(tmp_path: Path):
    path = tmp_path / "a.tif"
    for pixels, said in {
        "uint32": (noise(1, np.uint16)[..., 0].astype(np.uint32), "its 32 bits become 16"),
        "float64": (noise(1, np.float32)[..., 0] / np.float64(3), "its 64 bits become 32"),
        "float16": (noise(1, np.float32)[..., 0].astype(np.float16), ""),
    }.values():
        tifffile.imwrite(path, pixels)
        assert read_picture(path).note == (said and f"a.tif: {said}")
    tifffile.imwrite(
        path, np.dstack([noise(4, np.uint8), noise(2, np.uint8)]), photometric="rgb", planarconfig="contig"
    )
    said = "a.tif: of its 6 samples a pixel only the first 4 are used; its sample 4 is of no kind that it names"
    assert read_picture(path).note == f"{said}, and is taken for alpha"
    Image.frombytes("CMYK", (32, 32), bytes(32 * 32 * 4)).save(path)
    assert read_picture(path).note == "a.tif: its inks (CMYK) become RGB"
    with tifffile.TiffWriter(path) as writer:  # a smaller version of the same picture is no page of its own
        writer.write(smooth(3), photometric="rgb")
        writer.write(smooth(3)[::2, ::2], photometric="rgb", subfiletype=1)
    assert read_picture(path).note == "a.tif: its smaller versions are not kept"


def test_every_tag_of_a_tiff_is_kept_or_told(tmp_path: Path):
    path = tmp_path / "a.tif"
    texts = [(0x010D, "s", 0, "a document", True), (0x011D, "s", 0, "a page", True), (0x013C, "s", 0, "a host", True)]
    further = [(318, "2I", 2, (3127, 10000, 3290, 10000), True), (33550, "d", 3, (1.0, 1.0, 0.0), True)]
    tifffile.imwrite(path, smooth(3), photometric="rgb", extratags=texts + further, resolution=(300, 300))
    picture = read_picture(path)
    assert picture.note == "a.tif: its tags WhitePoint, ModelPixelScaleTag are not kept"
    write_picture(tmp_path / "b.tif", picture)
    with tifffile.TiffFile(tmp_path / "b.tif") as tiff:
        tags = {tag.code: tag.value for tag in tiff.pages.first.tags}
    assert [tags[code] for code, *_ in texts] == ["a document", "a page", "a host"]
    tifffile.imwrite(path, smooth(3), photometric="rgb", resolution=(2, 1), resolutionunit="NONE")
    assert read_picture(path).note == "a.tif: the shape of its pixels (1:2) is not kept"


def test_further_samples_of_a_tiff_are_no_colours(tmp_path: Path):
    path = tmp_path / "a.tif"
    grey, inks = noise(3, np.uint8), noise(4, np.uint8)
    tifffile.imwrite(path, grey, photometric="minisblack", planarconfig="contig", extrasamples=["unassalpha", 0])
    picture = read_picture(path)
    np.testing.assert_array_equal(picture.pixels, grey[..., :2])
    assert picture.note == "a.tif: of its 3 samples a pixel only the first 2 are used"
    pixels = np.dstack([inks, inks[..., 0]])
    tifffile.imwrite(path, pixels, photometric="separated", planarconfig="contig", extrasamples=["unassalpha"])
    said = "a.tif: of its 5 samples a pixel only the first 4 are used; its inks (CMYK) become RGB"
    assert read_picture(path).note == said


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_alpha_is_no_ink(tmp_path: Path, dtype: type):
    path, most = tmp_path / "a.tif", np.iinfo(dtype).max
    ink = np.array([[[0, 0], [0, most], [most // 4, most // 2], [most, most]]], dtype)  # from white to black
    options: dict[str, Any] = {"photometric": "miniswhite", "planarconfig": "contig"}
    tifffile.imwrite(path, ink, extrasamples=["unassalpha"], **options)
    light = [[most, 0], [most, most], [most - most // 4, most // 2], [0, most]]
    assert read_picture(path).pixels[0].tolist() == light
    tifffile.imwrite(path, ink, extrasamples=["assocalpha"], **options)
    light = [[0, 0], [most, most], [most // 2 - most // 4, most // 2], [0, most]]
    assert read_picture(path).pixels[0].tolist() == light
    assert read_picture(path).premultiplied


def test_a_sample_of_a_tiff_that_may_be_alpha_is_told(tmp_path: Path):
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, noise(4, np.uint8), photometric="rgb", extrasamples=["unspecified"])
    assert read_picture(path).note == "a.tif: its sample 4 is of no kind that it names, and is taken for alpha"


@pytest.mark.parametrize("spread", [256, 257])
def test_a_palette_of_8_bits_is_one(tmp_path: Path, spread: int):
    colours = np.random.default_rng(0).integers(0, 256, (3, 256), np.uint16)
    codes = noise(1, np.uint8)[..., 0]
    tifffile.imwrite(tmp_path / "a.tif", codes, photometric="palette", colormap=colours * np.uint16(spread))
    pixels = read_picture(tmp_path / "a.tif").pixels
    assert pixels.dtype == np.uint8
    np.testing.assert_array_equal(pixels, np.moveaxis(colours, 0, -1)[codes])


BITS = [*((bits, kind, None) for bits in (2, 4, 6, 10, 12, 14) for kind in ("minisblack", "miniswhite", "rgb"))]


@pytest.mark.parametrize(("bits", "photometric", "compression"), [*BITS, (12, "rgb", "jpeg2000")])
def test_samples_of_any_bits_of_a_tiff_are_white_where_they_are(
    tmp_path: Path, bits: int, photometric: str, compression: str | None
):
    kind, top = (np.uint8, 2**bits - 1) if bits <= 8 else (np.uint16, 2**bits - 1)
    codes = np.random.default_rng(bits).integers(0, 2**bits, (9, 11, 3 if photometric == "rgb" else 1), kind)
    codes[0, 0], codes[0, 1] = 0, top
    plain = codes if photometric == "rgb" else codes[..., 0]
    path, most = tmp_path / "a.tif", np.iinfo(kind).max
    tifffile.imwrite(path, plain, photometric=photometric, bitspersample=bits, compression=compression)
    told = tifffile.imread(path).reshape(codes.shape).astype(int) * most // top
    read = read_picture(path)
    assert (read.pixels.dtype, read.note) == (kind, "")
    np.testing.assert_array_equal(read.pixels, most - told if photometric == "miniswhite" else told)


def test_a_palette_of_one_bit_has_two_colours(tmp_path: Path):
    codes = np.random.default_rng(0).integers(0, 2, (8, 16), np.uint8)
    colours = np.array([[9, 8, 7], [250, 120, 60]], np.uint8)
    tifffile.imwrite(tmp_path / "a.tif", codes.astype(bool), photometric="minisblack", extratags=[
        (320, "H", 6, (colours.T.astype(int) * 257).ravel().tolist(), True)
    ])  # fmt: skip
    data = (tmp_path / "a.tif").read_bytes()
    entry = struct.pack("<HHIH", 262, 3, 1, 1)  # how the samples are meant: 3 is through the palette
    assert data.count(entry) == 1
    (tmp_path / "a.tif").write_bytes(data.replace(entry, struct.pack("<HHIH", 262, 3, 1, 3)))
    np.testing.assert_array_equal(read_picture(tmp_path / "a.tif").pixels, colours[codes])


@pytest.mark.parametrize(("bits", "named"), [((5, 6, 5), "5, 6, 5"), ((24, 24, 24), "24")])
def test_a_tiff_of_odd_bits_is_refused(tmp_path: Path, bits: tuple[int, ...], named: str):
    tifffile.imwrite(tmp_path / "a.tif", noise(3, np.uint8), photometric="rgb")
    data = (tmp_path / "a.tif").read_bytes()
    assert data.count(struct.pack("<3H", 8, 8, 8)) == 1
    (tmp_path / "a.tif").write_bytes(data.replace(struct.pack("<3H", 8, 8, 8), struct.pack("<3H", *bits)))
    with pytest.raises(UserError, match=f"{named} bits a channel of a TIFF are not supported; convert it to 16"):
        read_picture(tmp_path / "a.tif")


# What belongs to a picture ------------------------------------------------------------------------------------------


def exif_bytes(orientation: int = 1) -> bytes:
    exif = Image.Exif()
    exif[0x0112] = orientation
    exif[0x010F] = "A camera"
    exif.get_ifd(0x8769)[0x9003] = "2020:01:02 03:04:05"
    exif.get_ifd(0x8769)[0xA002] = 9999
    exif.get_ifd(0x8825)[1] = "N"
    return exif.tobytes()


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize("ending", ["png", "jpg", "webp", "tif", "png16", "tif16"])
def test_pictures_are_read_upright(tmp_path: Path, ending: str, orientation: int):
    pixels = smooth(3)
    path = tmp_path / f"a.{ending.removesuffix('16')}"
    if ending == "tif16":
        tag = (274, "H", 1, orientation, True)
        tifffile.imwrite(path, to_bits(pixels, 16), photometric="rgb", extratags=[tag])
    elif ending == "png16":
        write_picture(path, Picture(to_bits(pixels, 16), exif=exif_bytes(orientation)))
    elif ending == "tif":
        Image.fromarray(pixels).save(path, tiffinfo={274: orientation})
    else:
        Image.fromarray(pixels).save(path, exif=exif_bytes(orientation))
    # what turns the picture upright, as Pillow has it
    turns = [None, None, 0, 3, 1, 5, 4, 6, 2][orientation]
    expected = Image.fromarray(pixels)
    expected = np.asarray(expected if turns is None else expected.transpose(Image.Transpose(turns)))
    read = read_picture(path)
    assert np.abs(to_bits(read.pixels, 8).astype(int) - expected).mean() < 3
    write_picture(tmp_path / "b.png", read)
    assert Image.open(tmp_path / "b.png").getexif().get(0x0112, 1) == 1


@pytest.mark.parametrize("ending", [".png", ".jpg", ".webp", ".avif", ".tif"])
def test_profile_and_metadata_are_kept_or_stripped(tmp_path: Path, ending: str):
    given = Picture(smooth(3), icc=SRGB, exif=exif_bytes(), xmp=XMP, dpi=(300, 300), texts={"Comment": "hübsch"})
    path = tmp_path / f"a{ending}"
    write_picture(path, given)
    with Image.open(path) as image:  # another program's view
        image.load()
        assert image.info["icc_profile"] == SRGB
        exif = image.getexif()
        assert exif[0x010F] == "A camera"
        assert exif.get_ifd(0x8769)[0x9003] == "2020:01:02 03:04:05"
        assert exif.get_ifd(0x8769)[0xA002] == 64
        assert b"adobe:ns:meta" in (image.info["xmp"] if "xmp" in image.info else bytes(exif[700]))
    read = read_picture(path)
    assert read.note == ""
    assert read.icc == SRGB
    assert read.exif is not None
    again = Image.Exif()
    again.load(read.exif)
    assert again.get_ifd(0x8769)[0x9003] == "2020:01:02 03:04:05"
    assert again.get_ifd(0x8825)[1] == "N"
    assert read.xmp is not None
    assert b'Orientation="1"' in read.xmp
    assert read.dpi == pytest.approx((300, 300), abs=0.01)
    if ending in (".png", ".jpg"):
        assert read.texts["Comment"] == "hübsch"
    write_picture(path, given, strip=True)
    stripped = read_picture(path)
    assert stripped.icc == SRGB
    assert not stripped.exif
    assert not stripped.xmp
    assert not stripped.texts


@pytest.mark.parametrize(
    ("name", "held"), [("Ö", "Ö"), ("α", "?"), ("α to ω", "? to ?"), ("x" * 80, "x" * 79), ("α" * 80, "?" * 79)]
)
def test_a_text_whose_name_no_png_can_have_has_one_that_it_can(tmp_path: Path, name: str, held: str):
    """A name is 1 to 79 letters of Latin-1."""
    write_picture(tmp_path / "a.png", Picture(smooth(3), texts={name: "said"}))
    with Image.open(tmp_path / "a.png") as image:  # another program's view
        assert isinstance(image, PngImagePlugin.PngImageFile)
        assert image.text == {held: "said"}
    assert dict(read_picture(tmp_path / "a.png").texts) == {held: "said"}


@pytest.mark.parametrize("ending", ["avif", "jpg", "png", "tif", "webp"])
def test_a_resolution_that_is_asked_for_stands_in_the_file_and_in_its_exif(tmp_path: Path, ending: str):
    exif = Image.Exif()
    exif.update({282: 72.0, 283: 72.0, 296: 3, 271: "Maker"})
    for given in (Picture(smooth(3)), Picture(smooth(3), exif=exif.tobytes(), dpi=(72.0, 36.0))):
        path = tmp_path / f"a.{ending}"
        write_picture(path, given, dpi=300.0)
        assert read_picture(path).dpi == pytest.approx((300, 300), abs=0.01)
        with Image.open(path) as image:
            told = image.getexif()
            assert [told.get(code) for code in (282, 283, 296)] in ([300, 300, 2], [None] * 3)
            assert told.get(271) == ("Maker" if given.exif else None)


@pytest.mark.parametrize("ending", ["jpg", "png", "tif"])
def test_narrow_pixels_of_a_turned_picture_are_turned_too(tmp_path: Path, ending: str):
    path, image = tmp_path / f"a.{ending}", Image.fromarray(smooth(3))
    tags: dict[str, Any] = {"tiffinfo": {274: 6}} if ending == "tif" else {"exif": exif_bytes(6)}
    image.save(path, dpi=(300, 150), **tags)
    assert read_picture(path).dpi == pytest.approx((150, 300), abs=0.1)
    image.save(path, dpi=(300, 150))
    assert read_picture(path).dpi == pytest.approx((300, 150), abs=0.1)
    if ending == "tif":
        image.save(path, tiffinfo={296: 3, 282: 100.0, 283: 50.0})  # a centimetre
        assert read_picture(path).dpi == pytest.approx((254, 127), abs=0.1)


def test_16_bit_png_and_exr_keep_their_metadata(tmp_path: Path):
    given = Picture(noise(4, np.uint16), icc=SRGB, exif=exif_bytes(), xmp=XMP, texts={"Title": "Ö"})
    write_picture(tmp_path / "a.png", given)
    np.testing.assert_array_equal(with_opencv(tmp_path / "a.png"), given.pixels)
    read = read_picture(tmp_path / "a.png")
    assert (read.icc, dict(read.texts)) == (SRGB, {"Title": "Ö"})
    primaries = (0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.329)
    given = Picture(noise(3, np.float32), chromaticities=primaries, texts={"owner": "me"})
    write_picture(tmp_path / "a.exr", given)
    _, header = read_channels(tmp_path / "a.exr")
    assert header["owner"] == "me"
    assert read_picture(tmp_path / "a.exr").chromaticities == pytest.approx(primaries)


def test_a_profile_of_the_other_kind_is_not_written(tmp_path: Path):
    write_picture(tmp_path / "a.png", Picture(noise(1, np.uint8), icc=SRGB))
    assert read_picture(tmp_path / "a.png").icc is None


# What can go wrong --------------------------------------------------------------------------------------------------


ENDINGS = [".png", ".16.png", ".jpg", ".webp", ".avif", ".tif", ".exr"]


def saved(folder: Path, ending: str) -> Path:
    path = folder / f"picture{ending}"
    write_picture(path, Picture(noise(3, np.uint16 if "16" in ending else np.uint8, (64, 64))))
    return path


@pytest.mark.parametrize("part", [0.03, 0.3, 0.6, 0.95])
@pytest.mark.parametrize("ending", ENDINGS)
def test_truncated_files(tmp_path: Path, capfd: pytest.CaptureFixture, ending: str, part: float):
    path = saved(tmp_path, ending)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(len(whole) * part)])
    outputs = [os.fstat(number) for number in (1, 2)]
    with pytest.raises(UserError, match="truncated or damaged") as raised:
        read_picture(path)
    assert str(path) in str(raised.value)
    assert capfd.readouterr() == ("", "")
    assert all(map(os.path.samestat, outputs, [os.fstat(number) for number in (1, 2)]))


@pytest.mark.parametrize("ending", ENDINGS)
def test_corrupt_files_are_read_or_refused_in_a_sentence(tmp_path: Path, ending: str):
    path = saved(tmp_path, ending)
    whole = path.read_bytes()
    random = np.random.default_rng(1)
    read, refused = 0, list[str]()
    for _ in range(40):
        damaged = bytearray(whole)
        for position in random.integers(4, len(whole) if random.random() < 0.5 else 200, 6):
            damaged[position] = random.integers(256)
        path.write_bytes(damaged)
        try:
            read += bool(read_picture(path, max_pixels=10_000_000).width)
        except UserError as error:
            refused.append(str(error))
    assert read + len(refused) == 40
    assert all(f"{path.name}: " in words and "\n" not in words for words in refused), refused
    assert refused


def test_no_picture_at_all(tmp_path: Path):
    (tmp_path / "empty.png").touch()
    (tmp_path / "junk.png").write_bytes(b"<!doctype html>" * 40)
    with pytest.raises(UserError, match=r"missing\.png: there is no such file"):
        read_picture(tmp_path / "missing.png")
    with pytest.raises(UserError, match=r"empty\.png: the file is empty"):
        read_picture(tmp_path / "empty.png")
    with pytest.raises(UserError, match=r"junk\.png: it is not a picture of a known kind"):
        read_picture(tmp_path / "junk.png")
    with pytest.raises(UserError, match="it is a folder"):
        read_picture(tmp_path)


@pytest.mark.parametrize("ending", [".png", ".jpg", ".tif", ".exr"])
def test_bombs_are_refused_until_the_limit_is_raised(tmp_path: Path, ending: str):
    path = saved(tmp_path, ending)
    with pytest.raises(UserError, match=r"64 x 64 pixels are more than the limit of 4000;.*--max-pixels 4096"):
        read_picture(path, max_pixels=4000)
    assert read_picture(path, max_pixels=4096).width == 64


def test_an_enormous_claim_is_refused_before_decoding(tmp_path: Path):
    path = tmp_path / "bomb.png"
    header = b"IHDR" + struct.pack(">IIBBBBB", 60000, 60000, 8, 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + header + struct.pack(">I", zlib.crc32(header)))
    with path.open("ab") as stream:
        PngImagePlugin.putchunk(stream, b"IDAT", b"")
    with pytest.raises(UserError, match=r"60000 x 60000 pixels are more than the limit"):
        read_picture(path)


def test_of_a_png_no_more_chunks_are_looked_at_than_a_bound(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    write_picture(tmp_path / "a.png", Picture(smooth(3)))
    data = (tmp_path / "a.png").read_bytes()
    count, at = 0, 8
    while at < len(data):
        at, count = at + 12 + int.from_bytes(data[at : at + 4], "big"), count + 1
    monkeypatch.setattr(png, "MOST_CHUNKS", count)
    assert read_picture(tmp_path / "a.png").width
    (tmp_path / "longer.png").write_bytes(data + bytes(1000))  # what is behind its end is no chunk
    assert read_picture(tmp_path / "longer.png").width
    monkeypatch.setattr(png, "MOST_CHUNKS", count - 1)
    with pytest.raises(UserError, match=rf"a\.png: it has more than {count - 1} chunks; save it anew"):
        read_picture(tmp_path / "a.png")


def test_names_that_cannot_be_written(tmp_path: Path):
    picture = Picture(smooth(3))
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "device.png").symlink_to("/dev/null")
    (tmp_path / "file").touch()
    for name, message in {
        "a.bmp": "must end in one of .png .jpg",
        "a": "must end in one of",
        "folder.png": "it is a folder",
        "nowhere/a.png": "there is no folder",
        "file/a.png": "a part of its path is a file; choose another folder",
        "file/in/a.png": "a part of its path is a file; choose another folder",
        "device.png": "it is not an ordinary file",
    }.items():
        with pytest.raises(UserError, match=message):
            write_picture(tmp_path / name, picture)
    for name, message in {
        tmp_path / "a": "a picture's name must end in one of .* an animation's in",
        tmp_path: "it is a folder; give the name of a file in it",
        "/dev/null": "it is not an ordinary file; give another name",
        tmp_path / "nowhere" / "a": "there is no folder",
    }.items():
        with pytest.raises(UserError, match=f"^Cannot write {name}: {message}"):
            check_output(name)
    reading, writing = os.pipe()
    with pytest.raises(UserError, match="it is not an ordinary file; give another name"):
        check_output(f"/dev/fd/{writing}")
    os.close(reading)
    os.close(writing)
    with pytest.raises(UserError, match="WebP holds no side longer than 16383; make it smaller"):
        write_picture(tmp_path / "a.webp", Picture(np.zeros((1, 17000, 3), np.uint8)))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["device.png", "file", "folder.png"]


@pytest.mark.parametrize("name", ["x.png", "work.fluidwarp"])
def test_a_file_that_is_read_only_is_not_replaced(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A rename over it asks for no permission but the folder's; of root nothing is kept, so that is played here."""
    (tmp_path / name).write_bytes(b"before")
    (tmp_path / name).chmod(0o444)
    monkeypatch.setattr("os.access", lambda path, mode: not (mode & os.W_OK) or os.stat(path).st_mode & 0o200 > 0)
    said = "that file is read-only; change its permissions or give another name"
    with pytest.raises(UserError, match=said), files.replacing(tmp_path / name):
        pytest.fail("it was begun")
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [(name, b"before")]


def test_a_file_without_permission_to_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.png").write_bytes(b"")

    def refused(*_: object) -> int:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "open", refused)
    with pytest.raises(UserError, match=r"Cannot read .*a.png: no permission to read it; change its permissions\.$"):
        read_picture(tmp_path / "a.png")


def test_a_folder_without_permission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(os, "access", lambda path, mode: False)  # root may write anywhere
    with pytest.raises(UserError, match="no permission; choose another folder"):
        write_picture(tmp_path / "a.png", Picture(smooth(3)))


def test_a_disk_that_is_read_only_is_not_taken_for_permissions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    there = tmp_path / "there.png"
    there.write_bytes(b"before")
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    monkeypatch.setattr(os, "statvfs", lambda path: SimpleNamespace(f_flag=os.ST_RDONLY))
    for path, check in (
        (there, files.writable),
        (tmp_path / "new.png", files.writable),
        (tmp_path, files.check_folder),
    ):
        with pytest.raises(UserError) as error:
            check(path)
        assert str(error.value) == f"Cannot write {path}: the disk is read-only; choose another folder."


def full_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make every temporary file a link to the device that is always full."""

    def link(path: Path) -> Path:
        temporary = path.with_name(f".full{path.suffix}")
        temporary.symlink_to("/dev/full")
        return temporary

    monkeypatch.setattr(files, "temporary_beside", link)


@pytest.mark.parametrize("ending", [".png", ".jpg", ".webp", ".avif", ".tif", ".exr"])
def test_a_full_disk_leaves_what_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ending: str):
    path = tmp_path / f"a{ending}"
    path.write_bytes(b"earlier")
    full_disk(monkeypatch)
    with pytest.raises(UserError, match=f"a{ending}: the disk is full; free some space"):
        write_picture(path, Picture(smooth(3)))
    assert path.read_bytes() == b"earlier"
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def test_writing_through_a_link_keeps_the_link(tmp_path: Path):
    (tmp_path / "link.png").symlink_to(tmp_path / "real.png")
    write_picture(tmp_path / "link.png", Picture(smooth(3)))
    assert (tmp_path / "link.png").is_symlink()
    assert read_picture(tmp_path / "real.png").width == 64
    assert (tmp_path / "real.png").stat().st_mode & 0o777 == 0o666 & ~_umask()


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


@pytest.mark.parametrize("quality", [90, 100])
def test_noise_fits_into_a_jpeg(tmp_path: Path, quality: int) -> None:
    """The file is larger than what an encoder guesses of a picture of this size."""
    noise = np.random.default_rng(0).integers(0, 256, (400, 400, 3), dtype=np.uint8)
    write_picture(tmp_path / "noise.jpg", Picture(noise), quality=quality)
    with Image.open(tmp_path / "noise.jpg") as image:
        assert np.asarray(image).shape == (400, 400, 3)


# Formats we only read -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ending", [".bmp", ".tga", ".ppm", ".pcx", ".sgi", ".qoi", ".dds", ".jp2"])
def test_other_programs_formats_are_read(tmp_path: Path, ending: str):
    """Written by Pillow, read exactly."""
    y, x = np.mgrid[0:48, 0:64]
    pixels = np.stack([x * 4, y * 5, (x * y) % 256], axis=-1).astype(np.uint8)
    path = tmp_path / f"a{ending}"
    Image.fromarray(pixels).save(path)
    read = read_picture(path)
    assert np.array_equal(read.pixels, pixels)
    with pytest.raises(UserError, match=r"--max-pixels 3072"):
        read_picture(path, max_pixels=100)
    path.write_bytes(path.read_bytes()[:50])
    with pytest.raises(UserError, match=r"truncated or damaged"):
        read_picture(path)


def test_other_formats_in_their_depth(tmp_path: Path):
    ramp = (np.arange(48 * 64).reshape(48, 64) * 21).astype(np.uint16)
    Image.fromarray(ramp).save(tmp_path / "deep.pgm")
    assert np.array_equal(read_picture(tmp_path / "deep.pgm").pixels[..., 0], ramp)
    Image.fromarray(ramp > 9999).save(tmp_path / "line.pbm")
    assert np.array_equal(read_picture(tmp_path / "line.pbm").pixels[..., 0], (ramp > 9999) * np.uint8(255))
    clear = np.dstack([np.full((32, 32, 3), 90, np.uint8), np.arange(1024, dtype=np.uint16).reshape(32, 32) // 4 + 0])
    Image.fromarray(clear.astype(np.uint8)).save(tmp_path / "a.ico", sizes=[(32, 32)])
    assert np.array_equal(read_picture(tmp_path / "a.ico").pixels, clear)
    (tmp_path / "deep.ppm").write_bytes(b"P6\n# by hand\n4 4\n65535\n" + bytes(96))
    with pytest.raises(UserError, match="16-bit colours"):
        read_picture(tmp_path / "deep.ppm")


def test_a_tiff_whose_one_strip_is_longer_than_it_says_is_read(tmp_path: Path):
    pixels = noise(3, np.uint8)
    tifffile.imwrite(tmp_path / "a.tif", pixels, photometric="rgb")
    with tifffile.TiffFile(tmp_path / "a.tif", mode="r+") as tiff:
        tiff.pages.first.tags["RowsPerStrip"].overwrite(2)
    assert np.array_equal(read_picture(tmp_path / "a.tif").pixels, pixels)


def test_a_tiff_that_lacks_strips_is_told_and_not_filled(tmp_path: Path):
    """However many it claims: a few hundred bytes would become gigabytes of zeros."""
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, np.full((16, 16, 3), 7, np.uint8), photometric="rgb", compression="zlib", rowsperstrip=8)
    read_picture(path)
    data = bytearray(path.read_bytes())
    with tifffile.TiffFile(path) as tiff:
        place = tiff.pages.first.tags["ImageLength"].valueoffset
    data[place : place + 2] = (8000).to_bytes(2, "little")
    path.write_bytes(data)
    with pytest.raises(UserError, match=r"a\.tif: the TIFF file is truncated .*it has 2 of its 1000 strips or tiles"):
        read_picture(path)


def test_damaged_exif_of_a_tiff_costs_no_picture_and_is_told(tmp_path: Path) -> None:
    """Whose place of it is the end of the file, of which Pillow only warns."""
    exif = Image.Exif()
    exif.get_ifd(0x8769)[0x9003] = "2020:01:02 03:04:05"
    path = tmp_path / "a.tif"
    write_picture(path, Picture(smooth(3), exif=exif.tobytes()))
    assert read_picture(path).note == ""
    data = path.read_bytes()
    at = data.index(struct.pack("<HHI", 0x8769, 4, 1)) + 8
    path.write_bytes(data[:at] + struct.pack("<I", len(data) - 1) + data[at + 4 :])
    read = read_picture(path)
    assert read.note == "a.tif: its EXIF is damaged and not kept whole"
    np.testing.assert_array_equal(read.pixels, smooth(3))


@pytest.mark.parametrize("ending", [".jpg", ".png", ".webp"])
def test_damaged_exif_costs_no_picture_and_is_told(tmp_path: Path, ending: str) -> None:
    exif = Image.Exif()
    exif[0x010F], exif[0x0110] = "A camera", "Of the first kind"
    whole = exif.tobytes()
    for damaged in (whole[:-9], whole.replace(b"\0\x08\0\x02", b"\0\x08\0\x09")):  # cut off; of nine tags and not two
        path = tmp_path / f"a{ending}"
        Image.fromarray(np.zeros((8, 8, 3), np.uint8)).save(path, exif=damaged)
        assert read_picture(path).note == f"a{ending}: its EXIF is damaged and not kept whole"
    Image.fromarray(np.zeros((8, 8, 3), np.uint8)).save(path, exif=whole)
    assert not read_picture(path).note


@pytest.mark.parametrize("ending", [".jpg", ".png", ".webp"])
def test_a_thumbnail_in_the_exif_is_told(tmp_path: Path, ending: str) -> None:
    """It shows the picture as it was, and a warp makes it wrong."""
    small = io.BytesIO()
    Image.fromarray(np.zeros((4, 4, 3), np.uint8)).save(small, "JPEG")
    first = struct.pack("<HHHIII", 1, 0x0112, 3, 1, 1, 26)  # upright; the next directory
    second = struct.pack("<HHHIIHHIII", 2, 0x0201, 4, 1, 56, 0x0202, 4, 1, len(small.getvalue()), 0)
    path = tmp_path / f"a{ending}"
    exif = b"Exif\0\0II*\0" + struct.pack("<I", 8) + first + second + small.getvalue()
    Image.fromarray(np.zeros((8, 8, 3), np.uint8)).save(path, exif=exif)
    assert read_picture(path).note == f"a{ending}: its thumbnail is not kept"
    write_picture(tmp_path / f"b{ending}", read_picture(path))
    assert small.getvalue() not in (tmp_path / f"b{ending}").read_bytes()
    assert not read_picture(tmp_path / f"b{ending}").note


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="no /proc")
def test_a_folder_that_takes_no_new_files_is_not_told_as_gone() -> None:
    with pytest.raises(UserError, match=r"Cannot write /proc/nope\.png: its folder takes no new files"):
        write_picture(Path("/proc/nope.png"), Picture(smooth(3)))


@pytest.mark.parametrize("count", [1, 2, 3])
def test_the_largest_of_an_icons_pictures_is_read_and_the_others_are_told(tmp_path: Path, count: int) -> None:
    sides = [(16, 16), (48, 48), (32, 32)][-count:]
    largest = Image.fromarray(np.random.default_rng(0).integers(0, 256, (48, 48, 3), np.uint8))
    largest.resize(max(sides)).save(tmp_path / "a.ico", sizes=sides)
    read = read_picture(tmp_path / "a.ico")
    assert (read.width, read.height) == max(sides)
    assert read.note == (f"a.ico: of its {count} pictures only the largest is used" if count > 1 else "")


@pytest.mark.parametrize(("has_text", "has_extension"), [(False, False), (True, False), (False, True), (True, True)])
def test_what_a_tga_says_before_and_after_its_pixels_is_told(
    tmp_path: Path, has_text: bool, has_extension: bool
) -> None:
    path = tmp_path / "a.tga"
    Image.fromarray(smooth(3)).save(path, id_section=b"a shot" if has_text else b"")
    if has_extension:
        end = struct.pack("<II18s", path.stat().st_size, 0, b"TRUEVISION-XFILE.\0")
        path.write_bytes(path.read_bytes() + bytes(495) + end)
    parts = ["its text is not kept"] * has_text + ["its extension is not kept"] * has_extension
    assert read_picture(path).note == (f"a.tga: {'; '.join(parts)}" if parts else "")


@pytest.mark.parametrize(("code", "note"), [(95, "a.dds: its floats become 8 bits a channel"), (98, "")])
def test_floats_in_a_dds_are_told(tmp_path: Path, code: int, note: str) -> None:
    """One block of 4 x 4 pixels, of DXGI's formats BC6H_UF16 and BC7_UNORM."""
    head = struct.pack("<4s7I44x", b"DDS ", 124, 0x1007, 4, 4, 16, 0, 0)
    pixels = struct.pack("<2I4s5I", 32, 4, b"DX10", 0, 0, 0, 0, 0) + struct.pack("<5I", 0x1000, 0, 0, 0, 0)
    path = tmp_path / "a.dds"
    path.write_bytes(head + pixels + struct.pack("<5I", code, 3, 0, 1, 0) + b"\x40" + bytes(15))
    assert read_picture(path).note == note


def test_jpeg_is_not_asked_for_a_part_of_a_dot_per_inch(tmp_path: Path) -> None:
    for dpi in (72.5, 71.12, 72.0):  # the second is 28 a centimetre
        outputs = Outputs(tmp_path / "a.jpg", dpi=dpi)
        if dpi != 72.5:
            outputs.check()
        else:
            with pytest.raises(UserError, match=r"JPEG holds whole dots per inch, not 72\.5"):
                outputs.check()


def test_a_jpeg_counts_dots_by_the_inch_or_the_centimetre_whichever_is_nearer_where_it_is_less_near() -> None:
    dice = np.random.default_rng(0)
    for dpi in dice.uniform(20, 400, (200, 2)).tolist():
        ways = [[unit * round(value / unit) for value in dpi] for unit in (1.0, 2.54)]
        least = min(max(abs(a - b) for a, b in zip(way, dpi, strict=True)) for way in ways)
        held = jpeg.held_dpi((dpi[0], dpi[1]))
        assert max(abs(a - b) for a, b in zip(held, dpi, strict=True)) == pytest.approx(least, abs=1e-5)


@pytest.mark.parametrize(
    ("given", "held", "told"),
    [
        ((72.0, 72.0), (72.0, 72.0), ""),
        ((72.009, 72.009), (72.0, 72.0), ""),  # as a PNG says 72
        ((71.12, 142.24), (71.12, 142.24), ""),  # 28 and 56 a centimetre
        ((72.5, 72.5), (72.0, 72.0), "a.jpg says 72 dpi and not 72.5 as the picture: JPEG holds whole numbers"),
        ((50.8, 0.2), (51.0, 1.0), "a.jpg says 51 x 1 dpi and not 50.8 x 0.2 as the picture"),
        ((254.0, 1e6), (254.0, 65535 * 2.54), "a.jpg says 254 x 166459 dpi and not 254 x 1e+06"),
    ],
)
def test_a_jpeg_is_as_dense_as_the_picture_or_it_is_told(
    tmp_path: Path, given: tuple[float, float], held: tuple[float, float], told: str
) -> None:
    path, picture = tmp_path / "a.jpg", Picture(smooth(3), dpi=given)
    write_picture(path, picture)
    with Image.open(path) as image:
        assert image.info["dpi"] == pytest.approx(held, abs=1e-6)
        np.testing.assert_allclose(np.asarray(image), smooth(3), atol=30)
    assert unheld(path, picture).startswith(told)
    assert bool(unheld(path, picture)) == bool(told)
    assert not unheld(tmp_path / "a.tif", picture)
    assert not unheld(path, picture, with_dpi=False)
    assert unheld(path, read_picture(path)) == ""


def told_dpi(path: Path) -> tuple[float, float] | None:
    """Dots an inch along x and y as Pillow finds them, OpenEXR or tifffile."""
    if path.suffix in (".tif", ".tiff"):
        with tifffile.TiffFile(path) as tiff:
            tags = tiff.pages.first.tags
            x, y = (tags[code].value[0] / tags[code].value[1] for code in (282, 283))
            return (x, y) if tags[296].value == 2 else None
    if path.suffix == ".exr":
        header = OpenEXR.File(str(path), header_only=True).header()
        x = header.get("xDensity")
        return None if x is None else (x, x * header["pixelAspectRatio"])
    with Image.open(path) as image:
        exif = image.getexif()
        if image.info.get("dpi") or 282 not in exif:
            return image.info.get("dpi")
        assert exif[296] == 2
        return float(exif[282]), float(exif[283])


@pytest.mark.parametrize("ending", FORMATS)
@pytest.mark.parametrize("dpi", [(300.0, 300.0), (300.0, 150.0), (72.0, 36.0)])
def test_every_format_tells_another_program_the_dots_per_inch(
    tmp_path: Path, ending: str, dpi: tuple[float, float]
) -> None:
    path, exif = tmp_path / f"a{ending}", Image.Exif()
    exif.update({271: "Maker", 282: 118.0, 283: 118.0, 296: 3})  # of the camera: another one, a centimetre
    for given in (Picture(smooth(3), dpi=dpi), Picture(smooth(3), dpi=dpi, exif=exif.tobytes())):
        if ending in (".webp", ".avif", ".exr") or not given.exif:
            write_picture(path, given)
            assert told_dpi(path) == pytest.approx(dpi, abs=0.02)
            assert read_picture(path).dpi == pytest.approx(dpi, abs=0.02)
            assert "dpi" not in unheld(path, given)
    write_picture(path, replace(given, dpi=None, exif=None))
    assert told_dpi(path) is None
    write_picture(path, given, strip=True)
    assert told_dpi(path) is None


@pytest.mark.parametrize("ending", [".webp", ".avif"])
def test_dots_per_inch_that_stand_in_exif_are_read_there(tmp_path: Path, ending: str) -> None:
    path, exif = tmp_path / f"a{ending}", Image.Exif()
    exif.update({282: 100.0, 283: 50.0, 296: 3, 274: 6})  # a centimetre, and turned
    Image.fromarray(smooth(3)).save(path, exif=exif)
    assert read_picture(path).dpi == pytest.approx((127, 254))
    write_picture(tmp_path / "b.png", read_picture(path))
    assert told_dpi(tmp_path / "b.png") == pytest.approx((127, 254), abs=0.02)
    with Image.open(tmp_path / "b.png") as image:
        assert [image.getexif()[code] for code in (282, 283, 296, 274)] == [50, 100, 3, 1]
    exif.update({296: 1, 274: 1})  # the shape of a pixel alone
    Image.fromarray(smooth(3)).save(path, exif=exif)
    assert read_picture(path).dpi is None
    exif[296] = 2
    assert struct.pack(">HH", 282, 5) in exif.tobytes()  # a fraction, of which a text is made
    damaged = exif.tobytes().replace(struct.pack(">HH", 282, 5), struct.pack(">HH", 282, 2))
    Image.fromarray(smooth(3)).save(path, exif=damaged)
    assert read_picture(path).dpi is None


@pytest.mark.parametrize("aspect", [1.0, 2.0])
def test_the_density_of_an_exr_is_that_of_what_is_made_of_it(tmp_path: Path, aspect: float) -> None:
    with (tmp_path / "a.exr").open("wb") as stream:
        told = {"xDensity": 72.1, "pixelAspectRatio": aspect, "type": OpenEXR.scanlineimage}
        OpenEXR.File(told, {name: np.zeros((4, 5), np.float32) for name in "RGB"}).write(stream)
    before = OpenEXR.File(str(tmp_path / "a.exr"), header_only=True).header()
    for ending in FORMATS:
        path, picture = tmp_path / f"b{ending}", read_picture(tmp_path / "a.exr")
        write_picture(path, picture)
        told = unheld(path, picture)
        assert ("dpi" in told) == (ending in (".jpg", ".jpeg"))
        assert told_dpi(path) == pytest.approx((72.1, 72.1 * aspect), abs=0.5 if told else 0.02)
    after = OpenEXR.File(str(tmp_path / "b.exr"), header_only=True).header()
    assert [after[name] for name in ("xDensity", "pixelAspectRatio")] == [before["xDensity"], aspect]
    write_picture(path, picture, dpi=300.0)  # a pixel stays as long as it is seen
    assert told_dpi(path) == pytest.approx((300, 300 * aspect))


@pytest.mark.parametrize("dots", [(2**30, 1), (1, 2**30), (2**32 - 1, 1)])
def test_dots_per_inch_that_nothing_prints_do_no_harm(tmp_path: Path, dots: tuple[int, int]) -> None:
    Image.fromarray(smooth(3)).save(tmp_path / "a.tif", dpi=(72.0, 72.0))
    data = (tmp_path / "a.tif").read_bytes()
    (tmp_path / "a.tif").write_bytes(data.replace(struct.pack("<II", 72, 1), struct.pack("<II", *dots)))
    picture = read_picture(tmp_path / "a.tif")
    for ending in FORMATS:
        path = tmp_path / f"b{ending}"
        write_picture(path, picture)
        assert (read_picture(path).dpi is None) == (picture.dpi is None)
    assert (picture.dpi is None) == (dots[0] == 2**32 - 1)
    most_of_png = "b.png says 5.45461e+07 dpi and not 1.07374e+09 as the picture: PNG holds whole numbers"
    told = f"{most_of_png}; write .tif to keep it" if dots[0] == 2**30 else ""
    assert unheld(tmp_path / "b.png", picture) == told


def test_dots_per_inch_that_are_no_number_are_none(tmp_path: Path) -> None:
    Image.fromarray(smooth(3)).save(tmp_path / "a.tif", dpi=(72.0, 72.0))
    whole = (tmp_path / "a.tif").read_bytes()
    assert struct.pack("<II", 72, 1) in whole
    for below in (0, 1):
        data = whole.replace(struct.pack("<II", 72, 1), struct.pack("<II", 72, below))
        (tmp_path / "b.tif").write_bytes(data)
        assert (read_picture(tmp_path / "b.tif").dpi is None) == (below == 0)


@pytest.mark.parametrize(
    ("dpi", "kept"),
    [
        ((300, 200), True),
        ((2**31 - 1, 2**31 - 1), True),
        ((2**31, 2**31), False),
        ((2**-31, 2**-31), False),
        ((1, 999_999), True),
        ((1, 1_000_000), False),
        ((1_000_000, 1), False),
        ((0, 72), False),
        ((72, -72), False),
        ((float("nan"), 72), False),
        ((72,), False),
        ((), False),
        (None, False),
    ],
)
def test_dots_an_inch_are_kept_upright_if_every_file_can_hold_them(dpi: Any, kept: bool):
    """Turned by a quarter (EXIF's orientations 5 to 8), those along x are those along y."""
    for orientation in range(1, 9):
        turned = tuple(reversed(dpi)) if dpi and orientation >= 5 else dpi
        assert upright_dpi(dpi, orientation) == (turned if kept else None)

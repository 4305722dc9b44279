"""Real photographs warped by other programs through the maps we export: OpenCV and ffmpeg come to our own render."""

from __future__ import annotations

import subprocess
from pathlib import Path

import cv2
import numpy as np
import pytest

from app.media import ffmpeg
from app.media.codecs.exr import read_channels
from app.media.maps import read_map
from app.media.opening import open_recipe
from app.media.pictures import read_picture
from app.model.picture import linear_to_srgb, srgb_to_linear
from app.progress import Progress
from app.work.export import run
from app.work.jobs import Job, MapOutput, Outputs
from solver.gl.device import Device
from solver.resample.plan import GivenMap, Sampling
from solver.resample.sampler import Sampler

PHOTOGRAPHS = ["coffee", "cat", "rocket"]  # recipes of photographs of 600 x 400, 451 x 300 and 640 x 427 pixels
FINER = 4
BORDER = 3  # pixels beside which a program's way with edges shows
PLAIN = Sampling("bilinear", "clamp", samples=1, linear_light=False)


@pytest.fixture(scope="module", params=PHOTOGRAPHS)
def warped(request: pytest.FixtureRequest, shared_device: Device, tmp_path_factory: pytest.TempPathFactory):
    """A photograph, its warp's ST map in a file, and its places as another program reads them."""
    opened = open_recipe(request.param)
    photograph = opened.source().picture
    path = tmp_path_factory.mktemp("maps") / f"{request.param}.exr"
    recipe = opened.recipe.edited(duration=min(0.8, opened.recipe.duration))
    run(shared_device, Job(recipe, photograph, opened.folder, Outputs(None, maps=MapOutput(path))), Progress())
    x, y = places(path, photograph.width, photograph.height)
    moved = np.hypot(x - np.arange(photograph.width), y - np.arange(photograph.height)[:, None])
    assert moved.max() > 10  # pixels: there is something to be seen
    return photograph.pixels, path, x, y


def places(path: Path, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """An ST map's places in the pixels of a picture, as OpenCV counts them."""
    channels, _ = read_channels(path)
    return channels["R"] * np.float32(width) - np.float32(0.5), (1 - channels["G"]) * np.float32(height) - np.float32(
        0.5
    )


def inside(x: np.ndarray, y: np.ndarray, finer: int = 1) -> np.ndarray:
    """Where everything that a pixel is made of lies away from the border, and so does the pixel."""
    height, width = x.shape[0] // finer, x.shape[1] // finer
    away = np.zeros(x.shape, bool)
    edge = BORDER * finer
    away[edge:-edge, edge:-edge] = True
    return away & (x >= BORDER) & (x <= width - 1 - BORDER) & (y >= BORDER) & (y <= height - 1 - BORDER)


def applied(device: Device, path: Path, pixels: np.ndarray, how: Sampling) -> np.ndarray:
    given = read_map(path).fitted(pixels.shape[1], pixels.shape[0])
    return Sampler(device).apply(GivenMap(device, given.values), pixels, how=how)


def test_bilinear_is_opencv_s_on_photographs(device: Device, warped):
    """Within 1/255 everywhere inside, of exact arithmetic and of OpenCV's own 8 bits."""
    pixels, path, x, y = warped
    ours = applied(device, path, pixels, PLAIN).astype(float)
    exact = cv2.remap(pixels.astype(np.float32), x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    assert np.abs(ours - exact)[inside(x, y)].max() <= 1
    codes = cv2.remap(pixels, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    assert np.abs(ours - codes)[inside(x, y)].max() <= 1


def bend(places: np.ndarray) -> np.ndarray:
    """By how much, in pixels, the way between FINER x FINER places changes in each pixel or at its border."""
    found = np.zeros_like(places)
    found[1:-1] = np.abs(np.diff(places, 2, axis=0))
    found[:, 1:-1] = np.maximum(found[:, 1:-1], np.abs(np.diff(places, 2, axis=1)))
    height, width = (side // FINER for side in places.shape)
    return found.reshape(height, FINER, width, FINER).max(axis=(1, 3))


@pytest.mark.parametrize("name", PHOTOGRAPHS)
def test_opencv_comes_to_our_render_by_our_map(device: Device, tmp_path: Path, name: str):
    """A whole export, and OpenCV's mean over the pixel by the map of that export at four times the size.

    Of the photograph out of focus, so that what is compared is the map and the light, and not two interpolations.
    """
    opened = open_recipe(name)
    source = opened.source().picture
    soft = cv2.GaussianBlur(source.pixels, (0, 0), 4)
    recipe = opened.recipe.edited(duration=min(0.8, opened.recipe.duration), edges="clamp")
    maps = MapOutput(tmp_path / "a.exr", size=FINER * max(soft.shape))
    run(
        device, Job(recipe, source.with_pixels(soft), opened.folder, Outputs(tmp_path / "a.png", maps=maps)), Progress()
    )
    ours = read_picture(tmp_path / "a.png").pixels.astype(float)
    x, y = places(tmp_path / "a.exr", soft.shape[1], soft.shape[0])
    light = srgb_to_linear(soft / 255.0).astype(np.float32)
    fine = cv2.remap(light, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    theirs = 255 * linear_to_srgb(cv2.resize(fine, soft.shape[1::-1], interpolation=cv2.INTER_AREA))
    within = inside(x, y, FINER).reshape(soft.shape[0], FINER, soft.shape[1], FINER).all(axis=(1, 3))
    assert within.mean() > 0.7
    # Ours is straight within a pixel. A map bent sharper than that, as beside frozen ground, is a case of its own.
    straight = within & (np.maximum(bend(x), bend(y)) < 0.05)
    assert straight.sum() > 0.99 * within.sum()
    difference = np.abs(ours - theirs)
    assert difference[straight].max() <= 2
    assert difference[within].max() <= 7


def test_ffmpeg_comes_to_our_render_by_our_map(device: Device, warped, tmp_path: Path):
    """ffmpeg's `remap` takes whole pixels and does not interpolate.

    So it is asked for the nearest pixel, which must be ours to the bit but where the place lies on the line between
    two; and for the four neighbours, which are mixed here, and must be our bilinear render within 2/255.
    """
    pixels, path, x, y = warped
    nearest = remapped(tmp_path, pixels, np.floor(x + 0.5), np.floor(y + 0.5))
    ours = applied(device, path, pixels, Sampling("nearest", "clamp"))
    on_a_line = np.maximum(np.abs(x % 1 - 0.5) < 1e-3, np.abs(y % 1 - 0.5) < 1e-3)
    assert on_a_line.mean() < 0.05
    np.testing.assert_array_equal(ours[inside(x, y) & ~on_a_line], nearest[inside(x, y) & ~on_a_line])

    left, top = np.floor(x), np.floor(y)
    fx, fy = (x - left)[..., None], (y - top)[..., None]
    a, b, c, d = (remapped(tmp_path, pixels, left + i, top + j).astype(float) for j in (0, 1) for i in (0, 1))
    mixed = (a * (1 - fx) + b * fx) * (1 - fy) + (c * (1 - fx) + d * fx) * fy
    bilinear = applied(device, path, pixels, PLAIN).astype(float)
    assert np.abs(bilinear - mixed)[inside(x, y)].max() <= 2


def remapped(folder: Path, pixels: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The pixels at whole places, by ffmpeg."""
    height, width = x.shape
    cv2.imwrite(str(folder / "in.png"), pixels[..., ::-1])
    for name, places, count in (("x", x, width), ("y", y, height)):
        cv2.imwrite(str(folder / f"{name}.png"), np.clip(places, 0, count - 1).astype(np.uint16))
    inputs = [word for name in ("in", "x", "y") for word in ("-i", str(folder / f"{name}.png"))]
    maps = "[0]format=gbrp[a];[1]format=gray16le[b];[2]format=gray16le[c];[a][b][c]remap=format=color,format=rgb24"
    command = [ffmpeg.executable(), "-v", "error", *inputs, "-lavfi", maps, "-f", "rawvideo", "-"]
    told = subprocess.run(command, capture_output=True, check=True).stdout
    return np.frombuffer(told, np.uint8).reshape(height, width, 3)


def test_the_comparison_would_notice_half_a_pixel(device: Device, warped):
    """The usual mistake with ST maps: x / W in place of (x + .5) / W."""
    pixels, path, x, y = warped
    soft = cv2.GaussianBlur(pixels, (0, 0), 4)
    off = cv2.remap(soft, x + np.float32(0.5), y + np.float32(0.5), cv2.INTER_LINEAR)
    ours = applied(device, path, soft, PLAIN).astype(float)
    assert np.abs(ours - off)[inside(x, y)].max() > 4

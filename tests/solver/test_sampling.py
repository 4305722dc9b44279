"""Looking pictures up: exact where nothing moves, like OpenCV, the same in tiles, right in light and alpha."""

from __future__ import annotations

import itertools
import math
from typing import Any

import cv2
import numpy as np
import pytest
from PIL import Image
from scipy import ndimage

from solver.gl.device import Device
from solver.gl.passes import Region
from solver.grid import Grid
from solver.resample.plan import Edges, GivenMap, Plan, Sampling, SamplingError
from solver.resample.sampler import Sampler
from solver.resample.tiles import Piece, Tiling, edge_index, halves_of, overlap, rectangles
from solver.resample.transfer import PictureTexture
from solver.warp.map import WarpMap

KINDS = {"8": (np.uint8, 255), "16": (np.uint16, 65535), "float": (np.float32, 1)}


def noise(shape: tuple[int, ...], kind: str, seed: int = 0) -> np.ndarray:
    dtype, top = KINDS[kind]
    return (np.random.default_rng(seed).random(shape) * top).astype(dtype)


def waves(size: tuple[int, int], amplitude: float, seed: int = 0) -> np.ndarray:
    """A smooth random displacement (h, w, 2)."""
    rng = np.random.default_rng(seed)
    field = np.stack([ndimage.gaussian_filter(rng.standard_normal(size[::-1]), 8) for _ in "xy"], axis=-1)
    return (amplitude * field / np.abs(field).max()).astype(np.float32)


def shift(size: tuple[int, int], x: float, y: float) -> np.ndarray:
    """A displacement by (x, y) pixels everywhere."""
    return np.tile(np.array([x, y], np.float32) / max(size), (size[1], size[0], 1))


def srgb_to_linear(code: np.ndarray) -> np.ndarray:
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


def linear_to_srgb(light: np.ndarray) -> np.ndarray:
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 0) ** (1 / 2.4) - 0.055)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("channels", [0, 1, 2, 3, 4])
def test_identity_returns_the_picture_bit_for_bit(device: Device, kind: str, channels: int) -> None:
    picture = noise((61, 83, channels) if channels else (61, 83), kind)
    warp = WarpMap(device, Grid(16, 12))
    sampler = Sampler(device)
    for how in (
        Sampling(),
        Sampling("bilinear", samples=1),
        Sampling("nearest", linear_light=False),
        Sampling(dither=True, edges="clamp"),
    ):
        np.testing.assert_array_equal(sampler.apply(warp, picture, how=how), picture)


def test_a_shift_by_whole_pixels_is_exact_and_what_comes_in_is_empty(device: Device) -> None:
    picture = noise((40, 60, 4), "8")
    found = Sampler(device).apply(GivenMap(device, shift((60, 40), 7, -3)), picture)
    np.testing.assert_array_equal(found[3:, :53], picture[:37, 7:])
    assert not found[:2].any()
    assert not found[:, 54:].any()


@pytest.mark.parametrize("size", [(640, 480), (300, 700)])
def test_bilinear_agrees_with_opencv(device: Device, size: tuple[int, int]) -> None:
    width, height = size
    picture = noise((height, width, 3), "8")
    displacement = waves(size, 0.06)
    pixels = displacement * max(size)
    x = np.arange(width, dtype=np.float32) + pixels[..., 0]
    y = np.arange(height, dtype=np.float32)[:, None] + pixels[..., 1]
    wanted = cv2.remap(picture.astype(np.float32), x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    how = Sampling("bilinear", "clamp", samples=1, linear_light=False)
    found = Sampler(device).apply(GivenMap(device, displacement), picture, how=how)
    assert np.abs(found - wanted).max() <= 1.0


@pytest.mark.parametrize("channels", [1, 3, 4])
@pytest.mark.parametrize("kind", KINDS)
def test_bilinear_is_so_in_both_directions(device: Device, kind: str, channels: int) -> None:
    """Not half way, so that no weight is another one; in light, against float64."""
    dtype, top = KINDS[kind]
    values = np.random.default_rng(8).random((30, 44, channels))
    values[..., 3:] = 1.0
    picture = (np.round(values * top) if top > 1 else values).astype(dtype)
    light = picture / top if kind == "float" else srgb_to_linear(picture / top)
    right, down = 0.3, 0.2
    rows = (1 - right) * light[:, :-1] + right * light[:, 1:]
    wanted = (1 - down) * rows[:-1] + down * rows[1:]
    wanted = wanted if kind == "float" else linear_to_srgb(wanted)
    how = Sampling("bilinear", "clamp", samples=1, dither=False)
    found = Sampler(device).apply(GivenMap(device, shift((44, 30), right, down)), picture, how=how)[:-1, :-1] / top
    np.testing.assert_allclose(found, wanted, atol=1.1 / top if kind == "8" else 1e-4)


@pytest.mark.parametrize("edges", ["transparent", "black", "clamp", "mirror", "wrap"])
def test_tiles_are_the_same_to_the_bit(device: Device, edges: str) -> None:
    warp = GivenMap(device, waves((230, 150), 0.2))
    whole, tiled = Sampler(device), Sampler(device, whole=5_000, tile=(43, 34))
    kinds = noise((98, 150, 3), "8"), noise((98, 151, 4), "8"), noise((98, 150, 2), "16"), noise((98, 150), "float")
    for picture, size, samples in itertools.product(kinds, (None, (197, 124)), ("auto", 1)):
        how = Sampling(edges=edges, samples=samples)  # type: ignore[arg-type]
        wanted = whole.apply(warp, picture, size, how)
        np.testing.assert_array_equal(whole.apply(warp, picture, size, how), wanted)
        np.testing.assert_array_equal(tiled.apply(warp, picture, size, how), wanted)
        np.testing.assert_array_equal(np.concatenate(list(tiled.bands(warp, picture, size, how))), wanted)


@pytest.mark.parametrize("edges", ["transparent", "black"])
@pytest.mark.parametrize("samples", ["auto", 1, 2])
@pytest.mark.parametrize("way", [(0, 1), (0, -1), (1, 1), (1, -1)], ids=str)
def test_what_is_outside_by_less_than_a_map_can_tell_is_the_edge(
    device: Device, edges: str, samples: int | str, way: tuple[int, int]
) -> None:
    """A hundredth of a pixel, of a map that is given; half a pixel less is where the middle of the last one is."""
    axis, sign = way
    displacement = np.zeros((48, 64, 2), np.float32)
    picture = np.full((48, 64, 4), 0.5, np.float32)
    for beyond, is_there in ((0.004, True), (0.02, False)):
        displacement[..., axis] = sign * (0.5 + beyond) / 64
        how = Sampling(edges=edges, samples=samples, premultiplied=True)  # type: ignore[arg-type]
        found = Sampler(device).apply(GivenMap(device, displacement), picture, how=how).swapaxes(0, axis)
        assert np.allclose(found[2:-2, -1 if sign > 0 else 0, :3], 0.5, atol=1e-3) == is_there
        assert np.allclose(found[2:-2, 2:-2], 0.5, atol=1e-3)


@pytest.mark.parametrize("size", [(64, 40), (40, 64)], ids=str)
@pytest.mark.parametrize("way", [(0, 1), (0, -1), (1, 1), (1, -1)], ids=str)
def test_of_a_fluid_s_map_half_a_texel_outside_is_the_edge(
    device: Device, size: tuple[int, int], way: tuple[int, int]
) -> None:
    """On whichever side, and of a picture that is broad or high."""
    (axis, sign), (width, height) = way, size
    warp = WarpMap(device, Grid.for_picture(width, height, 16))
    half = 0.5 * width / warp.size_for(size, size)[0]  # in pixels, as those of the other side
    assert half == 0.5 * height / warp.size_for(size, size)[1]
    displacement, picture = np.zeros((height, width, 2), np.float32), np.full((height, width, 4), 0.5, np.float32)
    for beyond, is_there in ((0.9 * half, True), (1.1 * half, False)):
        displacement[..., axis] = sign * (0.5 + beyond) / 64
        warp.set(displacement)
        found = Sampler(device).apply(warp, picture, how=Sampling(samples=1, premultiplied=True)).swapaxes(0, axis)
        assert np.allclose(found[4:-4, -1 if sign > 0 else 0], 0.5, atol=1e-3) == is_there
        assert np.allclose(found[4:-4, 4:-4], 0.5, atol=1e-3)


@pytest.mark.parametrize("samples", ["auto", 1, 4])
def test_black_outside_is_opaque_as_far_as_it_takes_part(device: Device, samples: int | str) -> None:
    """A picture of one alpha: "transparent" edges tell which part of a pixel it covers, "black" ones fill the rest."""
    picture, alpha = np.full((48, 64, 4), 0.4, np.float32), 0.4
    warp, sampler = GivenMap(device, waves((64, 48), 0.2)), Sampler(device)
    beside, black = (
        sampler.apply(warp, picture, how=Sampling(edges=edges, samples=samples, premultiplied=True))[..., 3]  # type: ignore[arg-type]
        for edges in ("transparent", "black")
    )
    part = beside / alpha
    assert part.min() < 0.01
    assert part.max() > 0.99
    assert ((part > 0.1) & (part < 0.9)).any() == (samples != 1)
    np.testing.assert_allclose(black, beside + 1 - part, atol=1e-4)


def test_tiles_are_the_same_to_the_bit_where_only_a_corner_is_distorted(device: Device) -> None:
    """Untiled, the corners of the pixels are spread there only; in tiles, everywhere."""
    displacement = waves((120, 104), 0.2)
    displacement[:60] = displacement[:, :70] = 0.0
    warp, picture = GivenMap(device, displacement), noise((260, 300, 3), "8")
    for size in (None, (601, 523)):
        wanted = Sampler(device).apply(warp, picture, size)
        np.testing.assert_array_equal(Sampler(device, whole=30_000, tile=(96, 70)).apply(warp, picture, size), wanted)


def catmull_rom(values: np.ndarray, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Values (h, w, c) at places, in pixels from the centre of the first: by the spline, and the least and the most of
    the four pixels around, in float64. At the edges they go on."""

    def weights(f: np.ndarray) -> list[np.ndarray]:
        near = [1.5 * f**3 - 2.5 * f**2 + 1 for f in (f, 1 - f)]
        far = [-0.5 * f**3 + 2.5 * f**2 - 4 * f + 2 for f in (1 + f, 2 - f)]
        return [far[0], near[0], near[1], far[1]]

    height, width = values.shape[:2]
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    total, around = np.zeros((*x.shape, values.shape[2])), []
    for j, wy in enumerate(weights(y - top)):
        for i, wx in enumerate(weights(x - left)):
            value = values[np.clip(top + j - 1, 0, height - 1), np.clip(left + i - 1, 0, width - 1)].astype(float)
            total += (wx * wy)[..., None] * value
            around += [value] if {i, j} <= {1, 2} else []
    return total, np.min(around, axis=0), np.max(around, axis=0)


@pytest.mark.parametrize(("kind", "channels"), [("float", 1), ("float", 3), ("float", 4), ("16", 3), ("8", 3)])
def test_what_is_limited_is_the_spline_within_the_pixels_around(device: Device, kind: str, channels: int) -> None:
    """Against float64, of a few bright pixels on black; without the limit it rings below them and above."""
    dtype, top = KINDS[kind]
    bright = np.random.default_rng(5).random((48, 64, channels)) < 0.2
    picture = (bright * (1000 if kind == "float" else 0.9 * top)).astype(dtype)
    displacement = waves((64, 48), 0.05)
    x, y = (places + displacement[..., axis] * 64 for axis, places in enumerate(np.meshgrid(range(64), range(48))))
    spline, least, most = catmull_rom(picture, x, y)
    assert (spline < least - 1e-3 * top).mean() > 0.05 < (spline > most + 1e-3 * top).mean()
    how = Sampling("limited", "clamp", samples=1, linear_light=False, dither=False, premultiplied=True)
    still = Sampler(device).apply(GivenMap(device, np.zeros((48, 64, 2), np.float32)), picture, how=how)
    np.testing.assert_array_equal(still, picture)
    found = Sampler(device).apply(GivenMap(device, displacement), picture, how=how)
    wanted = np.clip(spline, least, most)
    if channels == 4:
        wanted[..., 3] = np.clip(wanted[..., 3], 0, None)
        opaque = wanted[..., 3] > 1 - 1e-5
        found, wanted = found[~opaque], wanted[~opaque]
    np.testing.assert_allclose(found, wanted, atol=0.01 if kind == "float" else 0.51)


@pytest.mark.parametrize(("edges", "channels"), [("transparent", 3), ("wrap", 4)])
def test_what_is_limited_never_rings_however_many_places_a_pixel_has(
    device: Device, edges: Edges, channels: int
) -> None:
    """Torn and zoomed: not below zero and not above the brightest, and in tiles the same to the bit."""
    light = (noise((48, 64, channels), "float") < 0.1) * np.float32(60000.3)
    light[..., 3:] /= np.float32(60000.3)
    tiled = Sampler(device, whole=2000, tile=(43, 34))
    for amplitude, size in ((0.3, None), (0.1, (150, 31))):
        warp = GivenMap(device, waves((64, 48), amplitude))
        rings, kept = (
            Sampler(device).apply(warp, light, size, Sampling(quality, edges, premultiplied=True))
            for quality in ("catmull-rom", "limited")
        )
        assert rings[..., :3].min() < -100
        assert kept.min() >= 0
        assert kept.max() <= light.max() * (1 + 2e-7)
        how = Sampling("limited", edges, premultiplied=True)
        np.testing.assert_array_equal(tiled.apply(warp, light, size, how), kept)


def test_what_is_limited_stays_among_its_own_neighbours(device: Device) -> None:
    """Four places a pixel: within the range of the nine pixels around its place."""
    picture, displacement = noise((48, 64), "float"), waves((64, 48), 0.03)
    found = Sampler(device).apply(GivenMap(device, displacement), picture, how=Sampling("limited", "clamp"))
    x, y = (places + displacement[..., axis] * 64 for axis, places in enumerate(np.meshgrid(range(64), range(48))))
    here = np.clip(np.round(y).astype(int), 0, 47), np.clip(np.round(x).astype(int), 0, 63)
    least, most = (
        extreme(picture, 3, mode="nearest")[here] for extreme in (ndimage.minimum_filter, ndimage.maximum_filter)
    )
    inner = (x > 1) & (x < 62) & (y > 1) & (y < 46)
    assert (found >= least - 1e-6)[inner].all()
    assert (found <= most + 1e-6)[inner].all()


@pytest.mark.parametrize("edges", ["transparent", "mirror"])
def test_a_film_in_tiles_makes_no_texture_anew(device: Device, edges: str) -> None:
    """Textures as large as each piece would be of another size at every frame, and memory fall to bits."""
    sampler, warp = Sampler(device, whole=12_000, tile=(64, 50)), WarpMap(device, Grid(46, 30))
    picture, how = noise((151, 231, 3), "8"), Sampling(edges=edges)  # type: ignore[arg-type]
    seen = set()
    for frame in range(12):
        warp.set(waves((46, 30), 0.02 * frame, seed=frame))
        sampler.apply(warp, picture, how=how)
        seen.add(sampler.textures)
    assert len(seen) == 1


def test_a_thumbnail_of_a_picture_in_tiles(device: Device) -> None:
    """Each of its pixels needs a piece of its own."""
    picture, warp = noise((450, 600, 3), "8"), GivenMap(device, waves((60, 45), 0.05))
    tiled = Sampler(device, whole=12_000, tile=(64, 50)).apply(warp, picture, (16, 12))
    np.testing.assert_array_equal(tiled, Sampler(device).apply(warp, picture, (16, 12)))


@pytest.fixture
def uploads(monkeypatch: pytest.MonkeyPatch) -> list[Piece]:
    """What of pictures goes to the GPU, piece by piece."""
    load, pieces = PictureTexture.load, list[Piece]()

    def counted(texture: PictureTexture, plan: Plan, piece: Piece, room: tuple[int, int] | None = None) -> None:
        pieces.append(piece)
        load(texture, plan, piece, room)

    monkeypatch.setattr(PictureTexture, "load", counted)
    return pieces


def test_a_torn_map_is_not_cut_up_in_vain(device: Device, uploads: list[Piece]) -> None:
    """Where each half of a tile needs as much of the picture as all of it: 12 tiles, and not 192 patches."""
    picture, torn = noise((150, 230, 3), "8"), np.zeros((150, 230, 2), np.float32)
    torn[:, 1::2] = 100 / 230
    torn[:, ::2] = -100 / 230
    sampler = Sampler(device, whole=34_499, tile=(64, 50))
    found = sampler.apply(GivenMap(device, torn), picture)
    assert 12 <= len(uploads) < 24
    np.testing.assert_array_equal(found, Sampler(device).apply(GivenMap(device, torn), picture))


def test_no_precision_is_lost_across_a_wide_picture(device: Device) -> None:
    """A shift by a quarter of a pixel at x = 11,900 gives what it gives at x = 100."""
    patch = noise((24, 100), "float")
    picture = np.tile(patch, (1, 120))
    how = Sampling("bilinear", "wrap", samples=1)
    found = Sampler(device).apply(GivenMap(device, shift((12000, 24), 0.25, 0.0)[:, :6]), picture, how=how)
    np.testing.assert_allclose(found[:, 11800:11900], found[:, 100:200], atol=1e-6)


@pytest.mark.parametrize("channels", [1, 3])
def test_chart_beside_many_samples(device: Device, channels: int) -> None:
    """Twirl and compression of a hard chart: 42 dB against 24 x 24 samples in linear light."""
    n = 256
    x, y = np.meshgrid((np.arange(n) + 0.5) / n - 0.5, (np.arange(n) + 0.5) / n - 0.5)
    radius, angle = np.hypot(x, y), np.arctan2(y, x)
    star, plate = np.sin(36 * angle) > 0, 0.5 + 0.5 * np.cos(90 * np.pi * radius**2)
    checks, rings = (np.floor(x * 32) + np.floor(y * 32)) % 2, np.sin(40 * np.pi * radius) > 0
    value = np.where(y < 0, np.where(x < 0, star, plate), np.where(x < 0, checks, rings))
    grey = np.round(255 * value).astype(np.uint8)[..., None]
    turn, squeeze = 3 * np.exp(-((radius / 0.25) ** 2)), 1 + 1.5 * np.exp(-((radius / 0.3) ** 2))
    u, v = np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y
    warp = GivenMap(device, np.stack([squeeze * u - x, squeeze * v - y], axis=-1))
    # One place for each pixel of a result 24 times as wide and high: nothing of how many samples are chosen, and where.
    light = srgb_to_linear(grey / 255.0).astype(np.float32)
    many = Sampler(device).apply(warp, light, (24 * n, 24 * n), Sampling(edges="clamp", samples=1))
    mean = many.reshape(n, 24, n, 24, 1).mean(axis=(1, 3), dtype=np.float64)
    wanted = 255 * np.clip(linear_to_srgb(mean), 0, 1)  # all channels are the same
    found = Sampler(device).apply(warp, np.repeat(grey, channels, axis=2), how=Sampling(edges="clamp"))
    assert 10 * np.log10(255**2 / np.mean((found - wanted) ** 2)) > 42


@pytest.mark.parametrize("quality", ["catmull-rom", "bilinear"])
def test_colours_of_8_bits_are_mixed_as_finely_as_those_of_16(device: Device, quality: str) -> None:
    """Their light is held in fewer bits, also where it is dark; nothing but the rounding at the end may show."""
    warp, how = GivenMap(device, waves((300, 200), 0.05)), Sampling(quality, "clamp", dither=False)  # type: ignore[arg-type]
    for picture in (noise((200, 300, 3), "8"), noise((200, 300, 3), "8") // 16):
        found = Sampler(device).apply(warp, picture, how=how)
        wanted = Sampler(device).apply(warp, picture.astype(np.uint16) * 257, how=how) / 257
        assert np.abs(found - wanted).max() < 0.53


def test_colour_of_transparent_pixels_does_not_bleed(device: Device) -> None:
    picture = np.zeros((32, 32, 4), np.uint8)
    picture[..., 0] = 255
    picture[:, 16:] = 0, 255, 0, 255
    found = Sampler(device).apply(GivenMap(device, shift((32, 32), 0.5, 0.0)), picture)
    # From the half of the last transparent column on, but for what is beyond the picture.
    assert (found[:, :14, 3] == 0).all()
    assert found[4:-4, 15, 3] == pytest.approx(128, abs=1)
    assert (found[4:-4, 17:30, 3] == 255).all()
    visible = found[found[..., 3] > 0]
    assert (visible[:, 0] == 0).all()
    assert (visible[:, 1] == 255).all()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("premultiplied", [False, True])
def test_soft_alpha_is_mixed_as_light_that_it_weighs(device: Device, kind: str, premultiplied: bool) -> None:
    """Half way between neighbours of other colours and alphas, against float64."""
    dtype, top = KINDS[kind]
    straight = 0.1 + 0.9 * np.random.default_rng(3).random((40, 48, 4))
    picture = straight.copy()
    if premultiplied:
        picture[..., :3] *= picture[..., 3:]
    picture = (np.round(picture * top) if top > 1 else picture).astype(dtype)
    values = picture / top
    if premultiplied:
        values[..., :3] /= values[..., 3:]
    light = values if kind == "float" else np.dstack([srgb_to_linear(values[..., :3]), values[..., 3]])
    weighed = np.dstack([light[..., :3] * light[..., 3:], light[..., 3]])
    mean = (weighed[:, 1:] + weighed[:, :-1]) / 2
    colours = mean[..., :3] / mean[..., 3:]
    colours = colours if kind == "float" else linear_to_srgb(colours)
    wanted = np.dstack([colours * mean[..., 3:] if premultiplied else colours, mean[..., 3]])
    how = Sampling("bilinear", "clamp", dither=False, premultiplied=premultiplied)
    found = Sampler(device).apply(GivenMap(device, shift((48, 40), 0.5, 0.0)), picture, how=how)[:, :-1] / top
    np.testing.assert_allclose(found[:, 2:-2], wanted[:, 2:-2], atol=1.1 / top if kind == "8" else 1e-4)


def test_what_is_even_keeps_its_code_wherever_it_lies(device: Device) -> None:
    picture = np.repeat(np.arange(256, dtype=np.uint8), 24 * 3).reshape(256, 24, 3)
    given = GivenMap(device, np.broadcast_to((0.3 / 256, 0.0), (256, 24, 2)))
    sampler = Sampler(device)
    np.testing.assert_array_equal(sampler.apply(given, picture, how=Sampling(edges="clamp", dither=False)), picture)
    for thing in (given, sampler):
        thing.release()


def test_half_black_half_white_is_half_the_light(device: Device) -> None:
    picture = np.zeros((32, 32), np.uint8)
    picture[:, 1::2] = 255
    warp = GivenMap(device, shift((32, 32), 0.5, 0.0))
    light = Sampler(device).apply(warp, picture, how=Sampling("bilinear", "clamp", dither=False))
    assert abs(int(light[16, 16]) - 188) <= 1
    code = Sampler(device).apply(warp, picture, how=Sampling("bilinear", "clamp", linear_light=False))
    assert abs(int(code[16, 16]) - 128) <= 1


def test_dithering_keeps_the_mean(device: Device) -> None:
    picture = np.tile(np.linspace(50, 54, 256).astype(np.uint8), (64, 1))
    warp, how = GivenMap(device, shift((256, 64), 0.4, 0.0)), Sampling("bilinear", "clamp")
    found = Sampler(device).apply(warp, picture, how=how)
    exact = Sampler(device).apply(warp, picture.astype(np.uint16) * 257, how=how)
    assert abs(found.mean() - exact.mean() / 257) < 0.01


def test_dithering_is_even_in_every_neighbourhood(device: Device) -> None:
    """Of a grey between two codes each 8 x 8 pixels have the share of both that makes its mean; no row stands out."""
    picture = np.zeros((64, 64), np.uint8)
    picture[:, 1::2] = 1
    warp = GivenMap(device, shift((64, 64), 0.3, 0.0))
    found = Sampler(device).apply(warp, picture, how=Sampling("bilinear", "clamp"))[:, 1:-1:2][:, :-1]
    share = found.astype(float)
    assert set(np.unique(found)) == {0, 1}
    blocks = share[:, :24].reshape(8, 8, 3, 8).mean(axis=(1, 3))
    assert blocks == pytest.approx(share.mean(), abs=0.12)
    assert 0.1 < share.mean() < 0.9
    assert share.mean(axis=0) == pytest.approx(share.mean(), abs=0.25)
    assert share.mean(axis=1) == pytest.approx(share.mean(), abs=0.25)


def test_result_of_another_size_follows_the_map(device: Device) -> None:
    """A smooth picture through a map, at half and twice its size, is the same picture."""
    x, y = np.meshgrid((np.arange(120) + 0.5) / 120, (np.arange(80) + 0.5) / 80)
    picture = (0.5 + 0.4 * np.sin(7 * x) * np.cos(5 * y)).astype(np.float32)
    warp = WarpMap(device, Grid(24, 16))
    warp.set(waves((24, 16), 0.03))
    sampler = Sampler(device)
    for factor in (0.5, 2.0):
        size = round(120 * factor), round(80 * factor)
        found = sampler.apply(warp, picture, size, Sampling(edges="clamp"))
        assert found.shape == size[::-1]
        back = cv2.resize(found, (120, 80), interpolation=cv2.INTER_CUBIC)
        assert np.abs(back - sampler.apply(warp, picture, None, Sampling(edges="clamp")))[4:-4, 4:-4].max() < 0.01


@pytest.mark.parametrize("size", [(40, 60), (90, 30), (240, 50)])
def test_a_result_of_other_proportions_is_looked_up_by_each_side_for_itself(
    device: Device, size: tuple[int, int]
) -> None:
    """A smooth picture pressed or drawn out along one side, through a map and without, at the very places."""
    height, width = 80, 120

    def wave(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return (0.5 + 0.4 * np.sin(7 * x) * np.cos(5 * y)).astype(np.float32)

    def centres(columns: int, rows: int) -> tuple[np.ndarray, np.ndarray]:
        x, y = np.meshgrid((np.arange(columns) + 0.5) / columns, (np.arange(rows) + 0.5) / rows)
        return x, y

    for moved in (0.0, 0.04):
        warp = GivenMap(device, np.full((height, width, 2), (moved, -moved), np.float32))
        found = Sampler(device).apply(warp, wave(*centres(width, height)), size, Sampling(edges="clamp"))
        assert found.shape == size[::-1]
        x, y = centres(*size)
        inside = slice(size[1] // 6, -size[1] // 6), slice(size[0] // 6, -size[0] // 6)
        np.testing.assert_allclose(found[inside], wave(x + moved, y - 1.5 * moved)[inside], atol=0.006)
        warp.release()


@pytest.mark.parametrize("factor", [1.5, 2.0, 3.2])
def test_enlarging_is_pillows_bicubic(device: Device, factor: float) -> None:
    """Where nothing is shrunk, one place a pixel: sharp as Pillow's resize, whose bicubic is Catmull-Rom's."""
    picture = noise((80, 120), "float")
    size = round(120 * factor), round(80 * factor)
    found = Sampler(device).apply(WarpMap(device, Grid(24, 16)), picture, size, Sampling(edges="clamp"))
    wanted = np.asarray(Image.fromarray(picture, "F").resize(size, Image.Resampling.BICUBIC))
    inner = slice(round(3 * factor), -round(3 * factor))  # Pillow weighs the pixels at the edge in another way
    np.testing.assert_allclose(found[inner, inner], wanted[inner, inner], atol=2e-5)


def test_one_place_where_it_is_enough_leaves_no_seam(device: Device) -> None:
    """A map that distorts more and more to the right, from blocks with one place a pixel to blocks with many."""
    picture = noise((448, 640), "float")
    x, y = np.meshgrid(np.arange(640) / 640, np.arange(448) / 640)
    displacement = 0.02 * x[..., None] ** 2 * np.stack([np.sin(20 * y), np.sin(20 * x)], axis=-1)
    found = Sampler(device).apply(GivenMap(device, displacement), picture, how=Sampling(edges="clamp"))
    # The same as a part of a larger picture, whose blocks lie elsewhere.
    around = np.pad(displacement * 640 / 704, ((24, 40), (24, 40), (0, 0)), mode="edge")
    larger = np.pad(picture, ((24, 40), (24, 40)))
    wanted = Sampler(device).apply(GivenMap(device, around), larger, how=Sampling(edges="clamp"))[24:472, 24:664]
    difference = np.abs(found - wanted)[32:-32, 32:-32]
    assert 0 < difference.max() < 0.25 / 255


def test_what_cannot_be_looked_up_says_so(device: Device) -> None:
    warp, sampler = WarpMap(device, Grid(16, 16)), Sampler(device)
    with pytest.raises(SamplingError, match="float64"):
        sampler.apply(warp, np.zeros((8, 8)))
    with pytest.raises(SamplingError, match="channels"):
        sampler.apply(warp, np.zeros((8, 8, 5), np.uint8))
    with pytest.raises(SamplingError, match="map of shape"):
        GivenMap(device, np.zeros((8, 8)))


def test_a_picture_that_is_read_only_stays_uploaded_and_no_other_is_taken_for_it(
    device: Device, uploads: list[Piece]
) -> None:
    first, second = noise((60, 80, 3), "8", 1), noise((60, 80, 3), "8", 2)
    warp, sampler = GivenMap(device, waves((80, 60), 0.05)), Sampler(device)
    wanted = [Sampler(device).apply(warp, picture) for picture in (first, second)]
    first.flags.writeable = False
    uploads.clear()
    for picture, result in ((first, 0), (first, 0), (second, 1), (second, 1), (first, 0)):
        np.testing.assert_array_equal(sampler.apply(warp, picture), wanted[result])
    assert len(uploads) == 4  # all but the second
    # The same picture without linear light is another one on the GPU.
    plain = Sampling("bilinear", linear_light=False)
    np.testing.assert_array_equal(sampler.apply(warp, first, how=plain), Sampler(device).apply(warp, first, how=plain))
    second[:] = 7
    np.testing.assert_array_equal(sampler.apply(warp, second), Sampler(device).apply(warp, second))


# -- what pictures are cut into, by brute force -----------------------------------------------------------------------


def covered(size: tuple[int, int], regions: list[Region]) -> np.ndarray:
    """How many of some regions lie over each of the pixels (h, w)."""
    count = np.zeros(size[::-1], int)
    for x, y, width, height in regions:
        count[y : y + height, x : x + width] += 1
    return count


@pytest.mark.parametrize("height", range(1, 12))
def test_both_halves_of_a_region_make_it_up_and_no_pair_is_torn_apart(height: int) -> None:
    for width in range(1, 24):
        if width <= 2 and height == 1:
            continue  # which is not cut
        halves = halves_of((4, 3, width, height))
        assert (covered((30, 20), [*halves]) == covered((30, 20), [(4, 3, width, height)])).all()
        (x, y, *one), (other_x, other_y, *other) = halves
        assert min(*one, *other) > 0
        if width >= height and width > 2:
            assert (y == other_y) == (x % 2 == other_x % 2 == 0)
            assert abs(one[0] - other[0]) <= 3
        else:
            assert x == other_x
            assert abs(one[1] - other[1]) <= 1


@pytest.mark.parametrize("seed", range(6))
def test_what_is_true_in_a_mask_is_cut_into_rectangles_that_do_not_overlap(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mask = rng.random((9, 14)) < 0.15 * (seed + 1)
    found = rectangles(mask)
    np.testing.assert_array_equal(covered((14, 9), found.tolist()), mask)
    # No two of them could be one: below none stands one as wide, and none ends where another begins.
    ends = {(x, x + width, y + height) for x, y, width, height in found.tolist()}
    assert not any((x, x + width, y) in ends for x, y, width, _ in found.tolist())
    assert not (mask & np.pad(mask, ((0, 0), (1, 0)))[:, :-1])[found[:, 1], found[:, 0]].any()


def test_rectangles_of_nothing_and_of_all() -> None:
    assert rectangles(np.zeros((3, 4), bool)).shape == (0, 4)
    assert rectangles(np.ones((3, 4), bool)).tolist() == [[0, 0, 4, 3]]


def test_what_two_rectangles_have_in_common() -> None:
    rng = np.random.default_rng(7)
    for one, other in zip(rng.integers(1, 9, (60, 4)).tolist(), rng.integers(1, 9, (60, 4)).tolist(), strict=True):
        x, y, width, height = overlap(one, other)
        wanted = (covered((20, 20), [tuple(one), tuple(other)]) == 2).sum()
        assert max(width, 0) * max(height, 0) == wanted
        if wanted:
            assert (covered((20, 20), [(x, y, width, height), tuple(one), tuple(other)]) == 3).sum() == wanted


@pytest.mark.parametrize(("edges", "pad"), [("wrap", "wrap"), ("mirror", "symmetric")])
@pytest.mark.parametrize("count", [1, 2, 5])
def test_the_pixel_that_stands_for_one_beyond_the_edge_is_the_one_of_a_padded_picture(
    edges: str, pad: Any, count: int
) -> None:
    index = np.arange(-17, count + 17)
    np.testing.assert_array_equal(edge_index(index, count, edges), np.pad(np.arange(count), 17, pad))


@pytest.mark.parametrize("size", [(1, 1), (2, 1), (64, 48), (65, 49), (127, 95), (1000, 3), (641, 481)])
def test_tiles_are_as_few_as_may_be_and_all_alike_and_of_whole_pairs(size: tuple[int, int]) -> None:
    tiling = Tiling(4000, (64, 48), 1024)
    tile = tiling.tile_of(size)
    assert tile[0] % 2 == 0
    for side, wanted, most in zip(size, tile, tiling.tile, strict=True):
        assert wanted <= most
        assert math.ceil(side / wanted) == math.ceil(side / most)


@pytest.mark.parametrize(
    ("size", "fits"),
    [((80, 50), True), ((81, 50), False), ((1023, 3), True), ((1024, 3), False), ((3, 1023), True), ((3, 1024), False)],
)
def test_a_picture_fits_up_to_so_many_pixels_and_one_less_than_the_largest_texture(
    size: tuple[int, int], fits: bool
) -> None:
    assert Tiling(4000, (64, 48), 1024).fits(size) == fits

"""Pictures and shapes as numbers: the very numbers, where others only look at what is made of them."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage

from app.media.auxiliary import Pictures
from app.media.pictures import write_picture
from app.model.picture import Picture
from app.model.sampling import (
    Segment,
    SmallPictures,
    Window,
    alike,
    blurred,
    channels,
    distance_to_path,
    falloff,
    intensity,
    pixel_at,
    quantised,
)
from solver.grid import Grid
from support.pictures import OnePicture


def row(*colours: tuple[int, ...]) -> Picture:
    return Picture(np.array([colours], np.uint8))


def test_luma_is_that_of_rec_709() -> None:
    found = intensity(row((255, 0, 0, 255), (0, 255, 0, 255), (0, 0, 255, 255), (255, 255, 255, 51)))
    np.testing.assert_allclose(found[0], [0.2126, 0.7152, 0.0722, 0.2], atol=1e-6)


@pytest.mark.parametrize("hardness", [0.0, 0.5, 1.0])
def test_a_brush_falls_off_as_it_is_defined(hardness: float) -> None:
    q = np.linspace(0, 1.2, 25)
    core = 0.9 * hardness
    wanted = np.where(q < core, 1, np.where(q < 1, (1 - ((q - core) / (1 - core)) ** 2), 0) ** 3)
    np.testing.assert_allclose(falloff(q, hardness), wanted, atol=1e-12)


def test_a_path_ends_at_its_ends() -> None:
    grid = Grid(40, 20)
    x, y = grid.centres()
    found = distance_to_path(np.array([(0.3, 0.25), (0.5, 0.25), (0.5, 0.4)]), grid)
    along = np.hypot(x - x.clip(0.3, 0.5), y - 0.25), np.hypot(x - 0.5, y - y.clip(0.25, 0.4))
    np.testing.assert_allclose(found, np.minimum(*along), atol=1e-12)
    dot = distance_to_path(np.array([(0.3, 0.25)]), grid)
    np.testing.assert_allclose(dot, np.hypot(x - 0.3, y - 0.25), atol=1e-12)


@pytest.mark.parametrize(("size", "count"), [((40, 20), 2), ((40, 20), 300), ((130, 75), 60), ((9, 8), 5)])
def test_a_path_is_as_near_as_the_nearest_of_all_its_lines(size: tuple[int, int], count: int) -> None:
    """To the bit, however its canvas is cut; two of its points are one, and some lie outside."""
    grid, points = Grid(*size), np.random.default_rng(count).uniform(-0.5, 1.5, (count, 2))
    points[-1] = points[-2]
    x, y = grid.centres()
    wanted = np.full(x.shape, np.inf)
    for a, b in pairwise(points):
        along = b - a
        length2 = float(along @ along)
        s = np.clip(((x - a[0]) * along[0] + (y - a[1]) * along[1]) / length2, 0, 1) if length2 > 0 else 0.0
        wanted = np.minimum(wanted, np.hypot(x - a[0] - s * along[0], y - a[1] - s * along[1]))
    np.testing.assert_array_equal(distance_to_path(points, grid), wanted)
    for within in (0.001, 0.05, 0.3):
        found = distance_to_path(points, grid, within)
        np.testing.assert_array_equal(found[wanted <= within], wanted[wanted <= within])
        assert (found[wanted > within] > within).all()


def test_a_window_rises_smoothly_within_its_soft_edge() -> None:
    grid = Grid(100, 50)
    x, _ = grid.centres()
    weight = Window(box=(0.1, -1.0, 0.9, 2.0), soft=0.2).weight(grid)
    part = (np.minimum(x - 0.1, 0.9 - x) / 0.2).clip(0, 1)
    np.testing.assert_allclose(weight, part**2 * (3 - 2 * part), atol=1e-12)
    np.testing.assert_allclose(Window(box=(0.1, -1.0, 0.9, 2.0), soft=0.2, invert=True).weight(grid), 1 - weight)


def test_a_color_s_tolerance_is_the_distance_in_rgb(tmp_path: Path) -> None:
    """Two columns of pixels at each distance, one for the cells to either side."""
    picture = np.full((16, 32, 4), (100, 100, 100, 255), np.uint8)
    picture[:, 8:16, 0] += 30
    picture[:, 16:24] = (121, 121, 121, 255)  # 36.4 away
    picture[:, 24:, 3] = 100
    write_picture(tmp_path / "p.png", Picture(picture))
    for tolerance, columns in ((29, [1, 0, 0, 0]), (31, [1, 1, 0, 0]), (37, [1, 1, 1, 0])):
        segment = Segment(color="#646464", tolerance=tolerance / 255)
        found = segment.weight("p.png", Grid(32, 16), Pictures(Picture(picture), tmp_path))
        assert found[8, 4::8].tolist() == columns


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("bands", [1, 2, 3, 4])
@pytest.mark.parametrize("is_premultiplied", [False, True])
def test_what_is_alike_is_the_same_in_every_kind_of_picture(kind: type, bands: int, is_premultiplied: bool) -> None:
    rng = np.random.default_rng(bands)
    values = rng.random((40, 50, bands), np.float32)
    if is_premultiplied and bands in (2, 4):
        values[..., :-1] *= values[..., -1:]
    most = 1 if kind is np.float32 else np.iinfo(kind).max
    picture = Picture((values * most).astype(kind), premultiplied=is_premultiplied and bands in (2, 4))
    wanted = np.array([0.2, 0.5, 0.9], np.float32)
    colours, alpha = channels(picture)
    for tolerance in (0.2, 0.5, 0.9):
        near = np.sqrt(((colours.astype(float) - wanted) ** 2).sum(axis=-1)) <= tolerance
        np.testing.assert_array_equal(alike(picture, wanted, tolerance), near & (alpha > 0.5))


def test_light_is_seen_through_the_curve_of_srgb_and_alpha_is_not() -> None:
    light = np.array([[(0.2140411, 4.0, -1.0, 0.5), (np.nan, 1.0, 0.0, 7.0)]], np.float32)
    colours, alpha = channels(Picture(light))
    np.testing.assert_allclose(colours, [[(0.5, 1, 0), (0, 1, 0)]], atol=1e-6)
    np.testing.assert_allclose(alpha, [[0.5, 1]])
    colours, alpha = channels(Picture(np.array([[(51, 102)]], np.uint8)))
    np.testing.assert_allclose([*colours[0, 0], alpha[0, 0]], [0.2, 0.2, 0.2, 0.4], atol=1e-6)
    assert channels(row((51, 102, 204)))[1].tolist() == [[1.0]]


def test_an_ellipse_is_soft_towards_its_middle() -> None:
    """Of a circle the first order is the distance itself."""
    grid = Grid(80, 80)
    x, y = grid.centres()
    depth = 0.4 - np.hypot(x - 0.5, y - 0.5)
    weight = Window(box=(0.1, 0.1, 0.9, 0.9), shape="ellipse", soft=0.3).weight(grid)
    part = (depth / 0.3).clip(0, 1)
    np.testing.assert_allclose(weight, part**2 * (3 - 2 * part), atol=1e-9)
    odd = Window(box=(0.1, 0.3, 0.9, 0.7), shape="ellipse", soft=0.4).weight(Grid(81, 81))
    assert odd[40, 40] == pytest.approx(0.5)  # half the height of 0.4 is half as deep as the edge is soft


def test_a_cell_that_an_edge_cuts_is_in_by_its_part() -> None:
    grid = Grid(10, 10)
    for soft in (0.0, 0.1):  # no more than a cell is no soft edge
        weight = Window(box=(0.225, 0.0, 0.76, 1.0), soft=soft).weight(grid)
        np.testing.assert_allclose(weight[5], [0, 0, 0.75, 1, 1, 1, 1, 0.6, 0, 0], atol=1e-12)


def test_a_segment_holds_neither_of_its_limits() -> None:
    grey = np.repeat(np.array([[0, 51, 102, 153, 255]], np.uint8), 8, axis=0)[..., None].repeat(2, axis=1)
    pictures, grid = OnePicture(grey), Grid(10, 8, (1.0, 1.0))
    for keys, chosen in (
        ({"above": 0.2}, [0, 0, 1, 1, 1]),
        ({"below": 0.6}, [1, 1, 1, 0, 0]),
        ({"above": 0.0, "below": 0.61}, [0, 1, 1, 1, 0]),
        ({"mask": "m.png"}, [0, 0, 0, 1, 1]),
    ):
        assert Segment.model_validate(keys).chosen("source", grid, pictures)[4, ::2].tolist() == chosen
    windowed = Segment(above=0.2, window=Window(box=(0.0, 0.0, 0.55, 1.0))).chosen("source", grid, pictures)
    assert windowed[4, ::2].tolist() == [0, 0, 1, 0, 0]


def test_a_segment_that_chooses_no_half_of_any_cell_is_empty() -> None:
    grey = np.zeros((8, 80, 1), np.uint8)
    for width, is_empty in ((4, True), (5, False)):
        grey[:, :width] = 255
        segment = Segment(above=0.5)
        if is_empty:
            with pytest.raises(ValueError, match="the segmentation is empty"):
                segment.chosen("source", Grid(8, 8, (1.0, 0.1)), OnePicture(grey))
        else:
            assert segment.chosen("source", Grid(8, 8, (1.0, 0.1)), OnePicture(grey)).max() == 0.5
    with pytest.raises(ValueError, match="chooses the whole picture"):
        Segment(below=0.5).weight("source", Grid(8, 8, (1.0, 0.1)), OnePicture(np.zeros((8, 80, 1), np.uint8)))


def test_a_blur_is_scipys_with_mirrored_edges() -> None:
    grid = Grid(40, 25)
    values = np.random.default_rng(4).random((25, 40))
    wanted = ndimage.gaussian_filter(values, (0.075 / grid.spacing[1], 0.075 / grid.spacing[0]), truncate=12)
    np.testing.assert_allclose(blurred(values, 0.15, grid), wanted, atol=1e-6)


def test_steps_are_equal_and_reach_both_ends() -> None:
    found = quantised(np.array([0.0, 0.24, 0.26, 0.49, 0.51, 0.74, 0.76, 1.0]), 4)
    np.testing.assert_allclose(found * 3, [0, 0, 1, 1, 2, 2, 3, 3])


def test_a_picture_beyond_2048_pixels_is_halved_to_the_nearest_code() -> None:
    pixels = np.zeros((2, 2050, 1), np.uint8)
    pixels[:, :4, 0] = [[0, 1, 0, 1], [0, 0, 0, 1]]
    small = SmallPictures(OnePicture(pixels)).load("source").pixels
    assert small.shape == (1, 1025, 1)
    assert small[0, :2, 0].tolist() == [0, 1]  # a quarter and a half
    assert SmallPictures(OnePicture(pixels[:, :2048])).load("source").width == 2048


@pytest.mark.parametrize(("width", "side"), [(2050, 2), (4098, 3)])
def test_floats_beyond_2048_pixels_stay_as_bright_when_they_are_made_smaller(width: int, side: int) -> None:
    pixels = np.full((2 * side, width, 2), 0.375, np.float32)
    pixels[:side, :side, 0] = np.arange(side**2).reshape(side, side)
    small = SmallPictures(OnePicture(pixels)).load("source").pixels
    assert (small.shape, small.dtype) == ((2, width // side, 2), np.float32)
    assert small[0, 0, 0] == (side**2 - 1) / 2  # the mean of what is counted up
    small[0, 0, 0] = 0.375
    assert (small == 0.375).all()


def test_the_pixel_at_a_place_is_the_one_that_holds_it() -> None:
    pixels = np.zeros((10, 20, 3))
    for place, wanted in (((0.0, 0.0), (0, 0)), ((0.099, 0.55), (5, 1)), ((0.1, 0.99), (9, 2)), ((1.0, 1.0), (9, 19))):
        assert pixel_at(place, pixels) == wanted

"""Viscosity and freeze layers, and pictures on the grid."""

from __future__ import annotations

import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from pydantic import TypeAdapter, ValidationError
from scipy.special import ndtr

from app.errors import UserError
from app.media.auxiliary import Pictures
from app.model.masks import FreezeLayer, ViscosityLayer, solid, viscosity
from app.model.picture import Picture
from app.model.sampling import Segment, Window, blurred, intensity, to_grid
from app.model.schema import frozen
from solver.grid import Grid
from support.arrays import assert_near

GRID = Grid(64, 48)


def layer(**keys: Any) -> ViscosityLayer:
    return TypeAdapter(ViscosityLayer).validate_python(frozen(keys))


def freeze(**keys: Any) -> FreezeLayer:
    return TypeAdapter(FreezeLayer).validate_python(frozen(keys))


def grey(values: np.ndarray) -> Picture:
    return Picture(np.round(np.asarray(values) * 255).astype(np.uint8)[..., None])


def ramp(width: int = 256, height: int = 192) -> Picture:
    return grey(np.broadcast_to((np.arange(width) + 0.5) / width, (height, width)))


@pytest.fixture
def pictures(tmp_path: Path) -> Pictures:
    Image.fromarray(np.full((10, 30), 128, np.uint8)).save(tmp_path / "flat.png")
    half = np.zeros((192, 256), np.uint8)
    half[:, 128:] = 255
    Image.fromarray(half).save(tmp_path / "half.png")
    return Pictures(ramp(), tmp_path)


# Sampling


def test_a_cell_is_the_mean_of_its_pixels() -> None:
    values = np.random.default_rng(1).random((96, 128)).astype(np.float32)
    assert_near(to_grid(values, GRID), values.reshape(48, 2, 64, 2).mean(axis=(1, 3)), abs=1e-6)


def test_grids_of_any_fineness_see_the_same_picture() -> None:
    values = np.random.default_rng(2).random((300, 400)).astype(np.float32)
    fine, coarse = to_grid(values, Grid(128, 96)), to_grid(values, Grid(64, 48))
    assert_near(fine.reshape(48, 2, 64, 2).mean(axis=(1, 3)), coarse, abs=2e-6)


def test_a_small_picture_is_interpolated() -> None:
    wide = to_grid(np.array([[0.0, 1.0]], np.float32), GRID)[10]
    assert (np.diff(wide) >= 0).all()
    assert np.diff(wide).max() < 0.05


def test_the_depth_of_a_picture_does_not_matter() -> None:
    levels = np.linspace(0, 1, 256)
    eight = intensity(Picture(np.round(levels * 255).astype(np.uint8)[None, :, None]))
    sixteen = intensity(Picture(np.round(levels * 65535).astype(np.uint16)[None, :, None]))
    linear = np.where(levels <= 0.04045, levels / 12.92, ((levels + 0.055) / 1.055) ** 2.4)
    floating = intensity(Picture(linear.astype(np.float32)[None, :, None]))
    assert sixteen == pytest.approx(eight, abs=1e-5)
    assert floating == pytest.approx(eight, abs=1e-3)


def test_a_transparent_picture_is_black() -> None:
    assert intensity(Picture(np.array([[[255, 0], [255, 255]]], np.uint8))).tolist() == [[0, 1]]


def test_a_blur_keeps_the_mean_and_has_the_stated_width() -> None:
    values = np.zeros((128, 128))
    values[64, 64] = 1
    grid = Grid(128, 128)
    soft = blurred(values, 0.1, grid)
    x, _ = grid.centres()
    assert soft.sum() == pytest.approx(1)
    assert math.sqrt((soft * (x - x[0, 64]) ** 2).sum()) == pytest.approx(0.05, rel=1e-3)
    edge = np.zeros((128, 128))
    edge[0, 0] = 1
    assert blurred(edge, 0.1, grid).sum() == pytest.approx(1), "the edges mirror"


def test_windows_are_round_on_pictures_that_are_not_square() -> None:
    grid = Grid(200, 100)
    for shape, area in (("ellipse", math.pi / 4), ("rectangle", 1)):
        window = Window.model_validate({"box": (0.25, 0.2, 0.75, 0.8), "shape": shape})
        assert window.weight(grid).sum() * grid.h**2 == pytest.approx(area * 0.5 * 0.3, rel=2e-3)
    soft = Window(box=(0.25, 0.2, 0.75, 0.8), soft=0.05)
    x, y = grid.centres()
    weight = soft.weight(grid)
    outside = (x < 0.25) | (x > 0.75) | (y < 0.1) | (y > 0.4)
    assert (weight[outside] == 0).all()
    assert (weight[(x > 0.3) & (x < 0.7) & (y > 0.15) & (y < 0.35)] == 1).all()
    assert weight + Window(box=(0.25, 0.2, 0.75, 0.8), soft=0.05, invert=True).weight(grid) == pytest.approx(1)


# Viscosity


def test_without_layers_it_is_the_base(pictures: Pictures) -> None:
    assert (viscosity([], 0.25, GRID, pictures) == 0.25).all()


def test_scale_is_linear_and_range_geometric(pictures: Pictures) -> None:
    x, _ = GRID.centres()
    linear = viscosity([layer(kind="picture", scale=2.0)], 0, GRID, pictures)
    assert linear == pytest.approx(2 * x, abs=0.01)
    spread = viscosity([layer(kind="picture", range=[1e-5, 1.0])], 0, GRID, pictures)
    assert np.log10(spread) == pytest.approx(5 * x - 5, abs=0.02)
    flipped = viscosity([layer(kind="picture", range=[1e-5, 1.0], invert=True)], 0, GRID, pictures)
    assert np.log10(flipped) == pytest.approx(-5 * x, abs=0.02)


def test_levels_blur_and_stretch(pictures: Pictures) -> None:
    steps = viscosity([layer(kind="picture", scale=1, levels=4)], 0, GRID, pictures)
    assert np.unique(steps)[[0, -1]] == pytest.approx([0, 1])
    assert [np.isclose(steps, level / 3).mean() for level in range(4)] == pytest.approx([0.25] * 4, abs=0.02)
    sharp = viscosity([layer(kind="picture", picture="half.png", scale=1)], 0, GRID, pictures)
    soft = viscosity([layer(kind="picture", picture="half.png", scale=1, blur=0.1)], 0, GRID, pictures)
    assert set(np.unique(sharp)) == {0, 1}
    edge = np.broadcast_to(ndtr((GRID.centres()[0] - 0.5) / 0.05), soft.shape)  # of a Gauss as wide as half the radius
    assert soft == pytest.approx(edge, abs=0.01)
    dull = Pictures(grey(0.25 + 0.5 * (np.arange(256) >= 128) * np.ones((192, 1))))
    both = viscosity([layer(kind="picture", scale=1, stretch=True, invert=True, blur=0.1)], 0, GRID, dull)
    assert both == pytest.approx(1 - edge, abs=0.01), "stretched before it is blurred, once"
    dim = Pictures(grey(0.4 + 0.2 * ramp().pixels[..., 0] / 255))
    wide = viscosity([layer(kind="picture", scale=1, stretch=True)], 0, GRID, dim)
    assert (wide.min(), wide.max()) == (0, 1)


@pytest.mark.parametrize("cells", [100, 683, 1025, 2049])
def test_the_cells_that_an_edge_between_levels_goes_through_have_their_part_of_both(
    pictures: Pictures, cells: int
) -> None:
    """The finer cells of one that the edge halves; a grid that is finer than those has one at each place."""
    layers = [layer(kind="picture", picture="half.png", scale=1, levels=2)]
    steps = viscosity(layers, 0, Grid.for_picture(256, 192, cells), pictures)
    assert (steps[:, : cells // 2] == 0).all()
    assert (steps[:, -(cells // 2) :] == 1).all()
    if cells == 683:  # twice as many
        assert steps[:, 341] == pytest.approx(0.5)


def test_layers_combine(pictures: Pictures) -> None:
    half = {"kind": "picture", "picture": "half.png"}

    def at(*layers: ViscosityLayer) -> list[float]:
        return viscosity(layers, 0.5, GRID, pictures)[20, [10, 50]].tolist()

    assert at(layer(**half, scale=2)) == [0, 2]
    assert at(layer(**half, scale=2, combine="max")) == [0.5, 2]
    assert at(layer(**half, scale=2, combine="multiply")) == [0, 1]
    assert at(layer(kind="constant", scale=3), layer(**half, range=[1, 10], combine="multiply")) == pytest.approx(
        [3, 30]
    )


def test_soft_edges_blend_logarithms(pictures: Pictures) -> None:
    window = {"box": [0.0, 0.0, 0.5, 1.0], "soft": 0.5}
    mixed = viscosity([layer(kind="constant", scale=1, window=window)], 1e-4, GRID, pictures)
    weight = Window.model_validate(frozen(window)).weight(GRID)
    assert np.log10(mixed) == pytest.approx(4 * weight - 4, abs=1e-5)
    from_zero = viscosity([layer(kind="constant", scale=1, window=window)], 0, GRID, pictures)
    assert from_zero == pytest.approx(weight, abs=1e-6)


def test_a_painted_path_covers_what_the_brush_covers(pictures: Pictures) -> None:
    painted = viscosity(
        [layer(kind="path", points=[[0.25, 0.5], [0.75, 0.5]], radius=0.1, hardness=0.5, scale=1)], 1e-3, GRID, pictures
    )
    x, y = GRID.centres()
    assert painted[np.abs(y - 0.375) > 0.1] == pytest.approx(1e-3)
    assert painted[(np.abs(y - 0.375) < 0.04) & (np.abs(x - 0.5) < 0.2)] == pytest.approx(1)


def test_the_mean_viscosity_does_not_depend_on_the_grid(pictures: Pictures) -> None:
    layers = [
        layer(kind="picture", range=[1e-3, 1], blur=0.05),
        layer(kind="path", points=[[0.2, 0.2], [0.8, 0.7]], radius=0.1, scale=10, combine="max"),
        layer(kind="picture", range=[1, 10], levels=5, blur=0.02, combine="multiply"),
    ]
    reference = viscosity(layers, 0, Grid.for_picture(256, 192, 1024), pictures)
    for cells in (128, 256, 512):
        field = viscosity(layers, 0, Grid.for_picture(256, 192, cells), pictures)
        assert np.log(field).mean() == pytest.approx(np.log(reference).mean(), rel=2e-3), cells


# Freeze


def test_freeze_layers_add_remove_and_replace(pictures: Pictures) -> None:
    right = freeze(kind="picture", picture="half.png")
    top = freeze(kind="constant", window={"box": [0, 0, 1, 0.5]}, combine="remove")
    dot = freeze(kind="path", points=[[0.5, 0.5]], radius=0.2, hardness=1.0, combine="replace")
    assert not solid([], GRID, pictures).any()
    assert solid([right], GRID, pictures).mean() == 0.5
    assert solid([right, top], GRID, pictures).mean() == 0.25
    area = solid([right, top, dot], GRID, pictures).sum() * GRID.h**2
    assert area == pytest.approx(math.pi * 0.2**2, rel=0.15)
    dark = freeze(kind="picture", invert=True, threshold=0.75)
    assert solid([dark], GRID, pictures).mean() == pytest.approx(0.25, abs=0.02)


@pytest.mark.parametrize("size", [(5000, 10), (10, 5000), (16384, 32)])
def test_a_narrow_picture_is_frozen_where_it_is_said(pictures: Pictures, size: tuple[int, int]) -> None:
    dot = freeze(kind="path", points=[[0.5, 0.5]], radius=0.01, hardness=1.0)
    frozen = solid([dot], Grid(*size, (size[0] / max(size), size[1] / max(size))), pictures)
    assert frozen.shape == size[::-1]
    along = np.flatnonzero(frozen.any(axis=int(size[0] > size[1]) - 1))
    assert len(along) == pytest.approx(0.02 * max(size), rel=0.1)
    assert along.mean() == pytest.approx(max(size) / 2, abs=1)


def test_a_segment_freezes(pictures: Pictures) -> None:
    band = freeze(kind="picture", segment={"above": 0.25, "below": 0.5})
    assert solid([band], GRID, pictures).mean() == pytest.approx(0.25, abs=0.03)


def test_a_color_is_found() -> None:
    pixels = np.zeros((48, 64, 3), np.uint8)
    pixels[:, :16] = (200, 160, 60)
    chosen = Segment(color="#c8a040", tolerance=0.1).weight("source", GRID, Pictures(Picture(pixels)))
    assert chosen.mean() == 0.25


# What is refused


def test_a_picture_of_another_size_is_fitted_and_says_so(pictures: Pictures) -> None:
    viscosity([layer(kind="picture", picture="flat.png", scale=1)] * 2, 0, GRID, pictures)
    assert pictures.notices == ["flat.png is 30 x 10 and the picture 256 x 192: stretched to fit it"]


@pytest.mark.parametrize(
    ("keys", "part"),
    [
        ({"scale": -1}, "greater than or equal to 0"),
        ({"scale": math.nan}, "finite|greater"),
        ({"scale": math.inf}, "finite|less"),
        ({"scale": 1e9}, "less than"),
        ({"range": [0, 1]}, "above 0"),
        ({}, "either 'scale'"),
        ({"scale": 1, "range": [1, 2]}, "either 'scale'"),
        ({"scale": 1, "levels": 1}, "levels"),
        ({"scale": 1, "blur": -1}, "blur"),
        ({"scale": 1, "combine": "add"}, "combine"),
        ({"scale": 1, "colour": "red"}, "colour"),
        ({"kind": "path", "points": [], "scale": 1}, "points"),
        ({"kind": "path", "points": [[0, 0]], "radius": 0, "scale": 1}, "radius"),
        ({"kind": "paint", "scale": 1}, "kind"),
        ({"scale": 1, "window": {"box": [0.5, 0, 0.5, 1]}}, "left < right"),
        ({"scale": 1, "window": {"box": [0, 0.5, 1, 0.5]}}, "top < bottom"),
        ({"scale": 1, "segment": {}}, "chooses by"),
        ({"scale": 1, "segment": {"above": 0.5, "color": "#ffffff"}}, "chooses by"),
        ({"scale": 1, "segment": {"above": 0.5, "below": 0.5}}, "nothing lies"),
        ({"scale": 1, "segment": {"above": 0.5, "below": 0.4}}, "nothing lies"),
        ({"scale": 1, "segment": {"color": "red"}}, "#c8a040"),
    ],
)
def test_bad_layers_are_refused(keys: dict[str, Any], part: str) -> None:
    with pytest.raises(ValidationError, match=part):
        layer(**{"kind": "picture", **keys})


@pytest.mark.parametrize(
    ("keys", "part"),
    [
        ({"picture": "none.png"}, "none.png"),
        ({"segment": {"color": "#00ff00"}}, "segmentation is empty"),
        ({"segment": {"above": 0, "below": 1}}, "whole picture"),
        ({"picture": "flat.png", "stretch": True}, "same everywhere"),
    ],
)
def test_what_a_picture_does_not_allow_names_the_layer(keys: dict[str, Any], part: str, pictures: Pictures) -> None:
    bad = layer(**{"kind": "picture", "name": "sky", "scale": 1, **keys})
    with pytest.raises(UserError, match=rf'viscosity\[2\] "sky": .*{part}'):
        viscosity([layer(kind="constant", scale=1), bad], 0, GRID, pictures)


def test_factors_cannot_run_away(pictures: Pictures) -> None:
    layers = [layer(kind="constant", scale=1e4), layer(kind="constant", scale=1e4, combine="multiply")]
    with pytest.raises(UserError, match="the most is"):
        viscosity(layers, 0, GRID, pictures)


def test_what_is_all_but_nothing_beside_much_is_told_in_the_sentence_alone(pictures: Pictures) -> None:
    window = {"box": [0.2, 0.2, 0.8, 0.8], "soft": 0.2}
    layers = [layer(kind="constant", scale=5e-324), layer(kind="constant", scale=1e6, window=window)]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(UserError, match="reaches inf; the most is"):
            viscosity(layers, 0, GRID, pictures)

"""Areas of a picture against SciPy's, OpenCV's and set operations on them."""

from __future__ import annotations

import random
from itertools import combinations

import cv2
import numpy as np
import pytest
from scipy import ndimage

from app.errors import UserError
from app.model.areas import Area, Part, inverted
from app.model.mask_edits import FillMask, PictureMask, edited, with_edit
from app.model.recipe import Recipe
from app.model.sampling import FINEST, Segment, SmallPictures, Window, connected, strips
from solver.grid import Grid
from support.pictures import OnePicture

SIZE = 160, 120
GRID = Grid(*SIZE)


def textured(seed: int = 3, size: tuple[int, int] = SIZE) -> np.ndarray:
    """Blots of many colours."""
    noise = np.random.default_rng(seed).normal(size=(size[1], size[0], 3))
    soft = ndimage.gaussian_filter(noise, (4, 4, 0))
    return np.clip(128 + 400 * soft, 0, 255).astype(np.uint8)


def labelled(chosen: np.ndarray) -> np.ndarray:
    labels = np.zeros(chosen.shape, np.int32)
    ndimage.label(chosen, output=labels)
    return labels


@pytest.mark.parametrize("seed", range(8))
def test_what_is_connected_is_as_scipy_labels_it(seed: int) -> None:
    dice = np.random.default_rng(seed)
    height, width = dice.integers(1, 60, 2)
    chosen = dice.random((height, width)) < dice.choice([0.3, 0.59, 0.8, 1.0])
    labels = labelled(chosen)
    for place in np.argwhere(chosen)[:: max(chosen.sum() // 5, 1)]:
        here = int(place[0]), int(place[1])
        assert np.array_equal(connected(chosen, here), labels == labels[here])
    if not chosen.all():
        row, column = np.argwhere(~chosen)[0]
        with pytest.raises(ValueError, match="not chosen"):
            connected(chosen, (int(row), int(column)))


@pytest.mark.parametrize("place", [(0.31, 0.4), (0.9, 0.1), (1.0, 1.0)])
@pytest.mark.parametrize("tolerance", [10, 40])
def test_by_brightness_as_opencv_floods(place: tuple[float, float], tolerance: int) -> None:
    """The band about the pixel at a place, from there on over the sides of pixels."""
    grey = textured()[..., 0]
    column, row = (min(int(part * side), side - 1) for part, side in zip(place, SIZE, strict=True))
    flooded = np.zeros((SIZE[1] + 2, SIZE[0] + 2), np.uint8)
    flags = 4 | cv2.FLOODFILL_FIXED_RANGE | cv2.FLOODFILL_MASK_ONLY
    cv2.floodFill(grey.copy(), flooded, (column, row), 0, tolerance, tolerance, flags)
    # Half a step more, since a segment takes neither end.
    low, high = ((int(grey[row, column]) + way * (tolerance + 0.5)) / 255 for way in (-1, 1))
    band = {"above": low if low > 0 else None, "below": high if high < 1 else None}
    segment = Segment.model_validate({"at": place, **band})
    seen = segment.chosen("source", GRID, OnePicture(grey[..., None]))
    assert np.array_equal(seen, flooded[1:-1, 1:-1])


def test_by_colour_everywhere_or_only_where_it_is_connected() -> None:
    pixels = textured()
    wanted = pixels[40, 60]
    near = np.linalg.norm((pixels.astype(float) - wanted) / 255, axis=2) <= 0.3
    colour = "#" + bytes(wanted.tolist()).hex()
    labels = labelled(near)
    for at, expected in ((None, near), ((60.5 / SIZE[0], 40.5 / SIZE[1]), labels == labels[40, 60])):
        segment = Segment(color=colour, tolerance=0.3, at=at)
        assert np.array_equal(segment.chosen("source", GRID, OnePicture(pixels)), expected)


def reference(part: Area, x: np.ndarray, y: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    """The pixels (bool) whose middles lie in an area that is not inverted, by OpenCV, and the equations of shapes."""
    if part.window is not None:
        left, top, right, bottom = part.window.box
        if part.window.shape == "rectangle":
            return (x > left) & (x < right) & (y > top) & (y < bottom)
        a, b = (right - left) / 2, (bottom - top) / 2
        return ((x - left - a) / a) ** 2 + ((y - top - b) / b) ** 2 < 1
    if part.outline is not None:
        drawn = np.zeros(x.shape, np.uint8)
        corners = np.rint((np.array(part.outline) * SIZE - 0.5) * 65536).astype(np.int32)
        cv2.fillPoly(drawn, [corners], 1, shift=16)
        return drawn > 0
    assert part.segment is not None
    return part.segment.chosen("source", GRID, OnePicture(pixels)) > 0


def anything(dice: random.Random) -> Area:
    return _anything(dice).model_copy(update={"invert": dice.random() < 0.3})


def _anything(dice: random.Random) -> Area:
    match dice.randrange(4):
        case 0 | 1 as kind:
            left, top = dice.uniform(0, 0.7), dice.uniform(0, 0.7)
            box = left, top, left + dice.uniform(0.1, 0.3), top + dice.uniform(0.1, 0.3)
            return Area(window=Window(box=box, shape=("rectangle", "ellipse")[kind]))
        case 2:
            corners = [(dice.random(), dice.random()) for _ in range(dice.randrange(3, 9))]
            return Area(outline=tuple(corners))
        case _:
            low = dice.uniform(0.3, 0.5)
            return Area(segment=Segment(above=low, below=low + 0.1))


@pytest.mark.parametrize("seed", range(12))
def test_random_parts_added_and_taken_away_are_sets(seed: int) -> None:
    """But for pixels that an edge cuts."""
    dice, pixels = random.Random(seed), textured(seed)
    parts = [
        Part(combine=dice.choice(("add", "subtract", "intersect")), **dict(anything(dice)))
        for _ in range(dice.randrange(1, 6))
    ]
    first = {name: getattr(parts[0], name) for name in Area.model_fields}
    edit = FillMask(kind="fill", tick=0, of="frozen", amount=1.0, then=tuple(parts[1:]), **first)
    before = np.zeros((SIZE[1], SIZE[0]), np.uint8)
    grid = GRID
    pictures = SmallPictures(OnePicture(pixels))
    after = edited(before, edit, grid, pictures)
    x, y = grid.centres()
    x, y = x / grid.extent[0], y / grid.extent[1]
    wanted, edges = np.zeros(x.shape, bool), np.zeros(x.shape, bool)
    for number, part in enumerate(parts):
        here = reference(part, x, y, pixels)
        if part.segment is None:
            edges |= ndimage.binary_dilation(here, iterations=2) != ndimage.binary_erosion(here, iterations=2)
        if part.outline is not None:
            line = np.rint(np.array(part.outline) * SIZE - 0.5).astype(np.int32)
            edges |= cv2.polylines(np.zeros(x.shape, np.uint8), [line], True, 1, 3) > 0
        here = here != part.invert
        if number and part.combine != "add":
            wanted = wanted & (~here if part.combine == "subtract" else here)
        else:
            wanted = wanted | here
    assert np.array_equal((after > 127)[~edges], wanted[~edges])
    first, *then = inverted(parts)
    outside = edit.model_copy(update={"invert": first.invert, "then": tuple(then)})
    assert np.allclose(outside.coverage(grid, pictures), 1 - edit.coverage(grid, pictures), rtol=0, atol=1e-15)
    assert edges.mean() < 0.5
    assert not before.any()


def test_an_area_lies_in_all_that_bounds_it() -> None:
    """Its window, its outline and its segment, whichever of them it has."""
    pixels, low = OnePicture(textured()), 0.4
    bounds = {
        "window": Window(box=(0.1, 0.2, 0.8, 0.7), shape="ellipse", soft=0.1),
        "outline": ((0.2, 0.1), (0.9, 0.5), (0.3, 0.9)),
        "segment": Segment(above=low, below=low + 0.2),
    }
    each = {name: Area.model_validate({name: bound}).coverage(GRID, pixels) for name, bound in bounds.items()}
    for count in range(4):
        for names in combinations(bounds, count):
            wanted = np.prod([np.ones((SIZE[1], SIZE[0])), *(each[name] for name in names)], axis=0)
            area = Area.model_validate({name: bounds[name] for name in names})
            assert np.allclose(area.coverage(GRID, pixels), wanted, rtol=0, atol=1e-12), names
            assert count == 0 or 0 < wanted.mean() < 1


def test_an_edge_there_and_back_is_none() -> None:
    """A hole hangs on its ring by such edges, and nothing is seen of them."""
    dice = random.Random(1)
    for _ in range(20):
        turn = dice.uniform(0, 6)
        ring, hole = (
            [(0.5 + r * np.cos(turn + k), 0.5 + r * np.sin(turn + k)) for k in np.arange(0, 6.2, 0.3)]
            for r in (0.4, dice.uniform(0.05, 0.3))
        )
        grid = Grid(97, 97)
        both = Area(outline=(*ring, ring[0], *hole, hole[0], ring[0])).coverage(grid, OnePicture(textured()))
        one, other = (Area(outline=tuple(part)).coverage(grid, OnePicture(textured())) for part in (ring, hole))
        assert np.array_equal(both, one - other)


def test_large_pictures_are_looked_at_in_means_as_opencv_takes_them() -> None:
    for kind in (np.uint8, np.uint16):
        pixels = np.random.default_rng(1).integers(0, np.iinfo(kind).max, (48, 3 * FINEST - 6, 3), kind, endpoint=True)
        small = SmallPictures(OnePicture(pixels)).load("source").pixels
        wanted = cv2.resize(pixels, (FINEST - 2, 16), interpolation=cv2.INTER_AREA)
        assert small.dtype == kind
        assert np.abs(small.astype(int) - wanted).max() <= 1
    light = pixels.astype(np.float32) / 9
    wanted = cv2.resize(light, (FINEST - 2, 16), interpolation=cv2.INTER_AREA)
    assert np.allclose(SmallPictures(OnePicture(light)).load("source").pixels, wanted, rtol=1e-4)


def test_strips_are_interpolated_as_opencv_does() -> None:
    values = np.random.default_rng(2).random((30, 40))
    values[10:14] = 0
    grid, made = Grid(333, 250), np.zeros((250, 333))
    for rows, part in strips(values, grid):
        made[rows] = part
    assert np.abs(made - cv2.resize(values, (333, 250), interpolation=cv2.INTER_LINEAR)).max() < 1e-5


@pytest.mark.parametrize("of", ["frozen", "thickness"])
def test_a_fill_on_a_large_canvas_is_that_of_a_smaller_one(of: str) -> None:
    """Within a texel of that: what is filled is worked out on 2048 texels and interpolated."""
    width, height = 3 * FINEST, 96
    canvas, kind = Grid(width, height), np.uint8 if of == "frozen" else np.uint16
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    pixels = np.where(((x % 300 - 150) ** 2 + (y - 48) ** 2 < 40**2)[..., None], (200, 30, 30), (20, 60, 90))
    edit = FillMask.model_validate(
        {"kind": "fill", "tick": 0, "of": of, "amount": 1.0, "segment": Segment(color="#c81e1e", tolerance=0.2)}
    )
    before = np.zeros((height, width), kind) if of == "frozen" else np.full((height, width), 24576, kind)
    after = edited(before, edit, canvas, SmallPictures(OnePicture(pixels.astype(np.uint8))))
    discs = (x % 300 - 150) ** 2 + (y - 48) ** 2
    full = 255 if of == "frozen" else 24576 + 8192
    assert (after[discs < 36**2] == full).all()
    assert (after[discs > 44**2] == before[0, 0]).all()


def test_brightness_makes_thick_what_is_bright_or_dark() -> None:
    ramp = np.tile(np.linspace(0, 255, SIZE[0]).astype(np.uint8), (SIZE[1], 1))[..., None]
    before = np.random.default_rng(1).integers(0, 65535, SIZE[::-1], np.uint16)
    for invert in (False, True):
        edit = PictureMask(kind="picture", tick=0, of="thickness", white=2.0, invert=invert)
        after = edited(before, edit, GRID, SmallPictures(OnePicture(ramp)))
        grey = ramp[..., 0] / 255
        assert np.abs(after - (24576 + 8192 * 2 * (1 - grey if invert else grey))).max() <= 0.51


def test_the_pictures_brightness_takes_its_own_place_and_no_others() -> None:
    edit = PictureMask(kind="picture", tick=3, of="thickness", white=2.0)
    stroke = Recipe.parse(
        '[[mask]]\nkind = "stroke"\ntool = "thicken"\nradius = 0.1\nsamples = [[3, 0.5, 0.5, 1.0]]'
    ).mask
    more = edit.model_copy(update={"white": 3.0})
    assert with_edit((edit, *stroke), more) == (more, *stroke)
    for other in (
        edit.model_copy(update={"tick": 2}),
        edit.model_copy(update={"of": "frozen"}),
        edit.model_copy(update={"picture": "other.png"}),
        FillMask(kind="fill", tick=3, of="thickness", amount=1.0),
    ):
        assert with_edit((edit, other), more) == (edit, other, more)


def test_recipes_say_areas_and_wrong_ones_are_a_sentence() -> None:
    text = (
        'version = 5\n[[mask]]\nkind = "fill"\ntick = 0\nof = "frozen"\namount = 1.0\n'
        'segment = {color = "#102030", at = [0.5, 0.5]}\n'
        'then = [{window = {box = [0.1, 0.1, 0.3, 0.3]}}, {combine = "subtract", segment = {above = 0.5}}]\n'
    )
    recipe = Recipe.parse(text)
    fill = recipe.mask[0]
    assert isinstance(fill, FillMask)
    assert [part.combine for part in fill.then] == ["add", "subtract"]
    assert Recipe.parse(recipe.text()) == recipe
    assert "[[mask.then]]" not in recipe.text()
    for wrong, said in (
        ('"subtract"', "combine"),
        ("0.5, 0.5]}", "at"),
        ('"#102030"', "like"),
        ("[0.1, 0.1, 0.3, 0.3]", "box"),
    ):
        bad = {'"subtract"': '"less"', "0.5, 0.5]}": "0.5, 1.5]}", '"#102030"': '"red"'}.get(wrong, "[0.3, 0, 0.1, 1]")
        with pytest.raises(UserError, match=said) as raised:
            Recipe.parse(text.replace(wrong, bad))
        assert "\n" not in str(raised.value)

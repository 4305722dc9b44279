"""Edits of masks, against SciPy's, and which begin as others do."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError
from scipy import ndimage

from app.errors import UserError
from app.model import mask_edits
from app.model.mask_edits import (
    FeatherMask,
    FillMask,
    InvertMask,
    MaskName,
    MaskStroke,
    PictureMask,
    SpreadMask,
    WholeEdit,
    as_grey,
    edited,
    remaining,
)
from app.model.recipe import Recipe
from app.model.sampling import Segment, SmallPictures, Window
from solver.grid import Grid
from support.pictures import OnePicture

CANVAS = Grid.for_picture(60, 45, 60)
KINDS: dict[MaskName, type] = {"frozen": np.uint8, "thickness": np.uint16}


RED = np.zeros((45, 60, 3), np.uint8)
RED[10:30, 20:50] = 255, 0, 0


def words(of: MaskName, seed: int = 1) -> np.ndarray:
    kind = KINDS[of]
    values = np.random.default_rng(seed).integers(0, np.iinfo(kind).max, (45, 60), kind, endpoint=True)
    values[:, 30:] = values[0, 0]
    return values


def done(edit: WholeEdit, before: np.ndarray) -> np.ndarray:
    after = edited(before.copy(), edit, CANVAS, SmallPictures(OnePicture(RED)))
    assert after.dtype == before.dtype
    assert after.shape == before.shape
    return after


@pytest.mark.parametrize("of", KINDS)
@pytest.mark.parametrize("radius", [0.01, 0.05, 0.1234, 0.3, 2.0])
def test_grow_and_shrink_are_the_largest_and_the_smallest_within_a_disc(
    of: MaskName, radius: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beyond the border there is nothing that either could come from."""
    monkeypatch.setattr(mask_edits, "ROWS_AT_ONCE", 5)
    before = words(of)
    (hx, hy), reach = CANVAS.spacing, min(int(radius / CANVAS.h) + 1, 62)
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    disc = (x * hx) ** 2 + (y * hy) ** 2 <= radius**2
    last = np.iinfo(before.dtype).max
    larger = ndimage.grey_dilation(before, footprint=disc, mode="constant", cval=0)
    smaller = ndimage.grey_erosion(before, footprint=disc, mode="constant", cval=last)
    assert np.array_equal(done(SpreadMask(kind="grow", tick=0, of=of, radius=radius), before), larger)
    assert np.array_equal(done(SpreadMask(kind="shrink", tick=0, of=of, radius=radius), before), smaller)


@pytest.mark.parametrize("rows", [9, 263])
def test_a_disc_may_reach_a_whole_number_of_rows(rows: int) -> None:
    """Of 9 of these rows the square is, as it is rounded, above the radius's."""
    canvas = Grid.for_picture(8, 4900, 4900)
    before = np.zeros((4900, 8), np.uint8)
    before[2450, 4] = 255
    edit = SpreadMask(kind="grow", tick=0, of="frozen", radius=rows / 4900)
    column = edited(before, edit, canvas, SmallPictures(OnePicture(RED)))[:, 4]
    assert (column > 0).sum() == 2 * rows + 1


@pytest.mark.parametrize("of", KINDS)
def test_feather_is_three_means(of: MaskName, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mask_edits, "ROWS_AT_ONCE", 5)
    before = words(of)
    after = done(FeatherMask(kind="feather", tick=0, of=of, radius=0.15), before)
    wanted = before.astype(float)
    for _ in range(3):
        wanted = ndimage.uniform_filter(wanted, 7, mode="nearest")
    assert np.abs(after - wanted).max() <= 4  # of rounding, three times along each axis


def test_an_edge_is_soft_as_far_as_the_radius_says() -> None:
    before = np.full((45, 60), 24576, np.uint16)
    before[:, 30:] = 40000
    row = done(FeatherMask(kind="feather", tick=0, of="thickness", radius=9 / 60), before)[20]
    assert (row[:21] == 24576).all()
    assert (row[39:] == 40000).all()
    assert (np.diff(row[20:40].astype(int)) > 0).all()


@pytest.mark.parametrize("of", KINDS)
def test_inverting_twice_is_nothing_and_keeps_the_range(of: MaskName) -> None:
    before = np.clip(words(of), 7, None)
    invert = InvertMask(kind="invert", tick=0, of=of)
    once = done(invert, before)
    assert np.array_equal(done(invert, once), before)
    if of == "thickness":
        assert (once.min(), once.max()) == (before.min(), before.max())
        assert once[before == before.max()].max() == before.min()
    else:
        assert np.array_equal(once, 255 - before)


def test_a_fill_takes_its_area_and_no_more() -> None:
    before = np.full((45, 60), 24576, np.uint16)

    def fill(**area: object) -> np.ndarray:
        edit = FillMask.model_validate({"kind": "fill", "tick": 0, "of": "thickness", "amount": 2.0, **area})
        return done(edit, before)

    assert (fill() == 24576 + 2 * 8192).all()
    box = fill(window=Window(box=(0.25, 0.2, 0.5, 0.6)))
    assert np.array_equal(np.argwhere(box > 24576).min(0), [9, 15])
    assert np.array_equal(np.argwhere(box > 24576).max(0), [26, 29])
    triangle = fill(outline=((0.1, 0.1), (0.9, 0.1), (0.1, 0.9)))
    assert abs((triangle > 24576).mean() - 0.32) < 0.01
    # What is wound around twice is out again.
    twice = fill(outline=((0.1, 0.1), (0.9, 0.1), (0.9, 0.9), (0.1, 0.9)) * 2)
    assert np.array_equal(twice, before)
    red = fill(segment=Segment(color="#ff0000", tolerance=0.2))
    assert np.array_equal(red > 24576, RED[..., 0] > 0)
    both = fill(segment=Segment(color="#ff0000"), window=Window(box=(0.0, 0.0, 0.5, 1.0)))
    assert np.array_equal(both > 24576, (RED[..., 0] > 0) & (np.arange(60) < 30))


@pytest.mark.parametrize("of", KINDS)
def test_a_mask_written_as_a_picture_is_read_back_word_by_word(of: MaskName) -> None:
    before = words(of)
    grey = as_grey(before, of)
    edit = PictureMask(kind="picture", tick=0, of=of, picture="mask.png")
    after = edited(words(of, 2), edit, CANVAS, SmallPictures(OnePicture(grey[..., None])))
    assert np.array_equal(after, np.maximum(before, 24576) if of == "thickness" else before)
    assert (grey.min(), grey.max() > 65000) == (0, True)
    half = edited(
        after, edit.model_copy(update={"white": -2.0}), CANVAS, SmallPictures(OnePicture(np.full_like(RED, 128)))
    )
    assert (half == (round(24576 - 2 * 8192 * 128 / 255) if of == "thickness" else 128)).all()


def stroke(*ticks: int, tick: int = 3, radius: float = 0.1) -> MaskStroke:
    samples = tuple((tick + k, 0.1 * k, 0.5, 1.0) for k in ticks)
    return MaskStroke(kind="stroke", tool="freeze", radius=radius, samples=samples)


def test_what_is_left_of_edits_after_those_that_are_done() -> None:
    invert = InvertMask(kind="invert", tick=3, of="frozen")
    whole, part = stroke(0, 1, 1, 2), stroke(0, 1, 1)
    assert remaining([whole, invert], []) == [(whole, 3), (invert, 3)]
    assert remaining([whole, invert], [part]) == [(whole, 5), (invert, 3)]
    assert remaining([whole, invert], [whole]) == [(invert, 3)]
    assert remaining([whole, invert], [whole, invert]) == remaining([whole, invert], [whole, invert.model_copy()]) == []
    assert remaining([whole], [whole, invert]) is None
    assert remaining([part], [whole]) is None
    assert remaining([whole, invert], [part, invert]) is None  # an edit after half a stroke
    assert remaining([whole], [stroke(0, 1)]) is None  # a tick of which not all had come
    assert remaining([whole], [stroke(0, 1, 1, radius=0.2)]) is None
    assert remaining([invert], [part]) is None


def test_recipes_go_on_from_one_another_by_their_masks() -> None:
    first, second = stroke(0, 1), InvertMask(kind="invert", tick=3, of="frozen")
    none, one, two = (Recipe(mask=masks) for masks in ((), (first,), (first, second)))
    assert one.agrees_until(two) == two.agrees_until(none) == 3
    assert [two.goes_on_from(one, tick) for tick in (2, 3, 4)] == [True, True, False]
    assert [one.goes_on_from(two, tick) for tick in (2, 3, 4)] == [True, False, False]
    assert two.goes_on_from(two, 100)


def test_a_recipe_with_masks_is_read_as_it_was_written() -> None:
    edits = (
        stroke(0, 1, 1, 2),
        InvertMask(kind="invert", tick=3, of="thickness"),
        FillMask(kind="fill", tick=4, of="frozen", amount=1.0, outline=((0.1, 0.1), (0.9, 0.1), (0.1, 0.9))),
        SpreadMask(kind="shrink", tick=4, of="frozen", radius=0.1),
        PictureMask(kind="picture", tick=5, of="thickness", picture="m.png"),
    )
    recipe = Recipe(mask=edits)
    text = recipe.text()
    assert Recipe.parse(text) == recipe
    assert '[[mask]]\nkind = "stroke"\ntool = "freeze"\n' in text
    with pytest.raises(UserError, match="the ticks of \\[\\[mask\\]\\] must not go backwards"):
        Recipe.parse(Recipe().edited(mask=edits[::-1]).text())
    with pytest.raises(UserError, match="from 0 to 1"):
        Recipe.parse(text.replace("amount = 1.0", "amount = 2.0"))
    with pytest.raises(UserError, match="tool"):
        Recipe.parse(text.replace('"freeze"', '"push"'))


def test_a_hand_paints_for_an_hour_at_most_whenever_it_begins() -> None:
    def painted(ticks: int) -> MaskStroke:
        return MaskStroke(kind="stroke", tool="freeze", samples=((500, 0.1, 0.1, 1.0), (500 + ticks, 0.2, 0.1, 1.0)))

    assert painted(216_000).last_tick == 216_500
    with pytest.raises(ValidationError, match="paints for 216001 ticks of the hand; at most 216000, an hour, work"):
        painted(216_001)

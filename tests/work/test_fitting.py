"""Fitted recipes bring points to where they should be: found again by replaying what was written, on its own."""

from __future__ import annotations

import re
import signal
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.errors import Cancelled, UserError
from app.media.auxiliary import Pictures
from app.media.displacement import Displacement
from app.media.landmarks import Pairs, read_pairs, write_pairs
from app.media.maps import write_map
from app.media.pictures import write_picture
from app.media.recipes import read_recipe
from app.media.source import open_source
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.progress import INTERRUPTED, Progress
from app.work import fitting, worker
from app.work.fit_job import FitJob
from app.work.fitting import LEAST_DET, Fit, Fitted, Trial
from app.work.replay import Replay
from app.work.worker import Outcome, perform
from solver.gl.device import Device
from solver.warp.inverse import ForwardMap
from support.commands import Run
from support.leading import distortion

PICTURE = Picture(np.zeros((48, 64, 3), np.uint8))
EXTENT = np.array([1.0, 0.75])
RECIPE = "duration = 0.4\n[fluid]\ngrid = 32\ndt = 0.04\nviscosity = 0.03\n[[pin]]\nat = [0.8, 0.8]\nradius = 0.2\n"
FREE = RECIPE.partition("[[pin]]")[0].replace("duration = 0.4", "duration = 0.8")
PAIRS = np.array([[[0.3, 0.4], [0.36, 0.43]], [[0.6, 0.5], [0.6, 0.44]]])
WALL = '[[freeze]]\nkind = "path"\npoints = [[0.5, 0.0], [0.5, 1.0]]\nhardness = 1.0\n'


def fit(
    device: Device, pairs: np.ndarray | Pairs | None, evaluations: int = 8, recipe: str = RECIPE, **hearing: object
) -> Fitted:
    progress = Progress(**hearing)  # pyright: ignore[reportArgumentType]
    pairs = Pairs.points(pairs) if isinstance(pairs, np.ndarray) else pairs
    return Fit(Recipe.parse(recipe), PICTURE, Path(), pairs, evaluations).perform(device, progress)


def arrived(device: Device, recipe: Recipe, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
    """Where points (fractions) of the original are after a recipe; its displacement and folds at 512 x 512 places."""
    replay = Replay(device, recipe, Pictures(PICTURE), budget=0)
    replay.seek(recipe.ticks)
    with ForwardMap(replay.warp) as forward:
        found = points + forward.at(points * EXTENT) / EXTENT
    shown, folds = replay.warp.read((512, 512)), replay.warp.statistics((512, 512)).folds
    replay.release()
    return found, shown, folds


def test_the_written_recipe_brings_the_points_there_with_less_work_and_no_fold(device: Device):
    once, found = (fit(device, PAIRS, evaluations) for evaluations in (1, 32))
    recipe = Recipe.parse(found.trial.recipe.text())
    places, displacement, folds = arrived(device, recipe, PAIRS[:, 0])
    assert np.hypot(*((places - PAIRS[:, 1]) * EXTENT).T).max() * 64 < 0.1
    np.testing.assert_allclose(found.pairs.places[:, 1], places, atol=0.02 / 64)
    assert found.errors.max() < 0.1
    assert folds == 0
    assert distortion(displacement).least > 0
    assert found.trial.det > LEAST_DET
    assert found.trial.work < once.trial.work
    assert recipe.pin == Recipe.parse(RECIPE).pin
    assert not found.notices


def test_the_same_is_found_again_also_from_what_was_fitted(device: Device):
    one = fit(device, PAIRS, 4).trial.recipe
    assert fit(device, PAIRS, 4).trial.recipe.text() == one.text()
    longest = one.handle[1].model_copy(update={"name": f"pair {'9' * 5000}"})  # a number that int() does not read
    for earlier in (one, one.edited(handle=(one.handle[0], longest))):
        again = fit(device, PAIRS[:1], 1, earlier.text()).trial.recipe
        assert [handle.name for handle in again.handle] == ["pair 1"]


@pytest.mark.parametrize(
    ("pairs", "more", "said"),
    [
        ([[[1.2, 0.5], [0.5, 0.5]], [[0.3, 0.3], [0.4, 0.3]]], "", "pair 1 is left out: its point is outside"),
        (
            [[[4e3, 0.5], [0.5, 0.5]], [[0.3, 0.3], [0.4, 0.3]]],
            "",
            "pair 1 is left out: its point is outside the picture",
        ),
        ([[[0.3, 0.3], [0.4, 0.3]], [[0.7, 0.5], [1.2, 0.5]]], "", "pair 2 goes only to the picture's edge"),
        (
            [[[0.4, 0.5], [0.5, 0.5]], [[0.4, 0.5], [0.3, 0.5]]],
            "",
            '"pair 2" hold the same place but have different goals',
        ),
        ([[[0.3, 0.5], [0.6, 0.5]], [[0.6, 0.5], [0.3, 0.5]]], "", '"pair 2" cross each other\'s way'),
        ([[[0.5, 0.5], [0.7, 0.5]], [[0.2, 0.5], [0.3, 0.5]]], WALL, "pair 1 cannot be met: its point is frozen"),
        ([[[0.3, 0.5], [0.5, 0.5]]], WALL, "pair 1 cannot be met: its place is frozen"),
        ([[[0.2, 0.5], [0.8, 0.5]]], WALL, "pair 1 cannot be met: what is frozen lies between its point and its place"),
    ],
    ids=[
        "point outside",
        "far outside",
        "place outside",
        "coincident",
        "crossing",
        "frozen",
        "into what is frozen",
        "beyond a wall",
    ],
)
def test_what_cannot_be_met_is_told_by_number_and_nothing_folds(
    pairs: list[list[list[float]]], more: str, said: str, device: Device
):
    found = fit(device, np.array(pairs), 1, RECIPE + more)
    assert any(said in notice for notice in found.notices), found.notices
    assert any(re.search("pixels from where (it|they) should be", told) for told in found.notices) or "left out" in said
    _, displacement, folds = arrived(device, found.trial.recipe, np.zeros((1, 2)))
    assert np.isfinite(displacement).all()
    assert folds == found.trial.folds == 0


def test_however_many_pairs_cannot_be_met_each_reason_is_told_in_one_sentence(device: Device):
    here = [[[0.3 + 0.05 * number, 0.3], [0.3, 0.6]] for number in range(6)]
    outside = [[[1.1, 0.1 * number], [0.5, 0.5]] for number in range(5)]
    beyond = [[[0.8, 0.8], [1.2, 0.8]], [[0.7, 0.8], [0.7, 1.2]]]
    found = fit(device, np.array([*here, *outside, *beyond]), 1)
    out, short, missed = found.notices
    assert out == "pair 7, pair 8, pair 9, pair 10 and 1 more are left out: their points are outside the picture"
    assert short == "pair 12, pair 13 go only to the picture's edge: their places are outside"
    assert re.fullmatch(
        r"pair 1, pair 2, .* and \d more end up to [\d.]+ pixels from where they should be; "
        r'handle\[1\] "pair 1" and handle\[2\] "pair 2" [^;]*; \d+ more conflicts are there',
        missed,
    )


def test_pairs_of_which_some_are_frozen_are_each_told_once(device: Device):
    """With why they are missed, where that is known."""
    frozen = [[[0.5, 0.3 + 0.1 * number], [0.7, 0.3 + 0.1 * number]] for number in range(2)]
    crossing = [[[0.1, 0.2], [0.3, 0.2]], [[0.3, 0.2], [0.1, 0.2]]]
    caught, missed = fit(device, np.array([*frozen, *crossing]), 1, RECIPE + WALL).notices
    assert re.fullmatch(
        r"pair 1, pair 2 cannot be met: their points are frozen; "
        r"they end up to [\d.]+ pixels from where they should be",
        caught,
    )
    assert re.match(r"pair 3, pair 4 end up to [\d.]+ pixels from where they should be; handle", missed)


def test_what_was_chosen_in_a_later_frame_of_a_clip_is_looked_for_there(device: Device, tmp_path: Path):
    """Of the first frame, which is black, nothing is frozen; of the second everything."""
    for number, grey in enumerate((0, 255)):
        write_picture(tmp_path / f"f.{number:04d}.png", Picture(np.full((48, 64, 3), grey, np.uint8)))
    opened = open_source(tmp_path / "f.%04d.png")
    frozen = '[[mask]]\nkind = "picture"\nof = "frozen"\npicture = "source"\ntick = 0\nframe = 1\n'
    fit = Fit(Recipe.parse(FREE + frozen), opened.picture, tmp_path, Pairs.points(PAIRS), 1, clip=opened.clip)
    assert "their points are frozen" in fit.perform(device, Progress()).notices[0]


def test_pairs_in_each_others_way_are_told_once_with_how_far_they_miss(device: Device):
    same = [[[0.4, 0.5], [0.5, 0.5]], [[0.4, 0.5], [0.3, 0.5]]]
    (told,) = fit(device, np.array(same), 1).notices
    assert re.fullmatch(
        r"pair 1, pair 2 end up to [\d.]+ pixels from where they should be; "
        r'handle\[1\] "pair 1" and handle\[2\] "pair 2" hold the same place but have different goals',
        told,
    )
    (told,) = fit(device, np.array([*same, [[0.4, 0.5], [0.5, 0.500001]]]), 1).notices
    assert told.endswith("but have different goals; 1 more conflict is there")


def test_pairs_that_ask_for_the_impossible_are_fitted_as_far_as_can_be(fluidwarp: Run, tmp_path: Path):
    """Of reaches at both ends of their range, which shall change alike, none can change at all."""
    write_picture(tmp_path / "a.png", Picture(np.zeros((23, 37, 4), np.uint16)))
    (tmp_path / "r.toml").write_text('picture = "a.png"\nduration = 0.1\n[fluid]\ngrid = 16\n')
    (tmp_path / "p.csv").write_text("3.3,3.3,3.6,3.6\n3.3,3.3,3.1,3.1\n3.300001,3.3,3.9,3.2\n")
    done = fluidwarp(tmp_path, "fit", "r.toml", "--pairs", "p.csv", "-o", "f.toml")
    assert done.returncode == 0
    assert done.stderr.count("\n") == 2


def test_pairs_are_led_after_the_last_reset_of_the_warp(device: Device):
    """Led before it, they would lose their way by it: they ended 20 pixels of 256 short."""
    stroke = '[[stroke]]\ntool = "push"\nradius = 0.2\nsamples = [[0, 0.3, 0.5, 1.0], [9, 0.5, 0.5, 1.0]]\n'
    reset = "[[change]]\ntick = 10\nreset_warp = true\n"
    found = fit(device, PAIRS, recipe=FREE + stroke + reset)
    recipe = found.trial.recipe
    assert {handle.start for handle in recipe.handle} == {0.4}
    assert len(recipe.stroke) == len(recipe.change) == 1
    places, _, folds = arrived(device, recipe, PAIRS[:, 0])
    assert np.hypot(*((places - PAIRS[:, 1]) * EXTENT).T).max() * 64 < 0.1
    assert folds == 0
    assert not found.notices


def test_a_fit_ends_where_the_recipe_s_own_stop_ends_it(device: Device):
    """It told of errors at the end of its duration, which is never reached when it is rendered."""
    found = fit(device, PAIRS, 1, FREE + "[stop]\ndisplacement_above = 0.02\n")
    assert found.errors.min() > 1
    assert not found.is_met
    missed, stopped = found.notices
    assert "pixels from where they should be" in missed
    assert re.match(r"stopped at t = 0\.\d+ s \(tick \d+\): largest displacement", stopped)


def test_all_that_a_fit_has_found_is_handed_on(device: Device, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(worker, "own_device", lambda: device)
    coarse = FREE.replace("grid = 32\ndt = 0.04", "grid = 12\ndt = 0.08")
    recipe = Recipe.parse(coarse + "[stop]\ndisplacement_above = 0.02\n")
    order = Fit(recipe, PICTURE, Path(), Pairs.points(PAIRS[:1]), 12)

    def progress() -> Progress:
        made = [0]
        return Progress(report=lambda done, total: made.append(done), cancel=lambda: max(made) >= 9)

    found = order.perform(device, progress())
    assert (found.is_met, found.stopped, len(found.notices)) == (False, True, 2)
    told = perform(order, progress())
    assert told.recipe is not None
    assert told.recipe.text() == found.trial.recipe.text()
    assert replace(told, recipe=None) == Outcome(
        "the fit", notices=found.notices, verdict=found.told, is_met=False, stopped=True
    )


def test_what_is_fitted_anew_is_waited_for_as_before(device: Device):
    waits = FREE + "[stop]\nhandles_within = 0.0005\n"
    recipe = f'{waits}[[handle]]\nname = "pair 1"\nat = [0.3, 0.4]\nto = [0.4, 0.4]\n'
    assert fit(device, PAIRS, 1, recipe).trial.recipe.stop.handles_within == 0.0005


def test_what_is_frozen_only_at_first_can_be_met(device: Device):
    frozen = '[[mask]]\nkind = "fill"\ntick = 0\nof = "frozen"\namount = 1\n'
    thawed = '[[mask]]\nkind = "clear"\ntick = 2\nof = "frozen"\n'
    handle = "[[handle]]\nat = [0.4, 0.5]\nto = [0.43, 0.5]\nstart = 0.12\n"
    held = fit(device, None, 1, RECIPE + handle + frozen)
    (told,) = (notice for notice in held.notices if "handle[1]" in notice)
    assert re.fullmatch(
        r"handle\[1\] cannot be met: its point is frozen; it ends [\d.]+ pixels from where it should be", told
    )
    found = fit(device, None, 1, RECIPE + handle + frozen + thawed)
    assert not any("frozen" in notice for notice in found.notices), found.notices


def test_pairs_that_nobody_can_lead_are_refused(device: Device):
    with pytest.raises(UserError, match="all pairs lie outside the picture"):
        fit(device, PAIRS + 2)
    with pytest.raises(UserError, match=r"70 pairs beside the recipe's 1 handles and pins; at most 64"):
        fit(device, np.repeat(PAIRS[:1], 70, axis=0))
    around = "[[handle]]\npoints = [[-0.5, 0.5], [1.5, 0.5]]\nto = [0.6, 0.5]\n"
    with pytest.raises(UserError, match="all handles with a goal lie outside the picture"):
        fit(device, None, recipe=RECIPE + around)


HANDLES = """[[handle]]
at = [0.3, 0.4]
keys = [[0.1, 0.3, 0.4], [0.3, 0.36, 0.43]]
start = 0.1
[[handle]]
name = "off"
at = [0.5, 0.5]
to = [0.9, 0.5]
muted = true
[[handle]]
at = [0.2, 0.8]
keys = []
[[handle]]
name = "nose"
at = [0.6, 0.5]
to = [0.6, 0.44]
duration = 0.2
local = 0.5
"""


def test_without_pairs_the_recipe_s_own_handles_are_fitted_and_all_keep_their_numbers(device: Device):
    found = fit(device, None, 3, RECIPE + HANDLES)
    np.testing.assert_allclose(found.pairs.places[:, 0], PAIRS[:, 0])
    recipe = found.trial.recipe
    assert [(handle.name, handle.at, handle.to, handle.local) for handle in recipe.handle] == [
        ("", (0.3, 0.4), (0.36, 0.43), 0.0),
        ("off", (0.5, 0.5), (0.9, 0.5), 0.0),
        ("", (0.2, 0.8), None, 0.0),
        ("nose", (0.6, 0.5), (0.6, 0.44), 0.5),
    ]
    assert recipe.handle[1].muted
    assert recipe.pin == Recipe.parse(RECIPE).pin
    assert recipe.duration == 1.0
    assert found.errors.max() < 0.2
    with pytest.raises(UserError, match="no handle of the recipe leads anywhere"):
        fit(device, None)


def test_what_is_not_fitted_keeps_its_windows(device: Device):
    """Of whatever detail, and none; what is fitted gets them."""
    other = "[[handle]]\nat = [0.8, {}]\nto = [0.82, {}]\nradius = 0.1\nduration = 0.2\n"
    recipe = f"{FREE}{other.format(0.6, 0.6)}detail = 96\n{other.format(0.3, 0.3)}"
    first, second, *led = fit(device, PAIRS, 1, recipe).trial.recipe.handle
    assert [first, second] == list(Recipe.parse(recipe).handle)
    assert all(handle.detail for handle in led)


@pytest.mark.parametrize("local", [None, 0.0, 0.25])
def test_what_is_fitted_is_as_local_as_is_asked_for_and_else_as_it_is_or_has_to_be(device: Device, local: float | None):
    """What is not fitted, as it is muted or goes nowhere, stays as it is."""
    own: list[float | None] = [None, 0.0, 0.0, None]
    for pairs, recipe, kept, usual in (
        (Pairs.points(PAIRS), FREE, [None, None], (0.0, 0.0)),
        (Pairs(PAIRS, ("stem", "stem")), FREE, [None, None], (1.0, 1.0)),
        (None, RECIPE + HANDLES, own, (0.0, 0.0, 0.0, 0.5)),
    ):
        found = Fit(Recipe.parse(recipe), PICTURE, Path(), pairs, 1, local).perform(device, Progress()).trial.recipe
        asked = [local if stays is None else stays for stays in kept]
        assert [handle.local for handle in found.handle] == [*(usual if local is None else asked)]


def test_what_an_animation_shows_of_a_long_recipe_is_still_there_once_it_is_fitted(device: Device):
    """Two seconds are enough for handles, and its [time] began behind them."""
    led = "[[handle]]\nat = [0.3, 0.4]\nto = [0.36, 0.43]\n"
    long = FREE.replace("duration = 0.8", "duration = 2.4")
    assert fit(device, None, 1, f"{long}{led}").trial.recipe.duration == 2.0
    for shown in ("start = 2.2", "end = 2.3", "dissolve = 1.1"):
        assert fit(device, None, 1, f"{long}[time]\n{shown}\n{led}").trial.recipe.duration == 2.4


def test_what_is_turned_is_turned_at_the_end_as_it_was_and_a_line_that_stays_is_held_whole(device: Device):
    still = "[[handle]]\nat = [0.2, 0.3]\nrotate = 40.0\nturned = [[1.1, 20.0, 1.5]]\n"
    led = "[[handle]]\nat = [0.4, 0.6]\nto = [0.46, 0.6]\nduration = 0.1\nrotate = 90.0\nturned = [[0.2, 30.0, 1.2]]\n"
    line = "[[handle]]\npoints = [[0.7, 0.2], [0.8, 0.2], [0.8, 0.4]]\nclosed = true\nkeys = []\n"
    recipe = fit(device, None, 2, RECIPE + still + led + line).trial.recipe
    assert [(each.at, each.to, each.rotate, each.scale, each.turned) for each in recipe.handle[:2]] == [
        ((0.2, 0.3), (0.2, 0.3), 20.0, 1.5, ()),
        ((0.4, 0.6), (0.46, 0.6), 30.0, 1.2, ()),
    ]
    stays = recipe.handle[2]
    assert (stays.points, stays.closed, stays.goal) == (((0.7, 0.2), (0.8, 0.2), (0.8, 0.4)), True, None)
    assert (stays.start, stays.end) == (0.0, None)  # all is held at once, as all goes at once


def test_what_is_pinned_between_strokes_is_pinned_then(device: Device):
    stroke = '[[stroke]]\ntool = "push"\nsamples = [[0, 0.2, 0.2, 1.0], [3, 0.3, 0.2, 1.0]]\n'
    led = "[[handle]]\nat = [0.4, 0.6]\nto = [0.46, 0.6]\nduration = 0.1\nstart = 0.2\n"
    pinned = "[[handle]]\nat = [0.7, 0.2]\nkeys = []\nstart = 0.2\nend = 0.36\n"
    pin = fit(device, None, 1, RECIPE + stroke + led + pinned).trial.recipe.handle[1]
    assert (pin.at, pin.start, pin.end) == ((0.7, 0.2), 0.2, 0.36)


def test_what_was_pinned_after_it_had_been_moved_is_led_to_where_it_was_pinned(device: Device):
    late = "[[handle]]\nat = [0.3, 0.42]\nkeys = []\nstart = 0.35\n"
    handle = "[[handle]]\nat = [0.3, 0.4]\nto = [0.4, 0.4]\nduration = 0.25\n"
    found = fit(device, None, 1, RECIPE + handle + late)
    assert len(found.pairs.places) == 2
    until_then = Recipe.parse(RECIPE.replace("duration = 0.4", "duration = 0.36") + handle)
    moved, _, _ = arrived(device, until_then, np.array([[0.3, 0.42]]))
    assert found.trial.recipe.handle[1].to == pytest.approx(moved[0], abs=1e-5)


@pytest.mark.parametrize("stroke", [False, True], ids=["at once", "after a stroke"])
def test_a_line_keeps_the_shape_that_it_was_set_in(stroke: bool, device: Device):
    """Measured apart from the fit: the points that it held, where they lay, moved and turned as was asked."""
    moved = "[[handle]]\nat = [0.35, 0.35]\nto = [0.35, 0.46]\nduration = 0.3\nradius = 0.3\n"
    if stroke:
        moved = '[[stroke]]\ntool = "push"\nradius = 0.25\nsamples = [[0, 0.35, 0.3, 1.0], [7, 0.35, 0.42, 1.0]]\n'
    line = (
        "[[handle]]\npoints = [[0.2, 0.4], [0.5, 0.4]]\nto = [0.42, 0.5]\nstart = 0.4\nduration = 0.3\nrotate = 20.0\n"
    )
    asked = Recipe.parse(FREE + moved + line)
    corners = np.linspace([0.2, 0.4], [0.5, 0.4], 11)  # where it is held
    seen, _, _ = arrived(device, asked.edited(handle=asked.handle[:-1], duration=0.4), corners)
    arms, angle = (seen - seen.mean(axis=0)) * EXTENT, np.radians(20)
    assert np.ptp(arms[:, 1]) > 0.03  # it has been bent
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    found = fit(device, None, 1, FREE + moved + line)
    recipe = Recipe.parse(found.trial.recipe.text())
    ends, _, _ = arrived(device, recipe, corners)
    off = (ends * EXTENT - (np.array([0.42, 0.5]) * EXTENT + arms @ turn)) * 64
    assert np.hypot(*off.T).max() == pytest.approx(found.errors[-1], abs=0.01)
    assert found.errors[-1] < 0.8
    assert recipe.handle[-1].goals
    assert recipe.handle[-1].start == (0.4 if stroke else 0.0)
    assert recipe.fluid.viscosity == pytest.approx(0.03) if stroke else True


@pytest.mark.parametrize("way", [1, -1])
def test_what_is_turned_by_more_than_half_a_turn_goes_the_same_way_round(way: int, device: Device, tmp_path: Path):
    """Little less than that is asked, after another handle has turned it a little: a fit lets both begin at once."""
    write_map(tmp_path / "m.npy", Displacement(np.full((48, 64, 2), (0.03, 0.0), np.float32)))
    before = f"[[handle]]\nat = [0.35, 0.45]\nrotate = {30 * way}.0\nduration = 0.3\nradius = 0.3\n"
    line = f"[[handle]]\npoints = [[0.25, 0.45], [0.45, 0.45]]\nto = [0.35, 0.45]\nrotate = {165 * way}.0\n"
    found = fit(device, None, 1, f'map = "{tmp_path}/m.npy"\n{FREE}{before}{line}start = 0.4\nduration = 0.3\n')
    turned = found.trial.recipe.handle[-1].rotate
    assert turned is not None
    assert turned * way > 0


def test_what_is_turned_in_a_corner_that_has_been_moved_is_fitted(device: Device, tmp_path: Path):
    """Two places of its ring are in the picture, of which the area was asked: the fit ended in a division by zero."""
    write_map(tmp_path / "m.npy", Displacement(np.full((48, 64, 2), (-0.03, 0.0), np.float32)))
    turned = "[[handle]]\nat = [0.01, 0.01]\nkeys = []\nturned = [[0.3, 20.0, 1.0]]\n"
    (handle,) = fit(device, None, 1, f'map = "{tmp_path}/m.npy"\n{FREE}{turned}').trial.recipe.handle
    assert handle.scale == pytest.approx(1.0, abs=0.05)
    assert handle.rotate in (20.0, 10.0, 5.0)  # less of the way where the map that it begins with folds


def test_a_handle_that_has_let_go_before_the_end_is_left_as_it_is(device: Device):
    gone = "[[handle]]\nat = [0.2, 0.5]\nto = [0.25, 0.5]\nduration = 0.1\nend = 0.2\n"
    led = "[[handle]]\nat = [0.6, 0.5]\nto = [0.6, 0.44]\nstart = 0.3\nduration = 0.2\n"
    found = fit(device, None, 1, FREE + gone + led)
    assert found.trial.recipe.handle[0] == Recipe.parse(FREE + gone).handle[0]
    assert found.told.startswith("1 handle, mean error")


def test_a_pin_that_was_set_late_is_led_to_where_it_was_set(device: Device):
    moved = "[[handle]]\nat = [0.35, 0.35]\nto = [0.35, 0.5]\nduration = 0.3\nradius = 0.3\n"
    pin = "[[pin]]\nat = [0.35, 0.45]\nstart = 0.4\n"
    until_then = Recipe.parse(FREE.replace("duration = 0.8", "duration = 0.4") + moved)
    ((x, y),), _, _ = arrived(device, until_then, np.array([[0.35, 0.45]]))
    recipe = fit(device, None, 1, FREE + moved + pin).trial.recipe
    assert not recipe.pin
    assert recipe.handle[1].to == pytest.approx((x, y), abs=1e-4)


def test_what_handles_do_well_by_themselves_is_where_a_fit_begins(device: Device):
    """Nine small ones that arrive: wide ones in their places arrive too, and move the picture between them."""
    places = [(x, y) for x in (0.2, 0.5, 0.8) for y in (0.2, 0.5, 0.8)]
    handles = "".join(
        f"[[handle]]\nat = [{x}, {y}]\nto = [{x + 0.02 * (-1) ** number}, {y}]\nradius = 0.1\nduration = 0.5\n"
        for number, (x, y) in enumerate(places)
    )
    recipe = FREE.replace("grid = 32", "grid = 64").replace("duration = 0.8", "duration = 1.6") + handles
    ends = np.array(places)
    _, alone, _ = arrived(device, Recipe.parse(recipe), ends)
    found = fit(device, None, 1, recipe)
    _, shown, folds = arrived(device, found.trial.recipe, ends)
    assert (found.is_met, folds) == (True, 0)
    assert np.abs(shown).mean() < 1.1 * np.abs(alone).mean()


def test_a_far_way_has_a_radius_as_large_as_it_needs(device: Device):
    """Half of the way and more, where that leaves nothing to search; of what is turned about a point too."""
    far = fit(device, np.array([[[0.0, 0.5], [1.0, 0.5]]]), 1, FREE.replace("grid = 32", "grid = 8")).trial.recipe
    assert far.handle[0].radius == pytest.approx(0.505)
    pairs = np.array([[[0.1, 0.1], [0.12, 0.1]], [[0.0, 0.8], [1.0, 0.8]]])
    near, far = fit(device, pairs, 1, FREE.replace("grid = 32", "grid = 8")).trial.recipe.handle
    assert near.radius < 0.4 < far.radius, "each has its own"
    turned = "[[handle]]\nat = [0.2, 0.5]\nto = [0.8, 0.5]\nrotate = 20.0\nradius = 0.1\n"
    ring = fit(device, None, 1, FREE.replace("grid = 32", "grid = 8") + turned).trial.recipe
    assert ring.handle[0].radius > 0.3


def test_a_muted_pin_stays_one(device: Device):
    parts = "[[handle]]\nat = [0.6, 0.5]\nto = [0.6, 0.44]\n[[pin]]\nat = [0.2, 0.2]\nstart = 0.4\nmuted = true\n"
    recipe = Recipe.parse(FREE.replace("grid = 32", "grid = 8") + parts)
    found = fit(device, None, 1, FREE.replace("grid = 32", "grid = 8") + parts).trial.recipe
    assert found.pin == recipe.pin
    assert len(found.handle) == 1


def test_what_is_led_after_strokes_is_fitted_after_them(device: Device):
    stroke = '[[stroke]]\ntool = "push"\nradius = 0.2\nsamples = [[0, 0.3, 0.5, 1.0], [5, 0.4, 0.5, 1.0]]\n'
    led = "[[handle]]\nat = [0.3, 0.4]\nstart = 0.4\nkeys = [[0.6, 0.4, 0.45]]\n"
    found = fit(device, None, 1, FREE + stroke + led)
    (handle,) = found.trial.recipe.handle
    assert handle.start == 0.4
    assert handle.last < 0.8
    assert found.errors.max() < 0.1


@pytest.mark.parametrize(
    "moving",
    [
        '[[stroke]]\ntool = "push"\nradius = 0.1\nsamples = [[0, 0.8, 0.7, 1.0], [7, 0.8, 0.72, 1.0]]\n',
        "[[change]]\ntick = 3\ndrag = 1.0\n",
        '[[force]]\nkind = "vortex"\npoint = [0.8, 0.7]\nradius = 0.1\nstrength = 0.1\n',
        "",
    ],
    ids=["stroke", "change", "force", "nothing"],
)
def test_where_something_else_moves_the_fluid_its_viscosity_stays(device: Device, moving: str):
    """To the last digit, also where there is none; of handles alone it is one of the things that are searched."""
    inviscid = FREE.replace("viscosity = 0.03", "viscosity = 0.0")
    found = fit(device, PAIRS[:1], 1, inviscid + moving).trial.recipe.fluid.viscosity
    assert (found == 0) == bool(moving)


def test_the_points_of_a_curve_arrive_and_are_told_by_its_name(device: Device):
    along = np.linspace(0, 1, 5)[:, None]
    line, wall = np.hstack([0.3 + 0 * along, 0.2 + 0.6 * along]), np.array([[[0.5, 0.5], [0.6, 0.5]]])
    bent = line + np.hstack([0.08 * np.sin(np.pi * along), 0 * along])
    pairs = Pairs(np.concatenate([np.stack([line, bent], axis=1), wall]), (*["stem"] * 5, ""))
    freeze = '[[freeze]]\nkind = "path"\npoints = [[0.3, 0.75], [0.3, 0.85]]\nradius = 0.02\nhardness = 1.0\n'
    found = fit(device, pairs, 4, FREE)
    assert found.errors.max() < 0.2
    assert found.pairs.curves == pairs.curves
    found = fit(device, pairs, 1, FREE + freeze)
    assert any('pair 5 of the curve "stem" cannot be met' in notice for notice in found.notices), found.notices


def test_many_pairs_arrive_with_values_in_common(device: Device):
    x, y = np.meshgrid(np.linspace(0.2, 0.8, 5), np.linspace(0.25, 0.75, 3))
    places = np.stack([x.ravel(), y.ravel()], axis=-1)
    moved = places + 0.03 * np.sin(2 * np.pi * places[:, ::-1])
    found = fit(device, np.stack([places, moved], axis=1), 6, FREE)
    assert found.errors.max() < 0.2
    assert len({(handle.radius, handle.duration) for handle in found.trial.recipe.handle}) == 1


def test_no_more_is_tried_than_was_asked_for(device: Device, monkeypatch: pytest.MonkeyPatch):
    """On the coarse grid: of its parts each takes its share of what the ones before have left."""
    tried: list[int] = []

    def counted(device: Device, recipe: Recipe, *given: Any, **named: Any) -> Replay:
        tried.append(recipe.fluid.grid)
        return Replay(device, recipe, *given, **named)

    monkeypatch.setattr(fitting, "Replay", counted)
    fit(device, PAIRS, 9, RECIPE.replace("grid = 32", "grid = 66").replace("duration = 0.4", "duration = 0.08"))
    assert 7 <= tried.count(fitting.COARSE_GRID) <= 9


def test_as_little_as_there_is_to_try_is_tried(device: Device, monkeypatch: pytest.MonkeyPatch):
    """All replays that there are, but for a single one, which leads a search nowhere."""
    many, tried = np.repeat(PAIRS, 7, axis=0) + np.linspace(0, 0.05, 14)[:, None, None], list[int]()

    def counted(device: Device, recipe: Recipe, *given: Any, **named: Any) -> Replay:
        tried.append(recipe.fluid.grid)
        return Replay(device, recipe, *given, **named)

    monkeypatch.setattr(fitting, "Replay", counted)
    found = []
    for evaluations in range(1, 5):
        tried.clear()
        fit(
            device,
            many,
            evaluations,
            FREE.replace("grid = 32", "grid = 66").replace("duration = 0.8", "duration = 0.08"),
        )
        found.append(tried.count(fitting.COARSE_GRID))
    assert found == [1, 1, 3, 4]


def test_the_work_is_the_strain_of_all_of_the_way(device: Device):
    """The integral over time of the root mean square of the velocity's gradient.

    What flows at the ends of ticks, which is looked at here, is nearly what carries the picture in them.
    """
    trial = fit(device, PAIRS, 1, FREE).trial
    replay, work, dt = Replay(device, trial.recipe, Pictures(PICTURE), budget=0), 0.0, trial.recipe.fluid.dt
    for _ in range(trial.recipe.ticks):
        replay.advance()
        velocity, (hx, hy) = replay.fluid.velocity_at_centres(), replay.fluid.grid.spacing
        along, down = np.gradient(velocity, hx, axis=1), np.gradient(velocity, hy, axis=0)
        work += float(np.sqrt((along**2 + down**2).sum() * hx * hy / EXTENT.prod())) * dt
    replay.release()
    assert trial.work == pytest.approx(work, rel=0.1)


def test_stopped_it_gives_the_best_so_far_checked_on_its_own_grid(device: Device):
    heard: list[int] = []
    own = RECIPE.replace("grid = 32", "grid = 66")  # finer than what most of it is tried on
    found = fit(device, PAIRS, 40, own, report=lambda done, total: heard.append(done), cancel=lambda: max(heard) >= 10)
    assert found.stopped
    assert max(heard) == 10  # two replays on a coarse grid, and one on its own, which counts as eight
    assert found.trial.recipe.fluid.grid == 66
    assert found.trial.recipe.fluid.dt == 0.04
    with pytest.raises(Cancelled):
        fit(device, PAIRS, cancel=lambda: True)


@pytest.mark.parametrize(
    ("replays", "said"), [(1, "cancelled; nothing half-written is left"), (6, "stopped; the best so far is written")]
)
def test_ctrl_c_ends_it_with_the_best_so_far(
    fluidwarp: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, replays: int, said: str
):
    """Where there is none, with nothing."""
    left = [replays]

    class Interrupted(Replay):
        def __init__(self, *given: Any, **named: Any) -> None:
            super().__init__(*given, **named)
            left[0] -= 1
            if left[0] == 0:
                signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(fitting, "Replay", Interrupted)
    write_picture(tmp_path / "a.png", PICTURE)
    (tmp_path / "r.toml").write_text('picture = "a.png"\n' + RECIPE)
    (tmp_path / "p.csv").write_text("10,10,12,12\n40,20,38,22\n")
    done = fluidwarp(tmp_path, "fit", "r.toml", "--pairs", "p.csv", "-o", "f.toml", "--time-limit", "100")
    assert done.returncode == INTERRUPTED
    assert done.stderr.splitlines()[-1] == f"fluidwarp: {said}"
    assert (tmp_path / "f.toml").exists() is (replays > 1)


def test_stopped_it_is_as_good_as_was_told_last(device: Device):
    """What is in each other's way halts elsewhere on the coarse grid than on the fine one."""
    crossing, made, said = np.array([[[0.4, 0.5], [0.6, 0.5]], [[0.6, 0.5], [0.4, 0.5]]]), list[int](), list[str]()
    found = fit(
        device,
        crossing,
        9,
        RECIPE.replace("grid = 32", "grid = 72"),
        report=lambda done, total: made.append(done),
        tell=said.append,
        cancel=lambda: made[-1] >= 10,
    )
    *_, last = (float(state.split()[3]) for state in said if state.startswith("best so far"))
    assert found.errors.mean() <= last + 0.005
    assert found.stopped
    assert not found.is_met


def test_how_far_the_look_at_where_handles_were_set_has_come_is_told(device: Device):
    handle = "[[handle]]\nat = [0.3, 0.4]\nto = [0.34, 0.42]\nstart = 0.4\nduration = 0.3\n"
    late, said = RECIPE.replace("0.4", "0.8", 1) + handle, list[str]()
    fit(device, None, 1, late, tell=said.append)
    looks = [int(state.split()[-2]) for state in said if state.startswith("looking where the handles were set, ")]
    assert looks == [100 * tick // 11 for tick in range(11)]  # the handle begins at tick 10


def test_the_command_line_writes_a_recipe_and_where_the_points_arrive(fluidwarp: Run, tmp_path: Path):
    write_picture(tmp_path / "a.png", PICTURE)
    (tmp_path / "r.toml").write_text('picture = "a.png"\n' + RECIPE)
    write_pairs(tmp_path / "p.csv", Pairs.points(PAIRS), (64, 48))
    (tmp_path / "out").mkdir()
    words = ["fit", "r.toml", "--pairs", "p.csv", "-o", "out/f.toml", "--arrived", "out/a.tps", "--evaluations", "3"]
    done = fluidwarp(tmp_path, *words)
    assert done.returncode == 0, done.stderr
    assert "f.toml: 2 pairs, mean error" in done.stderr
    recipe = read_recipe(tmp_path / "out" / "f.toml")
    assert recipe.picture == "../a.png"
    there = read_pairs([tmp_path / "out" / "a.tps"], (64, 48))
    np.testing.assert_allclose(there.places, PAIRS, atol=0.1 / 64)
    assert fluidwarp(tmp_path, "render", "out/f.toml", "-o", "out/f.png").returncode == 0


def test_a_recipe_that_names_other_pictures_is_fitted_beside_them_alone(fluidwarp: Run, tmp_path: Path):
    """Or where their names say all of where they are."""
    for name in ("a.png", "mask.png"):
        write_picture(tmp_path / name, PICTURE)
    (tmp_path / "p.csv").write_text("10,10,12,12\n")
    (tmp_path / "out").mkdir()
    for name, named, refused in (
        ("out/f.toml", "mask.png", "out/f.toml: write it beside r.toml, which names mask.png from there"),
        ("out/f.toml", tmp_path / "mask.png", None),
        ("f.toml", "mask.png", None),
    ):
        layer = f"[[viscosity]]\nkind = 'picture'\npicture = '{named}'\nrange = [0.01, 0.1]\n"
        (tmp_path / "r.toml").write_text('picture = "a.png"\n' + RECIPE + layer)
        done = fluidwarp(tmp_path, "fit", "r.toml", "--pairs", "p.csv", "-o", name, "--evaluations", "1")
        assert (done.returncode, (tmp_path / name).exists()) == ((0, True) if refused is None else (1, False))
        assert refused is None or done.stderr == f"fluidwarp: {refused}\n"


def test_what_is_fitted_from_is_not_written_over(tmp_path: Path):
    given = {name: tmp_path / f"{name}.csv" for name in ("pairs", "first", "second", "image", "recipe")}
    job = FitJob(
        recipe=str(given["recipe"]), pairs=(given["pairs"],), masks=(given["first"], given["second"]),
        output=tmp_path / "out.toml", arrived=None, image=given["image"], evaluations=1, local=None, max_pixels=100,
    )  # fmt: skip
    job.check()
    for path in (given["pairs"], given["first"], given["second"], given["image"]):
        with pytest.raises(UserError, match=f"{path} would be replaced by its own result"):
            replace(job, arrived=path).check()


def test_of_two_trials_the_one_that_does_not_fold_then_the_nearer_then_the_evener_then_the_shorter_is_better():
    """Each where all before it are alike, and whatever those after it are. How near to a fold it is counts less than
    how near the points are, unless there is one."""
    none = np.zeros(0)

    def rank(folds: int, det: float, off: float, work: float) -> tuple[float, ...]:
        return Trial(Recipe(), none, none, np.array([off]), work, det, folds).rank

    better = [
        rank(0, 0.5, 0.0, 1.0), rank(0, 0.9, 0.0, 2.0), rank(0, 0.15, 0.0, 1.0), rank(0, 0.1, 0.0, 0.5),
        rank(0, 0.05, 0.02, 1.0), rank(0, 0.5, 0.03, 0.5), rank(1, -0.1, 0.0, 0.5), rank(9, -0.3, 0.0, 0.1),
    ]  # fmt: skip
    assert better == sorted(better)
    assert len(set(better)) == len(better)


def test_a_fit_is_told_in_a_line():
    nothing, pairs = np.zeros(0), Pairs.points(PAIRS)
    trial = Trial(Recipe(), pairs.places, nothing, nothing, work=1.25, det=0.5, folds=3)
    told = Fitted(trial, pairs, np.array([0.25, 0.75, np.nan]), False, False, ()).told
    assert told == "2 pairs, mean error 0.5 pixels, most 0.75; 3 places fold"
    one = replace(trial, folds=1)
    told = Fitted(one, pairs, np.array([0.5, np.nan]), False, False, (), "handle").told
    assert told == "1 handle, mean error 0.5 pixels, most 0.5; 1 place folds"
    flat = replace(trial, folds=0, det=0.8)
    told = Fitted(flat, pairs, np.array([0.5, np.nan]), False, True, ()).told
    assert told.endswith("most 0.5; nothing folds, and the picture grows to 1.25 times its area at most")


def test_outlines_of_masks_are_fitted_and_written_as_a_curve(fluidwarp: Run, tmp_path: Path):
    x, y = np.meshgrid(np.arange(64) + 0.5, np.arange(48) + 0.5)
    for name, inside in (
        ("disc", (x - 32) ** 2 + (y - 24) ** 2 < 121),
        ("oval", ((x - 32) / 13) ** 2 + ((y - 24) / 9) ** 2 < 1),
    ):
        write_picture(tmp_path / f"{name}.png", Picture(np.asarray(255 * inside, np.uint8)[..., None]))
    write_picture(tmp_path / "a.png", PICTURE)
    (tmp_path / "r.toml").write_text('picture = "a.png"\n' + FREE)
    words = [
        "fit",
        "r.toml",
        "--masks",
        "disc.png",
        "oval.png",
        "-o",
        "f.toml",
        "--arrived",
        "a.csv",
        "--evaluations",
        "6",
    ]
    done = fluidwarp(tmp_path, *words)
    assert done.returncode == 0, done.stderr
    assert "f.toml: 14 pairs, mean error" in done.stderr
    there = read_pairs([tmp_path / "a.csv"], (64, 48))
    assert set(there.curves) == {"outline"}
    assert there.closed == {"outline"}
    end = there.places[:, 1] * (64, 48)
    np.testing.assert_allclose(((end[:, 0] - 32) / 13) ** 2 + ((end[:, 1] - 24) / 9) ** 2, 1, atol=0.1)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--pairs", "p.csv", "-o", "f.png"], "f.png: a fitted recipe is a file that ends with .toml"),
        (["--pairs", "p.csv", "-o", "p.csv"], "ends with .toml"),
        (["--pairs", "none.csv", "-o", "f.toml"], "there is no such file"),
        (["-o", "f.toml"], "no handle of the recipe leads anywhere; give --pairs"),
        (["--masks", "a.png", "a.png", "-o", "f.toml"], "a.png has no outline: nothing of it is brighter than grey"),
        (["--pairs", "bad.csv", "-o", "f.toml"], "bad.csv, line 2: expected x0,y0,x1,y1"),
        (["--pairs", "p.csv", "-o", "f.toml", "--arrived", "f.txt"], "end with .csv, .pts, .tps"),
        (
            ["--pairs", "p.csv", "-o", "f.toml", "--time-limit", "0"],
            "--time-limit 0 has passed before anything was found",
        ),
    ],
)
def test_what_cannot_be_fitted_ends_in_a_sentence(fluidwarp: Run, tmp_path: Path, words: list[str], said: str):
    write_picture(tmp_path / "a.png", PICTURE)
    (tmp_path / "r.toml").write_text('picture = "a.png"\n' + RECIPE)
    (tmp_path / "p.csv").write_text("10,10,12,12\n")
    (tmp_path / "bad.csv").write_text("10,10,12,12\n10,10,12\n")
    done = fluidwarp(tmp_path, "fit", "r.toml", *words)
    assert done.returncode != 0
    assert said in done.stderr
    assert not (tmp_path / "f.toml").exists()


def test_missed_pairs_and_handles_that_stay_away_are_told_with_status_0(fluidwarp: Run, tmp_path: Path):
    """Of a fit and of a render alike: the result is written, and may be what is wanted."""
    write_picture(tmp_path / "a.png", PICTURE)
    (tmp_path / "r.toml").write_text('picture = "a.png"\n' + RECIPE)
    (tmp_path / "p.csv").write_text("20,20,30,20\n20.5,20,10,20\n")
    fit = fluidwarp(tmp_path, "fit", "r.toml", "--pairs", "p.csv", "-o", "f.toml", "--evaluations", "1")
    render = fluidwarp(tmp_path, "render", "f.toml", "-o", "f.png")
    for done, said in ((fit, "pixels from where they should be"), (render, "from where it should be: ")):
        assert done.returncode == 0
        assert said in done.stderr

"""Handles arrive and stay, pins hold, nothing folds, and every way through time gives the same bytes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from app.errors import UserError
from app.media.auxiliary import Pictures
from app.model.handles import ARRIVED, objections
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.model.schema import frozen
from app.work.replay import Replay
from solver import Device, Fluid, Grid, Handle, Handles, WarpMap
from support.leading import PIXELS, RADIUS, arrangement, distortion, led, spline

BLACK = np.zeros((96, 128, 3), np.uint8)
EXTENT = (1.0, 0.75)
DT = 1 / 30  # of the editor: each step is twice as far as one of a recipe


def replay_of(device: Device, **parts: Any) -> Replay:
    parts = {"duration": 0.8, "fluid": {"grid": 64, "viscosity": 0.03, "drag": 2.0}} | parts
    return Replay(device, Recipe.model_validate(frozen(parts)), Pictures(Picture(BLACK)))


def led_to(at: list[float], to: list[float], **rest: Any) -> dict[str, Any]:
    return {"at": at, "to": to, "duration": 0.4, **rest}


@pytest.mark.parametrize(("count", "seed"), [(1, 0), (4, 1), (16, 2), (16, 3)])
def test_handles_arrive_and_stay_where_the_spline_may_fold(count: int, seed: int, device: Device):
    found = led(device, *arrangement(seed, count), seed=seed, dt=DT)
    assert found.is_within, found.told


def test_a_handle_between_pins_does_not_fold_where_the_spline_does(device: Device):
    points, targets = np.array([[0.42, 0.5]]), np.array([[0.42 + 80 / PIXELS, 0.5]])
    pins = np.array([[0.5, 0.4], [0.5, 0.6], [0.68, 0.5], [0.32, 0.5]])
    found = led(device, points, targets, pins, dt=DT)
    assert distortion(spline(points, targets, pins)).least < 0
    assert found.is_within, found.told
    assert distortion(found.displacement).least > 0


@pytest.mark.long
@pytest.mark.parametrize(
    ("points", "targets", "pins"),
    [
        ([[0.4, 0.5], [0.6, 0.5]], [[0.6, 0.5], [0.4, 0.5]], []),
        ([[0.5, 0.5], [0.5, 0.5]], [[0.6, 0.5], [0.4, 0.5]], []),
        ([[0.3, 0.5]], [[0.7, 0.5]], [[0.5, 0.5]]),
    ],
    ids=["crossing", "coincident", "through a pin"],
)
def test_what_contradicts_itself_folds_nothing(points: Any, targets: Any, pins: Any, device: Device):
    for seed in (1, 2):
        found = led(device, np.array(points), np.array(targets), np.reshape(pins, (-1, 2)), seed=seed)
        assert found.folds == 0
        assert found.det > 0
        assert np.isfinite(found.displacement).all()
        assert found.pins < 0.5


def test_what_is_local_moves_nothing_beside_it(device: Device):
    grid = Grid(64, 64)
    fluid, warp = Fluid(device, grid), WarpMap(device, grid)
    fluid.set_viscosity(0.03)
    handles = Handles(fluid, warp, [Handle((0.4, 0.5), (0.5, 0.5), RADIUS, duration=0.4, local=1.0)])
    for _ in range(60):
        handles.advance(1 / 60)
    assert handles.away[0] * PIXELS < 0.5
    assert np.abs(warp.at(np.array([[0.45, 0.75], [0.45, 0.25], [0.8, 0.5]]))).max() * PIXELS < 0.5
    for thing in (handles, warp, fluid):
        thing.release()


def test_the_stiffer_of_two_handles_prevails(device: Device):
    grid = Grid(32, 32)
    fluid, warp = Fluid(device, grid), WarpMap(device, grid)
    fluid.set_viscosity(0.03)
    ways = ((0.4, 1.0), (0.6, 0.1))
    handles = Handles(
        fluid, warp, [Handle((0.5, 0.5), (x, 0.5), RADIUS, duration=0.2, stiffness=stiffness) for x, stiffness in ways]
    )
    for _ in range(15):
        handles.advance(1 / 60)
    stiff, soft = handles.away
    assert stiff < 0.5 * soft
    for thing in (handles, warp, fluid):
        thing.release()


@pytest.mark.parametrize(("time", "part"), [(0.9, 0), (1.0, 0), (1.1, 0.15625), (1.2, 0.5), (1.4, 1), (2.0, 1)])
def test_a_handle_begins_and_ends_its_way_at_rest(time: float, part: float):
    """By a smoothstep."""
    handle = Handle((0.4, 0.5), (0.5, 0.5), RADIUS, start=1.0, duration=0.4)
    assert handle.passed(time) == pytest.approx(part, abs=1e-9)


def test_a_handle_takes_hold_of_what_has_been_moved_to_elsewhere(device: Device):
    later = led_to([0.4, 0.5], [0.5, 0.6], start=0.5, duration=0.2)
    replay = replay_of(device, handle=[led_to([0.3, 0.4], [0.4, 0.5], end=0.45), later | {"at": [0.3, 0.4]}])
    replay.seek(20)
    assert np.allclose(replay.handles.places[0], replay.handles.places[1], atol=1e-5)
    replay.seek(48)
    assert replay.handles.away[1] < ARRIVED
    replay.release()


def test_no_fold_waits_for_a_remap_of_what_has_long_halted(device: Device):
    # All ten halt at a third of a second, det J .68 at the least; taken into texels half a second later it was -.7.
    points = np.random.default_rng(4).uniform(0.1, 0.9, (2, 10, 2)).tolist()
    grid = Grid(48, 48)
    fluid, warp = Fluid(device, grid), WarpMap(device, grid, (192, 192))
    fluid.set_viscosity(0.3)
    handles = Handles(
        fluid, warp, [Handle((p[0], p[1]), (q[0], q[1]), RADIUS, duration=0.8) for p, q in zip(*points, strict=True)]
    )
    for _ in range(18):
        handles.advance(1 / 30)
    warp.remap()
    assert warp.statistics((256, 256)).folds == 0
    for thing in (handles, warp, fluid):
        thing.release()


HANDLES = [led_to([0.3, 0.4], [0.4, 0.5]), led_to([0.7, 0.6], [0.6, 0.7], start=0.2, local=0.5, stiffness=0.8)]
PINS = [{"at": [0.5, 0.2]}]


def test_every_way_to_a_tick_gives_the_same_bytes(device: Device):
    stroke = {"tool": "push", "samples": [[5, 0.5, 0.8, 1.0], [15, 0.6, 0.8, 1.0]]}
    replay = replay_of(device, handle=HANDLES, pin=PINS, stroke=[stroke])
    replay.seek(30)
    wanted, snapshot = replay.warp.read(), None
    for tick in (7, 33, 19, 30):
        replay.seek(tick)
        _ = replay.handles.away
        if tick == 19:
            snapshot = replay.snapshot()
    assert np.array_equal(replay.warp.read(), wanted)
    other = replay_of(device, handle=HANDLES, pin=PINS, stroke=[stroke])
    assert snapshot is not None
    other.resume(19, snapshot)
    other.seek(30)
    assert np.array_equal(other.warp.read(), wanted)
    for each in (replay, other):
        each.release()


def test_a_handle_that_is_added_later_gives_the_same_as_one_that_was_there(device: Device):
    replay = replay_of(device, handle=HANDLES[:1], pin=PINS)
    replay.seek(40)
    both = replay.recipe.edited(handle=Recipe.model_validate(frozen({"handle": HANDLES})).handle)
    assert replay.recipe.agrees_until(both) == 12
    replay.use(both)
    straight = replay_of(device, handle=HANDLES, pin=PINS)
    straight.seek(40)
    assert np.array_equal(replay.warp.read(), straight.warp.read())
    for each in (replay, straight):
        each.release()


def test_a_handle_that_comes_into_the_picture_gives_the_same_as_one_that_was_there(device: Device):
    """Those behind it get another number."""
    outside, inside = ([led_to(at, [0.4, 0.4], start=0.3), HANDLES[0]] for at in ([1.2, 0.3], [0.2, 0.3]))
    replay, straight = replay_of(device, handle=outside), replay_of(device, handle=inside)
    replay.seek(30)
    replay.use(straight.recipe)
    straight.seek(30)
    assert np.array_equal(replay.warp.read(), straight.warp.read())
    for each in (replay, straight):
        each.release()


def test_a_local_handle_moves_nothing_before_it_begins_once_the_playhead_has_gone_back(device: Device):
    replay = replay_of(device, handle=[led_to([0.7, 0.6], [0.6, 0.7], start=0.2, local=1.0)])
    replay.seek(20)
    replay.seek(7)
    assert not replay.warp.read().any()
    replay.release()


@pytest.mark.parametrize("dt", [1 / 60, 0.02, 0.1, 1e-308])
def test_a_handle_begins_in_the_tick_that_it_says(dt: float):
    """In the middle of a tick, too, however that is rounded."""
    for start in {round((tick + 0.5) * dt, digits) for tick in range(300) for digits in (3, 5, 16)} | {1e6}:
        handle = Recipe.model_validate(frozen({"handle": [led_to([0.5, 0.5], [0.6, 0.5], start=start)]})).handle[0]
        tick = handle.first_tick(dt)
        assert start <= tick * dt + dt / 2 or tick > 2**39
        assert tick == 0 or start > (tick - 1) * dt + dt / 2


def test_a_handle_goes_its_way_at_once_from_within_a_tick(device: Device):
    replay = replay_of(device, handle=[led_to([0.5, 0.5], [0.51, 0.5]) | {"start": 0.005, "duration": 0.0}])
    replay.seek(30)
    assert replay.handles.away.max() < ARRIVED
    replay.release()


def test_what_is_not_reached_is_told_by_number(device: Device):
    frozen_disc = {"kind": "path", "points": [[0.15, 0.17]], "radius": 0.1, "hardness": 1.0}
    handles = [led_to([0.6, 0.6], [0.7, 0.6]), led_to([0.15, 0.17], [0.4, 0.5], name="held")]
    replay = replay_of(device, handle=handles, freeze=[frozen_disc])
    replay.seek(48)
    (said,) = replay.unmet(ARRIVED)
    assert said.startswith('handle[2] "held" is 0.')
    assert said.endswith("away from where it is led: what it holds is frozen")
    assert replay.warp.statistics().folds == 0
    replay.release()


def test_what_cannot_be_met_is_objected_to():
    handles = [
        led_to([1.2, 0.5], [0.5, 0.5]),
        led_to([0.2, 0.2], [0.2, -0.5]),
        led_to([0.4, 0.5], [0.6, 0.5]),
        led_to([0.6, 0.5], [0.4, 0.5]),
        led_to([0.8, 0.8], [0.9, 0.8]),
        led_to([0.8, 0.801], [0.7, 0.8]),
        led_to([0.1, 0.8], [0.1, 0.75]) | {"radius": 0.05},
        led_to([0.12, 0.8], [0.2, 0.82]) | {"radius": 0.05},
    ]
    recipe = Recipe.model_validate(frozen({"handle": handles}))
    assert list(objections(recipe.handle, recipe.pin, EXTENT)) == [
        "handle[1] takes hold of nothing: (1.2, 0.5) is outside the picture",
        "handle[2] goes only to the picture's edge: (0.2, -0.5) is outside the picture",
        "handle[3] and handle[4] cross each other's way",
        "handle[5] and handle[6] hold the same place and are led apart",
        "handle[7] and handle[8] are led 5.65 times as far apart as they lie",
    ]


def test_an_arrangement_without_contradiction_is_not_objected_to():
    for seed in range(5):
        points, targets, pins = (array.tolist() for array in arrangement(seed, 16))
        handles = [led_to(at, to, radius=RADIUS) for at, to in zip(points, targets, strict=True)]
        recipe = Recipe.model_validate(frozen({"handle": handles, "pin": [{"at": at} for at in pins]}))
        assert list(objections(recipe.handle, recipe.pin, (1.0, 1.0))) == []


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[[handle]]\nat = [0.5, 0.5]", "handle[1]: 'to' is missing"),
        ("[[pin]]\nat = [0.5, 0.5]\nto = [0.5, 0.5]", "pin[1]: unknown key 'to'"),
        ("[[pin]]\nat = [0.5, 0.5]\nradius = 0.0", "pin[1]: 'radius' must be at least 0.001, not 0.0"),
        ("[[pin]]\nat = [0.5, 0.5]\nstart = 2.0\nend = 1.0", "pin[1]: 'end' (1) is before 'start' (2)"),
        ("[stop]\nhandles_within = 0.001", "'stop.handles_within' waits for handles, and there is no [[handle]]"),
        ("[[pin]]\nat = [0.5, 0.5]\n" * 65, "there are 65 handles and pins; at most 64 work"),
    ],
)
def test_a_wrong_handle_is_told_in_one_sentence(text: str, said: str):
    with pytest.raises(UserError) as error:
        Recipe.parse(text)
    assert said in str(error.value)


def test_a_handle_of_no_number_is_refused():
    wrong = {"at": (np.nan, 0.5)}, {"radius": 0.0}, {"start": np.inf}, {"stiffness": 0.0}, {"local": 2.0}
    for each in wrong:
        parts: dict[str, Any] = {"at": (0.5, 0.5)} | each
        with pytest.raises(ValueError, match="handle"):
            Handle(**parts)

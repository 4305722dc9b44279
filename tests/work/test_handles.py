"""Handles arrive and stay, pins hold, nothing folds, and every way through time gives the same bytes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from app.errors import UserError
from app.media.auxiliary import Pictures
from app.model.handles import ARRIVED, MOST_OBJECTIONS, RecipeHandle, in_pixels, objections
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.model.schema import frozen
from app.work.handle_status import as_seen, held_in, unmet
from app.work.loaded_handles import LoadedHandles
from app.work.replay import Replay
from solver import Device, Fluid, FluidParams, Grid, Handle, Handles, WarpMap
from solver.brush.expected import Expected
from solver.brush.handle import Shape, area, swelling
from solver.limits import MOST_STRETCH, beside_edges
from solver.warp.strain import Strain
from support.leading import PIXELS, RADIUS, arrangement, distortion, led, spline

BLACK = np.zeros((96, 128, 3), np.uint8)
EXTENT = (1.0, 0.75)
DT = 1 / 30  # of the editor: each step is twice as far as one of a recipe


def replay_of(device: Device, picture: np.ndarray = BLACK, **parts: Any) -> Replay:
    parts = {"duration": 0.8, "fluid": {"grid": 64, "viscosity": 0.03, "drag": 2.0}} | parts
    return Replay(device, Recipe.model_validate(frozen(parts)), Pictures(Picture(picture)))


def led_to(at: list[float], to: list[float], **rest: Any) -> dict[str, Any]:
    return {"at": at, "to": to, "duration": 0.4, **rest}


@pytest.mark.parametrize(("count", "seed"), [(1, 0), (4, 1), (16, 2)])  # bench_handles.py draws more
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
    coarse: dict[str, Any] = {} if pins else {"cells": 64}  # where a pin does not hold as well
    for seed in (1, 2):
        found = led(device, np.array(points), np.array(targets), np.reshape(pins, (-1, 2)), seed=seed, dt=DT, **coarse)
        assert found.folds == 0
        assert found.det > 0
        assert np.isfinite(found.displacement).all()
        assert found.pins < 0.5


def led_alone(device: Device, *handles: Handle, ticks: int = 50, cells: int = 64) -> tuple[Handles, WarpMap]:
    """Handles, and the map, after some ticks of Putty; both are left to the device."""
    grid = Grid(cells, cells)
    fluid, warp = Fluid(device, grid), WarpMap(device, grid, (256, 256))
    fluid.set_viscosity(0.3)
    leading = Handles(fluid, warp, handles)
    for _ in range(ticks):
        leading.advance(DT)
    return leading, warp


def jacobian(warp: WarpMap, place: Any) -> np.ndarray:
    """Of the forward map where it leads to a place: what has become of the original there."""
    steps = 0.01 * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
    moved = warp.at(np.array(place) + steps).astype(float) + steps
    return np.linalg.inv(np.stack([moved[0] - moved[1], moved[2] - moved[3]], axis=-1) / 0.02)


@pytest.mark.parametrize(
    ("rotate", "scale", "local"),
    [(40.0, None, 0.0), (None, 1.5, 0.0), (-30.0, 0.7, 0.0), (0.0, None, 0.0), (40.0, 1.3, 1.0)],
)
def test_a_point_is_turned_and_scaled(rotate: float | None, scale: float | None, local: float, device: Device):
    """Beside one that goes by, which would turn it by the way."""
    led, warp = led_alone(
        device,
        Handle((0.4, 0.5), (0.45, 0.45), rotate=rotate, scale=scale, duration=0.5, local=local),
        Handle((0.7, 0.7), (0.75, 0.6), duration=0.5),
    )
    assert led.away.max() * PIXELS < 0.5
    found = jacobian(warp, led.places[0])
    turned = np.degrees(np.arctan2(found[1, 0] - found[0, 1], found[0, 0] + found[1, 1]))
    assert turned == pytest.approx(rotate or 0.0, abs=5)
    assert np.linalg.det(found) ** 0.5 == pytest.approx(scale or 1.0, rel=0.06)
    assert warp.statistics().folds == 0


def test_a_map_that_nobody_moved_bears_a_handle_at_its_edges(device: Device):
    """Whatever its texels: no look leaves the picture."""
    led, _ = led_alone(device, *(Handle((x, y), radius=0.05) for x in (0.01, 0.99) for y in (0.01, 0.99)), ticks=1)
    assert (led.slower(np.arange(4)) == 1).all()


def test_nothing_is_led_before_it_begins(device: Device):
    led, warp = led_alone(device, Handle((0.5, 0.5), (0.6, 0.5), start=1.0), ticks=2, cells=16)
    assert not warp.read().any()
    assert led.away[0] == pytest.approx(0.1)


def test_a_line_is_moved_as_one_and_turned(device: Device):
    line = ((0.35, 0.5), (0.55, 0.5))
    led, warp = led_alone(device, Handle((0.45, 0.5), (0.5, 0.45), rotate=30.0, duration=0.5, points=line))
    assert led.away[0] * PIXELS < 0.5
    along, angle = np.linspace(-0.1, 0.1, 21), np.radians(30)
    there = np.array([0.5, 0.45]) + along[:, None] * [np.cos(angle), np.sin(angle)]
    found = there + warp.at(there)  # all along the line
    assert np.abs(found - np.stack([0.45 + along, np.full(21, 0.5)], axis=-1)).max() * PIXELS < 1.5
    assert warp.statistics().folds == 0


def test_a_line_that_is_turned_about_its_end_is_where_that_is(device: Device):
    """It was told to be as far beside its middle as at first, whichever way it had been turned."""
    line = ((0.4, 0.5), (0.6, 0.5))
    led, _ = led_alone(device, Handle(line[0], rotate=60.0, duration=0.5, points=line), ticks=40, cells=48)
    assert led.away[0] < ARRIVED
    assert led.places[0] == pytest.approx(line[0], abs=ARRIVED)


def test_an_outline_goes_into_another_form_and_size(device: Device):
    square = ((0.4, 0.4), (0.6, 0.4), (0.6, 0.6), (0.4, 0.6))
    goals = ((0.4, 0.4), (0.7, 0.38), (0.68, 0.62), (0.4, 0.66))
    led, warp = led_alone(device, Handle((0.5, 0.5), points=square, goals=goals, closed=True, duration=0.8), ticks=60)
    assert led.away[0] * PIXELS < 0.5
    middles = np.array([np.add(a, b) / 2 for a, b in zip(goals, (*goals[1:], goals[0]), strict=True)])
    wanted = np.array([np.add(a, b) / 2 for a, b in zip(square, (*square[1:], square[0]), strict=True)])
    assert np.abs(middles + warp.at(middles) - wanted).max() * PIXELS < 2
    assert warp.statistics().folds == 0


def test_a_line_turns_on_its_way_to_its_goals_and_keeps_its_length():
    points, goals = ((0.4, 0.5), (0.6, 0.5)), ((0.6, 0.5), (0.4, 0.5))
    handle = Handle((0.5, 0.5), points=points, goals=goals, rotate=180.0, turned=((2.0, 270.0, 2.0),))
    shape = Shape.of(handle, (1.0, 1.0))
    half, there, after = (shape.wanted(shape.led, time, 0.1) for time in (0.5, 1.0, 2.0))
    np.testing.assert_allclose(half[[0, -1]], [[0.5, 0.4], [0.5, 0.6]], atol=1e-12)
    np.testing.assert_allclose(there[[0, -1]], goals, atol=1e-12)
    np.testing.assert_allclose(after[[0, -1]], [[0.5, 0.7], [0.5, 0.3]], atol=1e-12)


@pytest.mark.parametrize("cells", [64, 96])
def test_what_of_a_line_is_outside_is_not_led(cells: int, device: Device):
    line = Handle((0.1, 0.5), (0.15, 0.55), duration=0.5, points=((-0.2, 0.5), (0.3, 0.5)))
    led, _ = led_alone(device, line, ticks=30, cells=cells)
    (shape,) = led.shapes
    assert shape.min() > 0.02
    assert led.away[0] * PIXELS < 0.5


def test_a_line_is_led_as_far_from_an_edge_as_the_map_bears(device: Device):
    """What is at the edge stays there, and what is near it goes a part of the way."""
    line = Shape.of(Handle((0.05, 0.5), (0.25, 0.5), points=((-0.1, 0.5), (0.2, 0.5))), (1.0, 1.0))
    starts = np.array([[0.0, 0.5], [0.01, 0.5], [0.1, 0.5], [0.2, 0.5]])
    moved = beside_edges(starts, (1.0, 1.0))
    assert moved[0].T[0] == pytest.approx([0, 0.0025, 0.025, 0.05])
    assert moved[1].T[0] == pytest.approx([0, 0.04, 0.4, 0.8])
    assert line.wanted(line.led, 10.0, DT).T[0].min() == pytest.approx(MOST_STRETCH * line.led.T[0].min())


def test_half_a_loop_is_drawn_off_the_edge_without_tearing_it(device: Device):
    """Nor does a source swell what the edge has closed."""
    angles = np.arange(24) * np.pi / 12
    loop = tuple((1 + 0.15 * np.cos(a), 0.5 + 0.15 * np.sin(a)) for a in angles)
    led, warp = led_alone(
        device, Handle((1.0, 0.5), (0.85, 0.6), 0.15, duration=0.4, closed=True, points=loop), ticks=12, cells=32
    )
    found = warp.statistics()
    assert found.folds == 0
    assert found.det_min > 0.88
    (shape,) = led.shapes
    assert shape.T[0].min() < 0.84, "its inner end, which was at .85, is on its way"


def test_what_comes_no_nearer_lets_go(device: Device):
    """Of two that lie beside one another and are led across; and the fluid comes to rest."""
    ways = [Handle((0.5, y), (x, 0.5), RADIUS, duration=0.1) for x, y in ((0.4, 0.5), (0.6, 0.53))]
    grid = Grid(32, 32)
    fluid, warp = Fluid(device, grid), WarpMap(device, grid, (64, 64))
    fluid.set_viscosity(0.3)
    handles = Handles(fluid, warp, ways)
    for _ in range(40):
        handles.advance(DT)
    assert fluid.motion().largest_speed < 1e-4
    assert set(handles.halts) <= {"strain", "at odds"}


@pytest.mark.parametrize(
    "rest", [{}, {"rotate": 90.0}, {"points": ((-0.5, -0.5), (-0.4, 1.1))}], ids=["point", "ring", "line"]
)
def test_what_lies_outside_the_picture_is_not_led(rest: dict[str, Any], device: Device):
    """Found by inverting the map beyond its edges, such a handle folded 6,340 places."""
    grid = Grid(16, 16)
    fluid, warp = Fluid(device, grid), WarpMap(device, grid, (64, 64))
    fluid.set_viscosity(0.03)
    handles = Handles(fluid, warp, [Handle((-0.02, 0.5), (0.5, 0.5), RADIUS, duration=0.1, **rest)])
    for _ in range(10):
        handles.advance(DT)
    assert not warp.read().any()
    assert handles.halts == ["outside"]
    assert handles.away[0] > 0.4


@pytest.mark.parametrize(
    "eight", [((0.3, 0.3), (0.7, 0.7), (0.7, 0.3), (0.3, 0.7)), ((0.3, 0.3), (0.7, 0.7), (0.7, 0.4), (0.3, 0.6))]
)
def test_a_closed_line_that_crosses_itself_arrives(eight: tuple[tuple[float, float], ...], device: Device):
    """The areas of its loops cancel: taken for an area that should grow, what is left of them folded 257 places."""
    grid = Grid(32, 32)
    fluid, warp = Fluid(device, grid, FluidParams(drag=2.0)), WarpMap(device, grid, (128, 128))
    fluid.set_viscosity(0.03)
    handles = Handles(fluid, warp, [Handle((0.5, 0.5), (0.6, 0.5), points=eight, closed=True)])
    for _ in range(60):
        handles.advance(DT)
    assert handles.away[0] < ARRIVED
    assert warp.statistics().det_min > 0.9


@pytest.mark.parametrize(("angle", "long"), [(0.0, 0.2), (0.5, 0.3)])
def test_a_thin_closed_line_is_led_across_itself(angle: float, long: float, device: Device):
    """Its area tells nothing of its length: that these drew together held them 2 and 7 pixels short."""
    grid, turn = Grid(64, 64), np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    fluid, warp = Fluid(device, grid), WarpMap(device, grid, (256, 256))
    fluid.set_viscosity(0.0065)
    corners = 0.45 + 0.5 * np.array([(-long, -0.03), (long, -0.03), (long, 0.03), (-long, 0.03)]) @ turn
    to = 0.45 + np.array([0.0, 0.1]) @ turn
    led = Handles(fluid, warp, [Handle((0.45, 0.45), to, 0.1, points=corners, closed=True)])  # pyright: ignore[reportArgumentType]
    for _ in range(60):
        led.advance(DT)
    assert led.away[0] * 256 < 0.5
    assert warp.statistics().folds == 0


def test_a_closed_line_without_an_area_is_led_as_one_that_is_open(device: Device):
    """What rounding makes of its area says nothing of how it grows, and would hold it 9 pixels of 256 short."""
    corners = ((0.3, 0.45), (0.45, 0.45), (0.6, 0.45))
    led, warp = led_alone(device, Handle((0.45, 0.45), (0.5, 0.52), 0.2, duration=0.5, points=corners, closed=True))
    assert led.away[0] * PIXELS < 0.5
    assert warp.statistics().folds == 0


def test_how_fast_a_closed_line_swells():
    loop = np.random.default_rng(0).uniform(size=(7, 2)) + np.array(
        [[0, 0], [1, 0], [2, 0], [2, 2], [1, 2], [0, 2], [0, 1]]
    )
    x, y = loop.T
    for motion, rate in ((2 * x, 0 * y), 2), ((x, -y), 0), ((-y, x), 0), ((x, y), 2), ((1 + 0 * x, 3 + 0 * y), 0):
        assert swelling(loop, np.stack(motion, axis=-1)) == pytest.approx(rate, abs=1e-12)
    grown = loop + 1e-6 * loop**2
    assert swelling(loop, loop**2) == pytest.approx((area(grown) / area(loop) - 1) / 1e-6, rel=1e-4)


def test_why_a_line_stays_short_beside_the_edge_is_told(device: Device):
    line = {"points": [[0.05, 0.3], [0.05, 0.7]], "to": [0.22, 0.5], "duration": 0.1}
    replay = replay_of(device, handle=[line], fluid={"grid": 16}, duration=0.1)
    replay.seek(4)
    ((_, said, _),) = unmet(replay, ARRIVED)
    assert said.endswith("from where it should be: what is at the picture's edge stays there")
    replay.release()


def test_that_the_map_bears_no_more_is_told_and_what_may_mend_it(device: Device):
    replay = replay_of(device, handle=[led_to([0.4, 0.5], [0.6, 0.5])], fluid={"grid": 48}, duration=0.1)
    folded = np.zeros((96, 128, 2), np.float32)
    folded[:, 66, 0] = 1.5 / 128
    replay.warp.set(folded)
    replay.advance()
    for is_fitted in (False, True):
        ((_, said, helped),) = unmet(replay, ARRIVED, is_fitted)
        assert said.endswith("cannot bend further")
        assert helped != is_fitted
    replay.release()


@pytest.mark.parametrize(
    ("det", "ticks", "said"),
    [
        (0.88, 1, "its movement is not over yet"),
        (0.82, 1, "the picture around it cannot bend further"),
        (0.88, 90, "the picture around it cannot bend further"),
    ],
)
def test_a_map_that_only_slows_a_handle_down_does_not_keep_it_from_its_goal(
    device: Device, det: float, ticks: int, said: str
):
    """Bent so that it goes .74 as fast, and .07 as fast; the first lets go later, and that is the reason, too."""
    replay = replay_of(device, handle=[led_to([0.4, 0.5], [0.6, 0.5])], fluid={"grid": 32}, duration=2.0)
    swollen = np.zeros((96, 128, 2), np.float32)
    swollen[..., 0] = (det - 1) * ((np.arange(128) + 0.5) / 128 - 0.5)
    replay.warp.set(swollen)
    for _ in range(ticks):
        replay.advance()
    ((_, told, _),) = unmet(replay, ARRIVED, is_fitted=True)
    assert told.endswith(said)
    replay.release()


SHORT = [[0.5954, 0.8611], [0.5953, 0.8612], [0.5953, 0.8611]]  # all its points lie on one another
BESIDE = [[0.5364, 0.6153], [0.536, 0.6153], [0.5356, 0.6153], [0.536, 0.6153]]
DICE = np.random.default_rng(20)
ON_ONE_ANOTHER, APART = (0.5 + 0.001 * DICE.normal(size=(20, 2))).tolist(), DICE.uniform(0.1, 0.9, (20, 2)).tolist()
TURNED = [[0.59, 0.65], [0.38, 0.78], [0.38, 0.5]]
TOO_STRONG = {
    "short lines that are opened, each in the other's way": (
        (96, 128),
        [],
        [
            {"points": SHORT, "goals": [[0.25, 0.25], [0.81, 0.26], [0.63, 0.0]], "to": [0.848, 0.576]}
            | {"duration": 0.01, "local": 1.0, "radius": 0.114, "rotate": 359.0},
            {"at": [0.1886, 0.7574], "points": BESIDE, "goals": BESIDE, "to": [0.86, 0.48]},
        ],
    ),
    "a line that reaches much farther than the picture is high": (
        (20, 200),
        [{"kind": "path", "points": [[0.5, 0], [0.5, 1]], "radius": 0.1, "range": [1e-3, 1.0]}],
        [
            {"points": [[0.95, 0.5], [0.57, 0.58], [0.75, 0.75], [0.8, 0.28]], "to": [0.96, 0.03], "rotate": -73.0}
            | {"radius": 1.0, "duration": 0.1}
        ],
    ),
    "a line and a pin at a hard border of thickness": (
        (400, 20),
        [{"kind": "path", "points": [[0.36, 0.15]], "radius": 0.05, "hardness": 1.0, "range": [1e-5, 0.01]}],
        [
            {"points": TURNED, "goals": TURNED[::-1]},
            {"at": [0.31, 0.3], "to": [0.31, 0.3], "points": [[0.57, 0.1], [0.18, 0.54], [0.34, 0.19]]},
        ],
    ),
    "points that lie on one another, led apart by local pushes": (
        (64, 64),
        [],
        [{"points": ON_ONE_ANOTHER, "goals": APART, "local": 1.0, "radius": 0.1, "duration": 0.05}],
    ),
}


@pytest.mark.parametrize("name", TOO_STRONG)
def test_pushes_that_would_be_too_strong_together_fold_nothing(name: str, device: Device):
    size, thicker, handles = TOO_STRONG[name]
    parts = {"fluid": {"grid": 32, "viscosity": 0.0065}, "duration": 0.1, "viscosity": thicker, "handle": handles}
    replay = replay_of(device, np.zeros((*size, 3), np.uint8), **parts)
    for _ in range(replay.recipe.ticks):
        replay.advance()
        assert replay.warp.statistics().folds == 0
    replay.release()


@pytest.mark.parametrize("count", [1, 2])
def test_what_is_made_up_is_less_beside_what_is_thick_and_in_all_places_alike(count: int, device: Device):
    """Less only where it is thick, it flowed back along the border in a row of cells, 1.8 times as fast as the handle.

    Of two that go the same way, what is thick lies within their wide pushes only.
    """
    drawn, x, border = list[np.ndarray](), 0.4, 64 if count == 1 else 92
    for thickest in (0.0065, 0.65):
        fluid = Fluid(device, Grid(128, 128))
        warp, velocity = WarpMap(device, fluid.grid), device.field(fluid.grid.size, 2)
        fluid.set_viscosity(np.broadcast_to(np.where(np.arange(128) < border, 0.0065, thickest), (128, 128)))
        ways = [Handle((x, y), (x, y + 0.4), RADIUS, duration=0.1) for y in (0.3, 0.5)[-count:]]
        handles = Handles(fluid, warp, ways)
        handles.lead(DT, 0.0)
        fluid.impulse.clear()
        handles.make_up(velocity)
        drawn.append(velocity.get())
        for thing in (handles, velocity, warp, fluid):
            thing.release()
    thin, thick = drawn[0][:, 8:120], drawn[1][:, 8:120]
    reached = thin[:, 74:] if count == 2 else thin  # what narrow pushes reach goes as before
    part = (thick[:, -len(reached[0]) :] * reached).sum() / (reached**2).sum()
    assert np.abs(reached).max() > 0.01
    assert 0.1 < part < 0.9
    np.testing.assert_allclose(thick[:, -len(reached[0]) :], part * reached, atol=1e-3 * np.abs(reached).max())


def test_what_is_frozen_beside_a_handle_is_told(device: Device):
    """Farther off than it reaches it is not; and what is led too far would not get there with a larger reach either."""
    frozen_disc = {"kind": "path", "points": [[0.65, 0.5]], "radius": 0.05, "hardness": 1.0}
    folded = np.zeros((96, 128, 2), np.float32)
    folded[:, 64, 0] = 1.5 / 128
    for at, to, between in (0.5, (0.5, 0.4), True), (0.5, (0.95, 0.5), True), (0.35, (0.35, 0.4), False):
        led = led_to([at, 0.5], [*to], radius=0.2)
        replay = replay_of(device, handle=[led], freeze=[frozen_disc], fluid={"grid": 64}, duration=0.1)
        replay.warp.set(folded)
        replay.advance()
        ((_, said, _),) = unmet(replay, ARRIVED)
        assert ("the picture between it and what is frozen" in said) == between
        assert "cannot bend further" in said
        replay.release()


def test_what_lets_go_by_itself_is_not_said_to_be_in_another_s_way(device: Device):
    soft = led_to([0.4, 0.5], [0.6, 0.5], stiffness=0.01, duration=0.1)
    replay = replay_of(device, handle=[soft], fluid={"grid": 16, "viscosity": 1.0, "drag": 20.0}, duration=0.8)
    replay.seek(48)
    ((_, said, helped),) = unmet(replay, ARRIVED)
    assert said.endswith("it gives way to the fluid, and needs more stiffness")
    assert helped


def test_only_what_a_fit_leads_is_told_of_it(device: Device):
    """No pin, nothing that has let go, nor what has not begun."""
    led = led_to([0.4, 0.5], [0.6, 0.5])
    replay = replay_of(
        device, handle=[led, led | {"end": 0.0}, led | {"start": 5.0}], pin=[{"at": [0.5, 0.5]}],
        fluid={"grid": 48}, duration=0.1,
    )  # fmt: skip
    replay.advance()
    folded = np.zeros((96, 128, 2), np.float32)
    folded[:, 66, 0] = 1.5 / 128
    replay.warp.set(folded)
    said = {label: (sentence.partition("should be: ")[2], helped) for label, sentence, helped in unmet(replay, -1.0)}
    bent = "the picture around it cannot bend further"
    over, waiting = "it has let go by now", "it has not begun"
    assert said == {
        "handle[1]": (bent, True),
        "handle[2]": (over, False),
        "handle[3]": (waiting, False),
        "pin[1]": (bent, False),
    }
    replay.release()


def test_what_has_let_go_is_asked_for_nothing_unless_its_way_was_not_over(device: Device):
    led = led_to([0.4, 0.5], [0.5, 0.5], duration=0.1)
    ended = [led | {"end": 0.1}, led_to([0.4, 0.2], [0.5, 0.2]) | {"end": 0.1}]
    replay = replay_of(device, handle=ended, pin=[{"at": [0.9, 0.5], "end": 0.1}], fluid={"grid": 32}, duration=0.3)
    replay.seek(18)
    assert [each.label for each in unmet(replay, -1.0)] == ["handle[2]"]
    replay.release()


@pytest.mark.parametrize(
    ("radius", "far", "local", "dt", "why", "helped"),
    [
        (0.1, 3.0, 0.0, DT, "its reach (radius) is too small to go that far", False),
        (
            0.03,
            0.8,
            0.0,
            DT,
            "it reaches over only 1.9 cells of the simulation; give it a larger reach (radius)",
            False,
        ),
        (0.03, 1.8, 1.0, DT, "the picture around it cannot bend further", True),
        (0.2, 1.9, 0.0, DT / 2, "the picture around it cannot bend further", True),
    ],
    ids=["too far", "small", "small and local", "neither"],
)
def test_of_what_is_missed_one_remedy_is_told(
    device: Device, radius: float, far: float, local: float, dt: float, why: str, helped: bool
):
    """`objections` tell of what goes too far that it wants a larger radius; no fit is offered beside that."""
    one = led_to([0.3, 0.5], [0.3 + far * radius, 0.5], radius=radius, local=local)
    fluid = {"grid": 64, "viscosity": 0.03, "drag": 2.0, "dt": dt}
    far_off = {"at": [0.9, 0.9], "radius": 0.01}
    replay = replay_of(device, handle=[one], pin=[far_off], fluid=fluid, duration=3.0)
    replay.seek(round(3.0 / dt))
    ((_, said, is_helped),) = unmet(replay, ARRIVED)
    assert (said.partition("should be: ")[2], is_helped) == (why, helped)
    assert bool([*objections(replay.recipe.handle, (), EXTENT)]) == why.startswith("its reach")
    replay.release()


@pytest.mark.parametrize(
    ("pin", "halt"),
    [
        ({"at": [0.31, 0.5]}, "at odds"),
        ({"at": [0.31, 0.5], "end": 2.0}, "alone"),
        ({"at": [0.31, 0.5], "start": 4.0}, "alone"),
        ({"at": [0.31, 0.65]}, "alone"),
    ],
    ids=["near", "over", "waiting", "far"],
)
def test_only_what_is_near_is_in_the_way_of_what_has_let_go(device: Device, pin: dict[str, Any], halt: str):
    """A pin somewhere else was told as the reason, as soon as there was one."""
    one = led_to([0.3, 0.5], [0.324, 0.5], radius=0.03)
    replay = replay_of(device, handle=[one], pin=[{"radius": 0.03} | pin], fluid={"grid": 32, "dt": DT}, duration=3.0)
    replay.seek(90)
    halts = dict(zip([label for label, _ in replay.led], replay.handles.halts, strict=True))
    assert halts["handle[1]"] == halt
    replay.release()


def test_handles_of_which_none_has_begun_say_so(device: Device):
    late = led_to([0.4, 0.5], [0.6, 0.5], radius=0.05, start=5.0)  # and far, which is told beside
    replay = replay_of(device, handle=[late], fluid={"grid": 16}, duration=0.1)
    replay.advance()
    ((_, said, _),) = unmet(replay, ARRIVED)
    assert said.endswith("from where it should be: it has not begun")
    replay.release()


def test_what_comes_no_nearer_lets_go_while_others_are_led(device: Device):
    """And what is on its way, has just arrived or waits is told as that."""
    two = [Handle((0.25, 0.25), (x, 0.25), RADIUS, duration=0.1) for x in (0.15, 0.35)]
    one = Handle((0.7, 0.7), (0.75, 0.7), RADIUS, duration=3.0)
    grid = Grid(32, 32)
    fluid, warp = Fluid(device, grid), WarpMap(device, grid, (128, 128))
    fluid.set_viscosity(0.3)
    handles = Handles(fluid, warp, [*two, one, Handle((0.7, 0.3), radius=0.1), Handle((0.3, 0.7), start=9.0)])
    for _ in range(60):
        handles.advance(DT)
    assert handles.halts == ["at odds", "at odds", "under way", None, "waiting"]
    for _ in range(60):
        handles.advance(DT)
    assert handles.halts == ["at odds", "at odds", None, None, "waiting"]
    assert handles.away[2] < ARRIVED


def test_a_fluid_handle_beside_local_ones_arrives(device: Device):
    """They press the picture together, which tells of no fold."""
    beside = [Handle((0.45, y), (0.53, y), 0.15, duration=0.4, local=1.0) for y in (0.3, 0.7)]
    led, warp = led_alone(device, Handle((0.4, 0.5), (0.5, 0.5), RADIUS, duration=0.4), *beside, ticks=24, cells=48)
    assert led.away.max() * PIXELS < 0.5
    assert warp.statistics().folds == 0


ONE_WAY = ((0.31, 0.4), (0.17, 0.83), 0.13, 0.0), ((0.44, 0.32), (0.14, 0.81), 0.1, 1.0)
AT_ODDS = (
    ((0.24, 0.58), (0.49, 0.61), 0.23, 0.0),
    ((0.63, 0.62), (0.41, 0.77), 0.3, 1.0),
    ((0.67, 0.63), (0.86, 0.36), 0.2, 0.0),
)


@pytest.mark.parametrize(
    ("texels", "viscosity", "ways"), [(4, 0.3, ONE_WAY), (8, 0.03, AT_ODDS)], ids=["one way", "at odds"]
)
def test_a_fluid_handle_beside_local_ones_stops_before_the_map_folds(
    texels: int, viscosity: float, ways: Any, device: Device
):
    """What is local excuses only what it has itself done to det J, else 8 and 15 places fold (det J -.88, -.58)."""
    fluid, warp = Fluid(device, Grid(32, 32)), WarpMap(device, Grid(32, 32), (32 * texels, 32 * texels))
    fluid.set_viscosity(viscosity)
    handles = Handles(
        fluid, warp, [Handle(at, to, radius, duration=0.6, local=local) for at, to, radius, local in ways]
    )
    least = 1.0
    for tick in range(45):
        handles.advance(1 / 30)
        if tick % 3 == 2:
            least = min(least, warp.statistics().det_min)
    assert least > 0.2
    for thing in (handles, warp, fluid):
        thing.release()


def test_what_is_local_makes_of_det_j_what_is_expected(device: Device):
    """Both are found apart: by what is local on the fluid's grid, and by the map's slopes."""
    fluid, warp = Fluid(device, Grid(64, 64)), WarpMap(device, Grid(64, 64), (256, 256))
    fluid.set_viscosity(0.03)
    expected = Expected(warp)
    expected.begin()
    handles = Handles(fluid, warp, [Handle((0.4, 0.5), (0.55, 0.5), 0.25, duration=0.5, local=1.0)])
    for _ in range(15):
        handles.lead(1 / 30, fluid.time)
        fluid.step(1 / 30, (), handles.make_up)
        handles.carry()
        expected.follow(fluid, 1 / 30)
        warp.follow(fluid, 1 / 30)
    assert expected.field is not None
    found = np.exp(expected.field.get())
    x, y = Grid(64, 64).centres()
    determinants = warp.determinants(np.stack([x, y], axis=-1).reshape(-1, 2)).reshape(64, 64)
    assert determinants.min() < 0.5
    assert determinants.max() > 1.5
    assert np.abs(found / determinants - 1).max() < 0.02
    for thing in (expected, handles, warp, fluid):
        thing.release()


def test_what_a_source_has_fed_for_minutes_is_expected_as_far_as_numbers_go(device: Device):
    """The picture grew by e^800: what was left of that was divided by zero, and a local handle led by no number."""
    grid = Grid(16, 16)
    fluid, warp = Fluid(device, grid), WarpMap(device, grid)
    expected, strain = Expected(warp), Strain(warp)
    expected.begin()
    for sign in (1, -1):
        fluid.set_velocity(lambda x, y, t, sign=sign: (sign * (x - 0.5), sign * (y - 0.5)))
        for _ in range(150):
            expected.follow(fluid, 4.0)
        assert expected.field is not None
        assert np.abs(expected.field.get()).max() > 80, "it has come to the end of numbers"
        with np.errstate(divide="raise", over="raise", invalid="raise"):
            assert np.isfinite(strain.around(np.array([[0.5, 0.5]]), np.array([0.2]), expected.field)).all()
    for thing in (expected, strain, warp, fluid):
        thing.release()


@pytest.mark.parametrize(
    ("beside", "to", "within"),
    [
        ({"freeze": [{"kind": "path", "points": [[0.5, -0.1], [0.5, 1.1]], "radius": 0.02}]}, [0.36, 0.6], 3.0),
        ({"viscosity": [{"kind": "path", "points": [[0.5, 0], [0.5, 1]], "radius": 0.1, "hardness": 1.0}
            | {"range": [1e-3, 1.0]}]}, [0.3, 0.3], 0.5),
    ],
    ids=["frozen", "thick"],
)  # fmt: skip
def test_a_local_handle_beside_what_does_not_move_is_led_by_the_fluid_too(
    beside: dict[str, Any], to: list[float], within: float, device: Device
):
    """Carried within a cell of it, the picture was bent as far as it bears (det J .26): 49 and 8 pixels short."""
    led = led_to([0.36, 0.3], to, radius=0.2, duration=0.6, local=1.0)
    replay = replay_of(device, np.zeros((128, 128, 3), np.uint8), handle=[led], duration=1.0, **beside)
    replay.seek(replay.recipe.ticks)
    assert replay.handles.away[0] * PIXELS < within
    assert replay.warp.statistics().det_min > 0.55
    replay.release()


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


def test_a_local_outline_that_grows_leaves_the_fluid_alone(device: Device):
    grid, square = Grid(32, 32), ((0.4, 0.4), (0.6, 0.4), (0.6, 0.6), (0.4, 0.6))
    speeds: list[float] = []
    for local in (0.0, 1.0):
        fluid, warp = Fluid(device, grid), WarpMap(device, grid)
        fluid.set_viscosity(0.03)
        outline = Handle((0.5, 0.5), radius=0.1, points=square, closed=True, scale=1.3, duration=0.4, local=local)
        handles = Handles(fluid, warp, [outline])
        for _ in range(6):
            handles.advance(1 / 60)
        speeds.append(fluid.motion().largest_speed)
        for thing in (handles, warp, fluid):
            thing.release()
    assert speeds[1] < 0.1 * speeds[0]


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


@pytest.mark.parametrize("stiffness", [0.1, 0.01])
def test_alone_a_handle_of_little_stiffness_leads_by_about_that_part(device: Device, stiffness: float):
    """Of how a handle of 1 sets the fluid going."""
    speeds = []
    for part in (1.0, stiffness):
        grid = Grid(32, 32)
        fluid, warp = Fluid(device, grid), WarpMap(device, grid)
        fluid.set_viscosity(0.03)
        handles = Handles(fluid, warp, [Handle((0.5, 0.5), (0.6, 0.5), RADIUS, duration=0.2, stiffness=part)])
        handles.advance(1 / 60)
        speeds.append(fluid.motion().largest_speed)
        for thing in (handles, warp, fluid):
            thing.release()
    assert stiffness < speeds[1] / speeds[0] < 1.5 * stiffness


def test_a_turn_goes_from_key_to_key(device: Device):
    turned = Handle((0.5, 0.5), rotate=20.0, duration=0.4, turned=((0.8, 50.0, 2.0), (1.2, -10.0, 1.0)))
    found = [turned.turn(time, DT) for time in (0.0, 0.4, 0.6, 0.8, 1.0, 9.0)]
    assert [angle for angle, _ in found] == pytest.approx([0, 20, 35, 50, 20, -10])
    assert [scale for _, scale in found] == pytest.approx([1, 1, 2**0.5, 2, 2**0.5, 1])
    led, warp = led_alone(device, Handle((0.5, 0.5), turned=((0.3, 40.0, 1.0), (0.6, 20.0, 1.2))), ticks=24, cells=32)
    assert led.away.max() * PIXELS < 0.5
    assert np.linalg.det(jacobian(warp, led.places[0])) ** 0.5 == pytest.approx(1.2, rel=0.06)


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


def test_handles_are_sought_once_a_step_however_often_they_are_looked_at(
    device: Device, monkeypatch: pytest.MonkeyPatch
):
    sought, seek = [], WarpMap.seek
    monkeypatch.setattr(WarpMap, "seek", lambda *given: (sought.append(1), seek(*given))[1])
    replay = replay_of(device, handle=[led_to([0.3, 0.4], [0.4, 0.5])])
    for step in range(4):  # as a hand leads it on
        handle = replay.recipe.handle[0].edited(keys=((0.5, 0.4, 0.5 + 0.01 * step),))
        replay.use(replay.recipe.edited(handle=(handle,)))
        replay.advance()
        assert np.isfinite(replay.handles.places).all()
        assert np.isfinite(replay.handles.away).all()
    replay.release()
    assert len(sought) == 4


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


@pytest.mark.parametrize(("to", "least", "most"), [((0.6, 0.5), 0.0, 0.01), (None, 0.5, 2.0)], ids=["handle", "pin"])
def test_what_halts_lets_go(to: tuple[float, float] | None, least: float, most: float, device: Device):
    """At rest among others that flow by, it would strain the map around it further; a pin holds."""
    grid = Grid(32, 32)
    fluid, warp = Fluid(device, grid), WarpMap(device, grid, (128, 128))
    folded, faces = np.zeros((128, 128, 2), np.float32), device.field(grid.size, 2)
    folded[:, 66, 0] = 1.5 / 128
    warp.set(folded)
    handles = Handles(fluid, warp, [Handle((0.4, 0.5), to, 0.2)])
    handles.lead(DT, 0.0)
    faces.clear(0.1, 0.0)
    handles.make_up(faces)
    changed = np.abs(faces.get() - [0.1, 0.0]).max() / 0.1
    assert least <= changed <= most
    for thing in (handles, faces, warp, fluid):
        thing.release()


@pytest.mark.parametrize("to", [(0.6, 0.5), (0.4, 0.5), None], ids=["on its way", "there", "pin"])
def test_what_halts_on_its_way_calms_the_fluid_as_far_as_it_may_set_it_going(
    to: tuple[float, float] | None, device: Device
):
    """What coasts past it would strain the map further: here two radii off. What has arrived lets strokes flow by."""
    grid, speeds = Grid(32, 32), []
    folded = np.zeros((128, 128, 2), np.float32)
    folded[:, 66, 0] = 1.5 / 128
    for moved in (0 * folded, folded):
        fluid, warp = Fluid(device, grid), WarpMap(device, grid, (128, 128))
        handles = Handles(fluid, warp, [Handle((0.388, 0.5), to, 0.2, duration=0.0)])
        for _ in range(3):
            handles.advance(DT)
        warp.set(warp.read((128, 128)) + moved + (0 if to else 2 / 128))  # the pin is carried off
        fluid.set_velocity(
            lambda x, y, t: (np.sin(np.pi * x) * np.cos(np.pi * y), -np.cos(np.pi * x) * np.sin(np.pi * y))
        )
        handles.advance(0.001)
        speeds.append(np.hypot(*np.moveaxis(fluid.faces().get(), -1, 0))[14:18, 24:28].mean())
        for thing in (handles, warp, fluid):
            thing.release()
    assert (speeds[1] < 0.9 * speeds[0]) == (to == (0.6, 0.5))


def test_of_several_that_halt_each_calms_the_fluid_about_it(device: Device):
    grid, folded, speeds = Grid(32, 32), np.zeros((128, 128, 2), np.float32), []
    folded[:, 66, 0] = 1.5 / 128
    for moved in (0 * folded, folded):
        fluid, warp = Fluid(device, grid), WarpMap(device, grid, (128, 128))
        ways = [Handle((0.388, y), (0.6, y), 0.2, duration=0.0) for y in (0.15, 0.85)]
        handles = Handles(fluid, warp, ways)
        for _ in range(3):
            handles.advance(DT)
        warp.set(warp.read((128, 128)) + moved)
        fluid.set_velocity(
            lambda x, y, t: (np.sin(np.pi * x) * np.cos(np.pi * y), -np.cos(np.pi * x) * np.sin(np.pi * y))
        )
        handles.advance(0.001)
        speed = np.hypot(*np.moveaxis(fluid.faces().get(), -1, 0))
        speeds.append([speed[rows, 24:28].mean() for rows in (slice(1, 4), slice(28, 31))])
        for thing in (handles, warp, fluid):
            thing.release()
    ratio = np.divide(speeds[1], speeds[0])
    assert ratio.max() < 0.92


HANDLES = [
    led_to([0.3, 0.4], [0.4, 0.5], rotate=20.0, turned=[[0.5, 0.0, 1.1], [0.6, 10.0, 1.0]]),
    led_to([0.7, 0.6], [0.6, 0.7], start=0.2, local=0.5, stiffness=0.8),
]
PINS = [{"points": [[0.4, 0.2], [0.6, 0.2]]}]


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


LATE, EARLY = led_to([0.7, 0.6], [0.6, 0.7], start=0.3), led_to([0.3, 0.4], [0.4, 0.5])


@pytest.mark.parametrize(
    "changed", [{"at": [1.2, 0.3]}, {"rotate": 30.0}, {"muted": True}], ids=["out of the picture", "turned", "muted"]
)
def test_a_handle_that_is_changed_later_gives_the_same_as_one_that_was(changed: dict[str, Any], device: Device):
    """Those behind it get another number, or their points do."""
    replay, straight = replay_of(device, handle=[LATE | changed, EARLY]), replay_of(device, handle=[LATE, EARLY])
    replay.seek(30)
    replay.use(straight.recipe)
    straight.seek(30)
    assert np.array_equal(replay.warp.read(), straight.warp.read())
    for each in (replay, straight):
        each.release()


def test_a_script_gives_the_bytes_of_a_recipe(device: Device):
    line = [[0.3, 0.4], [0.5, 0.4], [0.5, 0.6]]
    handles = [
        led_to([0.7, 0.6], [0.6, 0.6], rotate=30.0, scale=1.2),
        {"points": line, "to": [0.45, 0.45], "duration": 0.4, "closed": True},
    ]
    replay = replay_of(device, handle=handles)
    replay.seek(40)
    fluid = Fluid(device, replay.grid, FluidParams(drag=2.0))
    fluid.set_viscosity(0.03)
    warp, corners = WarpMap(device, replay.grid, replay.warp.size), [(x, 0.75 * y) for x, y in line]
    leading = Handles(
        fluid,
        warp,
        [
            Handle((0.7, 0.6 * 0.75), (0.6, 0.6 * 0.75), duration=0.4, rotate=30.0, scale=1.2),
            Handle(replay.handles.handles[1].at, (0.45, 0.45 * 0.75), duration=0.4, points=tuple(corners), closed=True),
        ],
    )
    for _ in range(40):
        leading.advance(1 / 60)
    assert np.array_equal(warp.read(), replay.warp.read())
    for thing in (replay, leading, warp, fluid):
        thing.release()


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
    ((label, said, _),) = unmet(replay, ARRIVED)
    assert label == 'handle[2] "held"'
    assert said.startswith('handle[2] "held" is ')
    assert said.endswith("from where it should be: what it holds is frozen")
    assert replay.warp.statistics().folds == 0
    replay.release()


def test_how_far_is_told_without_a_power_of_ten_in_a_large_picture():
    assert [in_pixels(far) for far in (0.7184, 43.44, 999.4, 999.6, 1234.5, 8410.4)] == [
        "0.718", "43.4", "999", "1000", "1234", "8410",
    ]  # fmt: skip


def test_a_line_that_is_led_about_a_place_far_outside_is_told_of(device: Device):
    """Its own middle is frozen, one end of it is not."""
    frozen_disc = {"kind": "path", "points": [[0.3, 0.5]], "radius": 0.1, "hardness": 1.0}
    line = {"at": [0.5, -4.0], "points": [[0.2, 0.5], [0.6, 0.5]], "to": [0.5, -3.8], "duration": 0.1}
    replay = replay_of(device, handle=[line], freeze=[frozen_disc], duration=0.1)
    replay.seek(4)
    ((_, said, _),) = unmet(replay, ARRIVED)
    assert said.endswith("from where it should be: what it holds is frozen")
    replay.release()


def test_what_is_left_of_a_turned_line_is_its_farthest_point_s_way_wherever_it_is_told(device: Device):
    """Its middle stays where it is; a handle in a frozen part, led too far, tells all of its way too."""
    frozen_disc = {"kind": "path", "points": [[0.8, 0.2]], "radius": 0.1, "hardness": 1.0}
    line = {"points": [[0.3, 0.5], [0.6, 0.5]], "to": [0.45, 0.5], "rotate": 90.0, "duration": 0.1}
    far = led_to([0.8, 0.2], [0.2, 0.2], radius=0.1, duration=0.1)
    replay = replay_of(device, handle=[line, far], freeze=[frozen_disc], duration=0.1)
    replay.seek(4)
    turned, held = held_in(replay)
    assert turned.now == pytest.approx(turned.target, abs=0.01)
    assert turned.left > 0.05
    farthest = max(
        np.hypot(*((np.array(one) - other) * EXTENT)) for one, other in zip(turned.line, turned.due, strict=True)
    )
    assert turned.left == pytest.approx(farthest)
    assert held.left == pytest.approx(0.6, abs=0.02)
    assert held.target == pytest.approx((0.2, 0.2))
    for one, (label, said, _) in zip((turned, held), unmet(replay, ARRIVED), strict=True):
        assert one.label == label
        assert f"is {one.left * 128:.3g} pixels" in said
    replay.release()


@pytest.mark.parametrize("closed", [False, True])
def test_the_middle_of_a_line_goes_as_its_points_do_as_the_picture_is_seen_at_an_amount(device: Device, closed: bool):
    corners = [[0.3, 0.3], [0.3, 0.5], [0.45, 0.55]]
    line = {"points": corners, "closed": closed, "to": [0.45, 0.4], "duration": 0.1}
    replay = replay_of(device, handle=[line], amount=0.5, duration=0.2)
    replay.seek(12)
    (one,) = held_in(replay)
    (seen,) = as_seen([one], replay)
    last = len(one.line) - closed  # a closed one ends where it begins
    moved = np.mean(seen.line[:last], axis=0) - np.mean(one.line[:last], axis=0)
    assert np.hypot(*moved) > 0.01
    np.testing.assert_allclose(np.subtract(seen.now, one.now), moved, atol=1e-6)
    replay.release()


def test_marks_lie_on_what_they_hold_as_the_picture_is_seen_at_an_amount(device: Device):
    line = {"points": [[0.3, 0.3], [0.3, 0.5]], "to": [0.35, 0.4], "duration": 0.1}
    replay = replay_of(device, handle=[led_to([0.7, 0.5], [0.8, 0.45], duration=0.1), line], amount=0.5, duration=0.2)
    replay.seek(12)
    held = held_in(replay)
    assert as_seen(held, Replay(device, replay.recipe.edited(amount=1.0), replay.pictures, budget=0)) is held
    for one, seen in zip(held, as_seen(held, replay), strict=True):
        places = np.multiply([[one.now, *one.line], [seen.now, *seen.line]], EXTENT)
        whole, half = places[0] + replay.warp.at(places[0]), places[1] + replay.seen.at(places[1])
        np.testing.assert_allclose(half, whole, atol=2e-4)
        assert np.hypot(*(places[0] - places[1]).T).min() > 0.01
        assert seen.start == pytest.approx(one.led.at, abs=1e-6)
    replay.release()


def test_the_mark_of_a_bent_line_is_where_it_was_drawn_as_the_picture_is_seen_as_it_was(device: Device):
    line = {"points": [[0.2, 0.7], [0.4, 0.8], [0.6, 0.7]], "to": [0.4, 0.65], "duration": 0.1}
    replay = replay_of(device, handle=[line], amount=0.0, duration=0.2)
    replay.seek(12)
    (seen,) = as_seen(held_in(replay), replay)
    assert seen.now == pytest.approx(seen.led.at, abs=2e-3)
    replay.release()


def test_an_outline_of_no_size_is_led(device: Device):
    corners = [[0.5, 0.5], [0.5 + 1e-9, 0.5], [0.5, 0.5 + 1e-9]]
    replay = replay_of(device, handle=[{"points": corners, "closed": True, "to": [0.52, 0.5], "scale": 2.0}])
    replay.seek(4)
    assert np.isfinite(replay.warp.read()).all()
    replay.release()


def test_what_walls_part_from_its_goal_is_told_and_folds_nothing(device: Device):
    """The handle is in a ring of what is frozen, and one tells of it outside."""
    angles = np.linspace(0, 2 * np.pi, 49)
    ring = np.stack([0.4 + 0.12 * np.cos(angles), 0.5 + 0.16 * np.sin(angles)], axis=-1)
    wall = {"kind": "path", "points": ring.tolist(), "radius": 0.04, "hardness": 1.0}
    replay = replay_of(device, handle=[led_to([0.4, 0.5], [0.6, 0.5], radius=0.1)], freeze=[wall], duration=1.0)
    replay.seek(60)
    ((label, _, _),) = unmet(replay, ARRIVED)
    assert label == "handle[1]"
    found = replay.warp.statistics()
    assert found.folds == 0
    assert found.det_min > 0
    replay.release()


def test_what_lies_outside_or_goes_there_is_led_as_far_as_the_edge(device: Device):
    handles = [led_to([1.2, 0.5], [0.5, 0.5]), led_to([0.2, 0.2], [0.2, -0.5], radius=0.3)]
    replay = replay_of(device, handle=handles, duration=1.0)
    replay.seek(60)
    assert [label for label, _ in replay.led] == ["handle[2]"]
    assert replay.handles.places[0][1] < 0.03
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
        {"points": [[-0.1, 0.3], [0.1, 0.3]], "to": [0.1, 0.35]},
        {"points": [[0.9, 0.1], [0.95, 0.1], [0.95, 0.15]], "closed": True}
        | {"goals": [[0.95, 0.1], [0.9, 0.1], [0.9, 0.15]]},
        {"points": [[0.4, 0.05], [0.6, 0.05]], "to": [0.5, 0.05], "rotate": 180.0},
        led_to([0.55, 0.05], [0.55, 0.05]),
    ]
    recipe = Recipe.model_validate(frozen({"handle": handles}))
    assert list(objections(recipe.handle, recipe.pin, EXTENT)) == [
        "handle[1] takes hold of nothing: (1.2, 0.5) is outside the picture",
        "handle[2] goes only to the picture's edge: (0.2, -0.5) is outside the picture",
        "handle[9] reaches out of the picture: what is outside is not moved",
        "handle[9] stays 10% of the longer side short: what is at the picture's edge stays there",
        "handle[10] is turned inside out by its goals",
        "handle[2] and handle[9] have goals 5.1 times as far apart as they are",
        "handle[3] and handle[4] cross each other's way",
        "handle[5] and handle[6] hold the same place but have different goals",
        "handle[7] and handle[8] have goals 5.65 times as far apart as they are",
        "handle[11] and handle[12] cross each other's way",
    ]


def test_of_many_contradictions_some_are_told(device: Device):
    recipe = Recipe.model_validate(frozen({"handle": [led_to([0.5, 0.5], [k / 9, 0.2]) for k in range(9)]}))
    pictures = Pictures(Picture(BLACK))
    Replay(device, recipe, pictures).release()
    assert len(pictures.notices) == MOST_OBJECTIONS


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
        ("[[pin]]\npoints = [[0.5, 0.5], [0.6, 0.5]]\n" * 17, "there are 17 lines that are led or held"),
        ("[[pin]]\npoints = [[0.5, 0.5], [0.5, 0.5]]", "pin[1]: 'points' must be two different places or more"),
        ("[[pin]]\npoints = [[0.5, 0.5], [0.6]]", "pin[1]:"),
        ("[[pin]]\npoints = 3", "pin[1]:"),
        ("[[pin]]\nclosed = true", "pin[1]: 'at' is missing"),
        ("[[pin]]\nat = [0.5, 0.5]\nrotate = 3.0", "pin[1]: unknown key 'rotate'"),
        ("[[handle]]\nat = [0.5, 0.5]\nscale = 0.0", "handle[1]: 'scale' must be at least 0.1, not 0.0"),
        (
            "[[handle]]\npoints = [[0.5, 0.5], [0.6, 0.5]]\ngoals = [[0.5, 0.5]]",
            "handle[1]: 'points' has 2 places and 'goals' 1; give as many",
        ),
    ],
)
def test_a_wrong_handle_is_told_in_one_sentence(text: str, said: str):
    with pytest.raises(UserError) as error:
        Recipe.parse(text)
    assert said in str(error.value)


def test_a_handle_of_no_number_is_refused():
    wrong = {"at": (np.nan, 0.5)}, {"radius": 0.0}, {"start": np.inf}, {"stiffness": 0.0}, {"local": 2.0}
    line = {"points": ((0.4, 0.5), (0.6, 0.5))}
    lines = line | {"closed": True}, line | {"goals": ((0.5, 0.5),)}, {"points": ((0.5, 0.5),)}
    turns = {"rotate": np.nan}, {"rotate": 1e6}, {"scale": 0.0}, {"scale": np.inf}
    for each in (*wrong, *lines, *turns):
        parts: dict[str, Any] = {"at": (0.5, 0.5)} | each
        with pytest.raises(ValueError, match=r"handle|line"):
            Handle(**parts)


def test_keys_of_a_handle_are_fractions_of_either_side_and_stay_in_the_picture() -> None:
    one = RecipeHandle(at=(0.2, 0.4), radius=0.1, keys=((0.5, 0.2, 0.8), (1.0, 1.2, 0.4)))
    (handle,) = LoadedHandles((1.0, 0.5)).of([one])
    np.testing.assert_allclose(handle.keys, [(0.5, 0.2, 0.4), (1.0, 1.0, 0.2)])

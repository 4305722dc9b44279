"""What may be put in, to the last number that is allowed; grids and walls as values."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from solver import limits
from solver.brush.tip import Tip
from solver.grid import Grid
from solver.params import FluidParams, NoSlip, Walls


def test_a_step_is_from_none_to_three_hours() -> None:
    assert (limits.check_step(0), limits.check_step(10_000)) == (0.0, 10_000.0)
    for dt in (-1e-9, 10_000.1, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="it must be from 0 to 10000 s"):
            limits.check_step(dt)
    with pytest.raises(TypeError, match="a step is '1', a number is wanted"):
        limits.check_step("1")  # pyright: ignore[reportArgumentType]


def test_a_viscosity_is_from_none_to_a_million() -> None:
    assert limits.viscosities(1e6, (2, 3)).shape == (2, 3)
    assert limits.viscosities(np.zeros((2, 3)), (2, 3)).dtype == np.float32
    for value in (-1e-9, 1.000001e6, np.nan):
        with pytest.raises(ValueError, match="from 0 to 1e\\+06"):
            limits.viscosities(value)
    with pytest.raises(ValueError, match=r"of shape \(3, 2\) was given, \(2, 3\) is wanted"):
        limits.viscosities(np.zeros((3, 2)), (2, 3))


def test_a_brush_is_from_a_millionth_to_a_hundred_and_less_if_it_takes_back_around_itself() -> None:
    place = 0.5, 0.5
    for near, most in ((False, 100.0), (True, 25.0)):
        assert (Tip(place, place, 1e-6, near=near).radius, Tip(place, place, most, near=near).radius) == (1e-6, most)
        for radius in (9e-7, most + 0.1, float("nan")):
            with pytest.raises(ValueError, match=f"it must be from 1e-06 to {most:g}"):
                Tip(place, place, radius, near=near)
    assert Tip(place, place, 25.0, near=True).wide.radius == 100


def test_what_is_put_in_is_no_larger_than_a_million_either_way() -> None:
    assert limits.numbers("a place", (-1e6, 1e6), 2) == (-1e6, 1e6)
    limits.check_finite("a speed", -1e6)
    for value in (1.000001e6, -1.000001e6, np.nan, -(2**63)):  # the last has no absolute value in NumPy
        with pytest.raises(ValueError, match="beyond 1e\\+06"):
            limits.numbers("a place", (0, value), 2)
        with pytest.raises(ValueError, match="no larger than 1e\\+06"):
            limits.check_finite("a speed", value)
    with pytest.raises(ValueError, match=r"\(3,\) was given, \(2,\) is wanted"):
        limits.numbers("a place", (1, 2, 3), 2)


def test_a_mask_is_255_where_something_is() -> None:
    found = limits.as_mask("a mask", np.array([[0, 1, -2, 0.5]]), (1, 4))
    assert (found.tolist(), found.dtype) == ([[0, 255, 255, 255]], np.uint8)
    assert limits.as_mask("a mask", np.array([[True, False]]), (1, 2)).tolist() == [[255, 0]]
    with pytest.raises(ValueError, match="true or false"):
        limits.as_mask("a mask", np.array([[np.nan]]), (1, 1))
    with pytest.raises(ValueError, match="a mask has rows of unequal length"):
        limits.as_mask("a mask", [[True], [True, False]], (2, 2))


def test_places_are_pairs() -> None:
    assert limits.places([[[1, 2]], [[3, 4]]]).tolist() == [[1, 2], [3, 4]]
    assert limits.real_array("a", np.float16(0.5)).dtype == np.float32
    for wrong in (np.zeros((2, 3)), [["a", "b"]]):
        with pytest.raises(ValueError, match="places"):
            limits.places(wrong)
    with pytest.raises(ValueError, match="rows of unequal length"):
        limits.real_array("a", [[1], [1, 2]])


def test_a_window_knows_which_of_its_sides_are_the_picture_s() -> None:
    picture = (1.0, 0.75)
    for extent, origin, edges in (
        ((1.0, 0.75), (0.0, 0.0), (True, True, True, True)),
        ((0.5, 0.25), (0.0, 0.5), (True, False, False, True)),
        ((0.5, 0.25), (0.5, 0.0), (False, True, True, False)),
        ((0.5, 0.25), (0.25, 0.25), (False, False, False, False)),
    ):
        grid = Grid(16, 8, extent, origin, picture)
        assert grid.at_edge == edges
        assert grid.is_whole == all(edges)
    for extent, origin in (((0.5, 0.25), (0.5, 0.51)), ((0.5, 0.25), (-0.01, 0.0)), ((0.0, 0.25), (0.0, 0.0))):
        with pytest.raises(ValueError, match="not within a picture"):
            Grid(16, 8, extent, origin, picture)
    for wrong in ((1.0, 1.5), (0.9, 0.9), (1.0, 0.0)):
        with pytest.raises(ValueError, match="the longer must be 1"):
            Grid(16, 8, (0.5, 0.25), (0.0, 0.0), wrong)


def test_places_on_a_window_s_cells() -> None:
    grid = Grid(8, 16, (0.25, 0.5), (0.5, 0.125), (1.0, 0.75))
    assert (grid.spacing, grid.h) == ((0.03125, 0.03125), 0.03125)
    for points, x, y in (
        (grid.centres(), 0.5 + 0.046875, 0.125 + 0.078125),
        (grid.u_faces(), 0.5 + 0.03125, 0.125 + 0.078125),
        (grid.v_faces(), 0.5 + 0.046875, 0.125 + 0.0625),
        (grid.nodes(), 0.5 + 0.03125, 0.125 + 0.0625),
    ):
        assert (points[0][2, 1], points[1][2, 1]) == (x, y)
    fine = grid.refined(3)
    assert (fine.size, fine.extent, fine.origin, fine.picture) == ((24, 48), grid.extent, grid.origin, grid.picture)


def test_a_grid_is_laid_over_a_picture() -> None:
    for size, cells, wanted in (
        ((300, 200), 96, (96, 64)),
        ((200, 300), 96, (64, 96)),
        ((1000, 10), 96, (800, 8)),
        ((10_000, 10), 96, (4096, 8)),
        ((30, 30), 4, (8, 8)),
    ):
        assert Grid.for_picture(*size, cells).size == wanted
    for wrong in ((0, 10, 8), (10, 10, 0)):
        with pytest.raises(ValueError, match="were asked for"):
            Grid.for_picture(*wrong)
    with pytest.raises(ValueError, match="below 8 x 8"):
        Grid(8, 7)
    assert Grid(8, 8, (1.0, 1 / 1024)).h == 0.125
    with pytest.raises(ValueError, match="sides are more than 1024 to 1"):
        Grid(8, 8, (1.0, 1 / 1025))


SPEED = (1.0, 2.0, 3.0, 4.0)


def test_walls_stick_where_they_are_said_to() -> None:
    assert Walls("none", SPEED).no_slip == NoSlip(True, True, True, True, True)
    assert Walls("free", SPEED).no_slip == NoSlip(False, False, False, False, False)
    of_a_window = Walls.of("free", (True, False, True, False))
    assert of_a_window.no_slip == NoSlip(False, True, False, True, False)
    assert Walls("free", SPEED, of_a_window.sticky).driving_speed == (0.0, 2.0, 0.0, 4.0)
    assert (Walls().defines, Walls().inputs) == ({}, {})
    assert Walls("free", SPEED, of_a_window.sticky).inputs == {
        "wall_speed": SPEED,
        "wall_image": (1.0, -1.0, 1.0, -1.0),
    }
    with pytest.raises(ValueError, match='must be "free" or "none"'):
        Walls("both")  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"drag": -0.1}, "not negative"),
        ({"drag": float("inf")}, "finite"),
        ({"pressure_cycles": 0}, "0 pressure cycles"),
        ({"sweeps": 0}, "0 sweeps"),
        ({"sweeps": 1.5}, "1.5 sweeps"),
    ],
)
def test_parameters_that_are_none(given: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        FluidParams(**given)
    assert FluidParams() == FluidParams(Walls(), 0.0, None, 40)

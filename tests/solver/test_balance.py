"""Pushes that are not strong enough for what is wanted do it as well as they can, together; one handle's go as one."""

from __future__ import annotations

import numpy as np
import pytest

from solver import Grid
from solver.brush.balance import Balance
from solver.brush.pushes import Pushes


@pytest.fixture
def influence() -> np.ndarray:
    """Of eight pushes, close together, on one another."""
    places = 0.4 + 0.2 * np.random.default_rng(3).random((8, 2))
    return Pushes(Grid(32, 32), places, np.full(8, 0.25)).influence(places).reshape(16, 16)


def balance(influence: np.ndarray, owners: np.ndarray, bound: float) -> Balance:
    each = np.repeat(owners, 2)
    return Balance(influence, np.full(16, 1e-4), np.ones(16), (each, each), np.full(8, bound))


def sizes(strengths: np.ndarray) -> np.ndarray:
    return np.hypot(*strengths.reshape(-1, 2).T)


def test_what_is_within_bounds_is_least_squares(influence: np.ndarray):
    wanted = np.random.default_rng(1).normal(size=16)
    found = balance(influence, np.arange(8), np.inf).strengths(wanted)
    np.testing.assert_allclose(
        found, np.linalg.solve(influence.T @ influence + 1e-4 * np.eye(16), influence.T @ wanted), rtol=1e-6
    )


def test_each_does_its_share_where_all_are_within_bounds(influence: np.ndarray):
    """By (H3) in another order: W K' (K W K' + s)^-1 = (K' K + s W^-1)^-1 K'."""
    rng, each = np.random.default_rng(2), np.arange(16)
    wanted, shares = rng.normal(size=16), rng.uniform(0.1, 2, 16)
    weighed = Balance(influence, np.full(16, 1e-2), shares, (each, each), np.full(8, np.inf))
    inner = influence.T @ influence + 1e-2 * np.diag(1 / shares)
    np.testing.assert_allclose(weighed.strengths(wanted), np.linalg.solve(inner, influence.T @ wanted), rtol=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_pushes_beside_those_at_their_bounds_make_up_for_them(seed: int, influence: np.ndarray):
    """More is done than by cutting off what is too strong, or all in proportion."""
    wanted = 0.3 * np.random.default_rng(seed).normal(size=16)
    free, found = (balance(influence, np.arange(8), bound).strengths(wanted) for bound in (np.inf, 1.0))
    over = np.maximum(np.repeat(sizes(free), 2), 1.0)
    assert sizes(free).max() > 2
    assert sizes(found).max() <= 1 + 1e-9
    left, cut, less = (np.linalg.norm(wanted - influence @ each) for each in (found, free / over, free / over.max()))
    assert left < 0.8 * min(cut, less)


def test_all_of_one_handle_goes_in_the_same_proportion(influence: np.ndarray):
    wanted = np.random.default_rng(1).normal(size=16)
    strong, weak = (balance(influence, np.zeros(8, int), bound).strengths(wanted) for bound in (np.inf, 0.1))
    np.testing.assert_allclose(weak, strong * 0.1 / sizes(strong).max(), rtol=1e-6)


def test_a_handle_that_is_too_weak_slows_none_far_from_it():
    places = np.array([[0.2, 0.2], [0.8, 0.8]])
    influence = Pushes(Grid(32, 32), places, np.full(2, 0.25)).influence(places).reshape(4, 4)
    each = np.repeat(np.arange(2), 2)
    found = Balance(influence, np.full(4, 1e-4), np.ones(4), (each, each), np.ones(2)).strengths(
        np.array([3.0, 0.0, 0.5, 0.0])
    )
    np.testing.assert_allclose(found, [1, 0, 0.5, 0], atol=0.01)


def test_turns_of_rings_are_not_bounded():
    found = Balance(np.eye(3), np.zeros(3), np.ones(3), (np.zeros(3), np.zeros(3)), np.full(1, 1.0)).strengths(
        np.array([0.0, 2.0, 3.0])
    )
    np.testing.assert_allclose(found, [0, 1, 1.5])


def test_however_few_rounds_there_is_room_for_no_push_exceeds_its_bound(
    influence: np.ndarray, monkeypatch: pytest.MonkeyPatch
):
    wanted, round_ = 0.3 * np.random.default_rng(0).normal(size=16), 16**3
    left = list[float]()
    for rounds in (0, 2, 12, 99):
        monkeypatch.setattr("solver.brush.balance.MOST_WORK", round_ * (rounds + 1) - 1)
        found = balance(influence, np.arange(8), 1.0).strengths(wanted)
        assert sizes(found).max() <= 1 + 1e-9
        left.append(float(np.linalg.norm(wanted - influence @ found)))
    assert left[0] > left[1] > left[2] == left[3]


def test_pushes_that_lie_on_one_another_do_no_more_together_than_one_may():
    """Forty narrow ones against forty wide ones, which hardly move the points, would do so all the more beside them."""
    grid, places = Grid(32, 32), np.concatenate([np.full((40, 2), 0.4), [[0.55, 0.4]]])
    pushes = Pushes(grid, np.concatenate([places, places]), np.repeat([0.2, 0.6], 41))
    influence, bounds = pushes.influence(places).reshape(82, 164), np.repeat([1.0, 3.0], 41)
    each = np.zeros(82, int), np.zeros(164, int)
    found = Balance(influence, np.full(82, 1e-4), np.ones(164), each, bounds, narrow=41).strengths(
        np.random.default_rng(1).normal(size=82) * 100
    )
    assert sizes(found).max() <= 3
    for kind, bound in ((slice(0, 82), 1.0), (slice(82, 164), 3.0)):
        assert sizes(influence[:, kind] @ found[kind]).max() <= bound + 1e-9


@pytest.mark.parametrize("rings", [0, 1])
def test_wide_pushes_on_one_another_keep_the_bound_of_one_together(rings: int):
    """Also where rings turn, whose turns have no bound."""
    influence = np.zeros((2 + rings, 8 + rings))
    influence[:2, :8] = np.tile(np.eye(2), 4)  # a narrow push, and three wide ones, all at the one place
    influence[2:, 8:] = 1.0
    shares = np.concatenate([np.full(2, 1e-9), np.ones(6 + rings)])
    owners = np.zeros(2 + rings), np.zeros(8 + rings)
    weighed = Balance(influence, np.full(2 + rings, 1e-9), shares, owners, np.ones(4), narrow=1)
    found = weighed.strengths(np.array([6.0, 0.0, 0.5][: 2 + rings]))
    np.testing.assert_allclose(found[2:8], np.tile([1 / 3, 0], 3), atol=1e-6)


@pytest.mark.parametrize("strongest", range(3))
def test_wide_pushes_on_one_another_may_do_as_much_as_the_strongest_of_them(strongest: int):
    """Each within its own bound: those of two moderate handles beside that of a strong one."""
    influence = np.tile(np.eye(2), 4)  # a narrow push, and three wide ones, all at the one place
    shares, owners = np.array([1e-9] * 2 + [1.0] * 6), (np.zeros(2), np.zeros(8))
    bounds = np.array([1.0, 1.0, 1.0, 1.0])
    bounds[1 + strongest] = 2.0
    found = Balance(influence, np.full(2, 1e-9), shares, owners, bounds, narrow=1).strengths(np.array([9.0, 0.0]))
    assert sizes(found[2:8].reshape(3, 2).sum(axis=0)).max() == pytest.approx(2, abs=1e-6)
    assert (sizes(found[2:8]) <= bounds[1:] + 1e-6).all()

"""Outlines of masks: where they run, where they begin, and what is told of masks that have none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from app.errors import UserError
from app.media.outlines import read_outlines
from app.media.pictures import write_picture
from app.model.picture import Picture

SIZE = 160, 120
X, Y = np.meshgrid(np.arange(SIZE[0]) + 0.5, np.arange(SIZE[1]) + 0.5)


def mask(path: Path, inside: np.ndarray) -> Path:
    write_picture(path, Picture(np.repeat(np.where(inside, 255, 0).astype(np.uint8)[..., None], 3, axis=2)))
    return path


def disc(x: float, y: float, radius: float) -> np.ndarray:
    return np.hypot(X - x, Y - y) < radius


def test_the_outline_of_a_disc_is_its_circle_gone_round_clockwise_and_evenly(tmp_path: Path) -> None:
    found, notices = read_outlines(
        mask(tmp_path / "a.png", disc(60, 50, 30)), mask(tmp_path / "b.png", disc(90, 70, 40)), SIZE
    )
    assert notices == []
    assert len(found) == 20  # 251 pixels, 12.8 apart
    for side, (x, y, radius) in enumerate([(60, 50, 30), (90, 70, 40)]):
        from_middle = found[:, side] - (x, y)
        np.testing.assert_allclose(np.hypot(*from_middle.T), radius, atol=0.3)
        angles = np.unwrap(np.arctan2(from_middle[:, 1], from_middle[:, 0]))
        np.testing.assert_allclose(np.diff(angles), 2 * np.pi / 20, atol=0.02)  # y is down: larger is clockwise


def test_both_begin_where_their_points_correspond(tmp_path: Path) -> None:
    bar = (np.abs(X - 60) < 30) & (np.abs(Y - 60) < 10)
    found, _ = read_outlines(
        mask(tmp_path / "a.png", bar), mask(tmp_path / "b.png", np.roll(bar, (7, 31), (0, 1))), SIZE
    )
    np.testing.assert_allclose(found[:, 1] - found[:, 0], np.broadcast_to([31, 7], (len(found), 2)), atol=0.2)


def test_a_mask_of_another_size_is_stretched_to_the_picture_s(tmp_path: Path) -> None:
    large = np.kron(disc(60, 50, 30), np.ones((2, 2), bool))
    found, _ = read_outlines(mask(tmp_path / "a.png", disc(60, 50, 30)), mask(tmp_path / "b.png", large), SIZE)
    np.testing.assert_allclose(found[:, 1], found[:, 0], atol=0.4)


def test_an_outline_at_the_picture_s_edge_runs_along_it(tmp_path: Path) -> None:
    half, whole = mask(tmp_path / "a.png", X < 80), mask(tmp_path / "b.png", disc(80, 60, 50))
    found, _ = read_outlines(half, whole, SIZE)
    assert found.min() >= 0
    assert np.isclose(found[:, 0, 0], 0, atol=0.1).any()
    assert np.isclose(found[:, 0, 0], 80, atol=0.1).any()


def test_of_several_parts_the_largest_counts_and_no_hole(tmp_path: Path) -> None:
    parts = (disc(60, 60, 30) & ~disc(60, 60, 10)) | disc(130, 30, 12)
    found, notices = read_outlines(mask(tmp_path / "a.png", parts), mask(tmp_path / "b.png", disc(60, 60, 30)), SIZE)
    assert notices == [f"{tmp_path / 'a.png'} has 2 parts; the largest is fitted"]
    np.testing.assert_allclose(found[:, 1], found[:, 0], atol=0.2)


@pytest.mark.parametrize(
    ("inside", "said"),
    [
        (X < 0, "nothing of it is brighter than grey"),
        (X > 0, "all of it is brighter than grey"),
        ((np.abs(X - 20) < 1) & (np.abs(Y - 20) < 1), "only specks"),
    ],
    ids=["nothing", "all", "specks"],
)
def test_a_mask_without_an_outline_is_told_by_its_name(tmp_path: Path, inside: np.ndarray, said: str) -> None:
    good, bad = mask(tmp_path / "a.png", disc(60, 50, 30)), mask(tmp_path / "b.png", inside)
    with pytest.raises(UserError, match=rf"b.png has no outline: .*{said}"):
        read_outlines(good, bad, SIZE)

"""A subject in a rough box, found in pictures of which it is known where it is."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from app.errors import UserError
from app.model.areas import Area
from app.model.picture import Picture
from app.work.subject import subject_outline
from solver.grid import Grid


class NoPictures:
    def load(self, name: str, frame: int = 0) -> Picture:
        raise AssertionError(name)

    def notice(self, text: str) -> None:
        raise AssertionError(text)


def scene(hole: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """A reddish blob before something greenish, with grain, and where it is."""
    y, x = np.mgrid[0:150, 0:200]
    inside = ((x - 110) / 40) ** 2 + ((y - 70) / 50) ** 2 < 1
    if hole:
        inside &= (x - 110) ** 2 + (y - 70) ** 2 > 18**2
    colours = np.where(inside[..., None], (190, 70, 60), (60, 120, 80)).astype(float)
    colours += np.random.default_rng(1).normal(0, 12, colours.shape)
    return np.clip(colours, 0, 255).astype(np.uint8), inside


@pytest.mark.parametrize("hole", [False, True])
def test_a_subject_is_found_in_a_rough_box(hole: bool) -> None:
    colours, inside = scene(hole)
    outline = subject_outline(colours, (0.25, 0.05, 0.85, 0.9))
    found = Area(outline=outline).coverage(Grid(200, 150), NoPictures()) > 0.5
    assert (found & inside).sum() / (found | inside).sum() > 0.97
    assert subject_outline(colours, (0.25, 0.05, 0.85, 0.9)) == outline
    assert len(outline) < 400


@pytest.mark.parametrize("times", [1, 4])
def test_the_outline_is_not_beside_the_subject(times: int) -> None:
    """Also in a picture of more pixels than it is looked for in: by the middle, to a twentieth of a pixel."""
    colours, inside = (each.repeat(times, 0).repeat(times, 1) for each in scene())
    outline = subject_outline(colours, (0.25, 0.05, 0.85, 0.9))
    found = Area(outline=outline).coverage(Grid(*inside.shape[::-1]), NoPictures())
    y, x = np.indices(inside.shape)
    for places in (x, y):
        off = np.average(places, weights=found) - np.average(places, weights=inside)
        assert abs(off) < 0.05 * times
    assert found.sum() == pytest.approx(inside.sum(), rel=0.01)


def test_where_no_subject_is_and_without_opencv_it_is_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    plain = np.full((100, 100, 3), 90, np.uint8)
    for box in ((0.2, 0.2, 0.8, 0.8), (0.0, 0.0, 1.0, 1.0), (0.5, 0.5, 0.51, 0.51)):
        with pytest.raises(UserError, match="No subject"):
            subject_outline(plain, box)
    monkeypatch.setitem(sys.modules, "cv2", None)
    with pytest.raises(UserError, match="opencv-python-headless"):
        subject_outline(scene()[0], (0.2, 0.2, 0.8, 0.8))

"""Zoom and pan."""

from __future__ import annotations

import pytest

from app.ui.viewport import MOST_ZOOM, Rect, Viewport

VIEW = Viewport(Rect(48, 48, 960, 700), (600, 400))


@pytest.mark.parametrize("view", [VIEW, VIEW.zoomed(3, 200, 300), VIEW.zoomed(0.5, 500, 90).panned(40, -30)])
def test_there_and_back(view: Viewport) -> None:
    assert view.to_picture(*view.to_screen(0.3, 0.8)) == pytest.approx((0.3, 0.8))


def test_the_whole_picture_fits() -> None:
    rect = VIEW.rect
    assert VIEW.canvas.contains(rect.x, rect.y)
    assert VIEW.canvas.contains(rect.right - 1, rect.bottom - 1)
    assert rect.width / rect.height == pytest.approx(1.5, abs=0.01)


@pytest.mark.parametrize("density", [1.0, 2.0])
def test_a_small_picture_is_seen_at_four_hundred_percent_at_most(density: float) -> None:
    assert Viewport(VIEW.canvas, (30, 20), density).fit_zoom == 4.0 * density


@pytest.mark.parametrize("zoom", [0.2, 1, 7, 64])
def test_zooming_keeps_the_place_under_the_pointer(zoom: float) -> None:
    place = VIEW.to_picture(333, 222)
    assert VIEW.zoomed(zoom, 333, 222).to_picture(333, 222) == pytest.approx(place)


def test_a_hundred_percent_is_a_pixel_a_pixel_at_every_density() -> None:
    for density in (1.0, 2.0):
        view = Viewport(Rect(0, 0, 500, 500), (600, 400), density).zoomed(1.0, 250, 250)
        assert view.rect.width * density == pytest.approx(600)
        assert view.percent == pytest.approx(100)


def test_steps_go_up_and_down_and_end() -> None:
    view = VIEW.zoomed(1, 500, 400)
    assert view.stepped(True, 500, 400).zoom == 1.5
    assert view.stepped(False, 500, 400).zoom == pytest.approx(2 / 3)
    for _ in range(40):
        view = view.stepped(True, 500, 400)
    assert view.zoom == MOST_ZOOM


def test_the_picture_cannot_be_lost() -> None:
    far = VIEW.zoomed(2, 500, 400).panned(1e6, -1e6)
    rect = far.rect
    assert rect.x < far.canvas.right
    assert rect.bottom > far.canvas.y
    assert far.fitted() == VIEW

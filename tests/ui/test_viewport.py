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


def test_every_step_of_the_zoom() -> None:
    view, seen = VIEW.zoomed(1 / 16, 500, 400), [1 / 16]
    while (view := view.stepped(True, 500, 400)).zoom != seen[-1]:
        seen.append(view.zoom or 0)
    wanted = [1 / 16, 1 / 12, 1 / 8, 1 / 6, 1 / 4, 1 / 3, 1 / 2, 2 / 3, 1, 1.5, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64]
    assert seen == pytest.approx(wanted)


def test_around_a_picture_that_fits_there_is_air() -> None:
    """24 points, or a twenty-fifth of the canvas's shorter side."""
    assert Viewport(Rect(0, 0, 1000, 700), (1000, 100)).fit_zoom == pytest.approx(0.952)
    assert Viewport(Rect(0, 0, 1000, 200), (100, 1000)).fit_zoom == pytest.approx(0.184)


def test_a_rectangle_has_its_middle_and_its_first_edges_only() -> None:
    rect = Rect(10, 20, 30, 40)
    assert (rect.middle, rect.right, rect.bottom) == ((25, 40), 40, 60)
    assert [rect.contains(*at) for at in ((10, 20), (39.9, 59.9), (40, 30), (20, 60), (9.9, 30))] == [
        True,
        True,
    ] + 3 * [False]


def test_how_far_out_one_may_zoom_and_pan() -> None:
    """Not beyond 2 %, or what fits; the picture's middle stays within 40 % of the canvas beside it."""
    assert VIEW.zoomed(0.001, 500, 400).zoom == 0.02
    assert Viewport(VIEW.canvas, (600_000, 400)).zoomed(1e-9, 500, 400).zoom == pytest.approx(912 / 600_000)
    far = VIEW.zoomed(1, 500, 400).panned(1e6, 0)
    assert far.centre[0] == pytest.approx(-0.4 * 480 / 600)

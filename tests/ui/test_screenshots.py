"""The pictures of the window are made of what they are to show."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from app.model.mask_edits import MaskStroke
from app.ui import screenshots
from app.ui.events import Move
from solver.gl.device import Device


def test_the_picture_of_the_overlays_shows_them_while_a_stroke_goes_by(
    device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(screenshots, "SIZE", (800, 500))
    offscreen = screenshots.OffscreenEditor(device, grid=24)
    try:
        seen = screenshots.overlays(offscreen)
        state, session = offscreen.editor.state, offscreen.editor.session
        assert seen.shape == (500, 800, 3)
        assert [name for name, overlay in state.overlays.items() if overlay.shown] == ["grid", "frozen", "velocity"]
        (frozen,), (push,) = session.recipe.mask, session.recipe.stroke
        assert isinstance(frozen, MaskStroke)
        assert (frozen.tool, push.tool) == ("freeze", "push")
        assert session.is_painting
        assert session.recipe.fluid.grid == 24
        for stroke, start in ((frozen, (0.67, 0.37)), (push, (0.42, 0.62))):
            assert stroke.samples[0][1:3] == pytest.approx(start, abs=0.005)
        # A picture is of what is so now, and not of the frame before.
        offscreen.editor.preferences.theme = "light"
        assert np.abs(offscreen.picture().astype(int) - seen)[:20].mean() > 50
    finally:
        offscreen.close()


def test_the_picture_of_before_and_after_shows_no_brush(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor is anything else of the canvas another one once the pointer has left the window, which is light."""
    monkeypatch.setattr(screenshots, "SIZE", (800, 500))
    offscreen = screenshots.OffscreenEditor(device, grid=24)
    try:
        seen = screenshots.compare(offscreen)
        state, rect = offscreen.editor.state, offscreen.editor.view.rect
        assert (offscreen.editor.preferences.theme, state.split) == ("light", 0.425)
        assert seen[:20].mean() > 150
        offscreen.frame(Move(-1e4, -1e4))
        canvas = slice(int(rect.y) + 1, int(rect.y + rect.height)), slice(int(rect.x) + 1, int(rect.x + rect.width))
        np.testing.assert_array_equal(offscreen.picture()[canvas], seen[canvas])
    finally:
        offscreen.close()


def test_the_film_of_a_stroke_goes_the_way_of_the_stroke_at_half_the_size(
    device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(screenshots, "SIZE", (642, 401))
    offscreen = screenshots.OffscreenEditor(device, grid=24)
    try:
        way = screenshots.line((0.2, 0.3), (0.4, 0.7), 0.1)
        for part, place in ((0.0, (0.2, 0.3)), (0.5, (0.3, 0.6)), (1.0, (0.4, 0.7))):
            assert way(part) == pytest.approx(place)
        offscreen.stroke(way, 5)
        screenshots.film(offscreen, tmp_path / "film.webp")
        drawn, filmed = offscreen.editor.session.recipe.stroke
        for stroke, ends in ((drawn, ((0.2, 0.3), (0.4, 0.7))), (filmed, ((0.50, 0.52), (0.64, 0.44)))):
            assert [stroke.samples[k][1:3] for k in (0, -1)] == [pytest.approx(end, abs=0.005) for end in ends]
        with Image.open(tmp_path / "film.webp") as film:
            assert film.size == (321, 200)
            assert getattr(film, "n_frames", 1) > 20  # those that are alike are one
    finally:
        offscreen.close()

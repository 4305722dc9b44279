"""The pictures of the window are made of what they are to show."""

from __future__ import annotations

import pytest

from app.model.mask_edits import MaskStroke
from app.ui import screenshots
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
    finally:
        offscreen.close()

"""The parts of the window around the picture, each a function of the state."""

from __future__ import annotations

from typing import TYPE_CHECKING

from app.ui.panels import bar, hud, inspector, strip, timebar
from app.ui.widgets import Ui

if TYPE_CHECKING:
    from app.ui.editor import Editor


def draw(ui: Ui, editor: Editor) -> None:
    """Draw all panels."""
    hud.draw(ui, editor)
    strip.draw(ui, editor)
    inspector.draw(ui, editor)
    timebar.draw(ui, editor)
    bar.draw(ui, editor)

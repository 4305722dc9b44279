"""Where the panels are: the picture in the middle, and what serves it around it."""

from __future__ import annotations

from dataclasses import dataclass

from app.ui.viewport import Rect

BAR, STRIP, INSPECTOR, TIMEBAR = 48.0, 48.0, 272.0, 56.0


@dataclass(frozen=True)
class Layout:
    """The rectangles of the window's parts, in points."""

    bar: Rect
    strip: Rect
    inspector: Rect | None
    timebar: Rect
    canvas: Rect

    @classmethod
    def of(cls, width: float, height: float, scale: float, inspector: bool) -> Layout:
        bar, strip, time = BAR * scale, STRIP * scale, TIMEBAR * scale
        side = INSPECTOR * scale if inspector and width > 860 * scale else 0.0
        middle = max(height - bar - time, 1.0)
        return cls(
            bar=Rect(0, 0, width, bar),
            strip=Rect(0, bar, strip, middle),
            inspector=Rect(width - side, bar, side, middle) if side else None,
            timebar=Rect(0, height - time, width, time),
            canvas=Rect(strip, bar, max(width - strip - side, 1.0), middle),
        )

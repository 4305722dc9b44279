"""Where the panels are: the picture in the middle, and what serves it around it."""

from __future__ import annotations

from dataclasses import dataclass

from app.ui.viewport import Rect

BAR, STRIP, INSPECTOR, TIMEBAR = 48.0, 48.0, 272.0, 56.0
# Of the lanes as they come, at least and at most, and the part that they take at most of the room above the timeline.
LANES, LEAST_LANES, TALLEST_LANES, MOST_LANES = 156.0, 76.0, 1200.0, 0.5
# In a window narrower than this the inspector would leave the picture too little; it comes when it is asked for.
NARROW = 720.0
LEAST = 120.0  # of the canvas's width; where there is less, the tools make room
NAMED, LEAST_NAMED = 134.0, 360.0  # of a tool's width with its name beside it, and of the canvas's then
TOOL, BETWEEN, GROUP = 40.0, 4.0, 10.0  # heights in the strip: of a tool, between two, and more between two groups


@dataclass(frozen=True)
class Layout:
    """The rectangles of the window's parts, in points.

    Attributes:
        columns, tool: of the strip, and how wide a tool is in it, in points of the design.
    """

    bar: Rect
    strip: Rect | None
    inspector: Rect | None
    timebar: Rect
    lanes: Rect | None
    canvas: Rect
    columns: int
    tool: float

    @classmethod
    def of(
        cls,
        width: float,
        height: float,
        scale: float,
        inspector: bool,
        tools: int,
        groups: int,
        names: bool = False,
        lanes: float = 0.0,
    ) -> Layout:
        """The layout of a window.

        Args:
            width, height: of the window, in points.
            scale: of the interface.
            inspector: it is open.
            tools, groups: how many tools there are, and groups of them.
            names: the tools' names stand beside their icons, if there is room.
            lanes: their height, in points of the design, where there is room; 0 if they are folded away.
        """
        bar, time = BAR * scale, TIMEBAR * scale
        middle = max(height - bar - time, 1.0)
        below = min(lanes * scale, MOST_LANES * middle)
        middle = max(middle - below, 1.0)
        columns = _columns(middle / scale, tools, groups)
        tool = NAMED if names else TOOL
        if width - (_strip(columns, tool) + INSPECTOR * inspector) * scale < LEAST_NAMED * scale:
            tool = TOOL
        strip = _strip(columns, tool) * scale
        if width - strip - (INSPECTOR * scale if inspector else 0.0) < LEAST * scale:
            strip = 0.0
        side = min(INSPECTOR * scale, width - strip) if inspector else 0.0
        return cls(
            columns=columns,
            tool=tool,
            bar=Rect(0, 0, width, bar),
            strip=Rect(0, bar, strip, middle) if strip else None,
            inspector=Rect(width - side, bar, side, middle) if side else None,
            timebar=Rect(0, height - time, width, time),
            lanes=Rect(0, height - time - below, width, below) if below else None,
            canvas=Rect(strip, bar, max(width - strip - side, 1.0), middle),
        )


def _strip(columns: int, tool: float) -> float:
    """The strip's width."""
    return STRIP - TOOL + columns * tool + (columns - 1) * BETWEEN


def _columns(height: float, tools: int, groups: int) -> int:
    """Into how many columns the tools go so that all are seen; one if they fit below each other."""
    room = height - 16
    if tools * (TOOL + BETWEEN) - BETWEEN + (groups - 1) * GROUP <= room:
        return 1
    rows = max(int((room + BETWEEN) / (TOOL + BETWEEN)), 1)
    return max(-(-tools // rows), 2)

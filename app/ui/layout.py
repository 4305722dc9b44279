"""Where the panels are: the picture in the middle, and what serves it around it."""

from __future__ import annotations

from dataclasses import dataclass

from app.ui.viewport import Rect

BAR, STRIP, INSPECTOR, TIMEBAR = 48.0, 48.0, 272.0, 56.0
# Of the lanes as they come, at least and at most, and the part that they take at most of the room above the timeline.
LANES, LEAST_LANES, TALLEST_LANES, MOST_LANES = 156.0, 76.0, 1200.0, 0.5
# In a window narrower than this the inspector would leave the picture too little; it comes when it is asked for.
NARROW = 720.0
LEAST = 120.0  # of the canvas's width, beside tools and inspector
MOST_TOOLS = 0.5  # of the width beside the inspector; tools that need more are scrolled
SCROLLBAR = 10.0
NAMED, LEAST_NAMED = 134.0, 360.0  # of a tool's width with its name beside it, and of the canvas's then
TOOL, BETWEEN, GROUP = 40.0, 4.0, 10.0  # heights in the strip: of a tool, between two, and more between two groups


@dataclass(frozen=True)
class Layout:
    """The rectangles of the window's parts, in points.

    Attributes:
        columns, tool: of the strip, and how wide a tool is in it, in points of the design.
    """

    bar: Rect
    strip: Rect
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
        beside = width / scale - INSPECTOR * inspector
        most = int((MOST_TOOLS * beside - STRIP + TOOL + BETWEEN) / (TOOL + BETWEEN))
        columns = max(min(_columns(middle / scale, tools, groups), most), 1)
        scrolls = _height(columns, tools, groups) > middle / scale
        tool = NAMED if names and beside - _strip(columns, NAMED, scrolls) >= LEAST_NAMED else TOOL
        strip = _strip(columns, tool, scrolls) * scale
        side = min(INSPECTOR * scale, max(width - strip - LEAST * scale, 0.0)) if inspector else 0.0
        return cls(
            columns=columns,
            tool=tool,
            bar=Rect(0, 0, width, bar),
            strip=Rect(0, bar, strip, middle),
            inspector=Rect(width - side, bar, side, middle) if side else None,
            timebar=Rect(0, height - time, width, time),
            lanes=Rect(0, height - time - below, width, below) if below else None,
            canvas=Rect(strip, bar, max(width - strip - side, 1.0), middle),
        )


def _strip(columns: int, tool: float, scrolls: bool) -> float:
    """The strip's width."""
    return STRIP - TOOL + columns * tool + (columns - 1) * BETWEEN + SCROLLBAR * scrolls


def _height(columns: int, tools: int, groups: int) -> float:
    """Of the strip, if all tools are to be seen in so many columns; only one column has gaps between groups."""
    return 16 + -(-tools // columns) * (TOOL + BETWEEN) - BETWEEN + (groups - 1) * GROUP * (columns == 1)


def _columns(height: float, tools: int, groups: int) -> int:
    """Into how many columns the tools go so that all are seen; one if they fit below each other."""
    return next((columns for columns in range(1, tools) if _height(columns, tools, groups) <= height), tools)

"""Icons as lines on a square of 24 points, drawn by the interface itself: sharp at every scale, in every colour."""

from __future__ import annotations

import math
import re
from functools import cache, lru_cache
from typing import Any

from imgui_bundle import imgui

Points = list[tuple[float, float]]

# M x y, L x y: move, line. A cx cy r from to: an arc in degrees, clockwise from three o'clock, joined to what came
# before it. C cx cy r: a circle of its own. D cx cy r: a filled dot. Z closes. Q cx cy x y: a quadratic curve.
PATHS = {
    "push": "M3 17 Q8 17 10.5 13.5 Q13 10 19 10 M15.2 6 L19.4 10 L15.2 14 M3 11 Q6.5 11 8.2 8.2 M3 21.5 Q13 21.5 15 18",
    "curve": "M4 19 Q5 6 12 12 Q19 18 19.5 5.5 M16 8.4 L19.6 4.6 L22 9.2 D4 19 1.7",
    "twirl": "M12 12 A12.6 12.4 2 200 380 A12 12 4.6 0 180 A12.9 12 5.5 180 330 A12 12.4 8.4 -24 130",
    "bloat": "C12 12 4 M12 5.5 L12 1.8 M12 18.5 L12 22.2 M5.5 12 L1.8 12 M18.5 12 L22.2 12 M7.4 7.4 L4.8 4.8"
    " M16.6 7.4 L19.2 4.8 M7.4 16.6 L4.8 19.2 M16.6 16.6 L19.2 19.2",
    "pinch": "D12 12 1.8 M12 2 L12 7.4 M9.6 5 L12 7.4 L14.4 5 M12 22 L12 16.6 M9.6 19 L12 16.6 L14.4 19"
    " M2 12 L7.4 12 M5 9.6 L7.4 12 L5 14.4 M22 12 L16.6 12 M19 9.6 L16.6 12 L19 14.4",
    "handle": "C6.5 17.5 3.4 D6.5 17.5 1.3 M9.2 14.8 L18 6 M11.6 5.2 L18.8 5.2 L18.8 12.4",
    "thicken": "M12 3 Q18.5 11 18.5 15 A12 15 6.5 0 180 Q5.5 11 12 3 Z M9 15.5 A12 15.5 3 180 90",
    "freeze": "M12 2.5 L12 21.5 M3.8 7.2 L20.2 16.8 M20.2 7.2 L3.8 16.8 M9.6 4.6 L12 6.8 L14.4 4.6"
    " M9.6 19.4 L12 17.2 L14.4 19.4 M4.3 10.5 L7.5 9.4 L6.9 6 M19.7 10.5 L16.5 9.4 L17.1 6"
    " M4.3 13.5 L7.5 14.6 L6.9 18 M19.7 13.5 L16.5 14.6 L17.1 18",
    "smooth": "M2.5 9 Q5 4.5 7.5 9 Q10 13.5 12.5 9 Q15 4.5 17.5 9 Q19.3 12.3 21.5 10 M2.5 17 Q12 14 21.5 17",
    "select": "M4 8 L4 4 L8 4 M11 4 L13 4 M16 4 L20 4 L20 8 M20 11 L20 13 M20 16 L20 20 L16 20 M13 20 L11 20 M8 20"
    " L4 20 L4 16 M4 13 L4 11",
    "restore": "A12.5 12.5 8 200 490 M3.4 4.6 L4.6 9.9 L9.9 8.7 M12.5 8 L12.5 13 L16 15",
    "pan": "M12 3 L12 21 M3 12 L21 12 M9.4 5.6 L12 3 L14.6 5.6 M9.4 18.4 L12 21 L14.6 18.4"
    " M5.6 9.4 L3 12 L5.6 14.6 M18.4 9.4 L21 12 L18.4 14.6",
    "zoom": "C10.5 10.5 6.5 M15.3 15.3 L21 21 M10.5 7.8 L10.5 13.2 M7.8 10.5 L13.2 10.5",
    "menu": "M4 7 L20 7 M4 12 L20 12 M4 17 L20 17",
    "undo": "M8.5 4.5 L4 9 L8.5 13.5 M4 9 L14 9 A14 14 5 -90 90 L10 19",
    "redo": "M15.5 4.5 L20 9 L15.5 13.5 M20 9 L10 9 A10 14 5 270 90 L14 19",
    "compare": "M4 5 L20 5 L20 19 L4 19 Z M12 2.5 L12 21.5 M7 12 L9 12 M15 9 L17 9 M15 12 L17 12 M15 15 L17 15",
    "inspector": "M4 5 L20 5 L20 19 L4 19 Z M14.5 5 L14.5 19 M17 9 L17.5 9 M17 12 L17.5 12",
    "export": "M12 15.5 L12 3.5 M7.5 8 L12 3.5 L16.5 8 M4 14 L4 20 L20 20 L20 14",
    "play": "M8 5 L19 12 L8 19 Z",
    "pause": "M8.5 5 L8.5 19 M15.5 5 L15.5 19",
    "step": "M6 5 L15 12 L6 19 Z M18.5 5 L18.5 19",
    "once": "M4 12 L19 12 M14.5 7 L19.5 12 L14.5 17",
    "loop": "M7 6.5 L16 6.5 A16 11 4.5 -90 0 M13.5 3.5 L16.8 6.5 L13.5 9.5 M17 17.5 L8 17.5 A8 13 4.5 90 180"
    " M10.5 14.5 L7.2 17.5 L10.5 20.5",
    "returns": "M3.5 8 L20 8 M15.5 3.5 L20.5 8 L15.5 12.5 M20.5 16 L4 16 M8.5 11.5 L3.5 16 L8.5 20.5",
    "lanes": "M3 6 L13 6 M8 12 L21 12 M3 18 L9 18 M14 18 L20 18",
    "together": "M5 3 L5 21 M9 8 L16 8 M9 16 L20 16",
    "mute": "M3.5 9.5 L7.5 9.5 L12.5 5 L12.5 19 L7.5 14.5 L3.5 14.5 Z M16 9.5 L21 14.5 M21 9.5 L16 14.5",
    "trash": "M4 6.5 L20 6.5 M9 6.5 L9.5 3.5 L14.5 3.5 L15 6.5 M6 6.5 L7 20.5 L17 20.5 L18 6.5 M10 10.5 L10.3 16.5"
    " M14 10.5 L13.7 16.5",
    "force": "M3 7 L15 7 M11.5 3.5 L15 7 L11.5 10.5 M8 16.5 L20 16.5 M16.5 13 L20 16.5 L16.5 20",
    "back": "M18 5 L9 12 L18 19 Z M5.5 5 L5.5 19",
    "stop_motion": "M3 8 L14 8 A14 5.6 2.4 90 -120 M3 12 L18.4 12 A18.4 14.5 2.5 -90 150 M3 16 L10 16 M16.4 18.4 L21 23"
    " M21 18.4 L16.4 23",
    "reset": "M4 4 L20 4 L20 20 L4 20 Z M4 12 L20 12 M12 4 L12 20",
    "close": "M6 6 L18 18 M18 6 L6 18",
    "sliders": "M3 7.5 L6.5 7.5 M11.5 7.5 L21 7.5 C9 7.5 2.5 M3 16.5 L12.5 16.5 M17.5 16.5 L21 16.5 C15 16.5 2.5",
    "plus": "M12 5 L12 19 M5 12 L19 12",
    "minus": "M5 12 L19 12",
    "fit": "M4 9 L4 4 L9 4 M15 4 L20 4 L20 9 M20 15 L20 20 L15 20 M9 20 L4 20 L4 15",
    "folder": "M3 19 L3 5 L9.5 5 L11.5 7.5 L21 7.5 L21 19 Z",
    "file": "M6 3 L14 3 L18.5 7.5 L18.5 21 L6 21 Z M13.5 3 L13.5 8 L18.5 8",
    "picture": "M3.5 5 L20.5 5 L20.5 19 L3.5 19 Z M3.5 16 L9 11 L14 16.5 L16.5 14 L20.5 18 C15.5 9.5 1.6",
    "warn": "M12 4 L21.5 20 L2.5 20 Z M12 10 L12 14.5 D12 17.2 1",
    "info": "C12 12 9 M12 11 L12 16.5 D12 7.8 1.1",
    "check": "M5 12.5 L10 17.5 L19.5 7",
    "chevron_down": "M6 9.5 L12 15.5 L18 9.5",
    "chevron_right": "M9.5 6 L15.5 12 L9.5 18",
    "up": "M12 19 L12 5 M6 11 L12 5 L18 11",
    "keyboard": "M2.5 6 L21.5 6 L21.5 18 L2.5 18 Z M6 10 L6.5 10 M10 10 L10.5 10 M14 10 L14.5 10 M18 10 L18.4 10"
    " M7.5 14.2 L16.5 14.2",
    "save": "M4 4 L16.5 4 L20 7.5 L20 20 L4 20 Z M8 4 L8 9 L15 9 L15 4 M7.5 20 L7.5 14 L16.5 14 L16.5 20",
}
FILLED = {"play"}


@cache
def _shape(name: str) -> tuple[list[tuple[Points, bool]], list[tuple[float, float, float]]]:
    """The lines of an icon, each with whether it is closed, and its dots."""
    lines: list[tuple[Points, bool]] = []
    dots: list[tuple[float, float, float]] = []
    here: Points = []

    def finish(closed: bool = False) -> None:
        nonlocal here
        if len(here) > 1:
            lines.append((here, closed))
        here = []

    for command, text in re.findall(r"([A-Z])([^A-Z]*)", PATHS[name]):
        numbers = [float(number) for number in text.split()]
        match command:
            case "M":
                finish()
                here = [(numbers[0], numbers[1])]
            case "L":
                here.append((numbers[0], numbers[1]))
            case "Q":
                (x0, y0), (x1, y1, x2, y2) = here[-1], numbers
                for k in range(1, 9):
                    t = k / 8
                    a, b, c = (1 - t) ** 2, 2 * t * (1 - t), t * t
                    here.append((a * x0 + b * x1 + c * x2, a * y0 + b * y1 + c * y2))
            case "A":
                x, y, radius, start, end = numbers
                here += _arc(x, y, radius, start, end)
            case "C":
                finish()
                x, y, radius = numbers
                lines.append((_arc(x, y, radius, 0, 360)[:-1], True))
            case "D":
                finish()
                dots.append((numbers[0], numbers[1], numbers[2]))
            case "Z":
                finish(closed=True)
    finish()
    return lines, dots


def _arc(x: float, y: float, radius: float, start: float, end: float) -> Points:
    count = max(4, int(abs(end - start) / 15))
    angles = (math.radians(start + (end - start) * k / count) for k in range(count + 1))
    return [(x + radius * math.cos(angle), y + radius * math.sin(angle)) for angle in angles]


def draw(
    target: imgui.ImDrawList, name: str, x: float, y: float, size: float, colour: int, weight: float = 1.6
) -> None:
    """Draw an icon into the square of `size` with its top left corner at (x, y)."""
    lines, dots = _placed(name, x, y, size)
    weight *= size / 24
    for places, closed in lines:
        if closed and name in FILLED:
            target.add_convex_poly_filled(places, colour)
        target.add_polyline(places, colour, weight, int(imgui.ImDrawFlags_.closed) if closed else 0)
    for place, radius in dots:
        target.add_circle_filled(place, radius, colour)


@lru_cache(maxsize=512)
def _placed(
    name: str, x: float, y: float, size: float
) -> tuple[list[tuple[list[Any], bool]], list[tuple[imgui.ImVec2, float]]]:
    """The lines and dots of an icon on the screen: most are where they were a frame ago."""
    k = size / 24
    lines, dots = _shape(name)
    placed = [([imgui.ImVec2(x + px * k, y + py * k) for px, py in points], closed) for points, closed in lines]
    return placed, [(imgui.ImVec2(x + px * k, y + py * k), radius * k) for px, py, radius in dots]

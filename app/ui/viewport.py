"""Where the picture lies on the canvas: zoom and pan, and the ways between points of the screen and of the picture."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

MOST_ZOOM = 64.0
STEPS = (1 / 16, 1 / 12, 1 / 8, 1 / 6, 1 / 4, 1 / 3, 1 / 2, 2 / 3, 1, 1.5, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64)


@dataclass(frozen=True)
class Rect:
    """A rectangle of the screen: its top left corner and its size."""

    x: float
    y: float
    width: float
    height: float

    @property
    def right(self) -> float:
        return self.x + self.width

    @property
    def bottom(self) -> float:
        return self.y + self.height

    @property
    def middle(self) -> tuple[float, float]:
        return self.x + self.width / 2, self.y + self.height / 2

    def contains(self, x: float, y: float) -> bool:
        return self.x <= x < self.right and self.y <= y < self.bottom


@dataclass(frozen=True)
class Viewport:
    """The canvas on the screen and the picture on it; never changed, only replaced.

    Attributes:
        canvas: the rectangle of the canvas, in points.
        picture: (width, height) of the picture in pixels.
        density: pixels of the screen a point.
        zoom: pixels of the screen a pixel of the picture; None fits the picture into the canvas.
        centre: the place of the picture (fractions) in the middle of the canvas.
    """

    canvas: Rect
    picture: tuple[int, int]
    density: float = 1.0
    zoom: float | None = None
    centre: tuple[float, float] = (0.5, 0.5)

    @property
    def fit_zoom(self) -> float:
        """The zoom at which the whole picture is seen, with some air around it, and never above 400 %."""
        air = min(24.0, 0.04 * min(self.canvas.width, self.canvas.height))
        across = max(self.canvas.width - 2 * air, 16.0) / self.picture[0]
        down = max(self.canvas.height - 2 * air, 16.0) / self.picture[1]
        return min(across, down, 4.0) * self.density

    @property
    def scale(self) -> float:
        """Points of the screen a pixel of the picture."""
        return (self.zoom or self.fit_zoom) / self.density

    @property
    def percent(self) -> float:
        """The zoom as a person reads it."""
        return 100.0 * (self.zoom or self.fit_zoom)

    @cached_property
    def rect(self) -> Rect:
        """The whole picture on the screen, which may reach beyond the canvas."""
        width, height = self.picture[0] * self.scale, self.picture[1] * self.scale
        x = self.canvas.x + self.canvas.width / 2 - self.centre[0] * width
        y = self.canvas.y + self.canvas.height / 2 - self.centre[1] * height
        if self.zoom is None:
            x, y = round(x), round(y)
        return Rect(x, y, width, height)

    @property
    def drawn(self) -> Rect:
        """`rect`, moved to begin on a whole pixel of the screen: else at 100 % a pixel would be a mean of several."""
        rect = self.rect
        x, y = (round(side * self.density) / self.density for side in (rect.x, rect.y))
        return Rect(x, y, rect.width, rect.height)

    @property
    def longer(self) -> float:
        """Points of the screen along the picture's longer side."""
        return max(self.picture) * self.scale

    def to_picture(self, x: float, y: float) -> tuple[float, float]:
        """The place of the picture, as fractions, under a point of the screen."""
        rect = self.rect
        return (x - rect.x) / rect.width, (y - rect.y) / rect.height

    def to_screen(self, x: float, y: float) -> tuple[float, float]:
        """The point of the screen over a place of the picture."""
        rect = self.rect
        return rect.x + x * rect.width, rect.y + y * rect.height

    def zoomed(self, zoom: float, x: float, y: float) -> Viewport:
        """With another zoom, and the same place of the picture under the point (x, y) of the screen."""
        place = self.to_picture(x, y)
        zoom = min(max(zoom, min(self.fit_zoom, 0.02)), MOST_ZOOM)
        closer = replace(self, zoom=zoom)
        there = closer.to_screen(*place)
        return closer.panned(x - there[0], y - there[1])

    def stepped(self, up: bool, x: float, y: float) -> Viewport:
        """The next round zoom, in or out."""
        now = self.zoom or self.fit_zoom
        further = [step for step in STEPS if (step > now * 1.01 if up else step < now * 0.99)]
        return self.zoomed((further[0] if up else further[-1]) if further else now, x, y)

    def panned(self, dx: float, dy: float) -> Viewport:
        """Moved by points of the screen; the picture's middle half never leaves the canvas wholly."""
        rect = self.rect
        centre = self.centre[0] - dx / rect.width, self.centre[1] - dy / rect.height
        room = self.canvas.width / 2 / rect.width, self.canvas.height / 2 / rect.height
        x, y = (min(max(c, -0.4 * r), 1 + 0.4 * r) for c, r in zip(centre, room, strict=True))
        return replace(self, zoom=self.zoom or self.fit_zoom, centre=(x, y))

    def fitted(self) -> Viewport:
        """The whole picture again."""
        return replace(self, zoom=None, centre=(0.5, 0.5))

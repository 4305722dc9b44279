"""A gesture that is under way: what the hand does, tick by tick, and what the tool has made of it so far."""

from __future__ import annotations

from collections.abc import Iterator

from app.model.handles import RecipeHandle
from app.model.mask_edits import MaskStroke
from app.model.sampling import Point
from app.model.strokes import Stroke
from app.model.tools import LINE_SPEED, Made, Press, PulledString, Tool, Touch


class OpenGesture:
    """What is drawn between a press and a release.

    Args:
        tool: one that has a gesture.
        press, touch: what it starts from.
        extent: (width, height) of the picture, the longer of them 1.
        taken: the number of the handle in hand, if there was one where it was pressed.
        idles_at: where the playhead was sent back to, if a push that stays where it is does nothing there.

    Attributes:
        made: the stroke, or the handle; None as long as there is none.
        brush: as it was set when the gesture began, which it keeps.
        path: where it has been, as fractions of the picture.
        pen: the tick that it is recorded at: ahead of the simulation while strokes before it are still waiting. While a
            mask is painted in no time, it counts the hand's.
    """

    def __init__(
        self, tool: Tool, press: Press, touch: Touch, extent: Point, taken: int | None, idles_at: int | None
    ) -> None:
        assert tool.gesture is not None
        self.taken = taken
        self.idles_at = idles_at
        self.made: Made | None = None
        self.path = [touch[1:3]]
        self.pen = touch.tick
        self.brush = press.brush
        self._tool = tool
        self._first = self._touch = touch
        self._string = PulledString(press.string, extent, self.path[0])
        self._drawing = tool.gesture(press, touch)

    @property
    def ticks(self) -> int:
        """That it has taken so far."""
        return self.pen - self._first.tick

    def begin(self) -> None:
        """The pointer is down."""
        self.made = next(self._drawing)

    def move(self, x: float, y: float, pressure: float, shift: bool) -> None:
        """The pointer moved to (x, y), fractions of the picture."""
        self._touch_at(Touch(self.pen, *self._string.pull(*kept_near(x, y)), pressure, shift))

    def hold(self) -> bool:
        """A tick of the hand: the open stroke stays where the pointer is. True if that adds to it."""
        if isinstance(self.made, (Stroke, MaskStroke)) and self.made.last_tick >= self.pen:
            return False
        self._touch = self._touch._replace(tick=self.pen)
        self.made = self._drawing.send(self._touch)
        return True

    def catch_up(self, dt: float) -> Iterator[None]:
        """The brush comes to where the pen was lifted, as calmly as a straight stroke is drawn: tick by tick."""
        for place in self._string.catch_up(LINE_SPEED * dt):
            self._touch_at(Touch(self.pen, *place, *self._touch[3:]))
            yield
            self.pen += 1

    def end(self) -> Made | None:
        """The pointer went up: what is made of it."""
        try:
            self._drawing.send(None)
        except StopIteration as finished:
            self.made = finished.value
        return self.made

    def label_of(self, made: Made) -> str:
        """What the history calls what it has made."""
        if isinstance(made, RecipeHandle):
            if self.taken is not None:
                return "Lead on"
            return "Line" if made.points else "Handle" if made.keys else "Pin"
        if (self._tool.directions and self._tool.masks) or made.tool in ("bloat", "pinch"):
            return made.tool.capitalize()
        return self._tool.label

    def _touch_at(self, touch: Touch) -> None:
        self._touch = touch
        self.path.append(touch[1:3])
        self.made = self._drawing.send(touch)


def kept_near(x: float, y: float) -> Point:
    """Places are kept within half a picture of it, and with as many digits as a recipe needs."""
    return round(min(max(x, -0.5), 1.5), 5), round(min(max(y, -0.5), 1.5), 5)

"""The tools: how the samples of a pointer become a stroke, one small tool each."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from copy import copy
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, hypot
from typing import Any, NamedTuple

from app.model.handles import RecipeHandle
from app.model.mask_edits import MaskStroke
from app.model.sampling import Point
from app.model.strokes import BrushPath, Stroke, Symmetry, ToolName
from app.model.windows import FLOWING

FASTEST = 2.0  # longer sides per second that a brush can follow
LEAST_STEP = 1e-5  # longer sides: the last digit of places as fractions of the picture
LINE_SPEED = 0.8  # longer sides per second at which a stroke is drawn that was only clicked
DRAWN = 0.004  # longer sides between places of a path that is drawn
MOST_CORNERS = 200  # of a line that is drawn
CLOSED = 0.1  # of its length: a line that ends as near to where it began is closed


class Touch(NamedTuple):
    """The pointer at a tick: x, y as fractions of the picture, pressure 0-1, and the modifiers held."""

    tick: int
    x: float
    y: float
    pressure: float = 1.0
    shift: bool = False


@dataclass(frozen=True)
class BrushSettings:
    """A brush as the person sets it: radius in longer sides, the rest 0-1; see `Stroke` and `RecipeHandle`."""

    radius: float = 0.15
    hardness: float = 0.0
    strength: float = 1.0
    hold: float = 0.0
    local: float = 0.0
    stiffness: float = 1.0


@dataclass(frozen=True)
class Press:
    """What a gesture starts from.

    Attributes:
        brush: as set.
        opposite: the tool's other direction was asked for.
        extent: (width, height) of the picture, the longer of them 1.
        dt: seconds a tick.
        last: where the last stroke ended, for a straight line from there.
        detail: how finely the flow of such a brush is solved; see `app.model.windows`.
        slack: how far the pointer may shake, in longer sides, and is not moved yet.
        string: by how long a string the pen pulls the brush, in longer sides; see `PulledString`.
        at: the place in the original of what was pressed on.
        under: the places in the original of what is seen at places.
        symmetry, sectors: of strokes.
        held: the handle that was taken hold of, and `rests`, where it is led.
        timeless: what is painted on masks takes no time.
        finely: gives a handle its detail.
    """

    brush: BrushSettings
    opposite: bool
    extent: tuple[float, float]
    dt: float
    last: tuple[float, float] | None = None
    detail: int = 0
    slack: float = 0.0
    string: float = 0.0
    at: tuple[float, float] = (0.0, 0.0)
    under: Callable[[list[Point]], list[Point]] = list
    held: RecipeHandle | None = None
    rests: tuple[float, float] | None = None
    timeless: bool = False
    symmetry: Symmetry = "none"
    sectors: int = 6
    finely: Callable[[RecipeHandle], RecipeHandle] = copy


class PulledString:
    """A stabiliser: the pen pulls the brush behind it on a string, and what it shakes within that length moves nothing.

    The brush goes straight towards the pen, and only as far as the string is too short: a tractrix, whatever the speed.

    Args:
        length: longer sides; 0 has the brush where the pen is.
        extent: of the picture.
        place: where both begin.
    """

    def __init__(self, length: float, extent: tuple[float, float], place: tuple[float, float]) -> None:
        self._length, self._extent = length, extent
        self._brush = self._pen = place

    def pull(self, x: float, y: float) -> tuple[float, float]:
        """Where the brush is once the pen is at (x, y), with as many digits as a recipe needs."""
        self._pen = x, y
        if (far := self._away) > self._length:
            self._go(1 - self._length / far)
        return self._place

    def catch_up(self, reach: float) -> Iterator[tuple[float, float]]:
        """The way of the brush to the pen when that is lifted, in steps of at most `reach` longer sides."""
        for left in range(ceil(self._away / reach), 0, -1):
            self._go(1 / left)
            yield self._place

    @property
    def _away(self) -> float:
        (x, y), (px, py) = self._brush, self._pen
        return hypot((px - x) * self._extent[0], (py - y) * self._extent[1])

    @property
    def _place(self) -> tuple[float, float]:
        return round(self._brush[0], 5), round(self._brush[1], 5)

    def _go(self, part: float) -> None:
        """Go so much of the way to the pen."""
        (x, y), (px, py) = self._brush, self._pen
        self._brush = (px, py) if part == 1 else (x + (px - x) * part, y + (py - y) * part)


Made = Stroke | MaskStroke | RecipeHandle
"""What a gesture makes."""

Gesture = Generator[Made | None, Touch | None, Made | None]
"""Sent a touch, it yields what it has made so far (None while nothing is to be applied); sent None, it returns it."""


@dataclass(frozen=True)
class Tool:
    """A tool of the strip.

    Attributes:
        name: its name and that of its icon.
        label, hint: as the person reads them.
        key: chooses it; with Shift, its opposite.
        gesture: from a press to its strokes; None for tools that move the view and not the picture.
        directions: what its two directions are called.
        back: the hint of the second one, where that of the first is wrong for it.
        masks: it paints a mask, which then is shown.
        settings: what of the brush is set for it.
    """

    name: str
    label: str
    key: str
    hint: str
    gesture: Callable[[Press, Touch], Gesture] | None = None
    directions: tuple[str, str] | None = None
    back: str = ""
    masks: bool = False
    settings: tuple[str, ...] = ("radius", "hardness", "strength")


def _stroke(press: Press, name: ToolName, reverse: bool, *touches: Touch) -> Stroke | MaskStroke:
    brush = press.brush
    stroke = Stroke(
        tool=name,
        radius=brush.radius,
        hardness=brush.hardness,
        strength=brush.strength,
        reverse=reverse,
        # Its images lie apart, and a window around one of them would not hold the others.
        detail=press.detail if name in FLOWING and press.symmetry == "none" else 0,
        symmetry=press.symmetry,
        sectors=press.sectors if press.symmetry == "radial" else 6,
        hold=brush.hold if name == "push" else 0.0,
        local=brush.local if name == "push" else 0.0,
        samples=tuple((touch.tick, touch.x, touch.y, touch.pressure) for touch in touches),
    )
    if not press.timeless:
        return stroke
    return MaskStroke.model_validate({"kind": "stroke", **stroke.model_dump(include=set(BrushPath.model_fields))})


def painting(forward: ToolName, backward: ToolName | None = None) -> Callable[[Press, Touch], Gesture]:
    """A tool that works where the pointer is: `backward` is its opposite, or else the stroke is reversed."""

    def gesture(press: Press, first: Touch) -> Gesture:
        name, reverse = forward, press.opposite
        if backward is not None:
            name, reverse = (backward if press.opposite else forward), False
        if first.shift and press.last is not None:
            return _line(press, _stroke(press, name, reverse, first), press.last)
        return _follow(_stroke(press, name, reverse, first), press)

    return gesture


def _follow(stroke: Stroke | MaskStroke, press: Press) -> Gesture:
    """The stroke follows the pointer; with Shift along the axis it set out on.

    A pointer that is faster than the fluid can be carried is followed along its path at that speed, also after it is
    let go: on a slow machine, where there are few ticks to a movement, nothing is torn and nothing stays behind.
    """
    _, x0, y0, _ = stroke.samples[0]
    path = _Path(press.extent, farthest(stroke, press.dt), (x0, y0))
    tick, pressure = stroke.samples[0][0], stroke.samples[0][3]
    axis: str | None = None
    while (touch := (yield stroke)) is not None:
        x, y, pressure = touch.x, touch.y, touch.pressure
        if touch.shift:
            dx, dy = (x - x0) * press.extent[0], (y - y0) * press.extent[1]
            if axis is None and hypot(dx, dy) > 0.01:
                axis = "x" if abs(dx) >= abs(dy) else "y"
            x, y = (x, y0) if axis == "x" else (x0, y) if axis == "y" else (x0, y0)
        if touch.tick > tick:
            path.refresh()
            tick = touch.tick
        path.wanted.append((x, y))
        for place in path.follow():
            stroke = stroke.with_sample(tick, *place, pressure)
    left = []
    while path.wanted:
        tick += 1
        path.refresh()
        left += [(tick, *place, pressure) for place in path.follow()]
    return stroke.model_copy(update={"samples": (*stroke.samples, *left)})


def farthest(stroke: Stroke | MaskStroke, dt: float) -> float:
    """How far the brush of a stroke follows the pointer in a tick of `dt` seconds, in longer sides.

    A push no farther than its radius: that is as far as it carries anything in one step (solver/README.md, *Slipping*).
    Nor less than a place can tell, or a stroke that is let go would never end.
    """
    far = min(FASTEST * dt, stroke.radius) if stroke.tool == "push" else FASTEST * dt
    return max(far, LEAST_STEP)


class _Path:
    """Where a brush has still to go, of which it can do only so much in a tick.

    Args:
        extent: of the picture.
        reach: longer sides a tick.
        place: where it is.
    """

    def __init__(self, extent: tuple[float, float], reach: float, place: tuple[float, float]) -> None:
        self.wanted: list[tuple[float, float]] = []
        self._extent, self._reach, self._place = extent, reach, place
        self._left = reach

    def refresh(self) -> None:
        """A new tick begins."""
        self._left = self._reach

    def follow(self) -> list[tuple[float, float]]:
        """The places that are reached now; where nothing is left to do, the brush stays where it is."""
        reached = []
        while self.wanted:
            (x, y), (px, py) = self.wanted[0], self._place
            far = hypot((x - px) * self._extent[0], (y - py) * self._extent[1])
            if far > self._left:
                part = self._left / far
                if part > 1e-6:
                    self._place = round(px + (x - px) * part, 5), round(py + (y - py) * part, 5)
                    reached.append(self._place)
                self._left = 0.0
                break
            self._left -= far
            self._place = x, y
            reached.append(self._place)
            self.wanted.pop(0)
        return reached


def _line(press: Press, stroke: Stroke | MaskStroke, start: tuple[float, float]) -> Gesture:
    """A straight stroke from where the last one ended to where was clicked, at an even speed."""
    tick, x, y, pressure = stroke.samples[0]
    length = hypot((x - start[0]) * press.extent[0], (y - start[1]) * press.extent[1])
    steps = max(2, round(length / LINE_SPEED / press.dt), ceil(length / farthest(stroke, press.dt)))
    (x0, y0), parts = start, (k / steps for k in range(steps + 1))
    samples = ((tick + k, x0 + (x - x0) * part, y0 + (y - y0) * part, pressure) for k, part in enumerate(parts))
    stroke = stroke.model_copy(update={"samples": tuple(samples)})
    while (yield stroke) is not None:
        pass
    return stroke


def _curve(press: Press, first: Touch) -> Gesture:
    """A path is drawn while nothing happens; on release the fluid is blown along it."""
    touches = yield from _drawn(press, first)
    if len(touches) < 2:
        return None
    points = touches[::-1] if press.opposite else touches
    return _stroke(press, "curve", False, *(point._replace(tick=touches[-1].tick) for point in points))


def _drawn(press: Press, first: Touch) -> Generator[None, Touch | None, list[Touch]]:
    """A path that is drawn while nothing happens; the last of its touches has the tick in which it was let go."""
    touches, tick = [first], first.tick
    while (touch := (yield None)) is not None:
        tick = touch.tick
        if _distance(press, touches[-1], touch) > DRAWN:
            touches.append(touch)
    return [*touches[:-1], touches[-1]._replace(tick=tick)]


def _distance(press: Press, one: Touch, other: Touch) -> float:
    """How far two touches are apart, in longer sides."""
    return hypot((one.x - other.x) * press.extent[0], (one.y - other.y) * press.extent[1])


def _lead(press: Press, first: Touch) -> Gesture:
    """What was pressed on goes where the pointer does and stays there; if that does not move, it is pinned.

    With Shift a line is drawn, which is pinned as a whole.
    """
    start = first.x, first.y
    handle, rests = press.held, press.rests or start
    if handle is None and first.shift:
        touches = yield from _drawn(press, first)
        if len(touches) < 2:
            return None
        length = sum(_distance(press, one, other) for one, other in pairwise(touches))
        every = ceil((len(touches) - 1) / (MOST_CORNERS - 1))
        corners = [(touch.x, touch.y) for touch in (*touches[:-1:every], touches[-1])]
        points = tuple(press.under(corners))
        if (different := len(set(points))) < 2:
            return None
        closed = different > 2 and _distance(press, touches[0], touches[-1]) < CLOSED * length
        return _held(press, touches[-1].tick, points=points, closed=closed)
    if handle is None:
        handle = _held(press, first.tick, at=press.at)
    place, moved = rests, False
    while (touch := (yield handle)) is not None:
        x, y = rests[0] + touch.x - start[0], rests[1] + touch.y - start[1]
        moved |= hypot((x - rests[0]) * press.extent[0], (y - rests[1]) * press.extent[1]) > press.slack
        to = round(min(max(x, 0.0), 1.0), 5), round(min(max(y, 0.0), 1.0), 5)
        if moved and to != place:
            handle, place = handle.led_to(touch.tick, press.dt, to, place), to
    return handle


def _held(press: Press, tick: int, **what: Any) -> RecipeHandle:
    """A handle that holds what was taken from a tick on, and has been led nowhere."""
    brush = press.brush
    parts = {"keys": (), "radius": brush.radius, "stiffness": brush.stiffness, "local": brush.local}
    return press.finely(RecipeHandle.model_validate({"start": tick * press.dt, **parts, **what}))


TOOLS = (
    Tool("push", "Push", "p", "Drag on the picture to push it", painting("push"), ("Along", "Against"),
         settings=("radius", "hardness", "strength", "hold", "local")),
    Tool("curve", "Curve", "c", "Draw a path: the picture flows along it", _curve, ("Forwards", "Backwards"),
         back="Draw a path: the picture flows back along it"),
    Tool("twirl", "Twirl", "t", "Hold to turn the picture", painting("twirl"), ("Clockwise", "Anticlockwise")),
    Tool("bloat", "Bloat", "b", "Hold to let the picture swell", painting("bloat", "pinch"), ("Bloat", "Pinch"),
         back="Hold to let the picture shrink"),
    Tool(
        "handle", "Handle", "g",
        "Drag a point to where it should go; click to pin it; with Shift draw a line to hold",
        _lead,
        settings=("radius", "stiffness", "local"),
    ),
    Tool(
        "thicken", "Thicken", "v", "Paint where the picture should move less, with Honey and Water",
        painting("thicken", "thin"), ("Thicken", "Thin"), back="Paint where the picture should give way", masks=True,
    ),
    Tool(
        "freeze", "Freeze", "f", "Paint what must stay as it is", painting("freeze", "thaw"), ("Freeze", "Thaw"),
        back="Paint what may move again", masks=True,
    ),
    Tool("smooth", "Smooth mask", "s", "Soften the edges of what you have painted", painting("smooth"), masks=True),
    Tool("select", "Select", "m", "Select an area, then fill it into a mask"),
    Tool("restore", "Restore", "r", "Hold to bring the picture back as it was", painting("restore")),
    Tool("pan", "Pan", "h", "Drag to move the view (or hold Space with any tool)"),
    Tool("zoom", "Zoom", "z", "Click to zoom in, with Alt to zoom out; drag left or right"),
)  # fmt: skip
TOOL = {tool.name: tool for tool in TOOLS}

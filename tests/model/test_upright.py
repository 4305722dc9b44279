"""A picture that lies on its side gives on its side what it gives upright: everything with x and y exchanged.

Other tests of this folder have wide pictures, whose width is 1 in every unit; of high ones it is the height.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from random import Random
from typing import Any, TypeVar

import numpy as np
import pytest

from app.errors import UserError
from app.model import forces, handles, mask_edits, masks, strokes, timeline, tools, windows
from app.model.areas import Area
from app.model.picture import Picture
from app.model.recipe import FluidSettings, Recipe, Stop
from app.model.sampling import Segment, SmallPictures, Window
from app.model.schema import Model
from app.model.timelaws import Timed
from solver.grid import Grid
from support.made import made

DT = 1 / 30
WIDE, HIGH = (1.0, 30 / 48), (30 / 48, 1.0)
SIDES = {"left-right": "up-down", "up-down": "left-right"}
CHANCES = range(12)

M = TypeVar("M", bound=Model)


def flipped(x: float, y: float) -> tuple[float, float]:
    return y, x


def turned_over(one: M) -> M:
    """The same of a picture whose x and y are exchanged; what turns clockwise turns the other way."""
    parts = dict[str, Any]()
    for key in one.model_fields_set:
        value: Any = getattr(one, key)
        match key:
            case "at" if isinstance(one, Timed):  # instants
                pass
            case "at" | "to" | "point" | "place" | "direction" if isinstance(value, tuple):
                parts[key] = flipped(*value)
            case "points" | "goals" | "outline" if value:
                parts[key] = tuple(flipped(*place) for place in value)
            case "samples":
                parts[key] = tuple((tick, y, x, pressure) for tick, x, y, pressure in value)
            case "keys" if value and len(value[0]) == 3:
                parts[key] = tuple((time, y, x) for time, x, y in value)
            case "box":
                parts[key] = value[1], value[0], value[3], value[2]
            case "symmetry":
                parts[key] = SIDES.get(value, value)
            case "rotate" if value is not None:
                parts[key] = -value
            case "turned" if value:
                parts[key] = tuple((time, -angle, scale) for time, angle, scale in value)
            case "window" | "within" | "segment" if isinstance(value, Model):
                parts[key] = turned_over(value)
            case "then" | "watch" if value:
                parts[key] = tuple(turned_over(part) for part in value)
            case _:
                pass
    if isinstance(one, forces.VortexForce) or (isinstance(one, forces.CurveForce) and one.direction == "normal"):
        parts["strength"] = -one.strength
    return one.model_copy(update=parts)


class Pictures:
    """One picture, whatever is asked for."""

    def __init__(self, upright: bool) -> None:
        pixels = np.random.default_rng(5).integers(0, 256, (10, 16, 3), np.uint8)
        pixels = pixels.repeat(3, axis=0).repeat(3, axis=1)
        self.picture = Picture(np.ascontiguousarray(pixels.transpose(1, 0, 2)) if upright else pixels)

    def load(self, name: str, frame: int = 0) -> Picture:
        return self.picture

    def notice(self, text: str) -> None:
        pass


LYING, UPRIGHT = Pictures(False), Pictures(True)
GRIDS = Grid.for_picture(48, 30, 24), Grid.for_picture(30, 48, 24)
CANVASES = Grid(48, 30, WIDE), Grid(30, 48, HIGH)


def tried(what: Callable[[], Any]) -> Any:
    """What comes of it, or None where the part made by chance is refused on these pictures."""
    try:
        return what()
    except (ValueError, UserError):
        return None


def path(dice: Random, count: int = 6) -> tuple[strokes.Sample, ...]:
    return tuple((3 + 2 * k, dice.random(), dice.random(), round(dice.random(), 3)) for k in range(count))


@pytest.mark.parametrize("symmetry", ["none", "left-right", "up-down", "both", "radial"])
def test_the_images_of_strokes_and_how_far_they_have_come(symmetry: strokes.Symmetry) -> None:
    for number in CHANCES:
        dice = Random(number)
        one = strokes.Stroke(tool="push", symmetry=symmetry, sectors=dice.randint(2, 7), samples=path(dice))
        other = turned_over(one)
        for tick in range(3, 15):
            assert one.travelled(tick, WIDE) == pytest.approx(other.travelled(tick, HIGH))
            lying, upright = (
                sorted(
                    [*flipped(dab.x0, dab.y0), *flipped(dab.x1, dab.y1), mirrored]
                    if is_wide
                    else [dab.x0, dab.y0, dab.x1, dab.y1, mirrored]
                    for dabs, mirrored in each.images(each.at(tick), extent)
                    for dab in dabs
                )
                for each, extent, is_wide in ((one, WIDE, True), (other, HIGH, False))
            )
            np.testing.assert_allclose(lying, upright, atol=1e-9)


@pytest.mark.parametrize("tool", [tool for tool in tools.TOOLS if tool.gesture], ids=lambda tool: tool.name)
def test_what_gestures_make(tool: tools.Tool) -> None:
    """With Shift or without, with a place to begin a line at or without, by a pointer now slow, now fast."""
    for number in range(40):
        dice = Random(number)
        pace = dice.choice((0.003, 0.006, 0.03, 0.3))
        brush = tools.BrushSettings(radius=dice.uniform(0.01, 0.2))
        held = handles.RecipeHandle(at=(0.5, 0.3), keys=()) if dice.random() < 0.3 else None
        last = (dice.random(), dice.random()) if dice.random() < 0.5 else None
        shift = dice.random() < 0.4
        x, y, touches = 0.5, 0.5, [tools.Touch(2, 0.5, 0.5, 1.0, shift)]
        for k in range(12):
            x, y = x + dice.uniform(-pace, pace), y + dice.uniform(-pace, pace)
            touches.append(tools.Touch(3 + k, x, y, 1.0, shift))
        found = []
        for is_wide, extent in ((True, WIDE), (False, HIGH)):
            swap: Callable[..., Any] = (lambda *place: place) if is_wide else flipped
            press = tools.Press(
                brush, False, extent, DT, last and swap(*last), slack=0.01,
                at=swap(0.2, 0.7), held=held if is_wide or held is None else turned_over(held),
            )  # fmt: skip
            assert tool.gesture is not None
            first, *others = (
                touch if is_wide else tools.Touch(touch.tick, touch.y, touch.x, touch.pressure, touch.shift)
                for touch in touches
            )
            gesture = tool.gesture(press, first)
            next(gesture)
            for touch in others:
                gesture.send(touch)
            with pytest.raises(StopIteration) as ended:
                gesture.send(None)
            found.append(ended.value.value)
        made_of, other = found
        if made_of is None or other is None:
            assert made_of is other is None
            continue
        wanted = turned_over(made_of)
        for key in ("samples", "keys", "points"):
            if (rows := getattr(wanted, key, None)) is not None:
                assert len(rows) == len(getattr(other, key))
                np.testing.assert_allclose(rows, getattr(other, key), atol=2e-5)
        assert getattr(wanted, "closed", False) == getattr(other, "closed", False)


def test_a_pulled_string() -> None:
    dice = Random(1)
    lying, upright = (tools.PulledString(0.1, extent, (0.5, 0.5)) for extent in (WIDE, HIGH))
    for _ in range(40):
        x, y = dice.random(), dice.random()
        assert lying.pull(x, y) == pytest.approx(flipped(*upright.pull(y, x)), abs=2e-5)
    caught = [flipped(*place) for place in upright.catch_up(0.02)]
    np.testing.assert_allclose([*lying.catch_up(0.02)], caught, atol=2e-5)


@pytest.mark.parametrize("number", CHANCES)
def test_the_windows_of_strokes_and_handles(number: int) -> None:
    """Of a picture of a size with no whole number of cells, as the brushes go on, and a handle is led beside them."""
    dice = Random(number)
    wholes = Grid.for_picture(601, 399, 64), Grid.for_picture(399, 601, 64)
    several = [
        strokes.Stroke(tool="push", radius=0.01, detail=dice.choice((700, 1365)), samples=path(dice, 1))
        for _ in range(dice.randint(0, 2))
    ]
    now: list[windows.FlowWindow | None] = [None, None]
    x, y = dice.random(), dice.random()
    for tick in range(30):
        to = x + dice.uniform(-0.05, 0.05), y + dice.uniform(-0.05, 0.05)
        acts = [windows.Act(each, tick, (strokes.Dab(x, y, *to, 1.0),)) for each in several]
        here, then = np.array([[x, y]]) * wholes[0].picture, np.array([to]) * wholes[0].picture
        leading = number % 2 == 0, tick == 0
        led = [windows.Led(512, 0.03, 0.02, here, then, *leading)]
        now = [
            windows.FlowWindow.of(acts, now[0], wholes[0], led),
            windows.FlowWindow.of(
                [windows.Act(each, tick, (strokes.Dab(y, x, *flipped(*to), 1.0),)) for each in several],
                now[1],
                wholes[1],
                [windows.Led(512, 0.03, 0.02, here[:, ::-1], then[:, ::-1], *leading)],
            ),
        ]
        x, y = to
        lying, upright = now
        assert (lying is None) == (upright is None)
        if lying is not None and upright is not None:
            assert (lying.detail, lying.column, lying.row) == (upright.detail, upright.row, upright.column)
            one, other = lying.grid_in(wholes[0]), upright.grid_in(wholes[1])
            assert one.size == other.size[::-1]
            np.testing.assert_allclose([*one.extent, *one.origin], [*other.extent[::-1], *other.origin[::-1]])


@pytest.mark.parametrize("number", CHANCES)
def test_what_is_said_against_handles(number: int) -> None:
    several = [made(handles.RecipeHandle, f"{number} {k}") for k in range(4)]
    pins = [made(handles.RecipePin, f"{number} {k}") for k in range(2)]
    lying = [*handles.objections(several, pins, WIDE)]
    upright = [*handles.objections([*map(turned_over, several)], [*map(turned_over, pins)], HIGH)]
    # A place that is shown stands there with x before y.
    assert [said.split("(")[0] for said in lying] == [said.split("(")[0] for said in upright]
    for one in (*several, *pins):
        assert handles.reach_of(one, WIDE) == pytest.approx(handles.reach_of(turned_over(one), HIGH))
        assert handles.leads_too_far(one, WIDE) == handles.leads_too_far(turned_over(one), HIGH)
        detail, other = (
            windows.with_detail(each, Recipe(fluid=FluidSettings(viscosity=0.3)), extent).detail
            for each, extent in ((one, WIDE), (turned_over(one), HIGH))
        )
        assert detail == other


def test_what_ends_a_simulation() -> None:
    """A watched point that has come a quarter of a longer side from where it was, or so near to its place."""
    for kind, wanted in (("distance", {"distance": 0.25}), ("place", {"place": (0.7, 0.4), "within": 0.25})):
        stop = Stop.model_validate({"watch": ({"point": (0.7, 0.4), **wanted},)})
        for far, angle in product((0.249, 0.251), np.linspace(0, 6, 13)):
            x, y = 0.7 + far * np.cos(angle), 0.4 * WIDE[1] + far * np.sin(angle)
            verdicts = (
                timeline.Sentinel(stop, DT).verdict(5, timeline.Observation(points=((x, y),), extent=WIDE)),
                timeline.Sentinel(turned_over(stop), DT).verdict(
                    5, timeline.Observation(points=((y, x),), extent=HIGH)
                ),
            )
            assert [verdict is not None for verdict in verdicts] == [(far > 0.25) == (kind == "distance")] * 2


FORCES = (
    forces.PointForce, forces.CurveForce, forces.GradientForce, forces.VortexForce, forces.SourceForce,
    forces.SinkForce,
)  # fmt: skip


@pytest.mark.parametrize("kind", FORCES)
def test_forces(kind: type[Any]) -> None:
    compared = 0
    for number in CHANCES:
        force = made(kind, f"{number}", muted=False)
        found = [
            tried(lambda one=one, grid=grid, picture=picture: forces.build([one], grid, picture, 1.0))
            for one, grid, picture in ((force, GRIDS[0], LYING), (turned_over(force), GRIDS[1], UPRIGHT))
        ]
        assert (found[0] is None) == (found[1] is None)
        for lying, upright in zip(found[0] or (), found[1] or (), strict=True):
            for name in ("faces", "motion"):
                one, other = getattr(lying, name), getattr(upright, name)
                assert (one is None) == (other is None)
                if one is not None:
                    scale = max(float(np.abs(one).max()), 1e-9)
                    np.testing.assert_allclose(one.transpose(1, 0, 2)[..., ::-1], other, atol=2e-5 * scale)
                    compared += 1
            one, other = lying.divergence, upright.divergence
            assert (one is None) == (other is None)
            if one is not None:
                np.testing.assert_allclose(one.T, other, atol=2e-5 * max(float(np.abs(one).max()), 1e-9))
                compared += 1
    assert compared > 3


LAYERS: dict[str, tuple[Any, Callable[..., np.ndarray]]] = {
    "viscosity": ((masks.ConstantViscosity, masks.PictureViscosity, masks.PathViscosity), masks.viscosity),
    "freeze": ((masks.ConstantFreeze, masks.PictureFreeze, masks.PathFreeze), masks.solid),
}


@pytest.mark.parametrize("name", LAYERS)
def test_layers(name: str) -> None:
    kinds, laid = LAYERS[name]
    fluid = (0.1,) if name == "viscosity" else ()
    compared = 0
    for number in CHANCES:
        layers = [made(kind, f"{number}") for kind in kinds]
        found = (
            tried(lambda layers=layers: laid(layers, *fluid, GRIDS[0], LYING)),
            tried(lambda layers=layers: laid([*map(turned_over, layers)], *fluid, GRIDS[1], UPRIGHT)),
        )
        assert (found[0] is None) == (found[1] is None)
        if found[0] is not None:
            np.testing.assert_allclose(found[0].T, found[1], rtol=1e-4)
            compared += 1
    assert compared > 3


def side(one: M, wide: bool) -> M:
    return one if wide else turned_over(one)


def shown(wide: bool) -> tuple[Grid, Pictures]:
    return (CANVASES[0], LYING) if wide else (CANVASES[1], UPRIGHT)


def test_windows_segments_and_areas() -> None:
    compared = 0
    for number in CHANCES:
        window, segment, area = made(Window, f"{number}"), made(Segment, f"{number}"), made(Area, f"{number}")
        np.testing.assert_allclose(window.weight(CANVASES[0]).T, turned_over(window).weight(CANVASES[1]), atol=1e-6)
        found = [
            (
                tried(lambda wide=wide, one=segment: side(one, wide).weight("source", *shown(wide))),
                tried(lambda wide=wide, one=area: side(one, wide).coverage(*shown(wide))),
            )
            for wide in (True, False)
        ]
        for lying, upright in zip(*found, strict=True):
            assert (lying is None) == (upright is None)
            if lying is not None:
                np.testing.assert_allclose(lying.T, upright, atol=1e-5)
                compared += 1
    assert compared > 5


@pytest.mark.parametrize(
    "kind", [mask_edits.FillMask, mask_edits.FeatherMask, mask_edits.SpreadMask, mask_edits.PictureMask]
)
def test_edits_of_masks(kind: type[Any]) -> None:
    compared = 0
    for number in CHANCES:
        words = (np.random.default_rng(number).random((30, 48)) ** 3 * 255).astype(np.uint8)
        edit = made(kind, f"{number}", of="frozen", **({"radius": 0.07} if "radius" in kind.model_fields else {}))
        lying = tried(lambda words=words, edit=edit: mask_edits.edited(words, edit, CANVASES[0], SmallPictures(LYING)))
        upright = tried(
            lambda words=words, edit=edit: mask_edits.edited(
                np.ascontiguousarray(words.T), turned_over(edit), CANVASES[1], SmallPictures(UPRIGHT)
            )
        )
        assert (lying is None) == (upright is None)
        if lying is not None:
            assert np.abs(lying.T.astype(int) - upright).max() <= 2  # rounded on the way
            compared += 1
    assert compared > 3

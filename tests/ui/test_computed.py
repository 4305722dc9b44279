"""What the window computes before it draws, of many cases by chance, as `golden/window.txt` has it in sums.

It tells that something has changed; what is right, the other tests of this folder tell. After a change that is meant:
`FLUIDWARP_GOLDEN=write pytest` of this file.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict
from math import inf
from random import Random
from typing import Any

import pytest

from app.model.bars import bars
from app.model.presets import BRUSHES
from app.model.recipe import Recipe
from app.model.strokes import Stroke
from app.model.tools import TOOLS
from app.ui import export_choices, units, widgets
from app.ui.actions import ACTIONS
from app.ui.clock import Clock
from app.ui.editor_state import EditorState, presets
from app.ui.events import Mods
from app.ui.keymap import Keymap
from app.ui.lanes import Lanes
from app.ui.layout import Layout
from app.ui.messages import Messages
from app.ui.panels.lanes import Scale
from app.ui.preferences import Preferences
from app.ui.quality import Speed
from app.ui.theme import PALETTES, blend, packed, rgb
from app.ui.viewport import Rect, Viewport
from support.golden import Golden, Sum
from support.made import made

CLOSE = 1e-4
MANY = 40


def layouts(dice: Random) -> Iterator[Any]:
    """Of windows of any size."""
    for _ in range(8 * MANY):
        width, height = dice.uniform(150, 4000), dice.uniform(120, 2400)
        scale, lanes = dice.choice((0.85, 1.0, 1.25, 1.5, 2.0)), dice.choice((0.0, 156.0, 700.0))
        flags = dice.random() < 0.5, dice.random() < 0.5
        yield Layout.of(width, height, scale, flags[0], dice.randint(8, 14), dice.randint(2, 5), flags[1], lanes)


def views(dice: Random) -> Iterator[Any]:
    """Zoomed, stepped and panned about."""
    for _ in range(MANY):
        canvas = Rect(48, 48, dice.randint(80, 2000), dice.randint(60, 1400))
        size = dice.randint(8, 6000), dice.randint(8, 6000)
        view = Viewport(canvas, size, dice.choice((1.0, 1.5, 2.0)))
        for _ in range(4):
            at = dice.uniform(0, 900), dice.uniform(0, 700)
            match dice.choice(("zoom", "step", "pan", "fit")):
                case "zoom":
                    view = view.zoomed(10 ** dice.uniform(-3, 2.5), *at)
                case "step":
                    view = view.stepped(dice.random() < 0.5, *at)
                case "pan":
                    view = view.panned(dice.uniform(-600, 600), dice.uniform(-600, 600))
                case "fit":
                    view = view.fitted()
            yield [view.rect, view.drawn, view.percent, view.longer, view.to_picture(*at), view.to_screen(0.3, 0.8)]


def speeds(dice: Random) -> Iterator[Any]:
    """Of machines from slow to quick."""
    for _ in range(MANY):
        speed = Speed.of(dice.uniform(0.5, 60), dice.uniform(0.2, 30), dice.uniform(0.1, 14))
        yield [speed, speed.best_grid, [speed.tick(grid) for grid in (96, 160, 256, 384)]]


def clocks(dice: Random) -> Iterator[Any]:
    """Ticks of frames of any length, with rests between."""
    clock, moving = Clock(), False
    for number in range(4 * MANY):
        moving = moving if dice.random() < 0.9 else not moving
        dt = dice.choice((1 / 144, 1 / 60, 1 / 30, 0.09, 0.4))
        clock.elapse(dt)
        if number % 37 == 0:
            clock.stir()
        yield [clock.ticks(dt, dice.choice((1 / 30, 1 / 60)), moving), clock.settling, clock.hovering]


def messages(dice: Random) -> Iterator[Any]:
    """That come, are seen and go."""
    told: list[int] = []
    shown, holding = Messages(lambda: told.append(1)), [True]
    for number in range(3 * MANY):
        text = f"Message\n{dice.randint(0, 5)}"
        match dice.choice(("say", "warn", "caution", "done", "see", "time", "time", "gone")):
            case "say":
                shown.say(text)
            case "warn" | "caution" as kind:
                until = [lambda holding=holding: holding[0]] * dice.randint(0, 1)  # by default they always hold
                getattr(shown, kind)(text, *until)
            case "done":
                shown.done(text)
            case "see":
                shown.see()
            case "time":
                shown.elapse(dice.uniform(0, 3))
            case "gone":
                holding[0] = number % 2 == 0
        yield [[(one.text, one.icon, one.left, one.seen) for one in shown.shown], shown.next_in, len(told)]


def keymaps(dice: Random) -> Iterator[Any]:
    """Keys that are chosen one after the other."""
    changed: dict[str, list[str]] = {}
    saved: list[int] = []
    keys = Keymap(ACTIONS.values(), changed, lambda: saved.append(1))
    chords = [key for action in ACTIONS.values() for key in action.keys] + ["f7", "ctrl+f8", "shift+f9"]
    for number in range(MANY):
        if number % 17 == 16:
            keys.reset()
        else:
            keys.set(dice.choice(sorted(ACTIONS)), dice.choice(chords))
        yield [[keys.of(name) for name in ACTIONS], [keys.action(chord) for chord in chords], keys.are_changed]
        yield [[keys.now(chord) for chord in chords], changed, len(saved), widgets.keys_shown(dice.choice(chords))]


def states(dice: Random) -> Iterator[Any]:
    """Tools, brushes, masks and overlays, set as keys and buttons do."""
    state = EditorState()
    doing: list[Callable[[], object]] = [
        lambda: state.choose_tool(dice.choice(TOOLS).name, dice.random() < 0.5),
        lambda: state.resize_brush(dice.choice((1.15, 1 / 1.15, 30, 1e-3))),
        lambda: state.harden_brush(dice.choice((0.1, -0.1, 0.033, 0.7))),
        lambda: state.strengthen_brush(dice.choice((0.1, -0.1, -0.7))),
        lambda: state.take_brush(dice.choice(BRUSHES)),
        lambda: state.make_local(dice.random()),
        state.select_next,
        state.show_mask,
        state.toggle_split,
        lambda: state.toggle_overlay(dice.choice(sorted(state.overlays))),
        lambda: setattr(state, "mask", dice.choice(("frozen", "thickness"))),
    ]
    for number in range(4 * MANY):
        dice.choice(doing)()
        yield [state.tool_name, asdict(state.brush), state.is_opposite, state.mask, state.select_by, state.split]
        yield [{name: overlay.shown for name, overlay in state.overlays.items()}, state.sections]
        yield [state.shows_frozen, state.shows_viscosity]
        if number % 40 == 39:
            likes = Preferences()
            state.remember(likes)
            kept = {"radius": dice.uniform(0, 1), "hardness": dice.uniform(-1, 2), "strength": 0.0, "other": 1.0}
            likes.presets, likes.brushes["none"] = {"Mine": kept, BRUSHES[0].name: kept}, kept
            yield [presets(likes), {name: asdict(brush) for name, brush in EditorState.recalled(likes).brushes.items()}]


def bars_in_time(dice: Random) -> Iterator[Any]:
    """Bars and blocks of strokes, which of them are selected, and the time that is shown."""
    for number in range(6):
        strokes = tuple(made(Stroke, f"bars {number} {k}") for k in range(dice.randint(2, 6)))
        recipe, lanes = Recipe(stroke=strokes, duration=2.0), Lanes()
        end = recipe.ticks
        yield [lanes.packed(recipe, end, least) for least in (0.3, 2.0, 40.0)]
        yield [lanes.blocks(recipe, pixel) for pixel in (0.2, 3.0)]
        drawn = bars(recipe)
        lanes.drawn = [(bar, Rect(10 * k, 20 * k, 15, 18)) for k, bar in enumerate(drawn)]
        for _ in range(80):
            x, y, adds = dice.uniform(0, 80), dice.uniform(0, 120), dice.random() < 0.5
            bar, at = dice.choice(drawn), dice.uniform(0, end)
            match dice.choice(("zoom", "pan", "press", "beside", "box", "cancel", "drag")):
                case "zoom":
                    lanes.zoom(end, at, dice.choice((0.3, 0.8, 0.9, 9.0)))
                case "pan":
                    lanes.pan(end, dice.uniform(-0.5, 0.5))
                case "press":
                    lanes.press(bar, dice.choice(("move", "start", "end")), at, x, adds, end)
                case "beside":
                    lanes.press_beside(x, y, adds)
                case "box":
                    lanes.stretch_box(x, y)
                case "cancel":
                    yield lanes.cancel()
                case "drag":
                    if lanes.drag is not None:
                        lanes.drag.ticks = dice.randint(-60, 60)
                        yield lanes.dragged(strokes[0], lanes.drag, 1 / 30)
            scale = Scale(20.0, 900.0, *lanes.span(end))
            yield [sorted(lanes.selected), lanes.box is not None, lanes.view, lanes.span(end), lanes.only(recipe)]
            yield [scale.a_tick, scale.across(at), scale.across(inf), scale.tick_at(x)]


def words(dice: Random) -> Iterator[Any]:
    """Numbers with units, chords, colours, and what exports are called."""
    found = [unit for unit in vars(units).values() if isinstance(unit, units.Unit)] + [units.Unit(" px", 1200)]
    for _ in range(MANY):
        value = dice.choice((1, -1)) * 10 ** dice.uniform(-6, 4)
        yield [(unit.text(value), unit.number(value), unit.value(value)) for unit in found]
        yield Mods(*(dice.random() < 0.5 for _ in range(3))).chord(dice.choice("az+["))
        one, other = (tuple(dice.random() for _ in range(4)) for _ in range(2))
        yield [packed(one), packed(one, 0.4), blend(one, other, dice.random()), rgb("f2a93b", dice.random())]  # pyright: ignore[reportArgumentType]
    yield [widgets.keys_shown(chord) for chord in ("+", "ctrl++", "ctrl+shift+z", "[", "pageup", "f1", "alt+delete")]
    yield list(PALETTES.values())
    yield [export_choices.holds_light(file) for _, files in export_choices.KINDS[:1] for file in files]


PARTS = (layouts, views, speeds, clocks, messages, keymaps, states, bars_in_time, words)


@pytest.fixture(scope="module")
def golden() -> Iterator[Golden]:
    golden = Golden("window.txt")
    yield golden
    golden.close()


@pytest.mark.parametrize("part", PARTS, ids=lambda part: part.__name__)
def test_what_is_computed_is_what_was(part: Callable[[Random], Iterator[Any]], golden: Golden) -> None:
    found = dict[str, list[float]]()
    together, number = Sum(), 0
    for number, value in enumerate(part(Random(part.__name__)), 1):
        together.add(value)
        if number % 40 == 0:
            found[f"{part.__name__} {number}"], together = together.row, Sum()
    if number % 40:
        found[f"{part.__name__} {number}"] = together.row
    golden.compare_all(found, f"{part.__name__} ", CLOSE)

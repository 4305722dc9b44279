"""What the parts of a recipe give, of many made by chance, as `golden/model.txt` has it in sums: that it has changed.

What is right of it, the other tests of this folder tell.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import product
from random import Random
from typing import Any

import numpy as np

from app.errors import UserError
from app.media.animation import frame_order
from app.model import forces, handles, mask_edits, masks, strokes, timelaws, timeline, tools, windows
from app.model.areas import Area
from app.model.bars import Which, bars, lanes, moved, stretched, with_changed, with_last
from app.model.picture import Picture
from app.model.recipe import Change, FluidSettings, Playback, Recipe, Stop
from app.model.sampling import Segment, SmallPictures, Window
from app.model.undo import History
from solver.grid import Grid
from support.golden import Golden, Sum
from support.made import made

CLOSE = 1e-4
CLOSE_GRADIENT = 1e-3  # its small components are differences of larger ones, which processors round otherwise
GRID = Grid.for_picture(48, 36, 24)
CANVAS = Grid(48, 36, (1, 0.75))
DT = 1 / 30
MANY = 10
TOGETHER = 5  # values in a row of the file


class Pictures:
    """Whatever is asked for, of any depth, and what is remarked on."""

    def __init__(self) -> None:
        self.remarks: list[str] = []

    def load(self, name: str, frame: int = 0) -> Picture:
        dice = np.random.default_rng(sum(name.encode()))
        y, x = np.mgrid[0:36, 0:48] / 48
        waves = [np.sin((9 + 3 * k) * x + k) * np.cos((7 + 2 * k) * y - k) for k in range(dice.integers(1, 5))]
        values = (0.5 * np.stack(waves, axis=-1) + 0.5 + 0.05 * dice.normal(size=(36, 48, len(waves)))).clip(0, 1)
        values = np.rint(values * 2**16) / 2**16  # processors differ in the last bit of a sine, and gradients show it
        return Picture((values * 255).astype(np.uint8) if dice.random() < 0.5 else values.astype(np.float32))

    def notice(self, text: str) -> None:
        self.remarks.append(text)


def tried(what: Callable[[], Any]) -> Any:
    """What comes of it, or what is said against it."""
    try:
        return what()
    except (UserError, ValueError) as error:
        return f"{type(error).__name__}: {error}"


def of_force(kind: type[Any], name: str) -> Iterator[Any]:
    pictures = Pictures()
    force, other = (made(kind, f"{name} {k}", muted=False) for k in range(2))
    yield tried(lambda: [vars(one) | {"law": None} for one in forces.build([force], GRID, pictures, 1.0)])
    yield [
        force.starts(DT),
        force.agrees_until(other, DT),
        force.agrees_until(force.edited(strength=3), DT),
        force.span,
    ]
    yield [tried(lambda t=t: force.law.impulse(t, t + 0.1, None)) for t in np.arange(0, 2, 0.1)]
    yield tried(lambda: force.spanning(0.25, 0.75))
    yield pictures.remarks


def of_layers(name: str) -> Iterator[Any]:
    layered = masks.ConstantViscosity, masks.PictureViscosity, masks.PathViscosity
    freezing = masks.ConstantFreeze, masks.PictureFreeze, masks.PathFreeze
    pictures, dice = Pictures(), Random(name)
    thick = [made(dice.choice(layered), f"{name} {k}") for k in range(3)]
    yield tried(lambda: masks.viscosity(thick, 0.1, GRID, pictures))
    yield tried(lambda: masks.solid([made(dice.choice(freezing), f"{name} {k}") for k in range(3)], GRID, pictures))
    yield made(Window, name).weight(GRID)
    for _ in range(3):
        yield tried(lambda k=_: made(Segment, f"{name} {k}", window=None).weight("source", GRID, pictures))
        yield tried(lambda k=_: made(Area, f"{name} {k}").coverage(GRID, pictures))


def of_mask_edits(name: str) -> Iterator[Any]:
    kinds = (mask_edits.FillMask, mask_edits.InvertMask, mask_edits.FeatherMask, mask_edits.SpreadMask,
             mask_edits.PictureMask)  # fmt: skip
    dice, pictures = np.random.default_rng(len(name) + sum(name.encode())), SmallPictures(Pictures())
    for of, depth in (("frozen", np.uint8), ("thickness", np.uint16)):
        words = (dice.random((36, 48)) ** 3 * np.iinfo(depth).max).astype(depth)
        yield mask_edits.as_grey(words, of)  # pyright: ignore[reportArgumentType]
        for kind in kinds:
            edit = made(kind, name, of=of, **({"radius": 0.07} if "radius" in kind.model_fields else {}))
            yield tried(
                lambda words=words, edit=edit: mask_edits.edited(words, edit, Grid(48, 36, (1, 0.75)), pictures)
            )
    edits: tuple[Any, ...] = ()
    for k in range(8):
        edits = mask_edits.with_edit(edits, made(kinds[k % 5], f"{name} {k % 6}"))
        yield mask_edits.remaining(edits, edits[: k // 2])
    yield edits


def path(name: str, ticks: int = 12) -> tuple[strokes.Sample, ...]:
    """Samples in order: some together, some far apart."""
    dice = Random(name)
    found: list[strokes.Sample] = [(dice.randint(0, 9), 0.4, 0.6, 0.5)]
    while len(found) < dice.randint(1, ticks):
        x, y = (min(max(part + dice.uniform(-0.2, 0.2), 0.0), 1.0) for part in found[-1][1:3])
        found.append((found[-1][0] + dice.choice((0, 1, 1, 3)), x, y, round(dice.random(), 3)))
    return tuple(found)


def stroke(name: str) -> strokes.Stroke:
    times = Random(name).choice((1, 1, 3))
    return made(strokes.Stroke, name, samples=path(name), repeat=times, every=4 * (times > 1), muted=False)


def of_stroke(name: str) -> Iterator[Any]:
    one, other = tried(lambda: stroke(name)), tried(lambda: stroke(f"{name} too"))
    if isinstance(one, str) or isinstance(other, str):
        return
    near = one.model_copy(update={"samples": (*one.samples[:-1], *other.moved(one.last_tick).samples)})
    for tick in range(0, one.end_tick + 3, 2):
        yield [one.at(tick), tried(lambda tick=tick: one.travelled(tick, (1.0, 0.75)))]
        yield [[(act.tick, act.dabs) for act in one.acts(tick)], one.begins_at(tick), one.before(tick), one.cut(tick)]
    yield list(one.images(one.at(one.first_tick), (1.0, 0.75)))
    yield [one.starts, one.end_tick, one.stays, one.moved(5), one.lasting(3, 9), one.lasting(2, 2), one.repeated(4, 7)]
    yield [first.agrees_until(last) for first, last in product((one, other, near, one.repeated(3, 40)), repeat=2)]


def of_laws(name: str) -> Iterator[Any]:
    """Every function and sign of a formula, and the other laws."""
    dice = Random(name)
    formulas = ["t < 1 < 2", "1 if t > 0.5 else t", "not t", "t and 2 or 3", "-t ** 2 % 0.3 // 0.1", "t == 1 or t != 2"]
    for function, (_, count) in timelaws.FUNCTIONS.items():
        for given in [count] if count else [2, 3]:
            formulas.append(f"{function}({', '.join(f't * {dice.random():.3f} + {k}' for k in range(given))})")
    for formula in formulas:
        law = timelaws.Formula(formula)
        yield [
            formula,
            tried(lambda law=law: law.check(2.0)),
            *(tried(lambda t=t, law=law: law(t)) for t in (0, 0.3, 1)),
        ]
        yield [tried(lambda t=t, law=law: law.impulse(t, t + 0.21)) for t in (0, 0.4, 1.7)]
    keys = tuple(sorted((dice.random(), dice.uniform(-2, 2)) for _ in range(4)))
    laws = [timelaws.Keyframes(keys, how) for how in ("linear", "smooth", "hold")]  # pyright: ignore[reportArgumentType]
    for law in (*laws, timelaws.Interval(0.2, 0.7), timelaws.Instants((0.1, 0.5, 0.6))):
        yield [law.impulse(t, t + 0.13) for t in np.arange(0, 1.2, 0.09)]
        yield [law.check(duration) for duration in (0.05, 0.2, 1.0)]


def of_handles(name: str) -> Iterator[Any]:
    one, other = (tried(lambda k=k: made(handles.RecipeHandle, f"{name} {k}", muted=False)) for k in range(2))
    pin = made(handles.RecipePin, name)
    for led in (one, other, pin):
        if isinstance(led, str):
            continue
        yield [led.corners, led.takes_hold, led.let_go, led.span, led.first_tick(DT), led.spanning(0.25, 0.75)]
        yield [led.is_in_force(tick, DT) for tick in range(0, 90, 7)]
    if not isinstance(one, str) and not isinstance(other, str):
        yield [one.ready, one.turns, one.upright, one.last, one.goal, one.turn_key(20, DT), one.agrees_until(other, DT)]
        yield [one.turned_to(30, DT, 20.0, 1.2), one.led_to(40, DT, (0.4, 0.6), (0.5, 0.5))]
        yield [one.before(tick, DT) for tick in (0, 10, 30, 60, 120)]
        yield handles.labelled([one, other], [pin])
        yield list(handles.objections([one, other], [pin], (1.0, 0.75)))


def recipe(name: str) -> Recipe:
    """A short one of strokes, forces, changes and edits, of which some have windows."""
    dice = Random(name)
    several = tuple(
        strokes.Stroke(tool=dice.choice(windows.FLOWING), samples=(*path(f"{name} {k}", 6), (30, 0.5, 0.5, 1.0)),
                       detail=dice.choice((0, 128, 192)), radius=dice.uniform(0.01, 0.05), muted=dice.random() < 0.2)
        for k in range(dice.randint(1, 3))
    )  # fmt: skip
    change = tuple(Change(tick=5 * k, viscosity=dice.random(), drag=dice.choice((None, 1.0))) for k in range(3))
    edits = tuple(mask_edits.ClearMask(kind="clear", tick=tick, of="frozen") for tick in (2, 9))
    kinds = (forces.VortexForce, forces.SourceForce) if dice.random() < 0.5 else ()
    force = tuple(made(kind, f"{name} {k}") for k, kind in enumerate(kinds))
    pins = (handles.RecipePin(at=(0.2, 0.3)),) if dice.random() < 0.3 else ()
    fluid = FluidSettings(grid=48, dt=DT, viscosity=0.3)
    return Recipe(stroke=several, force=force, change=change, mask=edits, pin=pins, fluid=fluid, duration=2.0)


def of_recipe(name: str) -> Iterator[Any]:
    one, other = recipe(name), recipe(f"{name} too")
    kin = one.edited(stroke=(one.stroke[0].moved(2), *one.stroke[1:], *other.stroke))
    yield [
        one.ticks,
        one.recorded,
        one.pushes,
        one.leads,
        [one.fluid_at(t) for t in (0, 7)],
        one.masks_at(9),
        one.text(),
    ]
    for first, last in product((one, other, kin), repeat=2):
        yield [first.agrees_until(last), first.is_set_up_as(last), [first.goes_on_from(last, t) for t in (0, 2, 9)]]
    yield [bars(kin), lanes(bars(kin)), lanes(bars(kin), 20.0), with_last(lanes(bars(one)), bars(other)[-1], 3.0)]
    for ticks in (-9, 4):
        yield [moved(each, ticks, DT) for each in (*one.stroke, *one.force, *one.pin)]
        yield [
            tried(lambda e=each, t=ticks: stretched(e, 6 + t, 20, DT)) for each in (*one.stroke, *one.force, *one.pin)
        ]
    several: tuple[set[Which], ...] = ({("stroke", 0)}, {("stroke", 0), ("force", 0)})
    for chosen in several:
        yield tried(lambda chosen=chosen: with_changed(one, chosen, lambda each: moved(each, 50, DT)))
        yield tried(lambda chosen=chosen: with_changed(one, chosen, lambda each: None))
    now = None
    for tick in range(32):
        acts = [act for each in one.stroke for act in each.acts(tick)]
        if acts:
            now = windows.FlowWindow.of(acts, now, GRID)
            yield [now, now and now.grid_in(GRID)]
    for radius in (0.003, 0.02, 0.2):
        yield [windows.detail_for(radius, each, each.fluid_at(9)) for each in (one, other)]


def of_time(name: str) -> Iterator[Any]:
    dice = Random(name)
    playback = made(Playback, name)
    for ticks, fps in ((30, 25.0), (7, 12.5)):
        yield tried(lambda t=ticks, fps=fps: timeline.frame_positions(timeline.Timeline(t, DT), playback, fps))
    yield [timeline.frame_rate(fps) for fps in (23.976, 29.97, 47.952, 59.94, 119.88, 25, 12.3456, dice.random())]
    yield frame_order(dice.randint(1, 5), ping_pong=dice.random() < 0.5, hold_first=dice.randint(0, 2), hold_last=2)
    sentinel = timeline.Sentinel(made(Stop, name, handles_within=dice.choice((None, 0.1))), DT)
    yield [sentinel.needs_motion, sentinel.needs_map, sentinel.needs_handles, sentinel.needs_points, sentinel.is_idle]
    for tick in range(6):
        numbers = {key: dice.random() * 1.5 for key in ("energy", "speed", "displacement", "det", "away")}
        points = tuple((dice.random(), dice.random()) for _ in range(4))
        yield sentinel.verdict(tick, timeline.Observation(**numbers, points=points, extent=(1.0, 0.75)))


def of_tools(name: str) -> Iterator[Any]:
    """Every tool, by a pointer that is now slow, now too fast."""
    dice = Random(name)
    brush = tools.BrushSettings(*(round(dice.uniform(0.1, 1.0), 3) for _ in range(5)))
    for tool in tools.TOOLS:
        if tool.gesture is None:
            continue
        symmetry = dice.choice(("none", "radial", "both"))
        press = tools.Press(
            brush, dice.random() < 0.5, (1.0, 0.75), DT, dice.choice((None, (0.2, 0.9))), 128, dice.choice((0.0, 0.1)),
            at=(0.4, 0.4), symmetry=symmetry, sectors=5, timeless=tool.masks and dice.random() < 0.5,
        )  # fmt: skip
        touches = [tools.Touch(*sample, dice.random() < 0.2) for sample in path(f"{name} {tool.name}")]
        held = (
            made(handles.RecipeHandle, f"{name} held", at=(0.5, 0.5), points=(), goals=())
            if dice.random() < 0.5
            else None
        )
        gesture = tool.gesture(replace(press, held=held), touches[0])
        yield next(gesture)
        for touch in touches[1:]:
            yield gesture.send(touch)
        try:
            gesture.send(None)
        except StopIteration as ended:
            yield ended.value
    string = tools.PulledString(0.1, (1.0, 0.75), (0.5, 0.5))
    yield [string.pull(dice.random(), dice.random()) for _ in range(5)]
    yield list(string.catch_up(0.03))


def of_history(name: str) -> Iterator[Any]:
    """What undo holds after all kinds of edits, with little memory."""
    dice, history = Random(name), History(recipe(name), 4000)
    for step in range(20):
        what = dice.choice(("commit", "commit", "amend", "undo", "redo", "go"))
        if what == "commit":
            history.commit(f"edit {step}", recipe(f"{name} {step % 5}"))
        elif what == "amend":
            history.amend(history.recipe.edited(duration=1.0 + step))
        elif what == "go":
            history.go_to(dice.randrange(len(history.entries)))
        elif what == "undo" and history.can_undo:
            history.undo()
        elif what == "redo" and history.can_redo:
            history.redo()
        yield [history.index, history.can_undo, history.can_redo, history.undo_name, history.redo_name, history.nbytes]
        yield [[entry.name for entry in history.entries], history.recipe.duration]


KINDS = {
    **{kind.__name__: lambda name, kind=kind: of_force(kind, name) for kind in (
        forces.PointForce, forces.CurveForce, forces.FieldForce, forces.GradientForce, forces.VortexForce,
        forces.SourceForce, forces.SinkForce,
    )},
    "layers": of_layers, "mask edits": of_mask_edits, "strokes": of_stroke, "laws": of_laws, "handles": of_handles,
    "recipes": of_recipe, "time": of_time, "tools": of_tools, "history": of_history,
}  # fmt: skip


def test_parts_of_recipes_give_what_is_written_down() -> None:
    golden = Golden("model.txt")
    found: dict[str, list[float]] = {}
    for kind, given in KINDS.items():
        for number in range(MANY):
            sums: list[Sum] = []
            for part, value in enumerate(given(f"{kind} {number}")):
                if part % TOGETHER == 0:
                    sums.append(Sum())
                sums[-1].add(value)
            found |= {f"{kind} {number}.{place}": one.row for place, one in enumerate(sums)}
    golden.compare_all(found, "", lambda name, row: CLOSE_GRADIENT if name.startswith("GradientForce") else CLOSE)
    golden.close()

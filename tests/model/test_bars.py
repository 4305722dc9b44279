"""Strokes, forces, handles and pins as bars: where they lie, how they are edited, and what the recipe says of it."""

from __future__ import annotations

import math
import random
import time
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise, product

import pytest
from pydantic import ValidationError

from app.errors import UserError
from app.model import strokes
from app.model.bars import Actor, Bar, Which, bars, lanes, moved, stretched, with_changed
from app.model.forces import Force, PointForce, VortexForce
from app.model.handles import RecipeHandle, RecipePin
from app.model.recipe import Recipe, Stop
from app.model.strokes import Change, Dab, Stroke
from app.model.undo import History

DT = 1 / 60
LED = RecipeHandle, RecipePin


def stroke(*samples: tuple[int, float, float, float], **more: object) -> Stroke:
    return Stroke.model_validate(
        {"tool": "push", "samples": samples or ((0, 0.2, 0.5, 1.0), (8, 0.6, 0.5, 1.0)), **more}
    )


def force(**more: object) -> VortexForce:
    return VortexForce.model_validate({"kind": "vortex", "point": (0.5, 0.5), **more})


def handle(**more: object) -> RecipeHandle:
    return RecipeHandle.model_validate({"at": (0.4, 0.5), "to": (0.5, 0.5), **more})


def random_stroke(dice: random.Random, tools: Sequence[str] = ("push", "twirl", "freeze")) -> Stroke:
    ticks = sorted(dice.randrange(0, 24) for _ in range(dice.randrange(1, 6)))
    samples = tuple((tick, round(dice.random(), 3), round(dice.random(), 3), round(dice.random(), 2)) for tick in ticks)
    made = stroke(*samples, tool=dice.choice(tools), muted=dice.random() < 0.2)
    times = dice.choice([1, 1, 2, 3, 7])
    return made.repeated(times, dice.randrange(1, 20))


def done(several: tuple[Stroke, ...], tick: int) -> list[tuple[str, float, tuple[Dab, ...], float]]:
    """All that is done in a tick."""
    acts = (act for one in several for act in one.acts(tick))
    return [
        (act.stroke.tool, act.stroke.strength, act.dabs, act.stroke.travelled(act.tick, (1.0, 0.7))) for act in acts
    ]


def test_how_many_strokes_act_at_once_is_counted_as_they_act(monkeypatch: pytest.MonkeyPatch) -> None:
    dice = random.Random(3)
    for _ in range(60):
        several = tuple(random_stroke(dice, ("push", "twirl")) for _ in range(dice.randrange(1, 9)))
        if dice.random() < 0.5:
            several += (stroke((2, 0.1, 0.1, 1.0), (9, 0.4, 0.1, 1.0), tool="curve", repeat=3, every=2),)
        acts = [sum(1 for one in several for _ in one.acts(tick)) for tick in range(200)]
        monkeypatch.setattr(strokes, "MOST_AT_ONCE", max(acts))
        assert strokes.excess(several) is None
        monkeypatch.setattr(strokes, "MOST_AT_ONCE", max(acts) - 1)
        if most := max(acts):
            told = f"{most} strokes act at once in tick {acts.index(most)}, with their repetitions; at most"
            assert strokes.excess(several) == f"{told} {most - 1} work"


def test_pieces_that_are_gone_through_one_by_one_are_counted_as_the_most_that_a_stroke_has(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    dice = random.Random(4)
    for _ in range(60):
        several = [
            random_stroke(dice, ("push", "twirl", "freeze", "restore", "bloat")).model_copy(
                update={"symmetry": dice.choice(["none", "both"]), "detail": dice.choice([0, 500])}
            )
            for _ in range(dice.randrange(1, 9))
        ]
        most = [0] * 200
        for tick, one in product(range(200), several):
            for act in one.acts(tick):
                by_image = one.tool == "restore" or (one.tool in ("push", "twirl", "bloat") and one.detail)
                pieces = 1 if one.tool in ("push", "twirl", "bloat") else len(act.dabs)
                images = 4 if by_image else 2 if one.tool == "push" else 1
                once = 2 if one.tool in ("push", "twirl") and one.detail else 1
                most[tick] += pieces * (images if one.symmetry == "both" else once)
        whole = sum(one.repeat * one.most_pieces for one in several)
        monkeypatch.setattr(strokes, "MOST_AT_ONCE", max(0, max(most) - 1))
        said = strokes.excess(several)
        assert not max(most) or (said is not None and int(said.split()[0]) >= max(most))
        monkeypatch.setattr(strokes, "MOST_AT_ONCE", whole)
        assert strokes.excess(several) is None
        monkeypatch.undo()


@pytest.mark.parametrize("tool", ["curve", "thicken", "restore", "push"])
def test_of_very_many_samples_in_a_tick_some_are_passed_over_evenly(tool: str) -> None:
    samples = [(0, k / 50_000, 0.5, k / 50_000) for k in range(50_001)]
    pieces = stroke(*samples, tool=tool).at(0)
    assert len(pieces) == strokes.MOST_AT_ONCE
    assert (pieces[0].x0, pieces[-1].x1) == (0.0, 1.0)
    for one, other in pairwise(pieces):
        assert one[2:4] == other[:2]
    for piece in pieces:
        assert piece.x1 - piece.x0 == pytest.approx(1 / strokes.MOST_AT_ONCE)
        assert piece.pressure == pytest.approx((piece.x0 + piece.x1) / 2)
    fewer = samples[: strokes.MOST_AT_ONCE + 1]
    assert [(piece.x0, piece.x1) for piece in stroke(*fewer, tool=tool).at(0)] == [
        (one[1], other[1]) for one, other in pairwise(fewer)
    ]
    radial = stroke(*samples, tool=tool).model_copy(update={"symmetry": "radial", "sectors": 10})
    assert len(radial.at(0)) == strokes.MOST_AT_ONCE // (10 if tool == "restore" else 1)


def test_how_far_a_stroke_has_come_is_added_up_once() -> None:
    dice, extent = random.Random(5), (1.0, 0.7)
    samples = [(k // 200, dice.random(), dice.random(), 1.0) for k in range(100_000)]
    begun, long = time.process_time(), stroke(*samples)
    far = [long.travelled(tick, extent) for tick in range(-1, 502)]
    assert time.process_time() - begun < 2  # or 8 s, going through what is passed at each tick
    for tick in (0, 1, 2, 250, 499, 500):
        ways = [(b[1] - a[1], 0.7 * (b[2] - a[2])) for a, b in pairwise(samples[: 200 * tick])]
        assert far[tick + 1] == pytest.approx(sum(math.hypot(*way) for way in ways), rel=1e-12)
    assert far[0] == far[1] == 0.0
    assert far[501] == far[502]


# -- a stroke ---------------------------------------------------------------------------------------------------------


def test_a_stroke_that_repeats_does_what_copies_of_it_do() -> None:
    dice = random.Random(1)
    for _ in range(100):
        one = random_stroke(dice)
        once = one.repeated(1, 0)
        copies = tuple(once.moved(time * one.every) for time in range(one.repeat))
        for tick in range(one.end_tick + 3):
            assert done((one,), tick) == done(copies, tick)
            assert one.begins_at(tick) == any(copy.begins_at(tick) for copy in copies)
    assert done((stroke(muted=True),), 3) == []


def test_what_is_cut_off_with_its_repetitions_is_what_was_done_before() -> None:
    dice = random.Random(2)
    for _ in range(200):
        one, tick = random_stroke(dice), dice.randrange(0, 80)
        kept = one.cut(tick)
        for at in range(one.end_tick + 2):
            wanted = done((one,), at) if at < tick else []
            assert len(done(kept, at)) == len(wanted)
            for mine, theirs in zip(done(kept, at), wanted, strict=True):
                for a, b in zip(mine[2], theirs[2], strict=True):
                    assert a == pytest.approx(b)  # cut between two samples
    assert stroke(muted=True).cut(4)[0].muted


def test_strokes_agree_as_long_as_they_do_the_same() -> None:
    dice, parted = random.Random(3), 0
    for _ in range(400):
        one = random_stroke(dice)
        other = dice.choice(
            [
                one.moved(dice.randrange(5)),
                one.repeated(dice.randrange(1, 5), dice.randrange(1, 20)),
                one.repeated(one.repeat, one.every + dice.randrange(3)),
                one.model_copy(update={"muted": not one.muted}),
                one.model_copy(update={"strength": 0.5}),
                one.model_copy(update={"samples": one.samples[: dice.randrange(1, 6)]}),
            ]
        )
        until = min(one.agrees_until(other), 200)
        assert until == other.agrees_until(one) or until == 200
        assert all(done((one,), tick) == done((other,), tick) for tick in range(int(until)))
        parted += until < 200 and done((one,), int(until)) != done((other,), int(until))
    assert parted > 250  # and hardly longer than that


def test_a_stroke_is_stretched_to_whole_ticks_and_back() -> None:
    one = stroke((4, 0.1, 0.5, 1.0), (5, 0.2, 0.5, 0.5), (5, 0.3, 0.5, 0.5), (12, 0.6, 0.5, 1.0))
    slow = one.lasting(4, 28)
    assert [tick for tick, *_ in slow.samples] == [4, 7, 7, 28]
    assert [sample[1:] for sample in slow.samples] == [sample[1:] for sample in one.samples]
    assert slow.lasting(4, 12) == one
    assert [tick for tick, *_ in one.lasting(4, 9).samples] == [4, 5, 5, 9]  # the nearest ones
    assert one.lasting(30, 38) == one.moved(26)
    fast = one.lasting(4, 4)
    assert {tick for tick, *_ in fast.samples} == {4}
    assert [tick for tick, *_ in fast.lasting(0, 9).samples] == [0, 3, 6, 9]  # what was done in one tick, evenly
    still = stroke((3, 0.5, 0.5, 1.0), tool="twirl").lasting(3, 9)
    assert still.samples == ((3, 0.5, 0.5, 1.0), (9, 0.5, 0.5, 1.0))


def test_a_stroke_of_half_the_time_is_twice_as_fast() -> None:
    one = stroke((0, 0.0, 0.5, 1.0), (12, 0.6, 0.5, 1.0))
    (slow,), (fast,) = one.at(3), one.lasting(0, 6).at(3)
    assert fast.x1 - fast.x0 == pytest.approx(2 * (slow.x1 - slow.x0))


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"repeat": 2}, "needs 'every'"),
        ({"every": 2}, "give 'repeat' too"),
        ({"repeat": 0, "every": 5}, "greater than or equal to 1"),
        ({"repeat": 1000, "every": 1_000_000}, "repeats beyond tick 10000000"),
    ],
)
def test_a_repetition_that_makes_no_sense_is_refused(keys: dict[str, int], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        stroke(**keys)


# -- the recipe -------------------------------------------------------------------------------------------------------


def test_what_is_muted_and_repeated_is_kept_in_a_file_before_the_samples() -> None:
    recipe = Recipe(stroke=(stroke(muted=True, repeat=3, every=20), stroke()), force=(force(muted=True),))
    text = recipe.text()
    assert Recipe.parse(text) == recipe
    assert text.index("muted = true\nrepeat = 3\nevery = 20\n") < text.index("samples")
    assert text.count("muted") == 2
    plain = Recipe(stroke=(stroke(),), force=(force(),)).text()
    assert not any(word in plain for word in ("muted", "repeat", "every"))


def test_a_stroke_of_a_mask_takes_no_time_and_does_not_repeat() -> None:
    mask = '[[mask]]\nkind = "stroke"\ntool = "freeze"\nsamples = [[0, 0.5, 0.5, 1.0]]\n'
    assert Recipe.parse(mask).mask[0].kind == "stroke"
    for line in ("muted = true", "repeat = 2", "every = 3"):
        with pytest.raises(UserError, match="unknown key"):
            Recipe.parse(f"{mask}{line}\n")


# -- forces -----------------------------------------------------------------------------------------------------------

LAWS = [
    {"at": (0.2,)},
    {"at": (0.1, 0.35)},
    {"during": (0.1, 0.4)},
    {"keys": ((0.1, 0.0), (0.2, 2.0), (0.5, 0.0))},
    {"keys": ((0.1, 1.0), (0.2, 2.0))},
    {"formula": "sin(9*t)"},
    {},
]


@pytest.mark.parametrize("law", LAWS, ids=lambda law: next(iter(law), "at the start"))
def test_forces_agree_as_long_as_they_do_the_same(law: dict[str, object]) -> None:
    one = force(**law)
    others = [
        moved(one, 3, DT),
        stretched(one, 10, 30, DT),
        one.edited(strength=2.0),
        one.edited(muted=True),
        *(force(**other) for other in LAWS),
    ]

    def act(of: Force, tick: int) -> float:
        return 0.0 if of.muted else of.strength * of.law.impulse(tick * DT, (tick + 1) * DT)

    for other in others:
        assert isinstance(other, VortexForce)
        until = min(one.agrees_until(other, DT), 40)
        assert until == min(other.agrees_until(one, DT), 40)
        assert all(act(one, tick) == act(other, tick) for tick in range(int(until)))
        recipes = [Recipe(force=(each, force(strength=0.1))) for each in (one, other)]
        assert min(recipes[0].agrees_until(recipes[1]), 40) == until


def test_a_force_that_is_moved_acts_as_much_so_many_ticks_later() -> None:
    for law in LAWS[:4]:
        one = force(**law)
        later = moved(one, 12, DT)
        for tick in range(40):
            now, then = (each.law.impulse(at * DT, (at + 1) * DT) for each, at in ((one, tick), (later, tick + 12)))
            assert then == pytest.approx(now, abs=1e-6)
        assert moved(later, -12, DT) == one
        assert moved(one, -1000, DT).span[0] == 0  # pyright: ignore[reportOptionalSubscript]
    assert moved(force(formula="t"), 5, DT) == force(formula="t")


def test_a_force_that_is_stretched_does_so_in_its_own_seconds() -> None:
    assert stretched(force(during=(0.0, 0.5)), 6, 36, DT) == force(during=(0.1, 0.6))
    keys = force(keys=((0.0, 0.0), (0.1, 1.0), (0.4, 0.0)))
    assert stretched(keys, 0, 48, DT) == force(keys=((0.0, 0.0), (0.2, 1.0), (0.8, 0.0)))
    assert stretched(force(at=(0.0, 0.1)), 0, 12, DT) == force(at=(0.0, 0.2))
    assert stretched(force(at=(0.3,)), 6, 50, DT) == force(at=(0.1,))


def test_the_law_of_a_force_is_that_of_its_keys_also_after_a_change() -> None:
    one = force(during=(0.0, 0.5))
    assert one.law.impulse(0, 1) == 0.5
    assert one.model_copy(update={"during": (0.0, 0.25)}).law.impulse(0, 1) == 0.25


# -- handles ----------------------------------------------------------------------------------------------------------

KEYED = handle(
    start=0.2,
    duration=0.3,
    keys=((0.5, 0.5, 0.5), (1.0, 0.6, 0.5)),
    turned=((0.4, 20.0, 1.5), (1.2, 0.0, 1.0)),
    end=2.0,
)


def test_a_handle_that_is_moved_or_stretched_goes_its_way_then() -> None:
    assert KEYED.span == (0.2, 1.2)
    later = moved(KEYED, 30, DT)
    assert later.keys == ((1.0, 0.5, 0.5), (1.5, 0.6, 0.5))
    assert later.turned == ((0.9, 20.0, 1.5), (1.7, 0.0, 1.0))
    assert (later.start, later.duration, later.end) == (0.7, 0.3, 2.5)
    assert moved(later, -30, DT) == KEYED
    assert moved(KEYED, -1000, DT).start == 0
    slow = stretched(KEYED, 12, 132, DT)  # and lets go as long after it
    assert slow.keys == ((pytest.approx(0.8), 0.5, 0.5), (pytest.approx(1.8), 0.6, 0.5))
    assert slow.turned == ((pytest.approx(0.6), 20.0, 1.5), (pytest.approx(2.2), 0.0, 1.0))
    assert (slow.start, slow.duration, slow.end) == pytest.approx((0.2, 0.6, 3.0))
    assert stretched(handle(duration=0.0), 6, 60, DT) == handle(start=0.1, duration=0.0)


@pytest.mark.parametrize(
    "one",
    [
        force(at=(0.123456789, 0.987654321)), force(during=(0.123456789, 0.987654321)),
        force(keys=((0.123456789, 0.0), (0.555555555, 1.0), (0.987654321, 0.0))),
        handle(start=0.123456789, duration=0.5, end=0.987654321), RecipePin(at=(0.4, 0.5), start=0.123456789),
    ],
)  # fmt: skip
def test_times_are_kept_to_a_billionth_of_a_second_wherever_they_are_moved(
    one: Force | RecipeHandle | RecipePin,
) -> None:
    """So nothing is left of it when it is moved back."""
    later = one
    for ticks in (1, 7, 100, 1000):
        later, before = moved(later, ticks, DT), later
        assert later.span
        assert before.span
        assert abs(later.span[0] - before.span[0] - ticks * DT) < 0.6e-9
    for ticks in (1000, 100, 7, 1):
        later = moved(later, -ticks, DT)
    assert later == one


@pytest.mark.parametrize("pin", [RecipePin(at=(0.4, 0.5), start=0.5), handle(to=None, keys=(), start=0.5)])
def test_what_only_stays_lets_go_once_its_end_is_dragged(pin: RecipePin | RecipeHandle) -> None:
    assert bars(Recipe.model_validate({pin.kind: (pin,)}))[0][1:4] == (30, math.inf, math.inf)
    assert moved(pin, -12, DT) == pin.edited(start=0.3)
    assert stretched(pin, 6, math.inf, DT) == pin.edited(start=0.1)
    assert stretched(pin, 30, 60, DT) == pin.edited(end=1.0)


def test_a_recording_lasts_until_its_handles_have_gone_their_way_and_waits_for_none_that_are_gone() -> None:
    handles, pins = (handle(), handle(muted=True)), (RecipePin(at=(0.1, 0.1)),)
    recipe = Recipe(handle=handles, pin=pins, stop=Stop(handles_within=0.01))
    assert edited(recipe, ("handle", 0), lambda one: moved(one, 60, DT)).ticks == 120
    assert edited(recipe, ("pin", 0), lambda one: moved(one, 60, DT)).ticks == 60
    last = edited(recipe, ("handle", 0), lambda one: None)
    assert last.stop.handles_within == 0.01
    assert edited(last, ("handle", 0), lambda one: None).stop.handles_within is None
    muted = edited(recipe, ("handle", 0), lambda one: one.model_copy(update={"muted": True}))
    assert recipe.agrees_until(muted) == 0
    assert recipe.agrees_until(edited(recipe, ("handle", 1), lambda one: moved(one, 9, DT))) == math.inf


# -- lanes ------------------------------------------------------------------------------------------------------------


def test_lanes_are_as_few_as_there_are_bars_at_once() -> None:
    dice = random.Random(5)
    for least in (0, 6):
        for _ in range(50):
            several = list[Bar]()
            for number in range(dice.randrange(1, 40)):
                start = dice.randrange(100)
                end = start + dice.randrange(1, 20)
                several.append(Bar(("stroke", number), start, end, end))
            packed = lanes(several, least)
            assert sorted(bar for lane in packed for bar in lane) == sorted(several)
            for lane in packed:
                for before, after in pairwise(lane):
                    assert max(before.stops, before.start + least) <= after.start
            at_once = max(sum(b.start <= t < max(b.stops, b.start + least) for b in several) for t in range(120))
            assert len(packed) == at_once


def test_a_bar_lies_where_its_stroke_or_force_does() -> None:
    recipe = Recipe(
        stroke=(stroke(repeat=3, every=10), stroke(muted=True)),
        force=(force(during=(0.5, 1.0)), force(formula="t"), PointForce(kind="point", point=(0, 0), direction=(1, 0))),
        duration=2.0,
    )
    during, formula, instant, first, second = bars(recipe)
    assert during[:4] == (("force", 0), 30, 60, 60)
    assert formula[:4] == (("force", 1), 0, 120, 120)
    assert not formula.is_free
    assert instant[:4] == (("force", 2), 0, 1, 1)
    assert first[:5] == (("stroke", 0), 0, 9, 29, 10)
    assert second.muted


# -- edits of a recipe ------------------------------------------------------------------------------------------------


def edited(recipe: Recipe, which: Which, changed: Callable[[Actor], Actor | None]) -> Recipe:
    return recipe.edited(**with_changed(recipe, {which}, changed))


def test_a_recording_ends_as_long_after_its_last_stroke_as_it_did() -> None:
    recipe = Recipe(stroke=(stroke(), stroke((20, 0.5, 0.5, 1.0), (29, 0.6, 0.5, 1.0))), duration=45 * DT)
    ticks = {
        by: edited(recipe, ("stroke", 1), lambda one, by=by: moved(one, by, DT)).ticks for by in (0, 5, -5, -20, 100)
    }
    assert ticks == {0: 45, 5: 50, -5: 40, -20: 25, 100: 145}
    assert edited(recipe, ("stroke", 0), lambda one: moved(one, 3, DT)).duration is recipe.duration
    assert edited(recipe, ("stroke", 1), lambda one: None).ticks == 24
    assert edited(recipe, ("stroke", 1), lambda one: one.model_copy(update={"muted": True})).ticks == 45
    changed = recipe.edited(change=(Change(tick=40, drag=1.0),))
    assert edited(changed, ("stroke", 1), lambda one: None).ticks == 41
    driven = recipe.edited(force=(force(),))
    assert edited(driven, ("stroke", 1), lambda one: None).ticks == 45
    assert edited(driven, ("force", 0), lambda one: moved(one, 99, DT)).ticks == 99
    with pytest.raises(UserError, match="at most 1000000 ticks"):
        edited(recipe, ("stroke", 1), lambda one: moved(one, 2_000_000, DT))


def test_what_is_led_later_has_as_long_to_arrive_as_what_was_led_last() -> None:
    early = RecipeHandle(at=(0.3, 0.5), to=(0.4, 0.5), duration=10 * DT)
    late = RecipeHandle(at=(0.6, 0.5), keys=((20 * DT, 0.6, 0.5), (30 * DT, 0.7, 0.5)), start=20 * DT)
    recipe = Recipe(handle=(early, late), duration=45 * DT)
    ticks = [edited(recipe, ("handle", 0), lambda one, by=by: moved(one, by, DT)).ticks for by in (0, 10, 20, 35, 50)]
    assert ticks == [45, 45, 45, 60, 75]
    assert edited(recipe, ("handle", 1), lambda one: stretched(one, 20, 40, DT)).ticks == 55
    assert edited(recipe, ("handle", 1), lambda one: None).ticks == 45


def any_edit(recipe: Recipe, dice: random.Random) -> Recipe:
    """Some edit of some bars."""
    all_ = [bar.which for bar in bars(recipe)]
    which = dice.sample(all_, min(len(all_), dice.choice([1, 1, 3])))
    by, start, end = dice.randrange(-15, 15), dice.randrange(40), dice.randrange(41, 60)
    changes: list[Callable[[Actor], Actor | None]] = [
        lambda one: moved(one, by, DT),
        lambda one: stretched(one, start, end, DT),
        lambda one: one.model_copy(update={"muted": not one.muted}),
        lambda one: one.model_copy(
            update={"stiffness" if isinstance(one, LED) else "strength": dice.choice([0.2, 0.7])}
        ),
        lambda one: one.repeated(dice.randrange(1, 5), 12) if isinstance(one, Stroke) else one,
        lambda one: None if dice.random() < 0.3 else one,
    ]
    return recipe.edited(**with_changed(recipe, which, dice.choice(changes)))


def walk(seed: int, steps: int) -> Iterator[tuple[History, list[Recipe], int]]:
    """A history under random edits, undo and redo, beside a plain list of what it should hold."""
    dice = random.Random(seed)
    forces = tuple(force(**law, strength=float(number + 1)) for number, law in enumerate(LAWS))
    strokes, pins = tuple(random_stroke(dice) for _ in range(12)), (RecipePin(at=(0.1, 0.1)),)
    recipe = Recipe(stroke=strokes, force=forces, handle=(handle(), KEYED), pin=pins, duration=3.0)
    history, states, now = History(recipe), [recipe], 0
    for _ in range(steps):
        match dice.choice(["edit", "edit", "undo", "redo"]):
            case "edit":
                made = any_edit(history.recipe, dice)
                if made != history.recipe:
                    states, now = [*states[: now + 1], made], now + 1
                history.commit("Edit", made)
            case "undo":
                history.undo()
                now = max(now - 1, 0)
            case _:
                history.redo()
                now = min(now + 1, len(states) - 1)
        yield history, states, now


@pytest.mark.parametrize("seed", range(4))
def test_any_edits_are_undone_to_what_was_and_saved_and_read_again(seed: int) -> None:
    for step, (history, states, now) in enumerate(walk(seed, 120)):
        assert history.recipe == states[now]
        if step % 10 == 0:
            assert Recipe.parse(history.recipe.text()) == history.recipe
            assert history.recipe.checked() == history.recipe
    while history.can_undo:  # pyright: ignore[reportPossiblyUnboundVariable]
        history.undo()
    assert history.recipe == states[0]


def test_recipes_after_any_edits_agree_as_long_as_they_do_the_same() -> None:
    dice = random.Random(9)
    for history, states, now in walk(5, 100):
        one, other = history.recipe, dice.choice(states[max(now - 3, 0) :])
        until = one.agrees_until(other)
        for tick in range(int(min(until, 100))):
            assert done(one.stroke, tick) == done(other.stroke, tick)

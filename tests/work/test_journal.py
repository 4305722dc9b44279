"""Journals: what is read is what was written, bit for bit, up to the first record that is not whole."""

from __future__ import annotations

import json
import random
import zlib
from collections.abc import Callable
from dataclasses import asdict, fields, replace
from itertools import pairwise
from typing import Any

import pytest

from app.model.recipe import VERSION as RECIPE_VERSION
from app.model.recipe import Recipe
from app.model.strokes import Change, Stroke
from app.model.undo import Entry, History
from app.work import journal
from app.work.journal import Damaged, Newer, Origin, Work, beginning, continuation, read

ORIGIN = Origin("Käse 1", "/pictures", None, True, False, 12, 34, (1, 2, 3, -4))
TOOLS = ("push", "twirl", "freeze", "curve")


def a_stroke(dice: random.Random, tick: int) -> Stroke:
    count = dice.randint(2, 6)
    samples = tuple((tick + k, dice.random(), dice.random(), dice.random()) for k in range(count))
    return Stroke(tool=dice.choice(TOOLS), radius=dice.random() + 0.001, samples=samples)


def works(seed: int, count: int = 40) -> list[Work]:
    """What a work becomes edit by edit: strokes, changes, ticks of rest, undo and redo, and a save now and then."""
    dice = random.Random(seed)
    history = History(Recipe(picture="a.png", name="Grüße \n"), budget=40_000)
    saved = history.recipe
    seen = []
    for _ in range(count):
        now = history.recipe
        kind = dice.random()
        if kind < 0.5:
            stroke = a_stroke(dice, now.ticks)
            history.commit("Push", now.edited(stroke=(*now.stroke, stroke), duration=now.duration + dice.random()))
        elif kind < 0.65:
            history.amend(now.edited(duration=now.duration + 1 / 30))
        elif kind < 0.75:
            change = Change(tick=now.ticks, viscosity=dice.random())
            history.commit("Viscosity", now.edited(change=(*now.change, change)))
        elif kind < 0.8:
            history.commit("Cut", now.edited(stroke=now.stroke[: dice.randint(0, len(now.stroke))]))
        elif kind < 0.95:
            history.go_to(dice.randrange(len(history.entries)))
        else:
            history.commit("Quality", now.edited(fluid=now.fluid.model_copy(update={"grid": dice.randint(8, 99)})))
        seen.append(Work(history.entries, history.index, saved))
    return seen


def written(works: list[Work]) -> tuple[bytes, list[int]]:
    """The journal that grows with them, and where in it each of them is complete."""
    data = b"".join(beginning(ORIGIN, works[0]))
    ends = [len(data)]
    for before, work in pairwise(works):
        data += continuation(work, before)
        ends.append(len(data))
    return data, ends


def same(one: Work, other: Work) -> bool:
    """To the bit: a float's repr tells it apart from every other."""
    told = [repr([(e.name, e.recipe) for e in work.entries] + [work.index, work.saved]) for work in (one, other)]
    return told[0] == told[1]


@pytest.mark.parametrize("seed", range(5))
def test_what_is_read_is_what_was_written_after_every_edit(seed: int) -> None:
    seen = works(seed)
    data, ends = written(seen)
    for work, end in zip(seen, ends, strict=True):
        origin, found = read(data[:end])
        assert origin == ORIGIN
        assert same(found, work)
        begun = b"".join(beginning(ORIGIN, work))
        assert same(read(begun)[1], work)


def test_what_is_restored_shares_its_strokes_and_goes_on() -> None:
    work = works(1)[-1]
    _, found = read(b"".join(beginning(ORIGIN, work)))
    history = found.history
    assert history.nbytes == sum(entry.nbytes for entry in work.entries)
    assert history.recipe == work.recipe
    while history.can_undo:
        history.undo()
    assert history.recipe == work.entries[0].recipe
    assert found.is_unsaved == work.is_unsaved


@pytest.mark.parametrize("seed", range(3))
def test_a_torn_end_is_ignored_wherever_it_is_torn(seed: int) -> None:
    seen = works(seed, 12)
    data, ends = written(seen)
    dice = random.Random(seed)
    for end in {*range(ends[0], len(data), 7), *ends, *(end - 1 for end in ends[1:])}:
        whole = sum(1 for one in ends if one <= end) - 1
        junk = dice.choice((b"", b"\0" * 5000, dice.randbytes(50), b"x\n\n", b"00000000 {}\n"))
        assert same(read(data[:end] + junk)[1], seen[whole]), end


@pytest.mark.parametrize("seed", range(3))
def test_a_flipped_bit_costs_no_more_than_what_comes_after_it(seed: int) -> None:
    seen = works(seed, 12)
    data, ends = written(seen)
    dice = random.Random(seed)
    for _ in range(400):
        place = dice.randrange(ends[0], len(data))
        bad = bytearray(data)
        bad[place] ^= 1 << dice.randrange(8)
        whole = sum(1 for one in ends if one <= place) - 1
        found = read(bytes(bad))[1]
        # The case of a checksum's letter says nothing.
        assert same(found, seen[whole]) or bytes(bad).lower() == data.lower()


def test_a_bit_flipped_in_the_beginning_gives_an_earlier_state_or_nothing() -> None:
    work = works(2)[-1]
    data = b"".join(beginning(ORIGIN, work))
    states = [repr(entry.recipe) for entry in work.entries]
    dice = random.Random(4)
    for _ in range(400):
        bad = bytearray(data)
        bad[dice.randrange(len(data))] ^= 1 << dice.randrange(8)
        try:
            found = read(bytes(bad))[1]
        except (Damaged, Newer):
            continue
        assert [repr(entry.recipe) for entry in found.entries] == states[: len(found.entries)]


def line(record: Any) -> bytes:
    """A record with its checksum, whatever it says."""
    text = json.dumps(record).encode()
    return b"%08x %s\n" % (zlib.crc32(text), text)


ENTRY = ["Push", 5, {"duration": 3.0}]


@pytest.mark.parametrize(
    "record",
    [
        {"index": 0.0},
        {"index": True},
        {"index": -1},
        {"index": "0"},
        {"index": 0, "saved": [-1, {}]},
        {"index": 0, "saved": [0.0, {}]},
        {"index": 0, "saved": [1, {}]},
        {"index": 0, "drop": -1},
        {"index": 0, "drop": 1},
        {"index": 0, "keep": -1, "add": [ENTRY, ENTRY]},
        {"index": 0, "keep": 9},
        {"index": 0, "add": [[7, 5, {}]]},
        {"index": 0, "add": [["a\0", 5, {}]]},
        {"index": 0, "add": [["a", 5.0, {}]]},
        {"index": 0, "add": [["a", -5, {}]]},
        {"index": 0, "add": [["a", 1e300, {}]]},
        {"index": 0, "add": [["a", 5, {"stroke": [-1, []]}]]},
        {"index": 0, "add": [["a", 5, {"stroke": [0.0, []]}]]},
        {"index": 0, "add": [["a", 5, {"stroke": [9, []]}]]},
        {"index": 0, "add": [["a", 5, {"duration": float("nan")}]]},
        {"index": 0, "add": [["a", 5, {"duration": -1.0}]]},
        {"index": 0, "add": [["a", 5, {"duration": "1"}]]},
        {"index": 0, "add": [["a", 5, {"picture": "a\0"}]]},
        {"index": 0, "add": [["a", 5, {"edited": 1}]]},
        {"amend": [1]},
        {"amend": {"version": 10**400}},
        {},
        [],
        None,
        7,
    ],
    ids=json.dumps,
)
def test_a_record_that_says_what_none_can_costs_nothing_before_it(record: Any) -> None:
    """Though it is whole by its checksum."""
    recipe = Recipe(picture="a.png")
    work = Work((Entry("Open", recipe, 0),), 0, recipe)
    begun = b"".join(beginning(ORIGIN, work))
    longer = Work((*work.entries, Entry("Longer", recipe.edited(duration=2.0), 9)), 1, recipe)
    for data, before in (begun, work), (begun + continuation(longer, work), longer):
        if record in ({"index": 0, "saved": [1, {}]}, {"index": 0, "drop": 1}) and before is longer:
            continue  # there it can
        _, found = read(data + line(record) + continuation(longer, work))
        assert same(found, before)
        assert found.edits[:2] == (len(before.entries), before.index)
        assert found.is_unsaved == before.is_unsaved
        assert found.is_cut
        assert not read(data)[1].is_cut
        assert not read(data + line(record)[:-3])[1].is_cut


def is_count(value: object) -> bool:
    return type(value) is int and value >= 0


def is_name(value: object) -> bool:
    return isinstance(value, str) and "\0" not in value


VALID: dict[str, Callable[[object], bool]] = {
    "name": is_name,
    "folder": is_name,
    "path": lambda value: value is None or is_name(value),
    "embedded": lambda value: isinstance(value, bool),
    "inside": lambda value: isinstance(value, bool),
    "size": is_count,
    "crc": is_count,
    "seen": lambda value: value is None or (isinstance(value, list) and all(type(one) is int for one in value)),
}
VALUES = [None, True, False, -1, 0, 7, 1.0, "", "/a", "7", "/a\0", [], [1, -4], [1, 2.0], [True], ["1"], [[1]], {}]


@pytest.mark.parametrize("key", [field.name for field in fields(Origin)])
def test_a_journal_of_pictures_that_are_nowhere_is_damaged(key: str) -> None:
    """Whatever stands for a part that is no such thing, or is not there; and a part that there is not."""
    head, *_ = beginning(ORIGIN, Work((Entry("Open", Recipe(), 0),), 0, Recipe()))
    origin = asdict(replace(ORIGIN, path="/a.fluidwarp"))

    def read_with(**parts: object) -> Origin:
        return read(head + line({"origin": origin | parts, "add": [["Open", 0, {}]], "index": 0}))[0]

    for value in VALUES:
        if VALID[key](value):
            assert getattr(read_with(**{key: value}), key) == (tuple(value) if isinstance(value, list) else value)
        else:
            with pytest.raises(Damaged):
                read_with(**{key: value})
    del origin[key]
    if key == "seen":  # which journals did not have at first
        assert read_with().seen is None
    else:
        with pytest.raises(Damaged):
            read_with()
    origin[key] = getattr(ORIGIN, key)
    with pytest.raises(Damaged):
        read_with(more=1)
    with pytest.raises(Damaged):
        read_with(inside=True, path=None)


def test_names_that_are_not_utf8_come_back() -> None:
    origin = replace(ORIGIN, name="\udcff", folder="/\udcff", path="/\udcff/a")
    assert read(b"".join(beginning(origin, Work((Entry("Open", Recipe(), 0),), 0, Recipe()))))[0] == origin


def test_a_journal_of_more_lists_than_a_history_has_is_read_no_further(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(journal, "DEFAULT_BUDGET", 20_000)
    recipe = Recipe().edited(stroke=(a_stroke(random.Random(1), 1),) * 100)
    data = b"".join(beginning(ORIGIN, Work((Entry("Open", recipe, 0),), 0, recipe)))
    for index in range(1, 1000):
        data += line({"index": index, "add": [["a", 0, {"stroke": [99, []]}]]})
    found = read(data)[1]
    assert sum(1024 + 8 * len(entry.recipe.stroke) for entry in found.entries) <= 40_000
    assert len(found.entries) > 10


@pytest.mark.parametrize("data", [b"", b"\n", b"fluidwarp journal 1 1\n", b"\x89PNG\r\n\x1a\n", b"\0" * 4096])
def test_what_is_no_journal_is_damaged(data: bytes) -> None:
    with pytest.raises(Damaged):
        read(data)


@pytest.mark.parametrize("head", [b"fluidwarp journal 3 1\n", f"fluidwarp journal 1 {RECIPE_VERSION + 1}\n".encode()])
def test_a_newer_journal_says_so(head: bytes) -> None:
    with pytest.raises(Newer):
        read(head + b"whatever there may be then\n")


def test_everything_of_a_recipe_comes_back() -> None:
    text = """
picture = "a.png"
map = "st.exr"
duration = 2.5
[fluid]
grid = 100
[stop]
speed_below = 0.01
watch = [{ point = [0.1, 0.2], distance = 0.3 }]
[output]
samples = 1
[[viscosity]]
kind = "picture"
picture = "mask.png"
scale = 0.5
[[force]]
kind = "vortex"
point = [0.47, 0.33]
radius = 0.17
strength = 7.0
keys = [[0, 0], [1, 2]]
[[force]]
kind = "point"
point = [0.2, 0.3]
direction = [1.0, 0.1]
strength = 7.0
radius = 0.1
formula = "sin(2*pi*t)"
"""
    recipe = Recipe.parse(text)
    assert len(recipe.force) == 2
    work = Work((Entry("Open", recipe, 0), Entry("Name", recipe.edited(name="b", map=None), 0)), 0, recipe)
    _, found = read(b"".join(beginning(ORIGIN, work)))
    assert same(found, work)
    assert found.saved is found.entries[0].recipe


def test_a_stroke_is_written_once() -> None:
    """However many states of the history it is in: a journal grows with what is done, and not with its square."""
    dice = random.Random(1)
    history = History(Recipe())
    for _ in range(200):
        now = history.recipe
        history.commit("Push", now.edited(stroke=(*now.stroke, a_stroke(dice, now.ticks))))
    data = b"".join(beginning(ORIGIN, Work(history.entries, history.index, history.entries[0].recipe)))
    assert data.count(b'"samples"') == 200
    amended = replace(history.entries[-1], recipe=history.recipe.edited(duration=9.0))
    before = Work(history.entries, history.index, history.entries[0].recipe)
    work = Work((*history.entries[:-1], amended), history.index, before.saved)
    assert len(continuation(work, before)) < 60
    # and where what comes after it can be redone
    before = replace(before, index=9)
    longer = replace(before.entries[9], recipe=before.recipe.edited(duration=9.0))
    work = replace(before, entries=(*before.entries[:9], longer, *before.entries[10:]))
    line = continuation(work, before)
    assert len(line) < 60
    found = read(b"".join(beginning(ORIGIN, before)) + line)[1]
    assert (found.index, found.entries) == (9, work.entries)

"""What a journal of unsaved work says: records in lines, each with its checksum, read until one is torn.

The first line names the format. Every other one is a checksum (CRC 32, in eight hexadecimal digits) and a JSON object:
what has changed since the record before. A recipe is told by how it differs from the one before it in the history, so
that a stroke is written once, in however many states of the history it is.
`recovery.py` writes and finds journals.
"""

from __future__ import annotations

import json
import os
import re
import sys
import zlib
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field, replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

from pydantic import create_model

from app.errors import UserError
from app.media import project as projects
from app.media.project import Project
from app.model.recipe import VERSION as RECIPE_VERSION
from app.model.recipe import Recipe
from app.model.schema import Model, frozen, plain
from app.model.undo import DEFAULT_BUDGET, LISTS, Entry, History

VERSION = 2
MOST_RECORDS = 200_000  # a minute of painting has some hundred, and now and then all is written anew in a few
MOST_DIGITS = 9  # of a version: no number is made of more
_HEAD = "fluidwarp journal"


class Damaged(Exception):
    """There is nothing in it that can be read."""


class Newer(Exception):
    """It was written by a newer fluidwarp."""


@dataclass(frozen=True)
class Origin:
    """Where the pictures of the work are.

    Attributes:
        name: what the person calls the work.
        folder: where the recipe's names of pictures start from.
        path: the project's own file, if it has one.
        embedded: pictures are kept in the project and not referred to.
        inside: the picture is nowhere but in the project's file.
        size, crc: of the bytes of the picture's file, by which it is known again.
        seen: the project's own file as it was then; see `Project.seen`.
    """

    name: str
    folder: str
    path: str | None
    embedded: bool
    inside: bool
    size: int
    crc: int
    seen: tuple[int, ...] | None = None

    @classmethod
    def of(cls, project: Project) -> Origin:
        path = os.path.abspath(project.path) if project.path is not None else None
        data, inside = project.data, project.keeper is not None
        folder = os.path.abspath(project.folder)
        return cls(project.name, folder, path, project.embedded, inside, len(data), zlib.crc32(data), project.seen)

    def is_of(self, data: bytes) -> bool:
        """True if `data` are the bytes of the picture that was worked on."""
        return len(data) == self.size and zlib.crc32(data) == self.crc


@dataclass(frozen=True)
class Work:
    """A work with all its edits, as it is at a moment.

    Attributes:
        entries: all of its history, from the oldest.
        index: which of them is the present.
        saved: the recipe as it was saved last, or opened.
        is_grid_automatic: nobody has chosen the grid.
        is_cut: more followed in the journal that it was read from, which is damaged.
    """

    entries: tuple[Entry, ...]
    index: int
    saved: Recipe
    is_grid_automatic: bool = False
    is_cut: bool = field(default=False, compare=False)

    @property
    def recipe(self) -> Recipe:
        return self.entries[self.index].recipe

    @property
    def edits(self) -> tuple[int, int, int]:
        """What every edit, undo and redo makes another, and the fluid's coming to rest does not."""
        return len(self.entries), self.index, self.entries[self.index].number

    @property
    def strokes(self) -> int:
        """How many strokes there are, with those that have been undone."""
        recipes = [entry.recipe for entry in self.entries[self.index :]]
        return max(len(recipe.stroke) + sum(edit.kind == "stroke" for edit in recipe.mask) for recipe in recipes)

    @property
    def handles(self) -> int:
        """How many handles and pins there are, likewise."""
        return max(len(entry.recipe.handle) + len(entry.recipe.pin) for entry in self.entries[self.index :])

    @property
    def is_unsaved(self) -> bool:
        """True if something would be lost: the present, or what can be redone."""
        return self.recipe != self.saved or self.index < len(self.entries) - 1

    @property
    def history(self) -> History:
        return History.restored(self.entries, self.index)


# -- writing ----------------------------------------------------------------------------------------------------------


def beginning(origin: Origin, work: Work) -> Iterator[bytes]:
    """The lines of a new journal that holds all of a work."""
    yield f"{_HEAD} {VERSION} {RECIPE_VERSION}\n".encode()
    first, *_ = work.entries
    yield _line({"origin": asdict(origin), "add": [_described(first, Recipe())], "index": 0})
    for number, (before, entry) in enumerate(pairwise(work.entries), 1):
        yield _line({"add": [_described(entry, before.recipe)], "index": number})
    # What was saved is mostly one of the entries; otherwise it is the present but for a few ticks of coming to rest.
    same = (number for number, entry in enumerate(work.entries) if entry.recipe is work.saved)
    nearest = next(same, work.index)
    saved = [nearest, _difference(work.saved, work.entries[nearest].recipe)]
    yield _line({"index": work.index, "saved": saved, "automatic": work.is_grid_automatic})


def continuation(work: Work, before: Work) -> bytes:
    """The line that makes `before`, which has been written, `work`."""
    old, new = before.entries, work.entries
    # The oldest entries go where a history grows too large.
    dropped = next((number for number, entry in enumerate(old) if entry is new[0]), 0)
    old = old[dropped:]
    kept = next((number for number, pair in enumerate(zip(old, new, strict=False)) if pair[0] is not pair[1]), None)
    kept = min(len(old), len(new)) if kept is None else kept
    same = (
        not dropped
        and kept == before.index == work.index < len(old) == len(new)
        and old[kept].name == new[kept].name
        and all(mine is theirs for mine, theirs in zip(old[kept + 1 :], new[kept + 1 :], strict=True))
    )
    if same and work.is_grid_automatic == before.is_grid_automatic:
        # The same edit, while the fluid comes to rest.
        return _line({"amend": _difference(new[kept].recipe, old[kept].recipe)})
    record: dict[str, Any] = {"drop": dropped, "keep": kept, "index": work.index}
    record["automatic"] = work.is_grid_automatic
    earlier = [new[kept - 1].recipe if kept else Recipe(), *(entry.recipe for entry in new[kept:])]
    record["add"] = [_described(entry, recipe) for entry, recipe in zip(new[kept:], earlier, strict=False)]
    return _line(record)


def _described(entry: Entry, before: Recipe) -> tuple[str, int, dict[str, Any]]:
    return entry.name, entry.nbytes, _difference(entry.recipe, before)


def _difference(recipe: Recipe, before: Recipe) -> dict[str, Any]:
    """What of `recipe` is not as in `before`; of lists, how many items stay, and those that follow."""
    changed: dict[str, Any] = {}
    for key in Recipe.model_fields:
        mine, theirs = getattr(recipe, key), getattr(before, key)
        if mine is theirs or mine == theirs:
            continue
        if isinstance(mine, tuple):
            kept = _agreeing(mine, theirs)
            changed[key] = [kept, mine[kept:]]
        else:
            changed[key] = mine
    return changed


def _agreeing(mine: tuple[Any, ...], theirs: tuple[Any, ...]) -> int:
    """How many of the first items are the same."""
    both = min(len(mine), len(theirs))
    if mine[:both] == theirs[:both]:
        return both
    return next(number for number, pair in enumerate(zip(mine, theirs, strict=False)) if pair[0] != pair[1])


def _line(record: dict[str, Any]) -> bytes:
    # JSON's floats are Python's own, which are read back bit for bit; line ends and foreign letters are escaped.
    text = json.dumps(record, default=plain, separators=(",", ":"), allow_nan=False).encode()
    return b"%08x %s\n" % (zlib.crc32(text), text)


# -- reading ----------------------------------------------------------------------------------------------------------


def read(data: bytes) -> tuple[Origin, Work]:
    """The work in a journal, up to the last record that is whole; what comes after a torn one is not followed.

    It says what it changes in what is lost: and a stroke in a picture that lacks one before it is not what was painted.

    Raises:
        Damaged: if not even its beginning is whole.
        Newer: if it was written by a newer fluidwarp.
    """
    head, *lines = data.split(b"\n", MOST_RECORDS)[:-1] or [b""]
    words = head.decode("ascii", "replace").rsplit(" ", 2)
    if len(words) != 3 or words[0] != _HEAD or not (words[1].isdecimal() and words[2].isdecimal()):
        raise Damaged
    if max(map(len, words[1:])) > MOST_DIGITS or int(words[1]) > VERSION or int(words[2]) > RECIPE_VERSION:
        raise Newer
    reader = _Reader()
    failures = (ValueError, TypeError, KeyError, IndexError, AttributeError, RecursionError)
    is_cut = False
    for number, line in enumerate(lines):
        try:
            reader.follow(_record(line))
        except failures:
            is_cut = any(map(_is_whole, lines[number:]))  # and not just the end of what a kill or a power cut leaves
            break
    if reader.origin is None or not reader.entries:
        raise Damaged
    entries = tuple(reader.entries)
    return reader.origin, Work(entries, reader.index, reader.saved, reader.is_grid_automatic, is_cut)


def _record(line: bytes) -> dict[str, Any]:
    if not _is_whole(line):
        raise ValueError
    return json.loads(line[9:])


def _is_whole(line: bytes) -> bool:
    return re.match(rb"[0-9a-fA-F]{8} ", line) is not None and int(line[:8], 16) == zlib.crc32(line[9:])


class _Reader:
    """A work as one record after the other says; one that says no such thing raises, and changes nothing."""

    def __init__(self) -> None:
        self.origin: Origin | None = None
        self.entries: list[Entry] = []
        self.index = 0
        self.saved = Recipe()
        self.is_grid_automatic = False
        self._nbytes = 0  # that the lists of the entries take, whatever these share

    def follow(self, record: dict[str, Any]) -> None:
        if self.origin is None:
            origin = _origin(record["origin"])
            self._follow(record)
            self.origin = origin
        else:
            self._follow(record)

    def _follow(self, record: dict[str, Any]) -> None:
        entries = self.entries
        if "amend" in record:
            entry = entries[self.index]
            entries[self.index] = replace(entry, recipe=_changed(entry.recipe, record["amend"]))
            self._nbytes += _listed(entries[self.index].recipe) - _listed(entry.recipe)
            return
        start = _count(record.get("drop", 0), len(entries))
        end = start + _count(record.get("keep", len(entries) - start), len(entries) - start)
        before = entries[end - 1].recipe if end > start else Recipe()
        nbytes = self._nbytes - sum(_listed(entry.recipe) for entry in (*entries[:start], *entries[end:]))
        added = list[Entry]()
        for name, own, changes in record.get("add", ()):
            before = _changed(before, changes)
            added.append(Entry(_text(name), before, _count(own)))
            nbytes += _listed(before)
            if nbytes > 2 * DEFAULT_BUDGET and end - start + len(added) > 1:  # a history lets the oldest go before that
                raise ValueError

        def entry_at(number: Any) -> Entry:
            place = start + _count(number, end - start + len(added) - 1)
            return entries[place] if place < end else added[place - end]

        index = record["index"]
        entry_at(index)
        saved = self.saved if entries else entry_at(0).recipe
        if "saved" in record:
            nearest, changes = record["saved"]
            saved = _changed(entry_at(nearest).recipe, changes)
        entries[end:] = added
        del entries[:start]
        self.index, self.saved, self._nbytes = index, saved, nbytes
        self.is_grid_automatic = bool(record.get("automatic", self.is_grid_automatic))


def _origin(told: dict[str, Any]) -> Origin:
    origin = Origin(**told)
    flags = origin.embedded, origin.inside
    if not all(isinstance(flag, bool) for flag in flags) or (origin.inside and origin.path is None):
        raise ValueError
    for text in (origin.name, origin.folder, "" if origin.path is None else origin.path):
        _text(text)
    for number in (origin.size, origin.crc):
        _count(number)
    if origin.seen is None:
        return origin
    if not isinstance(origin.seen, list) or any(type(number) is not int for number in origin.seen):
        raise ValueError
    return replace(origin, seen=tuple(origin.seen))


def _text(value: Any) -> str:
    """A text that may be a name, as all of a journal's are."""
    if not isinstance(value, str) or b"\0" in os.fsencode(value):
        raise ValueError
    return value


def _count(value: Any, most: int = sys.maxsize) -> int:
    """A whole number from 0 to `most`."""
    if type(value) is not int or not 0 <= value <= most:
        raise ValueError
    return value


def _listed(recipe: Recipe) -> int:
    """Bytes of a recipe's lists, without what is in them, as `History` counts them."""
    return 1024 + 8 * sum(len(getattr(recipe, name)) for name in LISTS)


def _changed(recipe: Recipe, changes: dict[str, Any]) -> Recipe:
    parts = {}
    for key, value in changes.items():
        before = getattr(recipe, key)
        if isinstance(before, tuple):
            kept, items = value
            _count(kept, len(before))
            parts[key] = (*before[:kept], *_valid(key, items))
        else:
            parts[key] = _valid(key, value)
    return recipe.edited(**parts) if parts else recipe


def _valid(key: str, value: Any) -> Any:
    """The value of a key of a recipe, as far as the key itself says what it may be."""
    if key == "picture" and value is not None:
        _alone(key).model_validate({key: _text(value).encode("utf-8", "replace").decode()})
        return value  # which need not be UTF-8, as no recipe's text can say
    return getattr(_alone(key).model_validate({key: frozen(value)}), key)


@cache
def _alone(key: str) -> type[Model]:
    """A model of nothing but this key of a recipe."""
    field = Recipe.model_fields[key]
    fields: dict[str, Any] = {key: (field.annotation, field)}
    return create_model(key, __base__=Model, **fields)


# -- the pictures -----------------------------------------------------------------------------------------------------


def picture_file(origin: Origin, recipe: Recipe) -> Path:
    """The file that the picture of the work is in."""
    if origin.inside and origin.path is not None:
        return Path(origin.path)
    return Path(origin.folder) / (recipe.picture or "")


def project_of(origin: Origin, recipe: Recipe) -> Project:
    """The project that was worked on, with `recipe` for its recipe and its picture read again.

    Raises:
        UserError: if the picture is gone, or cannot be read.
    """
    path = Path(origin.path) if origin.path is not None else None
    if not origin.inside:
        source = picture_file(origin, recipe)
        try:
            found, data = projects.read_source(source)
            folder, clip = Path(origin.folder), found.clip
            return Project(recipe, found.picture, data, folder, path, origin.embedded, clip=clip, seen=origin.seen)
        except (UserError, OSError):
            # A picture that was put into the project when it was saved is there still.
            if path is None or not origin.embedded or not os.path.exists(path):
                raise
    assert path is not None
    return replace(projects.load(path), recipe=recipe, seen=origin.seen)

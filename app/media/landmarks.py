"""Correspondences in files of other programs: CSV, .pts of face databases (300-W), .tps of tpsDig."""

from __future__ import annotations

import csv
import os
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from app.errors import UserError
from app.media.files import replacing
from app.media.inputs import read_input
from app.media.outlines import SPACING, is_closed, paired

MOST_BYTES = 2**20
FARTHEST = 1e6  # pixels: nobody's landmark lies beyond
TINY = 4  # pixels along a side: in a smaller picture what lies within one may be meant
ENDINGS = (".csv", ".pts", ".tps")

COLUMNS = "x0", "y0", "x1", "y1"
CURVE = "curve"  # the column of a CSV file that names the curve a place is on

Lines = Iterator[tuple[int, str]]
Size = tuple[int, int]
"""(width, height) of the picture in pixels."""


class Pairs(NamedTuple):
    """Places that correspond.

    Attributes:
        places: (n, 2, 2), of each where it is and where it should be, as fractions of the picture's width and height.
        curves: the curve that each lies on, in the order in which it is gone along; "" of points by themselves.
        closed: the names of those curves that end where they begin, which is listed once.
    """

    places: np.ndarray
    curves: tuple[str, ...]
    closed: frozenset[str] = frozenset()

    @classmethod
    def points(cls, places: np.ndarray) -> Pairs:
        """Points by themselves, (n, 2, 2)."""
        return cls(places, ("",) * len(places))


def read_pairs(paths: Sequence[Path], size: Size) -> Pairs:
    """The correspondences in a CSV file, a .tps file of two specimens, or two files of one set of landmarks each.

    CSV has x0, y0, x1, y1 in pixels from the picture's top-left corner, y down, between commas, semicolons or tabs; in
    the latter two a comma is that of decimals. A header gives their order, and may name one column more, `curve`:
    places of one name are the corners of a polyline and of the one it should become, which need not have as many (x0
    and y0, or x1 and y1, may be empty), and both are divided evenly along their lengths. .pts counts pixels from 1, as
    is the custom, so that (1, 1) is the middle of the first; .tps counts y from the picture's lower edge.

    Raises:
        UserError: naming the file and the line, if they are not two sets of as many landmarks, or if all
            of them lie within a pixel of where it counts from, as fractions would.
    """
    files, has = " and ".join(str(path) for path in paths), "has" if len(paths) == 1 else "have"
    if len(paths) == 1 and check_ending(paths[0]) == ".csv":
        found = _read_csv(paths[0], _lines(paths[0]), SPACING * max(size))
        if not len(found.places):
            raise UserError(f"{files} has no pairs")
        _check_spread(files, [found.places], size)
        return found._replace(places=found.places / size)
    sets, counted = list[np.ndarray](), list[np.ndarray]()
    for path in paths:
        found = _read(path, size)
        sets += found
        counted += [points - _origin(path, size) for points in found]
    if len(sets) != 2:
        found = f"{len(sets)} sets of landmarks" if len(sets) != 1 else "one set of landmarks"
        said = f"{files} {has} {found}; pairs need two, where the points are and where they should be"
        raise UserError(said, in_window=f"{said}: drop two files at once")
    if len(sets[0]) != len(sets[1]):
        said = f"{files}: {len(sets[0])} landmarks cannot be paired with {len(sets[1])}"
        raise UserError(f"{said}; give two sets of as many points")
    if not len(sets[0]):
        raise UserError(f"{files} {has} no pairs")
    _check_spread(files, counted, size)
    return Pairs.points(np.stack(sets, axis=1) / size)


def write_pairs(path: Path, pairs: Pairs, size: Size) -> None:
    """Write correspondences as `read_pairs` gives them; .pts has one set only, and gets where the points should be.

    Only CSV knows curves, a closed one by its first place, which it ends with. In the others their points are points,
    as is in CSV the only one that is left of a curve.

    Raises:
        UserError: if it cannot be written, or the ending is none of `ENDINGS`.
    """
    pixels = pairs.places * size
    match check_ending(path):
        case ".csv":
            rows = [",".join(map(_shown, pair)) for pair in pixels.reshape(-1, 4)]
            lines = [",".join(COLUMNS), *rows]
            if any(pairs.curves):
                lines, last = [f"{CURVE},{lines[0]}"], {name: number for number, name in enumerate(pairs.curves)}
                for number, name in enumerate(pairs.curves):
                    named = _quoted(name) if pairs.curves.count(name) > 1 else ""
                    again = (
                        [pairs.curves.index(name)] if named and name in pairs.closed and number == last[name] else []
                    )
                    lines += (f"{named},{rows[each]}" for each in (number, *again))
        case ".pts":
            rows = (f"{_shown(x)} {_shown(y)}" for x, y in pixels[:, 1] + 0.5)
            lines = ["version: 1", f"n_points: {len(pixels)}", "{", *rows, "}"]
        case _:
            lines = []
            for number in (0, 1):
                rows = (f"{_shown(x)} {_shown(size[1] - y)}" for x, y in pixels[:, number])
                lines += [f"LM={len(pixels)}", *rows, f"ID={number}"]
    with replacing(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def check_ending(path: Path) -> str:
    """The ending of a file of landmarks. Raises `UserError` if it is none."""
    if (ending := path.suffix.lower()) not in ENDINGS:
        raise UserError(f"{path}: pairs are in files that end with {', '.join(ENDINGS)}")
    return ending


def _quoted(name: str) -> str:
    """A name as CSV has it: what would part it, or make a remark of its line, is in quotes."""
    return '"' + name.replace('"', '""') + '"' if any(each in name for each in '\t;,"#') else name


def _shown(number: float) -> str:
    return f"{number:.10g}"


def _read(path: Path, size: Size) -> list[np.ndarray]:
    """The sets of landmarks (n, 2) in a file, in pixels from the top-left corner."""
    match check_ending(path):
        case ".csv":
            found = _read_csv(path, _lines(path), SPACING * max(size)).places
            return [found[:, 0], found[:, 1]]
        case ".pts":
            return [_read_pts(path, _lines(path)) - 0.5]
        case _:
            return [points * (1, -1) + (0, size[1]) for points in _read_tps(path, _lines(path))]


def _origin(path: Path, size: Size) -> tuple[float, float]:
    """Where a file counts its pixels from, in pixels from the top-left corner."""
    return {".pts": (-0.5, -0.5), ".tps": (0.0, float(size[1]))}.get(check_ending(path), (0.0, 0.0))


def _check_spread(files: str, counted: list[np.ndarray], size: Size) -> None:
    """Raise `UserError` if all places, (..., 2) from where a file counts, are so near that they may be fractions."""
    if min(size) > TINY and all((np.abs(places) <= 1).all() for places in counted):
        width, height = size
        said = "all of it lies within one pixel of the corner, as fractions of the picture would"
        raise UserError(f"{files}: {said}; pairs are in pixels, so multiply x by {width} and y by {height}")


def _lines(path: Path) -> Lines:
    """The numbered lines of a file that say something."""
    try:
        data = read_input(path, "file of pairs", MOST_BYTES)
        text = data.decode("utf-16" if data.startswith((BOM_UTF16_LE, BOM_UTF16_BE)) else "utf-8-sig")
    except UnicodeDecodeError:
        raise UserError(f"Cannot read {path}: it is not text, or not saved as UTF-8 or UTF-16.") from None
    lines = ((number, line.strip()) for number, line in enumerate(text.splitlines(), 1))
    return ((number, line) for number, line in lines if line and not line.startswith("#"))


def _read_csv(path: Path, lines: Lines, spacing: float) -> Pairs:
    """Pairs in pixels; the points of curves are so many pixels apart at most."""
    columns, groups = list[str](COLUMNS), dict[tuple[str, int], tuple[list[list[float]], list[list[float]]]]()
    for first, (number, line) in enumerate(lines):
        curve_at = columns.index(CURVE) if CURVE in columns else None
        words = _words(line, (len(columns),) if first else (len(COLUMNS), len(COLUMNS) + 1), curve_at)
        if first == 0 and not any(map(_is_number, words)):
            columns = [word.lower() for word in words]
            if sorted(columns) not in (sorted(COLUMNS), sorted((CURVE, *COLUMNS))):
                named = f"{','.join(COLUMNS)} in any order, and perhaps {CURVE}"
                raise _bad(path, number, f"expected numbers, or the columns {named}; and not {line[:40]!r}")
            continue
        wanted = ",".join(columns)
        if len(words) != len(columns):
            raise _bad(path, number, f"expected {wanted}, and not {line[:40]!r}")
        row = dict(zip(columns, words, strict=True))
        curve = row.get(CURVE, "")
        sides = [[row[name] for name in side] for side in (COLUMNS[:2], COLUMNS[2:])]
        for side, places in zip(sides, groups.setdefault((curve, 0 if curve else number), ([], [])), strict=True):
            if any(side) or not curve:
                places.append(_numbers(path, number, line, side, 2, wanted))
    pairs, curves, closed = [np.zeros((0, 2, 2))], [], set[str]()
    for (curve, _), (here, there) in groups.items():
        try:
            found = paired(np.array(here), np.array(there), spacing) if curve else np.array([[*here, *there]])
        except ValueError as error:
            raise UserError(f"{path}: the curve {curve[:40]!r} {error}") from None
        pairs.append(found)
        curves += [curve] * len(found)
        closed |= {curve} if curve and is_closed(np.array(here)) else set()
    return Pairs(np.concatenate(pairs), tuple(curves), frozenset(closed))


def _words(line: str, counts: tuple[int, ...], curve_at: int | None) -> list[str]:
    """What is between the tabs, semicolons or commas of a line, whichever give one of these counts.

    Between the former two a number may have a decimal comma; the word `curve_at` is a curve's name, and none.
    """
    words = list[str]()
    for separator in filter(line.__contains__, "\t;,"):
        try:
            words = [word.strip() for word in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]
        except csv.Error:  # a word that is too long
            continue
        if len(words) in counts:
            pointed = words if separator == "," else [word.replace(",", ".", 1) for word in words]
            both = enumerate(zip(words, pointed, strict=True))
            return [point if at != curve_at and _is_number(point) else word for at, (word, point) in both]
    return words


def _read_pts(path: Path, lines: Lines) -> np.ndarray:
    count = None
    for number, line in lines:
        key, _, value = (part.strip() for part in line.partition(":"))
        key = key.lower()
        if key == "n_points":
            count = _count(path, number, value)
        elif line == "{":
            break
        elif key != "version":
            raise _bad(path, number, f"expected version, n_points or {{, and not {line[:40]!r}")
    else:
        raise UserError(f"{path} is not a .pts file: it has no {{ before its points; save it as one")
    rows = []
    for number, line in lines:
        if line == "}":
            if count not in (None, len(rows)):
                raise _bad(path, number, f"n_points says {count}, and there are {len(rows)}")
            for more, line in lines:
                raise _bad(path, more, f"one set of landmarks ends with }}, and not {line[:40]!r} after it")
            return np.reshape(rows, (-1, 2))
        rows.append(_numbers(path, number, line, line.split(), 2, "x y"))
    raise UserError(f"{path} ends in the middle of its points: it has no }}; get it again")


def _read_tps(path: Path, lines: Lines) -> list[np.ndarray]:
    """Of each specimen its landmarks, and after them the points of its curves."""
    specimens: list[list[list[float]]] = []
    for number, line in lines:
        key, equals, value = (part.strip() for part in line.partition("="))
        if not equals:
            raise _bad(path, number, f"expected a key such as LM=, and not {line[:40]!r}")
        if key.upper() == "LM3":
            raise _bad(path, number, "these landmarks are in space, and the picture is flat")
        if key.upper() == "LM":
            specimens.append([])
        elif key.upper() != "POINTS":
            continue
        if not specimens:
            raise _bad(path, number, "points before the first LM=")
        count = _count(path, number, value)
        for at, words in islice(lines, count):
            specimens[-1].append(_numbers(path, at, words, words.split(), 2, "x y"))
            count -= 1
        if count:
            raise _bad(path, number, f"{count} more points are announced than the file has")
    return [np.reshape(points, (-1, 2)) for points in specimens]


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _numbers(path: Path, number: int, line: str, words: list[str], count: int, wanted: str) -> list[float]:
    values = [float(word) for word in words if _is_number(word)]
    if len(words) != count or len(values) != count:
        raise _bad(path, number, f"expected {wanted}, and not {line[:40]!r}")
    if not all(abs(value) <= FARTHEST for value in values):
        raise _bad(path, number, f"no pixel lies at {line[:40]!r}")
    return values


def _count(path: Path, number: int, word: str) -> int:
    if not (word.isascii() and word.isdigit() and len(word) < 8):
        raise _bad(path, number, f"expected how many points follow, and not {word[:40]!r}")
    return int(word)


def _bad(path: str | os.PathLike[str], number: int, why: str) -> UserError:
    return UserError(f"{path}, line {number}: {why}")

"""Point correspondences in files of other programs: CSV, .pts of face databases (300-W), .tps of tpsDig."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path

import numpy as np

from app.errors import UserError
from app.media.files import replacing
from app.media.inputs import read_input

MOST_BYTES = 4 * 2**20
FARTHEST = 1e6  # pixels: nobody's landmark lies beyond
ENDINGS = (".csv", ".pts", ".tps")

Lines = Iterator[tuple[int, str]]
Size = tuple[int, int]
"""(width, height) of the picture in pixels."""


def read_pairs(paths: Sequence[Path], size: Size) -> np.ndarray:
    """The correspondences in a CSV file, a .tps file of two specimens, or two files of one set of landmarks each.

    CSV has x0, y0, x1, y1 in pixels from the picture's top-left corner, y down; .pts counts pixels from 1, as is the
    custom, so that (1, 1) is the middle of the first; .tps counts y from the picture's lower edge.

    Returns:
        (n, 2, 2): of each pair where it is and where it should be, as fractions of width and height.

    Raises:
        UserError: naming the file and the line, or if they are not two sets of as many landmarks.
    """
    sets: list[np.ndarray] = []
    for path in paths:
        sets += _read(path, size)
    told = " and ".join(str(path) for path in paths)
    if len(sets) != 2:
        found = f"{len(sets)} sets of landmarks" if len(sets) != 1 else "one set of landmarks"
        raise UserError(f"{told} has {found}; pairs need two, where the points are and where they should be")
    if len(sets[0]) != len(sets[1]):
        raise UserError(f"{told}: {len(sets[0])} landmarks cannot be paired with {len(sets[1])}")
    if not len(sets[0]):
        raise UserError(f"{told} has no pairs")
    return np.stack(sets, axis=1) / size


def write_pairs(path: Path, pairs: np.ndarray, size: Size) -> None:
    """Write correspondences as `read_pairs` gives them; .pts has one set only, and gets where the points should be.

    Raises:
        UserError: if it cannot be written, or the ending is none of `ENDINGS`.
    """
    pixels = pairs * size
    match check_ending(path):
        case ".csv":
            lines = ["x0,y0,x1,y1", *(",".join(map(_shown, pair)) for pair in pixels.reshape(-1, 4))]
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


def _shown(number: float) -> str:
    return f"{number:.10g}"


def _read(path: Path, size: Size) -> list[np.ndarray]:
    """The sets of landmarks (n, 2) in a file, in pixels from the top-left corner."""
    ending = check_ending(path)
    try:
        text = read_input(path, "file of pairs", MOST_BYTES).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise UserError(f"Cannot read {path}: it is not text, or not saved as UTF-8.") from None
    lines = ((number, line.strip()) for number, line in enumerate(text.splitlines(), 1))
    filled = ((number, line) for number, line in lines if line and not line.startswith("#"))
    match ending:
        case ".csv":
            return _read_csv(path, filled)
        case ".pts":
            return [_read_pts(path, filled) - 0.5]
        case _:
            return [points * (1, -1) + (0, size[1]) for points in _read_tps(path, filled)]


def _read_csv(path: Path, lines: Lines) -> list[np.ndarray]:
    rows: list[list[float]] = []
    for first, (number, line) in enumerate(lines):
        words = re.split(r"\s*[,;\t]\s*", line)
        if first == 0 and not any(map(_is_number, words)):
            continue  # the header
        rows.append(_numbers(path, number, line, words, 4, "x0,y0,x1,y1"))
    found = np.reshape(rows, (-1, 4))
    return [found[:, :2], found[:, 2:]]


def _read_pts(path: Path, lines: Lines) -> np.ndarray:
    count = None
    for number, line in lines:
        key, _, value = (part.strip() for part in line.partition(":"))
        if key == "n_points":
            count = _count(path, number, value)
        elif line == "{":
            break
        elif key != "version":
            raise _bad(path, number, f"expected version, n_points or {{, and not {line[:40]!r}")
    else:
        raise UserError(f"{path} is no .pts file: it has no {{ before its points")
    rows = []
    for number, line in lines:
        if line == "}":
            if count not in (None, len(rows)):
                raise _bad(path, number, f"n_points says {count}, and there are {len(rows)}")
            return np.reshape(rows, (-1, 2))
        rows.append(_numbers(path, number, line, line.split(), 2, "x y"))
    raise UserError(f"{path} ends in the middle of its points: it has no }}")


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

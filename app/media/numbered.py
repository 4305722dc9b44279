"""Numbered files: the names of a sequence's files, which of them are there, and how they are told in a line."""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Sequence
from itertools import pairwise
from pathlib import Path

from app.errors import UserError
from app.media.inputs import cannot_read, no_name

MOST_RUNS = 8  # of numbers, and names, that are told

NUMBER = re.compile(r"%(?:0(\d{1,2}))?d|#{2,}")
"""What stands for the number in the name of a sequence's files: %d, %04d, or #### for %04d."""


NO_NUMBER = re.compile(r"%\d+d")
"""What looks like it to one who knows printf, and is taken as it stands."""


def is_sequence(path: str | os.PathLike[str]) -> bool:
    """Whether `path` numbers its files, as `name.%04d.png` and `name.####.png` do."""
    return NUMBER.search(Path(path).name) is not None


def check_number(path: str | os.PathLike[str]) -> None:
    """Raise `UserError` for a name, of what is written, that was to number its files and does not."""
    if found := NO_NUMBER.search(NUMBER.sub("", Path(path).name)):
        mend = "write %d, or %04d for 4 digits (99 at most)"
        raise UserError(f"Cannot write {path}: {found[0]} does not number its files; {mend}.")


def stands_for_files(path: str | os.PathLike[str]) -> bool:
    """Whether `path`, which is read, numbers its files: if there is a file of exactly this name, it is that file."""
    return is_sequence(path) and not os.path.lexists(path)


def numbered(pattern: str | os.PathLike[str], number: int) -> Path:
    """The file of a sequence that has this number."""
    path = Path(pattern)
    return path.with_name(NUMBER.sub(lambda found: f"{number:0{_digits(found)}d}", path.name, count=1))


def _digits(found: re.Match[str]) -> int:
    """How many a number has at least."""
    return len(found[0]) if found[0].startswith("#") else int(found[1] or 0)


def unnumbered(pattern: str | os.PathLike[str]) -> str:
    """The stem of a sequence's name without the number and what parts it from the rest: `plate` of `plate.%04d.exr`."""
    stem = Path(pattern).stem
    return NUMBER.sub("", stem, count=1).strip("._- ") or "frames" if is_sequence(pattern) else stem


def number_in(pattern: str | os.PathLike[str], name: str) -> int | None:
    """The number of a file of the sequence `pattern`, by its name; None if it is none of its files."""
    wanted = Path(pattern).name
    found = NUMBER.search(wanted)
    if found is None:
        return None
    match = re.fullmatch(
        rf"{re.escape(wanted[: found.start()])}([0-9]{{1,18}}){re.escape(wanted[found.end() :])}", name
    )
    return int(match[1]) if match and numbered(wanted, int(match[1])).name == name else None


def numbered_files(pattern: str | os.PathLike[str]) -> dict[int, Path]:
    """The files of a sequence that are there, in the order of their numbers. Raises `UserError` if there are none."""
    folder = Path(pattern).parent
    try:
        names = os.listdir(folder)
    except FileNotFoundError:
        raise UserError(f"Cannot read {pattern}: there is no folder {folder}; check the name.") from None
    except OSError as error:
        raise cannot_read(pattern, error) from None
    except ValueError as error:
        raise no_name(pattern, error) from None
    found = sorted((number, name) for name in names if (number := number_in(pattern, name)) is not None)
    if not found:
        raise UserError(f"Cannot read {pattern}: there is no such file; check the name.")
    return {number: folder / name for number, name in found}


def is_there(path: str | os.PathLike[str]) -> bool:
    """Whether there is a file of this name, or of a sequence any of its files."""
    if not is_sequence(path):
        return os.path.exists(path)
    try:
        return any(number_in(path, name) is not None for name in os.listdir(Path(path).parent))
    except OSError:
        return False


def sequence_of(file: Path) -> Path:
    """The sequence that a file is of, by the last number in its name. Raises `UserError` if there is none in it."""
    found = re.search(r"[0-9]+(?=[^0-9]*$)", file.stem)
    if found is None:
        raise UserError(f"There is no number in the name {file.name}; choose one of several numbered files.")
    before, after = file.name[: found.start()], file.name[found.end() :]
    patterns = [file.with_name(f"{before}{number}{after}") for number in (f"%0{len(found[0])}d", "%d")]
    return max(
        patterns, key=lambda pattern: sum(number_in(pattern, name) is not None for name in os.listdir(file.parent))
    )


def check_numbers(pattern: str | os.PathLike[str], there: Collection[int], wanted: range) -> None:
    """Raise `UserError`, naming the numbers, if some of the `wanted` files of a sequence are not there."""
    present = sorted(number for number in there if number in wanted)
    count = max(wanted.stop - wanted.start, 0)
    if len(present) == count:
        return
    # A name may have any number: of what lies between two only the ends are looked at.
    ends = pairwise([wanted.start - 1, *present, wanted.stop])
    runs = [(before + 1, after - 1) for before, after in ends if after - before > 1]
    named = [f"{first}-{last}" if first < last else f"{first}" for first, last in runs]
    missing = count - len(present)
    listed = ", ".join(named[:MOST_RUNS]) + (f" and others, {missing} in all" if len(named) > MOST_RUNS else "")
    wants = f"{wanted.start}-{wanted.stop - 1}" if count > 1 else f"{wanted.start}"
    frames = "frames" if missing > 1 else "frame"
    said = f"Cannot read {pattern}: of {wants} it lacks the {frames} {listed}"
    raise UserError(
        f"{said}; make them, or give --frames.", in_window=f"{said}; make them, or number the others without a gap."
    )


def listed(names: Sequence[str]) -> tuple[str, bool]:
    """Names in a line, those that differ in a number alone as one, such as "a.png, plate.1001-1004,1010.exr".

    And whether these are all.
    """
    alike: dict[tuple[str, ...], list[str]] = {}
    for name in names:
        stem = os.path.splitext(name)[0]
        found = re.search(r"[0-9]+(?=[^0-9]*$)", stem)
        around = (name[: found.start()], name[found.end() :]) if found else (name,)
        alike.setdefault(around, []).append(found[0] if found else "")
    told, left = list[str](), len(names)
    for (before, *after), numbers in list(alike.items())[:MOST_RUNS]:
        runs: list[list[str]] = []
        for number in sorted(numbers, key=lambda number: (len(number.lstrip("0")), number)):
            if runs and runs[-1][-1] and number == f"{int(runs[-1][-1]) + 1:0{len(runs[-1][-1])}d}":
                runs[-1].append(number)
            else:
                runs.append([number])
        left -= sum(map(len, runs[:MOST_RUNS]))
        told.append(
            before + ",".join("-".join(dict.fromkeys((run[0], run[-1]))) for run in runs[:MOST_RUNS]) + "".join(after)
        )
    return ", ".join(told) + (f" and {left} more" if left else ""), not left

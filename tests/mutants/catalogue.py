"""The catalogue: TOML files of this folder, one for each room, of which every entry is a fault.

tests = "..."     # of all entries below that name none of their own
[[mutant]]
name = "..."      # what is wrong then
file = "..."      # where it is put in
old = "..."       # what stands there, exactly once
new = "..."       # what takes its place
tests = "..."     # pytest's arguments for the tests that should notice, from the root of the tree
"""

from __future__ import annotations

import shlex
import tomllib
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
KEYS = {"name", "file", "old", "new", "tests"}


class Stale(ValueError):
    """An entry that does not fit the tree any more, in a sentence that names it."""


@dataclass(frozen=True)
class Mutant:
    """One fault: in `file`, `old` becomes `new`; `tests`, pytest's arguments, should notice. `room`: its TOML file."""

    room: str
    name: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...]

    def text_in(self, root: Path) -> str:
        """The text of its file with the fault in it.

        Raises:
            Stale: if there is no such file, what is replaced does not stand in it exactly once, or nothing changes.
        """
        path = root / self.file
        if not path.is_file():
            raise Stale(f"{self.room}: {self.name}: there is no {self.file}")
        text = path.read_text("utf-8")
        if (found := text.count(self.old)) != 1:
            raise Stale(f"{self.room}: {self.name}: what is replaced stands {found} times in {self.file}, not once")
        if self.old == self.new:
            raise Stale(f"{self.room}: {self.name}: nothing is replaced")
        return text.replace(self.old, self.new)


def read() -> list[Mutant]:
    """All entries, by room.

    Raises:
        Stale: for one that lacks a key, has one that is unknown, names tests that are not there or a name twice.
    """
    mutants = []
    for path in sorted(HERE.glob("*.toml")):
        table = tomllib.loads(path.read_text("utf-8"))
        for entry in table["mutant"]:
            entry = {"tests": table.get("tests", "")} | entry
            if set(entry) != KEYS or not all(entry[key] for key in KEYS - {"new"}):
                raise Stale(f"{path.stem}: {entry.get('name')}: it must have the keys {', '.join(sorted(KEYS))}")
            tests = tuple(shlex.split(entry.pop("tests")))
            for name in tests:
                if name.startswith("tests/") and not (ROOT / name.split("::")[0]).exists():
                    raise Stale(f"{path.stem}: {entry['name']}: there is no {name}")
            mutants.append(Mutant(path.stem, **entry, tests=tests))
    names = [mutant.name for mutant in mutants]
    if doubled := {name for name in names if names.count(name) > 1}:
        raise Stale(f"there are two mutants of the name {doubled.pop()}")
    return mutants

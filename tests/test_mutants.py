"""The catalogue of mutants fits the tree: each fault can still be put in, exactly once."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from mutants.catalogue import ROOT, Mutant, Stale, read


def test_every_fault_can_be_put_in() -> None:
    stale = []
    for mutant in read():
        try:
            mutant.text_in(ROOT)
        except Stale as error:
            stale.append(str(error))
    assert not stale


def test_there_are_enough_of_them_in_every_room() -> None:
    rooms = Counter(mutant.file.rsplit("/", 1)[0].split("/codecs")[0] for mutant in read())
    assert sum(rooms.values()) >= 120
    few = (
        "app/model",
        "app/media",
        "app/work",
        "app/ui",
        "app",
        "solver",
        "solver/brush",
        "shaders/brush",
        "shaders/step",
    )
    assert all(rooms[room] >= 2 for room in few), rooms


@pytest.mark.parametrize(("text", "count"), [("a = 1\n", 0), ("a = 2\na = 2\n", 2)])
def test_a_fault_that_has_no_place_any_more_is_told(tmp_path: Path, text: str, count: int) -> None:
    (tmp_path / "a.py").write_text(text)
    with pytest.raises(Stale, match=f"stands {count} times in a.py"):
        Mutant("room", "name", "a.py", "a = 2", "a = 3", ("tests/a.py",)).text_in(tmp_path)

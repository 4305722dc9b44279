"""Names of numbered files, and what of them is missing."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.errors import UserError
from app.media.numbered import (
    check_numbers,
    is_sequence,
    is_there,
    listed,
    number_in,
    numbered,
    numbered_files,
    unnumbered,
)


@pytest.mark.parametrize(
    ("pattern", "number", "name", "stem"),
    [
        ("plate.%04d.exr", 7, "plate.0007.exr", "plate"),
        ("plate.%04d.exr", 123456, "plate.123456.exr", "plate"),
        ("plate_####.exr", 7, "plate_0007.exr", "plate"),
        ("plate-##.png", 7, "plate-07.png", "plate"),
        ("%d.png", 7, "7.png", "frames"),
        ("a%02db.png", 7, "a07b.png", "ab"),
    ],
)
def test_the_file_of_a_number_and_back(pattern: str, number: int, name: str, stem: str) -> None:
    assert is_sequence(pattern)
    assert numbered(f"folder/{pattern}", number) == Path("folder", name)
    assert number_in(pattern, name) == number
    assert unnumbered(pattern) == stem


def test_what_is_no_file_of_a_sequence() -> None:
    for name in ("a.7.png", "a.00007.png", "a.007.jpg", "b.007.png", "a.-07.png", "a.007.png.part", "a..png"):
        assert number_in("a.%03d.png", name) is None
    assert number_in("a.png", "a.png") is None
    assert [is_sequence(name) for name in ("a#.png", "a.png", "100%.png", "%04d/a.png")] == [False] * 4
    assert unnumbered("plate.exr") == "plate"


def test_files_are_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    for name in ("a.10.png", "a.9.png", "a.100.png", "a.txt"):
        (tmp_path / name).touch()
    assert [*numbered_files(tmp_path / "a.%d.png")] == [9, 10, 100]
    with pytest.raises(UserError, match="there is no such file"):
        numbered_files(tmp_path / "b.%d.png")
    with pytest.raises(UserError, match=r"there is no folder .*gone; check the name"):
        numbered_files(tmp_path / "gone" / "f.%d.png")


@pytest.mark.parametrize(
    ("pattern", "said"),
    [
        ("a.png/f.%d.png", "a part of its path is a file; check the name."),
        ("gone/f.%d.png", "there is no folder gone; check the name."),
        ("a\0b/f.%d.png", "no file has a NUL in its name; check the name."),
        ("f.%d.png", "there is no such file; check the name."),
        (f"{'x' * 300}/f.%d.png", "the name is too long; check it."),
    ],
)
def test_why_a_sequence_cannot_be_read_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, pattern: str, said: str
) -> None:
    (tmp_path / "a.png").touch()
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UserError) as raised:
        numbered_files(pattern)
    assert str(raised.value) == f"Cannot read {pattern}: {said}".replace("\0", "\\x00")


def test_whether_a_file_or_any_of_a_sequence_is_there(tmp_path: Path) -> None:
    """Where there is no such folder, or a file in its place, there is none."""
    (tmp_path / "a.07.png").touch()
    for name, found in (
        ("a.07.png", True), ("a.08.png", False), ("a.%02d.png", True), ("a.%03d.png", False), ("a.##.png", True),
        ("gone/a.png", False), ("gone/a.%02d.png", False), ("a.07.png/a.%02d.png", False),
    ):  # fmt: skip
        assert is_there(tmp_path / name) is found, name


@pytest.mark.parametrize(
    ("there", "wanted", "said"),
    [
        ([1, 3], range(1, 4), "of 1-3 it lacks the frame 2;"),
        ([], range(5, 6), "of 5 it lacks the frame 5;"),
        ([4], range(1, 8), "of 1-7 it lacks the frames 1-3, 5-7;"),
        (range(0, 17, 2), range(17), "the frames 1, 3, 5, 7, 9, 11, 13, 15;"),
        (range(0, 19, 2), range(19), "the frames 1, 3, 5, 7, 9, 11, 13, 15 and others, 9 in all;"),
        ([1, 10**18], range(1, 10**18 + 1), "it lacks the frames 2-999999999999999999;"),
    ],
)
def test_missing_numbers_are_named_in_runs_eight_at_most(there: list[int], wanted: range, said: str) -> None:
    with pytest.raises(UserError) as raised:
        check_numbers("a.%d.png", there, wanted)
    assert said in str(raised.value)
    if len(wanted) < 100:
        check_numbers("a.%d.png", wanted, wanted)


@pytest.mark.parametrize(
    ("names", "line"),
    [
        (["b.png", "a.png"], "b.png, a.png"),
        (["broken.png", "broken2.png", "broken3.png"], "broken.png, broken2-3.png"),
        (["broken", "broken2"], "broken, broken2"),
        ([f"plate.{number}.exr" for number in (1001, 1010, 1002, 1003, 1004)], "plate.1001-1004,1010.exr"),
        (["f.9.png", "f.10.png", "f.11.png", "g.09.png", "1.mp4"], "f.9-11.png, g.09.png, 1.mp4"),
        (["2024/a.png", "2025/a.png", "b.png"], "2024-2025/a.png, b.png"),
        ([f"x{number}.png" for number in range(0, 40, 2)], "x0,2,4,6,8,10,12,14.png and 12 more"),
        ([f"{letter}.png" for letter in "abcdefghij"], ", ".join(f"{c}.png" for c in "abcdefgh") + " and 2 more"),
    ],
)
def test_names_are_listed_in_a_line(names: list[str], line: str):
    assert listed(names) == (line, not line.endswith(" more"))

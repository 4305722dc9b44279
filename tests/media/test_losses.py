"""What of a file is lost, in words."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.media.clip import USUAL, Colours, uncoded
from app.media.losses import counted, lost, not_kept, unusual_colours


@pytest.mark.parametrize(
    ("primaries", "transfer", "said"),
    [
        (1, 13, ""),
        (2, 2, ""),
        (1, 6, ""),
        (1, 14, ""),
        (1, 15, ""),
        (9, 16, "BT.2020 PQ"),
        (9, 18, "BT.2020 HLG"),
        (5, 1, "BT.601"),
        (6, 1, "BT.601"),
        (10, 8, "XYZ linear"),
        (11, 4, "DCI-P3 gamma 2.2"),
        (12, 13, "Display P3"),
        (1, 5, "gamma 2.8"),
        (22, 17, "primaries 22 transfer 17"),
    ],
)
def test_colours_are_called_as_people_do(primaries: int, transfer: int, said: str) -> None:
    assert unusual_colours(primaries, transfer) == said


@pytest.mark.parametrize(
    ("codes", "colours"),
    [
        ((1, 13), USUAL),
        ((2, 2), USUAL),
        ((1, 6), USUAL),
        ((6, 1), None),
        ((5, 13), None),
        ((9, 1), Colours("bt2020", "bt709", "bt2020nc")),
        ((9, 16), Colours("bt2020", "smpte2084", "bt2020nc")),
        ((9, 18), Colours("bt2020", "arib-std-b67", "bt2020nc")),
        ((11, 14), Colours("smpte431", "bt709", "bt709")),
        ((12, 13), Colours("smpte432", "bt709", "bt709")),
        ((12, 16), Colours("smpte432", "smpte2084", "bt709")),
        ((1, 16), Colours("bt709", "smpte2084", "bt709")),
        ((1, 8), None),
        ((9, 8), None),
        ((16, 13), None),
        ((12, 9), None),
    ],
)
def test_what_a_picture_tells_of_its_colours_a_clip_is_given_or_nothing(
    codes: tuple[int, int], colours: Colours | None
) -> None:
    assert uncoded({b"cICP": bytes((*codes, 0, 1)), b"gAMA": b"1234"}) == colours
    assert uncoded({b"gAMA": b"1234"}) == USUAL


def test_parts_of_a_file_are_counted_and_the_first_four_named() -> None:
    assert counted("channel", ["Z"]) == "channel Z"
    assert counted("channel", ["Z", "id"]) == "channels Z, id"
    assert counted("part", list("abcd")) == "parts a, b, c, d"
    assert counted("part", list("abcdef")) == "parts a, b, c, d and 2 more"
    assert counted("part", ["x" * 41 + "y", "a\x1b[31m"]) == f"parts {'x' * 40}, a?[31m"
    assert not_kept("layer", ["one"]) == "its layer one is not kept"
    assert not_kept("layer", ["one", "two"]) == "its layers one, two are not kept"


def test_losses_are_one_sentence_about_a_file() -> None:
    assert lost(Path("folder/a.exr"), []) == ""
    assert lost(Path("folder/a.exr"), ["this", "that"]) == "a.exr: this; that"

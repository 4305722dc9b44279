"""What a job is to write: sizes, rates, and what keeps it from being written."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.errors import UserError
from app.model.picture import Picture
from app.model.recipe import Output, Playback, Recipe
from app.work import jobs
from app.work.apply_job import Application, MapSource
from app.work.jobs import Job, MapOutput, Outputs, longer_side, result_size

PICTURE = Picture(np.zeros((60, 100, 3), np.uint8))


def job(folder: Path, recipe: Recipe | None = None, **outputs: Any) -> Job:
    given: dict[str, Any] = {name: folder / path if isinstance(path, str) else path for name, path in outputs.items()}
    return Job(recipe or Recipe(), PICTURE, folder, Outputs(given.pop("file", None), **given))


def test_a_size_keeps_its_proportions_and_at_least_a_pixel() -> None:
    assert [longer_side((100, 60), longest) for longest in (50, 101, 1)] == [(50, 30), (101, 61), (1, 1)]
    assert longer_side((60, 100), 50) == (30, 50)
    assert result_size(Recipe(), PICTURE) == (100, 60)
    assert result_size(Recipe(output=Output(size=200)), PICTURE) == (200, 120)


def test_a_result_of_too_many_pixels_is_refused_before_the_work(tmp_path: Path) -> None:
    job(tmp_path, Recipe(output=Output(size=25_800)), file="a.png").check()
    with pytest.raises(UserError, match=r"'output\.size', asks for a result of 32768 x 19661 pixels"):
        job(tmp_path, Recipe(output=Output(size=32_768)), file="a.png").check()
    job(tmp_path, Recipe(output=Output(size=32_768)), maps=MapOutput(tmp_path / "m.npy", size=100)).check()


def test_what_is_an_animation_and_what_has_frames(tmp_path: Path) -> None:
    cases: list[tuple[dict[str, Any], bool, bool, str]] = [
        ({"file": "a.png"}, False, False, "a.png"),
        ({"file": "a.mp4"}, True, True, "a.mp4"),
        ({"file": "a.webp"}, False, False, "a.webp"),
        ({"file": "a.webp", "animated": True}, True, True, "a.webp"),
        ({"maps": MapOutput(tmp_path / "m.npy")}, False, False, "m.npy"),
        ({"maps": MapOutput(tmp_path / "m.%04d.npy")}, False, True, "m.%04d.npy"),
    ]
    for outputs, is_animation, has_frames, label in cases:
        one = job(tmp_path, **outputs)
        assert (one.is_animation, one.has_frames, one.label) == (is_animation, has_frames, label)
        one.check()
    assert job(tmp_path, Recipe(output=Output(fps=29.97)), file="a.mp4").rate == Fraction(30000, 1001)


@pytest.mark.parametrize(
    ("outputs", "said"),
    [
        ({"file": "a.mp4", "resume": True}, "--resume needs a sequence"),
        ({"file": "a.%d.png", "resume": True, "stats": "s.json"}, "use one of them"),
        ({"file": "a.png", "part": (0, 3)}, "--frames is for an animation"),
        ({"file": "a.png", "maps": "m.%04d.npy"}, "numbers the maps of an animation"),
        ({"file": "a.png", "bits": 32}, "holds 8 or 16 bits"),
        ({"file": "none/a.png"}, "there is no folder"),
    ],
)
def test_what_does_not_go_together_is_told_before_the_work(tmp_path: Path, outputs: dict[str, Any], said: str) -> None:
    if maps := outputs.get("maps"):
        outputs = outputs | {"maps": MapOutput(tmp_path / maps)}
    with pytest.raises(UserError, match=said):
        job(tmp_path, **outputs).check()


def test_an_animation_may_begin_at_its_end_and_not_after_it(tmp_path: Path) -> None:
    for start in (1.0, 1.001):
        late = job(tmp_path, Recipe(duration=1.0, time=Playback(start=start)), file="a.mp4")
        if start == 1.0:
            late.check()
        else:
            with pytest.raises(UserError, match=r"the animation ends at 1 s, and cannot begin at 1\.001 s"):
                late.check()


def test_a_map_has_no_more_pixels_than_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With what is beyond the picture on each side."""
    cases: list[tuple[dict[str, Any], int, str]] = [
        ({}, 100 * 60, "the size of the result makes a map of 100 x 60 pixels"),
        ({"size": 50}, 50 * 30, "--map-size 50 makes a map of 50 x 30 pixels"),
        ({"overscan": 10}, 120 * 80, "--overscan 10 makes a map of 120 x 80 pixels"),
    ]
    for how, pixels, said in cases:
        one = job(tmp_path, maps=MapOutput(tmp_path / "m.npy", **how))
        monkeypatch.setattr(jobs, "MAX_PIXELS", pixels)
        one.check()
        monkeypatch.setattr(jobs, "MAX_PIXELS", pixels - 1)
        with pytest.raises(UserError, match=said):
            one.check()


def test_outputs_are_renamed_together() -> None:
    outputs = Outputs(Path("a.png"), Path("s.json"), MapOutput(Path("m.npy"), overscan=3), states=Path("st"), bits=16)
    moved = outputs.renamed(lambda path: Path("x") / path)
    assert moved == replace(
        outputs, file=Path("x/a.png"), stats=Path("x/s.json"), states=Path("x/st"),
        maps=MapOutput(Path("x/m.npy"), overscan=3),
    )  # fmt: skip
    assert moved.files == [Path("x/a.png"), Path("x/s.json"), Path("x/m.npy")]


def test_all_that_is_asked_of_an_animation_is_told_to_its_writer(tmp_path: Path) -> None:
    """Each by itself beside what it is else, so that none is another's or nobody's."""
    usual = Outputs(tmp_path / "a.mov").animation(3, Fraction(25), None, PICTURE, None)
    like = replace(PICTURE, texts={"Title": "A"})
    cases: list[tuple[dict[str, Any], dict[str, Any]]] = [
        ({"bits": 10}, {"bits": 10}),
        ({"codec": "prores-4444"}, {"codec": "prores-4444"}),
        ({"resume": True}, {"resumed": True}),
        ({"part": (3, 8)}, {"frames": 6}),
    ]
    for asked, told in cases:
        found = Outputs(tmp_path / "a.mov", **asked).animation(3, Fraction(25), None, PICTURE, None)
        assert found == replace(usual, **told)
    assert Outputs(tmp_path / "a.mov").animation(3, Fraction(25), 70, PICTURE, None) == replace(usual, quality=70)
    for strip, kept in ((False, {"Title": "A"}), (True, {})):
        found = Outputs(tmp_path / "a.mov", strip=strip).animation(3, Fraction(25), None, like, None)
        assert found.like is not None
        assert found.like.texts == kept


@pytest.mark.parametrize(
    ("maps", "outputs", "said"),
    [
        ("map.txt", {"file": "a.png"}, r"map\.txt: a map's name must end in one of"),
        ("map.npy", {"file": "a.xyz"}, r"a\.xyz"),
        ("map.npy", {"file": "gone/a.png"}, "gone"),
        ("map.npy", {"file": "map.npy"}, r"map\.npy"),
        ("map.npy", {"file": "a.png", "part": (0, 3)}, "--frames is for an animation"),
    ],
)
def test_what_keeps_a_map_from_being_applied_is_told_before_the_work(
    tmp_path: Path, maps: str, outputs: dict[str, Any], said: str
) -> None:
    """Each of its checks, where all the others are content."""
    given = outputs | {"file": tmp_path / outputs["file"]}
    with pytest.raises(UserError, match=said):
        Application(maps=MapSource(tmp_path / maps), outputs=Outputs(**given), picture=tmp_path / "in.png").check()
    Application(maps=MapSource(tmp_path / "map.npy"), outputs=Outputs(tmp_path / "a.png"), picture=None).check()

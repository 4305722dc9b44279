"""What a job is to write: sizes, rates, and what keeps it from being written."""

from __future__ import annotations

import re
from dataclasses import replace
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.errors import UserError
from app.media.clip import USUAL, Colours
from app.media.displacement import Displacement
from app.media.maps import write_map
from app.media.pictures import read_picture, write_picture
from app.media.video import Video
from app.model.picture import Picture
from app.model.recipe import Output, Playback, Recipe
from app.progress import Progress
from app.work import jobs
from app.work.apply_job import Application, MapSource
from app.work.jobs import Job, MapOutput, Outputs, longer_side, result_size

PICTURE = Picture(np.zeros((60, 100, 3), np.uint8))


def job(folder: Path, recipe: Recipe | None = None, **outputs: Any) -> Job:
    given: dict[str, Any] = {name: folder / path if isinstance(path, str) else path for name, path in outputs.items()}
    return Job(recipe or Recipe(), PICTURE, folder, Outputs(given.pop("file", None), **given))


def clip_of(folder: Path) -> Video:
    return Video(
        path=folder / "in.mov", width=100, height=60, bits=8, alpha=False, pixel_format="yuv420p", fps=Fraction(10),
        decoder=(), filters="", file_size=1, inode=(1, 1), written=1,
    )  # fmt: skip


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
        written = one.outputs
        assert (written.is_animation, written.has_frames, one.label) == (is_animation, has_frames, label)
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


def test_all_that_a_clip_has_is_told_to_the_writer_of_an_animation(tmp_path: Path) -> None:
    colours, like = (
        Colours("bt2020", "smpte2084", "bt2020nc"),
        replace(PICTURE, chunks={b"cICP": bytes((12, 13, 0, 1))}),
    )
    clip = replace(
        clip_of(tmp_path), start=1, sounds=("aac",), late=0.25, durations=(1, 2, 3, 4, 5, 6), loops=7,
        timecode="01:00:00:07", colours=colours,
    )  # fmt: skip
    outputs = Outputs(tmp_path / "a.mov", bits=10, codec="prores-4444", resume=True, part=(3, 4))
    alone = outputs.animation(3, Fraction(10), 70, like, None)
    assert alone.colours == Colours("smpte432", "bt709", "bt709")
    told = outputs.animation(3, Fraction(10), 70, like, clip)
    assert told == replace(
        alone, loops=7, durations=[4, 5], sound=clip.path, sound_from=0.45, colours=colours, timecode="01:00:00:09"
    )
    plain = replace(clip, sounds=(), colours=USUAL, durations=None)
    assert outputs.animation(3, Fraction(10), 70, like, plain) == replace(
        told, durations=None, sound=None, colours=alone.colours
    )


@pytest.mark.parametrize("durations", [None, (1, 2), (3, 2)])
def test_the_frames_of_a_clip_that_stand_longer_come_less_often(tmp_path: Path, durations: tuple[int, ...]) -> None:
    clip = replace(clip_of(tmp_path), fps=Fraction(90), durations=durations)
    one = replace(job(tmp_path, file="a.gif"), clip=clip)
    if durations == (3, 2):
        one.check()
    else:
        with pytest.raises(UserError, match="GIF shows at most 50 frames a second"):
            one.check()


@pytest.mark.parametrize(("part", "is_held"), [((0, None), False), ((1, 2), False), ((0, 1), True), ((3, None), True)])
def test_a_frame_of_a_clip_that_stands_too_long_is_refused_before_the_work_if_it_is_asked_for(
    tmp_path: Path, part: tuple[int, int | None], is_held: bool
) -> None:
    clip = replace(clip_of(tmp_path), fps=Fraction(1), durations=(1, 3, 656, 2))
    one = replace(job(tmp_path, file="a.gif", part=part), clip=clip)
    if is_held:
        one.check()
    else:
        with pytest.raises(UserError, match=r"\.gif shows no frame for more than 655\.35 seconds; use \.mp4"):
            one.check()


@pytest.mark.parametrize("is_applied", [False, True], ids=["rendered", "applied"])
@pytest.mark.parametrize(
    ("file", "outputs", "more", "said"),
    [
        ("a.mp4", {"codec": "ffv1"}, {}, "holds h264 or h265, not ffv1"),
        ("a.%d.exr", {"codec": "h264"}, {}, "OpenEXR is compressed as .*, not h264"),
        ("a.%d.png", {"bits": 32}, {}, "PNG holds 8 or 16 bits a channel, not 32"),
        ("a.mov", {"bits": 10}, {}, "an animation has as many bits a channel as its codec; leave out --bits"),
        ("a.webp", {"bits": 16, "animated": True}, {}, "leave out --bits, or write name.%04d.png"),
        ("a.gif", {}, {"fps": 60}, "GIF shows at most 50 frames a second"),
        ("a.mp4", {}, {"size": 17_000}, "17000 x 10200 pixels, and h264 holds no more than 16384 x 16384"),
        ("a.mp4", {"codec": "h265"}, {"size": 9000}, "9000 x 5400 pixels, and h265 holds no more than 8192 x 8192"),
        ("a.webp", {"codec": "h264"}, {}, "a picture has no codec"),
        ("a.webp", {"codec": "h264", "animated": True}, {}, r"\.webp holds webp, not h264"),
        ("a.webp", {}, {"size": 17_000}, "WebP holds no side longer than 16383"),
        ("a.webp", {"animated": True}, {"size": 17_000}, "webp holds no more than 16383 x 16383"),
    ],
    ids=str,
)
def test_what_a_file_cannot_hold_is_refused_before_the_work(
    tmp_path: Path, file: str, outputs: dict[str, Any], more: dict[str, Any], said: str, is_applied: bool
) -> None:
    how = Outputs(tmp_path / file, **outputs)
    write_picture(tmp_path / "in.png", PICTURE)
    write_map(tmp_path / "map.npy", Displacement(np.zeros((60, 100, 2), np.float32)))
    if is_applied:
        order = Application(maps=MapSource(tmp_path / "map.npy"), outputs=how, picture=tmp_path / "in.png", **more)
        check = partial(order.perform, lambda: pytest.fail("the work has begun"), Progress())
        check = check if more else order.check  # without a look at the picture
    else:
        check = Job(Recipe(output=Output(**more)), PICTURE, tmp_path, how).check
    with pytest.raises(UserError, match=said):
        check()


@pytest.mark.parametrize("is_applied", [False, True], ids=["rendered", "applied"])
@pytest.mark.parametrize(
    ("file", "more"),
    [("a.gif", {"fps": 60}), ("a.gif", {"size": 9000}), ("a.webp", {"size": 17_000}), ("a.%d.jpg", {"size": 17_000})],
    ids=str,
)
def test_what_is_advised_of_a_wide_gamut_is_not_refused_in_its_turn(
    tmp_path: Path, file: str, more: dict[str, Any], is_applied: bool
) -> None:
    """For what is too fast for a GIF it was an APNG, which has no such colours; for what is too large a TIFF."""
    write_picture(tmp_path / "in.png", replace(PICTURE, chunks={b"cICP": bytes([9, 16, 0, 1])}))
    zeros = Displacement(np.zeros((60, 100, 2), np.float32))
    for name in ("map.npy", "map.0.npy", "map.1.npy"):
        write_map(tmp_path / name, zeros)

    def refusal(name: str, codec: str | None) -> str:
        how = Outputs(tmp_path / name, codec=codec)
        if is_applied:
            maps = MapSource(tmp_path / ("map.%d.npy" if how.is_animation else "map.npy"))
            order = Application(maps=maps, outputs=how, picture=tmp_path / "in.png", **more)
            check = partial(order.perform, lambda: pytest.fail("the work has begun"), Progress())
        else:
            recipe = Recipe(output=Output(**more))
            check = Job(recipe, read_picture(tmp_path / "in.png"), tmp_path, how).check
        try:
            check()
        except UserError as error:
            return str(error)
        except pytest.fail.Exception as begun:
            return "" if "has begun" in str(begun) else str(begun)
        return ""

    said = refusal(file, None)
    assert "it cannot tell that the picture's colours are BT.2020 PQ; write " in said
    mends = re.findall(r"(\S*\.\w+)(?: with --codec (\w+))?", said.partition("; write ")[2])
    assert mends
    for other, codec in mends:
        assert refusal(f"b{other}" if other.startswith(".") else other, codec or None) == ""


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

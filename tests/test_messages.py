"""What goes wrong, in the words of the command line and in those of the window, which has no options to name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from app.errors import UserError
from app.media import project as projects
from app.media.auxiliary import Pictures
from app.media.clip import CHANGED, has_changed
from app.media.displacement import Displacement
from app.media.files import telling
from app.media.inputs import check_size
from app.media.landmarks import read_pairs
from app.media.maps import write_map
from app.media.numbered import check_numbers
from app.media.pictures import write_picture
from app.media.project import named_in
from app.model.picture import Picture
from app.model.recipe import Output, Playback, Recipe
from app.progress import Progress
from app.work.fitting import Fit
from app.work.jobs import Job, MapOutput, Outputs
from solver.gl.device import Device

PICTURE = Picture(np.zeros((24, 32, 3), np.uint8))


def checked(recipe: Recipe, outputs: Outputs) -> None:
    Job(recipe, PICTURE, Path(), outputs).check()


def named_by_a_recipe(folder: Path) -> None:
    with named_in("r.toml", Path("big.png")):
        check_size(Path("big.png"), 9, 8, 71)


def inside_of_a_project(folder: Path) -> None:
    write_picture(folder / "p.png", PICTURE)
    projects.save(projects.from_picture(folder / "p.png", Recipe()), folder / "w.fluidwarp")
    projects.load(folder / "w.fluidwarp", max_pixels=71)


def beside_others(folder: Path) -> None:
    with telling([Path("a.png"), Path("m.npy")]):
        raise has_changed(Path("a.mp4"), 900, 90)


def the_other_way(folder: Path) -> None:
    write_map(folder / "to.tif", Displacement(np.zeros((24, 32, 2), np.float32), forward=True))
    Pictures(PICTURE, folder).load_map("to.tif")


def one_set(folder: Path) -> None:
    (folder / "a.pts").write_text("version: 1\nn_points: 2\n{\n1 1\n30 20\n}\n")
    read_pairs([folder / "a.pts"], (32, 24))


LATE = "the animation ends at 1 s, and cannot begin at 2 s"
GAP = "Cannot read f.%d.png: of 1-4 it lacks the frame 3; make them, or "
TOO_MANY = "Cannot read big.png, which r.toml names: 9 x 8 pixels are more than the limit of 71; "
INSIDE = "Cannot read p.png in w.fluidwarp: 32 x 24 pixels are more than the limit of 71; "
WAYS: dict[str, tuple[Callable[[Path], None], str, str]] = {
    "a picture of another's": (
        named_by_a_recipe,
        TOO_MANY + "if you trust the file, raise it with --max-pixels 72.",
        TOO_MANY + "make it smaller first.",
    ),
    "a picture of a project": (
        inside_of_a_project,
        INSIDE + "if you trust the file, raise it with --max-pixels 768.",
        INSIDE + "make it smaller first.",
    ),
    "a clip, beside others": (
        beside_others,
        "Cannot read a.mp4: it changed while it was read, from 900 to 90 bytes; start again when it is written whole. "
        "a.png and m.npy are written.",
        "Cannot read a.mp4: it is not as it was, from 900 to 90 bytes; open it again when that is finished. "
        "a.png and m.npy are written.",
    ),
    "a map": (
        the_other_way,
        "to.tif tells where each point goes; invert it with: fluidwarp convert --invert",
        "to.tif tells where each point goes, and must tell where each comes from; export it in the other direction.",
    ),
    "landmarks": (
        one_set,
        "a.pts has one set of landmarks; pairs need two, where the points are and where they should be",
        "a.pts has one set of landmarks; pairs need two, where the points are and where they should be: "
        "drop two files at once",
    ),
    "a sequence": (
        lambda folder: check_numbers("f.%d.png", (1, 2, 4), range(1, 5)),
        GAP + "give --frames.",
        GAP + "number the others without a gap.",
    ),
    "an animation": (
        lambda folder: checked(Recipe(time=Playback(start=2.0)), Outputs(Path("a.mp4"))),
        LATE + "; give an earlier --from, or 'time.start'",
        LATE,
    ),
    "a result": (
        lambda folder: checked(Recipe(output=Output(size=32768)), Outputs(Path("a.png"))),
        "--size, or 'output.size', asks for a result of 32768 x 24576 pixels, and at most 400000000 are made; "
        "ask for less",
        "a result of 32768 x 24576 pixels is too large; choose a smaller size",
    ),
    "a large map": (
        lambda folder: checked(Recipe(), Outputs(None, maps=MapOutput(Path("m.npy"), size=32768))),
        "--map-size 32768 makes a map of 32768 x 24576 pixels; ask for fewer",
        "a map of 32768 x 24576 pixels is too large; choose a smaller size",
    ),
    "a wide map": (
        lambda folder: checked(Recipe(), Outputs(None, maps=MapOutput(Path("m.npy"), overscan=32768))),
        "--overscan 32768 makes a map of 65568 x 65560 pixels; ask for fewer",
        "a map of 65568 x 65560 pixels is too large; choose a smaller size",
    ),
}


@pytest.mark.parametrize("name", WAYS)
def test_what_goes_wrong_is_told_in_the_words_of_the_command_line_and_of_the_window(tmp_path: Path, name: str) -> None:
    way, told, in_window = WAYS[name]
    with pytest.raises(UserError) as error:
        way(tmp_path)
    said = (str(error.value), error.value.in_window)
    assert tuple(text.replace(f"{tmp_path}/", "") for text in said) == (told, in_window)
    assert error.value.status == (CHANGED if way is beside_others else 1)


def test_that_there_is_nothing_to_fit_is_told_in_both(device: Device, tmp_path: Path) -> None:
    with pytest.raises(UserError) as error:
        Fit(Recipe(), PICTURE, tmp_path).perform(device, Progress())
    assert str(error.value) == (
        "no handle of the recipe leads anywhere; give --pairs, or [[handle]]s with a place to go to, which they "
        "hold to its end"
    )
    assert error.value.in_window == "There is nothing to fit: no handle leads anywhere, and holds it to the end."

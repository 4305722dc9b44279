"""The gallery: what it measures, what it shows, and what Figures 1, 5 and 6 must reach."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from scipy import ndimage

from app.errors import UserError
from app.gallery.drawing import FORCE, INK, MARGIN, PANEL, WIDE, arrows, at_work, contact_sheet, marked, shades
from app.gallery.figures import BESIDES, FIGURES, figure_1, make
from app.gallery.measures import light, sharpness, spline_of, spline_warp, stretch_and_det
from app.gallery.studio import Played, Studio, load, recipes_folder, source_of
from app.media.auxiliary import Pictures
from app.media.landmarks import read_pairs
from app.media.outlines import read_outlines
from app.media.pictures import read_picture
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.progress import Progress
from app.work.replay import Replay
from solver.gl.device import Device
from solver.grid import Grid


@pytest.fixture
def studio(device: Device, tmp_path: Path):
    made = Studio(device, tmp_path, Progress())
    yield made
    made.release()


def test_the_reference_is_the_spline_of_scipy() -> None:
    rng = np.random.default_rng(3)
    values = rng.random((40, 60))
    displacement = rng.normal(0, 3 / 60, (40, 60, 2))
    row, column = np.mgrid[0:40, 0:60] + np.moveaxis(displacement[..., ::-1], -1, 0) * 60
    places = np.clip(row, 0, 39), np.clip(column, 0, 59)
    wanted = ndimage.map_coordinates(values, places, order=3, mode="mirror")
    assert spline_warp(values, displacement) == pytest.approx(wanted, abs=1e-9)


def test_blur_takes_sharpness_away() -> None:
    noise = np.random.default_rng(0).random((50, 50))
    blurred = (noise + np.roll(noise, 1, 0) + np.roll(noise, 1, 1) + np.roll(noise, (1, 1), (0, 1))) / 4
    assert sharpness(blurred) < 0.5 * sharpness(noise)


def test_the_parts_of_a_sheet() -> None:
    picture = np.full((50, 100, 3), 200, np.uint8)
    field = np.zeros((25, 50, 2))
    field[10:15, 20:30] = [1, 0]
    drawn = arrows(picture, field)
    assert drawn.shape == picture.shape
    assert (drawn[20:30, 40:60, 0] > drawn[20:30, 40:60, 1] + 50).any(), "red arrows where the force is"
    assert np.ptp(drawn[:, :20].reshape(-1, 3), axis=0).max() == 0, "and none where it is not"
    grey = shades(np.geomspace(1e-3, 1, 25 * 50).reshape(25, 50), picture)
    assert (grey.min(), grey.max(), grey.shape) == (0, 255, picture.shape)
    sheet = contact_sheet("title", [("a", picture), ("b", drawn)])
    assert sheet.shape == (PANEL + 4 * MARGIN, 4 * PANEL + 3 * MARGIN, 3)
    panels = (contact_sheet("", 5 * [("", picture)], 20) == 200).all(axis=-1)  # two rows of 40 x 20, four in the first
    for axis, shape in ((0, (4, 40)), (1, (2, 20))):
        edges = np.flatnonzero(np.diff(panels.any(axis=axis))) + 1
        first, step = ((MARGIN, 2 * MARGIN)[axis], shape[1] + (1 + axis) * MARGIN)
        assert edges.tolist() == [first + step * number + end for number in range(shape[0]) for end in (0, shape[1])]


def test_a_sheet_is_as_high_as_its_panels(studio: Studio) -> None:
    studio.sheet("one", "title", [("a", np.zeros((20, 30, 3), np.uint8))], 40)
    assert read_picture(studio.folder / "one-sheet.png").height == 40 + 4 * MARGIN


def test_what_is_played_ends_as_the_still_and_as_a_replay(studio: Studio) -> None:
    recipe = load("figure-5")
    short = {"duration": 2 * recipe.fluid.dt, "fluid": recipe.fluid.model_copy(update={"grid": 32})}
    seen: list[np.ndarray] = []
    stills = [tick * recipe.fluid.dt for tick in range(3)]
    played = studio.play("figure-5", stills, watch=lambda replay, frame: seen.append(frame), **short)
    assert np.array_equal(seen[-1], played.result)
    assert [*played.stills] == stills
    assert all(map(np.array_equal, played.stills.values(), (played.source, *seen)))
    assert len(seen) == 2
    assert np.array_equal(played.result, studio.still(recipe.edited(**short)))
    replay = Replay(studio.device, played.recipe, Pictures(Picture(played.source), recipes_folder()))
    replay.seek(2)
    size = played.source.shape[1], played.source.shape[0]
    assert np.array_equal(played.displacement, replay.warp.read(size))
    replay.release()


def test_what_is_played_is_written_under_the_name_of_its_recipe_or_another(studio: Studio) -> None:
    """Variants of one stand beside each other."""
    recipe = load("figure-5")
    short = {"duration": 2 * recipe.fluid.dt, "fluid": recipe.fluid.model_copy(update={"grid": 32})}
    results = {"figure-5": studio.play("figure-5", **short).result}
    results["other"] = studio.play("figure-5", save_as="other", force=(), **short).result
    assert not np.array_equal(results["figure-5"], results["other"])
    files = {f"{name}.{ending}" for name in results for ending in ("png", "mp4")}
    assert {path.name for path in studio.folder.iterdir()} == files
    for name, result in results.items():
        assert np.array_equal(read_picture(studio.folder / f"{name}.png").pixels, result)


@pytest.mark.parametrize("name", sorted(name for name in {*FIGURES, *BESIDES} if not name.startswith("handles")))
def test_every_recipe_can_be_read_and_its_forces_built_without_notices(name: str) -> None:
    from app.model.forces import build

    recipe = load(name)
    assert recipe.picture is not None
    pictures = Pictures(read_picture(recipes_folder() / recipe.picture), recipes_folder())
    grid = Grid.for_picture(pictures.source.width, pictures.source.height, 64)
    assert build(recipe.force, grid, pictures, recipe.duration)
    assert pictures.notices == []


@pytest.mark.long
@pytest.mark.parametrize("name", ["figure-5", "figure-6"])
def test_portraits_move_in_the_window_only(name: str, studio: Studio) -> None:
    numbers = FIGURES[name](studio)
    assert float(numbers["px outside, mean"]) < 0.25
    assert float(numbers["px inside, mean"]) > 8
    assert float(numbers["frozen: px outside, most"]) == 0
    assert numbers["frozen: pixels changed outside"] == "0"
    assert float(numbers["frozen: px inside, mean"]) > 8
    for name_of_range in ("det J", "frozen: det J"):
        least, most = map(float, numbers[name_of_range].split(" to "))
        assert 0.2 < least < 1 < most, "no fluid is only stretched, nor only pressed together"
    written = {path.name for path in studio.folder.iterdir()}
    assert written == {
        f"{name}.png", f"{name}.mp4", f"{name}-freeze.png", f"{name}-freeze.mp4", f"{name}-sheet.png"
    }  # fmt: skip


def test_coordinates_stay_sharp_and_values_blur(studio: Studio) -> None:
    numbers = figure_1(studio)
    assert float(numbers["sharpness, coordinates"].rstrip("%")) >= 95
    assert float(numbers["sharpness, density"].rstrip("%")) < 60


BRIEF = 0.5, 1 / 16  # seconds and a step of them: in the middle of Figure 3, and two frames of handles at work
ALONE = {  # what a page of the guide shows by itself
    "guide-forces": lambda recipe: recipe.force,
    "guide-viscosity": lambda recipe: (*recipe.viscosity, *recipe.freeze),
}


class BriefStudio(Studio):
    """Plays half a second of each recipe on a coarse grid, and notes which those were and what is on the sheets."""

    def __init__(self, device: Device, folder: Path) -> None:
        super().__init__(device, folder, Progress())
        self.names: set[str] = set()
        self.sheets: dict[str, list[tuple[str, np.ndarray]]] = {}

    def play(self, name: str, *how: Any, **parts: Any) -> Played:
        return super().play(name, *how, **self._brief(load(name)), **parts)

    def still(self, recipe: Recipe) -> np.ndarray:
        return super().still(recipe.edited(**self._brief(recipe)))

    def _brief(self, recipe: Recipe) -> dict[str, object]:
        self.names.add(recipe.name)
        return {"duration": BRIEF[0], "fluid": recipe.fluid.model_copy(update={"grid": 32, "dt": BRIEF[1]})}

    def sheet(self, name: str, title: str, panels: list[tuple[str, np.ndarray]], height: int = PANEL) -> None:
        self.sheets[name] = panels
        super().sheet(name, title, panels, height)


@pytest.mark.parametrize("name", FIGURES)
def test_a_figure_shows_the_recipe_of_its_name(name: str, device: Device, tmp_path: Path) -> None:
    """On one sheet; a page of the guide each force, or each layer, by itself and by its name."""
    studio, recipe = BriefStudio(device, tmp_path), load(name)
    try:
        FIGURES[name](studio)
    finally:
        studio.release()
    assert studio.names == {load(each).name for each in (name, *BESIDES) if each.startswith(name)}
    ((sheet, panels),) = studio.sheets.items()
    assert sheet == name
    if name in ALONE:
        assert [words for words, _ in panels] == ["the picture", *(part.name for part in ALONE[name](recipe))]
        assert len({pixels.tobytes() for _, pixels in panels}) == len(panels)
    if not name.startswith("handles"):  # of which they are drawn on it
        assert np.array_equal(panels[0][1], source_of(recipe))


def test_a_folder_that_cannot_be_made_is_told(device: Device, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match=r"Cannot write .*file/in"):
        make(device, tmp_path / "file" / "in", Progress())


def test_light_is_luminance_in_linear_light() -> None:
    colours = np.array([[(188, 188, 188), (255, 0, 0), (0, 255, 0), (0, 0, 255)]], np.uint8)
    np.testing.assert_allclose(light(colours), [[0.5029, 0.2126, 0.7152, 0.0722]], atol=1e-4)


def test_the_spline_of_a_recipe_looks_its_handles_up_where_they_go() -> None:
    recipe = load("handles-smile")
    displacement = spline_of(recipe, (600, 600))
    for each in (*recipe.handle, *recipe.pin):
        x, y = (getattr(each, "to", None) or each.at)[0] * 600, (getattr(each, "to", None) or each.at)[1] * 600
        near = ndimage.map_coordinates(displacement[..., 0], [[y - 0.5], [x - 0.5]], order=3)
        assert near[0] == pytest.approx(each.at[0] - x / 600, abs=1e-4)


def test_the_fitted_recipes_lead_the_points_of_their_files() -> None:
    folder = recipes_folder()
    for name, read in (
        ("handles-tree", lambda size: read_pairs([folder / "handles-tree.csv"], size).places * size),
        ("handles-logo", lambda size: read_outlines(folder / "logo-disc.png", folder / "logo-heart.png", size)[0]),
    ):
        recipe = load(name)
        height, width = source_of(recipe).shape[:2]
        led = np.array([(handle.at, handle.to) for handle in recipe.handle]) * (width, height)
        np.testing.assert_allclose(led, read((width, height)), atol=1e-3)


def test_handles_at_work_are_shown_where_they_are_and_shall_be(studio: Studio) -> None:
    recipe = load("handles-tree")
    short = {"duration": 0.4, "fluid": recipe.fluid.model_copy(update={"grid": 32})}
    seen, places = list[np.ndarray](), list[np.ndarray]()

    def watch(replay: Replay, frame: np.ndarray) -> None:
        seen.append(at_work(frame, replay))
        places.append(replay.handles.places[len(recipe.pin) :] / replay.grid.extent)

    studio.play("handles-tree", watch=watch, **short)
    ways = [np.hypot(*np.subtract(handle.to or handle.at, handle.at)) for handle in recipe.handle]
    far, scale = int(np.argmax(ways)), (WIDE, len(seen[0]))
    assert np.abs(places[-1][far] - places[0][far]).max() * WIDE > 10
    for frame, place in ((seen[0], places[0][far]), (seen[-1], places[-1][far])):
        x, y = (place * scale).astype(int)
        assert np.abs(frame[y - 1 : y + 2, x - 1 : x + 2].astype(int) - FORCE).max() < 60
    x, y = np.multiply(recipe.handle[far].to or (0, 0), scale).astype(int)
    assert np.abs(seen[0][y, x - 7 : x + 8].astype(int) - INK).max(axis=-1).min() < 60, "a ring"
    studio.there_and_back("a.webp", seen[:3])
    with Image.open(studio.folder / "a.webp") as image:
        assert (image.size, getattr(image, "n_frames", 1)) == (scale, 4)


def test_folds_are_found_and_marked() -> None:
    x = (np.arange(100) + 0.5) / 100
    folded = np.zeros((50, 100, 2))
    folded[..., 0] = -5 * np.exp(-(((x - 0.5) / 0.1) ** 2)) * (x - 0.5)  # x + D turns back in the middle
    stretch, det = stretch_and_det(folded)
    assert det[25, 50] == pytest.approx(1 - 5, rel=0.05)
    assert stretch[25, 50] == pytest.approx(4, rel=0.05)
    shown = marked(np.full((50, 100, 3), 9, np.uint8), det)
    assert (shown[25, 50] == FORCE).all()
    assert (shown[25, 5] == 9).all()

"""Where files are looked for, how long what is told of them stays, and which shape the pointer has."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.media.pictures import read_picture, write_picture
from app.media.project import from_picture, load, save
from app.model.handles import RecipePin
from app.model.picture import Picture
from app.ui.browser import Browser
from app.ui.events import LEFT, MIDDLE, RIGHT, CloseWish
from app.ui.preferences import Preferences
from app.ui.saving import SaveDialog
from app.ui.widgets import Ui
from support.drawn import Drawn
from support.editing import Robot, pattern, write_foreign_map
from support.widgets import Widgets

ASKING = ("open", "open_frames", "apply_to", "import_map", "mask_load", "mask_save", "fit_masks")


def test_files_are_looked_for_where_the_last_ones_were(robot: Robot, tmp_path: Path) -> None:
    editor, there = robot.editor, tmp_path / "there"
    there.mkdir()
    editor.preferences.folder = str(there)
    for name in ASKING:
        editor.do(name)
        asked = editor.dialogs.shown[-1]
        assert isinstance(asked, Browser)
        assert (asked.folder, asked.name) == (there, "pattern-frozen.png" if name == "mask_save" else ""), name
        assert asked.writes == (name == "mask_save")
        asked.close()
        robot.frame(count=2)
    editor.do("save_as")
    asked = editor.dialogs.shown[-1]
    assert isinstance(asked, SaveDialog)
    assert asked.path == there / "pattern.fluidwarp"


def test_a_mask_of_what_moves_is_asked_for_first_and_then_one_of_where_it_goes_beside_it(
    robot: Robot, widgets: Widgets, tmp_path: Path
) -> None:
    editor, there = robot.editor, tmp_path / "there"
    there.mkdir()
    y, x = np.mgrid[0:180, 0:240]
    for name, across in (("one", 100), ("other", 120)):
        disc = (np.hypot(x - across, y - 90) < 40)[..., None]
        write_picture(there / f"{name}.png", Picture((255 * disc).astype(np.uint8)))
    fitted: list[object] = []
    editor.files.fit = lambda files, masks: fitted.append((files, masks))
    editor.do("fit_masks")
    for name, button in (("one", "Choose"), ("other", "Fit")):
        asked = editor.dialogs.shown[-1]
        assert isinstance(asked, Browser)
        assert fitted == []
        if name == "other":
            assert (asked.folder, [path.name for path in asked.inside]) == (there, ["one.png", "other.png"])
        asked.typed = str(there / f"{name}.png")
        widgets.click(button)
    assert fitted == [((), (there / "one.png", there / "other.png"))]


@pytest.mark.parametrize("name", ["open", "open_frames", "apply_to", "import_map", "mask_load"])
def test_what_is_chosen_is_taken_for_what_it_was_asked_for(
    robot: Robot, widgets: Widgets, tmp_path: Path, name: str
) -> None:
    editor, there = robot.editor, tmp_path / "there"
    there.mkdir()
    for number in (1, 2, 3):
        write_picture(there / f"frame{number}.png", pattern(60, 40))
    write_foreign_map(there / "m.exr", 240, 180)
    robot.drag((0.3, 0.5), (0.4, 0.5), steps=2)
    robot.rest()
    editor.do(name)
    asked = editor.dialogs.shown[-1]
    assert isinstance(asked, Browser)
    asked.typed = str(there / ("m.exr" if name == "import_map" else "frame2.png"))
    widgets.click(asked.title.split()[0])
    assert asked not in editor.dialogs.shown
    if editor.dialogs.shown:
        widgets.click("Don't save")
    robot.until(lambda: not editor.files.is_loading)
    session, recipe = editor.session, editor.session.recipe
    assert session.project.picture.width == (60 if name in ("open", "open_frames", "apply_to") else 240)
    assert (session.project.clip is not None) == (name == "open_frames")
    assert bool(recipe.stroke) == (name in ("apply_to", "mask_load", "import_map"))
    assert (recipe.map is not None) == (name == "import_map")
    assert bool(recipe.mask) == (name == "mask_load")
    assert editor.state.overlays["frozen"].shown == (name == "mask_load")


@pytest.mark.parametrize("is_typed", [False, True])
def test_whether_to_replace_is_asked_of_the_file_that_would_be(
    robot: Robot, widgets: Widgets, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, is_typed: bool
) -> None:
    """Of the name below, or of a whole path that was typed above; it is replaced only once the person has said so."""
    drawn, chosen, there = Drawn(monkeypatch, ()), list[Path](), tmp_path / "there"
    there.mkdir()
    for name in ("one.png", "other.png"):
        (there / name).touch()
    robot.editor.chooser.ask_where("Save the mask", there / "one.png", (".png",), chosen.append)
    robot.frame(count=2)
    asked = robot.editor.dialogs.shown[-1]
    assert isinstance(asked, Browser)
    if is_typed:
        asked.typed = str(there / "other.png")
    widgets.click("Save")
    drawn.take()
    robot.frame()
    said = [line.split(" | ")[1] for line in drawn.take() if "is there already" in line]
    name = "other.png" if is_typed else "one.png"
    assert (said, chosen) == ([f"{name} is there already."], [])
    widgets.click("Replace")
    assert (chosen, robot.editor.dialogs.shown) == ([there / name], [])


def test_a_mask_that_has_been_changed_meanwhile_is_read_again(robot: Robot, tmp_path: Path) -> None:
    editor, there = robot.editor, tmp_path / "there"
    there.mkdir()
    shares = []
    for white in (80, 160):
        pixels = np.zeros((180, 240, 1), np.uint8)
        pixels[:, :white] = 255
        write_picture(there / "mask.png", Picture(pixels))
        editor.files.load_mask(there / "mask.png", "frozen")
        robot.rest()
        editor.files.save_mask(tmp_path / "saved.png", "frozen")
        shares.append((read_picture(tmp_path / "saved.png").pixels > 2**15).mean())
    assert shares == pytest.approx([1 / 3, 2 / 3], abs=0.01)
    assert editor.preferences.folder == str(there)


def test_of_what_is_saved_of_thickness_it_is_told_that_what_is_thinned_is_not_in_it(
    robot: Robot, tmp_path: Path
) -> None:
    editor = robot.editor
    editor.state.mask, editor.state.mask_decades = "thickness", -1.0
    half = np.zeros((180, 240, 1), np.uint8)
    half[:, :120] = 255
    write_picture(tmp_path / "half.png", Picture(half))
    editor.files.load_mask(tmp_path / "half.png", "thickness")  # the other half is as the fluid is
    editor.files.save_mask(tmp_path / "a.png", "thickness")
    assert editor.messages.shown[-1].text == "Saved a.png."
    editor.do("mask_fill")
    editor.files.save_mask(tmp_path / "a.png", "thickness")
    assert editor.messages.shown[-1].text == "Saved a.png. What is thinned is not in it."


def test_a_map_to_start_from_is_told_and_its_folder_kept(robot: Robot, tmp_path: Path) -> None:
    there = tmp_path / "there"
    there.mkdir()
    write_foreign_map(there / "m.exr", 240, 180)
    robot.editor.files.start_from_map(there / "m.exr")
    assert robot.editor.preferences.folder == str(there)
    assert robot.editor.messages.shown[-1].text == "The picture now starts from m.exr. Undo removes it."


def test_that_a_file_cannot_be_opened_stays_until_another_one_is(robot: Robot, tmp_path: Path) -> None:
    editor = robot.editor
    (tmp_path / "bad.png").write_bytes(b"nothing")
    robot.drop(tmp_path / "bad.png")
    robot.frame(count=300, dt=0.1)
    assert ["bad.png" in message.text for message in editor.messages.shown] == [True]
    write_picture(tmp_path / "good.png", pattern(60, 40))
    robot.drop(tmp_path / "good.png")
    robot.frame()
    assert editor.messages.shown == []


def holds_picture(path: Path) -> bool:
    with zipfile.ZipFile(path) as archive:
        return any(name.endswith(".png") and "pattern" in name for name in archive.namelist())


def test_a_picture_goes_into_a_project_as_it_was_saved_last_or_else_as_the_person_likes(
    robot: Robot, tmp_path: Path
) -> None:
    editor, first, then = robot.editor, tmp_path / "first.fluidwarp", tmp_path / "then.fluidwarp"
    editor.preferences.embed = False
    editor.files.write(first)
    assert not load(first).embedded
    editor.preferences.embed = True
    editor.files.write(then)
    assert not load(then).embedded
    editor.files.write(then, embed=True)
    editor.preferences.embed = False
    editor.files.write(then)
    assert load(then).embedded
    assert [holds_picture(path) for path in (first, then)] == [False, True]
    assert editor.preferences.recent[:2] == [str(then), str(first)]
    assert editor.messages.shown[-1].text == "Saved then.fluidwarp"


def test_the_pointer_has_the_shape_of_what_it_would_do(robot: Robot) -> None:
    editor, state, pointer = robot.editor, robot.editor.state, robot.editor.pointer
    editor.session.edit("Pin", pin=(RecipePin(at=(0.3, 0.3)),))
    robot.rest()
    found, free, pinned = dict[str, str](), robot.at(0.6, 0.6), robot.at(0.3, 0.3)

    def look(name: str, at: tuple[float, float]) -> None:
        robot.move(*at)
        found[name] = pointer.cursor

    look("off the canvas", (5, 5))
    for tool in ("push", "freeze", "handle", "pan", "zoom", "select"):
        state.choose_tool(tool, False)
        look(tool, free)
        look(f"{tool} on a pin", pinned)
    state.choose_tool("push", False)
    robot.hold("space", True)
    look("space", free)
    robot.hold("space", False)
    for button, name in ((LEFT, "painting"), (MIDDLE, "panning"), (RIGHT, "sizing")):
        robot.move(*free)
        robot.press(button)
        look(name, (free[0] + 12, free[1]))
        robot.release(button)
    robot.rest()
    state.split = 0.5
    look("split", robot.at(0.5, 0.9))
    look("just on the split", (robot.at(0.5, 0.9)[0] + 8, robot.at(0.5, 0.9)[1]))
    look("beside the split", (robot.at(0.5, 0.9)[0] + 9, robot.at(0.5, 0.9)[1]))
    ring = ("push", "push on a pin", "freeze", "freeze on a pin", "handle", "painting", "sizing", "beside the split")
    wanted = {"off the canvas": "arrow", "handle on a pin": "hand", "split": "resize_ew"} | dict.fromkeys(ring, "none")
    wanted |= dict.fromkeys(("pan", "pan on a pin", "space", "panning"), "hand") | {"just on the split": "resize_ew"}
    wanted |= dict.fromkeys(("zoom", "zoom on a pin", "select", "select on a pin"), "crosshair")
    assert found == wanted


def test_what_is_copied_as_a_recipe_is_the_recipe(robot: Robot) -> None:
    copied: list[str] = []
    robot.editor.commands.clipboard = copied.append
    robot.drag((0.4, 0.5), (0.5, 0.5), steps=3)
    robot.rest()
    robot.editor.do("copy_recipe")
    assert copied == [robot.editor.session.recipe.text()]
    assert robot.editor.messages.shown[-1].text == "The recipe is on the clipboard, as TOML."


@pytest.mark.parametrize("has_a_file", [True, False], ids=["with a file", "without one"])
@pytest.mark.parametrize("what", ["quit", "open"])
def test_what_unsaved_work_was_asked_about_for_is_done_once_it_is_saved_and_never_where_saving_is_given_up(
    robot: Robot, widgets: Widgets, tmp_path: Path, what: str, has_a_file: bool
) -> None:
    editor, session = robot.editor, robot.editor.session
    editor.preferences.folder = str(tmp_path)
    write_picture(tmp_path / "other.png", pattern(60, 40))
    if has_a_file:
        assert editor.files.save_as(tmp_path / "pattern.fluidwarp")
    session.edit("A pin", pin=(RecipePin(at=(0.5, 0.5)),))

    def is_done() -> bool:
        return editor.commands.closed if what == "quit" else editor.session.project.name == "other"

    all_answers = [["Cancel"], ["Save"]] if has_a_file else [["Cancel"], ["Save", "Cancel"], ["Save", "Save"]]
    for answers in all_answers:
        assert (is_done(), editor.workspace.is_dirty, editor.dialogs.shown) == (False, True, [])
        robot.frame(CloseWish()) if what == "quit" else robot.drop(tmp_path / "other.png")
        for answer in answers:
            widgets.click(answer)
    assert is_done()
    assert (session.document.is_dirty, load(tmp_path / "pattern.fluidwarp").recipe.pin) == (False, session.recipe.pin)


@pytest.mark.parametrize("likes", [True, False], ids=["likes it inside", "likes it beside"])
@pytest.mark.parametrize(("kind", "embeds"), [("picture", None), ("kept", True), ("clip", False)])
def test_a_picture_is_asked_about_unless_it_is_only_in_the_project_or_a_clip(
    robot: Robot,
    widgets: Widgets,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    kind: str,
    embeds: bool | None,
    likes: bool,
) -> None:
    told, written = list[str](), list[bool]()
    wrapped, project = Ui.wrapped, robot.editor.session.project
    if kind == "kept":
        project = load(Path(save(project, tmp_path / "kept.fluidwarp", True).path or ""))
    elif kind == "clip":
        for number in range(2):
            write_picture(tmp_path / f"f.{number:04}.png", pattern(48, 36))
        project = from_picture(tmp_path / "f.%04d.png", project.recipe)

    def noting(ui: Ui, text: str, *more: Any) -> None:
        told.append(text)
        wrapped(ui, text, *more)

    def note(path: Path, embed: bool) -> None:
        written.append(embed)

    monkeypatch.setattr(Ui, "wrapped", noting)
    preferences = Preferences(embed=likes)
    asked = SaveDialog(project, tmp_path / "a.fluidwarp", preferences, robot.editor.chooser, note, None)
    robot.editor.dialogs.show(asked)
    robot.frame(count=2)
    embed = likes if embeds is None else embeds
    about = {
        "picture": "One file that opens anywhere" if likes else "A small file that needs",
        "kept": "The picture is only in the project",
        "clip": "A clip is never kept inside",
    }
    assert told[-1].startswith(about[kind])
    widgets.click("Save")
    assert (written, preferences.embed) == ([embed], likes)

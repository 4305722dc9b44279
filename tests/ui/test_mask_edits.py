"""Masks in the window: painted in no time, edited by buttons and keys, loaded and saved."""

from __future__ import annotations

import os
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from app.errors import UserError
from app.media.displacement import Displacement
from app.media.maps import write_map
from app.media.pictures import read_picture, write_picture
from app.model.mask_edits import FeatherMask, FillMask, SpreadMask
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.ui.actions import ACTIONS
from app.ui.widgets import Ui
from support.editing import Robot
from support.widgets import Widgets


def frozen(robot: Robot) -> np.ndarray:
    return robot.editor.session.replay.masks.frozen.get()


@pytest.mark.parametrize(("tool", "is_shown"), [("freeze", False), ("smooth", False), ("push", True)])
def test_a_mask_that_the_tool_shows_anyway_turns_on_no_overlay(robot: Robot, tool: str, is_shown: bool) -> None:
    """Its opacity would push the buttons away from under the pointer, and it would stay over what is painted then."""
    robot.editor.state.choose_tool(tool, False)
    robot.editor.commands.edit_mask("fill")
    assert robot.editor.state.overlays["frozen"].shown == is_shown
    assert robot.editor.state.shows_frozen


@pytest.mark.parametrize("tool", ["", "mask", "freeze", "push"])
def test_the_hint_of_a_margin_goes_once_something_is_frozen(
    robot: Robot, tool: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also if the fluid moved meanwhile or did not, or the recipe froze it."""
    said, text = list[str](), Ui.text
    monkeypatch.setattr(
        Ui, "text", lambda ui, words, *more, **named: (said.append(words), text(ui, words, *more, **named))
    )
    path = {"kind": "path", "points": ((0.2, 0.2),), "radius": 0.1}
    stroke = {"tool": tool, "samples": ((0, 0.2, 0.2, 1.0), (3, 0.3, 0.2, 1.0))}
    still = {"kind": "fill", "tick": 0, "of": "frozen", "amount": 1.0}
    given = {"mask": (still,)} if tool == "mask" else {"stroke": (stroke,)} if tool else {"freeze": (path,)}
    made = Recipe.model_validate(given)
    robot.editor.session.edit("Made", stroke=made.stroke, freeze=made.freeze, mask=made.mask)
    robot.key("f")
    said.clear()
    robot.frame()
    assert any("leave some space" in words for words in said) == (tool == "push")


def test_a_mask_follows_the_pointer_in_every_frame_and_takes_no_time(robot: Robot) -> None:
    session = robot.editor.session
    robot.key("f")
    robot.move(*robot.at(0.3, 0.5))
    robot.press()
    seen = [0]
    for step in range(6):
        robot.move(*robot.at(0.3 + 0.03 * step, 0.5))
        seen.append(int((frozen(robot) > 127).sum()))
    assert all(later > earlier for earlier, later in pairwise(seen))
    robot.release()
    assert (session.end, session.tick, session.is_moving) == (0, 0, False)
    assert [entry.name for entry in session.document.history.entries] == ["Open", "Freeze"]
    robot.key("ctrl+z")
    assert not frozen(robot).any()


def test_a_pointer_that_rests_goes_on_thickening(robot: Robot) -> None:
    robot.key("v")
    robot.move(*robot.at(0.5, 0.5))
    robot.press()
    thickest = []
    for _ in range(4):
        robot.frame()
        thickest.append(int(robot.editor.session.replay.masks.thickness.get().max()))
    assert thickest == sorted(set(thickest))
    robot.release()
    assert robot.editor.session.end == 0


def test_a_mark_stands_on_the_timeline(robot: Robot) -> None:
    robot.see()
    robot.move(5, 5)
    before = robot.pixels()[-60:]
    robot.key("f")
    robot.drag((0.3, 0.5), (0.4, 0.5), steps=2)
    robot.key("p")
    robot.move(5, 5)
    robot.frame(count=2)
    changed = np.argwhere((robot.pixels()[-60:] != before).any(axis=2))
    assert 0 < np.ptp(changed[:, 1]) < 8
    assert 8 < np.ptp(changed[:, 0]) < 30


@pytest.mark.parametrize("kind", ["invert", "fill", "clear", "feather", "grow", "shrink"])
def test_a_button_edits_the_mask_of_the_tool(robot: Robot, widgets: Widgets, kind: str) -> None:
    """With what the sliders say."""
    robot.key("v")
    robot.drag((0.5, 0.5), (0.55, 0.5), steps=3)
    state = robot.editor.state
    state.sections = {name: name == "masks" for name in ("fluid", "view", "quality", "masks", "history", "numbers")}
    state.mask_reach, state.mask_decades = 0.07, -1.5
    widgets.click(kind.capitalize())
    edit = robot.editor.session.recipe.mask[-1]
    assert (edit.kind, edit.tick) == (kind, 0)
    assert not isinstance(edit, (FeatherMask, SpreadMask)) or edit.radius == 0.07
    assert not isinstance(edit, FillMask) or (edit.amount, edit.of) == (-1.5, "thickness")
    assert state.shows_viscosity
    assert robot.editor.session.document.history.entries[-1].name == f"{kind.capitalize()} the thickness"


def test_what_a_slider_writes_as_no_pixel_still_moves_an_edge(robot: Robot, widgets: Widgets) -> None:
    """On a small picture its least is less than half a pixel."""
    robot.key("f")
    robot.drag((0.5, 0.5), (0.55, 0.5), steps=3)
    state = robot.editor.state
    state.sections = {name: name == "masks" for name in state.sections}
    widgets.look()
    slider = widgets.at["By"]
    x, y = slider.middle
    robot.move(x, y)
    robot.press()
    robot.move(slider.x - 40, y)
    robot.release()
    robot.rest()
    assert state.mask_reach == 0.001
    widgets.click("Grow")
    assert robot.editor.session.recipe.mask[-1] == SpreadMask(kind="grow", tick=0, of="frozen", radius=0.001)


def test_keys_edit_masks_too_and_clear_both(robot: Robot) -> None:
    robot.key("f")
    robot.drag((0.5, 0.5), (0.55, 0.5), steps=3)
    before = frozen(robot)
    robot.key("ctrl+shift+i")
    assert np.array_equal(frozen(robot), 255 - before)
    robot.key("ctrl+d")
    assert not frozen(robot).any()
    assert robot.editor.session.end == 0
    robot.key("ctrl+z")
    assert np.array_equal(frozen(robot), 255 - before)


@pytest.mark.parametrize(("key", "of"), [("f", "frozen"), ("v", "thickness")])
def test_a_mask_that_was_saved_is_loaded_as_it_was(robot: Robot, tmp_path: Path, key: str, of: str) -> None:
    files, masks, state = robot.editor.files, robot.editor.session.replay.masks, robot.editor.state
    robot.key(key)
    assert state.mask == of
    robot.drag((0.5, 0.5), (0.55, 0.5), steps=3)
    before = masks.words(of)
    files.save_mask(tmp_path / "mask.png", state.mask)
    picture = read_picture(tmp_path / "mask.png")
    assert (picture.bits, picture.pixels.shape[2]) == (16, 1)
    robot.key("ctrl+d")
    files.load_mask(tmp_path / "mask.png", state.mask)
    after = masks.words(of)
    robot.key("ctrl+z")
    cleared = masks.words(of)
    assert before is not None
    assert after is not None
    assert cleared is not None
    assert np.array_equal(after, before)
    assert not np.array_equal(cleared, before)


def test_a_mask_takes_the_place_of_no_picture_of_the_work(robot: Robot, tmp_path: Path) -> None:
    """Neither of the one that is warped, nor of a mask that was loaded: of these it would make another work."""
    files, folder = robot.editor.files, robot.editor.session.project.folder
    write_picture(tmp_path / "mask.png", Picture(np.full((9, 12, 1), 200, np.uint8)))
    files.load_mask(tmp_path / "mask.png", "frozen")
    for kept in (folder / "pattern.png", tmp_path / "mask.png"):
        before = kept.read_bytes()
        with pytest.raises(UserError, match=f"{kept.name} would be replaced by its own result"):
            files.save_mask(kept, "frozen")
        assert kept.read_bytes() == before
    files.save_mask(tmp_path / "other.png", "frozen")
    robot.key("ctrl+z")


def test_what_is_not_painted_is_not_saved(robot: Robot, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="nothing on this mask"):
        robot.editor.files.save_mask(tmp_path / "mask.png", "frozen")
    assert not (tmp_path / "mask.png").exists()


@pytest.mark.skipif(sys.platform != "linux", reason="names are text there")
def test_a_mask_or_a_map_whose_name_no_recipe_could_hold_is_refused(robot: Robot, tmp_path: Path) -> None:
    folder = tmp_path / os.fsdecode(b"caf\xe9")
    folder.mkdir()
    write_picture(folder / "mask.png", Picture(np.full((16, 16, 1), 255, np.uint8)))
    write_map(folder / "map.npy", Displacement(np.zeros((16, 16, 2), np.float32)))
    files, said = robot.editor.files, r"Cannot refer to .*: its name is not UTF-8; rename it\."
    with pytest.raises(UserError, match=said):
        files.load_mask(folder / "mask.png", "frozen")
    with pytest.raises(UserError, match=said):
        files.start_from_map(folder / "map.npy")
    assert not frozen(robot).any()


def test_every_edit_of_a_mask_is_an_action() -> None:
    kinds = {name.removeprefix("mask_") for name in ACTIONS if name.startswith("mask_")}
    assert kinds == {"invert", "fill", "clear", "feather", "grow", "shrink", "load", "save"}


def test_each_button_is_enabled_where_there_is_something_for_it(robot: Robot, widgets: Widgets) -> None:
    """Of the masks also while nothing has moved."""

    def pressed() -> list[str]:
        for words in buttons:
            widgets.click(words)
        return [entry.name for entry in robot.editor.session.document.history.entries]

    buttons = ("Stop all motion", "Reset the warp", "Clear the masks")
    sections = ("fluid", "view", "quality", "masks", "history", "numbers")
    robot.editor.state.sections = {name: name == "masks" for name in sections}
    robot.frame(count=2)
    assert pressed() == ["Open"]
    robot.editor.commands.edit_mask("fill")
    assert pressed()[2:] == ["Clear the masks"]
    assert not frozen(robot).any()
    robot.drag((0.4, 0.5), (0.45, 0.5))
    robot.rest()
    assert pressed()[3:] == ["Push", *buttons]


def test_where_nothing_has_been_done_there_are_no_masks_to_clear(robot: Robot) -> None:
    robot.key("ctrl+d")
    assert not robot.editor.session.has_begun
    assert robot.editor.session.document.history.undo_name is None

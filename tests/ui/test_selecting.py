"""Selections in the window: made by the pointer, filled into a mask, and the same in a recipe."""

from __future__ import annotations

import random
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage

from app.media import project as projects
from app.model.bars import bars
from app.model.mask_edits import FillMask, PictureMask
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.ui.editor_state import SELECT_BY
from app.ui.events import Mods, Move, Wheel
from app.work.replay import Replay
from solver.gl.device import Device
from support.commands import Run
from support.desk import Desk, needs_a_screen
from support.drawn import Drawn
from support.editing import Robot, pattern, small_project
from support.widgets import Widgets

WIDTH, HEIGHT = 240, 180
Y, X = np.mgrid[0:HEIGHT, 0:WIDTH]
BLOB = ((X - 80) / 40) ** 2 + ((Y - 90) / 50) ** 2 < 1
SPOT = (X - 200) ** 2 + (Y - 40) ** 2 < 20**2


def blobs() -> Picture:
    """Two reddish ones with grain before something greenish."""
    colours = np.where((BLOB | SPOT)[..., None], (190, 70, 60), (60, 120, 80)).astype(float)
    return Picture(np.clip(colours + np.random.default_rng(1).normal(0, 8, colours.shape), 0, 255).astype(np.uint8))


@pytest.fixture
def robot(device: Device, tmp_path: Path) -> Iterator[Robot]:
    with Robot(device, replace(small_project(tmp_path), picture=blobs())) as robot:
        robot.key("m")
        yield robot


def frozen(robot: Robot) -> np.ndarray:
    """What is frozen of the picture's pixels, (h, w) bool."""
    texels = robot.editor.session.replay.masks.frozen.get()
    if texels.shape == (1, 1):
        return np.zeros((HEIGHT, WIDTH), bool)
    times = texels.shape[0] // HEIGHT
    return texels.reshape(HEIGHT, times, WIDTH, times).mean(axis=(1, 3)) > 127


def select(robot: Robot, by: str, *places: tuple[float, float], mods: Mods | None = None) -> None:
    """Drag from place to place, with modifiers held; at one place, click."""
    robot.editor.state.select_by = by
    robot.mods = mods or Mods()
    robot.move(*robot.at(*places[0]))
    robot.press()
    for place in places[1:]:
        robot.move(*robot.at(*place))
    robot.release()
    robot.mods = Mods()
    robot.until(lambda: not robot.editor.selecting.is_busy)


def is_like(seen: np.ndarray, wanted: np.ndarray, part: float = 0.96) -> bool:
    return (seen & wanted).sum() / (seen | wanted).sum() > part


def box(left: float, top: float, right: float, bottom: float) -> np.ndarray:
    x, y = (X + 0.5) / WIDTH, (Y + 0.5) / HEIGHT
    return (x > left) & (x < right) & (y > top) & (y < bottom)


def test_a_rectangle_is_selected_and_frozen_by_enter_in_no_time(robot: Robot) -> None:
    session = robot.editor.session
    select(robot, "rectangle", (0.6, 0.7), (0.5, 0.5), (0.2, 0.3))
    assert session.recipe.mask == ()
    robot.key("enter")
    assert is_like(frozen(robot), box(0.2, 0.3, 0.6, 0.7))
    assert (session.end, session.is_moving) == (0, False)
    assert [entry.name for entry in session.document.history.entries] == ["Open", "Freeze the selection"]
    robot.key("ctrl+z")
    assert not frozen(robot).any()
    robot.key("ctrl+shift+z")
    assert is_like(frozen(robot), box(0.2, 0.3, 0.6, 0.7))


def test_shift_adds_alt_takes_away_both_intersect_and_neither_begins_anew(robot: Robot) -> None:
    state, one, other = robot.editor.state, ((0.1, 0.1), (0.5, 0.5)), ((0.4, 0.4), (0.8, 0.8))
    select(robot, "rectangle", *one, mods=Mods(alt=True))  # from nothing it is what is selected
    select(robot, "rectangle", *other, mods=Mods(shift=True))
    select(robot, "ellipse", (0.3, 0.3), (0.5, 0.5), mods=Mods(alt=True))
    select(robot, "rectangle", (0.0, 0.0), (0.7, 0.6), mods=Mods(shift=True, alt=True))
    x, y = (X + 0.5) / WIDTH, (Y + 0.5) / HEIGHT
    hole = (x - 0.4) ** 2 + (y - 0.4) ** 2 < 0.1**2
    robot.key("enter")
    both = box(0.1, 0.1, 0.5, 0.5) | box(0.4, 0.4, 0.8, 0.8)
    assert is_like(frozen(robot), both & ~hole & box(0.0, 0.0, 0.7, 0.6))
    select(robot, "rectangle", (0.6, 0.6), (0.9, 0.9))
    assert len(state.selection) == 1
    robot.key("delete")
    assert not frozen(robot)[box(0.6, 0.6, 0.9, 0.9)].any()
    assert frozen(robot)[box(0.15, 0.15, 0.25, 0.25)].all()
    edit = robot.editor.session.recipe.mask[-1]
    assert isinstance(edit, FillMask)
    assert edit.amount == 0


def test_an_inverted_selection_is_the_rest_and_can_be_added_to(robot: Robot, widgets: Widgets) -> None:
    """By its button and its key, with parts of all kinds, in the window and in the recipe that it writes."""
    session = robot.editor.session
    select(robot, "rectangle", (0.1, 0.1), (0.5, 0.5))
    select(robot, "rectangle", (0.4, 0.4), (0.8, 0.8), mods=Mods(shift=True))
    select(robot, "rectangle", (0.2, 0.2), (0.3, 0.3), mods=Mods(alt=True))
    select(robot, "rectangle", (0.0, 0.0), (0.7, 0.6), mods=Mods(shift=True, alt=True))
    widgets.click("Invert the selection")
    robot.key("enter")
    both = (box(0.1, 0.1, 0.5, 0.5) | box(0.4, 0.4, 0.8, 0.8)) & ~box(0.2, 0.2, 0.3, 0.3) & box(0.0, 0.0, 0.7, 0.6)
    assert is_like(frozen(robot), ~both, 0.99)
    select(robot, "rectangle", (0.2, 0.4), (0.6, 0.6), mods=Mods(shift=True))
    robot.key("enter")
    assert is_like(frozen(robot), ~both | box(0.2, 0.4, 0.6, 0.6), 0.99)
    again = Replay(session.device, Recipe.parse(session.recipe.text()), session.pictures)
    assert np.array_equal(again.masks.frozen.get(), session.replay.masks.frozen.get())
    again.release()
    select(robot, "rectangle", (0.1, 0.1), (0.5, 0.5))
    robot.key("i")
    assert robot.editor.state.selected_part == pytest.approx(0.84, abs=0.001)  # is told: the edge may be out of sight
    robot.key("i")
    assert not any(part.invert for part in robot.editor.state.selection)
    robot.key("escape")
    robot.key("i")
    assert robot.editor.messages.shown[-1].text == "Nothing is selected yet."


def test_the_chord_that_inverts_is_for_the_selection_and_without_one_for_the_mask(robot: Robot) -> None:
    session, state = robot.editor.session, robot.editor.state
    robot.key("m")
    robot.drag((0.2, 0.2), (0.6, 0.6), steps=4)
    before = state.selected_part
    robot.key("ctrl+shift+i")
    assert state.selected_part == pytest.approx(1 - before, abs=1e-3)
    assert session.recipe.mask == ()
    robot.key("escape")
    robot.key("ctrl+shift+i")
    assert [edit.kind for edit in session.recipe.mask] == ["invert"]


def test_what_is_picked_stays_inverted_while_its_tolerance_is_set(robot: Robot, widgets: Widgets) -> None:
    state = robot.editor.state
    select(robot, "colour", (0.33, 0.5))
    robot.key("i")
    assert state.selected_area is not None
    before = int((state.selected_area > 127).sum())
    widgets.type("Tolerance", "2")
    (part,) = state.selection
    assert part.invert
    assert int((state.selected_area > 127).sum()) > before
    select(robot, "colour", (0.33, 0.5))
    assert not state.selection[0].invert


def test_a_lasso_is_what_was_drawn_around(robot: Robot) -> None:
    turns = np.linspace(0, 2 * np.pi, 40)[:-1]
    select(robot, "lasso", *((0.5 + 0.2 * np.cos(turn), 0.5 + 0.3 * np.sin(turn)) for turn in turns))
    robot.key("enter")
    x, y = (X + 0.5) / WIDTH, (Y + 0.5) / HEIGHT
    assert is_like(frozen(robot), ((x - 0.5) / 0.2) ** 2 + ((y - 0.5) / 0.3) ** 2 < 1)


def test_a_lasso_may_end_where_it_began(robot: Robot) -> None:
    robot.editor.state.select_by = "lasso"
    robot.move(*robot.at(0.2, 0.2))
    robot.press()
    for place in ((0.6, 0.2), (0.6, 0.63), (0.2, 0.2)):
        robot.move(*robot.at(*place))
        robot.frame()
    robot.release()
    assert robot.editor.state.selected_area is not None
    assert 0.05 < (robot.editor.state.selected_area > 127).mean() < 0.12


def test_how_much_is_selected_is_told(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = Drawn(monkeypatch)

    def told() -> set[str]:
        drawn.lines.clear()
        robot.frame()
        return {line.split("|")[-1].strip() for line in drawn.lines if "selected." in line}

    robot.key("m")
    assert told() == {"Nothing is selected."}
    select(robot, "rectangle", (0.0, 0.0), (0.5, 0.5))
    assert told() == {"25.0% of the picture is selected."}
    select(robot, "rectangle", (0.5, 0.5), (0.52, 0.52))
    assert told() == {"Less than 0.1% of the picture is selected."}


@pytest.mark.parametrize("by", ["colour", "brightness"])
def test_a_click_selects_what_is_like_it(robot: Robot, widgets: Widgets, by: str) -> None:
    """Where it is connected or, with the switch, everywhere; and as unlike as the slider says, at once."""
    state = robot.editor.state
    select(robot, by, (0.33, 0.5))
    assert state.selected_area is not None
    robot.key("enter")
    if by == "colour":
        assert is_like(np.asarray(ndimage.binary_fill_holes(frozen(robot))), BLOB)
        widgets.click("Only what is connected")
        robot.key("enter")
        assert is_like(np.asarray(ndimage.binary_fill_holes(frozen(robot))), BLOB | SPOT)
    less = int((state.selected_area > 127).sum())
    widgets.type("Tolerance", "2")
    assert 0 < int((state.selected_area > 127).sum()) < less
    widgets.type("Tolerance", "100")
    assert int((state.selected_area > 127).sum()) >= less
    edit = state.selection[0].segment
    assert edit is not None
    assert (edit.at is None) == (by == "colour")


def test_on_a_warped_picture_what_is_like_is_what_is_seen_at_the_place(robot: Robot) -> None:
    """Where something else has been pushed to, and where it has been pushed away from."""
    robot.key("p")
    robot.drag((0.1, 0.5), (0.4, 0.5), steps=8)
    robot.rest()
    robot.key("m")
    moved = robot.editor.session.replay.warp.read((WIDTH, HEIGHT)) * WIDTH
    rows, columns = (np.rint(at + moved[..., axis]).astype(int) for axis, at in ((1, Y), (0, X)))
    seen = (BLOB | SPOT)[np.clip(rows, 0, HEIGHT - 1), np.clip(columns, 0, WIDTH - 1)]
    for reddish in (True, False):
        changed = (seen == reddish) & (seen != (BLOB | SPOT))
        inside = np.asarray(ndimage.distance_transform_cdt(changed))
        row, column = np.unravel_index(int(np.argmax(inside)), inside.shape)
        assert inside[row, column] > 3
        robot.editor.state.connected = False
        select(robot, "colour", ((float(column) + 0.5) / WIDTH, (float(row) + 0.5) / HEIGHT))
        robot.key("enter")
        assert is_like(np.asarray(ndimage.median_filter(frozen(robot), 7)), seen == reddish, 0.9)
        robot.key("ctrl+z")


def test_a_subject_is_found_in_a_rough_box_while_frames_go_on(robot: Robot) -> None:
    robot.editor.state.select_by = "subject"
    robot.drag((0.1, 0.15), (0.6, 0.85))
    assert robot.editor.selecting.is_busy
    assert robot.editor.selecting.hint == "Looking for the subject ..."
    assert robot.editor.wait() <= 0.1
    robot.until(lambda: not robot.editor.selecting.is_busy)
    assert robot.editor.selecting.hint == ""
    robot.key("enter")
    assert is_like(frozen(robot), BLOB)
    assert "outline" in robot.editor.session.recipe.text()


def test_without_opencv_a_subject_is_a_sentence(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cv2", None)
    select(robot, "subject", (0.1, 0.15), (0.6, 0.85))
    assert "pip install" in robot.editor.messages.shown[-1].text
    assert robot.editor.state.selection == ()


def test_escape_gives_up_the_drag_and_then_the_selection(robot: Robot) -> None:
    state = robot.editor.state
    select(robot, "rectangle", (0.1, 0.1), (0.5, 0.5))
    kept = state.selection
    robot.move(*robot.at(0.6, 0.6))
    robot.press()
    robot.move(*robot.at(0.9, 0.9))
    robot.key("escape")
    robot.move(*robot.at(0.95, 0.95))
    robot.release()
    assert state.selection == kept
    robot.key("escape")
    assert state.selection == ()
    robot.key("enter")
    assert robot.editor.messages.shown[-1].text == "Nothing is selected yet."
    assert robot.editor.session.recipe.mask == ()
    robot.editor.state.select_by = "subject"
    robot.drag((0.1, 0.15), (0.6, 0.85))
    robot.key("escape")
    time.sleep(0.5)
    robot.frame(count=3)
    assert state.selection == ()


@pytest.mark.parametrize("by", ["rectangle", "ellipse", "lasso"])
def test_dashes_are_seen_while_it_is_made_and_afterwards(robot: Robot, by: str) -> None:
    robot.see()
    robot.editor.state.select_by = by
    robot.move(5, 5)
    before = robot.pixels().astype(int)
    robot.move(*robot.at(0.2, 0.2))
    robot.press()
    for place in ((0.5, 0.25), (0.55, 0.5), (0.6, 0.6)):
        robot.move(*robot.at(*place))

    def changed() -> int:
        """Pixels near the way of the drag that became black or white."""
        (left, top), (right, bottom) = robot.at(0.15, 0.15), robot.at(0.65, 0.65)
        here = slice(round(top), round(bottom)), slice(round(left), round(right))
        seen, old = robot.pixels()[here], before[here]
        extreme = (seen.min(axis=2) > 240) | (seen.max(axis=2) < 60)
        return int((extreme & (np.abs(seen - old).max(axis=2) > 40)).sum())

    assert changed() > 200
    robot.release()
    robot.frame()
    assert changed() > 200
    robot.key("p")
    robot.move(5, 5)
    robot.frame()
    assert changed() == 0


def test_a_click_drops_it_and_so_does_another_picture(robot: Robot, tmp_path: Path) -> None:
    state = robot.editor.state
    for drop in (lambda: select(robot, "rectangle", (0.5, 0.5)), lambda: robot.editor.open(small_project(tmp_path))):
        select(robot, "rectangle", (0.1, 0.1), (0.5, 0.5))
        assert state.selection
        drop()
        robot.frame()
        assert state.selection == ()
        assert state.selected_area is None


def test_what_was_looked_for_or_picked_in_one_picture_is_not_selected_in_another(robot: Robot, tmp_path: Path) -> None:
    editor, state = robot.editor, robot.editor.state
    state.select_by = "subject"
    robot.drag((0.1, 0.15), (0.6, 0.85))
    assert editor.selecting.is_busy
    editor.open(small_project(tmp_path))
    robot.frame()
    assert not editor.selecting.is_busy
    robot.until(lambda: all(thread.name != "looking for a subject" for thread in threading.enumerate()))
    robot.frame(count=2)
    assert (state.selection, editor.messages.shown) == ((), [])
    for by in ("colour", "brightness"):
        select(robot, by, (0.5, 0.5))
        assert state.selection
        editor.open(small_project(tmp_path))
        robot.frame()
        editor.selecting.set_tolerance(0.3, False)
        assert (state.selection, state.selected_area) == ((), None)


@pytest.mark.parametrize("by", ["rectangle", "lasso"])
def test_what_is_being_drawn_over_one_picture_is_not_selected_in_another(robot: Robot, tmp_path: Path, by: str) -> None:
    robot.key("m")
    robot.editor.state.select_by = by
    for number, (x, y) in enumerate(((0.2, 0.2), (0.6, 0.2), (0.6, 0.6))):
        robot.move(*robot.at(x, y))
        if number == 0:
            robot.press()
    robot.editor.open(small_project(tmp_path))
    robot.frame()
    robot.move(*robot.at(0.7, 0.7))
    robot.release()
    robot.frame()
    assert robot.editor.state.selection == ()


def test_with_another_tool_in_hand_nothing_is_filled_or_inverted(robot: Robot) -> None:
    select(robot, "rectangle", (0.1, 0.1), (0.5, 0.5))
    robot.key("p")
    robot.key("i")
    robot.key("enter")
    robot.key("shift+enter")
    robot.key("delete")
    assert robot.editor.session.recipe.mask == ()
    robot.key("m")
    robot.key("enter")
    assert is_like(frozen(robot), box(0.1, 0.1, 0.5, 0.5))


def test_its_key_goes_through_what_can_be_selected_by(robot: Robot) -> None:
    state, seen = robot.editor.state, []
    for _ in SELECT_BY:
        seen.append(state.select_by)
        robot.key("shift+m")
    assert seen == list(SELECT_BY)
    robot.key("p")
    robot.key("shift+m")
    assert (state.tool_name, state.select_by) == ("select", "rectangle")


def test_a_selection_thickens_with_what_the_slider_says(robot: Robot, widgets: Widgets) -> None:
    masks = robot.editor.session.replay.masks
    widgets.click("Thickness")
    widgets.type("Fill with", "300")
    select(robot, "rectangle", (0.1, 0.1), (0.5, 0.5))
    widgets.click("Fill")
    assert masks.thickness.get().max() == pytest.approx(24576 + 8192 * np.log10(300), abs=8)
    widgets.click("Clear")
    assert (masks.thickness.get() == 24576).all()


def test_thickness_by_brightness_is_live_and_one_edit(robot: Robot, widgets: Widgets) -> None:
    session = robot.editor.session
    widgets.click("Thickness")
    widgets.look()
    slider = widgets.at["By brightness"]
    robot.move(slider.x + 20, slider.middle[1])
    robot.press()
    seen = []
    for step in range(1, 5):
        robot.move(slider.x + 20 + 0.2 * step * slider.width, slider.middle[1])
        robot.frame()
        seen.append(int(session.replay.masks.thickness.get().max()))
    robot.release()
    robot.frame(count=2)
    assert seen == sorted(set(seen))
    assert [entry.name for entry in session.document.history.entries] == ["Open", "Thickness by brightness"]
    widgets.click("Dark is thick")
    (edit,) = session.recipe.mask
    assert isinstance(edit, PictureMask)
    assert edit.invert
    thickness = session.replay.masks.thickness.get()
    assert thickness.shape == BLOB.shape
    assert thickness[BLOB].mean() > thickness[~(BLOB | SPOT)].mean()  # it is a little darker
    robot.key("ctrl+z")
    (edit,) = session.recipe.mask
    assert isinstance(edit, PictureMask)
    assert not edit.invert
    robot.key("ctrl+z")
    assert session.recipe.mask == ()


@pytest.mark.parametrize("seed", range(3))
def test_random_selections_are_replayed_to_the_byte(robot: Robot, seed: int) -> None:
    """Also after a warp, undone and redone."""
    dice, session, ways = random.Random(seed), robot.editor.session, list(SELECT_BY)[:5]

    def masks(replay: Replay) -> list[np.ndarray]:
        size = replay.masks.canvas.size[::-1]
        painted = (np.broadcast_to(mask.get(), size) for mask in (replay.masks.frozen, replay.masks.thickness))
        return [*painted, replay.warp.read()]

    states = []
    for number in range(9):
        if number == 3:
            robot.key("p")
            robot.drag((0.3, 0.5), (0.5, 0.5), steps=3)
            robot.rest()
            robot.key("m")
        places = [(dice.random(), dice.random()) for _ in range(dice.randrange(1, 5))]
        select(robot, dice.choice(ways), *places, mods=dice.choice((Mods(), Mods(shift=True), Mods(alt=True))))
        robot.editor.state.mask = dice.choice(("frozen", "thickness"))
        robot.key(dice.choice(("enter", "enter", "delete")))
        states.append((session.document.history.index, masks(session.replay)))
    assert session.document.history.index > 4
    for index, wanted in dice.sample(states, 5):
        session.go_to(index)
        session.settle()
        assert all(np.array_equal(a, b) for a, b in zip(masks(session.replay), wanted, strict=True))
    session.go_to(states[-1][0])
    session.settle()
    again = Replay(session.device, Recipe.parse(session.recipe.text()), session.pictures)
    again.seek(session.end)
    assert all(np.array_equal(a, b) for a, b in zip(masks(again), states[-1][1], strict=True))
    again.release()


@needs_a_screen
def test_a_person_selects_freezes_and_renders_the_same(tmp_path: Path, fluidwarp: Run) -> None:
    """With a real pointer and real keys; what the command line makes of the project is what was exported."""
    from app.media.pictures import read_picture

    desk, work = Desk(tmp_path), tmp_path / "work.fluidwarp"
    try:
        desk.open_pattern()
        desk.key("m")
        desk.drag((300, 200), (500, 400))
        desk.do("keydown", "shift", "sleep", "0.2")
        desk.drag((450, 300), (600, 500))
        desk.do("keyup", "shift", "keydown", "alt", "sleep", "0.2")
        desk.drag((320, 220), (360, 260))
        desk.do("keyup", "alt", "sleep", "0.2")
        desk.insist(lambda: desk.key("Return"), lambda: desk.title() == "pattern * - fluidwarp", "it to be frozen")
        desk.key("p")
        desk.drag((480, 350), (700, 350))
        time.sleep(2)
        desk.save(work)
    finally:
        desk.close()
    recipe = projects.load(work).recipe
    fill = recipe.mask[0]
    assert isinstance(fill, FillMask)
    assert [part.combine for part in fill.then] == ["add", "subtract"]
    assert [stroke.tool for stroke in recipe.stroke] == ["push"]
    for name in ("one.png", "other.png"):
        assert fluidwarp(tmp_path, "render", str(work), "-o", name).returncode == 0
    assert (tmp_path / "one.png").read_bytes() == (tmp_path / "other.png").read_bytes()
    assert fill.window is not None
    left, top, right, bottom = (
        round(part * side) for part, side in zip(fill.window.box, (WIDTH, HEIGHT) * 2, strict=True)
    )
    kept = slice(top + 20, bottom - 2), slice(left + 20, right - 2)
    rendered, before = read_picture(tmp_path / "one.png").pixels, pattern().pixels
    assert np.array_equal(rendered[kept][..., :3], before[kept])
    assert not np.array_equal(rendered[..., :3], before)


def test_the_section_of_the_tool_in_hand_stands_on_top(robot: Robot, widgets: Widgets) -> None:
    """That of handles is below all else with another tool: what is said in it, and then not, moves nothing else."""
    robot.key("g")
    robot.drag((0.4, 0.5), (0.4, 0.5), steps=1)
    robot.rest()
    assert widgets.at["Handles and pins"].y < widgets.at["Fluid"].y
    robot.key("p")
    robot.frame(count=2)
    assert widgets.at["Statistics"].y < widgets.at["Handles and pins"].y
    robot.key("m")
    robot.frame(count=2)
    assert widgets.at["Selection"].y < widgets.at["Fluid"].y < widgets.at["Handles and pins"].y
    robot.key("l")
    robot.editor.state.lanes.selected = {bar.which for bar in bars(robot.editor.session.recipe)}
    robot.frame(count=2)
    assert widgets.at["Handles and pins"].y < widgets.at["Fluid"].y


@pytest.mark.parametrize(("tool", "words"), [("g", "Handles and pins"), ("m", "Selection")])
def test_the_section_of_a_tool_is_seen_wherever_the_inspector_was_scrolled_to(
    robot: Robot, widgets: Widgets, tool: str, words: str
) -> None:
    robot.key("g")
    robot.drag((0.4, 0.5), (0.4, 0.5), steps=1)
    robot.rest()
    robot.key("p")
    robot.frame(count=2)
    rect = robot.editor.layout.inspector
    assert rect is not None
    robot.frame(Move(*rect.middle))
    for _ in range(40):
        robot.frame(Wheel(0, -3))
    assert widgets.at["Fluid"].y < rect.y
    robot.key(tool)
    robot.frame(count=3)
    assert rect.y <= widgets.at[words].y < widgets.at["Fluid"].y
    robot.move(*rect.middle)
    for _ in range(40):
        robot.frame(Wheel(0, -3))
    assert widgets.at[words].y < rect.y, "what stays in hand scrolls nothing"

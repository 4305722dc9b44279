"""Which slider, switch, choice or button sets what, by the words that stand on it."""

from __future__ import annotations

from dataclasses import asdict, replace
from inspect import signature
from pathlib import Path
from typing import Any

import imageio.v3 as iio
import numpy as np
import pytest
from imgui_bundle import imgui

from app.media import project as projects
from app.media.animation import ANIMATIONS as CONTAINERS
from app.media.formats import FORMATS
from app.media.maps import MAP_ENDINGS
from app.media.pictures import write_picture
from app.media.project import from_picture
from app.model.picture import Picture
from app.model.presets import DEFAULT, PUTTY
from app.model.recipe import FluidSettings, Output, Recipe
from app.model.strokes import BrushPath, Change, Stroke
from app.model.tools import TOOL, BrushSettings, Press
from app.progress import Progress
from app.ui.browser import Browser
from app.ui.editor_state import EditorState
from app.ui.events import LEFT, Button, Move
from app.ui.export_choices import ANIMATION, KINDS, MAP, PICTURE, PICTURES, PRESETS
from app.ui.export_dialog import ExportDialog
from app.ui.files import load_any
from app.ui.panels import inspector
from app.ui.preferences import Preferences
from app.ui.units import PER_SECOND
from app.ui.widgets import Ui
from app.work.export import run
from app.work.jobs import Job
from solver.gl.device import Device
from support.commands import Run
from support.drawn import Drawn
from support.editing import Robot, Still, export_dialog, small_project
from support.widgets import Widgets


def only(robot: Robot, *sections: str) -> None:
    """Let these sections of the inspector be open, and no others."""
    names = ("fluid", "view", "quality", "masks", "history", "numbers")
    robot.editor.state.sections = {name: name in sections for name in names}


def changed(before: dict[str, Any], after: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in after.items() if value != before[name]}


@pytest.mark.parametrize(
    ("label", "typed", "wanted"),
    [
        ("Size", "60 px", {"radius": 60 / 480}),
        ("Hardness", "35 %", {"hardness": 0.35}),
        ("Strength", "40 %", {"strength": 0.4}),
        ("Hold", "70 %", {"hold": 0.7}),
        ("Local", "25 %", {"local": 0.25}),
    ],
)
def test_a_slider_of_the_bar_sets_its_part_of_the_brush(
    robot: Robot, widgets: Widgets, label: str, typed: str, wanted: dict[str, float]
) -> None:
    before = asdict(robot.editor.state.brush)
    widgets.type(label, typed)
    assert changed(before, asdict(robot.editor.state.brush)) == pytest.approx(wanted)


@pytest.mark.parametrize("ahead", [1, 3, 4])
def test_a_slider_follows_to_where_it_is_let_go_of_however_few_frames_there_are(
    robot: Robot, widgets: Widgets, ahead: int
) -> None:
    """On a busy machine a press, the way and the release come with one frame."""
    widgets.look()
    place = widgets.at["Hardness"]
    x, y = place.middle
    events = [Move(x, y), Button(LEFT, True), Move(x + 9, y), Move(x + place.width / 4, y), Button(LEFT, False)]
    robot.frame(*events[:ahead])
    robot.frame(*events[ahead:])
    while robot.editor.backend.is_behind:
        assert robot.editor.wait() == 0
        robot.frame()
    assert robot.editor.state.brush.hardness == pytest.approx(0.75 + 3 / place.width, abs=0.01)


@pytest.mark.parametrize(("label", "name"), [("Viscosity", "viscosity"), ("Drag", "drag")])
@pytest.mark.parametrize("begun", [False, True])
def test_a_slider_of_the_fluid_sets_its_number(
    robot: Robot, widgets: Widgets, label: str, name: str, begun: bool
) -> None:
    session = robot.editor.session
    if begun:
        robot.drag((0.4, 0.5), (0.45, 0.5), steps=2)
        robot.rest()
    only(robot, "fluid")
    before = session.recipe.fluid_at(session.end).model_dump()
    widgets.type(label, "1.25")
    robot.rest()
    assert changed(before, session.recipe.fluid_at(session.end).model_dump()) == {name: 1.25}
    assert session.document.history.entries[-1].name == label


def test_a_setting_is_shown_as_it_is_where_it_would_be_changed(
    robot: Robot, widgets: Widgets, monkeypatch: pytest.MonkeyPatch
) -> None:
    """While time stands still before strokes that wait, it was shown as it is at the playhead, and set behind them."""
    session = robot.editor.session
    session.begin_with(viscosity=1.0, drag=1.5)
    for y in (0.3, 0.6):
        session.press(TOOL["push"], Press(BrushSettings(), False, session.extent, session.dt), 0.3, y)
        session.move(0.6, y)
        session.release()
    session.change(PUTTY.name, viscosity=PUTTY.viscosity, drag=PUTTY.drag)
    session.pause()
    only(robot, "fluid")
    drawn = Drawn(monkeypatch, ("add_text",))
    robot.frame(count=2)
    assert session.tick < session.end
    assert not session.is_moving
    said = [line.rpartition("| ")[2] for line in drawn.take()]
    assert PER_SECOND.text(PUTTY.drag) in said
    assert f"{PUTTY.line}." in said
    assert PER_SECOND.text(1.5) not in said
    widgets.type("Drag", "2.5")
    assert [change.tick for change in session.recipe.change] == [session.end]
    assert session.recipe.change[0].drag == 2.5


def test_a_grid_far_finer_than_the_picture_is_told_where_it_is_chosen(
    device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was with the export, while a preview that takes as long said nothing of it."""
    write_picture(tmp_path / "small.png", Picture(np.zeros((45, 60, 3), np.uint8)))
    recipe = Recipe(fluid=FluidSettings(grid=200))
    with Robot(device, from_picture(tmp_path / "small.png", recipe)) as robot:
        robot.key("ctrl+e")
        asked = robot.editor.dialogs.shown[-1]
        assert isinstance(asked, ExportDialog)
        drawn = Drawn(monkeypatch, ())
        for finer, grids in (
            (0, []),
            (1, ["A grid of 400 cells is 6.67 times as fine as the picture of 60 x 45 pixels"]),
        ):
            asked.choices.finer = finer
            robot.frame(count=2)
            drawn.take()
            robot.frame()
            said = [line.rpartition("| ")[2].partition(",")[0] for line in drawn.take()]
            assert [words for words in said if words.startswith("A grid of")] == grids


class Finished:
    """An export that is done at once: all of it is magenta."""

    is_done, part, error = True, 1.0, ""
    shape = (1, 1)  # height and width

    def __init__(self, job: Job) -> None:
        self.job = job
        write_picture(job.target, Picture(np.tile(np.array([255, 0, 255], np.uint8), (*self.shape, 1))))

    def poll(self, *heard: object) -> None: ...
    def stop(self, then: object = None) -> None: ...


@pytest.mark.parametrize("shape", [(300, 60), (60, 300)])
def test_the_preview_of_an_export_has_the_sides_of_the_picture(
    robot: Robot, widgets: Widgets, tmp_path: Path, shape: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As wide as the dialog, unless it is too high for that."""
    monkeypatch.setattr(Finished, "shape", shape)
    monkeypatch.setattr("app.ui.export_dialog.ExportProcess", Finished)
    dialog = export_dialog(robot, tmp_path)
    dialog.choices.finer = 1
    robot.editor.dialogs.show(dialog)
    robot.frame(count=3)
    widgets.click("Preview")
    robot.frame(count=5)
    widgets.look()
    assert ("Preview" in widgets.at, dialog.problem) == (False, "")
    robot.see()
    rows, columns = np.nonzero((robot.pixels() == (255, 0, 255)).all(axis=2))
    height, width = np.ptp(rows) + 1, np.ptp(columns) + 1
    assert height >= 60
    assert width / height == pytest.approx(shape[1] / shape[0], rel=0.05)


def test_the_middle_of_the_viscosity_is_that_of_its_decades(robot: Robot, widgets: Widgets) -> None:
    only(robot, "fluid")
    widgets.click("Viscosity")
    assert robot.editor.session.recipe.fluid.viscosity == pytest.approx(1e-2, rel=0.1)  # of 1e-5 to 10


def test_a_map_that_work_starts_from_is_told_and_left_whatever_has_been_painted(
    robot: Robot, widgets: Widgets, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    np.save(tmp_path / "m.npy", np.full((180, 240, 2), 0.01, np.float32))
    robot.editor.files.start_from_map(tmp_path / "m.npy")
    robot.until(lambda: not robot.editor.files.is_loading)
    robot.drag((0.4, 0.5), (0.5, 0.5), steps=3)
    robot.rest()
    only(robot, "quality")
    drawn = Drawn(monkeypatch)
    robot.frame()
    assert any(line.endswith("| Starts from the map m.npy") for line in drawn.take())
    widgets.click("Start from the picture")
    assert robot.editor.session.recipe.map is None
    assert robot.editor.session.recipe.stroke


def test_a_picture_that_is_opened_begins_with_the_fluid_as_it_is_now(
    robot: Robot, widgets: Widgets, tmp_path: Path
) -> None:
    """As it has been set in the middle of the work, not as the work began."""
    robot.drag((0.4, 0.5), (0.45, 0.5), steps=2)
    robot.rest()
    only(robot, "fluid")
    widgets.type("Viscosity", "1.25")
    robot.rest()
    assert robot.editor.session.recipe.fluid.viscosity != 1.25
    write_picture(tmp_path / "other.png", Picture(np.zeros((48, 64, 3), np.uint8)))
    robot.drop(tmp_path / "other.png")
    widgets.click("Don't save")
    assert robot.editor.session.project.picture.width == 64
    assert robot.editor.session.recipe.fluid.viscosity == 1.25


def test_what_becomes_of_unsaved_work_is_told_as_it_is(
    robot: Robot, widgets: Widgets, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Undo comes back to it where another picture is opened, but not where the window is closed."""
    robot.drag((0.4, 0.5), (0.45, 0.5), steps=2)
    robot.rest()
    drawn, work = Drawn(monkeypatch, ()), robot.editor.session.recipe
    robot.key("ctrl+q")
    robot.frame(count=2)
    assert " is lost if you quit without saving." in drawn.lines[-1] + drawn.lines[-2]
    widgets.click("Cancel")
    write_picture(tmp_path / "other.png", Picture(np.zeros((48, 64, 3), np.uint8)))
    drawn.lines.clear()
    robot.drop(tmp_path / "other.png")
    said = {line.partition(" | ")[2] for line in drawn.lines if "not saved" in line}
    assert len(said) == 1
    assert said.pop().endswith(
        " is not saved. After you open other.png, you can come back to it with Undo; it is lost when you quit."
    )
    widgets.click("Don't save")
    assert robot.editor.session.project.picture.width == 64
    robot.key("ctrl+z")
    robot.frame(count=2)
    assert robot.editor.session.recipe == work


@pytest.mark.parametrize(("then", "wanted"), [(None, 0.02), (0.3, 0.3)])
def test_a_picture_that_is_opened_does_not_begin_with_what_a_fit_has_found(
    robot: Robot, widgets: Widgets, tmp_path: Path, then: float | None, wanted: float
) -> None:
    """That is for the handles of the work it was made of; what the person sets after it is not."""
    session = robot.editor.session
    session.change("Viscosity", viscosity=0.02)
    for found in (0.007, 0.008):
        session.edit("Fit", fluid=session.recipe.fluid.model_copy(update={"viscosity": found}))
    if then is not None:
        session.change("Viscosity", viscosity=then)
    write_picture(tmp_path / "other.png", Picture(np.zeros((48, 64, 3), np.uint8)))
    robot.drop(tmp_path / "other.png")
    widgets.click("Don't save")
    assert robot.editor.session.project.picture.width == 64
    assert robot.editor.session.recipe.fluid.viscosity == wanted


def test_edges_of_the_fluid_are_what_is_pressed(robot: Robot, widgets: Widgets) -> None:
    for words, walls in (("Edges hold", "no-slip"), ("Edges glide", "free-slip")):
        widgets.click(words)
        assert robot.editor.session.recipe.fluid.walls == walls


@pytest.mark.parametrize(
    ("words", "viscosity", "drag", "local"),
    [("Putty", 0.3, 0.0, 1.0), ("Honey", 0.03, 2.0, 0.0), ("Water", 0.0065, 0.0, 0.0)],
)
def test_a_feel_is_its_viscosity_drag_and_how_local_a_push_is(
    robot: Robot, widgets: Widgets, words: str, viscosity: float, drag: float, local: float
) -> None:
    robot.editor.workspace.change("own", viscosity=0.5, drag=1.0)
    widgets.click(words)
    fluid = robot.editor.session.recipe.fluid
    assert (fluid.viscosity, fluid.drag, robot.editor.state.brush.local) == (viscosity, drag, local)


def test_a_work_that_is_opened_makes_pushes_as_local_as_its_fluid_wants(robot: Robot, tmp_path: Path) -> None:
    state, honey = robot.editor.state, small_project(tmp_path)
    fluid = honey.recipe.fluid.model_copy(update={"viscosity": PUTTY.viscosity, "drag": PUTTY.drag})
    putty = from_picture(tmp_path / "pattern.png", honey.recipe.edited(fluid=fluid))
    for project, local in ((putty, 1.0), (honey, 0.0)):
        robot.editor.open(project)
        assert state.brush.local == local
    for project, local in ((honey, 1.0), (putty, 0.4)):
        state.brush = replace(state.brush, local=local)
        robot.editor.open(project)
        assert state.brush.local == local, "set by hand"
    state.make_local(1.0)
    state.brush = replace(state.brush, local=0.0)
    robot.editor.remember()
    after = EditorState.recalled(robot.editor.preferences)
    after.suit(fluid)
    assert after.brush.local == 0.0, "set by hand before the start"


def test_every_kind_of_edge_of_the_picture_is_what_it_is_called(robot: Robot, widgets: Widgets) -> None:
    only(robot, "quality")
    for words, edges in (
        ("Black", "black"),
        ("Mirrored", "mirror"),
        ("Its outermost pixels", "clamp"),
        ("Transparent", "transparent"),
        ("Repeated", "wrap"),
    ):
        widgets.choose("##edges", words)
        assert robot.editor.session.recipe.edges == edges


def test_a_grid_is_the_one_that_is_chosen(robot: Robot, widgets: Widgets) -> None:
    only(robot, "quality")
    for cells in inspector.GRIDS[:3]:
        widgets.choose("##detail", f"Detail: {inspector.DETAILS[cells]} ({cells})")
        assert robot.editor.session.recipe.fluid.grid == cells
        assert robot.editor.session.document.history.entries[-1].name == f"Grid of {cells}"
    widgets.choose("##detail", "Detail: automatic")
    assert robot.editor.quality.is_on
    widgets.look()
    rows, index = widgets.lists["##detail"]
    assert rows[index] == f"Detail: automatic ({robot.editor.session.recipe.fluid.grid})"


@pytest.mark.parametrize("label", ["Warp grid", "Viscosity", "Frozen", "Velocity", "Forces"])
def test_an_overlay_is_shown_as_strongly_as_its_slider_says(robot: Robot, widgets: Widgets, label: str) -> None:
    only(robot, "view")
    name = {"Warp grid": "grid"}.get(label, label.lower())
    key = {"grid": "1", "viscosity": "2", "frozen": "3", "velocity": "4", "forces": "5"}[name]
    widgets.click(label)
    assert [other for other, overlay in robot.editor.state.overlays.items() if overlay.shown] == [name]
    widgets.type("Opacity", "35 %")
    assert {other for other, overlay in robot.editor.state.overlays.items() if overlay.opacity == 0.35} == {name}
    robot.key(key)
    assert not robot.editor.state.overlays[name].shown


@pytest.mark.parametrize(
    ("words", "name"),
    [("Stop all motion", "clear_velocity"), ("Reset the warp", "reset_warp")],
)
def test_a_button_of_the_inspector_does_what_it_says(robot: Robot, widgets: Widgets, words: str, name: str) -> None:
    robot.drag((0.4, 0.5), (0.45, 0.5), steps=2)
    robot.rest()
    only(robot, "masks")
    widgets.click(words)
    recipe = robot.editor.session.recipe
    assert recipe.change == (Change.model_validate({"tick": recipe.change[0].tick, name: True}),)


def test_statistics_are_shown_and_the_hint_put_away_where_that_is_pressed(robot: Robot, widgets: Widgets) -> None:
    only(robot, "numbers")
    for shown in (True, False):
        widgets.click("Show over the picture")
        assert robot.editor.state.statistics is shown
    robot.editor.preferences.hint = True
    widgets.look()
    robot.click(*next(widget.rect.middle for widget in widgets.drawn if widget.words == "no hint"))
    assert robot.editor.preferences.hint is False


def test_an_entry_of_the_history_is_the_one_that_is_pressed(robot: Robot) -> None:
    for number in range(3):
        robot.drag((0.3 + 0.1 * number, 0.4), (0.33 + 0.1 * number, 0.4), steps=2)
    robot.rest()
    only(robot, "history")
    robot.frame(count=2)
    rect = robot.editor.layout.inspector
    assert rect is not None
    session = robot.editor.session
    rows = []
    for y in range(round(rect.y), round(rect.y) + 400, 13):
        robot.click(rect.x + 60, y)
        robot.frame()
        if (index := session.document.history.index) not in rows[-1:]:
            rows.append(index)
    assert rows == [3, 0, 1, 2, 3]


@pytest.mark.parametrize("part", [0.0, 0.25, 1.0])
def test_the_track_is_as_long_as_the_recording(robot: Robot, part: float) -> None:
    """Its ends lie 7 points within, where the playhead is drawn; white and bright as nothing else there."""
    robot.see()
    session, rect = robot.editor.session, robot.editor.layout.timebar
    robot.drag((0.4, 0.5), (0.41, 0.5), steps=2)
    robot.rest()
    session.edit("Longer", duration=4.0)
    robot.rest()
    session.seek(round(part * session.end))
    robot.rest()
    robot.move(5, 5)
    bright = (robot.pixels()[round(rect.y) + 22 : round(rect.y) + 34, 279:1090].min(axis=-1) > 225).sum(axis=0)
    x = 279 + float(np.flatnonzero(bright > 6).mean())
    session.seek(session.end // 3)
    robot.rest()
    robot.move(x, rect.y + 28)
    robot.press()
    robot.release()
    robot.rest()
    assert session.tick == round(part * session.end)


def test_amount_is_the_part_of_the_warp_that_is_seen_at_any_time(robot: Robot, widgets: Widgets) -> None:
    robot.drag((0.4, 0.5), (0.5, 0.5), steps=6)
    robot.rest()
    session = robot.editor.session
    tick, whole, entries = session.tick, robot.warp(), len(session.document.history.entries)
    for percent in (75, 20, 150):
        widgets.type("Amount", f"{percent} %")
        robot.rest()
        assert session.tick == tick
        assert session.recipe.amount == percent / 100
    assert len(session.document.history.entries) == entries + 3
    widgets.type("Amount", "50 %")
    robot.rest()
    assert np.array_equal(session.seen.read(), 0.5 * whole)  # of a push this short
    robot.key("ctrl+z")
    assert session.recipe.amount == 1.5


def test_all_of_the_warp_is_seen_while_a_brush_moves_it(robot: Robot, widgets: Widgets) -> None:
    robot.drag((0.4, 0.5), (0.5, 0.5), steps=6)
    robot.rest()
    widgets.type("Amount", "50 %")
    session = robot.editor.session
    robot.move(*robot.at(0.6, 0.6))
    robot.press()
    robot.move(*robot.at(0.65, 0.6))
    assert session.seen is session.replay.warp
    robot.release()
    robot.rest()
    assert np.abs(session.seen.read()).max() < 0.9 * np.abs(robot.warp()).max()


@pytest.mark.parametrize(("tool", "words"), [("p", "Left and right"), ("p", "Radial"), ("f", "Both")])
def test_a_stroke_is_painted_with_symmetry_and_undone_as_one(
    robot: Robot, widgets: Widgets, tool: str, words: str
) -> None:
    robot.see()
    session = robot.editor.session
    widgets.click("Symmetry")
    plain = robot.canvas()
    widgets.choose("##symmetry", words)
    robot.move(5, 5)
    robot.frame(count=2)
    assert not np.array_equal(robot.canvas(), plain)  # the axes
    if words == "Radial":
        widgets.type("Sectors", "5")
    before = session.recipe
    robot.key(tool)
    seen = []
    for place in ((5, 5), robot.at(0.2, 0.3)):
        robot.move(*place)
        robot.frame(count=2)
        seen.append(robot.canvas())
    across = 6 * seen[0].shape[1] // 10
    assert not np.array_equal(seen[0][:, across:], seen[1][:, across:])  # a ring there too
    robot.drag((0.2, 0.3), (0.28, 0.36), steps=6)
    robot.rest()
    stroke = (*session.recipe.stroke, *session.recipe.mask)[-1]
    assert isinstance(stroke, BrushPath)
    assert stroke.symmetry == {"Left and right": "left-right", "Radial": "radial", "Both": "both"}[words]
    assert stroke.sectors == (5 if words == "Radial" else 6)
    frozen = session.replay.masks.frozen.get()
    moved = np.abs(robot.warp()).max(axis=2)
    changed = frozen if tool == "f" else moved > 0.2 * moved.max()
    height, width = changed.shape[:2]
    assert changed[: height // 2, : width // 2].any()
    assert changed[: height // 2, width // 2 :].any()
    robot.key("ctrl+z")
    robot.rest()
    assert session.recipe == before


@pytest.fixture
def dialog(robot: Robot) -> ExportDialog:
    robot.drag((0.4, 0.5), (0.5, 0.5), steps=6)
    robot.rest()
    robot.key("ctrl+e")
    robot.frame(count=3)
    dialog = robot.editor.dialogs.shown[-1]
    assert isinstance(dialog, ExportDialog)
    return dialog


def test_a_part_of_the_warp_is_exported_as_the_command_line_writes_it(
    robot: Robot, widgets: Widgets, tmp_path: Path, fluidwarp: Run
) -> None:
    robot.key("t")
    robot.drag((0.5, 0.5), (0.5, 0.5), steps=1, hold=30)
    robot.rest()
    widgets.type("Amount", "40 %")
    session, dialog = robot.editor.session, export_dialog(robot, tmp_path)
    dialog.name = "window"
    run(robot.device, dialog.job(), Progress())
    projects.save(replace(session.project, recipe=session.document.recipe), tmp_path / "work.fluidwarp")
    assert fluidwarp(tmp_path, "render", "work.fluidwarp", "-o", "line.png").returncode == 0
    assert (tmp_path / "window.png").read_bytes() == (tmp_path / "line.png").read_bytes()


def test_pixels_are_mixed_as_is_chosen(device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a picture whose lights go beyond white; of others nobody is asked, unless the recipe says something else."""

    def asked() -> ExportDialog:
        robot.rest()
        widgets.at.clear()
        robot.key("ctrl+e")
        robot.frame(count=2)
        return robot.editor.dialogs.shown[-1]  # type: ignore[return-value]

    write_picture(tmp_path / "a.exr", Picture(np.ones((48, 64, 3), np.float32)))
    robot = Robot(device, load_any(tmp_path / "a.exr"))
    widgets = Widgets(robot, monkeypatch)
    dialog = asked()
    assert dialog.job().recipe.output.filter == "catmull-rom"
    for label, wanted in (
        ("No ringing", "limited"),
        ("Soft", "bilinear"),
        ("Hard", "nearest"),
        ("Sharp", "catmull-rom"),
    ):
        widgets.click(label)
        assert dialog.job().recipe.output.filter == wanted
    dialog.close()
    write_picture(tmp_path / "b.png", Picture(np.ones((48, 64, 3), np.uint8)))
    robot.editor.open(load_any(tmp_path / "b.png"))
    for filter_ in ("catmull-rom", "limited"):
        robot.editor.session.edit("Filter", output=Output(filter=filter_))
        dialog = asked()
        assert ("No ringing" in widgets.at) == (filter_ == "limited")
        assert dialog.job().recipe.output.filter == filter_
        dialog.close()
    robot.close()


@pytest.mark.parametrize("number", range(len(PRESETS)))
def test_a_preset_chooses_all_that_it_says(
    robot: Robot, widgets: Widgets, dialog: ExportDialog, tmp_path: Path, number: int
) -> None:
    preset = PRESETS[number]
    widgets.click(preset.name)
    assert dialog.preset == number
    assert dialog.choices.file_kind is KINDS[preset.kind][1][preset.format]
    dialog.folder = tmp_path
    job = dialog.job()
    job.check()
    assert job.outputs.is_animation == (preset.kind == ANIMATION)
    assert job.recipe.time.ping_pong == preset.returns
    assert job.recipe.output.size is None  # the picture is smaller than any preset
    widgets.click("Animation" if preset.kind == PICTURE else "Picture")
    assert dialog.preset == -1


def test_what_a_preset_is_covers_nothing_of_what_it_chooses(
    robot: Robot, widgets: Widgets, dialog: ExportDialog
) -> None:
    robot.move(*widgets.at["Loop"].middle)
    robot.frame(count=60)
    told = imgui.internal.find_window_by_name("##Tooltip_00")
    assert told.active
    assert told.pos.y + told.size.y <= widgets.at["Loop"].y


def test_the_button_of_the_bar_exports(robot: Robot, widgets: Widgets) -> None:
    widgets.click("Export")
    assert isinstance(robot.editor.dialogs.shown[-1], ExportDialog)


def test_a_file_that_will_be_replaced_is_told(
    robot: Robot, dialog: ExportDialog, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    dialog.folder = tmp_path
    words, wrapped = [], Ui.wrapped
    monkeypatch.setattr(Ui, "wrapped", lambda ui, said, *how: words.append(said) or wrapped(ui, said, *how))
    for is_there in (False, True):
        words.clear()
        robot.frame()
        assert ("This file exists and will be replaced." in words) is is_there
        dialog.job().target.write_bytes(b"")
    dialog.name = "f.%04d"
    for number, is_there in ((None, False), (12, True)):
        if number is not None:
            dialog.output.with_name(f"f.{number:04d}{dialog.ending}").touch()
        words.clear()
        robot.frame()
        told = "Files of this name exist, and those of the same numbers will be replaced."
        assert (told in words) is is_there


def test_what_another_has_just_written_is_told_before_it_is_replaced(
    robot: Robot, dialog: ExportDialog, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Enter, in the first frame in which it is there, or is another: the person has not read that."""
    started = list[Job]()
    monkeypatch.setattr(robot.editor.exports, "start", started.append)
    dialog.folder = tmp_path
    robot.frame(count=3)
    for theirs in (b"theirs", b"theirs again"):
        dialog.output.write_bytes(theirs)
        robot.key("enter")
        assert not started
    robot.frame(count=3)
    robot.key("enter")
    robot.frame()
    assert len(started) == 1
    assert not robot.editor.dialogs.shown


def test_a_picture_that_the_work_needs_is_not_replaced_by_an_export(
    robot: Robot, dialog: ExportDialog, widgets: Widgets
) -> None:
    project = robot.editor.session.project
    before = (project.folder / "pattern.png").read_bytes()
    dialog.folder, dialog.name = project.folder, "pattern"
    robot.frame(count=2)
    widgets.click("Export")
    assert dialog.problem.endswith("pattern.png would be replaced by its own result; choose another name")
    assert not robot.editor.exports.is_running
    assert (project.folder / "pattern.png").read_bytes() == before


def test_an_exported_picture_is_what_is_asked_for(robot: Robot, dialog: ExportDialog, widgets: Widgets) -> None:
    widgets.click("16 bits")
    assert (dialog.job().target.suffix, dialog.job().outputs.bits) == (".png", 16)
    widgets.click("JPEG")
    widgets.type("Quality", "35")
    widgets.type("Size", "120")
    grid = robot.editor.session.recipe.fluid.grid
    assert (dialog.choices.kind, dialog.job().recipe.fluid.grid) == (PICTURE, grid)
    widgets.click("2 x")
    job = dialog.job()
    assert (job.target.suffix, job.recipe.output.quality, job.recipe.output.size) == (".jpg", 35, 120)
    assert job.recipe.fluid.grid == 2 * grid
    robot.editor.session.seek(3)
    assert dialog.job().recipe.ticks == 3


def test_an_exported_animation_is_what_is_asked_for(robot: Robot, dialog: ExportDialog, widgets: Widgets) -> None:
    widgets.click("Animation")
    for words, ending in (("GIF", ".gif"), ("Frames", ".%04d.png"), ("EXR", ".%04d.exr"), ("MP4", ".mp4")):
        widgets.click(words)
        assert dialog.job().target.name.endswith(ending)
    widgets.click("H.265")
    assert dialog.job().outputs.codec == "h265"
    for text, seconds in (("0.01", 0.0), ("0.05", 2 / 30), ("0.1", 0.1)):  # two frames at least
        widgets.type("Dissolve the end into the beginning", text)
        assert dialog.job().recipe.time.dissolve == pytest.approx(seconds)
    assert dialog.preset == -1
    widgets.click("Ping-pong")
    assert (dialog.job().recipe.time.ping_pong, dialog.job().recipe.time.dissolve) == (True, 0.0)
    widgets.type("Frames a second", "24")
    widgets.type("From", "0.1")
    widgets.type("To", "0.2")
    job = dialog.job()
    assert dialog.choices.kind == ANIMATION
    assert (job.recipe.output.fps, job.recipe.time.start, job.recipe.time.end) == pytest.approx((24, 0.1, 0.2))


def test_what_plays_stands_still_behind_the_dialog_of_the_export(robot: Robot) -> None:
    """A picture is of the moment at which the dialog was asked for, and not of a later one."""
    session = robot.editor.session
    robot.drag((0.3, 0.5), (0.6, 0.5), steps=8)
    robot.rest()
    robot.key("home")
    robot.key("space")
    robot.frame(count=6)
    assert session.playing
    robot.key("ctrl+e")
    moment = session.tick
    assert 0 < moment < session.end
    robot.frame(count=6)
    dialog = robot.editor.dialogs.shown[-1]
    assert isinstance(dialog, ExportDialog)
    assert session.tick == moment
    assert not session.is_moving


def test_an_animation_ends_where_the_recording_does_that_goes_on_behind_the_dialog(
    robot: Robot, widgets: Widgets, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = robot.editor.session
    session.change("Water", viscosity=0.0006)
    robot.drag((0.3, 0.5), (0.6, 0.5), steps=4)
    robot.key("ctrl+e")
    robot.frame(count=3)
    words, text = [], Ui.text
    monkeypatch.setattr(Ui, "text", lambda ui, said, *how, **more: words.append(said) or text(ui, said, *how, **more))
    robot.frame()
    assert "Still moving: this moment is exported." in words
    widgets.click("Animation")
    robot.frame()
    assert "Still moving: recorded until you export." in words
    dialog, before = robot.editor.dialogs.shown[-1], session.end
    assert isinstance(dialog, ExportDialog)
    robot.frame(count=10)
    assert session.end > before
    assert dialog.job().recipe.time.end == pytest.approx(session.end * session.dt)
    widgets.type("To", "0.05")
    assert dialog.job().recipe.time.end == pytest.approx(0.05)
    for _ in range(2):  # a double click: at its very end it is the recording's again, and goes with it
        robot.click(*widgets.at["To"].middle)
    before = session.end
    robot.frame(count=10)
    assert session.end > before
    assert dialog.job().recipe.time.end == pytest.approx(session.end * session.dt)


def test_an_animation_that_is_shown_to_end_where_the_recording_does_ends_there(
    robot: Robot, dialog: ExportDialog, widgets: Widgets
) -> None:
    """Of whose 0.9333 seconds, say, two digits are shown, and are slid to."""
    session = robot.editor.session
    while session.end * session.dt < round(session.end * session.dt, 2) + 0.001:
        session.step()
    widgets.click("Animation")
    for typed in (f"{session.end * session.dt:.2f}", "99"):
        widgets.type("To", "0.05")
        assert dialog.job().recipe.time.end == pytest.approx(0.05)
        widgets.type("To", typed)
        session.step()  # as it goes on
        assert dialog.job().recipe.time.end == pytest.approx(session.end * session.dt)


def test_print_notes_the_dots_per_inch_that_printers_ask_for(
    robot: Robot, dialog: ExportDialog, widgets: Widgets
) -> None:
    assert dialog.job().outputs.dpi is None
    widgets.click("Print")
    assert dialog.job().outputs.dpi == 300
    widgets.click("EXR")
    assert dialog.job().outputs.dpi == 300
    widgets.click("Animation")
    assert dialog.job().outputs.dpi is None


def test_an_exported_map_is_what_is_asked_for(robot: Robot, dialog: ExportDialog, widgets: Widgets) -> None:
    widgets.click("Warp map")
    maps = dialog.job().outputs.maps
    assert maps is not None
    assert (dialog.choices.kind, maps.kind, maps.forward, maps.path.suffix) == (MAP, "st", False, ".exr")
    widgets.click("TIFF")
    widgets.click("From the original")
    widgets.click("Offsets in pixels")
    maps = dialog.job().outputs.maps
    assert maps is not None
    assert (maps.kind, maps.forward, maps.path.suffix) == ("offsets", True, ".tif")


def test_every_file_that_the_command_line_writes_can_be_exported(robot: Robot, tmp_path: Path) -> None:
    """Each is found writable by the job itself; maps are those of `--map`."""
    robot.drag((0.4, 0.5), (0.5, 0.5), steps=6)
    robot.rest()
    dialog = export_dialog(robot, tmp_path)
    written, codecs = set[str](), set[str]()
    for kind, (_, files) in enumerate(KINDS):
        for number, file in enumerate(files):
            for variant in range(len(file.variants)):
                dialog.choices.kind, dialog.choices.format[kind], dialog.choices.variant[kind][number] = (
                    kind,
                    number,
                    variant,
                )
                job = dialog.job()
                job.check()
                assert job.outputs.is_animation == (kind == ANIMATION)
                written.add(dialog.ending)
                if kind == ANIMATION and dialog.ending in CONTAINERS:
                    codecs.add(job.outputs.codec or next(iter(CONTAINERS[dialog.ending].codecs)))
    same = {".tiff", ".jpeg"}
    assert written >= (set(FORMATS) | set(CONTAINERS) | set(MAP_ENDINGS)) - same
    assert codecs == {codec for container in CONTAINERS.values() for codec in container.codecs}


def test_the_next_export_begins_with_the_kind_of_the_last(robot: Robot, tmp_path: Path) -> None:
    robot.drag((0.4, 0.5), (0.5, 0.5), steps=6)
    robot.rest()
    preferences = Preferences(export_folder=str(tmp_path))
    preferences.exported(tmp_path / "a.webm", "Animation WebM")
    editor = robot.editor
    dialog = ExportDialog(editor.session, editor.exports, editor.chooser, preferences)
    assert (dialog.choices.kind, dialog.ending) == (ANIMATION, ".webm")
    preferences.export_as = "Something of another version"
    assert ExportDialog(editor.session, editor.exports, editor.chooser, preferences).choices.kind == PICTURE


def test_the_next_export_of_a_work_begins_with_what_was_chosen_for_the_last(
    robot: Robot, dialog: ExportDialog, widgets: Widgets, tmp_path: Path
) -> None:
    """After a loop it was no loop any more, and the file was replaced. The time goes to the end again."""
    editor = robot.editor

    def export(asked: ExportDialog) -> Job:
        asked.folder = tmp_path
        job = asked.job()
        widgets.click("Export")
        assert not editor.dialogs.shown, asked.problem
        editor.exports.cancel()
        robot.drag((0.4, 0.6), (0.5, 0.6), steps=6)
        robot.rest()
        return job

    def ask() -> ExportDialog:
        robot.key("ctrl+e")
        robot.frame(count=3)
        asked = editor.dialogs.shown[-1]
        assert isinstance(asked, ExportDialog)
        return asked

    widgets.click("Loop")
    dialog.choices.size, dialog.choices.quality, dialog.choices.fps, dialog.name, dialog.start = 160, 70, 24, "sky", 0.1
    first = export(dialog)
    again = ask()
    assert again.start == 0.0
    second = export(again)
    assert second.target == first.target == tmp_path / "sky.mp4"
    assert second.recipe.output == first.recipe.output
    assert second.recipe.time.ping_pong
    # A name that was proposed is proposed anew: the work may have been given another.
    third = ask()
    widgets.click("Warp map")
    third.name = f"{editor.session.project.name} map"
    export(third)
    editor.session.project = replace(editor.session.project, path=tmp_path / "called.fluidwarp")
    fourth = ask()
    assert (fourth.choices.kind, fourth.name) == (MAP, "called map")
    # What is chosen and then not exported is forgotten.
    fourth.choices.format[MAP] = 2
    fourth.choices.variant[PICTURE][0] = 1
    robot.key("escape")
    robot.frame(count=3)
    fifth = ask()
    assert (fifth.choices.format, fifth.choices.variant) == (third.choices.format, third.choices.variant)
    # Of another picture the size means something else.
    robot.key("escape")
    robot.frame(count=3)
    editor.exports.chosen[editor.session] = replace(third.choices, extent=(1, 1))
    assert ask().choices.size == dialog.picture.width


@pytest.mark.parametrize("ending", [".mp4", ".mkv", ".gif", ".%04d.png"])
def test_the_size_that_is_told_of_an_animation_is_the_one_that_is_written(
    device: Device, dialog: ExportDialog, tmp_path: Path, ending: str
) -> None:
    """Some kinds of file have no odd sides: their last pixels are repeated."""
    dialog.choices.kind, dialog.folder, dialog.name, dialog.choices.size, dialog.choices.fps, dialog.end = (
        ANIMATION,
        tmp_path,
        "a",
        61,
        10.0,
        0.2,
    )
    dialog.choices.format[ANIMATION] = next(
        n for n, file in enumerate(KINDS[ANIMATION][1]) if file.variants[0].ending == ending
    )
    run(device, dialog.job(), Progress())
    file = next(tmp_path.glob(f"a*{Path(ending).suffix}"))
    assert iio.imread(file, index=0).shape[1::-1] == dialog.written
    assert (dialog.written == (61, 46)) == (ending != ".mp4")


def test_of_a_preview_that_cannot_be_made_it_is_told_why(
    robot: Robot, dialog: ExportDialog, widgets: Widgets, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And it can be asked for again."""
    dialog.choices.finer = 1
    failed = type("Failed", (Still,), {"is_done": True, "error": "it cannot be made"})
    monkeypatch.setattr("app.ui.export_dialog.ExportProcess", failed)
    widgets.click("Preview")
    robot.until(lambda: not dialog.is_busy)
    widgets.look()
    assert "Preview" in widgets.at
    assert dialog.problem == "it cannot be made"


def test_where_the_person_browses_to_is_where_it_is_exported_and_under_which_name(
    robot: Robot, dialog: ExportDialog, widgets: Widgets, tmp_path: Path
) -> None:
    """With the ending of the kind or without; another one is left to the kind."""
    (tmp_path / "there").mkdir()
    for name, taken in (("a.png", "a"), ("b", "b"), ("c.d.png", "c.d"), ("e.tif", "e")):
        widgets.click("Browse")
        browser = robot.editor.dialogs.shown[-1]
        assert isinstance(browser, Browser)
        browser.go(tmp_path / "there")
        browser.name = name
        robot.frame(count=2)
        widgets.click("Export")  # of the browser, which is drawn last
        assert robot.editor.dialogs.shown[-1] is dialog
        assert (dialog.folder, dialog.name) == (tmp_path / "there", taken)
        assert dialog.output == tmp_path / "there" / f"{taken}.png"


def test_a_name_that_is_proposed_goes_with_the_kind(dialog: ExportDialog, widgets: Widgets) -> None:
    for kind in ("Warp map", "Picture", "Animation"):
        widgets.click(kind)
        assert dialog.name.endswith(" map" if kind == "Warp map" else " warped")
    dialog.name = "mine"
    widgets.click("Warp map")
    assert dialog.name == "mine"


def test_of_linear_light_a_kind_is_proposed_that_holds_it(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    """Any other says what it loses; of a picture of 8 bits, each says what it is good for."""
    editor, eight = robot.editor, robot.editor.session.project.picture

    def asked(picture: Picture, last: str) -> ExportDialog:
        monkeypatch.setattr(editor.session, "project", replace(editor.session.project, picture=picture))
        return ExportDialog(editor.session, editor.exports, editor.chooser, Preferences(export_as=last))

    light = Picture(np.ones((9, 12, 3), np.float32))
    for last, ending in (("", ".exr"), ("Picture PNG", ".exr"), ("Picture TIFF", ".tif")):
        assert asked(light, last).ending == ending
    assert asked(eight, "").ending == ".png"
    for picture, keeping in ((light, {"TIFF", "EXR"}), (eight, {file.name for file in PICTURES})):
        dialog = asked(picture, "")
        for number, file in enumerate(PICTURES):
            dialog.choices.format[PICTURE] = number
            assert (dialog.use == file.use) == (file.name in keeping)


SLIDERS = """
viscosity, Viscosity: 1e-05 to 10 by ratios, 0.03
drag, Drag: 0.00 / s to 10.00 / s, 2.00 / s
sectors, Sectors: 2 to 16, 6
opacity grid, Opacity: 0% to 100%, 70%
opacity viscosity, Opacity: 0% to 100%, 70%
opacity frozen, Opacity: 0% to 100%, 70%
opacity velocity, Opacity: 0% to 100%, 70%
opacity forces, Opacity: 0% to 100%, 70%
mask reach, By: 0.24 px to 60 px by ratios, 4.8 px
amount, Amount: 0% to 150%, 100%
radius, Size: 1 px to 240 px by ratios, 72 px
stiffness, Stiffness: 1% to 100%, 100%
local, Local: 0% to 100%, 0%
held radius, Size: 1 px to 480 px by ratios, 72 px
held stiffness, Stiffness: 1% to 100%, 100%
held local, Local: 0% to 100%, 0%
held rotate, Rotate: -180° to 180°, 0°
held scale, Scale: 25% to 400% by ratios, 100%
hardness, Hardness: 0% to 100%, 0%
strength, Strength: 5% to 100%, 100%
hold, Hold: 0% to 100%, 0%
mask amount, Fill with: 0.001 x to 1e+05 x by ratios, 100 x
brightness, By brightness: 1 x to 1e+05 x by ratios, 1 x
tolerance, Tolerance: 1% to 100%, 20%
size, Size: 16 pixels to 480 pixels, 240 pixels
quality, Quality: 1 to 100, 90
fps, Frames a second: 1 to 60, 30
"""


def test_every_slider_goes_as_far_as_it_did_and_back_to_its_default(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    found, slider, told = list[str](), Ui.slider, signature(Ui.slider)

    def noting(*given: Any, **named: Any) -> Any:
        bound = told.bind(*given, **named)
        bound.apply_defaults()
        _, name, label, _, low, high, unit, default, _, logarithmic, *_ = bound.arguments.values()
        ends = f"{unit.text(low)} to {unit.text(high)}{' by ratios' if logarithmic else ''}"
        line = f"{name}, {label}: {ends}{'' if default is None else f', {unit.text(default)}'}"
        if line not in found and name not in ("from", "to", "dissolve"):  # they go as far as the recording
            found.append(line)
        return slider(*given, **named)

    monkeypatch.setattr(Ui, "slider", noting)
    state = robot.editor.state
    state.sections = dict.fromkeys(("handles", "selection", "fluid", "symmetry", "view", "masks"), True)
    state.symmetry = "radial"
    for overlay in state.overlays.values():
        overlay.shown = True
    robot.key("g")
    robot.drag((0.4, 0.5), (0.45, 0.5), steps=2)
    robot.rest()
    for key in ("p", "v", "m"):
        robot.key(key)
        robot.frame(count=2)
    state.select_by = "colour"
    robot.frame(count=2)
    robot.key("ctrl+e")
    robot.frame(count=3)
    dialog = robot.editor.dialogs.shown[-1]
    assert isinstance(dialog, ExportDialog)
    for preset in PRESETS:
        dialog.take(preset)
        robot.frame(count=2)
    assert found == SLIDERS.strip().splitlines()


@pytest.mark.parametrize("at", [0, 12])
def test_a_double_click_on_a_slider_leaves_the_playhead_where_it_is(robot: Robot, widgets: Widgets, at: int) -> None:
    """And the history as it was: what its first click had done is taken back, which Undo would do at the end."""
    session = robot.editor.session
    stroke = Stroke(tool="push", samples=((0, 0.3, 0.5, 1.0), (20, 0.4, 0.4, 1.0)))
    session.edit("Push", stroke=(stroke,), duration=1.0)
    session.edit("Longer", duration=2.0)
    session.undo()
    session.seek(at)
    session.settle()
    history = session.document.history
    before = history.entries, history.index
    widgets.look()
    for _ in range(2):
        robot.click(*widgets.at["Amount"].middle)
    robot.frame(count=2)
    session.settle()
    assert (session.target, session.recipe.amount) == (at, 1.0)
    assert (history.entries, history.index) == before, "what could be redone can be, and no more"


def test_a_double_click_on_amount_lets_the_recording_play_on(robot: Robot, widgets: Widgets) -> None:
    """As one click does: how much of the warp is seen has nothing to do with time."""
    session = robot.editor.session
    stroke = Stroke(tool="push", samples=((0, 0.3, 0.5, 1.0), (20, 0.4, 0.4, 1.0)))
    session.edit("Push", stroke=(stroke,), duration=10.0)
    session.seek(0)
    session.settle()
    session.play()
    widgets.look()
    assert session.playing
    for _ in range(2):
        robot.click(*widgets.at["Amount"].middle)
    robot.frame(count=2)
    then = session.tick
    robot.frame(count=10)
    assert session.recipe.amount == 1.0
    assert session.playing
    assert session.tick > then


@pytest.mark.parametrize("at", [0, 12])
def test_a_double_click_on_a_setting_changes_it_where_the_playhead_was(robot: Robot, widgets: Widgets, at: int) -> None:
    """Its first click has sent the playhead on, to behind what is recorded with the change."""
    session = robot.editor.session
    session.begin_with(drag=0.5)
    stroke = Stroke(tool="push", samples=((0, 0.3, 0.5, 1.0), (20, 0.4, 0.4, 1.0)))
    session.edit("Push", stroke=(stroke,), duration=1.0)
    before, found = len(session.document.history.entries), list[Recipe]()
    for clicks in (1, 2):
        session.seek(at)
        session.settle()
        widgets.look()
        robot.frame(dt=1.0)  # or it would be a click more of those before
        for _ in range(clicks):
            robot.click(*widgets.at["Drag"].middle)
        robot.frame(count=2)
        session.settle()
        found.append(session.recipe)
        assert len(session.document.history.entries) == before + 1
        session.undo()
        session.settle()
    once, twice = found
    assert [change.tick for change in twice.change] == [change.tick for change in once.change] == [at]
    assert (twice.stroke, twice.duration) == (once.stroke, once.duration)
    assert twice.change[0].drag == DEFAULT.drag != once.change[0].drag


@pytest.mark.parametrize("at", [6, 12, 30])
@pytest.mark.parametrize("label", ["Viscosity", "Drag"])
def test_a_double_click_on_a_setting_that_has_its_default_is_no_edit(
    robot: Robot, widgets: Widgets, label: str, at: int
) -> None:
    """It was one wherever the recipe's last change is at an earlier tick.

    Nor does it stay told that what came after the playhead was left to Undo, as the first click had it.
    """
    session = robot.editor.session
    session.begin_with(viscosity=0.1, drag=0.5)
    stroke = Stroke(tool="push", samples=((0, 0.3, 0.5, 1.0), (20, 0.4, 0.4, 1.0)))
    change = Change(tick=6, viscosity=DEFAULT.viscosity, drag=DEFAULT.drag)
    session.edit("Push", stroke=(stroke,), change=(change,), duration=1.0)
    session.seek(at)
    session.settle()
    before = session.recipe, session.document.history.entries
    only(robot, "fluid")
    widgets.look()
    for _ in range(2):
        robot.click(*widgets.at[label].middle)
    robot.frame(count=2)
    session.settle()
    assert (session.recipe, session.document.history.entries) == before
    assert session.target == at
    assert robot.editor.messages.shown == []


@pytest.mark.parametrize("key", ["home", "end", "space", "tab", "escape", "delete", "backspace", "t", "[", "4"])
def test_keys_of_an_open_list_are_its_own(robot: Robot, widgets: Widgets, key: str) -> None:
    only(robot)
    robot.drag((0.3, 0.3), (0.5, 0.5), steps=4)
    robot.rest()
    state, session = robot.editor.state, robot.editor.session
    state.sections["symmetry"] = True
    session.seek(3)
    session.settle()
    state.selected = "push"
    widgets.look()
    robot.click(*widgets.at["##symmetry"].middle)
    robot.frame(count=2)

    def now() -> tuple[Any, ...]:
        brush, shown = asdict(state.brush), [overlay.shown for overlay in state.overlays.values()]
        where = session.target, session.playing, state.selected, state.inspector, state.tool_name
        return session.recipe, where, brush, shown

    before = now()
    robot.key(key)
    robot.frame(count=3)
    assert now() == before


def test_a_key_that_chooses_in_an_open_list_does_nothing_else(robot: Robot, widgets: Widgets) -> None:
    """Enter fills the selection, but not where it takes a row."""
    state = robot.editor.state
    only(robot)
    state.sections["symmetry"] = True
    state.choose_tool("select", False)
    robot.drag((0.3, 0.3), (0.6, 0.6))
    assert state.selection
    widgets.choose("##symmetry", "Radial")
    assert (state.symmetry, robot.editor.session.recipe.mask) == ("radial", ())

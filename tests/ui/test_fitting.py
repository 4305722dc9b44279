"""Fit in the window: what it makes of handles, that it can be stopped and undone, and that it is the command line's."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.errors import UserError
from app.media import project as projects
from app.media.landmarks import Pairs, write_pairs
from app.media.pictures import write_picture
from app.media.recipes import read_recipe
from app.model.handles import ARRIVED
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.ui.chooser import Chosen
from app.ui.events import Drop
from app.ui.fitting import Fits
from app.ui.widgets import Ui
from app.work.export_process import FitProcess
from app.work.fit_job import pairs_in
from app.work.fitting import Fit
from app.work.worker import Outcome
from solver.gl.device import Device
from support.commands import Run
from support.editing import Robot, Still, small_project
from support.widgets import Widgets

PATIENCE = 300.0  # seconds, of a machine that does much else
MOVES = ((0.4, 0.5), (0.45, 0.47)), ((0.7, 0.4), (0.7, 0.45))


@pytest.fixture(scope="module")
def dragged(shared_device: Device, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Robot]:
    """With two handles that have been dragged one after the other, for all of these tests."""
    with Robot(shared_device, small_project(tmp_path_factory.mktemp("fitting"), grid=32)) as robot:
        robot.key("g")
        for start, end in MOVES:
            robot.drag(start, end, steps=6)
            robot.rest()
        yield robot


@pytest.fixture
def robot(dragged: Robot, device: Device) -> Iterator[Robot]:
    """It once more, as it was then."""
    dragged.editor.session.go_to(len(MOVES))
    dragged.rest()
    dragged.editor.fits.evaluations = 2
    yield dragged
    dragged.editor.fits.give_up()
    dragged.editor.messages.shown.clear()


@pytest.fixture
def asked(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> list[Chosen]:
    """Who is told the files that are asked for."""
    told = list[Chosen]()
    monkeypatch.setattr(robot.editor.chooser, "ask_which", lambda *given: told.append(given[-1]))
    return told


def names(robot: Robot) -> list[str]:
    return [entry.name for entry in robot.editor.session.document.history.entries]


def wait(robot: Robot) -> None:
    robot.until(lambda: not robot.editor.fits.is_running, PATIENCE)
    robot.rest()


def test_a_fit_is_one_edit_that_is_played_and_the_command_line_s(robot: Robot, fluidwarp: Run, tmp_path: Path) -> None:
    """From the handles, and from a file of the same pairs; and it leads all at once."""
    session, led = robot.editor.session, robot.warp()
    before, project = session.recipe, session.project
    robot.key("shift+g")
    assert robot.editor.fits.is_running
    wait(robot)
    made = session.recipe
    assert names(robot) == ["Open", "Handle", "Handle", "Fit"]
    assert [handle.start for handle in session.recipe.handle] == [0, 0]
    assert [handle.name for handle in session.recipe.handle] == ["", ""]  # their bars are called as before
    assert [handle.at for handle in session.recipe.handle] == [handle.at for handle in before.handle]
    assert [handle.to for handle in session.recipe.handle] == [handle.goal for handle in before.handle]
    assert session.tick == session.end
    assert not any(held.is_away for held in session.held)
    assert robot.editor.messages.shown[-1].text.startswith("Fitted: 2 handles, mean error 0.")
    robot.key("ctrl+z")
    robot.rest()
    assert session.recipe == before
    assert np.array_equal(robot.warp(), led)

    projects.save(replace(project, recipe=before), tmp_path / "w.fluidwarp")
    size = project.picture.width, project.picture.height
    pairs = Pairs.points(np.array([[handle.at, handle.goal] for handle in before.handle]))
    write_pairs(tmp_path / "p.csv", pairs, size)
    bare = replace(project, recipe=before.edited(handle=(), duration=made.duration))
    projects.save(bare, tmp_path / "bare.fluidwarp")
    for words in (["w.fluidwarp"], ["bare.fluidwarp", "--pairs", str(tmp_path / "p.csv")]):
        target = tmp_path / "f.toml"
        assert fluidwarp(tmp_path, "fit", *words, "-o", target.name, "--evaluations", "2").returncode == 0
        fitted, of_pairs = read_recipe(target), "--pairs" in words
        assert [handle.name for handle in fitted.handle] == (["pair 1", "pair 2"] if of_pairs else ["", ""])
        assert [(handle.at, handle.to) for handle in fitted.handle] == [(one.at, one.to) for one in made.handle]
        if not of_pairs:  # where a search begins at the handles' own sizes, too
            assert fitted.text() == made.edited(picture=None).text()


def test_a_fit_that_is_stopped_before_it_has_found_anything_leaves_all_as_it_was(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = names(robot), robot.editor.session.recipe
    stopped = type("Stopped", (Still,), {"is_done": True, "error": "", "outcome": Outcome("pattern")})
    monkeypatch.setattr("app.ui.fitting.FitProcess", stopped)
    robot.editor.fits.start()
    robot.until(lambda: not robot.editor.fits.is_running)
    said = "The fit was stopped before it had found anything. Nothing has changed."
    assert [message.text for message in robot.editor.messages.shown] == [said]
    assert (names(robot), robot.editor.session.recipe) == before


def test_what_is_fitted_is_the_work_that_is_open_as_the_command_line_would(robot: Robot) -> None:
    """With as many trial runs, and by the name that the person knows."""
    editor, session = robot.editor, robot.editor.session
    session.project = project = replace(session.project, label="the work that is open")
    fits = Fits(editor.workspace, editor.messages)
    fits.start()
    assert fits.process is not None
    assert fits.process.fit == Fit(session.recipe, project.picture, project.folder, source=project.label)
    fits.give_up()


def test_stopped_it_keeps_the_best_so_far(robot: Robot, widgets: Widgets) -> None:
    robot.editor.fits.evaluations = 100_000
    widgets.click("Fit")
    process = robot.editor.fits.process
    assert process is not None
    robot.until(lambda: process.state.startswith("best so far"), PATIENCE)
    widgets.click("Stop")
    wait(robot)
    assert names(robot)[-1] == "Fit"
    assert 0 < process.part < 1
    assert robot.editor.messages.shown[-1].text.startswith("Stopped; the best so far is kept: 2 handles, mean")
    assert all(np.hypot(*np.subtract(held.now, held.target)) < 4 * ARRIVED for held in robot.editor.session.held)


def test_escape_stops_it_once_there_is_nothing_else_to_give_up(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    state, told = robot.editor.state, list[FitProcess]()
    monkeypatch.setattr(FitProcess, "finish", lambda process: told.append(process))
    robot.key("shift+g")
    robot.key("m")
    robot.drag((0.2, 0.2), (0.4, 0.4), steps=2)
    assert state.selection
    robot.key("escape")
    assert (state.selection, told) == ((), [])
    for _ in range(2):
        robot.key("escape")
    assert told == [robot.editor.fits.process]
    robot.key("g")


def test_what_has_been_changed_meanwhile_is_kept_and_the_fit_given_up(robot: Robot) -> None:
    robot.editor.fits.evaluations = 100_000
    robot.key("shift+g")
    robot.editor.session.edit("Half", amount=0.5)
    robot.frame(count=2)
    assert robot.editor.fits.is_running  # it is the same simulation
    robot.key("ctrl+z")
    robot.key("ctrl+z")
    robot.frame(count=2)
    assert not robot.editor.fits.is_running
    assert "work was changed meanwhile" in robot.editor.messages.shown[-1].text
    assert names(robot) == ["Open", "Handle", "Handle", "Half"]


def test_of_another_work_nothing_is_fitted_however_alike(robot: Robot) -> None:
    editor = robot.editor
    editor.fits.evaluations = 100_000
    robot.key("shift+g")
    editor.open(replace(editor.session.project, recipe=editor.session.recipe))
    robot.frame(count=2)
    assert not editor.fits.is_running
    assert "work was changed meanwhile" in editor.messages.shown[-1].text
    editor.do("undo")  # the work before it


def test_without_a_handle_that_leads_anywhere_there_is_nothing_to_fit(robot: Robot) -> None:
    turned = [{"at": (0.5, 0.5), "keys": (), "rotate": 20.0}, {"at": (0.5, 0.5), "to": (0.6, 0.5), "muted": True}]
    turned, muted = Recipe.model_validate({"handle": tuple(turned)}).handle
    robot.editor.session.edit("Turned", handle=(turned,))
    robot.key("shift+g")
    assert robot.editor.fits.is_running
    robot.editor.fits.give_up()
    robot.editor.session.edit("None", handle=(muted,))
    robot.key("shift+g")
    assert not robot.editor.fits.is_running
    assert "nothing to fit" in robot.editor.messages.shown[-1].text


def test_pairs_that_fall_on_the_window_are_fitted_as_by_the_command_line(robot: Robot, tmp_path: Path) -> None:
    session, messages = robot.editor.session, robot.editor.messages
    size = session.project.picture.width, session.project.picture.height
    pairs = Pairs.points(np.array([((0.2, 0.3), (0.25, 0.3)), ((0.6, 0.6), (0.6, 0.55))]))
    for name in ("p.csv", "p.pts", "q.pts"):
        write_pairs(tmp_path / name, pairs, size)
    robot.frame(Drop((str(tmp_path / "p.pts"),)))
    assert "drop two files at once" in messages.shown[-1].text
    robot.editor.do("undo")
    robot.editor.do("undo")
    robot.rest()
    robot.editor.workspace.placeholder = session
    robot.frame(Drop((str(tmp_path / "p.csv"),)))
    assert "first open the picture" in messages.shown[-1].text
    robot.editor.workspace.placeholder = None
    robot.frame(Drop((str(tmp_path / "p.csv"),)))
    process = robot.editor.fits.process
    assert process is not None
    assert process.fit.pairs is not None
    assert not robot.editor.files.is_loading
    assert [
        message.text for message in messages.shown if "Cannot" in message.text
    ] == []  # it is opened as nothing else
    np.testing.assert_allclose(process.fit.pairs.places, pairs.places, atol=1e-9)
    assert process.fit.recipe.duration == 1.0  # nothing has been done yet that has a time
    robot.frame(Drop((str(tmp_path / "p.pts"), str(tmp_path / "q.pts"))))
    assert "A fit is under way" in messages.shown[-1].text
    assert robot.editor.fits.process is process
    robot.editor.do("redo")
    robot.frame()
    assert "Give the pairs or masks again" in messages.shown[-1].text
    assert robot.editor.fits not in gc.get_referrers(session), "what was fitted is not kept for ever"


def test_a_mask_is_fitted_to_another_as_by_the_command_line(robot: Robot, tmp_path: Path, asked: list[Chosen]) -> None:
    session, messages = robot.editor.session, robot.editor.messages
    picture, black = session.project.picture, np.zeros((48, 64, 1), np.float32)
    for name, columns in (("from.png", (10, 30)), ("to.png", (14, 38))):
        mask = black.copy()
        mask[10:30, slice(*columns)] = 1
        mask[40:45, 5:8] = 1  # a second part
        write_picture(tmp_path / name, Picture(mask))
    write_picture(tmp_path / "black.png", Picture(black))
    robot.editor.do("fit_masks")
    with pytest.raises(UserError, match=r"black\.png has no outline"):
        asked[-1](tmp_path / "black.png")
    assert len(asked) == 1, "the other is asked for once this one will do"
    asked.pop()(tmp_path / "from.png")
    with pytest.raises(UserError, match=r"black\.png has no outline"):
        asked[-1](tmp_path / "black.png")
    assert not robot.editor.fits.is_running
    asked.pop()(tmp_path / "to.png")
    process = robot.editor.fits.process
    assert process is not None
    pairs, notices = pairs_in((), (tmp_path / "from.png", tmp_path / "to.png"), (picture.width, picture.height))
    assert pairs is not None
    assert len(notices) == 2
    assert [message.text for message in messages.shown[-2:]] == [f"{notice}." for notice in notices]
    assert process.fit.pairs is not None
    np.testing.assert_array_equal(process.fit.pairs.places, pairs.places)
    assert process.fit.pairs.curves == pairs.curves


def test_what_to_do_is_not_told_where_a_fit_is(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    floating, drawn = Ui.floating, list[str]()

    def noting(ui: Ui, name: str, *given: Any, **named: Any) -> Any:
        drawn.append(name)
        return floating(ui, name, *given, **named)

    monkeypatch.setattr(Ui, "floating", noting)
    robot.key("g")
    robot.editor.session.edit("None", handle=())
    robot.frame()
    assert "how" in drawn
    drawn.clear()
    monkeypatch.setattr(type(robot.editor.fits), "is_running", True)
    robot.frame()
    assert "how" not in drawn


def test_a_fit_that_falls_short_is_no_success_and_told_of_until_it_is_undone(robot: Robot) -> None:
    robot.key("shift+g")
    process, session = robot.editor.fits.process, robot.editor.session
    assert process is not None
    made = session.recipe.edited(handle=tuple(each.model_copy(update={"end": 9.0}) for each in session.recipe.handle))
    notices = ("handle[1] ends 12 pixels from where it should be", "handle[1] and handle[2] cross each other's way")
    process.stop()
    process.is_done, process.outcome = True, Outcome("", notices=notices, verdict="2 pairs", recipe=made, is_met=False)
    robot.rest()
    (message,) = robot.editor.messages.shown
    assert message.icon == "warn"
    assert message.text.startswith("Fitted as well as it could be: 2 pairs. ")
    assert "Handle 1 ends 12 pixels from where it should be. Handle 1 and handle 2 cross" in message.text
    robot.key("ctrl+z")
    robot.frame(count=2)
    assert not robot.editor.messages.shown


def test_what_cannot_be_fitted_is_told(robot: Robot) -> None:
    far = Recipe.model_validate({"handle": ({"at": (1.5, 0.5), "to": (0.5, 0.5)},)}).handle
    robot.editor.session.edit("Outside", handle=far)
    robot.key("shift+g")
    wait(robot)
    assert "all handles with a goal lie outside the picture" in robot.editor.messages.shown[-1].text
    assert names(robot)[-1] == "Outside"

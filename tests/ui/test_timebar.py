"""The timeline's buttons, Undo and Redo: what each is called and shows, by what is going on."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from app.media.animation import animation_writer
from app.media.pictures import write_picture
from app.media.project import from_picture
from app.ui.widgets import Ui
from support.editing import Robot, pattern

Shown = tuple[str, str, bool]  # icon, title, enabled
COMING = {"Click to play it once.": "once", "Click to play it in a loop.": "loop", "Click for ping-pong": "returns"}


class Buttons:
    """The buttons of the frame that was drawn last."""

    def __init__(self, robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
        self._robot, self._shown = robot, dict[str, Shown]()
        drawn = Ui.icon_button

        def noting(ui: Ui, name: str, icon: str, title: str = "", *given: Any, **named: Any) -> bool:
            self._shown[name] = icon, title, named.get("enabled", True)
            return drawn(ui, name, icon, title, *given, **named)

        monkeypatch.setattr(Ui, "icon_button", noting)

    def __getitem__(self, name: str) -> Shown:
        self._robot.frame(dt=0.0)
        return self._shown[name]


@pytest.fixture
def buttons(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> Buttons:
    return Buttons(robot, monkeypatch)


def test_what_moves_can_be_stopped_and_what_rests_can_be_played(robot: Robot, buttons: Buttons) -> None:
    """Also a fluid that nobody pushes any more: it moves until it comes to rest, or is told to stop."""
    session, playing, resting = robot.editor.session, ("pause", "Pause", True), ("play", "Play", True)
    assert buttons["play"] == ("play", "Play", False)
    robot.editor.workspace.change("Honey", viscosity=0.03, drag=2.0)
    for way in ("by itself", "by hand"):
        robot.drag((0.4, 0.4), (0.5, 0.4), steps=4)
        assert session.coasting
        assert not session.playing
        assert buttons["play"] == playing
        robot.rest() if way == "by itself" else robot.key("space")
        assert not session.coasting
        assert buttons["play"] == resting
    robot.key("home")
    robot.key("space")
    assert session.playing
    assert buttons["play"] == playing
    robot.key("space")
    assert buttons["play"] == resting


@pytest.mark.parametrize(("is_clip", "modes"), [(False, ["once", "loop", "returns"]), (True, ["once", "loop"])])
def test_what_a_click_makes_of_how_it_is_played_is_what_is_told(
    robot: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_clip: bool, modes: list[str]
) -> None:
    told, drawn, now = list[str](), Ui.icon_button, list[str]()

    def noting(
        ui: Ui, name: str, icon: str, title: str = "", key: str = "", more: str = "", *given: Any, **named: Any
    ) -> bool:
        if name == "repeat":
            now[:], told[:] = [icon], [more]
        return drawn(ui, name, icon, title, key, more, *given, **named)

    if is_clip:
        with animation_writer(tmp_path / "clip.apng", Fraction(5)) as write:
            for _ in range(3):
                write(pattern(96, 64).pixels)
        robot.drop(tmp_path / "clip.apng")
    monkeypatch.setattr(Ui, "icon_button", noting)
    robot.frame()
    seen = list[str]()
    for _ in range(6):
        seen += now
        coming = next(mode for words, mode in COMING.items() if words in told[0])
        robot.editor.do("repeat")
        robot.frame()
        assert now == [coming]
    begun = modes.index(seen[0])
    assert seen == [*modes, *modes, *modes, *modes][begun : begun + 6]


def test_undo_and_redo_can_be_pressed_wherever_there_is_something_to_undo_or_redo(
    robot: Robot, buttons: Buttons, tmp_path: Path
) -> None:
    """Also a stroke that is being painted, and that another picture was opened."""

    def can() -> tuple[bool, bool]:
        return buttons["undo"][2], buttons["redo"][2]

    write_picture(tmp_path / "other.png", pattern(60, 40))
    assert can() == (False, False)
    robot.move(*robot.at(0.4, 0.4))
    robot.press()
    robot.move(*robot.at(0.5, 0.4))
    assert can() == (True, False)
    robot.release()
    robot.rest()
    assert can() == (True, False)
    robot.editor.open(from_picture(tmp_path / "other.png", robot.editor.session.recipe.edited(stroke=())))
    assert can() == (True, False)
    for chord, wanted in (
        ("ctrl+z", (True, True)), ("ctrl+z", (False, True)), ("ctrl+shift+z", (True, True)),
        ("ctrl+shift+z", (True, False)),
    ):  # fmt: skip
        robot.key(chord)
        robot.rest()
        assert can() == wanted
    assert robot.editor.canvas.size == (60, 40)

"""The timeline's buttons: what each is called and shows, by what is going on."""

from __future__ import annotations

from typing import Any

import pytest

from app.ui.widgets import Ui
from support.editing import Robot

Shown = tuple[str, str, bool]  # icon, title, enabled


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

"""An editor without a window, as most tests of the window want it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from solver.gl.device import Device
from support.editing import Robot, small_project
from support.widgets import Widgets


@pytest.fixture
def robot(device: Device, tmp_path: Path) -> Iterator[Robot]:
    """With the pattern on a coarse grid."""
    with Robot(device, small_project(tmp_path)) as robot:
        yield robot


@pytest.fixture
def widgets(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> Widgets:
    """Of the test's `robot`, whichever that is."""
    return Widgets(robot, monkeypatch)

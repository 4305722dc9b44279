"""What comes of keys and of a pointer that go anywhere, as `golden/walks.txt` has it in sums, step by step.

That of which nobody has thought is done here too. After a change that is meant: `FLUIDWARP_GOLDEN=write pytest` of this
file.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from random import Random

import pytest
from imgui_bundle import imgui

from app.model.handles import RecipeHandle, RecipePin
from app.ui.actions import ACTIONS
from app.ui.events import LEFT, MIDDLE, RIGHT, Mods
from app.work import playing, recording
from solver.gl.device import Device
from support.drawn import Drawn
from support.editing import Robot, add_bars, small_project, summary
from support.golden import WRITES, Golden, Sum

SIZE = (1100, 720)
STEPS = 11
CLOSE = 2e-3
ELSEWHERE = ("open", "apply_to", "import_map", "paste", "copy_picture", "copy_recipe", "quit", "fit_handles",
             "fit_masks", "mask_load", "mask_save", "save", "save_as", "export", "statistics")  # fmt: skip
"""Actions that ask for files, for other processes or for the clipboard; times are told by the last."""
KEYS = sorted(key for name, action in ACTIONS.items() if name not in ELSEWHERE for key in action.keys)
NUMBER = re.compile(r"(?<![#\w])-?\d+\.?\d*(?:e-?\d+)?(?!\w)")


def areas(robot: Robot) -> dict[str, tuple[float, float, float, float]]:
    """(left, top, right, bottom) of the parts of the window, without the menu and what opens files."""
    layout = robot.editor.layout
    found = {"canvas": layout.canvas, "timebar": layout.timebar, "strip": layout.strip or layout.canvas}
    found |= {"inspector": layout.inspector or layout.canvas, "lanes": layout.lanes or layout.timebar}
    rects = {name: (rect.x, rect.y, rect.x + rect.width, rect.y + rect.height) for name, rect in found.items()}
    return rects | {"bar": (140.0, 4.0, 700.0, 44.0)}


def walk(robot: Robot, area: str, dice: Random) -> None:
    """One step: a key, a click, a drag, the wheel or text, most of them in an area."""
    robot.mods = Mods(*(dice.random() < 0.15 for _ in range(3)))
    left, top, right, bottom = areas(robot)[area if dice.random() < 0.8 else "canvas"]

    def anywhere() -> tuple[float, float]:
        return round(dice.uniform(left, right)), round(dice.uniform(top, bottom))

    button = dice.choice((LEFT, LEFT, LEFT, LEFT, RIGHT, MIDDLE))
    match dice.choice(("key", "key", "click", "click", "drag", "drag", "wheel", "text")):
        case "key":
            robot.key(dice.choice(KEYS))
        case "click":
            robot.click(*anywhere(), button)
        case "drag":
            robot.move(*anywhere())
            robot.press(button)
            for _ in range(dice.randint(1, 3)):
                robot.move(*anywhere(), dice.random())
            if dice.random() < 0.2:
                robot.key("escape")
            robot.release(button)
        case "wheel":
            robot.move(*anywhere())
            robot.wheel(dice.choice((-2, -1, 1, 3)))
        case "text":
            robot.type(dice.choice(("12", "0.3", "5 %", "a")))
            robot.key(dice.choice(("enter", "escape", "tab")))


@pytest.fixture(scope="module")
def golden(shared_device: Device) -> Iterator[Golden]:
    with Golden.of_software(shared_device, "walks.txt") as golden:
        yield golden


@pytest.mark.parametrize("area", ["canvas", "timebar", "strip", "inspector", "lanes", "bar"])
@pytest.mark.parametrize("number", range(2))
def test_a_walk_leads_where_it_did(
    device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, area: str, number: int, golden: Golden
) -> None:
    monkeypatch.setattr(playing, "QUICK", 0.0)
    monkeypatch.setattr(playing, "PATIENCE", 0.0)
    monkeypatch.setattr(recording, "RETURN", 600.0)
    name, dice = f"{imgui.get_version()} {area} {number}", Random(f"{area} {number}")
    if not WRITES and not golden.has(name):
        pytest.skip("letters lie elsewhere in other versions of imgui")
    found: dict[str, list[float]] = {}
    with Robot(device, small_project(tmp_path, 32), SIZE, sees=True) as robot:
        state = robot.editor.state
        if number:
            robot.drag((0.3, 0.4), (0.5, 0.5), steps=4)
            robot.drag((0.6, 0.4), (0.6, 0.7), steps=4)
            robot.drag((0.2, 0.7), (0.4, 0.7), steps=4)
            robot.rest()
            add_bars(robot.editor.session)
        if number and area == "lanes":  # they are led at each tick, which takes its time
            handle, pin = (
                RecipeHandle(at=(0.4, 0.6), to=(0.5, 0.7), duration=0.3),
                RecipePin(at=(0.8, 0.2), name="Nail"),
            )
            robot.editor.session.edit("Handles", handle=(handle,), pin=(pin,))
        if area == "lanes":
            robot.key("l")
        state.sections = dict.fromkeys(("fluid", "symmetry", "view", "quality", "masks", "history"), True)
        for step in range(STEPS):
            state.select_by = "colour" if state.select_by == "subject" else state.select_by
            walk(robot, area, dice)
            robot.editor.session.settle()  # or it would be as far as there was time for
            with pytest.MonkeyPatch.context() as noting:
                drawn = Drawn(noting)
                robot.frame()
            what, seen = Sum(), Sum(1.0)
            what.add(summary(robot) | {"brush": asdict(state.brush), "recipe": robot.editor.session.recipe})
            for line in drawn.take():
                if "Simulating" not in line and "ago" not in line:
                    seen.add([float(number) for number in NUMBER.findall(line)])
                    seen.add(NUMBER.sub("", line))
            found[f"{name} {step} is"], found[f"{name} {step} is drawn"] = what.row, seen.row
    golden.compare_all(found, f"{name} ", CLOSE)

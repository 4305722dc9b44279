"""What is compiled before the hand needs it: a press interrupts it, strokes wait for it, and nothing else changes."""

from __future__ import annotations

from dataclasses import replace
from math import cos, sin
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import moderngl
import pytest

from app.errors import UserError
from app.model.recipe import Recipe
from app.ui.rehearsal import PARTS, TICKS
from app.work.replay import Replay
from solver.gl import passes
from solver.gl.device import Device
from solver.gl.field import GraphicsMemoryError
from solver.gl.program import compile_program
from solver.warp.state import closed_in
from support.editing import Robot, small_project


def nothing() -> bool:
    return False


def test_presses_interrupt_it_and_then_each_part_does_what_it_is_for_and_leaves_the_work_as_it_is(robot: Robot) -> None:
    rehearsal, session, asked, moved = robot.editor.rehearsal, robot.editor.session, list[int](), list[float]()
    assert not rehearsal.is_wanted  # without a window nobody presses anything
    steps, recipe = session.replay.steps, session.recipe

    def pressed() -> bool:
        asked.append(robot.device.timings.passes["other"])
        return len(asked) % 7 == 0  # seven passes of one tick at most

    rehearsal.has_news = pressed
    robot.frame(count=3)
    assert len(asked) == 21
    assert rehearsal.is_wanted
    assert robot.device.watch is None

    rehearsal.has_news = nothing
    assert robot.editor.wants_frame()
    while rehearsal.is_wanted:
        robot.frame()
        if rehearsal.trial is not None:
            moved.append(float(abs(rehearsal.trial.warp.read()).max()))
    # A part whose recipe is refused, or moves nothing, would be silent, and compile nothing.
    seen = TICKS - 1  # of the last tick nothing is left to see
    assert len(moved) == seen * len(PARTS)
    assert min(moved[seen - 1 :: seen]) > 0.01

    robot.frame(count=10)
    assert not robot.editor.wants_frame()
    assert (session.replay.steps, session.recipe, session.is_moving) == (steps, recipe, False)
    assert robot.device.watch is None


PARTS_OF: dict[str, dict[str, Any]] = {
    "handle": {"at": (0.4, 0.5), "to": (0.5, 0.5)},
    "pin": {"at": (0.4, 0.5)},
    "mask": {"kind": "fill", "tick": 0, "of": "frozen", "amount": 1.0},
    "viscosity": {"kind": "constant", "scale": 0.05},
    "freeze": {"kind": "constant", "window": {"box": (0.1, 0.1, 0.5, 0.5)}},
    "force": {"kind": "vortex", "point": (0.5, 0.5), "strength": 0.1},
}


@pytest.mark.parametrize(
    ("part", "wanted"),
    [("", [0]), ("force", [0]), ("handle", [0, 1]), ("pin", [0, 1]), ("mask", [0, 2]), ("viscosity", [0, 2]),
     ("freeze", [0, 2])],
)  # fmt: skip
def test_strokes_wait_for_what_their_recipe_needs_and_for_nothing_else(part: str, wanted: list[int]) -> None:
    recipe = Recipe.model_validate({part: (PARTS_OF[part],)} if part else {})
    assert [number for number, one in enumerate(PARTS) if one.is_for(recipe)] == wanted


@pytest.mark.parametrize("error", [GraphicsMemoryError("no memory"), UserError("no memory")])
def test_where_there_is_no_room_for_it_it_is_given_up_and_nobody_is_told(
    robot: Robot, monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    rehearsal, session = robot.editor.rehearsal, robot.editor.session
    rehearsal.has_news = nothing
    with monkeypatch.context() as small:
        small.setattr(Replay, "advance", Mock(side_effect=error))
        robot.frame()
    assert not rehearsal.is_wanted
    assert rehearsal.trial is None
    robot.drag((0.3, 0.5), (0.5, 0.5))
    robot.rest()
    assert session.replay.steps > 0
    assert not robot.editor.messages.shown


def test_a_stroke_that_is_drawn_before_it_waits_and_is_in_the_history_at_once(robot: Robot) -> None:
    rehearsal, session = robot.editor.rehearsal, robot.editor.session
    rehearsal.has_news = lambda: True
    robot.drag((0.3, 0.5), (0.5, 0.5))
    assert session.document.recipe.stroke
    assert rehearsal.is_needed
    assert session.replay.steps == 0
    rehearsal.has_news = nothing
    robot.until(lambda: not session.is_moving)
    assert session.replay.steps > 0
    assert not rehearsal.is_needed
    assert rehearsal.is_wanted  # the rest of it, of which the stroke needs nothing


def test_a_long_stir_compiles_nothing_that_is_felt(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each program is a frame of a tenth of a second on a machine that has none yet: also those of closed maps."""
    compiled = list[str]()

    def compiling(ctx: moderngl.Context, shader: str, defines: dict[str, object]) -> moderngl.Program:
        compiled.append(f"{shader} {defines}")
        return compile_program(ctx, shader, defines)

    with Device.headless() as device, Robot(device, small_project(tmp_path)) as robot:
        rehearsal, session = robot.editor.rehearsal, robot.editor.session
        rehearsal.has_news = nothing
        session.change("Water", viscosity=0.0065, drag=0.0)
        robot.editor.state.brush = replace(robot.editor.state.brush, hold=1.0)  # so that maps are closed soon
        robot.until(lambda: not rehearsal.is_wanted)
        monkeypatch.setattr(passes, "compile_program", compiling)
        robot.move(*robot.at(0.7, 0.5))
        robot.press()
        for frame in range(60):
            robot.move(*robot.at(0.5 + 0.2 * cos(0.4 * frame), 0.5 + 0.2 * sin(0.4 * frame)))
            if len(closed_in(session.replay.warp.save().tiles)) == 2:
                break
        else:
            pytest.fail("no map was closed")
        assert set(compiled) <= {"gl/copy.frag {}"}  # which takes no time worth it

"""The editor without a window: every tool, key, panel and dialog, by the pixels and by what is recorded."""

from __future__ import annotations

import os
import random
import re
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from threading import Event
from typing import Any
from weakref import WeakSet

import moderngl
import numpy as np
import pytest

from app.errors import UserError
from app.media import project as projects
from app.media.codecs.cmyk import INK
from app.media.displacement import Displacement
from app.media.maps import read_map, write_map
from app.media.pictures import read_picture, write_picture
from app.media.project import Project
from app.model.forces import VortexForce
from app.model.handles import RecipeHandle, RecipePin
from app.model.mask_edits import MaskStroke, mask_edit
from app.model.picture import Picture
from app.model.recipe import FluidSettings, Recipe, Stop
from app.model.strokes import Change, Stroke
from app.model.tools import TOOLS
from app.progress import Progress
from app.ui import workspace
from app.ui.actions import ACTIONS
from app.ui.browser import Browser
from app.ui.canvas import MOVING, shown_pixels
from app.ui.dialogs import PictureOrMap, Preferring, Unsaved
from app.ui.events import MIDDLE, RIGHT, Button, CloseWish, Drop, Key, Mods, Move
from app.ui.export_choices import ANIMATION, KINDS, MAP, PICTURE
from app.ui.export_dialog import ExportDialog, StillExporting
from app.ui.files import fresh_recipe, load_any
from app.ui.key_sheet import KeySheet
from app.ui.numbers import Numbers
from app.ui.preferences import Preferences
from app.ui.quality import GRIDS, LONGEST, PATIENCE, TICKS, TRIALS, Speed
from app.ui.saving import SaveDialog
from app.ui.widgets import Ui
from app.work.export import run
from app.work.jobs import Job, MapOutput, Outputs
from app.work.replay import Replay
from solver.brush.masks import ZERO
from solver.gl.device import Device
from solver.gl.field import GraphicsMemoryError, new_texture
from solver.resample.plan import Sampling
from solver.resample.sampler import Sampler
from support.commands import Run
from support.drawn import Drawn
from support.editing import BY_KEY, Robot, export_dialog, folding, pattern, small_project, write_foreign_map
from support.gl_objects import living
from support.widgets import Widgets


def names(robot: Robot) -> list[str]:
    return [entry.name for entry in robot.editor.session.document.history.entries]


# Tools --------------------------------------------------------------------------------------------------------------


def test_push_carries_the_picture_along(robot: Robot) -> None:
    robot.see()
    before = robot.canvas()
    robot.drag((0.4, 0.5), (0.55, 0.5))
    robot.rest()
    assert names(robot) == ["Open", "Push"]
    stroke = robot.editor.session.recipe.stroke[0]
    assert stroke.tool == "push"
    assert len(stroke.samples) >= 9
    assert stroke.samples[0][1:3] == pytest.approx((0.4, 0.5), abs=1e-3)
    assert stroke.samples[-1][1:3] == pytest.approx((0.55, 0.5), abs=1e-3)
    warp = robot.warp()
    height, width = warp.shape[:2]
    # What is now under the pointer came from about where the stroke began.
    assert warp[height // 2, round(0.54 * width)][0] == pytest.approx(-0.15, abs=0.04)
    assert np.abs(robot.canvas().astype(int) - before).mean() > 1


def test_at_rest_a_picture_that_is_pressed_together_is_seen_as_it_is_exported(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One place a pixel would pick some of the squares that share it. It is drawn over several frames as if at once."""
    robot.key("ctrl+1")
    session, view = robot.editor.session, robot.editor.view
    y, x = np.mgrid[0:180, 0:240] / 240
    bent = x + 0.1 * np.sin(7 * y) - 0.5
    session.replay.warp.set(np.stack([0.15 * np.tanh(bent / 0.03), 0 * y], axis=-1).astype(np.float32))
    robot.see()
    while robot.editor.clock.settling:
        robot.frame()
    canvas = robot.editor.canvas
    assert canvas.is_unfinished
    assert robot.editor.wants_frame()
    size = round(view.rect.width), round(view.rect.height)
    sampler = Sampler(robot.device)
    exported = sampler.apply(session.seen, pattern().pixels, size, Sampling("bilinear", "clamp")).astype(int)
    sampler.release()
    seen = robot.canvas()
    off = np.abs(seen - exported[: len(seen)]).max(axis=2)
    assert off.mean() < 1.3  # 1.9 by one place a pixel
    monkeypatch.setattr("app.ui.canvas.PARTS", 1)
    monkeypatch.setattr("app.ui.canvas.ROWS", 10_000)
    canvas.show(shown_pixels(pattern(), canvas.largest))  # as if it were another
    robot.frame()
    assert not canvas.is_unfinished
    np.testing.assert_array_equal(robot.canvas(), seen)


def test_one_fold_of_the_warp_is_told_when_it_comes_up(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    """Once all is at rest, and only once until there is none."""
    replay, messages = robot.editor.session.replay, robot.editor.messages
    y, x = np.mgrid[0:180, 0:240] / 240
    bump = -(x - 0.5) * np.exp(-((x - 0.5) ** 2 + (y - 0.4) ** 2) / 0.02**2)
    monkeypatch.setattr("app.ui.canvas.PARTS", 1)
    one = ["The warp folds over itself in 1 of 6912 places. Undo, or Restore it there."]
    for height, told in ((0.9, []), (1.1, one), (1.1, one), (0.9, [])):
        replay.warp.set(np.stack([height * bump, 0 * y], axis=-1).astype(np.float32))
        robot.frame(count=2)
        assert [message.text for message in messages.shown] == told
    # Where Restore has just been used, it is not what helps.
    robot.editor.session.document.history.commit("Restore", robot.editor.session.recipe.edited(amount=0.9))
    replay.warp.set(np.stack([1.1 * bump, 0 * y], axis=-1).astype(np.float32))
    robot.frame(count=2)
    assert [message.text for message in messages.shown] == ["The warp folds over itself in 1 of 6912 places. Undo."]


@pytest.mark.parametrize("times", [1, 2])
def test_a_fold_of_work_that_is_opened_is_told_each_time(
    robot: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, times: int
) -> None:
    """As that of a map to start from: it is there in the first frame."""
    monkeypatch.setattr("app.ui.canvas.PARTS", 1)
    np.save(tmp_path / "m.npy", folding() * 240)
    (tmp_path / "r.toml").write_text('picture = "pattern.png"\nmap = "m.npy"\n')
    for _ in range(times):
        robot.editor.messages.shown.clear()
        robot.drop(tmp_path / "r.toml")
        robot.frame(count=2)
    said = [message.text for message in robot.editor.messages.shown]
    assert any(text.startswith("The warp folds over itself") for text in said), said


def test_a_fold_of_a_part_of_the_warp_alone_is_told_with_what_helps(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A turn by three quarters, and a frozen corner: it folds at 50 % and not at 100 %."""
    session, messages = robot.editor.session, robot.editor.messages
    y, x = (np.mgrid[0:180, 0:240] + 0.5) / 240 - np.array([0.375, 0.5])[:, None, None]
    angle = 1.5 * np.pi * np.clip(1 - (x**2 + y**2) / 0.3**2, 0, None) ** 2
    turned = [x * np.cos(angle) - y * np.sin(angle) - x, x * np.sin(angle) + y * np.cos(angle) - y]
    session.replay.warp.set(np.stack(turned, axis=-1).astype(np.float32))
    corner = np.zeros((180, 240), np.float32)
    corner[:8, :8] = 1
    session.replay.warp.hold(session.device.upload(corner, "corner"))
    monkeypatch.setattr("app.ui.canvas.PARTS", 1)
    robot.frame(count=2)
    assert not messages.shown
    session.edit("Amount", amount=0.5)
    robot.frame(count=2)
    said = [message.text for message in messages.shown]
    assert len(said) == 1
    mend = "Set Amount to 100 %, where it does not."
    assert re.fullmatch(rf"The warp folds over itself in \d+ of 6912 places. {mend}", said[0])


def test_the_newest_of_a_long_history_is_in_sight(robot: Robot) -> None:
    """A row of the present entry's ground; also after steps back and forth."""
    ground = np.array([67, 55, 37])
    for number in range(12):
        robot.editor.session.edit(f"Amount {number}", amount=0.9 - 0.01 * number)
    robot.see()
    for chords in ((), ("ctrl+z",) * 10, ("ctrl+shift+z",) * 10):
        for chord in chords:
            robot.key(chord)
        robot.frame(count=2)
        shown = robot.pixels()[560:740, 1010:1270, :3].astype(int)
        assert (np.abs(shown - ground).max(axis=-1) <= 8).sum() > 200 * 20


def test_alt_pushes_against_the_drag(robot: Robot) -> None:
    robot.mods = Mods(alt=True)
    robot.drag((0.4, 0.5), (0.55, 0.5))
    robot.rest()
    assert robot.editor.session.recipe.stroke[0].reverse
    warp = robot.warp()
    assert warp[warp.shape[0] // 2, round(0.45 * warp.shape[1])][0] > 0.02


def test_shift_keeps_a_stroke_on_its_axis(robot: Robot) -> None:
    x0, y0 = robot.at(0.3, 0.5)
    robot.move(x0, y0)
    robot.press()
    robot.mods = Mods(shift=True)
    for step in range(1, 6):
        robot.move(x0 + 20 * step, y0 + 7 * step)
    robot.release()
    ys = {sample[2] for sample in robot.editor.session.recipe.stroke[0].samples}
    assert len(ys) == 1


def test_shift_click_draws_a_straight_stroke(robot: Robot) -> None:
    robot.drag((0.3, 0.4), (0.35, 0.4), steps=2)
    robot.rest()
    robot.mods = Mods(shift=True)
    robot.click(*robot.at(0.6, 0.6))
    robot.rest()
    stroke = robot.editor.session.recipe.stroke[1]
    assert stroke.samples[0][1:3] == pytest.approx((0.35, 0.4), abs=1e-3)
    assert stroke.samples[-1][1:3] == pytest.approx((0.6, 0.6), abs=1e-3)
    assert np.abs(robot.warp()).max() > 0.1


def test_a_curve_acts_once_it_is_let_go(robot: Robot) -> None:
    robot.key("c")
    x, y = robot.at(0.3, 0.5)
    robot.move(x, y)
    robot.press()
    for step in range(12):
        robot.move(x + 15 * step, y + 6 * step)
    assert np.abs(robot.warp()).max() == 0
    robot.release()
    robot.rest()
    assert robot.editor.session.recipe.stroke[0].tool == "curve"
    assert np.abs(robot.warp()).max() > 0.01


@pytest.mark.parametrize(
    ("key", "name"),
    [
        ("p", "Push"), ("shift+p", "Push"), ("c", "Curve"), ("t", "Twirl"), ("shift+t", "Twirl"), ("b", "Bloat"),
        ("shift+b", "Pinch"), ("v", "Thicken"), ("shift+v", "Thin"), ("f", "Freeze"), ("d", "Thaw"),
        ("s", "Smooth mask"), ("r", "Restore"),
    ],
)  # fmt: skip
def test_the_history_calls_a_stroke_what_it_was(robot: Robot, key: str, name: str) -> None:
    robot.key(key)
    robot.drag((0.5, 0.5), (0.53, 0.5), steps=2)
    assert names(robot) == ["Open", name]


@pytest.mark.parametrize(
    ("key", "tool"),
    [("t", "twirl"), ("b", "bloat"), ("shift+b", "pinch")],
)
def test_tools_that_work_while_held(robot: Robot, key: str, tool: str) -> None:
    robot.key(key)
    robot.drag((0.5, 0.5), (0.5, 0.5), steps=1, hold=10)
    robot.rest()
    assert robot.editor.session.recipe.stroke[0].tool == tool
    warp = robot.warp()
    height, width = warp.shape[:2]
    right = warp[height // 2, round(0.56 * width)]
    if tool == "twirl":
        # Turned clockwise: what is to the right of the middle came from above.
        assert right[1] < -0.005
    else:
        assert right[0] * (1 if tool == "bloat" else -1) < -0.004


@pytest.mark.parametrize(("key", "rate"), [("v", 4.0), ("shift+v", -4.0)])
def test_thicken_and_thin_act_in_the_very_next_frame(robot: Robot, key: str, rate: float) -> None:
    robot.see()
    robot.key(key)
    robot.frame(count=2)
    robot.move(*robot.at(0.5, 0.5))
    still = robot.canvas()
    robot.press()
    robot.frame()
    fluid = robot.editor.session.replay.fluid.viscosity.get()
    assert fluid[fluid.shape[0] // 2, fluid.shape[1] // 2] != pytest.approx(0.03)
    assert np.abs(robot.canvas().astype(int) - still).max() > 3
    robot.frame(count=8)
    robot.release()
    ratio = robot.editor.session.replay.fluid.viscosity.get() / 0.03
    stroke = robot.editor.session.recipe.mask[0]
    assert isinstance(stroke, MaskStroke)
    seconds = (stroke.last_tick + 1 - stroke.first_tick) / 30
    assert np.log10(ratio[ratio.shape[0] // 2, ratio.shape[1] // 2]) == pytest.approx(rate * seconds, rel=0.05)


def test_what_is_frozen_stays(robot: Robot) -> None:
    robot.key("f")
    robot.drag((0.7, 0.5), (0.7, 0.55), steps=3)
    robot.rest()
    solid = robot.editor.session.replay.fluid.solid.get() > 127
    assert 5 < solid.sum() < solid.size / 3
    robot.key("p")
    robot.drag((0.35, 0.5), (0.6, 0.5))
    robot.rest()
    from scipy import ndimage

    inside = np.asarray(ndimage.binary_erosion(solid, iterations=2), bool)
    assert np.abs(robot.warp()[np.nonzero(inside)]).max() < 1e-3
    robot.key("d")
    assert robot.editor.state.opposite["freeze"]
    robot.drag((0.7, 0.5), (0.7, 0.55), steps=3)
    assert not robot.editor.session.replay.fluid.solid.get().any()


def test_smoothing_softens_a_mask(robot: Robot) -> None:
    robot.key("v")
    robot.key("]")
    robot.drag((0.5, 0.5), (0.5, 0.5), steps=1, hold=6)
    masks = robot.editor.session.replay.masks
    before = masks.thickness.get().astype(float) - ZERO
    robot.key("s")
    robot.drag((0.5, 0.5), (0.5, 0.5), steps=1, hold=10)
    after = masks.thickness.get().astype(float) - ZERO
    assert 0.6 * before.max() < after.max() < 0.9 * before.max()
    assert after.sum() == pytest.approx(before.sum(), rel=0.15)


def test_restore_brings_the_picture_back(robot: Robot) -> None:
    robot.drag((0.4, 0.5), (0.55, 0.5))
    robot.rest()
    place = np.array([[0.55, 0.5 * 0.75]])
    before = robot.editor.session.replay.warp.at(place)
    robot.key("r")
    robot.drag((0.55, 0.5), (0.55, 0.5), steps=1, hold=20)
    robot.rest()
    stroke = robot.editor.session.recipe.stroke[-1]
    seconds = (stroke.last_tick + 1 - stroke.first_tick) / 30
    left = robot.editor.session.replay.warp.at(place) / before
    assert np.hypot(*before[0]) > 0.05
    assert left[0, 0] == pytest.approx(np.exp(-6.0 * seconds), rel=0.05)


def test_a_gesture_can_be_given_up(robot: Robot) -> None:
    robot.move(*robot.at(0.4, 0.5))
    robot.press()
    robot.move(*robot.at(0.5, 0.5))
    robot.key("escape")
    robot.release()
    assert names(robot) == ["Open"]
    assert np.abs(robot.warp()).max() == 0


def test_honey_comes_to_rest_by_itself_and_putty_stops_with_the_brush(robot: Robot) -> None:
    moved = {}
    for feel, (viscosity, drag) in {"honey": (0.03, 2.0), "putty": (0.3, 0.0)}.items():
        robot.editor.workspace.change(feel, viscosity=viscosity, drag=drag)
        robot.drag((0.4, 0.4), (0.5, 0.4), steps=6)
        released = robot.warp()
        ticks = 0
        while robot.editor.session.coasting:
            robot.frame()
            ticks += 1
            assert ticks < 300
        moved[feel] = np.abs(robot.warp() - released).max()
    assert moved["putty"] < 0.01
    assert moved["honey"] > moved["putty"]
    while robot.editor.canvas.is_unfinished:
        robot.frame()
    assert not robot.editor.wants_frame() or robot.editor.clock.settling


# The brush and the view ---------------------------------------------------------------------------------------------


def test_before_and_split(robot: Robot) -> None:
    robot.see()
    clean = robot.canvas()
    robot.drag((0.4, 0.5), (0.55, 0.5))
    robot.rest()
    robot.move(900, 20)
    robot.frame(count=2)
    warped = robot.canvas()
    robot.hold("\\", True)
    robot.frame()
    same = np.abs(robot.canvas().astype(int) - clean).mean()
    assert same < 1 < np.abs(warped.astype(int) - clean).mean()
    robot.hold("\\", False)
    robot.key("y")
    robot.drag((0.5, 0.3), (0.8, 0.3))
    assert robot.editor.state.split == pytest.approx(0.8, abs=0.02)
    assert names(robot) == ["Open", "Push"]


def test_overlays_show_something(robot: Robot) -> None:
    robot.key("f")
    robot.drag((0.7, 0.5), (0.7, 0.55), steps=2)
    robot.key("v")
    robot.drag((0.3, 0.6), (0.3, 0.6), steps=2, hold=6)
    robot.key("p")
    robot.drag((0.4, 0.3), (0.55, 0.3))
    robot.editor.session.pause()
    robot.see()
    robot.move(900, 20)
    robot.frame(count=2)
    without = robot.canvas().astype(int)
    for key in "12345":
        robot.key(key)
        robot.frame()
        assert np.abs(robot.canvas() - without).max() > 20, key
        robot.key(key)
        robot.frame()
        assert np.abs(robot.canvas() - without).max() <= 1, key


def test_what_was_seen_stays_while_it_is_made_again_on_another_grid(robot: Robot) -> None:
    robot.drag((0.4, 0.5), (0.55, 0.5))
    robot.rest()
    robot.see()
    robot.move(900, 20)
    robot.frame(count=2)
    seen = robot.canvas()
    robot.editor.session.set_grid(512)
    robot.frame()
    assert robot.editor.session.is_rebuilding
    assert np.array_equal(robot.canvas(), seen)


def test_a_magnified_picture_is_seen_as_it_is_warped_when_time_stands_still(robot: Robot) -> None:
    robot.see()
    robot.move(*robot.at(0.5, 0.5))
    robot.wheel(3)
    assert robot.editor.view.scale > MOVING
    robot.drag((0.45, 0.5), (0.55, 0.5))
    robot.frame(count=3)
    robot.editor.session.pause()
    robot.move(900, 20)
    robot.frame(count=2)
    shown = slice(100, 600), slice(200, 800)
    seen = robot.pixels()[shown]
    for chord in ("ctrl+z", "ctrl+y"):
        robot.key(chord)
        robot.rest()
    assert np.array_equal(robot.pixels()[shown], seen)


# Time ---------------------------------------------------------------------------------------------------------------


def test_scrubbing_both_ways_is_exact(robot: Robot) -> None:
    robot.drag((0.4, 0.5), (0.55, 0.5))
    robot.rest()
    session = robot.editor.session
    end, last = session.end, robot.warp()
    robot.key("home")
    robot.rest()
    assert session.tick == 0
    assert np.abs(robot.warp()).max() == 0
    robot.key(".")
    assert session.tick == 1
    robot.key("end")
    robot.rest()
    assert session.tick == end
    assert np.array_equal(robot.warp(), last)
    robot.key(",")
    robot.rest()
    assert session.tick == end - 1


def test_space_plays_the_recording(robot: Robot) -> None:
    robot.drag((0.4, 0.5), (0.5, 0.5))
    robot.rest()
    end = robot.editor.session.end
    robot.key("space")
    assert robot.editor.session.playing
    for _ in range(3 * end):
        robot.frame()
    assert robot.editor.session.tick == end
    assert not robot.editor.session.playing


def test_painting_goes_on_from_anywhere(robot: Robot) -> None:
    robot.drag((0.3, 0.5), (0.45, 0.5))
    robot.rest()
    robot.drag((0.6, 0.5), (0.75, 0.5))
    robot.rest()
    session = robot.editor.session
    whole = session.recipe
    session.seek(whole.stroke[0].last_tick + 2)
    robot.rest()
    robot.drag((0.3, 0.3), (0.4, 0.3))
    robot.rest()
    assert len(session.recipe.stroke) == 2
    assert robot.editor.messages.shown
    robot.key("ctrl+z")
    assert session.recipe == whole


# Undo ---------------------------------------------------------------------------------------------------------------


def test_undo_and_redo_give_the_same_bytes(robot: Robot) -> None:
    states = []
    robot.drag((0.3, 0.4), (0.45, 0.4))
    robot.rest()
    states.append((robot.editor.session.recipe, robot.warp()))
    robot.key("f")
    robot.drag((0.7, 0.5), (0.7, 0.6), steps=3)
    robot.rest()
    states.append((robot.editor.session.recipe, robot.warp()))
    robot.key("t")
    robot.drag((0.5, 0.5), (0.5, 0.5), steps=1, hold=8)
    robot.rest()
    states.append((robot.editor.session.recipe, robot.warp()))
    robot.key("ctrl+z")
    robot.key("ctrl+z")
    robot.rest()
    for recipe, warp in states:
        assert robot.editor.session.recipe == recipe
        assert np.array_equal(robot.warp(), warp)
        robot.key("ctrl+shift+z")
        robot.rest()


def test_settings_are_undone_too(robot: Robot) -> None:
    robot.drag((0.3, 0.4), (0.45, 0.4))
    robot.rest()
    robot.editor.workspace.change("Putty", viscosity=0.3, drag=0.0)
    assert robot.editor.session.recipe.fluid_at(robot.editor.session.tick).viscosity == 0.3
    robot.key("ctrl+z")
    assert robot.editor.session.recipe.fluid_at(robot.editor.session.tick).viscosity == pytest.approx(0.03)
    robot.key("ctrl+y")
    assert robot.editor.session.recipe.fluid_at(robot.editor.session.tick).viscosity == 0.3


def test_clearing_and_resetting(robot: Robot) -> None:
    robot.drag((0.3, 0.4), (0.45, 0.4))
    robot.key("x")
    robot.rest()
    assert robot.editor.session.replay.fluid.motion().largest_speed < 0.01
    warped = robot.warp()
    robot.key("ctrl+r")
    robot.rest()
    assert np.abs(robot.warp()).max() < 1e-3
    robot.key("ctrl+z")
    robot.rest()
    assert np.array_equal(robot.warp(), warped)


def test_opening_pictures_can_be_undone(robot: Robot, tmp_path: Path) -> None:
    """All the way back to the first, what was done to it included."""
    robot.drag((0.4, 0.5), (0.5, 0.5))
    robot.rest()
    warp = robot.warp()
    sizes = [(240, 180), (100, 60), (90, 70), (64, 64)]
    for number, size in enumerate(sizes[1:]):
        write_picture(tmp_path / f"{number}.png", pattern(*size))
        if robot.editor.workspace.is_dirty:
            assert robot.editor.files.save_as(tmp_path / "work.fluidwarp")
        robot.drop(tmp_path / f"{number}.png")
        assert robot.editor.canvas.size == size
    for size in sizes[-2::-1]:
        robot.key("ctrl+z")
        assert robot.editor.canvas.size == size
    robot.rest()  # it is played again: three works back, it had nothing on the GPU
    assert np.array_equal(robot.warp(), warp)
    robot.key("ctrl+z")
    robot.rest()
    assert np.abs(robot.warp()).max() == 0
    robot.key("ctrl+shift+z")
    robot.rest()
    assert np.array_equal(robot.warp(), warp)
    for size in sizes[1:]:
        robot.key("ctrl+shift+z")
        assert robot.editor.canvas.size == size


def test_a_key_that_is_held_steps_on(robot: Robot) -> None:
    robot.drag((0.4, 0.5), (0.5, 0.5))
    robot.rest()
    session = robot.editor.session
    session.seek(0)
    robot.rest()
    for key, tick in ((".", 3), (",", 0)):
        for number in range(3):
            robot.frame(Key(key, True, Mods(), number > 0))
        robot.frame(Key(key, False, Mods()))
        assert session.target == tick


@pytest.mark.parametrize(
    ("bound", "most"), [("OPENED_BUDGET", 1000), ("OPENED_BUDGET", 30 * 3 * (40 + 41) + 1024), ("MOST_OPENED", 1)]
)
def test_works_opened_before_are_no_more_than_their_bounds(
    robot: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, bound: str, most: int
) -> None:
    """The one before always stays; with the pixels, histories count."""
    monkeypatch.setattr(workspace, bound, most)
    for number in range(3):
        write_picture(tmp_path / f"{number}.png", pattern(40 + number, 30))
        robot.drop(tmp_path / f"{number}.png")
    robot.key("ctrl+z")
    assert robot.editor.canvas.size == (41, 30)
    assert not robot.editor.workspace.can_undo


# Files --------------------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_a_session_saved_and_rendered_is_the_same_picture(device: Device, robot: Robot, tmp_path: Path) -> None:
    dice = random.Random(1)
    for _ in range(6):
        robot.key(dice.choice(["p", "t", "b", "f", "v", "r"]))
        start = dice.uniform(0.2, 0.8), dice.uniform(0.2, 0.8)
        robot.drag(start, (start[0] + dice.uniform(-0.1, 0.1), start[1] + dice.uniform(-0.1, 0.1)), steps=3)
        if dice.random() < 0.5:
            robot.rest()
    robot.rest()
    warp = robot.warp()
    assert robot.editor.files.save_as(tmp_path / "work.fluidwarp")
    assert not robot.editor.workspace.is_dirty
    loaded = projects.load(tmp_path / "work.fluidwarp")
    assert loaded.recipe == robot.editor.session.recipe
    robot.editor.open(loaded)
    robot.rest()
    assert np.array_equal(robot.warp(), warp)
    out = tmp_path / "out.png"
    run(device, Job(loaded.recipe, loaded.picture, loaded.folder, Outputs(out)), Progress())
    seen = robot.editor.exports
    job = export_dialog(robot, tmp_path).job()
    run(device, job, Progress())
    assert not seen.is_running
    assert job.outputs.file is not None
    assert np.array_equal(read_picture(job.outputs.file).pixels, read_picture(out).pixels)


def test_files_that_are_no_pictures_leave_the_work_alone(robot: Robot, tmp_path: Path) -> None:
    robot.drag((0.3, 0.4), (0.45, 0.4))
    robot.rest()
    assert robot.editor.files.save_as(tmp_path / "kept.fluidwarp")
    recipe = robot.editor.session.recipe
    whole = (tmp_path / "kept.fluidwarp").read_bytes()
    cases = {
        "junk.png": b"not a picture",
        "empty.jpg": b"",
        "cut.fluidwarp": whole[: len(whole) // 2],
        "text.toml": b"viscosity = ",
    }
    for name, data in cases.items():
        (tmp_path / name).write_bytes(data)
        robot.editor.messages.shown.clear()
        robot.drop(tmp_path / name)
        assert name in robot.editor.messages.shown[-1].text, name
        assert robot.editor.session.recipe is recipe
    assert (tmp_path / "kept.fluidwarp").read_bytes() == whole
    write_picture(tmp_path / "other.png", pattern())
    robot.drop(tmp_path / "other.png")
    robot.frame(count=2)
    assert not robot.editor.messages.shown  # that something else could not be opened is of no interest any more


@pytest.mark.skipif(sys.platform != "linux", reason="names are texts elsewhere")
def test_a_picture_whose_name_is_no_text_is_opened_chosen_and_saved(robot: Robot, tmp_path: Path) -> None:
    path = tmp_path / os.fsdecode(b"caf\xe9.png")
    write_picture(tmp_path / "a.png", pattern())
    os.rename(tmp_path / "a.png", path)
    robot.drop(path)
    assert robot.editor.title == "caf? - fluidwarp"
    robot.editor.preferences.folder = str(tmp_path)
    for key in ("ctrl+o", "ctrl+e", "ctrl+s"):
        robot.key(key)
        robot.frame(count=3)
        robot.editor.dialogs.release()
    assert not robot.editor.files.save_as(tmp_path / "w.fluidwarp", embed=False)
    assert "its name is not text" in robot.editor.messages.shown[-1].text
    assert robot.editor.files.save_as(tmp_path / "w.fluidwarp")
    assert projects.load(tmp_path / "w.fluidwarp").recipe.picture == "caf?.png"


def test_saving_where_it_cannot_be_says_so(robot: Robot, tmp_path: Path) -> None:
    robot.drag((0.3, 0.4), (0.45, 0.4))
    assert not robot.editor.files.save_as(tmp_path / "nowhere" / "work.fluidwarp")
    assert "nowhere" in robot.editor.messages.shown[-1].text
    assert robot.editor.workspace.is_dirty


def test_a_picture_that_is_gone_is_still_saved(robot: Robot, tmp_path: Path) -> None:
    (tmp_path / "pattern.png").unlink()
    robot.drag((0.3, 0.4), (0.45, 0.4))
    robot.rest()
    assert robot.editor.files.save_as(tmp_path / "work.fluidwarp")
    assert projects.load(tmp_path / "work.fluidwarp").picture.width == 240


def test_the_recipe_can_be_copied(robot: Robot) -> None:
    copied: list[str] = []
    robot.editor.commands.clipboard = copied.append
    robot.drag((0.3, 0.4), (0.45, 0.4))
    robot.rest()
    robot.key("ctrl+shift+c")
    assert Recipe.parse(copied[0]) == robot.editor.session.recipe


# Dialogs ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("key", "dialog"),
    [("f1", KeySheet), ("ctrl+,", Preferring), ("ctrl+e", ExportDialog), ("ctrl+o", Browser), ("ctrl+s", SaveDialog)],
)
def test_dialogs_open_and_close(robot: Robot, key: str, dialog: type) -> None:
    robot.see()
    plain = robot.pixels().astype(int)
    robot.key(key)
    robot.frame(count=3)
    assert isinstance(robot.editor.dialogs.shown[-1], dialog)
    assert np.abs(robot.pixels() - plain).mean() > 5
    # Nothing under a dialog hears the pointer or the keys.
    robot.drag((0.05, 0.05), (0.1, 0.05), steps=2)
    assert robot.editor.session.recipe.stroke == ()
    robot.key("escape")
    robot.frame(count=2)
    assert not robot.editor.dialogs.shown


def test_unsaved_work_is_asked_about(robot: Robot, tmp_path: Path) -> None:
    robot.drag((0.3, 0.4), (0.45, 0.4))
    robot.rest()
    robot.frame(CloseWish())
    robot.frame(count=2)
    assert isinstance(robot.editor.dialogs.shown[-1], Unsaved)
    assert not robot.editor.commands.closed
    robot.key("escape")
    robot.frame(count=2)
    assert not robot.editor.dialogs.shown
    assert robot.editor.files.save_as(tmp_path / "work.fluidwarp")
    robot.key("ctrl+q")
    assert robot.editor.commands.closed


def test_a_question_is_not_asked_twice(robot: Robot, tmp_path: Path) -> None:
    for number in range(2):
        write_picture(tmp_path / f"{number}.png", pattern(100 - 10 * number, 60))
    robot.drag((0.3, 0.4), (0.45, 0.4))
    robot.rest()
    robot.frame(CloseWish(), CloseWish())
    robot.frame(CloseWish())
    robot.frame(count=2)
    robot.key("escape")
    robot.frame(count=2)
    assert not robot.editor.dialogs.shown
    for number in range(2):
        robot.frame(Drop((str(tmp_path / f"{number}.png"),)))
        robot.frame(count=2)
    asked = robot.editor.dialogs.shown[-1]
    robot.click(asked.rect.x + 60, asked.rect.bottom - 36)
    robot.until(lambda: not robot.editor.files.is_loading)
    assert robot.editor.canvas.size == (100, 60)
    assert not robot.editor.dialogs.shown


def test_a_file_that_has_been_read_waits_for_the_answer_to_a_dialog(robot: Robot, tmp_path: Path) -> None:
    write_picture(tmp_path / "other.png", pattern(100, 60))
    robot.frame(Key("e", True, Mods(ctrl=True)))
    robot.editor.files.open(tmp_path / "other.png")
    for _ in range(20):
        robot.frame()
        time.sleep(0.02)
    assert isinstance(robot.editor.dialogs.shown[-1], ExportDialog)
    assert robot.editor.canvas.size == (240, 180)
    robot.key("escape")
    robot.until(lambda: not robot.editor.files.is_loading)
    assert robot.editor.canvas.size == (100, 60)


def test_a_message_that_comes_or_goes_by_itself_is_drawn_until_it_fits(robot: Robot) -> None:
    robot.see()
    messages = robot.editor.messages
    messages.warn("A long one that takes two lines or even three of them in the panel that it stands in, and stays.")
    robot.frame(count=10)
    assert not robot.editor.wants_frame()
    messages.done("Short")
    assert robot.editor.wants_frame()
    robot.frame(count=10)
    rested = robot.pixels()
    robot.frame(count=10)
    assert np.array_equal(robot.pixels(), rested)
    robot.move(*robot.at(0.5, 0.5))  # somebody is there
    robot.frame(count=10)
    robot.frame(dt=6.0)
    assert robot.editor.wants_frame()


def test_saving_over_what_another_has_saved_asks_first(
    robot: Robot, tmp_path: Path, widgets: Widgets, monkeypatch: pytest.MonkeyPatch
) -> None:
    told, wrapped = list[str](), Ui.wrapped
    monkeypatch.setattr(Ui, "wrapped", lambda ui, words, *how: told.append(words) or wrapped(ui, words, *how))
    robot.drag((0.3, 0.4), (0.45, 0.4))
    robot.rest()
    kept = tmp_path / "kept.fluidwarp"
    assert robot.editor.files.save_as(kept)
    robot.key("ctrl+s")
    robot.frame(count=3)
    assert not robot.editor.dialogs.shown
    other = projects.save(projects.load(kept), kept)
    theirs = kept.read_bytes()
    robot.key("ctrl+s")
    robot.frame(count=3)
    dialog = robot.editor.dialogs.shown[-1]
    assert isinstance(dialog, SaveDialog)
    assert dialog.path == kept
    assert "Something else has saved into this file since you opened it. What it saved will be replaced." in told
    robot.key("escape")
    robot.frame(count=2)
    assert kept.read_bytes() == theirs
    assert not other.is_overtaken
    robot.key("ctrl+s")
    robot.frame(count=3)
    widgets.click("Save")
    robot.frame(count=2)
    assert not robot.editor.dialogs.shown
    assert not robot.editor.session.project.is_overtaken
    robot.key("ctrl+s")
    robot.frame(count=3)
    assert not robot.editor.dialogs.shown
    kept.unlink()  # what is gone can be saved again without a question
    assert not robot.editor.session.project.is_overtaken


def asked_for_a_name(robot: Robot, folder: Path) -> SaveDialog:
    """The dialog that a stroke is saved by, which proposes a name in a folder."""
    robot.drag((0.3, 0.4), (0.45, 0.4))
    robot.rest()
    robot.editor.preferences.folder = str(folder)
    robot.key("ctrl+s")
    robot.frame(count=3)
    dialog = robot.editor.dialogs.shown[-1]
    assert isinstance(dialog, SaveDialog)
    return dialog


def test_what_another_has_just_saved_is_told_before_it_is_replaced(robot: Robot, tmp_path: Path) -> None:
    """Enter, in the first frame in which it is there: the person has not read that."""
    dialog = asked_for_a_name(robot, tmp_path)
    dialog.path.write_bytes(b"theirs")
    robot.key("enter")
    robot.frame(count=3)
    assert dialog.path.read_bytes() == b"theirs"
    assert robot.editor.dialogs.shown == [dialog]
    robot.key("enter")
    robot.frame(count=3)
    assert not robot.editor.dialogs.shown
    assert projects.load(dialog.path).recipe.stroke


def test_saving_asks_for_a_name_and_where_the_picture_goes(robot: Robot, tmp_path: Path, widgets: Widgets) -> None:
    dialog = asked_for_a_name(robot, tmp_path)
    # The name is marked: what is typed takes its place.
    robot.type("kept")
    robot.frame()
    robot.key("enter")
    robot.frame(count=2)
    assert not robot.editor.dialogs.shown
    kept = projects.load(tmp_path / "kept.fluidwarp")
    assert kept.embedded
    assert robot.editor.preferences.recent[0].endswith("kept.fluidwarp")

    robot.key("ctrl+shift+s")
    robot.frame(count=3)
    dialog = robot.editor.dialogs.shown[-1]
    assert isinstance(dialog, SaveDialog)
    robot.type("small")
    widgets.click("Keep the picture inside the project")
    assert not dialog.embed
    widgets.click("Save")
    assert not robot.editor.dialogs.shown
    small = projects.load(tmp_path / "small.fluidwarp")
    assert not small.embedded
    assert (tmp_path / "small.fluidwarp").stat().st_size < (tmp_path / "kept.fluidwarp").stat().st_size
    # The choice is remembered, and kept for this project when it is saved again.
    assert not robot.editor.preferences.embed
    robot.drag((0.3, 0.6), (0.45, 0.6))
    robot.editor.preferences.embed = True
    robot.key("ctrl+s")
    assert not projects.load(tmp_path / "small.fluidwarp").embedded


@pytest.mark.parametrize("embeds", [True, False])
def test_a_picture_is_kept_in_the_project_as_the_person_likes_and_then_as_it_was_saved(
    robot: Robot, tmp_path: Path, embeds: bool
) -> None:
    files, likes, path = robot.editor.files, robot.editor.preferences, tmp_path / "a.fluidwarp"
    likes.embed = embeds
    for _ in range(2):
        assert files.save_as(path)
        assert projects.load(path).embedded == embeds
        likes.embed = not embeds


def test_a_picture_that_is_only_in_a_project_stays_there(robot: Robot, tmp_path: Path) -> None:
    assert robot.editor.files.save_as(tmp_path / "work.fluidwarp", True)
    robot.drop(tmp_path / "work.fluidwarp")
    robot.editor.preferences.embed = False
    robot.key("ctrl+shift+s")
    robot.frame(count=2)
    dialog = robot.editor.dialogs.shown[-1]
    assert isinstance(dialog, SaveDialog)
    assert dialog.must_embed
    assert dialog.embed


def test_the_browser_chooses_where(robot: Robot, tmp_path: Path) -> None:
    chosen: list[Path] = []
    robot.editor.chooser.ask_where("Save", tmp_path / "a.fluidwarp", (".fluidwarp",), chosen.append)
    robot.frame(count=2)
    browser = robot.editor.dialogs.shown[-1]
    assert isinstance(browser, Browser)
    browser.name = "saved.fluidwarp"
    width, height = robot.size
    robot.click(width / 2 + 640 / 2 - 24 - 44 - 8, height / 2 + 460 / 2 - 36)
    robot.frame(count=2)
    assert chosen == [tmp_path / "saved.fluidwarp"]
    assert not robot.editor.dialogs.shown


def test_the_browser_s_button_opens_what_is_typed_or_else_what_is_picked(robot: Robot, tmp_path: Path) -> None:
    chosen: list[Path] = []
    for name in ("a.pts", "deep/b.pts"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    robot.editor.chooser.ask_which("Open", tmp_path, (".pts",), chosen.append)
    robot.frame(count=2)
    browser = robot.editor.dialogs.shown[-1]
    assert isinstance(browser, Browser)
    right, bottom = browser.rect.x + browser.rect.width, browser.rect.y + browser.rect.height

    def press() -> None:
        robot.click(right - 24 - 44, bottom - 44)
        robot.frame(count=2)

    def pick(number: int) -> None:
        robot.click(browser.rect.x + 200, browser.rect.y + 110 + 34 * number)
        robot.frame(count=2)

    def write(path: str) -> None:
        robot.click(browser.rect.x + 200, browser.rect.y + 72)
        robot.key("ctrl+a")
        robot.type(path)
        robot.frame(count=2)

    press()
    assert (chosen, browser.problem, browser.folder) == ([], "", tmp_path)  # there is nothing to open yet
    pick(0)
    press()
    assert browser.folder == tmp_path / "deep"
    write(str(tmp_path))
    press()
    assert (chosen, browser.folder) == ([], tmp_path)
    pick(1)
    write(str(tmp_path / "deep" / "b.pts"))
    press()
    assert chosen == [tmp_path / "deep" / "b.pts"]
    assert not robot.editor.dialogs.shown


def test_the_browser_asks_of_each_name_whether_it_may_be_replaced(robot: Robot, tmp_path: Path) -> None:
    chosen: list[Path] = []
    for name in ("a.fluidwarp", "b.fluidwarp"):
        (tmp_path / name).touch()
    robot.editor.chooser.ask_where("Save", tmp_path / "a.fluidwarp", (".fluidwarp",), chosen.append)
    robot.frame(count=2)
    browser = robot.editor.dialogs.shown[-1]
    assert isinstance(browser, Browser)
    for name in ("a.fluidwarp", "b.fluidwarp", "b.fluidwarp"):
        assert not chosen
        browser.name = name
        robot.click(browser.rect.x + browser.rect.width - 24 - 44, browser.rect.y + browser.rect.height - 44)
        robot.frame(count=2)
    assert chosen == [tmp_path / "b.fluidwarp"]


def test_a_folder_is_shown_by_a_double_click_and_of_one_that_is_gone_it_is_told(robot: Robot, tmp_path: Path) -> None:
    (tmp_path / "deep" / "deeper").mkdir(parents=True)
    robot.editor.chooser.ask_which("Open", tmp_path, (".pts",), lambda path: None)
    robot.frame(count=2)
    browser = robot.editor.dialogs.shown[-1]
    assert isinstance(browser, Browser)

    def twice(number: int) -> None:
        robot.frame(dt=1.0)
        for _ in range(2):
            robot.click(browser.rect.x + 200, browser.rect.y + 110 + 34 * number)
        robot.frame(count=2)

    twice(0)
    assert browser.folder == tmp_path / "deep"
    assert browser.inside == [tmp_path / "deep" / "deeper"]
    gone = tmp_path / "gone"
    browser.go(gone)
    with pytest.MonkeyPatch.context() as noting:
        drawn = Drawn(noting)
        robot.frame()
    assert browser.inside == []
    assert any(line.endswith("| No such file or directory") for line in drawn.take())
    assert robot.editor.dialogs.shown == [browser]


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (UserError("a.png: it is torn; get it again"), "a.png: it is torn; get it again"),
        (MemoryError(), "There is not enough memory to open {}."),
        (RuntimeError("nobody has thought of it"), "{} cannot be opened: nobody has thought of it"),
    ],
)
def test_whatever_fails_while_a_file_is_read_is_told_and_the_work_stays(
    robot: Robot, tmp_path: Path, error: Exception, said: str
) -> None:
    def load() -> Project:
        raise error

    session = robot.editor.session
    robot.editor.files.read(tmp_path / "a.png", load)
    robot.until(lambda: not robot.editor.files.is_loading)
    assert [message.text for message in robot.editor.messages.shown] == [said.format(tmp_path / "a.png")]
    assert robot.editor.session is session


def test_work_that_cannot_be_begun_is_told_of_and_leaves_nothing_on_the_gpu(robot: Robot, tmp_path: Path) -> None:
    """As its map is none, which shows only where it is begun with."""
    np.save(tmp_path / "m.npy", np.zeros((3, 4, 5), np.float32))
    (tmp_path / "r.toml").write_text('picture = "pattern.png"\nmap = "m.npy"\n')
    session, before = robot.editor.session, living(robot.device, "Texture")
    for _ in range(2):
        robot.drop(tmp_path / "r.toml")
        assert robot.editor.session is session
        (said,) = [message.text for message in robot.editor.messages.shown]
        assert "m.npy" in said
    assert living(robot.device, "Texture") == before


def test_a_folder_that_is_not_there_is_told_in_the_browser(robot: Robot) -> None:
    robot.key("ctrl+o")
    robot.frame(count=2)
    browser = robot.editor.dialogs.shown[-1]
    assert isinstance(browser, Browser)
    robot.click(browser.rect.x + 200, browser.rect.y + 72)
    robot.key("ctrl+a")
    robot.type("/nonesuch")
    robot.frame(count=2)
    robot.key("enter")
    robot.frame(count=2)
    assert browser.problem == "There is no /nonesuch."
    assert robot.editor.dialogs.shown == [browser]


def test_what_cannot_be_done_with_the_file_that_is_chosen_is_told_in_the_browser(robot: Robot, tmp_path: Path) -> None:
    def refuse(path: Path) -> None:
        raise UserError(f"{path.name} does not fit")

    robot.editor.chooser.ask_which("Open", tmp_path, (".pts",), refuse)
    robot.frame(count=2)
    browser = robot.editor.dialogs.shown[-1]
    assert isinstance(browser, Browser)
    (tmp_path / "a.pts").touch()
    browser.typed = str(tmp_path / "a.pts")
    robot.click(browser.rect.x + 200, browser.rect.y + 72)
    robot.key("enter")
    robot.frame(count=2)
    assert browser.problem == "a.pts does not fit"
    assert robot.editor.dialogs.shown == [browser]
    assert not robot.editor.messages.shown


@pytest.mark.parametrize("helper", ["absent", "failing", "working"])
def test_without_a_system_s_file_dialog_there_is_ours(
    robot: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, helper: str
) -> None:
    write_picture(tmp_path / "other.png", pattern(100, 60))
    programs = tmp_path / "programs"
    programs.mkdir()
    if helper == "absent":
        monkeypatch.setenv("PATH", str(programs))
    else:
        answer = f"echo {tmp_path}/other.png" if helper == "working" else "exit 1"
        told = programs / "told.txt"
        (programs / "zenity").write_text(f'#!/bin/sh\nsleep 0.1\necho "$@" > {told}\n{answer}\n')
        (programs / "zenity").chmod(0o755)
        monkeypatch.setenv("PATH", f"{programs}:{os.environ['PATH']}")
    robot.editor.chooser.native = True
    robot.key("ctrl+o")
    robot.until(lambda: not robot.editor.chooser.is_waiting)
    if helper != "absent":
        patterns = (programs / "told.txt").read_text().split("|")[1].split()
        assert {"*.png", "*.fluidwarp", "*.mp4"} <= set(patterns)
    if helper == "working":
        robot.until(lambda: not robot.editor.files.is_loading)
    else:
        assert "zenity" in robot.editor.messages.shown[-1].text
        browser = robot.editor.dialogs.shown[-1]
        assert isinstance(browser, Browser)
        browser.go(tmp_path)
        robot.frame(count=2)
        row = [path.name for path in browser.inside].index("other.png")
        robot.frame(count=20)
        for _ in range(2):
            robot.click(browser.rect.x + 120, browser.rect.y + 115 + row * 34)
        robot.until(lambda: not robot.editor.files.is_loading)
    assert robot.editor.canvas.size == (100, 60)


# Warp maps ----------------------------------------------------------------------------------------------------------


def test_a_map_dropped_on_the_window_is_what_the_picture_starts_from(
    device: Device, robot: Robot, tmp_path: Path
) -> None:
    robot.see()
    clean = robot.canvas()
    robot.drag((0.4, 0.5), (0.55, 0.5))
    robot.rest()
    warped, recipe = robot.warp(), robot.editor.session.recipe
    robot.key("ctrl+z")
    robot.rest()
    for name in ("m.exr", "m.tif", "m.flo", "m.npy"):
        maps = MapOutput(tmp_path / name)
        run(device, Job(recipe, pattern(), tmp_path, Outputs(None, maps=maps)), Progress())
        robot.drop(maps.path)
        robot.rest()
        assert names(robot) == ["Open", "Start from a map"]
        # Resampled to the grid of 48 cells: within a twentieth of a cell.
        assert np.abs(robot.warp() - warped).max() < 0.05 / 48, name
        robot.move(900, 20)
        robot.frame(count=2)
        assert np.abs(robot.canvas().astype(int) - clean).mean() > 1, name
        if name != "m.npy":
            robot.key("ctrl+z")
            robot.rest()
    # Painted on, saved and rendered by the command line's way, it is the same picture.
    robot.drag((0.6, 0.3), (0.7, 0.3))
    robot.rest()
    assert robot.editor.files.save_as(tmp_path / "work.fluidwarp")
    maps.path.unlink()
    loaded = projects.load(tmp_path / "work.fluidwarp")
    robot.editor.open(loaded)
    robot.rest()
    painted = robot.warp()
    files = [tmp_path / "window.png", tmp_path / "line.png"]
    job = export_dialog(robot, tmp_path).job()
    run(device, replace(job, outputs=Outputs(files[0])), Progress())
    run(device, Job(loaded.recipe, loaded.picture, loaded.folder, Outputs(files[1])), Progress())
    assert files[0].read_bytes() == files[1].read_bytes()
    robot.key("ctrl+z")
    robot.key("ctrl+z")
    robot.key("ctrl+z")
    robot.rest()
    assert np.abs(robot.warp()).max() == 0
    assert np.abs(painted - warped).max() > 0.02


def test_a_file_that_may_be_a_picture_or_a_map_is_asked_about(robot: Robot, tmp_path: Path) -> None:
    write_foreign_map(tmp_path / "st.exr", 240, 180)
    robot.drop(tmp_path / "st.exr")
    asked = robot.editor.dialogs.shown[-1]
    assert isinstance(asked, PictureOrMap)
    robot.frame(count=2)
    robot.click(asked.rect.right - 24 - 144 - 8 - 56, asked.rect.bottom - 36)
    assert not robot.editor.dialogs.shown
    assert names(robot) == ["Open", "Start from a map"]
    robot.rest()
    assert np.allclose(robot.warp()[:, :-6], (0.1, 0.0), atol=1e-4)
    robot.key("ctrl+z")

    robot.drop(tmp_path / "st.exr")
    asked = robot.editor.dialogs.shown[-1]
    robot.frame(count=2)
    robot.click(asked.rect.right - 24 - 72, asked.rect.bottom - 36)
    robot.until(lambda: not robot.editor.files.is_loading)
    assert robot.editor.session.project.name == "st"
    assert robot.editor.canvas.size == (240, 180)

    robot.drop(tmp_path / "st.exr")
    robot.frame(count=2)
    robot.key("escape")
    assert not robot.editor.dialogs.shown
    assert names(robot) == ["Open"]


def test_two_channels_of_floats_are_a_map(robot: Robot, tmp_path: Path) -> None:
    write_foreign_map(tmp_path / "uv.exr", 240, 180, "UV")
    robot.drop(tmp_path / "uv.exr")
    assert names(robot) == ["Open", "Start from a map"]
    robot.rest()
    assert np.allclose(robot.warp()[:, :-6], (0.1, 0.0), atol=1e-4)


def test_a_map_that_was_asked_about_and_does_not_fit_is_told_of(robot: Robot, tmp_path: Path) -> None:
    write_foreign_map(tmp_path / "wide.exr", 240, 80)
    robot.drop(tmp_path / "wide.exr")
    asked = robot.editor.dialogs.shown[-1]
    robot.frame(count=2)
    robot.click(asked.rect.right - 24 - 144 - 8 - 56, asked.rect.bottom - 36)
    robot.frame(count=2)
    assert not robot.editor.dialogs.shown
    assert "proportions" in robot.editor.messages.shown[-1].text
    assert names(robot) == ["Open"]


def test_maps_that_do_not_fit_leave_the_work_alone(robot: Robot, tmp_path: Path) -> None:
    robot.drag((0.4, 0.5), (0.55, 0.5))
    robot.rest()
    recipe, warp = robot.editor.session.recipe, robot.warp()
    holes = np.zeros((18, 24, 2), np.float32)
    holes[3, 4] = np.nan
    cases = {
        "nan.npy": (holes, "NaN"),
        "wide.npy": (np.zeros((10, 40, 2), np.float32), "proportions"),
        "tiny.npy": (np.zeros((3, 4, 2), np.float32), "6"),
        "flat.npy": (np.zeros((18, 24), np.float32), "(18, 24)"),
    }
    for name, (values, said) in cases.items():
        np.save(tmp_path / name, values)
        robot.editor.messages.shown.clear()
        robot.drop(tmp_path / name)
        assert said in robot.editor.messages.shown[-1].text, name
        assert name in robot.editor.messages.shown[-1].text
        assert robot.editor.session.recipe is recipe
        assert np.array_equal(robot.warp(), warp)


@pytest.mark.parametrize("forward", [False, True], ids=["inverse", "forward"])
def test_a_map_exported_from_the_window_is_the_command_line_s(
    robot: Robot, tmp_path: Path, fluidwarp: Run, forward: bool
) -> None:
    robot.drag((0.4, 0.5), (0.55, 0.5))
    robot.rest()
    assert robot.editor.files.save_as(tmp_path / "work.fluidwarp")
    more = ["--forward"] if forward else []
    for format_, file in enumerate(KINDS[MAP][1]):
        ending = file.variants[0].ending
        dialog = export_dialog(robot, tmp_path)
        dialog.choices.kind, dialog.name, dialog.choices.forward, dialog.choices.size = MAP, "m", forward, 120
        dialog.choices.format[MAP] = format_
        if format_:
            run(robot.device, dialog.job(), Progress())
        else:  # in a process of its own, as the window does it
            robot.editor.exports.start(dialog.job())
            robot.until(lambda: not robot.editor.exports.is_running)
        window, line = tmp_path / f"m{ending}", tmp_path / f"line{ending}"
        ran = fluidwarp(tmp_path, "render", "work.fluidwarp", "--size", "120", "--map", line.name, *more)
        assert (ran.returncode, ran.stderr) == (0, "")
        assert window.read_bytes() == line.read_bytes()
        read = read_map(window)
        assert (read.width, read.height) == (120, 90)
        assert np.abs(read.values).max() > 0.05


def test_export_runs_beside_the_window(robot: Robot, tmp_path: Path) -> None:
    robot.drag((0.3, 0.4), (0.45, 0.4))
    robot.rest()
    dialog = export_dialog(robot, tmp_path)
    robot.editor.exports.start(dialog.job())
    frames = 0
    while robot.editor.exports.is_running and frames < 6000:
        robot.frame(dt=0.01)
        time.sleep(0.01)
        frames += 1
    assert frames > 2
    assert dialog.output.exists(), [message.text for message in robot.editor.messages.shown]
    assert read_picture(dialog.output).width == 240


def test_an_export_can_be_cancelled(robot: Robot, tmp_path: Path) -> None:
    robot.drag((0.3, 0.4), (0.45, 0.4))
    robot.rest()
    dialog = export_dialog(robot, tmp_path)
    dialog.choices.kind = ANIMATION
    robot.editor.exports.start(dialog.job())
    robot.frame(count=2)
    robot.editor.exports.cancel()
    robot.frame()
    assert not robot.editor.exports.is_running
    assert [path.name for path in tmp_path.iterdir()] == ["pattern.png"]


# The rest -----------------------------------------------------------------------------------------------------------


def test_no_two_actions_share_a_key() -> None:
    keys = [key for action in ACTIONS.values() for key in action.keys]
    assert len(keys) == len(set(keys))
    assert {tool.key for tool in TOOLS} <= set(keys)


@pytest.mark.parametrize("name", sorted(ACTIONS))
def test_every_action_can_be_done_at_any_time(robot: Robot, name: str) -> None:
    robot.drag((0.4, 0.4), (0.5, 0.4), steps=2)
    robot.editor.do(name)
    robot.frame(count=3)
    robot.move(*robot.at(0.4, 0.6))
    robot.frame(count=2)
    warned = [message.text for message in robot.editor.messages.shown if message.icon == "warn"]
    assert not warned or name in ("copy_picture", "paste"), "of these, that there is no clipboard"
    # A dialog is left by Escape, once for a field in it; and the stroke is there whatever was done after it.
    for _ in robot.editor.dialogs.shown * 2:
        robot.key("escape")
    assert not robot.editor.dialogs.shown
    robot.editor.session.go_to(1)
    robot.rest()
    assert [stroke.tool for stroke in robot.editor.session.recipe.stroke] == ["push"]
    assert np.abs(robot.warp()).max() > 0.01


@pytest.mark.parametrize("tool", [tool.name for tool in TOOLS])
def test_the_strip_chooses_tools(robot: Robot, tool: str) -> None:
    ends = ("pinch", "handle", "smooth", "restore")
    strip = robot.editor.layout.strip
    assert strip is not None
    y = strip.y + 8.0
    for other in TOOLS:
        if other.name == tool:
            break
        y += 44 + (10 if other.name in ends else 0)
    robot.click(24, y + 20)
    assert robot.editor.state.tool_name == tool


def test_the_theme_and_the_scale(robot: Robot) -> None:
    robot.see()
    dark = robot.pixels().mean()
    robot.key("ctrl+l")
    robot.frame()
    assert robot.pixels().mean() > dark + 30
    robot.key("ctrl+l")
    robot.frame()
    assert robot.pixels().mean() == pytest.approx(dark, abs=3)
    robot.editor.preferences.scale = 1.5
    robot.frame(count=2)
    assert robot.editor.layout.bar.height == 72


@pytest.mark.parametrize("seed", range(3))
def test_random_doings_never_break_anything(robot: Robot, seed: int) -> None:
    dice = random.Random(seed)
    chords = [key for key in BY_KEY if key not in ("ctrl+q", "ctrl+c", "space")]
    for _ in range(120):
        match dice.randrange(6):
            case 0:
                robot.key(dice.choice(chords))
            case 1:
                robot.move(dice.uniform(-50, 1350), dice.uniform(-50, 850))
            case 2:
                button, down = dice.choice((0, 0, 0, RIGHT, MIDDLE)), dice.random() < 0.5
                robot.frame(Button(button, down, Mods(alt=dice.random() < 0.2)))
            case 3:
                robot.frame(*(Move(dice.uniform(100, 900), dice.uniform(80, 700)) for _ in range(5)))
            case 4:
                robot.wheel(dice.choice((-2, 1, 3)))
            case 5:
                robot.frame(Key("space", dice.random() < 0.5))
        if robot.editor.dialogs.shown and dice.random() < 0.5:
            robot.key("escape")
    robot.editor.dialogs.shown.clear()
    session = robot.editor.session
    session.release()
    session.pause()
    session.settle()
    robot.frame(count=2)
    # Whatever was done, the recipe is a recipe, and replaying it gives what is seen.
    assert Recipe.parse(session.recipe.text()) == session.recipe
    seen, tick = robot.warp(), session.tick
    session.replay.checkpoints.clear()
    session.replay.seek(0)
    session.replay.seek(tick)
    assert np.array_equal(robot.warp(), seen)


# What goes on beside the work ---------------------------------------------------------------------------------------


def test_leaving_asks_about_an_export_that_is_running(robot: Robot, tmp_path: Path) -> None:
    robot.drag((0.3, 0.4), (0.45, 0.4))
    robot.rest()
    assert robot.editor.files.save_as(tmp_path / "work.fluidwarp")
    dialog = export_dialog(robot, tmp_path)
    dialog.choices.kind, dialog.choices.fps = ANIMATION, 60
    for answer in ("cancel", "wait"):
        robot.editor.exports.start(dialog.job())
        robot.frame(CloseWish())
        robot.frame(count=2)
        asked = robot.editor.dialogs.shown[-1]
        assert isinstance(asked, StillExporting)
        assert not robot.editor.commands.closed
        if answer == "cancel":
            robot.key("escape")
            robot.frame(count=2)
            assert not robot.editor.dialogs.shown
            assert robot.editor.exports.is_running
            robot.editor.exports.cancel()
        else:
            robot.click(asked.rect.right - 60, asked.rect.bottom - 36)
            robot.until(lambda: robot.editor.commands.closed)
            assert dialog.output.exists()


def test_a_file_is_read_in_the_background(robot: Robot, tmp_path: Path) -> None:
    robot.see()
    write_picture(tmp_path / "other.png", pattern(100, 60))
    files, goes_on = robot.editor.files, Event()

    def load() -> Project:
        assert goes_on.wait(60)
        return load_any(tmp_path / "other.png")

    files.read(tmp_path / "other.png", load)
    plain = robot.pixels().astype(int)
    robot.frame(count=2)
    # A note lies over the picture, and the picture can be worked on.
    assert np.abs(robot.pixels() - plain).max() > 50
    robot.drag((0.4, 0.5), (0.55, 0.5))
    robot.rest()
    assert names(robot) == ["Open", "Push"]
    goes_on.set()
    robot.until(lambda: not files.is_loading)
    # What has been done meanwhile is not lost without a word.
    assert robot.editor.canvas.size == (240, 180)
    robot.frame(count=2)
    asked = robot.editor.dialogs.shown[-1]
    assert isinstance(asked, Unsaved)
    robot.click(asked.rect.x + 60, asked.rect.bottom - 36)
    assert robot.editor.canvas.size == (100, 60)
    robot.key("ctrl+z")
    assert names(robot) == ["Open", "Push"]


def test_while_a_file_is_read_the_picture_that_is_only_there_until_then_is_called_a_sample(
    robot: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    goes_on, said, dim = Event(), list[str](), Ui.dim
    monkeypatch.setattr(Ui, "dim", lambda ui, text, *more: said.append(text) or dim(ui, text, *more))

    def load() -> Project:
        assert goes_on.wait(60)
        return load_any(tmp_path / "pattern.png")

    robot.editor.workspace.placeholder = robot.editor.session
    robot.editor.files.read(tmp_path / "pattern.png", load)
    robot.frame()
    assert "The picture below is a sample." in said
    said.clear()
    robot.drag((0.4, 0.5), (0.55, 0.5))  # it is somebody's work now
    robot.frame()
    goes_on.set()
    assert said
    assert "You can go on meanwhile." in said[-40:]
    robot.until(lambda: not robot.editor.files.is_loading)


def test_what_was_read_for_long_is_seen_without_anybody_s_hand(robot: Robot, tmp_path: Path) -> None:
    write_picture(tmp_path / "other.png", pattern(100, 60))
    files, goes_on = robot.editor.files, Event()
    files.read(
        tmp_path / "other.png",
        lambda: load_any(tmp_path / "other.png") if goes_on.wait(60) else robot.editor.session.project,
    )
    robot.frame(count=10)
    assert not robot.editor.wants_frame()
    goes_on.set()
    while files.is_loading:
        robot.frame()
    assert robot.editor.wants_frame()  # this frame had been drawn before


def test_what_is_only_there_until_a_file_has_been_read_is_replaced(robot: Robot, tmp_path: Path) -> None:
    write_picture(tmp_path / "other.png", pattern(100, 60))
    robot.editor.workspace.placeholder = robot.editor.session
    robot.drop(tmp_path / "other.png")
    assert robot.editor.canvas.size == (100, 60)
    assert not robot.editor.workspace.can_undo
    robot.editor.workspace.placeholder = robot.editor.session
    robot.drag((0.4, 0.5), (0.55, 0.5))
    robot.rest()
    robot.drop(tmp_path / "pattern.png")
    robot.click(robot.editor.dialogs.shown[-1].rect.x + 60, robot.editor.dialogs.shown[-1].rect.bottom - 36)
    robot.until(lambda: not robot.editor.files.is_loading)
    assert robot.editor.canvas.size == (240, 180)
    robot.key("ctrl+z")
    assert names(robot) == ["Open", "Push"]


def test_reading_a_file_can_be_given_up(robot: Robot, tmp_path: Path) -> None:
    files, goes_on = robot.editor.files, Event()
    files.read(tmp_path / "pattern.png", lambda: load_any(tmp_path / "pattern.png") if goes_on.wait(60) else None)  # pyright: ignore[reportArgumentType]
    robot.frame(count=2)
    canvas = robot.editor.layout.canvas
    for dx in range(0, 260, 20):
        if files.is_loading:
            robot.click(canvas.x + canvas.width / 2 + dx, canvas.y + 40)
    assert not files.is_loading
    goes_on.set()
    robot.frame(count=5)
    assert not robot.editor.workspace.can_undo


def test_the_forces_of_a_recipe_are_shown(robot: Robot, tmp_path: Path) -> None:
    rotor = """
    picture = "pattern.png"
    duration = 0.2
    [fluid]
    grid = 48
    [[force]]
    kind = "vortex"
    point = [0.3, 0.5]
    radius = 0.15
    strength = 3
    at = 0.0
    [[force]]
    kind = "source"
    point = [0.75, 0.5]
    radius = 0.1
    strength = 1
    during = [0, 0.2]
    """
    (tmp_path / "rotor.toml").write_text(rotor)
    robot.drop(tmp_path / "rotor.toml")
    robot.editor.session.seek(0)
    robot.rest()
    robot.see()
    robot.move(900, 20)
    robot.frame(count=2)
    without = robot.canvas().astype(int)
    robot.key("5")
    robot.frame()
    changed = np.abs(robot.canvas() - without).max(axis=2) > 20
    height, width = changed.shape
    part = {
        "vortex": changed[:, : width // 2].mean(),
        "source": changed[:, width // 2 :].mean(),
        "corner": changed[: height // 8, : width // 8].mean(),
    }
    assert part["vortex"] > 0.02
    assert part["source"] > 0.02
    assert part["corner"] == 0


@pytest.mark.parametrize(("name", "is_seen"), [("forces", True), ("velocity", False)])
def test_what_pushes_a_fluid_at_rest_is_seen_as_forces_and_not_as_its_velocity(
    robot: Robot, name: str, is_seen: bool
) -> None:
    robot.editor.session.edit("A force", force=(VortexForce(kind="vortex", point=(0.5, 0.5), strength=1.0),))
    robot.rest()
    robot.see()
    robot.move(900, 20)
    robot.frame(count=2)
    without = robot.canvas().astype(int)
    robot.editor.state.overlays[name].shown = True
    robot.frame(Move(901.0, 20.0))
    assert (np.abs(robot.canvas() - without).max() > 20) == is_seen


def test_the_time_of_each_stage_is_that_of_one_step(robot: Robot) -> None:
    robot.key("ctrl+i")
    robot.drag((0.4, 0.5), (0.55, 0.5))
    robot.frame(count=3)
    timings, replay, numbers = robot.device.timings, robot.editor.session.replay, Numbers(every=0.0)
    numbers.take(robot.editor.session)
    steps = replay.steps
    robot.editor.session.pause()
    for _ in range(4):
        robot.editor.session.step()
    booked = dict(timings.milliseconds)
    assert {"advect", "diffuse", "project", "warp map"} <= booked.keys()
    shown = numbers.take(robot.editor.session)
    assert replay.steps == steps + 4
    assert shown.stages == {name: spent / 4 for name, spent in booked.items()}
    assert shown.map is not None
    assert shown.map.det_min == pytest.approx(replay.warp.statistics(replay.grid.size).det_min)
    assert shown.divergence == pytest.approx(float(np.abs(replay.fluid.divergence()).max()))
    robot.key("ctrl+i")
    assert not timings.enabled


@pytest.mark.parametrize("feel", ["viscosity", "drag"])
def test_sliders_take_a_typed_number_and_their_default(robot: Robot, feel: str) -> None:
    rect = robot.editor.layout.inspector
    assert rect is not None
    x, y = rect.x + 120, rect.y + {"viscosity": 111, "drag": 147}[feel]
    default = getattr(robot.editor.session.recipe.fluid, feel)

    def value() -> float:
        return getattr(robot.editor.session.recipe.fluid_at(robot.editor.session.tick), feel)

    robot.mods = Mods(ctrl=True)
    robot.click(x, y)
    robot.mods = Mods()
    robot.key("ctrl+a")
    robot.type("1.25")
    robot.frame()
    robot.key("enter")
    robot.frame(count=2)
    assert value() == pytest.approx(1.25)
    robot.frame(count=20)
    for _ in range(2):
        robot.press()
        robot.release()
    robot.frame(count=2)
    assert value() == pytest.approx(default)
    robot.key("ctrl+z")
    assert value() == pytest.approx(1.25)


def type_viscosity(robot: Robot, number: str) -> None:
    """Ctrl+click the viscosity's slider and type a number, without Enter."""
    rect = robot.editor.layout.inspector
    assert rect is not None
    robot.mods = Mods(ctrl=True)
    robot.click(rect.x + 120, rect.y + 111)
    robot.mods = Mods()
    robot.key("ctrl+a")
    robot.type(number)
    robot.frame(count=2)
    assert robot.editor.backend.is_typing


def test_saving_takes_the_number_that_is_being_typed(robot: Robot, tmp_path: Path) -> None:
    path = tmp_path / f"work{projects.SUFFIX}"
    project = robot.editor.session.project
    robot.editor.session.saved(replace(project, path=path))
    type_viscosity(robot, "0.75")
    robot.key("ctrl+s")
    robot.frame(count=3)
    assert load_any(path).recipe.fluid.viscosity == pytest.approx(0.75)
    assert names(robot) == ["Open", "Viscosity"]
    assert not robot.editor.workspace.is_dirty
    assert not robot.editor.backend.is_typing


def test_shortcuts_of_files_work_while_a_number_is_typed_and_undo_stays_the_fields_own(robot: Robot) -> None:
    type_viscosity(robot, "0.75")
    robot.key("ctrl+z")
    robot.frame(count=2)
    assert robot.editor.backend.is_typing
    assert "Viscosity" not in names(robot)
    robot.key("p")
    robot.key("ctrl+e")
    robot.frame(count=3)
    assert isinstance(robot.editor.dialogs.shown[-1], ExportDialog)


# Automatic quality ----------------------------------------------------------------------------------------------------


ENOUGH = PATIENCE + 0.3  # seconds of painting to be judged by


@pytest.fixture
def automatic(device: Device, tmp_path: Path) -> Iterator[Robot]:
    """An editor that has just been opened, and has not measured the machine yet."""
    write_picture(tmp_path / "pattern.png", pattern())
    project = projects.from_picture(tmp_path / "pattern.png", fresh_recipe())
    robot = Robot(device, project, preferences=Preferences(auto_quality=True))
    assert robot.editor.quality.is_measuring
    yield robot
    robot.close()


@pytest.fixture
def measured(automatic: Robot) -> Robot:
    """As if it had measured a machine that is quick enough for any grid."""
    automatic.editor.quality.speed = Speed(fixed=1.0, growing=6.0, drawing=5.0)
    return automatic


def test_the_grid_is_chosen_from_the_machine_measured(automatic: Robot) -> None:
    automatic.until(lambda: not automatic.editor.quality.is_measuring)
    assert automatic.editor.session.recipe.fluid.grid in GRIDS
    assert names(automatic) == ["Open"]
    assert not automatic.editor.workspace.is_dirty


@pytest.mark.parametrize(("fixed", "rate"), [(3.9, 60), (4.1, 30)])
def test_a_machine_that_needs_less_than_four_milliseconds_makes_60_ticks_a_second(
    automatic: Robot, fixed: float, rate: int
) -> None:
    automatic.until(lambda: not automatic.editor.quality.is_measuring)
    quality = automatic.editor.quality
    quality.speed, quality.grid = Speed(fixed=fixed, growing=0.0, drawing=5.0), 96
    quality.turn_on()
    assert automatic.editor.session.recipe.fluid.dt == pytest.approx(1 / rate)
    assert automatic.editor.session.recipe.fluid.grid == 96


def test_a_tick_is_what_it_adds_to_a_frame() -> None:
    speed = Speed.of(fine=40.0, coarse=22.0, drawing=10.0)
    assert speed.drawing + speed.tick(TRIALS[0]) == pytest.approx(40.0)
    assert speed.drawing + speed.tick(TRIALS[1]) == pytest.approx(22.0)


def test_measuring_the_machine_leaves_what_can_be_redone(automatic: Robot) -> None:
    automatic.drag((0.4, 0.5), (0.55, 0.5))
    automatic.key("ctrl+z")
    assert automatic.editor.quality.is_measuring
    automatic.until(lambda: not automatic.editor.quality.is_measuring)
    automatic.key("ctrl+shift+z")
    assert names(automatic) == ["Open", "Push"]
    assert [stroke.tool for stroke in automatic.editor.session.recipe.stroke] == ["push"]


def test_what_is_measured_has_none_of_the_forces_of_the_work(automatic: Robot) -> None:
    """How fast the machine is would depend on them; and one that no map can follow would end it."""
    session, quality = automatic.editor.session, automatic.editor.quality
    force = VortexForce(kind="vortex", point=(0.5, 0.5), radius=0.2, strength=1e6)
    session.edit("A force", force=(force,))
    session.seek(0)
    assert quality.is_measuring
    automatic.until(lambda: not quality.is_measuring)
    assert quality.speed is not None
    assert not [message for message in automatic.editor.messages.shown if "throws the fluid" in message.text]
    assert session.recipe.force == (force,)


def test_what_is_measured_has_nothing_of_the_work_but_its_fluid(
    automatic: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    session, quality, measured = automatic.editor.session, automatic.editor.quality, list[Recipe]()

    def noting(device: Device, recipe: Recipe, *given: Any, **named: Any) -> Replay:
        measured.append(recipe)
        return Replay(device, recipe, *given, **named)

    monkeypatch.setattr("app.ui.quality.Replay", noting)
    session.edit(
        "All there is",
        stroke=(Stroke(tool="twirl", samples=((0, 0.3, 0.5, 1.0), (3, 0.4, 0.5, 1.0))),),
        change=(Change(tick=2, drag=1.0),),
        mask=(mask_edit({"kind": "fill", "tick": 0, "of": "frozen", "amount": 0.5}),),
        force=(VortexForce(kind="vortex", point=(0.5, 0.5), strength=0.1),),
        handle=(RecipeHandle(at=(0.2, 0.2), to=(0.3, 0.2)),),
        pin=(RecipePin(at=(0.7, 0.5)),),
    )
    session.settle()
    automatic.until(lambda: not quality.is_measuring)
    assert [recipe.fluid.grid for recipe in measured] == list(TRIALS)
    for recipe in measured:
        assert [stroke.tool for stroke in recipe.stroke] == ["push"]
        assert (*recipe.change, *recipe.mask, *recipe.force, *recipe.handle, *recipe.pin) == ()


def test_the_machine_is_measured_only_once_nothing_plays_any_more(automatic: Robot) -> None:
    """Which would be measured along: more frames play than measuring takes."""
    session, quality = automatic.editor.session, automatic.editor.quality
    force = VortexForce(kind="vortex", point=(0.5, 0.5), radius=0.2, strength=0.1)
    session.edit("A force", force=(force,), duration=120 * session.dt)
    session.seek(0)
    session.play()
    for _ in range(4 * TICKS):
        automatic.frame()
        assert session.playing
        assert quality.is_measuring
    session.seek(session.tick)
    automatic.until(lambda: not quality.is_measuring)


def test_a_recipe_with_a_force_that_no_map_can_follow_is_told_of_while_the_machine_is_measured(
    automatic: Robot, tmp_path: Path
) -> None:
    force = '[[force]]\nkind = "vortex"\npoint = [0.5, 0.5]\nradius = 0.2\nstrength = 1e6\n'
    (tmp_path / "r.toml").write_text(f'picture = "pattern.png"\n{force}')
    automatic.drop(tmp_path / "r.toml")
    automatic.until(lambda: not automatic.editor.quality.is_measuring)
    assert "throws the fluid" in automatic.editor.messages.shown[-1].text
    assert not automatic.editor.session.is_moving


def paint_at(robot: Robot, dt: float, seconds: float = 2.5) -> None:
    """A stroke on a machine that takes `dt` seconds for a frame."""
    robot.move(*robot.at(0.4, 0.5))
    robot.press()
    count = round(seconds / dt)
    for step in range(count):
        robot.frame(Move(*robot.at(0.4 + 0.1 * step / count, 0.5)), dt=dt)
    robot.release()
    robot.editor.session.settle()


def until_on(robot: Robot, grid: int) -> None:
    """Draw frames until the grid is another one, in none of which the picture goes back."""
    session = robot.editor.session
    tick = session.tick
    assert session.recipe.fluid.grid != grid
    for _ in range(2000):
        robot.frame(dt=0.02)
        assert session.tick == tick
        assert not session.is_rebuilding
        if session.recipe.fluid.grid == grid:
            break
    assert session.replay.grid.nx == session.recipe.fluid.grid == grid
    assert session.document.recipe == session.recipe


def test_slow_painting_is_answered_by_a_coarser_grid_which_is_no_edit(measured: Robot) -> None:
    session = measured.editor.session
    session.begin_with(grid=128)
    measured.drag((0.4, 0.3), (0.5, 0.3))
    measured.editor.session.settle()
    seen = measured.warp()
    paint_at(measured, 0.1, ENOUGH)
    measured.key("ctrl+z")
    until_on(measured, 96)
    assert "below 30 frames a second" in measured.editor.messages.shown[-1].text
    assert names(measured) == ["Open", "Push", "Push"]
    # What is seen is the work on this grid, which is nearly what it was on the other; and it can still be redone.
    warp = measured.warp()
    assert np.abs(warp).max() == pytest.approx(np.abs(seen).max(), rel=0.1)
    session.replay.checkpoints.clear()
    session.replay.seek(0)
    session.replay.seek(session.end)
    assert np.array_equal(measured.warp(), warp)
    measured.key("ctrl+y")
    measured.rest()
    assert len(session.recipe.stroke) == 2
    for _ in range(2):
        measured.key("ctrl+z")
    assert session.recipe.fluid.grid == 96
    assert not measured.editor.workspace.is_dirty


def test_nothing_is_tried_ahead_while_another_grid_is_prepared(
    measured: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each would only take the time of the other."""
    monkeypatch.setattr("app.ui.quality.AT_ONCE", 0.0)  # one tick a frame, however fast the machine is
    quality, rehearsal, frames = measured.editor.quality, measured.editor.rehearsal, 0
    measured.editor.session.begin_with(grid=128)
    paint_at(measured, 0.1, ENOUGH)
    rehearsal.has_news = lambda: False
    measured.until(lambda: quality.is_preparing)
    while quality.is_preparing:
        assert rehearsal.trial is None
        measured.frame()
        frames += 1
    assert frames > 1
    measured.frame()
    assert rehearsal.trial is not None


def test_the_grid_is_finer_again_where_there_is_time(measured: Robot) -> None:
    measured.editor.session.begin_with(grid=128, dt=1 / 60, viscosity=0.3, drag=0.0)  # which halts with the brush
    paint_at(measured, 0.1, ENOUGH)
    until_on(measured, 96)
    paint_at(measured, 1 / 60, ENOUGH)
    until_on(measured, 128)
    assert names(measured) == ["Open", "Push", "Push"]


@pytest.mark.parametrize(
    ("speed", "frame", "finer"),
    [
        (Speed(fixed=1, growing=60, drawing=5), 1 / 60, False),  # the screen may set that pace, and it can do no more
        (Speed(fixed=1, growing=60, drawing=5), 1 / 70, False),
        (Speed(fixed=9, growing=6, drawing=5), 1 / 60, False),
        (Speed(fixed=9, growing=6, drawing=5), 1 / 120, True),  # it was measured while something else was going on
    ],
)
def test_a_grid_is_no_finer_than_60_frames_a_second_allow(
    measured: Robot, speed: Speed, frame: float, finer: bool
) -> None:
    measured.editor.quality.speed = speed
    assert speed.best_grid == 96
    measured.editor.session.begin_with(grid=96, dt=1 / 60, viscosity=0.3, drag=0.0)
    paint_at(measured, frame, 2 * ENOUGH if finer else 1.2 * ENOUGH)  # not every frame has a tick
    if finer:
        until_on(measured, 128)
        return
    assert not measured.editor.session.is_moving  # so another grid, if it was wanted, is prepared at once
    assert not measured.editor.quality.is_preparing
    measured.frame(count=10, dt=0.02)
    assert measured.editor.session.recipe.fluid.grid == 96


def test_a_grid_that_was_chosen_stays(measured: Robot) -> None:
    quality, session = measured.editor.quality, measured.editor.session
    session.begin_with(grid=160)
    session.set_grid(128, "Grid of 128")
    paint_at(measured, 0.1, ENOUGH)
    measured.frame(count=20)
    assert session.recipe.fluid.grid == 128
    assert names(measured)[-2:] == ["Grid of 128", "Push"]
    assert not measured.editor.wants_frame() or measured.editor.clock.settling
    # Until it is left to the machine again.
    quality.grid = 96
    quality.turn_on()
    until_on(measured, 96)


def test_the_grid_of_saved_work_stays(measured: Robot, tmp_path: Path) -> None:
    """What is exported is what the command line makes of the file, also if another grid was about to be taken."""
    session = measured.editor.session
    session.begin_with(grid=128)
    paint_at(measured, 0.1, ENOUGH)
    assert measured.editor.files.save_as(tmp_path / "work.fluidwarp")
    measured.until(lambda: not session.is_moving)
    assert not measured.editor.quality.is_preparing
    measured.frame(count=10, dt=0.02)
    assert session.recipe.fluid.grid == 128


def test_a_grid_that_was_wanted_for_one_picture_is_not_taken_for_the_next(measured: Robot, tmp_path: Path) -> None:
    """Which is opened before the slow painting has been answered."""
    measured.editor.session.begin_with(grid=128)
    paint_at(measured, 0.1, ENOUGH)
    assert measured.editor.quality.is_preparing or measured.editor.session.is_moving
    measured.editor.open(projects.from_picture(tmp_path / "pattern.png", fresh_recipe()))
    grid = measured.editor.session.recipe.fluid.grid
    measured.frame(count=20)
    assert measured.editor.session.recipe.fluid.grid == grid
    assert not measured.editor.messages.shown


def test_the_grid_of_a_project_stays(device: Device, tmp_path: Path) -> None:
    with Robot(device, small_project(tmp_path, 128), preferences=Preferences(auto_quality=True)) as robot:
        paint_at(robot, 0.1, ENOUGH)
        robot.frame(count=20)
        assert robot.editor.session.recipe.fluid.grid == 128


@pytest.mark.parametrize(("each", "is_prepared"), [(0.8, True), (1.1, False)])
def test_a_grid_is_not_prepared_that_would_take_the_machine_longer_than_two_minutes(
    measured: Robot, each: float, is_prepared: bool
) -> None:
    """A machine at rest should rest. `each`: what all ticks take, of two minutes."""
    session, quality = measured.editor.session, measured.editor.quality
    session.begin_with(grid=128)
    measured.move(*measured.at(0.4, 0.5))
    measured.press()
    for step in range(round(ENOUGH / 0.1) + 1):
        measured.frame(Move(*measured.at(0.4 + 0.005 * step, 0.5)), dt=0.1)
        quality.speed = Speed(fixed=each * 1e3 * LONGEST / session.tick, growing=0.0, drawing=5.0)
    assert session.tick > 12
    measured.release()
    session.settle()
    assert quality.is_preparing == is_prepared


def test_a_press_interrupts_what_is_measured_which_begins_anew_then(automatic: Robot) -> None:
    quality, asked = automatic.editor.quality, list[bool]()

    def pressed() -> bool:
        asked.append(len(asked) in (3, 40, 41, 90))
        return asked[-1]

    automatic.editor.rehearsal.has_news = pressed
    automatic.until(lambda: not quality.is_measuring)
    assert sum(asked) == 4
    assert quality.speed is not None
    assert automatic.device.watch is None


def test_for_a_project_the_machine_is_not_measured(automatic: Robot, tmp_path: Path) -> None:
    """Nor is what had begun for a picture gone on with, if that is worked on again."""
    quality = automatic.editor.quality
    automatic.frame(count=12)
    automatic.editor.open(small_project(tmp_path, 64))
    automatic.frame(count=5)
    assert not quality.is_measuring
    assert not automatic.editor.wants_frame()
    automatic.key("ctrl+z")
    assert quality.is_measuring
    automatic.until(lambda: not quality.is_measuring)
    assert quality.speed is not None
    assert quality.speed.growing > 0


# What is lost -------------------------------------------------------------------------------------------------------


def test_what_of_a_file_is_lost_is_told_when_it_is_opened_and_not_again(robot: Robot, tmp_path: Path) -> None:
    from PIL import Image

    Image.fromarray(pattern().pixels).convert("CMYK").save(tmp_path / "ink.tif")
    robot.editor.files.open(tmp_path / "ink.tif")
    robot.until(lambda: not robot.editor.files.is_loading)
    line = f"ink.tif: {INK}"
    assert [message.text for message in robot.editor.messages.shown] == [line]
    robot.editor.messages.shown.clear()
    robot.editor.exports.start(export_dialog(robot, tmp_path).job())
    robot.until(lambda: not robot.editor.exports.is_running)
    assert [message.text for message in robot.editor.messages.shown] == [f"Exported ink warped.png to {tmp_path}"]


def test_what_the_exported_file_does_not_hold_is_told(robot: Robot, tmp_path: Path) -> None:
    light = np.full((48, 64, 3), 2, np.float32)
    write_picture(tmp_path / "light.exr", Picture(light, texts={"owner": "me"}))
    robot.editor.open(projects.from_picture(tmp_path / "light.exr", fresh_recipe()))
    robot.editor.messages.shown.clear()
    dialog = export_dialog(robot, tmp_path)
    dialog.choices.format[PICTURE] = next(n for n, kind in enumerate(KINDS[PICTURE][1]) if kind.name == "PNG")
    robot.editor.exports.start(dialog.job())
    robot.until(lambda: not robot.editor.exports.is_running)
    assert [message.text for message in robot.editor.messages.shown] == [
        f"{dialog.output.name} cuts values above 1; write .exr to keep it",
        f"Exported {dialog.output.name} to {tmp_path}",
    ]


def test_where_a_recipe_s_stop_ends_an_export_is_told(robot: Robot, tmp_path: Path) -> None:
    """The window plays on, and shows another picture than is written."""
    push = VortexForce(kind="vortex", point=(0.5, 0.5), radius=0.2, strength=1.0, at=(0.0,))
    robot.editor.session.edit("A", force=(push,), duration=0.5, stop=Stop(displacement_above=0.001))
    robot.editor.session.seek(robot.editor.session.end)
    robot.rest()
    dialog = export_dialog(robot, tmp_path)
    robot.editor.exports.start(dialog.job())
    robot.until(lambda: not robot.editor.exports.is_running)
    stopped, exported = (message.text for message in robot.editor.messages.shown)
    assert re.fullmatch(
        r"Stopped at t = .* s \(tick \d+\): largest displacement .*\. The recipe's \[stop\] ended it there\.", stopped
    )
    assert exported.startswith("Exported ")


def test_a_grid_far_finer_than_a_picture_is_told_while_that_is_exported(robot: Robot, tmp_path: Path) -> None:
    """It was told with the result, when there was nothing left to stop."""
    push = VortexForce(kind="vortex", point=(0.5, 0.5), radius=0.2, strength=1.0)
    recipe = Recipe(force=(push,), duration=60.0, fluid=FluidSettings(grid=388))
    small = Picture(np.zeros((48, 64, 3), np.uint8))
    robot.editor.exports.start(Job(recipe, small, tmp_path, Outputs(tmp_path / "small.png")))
    robot.until(lambda: bool(robot.editor.messages.shown))
    assert robot.editor.exports.is_running
    (told,) = robot.editor.messages.shown
    assert told.text.startswith("A grid of 388 cells is 6.06 times as fine as the picture of 64 x 48 pixels")
    robot.editor.exports.cancel()


def test_what_an_export_tells_is_shown(robot: Robot, tmp_path: Path) -> None:
    values = np.zeros((180, 240, 2), np.float32)
    values[:, 120:, 0] = -0.1
    write_map(tmp_path / "m.npy", Displacement(values))
    robot.editor.files.start_from_map(tmp_path / "m.npy")
    robot.editor.messages.shown.clear()
    robot.editor.exports.start(export_dialog(robot, tmp_path).job())
    robot.until(lambda: not robot.editor.exports.is_running)
    said = [message.text for message in robot.editor.messages.shown]
    assert any(re.fullmatch(r"The warp folds over itself in \d+ of \d+ places", text) for text in said), said
    assert any(text.startswith(f"{tmp_path}/m.npy folds over itself") for text in said), said


def test_light_without_alpha_is_seen() -> None:
    """A flame of an EXR, soft edges and what shines through beside it."""
    flame = np.zeros((1, 4, 4), np.float32)
    flame[0, 0] = 0.5, 0.25, 0, 0
    flame[0, 1] = 0.0005, 0.0005, 0.0005, 0.001  # the outermost of a soft edge
    flame[0, 2] = 0.25, 0, 0, 0.5
    flame[0, 3] = 4, 0.5, 0, 1
    seen = shown_pixels(Picture(flame, premultiplied=True), 64)[0].tolist()
    assert seen == [[188, 137, 0, 0], [0, 0, 0, 0], [94, 0, 0, 128], [255, 188, 0, 255]]


def test_where_the_graphics_memory_is_full_less_is_kept_and_nothing_lost(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A card with a little room beside what the simulation takes."""
    session, made, most = robot.editor.session, WeakSet[moderngl.Texture](), 2**40

    def taken() -> int:
        living = [texture for texture in made if not isinstance(texture.mglo, moderngl.InvalidObject)]
        return sum(each.width * each.height * each.components * 4 for each in living)

    def limited(ctx: moderngl.Context, size: tuple[int, int], components: int, dtype: str) -> moderngl.Texture:
        texture = new_texture(ctx, size, components, dtype)
        made.add(texture)
        if taken() > most:
            texture.release()
            raise GraphicsMemoryError
        return texture

    def rest() -> None:
        robot.frame()
        while session.is_moving:
            robot.frame()

    monkeypatch.setattr("solver.gl.field.new_texture", limited)
    monkeypatch.setattr("app.work.session.LEAST_BUDGET", 2**12)
    session.replay.checkpoints.budget = 2**21
    session.release_gpu()
    session.wake()
    robot.drag((0.3, 0.3), (0.6, 0.6), steps=4)
    robot.rest()
    session.replay.checkpoints.clear()
    most = taken() + 2**20
    full = "The graphics memory is full: less of the past is kept now, and going back takes longer."
    for number in range(20):
        robot.drag((0.7, 0.3), (0.2 + number / 40, 0.8), steps=4)
        rest()
        if full in [message.text for message in robot.editor.messages.shown]:
            break
    else:
        pytest.fail("its memory was never full")
    rest()
    assert len(session.document.recipe.stroke) == number + 2
    assert session.recipe == session.document.recipe
    found = robot.warp()
    most = 2**40
    session.release_gpu()
    session.wake()
    robot.rest()
    assert np.array_equal(robot.warp(), found)


def test_where_the_graphics_memory_holds_no_past_at_all_the_cells_become_fewer(robot: Robot) -> None:
    session = robot.editor.session
    robot.drag((0.3, 0.3), (0.6, 0.6), steps=4)
    robot.rest()
    session.set_grid(64)
    robot.rest()
    done, strokes, said = session.document.history.undo_name, session.recipe.stroke, ""
    for _ in range(9):
        if "cells" in (said := session.make_room()):
            break
    assert said == "The graphics memory is full: the simulation goes on with 32 cells."
    robot.rest()
    assert session.replay.grid.nx == session.recipe.fluid.grid == session.document.recipe.fluid.grid == 32
    assert (session.document.history.undo_name, session.recipe.stroke) == (done, strokes)
    assert np.abs(robot.warp()).max() > 0.01
    with pytest.raises(MemoryError):
        session.make_room()

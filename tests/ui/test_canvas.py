"""What the canvas draws, texel by texel: edges, the split, and the squares under what is transparent."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any, Literal

import moderngl
import numpy as np
import pytest

from app.media.pictures import read_picture, write_picture
from app.media.project import from_picture
from app.model.forces import PointForce
from app.model.mask_edits import MaskStroke
from app.model.picture import Picture, srgb_to_linear
from app.model.recipe import FluidSettings, Recipe
from app.model.strokes import Stroke
from app.progress import Progress
from app.ui.canvas import EDGES, Canvas, largest_shown, shown_pixels
from app.ui.editor_state import EditorState
from app.ui.theme import PALETTES
from app.ui.viewport import Rect, Viewport
from app.ui.widgets import Ui
from app.work.export import run
from app.work.session import Session
from solver.gl.device import Device
from support.editing import Robot, export_dialog, pattern, small_project
from support.golden import Golden, told

SIDE = 4


def drawn(device: Device, picture: np.ndarray, shift: float = 0.0, around: int = 0, **inputs: Any) -> np.ndarray:
    """The canvas over a square picture, a pixel to a texel, `shift` to the left, with so many pixels `around`.

    Names in capitals are defines.
    """
    defines = {name: value for name, value in inputs.items() if name.isupper()}
    inputs = {name: value for name, value in inputs.items() if name not in defines}
    side = SIDE + 2 * around
    target, displacement = device.field((side, side), 4), np.full((1, 1, 2), (shift, 0.0))
    device.pass_("view/canvas.frag", **defines)(
        target,
        picture=device.upload(picture),
        displacement=device.upload(displacement),
        shown=(0.0, 0.0, 1.0, 1.0),
        extent=(1.0, 1.0),
        origin=(float(around), float(around)),
        step=(1 / SIDE, 1 / SIDE),
        target_height=float(side),
        **inputs,
    )
    return target.get()[::-1, :, :3]


@pytest.fixture
def picture() -> np.ndarray:
    return np.random.default_rng(3).uniform(0, 1, (SIDE, SIDE, 4)).astype(np.float32)


@pytest.mark.parametrize(
    ("edges", "how"),
    [("transparent", "constant"), ("black", "constant"), ("clamp", "edge"), ("mirror", "symmetric"), ("wrap", "wrap")],
)
def test_beyond_the_picture_is_what_was_asked_for(
    device: Device, picture: np.ndarray, edges: str, how: Literal["constant", "edge", "symmetric", "wrap"]
) -> None:
    found = drawn(device, picture, around=3, EDGES=EDGES[edges])
    np.testing.assert_allclose(found, np.pad(picture[..., :3], ((3, 3), (3, 3), (0, 0)), how), atol=1e-6)


def test_right_of_the_split_the_picture_is_warped(device: Device, picture: np.ndarray) -> None:
    found = drawn(device, picture, 1 / SIDE, SPLIT=1, split=0.5)
    np.testing.assert_allclose(found, picture[:, [0, 1, 3, 3], :3], atol=1e-6)


def test_squares_shine_through_as_far_as_the_picture_is_transparent(device: Device, picture: np.ndarray) -> None:
    found = drawn(device, picture, CHECKER=1, light=(0.9, 0.8, 0.7), dark=(0.3, 0.2, 0.1), tile=2.0)
    light = np.kron([[0, 1], [1, 0]], np.ones((2, 2), bool))[..., None]  # the lowest square on the left is light
    squares = np.where(light, np.array([0.9, 0.8, 0.7]), np.array([0.3, 0.2, 0.1]))
    np.testing.assert_allclose(found, picture[..., :3] + (1 - picture[..., 3:]) * squares, atol=1e-6)


@pytest.mark.parametrize(
    ("edges", "how", "alpha"),
    [("transparent", "constant", 0.0), ("black", "constant", 1.0), ("clamp", "edge", None),
     ("mirror", "symmetric", None), ("wrap", "wrap", None)],
)  # fmt: skip
def test_beyond_the_picture_squares_shine_through_as_far_as_that_is_transparent(
    device: Device,
    picture: np.ndarray,
    edges: str,
    how: Literal["constant", "edge", "symmetric", "wrap"],
    alpha: float | None,
) -> None:
    colour, around = (0.9, 0.8, 0.7), ((3, 3), (3, 3), (0, 0))
    found = drawn(device, picture, around=3, EDGES=EDGES[edges], CHECKER=1, light=colour, dark=colour, tile=2.0)
    wanted = np.pad(picture, around, how)
    if alpha is not None:
        wanted[..., 3] = np.pad(picture[..., 3], around[:2], constant_values=alpha)
    np.testing.assert_allclose(found, wanted[..., :3] + (1 - wanted[..., 3:]) * colour, atol=1e-6)


@pytest.fixture(scope="module")
def golden(shared_device: Device) -> Iterator[Golden]:
    with Golden.of_software(shared_device, "canvas.txt") as golden:
        yield golden


@pytest.mark.parametrize("name", ["grid", "room", "selected"])
def test_overlays_are_drawn_as_it_is_written_down(device: Device, name: str, golden: Golden) -> None:
    """Over part of the picture, at two zooms."""
    rng, (y, x) = np.random.default_rng(4), np.mgrid[0:24, 0:32] / 32
    waves = np.stack([np.sin(7 * x + 3 * y), np.cos(5 * x - 6 * y)], axis=-1)
    half = (waves[..., :1] > 0.3).astype(np.float32)
    given: dict[str, dict[str, Any]] = {
        "grid": {"GRID": 1, "grid": 12.0, "grid_opacity": 0.8, "pixel": 1.5},
        "room": {"ROOM": 1, "room": waves[..., 0] * half[..., 0], "room_opacity": 0.7},
        "selected": {"SELECTED": 1, "selected": half, "dash": 7.0, "dash_width": 1.5},
    }  # fmt: skip
    inputs: dict[str, Any] = given[name]
    inputs = {key: device.upload(value) if isinstance(value, np.ndarray) else value for key, value in inputs.items()}
    defines = {key: value for key, value in inputs.items() if key.isupper()}
    draw, target = device.pass_("view/canvas.frag", EDGES=2, **defines), device.field((160, 120), 4)
    picture = device.upload(rng.uniform(0, 1, (24, 32, 4)))
    for zoom in (1.0, 2.3):
        target.clear()
        draw.draw_into(
            target.framebuffer,
            ("displacement", "room"),
            picture=picture,
            displacement=device.upload(0.05 * waves),
            shown=(0.0, 0.0, 1.0, 1.0),
            extent=(1.0, 0.75),
            origin=(-20.0, 13.0),
            step=(1 / (150 * zoom), 1 / (112 * zoom)),
            target_height=120.0,
            **{key: value for key, value in inputs.items() if key not in defines},
        )
        golden.compare(f"{name} {zoom}", told(target.get()[..., :3]))


@pytest.mark.parametrize("split", [None, 0.4])
def test_arrows_are_drawn_as_it_is_written_down(device: Device, split: float | None, golden: Golden) -> None:
    """Over part of the picture, on what is there: those of what does not flow are not to be seen."""
    y, x = np.mgrid[0:24, 0:32] / 32
    waves = np.stack([np.sin(7 * x + 3 * y), np.cos(5 * x - 6 * y)], axis=-1) * (x > 0.3)[..., None]
    target = device.field((160, 120), 4)
    target.clear(0.2, 0.5, 0.7, 1.0)
    arrows = device.pass_("view/arrows.frag", **({} if split is None else {"SPLIT": 1}))
    inputs: dict[str, Any] = {"field": device.upload(0.3 * waves), "window": (0.1, 0.2, 0.7, 0.6), "most": 0.4}
    inputs |= {"side": 21.0, "first": (-1.0, -1.0), "across": 9.0, "viewport": (0.0, 0.0, 160.0, 120.0)}
    inputs |= {"origin": (-20.0, 13.0), "step": (1 / 150, 1 / 112), "target_height": 120.0}
    inputs |= {"colour": (1.0, 0.9, 0.8), "opacity": 0.8} | ({} if split is None else {"split": split})
    arrows.draw_into(target.framebuffer, ("field",), "over", (0, 6 * 9 * 7), **inputs)
    found = target.get()
    np.testing.assert_allclose(found[..., 3], 1.0, atol=1e-6)
    assert (found[:, :10, 0] == np.float32(0.2)).all()
    golden.compare(f"arrows {split}", told(found[..., :3]))


@pytest.mark.parametrize("name", ["viscosity", "frozen"])
def test_masks_are_drawn_as_it_is_written_down(device: Device, name: str, golden: Golden) -> None:
    """Over part of the picture, at two zooms, premultiplied."""
    y, x = np.mgrid[0:24, 0:32] / 32
    waves = np.stack([np.sin(7 * x + 3 * y), np.cos(5 * x - 6 * y)], axis=-1)
    given: dict[str, dict[str, Any]] = {
        "viscosity": {
            "viscosity": device.upload(10 ** (waves[..., 0] - 2)), "base": 0.02, "contour": 1.5,
            "thickness": device.upload(0.375 + 0.2 * waves[..., 1]), "window": (0.1, 0.2, 0.7, 0.6),
            "viscosity_opacity": 0.7,
        },
        "frozen": {"frozen": device.upload(waves[..., 0] > 0.3), "frozen_opacity": 0.6, "hatch": 9.0, "first": 4.0},
    }  # fmt: skip
    masks, target = device.pass_("view/masks.frag", **{name.upper(): 1}), device.field((160, 120), 4)
    for zoom in (1.0, 2.3):
        place = {"origin": (-20.0, 13.0), "step": (1 / (150 * zoom), 1 / (112 * zoom)), "target_height": 120.0}
        masks.draw_into(target.framebuffer, ("viscosity", "thickness", "frozen"), **place, **given[name])
        found = target.get()
        assert (found[..., :3] <= found[..., 3:] + 1e-6).all()
        golden.compare(f"{name} {zoom}", told(found))


def test_masks_lie_over_the_picture_by_their_part(device: Device, picture: np.ndarray) -> None:
    masks = np.random.default_rng(5).uniform(0, 0.5, (SIDE, SIDE, 4)).astype(np.float32)
    found = drawn(device, picture, MASKS=1, masks=device.upload(masks), corner=(0.0, 0.0))
    over = masks[::-1]
    np.testing.assert_allclose(found, (1 - over[..., 3:]) * picture[..., :3] + over[..., :3], atol=1e-6)


@pytest.mark.parametrize(("across", "down"), [(4, 1), (1, 4), (4, 2), (2, 4)])
def test_a_pixel_at_rest_is_the_mean_of_what_is_under_it_along_each_side(
    device: Device, across: int, down: int
) -> None:
    """Of as many texels across and down: in light, and of none that lie beside it."""
    columns, rows = SIDE * across, SIDE * down
    code = np.random.default_rng(4).uniform(0, 1, (rows, columns, 4)).astype(np.float32)
    code[..., 3] = 1
    target, still = device.field((SIDE, SIDE), 4), device.upload(np.zeros((1, 1, 2), np.float32))
    device.pass_("view/picture.frag", EDGES=EDGES["clamp"])(
        target,
        picture=device.upload(code),
        displacement=still,
        shown=(0.0, 0.0, 1.0, 1.0),
        extent=(1.0, 1.0),
        origin=(0.0, 0.0),
        step=(1 / SIDE, 1 / SIDE),
        spacing=(1 / columns, 1 / rows),
        level=0.0,
        target_height=float(SIDE),
    )
    light = srgb_to_linear(code[..., :3]).reshape(SIDE, down, SIDE, across, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(srgb_to_linear(target.get()[::-1, :, :3]), light, atol=2e-3)


@pytest.mark.parametrize("pan", [(0.0, 0.0), (0.3, 0.5), (-7.5, 2.2)])
def test_at_100_percent_a_pixel_of_the_picture_is_one_of_the_screen(robot: Robot, pan: tuple[float, float]) -> None:
    editor = robot.editor
    editor.workspace.view = editor.view.zoomed(1.0, *editor.view.canvas.middle).panned(*pan)
    robot.see()
    rect, pixels = editor.view.drawn, pattern().pixels
    left, top, (height, width) = round(rect.x), round(rect.y), pixels.shape[:2]
    seen = robot.pixels()[top : top + height, left : left + width]
    assert np.abs(seen.astype(int) - pixels[..., :3]).max() <= 1


def test_of_values_that_are_moved_is_seen_what_is_exported_and_before_and_left_of_the_split_what_was_there(
    device: Device, tmp_path: Path
) -> None:
    project = small_project(tmp_path)
    with Robot(device, replace(project, recipe=project.recipe.edited(mode="density")), sees=True) as robot:
        editor, before = robot.editor, pattern().pixels.astype(int)
        robot.drag((0.3, 0.5), (0.7, 0.45))
        robot.rest()
        robot.key("ctrl+1")
        robot.move(700, 20)
        left, top = round(editor.view.drawn.x), round(editor.view.drawn.y)

        def seen() -> np.ndarray:
            robot.frame(count=2)
            return robot.pixels()[top : top + 180, left : left + 240].astype(int)

        job = export_dialog(robot, tmp_path).job()
        run(device, job, Progress())
        exported, moved = read_picture(job.target).pixels[..., :3].astype(int), seen()
        assert np.abs(moved - exported).max() <= 1
        assert np.abs(moved - before)[60:120, 60:180].mean() > 10
        robot.hold("\\", True)
        assert np.abs(seen() - before).max() <= 1
        robot.hold("\\", False)
        editor.state.split = 0.5
        split = seen()
        left_of, right_of = np.s_[40:, :104], np.s_[40:, 136:]  # below what it is called, and beside its handle
        assert np.abs(split - before)[left_of].max() <= 1
        assert np.abs(split - exported)[right_of].max() <= 1
        assert all(np.abs(exported - before)[side].max() > 50 for side in (left_of, right_of))


def test_whatever_was_drawn_before_is_not_seen(device: Device, tmp_path: Path) -> None:
    """A canvas that draws one thing after the other, beside one that is made for each; thumbnails as well."""
    dice, size = Random("canvas"), (160, 120)
    write_picture(tmp_path / "pattern.png", pattern(120, 90))
    frames = [shown_pixels(pattern(120, 90).with_pixels(pattern(120, 90).pixels // k), 400) for k in (1, 2, 3)]
    recipe = Recipe(
        fluid=FluidSettings(grid=24, viscosity=0.02),
        duration=1.0,
        stroke=(Stroke(tool="push", samples=((0, 0.3, 0.5, 1.0), (9, 0.6, 0.5, 1.0))),),
        mask=(MaskStroke(kind="stroke", tool="freeze", radius=0.2, samples=((0, 0.8, 0.2, 1.0),)),),
        force=(PointForce(kind="point", point=(0.2, 0.7), direction=(1.0, 0.0), radius=0.2, at=(0.2,)),),
    )
    project, state = from_picture(tmp_path / "pattern.png", recipe), EditorState()
    session, pixels, palette = Session(device, project), frames[0], PALETTES["dark"]
    view, scale = Viewport(Rect(10, 8, 140, 104), (120, 90)), 1.0
    canvas, ground = Canvas(device, project), (0.3, 0.6, 0.9, 1.0)
    targets = [device.ctx.framebuffer([device.ctx.texture(size, 4)]) for _ in range(2)]

    def seen(by: Canvas, target: moderngl.Framebuffer) -> tuple[bytes, bytes]:
        target.clear(*ground)
        target.viewport = (0, 0, *size)
        by.draw(target, size[1], view, session, state, palette, scale)
        while by.is_unfinished:
            by.draw(target, size[1], view, session, state, palette, scale)
        assert target.viewport == (0, 0, *size)
        by.thumbnails.take(1, session)
        small = by.thumbnails.of(1)
        assert small is not None
        return target.read(components=4, alignment=1), small.read()

    try:
        for step in range(28):
            middle = view.canvas.middle
            match what := dice.choice(("view", "view", "view", "time", "frame", "state", "state", "edit", "selected")):
                case "view":
                    view = dice.choice((view.fitted(), *(view.zoomed(zoom, *middle) for zoom in (0.3, 0.6, 2.5, 7.0))))
                    view = view.panned(dice.choice((0.0, 0.0, 30.5)), dice.choice((0.0, 0.0, -20.0, 400.0)))
                    palette, scale = PALETTES[dice.choice(sorted(PALETTES))], dice.choice((1.0, 1.5))
                case "time":
                    session.seek(dice.choice((0, 4, 15, 30)))
                    session.settle()
                    session.pause()
                case "frame":
                    canvas.show(pixels := dice.choice(frames))
                case "state":
                    state.toggle_overlay(dice.choice(sorted(state.overlays)))
                    state.overlays[dice.choice(sorted(state.overlays))].opacity = dice.choice((0.4, 0.9))
                    state.split = dice.choice((None, None, 0.4, 0.7))
                    state.before, state.is_scaling = dice.random() < 0.15, dice.random() < 0.3
                    state.tool_name = dice.choice(("push", "select", "freeze", "thicken"))
                case "edit":
                    session.edit("Edges", edges=dice.choice(("transparent", "clamp")))
                    session.settle()
                case "selected":
                    area = np.zeros((9, 12), np.uint8)
                    area[dice.randint(0, 6) :, dice.randint(0, 9) :] = 255
                    state.selected_area = dice.choice((area, None))
            fresh = Canvas(device, project, pixels)
            try:
                found, wanted = seen(canvas, targets[0]), seen(fresh, targets[1])
            finally:
                fresh.release()
            assert [one == other for one, other in zip(found, wanted, strict=True)] == [True, True], (step, what)
            beside = np.frombuffer(found[0], np.uint8).reshape(size[1], size[0], 4).copy()
            beside[8:112, 10:150] = np.round(np.multiply(ground, 255))
            assert (beside == np.round(np.multiply(ground, 255))).all(), (step, what)
    finally:
        canvas.release()
        session.release_gpu()
        for target in targets:
            target.color_attachments[0].release()
            target.release()


def test_a_picture_is_shown_with_all_its_pixels_and_what_is_larger_tells(
    device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    project = small_project(tmp_path)
    wide = replace(project, picture=Picture(np.zeros((6, 4200, 3), np.uint8)))
    assert largest_shown(wide, 2**14) >= 6000  # of a camera of 24 megapixels
    assert largest_shown(wide, 2**12) == 2**12
    canvas = Canvas(device, wide)
    assert canvas.reduction == 1
    canvas.release()
    monkeypatch.setattr("app.ui.canvas.LARGEST", 120)
    told: list[str] = []
    monkeypatch.setattr(Ui, "dim", lambda _, words, *more: told.append(words))
    with Robot(device, project) as robot:
        robot.editor.state.sections["quality"] = True
        robot.frame()
        assert robot.editor.canvas.reduction == 2
    assert "Shown at 1/2 of that; an export has all." in told


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("size", [(9, 12), (1, 12), (12, 2), (10, 13)])
def test_a_reduced_picture_has_the_means_of_its_pixels_however_narrow_it_is(
    size: tuple[int, int], dtype: type[np.unsignedinteger]
) -> None:
    pixels = np.random.default_rng(5).integers(0, np.iinfo(dtype).max, (*size, 3), dtype, endpoint=True)
    found = shown_pixels(Picture(pixels), 5)
    down, across = (min(3, side) for side in size)
    whole = pixels[: size[0] // down * down, : size[1] // across * across].astype(float)
    means = [
        [whole[y : y + down, x : x + across].mean(axis=(0, 1)) for x in range(0, whole.shape[1], across)]
        for y in range(0, whole.shape[0], down)
    ]
    np.testing.assert_allclose(found[..., :3], np.array(means) * (255 / np.iinfo(dtype).max), atol=1.01)
    assert (found[..., 3] == 255).all()

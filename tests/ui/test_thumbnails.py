"""The history's small pictures, and the times beside them."""

from __future__ import annotations

import moderngl
import numpy as np
from PIL import Image

from app.ui.thumbnails import LONGER, MOST, Thumbnails
from solver.gl.device import Device
from support.editing import Robot


def pixels(texture: moderngl.Texture | None) -> np.ndarray:
    assert texture is not None
    width, height = texture.size
    return np.frombuffer(texture.read(), np.uint8).reshape(height, width, 4)[::-1, :, :3].astype(int)


def small(canvas: np.ndarray, like: np.ndarray) -> np.ndarray:
    size = like.shape[1], like.shape[0]
    return np.asarray(Image.fromarray(canvas).resize(size, Image.Resampling.BOX)).astype(int)


def test_each_state_is_small_what_was_seen(robot: Robot) -> None:
    history, thumbnails = robot.editor.session.document.history, robot.editor.canvas.thumbnails
    robot.drag((0.3, 0.5), (0.6, 0.5))
    robot.rest()
    robot.drag((0.5, 0.2), (0.5, 0.7))
    robot.rest()
    robot.see()
    pictures = [pixels(thumbnails.of(entry.number)) for entry in history.entries]
    assert pictures[0].shape == (60, LONGER, 3)
    rect = robot.editor.view.rect
    y, x = round(rect.y), round(rect.x)
    for number, picture in enumerate(pictures):
        robot.editor.session.go_to(number)
        robot.rest()
        robot.move(5, 5)
        robot.frame(count=2)
        seen = robot.pixels()[y : y + round(rect.height), x : x + round(rect.width)]
        # The hint and the zoom lie over the last rows.
        near = np.abs(small(seen, picture) - picture)[:50].mean()
        others = [np.abs(small(seen, picture) - other)[:50].mean() for other in pictures]
        assert near == min(others)
        assert near < 12
    assert np.abs(pictures[1] - pictures[0]).mean() > 3


def test_what_is_pressed_together_is_averaged_as_on_the_canvas(robot: Robot) -> None:
    session, thumbnails = robot.editor.session, robot.editor.canvas.thumbnails
    y, x = np.mgrid[0:180, 0:240] / 240
    moved = 0.35 * np.tanh((x + 0.1 * np.sin(7 * y) - 0.5) / 0.09)
    session.replay.warp.set(np.stack([moved, 0 * y], axis=-1).astype(np.float32))
    robot.see()
    thumbnails.take(0, session)
    picture = pixels(thumbnails.of(0))
    rect = robot.editor.view.rect
    y0, x0 = round(rect.y), round(rect.x)
    seen = robot.pixels()[y0 : y0 + round(rect.height), x0 : x0 + round(rect.width)]
    assert np.abs(small(seen, picture) - picture)[:50].mean() < 6.5  # 7.7 by one place a pixel


def test_what_is_made_after_undo_has_a_picture_of_its_own(robot: Robot) -> None:
    history, thumbnails = robot.editor.session.document.history, robot.editor.canvas.thumbnails
    robot.drag((0.3, 0.5), (0.6, 0.5))
    robot.rest()
    first, before = history.entries[-1].number, pixels(thumbnails.of(history.entries[-1].number))
    robot.key("ctrl+z")
    robot.rest()
    robot.drag((0.5, 0.2), (0.5, 0.7))
    robot.rest()
    assert len(history.entries) == 2
    assert history.entries[-1].number == first + 1
    assert np.abs(pixels(thumbnails.of(first + 1)) - before).mean() > 3
    assert thumbnails.when(first + 1) is not None
    assert thumbnails.when(0) is None


def test_they_are_bounded(device: Device, robot: Robot) -> None:
    drawn: list[moderngl.Framebuffer] = []
    thumbnails = Thumbnails(device, (10_000, 30), lambda target, session: drawn.append(target))
    session, held = robot.editor.session, device.ctx
    for number in range(MOST + 5):
        session.edit("Edges of the picture", edges=("mirror", "wrap")[number % 2])
        thumbnails.look(session)
        thumbnails.look(session)
    assert len(drawn) == MOST + 5, "one for each step"
    kept = [thumbnails.of(number) for number in range(1, MOST + 6)]
    assert sum(texture is not None for texture in kept) == MOST
    assert kept[:5] == [None] * 5
    assert all(texture.size == (LONGER, 1) for texture in kept if texture)
    thumbnails.release()
    assert held.error == "GL_NO_ERROR"


def test_no_picture_is_made_while_one_paints(robot: Robot) -> None:
    """The frame of a stroke has better things to do."""
    made: list[int] = []
    thumbnails = robot.editor.canvas.thumbnails
    take = thumbnails.take
    thumbnails.take = lambda number, session: (made.append(number), take(number, session))[1]
    robot.move(*robot.at(0.3, 0.5))
    robot.press()
    for step in range(6):
        robot.move(*robot.at(0.3 + 0.03 * step, 0.5))
    assert made == []
    robot.release()
    robot.rest()
    assert made == [1, 1], "when the step ends, and when all is at rest"

"""What the canvas draws, texel by texel: edges, the split, and the squares under what is transparent."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import pytest

from app.ui.canvas import EDGES
from solver.gl.device import Device

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

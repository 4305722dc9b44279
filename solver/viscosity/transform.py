"""One viscosity between free-slip walls, solved by sine and cosine transforms (fast diagonalization)."""

from __future__ import annotations

from typing import Any

import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.passes import Pass
from solver.packing import packed

Faces = tuple[Field, Field]  # of u and of v


class SineCosineTransform:
    """Solves the viscous step for one viscosity in a box with free-slip walls.

    There sines along the normal and cosines across it carry u and v, and the step couples u and v of one mode only:
    four products with small matrices, and 2 x 2 equations between them.

    Args:
        device: the device.
        box: (nx, ny) cells between the walls.
        texels: of the packed faces, without their ring (see shaders/viscosity/operator.glsl).
    """

    def __init__(self, device: Device, box: tuple[int, int], texels: tuple[int, int]) -> None:
        self.device = device
        self._region = (1, 1, *texels)
        self._box = box
        across, down = (_sines_and_cosines(*lengths) for lengths in zip(box, texels, strict=True))
        # Of u and of v: across, down, and back again.
        products = (across[0], across[1]), (down[1], down[0]), (down[1].T, down[0]), (across[0], across[1].T)
        self._matrices = [
            (device.upload(packed(u), "transform of u"), device.upload(packed(v), "transform of v"))
            for u, v in products
        ]
        ringed = texels[0] + 2, texels[1] + 2
        self._half, self._spectrum = (
            (device.field(ringed, 4, f"viscous {name} u"), device.field(ringed, 4, f"viscous {name} v"))
            for name in ("halfway", "spectrum")
        )

    def solve(self, rhs: Faces, faces: Faces, stiffness: tuple[float, float]) -> None:
        """The `faces` that the step makes of `rhs`, packed faces (u, v) both.

        `stiffness`: square roots of dt mu / hx^2 and of dt mu / hy^2.
        """
        across = self.device.pass_("viscosity/transform.frag")
        down = self.device.pass_("viscosity/transform.frag", DOWN=1)
        solved = self.device.pass_("viscosity/transform.frag", DOWN=1, SOLVE=1)
        there, there_down, back_down, back = self._matrices
        self._draw(across, self._half, rhs, there)
        self._draw(solved, self._spectrum, self._half, there_down, stiffness=stiffness, box=self._box)
        self._draw(down, self._half, self._spectrum, back_down)
        self._draw(across, faces, self._half, back)

    def _draw(self, pass_: Pass, target: Faces, source: Faces, matrices: Faces, **inputs: Any) -> None:
        u, v = source
        pass_(target, region=self._region, u=u, v=v, matrix_u=matrices[0], matrix_v=matrices[1], **inputs)

    def release(self) -> None:
        """Free the textures."""
        for pair in (*self._matrices, self._half, self._spectrum):
            for field in pair:
                field.release()


def _sines_and_cosines(count: int, texels: int) -> tuple[np.ndarray, np.ndarray]:
    """The orthonormal DST and DCT: rows of sines at `count` left faces and of cosines at centres, zero-padded."""
    mode, place = np.arange(count)[:, None], np.arange(count)
    sines = np.sqrt(2.0 / count) * np.sin(np.pi * mode * place / count)
    cosines = np.sqrt(2.0 / count) * np.cos(np.pi * mode * (place + 0.5) / count)
    cosines[0] = np.sqrt(1.0 / count)
    padding = (0, 2 * texels - count)
    return np.pad(sines, padding), np.pad(cosines, padding)

"""The images of a brush, by symmetry, as uniforms."""

from __future__ import annotations

from collections.abc import Sequence

MOST_IMAGES = 16  # itself among them; `shaders/lib/images.glsl` has it too


def for_images(values: Sequence[tuple[float, ...]]) -> tuple[tuple[float, ...], ...]:
    """What each image has, as a uniform for `MOST_IMAGES` of them."""
    return (*values, *[(0.0,) * len(values[0])] * (MOST_IMAGES - len(values)))

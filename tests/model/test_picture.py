"""Curves and alpha of a picture, to the code."""

from __future__ import annotations

import numpy as np
import pytest

from app.model.picture import linear_to_srgb, srgb_to_linear, unpremultiplied


def test_straight_codes_are_the_nearest() -> None:
    alpha, colour = np.meshgrid(np.arange(1, 256), np.arange(256))
    code = np.minimum(colour, alpha)
    pixels = np.stack([code, code, code, alpha], axis=-1).astype(np.uint8)
    exact = code * 255 / alpha
    found = unpremultiplied(pixels)[..., 0]
    assert np.abs(found - exact).max() <= 0.5 + 1e-4


def test_the_curve_of_srgb_and_back() -> None:
    codes = np.linspace(0, 1, 4096)
    np.testing.assert_allclose(linear_to_srgb(srgb_to_linear(codes)), codes, atol=1e-7)
    assert srgb_to_linear(np.array([0.03, 0.5])) == pytest.approx([0.03 / 12.92, 0.21404114], rel=1e-6)

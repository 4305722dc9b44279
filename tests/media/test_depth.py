"""Depths of pixels, to the code."""

from __future__ import annotations

import numpy as np
import pytest

from app.media.depth import as_half, mixed, over, to_bits


def test_of_floats_each_depth_is_the_nearest_and_alpha_is_not_curved() -> None:
    light = np.array([[(0.2, 0.5, 4.0, 0.5), (0.0031308, np.nan, -1.0, 2.0)]], np.float32)
    half, black = 0.7353570, 12.92 * 0.0031308
    wanted = np.array([[(0.4845292, half, 1, 0.5), (black, 0, 0, 1)]])
    assert np.array_equal(to_bits(light, 16), np.floor(wanted * 65535 + 0.5))
    assert np.array_equal(to_bits(light, 8, dither=False), np.floor(wanted * 255 + 0.5))
    back = to_bits(np.array([[(128, 51)]], np.uint8), 32)
    np.testing.assert_allclose(back, [[(0.2158605, 0.2)]], atol=1e-6)
    np.testing.assert_allclose(to_bits(np.full((1, 1, 3), 32896, np.uint16), 32), 0.2158605, atol=1e-6)


def test_noise_before_eight_bits_keeps_the_mean_and_is_the_same_each_time() -> None:
    fine = np.full((400, 400, 1), 100 * 257 + 64, np.uint16)  # a quarter above 100
    coarse = to_bits(fine, 8)
    assert set(np.unique(coarse)) == {100, 101}
    assert coarse.mean() == pytest.approx(100 + 64 / 257, abs=5e-3)
    assert np.array_equal(coarse, to_bits(fine, 8))
    assert (to_bits(fine, 8, dither=False) == 100).all()
    assert (to_bits(np.full((50, 50, 1), 65535, np.uint16), 8) == 255).all()


def test_laid_over_a_colour_alpha_mixes_the_values() -> None:
    found = over(np.array([[(203, 100, 0, 51), (200, 100, 0, 0), (200, 100, 0, 255)]], np.uint8), (10, 20, 30))
    assert found.tolist() == [[[49, 36, 24], [10, 20, 30], [200, 100, 0]]]
    assert over(np.array([[(200, 51)]], np.uint8), (10, 20, 30)).tolist() == [[[56]]]


def test_half_floats_stay_finite_where_they_were() -> None:
    found = as_half(np.array([1e9, -1e9, 0.1, np.inf, -np.inf, np.nan], np.float32))
    np.testing.assert_array_equal(found, np.array([65504, -65504, 0.1, np.inf, -np.inf, np.nan], np.float16))


def test_a_picture_dissolves_in_light_and_by_its_alpha() -> None:
    dark, bright = (np.full((3, 2, 3), value, np.uint16) for value in (0, 65535))
    assert (mixed(dark, bright, 0.25) == 35199).all()  # the code of a quarter of the light
    assert (mixed(bright, dark, 0.75) == 35199).all()
    clear, red = np.array([[[0.0, 9.0, 0.0, 0.0]]], np.float32), np.array([[[1.0, 0.0, 0.0, 0.5]]], np.float32)
    np.testing.assert_allclose(mixed(clear, red, 0.2), [[[1.0, 0.0, 0.0, 0.1]]], atol=1e-6)
    np.testing.assert_allclose(mixed(red, clear, 0.2), [[[1.0, 0.0, 0.0, 0.4]]], atol=1e-6)
    np.testing.assert_allclose(mixed(red, red[:, ::-1], 0.7), red, atol=1e-6)
    np.testing.assert_allclose(mixed(red, clear, 0.5, premultiplied=True), [[[0.5, 4.5, 0.0, 0.25]]], atol=1e-6)
    assert not mixed(clear, clear, 0.5)[..., 3].any()

"""Curves and alpha of a picture, to the code."""

from __future__ import annotations

import numpy as np
import pytest

from app.model.picture import Layer, Picture, linear_to_srgb, srgb_to_linear, unpremultiplied


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


def test_the_curve_of_srgb_is_straight_near_black() -> None:
    light = np.array([0.0, 0.001, 0.003, 0.0032, 0.2140411, 1.0])
    wanted = [0, 0.01292, 0.03876, 1.055 * 0.0032 ** (1 / 2.4) - 0.055, 0.5, 1]
    np.testing.assert_allclose(linear_to_srgb(light), wanted, atol=1e-6)
    np.testing.assert_allclose(srgb_to_linear(np.array([0.04, 0.041])), [0.04 / 12.92, (0.096 / 1.055) ** 2.4])


def test_what_is_transparent_keeps_its_colour_and_light_is_not_bounded() -> None:
    for whole, kind in ((255, np.uint8), (65535, np.uint16)):
        pixels = np.array([[(7, 9, 0), (100, 50, whole // 2), (whole, whole, 3)]], kind)
        found = unpremultiplied(pixels)
        assert found.dtype == kind
        assert found[0, :, :2].tolist() == [
            [7, 9],
            [round(50 * k * whole / (whole // 2)) for k in (2, 1)],
            [whole, whole],
        ]
    light = unpremultiplied(np.array([[(3.0, 0.5), (0.25, 0.0)]], np.float32))
    np.testing.assert_array_equal(light, [[(6.0, 0.5), (0.25, 0.0)]])


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_the_last_of_two_or_four_channels_is_alpha(count: int) -> None:
    picture = Picture(np.full((2, 3, count), 100, np.uint8), premultiplied=True)
    assert picture.has_alpha == (count in (2, 4))
    assert (picture.width, picture.height, picture.bits, picture.linear) == (3, 2, 8, False)
    straight = picture.straight()
    assert not straight.premultiplied
    assert straight.pixels[0, 0, 0] == (255 if picture.has_alpha else 100)


def test_without_metadata_the_colours_mean_what_they_did() -> None:
    layers = (Layer("id", np.zeros((2, 3), np.uint32)),)
    kept = {"icc": b"profile", "chunks": {b"cICP": b"\1"}, "chromaticities": (0.1,) * 8, "layers": layers}
    texts = {"cryptomatte/a": "b", "title": "c"}
    lost = {"exif": b"e", "xmp": b"x", "dpi": (72, 72), "attributes": {"owner": "me", "pixelAspectRatio": 2.0}}
    bare = Picture(np.zeros((2, 3, 3), np.float32), **kept, texts=texts, **lost).stripped()
    assert {name: getattr(bare, name) for name in kept} == kept
    assert (bare.exif, bare.xmp, bare.dpi, bare.attributes) == (None, None, None, {"pixelAspectRatio": 2.0})
    assert bare.texts == {"cryptomatte/a": "b"}


def test_margins_are_around_the_picture() -> None:
    wide = np.arange(7 * 9, dtype=np.float32).reshape(7, 9, 1)
    layers = (Layer("depth", wide[..., 0], exact=True),)
    picture = Picture(np.zeros((4, 5, 1), np.float32), margins=(1, 2, 3, 1)).with_wide(wide, layers)
    np.testing.assert_array_equal(picture.pixels, wide[2:6, 1:6])
    cropped = picture.cropped()
    np.testing.assert_array_equal(cropped.layers[0].values, wide[2:6, 1:6, 0])
    assert (cropped.wide, cropped.margins, cropped.layers[0].exact) == (None, (0, 0, 0, 0), True)
    other = picture.with_pixels(wide)
    assert (other.layers, other.wide, other.margins) == ((), None, (0, 0, 0, 0))

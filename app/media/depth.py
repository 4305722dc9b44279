"""Pixels in another depth, with alpha and without."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from app.model.picture import linear_to_srgb, srgb_to_linear

VALUES_AT_ONCE = 500_000


def few_rows(array: np.ndarray) -> Iterator[slice]:
    """The rows of an array, a few at a time, so that what is made of them takes no more memory for a larger one."""
    rows = max(1, VALUES_AT_ONCE // max(1, array[0].size))
    for top in range(0, len(array), rows):
        yield slice(top, top + rows)


def to_bits(pixels: np.ndarray, bits: int, *, dither: bool = True) -> np.ndarray:
    """Pixels (h, w, c) in another depth: 8 and 16 are sRGB, 32 is linear light; alpha is never curved.

    Going to 8 bits adds noise of one step before cutting, always the same, which leaves exact values exact. Works in
    strips, so that the extra memory does not depend on the size.
    """
    if pixels.dtype.itemsize * 8 == bits:
        return pixels
    out = np.empty(pixels.shape, {8: np.uint8, 16: np.uint16, 32: np.float32}[bits])
    noise = np.random.default_rng(0) if dither and bits == 8 else None
    for rows in few_rows(pixels):
        out[rows] = _strip_to_bits(pixels[rows], bits, noise)
    return out


def _strip_to_bits(pixels: np.ndarray, bits: int, noise: np.random.Generator | None) -> np.ndarray:
    if pixels.dtype == np.uint8 and bits == 16:
        return pixels * np.uint16(257)
    colours = pixels.shape[2] - (pixels.shape[2] in (2, 4))
    if bits == 32:
        values = pixels.astype(np.float32) / np.iinfo(pixels.dtype).max
        values[..., :colours] = srgb_to_linear(values[..., :colours])
        return values
    top = 2**bits - 1
    if pixels.dtype == np.uint16:
        values = pixels / np.float32(257)
    else:
        values = np.clip(np.nan_to_num(pixels), 0, 1)
        values[..., :colours] = linear_to_srgb(values[..., :colours])
        values *= top
    # a little less than a whole step, so that rounding errors do not move values that are exact
    offset = 0.5 if noise is None else 0.001 + 0.998 * noise.random(values.shape, np.float32)
    return np.minimum(values + offset, top).astype(np.uint8 if bits == 8 else np.uint16)


def spread(pixels: np.ndarray, bits: int, to: int) -> np.ndarray:
    """Codes of `bits` bits in 8 or 16, which are more, black and white where they are; works in strips."""
    kind, (top, most) = {8: np.uint8, 16: np.uint16}[to], (2**bits - 1, 2**to - 1)
    out = np.empty(pixels.shape, kind)
    for rows in few_rows(pixels):
        out[rows] = pixels[rows].astype(np.uint32) * np.uint32(most) // np.uint32(top)
    return out


def mixed(one: np.ndarray, other: np.ndarray, share: float, *, premultiplied: bool = False) -> np.ndarray:
    """One picture (h, w, c) dissolved into another of its kind: of that a `share` between 0 and 1, in linear light."""
    out = np.empty_like(one)
    for rows in few_rows(one):
        first, second = (to_bits(part[rows], 32) for part in (one, other))
        first, second = (1 - share) * first, share * second
        mix = first + second
        if one.shape[2] in (2, 4) and not premultiplied:
            weights = first[..., -1:], second[..., -1:]
            colours = (first[..., :-1] * weights[0] / (1 - share), second[..., :-1] * weights[1] / share)
            np.divide(sum(colours), mix[..., -1:], out=mix[..., :-1], where=mix[..., -1:] > 0)
        out[rows] = to_bits(mix, 8 * one.dtype.itemsize, dither=False)
    return out


def over(pixels: np.ndarray, background: tuple[int, int, int]) -> np.ndarray:
    """Pixels (h, w, 2 or 4) uint8 over an opaque 8-bit RGB colour, as programs do it: in the values, not the light."""
    alpha = pixels[..., -1:].astype(np.float32) / 255
    ground = np.asarray(background if pixels.shape[2] == 4 else [np.mean(background)], np.float32)
    return (pixels[..., :-1] * alpha + ground * (1 - alpha) + 0.5).astype(np.uint8)


def rgba(pixels: np.ndarray) -> np.ndarray:
    """Grey or colours (h, w, c) uint8, with alpha or none, as colours with alpha."""
    channels = pixels.shape[2]
    if channels == 4:
        return pixels
    colours = pixels[..., [0, 0, 0]] if channels < 3 else pixels
    alpha = pixels[..., 1:] if channels == 2 else np.full_like(pixels[..., :1], 255)
    return np.concatenate([colours, alpha], axis=2)


def as_half(values: np.ndarray) -> np.ndarray:
    """The values as float16, of any shape; what is finite stays so."""
    most = np.float32(np.finfo(np.float16).max)
    return np.where(np.isfinite(values), np.clip(values, -most, most), values).astype(np.float16)

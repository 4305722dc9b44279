"""Draws auxiliary pictures of Figures 4 to 6 and of the guide: `python -m assets.gallery.draw_masks [FOLDER]`."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

FINER = 4

HAT = [(116, 78), (118, 75), (137, 76), (157, 75), (160, 69), (170, 63), (185, 60), (203, 60), (222, 64), (235, 71),
       (242, 76), (247, 78), (267, 78), (285, 77), (288, 80), (285, 88), (270, 95), (247, 103), (220, 107), (190, 109),
       (167, 109), (145, 107), (128, 98), (118, 87)]  # fmt: skip


def hat() -> Image.Image:
    """The outline of Pere Tanguy's hat, white, traced by hand: Figure 4's segmentation."""
    image = Image.new("L", (394 * FINER, 500 * FINER))
    ImageDraw.Draw(image).polygon([(x * FINER, y * FINER) for x, y in HAT], 255)
    return image.resize((394, 500), Image.Resampling.BOX)


def dark_window(size: tuple[int, int], centre: tuple[float, float], radii: tuple[float, float]) -> Image.Image:
    """A soft dark ellipse in white, in fractions of the picture: a viscosity that lets only its inside flow."""
    x, y = _fractions(size)
    depth = 1 - np.hypot((x - centre[0]) / radii[0], (y - centre[1]) / radii[1])
    return _grey(1 - _smooth(depth / 0.28))


def rise(size: tuple[int, int], centre: tuple[float, float], way: tuple[float, float], length: float) -> Image.Image:
    """From black to white along a way, evenly over a length about the centre: its gradient points that way."""
    x, y = _fractions(size)
    along = ((x - centre[0]) * way[0] + (y - centre[1]) * way[1]) / np.hypot(*way)
    return _grey(np.clip(0.5 + along / length, 0, 1))


def bands(size: tuple[int, int], periods: float) -> Image.Image:
    """A force field in red (x) and green (y): level bands that push to the right and to the left in turn."""
    _, y = _fractions(size)
    red = np.round(128 + 127 * np.sin(2 * np.pi * periods * y)).astype(np.uint8)
    still = np.full_like(red, 128)
    return Image.fromarray(np.stack([red, still, still], axis=-1))


def _fractions(size: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    return np.meshgrid((np.arange(size[0]) + 0.5) / size[0], (np.arange(size[1]) + 0.5) / size[1])


def _smooth(values: np.ndarray) -> np.ndarray:
    s = np.clip(values, 0, 1)
    return s * s * (3 - 2 * s)


def _grey(values: np.ndarray) -> Image.Image:
    return Image.fromarray(np.round(255 * values).astype(np.uint8))


def main() -> None:
    """Write the pictures."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    portrait, mouth, brow = (600, 600), (0.65, 0.587), (0.613, 0.302)
    pictures = {
        "hat": hat(),
        "mouth-viscosity": dark_window(portrait, mouth, (0.217, 0.187)),
        "mouth-force": rise(portrait, mouth, (0.5, -1), 0.4),
        "brow-viscosity": dark_window(portrait, brow, (0.192, 0.117)),
        "brow-force": rise(portrait, brow, (0.3, -1), 0.25),
        "bands": bands((451, 300), 3),
    }
    for name, picture in pictures.items():
        picture.save(folder / f"{name}.png", optimize=True)


if __name__ == "__main__":
    main()

"""Draws `logo.png`, a badge, and masks of its outline and of a heart: `python -m assets.gallery.draw_logo [DIR]`."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from assets.gallery.draw_train import FINER, Places, Sheet

SIDE = 900
MIDDLE, RADIUS = (450.0, 462.0), 296.0
RING = 243  # the radius on which the words stand
PAPER, LINE = (247, 240, 226), (236, 224, 203)
NAVY, CREAM, CORAL = (24, 44, 84), (250, 241, 220), (222, 84, 62)
SUN, FOAM = (255, 206, 92), (246, 250, 246)
SEA = ((38, 112, 146), (30, 88, 128), (24, 64, 106))
FIRST_STOP, LAST_STOP = (250, 146, 92), (255, 224, 164)
ABOVE, BELOW, SPACING = "FLUIDWARP", "PUSHED LIKE HONEY", 9.0  # pixels between two letters


def badge() -> Image.Image:
    """A badge on paper with fine lines, which show what becomes of the paper."""
    sheet = Sheet(SIDE, SIDE)
    sheet.box(0, 0, SIDE, SIDE, PAPER)
    for at in np.arange(15, SIDE, 30).tolist():
        sheet.line([(at, 0), (at, SIDE)], LINE, 2)
        sheet.line([(0, at), (SIDE, at)], LINE, 2)
    x, y = MIDDLE
    for radius, colour in ((RADIUS, NAVY), (282, CREAM), (274, CORAL), (212, CREAM), (204, NAVY)):
        sheet.disc(x, y, radius, colour)
    scene = _scene()
    inside = Image.new("L", sheet.image.size)
    ImageDraw.Draw(inside).ellipse([(v + way * 196) * FINER for way in (-1, 1) for v in MIDDLE], 255)
    sheet.image.paste(scene.image, mask=inside)
    _words(sheet, ABOVE, -90, 1)
    _words(sheet, BELOW, 90, -1)
    for side in (-1, 1):
        sheet.disc(x + side * RING, y, 7, CREAM)
    return sheet.finished()


def _scene() -> Sheet:
    """An evening at sea."""
    scene, (x, y) = Sheet(SIDE, SIDE), MIDDLE
    scene.gradient((0, y - 200, SIDE, y + 60), [(0, FIRST_STOP), (1, LAST_STOP)])
    for number in range(18):
        a, half = math.pi * number / 9, math.pi / 36
        ray = [(x, y - 10), *((x + 400 * math.cos(a + s), y - 10 + 400 * math.sin(a + s)) for s in (-half, half))]
        scene.shape(ray, (255, 214, 140))
    scene.disc(x, y - 10, 92, CREAM)
    scene.disc(x, y - 10, 82, SUN)
    for row, colour in enumerate(SEA):
        crest = _wave(y + 30 + 50 * row, 16 + 3 * row, 98, 40 * row)
        scene.shape([(0, SIDE), *crest, (SIDE, SIDE)], colour)
        scene.line(crest, FOAM, 6)
    return scene


def _wave(level: float, height: float, length: float, shift: float) -> Places:
    x = np.linspace(0, SIDE, 240)
    phase = 2 * np.pi * (x + shift) / length
    return list(
        zip((x - 0.8 * height * np.sin(phase)).tolist(), (level - height * np.cos(phase)).tolist(), strict=True)
    )


def _words(sheet: Sheet, words: str, middle: float, way: int) -> None:
    """Words on the badge's ring around an angle in degrees, clockwise (1) with their feet inside, or the other way."""
    font = ImageFont.load_default(40 * FINER)
    lengths = [font.getlength(letter) / FINER + SPACING for letter in words]
    along = -sum(lengths) / 2
    for letter, length in zip(words, lengths, strict=True):
        angle = middle + way * math.degrees((along + length / 2) / RING)
        box = 80 * FINER
        image = Image.new("L", (box, box))
        pen = ImageDraw.Draw(image)
        pen.text((box / 2, box / 2 + 14 * FINER), letter, 255, font, anchor="ms", stroke_width=FINER)
        image = image.rotate(-angle - way * 90, Image.Resampling.BICUBIC)
        x, y = (m + RING * turn(math.radians(angle)) for m, turn in zip(MIDDLE, (math.cos, math.sin), strict=True))
        at = round(x * FINER - box / 2), round(y * FINER - box / 2)
        sheet.image.paste(Image.new("RGB", image.size, CREAM), at, image)
        along += length


def heart() -> Places:
    """The outline of a heart as large as the badge: a fluid keeps its area."""
    t = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    x = 12.4 * np.sin(t) - 3.4 * np.sin(3 * t)
    y = -13 * np.cos(t) + 5 * np.cos(2 * t) + 1.8 * np.cos(3 * t) + 0.6 * np.cos(4 * t)
    area = abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2
    scale = RADIUS * math.sqrt(math.pi / area)
    return list(
        zip((MIDDLE[0] + scale * x).tolist(), (MIDDLE[1] + scale * (y - (y.max() + y.min()) / 2)).tolist(), strict=True)
    )


def _mask(shape: Places) -> Image.Image:
    image = Image.new("L", (SIDE, SIDE))
    ImageDraw.Draw(image).polygon(shape, 255)
    return image.convert("1")


def main() -> None:
    """Write the pictures."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    (x, y), turns = MIDDLE, np.linspace(0, 2 * np.pi, 400, endpoint=False).tolist()
    disc = [(x + RADIUS * math.cos(a), y + RADIUS * math.sin(a)) for a in turns]
    pictures = {"logo": badge(), "logo-disc": _mask(disc), "logo-heart": _mask(heart())}
    for name, picture in pictures.items():
        picture.save(folder / f"{name}.png", optimize=True)


if __name__ == "__main__":
    main()

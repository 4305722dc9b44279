"""Draws `train.png`, the train that leaves the station in Figure 3: `python -m assets.gallery.draw_train [OUT.png]`."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFilter, ImageFont

WIDTH, HEIGHT = 1200, 800
FINER = 3  # drawn so many times larger, then averaged: Pillow draws without anti-aliasing

CREAM, RED, DARK_RED, GOLD = (244, 230, 200), (176, 38, 44), (120, 22, 32), (222, 178, 86)
INK, STEEL, LIGHT = (28, 30, 40), (92, 98, 112), (255, 226, 150)
PLATFORM, TILE, EDGE = (178, 160, 144), (156, 138, 124), (240, 196, 64)

Colour = tuple[int, ...]
Places = list[tuple[float, float]]


class Sheet:
    """A picture drawn in its own units, with soft layers and gradients."""

    def __init__(self, width: int = WIDTH, height: int = HEIGHT) -> None:
        self.image = Image.new("RGB", (width * FINER, height * FINER))
        self.pen = ImageDraw.Draw(self.image)

    def box(self, left: float, top: float, right: float, bottom: float, fill: Colour, radius: float = 0) -> None:
        scaled = [v * FINER for v in (left, top, right, bottom)]
        self.pen.rounded_rectangle(scaled, radius * FINER, fill)

    def shape(self, points: Places, fill: Colour) -> None:
        self.pen.polygon([(x * FINER, y * FINER) for x, y in points], fill)

    def line(self, points: Places, fill: Colour, width: float) -> None:
        self.pen.line([(x * FINER, y * FINER) for x, y in points], fill, round(width * FINER), "curve")

    def disc(self, x: float, y: float, r: float, fill: Colour) -> None:
        self.pen.ellipse([v * FINER for v in (x - r, y - r, x + r, y + r)], fill)

    def text(self, x: float, y: float, words: str, size: float, fill: Colour, spacing: float = 0) -> None:
        """Words centred on x and y, their letters set apart by `spacing`."""
        font = ImageFont.load_default(size * FINER)
        lengths = [font.getlength(letter) / FINER + spacing for letter in words]
        x -= (sum(lengths) - spacing) / 2
        for letter, length in zip(words, lengths, strict=True):
            self.pen.text((x * FINER, y * FINER), letter, fill, font, anchor="lm")
            x += length

    def gradient(self, box: tuple[float, float, float, float], stops: list[tuple[float, Colour]]) -> None:
        """Colours from top to bottom; stops are fractions of the height."""
        left, top, right, bottom = (round(v * FINER) for v in box)
        at = np.linspace(0, 1, bottom - top)
        where = [stop for stop, _ in stops]
        column = np.stack([np.interp(at, where, [colour[c] for _, colour in stops]) for c in range(3)], axis=-1)
        strip = np.broadcast_to(column[:, None], (bottom - top, right - left, 3))
        self.image.paste(Image.fromarray(np.round(strip).astype(np.uint8)), (left, top))

    def soft(self, points: Places, fill: Colour, opacity: float, blur: float) -> None:
        """A blurred shape: light, shade, steam."""
        mask = Image.new("L", (self.image.width // FINER, self.image.height // FINER))
        ImageDraw.Draw(mask).polygon(points, round(255 * opacity))
        mask = mask.filter(ImageFilter.GaussianBlur(blur)).resize(self.image.size)
        self.image.paste(Image.new("RGB", self.image.size, fill), mask=mask)

    def cloud(self, x: float, y: float, size: float, fill: Colour, opacity: float) -> None:
        ring = [
            (x + size * math.cos(a) * (1 + 0.12 * math.sin(3 * a)), y + 0.22 * size * math.sin(a))
            for a in np.linspace(0, 2 * math.pi, 40)
        ]
        self.soft(ring, fill, opacity, size * 0.10)

    def finished(self) -> Image.Image:
        width, height = self.image.size
        return self.image.resize((width // FINER, height // FINER), Image.Resampling.BOX)


def draw() -> Image.Image:
    """The whole picture, 1200 x 800."""
    sheet = Sheet()
    _sky(sheet)
    _town(sheet)
    _far_canopy(sheet)
    _wires(sheet)
    _track(sheet)
    _coach(sheet, -374, "1789")
    _coach(sheet, 24, "1822")
    _engine(sheet, 422)
    _platform(sheet)
    _clock(sheet, 118, 128)
    _people(sheet)
    return sheet.finished()


def _sky(sheet: Sheet) -> None:
    stops = [(0, (66, 116, 168)), (0.45, (148, 190, 208)), (0.8, (250, 214, 168)), (1, (250, 186, 140))]
    sheet.gradient((0, 0, WIDTH, 520), stops)
    sheet.soft([(930 + 90 * math.cos(a), 300 + 90 * math.sin(a)) for a in np.linspace(0, 6.3, 50)], LIGHT, 0.75, 34)
    sheet.disc(930, 300, 44, (255, 242, 206))
    clouds = [(300, 92, 150, 0.75), (420, 118, 110, 0.7), (760, 70, 170, 0.65), (1060, 130, 140, 0.75)]
    for x, y, size, opacity in [*clouds, (980, 110, 90, 0.7), (560, 190, 120, 0.45), (160, 215, 130, 0.4)]:
        sheet.cloud(x, y, size, (255, 246, 234), opacity)


def _town(sheet: Sheet) -> None:
    x = np.linspace(0, WIDTH, 120)
    for base, height, colour, phase in ((330, 46, (134, 160, 178), 0.4), (372, 40, (98, 136, 140), 2.1)):
        ridge = base - height * (np.sin(x / 150 + phase) + 0.5 * np.sin(x / 63 + 2 * phase))
        sheet.shape([(0, 560), *zip(x.tolist(), ridge.tolist(), strict=True), (WIDTH, 560)], colour)
    random = np.random.default_rng(7)
    left = -10.0
    while left < WIDTH:
        width, height = random.uniform(34, 78), random.uniform(30, 105)
        wall = tuple(int(c) for c in np.array([196, 150, 120]) + random.integers(-26, 26, 3))
        top = 470 - height
        sheet.box(left, top, left + width, 560, wall)
        roof = (126, 70, 62) if random.random() < 0.6 else (84, 88, 104)
        sheet.shape([(left - 3, top), (left + width / 2, top - random.uniform(14, 30)), (left + width + 3, top)], roof)
        for row in np.arange(top + 9, 455, 19).tolist():
            for column in np.arange(left + 7, left + width - 11, 15).tolist():
                lit = random.random() < 0.35
                sheet.box(column, row, column + 7, row + 10, LIGHT if lit else (92, 88, 102))
        left += width + random.uniform(-2, 12)
    for tree in random.uniform(0, WIDTH, 26):
        r = random.uniform(13, 24)
        sheet.disc(tree, 470 - 0.4 * r, r, (62, 100 + int(r), 80))
        sheet.disc(tree - 0.25 * r, 470 - 0.65 * r, 0.6 * r, (84, 128, 92))
    sheet.box(0, 474, WIDTH, 640, (108, 104, 96))


def _far_canopy(sheet: Sheet) -> None:
    """Iron and glass over the left half of the station."""
    for k in range(8):
        left = -40 + 74 * k
        sheet.shape(
            [(left, 60), (left + 74, 60), (left + 66, 26), (left + 8, 26)],
            (178, 208, 214) if k % 2 else (158, 192, 204),
        )
        sheet.line([(left, 60), (left + 8, 26)], INK, 3)
    sheet.box(-60, 58, 556, 72, (48, 66, 72))
    sheet.box(-60, 22, 552, 28, (48, 66, 72))
    for k in range(20):
        x = -64 + 31 * k
        sheet.shape([(x, 72), (x + 31, 72), (x + 15.5, 88)], (212, 176, 96))
    for x in (40, 290, 500):
        sheet.box(x - 7, 66, x + 7, 480, (52, 74, 78))
        sheet.box(x - 12, 452, x + 12, 480, (40, 56, 60))
        for side in (-1, 1):
            arc = [(x + side * 62 * (1 - math.cos(a)), 72 + 62 * (1 - math.sin(a))) for a in np.linspace(0, 1.57, 16)]
            sheet.line(arc, (52, 74, 78), 5)
            sheet.disc(x + side * 20, 92, 5, (212, 176, 96))


def _wires(sheet: Sheet) -> None:
    for x in (566, 1130):
        sheet.box(x - 4, 96, x + 4, 500, STEEL)
        sheet.line([(x, 128), (x - 92, 128)], STEEL, 4)
        sheet.line([(x, 106), (x - 96, 128)], STEEL, 3)
    for y, sag in ((128, 14), (152, 0)):
        x = np.linspace(0, WIDTH, 90)
        drop = y + sag * np.sin((x - 474) / 564 * math.pi) ** 2
        sheet.line(list(zip(x.tolist(), drop.tolist(), strict=True)), (70, 74, 88), 2)


def _track(sheet: Sheet) -> None:
    sheet.gradient((0, 560, WIDTH, 640), [(0, (112, 102, 94)), (1, (74, 66, 62))])
    random = np.random.default_rng(3)
    for x, y in zip(random.uniform(0, WIDTH, 1500), random.uniform(572, 640, 1500), strict=True):
        shade = int(random.uniform(84, 150))
        sheet.disc(x, y, random.uniform(1.2, 3), (shade, shade - 8, shade - 14))
    for x in np.arange(-8, WIDTH, 44).tolist():
        sheet.box(x, 596, x + 24, 606, (82, 60, 46))
    sheet.box(0, 586, WIDTH, 592, (196, 200, 206))
    sheet.box(0, 591, WIDTH, 597, (96, 96, 104))


def _wheel(sheet: Sheet, x: float, y: float, r: float) -> None:
    sheet.disc(x, y, r, INK)
    sheet.disc(x, y, 0.82 * r, (152, 48, 46))
    sheet.disc(x, y, 0.66 * r, (52, 54, 64))
    for k in range(8):
        a = k * math.pi / 4
        sheet.line([(x, y), (x + 0.7 * r * math.cos(a), y + 0.7 * r * math.sin(a))], (152, 48, 46), 3)
    sheet.disc(x, y, 0.2 * r, GOLD)


def _bogie(sheet: Sheet, x: float) -> None:
    sheet.box(x - 58, 548, x + 58, 566, (44, 46, 56), 6)
    for side in (-34, 34):
        _wheel(sheet, x + side, 568, 22)


def _window(sheet: Sheet, left: float, top: float, width: float, height: float, seed: int) -> None:
    sheet.box(left - 4, top - 4, left + width + 4, top + height + 4, GOLD, 7)
    sheet.box(left, top, left + width, top + height, (52, 72, 92), 5)
    sheet.box(
        left + 2, top + 2, left + width - 2, top + height - 2, (255, 218, 148) if seed % 3 else (250, 206, 138), 4
    )
    head = left + width * (0.36 + 0.08 * (seed % 4))
    if seed % 4 != 3:
        coat = ((76, 92, 132), (132, 70, 88), (70, 110, 96), (96, 84, 76))[seed % 4]
        sheet.shape([(head - 15, top + height - 2), (head - 11, top + height - 17), (head, top + height - 22),
                     (head + 11, top + height - 17), (head + 15, top + height - 2)], coat)  # fmt: skip
        sheet.disc(head, top + height - 30, 9, (232, 186, 152))
        sheet.shape([(head - 10, top + height - 33), (head - 7, top + height - 42), (head + 7, top + height - 42),
                     (head + 10, top + height - 33)], ((62, 44, 38), INK, (150, 96, 52))[seed % 3])  # fmt: skip
    for edge, way in ((left, 1), (left + width, -1)):
        curtain = [(2, 2), (14, 2), (7, height * 0.7), (2, height * 0.8)]
        sheet.shape([(edge + way * x, top + y) for x, y in curtain], (190, 78, 66))


def _coach(sheet: Sheet, left: float, number: str) -> None:
    right = left + 386
    sheet.box(left - 14, 500, left + 10, 520, INK)
    sheet.box(left - 9, 320, left + 8, 520, (46, 46, 56))
    for y in range(326, 520, 9):
        sheet.line([(left - 9, y), (left + 8, y)], (74, 74, 86), 2)
    sheet.box(left, 300, right, 344, (74, 82, 92), 22)
    for x in np.arange(left + 30, right - 20, 46).tolist():
        sheet.box(x, 294, x + 22, 304, (94, 102, 112), 4)
    sheet.box(left, 318, right, 552, DARK_RED, 8)
    sheet.gradient((left + 1, 322, right - 1, 446), [(0, (255, 246, 224)), (0.3, CREAM), (1, (226, 206, 170))])
    sheet.gradient((left + 1, 446, right - 1, 544), [(0, (204, 60, 58)), (0.35, RED), (1, DARK_RED)])
    for y, width in ((446, 4), (455, 1.6), (532, 2)):
        sheet.line([(left + 2, y), (right - 2, y)], GOLD, width)
    for k in range(5):
        _window(sheet, left + 56 + 57.5 * k, 356, 44, 62, k + int(number))
    for door in (left + 8, right - 44):
        sheet.box(door, 342, door + 36, 544, (98, 18, 28), 4)
        sheet.box(door + 3, 345, door + 33, 541, (186, 44, 48), 3)
        sheet.box(door + 8, 356, door + 28, 418, GOLD, 5)
        sheet.box(door + 10, 358, door + 26, 416, (176, 206, 214), 4)
        sheet.box(door + 27, 462, door + 31, 482, GOLD, 2)
    sheet.text(left + 193, 336, "BERNOULLI  ·  EULER  ·  STOKES", 13, (120, 40, 40), 2)
    sheet.text(left + 193, 488, "FLUID  EXPRESS", 31, GOLD, 4)
    sheet.text(left + 193, 518, number, 15, (242, 214, 150), 3)
    sheet.box(left + 66, 552, right - 66, 560, (40, 40, 50))
    for x in (left + 74, right - 74):
        _bogie(sheet, x)


def _engine(sheet: Sheet, left: float) -> None:
    nose = left + 470
    sheet.box(left - 14, 500, left + 10, 520, INK)
    sheet.box(left - 9, 320, left + 8, 520, (46, 46, 56))
    for y in range(326, 520, 9):
        sheet.line([(left - 9, y), (left + 8, y)], (74, 74, 86), 2)

    def body(top: float, low: float, inset: float) -> Places:
        a = np.linspace(0, math.pi / 2, 40)
        curve = [
            (nose - inset - 150 + 150 * math.sin(t) ** 0.9, top + (low - top) * (1 - math.cos(t)) ** 1.15) for t in a
        ]
        return [(left + inset, low), (left + inset, top), *curve]

    sheet.shape(body(302, 552, 0), (74, 82, 92))
    sheet.shape(body(314, 552, 3), DARK_RED)
    # The livery is cut to the body's outline.
    mask = Image.new("L", sheet.image.size)
    ImageDraw.Draw(mask).polygon([(x * FINER, y * FINER) for x, y in body(320, 546, 6)], 255)
    livery = Sheet()
    livery.gradient((left, 316, nose, 446), [(0, (255, 246, 224)), (0.3, CREAM), (1, (226, 206, 170))])
    livery.gradient((left, 446, nose, 548), [(0, (204, 60, 58)), (0.35, RED), (1, DARK_RED)])
    livery.shape([(nose - 150, 446), (nose - 60, 392), (nose, 386), (nose, 446)], RED)
    livery.line([(left, 446), (nose - 150, 446), (nose - 60, 392), (nose, 386)], GOLD, 5)
    livery.line([(left, 455), (nose - 146, 455), (nose - 56, 402), (nose, 397)], GOLD, 2)
    livery.line([(left, 532), (nose, 532)], GOLD, 2)
    livery.shape([(nose - 128, 336), (nose - 94, 336), (nose - 66, 378), (nose - 128, 392)], INK)
    livery.shape([(nose - 124, 341), (nose - 96, 341), (nose - 72, 376), (nose - 124, 387)], (140, 196, 214))
    livery.shape([(nose - 118, 341), (nose - 106, 341), (nose - 112, 385), (nose - 122, 387)], (214, 236, 240))
    sheet.image.paste(livery.image, mask=mask)
    sheet.box(left + 26, 342, left + 62, 544, (98, 18, 28), 4)
    sheet.box(left + 29, 345, left + 59, 541, (186, 44, 48), 3)
    sheet.box(left + 34, 356, left + 54, 418, GOLD, 5)
    sheet.box(left + 36, 358, left + 52, 416, (176, 206, 214), 4)
    for k in range(3):
        x = left + 100 + 62 * k
        sheet.disc(x + 22, 388, 30, GOLD)
        sheet.disc(x + 22, 388, 26, (52, 72, 92))
        sheet.disc(x + 22, 388, 23, (150, 194, 210))
        sheet.shape([(x + 10, 372), (x + 20, 368), (x + 26, 408), (x + 18, 408)], (206, 230, 236))
    for k in range(7):
        sheet.line([(left + 86 + 6 * k, 470), (left + 86 + 6 * k, 524)], (96, 16, 26), 3)
    sheet.text(left + 245, 488, "NAVIER", 33, GOLD, 5)
    sheet.text(left + 245, 518, "No. 1845", 15, (242, 214, 150), 3)
    sheet.disc(nose - 22, 470, 15, GOLD)
    sheet.disc(nose - 22, 470, 11, (255, 248, 220))
    glow = [(nose - 22, 462), (WIDTH + 40, 410), (WIDTH + 40, 560), (nose - 22, 480)]
    sheet.soft(glow, LIGHT, 0.42, 9)
    # Pantograph, skirt, cow-catcher.
    for x in (left + 96,):
        sheet.line([(x - 30, 303), (x + 26, 238), (x - 14, 160)], INK, 4)
        sheet.line([(x + 40, 303), (x - 18, 240), (x + 16, 160)], STEEL, 3)
        sheet.line([(x - 34, 157), (x + 34, 157)], INK, 5)
        sheet.box(x - 50, 296, x + 60, 305, (52, 56, 66), 3)
    for x in (left + 190, left + 230, left + 270):
        sheet.box(x, 294, x + 26, 306, (94, 102, 112), 4)
    sheet.shape([(nose - 120, 548), (nose - 2, 540), (nose + 12, 586), (nose - 96, 586)], (52, 54, 64))
    for k in range(5):
        sheet.line([(nose - 96 + 22 * k, 546), (nose - 82 + 22 * k, 584)], (112, 116, 126), 3)
    sheet.box(left + 66, 552, left + 350, 560, (40, 40, 50))
    for x in (left + 92, left + 196, left + 300):
        _wheel(sheet, x, 562, 29)
    sheet.line([(left + 92, 562), (left + 196, 562), (left + 300, 562)], (198, 202, 208), 6)


def _platform(sheet: Sheet) -> None:
    sheet.gradient((0, 622, WIDTH, HEIGHT), [(0, (192, 174, 156)), (1, (150, 132, 120))])
    sheet.box(0, 616, WIDTH, 626, (226, 216, 200))
    sheet.box(0, 626, WIDTH, 632, (104, 92, 84))
    for near, far in ((632, 652), (652, 684), (684, 732), (732, 800)):
        sheet.line([(0, far), (WIDTH, far)], TILE, 2)
        for k in range(-30, 31):
            ends = [(600 + k * 46 * (y - 520) / 100, float(y)) for y in (near, far)]
            sheet.line(ends, TILE, 2)
    sheet.shape([(0, 646), (WIDTH, 646), (WIDTH, 662), (0, 662)], EDGE)
    for x in np.arange(4, WIDTH, 18).tolist():
        sheet.disc(x, 650.5, 2, (206, 158, 44))
        sheet.disc(x + 9, 657, 2, (206, 158, 44))
    sheet.soft([(0, 632), (WIDTH, 632), (WIDTH, 644), (0, 644)], (60, 46, 44), 0.5, 6)


def _clock(sheet: Sheet, x: float, y: float) -> None:
    sheet.box(x - 3, 72, x + 3, y - 34, INK)
    sheet.disc(x, y, 40, INK)
    sheet.disc(x, y, 35, (250, 246, 234))
    for k in range(12):
        a = k * math.pi / 6
        r0 = 26 if k % 3 else 23
        sheet.line([(x + r0 * math.sin(a), y - r0 * math.cos(a)), (x + 31 * math.sin(a), y - 31 * math.cos(a))], INK, 3)
    sheet.line([(x, y), (x + 15, y + 9)], INK, 4.5)
    sheet.line([(x, y), (x + 4, y - 27)], INK, 3)
    sheet.disc(x, y, 3.5, RED)
    sheet.box(200, 106, 412, 154, (30, 58, 92), 6)
    sheet.box(204, 110, 408, 150, (240, 240, 232), 4)
    sheet.box(207, 113, 405, 147, (30, 58, 92), 3)
    sheet.text(306, 130, "REYNOLDS JUNCTION", 16, (250, 250, 244), 1)
    for side in (222, 390):
        sheet.line([(side, 106), (side, 72)], INK, 3)


def _person(sheet: Sheet, x: float, foot: float, tall: float, coat: Colour, hat: Colour, bag: Colour | None) -> None:
    u = tall / 100
    shade = [(x + (18 + 44 * math.cos(a)) * u, foot + 5 * u * math.sin(a)) for a in np.linspace(0, 6.3, 24)]
    sheet.soft(shade, (60, 44, 40), 0.5, 3)
    for side in (-8, 7):
        sheet.box(x + side * u - 5 * u, foot - 36 * u, x + side * u + 5 * u, foot - 2 * u, (44, 44, 56))
        sheet.box(x + side * u - 6 * u, foot - 5 * u, x + side * u + 9 * u, foot, INK, 2 * u)
    trunk = [(-17, -30), (-15, -72), (-8, -80), (8, -80), (15, -72), (18, -30)]
    sheet.shape([(x + a * u, foot + b * u) for a, b in trunk], coat)
    arm = tuple(max(0, c - 22) for c in coat)
    sheet.line([(x - 12 * u, foot - 72 * u), (x - 18 * u, foot - 52 * u), (x - 16 * u, foot - 36 * u)], arm, 8 * u)
    sheet.line([(x + 12 * u, foot - 72 * u), (x + 22 * u, foot - 56 * u), (x + 20 * u, foot - 38 * u)], arm, 8 * u)
    sheet.disc(x + 1 * u, foot - 89 * u, 10 * u, (226, 178, 144))
    sheet.box(x - 9 * u, foot - 106 * u, x + 10 * u, foot - 92 * u, hat, 4 * u)
    sheet.box(x - 15 * u, foot - 95 * u, x + 17 * u, foot - 91 * u, hat, 2 * u)
    if bag is not None:
        sheet.box(x + 10 * u, foot - 26 * u, x + 44 * u, foot - 1 * u, bag, 4 * u)
        handle = [(20, 26), (20, 34), (32, 34), (32, 26)]
        sheet.line([(x + a * u, foot - b * u) for a, b in handle], INK, 3 * u)
        for strap in (16, 36):
            sheet.box(x + strap * u, foot - 26 * u, x + (strap + 4) * u, foot - 1 * u, (82, 52, 36))


def _people(sheet: Sheet) -> None:
    _person(sheet, 96, 742, 122, (58, 84, 124), (42, 48, 66), (146, 92, 54))
    _person(sheet, 214, 722, 104, (162, 62, 74), (122, 40, 56), None)
    _person(sheet, 866, 752, 128, (70, 104, 92), (58, 62, 60), (112, 72, 104))
    # A bench and a lamp.
    for x in (560, 700):
        sheet.box(x, 706, x + 8, 752, (46, 60, 62))
    for y in (676, 688, 704):
        sheet.box(540, y, 728, y + 8, (150, 98, 58), 2)
    sheet.box(486, 470, 493, 762, (46, 62, 66))
    sheet.box(478, 744, 501, 764, (46, 62, 66), 4)
    sheet.soft([(490 + 46 * math.cos(a), 452 + 46 * math.sin(a)) for a in np.linspace(0, 6.3, 30)], LIGHT, 0.7, 16)
    sheet.shape([(474, 472), (505, 472), (510, 438), (469, 438)], (255, 236, 184))
    sheet.shape([(466, 440), (513, 440), (490, 420)], (46, 62, 66))


def main() -> None:
    """Write the picture."""
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_name("train.png")
    draw().save(out, optimize=True)


if __name__ == "__main__":
    main()

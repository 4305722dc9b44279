"""What figures of the gallery show: arrows, handles, viscosity as greys, and contact sheets."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from app.media.auxiliary import Pictures
from app.media.depth import to_bits
from app.model.forces import CurveForce, GradientForce, PointForce
from app.model.handles import RecipeHandle
from app.model.recipe import Recipe
from app.work.replay import Replay
from solver.grid import Grid

WIDE = 440  # pixels across a frame of handles at work
PAPER, INK, FORCE = (250, 249, 246), (38, 38, 44), (214, 40, 40)
PANEL, MARGIN, PER_ROW = 420, 28, 4


def rgb(pixels: np.ndarray) -> np.ndarray:
    """(h, w, 3) uint8 of any picture."""
    return np.ascontiguousarray(np.broadcast_to(to_bits(pixels, 8)[..., :3], (*pixels.shape[:2], 3)))


def force_field(recipe: Recipe, grid: Grid, pictures: Pictures) -> np.ndarray:
    """The sum of the recipe's forces at the cells' centres, (ny, nx, 2); swelling and local ones as their flow."""
    total = np.zeros((grid.ny + 1, grid.nx + 1, 2), np.float32)
    for force in recipe.force:
        if isinstance(force, GradientForce):
            force = force.model_copy(update={"swell": False})
        elif isinstance(force, PointForce | CurveForce):
            force = force.model_copy(update={"local": 0.0})
        faces = force.faces(grid, pictures)
        if faces is not None:
            total[:-1, :-1] += faces
    return 0.5 * np.stack([total[:-1, :-1, 0] + total[:-1, 1:, 0], total[:-1, :-1, 1] + total[1:, :-1, 1]], axis=-1)


def arrows(background: np.ndarray, field: np.ndarray, across: int = 34, pale: float = 0.65) -> np.ndarray:
    """A vector field as arrows over a paled picture, (h, w, 3) uint8; their length goes by the root of its size."""
    height, width = background.shape[:2]
    finer = 2
    image = Image.fromarray(((1 - pale) * background + pale * np.array(PAPER)).astype(np.uint8))
    image = image.resize((width * finer, height * finer))
    pen = ImageDraw.Draw(image)
    step = max(width, height) / across
    size = np.linalg.norm(field, axis=-1)
    for y in np.arange(step / 2, height, step):
        for x in np.arange(step / 2, width, step):
            cell = int(y / height * len(field)), int(x / width * field.shape[1])
            part = float(size[cell] / size.max())
            if part > 0.02:
                way = field[cell] / size[cell]
                _arrow(pen, np.array([x, y]) * finer, way, step * finer * (0.35 + 0.85 * part**0.5))
    return np.asarray(image.resize((width, height), Image.Resampling.BOX))


def led(pixels: np.ndarray, recipe: Recipe) -> np.ndarray:
    """A picture (h, w, 3) uint8 with the ways of a recipe's handles, and its pins as rings."""
    height, width = pixels.shape[:2]
    image, finer = Image.fromarray(pixels), 3
    image = image.resize((width * finer, height * finer), Image.Resampling.BICUBIC)
    pen, size = ImageDraw.Draw(image), np.array([width, height]) * finer
    for handle in recipe.handle:
        start, end = np.array(handle.at) * size, np.array(handle.goal or handle.at) * size
        far = max(float(np.hypot(*(end - start))), 1e-9)
        _arrow(pen, (start + end) / 2, (end - start) / far, far, max(width, height) * finer / 16)
    for pin in recipe.pin:
        pen.circle([*(np.array(pin.at) * size)], 4 * finer, outline=FORCE, width=2 * finer)
    return np.asarray(image.resize((width, height), Image.Resampling.BOX))


def at_work(pixels: np.ndarray, replay: Replay) -> np.ndarray:
    """A frame (h, w, 3) uint8 made `WIDE` pixels wide, handles as dots on their ways to rings, pins as ringed dots."""
    finer, height = 3, round(WIDE * len(pixels) / len(pixels[0]))
    image = Image.fromarray(pixels).resize((WIDE * finer, height * finer), Image.Resampling.BICUBIC)
    pen, extent = ImageDraw.Draw(image), np.array(replay.grid.extent)
    for (_, each), place in zip(replay.led, replay.handles.places, strict=True):
        goal = np.array(getattr(each, "goal", None) or each.at) * image.size
        now = place / extent * image.size
        pen.line([*now, *goal], INK, finer)
        pen.circle([*goal], 5 * finer, outline=INK, width=finer)
        pen.circle([*now], 5 * finer, PAPER)
        pen.circle([*now], 3.5 * finer, FORCE if isinstance(each, RecipeHandle) else INK)
    return np.asarray(image.reduce(finer))


def marked(pixels: np.ndarray, det: np.ndarray) -> np.ndarray:
    """A picture (h, w, 3) uint8 with the pixels in red where det J (h, w) says that its map folds."""
    return np.where((det <= 0)[..., None], np.array(FORCE, np.uint8), pixels)


def _arrow(
    pen: ImageDraw.ImageDraw, middle: np.ndarray, way: np.ndarray, length: float, stout: float = float("inf")
) -> None:
    """An arrow, as wide as one of a length of `stout` at most."""
    across = np.array([-way[1], way[0]])
    tail, tip, size = middle - way * length / 2, middle + way * length / 2, min(length, stout)
    neck = tip - way * 0.38 * size
    pen.line([*tail, *neck], FORCE, max(2, round(0.11 * size)))
    pen.polygon([*tip, *(neck + across * 0.2 * size), *(neck - across * 0.2 * size)], FORCE)


def shades(viscosity: np.ndarray, like: np.ndarray) -> np.ndarray:
    """Viscosity as greys, the most viscous white, in equal factors; (h, w, 3) uint8 of the size of `like`."""
    logarithm = np.log(np.maximum(viscosity, 1e-9))
    values = (logarithm - logarithm.min()) / max(float(np.ptp(logarithm)), 1e-9)
    image = Image.fromarray(np.round(values * 255).astype(np.uint8)).resize(like.shape[1::-1], Image.Resampling.NEAREST)
    return rgb(np.asarray(image)[..., None])


def contact_sheet(title: str, panels: list[tuple[str, np.ndarray]], panel: int = PANEL) -> np.ndarray:
    """Panels of height `panel` in rows, captions below and the title above, (h, w, 3) uint8."""
    shown = [
        (
            caption,
            Image.fromarray(pixels).resize(
                (round(len(pixels[0]) * panel / len(pixels)), panel), Image.Resampling.LANCZOS
            ),
        )
        for caption, pixels in panels
    ]
    rows = [shown[first : first + PER_ROW] for first in range(0, len(shown), PER_ROW)]
    width = max(sum(image.width + MARGIN for _, image in row) for row in rows) + MARGIN
    row_height = panel + 2 * MARGIN
    sheet = Image.new("RGB", (width, 2 * MARGIN + len(rows) * row_height), PAPER)
    pen = ImageDraw.Draw(sheet)
    pen.text((MARGIN, 0.9 * MARGIN), title, INK, ImageFont.load_default(24), anchor="lm")
    for number, row in enumerate(rows):
        left, top = MARGIN, 2 * MARGIN + number * row_height
        for caption, image in row:
            sheet.paste(image, (left, top))
            pen.text((left, top + panel + 0.7 * MARGIN), caption, INK, ImageFont.load_default(19), anchor="lm")
            left += image.width + MARGIN
    return np.asarray(sheet)

"""What strokes of the hand do: three retouching jobs on a photograph of 24 megapixels, and three posters."""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
from PIL import Image

from app.gallery.measures import summary
from app.gallery.studio import Measured, Studio, load, made, source_of
from app.media.pictures import write_picture
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.model.strokes import Stroke
from app.progress import Progress
from solver.gl.device import Device
from solver.resample.plan import Sampling

PHOTOGRAPH = 6000, 4000  # pixels
PORTRAIT = 1200  # pixels along a side of the portrait in its middle; a face in it is some 900 high
POSTER = 2000  # pixels along the longer side
SHOWN = 520  # rows of a poster on its sheet
FROZEN = np.array([70, 150, 255], np.uint8)  # the colour laid over what is frozen

Box = tuple[int, int, int, int]

# What is shown of the photograph at 100 %: left, top, right, bottom.
JOBS: dict[str, tuple[str, Box]] = {
    "retouching-mouth": ("Lifting the corner of a mouth", (2640, 1980, 3340, 2500)),
    "retouching-jaw": ("Slimming a jaw with ten small dabs", (2600, 1880, 3340, 2590)),
    "retouching-eye": ("Enlarging an eye; the rim of the glasses is frozen", (2540, 1580, 3140, 1980)),
}
# And of the posters.
POSTERS: dict[str, Box] = {
    "poster-terrace": (380, 100, 1080, 620),
    "poster-tanguy": (870, 60, 1570, 580),
    "poster-night-cafe": (780, 0, 1480, 520),
}


def make(device: Device, folder: Path, progress: Progress) -> dict[str, Measured]:
    """Play every job and poster into `folder`; see `made`."""
    strokes = {name: partial(retouch, name=name) for name in JOBS} | {
        name: partial(poster, name=name) for name in POSTERS
    }
    return made(device, folder, progress, strokes, sum(load(name).ticks for name in strokes))


def retouch(studio: Studio, name: str, smaller: int = 1) -> Measured:
    """Play a job and write its sheet, cut from the whole photograph before and after.

    Args:
        studio: where.
        name: of the job.
        smaller: times smaller than `PHOTOGRAPH` the photograph is.
    """
    title, box = JOBS[name]
    left, top, right, bottom = (side // smaller for side in box)
    recipe = load(name)
    before = photograph(source_of(recipe), smaller)
    after, moved, numbers = _played(studio, recipe, before, before.shape[1::-1])
    shown = np.zeros(before.shape[:2], bool)
    shown[top:bottom, left:right] = True
    changed = (after != before).any(axis=-1)
    numbers["pixels changed"] = f"{changed.sum()}"
    numbers["px beyond the sheet, most"] = f"{moved[~shown].max():.3f}"
    frozen = np.zeros(before.shape[:2], bool)
    for stroke in recipe.stroke:
        if stroke.tool == "freeze":
            frozen |= beneath(stroke, before.shape[1::-1])
    panels = [("before", before)]
    if frozen.any():
        numbers["pixels frozen"] = f"{frozen.sum()}"
        numbers["frozen pixels changed"] = f"{changed[frozen].sum()}"
        tinted = before.copy()
        tinted[frozen] = tinted[frozen] // 2 + FROZEN // 2
        panels.append(("frozen: the blue rim", tinted))
    panels.append(("after", after))
    studio.sheet(name, title, [(caption, whole[top:bottom, left:right]) for caption, whole in panels], bottom - top)
    return numbers


def poster(studio: Studio, name: str) -> Measured:
    """Play a poster, and write it, its sheet, and one of a part of it at 100 %."""
    recipe = load(name)
    source = source_of(recipe)
    part = POSTER / max(source.shape)
    size = round(source.shape[1] * part), round(source.shape[0] * part)
    after, _, numbers = _played(studio, recipe, source, size)
    write_picture(studio.folder / f"{name}.png", Picture(after))
    studio.sheet(name, recipe.name, [("before", source), ("after", after)], SHOWN)
    left, top, right, bottom = POSTERS[name]
    before = np.asarray(Image.fromarray(source).resize(size, Image.Resampling.LANCZOS))
    panels = [(caption, whole[top:bottom, left:right]) for caption, whole in (("before", before), ("after", after))]
    studio.sheet(f"{name}-detail", f"{recipe.name}, at 100 %", panels, bottom - top)
    return numbers


def photograph(portrait: np.ndarray, smaller: int = 1) -> np.ndarray:
    """A portrait (n, n, 3) uint8, enlarged into the middle of a photograph, its edges drawn out; (h, w, 3) uint8."""
    width, height = (side // smaller for side in PHOTOGRAPH)
    side = PORTRAIT // smaller
    enlarged = np.asarray(Image.fromarray(portrait).resize((side, side), Image.Resampling.LANCZOS))
    around = [((whole - side) // 2, (whole - side + 1) // 2) for whole in (height, width)]
    return np.pad(enlarged, (*around, (0, 0)), "edge")


def beneath(stroke: Stroke, size: tuple[int, int]) -> np.ndarray:
    """The pixels of a picture of `size` that the ring of a stroke's brush has passed over, a pixel within it.

    Returns:
        bool (height, width).
    """
    width, height = size
    passed = np.zeros((height, width), bool)
    places = [np.array([x * width, y * height]) for _, x, y, _ in stroke.samples]
    reach = stroke.radius * max(size) - 1
    for start, end in pairwise([places[0], *places]):
        low, high = np.minimum(start, end) - reach - 1, np.maximum(start, end) + reach + 1
        (x0, y0), (x1, y1) = np.maximum(low, 0).astype(int), np.minimum(np.ceil(high), size).astype(int)
        centre = np.stack(np.meshgrid(np.arange(x0, x1) + 0.5, np.arange(y0, y1) + 0.5), axis=-1) - start
        way = end - start
        part = np.clip(centre @ way / max(way @ way, 1e-9), 0, 1)
        passed[y0:y1, x0:x1] |= np.linalg.norm(centre - part[..., None] * way, axis=-1) < reach
    return passed


def _played(
    studio: Studio, recipe: Recipe, source: np.ndarray, size: tuple[int, int]
) -> tuple[np.ndarray, np.ndarray, Measured]:
    """The result of a recipe on a picture, (h, w, 3) uint8 of `size`; how far each pixel of it is looked up from
    itself, in pixels (h, w); and what is measured on the whole map.
    """
    with studio.played(recipe, source) as replay:
        result = studio.sampler.apply(replay.warp, source, size, Sampling(edges=recipe.edges))
        found = replay.warp.statistics()
        moved = np.linalg.norm(replay.warp.read(size), axis=-1) * max(size)
    return result, moved, summary(found, max(size)) | {"folds": f"{found.folds} of {found.places} places"}

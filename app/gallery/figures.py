"""The paper's figures and the guide's pictures, a function each: result, animation, contact sheet, measurements."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from app.gallery.drawing import arrows, at_work, led, marked, rgb, shades
from app.gallery.measures import beyond, light, sharpness, spline_of, spline_warp, stretch_and_det, summary
from app.gallery.studio import Measured, Studio, load, made, recipes_folder, source_of
from app.media.auxiliary import Pictures
from app.media.pictures import write_picture
from app.model.forces import GradientForce
from app.model.masks import solid
from app.model.picture import Picture
from app.progress import Progress
from app.work.replay import Replay
from solver.gl.device import Device
from solver.grid import Grid
from solver.resample.plan import GivenMap, Sampling

EVERY = 4  # ticks from one frame of handles at work to the next
COMPARED = 512  # pixels along the longer side, in which displacements are given


def figure_1(studio: Studio) -> Measured:
    """Density mode, blurred and fading, against coordinate mode, sharp."""
    density = studio.play("figure-1", save_as="figure-1-density", mode="density")
    moved = studio.play("figure-1")
    studio.sheet(
        "figure-1",
        "Figure 1: moving the values of a picture, and moving its coordinates",
        [
            ("a  source", moved.source),
            ("b  forces", arrows(moved.source, moved.field)),
            ("c  values moved: blurred", density.result),
            ("d  coordinates moved: sharp", moved.result),
        ],
    )
    smooth = studio.sampler.apply(
        GivenMap(studio.device, moved.displacement), moved.source, how=Sampling(edges=moved.recipe.edges)
    )
    reference = sharpness(spline_warp(light(moved.source), moved.displacement))
    shown = {"coordinates": moved.result, "coordinates, as many samples as the map stretches": smooth}
    shown["density"] = density.result
    return {
        **{f"sharpness, {name}": f"{sharpness(light(pixels)) / reference:.1%}" for name, pixels in shown.items()},
        **summary(moved.statistics, COMPARED),
    }


def figure_3(studio: Studio) -> Measured:
    """A train leaving the station, after a short and after a long time."""
    train = studio.play("figure-3", stills=[0.5])
    write_picture(studio.folder / "figure-3-short.png", Picture(train.stills[0.5]))
    studio.sheet(
        "figure-3",
        "Figure 3: a train leaving the station, by one instantaneous force",
        [
            ("a  source", train.source),
            ("b  the force, along a curve", arrows(train.source, train.field)),
            ("c  after 0.5 s", train.stills[0.5]),
            (f"d  after {train.recipe.duration:g} s", train.result),
        ],
    )
    return summary(train.statistics, COMPARED)


def figure_4(studio: Studio) -> Measured:
    """Pere Tanguy's hat melting."""
    hat = studio.play("figure-4")
    low, high = hat.viscosity.min(), hat.viscosity.max()
    studio.sheet(
        "figure-4",
        "Figure 4: melting the hat",
        [
            ("a  source", hat.source),
            ("b  forces: gradient of the hat's outline", arrows(hat.source, hat.field)),
            (f"c  viscosity, {low:.2g} (dark) to {high:.2g}", shades(hat.viscosity, hat.source)),
            ("d  result", hat.result),
        ],
    )
    return summary(hat.statistics, COMPARED)


def guide_forces(studio: Studio) -> Measured:
    """One force of each kind, on the same picture."""
    recipe = load("guide-forces")
    panels = [("the picture", source_of(recipe))]
    panels += [(force.name, studio.still(recipe.edited(force=(force,)))) for force in recipe.force]
    studio.sheet("guide-forces", "Kinds of force", panels, 260)
    return {}


def guide_viscosity(studio: Studio) -> Measured:
    """One push through fluids of different viscosity."""
    recipe = load("guide-viscosity")
    alone = [(layer.name, recipe.edited(viscosity=(layer,), freeze=())) for layer in recipe.viscosity]
    alone += [(layer.name, recipe.edited(viscosity=recipe.viscosity[:1], freeze=(layer,))) for layer in recipe.freeze]
    panels = [("the picture", source_of(recipe)), *((name, studio.still(one)) for name, one in alone)]
    studio.sheet("guide-viscosity", "One push, different viscosities", panels, 260)
    return {}


def portrait(studio: Studio, name: str, what: str) -> Measured:
    """A part of a face moved by a force in a window, by viscosity alone and with the rest frozen."""
    thick, frozen = studio.play(name), studio.play(f"{name}-freeze")
    pictures = Pictures(Picture(thick.source), recipes_folder())
    (lift,) = thick.recipe.force
    assert isinstance(lift, GradientForce)
    studio.sheet(
        name,
        f"Figure {name[-1]}: {what}",
        [
            ("a  source", thick.source),
            ("b  viscosity: the dark part flows", shades(thick.viscosity, thick.source)),
            (
                "c  force: the gradient of this picture",
                arrows(rgb(pictures.load(lift.picture).pixels), thick.field, 40, pale=0.0),
            ),
            ("d  result", thick.result),
            ("e  source, close up", _near(thick.source, lift)),
            ("f  result, close up", _near(thick.result, lift)),
            ("g  with all outside the window frozen", _near(frozen.result, lift)),
        ],
    )
    # The window is what the recipe with the freeze leaves free: where the dark window is darker than middle grey.
    height, width = thick.source.shape[:2]
    outside = solid(frozen.recipe.freeze, Grid.for_picture(width, height, max(width, height)), pictures)
    moved, moved_frozen = (np.linalg.norm(one.displacement, axis=-1) * COMPARED for one in (thick, frozen))
    changed = (frozen.result != frozen.source).any(axis=-1)
    return {
        "px outside, mean": f"{moved[outside].mean():.3f}",
        "px inside, mean": f"{moved[~outside].mean():.1f}",
        "px inside, most": f"{moved[~outside].max():.1f}",
        "frozen: px outside, most": f"{moved_frozen[outside].max():.3g}",
        "frozen: pixels changed outside": f"{changed[outside].sum()}",
        "frozen: px inside, mean": f"{moved_frozen[~outside].mean():.1f}",
        "det J": summary(thick.statistics, COMPARED)["det J"],
        "frozen: det J": summary(frozen.statistics, COMPARED)["det J"],
    }


def _near(pixels: np.ndarray, force: GradientForce) -> np.ndarray:
    """The part of a picture about the window a force acts in."""
    assert force.within is not None
    around = 0.08
    left, top, right, bottom = force.within.box
    height, width = pixels.shape[:2]
    rows = slice(int((top - around) * height), int((bottom + around) * height))
    return pixels[rows, int((left - around) * width) : int((right + around) * width)]


def beside_spline(studio: Studio, name: str) -> Measured:
    """Points moved by handles, and by the thin-plate spline of the same points."""
    frames: list[np.ndarray] = []

    def watch(replay: Replay, frame: np.ndarray) -> None:
        if replay.tick % EVERY == 0:
            frames.append(at_work(frame, replay))

    played = studio.play(name, watch=watch)
    studio.there_and_back(f"{name}.webp", frames)
    height, width = played.source.shape[:2]
    mine, theirs = played.displacement.astype(np.float64), spline_of(played.recipe, (width, height))
    other = studio.sampler.apply(
        GivenMap(studio.device, theirs.astype(np.float32)), played.source, how=Sampling(edges=played.recipe.edges)
    )
    ours, splines = ((*stretch_and_det(each), beyond(each)) for each in (mine, theirs))
    has_folds = bool((splines[1] <= 0).any())
    studio.sheet(
        name,
        f"{played.recipe.name}, and the same by a thin-plate spline",
        [
            ("a  source; handles and pins", led(played.source, played.recipe)),
            ("b  handles", marked(played.result, ours[1])),
            (f"c  thin-plate spline; {'folds in red' if has_folds else 'no folds'}", marked(other, splines[1])),
        ],
    )
    return {
        key: value
        for name, (stretch, det, outside) in (("handles", ours), ("spline", splines))
        for key, value in {
            f"{name}: stretch, mean": f"{stretch.mean():.3f}",
            f"{name}: 99th percentile": f"{np.percentile(stretch, 99):.2f}",
            f"{name}: least det": f"{det.min():.2f}",
            f"{name}: folds": f"{(det <= 0).sum()}",
            f"{name}: from beyond the edge": f"{outside:.1%}",
        }.items()
    }


FIGURES: dict[str, Callable[[Studio], Measured]] = {
    "figure-1": figure_1,
    "figure-3": figure_3,
    "figure-4": figure_4,
    "figure-5": partial(portrait, name="figure-5", what="lifting a corner of the mouth"),
    "figure-6": partial(portrait, name="figure-6", what="raising a brow"),
    "guide-forces": guide_forces,
    "guide-viscosity": guide_viscosity,
    **{name: partial(beside_spline, name=name) for name in ("handles-smile", "handles-tree", "handles-logo")},
}
BESIDES = "figure-1", "figure-5-freeze", "figure-6-freeze"  # what figures play besides the recipe of their name


def make(device: Device, folder: Path, progress: Progress) -> dict[str, Measured]:
    """Render every figure into `folder`; see `made`."""
    return made(device, folder, progress, FIGURES, sum(map(_ticks, (*FIGURES, *BESIDES))))


def _ticks(name: str) -> int:
    """How many are played of a recipe: on a page of the guide each force, or each layer, by itself."""
    recipe = load(name)
    alone = max(len(recipe.force), len(recipe.viscosity) + len(recipe.freeze)) if name.startswith("guide") else 1
    return recipe.ticks * alone

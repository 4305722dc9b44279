"""The paper's figures made again, a function each: result, animation, contact sheet, and what only they measure."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from app.media.animation import AnimationOptions, animation_writer
from app.media.auxiliary import Pictures
from app.media.depth import to_bits
from app.media.files import make_folder
from app.media.pictures import read_picture, write_picture
from app.media.recipes import read_recipe
from app.model.forces import CurveForce, GradientForce, PointForce
from app.model.handles import RecipeHandle
from app.model.masks import solid
from app.model.picture import Picture, srgb_to_linear
from app.model.recipe import Recipe
from app.progress import Progress
from app.work.export import displacement
from app.work.replay import Replay
from solver.gl.device import Device
from solver.grid import Grid
from solver.resample.plan import GivenMap, Sampling
from solver.resample.sampler import Sampler
from solver.warp.distortion import MapStatistics

FPS = 30
LINGER = 24  # frames that the last one stands still
WIDE, EVERY, STILL = 440, 4, 15  # of animations of handles: pixels, ticks a frame, frames that the ends stand still
COMPARED = 512  # pixels along the longer side, in which displacements are told

PAPER, INK, FORCE = (250, 249, 246), (38, 38, 44), (214, 40, 40)
PANEL, MARGIN, PER_ROW = 420, 28, 4

Numbers = dict[str, str]


@dataclass(frozen=True)
class Played:
    """A recipe that has been played to its end.

    Attributes:
        source, result: (h, w, 3) uint8.
        stills: the results at the times that were asked for.
        field: the sum of the forces at the cells' centres, (ny, nx, 2).
        viscosity: of the cells.
        displacement: the map at the centres of the pixels, (h, w, 2), longer sides.
    """

    recipe: Recipe
    grid: Grid
    source: np.ndarray
    result: np.ndarray
    stills: Mapping[float, np.ndarray]
    field: np.ndarray
    viscosity: np.ndarray
    displacement: np.ndarray
    statistics: MapStatistics


class Studio:
    """Plays recipes of the gallery and puts what comes of them into a folder."""

    def __init__(self, device: Device, folder: Path, progress: Progress) -> None:
        self.device = device
        self.folder = folder
        self.progress = progress
        self.sampler = Sampler(device)

    def release(self) -> None:
        """Free the textures."""
        self.sampler.release()

    def play(
        self,
        name: str,
        stills: Iterable[float] = (),
        save_as: str | None = None,
        watch: Callable[[Replay, np.ndarray], object] = lambda replay, frame: None,
        **parts: object,
    ) -> Played:
        """Play the recipe `name`, changed by `parts`, and write its result and animation; `watch` sees every frame."""
        recipe = load(name).edited(**parts)
        source = source_of(recipe)
        ticks = {round(time / recipe.fluid.dt): time for time in stills}
        kept: dict[float, np.ndarray] = {}
        frame = source
        label = save_as or name

        def show(replay: Replay) -> None:
            nonlocal frame
            frame = self._frame(replay, source)
            write(frame)
            watch(replay, frame)
            if replay.tick in ticks:
                kept[ticks[replay.tick]] = frame

        with animation_writer(self.folder / f"{label}.mp4", FPS, cancel=self.progress.cancel) as write:
            write(frame)
            with self.played(recipe, source, show) as replay:
                for _ in range(LINGER):
                    write(frame)
                found = Played(
                    recipe=recipe,
                    grid=replay.grid,
                    source=source,
                    result=frame,
                    stills=kept,
                    field=force_field(recipe, replay.grid, Pictures(Picture(source), recipes_folder())),
                    viscosity=replay.fluid.viscosity.get(),
                    displacement=displacement(replay, (source.shape[1], source.shape[0])).values,
                    statistics=replay.warp.statistics(),
                )
        write_picture(self.folder / f"{label}.png", Picture(frame))
        return found

    def still(self, recipe: Recipe) -> np.ndarray:
        """The result of a recipe of the gallery, (h, w, 3) uint8; nothing is written."""
        source = source_of(recipe)
        with self.played(recipe, source) as replay:
            return self._frame(replay, source)

    @contextmanager
    def played(
        self, recipe: Recipe, source: np.ndarray, show: Callable[[Replay], None] = lambda replay: None
    ) -> Iterator[Replay]:
        """Yield a replay of a recipe on a picture, (h, w, 3) uint8, at its end; `show` sees it after every tick."""
        replay = Replay(self.device, recipe, Pictures(Picture(source), recipes_folder()), budget=0)
        try:
            for _ in range(recipe.ticks):
                replay.advance()
                show(replay)
                self.progress.advance()
            yield replay
        finally:
            replay.release()

    def _frame(self, replay: Replay, source: np.ndarray) -> np.ndarray:
        if replay.density is not None:
            return (np.clip(replay.density.get()[..., :3], 0, 1) * 255 + 0.5).astype(np.uint8)
        how = Sampling(edges=replay.recipe.edges, samples=replay.recipe.output.samples)
        return self.sampler.apply(replay.warp, source, how=how)

    def there_and_back(self, name: str, frames: list[np.ndarray]) -> None:
        """Write a small animation that stands still at both ends, and goes on without one."""
        lasting = [1] * (2 * len(frames) - 2)
        lasting[0] = lasting[len(frames) - 1] = STILL
        path, how = self.folder / name, AnimationOptions(quality=60, durations=lasting)
        with animation_writer(path, FPS / 2, how, cancel=self.progress.cancel) as write:
            for frame in (*frames, *frames[-2:0:-1]):
                write(frame)

    def sheet(self, name: str, title: str, panels: list[tuple[str, np.ndarray]], height: int = PANEL) -> None:
        """Write a contact sheet: panels of one height side by side, with their captions."""
        write_picture(self.folder / f"{name}-sheet.png", Picture(contact_sheet(title, panels, height)))


def recipes_folder() -> Path:
    """Where the gallery's recipes and pictures lie."""
    return Path(str(resources.files("assets"))) / "gallery"


def load(name: str) -> Recipe:
    """A recipe of the gallery."""
    return read_recipe(recipes_folder() / f"{name}.toml")


def source_of(recipe: Recipe) -> np.ndarray:
    """The picture that a recipe of the gallery warps, (h, w, 3) uint8."""
    assert recipe.picture is not None
    return rgb(read_picture(recipes_folder() / recipe.picture).pixels)


def rgb(pixels: np.ndarray) -> np.ndarray:
    """(h, w, 3) uint8 of any picture."""
    return np.ascontiguousarray(np.broadcast_to(to_bits(pixels, 8)[..., :3], (*pixels.shape[:2], 3)))


# The figures --------------------------------------------------------------------------------------------------------


def figure_1(studio: Studio) -> Numbers:
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
        **_shape(moved),
    }


def figure_3(studio: Studio) -> Numbers:
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
    return _shape(train)


def figure_4(studio: Studio) -> Numbers:
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
    return _shape(hat)


def figure_5(studio: Studio) -> Numbers:
    """Lifting a corner of the mouth."""
    return _portrait(studio, "figure-5", "lifting a corner of the mouth")


def figure_6(studio: Studio) -> Numbers:
    """Raising a brow."""
    return _portrait(studio, "figure-6", "raising a brow")


def guide_forces(studio: Studio) -> Numbers:
    """One force of each kind, on the same picture."""
    recipe = load("guide-forces")
    panels = [("the picture", source_of(recipe))]
    panels += [(force.name, studio.still(recipe.edited(force=(force,)))) for force in recipe.force]
    studio.sheet("guide-forces", "Kinds of force", panels, 260)
    return {}


def guide_viscosity(studio: Studio) -> Numbers:
    """One push through fluids of different viscosity."""
    recipe = load("guide-viscosity")
    alone = [(layer.name, recipe.edited(viscosity=(layer,), freeze=())) for layer in recipe.viscosity]
    alone += [(layer.name, recipe.edited(viscosity=recipe.viscosity[:1], freeze=(layer,))) for layer in recipe.freeze]
    panels = [("the picture", source_of(recipe)), *((name, studio.still(one)) for name, one in alone)]
    studio.sheet("guide-viscosity", "One push, different viscosities", panels, 260)
    return {}


def handles_smile(studio: Studio) -> Numbers:
    """A smile by handles."""
    return _beside_spline(studio, "handles-smile", "A smile by handles, and by a thin-plate spline")


def handles_tree(studio: Studio) -> Numbers:
    """Trees bent along curves."""
    return _beside_spline(studio, "handles-tree", "Trees bent along curves, and by a thin-plate spline")


def handles_logo(studio: Studio) -> Numbers:
    """A logo fitted to an outline, and the handles at work on it, for the README."""
    return _beside_spline(studio, "handles-logo", "A logo fitted to a heart, and by a thin-plate spline")


FIGURES: dict[str, Callable[[Studio], Numbers]] = {
    "figure-1": figure_1,
    "figure-3": figure_3,
    "figure-4": figure_4,
    "figure-5": figure_5,
    "figure-6": figure_6,
    "guide-forces": guide_forces,
    "guide-viscosity": guide_viscosity,
    "handles-smile": handles_smile,
    "handles-tree": handles_tree,
    "handles-logo": handles_logo,
}
HANDLES = ("handles-smile", "handles-tree", "handles-logo")
RECIPES = (
    "figure-1",
    "figure-1",
    "figure-3",
    "figure-4",
    "figure-5",
    "figure-5-freeze",
    "figure-6",
    "figure-6-freeze",
    *HANDLES,
)
GUIDE = ("guide-forces", "guide-viscosity")


def _beside_spline(studio: Studio, name: str, title: str) -> Numbers:
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
    studio.sheet(
        name,
        title,
        [
            ("a  source; handles and pins", led(played.source, played.recipe)),
            ("b  handles", marked(played.result, ours[1])),
            ("c  thin-plate spline; folds in red", marked(other, splines[1])),
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


def _panels(recipe: Recipe) -> int:
    """The ticks of a page of the guide: each force, or each layer, is played by itself."""
    return recipe.ticks * max(len(recipe.force), len(recipe.viscosity) + len(recipe.freeze))


def _portrait(studio: Studio, name: str, what: str) -> Numbers:
    thick, frozen = studio.play(name), studio.play(f"{name}-freeze")
    pictures = Pictures(Picture(thick.source), recipes_folder())
    (lift,) = thick.recipe.force
    assert isinstance(lift, GradientForce)
    studio.sheet(
        name,
        f"Figure {name[-1]}: {what}",
        [
            ("a  source", thick.source),
            ("b  viscosity: dark flows", shades(thick.viscosity, thick.source)),
            (
                "c  forces: the gradient of this",
                arrows(rgb(pictures.load(lift.picture).pixels), thick.field, 40, pale=0.0),
            ),
            ("d  result", thick.result),
            ("e  source, near", _near(thick.source, lift)),
            ("f  result, near", _near(thick.result, lift)),
            ("g  frozen outside, near", _near(frozen.result, lift)),
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
        "det J": _range(thick),
        "frozen: det J": _range(frozen),
    }


def _near(pixels: np.ndarray, force: GradientForce) -> np.ndarray:
    """The part of a picture about the window a force acts in."""
    assert force.within is not None
    around = 0.08
    left, top, right, bottom = force.within.box
    height, width = pixels.shape[:2]
    rows = slice(int((top - around) * height), int((bottom + around) * height))
    return pixels[rows, int((left - around) * width) : int((right + around) * width)]


def _shape(played: Played) -> Numbers:
    return {"px, most": f"{played.statistics.displacement_max * COMPARED:.1f}", "det J": _range(played)}


def _range(played: Played) -> str:
    return f"{played.statistics.det_min:.2f} to {played.statistics.det_max:.2f}"


def make(device: Device, folder: Path, progress: Progress) -> dict[str, Numbers]:
    """Render every figure into `folder`; returns what was measured on each.

    Raises:
        UserError: if the folder cannot be written to.
        Cancelled: if `progress` says so.
    """
    make_folder(folder)
    progress.total = sum(load(name).ticks for name in RECIPES) + sum(_panels(load(name)) for name in GUIDE)
    studio = Studio(device, folder, progress)
    try:
        numbers = {name: figure(studio) for name, figure in FIGURES.items()}
        return {name: found for name, found in numbers.items() if found}
    finally:
        studio.release()


# What is measured ---------------------------------------------------------------------------------------------------


def light(pixels: np.ndarray) -> np.ndarray:
    """The luminance (h, w) float64 of (h, w, 3) uint8, in linear light: what pictures are mixed in."""
    return srgb_to_linear(pixels / 255) @ np.array([0.2126, 0.7152, 0.0722])


def sharpness(luminance: np.ndarray) -> float:
    """Gradient energy: the squared gradient of the luminance (h, w), summed over all pixels but the outermost two."""
    rows, columns = np.gradient(luminance)
    return float((rows**2 + columns**2)[2:-2, 2:-2].sum())


def spline_warp(values: np.ndarray, displacement: np.ndarray) -> np.ndarray:
    """`values` (h, w) at x + D(x) for the centres x of the pixels, by the interpolating cubic B-spline, in float64.

    The reference that sharpness is measured against: the picture at the very places that the map (h, w, 2) names,
    clamped at the edge. No pixel of it is an average.
    """
    height, width = values.shape
    coefficients = values
    for n in (height, width):
        # The spline whose values at the pixels are the picture's; its ends mirror.
        matrix = np.diag(np.full(n, 4.0)) + np.diag(np.ones(n - 1), 1) + np.diag(np.ones(n - 1), -1)
        matrix[0, 1] = matrix[-1, -2] = 2.0
        coefficients = np.linalg.solve(matrix / 6, coefficients).T
    row, column = np.mgrid[0:height, 0:width]
    row = np.clip(row + displacement[..., 1] * max(height, width), 0, height - 1)
    column = np.clip(column + displacement[..., 0] * max(height, width), 0, width - 1)
    result = np.zeros(row.shape)
    top, left = np.floor(row).astype(int), np.floor(column).astype(int)
    for i, row_weight in enumerate(_spline_weights(row - top), -1):
        for j, column_weight in enumerate(_spline_weights(column - left), -1):
            result += row_weight * column_weight * coefficients[_mirrored(top + i, height), _mirrored(left + j, width)]
    return result


def _spline_weights(t: np.ndarray) -> tuple[np.ndarray, ...]:
    return (1 - t) ** 3 / 6, 2 / 3 - t**2 + t**3 / 2, 2 / 3 - (1 - t) ** 2 + (1 - t) ** 3 / 2, t**3 / 6


def _mirrored(index: np.ndarray, n: int) -> np.ndarray:
    return n - 1 - np.abs(n - 1 - np.abs(index))


def spline_of(recipe: Recipe, size: tuple[int, int]) -> np.ndarray:
    """The displacement (h, w, 2) of the thin-plate spline that looks up the handles' points where they go, and pins."""
    from scipy.interpolate import RBFInterpolator

    extent = np.array(size) / max(size)
    ends = np.array([*(each.goal or each.at for each in recipe.handle), *(each.at for each in recipe.pin)]) * extent
    starts = np.array([each.at for each in (*recipe.handle, *recipe.pin)]) * extent
    fitted = RBFInterpolator(ends, starts - ends, kernel="thin_plate_spline")
    x, y = ((np.arange(n) + 0.5) / max(size) for n in size)
    return fitted(np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)).reshape(size[1], size[0], 2)


def stretch_and_det(displacement: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """At each pixel the larger of stretch and its inverse, and det J, by differences of pixels."""
    h = 1 / max(displacement.shape[:2])
    slopes = [np.gradient(displacement, h, axis=axis) for axis in (1, 0)]
    jacobian = np.stack(slopes, axis=-1) + np.eye(2)
    # The singular values of a 2 x 2 matrix: the sum of their squares is that of its entries, their product the det.
    squares, det = (jacobian**2).sum(axis=(-2, -1)), np.linalg.det(jacobian)
    largest = np.sqrt((squares + np.sqrt(np.maximum(squares**2 - 4 * det**2, 0))) / 2)
    return np.maximum(largest, 1 / np.maximum(abs(det) / np.maximum(largest, 1e-12), 1e-3)), det


def beyond(displacement: np.ndarray) -> float:
    """The part of the pixels that look up what is outside the picture, by more than half a pixel."""
    height, width = displacement.shape[:2]
    y, x = np.mgrid[:height, :width] + 0.5 + np.moveaxis(displacement[..., ::-1], -1, 0) * max(height, width)
    return float(((x < -0.5) | (x > width + 0.5) | (y < -0.5) | (y > height + 0.5)).mean())


# What is shown ------------------------------------------------------------------------------------------------------


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
    """A picture with the ways of a recipe's handles, and its pins as rings."""
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
    """A frame, `WIDE` pixels wide, with handles as dots on their ways to rings, and pins as rings with a dot."""
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
    """A picture with the pixels where its map folds in red."""
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

"""Playing the gallery's recipes: results, animations and contact sheets in a folder."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

import numpy as np

from app.gallery.drawing import PANEL, contact_sheet, force_field, rgb
from app.media.animation import AnimationOptions, animation_writer
from app.media.auxiliary import Pictures
from app.media.files import make_folder
from app.media.pictures import read_picture, write_picture
from app.media.recipes import read_recipe
from app.model.picture import Picture
from app.model.recipe import Recipe
from app.progress import Progress
from app.work.export import displacement
from app.work.replay import Replay
from solver.gl.device import Device
from solver.resample.plan import Sampling
from solver.resample.sampler import Sampler
from solver.warp.distortion import MapStatistics

FPS = 30
LINGER = 24  # frames that the last one stands still
STILL = 15  # frames that both ends of an animation there and back stand still

Measured = dict[str, str]
"""What was measured on a figure: numbers as they are printed, by what they are."""


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
        kept = {time: source for tick, time in ticks.items() if tick == 0}
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


def made(
    device: Device,
    folder: Path,
    progress: Progress,
    figures: Mapping[str, Callable[[Studio], Measured]],
    ticks: int,
) -> dict[str, Measured]:
    """Make figures in a folder, which play so many ticks together; what was measured on those that measure something.

    Raises:
        UserError: if the folder cannot be written to.
        Cancelled: if `progress` says so.
    """
    make_folder(folder)
    progress.total = ticks
    studio = Studio(device, folder, progress)
    try:
        measured = {name: figure(studio) for name, figure in figures.items()}
        return {name: numbers for name, numbers in measured.items() if numbers}
    finally:
        studio.release()

"""`fluidwarp fit`: a recipe, a picture and files of pairs made into the file of a fitted recipe."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from app.errors import UserError
from app.media.files import check_kept, replacing, writable
from app.media.landmarks import check_ending, read_pairs, write_pairs
from app.media.opening import Opened, check_picture
from app.media.project import picture_names
from app.model.recipe import Recipe
from app.progress import Progress
from app.work.fitting import Fitted, fitted
from app.work.tasks import opened
from solver.gl.device import Device


@dataclass(frozen=True)
class FitJob:
    """What is fitted, and where it is written.

    Attributes:
        recipe: a file, or the name of one that comes with fluidwarp.
        pairs: files of pairs; see `read_pairs`.
        output: the recipe that is written.
        arrived: where the points arrive, if that is written.
        image: the picture, instead of the recipe's own.
        evaluations: see `fitted`.
        max_pixels: larger pictures are refused.
    """

    recipe: str
    pairs: tuple[Path, ...]
    output: Path
    arrived: Path | None
    image: Path | None
    evaluations: int
    max_pixels: int

    def check(self) -> None:
        """Find out before the work what would keep it from being written. Raises `UserError`."""
        if self.output.suffix.lower() != ".toml":
            raise UserError(f"{self.output}: a fitted recipe is a file that ends with .toml")
        for path in filter(None, (self.output, self.arrived)):
            writable(path)
            for source in (*self.pairs, *filter(None, [self.image])):
                check_kept(source, path)
        if self.arrived is not None:
            check_ending(self.arrived)

    def perform(self, device: Device, progress: Progress) -> Fitted:
        """Do it. Raises `UserError`, and `Cancelled` if there is nothing to write yet."""
        progress.enter("reading")
        found = opened(self.recipe, self.max_pixels)
        picture = found.source(self.image, self.max_pixels).picture
        check_picture(picture)
        size = picture.width, picture.height
        recipe = self._placed(found)
        pairs = read_pairs(self.pairs, size)
        done = fitted(device, recipe, picture, found.folder, pairs, progress, self.evaluations)
        with replacing(self.output) as temporary:
            temporary.write_text(done.trial.recipe.text(), encoding="utf-8")
        if self.arrived is not None:
            write_pairs(self.arrived, done.pairs, size)
        return done

    def _placed(self, found: Opened) -> Recipe:
        """The recipe with its picture named from where it is written."""
        recipe, folder, target = found.recipe, found.folder, self.output.parent
        if found.project is not None or os.path.realpath(folder) != os.path.realpath(target):
            for name in picture_names(recipe.edited(picture=None)):
                if not os.path.isabs(name):
                    raise UserError(f"{self.output}: write it beside {self.recipe}, which names {name} from there")
        if self.image is None and found.project is not None:
            return recipe.edited(picture=None)
        file = found.source_file(self.image)
        return recipe.edited(picture=file and Path(os.path.relpath(file, target)).as_posix())

"""A fit, as the window and `fluidwarp fit` ask for it: of a recipe's own handles, or of pairs in files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from app.errors import UserError
from app.media.files import check_kept, in_text, name_from, noticing, replacing, telling, writable
from app.media.landmarks import Pairs, check_ending, read_pairs, write_pairs
from app.media.opening import Opened
from app.media.outlines import read_outlines
from app.media.project import picture_names
from app.model.recipe import Recipe
from app.progress import Progress
from app.work.fitting import Fit, Fitted
from app.work.tasks import opened
from solver.gl.device import Device


def pairs_in(
    files: Sequence[Path], masks: tuple[Path, Path] | None, size: tuple[int, int]
) -> tuple[Pairs | None, list[str]]:
    """All pairs of files, and of the outlines of two masks, for a picture of this size; None if nothing is given.

    Also what should be heard of it. Raises `UserError`, as `read_pairs` and `read_outlines`.
    """
    given, notices = [read_pairs(files, size)] if files else [], list[str]()
    if masks:
        outline, notices = read_outlines(*masks, size)
        given.append(Pairs(outline / size, ("outline",) * len(outline), frozenset(("outline",))))
    if not given:
        return None, notices
    places = np.concatenate([pairs.places for pairs in given])
    closed = frozenset[str]().union(*(pairs.closed for pairs in given))
    return Pairs(places, sum((pairs.curves for pairs in given), ()), closed), notices


@dataclass(frozen=True)
class FitJob:
    """What is fitted, and where it is written.

    Attributes:
        recipe: a file, or the name of one that comes with fluidwarp.
        pairs: files of pairs; see `read_pairs`.
        masks: two masks, whose outlines are pairs too; without these and without `pairs`, the recipe's own handles are.
        output: the recipe that is written.
        arrived: where the points arrive, if that is written.
        image: the picture, instead of the recipe's own.
        evaluations, local: see `Fit`.
        max_pixels: larger pictures are refused.
    """

    recipe: str
    pairs: tuple[Path, ...]
    masks: tuple[Path, Path] | None
    output: Path
    arrived: Path | None
    image: Path | None
    evaluations: int
    local: float | None
    max_pixels: int

    def check(self) -> None:
        """Find out before the work what would keep it from being written. Raises `UserError`."""
        if self.output.suffix.lower() != ".toml":
            raise UserError(f"{self.output}: a fitted recipe is a file that ends with .toml")
        for path in filter(None, (self.output, self.arrived)):
            writable(path)
            for source in (Path(self.recipe), *self.pairs, *(self.masks or ()), *filter(None, [self.image])):
                check_kept(source, path)
        if self.arrived is not None:
            check_ending(self.arrived)

    def perform(self, device: Device, progress: Progress) -> Fitted:
        """Do it. Raises `UserError`, and `Cancelled` if there is nothing to write yet."""
        progress.enter("reading")
        found = opened(self.recipe, self.max_pixels)
        source = found.source(self.image, self.max_pixels)
        picture = source.picture
        size = picture.width, picture.height
        pairs, notices = pairs_in(self.pairs, self.masks, size)
        how = self.evaluations, self.local, source.clip, found.label
        fit = Fit(self._placed(found), picture, found.folder, pairs, *how)
        told: list[str] = []
        whole = noticing(self.output, told.append)
        done = fit.perform(device, progress)
        with replacing(self.output, whole=whole) as temporary:
            temporary.write_text(done.trial.recipe.text(), encoding="utf-8")
        if self.arrived is not None:
            with telling([self.output]):
                write_pairs(self.arrived, done.pairs, size)
        return replace(done, notices=(*notices, *done.notices, *told))

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
        return recipe.edited(picture=file and in_text(name_from(target, file)))

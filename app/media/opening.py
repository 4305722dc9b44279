"""Finding what a name on the command line, or a dropped file, stands for."""

from __future__ import annotations

import os
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from app.errors import UserError
from app.media.inputs import MAX_PIXELS
from app.media.project import Project, is_project, load, named_in
from app.media.recipes import read_recipe
from app.media.source import CLIP_ENDINGS, PICTURE_ENDINGS, Source, open_source
from app.model.picture import Picture
from app.model.recipe import Recipe
from solver.grid import MOST_ALONG, SMALLEST_GRID

SMALLEST_SIDE = 8  # pixels


def check_picture(picture: Picture, name: str = "the picture") -> None:
    """Make sure that a picture can be covered by cells that are about square; `name`: what it is called.

    Raises:
        UserError: if it is too small or too narrow for any grid.
    """
    shorter, longer = sorted((picture.width, picture.height))
    size = f"{name} is {picture.width} x {picture.height} pixels"
    if shorter < SMALLEST_SIDE:
        raise UserError(f"{size}; a side must have at least {SMALLEST_SIDE}, so enlarge or crop it")
    if SMALLEST_GRID * longer > MOST_ALONG * shorter:
        raise UserError(f"{size}, too narrow for any grid; crop it")


@dataclass(frozen=True)
class Opened:
    """A recipe that was found, and the folder that the names in it start from; `project` where it came from one."""

    recipe: Recipe
    folder: Path
    label: str
    project: Project | None = None

    def source_file(self, other: Path | None = None) -> Path | None:
        """The file of the picture or clip `other`, or else of the recipe's own; None if that is part of a project.

        Raises:
            UserError: if the recipe names none.
        """
        if other is not None:
            return other
        if self.project is not None:
            return None
        if self.recipe.picture is None:
            raise UserError(f"{self.label} names no picture; give one with --image, or a key 'picture' in it")
        return self.folder / self.recipe.picture

    def source(self, other: Path | None = None, max_pixels: int = MAX_PIXELS, animated: bool = True) -> Source:
        """The picture or clip `other`, or else the recipe's own; see `open_source`.

        Raises:
            UserError: if there is none, or it cannot be read.
        """
        file = self.source_file(other)
        if other is not None:
            return open_source(other, max_pixels, animated)
        if file is not None:
            with named_in(self.label, file):
                return open_source(file, max_pixels, animated)
        assert self.project is not None
        return Source(self.project.picture, self.project.clip if animated else None)


def shipped_recipes() -> dict[str, Path]:
    """The recipes that come with fluidwarp, by name."""
    folder = Path(str(resources.files("assets"))).resolve() / "recipes"
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def open_recipe(name: str, max_pixels: int = MAX_PIXELS) -> Opened:
    """The recipe in a file or a project, or the one of this name that comes with fluidwarp.

    max_pixels: of the picture in a project.

    Raises:
        UserError: if there is none, naming those that there are.
    """
    path = Path(name)
    if path.suffix.lower() in (*PICTURE_ENDINGS, *CLIP_ENDINGS):
        kind, out = ("clip", "out.mp4") if path.suffix.lower() in CLIP_ENDINGS else ("picture", "out.png")
        example = next(iter(shipped_recipes()), "RECIPE")
        raise UserError(f"{name} is a {kind} and not a recipe; try: fluidwarp render {example} {name} -o {out}")
    if not os.path.exists(path) and path.suffix == "":
        known = shipped_recipes()
        if name not in known:
            raise UserError(f"{name} does not exist; recipes that come with fluidwarp: {', '.join(known) or 'none'}")
        path = known[name]
    if is_project(path):
        project = load(path, max_pixels)
        return Opened(project.recipe, project.folder, str(path), project)
    return Opened(read_recipe(path), path.parent, str(path))

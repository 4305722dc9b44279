"""What is asked for: a recipe, what is edited in it, a picture, and the names of what is written of it."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from app.errors import UserError
from app.media.animation import ANIMATIONS
from app.media.files import cannot_write, check_kept, is_sequence, takes_place
from app.media.formats import FORMATS
from app.media.inputs import MAX_PIXELS
from app.media.opening import CLIP_ENDINGS, Opened, open_recipe
from app.media.project import picture_names
from app.model.recipe import Recipe
from app.work.jobs import Job, Outputs

NAME = "{name}"
"""What stands for the name of each picture in the name of an output."""

COMMAND_LINE = "the command line"
FLAGS = {  # by which the command line sets a key of the recipe
    "'fluid.grid'": "--grid", "'fluid.solver'": "--solver", "'output.size'": "--size", "'output.fps'": "--fps",
    "'output.quality'": "--quality", "'time.start'": "--from", "'time.end'": "--to", "'duration'": "--duration",
    "time: 'end'": "--to", "'start'": "--from", "'edges'": "--edges",
}  # fmt: skip


@dataclass(frozen=True)
class Edits:
    """What is asked for instead of what the recipe says: keys of its tables, and keys of its own."""

    tables: tuple[tuple[str, tuple[tuple[str, Any], ...]], ...] = ()
    keys: tuple[tuple[str, Any], ...] = ()

    @classmethod
    def of(cls, tables: dict[str, dict[str, Any]], keys: dict[str, Any]) -> Edits:
        """Those that were given: not None."""
        given = {name: tuple((k, v) for k, v in table.items() if v is not None) for name, table in tables.items()}
        return cls(
            tuple((name, table) for name, table in given.items() if table),
            tuple((name, value) for name, value in keys.items() if value is not None),
        )

    def applied(self, recipe: Recipe) -> Recipe:
        """The recipe with them. Raises `UserError` where they are no values for it."""
        parts = dict(self.keys)
        for name, table in self.tables:
            parts[name] = getattr(recipe, name).model_copy(update=dict(table))
        try:
            return recipe.edited(**parts).checked(COMMAND_LINE) if parts else recipe
        except UserError as error:
            said = str(error).removeprefix(f"{COMMAND_LINE}: ")
            for key, flag in FLAGS.items():
                said = said.replace(key, flag)
            raise UserError(said) from None


@dataclass(frozen=True)
class Task:
    """One picture of a batch, in names only, so that any process that sees the same files can do it.

    Attributes:
        recipe: its file, or the name of one that comes with fluidwarp.
        edits: to the recipe.
        picture: the picture or clip; None is the recipe's own.
        outputs: what is written; "{name}" in their names stands for the picture's.
        max_pixels: larger pictures are refused.
    """

    recipe: str
    edits: Edits
    picture: Path | None
    outputs: Outputs
    max_pixels: int = MAX_PIXELS

    @property
    def label(self) -> str:
        """What the user calls it."""
        return str(self.picture or self.recipe)

    def named(self) -> Task:
        """The task with the picture's name where "{name}" stands in the names of what it writes."""
        picture = self.picture
        if picture is None:
            return self
        return replace(self, outputs=self.outputs.renamed(lambda path: named(path, picture)))

    def check_names(self, read: Sequence[Path]) -> None:
        """Raise `UserError` if two of its outputs are one file, or one of them is among the files `read`."""
        seen: set[str] = set()
        for path in self.outputs.files:
            for source in read:
                check_kept(source, path)
            real = os.path.realpath(path)
            if real in seen:
                raise UserError(f"{path} cannot hold two results; give --output, --map and --stats different names")
            seen.add(real)

    def job(self, opened: Opened | None = None) -> Job:
        """The job, with its picture read. Raises `UserError`."""
        opened = opened or _opened(self.recipe, self.max_pixels)
        file = opened.source_file(self.picture)
        own = opened.recipe if self.picture is None else opened.recipe.edited(picture=None)
        read = [Path(opened.label), *(opened.folder / name for name in picture_names(own))]
        self.check_names(read if file is None else [*read, file])
        source = opened.source(self.picture, self.max_pixels)
        return Job(self.edits.applied(opened.recipe), source.picture, opened.folder, self.outputs, source.clip)


@lru_cache(maxsize=4)
def _opened(name: str, max_pixels: int) -> Opened:
    return open_recipe(name, max_pixels)


def spread(task: Task, pictures: Sequence[Path]) -> list[Task]:
    """The task for each of the pictures: its output is a folder, which is made, or a name with "{name}" in it.

    In a folder they keep their names and endings, or get .png where theirs cannot be written.

    Raises:
        UserError: if two would be written to the same file, or one to where it is read from.
    """
    recipe = str(Path(task.recipe).absolute()) if os.path.exists(task.recipe) else task.recipe
    output, stats, maps = task.outputs.file, task.outputs.stats, task.outputs.maps
    folder = output if NAME not in str(output) else None
    if folder is not None and folder.suffix and not os.path.isdir(folder):
        raise UserError(f"{len(pictures)} pictures cannot all become {output}; write a folder, or out/{NAME}.png")
    for path in (stats, maps and maps.path):
        if path is not None and NAME not in str(path) and len(pictures) > 1:
            raise UserError(f"{len(pictures)} pictures cannot all write {path}; put {NAME} into its name")
    tasks = []
    for picture in pictures:
        into = output and (output if NAME in str(output) else output / (picture.stem + _ending(picture)))
        one = replace(task, recipe=recipe, picture=picture, outputs=replace(task.outputs, file=into)).named()
        tasks.append(replace(one, outputs=one.outputs.renamed(Path.absolute)))
    _check_apart(tasks)
    if folder is not None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise cannot_write(folder, error) from None
    # A cluster's workers do not start from this folder.
    return [replace(one, picture=one.picture and one.picture.absolute()) for one in tasks]


def _ending(picture: Path) -> str:
    suffix = picture.suffix.lower()
    if suffix in CLIP_ENDINGS:
        return picture.suffix if suffix in ANIMATIONS else ".mp4"
    return picture.suffix if suffix in FORMATS else ".png"


def _check_apart(tasks: Sequence[Task]) -> None:
    """Raise `UserError` if two would be written to one file, or one to where any is read from."""
    pictures = {os.path.realpath(task.picture): task.picture for task in tasks if task.picture is not None}
    seen: dict[str, Path | None] = {}
    for task in tasks:
        task.check_names([] if task.picture is None else [task.picture])
        for path in task.outputs.files:
            real = os.path.realpath(path)
            replaced = [real] if real in pictures else pictures if is_sequence(real) else []
            for other in replaced:
                if takes_place(real, other):
                    raise UserError(f"{pictures[other]} would be replaced by what {task.picture} becomes; rename one")
            if real in seen:
                raise UserError(f"{seen[real]} and {task.picture} would both become {path}; rename one")
            seen[real] = task.picture


def named(path: Path, picture: Path) -> Path:
    """`path` with the picture's name in place of "{name}"."""
    return Path(str(path).replace(NAME, picture.stem))

"""What is asked for: a recipe, what is edited in it, a picture, and the names of what is written of it."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Self, TypeVar

from app.errors import UserError
from app.media.encoders import ANIMATIONS
from app.media.files import check_folder, check_kept, ignores_capitals, make_folder, takes_place
from app.media.formats import FORMATS
from app.media.inputs import MAX_PIXELS
from app.media.numbered import is_sequence, stands_for_files, unnumbered
from app.media.opening import Opened, open_recipe
from app.media.project import frame_numbers, picture_names
from app.media.source import CLIP_ENDINGS
from app.model.recipe import Recipe
from app.model.windows import on_grid
from app.progress import Progress
from app.work.export import Report, run
from app.work.jobs import Job, Outputs
from solver.gl.device import Device

P = TypeVar("P", bound="Piece")

NAME = "{name}"
"""What stands for the name of each picture in the name of an output."""

COMMAND_LINE = "the command line"
FLAGS = {  # by which the command line sets a key of the recipe
    "'fluid.grid'": "--grid", "'fluid.solver'": "--solver", "'output.size'": "--size", "'output.fps'": "--fps",
    "'output.quality'": "--quality", "'time.start'": "--from", "'time.end'": "--to", "'duration'": "--duration",
    "'amount'": "--amount", "time: 'end'": "--to", "'start'": "--from", "'edges'": "--edges",
    "'output.filter'": "--filter",
}  # fmt: skip


def edited(recipe: Recipe, edits: Mapping[str, Any]) -> Recipe:
    """The recipe with what is asked for instead: keys of its own, and of its tables as "output.size"; None leaves one.

    Raises `UserError` where they are no values for it.
    """
    given = {name: value for name, value in edits.items() if value is not None}
    if not given:
        return recipe
    cells, parts = given.pop("fluid.grid", None), dict[str, Any]()
    for name, value in given.items():
        table, _, key = name.rpartition(".")
        if table:
            value = parts.get(table, getattr(recipe, table)).model_copy(update={key: value})
        parts[table or key] = value
    recipe = recipe.edited(**parts)
    if cells is not None:
        recipe = on_grid(recipe, cells)  # as the editor goes to another grid
    try:
        return recipe.checked(COMMAND_LINE)
    except UserError as error:
        said = str(error).removeprefix(f"{COMMAND_LINE}: ")
        for key, flag in FLAGS.items():
            said = said.replace(key, flag)
        raise UserError(said) from None


@dataclass(frozen=True, kw_only=True)
class Piece(ABC):
    """One picture of a batch, in names only, so that any process that sees the same files can do it.

    Attributes:
        picture: the picture or clip; of a recipe, None is its own.
        outputs: what is written; "{name}" in their names stands for the picture's.
        max_pixels: larger pictures are refused.
        folder: that it is written to, if that may have to be made.
    """

    picture: Path | None
    outputs: Outputs
    max_pixels: int = MAX_PIXELS
    folder: Path | None = None

    @property
    def label(self) -> str:
        """What the user calls it."""
        return str(self.picture or self.outputs.file)

    def named(self) -> Self:
        """The same with the picture's name where "{name}" stands in the names of what it writes.

        The folder of such a result is made.
        """
        picture = self.picture
        if picture is None:
            return self
        file = self.outputs.file
        folder = named(file, picture).parent if file is not None and NAME in str(file) else self.folder
        return replace(self, outputs=self.outputs.renamed(lambda path: named(path, picture)), folder=folder)

    def make_folder(self) -> None:
        """Called once all is read: what fails before that leaves no empty folder. Raises `UserError`."""
        if self.folder is not None:
            make_folder(self.folder)

    def located(self) -> Self:
        """The same with names that do not depend on the present folder: a cluster's workers do not start from it."""
        picture = self.picture and self.picture.absolute()
        return replace(self, picture=picture, outputs=self.outputs.renamed(Path.absolute))

    def check_names(self, read: Sequence[Path]) -> None:
        """Raise `UserError` if two of its outputs are one file, or one of them is among the files `read`."""
        seen = list[str]()
        for path in self.outputs.files:
            for source in read:
                check_kept(source, path)
            real = os.path.realpath(path)
            if any(takes_place(real, other) for other in seen):
                raise UserError(f"{path} cannot hold two results; give --output, --map and --stats different names")
            seen.append(real)

    @abstractmethod
    def perform(self, device: Callable[[], Device], progress: Progress) -> Report:
        """Do it, with a `device` once all is read and checked.

        Raises:
            UserError: what is wrong with what is read or written.
            Cancelled: if `progress` says so.
        """


@dataclass(frozen=True, kw_only=True)
class Task(Piece):
    """A picture that is warped by a recipe.

    Attributes:
        recipe: its file, or the name of one that comes with fluidwarp.
        edits: to the recipe; see `edited`.
    """

    recipe: str
    edits: Mapping[str, Any]

    @property
    def label(self) -> str:
        return str(self.picture or self.recipe)

    def located(self) -> Self:
        recipe = str(Path(self.recipe).absolute()) if os.path.exists(self.recipe) else self.recipe
        return replace(super().located(), recipe=recipe)

    def perform(self, device: Callable[[], Device], progress: Progress) -> Report:
        progress.enter("reading")  # a large picture takes its time too
        job = self.job()
        self.make_folder()
        job.check()
        progress.enter("")
        return run(device(), job, progress)

    def job(self) -> Job:
        """The job, with its picture read. Raises `UserError`."""
        found = opened(self.recipe, self.max_pixels)
        file = found.source_file(self.picture)
        own = found.recipe if self.picture is None else found.recipe.edited(picture=None)
        read = [Path(found.label), *(found.folder / name for name in picture_names(own))]
        self.check_names(read if file is None else [*read, file])
        animated = self.outputs.has_frames or bool(frame_numbers(own))
        source = found.source(self.picture, self.max_pixels, animated)
        recipe = edited(found.recipe, self.edits)
        return Job(recipe, source.picture, found.folder, self.outputs, source.clip, named_by=found.label)


def opened(name: str, max_pixels: int) -> Opened:
    """See `open_recipe`; read once in a process while the file stays as it is. Raises `UserError`."""
    try:
        file = os.stat(name)
    except (OSError, ValueError):  # one that is shipped, or none
        return open_recipe(name, max_pixels)
    return _opened(name, max_pixels, (file.st_ino, file.st_size, file.st_mtime_ns, file.st_ctime_ns))


@lru_cache(maxsize=4)
def _opened(name: str, max_pixels: int, state: tuple[int, ...]) -> Opened:
    return open_recipe(name, max_pixels)


def spread(piece: P, pictures: Sequence[Path]) -> list[P]:
    """The piece of work for each of the pictures: its output is a folder, or has "{name}" in it; a folder is made.

    In a folder they keep their names and endings, or get .png where theirs cannot be written.

    Raises:
        UserError: if two would be written to the same file, or one to where it is read from.
    """
    output, stats, maps = piece.outputs.file, piece.outputs.stats, piece.outputs.maps
    folder = output if NAME not in str(output) else None
    if folder is not None and folder.suffix and not os.path.isdir(folder):
        many = f"{len(pictures)} pictures cannot all" if len(pictures) > 1 else "a picture of a cluster cannot"
        raise UserError(f"{many} become {output}; write a folder, or out/{NAME}.png")
    for path in (stats, maps and maps.path):
        if path is not None and NAME not in str(path) and len(pictures) > 1:
            raise UserError(f"{len(pictures)} pictures cannot all write {path}; put {NAME} into its name")
    pieces = []
    for picture in pictures:
        into = output and (output if NAME in str(output) else output / (NAME + _ending(picture)))
        one = replace(piece, picture=picture, outputs=replace(piece.outputs, file=into)).named()
        pieces.append(replace(one, outputs=one.outputs.renamed(Path.absolute)))
    _check_apart(pieces)
    for folder in dict.fromkeys(one.folder for one in pieces if one.folder is not None):
        check_folder(folder)
    return [replace(one, folder=one.folder and one.folder.absolute()).located() for one in pieces]


def _ending(picture: Path) -> str:
    suffix = picture.suffix.lower()
    if suffix in CLIP_ENDINGS and not stands_for_files(picture):
        return picture.suffix if suffix in ANIMATIONS else ".mp4"
    return picture.suffix if suffix in FORMATS else ".png"


def _check_apart(tasks: Sequence[Piece]) -> None:
    """Raise `UserError` if two would be written to one file, or one to where any is read from."""
    pictures = {os.path.realpath(task.picture): task.picture for task in tasks if task.picture is not None}
    sequences = [real for real in pictures if stands_for_files(real)]
    seen: dict[str, Path | None] = {}
    folded: dict[str, str] = {}
    for task in tasks:
        task.check_names([] if task.picture is None else [task.picture])
        for path in task.outputs.files:
            real = os.path.realpath(path)
            replaced = [real] if real in pictures else pictures if is_sequence(real) else sequences
            for other in replaced:
                if takes_place(real, other):
                    raise UserError(f"{pictures[other]} would be replaced by what {task.picture} becomes; rename one")
            if real in seen:
                raise UserError(f"{seen[real]} and {task.picture} would both become {path}; rename one")
            alike = folded.setdefault(real.casefold(), real)
            if alike != real and os.path.dirname(alike) == os.path.dirname(real) and ignores_capitals(path.parent):
                raise UserError(f"{seen[alike]} and {task.picture} would both become {path} on this disk; rename one")
            seen[real] = task.picture
    for pattern in filter(is_sequence, seen):
        for path, picture in seen.items():
            if path != pattern and takes_place(pattern, path):
                raise UserError(f"{seen[pattern]} and {picture} would both become {path}; rename one")


def named(path: Path, picture: Path) -> Path:
    """`path` with the picture's name in place of "{name}": of a sequence with its number, if it is to be one too.

    Raises:
        UserError: if the name of a single picture would number files.
    """
    numbers = stands_for_files(picture)
    whole = not numbers or Path(path).suffix.lower() in FORMATS
    found = Path(str(path).replace(NAME, picture.stem if whole else unnumbered(picture)))
    if is_sequence(found) and not (numbers or is_sequence(path)):
        name = picture.name
        raise UserError(f"a result named after {name} would be a sequence of numbered files; rename {name}")
    return found

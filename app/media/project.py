"""Projects: one file that holds a recipe and its pictures, so that the work opens again anywhere, but for clips."""

from __future__ import annotations

import hashlib
import os
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath
from typing import Any

from app.errors import UserError, printable, shown
from app.media.clip import WHOLE, Clip
from app.media.files import check_kept, name_from, replacing
from app.media.inputs import MAX_PIXELS, MOST_TEXT, Archive, cannot_read, open_input, read_input, state_of
from app.media.leftovers import temporary_folder
from app.media.numbered import is_sequence, numbered_files
from app.media.recipes import read_recipe
from app.media.source import Source, open_source
from app.model.picture import Picture
from app.model.recipe import UNNAMED, Recipe
from app.model.sampling import SOURCE
from app.model.schema import plain

SUFFIX = ".fluidwarp"
RECIPE = "recipe.toml"
FORMAT = "format.txt"
VERSION = 1
MOST_BYTES = 4 * 2**30


@dataclass(frozen=True)
class Project:
    """A recipe with its pictures at hand.

    Attributes:
        recipe: its names of pictures start from `folder`.
        picture: the one that is warped; of a clip, its first frame.
        data: the bytes of the file it was read from, so that it can be saved when that file is gone; of a clip that is
            only referred to, what it is known again by.
        clip: what is warped, where it moves.
        label: what the recipe is called that names them.
        folder: where the recipe's names start from; a temporary one for a project that holds its pictures.
        path: the project's own file, if it has one.
        seen: that file as it was when it was read or written last; None where that was not by this project.
        embedded: pictures are kept in the project and not referred to.
        keeper: removes the temporary folder when the last copy of this project is gone.
    """

    recipe: Recipe
    picture: Picture = field(repr=False)
    data: bytes = field(repr=False)
    folder: Path
    path: Path | None = None
    embedded: bool = True
    keeper: tempfile.TemporaryDirectory[str] | None = field(default=None, repr=False)
    clip: Clip | None = field(default=None, repr=False)
    seen: tuple[int, ...] | None = field(default=None, repr=False)
    label: str = UNNAMED

    @property
    def is_overtaken(self) -> bool:
        """Something else has written into its file since."""
        return self.path is not None and self.seen is not None and state_of(self.path) not in (None, self.seen)

    @property
    def is_linked(self) -> bool:
        """Its clip is always referred to: a video, or the files of a sequence, is never kept in it."""
        return self.clip is not None and self.clip.is_linked

    @property
    def name(self) -> str:
        """What the person calls it."""
        return printable(self.path.stem if self.path else PurePosixPath(self.recipe.picture or "untitled").stem)


def is_project(path: str | os.PathLike[str]) -> bool:
    """True if the file's name, or else what it begins with, says that it is a project."""
    if Path(path).suffix.lower() == SUFFIX:
        return True
    try:
        with open_input(path) as stream:
            return stream.read(4) == b"PK\3\4"
    except (OSError, UserError):
        return False


def from_picture(path: str | os.PathLike[str], recipe: Recipe | None = None) -> Project:
    """A new project for a picture or a clip, or for another one than the recipe was made on.

    Raises:
        UserError: if it cannot be read.
    """
    path = Path(path)
    source, data = read_source(path)
    recipe = (recipe or Recipe()).edited(picture=path.name)
    return Project(recipe, source.picture, data, path.parent, clip=source.clip)


def from_recipe(path: str | os.PathLike[str]) -> Project:
    """A new project from a recipe's TOML file and the picture or clip it names.

    Raises:
        UserError: if one of them cannot be read.
    """
    path = Path(path)
    recipe = read_recipe(path)
    if recipe.picture is None:
        raise UserError(f"{path} names no picture; open a picture first, then apply the recipe to it")
    with named_in(path, path.parent / recipe.picture):
        source, data = read_source(path.parent / recipe.picture)
    return Project(recipe, source.picture, data, path.parent, clip=source.clip, label=str(path))


@contextmanager
def named_in(path: str | os.PathLike[str], file: Path) -> Iterator[None]:
    """Let a `UserError` of the block about a picture's or map's `file` also tell which recipe or project names it."""
    try:
        yield
    except UserError as error:
        head, gone = f"Cannot read {shown(str(file))}: ", "there is no such file; check the name"
        told, in_window = (
            said.replace(head, f"Cannot read {file}, which {path} names: ", 1).replace(gone, f"{gone}, or put it back")
            for said in (str(error), error.in_window)
        )
        raise UserError(told, error.status, in_window) from None


def load(path: str | os.PathLike[str], max_pixels: int = MAX_PIXELS) -> Project:
    """The project in a file, if its picture has no more than `max_pixels`.

    Raises:
        UserError: if it is none, is cut short, or was written by a newer fluidwarp.
    """
    path = Path(path)
    try:
        seen = state_of(path)
        with open_input(path, "project") as stream, Archive(stream) as archive:
            return replace(_read(path, archive, max_pixels), seen=seen)
    except (UserError, MemoryError):
        raise
    except OSError as error:
        raise cannot_read(path, error) from None
    except Exception:  # of a damaged archive: BadZipFile, zlib.error, NotImplementedError, RuntimeError, IndexError ...
        raise UserError(f"{path} is not a fluidwarp project, or is cut short or damaged; get it again") from None


def save(project: Project, path: str | os.PathLike[str], embedded: bool = True) -> Project:
    """Write a project whole or not at all; the project as it is saved. What was there is kept as `backup_of(path)`.

    Raises:
        UserError: if it cannot be written, or a picture that belongs in it is gone.
    """
    path, embedded = Path(path), embedded and not project.is_linked
    recipe, files = _packed(project) if embedded else (_referring(project, path), {})
    with (
        replacing(path, backup_of(path)) as temporary,
        zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive,
    ):
        archive.writestr(FORMAT, f"fluidwarp project {VERSION}\n")
        archive.writestr(RECIPE, recipe.text())
        for name, data in files.items():
            archive.writestr(name, data, zipfile.ZIP_STORED)  # pictures are compressed already
    return replace(project, path=path, embedded=embedded, seen=state_of(path))


def backup_of(path: Path) -> Path:
    """Where the project that was in `path` before the last one is kept, under the name that editors give it."""
    target = Path(os.path.realpath(path))
    return target.with_name(f"{target.name}~")


def picture_bytes(file: Path) -> bytes:
    """All of a picture's file. Raises `UserError`."""
    return read_input(file, "picture", MOST_BYTES)


def read_source(file: Path, max_pixels: int = MAX_PIXELS) -> tuple[Source, bytes]:
    """A picture or a clip, and the `data` that a project has of it. Raises `UserError`."""
    source = open_source(file, max_pixels)
    clip, picture = source.clip, source.picture
    if clip is None or not clip.is_linked:
        return source, picture_bytes(file)
    clip.check(WHOLE)
    if clip.frames is None:
        clip = replace(clip, frames=sum(1 for _ in clip.pictures()))
    known = repr((clip.fps, clip.frames, picture.pixels.shape)).encode() + picture.pixels.tobytes()
    return Source(picture, clip), hashlib.sha256(known).digest()


def _read(path: Path, archive: Archive, max_pixels: int) -> Project:
    names = set(archive.namelist())
    if max(archive.getinfo(name).file_size for name in (FORMAT, RECIPE)) > MOST_TEXT:
        raise UserError(f"{path} holds a recipe of more than {MOST_TEXT >> 20} MB; get it again")
    words = archive.member(FORMAT).decode().split()
    if words[:2] != ["fluidwarp", "project"]:
        raise ValueError
    if int(words[2]) > VERSION:
        raise UserError(
            f"{path} was written by a newer fluidwarp (project format {words[2]}, this one reads up to {VERSION}); "
            "install a newer fluidwarp"
        )
    recipe = Recipe.decode(archive.member(RECIPE), f"the recipe in {path}")
    if recipe.picture is None:
        raise ValueError
    held = [name for name in picture_names(recipe) if name in names]
    if any(Path(name).name in ("", "..") for name in held):  # no file can be called that
        raise ValueError
    embedded = recipe.picture in names
    if not embedded:
        with named_in(path, path.parent / recipe.picture):
            source, data = read_source(path.parent / recipe.picture, max_pixels)
        return Project(
            recipe, source.picture, data, path.parent, path, embedded=False, clip=source.clip, label=str(path)
        )
    if sum(archive.getinfo(name).file_size for name in held) > MOST_BYTES:
        raise UserError(f"{path} holds pictures of more than {MOST_BYTES >> 30} GB")
    keeper = temporary_folder()
    folder = Path(keeper.name)
    for name in held:
        archive.unpack(name, folder)
    data = archive.member(recipe.picture)
    file = folder / recipe.picture
    try:
        source = open_source(file, max_pixels)
    except UserError as error:  # the temporary folder is nobody's business
        told, in_window = (
            said.replace(shown(str(file)), f"{recipe.picture} in {path}") for said in (str(error), error.in_window)
        )
        raise UserError(told, error.status, in_window) from None
    return Project(recipe, source.picture, data, folder, path, keeper=keeper, clip=source.clip, label=str(path))


def _packed(project: Project) -> tuple[Recipe, dict[str, bytes]]:
    """The recipe with the names its pictures get in the archive, and their bytes."""
    files: dict[str, bytes] = {}
    new_names: dict[str, str] = {}
    for name in picture_names(project.recipe):
        inside = _text(name if _is_plain(name) else Path(name).name)
        while inside in files or inside in (RECIPE, FORMAT):
            inside = f"_{inside}"
        if name == project.recipe.picture:
            files[inside] = project.data
        else:
            try:
                files[inside] = picture_bytes(project.folder / name)
            except UserError as error:
                raise UserError(f"Cannot save the project. {error}") from None
        new_names[name] = inside
    if all(old == new for old, new in new_names.items()):
        return project.recipe, files
    return Recipe.model_validate(_renamed(plain(project.recipe), new_names)), files


def _referring(project: Project, path: Path) -> Recipe:
    """The recipe with names of pictures that start from the folder of `path`."""
    names = {}
    for name in picture_names(project.recipe):
        target = (project.folder / name).resolve()
        if not os.path.exists(target) and not (is_sequence(target) and numbered_files(target)):
            mend = "put it back" if project.is_linked else "keep the picture in the project instead"
            raise UserError(f"Cannot refer to {target}: it is gone; {mend}")
        names[name] = name_from(path.resolve().parent, target)
        if _text(names[name]) != names[name]:
            raise UserError(f"Cannot refer to {target}: its name is not text; keep the picture in the project instead")
    return Recipe.model_validate(_renamed(plain(project.recipe), names))


def _text(name: str) -> str:
    """The name of a file as it is stored: bytes in it that are no UTF-8 become "?"."""
    return name.encode("utf-8", "replace").decode()


def _is_plain(name: str) -> bool:
    """True if a name can be a member of an archive as it is."""
    place = PurePosixPath(name.replace("\\", "/"))
    return not place.is_absolute() and ".." not in place.parts and "\\" not in name and ":" not in name


def picture_names(recipe: Recipe) -> list[str]:
    """The names of all pictures of a recipe, its own first."""
    named = (value for key, value in _values(recipe) if isinstance(value, str) and key in PICTURE_KEYS)
    return list(dict.fromkeys([*filter(None, [recipe.picture]), *(name for name in named if name != SOURCE)]))


def check_pictures_kept(recipe: Recipe, folder: Path, output: Path) -> None:
    """Make sure that `output` takes the place of no picture that the recipe names from `folder`. Raises `UserError`."""
    for name in picture_names(recipe):
        check_kept(folder / name, output)


def frame_numbers(recipe: Recipe) -> list[int]:
    """Which frames of a clip a recipe looks at besides the first, counted from that."""
    return sorted({value for key, value in _values(recipe) if key == "frame"} - {0})


def _values(recipe: Recipe) -> Iterator[tuple[str, Any]]:
    """What a recipe sets, each number and text with its key; but for strokes and the like, which may have many."""

    def visit(data: Any, key: str = "") -> Iterator[tuple[str, Any]]:
        if isinstance(data, dict):
            for name, value in data.items():
                yield from visit(value, name)
        elif isinstance(data, (list, tuple)):
            for value in data:
                yield from visit(value, key)
        else:
            yield key, data

    painted = tuple(edit for edit in recipe.mask if edit.kind != "stroke")
    return visit(plain(recipe.edited(stroke=(), change=(), handle=(), pin=(), mask=painted)))


def _renamed(data: Any, names: dict[str, str], key: str = "") -> Any:
    if isinstance(data, dict):
        return {name: _renamed(value, names, name) for name, value in data.items()}
    if isinstance(data, (list, tuple)):
        return tuple(_renamed(value, names, key) for value in data)
    return names.get(data, data) if isinstance(data, str) and key in PICTURE_KEYS else data


PICTURE_KEYS = frozenset({"picture", "map", "mask"})
"""The keys of a recipe that name a picture, or a map."""

"""Projects: whole, self-contained, and never half-written."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.errors import UserError
from app.media import project as projects
from app.media.inputs import MOST_INDEX, state_of
from app.media.opening import open_recipe
from app.media.pictures import write_picture
from app.media.project import Project, picture_names
from app.model.picture import Picture
from app.model.recipe import UNNAMED, Recipe
from app.model.strokes import Stroke


@pytest.fixture
def made(tmp_path: Path) -> Project:
    dice = np.random.default_rng(1)
    write_picture(tmp_path / "photo.png", Picture(dice.integers(0, 255, (30, 40, 3), np.uint8)))
    stroke = Stroke(tool="push", samples=((0, 0.5, 0.5, 1.0), (3, 0.6123, 0.5, 0.5)))
    return projects.from_picture(tmp_path / "photo.png", Recipe(duration=0.25, stroke=(stroke,)))


def test_a_project_holds_every_picture_that_its_recipe_names(made: Project, tmp_path: Path) -> None:
    names = ("mask.png", "field.png", "layer.png")
    for name in names:
        (tmp_path / name).write_bytes((tmp_path / "photo.png").read_bytes())
    text = """
[[viscosity]]
kind = "picture"
picture = "layer.png"
scale = 1
[[freeze]]
kind = "picture"
segment = { mask = "mask.png" }
[[force]]
kind = "field"
picture = "field.png"
"""
    named = made.recipe.edited(**{key: getattr(Recipe.parse(text), key) for key in ("viscosity", "freeze", "force")})
    projects.save(replace(made, recipe=named), tmp_path / "work.fluidwarp")
    with zipfile.ZipFile(tmp_path / "work.fluidwarp") as archive:
        assert {*names, "photo.png"} < set(archive.namelist())


def test_pictures_of_one_name_from_several_folders_stay_apart(made: Project, tmp_path: Path) -> None:
    """Of layers and of masks that were loaded."""
    text, given = "", list[bytes]()
    for number in range(4):
        (tmp_path / f"{number}").mkdir()
        write_picture(file := tmp_path / f"{number}/m.png", Picture(np.full((8, 8, 1), 60 * number, np.uint8)))
        given.append(file.read_bytes())
        of = '"thickness"\ntick = 0\nwhite = 1' if number > 1 else ""
        text += f'[[{"mask" if of else "viscosity"}]]\nkind = "picture"\npicture = "../{number}/m.png"\n'
        text += f"of = {of}\n" if of else "scale = 1\n"
    (folder := tmp_path / "here").mkdir()
    parsed = Recipe.parse(text)
    recipe = made.recipe.edited(viscosity=parsed.viscosity, mask=parsed.mask)
    projects.save(replace(made, recipe=recipe, folder=folder), tmp_path / "work.fluidwarp")
    loaded = projects.load(tmp_path / "work.fluidwarp")
    named = [layer.picture for layer in (*loaded.recipe.viscosity, *loaded.recipe.mask)]  # pyright: ignore[reportAttributeAccessIssue]
    assert [(loaded.folder / name).read_bytes() for name in named] == given


def test_a_project_holds_everything(made: Project, tmp_path: Path) -> None:
    saved = projects.save(made, tmp_path / "work.fluidwarp")
    assert (saved.path, saved.name) == (tmp_path / "work.fluidwarp", "work")
    original = (tmp_path / "photo.png").read_bytes()
    (tmp_path / "photo.png").unlink()
    loaded = projects.load(tmp_path / "work.fluidwarp")
    assert loaded.recipe == made.recipe
    assert np.array_equal(loaded.picture.pixels, made.picture.pixels)
    assert loaded.data == original
    again = projects.save(loaded, tmp_path / "again.fluidwarp")
    assert projects.load(tmp_path / "again.fluidwarp").recipe == again.recipe


def test_every_way_to_a_project_tells_where_it_is_from(made: Project, tmp_path: Path) -> None:
    file, recipe, photo = tmp_path / "work.fluidwarp", tmp_path / "r.toml", tmp_path / "photo.png"
    recipe.write_text('picture = "photo.png"\nduration = 1\n')

    def told(project: Project) -> tuple[object, ...]:
        return project.label, project.path, project.seen, project.embedded, project.folder, project.keeper is None

    for embedded in (True, False):
        saved, seen = projects.save(made, file, embedded=embedded), state_of(file)
        assert told(saved) == (UNNAMED, file, seen, embedded, tmp_path, True)
        found = projects.load(file)
        folder = found.folder if embedded else tmp_path
        assert told(found) == (str(file), file, seen, embedded, folder, not embedded)
        assert (folder == tmp_path) != embedded
    assert told(projects.from_recipe(recipe)) == (str(recipe), None, None, True, tmp_path, True)
    assert told(projects.from_picture(photo, Recipe())) == (UNNAMED, None, None, True, tmp_path, True)


def test_a_project_can_refer_to_its_picture(made: Project, tmp_path: Path) -> None:
    (tmp_path / "inner").mkdir()
    path = tmp_path / "inner" / "work.fluidwarp"
    projects.save(made, path, embedded=False)
    with zipfile.ZipFile(path) as archive:
        assert "photo.png" not in archive.namelist()
    loaded = projects.load(path)
    assert not loaded.embedded
    assert loaded.recipe.picture == "../photo.png"
    (tmp_path / "photo.png").unlink()
    with pytest.raises(UserError, match=r"photo\.png"):
        projects.load(path)


def test_another_picture_gets_the_same_recipe(made: Project, tmp_path: Path) -> None:
    write_picture(tmp_path / "other.png", Picture(np.zeros((10, 20, 3), np.uint8)))
    other = projects.from_picture(tmp_path / "other.png", made.recipe)
    assert other.recipe.stroke == made.recipe.stroke
    assert other.recipe.picture == "other.png"


@pytest.mark.parametrize("name", [".", ".."])
def test_a_project_whose_picture_can_be_no_file_is_damaged(tmp_path: Path, name: str) -> None:
    with zipfile.ZipFile(tmp_path / "work.fluidwarp", "w") as archive:
        archive.writestr("format.txt", f"fluidwarp project {projects.VERSION}\n")
        archive.writestr("recipe.toml", f'picture = "{name}"')
        archive.writestr(name, b"of somebody")
    with pytest.raises(UserError, match=r"work\.fluidwarp is not a fluidwarp project, or is cut short or damaged"):
        projects.load(tmp_path / "work.fluidwarp")


def test_a_newer_project_says_so(made: Project, tmp_path: Path) -> None:
    path = tmp_path / "work.fluidwarp"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("format.txt", f"fluidwarp project {projects.VERSION + 1}\n")
        archive.writestr("recipe.toml", 'picture = "photo.png"')
    with pytest.raises(UserError, match="was written by a newer fluidwarp"):
        projects.load(path)


@pytest.mark.parametrize("told", ["fluidwarp notes 1", "other project 1"])
def test_what_does_not_say_that_it_is_a_project_is_none(made: Project, tmp_path: Path, told: str) -> None:
    path = tmp_path / "work.fluidwarp"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("format.txt", told)
        archive.writestr("recipe.toml", 'picture = "photo.png"')
    with pytest.raises(UserError, match=r"work\.fluidwarp is not a fluidwarp project"):
        projects.load(path)


@pytest.mark.parametrize("part", [0, 3, 100, 0.5, 0.99])
def test_a_project_cut_short_says_so(made: Project, tmp_path: Path, part: float) -> None:
    path = tmp_path / "work.fluidwarp"
    projects.save(made, path)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(part * len(whole) if part < 1 else part)])
    with pytest.raises(UserError, match=r"work\.fluidwarp"):
        projects.load(path)


def test_the_temporary_folder_is_not_told_whatever_the_name_of_the_picture(made: Project, tmp_path: Path) -> None:
    path = tmp_path / "work.fluidwarp"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("format.txt", "fluidwarp project 1\n")
        archive.writestr("recipe.toml", 'picture = "\\u001b[31mx.png"')
        archive.writestr("\x1b[31mx.png", b"none")
    with pytest.raises(UserError) as caught:
        projects.load(path)
    assert str(caught.value).startswith(rf"Cannot read \x1b[31mx.png in {path}: it is not a picture")


def test_a_bomb_is_refused_before_it_is_unpacked(made: Project, tmp_path: Path) -> None:
    path = tmp_path / "work.fluidwarp"
    projects.save(made, path)
    with pytest.raises(UserError, match=rf"photo\.png in {path}: .* are more than the limit of 10;"):
        projects.load(path, max_pixels=10)
    assert projects.load(path, max_pixels=10_000).picture.width == made.picture.width
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("format.txt", "fluidwarp project 1\n")
        with archive.open("recipe.toml", "w") as stream:
            for _ in range(200):
                stream.write(b"#" * 2**20)
    assert path.stat().st_size < 2**20
    with pytest.raises(UserError, match=r"work\.fluidwarp holds a recipe of more than 64 MB"):
        projects.load(path)


@pytest.mark.parametrize("beyond", [0, 1])
def test_a_list_of_members_has_as_many_bytes_as_it_may(made: Project, tmp_path: Path, beyond: int) -> None:
    path, count, each = tmp_path / "work.fluidwarp", 300, 46 + len("000")
    projects.save(made, path)
    with zipfile.ZipFile(path, "a") as archive:
        room = MOST_INDEX + beyond - sum(46 + len(one.filename) + len(one.extra) for one in archive.infolist())
        for number in range(count):
            member = zipfile.ZipInfo(f"{number:03}")
            member.comment = b"-" * (room * (number + 1) // count - room * number // count - each)
            archive.writestr(member, b"")
    if beyond:
        with pytest.raises(UserError, match="is not a fluidwarp project, or is cut short or damaged"):
            projects.load(path)
    else:
        assert projects.load(path).recipe == made.recipe


def test_a_full_disk_leaves_the_old_file(made: Project, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "work.fluidwarp"
    projects.save(made, path)
    whole = path.read_bytes()

    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(zipfile.ZipFile, "writestr", full)
    with pytest.raises(UserError, match="disk is full"):
        projects.save(made, path)
    assert path.read_bytes() == whole
    assert sorted(file.name for file in tmp_path.iterdir()) == ["photo.png", "work.fluidwarp"]


def test_names_that_lead_out_of_the_archive_are_kept_in(made: Project, tmp_path: Path) -> None:
    outside = made.recipe.edited(picture="../../photo.png")
    moved = Project(outside, made.picture, made.data, tmp_path)
    projects.save(moved, tmp_path / "work.fluidwarp")
    with zipfile.ZipFile(tmp_path / "work.fluidwarp") as archive:
        assert all(".." not in name for name in archive.namelist())
    assert np.array_equal(projects.load(tmp_path / "work.fluidwarp").picture.pixels, made.picture.pixels)


@pytest.mark.parametrize("name", ["recipe.toml", "format.txt", "photo.png"])
def test_a_picture_that_is_called_as_another_part_of_a_project_takes_no_ones_place(
    made: Project, tmp_path: Path, name: str
) -> None:
    (tmp_path / "masks").mkdir()
    write_picture(tmp_path / "mask.png", Picture(np.full((30, 40, 1), 255, np.uint8)))
    (tmp_path / "mask.png").rename(tmp_path / "masks" / name)
    words = Recipe.parse(f'[[viscosity]]\nkind = "picture"\npicture = "../masks/{name}"\nscale = 1\n')
    masked = Project(made.recipe.edited(viscosity=words.viscosity), made.picture, made.data, tmp_path / "masks")
    projects.save(masked, tmp_path / "work.fluidwarp")
    loaded = projects.load(tmp_path / "work.fluidwarp")
    (mask,) = (each for each in picture_names(loaded.recipe) if each != loaded.recipe.picture)
    assert loaded.recipe.stroke == made.recipe.stroke
    assert np.array_equal(loaded.picture.pixels, made.picture.pixels)
    assert (loaded.folder / mask).read_bytes() == (tmp_path / "masks" / name).read_bytes()


def renamed(project: Project, name: str) -> Project:
    return replace(project, recipe=project.recipe.edited(name=name))


def test_what_was_saved_before_is_kept_once(made: Project, tmp_path: Path) -> None:
    path, backup = tmp_path / "work.fluidwarp", tmp_path / "work.fluidwarp~"
    for number in range(3):
        projects.save(renamed(made, str(number)), path)
        assert projects.load(path).recipe.name == str(number)
        assert backup.exists() == (number > 0)
    assert projects.load(backup).recipe.name == "1"
    assert sorted(file.name for file in tmp_path.iterdir()) == ["photo.png", path.name, backup.name]


def test_the_backup_is_kept_on_a_disk_without_hard_links(
    made: Project, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_links(*_: object) -> None:
        raise OSError(errno.EPERM, "Operation not permitted")

    monkeypatch.setattr(os, "link", no_links)
    path = tmp_path / "work.fluidwarp"
    for number in range(3):
        projects.save(renamed(made, str(number)), path)
    assert projects.load(path).recipe.name == "2"
    assert projects.load(tmp_path / "work.fluidwarp~").recipe.name == "1"
    assert len(list(tmp_path.iterdir())) == 3


def test_a_project_that_is_saved_is_whole_at_every_moment(made: Project, tmp_path: Path) -> None:
    """As seen by another process, and what it finds is no older than the backup."""
    path = tmp_path / "work.fluidwarp"
    projects.save(renamed(made, "0"), path)
    code = f"""
import sys
from pathlib import Path
from app.media import project as projects
path, seen = Path({str(path)!r}), 0
print("looking", flush=True)
while seen < 60:
    now = int(projects.load(path).recipe.name)
    assert now >= seen
    seen = now
"""
    looker = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, cwd=Path(__file__).parents[2])
    assert looker.stdout is not None
    assert looker.stdout.readline() == b"looking\n"
    for number in range(1, 61):
        projects.save(renamed(made, str(number)), path)
    assert looker.wait(60) == 0


def test_a_link_to_a_project_stays_one(made: Project, tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    real, link = tmp_path / "elsewhere" / "real.fluidwarp", tmp_path / "work.fluidwarp"
    projects.save(renamed(made, "0"), real)
    link.symlink_to(real)
    projects.save(renamed(made, "1"), link)
    assert link.is_symlink()
    assert projects.load(link).recipe.name == "1"
    assert projects.load(tmp_path / "elsewhere" / "real.fluidwarp~").recipe.name == "0"


def test_a_picture_that_is_gone_is_told_with_who_names_it(made: Project, tmp_path: Path) -> None:
    work, recipe, picture = tmp_path / "work.fluidwarp", tmp_path / "r.toml", tmp_path / "photo.png"
    projects.save(made, work, embedded=False)
    recipe.write_text(f'version = 5\npicture = "{picture.name}"\nduration = 1\n')
    picture.rename(tmp_path / "moved.png")
    gone = f"Cannot read {picture}, which %s names: there is no such file; check the name, or put it back."
    ways = (lambda: projects.load(work), work), (lambda: projects.from_recipe(recipe), recipe)
    for opened, by in (*ways, (lambda: open_recipe(str(recipe)).source(), recipe)):
        with pytest.raises(UserError) as error:
            opened()
        assert str(error.value) == error.value.in_window == gone % by
    other = tmp_path / "other.png"
    with pytest.raises(UserError) as error:  # that somebody else names
        open_recipe(str(recipe)).source(other)
    assert str(error.value) == f"Cannot read {other}: there is no such file; check the name."


def test_a_recipe_that_names_no_picture_is_told_with_what_to_do(made: Project, tmp_path: Path) -> None:
    (recipe := tmp_path / "r.toml").write_text("version = 5\nduration = 1\n")
    for opened, mend in (
        (lambda: projects.from_recipe(recipe), "; open a picture first, then apply the recipe to it"),
        (lambda: open_recipe(str(recipe)).source(), "; give one with --image, or a key 'picture' in it"),
    ):
        with pytest.raises(UserError) as error:
            opened()
        assert str(error.value) == f"{recipe} names no picture{mend}"
    assert open_recipe(str(recipe)).source(tmp_path / "photo.png").picture.width == 40


def test_what_is_gone_is_neither_kept_in_a_project_nor_referred_to(made: Project, tmp_path: Path) -> None:
    """Nor is what was saved before touched."""
    recipe = made.recipe.edited(viscosity=({"kind": "picture", "picture": "mask.png", "scale": 1.0},))
    project, work = replace(made, recipe=recipe), tmp_path / "work.fluidwarp"
    projects.save(made, work)
    before = work.read_bytes()
    for embedded, said in (
        (True, f"Cannot save the project. Cannot read {tmp_path / 'mask.png'}: there is no such file; check the name."),
        (False, f"Cannot refer to {tmp_path / 'mask.png'}: it is gone; keep the picture in the project instead"),
    ):
        with pytest.raises(UserError) as error:
            projects.save(project, work, embedded=embedded)
        assert str(error.value) == said
        assert work.read_bytes() == before


def test_a_project_of_more_than_can_be_unpacked_is_refused(
    made: Project, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    projects.save(made, work := tmp_path / "work.fluidwarp")
    monkeypatch.setattr(projects, "MOST_BYTES", size := (tmp_path / "photo.png").stat().st_size)
    assert projects.load(work).data == made.data
    monkeypatch.setattr(projects, "MOST_BYTES", size - 1)
    with pytest.raises(UserError, match="holds pictures of more than"):
        projects.load(work)

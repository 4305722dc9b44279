"""What is kept between sessions: every part comes back, and what cannot be is as by default, each for itself."""

from __future__ import annotations

import json
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

from app.media.opening import shipped_recipes
from app.ui.clipboard import pasted_folder
from app.ui.preferences import Preferences

OTHER: dict[str, Any] = {
    "theme": "light", "scale": 1.25, "inspector": False, "lanes": True, "lanes_height": 200.0, "auto_quality": False,
    "embed": False, "hint": False, "recent": ["/b", "/a"], "folder": "/some", "export_folder": "/where",
    "export_as": ".mp4", "names": True, "sections": {"View": False}, "window": [10, 20, 800, 600, 1],
    "keys": {"undo": ["ctrl+b"]}, "brushes": {"push": {"radius": 0.25}}, "presets": {"Mine": {"hardness": 0.5}},
    "stabiliser": 40.0, "suited": 1.0,
}  # fmt: skip
"""A value of each part that is not its default."""


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr("platformdirs.user_config_path", lambda name: tmp_path / name)
    (tmp_path / "fluidwarp").mkdir()
    return tmp_path / "fluidwarp" / "preferences.json"


def test_every_part_is_kept(file: Path) -> None:
    assert OTHER.keys() == {part.name for part in fields(Preferences)} - {"path"}
    for name, value in OTHER.items():
        assert value != getattr(Preferences(), name)
        kept = Preferences(path=file)
        setattr(kept, name, value)
        kept.save()
        assert [*file.parent.iterdir()] == [file]
        assert Preferences.load() == kept
        assert getattr(Preferences.load(), name) == value
    assert Preferences.load().path == file


def test_of_a_part_of_another_kind_nothing_is_taken_and_of_the_others_all(file: Path) -> None:
    for name in OTHER:
        for wrong in (None, "x" if not isinstance(OTHER[name], str) else 3, [] if name != "recent" else {}):
            if not isinstance(wrong, type(OTHER[name])):
                file.write_text(json.dumps(OTHER | {name: wrong}))
                assert Preferences.load() == Preferences(**OTHER | {name: getattr(Preferences(), name)})


@pytest.mark.parametrize(
    ("name", "written", "taken"),
    [
        ("theme", "blue", "dark"),
        ("scale", 0.5, 0.75),
        ("scale", 9.0, 3.0),
        ("scale", float("nan"), 1.0),
        ("scale", float("inf"), 1.0),
        ("stabiliser", -3.0, 0.0),
        ("stabiliser", 201.0, 200.0),
        ("stabiliser", float("nan"), 0.0),
        ("suited", 3.0, 1.0),
        ("suited", float("nan"), 0.0),
        ("lanes_height", 10.0, 76.0),
        ("lanes_height", 5e3, 1200.0),
        ("lanes_height", float("nan"), 156.0),
        ("recent", [3, *map(str, range(12))], ["3", *map(str, range(9))]),
        ("window", [0, 0, 800, 600], []),
        ("window", [0, 0, 800, 600, 0, 0], []),
        ("window", [0, 0, 800.5, 600, 0], []),
        ("window", [0, -1048576, 800, 600, 0], []),
        ("window", [0, -1048575, 800, 600, 0], [0, -1048575, 800, 600, 0]),
        ("sections", {"View": 1, "Fluid": False}, {"Fluid": False}),
        ("keys", {"undo": "ctrl+z", "redo": ["y", "\ud800"], "save": [""], "open": []}, {"open": []}),
        ("brushes", {"push": 3, "freeze": {"radius": 1, "hardness": "1", "strength": 1e9, "local": -999999999.0}},
         {"freeze": {"radius": 1.0, "local": -999999999.0}}),
        ("presets", {"": {}, "\ud800": {}, "Mine": {"radius": float("nan")}}, {"Mine": {}}),
    ],
)  # fmt: skip
def test_what_cannot_be_is_made_so_that_it_can(file: Path, name: str, written: Any, taken: Any) -> None:
    file.write_text(json.dumps({"names": True, name: written}))
    assert Preferences.load() == Preferences(**{"names": True, name: taken})


def test_a_file_of_more_than_a_megabyte_is_none(file: Path) -> None:
    text = json.dumps({"names": True})
    file.write_text(text.ljust(2**20))
    assert Preferences.load().names
    file.write_text(text.ljust(2**20 + 1))
    assert not Preferences.load().names


def test_a_file_that_is_nested_deeper_than_can_be_read_is_none(file: Path) -> None:
    file.write_text(f'{{"theme": "light", "keys": {"[" * 100_000}{"]" * 100_000}}}')
    assert Preferences.load() == Preferences()


def test_where_nothing_can_be_written_the_window_goes_on_and_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "fluidwarp").touch()  # where the folder would be
    kept = Preferences(path=tmp_path / "fluidwarp" / "preferences.json")
    kept.theme = "light"
    kept.save()
    assert kept.theme == "light"
    assert [*tmp_path.iterdir()] == [tmp_path / "fluidwarp"]


def test_what_is_opened_saved_or_exported_is_found_there_again(file: Path, tmp_path: Path) -> None:
    """What was pasted is no file to the person, and the program's own folder no place to save in."""
    opened, exported = tmp_path / "opened", tmp_path / "exported"
    opened.mkdir()
    exported.mkdir()
    likes = Preferences(path=file)
    assert likes.open_from == likes.export_to == Path.home()
    likes.opened(opened / "a.png")
    assert (likes.open_from, likes.export_to) == (opened, opened)
    likes.exported(exported / "a.webm", ".webm")
    assert (likes.open_from, likes.export_to, likes.export_as) == (opened, exported, ".webm")
    likes.opened(pasted_folder() / "pasted.png")
    shipped = next(iter(shipped_recipes().values()))
    likes.opened(shipped)
    assert likes.recent == [str(shipped.resolve()), str(opened / "a.png")]
    assert Preferences.load() == likes
    exported.rmdir()
    assert likes.export_to == opened
    opened.rmdir()
    assert likes.open_from == likes.export_to == Path.home()


def test_the_hint_goes_and_the_theme_changes_for_good(file: Path) -> None:
    likes = Preferences(path=file)
    likes.dismiss_hint()
    assert not Preferences.load().hint
    for theme in ("light", "dark"):
        likes.toggle_theme()
        assert Preferences.load().theme == likes.theme == theme


def test_what_two_windows_have_changed_is_all_kept(file: Path) -> None:
    """Each writes what a person has changed in it, and leaves what the other one has."""
    Preferences(presets={"Old": {}, "Gone": {}}, recent=["/old"], path=file).save()
    one, other = Preferences.load(), Preferences.load()
    one.presets["One"] = {"hardness": 0.5}
    del one.presets["Gone"]
    one.keys["undo"] = ["ctrl+b"]
    one.theme = "light"
    one.opened(file.parent / "one.png")
    other.presets["Other"] = {"radius": 0.25}
    other.keys["undo"], other.keys["redo"] = ["ctrl+j"], ["ctrl+k"]
    other.opened(file.parent / "other.png")
    for likes in (Preferences.load(), one):
        likes.dismiss_hint()
    kept = Preferences.load()
    assert kept.presets == {"Old": {}, "One": {"hardness": 0.5}, "Other": {"radius": 0.25}}
    assert kept.keys == {"undo": ["ctrl+j"], "redo": ["ctrl+k"]}
    assert [Path(name).name for name in kept.recent] == ["other.png", "one.png", "old"]
    assert (kept.theme, kept.hint) == ("light", False)
    assert (one.theme, other.theme) == ("light", "dark")  # no window changes under its person's hands

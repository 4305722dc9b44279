"""Messages and the files of late, without a window."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from datetime import date, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from app.media.opening import shipped_recipes
from app.model.recipe import Recipe
from app.model.schema import frozen
from app.model.undo import Entry
from app.ui.browser import Browser
from app.ui.messages import MOST, Messages
from app.ui.preferences import MOST_RECENT, Preferences
from app.ui.recovery_dialog import about
from app.work.journal import Work
from support.permissions import as_a_user, needs_permissions


def test_the_newest_messages_stay_and_none_stands_twice() -> None:
    heard: list[None] = []
    messages = Messages(lambda: heard.append(None))
    for number in range(MOST + 2):
        messages.say(f"number {number}")
    assert [message.text for message in messages.shown] == [f"number {number}" for number in range(2, MOST + 2)]
    messages.warn("number 2")
    assert [message.text for message in messages.shown][-1] == "number 2"
    assert len({message.text for message in messages.shown}) == MOST
    assert len(heard) == MOST + 3


def test_a_name_with_a_line_break_is_told_in_one_line() -> None:
    messages = Messages(lambda: None)
    messages.done("Exported two\nlines\t\udcff.png")
    assert [message.text for message in messages.shown] == ["Exported two?lines??.png"]


def test_what_does_not_hold_any_more_goes_at_once_and_a_caution_by_itself() -> None:
    messages, holds = Messages(lambda: None), [True]
    messages.warn("waits for somebody", lambda: holds[0])
    messages.caution("goes")
    messages.see()
    messages.elapse(4.0)
    assert len(messages.shown) == 2
    messages.elapse(1.0)
    assert [message.text for message in messages.shown] == ["waits for somebody"]
    holds[0] = False
    messages.elapse(0.0)
    assert not messages.shown


def test_what_can_be_restored_is_counted_handles_too() -> None:
    def told(**parts: Any) -> str:
        recipe = Recipe.model_validate(frozen(parts))
        entries = (Entry(name, made, 0, 0) for name, made in (("Open", Recipe()), ("Edit", recipe)))
        found = SimpleNamespace(work=Work(tuple(entries), 1, Recipe()), when=datetime(2001, 2, 3, 4, 5))
        return about(found, date(2001, 2, 3))  # pyright: ignore[reportArgumentType]

    stroke = {"tool": "push", "samples": [[0, 0.2, 0.2, 1.0], [3, 0.3, 0.2, 1.0]]}
    handle, pin = {"at": [0.2, 0.2], "to": [0.3, 0.2]}, {"at": [0.7, 0.7]}
    assert told(stroke=[stroke], handle=[handle], pin=[pin]) == "1 stroke and 2 handles, today at 04:05"
    assert told(handle=[handle]) == "1 handle, today at 04:05"
    assert told(amount=0.5) == "other changes, today at 04:05"


def test_each_message_is_seen_for_its_five_seconds_the_newest_first() -> None:
    messages = Messages(lambda: None)
    messages.warn("stays")
    assert messages.next_in is None
    messages.say("first")
    messages.see()
    messages.elapse(2.0)
    messages.say("second")
    messages.elapse(60.0)
    assert messages.next_in is None, "a long export ends while nobody is there: it waits for the person"
    messages.see()
    assert messages.next_in == 5.0
    messages.elapse(5.0)
    assert [message.text for message in messages.shown] == ["stays", "first"]
    assert messages.next_in == 3.0, "of the five seconds, two are over"
    messages.elapse(3.0)
    assert [message.text for message in messages.shown] == ["stays"]
    assert messages.next_in is None


def test_each_message_that_comes_or_goes_by_itself_is_told_of_once() -> None:
    """Nobody's hand makes the frames in which its window fits itself to what is in it."""
    changed, holds = list[int](), True
    messages = Messages(lambda: changed.append(len(messages.shown)))

    def after(doing: Callable[[], object]) -> list[int]:
        changed.clear()
        doing()
        return changed

    assert after(lambda: messages.warn("until it is mended", lambda: holds)) == [1]
    assert after(lambda: messages.say("for a while")) == [2]
    messages.see()
    assert after(lambda: messages.elapse(1.0)) == []
    assert after(lambda: messages.elapse(5.0)) == [1]
    assert after(lambda: messages.elapse(5.0)) == []
    holds = False
    assert after(lambda: messages.elapse(0.0)) == [0]


def test_files_of_late_are_newest_first_and_each_once(tmp_path: Path) -> None:
    preferences = Preferences()
    for name in ("a", "b", "a", *map(str, range(MOST_RECENT - 2)), "a"):
        preferences.opened(tmp_path / name)
    newest = [str(number) for number in reversed(range(MOST_RECENT - 2))]
    assert [Path(name).name for name in preferences.recent] == ["a", *newest, "b"]


def test_nothing_is_saved_among_the_shipped_recipes(tmp_path: Path) -> None:
    """One of them was opened: what is saved next goes to where the person was before."""
    preferences = Preferences()
    preferences.opened(tmp_path / "own.png")
    for path in shipped_recipes().values():
        preferences.opened(path)
    assert (preferences.open_from, preferences.recent[0]) == (tmp_path, str(path))


def test_folders_are_listed_before_files(tmp_path: Path) -> None:
    for name in ("b", "D"):
        (tmp_path / name).mkdir()
    for name in ("c.png", "A.png", "e.txt", ".f.png"):
        (tmp_path / name).touch()
    browser = Browser("Open", tmp_path, (".png",), lambda path: None)
    assert [path.name for path in browser.inside] == ["b", "D", "A.png", "c.png"]


@needs_permissions
def test_of_a_folder_that_may_not_be_searched_a_browser_shows_nothing(tmp_path: Path) -> None:
    """Nobody may say what in it is a folder."""
    (tmp_path / "listed" / "inner").mkdir(parents=True)
    (tmp_path / "listed" / "a.png").touch()
    (tmp_path / "listed").chmod(0o444)
    code = """
from pathlib import Path
from app.media.files import ignores_capitals
from app.ui.browser import Browser
browser = Browser("Open", Path.cwd(), (".png",), print)
browser.go(Path("listed"))
print(browser.inside, ignores_capitals(Path("listed/inner/deep")))
"""
    try:
        told = as_a_user(code, tmp_path)
    finally:
        (tmp_path / "listed").chmod(0o755)
    assert (told.stdout.split("\n")[0], told.returncode) == ("[] False", 0), told.stderr


@pytest.mark.skipif(sys.platform != "linux", reason="names are texts elsewhere")
def test_names_that_are_no_texts_are_shown_in_a_browser_as_far_as_they_can_be(tmp_path: Path) -> None:
    """No field could show them otherwise."""
    folder = tmp_path / os.fsdecode(b"caf\xe9")
    folder.mkdir()
    browser = Browser("Save the mask", folder, (".png",), lambda path: None, os.fsdecode(b"th\xe9.png"))
    assert (browser.typed, browser.name) == (str(tmp_path / "caf?"), "th?.png")
    assert browser.folder == folder

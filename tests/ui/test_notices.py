"""Messages and the files of late, without a window."""

from __future__ import annotations

from pathlib import Path

from app.media.opening import shipped_recipes
from app.ui.browser import Browser
from app.ui.messages import MOST, Messages
from app.ui.preferences import MOST_RECENT, Preferences


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

"""What goes wrong on a user's side, in a sentence."""

from __future__ import annotations

import re

BUG = 70  # the status that a mistake of ours ends a command with
MOST_SHOWN = 1000  # characters of a message

# What is obeyed instead of shown: control characters, line separators, and the halves of characters that stand for
# bytes of names that are not UTF-8.
_OBEYED = "\x00-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff"
_UNPRINTABLE = re.compile(f"[{_OBEYED}]")
# A terminal also obeys marks of direction, which change the order of what is shown.
_UNSHOWN = re.compile(f"[{_OBEYED}\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069\ufeff]")


def shown(text: str) -> str:
    """`text`, which may hold names from anywhere, fit for a terminal or a window.

    Control characters become escapes, so that it is one line; what is longer than `MOST_SHOWN` lacks its middle.
    """
    if len(text) > MOST_SHOWN:
        text = f"{text[: MOST_SHOWN // 2]} ... {text[-MOST_SHOWN // 2 :]}"
    return _UNSHOWN.sub(lambda found: found[0].encode("unicode_escape").decode("ascii"), text)


def printable(name: str) -> str:
    """A name as a window takes it, in one line: control characters and bytes that are no UTF-8 become "?"."""
    return _UNPRINTABLE.sub("?", name)


class About(str):
    """A sentence that begins with the name of a file, kept apart: of other files the same is said in the same words.

    Args:
        file: its name, as it stands there.
        said: what follows that, with what is between them.
    """

    file: str
    said: str

    def __new__(cls, file: str, said: str) -> About:
        sentence = super().__new__(cls, f"{file}{said}")
        sentence.file, sentence.said = file, said
        return sentence

    def __reduce__(self) -> tuple[type[About], tuple[str, str]]:
        return About, (self.file, self.said)

    def of(self, file: str) -> About:
        """The same said of another file."""
        return About(file, self.said)


class UserError(Exception):
    """Something a user can mend: one line naming the file, key or number, and the mend.

    What it says is `shown`, whatever names are in it. The command line prints it and exits with `status`; the window
    shows it as `in_window`, where that differs: it has none of the command line's options.
    """

    def __init__(self, message: str, status: int = 1, in_window: str = "") -> None:
        super().__init__(shown(message))
        self.status = status
        self.in_window = shown(in_window or message)


class Cancelled(Exception):
    """The user asked a long job to stop; whatever it had half written is gone again."""

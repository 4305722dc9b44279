"""What goes wrong on a user's side, in a sentence."""

from __future__ import annotations

import re

MOST_SHOWN = 1000  # characters of a message

# What a terminal obeys instead of showing it, or what changes the order of what is shown: control characters, line
# separators, marks of direction, and the halves of characters that stand for bytes of names that are not UTF-8.
_UNSHOWN = re.compile("[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff\ufeff]")


def shown(text: str) -> str:
    """`text`, which may hold names from anywhere, fit for a terminal or a window.

    Control characters become escapes, so that it is one line; what is longer than `MOST_SHOWN` lacks its middle.
    """
    if len(text) > MOST_SHOWN:
        text = f"{text[: MOST_SHOWN // 2]} ... {text[-MOST_SHOWN // 2 :]}"
    return _UNSHOWN.sub(lambda found: found[0].encode("unicode_escape").decode("ascii"), text)


def printable(name: str) -> str:
    """The name of a file as a window takes it: bytes in it that are no UTF-8 become "?"."""
    return name.encode("utf-8", "replace").decode()


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

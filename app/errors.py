"""What goes wrong on a user's side, in a sentence."""

from __future__ import annotations


class UserError(Exception):
    """Something a user can mend: one or two lines naming the file, key or number, and the mend.

    The command line prints it and exits with `status`; the window shows it as `in_window`, where that differs: it has
    none of the command line's options.
    """

    def __init__(self, message: str, status: int = 1, in_window: str = "") -> None:
        super().__init__(message)
        self.status = status
        self.in_window = in_window or message


class Cancelled(Exception):
    """The user asked a long job to stop; whatever it had half written is gone again."""

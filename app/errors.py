"""What goes wrong on a user's side, in a sentence."""

from __future__ import annotations


class UserError(Exception):
    """Something a user can mend: one or two lines naming the file, key or number, and the mend.

    The command line prints it and exits with `status`; the window shows it in a message.
    """

    def __init__(self, message: str, status: int = 1) -> None:
        super().__init__(message)
        self.status = status


class Cancelled(Exception):
    """The user asked a long job to stop; whatever it had half written is gone again."""

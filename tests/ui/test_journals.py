"""Journals of the works that are open: that one cannot be written is told once, as long as that is so."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from app.ui.journals import Journals
from app.ui.messages import Messages
from app.work import recovery
from support.editing import Robot


def test_that_a_journal_cannot_be_written_is_told_once_each_time(
    robot: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also of work that is not saved already when it is opened; and it is told again after it had been mended."""
    monkeypatch.setattr(recovery, "AGAIN", 0.05)
    root, messages, session = tmp_path / "journals", Messages(lambda: None), robot.editor.session
    journals = Journals(root, messages)

    def keep(duration: float) -> int:
        """How many messages are shown once an edit has been noted."""
        session.edit("Its duration", duration=duration)
        for _ in range(2):
            journals.keep(session)
            robot.until(lambda: not journals.are_behind)
        messages.elapse(0.0)
        return len(messages.shown)

    for number in range(2):
        shutil.rmtree(root, ignore_errors=True)
        root.write_text("a file is in the way")
        assert keep(1.0 + number) == 1
        assert str(root) in messages.shown[0].text
        assert keep(11.0 + number) == 1
        root.unlink()
        robot.until(lambda: not messages.shown[0].holds())
        assert keep(21.0 + number) == 0
    journals.release(discard=True)

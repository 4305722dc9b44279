"""What the coverage-guided fuzzer (`tests/guided.py`) has kept, read again: each is read, or refused in a sentence."""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import ImageFile

import fuzz
import guided
from app.media.pages import read_pages
from app.media.pictures import read_picture


def test_what_the_fuzzer_has_kept_is_read_or_refused(tmp_path: Path) -> None:
    read = 0
    for reader in fuzz.READERS:
        path = tmp_path / f"in{Path(reader).suffix}"
        for kept in guided.files_of(guided.CORPUS, reader):
            path.write_bytes(kept.read_bytes())
            fuzz.judged(reader, path)
            read += 1
    assert read > 150


def test_frames_without_transparency_are_not_searched_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """34 frames of up to 16 megapixels in 2 KB, once seconds. Only the first is decoded, which leaves a part bare."""
    decoded: list[tuple[int, int]] = []
    load = ImageFile.ImageFile.load
    monkeypatch.setattr(
        ImageFile.ImageFile, "load", lambda image: (image.tile and decoded.append(image.size)) or load(image)
    )
    path = guided.CORPUS / "pages.gif" / "large-frames.gif"
    clip = read_pages(path, read_picture(path))
    assert clip is not None
    assert len(decoded) == 1

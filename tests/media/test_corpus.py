"""What the coverage-guided fuzzer (`tests/guided.py`) has kept, read again: each is read, or refused in a sentence."""

from __future__ import annotations

from pathlib import Path

import fuzz
import guided


def test_what_the_fuzzer_has_kept_is_read_or_refused(tmp_path: Path) -> None:
    read = 0
    for reader in fuzz.READERS:
        path = tmp_path / f"in{Path(reader).suffix}"
        for kept in guided.files_of(guided.CORPUS, reader):
            path.write_bytes(kept.read_bytes())
            fuzz.judged(reader, path)
            read += 1
    assert read > 150

"""Words for what of a file is lost; what a result cannot hold is told in `app/media/holding.py`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from app.errors import About

# What the codes of H.273 mean, where it is not what sRGB and BT.709 have; other codes are told as numbers.
PRIMARIES = {5: "BT.601", 6: "BT.601", 9: "BT.2020", 10: "XYZ", 11: "DCI-P3", 12: "Display P3"}
TRANSFERS = {4: "gamma 2.2", 5: "gamma 2.8", 8: "linear", 16: "PQ", 18: "HLG"}
USUAL_PRIMARIES, USUAL_TRANSFERS = (1, 2), (1, 2, 6, 13, 14, 15)
REC709 = (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329)  # primaries and white, x and y each


def lost(file: Path, losses: Sequence[str]) -> str:
    """What of a file is lost, in one sentence that names it; "" if nothing."""
    return About(file.name, f": {'; '.join(losses)}") if losses else ""


def joined(note: str, other: str) -> str:
    """Two notes in one sentence, about what the other is about, of which the first may be a file; either may be ""."""
    if not (isinstance(note, About) and isinstance(other, About)):
        return note or other
    return About(other.file, f"{note.said}; {other.said.removeprefix(': ')}")


def few(names: Sequence[str]) -> str:
    """Some of the names that a file gives to its parts, for a message: no control characters, not too many or long."""
    shown = ["".join(letter if letter.isprintable() else "?" for letter in name[:40]) for name in names[:4]]
    return ", ".join(shown) + (f" and {len(names) - len(shown)} more" if len(names) > len(shown) else "")


def counted(kind: str, names: Sequence[str]) -> str:
    """Some parts of a file, as "channels A, B"."""
    return f"{kind}{'s' * (len(names) > 1)} {few(names)}"


def not_kept(kind: str, names: Sequence[str]) -> str:
    """That parts of a file are lost, as "its channels A, B are not kept"."""
    return f"its {counted(kind, names)} {'are' if len(names) > 1 else 'is'} not kept"


def unusual_colours(primaries: int, transfer: int) -> str:
    """What colours are, by the codes of H.273, if they are neither sRGB's nor BT.709's; else ""."""
    named = [PRIMARIES.get(primaries, f"primaries {primaries}")] if primaries not in USUAL_PRIMARIES else []
    named += [TRANSFERS.get(transfer, f"transfer {transfer}")] if transfer not in USUAL_TRANSFERS else []
    return " ".join(named)

"""What the export dialog offers, held against what the files are."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from app.media.pictures import write_picture
from app.model.picture import Picture
from app.ui.export_choices import PICTURES, RATED


def test_a_picture_has_a_choice_of_quality_where_that_makes_another_file(tmp_path: Path) -> None:
    pixels = np.random.default_rng(3).integers(0, 256, (24, 32, 3), np.uint8)
    for kind in PICTURES:
        for variant in kind.variants:
            path = tmp_path / f"a{variant.ending}"
            made = set[bytes]()
            for quality in (30, 90):
                write_picture(path, Picture(pixels), bits=variant.bits, quality=quality)
                made.add(path.read_bytes())
            assert (len(made) == 2) == (variant.ending in RATED), kind.name

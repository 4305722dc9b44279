"""Numbers as they are shown and typed."""

from __future__ import annotations

import pytest

from app.ui.units import PERCENT, SECONDS, THREE_DIGITS, Unit, picture_pixels

PIXELS, FEW = picture_pixels(1200), picture_pixels(64)


@pytest.mark.parametrize(
    ("unit", "value", "text", "number"),
    [
        (PIXELS, 0.1125, "135 px", 135.0),
        (PIXELS, 0.11273, "135 px", 135.0),
        (FEW, 0.001, "0.064 px", 0.064),  # it was shown as 0
        (FEW, 0.1, "6.4 px", 6.4),
        (FEW, 0.156, "10 px", 10.0),
        (PERCENT, 0.8, "80%", 80.0),
        (SECONDS, 1.5, "1.50 s", 1.5),
        (THREE_DIGITS, 0.03, "0.03", 0.03),
        (THREE_DIGITS, 1e-5, "1e-05", 1e-5),
    ],
)
def test_what_is_shown(unit: Unit, value: float, text: str, number: float) -> None:
    assert unit.text(value) == text
    assert unit.number(value) == number


def test_what_is_typed_means_what_would_be_shown() -> None:
    assert PIXELS.value(60) == 60 / 1200
    assert PERCENT.value(80) == 0.8
    # As single precision has it.
    assert THREE_DIGITS.value(0.029999999329447746) == 0.03

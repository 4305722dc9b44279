"""Units: how a number of the program is shown to a person, and typed by one."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Unit:
    """What is written for a value, and what a written number means.

    Attributes:
        name: follows the number, as " px".
        per: of the unit make a value of 1.
        digits: as of a format: ".0f" rounds to whole ones.
    """

    name: str = ""
    per: float = 1.0
    digits: str = ".0f"

    def number(self, value: float) -> float:
        """The number that is written for a value."""
        return float(f"{value * self.per:{self.digits}}")

    def text(self, value: float) -> str:
        """The number with its unit."""
        return f"{value * self.per:{self.digits}}{self.name}"

    def value(self, number: float) -> float:
        """What a written number means; it comes in single precision, whose further digits mean nothing."""
        return float(f"{number:.7g}") / self.per


PLAIN = Unit()
POINTS = Unit(" px")  # of the screen
PERCENT = Unit("%", 100)
DEGREES = Unit("\N{DEGREE SIGN}")
SECONDS = Unit(" s", digits=".2f")
PER_SECOND = Unit(" / s", digits=".2f")
TIMES = Unit(" x", digits=".3g")
THREE_DIGITS = Unit(digits=".3g")

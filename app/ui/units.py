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
        below_ten: likewise of numbers less than 10, if they have other digits.
    """

    name: str = ""
    per: float = 1.0
    digits: str = ".0f"
    below_ten: str = ""

    def number(self, value: float) -> float:
        """The number that is written for a value."""
        return float(self._written(value))

    def text(self, value: float) -> str:
        """The number with its unit."""
        return f"{self._written(value)}{self.name}"

    def value(self, number: float) -> float:
        """What a written number means; it comes in single precision, whose further digits mean nothing."""
        return float(f"{number:.7g}") / self.per

    def _written(self, value: float) -> str:
        number = value * self.per
        return f"{number:{self.below_ten if self.below_ten and abs(number) < 10 else self.digits}}"


def picture_pixels(per: float) -> Unit:
    """Pixels of the picture, of which a value of 1 is so many: whole ones, two digits of less than ten."""
    return Unit(" px", per, below_ten=".2g")


PLAIN = Unit()
POINTS = Unit(" px")  # of the screen
PERCENT = Unit("%", 100)
DEGREES = Unit("\N{DEGREE SIGN}")
SECONDS = Unit(" s", digits=".2f")
PER_SECOND = Unit(" / s", digits=".2f")
TIMES = Unit(" x", digits=".3g")
THREE_DIGITS = Unit(digits=".3g")

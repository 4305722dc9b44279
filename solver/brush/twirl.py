"""The twirl: turn what is under the brush."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from solver.brush.tip import Point, Tip
from solver.limits import check_finite, check_type


@dataclass(frozen=True)
class Twirl:
    """Turn the fluid under the tip at `rate` rad/s, positive clockwise.

    Raises:
        ValueError: if the rate is not finite, or too large.
    """

    tip: Tip
    rate: float

    def __post_init__(self) -> None:
        check_type("what twirls", self.tip, Tip)
        check_finite("a twirl's rate", self.rate)

    @property
    def shader(self) -> str:
        return "brush/twirl.frag"

    @property
    def vectors(self) -> list[Point]:
        """The rates of its images, of which mirrored ones turn the other way round."""
        return [(-self.rate if mirrored else self.rate, 0.0) for _, _, mirrored in self.tip.paths]

    def inputs(self) -> dict[str, Any]:
        return {}

"""The limits of what may be put in, and the checks against them: numbers and arrays, nothing of GL."""

from __future__ import annotations

from numbers import Real
from typing import Any

import numpy as np

# Longer sides per second, and as much for whatever else is put in: the solvers multiply sums of squares over the grid,
# which then stay below float32's 3e38.
LARGEST_SPEED = 1e6
# Seconds, and lengths^2 / s, at which dt mu / h^2 stays far below what float32 holds.
LONGEST_STEP = 1e4
LARGEST_VISCOSITY = 1e6
# Radii that a handle leads its point: farther, a push draws what it leads out into threads finer than the map.
LARGEST_LEAD = 2.0


def check_type(what: str, value: object, kind: Any = Real) -> None:
    """Make sure that a value is of a kind, by default a number.

    Raises:
        TypeError: if it is not.
    """
    if not isinstance(value, kind):
        wanted = "number" if kind is Real else kind.__name__
        raise TypeError(f"{what} is {value!r}, a {wanted} is wanted")


def real_array(what: str, values: object) -> np.ndarray:
    """Values as an array.

    Raises:
        ValueError: if they are no real numbers, or rows of them are of unequal length.
    """
    try:
        array = np.asarray(values)
    except ValueError:
        raise ValueError(f"{what} has rows of unequal length") from None
    if array.dtype.kind not in "fiub":
        raise ValueError(f"{what} is of {array.dtype}, real numbers are wanted")
    return array


def check_step(dt: float) -> float:
    """A time step, if it is one.

    Raises:
        ValueError: if it is not from 0 to `LONGEST_STEP` seconds.
        TypeError: if it is no number.
    """
    check_type("a step", dt)
    if not 0 <= dt <= LONGEST_STEP:
        raise ValueError(f"a step of {dt} s was asked for; it must be from 0 to {LONGEST_STEP:g} s")
    return float(dt)


def check_finite(what: str, value: float) -> None:
    """Make sure that a number is finite, and no larger than `LARGEST_SPEED`."""
    check_type(what, value)
    if not abs(value) <= LARGEST_SPEED:
        raise ValueError(f"{what} of {value} was given; it must be finite and no larger than {LARGEST_SPEED:g}")


def check_size(what: str, array: np.ndarray) -> None:
    """Make sure that nothing in an array is faster than `LARGEST_SPEED`."""
    if not (np.abs(array) <= LARGEST_SPEED).all():
        raise ValueError(f"{what} is beyond {LARGEST_SPEED:g} longer sides per second somewhere, or not finite")


def check_shape(what: str, array: np.ndarray, shape: tuple[int, ...]) -> None:
    """Make sure that an array has a shape."""
    if array.shape != shape:
        raise ValueError(f"{what} of shape {array.shape} was given, {shape} is wanted")

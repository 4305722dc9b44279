"""The limits of input, and the checks against them: numbers and arrays, nothing of GL."""

from __future__ import annotations

from numbers import Real
from typing import Any, get_args

import numpy as np

# Longer sides per second, and the limit of all other input too: the solvers multiply sums of squares over the grid,
# which then stay below float32's 3e38.
LARGEST_SPEED = 1e6
# Seconds, and lengths^2 / s, at which dt mu / h^2 stays far below what float32 holds.
LONGEST_STEP = 1e4
LARGEST_VISCOSITY = 1e6
# Radii that a handle leads its point: farther, a push draws what it leads out into threads finer than the map.
LARGEST_LEAD = 2.0
# Radii that a line is long which is led as a whole: the radius of a longer one is larger.
LONGEST_LINE = 5.0
# Times farther apart, or nearer, that neighbours may be led.
MOST_STRETCH = 4.0
# Degrees that a handle is turned, times that it is made as large, and how firmly it leads.
MOST_TURNED, LEAST_SCALE, MOST_SCALE, LEAST_STIFFNESS = 720, 0.1, 10, 0.001


def check_type(what: str, value: object, kind: Any = Real) -> None:
    """Make sure that a value is of a kind, by default a number.

    Raises:
        TypeError: if it is not.
        ValueError: for a number that is too large for any float.
    """
    if kind is Real and isinstance(value, float):  # as most are: to ask an abstract class takes ten times as long
        return
    if kind is Real and isinstance(value, Real):
        try:
            float(value)
        except OverflowError:
            raise ValueError(f"{what} is larger than any float") from None
    elif not isinstance(value, kind):
        wanted = " or ".join("number" if one is Real else one.__name__ for one in get_args(kind) or (kind,))
        raise TypeError(f"{what} is {' '.join(repr(value).split()):.80}, a {wanted} is wanted")


def numbers(what: str, values: object, count: int) -> tuple[float, ...]:
    """So many finite numbers, none beyond `LARGEST_SPEED`, as floats.

    Raises:
        ValueError: if there are more or fewer of them, or they are of another kind.
    """
    array = real_array(what, values)
    check_shape(what, array, (count,))
    check_size(what, array)
    return tuple(array.astype(float).tolist())


def rows_of(what: str, rows: object, count: int) -> np.ndarray:
    """Rows of so many finite numbers, none beyond `LARGEST_SPEED`, as float64 (n, count).

    Raises:
        ValueError: if a row has more or fewer of them, or they are of another kind.
    """
    array = real_array(what, rows)
    if array.shape == (0,):
        return np.zeros((0, count))
    check_shape(what, array, (len(array), count) if array.ndim else (0, count))
    check_size(what, array)
    return array.astype(np.float64)


def real_array(what: str, values: object) -> np.ndarray:
    """Values as an array.

    Raises:
        ValueError: if they are no real numbers, some of them are masked, or rows of them are of unequal length.
    """
    if np.ma.is_masked(values):
        raise ValueError(f"{what} is masked in some places; `filled` gives them a value")
    try:
        array = np.asarray(values)
    except ValueError:
        raise ValueError(f"{what} has rows of unequal length") from None
    if array.dtype.kind not in "fiub":
        raise ValueError(f"{what} is of {array.dtype}, real numbers are wanted")
    return array.astype(np.float32) if array.dtype == np.float16 else array


def viscosities(values: object, shape: tuple[int, ...] = ()) -> np.ndarray:
    """Viscosities as float32 of a shape, from one number for all or an array of that shape; without a shape, of any.

    Raises:
        ValueError: on another shape, or if one is negative, not finite or too large.
    """
    array = real_array("a viscosity", values)
    if array.ndim and shape:
        check_shape("a viscosity", array, shape)
    if not ((array >= 0) & (array <= LARGEST_VISCOSITY)).all():
        raise ValueError(f"viscosity must be from 0 to {LARGEST_VISCOSITY:g} everywhere")
    return np.broadcast_to(array.astype(np.float32), shape or array.shape)


def as_mask(what: str, values: object, shape: tuple[int, ...]) -> np.ndarray:
    """255 where something is true or not 0, else 0: uint8.

    Raises:
        ValueError: on another shape or a NaN.
    """
    array = real_array(what, values)
    check_shape(what, array, shape)
    if np.isnan(array).any():
        raise ValueError(f"{what} must be true or false, or numbers")
    return np.where(array, 255, 0).astype(np.uint8)


def places(points: object) -> np.ndarray:
    """Places (n, 2), or more axes of them, as (n, 2) float64.

    Raises:
        ValueError: on another shape, or a value that is not finite or too large.
    """
    array = real_array("a list of places", points)
    if array.shape[-1:] != (2,):
        raise ValueError(f"places of shape {array.shape} were given, (n, 2) is wanted")
    check_size("a place", array)
    return array.astype(np.float64).reshape(-1, 2)


def beside_edges(places: np.ndarray, extent: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """The nearest and farthest from the left and upper edges that places (n, 2) of a line may be led, (n, 2) each.

    What is at an edge stays there, so no place comes more than `MOST_STRETCH` times as far from one, or as near.
    """
    near, far = np.clip(places, 0.0, extent), extent - np.clip(places, 0.0, extent)
    least = np.maximum(near / MOST_STRETCH, extent - far * MOST_STRETCH)
    return least, np.minimum(near * MOST_STRETCH, extent - far / MOST_STRETCH)


def short_of_edges(places: np.ndarray, goals: np.ndarray, extent: tuple[float, float]) -> float:
    """How far, at most, points of a line at `places` (n, 2) stay from their `goals` (n, 2) within `beside_edges`."""
    return beyond(goals, beside_edges(places, extent))


def beyond(goals: np.ndarray, bounds: tuple[np.ndarray, np.ndarray]) -> float:
    """How far, at most, `goals` (n, 2) lie outside of the bounds of each, the least and the greatest, (n, 2) each."""
    return float(np.hypot(*(np.clip(goals, *bounds) - goals).T).max(initial=0.0))


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
    if not -LARGEST_SPEED <= float(value) <= LARGEST_SPEED:  # in float16 the largest would be infinite
        raise ValueError(f"{what} of {value} was given; it must be finite and no larger than {LARGEST_SPEED:g}")


def check_size(what: str, array: np.ndarray) -> None:
    """Make sure that everything in an array is finite, and no larger than `LARGEST_SPEED`."""
    if not ((array >= -LARGEST_SPEED) & (array <= LARGEST_SPEED)).all():
        raise ValueError(f"{what} is beyond {LARGEST_SPEED:g} somewhere, or not finite")


def check_shape(what: str, array: np.ndarray, shape: tuple[int, ...]) -> None:
    """Make sure that an array has a shape."""
    if array.shape != shape:
        raise ValueError(f"{what} of shape {array.shape} was given, {shape} is wanted")

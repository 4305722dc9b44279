"""Vectors on the faces of a grid, as scripts and recipes give them: arrays, functions, or fields with a time law."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from solver.gl.field import Field
from solver.grid import Grid
from solver.limits import check_finite, check_shape, check_size, check_type, real_array

# A vector on MAC faces: (ny, nx, 2), or a function (x, y, t) of arrays that gives both components.
Function = Callable[[np.ndarray, np.ndarray, float], tuple[np.ndarray, np.ndarray]]
Vector = np.ndarray | Function

# A force, lengths / s^2: a vector, or a field on faces with its time law integrated over the step, seconds.
Force = Vector | tuple[Field, float]
Forces = Force | Iterable[Force]
# Those in a step: fields with their impulses, and the velocity that all others add, if there are any.
Impulses = tuple[list[tuple[Field, float]], np.ndarray | None]


def on_faces(what: str, vector: Vector, grid: Grid, time: float = 0.0) -> np.ndarray:
    """A vector on MAC faces as (ny, nx, 2) float32: u on left faces, v on upper ones.

    Raises:
        ValueError: on another shape or a value that is not finite.
    """
    if callable(vector):
        u, v = components(what, vector, *grid.u_faces(), time)[0], components(what, vector, *grid.v_faces(), time)[1]
        vector = np.stack([u, v], axis=-1)
    return _finite(what, vector, grid)


def at_centres(what: str, vector: Vector, grid: Grid, time: float = 0.0) -> np.ndarray:
    """A vector at cell centres as (ny, nx, 2) float32.

    Raises:
        ValueError: on another shape or a value that is not finite.
    """
    if callable(vector):
        vector = np.stack(components(what, vector, *grid.centres(), time), axis=-1)
    return _finite(what, vector, grid)


def components(what: str, function: Function, x: np.ndarray, y: np.ndarray, time: float) -> tuple[np.ndarray, ...]:
    """Both components that a function gives at places and a time, each shaped as these.

    Raises:
        ValueError: if it gives something else, or a value that is not finite.
    """
    check_type("a time", time)
    # It may work in place, and give the same arrays at every call.
    parts = function(x.copy(), y.copy(), time)
    count = len(parts) if isinstance(parts, Sequence) or (isinstance(parts, np.ndarray) and parts.ndim) else 1
    if count != 2:
        raise ValueError(f"{what} has two components, and the function gave {count}")
    arrays = tuple(real_array(what, part) for part in parts)
    if not all(np.isfinite(array).all() for array in arrays):
        raise ValueError(f"{what} holds a value that is not finite")
    try:
        return tuple(np.broadcast_to(array, x.shape).copy() for array in arrays)
    except ValueError:
        shapes = " and ".join(str(array.shape) for array in arrays)
        raise ValueError(f"{what} of shape {shapes} was given, {x.shape} is wanted") from None


def _finite(what: str, vector: object, grid: Grid) -> np.ndarray:
    array = real_array(what, vector)
    check_shape(what, array, (grid.ny, grid.nx, 2))
    with np.errstate(over="ignore"):  # what float32 cannot hold is infinite in it
        array = array.astype(np.float32)
    if not np.isfinite(array).all():
        raise ValueError(f"{what} holds a value that is not finite")
    return array


def check_field(what: str, field: Field, grid: Grid) -> None:
    """Make sure that a field is a vector on the faces of a grid."""
    check_type(what, field, Field)
    if field.size != grid.size or field.components != 2:
        raise ValueError(f"{what} is {field}, {grid.nx} x {grid.ny} x 2 is wanted")


def impulses(forces: Forces, grid: Grid, time: float, dt: float) -> Impulses:
    """What forces add from `time` on in `dt`.

    Raises:
        ValueError: for a force of another shape, or one that is not finite or too large.
        TypeError: for what is no force.
    """
    fields, total = list[tuple[Field, float]](), None
    is_one = isinstance(forces, np.ndarray | Field) or callable(forces)
    is_one = is_one or (isinstance(forces, tuple) and isinstance(next(iter(forces), None), Field))
    several: Any = [forces] if is_one else forces
    if not isinstance(several, Iterable):
        raise TypeError(f"a force is {several!r:.80}, an array or a function is wanted, or several of them")
    for force in several:
        if isinstance(force, tuple | Field):
            if not (isinstance(force, tuple) and len(force) == 2):
                raise ValueError("a force that is a field goes with its time law, integrated over the step")
            field, impulse = force
            check_field("a force", field, grid)
            check_finite("a force's impulse", impulse)
            if impulse != 0.0:
                fields.append((field, float(impulse)))
        else:
            with np.errstate(over="ignore"):
                faces = dt * on_faces("a force", force, grid, time + dt / 2)
            check_size("what a force adds to the velocity", faces)
            total = faces if total is None else total + faces
    return fields, total

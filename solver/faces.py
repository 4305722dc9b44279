"""Vectors on the faces of a grid, as scripts and recipes give them: arrays, functions, or fields with a time law."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from solver.gl.field import Field
from solver.grid import Grid
from solver.limits import check_finite, check_shape, check_size, check_type, real_array

# A vector on MAC faces: (ny, nx, 2), or a function (x, y, t) of arrays that gives both components.
Vector = np.ndarray | Callable[[np.ndarray, np.ndarray, float], tuple[np.ndarray, np.ndarray]]

# A force, lengths / s^2: a vector, or a field on faces with its time law integrated over the step, seconds.
Force = Vector | tuple[Field, float]
Forces = Vector | Iterable[Force]


def on_faces(what: str, vector: Vector, grid: Grid, time: float = 0.0) -> np.ndarray:
    """A vector on MAC faces as (ny, nx, 2) float32: u on left faces, v on upper ones.

    Raises:
        ValueError: on another shape or a value that is not finite.
    """
    if callable(vector):
        both = vector(*grid.u_faces(), time), vector(*grid.v_faces(), time)
        if {len(parts) for parts in both} != {2}:
            raise ValueError(f"{what} has two components, and the function gave {len(both[0])}")
        shape = grid.ny, grid.nx
        array = np.stack([np.broadcast_to(parts[axis], shape) for axis, parts in enumerate(both)], axis=-1)
    else:
        array = vector
    array = real_array(what, array)
    check_shape(what, array, (grid.ny, grid.nx, 2))
    if not np.isfinite(array).all():
        raise ValueError(f"{what} holds a value that is not finite")
    return array.astype(np.float32)


def check_field(what: str, field: Field, grid: Grid) -> None:
    """Make sure that a field is a vector on the faces of a grid."""
    check_type(what, field, Field)
    if field.size != grid.size or field.components != 2:
        raise ValueError(f"{what} is {field}, {grid.nx} x {grid.ny} x 2 is wanted")


def impulses(forces: Forces, grid: Grid, time: float, dt: float) -> tuple[list[tuple[Field, float]], np.ndarray | None]:
    """What forces add from `time` on in `dt`: fields with their impulses, and the velocity of all others together.

    Raises:
        ValueError: for a force of another shape, or one that is not finite or beyond all measure.
        TypeError: for what is no force.
    """
    fields, total = list[tuple[Field, float]](), None
    several = [forces] if isinstance(forces, np.ndarray) or callable(forces) else forces
    check_type("what forces the fluid", several, Iterable)
    for force in several:
        if isinstance(force, tuple):
            field, impulse = force
            check_field("a force", field, grid)
            check_finite("a force's impulse", impulse)
            if impulse != 0.0:
                fields.append((field, float(impulse)))
        else:
            faces = dt * on_faces("a force", force, grid, time + dt / 2)
            check_size("what a force adds to the velocity", faces)
            total = faces if total is None else total + faces
    return fields, total

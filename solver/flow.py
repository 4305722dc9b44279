"""A flow that is moved from one grid of a picture to another."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from solver.gl.device import Device
from solver.gl.field import Field
from solver.grid import Grid
from solver.limits import check_type
from solver.params import Walls


@dataclass(frozen=True)
class Flow:
    """A flow on the faces of a grid: time, velocity, and g of (S2) where that is known."""

    time: float
    velocity: Field
    carried: Field | None = None

    def resampled(self, device: Device, here: Grid, there: Grid, walls: Walls) -> Flow:
        """The flow, now on the faces of grid `here`, on those of `there`, in textures that the caller releases.

        If the cells are of the same size and moved by whole cells, it is the same to the bit. Otherwise it is the mean
        over each face, so that as much flows through it, without `carried`. Outside `here` all is at rest.

        Raises:
            ValueError: if `there` is a grid of another picture.
        """
        check_type("where a flow goes", there, Grid)
        if there.picture != here.picture:
            raise ValueError(f"a flow in a picture of {here.picture} cannot go on in one of {there.picture}")
        step = np.divide(there.spacing, here.spacing)
        origin = np.subtract(there.origin, here.origin) / here.spacing
        is_moved = bool(np.allclose(step, 1.0, rtol=0.0, atol=1e-6))
        if is_moved:
            step, origin = np.ones(2), np.round(origin)
        inputs: dict[str, Any] = {"origin": tuple(origin.tolist()), "step": tuple(step.tolist())}
        inputs |= {"samples": tuple(np.maximum(np.ceil(step), 1.0).tolist()), **walls.inputs}
        resample, fields = device.pass_("step/resample.frag", **walls.defines), []
        for live in (self.velocity, self.carried if is_moved else None):
            if live is not None:
                fields.append(device.field(there.size, 2, f"{live.label}, resampled"))
                resample(fields[-1], velocity=live, **inputs)
        return Flow(self.time, *fields)

    def release(self) -> None:
        """Free the textures."""
        for field in (self.velocity, self.carried):
            if field is not None:
                field.release()

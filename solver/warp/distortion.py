"""How a map distorts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from solver.gl.device import Device
from solver.gl.reduction import Reduction


@dataclass(frozen=True)
class MapStatistics:
    """How a map distorts, at places spread evenly over the picture.

    Attributes:
        det_min, det_max: of the Jacobian of x + D(x), by the chain rule: how many times larger an area it is looked up
            in.
        folds: places where it is zero or negative.
        places: how many were looked at.
        det_error: mean of |det - 1|.
        displacement_max, displacement_mean: |D|, longer sides.
    """

    det_min: float
    det_max: float
    folds: int
    places: int
    det_error: float
    displacement_max: float
    displacement_mean: float


def distortion(
    device: Device, size: tuple[int, int], defines: dict[str, object], parts: dict[str, Any]
) -> MapStatistics:
    """How a map distorts on a lattice of `size`, given its parts as `lib/warp.glsl` has them; waits for the GPU."""
    targets = device.field(size, 4, "largest distortion"), device.field(size, 4, "total distortion")
    reductions = Reduction(device, size, 4, "max"), Reduction(device, size, 4, "sum")
    device.pass_("warp/distortion.frag", **defines)(targets, **parts, origin=(0.0, 0.0), step=targets[0].texel)
    largest, total = (found(field).tolist() for found, field in zip(reductions, targets, strict=True))
    for thing in (*targets, *reductions):
        thing.release()
    places = size[0] * size[1]
    return MapStatistics(
        det_min=-largest[0],
        det_max=largest[1],
        folds=int(total[0]),
        places=places,
        det_error=total[2] / places,
        displacement_max=largest[2],
        displacement_mean=total[1] / places,
    )

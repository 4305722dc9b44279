"""How a map distorts."""

from __future__ import annotations

from dataclasses import dataclass

from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.reduction import Reduction


@dataclass(frozen=True)
class MapStatistics:
    """How a map distorts, by central differences at the simulation's cell centres.

    Attributes:
        det_min, det_max: of the Jacobian of x + D(x): how many times larger an area it is looked up in.
        folds: cells where it is zero or negative.
        det_error: mean of |det - 1|.
        displacement_max, displacement_mean: |D|, longer sides.
    """

    det_min: float
    det_max: float
    folds: int
    det_error: float
    displacement_max: float
    displacement_mean: float


def distortion(device: Device, displacement: Field, spacing: tuple[float, float]) -> MapStatistics:
    """How a displacement on a lattice of `spacing` distorts; waits for the GPU."""
    size = displacement.size
    targets = device.field(size, 4, "largest distortion"), device.field(size, 4, "total distortion")
    reductions = Reduction(device, size, 4, "max"), Reduction(device, size, 4, "sum")
    device.pass_("warp/distortion.frag")(targets, displacement=displacement, spacing=spacing)
    largest, total = (found(field).tolist() for found, field in zip(reductions, targets, strict=True))
    for thing in (*targets, *reductions):
        thing.release()
    texels = size[0] * size[1]
    return MapStatistics(
        det_min=-largest[0],
        det_max=largest[1],
        folds=int(total[0]),
        det_error=total[2] / texels,
        displacement_max=largest[2],
        displacement_mean=total[1] / texels,
    )

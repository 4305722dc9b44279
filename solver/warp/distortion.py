"""How a map distorts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from solver.gl.device import Device
from solver.gl.field import whole
from solver.gl.reduction import Reduction

MOST_PLACES = 2**19  # looked at at once


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
    """How a map distorts on a lattice of `size`, given its parts as `lib/warp.glsl` has them; waits for the GPU.

    Looked at in bands of at most `MOST_PLACES`, or of a row, so that no size takes more memory.
    """
    width, height = whole(size, "distortion")
    rows = max(MOST_PLACES // width, 1)
    largest, total, step = np.full(3, -np.inf), np.zeros(3), (1 / width, 1 / height)
    draw = device.pass_("warp/distortion.frag", **defines)
    for top in range(0, height, rows):
        band = width, min(rows, height - top)
        targets = device.field(band, 4, "largest distortion"), device.field(band, 4, "total distortion")
        reductions = Reduction(device, band, 4, "max"), Reduction(device, band, 4, "sum")
        draw(targets, **parts, origin=(0.0, float(top)), step=step)
        found = [reduction(field)[:3] for reduction, field in zip(reductions, targets, strict=True)]
        largest, total = np.maximum(largest, found[0]), total + found[1]
        for thing in (*targets, *reductions):
            thing.release()
    (least, most, far), (folds, moved, error) = largest.tolist(), total.tolist()
    places = width * height
    return MapStatistics(
        det_min=-least,
        det_max=most,
        folds=int(folds),
        places=places,
        det_error=error / places,
        displacement_max=far,
        displacement_mean=moved / places,
    )

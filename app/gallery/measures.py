"""What is measured on figures of the gallery: sharpness, stretch and folds of maps, and a thin-plate spline beside."""

from __future__ import annotations

import numpy as np

from app.model.picture import srgb_to_linear
from app.model.recipe import Recipe
from solver.warp.distortion import MapStatistics


def summary(found: MapStatistics, longest: int) -> dict[str, str]:
    """How far a map moves at most, in pixels of a picture `longest` pixels long, and the range of its det J."""
    det = f"{found.det_min:.2f} to {found.det_max:.2f}"
    return {"px, most": f"{found.displacement_max * longest:.1f}", "det J": det}


def light(pixels: np.ndarray) -> np.ndarray:
    """The luminance (h, w) float64 of (h, w, 3) uint8, in linear light: what pictures are mixed in."""
    return srgb_to_linear(pixels / 255) @ np.array([0.2126, 0.7152, 0.0722])


def sharpness(luminance: np.ndarray) -> float:
    """Gradient energy: the squared gradient of the luminance (h, w), summed over all pixels but the outermost two."""
    rows, columns = np.gradient(luminance)
    return float((rows**2 + columns**2)[2:-2, 2:-2].sum())


def spline_warp(values: np.ndarray, displacement: np.ndarray) -> np.ndarray:
    """`values` (h, w) at x + D(x) for the centres x of the pixels, by the interpolating cubic B-spline, in float64.

    The reference that sharpness is measured against: the picture at the very places that the map (h, w, 2) names,
    clamped at the edge. No pixel of it is an average.
    """
    height, width = values.shape
    coefficients = values
    for n in (height, width):
        # The spline whose values at the pixels are the picture's; its ends mirror.
        matrix = np.diag(np.full(n, 4.0)) + np.diag(np.ones(n - 1), 1) + np.diag(np.ones(n - 1), -1)
        matrix[0, 1] = matrix[-1, -2] = 2.0
        coefficients = np.linalg.solve(matrix / 6, coefficients).T
    row, column = np.mgrid[0:height, 0:width]
    row = np.clip(row + displacement[..., 1] * max(height, width), 0, height - 1)
    column = np.clip(column + displacement[..., 0] * max(height, width), 0, width - 1)
    result = np.zeros(row.shape)
    top, left = np.floor(row).astype(int), np.floor(column).astype(int)
    for i, row_weight in enumerate(_spline_weights(row - top), -1):
        for j, column_weight in enumerate(_spline_weights(column - left), -1):
            result += row_weight * column_weight * coefficients[_mirrored(top + i, height), _mirrored(left + j, width)]
    return result


def _spline_weights(t: np.ndarray) -> tuple[np.ndarray, ...]:
    return (1 - t) ** 3 / 6, 2 / 3 - t**2 + t**3 / 2, 2 / 3 - (1 - t) ** 2 + (1 - t) ** 3 / 2, t**3 / 6


def _mirrored(index: np.ndarray, n: int) -> np.ndarray:
    return n - 1 - np.abs(n - 1 - np.abs(index))


def spline_of(recipe: Recipe, size: tuple[int, int]) -> np.ndarray:
    """The displacement (h, w, 2) of the thin-plate spline that looks up the handles' points where they go, and pins."""
    from scipy.interpolate import RBFInterpolator

    extent = np.array(size) / max(size)
    ends = np.array([*(each.goal or each.at for each in recipe.handle), *(each.at for each in recipe.pin)]) * extent
    starts = np.array([each.at for each in (*recipe.handle, *recipe.pin)]) * extent
    fitted = RBFInterpolator(ends, starts - ends, kernel="thin_plate_spline")
    x, y = ((np.arange(n) + 0.5) / max(size) for n in size)
    return fitted(np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)).reshape(size[1], size[0], 2)


def stretch_and_det(displacement: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """At each pixel the larger of stretch and its inverse, and det J, (h, w) each, by differences of the map."""
    h = 1 / max(displacement.shape[:2])
    slopes = [np.gradient(displacement, h, axis=axis) for axis in (1, 0)]
    jacobian = np.stack(slopes, axis=-1) + np.eye(2)
    # The singular values of a 2 x 2 matrix: the sum of their squares is that of its entries, their product the det.
    squares, det = (jacobian**2).sum(axis=(-2, -1)), np.linalg.det(jacobian)
    largest = np.sqrt((squares + np.sqrt(np.maximum(squares**2 - 4 * det**2, 0))) / 2)
    return np.maximum(largest, 1 / np.maximum(abs(det) / np.maximum(largest, 1e-12), 1e-3)), det


def beyond(displacement: np.ndarray) -> float:
    """The part of a map's pixels (h, w, 2) that look up what is outside the picture, by more than half a pixel."""
    height, width = displacement.shape[:2]
    y, x = np.mgrid[:height, :width] + 0.5 + np.moveaxis(displacement[..., ::-1], -1, 0) * max(height, width)
    return float(((x < -0.5) | (x > width + 0.5) | (y < -0.5) | (y > height + 0.5)).mean())

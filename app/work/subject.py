"""The subject in a rough box, found by GrabCut (Rother, Kolmogorov and Blake 2004, as OpenCV has it)."""

from __future__ import annotations

import numpy as np

from app.errors import UserError
from app.model.sampling import Box, Point

ROUNDS = 5
LARGEST = 384  # pixels along the box's longer side that it is looked for in: GrabCut takes its time over more
AROUND = 0.25  # of the box's sides, of what is seen of the background on each of its sides
FINER = 4  # times finer than the pixels the outline is drawn
LEAST = 0.01  # of the largest area: smaller ones are specks


def subject_outline(colours: np.ndarray, box: Box) -> tuple[Point, ...]:
    """The outline of the subject within a box, as a `FillMask` takes it; holes and further parts hang on edges there
    and back.

    Args:
        colours: (h, w, 3) uint8, red, green and blue.
        box: what lies outside it is background.

    Raises:
        UserError: without OpenCV, or if there is no subject to be told from the background.
    """
    try:
        import cv2
    except ImportError:
        raise UserError("Finding a subject needs OpenCV; install it with: pip install opencv-python-headless") from None
    height, width = colours.shape[:2]
    sides = np.array([width, height, width, height])
    left, top, right, bottom = np.clip(np.rint(np.array(box) * sides), 0, sides).astype(int).tolist()
    nothing = UserError("No subject is found in this box; draw it around the whole of one, with some background.")
    if min(right - left, bottom - top) < 3:
        raise nothing
    more = round((right - left) * AROUND), round((bottom - top) * AROUND)
    x, y = max(left - more[0], 0), max(top - more[1], 0)
    part = colours[y : bottom + more[1], x : right + more[0]]
    scale = min(LARGEST / max(right - left, bottom - top), 1.0)
    small = cv2.resize(np.ascontiguousarray(part[..., ::-1]), None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    ratio = np.array(small.shape[1::-1]) / part.shape[1::-1]
    rect = np.rint(np.multiply((*ratio, *ratio), (left - x, top - y, right - left, bottom - top))).astype(int)
    kinds = np.zeros(small.shape[:2], np.uint8)
    cv2.setRNGSeed(0)
    try:
        models = np.zeros((1, 65)), np.zeros((1, 65))
        cv2.grabCut(small, kinds, rect.tolist(), *models, ROUNDS, cv2.GC_INIT_WITH_RECT)
    except cv2.error:  # all is of one colour, or the box is all there is
        raise nothing from None
    # The outline runs halfway between pixels in and out of it.
    fine = cv2.resize((kinds & 1) * np.float32(1), None, fx=FINER, fy=FINER, interpolation=cv2.INTER_LINEAR)
    rings, _ = cv2.findContours((np.pad(fine, 1) > 0.5).astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    areas = [cv2.contourArea(ring) for ring in rings]
    corners = list[np.ndarray]()
    for ring, area in zip(rings, areas, strict=True):
        if area > LEAST * max(areas):
            simple = cv2.approxPolyDP(ring, FINER / 2, True)[:, 0]
            corners += [*simple, simple[0], *corners[:1]]
    if len(corners) < 3:
        raise nothing
    places = ((np.array(corners) - 0.5) / FINER / ratio + (x, y)) / (width, height)
    return tuple((px, py) for px, py in np.clip(places, 0, 1).round(5).tolist())

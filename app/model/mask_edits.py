"""What is done to the masks at a moment, in no time: strokes of a mask's brush while nothing moves, and whole edits.

A mask is edited texel by texel of its canvas, on the whole numbers it is kept in, so that every machine comes to the
same.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import zip_longest
from typing import Annotated, Any, Literal, Self, TypeGuard

import numpy as np
from pydantic import Field, TypeAdapter, model_validator

from app.model.areas import Area, Part, Seen, as_it_was
from app.model.sampling import (
    ROWS_AT_ONCE,
    SOURCE,
    FrameNumber,
    NamedPictures,
    PictureName,
    SmallPictures,
    intensity,
    strips,
    to_grid,
    workable,
)
from app.model.schema import Model, Radius, Several
from app.model.strokes import BrushPath, Tick
from solver.grid import Grid

MaskName = Literal["frozen", "thickness"]
MASKS: dict[MaskName, str] = {"frozen": "what is frozen", "thickness": "the thickness"}
"""What people call them."""
MaskTool = Literal["thicken", "thin", "freeze", "thaw", "smooth"]
THINNEST, THICKEST = -3.0, 5.0  # decades that can be painted
UNITS = {"frozen": (0, 255), "thickness": (24576, 8192)}
"""The words that masks are kept in: that of nothing, and how many more it is frozen at, or a decade thicker."""
LONGEST_HAND = 216_000  # ticks of a hand in one stroke: an hour; what stands still is painted once in each
Decades = Annotated[float, Field(ge=THINNEST, le=THICKEST)]


class MaskStroke(BrushPath):
    """A stroke of a mask's brush that takes no time.

    Its samples' ticks are those of the hand: it paints what it would have painted in so many ticks of the fluid, all
    at its first one.
    """

    kind: Literal["stroke"]
    tool: MaskTool

    @model_validator(mode="after")
    def _ends(self) -> Self:
        if (ticks := self.last_tick - self.first_tick) > LONGEST_HAND:
            raise ValueError(f"paints for {ticks} ticks of the hand; at most {LONGEST_HAND}, an hour, work")
        return self

    @property
    def tick(self) -> int:
        """The moment it is painted at."""
        return self.first_tick

    def goes_on_after(self, other: MaskEdit) -> int | None:
        """The hand's tick from which it goes on, if it begins with all that another edit does; else None."""
        if not isinstance(other, MaskStroke) or self._head() != other._head():
            return None
        own, count = self.samples, len(other.samples)
        is_longer = own[:count] == other.samples and (len(own) == count or own[count][0] > other.last_tick)
        return other.last_tick + 1 if is_longer else None


class _Edit(Model):
    """What all edits of a whole mask share.

    Attributes:
        tick: the moment it is done at, before all else that begins at this tick.
        of: the mask.
    """

    tick: Tick
    of: MaskName


class ClearMask(_Edit):
    """Take all paint off."""

    kind: Literal["clear"]


class FillMask(_Edit, Area):
    """Make a mask the same everywhere, or in an area.

    Attributes:
        amount: decades of thickness; of what is frozen, 1 freezes and 0 thaws.
        then: what is added to the area, taken from it, or kept of it, in this order.
    """

    kind: Literal["fill"]
    amount: Decades
    then: Several[Part] = ()

    @model_validator(mode="after")
    def _frozen_or_not(self) -> FillMask:
        if self.of == "frozen" and not 0 <= self.amount <= 1:
            raise ValueError(f"'amount' of what is frozen is from 0 to 1, not {self.amount:g}")
        return self

    def coverage(self, grid: Grid, pictures: NamedPictures, seen: Seen = as_it_was) -> np.ndarray:
        covered = super().coverage(grid, pictures, seen)
        for part in self.then:
            covered = part.onto(covered, part.coverage(grid, pictures, seen))
        return covered


class InvertMask(_Edit):
    """Freeze what is not frozen and thaw what is; of thickness, what is thickest becomes what is thinnest."""

    kind: Literal["invert"]


class FeatherMask(_Edit):
    """Soften a mask: three means in a row, each over squares; of what is frozen, corners become round.

    Attributes:
        radius: how far an edge becomes soft to each side, longer sides.
    """

    kind: Literal["feather"]
    radius: Radius


class SpreadMask(_Edit):
    """Let each place be as the largest value within a disc is ("grow"), or the smallest ("shrink").

    Attributes:
        radius: of the disc, longer sides.
    """

    kind: Literal["grow", "shrink"]
    radius: Radius


class PictureMask(_Edit):
    """A mask from a picture's brightness: what is from middle grey on is frozen; thickness goes from black to white.

    Attributes:
        picture: "source", as it is seen at this moment, or a file.
        frame: of a clip that is "source", the one whose brightness it is; 0 is the first.
        white: decades of thickness that white stands for; black is none.
        invert: white is black and black is white.
    """

    kind: Literal["picture"]
    picture: PictureName = SOURCE
    frame: FrameNumber = 0
    white: Decades = THICKEST
    invert: bool = False


WholeEdit = FillMask | InvertMask | FeatherMask | SpreadMask | PictureMask
MaskEdit = Annotated[MaskStroke | ClearMask | WholeEdit, Field(discriminator="kind")]
mask_edit: Callable[[dict[str, Any]], MaskEdit] = TypeAdapter(MaskEdit).validate_python
"""The edit that a table of the recipe says."""


def remaining(edits: Sequence[MaskEdit], done: Sequence[MaskEdit]) -> list[tuple[MaskEdit, int]] | None:
    """What of `edits` is still to be done after `done`, each with the hand's tick that it goes on from.

    None if `done` is not how `edits` begins. A stroke that is still drawn begins as the finished one does.
    """
    left = list[tuple[MaskEdit, int]]()
    for mine, theirs in zip_longest(edits, done):
        if mine is None or (theirs is not None and left):
            return None
        if theirs is None:
            left.append((mine, mine.tick))
        elif mine is not theirs and mine != theirs:
            first = mine.goes_on_after(theirs) if isinstance(mine, MaskStroke) else None
            if first is None:
                return None
            left.append((mine, first))
    return left


def with_edit(edits: tuple[MaskEdit, ...], edit: MaskEdit) -> tuple[MaskEdit, ...]:
    """The edits and one more; the picture's own brightness takes the place of the same before it, below strokes."""
    last = next((k for k in reversed(range(len(edits))) if not isinstance(edits[k], MaskStroke)), None)
    if last is None or not is_brightness(edit) or not is_brightness(edits[last], edit):
        return *edits, edit
    return *edits[:last], edit, *edits[last + 1 :]


def is_brightness(edit: MaskEdit, like: MaskEdit | None = None) -> TypeGuard[PictureMask]:
    """True if an edit takes the picture's own brightness, and if another is given, for its mask at its moment."""
    if not isinstance(edit, PictureMask) or edit.picture != SOURCE:
        return False
    return like is None or (isinstance(like, PictureMask) and (like.of, like.tick) == (edit.of, edit.tick))


def edited(
    words: np.ndarray, edit: WholeEdit, canvas: Grid, pictures: SmallPictures, seen: Seen = as_it_was
) -> np.ndarray:
    """A mask after an edit of all of it.

    On a large canvas, areas and the picture's own brightness are worked out on a `workable` one, and interpolated.

    Args:
        words: the mask's texels, (h, w), uint8 of what is frozen, uint16 of thickness.
        seen: takes values of the picture to where it shows them at this moment.

    Returns:
        as `words`.

    Raises:
        UserError, ValueError: what is wrong with the edit on these pictures.
    """
    zero, unit = UNITS[edit.of]
    last = np.iinfo(words.dtype).max
    grid = workable(canvas)

    def wanted(amount: np.ndarray | float) -> np.ndarray:
        return np.clip(np.rint(zero + unit * np.asarray(amount)), 0, last)

    match edit:
        case FillMask():
            covered, filled = edit.coverage(grid, pictures, seen), words.copy()
            for rows, share in strips(covered, canvas):
                filled[rows] = np.rint(words[rows] + share * (wanted(edit.amount) - words[rows]))
            return filled
        case InvertMask():
            low, high = (0, last) if edit.of == "frozen" else (int(words.min()), int(words.max()))
            return (low + high - words.astype(np.int32)).astype(words.dtype)
        case FeatherMask():
            return _softened(words, [round(edit.radius / 3 / h) for h in reversed(canvas.spacing)])
        case SpreadMask():
            grows = edit.kind == "grow"
            return _grown(words, edit.radius, canvas) if grows else last - _grown(last - words, edit.radius, canvas)
        case PictureMask():
            own, made = edit.picture == SOURCE, np.full_like(words, zero)
            on = grid if own else canvas
            grey = to_grid(intensity((pictures if own else pictures.full).load(edit.picture, edit.frame)), on)
            grey = seen(grey, on) if own else grey
            for rows, part in strips(1 - grey if edit.invert else grey, canvas):
                made[rows] = wanted(edit.white * part if edit.of == "thickness" else part)
            return made


def as_grey(words: np.ndarray, of: MaskName) -> np.ndarray:
    """A mask as a `PictureMask` reads it back to the word, (h, w) uint16; of thickness, what is thinned is black."""
    zero, unit = UNITS[of]
    white = unit * (THICKEST if of == "thickness" else 1)
    return np.rint(np.clip((words.astype(np.float64) - zero) / white, 0, 1) * 65535).astype(np.uint16)


def _softened(words: np.ndarray, reaches: Sequence[int]) -> np.ndarray:
    """Three running means along each axis, each over `reach` texels to both sides; the border is repeated."""
    for reach in reaches:
        words = words.T.copy()  # so that what is added up lies side by side
        for first in range(0, len(words) if reach else 0, ROWS_AT_ONCE):
            strip, count = words[first : first + ROWS_AT_ONCE], 2 * reach + 1
            for _ in range(3):
                # A sum that wraps around is taken from another one: what is between them does not.
                padded = np.pad(strip, ((0, 0), (reach + 1, reach)), "edge")
                sums = np.cumsum(padded, axis=1, dtype=np.uint32)
                strip = (sums[:, count:] - sums[:, :-count] + np.uint32(reach)) // np.uint32(count)
            words[first : first + ROWS_AT_ONCE] = strip
    return words


def _grown(words: np.ndarray, radius: float, canvas: Grid) -> np.ndarray:
    """The largest word within a disc, longer sides; beyond the border there is nothing."""
    result, margin = np.empty_like(words), int(radius / canvas.spacing[1])
    rows = max(ROWS_AT_ONCE, 4 * margin)  # at most half as many again are gone through for what reaches into them
    for first in range(0, len(words), rows):
        start = max(first - margin, 0)
        grown = _grown_strip(words[start : first + rows + margin], radius, canvas)
        result[first : first + rows] = grown[first - start : first - start + rows]
    return result


def _grown_strip(words: np.ndarray, radius: float, canvas: Grid) -> np.ndarray:
    """The same of so few rows that a processor has them at hand."""
    (hx, hy), (height, width), result = canvas.spacing, words.shape, words.copy()
    margin = min(int(radius / hx), width)
    # The largest of 1, 2, 4 ... words from each on to the right: two of them that overlap make any width.
    runs = [np.pad(words, ((0, 0), (margin, margin)))]
    for row in range(min(int(radius / hy), height - 1) + 1):
        reach = min(int(math.sqrt(max(radius**2 - (row * hy) ** 2, 0.0)) / hx), margin)  # of a whole row, rounding
        level = (2 * reach + 1).bit_length() - 1
        while len(runs) <= level:
            run, ahead = runs[-1], 1 << (len(runs) - 1)
            runs.append(np.maximum(run[:, :-ahead], run[:, ahead:]))
        first, second = margin - reach, margin + reach + 1 - (1 << level)
        across = np.maximum(runs[level][:, first : first + width], runs[level][:, second : second + width])
        for target, source in ((result[row:], across[: height - row]), (result[: height - row], across[row:])):
            np.maximum(target, source, out=target)
    return result

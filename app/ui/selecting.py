"""Selecting with the pointer: areas that are added to one another and taken away, and then filled into a mask."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from math import cos, pi, sin
from typing import Any

import numpy as np

from app.errors import UserError
from app.model.areas import MOST_CORNERS, Area, Part, inverted
from app.model.mask_edits import FillMask
from app.model.sampling import SOURCE, Point, Segment, Window, channels, intensity, pixel_at, to_grid
from app.ui.editor_state import SELECT_BY, EditorState
from app.ui.events import Mods
from app.ui.messages import Messages
from app.ui.workspace import Workspace
from app.work.session import Session
from app.work.subject import subject_outline
from solver.grid import Grid

SHOWN = 1024  # cells along the longer side that a selection is shown on, and a subject is looked for on
NEAR = 0.002  # of the picture: corners of a lasso are no nearer
LEAST = 0.004  # of the picture: what is dragged over less was only clicked on


@dataclass
class Selecting:
    """The selection that is being made. It is no edit before it is filled into a mask.

    Attributes:
        path: where the drag under way has been, as fractions of the picture.
    """

    workspace: Workspace
    state: EditorState
    messages: Messages
    path: list[Point] = field(default_factory=list)
    _combine: str = field(default="replace", init=False)
    _before: tuple[Part, ...] = field(default=(), init=False)  # what the last part was added to or taken from
    _is_inverted: bool = field(default=False, init=False)  # since the last part was
    # The place in the original that was clicked on last, and the clip's frame.
    _picked: tuple[Point, int] | None = field(default=None, init=False)
    _search: _Search | None = field(default=None, init=False)
    _shown: tuple[Session | None, int] = field(default=(None, 0), init=False)  # what it was worked out for

    # -- making it --------------------------------------------------------------------------------------------------

    def press(self, x: float, y: float, mods: Mods) -> None:
        """The pointer went down: Shift adds to what is selected, Alt takes from it, both keep what is in both."""
        self._search, self._shown = None, self._now()
        ways = {(True, False): "add", (False, True): "subtract", (True, True): "intersect"}
        self._combine = ways.get((mods.shift, mods.alt), "replace")
        self.path = [_within(x, y)]

    def move(self, x: float, y: float) -> None:
        """The pointer moved."""
        place = _within(x, y)
        if not 0 < len(self.path) < MOST_CORNERS:
            return
        if max(abs(a - b) for a, b in zip(place, self.path[-1], strict=True)) > NEAR:
            self.path.append(place)

    def release(self) -> None:
        """The pointer went up: what it was dragged over is selected, or what is like the place that was clicked on.

        Raises:
            UserError: if nothing can be selected so.
        """
        path, self.path = self.path, []
        if not path:
            return
        state, by = self.state, self.state.select_by
        self._before, self._picked = (() if self._combine == "replace" else state.selection), None
        self._is_inverted = False
        if by in ("colour", "brightness"):
            replay = self.workspace.session.replay
            moved = replay.warp.at(np.multiply([path[0]], replay.grid.extent))[0] / replay.grid.extent
            place = _within(path[0][0] + float(moved[0]), path[0][1] + float(moved[1]))
            self._picked = place, self.workspace.frames_after_first
            self._pick()
        elif by == "lasso":
            self._add(Area(outline=tuple(path)) if len(path) > 2 else None)
        elif (box := _box(path)) is None:
            self._add(None)
        elif by == "subject":
            self._search = _Search(self._colours(), box)
        else:
            self._add(Area(window=Window.model_validate({"box": box, "shape": by})))

    def set_tolerance(self, tolerance: float, connected: bool) -> None:
        """Select what is so unlike the place that was clicked on last, and only what is connected or all."""
        self.state.tolerance, self.state.connected = tolerance, connected
        try:
            self._pick()
        except UserError as error:
            self.messages.warn(error.in_window)

    def _pick(self) -> None:
        if self._picked is None or self.state.select_by not in ("colour", "brightness"):
            return
        state, (place, frame) = self.state, self._picked
        like: dict[str, Any] = {"at": place if state.connected else None, "frame": frame}
        picture = self.workspace.session.replay.small_pictures.load(SOURCE, frame)
        row, column = pixel_at(place, picture.pixels)
        here = picture.with_pixels(picture.pixels[row : row + 1, column : column + 1])
        if state.select_by == "colour":
            colour = np.rint(channels(here)[0][0, 0] * 255).astype(int)
            like |= {"color": "#" + "".join(f"{value:02x}" for value in colour), "tolerance": state.tolerance}
        else:
            grey = float(intensity(here)[0, 0])
            either = min(state.tolerance, 0.49)
            low, high = round(grey - either, 4), round(grey + either, 4)
            like |= {"above": low if low > 0 else None, "below": high if high < 1 else None}
        self._add(Area(segment=Segment.model_validate(like)))

    def _add(self, area: Area | None) -> None:
        """Add an area to what was selected before, or take it away; None leaves that as it was."""
        parts = self._before
        if area is not None:
            combine = self._combine if parts and self._combine != "replace" else "add"
            parts = *parts, Part.model_validate({"combine": combine, **dict(area)})
        self._show(inverted(parts) if parts and self._is_inverted else parts)

    def _show(self, parts: tuple[Part, ...]) -> None:
        session, area = self.workspace.session, None
        if parts:
            width, height = session.replay.masks.canvas.size
            grid = Grid.for_picture(width, height, min(SHOWN, max(width, height)))
            try:
                share = self._fill(parts, 0.0).coverage(grid, session.replay.small_pictures, session.replay.as_seen)
            except ValueError as error:
                raise UserError(f"The selection failed: {error}.") from None
            area = np.rint(255 * share).astype(np.uint8)
        self.state.selection, self.state.selected_area = parts, area
        self.state.selected_part = 0.0 if area is None else float(area.mean()) / 255
        self._shown = self._now()

    def _colours(self) -> np.ndarray:
        """The picture as it is seen at this moment, small, (h, w, 3) uint8."""
        replay = self.workspace.session.replay
        picture = self.workspace.work.picture or replay.small_pictures.load(SOURCE)
        grid = Grid.for_picture(picture.width, picture.height, min(SHOWN, max(picture.width, picture.height)))
        colours = np.stack([to_grid(channel, grid) for channel in np.moveaxis(channels(picture)[0], 2, 0)], axis=-1)
        return np.rint(255 * replay.as_seen(colours, grid)).astype(np.uint8)

    def invert(self) -> None:
        """Select what is not selected, and nothing else.

        Raises:
            UserError: if nothing is selected.
        """
        if self.state.tool_name == "select":
            self._need_some()
            self._is_inverted = not self._is_inverted
            self._show(inverted(self.state.selection))

    def _need_some(self) -> None:
        if not self.state.selection:
            raise UserError("Nothing is selected yet.")

    # -- what becomes of it -----------------------------------------------------------------------------------------

    def fill(self, off: bool) -> None:
        """Fill the selection into the mask that is chosen, or take it off that.

        Raises:
            UserError: if nothing is selected.
        """
        state = self.state
        if state.tool_name != "select":
            return
        self._need_some()
        words = {"frozen": ("Freeze", "Thaw"), "thickness": ("Thicken", "Clear")}[state.mask]
        amount = 0.0 if off else 1.0 if state.mask == "frozen" else state.mask_decades
        self.workspace.session.edit_masks(f"{words[off]} the selection", self._fill(state.selection, amount))
        state.show_mask()

    def _fill(self, parts: tuple[Part, ...], amount: float) -> FillMask:
        first = {name: getattr(parts[0], name) for name in Area.model_fields}
        return FillMask(kind="fill", tick=0, of=self.state.mask, amount=amount, then=parts[1:], **first)

    def cancel(self) -> bool:
        """Give up what is being drawn or looked for, or else what is selected; True if there was something."""
        is_made, had = bool(self.path) or self._search is not None, bool(self.state.selection)
        if is_made:
            self.path, self._search = [], None
        else:
            self._forget()
        return is_made or had

    def _forget(self) -> None:
        self._before, self._picked, self._search, self.path = (), None, None, []
        self.state.selection, self.state.selected_area = (), None

    # -- frame by frame ---------------------------------------------------------------------------------------------

    @property
    def is_busy(self) -> bool:
        """A subject is being looked for."""
        return self._search is not None

    @property
    def hint(self) -> str:
        """What to do next, with its tool in hand."""
        if self.state.tool_name != "select" or self.path:
            return ""
        if self.is_busy:
            return "Looking for the subject ..."
        return "" if self.state.selection else SELECT_BY[self.state.select_by]

    def look(self) -> None:
        """See whether a subject has been found, and whether what is selected, or drawn, is still where it was."""
        (session, version), parts = self._now(), self.state.selection
        if (parts or self._search or self.path) and session is not self._shown[0]:
            self._forget()
        elif version != self._shown[1] and not session.is_moving and any(part.segment for part in parts):
            self._show(parts)
        if self._search is not None and not self._search.thread.is_alive():
            search, self._search = self._search, None
            try:
                self._add(Area(outline=search.outcome()))
            except UserError as error:
                self.messages.warn(error.in_window)

    def _now(self) -> tuple[Session, int]:
        session = self.workspace.session
        return session, session.replay.warp.version

    @property
    def outline(self) -> list[Point]:
        """What the drag under way goes around, as fractions of the picture; empty where there is none."""
        by, box = self.state.select_by, _box(self.path)
        if by == "lasso" or box is None:
            return self.path if by == "lasso" else []
        left, top, right, bottom = box
        if by in ("colour", "brightness"):
            return []
        if by != "ellipse":
            return [(left, top), (right, top), (right, bottom), (left, bottom)]
        x, y = (left + right) / 2, (top + bottom) / 2
        angles = (2 * pi * k / 64 for k in range(64))
        return [(x + (right - x) * cos(angle), y + (bottom - y) * sin(angle)) for angle in angles]


class _Search:
    """A subject that is looked for in a thread of its own; whoever does not want it any more forgets it."""

    def __init__(self, colours: np.ndarray, box: tuple[float, float, float, float]) -> None:
        self._colours, self._box = colours, box
        failed = "No subject is found: the search has failed. Draw the box again."
        self._found: tuple[Point, ...] | UserError = UserError(failed)
        self.thread = threading.Thread(target=self._work, name="looking for a subject", daemon=True)
        self.thread.start()

    def _work(self) -> None:
        try:
            self._found = subject_outline(self._colours, self._box)
        except UserError as error:
            self._found = error

    def outcome(self) -> tuple[Point, ...]:
        """The subject's outline. Raises UserError."""
        if isinstance(self._found, UserError):
            raise self._found
        return self._found


def _within(x: float, y: float) -> Point:
    """A place of the picture, with as many digits as a recipe needs."""
    return round(min(max(x, 0.0), 1.0), 5), round(min(max(y, 0.0), 1.0), 5)


def _box(path: list[Point]) -> tuple[float, float, float, float] | None:
    """Left, top, right and bottom of what was dragged from corner to corner; None where it was only clicked."""
    if not path:
        return None
    (left, right), (top, bottom) = (sorted((path[0][k], path[-1][k])) for k in (0, 1))
    return (left, top, right, bottom) if right - left > LEAST and bottom - top > LEAST else None

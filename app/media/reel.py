"""A clip to look at: the frames around the one that is wanted, decoded in a thread of their own."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import closing

import numpy as np

from app.errors import Cancelled, UserError
from app.media.clip import Clip
from app.model.picture import Picture

BUDGET = 256 * 2**20  # bytes of decoded frames
AHEAD = 24  # frames that are decoded before they are wanted, while the clip runs
JUMP = 30  # frames that are sooner decoded and not shown than others are looked for


class Reel:
    """Decodes the frame that is wanted, and those that come next, while nobody waits for it.

    Args:
        clip: the frames.
        shown: makes the pixels that are kept of a picture.
        budget: bytes of them that are kept, but two frames at least.

    Attributes:
        error: why a frame could not be read, in a sentence; "" if all could.
    """

    def __init__(self, clip: Clip, shown: Callable[[Picture], np.ndarray], budget: int = BUDGET) -> None:
        self.clip = clip
        self.error = ""
        self._words: list[str] = []
        self._shown = shown
        self._budget = budget
        self._kept: dict[int, np.ndarray] = {}
        self._wanted = clip.start
        self._runs = False
        self._end: int | None = None  # no frame has this number or a higher one
        self._most = clip.start  # nor does one that has been decoded
        self._next = clip.start  # that the open stream gives
        self._changed = threading.Condition()
        self._is_closed = False
        self._thread: threading.Thread | None = None

    def want(self, number: int, runs: bool) -> None:
        """Decode a frame, unless it is there; `runs`: the next ones will be wanted too, and nobody waits for any."""
        with self._changed:
            number = number if self._end is None else min(number, self._end - 1)
            if self._thread is not None and (number, runs) == (self._wanted, self._runs):
                return
            if number != self._wanted and not runs:
                self.error = ""  # it is tried again
            self._wanted, self._runs = number, runs
            self._changed.notify()
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name=f"reading {self.clip.path.name}", daemon=True)
            self._thread.start()

    def best(self) -> tuple[int, np.ndarray] | None:
        """The frame that is wanted; until it is there the newest, or while the clip runs the last before it, if any."""
        with self._changed:
            number = self._wanted
            if number not in self._kept:
                before = max((kept for kept in self._kept if kept < number), default=number)
                number = before if self._runs else self._next - 1
            return (number, self._kept[number]) if number in self._kept else None

    def awaits(self, number: int) -> bool:
        """Whether another frame than this one is wanted, and is there or may still come."""
        with self._changed:
            return number != self._wanted and (not self.error or self._wanted in self._kept)

    @property
    def frames(self) -> int:
        """How many there are, as far as is known: a file may tell of more than it has, or of fewer."""
        with self._changed:
            told = self.clip.start + (self.clip.frames or 1)
            return (max(told, self._most) if self._end is None else self._end) - self.clip.start

    def take_words(self) -> list[str]:
        """What has been lost, missed or failed since this was asked for last, in sentences."""
        with self._changed:
            words, self._words = self._words, []
            return words

    def close(self) -> None:
        """Decode nothing any more; the thread ends by itself."""
        with self._changed:
            self._is_closed = True
            self._changed.notify()

    # In the thread.

    def _work(self) -> None:
        back = 1
        while (first := self._needed_next()) is not None:
            self._next = first
            try:
                with closing(self.clip.pictures_from(first, self._is_in_vain, self._hear)) as pictures:
                    is_at_end = all(self._take(number, picture) for number, picture in pictures)
            except Cancelled:
                continue
            except UserError as error:
                self._fail(error.in_window)
            except Exception as error:  # of a decoder: no reason to lose the work
                self._fail(f"{self.clip.path.name} cannot be read: {error}")
            else:
                if not is_at_end:
                    continue
                is_empty = self._next == first
                self._end_at(first + 1 - back if is_empty else self._next)
                back = 2 * back if is_empty else 1

    def _needed_next(self) -> int | None:
        """Wait until a frame is needed that is not there, and tell which; None if none ever will be."""
        with self._changed:
            while not self._is_closed:
                if not self.error and (needed := self._needed) is not None:
                    return needed
                self._changed.wait()
            return None

    def _take(self, number: int, picture: Picture) -> bool:
        """Keep a frame, and wait until the next one of the stream is needed; False if others are instead."""
        pixels = self._shown(picture)
        with self._changed:
            self._keep(number, pixels)
            self._next = number + 1
            while self._needed is None and not self._is_closed:
                self._changed.wait()
            return not self._goes_elsewhere

    def _is_in_vain(self) -> bool:
        """Whether to give up what is being decoded; a frame that comes soon is better than none while they change."""
        with self._changed:
            return self._is_closed or (self._goes_elsewhere and not self.clip.is_steady)

    @property
    def _goes_elsewhere(self) -> bool:
        """What is needed does not come soon in the open stream."""
        needed = self._needed
        comes = needed is None or self._next <= needed <= self._next + (JUMP if self.clip.is_steady else needed)
        return self._is_closed or not comes

    @property
    def _needed(self) -> int | None:
        """The first frame that is not there, of the one that is wanted and those ahead of it."""
        size = next(iter(self._kept.values())).nbytes if self._kept else self._budget
        stop = self._wanted + 1 + (max(min(AHEAD, self._budget // size - 2), 0) if self._runs else 0)
        stop = stop if self._end is None else min(stop, self._end)
        return next((number for number in range(self._wanted, stop) if number not in self._kept), None)

    def _keep(self, number: int, pixels: np.ndarray) -> None:
        """Keep a frame, in the place of those that are farthest from being wanted: what is ahead is nearer."""
        self._kept[number] = pixels
        self._most = max(self._most, number + 1)

        def distance(other: int) -> int:
            return other - self._wanted if other >= self._wanted else 2 * (self._wanted - other)

        while len(self._kept) > max(self._budget // pixels.nbytes, 2):
            del self._kept[max(self._kept, key=distance)]

    def _end_at(self, end: int) -> None:
        with self._changed:
            if end <= self.clip.start:
                self._fail(f"Cannot read {self.clip.path}: no frame in it can be decoded; get it again.")
            self._end = max(end, self.clip.start + 1)
            self._wanted = min(self._wanted, self._end - 1)

    def _hear(self, said: str) -> None:
        with self._changed:
            self._words.append(said)

    def _fail(self, sentence: str) -> None:
        with self._changed:
            self.error = sentence
            self._words.append(sentence)

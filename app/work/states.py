"""States of a simulation kept in a folder, so that a later part of an animation begins where an earlier one ended."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from app.errors import UserError
from app.media.files import make_folder, replacing
from app.media.inputs import Archive, open_input
from app.work.replay import Replay

EVERY = 64  # ticks between two states
BUDGET = 4 * 2**30  # bytes of a folder
FORMAT = 2
SUFFIX = ".state.npz"
# Parts of a recipe that the fluid knows nothing of.
NOT_SIMULATED = {"name", "time", "stop", "output", "edges", "amount"}


class StoredStates:
    """The states of one simulation in a folder that others may use at the same time.

    A state is found only by what made it: the recipe as far as it is simulated, the pictures' values, this program's
    code and the OpenGL. It brings the simulation back to the bit.

    Args:
        folder: made if it is not there. Beyond `BUDGET` bytes, what has not been used for longest is deleted.
        replay: the simulation, just built.
        notice: hears of a state that cannot be used.

    Raises:
        UserError: if the folder cannot be made.
    """

    def __init__(self, folder: Path, replay: Replay, notice: Callable[[str], None]) -> None:
        self.folder = folder
        self._replay, self._notice = replay, notice
        self._failed = False
        self._damaged: set[int] = set()
        self._key = _digest(replay)
        make_folder(folder)

    def resume(self, tick: int) -> bool:
        """Take the simulation to the last state after the present one and not after `tick`; True if there is one."""
        for stored in sorted(self._ticks(), reverse=True):
            if self._replay.tick < stored <= tick and self._load(stored):
                return True
        return False

    def keep(self, last: bool = False) -> None:
        """Store the present state if its turn has come, or if it is the `last` one."""
        tick = self._replay.tick
        path = self._path(tick)
        if self._failed or tick == 0 or not (last or tick % EVERY == 0):
            return
        # Not `Path.exists`, which raises where the folder may not be searched.
        if os.path.exists(path) and not os.path.islink(path) and tick not in self._damaged:
            return
        parts: dict[str, Any] = self._replay.snapshot()
        try:
            if os.path.islink(path):  # what it leads to is somebody's, and no state of ours
                raise UserError(f"{path} is a link; remove it")
            with replacing(path) as temporary, temporary.open("wb") as stream:
                np.savez(stream, about=np.array(self._about(tick)), **parts)
        except UserError as error:  # the animation does not depend on it
            self._notice(f"No more states are kept: {error}")
            self._failed = True
        self._tidy(path)

    def _load(self, tick: int) -> bool:
        path = self._path(tick)
        if not os.path.exists(path):  # another process has just tidied it up
            return False
        try:
            with open_input(path, "state", BUDGET) as stream, Archive(stream) as archive:
                archive.check_stored()
            # A zip file, whose checksums NumPy looks at.
            with open_input(path) as stream, np.load(stream, allow_pickle=False) as stored:
                if str(stored["about"]) != self._about(tick):
                    raise ValueError("it is of another simulation")
                self._replay.resume(tick, {name: stored[name] for name in stored.files if name != "about"})
            os.utime(path)
        except Exception as error:  # of damaged files the readers raise anything
            reason = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
            self._notice(f"{path} is damaged ({reason}) and is made anew")
            self._damaged.add(tick)
            return False
        return True

    def _ticks(self) -> Iterator[int]:
        for path in self.folder.glob(f"{self._key}-*{SUFFIX}"):
            number = path.name.removeprefix(f"{self._key}-").removesuffix(SUFFIX)
            if number.isdecimal() and not os.path.islink(path):
                yield int(number)

    def _path(self, tick: int) -> Path:
        return self.folder / f"{self._key}-{tick:07d}{SUFFIX}"

    def _about(self, tick: int) -> str:
        return json.dumps({"fluidwarp state": FORMAT, "of": self._key, "tick": tick})

    def _tidy(self, newest: Path) -> None:
        """Delete what has not been used for longest, of any simulation, as long as there is too much."""
        found = []
        for path in self.folder.glob(f"*{SUFFIX}"):
            with suppress(OSError):
                status = path.stat()
                found.append((path == newest, status.st_mtime, status.st_size, path))
        total = sum(size for _, _, size, _ in found)
        for is_newest, _, size, path in sorted(found):
            if total <= BUDGET or is_newest:
                return
            with suppress(OSError):
                path.unlink()
            total -= size


def _digest(replay: Replay) -> str:
    """What stands for a simulation: the same for two that come to the same bits."""
    told = hashlib.sha256(code().encode())
    told.update(replay.device.limits.renderer.encode() + replay.device.limits.version.encode())
    told.update(replay.recipe.model_dump_json(exclude=NOT_SIMULATED).encode())
    for part in replay.pictures.values(replay.recipe):
        told.update(f"{part.shape} {part.dtype}".encode())
        told.update(np.ascontiguousarray(part).data.cast("B"))
    return told.hexdigest()[:32]


@cache
def code() -> str:
    """A digest of everything that decides what a step does; a version's number would not tell a change in between."""
    told = hashlib.sha256()
    for package in ("app", "solver", "shaders"):
        root = Path(str(resources.files(package)))
        for path in sorted(path for ending in ("py", "frag", "vert", "glsl") for path in root.rglob(f"*.{ending}")):
            if "ui" not in path.relative_to(root).parts:
                told.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    return told.hexdigest()

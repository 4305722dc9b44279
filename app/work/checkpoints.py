"""States of a simulation kept on the GPU, so that going back is not going through everything again."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from app.model.recipe import Recipe
from solver.gl.device import Device
from solver.gl.field import Field
from solver.gl.tiled import Tile
from solver.state import State

DEFAULT_BUDGET = 512 * 2**20


@dataclass(frozen=True)
class Moment:
    """The states of all parts of a simulation, by name; whoever has it releases it."""

    states: dict[str, State]

    def arrays(self) -> dict[str, np.ndarray]:
        """Everything in it off the GPU, named `part/name`."""
        return {f"{part}/{name}": a for part, state in self.states.items() for name, a in state.arrays().items()}

    def with_arrays(self, device: Device, arrays: Mapping[str, np.ndarray]) -> Moment:
        """A moment like this one that holds what `arrays()` gave.

        Raises:
            ValueError: if that was of another simulation.
        """
        filled = Moment({})
        try:
            for part, state in self.states.items():
                own = {name.removeprefix(f"{part}/"): a for name, a in arrays.items() if name.startswith(f"{part}/")}
                filled.states[part] = state.with_arrays(device, own)
        except ValueError:
            filled.release()
            raise
        return filled

    @cached_property
    def textures(self) -> list[Field | Tile]:
        """The textures and tiles that it holds, some of them together with other moments."""
        return [texture for state in self.states.values() for texture in state.textures]

    def release(self) -> None:
        """Free the textures that no other moment holds."""
        for state in self.states.values():
            state.release()


@dataclass(frozen=True)
class Checkpoint:
    """The state before the step of tick `tick` of a recipe, with what is done to masks at it in no time."""

    recipe: Recipe
    tick: int
    moment: Moment

    def is_valid_for(self, recipe: Recipe) -> bool:
        return recipe.goes_on_from(self.recipe, self.tick)


class Checkpoints:
    """Checkpoints within `budget` bytes: dense where the work is, sparse far from it.

    Those of an undone future stay as long as there is room, so that redoing it is as quick as undoing it.
    """

    def __init__(self, budget: int = DEFAULT_BUDGET) -> None:
        self.budget = budget
        self.nbytes = 0  # of texture memory that they come to at most, what several share counted once
        self._kept: list[Checkpoint] = []
        self._holders = Counter[Field | Tile]()

    def __len__(self) -> int:
        return len(self._kept)

    def nearest(self, recipe: Recipe, tick: int) -> Checkpoint | None:
        """The last checkpoint at or before `tick` that is valid for `recipe`."""
        before = sorted((kept for kept in self._kept if kept.tick <= tick), key=_progress, reverse=True)
        return next((kept for kept in before if kept.is_valid_for(recipe)), None)

    def has(self, recipe: Recipe, tick: int) -> bool:
        """True if exactly this moment is kept."""
        here = (kept for kept in self._kept if kept.tick == tick)
        return any(kept.is_valid_for(recipe) and kept.recipe.goes_on_from(recipe, tick) for kept in here)

    def add(self, checkpoint: Checkpoint) -> None:
        """Keep a checkpoint; those that are missed least go where there is no room, and none stays with no budget."""
        self._kept.append(checkpoint)
        for texture in checkpoint.moment.textures:
            self._holders[texture] += 1
            self.nbytes += texture.nbytes if self._holders[texture] == 1 else 0
        while self.nbytes > self.budget and self._kept:
            self._drop(self._least_missed(checkpoint))

    def clear(self) -> None:
        """Let all go."""
        while self._kept:
            self._drop(self._kept[0])

    def _least_missed(self, newest: Checkpoint) -> Checkpoint:
        """An undone future's oldest, or else the one with the smallest gap for its distance from the newest."""
        stale = [kept for kept in self._kept if not kept.is_valid_for(newest.recipe)]
        if stale:
            return stale[0]
        line = sorted(self._kept, key=lambda kept: kept.tick)
        gaps = [
            ((after.tick - before.tick) / (1 + abs(newest.tick - kept.tick)), position, kept)
            for position, (before, kept, after) in enumerate(zip(line, line[1:], line[2:], strict=False))
            if kept is not newest
        ]
        return min(gaps)[2] if gaps else line[0]

    def _drop(self, checkpoint: Checkpoint) -> None:
        self._kept.remove(checkpoint)
        for texture in checkpoint.moment.textures:
            self._holders[texture] -= 1
            if not self._holders[texture]:
                del self._holders[texture]
                self.nbytes -= texture.nbytes
        checkpoint.moment.release()


def _progress(kept: Checkpoint) -> tuple[int, int]:
    """How far it has come: its tick, and how much has been done to masks there."""
    return kept.tick, len(kept.recipe.masks_at(kept.tick))

"""States of a simulation kept on the GPU, so that going back is not going through everything again."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

from app.recipe import Recipe
from solver.gl.device import Device
from solver.gl.field import Field
from solver.warp.map import MapState

DEFAULT_BUDGET = 512 * 2**20


@dataclass(frozen=True)
class State:
    """Everything that later steps depend on, copied."""

    fields: tuple[Field, ...]
    warp: MapState

    @cached_property
    def nbytes(self) -> int:
        """Bytes of texture memory."""
        return sum(field.nbytes for field in self.fields) + self.warp.nbytes

    def release(self) -> None:
        """Free the textures."""
        for field in self.fields:
            field.release()
        self.warp.release()


def copies(device: Device, fields: Iterable[Field]) -> tuple[Field, ...]:
    """New fields that hold what `fields` hold."""
    made = []
    for field in fields:
        copy = device.field(field.size, field.components, f"{field.label}, saved", field.dtype)
        copy.copy_from(field)
        made.append(copy)
    return tuple(made)


@dataclass(frozen=True)
class Checkpoint:
    """The state before tick `tick` of a recipe; good for every recipe that has the same past up to there."""

    recipe: Recipe
    tick: int
    state: State

    def is_valid_for(self, recipe: Recipe) -> bool:
        return self.recipe.agrees_until(recipe) >= self.tick


class Checkpoints:
    """Checkpoints within `budget` bytes: dense where the work is, sparse far from it.

    Those of an undone future stay as long as there is room, so that redoing it is as quick as undoing it.
    """

    def __init__(self, budget: int = DEFAULT_BUDGET) -> None:
        self.budget = budget
        self._kept: list[Checkpoint] = []

    def __len__(self) -> int:
        return len(self._kept)

    @property
    def nbytes(self) -> int:
        """Bytes of texture memory."""
        return sum(checkpoint.state.nbytes for checkpoint in self._kept)

    def nearest(self, recipe: Recipe, tick: int) -> Checkpoint | None:
        """The last checkpoint at or before `tick` that is valid for `recipe`."""
        before = sorted((kept for kept in self._kept if kept.tick <= tick), key=lambda kept: kept.tick, reverse=True)
        return next((kept for kept in before if kept.is_valid_for(recipe)), None)

    def has(self, recipe: Recipe, tick: int) -> bool:
        """True if exactly this moment is kept."""
        return any(kept.tick == tick and kept.is_valid_for(recipe) for kept in self._kept)

    def add(self, checkpoint: Checkpoint) -> None:
        """Keep a checkpoint; those that are missed least go where there is no room, and none stays with no budget."""
        self._kept.append(checkpoint)
        while self.nbytes > self.budget and self._kept:
            self._drop(self._least_missed(checkpoint))

    def clear(self) -> None:
        """Let all go."""
        while self._kept:
            self._drop(self._kept[0])

    def _least_missed(self, newest: Checkpoint) -> Checkpoint:
        """An undone future's oldest, or else the one with the smallest gap for its distance from the newest."""
        stale = [kept for kept in self._kept if not newest.recipe.agrees_until(kept.recipe) >= kept.tick]
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
        checkpoint.state.release()

"""The forces of a recipe on the GPU, and what they do in a tick."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from app.errors import UserError
from app.model.forces import BuiltForce
from app.model.timelaws import Feedback, Law
from solver.gl.device import Device
from solver.gl.field import Field
from solver.scheme import Scheme

Acting = list[tuple[Field, float]]
"""Fields, and how many times each acts."""

# What a force may do within a tick, and the map still follow: in longer sides, and in e-folds of area.
FARTHEST = 2.0
WIDEST = 3.0


@dataclass(frozen=True)
class LoadedForce:
    """A force on the GPU, and the largest values in its fields."""

    label: str
    law: Law
    faces: Field | None
    divergence: Field | None
    motion: Field | None
    strongest: float
    widest: float
    fastest: float

    @classmethod
    def of(cls, device: Device, force: BuiltForce) -> LoadedForce:
        arrays = force.faces, force.divergence, force.motion
        faces, divergence, motion = (None if a is None else device.upload(a, force.label) for a in arrays)
        strongest, widest, fastest = (0.0 if a is None else float(np.abs(a).max()) for a in arrays)
        return cls(force.label, force.law, faces, divergence, motion, strongest, widest, fastest)

    def release(self) -> None:
        """Free the textures."""
        for field in (self.faces, self.divergence, self.motion):
            if field is not None:
                field.release()

    def acts_within(self, start: float, end: float) -> bool:
        """True if it is at work between two times, in seconds; one that is fed back always may be."""
        return isinstance(self.law, Feedback) or self.law.impulse(start, end) != 0

    def check(self, impulse: float, dt: float, time: float) -> None:
        """Make sure that the force is one that a step can follow.

        Raises:
            UserError: if it throws the fluid farther than the picture, or swells it out of all measure, within a tick.
        """
        mend = "make its 'strength' or 'fluid.dt' smaller"
        if (thrown := (self.strongest * dt + self.fastest) * abs(impulse)) > FARTHEST:
            raise UserError(
                f"{self.label}: at t = {time:.3g} s it throws the fluid {thrown:.3g} times the picture's size within "
                f"one tick; {mend}"
            )
        if (swollen := self.widest * abs(impulse)) > WIDEST:
            grown = f"makes areas e^{swollen:.3g} times as large within one tick"
            raise UserError(f"{self.label}: at t = {time:.3g} s it {grown}; {mend}")


def acting(forces: list[LoadedForce], fluid: Scheme, start: float, dt: float, state: Any) -> tuple[Acting, Acting]:
    """The force fields with their impulses in this tick, and the motions; sources go into the fluid's own.

    state: what a feedback law looks at.
    """
    pushes, motions = Acting(), Acting()
    for force in forces:
        impulse = force.law.impulse(start, start + dt, state)
        force.check(impulse, dt, start)
        if impulse and force.faces is not None:
            pushes.append((force.faces, impulse))
        if impulse and force.divergence is not None:
            # The velocity that holds during this tick has to make all the room that the tick shall make.
            fluid.add_source(force.divergence, impulse / dt)
        if impulse and force.motion is not None:
            motions.append((force.motion, impulse / dt))
    return pushes, motions

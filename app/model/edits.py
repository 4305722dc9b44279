"""Edits of a recipe that take several of its parts: each gives another recipe, or parts of one."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Callable
from typing import Any

from app.errors import UserError
from app.model.handles import MOST_HANDLES, MOST_LINES, RecipeHandle, RecipePin, labelled
from app.model.mask_edits import MaskStroke
from app.model.recipe import DensitySettings, Recipe, Stop
from app.model.schema import written
from app.model.strokes import Change, Stroke
from app.model.toml import MOST_NUMBERS, MOST_WORDS
from app.model.tools import Made

TIMED = ("stroke", "handle", "pin", "change", "mask")
"""The parts of a recipe that are cut off where the work goes on before their end."""

# Moves of the pointer, and ticks: minutes of the fastest mouse, and of holding still. Below `LONGEST_HAND`, so that a
# mask that has been painted can be read again.
LONGEST_GESTURE = 50_000
# Words and numbers that there is to be room for before one: half of it for holding still.
ROOM = (100, 8 * LONGEST_GESTURE)


def cut_off(recipe: Recipe, tick: int) -> Recipe:
    """What of a recipe is done before a tick, and lasts until then; what is set at it stays, as it is shown."""
    dt = recipe.fluid.dt
    handles = [before for handle in recipe.handle if (before := handle.before(tick, dt)) is not None]
    pins = [pin for pin in recipe.pin if pin.first_tick(dt) < tick]
    resets = {change.tick * dt for change in recipe.change if change.reset_warp and change.tick >= tick}
    handles, pins = (  # what a reset let go of that is cut off goes on to hold
        tuple(led.model_copy(update={"end": None}) if led.end in resets else led for led in all_)
        for all_ in (handles, pins)
    )
    changes = () if tick == 0 else recipe.change  # what is set at the very start is what the fluid begins as
    return recipe.edited(
        fluid=recipe.fluid_at(0) if tick == 0 else recipe.fluid,
        stroke=tuple(part for stroke in recipe.stroke for part in stroke.cut(tick)),
        handle=handles,
        pin=pins,
        change=tuple(kept for change in changes if (kept := change.before(tick)) is not None),
        mask=tuple(edit for edit in recipe.mask if edit.tick <= tick),
        duration=max(tick, 1) * dt,
    )


def ending_at(recipe: Recipe, tick: int) -> Recipe:
    """A recipe that ends at a tick. It lasts a tick at least: at 0 all that acts in it, or stops it, is left out."""
    if tick == 0:
        recipe = cut_off(recipe, 0).edited(force=(), density=DensitySettings(), stop=Stop())
    return recipe.edited(duration=max(tick, 1) * recipe.fluid.dt)


def with_made(recipe: Recipe, made: Made, ticks: int, taken: int | None = None) -> Recipe:
    """A recipe with what a gesture has made, and so many ticks; `taken` is the number of the handle in hand."""
    duration = ticks * recipe.fluid.dt
    if isinstance(made, MaskStroke):
        return recipe.edited(mask=(*recipe.mask, made))
    if isinstance(made, Stroke):
        return recipe.edited(stroke=(*recipe.stroke, made), duration=duration)
    at = len(recipe.handle) if taken is None else taken
    return recipe.edited(handle=(*recipe.handle[:at], made, *recipe.handle[at + 1 :]), duration=duration)


def with_taken(recipe: Recipe, led: RecipeHandle | RecipePin, tick: int) -> tuple[Recipe, int]:
    """A recipe in which a handle can be led on, and its number; a pin becomes one, for good if it is led."""
    if isinstance(led, RecipePin):
        handle = RecipeHandle.model_validate(led.model_dump() | {"keys": ()})
        at = recipe.pin.index(led)
        recipe = recipe.edited(pin=(*recipe.pin[:at], *recipe.pin[at + 1 :]), handle=(*recipe.handle, handle))
    else:
        # What comes after this moment has been cut off, if the playhead was sent back here.
        cut = led.before(tick, recipe.fluid.dt)
        handle = cut if cut is not None and cut in recipe.handle else led
    return recipe, recipe.handle.index(handle)


def with_led(
    recipe: Recipe, label: str, changed: Callable[[RecipeHandle | RecipePin], RecipeHandle | RecipePin | None]
) -> dict[str, Any]:
    """The handles and pins of a recipe, with another, or none, in the place of the one that messages call so."""
    parts = dict[str, Any](handle=(), pin=())
    for name, led in labelled(recipe.handle, recipe.pin):
        if (kept := changed(led) if name == label else led) is not None:
            parts[led.kind] = *parts[led.kind], kept
    return parts


def check_room(recipe: Recipe, line: bool) -> None:
    """Raise `UserError` if a recipe has no room for another handle, or for another line."""
    led = (*recipe.handle, *recipe.pin)
    if len(led) >= MOST_HANDLES:
        raise UserError(f"There are {MOST_HANDLES} handles and pins already; remove one to set another.")
    if line and sum(bool(each.points) for each in led) >= MOST_LINES:
        raise UserError(f"There are {MOST_LINES} lines already; remove one to set another.")


def check_size(recipe: Recipe, before: Recipe | None = None) -> None:
    """Raise `UserError` if a recipe that an edit makes of another is too large to be read again.

    Args:
        before: what was edited, which may be made smaller at any size; None if the recipe is to have room for one more
            gesture.
    """
    size, room = written(recipe), (0, 0) if before else ROOM
    most = MOST_WORDS - room[0], MOST_NUMBERS - room[1]
    if before is not None:
        most = tuple(map(max, most, written(before)))
    if any(part > limit for part, limit in zip(size, most, strict=True)):
        raise UserError(
            "This work is as large as one may be. Undo something, or export the warp as a map and begin anew with that."
        )
    if before is not None and (said := recipe.excess) and not before.excess:
        raise UserError(f"That was not done. With it, {said}.")


def with_change(recipe: Recipe, tick: int, settings: dict[str, Any], lasts: bool) -> Recipe:
    """A recipe in which something is set at a tick; what does not last is done at once."""
    before = [change for change in recipe.change if change.tick != tick]
    here = [change.model_dump(exclude_defaults=True) for change in recipe.change if change.tick == tick]
    made = Change(tick=tick).model_copy(update=dict(ChainMap(settings, *reversed(here))))
    dt = recipe.fluid.dt
    if settings.get("reset_warp"):  # what holds the picture lets go of it
        handles, pins = (tuple(_ended(led, tick * dt) for led in all_) for all_ in (recipe.handle, recipe.pin))
        recipe = recipe.edited(handle=handles, pin=pins)
    # What is done at once needs a tick to be done in.
    return recipe.edited(change=(*before, made), duration=recipe.duration if lasts else (tick + 1) * dt)


def _ended(led: RecipeHandle | RecipePin, time: float) -> RecipeHandle | RecipePin:
    """A handle or a pin that lets go at a time, unless it has before."""
    ends = led.end is not None and led.end <= time
    return led if ends else led.model_copy(update={"end": max(time, led.start)})

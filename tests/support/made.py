"""Models of a recipe made by chance, from what their fields take; the same name gives the same one for ever."""

from __future__ import annotations

import types
from random import Random
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

import annotated_types
from pydantic import BaseModel, ValidationError

M = TypeVar("M", bound=BaseModel)
MOST = 10
"""That a whole number is above its least."""


def made(kind: type[M], name: str, **given: Any) -> M:
    """One of its kind: half of its fields as by default, the others anything that they take.

    Each field has dice of its own, so that a new field changes no other.

    Args:
        kind: what is made.
        name: what the dice begin with.
        given: fields that are not left to chance.
    """
    for attempt in range(400):
        parts = dict(given)
        for key, field in kind.model_fields.items():
            dice = Random(f"{kind.__name__} {name} {key} {attempt}")
            if key not in given and (field.is_required() or dice.random() < 0.5):
                parts[key] = _value(field.annotation, [*field.metadata, field], dice, f"{name} {key} {attempt}")
        try:
            return kind.model_validate(parts)
        except ValidationError:
            continue
    raise AssertionError(f"no {kind.__name__} of the name {name} is valid")


def _value(wanted: Any, metadata: list[Any], dice: Random, name: str) -> Any:
    while get_origin(wanted) is Annotated:
        wanted, *more = get_args(wanted)
        metadata = metadata + [part for one in more for part in getattr(one, "metadata", [one])]
    arguments, origin = get_args(wanted), get_origin(wanted)
    if origin in (Union, types.UnionType):
        return _value(dice.choice(arguments), metadata, dice, name)
    if origin is Literal:
        return dice.choice(arguments)
    if origin is tuple:
        if arguments[1:] != (...,):
            return tuple(_value(part, [], dice, name) for part in arguments)
        least = max([part.min_length for part in metadata if isinstance(part, annotated_types.MinLen)], default=0)
        return tuple(_value(arguments[0], [], dice, f"{name} {k}") for k in range(dice.randint(max(least, 1), 4)))
    if isinstance(wanted, type) and issubclass(wanted, BaseModel):
        return made(wanted, name)
    if wanted in (int, float):
        low, high = _bounds(metadata)
        if wanted is int:
            return dice.randint(int(low), int(min(high, low + MOST)))
        low, high = max(low, -0.4), min(high, max(low, -0.4) + 1.8)
        return low + (high - low) * dice.random()
    if wanted is bool:
        return dice.random() < 0.5
    if wanted is str:
        return "".join(dice.choice("abc") for _ in range(3))
    return None


def _bounds(metadata: list[Any]) -> tuple[float, float]:
    """What a number lies between, a little above what it must be greater than."""
    low, high = [float("-inf")], [float("inf")]
    for part in metadata:
        for found, name in ((low, "ge"), (high, "le"), (low, "gt"), (high, "lt")):
            if (bound := getattr(part, name, None)) is not None:
                found.append(float(bound) + (1e-3 if name == "gt" else 0.0))
    return max(low), min(high)

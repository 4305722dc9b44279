"""The format of recipes: what each key may hold, and what it is where a recipe leaves it out.

A recipe that was saved must mean the same for ever: a line of `golden/recipe.txt` changes with the version alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from app.model.recipe import Recipe

GOLDEN = Path(__file__).parents[1] / "golden" / "recipe.txt"
BOUNDS = {
    "gt": "above",
    "ge": "from",
    "lt": "below",
    "le": "to",
    "min_length": "of at least",
    "max_length": "of at most",
}


def bounds_of(field: FieldInfo) -> list[str]:
    found = ((word, getattr(item, name, None)) for item in field.metadata for name, word in BOUNDS.items())
    return [f"{word} {bound}" for word, bound in found if bound is not None]


def told(annotation: Any) -> str:
    """A type with its bounds, in words; of tables, their names."""
    origin, given = get_origin(annotation), get_args(annotation)
    if origin is Literal:
        return " or ".join(map(repr, given))
    bounds = [bound for part in given if isinstance(part, FieldInfo) for bound in bounds_of(part)]
    parts = [told(part) for part in given if not isinstance(part, FieldInfo)]
    if origin is Annotated:
        return " ".join([parts[0], *bounds])
    if origin is tuple:
        return f"tuple[{', '.join(parts)}]"
    if origin in (Union, UnionType):
        return " or ".join(parts)
    return "..." if annotation is ... else getattr(annotation, "__name__", type(annotation).__name__)


def models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from models_in(part)


def lines() -> Iterator[str]:
    waiting: list[type[BaseModel]] = [Recipe]
    for model in waiting:  # grows on the way
        yield f"{model.__name__}:"
        for name, field in model.model_fields.items():
            default = "needed" if field.default is PydanticUndefined else repr(field.default)
            yield f"  {name}: {' '.join([told(field.annotation), *bounds_of(field)])}; {default}"
            waiting += [each for each in models_in(field.annotation) if each not in waiting]


def test_every_key_holds_what_it_did_and_is_by_default_what_it_was() -> None:
    assert [*lines()] == GOLDEN.read_text("utf-8").splitlines()

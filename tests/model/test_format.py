"""The format of recipes: what each key may hold, and what it is where a recipe leaves it out.

A recipe that was saved must mean the same for ever: a line of `golden/recipe.txt` changes with the version alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from app.model.recipe import Recipe

GOLDEN = Path(__file__).parents[1] / "golden" / "recipe.txt"


def told(annotation: Any) -> str:
    """A type with its bounds, in words; of tables, their names."""
    if isinstance(annotation, type):
        return annotation.__name__
    if get_origin(annotation) is Literal:
        return " or ".join(map(repr, get_args(annotation)))
    parts = [told(part) for part in get_args(annotation) if not isinstance(part, FieldInfo)]
    bounds = [repr(item) for part in get_args(annotation) if isinstance(part, FieldInfo) for item in part.metadata]
    name = getattr(get_origin(annotation), "__name__", "")
    inside = " or ".join(parts) if "Union" in name else f"{name}[{', '.join(parts)}]" if name == "tuple" else parts[0]
    return f"{inside} {' '.join(bounds)}".strip() if parts else str(annotation)


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
            bounds = " ".join(map(repr, field.metadata))
            yield f"  {name}: {told(field.annotation)} {bounds}".rstrip() + f"; {default}"
            waiting += [each for each in models_in(field.annotation) if each not in waiting]


def test_every_key_holds_what_it_did_and_is_by_default_what_it_was() -> None:
    assert [*lines()] == GOLDEN.read_text("utf-8").splitlines()

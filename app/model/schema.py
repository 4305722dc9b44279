"""The strict, frozen base of everything a recipe is made of, and the values that many of its keys take."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self, TypeVar, get_args, get_origin

from pydantic import AfterValidator, BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo


class Model(BaseModel):
    """A frozen value that takes no unknown key, no number written as text, and no NaN or infinity."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", allow_inf_nan=False)

    def edited(self, **keys: Any) -> Self:
        """The same with other values of some keys, validated."""
        return type(self).model_validate({name: getattr(self, name) for name in type(self).model_fields} | keys)


Fraction01 = Annotated[float, Field(ge=0, le=1)]
"""A fraction from 0 to 1, both included."""

Place = Annotated[float, Field(ge=-10, le=10)]
"""A fraction of the picture's width or height; a little outside is allowed, as a drag may leave the picture."""


def _without_nul(name: str) -> str:
    if "\0" in name:
        raise ValueError("no file has a NUL in its name")
    return name


FileName = Annotated[str, Field(min_length=1), AfterValidator(_without_nul)]
"""The name of a file, relative to the recipe's folder."""

Radius = Annotated[float, Field(gt=0, le=10)]
"""A radius, in longer sides of the picture."""

Item = TypeVar("Item")
Several = Annotated[tuple[Item, ...], Field(fail_fast=True)]
"""Any number of items, looked at until one is wrong: each that is costs pydantic a thousand bytes."""


def frozen(data: Any) -> Any:
    """`data` with every list made a tuple, as the models hold them."""
    if isinstance(data, dict):
        return {key: frozen(value) for key, value in data.items()}
    if isinstance(data, list):
        return tuple(frozen(value) for value in data)
    return data


def plain(model: BaseModel) -> dict[str, Any]:
    """The model as tables, lists and values, in the order TOML is written in, without what is as by default.

    What tells the members of a union apart is always there. `frozen(plain(model))` validates to an equal model.
    """
    told = {
        name: _plain_value(getattr(model, name))
        for name, field in type(model).model_fields.items()
        if len(only_values(field)) == 1 or getattr(model, name) != field.default
    }
    # What it is comes first; and a single value after a table would belong to the table.
    return dict(sorted(told.items(), key=lambda item: (_rank(item[1]), _HEADS.get(item[0], len(_HEADS)))))


def written(value: Any) -> tuple[int, int]:
    """(keys, values and brackets, numbers in lists) that a model, or part of one, takes in TOML, or a few more.

    As `app.model.toml` counts them: a fraction is two words, and a comma after a list is one more number.
    """
    if isinstance(value, BaseModel):
        parts = [written(getattr(value, name)) for name in value.model_fields_set]
        return 5 + sum(1 + words for words, _ in parts), sum(numbers for _, numbers in parts)
    if not isinstance(value, tuple) or not value:
        return 2, 0
    if isinstance(value[0], (BaseModel, str)):
        parts = [written(part) for part in value]
        return 1 + sum(words for words, _ in parts), sum(numbers for _, numbers in parts)
    return 2, 1 + len(value) * (len(value[0]) if isinstance(value[0], tuple) else 1)


_HEADS = {
    head: rank for rank, head in enumerate(("version", "name", "kind", "tool", "tick", "muted", "repeat", "every"))
}


def _plain_value(value: Any) -> Any:
    if isinstance(value, BaseModel):
        return plain(value)
    return [_plain_value(item) for item in value] if isinstance(value, (tuple, list)) else value


def _rank(value: Any) -> int:
    if isinstance(value, dict):
        return 1
    return 2 if isinstance(value, list) and any(isinstance(item, dict) for item in value) else 0


def label_of(key: str, number: int, name: str) -> str:
    """What messages call an item of a list, counted from 1: force[2] "wind"."""
    return f'{key}[{number}] "{name}"' if name else f"{key}[{number}]"


def only_values(field: FieldInfo) -> tuple[Any, ...]:
    """The values that a field can only have."""
    return get_args(field.annotation) if get_origin(field.annotation) is Literal else ()

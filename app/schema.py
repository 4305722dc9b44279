"""The strict, frozen base of everything a recipe is made of, and what is wrong with a recipe in plain words."""

from __future__ import annotations

import difflib
import re
from typing import Annotated, Any, Literal, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from app.errors import UserError


class Model(BaseModel):
    """A frozen value that takes no unknown key, no number written as text, and no NaN or infinity."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", allow_inf_nan=False)


Fraction01 = Annotated[float, Field(ge=0, le=1)]
"""A fraction from 0 to 1, both included."""

Place = Annotated[float, Field(ge=-10, le=10)]
"""A fraction of the picture's width or height; a little outside is allowed, as a drag may leave the picture."""

Radius = Annotated[float, Field(gt=0, le=10)]
"""A radius, in longer sides of the picture."""


def frozen(data: Any) -> Any:
    """`data` with every list made a tuple, as the models hold them."""
    if isinstance(data, dict):
        return {key: frozen(value) for key, value in data.items()}
    if isinstance(data, list):
        return tuple(frozen(value) for value in data)
    return data


def complaint(error: ValidationError, model: type[BaseModel], data: Any, text: str, source: str) -> UserError:
    """The first fault that pydantic found in `data`, as one sentence for the person who wrote it.

    Args:
        error: what the validation of `data` raised.
        model: the model that was asked for.
        data: what was validated.
        text: the TOML that `data` was read from, or "", to find the line in.
        source: the file's name, as the sentence begins with it.
    """
    faults = error.errors(include_url=False)
    # An unknown key is often the cause of a missing one, so that it is told first.
    fault = next((fault for fault in faults if fault["type"] == "extra_forbidden"), faults[0])
    path = _path_in(data, fault["loc"])
    line = line_of(text, path)
    where = f"{source}, line {line}: " if line else f"{source}: "
    others = f" ({len(faults) - 1} more after this one)" if len(faults) > 1 else ""
    return UserError(f"{where}{_sentence(fault, path, model)}{others}")


def _path_in(data: Any, loc: tuple[int | str, ...]) -> list[int | str]:
    """The keys of `loc` that are keys of the file: without the names of union members that pydantic mixes in."""
    path: list[int | str] = []
    for position, item in enumerate(loc):
        if (isinstance(data, dict) and item in data) or (isinstance(data, (list, tuple)) and isinstance(item, int)):
            path.append(item)
            data = data[item] if not isinstance(item, int) or item < len(data) else None
        elif position == len(loc) - 1 and isinstance(data, dict) and item != data.get("type", data.get("kind")):
            path.append(item)
    return path


def dotted(path: list[int | str]) -> str:
    """`force[2].radius`, counted from 1, as a person counts the tables of a file."""
    name = ""
    for item in path:
        name += f"[{item + 1}]" if isinstance(item, int) else f".{item}" if name else item
    return name or "the file"


def _sentence(fault: Any, path: list[int | str], model: type[BaseModel]) -> str:
    name, kind, context, given = dotted(path), fault["type"], fault.get("ctx", {}), fault["input"]
    if kind == "extra_forbidden":
        known = sorted(_known_keys(model, fault["loc"][:-1]))
        near = difflib.get_close_matches(str(path[-1]), known, n=1, cutoff=0.5)
        hint = f"did you mean {near[0]!r}?" if near else f"known are {', '.join(known)}"
        return f"unknown key {name!r}; {hint}"
    if kind == "missing":
        return f"{name!r} is missing"
    if kind in ("union_tag_not_found", "union_tag_invalid"):
        key = str(context["discriminator"]).strip("'")
        choices = context.get("expected_tags") or ", ".join(repr(tag) for tag in _tags(model, fault["loc"]))
        return f"'{name}.{key}' must be one of {choices}" + (f", not {context['tag']!r}" if "tag" in context else "")
    if kind == "value_error":
        return f"{name}: {context['error']}" if path else str(context["error"])
    wanted = {
        "float_type": "a number",
        "int_type": "a whole number",
        "int_from_float": "a whole number",
        "string_type": "a text in quotes",
        "bool_type": "true or false",
        "tuple_type": "a list",
        "list_type": "a list",
        "dict_type": "a table",
        "model_type": "a table",
        "model_attributes_type": "a table",
        "finite_number": "a finite number",
        "greater_than": "greater than {gt}",
        "greater_than_equal": "at least {ge}",
        "less_than": "less than {lt}",
        "less_than_equal": "at most {le}",
        "too_short": "a list of at least {min_length}",
        "too_long": "a list of at most {max_length}",
        "literal_error": "one of {expected}",
        "string_too_short": "a text that is not empty",
    }.get(kind)
    if wanted is None:
        return f"{name}: {fault['msg']}"
    given = f", not {_shown(given)}" if kind != "too_short" or given else ", and is empty"
    return f"{name!r} must be {wanted.format(**context)}{given}"


def _shown(value: Any) -> str:
    shown = {True: "true", False: "false"}[value] if isinstance(value, bool) else repr(value)
    if isinstance(value, (tuple, list)):
        shown = f"a list of {len(value)}"
    elif isinstance(value, dict):
        shown = "a table"
    return shown if len(shown) <= 40 else f"{shown[:37]}..."


# -- which keys a place in the recipe knows ---------------------------------------------------------------------------


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for part in get_args(annotation) for model in _models_in(part)]


def _known_keys(model: type[BaseModel], loc: tuple[int | str, ...]) -> set[str]:
    """The keys that the table at `loc` may hold."""
    models = [model]
    for item in loc:
        if isinstance(item, int):
            continue
        inner = [part for model in models if item in model.model_fields for part in _models_in(_field(model, item))]
        tagged = [model for model in models if item in _literals(model) or item == model.__name__]
        models = inner or tagged or models
    return {key for model in models for key in model.model_fields}


def _tags(model: type[BaseModel], loc: tuple[int | str, ...]) -> list[str]:
    """The names by which the union at `loc` tells its members apart."""
    models = [model]
    for item in loc:
        if not isinstance(item, int):
            models = [part for model in models if item in model.model_fields for part in _models_in(_field(model, item))]
    return [tag for model in models for tag in _literals(model)[:1]]


def _field(model: type[BaseModel], name: str) -> Any:
    return model.model_fields[name].annotation


def _literals(model: type[BaseModel]) -> list[str]:
    """The values of the fields that can only have one, which is how the members of a union are told apart."""
    found = []
    for field in model.model_fields.values():
        choices = get_args(field.annotation)
        if get_origin(field.annotation) is Literal and len(choices) == 1:
            found.append(choices[0])
    return found


# -- where it stands in the file --------------------------------------------------------------------------------------

_HEADER = re.compile(r"^\s*(\[\[?)\s*([^\]#]+?)\s*\]")
_KEY = re.compile(r"^\s*([A-Za-z0-9_\"'.-]+)\s*=")


def line_of(text: str, path: list[int | str]) -> int | None:
    """The line of `text`, a TOML file, that defines `path`, or the nearest table above it; None if there is none."""
    counts: dict[str, int] = {}
    here: list[int | str] = []
    best: tuple[int, int | None] = (0, None)
    for number, line in enumerate(text.splitlines(), 1):
        if header := _HEADER.match(line):
            brackets, name = header.groups()
            here = _indexed([part.strip(" \"'") for part in name.split(".")], counts, brackets == "[[")
            found = here
        elif key := _KEY.match(line):
            found = here + [part.strip(" \"'") for part in key.group(1).split(".")]
        else:
            continue
        if found == path[: len(found)] and len(found) > best[0]:
            best = len(found), number
    return best[1]


def _indexed(names: list[str], counts: dict[str, int], repeated: bool) -> list[int | str]:
    """The path of a header: `[[a.b]]` for the second time is ["a", "b", 1]; `[a.b]` below `[[a]]` is ["a", 0, "b"]."""
    path: list[int | str] = []
    for position, name in enumerate(names):
        path.append(name)
        key = ".".join(map(str, path))
        if position == len(names) - 1 and repeated:
            counts[key] = counts.get(key, -1) + 1
        if key in counts:
            path.append(counts[key])
    return path

"""What is wrong with the keys of a recipe, in plain words; the models say what each of them takes."""

from __future__ import annotations

import difflib
import re
from contextlib import suppress
from datetime import date, time
from math import isfinite
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from app.errors import UserError
from app.model.schema import label_of, only_values

_WANTED = {
    "float_type": "a number",
    "float_parsing": "a number",
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_parsing_size": "a smaller number",
    "int_from_float": "a whole number",
    "string_type": "a text in quotes",
    "bool_type": "true or false",
    "tuple_type": "a list",
    "numbers_type": "a number or a list of numbers",
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
}


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
    return UserError(f"{where}{_sentence(fault, path, data, model)}{others}")


def _path_in(data: Any, loc: tuple[int | str, ...]) -> list[int | str]:
    """The keys of `loc` that are keys of the file: without the names of union members that pydantic mixes in."""
    path: list[int | str] = []
    tagged = False  # the kind of the table that `data` is has been passed, which may be the name of one of its keys too
    for position, item in enumerate(loc):
        if isinstance(data, dict) and not tagged and item == data.get("kind"):
            tagged = True
        elif (isinstance(data, dict) and item in data) or (isinstance(data, (list, tuple)) and isinstance(item, int)):
            path.append(item)
            data, tagged = _item(data, item), False
        elif position == len(loc) - 1 and isinstance(data, dict):
            path.append(item)
    return path


def named(path: list[int | str], data: Any) -> tuple[str, str]:
    """The table and the key of `path` as a person calls them: ('force[2] "wind": ', "radius"), counted from 1."""
    table, key = "", ""
    for item in path:
        data = _item(data, item)
        if isinstance(item, int) and isinstance(data, dict):
            name = data.get("name")
            table, key = f"{table}{label_of(key, item + 1, name if isinstance(name, str) else '')}: ", ""
        else:
            key += f"[{item + 1}]" if isinstance(item, int) else f".{item}" if key else item
    return table, key


def _item(data: Any, item: int | str) -> Any:
    try:
        return data[item]
    except (KeyError, IndexError, TypeError):
        return None


def _sentence(fault: Any, path: list[int | str], data: Any, model: type[BaseModel]) -> str:
    kind, context, given = fault["type"], fault.get("ctx", {}), fault["input"]
    table, key = named(path, data)
    if kind == "extra_forbidden":
        known = sorted(_known_keys(model, fault["loc"][:-1]))
        near = difflib.get_close_matches(str(path[-1]), known, n=1, cutoff=0.5)
        hint = f"did you mean {near[0]!r}?" if near else f"known are {', '.join(known)}"
        return f"{table}unknown key {key!r}; {hint}"
    if kind == "missing":
        return f"{table}{key!r} is missing"
    if kind in ("union_tag_not_found", "union_tag_invalid"):
        tag = str(context["discriminator"]).strip("'")
        choices = ", ".join(repr(tag) for tag in _tags(model, fault["loc"]))
        but = f", not {_shown(given[tag])}" if "tag" in context else ""
        return f"{table}{tag!r} must be one of {choices}{but}"
    if kind == "value_error":
        return f"{table}{key}{': ' if key else ''}{context['error']}"
    wanted = _WANTED.get(kind)
    if wanted is None:
        return f"{table}{key}: {fault['msg']}"
    if path and not key:  # a table of a list, where something else had to be
        table, key = named(path[:-1], data)
        key += f"[{int(path[-1]) + 1}]"
    bounds = {name: f"{bound:g}" if isinstance(bound, float) else bound for name, bound in context.items()}
    but = f", not {_shown(given)}" if kind != "too_short" or given else ", and is empty"
    if kind == "tuple_type" and isinstance(given, dict) and not table:
        but += f"; begin each with [[{key}]]"
    if kind == "literal_error" and " or " not in context["expected"]:
        wanted = "{expected}"
    return f"{table}{key!r} must be {wanted.format(**bounds)}{but}"


def expected(error: ValidationError) -> str:
    """What a single word had to be and is not, as "at least 1, not 0"; "" where that is not known."""
    fault = error.errors(include_url=False)[0]
    kind, given = fault["type"], str(fault["input"])
    with suppress(ValueError):
        kind = kind if isfinite(float(given)) else "finite_number"
    wanted = _WANTED.get(kind, "")
    bounds = {name: f"{bound:g}" for name, bound in fault.get("ctx", {}).items() if isinstance(bound, (int, float))}
    return wanted and f"{wanted.format_map(bounds)}, not {given}"


def _shown(value: Any) -> str:
    shown = repr(value)
    if isinstance(value, bool):
        shown = "true" if value else "false"
    elif isinstance(value, str):
        shown = f'"{value}"'
    elif isinstance(value, (tuple, list)):
        shown = f"a list of {len(value)}"
    elif isinstance(value, dict):
        shown = "a table"
    elif isinstance(value, (date, time)):
        shown = str(value)
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
        tagged = [model for model in models if item in _kinds(model) or item == model.__name__]
        models = inner or tagged or models
    return {key for model in models for key in model.model_fields}


def _tags(model: type[BaseModel], loc: tuple[int | str, ...]) -> list[str]:
    """The names by which the union at `loc` tells its members apart."""
    models = [model]
    for item in loc:
        if not isinstance(item, int):
            models = [
                part for model in models if item in model.model_fields for part in _models_in(_field(model, item))
            ]
    return [tag for model in models for tag in _kinds(model)]


def _field(model: type[BaseModel], name: str) -> Any:
    return model.model_fields[name].annotation


def _kinds(model: type[BaseModel]) -> tuple[str, ...]:
    """By which the members of a union are told apart."""
    return only_values(model.model_fields["kind"]) if "kind" in model.model_fields else ()


# -- where it stands in the file --------------------------------------------------------------------------------------

# Each repetition ends where the next begins, or a line of many spaces would be tried again from each of them.
_HEADER = re.compile(r"^\s*(\[\[?)([^\]#]+)\]")
_KEY = re.compile(r"^\s*([A-Za-z0-9_\"'.-]+)\s*=")


def line_of(text: str, path: list[int | str]) -> int | None:
    """The line of `text`, a TOML file, that defines `path`, or the nearest table above it; None if there is none."""
    counts: dict[str, int] = {}
    here: list[int | str] = []
    best: tuple[int, int | None] = (0, None)
    for number, line in enumerate(text.splitlines(), 1):
        if header := _HEADER.match(line):
            brackets, name = header.groups()
            here = _indexed([part.strip(" \t\"'") for part in name.split(".")], counts, brackets == "[[")
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

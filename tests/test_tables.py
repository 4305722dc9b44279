"""The tables of the program, as `golden/tables.txt` has them: a change of one is a line there.

After a change that is meant: `FLUIDWARP_GOLDEN=write pytest tests/test_tables.py`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from importlib import import_module
from inspect import signature
from itertools import product
from pathlib import Path
from pkgutil import walk_packages
from typing import Any

from pydantic import BaseModel

import app.media
import app.model
import app.ui
import app.work
import solver
from app.media import clip, encoders, formats
from app.model import presets, tools
from app.ui import actions, editor_state, export_choices, key_sheet
from app.ui.preferences import Preferences
from app.work.jobs import MapOutput, Outputs
from support.golden import GOLDEN, WRITES

FILE, DEFAULTS = GOLDEN / "tables.txt", GOLDEN / "defaults.txt"
PLACES = re.compile(r" at 0x[0-9a-f]+")  # in memory


def told(value: Any) -> str:
    """A value without its functions, its sets in order."""
    if is_dataclass(value) and not isinstance(value, type):
        parts = {part.name: getattr(value, part.name) for part in fields(value)}
        return f"({', '.join(f'{name}={told(part)}' for name, part in parts.items() if not callable(part))})"
    if isinstance(value, (set, frozenset)):
        return told(sorted(value))
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key}: {told(part)}' for key, part in value.items() if not callable(part))}}}"
    if isinstance(value, (tuple, list)):
        return f"[{', '.join(map(told, value))}]"
    return str(value) if isinstance(value, Path) else repr(value)


def defaults(called: Any) -> str:
    """What need not be given, and what it is then."""
    try:
        parts = signature(called).parameters.values()
    except (TypeError, ValueError):
        return ""
    return ", ".join(f"{part.name}={told(part.default)}" for part in parts if part.default is not part.empty)


def rows() -> Iterator[str]:
    for ending, container in encoders.ANIMATIONS.items():
        yield f"{ending}: {told(container)}, codecs {list(container.codecs)}"
        for codec, alpha, bits, quality in product(container.codecs, (False, True), (8, 16), (None, 70)):
            if codec not in ("h265", "av1"):  # some ffmpegs have none
                options = container.encoding(codec)(encoders.Stream(alpha, bits, quality, loops=3))
                yield f"{codec}, {alpha=}, {bits=}, {quality=}: {' '.join(options)}"
    yield f"largest: {told(encoders.LARGEST)}"
    yield f"colours: {told(clip.CODES)}"
    for kind in formats.TABLE:
        yield f"{kind.name}: {told(kind)}"
    for one in (*presets.FEELS, *presets.BRUSHES, *tools.TOOLS, *actions.ACTIONS.values(), *export_choices.PRESETS):
        yield f"{type(one).__name__} {told(one)}"
    for label, files in export_choices.KINDS:
        yield from (f"{label}: {told(file)}" for file in files)
    yield f"rated: {export_choices.RATED}"
    yield f"brush: {told(tools.BrushSettings())} {told(editor_state.LIMITS)}"
    yield f"window: {told(Preferences())} {told(editor_state.overlays())}"
    yield from (f"mouse: {line}" for line in key_sheet.MOUSE)
    yield f"outputs: {told(Outputs(None))} {told(MapOutput(Path('m.exr')))}"
    for name in sorted(solver.__all__):
        one = getattr(solver, name)
        methods = [part for part in dir(one) if not part.startswith("_")] if isinstance(one, type) else []
        for called, what in ((name, one), *((f"{name}.{part}", getattr(one, part)) for part in methods)):
            if callable(what) and (given := defaults(what)):
                yield f"{called}: {given}"


def offered() -> Iterator[tuple[str, Any]]:
    """What the modules of the rooms offer one another, with its methods."""
    rooms = [app.model, app.media, app.work, app.ui]
    names = sorted(
        one.name for room in rooms for one in walk_packages(room.__path__, f"{room.__name__}.") if not one.ispkg
    )
    for name in names:
        for part, one in sorted(vars(import_module(name)).items()):
            if getattr(one, "__module__", "") == name and not part.startswith("_") and callable(one):
                yield f"{name}.{part}", one
                methods = vars(one).items() if isinstance(one, type) and not issubclass(one, BaseModel) else ()
                yield from ((f"{name}.{part}.{key}", value) for key, value in methods if not key.startswith("_"))


def test_what_need_not_be_given_is_as_it_is_written_down() -> None:
    """Recipes have a file of their own; what is made anew each time is told as that."""
    found = []
    for name, one in offered():
        called = getattr(one, "__func__", one)
        is_of_a_recipe = isinstance(one, type) and issubclass(one, BaseModel)
        if callable(called) and not is_of_a_recipe and (given := defaults(called)):
            found.append(f"{name}: {PLACES.sub('', given)}")
    if WRITES:
        DEFAULTS.write_text("\n".join(found) + "\n", "utf-8")
    assert found == DEFAULTS.read_text("utf-8").splitlines()


def test_the_tables_are_as_they_are_written_down() -> None:
    found = list(rows())
    if WRITES:
        FILE.write_text("\n".join(found) + "\n", "utf-8")
    assert found == FILE.read_text("utf-8").splitlines()
